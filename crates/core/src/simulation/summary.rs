//! Summary of a run: counts, residuals and first failures, from the
//! [records](crate::simulation::StepRecord) of its steps.

use super::median::Median;
use super::{EnergyGain, InfeasibleGap, Interval, StepRecord, UnphysicalCause};
use crate::step::{ContactForce, StepStatus};
use std::borrow::Cow;
use std::collections::BTreeMap;

/// Largest number of failed steps in the summary.
const MOST_FAILURES_KEPT: usize = 5;

/// A static or parsed string.
pub type Word = Cow<'static, str>;

/// A step that did not converge.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub struct FailedStep {
    /// Index k.
    pub index: u64,
    /// Message of the solver's last attempt, if any.
    pub message: Option<Word>,
    /// Residual (m/s).
    pub residual: f64,
    /// Law with the largest violation.
    pub part: Word,
    /// See [`StepRecord::infeasible_gap`].
    pub infeasible_gap: Option<InfeasibleGap>,
    /// See [`StepRecord::unphysical`].
    pub unphysical: Option<UnphysicalCause>,
    /// First entries of [`StepRecord::unsolved`].
    pub unsolved: Vec<usize>,
}

/// Largest number of bodies stored per failed step.
const MOST_BODIES_KEPT: usize = 4;

/// Running summary of a simulation.
#[derive(Debug, Clone, Default, PartialEq)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct RunSummary {
    /// Number of steps without a problem to solve.
    pub free: u64,
    /// Number of steps with a contact force.
    pub touching: u64,
    /// Number of steps with [`StepStatus::Converged`].
    pub converged: u64,
    /// Number of steps with [`StepStatus::Retried`].
    pub retried: u64,
    /// Number of steps with [`StepStatus::Fallback`].
    pub fallback: u64,
    /// Number of steps with [`StepStatus::Substepped`].
    pub substepped: u64,
    /// Number of steps with [`StepStatus::Wild`].
    pub wild: u64,
    /// First of these steps, and its cause.
    pub first_wild: Option<(u64, UnphysicalCause)>,
    /// Step in which an island makes the most energy beyond the balance (32), and the gain.
    pub largest_gain: Option<(u64, EnergyGain)>,
    /// Number of steps with a loaded contact that is not where the pieces touch (18g).
    pub misplaced: u64,
    /// Step with the largest error of these contacts, and the error (m).
    pub largest_placement: Option<(u64, f64)>,
    /// Number of steps with [`StepStatus::Failed`].
    pub failed: u64,
    /// Number of steps with a reduced [restitution](StepRecord::restitution_share).
    pub tempered: u64,
    /// Number of intervals of all steps.
    pub intervals: u64,
    /// Number of steps with intervals that are [less accurate](Interval::is_coarse) than asked.
    pub coarse: u64,
    /// Number of steps in which the order of impacts [is uncertain](Interval::is_ambiguous).
    pub ambiguous: u64,
    /// Solver iterations over all steps.
    pub iterations: u64,
    /// Number of contact steps solved from each initial point.
    pub starts: BTreeMap<Word, u64>,
    /// The first failures.
    pub first_failures: Vec<FailedStep>,
    /// Step with the largest residual: index, residual (m/s) and violated law.
    pub worst: Option<(u64, f64, Word)>,
    /// Median of the residuals of the contact steps (m/s).
    contact_residuals: Median,
}

/// Part of a step record that every file of a run contains.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StatusCount {
    /// Index k.
    pub index: u64,
    /// Status.
    pub status: StepStatus,
    /// Solver iterations.
    pub iterations: u32,
    /// Residual (m/s).
    pub residual: f64,
    /// Law with the largest violation.
    pub part: &'static str,
    /// See [`StepRecord::restitution_share`].
    pub restitution_share: f64,
}

