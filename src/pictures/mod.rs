//! Pictures of a trajectory: pure functions from rows to bytes.

pub mod animation;
pub mod plot;
pub mod view;

use tumble::model::ContactModel;
use tumble::trajectory::TrajectoryRow;

/// A trajectory in memory, with what is needed to draw it.
pub struct Film {
    /// Scene, seed and solver, for a heading; empty where nothing is known of them.
    pub title: String,
    /// Mass, inertia, contact points, gravity, friction, time step.
    pub model: ContactModel,
    /// At least one row; the last is the `end` row.
    pub rows: Vec<TrajectoryRow>,
}
