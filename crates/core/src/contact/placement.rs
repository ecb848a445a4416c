//! Placement of loaded contacts: whether a contact is where two pieces touch.
//!
//! The certificate judges how well the equations of a set of contacts are solved. This module judges
//! the set, from the shapes alone. With the pieces a and b of a loaded contact at the end of the step,
//! its normal n, its gap φ and its touching point x,
//!
//! ```text
//! s = min_a n·x − max_b n·x,
//! e = max( |s − φ| − δ_φ,   d_a(x) − δ_x,   d_b(x) − δ_x ),                (eq. 18g)
//! δ_φ = 10⁻⁷ ℓ + (ϑ r + τ) ϑ + 0.03 τ + o,   δ_x = δ_φ + τ,   ϑ = h (|ω_A| + |ω_B|)
//! ```
//!
//! s is the separation of the pieces along the normal, from their support functions. The normal is
//! fixed in B, fixed in A, or across both edges if two edges touch, and the largest s counts. If e is
//! positive with o = 0, the shortest line and o are computed. The normal may also be along that line if it is
//! within ϑ + 0.03 rad. d is the height of the point above a piece.
//!
//! Points and planes are fixed to their bodies within a step, so rotation and motion are allowed for.
//! τ is the way of the touching point over both bodies in the step. A plane continues that far beyond
//! its face. ℓ is the reach of the smaller piece, r that of the larger body, and o the overlap of the
//! pair, which is reported. A continued distance (4b) may be smaller than s. A contact whose normal is
//! more than ϑ off those of all [exposed](super::exposure) faces at x has the error ℓ. If x is beside a
//! piece by up to δ_x, its faces are those at the nearest place across n. A hidden contact has no error if
//! the pieces overlap along the normals of all other exposed faces. Of the triangles of a terrain within
//! δ_x of the point, the one with the smallest |s − φ| counts.
//!
//! A bouncing contact does not close at the end of the step. It is judged at the start, with δ of
//! first order in ϑ.
//!
//! The error is a function of the contact and of the poses around it. A contact whose surroundings
//! have not moved since the last step keeps its error ([`KnownErrors`]).

use super::collider::{Collider, PieceOwner, placed, size};
use super::curved::Core;
use super::exposure::{Exposure, ExposureScratch};
use super::partners::Partners;
use super::{Contact, Curved, KeyIndex, Partner};
use crate::geometry::{
    Feature, Hint, PairScratch, Piece, closest_segment_parameters, signed_distance,
};
use crate::mechanics::{Pose, largest};
use crate::world::World;
use nalgebra::{Matrix3, Vector3};

/// Rounding and drift of gaps and places, as a fraction of the smaller piece.
const ROUNDING: f64 = 1e-7;

/// Error above which a contact is not where its pieces touch, as a fraction of the smaller piece.
pub(super) const MISPLACED: f64 = 1e-4;

/// Angle up to which a contact point has the normal of a face instead of that of the shortest line (rad),
/// see [`manifold`](crate::geometry::manifold()).
const ACROSS: f64 = 0.03;

/// Largest number of passes over the surfaces of two pieces. Two edges across each other take a few.
const SHIFTS: u32 = 30;

/// Workspace of the check.
#[derive(Debug, Clone, Default)]
pub(super) struct PlacementScratch {
    pub(super) exposure: ExposureScratch,
    hint: Hint,
    pair: PairScratch,
}

/// Errors of contacts around which nothing moved in the last step.
#[derive(Debug, Clone, Default)]
pub(super) struct KnownErrors {
    /// Contacts of the last step whose surroundings did not move in it, and their errors (m).
    contacts: Vec<Contact>,
    errors: Vec<f64>,
    index: KeyIndex,
    /// Contacts and errors of the current step.
    next: (Vec<Contact>, Vec<f64>),
    /// Poses at the end of the last step, and the version of the near pieces in it.
    end: Vec<Pose>,
    version: u64,
    /// Motion of each body.
    motions: Vec<Motion>,
}

/// Motion of a body in the current and the last step, the fastest first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Motion {
    Moves,
    /// It has the same pose at both ends of the step.
    Stops,
    /// It has the same pose as at the end of the last step, too.
    Rests,
}

