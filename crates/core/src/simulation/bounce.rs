//! Steps with bouncing contacts: selection of the restitution that each island can apply.
//!
//! Newton's law with friction can create energy ([`restitution`](crate::contact::restitution), eq.
//! 31). For a wedged body it can also be infeasible. If the impacts of an island create energy or
//! its problem is not solved, the island scales its coefficients e by a share σ. The share is the
//! largest one that is solved and creates no energy,
//!
//! ```text
//! σ = sup { σ ∈ [0, 1] : W(σ e) ≤ 0 },
//! ```
//!
//! W being the work of the impacts. The search approaches σ from below to within
//! [`SHARE_FOUND_TO`], by regula falsi on W and by bisection. An island that is not solved at σ = 0
//! either stays failed. Islands without bouncing contacts have no share.
//!
//! If an impulse closes another contact, that contact bounces too, with its own approach speed
//! ([`Contact::struck`]), and the island is solved again. Without this, a brick that lands on two
//! corners within a step would lose its energy at the second one. Each trial solves only the
//! affected islands; others keep their solution. In the same way a contact with static friction whose slip
//! turns around in the step has stopped in between, and takes its static coefficient. The record holds the smallest σ. At σ = 0 the
//! impact is plastic and creates no energy, except for the rotation within a step
//! ([`wild`](super::unphysical)).

use super::islands::Islands;
use crate::contact::{Candidates, Contact, rounding};
use crate::error::Error;
use crate::step::{Step, StepReport, StepSolution, StepSolver, StepStatus};

/// Accuracy of the share.
pub const SHARE_FOUND_TO: f64 = 1.0 / 65536.0;

/// Accuracy of the share if larger ones are not solved. It is coarser because failed solves are
/// slow.
pub const SHARE_SOLVED_TO: f64 = 1.0 / 64.0;

/// Slip against the initial one that counts as turned around, times the world's speed scale (m/s).
const TURNED: f64 = 1e-9;

/// Rounding of a zero work, relative to the sum of the work of all impulses.
const ROUNDING: f64 = 1e-12;

/// Scratch memory of the search. Lists have one entry per body.
#[derive(Debug, Clone, Default)]
pub(super) struct Bounce {
    islands: Islands,
    /// Impact of the island whose first body is this one.
    impacts: Vec<IslandImpact>,
    /// Search of the island of this body; `None` without bouncing contacts.
    searches: Vec<Option<ShareSearch>>,
    shares: Vec<f64>,
    /// True if the island of this body is solved again.
    marked: Vec<bool>,
    /// Indices of contacts that were closed by impulses of other contacts, or whose slips turned around.
    changed: Vec<usize>,
}

/// Impacts of an island in a step, and the search for its share.
#[derive(Debug, Clone, Copy, Default)]
struct IslandImpact {
    bounces: bool,
    /// Work W of the impulses (J).
    work: f64,
    /// Sum of their absolute works, Σ |p·u| (J).
    size: f64,
    /// Work Σ |p| δu on the rounding δu of velocities (22), in a part of a step (J).
    rounding: f64,
    search: Option<ShareSearch>,
    /// True if islands with different searches have merged.
    met: bool,
    /// True if the island is solved again.
    again: bool,
}

impl IslandImpact {
    fn verdict(&self, solved: bool) -> Verdict {
        if !solved {
            Verdict::Unsolved
        } else if self.work > ROUNDING * self.size + self.rounding {
            Verdict::MakesEnergy(self.work)
        } else {
            Verdict::Good(self.work)
        }
    }

    /// Advances the search after a solve; `solved` is true if it converged.
    fn go_on(&mut self, solved: bool) {
        if self.met {
            // Shares found for separate islands are not valid for the merged one.
            (self.search, self.again) = (Some(ShareSearch::WHOLE), true);
        } else if self.bounces || self.search.is_some() {
            let last = self.search.unwrap_or(ShareSearch::WHOLE);
            let next = last.after(self.verdict(solved));
            (self.search, self.again) = (Some(next), next.share != last.share);
        }
    }
}

/// Result of a solve with a share.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Verdict {
    /// No energy is created; holds the work W (J).
    Good(f64),
    MakesEnergy(f64),
    Unsolved,
}

/// Search for the share of an island.
#[derive(Debug, Clone, Copy, PartialEq)]
struct ShareSearch {
    /// Share of the last solve.
    share: f64,
    /// Largest share known to be valid, or 0; `high` is the smallest one known to be invalid.
    low: f64,
    high: f64,
    /// Accuracy of the search; both bounds are multiples of it.
    to: f64,
    /// Work W at `low` and at `high` (J), if known.
    work_low: Option<f64>,
    work_high: Option<f64>,
    /// True if the next share bisects the range because the last one reduced it too little.
    halve: bool,
}

