//! Derivatives of steps of cylinders, cones and ellipsoids on the ground.

use super::draw::Draw;
use super::{Tally, compare, step};
use crate::common::prelude::*;
use rand_mt::Mt;

/// A body of every smooth shape, of about 0.2 m.
fn piece(draw: &mut Draw, number: usize) -> Piece {
    let half = Vector3::from_fn(|_, _| draw.within(0.05, 0.2));
    let shape = match number % 3 {
        0 => Piece::cylinder(half[0], half[1], 12),
        1 => Piece::cone(half[0], half[1], 12),
        _ => Piece::ellipsoid(half, 12),
    };
    shape.unwrap()
}

/// Drawn bodies roll, slide and bounce on drawn slopes. Each of the first steps with a force is
/// compared with differences, by every argument.
#[test]
fn smooth_shapes_on_the_ground() {
    let mut draw = Draw(Mt::new(17));
    let mut tally = Tally::default();
    for number in 0..30 {
        let piece = piece(&mut draw, number);
        let normal = Vector3::z() + draw.vector(0.3);
        let parameters = Parameters {
            bodies: vec![RigidBody::solid(1.5, &[piece]).unwrap().0],
            ground: Some(Plane::new(normal, 0.1).unwrap()),
            gravity: Vector3::new(0.0, 0.0, -9.81),
            friction: draw.within(0.0, 1.0),
            time_step: 0.001,
            rotation: Rotation::Momentum,
        };
        let restitution = if number % 5 == 0 { 0.5 } else { 0.0 };
        let world =
            euler(parameters).with_coefficient(Coefficient::Restitution, restitution).unwrap();
        let mut state = State {
            position: Vector3::zeros(),
            attitude: Vector4::from_fn(|_, _| draw.within(-1.0, 1.0)).normalize(),
            velocity: draw.vector(1.0) - Vector3::z(),
            spin: draw.vector(8.0),
        };
        let normal = *world.ground().unwrap().normal();
        state.position += normal * (0.01 - world.lowest_height(&[state]));
        let (mut now, mut found) = (vec![state], 0);
        for _ in 0..60 {
            let Some((_, record)) = step(&world, &now, &[]) else { break };
            if record.first().solution.contacts.iter().any(|contact| contact.carries_force()) {
                found += 1;
                if found % 7 == 1 {
                    let at = format!("body {number}, touch {found}");
                    compare(&world, &now, &mut || draw.within(-1.0, 1.0), &at, &mut tally);
                }
            }
            now = record.next_states().to_vec();
        }
    }
    println!(
        "{} compared, {} left out, {} kinks, worst {:.1e}",
        tally.compared, tally.left_out, tally.kinks, tally.worst
    );
    assert!(tally.missed.is_empty(), "{:#?}", tally.missed);
    assert!(tally.compared > 1000, "{}", tally.compared);
}

/// Drawn bodies fly against the face of a box that moves and turns as well. Both are arguments.
/// Steps that are replaced by shorter ones change their contacts within, and are left out.
#[test]
fn smooth_shapes_on_a_moving_face() {
    let mut draw = Draw(Mt::new(23));
    let mut tally = Tally::default();
    for number in 0..30 {
        let piece = piece(&mut draw, number);
        let face = Piece::cuboid(Vector3::new(1.0, 1.0, 0.2)).unwrap();
        let parameters = Parameters {
            bodies: vec![
                RigidBody::solid(4.0, &[face]).unwrap().0,
                RigidBody::solid(1.5, &[piece]).unwrap().0,
            ],
            ground: None,
            gravity: Vector3::zeros(),
            friction: draw.within(0.0, 1.0),
            time_step: 0.001,
            rotation: Rotation::Momentum,
        };
        let world = euler(parameters);
        let mut drawn = |position: Vector3<f64>, attitude: Vector4<f64>, spin: f64| State {
            position,
            attitude,
            velocity: draw.vector(1.0),
            spin: draw.vector(spin),
        };
        let flat = drawn(Vector3::zeros(), Vector4::x(), 1.0);
        let mut state = drawn(Vector3::z() * 0.6, Vector4::x(), 8.0);
        state.attitude = Vector4::from_fn(|_, _| draw.within(-1.0, 1.0)).normalize();
        state.velocity.z -= 6.0;
        let (mut now, mut found) = (vec![flat, state], 0);
        for _ in 0..150 {
            let Some((_, record)) = step(&world, &now, &[]) else { break };
            let is_one_step = record.status() == StepStatus::Converged;
            if is_one_step
                && record.first().solution.contacts.iter().any(ContactForce::carries_force)
            {
                found += 1;
                if found % 3 == 1 && found < 30 {
                    let at = format!("body {number}, touch {found}");
                    compare(&world, &now, &mut || draw.within(-1.0, 1.0), &at, &mut tally);
                }
            }
            now = record.next_states().to_vec();
        }
    }
    println!(
        "{} compared, {} left out, {} kinks, worst {:.1e}",
        tally.compared, tally.left_out, tally.kinks, tally.worst
    );
    assert!(tally.missed.is_empty(), "{:#?}", tally.missed);
    assert!(tally.compared > 200, "{}", tally.compared);
}
