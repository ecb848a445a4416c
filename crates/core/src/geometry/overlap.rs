//! Intersection of two faces along an axis: the corners of the common polygon.
//!
//! Every vertex is compared with every side of the other face, and every side with every side. The
//! result does not depend on an order of clipping. A vertex within a tolerance of a side counts as
//! inside. Two sides cross only if the ends of both are on opposite sides beyond the tolerance.
//! Each corner is thus found once, as a vertex or as a crossing. Collinear sides meet in vertices
//! only.

use super::Hull;
use super::segment::closest_on_segment;
use nalgebra::Vector3;

/// A corner of the common polygon, by indices in the loops of both faces.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum PolygonCorner {
    /// A vertex of A's face.
    A(usize),
    /// A vertex of B's face.
    B(usize),
    /// Crossing of the side of A's face that starts at the first index with the side of B's face
    /// that starts at the second.
    Crossing(usize, usize),
}

/// Workspace: both polygons, and the distance of every vertex from every side of the other.
#[derive(Debug, Clone, Default)]
pub(super) struct FaceOverlap {
    pub a: Polygon,
    pub b: Polygon,
    /// Distance of vertex j of B from side i of A, at i·|B| + j (m), positive inside.
    b_in_a: Vec<f64>,
    /// Distance of vertex i of A from side j of B, at i·|B| + j (m), positive inside.
    a_in_b: Vec<f64>,
    pub corners: Vec<PolygonCorner>,
}

/// A face, or the segment or point of a core without faces.
#[derive(Debug, Clone, Default)]
pub(super) struct Polygon {
    /// Indices of the vertices in their hull.
    pub vertices: Vec<usize>,
    /// Vertices (m, frame of A).
    pub points: Vec<Vector3<f64>>,
    /// Index of the edge from each vertex to the next.
    pub edges: Vec<usize>,
}

impl Polygon {
    /// Copies the loop of a face, or the whole core if it has no faces.
    pub fn fill(&mut self, hull: &Hull, placed: &[Vector3<f64>], face: Option<usize>) {
        self.vertices.clear();
        self.edges.clear();
        match face {
            Some(face) => {
                for corner in hull.face_loop(face) {
                    self.vertices.push(corner.vertex as usize);
                    self.edges.push(corner.edge as usize);
                }
            }
            None => {
                self.vertices.extend(0..placed.len());
                self.edges.extend(hull.edges().iter().map(|_| 0));
            }
        }
        self.points.clear();
        self.points.extend(self.vertices.iter().map(|&vertex| placed[vertex]));
    }

    /// Ends of the side that starts at index `at`.
    pub fn side(&self, at: usize) -> (&Vector3<f64>, &Vector3<f64>) {
        (&self.points[at], &self.points[(at + 1) % self.points.len()])
    }

    /// Closest point to `point` on the boundary (m).
    pub fn nearest(&self, point: &Vector3<f64>) -> Vector3<f64> {
        let mut best = (self.points[0], f64::INFINITY);
        for at in 0..self.points.len() {
            let (from, to) = self.side(at);
            let candidate = closest_on_segment(point, from, &(to - from));
            let square = (candidate - point).norm_squared();
            if square < best.1 {
                best = (candidate, square);
            }
        }
        best.0
    }
}

impl FaceOverlap {
    /// Finds the corners along `axis` (unit, from A to B), with `tolerance` in m.
    ///
    /// A's face runs counter-clockwise about the axis and B's clockwise. If a vertex of A and a
    /// vertex of B coincide, `keep_a` selects the one of A.
    pub fn find(&mut self, axis: &Vector3<f64>, tolerance: f64, keep_a: bool) {
        let Self { a, b, b_in_a, a_in_b, corners } = self;
        let (count_a, count_b) = (a.points.len(), b.points.len());
        corners.clear();
        b_in_a.clear();
        b_in_a.resize(count_a * count_b, 0.0);
        a_in_b.clear();
        a_in_b.resize(count_a * count_b, 0.0);
        // Signed distances of the points of each polygon from the edges of the other, positive inside.
        for i in 0..a.edges.len() {
            let (from, inward) = inward(a, i, axis);
            for (j, point) in b.points.iter().enumerate() {
                b_in_a[i * count_b + j] = inward.dot(&(point - from));
            }
        }
        for j in 0..b.edges.len() {
            let (from, inward) = inward(b, j, &-axis);
            for (i, point) in a.points.iter().enumerate() {
                a_in_b[i * count_b + j] = inward.dot(&(point - from));
            }
        }
        // Two polygons: vertices inside the other one, and crossings of edges.
        if count_a >= 3 && count_b >= 3 {
            let is_a = |i: usize| (0..count_b).all(|j| a_in_b[i * count_b + j] >= -tolerance);
            let is_b = |j: usize| (0..count_a).all(|i| b_in_a[i * count_b + j] >= -tolerance);
            // Two vertices that coincide along the axis are one corner.
            let most = 4.0 * tolerance;
            let coincide = |i: usize, j: usize| {
                let between = b.points[j] - a.points[i];
                (between - axis * axis.dot(&between)).norm_squared() <= most * most
            };
            for i in (0..count_a).filter(|&i| is_a(i)) {
                if keep_a || !(0..count_b).any(|j| coincide(i, j) && is_b(j)) {
                    corners.push(PolygonCorner::A(i));
                }
            }
            for j in (0..count_b).filter(|&j| is_b(j)) {
                if !keep_a || !(0..count_a).any(|i| coincide(i, j) && is_a(i)) {
                    corners.push(PolygonCorner::B(j));
                }
            }
            // Edges cross if the ends of each are on both sides of the other one.
            for i in 0..count_a {
                for j in 0..count_b {
                    let (i_next, j_next) = ((i + 1) % count_a, (j + 1) % count_b);
                    let ends = (b_in_a[i * count_b + j], b_in_a[i * count_b + j_next]);
                    if !opposite(ends.0, ends.1, tolerance) {
                        continue;
                    }
                    let ends = (a_in_b[i * count_b + j], a_in_b[i_next * count_b + j]);
                    if opposite(ends.0, ends.1, tolerance) {
                        corners.push(PolygonCorner::Crossing(i, j));
                    }
                }
            }
        } else if count_a >= 3 {
            let heights = |i: usize, j: usize| b_in_a[i * count_b + j];
            for end in cut(count_a, count_b, heights, tolerance).into_iter().flatten() {
                corners.push(match end {
                    CutEnd::Vertex(j) => PolygonCorner::B(j),
                    CutEnd::Side(i) => PolygonCorner::Crossing(i, 0),
                });
            }
        } else if count_b >= 3 {
            let heights = |j: usize, i: usize| a_in_b[i * count_b + j];
            for end in cut(count_b, count_a, heights, tolerance).into_iter().flatten() {
                corners.push(match end {
                    CutEnd::Vertex(i) => PolygonCorner::A(i),
                    CutEnd::Side(j) => PolygonCorner::Crossing(0, j),
                });
            }
        }
        self.join_ends(tolerance);
    }

