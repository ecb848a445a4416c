//! Terrains of a world, and what is common to all its fixed colliders.

use super::World;
use crate::error::{Error, in_range};
use crate::geometry::{Piece, Terrain};
use std::sync::Arc;

/// A terrain of the world: a height field or a surface of triangles.
#[derive(Debug, Clone, PartialEq)]
pub struct FixedTerrain {
    /// Geometry in the world frame.
    pub terrain: Arc<Terrain>,
    /// Own coefficient of friction, instead of the world's.
    pub friction: Option<f64>,
}

impl World {
    /// Returns this world with `terrains`. Fixed colliders are numbered in one sequence: first the
    /// [fixed pieces](World::fixed), then the terrains.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] if a coefficient of friction is outside 0…10.
    pub fn with_terrains(self, terrains: Vec<FixedTerrain>) -> Result<Self, Error> {
        for friction in terrains.iter().filter_map(|terrain| terrain.friction) {
            in_range("coefficient of friction", friction, 0.0, 10.0, "0 to 10")?;
        }
        Ok(Self { terrains, ..self })
    }

    /// Terrains. The fixed collider of the first one has the number of fixed pieces as its index.
    pub fn terrains(&self) -> &[FixedTerrain] {
        &self.terrains
    }

    /// Number of fixed colliders: pieces and terrains.
    pub fn fixed_count(&self) -> usize {
        self.fixed.len() + self.terrains.len()
    }

    /// Terrain of the fixed collider `index`, if it is one.
    pub fn terrain(&self, index: usize) -> Option<&Terrain> {
        let terrain = self.terrains.get(index.checked_sub(self.fixed.len())?)?;
        Some(&terrain.terrain)
    }

    /// Piece `number` of the fixed collider `index`: a triangle of a terrain, or the only piece of
    /// another one. `None` if it does not exist.
    #[inline]
    pub fn fixed_piece(&self, index: usize, number: usize) -> Option<&Piece> {
        match self.fixed.get(index) {
            Some(fixed) => (number == 0).then_some(&fixed.piece),
            None => self.terrain(index)?.piece(number),
        }
    }

    /// Own coefficient of friction of the fixed collider `index`.
    #[inline]
    pub(super) fn fixed_friction(&self, index: usize) -> Option<f64> {
        match self.fixed.get(index) {
            Some(fixed) => fixed.friction,
            None => self.terrains[index - self.fixed.len()].friction,
        }
    }

    /// Own coefficients of friction of all fixed colliders.
    pub(super) fn fixed_frictions(&self) -> impl Iterator<Item = Option<f64>> {
        let fixed = self.fixed.iter().map(|fixed| fixed.friction);
        fixed.chain(self.terrains.iter().map(|terrain| terrain.friction))
    }
}
