//! Comparison of a step's derivative with central differences of steps, by every argument.

use crate::common::prelude::*;
use tumble_core::solver::native::StepGradient;

/// One step from the given states, or `None` if it is not solved at full length.
pub fn step<'a>(
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
    let unsolved = [StepStatus::Failed, StepStatus::Substepped];
    (!unsolved.contains(&record.status())).then_some((simulation, record))
}

/// Cube of mass 2 kg and half side 0.1 m on a slope of `angle` [rad], sliding down at `velocity`
/// [m/s].
pub fn on_a_slope(angle: f64, friction: f64, velocity: f64) -> (World, Vec<State>) {
    let body = RigidBody::solid_box(2.0, Vector3::repeat(0.1)).unwrap();
    let (sin, cos) = angle.sin_cos();
    let ground = Plane::new(Vector3::new(sin, 0.0, cos), 0.0).unwrap();
    let parameters = Parameters { ground: Some(ground), friction, ..Parameters::new(vec![body]) };
    let state = State {
        position: Vector3::new(sin, 0.0, cos) * 0.1,
        attitude: Vector4::new((0.5 * angle).cos(), 0.0, (0.5 * angle).sin(), 0.0),
        velocity: Vector3::new(cos, 0.0, -sin) * velocity,
        spin: Vector3::zeros(),
    };
    (euler(parameters), vec![state])
}

/// Direction in the space of a step's arguments.
pub struct Direction {
    pub name: String,
    pub states: Vec<StateChange>,
    pub wrenches: Vec<Wrench>,
    pub constants: Vec<(Constant, Vec<f64>)>,
}

