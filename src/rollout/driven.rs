//! Joint forces and motor targets that change from step to step.

use tumble_core::error::Error;
use tumble_core::joint::{Drive, JointAxis};
use tumble_core::simulation::Simulation;
use tumble_core::world::World;

/// Driven axes and motors of a world: those of joints and of gears.
pub struct Driven {
    /// World with its own drives.
    own: World,
    axes: Vec<(usize, JointAxis)>,
    motors: Vec<(usize, JointAxis)>,
    gears: Vec<usize>,
}

impl Driven {
    /// Driven axes and motors of `world`.
    pub fn new(world: &World) -> Self {
        Self {
            own: world.clone(),
            axes: world.driven_axes(),
            motors: world.motors(),
            gears: world.gear_motors(),
        }
    }

    /// Number of joint forces.
    pub fn forces(&self) -> usize {
        self.axes.len()
    }

    /// Number of motor targets.
    pub fn targets(&self) -> usize {
        self.motors.len() + self.gears.len()
    }

    /// Sets the inputs of the next step, in the order of [`World::driven_axes`] for `forces` (N or N
    /// m, added to the world's own), and of [`World::motors`] and [`World::gear_motors`] for `targets`.
    /// Empty slices change nothing.
    ///
    /// # Errors
    /// A number that is not finite.
    pub fn set(
        &self,
        simulation: &mut Simulation<'_>,
        forces: &[f64],
        targets: &[f64],
    ) -> Result<(), Error> {
        let drive = |world: &World, (joint, axis): (usize, JointAxis)| {
            world.joints()[joint].drive(axis).copied().unwrap_or_default()
        };
        for (&(joint, axis), force) in self.axes.iter().zip(forces) {
            let force = drive(&self.own, (joint, axis)).force + force;
            let set = Drive { force, ..drive(simulation.world(), (joint, axis)) };
            simulation.set_drive(joint, axis, set)?;
        }
        for (&(joint, axis), target) in self.motors.iter().zip(targets) {
            let set = drive(simulation.world(), (joint, axis));
            let motor = set.motor.map(|motor| motor.to(*target));
            simulation.set_drive(joint, axis, Drive { motor, ..set })?;
        }
        for (&gear, target) in self.gears.iter().zip(targets.iter().skip(self.motors.len())) {
            let set = simulation.world().gears()[gear].drive().copied().unwrap_or_default();
            let motor = set.motor.map(|motor| motor.to(*target));
            simulation.set_gear_drive(gear, Drive { motor, ..set })?;
        }
        Ok(())
    }
}
