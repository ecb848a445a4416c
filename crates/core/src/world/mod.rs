//! The world: bodies, collision geometry, joints, and the constants shared by all steps. Lists of
//! states, forces and certificates have one entry per body.

mod apart;
mod changes;
mod coefficients;
pub mod constants;
mod friction_axis;
mod gears;
mod groups;
mod half_kicks;
mod joint_constants;
mod law_constants;
pub mod plane;
pub(crate) mod reshape;
mod static_friction;
mod terrain;

use crate::kinematics::StepMap;
pub use crate::partner::{
    Coefficient, ContactLaw, FrictionAxis, Partner, SurfaceMotion, TurningFriction,
};
pub(crate) use apart::KnownSeparations;
pub(crate) use changes::Changeable;
pub(crate) use changes::without;
pub(crate) use coefficients::ordered;
use coefficients::{Coefficients, LawCoefficients};
pub use constants::Constant;
pub(crate) use groups::GroupMasks;
pub use groups::{Groups, Touching};
pub(crate) use law_constants::LawSlopes;
pub use plane::Plane;
pub use static_friction::StickSpeed;

use crate::error::{Error, all_in_range, in_range};
use crate::geometry::{Piece, Terrain};
use crate::joint::{Gear, HeldBack, Joint, JointForce, angles_near};
use crate::mechanics::dynamics;
use crate::mechanics::{Pose, RigidBody, Rotation, State, Wrench};
use crate::sets::DisjointSets;
use nalgebra::Vector3;
use std::borrow::Cow;
use std::sync::Arc;

/// Constants of a [`World`], unchecked.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameters {
    /// Bodies; they set the order of states and wrenches.
    pub bodies: Vec<RigidBody>,
    /// Ground, if any. Without a ground, contact points have no height, certificates have no ground
    /// part, and coefficients for pairs with the ground are rejected.
    pub ground: Option<Plane>,
    /// Gravity g (m/s²), world frame.
    pub gravity: Vector3<f64>,
    /// Coefficient of friction μ.
    pub friction: f64,
    /// Time step h (s).
    pub time_step: f64,
    /// Integrator of the rotations.
    pub rotation: Rotation,
}

impl Parameters {
    /// Constants of `bodies` on level ground at z = 0, with gravity of 9.81 m/s², μ = 0.5 and steps of
    /// 2 ms.
    pub fn new(bodies: Vec<RigidBody>) -> Self {
        Self {
            bodies,
            ground: Some(Plane::level()),
            gravity: Vector3::new(0.0, 0.0, -9.81),
            friction: 0.5,
            time_step: 0.002,
            rotation: Rotation::Momentum,
        }
    }
}

/// Meaning of the velocities of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "serde", serde(rename_all = "kebab-case"))]
pub enum Integrator {
    /// Velocities belong to the ends of steps, as in the tutorial: the implicit Euler method with
    /// errors of first order in h.
    Euler,
    /// Velocities belong to the middles of steps. The same step is then of second order in h in
    /// smooth motion: the leapfrog method of Störmer and Verlet, with contact. States have the
    /// velocities of the instant, which a run converts at its start.
    Leapfrog,
}

impl Integrator {
    /// All integrators.
    pub const ALL: [Self; 2] = [Self::Euler, Self::Leapfrog];

    /// Integrator of worlds with this `rotation`, unless another one is set: [`Self::Leapfrog`], and
    /// [`Self::Euler`] with the tutorial's rotation.
    pub fn usual(rotation: Rotation) -> Self {
        match rotation {
            Rotation::Momentum => Self::Leapfrog,
            Rotation::Tutorial => Self::Euler,
        }
    }

    /// Name in files and flags.
    pub fn name(self) -> &'static str {
        match self {
            Self::Euler => "euler",
            Self::Leapfrog => "leapfrog",
        }
    }
}

/// When abrupt changes of velocity happen: impacts, ends of slips and stops of joints.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "serde", serde(rename_all = "kebab-case"))]
pub enum Impacts {
    /// Within the step: its velocities have the change from the start.
    #[default]
    Stepped,
    /// At their time, where an interval begins. Needs [`Integrator::Leapfrog`].
    Located,
}

