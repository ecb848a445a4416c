//! One contact of the nonlinear program ([`super`]): its constants in a step, and the three
//! components of its motion with derivatives.
//!
//! The components are the coordinates of A's point relative to B, along the tangents t₁, t₂ and the
//! normal n. They depend on the poses at k+1. Forces are in the contact's frame F = (t₁, t₂, n).

use super::component::{
    Curvature, Forms, MotionComponent, PointPair, PosePair, ProgramPose, rows, weighted,
};
use super::ellipsoid::EllipsoidFeatures;
use super::round::RoundFeatures;
use nalgebra::{Matrix2x3, Matrix3, Matrix3x4, Vector2, Vector3, Vector4};
use tumble_core::contact::{Contact, Curved, torque_map_of};
use tumble_core::mechanics::quaternion::{rotated_point_forms, rotation};
use tumble_core::mechanics::{RigidBody, State};

/// One of the two bodies of a contact, with its constants in a step.
#[derive(Debug, Clone)]
pub(crate) struct ProgramSide {
    /// Index of the body in the program.
    pub(crate) body: usize,
    /// ±(h/m) F: derivative of v⁺ with respect to the force (s/kg).
    pub(crate) velocity_per_force: Matrix3<f64>,
    /// ±h I⁻¹ [y]× Aᵀ F: derivative of ω⁺ with respect to the force. y is the touching point (m,
    /// body frame).
    pub(crate) spin_per_force: Matrix3<f64>,
    /// ∂c_j/∂ω⁺ (m): derivative of the two slips c_j with respect to the spin, caused by the
    /// rounding radius. `None` without a radius.
    pub(crate) rolling: Option<Matrix2x3<f64>>,
    /// ±G n (m, body frame): derivative of the separation speed ċ with respect to ω̃ (eq. 29), with
    /// G = [y]× Aᵀ. The derivative with respect to v is ±n.
    pub(crate) lever: Vector3<f64>,
    /// Sign of the force on this body: 1 for A, −1 for B.
    pub(crate) sign: f64,
}

/// A contact of the program: a point of A against a plane of B, or two round features.
#[derive(Debug, Clone)]
pub(crate) struct ProgramContact {
    pub(crate) a: ProgramSide,
    /// Body B. `None` if B is fixed.
    pub(crate) b: Option<ProgramSide>,
    pub(crate) friction: f64,
    /// Normal component at which the gap is zero (m): d + ρ, or ρ_A + ρ_B for two round features.
    offset: f64,
    /// Tangential components at step k (m).
    old: Vector2<f64>,
    /// Point a of A, and the directions t₁, t₂, n in the frame of B. Features with a gap of their
    /// own use the directions in the world frame.
    sight: Sight,
    /// Features with a gap of their own.
    curved: Option<CurvedFeatures>,
    /// Normal n at step k (unit, world).
    pub(crate) normal: Vector3<f64>,
    /// e c_n⁻: least separation speed (m/s, eq. 29). 0 if the contact does not bounce.
    pub(crate) rebound: f64,
}

/// Features with a gap of their own.
#[derive(Debug, Clone)]
enum CurvedFeatures {
    /// Two round features.
    Cores(Box<RoundFeatures>),
    /// An ellipsoid against a plane.
    Ellipsoid(Box<EllipsoidFeatures>),
}

impl CurvedFeatures {
    fn new(contact: &Contact, a: ContactBody<'_>, b: Option<ContactBody<'_>>) -> Option<Self> {
        Some(match contact.features.curved.as_ref()? {
            Curved::Cores(pair) => {
                Self::Cores(Box::new(RoundFeatures::new(pair, contact.normal())))
            }
            Curved::Ellipsoid(one) => {
                let touched = a.state.position + contact.arm;
                let foot = b.map_or(touched, |b| {
                    rotation(&b.state.attitude).tr_mul(&(touched - b.state.position))
                });
                let centre = rotation(&a.state.attitude) * one.shape.centre;
                Self::Ellipsoid(Box::new(EllipsoidFeatures::new(contact, one, foot, &centre)))
            }
        })
    }

