//! What a fit finds.

use super::synthetic::{RATE, SUBSTEPS, model, tosses};
use rayon::ThreadPoolBuilder;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use tumble::fit::evaluator::{Forgetful, Query};
use tumble::fit::folds::parts;
use tumble::fit::neighbourhood::Neighbourhood;
use tumble::fit::plan::{Plan, Sought};
use tumble::fit::rollout::rollout;
use tumble::fit::search::Found;
use tumble::fit::{Constant, Evaluator, FitError, Loss, Model, ParameterValues, Protocol, Toss};

fn plan(model: &Model, parameters: &[Constant], evaluations: usize) -> Plan {
    let sought = parameters.iter().map(|&parameter| Sought {
        parameter: parameter.into(),
        bounds: model.usual_bounds(parameter).unwrap(),
    });
    let (sought, loss) = (sought.collect(), Loss::Robust);
    Plan { sought, loss, evaluations, rounds: 2, polish: 0, seed: 3 }
}

fn search(plan: &Plan, tosses: &[Toss], threads: usize) -> Result<Found, FitError> {
    let model = model();
    let protocol = Protocol::new(&model, SUBSTEPS);
    let mut memory = Forgetful;
    let flag = Arc::new(AtomicBool::new(false));
    let mut evaluator = Evaluator::new(&model, &protocol, tosses, &mut memory, flag);
    let all: Vec<usize> = (0..tosses.len()).collect();
    let pool = ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    pool.install(|| plan.search(&model.values(), &mut evaluator, &all))
}

fn hidden() -> ParameterValues {
    let values = model().values().with(Constant::Friction, 0.25);
    values.with(Constant::Restitution, 0.2)
}

/// A simulation with the hidden values is the recording itself: the start is the recorded state,
/// the steps are the same.
#[test]
fn the_hidden_values_have_no_error() {
    let (model, tosses) = (model(), tosses(&hidden(), 4, 0.0, 0));
    let protocol = Protocol::new(&model, SUBSTEPS);
    for toss in &tosses {
        assert!(protocol.start_frame(toss) < 4);
        let mut frames = 0;
        let flag = Arc::new(AtomicBool::new(false));
        let score = rollout(&model, &protocol, &hidden(), toss, &flag, |_| frames += 1).unwrap();
        // The recorded attitude is made a unit quaternion once more, which chance may enlarge.
        assert!(score.position < 1e-6 && score.rotation < 1e-6, "{score:?}");
        assert_eq!(score.failed, 0);
        assert_eq!(frames, toss.frames.len() - protocol.start_frame(toss));
    }
}

/// With noise of 0.1 mm and 0.03°, and two tosses of twelve that slide away: friction within 5 %,
/// restitution within a tenth of what it may be.
#[test]
fn hidden_parameters_come_back_through_noise_and_outliers() {
    let tosses = tosses(&hidden(), 12, 1e-4, 2);
    let model = model();
    let plan = plan(&model, &[Constant::Friction, Constant::Restitution], 120);
    let found = search(&plan, &tosses, 2).unwrap();
    let [friction, restitution] =
        [Constant::Friction, Constant::Restitution].map(|parameter| found.values.get(parameter));
    assert!((friction - 0.25).abs() < 0.0125, "friction {friction}, {found:?}");
    assert!((restitution - 0.2).abs() < 0.06, "restitution {restitution}");
    assert!(found.loss < 0.5 * found.loss_at_start);
    assert_eq!(found.refused, 0);
}

#[test]
fn threads_change_nothing() {
    let tosses = tosses(&hidden(), 6, 1e-4, 1);
    let plan = plan(&model(), &[Constant::Friction, Constant::Radius], 40);
    assert_eq!(search(&plan, &tosses, 1), search(&plan, &tosses, 2));
}

/// The intervals of the bootstrap hold the hidden value of what the tosses determine.
#[test]
fn the_bootstrap_holds_the_hidden_friction() {
    let tosses = tosses(&hidden(), 12, 1e-4, 0);
    let model = model();
    let protocol = Protocol::new(&model, SUBSTEPS);
    let mut memory = Forgetful;
    let flag = Arc::new(AtomicBool::new(false));
    let mut evaluator = Evaluator::new(&model, &protocol, &tosses, &mut memory, flag);
    let plan = plan(&model, &[Constant::Friction], 40);
    // From beside the hidden value, so that it must be found, not just named.
    let centre = hidden().with(Constant::Friction, 0.255);
    let around = Neighbourhood::look(&plan, &centre, 40, &mut evaluator).unwrap();
    let interval = around.intervals[0];
    let [low, .., high] = interval.quantiles;
    assert!(low - 0.005 < 0.25 && 0.25 < high + 0.005, "{interval:?}");
    assert!(high - low < 0.05 && interval.on_border < 0.5, "{interval:?}");
}

