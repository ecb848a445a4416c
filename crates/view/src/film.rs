//! What pictures are made of.

use crate::shape::FilmPiece;
use nalgebra::{Isometry3, Matrix3, Translation3, UnitQuaternion, Vector3};
use serde::Serialize;
use std::fmt;

/// The motion of bodies, with what is needed to draw it. SI units, the world's frame.
///
/// Of one body the corners are told apart, with their forces and multipliers; of several, the
/// plots show one body at a time.
#[derive(Debug, Clone, PartialEq)]
pub struct Film {
    /// For a heading: scene, seed and solver; empty where nothing is known of them.
    pub title: String,
    /// What is known of the motion besides, for its page.
    pub facts: Vec<Fact>,
    /// h, s.
    pub time_step: f64,
    /// Steps from a frame to the next one.
    pub every: u64,
    /// g, m/s².
    pub gravity: Vector3<f64>,
    /// μ.
    pub friction: f64,
    /// `None` where the bodies move freely.
    pub ground: Option<FilmGround>,
    /// What stands still besides the ground.
    pub fixed: Vec<FilmFixed>,
    /// At least one.
    pub bodies: Vec<FilmBody>,
    /// What ties them to each other and to the world.
    pub joints: Vec<FilmJoint>,
    /// At least one, a time step apart; the last has no step.
    pub frames: Vec<FilmFrame>,
}

/// A parameter, its value and its unit in words.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Fact {
    /// What it is.
    pub name: String,
    /// How much, and of what.
    pub value: String,
}

/// A plane: the points x with n · x = d.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FilmGround {
    /// n, of length 1, to the side where the bodies are.
    pub normal: Vector3<f64>,
    /// d, m.
    pub offset: f64,
}

/// A thing that does not move, world frame.
#[derive(Debug, Clone, PartialEq)]
pub struct FilmFixed {
    /// What it is called; may be empty.
    pub name: String,
    /// What it consists of.
    pub pieces: Vec<FilmPiece>,
}

/// A rigid body.
#[derive(Debug, Clone, PartialEq)]
pub struct FilmBody {
    /// What it is called; may be empty.
    pub name: String,
    /// m, kg.
    pub mass: f64,
    /// I, kg m², body frame.
    pub inertia: Matrix3<f64>,
    /// Its corners, or other points that can touch, m, body frame, from the centre of mass.
    pub points: Vec<Vector3<f64>>,
    /// What it consists of, body frame, from the centre of mass. Without any, its points are
    /// drawn: as a box where they are eight corners of one, x fastest.
    pub pieces: Vec<FilmPiece>,
    /// What pushes it besides gravity and contact.
    pub load: FilmLoad,
    /// Red, green and blue; `None` for one of a few in turn.
    pub colour: Option<[u8; 3]>,
    /// What is written at it, and in headings instead of its name; may be empty.
    pub label: String,
}

/// What ties two bodies, or a body and the world.
#[derive(Debug, Clone, PartialEq)]
pub struct FilmJoint {
    /// What it is called.
    pub name: String,
    /// Which of [`Film::bodies`].
    pub body: usize,
    /// The other one; `None` for the world.
    pub other: Option<usize>,
    /// Where it holds the body, m, body frame.
    pub anchor: Vector3<f64>,
    /// The direction of its axis, of length 1, body frame; `None` without one.
    pub axis: Option<Vector3<f64>>,
    /// Whether it turns about its axis alone.
    pub turns: bool,
    /// Whether it slides along its axis alone.
    pub slides: bool,
}

/// Where a joint is in a frame, and what it carries in the step from there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FilmTie {
    /// Along its axis, m.
    pub place: f64,
    /// About its axis, rad.
    pub angle: f64,
    /// The force on the body, N.
    pub force: f64,
    /// The torque on the body about its axis, N m.
    pub torque: f64,
}

/// A force and a torque over time, as knots: t (s) and the value there. No knots are no load.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FilmLoad {
    /// N.
    pub force: Vec<(f64, Vector3<f64>)>,
    /// N m, body frame.
    pub torque: Vec<(f64, Vector3<f64>)>,
    /// Where the force acts, m, body frame.
    pub point: Vector3<f64>,
}

/// A moment of a film, and the step from there to the next.
#[derive(Debug, Clone, PartialEq)]
pub struct FilmFrame {
    /// k.
    pub index: u64,
    /// t, s.
    pub time: f64,
    /// Where each body is and how it moves.
    pub poses: Vec<FilmPose>,
    /// The kinetic energy of all bodies at k, J.
    pub kinetic: f64,
    /// Their energy in gravity, counted from the origin, J.
    pub potential: f64,
    /// What touches in the step; contacts without a force may be left out.
    pub contacts: Vec<FilmContact>,
    /// Of each of [`Film::joints`].
    pub ties: Vec<FilmTie>,
    /// How the step ended.
    pub status: Status,
    /// Iterations of the solver.
    pub iterations: u32,
    /// By how much the step misses the exact laws, m/s.
    pub residual: f64,
}

