//! Closest points of two separated cores, by search over all pairs of features that bounds leave.

use super::gjk::close_points;
use super::hull::{Edge, span};
use super::pair::PiecePair;
use super::scratch::PairScratch;
use super::segment::closest_segment_parameters;
use super::support::{highest, lowest};
use nalgebra::Vector3;

/// Feature of a core that contains a point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum On {
    Vertex(usize),
    Edge(usize),
    Face(usize),
}

/// A point of each core (m, frame of A) and the features that contain them.
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

/// Number of pairs of edges above which a search for close points pays off.
const MANY: usize = 400;

/// Distance below which a vertex may touch a face, relative to the smaller core.
const TOUCHING: f64 = 1e-12;

/// Closest points of two cores.
///
/// `axis` is an axis along which the cores are separated. It is `None` if neither core has a face.
/// `scratch` holds B's vertices and normals in the frame of A.
///
/// Let ub be an upper bound on the distance. Let α and β be the highest point of A and the lowest
/// point of B along a unit vector n. The closest points obey n·b ≤ α + ub and n·a ≥ β − ub, so features
/// beyond these planes are skipped. If `axis` leaves many features, n is the direction between close
/// points.
pub(super) fn closest_features(
    pair: &PiecePair<'_>,
    scratch: &mut PairScratch,
    axis: Option<&Vector3<f64>>,
) -> Points {
    let PairScratch { vertices, near, normals, .. } = scratch;
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
    near.find(pair, vertices, axis, [alpha, beta], bound);
    if near.pairs() > MANY {
        let [a, b] = close_points(pair.a.vertices(), vertices, axis);
        if let Some(along) = (b - a).try_normalize(0.0) {
            let ends = [highest(pair.a.vertices(), &along).1, lowest(vertices, &along).1];
            near.find(pair, vertices, &along, ends, (b - a).norm().min(bound));
        }
    }

    // A vertex that touches a face may be below it by rounding.
    let rounding = TOUCHING * pair.size();
    let mut square = bound * bound;
    let mut keep = |points: Points| {
        let this = (points.b - points.a).norm_squared();
        if this < square {
            (square, best) = (this, points);
        }
    };
    // Vertices of each core over the faces of the other one.
    for &vertex in &near.b.vertices {
        let b = vertices[vertex];
        for (index, face) in pair.a.faces().iter().enumerate() {
            let height = face.normal.dot(&b) - face.offset;
            if height > -rounding && pair.a.is_over(index, &b, 0.0) {
                let a = b - face.normal * height;
                keep(Points { a, b, on_a: On::Face(index), on_b: On::Vertex(vertex) });
            }
        }
    }
    for &vertex in &near.a.vertices {
        let a = pair.a.vertices()[vertex];
        for (index, (face, normal)) in pair.b.faces().iter().zip(&*normals).enumerate() {
            let height = normal.dot(&(a - pair.shift)) - face.offset;
            if height > -rounding && pair.b.is_over(index, &pair.in_b(&a), 0.0) {
                let b = a - normal * height;
                keep(Points { a, b, on_a: On::Vertex(vertex), on_b: On::Face(index) });
            }
        }
    }
    // Edges with edges, which includes vertices with edges and with vertices.
    near.each_pair(|edge_a, edge_b| keep(closest_on_edges(pair, vertices, edge_a, edge_b)));
    best
}

/// A point nearer to an edge's end than this fraction of the edge belongs to the vertex.
const AT_END: f64 = 1e-9;

/// Closest points p + s u and q + t v (0 ≤ s, t ≤ 1) of two edges.
pub(super) fn closest_on_edges(
    pair: &PiecePair<'_>,
    vertices_b: &[Vector3<f64>],
    edge_a: usize,
    edge_b: usize,
) -> Points {
    let part = |vertices: &[Vector3<f64>], edges: &[Edge], edge: usize| {
        edges.get(edge).map_or((vertices[0], Vector3::zeros()), |edge| span(vertices, edge))
    };
    let (p, u) = part(pair.a.vertices(), pair.a.edges(), edge_a);
    let (q, v) = part(vertices_b, pair.b.edges(), edge_b);
    let (s, t) = closest_segment_parameters(&p, &u, &q, &v);
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
