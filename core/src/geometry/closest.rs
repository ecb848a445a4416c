//! The closest points of two cores that are apart, over all pairs of features.

use super::axes::span;
use super::hull::Edge;
use super::pair::{Pair, Scratch, highest, lowest};
use nalgebra::Vector3;

/// The features that can be closest: those that reach into the layer in which the closest
/// points must be.
#[derive(Debug, Clone, Default)]
pub(super) struct Near {
    edges_a: Vec<usize>,
    edges_b: Vec<usize>,
    vertices_a: Vec<usize>,
    vertices_b: Vec<usize>,
}

/// A point of a core, as the feature that it is in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum On {
    Vertex(usize),
    Edge(usize),
    Face(usize),
}

/// A pair of points, frame of A, m.
#[derive(Debug, Clone, Copy)]
pub(super) struct Points {
    pub a: Vector3<f64>,
    pub b: Vector3<f64>,
    pub on_a: On,
    pub on_b: On,
}

impl Points {
    pub fn distance(&self) -> f64 {
        (self.b - self.a).norm()
    }
}

/// The closest points of two cores. `axis` is one along which they are apart, or None where
/// neither core has a face; `scratch` holds B's placed vertices and normals.
///
/// With ub a bound on the distance from above, α and β the highest point of A and the lowest of
/// B along the axis n, the closest points obey n·b ≤ α + ub and n·a ≥ β − ub: features that do
/// not reach there are left out.
pub(super) fn closest(
    pair: &Pair<'_>,
    scratch: &mut Scratch,
    axis: Option<&Vector3<f64>>,
) -> Points {
    let Scratch { vertices, near, normals, .. } = scratch;
    let zero = Vector3::zeros();
    let axis = axis.unwrap_or(&zero);
    let (high_a, alpha) = highest(pair.a.vertices(), axis);
    let (low_b, beta) = lowest(vertices, axis);
    let mut best = Points {
        a: pair.a.vertices()[high_a],
        b: vertices[low_b],
        on_a: On::Vertex(high_a),
        on_b: On::Vertex(low_b),
    };
    let bound = best.distance();
    let slack = 1e-12 * (1.0 + bound);
    let near_a = |v: &Vector3<f64>| axis.dot(v) >= beta - bound - slack;
    let near_b = |v: &Vector3<f64>| axis.dot(v) <= alpha + bound + slack;
    select(pair.a.vertices(), pair.a.edges(), near_a, &mut near.vertices_a, &mut near.edges_a);
    select(vertices, pair.b.edges(), near_b, &mut near.vertices_b, &mut near.edges_b);

    let mut square = bound * bound;
    let mut keep = |points: Points| {
        let this = (points.b - points.a).norm_squared();
        if this < square {
            (square, best) = (this, points);
        }
    };
    for &vertex in &near.vertices_b {
        let b = vertices[vertex];
        for (index, face) in pair.a.faces().iter().enumerate() {
            let height = face.normal.dot(&b) - face.offset;
            if height > 0.0 && pair.a.is_over(index, &b, 0.0) {
                let a = b - face.normal * height;
                keep(Points { a, b, on_a: On::Face(index), on_b: On::Vertex(vertex) });
            }
        }
    }
    for &vertex in &near.vertices_a {
        let a = pair.a.vertices()[vertex];
        for (index, (face, normal)) in pair.b.faces().iter().zip(&*normals).enumerate() {
            let height = normal.dot(&(a - pair.shift)) - face.offset;
            if height > 0.0 && pair.b.is_over(index, &pair.in_b(&a), 0.0) {
                let b = a - normal * height;
                keep(Points { a, b, on_a: On::Vertex(vertex), on_b: On::Face(index) });
            }
        }
    }
    near.each_pair(|edge_a, edge_b| keep(of_edges(pair, vertices, edge_a, edge_b)));
    best
}

/// Nearer to its end than this part of an edge, a point is in the vertex.
const AT_END: f64 = 1e-9;

