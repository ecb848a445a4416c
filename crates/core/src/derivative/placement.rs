//! Derivatives of contact features with respect to the body poses: the point in its body's frame,
//! and the plane in its owner's.
//!
//! A vertex against a face is fixed. A point that slides along an edge and a plane spanned by two
//! edges are functions of both poses, differentiated analytically here. The feature identifiers
//! select the function, and the result is compared with the numbers of the contact.

use super::side::SideChange;
use crate::contact::{Contact, Features, PairFeatures, Partner};
use crate::geometry::{Feature, Piece, edges_across};
use crate::mechanics::Pose;
use crate::world::World;
use nalgebra::{Matrix2, Vector2, Vector3};

/// Relative tolerance of the comparison with the features.
const SAME: f64 = 1e-7;

/// Differentials of [`Features`].
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct FeatureChange {
    /// Point δa (m), frame of A.
    pub(super) point: Vector3<f64>,
    /// Radius δρ (m).
    pub(super) radius: f64,
    /// Normal δn, frame of B.
    pub(super) normal: Vector3<f64>,
    /// Offset δd (m).
    pub(super) offset: f64,
}

/// Edge in the world frame: a point on it, and its vector (m).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Line {
    from: Vector3<f64>,
    along: Vector3<f64>,
    /// First end of the edge.
    start: Vector3<f64>,
}

/// Dependence of the point and the plane of a contact on the poses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Placement {
    /// Vertex of A against a face of B or the ground.
    Fixed,
    /// Crossing point of an edge of A and an edge of B, projected along the normal of a face of B,
    /// against that face. If the projection is not along the normal, its axis is spanned by two
    /// edges.
    Crossing { of_a: Line, of_b: Line, axis: Option<(Line, Line)> },
    /// Nearest points of two edges, and the plane spanned by them.
    Edges { of_a: Line, of_b: Line },
    /// Vertex of the fixed B against a face of A, described by the foot of the vertex on a plane in
    /// the opposite orientation. If the vertex slides along an edge of B, the edges of B and A are
    /// given.
    Turned { slides: Option<(Line, Line)> },
    /// Unknown; treated as fixed.
    Unknown,
}

/// Component of `v` orthogonal to the unit vector `n`.
pub(super) fn across(n: &Vector3<f64>, v: &Vector3<f64>) -> Vector3<f64> {
    v - n * n.dot(v)
}

/// Differentials of a plane n·x = d when its body is stretched, x_k → (1 + σ_k) x_k:
///
/// ```text
/// δn = −(E − n nᵀ) σ∘n,   δd = d n·(σ∘n)
/// ```
fn stretched(normal: &Vector3<f64>, offset: f64, stretch: &Vector3<f64>) -> (Vector3<f64>, f64) {
    let scaled = stretch.component_mul(normal);
    (-across(normal, &scaled), offset * normal.dot(&scaled))
}

impl Placement {
    /// Placement of the polyhedral `contact` at these poses. Also returns its distance from the end
    /// of its features (m): from the sides of a face, or from the ends of an edge. There another
    /// contact replaces it.
    pub(super) fn from_contact(
        world: &World,
        contact: &Contact,
        a: &Pose,
        b: Option<&Pose>,
    ) -> (Self, f64) {
        const ENDLESS: f64 = f64::INFINITY;
        let Some(pair) = contact.key.pair else { return (Self::Fixed, ENDLESS) };
        let body = &world.bodies()[contact.key.body];
        let other = match contact.key.partner {
            Partner::Ground => return (Self::Fixed, ENDLESS),
            Partner::Fixed(index) => world.fixed_piece(index, pair.pieces.1),
            Partner::Body(index) => world.bodies()[index].pieces().get(pair.pieces.1),
        };
        let (Some(of_a), Some(of_b)) = (body.pieces().get(pair.pieces.0), other) else {
            return (Self::Unknown, 0.0);
        };
        let placed = PlacedPair { pair, pieces: (of_a, of_b), contact, poses: (a, b) };
        let placement = placed.placement();
        let is_endless = matches!(placement, Self::Fixed) && is_of_terrain(world, contact);
        let room = if is_endless { ENDLESS } else { placed.room(&placement) };
        (placement, room)
    }

