//! The world of a run: the bodies, what they can touch, and the constants that every step
//! shares. States, forces and certificates are lists over its bodies throughout.

mod apart;
mod changes;
pub mod constants;
mod joint_constants;
mod law_constants;
mod laws;
pub(crate) mod partner;
pub mod plane;

pub(crate) use changes::without;
pub use constants::Constant;
pub(crate) use law_constants::LawSlopes;
use laws::{PairLaws, ordered};
pub use partner::{ContactLaw, Partner};
pub use plane::Plane;

use crate::error::{Error, all_in_range, in_range};
use crate::geometry::Piece;
use crate::joint::{Gear, Joint, angles_near};
use crate::mechanics::dynamics;
use crate::mechanics::{Pose, RigidBody, Rotation, State, Wrench};
use nalgebra::Vector3;

/// The constants of a [`World`], before they are checked.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameters {
    /// The bodies; states and wrenches come in this order.
    pub bodies: Vec<RigidBody>,
    /// The ground, if there is one. Without it no point has a height, it has no part in any certificate, and
    /// coefficients for pairs with it are refused.
    pub ground: Option<Plane>,
    /// g, m/s², world.
    pub gravity: Vector3<f64>,
    /// μ, coefficient of friction.
    pub friction: f64,
    /// h, s.
    pub time_step: f64,
    /// By which equation bodies turn.
    pub rotation: Rotation,
}

/// A piece that never moves: a step, a ramp, a wall, a part of a bowl.
#[derive(Debug, Clone, PartialEq)]
pub struct Fixed {
    /// The piece, in the world's frame.
    pub piece: Piece,
    /// A coefficient of friction of its own, in place of the world's.
    pub friction: Option<f64>,
}

/// Rigid bodies and what they can touch, with friction: the constants of every step.
#[derive(Debug, Clone, PartialEq)]
pub struct World {
    parameters: Parameters,
    fixed: Vec<Fixed>,
    joints: Vec<Joint>,
    gears: Vec<Gear>,
    /// Pairs that do not touch because a joint ties them or it was said, in ascending order.
    apart: Vec<(usize, Partner)>,
    /// Those of which it was said.
    kept_apart: Vec<(usize, Partner)>,
    /// Bodies that touch nothing, in ascending order.
    untouched: Vec<usize>,
    /// Whether each body is held; empty where none is.
    held: Vec<bool>,
    /// Velocities of surfaces, each of an owner.
    surfaces: Vec<(Partner, Vector3<f64>)>,
    pair_frictions: PairLaws,
    restitution: f64,
    pair_restitutions: PairLaws,
    /// What was given for it.
    rebound_speed: Option<f64>,
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
        all_in_range("gravity (m/s²)", &parameters.gravity, -1000.0, 1000.0, "-1000 to 1000")?;
        let reach = parameters.bodies.iter().map(RigidBody::reach).fold(0.0, f64::max);
        let speed_scale = speed_scale(&parameters.gravity, reach);
        Ok(Self {
            parameters,
            fixed: Vec::new(),
            joints: Vec::new(),
            gears: Vec::new(),
            apart: Vec::new(),
            kept_apart: Vec::new(),
            untouched: Vec::new(),
            held: Vec::new(),
            surfaces: Vec::new(),
            pair_frictions: PairLaws::new(),
            restitution: 0.0,
            pair_restitutions: PairLaws::new(),
            rebound_speed: None,
            reach,
            speed_scale,
        })
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

    /// This world with `joints`, and without gears. Bodies that a joint ties do not touch each other, unless it
    /// [collides](Joint::colliding).
    ///
    /// # Errors
    /// A joint of a body that is not there, or of a body with itself; frames, lengths and drives out of
    /// range; a turn that is neither locked, about z alone, nor free without a drive.
    pub fn with_joints(self, joints: Vec<Joint>) -> Result<Self, Error> {
        let bodies = self.bodies().len();
        let checked = joints.into_iter().map(|joint| joint.checked(bodies));
        let joints = checked.collect::<Result<Vec<_>, _>>()?;
        Ok(Self { gears: Vec::new(), ..self }.tied_by(joints))
    }

    /// This world, whose joints follow each other by these `gears`.
    ///
    /// # Errors
    /// A joint that is not there; an axis that is locked, or whose turns are not counted; numbers out of range.
    pub fn with_gears(self, gears: Vec<Gear>) -> Result<Self, Error> {
        let checked = gears.into_iter().map(|gear| gear.checked(&self.joints));
        let gears = checked.collect::<Result<Vec<_>, _>>()?;
        Ok(Self { gears, ..self })
    }

    /// This world with `joints` that were checked.
    fn tied_by(mut self, joints: Vec<Joint>) -> Self {
        let tied = joints.iter().filter(|joint| !joint.collides());
        let tied = tied.filter_map(|joint| Some((joint.body(), joint.other()?)));
        let tied = tied.map(|(a, b)| ordered(a, Partner::Body(b)));
        self.kept_apart.sort_unstable();
        self.kept_apart.dedup();
        self.apart = tied.chain(self.kept_apart.iter().copied()).collect();
        self.apart.sort_unstable();
        self.apart.dedup();
        Self { joints, ..self }
    }

    /// The joints.
    #[must_use]
    pub fn joints(&self) -> &[Joint] {
        &self.joints
    }

