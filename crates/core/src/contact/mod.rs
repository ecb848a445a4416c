//! Contacts: a point of one body against a plane of another, for one step.
//!
//! [`detection`] creates every [`Contact`] anew in each step. A contact holds the data of both
//! bodies that the contact [`law`] needs. The solvers compute its force, and the [`certificate`]
//! checks it.
//!
//! Body A has the point a, rounded by a radius ρ, and body B has the plane n·x = d:
//!
//! ```text
//! w(X) = A_Bᵀ (r_A + A_A a − r_B),   gap φ(X) = n·w − d − ρ                (eq. 4)
//! ```
//!
//! Point and plane are fixed in the frames of their bodies during the step. The result thus rotates
//! with the world, and no plane is special. The ground is a body B that never moves: r_B = 0, A_B =
//! E.
//!
//! Terms, from shape to force:
//!
//! | type | meaning |
//! |---|---|
//! | [`Piece`](crate::geometry::Piece) | convex collision shape, a part of a body or fixed |
//! | `Collider` | collider: a piece with its owner |
//! | [`Feature`](crate::geometry::Feature) | touching vertex, edge or pair of these, by index |
//! | [`ManifoldPoint`](crate::geometry::ManifoldPoint) | geometric contact point of two pieces |
//! | [`Features`] | point, plane and radius of a contact, in the frames of the bodies |
//! | [`ContactKey`] | bodies and features; identifies the contact from step to step |
//! | [`Contact`] | features, law and derived data of one step |
//! | [`Candidates`] | all contacts of a step, and the search for them |
//! | [`ContactForce`](crate::step::ContactForce) | force of a contact in the solution |
//!
//! If both features are round (a vertex or an edge against another), the plane is the tangent plane
//! at k. The gap at k+1 is then the gap of the [features themselves](curved). A plane also touches
//! the ellipsoids and discs of smooth shapes, at the point that is nearest. Equation numbers
//! refer to `docs/formulation.md`.

pub mod adhesion;
mod aside;
mod candidates;
pub mod certificate;
pub(crate) mod collider;
mod collision;
mod cones;
mod contact_builder;
mod contact_filter;
pub mod curved;
pub mod detection;
mod exposure;
mod features;
mod friction_tensor;
mod hidden_parts;
mod key;
mod key_index;
pub mod law;
mod memory;
mod moment;
mod neighbours;
mod owner;
mod partners;
mod placement;
pub mod restitution;
pub mod rounding;
mod shared_edge;
mod slip_offset;
mod surface;
mod terrain_seams;

pub use crate::world::{ContactLaw, Partner, Plane, TurningFriction};
pub use candidates::Candidates;
pub use certificate::{Certificate, Certifier};
pub use contact_builder::{ellipsoid, round};
pub use curved::{CorePair, Curved, EllipsoidPoint};
pub use detection::Detection;
pub use features::Features;
pub use friction_tensor::FrictionTensor;
pub use key::{ContactKey, PairFeatures};
pub use key_index::KeyIndex;
pub use law::Response;
pub(crate) use memory::Memory;
pub use moment::{ContactLoad, MomentScale};
pub use neighbours::Overlap;
pub use slip_offset::InstantMotions;

use crate::geometry::Ellipsoid;
use crate::kinematics::StepMap;
use crate::mechanics::state::Pose;
use crate::mechanics::{RigidBody, State};
use crate::world::World;
use curved::Reach;
use nalgebra::{Matrix3, Vector3};

/// A body and its pose at the start of a step.
pub type PlacedBody<'a> = (&'a RigidBody, &'a Pose);

type PairDetection = (ContactKey, Features, ContactLaw);

