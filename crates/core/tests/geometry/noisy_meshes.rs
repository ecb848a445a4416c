//! Distances of convex pieces from noisy meshes, against all axes and all pairs of features.

use crate::campaign::size;
use crate::common::draw::WideDraw;
use crate::common::prelude::*;
use tumble_core::geometry::mesh::Mesh;
use tumble_core::geometry::{Hint, Hull, PairScratch, signed_distance};

type V = Vector3<f64>;

impl WideDraw {
    fn rotation(&mut self) -> Rotation3<f64> {
        Rotation3::new(self.vector(1.0) * 3.0)
    }
}

/// Prism with `sides` sides, each quadrilateral of two triangles, or a frustum for a `top` below 1.
fn prism(sides: usize, height: f64, top: f64) -> (Vec<V>, Vec<[usize; 3]>) {
    let ring = |z: f64, radius: f64| {
        (0..sides).map(move |at| {
            let turn = std::f64::consts::TAU * (at as f64 + 0.5) / sides as f64;
            V::new(radius * turn.cos(), radius * turn.sin(), z)
        })
    };
    let points: Vec<V> = ring(-height, 1.0).chain(ring(height, top)).collect();
    let mut triangles = Vec::new();
    for at in 0..sides {
        let next = (at + 1) % sides;
        triangles.extend([[at, next, next + sides], [at, next + sides, at + sides]]);
    }
    for at in 1..sides - 1 {
        triangles.extend([[0, at + 1, at], [sides, sides + at, sides + at + 1]]);
    }
    (points, triangles)
}

/// A piece from a mesh whose vertices are off by noise, or from a file in single precision far from its
/// origin.
fn piece(draw: &mut WideDraw) -> Piece {
    loop {
        let sides = [3, 4, 4, 4, 5, 6, 8, 12][draw.index(8)];
        let (height, top) = (draw.power(-1.0, 0.0), [1.0, 1.0, 0.5][draw.index(3)]);
        let (mut points, triangles) = prism(sides, height, top);
        let turn = if draw.index(2) == 0 { draw.rotation() } else { Rotation3::identity() };
        let (size, noise) = (draw.power(-1.0, 0.3), draw.power(-9.0, -4.0));
        let far = draw.vector(1.0) * draw.power(0.0, 2.0);
        let single = draw.index(3) == 0;
        let centre: V = far.map(|x| f64::from(x as f32));
        for point in &mut points {
            *point = turn * *point * size;
            *point = if single {
                (*point + far).map(|x| f64::from(x as f32)) - centre
            } else {
                *point + draw.vector(1.0) * noise * size
            };
        }
        let made = if draw.index(2) == 0 {
            Mesh::new(points, triangles).and_then(|mesh| Piece::mesh(&mesh, 0.0))
        } else {
            Piece::hull(&points, 0.0)
        };
        if let Ok(piece) = made {
            return piece;
        }
    }
}

/// Smallest height of B over A along a unit vector (m).
fn gap_along(a: &[V], b: &[V], n: &V) -> f64 {
    let low = b.iter().map(|p| n.dot(p)).fold(f64::INFINITY, f64::min);
    low - a.iter().map(|p| n.dot(p)).fold(f64::NEG_INFINITY, f64::max)
}

fn nearest_on_segment(p: &V, from: &V, to: &V) -> V {
    let along = to - from;
    from + along * (along.dot(&(p - from)) / along.norm_squared()).clamp(0.0, 1.0)
}

/// Distance of two segments (m): the ends against the other segment, and the lines where they cross.
fn segment_distance(p: [V; 2], q: [V; 2]) -> f64 {
    let ends = |p: &[V; 2], q: &[V; 2]| {
        let each = p.iter().map(|end| (nearest_on_segment(end, &q[0], &q[1]) - end).norm());
        each.fold(f64::INFINITY, f64::min)
    };
    let least = ends(&p, &q).min(ends(&q, &p));
    let (u, v, w) = (p[1] - p[0], q[1] - q[0], q[0] - p[0]);
    let across = u.cross(&v);
    let square = across.norm_squared();
    let (s, t) = (w.cross(&v).dot(&across) / square, w.cross(&u).dot(&across) / square);
    if (0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&t) {
        return least.min(w.dot(&across).abs() / square.sqrt());
    }
    least
}