pub fn directions(world: &World, draw: &mut impl FnMut() -> f64) -> Vec<Direction> {
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
        let own = constant.values(world);
        let numbers: Vec<f64> = match constant {
            Constant::TimeStep => vec![own[0] * 0.1],
            Constant::Inertia => {
                let spread = |k: usize| if k.is_multiple_of(4) { 0.1 } else { 0.0 };
                own.iter().enumerate().map(|(k, i)| i * spread(k % 9)).collect()
            }
            // Proportional to the constant's own values, so that zeros stay zero.
            Constant::MotorTarget | Constant::JointForce => own.iter().map(|_| 1.0).collect(),
            of if of.is_of_joints() => own.clone(),
            of if of.is_of_laws() => own.clone(),
            _ => own.iter().map(|_| 1.0).collect(),
        };
        if numbers.iter().all(|number| *number == 0.0) {
            continue;
        }
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

/// Step with the arguments moved by `by` along a direction.
fn beside(world: &World, states: &[State], along: &Direction, by: f64) -> Option<StepRecord> {
    let given: Vec<(Constant, Vec<f64>)> = along
        .constants
        .iter()
        .map(|(constant, numbers)| (*constant, moved(&constant.values(world), by, numbers)))
        .collect();
    let given: Vec<_> = given.iter().map(|(constant, numbers)| (*constant, &numbers[..])).collect();
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
    Some(step(&world, &states, &wrenches)?.1)
}

/// Largest difference of two steps' contact impulses over the mean mass [m/s]. A contact in only
/// one of the steps counts with its full impulse.
fn impulses_apart(world: &World, a: &StepRecord, b: &StepRecord) -> f64 {
    let mass = world.bodies().iter().map(RigidBody::mass).sum::<f64>() / a.states().len() as f64;
    let beyond = |a: &StepRecord, b: &StepRecord| {
        let each = a.first().solution.contacts.iter().map(|contact| {
            let same = b.first().solution.contacts.iter().find(|other| other.key == contact.key);
            (contact.force - same.map_or(Vector3::zeros(), |same| same.force)).norm()
        });
        each.fold(0.0, f64::max)
    };
    beyond(a, b).max(beyond(b, a)) * world.time_step() / mass
}

/// Central differences of X⁺ of all bodies along a direction, and the difference of the two
/// one-sided ones. `None` if a step fails. `base` is X⁺ itself.
pub fn difference(
    world: &World,
    (states, base): (&[State], &[State]),
    along: &Direction,
    by: f64,
) -> Option<(Vec<StateChange>, f64)> {
    let end = |by: f64| Some(beside(world, states, along, by)?.next_states().to_vec());
    // (8 (f(δ) − f(−δ)) − (f(2δ) − f(−2δ)))/12δ, with an error of order δ⁴.
    let apart = |by: f64| {
        let (plus, minus) = (end(by)?, end(-by)?);
        let each = minus.iter().zip(&plus).map(|(a, b)| StateChange::between(a, b));
        Some(each.collect::<Vec<_>>())
    };
    let (near, far) = (apart(by)?, apart(2.0 * by)?);
    let zero = StateChange::zero();
    let each = near.iter().zip(&far);
    let central = each.map(|(a, b)| zero.plus(8.0 / (12.0 * by), a).plus(-1.0 / (12.0 * by), b));
    let side = |by: f64| {
        let each = base.iter().zip(end(by)?);
        Some(
            each.map(|(a, b)| zero.plus(1.0 / by, &StateChange::between(a, &b)))
                .collect::<Vec<_>>(),
        )
    };
    let (before, after) = (side(-by)?, side(by)?);
    let sides: Vec<_> = before.iter().zip(&after).map(|(a, b)| b.plus(-1.0, a)).collect();
    Some((central.collect(), size(&sides)))
}

/// Largest deviation of X⁺ from the prediction of the derivative `found`, for tiny changes. Gaps
/// have rounding errors of 1e-16 m. The selection rule's compliance turns these into changes of the
/// force distribution under a face, so that the solutions scatter.
fn scatter(
    world: &World,
    (states, base): (&[State], &[State]),
    along: &Direction,
    found: &[StateChange],
) -> f64 {
    let each = (-4..=4).filter_map(|k| {
        let by = 1e-11 * f64::from(k);
        let there = beside(world, states, along, by)?.next_states().to_vec();
        let moved = base.iter().zip(&there).map(|(a, b)| StateChange::between(a, b));
        let off = moved.zip(found).map(|(moved, found)| moved.plus(-by, found));
        Some(size(&off.collect::<Vec<_>>()))
    });
    each.fold(0.0, f64::max)
}

pub fn size(changes: &[StateChange]) -> f64 {
    changes.iter().map(|change| change.dot(change)).sum::<f64>().sqrt()
}

pub fn apart(a: &[StateChange], b: &[StateChange]) -> f64 {
    let difference: Vec<_> = a.iter().zip(b).map(|(a, b)| a.plus(-1.0, b)).collect();
    size(&difference)
}

/// Checks ⟨w, J v⟩ = ⟨Jᵀ w, v⟩ along all directions, to `exact` times the size of the products.
pub fn transposed(
    derivative: &mut StepDerivative,
    all: &[Direction],
    draw: &mut impl FnMut() -> f64,
    at: &str,
    exact: f64,
) {
    let one = |_: &StateChange| StateChange::from_array(&std::array::from_fn(|_| draw()));
    let w: Vec<StateChange> = all[0].states.iter().map(one).collect();
    let mut gradient = StepGradient::default();
    derivative.vjp(&w, &Constant::ALL, &mut gradient).unwrap();
    for along in all {
        let constants: Vec<_> = along.constants.iter().map(|(c, n)| (*c, &n[..])).collect();
        let (states, wrenches) = (&along.states[..], &along.wrenches[..]);
        let mut end = Vec::new();
        derivative.jvp(&StepChange { states, wrenches, constants: &constants }, &mut end).unwrap();
        let there: f64 = w.iter().zip(&end).map(|(w, end)| w.dot(end)).sum();
        let by_states = gradient.states.iter().zip(states).map(|(g, s)| g.dot(s));
        let by_wrenches = gradient.wrenches.iter().zip(wrenches);
        let by_wrenches = by_wrenches.map(|(g, w)| g.force.dot(&w.force) + g.torque.dot(&w.torque));
        let by_constants = constants.iter().map(|(constant, numbers)| {
            let place = Constant::ALL.iter().position(|c| c == constant).unwrap();
            gradient.constants[place].iter().zip(*numbers).map(|(g, n)| g * n).sum::<f64>()
        });
        let here = by_states.chain(by_wrenches).chain(by_constants).sum::<f64>();
        let scale = size(&w) * (size(&end) + 1e-3);
        assert!((there - here).abs() <= exact * scale, "{at}, {}: {there} {here}", along.name);
    }
}

/// Results of comparisons of step derivatives.
#[derive(Default)]
pub struct Tally {
    pub compared: usize,
    /// Directions left out because a kink is too near.
    pub left_out: usize,
    /// Directions in which the one-sided differences disagree although the margins are large
    /// enough.
    pub kinks: usize,
    /// Directions in which solutions of nearly equal steps scatter by more than the error.
    pub scattered: usize,
    pub worst: f64,
    pub missed: Vec<String>,
}

/// Compares the derivative of one step with central differences, by every argument. The best of
/// four step sizes counts. Large sizes have truncation errors, small ones show the last digits of
/// the solutions.
pub fn compare(
    world: &World,
    states: &[State],
    draw: &mut impl FnMut() -> f64,
    at: &str,
    tally: &mut Tally,
) {
    // Accuracy of the solutions relative to the speed scale.
    let count = world.bodies().len() as f64;
    let exact = if count > 1.0 { 3e-10 * count.sqrt() } else { 3e-11 };
    let Some((simulation, base)) = step(world, states, &[]) else { return };
    let mut derivative = StepDerivative::new();
    simulation.linearise(&base, &mut derivative).unwrap();
    let h = world.time_step();
    for along in directions(world, draw) {
        let constants: Vec<_> = along.constants.iter().map(|(c, n)| (*c, &n[..])).collect();
        let (changes, wrenches) = (&along.states, &along.wrenches);
        let change = StepChange { states: changes, wrenches, constants: &constants };
        let mut found = Vec::new();
        derivative.jvp(&change, &mut found).unwrap();
        let given = size(changes)
            + wrenches.iter().map(|w| w.force.norm() + w.torque.norm()).sum::<f64>() * h;
        let (mut best, mut compared, mut kinked, mut last) = (f64::INFINITY, 0, false, 0.0);
        let mut scale_of_best = 0.0;
        for by in [1e-4, 1e-5, 1e-6, 1e-7] {
            let ends = (states, base.next_states());
            let Some((expected, sides)) = difference(world, ends, &along, by) else { continue };
            // A change of the start that opens a gap opens it within one step.
            let moves = matches!(
                &along.name[..],
                "position"
                    | "turn"
                    | "size"
                    | "radius"
                    | "ground"
                    | "anchor"
                    | "joint_limits"
                    | "gear_ratio"
                    | "gear_offset"
            );
            let speed = size(&expected).max(size(&found)) * world.reach();
            let moved = 10.0 * by * if moves { speed + 1.0 / h } else { speed };
            let margin = derivative.margin();
            let margin = if moves { margin.min(derivative.feature_margin()) } else { margin };
            if margin < moved || derivative.unknown() > 0 || derivative.keeps_shares() {
                continue;
            }
            let scale = size(&expected).max(given).max(1e-9);
            // Gaps have a rounding error of 2e-16 of the reach. It changes the force distribution
            // under a face by that over h and the compliance of the selection rule.
            let shares = f64::EPSILON * world.reach() / (h * 1e-6);
            let exact = if moves { exact.max(shares) } else { exact };
            let rounding = exact * world.speed_scale() / (by * world.reach().min(1.0)) / scale;
            if rounding > 1e-3 {
                continue;
            }
            let missed = (apart(&found, &expected) / scale - rounding).max(0.0);
            if missed < best {
                (best, scale_of_best) = (missed, scale * by);
            }
            (kinked, last) = (sides / scale > rounding.max(1e-3), by);
            compared += 1;
        }
        if compared == 0 {
            tally.left_out += 1;
            continue;
        }
        if best > 1e-6 {
            let scatter = scatter(world, (states, base.next_states()), &along, &found);
            // With such errors of the solutions the difference has an error of (8 + 8 + 1 + 1)/12
            // of it, over the step size.
            if best * scale_of_best < 1.5 * scatter {
                println!(
                    "scatter: {at}, {}: {best:.1e} of {:.1e}",
                    along.name,
                    scatter / scale_of_best
                );
                tally.scattered += 1;
                continue;
            }
        }
        if best > 1e-6 {
            // Impulses may change more than velocities, for example if all links of a chain pull at
            // one. A margin below the change of the smallest difference indicates the kink. Both
            // sides may be beyond it.
            let pushed = [2.0 * last, -2.0 * last].into_iter().filter_map(|by| {
                let there = beside(world, states, &along, by)?;
                Some(2.0 * impulses_apart(world, &base, &there))
            });
            if derivative.margin() < pushed.fold(0.0, f64::max) {
                tally.left_out += 1;
                continue;
            }
        }
        // If the sides have different slopes there is no derivative: a kink that no margin shows.
        if kinked && best > 1e-6 {
            tally.kinks += 1;
            let margins = [derivative.margin(), derivative.feature_margin()];
            println!("a kink: {at}, {}: {best:.1e}, margins {margins:?}", along.name);
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
