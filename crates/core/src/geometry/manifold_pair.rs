//! Search for the contacts of two cores along the axis of largest separation.

use super::Hull;
use super::closest_features::{On, Points, closest_features, closest_on_edges};
use super::features::{CorePart, Feature, PieceSide};
use super::hull::span;
use super::overlap::PolygonCorner;
use super::pair::PiecePair;
use super::scratch::PairScratch;
use super::segment::closest_on_segment;
use super::separating_axis::{AxisSource, SeparatingAxis};
use super::separation::across_cores;
use super::support::{highest, lowest};
use super::touch::ManifoldPoint;
use nalgebra::Vector3;

/// Cosine above which a face normal is nearly along the axis: an angle of 0.03 rad.
///
/// Along the axis such a face is foreshortened by 1 − cos 0.03 = 0.05 %. A corner lifted by this
/// tilt (3 % of the face) is beyond any sensible reach, so contacts do not jump at the limit angle.
pub(super) const NEARLY_ACROSS: f64 = 0.999_55;

/// Sine below which two edges meet in the ends of their common part. Each end has its own exact
/// plane, so the value matters little.
const NEARLY_PARALLEL: f64 = 0.03;

/// Relative distance below which corners coincide and face axes are equal; see [`manifold`].
/// Solvers leave drifts of about 1e-9.
pub(super) const MERGE: f64 = 1e-7;

/// Two pieces and the state of the search for their contacts.
pub(super) struct ManifoldPair<'a, 's> {
    pub pair: PiecePair<'a>,
    pub scratch: &'s mut PairScratch,
    pub reach: f64,
    /// Piece that owns the plane if no other rule decides.
    pub plane_of: PieceSide,
    pub out: &'s mut Vec<ManifoldPoint>,
    /// Closest points of the cores, if they were computed.
    pub points: Option<Points>,
}

impl ManifoldPair<'_, '_> {
    /// Finds the contacts and returns the gap of the cores (m).
    pub(super) fn find(&mut self, axis: Option<SeparatingAxis>) -> f64 {
        let radii = self.pair.radii();
        let Some(axis) = axis else {
            let gap = self.closest(None);
            self.edges(None);
            return gap;
        };
        // Rounded pieces meet along the shortest line, which is the axis if the axis is exact.
        let mut gap = axis.gap;
        if radii > 0.0 && !axis.exact {
            gap = self.closest(Some(&axis));
            if gap - radii > self.reach {
                return gap;
            }
        }
        self.faces(&axis);
        let radii_gap = gap - radii;
        let lowest = self.out.iter().map(|touch| touch.gap).fold(f64::INFINITY, f64::min);
        let merge = MERGE * self.pair.size();
        if axis.exact {
            if lowest > radii_gap + merge {
                self.deepest(&axis);
            }
            return gap;
        }
        if self.points.is_none() {
            if lowest <= radii_gap + merge {
                return gap;
            }
            gap = self.closest(Some(&axis));
        }
        if gap - radii <= self.reach && lowest > gap - radii + merge {
            self.edges(Some(&axis));
        }
        gap
    }

    fn closest(&mut self, axis: Option<&SeparatingAxis>) -> f64 {
        let points = closest_features(&self.pair, self.scratch, axis.map(|axis| &axis.normal));
        self.points = Some(points);
        points.distance()
    }

    /// Direction of the shortest line, if the closest points are known and distinct.
    pub(super) fn shortest(&self) -> Option<Vector3<f64>> {
        self.points.and_then(|points| self.pair.direction(&points.a, &points.b))
    }

    /// Unit normal from A to B: the shortest line if it is known, otherwise the axis.
    pub(super) fn normal(&self, axis: Option<SeparatingAxis>) -> Vector3<f64> {
        self.shortest()
            .or(axis.map(|axis| axis.normal))
            .unwrap_or_else(|| across_cores(&self.pair, self.scratch))
    }

