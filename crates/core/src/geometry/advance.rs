//! Where two moving pieces first meet: conservative advancement (Mirtich, "Impulse-based dynamic
//! simulation of rigid body systems", 1996), for pieces that turn.
//!
//! Along a unit vector n that stands still, the pieces are apart by
//!
//! ```text
//! g_n(s) = min_B n·x − max_A n·x ≤ separation(s)
//! ```
//!
//! and bounds say how fast that can fall. Every point of a core within ρ (the arm) of the centre
//! that turns by θ over the way has n·ẋ ≤ n·Δr + |n × θ| ρ, and |n·ẍ| ≤ |n × θ| |θ| ρ: over a part L
//! of the way,
//!
//! ```text
//! g_n(s + l) ≥ g_n(s) − l (n·(Δr_A − Δr_B) + Σ |n × θ| ρ)
//! g_n(s + l) ≥ (1 − l/L) g_n(s) + (l/L) g_n(s + L) − Σ |n × θ| |θ| ρ L²/8,   l ≤ L
//! ```
//!
//! The second is exact where nothing turns. What turns while it touches takes its axis with it: where n
//! goes evenly from the axis at s to that at s + L, the difference of two vertices along it has a
//! second derivative of at most 2 |Δn| (|Δr_A − Δr_B| + Σ |θ| ρ)/L + Σ |θ|² ρ, and with it
//!
//! ```text
//! separation(s + l) ≥ (1 − l/L) separation(s) + (l/L) separation(s + L) − L²/8 · (that)
//! ```
//!
//! up to the length of the mean of the axes, 1 − |Δn|²/8. Whichever lets the way go on farthest is taken.

use super::Piece;
use super::pair::{Hint, PairScratch, PiecePair, PlacedPiece};
use super::separation::{Separation, separation};
use crate::mechanics::{Pose, Way};
use nalgebra::Vector3;

/// Steps on one way: an approach takes a few, a graze at the depth that is looked for some tens.
const MOST_PLACES: u32 = 200;

/// A piece and its way.
#[derive(Debug, Clone, Copy)]
pub struct Moving<'a> {
    /// The piece.
    pub piece: &'a Piece,
    /// The way of its body.
    pub way: &'a Way,
    /// Where the way begins and ends.
    pub ends: (&'a Pose, &'a Pose),
    /// ρ, m: the largest distance of the core's points from the body's centre of mass. How a turn moves
    /// what is rounded, its core says.
    pub arm: f64,
}

/// What a way comes to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Advance {
    /// The pieces stay apart, or overlap no deeper than was asked for.
    Clear,
    /// At this part of the way they overlap by half the depth to the whole of it, and before it by no
    /// more than the whole.
    Met(f64),
    /// The search came this far and gave up.
    GaveUp(f64),
}

impl<'a> Moving<'a> {
    fn at_start(&self) -> PlacedPiece<'a> {
        (self.piece, self.ends.0)
    }

    fn at_end(&self) -> PlacedPiece<'a> {
        (self.piece, self.ends.1)
    }

    /// How far a turn carries a point, m: at most the chord 2 ρ sin ½|θ|.
    fn chord(&self) -> f64 {
        self.arm * self.way.angle().min(2.0)
    }

    /// |n × θ| ρ, m.
    fn sideways(&self, axis: &Vector3<f64>) -> f64 {
        axis.cross(&self.way.turn()).norm() * self.arm
    }

    /// How far a piece can leave the box around both ends of its way, m: a point goes along an arc.
    #[must_use]
    pub fn bulge(&self) -> f64 {
        bulge(self.arm, self.way.angle())
    }
}

/// How far a point within `arm` (m) of what turns by `angle` (rad) can leave the chord of its arc, m.
#[must_use]
pub fn bulge(arm: f64, angle: f64) -> f64 {
    arm * (0.125 * angle * angle).min(2.0)
}

/// How far points of two pieces can move against each other on their ways, m.
#[must_use]
pub fn travel(a: &Moving<'_>, b: &Moving<'_>) -> f64 {
    let shift = a.way.shift() - b.way.shift();
    shift.norm() + a.chord() + b.chord()
}

