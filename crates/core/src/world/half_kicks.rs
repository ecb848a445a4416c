//! Half kicks: the time over which the forces of a problem act.
//!
//! A force at the time k acts from the middle of the interval before, of length h₁, to the middle of the
//! present one, of length h:
//!
//! ```text
//! w⁺ = w⁻ + M⁻¹ (½ h₁ F⁻ + ½ h F + p),   q⁺ = q + h w⁺                    (eq. 37)
//! ```
//!
//! F⁻ and F are the inputs before and after k, and p the impulses of contacts and joints. A body that
//! starts has h₁ = 0. Problems are posed with h alone. If h₁ is another length, gravity and the
//! gyroscopic term act over κ h = ½ (h₁ + h) by a [wrench](World::missing_kick) in addition.

#[cfg(feature = "save")]
use super::Constant;
use super::{Integrator, WINDOW, World};
use crate::joint::Joint;
#[cfg(feature = "save")]
use crate::joint::{Drive, Motor};
use crate::kinematics::StepMap;
use crate::mechanics::{Rotation, State, Wrench};
use nalgebra::{Matrix3, Vector3};

impl World {
    /// Sets the lengths of the intervals to whose middles the velocities of the bodies belong at the start
    /// of the next problem (s), 0 for bodies that start.
    pub fn set_before(&mut self, lengths: impl Iterator<Item = f64> + Clone) {
        self.set_regular();
        let h = self.time_step();
        if !lengths.clone().any(|length| length != h) {
            return;
        }
        self.before.extend(lengths);
        let of_joint = |joint: &Joint| {
            let other = joint.other().map_or(f64::INFINITY, |body| self.kick(body));
            self.kick(joint.body()).min(other)
        };
        let kicks: Vec<_> = self.joints.iter().map(of_joint).collect();
        self.set_kicks(|joint| kicks[joint]);
        let fall = |joint: &Joint| {
            let other = joint.other().map_or(Vector3::zeros(), |body| self.missing_fall(body));
            self.missing_fall(joint.body()) - other
        };
        let falls: Vec<_> = self.joints.iter().map(fall).collect();
        self.joints.iter_mut().zip(falls).for_each(|(joint, fall)| joint.fall = fall);
    }

    /// Copy without what moves bodies at rest besides gravity: drives, loads of joints and surfaces.
    pub(crate) fn without_motion(&self) -> Self {
        let mut world = self.clone();
        world.surfaces.clear();
        world.joints.iter_mut().for_each(|joint| *joint = joint.without_drives());
        world.gears.iter_mut().for_each(|gear| *gear = gear.without_drive());
        world
    }

    /// Sets the length of the problem as the one before it for all bodies.
    pub(super) fn set_regular(&mut self) {
        if !self.before.is_empty() {
            self.before.clear();
            self.set_kicks(|_| 1.0);
            self.joints.iter_mut().for_each(|joint| joint.fall = Vector3::zeros());
        }
    }

    /// Sets the time over which the drives of joints and gears act.
    fn set_kicks(&mut self, kick: impl Fn(usize) -> f64) {
        let Self { joints, gears, .. } = self;
        joints.iter_mut().enumerate().for_each(|(index, joint)| joint.kick = kick(index));
        gears.iter_mut().for_each(|gear| gear.kick = kick(gear.axes()[0].joint));
    }

    /// Lengths of the intervals before the present problem; empty if all are its own.
    pub fn before(&self) -> &[f64] {
        &self.before
    }

    /// Time κ over which forces on `body` act in the present problem, in its lengths.
    pub fn kick(&self, body: usize) -> f64 {
        self.before.get(body).map_or(1.0, |before| 0.5 * (1.0 + before / self.time_step()))
    }

    /// Share of its kinetic energy that `body` may gain at its start from `state`, ½ h² ω²: its velocity is then
    /// that along the chord of a circle instead of the tangent.
    pub fn bent_share(&self, body: usize, state: &State) -> f64 {
        let h = self.time_step();
        let starts = self.before.get(body).is_some_and(|before| *before < WINDOW * h);
        if starts { 0.5 * h * h * state.spin.norm_squared() } else { 0.0 }
    }

    /// True if inputs act from middle to middle.
    pub fn has_half_kicks(&self) -> bool {
        self.integrator == Integrator::Leapfrog
    }

    /// Map from the start of a step to the time at which the touching point of an ellipsoid may take its force. With
    /// half kicks this is the start.
    pub fn lever_step(&self) -> StepMap {
        if self.has_half_kicks() { StepMap::STILL } else { self.step_map() }
    }

    /// Time over which loads on `body` act in step `index` (s), and over which their mean is taken. With
    /// [`Integrator::Leapfrog`] it lies between the middles of two intervals.
    pub fn load_interval(&self, index: u64, body: usize) -> [f64; 2] {
        let h = self.time_step();
        if !self.has_half_kicks() {
            return [self.time_before(index), self.time_after(index)];
        }
        match (self.before.get(body), self.span()) {
            (None, None) => [index, index + 1].map(|k| (k as f64 - 0.5).max(0.0) * h),
            (before, _) => {
                let start = self.time_before(index);
                [(start - 0.5 * before.unwrap_or(&h)).max(0.0), start + 0.5 * h]
            }
        }
    }

    /// Wrench on `body` at `state` by which gravity and the gyroscopic term act over κ h (eq. 37). With
    /// the momentum P⁻ (34),
    ///
    /// ```text
    /// f = (κ − 1) m g,   τ = (P⁻(ω; h₁) − P⁻(ω; h))/h
    /// ```
    pub fn missing_kick(&self, body: usize, state: &State) -> Wrench {
        let rigid_body = &self.bodies()[body];
        let Some(share) = self.missing_share(body) else { return Wrench::zero() };
        let torque = self.missing_torque(body, rigid_body.inertia(), &state.spin);
        Wrench { force: self.gravity() * (rigid_body.mass() * share), torque }
    }