impl KnownErrors {
    /// Largest error of the `loaded` contacts in the step of `check` (m), as of
    /// [`PlacementCheck::error`]. `visit` gets those that are [misplaced](PlacementCheck::is_misplaced).
    pub(super) fn largest<'c>(
        &mut self,
        check: &PlacementCheck<'_>,
        loaded: impl Iterator<Item = &'c Contact>,
        scratch: &mut PlacementScratch,
        mut visit: impl FnMut(&Contact, f64),
    ) -> f64 {
        let Self { contacts, errors, index, next, end, version, motions } = self;
        if *version != check.partners.version() {
            *version = check.partners.version();
            end.clear();
        }
        // A contact between bodies at rest keeps its error.
        motions.clear();
        let ends = check.start.iter().zip(check.end).enumerate();
        motions.extend(ends.map(|(body, (from, to))| {
            if from != to {
                Motion::Moves
            } else if end.get(body) == Some(to) {
                Motion::Rests
            } else {
                Motion::Stops
            }
        }));
        index.clear();
        next.0.clear();
        next.1.clear();
        let fastest = motions.iter().copied().min().unwrap_or(Motion::Rests);
        let mut most = 0.0;
        for contact in loaded {
            let motion = match fastest {
                Motion::Rests => fastest,
                Motion::Moves | Motion::Stops => check.fastest_near(contact, motions),
            };
            // The error of the last step, if bodies, contact and surroundings are the same.
            let place = match motion {
                Motion::Rests => index.place(contacts, &contact.key, next.0.len()),
                Motion::Moves | Motion::Stops => None,
            };
            let error = match place {
                Some(place) if contacts[place] == *contact => errors[place],
                _ => check.error(contact, scratch),
            };
            if motion != Motion::Moves {
                next.0.push(*contact);
                next.1.push(error);
            }
            if error != 0.0 && check.is_misplaced(contact, error) {
                visit(contact, error);
            }
            most = largest(most, error);
        }
        // Contacts whose surroundings do not move are known in the next step.
        std::mem::swap(contacts, &mut next.0);
        std::mem::swap(errors, &mut next.1);
        check.end.clone_into(end);
        most
    }
}

/// Errors within a step that are due to a contact being fixed to its bodies.
#[derive(Debug, Clone, Copy)]
struct Allowance {
    /// Angle of its normal (rad).
    angle: f64,
    /// Way of its touching point (m).
    way: f64,
    /// Overlap of the pieces (m).
    overlap: f64,
}

/// Poses of the bodies at both ends of a step.
pub(super) struct PlacementCheck<'a> {
    pub(super) world: &'a World,
    pub(super) partners: &'a Partners,
    pub(super) start: &'a [Pose],
    pub(super) end: &'a [Pose],
}