/// A recording that occurs again, moved and turned about the vertical, is kept back with its twin.
#[test]
fn twins_are_in_the_same_fold() {
    let mut tosses = tosses(&hidden(), 8, 1e-4, 0);
    let mut twin = tosses[3].clone();
    twin.name = "twin".to_owned();
    for frame in &mut twin.frames {
        let position = frame.position;
        frame.position.x = 1.0 - position.y;
        frame.position.y = position.x;
    }
    tosses.push(twin);
    for seed in 0..20 {
        let parts = parts(&tosses, 4, seed).unwrap();
        let fold = |toss| parts.iter().position(|part| part.binary_search(&toss).is_ok());
        assert_eq!(fold(3), fold(8), "seed {seed}");
        assert!((0..9).all(|toss| fold(toss).is_some()));
        assert_eq!(parts.iter().map(Vec::len).sum::<usize>(), 9);
    }
    assert!(parts(&tosses, 5, 1).unwrap_err().to_string().contains("8 different recordings"));
    assert!(parts(&tosses, usize::MAX, 1).is_err());
}

#[test]
fn requests_without_meaning_are_refused_by_name() {
    let tosses = tosses(&hidden(), 4, 0.0, 0);
    let model = model();
    let refused = |plan: Plan| search(&plan, &tosses, 1).unwrap_err().to_string();
    let friction = [Constant::Friction];
    assert!(refused(plan(&model, &[], 40)).contains("no parameter"));
    assert!(refused(plan(&model, &[friction[0]; 2], 40)).contains("friction is named twice"));
    assert!(refused(plan(&model, &friction, 5)).contains("too few"));
    let endless = Plan { rounds: usize::MAX, ..plan(&model, &friction, 40) };
    assert!(refused(endless).contains("too few"));
    let mut off = plan(&model, &friction, 40);
    off.sought[0].bounds = [0.5, 0.6];
    assert!(refused(off.clone()).contains("starts at 0.4, outside of its bounds, 0.5 to 0.6"));
    off.sought[0].bounds = [0.6, f64::NAN];
    assert!(refused(off).contains("are no bounds"));
}

#[test]
fn a_raised_flag_ends_a_fit() {
    let tosses = tosses(&hidden(), 4, 0.0, 0);
    let model = model();
    let protocol = Protocol::new(&model, SUBSTEPS);
    let mut memory = Forgetful;
    let flag = Arc::new(AtomicBool::new(true));
    let mut evaluator = Evaluator::new(&model, &protocol, &tosses, &mut memory, flag);
    let plan = plan(&model, &[Constant::Friction], 40);
    let found = plan.search(&model.values(), &mut evaluator, &[0, 1]);
    assert_eq!(found.unwrap_err(), FitError::Interrupted);
}

/// Indices of no toss and recordings of nothing are refused, in words that name them.
#[test]
fn tosses_that_are_not_there_are_refused() {
    let (model, hidden) = (model(), hidden());
    let protocol = Protocol::new(&model, SUBSTEPS);
    let recorded = tosses(&hidden, 2, 0.0, 0);
    let empty = Toss::new("empty", RATE, Vec::new());
    let flag = || Arc::new(AtomicBool::new(false));
    let evaluate = |tosses: &[Toss], asked: &[usize]| {
        let mut memory = Forgetful;
        let mut evaluator = Evaluator::new(&model, &protocol, tosses, &mut memory, flag());
        let query = Query { values: &hidden, substeps: SUBSTEPS, tosses: asked };
        evaluator.evaluate(&query).map(drop).map_err(|error| error.to_string())
    };
    assert_eq!(evaluate(&recorded, &[1, 0]), Ok(()));
    let missing = evaluate(&recorded, &[0, 2]).unwrap_err();
    assert!(missing.contains("toss 2") && missing.contains("there are 2"), "{missing}");
    assert!(evaluate(&recorded, &[]).unwrap_err().contains("no toss"));
    let nothing = evaluate(std::slice::from_ref(&empty), &[0]).unwrap_err();
    assert!(nothing.contains("toss empty: has no frames"), "{nothing}");
    assert!(protocol.start(&empty).position.x.is_nan());
    assert_eq!(protocol.start_frame(&empty), 0);
}
