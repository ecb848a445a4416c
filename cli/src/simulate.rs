//! Default command: simulates a scene, writes its rows and run.json, and prints a summary.

use super::args::SimulateArgs;
use super::checkpoint::CheckpointWriter;
use super::continued::{self, Continued, ContinuedNotes, UNFINISHED};
use super::describe::describe;
use super::directory::{self, Claims, OutputDirectory};
use super::exported::Exported;
use super::file_names::{self, RUN_JSON};
use super::live::{self, Live, Played};
use super::outcome::{Failure, Outcome};
use super::output::{PendingFile, Voice};
use super::pictures::{self, Pictures};
use super::recording::Recording;
use super::run::{self, RunOutcome, RunOutputs, RunResults};
use super::scene;
use super::scene::Scene;
use super::signals::raise_on_signals;
use super::writer::{RunWriter, WrittenFiles};
use std::fmt::Write as _;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use tumble_model::shown;
use tumble_scene::kept::KeptSteps;
use tumble_scene::output::tables::Table;
use tumble_scene::run_file::RunFile;

/// Runs the default command in four parts:
///
/// 1. The scene is made and checked, and the simulation created or restored from a checkpoint.
/// 2. The output directory is locked, a live run is played, and temporary files are opened.
/// 3. The steps are computed and written.
/// 4. The files are completed and renamed. Pictures are drawn from them.
pub fn run(args: &SimulateArgs) -> Result<Outcome, Failure> {
    let (scene, before) = match &args.continued {
        None => (live::taken_over(args)?.map_or_else(|| scene::of_args(&args.setup), Ok)?, None),
        Some(directory) => {
            let (scene, before) = Continued::read(args, directory)?;
            (scene, Some(before))
        }
    };
    let interrupt = Arc::new(AtomicBool::new(false));
    let (scene, played) = if args.live.is_live {
        let played = Live::new(args, scene, &interrupt)?;
        (played.scene()?, Some(played))
    } else {
        (scene, None)
    };
    let exported = args
        .output
        .export_problems
        .as_deref()
        .map(|path| Exported::check(path, &scene, args.out()));
    let exported = exported.transpose()?;
    let kept = before.as_ref().map_or_else(|| args.kept(), |before| before.kept().clone());
    check_kept(args, &kept)?;
    pictures::check(args, kept.rows(scene.rows), kept.every as f64 * scene.world.time_step())?;
    let mut simulation = scene.simulation(&interrupt)?;
    if let Some(before) = &before {
        before.restore(&mut simulation)?;
    }

    // Signals are handled before the first file is created, so that an early signal leaves no file.
    raise_on_signals(&interrupt)?;
    // How many parts a live run has is not known before its end.
    let parts = directory::names_in(args.out()).into_iter();
    let parts = parts.filter(|name| played.is_some() && file_names::is_part(name));
    let claims = Claims {
        files: names(args, &scene, &kept),
        alike: file_names::of_rows().chain(parts).collect(),
        overwrite: args.output.overwrite,
        continues: args.continued.as_deref() == Some(args.out()),
    };
    let out = OutputDirectory::for_run(args.out(), claims)?;
    let (scene, parts) = match played {
        None => (scene, Vec::new()),
        Some(played) => {
            let Played { scene, parts } = played.play(args, &interrupt)?;
            // The steps are computed again. Another Ctrl-C interrupts that.
            interrupt.store(false, Ordering::Relaxed);
            simulation = scene.simulation(&interrupt)?;
            (scene, written_parts(parts, &out)?)
        }
    };
    let mut files = names(args, &scene, &kept);
    files.extend(parts.iter().map(|part| part.name().to_owned()));
    let mut voice = Voice::new(args.output.quiet);
    if let Some(note) = scene::note(&scene, &args.setup) {
        voice.say(&note);
    }
    for note in scene.notes() {
        voice.say(&format!("{}\n", shown::line(&note)));
    }
    let from = before.as_ref().map_or(0, |_| simulation.index());
    let exported = exported.map(|wanted| Exported::begin(wanted, from, args.output.overwrite));
    let mut exported = exported.transpose()?;
    let mut writer =
        RunWriter::create(&scene, &kept, &out, before.as_ref().map(Continued::written))?;
    let [run_json, state] = [RUN_JSON, continued::FILE].map(|name| PendingFile::create(&out, name));
    let (run_json, state) = (run_json?, state?);
    let pictures = Pictures::create(args, &out)?;
    let run = before.map_or_else(|| RunResults::new(&scene), Continued::into_run);
    // Checkpoints contain a run.json with the outcome `unfinished`.
    let mut run_file = RunFile::of(&scene, &RunResults::new(&scene).ended())?;
    (run_file.kept, run_file.outcome) = (kept.clone(), UNFINISHED.to_owned());
    let run_text = run_file.text()?;
    let checkpoints = args.checkpoint().map(|every| CheckpointWriter {
        directory: &out,
        run_json: run_text,
        every,
    });
    let outputs = RunOutputs {
        writer: &mut writer,
        exported: exported.as_mut(),
        checkpoints: checkpoints.as_ref(),
    };
    let run = match run::run(&scene, &mut simulation, run, &interrupt, outputs, args.output.quiet) {
        Ok(run) => run,
        Err(failure) => return Err(left_to_continue(failure, writer, args.out())),
    };

    let WrittenFiles { files: mut pending, checksums, before_end } = writer.finish()?;
    let mut run_file = RunFile::of(&scene, &run.ended())?;
    (run_file.kept, run_file.files, run_file.checksums) = (kept, files, checksums);
    run_json.write(run_file.text()?.as_bytes())?;
    let notes = ContinuedNotes::of(&run, before_end);
    state.write(&continued::state_bytes(simulation.save(), &notes)?)?;
    pending.extend([run_json, state]);
    pending.extend(parts);
    let written = pending.into_iter().map(PendingFile::publish).collect::<Result<Vec<_>, _>>()?;
    let removed = out.remove_former(&written)?;
    let mut text = describe(&scene, &run);
    let names: Vec<_> = written.iter().map(|path| shown::path(path)).collect();
    let _ = writeln!(text, "wrote {}", names.join(", "));
    if let Some(exported) = &exported {
        text += &exported.described();
    }
    if !removed.is_empty() {
        let _ = writeln!(text, "removed {} from an earlier run", removed.join(", "));
    }
    if run.end == RunOutcome::Interrupted {
        let _ = writeln!(text, "continue with tumble run --continue {}", shown::path(args.out()));
    }
    voice.say(&text);
    // An interrupt of the run does not affect its pictures, but a later one does.
    interrupt.store(false, Ordering::Relaxed);
    let animated = args.pictures.gif && run.end != RunOutcome::Interrupted;
    let animated = animated.then_some((args, &out));
    let open = || Recording::of_run(&written[0], run_file);
    let drawn = pictures.draw(open, animated, &mut voice, &interrupt)?;
    voice.end(match run.end {
        RunOutcome::Interrupted => Outcome::Interrupted,
        _ if !drawn => Outcome::Interrupted,
        RunOutcome::Stopped => Outcome::Unconverged,
        RunOutcome::Complete if run.summary.failed > 0 => Outcome::Unconverged,
        RunOutcome::Complete => Outcome::Done,
    })
}

