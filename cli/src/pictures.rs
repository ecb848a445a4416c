//! Pictures of a simulation in addition to its tables.

use super::args::SimulateArgs;
use super::directory::OutputDirectory;
use super::file_names::{ANIMATION, PLOTS, VIEW};
use super::film::film;
use super::outcome::{Failure, Outcome};
use super::output::{PendingFile, StderrReporter};
use super::plot::{self, PendingPlots};
use super::recording::Recording;
use super::{gif, view};
use std::sync::atomic::AtomicBool;

/// Refuses options and sizes before a simulation of `rows` rows, instead of after it.
pub fn check(args: &SimulateArgs, rows: u64, time_step: f64) -> Result<(), Failure> {
    for (flag, requested, picture, most) in [
        ("--gif", args.pictures.gif, "an animation", gif::MOST_ROWS),
        ("--plot", args.pictures.plot, "a plot", plot::MOST_ROWS),
        ("--html", args.pictures.html, "a page", view::MOST_ROWS),
    ] {
        if requested && rows > most as u64 {
            let why = format!("{flag}: {picture} can have at most {most} rows");
            return Err(Failure::Input(why));
        }
    }
    gif::check(&args.pictures, rows, time_step)
}

/// Names of the pictures of a simulation.
pub fn names(args: &SimulateArgs) -> impl Iterator<Item = String> {
    let plots = PLOTS.into_iter().filter(|_| args.pictures.plot);
    let page = args.pictures.html.then_some(VIEW);
    plots.chain(page).chain(args.pictures.gif.then_some(ANIMATION)).map(str::to_owned)
}

/// Pictures of a run that are still to be drawn.
pub struct Pictures {
    plots: Option<PendingPlots>,
    page: Option<PendingFile>,
}

impl Pictures {
    /// Opens the files, so that obstacles are found before the work.
    pub fn create(args: &SimulateArgs, out: &OutputDirectory) -> Result<Self, Failure> {
        Ok(Self {
            plots: args.pictures.plot.then(|| PendingPlots::create(out)).transpose()?,
            page: args.pictures.html.then(|| view::pending(out)).transpose()?,
        })
    }

    /// Draws the pictures from the run's files, opened by `open`, and the animation if `animated`
    /// is not `None`. Returns `false` if `interrupt` was raised before the last picture.
    pub fn draw<'a>(
        self,
        open: impl FnOnce() -> Result<Recording<'a>, Failure>,
        animated: Option<(&SimulateArgs, &OutputDirectory)>,
        reporter: &mut StderrReporter,
        interrupt: &AtomicBool,
    ) -> Result<bool, Failure> {
        let Self { plots, page } = self;
        if plots.is_none() && page.is_none() && animated.is_none() {
            return Ok(true);
        }
        // The number of rows was checked for each kind of picture before the run.
        let Some(film) = film(open()?, usize::MAX, interrupt)? else { return Ok(false) };
        if let Some(plots) = plots {
            let Some(written) = plots.write(&film, None, interrupt)? else { return Ok(false) };
            reporter.say(&plot::describe(&written));
        }
        if let Some(page) = page {
            let Some((_, written)) = view::write(page, &[&film], interrupt)? else {
                return Ok(false);
            };
            reporter.say(&written);
        }
        if let Some((args, out)) = animated {
            let made =
                gif::write(&film, out, ANIMATION, &args.pictures.animation, reporter, interrupt)?;
            return Ok(!matches!(made, Outcome::Interrupted));
        }
        Ok(true)
    }
}
