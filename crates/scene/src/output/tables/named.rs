//! Whether a contact of two pieces is where the features are that its key names.
//!
//! Point and plane are fixed in their bodies' frames for a step, so what the key names of the point's owner is
//! at the point and what it names of the plane's owner is in the plane, exactly, wherever the bodies were when
//! they were found. Along the plane they were over each other there: at the step's start they are so but for
//! what the bodies move in the step.

use nalgebra::Vector3;
use tumble_core::contact::{ContactKey, Features, PairFeatures, Partner};
use tumble_core::geometry::{CorePart, Feature, Piece, PieceSide};
use tumble_core::mechanics::RigidBody;

/// Why a row is of no contact of the world, in words that follow "the contact".
pub type Misplaced = &'static str;

/// What rounding, and the tolerances of the search for features, leave of a length, in parts of the
/// piece's size.
pub(super) const EXACT: f64 = 1e-6;

/// A fixed face's corner may be above the body's face by the band of the search.
pub(super) const BAND: f64 = tumble_core::contact::detection::CONTACT_BAND + EXACT;

/// ℓ, m: the reach of a piece from its own middle.
pub(super) fn size(piece: &Piece) -> f64 {
    piece.core().reach() + piece.radius()
}

const ELSEWHERE: &str = "is not where the features of its key are";

/// The pieces of a contact, the point's owner first.
pub(super) type ContactPieces<'a> = (&'a Piece, &'a Piece);

/// What the key names of the point's owner and of the plane's; a vertex is one piece's alone.
fn parts(key: &ContactKey, pair: &PairFeatures) -> (Option<CorePart>, Option<CorePart>) {
    let (of_a, of_b) = match pair.feature {
        Feature::Vertex(PieceSide::A, vertex) => (Some(CorePart::Vertex(vertex)), None),
        Feature::Vertex(PieceSide::B, vertex) => (None, Some(CorePart::Vertex(vertex))),
        Feature::Edges(a, b) => (Some(CorePart::Edge(a)), Some(CorePart::Edge(b))),
        Feature::Vertices(a, b) => (Some(CorePart::Vertex(a)), Some(CorePart::Vertex(b))),
        Feature::Round(a, b) => (Some(a), Some(b)),
    };
    // The pieces of a pair are in the order of the bodies, and what is fixed is last.
    match key.partner {
        Partner::Body(other) if other < key.body => (of_b, of_a),
        _ => (of_a, of_b),
    }
}

/// The ends of a part of a piece's core, m, the same twice of a vertex.
fn ends(piece: &Piece, part: CorePart) -> Option<[Vector3<f64>; 2]> {
    let vertices = match part {
        CorePart::Vertex(vertex) => [vertex; 2],
        CorePart::Edge(edge) => piece.core().edges().get(edge as usize)?.vertices,
    };
    let [from, to] = vertices.map(|vertex| piece.core().vertices().get(vertex as usize).copied());
    Some([from?, to?])
}

/// How far a point is from a part, m; ∞ from one that is not there.
fn distance(piece: &Piece, part: CorePart, point: &Vector3<f64>) -> f64 {
    let Some([from, to]) = ends(piece, part) else { return f64::INFINITY };
    let along = to - from;
    let share = match along.norm_squared() {
        0.0 => 0.0,
        square => ((point - from).dot(&along) / square).clamp(0.0, 1.0),
    };
    (point - from - along * share).norm()
}

/// The heights of a part's ends over a plane that is above its piece, n·x = d, m; ∞ of one that is not there.
fn heights(piece: &Piece, part: CorePart, features: &Features) -> [f64; 2] {
    let normal = features.frame.column(2);
    let height = |end: Vector3<f64>| normal.dot(&end) + piece.radius() - features.offset;
    ends(piece, part).map_or([f64::INFINITY; 2], |ends| ends.map(height))
}

/// Whether the point of a contact may be the foot of a corner of something fixed on a plane of the body: then it
/// is the plane that has the corner.
pub(super) fn may_be_turned(key: &ContactKey, pair: &PairFeatures) -> bool {
    matches!(key.partner, Partner::Fixed(_)) && parts(key, pair).1.is_some()
}

