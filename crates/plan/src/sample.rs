//! Sampling: CMA-ES over a few pieces of each control, by runs on all threads of the caller's rayon pool.
//!
//! The method compares costs only, so plateaus and kinks do not stop it. With few variables it
//! decides the rough shape of a plan, for example over an edge or around it. A tenth of the runs is
//! scattered over the bounds. Each round of CMA-ES then starts at the best controls so far. The
//! first round is wide, and each next one is narrower with more pieces.
//!
//! A middle round without more pieces than the previous one starts elsewhere if the best controls still miss. The seed
//! determines all draws, on any number of threads.

use super::cma_es::CmaEs;
use super::stage::{SearchProgress, SearchWatch, Stage, StageResult};
use super::{PlanError, PlanProblem, Replay};
use rayon::prelude::*;
use std::ops::Range;

/// Sampling by CMA-ES.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// Seed of the draws.
    pub seed: u64,
    /// Largest number of runs; by default 200 for each variable, and 2000 more.
    pub runs: Option<u64>,
    /// Largest number of pieces of each control in the first round.
    pub knots: usize,
    /// Number of rounds.
    pub rounds: u32,
}

impl Default for Sample {
    fn default() -> Self {
        Self { seed: 1, runs: None, knots: 10, rounds: 3 }
    }
}

/// Cost of a run that cannot be made; CMA-ES ranks by finite numbers.
const WORST: f64 = 1e30;

/// Width of the first round in units of the bounds, and the factor of each next round.
const WIDTH: (f64, f64) = (0.3, 0.3);

/// Share of the runs that are scattered over the bounds before the first round.
const SCATTERED: f64 = 0.1;

/// Largest number of coordinates of CMA-ES: it decomposes a matrix of their square repeatedly.
const MOST: usize = 2000;

impl Stage for Sample {
    fn name(&self) -> &'static str {
        "sample"
    }

    fn is_fallback(&self) -> bool {
        true
    }

    fn check(&self, problem: &PlanProblem) -> Result<(), PlanError> {
        let knots = self.knots_in(self.rounds.max(1) - 1);
        let first = problem.variables().iter().filter(|variable| variable.knot == 0);
        let pieces = first.map(|of| knots.clamp(1, problem.controls()[of.control].knots));
        let count: usize = pieces.sum();
        if count <= MOST {
            return Ok(());
        }
        Err(PlanError::Problem(format!(
            "sample: its last round has {count} coordinates; allowed: up to {MOST}; use fewer \
             knots or rounds"
        )))
    }

    fn run(
        &self,
        problem: &PlanProblem,
        from: &Replay,
        watch: &mut SearchWatch<'_>,
    ) -> Result<StageResult, PlanError> {
        let cost = judged(problem, &from.controls, watch)?;
        let mut best = SampledRun { controls: from.controls.clone(), cost };
        let mut end = StageResult { controls: best.controls.clone(), ..StageResult::default() };
        if problem.variables().is_empty() {
            end.message = "the problem has no variables".to_owned();
            return Ok(end);
        }
        let rounds = self.rounds.max(1);
        let coarse = Coarse::new(problem, self.knots, best.controls.clone()).count as u64;
        // By default 200 runs for each coordinate and 2000 more
        let runs = self.runs.unwrap_or(200 * (10 + coarse));
        let scattered = ((SCATTERED * runs as f64) as u64).max(1);
        // Scattered runs first, then rounds of CMA-ES about the best one, each narrower
        let thrown = self.scatter(problem, 0..scattered, &mut end, watch)?;
        best = thrown.filter(|thrown| thrown.cost < best.cost).unwrap_or(best);
        for round in 0..rounds {
            if !end.message.is_empty() {
                break;
            }
            let last = runs * u64::from(round + 1) / u64::from(rounds);
            let width = WIDTH.0 * WIDTH.1.powi(round.min(16) as i32);
            let mut about = SampleRound { number: round, last, from: best.controls.clone(), width };
            // A round with as many pieces as the one before starts elsewhere if the best run misses.
            if round + 1 < rounds && self.looks_elsewhere(problem, round, &best.controls)? {
                let first = u64::from(round) * scattered;
                let thrown = self.scatter(problem, first..first + scattered, &mut end, watch)?;
                if let Some(thrown) = thrown {
                    about = SampleRound { from: thrown.controls, width: WIDTH.0, ..about };
                }
            }
            self.round(problem, about, &mut best, &mut end, watch)?;
        }
        if end.message.is_empty() {
            end.message = format!("{} runs", end.runs);
        }
        end.controls = best.controls;
        Ok(end)
    }
}

