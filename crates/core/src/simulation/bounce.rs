//! A step in which contacts bounce: how much of their restitution each island can take.
//!
//! With friction, Newton's law can make energy ([`restitution`](crate::contact::restitution),
//! eq. 31), and it can ask of a body that is wedged in what no forces do. Where the impacts of an
//! island of bodies that touch would make energy, or its problem was not solved, the island takes a
//! part σ of its coefficients e instead, the largest that is solved and makes none,
//!
//! ```text
//! σ = sup { σ ∈ [0, 1] : W(σ e) ≤ 0 },
//! ```
//!
//! found to [`SHARE_FOUND_TO`] from below, by straight lines through W and by halves. What is not solved at σ = 0 either, stays
//! failed. Islands in which nothing bounces have no
//! share. Where an impulse closes another contact, that one bounces too, by the speed that it had
//! ([`Contact::struck`]), and the island is solved again: without this a brick that lands on two corners within a
//! step would leave its energy in the second. For every trial the islands that it is of are solved again, the others keep their solution; the
//! smallest σ taken stands in the record. At σ = 0 the law is the plastic one, whose impacts
//! make no energy but for the turn within a step ([`wild`](super::wild)).

use super::islands::Islands;
use super::one_step::check_sizes;
use crate::contact::{Candidates, Contact};
use crate::error::Error;
use crate::step::{Step, StepReport, StepSolution, StepSolver, StepStatus};

/// How near to the largest share the one taken is.
pub const SHARE_FOUND_TO: f64 = 1.0 / 65536.0;

/// The same where larger ones are not solved, which takes the solver long to find out.
pub const SHARE_SOLVED_TO: f64 = 1.0 / 64.0;

/// What rounding leaves of a work that is zero, in parts of the work of all impulses one by one.
const ROUNDING: f64 = 1e-12;

/// Memory that steps use again. Lists go over the bodies.
#[derive(Debug, Clone, Default)]
pub(super) struct Bounce {
    islands: Islands,
    /// Of the island that begins with the body.
    impacts: Vec<IslandImpact>,
    /// Of the island of the body; `None` where nothing bounces.
    searches: Vec<Option<ShareSearch>>,
    shares: Vec<f64>,
    /// Whether the island of the body is to be solved again.
    marked: Vec<bool>,
    /// Places of contacts that the impulses of others close.
    struck: Vec<usize>,
}

/// What the contacts of an island did in a step, and its search.
#[derive(Debug, Clone, Copy, Default)]
struct IslandImpact {
    bounces: bool,
    /// W, J.
    work: f64,
    /// Σ |p·u|, J.
    size: f64,
    search: Option<ShareSearch>,
    /// Whether islands with searches of their own have met in it.
    met: bool,
    /// Whether it is to be solved again.
    again: bool,
}

impl IslandImpact {
    fn verdict(&self, solved: bool) -> Verdict {
        match self.work > ROUNDING * self.size {
            _ if !solved => Verdict::Unsolved,
            true => Verdict::MakesEnergy(self.work),
            false => Verdict::Good(self.work),
        }
    }

    /// Takes the search one trial further, after one that was `solved` or not.
    fn go_on(&mut self, solved: bool) {
        if self.met {
            // Shares that were found for each alone say nothing of both.
            (self.search, self.again) = (Some(ShareSearch::WHOLE), true);
        } else if self.bounces || self.search.is_some() {
            let last = self.search.unwrap_or(ShareSearch::WHOLE);
            let next = last.after(self.verdict(solved));
            (self.search, self.again) = (Some(next), next.share != last.share);
        }
    }
}

/// What a solve says of the share that it was made with.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Verdict {
    /// It makes no energy; W, J.
    Good(f64),
    MakesEnergy(f64),
    Unsolved,
}

/// The search for the share of an island.
#[derive(Debug, Clone, Copy, PartialEq)]
struct ShareSearch {
    /// The share of the last solve.
    share: f64,
    /// The largest share known to be good, or 0; the smallest one known to be bad.
    low: f64,
    high: f64,
    /// How near they shall come; both are multiples of it.
    to: f64,
    /// W there, J, if it is known.
    work_low: Option<f64>,
    work_high: Option<f64>,
    /// Whether the next share is the middle of the range, because the last one left most of it.
    halve: bool,
}

impl ShareSearch {
    /// Before the first verdict: all of the restitution.
    const WHOLE: Self = Self {
        share: 1.0,
        low: 0.0,
        high: f64::INFINITY,
        to: SHARE_FOUND_TO,
        work_low: None,
        work_high: None,
        halve: true,
    };

