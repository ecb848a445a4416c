//! Tests of plans: known solutions, refused problems, and plans that equal their replay.

mod plans;