impl Sample {
    /// Largest number of pieces of each control in a round.
    fn knots_in(&self, round: u32) -> usize {
        self.knots.saturating_mul(1 << round.min(16))
    }

    /// True if a round starts elsewhere, because it has as many pieces as the previous round and
    /// the best run misses.
    fn looks_elsewhere(
        &self,
        problem: &PlanProblem,
        round: u32,
        best: &[f64],
    ) -> Result<bool, PlanError> {
        let Some(before) = round.checked_sub(1) else { return Ok(false) };
        let pieces = |round| Coarse::new(problem, self.knots_in(round), Vec::new()).count;
        Ok(pieces(round) == pieces(before) && !problem.replay(best)?.meets())
    }

    /// Best of the runs `which`, scattered evenly over the bounds. Sets the message of `end` if no run moves a target.
    ///
    /// Coordinate j of point i is frac(½ + i g^(−j)) in d dimensions, with the root g of g^(d+1) = g + 1.
    fn scatter(
        &self,
        problem: &PlanProblem,
        which: Range<u64>,
        end: &mut StageResult,
        watch: &mut SearchWatch<'_>,
    ) -> Result<Option<SampledRun>, PlanError> {
        let count = which.end - which.start;
        let mut best = None::<SampledRun>;
        let coarse = Coarse::new(problem, self.knots, Vec::new());
        // Fixed-point iteration for g, which has converged after 60 steps in any dimension
        let mut g = 2.0_f64;
        for _ in 0..60 {
            g = libm::pow(1.0 + g, 1.0 / (coarse.count as f64 + 1.0));
        }
        let steps: Vec<f64> = (1..=coarse.count).map(|j| libm::pow(g, -(j as f64)) % 1.0).collect();
        // A coarse coordinate has the bounds of its variables.
        let point = |i: u64| {
            let at =
                |j: usize| (0.5 + (self.seed.wrapping_add(i) % (1 << 32)) as f64 * steps[j]) % 1.0;
            let each = problem.variables().iter().zip(&coarse.place);
            each.map(|(v, place)| v.bounds[0] + v.scale() * at(*place)).collect::<Vec<f64>>()
        };
        let interrupt = watch.interrupt;
        let run = |i: u64| problem.run_cost(&point(i), Some(interrupt));
        let runs: Vec<_> = which.clone().into_par_iter().map(run).collect();
        end.runs += count;
        // Best run, and the range of the costs
        let (mut seen, mut failure) = (None::<[f64; 2]>, None);
        for (i, run) in which.zip(runs) {
            match run {
                Ok(cost) => {
                    let [least, most] = seen.unwrap_or([cost.task; 2]);
                    seen = Some([least.min(cost.task), most.max(cost.task)]);
                    if best.as_ref().is_none_or(|best| cost.judged() < best.cost) {
                        best = Some(SampledRun { controls: point(i), cost: cost.judged() });
                    }
                }
                Err(error) => failure = failure.or(Some(error)),
            }
        }
        end.message = match (seen, failure) {
            _ if watch.is_interrupted() => "interrupted".to_owned(),
            (None, Some(why)) => format!("no run succeeded: {why}"),
            (Some([least, most]), _) if count > 1 && most - least <= 1e-9 * most => {
                format!("none of {count} runs within the bounds moved a target")
            }
            _ => String::new(),
        };
        Ok(best)
    }

