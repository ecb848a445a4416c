//! Input and output arrays of a batch of rollouts, and their checks.

use super::driven::Driven;
use super::varied::{Varied, varied};
use super::watch::RolloutWatch;
use nalgebra::{SVector, Vector3};
use std::sync::Arc;
use tumble_core::error::Error;
use tumble_core::joint::{Course, Knots};
use tumble_core::mechanics::{Load, State, Wrench};
use tumble_core::simulation::{Motion, Simulation};
use tumble_core::world::World;

/// Function that creates the motion (integrator and step solver) of one rollout's world.
pub type MotionOf<'a> = &'a (dyn Fn(&World) -> Result<Motion<'static>, Error> + Sync);

/// B rollouts of T steps of a world of N bodies.
#[derive(Clone, Copy)]
pub struct Batch<'a> {
    /// World of all rollouts, except for `parameters`.
    pub world: &'a World,
    /// Creates the step solver of a rollout's world.
    pub motion: MotionOf<'a>,
    /// External load of each body in all rollouts, added to the controls: N loads, or empty.
    pub loads: &'a [Load],
    /// Prescribed motions of joint frames fixed in the world, by joint index, in all rollouts.
    pub courses: &'a [(usize, Knots)],
    /// Step index k of the starts. Loads are evaluated at the times from this step on.
    pub index: u64,
    /// Number of rollouts B.
    pub rollouts: usize,
    /// Number of steps T.
    pub steps: usize,
    /// Initial states of the bodies: (B or 1, N, 13), see [`State`].
    pub starts: &'a [f64],
    /// Wrench on each body in every step, (B or 1, T, N, 6): a force (N, world) and a torque (N m,
    /// body). Empty for no wrenches.
    pub controls: &'a [f64],
    /// Target of every motor in every step: (B or 1, T, M), m/s, rad/s, m or rad. The
    /// [motors](World::motors) of joints come first, then the [motors of
    /// gears](World::gear_motors). Empty for the targets of the world.
    pub motors: &'a [f64],
    /// Force along each [axis](World::driven_axes) with a drive in every step, added to the drive:
    /// (B or 1, T, D), N or N m. Empty for no forces.
    pub joint_forces: &'a [f64],
    /// Constants that differ between the rollouts' worlds.
    pub parameters: &'a [Varied<'a>],
}

/// Output buffers, owned by the caller. An empty buffer is not written.
#[derive(Debug, Default)]
pub struct RolloutOutputs<'a> {
    /// States after each step: (B, T, N, 13).
    pub states: &'a mut [f64],
    /// States after the last step: (B, N, 13).
    pub ends: &'a mut [f64],
    /// Sum of the contact forces on each body over each step, N, world: (B, T, N, 3).
    pub forces: &'a mut [f64],
    /// Residual of each step, m/s: (B, T).
    pub residuals: &'a mut [f64],
    /// Status of each step as an index into
    /// [`StepStatus::ALL`](tumble_core::step::StepStatus::ALL): (B, T).
    pub statuses: &'a mut [u8],
}

