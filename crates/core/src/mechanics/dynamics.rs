//! Rigid-body dynamics without contact: the continuous equations, the Runge–Kutta integrator of the
//! floating scene ([`Motion::Floating`](crate::simulation::Motion)) and the semi-implicit step.
//!
//! Equation numbers are those of `docs/formulation.md`.

use super::body::RigidBody;
use crate::kinematics::StepMap;
use crate::kinematics::quaternion::attitude_map;
use crate::kinematics::rotation::Rotation;
use crate::kinematics::state::{State, Wrench};
use nalgebra::{Matrix3, SVector, Vector3};

/// Time derivative Ẋ = (ṙ, q̇, v̇, ω̇) of the Newton–Euler equations (eq. 5) under a wrench that
/// includes gravity:
///
/// ```text
/// ṙ = v,  q̇ = ½ L(q) H ω,  v̇ = f/m,  ω̇ = I⁻¹ (τ − ω × I ω)
/// ```
pub fn derivative(body: &RigidBody, state: &State, wrench: &Wrench) -> SVector<f64, 13> {
    let momentum = body.inertia() * state.spin;
    let rate = State {
        position: state.velocity,
        attitude: attitude_map(&state.attitude) * (0.5 * state.spin),
        velocity: wrench.force / body.mass(),
        spin: body.inertia_inverse() * (wrench.torque - state.spin.cross(&momentum)),
    };
    rate.to_vector()
}

/// State after one step of the classical fourth-order Runge–Kutta method (eq. 6) of `time_step`
/// (s). The wrench includes gravity and is constant over the step. The quaternion is normalised at
/// the end.
pub fn rk4_step(body: &RigidBody, state: &State, wrench: &Wrench, time_step: f64) -> State {
    let x = state.to_vector();
    let rate = |x: &SVector<f64, 13>| derivative(body, &State::from_vector(x), wrench);
    let k1 = rate(&x);
    let k2 = rate(&(x + 0.5 * time_step * k1));
    let k3 = rate(&(x + 0.5 * time_step * k2));
    let k4 = rate(&(x + time_step * k3));
    let mut next = State::from_vector(&(x + (time_step / 6.0) * (k1 + 2.0 * k2 + 2.0 * k3 + k4)));
    next.attitude.normalize_mut();
    next
}

/// State after a semi-implicit step of `time_step` (s) without contact forces (eq. 8 with F = 0).
/// Velocities are computed first, then positions from the new velocities. The gyroscopic term of
/// `rotation` is implicit:
///
/// ```text
/// v⁺ = v + h (f/m + g),   I (ω⁺ − ω) + h (G(ω, ω⁺) − τ) = 0,
/// r⁺ = r + h v⁺,          q⁺ = normalise(q + ½ h L(q) H γ ω⁺)
/// ```
///
/// `gravity` is in m/s², world frame.
pub fn free_flight(
    body: &RigidBody,
    state: &State,
    wrench: &Wrench,
    gravity: &Vector3<f64>,
    time_step: f64,
    rotation: Rotation,
) -> State {
    let velocity = state.velocity + time_step * (wrench.force / body.mass() + gravity);
    let equation = SpinEquation { body, spin: &state.spin, torque: &wrench.torque, rotation };
    let spin = free_spin(&equation, time_step);
    State {
        position: state.position + time_step * velocity,
        attitude: StepMap { form: rotation, time_step }.advance(&state.attitude, &spin),
        velocity,
        spin,
    }
}

/// Largest number of Newton iterations, enough for quadratic convergence after damping.
const MOST_SPIN_ITERATIONS: usize = 50;
/// Relative residual below which the iteration is near the solution.
const NEAR_SPIN: f64 = 1e-6;
/// Numbers of continuation steps in h, tried in turn if Newton's method stalls.
const SPIN_CONTINUATIONS: [u32; 4] = [1, 4, 16, 64];

