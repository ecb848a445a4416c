//! Tests of pictures (GIF and HTML in a browser) and of the example programs.

mod bench_programs;
mod browser;
mod example;
mod examples;
mod gif;
#[path = "../../../crates/view/tests/pile/mod.rs"]
mod pile;

/// Root of the repository.
const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/..");
