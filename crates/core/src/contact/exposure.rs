//! Exposed surfaces: which contact points of a pair exist, given the other pieces around them.
//!
//! Pieces that lie flush against each other, like the tiles of a floor, hide parts of their faces.
//! The union of the pieces decides where a body can touch. At a point x, let T_C be the tangent cone
//! of each piece C there, and N_C the cone of its outward normals
//! ([`Piece::surface_at`]). A face of a piece with the normal m is exposed at x if, at x or at a point
//! of the face beside it, no other piece rises along m:
//!
//! ```text
//! m ∈ N_C   for all other pieces C there                                   (eq. 4d)
//! ```
//!
//! A contact point with the outward normal n exists if n is in N_C for all pieces C at x, or if it is
//! a combination of normals of exposed faces of its own piece. So the edge between a hidden and an
//! exposed face has the exposed normal only, while the walls of a groove and an inner corner have
//! all of theirs.
//!
//! A vertex or an edge also has to be an end of the level part of the union,
//!
//! ```text
//! L = ⋃ { w ∈ T_C : n·w = 0 }   over the pieces with n ∈ N_C               (eq. 4e)
//! ```
//!
//! It is an end if L leaves more than half of the circle about n free (half for an edge). The inside
//! of a plane or of a straight ridge has no contact of its own, so a body slides over the seams of a
//! floor as over one face. L has the pieces that cannot move against each other: those of one body, of
//! bodies that joints fix to each other, or all fixed, held and driven ones. A brick beside another one is
//! supported on its own.
//!
//! A facet of a terrain has two sides. It is touched on the side of the other piece's centre, unless
//! another facet at the point has them on one side.
//!
//! The test is done at the start of a step and at its end. A point has to be hidden at both to be
//! left out. It is added after all if a solved step without it leaves the pair deeper than at its start
//! ([`super::collision`]).

use super::collider::{Collider, PieceOwner, placed, size};
use super::cones::{LEVEL, LocalSurface, is_in_cone, is_on_its_side, leaves_free, rise};
use super::contact_builder::{ellipsoid, part_on};
use super::partners::Partners;
use crate::contact::Partner;
use crate::geometry::{
    CorePart, Feature, Hint, ManifoldPoint, PairScratch, Piece, PieceSide, PlacedPiece,
    closest_on_segment, flat_faces, manifold, manifold_across,
};
use crate::mechanics::Pose;
use crate::world::World;
use nalgebra::Vector3;
use std::f64::consts::{FRAC_PI_2, PI};

/// Distance within which surfaces are one, as a fraction of the smaller piece. A larger step between
/// two faces is real.
pub(super) const FLUSH: f64 = 1e-6;
/// Distance of the point beside x at which a face is examined, in units of that distance.
const BESIDE: f64 = 3.0;
/// Difference of two gaps below which they are equal, as a fraction of the smaller piece.
const SAME_GAP: f64 = 1e-7;
/// Sine of the largest tilt of a disc that lies nearly flat.
const NEARLY_FLAT: f64 = 0.01;
/// Cosine above which two contact points of a pair have one plane: an angle of 0.03 rad, up to which
/// faces are across the axis of a manifold.
const ONE_PLANE: f64 = 0.999_55;

/// Workspace of the tests.
#[derive(Debug, Clone, Default)]
pub(super) struct ExposureScratch {
    own: LocalSurface,
    /// Surfaces of the other pieces at the point; the first `count` are valid.
    others: Vec<LocalSurface>,
    beside: LocalSurface,
    exposed: Vec<Vector3<f64>>,
    /// Colliders whose exposed faces are combined, with their numbers.
    near: Vec<(usize, Collider)>,
    /// Angles at which level directions end (rad).
    ends: Vec<f64>,
    faces: Vec<FaceOfPair>,
}

/// A flat face of one piece of a pair, and where the other piece is deepest below it.
#[derive(Debug, Clone, Copy)]
pub(super) struct FaceOfPair {
    side: PieceSide,
    face: usize,
    /// Height of the other piece above the face (m); negative if they overlap.
    pub(super) height: f64,
    /// Point of the face nearest to the deepest point of the other piece, and the normal (frame of the
    /// owner).
    point: Vector3<f64>,
    normal: Vector3<f64>,
}

