//! `tumble view`, and `--html` of a simulation: runs as a web page.

use super::args::ViewArgs;
use super::directory::OutputDirectory;
use super::file_names::{STILL, VIEW};
use super::film::film;
use super::outcome::{Failure, Outcome};
use super::output::{PendingFile, say, target};
use super::recording::Recording;
use super::signals::raise_on_signals;
use std::env;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use tumble_model::shown;
use tumble_view::animation::{AnimationSettings, still};
use tumble_view::view::page;
use tumble_view::{Fact, Film};

/// Largest number of rows of a run on the page. They are all in memory, about 1 kB each.
pub const MOST_ROWS: usize = 1_000_000;

/// Runs `tumble view`.
pub fn run(args: &ViewArgs) -> Result<Outcome, Failure> {
    let interrupt = Arc::new(AtomicBool::new(false));
    raise_on_signals(&interrupt)?;
    let usual = if args.png { STILL } else { VIEW };
    let (out, name) = target(args.out.as_deref(), &args.files[0], usual, &[])?;
    if args.png && args.files.len() > 1 {
        return Err(Failure::Input(
            "--png: a picture shows one run; leave the other out".to_owned(),
        ));
    }
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
    let pending = PendingFile::create(&directory, name)?;
    let written = if args.png {
        Some(write_still(pending, films[0], args)?)
    } else {
        write(pending, &films, &interrupt)?
    };
    let Some((path, written)) = written else { return Ok(Outcome::Interrupted) };
    if !args.quiet {
        say(&written)?;
    }
    if args.open {
        open(&path)?;
    }
    let unconverged = films.iter().any(|film| film.has_failed());
    Ok(if unconverged { Outcome::Unconverged } else { Outcome::Done })
}

/// Writes a still picture of a run. Returns its path and a sentence.
fn write_still(
    pending: PendingFile,
    film: &Film,
    args: &ViewArgs,
) -> Result<(PathBuf, String), Failure> {
    let size = args.size.unwrap_or(AnimationSettings::default().size);
    let settings = AnimationSettings { size, view: args.camera, ..AnimationSettings::default() };
    let [start, end] = [film.frames.first(), film.frames.last()]
        .map(|frame| frame.map_or(0.0, |frame| frame.row.time));
    let time = args.at.unwrap_or(start);
    if !(start..=end).contains(&time) {
        return Err(Failure::Input(format!(
            "--at: {time} s is not in the run, which goes from {start} to {end} s"
        )));
    }
    let png = still(film, &settings, time).map_err(|why| Failure::Other(why.to_string()))?;
    pending.write(&png)?;
    let path = pending.publish()?;
    let written = format!("wrote {}\n", shown::path(&path));
    Ok((path, written))
}

/// Opens a page in the browser.
fn open(page: &Path) -> Result<(), Failure> {
    let opener = match env::consts::OS {
        "windows" => "explorer",
        "macos" => "open",
        _ => "xdg-open",
    };
    let mut command = Command::new(opener);
    command.arg(page).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    let started = command.spawn();
    started.map(drop).map_err(|why| {
        let page = shown::path(page);
        Failure::Other(format!("--open: {opener} does not start ({why}); open {page} by hand"))
    })
}

/// Opens a temporary file for the page, so that obstacles are found before the work.
pub fn pending(directory: &OutputDirectory) -> Result<PendingFile, Failure> {
    PendingFile::create(directory, VIEW)
}

/// Writes the page of one or two films. Returns its path and a sentence. Writes no file if
/// `interrupt` is raised.
pub fn write(
    pending: PendingFile,
    films: &[&Film],
    interrupt: &AtomicBool,
) -> Result<Option<(PathBuf, String)>, Failure> {
    let page = page(env!("CARGO_PKG_VERSION"), films)
        .map_err(|why| Failure::Other(format!("the page cannot be created: {why}")))?;
    if interrupt.load(Ordering::Relaxed) {
        return Ok(None);
    }
    pending.write(page.as_bytes())?;
    let path = pending.publish()?;
    let size = page.len() as f64 / 1e6;
    let written = format!("wrote {} ({size:.2} MB)\n", shown::path(&path));
    Ok(Some((path, written)))
}