impl RunSummary {
    /// Adds one step.
    pub fn add(&mut self, record: &StepRecord) {
        let (report, certificate) = (record.report(), record.certificate());
        let (index, residual) = (record.index, certificate.residual());
        let part = certificate.worst_part();
        let status = report.status;
        let iterations = report.iterations;
        let restitution_share = record.restitution_share();
        self.count(&StatusCount { index, status, iterations, residual, part, restitution_share });
        if status == StepStatus::Failed && self.first_failures.len() < MOST_FAILURES_KEPT {
            let message = report.message.map(Word::from);
            let part = Word::from(part);
            let infeasible_gap = record.infeasible_gap().cloned();
            let unsolved = record.unsolved.iter().copied().take(MOST_BODIES_KEPT).collect();
            let unphysical = record.unphysical();
            let failed =
                FailedStep { index, message, residual, part, infeasible_gap, unphysical, unsolved };
            self.first_failures.push(failed);
        }
        let has = |mark: fn(&Interval) -> bool| u64::from(record.intervals().iter().any(mark));
        self.intervals += record.intervals().len() as u64;
        self.coarse += has(|taken| taken.is_coarse);
        self.ambiguous += has(Interval::is_ambiguous);
        self.touching +=
            has(|taken| taken.solution.contacts.iter().any(ContactForce::carries_force));
        if status == StepStatus::Wild
            && let Some(cause) = record.unphysical()
        {
            self.first_wild.get_or_insert((index, cause));
        }
        if let Some(gain) = record.gain()
            && self.largest_gain.is_none_or(|(_, most)| gain.energy > most.energy)
        {
            self.largest_gain = Some((index, gain));
        }
        // A NaN is an error too.
        let placement = record.placement();
        if placement != 0.0 {
            self.misplaced += 1;
            if self.largest_placement.is_none_or(|(_, most)| placement > most) {
                self.largest_placement = Some((index, placement));
            }
        }
        if let Some(start) = report.start.filter(|_| status != StepStatus::End) {
            *self.starts.entry(Word::from(start)).or_default() += 1;
        }
    }

    /// Adds one step from a row of a file, which has neither its initial point nor its failure.
    pub fn count(&mut self, step: &StatusCount) {
        match step.status {
            StepStatus::End => return,
            StepStatus::Free => self.free += 1,
            StepStatus::Converged => self.converged += 1,
            StepStatus::Retried => self.retried += 1,
            StepStatus::Fallback => self.fallback += 1,
            StepStatus::Substepped => self.substepped += 1,
            StepStatus::Wild => self.wild += 1,
            StepStatus::Failed => self.failed += 1,
        }
        self.tempered += u64::from(step.restitution_share < 1.0);
        self.iterations += u64::from(step.iterations);
        if step.status != StepStatus::Free {
            self.contact_residuals.add(step.residual);
        }
        let is_worse = |worst| step.residual > worst || step.residual.is_nan();
        if self.worst.as_ref().is_none_or(|(_, worst, _)| is_worse(*worst)) {
            self.worst = Some((step.index, step.residual, Word::from(step.part)));
        }
    }

    /// Number of steps that are failed or wild.
    pub fn unsolved(&self) -> u64 {
        self.failed + self.wild
    }

    /// Number of steps with a problem to solve.
    pub fn contact_steps(&self) -> u64 {
        self.converged + self.retried + self.fallback + self.substepped + self.wild + self.failed
    }

    /// Number of steps.
    pub fn steps(&self) -> u64 {
        self.free + self.contact_steps()
    }

    /// Median residual of the contact steps (m/s); `None` without contact. It is exact up to 65 536
    /// different residuals. Beyond that it is accurate to a thousandth, in bounded memory.
    pub fn median_residual(&self) -> Option<f64> {
        self.contact_residuals.get()
    }

    /// Largest residual of all steps (m/s); `None` without steps.
    pub fn largest_residual(&self) -> Option<f64> {
        self.worst.as_ref().map(|(_, residual, _)| *residual)
    }
}
