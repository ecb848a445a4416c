//! Looks of bodies that differ from their shapes.

use nalgebra::{Matrix3, Vector3};
use tumble_core::error::Error;
use tumble_model::Model;
use tumble_model::failure::Failure;
use tumble_model::shape::{ModelForm, PlacedForm};
use tumble_view::{Film, FilmMesh, FilmPiece};

/// Replaces the pieces of bodies that have a look in `model`.
///
/// # Errors
/// A missing look; a shape that the library refuses.
pub fn dress(model: &Model, film: &mut Film) -> Result<(), Failure> {
    for (index, (body, seen)) in model.bodies.iter().zip(&mut film.bodies).enumerate() {
        let Some(look) = body.look else { continue };
        let odd = |why: &dyn std::fmt::Display| {
            Failure::Input(format!("model.bodies[{index}].look: {why}"))
        };
        let look = model.looks.get(look).ok_or_else(|| odd(&"there is no such look"))?;
        let centre = Vector3::from(body.centre);
        let pieces: Result<_, _> = look.iter().map(|part| piece_of(part, &centre)).collect();
        seen.pieces = pieces.map_err(|error| odd(&error))?;
    }
    Ok(())
}

/// Part of a look, relative to the centre of mass.
fn piece_of(part: &PlacedForm, centre: &Vector3<f64>) -> Result<FilmPiece, Error> {
    let ModelForm::Mesh { vertices, triangles, colour, .. } = &part.form else {
        return Ok(crate::piece(&part.piece()?.moved_by(&Matrix3::identity(), &-centre)?));
    };
    let (rotation, position) = (part.place.rotation(), Vector3::from(part.place.position));
    let place = |vertex: &[f64; 3]| rotation * Vector3::from(*vertex) + position - centre;
    let vertices = vertices.iter().map(place).collect();
    Ok(FilmPiece::Mesh(FilmMesh {
        vertices,
        triangles: triangles.clone(),
        colour: colour.map(|colour| colour.0),
    }))
}
