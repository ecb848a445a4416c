//! Continuation of an earlier run. The new rows are appended to its rows, with the scene of its
//! run.json. A finished run continues from its `state.bin`, a killed run from its checkpoint.

use super::args::SimulateArgs;
use super::checkpoint::{Checkpoint, ContinuedNotes};
use super::file_names::{CHECKPOINT, RUN_JSON, STATE, directory_of, file_of};
use super::input;
use super::outcome::{Failure, refuse_flags};
use super::recording::{Recording, run_file};
use super::results::{RunResults, UNFINISHED};
use super::scene::{Scene, on_threads};
use super::writer::Written;
use std::io;
use std::path::{Path, PathBuf};
use tumble_core::mechanics;
use tumble_core::simulation::Simulation;
use tumble_core::simulation::save::{Saved, from_bytes};
use tumble_core::step::StepStatus;
use tumble_model::shown;
use tumble_scene::output::tables::Table;
use tumble_scene::row_selection::RowSelection;
use tumble_scene::run_file::RunFile;

/// Largest accepted state, bytes: a thousand times the state of the largest scenes.
const LARGEST_STATE: u64 = 1 << 32;

/// A run to be continued.
pub struct Continued<'a> {
    directory: &'a Path,
    /// File with the state.
    file: PathBuf,
    saved: Saved,
    notes: ContinuedNotes,
    selection: RowSelection,
}

impl<'a> Continued<'a> {
    /// Reads the scene and the state of the run in `directory`.
    pub fn read(args: &SimulateArgs, directory: &'a Path) -> Result<(Scene, Self), Failure> {
        let given = args.given();
        let flags: Vec<_> = given.iter().map(|flag| (*flag, *flag != "steps")).collect();
        refuse_flags("--continue, which reads it from run.json", &flags)?;
        refuse_file(directory)?;
        let (run, path, state) = match checkpoint_in(directory)? {
            Some(found) => found,
            None => ended_in(directory)?,
        };
        let mut scene = scene_of(&run).map_err(|failure| failure.in_file(&path))?;
        let SavedState { file, saved, notes } = state;
        let steps = saved.index().checked_sub(scene.start_index).ok_or_else(|| {
            let (k, start) = (saved.index(), scene.start_index);
            invalid_state(
                &file,
                &format!("it is at k = {k}, before the start of its run at k = {start}"),
            )
        })?;
        if let Some(rows) = args.setup.steps()? {
            // Every whole step has one row, also with substeps.
            scene.rows = (rows - 1).saturating_mul(run.substeps).saturating_add(1);
        }
        if scene.rows < steps + 1 {
            let rows = steps / run.substeps + 1;
            let why = format!(
                "{} already has {rows} rows, which --steps includes; allowed: {rows} or more",
                shown::path(directory)
            );
            return Err(Failure::setting("steps", why).as_flag());
        }
        let selection = run.kept.clone();
        if run.outcome != UNFINISHED {
            let states = directory.join(file_of(Table::States.name(), selection.form));
            check_rows(&states, run, &saved)?;
        }
        Ok((on_threads(&args.setup, scene)?, Self { directory, file, saved, notes, selection }))
    }

    /// Restores the end of the run in the simulation of `scene`.
    pub fn restore(&self, simulation: &mut Simulation<'_>) -> Result<(), Failure> {
        simulation.restore(&self.saved).map_err(|error| invalid_state(&self.file, &error))
    }

    /// Rows written by the run so far.
    pub fn written(&self) -> Written<'_> {
        Written { directory: self.directory, rows: &self.notes.rows }
    }

    /// Selection of rows that the run writes.
    pub fn row_selection(&self) -> &RowSelection {
        &self.selection
    }

    /// Results of the run so far.
    pub fn into_run(self) -> RunResults {
        self.notes.run
    }
}