impl ShareSearch {
    /// Initial search with the full restitution.
    const WHOLE: Self = Self {
        share: 1.0,
        low: 0.0,
        high: f64::INFINITY,
        to: SHARE_FOUND_TO,
        work_low: None,
        work_high: None,
        halve: true,
    };

    /// Returns the search after `verdict`, with the next share to solve. The share is unchanged if
    /// the search is finished.
    fn after(self, verdict: Verdict) -> Self {
        let Self { share, high, .. } = self;
        let known = |work: f64| Some(work).filter(|work| work.is_finite());
        let next = match verdict {
            Verdict::Good(work) => Self { low: share, work_low: known(work), ..self },
            Verdict::MakesEnergy(work) => {
                let high = share.min(high);
                Self { high, work_high: known(work), to: SHARE_FOUND_TO, ..self }
            }
            // Tries σ = 0 first: an island that fails without restitution does not fail because of
            // its share.
            Verdict::Unsolved if share == 1.0 => {
                return Self { share: 0.0, high: 1.0, to: SHARE_SOLVED_TO, ..self };
            }
            Verdict::Unsolved => {
                let high = share.min(high);
                Self { high, work_high: None, to: SHARE_SOLVED_TO, ..self }
            }
        };
        let (before, width) = (self.high - self.low, next.high - next.low);
        // Interpolates linearly, and bisects after a step that left more than half of the range.
        let halve = !self.halve && width > 0.5 * before;
        Self { share: next.next_share(halve), halve, ..next }
    }

    /// Final share if the search is finished. Otherwise the next trial in the range: the root of
    /// the linear interpolation of W, or the middle.
    fn next_share(&self, halve: bool) -> f64 {
        let Self { share, low, high, to, .. } = *self;
        if high == f64::INFINITY {
            return share;
        }
        if high - low <= to {
            return low;
        }
        let part = match (self.work_low, self.work_high) {
            (Some(at_low), Some(at_high)) if !halve => at_low / (at_low - at_high),
            _ => 0.5,
        };
        // Rounds to a multiple inside the range. W ≤ 0 < W holds at the ends up to rounding.
        let guess = ((low + part * (high - low)) / to).floor() * to;
        guess.max(low + to).min(high - to)
    }
}

impl Bounce {
    /// Solves `step` and returns the report and the smallest share of restitution of all islands.
    ///
    /// Every contact step is solved here. Without bouncing contacts it is one call of the solver.
    pub(super) fn solve(
        &mut self,
        step: &Step<'_>,
        solver: &mut dyn StepSolver,
        candidates: &mut Candidates,
        solution: &mut StepSolution,
    ) -> Result<(StepReport, f64), Error> {
        let mut report = solver.solve(step, candidates, solution)?;
        check_sizes(solution, step, candidates.contacts().len())?;
        if !bounces(candidates.contacts()) && !step.world.has_static_friction() {
            return Ok((report, 1.0));
        }
        let bodies = step.states.len();
        self.searches.clear();
        self.searches.resize(bodies, None);
        loop {
            self.energy_check(step, candidates.contacts(), solution);
            let solved = report.status != StepStatus::Failed;
            let islands = solver.islands();
            let is_solved =
                |body| islands.as_ref().map_or(solved, |islands| islands.is_solved(body));
            if self.find(step, candidates.contacts(), solution, is_solved, true) {
                candidates.catch(step.world, step.states, &solution.states, &self.changed);
            } else if self.find(step, candidates.contacts(), solution, is_solved, false) {
                candidates.strike(step.world, step.states, &self.changed);
            } else if self.go_on(is_solved) {
                candidates.share_restitution(step.world, step.states, &self.shares);
            } else {
                break;
            }
            let again = match islands {
                Some(islands) => islands.solve_again(step, &self.marked, candidates, solution)?,
                None => solver.solve(step, candidates, solution)?,
            };
            check_sizes(solution, step, candidates.contacts().len())?;
            let iterations = report.iterations.saturating_add(again.iterations);
            report = StepReport { iterations, ..again };
        }
        Ok((report, self.shares.iter().copied().fold(1.0, f64::min)))
    }