    /// Placement of a contact whose point follows from its plane, and the distance of the point from
    /// the sides of the face (m). The plane is fixed in B if it is a face or the ground.
    pub(super) fn from_ellipsoid_contact(
        world: &World,
        contact: &Contact,
        a: &Pose,
        b: Option<&Pose>,
    ) -> (Self, f64) {
        let Some(pair) = contact.key.pair else { return (Self::Fixed, f64::INFINITY) };
        let other = match contact.key.partner {
            Partner::Ground => None,
            Partner::Fixed(index) => world.fixed_piece(index, pair.pieces.1),
            Partner::Body(index) => world.bodies()[index].pieces().get(pair.pieces.1),
        };
        let point = a.position + contact.arm;
        let plane = &contact.features.frame;
        let normal = plane.column(2).into_owned();
        match other.filter(|piece| has_face(piece, &normal, contact.features.offset)) {
            Some(_) if is_of_terrain(world, contact) => (Self::Fixed, f64::INFINITY),
            Some(piece) => {
                let local = b.map_or(point, |b| b.rotation.tr_mul(&(point - b.position)));
                (Self::Fixed, inside(piece, &normal, &local))
            }
            None => (Self::Unknown, 0.0),
        }
    }

    /// Differentials of the features for the differentials of both sides.
    pub(super) fn change(
        &self,
        contact: &Contact,
        a: &SideChange,
        b: &SideChange,
    ) -> FeatureChange {
        let Features { point, frame, offset, .. } = &contact.features;
        let normal = frame.column(2).into_owned();
        let (n, x) = (contact.normal(), a.place(point));
        // Face of B, with the radius of B in its offset.
        let face = || {
            let (normal, height) = stretched(&normal, offset - b.own_radius, &b.stretch);
            (normal, height + b.radius)
        };
        let own_point = a.stretch.component_mul(point);
        match self {
            // Points and planes move and stretch with their bodies.
            Self::Fixed | Self::Unknown => {
                let (normal, offset) = face();
                FeatureChange { point: own_point, radius: a.radius, normal, offset }
            }
            // Two edges cross along an axis: the point slides along the edge of A.
            Self::Crossing { of_a, of_b, axis } => {
                let (normal, offset) = face();
                let (along, turned) = match axis {
                    Some((u, v)) => spanned(u, a, v, b, &n),
                    None => (n, b.rotation * normal + b.turn.cross(&n)),
                };
                let slid = slide(of_a, a, of_b, b, &along, &turned);
                let point = own_point + a.rotation.tr_mul(&slid);
                FeatureChange { point, radius: a.radius, normal, offset }
            }
            // Nearest points of two edges, and the normal across both.
            Self::Edges { of_a, of_b } => {
                let (u, v, y) = (of_a.along, of_b.along, of_b.from);
                let (by_a, by_b) = (a.linear(), b.linear());
                let turned = spanned(of_a, a, of_b, b, &n).1;
                // The connecting vector stays orthogonal to both edges.
                let (apart, moved) = (x - y, a.carried(&x) - b.carried(&y));
                let matrix = Matrix2::new(u.dot(&u), -u.dot(&v), u.dot(&v), -v.dot(&v));
                let rhs = Vector2::new(
                    -(moved.dot(&u) + apart.dot(&(by_a * u))),
                    -(moved.dot(&v) + apart.dot(&(by_b * v))),
                );
                let slid = matrix.lu().solve(&rhs).map_or(0.0, |slid| slid[0]);
                let normal = b.rotation.tr_mul(&(turned - b.turn.cross(&n)));
                let local = b.rotation.tr_mul(&(y - b.origin));
                let height = frame.column(2).dot(&b.stretch.component_mul(&local));
                FeatureChange {
                    point: own_point + a.rotation.tr_mul(&(u * slid)),
                    radius: a.radius,
                    normal,
                    offset: normal.dot(&local) + height + b.radius,
                }
            }
            Self::Turned { slides } => {
                // Face of A, whose outward normal is −n, and the point of B's surface in the plane.
                let own = -a.rotation.tr_mul(&n);
                let (tilted, height) = stretched(&own, own.dot(point) - a.own_radius, &a.stretch);
                let turned = a.turn.cross(&n) - a.rotation * tilted;
                let surface = x + n * (offset - n.dot(&x));
                let mut moved = turned * b.own_radius + n * b.radius;
                if let Some((of_b, of_a)) = slides {
                    moved += slide(of_b, b, of_a, a, &n, &turned);
                }
                // The contact point is the foot of the surface point on the face.
                let above = n.dot(&(surface - x));
                let rigid = a.turn.cross(&(x - a.origin)) + a.position;
                let slip = across(&n, &(moved - turned * above - rigid));
                FeatureChange {
                    point: a.rotation.tr_mul(&slip) + own * (height + a.radius - tilted.dot(point)),
                    radius: 0.0,
                    normal: turned,
                    offset: turned.dot(&surface) + n.dot(&moved),
                }
            }
        }
    }
}

