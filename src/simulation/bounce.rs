//! A step in which contacts bounce: how much of their restitution each island can take.
//!
//! With friction, Newton's law can make energy ([`restitution`](crate::contact::restitution),
//! eq. 31). Where an impact of an island of bodies that touch would, the island takes a part
//! σ of its coefficients e instead, the largest that does not,
//!
//! ```text
//! σ = sup { σ ∈ [0, 1] : W(σ e) ≤ 0 },
//! ```
//!
//! found by bisection to [`SHARE_FOUND_TO`] from below. The step is solved again for every trial,
//! and the last one's σ stands in the record. At σ = 0 the law is the plastic one, whose impacts
//! make no energy but for the turn within a step ([`wild`](super::wild)).

use crate::contact::{Candidates, Contact, Partner};
use crate::error::Error;
use crate::step::{Step, StepReport, StepSolution, StepSolver};

/// How near to the largest share the one taken is.
pub const SHARE_FOUND_TO: f64 = 1.0 / 65536.0;

/// What rounding leaves of a work that is zero, in parts of the work of all impulses one by one.
const ROUNDING: f64 = 1e-12;

/// Memory that steps use again. Lists go over the bodies.
#[derive(Debug, Clone, Default)]
pub(super) struct Bounce {
    /// The first body of each body's island.
    islands: Vec<usize>,
    /// (W, Σ |p·u|) of the island that begins with the body, J.
    works: Vec<(f64, f64)>,
    /// The share taken, and the range in which the largest one lies, once it is known to be
    /// below 1.
    shares: Vec<f64>,
    ranges: Vec<Option<(f64, f64)>>,
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
        if !bounces(candidates.contacts()) {
            return Ok((report, 1.0));
        }
        let bodies = step.states.len();
        self.shares.clear();
        self.shares.resize(bodies, 1.0);
        self.ranges.clear();
        self.ranges.resize(bodies, None);
        self.judge(step, candidates.contacts(), solution);
        if !(0..bodies).any(|body| self.gains(body)) {
            return Ok((report, 1.0));
        }
        let mut width = 1.0;
        while width > SHARE_FOUND_TO {
            width *= 0.5;
            self.halve();
            let again = self.solve_again(step, solver, candidates, solution)?;
            report.iterations += again.iterations;
            self.judge(step, candidates.contacts(), solution);
        }
        self.settle();
        let last = self.solve_again(step, solver, candidates, solution)?;
        report = StepReport { iterations: report.iterations + last.iterations, ..last };
        Ok((report, self.shares.iter().copied().fold(1.0, f64::min)))
    }

    fn solve_again(
        &self,
        step: &Step<'_>,
        solver: &mut dyn StepSolver,
        candidates: &mut Candidates,
        solution: &mut StepSolution,
    ) -> Result<StepReport, Error> {
        candidates.share_restitution(step.world, step.states, &self.shares);
        solver.solve(step, candidates, solution)
    }

    /// Whether the island of `body` makes energy.
    fn gains(&self, body: usize) -> bool {
        let (work, size) = self.works[self.islands[body]];
        work > ROUNDING * size
    }

    /// Adds up the work of every island.
    fn judge(&mut self, step: &Step<'_>, contacts: &[Contact], solution: &StepSolution) {
        self.find_islands(step.states.len(), contacts);
        self.works.clear();
        self.works.resize(step.states.len(), (0.0, 0.0));
        let h = step.world.time_step();
        for (contact, force) in contacts.iter().zip(solution.forces()) {
            let (work, size) = &mut self.works[self.islands[contact.key.body]];
            *work += contact.impact_work(&force, h, step.states, &solution.states);
            let before = contact.parting_velocity(step.states, step.states).norm();
            let after = contact.parting_velocity(step.states, &solution.states).norm();
            *size += h * force.norm() * (before + after);
        }
    }

    /// Bodies that are in contact have one label, the smallest of their indices.
    fn find_islands(&mut self, bodies: usize, contacts: &[Contact]) {
        self.islands.clear();
        self.islands.extend(0..bodies);
        for contact in contacts {
            let Partner::Body(other) = contact.key.partner else { continue };
            let (a, b) = (self.root(contact.key.body), self.root(other));
            self.islands[a.max(b)] = a.min(b);
        }
        for body in 0..bodies {
            self.islands[body] = self.root(body);
        }
    }

    fn root(&self, mut body: usize) -> usize {
        while self.islands[body] != body {
            body = self.islands[body];
        }
        body
    }

    /// Narrows the ranges by what the shares came to, and takes their middles.
    fn halve(&mut self) {
        for body in 0..self.shares.len() {
            let gains = self.gains(body);
            let (low, high) = match (self.ranges[body], gains) {
                (None, false) => continue,
                (None, true) => (0.0, 1.0),
                (Some((low, _)), true) => (low, self.shares[body]),
                (Some((_, high)), false) => (self.shares[body], high),
            };
            self.ranges[body] = Some((low, high));
            self.shares[body] = 0.5 * (low + high);
        }
    }

    /// Takes the largest shares that are known to make no energy.
    fn settle(&mut self) {
        for body in 0..self.shares.len() {
            if let Some((low, _)) = self.ranges[body] {
                self.shares[body] = if self.gains(body) { low } else { self.shares[body] };
            }
        }
    }
}

/// Whether a step has contacts that bounce.
pub(super) fn bounces(contacts: &[Contact]) -> bool {
    contacts.iter().any(|contact| contact.rise > 0.0)
}

/// W of all contacts (eq. 31), J.
pub(super) fn impact_work(step: &Step<'_>, contacts: &[Contact], solution: &StepSolution) -> f64 {
    let h = step.world.time_step();
    let pairs = contacts.iter().zip(solution.forces());
    pairs.map(|(contact, f)| contact.impact_work(&f, h, step.states, &solution.states)).sum()
}