    /// Adds the contacts of two faces, or of a face and the features above it.
    pub fn faces(&mut self, axis: &SeparatingAxis) {
        let normal = self.normal(Some(*axis));
        let (pair, scratch) = (self.pair, &mut *self.scratch);
        let normals_a = || pair.a.faces().iter().map(|face| face.normal);
        let normals_b = || scratch.normals.iter().copied();
        let mut face_a = most_across(normals_a(), |_| true, &normal);
        let mut face_b = most_across(normals_b(), |_| true, &-normal);
        let across = |face: Option<(usize, f64)>| face.is_some_and(|(_, cos)| cos > NEARLY_ACROSS);
        let (across_a, across_b) = (across(face_a), across(face_b));
        if !across_a && !across_b {
            return;
        }
        // A face that is not aligned with the axis meets the other core with its deepest vertex.
        if !across_a && face_a.is_some() {
            let (deepest, _) = highest(pair.a.vertices(), &normal);
            face_a = most_across(normals_a(), |face| has(pair.a, face, deepest), &normal);
        }
        if !across_b && face_b.is_some() {
            let (deepest, _) = lowest(&scratch.vertices, &normal);
            face_b = most_across(normals_b(), |face| has(pair.b, face, deepest), &-normal);
        }
        let (face_a, face_b) = (face_a.map(|face| face.0), face_b.map(|face| face.0));
        // The reference face has the contact plane. Of two, the larger one or that of the plane's owner.
        let reference = match (across_a, across_b, axis.kind) {
            (true, false, _) | (true, true, AxisSource::FaceA(_)) => PieceSide::A,
            (false, _, _) | (true, true, AxisSource::FaceB(_)) => PieceSide::B,
            (true, true, AxisSource::Edges(..)) => {
                let area = |hull: &Hull, face: Option<usize>| {
                    face.map_or(0.0, |face| hull.faces()[face].area)
                };
                let areas = (area(pair.a, face_a), area(pair.b, face_b));
                if areas.1 > areas.0 * (1.0 + MERGE) {
                    PieceSide::B
                } else if areas.0 > areas.1 * (1.0 + MERGE) {
                    PieceSide::A
                } else {
                    self.plane_of
                }
            }
        };
        // Both faces are projected along the normal. The corners of their common part are contacts.
        scratch.overlap.a.fill(pair.a, pair.a.vertices(), face_a);
        scratch.overlap.b.fill(pair.b, &scratch.vertices, face_b);
        let merge = MERGE * pair.size();
        scratch.overlap.find(&normal, merge, reference == PieceSide::B);
        let overlap = std::mem::take(&mut scratch.overlap);
        // Cores of rounded pieces are far apart at contact. A corner meets a face only if it is
        // exactly over that face.
        let is_round = pair.radii() > 0.0 && axis.gap > 0.0;
        // Facets have no rims: beside one is another.
        let is_facet = pair.b.is_facet();
        let (has_rims, border) = if is_facet { (false, merge) } else { (is_round, 0.0) };
        for &at in &overlap.corners {
            let (side, point, feature) = match at {
                PolygonCorner::A(i) => {
                    let feature = Feature::Vertex(PieceSide::A, overlap.a.vertices[i] as u32);
                    (PieceSide::A, overlap.a.points[i], feature)
                }
                PolygonCorner::B(j) => {
                    let feature = Feature::Vertex(PieceSide::B, overlap.b.vertices[j] as u32);
                    (PieceSide::B, overlap.b.points[j], feature)
                }
                PolygonCorner::Crossing(i, j) => {
                    let (edge_a, edge_b) = (overlap.a.edges[i], overlap.b.edges[j]);
                    let feature = Feature::Edges(edge_a as u32, edge_b as u32);
                    let (side, point) = match reference {
                        PieceSide::A => (PieceSide::B, overlap.on_b(i, j)),
                        PieceSide::B => (PieceSide::A, overlap.on_a(i, j)),
                    };
                    (side, point, feature)
                }
            };
            // A corner on the shortest line uses the features of that line.
            let is_shortest = |points: &Points| {
                let between = points.a - point;
                (between - normal * normal.dot(&between)).norm() <= 4.0 * merge
            };
            if let Some(points) = self.points.filter(is_shortest)
                && !is_facet
            {
                self.push_shortest(&points, &normal);
                continue;
            }
            // A corner against the face below it. Beside a face, a rounded piece touches the rim.
            let touch = match side {
                PieceSide::A => face_b.and_then(|face| {
                    let is_over = || pair.b.is_over(face, &pair.in_b(&point), border);
                    if (across_b && !is_round) || is_over() {
                        return Some(pair.on_face_b(face, &point, feature));
                    }
                    let rim = has_rims.then(|| overlap.b.nearest(&point))?;
                    Some(pair.against(side, &point, &rim, &normal, feature))
                }),
                PieceSide::B => face_a.and_then(|face| {
                    if (across_a && !is_round) || pair.a.is_over(face, &point, 0.0) {
                        return Some(pair.on_face_a(face, &point, feature));
                    }
                    let rim = has_rims.then(|| overlap.a.nearest(&point))?;
                    Some(pair.against(side, &point, &rim, &normal, feature))
                }),
            };
            touch.into_iter().for_each(|touch| self.push_new(touch));
        }
        self.scratch.overlap = overlap;
    }

