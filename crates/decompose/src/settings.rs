//! Settings of a decomposition.

use serde::{Deserialize, Serialize};
use tumble_core::error::{Error, in_range};

/// Settings of a decomposition: at most 32 pieces, 64 voxels, a concavity of 0.002 by default.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields, expecting = "{ pieces = …, resolution = …, concavity = … }")]
#[non_exhaustive]
pub struct DecompositionSettings {
    /// Maximum number of pieces, 1 to 32 (`max_convex_hulls`).
    pub pieces: u32,
    /// Number of voxels along the longest side of the mesh, 16 to 128.
    pub resolution: u32,
    /// Volume by which a piece may exceed its parts, relative to the convex hull of the mesh, from 0
    /// to 1. Fewer pieces are made if it allows, and more volume is added if `pieces` requires it.
    pub concavity: f64,
}

impl Default for DecompositionSettings {
    fn default() -> Self {
        Self { pieces: 32, resolution: 64, concavity: 0.002 }
    }
}

impl DecompositionSettings {
    /// Checks the ranges.
    ///
    /// # Errors
    /// The first value out of range.
    pub fn check(&self) -> Result<(), Error> {
        let counts = [
            ("pieces", self.pieces, 1..=32, "1 to 32"),
            // The memory grows with the cube of the resolution: 128 voxels a side take 0.1 GB.
            ("resolution", self.resolution, 16..=128, "16 to 128"),
        ];
        for (field, count, range, allowed) in counts {
            if !range.contains(&count) {
                return Err(Error::Count { field, count: count as usize, allowed });
            }
        }
        in_range("concavity", self.concavity, 0.0, 1.0, "0 to 1").map(drop)
    }
}