impl Impacts {
    /// Name in files and flags.
    pub fn name(self) -> &'static str {
        match self {
            Self::Stepped => "stepped",
            Self::Located => "located",
        }
    }
}

/// Rigid bodies with their collision geometry, joints and contact laws: the constants of every
/// step.
#[derive(Debug, Clone, PartialEq)]
pub struct World {
    parameters: Parameters,
    fixed: Vec<Piece>,
    terrains: Vec<Arc<Terrain>>,
    joints: Vec<Joint>,
    /// For each body, the number of the bodies that joints fix to each other, and 0 for those fixed in the
    /// world. Bodies beyond the list are free.
    rigid: Vec<usize>,
    gears: Vec<Gear>,
    /// Pairs without contacts, excluded by a joint or by the user, sorted.
    apart: Vec<(usize, Partner)>,
    /// Pairs excluded by the user.
    kept_apart: Vec<(usize, Partner)>,
    /// Bodies without contacts, sorted.
    untouched: Vec<usize>,
    /// Collision groups; `None` if all objects have the defaults.
    groups: Option<Box<GroupMasks>>,
    /// Held flag of each body; empty if no body is held.
    held: Vec<bool>,
    /// Motions of surfaces, each with its collider.
    surfaces: Vec<(Partner, SurfaceMotion)>,
    coefficients: LawCoefficients,
    /// Slip up to which contacts stick, set by the user (m/s).
    stick_speed: StickSpeed,
    /// Axes of surfaces whose friction depends on the direction, sorted by owner.
    friction_axes: Vec<(Partner, FrictionAxis)>,
    /// Rebound speed set by the user.
    rebound_speed: Option<f64>,
    integrator: Integrator,
    accuracy: Option<f64>,
    impacts: Impacts,
    part: Option<Part>,
    /// Length of the interval to whose middle each body's velocity belongs at the start of the present
    /// problem (s), 0 for bodies that start; empty if it is that of the problem for all.
    before: Vec<f64>,
    reach: f64,
    speed_scale: f64,
}

/// Length of a window, as a share of the usual length.
pub(crate) const WINDOW: f64 = 0.05;

/// Part of a time step that one problem covers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Span {
    /// Its start since that of the step (s).
    pub since: f64,
    /// Its length (s).
    pub length: f64,
    /// Usual length of intervals, over which depths and joint errors are removed (s)
    /// ([`World::removed_share`]); infinite if depths are kept.
    pub usual: f64,
    /// True for a shorter interval of a step that was not solved.
    pub is_retry: bool,
}

/// Present part of the time step, and the whole of it (s).
#[derive(Debug, Clone, Copy, PartialEq)]
struct Part {
    span: Span,
    whole: f64,
}

impl World {
    /// Checks the constants and creates a world.
    ///
    /// # Errors
    /// If there is no body, the time step is outside 1e-6…0.1 s, the coefficient of friction is
    /// outside 0…10, or a component of gravity is beyond ±1000 m/s².
    pub fn new(parameters: Parameters) -> Result<Self, Error> {
        if parameters.bodies.is_empty() {
            return Err(Error::Count { field: "bodies", count: 0, allowed: "1 or more" });
        }
        in_range("time step (s)", parameters.time_step, 1e-6, 0.1, "1e-6 to 0.1")?;
        in_range("coefficient of friction", parameters.friction, 0.0, 10.0, "0 to 10")?;
        all_in_range("gravity (m/s²)", &parameters.gravity, -1000.0, 1000.0, "-1000 to 1000")?;
        let reach = parameters.bodies.iter().map(RigidBody::reach).fold(0.0, f64::max);
        let speed_scale = speed_scale(&parameters.gravity, reach);
        Ok(Self::from_parameters(parameters, reach, speed_scale))
    }