    /// Adds the contact on the axis of exact separation if no corner attains it. It consists of two
    /// edges, or of a vertex and a face as good as the best one.
    fn deepest(&mut self, axis: &SeparatingAxis) {
        let pair = self.pair;
        let touch = match axis.kind {
            AxisSource::Edges(edge_a, edge_b) => {
                let points = closest_on_edges(&pair, &self.scratch.vertices, edge_a, edge_b);
                let feature = Feature::Edges(edge_a as u32, edge_b as u32);
                pair.between(&points, &axis.normal, feature, self.point_of())
            }
            AxisSource::FaceA(face) => {
                let (deepest, _) = lowest(&self.scratch.vertices, &axis.normal);
                let point = self.scratch.vertices[deepest];
                pair.on_face_a(face, &point, Feature::Vertex(PieceSide::B, deepest as u32))
            }
            AxisSource::FaceB(face) => {
                let (deepest, _) = highest(pair.a.vertices(), &axis.normal);
                let point = pair.a.vertices()[deepest];
                pair.on_face_b(face, &point, Feature::Vertex(PieceSide::A, deepest as u32))
            }
        };
        self.push_new(touch);
    }

    /// Adds the contacts along the shortest line: one, or the ends of the common part of parallel
    /// edges.
    fn edges(&mut self, axis: Option<&SeparatingAxis>) {
        let Some(points) = self.points else { return };
        let normal = self.normal(axis.copied());
        let merge = MERGE * self.pair.size();
        let most = points.distance() + merge;
        let mut parallel = None;
        self.scratch.near.each_pair(|edge_a, edge_b| {
            let is_close = || {
                closest_on_edges(&self.pair, &self.scratch.vertices, edge_a, edge_b).distance()
                    <= most
            };
            if parallel.is_none()
                && are_parallel(&self.pair, &self.scratch.vertices, edge_a, edge_b)
                && is_close()
            {
                parallel = Some((edge_a, edge_b));
            }
        });
        let before = self.out.len();
        if let Some((edge_a, edge_b)) = parallel {
            self.shared_ends(edge_a, edge_b, &normal, merge);
        }
        let ends = self.out[before..].iter().map(|touch| touch.gap).fold(f64::INFINITY, f64::min);
        if ends <= points.distance() - self.pair.radii() + merge * 1e-2 {
            return;
        }
        self.push_shortest(&points, &normal);
    }

    /// Adds the contact on the shortest line itself.
    fn push_shortest(&mut self, points: &Points, normal: &Vector3<f64>) {
        if let (Some(a), Some(b)) = (part_of(points.on_a), part_of(points.on_b))
            && self.pair.radii() > 0.0
        {
            let feature = Feature::Round(a, b);
            self.push_new(self.pair.between(points, normal, feature, PieceSide::A));
            return;
        }
        let (feature, owner) = match (points.on_a, points.on_b) {
            (On::Vertex(vertex), On::Edge(_) | On::Face(_)) => {
                (Feature::Vertex(PieceSide::A, vertex as u32), PieceSide::A)
            }
            (On::Edge(_) | On::Face(_), On::Vertex(vertex)) => {
                (Feature::Vertex(PieceSide::B, vertex as u32), PieceSide::B)
            }
            (On::Edge(edge_a), On::Edge(edge_b)) => {
                (Feature::Edges(edge_a as u32, edge_b as u32), self.point_of())
            }
            (On::Vertex(a), On::Vertex(b)) => {
                (Feature::Vertices(a as u32, b as u32), self.point_of())
            }
            (_, _) => return,
        };
        self.push_new(self.pair.between(points, normal, feature, owner));
    }

    /// Piece that owns the point if no other rule decides.
    fn point_of(&self) -> PieceSide {
        match self.plane_of {
            PieceSide::A => PieceSide::B,
            PieceSide::B => PieceSide::A,
        }
    }

