//! What goes into a batch of rollouts and what comes out, and whether it fits.

use super::varied::{Varied, varied};
use super::watch::RolloutWatch;
use nalgebra::{SVector, Vector3};
use std::sync::Arc;
use tumble_core::error::Error;
use tumble_core::joint::{Course, Drive, JointAxis, Knots};
use tumble_core::mechanics::{Load, State, Wrench};
use tumble_core::simulation::{Motion, Simulation};
use tumble_core::world::World;

/// What makes the motion of one rollout's world.
pub type MotionOf<'a> = &'a (dyn Fn(&World) -> Result<Motion<'static>, Error> + Sync);

/// B rollouts of T steps of a world of N bodies.
#[derive(Clone, Copy)]
pub struct Batch<'a> {
    /// The world of all rollouts, but for what `parameters` say.
    pub world: &'a World,
    /// Who solves the steps of a rollout's world.
    pub motion: MotionOf<'a>,
    /// What pushes each body in all rollouts, besides the controls: one a body, or none at all.
    pub loads: &'a [Load],
    /// How joints' frames in the world move in all rollouts, by the joints' indices.
    pub courses: &'a [(usize, Knots)],
    /// k of the starts: loads are those of the times from there on.
    pub index: u64,
    /// B.
    pub rollouts: usize,
    /// T.
    pub steps: usize,
    /// Where the bodies start: (B or 1, N, 13), see [`State`].
    pub starts: &'a [f64],
    /// What pushes each body in every step, (B or 1, T, N, 6): a force (N, world) and a torque
    /// (N m, body); empty for none.
    pub controls: &'a [f64],
    /// What each [motor](World::motors), and after these each of a [sum](World::gear_motors), holds or pulls to in every step, in
    /// place of its target: (B or 1, T, M), m/s, rad/s, m or rad; empty for the world's own.
    pub motors: &'a [f64],
    /// Forces along each [axis](World::driven_axes) that a drive can act on in every step, besides its drive: (B or 1, T, D), N
    /// or N m; empty for none.
    pub joint_forces: &'a [f64],
    /// What differs between the rollouts' worlds.
    pub parameters: &'a [Varied<'a>],
}

/// Memory for what comes out, the caller's. What is empty is not wanted.
#[derive(Debug, Default)]
pub struct RolloutOutputs<'a> {
    /// The states after each step: (B, T, N, 13).
    pub states: &'a mut [f64],
    /// The states after the last step alone: (B, N, 13).
    pub ends: &'a mut [f64],
    /// The sum of the contact forces on each body over each step, N, world: (B, T, N, 3).
    pub forces: &'a mut [f64],
    /// The residual of each step, m/s: (B, T).
    pub residuals: &'a mut [f64],
    /// How each step ended, the place in [`StepStatus::ALL`](tumble_core::step::StepStatus::ALL):
    /// (B, T).
    pub statuses: &'a mut [u8],
}

impl Batch<'_> {
    /// N.
    fn bodies(&self) -> usize {
        self.world.bodies().len()
    }

    /// How many numbers the changes of a rollout's states have.
    #[cfg(feature = "save")]
    pub(super) fn change_width(&self) -> usize {
        tumble_core::derivative::StateChange::LEN * self.bodies()
    }

    /// Refuses arrays of other lengths than their shapes say.
    pub(super) fn check(&self, outputs: &RolloutOutputs<'_>) -> Result<(), Error> {
        let (b, t, n) = (self.rollouts, self.steps, self.bodies());
        count("rollouts", b, "1 or more", b > 0)?;
        count("steps of a rollout", t, "1 or more", t > 0)?;
        // What does not fit into memory has no length.
        let size = |factors: &[usize]| {
            factors.iter().try_fold(1_usize, |product, factor| product.checked_mul(*factor))
        };
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
        count("loads", loads, "one a body, or none", loads == 0 || loads == n)?;
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

    /// The simulation of `rollout`, and what drives it.
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
        let driven = Driven::of(self, world.clone());
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

    /// The states at step 0 of `rollout`.
    fn start(&self, rollout: usize) -> impl Iterator<Item = State> + '_ {
        let states = of(self.starts, 13 * self.bodies(), rollout).chunks_exact(13);
        states.map(|numbers| State::from_vector(&SVector::<f64, 13>::from_column_slice(numbers)))
    }

    /// What the controls of `rollout` put on each body in `step`; nothing without controls.
    fn wrenches(&self, rollout: usize, step: usize) -> impl Iterator<Item = Wrench> + '_ {
        let width = 6 * self.bodies();
        let all = of(self.controls, self.steps * width, rollout);
        let now = if all.is_empty() { all } else { &all[step * width..][..width] };
        now.chunks_exact(6).map(|numbers| Wrench {
            force: Vector3::from_column_slice(&numbers[..3]),
            torque: Vector3::from_column_slice(&numbers[3..]),
        })
    }
}

/// What drives a rollout in every step: the axes of its joints, which of them have motors, and which gears have one of their
/// sum.
pub(super) struct Driven {
    /// The rollout's world, with the drives that it began with.
    own: World,
    axes: Vec<(usize, JointAxis)>,
    motors: Vec<(usize, JointAxis)>,
    gears: Vec<usize>,
}

impl Driven {
    /// What differs from step to step in `batch`.
    fn of(batch: &Batch<'_>, own: World) -> Self {
        fn or_none<T>(of: &[f64], axes: Vec<T>) -> Vec<T> {
            if of.is_empty() { Vec::new() } else { axes }
        }
        Self {
            own,
            axes: or_none(batch.joint_forces, batch.world.driven_axes()),
            motors: or_none(batch.motors, batch.world.motors()),
            gears: or_none(batch.motors, batch.world.gear_motors()),
        }
    }

    /// Sets it for `step` of `rollout`, and the wrenches of its controls.
    pub(super) fn set(
        &self,
        batch: &Batch<'_>,
        rollout: usize,
        step: usize,
        simulation: &mut Simulation<'_>,
    ) -> Result<(), Error> {
        for (body, wrench) in batch.wrenches(rollout, step).enumerate() {
            simulation.set_wrench(body, wrench)?;
        }
        let now = |numbers, width: usize| {
            let all: &[f64] = of(numbers, batch.steps * width, rollout);
            if all.is_empty() { all } else { &all[step * width..][..width] }
        };
        let drive = |world: &World, (joint, axis): (usize, JointAxis)| {
            world.joints()[joint].drive(axis).copied().unwrap_or_default()
        };
        for (&(joint, axis), force) in
            self.axes.iter().zip(now(batch.joint_forces, self.axes.len()))
        {
            let force = drive(&self.own, (joint, axis)).force + force;
            let set = Drive { force, ..drive(simulation.world(), (joint, axis)) };
            simulation.set_drive(joint, axis, set)?;
        }
        let targets = now(batch.motors, self.motors.len() + self.gears.len());
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

/// The `width` numbers of `rollout`, or those of all; none of an empty array.
pub(super) fn of(numbers: &[f64], width: usize, rollout: usize) -> &[f64] {
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
    /// The parts that belong to one rollout each, one after the other.
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

/// `count` equal parts; none of an empty slice.
fn parts<T>(slice: &mut [T], count: usize) -> std::slice::ChunksExactMut<'_, T> {
    let part = (slice.len() / count).max(1);
    slice.chunks_exact_mut(part)
}
