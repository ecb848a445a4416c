//! Steps, walls, grooves, slots and edges that are real stop or hold a body, by closed forms.

use crate::common::draw::WideDraw;
use crate::common::prelude::*;
use crate::floors::{block, world};
use crate::shapes::{at, attitude, standing};
use std::f64::consts::FRAC_PI_4;

const GRAVITY: f64 = 9.81;

fn records(world: &World, states: &[State], steps: usize) -> Vec<StepRecord> {
    self::steps(&mut simulate(world, states), steps, |_| true)
}

/// Sum of the contact forces on body 0 (N).
fn force(record: &StepRecord) -> Vector3<f64> {
    record
        .first()
        .contacts
        .iter()
        .zip(record.first().solution.forces())
        .filter(|(c, _)| c.key.body == 0)
        .map(|(_, f)| f)
        .sum()
}

fn cube(side: f64) -> RigidBody {
    RigidBody::solid_box(1.0, Vector3::repeat(side / 2.0)).unwrap()
}

/// Largest velocity of a cube of 0.2 m along x after a step of the floor with this height (m), at 1
/// m/s.
fn speed_after_step(height: f64) -> f64 {
    let cube = cube(0.2);
    let fixed = vec![
        block([-2.0, -1.0, -0.2], [0.0, 1.0, 0.0]),
        block([0.0, -1.0, -0.2], [2.0, 1.0, height]),
    ];
    let world = world(&cube, false, 0.0).with_fixed(fixed);
    let run = records(&world, &[at([-0.2, 0.03, 0.1], [1.0, 0.0, 0.0])], 250);
    run[249].next().velocity.x
}

/// The size of the cube for tolerances is half its diagonal, 0.17 m. Faces within 1e-6 of it are one.
#[test]
fn step_of_a_hundred_thousandth_of_the_size_stops_a_cube_and_a_tenth_of_it_does_not() {
    let size = 0.1 * 3.0_f64.sqrt();
    for height in [1e-5 * size, 1e-4 * size, 1e-2] {
        assert!(speed_after_step(height) < 0.1, "{height}: {}", speed_after_step(height));
    }
    for height in [0.0, 5e-7 * size, -5e-7 * size] {
        assert!((speed_after_step(height) - 1.0).abs() < 1e-4, "{height}");
    }
}

/// A cube of side s that hits a low step turns about it. Its angular momentum m v s/2 about the step
/// stays but for the moment of the weight in the step, and its inertia there is ⅔ m s²:
///
/// ```text
/// ω = 3 (v − g h)/(4 s)
/// ```
#[test]
fn cube_that_trips_on_a_low_step_turns_with_the_kept_angular_momentum() {
    let (side, speed) = (0.2, 1.0);
    let cube = cube(side);
    let fixed = vec![
        block([-2.0, -1.0, -0.2], [0.0, 1.0, 0.0]),
        block([0.0, -1.0, -0.2], [2.0, 1.0, 1e-5]),
    ];
    let world = world(&cube, false, 0.0).with_fixed(fixed);
    let run = records(&world, &[at([-0.15, 0.0, 0.1], [speed, 0.0, 0.0])], 40);
    let fastest = run.iter().map(|record| record.next().spin.y).fold(0.0, f64::max);
    let expected = 0.75 * (speed - GRAVITY * 0.002) / side;
    assert!((fastest / expected - 1.0).abs() < 1e-4, "{fastest} instead of {expected}");
}

#[test]
fn wall_on_a_floor_stops_a_cube_that_slides_into_it() {
    let cube = cube(0.2);
    for ground in [true, false] {
        let mut fixed = vec![block([1.0, -1.0, 0.0], [1.2, 1.0, 1.0])];
        if !ground {
            fixed.push(block([-2.0, -1.0, -0.2], [2.0, 1.0, 0.0]));
        }
        let world = world(&cube, ground, 0.0).with_fixed(fixed);
        let run = records(&world, &[at([0.5, 0.0, 0.1], [1.0, 0.0, 0.0])], 400);
        let end = run[399].next();
        assert!((end.position.x - 0.9).abs() < 1e-9 && end.velocity.norm() < 1e-9, "{end:?}");
    }
}

