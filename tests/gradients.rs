//! The derivative of a step against central differences of steps solved anew, in every regime and by every
//! argument.

use nalgebra::Vector3;
use rand_mt::Mt;
use std::path::Path;
use tumble::derivative::StateChange;
use tumble::mechanics::{State, Wrench};
use tumble::scenario::scene::Scene;
use tumble::scenario::settings::Settings;
use tumble::simulation::{Motion, Simulation, StepRecord};
use tumble::solver::native::{StepChange, StepDerivative};
use tumble::step::StepStatus;
use tumble::world::{Constant, World};

fn scenario(name: &str) -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios").join(name);
    let text = std::fs::read_to_string(&path).unwrap();
    let read = |path: &Path, _: u64| std::fs::read(path);
    Scene::of_text(&text, &path, Settings::default(), &read).unwrap()
}

/// One step from anywhere.
fn step<'a>(
    world: &World,
    states: &[State],
    wrenches: &[Wrench],
) -> Option<(Simulation<'a>, StepRecord)> {
    let motion = Motion::native(world);
    let mut simulation = Simulation::new(world.clone(), states.to_vec(), motion).ok()?;
    for (body, wrench) in wrenches.iter().enumerate() {
        simulation.set_wrench(body, *wrench).unwrap();
    }
    let mut record = StepRecord::new();
    simulation.step(&mut record).unwrap();
    (record.report.status != StepStatus::Failed).then_some((simulation, record))
}

/// An argument of a step, and a direction in it.
struct Direction {
    name: String,
    states: Vec<StateChange>,
    wrenches: Vec<Wrench>,
    constants: Vec<(Constant, Vec<f64>)>,
}

fn directions(world: &World, draw: &mut impl FnMut() -> f64) -> Vec<Direction> {
    let bodies = world.bodies().len();
    let mut vector = || Vector3::new(draw(), draw(), draw());
    let still = || vec![StateChange::zero(); bodies];
    let mut all = Vec::new();
    for part in ["position", "turn", "velocity", "spin"] {
        let states = (0..bodies).map(|_| {
            let mut change = StateChange::zero();
            match part {
                "position" => change.position = vector(),
                "turn" => change.turn = vector(),
                "velocity" => change.velocity = vector(),
                _ => change.spin = vector(),
            }
            change
        });
        let states = states.collect();
        all.push(Direction { name: part.into(), states, wrenches: vec![], constants: vec![] });
    }
    let wrenches = (0..bodies).map(|_| Wrench { force: vector() * 10.0, torque: vector() * 10.0 });
    let wrenches = wrenches.collect();
    all.push(Direction { name: "wrench".into(), states: still(), wrenches, constants: vec![] });
    for constant in Constant::ALL {
        let own = constant.of(world);
        let numbers: Vec<f64> = match constant {
            Constant::TimeStep => vec![own[0] * 0.1],
            Constant::Inertia => {
                let spread = |k: usize| if k % 4 == 0 { 0.1 } else { 0.0 };
                own.iter().enumerate().map(|(k, i)| i * spread(k % 9)).collect()
            }
            _ => own.iter().map(|_| 1.0).collect(),
        };
        let is_allowed =
            |by: f64| world.with_constants(&[(constant, &moved(&own, by, &numbers))]).is_ok();
        if !is_allowed(1e-5) || !is_allowed(-1e-5) {
            continue;
        }
        let name = constant.name().into();
        let constants = vec![(constant, numbers)];
        all.push(Direction { name, states: still(), wrenches: vec![], constants });
    }
    all
}

fn moved(own: &[f64], by: f64, numbers: &[f64]) -> Vec<f64> {
    own.iter().zip(numbers).map(|(own, number)| own + by * number).collect()
}

/// Central differences of X⁺ of all bodies along a direction; `None` where a step fails.
fn difference(
    world: &World,
    states: &[State],
    along: &Direction,
    by: f64,
) -> Option<Vec<StateChange>> {
    let end = |by: f64| {
        let given: Vec<(Constant, Vec<f64>)> = along
            .constants
            .iter()
            .map(|(constant, numbers)| (*constant, moved(&constant.of(world), by, numbers)))
            .collect();
        let given: Vec<_> =
            given.iter().map(|(constant, numbers)| (*constant, &numbers[..])).collect();
        let world = world.with_constants(&given).unwrap();
        let states: Vec<State> = states
            .iter()
            .zip(&along.states)
            .map(|(state, change)| StateChange::zero().plus(by, change).applied(state))
            .collect();
        let wrenches: Vec<Wrench> = along
            .wrenches
            .iter()
            .map(|wrench| Wrench { force: wrench.force * by, torque: wrench.torque * by })
            .collect();
        Some(step(&world, &states, &wrenches)?.1.solution.states)
    };
    let (plus, minus) = (end(by)?, end(-by)?);
    let zero = StateChange::zero();
    let each = minus.iter().zip(&plus);
    Some(each.map(|(a, b)| zero.plus(0.5 / by, &StateChange::between(a, b))).collect())
}

fn size(changes: &[StateChange]) -> f64 {
    changes.iter().map(|change| change.dot(change)).sum::<f64>().sqrt()
}

