//! Default command: simulates a scene, writes its rows and run.json, and prints a summary.

use super::args::SimulateArgs;
use super::checkpoint::{CheckpointWriter, ContinuedNotes, state_bytes};
use super::continued::Continued;
use super::describe::describe;
use super::directory::{self, OutputClaims, OutputDirectory};
use super::exported::{ExportPath, Exported};
use super::file_names::{self, RUN_JSON, STATE};
use super::live::{self, Live, Played};
use super::outcome::{Failure, Outcome};
use super::output::{self, PendingFile, StderrReporter};
use super::pictures::{self, Pictures};
use super::recording::Recording;
use super::results::{RunOutcome, RunResults, UNFINISHED};
use super::run::{self, RunOutputs};
use super::scene;
use super::scene::Scene;
use super::signals::raise_on_signals;
use super::writer::{RunWriter, WrittenFiles, publish};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use tumble_core::mechanics::State;
use tumble_core::simulation::Simulation;
use tumble_model::shown;
use tumble_scene::output::tables::Table;
use tumble_scene::row_selection::RowSelection;
use tumble_scene::run_file::RunFile;

/// A run that has ended, with its files.
pub struct Finished {
    pub outcome: Outcome,
    /// Name of the outcome.
    pub word: &'static str,
    /// Number of steps that failed or are wild.
    pub unsolved: u64,
    /// Names of the bodies, and their states at the end.
    pub bodies: Vec<String>,
    pub states: Vec<State>,
}

/// Runs the default command.
pub fn run(args: &SimulateArgs) -> Result<Outcome, Failure> {
    finished(args).map(|run| run.outcome)
}

/// Runs a scene and writes its files. A live run is played before its files are opened, and then computed
/// again.
pub fn finished(args: &SimulateArgs) -> Result<Finished, Failure> {
    let mut prepared = Prepared::new(args)?;
    // Signals are handled before the first file is created, so that an early signal leaves no file.
    raise_on_signals(&prepared.interrupt)?;
    let out = prepared.claim_directory()?;
    let parts = prepared.play(&out)?;
    let mut reporter = StderrReporter::new(args.output.quiet || args.output.json);
    let notes = prepared.notes();
    notes.iter().for_each(|note| reporter.note(note));
    let mut files = RunFiles::open(&mut prepared, parts, &out)?;
    let run = match prepared.simulate(&mut files) {
        Ok(run) => run,
        Err(failure) => return Err(left_to_continue(failure, files.writer, args.out())),
    };
    let WrittenRun { run_file, states, pictures, text } = files.publish(&prepared, &run)?;
    reporter.say(&text);
    let summary = args.output.json.then(|| run_file.summary_text(&notes)).transpose()?;
    // An interrupt of the run does not affect its pictures, but a later one does.
    prepared.interrupt.store(false, Ordering::Relaxed);
    let animated = args.pictures.gif && run.end != RunOutcome::Interrupted;
    let animated = animated.then_some((args, &out));
    let open = || Recording::from_run(&states, run_file);
    let drawn = pictures.draw(open, animated, &mut reporter, &prepared.interrupt)?;
    summary.map_or(Ok(()), |summary| output::say(&summary))?;
    let outcome = reporter.end(match run.end {
        RunOutcome::Interrupted => Outcome::Interrupted,
        _ if !drawn => Outcome::Interrupted,
        RunOutcome::Stopped => Outcome::Unconverged,
        RunOutcome::Complete if run.summary.unsolved() > 0 => Outcome::Unconverged,
        RunOutcome::Complete => Outcome::Done,
    })?;
    let Prepared { scene, simulation, .. } = prepared;
    let states = simulation.states().to_vec();
    let unsolved = run.summary.unsolved();
    Ok(Finished { outcome, word: run.end.name(), unsolved, bodies: scene.bodies, states })
}

