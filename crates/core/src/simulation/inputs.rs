//! Inputs of a simulation that a program sets: wrenches, loads, motions of joints, and the flag that
//! interrupts it.

use super::driving::Driving;
use super::moment::{Arrival, Moment};
use crate::error::Error;
use crate::mechanics::{Load, Wrench};
use crate::world::World;
use nalgebra::Vector3;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Inputs of the next steps.
#[derive(Debug, Clone, Default)]
pub(super) struct Inputs {
    /// External wrench and load of each body.
    pub outside: Vec<ExternalLoads>,
    /// True if wrenches belong to the instant instead of being held over a step.
    pub at_instant: bool,
    /// Time-dependent inputs of the joints.
    pub driving: Driving,
    pub interrupt: Option<Arc<AtomicBool>>,
}

/// External wrench on a body, without gravity.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct ExternalLoads {
    pub wrench: Wrench,
    pub load: Load,
}

/// Time ½ h (1 − 1/(2κ)) of [`Inputs::late_kick`] (s).
pub(super) fn late_share(world: &World, body: usize) -> f64 {
    0.5 * world.time_step() * (1.0 - 0.5 / world.kick(body))
}

impl ExternalLoads {
    pub fn zero() -> Self {
        Self { wrench: Wrench::zero(), load: Load::none() }
    }
}

impl Inputs {
    /// Inputs of `bodies` bodies without any load.
    pub fn none(bodies: usize) -> Self {
        Self { outside: vec![ExternalLoads::zero(); bodies], ..Self::default() }
    }

    /// These inputs without the flag that interrupts.
    pub fn uninterrupted(&self) -> Self {
        Self { interrupt: None, ..self.clone() }
    }

    /// Loads and wrench of a body.
    ///
    /// # Errors
    /// [`Error::Count`] if the body does not exist.
    pub fn body_mut(&mut self, index: usize) -> Result<&mut ExternalLoads, Error> {
        let missing = Error::Count { field: "body", count: index, allowed: "an index of a body" };
        self.outside.get_mut(index).ok_or(missing)
    }

    /// Fails if the flag is raised.
    ///
    /// # Errors
    /// [`Error::Interrupted`].
    #[inline]
    pub fn check_interrupt(&self) -> Result<(), Error> {
        match &self.interrupt {
            Some(flag) if flag.load(Ordering::Relaxed) => Err(Error::Interrupted),
            _ => Ok(()),
        }
    }

    /// Computes the wrenches of the problem that is set in `world` and starts at `moment`: half of the
    /// input before, half of the present one, the load between both middles, and what gravity and the
    /// gyroscopic term lack (eq. 37).
    #[inline]
    pub fn set_wrenches(&self, world: &World, moment: &Moment, wrenches: &mut Vec<Wrench>) {
        let bodies = self.outside.iter().zip(&moment.now.states).zip(&moment.arrivals);
        wrenches.clear();
        wrenches.extend(bodies.enumerate().map(|(body, ((outside, state), arrival))| {
            let mut sum = self.held(world, body, &outside.wrench, arrival);
            if !outside.load.is_none() {
                let [from, to] = world.load_interval(moment.index, body);
                let share = if world.has_half_kicks() { world.kick(body) } else { 1.0 };
                sum = sum.plus(&outside.load.mean(from, to, &state.attitude).scaled(share));
            }
            if world.before().is_empty() { sum } else { sum.plus(&world.missing_kick(body, state)) }
        }));
    }

    /// Wrench of the inputs on a body: (½ h₁ F⁻ + ½ h F)/h, or F as it is with implicit Euler steps.
    fn held(&self, world: &World, body: usize, now: &Wrench, arrival: &Arrival) -> Wrench {
        let before = if self.at_instant { now } else { &arrival.wrench };
        let kick = world.kick(body);
        if !world.has_half_kicks() || kick == 1.0 && before == now {
            return *now;
        }
        now.scaled(0.5).plus(&before.scaled(kick - 0.5))
    }

    /// Change of velocity (m/s) and spin (rad/s) by which the present input of a body acts more strongly in
    /// the second half of the interval than over its kick:
    ///
    /// ```text
    /// ½ h M⁻¹ (F − (½ h₁ F⁻ + ½ h F)/(κ h)) = ½ h (1 − 1/(2κ)) M⁻¹ (F − F⁻)
    /// ```
    pub fn late_kick(&self, world: &World, body: usize, arrival: &Arrival) -> [Vector3<f64>; 2] {
        let now = &self.outside[body].wrench;
        let before = &arrival.wrench;
        if self.at_instant || now == before || world.is_held(body) {
            return [Vector3::zeros(); 2];
        }
        let of = &world.bodies()[body];
        let share = late_share(world, body);
        let torque = of.inertia_inverse() * (now.torque - before.torque);
        [(now.force - before.force) * (share / of.mass()), torque * share]
    }

    /// Bodies with an isolated jump of a load, or of the velocity of a motion, and the first one within the times
    /// `within` (s).
    pub fn jumps(&self, world: &World, within: [f64; 2]) -> impl Iterator<Item = (usize, f64)> {
        let apart = world.whole_step();
        let loads = self.outside.iter().enumerate();
        let loads = loads
            .filter_map(move |(body, outside)| Some((body, outside.load.jump_in(within, apart)?)));
        let driven = self.driving.jumps(within, apart);
        loads.chain(driven.map(|(joint, time)| (world.joints()[joint].body(), time)))
    }

    /// Sets the inputs of the joints of `world` for its interval, which starts at `moment`.
    #[inline]
    pub fn drive_joints(&self, world: &mut World, moment: &Moment) {
        if self.driving.is_idle() {
            return;
        }
        let end = world.time_after(moment.index);
        self.driving.set(world, &moment.now.states, moment.index, end);
    }
}
