//! Runs as films: conversion of the library's types to those of `tumble-view`.

#![deny(unsafe_code)]

mod looks;
mod terrain;

pub use looks::dress;

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use std::collections::BTreeMap;
use tumble_core::contact::{PairFeatures, Partner};
use tumble_core::geometry::{self, Smooth};
use tumble_core::joint::{Axis, Joint};
use tumble_core::mechanics::{Load, RigidBody, State};
use tumble_core::simulation::energy;
use tumble_core::step::StepStatus;
use tumble_core::world::World;
use tumble_model::BodyModel;
use tumble_scene::output::tables::{ContactRow, JointRow, TableStep};
use tumble_view as pictures;
use tumble_view::{
    Film, FilmBody, FilmContact, FilmFixed, FilmFrame, FilmGround, FilmHull, FilmPiece, FilmPose,
    FilmTie, Status,
};

/// A world with the names and looks of its parts.
#[derive(Debug, Clone, Copy)]
pub struct Cast<'a> {
    /// The world.
    pub world: &'a World,
    /// Names and colours of its bodies.
    pub bodies: &'a [Role<'a>],
    /// Names of its fixed pieces.
    pub fixed: &'a [&'a str],
    /// Names of its joints.
    pub joints: &'a [&'a str],
    /// External load of each body.
    pub loads: &'a [Load],
    /// True if nothing can touch, even if the world has a ground.
    pub floating: bool,
}

/// Appearance of a body in a picture.
#[derive(Debug, Clone, Copy, Default)]
pub struct Role<'a> {
    /// Name.
    pub name: &'a str,
    /// Text beside the body; may be empty.
    pub label: &'a str,
    /// Red, green and blue; `None` for the colour of the palette.
    pub colour: Option<[u8; 3]>,
}

impl<'a> From<&'a BodyModel> for Role<'a> {
    fn from(body: &'a BodyModel) -> Self {
        let label = body.label.as_ref().map_or("", |label| label.0.as_str());
        Self { name: &body.name, label, colour: body.colour.map(|colour| colour.0) }
    }
}

/// Film of `frames`, without title and facts.
#[must_use]
pub fn film(cast: Cast<'_>, frames: Vec<FilmFrame>) -> Film {
    let Cast { world, .. } = cast;
    let fixed = cast.fixed.iter().zip(world.fixed());
    let names = cast.fixed.iter().skip(world.fixed().len());
    let terrains =
        names.zip(world.terrains()).map(|(name, of)| terrain::terrain(name, &of.terrain));
    let mut film = Film {
        title: String::new(),
        facts: Vec::new(),
        takeover: None,
        time_step: world.time_step(),
        every: 1,
        gravity: *world.gravity(),
        friction: world.friction(),
        ground: None,
        fixed: fixed
            .map(|(name, fixed)| FilmFixed {
                name: (*name).to_owned(),
                pieces: vec![piece(&fixed.piece)],
            })
            .chain(terrains)
            .collect(),
        bodies: bodies(cast),
        joints: cast
            .world
            .joints()
            .iter()
            .zip(cast.joints)
            .map(|(of, name)| joint(of, name))
            .collect(),
        frames,
    };
    let ground = world.ground().filter(|_| !cast.floating);
    let ground = ground.map(|plane| FilmGround { normal: *plane.normal(), offset: plane.offset() });
    film.ground = ground.filter(|ground| is_in_reach(ground, &film, world));
    film
}

