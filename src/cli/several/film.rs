//! The tables of a run of several bodies as a film.

use super::model::{BodyModel, Model};
use super::run_file::SeveralRun;
use super::tables::RunTables;
use crate::cli::film::{Frames, load, pose, settings_facts, status};
use crate::cli::outcome::Failure;
use crate::cli::run_file::heading;
use nalgebra::Vector3;
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, Ordering};
use tumble::contact::{PairFeatures, Partner};
use tumble::geometry;
use tumble::mechanics::{Load, RigidBody};
use tumble::simulation::tables::{ContactRow, TableStep};
use tumble::world::World;
use tumble_pictures::{
    self as pictures, Body, Contact, Fact, Film, Fixed, Frame, Ground, Hull, Piece, Place,
};

/// All steps in memory, to be drawn; more than `most` of them, or more than memory should hold, are
/// refused. `None` if `interrupt` is raised.
pub fn film(
    mut tables: RunTables,
    most: usize,
    interrupt: &AtomicBool,
) -> Result<Option<Film>, Failure> {
    let (path, mut keys) = (tables.steps_file(), Keys::new());
    let mut frames = Frames::new(&path, most);
    while let Some(step) = tables.next_step()? {
        if interrupt.load(Ordering::Relaxed) {
            return Ok(None);
        }
        check_contacts(&tables.world, &step).map_err(|why| tables.odd(&why))?;
        frames.push(frame(step, &mut keys))?;
    }
    let RunTables { run, world, loads, .. } = tables;
    let frames = frames.all();
    let fixed = run.model.fixed.iter().zip(world.fixed()).map(|(model, fixed)| Fixed {
        name: model.name.clone(),
        pieces: vec![piece(&fixed.piece)],
    });
    let mut film = Film {
        title: title(&run),
        facts: Vec::new(),
        time_step: world.time_step(),
        gravity: *world.gravity(),
        friction: world.friction(),
        ground: None,
        fixed: fixed.collect(),
        bodies: bodies(&run.model, &world, &loads),
        frames,
    };
    film.ground =
        Some(Ground { normal: *world.ground().normal(), offset: world.ground().offset() })
            .filter(|ground| world.has_ground() && is_in_reach(ground, &film, &world));
    film.facts = facts(run);
    Ok(Some(film))
}

fn bodies(model: &Model, world: &World, loads: &[Load]) -> Vec<Body> {
    let of = |((body, model), all): ((&RigidBody, &BodyModel), &Load)| {
        let pieces: Vec<_> = body.pieces().iter().map(piece).collect();
        let points = body.contact_points().iter().map(|point| point.position);
        Body {
            name: model.name.clone(),
            mass: body.mass(),
            inertia: *body.inertia(),
            // Of a body of pieces these are the corners of its pieces.
            points: if pieces.is_empty() { points.collect() } else { Vec::new() },
            pieces,
            load: load(all),
        }
    };
    world.bodies().iter().zip(&model.bodies).zip(loads).map(of).collect()
}

/// A convex piece: its core is a point, a segment or a polyhedron.
fn piece(piece: &geometry::Piece) -> Piece {
    let (core, radius) = (piece.core(), piece.radius());
    match *core.vertices() {
        [centre] => Piece::Sphere { centre, radius },
        [from, to] => Piece::Capsule { ends: [from, to], radius },
        _ => {
            let face = |face: usize| {
                core.face_loop(face).iter().map(|corner| corner.vertex as usize).collect()
            };
            let faces = (0..core.faces().len()).map(face).collect();
            Piece::Hull(Hull { vertices: core.vertices().to_vec(), faces, radius })
        }
    }
}

/// The keys of contacts as numbers, in the order in which they appear.
type Keys = BTreeMap<(usize, Option<PairFeatures>), u64>;

fn frame(step: TableStep, keys: &mut Keys) -> Frame {
    let row = step.row;
    let is_felt = |contact: &&ContactRow| contact.force != Vector3::zeros();
    let mut contact = |row: &ContactRow| {
        let next = keys.len() as u64;
        let key = *keys.entry((row.key.point, row.key.pair)).or_insert(next);
        Contact {
            body: row.body,
            partner: partner(row.partner),
            place: Place::At { point: row.point, key },
            force: row.force,
            carries_force: true,
            // Of the tutorial's program, which has one body.
            slacks: [0.0; 2],
            multiplier: 0.0,
        }
    };
    Frame {
        index: row.index,
        time: row.time,
        poses: step.states.iter().map(pose).collect(),
        contacts: step.contacts.iter().filter(is_felt).map(&mut contact).collect(),
        status: status(row.status),
        iterations: row.iterations,
        residual: row.residual,
    }
}

