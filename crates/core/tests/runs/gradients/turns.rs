//! Derivatives of free rotation under drives. Free joints and ball joints have springs, dampers,
//! dry friction, motors and armatures about the axes of A, with the world and between two bodies.
//! They are compared with central differences by every argument.

use super::draw::Draw;
use super::laws;
use super::own::seen_from;
use super::{Direction, Tally, apart, compare, difference, directions, size, step, transposed};
use crate::common::prelude::*;
use rand_mt::Mt;
use tumble_core::joint::FrictionCurve;

/// Drives about three axes.
fn drives(which: usize) -> [Drive; 3] {
    let none = Drive::NONE;
    let spring = Drive { stiffness: 8.0, damping: 0.3, rest: 0.4, force: 0.2, ..none };
    let armed = Drive { armature: 0.05, damping: 0.1, ..none };
    let rubbed = |friction| Drive { friction, damping: 0.05, ..none };
    let curved = |points: &[[f64; 2]]| Drive {
        friction_curve: Some(FrictionCurve::new(points).unwrap()),
        ..rubbed(0.1)
    };
    let motor = |motor| Drive { motor: Some(motor), ..none };
    match which {
        0 => [spring; 3],
        1 => [armed, Drive { armature: 0.02, ..spring }, armed],
        2 => [rubbed(0.1), rubbed(0.2), spring],
        3 => [rubbed(1e4), spring, rubbed(1e4)],
        // Rising, falling, and rising from nothing
        6 => [
            curved(&[[0.0, 1.0], [9.0, 3.0]]),
            curved(&[[0.0, 3.0], [9.0, 1.0]]),
            curved(&[[0.0, 0.0], [0.01, 0.0], [9.0, 3.0]]),
        ],
        7 => [spring; 3],
        4 => [
            motor(Motor::Position { target: 0.3, stiffness: 30.0, damping: 0.5, max_force: 1e3 }),
            motor(Motor::Damper { target: 0.5, damping: 0.7, max_force: 1e3 }),
            motor(Motor::Speed { target: 0.4, max_force: 1e3 }),
        ],
        _ => [
            motor(Motor::Position { target: 0.3, stiffness: 90.0, damping: 0.5, max_force: 0.1 }),
            armed,
            motor(Motor::Speed { target: 20.0, max_force: 0.2 }),
        ],
    }
}

fn state(draw: &mut Draw) -> State {
    State {
        position: draw.vector(0.5),
        attitude: draw.attitude(),
        velocity: draw.vector(1.0),
        spin: draw.vector(3.0),
    }
}

fn bodies(count: usize, draw: &mut Draw) -> Vec<RigidBody> {
    let one = |_| {
        let half = Vector3::repeat(0.1) + draw.vector(0.05);
        RigidBody::solid_box(1.5 + draw.unit(), half).unwrap()
    };
    (0..count).map(one).collect()
}

/// Joint without locked axes, for one body or two, with drives on all six axes.
fn free(which: usize, count: usize, draw: &mut Draw) -> (World, Vec<State>) {
    let mut states: Vec<State> = (0..count).map(|_| state(draw)).collect();
    if let Some(second) = states.get_mut(1) {
        second.position += Vector3::x() * 2.0;
    }
    let frames = [0; 2].map(|_| JointFrame { anchor: draw.vector(0.4), attitude: draw.attitude() });
    let along = Drive { stiffness: 30.0, damping: 0.4, armature: 0.1, ..Drive::NONE };
    let other = (count == 2).then_some(1);
    let mut joint = Joint::between(0, other, frames)
        .with_axes([Axis::Free(along); 3], drives(which).map(Axis::Free));
    if which == 7 {
        // Stops nearer than the path of a step, off which the anchor bounces
        let place = joint.coordinates(&states).unwrap().place;
        for k in 0..3 {
            let reach = if k == 2 { 1e-4 } else { 4e-4 };
            let limits = Some([-reach, reach].map(|end| place[k] + end));
            let drive = Drive { limits, restitution: 0.3 + 0.2 * k as f64, ..along };
            joint = joint.with_drive(JointAxis::Linear(k), drive).unwrap();
        }
    }
    let world = laws::world(bodies(count, draw), draw.vector(10.0)).with_untouched(0).unwrap();
    (world.with_joints(vec![joint]).unwrap(), states)
}

/// Checks the derivatives by every argument. A joint without locked axes allows any change of
/// position.
#[test]
fn free_joints_under_drives() {
    let mut draw = Draw(Mt::new(5));
    let mut twister = Mt::new(6);
    let mut unit = || f64::from(twister.next_u32()) / f64::from(u32::MAX) * 2.0 - 1.0;
    let (mut tally, mut replaced) = (Tally::default(), 0);
    for number in 0..32 {
        let (which, count) = (number % 8, 1 + number / 8 % 2);
        let (world, states) = free(which, count, &mut draw);
        compare(&world, &states, &mut unit, &format!("{number}, drives {which}"), &mut tally);
        // A step that makes energy is replaced by shorter ones, which have no derivative.
        let Some((simulation, base)) = step(&world, &states, &[]) else {
            replaced += 1;
            continue;
        };
        let mut derivative = StepDerivative::new();
        simulation.linearise(&base, &mut derivative).unwrap();
        let all = directions(&world, &mut unit);
        transposed(&mut derivative, &all, &mut unit, &format!("{number}, drives {which}"), 1e-9);
    }
    println!(
        "{} compared, {} left out, {} kinks, {} scattered, worst {:.1e}",
        tally.compared, tally.left_out, tally.kinks, tally.scattered, tally.worst
    );
    assert!(tally.missed.is_empty(), "{:#?}", tally.missed);
    assert!(tally.compared > 330 && tally.left_out < 80 && tally.kinks + tally.scattered < 10);
    assert!(replaced <= 3, "{replaced} of 32");
}