/// A point of body A against a plane of body B or of the ground, with the data of the configuration
/// at the start of the step. Vectors are in world axes unless a frame is given.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub struct Contact {
    /// Identity of the contact.
    pub key: ContactKey,
    /// Features in the frames of their bodies.
    pub features: Features,
    /// (t₁, t₂, n) as columns at the start of the step (world).
    pub frame: Matrix3<f64>,
    /// φ at the start of the step (m). It is exactly 0 if it is below the rounding error
    /// ([`rounding::gap`]).
    pub gap: f64,
    /// Part of the gap (m) by which the plane was [moved](Contact::hold_back). The features have the gap
    /// φ + this.
    pub held_gap: f64,
    /// e c_n⁻: smallest parting speed of a contact that [bounces](restitution) (m/s), otherwise 0.
    /// It is negative if the contact was parting and is [struck](Contact::struck).
    pub rebound: f64,
    /// True if the impulse of another contact closes this one in the step. It then bounces although
    /// free flight would not close it.
    pub struck: bool,
    /// o (eq. 38): added to the slip in the law (m/s, world, tangential). Zero unless friction turns in
    /// a run of [`Integrator::Leapfrog`](crate::world::Integrator::Leapfrog).
    pub slip_offset: Vector3<f64>,
    /// o (eq. 43a): added to the angular velocity in the law of the moment (rad/s, world, tangential). Zero unless
    /// rolling that a moment resists turns, in such a run.
    pub turning_offset: Vector3<f64>,
    /// Friction and restitution.
    pub law: ContactLaw,
    /// y = a − ρ A_Aᵀ n: touching point, where forces act (m, frame of A). For two round features
    /// it is farther by half of their gap, so that the order of the bodies does not matter.
    pub lever: Vector3<f64>,
    /// A_A y: vector from A's centre of mass to the touching point (m, world).
    pub arm: Vector3<f64>,
    /// `[y]× A_Aᵀ`: map from an impulse on A (world) to its torque (frame of A) (m).
    pub torque_map: Matrix3<f64>,
    /// Velocity response of the touching point to an impulse.
    pub response: Response,
}

impl Contact {
    /// Creates the contact of `features` between body `a` of the `key` and its partner `b`. `b` is
    /// `None` for the ground.
    #[inline]
    pub fn new(
        key: ContactKey,
        features: Features,
        law: ContactLaw,
        a: PlacedBody<'_>,
        b: Option<PlacedBody<'_>>,
    ) -> Self {
        match features.curved {
            None => Self::from_plane((key, features, law), a, b),
            Some(_) => Self::from_curved((key, features, law), a, b),
        }
    }

    /// Contact of a point and a plane.
    #[inline(always)]
    fn from_plane(
        (key, features, law): PairDetection,
        a: PlacedBody<'_>,
        b: Option<PlacedBody<'_>>,
    ) -> Self {
        let (features, radius) = (Features { curved: None, ..features }, features.radius);
        let gap = |normal: &Vector3<f64>, arm: &Vector3<f64>| {
            let Some((_, other)) = b else {
                // Same operations as for heights of points without a radius, for bitwise equal
                // results.
                let touching = if radius == 0.0 { *arm } else { a.1.rotation * features.point };
                return normal.dot(&(a.1.position + touching)) - features.offset - radius;
            };
            let point = a.1.position + a.1.rotation * features.point;
            let local_point = other.rotation.tr_mul(&(point - other.position));
            features.frame.column(2).dot(&local_point) - features.offset - radius
        };
        Self::assemble((key, features, law), a, b, radius, gap)
    }

    /// Contact of features with a gap of their own.
    #[inline(never)]
    fn from_curved(
        (key, features, law): PairDetection,
        a: PlacedBody<'_>,
        b: Option<PlacedBody<'_>>,
    ) -> Self {
        let (pose, other) = (a.1, b.map(|(_, pose)| pose));
        let features = tangent(features, pose, other);
        let beyond = features.radius + half_gap(&features, pose, other);
        let gap =
            |normal: &Vector3<f64>, _: &Vector3<f64>| gap_between(&features, normal, pose, other);
        Self::assemble((key, features, law), a, b, beyond, gap)
    }

