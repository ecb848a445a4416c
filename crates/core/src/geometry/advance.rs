//! First contact of two moving pieces by conservative advancement (Mirtich, "Impulse-based dynamic
//! simulation of rigid body systems", 1996), for pieces that rotate.
//!
//! The gap of the pieces along a constant unit vector n is
//!
//! ```text
//! g_n(s) = min_B n·x − max_A n·x ≤ signed_distance(s)
//! ```
//!
//! Here s from 0 to 1 is the fraction of the trajectory. Δr and θ are the translation and rotation
//! of a body over the whole trajectory. Every core point within ρ (the arm) of the body's centre of
//! mass has n·ẋ ≤ n·Δr + |n × θ| ρ and |n·ẍ| ≤ |n × θ| |θ| ρ. These rates bound the decrease of the
//! gap over a part L of the trajectory:
//!
//! ```text
//! g_n(s + l) ≥ g_n(s) − l (n·(Δr_A − Δr_B) + Σ |n × θ| ρ)
//! g_n(s + l) ≥ (1 − l/L) g_n(s) + (l/L) g_n(s + L) − Σ |n × θ| |θ| ρ L²/8,   l ≤ L
//! ```
//!
//! The second bound is exact without rotation. The axis of bodies that rotate while they touch
//! turns with them. Let n move linearly from the axis at s to the axis at s + L. The difference of
//! two vertices along n has a second derivative of at most D:
//!
//! ```text
//! D = 2 |Δn| (|Δr_A − Δr_B| + Σ |θ| ρ)/L + Σ |θ|² ρ
//! signed_distance(s + l) ≥ (1 − l/L) signed_distance(s) + (l/L) signed_distance(s + L) − L²/8 · D
//! ```
//!
//! This holds up to the length of the mean of the axes, 1 − |Δn|²/8. The search uses the bound that
//! permits the longest step.

use super::Piece;
use super::hint::Hint;
use super::pair::{PiecePair, PlacedPiece};
use super::scratch::PairScratch;
use super::separation::{Separation, touching};
use crate::kinematics::{Pose, Trajectory};
use nalgebra::Vector3;

/// Largest number of steps along a trajectory. An approach takes a few; a graze at the target depth
/// takes some tens.
const MOST_PLACES: u32 = 200;

/// A piece and its trajectory over a step.
#[derive(Debug, Clone, Copy)]
pub struct Moving<'a> {
    /// The piece.
    pub piece: &'a Piece,
    /// Trajectory of its body.
    pub trajectory: &'a Trajectory,
    /// Poses at the start and the end of the trajectory.
    pub ends: (&'a Pose, &'a Pose),
    /// ρ: largest distance of the core's points from the body's centre of mass (m). The gap of
    /// rounded pieces is the gap of their cores minus the radii, so the radius plays no part.
    pub arm: f64,
}

/// Result of a search along a trajectory.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Advance {
    /// The pieces stay apart, or overlap at most by the given depth.
    Clear,
    /// At this fraction of the trajectory they overlap by between half and all of the given depth.
    /// They never overlap deeper before it.
    Met(f64),
    /// The search stopped at this fraction, after the largest number of steps.
    GaveUp(f64),
}

impl<'a> Moving<'a> {
    fn at_start(&self) -> PlacedPiece<'a> {
        (self.piece, self.ends.0)
    }

    fn at_end(&self) -> PlacedPiece<'a> {
        (self.piece, self.ends.1)
    }

    /// Bound on the displacement of a point by the rotation (m): the chord 2 ρ sin ½|θ| is at most
    /// this.
    fn chord(&self) -> f64 {
        self.arm * self.trajectory.angle().min(2.0)
    }

    /// |n × θ| ρ (m).
    fn sideways(&self, axis: &Vector3<f64>) -> f64 {
        axis.cross(&self.trajectory.turn()).norm() * self.arm
    }

    /// Largest distance by which a piece can leave the box around both ends of its trajectory (m).
    /// Points of a rotating piece move along arcs.
    pub fn bulge(&self) -> f64 {
        bulge(self.arm, self.trajectory.angle())
    }
}

/// Largest distance between an arc and its chord (m), for a point within `arm` (m) of the centre
/// and a rotation by `angle` (rad).
pub fn bulge(arm: f64, angle: f64) -> f64 {
    arm * (0.125 * angle * angle).min(2.0)
}

/// Bound on the relative displacement of points of two pieces over the whole trajectory (m).
pub fn travel(a: &Moving<'_>, b: &Moving<'_>) -> f64 {
    let shift = a.trajectory.shift() - b.trajectory.shift();
    shift.norm() + a.chord() + b.chord()
}