/// Test of the contact points of a pair of colliders.
pub(super) struct Exposure<'a> {
    pub(super) world: &'a World,
    pub(super) partners: &'a Partners,
    /// Colliders A and B.
    pub(super) colliders: [Collider; 2],
    /// Numbers of the colliders.
    pub(super) numbers: [usize; 2],
}

/// Limits of a search for contact points.
#[derive(Debug, Clone, Copy)]
pub(super) struct ContactSearch {
    /// Largest gap of a contact point (m).
    pub(super) reach: f64,
    /// Largest separation of a pair whose contact points are examined (m).
    pub(super) within: f64,
    /// Piece that owns the plane if the features leave it open.
    pub(super) plane_of: PieceSide,
    /// True if points that other pieces hide count.
    pub(super) with_hidden: bool,
}

/// A point of a piece's surface and an outward normal there (frame of its owner).
#[derive(Debug, Clone, Copy)]
struct SurfacePoint {
    point: Vector3<f64>,
    normal: Vector3<f64>,
    /// Vertex or edge of the contact; `None` for another place of the surface.
    part: Option<CorePart>,
}

impl Exposure<'_> {
    /// Fills `out` with the contact points of the pair that exist at one of the `moments`, with the
    /// bodies at the poses `at`. Returns the separation (m), and true if all points are hidden.
    ///
    /// No point has a gap below the overlap of the pair. If the pair overlaps along a hidden direction,
    /// the exposed faces stay as directions.
    pub(super) fn contact_points(
        &self,
        at: &[Pose],
        moments: &[&[Pose]],
        search: ContactSearch,
        hint: &mut Hint,
        (scratch, exposure): (&mut PairScratch, &mut ExposureScratch),
        out: &mut Vec<ManifoldPoint>,
    ) -> (f64, bool) {
        let [a, b] = self.colliders.map(|collider| placed(self.world, at, collider));
        let ContactSearch { reach, within, plane_of, with_hidden } = search;
        let gap = manifold(a, b, reach, plane_of, hint, scratch, out);
        if out.is_empty() || gap > within {
            return (gap, false);
        }
        self.stand_on_corners([a, b], out);
        let same = SAME_GAP * size(a.0).min(size(b.0));
        let points = out.iter().map(|touch| self.surface_points(touch, at).map(|on| on.point));
        if with_hidden || !self.may_be_hidden(at, points) {
            keep_one_plane(out, a.1, b.1, same);
            return (gap, false);
        }
        let least = gap.min(0.0) - same;
        let mut exists = |touch: &ManifoldPoint| {
            touch.gap >= least && self.permits(touch, at, moments, exposure)
        };
        out.retain(&mut exists);
        if out.is_empty()
            && gap <= 0.0
            && let Some(best) = self.best_exposed_face(at, moments, |_| true, exposure)
        {
            manifold_across(a, b, (best.side, best.face), reach, plane_of, scratch, out);
            out.retain(|touch| self.permits(touch, at, moments, exposure));
        }
        keep_one_plane(out, a.1, b.1, same);
        (gap, out.is_empty())
    }

    /// Removes the nearest points of discs that lie nearly flat, if the pair has other points.
    ///
    /// Within a step h a body may fall by g h². If the rim of a disc is no higher than that on one side,
    /// the step decides where it is lowest. Such a disc stands on the corners of its core, like one that
    /// lies flat. They are as low as the rim to a hundredth of this height.
    fn stand_on_corners(&self, [a, b]: [PlacedPiece<'_>; 2], out: &mut Vec<ManifoldPoint>) {
        let is_corner = |touch: &ManifoldPoint| !matches!(touch.feature, Feature::Ellipsoid(..));
        if !out.iter().any(is_corner) {
            return;
        }
        let fall = self.world.fall();
        out.retain(|touch| {
            let ((piece, pose), other) = match touch.point_of {
                PieceSide::A => (a, b.1),
                PieceSide::B => (b, a.1),
            };
            let Some(one) = ellipsoid(piece, touch.feature) else { return true };
            let normal = pose.rotation.tr_mul(&(other.rotation * touch.normal));
            one.half_width(&normal) > fall.min(NEARLY_FLAT * one.longest())
        });
    }

    /// True if another collider or the ground may hide a contact of the pair, with the bodies at
    /// `poses`. The ground may if a touching point lies in it. `points` has the touching points of both
    /// colliders for each contact (m, frames of their owners).
    fn may_be_hidden(
        &self,
        poses: &[Pose],
        mut points: impl Iterator<Item = [Vector3<f64>; 2]>,
    ) -> bool {
        if self.partners.has_others(self.numbers) {
            return true;
        }
        let Some(ground) = self.world.ground() else { return false };
        let placed = self.colliders.map(|collider| placed(self.world, poses, collider));
        let is_in_ground = |pose: &Pose, point: &Vector3<f64>, reach: f64| {
            let place = pose.position + pose.rotation * point;
            ground.normal().dot(&place) - ground.offset() <= reach
        };
        let within = self.flush_within(poses);
        let all_reach = placed.iter().all(|(piece, pose)| {
            is_in_ground(pose, piece.core().centre(), piece.bounding_radius() + within)
        });
        let pairs = |on: [Vector3<f64>; 2]| {
            placed.iter().zip(on).any(|((_, pose), point)| is_in_ground(pose, &point, within))
        };
        all_reach && points.any(pairs)
    }

    /// True if `touch`, found at the poses `at`, exists at one of the `moments` (poses of the bodies).
    fn permits(
        &self,
        touch: &ManifoldPoint,
        at: &[Pose],
        moments: &[&[Pose]],
        scratch: &mut ExposureScratch,
    ) -> bool {
        let points = self.surface_points(touch, at);
        if self.is_hidden_for_good(&points[1], at) {
            return false;
        }
        moments
            .iter()
            .any(|poses| (0..2).all(|side| self.is_exposed(side, &points[side], poses, scratch)))
    }

    /// True if fixed pieces hide the point `on` of the second piece, which is fixed too.
    fn is_hidden_for_good(&self, on: &SurfacePoint, at: &[Pose]) -> bool {
        let (PieceOwner::Fixed(_), Some(part)) = (self.colliders[1].owner, on.part) else {
            return false;
        };
        let point = on_edge(placed(self.world, at, self.colliders[1]).0, on);
        let place = (&point, &on.normal);
        self.partners.is_hidden(self.numbers, part, place, self.flush_within(at))
    }

    /// The flat face of one of the pieces along which they overlap least with the bodies at `poses`,
    /// among those whose normal (world) `may` take part and that are exposed at one of the `moments`. It
    /// is examined at the deepest point of the other piece.
    pub(super) fn best_exposed_face(
        &self,
        poses: &[Pose],
        moments: &[&[Pose]],
        may: impl Fn(&Vector3<f64>) -> bool,
        scratch: &mut ExposureScratch,
    ) -> Option<FaceOfPair> {
        let placed = self.colliders.map(|collider| placed(self.world, poses, collider));
        let mut faces = std::mem::take(&mut scratch.faces);
        faces.clear();
        // Height of the deepest point of the other piece above each flat face.
        for side in [PieceSide::A, PieceSide::B] {
            let ((piece, pose), (other, other_pose)) = match side {
                PieceSide::A => (placed[0], placed[1]),
                PieceSide::B => (placed[1], placed[0]),
            };
            for face in flat_faces(piece) {
                let normal = piece.core().faces()[face].normal;
                let outward = pose.rotation * normal;
                if !may(&outward) {
                    continue;
                }
                let inward = -other_pose.rotation.tr_mul(&outward);
                let deepest = other_pose.position + other_pose.rotation * other.farthest(&inward);
                let deepest = pose.rotation.tr_mul(&(deepest - pose.position));
                let height =
                    normal.dot(&deepest) - piece.core().faces()[face].offset - piece.radius();
                let nearest = piece.core().nearest_in_face(face, &deepest);
                let point = nearest + normal * piece.radius();
                faces.push(FaceOfPair { side, face, height, point, normal });
            }
        }
        // The least overlap belongs to the greatest height.
        faces.sort_unstable_by(|one, other| other.height.total_cmp(&one.height));
        let mut is_exposed = |of: &&FaceOfPair| {
            let side = usize::from(of.side == PieceSide::B);
            moments
                .iter()
                .any(|poses| self.exposes_face(side, &of.point, &of.normal, poses, scratch))
        };
        let best = faces.iter().find(&mut is_exposed).copied();
        scratch.faces = faces;
        best
    }

    /// True if the face of collider `side` with the outward `normal` (frame of its owner) is exposed
    /// at `point` (m, same frame) with the bodies at `poses`.
    fn exposes_face(
        &self,
        side: usize,
        point: &Vector3<f64>,
        normal: &Vector3<f64>,
        poses: &[Pose],
        scratch: &mut ExposureScratch,
    ) -> bool {
        let (piece, pose) = placed(self.world, poses, self.colliders[side]);
        let within = self.flush_within(poses);
        let ExposureScratch { own, others, beside, .. } = scratch;
        piece.surface_at(point, within, &mut own.normals);
        own.normals.iter_mut().for_each(|m| *m = pose.rotation * *m);
        let x = pose.position + pose.rotation * point;
        let m = pose.rotation * normal;
        let count = self.gather(side, &x, within, poses, others);
        self.is_face_exposed(side, &x, &m, within, poses, (own, &others[..count], beside))
    }

    /// True if the surface `points` of both colliders with their outward normals (m, world, at the
    /// poses `at`) are exposed at one of the `moments`. A normal may be off by `angle` (rad) from the
    /// normals of exposed faces.
    pub(super) fn shows(
        &self,
        points: [(Vector3<f64>, Vector3<f64>); 2],
        at: &[Pose],
        (moments, angle): (&[&[Pose]], f64),
        scratch: &mut ExposureScratch,
    ) -> bool {
        let poses = self.colliders.map(|collider| placed(self.world, at, collider).1);
        let points: [SurfacePoint; 2] = [0, 1].map(|side| SurfacePoint {
            point: poses[side].rotation.tr_mul(&(points[side].0 - poses[side].position)),
            normal: poses[side].rotation.tr_mul(&points[side].1),
            part: None,
        });
        let mut shows = |side: usize, poses: &[Pose]| {
            let point = &points[side];
            self.is_exposed(side, point, poses, scratch)
                || self.rise_above_all(side, point, poses, scratch)
                    <= libm::sin(angle.min(FRAC_PI_2)) + LEVEL
        };
        moments.iter().any(|poses| {
            let places = std::iter::once(points.each_ref().map(|on| on.point));
            !self.may_be_hidden(poses, places) || (0..2).all(|side| shows(side, poses))
        })
    }

    /// Sine of the angle between the normal of the surface point `at` and the cone of the normals of all
    /// exposed faces there. They are of several pieces where a contact on the edge of two facets of a
    /// terrain ends at their vertex.
    fn rise_above_all(
        &self,
        side: usize,
        at: &SurfacePoint,
        poses: &[Pose],
        scratch: &mut ExposureScratch,
    ) -> f64 {
        let within = self.flush_within(poses);
        let pose = placed(self.world, poses, self.colliders[side]).1;
        let x = pose.position + pose.rotation * at.point;
        let n = pose.rotation * at.normal;
        let ExposureScratch { own, others, beside, exposed, near, .. } = scratch;
        exposed.clear();
        near.clear();
        near.push((self.numbers[side], self.colliders[side]));
        self.partners.each_near(self.numbers, &mut |number, other| {
            if self.may_hide(side, number, other) {
                near.push((number, other));
            }
        });
        for &(number, collider) in &*near {
            let mut of = Self { ..*self };
            (of.colliders[side], of.numbers[side]) = (collider, number);
            let (piece, pose) = placed(self.world, poses, collider);
            let local = pose.rotation.tr_mul(&(x - pose.position));
            if !piece.surface_at(&local, within, &mut own.normals) {
                continue;
            }
            own.normals.iter_mut().for_each(|m| *m = pose.rotation * *m);
            let count = of.gather(side, &x, within, poses, others);
            let is_toward = |m: &&Vector3<f64>| m.dot(&n) > 0.0;
            for m in own.normals.iter().filter(is_toward) {
                let around = (&*own, &others[..count], &mut *beside);
                if of.is_face_exposed(side, &x, m, within, poses, around) {
                    exposed.push(*m);
                }
            }
        }
        rise(exposed, &n).norm()
    }

    /// True if the collider `other` may hide the surface of collider `side`: the body of the other
    /// collider of the pair may touch it.
    fn may_hide(&self, side: usize, number: usize, other: Collider) -> bool {
        let own = self.colliders[side].owner;
        let toucher = self.colliders[1 - side].owner;
        !self.numbers.contains(&number)
            && other.owner != toucher
            && (other.owner == own || may_touch(self.world, toucher, other.owner))
    }

    /// The touching points of both pieces and their outward normals.
    fn surface_points(&self, touch: &ManifoldPoint, at: &[Pose]) -> [SurfacePoint; 2] {
        let [a, b] = self.colliders.map(|collider| placed(self.world, at, collider).1);
        let (of_point, of_plane) = match touch.point_of {
            PieceSide::A => (a, b),
            PieceSide::B => (b, a),
        };
        let normal = of_plane.rotation * touch.normal;
        let centre = of_point.position + of_point.rotation * touch.point;
        let on_point = centre - normal * touch.point_radius;
        let on_plane = on_point - normal * touch.gap;
        let surface_point =
            |pose: &Pose, point: Vector3<f64>, normal: Vector3<f64>, side: PieceSide| {
                SurfacePoint {
                    point: pose.rotation.tr_mul(&(point - pose.position)),
                    normal: pose.rotation.tr_mul(&normal),
                    part: part_on(touch.feature, side),
                }
            };
        match touch.point_of {
            PieceSide::A => [
                surface_point(a, on_point, -normal, PieceSide::A),
                surface_point(b, on_plane, normal, PieceSide::B),
            ],
            PieceSide::B => [
                surface_point(a, on_plane, normal, PieceSide::A),
                surface_point(b, on_point, -normal, PieceSide::B),
            ],
        }
    }

    /// Distance within which surfaces are one (m).
    fn flush_within(&self, poses: &[Pose]) -> f64 {
        let [a, b] = self.colliders.map(|collider| size(placed(self.world, poses, collider).0));
        FLUSH * a.min(b)
    }

    /// True if collider `side` has the contact point `at` with the bodies at `poses`.
    fn is_exposed(
        &self,
        side: usize,
        at: &SurfacePoint,
        poses: &[Pose],
        scratch: &mut ExposureScratch,
    ) -> bool {
        let within = self.flush_within(poses);
        let (piece, pose) = placed(self.world, poses, self.colliders[side]);
        // (4d) is examined at the edge or vertex itself, where the normals of all its faces meet.
        let point = on_edge(piece, at);
        let x = pose.position + pose.rotation * point;
        let ExposureScratch { own, others, beside, exposed, ends, .. } = scratch;
        let count = self.gather(side, &x, within, poses, others);
        if count == 0 {
            return true;
        }
        let others = &others[..count];
        if !piece.surface_at(&point, within, &mut own.normals) {
            return true;
        }
        own.normals.iter_mut().for_each(|m| *m = pose.rotation * *m);
        // The normal of the other piece's plane as this piece has it. A corner above the plane is not
        // exactly across it.
        let n = pose.rotation * at.normal;
        let Some(n) = (n - rise(&own.normals, &n)).try_normalize(0.0) else { return true };
        let (toucher, toucher_pose) = placed(self.world, poses, self.colliders[1 - side]);
        let centre = toucher_pose.position + toucher_pose.rotation * toucher.core().centre();
        if !is_on_its_side(std::iter::once(&*own).chain(others), &n, &(centre - x)) {
            return false;
        }
        // n also exists if it is a combination of the normals of own faces that are exposed.
        if others.iter().any(|other| !is_in_cone(&other.normals, &n)) {
            exposed.clear();
            for index in 0..own.normals.len() {
                let m = own.normals[index];
                if self.is_face_exposed(side, &x, &m, within, poses, (own, others, beside)) {
                    exposed.push(m);
                }
            }
            if !is_in_cone(exposed, &n) {
                return false;
            }
        }
        // (4e): an end of the level part leaves more than half of the circle free, and half for an edge.
        let free = match at.part {
            Some(CorePart::Vertex(_)) => PI + LEVEL,
            Some(CorePart::Edge(_) | CorePart::Lateral) => PI - LEVEL,
            Some(CorePart::End(_)) | None => return true,
        };
        let level = others.iter().filter(|other| other.is_rigid && is_in_cone(&other.normals, &n));
        leaves_free(std::iter::once(&*own).chain(level), &n, free, ends)
    }

    /// Writes the surfaces of the other pieces at `x` (m, world) beside collider `side`, which the
    /// body of the other collider may touch. Returns their number.
    fn gather(
        &self,
        side: usize,
        x: &Vector3<f64>,
        within: f64,
        poses: &[Pose],
        others: &mut Vec<LocalSurface>,
    ) -> usize {
        let mut count = 0;
        self.each_beside(side, poses, x, |is_rigid, normals_at| {
            if others.len() == count {
                others.push(LocalSurface::default());
            }
            others[count].is_rigid = is_rigid;
            if normals_at(x, within, &mut others[count].normals) {
                count += 1;
            }
        });
        count
    }

    /// Visits the pieces around `x` (m, world) that may hide the surface of collider `side`.
    ///
    /// `visit` gets two arguments. The first is true if the piece cannot move against the collider. The
    /// second writes the normals of the piece at a point, and returns false outside the piece.
    fn each_beside(
        &self,
        side: usize,
        poses: &[Pose],
        x: &Vector3<f64>,
        mut visit: impl FnMut(bool, &dyn Fn(&Vector3<f64>, f64, &mut Vec<Vector3<f64>>) -> bool),
    ) {
        let toucher = self.colliders[1 - side].owner;
        let group = |owner: PieceOwner| match owner {
            PieceOwner::Body(body) => self.world.rigid_group(body),
            PieceOwner::Fixed(_) => 0,
        };
        // Pieces that joints fix to each other have one group. Group 0 is fixed.
        let own = group(self.colliders[side].owner);
        // The ground is a half space with one normal.
        if let (PieceOwner::Body(body), Some(ground)) = (toucher, self.world.ground())
            && self.world.may_touch(body, Partner::Ground)
        {
            let (normal, offset) = (*ground.normal(), ground.offset());
            visit(own == 0, &|point, within, normals| {
                let height = normal.dot(point) - offset;
                normals.clear();
                if height >= -within {
                    normals.push(normal);
                }
                height <= within
            });
        }
        // Other pieces count where their bounding sphere contains x.
        let mut add = |number: usize, other: Collider| {
            if !self.may_hide(side, number, other) {
                return;
            }
            let (piece, pose) = placed(self.world, poses, other);
            let centre = pose.position + pose.rotation * piece.core().centre();
            let reach = piece.bounding_radius() + BESIDE * FLUSH * piece.bounding_radius();
            if (x - centre).norm_squared() > reach * reach {
                return;
            }
            visit(group(other.owner) == own, &|point, within, normals| {
                let local = pose.rotation.tr_mul(&(point - pose.position));
                let is_there = piece.surface_at(&local, within, normals);
                normals.iter_mut().for_each(|m| *m = pose.rotation * *m);
                is_there
            });
        };
        self.partners.each_at(self.world, self.numbers, x, &mut add);
    }

    /// True if the face of collider `side` with the normal `m` is exposed at `x` or beside it.
    fn is_face_exposed(
        &self,
        side: usize,
        x: &Vector3<f64>,
        m: &Vector3<f64>,
        within: f64,
        poses: &[Pose],
        (own, others, beside): (&LocalSurface, &[LocalSurface], &mut LocalSurface),
    ) -> bool {
        let hides = |other: &&LocalSurface| !is_in_cone(&other.normals, m);
        let hiding = || others.iter().filter(hides);
        if hiding().next().is_none() {
            return true;
        }
        // Directions in the face away from the pieces that hide it.
        let along = |away: &Vector3<f64>| {
            let mut w = away - m * m.dot(away);
            for n in own.normals.iter().filter(|n| n.dot(m) < 1.0 - LEVEL) {
                let out = n.dot(&w);
                if out > 0.0 {
                    let rest = n - m * m.dot(n);
                    w -= rest * (out / rest.norm_squared());
                }
            }
            w.try_normalize(LEVEL)
        };
        // (4d) at a point of the own face beside x.
        let is_clear = |w: &Vector3<f64>, normals: &mut Vec<Vector3<f64>>| {
            if own.normals.iter().any(|n| n.dot(m) < 1.0 - LEVEL && n.dot(w) > LEVEL) {
                return false;
            }
            let place = x + w * (BESIDE * within);
            let mut clear = true;
            self.each_beside(side, poses, &place, |_, normals_at| {
                clear &= !normals_at(&place, within, normals) || is_in_cone(normals, m);
            });
            clear
        };
        // Away from each hiding face, and away from all of them.
        let mut sum = Vector3::zeros();
        for other in hiding() {
            for away in &other.normals {
                sum += away;
                if along(away).is_some_and(|w| is_clear(&w, &mut beside.normals)) {
                    return true;
                }
            }
        }
        along(&sum).is_some_and(|w| is_clear(&w, &mut beside.normals))
    }
}

