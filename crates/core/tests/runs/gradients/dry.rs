//! Derivatives of joints with dry friction.

use super::draw::Draw;
use super::{Tally, compare, step};
use crate::common::prelude::*;
use rand_mt::Mt;

fn world(joint: Joint) -> World {
    let parameters = Parameters {
        ground: None,
        friction: 0.0,
        ..Parameters::new(vec![RigidBody::solid_box(1.0, Vector3::new(0.1, 0.2, 0.3)).unwrap()])
    };
    euler(parameters).with_joints(vec![joint]).unwrap()
}

/// Checks a ball joint with dry friction about one axis, which sticks or slips while the body
/// turns about the others.
#[test]
fn a_ball_joint_with_dry_friction_about_one_axis() {
    let mut draw = Draw(Mt::new(5));
    let mut tally = Tally::default();
    for number in 0..20 {
        let friction = if number % 2 == 0 { 100.0 } else { 0.2 };
        let free = Axis::Free(Drive { damping: 0.1, ..Drive::NONE });
        let dry = Axis::Free(Drive { friction, ..Drive::NONE });
        let frames = [JointFrame::at(Vector3::zeros()); 2];
        let ball = Joint::spherical(0, None, frames);
        let linear = *ball.linear();
        let world = world(ball.with_axes(linear, [free, dry, free]));
        let turn = draw.vector(0.5);
        let state = State {
            position: Vector3::zeros(),
            attitude: Vector4::new(1.0, turn[0], turn[1], turn[2]).normalize(),
            velocity: Vector3::zeros(),
            spin: draw.vector(5.0),
        };
        let (_, record) = step(&world, &[state], &[]).unwrap();
        let states = record.next_states();
        compare(&world, states, &mut || draw.unit(), &format!("ball {number}"), &mut tally);
    }
    println!("{} compared, {} left out, worst {:.1e}", tally.compared, tally.left_out, tally.worst);
    assert!(tally.missed.is_empty(), "{}", tally.missed.join("\n"));
    assert!(tally.compared > 100);
}

/// Checks the margin of a slide that dry friction holds exactly at its stop. Moved inwards it
/// sticks where it is, and moved outwards the stop brings it back: a kink.
#[test]
fn a_slide_stuck_at_its_stop_has_no_margin() {
    let drive = Drive { limits: Some([-1.0, 0.0]), friction: 20.0, ..Drive::NONE };
    let frame = JointFrame::at(Vector3::zeros());
    let world = world(Joint::prismatic(0, None, [frame, frame], drive));
    let at = |height: f64| State::at_rest(Vector3::new(0.0, 0.0, height));
    let end = |height: f64| step(&world, &[at(height)], &[]).unwrap().1.next_states()[0].position.z;
    assert!(end(1e-7).abs() < 1e-15 && (end(-1e-7) + 1e-7).abs() < 1e-15);
    let (simulation, record) = step(&world, &[at(0.0)], &[]).unwrap();
    let mut derivative = StepDerivative::new();
    simulation.linearise(&record, &mut derivative).unwrap();
    let margin = derivative.margin().min(derivative.feature_margin());
    assert!(margin < 1e-9, "{margin}");
}
