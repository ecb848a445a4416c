//! The model of a contact step: everything that stays fixed during a run of a
//! [`Simulation`](crate::simulation::Simulation).

use crate::body::RigidBody;
use crate::dynamics;
use crate::error::{Error, in_range};
use crate::plane::Plane;
use crate::quaternion::rotation;
use crate::state::{State, Wrench};
use nalgebra::Vector3;

/// The constants of a [`ContactModel`], before they are checked.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameters {
    /// The body.
    pub body: RigidBody,
    /// The ground.
    pub plane: Plane,
    /// g, m/s², world.
    pub gravity: Vector3<f64>,
    /// μ, coefficient of friction.
    pub friction: f64,
    /// h, s.
    pub time_step: f64,
    /// ε, N: the smoothing of the friction force's norm in the nonlinear program
    /// (eq. 11), and the small force added in its denominator.
    pub smoothing: f64,
}

/// A rigid body above the ground, with friction: the constants of every step.
///
/// States, forces and gravity in these methods are in the **ground's frame**
/// ([`crate::plane`]), whose plane z = 0 is the ground: there an inclined plane is the same
/// problem with gravity tilted. On level ground it is the world's.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactModel {
    parameters: Parameters,
    /// In the ground's frame.
    gravity: Vector3<f64>,
}

impl ContactModel {
    /// Checks the constants.
    ///
    /// # Errors
    /// A time step outside 1e-6…0.1 s, a coefficient of friction outside 0…10, a
    /// component of gravity beyond ±1000 m/s², a smoothing outside 1e-12…1.
    pub fn new(parameters: Parameters) -> Result<Self, Error> {
        in_range("time step (s)", parameters.time_step, 1e-6, 0.1, "1e-6 to 0.1")?;
        in_range("coefficient of friction", parameters.friction, 0.0, 10.0, "0 to 10")?;
        for &component in &parameters.gravity {
            in_range("gravity (m/s²)", component, -1000.0, 1000.0, "-1000 to 1000")?;
        }
        in_range("smoothing epsilon (N)", parameters.smoothing, 1e-12, 1.0, "1e-12 to 1")?;
        let gravity = parameters.plane.vector_to_ground(&parameters.gravity);
        Ok(Self { parameters, gravity })
    }

    /// The constants.
    #[must_use]
    pub fn parameters(&self) -> &Parameters {
        &self.parameters
    }

    /// The body.
    #[must_use]
    pub fn body(&self) -> &RigidBody {
        &self.parameters.body
    }

    /// The ground.
    #[must_use]
    pub fn plane(&self) -> &Plane {
        &self.parameters.plane
    }

    /// The number of contact points, n.
    #[must_use]
    pub fn contact_count(&self) -> usize {
        self.parameters.body.contact_points().len()
    }

    /// g, m/s², ground's frame.
    #[must_use]
    pub fn gravity(&self) -> &Vector3<f64> {
        &self.gravity
    }

    /// μ.
    #[must_use]
    pub fn friction(&self) -> f64 {
        self.parameters.friction
    }

    /// h, s.
    #[must_use]
    pub fn time_step(&self) -> f64 {
        self.parameters.time_step
    }

    /// ε, N.
    #[must_use]
    pub fn smoothing(&self) -> f64 {
        self.parameters.smoothing
    }

    /// The next state if nothing touched the ground (eq. 8 with F = 0).
    #[must_use]
    pub fn free_flight(&self, state: &State, wrench: &Wrench) -> State {
        dynamics::free_flight(self.body(), state, wrench, self.gravity(), self.time_step())
    }

    /// Positions of the contact points, m: C_i = r + A(q) c_i (eq. 4).
    pub fn contact_positions<'a>(
        &'a self,
        state: &State,
    ) -> impl Iterator<Item = Vector3<f64>> + 'a {
        let (position, rotation) = (state.position, rotation(&state.attitude));
        self.body().contact_points().iter().map(move |c| position + rotation * c.position)
    }

    /// Heights of the contact points above the ground, m.
    pub fn contact_heights<'a>(&'a self, state: &State) -> impl Iterator<Item = f64> + 'a {
        self.contact_positions(state).map(|position| position[2])
    }

    /// Height of the lowest contact point, m.
    #[must_use]
    pub fn lowest_height(&self, state: &State) -> f64 {
        self.contact_heights(state).fold(f64::INFINITY, f64::min)
    }
}
