//! Input data of all pictures.

use crate::shape::FilmPiece;
use nalgebra::{Isometry3, Matrix3, Translation3, UnitQuaternion, Vector3};
use serde::Serialize;
use std::fmt;

/// Motion of bodies, with everything needed to draw it. SI units, world frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Film {
    /// Heading: scene, seed and solver; empty if unknown.
    pub title: String,
    /// Further information for the page.
    pub facts: Vec<Fact>,
    /// Command that takes over from a frame; `None` if unknown.
    pub takeover: Option<Takeover>,
    /// Time step h (s).
    pub time_step: f64,
    /// Number of steps between frames.
    pub every: u64,
    /// Gravity g (m/s²).
    pub gravity: Vector3<f64>,
    /// Friction coefficient μ.
    pub friction: f64,
    /// Ground plane. `None` if there is none.
    pub ground: Option<FilmGround>,
    /// Fixed objects besides the ground.
    pub fixed: Vec<FilmFixed>,
    /// Bodies, at least one.
    pub bodies: Vec<FilmBody>,
    /// Joints between bodies and to the world.
    pub joints: Vec<FilmJoint>,
    /// Frames, at least one, at equal time intervals. The last has no step.
    pub frames: Vec<FilmFrame>,
}

/// Name and value of a parameter, as text.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Fact {
    /// Name.
    pub name: String,
    /// Value with unit.
    pub value: String,
}

/// Plane n · x = d.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FilmGround {
    /// Unit normal n, towards the bodies.
    pub normal: Vector3<f64>,
    /// Offset d (m).
    pub offset: f64,
}

/// Fixed object, world frame.
#[derive(Debug, Clone, PartialEq)]
pub struct FilmFixed {
    /// Name; may be empty.
    pub name: String,
    /// Geometry.
    pub pieces: Vec<FilmPiece>,
}

/// Rigid body.
#[derive(Debug, Clone, PartialEq)]
pub struct FilmBody {
    /// Name; may be empty.
    pub name: String,
    /// Mass m (kg).
    pub mass: f64,
    /// Inertia I (kg m²), body frame.
    pub inertia: Matrix3<f64>,
    /// Contact points (m), body frame, relative to the centre of mass.
    pub points: Vec<Vector3<f64>>,
    /// Geometry in the body frame, relative to the centre of mass. If it is empty, the points are
    /// drawn. Eight corners of a box, x fastest, are drawn as a box.
    pub pieces: Vec<FilmPiece>,
    /// Load besides gravity and contact.
    pub load: FilmLoad,
    /// Red, green and blue. `None` selects a colour of the palette.
    pub colour: Option<[u8; 3]>,
    /// Text shown at the body, and in headings instead of its name; may be empty.
    pub label: String,
}

/// Joint between two bodies, or between a body and the world.
#[derive(Debug, Clone, PartialEq)]
pub struct FilmJoint {
    /// Name.
    pub name: String,
    /// Index into [`Film::bodies`].
    pub body: usize,
    /// Index of the other body. `None` for the world.
    pub other: Option<usize>,
    /// Anchor on the body (m), body frame.
    pub anchor: Vector3<f64>,
    /// Anchor on the other body (m), in its frame, or in the world.
    pub other_anchor: Vector3<f64>,
    /// Unit vector of the axis, body frame. `None` for a joint without axis.
    pub axis: Option<Vector3<f64>>,
    /// True if the joint only rotates about its axis.
    pub turns: bool,
    /// True if the joint only translates along its axis.
    pub slides: bool,
}

/// State of a joint in a frame, and its loads in the step from there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FilmTie {
    /// Displacement along its axis (m).
    pub place: f64,
    /// Angle about its axis (rad).
    pub angle: f64,
    /// Magnitude of the force on the body (N).
    pub force: f64,
    /// Torque on the body about its axis (N m).
    pub torque: f64,
}

/// Force and torque over time as knots of time t (s) and value. An empty list is zero load.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FilmLoad {
    /// Force (N).
    pub force: Vec<(f64, Vector3<f64>)>,
    /// Torque (N m), body frame.
    pub torque: Vec<(f64, Vector3<f64>)>,
    /// Point of application of the force (m), body frame.
    pub point: Vector3<f64>,
}

/// State at one time, and the step from there to the next.
#[derive(Debug, Clone, PartialEq)]
pub struct FilmFrame {
    /// Step index k.
    pub index: u64,
    /// Time t (s).
    pub time: f64,
    /// Pose and velocity of each body.
    pub poses: Vec<FilmPose>,
    /// Kinetic energy of all bodies at k (J).
    pub kinetic: f64,
    /// Gravitational potential energy relative to the origin (J).
    pub potential: f64,
    /// Contacts of the step. Those without force may be omitted.
    pub contacts: Vec<FilmContact>,
    /// States of [`Film::joints`].
    pub ties: Vec<FilmTie>,
    /// Result of the step.
    pub status: Status,
    /// Number of solver iterations.
    pub iterations: u32,
    /// Residual of the exact contact laws (m/s).
    pub residual: f64,
}

/// Pose and velocity of a body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FilmPose {
    /// Centre of mass r (m).
    pub position: Vector3<f64>,
    /// Attitude, body to world.
    pub attitude: UnitQuaternion<f64>,
    /// Velocity v (m/s).
    pub velocity: Vector3<f64>,
    /// Angular velocity ω (rad/s), body frame.
    pub spin: Vector3<f64>,
}

