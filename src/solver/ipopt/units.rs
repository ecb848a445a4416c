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
//! Under a load stronger than gravity, T is halved until 9.81 is about the acceleration by the load.
//! Scaled copies of a scene are then one program up to rounding. Such copies have masses times a,
//! lengths times b, gravity times c, times times √(b/c), and loads accordingly. In a world without
//! gravity the [speed scale](World::speed_scale) replaces it.

use super::BODY;
use crate::step_nlp::ProgramPoint;
use tumble_core::mechanics::{State, Wrench};
use tumble_core::world::World;

/// Mass of the tutorial's cube, kg.
const USUAL_MASS: f64 = 10.0;

/// Units of mass (kg), length (m) and time (s).
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct ProgramUnits {
    mass: f64,
    length: f64,
    time: f64,
}

impl ProgramUnits {
    /// SI units.
    pub(super) const SI: Self = Self { mass: 1.0, length: 1.0, time: 1.0 };

    /// Units of `world` under the load `wrench`, if there is one.
    pub(super) fn new(world: &World, wrench: Option<&Wrench>) -> Self {
        let (body, length) = (&world.bodies()[BODY], world.reach());
        let pull = wrench.map_or(0.0, |wrench| {
            wrench.force.norm().max(wrench.torque.norm() / length) / body.mass()
        });
        let time = length / world.speed_scale();
        // Gravity in these units: 9.81, or a substitute in a world without gravity.
        let gravity = 9.81 * length / (time * time);
        let mut shorter = 1.0;
        while 2.0 * shorter * shorter * gravity < pull {
            shorter *= 2.0;
        }
        Self { mass: body.mass() / USUAL_MASS, length, time: time / shorter }
    }

    /// True if all units are positive, normal numbers.
    #[cfg(feature = "save")]
    pub(super) fn are_possible(&self) -> bool {
        [self.mass, self.length, self.time].into_iter().all(|unit| unit.is_normal() && unit > 0.0)
    }

    /// Converts the constants of `world` to these units.
    pub(super) fn world(&self, world: &World) -> World {
        world.in_units(self.mass, self.length, self.time)
    }

    /// Converts a point of the program from SI units to these units.
    pub(super) fn point(&self, point: &ProgramPoint) -> ProgramPoint {
        let (mut converted, layout) = (point.clone(), point.layout());
        converted.set_state(&self.state(&point.state()));
        let x = converted.as_mut_slice();
        for i in 0..layout.contacts() {
            let [fx, fy, fz, s1, s2, slip] = layout.contact_variables(i);
            for force in [fx, fy, fz] {
                x[force] /= self.force();
            }
            x[s1] /= self.force() * self.length();
            x[s2] /= self.force() * self.speed();
            x[slip] /= self.speed();
        }
        converted
    }

    /// Unit of length, m.
    pub(super) fn length(&self) -> f64 {
        self.length
    }

    /// Unit of speed, m/s.
    pub(super) fn speed(&self) -> f64 {
        self.length / self.time
    }

    /// Unit of force, N.
    pub(super) fn force(&self) -> f64 {
        self.mass * self.length / (self.time * self.time)
    }

    /// Converts a state to these units.
    pub(super) fn state(&self, state: &State) -> State {
        State {
            position: state.position / self.length,
            attitude: state.attitude,
            velocity: state.velocity / self.speed(),
            spin: state.spin * self.time,
        }
    }

    /// Converts a state from these units to SI units.
    pub(super) fn si_state(&self, state: &State) -> State {
        State {
            position: state.position * self.length,
            attitude: state.attitude,
            velocity: state.velocity * self.speed(),
            spin: state.spin / self.time,
        }
    }

    /// Converts a wrench to these units.
    pub(super) fn wrench(&self, wrench: &Wrench) -> Wrench {
        Wrench {
            force: wrench.force / self.force(),
            torque: wrench.torque / (self.force() * self.length),
        }
    }
}
