//! Coordinates of a robot in a simulation.

use crate::robot::PyRobot;
use tumble_core::mechanics::State;
use tumble_core::simulation::Simulation;

/// Coordinates of a robot at the states at which they were last computed. Observations, rewards and
/// controllers read them several times between two steps.
#[derive(Default)]
pub struct LastCoordinates {
    robot: usize,
    states: Vec<State>,
    near: Vec<f64>,
    q: Vec<f64>,
    v: Vec<f64>,
}

impl LastCoordinates {
    /// Current coordinates and rates of a robot. Hinges include full turns; other angles are the
    /// ones nearest to `near`.
    ///
    /// # Errors
    /// Too few states; a wrong number of coordinates.
    pub fn read(
        &mut self,
        robot: &PyRobot,
        simulation: &Simulation<'_>,
        near: &[f64],
    ) -> Result<(&[f64], &[f64]), String> {
        let angles: Vec<_> = simulation.joint_angles().collect();
        let mut near = near.to_vec();
        for (joint, place, reference) in robot.hinges() {
            let angle = angles.get(joint.0).map(|angles| angles[joint.1]);
            if let (Some(near), Some(angle)) = (near.get_mut(place), angle) {
                *near = angle + reference;
            }
        }
        // The coordinates are the nearest to themselves.
        let is_same = self.robot == robot.index()
            && self.states == simulation.states()
            && (self.near == near || self.q == near);
        if !is_same {
            let (q, v) = robot.own().coordinates(simulation.states(), &near)?;
            let states = simulation.states().to_vec();
            *self = Self { robot: robot.index(), states, near, q, v };
        }
        Ok((&self.q, &self.v))
    }
}