    /// The gears between joints.
    #[must_use]
    pub fn gears(&self) -> &[Gear] {
        &self.gears
    }

    /// The angles of the joints where the bodies are put to `states`, from which turns are counted: those that are
    /// nearest to `near`, or to zero, but where a gear says how often one has turned, as often as that.
    #[must_use]
    pub fn angles_near(&self, states: &[State], near: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
        angles_near(&self.joints, &self.gears, states, near)
    }

    /// This world, its fixed pieces, its restitution and what was said of pairs, with other
    /// constants and as many bodies.
    ///
    /// # Errors
    /// As [`World::new`]; another number of bodies.
    pub fn with_parameters(&self, parameters: Parameters) -> Result<Self, Error> {
        let count = parameters.bodies.len();
        if count != self.bodies().len() {
            return Err(Error::Count { field: "bodies", count, allowed: "as many as before" });
        }
        let Self { parameters, reach, speed_scale, .. } = Self::new(parameters)?;
        Ok(Self { parameters, reach, speed_scale, ..self.clone() })
    }

    /// The pieces that never move.
    #[must_use]
    pub fn fixed(&self) -> &[Fixed] {
        &self.fixed
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

    /// The ground, if there is one.
    #[must_use]
    pub fn ground(&self) -> Option<&Plane> {
        self.parameters.ground.as_ref()
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

    /// By which equation bodies turn.
    #[must_use]
    pub fn rotation(&self) -> Rotation {
        self.parameters.rotation
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

    /// The next state of body `index` if nothing touched it (eq. 8 with F = 0); the same one of a body that
    /// is held.
    ///
    /// # Panics
    /// If there is no such body.
    #[must_use]
    pub fn free_flight(&self, index: usize, state: &State, wrench: &Wrench) -> State {
        if self.is_held(index) {
            return *state;
        }
        let body = &self.bodies()[index];
        let (h, rotation) = (self.time_step(), self.rotation());
        dynamics::free_flight(body, state, wrench, self.gravity(), h, rotation)
    }

    /// The heights above the ground of body `index`'s contact points, m, where it is at `pose`:
    ///
    /// ```text
    /// φ_i = n·r − d + (Aᵀ n)·c_i − ρ_i
    /// ```
    ///
    /// Without a ground there are none, nor of a body that does not touch it.
    ///
    /// # Panics
    /// If there is no such body.
    #[inline]
    pub fn heights<'a>(
        &'a self,
        index: usize,
        pose: &Pose,
    ) -> impl ExactSizeIterator<Item = f64> + use<'a> {
        let points = self.bodies()[index].contact_points();
        let (centre, normal, points) = match self.ground() {
            Some(ground) if self.may_touch(index, Partner::Ground) => {
                let centre = ground.normal().dot(&pose.position) - ground.offset();
                (centre, pose.rotation.tr_mul(ground.normal()), points)
            }
            _ => (0.0, Vector3::zeros(), &points[..0]),
        };
        points.iter().map(move |point| centre + normal.dot(&point.position) - point.radius)
    }

    /// The height of the lowest contact point of any body that has a state, m; infinite without a
    /// ground.
    #[must_use]
    pub fn lowest_height(&self, states: &[State]) -> f64 {
        let states = states.iter().take(self.bodies().len()).enumerate();
        let heights = states.flat_map(|(i, state)| self.heights(i, &state.pose()));
        heights.fold(f64::INFINITY, f64::min)
    }
}

impl World {
    /// The same world in other units of `mass` (kg), `length` (m) and `time` (s). Without
    /// pieces: bodies of points on a ground, with joints and gears. The ranges of [`World::new`] are those of SI units and
    /// are not asked again.
    #[must_use]
    pub fn in_units(&self, mass: f64, length: f64, time: f64) -> Self {
        let Parameters { bodies, ground, gravity, friction, time_step, rotation } =
            &self.parameters;
        let parameters = Parameters {
            bodies: bodies.iter().map(|body| body.in_units(mass, length)).collect(),
            ground: ground.as_ref().map(|ground| ground.in_units(length)),
            gravity: gravity * (time * time / length),
            friction: *friction,
            time_step: time_step / time,
            rotation: *rotation,
        };
        let speed_scale = self.speed_scale * time / length;
        Self {
            parameters,
            fixed: Vec::new(),
            joints: self.joints.iter().map(|joint| joint.in_units(mass, length, time)).collect(),
            gears: self.gears.iter().map(|gear| gear.in_units(mass, length, time)).collect(),
            apart: Vec::new(),
            kept_apart: Vec::new(),
            untouched: Vec::new(),
            held: self.held.clone(),
            surfaces: Vec::new(),
            pair_frictions: self.pair_frictions.clone(),
            restitution: self.restitution,
            pair_restitutions: self.pair_restitutions.clone(),
            rebound_speed: self.rebound_speed.map(|speed| speed * time / length),
            reach: self.reach / length,
            speed_scale,
        }
    }
}

/// See [`World::speed_scale`].
fn speed_scale(gravity: &Vector3<f64>, reach: f64) -> f64 {
    const TUTORIAL_GRAVITY: f64 = 9.81;
    let gravity = gravity.norm();
    let gravity = if gravity > 0.0 { gravity } else { TUTORIAL_GRAVITY };
    (gravity / TUTORIAL_GRAVITY * reach).sqrt()
}
