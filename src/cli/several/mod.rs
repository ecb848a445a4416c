//! Several bodies on the command line: scenario files with `[[bodies]]`, their runs and tables.

mod describe;
mod film;
mod job;
mod run_file;
mod simulate;
mod tables;
mod verify;

pub use film::film;
pub use simulate::run as simulate;
pub use tables::RunTables;
pub use tumble::scenario::several::{is_scenario, model};
pub use verify::run as verify;
