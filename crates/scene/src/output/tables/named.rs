//! Comparison of a recorded contact with the features in its key.
//!
//! During a step the point and the plane are fixed in the frames of their bodies. So the feature of
//! the point's owner coincides with the point, and the feature of the plane's owner lies in the
//! plane, to rounding. Along the plane the features were opposite each other when they were found.
//! At the start of the step this holds up to the motion of the bodies in the step.

use nalgebra::Vector3;
use tumble_core::contact::{ContactKey, Features, PairFeatures, Partner};
use tumble_core::geometry::{CorePart, Feature, Piece, PieceSide};
use tumble_core::mechanics::RigidBody;

/// Reason why a row does not describe a contact of the world. The text follows "the contact".
pub type Misplaced = &'static str;

/// Relative tolerance for rounding and for the feature search, as a fraction of the piece's size.
pub(super) const EXACT: f64 = 1e-6;

/// Relative tolerance for the corner of a fixed face, which may be within the contact band above
/// the body's face.
pub(super) const BAND: f64 = tumble_core::contact::detection::CONTACT_BAND + EXACT;

/// Size of a piece: maximum distance from its own origin, including the radius (m).
pub(super) fn size(piece: &Piece) -> f64 {
    piece.core().reach() + piece.radius()
}

const ELSEWHERE: &str = "is not at the features of its key";

/// Pieces of a contact; the point's owner is first.
pub(super) type ContactPieces<'a> = (&'a Piece, &'a Piece);

/// Key of a contact of two pieces.
#[derive(Clone, Copy)]
pub(super) struct NamedContact<'a> {
    pub key: ContactKey,
    pub pair: PairFeatures,
    pub pieces: ContactPieces<'a>,
}

impl NamedContact<'_> {
    /// Features in the key: of the point's owner and of the plane's owner. A vertex contact has only
    /// one.
    fn parts(&self) -> (Option<CorePart>, Option<CorePart>) {
        let (of_a, of_b) = match self.pair.feature {
            Feature::Vertex(PieceSide::A, vertex) => (Some(CorePart::Vertex(vertex)), None),
            Feature::Vertex(PieceSide::B, vertex) => (None, Some(CorePart::Vertex(vertex))),
            Feature::Edges(a, b) => (Some(CorePart::Edge(a)), Some(CorePart::Edge(b))),
            Feature::Vertices(a, b) => (Some(CorePart::Vertex(a)), Some(CorePart::Vertex(b))),
            Feature::Round(a, b) => (Some(a), Some(b)),
            Feature::Ellipsoid(PieceSide::A, one) => (Some(CorePart::End(one)), None),
            Feature::Ellipsoid(PieceSide::B, one) => (None, Some(CorePart::End(one))),
        };
        // The pieces of a pair are in the order of the bodies; fixed pieces are last.
        match self.key.partner {
            Partner::Body(other) if other < self.key.body => (of_b, of_a),
            _ => (of_a, of_b),
        }
    }

    /// True if the plane may belong to the body and the point may be the projection of a fixed corner.
    ///
    /// In this case the roles are exchanged: the key's second feature is the corner.
    pub fn may_be_turned(&self) -> bool {
        matches!(self.key.partner, Partner::Fixed(_)) && self.parts().1.is_some()
    }

    /// Checks the point, the plane and the contact point against the features in the key.
    pub fn check(&self, features: &Features, body: &RigidBody) -> Result<(), Misplaced> {
        let ((own, theirs), (of_own, of_theirs)) = (self.pieces, self.parts());
        let turned = self.may_be_turned();
        self.check_point(body, turned)?;
        // For curved features everything follows from these checks.
        if features.curved.is_some() {
            return Ok(());
        }
        // A projected corner is off the edge by the tilt of the face, so it is not checked.
        let off = |part| !turned && distance(own, part, &features.point) > EXACT * size(own);
        let off_plane = |part| is_off_plane(theirs, part, features, turned);
        if of_own.is_some_and(off) || of_theirs.is_some_and(off_plane) {
            return Err(ELSEWHERE);
        }
        Ok(())
    }

    /// Checks the contact point of a key against the feature of its own piece.
    ///
    /// With `may_be_first` the first contact point of the piece also passes.
    fn check_point(&self, body: &RigidBody, may_be_first: bool) -> Result<(), Misplaced> {
        let Self { key, pair, pieces: (own, _) } = self;
        let point_of = |vertex: u32| body.point_of(pair.pieces.0, vertex as usize);
        let first = |part| match part {
            CorePart::Vertex(vertex) => Some(point_of(vertex)),
            CorePart::Edge(edge) => {
                own.core().edges().get(edge as usize).map(|edge| point_of(edge.vertices[0]))
            }
            CorePart::Lateral => Some(body.ellipsoid_point(pair.pieces.0, 0)),
            CorePart::End(end) => Some(body.ellipsoid_point(pair.pieces.0, end as usize)),
        };
        let named = self.parts().0.map_or(Some(point_of(0)), first);
        if named == Some(key.point) || may_be_first && key.point == point_of(0) {
            Ok(())
        } else {
            Err("has a key with a different contact point than its features")
        }
    }

    /// Checks a contact with a round piece: its features exist, and its contact point is theirs. A plane that
    /// may be the body's must contain the corner or edge of the fixed piece.
    pub fn check_round(&self, features: &Features, body: &RigidBody) -> Result<(), Misplaced> {
        let ((own, theirs), (of_own, of_theirs)) = (self.pieces, self.parts());
        let has =
            |piece: &Piece, part: Option<CorePart>| part.is_none_or(|part| exists(piece, part));
        if !has(own, of_own) || !has(theirs, of_theirs) {
            return Err("refers to features that its pieces do not have");
        }
        self.check_point(body, matches!(self.key.partner, Partner::Fixed(_)))?;
        // A plane that may be the body's contains the corner or edge of the fixed piece.
        let is_corner = |part: &CorePart| matches!(part, CorePart::Vertex(_) | CorePart::Edge(_));
        let corner = of_theirs.filter(is_corner).filter(|_| self.may_be_turned());
        if corner.is_some_and(|part| is_off_plane(theirs, part, features, true)) {
            Err(ELSEWHERE)
        } else {
            Ok(())
        }
    }

    /// Checks the feature of the plane's owner against the touching point at the start of the step.
    ///
    /// `local` is the touching point in the frame of the plane's owner (m). `moved` is the motion of the
    /// bodies in the step (m).
    pub fn check_start(
        &self,
        features: &Features,
        local: &Vector3<f64>,
        moved: f64,
    ) -> Result<(), Misplaced> {
        let (own, theirs) = self.pieces;
        let near = BAND * size(own).min(size(theirs)) + moved;
        let normal = features.frame.column(2);
        let foot = local - normal * (normal.dot(local) - features.offset + theirs.radius());
        if self.parts().1.is_some_and(|part| distance(theirs, part, &foot) > near) {
            Err(ELSEWHERE)
        } else {
            Ok(())
        }
    }
}