    /// Adds both ends of the common part of two parallel edges, each as a vertex against the other
    /// edge.
    fn shared_ends(&mut self, edge_a: usize, edge_b: usize, normal: &Vector3<f64>, merge: f64) {
        let pair = self.pair;
        let (sides_a, sides_b) = (pair.a.edges()[edge_a], pair.b.edges()[edge_b]);
        let (p, u) = span(pair.a.vertices(), &sides_a);
        let (q, v) = span(&self.scratch.vertices, &sides_b);
        // Coordinates of both edges along A's edge, measured from A's first vertex.
        let length = u.norm();
        let first = u.dot(&(q - p)) / length;
        let second = u.dot(&(q + v - p)) / length;
        let ((low, low_at), (high, high_at)) =
            if first < second { ((first, 0), (second, 1)) } else { ((second, 1), (first, 0)) };
        if high.min(length) - low.max(0.0) <= merge {
            return;
        }
        let on_b = |a: Vector3<f64>| Points {
            a,
            b: closest_on_segment(&a, &q, &v),
            on_a: On::Edge(edge_a),
            on_b: On::Edge(edge_b),
        };
        let on_a = |b: Vector3<f64>| Points {
            a: closest_on_segment(&b, &p, &u),
            b,
            on_a: On::Edge(edge_a),
            on_b: On::Edge(edge_b),
        };
        let b_at = [q, q + v];
        // Each end uses the vertex that is farther inside. If both edges end there, it uses both
        // vertices.
        let end = |inside: f64, at_a: usize, at_b: usize| {
            let (a, b) = (sides_a.vertices[at_a], sides_b.vertices[at_b]);
            let a_end = p + u * at_a as f64;
            let (feature, owner) = if inside > merge {
                (Feature::Vertex(PieceSide::B, b), PieceSide::B)
            } else if inside < -merge {
                (Feature::Vertex(PieceSide::A, a), PieceSide::A)
            } else {
                (Feature::Vertices(a, b), self.point_of())
            };
            let points = if inside > merge { on_a(b_at[at_b]) } else { on_b(a_end) };
            if pair.radii() > 0.0 {
                // The end against the whole other edge, along which it may slide.
                let is_of_b =
                    inside > merge || (inside >= -merge && self.point_of() == PieceSide::B);
                let feature = if is_of_b {
                    Feature::Round(CorePart::Edge(edge_a as u32), CorePart::Vertex(b))
                } else {
                    Feature::Round(CorePart::Vertex(a), CorePart::Edge(edge_b as u32))
                };
                return (points, feature, owner);
            }
            (points, feature, owner)
        };
        let ends = [end(low, 0, low_at), end(length - high, 1, high_at)];
        for (points, feature, owner) in ends {
            let normal = pair.direction(&points.a, &points.b).unwrap_or(*normal);
            let touch = pair.between(&points, &normal, feature, owner);
            // If the edges are slightly skew, a plane may turn out of an edge into a face.
            if pair.is_below(&touch, merge) {
                self.push_new(touch);
            }
        }
    }

    /// Adds a contact within reach if its features have none yet.
    pub fn push_new(&mut self, touch: ManifoldPoint) {
        let is_new = self.out.iter().all(|other| other.feature != touch.feature);
        if is_new && touch.gap <= self.reach {
            self.out.push(touch);
        }
    }
}

/// Index of the face with the largest cosine to a direction, and the cosine. Only faces for which
/// `may` holds take part; ties take the first.
fn most_across(
    normals: impl Iterator<Item = Vector3<f64>>,
    may: impl Fn(usize) -> bool,
    direction: &Vector3<f64>,
) -> Option<(usize, f64)> {
    let mut best: Option<(usize, f64)> = None;
    for (index, normal) in normals.enumerate().filter(|(index, _)| may(*index)) {
        let cosine = normal.dot(direction);
        if best.is_none_or(|(_, most)| cosine > most) {
            best = Some((index, cosine));
        }
    }
    best
}

fn has(hull: &Hull, face: usize, vertex: usize) -> bool {
    hull.face_loop(face).iter().any(|corner| corner.vertex as usize == vertex)
}

fn are_parallel(
    pair: &PiecePair<'_>,
    vertices: &[Vector3<f64>],
    edge_a: usize,
    edge_b: usize,
) -> bool {
    let (Some(a), Some(b)) = (pair.a.edges().get(edge_a), pair.b.edges().get(edge_b)) else {
        return false;
    };
    let (u, v) = (span(pair.a.vertices(), a).1, span(vertices, b).1);
    u.cross(&v).norm() < NEARLY_PARALLEL * u.norm() * v.norm()
}

/// The vertex or edge, or `None` for a face.
fn part_of(on: On) -> Option<CorePart> {
    match on {
        On::Vertex(vertex) => Some(CorePart::Vertex(vertex as u32)),
        On::Edge(edge) => Some(CorePart::Edge(edge as u32)),
        On::Face(_) => None,
    }
}
