//! What passes through another thing within a step.

use super::proxy::{Owner, Proxy, placed};
use crate::geometry::{Hint, Piece, Scratch, bound, separation};
use crate::mechanics::quaternion::rotation;
use crate::mechanics::{Pose, State};
use crate::world::World;
use nalgebra::Vector3;

/// How far two owners move against each other between two lists of poses, m.
pub(super) fn travel(owners: (Owner, Owner), (from, to): (&[Pose], &[Pose])) -> f64 {
    let moved = |owner: Owner| match owner {
        Owner::Fixed(_) => Vector3::zeros(),
        Owner::Body(index) => to[index].position - from[index].position,
    };
    (moved(owners.0) - moved(owners.1)).norm()
}

/// Whether two pieces overlap somewhere on the way of a step, looked at in places that are half the
/// thinner one's thickness apart, or the thousandth part of the way. Their `poses` are then the
/// first such ones.
pub(super) fn meeting(
    world: &World,
    (a, b): (Proxy, Proxy),
    (from, to): (&[State], &[State]),
    travel: f64,
    poses: &mut [Pose],
    (hint, scratch): (&mut Hint, &mut Scratch),
) -> bool {
    const MOST_PLACES: f64 = 1000.0;
    let piece = |proxy| placed(world, poses, proxy).0;
    let thinner = inner_radius(piece(a)).min(inner_radius(piece(b)));
    let places = (travel / thinner).min(MOST_PLACES).ceil() as u32;
    (1..places).any(|place| {
        let share = f64::from(place) / f64::from(places);
        for owner in [a.owner, b.owner] {
            if let Owner::Body(index) = owner {
                poses[index] = part_way(&from[index], &to[index], share);
            }
        }
        let pieces = (placed(world, poses, a), placed(world, poses, b));
        bound(pieces.0, pieces.1, hint) < 0.0
            && separation(pieces.0, pieces.1, hint, scratch).distance < 0.0
    })
}

/// A pose between two of a body: the straight way, the shortest turn.
fn part_way(from: &State, to: &State, share: f64) -> Pose {
    let sign = if from.attitude.dot(&to.attitude) < 0.0 { -1.0 } else { 1.0 };
    let attitude = from.attitude * (1.0 - share) + to.attitude * (sign * share);
    Pose {
        position: from.position + share * (to.position - from.position),
        rotation: rotation(&attitude.normalize()),
    }
}

/// The radius of the largest ball about the middle of a piece that is inside it, m.
fn inner_radius(piece: &Piece) -> f64 {
    let core = piece.core();
    let depth = core.faces().iter().map(|face| face.offset - face.normal.dot(core.centre()));
    let depth = depth.fold(f64::INFINITY, f64::min);
    if depth.is_finite() { depth + piece.radius() } else { piece.radius() }
}