    /// World of these bodies alone.
    fn from_parameters(parameters: Parameters, reach: f64, speed_scale: f64) -> Self {
        let mut coefficients = LawCoefficients::default();
        coefficients[Coefficient::Friction as usize] = Coefficients::for_world(parameters.friction);
        coefficients[Coefficient::Restitution as usize] = Coefficients::for_world(0.0);
        Self {
            integrator: Integrator::usual(parameters.rotation),
            parameters,
            fixed: Vec::new(),
            terrains: Vec::new(),
            joints: Vec::new(),
            rigid: Vec::new(),
            gears: Vec::new(),
            apart: Vec::new(),
            kept_apart: Vec::new(),
            untouched: Vec::new(),
            groups: None,
            held: Vec::new(),
            surfaces: Vec::new(),
            coefficients,
            stick_speed: StickSpeed::default(),
            friction_axes: Vec::new(),
            rebound_speed: None,
            accuracy: None,
            impacts: Impacts::Stepped,
            part: None,
            before: Vec::new(),
            reach,
            speed_scale,
        }
    }

    /// Returns this world with the static pieces `fixed`, in the world frame: steps, ramps, walls, parts of
    /// a bowl.
    #[must_use]
    pub fn with_fixed(self, fixed: Vec<Piece>) -> Self {
        Self { fixed, ..self }
    }

    /// Returns this world with `joints` and without gears. Bodies connected by a joint do not touch
    /// each other, unless the joint is [colliding](Joint::colliding).
    ///
    /// # Errors
    /// If a joint names a body that does not exist or the same body twice; if frames, lengths or
    /// drives are out of range. The rotation of a joint must be locked, about z only, or free
    /// without a drive.
    pub fn with_joints(self, joints: Vec<Joint>) -> Result<Self, Error> {
        let bodies = self.bodies().len();
        let checked = joints.into_iter().map(|joint| joint.checked(bodies));
        let joints = checked.collect::<Result<Vec<_>, _>>()?;
        Ok(Self { gears: Vec::new(), ..self }.tied_by(joints))
    }

    /// Returns this world with `gears` between its joints.
    ///
    /// # Errors
    /// If a joint does not exist, if an axis is locked or has no counted angle, or if a number is
    /// out of range.
    pub fn with_gears(self, gears: Vec<Gear>) -> Result<Self, Error> {
        let checked = gears.into_iter().map(|gear| gear.checked(&self.joints));
        let gears = checked.collect::<Result<Vec<_>, _>>()?;
        Ok(Self { gears, ..self })
    }

    /// Replaces the joints by checked ones and updates the contact exclusions.
    fn tied_by(mut self, joints: Vec<Joint>) -> Self {
        let tied = joints.iter().filter(|joint| !joint.collides());
        let tied = tied.filter_map(|joint| Some((joint.body(), joint.other()?)));
        let tied = tied.map(|(a, b)| ordered(a, Partner::Body(b)));
        self.kept_apart.sort_unstable();
        self.kept_apart.dedup();
        self.apart = tied.chain(self.kept_apart.iter().copied()).collect();
        self.apart.sort_unstable();
        self.apart.dedup();
        self.rigid = self.rigid_groups(&joints);
        self.joints = joints;
        self.prepare_joints();
        self
    }

    /// Numbers of the bodies that `joints` fix to each other or, number 0, in the world. Empty if there
    /// are none.
    fn rigid_groups(&self, joints: &[Joint]) -> Vec<usize> {
        let locking = || joints.iter().filter(|joint| joint.locks_all());
        let bodies = if locking().next().is_some() { self.bodies().len() } else { 0 };
        let mut sets = DisjointSets::new(bodies + 1);
        for joint in locking() {
            sets.join(joint.body() + 1, joint.other().map_or(0, |other| other + 1));
        }
        (0..bodies).map(|body| sets.first(body + 1)).collect()
    }

    /// Number that the bodies which cannot move against `body` share: by joints that lock all axes. It is
    /// 0 if it cannot move against the world but by a prescribed motion.
    pub(crate) fn rigid_group(&self, body: usize) -> usize {
        match self.rigid.get(body) {
            _ if self.is_held(body) => 0,
            Some(&group) => group,
            None => body + 1,
        }
    }

