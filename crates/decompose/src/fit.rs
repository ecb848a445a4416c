//! Comparison of pieces with their mesh.

use crate::solid::Solid;
use nalgebra::Vector3;
use tumble_core::error::Error;
use tumble_core::geometry::mesh::Mesh;
use tumble_core::geometry::{MassProperties, Piece};

/// Agreement of convex pieces with the mesh that they approximate.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Fit {
    /// Sum of the volumes of the pieces over the volume of the mesh.
    pub volume_ratio: f64,
    /// Largest distance of the pieces' surfaces from the solid (m), sampled.
    pub outside: f64,
}

/// Number of sample points along the longest side of the mesh.
const SAMPLES: f64 = 100.0;

impl Fit {
    /// Compares `pieces` with `mesh`. The distance is sampled on the surfaces of the pieces, with
    /// points at most 1/100 of the longest side apart.
    ///
    /// # Errors
    /// A mesh whose surface cannot be searched.
    pub fn new(pieces: &[Piece], mesh: &Mesh) -> Result<Self, Error> {
        let solid = Solid::new(mesh)?;
        let spacing = solid.extent() / SAMPLES;
        let volume: f64 = pieces.iter().map(|piece| MassProperties::from_piece(piece).volume).sum();
        let mut outside = 0.0_f64;
        for core in pieces.iter().map(Piece::core) {
            for face in 0..core.faces().len() {
                let polygon: Vec<_> = core.polygon(face).copied().collect();
                for two in polygon.windows(2).skip(1) {
                    for point in samples([polygon[0], two[0], two[1]], spacing) {
                        outside = outside.max(solid.distance(&point));
                    }
                }
            }
        }
        Ok(Self { volume_ratio: volume / mesh.volume(), outside })
    }
}

/// Points of a triangle on a grid with the given spacing or less.
fn samples([a, b, c]: [Vector3<f64>; 3], spacing: f64) -> impl Iterator<Item = Vector3<f64>> {
    let (along, across) = (b - a, c - a);
    let longest = along.norm().max(across.norm()).max((c - b).norm());
    let count = (longest / spacing).ceil().max(1.0) as usize;
    let point = move |i: usize, j: usize| a + (along * i as f64 + across * j as f64) / count as f64;
    (0..=count).flat_map(move |i| (0..=count - i).map(move |j| point(i, j)))
}