/// True if the cached axis proves that two pieces overlap by at most `depth` (m) on the whole
/// trajectory.
///
/// The test uses the axis at the end, and then an axis that moves from the start's to the end's. It
/// is cheap and sufficient for most touching pairs.
pub fn stays_clear(a: &Moving<'_>, b: &Moving<'_>, depth: f64, hint: &Hint) -> bool {
    let stands = |axis: &Vector3<f64>, end: f64| {
        let least = end.min(gap_along(a.at_start(), b.at_start(), axis));
        least - sagging(a, b, axis) >= -depth
    };
    // Beside a facet of a surface is another, so its normal is an axis for most of its neighbours.
    if b.piece.core().is_facet()
        && let Some(face) = b.piece.core().faces().first()
    {
        let axis = -(b.ends.1.rotation * face.normal);
        let end = gap_along(a.at_end(), b.at_end(), &axis);
        if end >= -depth && stands(&axis, end) {
            return true;
        }
    }
    let Some(axis) = hint.axis_between(a.at_end(), b.at_end()) else { return false };
    let end = gap_along(a.at_end(), b.at_end(), &axis);
    if stands(&axis, end) {
        return true;
    }
    let Some(before) = hint.axis_between(a.at_start(), b.at_start()) else { return false };
    let change = axis - before;
    let turns = end.min(gap_along(a.at_start(), b.at_start(), &before));
    // The mean of two unit axes is shorter than 1.
    turns - turning(a, b, 1.0, &change) >= -depth * (1.0 - 0.125 * change.norm_squared())
}

/// Finds the first fraction of the trajectory where two pieces overlap by `depth` (m, above 0).
pub fn first_overlap(
    a: &Moving<'_>,
    b: &Moving<'_>,
    depth: f64,
    hint: &mut Hint,
    scratch: &mut PairScratch,
) -> Advance {
    let mut at = |share: f64| {
        let (pose_a, pose_b) = (a.trajectory.at(share), b.trajectory.at(share));
        touching((a.piece, &pose_a), (b.piece, &pose_b), hint, scratch)
    };
    let (mut share, mut now, mut stride) = (0.0, at(0.0), 1.0);
    for _ in 0..MOST_PLACES {
        if now.distance <= -0.5 * depth {
            return Advance::Met(share);
        }
        // Length that the gap along the present axis keeps clear.
        let (room, rest) = (now.distance + depth, 1.0 - share);
        let step = standing(a, b, share, &now, room);
        if share + step >= 1.0 || step.is_nan() {
            return Advance::Clear;
        }
        // If that is more than half of the stride, the bound by a turning axis is not needed.
        let far = rest.min(stride);
        if step > 0.5 * far {
            (share, stride) = (share + step, 2.0 * far);
            now = at(share);
            continue;
        }
        // Bound by an axis that turns linearly to the one at the end of the stride.
        let ahead = at(share + far);
        let left = room - turning(a, b, far, &(ahead.axis - now.axis));
        if left < 0.25 * room {
            (share, stride) = (share + step, 0.5 * far);
            now = at(share);
        } else if now.distance - ahead.distance <= left {
            if far >= rest {
                return Advance::Clear;
            }
            (share, now, stride) = (share + far, ahead, 2.0 * far);
        } else {
            share += step.max(far * left / (now.distance - ahead.distance));
            now = at(share);
        }
    }
    Advance::GaveUp(share)
}

/// Length of the trajectory from `share` on that is clear by a constant axis, as a fraction. The
/// gap along the axis may shrink by `room` (m).
fn standing(a: &Moving<'_>, b: &Moving<'_>, share: f64, now: &Separation, room: f64) -> f64 {
    let (axis, rest) = (now.axis, 1.0 - share);
    // Limits the length so that the gap sags by at most half of the room.
    let sagging = sagging(a, b, &axis);
    let far = (0.5 * room / sagging).sqrt().min(rest);
    let ahead = if far < rest {
        let (pose_a, pose_b) = (a.trajectory.at(share + far), b.trajectory.at(share + far));
        gap_along((a.piece, &pose_a), (b.piece, &pose_b), &axis)
    } else {
        gap_along(a.at_end(), b.at_end(), &axis)
    };
    let left = room - sagging * far * far;
    let drop = now.distance - ahead;
    let by_chord = if drop <= left { far } else { far * left / drop };
    let shift = a.trajectory.shift() - b.trajectory.shift();
    let rate = axis.dot(&shift) + a.sideways(&axis) + b.sideways(&axis);
    let by_rate = if rate > 0.0 { room / rate } else { f64::INFINITY };
    by_rate.max(by_chord)
}

/// Bound on how far the separation sags below its chord over the fraction `far` of the trajectory
/// (m). The axis moves by `change` from one end to the other. The result is ∞ for large changes.
fn turning(a: &Moving<'_>, b: &Moving<'_>, far: f64, change: &Vector3<f64>) -> f64 {
    let change = change.norm();
    if change > 0.5 {
        return f64::INFINITY;
    }
    let speed = |moving: &Moving<'_>| moving.trajectory.angle() * moving.arm;
    let shift = (a.trajectory.shift() - b.trajectory.shift()).norm();
    let bend = |moving: &Moving<'_>| moving.trajectory.angle() * speed(moving);
    0.125 * far * (2.0 * change * (shift + speed(a) + speed(b)) + far * (bend(a) + bend(b)))
}

/// Σ |n × θ| |θ| ρ/8: bound on how far the gap along an axis sags below its chord over the whole
/// trajectory (m).
fn sagging(a: &Moving<'_>, b: &Moving<'_>, axis: &Vector3<f64>) -> f64 {
    let sag = |moving: &Moving<'_>| moving.sideways(axis) * moving.trajectory.angle();
    0.125 * (sag(a) + sag(b))
}

/// Gap of two pieces in m along a unit vector (world, from A to B).
fn gap_along(a: PlacedPiece<'_>, b: PlacedPiece<'_>, axis: &Vector3<f64>) -> f64 {
    let pair = PiecePair::new(a, b);
    pair.gap_along(&a.1.rotation.tr_mul(axis)) - pair.radii()
}