/// Where a body is and how it moves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FilmPose {
    /// r, m: the centre of mass.
    pub position: Vector3<f64>,
    /// Body → world.
    pub attitude: UnitQuaternion<f64>,
    /// v, m/s.
    pub velocity: Vector3<f64>,
    /// ω, rad/s, body frame.
    pub spin: Vector3<f64>,
}

/// A point of a body in contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FilmContact {
    /// Which of [`Film::bodies`].
    pub body: usize,
    /// What it touches.
    pub partner: FilmPartner,
    /// Where.
    pub place: FilmPlace,
    /// On the body, N, world frame; the partner gets the opposite.
    pub force: Vector3<f64>,
    /// Whether the point presses in the step: α.
    pub carries_force: bool,
    /// Of complementarity, s1 (N m), and of friction, s2 (W).
    pub slacks: [f64; 2],
    /// Of the slip speed, λ, m/s.
    pub multiplier: f64,
}

/// What a body touches.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum FilmPartner {
    /// [`Film::ground`].
    Ground,
    /// One of [`Film::fixed`].
    Fixed(usize),
    /// One of [`Film::bodies`].
    Body(usize),
}

/// Where a contact is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FilmPlace {
    /// At one of [`FilmBody::points`].
    Corner(usize),
    /// Anywhere else.
    At {
        /// World frame, m.
        point: Vector3<f64>,
        /// Tells the contacts of a pair apart, and is the same from step to step.
        key: u64,
    },
}

/// How a step ended; the later ones are the more conspicuous.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Status {
    /// There is no step.
    End,
    /// In free flight: no problem was solved.
    Free,
    /// From the solver's first start.
    Converged,
    /// From a later start.
    Retried,
    /// With another solver's answer.
    Fallback,
    /// Solved in shorter steps.
    Substepped,
    /// Solved, but it turns a body too far or makes energy.
    Wild,
    /// Without an answer within the tolerance.
    Failed,
}

impl Film {
    /// The steps: the frames but the last.
    pub(crate) fn steps(&self) -> &[FilmFrame] {
        self.frames.split_last().map_or(&[], |(_, steps)| steps)
    }

    /// The time from a frame to the next one, s.
    #[must_use]
    pub fn frame_time(&self) -> f64 {
        self.every as f64 * self.time_step
    }

    /// Whether a step has no answer within the tolerance.
    #[must_use]
    pub fn has_failed(&self) -> bool {
        self.frames.iter().any(|frame| frame.status == Status::Failed)
    }

    /// Whether it is about the corners of a single body.
    pub(crate) fn is_single(&self) -> bool {
        let mut contacts = self.frames.iter().flat_map(|frame| &frame.contacts);
        self.bodies.len() == 1
            && self.fixed.is_empty()
            && self.joints.is_empty()
            && self.bodies[0].pieces.is_empty()
            && contacts.all(|contact| contact.corner().is_some())
    }

    /// What body `b` is called: its label, or its name.
    pub(crate) fn name(&self, b: usize) -> String {
        let FilmBody { name, label, .. } = &self.bodies[b];
        match [label, name].into_iter().find(|word| !word.is_empty()) {
            Some(word) => word.clone(),
            None => format!("body {b}"),
        }
    }

    /// Where the points of body `b` are in `frame`, m.
    pub(crate) fn points(&self, b: usize, frame: &FilmFrame) -> impl Iterator<Item = Vector3<f64>> {
        let pose = &frame.poses[b];
        let rotation = pose.attitude.to_rotation_matrix();
        self.bodies[b].points.iter().map(move |point| pose.position + rotation * point)
    }

    /// The height of a place above the ground, or along z where there is none, m.
    pub(crate) fn height(&self, place: &Vector3<f64>) -> f64 {
        self.ground.as_ref().map_or(place.z, |ground| ground.height(place))
    }

    /// The height of the lowest point of body `b` in `frame`, m.
    pub(crate) fn lowest_height(&self, b: usize, frame: &FilmFrame) -> f64 {
        let (body, pose) = (&self.bodies[b], &frame.poses[b]);
        let lowest = |core: &[Vector3<f64>], radius: f64| {
            let heights = core.iter().map(|p| self.height(&(pose.position + pose.attitude * p)));
            heights.fold(f64::INFINITY, f64::min) - radius
        };
        if body.pieces.is_empty() {
            return lowest(&body.points, 0.0);
        }
        let pieces = body.pieces.iter().map(|piece| lowest(piece.core(), piece.radius()));
        pieces.fold(f64::INFINITY, f64::min)
    }

