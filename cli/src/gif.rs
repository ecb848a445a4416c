//! `tumble gif`, and `--gif` of a simulation: a run as a GIF or a video.

use super::args::{AnimationArgs, GifArgs, PictureArgs};
use super::directory::OutputDirectory;
use super::file_names::ANIMATION;
use super::film::film;
use super::outcome::{Failure, Outcome, refuse_flags};
use super::output::{PendingFile, StderrReporter, progress_bar, target};
use super::recording::Recording;
use super::signals::raise_on_signals;
use super::video::{self, Video};
use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use tumble_model::shown;
use tumble_view::Film;
use tumble_view::animation::{AnimationError, AnimationSettings, animate, frame_count, frames};

/// Largest number of rows of an animation. They are all in memory, about 1 kB each.
pub const MOST_ROWS: usize = 500_000;

/// Runs `tumble gif`.
pub fn run(args: &GifArgs) -> Result<Outcome, Failure> {
    let interrupt = Arc::new(AtomicBool::new(false));
    raise_on_signals(&interrupt)?;
    let (out, name) = target(args.out.as_deref(), &args.file, ANIMATION, &video::ENDINGS)?;
    let Some(film) = film(Recording::open(&args.file)?, MOST_ROWS, &interrupt)? else {
        return Ok(Outcome::Interrupted);
    };
    let directory = OutputDirectory::for_pictures(out)?;
    let mut reporter = StderrReporter::new(args.quiet);
    let outcome = match write(&film, &directory, name, &args.animation, &mut reporter, &interrupt)?
    {
        Outcome::Done if film.has_failed() => Outcome::Unconverged,
        outcome => outcome,
    };
    reporter.end(outcome)
}

/// Refuses options and sizes before a simulation of `rows` rows, instead of after it.
pub fn check(args: &PictureArgs, rows: u64, time_step: f64) -> Result<(), Failure> {
    let animation = &args.animation;
    if !args.gif {
        let flags = [
            ("gif-speed", animation.gif_speed.is_some()),
            ("gif-size", animation.gif_size.is_some()),
            ("gif-dark", animation.gif_dark),
            ("camera", animation.camera.is_some()),
        ];
        return refuse_flags("a simulation without --gif", &flags);
    }
    let duration = (rows - 1) as f64 * time_step;
    frame_count(duration, settings(animation).speed).map_err(refused)?;
    Ok(())
}

fn settings(args: &AnimationArgs) -> AnimationSettings {
    let default = AnimationSettings::default();
    AnimationSettings {
        speed: args.gif_speed.unwrap_or(default.speed),
        size: args.gif_size.unwrap_or(default.size),
        view: args.camera,
        dark: args.gif_dark,
    }
}

/// Writes the animation of `film` to a file in a directory. Writes no file if `interrupt` is
/// raised.
pub fn write(
    film: &Film,
    out: &OutputDirectory,
    name: &str,
    args: &AnimationArgs,
    reporter: &mut StderrReporter,
    interrupt: &AtomicBool,
) -> Result<Outcome, Failure> {
    let pending = PendingFile::create(out, name)?;
    let bar = progress_bar(0, "frames", reporter.is_quiet());
    let progress = |done, frames| {
        bar.set_length(frames);
        bar.set_position(done);
        if interrupt.load(Ordering::Relaxed) {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    };
    let settings = settings(args);
    let drawn = if name.ends_with(".gif") {
        animate(film, &settings, progress).map(|bytes| pending.write(&bytes))
    } else {
        let mut video = Video::start(&pending, settings.size)?;
        match frames(film, &settings, progress, |pixels| video.add(pixels)) {
            Err(AnimationError::Output(_)) => Ok(video.finish(false)),
            drawn => drawn.map(|()| video.finish(true)),
        }
    };
    match drawn {
        Ok(written) => written?,
        Err(AnimationError::Interrupted) => return Ok(Outcome::Interrupted),
        Err(error) => return Err(refused(error)),
    }
    bar.finish_and_clear();
    let path = pending.publish()?;
    let megabytes = path.metadata().map_or(0.0, |file| file.len() as f64 / 1e6);
    reporter.say(&format!("wrote {} ({megabytes:.2} MB)\n", shown::path(&path)));
    Ok(Outcome::Done)
}

fn refused(error: AnimationError) -> Failure {
    match error {
        AnimationError::TooLong { .. } => {
            Failure::Input(format!("{error}; use a larger --gif-speed"))
        }
        AnimationError::Gif(_) | AnimationError::Output(_) => Failure::Other(error.to_string()),
        AnimationError::TooFar | AnimationError::Interrupted => Failure::Input(error.to_string()),
    }
}
