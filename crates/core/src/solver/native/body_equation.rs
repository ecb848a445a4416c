//! Body in the equations of a step: its constants and its motion without couplings.
//!
//! Equation numbers refer to `docs/native-solver.md`.

use super::equations::Velocity;
use super::settings::LARGE_TURN;
use super::turning::BodyTurning;
use crate::kinematics::StepMap;
use crate::mechanics::quaternion::rotation;
use crate::mechanics::{Rotation, Wrench};
use crate::step::Step;
use nalgebra::{Matrix3, Matrix6, RowVector3, Vector3, Vector6};

/// Change of the data of one body.
#[derive(Debug, Clone, Copy)]
pub(super) struct BodyPerturbation {
    /// δv at k (m/s, world). `spin` is δω at k (rad/s, body).
    pub(super) velocity: Vector3<f64>,
    pub(super) spin: Vector3<f64>,
    pub(super) wrench: Wrench,
    /// δg (m/s²).
    pub(super) gravity: Vector3<f64>,
    /// δm (kg).
    pub(super) mass: f64,
    /// δI (kg m²).
    pub(super) inertia: Matrix3<f64>,
    /// δh (s).
    pub(super) time_step: f64,
}

impl BodyPerturbation {
    pub(super) fn nothing() -> Self {
        let zero = Vector3::zeros();
        Self {
            velocity: zero,
            spin: zero,
            wrench: Wrench::zero(),
            gravity: zero,
            mass: 0.0,
            inertia: Matrix3::zeros(),
            time_step: 0.0,
        }
    }
}

/// One body of an island.
#[derive(Debug, Clone)]
pub(super) struct BodyEquation {
    /// h (s).
    time_step: f64,
    /// Form of the rotation and of its equation.
    form: Rotation,
    /// True if the gyroscopic term of that equation vanishes.
    turns_alike: bool,
    /// ℓ (m).
    reach: f64,
    /// r at step k (m).
    pub(super) position: Vector3<f64>,
    /// A(q) at step k, body → world.
    pub(super) rotation: Matrix3<f64>,
    /// V of free flight; `old` is V at step k.
    pub(super) free: Velocity,
    old: Velocity,
    /// Excess P⁻(ω) − I ω of the spin at step k, per mass (m²/s).
    ended: Vector3<f64>,
    /// Î = I/m (m²).
    inertia: Matrix3<f64>,
    /// Î⁻¹ (1/m²).
    pub(super) inertia_inverse: Matrix3<f64>,
    /// h τ/m of the external torque (m²/s).
    pub(super) torque_impulse: Vector3<f64>,
    /// M/m, with M the mass that impulses are divided by.
    pub(super) share: f64,
    /// m (kg).
    mass: f64,
}

impl BodyEquation {
    /// Power of a motion residual along the change `step`, over M (m²/s²).
    pub(super) fn power(&self, residual: &Velocity, step: &Velocity) -> f64 {
        (step.linear.dot(&residual.linear) + step.spin.dot(&residual.spin)) / self.share
    }

    /// Placeholder body as memory.
    pub(super) fn room() -> Self {
        let (zero, nothing) = (Vector3::zeros(), Velocity::zero());
        let unit = Matrix3::identity();
        Self {
            time_step: 0.0,
            form: Rotation::Momentum,
            turns_alike: false,
            reach: 0.0,
            position: zero,
            rotation: unit,
            free: nothing,
            old: nothing,
            ended: zero,
            inertia: unit,
            inertia_inverse: unit,
            torque_impulse: zero,
            share: 1.0,
            mass: 1.0,
        }
    }

