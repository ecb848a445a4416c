//! Tests of plans: known solutions, refused problems, and plans that equal their replay.

#[path = "../../crates/core/tests/common/campaign.rs"]
mod campaign;
mod plans;