/// Triangles of the faces of a hull with its vertices at `points`.
fn triangles<'a>(hull: &'a Hull, points: &'a [V]) -> impl Iterator<Item = [V; 3]> + 'a {
    (0..hull.faces().len()).flat_map(move |face| {
        let corners = hull.face_loop(face);
        let at = move |corner: usize| points[corners[corner].vertex as usize];
        (1..corners.len() - 1).map(move |next| [at(0), at(next), at(next + 1)])
    })
}

/// Signed distance (m) from all axes, and if the pieces are apart from all pairs of features.
fn reference(a: (&Hull, &[V]), b: (&Hull, &[V])) -> f64 {
    let edges = |(hull, points): (&Hull, &[V])| -> Vec<[V; 2]> {
        hull.edges().iter().map(|edge| edge.vertices.map(|at| points[at as usize])).collect()
    };
    let (edges_a, edges_b) = (edges(a), edges(b));
    let mut best = f64::NEG_INFINITY;
    let mut keep = |n: V| {
        if let Some(n) = n.try_normalize(0.0) {
            best = best.max(gap_along(a.1, b.1, &n)).max(gap_along(a.1, b.1, &-n));
        }
    };
    for (hull, points) in [a, b] {
        for face in 0..hull.faces().len() {
            let corners: Vec<V> =
                hull.face_loop(face).iter().map(|corner| points[corner.vertex as usize]).collect();
            let fan = (1..corners.len() - 1)
                .map(|at| (corners[at] - corners[0]).cross(&(corners[at + 1] - corners[0])));
            keep(fan.sum());
        }
    }
    for u in &edges_a {
        for v in &edges_b {
            keep((u[1] - u[0]).cross(&(v[1] - v[0])));
        }
    }
    if best <= 0.0 {
        return best;
    }
    let mut least = f64::INFINITY;
    for u in &edges_a {
        for v in &edges_b {
            least = least.min(segment_distance(*u, *v));
        }
    }
    for (one, other) in [(a, b), (b, a)] {
        for [p, q, r] in triangles(one.0, one.1) {
            let n = (q - p).cross(&(r - p)).normalize();
            for point in other.1 {
                let height = n.dot(&(point - p));
                let is_over = [[p, q], [q, r], [r, p]]
                    .iter()
                    .all(|[from, to]| (to - from).cross(&(point - from)).dot(&n) >= 0.0);
                if height > -1e-12 && is_over {
                    least = least.min(height.abs());
                }
            }
        }
    }
    least.max(best)
}

fn placed(piece: &Piece, pose: &Pose) -> Vec<V> {
    piece.core().vertices().iter().map(|v| pose.position + pose.rotation * v).collect()
}

/// Rotation that takes one unit vector to another, also to nearly the opposite one.
fn rotation_onto(from: &V, to: &V) -> Rotation3<f64> {
    let across = from.cross(to);
    let angle = across.norm().atan2(from.dot(to));
    let any = from.cross(&V::ith(from.iamin(), 1.0));
    let axis = across.try_normalize(1e-12).unwrap_or_else(|| any.normalize());
    Rotation3::new(axis * angle)
}

/// A pose of B in which it is `gap` over a face or another plane of A.
fn pose_at(draw: &mut WideDraw, a: &Piece, b: &Piece, gap: f64) -> Pose {
    let face_of = |draw: &mut WideDraw, piece: &Piece| {
        let faces = piece.core().faces();
        faces[draw.index(faces.len())].normal
    };
    let n = if draw.index(6) == 0 { draw.vector(1.0).normalize() } else { face_of(draw, a) };
    let down = if draw.index(4) == 0 { draw.vector(1.0).normalize() } else { face_of(draw, b) };
    let tilt = match draw.index(3) {
        0 => 0.0,
        1 => draw.power(-12.0, -6.0),
        _ => draw.power(-6.0, -1.0),
    };
    let about = match draw.index(3) {
        0 => 0.0,
        1 => draw.power(-10.0, -3.0),
        _ => draw.within(-3.0, 3.0),
    };
    let onto = rotation_onto(&down, &-n);
    let spin = Rotation3::new(n * about);
    let rotation = *(Rotation3::new(draw.vector(1.0) * tilt) * spin * onto).matrix();
    let size = a.core().reach() + b.core().reach();
    let beside = draw.vector(1.0) * draw.within(0.0, 0.7) * size;
    let beside = beside - n * n.dot(&beside);
    let middle = a.core().centre() - rotation * b.core().centre();
    let pose = Pose { position: middle + beside, rotation };
    let now = gap_along(a.core().vertices(), &placed(b, &pose), &n);
    Pose { position: pose.position + n * (gap - now), ..pose }
}