impl PlacementCheck<'_> {
    /// Fastest motion of the bodies of a contact and of all pieces near both of its own.
    fn fastest_near(&self, contact: &Contact, motions: &[Motion]) -> Motion {
        let bodies = contact.key.bodies().map(|body| motions[body]);
        let own = bodies.min().unwrap_or(Motion::Rests);
        let colliders = self.partners.colliders_of(contact).filter(|_| own != Motion::Moves);
        let Some(numbers) = colliders.map(|of| of.map(|(number, _)| number)) else {
            return Motion::Moves;
        };
        let mut fastest = own;
        self.partners.each_near(numbers, &mut |_, collider| {
            if let PieceOwner::Body(body) = collider.owner {
                fastest = fastest.min(motions[body]);
            }
        });
        fastest
    }

    /// Error of a loaded contact between two pieces (eq. 18g) (m); 0 if it is where they touch. NaN if
    /// the world does not have its pieces.
    fn error(&self, contact: &Contact, scratch: &mut PlacementScratch) -> f64 {
        let Some(named) = self.partners.colliders_of(contact) else { return f64::NAN };
        let (poses, is_end) =
            if contact.bounces() { (self.start, false) } else { (self.end, true) };
        let pieces = named.map(|(_, collider)| placed(self.world, poses, collider).0);
        let length = size(pieces[0]).min(size(pieces[1]));
        // ϑ, τ, δ_φ and δ_x of (18g). A bouncing contact is judged at the start, to first order in ϑ.
        let (turned, travel) = (self.turn(contact), self.travel(contact));
        let rounding = ROUNDING * length;
        let reach = self.reach(contact);
        let by_turn = if is_end { turned * reach + travel } else { reach };
        let second_order = by_turn * turned + travel * ACROSS;
        let slack = rounding + travel + second_order;

        let colliders = self.with_triangle(contact, named, poses, slack);
        let [a, b] = colliders.map(|(_, collider)| placed(self.world, poses, collider));
        let b_pose = matches!(contact.key.partner, Partner::Body(_)).then_some(b.1);
        let gap = contact.gap_at(a.1, b_pose);
        let (normal, on_a) = touching_point(contact, a.1, b.1);
        let on_b = on_a - normal * gap;
        // s, the largest separation along the normals that count.
        let along = |n: &Vector3<f64>| -extent(a, &-n) - extent(b, n);
        let mut separation = along(&normal);
        for other in self.normals(contact, &normal, a.1) {
            separation = separation.max(along(&other));
        }
        let PlacementScratch { exposure, hint, pair } = scratch;
        let continued = contact.features.curved.as_ref().and_then(Curved::cores).is_some();
        // |s − φ| − δ_φ. The continued gap (4b) of two cores may be less than s.
        let misses = |separation: f64, overlap: f64| match separation - gap {
            above if above > 0.0 && continued => 0.0,
            other => other.abs() - rounding - second_order - overlap,
        };
        let far = |(piece, pose): (&Piece, &Pose), point: &Vector3<f64>| {
            piece.height_of(&pose.rotation.tr_mul(&(point - pose.position)))
        };
        // A plane of a terrain belongs to all triangles in it.
        let off_b = if self.is_on_terrain(contact) { 0.0 } else { far(b, &on_b) };
        let beside = far(a, &on_a).max(off_b) - slack;
        // The shortest line counts only where the other normals give an error, because it costs a search.
        let mut error = misses(separation, 0.0).max(beside).max(0.0);
        if error > 0.0 {
            let nearest = signed_distance(a, b, hint, pair);
            if -nearest.axis.dot(&normal) >= libm::cos(turned + ACROSS) {
                separation = separation.max(nearest.distance);
            }
            let overlap = (-nearest.distance).max(0.0);
            error = misses(separation, overlap).max(beside - overlap).max(0.0);
        }
        if error > 0.0 {
            return error;
        }
        // The faces at x have to be exposed (4d), at one end of the step.
        let other_end = if is_end { self.start } else { self.end };
        let overlap = rounding + (gap - separation).max(0.0);
        let allowed = Allowance { angle: turned, way: slack, overlap };
        let is_shown = self.is_shown(contact, colliders, poses, allowed, exposure) || {
            let colliders = self.with_triangle(contact, named, other_end, slack);
            self.is_shown(contact, colliders, other_end, allowed, exposure)
        };
        if is_shown { 0.0 } else { length }
    }

    /// True if a contact with this `error` (18g) (m) is not where its pieces touch. A NaN is an error too.
    fn is_misplaced(&self, contact: &Contact, error: f64) -> bool {
        let Some(colliders) = self.partners.colliders_of(contact) else { return true };
        let sizes = colliders.map(|(_, collider)| size(placed(self.world, self.end, collider).0));
        let is_small = error <= MISPLACED * sizes[0].min(sizes[1]);
        !is_small
    }

    /// True if the contact is on exposed surfaces of its `colliders` where it is with the bodies at `poses`,
    /// or nearby where both have surfaces.
    fn is_shown(
        &self,
        contact: &Contact,
        colliders: [(usize, Collider); 2],
        poses: &[Pose],
        allowed: Allowance,
        scratch: &mut ExposureScratch,
    ) -> bool {
        let exposed = Exposure {
            world: self.world,
            partners: self.partners,
            colliders: colliders.map(|(_, collider)| collider),
            numbers: colliders.map(|(number, _)| number),
        };
        let both = exposed.colliders.map(|collider| placed(self.world, poses, collider));
        let [a, b] = both.map(|(_, pose)| pose);
        let b_pose = matches!(contact.key.partner, Partner::Body(_)).then_some(b);
        let (normal, on_a) = touching_point(contact, a, b);
        let points = [on_a, on_a - normal * contact.gap_at(a, b_pose)];
        let mut is_shown_at = |shift: Vector3<f64>| {
            let points = [(points[0] + shift, -normal), (points[1] + shift, normal)];
            exposed.shows(points, poses, (&[self.start, self.end], allowed.angle), scratch)
        };
        if is_shown_at(Vector3::zeros()) {
            return true;
        }
        let shift = level_shift_into(both, points, &normal);
        if shift.norm() <= allowed.way && is_shown_at(shift) {
            return true;
        }
        let along = libm::cos(allowed.angle + ACROSS);
        let is_other = |m: &Vector3<f64>| normal.dot(m).abs() < along;
        let best = exposed.best_exposed_face(poses, &[self.start, self.end], is_other, scratch);
        best.is_none_or(|best| best.height < -allowed.overlap)
    }

    /// The colliders of a contact, for a terrain with the triangle at the contact. A plane of a terrain
    /// belongs to all triangles in it, and the key names the first. Of the triangles within `slack` (m)
    /// of the touching point it is the one whose separation along the normal is nearest to the gap, as
    /// for a body that moves over a vertex.
    fn with_triangle(
        &self,
        contact: &Contact,
        named: [(usize, Collider); 2],
        poses: &[Pose],
        slack: f64,
    ) -> [(usize, Collider); 2] {
        let [(number, a), b] = named;
        if !self.is_on_terrain(contact) {
            return named;
        }
        if let Some(plane) = self.plane_of_patch(number, b) {
            return [named[0], plane];
        }
        let [body, still] = [a, b.1].map(|collider| placed(self.world, poses, collider));
        let (normal, point) = touching_point(contact, body.1, still.1);
        let on_plane = -extent(body, &-normal) - contact.gap_at(body.1, None);
        let error = |collider: Collider| {
            let triangle = placed(self.world, poses, collider);
            let beside = (triangle.0.height_of(&point) - slack).max(0.0);
            (beside, (on_plane - extent(triangle, &normal)).abs())
        };
        let is_far = |collider: Collider| {
            let triangle = placed(self.world, poses, collider).0;
            let reach = triangle.bounding_radius() + slack;
            (point - triangle.core().centre()).norm_squared() > reach * reach
        };
        let (mut nearest, mut least) = (b, error(b.1));
        self.partners.each_near([number, b.0], &mut |other, collider| {
            if collider.owner == b.1.owner && !(least.0 == 0.0 && is_far(collider)) {
                let found = error(collider);
                if found < least {
                    (nearest, least) = ((other, collider), found);
                }
            }
        });
        [named[0], nearest]
    }

    /// The plane of the patch of the triangle `b`, if the piece `a` of a body touches it instead of triangles.
    fn plane_of_patch(&self, a: usize, b: (usize, Collider)) -> Option<(usize, Collider)> {
        let PieceOwner::Fixed(index) = b.1.owner else { return None };
        let piece = self.world.terrain(index)?.plane(b.1.piece);
        let number = b.0 + piece - b.1.piece;
        self.partners.are_near([a, number]).then_some((number, Collider { piece, ..b.1 }))
    }

    fn is_on_terrain(&self, contact: &Contact) -> bool {
        match contact.key.partner {
            Partner::Fixed(index) => self.world.terrain(index).is_some(),
            Partner::Body(_) | Partner::Ground => false,
        }
    }

    /// Other normals of the contact at the end: fixed in A, and across two edges.
    fn normals(&self, contact: &Contact, normal: &Vector3<f64>, a: &Pose) -> [Vector3<f64>; 2] {
        let start = &self.start[contact.key.body];
        let with_a = a.rotation * start.rotation.tr_mul(&contact.normal());
        let edges = self.edges(contact, self.end);
        let across = edges.and_then(|[u, v]| u.along.cross(&v.along).try_normalize(0.0));
        [with_a, across.map_or(with_a, |across| across * across.dot(normal).signum())]
    }

    /// Edges of a contact between two edges (m, world), that of A first.
    fn edges(&self, contact: &Contact, poses: &[Pose]) -> Option<[Core; 2]> {
        let Feature::Edges(first, second) = contact.key.pair?.feature else { return None };
        // The features of a pair are in the order of the bodies.
        let numbers = match contact.key.partner {
            Partner::Body(other) if other < contact.key.body => [second, first],
            _ => [first, second],
        };
        let colliders = self.partners.colliders_of(contact)?.map(|(_, collider)| collider);
        let edge = |side: usize| {
            let (piece, pose) = placed(self.world, poses, colliders[side]);
            let ends = piece.core().edges().get(numbers[side] as usize)?.vertices;
            let [from, to] = ends.map(|end| piece.core().vertices()[end as usize]);
            Some(Core { from, along: to - from }.moved(&pose.rotation, &pose.position))
        };
        Some([edge(0)?, edge(1)?])
    }

    /// τ: way of the touching point over both bodies in the step (m). Two edges touch where they cross.
    /// At the end they may not cross any more, so the way of the point fixed to A counts too.
    fn travel(&self, contact: &Contact) -> f64 {
        let still = Pose { position: Vector3::zeros(), rotation: Matrix3::identity() };
        let normal = contact.features.frame.column(2);
        let ends = [self.start, self.end];
        let offset_vector = |points: [[Vector3<f64>; 2]; 2]| {
            let place = |end: usize, side: usize| {
                let body =
                    if side == 0 { Some(contact.key.body) } else { contact.key.partner.body() };
                let pose = body.map_or(&still, |body| &ends[end][body]);
                pose.rotation.tr_mul(&(points[end][side] - pose.position))
            };
            let [over_a, over_b] = [0, 1].map(|side| place(1, side) - place(0, side));
            over_a.norm() + (over_b - normal * normal.dot(&over_b)).norm()
        };
        let fixed = ends.map(|poses| {
            let b = contact.key.partner.body().map_or(&still, |body| &poses[body]);
            [touching_point(contact, &poses[contact.key.body], b).1; 2]
        });
        let crossings = ends.map(|poses| {
            self.edges(contact, poses).map(|[u, v]| {
                let (s, t) = closest_segment_parameters(&u.from, &u.along, &v.from, &v.along);
                [u.at(s), v.at(t)]
            })
        });
        let [Some(start), Some(end)] = crossings else { return offset_vector(fixed) };
        offset_vector(fixed).max(offset_vector([start, end]))
    }

    /// ℓ: largest reach of the bodies of a contact (m).
    fn reach(&self, contact: &Contact) -> f64 {
        let bodies = self.world.bodies();
        contact.key.bodies().map(|body| bodies[body].reach()).fold(0.0, f64::max)
    }

    /// ϑ: rotation of both bodies in the step (rad).
    fn turn(&self, contact: &Contact) -> f64 {
        let turn = |body: usize| (self.end[body].rotation - self.start[body].rotation).norm();
        contact.key.bodies().map(turn).sum()
    }
}

