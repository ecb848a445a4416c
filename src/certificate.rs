//! The certificate of a step: how far a state, its successor and the contact forces
//! between them are from an exact solution, in m/s, whoever computed them.
//!
//! It is a natural-map residual (eq. 18): zero exactly at the solutions of the
//! hard-contact step with Coulomb's cone and maximum dissipation, and, unlike a
//! product such as f_z z⁺, it cannot be made small by making two errors small. This
//! module knows no solver; [`Simulation`](crate::simulation::Simulation) certifies every step.

use crate::dynamics::rk4_step;
use crate::model::ContactModel;
use crate::quaternion::{advance, rotation};
use crate::state::{State, Wrench};
use nalgebra::{Vector2, Vector3};

/// The five parts of a step's residual, each in m/s.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Certificate {
    /// The equations of motion (eq. 18a); angles are turned into distances by the
    /// body's [reach](crate::body::RigidBody::reach).
    pub dynamics: f64,
    /// max(0, −z⁺)/h: how fast the deepest point went through the ground (eq. 18b).
    pub penetration: f64,
    /// |min(h f_z/m, z⁺/h)|: force without touch, or touch with a pulling force
    /// (eq. 18c).
    pub normal_law: f64,
    /// ‖p − Π(p − m c_xy)‖/m with p = h f_xy: friction that does not oppose the slip
    /// with all it has, or that holds without sticking (eq. 18d).
    pub friction_law: f64,
    /// max(0, h (‖f_xy‖ − μ f_z))/m: friction beyond the cone (eq. 18e).
    pub cone: f64,
}

impl Certificate {
    /// The certificate: the largest part, m/s. NaN if any part is.
    #[must_use]
    pub fn worst(&self) -> f64 {
        self.parts().into_iter().map(|(_, value)| value).fold(0.0, largest)
    }

    /// Which part is the largest.
    #[must_use]
    pub fn worst_part(&self) -> &'static str {
        let worst = self.worst();
        self.parts()
            .into_iter()
            .find(|(_, value)| *value == worst || value.is_nan())
            .map_or("dynamics", |(name, _)| name)
    }

    /// Whether the certificate is no more than the rounding of the states themselves makes
    /// of an exact step: positions are known to 1e-16 of their size, which the division by
    /// h turns into a speed.
    #[must_use]
    pub fn is_rounding(&self, model: &ContactModel, state: &State, next: &State) -> bool {
        let reach = model.body().reach();
        let length = state.position.amax().max(next.position.amax()) + reach;
        // No more than a valid state has: a runaway must not excuse itself.
        let speed = next.velocity.amax().min(1e5) + next.spin.amax().min(1e5) * reach;
        self.worst() <= 1e3 * f64::EPSILON * (length / model.time_step() + speed)
    }

    /// The parts by name.
    #[must_use]
    pub fn parts(&self) -> [(&'static str, f64); 5] {
        [
            ("dynamics", self.dynamics),
            ("penetration", self.penetration),
            ("normal law", self.normal_law),
            ("friction law", self.friction_law),
            ("cone", self.cone),
        ]
    }
}

/// The larger of two numbers, NaN if either is: a NaN must not pass for a small residual.
fn largest(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() { f64::NAN } else { a.max(b) }
}

/// ‖a‖∞, NaN if any entry is.
fn norm_inf<'a>(entries: impl IntoIterator<Item = &'a f64>) -> f64 {
    entries.into_iter().map(|entry| entry.abs()).fold(0.0, largest)
}

/// Certifies the contact step `state` → `next` under the contact forces `forces` (N, one per
/// contact point, ground on body) and the external `wrench` without gravity. States and
/// forces are in the ground's frame ([`crate::plane`]), which on level ground is the world's.
#[must_use]
pub fn certify_contact_step(
    model: &ContactModel,
    state: &State,
    next: &State,
    forces: &[Vector3<f64>],
    wrench: &Wrench,
) -> Certificate {
    let (mass, h) = (model.body().mass(), model.time_step());
    let mut certificate = Certificate {
        dynamics: dynamics_residual(model, state, next, forces, wrench),
        ..Certificate::default()
    };
    let old = model.contact_positions(state);
    let new = model.contact_positions(next);
    for ((old, new), force) in old.zip(new).zip(forces) {
        let slip = (new - old).xy() / h;
        let height_speed = new[2] / h;
        let (tangential, normal) = (h * force.xy(), h * force[2]);

        certificate.penetration = largest(certificate.penetration, largest(0.0, -height_speed));
        // f64::min would drop a NaN.
        let complementarity = -largest(-normal / mass, -height_speed);
        certificate.normal_law = largest(certificate.normal_law, complementarity.abs());
        let radius = model.friction() * largest(normal, 0.0);
        let projected = project_on_disc(tangential - mass * slip, radius);
        let friction_law = (tangential - projected).norm() / mass;
        certificate.friction_law = largest(certificate.friction_law, friction_law);
        let outside = (tangential.norm() - model.friction() * normal) / mass;
        certificate.cone = largest(certificate.cone, largest(0.0, outside));
    }
    certificate
}

/// Certifies a step of the fourth-order Runge–Kutta method, which has no contact: the
/// difference between `next` and the method's own step from `state` under `wrench`, gravity
/// included, scaled as the dynamics part of a contact step.
#[must_use]
pub fn certify_rk4_step(
    model: &ContactModel,
    state: &State,
    next: &State,
    wrench: &Wrench,
) -> Certificate {
    let (h, reach) = (model.time_step(), model.body().reach());
    let exact = rk4_step(model.body(), state, wrench, h);
    let parts = [
        norm_inf(&(exact.position - next.position)) / h,
        norm_inf(&(exact.attitude - next.attitude)) * reach / h,
        norm_inf(&(exact.velocity - next.velocity)),
        norm_inf(&(exact.spin - next.spin)) * reach,
    ];
    Certificate { dynamics: parts.into_iter().fold(0.0, largest), ..Certificate::default() }
}

/// The largest residual of the four equations of motion (eq. 8), m/s.
fn dynamics_residual(
    model: &ContactModel,
    state: &State,
    next: &State,
    forces: &[Vector3<f64>],
    wrench: &Wrench,
) -> f64 {
    let (body, h) = (model.body(), model.time_step());
    let to_body = rotation(&state.attitude).transpose();
    let mut force = wrench.force;
    let mut torque = wrench.torque;
    for (point, f) in body.contact_points().iter().zip(forces) {
        force += f;
        torque += point.position.cross(&(to_body * f));
    }
    let gyroscopic = next.spin.cross(&(body.inertia() * next.spin));

    let position = next.position - state.position - h * next.velocity;
    let attitude = next.attitude - advance(&state.attitude, &next.spin, h);
    let velocity = next.velocity - state.velocity - h * (force / body.mass() + model.gravity());
    let spin = next.spin - state.spin - h * (body.inertia_inverse() * (torque - gyroscopic));
    [
        norm_inf(&position) / h,
        norm_inf(&attitude) * body.reach() / h,
        norm_inf(&velocity),
        norm_inf(&spin) * body.reach(),
    ]
    .into_iter()
    .fold(0.0, largest)
}

/// Π: the nearest point of the disc of `radius` about the origin.
fn project_on_disc(point: Vector2<f64>, radius: f64) -> Vector2<f64> {
    let norm = point.norm();
    if norm > radius { point * (radius / norm) } else { point }
}
