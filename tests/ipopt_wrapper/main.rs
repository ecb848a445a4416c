//! Tests of the safe wrapper of Ipopt: known optima, misuse and failures. After any failure the
//! process continues, and the next solve returns the same result as before.

mod faults;
mod probe;
mod problems;
mod process;
mod refusals;
mod solving;