/// A checked run before its first file.
struct Prepared<'a> {
    args: &'a SimulateArgs,
    interrupt: Arc<AtomicBool>,
    scene: Scene,
    simulation: Simulation<'static>,
    selection: RowSelection,
    exported: Option<ExportPath<'a>>,
    /// The earlier run that this one continues.
    continued: Option<Continued<'a>>,
    /// The live run that is still to be played.
    live: Option<Live>,
}

impl<'a> Prepared<'a> {
    /// Makes the scene, checks it, and creates or restores the simulation.
    fn new(args: &'a SimulateArgs) -> Result<Self, Failure> {
        let interrupt = Arc::new(AtomicBool::new(false));
        let (mut scene, continued) = match &args.continued {
            Some(directory) => {
                let (scene, continued) = Continued::read(args, directory)?;
                (scene, Some(continued))
            }
            None => {
                let begin = || scene::from_args(&args.setup);
                (live::taken_over(args)?.map_or_else(begin, Ok)?, None)
            }
        };
        let mut live = None;
        if args.live.is_live {
            let begun = Live::new(args, scene, &interrupt)?;
            scene = begun.scene()?;
            live = Some(begun);
        }
        let exported = args.output.export_problems.as_deref();
        let exported =
            exported.map(|path| Exported::check(path, &scene, args.out())).transpose()?;
        let selection = continued
            .as_ref()
            .map_or_else(|| args.row_selection(), |run| run.row_selection().clone());
        check_selection(args, &selection)?;
        let time_step = scene.world.time_step();
        pictures::check(args, selection.rows(scene.rows), selection.every as f64 * time_step)?;
        let mut simulation = scene.simulation(&interrupt)?;
        if let Some(run) = &continued {
            run.restore(&mut simulation)?;
        }
        Ok(Self { args, interrupt, scene, simulation, selection, exported, continued, live })
    }

    /// Names of the files of the run.
    fn names(&self) -> Vec<String> {
        let mut names = RunWriter::names(&self.scene, &self.selection);
        names.extend([RUN_JSON, STATE].map(str::to_owned));
        names.extend(pictures::names(self.args));
        names
    }

    /// Locks the output directory.
    fn claim_directory(&self) -> Result<OutputDirectory, Failure> {
        let out = self.args.out();
        // How many parts a live run has is not known before its end.
        let parts = directory::names_in(out).into_iter();
        let parts = parts.filter(|name| self.live.is_some() && file_names::is_part(name));
        let claims = OutputClaims {
            files: self.names(),
            alike: file_names::row_files().chain(parts).collect(),
            overwrite: self.args.output.overwrite,
            continues: self.args.continued.as_deref() == Some(out),
        };
        OutputDirectory::for_run(out, claims)
    }

    /// Plays a live run and takes its scene. Returns temporary files with the parts that changes
    /// ended.
    fn play(&mut self, out: &OutputDirectory) -> Result<Vec<PendingFile>, Failure> {
        let Some(live) = self.live.take() else { return Ok(Vec::new()) };
        let Played { scene, parts } = live.play(self.args, &self.interrupt)?;
        // The steps are computed again. Another Ctrl-C interrupts that.
        self.interrupt.store(false, Ordering::Relaxed);
        self.simulation = scene.simulation(&self.interrupt)?;
        self.scene = scene;
        let written = parts.iter().enumerate().map(|(index, text)| {
            let file = PendingFile::create(out, &file_names::part_directory(index + 1))?;
            file.write(text.as_bytes())?;
            Ok(file)
        });
        written.collect()
    }

    /// Notes on the scene and its solver.
    fn notes(&self) -> Vec<String> {
        let of_solver = scene::note(&self.scene, &self.args.setup);
        of_solver.into_iter().chain(self.scene.notes()).collect()
    }

