//! Derivative of a step from the system that an interior-point method solves in its last iteration:
//! the KKT matrix of the tutorial's program. It is evaluated at the native solution, the program's
//! minimum.
//!
//! With the active rows g = 0, and the variables that are not at a bound,
//!
//! ```text
//! ⎡ W  Aᵀ ⎤ ⎡ dx ⎤     ⎡     0      ⎤
//! ⎣ A  0  ⎦ ⎣ dy ⎦ = − ⎣ ∂g/∂p · dp ⎦,   A = ∂g/∂x,   W = ∇²L.
//! ```
//!
//! The objective and its gradient are 0 at the point, so that all multipliers are 0 as well. A and
//! W are the program's hand-written derivatives, compared with CasADi's elsewhere. ∂g/∂p are
//! differences of its rows at fixed x, which are smooth. None of this uses the native solver or its
//! derivative.

use crate::common::prelude::*;
use crate::common::{heights, points};
use crate::slopes::Program as _;
use crate::toss::*;
use nalgebra::DVector;
use tumble::step_nlp::{ProgramPoint, StepNlp, layout};
use tumble_core::mechanics::quaternion::attitude_map;

/// ε [N]: tiny, so that friction obeys the law.
const SMOOTHING: f64 = 1e-12;

/// Change of a step's data.
#[derive(Clone)]
struct Change {
    name: &'static str,
    state: [f64; 12],
    wrench: Wrench,
    constant: Option<(Constant, Vec<f64>)>,
}

/// Changes of one number of the state or the wrench, or of a constant along one direction.
fn changes(world: &World) -> Vec<Change> {
    let none = Change { name: "", state: [0.0; 12], wrench: Wrench::zero(), constant: None };
    let mut all = Vec::new();
    for k in 0..12 {
        let mut change = Change { name: "state", ..none.clone() };
        change.state[k] = 1.0;
        all.push(change);
    }
    for k in 0..3 {
        let mut pushed = Change { name: "force", ..none.clone() };
        pushed.wrench.force[k] = 100.0;
        all.push(pushed);
        let mut turned = Change { name: "torque", ..none.clone() };
        turned.wrench.torque[k] = 10.0;
        all.push(turned);
    }
    for constant in [
        Constant::Friction,
        Constant::Mass,
        Constant::Inertia,
        Constant::Gravity,
        Constant::TimeStep,
    ] {
        let way = match constant {
            Constant::Friction => vec![1.0],
            Constant::Gravity => vec![1.0, -2.0, 3.0],
            constant => constant.values(world),
        };
        all.push(Change { name: constant.name(), constant: Some((constant, way)), ..none.clone() });
    }
    all
}

/// Rows of the program at `x`, with the data moved by `by` along a change.
fn rows(
    step: &StepRecord,
    x: &[f64],
    alpha: &[f64],
    world: &World,
    change: &Change,
    by: f64,
) -> DVector<f64> {
    let moved = change.constant.as_ref().map(|(constant, way)| {
        let numbers: Vec<f64> =
            constant.values(world).iter().zip(way).map(|(own, way)| own + by * way).collect();
        world.with_constants(&[(*constant, &numbers)]).unwrap()
    });
    let mut nlp = StepNlp::new(moved.unwrap_or_else(|| world.clone()), SMOOTHING).unwrap();
    let state = StateChange::from_array(&change.state.map(|number| by * number));
    let Wrench { force, torque } = change.wrench;
    let wrench = Wrench { force: force * by, torque: torque * by };
    nlp.set_step(&state.applied(step.state()), &wrench, alpha.iter().copied());
    DVector::from_vec(nlp.constraints_at(x))
}

/// Derivative of the rows by a change, with differences of fourth order.
fn by_data(
    step: &StepRecord,
    x: &[f64],
    alpha: &[f64],
    world: &World,
    change: &Change,
) -> DVector<f64> {
    /// Step of the differences. Its fourth power is below the rounding of the rows.
    const BY: f64 = 1e-4;
    let at = |by: f64| rows(step, x, alpha, world, change, by);
    ((at(BY) - at(-BY)) * 8.0 - (at(2.0 * BY) - at(-2.0 * BY))) / (12.0 * BY)
}

/// Active part of a solution: variables that are not at a bound, and active rows.
struct Active {
    variables: Vec<usize>,
    rows: Vec<usize>,
    alpha: Vec<f64>,
}