/// Rejects a file instead of the directory of a run.
fn refuse_file(path: &Path) -> Result<(), Failure> {
    if !path.is_file() {
        return Ok(());
    }
    let (file, directory) = (shown::path(path), shown::path(directory_of(None, path)));
    Err(Failure::Input(format!("--continue: {file} is a file; give its directory, {directory}")))
}

fn invalid_state(path: &Path, why: &dyn std::fmt::Display) -> Failure {
    Failure::Input(format!(
        "{} cannot be continued: {why}; run again without --continue",
        shown::path(path)
    ))
}

/// State of a run, read from a file.
struct SavedState {
    file: PathBuf,
    saved: Saved,
    notes: ContinuedNotes,
}

/// Reads the checkpoint of a run killed in `directory`, if there is one, and names its file.
fn checkpoint_in(directory: &Path) -> Result<Option<(RunFile, PathBuf, SavedState)>, Failure> {
    let file = directory.join(CHECKPOINT);
    let bytes = match input::bytes(&file, LARGEST_STATE) {
        Ok(bytes) => bytes,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
        Err(error) => return Err(invalid_state(&file, &error)),
    };
    let Checkpoint { run_json, state } =
        Checkpoint::from_bytes(&bytes).map_err(|error| invalid_state(&file, &error))?;
    let run = RunFile::from_text(&run_json, &file)?;
    let state = state_in(file.clone(), &state)?;
    Ok(Some((run, file, state)))
}

/// Reads the finished run in `directory`, and names its run.json.
fn ended_in(directory: &Path) -> Result<(RunFile, PathBuf, SavedState), Failure> {
    let path = directory.join(RUN_JSON);
    let run = run_file(&path, || {
        let directory = shown::path(directory);
        Failure::Input(format!(
            "--continue: {directory} has no run.json; the directory of a run is needed"
        ))
    })?;
    let file = directory.join(STATE);
    let bytes = input::bytes(&file, LARGEST_STATE).map_err(|error| invalid_state(&file, &error))?;
    let state = state_in(file, &bytes)?;
    Ok((run, path, state))
}

/// Parses the state and the results in the `bytes` of a file.
fn state_in(file: PathBuf, bytes: &[u8]) -> Result<SavedState, Failure> {
    let saved = Saved::from_bytes(bytes).map_err(|error| invalid_state(&file, &error))?;
    let notes = from_bytes(saved.notes()).map_err(|_| {
        invalid_state(&file, &"it is the saved state of a simulation, not of a run")
    })?;
    Ok(SavedState { file, saved, notes })
}

/// Refuses rows that do not end at the state: those of another run, or modified ones.
fn check_rows(path: &Path, run: RunFile, saved: &Saved) -> Result<(), Failure> {
    let mut rows = Recording::from_run(path, run)?;
    if let Some(changed) = rows.changed_files()?.first() {
        let why = format!("{changed}; --continue needs the unchanged files of the run");
        return Err(Failure::Input(format!("--continue: {why}")));
    }
    while let Some(step) = rows.next_step()? {
        if step.row.status != StepStatus::End {
            continue;
        }
        let numbers = |state: &mechanics::State| state.to_vector().map(f64::to_bits);
        let is_same = step.row.index == saved.index()
            && step.instant_states().iter().map(numbers).eq(saved.states().iter().map(numbers));
        if !is_same {
            let place = rows.place();
            return Err(invalid_state(
                &path.with_file_name(STATE),
                &format!("its state at k = {} is not the last row of {place}", saved.index()),
            ));
        }
    }
    Ok(())
}

/// Scene of a run, as far as a continuation needs it.
pub fn scene_of(run: &RunFile) -> Result<Scene, Failure> {
    let (document, contact) = (run.model.clone(), run.solver.choice()?);
    let world = document.world()?;
    Ok(Scene {
        changed: run.changed.clone(),
        seed: run.seed,
        drawn: run.drawn_seed().is_some(),
        start_index: run.start_index,
        rows: run.steps,
        substeps: run.substeps,
        trajectory: run.trajectory,
        ..Scene::from_document(run.scene.clone(), document, world, contact)?
    })
}
