//! Many steps of random mechanisms. Almost all are certified, and none gains energy without being
//! marked as unphysical.

use super::made;
use super::random::{Numbers, geared, mechanism, smooth, uneven, with_more_laws};
use crate::campaign::size;
use crate::common::prelude::*;
use std::time::Instant;

/// Statistics of many steps.
#[derive(Debug, Default)]
struct Tally {
    steps: u32,
    /// Number of steps in which a contact carries a force.
    pressed: u32,
    /// Number of failed steps and of solved ones with a large residual.
    uncertified: u32,
    wild: u32,
    retried: u32,
    substepped: u32,
    /// Largest joint errors: place (m) and turn (rad).
    worst: (f64, f64),
    /// Steps, solved or not, that gain energy without a mark.
    unmarked: Vec<String>,
}

/// Energy that a step may gain without a mark: a fraction of the kinetic energy, and a constant
/// [J].
const ALLOWED: (f64, f64) = (2e-3, 1e-6);

/// The same limits for bodies of up to 1000 kg that come to rest.
const ALLOWED_UNEVEN: (f64, f64) = (1e-2, 1e-5);

fn run(seeds: std::ops::Range<u64>, steps: usize, is_uneven: bool) -> Tally {
    let changed = |world: World, bars: &[usize], numbers: &mut Numbers| {
        if is_uneven { uneven(&world, bars, numbers) } else { world }
    };
    let allowed = if is_uneven { ALLOWED_UNEVEN } else { ALLOWED };
    run_changed(seeds, steps, changed, allowed)
}

/// Runs random mechanisms that are `changed`.
fn run_changed(
    seeds: std::ops::Range<u64>,
    steps: usize,
    changed: impl Fn(World, &[usize], &mut Numbers) -> World,
    (part, rest): (f64, f64),
) -> Tally {
    let mut tally = Tally::default();
    for seed in seeds {
        let mut numbers = Numbers(seed);
        let (world, states, bars) = mechanism(&mut numbers);
        let world = changed(world, &bars, &mut numbers);
        let Ok(mut simulation) = Simulation::new(world.clone(), states, Motion::native(&world))
        else {
            // Some mechanisms overlap at the start.
            continue;
        };
        let mut record = StepRecord::new();
        for _ in 0..steps {
            simulation.step(&mut record).unwrap();
            tally.steps += 1;
            let mut forces = record.first().solution.contacts.iter();
            tally.pressed += u32::from(forces.any(|c| c.force.amax() > 0.0));
            let status = record.status();
            let certified = status != StepStatus::Failed && record.residual() <= 1e-9;
            // Shorter steps are certified each, and the mean of their forces is not.
            tally.uncertified += u32::from(!certified && status != StepStatus::Substepped);
            tally.wild += u32::from(status == StepStatus::Wild);
            tally.retried += u32::from(status == StepStatus::Retried);
            if !certified || status == StepStatus::Wild {
                println!(
                    "seed {seed} step {} of {:.2e} s: {status} {:?} {:.1e} ({}); {:?}, turn {:.2}",
                    record.index,
                    world.time_step(),
                    record.report().start,
                    record.residual(),
                    record.certificate().worst_part(),
                    made(&world, &record),
                    turn(&world, &record),
                );
            }
            if status == StepStatus::Wild {
                continue;
            }
            if certified {
                for joint in world.joints() {
                    let (place, turn) = joint.error(record.next_states()).unwrap();
                    tally.worst = (tally.worst.0.max(place), tally.worst.1.max(turn));
                }
            }
            let (mut gained, kinetic) = made(&world, &record);
            if status == StepStatus::Substepped {
                // The gain of the shorter steps is in the record.
                let gains = record.intervals().iter().filter_map(|taken| taken.gain);
                gained -= gains.map(|gain| gain.energy).sum::<f64>();
                tally.substepped += 1;
            }
            // At rest the energy can be negative by half a step's fall. Bodies are lifted out of the
            // depth that the last step left.
            let lifted = lift(&world, &record);
            if gained.is_nan() || gained > part * kinetic.max(0.0) + rest + lifted {
                tally.unmarked.push(format!(
                    "seed {seed} step {}: {status}, gains {gained:.1e} J of {kinetic:.1e} J",
                    record.index
                ));
            }
        }
    }
    println!("{tally:?}");
    tally
}

