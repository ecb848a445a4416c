//! The main job: simulate a scene, write its rows and the run file, say how it went.

use super::args::SimulateArgs;
use super::continued::{self, Continued};
use super::describe::describe;
use super::directory::OutputDirectory;
use super::exported::Exported;
use super::outcome::{Failure, Outcome};
use super::output::{PendingFile, Voice};
use super::pictures::{self, Pictures};
use super::recording::Recording;
use super::run::{self, End, Run};
use super::run_file::RunFile;
use super::signals::raise_on_signals;
use super::writer::RunWriter;
use super::{scene, shown};
use std::fmt::Write as _;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

pub fn run(args: &SimulateArgs) -> Result<Outcome, Failure> {
    let (scene, before) = match &args.continued {
        None => (scene::of_args(args)?, None),
        Some(directory) => {
            let (scene, before) = Continued::read(args, directory)?;
            (scene, Some(before))
        }
    };
    pictures::check(args, scene.rows, scene.world.time_step())?;
    let exported =
        args.export_problems.as_deref().map(|path| Exported::check(path, &scene, args.out()));
    let exported = exported.transpose()?;
    let interrupt = Arc::new(AtomicBool::new(false));
    let mut simulation = scene.simulation(&interrupt)?;
    if let Some(before) = &before {
        before.restore(&mut simulation)?;
    }

    // Before the first file: a signal that comes earlier would leave it behind.
    raise_on_signals(&interrupt)?;
    let out = OutputDirectory::for_run(args.out())?;
    let mut voice = Voice::new(args.quiet);
    if let Some(note) = scene::note(&scene) {
        voice.say(&note);
    }
    for note in scene.notes() {
        voice.say(&format!("{}\n", shown::line(&note)));
    }
    let mut exported = exported.map(Exported::begin).transpose()?;
    let mut writer = RunWriter::create(&scene, &out, before.as_ref().map(Continued::written))?;
    let [run_json, state] =
        ["run.json", continued::FILE].map(|name| PendingFile::create(&out, name));
    let (run_json, state) = (run_json?, state?);
    let pictures = Pictures::create(args, &out)?;
    let run = before.map_or_else(Run::new, Continued::into_run);
    let outputs = (&mut writer, exported.as_mut());
    let run = run::run(&scene, &mut simulation, run, &interrupt, outputs, args.quiet)?;

    let mut files = writer.finish()?;
    let run_file = RunFile::of(&scene, &run.ended())?;
    run_json.write(run_file.text()?.as_bytes())?;
    state.write(&continued::state_of(&simulation, &run)?)?;
    files.extend([run_json, state]);
    let written = files.into_iter().map(PendingFile::publish).collect::<Result<Vec<_>, _>>()?;
    let removed = out.remove_former(&written)?;
    let mut text = describe(&scene, &run);
    let names: Vec<_> = written.iter().map(|path| shown::path(path)).collect();
    let _ = writeln!(text, "wrote {}", names.join(", "));
    if let Some(exported) = &exported {
        text += &exported.described();
    }
    if !removed.is_empty() {
        let _ = writeln!(text, "removed {} of an earlier run", removed.join(", "));
    }
    voice.say(&text);
    // What ended the run does not end the pictures of it, but what comes after does.
    interrupt.store(false, Ordering::Relaxed);
    let animated = (args.gif || args.apng) && run.end != End::Interrupted;
    let animated = animated.then_some((args, &out));
    let open = || Recording::of_run(&written[0], run_file);
    let drawn = pictures.draw(open, animated, &mut voice, &interrupt)?;
    voice.end(match run.end {
        End::Interrupted => Outcome::Interrupted,
        _ if !drawn => Outcome::Interrupted,
        End::Stopped => Outcome::Unconverged,
        End::Complete if run.summary.failed > 0 => Outcome::Unconverged,
        End::Complete => Outcome::Done,
    })
}
