//! Friction that depends on the direction.
//!
//! The surface of one owner has an axis a, fixed in it or in a body to which joints connect it, and the factor s
//! of friction along it. With its part a_t in the tangent plane at the start of the step, the tensor
//!
//! ```text
//! T = E − (1 − s) a_t a_tᵀ                                                  (eq. 46)
//! ```
//!
//! scales impulse and motion, p̃ = T⁻¹ p and ũ = T u. They obey the law of the round cone: the limit of
//! friction is an ellipse, and friction does the most work against the slip. Along an axis in the plane the
//! limit is s μ p_n, across it μ p_n. An axis along the normal changes nothing.
//!
//! Equation numbers refer to `docs/formulation.md`.

use super::Contact;
use crate::mechanics::State;
use crate::mechanics::quaternion::rotation;
use crate::world::World;
use nalgebra::{Matrix3, Vector3};

/// T (eq. 46) of a contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrictionTensor {
    /// a: axis at the start of the step (unit, world).
    pub axis: Vector3<f64>,
    /// a_t: its part in the tangent plane (world).
    pub across: Vector3<f64>,
    /// 1 − s.
    pub loss: f64,
}

impl Contact {
    /// T of the contact with bodies at `states`, the start of the step. `None` if friction does not depend
    /// on the direction.
    ///
    /// # Panics
    /// If `states` has no state of the owner of the axis.
    #[inline]
    pub fn friction_tensor(&self, world: &World, states: &[State]) -> Option<FrictionTensor> {
        if world.friction_axes().is_empty() { None } else { self.tensor(world, states) }
    }

    fn tensor(&self, world: &World, states: &[State]) -> Option<FrictionTensor> {
        let index = world.friction_axis_between(self.key.body, self.key.partner)?;
        let of = &world.friction_axes()[index].1;
        let axis = match world.body_of_friction_axis(index) {
            Some(body) => rotation(&states[body].attitude) * of.direction,
            None => of.direction,
        };
        let normal = self.normal();
        let across = axis - normal * normal.dot(&axis);
        Some(FrictionTensor { axis, across, loss: 1.0 - of.factor })
    }
}

impl FrictionTensor {
    /// σ = 1 − (1 − s) |a_t|²: scale along a_t. It is 1 in all directions across.
    pub fn stretch(&self) -> f64 {
        1.0 - self.loss * self.across.norm_squared()
    }

    /// ũ = T u.
    pub fn scaled_motion(&self, u: &Vector3<f64>) -> Vector3<f64> {
        u - self.across * (self.loss * self.across.dot(u))
    }

    /// p̃ = T⁻¹ p.
    pub fn scaled_impulse(&self, p: &Vector3<f64>) -> Vector3<f64> {
        p + self.across * (self.loss / self.stretch() * self.across.dot(p))
    }

    /// Change of T with a change of the axis by `turned` relative to the tangent plane.
    pub fn change(&self, normal: &Vector3<f64>, turned: &Vector3<f64>) -> Matrix3<f64> {
        let moved = turned - normal * normal.dot(turned);
        let half = moved * self.across.transpose() * -self.loss;
        half + half.transpose()
    }

    /// Change of T with the factor s.
    pub fn change_by_factor(&self) -> Matrix3<f64> {
        self.across * self.across.transpose()
    }

    /// The `frame` (t₁, t₂, n), turned about n so that t₁ is along a_t.
    pub fn frame(&self, frame: &Matrix3<f64>) -> Matrix3<f64> {
        let normal = frame.column(2).into_owned();
        match self.across.try_normalize(1e-8) {
            Some(first) => Matrix3::from_columns(&[first, normal.cross(&first), normal]),
            None => *frame,
        }
    }
}