/// Checks a ball that slides on the ground with an axis of friction in another body, which a free joint with
/// springs connects to it.
#[test]
fn a_slide_with_the_axis_of_another_body() {
    let mut draw = Draw(Mt::new(15));
    let mut twister = Mt::new(16);
    let mut unit = || f64::from(twister.next_u32()) / f64::from(u32::MAX) * 2.0 - 1.0;
    let (mut tally, mut slid) = (Tally::default(), 0);
    for number in 0..40 {
        let ball = RigidBody::solid(1.0, &[Piece::sphere(0.1).unwrap()]).unwrap().0;
        let ground = Some(Plane::new(Vector3::z(), 0.0).unwrap());
        let bodies = vec![ball, bodies(1, &mut draw).remove(0)];
        let parameters = Parameters { ground, friction: 0.4, ..Parameters::new(bodies) };
        let world = euler(parameters);
        let spring = Axis::Free(Drive { stiffness: 30.0, damping: 0.4, ..Drive::NONE });
        let frames =
            [0; 2].map(|_| JointFrame { anchor: draw.vector(0.1), attitude: draw.attitude() });
        let joint = Joint::between(1, Some(0), frames).with_axes([spring; 3], [spring; 3]);
        let world = world.with_untouched(1).unwrap().with_joints(vec![joint]).unwrap();
        let world =
            world.with_friction_axis_in(Partner::Body(0), 1, draw.vector(1.0), 0.3).unwrap();
        let mut states = [state(&mut draw), state(&mut draw)];
        states[0].position[2] = 0.0999;
        states[0].velocity[2] = -0.5;
        states[1].position[2] += 1.0;
        compare(&world, &states, &mut unit, &format!("{number}"), &mut tally);
        let Some((simulation, base)) = step(&world, &states, &[]) else { continue };
        slid += usize::from(base.first().solution.contacts[0].slip.norm() > 1e-3);
        let mut derivative = StepDerivative::new();
        simulation.linearise(&base, &mut derivative).unwrap();
        let all = directions(&world, &mut unit);
        transposed(&mut derivative, &all, &mut unit, &format!("{number}"), 1e-9);
    }
    assert!(slid > 25, "{slid}");
    println!("{} compared, {} left out, {} kinks", tally.compared, tally.left_out, tally.kinks);
    assert!(tally.missed.is_empty(), "{:#?}", tally.missed);
    assert!(tally.compared > 400 && tally.kinks + tally.scattered < 10);
}

/// Checks a ball joint between two bodies that rotate about it, and one with the world.
#[test]
fn balls_under_drives() {
    let mut draw = Draw(Mt::new(8));
    let (mut compared, mut worst, mut replaced) = (0, 0.0_f64, 0);
    for number in 0..24 {
        let (which, count) = (number % 6, 1 + number / 6 % 2);
        let states: Vec<State> = (0..count).map(|_| state(&mut draw)).collect();
        let at = JointFrame { anchor: draw.vector(0.7), attitude: draw.attitude() };
        let turned = JointFrame { attitude: draw.attitude(), ..at };
        let of_a = seen_from(&states[0], &turned);
        let of_b = states.get(1).map_or(at, |second| seen_from(second, &at));
        let mut joint = Joint::spherical(0, (count == 2).then_some(1), [of_a, of_b]);
        for (k, drive) in drives(which).into_iter().enumerate() {
            joint = joint.with_drive(JointAxis::Angular(k), drive).unwrap();
        }
        let mut world = laws::world(bodies(count, &mut draw), draw.vector(10.0));
        for body in 0..count {
            world = world.with_untouched(body).unwrap();
        }
        let world = world.with_joints(vec![joint]).unwrap();
        // A step that makes energy is replaced by shorter ones, which have no derivative.
        let Some((simulation, base)) = step(&world, &states, &[]) else {
            replaced += 1;
            continue;
        };
        let mut derivative = StepDerivative::new();
        simulation.linearise(&base, &mut derivative).unwrap();
        // Random rotation about the anchor.
        let turn = |state: &State, draw: &mut Draw| {
            let axis = draw.vector(1.0);
            StateChange {
                position: axis.cross(&(state.position - at.anchor)),
                turn: state.pose().rotation.tr_mul(&axis),
                ..StateChange::zero()
            }
        };
        let places: Vec<_> = states.iter().map(|state| turn(state, &mut draw)).collect();
        let fast = |_: &State| StateChange {
            velocity: draw.vector(1.0),
            spin: draw.vector(1.0),
            ..StateChange::zero()
        };
        let speeds: Vec<_> = states.iter().map(fast).collect();
        for (name, changes) in [("place", places), ("speed", speeds)] {
            let along = Direction {
                name: name.into(),
                states: changes,
                wrenches: vec![],
                constants: vec![],
            };
            let mut found = Vec::new();
            let change = StepChange { states: &along.states, ..StepChange::default() };
            derivative.jvp(&change, &mut found).unwrap();
            for by in [1e-4, 1e-5] {
                if derivative.margin() < 10.0 * by * (1.0 / world.time_step() + size(&found)) {
                    continue;
                }
                let ends = (&states[..], base.next_states());
                let Some((expected, _)) = difference(&world, ends, &along, by) else { continue };
                let (scale, off) = (size(&expected), apart(&found, &expected));
                assert!(
                    off < 1e-6 * scale + 1e-12 / by,
                    "{number}, drives {which}, {name}: {off:.1e} of {scale}"
                );
                worst = worst.max(off / scale);
                compared += 1;
            }
        }
    }
    println!("{compared} compared, worst {worst:.1e}");
    assert!(compared > 60 && replaced <= 3, "{compared}, {replaced} of 24");
}
