//! Distances between objects, and objects near a piece.

use super::Query;
use crate::contact::Partner;
use crate::error::{Error, all_in_range, in_range};
use crate::geometry::{
    Aabb, Hint, PairScratch, Piece, PlacedPiece, Sweep, Terrain, closest_points,
    distance_lower_bound, signed_distance,
};
use crate::mechanics::Pose;
use crate::world::Plane;
use nalgebra::{Matrix3, Vector3};

/// Signed distance of two objects.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Distance {
    /// Distance (m). Negative for objects that overlap: minus the length of the shortest
    /// translation that separates their deepest pieces.
    pub distance: f64,
    /// Closest points of the first and the second object (m, world).
    pub points: [Vector3<f64>; 2],
    /// Unit vector from the first object to the second (world). For objects that overlap, the
    /// second leaves the first along it by the shortest translation.
    pub normal: Vector3<f64>,
}

/// An object near a piece.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Nearby {
    /// The object.
    pub owner: Partner,
    /// Signed distance from the piece (m).
    pub distance: f64,
}

/// Distance of a body from another object.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PairDistance {
    /// Body; of two bodies, the one with the smaller index.
    pub body: usize,
    /// The other object.
    pub partner: Partner,
    /// Signed distance (m).
    pub distance: f64,
}

