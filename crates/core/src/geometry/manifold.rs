//! Contact manifold of two pieces: points of one against planes of the other.
//!
//! The axis of largest separation selects the features. If a face is nearly perpendicular to it,
//! the contact points are the corners of the polygon in which the two faces overlap along the axis.
//! Otherwise two edges, an edge and a vertex, or two vertices meet in one point. Parallel edges
//! meet in the two ends of their common part.

use super::Piece;
use super::axes::best_axis;
use super::features::PieceSide;
use super::hint::Hint;
use super::manifold_pair::{MERGE, ManifoldPair};
use super::pair::{PiecePair, PlacedPiece};
use super::scratch::PairScratch;
use super::separating_axis::{AxisSource, SeparatingAxis, TieBreak};
use super::smooth_manifold::{on_flat_face, smooth_manifold};
use super::smooth_side::is_flat_end;
use super::touch::ManifoldPoint;
use nalgebra::Vector3;

/// Fills `out` with the contact points of two pieces whose gap is at most `reach` (m), and returns
/// the separation of the pieces (m).
///
/// Two faces produce every corner of the polygon in which they overlap:
///
/// - Vertices of one face lie against the plane of the other face.
/// - Crossings of sides are points of one piece. It is the piece whose face is less aligned with
///   the axis; then the one with the smaller face; then the one that is not `plane_of`.
///
/// Corners that coincide to 1e-7 of the smaller piece's size are merged. A vertex wins against a
/// crossing. Of two vertices the one of the piece that owns the crossings stays. Keys and number of
/// contacts of two faces do not change under smaller drifts.
///
/// If both cores are polyhedra and meet in edges, the edges span the plane, and `plane_of` owns it.
/// If a rounded piece meets an edge or a vertex, the plane is perpendicular to the shortest line.
/// The piece with the larger radius owns the point, so the plane belongs to the less rounded piece,
/// or to `plane_of`. Swapping A and B changes the result only through `plane_of`.
///
/// The returned value equals [`signed_distance`](super::signed_distance) if it is negative, to 1e-7 of
/// the smaller piece's size. This tolerance keeps the choice among equal faces steady. Otherwise it
/// is a lower bound on the separation, and it exceeds `reach` if no features are within reach.
///
/// A contact with a positive gap is only a candidate: the bodies may never reach its plane.
pub fn manifold(
    a: PlacedPiece<'_>,
    b: PlacedPiece<'_>,
    reach: f64,
    plane_of: PieceSide,
    hint: &mut Hint,
    scratch: &mut PairScratch,
    out: &mut Vec<ManifoldPoint>,
) -> f64 {
    out.clear();
    let pair = PiecePair::new(a, b);
    let radii = pair.radii();
    let quick = pair.quick_gap(hint) - radii;
    if quick > reach {
        return quick;
    }
    pair.place(scratch);
    if pair.is_smooth() {
        let axis = pair.smooth_axis(hint);
        hint.set(&pair, Some(axis), None);
        let gap = pair.gap_along(&axis) - radii;
        if gap <= reach {
            let found = ManifoldPair { pair, scratch, reach, plane_of, out, points: None };
            smooth_manifold(found, &axis);
        }
        return gap;
    }
    let tie = TieBreak { within: MERGE * pair.size(), to: plane_of };
    let axis = best_axis(&pair, scratch, reach + radii, tie);
    hint.set(&pair, axis.map(|axis| axis.normal), axis.map(|axis| axis.kind));
    if let Some(axis) = axis.filter(|axis| axis.gap - radii > reach) {
        return axis.gap - radii;
    }
    let mut meeting = ManifoldPair { pair, scratch, reach, plane_of, out, points: None };
    let gap = meeting.find(axis);
    let spanned = meeting.shortest().is_none();
    let normal = meeting.normal(axis);
    hint.set(&pair, Some(normal), axis.filter(|_| spanned).map(|axis| axis.kind));
    gap - radii
}

/// Fills `out` with the contact points of two pieces along the normal of a flat face of one of them,
/// whose gap is at most `reach` (m), and returns the gap along it (m).
///
/// The pieces need not be closest along this normal. See [`manifold`] for the other arguments.
pub(crate) fn manifold_across(
    a: PlacedPiece<'_>,
    b: PlacedPiece<'_>,
    (side, face): (PieceSide, usize),
    reach: f64,
    plane_of: PieceSide,
    scratch: &mut PairScratch,
    out: &mut Vec<ManifoldPoint>,
) -> f64 {
    out.clear();
    let pair = PiecePair::new(a, b);
    pair.place(scratch);
    let (kind, normal) = match side {
        PieceSide::A => (AxisSource::FaceA(face), pair.a.faces()[face].normal),
        PieceSide::B => (AxisSource::FaceB(face), -(pair.rotation * pair.b.faces()[face].normal)),
    };
    let axis = SeparatingAxis { kind, normal, gap: pair.gap_along(&normal), exact: true };
    let mut found = ManifoldPair { pair, scratch, reach, plane_of, out, points: None };
    if pair.is_smooth() {
        on_flat_face(&mut found, side, face);
    }
    found.faces(&axis);
    axis.gap - pair.radii()
}

/// Indices of the flat faces of a piece: of a polyhedron, or the ends of a cylinder or a cone.
pub(crate) fn flat_faces(piece: &Piece) -> impl Iterator<Item = usize> + '_ {
    let is_flat = |normal: &Vector3<f64>| is_flat_end(piece.smooth(), normal);
    let faces = piece.core().faces().iter().enumerate();
    faces.filter(move |(_, face)| is_flat(&face.normal)).map(|(index, _)| index)
}

/// Indices of the edges of A and B that span the axis of largest separation. `None` if the axis is
/// a face normal.
pub(crate) fn edges_across(a: PlacedPiece<'_>, b: PlacedPiece<'_>) -> Option<(usize, usize)> {
    let pair = PiecePair::new(a, b);
    let mut scratch = PairScratch::default();
    pair.place(&mut scratch);
    let tie = TieBreak { within: MERGE * pair.size(), to: PieceSide::A };
    match best_axis(&pair, &mut scratch, f64::INFINITY, tie)?.kind {
        AxisSource::Edges(first, second) => Some((first, second)),
        AxisSource::FaceA(_) | AxisSource::FaceB(_) => None,
    }
}