/// Names of the files of a run.
fn names(args: &SimulateArgs, scene: &Scene, kept: &KeptSteps) -> Vec<String> {
    let mut names = RunWriter::names(scene, kept);
    names.extend([RUN_JSON, continued::FILE].map(str::to_owned));
    names.extend(pictures::names(args));
    names
}

/// Temporary files with the parts of a live run that changes ended.
fn written_parts(parts: Vec<String>, out: &OutputDirectory) -> Result<Vec<PendingFile>, Failure> {
    let written = parts.iter().enumerate().map(|(index, text)| {
        let file = PendingFile::create(out, &file_names::of_part(index + 1))?;
        file.write(text.as_bytes())?;
        Ok(file)
    });
    written.collect()
}

/// Failure of a started run. Its rows are kept if it has a checkpoint.
fn left_to_continue(failure: Failure, writer: RunWriter, out: &Path) -> Failure {
    match failure {
        Failure::Other(why) if writer.leave() => {
            let out = shown::path(out);
            Failure::Other(format!(
                "{why}; continue from the last checkpoint with --continue {out}"
            ))
        }
        failure => failure,
    }
}

/// Refuses the table ends for a run with all rows.
fn check_kept(args: &SimulateArgs, kept: &KeptSteps) -> Result<(), Failure> {
    let asks_for_ends = args.output.tables.iter().flatten().any(|table| *table == Table::Ends);
    if asks_for_ends && kept.every <= 1 {
        let why = "the table ends needs a run that omits rows; add --every or --substeps";
        return Err(Failure::setting("tables", why));
    }
    Ok(())
}