/// Holds point, plane and contact point against the parts that the key names.
pub(super) fn check(
    key: &ContactKey,
    pair: &PairFeatures,
    features: &Features,
    (own, theirs): ContactPieces<'_>,
    body: &RigidBody,
) -> Result<(), Misplaced> {
    let (of_own, of_theirs) = parts(key, pair);
    let turned = may_be_turned(key, pair);
    check_point(key, pair, own, body, turned)?;
    // Of round features all follows from these.
    if features.curved.is_some() {
        return Ok(());
    }
    // A foot is as far from an edge as the face is off the axis that it was seen along.
    let off = |part| !turned && distance(own, part, &features.point) > EXACT * size(own);
    let off_plane = |part| is_off_plane(theirs, part, features, turned);
    if of_own.is_some_and(off) || of_theirs.is_some_and(off_plane) {
        return Err(ELSEWHERE);
    }
    Ok(())
}

/// Whether a part is nowhere in a plane that is above its piece: an edge of the plane's owner lies in it, a fixed one, of a
/// plane that is `turned`, may go through it.
fn is_off_plane(piece: &Piece, part: CorePart, features: &Features, turned: bool) -> bool {
    let [a, b] = heights(piece, part, features);
    let through = turned && a * b <= 0.0;
    !through && a.abs().min(b.abs()) > EXACT * size(piece)
}

/// Holds the contact point of a key against the part of its own piece that it names, or, where it may, against the piece's first
/// one.
fn check_point(
    key: &ContactKey,
    pair: &PairFeatures,
    own: &Piece,
    body: &RigidBody,
    may_be_first: bool,
) -> Result<(), Misplaced> {
    let first = |part| match part {
        CorePart::Vertex(vertex) => Some(vertex),
        CorePart::Edge(edge) => Some(own.core().edges().get(edge as usize)?.vertices[0]),
    };
    let point_of = |vertex: u32| body.point_of(pair.pieces.0, vertex as usize);
    let named = parts(key, pair).0.map_or(Some(0), first).map(point_of);
    match named == Some(key.point) || may_be_first && key.point == point_of(0) {
        true => Ok(()),
        false => Err("has a key of another contact point than that of its features"),
    }
}

/// The same where something is round: whose the point is depends on the radii, and rims have planes of their own; a plane of the
/// body's, if the contact may have one, is held against the part of the fixed piece that the key names.
pub(super) fn check_round(
    key: &ContactKey,
    pair: &PairFeatures,
    features: &Features,
    (own, theirs): ContactPieces<'_>,
    body: &RigidBody,
) -> Result<(), Misplaced> {
    let (of_own, of_theirs) = parts(key, pair);
    let is_not_of = |piece: &Piece, part| ends(piece, part).is_none();
    if of_own.is_some_and(|part| is_not_of(own, part))
        || of_theirs.is_some_and(|part| is_not_of(theirs, part))
    {
        return Err("is of features that its pieces do not have");
    }
    check_point(key, pair, own, body, matches!(key.partner, Partner::Fixed(_)))?;
    let part = of_theirs.filter(|_| may_be_turned(key, pair));
    match part.is_some_and(|part| is_off_plane(theirs, part, features, true)) {
        true => Err(ELSEWHERE),
        false => Ok(()),
    }
}

/// Holds what the key names of the plane's owner against where it is at the step's start: `seen` is the touching
/// point there, in the frame of the plane's owner; `moved` (m) is what the bodies move.
pub(super) fn check_start(
    key: &ContactKey,
    pair: &PairFeatures,
    features: &Features,
    (own, theirs): ContactPieces<'_>,
    seen: &Vector3<f64>,
    moved: f64,
) -> Result<(), Misplaced> {
    let near = BAND * size(own).min(size(theirs)) + moved;
    let normal = features.frame.column(2);
    let foot = seen - normal * (normal.dot(seen) - features.offset + theirs.radius());
    match parts(key, pair).1.is_some_and(|part| distance(theirs, part, &foot) > near) {
        true => Err(ELSEWHERE),
        false => Ok(()),
    }
}
