//! `tumble plot`: draw a trajectory over time.

use super::args::{PlotArgs, SimulateArgs};
use super::film::film;
use super::job::Job;
use super::outcome::{Failure, Outcome};
use super::output::{PendingFile, create_directory, directory_of, say};
use super::source::TrajectoryFile;
use std::path::{Path, PathBuf};
use tumble_pictures::Film;
use tumble_pictures::plot::{self, Sheet};

/// Rows that a plot may be made of: they are all in memory, 0.8 kB each.
pub const MOST_ROWS: usize = 1_000_000;

/// The sheets and their names.
const SHEETS: [(Sheet, &str); 2] = [(Sheet::Motion, "plot"), (Sheet::Energy, "plot-energy")];

/// The files of all sheets, not yet written.
pub struct PendingPlots {
    /// Of each sheet the PNG and the SVG.
    files: Vec<(Sheet, PendingFile, PendingFile)>,
}

impl PendingPlots {
    /// Opens temporary files in `directory`: what stands in the way shows before the work.
    pub fn create(directory: &Path) -> Result<Self, Failure> {
        let pending = |(sheet, name): (Sheet, &str)| {
            let png = PendingFile::create(directory, &format!("{name}.png"))?;
            Ok((sheet, png, PendingFile::create(directory, &format!("{name}.svg"))?))
        };
        let files = SHEETS.into_iter().map(pending).collect::<Result<_, Failure>>()?;
        Ok(Self { files })
    }

    /// Draws `film` and gives the files their names.
    pub fn write(self, film: &Film) -> Result<Vec<PathBuf>, Failure> {
        for (sheet, png_file, svg_file) in &self.files {
            let svg = plot::svg(film, *sheet, 0);
            let png = plot::png(&svg)
                .map_err(|why| Failure::Other(format!("the trajectory cannot be drawn: {why}")))?;
            png_file.write(&png)?;
            svg_file.write(svg.as_bytes())?;
        }
        let files = self.files.into_iter().flat_map(|(_, png, svg)| [png, svg]);
        files.map(PendingFile::publish).collect()
    }
}

/// Refuses, before a simulation, what would be refused after it.
pub fn check(args: &SimulateArgs, job: &Job) -> Result<(), Failure> {
    if args.plot && job.rows > MOST_ROWS as u64 {
        return Err(Failure::Input(format!("--plot: a plot is made of at most {MOST_ROWS} rows")));
    }
    Ok(())
}

/// `tumble plot`.
pub fn run(args: &PlotArgs) -> Result<Outcome, Failure> {
    let file = TrajectoryFile::open(&args.file, &args.physics)?;
    let note = file.source.note();
    let film = film(file, MOST_ROWS)?;
    let directory = directory_of(args.out.as_deref(), &args.file);
    create_directory(directory)?;
    let written = PendingPlots::create(directory)?.write(&film)?;
    let note = if note.is_empty() { String::new() } else { format!("note: {note}\n") };
    say(&(note + &describe(&written)))?;
    Ok(Outcome::Done)
}

/// The sentence on the files written.
pub fn describe(written: &[PathBuf]) -> String {
    let names: Vec<_> = written.iter().map(|path| path.display().to_string()).collect();
    format!("wrote {}\n", names.join(", "))
}
