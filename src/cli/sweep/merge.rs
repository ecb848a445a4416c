//! `tumble merge`: the parts of a sweep as one table.

use super::plan::{Plan, part_file, read_part};
use super::toss::HEADER;
use crate::cli::args::MergeArgs;
use crate::cli::directory::OutputDirectory;
use crate::cli::outcome::{Failure, Outcome};
use crate::cli::output::{PendingFile, Voice};
use crate::cli::shown;
use std::io::{self, Write};

/// The table.
const FILE: &str = "sweep.csv";

/// `tumble merge`.
pub fn run(args: &MergeArgs) -> Result<Outcome, Failure> {
    let directory = &args.directory;
    let Some(plan) = Plan::read(directory)? else {
        return Err(Failure::Input(format!(
            "{}: there is no sweep; the directory that `tumble sweep` wrote to is needed",
            shown::path(directory)
        )));
    };
    plan.refuse_strays(directory)?;
    let parts = plan.parts();
    let missing: Vec<_> =
        (0..parts).filter(|part| !directory.join(part_file(*part)).is_file()).collect();
    if let Some(first) = missing.first() {
        return Err(Failure::Input(format!(
            "{}: {} of {parts} parts are missing, the first is {}; run the shards that have them \
             again",
            shown::path(directory),
            missing.len(),
            part_file(*first)
        )));
    }
    let out = OutputDirectory::for_pictures(directory)?;
    let pending = PendingFile::create(&out, FILE)?;
    let mut stream = pending.stream()?;
    let failed = |error: io::Error| pending.failed(&error);
    stream.write_all(HEADER.as_bytes()).map_err(failed)?;
    for part in 0..parts {
        let path = directory.join(part_file(part));
        let text = read_part(&path)?;
        let rows = plan.rows_of(part, &text, &path)?;
        stream.write_all(rows.as_bytes()).map_err(failed)?;
    }
    stream.flush().and_then(|()| stream.get_ref().sync_all()).map_err(failed)?;
    drop(stream);
    let path = pending.publish()?;
    let mut voice = Voice::new(args.quiet);
    voice.say(&format!("wrote {}: {} tosses\n", shown::path(&path), plan.tosses));
    voice.end(Outcome::Done)
}