    /// Body `index` of a step, with impulses divided by `mass` (kg).
    #[inline(always)]
    pub(super) fn new(step: &Step<'_>, index: usize, mass: f64) -> Self {
        let (state, free) = (&step.states[index], &step.free[index]);
        let body = &step.world.bodies()[index];
        let form = step.world.rotation();
        let time_step = step.world.time_step();
        Self {
            time_step,
            form,
            turns_alike: form == Rotation::Tutorial && body.is_isotropic(),
            reach: body.reach(),
            position: state.position,
            rotation: rotation(&state.attitude),
            free: Velocity { linear: free.velocity, spin: free.spin },
            old: Velocity { linear: state.velocity, spin: state.spin },
            ended: form.end_excess(body.specific_inertia(), &state.spin, time_step),
            inertia: *body.specific_inertia(),
            inertia_inverse: *body.specific_inertia_inverse(),
            torque_impulse: step.wrenches[index].torque * (time_step / body.mass()),
            share: mass / body.mass(),
            mass: body.mass(),
        }
    }

    /// Speed of its points without impulses (m/s).
    pub(super) fn speed(&self) -> f64 {
        self.free.linear.norm() + self.free.spin.norm() * self.reach
    }

    /// Bound of the speed that an impulse and its torque cause, both per mass (m/s).
    pub(super) fn largest_speed(&self, force: &Vector3<f64>, torque: &Vector3<f64>) -> f64 {
        force.norm() + self.reach * self.inertia_inverse.norm() * torque.norm()
    }

    /// Converts an angular residual of (N1) to the speed of a point at the body's reach (m/s).
    pub(super) fn as_speed(&self, angular: &Vector3<f64>) -> Vector3<f64> {
        self.inertia_inverse * angular * self.reach
    }

    /// Î (ω⁺ − ω) (m²/s).
    #[inline]
    pub(super) fn turned(&self, spin: &Vector3<f64>) -> Vector3<f64> {
        self.inertia * (spin - self.old.spin)
    }

    /// h Ĝ(ω, ω⁺) (m²/s). `None` if it vanishes.
    #[inline]
    pub(super) fn gyroscopic(&self, spin: &Vector3<f64>) -> Option<Vector3<f64>> {
        let h = self.time_step;
        (!self.turns_alike)
            .then(|| h * self.form.gyroscopic_after(&self.inertia, &self.ended, spin, h))
    }

    /// ∂(angular part)/∂ω⁺ = Î + h ∂Ĝ/∂ω⁺.
    pub(super) fn angular_slope(&self, spin: &Vector3<f64>) -> Matrix3<f64> {
        if self.turns_alike {
            return self.inertia;
        }
        let h = self.time_step;
        self.inertia + h * self.form.gyroscopic_slope(&self.inertia, spin, h)
    }

    /// Right-hand side of the equations of motion (N1), per mass, for changes of the body's data,
    /// its state at k and its loads:
    ///
    /// ```text
    /// rhs_v = δv + h/m δF + h δg + (F/m + g) δh − (v⁺ − v − h g) δm/m
    /// rhs_ω = (∂P⁻/∂ω δω + h δτ + (τ + ∂P⁻/∂h − ∂P⁺/∂h) δh − P⁺(δI, ω⁺) + P⁻(δI, ω))/m      (G3)
    /// ```
    pub(super) fn change(
        &self,
        velocity: &Velocity,
        given: &BodyPerturbation,
        gravity: &Vector3<f64>,
    ) -> Vector6<f64> {
        let (h, old, new) = (self.time_step, &self.old, &velocity.spin);
        let BodyPerturbation {
            velocity: faster,
            spin,
            wrench,
            gravity: heavier,
            mass,
            inertia,
            time_step,
        } = given;
        let pushed = velocity.linear - old.linear - h * gravity;
        let outside = (self.free.linear - old.linear) / h;
        let linear = faster + wrench.force * (h / self.mass) + heavier * h + outside * *time_step
            - pushed * (mass / self.mass);
        let slope = self.form.momentum_slope(&self.inertia, &old.spin, h) * spin;
        let longer = self.torque_impulse / h
            + self.form.momentum_rate(&self.inertia, &old.spin, h, -1.0)
            - self.form.momentum_rate(&self.inertia, new, h, 1.0);
        let after = self.form.start_momentum(inertia, new, h);
        let before = self.form.momentum(inertia, &old.spin, h);
        let angular = slope
            + wrench.torque * (h / self.mass)
            + longer * *time_step
            + (before - after) / self.mass;
        let mut both = Vector6::zeros();
        both.fixed_rows_mut::<3>(0).copy_from(&linear);
        both.fixed_rows_mut::<3>(3).copy_from(&angular);
        both
    }

