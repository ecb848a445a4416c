//! One contact of the program: its constants in a step, and the three components of its motion with
//! derivatives.

use super::component::{Curvature, Forms, MotionComponent, PosePair, ProgramPose, rows, weighted};
use super::round::RoundFeatures;
use nalgebra::{Matrix2x3, Matrix3, Matrix3x4, Vector2, Vector3, Vector4};
use tumble_core::contact::{Contact, torque_map_of};
use tumble_core::mechanics::quaternion::{rotated_point_forms, rotation};
use tumble_core::mechanics::{RigidBody, State};

/// One side of a contact.
#[derive(Debug, Clone)]
pub(crate) struct ProgramSide {
    /// Index of the body in the program.
    pub(crate) body: usize,
    /// ±h/m F: the change of v⁺ by the force in the contact's frame.
    pub(crate) velocity_per_force: Matrix3<f64>,
    /// ±h I⁻¹ [y]× Aᵀ F: the change of ω⁺ by the force.
    pub(crate) spin_per_force: Matrix3<f64>,
    /// ∂c_j/∂ω⁺: contribution of the spin to the slips of a rounded feature; `None` without a
    /// radius.
    pub(crate) rolling: Option<Matrix2x3<f64>>,
    /// ±G n, m, body frame: ∂ċ/∂ω̃ (eq. 29). ∂ċ/∂v is ±n.
    pub(crate) lever: Vector3<f64>,
    /// Sign of the force on this side: ±1.
    pub(crate) sign: f64,
}

/// A contact in the program.
#[derive(Debug, Clone)]
pub(crate) struct ProgramContact {
    pub(crate) a: ProgramSide,
    /// Side B, unless it is fixed.
    pub(crate) b: Option<ProgramSide>,
    pub(crate) friction: f64,
    /// d + ρ, m; for round features ρ_A + ρ_B.
    offset: f64,
    /// Tangential coordinates of the feature's centre at step k, seen from B, m.
    old: Vector2<f64>,
    /// Point a along t₁, t₂ and n in the frame of B; for round features in the world frame.
    sight: Sight,
    /// Round features, if both are round.
    round: Option<RoundFeatures>,
    /// Normal n, world, at step k.
    pub(crate) normal: Vector3<f64>,
    /// e c_n⁻, m/s (eq. 29); 0 if the contact does not bounce.
    pub(crate) rebound: f64,
}

/// A body of a contact.
#[derive(Clone, Copy)]
pub(crate) struct ContactBody<'a> {
    /// Index of the body in the program.
    pub(crate) place: usize,
    pub(crate) body: &'a RigidBody,
    /// State of the body at step k.
    pub(crate) state: &'a State,
}

