//! Changes of world constants, converted to changes of bodies and of contact sides.

use crate::derivative::SideChangeInput;
use crate::mechanics::RigidBody;
use crate::solver::native::body_equation::BodyPerturbation;
use crate::world::Constant;
use crate::world::reshape::{Form, FormChange};
use nalgebra::{Matrix3, Vector3, Vector6};
use std::ops::Range;

/// Reference values that changes of a body's constants are relative to.
#[derive(Debug, Clone, Copy)]
pub(super) struct ConstantsBase {
    pub(super) mass: f64,
    pub(super) inertia: Matrix3<f64>,
    /// Dependence of the shape on size and radius; `None` if it cannot change.
    pub(super) form: Option<Form>,
}

impl ConstantsBase {
    pub(super) fn from_body(body: &RigidBody) -> Self {
        Self { mass: body.mass(), inertia: *body.inertia(), form: Form::from_body(body).ok() }
    }
}

/// Changes of constants, addressed by constant and index.
pub(super) struct ConstantChanges<'a, F: Fn(Constant, usize) -> f64> {
    pub(super) shapes: &'a [ConstantsBase],
    pub(super) numbers: &'a F,
}

impl<F: Fn(Constant, usize) -> f64> ConstantChanges<'_, F> {
    /// δm (kg) and δI (kg m²). The inertia scales with the mass.
    pub(super) fn mass(&self, body: usize) -> (f64, Matrix3<f64>) {
        let (shape, of) = (&self.shapes[body], self.numbers);
        let mass = of(Constant::Mass, body);
        let own = Matrix3::from_fn(|i, j| of(Constant::Inertia, 9 * body + 3 * i + j));
        (mass, shape.inertia * (mass / shape.mass) + own)
    }

    /// Change of the body's own equations of motion.
    pub(super) fn body(&self, body: usize) -> BodyPerturbation {
        let of = self.numbers;
        let (mass, inertia) = self.mass(body);
        BodyPerturbation {
            gravity: Vector3::from_fn(|k, _| of(Constant::Gravity, k)),
            mass,
            inertia,
            time_step: of(Constant::TimeStep, 0),
            ..BodyPerturbation::nothing()
        }
    }

    /// Change of one side of a contact.
    pub(super) fn side(&self, body: usize) -> SideChangeInput {
        let (form, of) = (&self.shapes[body].form, self.numbers);
        let (size, radius) = (of(Constant::Size, body), of(Constant::Radius, body));
        let change = form.as_ref().map_or(FormChange::none(), |form| form.change(size, radius));
        let FormChange { stretch, radius, growth } = change;
        SideChangeInput {
            stretch,
            radius,
            growth,
            inertia: self.mass(body).1,
            ..SideChangeInput::nothing()
        }
    }
}

/// Indices of a constant's numbers that enter the body's own equations of motion.
pub(super) fn places(constant: Constant, body: usize) -> Range<usize> {
    match constant {
        Constant::Mass => body..body + 1,
        Constant::Inertia => 9 * body..9 * body + 9,
        Constant::Gravity => 0..3,
        Constant::TimeStep => 0..1,
        _ => 0..0,
    }
}

/// Indices of a constant's numbers that enter through the body's side of a contact. Mass and
/// inertia enter only if the contact `bounces`.
pub(super) fn side_places(constant: Constant, body: usize, bounces: bool) -> Range<usize> {
    match constant {
        Constant::Size | Constant::Radius => body..body + 1,
        Constant::Mass | Constant::Inertia if bounces => places(constant, body),
        _ => 0..0,
    }
}

/// Unit change of one number of one constant.
pub(super) fn unit(constant: Constant, place: usize) -> impl Fn(Constant, usize) -> f64 {
    move |of, at| if of == constant && at == place { 1.0 } else { 0.0 }
}

/// Changes of a joint's anchors, in A and then in B (m).
pub(super) fn anchors_of(joint: usize, of: &impl Fn(Constant, usize) -> f64) -> Vector6<f64> {
    Vector6::from_fn(|k, _| of(Constant::Anchor, 6 * joint + k))
}

/// Adds derivatives with respect to a joint's anchors.
pub(super) fn add_anchors(joint: usize, moved: &Vector6<f64>, sums: &mut [f64]) {
    sums[6 * joint..].iter_mut().zip(moved.iter()).for_each(|(sum, moved)| *sum += moved);
}
