//! Rounded features that roll and slide on each other: forces and accelerations in closed form.

use crate::common::prelude::*;
use crate::curved_common as common;

use common::{G, MASS, at, body, capsule_along_y, normal_forces, run, sphere, world};

fn total_force(record: &StepRecord) -> Vector3<f64> {
    record.first().solution.forces().sum()
}

// A ball in a groove along x. The walls make the angle φ with the plane y = 0.

const RADIUS: f64 = 0.1;
/// Slope of the groove towards +x [degrees].
const SLOPE: f64 = 20.0;

/// Walls of the groove: boxes whose upper faces form the groove.
fn groove(phi: f64) -> Vec<Piece> {
    let (sin, cos) = phi.sin_cos();
    let wall = |side: f64| {
        // Columns: along the groove, up the wall, out of the wall towards the ball.
        let normal = Vector3::new(0.0, -side * cos, sin);
        let up = normal.cross(&Vector3::x());
        let turn = Matrix3::from_columns(&[Vector3::x(), up, normal]);
        let half_sides = Vector3::new(4.0, 0.5, 0.05);
        let along_wall = Vector3::new(0.0, side * sin, cos) * 0.5;
        let box_ = Piece::cuboid(half_sides).unwrap();
        box_.moved_by(&turn, &(along_wall - normal * 0.05)).unwrap()
    };
    vec![wall(1.0), wall(-1.0)]
}

fn in_groove(phi: f64, friction: f64, time_step: f64) -> Vec<StepRecord> {
    let alpha = SLOPE.to_radians();
    let gravity = G * Vector3::new(alpha.sin(), 0.0, -alpha.cos());
    let world = world(vec![body(sphere(RADIUS))], groove(phi), (gravity, friction, time_step));
    let position = Vector3::new(-2.0, 0.0, RADIUS / phi.sin());
    let start = at(position, Vector3::zeros(), Vector3::zeros());
    run(&world, &[start], (0.3 / time_step).round() as usize)
}

/// Largest value of a quantity after the first three steps.
fn settled(records: &[StepRecord], of: impl Fn(&StepRecord) -> f64) -> f64 {
    records[3..].iter().map(of).fold(0.0, f64::max)
}

const GROOVES: [f64; 3] = [30.0, 45.0, 60.0];
const FRICTIONS: [f64; 3] = [0.5, 1.0, 2.0];

/// Checks that the order of the bodies does not matter. Two spinning balls of different size
/// overlap by a tenth of a millimetre.
#[test]
fn balls_that_overlap_push_each_other_in_any_order() {
    let bodies = [body(sphere(0.1)), body(sphere(0.3))];
    let start = |x: f64, spin: f64| {
        at(Vector3::new(x, 0.0, 0.0), Vector3::zeros(), Vector3::new(0.0, spin, 2.0))
    };
    let states = [start(0.0, 5.0), start(0.3999, -3.0)];
    let first = |order: [usize; 2]| {
        let bodies = order.map(|k| bodies[k].clone()).to_vec();
        let world = world(bodies, Vec::new(), (Vector3::zeros(), 0.5, 0.002));
        let record = run(&world, &order.map(|k| states[k]), 1).remove(0);
        assert!(record.first().solution.contacts[0].carries_force());
        [0, 1].map(|k| record.next_states()[order[k]])
    };
    for (one, two) in first([0, 1]).iter().zip(first([1, 0])) {
        // The error is rounding. A lever that ended on one of the balls would make an error of 5e-5
        // m times the impulse over the inertia.
        assert!(
            (one.velocity - two.velocity).norm() < 1e-12 && (one.spin - two.spin).norm() < 1e-11
        );
    }
}

