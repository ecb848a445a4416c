//! Flush joints between pieces of different kinds: terrain and plate, a free peg in a plate, and tiles
//! that are held by joints.

use crate::common::draw::WideDraw;
use crate::common::prelude::*;
use crate::floors::{block, moved, on_terrain};
use crate::shapes::{at, attitude, standing};
use tumble_core::geometry::terrain::HeightField;

const GRAVITY: f64 = 9.81;

fn empty(bodies: Vec<RigidBody>, ground: Option<Plane>, friction: f64) -> World {
    World::new(Parameters { ground, friction, ..Parameters::new(bodies) }).unwrap()
}

/// First step of a run whose body 0 moves otherwise than `expected` at this time (s), with its velocity.
fn deviates(
    world: &World,
    states: Vec<State>,
    steps: usize,
    expected: impl Fn(f64) -> Vector3<f64>,
) -> Option<String> {
    let mut simulation = simulate(world, &states);
    let mut record = StepRecord::new();
    for k in 0..steps {
        simulation.step(&mut record).unwrap();
        let found = record.next().velocity;
        let status = record.status();
        let is_solved = matches!(status, StepStatus::Converged | StepStatus::Retried);
        let off = (found - expected(0.002 * (k as f64 + 0.5))).norm();
        // NaN is not near.
        let is_near = off < 1e-6;
        if !is_solved || !is_near || record.placement() > 0.0 {
            return Some(format!(
                "step {k}: {status:?}, {found:?}, placement {}",
                record.placement()
            ));
        }
    }
    None
}

#[test]
fn wedge_slides_from_a_level_field_to_a_flush_plate() {
    let corners = [
        [-0.1, -0.1, -0.1],
        [0.1, -0.1, -0.1],
        [-0.1, 0.1, -0.1],
        [0.1, 0.1, -0.1],
        [-0.1, -0.1, 0.1],
        [-0.1, 0.1, 0.1],
    ];
    let wedge = Piece::hull(&corners.map(Vector3::from), 0.0).unwrap();
    let (body, middle) = RigidBody::solid(1.0, &[wedge]).unwrap();
    let friction = 0.3;
    let mut wrong = Vec::new();
    for from in [0.0, -0.013, -0.1] {
        for turn in [0.0, 0.3] {
            let plate = vec![block([0.0, -4.0, -0.2], [4.0, 4.0, 0.0])];
            let field = HeightField::new(vec![0.0; 45], 5, [1.0, 1.0]).unwrap();
            let first = field.point(0, 0);
            let shift = Vector3::new(-4.0 - first.x, -4.0 - first.y, 0.0);
            let world = empty(vec![body.clone()], None, friction).with_fixed(plate);
            let world = on_terrain(world, moved(field, &shift));
            let speed = 2.2;
            let way = Vector3::new(1.0, 1.0, 0.0).normalize();
            let turned = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), turn);
            let place = turned * middle + Vector3::new(from - 0.1, 0.1, 0.1);
            let start =
                State { attitude: attitude(&turned), ..at(place.into(), (way * speed).into()) };
            let slides = |t: f64| way * (speed - friction * GRAVITY * t).max(0.0);
            let found = deviates(&world, vec![start], 120, slides);
            wrong.extend(found.map(|found| format!("{from} {turn}: {found}")));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// A plate with a square hole of 0.2 m, its top at z = 0, and free pegs in the hole on a ground below.
#[test]
fn puck_slides_over_a_free_peg_that_is_flush_with_the_plate_around_it() {
    let puck = RigidBody::solid(1.0, &[Piece::cylinder(0.05, 0.08, 24).unwrap()]).unwrap().0;
    let plate = [
        block([-3.0, -3.0, -0.2], [-0.1, 3.0, 0.0]),
        block([0.1, -3.0, -0.2], [3.0, 3.0, 0.0]),
        block([-0.1, -3.0, -0.2], [0.1, -0.1, 0.0]),
        block([-0.1, 0.1, -0.2], [0.1, 3.0, 0.0]),
    ];
    let pegs = [
        ("square", Piece::cuboid(Vector3::repeat(0.1)).unwrap()),
        ("round", Piece::cylinder(0.1, 0.1, 24).unwrap()),
    ];
    let mut wrong = Vec::new();
    for (name, peg) in pegs {
        let peg = RigidBody::solid(1.0, &[peg]).unwrap().0;
        let ground = Plane::new(Vector3::z(), -0.2).unwrap();
        let world = empty(vec![puck.clone(), peg], Some(ground), 0.0).with_fixed(plate.to_vec());
        for y in [0.02, 0.0, 0.05] {
            for speed in [1.2, 2.1] {
                let states =
                    vec![at([-0.5, y, 0.05], [speed, 0.0, 0.0]), at([0.0, 0.0, -0.1], [0.0; 3])];
                let found = deviates(&world, states, 400, |_| Vector3::x() * speed);
                wrong.extend(found.map(|found| format!("{name} peg, y {y}, {speed} m/s: {found}")));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// Four tiles that joints hold in the world.
fn tiles() -> (Vec<RigidBody>, Vec<State>, Vec<Joint>) {
    let tile = RigidBody::solid_box(20.0, Vector3::new(1.0, 1.0, 0.1)).unwrap();
    let (mut bodies, mut states, mut joints) = (Vec::new(), Vec::new(), Vec::new());
    for (x, y) in [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)] {
        let place = Vector3::new(x, y, -0.1);
        let frames = [Vector3::zeros(), place].map(JointFrame::at);
        bodies.push(tile.clone());
        states.push(at(place.into(), [0.0; 3]));
        joints.push(Joint::fixed(1 + joints.len(), None, frames));
    }
    (bodies, states, joints)
}

#[test]
fn wheel_slides_over_the_corner_of_tiles_that_joints_hold() {
    let (tiles, at_rest, joints) = tiles();
    let mut random = WideDraw::wide(8);
    let mut wrong = Vec::new();
    for shape in ["lying cylinder", "capsule", "cylinder", "cube", "ball"] {
        for case in 0..4 {
            let body = standing(shape, &mut random);
            let mut bodies = vec![body.body.clone()];
            bodies.extend(tiles.iter().cloned());
            let world = empty(bodies, None, 0.0).with_joints(joints.clone()).unwrap();
            let way = random.within(-0.4, 0.4);
            let velocity = Vector3::new(way.cos(), way.sin(), 0.0) * random.within(1.0, 3.0);
            let from = -0.12 * velocity;
            let start = body.at([from.x, from.y], random.within(0.0, 6.0), velocity.into());
            let mut states = vec![start];
            states.extend_from_slice(&at_rest);
            let found = deviates(&world, states, 120, |_| velocity);
            wrong.extend(found.map(|found| format!("{shape} {case}: {found}")));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}
