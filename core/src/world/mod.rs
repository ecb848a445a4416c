//! The world of a run: the bodies, what they can touch, and the constants that every step
//! shares. States, forces and certificates are lists over its bodies throughout.

mod changes;
pub mod constants;
mod joint_constants;
mod partner;
pub mod plane;

pub(crate) use changes::without;
pub use constants::Constant;
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
    pair_frictions: Pairs,
    restitution: f64,
    pair_restitutions: Pairs,
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
            pair_frictions: Pairs::new(),
            restitution: 0.0,
            pair_restitutions: Pairs::new(),
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

    /// This world, in which the body `body` and `partner` do not touch each other. What was said of pairs stays.
    ///
    /// # Errors
    /// A body or fixed piece that is not there, a ground where there is none, a body with itself.
    pub fn with_apart(mut self, body: usize, partner: Partner) -> Result<Self, Error> {
        self.check_pair("pair that does not touch", body, partner)?;
        self.kept_apart.push(ordered(body, partner));
        let joints = std::mem::take(&mut self.joints);
        Ok(self.tied_by(joints))
    }

    /// This world, in which the body `body` touches nothing.
    ///
    /// # Errors
    /// A body that is not there.
    pub fn with_untouched(mut self, body: usize) -> Result<Self, Error> {
        if body >= self.bodies().len() {
            let allowed = "an index of a body";
            return Err(Error::Count { field: "body", count: body, allowed });
        }
        self.untouched.push(body);
        self.untouched.sort_unstable();
        self.untouched.dedup();
        Ok(self)
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

    /// The pairs of which [`World::with_apart`] says that they do not touch.
    #[must_use]
    pub fn kept_apart(&self) -> &[(usize, Partner)] {
        &self.kept_apart
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
        angles_near((&self.joints, &self.gears), states, near)
    }

    /// Whether the body `body` and `partner` may touch each other: whether both touch anything, no body of them is
    /// held, and neither a joint nor [`World::with_apart`] keeps them from it.
    #[must_use]
    #[inline]
    pub fn may_touch(&self, body: usize, partner: Partner) -> bool {
        let all_do = self.apart.is_empty() && self.untouched.is_empty() && self.held.is_empty();
        all_do || self.is_open(body, partner)
    }

    /// The same where some do not touch.
    #[inline(never)]
    fn is_open(&self, body: usize, partner: Partner) -> bool {
        let is_apart = || self.apart.binary_search(&ordered(body, partner)).is_ok();
        let is_open = |body: usize| !self.is_held(body) && !self.untouched.contains(&body);
        is_open(body) && partner.body().is_none_or(is_open) && !is_apart()
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
        self.check_pair("pair with friction", body, partner)?;
        set_pair(&mut self.pair_frictions, body, partner, friction);
        Ok(self)
    }

    /// This world with a coefficient of `restitution`, of everything that has none of its own.
    ///
    /// # Errors
    /// A coefficient outside 0…1.
    pub fn with_restitution(self, restitution: f64) -> Result<Self, Error> {
        in_range("coefficient of restitution", restitution, 0.0, 1.0, "0 to 1")?;
        Ok(Self { restitution, ..self })
    }

    /// This world with a coefficient of `restitution` between body `body` and `partner`, as
    /// [`World::with_friction_between`].
    ///
    /// # Errors
    /// A body or fixed piece that is not there, a body with itself, a coefficient outside 0…1.
    pub fn with_restitution_between(
        mut self,
        body: usize,
        partner: Partner,
        restitution: f64,
    ) -> Result<Self, Error> {
        in_range("coefficient of restitution", restitution, 0.0, 1.0, "0 to 1")?;
        self.check_pair("pair with restitution", body, partner)?;
        set_pair(&mut self.pair_restitutions, body, partner, restitution);
        Ok(self)
    }

    /// This world with `speed` (m/s) in place of the usual [rebound speed](World::rebound_speed).
    ///
    /// # Errors
    /// A speed outside 0…1000 m/s.
    pub fn with_rebound_speed(self, speed: f64) -> Result<Self, Error> {
        in_range("rebound speed (m/s)", speed, 0.0, 1000.0, "0 to 1000")?;
        Ok(Self { rebound_speed: Some(speed), ..self })
    }

    fn check_pair(&self, field: &'static str, body: usize, partner: Partner) -> Result<(), Error> {
        let bodies = self.bodies().len();
        let known = match partner {
            Partner::Ground => self.ground().is_some(),
            Partner::Fixed(index) => index < self.fixed.len(),
            Partner::Body(other) => other < bodies && other != body,
        };
        if body < bodies && known {
            return Ok(());
        }
        let allowed = "a pair of a body and another body or a fixed thing of the world";
        Err(Error::Count { field, count: body, allowed })
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
        if let Some(friction) = find_pair(&self.pair_frictions, body, partner) {
            return friction;
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

    /// e between body `body` and `partner`: what was given for the pair, or the geometric mean of
    /// the coefficients of both, as [`World::friction_between`]. Ground and fixed pieces have the
    /// world's.
    ///
    /// # Panics
    /// If there is no such body or partner.
    #[must_use]
    pub fn restitution_between(&self, body: usize, partner: Partner) -> f64 {
        if let Some(restitution) = find_pair(&self.pair_restitutions, body, partner) {
            return restitution;
        }
        let own = |body: usize| self.bodies()[body].restitution().unwrap_or(self.restitution);
        let a = own(body);
        let b = partner.body().map_or(self.restitution, own);
        if a == b { a } else { (a * b).sqrt() }
    }

    /// The law of contact between body `body` and `partner`.
    ///
    /// # Panics
    /// If there is no such body or partner.
    #[must_use]
    pub fn law_between(&self, body: usize, partner: Partner) -> ContactLaw {
        ContactLaw {
            friction: self.friction_between(body, partner),
            restitution: self.restitution_between(body, partner),
        }
    }

    /// ∂μ/∂μ of the world and ∂e/∂e of the world, of the contacts between body `body` and `partner`: 1 where both have the
    /// world's coefficient, half of √(own/world's) where one has, 0 elsewhere.
    pub(crate) fn law_by_world(&self, body: usize, partner: Partner) -> (f64, f64) {
        let by = |own: [Option<f64>; 2], is_pair: bool, of_world: f64| match own {
            _ if is_pair => 0.0,
            [None, None] => 1.0,
            [Some(own), None] | [None, Some(own)] if of_world > 0.0 => {
                0.5 * (own / of_world).sqrt()
            }
            _ => 0.0,
        };
        let of_body = |index: usize| &self.bodies()[index];
        let frictions = [
            of_body(body).friction(),
            match partner {
                Partner::Ground => None,
                Partner::Fixed(index) => self.fixed[index].friction,
                Partner::Body(other) => of_body(other).friction(),
            },
        ];
        let other = partner.body().and_then(|other| of_body(other).restitution());
        let restitutions = [of_body(body).restitution(), other];
        (
            by(
                frictions,
                find_pair(&self.pair_frictions, body, partner).is_some(),
                self.friction(),
            ),
            by(
                restitutions,
                find_pair(&self.pair_restitutions, body, partner).is_some(),
                self.restitution,
            ),
        )
    }

    /// e of everything that has none of its own; 0 unless it was given.
    #[must_use]
    pub fn restitution(&self) -> f64 {
        self.restitution
    }

    /// The coefficients of restitution that were given for pairs.
    #[must_use]
    pub fn pair_restitutions(&self) -> &[((usize, Partner), f64)] {
        &self.pair_restitutions
    }

    /// Whether anything bounces.
    #[must_use]
    pub fn has_restitution(&self) -> bool {
        let pairs = self.pair_restitutions.iter().map(|(_, restitution)| *restitution);
        let bodies = self.bodies().iter().filter_map(RigidBody::restitution);
        self.restitution > 0.0 || pairs.chain(bodies).any(|restitution| restitution > 0.0)
    }

    /// The speed, m/s, below which a contact that arrives does not bounce: what was given, or
    ///
    /// ```text
    /// 2 |g| h,
    /// ```
    ///
    /// below which a bounce would be over within four steps. It vanishes with h.
    #[must_use]
    pub fn rebound_speed(&self) -> f64 {
        self.rebound_speed.unwrap_or_else(|| 2.0 * self.gravity().norm() * self.time_step())
    }

    /// The rebound speed that was given, m/s, if one was.
    #[must_use]
    pub fn given_rebound_speed(&self) -> Option<f64> {
        self.rebound_speed
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

/// Coefficients that were given for pairs, in ascending order of the pairs.
type Pairs = Vec<((usize, Partner), f64)>;

fn set_pair(pairs: &mut Pairs, body: usize, partner: Partner, value: f64) {
    let pair = ordered(body, partner);
    match pairs.binary_search_by(|(known, _)| known.cmp(&pair)) {
        Ok(place) => pairs[place].1 = value,
        Err(place) => pairs.insert(place, (pair, value)),
    }
}

fn find_pair(pairs: &Pairs, body: usize, partner: Partner) -> Option<f64> {
    if pairs.is_empty() {
        return None;
    }
    let pair = ordered(body, partner);
    let place = pairs.binary_search_by(|(known, _)| known.cmp(&pair));
    place.ok().map(|place| pairs[place].1)
}

/// The same for both orders of a pair.
fn ordered(body: usize, partner: Partner) -> (usize, Partner) {
    match partner {
        Partner::Body(other) if other < body => (other, Partner::Body(body)),
        _ => (body, partner),
    }
}

impl World {
    /// The same world in other units of `mass` (kg), `length` (m) and `time` (s). Without
    /// pieces: bodies of points on a ground. The ranges of [`World::new`] are those of SI units and
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
            joints: Vec::new(),
            gears: Vec::new(),
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