/// Whether two pieces overlap by no more than `depth` (m) anywhere on their ways, as far as the axis that
/// `hint` remembers can tell, as it is at the end or going from the start's to the end's: quick, and enough for most of what
/// touches.
#[must_use]
pub fn stays_clear(a: &Moving<'_>, b: &Moving<'_>, depth: f64, hint: &Hint) -> bool {
    let Some(axis) = hint.axis_between(a.at_end(), b.at_end()) else { return false };
    let end = gap_along(a.at_end(), b.at_end(), &axis);
    let stands = end.min(gap_along(a.at_start(), b.at_start(), &axis));
    if stands - sagging(a, b, &axis) >= -depth {
        return true;
    }
    let Some(before) = hint.axis_between(a.at_start(), b.at_start()) else { return false };
    let change = axis - before;
    let turns = end.min(gap_along(a.at_start(), b.at_start(), &before));
    // A mean of both axes is shorter than they are.
    turns - turning(a, b, 1.0, &change) >= -depth * (1.0 - 0.125 * change.norm_squared())
}

/// The first place on the way of two pieces where they overlap by `depth` (m, above 0).
pub fn first_overlap(
    a: &Moving<'_>,
    b: &Moving<'_>,
    depth: f64,
    hint: &mut Hint,
    scratch: &mut PairScratch,
) -> Advance {
    let mut at = |share: f64| {
        let (pose_a, pose_b) = (a.way.at(share), b.way.at(share));
        separation((a.piece, &pose_a), (b.piece, &pose_b), hint, scratch)
    };
    let (mut share, mut now, mut stride) = (0.0, at(0.0), 1.0);
    for _ in 0..MOST_PLACES {
        if now.distance <= -0.5 * depth {
            return Advance::Met(share);
        }
        let (room, rest) = (now.distance + depth, 1.0 - share);
        let step = standing(a, b, share, &now, room);
        if share + step >= 1.0 || step.is_nan() {
            return Advance::Clear;
        }
        let far = rest.min(stride);
        if step > 0.5 * far {
            (share, stride) = (share + step, 2.0 * far);
            now = at(share);
            continue;
        }
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

/// How far the way is clear from `share` on by an axis that stands still, where the pieces may come nearer
/// by `room` (m).
fn standing(a: &Moving<'_>, b: &Moving<'_>, share: f64, now: &Separation, room: f64) -> f64 {
    let (axis, rest) = (now.axis, 1.0 - share);
    // Only as far as the gap cannot sag by more than half of the room.
    let sagging = sagging(a, b, &axis);
    let far = (0.5 * room / sagging).sqrt().min(rest);
    let ahead = if far < rest {
        let (pose_a, pose_b) = (a.way.at(share + far), b.way.at(share + far));
        gap_along((a.piece, &pose_a), (b.piece, &pose_b), &axis)
    } else {
        gap_along(a.at_end(), b.at_end(), &axis)
    };
    let left = room - sagging * far * far;
    let drop = now.distance - ahead;
    let by_chord = if drop <= left { far } else { far * left / drop };
    let shift = a.way.shift() - b.way.shift();
    let rate = axis.dot(&shift) + a.sideways(&axis) + b.sideways(&axis);
    let by_rate = if rate > 0.0 { room / rate } else { f64::INFINITY };
    by_rate.max(by_chord)
}

/// How far below the chord the separation can sag over the part `far` of the way, m, by an axis that goes
/// from one end's to the other's, by `change`; ∞ where they are too different.
fn turning(a: &Moving<'_>, b: &Moving<'_>, far: f64, change: &Vector3<f64>) -> f64 {
    let change = change.norm();
    if change > 0.5 {
        return f64::INFINITY;
    }
    let speed = |moving: &Moving<'_>| moving.way.angle() * moving.arm;
    let shift = (a.way.shift() - b.way.shift()).norm();
    let bend = |moving: &Moving<'_>| moving.way.angle() * speed(moving);
    0.125 * far * (2.0 * change * (shift + speed(a) + speed(b)) + far * (bend(a) + bend(b)))
}

/// Σ |n × θ| |θ| ρ/8, m: how far below the chord over the whole way the gap along an axis can sag.
fn sagging(a: &Moving<'_>, b: &Moving<'_>, axis: &Vector3<f64>) -> f64 {
    let of = |moving: &Moving<'_>| moving.sideways(axis) * moving.way.angle();
    0.125 * (of(a) + of(b))
}

/// How far two pieces are apart along a unit vector (world, from A to B), m.
fn gap_along(a: PlacedPiece<'_>, b: PlacedPiece<'_>, axis: &Vector3<f64>) -> f64 {
    let pair = PiecePair::new(a, b);
    pair.gap_along(&a.1.rotation.tr_mul(axis)) - pair.radii()
}