impl Active {
    fn from_step(nlp: &StepNlp, step: &StepRecord, derivative: &StepDerivative) -> Option<Self> {
        /// Margin for being well inside a piece [m/s].
        const CLEAR: f64 = 1e-4;
        if derivative.margin() < CLEAR {
            return None;
        }
        let (at, n) = (nlp.layout(), points(nlp.world()));
        let mut variables: Vec<usize> = layout::STATE.collect();
        let mut rows: Vec<usize> = (0..layout::UNIT_NORM_ROW + 1).collect();
        let mut alpha = vec![0.0; n];
        for contact in
            step.first().solution.contacts.iter().filter(|contact| contact.carries_force())
        {
            let (i, [fx, fy, fz, s1, s2, slip]) = {
                let i = contact.key.point;
                (i, at.contact_variables(i))
            };
            alpha[i] = 1.0;
            variables.extend([fx, fy, fz, s1, s2]);
            let dissipation = at.dissipation_rows().start + 2 * i;
            let of = |range: std::ops::Range<usize>| range.start + i;
            rows.extend([dissipation, dissipation + 1, of(at.height_rows())]);
            rows.push(of(at.normal_complementarity_rows()));
            rows.push(of(at.friction_complementarity_rows()));
            // If it slips, the cone is active. If it sticks, the slip speed is at its bound.
            if contact.slip.norm() > CLEAR {
                variables.push(slip);
                rows.push(of(at.cone_rows()));
            }
        }
        Some(Self { variables, rows, alpha })
    }
}

/// dX⁺ from the KKT system, one column per change, and the smallest significant singular value
/// relative to the largest. `None` if the system does not determine dX⁺.
fn by_kkt(
    nlp: &StepNlp,
    x: &[f64],
    active: &Active,
    right: &[DVector<f64>],
) -> Option<(DMatrix<f64>, f64)> {
    let (n, m) = (active.variables.len(), active.rows.len());
    let (values, pattern) = (nlp.jacobian_at(x), nlp.jacobian_pattern());
    let mut a = DMatrix::<f64>::zeros(nlp.layout().constraints(), nlp.layout().variables());
    pattern.positions().zip(values).for_each(|((row, column), value)| a[(row, column)] = value);
    let multipliers = vec![0.0; nlp.layout().constraints()];
    let (values, pattern) = (nlp.hessian_at(x, 1.0, &multipliers), nlp.hessian_pattern());
    let mut w = DMatrix::<f64>::zeros(a.ncols(), a.ncols());
    for ((row, column), value) in pattern.positions().zip(values) {
        (w[(row, column)], w[(column, row)]) = (value, value);
    }
    // Forces are scaled by the speed that they cause.
    let body = &nlp.world().bodies()[0];
    let newton = body.mass() / nlp.world().time_step();
    let is_force = |variable: usize| (13..13 + 3 * nlp.layout().contacts()).contains(&variable);
    let unit = |variable: usize| if is_force(variable) { newton } else { 1.0 };
    let mut kkt = DMatrix::<f64>::zeros(n + m, n + m);
    for (i, &of) in active.variables.iter().enumerate() {
        for (j, &other) in active.variables.iter().enumerate() {
            kkt[(i, j)] = w[(of, other)] * unit(of) * unit(other);
        }
    }
    let mut sides = DMatrix::<f64>::zeros(n + m, right.len());
    for (i, &row) in active.rows.iter().enumerate() {
        let line: Vec<f64> =
            active.variables.iter().map(|&variable| a[(row, variable)] * unit(variable)).collect();
        let size = line.iter().fold(0.0_f64, |most, entry| most.max(entry.abs()));
        if size == 0.0 {
            continue;
        }
        for (j, entry) in line.iter().enumerate() {
            (kkt[(n + i, j)], kkt[(j, n + i)]) = (entry / size, entry / size);
        }
        for (column, right) in right.iter().enumerate() {
            sides[(n + i, column)] = -right[row] / size;
        }
    }
    let svd = kkt.svd(true, true);
    let most = svd.singular_values.max();
    let counts = |value: &f64| *value > 1e-10 * most;
    // A null direction of the system must not change X⁺.
    let mut ways = svd.v_t.as_ref()?.row_iter().zip(svd.singular_values.iter());
    if ways.any(|(way, value)| !counts(value) && way.columns(0, 13).norm() > 1e-7) {
        return None;
    }
    let least = svd.singular_values.iter().copied().filter(counts).fold(most, f64::min);
    let found = svd.solve(&sides, 1e-10 * most).ok()?;
    Some((found.rows(0, 13).into_owned(), least / most))
}