/// N = m g/(2 cos 45°) on each wall.
#[test]
fn ball_in_a_groove_of_two_boxes_is_held_by_both() {
    let body = RigidBody::solid(1.0, &[Piece::sphere(0.1).unwrap()]).unwrap().0;
    let wall = |angle: f64| {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), angle);
        let piece = Piece::cuboid(Vector3::new(1.0, 0.5, 0.1)).unwrap();
        let shift = turn * Vector3::new(0.0, 0.4 * angle.signum(), -0.1);
        piece.moved_by(turn.to_rotation_matrix().matrix(), &shift).unwrap()
    };
    let fixed = vec![wall(FRAC_PI_4), wall(-FRAC_PI_4)];
    let world = world(&body, false, 0.0).with_fixed(fixed);
    let height = 0.1 * 2.0_f64.sqrt();
    let run = records(&world, &[at([0.0, 0.0, height], [0.0; 3])], 20);
    let expected = GRAVITY / 2.0_f64.sqrt();
    let forces: Vec<f64> = run[19].first().solution.forces().map(|f| f.norm()).collect();
    assert_eq!(forces.len(), 2);
    assert!(forces.iter().all(|f| (f - expected).abs() < 1e-9), "{forces:?}");
    assert!((run[19].next().position.z - height).abs() < 1e-12);
}

#[test]
fn box_on_two_tiles_that_part_stays_where_it_is() {
    let tile = RigidBody::solid_box(5.0, Vector3::new(0.5, 0.5, 0.1)).unwrap();
    let plank = RigidBody::solid_box(1.0, Vector3::new(0.4, 0.2, 0.05)).unwrap();
    let parameters = Parameters::new(vec![plank, tile.clone(), tile]);
    let world = euler(Parameters { friction: 0.0, ..parameters });
    let states = [
        at([0.0, 0.0, 0.25], [0.0; 3]),
        at([-0.5, 0.0, 0.1], [-0.2, 0.0, 0.0]),
        at([0.5, 0.0, 0.1], [0.2, 0.0, 0.0]),
    ];
    // After 0.5 s there is a gap of 0.2 m below the plank of 0.8 m.
    for record in records(&world, &states, 250) {
        let plank = record.next();
        assert!((plank.position - states[0].position).norm() < 1e-9, "{plank:?}");
        assert!((force(&record) - Vector3::z() * GRAVITY).norm() < 1e-6);
        assert!((record.next_states()[2].velocity.x - 0.2).abs() < 1e-9);
    }
}

/// A wheel of radius R that rolls over a slot of width w turns about the first edge and then hits the
/// second one. With sin α = w/(2R) it keeps of its spin
///
/// ```text
/// (I + m R² cos 2α)/(I + m R²) = 1 − ⅔ (1 − cos 2α)
/// ```
#[test]
fn wheel_that_rolls_over_a_slot_loses_the_speed_of_the_impact_on_its_edge() {
    let (radius, width, speed) = (0.1, 0.005, 0.5);
    let wheel = RigidBody::solid(1.0, &[Piece::cylinder(0.05, radius, 24).unwrap()]).unwrap().0;
    let parameters =
        Parameters { ground: None, friction: 1.0, time_step: 1e-4, ..Parameters::new(vec![wheel]) };
    let fixed = vec![
        block([-2.0, -1.0, -0.2], [0.0, 1.0, 0.0]),
        block([width, -1.0, -0.2], [2.0, 1.0, 0.0]),
    ];
    let world = euler(parameters).with_fixed(fixed);
    let lying = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::FRAC_PI_2);
    let spin = lying.inverse() * Vector3::new(0.0, speed / radius, 0.0);
    let start =
        State { attitude: attitude(&lying), spin, ..at([-0.05, 0.0, radius], [speed, 0.0, 0.0]) };
    let run = records(&world, &[start], 2000);
    let lost = 1.0 - run[1999].next().velocity.x / speed;
    let half = width / (2.0 * radius);
    let expected = 2.0 / 3.0 * (1.0 - (2.0 * half.asin()).cos());
    assert!((lost / expected - 1.0).abs() < 0.25, "lost {lost}, expected {expected}");
}