    /// The two points whose relative motion is the slip without rotation.
    fn points(&self) -> &PointPair {
        match self {
            Self::Cores(round) => &round.points,
            Self::Ellipsoid(one) => &one.points,
        }
    }

    fn widest(&self) -> &Forms {
        match self {
            Self::Cores(round) => &round.widest,
            Self::Ellipsoid(one) => &one.widest,
        }
    }

    fn component(&self, axis: usize, direction: &Vector3<f64>, at: PosePair) -> MotionComponent {
        match self {
            Self::Cores(round) if axis == 2 => round.distance(at),
            Self::Ellipsoid(one) if axis == 2 => one.distance(at),
            _ => self.points().along(direction, at),
        }
    }

    fn curvature(&self, axis: usize, direction: &Vector3<f64>, at: PosePair) -> Curvature {
        match self {
            Self::Cores(round) if axis == 2 => round.distance_curvature(at),
            Self::Ellipsoid(one) if axis == 2 => one.distance_curvature(at),
            _ => self.points().along_curvature(direction),
        }
    }
}

/// A body of a contact and its state.
#[derive(Clone, Copy)]
pub(crate) struct ContactBody<'a> {
    /// Index of the body in the program.
    pub(crate) place: usize,
    pub(crate) body: &'a RigidBody,
    /// State of the body at step k.
    pub(crate) state: &'a State,
}

