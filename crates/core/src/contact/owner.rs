//! Choice of the plane's owner if the features leave it open: between two edges, or between equally
//! good faces. It depends on geometry and not on the order of the bodies.

use super::collider::{Collider, PieceOwner, placed, size};
use crate::geometry::PieceSide;
use crate::mechanics::{Pose, RigidBody, State};
use crate::world::World;
use nalgebra::Vector3;
use std::cmp::Ordering;

/// Difference of rotations in a step below which they are equal (rad). The last digits of a spin
/// must not distinguish bodies at rest.
const SAME_TURN: f64 = 1e-6;

/// Difference of lengths below which they are equal, as a fraction of the smaller piece's size.
const SAME_LENGTH: f64 = 1e-6;

/// Owner of the contact plane between two pieces. The bodies are at `states` with the poses
/// `start`.
///
/// The owner is the first that differs among:
///
/// 1. The fixed piece.
/// 2. The body that rotates less in the step, because the plane does not rotate within it.
/// 3. The heavier body.
/// 4. The larger piece.
/// 5. The lower body.
/// 6. The body from which the other one is seen along a more even direction in its own axes.
///
/// These criteria are invariant to rotation and reflection of the world and to renumbering of
/// bodies. Equal bodies in symmetric positions are distinguished by their coordinates.
pub(super) fn plane_of(
    world: &World,
    states: &[State],
    start: &[Pose],
    a: Collider,
    b: Collider,
) -> PieceSide {
    let (of_a, of_b) = match (a.owner, b.owner) {
        (PieceOwner::Fixed(_), _) => return PieceSide::A,
        (_, PieceOwner::Fixed(_)) => return PieceSide::B,
        (PieceOwner::Body(of_a), PieceOwner::Body(of_b)) => (of_a, of_b),
    };
    let h = world.time_step();
    let bodies = (&world.bodies()[of_a], &world.bodies()[of_b]);
    let sizes = [a, b].map(|collider| size(placed(world, start, collider).0));
    // Rotation that a collision may cause: the whole speed at the smallest radius of gyration.
    let (mass, speed) = (
        1.0 / (1.0 / bodies.0.mass() + 1.0 / bodies.1.mass()),
        (states[of_a].velocity - states[of_b].velocity).norm(),
    );
    let turn = |index: usize, body: &RigidBody| {
        let hit = mass / body.mass() * speed * body.specific_inertia_inverse().norm().sqrt();
        h * (states[index].spin.norm() + hit)
    };
    let (r_a, r_b) = (start[of_a].position, start[of_b].position);
    let length = SAME_LENGTH * sizes[0].min(sizes[1]);
    let exact = |x: f64, y: f64| x.total_cmp(&y);
    let order = differ(turn(of_a, bodies.0), turn(of_b, bodies.1), SAME_TURN)
        .then_with(|| exact(bodies.1.mass(), bodies.0.mass()))
        .then_with(|| exact(sizes[1], sizes[0]))
        .then_with(|| {
            let up = -world.gravity().try_normalize(0.0).unwrap_or_default();
            differ(up.dot(&(r_a - r_b)), 0.0, length)
        })
        .then_with(|| {
            let local = |body: usize| sorted(start[body].rotation.tr_mul(&(r_b - r_a)));
            lexicographic(&local(of_a), &local(of_b), length)
        })
        .then_with(|| lexicographic(&r_a, &r_b, 0.0));
    if order == Ordering::Greater { PieceSide::B } else { PieceSide::A }
}

/// Order of two numbers that are equal within `width`.
fn differ(x: f64, y: f64, width: f64) -> Ordering {
    if (x - y).abs() <= width { Ordering::Equal } else { x.total_cmp(&y) }
}

fn lexicographic(x: &Vector3<f64>, y: &Vector3<f64>, width: f64) -> Ordering {
    (0..3).fold(Ordering::Equal, |order, i| order.then_with(|| differ(x[i], y[i], width)))
}

/// Absolute values of the components, the largest first.
fn sorted(vector: Vector3<f64>) -> Vector3<f64> {
    let mut sizes = vector.abs();
    sizes.as_mut_slice().sort_unstable_by(|x, y| y.total_cmp(x));
    sizes
}