    /// One round of CMA-ES. Sets the message of `end` if it was stopped.
    fn round(
        &self,
        problem: &PlanProblem,
        round: SampleRound,
        best: &mut SampledRun,
        end: &mut StageResult,
        watch: &mut SearchWatch<'_>,
    ) -> Result<(), PlanError> {
        let SampleRound { number, last, from, width } = round;
        let coarse = Coarse::new(problem, self.knots_in(number), from);
        let interrupt = watch.interrupt;
        // Points outside the bounds are clipped, and cost more by their distance.
        let loss = |(controls, outside): &(Vec<f64>, f64)| {
            match problem.run_cost(controls, Some(interrupt)) {
                Ok(cost) => cost.judged().min(WORST) * (1.0 + outside),
                // A start that cannot be simulated ranks last.
                Err(_) => WORST * (1.0 + outside),
            }
        };
        // Twice Hansen's default size
        let population = 2 * (4 + (3.0 * libm::log(coarse.count as f64)) as usize);
        let seed = self.seed.wrapping_add(u64::from(number)) as u32;
        let mut search = CmaEs::new(coarse.count, population, width, seed);
        loop {
            let points = search.draw();
            let points = points.iter().map(|point| coarse.controls(problem, point.as_slice()));
            let points: Vec<_> = points.collect();
            let losses: Vec<f64> = points.par_iter().map(loss).collect();
            end.iterations += 1;
            end.runs += points.len() as u64;
            if watch.is_interrupted() {
                end.message = "interrupted".to_owned();
                return Ok(());
            }
            search.adapt(&losses);
            // The best of all rounds is kept apart from the mean of the search.
            let first = (0..points.len()).min_by(|a, b| losses[*a].total_cmp(&losses[*b]));
            if let Some(first) = first.filter(|first| losses[*first] < WORST) {
                let controls = &points[first].0;
                let cost = judged(problem, controls, watch)?;
                if cost < best.cost {
                    *best = SampledRun { controls: controls.clone(), cost };
                }
            }
            let progress = SearchProgress {
                stage: self.name(),
                iteration: end.iterations,
                cost: best.cost,
                controls: &best.controls,
            };
            if !watch.goes_on(&progress) {
                end.message = "stopped".to_owned();
                return Ok(());
            }
            if search.has_converged() || end.runs >= last {
                return Ok(());
            }
        }
    }
}

/// Controls, and the objective of the run with them.
struct SampledRun {
    controls: Vec<f64>,
    cost: f64,
}

/// One round of CMA-ES.
struct SampleRound {
    number: u32,
    /// The runs of all rounds after which it ends.
    last: u64,
    /// The controls around which it begins to look, and how far, in units of the bounds.
    from: Vec<f64>,
    width: f64,
}

/// Objective of a run.
fn judged(
    problem: &PlanProblem,
    controls: &[f64],
    watch: &SearchWatch<'_>,
) -> Result<f64, PlanError> {
    match problem.run_cost(controls, Some(watch.interrupt)) {
        Ok(cost) => Ok(cost.judged()),
        Err(PlanError::Interrupted) => Ok(f64::INFINITY),
        Err(error) => Err(error),
    }
}

/// Coarse coordinates: each one is added to all variables of a component within a coarse piece, in units of the bounds.
struct Coarse {
    from: Vec<f64>,
    /// Coarse coordinate of each variable.
    place: Vec<usize>,
    count: usize,
}

impl Coarse {
    fn new(problem: &PlanProblem, knots: usize, from: Vec<f64>) -> Self {
        let mut known: Vec<(usize, usize, usize)> = Vec::new();
        let place = problem.variables().iter().map(|variable| {
            let fine = problem.controls()[variable.control].knots;
            let piece = variable.knot * knots.clamp(1, fine) / fine;
            let key = (variable.control, variable.component, piece);
            known.iter().rposition(|other| *other == key).unwrap_or_else(|| {
                known.push(key);
                known.len() - 1
            })
        });
        let place = place.collect();
        Self { from, place, count: known.len() }
    }

    /// Controls at a point, clipped to their bounds, and the mean clipped length in units of the bounds.
    fn controls(&self, problem: &PlanProblem, point: &[f64]) -> (Vec<f64>, f64) {
        let mut outside = 0.0;
        let each = problem.variables().iter().zip(&self.from).zip(&self.place);
        let controls = each.map(|((variable, from), place)| {
            let wanted = from + variable.scale() * point[*place];
            let value = wanted.clamp(variable.bounds[0], variable.bounds[1]);
            outside += (wanted - value).abs() / variable.scale();
            value
        });
        let controls = controls.collect();
        (controls, outside / self.place.len().max(1) as f64)
    }
}
