//! The moment of a contact: rolling and torsional resistance.
//!
//! The moment m on A about the touching point opposes the angular velocity of A relative to B over the
//! step, Ω = Ω_A − Ω_B, within limits given by the normal force f_n:
//!
//! ```text
//! |m_t| ≤ μ_r f_n,   m_t = −μ_r f_n Ω_t/|Ω_t|   where A rolls, Ω_t ≠ 0,
//! |m_n| ≤ μ_s f_n,   m_n = −μ_s f_n sgn Ω_n     where A spins, Ω_n ≠ 0            (eq. 43)
//! ```
//!
//! Half kicks add an offset o to Ω (eq. 43a), so that the moment opposes the rolling of the instant.
//!
//! Rolling, spinning and sliding have separate limits. Equation numbers refer to
//! `docs/formulation.md`.

use super::law::{project_on_disc, project_on_interval};
use super::{Contact, turning};
use crate::kinematics::StepMap;
use crate::mechanics::quaternion::rotation;
use crate::mechanics::{Pose, State, largest};
use crate::partner::TurningFriction;
use crate::world::World;
use nalgebra::{Matrix3, Vector3};

/// Force and moment of a contact on A.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactLoad {
    /// Force (N, world).
    pub force: Vector3<f64>,
    /// Moment about the touching point (N m, world).
    pub moment: Vector3<f64>,
}

impl From<Vector3<f64>> for ContactLoad {
    /// Force without a moment.
    fn from(force: Vector3<f64>) -> Self {
        Self { force, moment: Vector3::zeros() }
    }
}

/// Scales that make a contact's moment a velocity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MomentScale {
    /// ℓ (m), with w_t = 1.
    pub length: f64,
    /// Response w_n along the normal.
    pub normal: f64,
}

impl Contact {
    /// Coefficients of the moment in `world`.
    pub fn turning_friction(&self, world: &World) -> TurningFriction {
        world.turning_friction_between(self.key.body, self.key.partner)
    }

    /// Angular velocity Ω of A relative to B over the step (rad/s, world). `a` and `b` are the poses at
    /// both ends; `b` is `None` for a fixed partner.
    pub fn relative_turning(
        &self,
        a: [&Pose; 2],
        b: Option<[&Pose; 2]>,
        map: &StepMap,
    ) -> Vector3<f64> {
        turning(a, map) - b.map_or(Vector3::zeros(), |b| turning(b, map))
    }

    /// Angular velocity of A relative to B at `states` (rad/s, world).
    pub(crate) fn turning_at(&self, states: &[State]) -> Vector3<f64> {
        let turning = |body: usize| rotation(&states[body].attitude) * states[body].spin;
        turning(self.key.body) - self.key.partner.body().map_or(Vector3::zeros(), turning)
    }

    /// Scales of the moment, with the rotations of A and B at the start of the step. W_tt and W_nn are
    /// along the tangents and the normal.
    ///
    /// ```text
    /// W = Σ A I⁻¹ Aᵀ,   ½ m_A ℓ² tr W_tt = 1,   w_n = m_A ℓ² W_nn             (eq. 44)
    /// ```
    pub fn moment_scale(
        &self,
        world: &World,
        rotation: impl Fn(usize) -> Matrix3<f64>,
    ) -> MomentScale {
        let mut diagonal = Vector3::zeros();
        for index in self.key.bodies() {
            let axes = rotation(index).tr_mul(&self.frame);
            let turned = world.bodies()[index].inertia_inverse() * axes;
            diagonal += Vector3::from_fn(|k, _| axes.column(k).dot(&turned.column(k)));
        }
        let tangential = 0.5 * (diagonal[0] + diagonal[1]);
        let square = 1.0 / (world.bodies()[self.key.body].mass() * tangential);
        MomentScale { length: square.sqrt(), normal: diagonal[2] / tangential }
    }

    /// Residual of the moment (m/s): the distance of w p_m from its projection on the limits of (43), with
    /// p_m = h m/(m_A ℓ), u_m = ℓ (Ω + o) and the responses w of (44). Zero without turning friction.
    ///
    /// ```text
    /// ‖p_t − Π(p_t − u_t)‖ + |w_n p_n − clamp(w_n p_n − u_n)|                      (eq. 45)
    /// ```
    ///
    /// `load` has force and moment, `turned` is Ω (rad/s).
    pub(super) fn moment_residual(
        &self,
        world: &World,
        a: &Pose,
        b: Option<&Pose>,
        load: &ContactLoad,
        turned: &Vector3<f64>,
    ) -> f64 {
        let own = &world.bodies()[self.key.body];
        let normal = self.normal();
        let rotation =
            |body: usize| if body == self.key.body { a } else { b.unwrap_or(a) }.rotation;
        let scale = self.moment_scale(world, rotation);
        let friction = self.turning_friction(world);
        let impulse = world.time_step() / own.mass();
        let pressing = self.pressing_force(world, &load.force);
        let pressed = impulse * largest(normal.dot(&pressing), 0.0) / scale.length;
        let p = load.moment * (impulse / scale.length);
        let u = (turned + self.turning_offset) * scale.length;
        let p_n = normal.dot(&p);
        let u_n = normal.dot(&u);
        let p_t = p - normal * p_n;
        let u_t = u - normal * u_n;
        let rolling = (p_t - project_on_disc(p_t - u_t, friction.rolling * pressed)).norm();
        let limit = scale.normal * friction.torsional * pressed;
        let torsion = scale.normal * p_n;
        let torsion = torsion - project_on_interval(torsion - u_n, limit);
        rolling + torsion.abs()
    }

    /// Moment on A and its opposite on B, as torques in their frames (N m).
    pub(super) fn moment_torques(
        moment: &Vector3<f64>,
        a: &Pose,
        b: Option<&Pose>,
    ) -> (Vector3<f64>, Vector3<f64>) {
        let on = |pose: &Pose| pose.rotation.tr_mul(moment);
        (on(a), b.map_or(Vector3::zeros(), |b| -on(b)))
    }
}