/// Energy of lifting all bodies by twice the depth of the deepest loaded contact, as between two planes
/// [J].
fn lift(world: &World, record: &StepRecord) -> f64 {
    let loaded = record.first().contacts.iter().zip(&record.first().solution.contacts);
    let loaded = loaded.filter(|(_, force)| force.force.amax() > 0.0);
    let depth = loaded.fold(0.0, |depth: f64, (contact, _)| depth.max(-contact.gap));
    let mass: f64 = world.bodies().iter().map(|body| body.mass()).sum();
    2.0 * depth * mass * world.gravity().norm()
}

/// Largest rotation of a body in the step [rad].
fn turn(world: &World, record: &StepRecord) -> f64 {
    let next = record.next_states().iter();
    next.map(|state| world.time_step() * state.spin.norm()).fold(0.0, f64::max)
}

fn judge(tally: &Tally) {
    let Tally { steps, uncertified, substepped, worst, unmarked, .. } = tally;
    assert!(f64::from(*uncertified) <= 1e-3 * f64::from(*steps), "{uncertified} of {steps}");
    assert!(f64::from(*substepped) <= 2e-3 * f64::from(*steps), "{substepped} of {steps}");
    assert!(unmarked.is_empty(), "{unmarked:?}");
    // A certificate of 1e-9 m/s over steps of 5 ms, and a lever of at least 0.05 m.
    assert!(worst.0 < 5e-12 && worst.1 < 1e-10, "{worst:?}");
}

/// Checks random mechanisms that swing, fall on the ground and are driven hard. Almost every step
/// is certified, and none gains energy without a mark.
#[test]
fn random_mechanisms_are_certified_and_make_no_energy() {
    judge(&run(0..150, 150, false));
}

/// Checks the same for 10⁵ steps with contact forces.
#[test]
#[ignore = "minutes"]
fn a_hundred_thousand_steps_are_certified_and_make_no_energy() {
    let tally = run(1000..1900, 300, false);
    assert!(tally.pressed > 100_000, "{tally:?}");
    judge(&tally);
}

/// Checks the same for stops that bounce and friction over the speed.
#[test]
#[ignore = "minutes"]
fn more_laws_of_axes_make_no_energy() {
    let changed = |world, _: &[usize], numbers: &mut Numbers| with_more_laws(world, numbers);
    let tally = run_changed(0..900, 150, changed, ALLOWED);
    assert!(tally.steps > 100_000, "{tally:?}");
    judge(&tally);
}

/// Checks two loops whose bars overlap by half a millimetre at the start, where the distance of the
/// bars is nearly the largest: a step that separates them would need hundreds of joules. They move
/// on with the depth, in steps that are not solved, until they come apart. The bodies of the second one have masses
/// up to 1000 kg. A step that separates them has a solution, and its gain is marked.
#[test]
fn loops_that_start_in_an_overlap_move_on() {
    for (seed, is_uneven) in [(1573, false), (2028, true)] {
        let tally = run(seed..seed + 1, 60, is_uneven);
        let marked = if is_uneven { tally.wild } else { tally.uncertified };
        assert!((1..10).contains(&marked), "{tally:?}");
        assert!(tally.unmarked.is_empty(), "{tally:?}");
    }
}

/// Checks that steps of mechanisms with mass ratios of up to 10⁵ almost never gain energy without a mark, solved or
/// not: 0, 0, 3, 0 and 0 of 87 000 steps in five ranges of seeds. At that mean rate, five are found with a probability
/// of 4·10⁻⁴.
#[test]
#[ignore = "minutes"]
fn uneven_masses_make_no_energy() {
    let Tally { steps, substepped, unmarked, .. } = run(2000..2300, 300, true);
    assert!(steps > 50_000 && substepped > 100, "{steps} {substepped}");
    assert!(20_000 * unmarked.len() <= steps as usize, "{unmarked:?}");
}

