//! Inputs of a simulation that a program sets: wrenches, loads, motions of joints, and the flag that
//! interrupts it.

use super::driving::Driving;
use super::moment::Moment;
use crate::error::Error;
use crate::mechanics::{Load, Wrench};
use crate::world::World;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Inputs of the next steps.
#[derive(Debug, Clone, Default)]
pub(super) struct Inputs {
    /// External wrench and load of each body.
    pub outside: Vec<ExternalLoads>,
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

    /// Computes the external wrenches of the interval that is set in `world` and starts at `moment`.
    #[inline]
    pub fn set_wrenches(&self, world: &World, moment: &Moment, wrenches: &mut Vec<Wrench>) {
        let each = self.outside.iter().zip(&moment.now.states).map(|(outside, state)| {
            if outside.load.is_none() {
                return outside.wrench;
            }
            let [from, to] = world.load_interval(moment.index);
            outside.wrench.plus(&outside.load.mean(from, to, &state.attitude))
        });
        wrenches.clear();
        wrenches.extend(each);
    }

    /// Sets the inputs of the joints of `world` for its interval, which starts at `moment`.
    #[inline]
    pub fn drive_joints(&self, world: &mut World, moment: &Moment) {
        if self.driving.is_idle() {
            return;
        }
        let interval = world.load_interval(moment.index);
        let end = world.time_after(moment.index);
        self.driving.set(world, &moment.now.states, interval, end);
    }
}