    /// Change of velocity by the [missing kick](World::missing_kick) of gravity, (κ − 1) h g (m/s). The
    /// velocity before an impact is that of a step of the present length with it.
    pub(crate) fn missing_fall(&self, body: usize) -> Vector3<f64> {
        let share = self.missing_share(body).unwrap_or_default();
        self.gravity() * (share * self.time_step())
    }

    /// κ − 1; `None` without half kicks.
    fn missing_share(&self, body: usize) -> Option<f64> {
        let has_kicks = self.has_half_kicks() || self.rotation() == Rotation::Momentum;
        (has_kicks && !self.before.is_empty()).then(|| self.kick(body) - 1.0)
    }

    /// Torque of [`World::missing_kick`] with this `inertia`, in which it is linear.
    fn missing_torque(
        &self,
        body: usize,
        inertia: &Matrix3<f64>,
        spin: &Vector3<f64>,
    ) -> Vector3<f64> {
        let before = self.before[body];
        let h = self.time_step();
        let form = self.rotation();
        match form {
            Rotation::Momentum => {
                let [past, own] = [before, h].map(|h| form.momentum(inertia, spin, h));
                (past - own) / h
            }
            Rotation::Tutorial => (inertia * spin).cross(spin) * (self.kick(body) - 1.0),
        }
    }

    /// Share of the present value of each number of an input that is held, in an interval that begins with
    /// another one ([`Drive::after`](crate::joint::Drive)); 1 for inputs that act at once.
    #[cfg(feature = "save")]
    pub(crate) fn held_shares(&self, input: Constant) -> Vec<f64> {
        let share = |joint: usize| 0.5 / self.joints()[joint].kick();
        let of_motor = |drive: Option<&Drive>, share: f64| match drive.and_then(|d| d.motor) {
            Some(Motor::Position { .. } | Motor::Damper { .. }) => share,
            Some(Motor::Speed { .. }) | None => 1.0,
        };
        match input {
            Constant::JointForce => {
                self.driven_axes().into_iter().map(|(joint, _)| share(joint)).collect()
            }
            Constant::MotorTarget | Constant::MotorMaxForce => {
                let motors = self.motors().into_iter();
                motors
                    .map(|(joint, axis)| of_motor(self.joints()[joint].drive(axis), share(joint)))
                    .collect()
            }
            // A larger offset of a gear acts like a larger target of its motor.
            Constant::GearOffset => {
                let gears = self.gears().iter();
                gears.map(|gear| of_motor(gear.drive(), 0.5 / gear.kick)).collect()
            }
            other => vec![1.0; other.width(self)],
        }
    }

    /// Adds the derivatives of the wrench (eq. 37) on `body` at `state` by a constant, multiplied `by` those
    /// with respect to the wrench.
    #[cfg(feature = "save")]
    pub(crate) fn missing_kick_vjp(
        &self,
        body: usize,
        state: &State,
        by: &Wrench,
        constant: Constant,
        sums: &mut [f64],
    ) {
        let Some(share) = self.missing_share(body) else { return };
        let rigid_body = &self.bodies()[body];
        let h = self.time_step();
        match constant {
            Constant::Mass => {
                let Wrench { force, torque } = self.missing_kick(body, state);
                sums[body] += (by.force.dot(&force) + by.torque.dot(&torque)) / rigid_body.mass();
            }
            Constant::Inertia => {
                for place in 0..9 {
                    let mut unit = Matrix3::zeros();
                    unit[(place / 3, place % 3)] = 1.0;
                    let torque = self.missing_torque(body, &unit, &state.spin);
                    sums[9 * body + place] += by.torque.dot(&torque);
                }
            }
            Constant::Gravity => {
                let along = by.force * (rigid_body.mass() * share);
                sums.iter_mut().zip(&along).for_each(|(sum, along)| *sum += along);
            }
            // Lengths before scale with the time step, and so does h κ.
            Constant::TimeStep if self.rotation() == Rotation::Momentum => {
                let before = self.before[body];
                let rate = |length: f64| {
                    length
                        * self.rotation().momentum_rate(
                            rigid_body.inertia(),
                            &state.spin,
                            length,
                            -1.0,
                        )
                };
                let torque = self.missing_torque(body, rigid_body.inertia(), &state.spin);
                sums[0] += by.torque.dot(&((rate(before) - rate(h)) / h - torque)) / h;
            }
            _ => {}
        }
    }

    /// Derivative of the torque of [`World::missing_kick`] with respect to the spin (N m s).
    #[cfg(feature = "save")]
    pub(crate) fn missing_torque_by_spin(&self, body: usize, spin: &Vector3<f64>) -> Matrix3<f64> {
        let Some(share) = self.missing_share(body) else { return Matrix3::zeros() };
        let rigid_body = &self.bodies()[body];
        let h = self.time_step();
        let form = self.rotation();
        match form {
            Rotation::Momentum => {
                let lengths = [self.before[body], h];
                let [past, own] =
                    lengths.map(|h| form.momentum_slope(rigid_body.inertia(), spin, h));
                (past - own) / h
            }
            Rotation::Tutorial => {
                let momentum = rigid_body.inertia() * spin;
                (momentum.cross_matrix() - spin.cross_matrix() * rigid_body.inertia()) * share
            }
        }
    }
}
