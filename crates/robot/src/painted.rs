//! Coloured triangles of mesh files.

use nalgebra::Vector3;

/// Triangle with counter-clockwise corners seen from outside (m).
pub type Facet = [Vector3<f64>; 3];

/// Triangles of one colour.
#[derive(Debug, Clone, PartialEq)]
pub struct Painted {
    /// Red, green and blue. `None` if the file names none.
    pub colour: Option<[u8; 3]>,
    pub facets: Vec<Facet>,
}

/// Colour of red, green and blue from 0 to 1, and possibly an opacity. `None` if it is invisible or
/// not a colour.
pub fn colour_of(numbers: &[f64]) -> Option<[u8; 3]> {
    let &[red, green, blue, ref rest @ ..] = numbers else { return None };
    let is_visible = rest.first().is_none_or(|opacity| *opacity > 0.0);
    // The conversion saturates.
    is_visible.then(|| [red, green, blue].map(|channel| (channel * 255.0).round() as u8))
}