/// Checks the derivative in all regimes of tosses of three cubes, by every argument.
///
/// Rows of some 10 m/s have rounding errors of 1e-15, and their differences over 1e-4 have 1e-11.
/// The system amplifies that by its condition. The tolerance is some 1e-10 over the smallest
/// singular value, and 1e-9 for the derivative itself.
#[test]
#[ignore = "slow"]
fn the_kkt_system_at_the_native_point_has_the_same_derivative() {
    let (mut compared, mut open, mut near, mut worst, mut most) = (0, 0, 0, 0.0_f64, 0.0_f64);
    let mut modes = std::collections::BTreeMap::<(usize, usize), usize>::new();
    for body in cubes() {
        let world = World::new(parameters(body)).unwrap();
        let mut nlp = StepNlp::new(world.clone(), SMOOTHING).unwrap();
        for seed in [0, 42] {
            let mut simulation = native(&world, thrown(seed));
            let (mut step, mut derivative) = (StepRecord::new(), StepDerivative::new());
            for k in 0..600 {
                simulation.step(&mut step).unwrap();
                let carrying = step.first().solution.contacts.iter().filter(|c| c.carries_force());
                let carrying: Vec<_> = carrying.collect();
                if k % 7 != 0 && (carrying.is_empty() || carrying.len() > 2) {
                    continue;
                }
                simulation.linearise(&step, &mut derivative).unwrap();
                let Some(active) = Active::from_step(&nlp, &step, &derivative) else {
                    near += 1;
                    continue;
                };
                nlp.set_step(step.state(), &Wrench::zero(), active.alpha.iter().copied());
                let heights = heights(&world, step.next());
                let mut point = ProgramPoint::zeros(points(&world));
                let (ground, friction) = (world.ground().unwrap(), world.friction());
                point.set_solution(
                    &step.first().solution,
                    ground,
                    |i| heights[i],
                    friction,
                    SMOOTHING,
                );
                let (x, alpha) = (point.as_slice(), &active.alpha);
                let changes = changes(&world);
                let right: Vec<_> =
                    changes.iter().map(|change| by_data(&step, x, alpha, &world, change)).collect();
                let Some((found, least)) = by_kkt(&nlp, x, &active, &right) else {
                    open += 1;
                    continue;
                };
                let slipping = carrying.iter().filter(|c| c.slip.norm() > 1e-4).count();
                *modes.entry((carrying.len() - slipping, slipping)).or_default() += 1;
                for (column, change) in changes.iter().enumerate() {
                    let numbers: Vec<_> =
                        change.constant.iter().map(|(c, n)| (*c, &n[..])).collect();
                    let mut end = Vec::new();
                    let (states, wrenches) =
                        ([StateChange::from_array(&change.state)], [change.wrench]);
                    let given =
                        StepChange { states: &states, wrenches: &wrenches, constants: &numbers };
                    derivative.jvp(&given, &mut end).unwrap();
                    let kkt = end_of(step.next(), &found.column(column).into_owned());
                    let apart = end[0].plus(-1.0, &kkt);
                    let off = apart.dot(&apart).sqrt() / (1.0 + end[0].dot(&end[0]).sqrt());
                    worst = worst.max(off);
                    most = most.max((off - 1e-9) * least);
                    compared += 1;
                    assert!(
                        off < 1e-9 + 1e-10 / least,
                        "seed {seed}, step {k}, {}: {off:e}\n{kkt:?}\n{:?}",
                        change.name,
                        end[0]
                    );
                }
            }
        }
    }
    println!(
        "{compared} compared, worst {worst:.1e}, times the least singular value {most:.1e}; steps left open {open}, near a kink {near}"
    );
    println!("steps by contacts that stick and slip: {modes:?}");
    assert!(
        compared > 5000
            && modes.keys().any(|mode| mode.0 > 0)
            && modes.keys().any(|mode| mode.1 > 1)
    );
}

/// Change of a state from the change of its thirteen numbers: δθ = 2 (L(q) H)ᵀ δq.
fn end_of(state: &State, numbers: &DVector<f64>) -> StateChange {
    let three = |first: usize| Vector3::new(numbers[first], numbers[first + 1], numbers[first + 2]);
    let quaternion = Vector4::new(numbers[3], numbers[4], numbers[5], numbers[6]);
    StateChange {
        position: three(layout::POSITION.start),
        turn: attitude_map(&state.attitude).transpose() * quaternion * 2.0,
        velocity: three(layout::VELOCITY.start),
        spin: three(layout::SPIN.start),
    }
}
