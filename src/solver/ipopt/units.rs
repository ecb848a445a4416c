//! Units of the program.
//!
//! Ipopt's tolerances, its bound pushes and the smoothing ε are plain numbers. Their effect depends
//! on the units. The program is therefore posed in the scene's own units of mass M, length L and
//! time T. In these units a body has mass 10, reach 1 and gravity 9.81, as the tutorial's cube has
//! in kg, m and s:
//!
//! ```text
//! M = m/10,   L = ℓ,   T = √(ℓ · 9.81/|g|)
//! ```
//!
//! For several bodies, m is the geometric mean of the masses and ℓ the largest reach. T is L over
//! the world's [speed scale](World::speed_scale). Under a load stronger than gravity, T is halved
//! until 9.81 is about the acceleration by the load. Scaled copies of a scene are then one program
//! up to rounding. Such copies have masses times a, lengths times b, gravity times c, times times
//! √(b/c), and loads accordingly.

use tumble_core::contact::{Contact, Features};
use tumble_core::mechanics::{State, Wrench};
use tumble_core::world::World;

/// Mass of the tutorial's cube, kg.
const USUAL_MASS: f64 = 10.0;

/// Units of mass (kg), length (m) and time (s).
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct ProgramUnits {
    mass: f64,
    length: f64,
    time: f64,
}

impl ProgramUnits {
    /// SI units.
    pub(crate) const SI: Self = Self { mass: 1.0, length: 1.0, time: 1.0 };

    /// Units of `world` under the loads `wrenches` (none, or one per body). The strongest load
    /// counts.
    pub(crate) fn of(world: &World, wrenches: &[Wrench]) -> Self {
        let bodies = world.bodies();
        let logarithms: f64 = bodies.iter().map(|body| libm::log(body.mass())).sum();
        let mean = libm::exp(logarithms / bodies.len() as f64);
        let (mass, length) = (mean / USUAL_MASS, world.reach());
        let pulls = bodies.iter().zip(wrenches).map(|(body, wrench)| {
            wrench.force.norm().max(wrench.torque.norm() / length) / body.mass()
        });
        let pull = pulls.fold(0.0, f64::max);
        let time = length / world.speed_scale();
        // Gravity in these units: 9.81, or a substitute in a world without gravity.
        let gravity = 9.81 * length / (time * time);
        let mut shorter = 1.0;
        while 2.0 * shorter * shorter * gravity < pull {
            shorter *= 2.0;
        }
        Self { mass, length, time: time / shorter }
    }

    /// True if all units are positive, normal numbers.
    #[cfg(feature = "save")]
    pub(crate) fn are_possible(&self) -> bool {
        [self.mass, self.length, self.time].into_iter().all(|unit| unit.is_normal() && unit > 0.0)
    }

    /// Converts the constants of `world` to these units.
    pub(crate) fn world(&self, world: &World) -> World {
        world.in_units(self.mass, self.length, self.time)
    }

    /// Unit of length, m.
    pub(crate) fn length(&self) -> f64 {
        self.length
    }

    /// Unit of speed, m/s.
    pub(crate) fn speed(&self) -> f64 {
        self.length / self.time
    }

    /// Unit of force, N.
    pub(crate) fn force(&self) -> f64 {
        self.mass * self.length / (self.time * self.time)
    }

    /// Converts a state to these units.
    pub(crate) fn state(&self, state: &State) -> State {
        State {
            position: state.position / self.length,
            attitude: state.attitude,
            velocity: state.velocity / self.speed(),
            spin: state.spin * self.time,
        }
    }

    /// Converts a state from these units to SI units.
    pub(crate) fn si_state(&self, state: &State) -> State {
        State {
            position: state.position * self.length,
            attitude: state.attitude,
            velocity: state.velocity * self.speed(),
            spin: state.spin / self.time,
        }
    }

    /// Converts a wrench to these units.
    pub(crate) fn wrench(&self, wrench: &Wrench) -> Wrench {
        Wrench {
            force: wrench.force / self.force(),
            torque: wrench.torque / (self.force() * self.length),
        }
    }

    /// Converts a contact to these units.
    pub(crate) fn contact(&self, contact: &Contact) -> Contact {
        let features = Features {
            point: contact.features.point / self.length,
            radius: contact.features.radius / self.length,
            offset: contact.features.offset / self.length,
            curved: contact.features.curved.map(|curved| curved.scaled(1.0 / self.length)),
            ..contact.features
        };
        Contact {
            features,
            gap: contact.gap / self.length,
            rebound: contact.rebound / self.speed(),
            lever: contact.lever / self.length,
            arm: contact.arm / self.length,
            torque_map: contact.torque_map / self.length,
            ..*contact
        }
    }
}