impl ProgramContact {
    /// Creates the contact of the bodies `a` and `b` in a step of `time_step` (s). `b` is `None` if
    /// B is fixed.
    pub(crate) fn new(
        contact: &Contact,
        a: ContactBody<'_>,
        b: Option<ContactBody<'_>>,
        time_step: f64,
    ) -> Self {
        let curved = CurvedFeatures::new(contact, a, b);
        // Features with a gap of their own use the tangents of the world.
        let frame = if curved.is_some() { contact.frame } else { contact.features.frame };
        // Rows y × t_j, with y = factor · n for rounded points.
        let rolling = |state: &State, factor: f64| {
            let normal = contact.normal();
            let rate = |axis: usize| match &curved {
                Some(CurvedFeatures::Ellipsoid(one)) => {
                    one.beyond.cross(&contact.frame.column(axis))
                }
                _ => normal.cross(&contact.frame.column(axis)) * factor,
            };
            let turn = rotation(&state.attitude);
            Matrix2x3::from_rows(&[0, 1].map(|axis| turn.tr_mul(&rate(axis)).transpose()))
        };
        let side = |of: ContactBody<'_>, sign: f64, torque_map: Matrix3<f64>| {
            let ContactBody { place, body, state } = of;
            let factor = sign * time_step;
            let torques: Matrix3<f64> = torque_map * contact.frame;
            // Signs of (10a) and (10b): the spin of B subtracts from A's if B has the plane, and
            // adds if both features are round.
            let is_ellipsoid = matches!(contact.features.curved, Some(Curved::Ellipsoid(_)));
            let (rolls, radius) = match (sign > 0.0, &contact.features.curved) {
                (true, _) => (is_ellipsoid, -contact.features.radius),
                (false, None) => (false, contact.features.radius),
                (false, Some(Curved::Cores(pair))) => (false, -pair.radius),
                (false, Some(Curved::Ellipsoid(_))) => (false, 0.0),
            };
            ProgramSide {
                body: place,
                velocity_per_force: contact.frame * (factor / body.mass()),
                spin_per_force: factor * body.inertia_inverse() * torques,
                rolling: (rolls || radius != 0.0).then(|| rolling(state, radius)),
                lever: torque_map * contact.normal() * sign,
                sign,
            }
        };
        let sight = Sight::new(&contact.features.point, &frame);
        let base = match &contact.features.curved {
            Some(Curved::Cores(pair)) => pair.radius,
            _ => contact.features.offset,
        };
        let mut touch = Self {
            a: side(a, 1.0, contact.torque_map),
            b: b.map(|b| side(b, -1.0, torque_map_of_b(contact, a.state, b.state))),
            friction: contact.law.friction,
            offset: base + contact.features.radius,
            normal: contact.normal(),
            rebound: contact.rebound,
            old: Vector2::zeros(),
            sight,
            curved,
        };
        let before =
            PosePair { a: ProgramPose::of(a.state), b: b.map(|b| ProgramPose::of(b.state)) };
        touch.old = Vector2::from_fn(|axis, _| touch.component(axis, before).value);
        touch
    }

    /// Component g of the contact at the poses `at`, for `axis` 0 (t₁), 1 (t₂) or 2 (n).
    ///
    /// It is the coordinate of the point a along this direction (m). For round features it is their
    /// relative position along t₁ or t₂, or their distance.
    pub(crate) fn component(&self, axis: usize, at: PosePair) -> MotionComponent {
        match &self.curved {
            Some(curved) => curved.component(axis, &self.sight.directions[axis], at),
            None => self.sight.component(axis, at),
        }
    }

    /// Second derivatives of [`Self::component`].
    pub(crate) fn curvature(&self, axis: usize, at: PosePair) -> Curvature {
        match &self.curved {
            Some(curved) => curved.curvature(axis, &self.sight.directions[axis], at),
            None => self.sight.curvature(axis, at),
        }
    }

    /// Gap φ (m; eq. 4, 4a) from the normal component.
    pub(crate) fn gap(&self, component: &MotionComponent) -> f64 {
        component.value - self.offset
    }

    /// Tangential displacement since step k (m), from the component along the tangent `axis`.
    pub(crate) fn slipped(&self, axis: usize, component: &MotionComponent) -> f64 {
        component.value - self.old[axis]
    }

    /// True if the contact has a row for the rebound (eq. 25d).
    pub(crate) fn bounces(&self) -> bool {
        self.rebound != 0.0
    }

    /// Body A, and body B unless it is fixed.
    pub(crate) fn sides(&self) -> impl Iterator<Item = &ProgramSide> {
        std::iter::once(&self.a).chain(&self.b)
    }

    /// True for features with a gap of their own, which may be quadratic in positions.
    pub(crate) fn is_round(&self) -> bool {
        self.curved.is_some()
    }

    /// True if entry `k` of ∂g/∂r_A can be non-zero, for the component g of `axis`.
    pub(crate) fn moves(&self, axis: usize, k: usize) -> bool {
        self.b.is_some() || (self.is_round() && axis == 2) || self.sight.moves(axis, k)
    }

    /// True if entry `k` of ∂g/∂q_A can be non-zero, for the component g of `axis`. It is zero for
    /// a point at the centre of mass.
    pub(crate) fn turns(&self, axis: usize, k: usize) -> bool {
        if self.b.is_some() || self.is_round() {
            let curved = self.curved.as_ref();
            let forms = curved.map_or(&self.sight.point_forms, CurvedFeatures::widest);
            return forms.iter().any(|form| form.row(k).amax() > 0.0);
        }
        self.sight.turns(axis, k)
    }
}

/// Components of a point of A along three directions that are fixed in B (eq. 24).
#[derive(Debug, Clone)]
pub(crate) struct Sight {
    /// Directions in the frame of B.
    pub(crate) directions: [Vector3<f64>; 3],
    /// Quadratic forms of the point a (eq. 3).
    point_forms: Forms,
    /// Quadratic forms of the directions.
    direction_forms: [Forms; 3],
}

impl Sight {
    /// Creates the components of `point` of A along the columns of `frame`.
    pub(crate) fn new(point: &Vector3<f64>, frame: &Matrix3<f64>) -> Self {
        let directions = [0, 1, 2].map(|axis| frame.column(axis).into_owned());
        Self {
            directions,
            point_forms: rotated_point_forms(point),
            direction_forms: directions.map(|direction| rotated_point_forms(&direction)),
        }
    }

    /// Component along direction `axis` at the poses `at`.
    pub(crate) fn component(&self, axis: usize, at: PosePair) -> MotionComponent {
        self.seen(axis, at).component()
    }