    /// Right-hand sides for unit changes of v and ω at k, as columns. Those of position and
    /// rotation are zero.
    pub(super) fn change_by_velocity(&self) -> Matrix6<f64> {
        let slope = self.form.momentum_slope(&self.inertia, &self.old.spin, self.time_step);
        let mut columns = Matrix6::identity();
        columns.fixed_view_mut::<3, 3>(3, 3).copy_from(&slope);
        columns
    }

    /// Transpose of [`change`](Self::change) for the state at k and the wrench. Maps derivatives
    /// with respect to the right-hand sides to those by v, ω, F and τ.
    pub(super) fn change_vjp(&self, rhs: &Vector6<f64>) -> (Vector3<f64>, Vector3<f64>, Wrench) {
        let linear = rhs.fixed_rows::<3>(0);
        let angular = rhs.fixed_rows::<3>(3).into_owned();
        let slope = self.form.momentum_slope(&self.inertia, &self.old.spin, self.time_step);
        let per_mass = self.time_step / self.mass;
        let wrench = Wrench { force: linear * per_mass, torque: angular * per_mass };
        (linear.into(), slope.tr_mul(&angular), wrench)
    }

    /// Derivatives with respect to F and τ, from those by v and ω if these act as momenta only.
    #[cfg(feature = "save")]
    pub(super) fn wrench_vjp(&self, velocity: &Vector3<f64>, spin: &Vector3<f64>) -> Wrench {
        let slope = self.form.momentum_slope(&self.inertia, &self.old.spin, self.time_step);
        let per_mass = self.time_step / self.mass;
        // The slope of a body at rest is its inertia over its mass.
        let angular = slope.transpose().lu().solve(spin).unwrap_or_default();
        Wrench { force: velocity * per_mass, torque: angular * per_mass }
    }

    /// Responses of this body to unit impulses along the rows of a joint, each on its own.
    ///
    /// The columns t_k of `torques` are the torques of the rows:
    ///
    /// ```text
    /// w_k = M/m (1 + t_k·Î⁻¹ t_k);   without the 1 where it is a torque alone
    /// ```
    pub(super) fn response(&self, torques: &Matrix3<f64>, pushes: bool) -> Vector3<f64> {
        let along = if pushes { 1.0 } else { 0.0 };
        let turned = self.inertia_inverse * torques;
        Vector3::from_fn(|k, _| self.share * (along + torques.column(k).dot(&turned.column(k))))
    }

    /// Kinetic energy over the mass (35), up to a constant (m²/s²).
    pub(super) fn energy(&self, velocity: &Velocity) -> f64 {
        let momentum = self.form.momentum(&self.inertia, &velocity.spin, self.time_step);
        0.5 * (velocity.linear.norm_squared() + momentum.dot(&(self.inertia_inverse * momentum)))
    }

    /// Work of gravity and of the external wrench over the mass (32), on the mean of the velocities
    /// before and after (m²/s²).
    pub(super) fn work_from_outside(&self, velocity: &Velocity) -> f64 {
        let Self { free, old, torque_impulse, .. } = self;
        let along = (free.linear - old.linear).dot(&(old.linear + velocity.linear));
        0.5 * (along + torque_impulse.dot(&(old.spin + velocity.spin)))
    }

    /// Kinetic energy over the mass of the change of the velocities since step k (m²/s²).
    pub(super) fn energy_of_change(&self, velocity: &Velocity) -> f64 {
        let spin = velocity.spin - self.old.spin;
        let linear = (velocity.linear - self.old.linear).norm_squared();
        0.5 * (linear + spin.dot(&(self.inertia * spin)))
    }

    /// Velocities at step k.
    pub(super) fn old(&self) -> &Velocity {
        &self.old
    }

