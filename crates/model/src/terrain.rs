//! Terrain of a model: height fields and surfaces of triangles.

use crate::groups::GroupsModel;
use std::sync::Arc;
use tumble_core::geometry::Terrain;

/// Terrain in the world.
#[derive(Debug, Clone)]
pub struct TerrainModel {
    /// Name.
    pub name: String,
    /// Geometry.
    pub terrain: Arc<Terrain>,
    /// Coefficient of friction; `None` for the world's.
    pub friction: Option<f64>,
    /// Collision groups.
    pub groups: GroupsModel,
}
