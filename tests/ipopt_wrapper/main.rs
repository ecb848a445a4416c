//! The safe wrapper of Ipopt: known optima, and every way to misuse it or to fail
//! inside it. Whatever happens in one solve, the process lives on and the next solve
//! gives what it gave before.

mod faults;
mod probe;
mod problems;
mod process;
mod refusals;
mod solving;
