//! End-to-end tests of the command line in temporary directories: files, exit codes, messages.

mod accuracy;
mod balance;
mod broken_scenes;
mod changed_files;
mod checkpoints;
mod commands;
#[path = "../../../tests/common/mod.rs"]
mod common;
mod continued;
mod documents;
mod driven;
mod exported;
mod failure;
mod flags;
mod foreign_files;
mod fuzz;
mod gears;
mod groups;
mod hard;
mod input;
mod interrupted;
mod ipopt;
mod joints;
mod leftovers;
mod live;
mod locks;
mod mechanisms;
mod meshes;
mod output;
mod pairs;
mod picture;
mod pictures;
mod plan;
mod plot;
mod residual;
mod restitution;
mod robots;
mod rotation;
mod row_selection;
mod run_file_checks;
mod scenario;
mod scenes;
mod simulate;
mod slips;
mod start_index;
mod streams;
mod sums;
mod support;
mod tampering;
mod threads;
mod tutorial;
mod verify;
mod verify_fixed;
mod view;

/// Root of the repository.
const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/..");