/// Solves I (ω⁺ − ω) + h (G(ω, ω⁺) − τ) = 0 for ω⁺ by Newton's method from ω. If it stalls (h|ω|
/// near 1 with a very slender body), the time step is increased gradually up to h.
///
/// If this fails too, the best ω⁺ is returned, and the certificate of the step shows the residual.
fn free_spin(equation: &SpinEquation<'_>, time_step: f64) -> Vector3<f64> {
    let spin = equation.spin;
    if equation.holds_at_start(time_step) {
        return *spin;
    }
    let mut best = (*spin, f64::INFINITY);
    for parts in SPIN_CONTINUATIONS {
        let (mut u, mut residual) = (*spin, Vector3::zeros());
        for part in 1..=parts {
            let h = time_step * f64::from(part) / f64::from(parts);
            (u, residual) = equation.solve(h, u);
        }
        let residual = residual.norm();
        if residual < best.1 {
            best = (u, residual);
        }
        if residual <= 1e-12 * (spin.norm() + u.norm()) {
            break;
        }
    }
    best.0
}

/// Implicit gyroscopic equation, multiplied by I⁻¹ (rad/s).
struct SpinEquation<'a> {
    body: &'a RigidBody,
    spin: &'a Vector3<f64>,
    torque: &'a Vector3<f64>,
    rotation: Rotation,
}

impl SpinEquation<'_> {
    /// True if ω⁺ = ω to rounding for a torque-free isotropic body. ω × I ω is then a rounding
    /// error of size 2ε |I| |ω|².
    fn holds_at_start(&self, h: f64) -> bool {
        const SLOW: f64 = 0.5;
        self.body.is_isotropic() && *self.torque == Vector3::zeros() && h * self.spin.amax() <= SLOW
    }

    /// Residual with the excess `ended` of the previous spin.
    fn residual(&self, h: f64, ended: &Vector3<f64>, u: &Vector3<f64>) -> Vector3<f64> {
        let gyroscopic = self.rotation.gyroscopic_after(self.body.inertia(), ended, u, h);
        u - self.spin + h * (self.body.inertia_inverse() * (gyroscopic - self.torque))
    }

    /// Damped Newton's method with step halving, until the merit no longer decreases. Returns the
    /// solution and its residual. Near the solution the merit is the residual. Far from it, the
    /// merit is the next Newton step with the same Jacobian, because the thinnest axis dominates
    /// the residual of a slender body.
    fn solve(&self, h: f64, start: Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
        let (inertia, inverse) = (self.body.inertia(), self.body.inertia_inverse());
        let mut u = start;
        let ended = self.rotation.end_excess(inertia, self.spin, h);
        let mut r = self.residual(h, &ended, &u);
        for _ in 0..MOST_SPIN_ITERATIONS {
            if r.amax() <= 4.0 * f64::EPSILON * u.amax() {
                break;
            }
            let slope = self.rotation.gyroscopic_slope(inertia, &u, h);
            let jacobian = Matrix3::identity() + h * (inverse * slope);
            let slopes = jacobian.lu();
            let Some(step) = slopes.solve(&r) else { break };
            let is_near = r.norm() <= NEAR_SPIN * u.norm();
            let falls = |trial: &Vector3<f64>| {
                if is_near {
                    trial.norm() < r.norm()
                } else {
                    slopes.solve(trial).is_some_and(|next| next.norm() < step.norm())
                }
            };
            let shorter = |halvings: i32| u - 0.5_f64.powi(halvings) * step;
            let better = (0..14)
                .map(|halvings| (shorter(halvings), self.residual(h, &ended, &shorter(halvings))))
                .find(|(_, trial)| falls(trial));
            let Some((next, next_r)) = better else { break };
            (u, r) = (next, next_r);
        }
        (u, r)
    }
}

#[cfg(test)]
#[path = "tests/dynamics.rs"]
mod tests;
