//! Plans: known solutions, refusals, and that a plan is its replay.

mod plans;