fn bodies(cast: Cast<'_>) -> Vec<FilmBody> {
    let of = |((body, role), all): ((&RigidBody, &Role<'_>), &Load)| {
        let pieces: Vec<_> = body.pieces().iter().map(piece).collect();
        let points = body.contact_points().iter().map(|point| point.position);
        FilmBody {
            name: role.name.to_owned(),
            mass: body.mass(),
            inertia: *body.inertia(),
            // The contact points of a body with pieces are their corners.
            points: if pieces.is_empty() { points.collect() } else { Vec::new() },
            pieces,
            load: load(all),
            colour: role.colour,
            label: role.label.to_owned(),
        }
    };
    cast.world.bodies().iter().zip(cast.bodies).zip(cast.loads).map(of).collect()
}

/// A joint with its name.
fn joint(joint: &Joint, name: &str) -> pictures::FilmJoint {
    // True if only the last of three axes is free.
    let is_last = |axes: &[Axis; 3]| {
        axes[..2].iter().all(|axis| *axis == Axis::Locked) && axes[2] != Axis::Locked
    };
    let (slides, turns) = (is_last(joint.linear()), is_last(joint.angular()));
    let frame = &joint.frames()[0];
    pictures::FilmJoint {
        name: name.to_owned(),
        body: joint.body(),
        other: joint.other(),
        anchor: frame.anchor,
        other_anchor: joint.frames()[1].anchor,
        axis: (slides || turns).then(|| frame.rotation().column(2).into_owned()),
        turns,
        slides,
    }
}

/// Coordinates and loads of a joint in a step.
fn tie(row: &JointRow) -> FilmTie {
    FilmTie {
        place: row.place[2],
        angle: row.turns[2],
        force: row.force.norm(),
        torque: row.torque[2],
    }
}

/// Number of corners on a drawn disc, and on each circle of latitude of an ellipsoid.
const DISC_CORNERS: usize = 40;

/// A convex piece: its core is a point, a segment or a polyhedron. A smooth shape becomes a
/// polyhedron with many faces.
pub(crate) fn piece(piece: &geometry::Piece) -> FilmPiece {
    let (core, radius) = (piece.core(), piece.radius());
    let drawn = |smooth: &Smooth| {
        let hull = geometry::Hull::from_points(&smooth.samples(DISC_CORNERS)).ok()?;
        Some(FilmPiece::Hull(FilmHull { name: Some(name(smooth)), ..polyhedron(&hull, 0.0) }))
    };
    if let Some(drawn) = piece.smooth().and_then(drawn) {
        return drawn;
    }
    match *core.vertices() {
        [centre] => FilmPiece::Sphere { centre, radius },
        [from, to] => FilmPiece::Capsule { ends: [from, to], radius },
        _ => FilmPiece::Hull(polyhedron(core, radius)),
    }
}

fn polyhedron(core: &geometry::Hull, radius: f64) -> FilmHull {
    let face =
        |face: usize| core.face_loop(face).iter().map(|corner| corner.vertex as usize).collect();
    let faces = (0..core.faces().len()).map(face).collect();
    FilmHull { vertices: core.vertices().to_vec(), faces, radius, name: None }
}

/// Description of a smooth shape.
fn name(smooth: &Smooth) -> String {
    let size =
        |length: f64| format!("{length:.4}").trim_end_matches('0').trim_end_matches('.').to_owned();
    let radius = |disc: &geometry::Ellipsoid| size(disc.axes.column(0).norm());
    match smooth {
        Smooth::Cylinder([from, to]) => {
            let length = size((to.centre - from.centre).norm());
            format!("cylinder of radius {} m and length {length} m", radius(from))
        }
        Smooth::Cone { base, apex: (_, apex) } => {
            let height = size((apex - base.centre).norm());
            format!("cone of radius {} m and height {height} m", radius(base))
        }
        Smooth::Ellipsoid(one) => {
            let [a, b, c] = [0, 1, 2].map(|axis| size(one.axes.column(axis).norm()));
            format!("ellipsoid with half axes {a} × {b} × {c} m")
        }
    }
}

/// Numbers of contact keys, in the order of their first appearance.
pub type Keys = BTreeMap<(usize, Option<PairFeatures>), u64>;

/// A step of any number of bodies of `world` as a frame.
#[must_use]
pub fn frame(world: &World, step: &TableStep, keys: &mut Keys) -> FilmFrame {
    let is_felt = |contact: &&ContactRow| contact.force != Vector3::zeros();
    let mut contact = |row: &ContactRow| {
        let next = keys.len() as u64;
        let key = *keys.entry((row.key.point, row.key.pair)).or_insert(next);
        FilmContact {
            body: row.body,
            partner: partner(row.partner),
            point: row.point,
            key,
            force: row.force,
            normal: row.normal,
            friction: world.friction_between(row.body, row.partner),
        }
    };
    let row = &step.row;
    FilmFrame {
        iterations: row.iterations,
        residual: row.residual,
        contacts: step.contacts.iter().filter(is_felt).map(&mut contact).collect(),
        ties: step.joints.iter().map(tie).collect(),
        ..still(world, &step.states, row.index, row.time, row.status)
    }
}

/// A frame of bodies at `states` that touch nothing, at the step `index` and `time` (s).
#[must_use]
pub fn still(world: &World, states: &[State], index: u64, time: f64, end: StepStatus) -> FilmFrame {
    let each = |energy: fn(&World, &RigidBody, &State) -> f64| {
        let bodies = world.bodies().iter().zip(states);
        bodies.map(|(body, state)| energy(world, body, state)).sum()
    };
    FilmFrame {
        index,
        time,
        poses: states.iter().map(pose).collect(),
        kinetic: each(energy::kinetic),
        potential: each(energy::potential),
        contacts: Vec::new(),
        ties: Vec::new(),
        status: status(end),
        iterations: 0,
        residual: 0.0,
    }
}

fn partner(partner: Partner) -> pictures::FilmPartner {
    match partner {
        Partner::Ground => pictures::FilmPartner::Ground,
        Partner::Fixed(index) => pictures::FilmPartner::Fixed(index),
        Partner::Body(index) => pictures::FilmPartner::Body(index),
    }
}

/// External load of a body.
fn load(load: &Load) -> pictures::FilmLoad {
    pictures::FilmLoad {
        force: load.force.knots().to_vec(),
        torque: load.torque.knots().to_vec(),
        point: *load.point(),
    }
}

/// Pose and velocity of a body.
fn pose(state: &State) -> FilmPose {
    let [w, x, y, z] = state.attitude.into();
    FilmPose {
        position: state.position,
        // The digits of the file are kept. They have length 1.
        attitude: UnitQuaternion::new_unchecked(Quaternion::new(w, x, y, z)),
        velocity: state.velocity,
        spin: state.spin,
    }
}

/// Status of a step.
fn status(status: StepStatus) -> Status {
    match status {
        StepStatus::Free => Status::Free,
        StepStatus::Converged => Status::Converged,
        StepStatus::Retried => Status::Retried,
        StepStatus::Fallback => Status::Fallback,
        StepStatus::Substepped => Status::Substepped,
        StepStatus::Wild => Status::Wild,
        StepStatus::Failed => Status::Failed,
        StepStatus::End => Status::End,
    }
}

/// True if the distance of the motion to the ground is at most its size. A picture with a farther
/// ground would show nothing else.
fn is_in_reach(ground: &FilmGround, film: &Film, world: &World) -> bool {
    let reach: Vec<f64> = world.bodies().iter().map(|body| body.reach()).collect();
    let still = film.fixed.iter().flat_map(|fixed| &fixed.pieces).flat_map(|piece| match piece {
        FilmPiece::Hull(hull) => hull.vertices.clone(),
        FilmPiece::Mesh(mesh) => mesh.vertices.clone(),
        FilmPiece::Sphere { centre, .. } => vec![*centre],
        FilmPiece::Capsule { ends, .. } => ends.to_vec(),
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Every face has the corners that lie in its plane, whatever the piece is.
    #[test]
    fn pieces_are_drawn_as_they_are() {
        let half = Vector3::new(0.3, 0.2, 0.1);
        let FilmPiece::Hull(cuboid) = piece(&geometry::Piece::cuboid(half).unwrap()) else {
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
        assert_eq!(ball, FilmPiece::Sphere { centre: Vector3::zeros(), radius: 0.5 });
        let FilmPiece::Capsule { ends: [a, b], radius } =
            piece(&geometry::Piece::capsule(0.4, 0.1).unwrap())
        else {
            panic!("a capsule is one")
        };
        assert_eq!(((b - a).norm(), radius), (0.8, 0.1));
    }
}
