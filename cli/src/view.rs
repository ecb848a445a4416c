//! `tumble view`, and `--html` of a simulation: runs as a web page.

use super::args::ViewArgs;
use super::directory::OutputDirectory;
use super::file_names::VIEW;
use super::film::film;
use super::outcome::{Failure, Outcome};
use super::output::{PendingFile, say, target};
use super::recording::Recording;
use super::signals::raise_on_signals;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use tumble_model::shown;
use tumble_view::view::page;
use tumble_view::{Fact, Film};

/// Largest number of rows of a run on the page. They are all in memory, about 1 kB each.
pub const MOST_ROWS: usize = 1_000_000;

/// Runs `tumble view`.
pub fn run(args: &ViewArgs) -> Result<Outcome, Failure> {
    let interrupt = Arc::new(AtomicBool::new(false));
    raise_on_signals(&interrupt)?;
    let (out, name) = target(args.out.as_deref(), &args.files[0], VIEW)?;
    let mut films = Vec::new();
    for path in &args.files {
        let Some(mut film) = film(Recording::open(path)?, MOST_ROWS, &interrupt)? else {
            return Ok(Outcome::Interrupted);
        };
        if args.files.len() > 1 {
            film.facts.insert(0, Fact::new("file", shown::path(path)));
        }
        films.push(film);
    }
    let directory = OutputDirectory::for_pictures(out)?;
    let films: Vec<_> = films.iter().collect();
    let Some(written) = write(PendingFile::create(&directory, name)?, &films, &interrupt)? else {
        return Ok(Outcome::Interrupted);
    };
    if !args.quiet {
        say(&written)?;
    }
    let unconverged = films.iter().any(|film| film.has_failed());
    Ok(if unconverged { Outcome::Unconverged } else { Outcome::Done })
}

/// Opens a temporary file for the page, so that obstacles are found before the work.
pub fn pending(directory: &OutputDirectory) -> Result<PendingFile, Failure> {
    PendingFile::create(directory, VIEW)
}

/// Writes the page of one or two films, and returns a sentence about it. Writes no file if
/// `interrupt` is raised.
pub fn write(
    pending: PendingFile,
    films: &[&Film],
    interrupt: &AtomicBool,
) -> Result<Option<String>, Failure> {
    let page = page(env!("CARGO_PKG_VERSION"), films)
        .map_err(|why| Failure::Other(format!("the page cannot be created: {why}")))?;
    if interrupt.load(Ordering::Relaxed) {
        return Ok(None);
    }
    pending.write(page.as_bytes())?;
    let path = pending.publish()?;
    Ok(Some(format!("wrote {} ({:.2} MB)\n", shown::path(&path), page.len() as f64 / 1e6)))
}