impl Batch<'_> {
    /// Number of bodies N.
    fn bodies(&self) -> usize {
        self.world.bodies().len()
    }

    /// Length of a tangent vector of a rollout's states, 12 N.
    #[cfg(feature = "save")]
    pub(super) fn change_width(&self) -> usize {
        tumble_core::derivative::StateChange::LEN * self.bodies()
    }

    /// Checks the lengths of all arrays against their shapes.
    pub(super) fn check(&self, outputs: &RolloutOutputs<'_>) -> Result<(), Error> {
        let (b, t, n) = (self.rollouts, self.steps, self.bodies());
        count("rollouts", b, "1 or more", b > 0)?;
        count("steps of a rollout", t, "1 or more", t > 0)?;
        // A size that overflows cannot match any length.
        let size = |factors: &[usize]| {
            factors.iter().try_fold(1_usize, |product, factor| product.checked_mul(*factor))
        };
        // An array may be shared by all rollouts, or have one part for each.
        let shared = |each: Option<usize>, length: usize| {
            Some(length) == each || Some(length) == each.and_then(|each| each.checked_mul(b))
        };
        let starts = self.starts.len();
        count("numbers in the starts", starts, "(B or 1, N, 13)", shared(size(&[n, 13]), starts))?;
        let controls = self.controls.len();
        let fits = controls == 0 || shared(size(&[t, n, 6]), controls);
        count("numbers in the controls", controls, "(B or 1, T, N, 6), or none", fits)?;
        let axes = self.world.driven_axes().len();
        let motors = self.world.motors().len() + self.world.gear_motors().len();
        let length = self.motors.len();
        let fits = length == 0 || shared(size(&[t, motors]), length);
        count("numbers for motors", length, "(B or 1, T, M), or none", fits)?;
        let length = self.joint_forces.len();
        let fits = length == 0 || shared(size(&[t, axes]), length);
        count("numbers for forces of joints", length, "(B or 1, T, D), or none", fits)?;
        let loads = self.loads.len();
        count("loads", loads, "one per body, or none", loads == 0 || loads == n)?;
        for Varied { constant, values } in self.parameters {
            let fits = Some(values.len()) == size(&[b, constant.width(self.world)]);
            count(constant.name(), values.len(), "B times the numbers of one world", fits)?;
        }
        for (field, length, factors, allowed) in [
            ("numbers for states", outputs.states.len(), &[b, t, n, 13][..], "(B, T, N, 13)"),
            ("numbers for ends", outputs.ends.len(), &[b, n, 13], "(B, N, 13)"),
            ("numbers for forces", outputs.forces.len(), &[b, t, n, 3], "(B, T, N, 3)"),
            ("numbers for residuals", outputs.residuals.len(), &[b, t], "(B, T)"),
            ("numbers for statuses", outputs.statuses.len(), &[b, t], "(B, T)"),
        ] {
            count(field, length, allowed, length == 0 || Some(length) == size(factors))?;
        }
        Ok(())
    }

    /// Simulation of `rollout` and its actuation.
    pub(super) fn simulation(
        &self,
        rollout: usize,
        watch: RolloutWatch<'_>,
    ) -> Result<(Simulation<'static>, Driven), Error> {
        let world = if self.parameters.is_empty() {
            self.world.clone()
        } else {
            varied(self.world, self.parameters, rollout)?
        };
        let motion = (self.motion)(&world)?;
        let driven = Driven::new(&world);
        let mut simulation = Simulation::new(world, self.start(rollout), motion)?;
        for (body, load) in self.loads.iter().enumerate() {
            simulation.set_load(body, load.clone())?;
        }
        simulation.set_index(self.index)?;
        for (joint, knots) in self.courses {
            simulation.set_course(*joint, Course::Through(knots.clone()))?;
        }
        if let Some(flag) = watch.interrupt {
            simulation.interrupt_by(Arc::clone(flag));
        }
        Ok((simulation, driven))
    }

    /// Initial states of `rollout`.
    fn start(&self, rollout: usize) -> impl Iterator<Item = State> + '_ {
        let states = rollout_slice(self.starts, 13 * self.bodies(), rollout).chunks_exact(13);
        states.map(|numbers| State::from_vector(&SVector::<f64, 13>::from_column_slice(numbers)))
    }

    /// Wrenches of the controls on each body in `step` of `rollout`; empty without controls.
    fn wrenches(&self, rollout: usize, step: usize) -> impl Iterator<Item = Wrench> + '_ {
        let now = self.now(self.controls, 6 * self.bodies(), rollout, step);
        now.chunks_exact(6).map(|numbers| Wrench {
            force: Vector3::from_column_slice(&numbers[..3]),
            torque: Vector3::from_column_slice(&numbers[3..]),
        })
    }

    /// Sets wrenches, joint forces and motor targets for `step` of `rollout`.
    pub(super) fn set(
        &self,
        driven: &Driven,
        rollout: usize,
        step: usize,
        simulation: &mut Simulation<'_>,
    ) -> Result<(), Error> {
        for (body, wrench) in self.wrenches(rollout, step).enumerate() {
            simulation.set_wrench(body, wrench)?;
        }
        let targets = self.now(self.motors, driven.targets(), rollout, step);
        let forces = self.now(self.joint_forces, driven.forces(), rollout, step);
        driven.set(simulation, forces, targets)
    }

    /// The `width` numbers of `step` of `rollout`; none of an empty array.
    fn now<'n>(&self, numbers: &'n [f64], width: usize, rollout: usize, step: usize) -> &'n [f64] {
        let all = rollout_slice(numbers, self.steps * width, rollout);
        if all.is_empty() { all } else { &all[step * width..][..width] }
    }
}

/// Slice of `width` numbers of `rollout`, or the shared slice. An empty array stays empty.
pub(super) fn rollout_slice(numbers: &[f64], width: usize, rollout: usize) -> &[f64] {
    match numbers.len() {
        0 => numbers,
        length if length == width => numbers,
        _ => &numbers[rollout * width..][..width],
    }
}

fn count(
    field: &'static str,
    count: usize,
    allowed: &'static str,
    fits: bool,
) -> Result<(), Error> {
    if fits { Ok(()) } else { Err(Error::Count { field, count, allowed }) }
}

impl<'a> RolloutOutputs<'a> {
    /// Slices of the buffers, one item per rollout.
    pub(super) fn shares(self, rollouts: usize) -> impl Iterator<Item = Self> {
        let mut states = parts(self.states, rollouts);
        let mut ends = parts(self.ends, rollouts);
        let mut forces = parts(self.forces, rollouts);
        let mut residuals = parts(self.residuals, rollouts);
        let mut statuses = parts(self.statuses, rollouts);
        (0..rollouts).map(move |_| Self {
            states: states.next().unwrap_or_default(),
            ends: ends.next().unwrap_or_default(),
            forces: forces.next().unwrap_or_default(),
            residuals: residuals.next().unwrap_or_default(),
            statuses: statuses.next().unwrap_or_default(),
        })
    }
}

/// Splits a slice into `count` equal parts. An empty slice has none.
fn parts<T>(slice: &mut [T], count: usize) -> std::slice::ChunksExactMut<'_, T> {
    let part = (slice.len() / count).max(1);
    slice.chunks_exact_mut(part)
}