/// A body with an edge or a vertex down, above a block with an edge up. One contact holds it.
#[test]
fn edge_across_an_edge_and_vertex_on_an_edge_carry_the_weight() {
    let ridge = |angle: f64| {
        let along = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle);
        let turn = along * UnitQuaternion::from_axis_angle(&Vector3::x_axis(), FRAC_PI_4);
        let piece = Piece::cuboid(Vector3::new(1.0, 0.1, 0.1)).unwrap();
        let down = Vector3::new(0.0, 0.0, -0.1 * 2.0_f64.sqrt());
        piece.moved_by(turn.to_rotation_matrix().matrix(), &down).unwrap()
    };
    let cube = cube(0.2);
    let edge_down = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), FRAC_PI_4);
    let apex = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
    let pyramid = standing("pyramid", &mut WideDraw::wide(3)).body;
    let tip = pyramid.pieces()[0].core().vertices().iter().map(|v| v.z).fold(0.0, f64::max);
    let cases = [
        (cube, edge_down, 0.1 * 2.0_f64.sqrt(), std::f64::consts::FRAC_PI_2),
        (pyramid, apex, tip, 0.3),
    ];
    for (body, turn, height, angle) in cases {
        // A vertex on an edge leaves the normal open up to 45°, which the friction covers.
        let world = world(&body, false, 2.0).with_fixed(vec![ridge(angle)]);
        // The body lands in the first steps.
        let place = [0.0, 0.0, height + 1e-6];
        let start = State { attitude: attitude(&turn), ..at(place, [0.0; 3]) };
        let run = records(&world, &[start], 5);
        assert!((force(&run[4]) - Vector3::z() * GRAVITY).norm() < 1e-6, "{:?}", force(&run[4]));
    }
}

/// A wall of two flush bricks pushes bodies that slide along it across its face only.
#[test]
fn bodies_pressed_against_a_wall_of_bricks_keep_their_speed_along_it() {
    let mut random = WideDraw::wide(5);
    let bricks =
        vec![block([-1.0, 0.0, 0.0], [0.0, 1.0, 1.0]), block([0.0, 0.0, 0.0], [0.5, 1.0, 1.0])];
    for shape in ["diamond", "prism", "cylinder", "ball", "capsule", "cube"] {
        for past_the_end in [false, true] {
            for case in 0..6 {
                let body = match shape {
                    "diamond" => standing("cube", &mut random),
                    _ => standing(shape, &mut random),
                };
                let turn = if shape == "diamond" { FRAC_PI_4 } else { 0.0 };
                let world = world(&body.body, true, 0.0).with_fixed(bricks.clone());
                let speed = random.within(0.5, 2.0);
                let start = body.at([0.0, 0.0], turn, [speed, 0.0, 0.0]);
                let side = body.reach_along(&start, &Vector3::y());
                let from = if past_the_end { 0.15 } else { -0.45 };
                let position = Vector3::new(from, -side, start.position.z);
                let start = State { position, ..start };
                let mut simulation = simulate(&world, &[start]);
                let wrench = Wrench { force: Vector3::y() * 5.0, ..Wrench::zero() };
                simulation.set_wrench(0, wrench).unwrap();
                let mut record = StepRecord::new();
                let mut along = speed;
                for _ in 0..((0.6 / speed / 0.002) as usize) {
                    simulation.step(&mut record).unwrap();
                    let sideways =
                        record.first().contacts.iter().zip(record.first().solution.forces());
                    // Beyond the end of the wall the last edge pushes the body forward.
                    for (contact, force) in sideways {
                        assert!(
                            force.x >= -1e-6,
                            "{shape} {case} {past_the_end} k {}: {:?} pushed back by {force:?}",
                            record.index,
                            contact.key
                        );
                    }
                    along = record.next().velocity.x;
                }
                assert!(along >= speed - 1e-6, "{shape} {case} {past_the_end}: {along} of {speed}");
                if !past_the_end {
                    assert!((along - speed).abs() < 1e-6, "{shape} {case}: {along} of {speed}");
                }
            }
        }
    }
}
