//! Unit tests of `verify/mod.rs`.

use super::*;
use tumble_core::step::StepStatus;

#[test]
fn nan_residual_ranks_as_worst() {
    let mut findings = VerifyFindings::default();
    for (index, residual) in [1.0, -f64::NAN, 2.0, f64::NAN].into_iter().enumerate() {
        let step = Verified {
            index: index as u64,
            is_first: true,
            status: StepStatus::Converged,
            residual,
            part: "cone",
            differs: None,
            inexact: false,
            overlap: 0.0,
        };
        findings.keep(step, 3);
    }
    let worst: Vec<_> = findings.worst.iter().map(|step| step.index).collect();
    assert_eq!(worst, [1, 3, 2]);
}