    /// Computes and writes the steps, with checkpoints.
    fn simulate(&mut self, files: &mut RunFiles<'_>) -> Result<RunResults, Failure> {
        let Self { args, scene, simulation, selection, interrupt, continued, .. } = self;
        let run = continued.take().map_or_else(|| RunResults::new(scene), Continued::into_run);
        let mut run_file = RunFile::new(scene, &RunResults::new(scene).ended())?;
        (run_file.kept, run_file.outcome) = (selection.clone(), UNFINISHED.to_owned());
        let run_json = run_file.text()?;
        let directory = files.out;
        let checkpoints =
            args.checkpoint().map(|every| CheckpointWriter { directory, run_json, every });
        let outputs = RunOutputs {
            writer: &mut files.writer,
            exported: files.exported.as_mut(),
            checkpoints: checkpoints.as_ref(),
        };
        run::run(scene, simulation, run, interrupt, outputs, args.output.quiet)
    }
}

/// Temporary files of a run.
struct RunFiles<'a> {
    out: &'a OutputDirectory,
    writer: RunWriter,
    run_json: PendingFile,
    state: PendingFile,
    /// Parts of a live run.
    parts: Vec<PendingFile>,
    pictures: Pictures,
    exported: Option<Exported>,
}

/// A run with all files but its pictures.
struct WrittenRun {
    run_file: RunFile,
    /// Path of the table `states`.
    states: PathBuf,
    pictures: Pictures,
    /// Summary for the terminal.
    text: String,
}

impl<'a> RunFiles<'a> {
    fn open(
        prepared: &mut Prepared<'_>,
        parts: Vec<PendingFile>,
        out: &'a OutputDirectory,
    ) -> Result<Self, Failure> {
        let Prepared { args, scene, simulation, selection, exported, continued, .. } = prepared;
        let from = continued.as_ref().map_or(0, |_| simulation.index());
        let exported = exported
            .take()
            .map(|path_of_export| Exported::begin(path_of_export, from, args.output.overwrite));
        let exported = exported.transpose()?;
        let written = continued.as_ref().map(Continued::written);
        let writer = RunWriter::create(scene, selection, out, written)?;
        let run_json = PendingFile::create(out, RUN_JSON)?;
        let state = PendingFile::create(out, STATE)?;
        let pictures = Pictures::create(args, out)?;
        Ok(Self { out, writer, run_json, state, parts, pictures, exported })
    }

    /// Completes the files of the results `run` and gives them their names.
    fn publish(self, prepared: &Prepared<'_>, run: &RunResults) -> Result<WrittenRun, Failure> {
        let Prepared { args, scene, simulation, selection, .. } = prepared;
        let WrittenFiles { mut files, checksums, omitted, before_end } = self.writer.finish()?;
        let mut run_file = RunFile::new(scene, &run.ended())?;
        (run_file.kept, run_file.checksums) = (selection.clone(), checksums);
        run_file.files = prepared.names();
        run_file.files.retain(|name| omitted.as_ref() != Some(name));
        run_file.files.extend(self.parts.iter().map(PendingFile::name));
        self.run_json.write(run_file.text()?.as_bytes())?;
        let notes = ContinuedNotes { rows: before_end, run: run.clone() };
        self.state.write(&state_bytes(simulation.save(), &notes)?)?;
        files.extend([self.run_json, self.state]);
        files.extend(self.parts);
        let (mut paths, lines) = publish(files, self.out)?;
        let mut text = describe(scene, run) + &lines;
        if let Some(exported) = &self.exported {
            text += &exported.described();
        }
        if run.end == RunOutcome::Interrupted {
            let out = shown::path(args.out());
            let _ = writeln!(text, "continue with tumble run --continue {out}");
        }
        Ok(WrittenRun { run_file, states: paths.swap_remove(0), pictures: self.pictures, text })
    }
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
fn check_selection(args: &SimulateArgs, selection: &RowSelection) -> Result<(), Failure> {
    let asks_for_ends = args.output.tables.iter().flatten().any(|table| *table == Table::Ends);
    if asks_for_ends && selection.every <= 1 {
        let why = "the table ends needs a run that omits rows; add --every or --substeps";
        return Err(Failure::setting("tables", why).as_flag());
    }
    Ok(())
}