    /// Distance of a velocity from the one at step k, as the speed of the body's points (m/s).
    pub(super) fn distance_from_old(&self, velocity: &Velocity) -> f64 {
        self.distance(&self.old, velocity)
    }

    /// Distance between two velocities, as the speed of the body's points (m/s).
    pub(super) fn distance(&self, from: &Velocity, to: &Velocity) -> f64 {
        let turned = (to.spin - from.spin).amax() * self.reach;
        (to.linear - from.linear).amax().max(turned)
    }

    /// Rotation of its points in a step that ends with `spin` (rad/s).
    pub(super) fn turning(&self, spin: Vector3<f64>) -> BodyTurning {
        BodyTurning::new(&self.rotation, spin, &self.map())
    }

    /// Sets that rotation and the inverse one of its frame.
    #[inline]
    pub(super) fn set_turnings(
        &self,
        spin: &Vector3<f64>,
        there: &mut BodyTurning,
        back: &mut BodyTurning,
    ) {
        BodyTurning::set_there_and_back(&self.rotation, spin, &self.map(), there, back);
    }

    /// Map from its velocities to the change of its pose.
    #[inline]
    pub(super) fn map(&self) -> StepMap {
        StepMap { form: self.form, time_step: self.time_step }
    }

    /// v⁺ + Gᵀ ω̃⁺ (eq. 29): velocity of the point with this torque map after the impulses.
    pub(super) fn departing(&self, velocity: &Velocity, torque_map: &Matrix3<f64>) -> Vector3<f64> {
        let Self { inertia, inertia_inverse: inverse, time_step, .. } = self;
        let spin = self.form.departing_spin(inertia, inverse, &velocity.spin, *time_step);
        velocity.linear + torque_map.tr_mul(&spin)
    }

    /// nᵀ ∂/∂ω⁺ of [`departing`](Self::departing).
    pub(super) fn departing_slope(
        &self,
        velocity: &Velocity,
        torque_map: &Matrix3<f64>,
        normal: &Vector3<f64>,
    ) -> RowVector3<f64> {
        let Self { inertia, inertia_inverse: inverse, time_step, .. } = self;
        let slope = self.form.departing_slope(inertia, inverse, &velocity.spin, *time_step);
        (torque_map * normal).tr_mul(&slope)
    }

    /// Restores spin and velocity if they changed by at most `exact` (m/s).
    pub(super) fn keep(&self, exact: f64, velocity: &mut Velocity) {
        let old = &self.old;
        if (velocity.spin - old.spin).amax() * self.reach <= exact {
            velocity.spin = old.spin;
        }
        if (velocity.linear - old.linear).amax() <= exact {
            velocity.linear = old.linear;
        }
    }

    /// Restores the velocity along a normal if it changed by at most `exact` (m/s).
    pub(super) fn keep_along(&self, normal: &Vector3<f64>, exact: f64, velocity: &mut Velocity) {
        let along = normal.dot(&(velocity.linear - self.old.linear));
        if along.abs() <= exact {
            velocity.linear -= normal * along;
        }
    }

    /// True if the velocities before and after are at most `rest` (m/s).
    pub(super) fn is_slow(&self, rest: f64, velocity: &Velocity) -> bool {
        let slow = |velocity: &Velocity| {
            velocity.linear.amax().max(velocity.spin.amax() * self.reach) <= rest
        };
        slow(velocity) && slow(&self.old)
    }

    /// Sets the velocities to zero if they are at most `rest` (m/s).
    pub(super) fn rest(&self, rest: f64, velocity: &mut Velocity) {
        if self.is_slow(rest, velocity) {
            *velocity = Velocity::zero();
        }
    }

    /// True if it rotates by more than [`LARGE_TURN`] in the step and by more than twice its
    /// initial rotation.
    pub(super) fn turns_too_far(&self, velocity: &Velocity) -> bool {
        let turn = self.time_step * velocity.spin.norm();
        turn > LARGE_TURN && turn > 2.0 * self.time_step * self.old.spin.norm()
    }
}