/// Checks a ball that rolls down a groove from rest.
///
/// The ball rolls about a line through its centre, across the groove. The line is d = r sin φ above
/// the touching points: v' = g sin α/(1 + I/(m d²)). The forces across the groove add up to m g cos
/// α upwards and to zero sideways. Both hold for every friction, to a hundredth.
#[test]
fn a_ball_rolls_down_a_groove() {
    let alpha = SLOPE.to_radians();
    for phi in GROOVES.map(f64::to_radians) {
        for friction in FRICTIONS {
            let name = format!("{:.0} degrees, mu {friction}", phi.to_degrees());
            let lever = RADIUS * phi.sin();
            let moment = 0.4 * MASS * RADIUS * RADIUS;
            let rate = G * alpha.sin() / (1.0 + moment / (MASS * lever * lever));
            let errors = [2e-3, 1e-3].map(|h| {
                let records = in_groove(phi, friction, h);
                let weight = MASS * G * alpha.cos();
                let force = settled(&records, |record| {
                    let across = total_force(record) - Vector3::new(0.0, 0.0, weight);
                    across.yz().norm() / weight
                });
                let speed = settled(&records, |record| {
                    let exact = rate * h * (record.index + 1) as f64;
                    (record.next().velocity[0] - exact).abs() / exact
                });
                (force, speed)
            });
            assert!(errors[0].0 < 1e-2 && errors[0].1 < 1e-2, "{name}: {errors:?}");
            // The error is of first order or better, or a hundredth of the tolerance.
            let falls = |a: f64, b: f64| b <= 0.6 * a || b < 1e-4;
            assert!(falls(errors[0].0, errors[1].0), "{name}: {errors:?}");
            assert!(falls(errors[0].1, errors[1].1), "{name}: {errors:?}");
        }
    }
}

/// Checks the normal forces on the walls of a groove. A rolling ball brings new points to the walls
/// all the time, so that friction across the groove carries none of the weight. Every wall carries
/// N = m g cos α/(2 sin φ), to a hundredth, in every step after the first ones.
#[test]
fn each_wall_of_a_groove_bears_its_part() {
    let alpha = SLOPE.to_radians();
    for phi in GROOVES.map(f64::to_radians) {
        for friction in FRICTIONS {
            let exact = MASS * G * alpha.cos() / (2.0 * phi.sin());
            let errors = [2e-3, 1e-3].map(|h| {
                settled(&in_groove(phi, friction, h), |record| {
                    let forces = normal_forces(record);
                    if forces.len() != 2 {
                        return f64::INFINITY;
                    }
                    forces.iter().map(|n| (n - exact).abs() / exact).fold(0.0, f64::max)
                })
            });
            let name = format!("{:.0} degrees, mu {friction}: {errors:?}", phi.to_degrees());
            assert!(errors[0] < 1e-2, "{name}");
            assert!(errors[1] <= 0.6 * errors[0] || errors[1] < 1e-4, "{name}");
        }
    }
}

/// Checks a ball between a slope of 20° and the vertical side of a fixed box, rolling along both.
/// In every step after the first ones the total force is the weight. A contact carries at most 1.5
/// times the frictionless wedge force. Friction adds to the wedge force while a contact slides.
#[test]
fn a_ball_between_a_slope_and_a_box_does_not_jam() {
    let alpha = SLOPE.to_radians();
    let (sin, cos) = alpha.sin_cos();
    let normal = Vector3::new(0.0, -sin, cos);
    let turn = Matrix3::from_columns(&[Vector3::x(), normal.cross(&Vector3::x()), normal]);
    let slope = Piece::cuboid(Vector3::new(4.0, 2.0, 0.05)).unwrap();
    let slope = slope.moved_by(&turn, &(-0.05 * normal)).unwrap();
    let stop = Piece::cuboid(Vector3::new(4.0, 0.1, 2.0)).unwrap();
    let stop = stop.moved_by(&Matrix3::identity(), &Vector3::new(0.0, -0.1, 0.0)).unwrap();
    // The slope falls towards −y, against the box whose side is y = 0.
    for friction in [0.2, 0.6, 1.0, 2.0] {
        for speed in [0.0, 0.5, 2.0] {
            let pieces = vec![slope.clone(), stop.clone()];
            let gravity = Vector3::new(0.0, 0.0, -G);
            let world = world(vec![body(sphere(RADIUS))], pieces, (gravity, friction, 2e-3));
            let height = (RADIUS + sin * RADIUS) / cos;
            let position = Vector3::new(-2.0, RADIUS, height);
            let start = at(position, Vector3::new(speed, 0.0, 0.0), Vector3::zeros());
            for record in &run(&world, &[start], 250)[3..] {
                let name = format!("mu {friction}, {speed} m/s, k = {}", record.index);
                let total = total_force(record);
                assert!((total[2] - MASS * G).abs() < 1e-2 * MASS * G, "{name}: {total:?}");
                assert!(total[1].abs() < 1e-2 * MASS * G, "{name}: {total:?}");
                // Without friction: W/cos α on the slope, W tan α on the box.
                for force in normal_forces(record) {
                    assert!(force < 1.5 * MASS * G / cos, "{name}: {force} N");
                }
            }
        }
    }
}