    /// Joints.
    pub fn joints(&self) -> &[Joint] {
        &self.joints
    }

    /// Gears between joints.
    pub fn gears(&self) -> &[Gear] {
        &self.gears
    }

    /// Joint angles at `states`, which start the counting of turns. Angles are the nearest to
    /// `near`, or to zero. A gear that determines the number of turns of a joint takes precedence.
    pub fn angles_near(&self, states: &[State], near: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
        angles_near(&self.joints, &self.gears, states, near)
    }

    /// Returns this world with other `parameters`. Fixed pieces, joints, restitution and pair
    /// settings stay.
    ///
    /// # Errors
    /// Those of [`World::new`]; [`Error::Count`] if the number of bodies differs.
    pub fn with_parameters(&self, parameters: Parameters) -> Result<Self, Error> {
        let count = parameters.bodies.len();
        if count != self.bodies().len() {
            return Err(Error::Count { field: "bodies", count, allowed: "as many as before" });
        }
        let Self { parameters, reach, speed_scale, .. } = Self::new(parameters)?;
        let friction = parameters.friction;
        let mut world = Self { parameters, reach, speed_scale, ..self.clone() };
        world.prepare_joints();
        world.with_coefficient(Coefficient::Friction, friction)
    }

    /// Static convex pieces.
    pub fn fixed(&self) -> &[Piece] {
        &self.fixed
    }

    /// Constants of the world.
    pub fn parameters(&self) -> &Parameters {
        &self.parameters
    }

    /// Bodies.
    pub fn bodies(&self) -> &[RigidBody] {
        &self.parameters.bodies
    }

    /// Ground, if any.
    pub fn ground(&self) -> Option<&Plane> {
        self.parameters.ground.as_ref()
    }

    /// Gravity g (m/s²), world frame.
    pub fn gravity(&self) -> &Vector3<f64> {
        &self.parameters.gravity
    }

    /// Time step h (s).
    pub fn time_step(&self) -> f64 {
        self.parameters.time_step
    }

    /// Map of a step from the velocities at its end to the change of the poses.
    pub fn step_map(&self) -> StepMap {
        StepMap { form: self.parameters.rotation, time_step: self.parameters.time_step }
    }

    /// Returns this world with the given meaning of the velocities of a run.
    #[must_use]
    pub fn with_integrator(self, integrator: Integrator) -> Self {
        let mut world = Self { integrator, ..self };
        world.prepare_joints();
        world
    }

    /// Returns this world with an error of the time step that runs keep: the estimate (40) of each
    /// body's position grows by at most `accuracy` (m) in a second. A step is then taken in intervals,
    /// which also begin at impacts, ends of slips and stops of joints. Needs
    /// [`Integrator::Leapfrog`], and has no effect without it.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] if the accuracy is outside 1e-10…1 m.
    pub fn with_accuracy(self, accuracy: Option<f64>) -> Result<Self, Error> {
        if let Some(accuracy) = accuracy {
            in_range("accuracy (m)", accuracy, 1e-10, 1.0, "1e-10 to 1")?;
        }
        Ok(Self { accuracy, ..self })
    }

    /// Returns this world with impacts that happen within a step or at their time.
    #[must_use]
    pub fn with_impacts(self, impacts: Impacts) -> Self {
        Self { impacts, ..self }
    }

    /// Returns this world with whole steps: without an [accuracy](World::with_accuracy) and with
    /// impacts within a step.
    #[must_use]
    pub fn with_whole_steps(self) -> Self {
        Self { accuracy: None, impacts: Impacts::Stepped, ..self }
    }

    /// Growth of the error of the time step that runs keep (m/s); see [`World::with_accuracy`].
    pub fn accuracy(&self) -> Option<f64> {
        self.accuracy
    }

    /// When impacts happen. In a world with an accuracy it is at their time.
    pub fn impacts(&self) -> Impacts {
        self.accuracy.map_or(self.impacts, |_| Impacts::Located)
    }