    /// Contact of placed features. Forces act `beyond` (m) from the point. `gap` computes φ (m)
    /// from the normal and A_A y.
    #[inline(always)]
    fn assemble(
        (key, features, law): PairDetection,
        (body, pose): PlacedBody<'_>,
        b: Option<PlacedBody<'_>>,
        beyond: f64,
        gap: impl FnOnce(&Vector3<f64>, &Vector3<f64>) -> f64,
    ) -> Self {
        // Axes and lever of the touching point on A.
        let frame = b.map_or(features.frame, |(_, b)| b.rotation * features.frame);
        let normal = frame.column(2).into_owned();
        let mut lever = features.point;
        if beyond != 0.0 {
            lever -= beyond * pose.rotation.tr_mul(&normal);
        }
        let arm = pose.rotation * lever;
        let torque_map = torque_map_of(&lever, &pose.rotation);
        // W of section 7, per unit mass of A: both bodies, at their attitudes of k.
        let mut response = Response::at_point(body, &torque_map, &frame);
        if let Some((other, other_pose)) = b {
            let arm = pose.position + arm - other_pose.position;
            let lever = other_pose.rotation.tr_mul(&arm);
            let torque_map = torque_map_of(&lever, &other_pose.rotation);
            let share = Response::at_point(other, &torque_map, &frame);
            response = response.plus(&share.times(body.mass() / other.mass()));
        }
        // A gap within its rounding (21) is zero.
        let gap = gap(&normal, &arm);
        let mut noise = rounding::gap(&normal, &pose.position, features.offset, &arm);
        if let Some((_, other)) = b {
            noise += rounding::gap(&normal, &other.position, 0.0, &Vector3::zeros());
        }
        Self {
            key,
            features,
            frame,
            gap: if gap.abs() <= noise { 0.0 } else { gap },
            held_gap: 0.0,
            rebound: 0.0,
            struck: false,
            slip_offset: Vector3::zeros(),
            turning_offset: Vector3::zeros(),
            law,
            lever,
            arm,
            torque_map,
            response,
        }
    }

    /// n at the start of the step (unit, world, from B to A).
    pub fn normal(&self) -> Vector3<f64> {
        self.frame.column(2).into_owned()
    }

    /// Moves the plane, or the feature of B, in a problem of `world` that removes only a
    /// [share](World::removed_share) of a depth, or in which a [small gap](World::touching_gap) counts as
    /// touching.
    pub fn hold_back(&mut self, world: &World) {
        let left = match self.gap {
            gap if gap < 0.0 => (1.0 - world.removed_share()) * gap,
            gap if gap < world.touching_gap() && world.is_window() => gap,
            _ => return,
        };
        self.move_plane(left);
    }

    /// Moves the plane back after [`Contact::hold_back`].
    pub(crate) fn release(&mut self) {
        self.move_plane(-self.held_gap);
    }

    /// Moves the plane, or the feature of B, by `distance` (m) along the normal.
    fn move_plane(&mut self, distance: f64) {
        match &mut self.features.curved {
            Some(Curved::Cores(pair)) => pair.radius += distance,
            None | Some(Curved::Ellipsoid(_)) => self.features.offset += distance,
        }
        self.gap -= distance;
        self.held_gap += distance;
    }

    /// True if a touching feature is curved, so that the features can roll.
    pub fn is_rounded(&self) -> bool {
        self.features.radius > 0.0 || self.features.curved.is_some()
    }

    /// Vector from the centre of B's feature to the centre of A's feature at the start of the step
    /// (m, world). It is along the normal, with the length of the gap plus both radii. Zero unless
    /// both features are round.
    pub fn offset_vector(&self) -> Vector3<f64> {
        let radii = |pair: &CorePair| self.features.radius + pair.radius;
        let pair = self.features.curved.as_ref().and_then(Curved::cores);
        pair.map_or(Vector3::zeros(), |pair| self.normal() * (self.gap + radii(pair)))
    }

    /// φ (eq. 4, 4a) with A at `a` and B at `b` (m). `b` is `None` for the ground.
    pub fn gap_at(&self, a: &Pose, b: Option<&Pose>) -> f64 {
        gap_between(&self.features, &self.normal(), a, b)
    }