/// Checks a capsule that rolls on two points: v' = g sin α/(1 + I/(m r²)) about its axis. Its
/// points carry m g cos α.
#[test]
fn a_capsule_rolls_down_a_slope() {
    let alpha = SLOPE.to_radians();
    let gravity = G * Vector3::new(alpha.sin(), 0.0, -alpha.cos());
    let plate = Piece::cuboid(Vector3::new(4.0, 1.0, 0.05)).unwrap();
    let plate = plate.moved_by(&Matrix3::identity(), &Vector3::new(0.0, 0.0, -0.05)).unwrap();
    let body = body(capsule_along_y(0.2, RADIUS));
    let rate = G * alpha.sin() / (1.0 + body.inertia()[(1, 1)] / (MASS * RADIUS * RADIUS));
    for friction in [0.5, 2.0] {
        let world = world(vec![body.clone()], vec![plate.clone()], (gravity, friction, 2e-3));
        let position = Vector3::new(-2.0, 0.0, RADIUS);
        let records = run(&world, &[at(position, Vector3::zeros(), Vector3::zeros())], 250);
        for record in &records[3..] {
            let (k, forces) = (record.index, normal_forces(record));
            let weight = MASS * G * alpha.cos();
            assert_eq!(forces.len(), 2, "mu {friction}, k = {k}");
            for force in forces {
                assert!((force - 0.5 * weight).abs() < 1e-2 * weight, "mu {friction}, k = {k}");
            }
            let exact = rate * 2e-3 * (k + 1) as f64;
            let speed = record.next().velocity[0];
            assert!(
                (speed - exact).abs() < 1e-2 * exact,
                "mu {friction}, k = {k}: {speed} {exact}"
            );
        }
    }
}

/// Checks that a cube with rounded edges, thrown on rough ground, comes to rest and gains no
/// energy. The tolerance covers the turn within a step (eq. 28).
#[test]
fn a_rounded_cube_makes_no_energy() {
    let corner = |k: u8| Vector3::from_fn(|axis, _| if k >> axis & 1 == 1 { 0.07 } else { -0.07 });
    let corners: Vec<_> = (0..8).map(corner).collect();
    let body = body(Piece::hull(&corners, 0.03).unwrap());
    let plate = Piece::cuboid(Vector3::new(4.0, 4.0, 0.05)).unwrap();
    let plate = plate.moved_by(&Matrix3::identity(), &Vector3::new(0.0, 0.0, -0.05)).unwrap();
    let gravity = Vector3::new(0.0, 0.0, -G);
    for friction in [0.3, 1.0] {
        let world = world(vec![body.clone()], vec![plate.clone()], (gravity, friction, 2e-3));
        let position = Vector3::new(-1.0, 0.0, 0.25);
        let start = at(position, Vector3::new(1.0, 0.2, 0.0), Vector3::new(1.0, 12.0, -2.0));
        let energy = |state: &State| {
            let spinning = state.spin.dot(&(body.inertia() * state.spin));
            0.5 * (MASS * state.velocity.norm_squared() + spinning) + MASS * G * state.position[2]
        };
        let records = run(&world, &[start], 1000);
        for record in &records {
            let gained = energy(record.next()) - energy(record.state());
            assert!(gained < 1e-3, "mu {friction}, k = {}: {gained} J", record.index);
        }
        let last = records[999].next();
        assert!(last.velocity.norm() < 1e-3 && last.spin.norm() < 1e-2, "{last:?}");
    }
}