    /// Accuracy that located impacts keep (m/s): that of the run, or 1e-6. `None` for whole steps.
    pub fn impact_accuracy(&self) -> Option<f64> {
        (self.impacts() == Impacts::Located).then(|| self.accuracy.unwrap_or(1e-6))
    }

    /// Share s of the errors of position at its start that the present problem removes: of depths, of
    /// joint errors and of passed stops. An interval of length h shorter than the usual length L leaves
    /// the rest, so that bodies move no faster than in an interval of that length:
    ///
    /// ```text
    /// φ⁺ ≥ (1 − s) φ for φ < 0,   s = min(1, h/L)                        (eq. 41a)
    /// ```
    pub fn removed_share(&self) -> f64 {
        self.part.map_or(1.0, |part| (part.span.length / part.span.usual).min(1.0))
    }

    /// True if the present problem covers an interval much shorter than the usual length, such as that of a
    /// located impact.
    pub fn is_window(&self) -> bool {
        self.removed_share() < WINDOW
    }

    /// |g| h²: distance by which a body may fall in a step (m).
    pub(crate) fn fall(&self) -> f64 {
        self.gravity().norm() * self.time_step().powi(2)
    }

    /// Gap (m) below which contacts count as touching in a [window](World::is_window), with
    /// located impacts. Otherwise the interval of an impact would find contacts that touch open. 0 without
    /// located impacts, and in shorter intervals of a step that was not solved.
    pub fn touching_gap(&self) -> f64 {
        let accuracy = self.impact_accuracy().filter(|_| !self.is_retry());
        accuracy.map_or(0.0, |accuracy| 0.1 * accuracy)
    }

    /// True in a shorter interval of a step that was not solved.
    fn is_retry(&self) -> bool {
        self.part.is_some_and(|part| part.span.is_retry)
    }

    /// True if joint errors stay in part. Shorter intervals of a step that was not solved remove them whole.
    fn holds_back(&self) -> bool {
        self.removed_share() < 1.0 && !self.is_retry() && !self.joints.is_empty()
    }