/// The box of an STL file in single precision, 10 m from the origin of the file.
fn box_in_single_precision(draw: &mut WideDraw, sides: [f64; 3]) -> Piece {
    let turn = draw.rotation();
    let far = draw.vector(1.0) * 10.0;
    let (points, triangles) = prism(4, 0.5, 0.5_f64.sqrt());
    let points = points.iter().map(|p| {
        // The corners of the prism are at ±½ √½ of the larger ring.
        let corner = V::from_fn(|axis, _| 0.5 * sides[axis] * p[axis].signum());
        (turn * corner + far).map(|x| f64::from(x as f32))
    });
    let mesh = Mesh::new(points.collect(), triangles).unwrap();
    let inverse = *turn.inverse().matrix();
    Piece::mesh(&mesh, 0.0).unwrap().moved_by(&inverse, &-(turn.inverse() * far)).unwrap()
}

fn distance(a: &Piece, b: (&Piece, &Pose)) -> (f64, V) {
    let still = Pose { position: V::zeros(), rotation: Matrix3::identity() };
    let found = signed_distance((a, &still), b, &mut Hint::default(), &mut PairScratch::default());
    (found.distance, found.axis)
}

#[test]
fn faces_of_noisy_meshes_are_planar() {
    let mut draw = WideDraw::wide(96);
    for _ in 0..200 {
        let piece = piece(&mut draw);
        let hull = piece.core();
        for (index, face) in hull.faces().iter().enumerate() {
            let lowest = hull.polygon(index).map(|corner| face.normal.dot(corner));
            let lowest = lowest.fold(f64::INFINITY, f64::min);
            assert!(face.offset - lowest <= 1e-13 * hull.reach(), "{:e}", face.offset - lowest);
        }
    }
    let tile = box_in_single_precision(&mut draw, [1.0, 1.0, 0.2]);
    assert_eq!(tile.core().faces().len(), 6);
}

/// A box that touches the top of a box from a file is at its height.
#[test]
fn a_box_from_a_file_is_touched_at_the_height_of_its_top() {
    let mut draw = WideDraw::wide(95);
    let body = Piece::cuboid(V::new(0.15, 0.15, 0.05)).unwrap();
    for _ in 0..20 {
        let tile = box_in_single_precision(&mut draw, [1.0, 1.0, 0.2]);
        for _ in 0..100 {
            let turn = V::new(1e-7, 1e-7, 3.0).component_mul(&draw.vector(1.0));
            let gap = [0.0, 1e-7, -1e-7, 1e-4, -1e-4][draw.index(5)];
            let place = draw.vector(1.0) * 0.3;
            let position = V::new(place.x, place.y, 0.15 + gap);
            let pose = Pose { position, rotation: *Rotation3::new(turn).matrix() };
            let (found, _) = distance(&tile, (&body, &pose));
            // Single precision at 10 m and the tilts.
            assert!((found - gap).abs() < 2e-6, "{found:e} of {gap:e}");
        }
    }
}

#[test]
fn distances_of_noisy_meshes_are_those_of_all_features() {
    let mut draw = WideDraw::wide(97);
    for _ in 0..size(150, 50_000) {
        let (a, b) = (piece(&mut draw), piece(&mut draw));
        for _ in 0..20 {
            let gap = [0.0, draw.power(-9.0, -3.0), -draw.power(-9.0, -3.0)][draw.index(3)];
            let pose = pose_at(&mut draw, &a, &b, gap);
            let points = placed(&b, &pose);
            let size = a.core().reach().min(b.core().reach());
            let right = reference((a.core(), a.core().vertices()), (b.core(), &points));
            let (found, axis) = distance(&a, (&b, &pose));
            assert!((found - right).abs() <= 1e-12 * size, "{found:e}, right is {right:e}");
            // The pieces are as far apart along the axis. A line between nearly parallel edges has a direction
            // to √ε, and a short one is tilted by the rounding of its ends.
            let along = gap_along(a.core().vertices(), &points, &axis);
            let reach = a.core().reach() + b.core().reach();
            let tilt = if right > 0.0 { 1e-7 + 1e-15 * reach / right } else { 0.0 };
            let most = 1e-12 * size + tilt * reach;
            assert!((along - right).abs() <= most, "{along:e} along the axis, right is {right:e}");
        }
    }
}
