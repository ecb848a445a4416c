//! A plan as a scene: its starts, its constants, and its wrenches as loads over time.
//!
//! A run of the scene equals the replay to the last bit.

use super::{PlanProblem, Replay, piecewise_loads};
use nalgebra::Vector3;
use tumble_core::mechanics::{Load, State};
use tumble_core::world::World;
use tumble_model::failure::Failure;
use tumble_scene::Document;
use tumble_scene::scene::Scene;

impl PlanProblem {
    /// Scene whose run is `replay`.
    ///
    /// # Errors
    /// A scene that the library refuses; a replay of this problem has none.
    pub fn scene_of(&self, replay: &Replay) -> Result<Scene, Failure> {
        let other = |error: super::PlanError| Failure::Other(error.to_string());
        let (world, starts) =
            (self.world(&replay.controls).map_err(other)?, self.starts(&replay.controls));
        let mut loads = self.scene.loads.clone();
        for (body, _) in self.pushed().iter().enumerate().filter(|(_, pushed)| **pushed) {
            loads[body] = self.load_of(body, replay)?;
        }
        let scene = self.scene.clone();
        let drawn = scene.drawn && starts == scene.starts;
        let mut document = scene.document.clone();
        rewrite(&mut document, &world, &starts, &loads);
        Ok(Scene { drawn, ..scene.with_document(document)? })
    }

    /// Wrenches on `body` as a load over time.
    fn load_of(&self, body: usize, replay: &Replay) -> Result<Load, Failure> {
        let (mut forces, mut torques) = (Vec::new(), Vec::new());
        let mut wrenches = Vec::new();
        for (step, states) in replay.states.iter().take(self.steps).enumerate() {
            self.wrenches(step, states, &replay.controls, &mut wrenches);
            forces.push(wrenches[body].force);
            torques.push(wrenches[body].torque);
        }
        let first = self.scene.start_index;
        let h = self.scene.world.time_step();
        let through = |values: &[Vector3<f64>]| piecewise_loads::through(values, first, h);
        Ok(Load::new(through(&forces)?, through(&torques)?, Vector3::zeros())?)
    }
}

/// Writes constants, starts and loads into a document in exact form.
fn rewrite(document: &mut Document, world: &World, starts: &[State], loads: &[Load]) {
    if let Some(ground) = &mut document.ground {
        ground.friction = Some(world.friction());
        ground.restitution = Some(world.restitution());
        ground.set_plane(world.ground());
    }
    document.set_gravity(world.gravity());
    document.set_starts(starts);
    document.set_loads(loads);
    for (of, body) in document.bodies.iter_mut().zip(world.bodies()) {
        of.set_mass(body.mass(), body.inertia());
    }
}