/// Checks that the order of bodies and joints does not matter, until contacts with the ground
/// amplify rounding.
#[test]
fn the_order_of_bodies_is_no_matter() {
    let mut compared = 0;
    for seed in 0..40 {
        let mut numbers = Numbers(seed);
        let (world, states, bars) = mechanism(&mut numbers);
        let count = world.bodies().len();
        // Index of each body in the other order.
        let place = |body: usize| (body + 2) % count;
        let mut bodies = world.bodies().to_vec();
        let mut other_states = states.clone();
        for body in 0..count {
            bodies[place(body)] = world.bodies()[body].clone();
            other_states[place(body)] = states[body];
        }
        let joints = world.joints().iter().rev().map(|joint| renumbered(joint, place));
        let parameters = Parameters { bodies, ..world.parameters().clone() };
        let other = euler(parameters).with_joints(joints.collect()).unwrap();
        let other = smooth(other, &bars.iter().map(|bar| place(*bar)).collect::<Vec<_>>());
        let start = |world: &World, states: Vec<State>| {
            Simulation::new(world.clone(), states, Motion::native(world))
        };
        let (Ok(mut one), Ok(mut two)) = (start(&world, states), start(&other, other_states))
        else {
            continue;
        };
        let mut record = StepRecord::new();
        let mut after = 0;
        for k in 0..100 {
            one.step(&mut record).unwrap();
            two.step(&mut record).unwrap();
            let is_exact = matches!(record.status(), StepStatus::Converged | StepStatus::Free);
            let presses = record.first().solution.contacts.iter().any(|c| c.force.amax() > 0.0);
            after += u32::from(presses || !is_exact);
            if after > 3 {
                break;
            }
            compared += 1;
            for body in 0..count {
                let (a, b) = (&one.states()[body], &two.states()[place(body)]);
                let apart = (a.position - b.position).norm();
                assert!(apart < 1e-9, "seed {seed} step {k} body {body}: {apart}");
            }
        }
    }
    println!("{compared} steps compared");
    assert!(compared > 500, "{compared}");
}

/// The same joint between renumbered bodies.
fn renumbered(joint: &Joint, place: impl Fn(usize) -> usize) -> Joint {
    let (a, b) = (place(joint.body()), joint.other().map(&place));
    let [x, y, z] = *joint.angular();
    match (x, y, z) {
        // Among these joints only a gimbal has a drive about y.
        (Axis::Free(x), Axis::Free(y), Axis::Free(z)) if y != Drive::NONE => {
            Joint::gimbal(a, b, *joint.frames(), [x, y, z])
        }
        _ => Joint::between(a, b, *joint.frames()).with_axes(*joint.linear(), [x, y, z]),
    }
}

/// Seed of the first mechanism with gears and half kicks.
const GEARED: u64 = 100_000;

/// Random mechanism of the campaign `number`: with uneven masses if it is odd, with gears in two of four, and with
/// half kicks in five of eight.
fn numbered(number: u64) -> Option<Simulation<'static>> {
    let mut numbers = Numbers(GEARED + number);
    let (mut world, states, bars) = mechanism(&mut numbers);
    if number % 2 == 1 {
        world = uneven(&world, &bars, &mut numbers);
    }
    if number % 4 < 2 {
        world = geared(world, &states, &mut numbers);
    }
    if number % 8 < 5 {
        world = world.with_integrator(Integrator::Leapfrog);
    }
    let motion = Motion::native(&world);
    Simulation::new(world, states, motion).ok()
}

/// Ratio of the largest and the smallest mass.
fn mass_ratio(world: &World) -> f64 {
    let masses = || world.bodies().iter().map(RigidBody::mass);
    masses().fold(0.0, f64::max) / masses().fold(f64::INFINITY, f64::min)
}

