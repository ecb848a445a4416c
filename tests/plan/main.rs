//! Tests of plans: known solutions, refused problems, and plans that equal their replay.

#[path = "../common/campaign.rs"]
mod campaign;
mod plans;
