//! The units in which the program is posed.
//!
//! Ipopt's tolerances, its pushes from the bounds and the smoothing ε are plain numbers: they
//! mean something else for a dice than for a container. So the program is posed in the scene's
//! own units of mass M, length L and time T, in which a body weighs 10, reaches as far as 1
//! and falls with 9.81, as the tutorial's cube does in kg, m and s:
//!
//! ```text
//! M = m/10,   L = ℓ,   T = √(ℓ · 9.81/|g|)
//! ```
//!
//! Of several bodies m is the geometric mean of their masses and ℓ their largest reach. T is L over the world's [speed scale](World::speed_scale). Under a load that is stronger than
//! gravity, T is halved until an acceleration of 9.81 is about the load's. Scaled copies of a scene
//! (masses times a, lengths times b, gravity times c, times times √(b/c), loads accordingly) are then one program, to
//! rounding.

use tumble_core::contact::{Contact, Features};
use tumble_core::mechanics::{State, Wrench};
use tumble_core::world::World;

/// The mass of the tutorial's cube, kg.
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

    /// Those of `world` under the loads `wrenches` (none, or one a body), of which the strongest
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
        // 9.81 in these units, whatever stands in for gravity where there is none.
        let gravity = 9.81 * length / (time * time);
        let mut shorter = 1.0;
        while 2.0 * shorter * shorter * gravity < pull {
            shorter *= 2.0;
        }
        Self { mass, length, time: time / shorter }
    }

    /// Whether there is something to measure with them.
    #[cfg(feature = "save")]
    pub(crate) fn are_possible(&self) -> bool {
        [self.mass, self.length, self.time].into_iter().all(|unit| unit.is_normal() && unit > 0.0)
    }

    /// `world`, its constants in these units.
    pub(crate) fn world(&self, world: &World) -> World {
        world.in_units(self.mass, self.length, self.time)
    }

    /// m.
    pub(crate) fn length(&self) -> f64 {
        self.length
    }

    /// m/s.
    pub(crate) fn speed(&self) -> f64 {
        self.length / self.time
    }

    /// N.
    pub(crate) fn force(&self) -> f64 {
        self.mass * self.length / (self.time * self.time)
    }

    /// A state, in these units.
    pub(crate) fn state(&self, state: &State) -> State {
        State {
            position: state.position / self.length,
            attitude: state.attitude,
            velocity: state.velocity / self.speed(),
            spin: state.spin * self.time,
        }
    }

    /// A state in these units, in SI units.
    pub(crate) fn si_state(&self, state: &State) -> State {
        State {
            position: state.position * self.length,
            attitude: state.attitude,
            velocity: state.velocity * self.speed(),
            spin: state.spin / self.time,
        }
    }

    /// A wrench, in these units.
    pub(crate) fn wrench(&self, wrench: &Wrench) -> Wrench {
        Wrench {
            force: wrench.force / self.force(),
            torque: wrench.torque / (self.force() * self.length),
        }
    }

    /// A contact, in these units.
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
