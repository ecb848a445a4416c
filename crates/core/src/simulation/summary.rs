//! What a run amounts to: counts, residuals, the first failures, from the
//! [records](crate::simulation::StepRecord) of its steps.

use super::median::Median;
use super::{Squeeze, StepRecord};
use crate::step::StepStatus;
use std::borrow::Cow;
use std::collections::BTreeMap;

/// How many failed steps are kept for the report.
const MOST_FAILURES_KEPT: usize = 5;

/// A word of the library, or one that was read.
pub type Word = Cow<'static, str>;

/// A step that did not converge.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub struct FailedStep {
    /// k.
    pub index: u64,
    /// What the solver's last try came to in its own words, where it has any.
    pub message: Option<Word>,
    /// The residual, m/s.
    pub residual: f64,
    /// Which law is violated most.
    pub part: Word,
    /// See [`StepRecord::squeeze`].
    pub squeeze: Option<Squeeze>,
    /// The first of [`StepRecord::unsolved`].
    pub unsolved: Vec<usize>,
}

/// More bodies of a failed step than this are not kept.
const MOST_BODIES_KEPT: usize = 4;

/// The running summary of a simulation.
#[derive(Debug, Clone, Default, PartialEq)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct RunSummary {
    /// Steps taken without a problem.
    pub free: u64,
    /// Steps with each status.
    pub converged: u64,
    /// See [`StepStatus::Retried`].
    pub retried: u64,
    /// See [`StepStatus::Fallback`].
    pub fallback: u64,
    /// See [`StepStatus::Substepped`].
    pub substepped: u64,
    /// See [`StepStatus::Wild`].
    pub wild: u64,
    /// See [`StepStatus::Failed`].
    pub failed: u64,
    /// Steps that took a part of their [restitution](StepRecord::restitution_share).
    pub tempered: u64,
    /// Iterations of the solver over all steps.
    pub iterations: u64,
    /// How many contact steps each start of the solver ended.
    pub starts: BTreeMap<Word, u64>,
    /// The first few failures.
    pub first_failures: Vec<FailedStep>,
    /// The step with the largest residual: k, m/s, the law.
    pub worst: Option<(u64, f64, Word)>,
    /// Of the residuals of the contact steps, m/s.
    contact_residuals: Median,
}

/// What the summary counts of a step that any file of a run has.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StatusCount {
    /// k.
    pub index: u64,
    /// How it ended.
    pub status: StepStatus,
    /// Iterations of the solver.
    pub iterations: u32,
    /// The residual, m/s.
    pub residual: f64,
    /// Which law is violated most.
    pub part: &'static str,
    /// See [`StepRecord::restitution_share`].
    pub restitution_share: f64,
}

impl RunSummary {
    /// Counts one step.
    pub fn add(&mut self, record: &StepRecord) {
        let (report, certificate) = (&record.report, &record.certificate);
        let (index, residual) = (record.index, certificate.residual());
        let part = certificate.worst_part();
        let (status, iterations) = (report.status, report.iterations);
        let restitution_share = record.restitution_share;
        self.count(&StatusCount { index, status, iterations, residual, part, restitution_share });
        if status == StepStatus::Failed && self.first_failures.len() < MOST_FAILURES_KEPT {
            let (message, part) = (report.message.map(Word::from), Word::from(part));
            let squeeze = record.squeeze;
            let unsolved = record.unsolved.iter().copied().take(MOST_BODIES_KEPT).collect();
            let failed = FailedStep { index, message, residual, part, squeeze, unsolved };
            self.first_failures.push(failed);
        }
        if let Some(start) = report.start.filter(|_| status != StepStatus::End) {
            *self.starts.entry(Word::from(start)).or_default() += 1;
        }
    }

    /// Counts one step of which no more is known than its row says: neither its start nor why it
    /// failed.
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

    /// Steps for which a problem was solved.
    #[must_use]
    pub fn contact_steps(&self) -> u64 {
        self.converged + self.retried + self.fallback + self.substepped + self.wild + self.failed
    }

    /// All steps.
    #[must_use]
    pub fn steps(&self) -> u64 {
        self.free + self.contact_steps()
    }

    /// The median residual of the contact steps, m/s; `None` without contact. It is exact up to 65 536
    /// different residuals; a longer run has it within a thousandth, so that memory does not grow with it.
    #[must_use]
    pub fn median_residual(&self) -> Option<f64> {
        self.contact_residuals.get()
    }

    /// The largest residual of all steps, m/s; `None` without steps.
    #[must_use]
    pub fn largest_residual(&self) -> Option<f64> {
        self.worst.as_ref().map(|(_, residual, _)| *residual)
    }
}