    /// φ (eq. 4, 4a) with all bodies at `states` (m); NaN without the states of A or B.
    pub fn gap_in(&self, states: &[State]) -> f64 {
        let pose = |body: usize| states.get(body).map(State::pose);
        match (pose(self.key.body), self.key.partner.body().map(pose)) {
            (Some(a), None) => self.gap_at(&a, None),
            (Some(a), Some(Some(b))) => self.gap_at(&a, Some(&b)),
            _ => f64::NAN,
        }
    }

    /// u (eq. 10, 12): tangential mean slip of the touching point over the step of `h` (s), and the
    /// gap speed φ⁺/h along the normal (m/s, world).
    ///
    /// ```text
    /// u = A_B (E − n nᵀ) (w⁺ − w)/h − (Ω_A − Ω_B) × ρ n + n φ⁺/h           (eq. 10a)
    /// ```
    ///
    /// Here w is the point a in the frame of B, and Ω is the angular velocity of a body over the
    /// step. The slip of a rounded feature combines the motion of its centre and the rotation, so
    /// that rolling has no slip. Two round features use both centres a and b and both rotations:
    ///
    /// ```text
    /// u_t = (E − n nᵀ) ((a⁺ − b⁺) − (a − b))/h − (ρ_A Ω_A + ρ_B Ω_B) × n     (eq. 10b)
    /// ```
    ///
    /// An ellipsoid with the centre c touches the point b of B at k, and y is the vector from c to
    /// this point:
    ///
    /// ```text
    /// u_t = (E − n nᵀ) (((c⁺ − b⁺) − (c − b))/h + Ω_A × y)                   (eq. 10c)
    /// ```
    ///
    /// `a` and `b` are the poses of the two bodies at start and end. `b` is `None` for the ground.
    pub fn motion(&self, a: [&Pose; 2], b: Option<[&Pose; 2]>, map: &StepMap) -> Vector3<f64> {
        let h = map.time_step;
        match &self.features.curved {
            None => {}
            Some(Curved::Cores(pair)) => return self.round_motion(pair, a, b, map),
            Some(Curved::Ellipsoid(one)) => return self.ellipsoid_motion(&one.shape, a, b, map),
        }
        let (normal, radius) = (self.normal(), self.features.radius);
        let mut arm = self.arm;
        if radius > 0.0 {
            arm += radius * normal;
        }
        let before = in_frame(b.map(|b| b[0]), &(a[0].position + arm));
        let after =
            in_frame(b.map(|b| b[1]), &(a[1].position + a[1].rotation * self.features.point));
        let mut moved = after - before;
        if let Some([b, _]) = b {
            moved = b.rotation * moved;
        }
        if radius > 0.0 {
            let relative = turning(a, map) - b.map_or(Vector3::zeros(), |b| turning(b, map));
            moved -= h * radius * relative.cross(&normal);
        }
        let gap = self.features.frame.column(2).dot(&after) - self.features.offset - radius;
        slip_and_gap(&normal, &moved, gap) / h
    }

    /// True if its touching point may move over A.
    pub(crate) fn rolls(&self) -> bool {
        self.features.radius > 0.0 || self.features.curved.is_some()
    }

    /// Point of A whose chord the slip has (m, frame of A): its own point, or the centre of a round one.
    pub(crate) fn centre(&self) -> Vector3<f64> {
        match &self.features.curved {
            None => self.features.point,
            Some(Curved::Cores(pair)) => pair.point(),
            Some(Curved::Ellipsoid(one)) => one.shape.centre,
        }
    }

    /// Point of B whose chord the slip has (m, frame of B): the centre of a round feature, or the point that
    /// `touches` (m, world) with B at `b`.
    pub(crate) fn foot(&self, b: &Pose, touches: &Vector3<f64>) -> Vector3<f64> {
        match &self.features.curved {
            Some(Curved::Cores(pair)) => pair.foot(),
            _ => b.rotation.tr_mul(&(touches - b.position)),
        }
    }

