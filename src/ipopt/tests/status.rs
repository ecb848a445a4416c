//! Unit tests of `status.rs`.

use super::*;
use ipopt_sys::ApplicationReturnStatus as c;

#[test]
fn every_number_keeps_its_identity() {
    for code in -250..50 {
        assert_eq!(ReturnStatus::from_code(code).code(), code);
    }
    let names: std::collections::BTreeSet<_> = KNOWN.iter().map(|(.., name)| name).collect();
    assert_eq!(names.len(), KNOWN.len());
}

#[test]
fn the_table_agrees_with_the_installed_header() {
    for (code, status) in [
        (c::Solve_Succeeded, ReturnStatus::SolveSucceeded),
        (c::Maximum_Iterations_Exceeded, ReturnStatus::MaximumIterationsExceeded),
        (c::Maximum_CpuTime_Exceeded, ReturnStatus::MaximumCpuTimeExceeded),
        (c::Invalid_Number_Detected, ReturnStatus::InvalidNumberDetected),
        (c::NonIpopt_Exception_Thrown, ReturnStatus::NonIpoptExceptionThrown),
        (c::Internal_Error, ReturnStatus::InternalError),
    ] {
        assert_eq!(ReturnStatus::from_code(code), status);
    }
}