/// Contact point of a body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FilmContact {
    /// Index into [`Film::bodies`].
    pub body: usize,
    /// Contact partner.
    pub partner: FilmPartner,
    /// Position (m), world frame.
    pub point: Vector3<f64>,
    /// Identifier of the contact among those of its pair, constant across steps.
    pub key: u64,
    /// Force on the body (N), world frame. The partner receives the opposite force.
    pub force: Vector3<f64>,
    /// Unit normal away from the partner, world frame.
    pub normal: Vector3<f64>,
    /// Friction coefficient μ of the pair.
    pub friction: f64,
}

/// Contact partner of a body.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum FilmPartner {
    /// The ground, [`Film::ground`].
    Ground,
    /// Index into [`Film::fixed`].
    Fixed(usize),
    /// Index into [`Film::bodies`].
    Body(usize),
}

/// Result of a step, in order of increasing severity.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Status {
    /// No step.
    End,
    /// Free flight without a contact problem.
    Free,
    /// Converged from the first initial point.
    Converged,
    /// Converged from another initial point.
    Retried,
    /// Solved by another solver.
    Fallback,
    /// Solved in shorter steps.
    Substepped,
    /// Solved but unphysical: a body rotates too far, or energy increases.
    Wild,
    /// Not converged within the tolerance.
    Failed,
}

/// Command that takes over from a frame of a film.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Takeover {
    /// Command, which the step index of the frame completes.
    pub command: String,
    /// Step index of the first frame.
    pub first: u64,
    /// Number of steps between frames.
    pub every: u64,
}

impl Film {
    /// Frames with a step: all but the last.
    pub(crate) fn steps(&self) -> &[FilmFrame] {
        self.frames.split_last().map_or(&[], |(_, steps)| steps)
    }

    /// Time between frames (s).
    #[must_use]
    pub fn frame_time(&self) -> f64 {
        self.every as f64 * self.time_step
    }

    /// True if a step is not converged.
    #[must_use]
    pub fn has_failed(&self) -> bool {
        self.frames.iter().any(|frame| frame.status == Status::Failed)
    }

    /// Label of body `b`, or else its name.
    pub(crate) fn name(&self, b: usize) -> String {
        let FilmBody { name, label, .. } = &self.bodies[b];
        match [label, name].into_iter().find(|word| !word.is_empty()) {
            Some(word) => word.clone(),
            None => format!("body {b}"),
        }
    }

    /// Height of a point above the ground (m), or its z coordinate without ground.
    pub(crate) fn height(&self, place: &Vector3<f64>) -> f64 {
        self.ground.as_ref().map_or(place.z, |ground| ground.height(place))
    }

    /// Height of the lowest point of body `b` in `frame` (m).
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

    /// Transform from the world to the ground's frame; identity without ground.
    pub(crate) fn to_ground(&self) -> Isometry3<f64> {
        self.ground.map_or(Isometry3::identity(), |ground| ground.frame())
    }

    /// True if contacts are possible.
    pub(crate) fn may_touch(&self) -> bool {
        self.ground.is_some() || self.bodies.len() > 1
    }

    /// Ground other than the plane z = 0.
    pub(crate) fn inclined_ground(&self) -> Option<&FilmGround> {
        self.ground.as_ref().filter(|ground| !ground.is_level())
    }
}

impl FilmJoint {
    /// True if the joint holds body `b` on either side.
    pub(crate) fn is_of(&self, b: usize) -> bool {
        self.body == b || self.other == Some(b)
    }
}

impl FilmContact {
    /// True if body `b` is on either side of the contact.
    pub(crate) fn is_of(&self, b: usize) -> bool {
        self.body == b || self.partner == FilmPartner::Body(b)
    }

    /// Force on body `b` (N).
    pub(crate) fn force_on(&self, b: usize) -> Vector3<f64> {
        if self.body == b { self.force } else { -self.force }
    }
}

impl FilmBody {
    /// Largest distance of its geometry from the centre of mass (m).
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
    /// Creates a fact.
    pub fn new(name: impl Into<String>, value: impl Into<String>) -> Self {
        Self { name: name.into(), value: value.into() }
    }
}

impl FilmGround {
    /// Signed distance n · x − d (m).
    pub(crate) fn height(&self, place: &Vector3<f64>) -> f64 {
        self.normal.dot(place) - self.offset
    }

    fn is_level(&self) -> bool {
        self.normal == Vector3::z() && self.offset == 0.0
    }

    /// Angle between the plane and the horizontal (degrees).
    pub(crate) fn slope(&self) -> f64 {
        self.normal.z.clamp(-1.0, 1.0).acos().to_degrees()
    }

    /// Transform from the world to a frame in which the plane is z = 0. It uses the smallest
    /// rotation. A horizontal plane through the origin keeps the world frame.
    fn frame(&self) -> Isometry3<f64> {
        let turn = UnitQuaternion::rotation_between(&self.normal, &Vector3::z())
            .unwrap_or_else(|| UnitQuaternion::from_euler_angles(std::f64::consts::PI, 0.0, 0.0));
        let foot = turn * (self.offset * self.normal);
        Isometry3::from_parts(Translation3::from(-foot), turn)
    }
}

impl Status {
    /// All statuses in order.
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

    /// Name of the status.
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
            // Near the vertical the arc cosine loses half the digits, which a picture does not
            // show.
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
