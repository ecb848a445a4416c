//! The derivative of an impact by the sizes of both bodies, for all pairs of shapes.

use crate::common::draw::WideDraw;
use crate::common::prelude::*;
use crate::shapes::{Body, SHAPES, attitude, standing};
use std::f64::consts::TAU;

/// Attitudes of each pair.
const DRAWS: usize = 80;
/// Difference of a size in central differences.
const APART: f64 = 1e-6;

/// Two bodies in random attitudes, 2 mm apart at most if they meet within one step at 4 m/s. Some pass
/// each other.
fn meeting(a: &Body, b: &Body, random: &mut WideDraw) -> (World, [State; 2]) {
    let turned = |random: &mut WideDraw| {
        let mut angle = || random.within(0.0, TAU);
        attitude(&UnitQuaternion::from_euler_angles(angle(), angle(), angle()))
    };
    let way =
        UnitQuaternion::from_euler_angles(0.0, random.within(-1.5, 1.5), random.within(0.0, TAU))
            * Vector3::x();
    let still = |attitude| State { attitude, ..State::at_rest(Vector3::zeros()) };
    let mut states = [still(turned(random)), still(turned(random))];
    let apart = a.reach_along(&states[0], &way) + b.reach_along(&states[1], &-way);
    states[1].position = way * apart;
    states[1].velocity = -4.0 * way;
    let world = euler(Parameters {
        ground: None,
        gravity: Vector3::zeros(),
        friction: 0.3,
        time_step: 5e-4,
        ..Parameters::new(vec![a.body.clone(), b.body.clone()])
    });
    (world, states)
}

/// End of a step of both bodies with these sizes relative to their own.
fn step(world: &World, states: &[State; 2], sizes: [f64; 2]) -> (StepRecord, StepDerivative) {
    let world = world.with_constants(&[(Constant::Size, &sizes)]).unwrap();
    let mut simulation = simulate(&world, states);
    let (mut record, mut derivative) = (StepRecord::new(), StepDerivative::new());
    simulation.step(&mut record).unwrap();
    simulation.linearise(&record, &mut derivative).unwrap();
    (record, derivative)
}

/// Velocities of both bodies after a step (m/s).
fn velocities(record: &StepRecord) -> [Vector3<f64>; 2] {
    [0, 1].map(|body| record.next_states()[body].velocity)
}

#[test]
fn the_derivative_by_size_agrees_with_differences_for_all_pairs_of_shapes() {
    let mut random = WideDraw::wide(70);
    let mut wrong = Vec::new();
    let (mut judged, mut met) = (0, 0);
    for (index, first) in SHAPES.iter().enumerate() {
        for second in &SHAPES[index..] {
            for draw in 0..DRAWS {
                let (a, b) = (standing(first, &mut random), standing(second, &mut random));
                let (world, states) = meeting(&a, &b, &mut random);
                let (record, mut derivative) = step(&world, &states, [1.0; 2]);
                if record.first().solution.contacts.iter().all(|contact| !contact.carries_force()) {
                    continue;
                }
                met += 1;
                // A contact with unknown dependence on the poses is reported as such.
                if derivative.unknown() > 0 {
                    continue;
                }
                for changed in 0..2 {
                    let difference = |apart: f64| {
                        let end = |by: f64| {
                            let mut sizes = [1.0; 2];
                            sizes[changed] += by;
                            velocities(&step(&world, &states, sizes).0)
                        };
                        let (more, less) = (end(apart), end(-apart));
                        [0, 1].map(|body| (more[body] - less[body]) / (2.0 * apart))
                    };
                    let (near, far) = (difference(APART), difference(10.0 * APART));
                    let apart = |a: &[Vector3<f64>; 2], b: &[Vector3<f64>; 2]| {
                        (a[0] - b[0]).amax().max((a[1] - b[1]).amax())
                    };
                    // A kink or a feature that changes between the sizes has no derivative.
                    let scale = 1.0 + near[0].amax().max(near[1].amax());
                    if apart(&near, &far) > 1e-4 * scale {
                        continue;
                    }
                    judged += 1;
                    let mut constants = [0.0; 2];
                    constants[changed] = 1.0;
                    let still = [StateChange::zero(), StateChange::zero()];
                    let change = StepChange {
                        states: &still,
                        wrenches: &[],
                        constants: &[(Constant::Size, &constants)],
                    };
                    let mut next = Vec::new();
                    derivative.jvp(&change, &mut next).unwrap();
                    let found = [next[0].velocity, next[1].velocity];
                    // Differences err by the rounding of an impact over APART, 1e-12/1e-6. Crossing edges err by
                    // about the gap in front of them relative to their length (docs/limits.md).
                    if apart(&found, &near) > 1e-3 * scale {
                        wrong.push(format!(
                            "{first} and {second}, draw {draw}, size {changed}: {found:?}, not {near:?}"
                        ));
                    }
                }
            }
        }
    }
    println!("{met} pairs met, {judged} derivatives judged");
    assert!(met > 300 && judged > 300, "{met} {judged}");
    assert!(wrong.is_empty(), "{} of {judged}: {:#?}", wrong.len(), &wrong[..wrong.len().min(8)]);
}
