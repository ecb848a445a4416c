//! Bodies do not sink in steps that count as solved: the depth of all pieces, measured on the shapes.

use crate::campaign::size;
use crate::floors::{block, world};
use crate::shapes::{Random, attitude};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use std::sync::Arc;
use tumble_core::contact::Candidates;
use tumble_core::geometry::terrain::HeightField;
use tumble_core::geometry::{Piece, Terrain};
use tumble_core::mechanics::{RigidBody, State};
use tumble_core::simulation::{Motion, Simulation, StepRecord};
use tumble_core::step::StepStatus;
use tumble_core::world::{Fixed, FixedTerrain, World};

/// Largest depth of a solved step (m).
const DEEP: f64 = 1e-4;

/// Solved steps of a run that are deep or make energy.
fn wrong_steps(world: &World, start: &State, steps: usize) -> Vec<String> {
    let motion = Motion::native(world);
    let mut simulation = Simulation::new(world.clone(), [*start], motion).unwrap();
    let (mut record, mut candidates) = (StepRecord::new(), Candidates::new());
    let mut wrong = Vec::new();
    let mut before = energy(world, start);
    for _ in 0..steps {
        simulation.step(&mut record).unwrap();
        let after = energy(world, simulation.state());
        let made = after.0 + after.1 - before.0 - before.1;
        let most = 0.01 * before.0.max(after.0) + 1e-5;
        before = after;
        if matches!(record.status(), StepStatus::Failed | StepStatus::Wild) {
            continue;
        }
        let deepest = candidates.deepest_overlap(world, record.next_states());
        let depth = deepest.map_or(0.0, |(depth, ..)| depth);
        // NaN is not small.
        if depth > DEEP || made.is_nan() || made > most {
            wrong.push(format!("k {}: {depth:.1e} m deep, makes {made:.1e} J", record.index));
        }
    }
    wrong
}

/// Kinetic energy and the energy of the height of the only body (J).
fn energy(world: &World, state: &State) -> (f64, f64) {
    let body = &world.bodies()[0];
    let turning = 0.5 * state.spin.dot(&(body.inertia() * state.spin));
    let moving = 0.5 * body.mass() * state.velocity.norm_squared();
    (turning + moving, body.mass() * 9.81 * state.position.z)
}

fn vector(random: &mut Random, size: f64) -> Vector3<f64> {
    Vector3::from_fn(|_, _| random.between(-size, size))
}

/// A hull with a rounded shape of random corners.
fn hull(random: &mut Random) -> RigidBody {
    loop {
        let corners: Vec<_> = (0..8).map(|_| vector(random, 0.11)).collect();
        let Ok(piece) = Piece::hull(&corners, 0.0) else { continue };
        if let Ok((body, _)) = RigidBody::solid(0.4, &[piece]) {
            return body;
        }
    }
}

#[test]
fn hulls_do_not_sink_into_coarse_terrain() {
    let mut wrong = Vec::new();
    for seed in 0..size(60, 1000) as u64 {
        let mut random = Random::new(seed);
        let body = hull(&mut random);
        let heights = (0..25).map(|_| random.between(0.0, 0.25)).collect();
        let field = HeightField::new(heights, 5, [0.2, 0.2]).unwrap();
        let shift = Vector3::new(-0.4, -0.4, 0.0);
        let terrain = Terrain::from(field.moved_by(&Matrix3::identity(), &shift).unwrap());
        let terrain = FixedTerrain { terrain: Arc::new(terrain), friction: None };
        let world = world(&body, false, 0.0).with_terrains(vec![terrain]).unwrap();
        let turn = UnitQuaternion::from_scaled_axis(vector(&mut random, 3.0));
        let start = State {
            position: vector(&mut random, 0.15) + Vector3::z() * 0.55,
            attitude: attitude(&turn),
            velocity: vector(&mut random, 1.0),
            spin: vector(&mut random, 4.0),
        };
        let found = wrong_steps(&world, &start, 700);
        if let Some(first) = found.first() {
            wrong.push(format!("{seed}: {} steps, first {first}", found.len()));
        }
    }
    assert!(wrong.is_empty(), "{} runs: {wrong:#?}", wrong.len());
}

#[test]
fn cones_do_not_sink_between_a_plate_and_a_ramp() {
    let mut wrong = Vec::new();
    for seed in 0..size(60, 1000) as u64 {
        let mut random = Random::new(seed);
        let height = random.between(0.06, 0.2);
        let radius = random.between(0.04, 0.1);
        let cone = Piece::cone(0.5 * height, radius, 24).unwrap();
        let (body, _) = RigidBody::solid(1.0, &[cone]).unwrap();
        let ramp = [
            [0.0, -0.3, 0.0],
            [0.6, -0.3, 0.0],
            [0.6, -0.3, 0.25],
            [0.0, 0.3, 0.0],
            [0.6, 0.3, 0.0],
            [0.6, 0.3, 0.25],
        ];
        let ramp = Piece::hull(&ramp.map(Vector3::from), 0.0).unwrap();
        let turn = UnitQuaternion::from_scaled_axis(Vector3::z() * random.between(-3.0, 3.0));
        let ramp = ramp.moved_by(turn.to_rotation_matrix().matrix(), &Vector3::zeros()).unwrap();
        let mut fixed = vec![Fixed { piece: ramp, friction: None }];
        let has_ground = seed % 2 == 0;
        if !has_ground {
            fixed.push(block([-4.0, -4.0, -0.2], [4.0, 4.0, 0.0]));
        }
        let world = world(&body, has_ground, 0.0).with_fixed(fixed).unwrap();
        let angle = random.between(-3.0, 3.0);
        let from = turn * Vector3::x() * 0.3 + Vector3::new(angle.cos(), angle.sin(), 0.0) * 0.7;
        let toward = -(from - turn * Vector3::x() * 0.3).normalize();
        // A cone stands on its base, or lies on its side.
        let lies = random.between(0.0, 1.0) < 0.5;
        let tilt =
            if lies { std::f64::consts::FRAC_PI_2 - (0.5 * radius / height).atan() } else { 0.0 };
        let start = State {
            position: from + Vector3::z() * (0.3 * height + if lies { 0.1 } else { 0.02 }),
            attitude: attitude(&UnitQuaternion::from_scaled_axis(Vector3::y() * tilt)),
            velocity: toward * random.between(0.5, 1.5),
            spin: Vector3::z() * random.between(-9.0, 9.0),
        };
        let found = wrong_steps(&world, &start, 700);
        if let Some(first) = found.first() {
            wrong.push(format!("{seed}: {} steps, first {first}", found.len()));
        }
    }
    assert!(wrong.is_empty(), "{} runs: {wrong:#?}", wrong.len());
}