impl Query<'_> {
    /// Signed distance and closest points of two objects.
    ///
    /// The time is that of all pairs of their pieces whose bounding balls are near enough.
    ///
    /// # Errors
    /// An object that does not exist, twice the same object, or a body of bare points.
    pub fn distance(&self, first: Partner, second: Partner) -> Result<Distance, Error> {
        const WHAT: &str = "distance";
        if first == second {
            let why = "both objects are the same; two different ones are needed";
            return Err(Error::Unsupported { what: WHAT, why });
        }
        let none = || {
            let why = "one of the bodies consists of points without volume; give it a shape";
            Error::Unsupported { what: WHAT, why }
        };
        match (self.pieces_of(first)?, self.pieces_of(second)?) {
            (Solid::Pieces(a), Solid::Pieces(b)) => nearest_pieces(&a, &b).ok_or_else(none),
            (Solid::Pieces(a), Solid::Ground(plane)) => {
                nearest_to_plane(&a, plane).ok_or_else(none)
            }
            (Solid::Ground(plane), Solid::Pieces(b)) => {
                nearest_to_plane(&b, plane).map(Distance::swapped).ok_or_else(none)
            }
            (Solid::Pieces(a), Solid::Terrain(terrain)) => {
                nearest_in_terrain(&a, terrain).ok_or_else(none)
            }
            (Solid::Terrain(terrain), Solid::Pieces(b)) => {
                nearest_in_terrain(&b, terrain).map(Distance::swapped).ok_or_else(none)
            }
            (Solid::Terrain(_), Solid::Terrain(_) | Solid::Ground(_))
            | (Solid::Ground(_), Solid::Terrain(_)) => {
                let why = "neither object has a volume of its own; one of pieces is needed";
                Err(Error::Unsupported { what: WHAT, why })
            }
            // The same object was refused above.
            (Solid::Ground(_), Solid::Ground(_)) => Err(none()),
        }
    }

    /// Objects that overlap or touch `piece` at `pose`, in the order of [`Partner`], with their
    /// distances, which are 0 or negative.
    ///
    /// # Errors
    /// Those of [`Query::near`].
    pub fn overlaps(
        &self,
        piece: &Piece,
        pose: &Pose,
        keep: impl Fn(Partner) -> bool,
    ) -> Result<Vec<Nearby>, Error> {
        self.near(piece, pose, 0.0, keep)
    }

    /// Objects that `keep` accepts within a distance of `piece` at `pose`, in the order of
    /// [`Partner`]. `within` is the largest signed distance (m).
    ///
    /// # Errors
    /// A distance outside 0…1e6 m; a position beyond ±1e6 m; a matrix that is not a rotation to
    /// 1e-9.
    pub fn near(
        &self,
        piece: &Piece,
        pose: &Pose,
        within: f64,
        keep: impl Fn(Partner) -> bool,
    ) -> Result<Vec<Nearby>, Error> {
        check(pose)?;
        let within = in_range("distance (m)", within, 0.0, 1e6, "0 to 1e6")?;
        // Box around the piece, with the rounding of its coordinates.
        let around = Aabb::from_piece(piece, pose);
        let reach = around.low.amax().max(around.high.amax());
        let margin = 16.0 * f64::EPSILON * (self.tree.reach() + reach);
        let around = around.grown(within + margin);
        let mut found = Vec::new();
        if let Some(plane) = self.world.ground().filter(|_| keep(Partner::Ground)) {
            let distance = height(&lowest(piece, pose, plane.normal()), plane);
            found.push(Nearby { owner: Partner::Ground, distance });
        }
        let enters = |_: &PairScratch, bounds: &Aabb| around.meets(bounds);
        self.tree.visit(&mut PairScratch::default(), enters, |scratch, index| {
            let owner = self.owner(index);
            if keep(owner) && around.meets(&self.boxes[index]) {
                let distance = gap((piece, pose), self.placed(index), within, scratch);
                found.push(Nearby { owner, distance });
            }
        });
        for (owner, terrain) in self.terrains() {
            if keep(owner) {
                let distance = gap_to_terrain(
                    (piece, pose),
                    terrain,
                    within + margin,
                    &mut PairScratch::default(),
                );
                found.extend(distance.map(|distance| Nearby { owner, distance }));
            }
        }
        // The searches use a margin; the distance decides.
        found.retain(|near| near.distance <= within);
        found
            .sort_unstable_by(|a, b| a.owner.cmp(&b.owner).then(a.distance.total_cmp(&b.distance)));
        found.dedup_by_key(|near| near.owner);
        Ok(found)
    }

    /// Pairs of a body and another object within a distance of each other, in the order of their
    /// indices. `within` is the largest signed distance (m). `keep` selects pairs, for example with
    /// [`World::may_touch`](crate::world::World::may_touch).
    ///
    /// Boxes grown by the distance are sorted and swept. The time is that of the pairs whose grown
    /// boxes overlap, plus n log n.
    ///
    /// # Errors
    /// A distance outside 0…1e6 m.
    pub fn pairs_within(
        &self,
        within: f64,
        keep: impl Fn(usize, Partner) -> bool,
    ) -> Result<Vec<PairDistance>, Error> {
        let within = in_range("distance (m)", within, 0.0, 1e6, "0 to 1e6")?;
        let of_bodies = |index: &usize| self.owner(*index).body().is_some();
        // Colliders of bodies come first. Fixed ones need no test against each other.
        let moving = (0..self.colliders.len()).take_while(of_bodies).count();
        let grown = |around: &Aabb| around.grown(within / 2.0 + 16.0 * f64::EPSILON * within);
        let boxes: Vec<_> = self.boxes.iter().map(grown).collect();
        let mut found = Vec::new();
        let mut scratch = PairScratch::default();
        let mut sweep = Sweep::new();
        sweep.set_fixed(&boxes[moving..]);
        sweep.pairs(&boxes[..moving], |i, j| {
            let (Some(body), partner) = (self.owner(i).body(), self.owner(j)) else { return };
            if partner != Partner::Body(body) && keep(body, partner) {
                let distance = gap(self.placed(i), self.placed(j), within, &mut scratch);
                found.push(PairDistance { body, partner, distance });
            }
        });
        for (partner, terrain) in self.terrains() {
            for index in 0..moving {
                let Some(body) = self.owner(index).body() else { continue };
                if keep(body, partner) {
                    let placed = self.placed(index);
                    let distance = gap_to_terrain(placed, terrain, within, &mut scratch);
                    found.extend(distance.map(|distance| PairDistance { body, partner, distance }));
                }
            }
        }
        if let Some(plane) = self.world.ground() {
            for index in 0..moving {
                let Some(body) = self.owner(index).body() else { continue };
                if keep(body, Partner::Ground) {
                    let (piece, pose) = self.placed(index);
                    let distance = height(&lowest(piece, pose, plane.normal()), plane);
                    found.push(PairDistance { body, partner: Partner::Ground, distance });
                }
            }
        }
        // Least distance of each pair of owners.
        found.retain(|pair| pair.distance <= within);
        let pair = |pair: &PairDistance| (pair.body, pair.partner);
        found
            .sort_unstable_by(|a, b| pair(a).cmp(&pair(b)).then(a.distance.total_cmp(&b.distance)));
        found.dedup_by_key(|found| pair(found));
        Ok(found)
    }

    /// Geometry of an object.
    fn pieces_of(&self, of: Partner) -> Result<Solid<'_>, Error> {
        let (known, field, count) = match of {
            Partner::Ground => {
                let why = "there is no ground; name a body or a fixed piece";
                let none = Error::Unsupported { what: "distance", why };
                return self.world.ground().map(Solid::Ground).ok_or(none);
            }
            Partner::Fixed(index) => (self.world.fixed_count(), "fixed piece", index),
            Partner::Body(index) => (self.world.bodies().len(), "body", index),
        };
        if count >= known {
            return Err(Error::Count { field, count, allowed: "an index in the world" });
        }
        if let Partner::Fixed(index) = of
            && let Some(terrain) = self.world.terrain(index)
        {
            return Ok(Solid::Terrain(terrain));
        }
        // Owners are sorted by kind and index.
        let key = |owner: Partner| (owner.body().is_none(), owner);
        let start = self.colliders.partition_point(|c| key(c.owner.partner()) < key(of));
        let own = (start..self.colliders.len()).take_while(|index| self.owner(*index) == of);
        Ok(Solid::Pieces(own.map(|index| self.placed(index)).collect()))
    }
}