/// Keeps the contact points whose normals are nearly those of the deepest one. Of several planes at
/// equal depth (to `same`, m) the one with most points is kept.
///
/// A plane stops a point wherever it meets the plane, even beside the face. Two convex pieces that
/// touch are separated by one plane. Another one joins if a step without it overlaps the pair.
fn keep_one_plane(touches: &mut Vec<ManifoldPoint>, a: &Pose, b: &Pose, same: f64) {
    let normal = |touch: &ManifoldPoint| match touch.point_of {
        PieceSide::A => b.rotation * touch.normal,
        PieceSide::B => -(a.rotation * touch.normal),
    };
    let is_in = |touch: &ManifoldPoint, plane: &Vector3<f64>| normal(touch).dot(plane) >= ONE_PLANE;
    let count = |plane: &Vector3<f64>| touches.iter().filter(|touch| is_in(touch, plane)).count();
    let least = touches.iter().map(|touch| touch.gap).fold(f64::INFINITY, f64::min);
    let deepest = touches.iter().filter(|touch| touch.gap <= least + same).map(normal);
    // No plane has more points than one with all of them.
    if deepest.clone().next().is_some_and(|plane| count(&plane) == touches.len()) {
        return;
    }
    let plane = deepest
        .map(|plane| (count(&plane), plane))
        .reduce(|most, other| if other.0 > most.0 { other } else { most });
    if let Some((_, plane)) = plane {
        touches.retain(|touch| is_in(touch, &plane));
    }
}

/// True if the two owners are obstacles for each other: not kept apart, and not both fixed.
fn may_touch(world: &World, one: PieceOwner, other: PieceOwner) -> bool {
    match (one, other) {
        (PieceOwner::Body(body), other) | (other, PieceOwner::Body(body)) => {
            world.may_touch(body, other.partner())
        }
        (PieceOwner::Fixed(_), PieceOwner::Fixed(_)) => false,
    }
}

/// Place of a contact on its piece. Edges across each other are nearest to each other beside the point
/// that is straight below along the normal.
fn on_edge(piece: &Piece, at: &SurfacePoint) -> Vector3<f64> {
    let Some(CorePart::Edge(edge)) = at.part else { return at.point };
    let Some(edge) = piece.core().edges().get(edge as usize) else { return at.point };
    let [from, to] = edge.vertices.map(|end| piece.core().vertices()[end as usize]);
    closest_on_segment(&at.point, &from, &(to - from)) + at.normal * piece.radius()
}
