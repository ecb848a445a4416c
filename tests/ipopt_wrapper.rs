//! The safe wrapper of Ipopt: known optima, and every way to misuse it or to fail
//! inside it. Whatever happens in one solve, the process lives on and the next solve
//! gives what it gave before.

#[path = "ipopt_wrapper/faults.rs"]
mod faults;
#[path = "ipopt_wrapper/probe.rs"]
mod probe;
#[path = "ipopt_wrapper/problems.rs"]
mod problems;
#[path = "ipopt_wrapper/process.rs"]
mod process;
#[path = "ipopt_wrapper/refusals.rs"]
mod refusals;
#[path = "ipopt_wrapper/solving.rs"]
mod solving;
