//! The leg `polish`: the modes of all contacts are read off the replay and fixed, so that the program has the laws
//! themselves and no smoothing, and is solved again until its replay has the same modes.
//!
//! ```text
//! open:   F = 0,  φ⁺ ≥ 0
//! stick:  φ̂ = 0,  ĉ = 0,               (μ F_n)² − |F_t|² ≥ 0,  F_n ≥ 0
//! slip:   φ̂ = 0,  μ F_n ĉ + λ F_t = 0,  (μ F_n)² − |F_t|² = 0,  F_n ≥ 0,  λ ≥ 0         (P17)
//! ```
//!
//! Once they agree, it is solved again with the compliance about the forces that it ended with (p̂⁰ of P13): then it gives
//! nothing, and the plan is the replay to rounding.

use super::program::{
    MINIMUM_FILL, PlanNlp, Solved, Told, UNSCALED, or_refused, solve, usual_cost,
};
use super::{EXACTLY, Leg, LegEnd, PlanError, Problem, Replay, Watch};
use crate::ipopt::{BarrierStrategy, Options, ReturnStatus};

/// The leg `polish`.
#[derive(Debug, Clone)]
pub struct Polish {
    /// Iterations of one program, at most, together with those of the second one where the first is not solved.
    pub most_iterations: u32,
    /// How often modes are read off a replay.
    pub rounds: usize,
    /// ε of the first program of a round. With none of it the shares of forces are open where faces slide, and what comes out
    /// need not replay.
    pub compliance: f64,
    /// How often the compliance is moved to the forces of the end.
    pub anchored: usize,
}

/// The forces at which the compliance of a program gives nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Forces {
    /// None, as in the rule that selects.
    Selected,
    /// Those of the replay: it is a point of the program to rounding. Less is moved, and the optimum is that of forces near these.
    OfTheRun,
}

/// The barrier about a run: forces that are just above 0 are not pushed off it by more than the run is moved for.
const AT_THE_RUN: f64 = 1e-11;

/// Which part of the iterations is kept for the second program: it begins at a point of it, and takes few or none.
const FOR_THE_SECOND: u32 = 8;

/// The replay of a program's end, whether it was solved, and whether to go on.
type Round = (Replay, bool, bool);

impl Default for Polish {
    fn default() -> Self {
        Self { most_iterations: 150, rounds: 6, compliance: 1e-6, anchored: 2 }
    }
}

impl Leg for Polish {
    fn name(&self) -> &'static str {
        "polish"
    }

    fn run(
        &self,
        problem: &Problem,
        from: &Replay,
        watch: &mut Watch<'_>,
    ) -> Result<LegEnd, PlanError> {
        or_refused(self.search(problem, from, watch), from)
    }
}

impl Polish {
    fn search(
        &self,
        problem: &Problem,
        from: &Replay,
        watch: &mut Watch<'_>,
    ) -> Result<LegEnd, PlanError> {
        let mut end = LegEnd { controls: from.controls.clone(), ..LegEnd::default() };
        let mut at = from.clone();
        for _ in 0..self.rounds.max(1) {
            let round = self.round(problem, &at, watch, &mut end)?;
            let Some((replay, is_solved, goes_on)) = round else { break };
            let changed = replay.modes.others(&at.modes);
            if changed == 0 {
                end.message = match is_solved {
                    true => "modes confirmed".to_owned(),
                    false => format!("{}, modes confirmed", end.message),
                };
                break;
            }
            end.message = format!("{}, modes changed in {changed} steps", end.message);
            if !is_solved || !goes_on {
                break;
            }
            at = replay;
        }
        Ok(end)
    }

    /// The programs with the modes of `at`; where Ipopt does not solve the first, again about the forces of `at` itself, and
    /// that counts where it is solved and its replay is no worse.
    fn round(
        &self,
        problem: &Problem,
        at: &Replay,
        watch: &mut Watch<'_>,
        end: &mut LegEnd,
    ) -> Result<Option<Round>, PlanError> {
        let (before, began) = (end.clone(), end.iterations);
        let most = self.most_iterations;
        let kept = most / FOR_THE_SECOND;
        let first = self.solve_about((Forces::Selected, most - kept), problem, at, watch, end)?;
        let Some((known, false, true)) = &first else { return Ok(first) };
        let mut again = LegEnd { iterations: end.iterations, runs: end.runs, ..before };
        let taken = u32::try_from(end.iterations - began).unwrap_or(most);
        let left = most.saturating_sub(taken).max(kept);
        let second = self.solve_about((Forces::OfTheRun, left), problem, at, watch, &mut again)?;
        if second.as_ref().is_some_and(|(replay, solved, _)| *solved && !known.is_better(replay)) {
            *end = again;
            return Ok(second);
        }
        (end.iterations, end.runs) = (again.iterations, again.runs);
        Ok(first)
    }

    /// One program with the modes of `at`, and those about its forces, each of so many iterations at most: the replay of its end,
    /// whether it was solved, and whether to go on. None where it was stopped at once.
    fn solve_about(
        &self,
        (forces, most_iterations): (Forces, u32),
        problem: &Problem,
        at: &Replay,
        watch: &mut Watch<'_>,
        end: &mut LegEnd,
    ) -> Result<Option<Round>, PlanError> {
        let mut program = PlanNlp::with_modes(problem, at, self.compliance)?;
        program.set_factor(1.0 / usual_cost(problem, at)?);
        let mut solved = Solved { x: program.point_of(at), multipliers: None };
        if forces == Forces::OfTheRun {
            program.anchor(&solved.x);
        }
        let mut last = None;
        for pass in 0..=self.anchored {
            let options = Options {
                tolerance: 1e-9,
                max_iterations: most_iterations,
                barrier: BarrierStrategy::Monotone,
                initial_barrier: match (forces, pass) {
                    (Forces::OfTheRun, _) => AT_THE_RUN,
                    (Forces::Selected, 0) => 1e-6,
                    (Forces::Selected, _) => 1e-8,
                },
                bound_push: 1e-8,
                mumps_pivot_order: MINIMUM_FILL,
                mumps_scaling: UNSCALED,
                ..Options::default()
            };
            let known = end.controls.clone();
            let told = Told { leg: "polish", done: end.iterations, controls: &known };
            let (status, iterations, stopped) =
                solve(&mut program, &mut solved, options, told, watch)?;
            end.iterations += u64::from(iterations);
            if pass == 0 {
                end.message = status.name().to_owned();
            }
            if stopped && iterations == 0 {
                break;
            }
            let is_solved = status.is_success() || status == ReturnStatus::SolvedToAcceptableLevel;
            let replay = problem.replay(&program.controls(&solved.x))?;
            end.runs += 1;
            // A later pass counts where it ends nearer to its replay.
            let states = program.states(&solved.x);
            let apart = replay.apart(&states);
            let nearer = last.as_ref().is_none_or(|(_, known, _, _)| apart <= *known);
            if nearer {
                end.controls.clone_from(&replay.controls);
                end.cost = Some(program.cost(&solved.x));
                end.states = Some(states);
                end.modes = Some(at.modes.clone());
                let same = replay.modes.others(&at.modes) == 0;
                last = Some((replay, apart, is_solved, !stopped));
                let is_enough = forces == Forces::OfTheRun && apart <= EXACTLY;
                if is_solved && same && !stopped && !is_enough {
                    program.anchor(&solved.x);
                    continue;
                }
            }
            break;
        }
        Ok(last.map(|(replay, _, is_solved, goes_on)| (replay, is_solved, goes_on)))
    }
}
