//! The equations of one step in impulse form: what is constant during the step (model),
//! and the motion of the contact points as a function of the new velocity.
//!
//! Impulses are divided by the mass, p̂ = h f/m in m/s, so that every unknown is a
//! velocity. Equation numbers are those of `docs/native-solver.md`.

use super::newton::Iterate;
use super::tolerances::{SETTLING, Tolerances};
use crate::contact::Contact;
use crate::mechanics::quaternion::rotation;
use crate::mechanics::{RigidBody, State};
use crate::step::Step;
use crate::world::World;
use nalgebra::{Matrix3, Vector3};

/// A contact that may carry an impulse in this step, as the solver needs it. Vectors are in the
/// world's axes where no frame is named.
#[derive(Debug, Clone, Copy)]
pub(super) struct Candidate {
    /// n.
    pub(super) normal: Vector3<f64>,
    /// (t₁, t₂, n) as columns.
    pub(super) frame: Matrix3<f64>,
    /// y, m, body: the touching point.
    pub(super) lever: Vector3<f64>,
    /// A y, m.
    arm: Vector3<f64>,
    /// a − y, m, body: to the point whose gap counts; zero where nothing is rounded.
    rounding: Vector3<f64>,
    /// G = [y]× Aᵀ, m: the torque (body) of an impulse (world).
    pub(super) torque_map: Matrix3<f64>,
    /// φ/h at step k, m/s.
    pub(super) approach: f64,
    /// μ.
    pub(super) friction: f64,
    /// ρ_n and ρ_t: the inverse of the contact's own response, which scale the natural map.
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
    tolerances: Tolerances,
    /// How much the impulses changed in the steps before, in parts of the largest.
    unsettled: f64,
    candidates: Vec<Candidate>,
}

impl StepEquations {
    /// Room for the steps of `body` in `world`.
    pub(super) fn new(world: &World, body: &RigidBody) -> Self {
        let inertia = *body.specific_inertia();
        Self {
            time_step: world.time_step(),
            reach: body.reach(),
            rotation: Matrix3::identity(),
            free_linear: Vector3::zeros(),
            free_spin: Vector3::zeros(),
            old_spin: Vector3::zeros(),
            inertia_inverse: *body.specific_inertia_inverse(),
            torque_impulse: Vector3::zeros(),
            isotropic: inertia == Matrix3::from_diagonal_element(inertia[(0, 0)]),
            inertia,
            tolerances: Tolerances::of(world, 0.0),
            unsettled: f64::INFINITY,
            candidates: Vec::with_capacity(body.contact_points().len()),
        }
    }

    /// Sets the step's constants for body `index`; no candidates yet.
    pub(super) fn begin(&mut self, step: &Step<'_>, index: usize) {
        let (state, free) = (&step.states[index], &step.free[index]);
        self.rotation = rotation(&state.attitude);
        self.free_linear = free.velocity;
        self.free_spin = free.spin;
        self.old_spin = state.spin;
        let mass = step.world.bodies()[index].mass();
        self.torque_impulse = step.wrenches[index].torque * (self.time_step / mass);
        self.tolerances = Tolerances::of(step.world, self.speed());
        self.candidates.clear();
    }

    pub(super) fn candidates(&self) -> &[Candidate] {
        &self.candidates
    }

    /// The tolerances of the step.
    pub(super) fn tolerances(&self) -> &Tolerances {
        &self.tolerances
    }

    /// How much the impulses changed in the steps before, in parts of the largest.
    pub(super) fn unsettled(&self) -> f64 {
        self.unsettled
    }

    pub(super) fn set_unsettled(&mut self, unsettled: f64) {
        self.unsettled = unsettled;
    }

    /// The residual at which the limit of vanishing compliance is reached: to rounding where
    /// the impulses are settling, because they may be kept for many steps.
    pub(super) fn limit(&self) -> f64 {
        if self.unsettled <= SETTLING { self.tolerances.rounding } else { self.tolerances.exact }
    }

    /// Sets the iterate's velocity to that of its impulses, and of that keeps what is as it was
    /// in `state` to rounding as it was: the spin, the velocity, or its part along a contact's
    /// normal.
    pub(super) fn keep_velocity(&self, state: &State, iterate: &mut Iterate) {
        let exact = self.tolerances.exact;
        let velocity = &mut iterate.velocity;
        if (velocity.spin - state.spin).amax() * self.reach <= exact {
            velocity.spin = state.spin;
        }
        if (velocity.linear - state.velocity).amax() <= exact {
            velocity.linear = state.velocity;
        }
        for candidate in &self.candidates {
            let along = candidate.normal.dot(&(velocity.linear - state.velocity));
            if along.abs() <= exact {
                velocity.linear -= candidate.normal * along;
            }
        }
    }

