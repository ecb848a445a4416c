//! What pictures are made of.

use nalgebra::{Isometry3, Matrix3, Translation3, UnitQuaternion, Vector3};
use serde::Serialize;
use std::fmt;

/// The motion of bodies, with what is needed to draw it. SI units, the world's frame.
///
/// A film may have several bodies; the pictures show the first.
#[derive(Debug, Clone, PartialEq)]
pub struct Film {
    /// For a heading: scene, seed and solver; empty where nothing is known of them.
    pub title: String,
    /// What is known of the motion besides, for its page.
    pub facts: Vec<Fact>,
    /// h, s.
    pub time_step: f64,
    /// g, m/s².
    pub gravity: Vector3<f64>,
    /// μ.
    pub friction: f64,
    /// `None` where the bodies move freely.
    pub ground: Option<Ground>,
    /// At least one.
    pub bodies: Vec<Body>,
    /// At least one, a time step apart; the last has no step.
    pub frames: Vec<Frame>,
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
pub struct Ground {
    /// n, of length 1, to the side where the bodies are.
    pub normal: Vector3<f64>,
    /// d, m.
    pub offset: f64,
}

/// A rigid body.
#[derive(Debug, Clone, PartialEq)]
pub struct Body {
    /// m, kg.
    pub mass: f64,
    /// I, kg m², body frame.
    pub inertia: Matrix3<f64>,
    /// Its corners, or other points that can touch, m, body frame, from the centre of mass.
    pub points: Vec<Vector3<f64>>,
    /// What pushes it besides gravity and contact.
    pub load: Load,
}

/// A force and a torque over time, as knots: t (s) and the value there. No knots are no load.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Load {
    /// N.
    pub force: Vec<(f64, Vector3<f64>)>,
    /// N m, body frame.
    pub torque: Vec<(f64, Vector3<f64>)>,
    /// Where the force acts, m, body frame.
    pub point: Vector3<f64>,
}

/// A moment of a film, and the step from there to the next.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// k.
    pub index: u64,
    /// t, s.
    pub time: f64,
    /// Where each body is and how it moves.
    pub poses: Vec<Pose>,
    /// The points that touch in the step, by body and point; points without a force may be
    /// left out.
    pub contacts: Vec<Contact>,
    /// How the step ended.
    pub status: Status,
    /// Iterations of the solver.
    pub iterations: u32,
    /// By how much the step misses the exact laws, m/s.
    pub residual: f64,
}

/// Where a body is and how it moves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
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
pub struct Contact {
    /// Which of [`Film::bodies`].
    pub body: usize,
    /// Which of [`Body::points`].
    pub point: usize,
    /// On the body, N.
    pub force: Vector3<f64>,
    /// Whether the point presses in the step: α.
    pub carries_force: bool,
    /// Of complementarity, s1 (N m), and of friction, s2 (W).
    pub slacks: [f64; 2],
    /// Of the slip speed, λ, m/s.
    pub multiplier: f64,
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
    /// Without an answer within the tolerance.
    Failed,
}

impl Film {
    /// The steps: the frames but the last.
    pub(crate) fn steps(&self) -> &[Frame] {
        self.frames.split_last().map_or(&[], |(_, steps)| steps)
    }

    /// Whether a step has no answer within the tolerance.
    #[must_use]
    pub fn has_failed(&self) -> bool {
        self.frames.iter().any(|frame| frame.status == Status::Failed)
    }

    /// The body that is shown.
    pub(crate) fn body(&self) -> &Body {
        &self.bodies[0]
    }

    /// Where the points of the body are in `frame`, m.
    pub(crate) fn points(&self, frame: &Frame) -> impl Iterator<Item = Vector3<f64>> {
        let pose = frame.pose();
        let rotation = pose.attitude.to_rotation_matrix();
        self.body().points.iter().map(move |point| pose.position + rotation * point)
    }

    /// The height of a place above the ground, or along z where there is none, m.
    pub(crate) fn height(&self, place: &Vector3<f64>) -> f64 {
        self.ground.as_ref().map_or(place.z, |ground| ground.height(place))
    }

    /// The height of the lowest point of the body in `frame`, m.
    pub(crate) fn lowest_height(&self, frame: &Frame) -> f64 {
        self.points(frame).map(|point| self.height(&point)).fold(f64::INFINITY, f64::min)
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
    pub(crate) fn inclined_ground(&self) -> Option<&Ground> {
        self.ground.as_ref().filter(|ground| !ground.is_level())
    }
}

impl Frame {
    /// The pose of the body that is shown.
    pub(crate) fn pose(&self) -> &Pose {
        &self.poses[0]
    }

    /// The contacts of the body that is shown.
    pub(crate) fn touches(&self) -> impl Iterator<Item = &Contact> {
        self.contacts.iter().filter(|contact| contact.body == 0)
    }
}

impl Body {
    /// How far it reaches from its centre of mass, m.
    pub(crate) fn reach(&self) -> f64 {
        self.points.iter().map(|point| point.norm()).fold(0.0, f64::max)
    }
}

impl Fact {
    /// A fact in words.
    pub fn new(name: impl Into<String>, value: impl Into<String>) -> Self {
        Self { name: name.into(), value: value.into() }
    }
}

impl Ground {
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
    pub(crate) const ALL: [Self; 6] =
        [Self::End, Self::Free, Self::Converged, Self::Retried, Self::Fallback, Self::Failed];

    /// In one word.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::End => "end",
            Self::Free => "free",
            Self::Converged => "converged",
            Self::Retried => "retried",
            Self::Fallback => "fallback",
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
            let ground = Ground { normal: Vector3::from(normal).normalize(), offset: -1.5 };
            let placed = ground.frame() * Point3::from(place);
            // Near the vertical the arc cosine has half the digits, more than a picture shows.
            assert!((placed.z - ground.height(&place)).abs() < 1e-7, "{normal:?}");
        }
        let level = Ground { normal: Vector3::z(), offset: 0.0 };
        assert_eq!(level.frame() * Point3::from(place), Point3::from(place));
    }

    #[test]
    fn a_slope_is_an_angle() {
        let ground = Ground { normal: Vector3::new(0.6, 0.0, 0.8), offset: 0.0 };
        assert!((ground.slope() - 36.869_897_645_844).abs() < 1e-9);
        let place = ground.frame() * Point3::new(0.8, 0.0, -0.6);
        assert!((place - Point3::new(1.0, 0.0, 0.0)).norm() < 1e-15, "x falls with the slope");
    }
}