/// True for a contact with a terrain, whose planes go on beyond their triangles.
fn is_of_terrain(world: &World, contact: &Contact) -> bool {
    matches!(contact.key.partner, Partner::Fixed(index) if world.terrain(index).is_some())
}

/// Unit vector orthogonal to a line of A and a line of B, on the side of `n`, and its differential.
fn spanned(
    of_a: &Line,
    a: &SideChange,
    of_b: &Line,
    b: &SideChange,
    n: &Vector3<f64>,
) -> (Vector3<f64>, Vector3<f64>) {
    let (u, v) = (of_a.along, of_b.along);
    let cross = u.cross(&v);
    let size = cross.norm().copysign(n.dot(&cross));
    let along = cross / size;
    let turned = (a.linear() * u).cross(&v) + u.cross(&(b.linear() * v));
    (along, across(&along, &turned) / size)
}

/// Displacement along line P of its crossing with line Q, projected along `normal` (m), world
/// frame. With m = n × v, (x − y)·m stays 0.
fn slide(
    of_p: &Line,
    p: &SideChange,
    of_q: &Line,
    q: &SideChange,
    normal: &Vector3<f64>,
    turned: &Vector3<f64>,
) -> Vector3<f64> {
    let (x, y, v) = (of_p.from, of_q.from, of_q.along);
    let across = normal.cross(&v);
    let across_turned = turned.cross(&v) + normal.cross(&(q.linear() * v));
    let moved = p.carried(&x) - q.carried(&y);
    let by = -(moved.dot(&across) + (x - y).dot(&across_turned)) / of_p.along.dot(&across);
    if by.is_finite() { of_p.along * by } else { Vector3::zeros() }
}

/// Contact of two pieces at given poses.
struct PlacedPair<'a> {
    pair: PairFeatures,
    pieces: (&'a Piece, &'a Piece),
    contact: &'a Contact,
    poses: (&'a Pose, Option<&'a Pose>),
}

