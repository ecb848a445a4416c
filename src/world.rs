//! The world of a run: the bodies, what they can touch, and the constants that every step
//! shares.
//!
//! A second body goes into [`Parameters::bodies`]. States, forces and certificates are lists
//! over the bodies throughout, and contacts name both bodies; what today's
//! [detection](crate::contact::detection) does not find are contacts between two bodies, so
//! that a [`Simulation`](crate::simulation::Simulation) takes worlds of one body.

use crate::contact::Partner;
use crate::contact::plane::Plane;
use crate::error::{Error, in_range};
use crate::geometry::Piece;
use crate::mechanics::dynamics;
use crate::mechanics::{Pose, RigidBody, State, Wrench};
use nalgebra::Vector3;

/// The constants of a [`World`], before they are checked.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameters {
    /// The bodies; states and wrenches come in this order.
    pub bodies: Vec<RigidBody>,
    /// The ground.
    pub ground: Plane,
    /// g, m/s², world.
    pub gravity: Vector3<f64>,
    /// μ, coefficient of friction.
    pub friction: f64,
    /// h, s.
    pub time_step: f64,
}

/// A piece that never moves: a step, a ramp, a wall, a part of a bowl.
#[derive(Debug, Clone, PartialEq)]
pub struct Fixed {
    /// The piece, in the world's frame.
    pub piece: Piece,
    /// A coefficient of friction of its own, in place of the world's.
    pub friction: Option<f64>,
}

/// Rigid bodies above a ground, with friction: the constants of every step.
#[derive(Debug, Clone, PartialEq)]
pub struct World {
    parameters: Parameters,
    fixed: Vec<Fixed>,
    /// In ascending order.
    pair_frictions: Vec<((usize, Partner), f64)>,
    reach: f64,
    speed_scale: f64,
}

impl World {
    /// Checks the constants.
    ///
    /// # Errors
    /// No body; a time step outside 1e-6…0.1 s, a coefficient of friction outside 0…10, a
    /// component of gravity beyond ±1000 m/s².
    pub fn new(parameters: Parameters) -> Result<Self, Error> {
        if parameters.bodies.is_empty() {
            return Err(Error::Count { field: "bodies", count: 0, allowed: "1 or more" });
        }
        in_range("time step (s)", parameters.time_step, 1e-6, 0.1, "1e-6 to 0.1")?;
        in_range("coefficient of friction", parameters.friction, 0.0, 10.0, "0 to 10")?;
        for &component in &parameters.gravity {
            in_range("gravity (m/s²)", component, -1000.0, 1000.0, "-1000 to 1000")?;
        }
        let reach = parameters.bodies.iter().map(RigidBody::reach).fold(0.0, f64::max);
        let speed_scale = speed_scale(&parameters.gravity, reach);
        let (fixed, pair_frictions) = (Vec::new(), Vec::new());
        Ok(Self { parameters, fixed, pair_frictions, reach, speed_scale })
    }

    /// This world with pieces that never move.
    ///
    /// # Errors
    /// A coefficient of friction outside 0…10.
    pub fn with_fixed(self, fixed: Vec<Fixed>) -> Result<Self, Error> {
        for friction in fixed.iter().filter_map(|fixed| fixed.friction) {
            in_range("coefficient of friction", friction, 0.0, 10.0, "0 to 10")?;
        }
        Ok(Self { fixed, ..self })
    }

    /// This world with a coefficient of `friction` between body `body` and `partner`, whatever
    /// their own are. The last word on a pair counts.
    ///
    /// # Errors
    /// A body or fixed piece that is not there, a body with itself, a coefficient outside 0…10.
    pub fn with_friction_between(
        mut self,
        body: usize,
        partner: Partner,
        friction: f64,
    ) -> Result<Self, Error> {
        in_range("coefficient of friction", friction, 0.0, 10.0, "0 to 10")?;
        let bodies = self.bodies().len();
        let known = match partner {
            Partner::Ground => true,
            Partner::Fixed(index) => index < self.fixed.len(),
            Partner::Body(other) => other < bodies && other != body,
        };
        if body >= bodies || !known {
            let allowed = "a pair of a body and another body or a fixed thing of the world";
            return Err(Error::Count { field: "pair with friction", count: body, allowed });
        }
        let pair = ordered(body, partner);
        match self.pair_frictions.binary_search_by(|(known, _)| known.cmp(&pair)) {
            Ok(place) => self.pair_frictions[place].1 = friction,
            Err(place) => self.pair_frictions.insert(place, (pair, friction)),
        }
        Ok(self)
    }

    /// The pieces that never move.
    #[must_use]
    pub fn fixed(&self) -> &[Fixed] {
        &self.fixed
    }

    /// The coefficients of friction that were given for pairs.
    #[must_use]
    pub fn pair_frictions(&self) -> &[((usize, Partner), f64)] {
        &self.pair_frictions
    }