/// Geometry of an object: its pieces, the triangles of a terrain, or the half space below a plane.
enum Solid<'a> {
    Ground(&'a Plane),
    Terrain(&'a Terrain),
    Pieces(Vec<PlacedPiece<'a>>),
}

impl Distance {
    fn swapped(self) -> Self {
        let [first, second] = self.points;
        Self { points: [second, first], normal: -self.normal, ..self }
    }
}

/// Rejects a pose that is not finite or not a rotation.
fn check(pose: &Pose) -> Result<(), Error> {
    all_in_range("position of the piece (m)", &pose.position, -1e6, 1e6, "-1e6 to 1e6")?;
    let defect = (pose.rotation.tr_mul(&pose.rotation) - Matrix3::identity()).abs().sum();
    in_range("error AᵀA − 1 of the piece's rotation", defect, 0.0, 1e-8, "0 to 1e-8")?;
    in_range("determinant of the piece's rotation", pose.rotation.determinant(), 0.5, 1.5, "1")?;
    Ok(())
}

/// Signed distance of two pieces (m); a lower bound if that is beyond `within`.
pub(super) fn gap(
    a: PlacedPiece<'_>,
    b: PlacedPiece<'_>,
    within: f64,
    scratch: &mut PairScratch,
) -> f64 {
    let mut hint = Hint::default();
    let least = distance_lower_bound(a, b, &hint);
    if least > within { least } else { signed_distance(a, b, &mut hint, scratch).distance }
}

/// The closest points of the nearest, or deepest, pair of pieces.
pub(super) fn nearest_pieces(a: &[PlacedPiece<'_>], b: &[PlacedPiece<'_>]) -> Option<Distance> {
    let mut scratch = PairScratch::default();
    let mut nearest: Option<Distance> = None;
    for &one in a {
        for &other in b {
            let limit = nearest.map_or(f64::INFINITY, |nearest| nearest.distance);
            let mut hint = Hint::default();
            if distance_lower_bound(one, other, &hint) >= limit {
                continue;
            }
            let found = closest_points(one, other, &mut hint, &mut scratch);
            if found.separation.distance < limit {
                let (distance, normal) = (found.separation.distance, found.separation.axis);
                nearest = Some(Distance { distance, points: [found.a, found.b], normal });
            }
        }
    }
    nearest
}

/// The lowest point of the pieces over a plane, and its foot.
fn nearest_to_plane(pieces: &[PlacedPiece<'_>], plane: &Plane) -> Option<Distance> {
    let points = pieces.iter().map(|(piece, pose)| lowest(piece, pose, plane.normal()));
    let point = points.min_by(|a, b| height(a, plane).total_cmp(&height(b, plane)))?;
    let (distance, normal) = (height(&point, plane), -plane.normal());
    Some(Distance { distance, points: [point, point + normal * distance], normal })
}

/// Height of a point over a plane (m).
fn height(point: &Vector3<f64>, plane: &Plane) -> f64 {
    plane.normal().dot(point) - plane.offset()
}

/// Lowest point of a piece along the unit vector `up` (m, world). Planes touch smooth shapes
/// themselves.
fn lowest(piece: &Piece, pose: &Pose, up: &Vector3<f64>) -> Vector3<f64> {
    let axis = pose.rotation.tr_mul(up);
    let points = piece.contact_points().map(|point| {
        let away = point.smooth().map_or(Vector3::zeros(), |one| one.farthest(&axis));
        point.position - away - axis * point.radius
    });
    let lowest = points.min_by(|a, b| axis.dot(a).total_cmp(&axis.dot(b)));
    pose.position + pose.rotation * lowest.unwrap_or_default()
}

/// Pose of terrains.
const FIXED: Pose = Pose { position: Vector3::new(0.0, 0.0, 0.0), rotation: IDENTITY };
const IDENTITY: Matrix3<f64> = Matrix3::new(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0);

/// Signed distance of a piece from the nearest triangle of a terrain (m). It is `None` if it is
/// beyond `within`, and may be a larger number then.
fn gap_to_terrain(
    piece: PlacedPiece<'_>,
    terrain: &Terrain,
    within: f64,
    scratch: &mut PairScratch,
) -> Option<f64> {
    let mut nearest: Option<f64> = None;
    terrain.visit(&Aabb::from_piece(piece.0, piece.1).grown(within), |triangle| {
        let Some(facet) = terrain.piece(triangle) else { return };
        let limit = nearest.map_or(within, |nearest| nearest.min(within));
        let distance = gap(piece, (facet, &FIXED), limit, scratch);
        if nearest.is_none_or(|nearest| distance < nearest) {
            nearest = Some(distance);
        }
    });
    nearest
}

/// The closest points of pieces and a terrain.
///
/// The search begins in boxes around the pieces that reach as far as the piece is large, and doubles
/// this reach until the boxes have a triangle nearer than it.
fn nearest_in_terrain(pieces: &[PlacedPiece<'_>], terrain: &Terrain) -> Option<Distance> {
    let mut nearest: Option<Distance> = None;
    for &(piece, pose) in pieces {
        let around = Aabb::from_piece(piece, pose);
        let everything =
            (around.joined(terrain.bounds()).high - around.joined(terrain.bounds()).low).norm();
        let mut reach = (around.high - around.low).norm();
        loop {
            let mut facets = Vec::new();
            terrain.visit(&around.grown(reach), |triangle| {
                facets.extend(terrain.piece(triangle).map(|facet| (facet, &FIXED)));
            });
            let found = nearest_pieces(&[(piece, pose)], &facets);
            if let Some(found) = found
                .filter(|found| nearest.is_none_or(|nearest| found.distance < nearest.distance))
            {
                nearest = Some(found);
            }
            // Triangles that are not farther than the reach are all in the box.
            let is_near = nearest.is_some_and(|nearest| nearest.distance <= reach);
            if is_near || reach > everything {
                break;
            }
            reach *= 2.0;
        }
    }
    nearest
}
