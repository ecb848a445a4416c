//! Linearised friction tensor of a contact: change of its impulse with the axis and the factor.
//!
//! The axis a turns with its owner by θ, and the tangent plane by φ. Relative to the plane, the tensor T of
//! (46) changes by the turning (θ − φ) × a. Sliding friction then changes as with the motion T⁻¹ δT u_t of the
//! rows:
//!
//! ```text
//! δp̂ = D T⁻¹ δT u_t + δT T⁻¹ p̂_t                                            (G6b)
//! ```
//!
//! Contacts that stick or are open do not depend on T. Equation numbers refer to `docs/gradients.md`.

use super::slopes::RowsChange;
use crate::contact::{Contact, FrictionTensor};
use crate::step::Step;
use nalgebra::{Matrix3, Vector3};

/// Friction tensor of a sliding contact.
#[derive(Debug, Clone)]
pub(super) struct LinearTensor {
    tensor: FrictionTensor,
    /// Index of the axis in the world.
    pub(super) index: usize,
    /// Body in whose frame the axis is; `None` for the world.
    pub(super) body: Option<usize>,
    /// Side of this body; `None` for the world and for a body that does not touch.
    side: Option<usize>,
    normal: Vector3<f64>,
    /// Rows F along which the gain measures motions.
    from: Matrix3<f64>,
    /// u and p̂ (m/s, world).
    u: Vector3<f64>,
    impulse: Vector3<f64>,
}

impl LinearTensor {
    /// Tensor of a sliding `contact` with the rows `from`, the motion u and the impulse p̂. `None` if
    /// friction does not depend on the direction.
    pub(super) fn new(
        step: &Step<'_>,
        contact: &Contact,
        from: &Matrix3<f64>,
        u: &Vector3<f64>,
        impulse: &Vector3<f64>,
    ) -> Option<Self> {
        let tensor = contact.friction_tensor(step.world, step.states)?;
        let index = step.world.friction_axis_between(contact.key.body, contact.key.partner)?;
        let body = step.world.body_of_friction_axis(index);
        let sides = [Some(contact.key.body), contact.key.partner.body()];
        let side = (0..2).find(|side| body.is_some() && sides[*side] == body);
        let (normal, u) = (contact.normal(), *u);
        Some(Self { tensor, index, body, side, normal, from: *from, u, impulse: *impulse })
    }

    /// Friction impulse over its coefficient, from the `slip` alone: −T w/|w| times `pressed`.
    pub(super) fn along_slip(&self, pressed: f64) -> Vector3<f64> {
        let w = self.tensor.scaled_motion(&self.across(&self.u));
        -self.tensor.scaled_motion(&w.try_normalize(0.0).unwrap_or_default()) * pressed
    }

    fn across(&self, v: &Vector3<f64>) -> Vector3<f64> {
        v - self.normal * self.normal.dot(v)
    }

    /// Change of the rows if the sides turn by `turns` and the normal by `normal` (rad, world).
    pub(super) fn turned(&self, turns: [&Vector3<f64>; 2], normal: &Vector3<f64>) -> RowsChange<1> {
        let own = self.side.map_or(Vector3::zeros(), |side| *turns[side]);
        let turned = (own - normal).cross(&self.tensor.axis);
        self.changed(&self.tensor.change(&self.normal, &turned))
    }

    /// Changes of the rows if a body that does not touch, with its frame at `frame`, turns about its axes
    /// (rad). `None` if the axis is in another frame.
    pub(super) fn by_third_body(&self, frame: &Matrix3<f64>) -> Option<RowsChange<3>> {
        if self.side.is_some() {
            return None;
        }
        let mut changes = RowsChange::<3>::zero();
        for (k, turn) in frame.column_iter().enumerate() {
            let turned = turn.cross(&self.tensor.axis);
            let change = self.changed(&self.tensor.change(&self.normal, &turned));
            changes.motion.set_column(k, &change.motion);
            changes.impulse.set_column(k, &change.impulse);
        }
        Some(changes)
    }

    /// Change of the rows by the factor s.
    pub(super) fn by_factor(&self) -> RowsChange<1> {
        self.changed(&self.tensor.change_by_factor())
    }

    fn changed(&self, change: &Matrix3<f64>) -> RowsChange<1> {
        let motion = self.tensor.scaled_impulse(&(change * self.across(&self.u)));
        let impulse = change * self.tensor.scaled_impulse(&self.across(&self.impulse));
        RowsChange { motion: self.from.tr_mul(&motion), impulse, ..RowsChange::zero() }
    }
}