/// Shift across the normal n by which the touching point of each of `both` pieces gets below the surfaces
/// of its piece (m, world). It is zero if both points are there.
///
/// A surface with the normal m that is h below a point takes off
///
/// ```text
/// h l/|l|²,   l = m − (n·m) n
/// ```
///
/// The surfaces that face along n to [`ACROSS`] are those that touch.
fn level_shift_into(
    both: [(&Piece, &Pose); 2],
    points: [Vector3<f64>; 2],
    n: &Vector3<f64>,
) -> Vector3<f64> {
    let mut shift = Vector3::zeros();
    for _ in 0..SHIFTS {
        let before = shift;
        for ((piece, pose), point) in both.into_iter().zip(points) {
            let local = pose.rotation.tr_mul(&(point + shift - pose.position));
            piece.all_surfaces(&local, 0.0, |height, m| {
                let m = pose.rotation * m;
                let level = m - n * n.dot(&m);
                if height > 0.0 && level.norm() > ACROSS {
                    shift -= level * (height / level.norm_squared());
                }
                true
            });
        }
        if shift == before {
            break;
        }
    }
    shift
}

/// Largest n·x over a placed piece (m) for a unit vector n (world).
fn extent((piece, pose): (&Piece, &Pose), n: &Vector3<f64>) -> f64 {
    let farthest = piece.farthest(&pose.rotation.tr_mul(n));
    n.dot(&(pose.position + pose.rotation * farthest))
}

/// Normal from B to A and touching point of A (m) with A at `a` and B at `b` (world).
fn touching_point(contact: &Contact, a: &Pose, b: &Pose) -> (Vector3<f64>, Vector3<f64>) {
    let features = &contact.features;
    let normal = b.rotation * features.frame.column(2);
    match &features.curved {
        None => {
            let centre = a.position + a.rotation * features.point;
            (normal, centre - normal * features.radius)
        }
        Some(Curved::Ellipsoid(one)) => {
            let inward = one.shape.farthest(&-a.rotation.tr_mul(&normal));
            let lowest =
                if inward == Vector3::zeros() { features.point } else { one.shape.centre + inward };
            (normal, a.position + a.rotation * lowest)
        }
        Some(Curved::Cores(pair)) => {
            let (point, offset_vector) = pair.nearest(a, b);
            let normal = offset_vector.try_normalize(0.0).unwrap_or(normal);
            (normal, point - normal * features.radius)
        }
    }
}
