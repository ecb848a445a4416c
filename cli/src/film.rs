//! Conversion of a recording to a film with the names of the scene.

use super::outcome::Failure;
use super::recording::Recording;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use tumble_core::contact::Partner;
use tumble_core::world::World;
use tumble_film::{Cast, Keys, Role};
use tumble_model::shown;
use tumble_scene::output::tables::TableStep;
use tumble_scene::run_file::{RunFile, heading};
use tumble_view::{Fact, Film, FilmFrame, Takeover};

/// Largest memory for the rows of a picture, bytes: a million rows of a box with contacts at all
/// its corners.
const MOST_BYTES: usize = 1_500_000_000;

/// Reads all rows for drawing. More than `most` rows, or too much memory, are refused. Returns
/// `None` if `interrupt` is raised.
pub fn film(
    mut recording: Recording<'_>,
    most: usize,
    interrupt: &AtomicBool,
) -> Result<Option<Film>, Failure> {
    let (path, mut keys) = (recording.steps_file(), Keys::new());
    let every = recording.kept().every;
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
        check_contacts(&recording.world, &step).map_err(|why| recording.odd(&why))?;
        frames.push(tumble_film::frame(&recording.world, &step, &mut keys))?;
    }
    let floating = recording.floating();
    let Recording { world, loads, run, .. } = recording;
    let model = &run.model;
    let bodies: Vec<_> = model.bodies.iter().map(Role::from).collect();
    let fixed: Vec<_> = model.fixed_names().map(String::as_str).collect();
    let joints: Vec<_> = model.joints.iter().map(|joint| joint.name.as_str()).collect();
    let (bodies, fixed, joints) = (&bodies, &fixed, &joints);
    let cast = Cast { world: &world, bodies, fixed, joints, loads: &loads, floating };
    let mut film = tumble_film::film(cast, frames.all());
    tumble_film::dress(model, &mut film)?;
    film.every = every;
    film.takeover = first.and_then(|first| takeover(&path, first, every));
    film.title = title(&run);
    film.facts = facts(run);
    Ok(Some(film))
}

/// Command that takes over from a row of `table`, in its folder.
fn takeover(table: &Path, first: u64, every: u64) -> Option<Takeover> {
    let name = table.file_name()?.to_str()?;
    Some(Takeover { command: format!("tumble run --live --from {name} --at"), first, every })
}

/// Checks that contacts refer to existing bodies and pieces.
fn check_contacts(world: &World, step: &TableStep) -> Result<(), String> {
    let (bodies, fixed) = (world.bodies().len(), world.fixed_count());
    for (number, row) in step.contacts.iter().enumerate() {
        let is_there = match row.partner {
            Partner::Ground => world.ground().is_some(),
            Partner::Fixed(index) => index < fixed,
            Partner::Body(index) => index < bodies && index != row.body,
        };
        if row.body >= bodies || !is_there {
            return Err(format!(
                "contact {number} of step {} refers to a body or fixed piece that run.json does \
                 not have",
                step.row.index
            ));
        }
    }
    Ok(())
}

/// Frames of a film, limited in number and memory.
pub struct Frames<'a> {
    path: &'a Path,
    most: usize,
    frames: Vec<FilmFrame>,
    bytes: usize,
}

impl<'a> Frames<'a> {
    /// Creates an empty list for the rows of `path`, limited to `most`.
    pub fn new(path: &'a Path, most: usize) -> Self {
        Self { path, most, frames: Vec::new(), bytes: 0 }
    }

    /// Adds a frame, within the limits of number and memory.
    pub fn push(&mut self, frame: FilmFrame) -> Result<(), Failure> {
        let (path, rows, most) = (shown::path(self.path), self.frames.len(), self.most);
        if rows == most {
            return Err(Failure::Input(format!(
                "{path} has more than {most} rows, too many for this picture"
            )));
        }
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
    pub fn all(self) -> Vec<FilmFrame> {
        self.frames
    }
}

/// Memory of a row, bytes. Most of it are its contacts, which can be a thousand.
fn memory(frame: &FilmFrame) -> usize {
    size_of::<FilmFrame>()
        + size_of_val(frame.poses.as_slice())
        + size_of_val(frame.contacts.as_slice())
        + size_of_val(frame.ties.as_slice())
}

/// Title with scene, seed and solver.
fn title(run: &RunFile) -> String {
    let seed = run.drawn_seed().map_or(String::new(), |seed| format!("seed {seed}, "));
    format!("{}, {seed}{}", heading(&run.scene, &run.changed), run.solver.name)
}

/// Facts of run.json, without the model's constants.
fn facts(run: RunFile) -> Vec<Fact> {
    let seed = run.drawn_seed();
    let mut facts = vec![Fact::new("scene", run.scene)];
    if !run.changed.is_empty() {
        facts.push(Fact::new("changed", run.changed.join(", ")));
    }
    let mut add = |name, value: Option<String>| facts.extend(value.map(|v| Fact::new(name, v)));
    let solver = run.solver;
    add("seed", seed.map(|seed| seed.to_string()));
    add("solver", Some(solver.name));
    add("detection", solver.detection);
    add("on failure", solver.on_failure);
    add("tolerance", solver.tol.map(|tol| format!("{tol:e}")));
    add("iteration limit", solver.max_iter.map(|limit| limit.to_string()));
    add("solved to", solver.residual.map(|residual| format!("{residual:e} m/s")));
    add("largest overlap", Some(format!("{:.1e} m", run.largest_overlap_m)));
    add("outcome", (run.outcome != "complete").then_some(run.outcome));
    add("tumble", Some(run.tumble_version));
    facts
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{UnitQuaternion, Vector3};
    use tumble_view::{FilmContact, FilmPartner, FilmPose, Status};

    /// A frame of a body with `count` contacts.
    fn frame(count: usize) -> FilmFrame {
        let (zero, attitude) = (Vector3::zeros(), UnitQuaternion::identity());
        let contact = |key: usize| FilmContact {
            body: 0,
            partner: FilmPartner::Ground,
            point: zero,
            key: key as u64,
            force: Vector3::z(),
            normal: Vector3::z(),
            friction: 0.5,
        };
        FilmFrame {
            index: 0,
            time: 0.0,
            poses: vec![FilmPose { position: zero, attitude, velocity: zero, spin: zero }],
            kinetic: 0.0,
            potential: 0.0,
            contacts: (0..count).map(contact).collect(),
            ties: Vec::new(),
            status: Status::Converged,
            iterations: 1,
            residual: 0.0,
        }
    }

    /// A million rows of a box fit; of a body with a thousand contacts, only some thousand rows do.
    #[test]
    fn memory_counts_the_contacts() {
        let of = |count| memory(&frame(count));
        assert!(of(8) * 1_000_000 <= MOST_BYTES, "{}", of(8));
        let rows = MOST_BYTES / of(1000);
        assert!((5_000..20_000).contains(&rows), "{rows}");
    }
}