    /// Second derivatives of [`Self::component`].
    pub(crate) fn curvature(&self, axis: usize, at: PosePair) -> Curvature {
        self.seen(axis, at).curvature(&self.point_forms, &self.direction_forms[axis])
    }

    /// Factors of the component along direction `axis`.
    fn seen(&self, axis: usize, at: PosePair) -> ComponentFactors {
        let (direction, forms) = (&self.directions[axis], &self.direction_forms[axis]);
        ComponentFactors::new(&self.point_forms, direction, forms, at)
    }

    /// True if entry `k` of ∂g/∂r_A can be non-zero for a fixed B.
    pub(crate) fn moves(&self, axis: usize, k: usize) -> bool {
        self.directions[axis][k] != 0.0
    }

    /// True if entry `k` of ∂g/∂q_A can be non-zero for a fixed B.
    pub(crate) fn turns(&self, axis: usize, k: usize) -> bool {
        let weighted = self.point_forms.iter().zip(&self.directions[axis]);
        let weighted = weighted.map(|(form, e)| form.row(k) * *e);
        weighted.fold(Vector4::zeros().transpose(), |sum, row| sum + row).amax() > 0.0
    }
}

/// Factors of a component g = m·s and of its derivatives (eq. D7).
pub(super) struct ComponentFactors {
    /// m: direction in the world.
    direction: Vector3<f64>,
    /// s: point of A relative to the centre of B, or to the origin for a fixed B (m, world).
    apart: Vector3<f64>,
    /// J_A = ∂s/∂q_A.
    turned_a: Matrix3x4<f64>,
    /// J_B = ∂m/∂q_B; zero for a fixed B.
    turned_b: Matrix3x4<f64>,
}

impl ComponentFactors {
    /// Computes the factors for a point of A and a direction of B at the poses `at`. Both are given
    /// by their quadratic forms.
    pub(super) fn new(
        point: &Forms,
        direction: &Vector3<f64>,
        direction_forms: &Forms,
        at: PosePair,
    ) -> Self {
        let PosePair { a, b } = at;
        let turned_a = rows(point, &a.attitude);
        let mut apart = a.position + 0.5 * turned_a * a.attitude;
        let (mut direction, mut turned_b) = (*direction, Matrix3x4::zeros());
        if let Some(b) = b {
            apart -= b.position;
            turned_b = rows(direction_forms, &b.attitude);
            direction = 0.5 * turned_b * b.attitude;
        }
        Self { direction, apart, turned_a, turned_b }
    }

    /// Component and its first derivatives.
    pub(super) fn component(&self) -> MotionComponent {
        MotionComponent {
            value: self.direction.dot(&self.apart),
            by_position: self.direction,
            by_a: self.turned_a.tr_mul(&self.direction),
            by_b: self.turned_b.tr_mul(&self.apart),
        }
    }

    /// Second derivatives of the component:
    ///
    /// ```text
    /// ∂²g/∂q_A² = Σ m_k Q_k(c),   ∂²g/∂q_B² = Σ s_k Q_k(e),
    /// ∂²g/∂r_A ∂q_B = J_B,   ∂²g/∂q_A ∂q_B = J_Aᵀ J_B                     (eq. D8)
    /// ```
    pub(super) fn curvature(&self, point: &Forms, direction: &Forms) -> Curvature {
        Curvature {
            aa: weighted(point, &self.direction),
            bb: weighted(direction, &self.apart),
            position_b: self.turned_b,
            ab: self.turned_a.tr_mul(&self.turned_b),
            ..Curvature::default()
        }
    }
}

/// `[y_B]× A_Bᵀ` (m): map from an impulse at the touching point (world) to its torque (frame of B).
fn torque_map_of_b(contact: &Contact, a: &State, b: &State) -> Matrix3<f64> {
    let rotation = rotation(&b.attitude);
    let arm = a.position + contact.arm - b.position;
    torque_map_of(&rotation.tr_mul(&arm), &rotation)
}
