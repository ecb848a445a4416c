//! The slopes of tosses, and what Gauss–Newton steps by them find.

use super::synthetic::{SUBSTEPS, model, tosses};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use tumble::fit::evaluator::{Forgetful, Query};
use tumble::fit::plan::{Plan, Sought};
use tumble::fit::search::Found;
use tumble::fit::{Constant, Evaluator, Loss, Parameter, ParameterValues, Protocol, SOUGHT, Toss};

fn hidden() -> ParameterValues {
    let values = model().values().with(Constant::Friction, 0.25);
    values.with(Constant::Restitution, 0.2)
}

fn with<T>(tosses: &[Toss], task: impl FnOnce(&mut Evaluator<'_>) -> T) -> T {
    let model = model();
    let protocol = Protocol::new(&model, SUBSTEPS);
    let mut memory = Forgetful;
    let flag = Arc::new(AtomicBool::new(false));
    task(&mut Evaluator::new(&model, &protocol, tosses, &mut memory, flag))
}

fn plan(parameters: &[Constant], evaluations: usize, polish: usize) -> Plan {
    let model = model();
    let sought = parameters.iter().map(|&parameter| Sought {
        parameter: parameter.into(),
        bounds: model.usual_bounds(parameter).unwrap(),
    });
    let (sought, loss) = (sought.collect(), Loss::Robust);
    Plan { sought, loss, evaluations, rounds: 2, polish, seed: 3 }
}

fn found(tosses: &[Toss], plan: &Plan) -> Found {
    let all: Vec<usize> = (0..tosses.len()).collect();
    with(tosses, |evaluator| plan.search(&model().values(), evaluator, &all)).unwrap()
}

/// Of each toss by every parameter, where all of the restitution is taken and the differences of both sides are within a
/// hundredth, to 2e-4 and what these are apart: central differences, of third order of 1e-6 and of fifth order of five sizes, of which the best one counts. The last digits of the solutions, enlarged by
/// every impact, are some 1e-9 of the loss, so that differences below 1e-5 say less, and tosses meet kinks within larger
/// ones. Values beside the hidden ones, a rounded body of another size.
#[test]
fn the_slopes_of_tosses_are_their_differences() {
    const BY: f64 = 1e-6;
    const SIZES: [f64; 5] = [1e-4, 3e-5, 1e-5, 3e-6, 1e-6];
    let tosses = tosses(&hidden(), 6, 1e-4, 1);
    let all: Vec<usize> = (0..tosses.len()).collect();
    let (mut compared, mut kinks, mut limited, mut worst) = (0, 0, 0, 0.0_f64);
    for (restitution, loss) in [(0.0, Loss::Robust), (0.2, Loss::Robust), (0.0, Loss::Mean)] {
        let values = hidden()
            .with(Constant::Friction, 0.3)
            .with(Constant::Restitution, restitution)
            .with(Constant::Size, 0.97)
            .with(Constant::Radius, 0.002)
            .with(Constant::Inertia, 1.1);
        with(&tosses, |evaluator| {
            let query = Query { values: &values, substeps: SUBSTEPS, tosses: &all };
            let slopes = evaluator.slopes(&query, &SOUGHT.map(Parameter::from), loss).unwrap();
            for (k, parameter) in SOUGHT.into_iter().enumerate() {
                if parameter == Constant::Restitution && restitution == 0.0 {
                    continue;
                }
                let mut at = |by: f64| {
                    let values = values.clone().with(parameter, values.get(parameter) + by);
                    let query = Query { values: &values, substeps: SUBSTEPS, tosses: &all };
                    let scores = evaluator.evaluate(&query).unwrap();
                    scores.iter().map(|score| loss.of(score)).collect::<Vec<_>>()
                };
                let ([before, here], after) = ([-BY, 0.0].map(&mut at), at(BY));
                let wide = SIZES.map(|by| (by, [-2.0 * by, -by, by, 2.0 * by].map(&mut at)));
                for toss in &all {
                    let sides = [here[*toss] - before[*toss], after[*toss] - here[*toss]];
                    let [left, right] = sides.map(|side| side / BY);
                    let slope = slopes[*toss].gradient[k];
                    let differences = wide.each_ref().map(|(by, [a, b, c, d])| {
                        (8.0 * (c[*toss] - b[*toss]) - (d[*toss] - a[*toss])) / (12.0 * by)
                    });
                    assert!((slopes[*toss].loss - here[*toss]).abs() < 1e-12);
                    let scale = right.abs().max(slope.abs()).max(1.0);
                    if slopes[*toss].limited > 0 {
                        limited += 1;
                        continue;
                    }
                    // Tosses bend and have kinks within the difference.
                    if (right - left).abs() > 1e-2 * scale {
                        kinks += 1;
                        continue;
                    }
                    compared += 1;
                    let all = differences.into_iter().chain([0.5 * (left + right)]);
                    let each = all.map(|difference| (slope - difference).abs() / scale);
                    let best = each.fold(f64::INFINITY, f64::min);
                    let off = best - (right - left).abs() / scale;
                    worst = worst.max(best);
                    assert!(off < 2e-4, "toss {toss} by {parameter:?}: {slope} {differences:?}");
                }
            }
        });
    }
    println!(
        "{compared} compared, {kinks} with sides that differ, {limited} where restitution is \
         limited, worst {worst:.1e}"
    );
    assert!(compared > 60);
}

/// Of recordings without noise the hidden values come back to some ten digits, where the search alone has three.
#[test]
fn exact_recordings_give_the_hidden_values_back() {
    let tosses = tosses(&hidden(), 6, 0.0, 0);
    let parameters = [Constant::Friction, Constant::Restitution];
    let off = |found: &Found| {
        let each = parameters.map(|of| (found.values.get(of) - hidden().get(of)).abs());
        each[0].max(each[1])
    };
    let searched = found(&tosses, &plan(&parameters, 60, 0));
    let polished = found(&tosses, &plan(&parameters, 60, 30));
    assert_eq!(searched.polish, None);
    let polish = polished.polish.as_ref().unwrap();
    println!("off by {:.1e}, polished {:.1e}: {polish:?}", off(&searched), off(&polished));
    assert!(polished.loss <= searched.loss && polish.loss_before == searched.loss);
    assert!(off(&searched) > 1e-5 && off(&polished) < 1e-8);
    assert!(polish.steps > 0 && polish.tried <= 30 && polish.blind == 0);
}

/// Through noise and an outlier the loss is no more than the search's, and the hidden values lie within what the slopes say.
#[test]
fn what_the_slopes_say_of_the_values_holds_the_hidden_ones() {
    let tosses = tosses(&hidden(), 12, 1e-4, 1);
    let parameters = [Constant::Friction, Constant::Restitution, Constant::Inertia];
    let found = found(&tosses, &plan(&parameters, 80, 20));
    let polish = found.polish.as_ref().unwrap();
    println!("{found:?}");
    assert!(found.loss <= polish.loss_before);
    assert_eq!(polish.covariance.shape(), (3, 3));
    assert!((&polish.covariance - polish.covariance.transpose()).amax() < 1e-12);
    let truth = [0.25, 0.2, 1.0];
    for (k, (parameter, truth)) in parameters.into_iter().zip(truth).enumerate() {
        let error = polish.covariance[(k, k)].sqrt();
        assert!(error > 0.0 && error < 0.1, "{parameter:?}: {error}");
        let off = (found.values.get(parameter) - truth).abs();
        assert!(off < 4.0 * error + 2e-3, "{parameter:?}: off by {off}, ± {error}");
    }
}

/// A parameter on its bound stays there, and nothing is said of its covariance.
#[test]
fn what_lies_on_a_bound_is_held() {
    let tosses = tosses(&hidden(), 4, 0.0, 0);
    let mut plan = plan(&[Constant::Friction], 40, 10);
    plan.sought[0].bounds = [0.35, 0.5];
    let found = found(&tosses, &plan);
    let polish = found.polish.unwrap();
    assert_eq!(found.values.get(Constant::Friction), 0.35, "{polish:?}");
    assert!(polish.covariance[(0, 0)].is_nan() && polish.slope == 0.0, "{polish:?}");
}
