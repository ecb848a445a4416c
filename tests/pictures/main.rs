//! Pictures: GIFs, the HTML view in a browser; and the examples.

mod bench_programs;
mod browser;
#[path = "../common/example.rs"]
mod example;
mod examples;
mod gif;
#[path = "../common/pile.rs"]
mod pile;
