//! `tumble view`, and `--html` of a simulation: trajectories as a page for the browser.

use super::args::{SimulateArgs, ViewArgs};
use super::film::film;
use super::job::Job;
use super::outcome::{Failure, Outcome};
use super::output::{PendingFile, create_directory, directory_of, say};
use super::source::TrajectoryFile;
use std::path::Path;
use tumble_pictures::view::page;
use tumble_pictures::{Fact, Film};

/// Rows that a run of the page may have: they are all in memory, 0.8 kB each.
pub const MOST_ROWS: usize = 1_000_000;

/// `tumble view`.
pub fn run(args: &ViewArgs) -> Result<Outcome, Failure> {
    let mut films = Vec::new();
    let mut notes = String::new();
    for path in &args.files {
        let file = TrajectoryFile::open(path, &args.physics)?;
        if !file.source.note().is_empty() {
            notes += &format!("note: {}: {}\n", path.display(), file.source.note());
        }
        let mut film = film(file, MOST_ROWS)?;
        if args.files.len() > 1 {
            film.facts.insert(0, Fact::new("file", path.display().to_string()));
        }
        films.push(film);
    }
    let directory = directory_of(args.out.as_deref(), &args.files[0]);
    create_directory(directory)?;
    let written = write(pending(directory)?, &films.iter().collect::<Vec<_>>())?;
    if !args.quiet {
        say(&(notes + &written))?;
    }
    let unconverged = films.iter().any(Film::has_failed);
    Ok(if unconverged { Outcome::Unconverged } else { Outcome::Done })
}

/// Refuses, before a simulation, what would be refused after it.
pub fn check(args: &SimulateArgs, job: &Job) -> Result<(), Failure> {
    if args.html && job.rows > MOST_ROWS as u64 {
        return Err(Failure::Input(format!("--html: a page is made of at most {MOST_ROWS} rows")));
    }
    Ok(())
}

/// Opens a temporary file for the page: what stands in the way shows before the work.
pub fn pending(directory: &Path) -> Result<PendingFile, Failure> {
    PendingFile::create(directory, "view.html")
}

/// Writes the page of one or two films; the sentence on it.
pub fn write(pending: PendingFile, films: &[&Film]) -> Result<String, Failure> {
    let page = page(env!("CARGO_PKG_VERSION"), films)
        .map_err(|why| Failure::Other(format!("the page cannot be made: {why}")))?;
    pending.write(page.as_bytes())?;
    let path = pending.publish()?;
    Ok(format!("wrote {} ({:.2} MB)\n", path.display(), page.len() as f64 / 1e6))
}
