//! Overlap test that does not use the library's narrow phase. It is the Gilbert–Johnson–Keerthi
//! algorithm on support points. The nearest point of a simplex is found by trying all its faces.

use crate::common::prelude::*;

type V = Vector3<f64>;

/// Position and rotation of a piece's body.
#[derive(Clone, Copy)]
pub struct Place {
    pub position: V,
    pub rotation: Matrix3<f64>,
}

/// Pose of a fixed piece.
pub fn fixed() -> Place {
    Place { position: V::zeros(), rotation: Matrix3::identity() }
}

fn quaternion(state: &State) -> UnitQuaternion<f64> {
    let q = state.attitude;
    UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(q[0], q[1], q[2], q[3]))
}

/// Pose between two states: linear in position, shortest rotation.
pub fn part_way(from: &State, to: &State, share: f64) -> Place {
    let between = quaternion(to) * quaternion(from).inverse();
    let turn = between.scaled_axis() * share;
    Place {
        position: from.position.lerp(&to.position, share),
        rotation: *(UnitQuaternion::from_scaled_axis(turn) * quaternion(from))
            .to_rotation_matrix()
            .matrix(),
    }
}

/// Angle by which a body turns between two states [rad].
pub fn turn(from: &State, to: &State) -> f64 {
    (quaternion(to) * quaternion(from).inverse()).angle()
}

/// Support point of a core along `axis` [world frame].
fn support(piece: &Piece, place: &Place, axis: &V) -> V {
    let seen = place.rotation.tr_mul(axis);
    let vertices = piece.core().vertices();
    let best = vertices.iter().max_by(|x, y| seen.dot(x).total_cmp(&seen.dot(y))).unwrap();
    place.rotation * best + place.position
}

/// Point of the hull of up to four points that is nearest to the origin, and the points that span
/// it.
fn nearest(points: &[V]) -> (V, Vec<V>) {
    let mut best: Option<(f64, V, Vec<V>)> = None;
    for subset in 1..1_u32 << points.len() {
        let of: Vec<V> =
            (0..points.len()).filter(|i| subset >> i & 1 == 1).map(|i| points[i]).collect();
        let Some(point) = foot(&of) else { continue };
        let square = point.norm_squared();
        if best.as_ref().is_none_or(|(least, ..)| square < *least) {
            best = Some((square, point, of));
        }
    }
    let (_, point, of) = best.unwrap();
    (point, of)
}

/// Projection of the origin on the affine hull of the points, if it lies between them.
fn foot(of: &[V]) -> Option<V> {
    let sides: Vec<V> = of[1..].iter().map(|x| x - of[0]).collect();
    let n = sides.len();
    let gram = DMatrix::from_fn(n, n, |i, j| sides[i].dot(&sides[j]));
    let right = nalgebra::DVector::from_fn(n, |i, _| -sides[i].dot(&of[0]));
    let parts = if n == 0 { right } else { gram.lu().solve(&right)? };
    if parts.iter().any(|part| *part < 0.0) || parts.sum() > 1.0 {
        return None;
    }
    Some(sides.iter().zip(parts.iter()).fold(of[0], |point, (side, part)| point + side * *part))
}

/// Distance of two cores [m], or 0 if they overlap. `shift` moves B.
fn core_distance(a: (&Piece, &Place), b: (&Piece, &Place), shift: &V) -> f64 {
    let difference = |axis: &V| support(a.0, a.1, axis) - support(b.0, b.1, &-axis) - shift;
    let mut simplex = vec![difference(&V::x())];
    let mut point = simplex[0];
    for _ in 0..60 {
        if point.norm() < 1e-9 || simplex.len() == 4 {
            return 0.0;
        }
        let next = difference(&-point);
        if point.norm_squared() - point.dot(&next) <= 1e-9 * point.norm() {
            break;
        }
        simplex.push(next);
        (point, simplex) = nearest(&simplex);
    }
    point.norm()
}

/// Distance of two pieces [m], or 0 if they touch or overlap.
pub fn distance(a: (&Piece, &Place), b: (&Piece, &Place)) -> f64 {
    let radii = a.0.radius() + b.0.radius();
    (core_distance(a, b, &V::zeros()) - radii).max(0.0)
}

/// True if two pieces overlap, and still do when one is moved by `depth` [m] in any of 26
/// directions.
pub fn overlap_by(a: (&Piece, &Place), b: (&Piece, &Place), depth: f64) -> bool {
    let radii = a.0.radius() + b.0.radius();
    let meets = |shift: &V| core_distance(a, b, shift) < radii.max(1e-8);
    if !meets(&V::zeros()) {
        return false;
    }
    (0..27).filter(|i| *i != 13).all(|i| {
        let axis =
            V::new(f64::from(i % 3) - 1.0, f64::from(i / 3 % 3) - 1.0, f64::from(i / 9) - 1.0);
        meets(&(axis.normalize() * depth))
    })
}
