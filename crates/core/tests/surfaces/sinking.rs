//! Bodies do not sink in steps that count as solved: the depth of all pieces, measured on the shapes.

use crate::campaign::size;
use crate::common::draw::WideDraw;
use crate::common::prelude::*;
use crate::floors::{block, moved, on_terrain, world};
use crate::shapes::attitude;
use crate::tumbling::energy;
use tumble_core::geometry::terrain::HeightField;

/// Largest depth of a solved step (m).
const DEEP: f64 = 1e-4;

/// Solved steps of a run that are deep or make energy.
fn wrong_steps(world: &World, start: &State, steps: usize) -> Vec<String> {
    let mut simulation = simulate(world, &[*start]);
    let (mut record, mut candidates) = (StepRecord::new(), Candidates::new());
    let mut wrong = Vec::new();
    let mut before = energy(world.bodies(), &[*start]);
    for _ in 0..steps {
        simulation.step(&mut record).unwrap();
        let after = energy(world.bodies(), simulation.states());
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

/// A hull with a rounded shape of random corners.
fn hull(random: &mut WideDraw) -> RigidBody {
    loop {
        let corners: Vec<_> = (0..8).map(|_| random.vector(0.11)).collect();
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
        let mut random = WideDraw::wide(seed);
        let body = hull(&mut random);
        let heights = (0..25).map(|_| random.within(0.0, 0.25)).collect();
        let field = HeightField::new(heights, 5, [0.2, 0.2]).unwrap();
        let shift = Vector3::new(-0.4, -0.4, 0.0);
        let world = on_terrain(world(&body, false, 0.0), moved(field, &shift));
        let turn = UnitQuaternion::from_scaled_axis(random.vector(3.0));
        let start = State {
            position: random.vector(0.15) + Vector3::z() * 0.55,
            attitude: attitude(&turn),
            velocity: random.vector(1.0),
            spin: random.vector(4.0),
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
        let mut random = WideDraw::wide(seed);
        let height = random.within(0.06, 0.2);
        let radius = random.within(0.04, 0.1);
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
        let turn = UnitQuaternion::from_scaled_axis(Vector3::z() * random.within(-3.0, 3.0));
        let ramp = ramp.moved_by(turn.to_rotation_matrix().matrix(), &Vector3::zeros()).unwrap();
        let mut fixed = vec![ramp];
        let has_ground = seed % 2 == 0;
        if !has_ground {
            fixed.push(block([-4.0, -4.0, -0.2], [4.0, 4.0, 0.0]));
        }
        let world = world(&body, has_ground, 0.0).with_fixed(fixed);
        let angle = random.within(-3.0, 3.0);
        let from = turn * Vector3::x() * 0.3 + Vector3::new(angle.cos(), angle.sin(), 0.0) * 0.7;
        let toward = -(from - turn * Vector3::x() * 0.3).normalize();
        // A cone stands on its base, or lies on its side.
        let lies = random.within(0.0, 1.0) < 0.5;
        let tilt =
            if lies { std::f64::consts::FRAC_PI_2 - (0.5 * radius / height).atan() } else { 0.0 };
        let start = State {
            position: from + Vector3::z() * (0.3 * height + if lies { 0.1 } else { 0.02 }),
            attitude: attitude(&UnitQuaternion::from_scaled_axis(Vector3::y() * tilt)),
            velocity: toward * random.within(0.5, 1.5),
            spin: Vector3::z() * random.within(-9.0, 9.0),
        };
        let found = wrong_steps(&world, &start, 700);
        if let Some(first) = found.first() {
            wrong.push(format!("{seed}: {} steps, first {first}", found.len()));
        }
    }
    assert!(wrong.is_empty(), "{} runs: {wrong:#?}", wrong.len());
}