impl PlacedPair<'_> {
    fn placement(&self) -> Placement {
        let Features { frame, offset, .. } = &self.contact.features;
        let normal = frame.column(2).into_owned();
        if has_face(self.pieces.1, &normal, *offset) {
            return self.on_face_of_b();
        }
        let (a, _) = self.poses;
        let own = -a.rotation.tr_mul(&self.contact.normal());
        let height = own.dot(&self.contact.features.point);
        let is_fixed = matches!(self.contact.key.partner, Partner::Fixed(_));
        if is_fixed && has_face(self.pieces.0, &own, height) {
            return self.on_face_of_a();
        }
        self.edges()
    }

    /// Size of the larger piece (m).
    fn size(&self) -> f64 {
        let size = |piece: &Piece| piece.core().reach() + piece.radius();
        size(self.pieces.0).max(size(self.pieces.1))
    }

    /// Distance of the contact from the end of its features (m).
    fn room(&self, placement: &Placement) -> f64 {
        let (a, b) = self.poses;
        let x = a.position + a.rotation * self.contact.features.point;
        let n = self.contact.normal();
        match placement {
            Placement::Fixed => {
                let local = b.map_or(x, |b| b.rotation.tr_mul(&(x - b.position)));
                inside(self.pieces.1, &self.contact.features.frame.column(2).into(), &local)
            }
            Placement::Turned { slides: None } => {
                inside(self.pieces.0, &-a.rotation.tr_mul(&n), &self.contact.features.point)
            }
            Placement::Crossing { of_a, of_b, .. } | Placement::Edges { of_a, of_b } => {
                let on_b = of_b.from
                    + of_b.along * of_b.along.dot(&(x - of_b.from)) / of_b.along.norm_squared();
                self.left_of(of_a, &x).min(self.left_of(of_b, &on_b))
            }
            Placement::Turned { slides: Some((of_b, of_a)) } => {
                let on_a = of_a.from
                    + of_a.along * of_a.along.dot(&(x - of_a.from)) / of_a.along.norm_squared();
                self.left_of(of_b, &of_b.from).min(self.left_of(of_a, &on_a))
            }
            Placement::Unknown => 0.0,
        }
    }

    /// Distance of a point on an edge's line from the ends of the edge (m).
    fn left_of(&self, line: &Line, point: &Vector3<f64>) -> f64 {
        let along = line.along.normalize();
        let from = (point - line.start).dot(&along);
        from.abs().min((line.along.norm() - from).abs())
    }

    fn is_vertex(&self, piece: &Piece, point: &Vector3<f64>) -> bool {
        piece.core().vertices().iter().any(|vertex| (vertex - point).norm() <= SAME * self.size())
    }

    /// Edges of A and B named by the feature identifiers, in the world frame. Both orders are
    /// returned, because either piece may come first in the pair.
    fn lines(&self) -> impl Iterator<Item = (Line, Line)> {
        let numbers = match self.pair.feature {
            Feature::Edges(first, second) => Some((first, second)),
            _ => None,
        };
        let orders = numbers.map_or([None, None], |(i, j)| [Some((i, j)), Some((j, i))]);
        orders.into_iter().flatten().filter_map(|(i, j)| self.pair_of_lines(i, j))
    }

    /// Edge `i` of A and edge `j` of B.
    fn pair_of_lines(&self, i: u32, j: u32) -> Option<(Line, Line)> {
        let (a, b) = self.poses;
        let line = |piece: &Piece, number: u32, pose: Option<&Pose>| {
            let core = piece.core();
            let [from, to] = core.edges().get(number as usize)?.vertices;
            let [from, to] = [from, to].map(|vertex| {
                let vertex = core.vertices()[vertex as usize];
                pose.map_or(vertex, |pose| pose.position + pose.rotation * vertex)
            });
            Some(Line { from, along: to - from, start: from })
        };
        Some((line(self.pieces.0, i, Some(a))?, line(self.pieces.1, j, b)?))
    }

    /// Edges that span the projection axis of two faces, if the axis is spanned by edges.
    fn axis(&self) -> Option<(Line, Line)> {
        let still = Pose { position: Vector3::zeros(), rotation: nalgebra::Matrix3::identity() };
        let (a, b) = (self.poses.0, self.poses.1.unwrap_or(&still));
        let (i, j) = edges_across((self.pieces.0, a), (self.pieces.1, b))?;
        self.pair_of_lines(i as u32, j as u32)
    }

    fn on_face_of_b(&self) -> Placement {
        let point = &self.contact.features.point;
        if self.is_vertex(self.pieces.0, point) {
            return Placement::Fixed;
        }
        let (a, _) = self.poses;
        let x = a.position + a.rotation * point;
        let n = self.contact.normal();
        self.crossing(&x, &n).map_or(Placement::Unknown, |(of_a, of_b)| Placement::Crossing {
            of_a,
            of_b,
            axis: self.axis(),
        })
    }

    /// Edges whose crossing is x, projected along n; x is on the edge of A.
    fn crossing(&self, x: &Vector3<f64>, n: &Vector3<f64>) -> Option<(Line, Line)> {
        let near = SAME * self.size();
        self.lines().find_map(|(of_a, of_b)| {
            let on_a = distance(&of_a, x) <= near;
            let m = n.cross(&of_b.along).normalize();
            let on_b = m.dot(&(x - of_b.from)).abs() <= near;
            (on_a && on_b).then_some((Line { from: *x, ..of_a }, of_b))
        })
    }

    fn on_face_of_a(&self) -> Placement {
        let (a, _) = self.poses;
        let n = self.contact.normal();
        let foot = a.position + a.rotation * self.contact.features.point;
        let surface = foot + n * (self.contact.features.offset - n.dot(&foot));
        let vertex = surface - n * self.pieces.1.radius();
        if self.is_vertex(self.pieces.1, &vertex) {
            return Placement::Turned { slides: None };
        }
        let near = SAME * self.size();
        let slides = self.lines().find_map(|(of_a, of_b)| {
            let m = n.cross(&of_a.along).normalize();
            let on_both =
                distance(&of_b, &vertex) <= near && m.dot(&(vertex - of_a.from)).abs() <= near;
            on_both.then_some((Line { from: vertex, ..of_b }, of_a))
        });
        match slides {
            Some(lines) => Placement::Turned { slides: Some(lines) },
            None => Placement::Unknown,
        }
    }

    fn edges(&self) -> Placement {
        let (a, b) = self.poses;
        let Features { point, frame, offset, .. } = &self.contact.features;
        let x = a.position + a.rotation * point;
        let n = self.contact.normal();
        let near = SAME * self.size();
        let found = self.lines().find_map(|(of_a, of_b)| {
            let cross = of_a.along.cross(&of_b.along).normalize();
            let spanned = cross.cross(&n).norm() <= SAME && distance(&of_a, &x) <= near;
            // Nearest point to x on B's edge.
            let (u, v) = (of_a.along, of_b.along);
            let w = x - of_b.from;
            let share = (w - u * (u.dot(&w) / u.dot(&u))).dot(&v)
                / across(&u.normalize(), &v).norm_squared();
            let y = of_b.from + v * share;
            let local = b.map_or(y, |b| b.rotation.tr_mul(&(y - b.position)));
            let height = frame.column(2).dot(&local) + self.pieces.1.radius();
            let is_in_plane = (height - offset).abs() <= near;
            (spanned && is_in_plane).then_some((Line { from: x, ..of_a }, Line { from: y, ..of_b }))
        });
        found.map_or(Placement::Unknown, |(of_a, of_b)| Placement::Edges { of_a, of_b })
    }
}

