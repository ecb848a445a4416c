//! Unit tests of `ddp.rs`.

use super::super::slopes::tests::pushed_box;
use super::*;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Without bounds, the decisions along the linear transitions are the Gauss–Newton step −(JᵀJ + E)⁻¹ ∇ of all controls.
/// Gradient and D agree with J too. The problem has pushes, torques, a start and constants.
#[test]
fn decisions_make_the_step_of_all_controls_at_once() {
    make_the_step_of_all_controls_at_once(12);
}

/// Runs longer than [`AT_ONCE`], and a multiple of it.
#[test]
fn decisions_agree_in_runs_longer_than_memory() {
    make_the_step_of_all_controls_at_once(2 * AT_ONCE + 44);
    make_the_step_of_all_controls_at_once(2 * AT_ONCE);
}

fn make_the_step_of_all_controls_at_once(steps: usize) {
    let (problem, controls) = pushed_box(steps);
    let interrupt = Arc::new(AtomicBool::new(false));
    let mut trials = Trials { problem: &problem, interrupt: &interrupt, runs: 0 };
    let mut model = DdpModel::new(&controls, 0, &mut trials).unwrap().unwrap();
    let (slopes, _) = problem.slopes(&controls, false, &interrupt).unwrap();
    let mut by = slopes.by;
    assert_eq!(model.transitions.len(), steps + 1);
    for (mut column, scale) in by.column_iter_mut().zip(&model.centre.scales) {
        column *= *scale;
    }
    // Constants have no effort; a small one makes the minimum unique.
    model.efforts.apply(|effort| *effort += 1e-3);
    let efforts = &model.efforts;
    let matrix = by.tr_mul(&by) + DMatrix::from_diagonal(efforts);
    let gradient = by.tr_mul(&slopes.rows) + efforts.component_mul(&model.centre.x);
    let near = |a: &DVector<f64>, b: &DVector<f64>| (a - b).amax() < 1e-9 * b.amax();
    let plain = &gradient - &model.centre.x * 1e-3;
    assert!(near(&model.centre.gradient, &plain), "{} {plain}", model.centre.gradient);
    let diagonal = matrix.diagonal().add_scalar(-1e-3);
    assert!(near(&model.damping, &diagonal), "{} {diagonal}", model.damping);
    assert!(model.centre.moves);
    let wanted = matrix.cholesky().unwrap().solve(&-gradient);

    let count = wanted.len();
    model.centre.room.down.fill(-1e3);
    model.centre.room.up.fill(1e3);
    let gains = model.gains(0.0).unwrap();
    let mut found = DVector::from_element(count, f64::NAN);
    let mut change = DVector::<f64>::zeros(0);
    for (transition, Gains { step, by, held }) in model.transitions.iter().zip(&gains) {
        let others = held.iter().map(|&of| found[of]);
        let z = change.iter().copied().chain(others);
        let z = DVector::from_iterator(change.len() + held.len(), z);
        let chosen = step + by.columns(0, z.len()) * z;
        for (&choice, value) in transition.chosen.iter().zip(&chosen) {
            found[choice] = *value;
        }
        let acting = transition.acting.iter().map(|&of| found[of]);
        let all =
            DVector::from_iterator(transition.by.ncols(), change.iter().copied().chain(acting));
        change = &transition.by * all;
    }
    // The matrices have a condition number of 1e6.
    assert!((&found - &wanted).amax() < 1e-7 * wanted.amax(), "{found} {wanted}");
}