    /// The speed of the body's motion before any impulse, m/s: the scale of the step.
    pub(super) fn speed(&self) -> f64 {
        self.free_linear.norm() + self.free_spin.norm() * self.reach
    }

    /// An angular residual of (N1) as the speed of a point at the body's reach, m/s.
    pub(super) fn as_speed(&self, angular: &Vector3<f64>) -> Vector3<f64> {
        self.inertia_inverse * angular * self.reach
    }

    /// Adds a contact of the body with the ground.
    pub(super) fn admit(&mut self, contact: &Contact) {
        self.candidates.push(Candidate {
            normal: contact.normal(),
            frame: contact.frame,
            lever: contact.lever,
            arm: contact.arm,
            rounding: contact.features.point - contact.lever,
            torque_map: contact.torque_map,
            approach: contact.gap / self.time_step,
            friction: contact.law.friction,
            normal_scale: 1.0 / contact.response.normal,
            tangential_scale: 1.0 / contact.response.tangential,
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
        let gyroscopic = spin.cross_matrix() * self.inertia - (self.inertia * spin).cross_matrix();
        self.inertia + self.time_step * gyroscopic
    }

    /// What all contact points share of their motion at `velocity` (N2).
    pub(super) fn turning(&self, velocity: &Velocity) -> Turning<'_> {
        let spin = velocity.spin;
        let half = 0.5 * self.time_step;
        let shrink = 1.0 / (1.0 + half * half * spin.norm_squared());
        // K = ([ω]× + (h/2) (ω ωᵀ − ω² E)) / (1 + h²ω²/4)
        let mut sweep = spin.cross_matrix() + half * spin * spin.transpose();
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
    /// u of a candidate (N2): mean tangential velocity over the step, and along the normal
    /// the gap speed φ⁺/h, m/s.
    ///
    /// The gap is that of the point a, the slip that of the touching point y; A K (a − y)
    /// along the normal is what rounding adds to one over the other.
    #[inline]
    pub(super) fn point_velocity(&self, candidate: &Candidate) -> Vector3<f64> {
        let u = self.linear + self.sweep * candidate.lever;
        let mut along = candidate.approach;
        if candidate.rounding != Vector3::zeros() {
            along += candidate.normal.dot(&(self.sweep * candidate.rounding));
        }
        u + candidate.normal * along
    }

    /// ∂u/∂ω⁺ (N3), `u` being the candidate's; ∂u/∂v⁺ is E.
    #[inline]
    pub(super) fn point_slope(&self, candidate: &Candidate, u: &Vector3<f64>) -> Matrix3<f64> {
        let Candidate { normal, lever, arm, rounding, torque_map, .. } = candidate;
        if *rounding == Vector3::zeros() {
            let swept = u - self.linear - normal * candidate.approach;
            return self.swept_slope(lever, arm, torque_map.transpose(), &swept);
        }
        let swept = self.sweep * lever;
        let slope = self.swept_slope(lever, arm, torque_map.transpose(), &swept);
        let rotation = &self.equations.rotation;
        let turned = -rotation * rounding.cross_matrix();
        let swept = self.sweep * rounding;
        let between = self.swept_slope(rounding, &(rotation * rounding), turned, &swept);
        slope + normal * between.tr_mul(normal).transpose()
    }

    /// ∂(A K c)/∂ω⁺ of the body's point c, from A c, −A [c]× and A K c. With
    /// ∂/∂ω (ω × c) = −[c]× and ∂/∂ω (ω × (ω × c)) = ω cᵀ + (ω·c) E − 2 c ωᵀ:
    ///
    /// ```text
    /// (−A [c]× + (h/2) (A ω cᵀ + (ω·c) A − 2 A c ωᵀ)) / (1 + h²ω²/4)
    ///   − (h²/2) A K c ωᵀ / (1 + h²ω²/4)
    /// ```
    #[inline]
    fn swept_slope(
        &self,
        point: &Vector3<f64>,
        arm: &Vector3<f64>,
        turned: Matrix3<f64>,
        swept: &Vector3<f64>,
    ) -> Matrix3<f64> {
        let half = self.half;
        let back = (arm + half * swept) * (2.0 * half);
        let mut slope = turned;
        slope += self.spin_world * (half * point).transpose();
        slope += self.equations.rotation * (half * self.spin.dot(point));
        slope -= back * self.spin.transpose();
        slope * self.shrink
    }
}