/// True if a piece has a face in this plane, including its radius.
fn has_face(piece: &Piece, normal: &Vector3<f64>, offset: f64) -> bool {
    let near = SAME * (piece.core().reach() + piece.radius());
    piece.core().faces().iter().any(|face| {
        (face.normal - normal).norm() <= SAME
            && (face.offset + piece.radius() - offset).abs() <= near
    })
}

/// Distance of a point from a line (m).
fn distance(line: &Line, point: &Vector3<f64>) -> f64 {
    let along = line.along.normalize();
    across(&along, &(point - line.from)).norm()
}

/// Distance of `point` from the nearest side of the face of `piece` with this normal (m), projected
/// along the normal.
fn inside(piece: &Piece, normal: &Vector3<f64>, point: &Vector3<f64>) -> f64 {
    let core = piece.core();
    let mut faces = core.faces().iter();
    let Some(face) = faces.position(|face| (face.normal - normal).norm() <= SAME) else {
        return 0.0;
    };
    let (corners, vertices) = (core.face_loop(face), core.vertices());
    let next = corners.iter().cycle().skip(1);
    let sides = corners.iter().zip(next).map(|(corner, next)| {
        let from = vertices[corner.vertex as usize];
        let inward = normal.cross(&(vertices[next.vertex as usize] - from)).normalize();
        inward.dot(&(point - from)).abs()
    });
    sides.fold(f64::INFINITY, f64::min)
}