fn partner(partner: Partner) -> pictures::Partner {
    match partner {
        Partner::Ground => pictures::Partner::Ground,
        Partner::Fixed(index) => pictures::Partner::Fixed(index),
        Partner::Body(index) => pictures::Partner::Body(index),
    }
}

/// Contacts must be of what there is.
fn check_contacts(world: &World, step: &TableStep) -> Result<(), String> {
    let (bodies, fixed) = (world.bodies().len(), world.fixed().len());
    for (number, row) in step.contacts.iter().enumerate() {
        let is_there = match row.partner {
            Partner::Ground => world.has_ground(),
            Partner::Fixed(index) => index < fixed,
            Partner::Body(index) => index < bodies && index != row.body,
        };
        if row.body >= bodies || !is_there {
            return Err(format!(
                "contact {number} of step {} is between things that are not in run.json",
                step.row.index
            ));
        }
    }
    Ok(())
}

/// Whether the motion comes as near to the ground as it is large: a ground that is farther away is
/// as good as none, and a picture with it would show nothing else.
fn is_in_reach(ground: &Ground, film: &Film, world: &World) -> bool {
    let reach: Vec<f64> = world.bodies().iter().map(|body| body.reach()).collect();
    let still = film.fixed.iter().flat_map(|fixed| &fixed.pieces).flat_map(|piece| match piece {
        Piece::Hull(hull) => hull.vertices.clone(),
        Piece::Sphere { centre, .. } => vec![*centre],
        Piece::Capsule { ends, .. } => ends.to_vec(),
    });
    let moving = film.frames.iter().flat_map(|frame| &frame.poses).map(|pose| pose.position);
    let (mut low, mut high) = (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY));
    let mut lowest = f64::INFINITY;
    for place in still.chain(moving) {
        (low, high) = (low.inf(&place), high.sup(&place));
        lowest = lowest.min(ground.normal.dot(&place) - ground.offset);
    }
    let size = (high - low).norm() + 2.0 * reach.into_iter().fold(0.0, f64::max);
    lowest <= size
}

/// Scene, seed and solver.
fn title(run: &SeveralRun) -> String {
    let seed = if run.drawn { format!("seed {}, ", run.seed) } else { String::new() };
    format!("{}, {seed}{}", heading(&run.scene, &run.changed), run.solver.name)
}

/// What run.json says besides the model's constants.
fn facts(run: SeveralRun) -> Vec<Fact> {
    let seed = run.drawn.then_some(run.seed);
    let mut facts = settings_facts(run.scene, &run.changed, seed, run.solver);
    facts.push(Fact::new("largest overlap", format!("{:.1e} m", run.largest_overlap_m)));
    if run.outcome != "complete" {
        facts.push(Fact::new("outcome", run.outcome));
    }
    facts.push(Fact::new("tumble", run.tumble_version));
    facts
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every face has the corners that lie in its plane, whatever the piece is.
    #[test]
    fn pieces_are_drawn_as_they_are() {
        let half = Vector3::new(0.3, 0.2, 0.1);
        let Piece::Hull(cuboid) = piece(&geometry::Piece::cuboid(half).unwrap()) else {
            panic!("a box is a hull")
        };
        assert_eq!((cuboid.vertices.len(), cuboid.faces.len(), cuboid.radius), (8, 6, 0.0));
        for face in &cuboid.faces {
            let in_plane = |axis: usize| {
                face.iter().all(|&v| cuboid.vertices[v][axis] == cuboid.vertices[face[0]][axis])
            };
            assert!(face.len() == 4 && (0..3).any(in_plane), "{face:?}");
        }
        let ball = piece(&geometry::Piece::sphere(0.5).unwrap());
        assert_eq!(ball, Piece::Sphere { centre: Vector3::zeros(), radius: 0.5 });
        let Piece::Capsule { ends: [a, b], radius } =
            piece(&geometry::Piece::capsule(0.4, 0.1).unwrap())
        else {
            panic!("a capsule is one")
        };
        assert_eq!(((b - a).norm(), radius), (0.8, 0.1));
    }
}