    /// Touching point of A at these poses (m, world).
    pub(crate) fn touching_point(&self, a: &Pose, b: Option<&Pose>) -> Vector3<f64> {
        let Features { point, radius, frame, curved, .. } = &self.features;
        let upright = frame.column(2).into_owned();
        let normal = b.map_or(upright, |b| b.rotation * upright);
        let placed = |point: &Vector3<f64>| a.position + a.rotation * point;
        match curved {
            None => placed(point) - normal * *radius,
            Some(Curved::Ellipsoid(one)) => {
                let toward = one.shape.direction(&plane_in_a(frame, a, b));
                placed(&(one.shape.centre - one.shape.axes * toward)) - normal * *radius
            }
            Some(Curved::Cores(pair)) => {
                let ((share, _), apart) = closest_vector_at(pair, a, b);
                let normal = if apart == Vector3::zeros() { normal } else { apart.normalize() };
                placed(&pair.of_a.at(share)) - normal * *radius
            }
        }
    }

    /// Mean slip over the step `states` → `next` of `world` in the law, with the motion of surfaces and the
    /// [offset](Self::slip_offset) (m/s, world). NaN if a list has no state of one of the bodies.
    pub fn slip(&self, world: &World, states: &[State], next: &[State]) -> Vector3<f64> {
        let poses = |body: usize| Some((states.get(body)?.pose(), next.get(body)?.pose()));
        let b = self.key.partner.body().map(poses);
        let (Some(a), None | Some(Some(_))) = (poses(self.key.body), &b) else {
            return Vector3::repeat(f64::NAN);
        };
        let b = b.flatten();
        let u = self.motion([&a.0, &a.1], b.as_ref().map(|b| [&b.0, &b.1]), &world.step_map());
        u - self.normal() * self.normal().dot(&u) + self.law_offset(world, states)
    }

    /// u of two round features (eq. 10b).
    #[inline(never)]
    fn round_motion(
        &self,
        curved: &CorePair,
        a: [&Pose; 2],
        b: Option<[&Pose; 2]>,
        map: &StepMap,
    ) -> Vector3<f64> {
        let h = map.time_step;
        let apart = |a: &Pose, b: Option<&Pose>| {
            let (point, foot) = (curved.point(), curved.foot());
            let foot = b.map_or(foot, |b| b.position + b.rotation * foot);
            a.position + a.rotation * point - foot
        };
        let normal = self.normal();
        let mut rolling = turning(a, map) * self.features.radius;
        if let Some(b) = b {
            rolling += turning(b, map) * curved.radius;
        }
        let moved = apart(a[1], b.map(|b| b[1])) - apart(a[0], b.map(|b| b[0]));
        let moved = moved - h * rolling.cross(&normal);
        slip_and_gap(&normal, &moved, self.gap_at(a[1], b.map(|b| b[1]))) / h
    }

    /// u of an ellipsoid against a plane (eq. 10c).
    #[inline(never)]
    fn ellipsoid_motion(
        &self,
        one: &Ellipsoid,
        a: [&Pose; 2],
        b: Option<[&Pose; 2]>,
        map: &StepMap,
    ) -> Vector3<f64> {
        let h = map.time_step;
        let centre = |a: &Pose| a.position + a.rotation * one.centre;
        let mut moved = centre(a[1]) - centre(a[0]);
        if let Some([from, to]) = b {
            let touched = a[0].position + self.arm - from.position;
            let foot = from.rotation.tr_mul(&touched);
            moved -= to.position - from.position + to.rotation * foot - from.rotation * foot;
        }
        let beyond = self.arm - a[0].rotation * one.centre;
        moved += h * turning(a, map).cross(&beyond);
        slip_and_gap(&self.normal(), &moved, self.gap_at(a[1], b.map(|b| b[1]))) / h
    }
}

/// φ (eq. 4, 4a) of `features` with the `normal` at the start of the step (m).
fn gap_between(features: &Features, normal: &Vector3<f64>, a: &Pose, b: Option<&Pose>) -> f64 {
    let Features { point, radius, frame, offset, curved } = features;
    let (point, width) = match curved {
        None => (point, 0.0),
        Some(Curved::Cores(pair)) => {
            let (_, trajectory) = closest_vector_at(pair, a, b);
            return Reach::new(&trajectory, normal).length - radius - pair.radius;
        }
        Some(Curved::Ellipsoid(one)) => {
            (&one.shape.centre, one.width(&plane_in_a(frame, a, b)).length)
        }
    };
    let w = in_frame(b, &(a.position + a.rotation * point));
    frame.column(2).dot(&w) - offset - radius - width
}

