//! What a fit found.

use super::memory::FileMemory;
use super::task::Task;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use tumble::fit::ensemble::{Ensemble, Noise, ensembles};
use tumble::fit::folds::{self, Fold};
use tumble::fit::neighbourhood::Neighbourhood;
use tumble::fit::search::Found;
use tumble::fit::{Evaluator, FitError, ParameterValues, Query, TossScore};
use tumble::mechanics::State;

/// A toss is on another face where its attitude ends farther off than this, rad.
pub const OTHER_FACE: f64 = std::f64::consts::FRAC_PI_4;

/// The noise of the recorded cube at rest, as its publishers' data show it.
const NOISE: Noise = Noise { position: 3.5e-5, attitude: 0.02 * std::f64::consts::PI / 180.0 };

/// What ensembles say together.
pub struct EnsembleMeans {
    /// Over all members of all tosses.
    pub all: Mean,
    /// Over the best member of every toss.
    pub best: Mean,
    /// Tosses of which members end on the recorded face, and others do not.
    pub divided: usize,
    /// The median of the spread of the ends, m.
    pub spread: f64,
}

pub struct Results {
    /// The found values, or those of the start where nothing was sought.
    pub values: ParameterValues,
    pub scores_at_start: Vec<TossScore>,
    pub scores: Vec<TossScore>,
    pub found: Option<Found>,
    pub neighbourhood: Option<Neighbourhood>,
    pub folds: Vec<Fold>,
    /// Empty where it was not asked for.
    pub ensembles: Vec<Ensemble>,
    /// Over all evaluations.
    pub steps: u64,
    pub failed: u64,
    /// The simulated states of every toss with the found values, of each frame those of all bodies.
    pub motions: Vec<Vec<State>>,
}

/// Means over tosses.
#[derive(Debug, Clone, Copy)]
pub struct Mean {
    /// % of the length.
    pub position: f64,
    /// Degrees.
    pub rotation: f64,
    /// Tosses that end on another face.
    pub other_face: usize,
    /// m/s.
    pub residual: f64,
}

impl Mean {
    pub fn of(scores: &[TossScore]) -> Self {
        let n = scores.len() as f64;
        let mean = |of: &dyn Fn(&TossScore) -> f64| scores.iter().map(of).sum::<f64>() / n;
        Self {
            position: 100.0 * mean(&|score| score.position),
            rotation: mean(&|score| score.rotation).to_degrees(),
            other_face: scores.iter().filter(|score| score.end > OTHER_FACE).count(),
            residual: scores.iter().map(|score| score.residual).fold(0.0, f64::max),
        }
    }
}

impl Results {
    pub fn find(
        task: &Task,
        memory: &mut FileMemory,
        interrupt: &Arc<AtomicBool>,
    ) -> Result<Self, FitError> {
        let tosses = &task.data.tosses;
        let flag = Arc::clone(interrupt);
        let mut evaluator = Evaluator::new(&task.model, &task.protocol, tosses, memory, flag);
        let all: Vec<usize> = (0..tosses.len()).collect();
        let substeps = task.protocol.substeps;
        let score = |values: &ParameterValues, evaluator: &mut Evaluator<'_>| {
            evaluator.evaluate(&Query { values, substeps, tosses: &all })
        };
        let (mut values, mut found, mut neighbourhood) = (task.start.clone(), None, None);
        let scores_at_start = score(&values, &mut evaluator)?;
        let mut scores = scores_at_start.clone();
        let mut folds = Vec::new();
        if task.is_search() {
            let best = task.plan.search(&task.start, &mut evaluator, &all)?;
            values = best.values.clone();
            found = Some(best);
            scores = score(&values, &mut evaluator)?;
            // Of one recording there is no other sample.
            if task.neighbours > 0 && tosses.len() > 1 {
                let plan = &task.plan;
                let around = Neighbourhood::look(plan, &values, task.neighbours, &mut evaluator)?;
                neighbourhood = Some(around);
            }
            if task.folds > 0 {
                for kept in folds::parts(tosses, task.folds, task.plan.seed)? {
                    folds.push(folds::fold(&task.plan, &task.start, &mut evaluator, &kept)?);
                }
            }
        }
        let (steps, failed) = (evaluator.steps, evaluator.failed);
        let mut motions = Vec::with_capacity(tosses.len());
        for toss in tosses {
            let mut motion = Vec::new();
            let (model, protocol) = (&task.model, &task.protocol);
            tumble::fit::rollout::rollout(model, protocol, &values, toss, interrupt, |states| {
                motion.extend_from_slice(states);
            })?;
            motions.push(motion);
        }
        let ensembles = match task.ensemble {
            0 => Vec::new(),
            members => {
                let (model, protocol, seed) = (&task.model, &task.protocol, task.plan.seed);
                ensembles(model, protocol, &values, tosses, members, NOISE, seed, interrupt)?
            }
        };
        let of_ensembles = || ensembles.iter().flat_map(|ensemble| &ensemble.scores);
        let steps = steps + of_ensembles().map(|score| u64::from(score.steps)).sum::<u64>();
        let failed = failed + of_ensembles().map(|score| u64::from(score.failed)).sum::<u64>();
        Ok(Self {
            values,
            scores_at_start,
            scores,
            found,
            neighbourhood,
            folds,
            ensembles,
            steps,
            failed,
            motions,
        })
    }

    /// What the ensembles say, if there are any.
    pub fn ensemble_means(&self) -> Option<EnsembleMeans> {
        let ensembles = &self.ensembles;
        let mut spreads: Vec<f64> = ensembles.iter().map(|ensemble| ensemble.spread).collect();
        spreads.sort_by(f64::total_cmp);
        let spread = *spreads.get(spreads.len() / 2)?;
        let all = ensembles.iter().flat_map(|ensemble| ensemble.scores.iter().copied());
        let best = ensembles.iter().map(|ensemble| ensemble.best);
        Some(EnsembleMeans {
            all: Mean::of(&all.collect::<Vec<_>>()),
            best: Mean::of(&best.collect::<Vec<_>>()),
            divided: ensembles.iter().filter(|ensemble| ensemble.divided).count(),
            spread,
        })
    }

    /// The scores of all tosses in the folds that kept them back, in the order of the tosses.
    pub fn kept(&self) -> Option<Vec<TossScore>> {
        if self.folds.is_empty() {
            return None;
        }
        let mut scores = self.scores.clone();
        for fold in &self.folds {
            for (toss, score) in fold.kept.iter().zip(&fold.scores) {
                scores[*toss] = *score;
            }
        }
        Some(scores)
    }
}