    /// Reduces a segment that only touches the boundary to one corner: its vertex if there is one,
    /// otherwise its crossing with the first side.
    fn join_ends(&mut self, tolerance: f64) {
        let &[first, second] = self.corners.as_slice() else { return };
        if self.a.points.len().min(self.b.points.len()) >= 3 {
            return;
        }
        let place = |at: PolygonCorner| match at {
            PolygonCorner::A(i) => self.a.points[i],
            PolygonCorner::B(j) => self.b.points[j],
            PolygonCorner::Crossing(i, j) if self.b.points.len() < 3 => self.on_b(i, j),
            PolygonCorner::Crossing(i, j) => self.on_a(i, j),
        };
        if (place(first) - place(second)).norm() <= 4.0 * tolerance {
            let crossing = |at: PolygonCorner| matches!(at, PolygonCorner::Crossing(..));
            self.corners.remove(usize::from(!crossing(first) || crossing(second)));
        }
    }

    /// Position of a crossing on A's side (m).
    pub fn on_a(&self, i: usize, j: usize) -> Vector3<f64> {
        let next = (i + 1) % self.a.points.len();
        let count_b = self.b.points.len();
        let (from, to) = (self.a_in_b[i * count_b + j], self.a_in_b[next * count_b + j]);
        let (start, end) = self.a.side(i);
        start.lerp(end, zero_between(from, to))
    }

    /// Position of a crossing on B's side (m).
    pub fn on_b(&self, i: usize, j: usize) -> Vector3<f64> {
        let count_b = self.b.points.len();
        let next = (j + 1) % count_b;
        let (from, to) = (self.b_in_a[i * count_b + j], self.b_in_a[i * count_b + next]);
        let (start, end) = self.b.side(j);
        start.lerp(end, zero_between(from, to))
    }
}

/// Root of the linear function with value `from` at 0 and `to` at 1, clamped to 0…1.
fn zero_between(from: f64, to: f64) -> f64 {
    if from == to { 0.0 } else { (from / (from - to)).clamp(0.0, 1.0) }
}

/// First point of a side, and the unit vector into the polygon perpendicular to axis and side.
fn inward(polygon: &Polygon, side: usize, axis: &Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
    let (from, to) = polygon.side(side);
    (*from, axis.cross(&(to - from)).try_normalize(0.0).unwrap_or_default())
}

fn opposite(from: f64, to: f64, tolerance: f64) -> bool {
    (from > tolerance && to < -tolerance) || (from < -tolerance && to > tolerance)
}

/// One end of a segment clipped to a polygon.
enum CutEnd {
    Vertex(usize),
    Side(usize),
}

/// Clips a segment (or a point) to a polygon with `sides` sides. Returns its two ends: one for a
/// point, none if it is outside. `height(side, end)` is the distance of an end inside a side.
fn cut(
    sides: usize,
    ends: usize,
    height: impl Fn(usize, usize) -> f64,
    tolerance: f64,
) -> [Option<CutEnd>; 2] {
    let (mut from, mut to) = ((0.0, None), (1.0, None));
    for side in 0..sides {
        let (first, last) = (height(side, 0), height(side, ends - 1));
        if first < -tolerance && last < -tolerance {
            return [None, None];
        }
        if first < -tolerance {
            let at = if last > 0.0 { first / (first - last) } else { 1.0 };
            if at > from.0 {
                from = (at, Some(side));
            }
        } else if last < -tolerance {
            let at = if first > 0.0 { first / (first - last) } else { 0.0 };
            if at < to.0 {
                to = (at, Some(side));
            }
        }
    }
    if from.0 > to.0 {
        return [None, None];
    }
    let last = (ends > 1).then(|| to.1.map_or(CutEnd::Vertex(1), CutEnd::Side));
    [Some(from.1.map_or(CutEnd::Vertex(0), CutEnd::Side)), last]
}