    /// The search after the verdict on its share, with the share to solve with next; the same one
    /// where it is what was sought.
    fn after(self, verdict: Verdict) -> Self {
        let Self { share, high, .. } = self;
        let known = |work: f64| Some(work).filter(|work| work.is_finite());
        let next = match verdict {
            Verdict::Good(work) => Self { low: share, work_low: known(work), ..self },
            Verdict::MakesEnergy(work) => {
                let high = share.min(high);
                Self { high, work_high: known(work), to: SHARE_FOUND_TO, ..self }
            }
            // What is not solved without restitution either is not for the want of a share.
            Verdict::Unsolved if share == 1.0 => {
                return Self { share: 0.0, high: 1.0, to: SHARE_SOLVED_TO, ..self };
            }
            Verdict::Unsolved => {
                let high = share.min(high);
                Self { high, work_high: None, to: SHARE_SOLVED_TO, ..self }
            }
        };
        let (before, width) = (self.high - self.low, next.high - next.low);
        // Between the ends a straight line, and the middle after it has left more than half.
        let halve = !self.halve && width > 0.5 * before;
        Self { share: next.next_share(halve), halve, ..next }
    }

    /// The largest good share where that is known, otherwise one in the range: where W is
    /// nothing on the line through its ends, or the middle.
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
        // In the range, and a multiple; W ≤ 0 < W at the ends, but for rounding.
        let guess = ((low + part * (high - low)) / to).floor() * to;
        guess.max(low + to).min(high - to)
    }
}

impl Bounce {
    /// Solves `step`; returns the report and the smallest share of restitution that an island
    /// took.
    pub(super) fn solve(
        &mut self,
        step: &Step<'_>,
        solver: &mut dyn StepSolver,
        candidates: &mut Candidates,
        solution: &mut StepSolution,
    ) -> Result<(StepReport, f64), Error> {
        let mut report = solver.solve(step, candidates, solution)?;
        check_sizes(solution, step, candidates.contacts().len())?;
        if !bounces(candidates.contacts()) {
            return Ok((report, 1.0));
        }
        let bodies = step.states.len();
        self.searches.clear();
        self.searches.resize(bodies, None);
        loop {
            self.judge(step, candidates.contacts(), solution);
            let solved = report.status != StepStatus::Failed;
            let islands = solver.islands();
            let is_solved =
                |body| islands.as_ref().map_or(solved, |islands| islands.is_solved(body));
            if self.find_struck(step, candidates.contacts(), solution, is_solved) {
                candidates.strike(step.world, step.states, &self.struck);
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

    /// Finds the islands, what their impacts did, and how far their searches are.
    fn judge(&mut self, step: &Step<'_>, contacts: &[Contact], solution: &StepSolution) {
        let bodies = step.states.len();
        let keys = contacts.iter().map(|contact| &contact.key);
        self.islands.find(bodies, keys, step.world);
        self.impacts.clear();
        self.impacts.resize(bodies, IslandImpact::default());
        let h = step.world.time_step();
        for (contact, force) in contacts.iter().zip(solution.forces()) {
            let impact = &mut self.impacts[self.islands.of(contact.key.body)];
            impact.bounces |= contact.bounces();
            impact.work += contact.impact_work(step.world, &force, step.states, &solution.states);
            let before = contact.arriving_velocity(step.world, step.states).norm();
            let after =
                contact.departing_velocity(step.world, step.states, &solution.states).norm();
            impact.size += h * force.norm() * (before + after);
        }
        for (body, search) in self.searches.iter().enumerate() {
            let impact = &mut self.impacts[self.islands.of(body)];
            impact.met |= impact.search.is_some() && search.is_some() && impact.search != *search;
            impact.search = impact.search.or(*search);
        }
    }

    /// Finds the contacts that the impulses of others close, in islands whose problem was solved, and
    /// marks them. Returns whether there are any.
    fn find_struck(
        &mut self,
        step: &Step<'_>,
        contacts: &[Contact],
        solution: &StepSolution,
        is_solved: impl Fn(usize) -> bool,
    ) -> bool {
        self.struck.clear();
        self.marked.clear();
        self.marked.resize(step.states.len(), false);
        for (place, (contact, found)) in contacts.iter().zip(&solution.contacts).enumerate() {
            let bounces = self.impacts[self.islands.of(contact.key.body)].bounces;
            let presses = found.carries_force() && is_solved(contact.key.body);
            if bounces && presses && contact.may_be_struck() {
                self.struck.push(place);
                self.marked[self.islands.of(contact.key.body)] = true;
            }
        }
        for body in 0..step.states.len() {
            self.marked[body] = self.marked[self.islands.of(body)];
        }
        !self.struck.is_empty()
    }

    /// Takes every search one trial further; `is_solved` tells whether the problem that a body is
    /// part of was solved. Returns whether an island is to be solved again.
    fn go_on(&mut self, is_solved: impl Fn(usize) -> bool) -> bool {
        for (body, impact) in self.impacts.iter_mut().enumerate() {
            // Only that of an island's first body has anything to go on with.
            impact.go_on(is_solved(body));
        }
        self.shares.clear();
        self.marked.clear();
        for (body, search) in self.searches.iter_mut().enumerate() {
            let impact = &self.impacts[self.islands.of(body)];
            *search = impact.search;
            self.shares.push(search.map_or(1.0, |search| search.share));
            self.marked.push(impact.again);
        }
        self.marked.contains(&true)
    }
}

/// Whether a step has contacts that bounce.
fn bounces(contacts: &[Contact]) -> bool {
    contacts.iter().any(|contact| contact.bounces())
}
