//! A trajectory file as a film: what the library calls things, in the words of the pictures.

use super::outcome::Failure;
use super::physics::Physics;
use super::run_file::{RunFile, SolverSettings, heading};
use super::shown;
use super::source::{Source, TrajectoryFile};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use tumble::film::{load, pose, status};
use tumble::simulation::energy;
use tumble::simulation::trajectory::TrajectoryRow;
use tumble_pictures::{Body, Contact, Fact, Film, Frame, Ground, Partner, Place};

/// Memory that the rows of a picture may take: a million rows of a box that lies on all its
/// corners.
const MOST_BYTES: usize = 1_200_000_000;

/// All rows in memory, to be drawn; more than `most` of them, or more than memory should hold, are
/// refused. `None` if `interrupt` is raised.
pub fn film(
    mut file: TrajectoryFile<'_>,
    most: usize,
    interrupt: &AtomicBool,
) -> Result<Option<Film>, Failure> {
    let mut frames = Frames::new(file.path(), most);
    while let Some(row) = file.next_row()? {
        if interrupt.load(Ordering::Relaxed) {
            return Ok(None);
        }
        frames.push(frame(&file.source.physics, &row))?;
    }
    let frames = frames.all();
    let Source { physics, floating, run } = file.source;
    let world = &physics.world;
    let ground = world.ground().filter(|_| !floating);
    Ok(Some(Film {
        title: run.as_ref().map_or(String::new(), title),
        facts: run.map_or(Vec::new(), facts),
        time_step: world.time_step(),
        gravity: *world.gravity(),
        friction: world.friction(),
        ground: ground.map(|plane| Ground { normal: *plane.normal(), offset: plane.offset() }),
        fixed: Vec::new(),
        bodies: vec![body(&physics)],
        frames,
    }))
}

/// The frames of a film, as many as are allowed.
pub struct Frames<'a> {
    path: &'a Path,
    most: usize,
    frames: Vec<Frame>,
    bytes: usize,
}

impl<'a> Frames<'a> {
    /// None yet, of the rows of `path`, and never more than `most`.
    pub fn new(path: &'a Path, most: usize) -> Self {
        Self { path, most, frames: Vec::new(), bytes: 0 }
    }

    /// Adds a frame, unless there are too many or memory should not hold it.
    pub fn push(&mut self, frame: Frame) -> Result<(), Failure> {
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
                "{path}: a picture of its first {rows} rows alone takes {} MB of memory; no more \
                 is allowed",
                MOST_BYTES / 1_000_000
            )));
        }
        Ok(())
    }

    /// All that were added.
    pub fn all(self) -> Vec<Frame> {
        self.frames
    }
}

/// Bytes that a row takes: most of them are its contacts, of which there may be a thousand.
fn memory(frame: &Frame) -> usize {
    size_of::<Frame>()
        + size_of_val(frame.poses.as_slice())
        + size_of_val(frame.contacts.as_slice())
}

fn body(physics: &Physics) -> Body {
    let body = physics.body();
    Body {
        name: String::new(),
        mass: body.mass(),
        inertia: *body.inertia(),
        points: body.contact_points().iter().map(|point| point.position).collect(),
        pieces: Vec::new(),
        load: load(&physics.load),
    }
}

fn frame(physics: &Physics, row: &TrajectoryRow) -> Frame {
    let (world, body) = (&physics.world, physics.body());
    let count = row.carrying.len();
    let contact = |point: usize| Contact {
        body: 0,
        partner: Partner::Ground,
        place: Place::Corner(point),
        force: row.force(point),
        carries_force: row.carrying[point],
        slacks: [row.step[3 * count + point], row.step[4 * count + point]],
        multiplier: row.step[5 * count + point],
    };
    Frame {
        index: row.index,
        time: row.time,
        poses: vec![pose(&row.state)],
        kinetic: energy::kinetic(world, body, &row.state),
        potential: energy::potential(world, body, &row.state),
        contacts: (0..count).map(contact).filter(says_something).collect(),
        status: status(row.status),
        iterations: row.iterations,
        residual: row.residual,
    }
}

/// Whether a row says of a point that it touches: it may carry a force, or has a number.
fn says_something(contact: &Contact) -> bool {
    let Contact { force, slacks: [s1, s2], multiplier, .. } = contact;
    contact.carries_force || force.iter().chain([s1, s2, multiplier]).any(|number| *number != 0.0)
}

/// Scene, seed and solver.
fn title(run: &RunFile) -> String {
    let seed = if run.start.random { format!("seed {}, ", run.seed) } else { String::new() };
    format!("{}, {seed}{}", heading(&run.scene, &run.changed), run.solver.name)
}

/// What run.json says besides the model's constants.
fn facts(run: RunFile) -> Vec<Fact> {
    let seed = run.start.random.then_some(run.seed);
    let mut facts = settings_facts(run.scene, &run.changed, seed, run.solver);
    if run.outcome != "complete" {
        facts.push(Fact::new("outcome", run.outcome));
    }
    facts.push(Fact::new("tumble", run.tumble_version));
    facts
}

/// What was asked for.
pub fn settings_facts(
    scene: String,
    changed: &[String],
    seed: Option<u32>,
    solver: SolverSettings,
) -> Vec<Fact> {
    let mut facts = vec![Fact::new("scene", scene)];
    if !changed.is_empty() {
        facts.push(Fact::new("changed", changed.join(", ")));
    }
    facts.extend(seed.map(|seed| Fact::new("seed", seed.to_string())));
    facts.push(Fact::new("solver", solver.name));
    let mut add = |name, value: Option<String>| facts.extend(value.map(|v| Fact::new(name, v)));
    add("formulation", solver.formulation);
    add("detection", solver.detection);
    add("on failure", solver.on_failure);
    add("tolerance", solver.tol.map(|tol| format!("{tol:e}")));
    add("iteration limit", solver.max_iter.map(|limit| limit.to_string()));
    facts
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::physics;
    use tumble::mechanics::State;
    use tumble::step::StepStatus;

    /// A row of a body whose `count` points all touch.
    fn row(count: usize) -> TrajectoryRow {
        TrajectoryRow {
            index: 0,
            time: 0.0,
            state: State::from_vector(&nalgebra::SVector::from_element(0.5)),
            step: vec![1.0; 6 * count],
            carrying: vec![true; count],
            status: StepStatus::Converged,
            iterations: 1,
            residual: 0.0,
            restitution_share: 1.0,
        }
    }

    /// A million rows of a box fit; of a body of a thousand points, only some thousand do.
    #[test]
    fn memory_counts_the_points_that_touch() {
        let cube = physics::of_tutorial().unwrap();
        let of = |count| memory(&frame(&cube, &row(count)));
        assert!(of(8) * 1_000_000 <= MOST_BYTES, "{}", of(8));
        let rows = MOST_BYTES / of(1000);
        assert!((5_000..20_000).contains(&rows), "{rows}");
        // A point without a number is not kept.
        let still =
            TrajectoryRow { step: vec![0.0; 6000], carrying: vec![false; 1000], ..row(1000) };
        assert!(memory(&frame(&cube, &still)) < of(8));
    }
}