/// End points of a vertex or edge of a piece's core (m); both are equal for a vertex.
fn ends(piece: &Piece, part: CorePart) -> Option<[Vector3<f64>; 2]> {
    let vertices = match part {
        CorePart::Vertex(vertex) => [vertex; 2],
        CorePart::Edge(edge) => piece.core().edges().get(edge as usize)?.vertices,
        CorePart::Lateral => return piece.smooth()?.axis(),
        CorePart::End(end) => {
            return piece.smooth()?.ellipsoids().get(end as usize).map(|one| [one.centre; 2]);
        }
    };
    let [from, to] = vertices.map(|vertex| piece.core().vertices().get(vertex as usize).copied());
    Some([from?, to?])
}

/// Distance of a point from a vertex or edge (m); ∞ if the piece lacks it.
fn distance(piece: &Piece, part: CorePart, point: &Vector3<f64>) -> f64 {
    let Some([from, to]) = ends(piece, part) else { return f64::INFINITY };
    let along = to - from;
    let share = match along.norm_squared() {
        0.0 => 0.0,
        square => ((point - from).dot(&along) / square).clamp(0.0, 1.0),
    };
    (point - from - along * share).norm()
}

/// Heights of the end points of a vertex or edge above the plane n·x = d (m); ∞ if the piece lacks
/// it.
///
/// The plane is offset by the radius of the piece.
fn heights(piece: &Piece, part: CorePart, features: &Features) -> [f64; 2] {
    let normal = features.frame.column(2).into_owned();
    let height = |end: Vector3<f64>| normal.dot(&end) + piece.radius() - features.offset;
    if let (CorePart::End(end), Some(smooth)) = (part, piece.smooth()) {
        let one = smooth.ellipsoids().get(end as usize);
        let extent = one.map(|one| normal.dot(&one.centre) + one.half_width(&normal));
        return [extent.map_or(f64::INFINITY, |extent| extent - features.offset); 2];
    }
    ends(piece, part).map_or([f64::INFINITY; 2], |ends| ends.map(height))
}

/// True if a vertex or edge does not lie in the plane, which is offset by the piece's radius.
///
/// An edge needs one end in the plane. With `turned`, an edge that crosses the plane also passes.
fn is_off_plane(piece: &Piece, part: CorePart, features: &Features, turned: bool) -> bool {
    let [a, b] = heights(piece, part, features);
    let through = turned && a * b <= 0.0;
    !through && a.abs().min(b.abs()) > EXACT * size(piece)
}

/// True if a piece has a part.
fn exists(piece: &Piece, part: CorePart) -> bool {
    match part {
        CorePart::Lateral => piece.smooth().is_some(),
        CorePart::Vertex(_) | CorePart::Edge(_) | CorePart::End(_) => ends(piece, part).is_some(),
    }
}

/// True if a piece has flat faces only.
pub(super) fn is_sharp(piece: &Piece) -> bool {
    piece.radius() == 0.0 && piece.smooth().is_none()
}