    /// This world with joints and gears as a problem from `states` has them, if it removes only a
    /// [share](World::removed_share) of their errors. Joint angles are the nearest to those in `near`.
    pub fn held_back(&self, states: &[State], near: &[JointForce]) -> Cow<'_, Self> {
        if !self.holds_back() {
            return Cow::Borrowed(self);
        }
        let mut world = self.clone();
        world.hold_back(states, near);
        Cow::Owned(world)
    }

    /// Moves joints and gears for a problem from `states` that removes only a
    /// [share](World::removed_share) of their errors. Joint angles are the nearest to those in `near`.
    pub(crate) fn hold_back(&mut self, states: &[State], near: &[JointForce]) -> Option<HeldBack> {
        let share = self.removed_share();
        self.holds_back().then(|| {
            let near: Vec<_> = near.iter().map(|force| force.angles).collect();
            let angles = self.angles_near(states, &near);
            HeldBack::new(&mut self.joints, &mut self.gears, states, &angles, share)
        })
    }

    /// Moves joints and gears back after [`World::hold_back`].
    pub(crate) fn release(&mut self, held: Option<HeldBack>) {
        if let Some(held) = held {
            held.release(&mut self.joints, &mut self.gears);
        }
    }

    /// Sets the part of the time step that the next problem covers. `None` is the whole step. The interval
    /// before counts as one of the same length until [`World::set_before`].
    pub fn set_span(&mut self, span: Option<Span>) {
        self.set_regular();
        if span.is_none() && self.part.is_none() {
            return;
        }
        let whole = self.whole_step();
        self.parameters.time_step = span.map_or(whole, |span| span.length);
        self.part = span.map(|span| Part { span, whole });
        self.prepare_joints();
    }

    /// Part of the time step that is [set](World::set_span).
    pub fn span(&self) -> Option<Span> {
        self.part.map(|part| part.span)
    }

    /// Time step of the world (s), also while a [part](World::set_span) of it is set.
    pub fn whole_step(&self) -> f64 {
        self.part.map_or(self.time_step(), |part| part.whole)
    }

    /// Time at the start of step `index` (s), or of the part of it that is set.
    pub fn time_before(&self, index: u64) -> f64 {
        let since = self.span().map_or(0.0, |span| span.since);
        // k h with one rounding, so that times do not drift.
        index as f64 * self.whole_step() + since
    }

    /// Time at the end of step `index` (s), or of the part of it that is set.
    pub fn time_after(&self, index: u64) -> f64 {
        match self.part {
            None => (index + 1) as f64 * self.time_step(),
            Some(_) => self.time_before(index) + self.time_step(),
        }
    }

    /// Sets in all joints when their springs and dampers act, and from which speed their stops bounce.
    pub(super) fn prepare_joints(&mut self) {
        let is_middle = self.integrator == Integrator::Leapfrog;
        let speed = self.rebound_speed();
        let fall = self.gravity().norm() * self.time_step();
        let Self { joints, parameters, .. } = self;
        for joint in joints {
            joint.set_middle(is_middle, &parameters.bodies);
            joint.set_rebound(speed, fall, &parameters.bodies);
        }
    }

    /// Meaning of the velocities of a run; [`Integrator::usual`] by default.
    pub fn integrator(&self) -> Integrator {
        self.integrator
    }

    /// Integrator of the rotations.
    pub fn rotation(&self) -> Rotation {
        self.parameters.rotation
    }

    /// Length scale ℓ of the world (m): the largest [reach](RigidBody::reach) of a body.
    pub fn reach(&self) -> f64 {
        self.reach
    }

    /// Speed scale of the world, relative to the tutorial's cube (1 m, 9.81 m/s²). Tolerances in
    /// m/s are multiplied by it. Speeds under gravity scale with √(g ℓ). Without gravity, 9.81 m/s²
    /// is used.
    ///
    /// ```text
    /// √(|g| ℓ / (9.81 m/s² · 1 m))
    /// ```
    pub fn speed_scale(&self) -> f64 {
        self.speed_scale
    }

    /// Next state of body `index` without contacts and joints (eq. 8 with F = 0). A held body keeps
    /// its state.
    ///
    /// # Panics
    /// If the body does not exist.
    pub fn free_flight(&self, index: usize, state: &State, wrench: &Wrench) -> State {
        if self.is_held(index) {
            return *state;
        }
        let body = &self.bodies()[index];
        let (h, rotation) = (self.time_step(), self.rotation());
        dynamics::free_flight(body, state, wrench, self.gravity(), h, rotation)
    }

    /// Heights of the contact points of body `index` above the ground at `pose` (m):
    ///
    /// ```text
    /// φ_i = n·r − d + (Aᵀ n)·c_i − ρ_i − |S_iᵀ Aᵀ n|
    /// ```
    ///
    /// Empty without a ground, or if contacts between body and ground are excluded.
    ///
    /// # Panics
    /// If the body does not exist.
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
        points.iter().map(move |point| {
            let height = centre + normal.dot(&point.position) - point.radius;
            match &point.ellipsoid {
                None => height,
                Some(axes) => height - axes.tr_mul(&normal).norm(),
            }
        })
    }

    /// Height of the lowest contact point of all bodies in `states` (m); infinite without a ground.
    pub fn lowest_height(&self, states: &[State]) -> f64 {
        let states = states.iter().take(self.bodies().len()).enumerate();
        let heights = states.flat_map(|(i, state)| self.heights(i, &state.pose()));
        heights.fold(f64::INFINITY, f64::min)
    }
}

impl World {
    /// Copy of this world in units of `mass` (kg), `length` (m) and `time` (s). Only ground and point
    /// bodies are converted; pieces, joints and gears are dropped. The ranges of [`World::new`] are
    /// in SI units and are not checked.
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
            held: self.held.clone(),
            coefficients: self.coefficients.clone(),
            rebound_speed: self.rebound_speed.map(|speed| speed * time / length),
            ..Self::from_parameters(parameters, self.reach / length, speed_scale)
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
