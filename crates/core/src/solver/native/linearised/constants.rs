//! Changes of constants of the world, as what they change of bodies and of the sides of contacts.

use crate::derivative::SideChangeInput;
use crate::mechanics::RigidBody;
use crate::solver::native::member::BodyGiven;
use crate::world::Constant;
use crate::world::constants::extents;
use nalgebra::{Matrix3, Vector3, Vector6};
use std::ops::Range;

/// What constants of a body are counted from.
#[derive(Debug, Clone, Copy)]
pub(super) struct ConstantsBase {
    pub(super) mass: f64,
    pub(super) inertia: Matrix3<f64>,
    /// Half the extents, m, and the radius.
    pub(super) extents: Vector3<f64>,
    pub(super) radius: f64,
}

impl ConstantsBase {
    pub(super) fn of(body: &RigidBody) -> Self {
        let radius = body.contact_points().iter().map(|point| point.radius).fold(0.0, f64::max);
        let (mass, inertia) = (body.mass(), *body.inertia());
        Self { mass, inertia, extents: extents(body), radius }
    }
}

/// Changes of constants, by their places among the numbers of each.
pub(super) struct ConstantChanges<'a, F: Fn(Constant, usize) -> f64> {
    pub(super) shapes: &'a [ConstantsBase],
    pub(super) numbers: &'a F,
}

impl<F: Fn(Constant, usize) -> f64> ConstantChanges<'_, F> {
    /// δm and δI: inertia goes with the mass.
    pub(super) fn mass(&self, body: usize) -> (f64, Matrix3<f64>) {
        let (shape, of) = (&self.shapes[body], self.numbers);
        let mass = of(Constant::Mass, body);
        let own = Matrix3::from_fn(|i, j| of(Constant::Inertia, 9 * body + 3 * i + j));
        (mass, shape.inertia * (mass / shape.mass) + own)
    }

    /// Of a body by itself.
    pub(super) fn body(&self, body: usize) -> BodyGiven {
        let of = self.numbers;
        let (mass, inertia) = self.mass(body);
        BodyGiven {
            gravity: Vector3::from_fn(|k, _| of(Constant::Gravity, k)),
            mass,
            inertia,
            time_step: of(Constant::TimeStep, 0),
            ..BodyGiven::nothing()
        }
    }

    /// Of the side of a contact: with half the extents a and the radius ρ, a size s and a radius stretch by
    /// (see [`corners`](crate::world::constants::corners))
    ///
    /// ```text
    /// σ = (a δs − δρ)/(a − ρ)
    /// ```
    pub(super) fn side(&self, body: usize) -> SideChangeInput {
        let (shape, of) = (&self.shapes[body], self.numbers);
        let (size, radius) = (of(Constant::Size, body), of(Constant::Radius, body));
        let stretch = if size == 0.0 && radius == 0.0 {
            Vector3::zeros()
        } else {
            shape.extents.map(|a| (a * size - radius) / (a - shape.radius))
        };
        SideChangeInput {
            stretch,
            radius,
            inertia: self.mass(body).1,
            ..SideChangeInput::nothing()
        }
    }
}

/// The places among a constant's numbers that a body has a part in by itself.
pub(super) fn places(constant: Constant, body: usize) -> Range<usize> {
    match constant {
        Constant::Mass => body..body + 1,
        Constant::Inertia => 9 * body..9 * body + 9,
        Constant::Gravity => 0..3,
        Constant::TimeStep => 0..1,
        _ => 0..0,
    }
}

/// Those that it has a part in as the side of a contact, which `bounces` or not.
pub(super) fn side_places(constant: Constant, body: usize, bounces: bool) -> Range<usize> {
    match constant {
        Constant::Size | Constant::Radius => body..body + 1,
        Constant::Mass | Constant::Inertia if bounces => places(constant, body),
        _ => 0..0,
    }
}

/// One number of one constant changes by 1.
pub(super) fn unit(constant: Constant, place: usize) -> impl Fn(Constant, usize) -> f64 {
    move |of, at| if of == constant && at == place { 1.0 } else { 0.0 }
}

/// The changes of the anchors of a joint, in A and in B.
pub(super) fn anchors_of(joint: usize, of: &impl Fn(Constant, usize) -> f64) -> Vector6<f64> {
    Vector6::from_fn(|k, _| of(Constant::Anchor, 6 * joint + k))
}

/// Adds derivatives by them.
pub(super) fn add_anchors(joint: usize, moved: &Vector6<f64>, sums: &mut [f64]) {
    sums[6 * joint..].iter_mut().zip(moved.iter()).for_each(|(sum, moved)| *sum += moved);
}
