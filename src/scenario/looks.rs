//! What bodies look like that do not look like their shapes.

use super::failure::Failure;
use super::model::Model;
use super::shape::{Form, PlacedForm};
use crate::error::Error;
use crate::film;
use nalgebra::{Matrix3, Vector3};
use tumble_pictures::{Film, Mesh, Piece};

impl Model {
    /// Gives those bodies of a film of it their looks.
    ///
    /// # Errors
    /// A look that is not there, and what the library refuses of a shape.
    pub fn dress(&self, film: &mut Film) -> Result<(), Failure> {
        for (index, (model, body)) in self.bodies.iter().zip(&mut film.bodies).enumerate() {
            let Some(look) = model.look else { continue };
            let odd = |why: &dyn std::fmt::Display| {
                Failure::Input(format!("model.bodies[{index}].look: {why}"))
            };
            let look = self.looks.get(look).ok_or_else(|| odd(&"there is no such look"))?;
            let centre = Vector3::from(model.centre);
            let pieces: Result<_, _> = look.iter().map(|part| seen(part, &centre)).collect();
            body.pieces = pieces.map_err(|error| odd(&error))?;
        }
        Ok(())
    }
}

/// A part of a look as a picture has it, from the centre of mass.
fn seen(part: &PlacedForm, centre: &Vector3<f64>) -> Result<Piece, Error> {
    let Form::Mesh { vertices, triangles, .. } = &part.form else {
        return Ok(film::piece(&part.piece()?.moved_by(&Matrix3::identity(), &-centre)?));
    };
    let (rotation, position) = (part.place.rotation(), Vector3::from(part.place.position));
    let place = |vertex: &[f64; 3]| rotation * Vector3::from(*vertex) + position - centre;
    let vertices = vertices.iter().map(place).collect();
    Ok(Piece::Mesh(Mesh { vertices, triangles: triangles.clone() }))
}