    /// World → the frame of the ground, which is the world's where there is none.
    pub(crate) fn to_ground(&self) -> Isometry3<f64> {
        self.ground.map_or(Isometry3::identity(), |ground| ground.frame())
    }

    /// Whether there is anything to touch.
    pub(crate) fn may_touch(&self) -> bool {
        self.ground.is_some() || self.bodies.len() > 1
    }

    /// The ground where it is not the plane z = 0.
    pub(crate) fn inclined_ground(&self) -> Option<&FilmGround> {
        self.ground.as_ref().filter(|ground| !ground.is_level())
    }
}

impl FilmJoint {
    /// Whether it holds body `b`, from either side.
    pub(crate) fn is_of(&self, b: usize) -> bool {
        self.body == b || self.other == Some(b)
    }
}

impl FilmContact {
    /// Which corner of the body it is at.
    pub(crate) fn corner(&self) -> Option<usize> {
        match self.place {
            FilmPlace::Corner(corner) => Some(corner),
            FilmPlace::At { .. } => None,
        }
    }

    /// Whether it is a contact of body `b`, from either side.
    pub(crate) fn is_of(&self, b: usize) -> bool {
        self.body == b || self.partner == FilmPartner::Body(b)
    }

    /// The force on body `b`, N.
    pub(crate) fn force_on(&self, b: usize) -> Vector3<f64> {
        if self.body == b { self.force } else { -self.force }
    }
}

impl FilmBody {
    /// How far it reaches from its centre of mass, m.
    pub(crate) fn reach(&self) -> f64 {
        let points = self.points.iter().map(|point| point.norm());
        let ends = |piece: &FilmPiece| {
            let core = piece.core().iter().map(|point| point.norm()).fold(0.0, f64::max);
            core + piece.radius()
        };
        points.chain(self.pieces.iter().map(ends)).fold(0.0, f64::max)
    }
}

impl Fact {
    /// A fact in words.
    pub fn new(name: impl Into<String>, value: impl Into<String>) -> Self {
        Self { name: name.into(), value: value.into() }
    }
}

impl FilmGround {
    /// n · x − d, m.
    pub(crate) fn height(&self, place: &Vector3<f64>) -> f64 {
        self.normal.dot(place) - self.offset
    }

    fn is_level(&self) -> bool {
        self.normal == Vector3::z() && self.offset == 0.0
    }

    /// The angle between the plane and the horizon, degrees.
    pub(crate) fn slope(&self) -> f64 {
        self.normal.z.clamp(-1.0, 1.0).acos().to_degrees()
    }

    /// World → a frame in which the plane is z = 0: by the smallest turn, so that a level
    /// plane through the origin keeps the world's.
    fn frame(&self) -> Isometry3<f64> {
        let turn = UnitQuaternion::rotation_between(&self.normal, &Vector3::z())
            .unwrap_or_else(|| UnitQuaternion::from_euler_angles(std::f64::consts::PI, 0.0, 0.0));
        let foot = turn * (self.offset * self.normal);
        Isometry3::from_parts(Translation3::from(-foot), turn)
    }
}

impl Status {
    /// All of them, in their order.
    pub(crate) const ALL: [Self; 8] = [
        Self::End,
        Self::Free,
        Self::Converged,
        Self::Retried,
        Self::Fallback,
        Self::Substepped,
        Self::Wild,
        Self::Failed,
    ];

    /// In one word.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::End => "end",
            Self::Free => "free",
            Self::Converged => "converged",
            Self::Retried => "retried",
            Self::Fallback => "fallback",
            Self::Substepped => "substepped",
            Self::Wild => "wild",
            Self::Failed => "failed",
        }
    }
}

impl fmt::Display for Status {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point3;

    #[test]
    fn the_ground_s_frame_has_heights_for_z() {
        let place = Vector3::new(1.0, -2.0, 0.5);
        for normal in [[0.3, -0.2, 0.9], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [1e-9, 0.0, -1.0]] {
            let ground = FilmGround { normal: Vector3::from(normal).normalize(), offset: -1.5 };
            let placed = ground.frame() * Point3::from(place);
            // Near the vertical the arc cosine has half the digits, more than a picture shows.
            assert!((placed.z - ground.height(&place)).abs() < 1e-7, "{normal:?}");
        }
        let level = FilmGround { normal: Vector3::z(), offset: 0.0 };
        assert_eq!(level.frame() * Point3::from(place), Point3::from(place));
    }

    #[test]
    fn a_slope_is_an_angle() {
        let ground = FilmGround { normal: Vector3::new(0.6, 0.0, 0.8), offset: 0.0 };
        assert!((ground.slope() - 36.869_897_645_844).abs() < 1e-9);
        let place = ground.frame() * Point3::new(0.8, 0.0, -0.6);
        assert!((place - Point3::new(1.0, 0.0, 0.0)).norm() < 1e-15, "x falls with the slope");
    }
}