/// Normal of the plane with `frame` in the frame of A.
fn plane_in_a(frame: &Matrix3<f64>, a: &Pose, b: Option<&Pose>) -> Vector3<f64> {
    let normal = frame.column(2).into_owned();
    a.rotation.tr_mul(&b.map_or(normal, |b| b.rotation * normal))
}

/// `[y]× Aᵀ`: map from an impulse at y (world) to its torque (frame of the body). y is in m in the
/// frame of the body, and A is the rotation of the body.
#[inline]
pub fn torque_map_of(y: &Vector3<f64>, a: &Matrix3<f64>) -> Matrix3<f64> {
    y.cross_matrix() * a.transpose()
}

/// Ω: angular velocity over the step (rad/s, world).
fn turning([from, to]: [&Pose; 2], map: &StepMap) -> Vector3<f64> {
    map.rate_between(&from.rotation, &to.rotation)
}

/// Tangential part of `moved` plus the gap along the normal (m).
#[inline]
fn slip_and_gap(normal: &Vector3<f64>, moved: &Vector3<f64>, gap: f64) -> Vector3<f64> {
    moved - normal * normal.dot(moved) + normal * gap
}

/// Two round features with the point, frame and offset of the tangent plane, with A at `a` and B at
/// `b`. Other features are returned unchanged. Coincident cores keep their frame.
fn tangent(features: Features, a: &Pose, b: Option<&Pose>) -> Features {
    /// Relative distance below which the direction between the cores is undefined.
    const NO_DIRECTION: f64 = 1e-8;
    let Some(Curved::Cores(mut curved)) = features.curved else { return features };
    let (shares, trajectory) = closest_vector_at(&curved, a, b);
    curved.shares = shares;
    let (point, foot, distance) = (curved.point(), curved.foot(), trajectory.norm());
    let frame = if distance > NO_DIRECTION * (features.radius + curved.radius) {
        let normal = trajectory / distance;
        frame_along(&b.map_or(normal, |b| b.rotation.tr_mul(&normal)))
    } else {
        features.frame
    };
    let offset = frame.column(2).dot(&foot) + curved.radius;
    Features { point, frame, offset, curved: Some(Curved::Cores(curved)), ..features }
}

/// Half of the gap between two round features (m), negative if they overlap; 0 for a point against
/// a plane.
fn half_gap(features: &Features, a: &Pose, b: Option<&Pose>) -> f64 {
    let Some(curved) = features.curved.as_ref().and_then(Curved::cores) else { return 0.0 };
    let distance = closest_vector_at(curved, a, b).1.norm();
    0.5 * (distance - features.radius - curved.radius)
}

/// Parameters of the closest points along the cores of two round features, and the vector from B's
/// to A's (m, world).
fn closest_vector_at(curved: &CorePair, a: &Pose, b: Option<&Pose>) -> ((f64, f64), Vector3<f64>) {
    let of_a = curved.of_a.moved(&a.rotation, &a.position);
    let of_b = b.map_or(curved.of_b, |b| curved.of_b.moved(&b.rotation, &b.position));
    curved::closest_vector(&of_a, &of_b)
}

/// (t₁, t₂, n), right-handed. t₁ is the projection of the axis along which n is smallest.
pub(crate) fn frame_along(normal: &Vector3<f64>) -> Matrix3<f64> {
    let axis = Vector3::ith(normal.iamin(), 1.0);
    let first = (axis - normal * normal.dot(&axis)).normalize();
    Matrix3::from_columns(&[first, normal.cross(&first), *normal])
}

/// Transforms a world point to the frame of B.
#[inline]
fn in_frame(b: Option<&Pose>, point: &Vector3<f64>) -> Vector3<f64> {
    match b {
        Some(b) => b.rotation.tr_mul(&(point - b.position)),
        None => *point,
    }
}
