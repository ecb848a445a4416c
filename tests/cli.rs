//! The command line end to end, in temporary directories: files, exit codes, messages.

mod common;

#[path = "cli/continued.rs"]
mod continued;
#[path = "cli/driven.rs"]
mod driven;
#[path = "cli/failure.rs"]
mod failure;
#[path = "cli/flags.rs"]
mod flags;
#[path = "cli/gradient.rs"]
mod gradient;
#[path = "cli/held.rs"]
mod held;
#[path = "cli/input.rs"]
mod input;
#[path = "cli/inspect.rs"]
mod inspect;
#[path = "cli/inspect_several.rs"]
mod inspect_several;
#[path = "cli/joints.rs"]
mod joints;
#[path = "cli/kept.rs"]
mod kept;
#[path = "cli/leftovers.rs"]
mod leftovers;
#[path = "cli/output.rs"]
mod output;
#[path = "cli/picture.rs"]
mod picture;
#[path = "cli/plan.rs"]
mod plan;
#[path = "cli/plot.rs"]
mod plot;
#[path = "derivatives/points.rs"]
mod points;
#[path = "cli/residual.rs"]
mod residual;
#[path = "cli/restitution.rs"]
mod restitution;
#[path = "cli/robots.rs"]
mod robots;
#[path = "cli/rotation.rs"]
mod rotation;
#[path = "cli/scenario.rs"]
mod scenario;
#[path = "cli/several.rs"]
mod several;
#[path = "cli/several_input.rs"]
mod several_input;
#[path = "cli/several_ipopt.rs"]
mod several_ipopt;
#[path = "cli/several_pictures.rs"]
mod several_pictures;
#[path = "cli/several_tampering.rs"]
mod several_tampering;
#[path = "cli/simulate.rs"]
mod simulate;
#[path = "derivatives/sizes.rs"]
mod sizes;
#[path = "cli/solve.rs"]
mod solve;
#[path = "cli/start_index.rs"]
mod start_index;
#[path = "cli/streams.rs"]
mod streams;
#[path = "cli/support.rs"]
mod support;
#[path = "cli/sweep.rs"]
mod sweep;
#[path = "cli/tampering.rs"]
mod tampering;
#[path = "derivatives/terms.rs"]
mod terms;
#[path = "cli/threads.rs"]
mod threads;
#[path = "cli/tutorial.rs"]
mod tutorial;
#[path = "cli/verify.rs"]
mod verify;
#[path = "cli/view.rs"]
mod view;
