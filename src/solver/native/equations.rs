//! The equations of one step in impulse form: what is constant during the step (model),
//! and the motion of the contact points as a function of the new velocity.
//!
//! Impulses are divided by the mass, p̂ = h f/m in m/s, so that every unknown is a
//! velocity. Equation numbers are those of `docs/native-solver.md`.

use crate::dynamics::skew;
use crate::model::ContactModel;
use crate::quaternion::rotation;
use crate::solver::Step;
use crate::state::State;
use nalgebra::{Matrix3, Vector3};

/// A contact point that may carry an impulse in this step.
#[derive(Debug, Clone, Copy)]
pub(super) struct Candidate {
    /// Which contact point of the body.
    pub(super) point: usize,
    /// c, m, body.
    pub(super) lever: Vector3<f64>,
    /// A c, m, world.
    arm: Vector3<f64>,
    /// G = [c]× Aᵀ, m: the torque (body) of an impulse (world).
    pub(super) torque_map: Matrix3<f64>,
    /// z/h at step k, m/s.
    pub(super) approach: f64,
    /// ρ_n and ρ_t: the inverse of this point's own normal and mean tangential Delassus
    /// entry, which scale the natural map.
    pub(super) normal_scale: f64,
    pub(super) tangential_scale: f64,
}

/// The new velocities, V = (v⁺, ω⁺).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Velocity {
    /// v⁺, m/s, world.
    pub(super) linear: Vector3<f64>,
    /// ω⁺, rad/s, body.
    pub(super) spin: Vector3<f64>,
}

/// The step's constants.
#[derive(Debug, Clone)]
pub(super) struct StepEquations {
    time_step: f64,
    friction: f64,
    /// ℓ, m.
    reach: f64,
    /// A(q), body → world.
    rotation: Matrix3<f64>,
    /// v + h (f/m + g), m/s.
    free_linear: Vector3<f64>,
    /// ω of free flight, rad/s.
    free_spin: Vector3<f64>,
    /// ω at step k, rad/s.
    old_spin: Vector3<f64>,
    /// Î = I/m, m².
    inertia: Matrix3<f64>,
    /// Î⁻¹.
    inertia_inverse: Matrix3<f64>,
    /// h τ/m of the external torque, m²/s.
    torque_impulse: Vector3<f64>,
    isotropic: bool,
    candidates: Vec<Candidate>,
}

/// Heights within this many roundings of the coordinates they are differences of are
/// zero: below it, the doubles of the state do not tell a plane from a warped one.
const HEIGHT_ROUNDINGS: f64 = 16.0;

impl StepEquations {
    /// Room for the steps of `model`.
    pub(super) fn new(model: &ContactModel) -> Self {
        let body = model.body();
        let inertia = body.inertia() / body.mass();
        Self {
            time_step: model.time_step(),
            friction: model.friction(),
            reach: body.reach(),
            rotation: Matrix3::identity(),
            free_linear: Vector3::zeros(),
            free_spin: Vector3::zeros(),
            old_spin: Vector3::zeros(),
            inertia_inverse: body.inertia_inverse() * body.mass(),
            torque_impulse: Vector3::zeros(),
            isotropic: inertia == Matrix3::from_diagonal_element(inertia[(0, 0)]),
            inertia,
            candidates: Vec::with_capacity(model.contact_count()),
        }
    }

    /// Sets the step's constants; no candidates yet.
    pub(super) fn begin(&mut self, step: &Step<'_>) {
        self.rotation = rotation(&step.state.attitude);
        self.free_linear = step.free.velocity;
        self.free_spin = step.free.spin;
        self.old_spin = step.state.spin;
        self.torque_impulse = step.wrench.torque * (self.time_step / step.model.body().mass());
        self.candidates.clear();
    }

    pub(super) fn candidates(&self) -> &[Candidate] {
        &self.candidates
    }

    /// μ.
    pub(super) fn friction(&self) -> f64 {
        self.friction
    }

    /// The speed of the body's motion before any impulse, m/s: the scale of the step.
    pub(super) fn speed(&self) -> f64 {
        self.free_linear.norm() + self.free_spin.norm() * self.reach
    }

    /// An angular residual of (N1) as the speed of a point at the body's reach, m/s.
    pub(super) fn as_speed(&self, angular: &Vector3<f64>) -> Vector3<f64> {
        self.inertia_inverse * angular * self.reach
    }

    /// Adds contact point `point` as a candidate.
    pub(super) fn admit(&mut self, model: &ContactModel, state: &State, point: usize) {
        let lever = model.body().contact_points()[point].position;
        let arm = self.rotation * lever;
        let height = state.position[2] + arm[2];
        let noise = HEIGHT_ROUNDINGS * f64::EPSILON * (state.position[2].abs() + arm[2].abs());
        let torque_map = skew(&lever) * self.rotation.transpose();
        // The diagonal of W = E + Gᵀ Î⁻¹ G, G = [c]× Aᵀ: this point's Delassus block per
        // unit of mass.
        let response = self.inertia_inverse * torque_map;
        let diagonal = |k: usize| 1.0 + torque_map.column(k).dot(&response.column(k));
        let (normal, tangential) = (diagonal(2), 0.5 * (diagonal(0) + diagonal(1)));
        self.candidates.push(Candidate {
            point,
            lever,
            arm,
            torque_map,
            approach: if height.abs() <= noise { 0.0 } else { height / self.time_step },
            normal_scale: 1.0 / normal,
            tangential_scale: 1.0 / tangential,
        });
    }

