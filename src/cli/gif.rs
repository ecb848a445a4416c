//! `tumble gif`, and `--gif` of a simulation: a trajectory file as an animation.

use super::args::{AnimationArgs, GifArgs, SimulateArgs};
use super::directory::OutputDirectory;
use super::film::film;
use super::outcome::{Failure, Outcome, refuse_flags};
use super::output::{PendingFile, Voice, directory_of, progress_bar};
use super::picture_files::ANIMATION;
use super::recording::Recording;
use super::shown;
use super::signals::raise_on_signals;
use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use tumble_pictures::Film;
use tumble_pictures::animation::{AnimationError, Settings, animate, frame_count};

/// Rows that an animation may be made of: they are all in memory, 0.6 kB each.
pub const MOST_ROWS: usize = 500_000;

/// `tumble gif`.
pub fn run(args: &GifArgs) -> Result<Outcome, Failure> {
    let interrupt = Arc::new(AtomicBool::new(false));
    raise_on_signals(&interrupt)?;
    let recording = Recording::open(&args.file, &args.physics)?;
    let note = recording.note_line();
    let Some(film) = film(recording, MOST_ROWS, &interrupt)? else {
        return Ok(Outcome::Interrupted);
    };
    let out = directory_of(args.out.as_deref(), &args.file);
    let directory = OutputDirectory::for_pictures(out)?;
    let mut voice = Voice::new(args.quiet);
    let outcome = match write(&film, &directory, &args.animation, &mut voice, &interrupt)? {
        Outcome::Done if film.has_failed() => Outcome::Unconverged,
        outcome => outcome,
    };
    voice.say(&note);
    voice.end(outcome)
}

/// Refuses, before a simulation of so many `rows`, what would be refused after it.
pub fn check(args: &SimulateArgs, rows: u64, time_step: f64) -> Result<(), Failure> {
    let animation = &args.animation;
    if !args.gif {
        let flags = [
            ("--gif-speed", animation.gif_speed.is_some()),
            ("--gif-size", animation.gif_size.is_some()),
            ("--camera", animation.camera.is_some()),
        ];
        return refuse_flags("a simulation without --gif", &flags);
    }
    let duration = (rows - 1) as f64 * time_step;
    frame_count(duration, settings(animation).speed).map_err(refused)?;
    Ok(())
}

fn settings(args: &AnimationArgs) -> Settings {
    let default = Settings::default();
    Settings {
        speed: args.gif_speed.unwrap_or(default.speed),
        size: args.gif_size.unwrap_or(default.size),
        view: args.camera.unwrap_or(default.view),
    }
}

/// Writes the animation of `film`; no file if `interrupt` is raised.
pub fn write(
    film: &Film,
    out: &OutputDirectory,
    args: &AnimationArgs,
    voice: &mut Voice,
    interrupt: &AtomicBool,
) -> Result<Outcome, Failure> {
    let pending = PendingFile::create(out, ANIMATION)?;
    let bar = progress_bar(0, "frames", voice.is_quiet());
    let progress = |done, frames| {
        bar.set_length(frames);
        bar.set_position(done);
        if interrupt.load(Ordering::Relaxed) {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    };
    let animation = match animate(film, &settings(args), progress) {
        Ok(animation) => animation,
        Err(AnimationError::Interrupted) => return Ok(Outcome::Interrupted),
        Err(error) => return Err(refused(error)),
    };
    bar.finish_and_clear();
    pending.write(&animation)?;
    let path = pending.publish()?;
    let megabytes = animation.len() as f64 / 1e6;
    voice.say(&format!("wrote {} ({megabytes:.2} MB)\n", shown::path(&path)));
    Ok(Outcome::Done)
}

fn refused(error: AnimationError) -> Failure {
    match error {
        AnimationError::TooLong { .. } => {
            Failure::Input(format!("{error}; a larger --gif-speed makes fewer"))
        }
        AnimationError::Encoding(_) => Failure::Other(error.to_string()),
        AnimationError::TooFar | AnimationError::Interrupted => Failure::Input(error.to_string()),
    }
}
