//! Conversion of a recording to a film with the names of the scene.

use super::outcome::Failure;
use super::recording::Recording;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use tumble_core::world::World;
use tumble_model::shown;
use tumble_scene::output::tables::IntervalRows;
use tumble_scene::run_file::{RunFile, heading};
use tumble_view::{Fact, Film, Takeover, is_loaded};

/// Largest memory for the rows of a picture, bytes: a million rows of a box with contacts at all
/// its corners.
const MOST_BYTES: usize = 2_500_000_000;

/// Reads all rows for drawing. More than `most` rows, or too much memory, are refused. Returns
/// `None` if `interrupt` is raised.
pub fn film(
    mut recording: Recording<'_>,
    most: usize,
    interrupt: &AtomicBool,
) -> Result<Option<Film>, Failure> {
    let path = recording.steps_file();
    let every = recording.row_selection().every;
    let (mut frames, mut first) = (Frames::new(&path, most), None);
    while let Some(step) = recording.next_step()? {
        if interrupt.load(Ordering::Relaxed) {
            return Ok(None);
        }
        // Frames have equal intervals, but the last state can be closer to the previous one.
        let index = step.row.index;
        let from_first = index - *first.get_or_insert(index);
        if !from_first.is_multiple_of(every) {
            continue;
        }
        check_contacts(&recording.world, &step).map_err(|why| recording.invalid(&why))?;
        frames.push(step)?;
    }
    let floating = recording.floating();
    let Recording { world, run, .. } = recording;
    let mut film = Film::new(&world, &run.model, floating, frames.all())?;
    film.every = every;
    film.takeover = first.and_then(|first| takeover(&path, first, every));
    film.title = heading(&run.scene, &run.changed);
    film.variant = variant(&run);
    film.facts = facts(run);
    Ok(Some(film))
}

/// Command that takes over from a row of `table`, in its folder.
fn takeover(table: &Path, first: u64, every: u64) -> Option<Takeover> {
    let name = table.file_name()?.to_str()?;
    Some(Takeover { command: format!("tumble run --live --from {name} --at"), first, every })
}

/// Checks that contacts refer to existing bodies and pieces.
fn check_contacts(world: &World, step: &IntervalRows) -> Result<(), String> {
    match step.contacts.iter().position(|row| !row.is_in(world)) {
        Some(number) => Err(format!(
            "contact {number} of step {} refers to a body or fixed piece that run.json does not \
             have",
            step.row.index
        )),
        None => Ok(()),
    }
}

/// Frames of a film, limited in number and memory.
pub struct Frames<'a> {
    path: &'a Path,
    most: usize,
    frames: Vec<IntervalRows>,
    bytes: usize,
}

impl<'a> Frames<'a> {
    /// Creates an empty list for the rows of `path`, limited to `most`.
    pub fn new(path: &'a Path, most: usize) -> Self {
        Self { path, most, frames: Vec::new(), bytes: 0 }
    }

    /// Adds a frame with its loaded contacts, within the limits of number and memory.
    pub fn push(&mut self, mut frame: IntervalRows) -> Result<(), Failure> {
        let (path, rows, most) = (shown::path(self.path), self.frames.len(), self.most);
        if rows == most {
            return Err(Failure::Input(format!(
                "{path} has more than {most} rows, too many for this picture"
            )));
        }
        let contacts = Arc::make_mut(&mut frame.contacts);
        contacts.retain(is_loaded);
        contacts.shrink_to_fit();
        self.bytes += memory(&frame);
        self.frames.push(frame);
        if self.bytes > MOST_BYTES {
            return Err(Failure::Input(format!(
                "{path}: the first {rows} rows already take {} MB of memory, the limit for a \
                 picture; write fewer rows with --every",
                MOST_BYTES / 1_000_000
            )));
        }
        Ok(())
    }

    /// Returns all frames.
    pub fn all(self) -> Vec<IntervalRows> {
        self.frames
    }
}

/// Memory of a row, bytes. Most of it are its contacts, which can be a thousand.
fn memory(frame: &IntervalRows) -> usize {
    size_of::<IntervalRows>()
        + size_of_val(frame.states.as_slice())
        + size_of_val(frame.contacts.as_slice())
        + size_of_val(frame.joints.as_slice())
}

/// Seed and solver.
fn variant(run: &RunFile) -> String {
    let seed = run.drawn_seed().map_or(String::new(), |seed| format!("seed {seed}, "));
    format!("{seed}{}", run.solver.name)
}

/// Facts of run.json, without the model's constants.
fn facts(run: RunFile) -> Vec<Fact> {
    let seed = run.drawn_seed();
    let mut facts = vec![Fact::new("scene", run.scene)];
    if !run.changed.is_empty() {
        facts.push(Fact::new("changed", run.changed.join(", ")));
    }
    let mut add = |name, value: Option<String>| facts.extend(value.map(|v| Fact::new(name, v)));
    add("seed", seed.map(|seed| seed.to_string()));
    add("solver", Some(run.solver.name));
    add("detection", run.solver.detection);
    add("on failure", run.solver.on_failure);
    add("tolerance", run.solver.tol.map(|tol| format!("{tol:e}")));
    add("iteration limit", run.solver.max_iter.map(|limit| limit.to_string()));
    add("solved to", run.solver.residual.map(|residual| format!("{residual:e} m/s")));
    let overlap = run.largest_overlap_m;
    let depth = if overlap > 0.0 { format!("{overlap:.1e} m") } else { "0 m".to_owned() };
    add("largest overlap", Some(depth));
    add("outcome", (run.outcome != "complete").then_some(run.outcome));
    add("tumble", Some(run.tumble_version));
    facts
}

#[cfg(test)]
#[path = "tests/film.rs"]
mod tests;