    /// V of the impulses p̂, the gyroscopic term as in free flight: the start of an
    /// iteration.
    pub(super) fn velocity_after(&self, impulses: &[Vector3<f64>]) -> Velocity {
        let mut velocity = Velocity { linear: self.free_linear, spin: self.free_spin };
        let mut torque = Vector3::zeros();
        for (candidate, impulse) in self.candidates.iter().zip(impulses) {
            velocity.linear += impulse;
            torque += candidate.torque_map * impulse;
        }
        velocity.spin += self.inertia_inverse * torque;
        velocity
    }

    /// The linear and angular parts of the equations of motion (N1):
    ///
    /// ```text
    /// v⁺ − v_free − Σ p̂,   Î (ω⁺ − ω) + h ω⁺ × Î ω⁺ − h τ/m − Σ [c]× Aᵀ p̂
    /// ```
    pub(super) fn motion_residual(
        &self,
        velocity: &Velocity,
        impulses: &[Vector3<f64>],
    ) -> (Vector3<f64>, Vector3<f64>) {
        let spin = &velocity.spin;
        let mut linear = velocity.linear - self.free_linear;
        let mut angular = self.inertia * (spin - self.old_spin) - self.torque_impulse;
        if !self.isotropic {
            angular += self.time_step * spin.cross(&(self.inertia * spin));
        }
        for (candidate, impulse) in self.candidates.iter().zip(impulses) {
            linear -= impulse;
            angular -= candidate.torque_map * impulse;
        }
        (linear, angular)
    }

    /// ∂(angular part)/∂ω⁺ = Î + h ([ω]× Î − [Î ω]×).
    pub(super) fn angular_slope(&self, spin: &Vector3<f64>) -> Matrix3<f64> {
        if self.isotropic {
            return self.inertia;
        }
        let gyroscopic = skew(spin) * self.inertia - skew(&(self.inertia * spin));
        self.inertia + self.time_step * gyroscopic
    }

    /// What all contact points share of their motion at `velocity` (N2).
    pub(super) fn turning(&self, velocity: &Velocity) -> Turning<'_> {
        let spin = velocity.spin;
        let half = 0.5 * self.time_step;
        let shrink = 1.0 / (1.0 + half * half * spin.norm_squared());
        // K = ([ω]× + (h/2) (ω ωᵀ − ω² E)) / (1 + h²ω²/4)
        let mut sweep = skew(&spin) + half * spin * spin.transpose();
        for k in 0..3 {
            sweep[(k, k)] -= half * spin.norm_squared();
        }
        Turning {
            equations: self,
            linear: velocity.linear,
            spin,
            spin_world: self.rotation * spin,
            half,
            shrink,
            sweep: self.rotation * sweep * shrink,
        }
    }
}

/// The motion of the body's points during the step at one velocity.
///
/// The attitude step turns the body by the Cayley map of h ω/2, so that
///
/// ```text
/// (A(q⁺) − A(q)) c / h = A K c,   K c = (ω × c + (h/2) ω × (ω × c)) / (1 + h²ω²/4)
/// ```
pub(super) struct Turning<'a> {
    equations: &'a StepEquations,
    linear: Vector3<f64>,
    spin: Vector3<f64>,
    /// A ω.
    spin_world: Vector3<f64>,
    /// h/2.
    half: f64,
    /// 1/(1 + h²ω²/4).
    shrink: f64,
    /// A K.
    sweep: Matrix3<f64>,
}

impl Turning<'_> {
    /// u of a candidate (N2): mean tangential velocity over the step and gap speed
    /// z⁺/h, m/s.
    pub(super) fn point_velocity(&self, candidate: &Candidate) -> Vector3<f64> {
        let mut u = self.linear + self.sweep * candidate.lever;
        u[2] += candidate.approach;
        u
    }

    /// ∂u/∂ω⁺ (N3), `u` being the candidate's; ∂u/∂v⁺ is E. With ∂/∂ω (ω × c) = −[c]×,
    /// ∂/∂ω (ω × (ω × c)) = ω cᵀ + (ω·c) E − 2 c ωᵀ and −A [c]× = Gᵀ:
    ///
    /// ```text
    /// ∂u/∂ω = (Gᵀ + (h/2) (A ω cᵀ + (ω·c) A − 2 A c ωᵀ)) / (1 + h²ω²/4)
    ///         − (h²/2) A K c ωᵀ / (1 + h²ω²/4)
    /// ```
    pub(super) fn point_slope(&self, candidate: &Candidate, u: &Vector3<f64>) -> Matrix3<f64> {
        let (half, lever) = (self.half, &candidate.lever);
        let mut swept = u - self.linear;
        swept[2] -= candidate.approach;
        let back = (candidate.arm + half * swept) * (2.0 * half);
        let mut slope = candidate.torque_map.transpose();
        slope += self.spin_world * (half * lever).transpose();
        slope += self.equations.rotation * (half * self.spin.dot(lever));
        slope -= back * self.spin.transpose();
        slope * self.shrink
    }
}