/// Checks mechanisms with all kinds of joints, loops, motors, brakes, stops, gears and mass ratios of up to 10⁵:
/// almost all steps that are not solved have a certificate that no solution exists. A mechanism that starts in an
/// overlap is left out.
#[test]
#[ignore = "minutes"]
fn mechanisms_fail_with_a_certificate() {
    // Steps, failed ones with and without a certificate, and substepped ones, by mass ratio: below 30 and above.
    let mut counts = [[0_u32; 4]; 2];
    for number in 0..size(200, 1000) as u64 {
        let Some(mut simulation) = numbered(number) else { continue };
        let is_uneven = mass_ratio(simulation.world()) >= 30.0;
        let counts = &mut counts[usize::from(is_uneven)];
        let mut record = StepRecord::new();
        let start = Instant::now();
        for step in 0..250 {
            simulation.step(&mut record).unwrap();
            if step == 0 && record.first().contacts.iter().any(|contact| contact.gap < -1e-9) {
                break;
            }
            counts[0] += 1;
            let status = record.status();
            let has_certificate = record.infeasible_gap().is_some();
            counts[1] += u32::from(status == StepStatus::Failed && has_certificate);
            counts[2] += u32::from(status == StepStatus::Failed && !has_certificate);
            counts[3] += u32::from(status == StepStatus::Substepped);
            if status == StepStatus::Failed && !has_certificate {
                let (residual, part) = (record.residual(), record.certificate().worst_part());
                println!(
                    "{number}, step {step}: {residual:.1e} ({part}), {:?}",
                    record.unphysical()
                );
            }
        }
        let mean = 1e3 * start.elapsed().as_secs_f64() / 250.0;
        if mean > 20.0 {
            println!("{number}: {mean:.0} ms a step");
        }
    }
    println!("{counts:?}");
    for (limit, [steps, _, failed, substepped]) in [1e-4, 1e-3].into_iter().zip(counts) {
        assert!(f64::from(failed) <= limit * f64::from(steps), "{counts:?}");
        assert!(f64::from(substepped) <= 3e-3 * f64::from(steps), "{counts:?}");
    }
}

/// Checks a tree of gears and joints, number 28, whose bodies overlap at the start by 0.6 mm. No motion removes it:
/// the gears hold both. It is named at each step, which costs less than a thousand iterations.
#[test]
fn a_geared_overlap_has_a_certificate() {
    let mut simulation = numbered(28).unwrap();
    let mut record = StepRecord::new();
    for step in 0..20 {
        simulation.step(&mut record).unwrap();
        assert_eq!(record.status(), StepStatus::Failed);
        let gap = record.infeasible_gap().unwrap();
        assert!((1e-5..1e-3).contains(&gap.lacking) && gap.between.len() > 1, "{gap:?}");
        assert!(step == 0 || record.report().iterations < 1000, "{:?}", record.report());
    }
}

/// Checks mechanisms whose motors drive slides into stops. The reactions of the impact do work on the lag of the
/// velocities (32c), for any time step. Such a step may be marked, and none is failed.
#[test]
fn impacts_of_stops_are_solved() {
    for (number, steps) in [(609, 20), (954, 40), (1104, 30)] {
        let mut simulation = numbered(number).unwrap();
        last_step(&mut simulation, steps, has_not_failed);
    }
}

/// Checks mechanisms of mass ratios of 10⁴ to 10⁵ whose light bodies carry the forces of heavy ones. Rounding of
/// these forces exceeds the limit of a solved step without (22a).
#[test]
fn light_bodies_between_heavy_ones_are_solved() {
    for (number, steps) in [(29, 180), (147, 90), (367, 70)] {
        let mut simulation = numbered(number).unwrap();
        assert!(mass_ratio(simulation.world()) > 1e3);
        last_step(&mut simulation, steps, has_not_failed);
    }
}
