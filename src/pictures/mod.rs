//! Pictures of trajectories and validations: pure functions from rows to bytes.

pub mod animation;
pub mod plot;
pub mod validation;
pub mod view;

use tumble::load::Load;
use tumble::model::ContactModel;
use tumble::state::State;
use tumble::trajectory::TrajectoryRow;

/// A trajectory in memory, with what is needed to draw it.
pub struct Film {
    /// Scene, seed and solver, for a heading; empty where nothing is known of them.
    pub title: String,
    /// Mass, inertia, contact points, gravity, friction, time step.
    pub model: ContactModel,
    /// The external force and torque.
    pub load: Load,
    /// At least one row, in the world's frame; the last is the `end` row.
    pub rows: Vec<TrajectoryRow>,
}

impl Film {
    /// The state of row `k` in the ground's frame.
    pub fn ground_state(&self, k: usize) -> State {
        self.model.plane().state_to_ground(&self.rows[k].state)
    }
}
