//! Terrains of a world, and what is common to all its fixed colliders.

use super::World;
use crate::geometry::{Piece, Terrain};
use std::sync::Arc;

impl World {
    /// Returns this world with `terrains`. Fixed colliders are numbered in one sequence: first the
    /// [fixed pieces](World::fixed), then the terrains.
    #[must_use]
    pub fn with_terrains(self, terrains: Vec<Arc<Terrain>>) -> Self {
        Self { terrains, ..self }
    }

    /// Terrains. The fixed collider of the first one has the number of fixed pieces as its index.
    pub fn terrains(&self) -> &[Arc<Terrain>] {
        &self.terrains
    }

    /// Number of fixed colliders: pieces and terrains.
    pub fn fixed_count(&self) -> usize {
        self.fixed.len() + self.terrains.len()
    }

    /// Terrain of the fixed collider `index`, if it is one.
    pub fn terrain(&self, index: usize) -> Option<&Terrain> {
        self.terrains.get(index.checked_sub(self.fixed.len())?).map(Arc::as_ref)
    }

    /// Piece `number` of the fixed collider `index`: a triangle of a terrain, or the only piece of
    /// another one. `None` if it does not exist.
    #[inline]
    pub fn fixed_piece(&self, index: usize, number: usize) -> Option<&Piece> {
        match self.fixed.get(index) {
            Some(fixed) => (number == 0).then_some(fixed),
            None => self.terrain(index)?.piece(number),
        }
    }
}