    /// Computes the islands and their impacts, and assigns the searches to them.
    fn energy_check(&mut self, step: &Step<'_>, contacts: &[Contact], solution: &StepSolution) {
        let bodies = step.states.len();
        let keys = contacts.iter().map(|contact| &contact.key);
        self.islands.find(bodies, keys, step.world);
        self.impacts.clear();
        self.impacts.resize(bodies, IslandImpact::default());
        let h = step.world.time_step();
        // Short parts of a step know velocities to the rounding of their gaps over h (22) only.
        let lost = match step.world.span() {
            Some(_) => rounding::residual(step.world, step.states, &solution.states),
            None => 0.0,
        };
        for (place, (contact, force)) in contacts.iter().zip(solution.forces()).enumerate() {
            let impact = &mut self.impacts[self.islands.label(contact.key.body)];
            impact.bounces |= contact.bounces();
            let Step { world, states, .. } = step;
            let next = &solution.states;
            let turning = contact.moment_work(world, &solution.moment(place), states, next);
            impact.work += contact.impact_work(world, &force, states, next) + turning;
            impact.size += turning.abs();
            let before = contact.arriving_velocity(step.world, step.states).norm();
            let after =
                contact.departing_velocity(step.world, step.states, &solution.states).norm();
            impact.size += h * force.norm() * (before + after);
            impact.rounding += h * force.norm() * lost;
        }
        for (body, search) in self.searches.iter().enumerate() {
            let impact = &mut self.impacts[self.islands.label(body)];
            impact.met |= impact.search.is_some() && search.is_some() && impact.search != *search;
            impact.search = impact.search.or(*search);
        }
    }

    /// Finds and stores the contacts that impulses of other contacts close, or those whose `slips` turn
    /// around or begin, in solved islands only. Returns true if there are any.
    fn find(
        &mut self,
        step: &Step<'_>,
        contacts: &[Contact],
        solution: &StepSolution,
        is_solved: impl Fn(usize) -> bool,
        slips: bool,
    ) -> bool {
        self.changed.clear();
        self.marked.clear();
        self.marked.resize(step.states.len(), false);
        for (place, (contact, found)) in contacts.iter().zip(&solution.contacts).enumerate() {
            let bounces = self.impacts[self.islands.label(contact.key.body)].bounces;
            let presses = found.carries_force() && is_solved(contact.key.body);
            let next = &solution.states;
            let turns = || {
                contact.reverses(step.world, step.states, next, -TURNED)
                    || contact.breaks_away(step.world, step.states, &found.force, &found.slip)
            };
            if presses && if slips { turns() } else { bounces && contact.may_be_struck() } {
                self.changed.push(place);
                self.marked[self.islands.label(contact.key.body)] = true;
            }
        }
        for body in 0..step.states.len() {
            self.marked[body] = self.marked[self.islands.label(body)];
        }
        !self.changed.is_empty()
    }

    /// Advances every search by one trial. `is_solved` is true for bodies whose island converged.
    /// Returns true if an island must be solved again.
    fn go_on(&mut self, is_solved: impl Fn(usize) -> bool) -> bool {
        for (body, impact) in self.impacts.iter_mut().enumerate() {
            // Only entries of the first body of an island have a search.
            impact.go_on(is_solved(body));
        }
        self.shares.clear();
        self.marked.clear();
        for (body, search) in self.searches.iter_mut().enumerate() {
            let impact = &self.impacts[self.islands.label(body)];
            *search = impact.search;
            self.shares.push(search.map_or(1.0, |search| search.share));
            self.marked.push(impact.again);
        }
        self.marked.contains(&true)
    }
}

/// True if any contact bounces.
fn bounces(contacts: &[Contact]) -> bool {
    contacts.iter().any(|contact| contact.bounces())
}

/// Checks the sizes of a solution before it is indexed.
#[inline]
fn check_sizes(solution: &StepSolution, step: &Step<'_>, contacts: usize) -> Result<(), Error> {
    let StepSolution { states, contacts: forces, joints, gears, .. } = solution;
    let found = [states.len(), forces.len(), joints.len(), gears.len()];
    let (world, bodies) = (step.world, step.states.len());
    let wanted = [bodies, contacts, world.joints().len(), world.gears().len()];
    if found == wanted { Ok(()) } else { Err(size_error(found, wanted)) }
}

#[cold]
#[inline(never)]
fn size_error(found: [usize; 4], wanted: [usize; 4]) -> Error {
    let [states, contacts, joints, gears] = found;
    let [bodies, candidates, tied, geared] = wanted;
    let why = format!(
        "its solution has {states} states, {contacts} contact forces and the forces of {joints} \
         joints and {gears} gears; expected {bodies}, {candidates}, {tied} and {geared}"
    );
    Error::Solver { solver: "the step's solver", why }
}
