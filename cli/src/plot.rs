//! `tumble plot`: draws a run over time.

use super::args::PlotArgs;
use super::directory::OutputDirectory;
use super::file_names::directory_of;
use super::film::film;
use super::outcome::{Failure, Outcome};
use super::output::{PendingFile, say};
use super::recording::Recording;
use super::signals::raise_on_signals;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use tumble_model::shown;
use tumble_view::Film;
use tumble_view::plot::{self, PlotSheet};

/// Largest number of rows of a plot. They are all in memory, about 1 kB each.
pub const MOST_ROWS: usize = 1_000_000;

/// Plot sheets and their names.
const SHEETS: [(PlotSheet, &str); 2] =
    [(PlotSheet::Motion, "plot"), (PlotSheet::Energy, "plot-energy")];

/// Files of all plot sheets, not yet written.
pub struct PendingPlots {
    /// PNG and SVG file of each sheet.
    files: Vec<(PlotSheet, PendingFile, PendingFile)>,
}

impl PendingPlots {
    /// Opens temporary files in `directory`, so that obstacles are found before the work.
    pub fn create(directory: &OutputDirectory) -> Result<Self, Failure> {
        let pending = |(sheet, name): (PlotSheet, &str)| {
            let png = PendingFile::create(directory, &format!("{name}.png"))?;
            Ok((sheet, png, PendingFile::create(directory, &format!("{name}.svg"))?))
        };
        let files = SHEETS.into_iter().map(pending).collect::<Result<_, Failure>>()?;
        Ok(Self { files })
    }

    /// Draws `film`, with the motion of `body` or of the first one that moves, and renames the files. Writes no file if
    /// `interrupt` is raised.
    pub fn write(
        self,
        film: &Film,
        body: Option<usize>,
        interrupt: &AtomicBool,
    ) -> Result<Option<Vec<PathBuf>>, Failure> {
        let body = body.unwrap_or_else(|| film.first_moving());
        for (sheet, png_file, svg_file) in &self.files {
            if interrupt.load(Ordering::Relaxed) {
                return Ok(None);
            }
            let svg = plot::svg(film, *sheet, body);
            let png = plot::png(&svg)
                .map_err(|why| Failure::Other(format!("the run cannot be drawn: {why}")))?;
            png_file.write(&png)?;
            svg_file.write(svg.as_bytes())?;
        }
        let files = self.files.into_iter().flat_map(|(_, png, svg)| [png, svg]);
        files.map(PendingFile::publish).collect::<Result<_, _>>().map(Some)
    }
}

/// Runs `tumble plot`.
pub fn run(args: &PlotArgs) -> Result<Outcome, Failure> {
    let interrupt = Arc::new(AtomicBool::new(false));
    raise_on_signals(&interrupt)?;
    let recording = Recording::open(&args.file)?;
    let body = args.body.as_deref().map(|name| recording.body(name)).transpose()?;
    let Some(film) = film(recording, MOST_ROWS, &interrupt)? else {
        return Ok(Outcome::Interrupted);
    };
    let directory = OutputDirectory::for_pictures(directory_of(args.out.as_deref(), &args.file))?;
    let plots = PendingPlots::create(&directory)?;
    let Some(written) = plots.write(&film, body, &interrupt)? else {
        return Ok(Outcome::Interrupted);
    };
    say(&describe(&written))?;
    Ok(Outcome::Done)
}

/// Sentence about the written files.
pub fn describe(written: &[PathBuf]) -> String {
    let names: Vec<_> = written.iter().map(|path| shown::path(path)).collect();
    format!("wrote {}\n", names.join(", "))
}