/// The edge that stands for a core without edges: its point.
const POINT: usize = usize::MAX;

fn select(
    vertices: &[Vector3<f64>],
    edges: &[Edge],
    is_near: impl Fn(&Vector3<f64>) -> bool,
    near_vertices: &mut Vec<usize>,
    near_edges: &mut Vec<usize>,
) {
    near_vertices.clear();
    near_vertices.extend((0..vertices.len()).filter(|&index| is_near(&vertices[index])));
    near_edges.clear();
    let reaches = |edge: &Edge| edge.vertices.iter().any(|&v| is_near(&vertices[v as usize]));
    near_edges.extend((0..edges.len()).filter(|&index| reaches(&edges[index])));
    if edges.is_empty() {
        near_edges.push(POINT);
    }
}

impl Near {
    /// All pairs of near edges, in ascending order; see [`POINT`].
    pub fn each_pair(&self, mut visit: impl FnMut(usize, usize)) {
        for &a in &self.edges_a {
            for &b in &self.edges_b {
                visit(a, b);
            }
        }
    }
}

/// The closest points of two edges: of p + s u and q + t v, 0 ≤ s, t ≤ 1.
pub(super) fn of_edges(
    pair: &Pair<'_>,
    vertices_b: &[Vector3<f64>],
    edge_a: usize,
    edge_b: usize,
) -> Points {
    let part = |vertices: &[Vector3<f64>], edges: &[Edge], edge: usize| {
        edges.get(edge).map_or((vertices[0], Vector3::zeros()), |edge| span(vertices, edge))
    };
    let (p, u) = part(pair.a.vertices(), pair.a.edges(), edge_a);
    let (q, v) = part(vertices_b, pair.b.edges(), edge_b);
    let (s, t) = nearest_shares((&p, &u), (&q, &v));
    let on = |edges: &[Edge], edge: usize, at: f64| match edges.get(edge) {
        None => On::Vertex(0),
        Some(edge) if at < AT_END => On::Vertex(edge.vertices[0] as usize),
        Some(edge) if at > 1.0 - AT_END => On::Vertex(edge.vertices[1] as usize),
        Some(_) => On::Edge(edge),
    };
    Points {
        a: p + u * s,
        b: q + v * t,
        on_a: on(pair.a.edges(), edge_a, s),
        on_b: on(pair.b.edges(), edge_b, t),
    }
}

/// s and t of the points p + s u and q + t v (0 ≤ s, t ≤ 1) that are nearest to each other; of parallel
/// segments those of the first point of p. Either may be a point.
#[must_use]
#[inline(always)]
pub fn nearest_shares(
    (p, u): (&Vector3<f64>, &Vector3<f64>),
    (q, v): (&Vector3<f64>, &Vector3<f64>),
) -> (f64, f64) {
    let (uu, vv, uv) = (u.norm_squared(), v.norm_squared(), u.dot(v));
    let (ur, vr) = (u.dot(&(q - p)), v.dot(&(q - p)));
    // The best s for a given t, and the other way round.
    let s_of = |t: f64| if uu > 0.0 { ((ur + t * uv) / uu).clamp(0.0, 1.0) } else { 0.0 };
    let t_of = |s: f64| if vv > 0.0 { ((s * uv - vr) / vv).clamp(0.0, 1.0) } else { 0.0 };
    let determinant = uu * vv - uv * uv;
    let free = if determinant > 1e-14 * uu * vv {
        ((ur * vv - vr * uv) / determinant).clamp(0.0, 1.0)
    } else {
        0.0
    };
    let t = t_of(free);
    (s_of(t), t)
}

/// The point of the segment q + t v, 0 ≤ t ≤ 1, that is nearest to `point`.
pub(super) fn nearest(point: &Vector3<f64>, q: &Vector3<f64>, v: &Vector3<f64>) -> Vector3<f64> {
    q + v * (v.dot(&(point - q)) / v.norm_squared()).clamp(0.0, 1.0)
}