    /// μ between body `body` and `partner`: what was given for the pair, or the geometric mean
    ///
    /// ```text
    /// μ = √(μ_a μ_b)
    /// ```
    ///
    /// of the coefficients of both, the world's where a body or piece has none of its own. The
    /// ground has the world's.
    ///
    /// # Panics
    /// If there is no such body or partner.
    #[must_use]
    pub fn friction_between(&self, body: usize, partner: Partner) -> f64 {
        if !self.pair_frictions.is_empty() {
            let pair = ordered(body, partner);
            let place = self.pair_frictions.binary_search_by(|(known, _)| known.cmp(&pair));
            if let Ok(place) = place {
                return self.pair_frictions[place].1;
            }
        }
        let own = |friction: Option<f64>| friction.unwrap_or(self.friction());
        let a = own(self.bodies()[body].friction());
        let b = match partner {
            Partner::Ground => self.friction(),
            Partner::Fixed(index) => own(self.fixed[index].friction),
            Partner::Body(other) => own(self.bodies()[other].friction()),
        };
        if a == b { a } else { (a * b).sqrt() }
    }

    /// The constants.
    #[must_use]
    pub fn parameters(&self) -> &Parameters {
        &self.parameters
    }

    /// The bodies.
    #[must_use]
    pub fn bodies(&self) -> &[RigidBody] {
        &self.parameters.bodies
    }

    /// The ground.
    #[must_use]
    pub fn ground(&self) -> &Plane {
        &self.parameters.ground
    }

    /// g, m/s², world.
    #[must_use]
    pub fn gravity(&self) -> &Vector3<f64> {
        &self.parameters.gravity
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

    /// ℓ, m: the largest [reach](RigidBody::reach) of a body, the world's scale of lengths.
    #[must_use]
    pub fn reach(&self) -> f64 {
        self.reach
    }

    /// The world's scale of speeds, as a multiple of that of the tutorial's cube (1 m, 9.81
    /// m/s²): tolerances in m/s are multiplied with it. Speeds of motions under gravity go
    /// like √(g ℓ); without gravity there is no such speed, and 9.81 m/s² stands in.
    ///
    /// ```text
    /// √(|g| ℓ / (9.81 m/s² · 1 m))
    /// ```
    #[must_use]
    pub fn speed_scale(&self) -> f64 {
        self.speed_scale
    }

    /// The next state of body `index` if nothing touched it (eq. 8 with F = 0).
    ///
    /// # Panics
    /// If there is no such body.
    #[must_use]
    pub fn free_flight(&self, index: usize, state: &State, wrench: &Wrench) -> State {
        let body = &self.bodies()[index];
        dynamics::free_flight(body, state, wrench, self.gravity(), self.time_step())
    }

    /// The heights above the ground of body `index`'s contact points, m, where it is at `pose`:
    ///
    /// ```text
    /// φ_i = n·r − d + (Aᵀ n)·c_i − ρ_i
    /// ```
    ///
    /// # Panics
    /// If there is no such body.
    pub fn heights<'a>(
        &'a self,
        index: usize,
        pose: &Pose,
    ) -> impl ExactSizeIterator<Item = f64> + use<'a> {
        let ground = self.ground();
        let centre = ground.normal().dot(&pose.position) - ground.offset();
        let normal = pose.rotation.tr_mul(ground.normal());
        let points = self.bodies()[index].contact_points().iter();
        points.map(move |point| centre + normal.dot(&point.position) - point.radius)
    }

    /// The height of the lowest contact point of any body, m.
    #[must_use]
    pub fn lowest_height(&self, states: &[State]) -> f64 {
        let heights =
            states.iter().enumerate().flat_map(|(i, state)| self.heights(i, &state.pose()));
        heights.fold(f64::INFINITY, f64::min)
    }
}

/// The same for both orders of a pair.
fn ordered(body: usize, partner: Partner) -> (usize, Partner) {
    match partner {
        Partner::Body(other) if other < body => (other, Partner::Body(body)),
        _ => (body, partner),
    }
}

#[cfg(feature = "ipopt")]
impl World {
    /// The same world in other units of `mass` (kg), `length` (m) and `time` (s). Without
    /// pieces: bodies of points on a ground. The ranges of [`World::new`] are those of SI units and
    /// are not asked again.
    pub(crate) fn in_units(&self, mass: f64, length: f64, time: f64) -> Self {
        let Parameters { bodies, ground, gravity, friction, time_step } = &self.parameters;
        let parameters = Parameters {
            bodies: bodies.iter().map(|body| body.in_units(mass, length)).collect(),
            ground: ground.in_units(length),
            gravity: gravity * (time * time / length),
            friction: *friction,
            time_step: time_step / time,
        };
        let speed_scale = self.speed_scale * time / length;
        let (fixed, pair_frictions) = (Vec::new(), self.pair_frictions.clone());
        Self { parameters, fixed, pair_frictions, reach: self.reach / length, speed_scale }
    }
}

/// See [`World::speed_scale`].
fn speed_scale(gravity: &Vector3<f64>, reach: f64) -> f64 {
    const TUTORIAL_GRAVITY: f64 = 9.81;
    let gravity = gravity.norm();
    let gravity = if gravity > 0.0 { gravity } else { TUTORIAL_GRAVITY };
    (gravity / TUTORIAL_GRAVITY * reach).sqrt()
}
