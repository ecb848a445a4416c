//! Placement of loaded contacts: whether a contact is where two pieces touch.
//!
//! The certificate judges how well the equations of a set of contacts are solved. This module judges
//! the set, from the shapes alone. With the pieces a and b of a loaded contact at the end of the step,
//! its normal n, its gap φ and its touching point x,
//!
//! ```text
//! s = min_a n·x − max_b n·x,
//! e = max( |s − φ| − δ_φ,   d_a(x) − δ_x,   d_b(x) − δ_x ),                (eq. 18g)
//! δ_φ = 10⁻⁷ ℓ + (ϑ ℓ + h|u_t|) ϑ,   δ_x = δ_φ + h|u_t| + [ϑ ℓ],   ϑ = h (|ω_A| + |ω_B|)
//! ```
//!
//! s is the separation of the pieces along the normal, from their support functions. d is the height
//! of the point above a piece. ℓ is the reach of the smaller piece. Points and planes are fixed to
//! their bodies within a step, so rotation and slip are allowed for. The term in brackets is the way
//! of a rounded feature that rolls. A contact on a [hidden](super::exposure) face has the error ℓ. A continued distance (4b) may be smaller than s.
//!
//! A bouncing contact does not close at the end of the step. It is judged at the start, with δ of
//! first order in ϑ.

use super::collider::{Collider, Colliders, PieceOwner, placed, size};
use super::exposure::{Exposure, ExposureScratch};
use super::partners::Partners;
use super::{Contact, Curved, Partner};
use crate::geometry::Piece;
use crate::mechanics::Pose;
use crate::world::World;
use nalgebra::Vector3;

/// Rounding and drift of gaps and places, as a fraction of the smaller piece.
const ROUNDING: f64 = 1e-7;

/// Poses of the bodies at both ends of a step.
pub(super) struct PlacementCheck<'a> {
    pub(super) world: &'a World,
    pub(super) colliders: &'a Colliders,
    pub(super) partners: &'a Partners,
    pub(super) start: &'a [Pose],
    pub(super) end: &'a [Pose],
}

impl PlacementCheck<'_> {
    /// Error of a loaded contact between two pieces (eq. 18g) (m); 0 if it is where they touch. NaN if
    /// the world does not have its pieces.
    pub(super) fn error(&self, contact: &Contact, scratch: &mut ExposureScratch) -> f64 {
        let Some(colliders) = self.colliders_of(contact) else { return f64::NAN };
        let (poses, is_end) =
            if contact.bounces() { (self.start, false) } else { (self.end, true) };
        let [a, b] = colliders.map(|(_, collider)| placed(self.world, poses, collider));
        let b_pose = matches!(contact.key.partner, Partner::Body(_)).then_some(b.1);
        let gap = contact.gap_at(a.1, b_pose);
        let (normal, on_a) = touching_point(contact, a.1, b.1);
        let on_b = on_a - normal * gap;

        let length = size(a.0).min(size(b.0));
        let (turned, slipped) = self.motion(contact);
        let rounding = ROUNDING * length;
        let by_turn = if is_end { turned * length + slipped } else { length };
        let separation = -extent(a, &-normal) - extent(b, &normal);
        let continued = contact.features.curved.as_ref().and_then(Curved::cores).is_some();
        let misses = match separation - gap {
            above if above > 0.0 && continued => 0.0,
            other => other.abs() - rounding - by_turn * turned,
        };
        let far = |(piece, pose): (&Piece, &Pose), point: &Vector3<f64>| {
            piece.height_of(&pose.rotation.tr_mul(&(point - pose.position)))
        };
        let off_b = match self.world.terrain(fixed_index(contact)) {
            // A plane of a terrain belongs to all triangles in it.
            Some(_) => 0.0,
            None => far(b, &on_b),
        };
        let rolled = if contact.is_rounded() { turned * length } else { 0.0 };
        let beside = far(a, &on_a).max(off_b) - rounding - slipped - rolled - by_turn * turned;
        let error = misses.max(beside).max(0.0);
        if error > 0.0 || !self.partners.has_others(colliders.map(|(number, _)| number)) {
            return error;
        }
        let exposure = Exposure {
            world: self.world,
            partners: self.partners,
            colliders: colliders.map(|(_, collider)| collider),
            numbers: colliders.map(|(number, _)| number),
        };
        let points = [(on_a, -normal), (on_b, normal)];
        match exposure.shows(points, poses, &[self.start, self.end], scratch) {
            true => 0.0,
            false => length,
        }
    }

    /// Colliders of a contact with their numbers, A first.
    fn colliders_of(&self, contact: &Contact) -> Option<[(usize, Collider); 2]> {
        let pair = contact.key.pair?;
        let of = |owner: PieceOwner, piece: usize| {
            let number = self.colliders.number(owner, piece)?;
            Some((number, Collider { owner, piece }))
        };
        let owner = match contact.key.partner {
            Partner::Body(body) => PieceOwner::Body(body),
            Partner::Fixed(index) => PieceOwner::Fixed(index),
            Partner::Ground => return None,
        };
        Some([of(PieceOwner::Body(contact.key.body), pair.pieces.0)?, of(owner, pair.pieces.1)?])
    }

    /// Rotation of both bodies in the step (rad), and the slip of the contact (m).
    fn motion(&self, contact: &Contact) -> (f64, f64) {
        let turn = |body: usize| (self.end[body].rotation - self.start[body].rotation).norm();
        let (a, b) = (contact.key.body, contact.key.partner.body());
        let turned = turn(a) + b.map_or(0.0, turn);
        let u = contact.motion(
            [&self.start[a], &self.end[a]],
            b.map(|b| [&self.start[b], &self.end[b]]),
            1.0,
        );
        let normal = contact.normal();
        (turned, (u - normal * normal.dot(&u)).norm())
    }
}

/// Index of the fixed partner of a contact.
fn fixed_index(contact: &Contact) -> usize {
    match contact.key.partner {
        Partner::Fixed(index) => index,
        Partner::Body(_) | Partner::Ground => usize::MAX,
    }
}

/// Largest n·x over a placed piece (m) for a unit vector n (world).
fn extent((piece, pose): (&Piece, &Pose), n: &Vector3<f64>) -> f64 {
    let farthest = piece.farthest(&pose.rotation.tr_mul(n));
    n.dot(&(pose.position + pose.rotation * farthest))
}

/// Normal from B to A and touching point of A (m) with A at `a` and B at `b` (world).
fn touching_point(contact: &Contact, a: &Pose, b: &Pose) -> (Vector3<f64>, Vector3<f64>) {
    let features = &contact.features;
    let normal = b.rotation * features.frame.column(2);
    match &features.curved {
        None => {
            let centre = a.position + a.rotation * features.point;
            (normal, centre - normal * features.radius)
        }
        Some(Curved::Ellipsoid(one)) => {
            let inward = one.shape.farthest(&-a.rotation.tr_mul(&normal));
            let lowest =
                if inward == Vector3::zeros() { features.point } else { one.shape.centre + inward };
            (normal, a.position + a.rotation * lowest)
        }
        Some(Curved::Cores(pair)) => {
            let (point, way) = pair.nearest(a, b);
            let normal = way.try_normalize(0.0).unwrap_or(normal);
            (normal, point - normal * features.radius)
        }
    }
}