fn apart(a: &[StateChange], b: &[StateChange]) -> f64 {
    let difference: Vec<_> = a.iter().zip(b).map(|(a, b)| a.plus(-1.0, b)).collect();
    size(&difference)
}

/// What a step's derivative is compared by.
#[derive(Default)]
struct Tally {
    compared: usize,
    /// Too near to a kink.
    left_out: usize,
    /// Where the differences do not agree with each other.
    jumps: usize,
    worst: f64,
    missed: Vec<String>,
}

/// Compares the derivative of one step by every argument with central differences of three sizes, of which the best
/// one counts: a larger one bends, a smaller one has the last digits of the solutions.
fn compare(
    world: &World,
    states: &[State],
    draw: &mut impl FnMut() -> f64,
    at: &str,
    tally: &mut Tally,
) {
    // Solutions are exact to this part of the scale of speeds.
    let exact = if world.bodies().len() > 1 { 3e-10 } else { 1e-11 };
    let Some((simulation, base)) = step(world, states, &[]) else { return };
    let mut derivative = StepDerivative::new();
    simulation.linearise(&base, &mut derivative).unwrap();
    let h = world.time_step();
    for along in directions(world, draw) {
        let constants: Vec<_> = along.constants.iter().map(|(c, n)| (*c, &n[..])).collect();
        let (changes, wrenches) = (&along.states, &along.wrenches);
        let change = StepChange { states: changes, wrenches, constants: &constants };
        let mut found = Vec::new();
        derivative.push(&change, &mut found).unwrap();
        let given = size(changes)
            + wrenches.iter().map(|w| w.force.norm() + w.torque.norm()).sum::<f64>() * h;
        let (mut best, mut differences) = (f64::INFINITY, Vec::new());
        for by in [1e-4, 1e-5, 1e-6, 1e-7] {
            let Some(expected) = difference(world, states, &along, by) else { continue };
            // What a motion of the bodies at the start opens, it opens within one step.
            let moves =
                matches!(&along.name[..], "position" | "turn" | "size" | "radius" | "ground");
            let speed = size(&expected).max(size(&found)) * world.reach();
            let moved = 10.0 * by * if moves { speed + 1.0 / h } else { speed };
            let margin = derivative.margin();
            let margin = if moves { margin.min(derivative.feature_margin()) } else { margin };
            if margin < moved || derivative.unknown() > 0 || derivative.keeps_shares() {
                continue;
            }
            let scale = size(&expected).max(given).max(1e-9);
            let rounding = exact * world.speed_scale() / (by * world.reach().min(1.0)) / scale;
            if rounding > 1e-3 {
                continue;
            }
            best = best.min((apart(&found, &expected) / scale - rounding).max(0.0));
            differences.push((expected, scale));
        }
        if differences.is_empty() {
            tally.left_out += 1;
            continue;
        }
        let jumps =
            |pair: &[(Vec<StateChange>, f64)]| apart(&pair[0].0, &pair[1].0) > 0.1 * pair[0].1;
        if differences.windows(2).all(jumps) && (differences.len() > 1 || best > 0.1) {
            tally.jumps += 1;
            continue;
        }
        tally.compared += 1;
        tally.worst = tally.worst.max(best);
        if best > 1e-6 {
            let margins = [derivative.margin(), derivative.feature_margin()];
            tally.missed.push(format!("{at}, {}: {best:.1e}, margins {margins:?}", along.name));
        }
    }
}

#[test]
fn every_argument_in_every_regime() {
    let names = [
        "drop",
        "slope",
        "real-cube",
        "plate",
        "point-mass",
        "block-on-block",
        "stack",
        "mass-ratio",
        "pyramid",
        "bricks",
        "card-house",
        "dominoes",
        "arch",
        "marbles",
        "galton",
        "billiard",
        "pushed-tower",
        "dragged-cube",
        "pile",
    ];
    let mut twister = Mt::new(1);
    let mut draw = || f64::from(twister.next_u32()) / f64::from(u32::MAX) * 2.0 - 1.0;
    let mut all = Tally::default();
    for name in names {
        let scene = scenario(&format!("{name}.toml"));
        let mut run = scene.simulation(&Default::default()).unwrap();
        let mut record = StepRecord::new();
        let mut tally = Tally::default();
        let every = ((scene.rows - 1) / 12).max(1);
        for k in 0..scene.rows - 1 {
            run.step(&mut record).unwrap();
            if k % every == every / 2 {
                compare(
                    &scene.world,
                    &record.states,
                    &mut draw,
                    &format!("{name}, step {k}"),
                    &mut tally,
                );
            }
        }
        println!(
            "{name}: {} compared, {} left out, {} jumps, worst {:.1e}",
            tally.compared, tally.left_out, tally.jumps, tally.worst
        );
        all.compared += tally.compared;
        all.left_out += tally.left_out;
        all.missed.extend(tally.missed);
    }
    println!("{} compared, {} left out", all.compared, all.left_out);
    assert!(all.missed.is_empty(), "{}", all.missed.join("\n"));
    assert!(all.compared > 3000);
}
