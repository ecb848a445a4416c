//! What a run amounts to: counts, certificates, the first failures, from the
//! [records](crate::simulation::StepRecord) of its steps.

use crate::ipopt::ReturnStatus;
use crate::simulation::StepRecord;
use crate::solver::StepStatus;
use crate::solver::ipopt::Rung;
use std::collections::BTreeMap;

/// How many failed steps are kept for the report.
const MOST_FAILURES_KEPT: usize = 5;

/// A step that did not converge.
#[derive(Debug, Clone, PartialEq)]
pub struct FailedStep {
    /// k.
    pub index: u64,
    /// What Ipopt said, where it ran.
    pub ipopt_status: Option<ReturnStatus>,
    /// The certificate, m/s.
    pub certificate: f64,
    /// Which law is violated most.
    pub part: &'static str,
}

/// The running summary of a simulation.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RunSummary {
    /// Steps taken without a problem.
    pub free: u64,
    /// Steps with each status.
    pub converged: u64,
    /// See [`StepStatus::Retried`].
    pub retried: u64,
    /// See [`StepStatus::Fallback`].
    pub fallback: u64,
    /// See [`StepStatus::Failed`].
    pub failed: u64,
    /// Iterations of the solver over all steps.
    pub iterations: u64,
    /// How many steps ended on each rung of the Ipopt path.
    pub rungs: BTreeMap<Rung, u64>,
    /// The first few failures.
    pub first_failures: Vec<FailedStep>,
    /// The step with the largest certificate: k, m/s, the law.
    pub worst: Option<(u64, f64, &'static str)>,
    /// Certificates of the contact steps, m/s, in order of the steps.
    contact_certificates: Vec<f64>,
}

impl RunSummary {
    /// Counts one step.
    pub fn add(&mut self, record: &StepRecord) {
        let certificate = record.certificate.worst();
        let part = record.certificate.worst_part();
        match record.report.status {
            StepStatus::End => return,
            StepStatus::Free => self.free += 1,
            StepStatus::Converged => self.converged += 1,
            StepStatus::Retried => self.retried += 1,
            StepStatus::Fallback => self.fallback += 1,
            StepStatus::Failed => {
                self.failed += 1;
                if self.first_failures.len() < MOST_FAILURES_KEPT {
                    self.first_failures.push(FailedStep {
                        index: record.index,
                        ipopt_status: record.report.ipopt_status,
                        certificate,
                        part,
                    });
                }
            }
        }
        self.iterations += u64::from(record.report.iterations);
        if let Some(rung) = record.report.rung {
            *self.rungs.entry(rung).or_default() += 1;
        }
        if record.report.status != StepStatus::Free {
            self.contact_certificates.push(certificate);
        }
        if self.worst.is_none_or(|(_, worst, _)| certificate > worst || certificate.is_nan()) {
            self.worst = Some((record.index, certificate, part));
        }
    }

    /// Steps for which a problem was solved.
    #[must_use]
    pub fn contact_steps(&self) -> u64 {
        self.converged + self.retried + self.fallback + self.failed
    }

    /// All steps.
    #[must_use]
    pub fn steps(&self) -> u64 {
        self.free + self.contact_steps()
    }

    /// The median certificate of the contact steps, m/s; `None` without contact.
    #[must_use]
    pub fn median_certificate(&self) -> Option<f64> {
        let mut sorted = self.contact_certificates.clone();
        sorted.sort_by(f64::total_cmp);
        let middle = sorted.len() / 2;
        match sorted.len() {
            0 => None,
            n if n % 2 == 1 => Some(sorted[middle]),
            _ => Some(0.5 * (sorted[middle - 1] + sorted[middle])),
        }
    }

    /// The largest certificate of all steps, m/s; `None` without steps.
    #[must_use]
    pub fn largest_certificate(&self) -> Option<f64> {
        self.worst.map(|(_, certificate, _)| certificate)
    }
}