impl ProgramContact {
    /// Creates the contact `contact` of the bodies `a` and `b` in a step of `time_step`.
    pub(crate) fn new(
        contact: &Contact,
        a: ContactBody<'_>,
        b: Option<ContactBody<'_>>,
        time_step: f64,
    ) -> Self {
        let round = RoundFeatures::new(contact);
        // Round features use the tangents of the world.
        let frame = if round.is_some() { contact.frame } else { contact.features.frame };
        let rolling = |state: &State, factor: f64| {
            let normal = contact.normal();
            let rate = |axis: usize| normal.cross(&contact.frame.column(axis)) * factor;
            let turn = rotation(&state.attitude);
            Matrix2x3::from_rows(&[0, 1].map(|axis| turn.tr_mul(&rate(axis)).transpose()))
        };
        let side = |of: ContactBody<'_>, sign: f64, torque_map: Matrix3<f64>| {
            let ContactBody { place, body, state } = of;
            let factor = sign * time_step;
            let torques: Matrix3<f64> = torque_map * contact.frame;
            // The spin of B subtracts if B has the plane, and adds if B has a round feature.
            let radius = match (sign > 0.0, &contact.features.curved) {
                (true, _) => -contact.features.radius,
                (false, None) => contact.features.radius,
                (false, Some(curved)) => -curved.radius,
            };
            ProgramSide {
                body: place,
                velocity_per_force: contact.frame * (factor / body.mass()),
                spin_per_force: factor * body.inertia_inverse() * torques,
                rolling: (radius != 0.0).then(|| rolling(state, radius)),
                lever: torque_map * contact.normal() * sign,
                sign,
            }
        };
        let sight = Sight::new(&contact.features.point, &frame);
        let base = match &contact.features.curved {
            Some(curved) => curved.radius,
            None => contact.features.offset,
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
            round,
        };
        let before =
            PosePair { a: ProgramPose::of(a.state), b: b.map(|b| ProgramPose::of(b.state)) };
        touch.old = Vector2::from_fn(|axis, _| touch.component(axis, before).value);
        touch
    }

    /// Component of the point a along t₁, t₂ or n at the poses `at`. For round features: their
    /// relative position along t₁ and t₂, and their distance.
    pub(crate) fn component(&self, axis: usize, at: PosePair) -> MotionComponent {
        match &self.round {
            Some(round) if axis == 2 => round.distance(at),
            Some(round) => round.along(&self.sight.directions[axis], at),
            None => self.sight.component(axis, at),
        }
    }

    /// Second derivatives of [`Self::component`].
    pub(crate) fn curvature(&self, axis: usize, at: PosePair) -> Curvature {
        match &self.round {
            Some(round) if axis == 2 => round.distance_curvature(at),
            Some(round) => round.along_curvature(&self.sight.directions[axis]),
            None => self.sight.curvature(axis, at),
        }
    }

    /// Gap φ (eq. 4, 4a) from the normal component.
    pub(crate) fn gap(&self, component: &MotionComponent) -> f64 {
        component.value - self.offset
    }

    /// Tangential displacement of the feature's centre, m, from the component along a tangent.
    pub(crate) fn slipped(&self, axis: usize, component: &MotionComponent) -> f64 {
        component.value - self.old[axis]
    }

    /// True if the contact has the rebound row.
    pub(crate) fn bounces(&self) -> bool {
        self.rebound != 0.0
    }

    /// Side A, and side B unless it is fixed.
    pub(crate) fn sides(&self) -> impl Iterator<Item = &ProgramSide> {
        std::iter::once(&self.a).chain(&self.b)
    }

    /// True if both features are round, so that the gap is quadratic in positions.
    pub(crate) fn is_round(&self) -> bool {
        self.round.is_some()
    }

    /// True if component `k` of ∂g/∂r_A can be non-zero.
    pub(crate) fn moves(&self, axis: usize, k: usize) -> bool {
        self.b.is_some() || (self.is_round() && axis == 2) || self.sight.moves(axis, k)
    }

    /// True if component `k` of ∂g/∂q_A can be non-zero. It is zero for a point at the centre of
    /// mass.
    pub(crate) fn turns(&self, axis: usize, k: usize) -> bool {
        if self.b.is_some() || self.is_round() {
            let forms = self.round.as_ref().map_or(&self.sight.point_forms, |round| &round.widest);
            return forms.iter().any(|form| form.row(k).amax() > 0.0);
        }
        self.sight.turns(axis, k)
    }
}

/// A point of A along three directions of B, which may be fixed.
#[derive(Debug, Clone)]
pub(crate) struct Sight {
    /// Directions in the frame of B.
    pub(crate) directions: [Vector3<f64>; 3],
    /// Forms of the point a.
    point_forms: Forms,
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

    fn seen(&self, axis: usize, at: PosePair) -> ComponentFactors {
        let (direction, forms) = (&self.directions[axis], &self.direction_forms[axis]);
        ComponentFactors::new(&self.point_forms, direction, forms, at)
    }

    /// True if component `k` of ∂g/∂r_A can be non-zero for a fixed B.
    pub(crate) fn moves(&self, axis: usize, k: usize) -> bool {
        self.directions[axis][k] != 0.0
    }

    /// True if component `k` of ∂g/∂q_A can be non-zero for a fixed B.
    pub(crate) fn turns(&self, axis: usize, k: usize) -> bool {
        let weighted = self.point_forms.iter().zip(&self.directions[axis]);
        let weighted = weighted.map(|(form, e)| form.row(k) * *e);
        weighted.fold(Vector4::zeros().transpose(), |sum, row| sum + row).amax() > 0.0
    }
}

/// Factors m, s, J_A and J_B of a component seen from B (eq. D7).
pub(super) struct ComponentFactors {
    direction: Vector3<f64>,
    apart: Vector3<f64>,
    turned_a: Matrix3x4<f64>,
    turned_b: Matrix3x4<f64>,
}

impl ComponentFactors {
    /// Computes the factors of a point of A and a direction of B, both by their forms, at the poses
    /// `at`.
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

/// `[y_B]× A_Bᵀ`: the torque (frame of B) of an impulse (world) at the touching point.
fn torque_map_of_b(contact: &Contact, a: &State, b: &State) -> Matrix3<f64> {
    let rotation = rotation(&b.attitude);
    let arm = a.position + contact.arm - b.position;
    torque_map_of(&rotation.tr_mul(&arm), &rotation)
}
