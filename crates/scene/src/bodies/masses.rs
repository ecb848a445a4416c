//! Mass, inertia and centre of mass of a body, given explicitly or computed from its shape.

use super::entries::BodyEntry;
use crate::bodies::shape::{BodyShape, SpecificSolid};
use crate::tables::InertiaValue;
use nalgebra::{Matrix3, Vector3};
use tumble_core::error::Error;
use tumble_core::geometry::{Aabb, Hint, PairScratch, Piece, overlap};
use tumble_core::mechanics::Pose;
use tumble_model::failure::field_of;

/// Inertia of a point mass per unit mass (m²). It has no effect.
const POINT_INERTIA: f64 = 1.0;

/// Tolerance of overlap for rounding and decimal input, as a fraction of the smaller piece's size.
const TOUCHING: f64 = 1e-6;

/// Rejects overlapping pieces of a body if mass properties are computed from them.
///
/// The overlap would be counted twice.
fn refuse_overlapping_pieces(shape: &BodyShape, entry: &BodyEntry) -> Result<(), String> {
    let is_given = entry.inertia.as_ref().is_some_and(|inertia| inertia.matrix().is_some());
    if entry.mass.is_some() && entry.centre.is_some() && is_given {
        return Ok(());
    }
    let pieces = shape.pieces().map_err(|error| with_field(&error))?;
    let here = Pose { position: Vector3::zeros(), rotation: Matrix3::identity() };
    let size = |piece: &Piece| piece.core().reach() + piece.radius();
    let mut scratch = PairScratch::default();
    for (second, piece) in pieces.iter().enumerate() {
        for (first, other) in pieces[..second].iter().enumerate() {
            let placed = [(other, &here), (piece, &here)];
            let depth = overlap(placed[0], placed[1], &mut Hint::default(), &mut scratch);
            if depth > TOUCHING * size(piece).min(size(other)) {
                return Err(format!(
                    "pieces[{second}]: it overlaps pieces[{first}] by {depth:.3e} m, which would \
                     count twice in mass, centre and inertia; separate them, or give all three in \
                     numbers"
                ));
            }
        }
    }
    Ok(())
}

/// Length above which a part is probably in millimetres (m).
pub const LARGEST_PART: f64 = 10.0;

/// Mass above which a part of such a length is probably in millimetres (kg).
pub const HEAVIEST_PART: f64 = 1e6;

/// Question about the unit of a mesh that is given without a scale.
pub const MILLIMETRES: &str = "is the file in millimetres? Then add `scale = 0.001`";

/// Length of a shape that exceeds [`LARGEST_PART`] (m).
pub fn size_of_large_part(shape: &BodyShape) -> Option<f64> {
    let pieces = shape.pieces().ok()?;
    let here = Pose { position: Vector3::zeros(), rotation: Matrix3::identity() };
    let boxes = pieces.iter().map(|piece| Aabb::from_piece(piece, &here));
    let around = boxes.reduce(|all, next| all.joined(&next))?;
    Some((around.high - around.low).max()).filter(|length| *length > LARGEST_PART)
}

/// Mass (kg), inertia tensor (kg m²) and centre of mass (m), in the shape's frame. `solid` replaces
/// the properties of the shape's pieces.
pub fn mass_properties(
    shape: &BodyShape,
    solid: Option<SpecificSolid>,
    entry: &BodyEntry,
) -> Result<(f64, Matrix3<f64>, Vector3<f64>), String> {
    let has_numbers = entry.inertia.as_ref().is_some_and(|inertia| inertia.matrix().is_some());
    let has_centre = entry.centre.is_some() || matches!(shape, BodyShape::Points(_));
    let solid = if solid.is_some() || (entry.mass.is_some() && has_numbers && has_centre) {
        solid
    } else {
        refuse_overlapping_pieces(shape, entry)?;
        shape.solid().map_err(|error| with_field(&error))?
    };
    let mass = match (entry.mass, entry.density, &solid) {
        (Some(mass), None, _) => mass,
        (None, Some(density), Some(solid)) => {
            if !(1e-6..=1e9).contains(&density) {
                return Err(format!("density is {density:?}; allowed: 1e-6 to 1e9 kg/m³"));
            }
            density * solid.volume
        }
        (None, Some(_), None) => return Err("density: points have no volume; give mass".to_owned()),
        _ => return Err("mass: one of `mass` and `density` is needed".to_owned()),
    };
    if !(1e-9..=1e9).contains(&mass) {
        return Err(format!("mass is {mass:?} kg; allowed: 1e-9 to 1e9"));
    }
    let given = entry.inertia.as_ref().and_then(InertiaValue::matrix);
    if let (Some(centre), Some(_)) = (entry.centre, &given) {
        if !centre.0.iter().all(|coordinate| coordinate.abs() <= 1e4) {
            return Err("centre: coordinates from -1e4 to 1e4 m are needed".to_owned());
        }
    } else if entry.centre.is_some() {
        return Err("centre: it has no meaning without `inertia` in numbers".to_owned());
    }
    let centre = entry.centre.map(|centre| Vector3::from(centre.0));
    let is_point = matches!(shape, BodyShape::Points(points) if points[..] == [[0.0; 3]]);
    match (solid, given) {
        (solid, Some(inertia)) => {
            let own = solid.map_or(Vector3::zeros(), |solid| solid.centre);
            Ok((mass, inertia, centre.unwrap_or(own)))
        }
        (Some(solid), None) => Ok((mass, solid.specific_inertia * mass, solid.centre)),
        (None, None) if is_point => {
            let inertia = Matrix3::from_diagonal_element(POINT_INERTIA * mass);
            Ok((mass, inertia, Vector3::zeros()))
        }
        (None, None) => Err("inertia: required with `points`".to_owned()),
    }
}

/// Error of the core with the field that causes it.
pub fn with_field(error: &Error) -> String {
    format!("{}: {error}", field_of(error).unwrap_or("shape"))
}
