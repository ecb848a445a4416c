//! Angular rows of a joint in a step, and their derivatives with respect to the spins of its
//! bodies.
//!
//! Equation numbers are those of `docs/joints.md`.

mod tangent;

use super::gimbal::{self, nearest};
use super::motion::{crossing, swing, swinging, twist};
use super::{Coordinates, Joint, Middle, TurnKind};
use crate::kinematics::StepMap;
use crate::mechanics::quaternion::{attitude_map, conjugated, left, product, right, rotation};
use nalgebra::{Matrix3, Matrix4x3, Vector3, Vector4};

/// Angular rows of a joint in a step, as functions of the spins ω⁺ of both bodies. With
/// a = ½ h γ Fᵀ ω⁺ (8e) of each body and R at the start of the step,
///
/// ```text
/// E = R* ⊗ (1, −a_B) ⊗ Q_k ⊗ (1, a_A) / √((1 + a_A²)(1 + a_B²))
/// u = ℓ 2 (E_x, E_y, E_z)/h;   hinge: u_z = ℓ 2 atan2(E_z, E_w)/h             (J4)
/// ```
///
/// | rotation | R | rows |
/// |---|---|---|
/// | driven | Q_k | u = ℓ 2 (E_x, E_y, E_z)/h (J18) |
/// | gimbal | ±1 | u = ℓ (α⁺ − α_k, β⁺ − β_k, γ⁺ − γ_k)/h with the angles (J13) of E |
/// | universal | ±1 | the same for α and β; u_z = ℓ 2 (E_x E_y + E_w E_z)/h, the cosine of the angle between its axes |
/// | ball | as for a hinge | u_x = ℓ (σ⁺ − σ_k)/h (J11), σ = 2 atan2(√(E_x² + E_y²), √(E_w² + E_z²)) between its z axes |
#[derive(Debug, Clone, Copy)]
pub(crate) struct Turn {
    turning: TurnKind,
    map: StepMap,
    length: f64,
    /// Rotation Q_k; `back` is R*, and `rest` is R* ⊗ Q_k.
    start: Vector4<f64>,
    back: Vector4<f64>,
    rest: Vector4<f64>,
    /// Swing σ_k of a ball joint (rad).
    swing: f64,
    /// Angles of a gimbal at k without full turns (rad); `middle` is its middle axis.
    angles: Vector3<f64>,
    middle: Middle,
    /// Rotations F of the joint frames of A and B; `None` for the world.
    frames: (Matrix3<f64>, Option<Matrix3<f64>>),
    /// Spins of A and B at k, if the cone's stop acts along its direction at the end of the step
    /// (J21).
    stopped: Option<[Vector3<f64>; 2]>,
}

/// Product q ⊗ (0, v).
fn by_pure(q: &Vector4<f64>, v: &Vector3<f64>) -> Vector4<f64> {
    let ([a, b, c, d], [x, y, z]) = (q.data.0[0], v.data.0[0]);
    Vector4::new(
        -(b * x) - c * y - d * z,
        a * x - d * y + c * z,
        d * x + a * y - b * z,
        b * y - c * x + a * z,
    )
}

/// Product (0, v) ⊗ q.
fn pure_by(v: &Vector3<f64>, q: &Vector4<f64>) -> Vector4<f64> {
    let ([b, c, d], [w, x, y, z]) = (v.data.0[0], q.data.0[0]);
    Vector4::new(
        -(b * x) - c * y - d * z,
        b * w - d * y + c * z,
        c * w + d * x - b * z,
        d * w - c * x + b * y,
    )
}

/// Intermediate values E, n, a_A and a_B of a step.
struct TurnPoint {
    e: Vector4<f64>,
    n: f64,
    a: Vector3<f64>,
    b: Vector3<f64>,
}

impl Turn {
    /// Rows of `joint` at the coordinates `at` and the `angles` (rad), in the step `map`,
    /// scaled by `length` (m).
    pub(crate) fn new(
        joint: &Joint,
        at: &Coordinates,
        angles: &Vector3<f64>,
        map: &StepMap,
        length: f64,
    ) -> Self {
        let ([a, b], middle) = (&joint.frames, joint.middle());
        let angles = match joint.turning() {
            TurnKind::Gimbal | TurnKind::Universal => {
                gimbal::angles(&at.turn, &angles.map(|angle| nearest(angle, 0.0)), &middle)
            }
            _ => Vector3::zeros(),
        };
        let back = conjugated(&twist(joint.turning(), &at.turn));
        Self {
            turning: joint.turning(),
            map: *map,
            length,
            start: at.turn,
            back,
            rest: product(&back, &at.turn),
            swing: if joint.turning() == TurnKind::Ball { swing(&at.turn) } else { 0.0 },
            angles,
            middle,
            frames: (a.rotation(), joint.other.map(|_| b.rotation())),
            stopped: None,
        }
    }

    /// Chooses the direction of a cone's stop, at the spins of A and B at k (rad/s). With g = ∂σ/∂ω
    /// in A's joint frame and the relative spin ω_r there, it is the one with the larger rate
    ///
    /// ```text
    /// g(Q)·ω_r(Q),   ω_r = F_Aᵀ ω_A − A(Q)ᵀ F_Bᵀ ω_B                          (J21)
    /// ```
    ///
    /// at the start, Q = Q_k, or at the end of the step with the spins of k. The stop only pulls
    /// back, so that its power is the smaller one.
    pub(crate) fn with_stop(self, spin: &Vector3<f64>, other: Option<&Vector3<f64>>) -> Self {
        if self.turning != TurnKind::Ball {
            return self;
        }
        let rate = |e: &Vector4<f64>| {
            let mut relative = self.frames.0.tr_mul(spin);
            if let (Some(frame), Some(other)) = (&self.frames.1, other) {
                let turn = product(&conjugated(&self.back), e);
                relative -= rotation(&turn).tr_mul(&frame.tr_mul(other));
            }
            swinging(e).dot(&(attitude_map(e) * relative))
        };
        let ends_larger = rate(&self.at(spin, other).e) > rate(&self.rest);
        let spins = [*spin, other.copied().unwrap_or_default()];
        Self { stopped: ends_larger.then_some(spins), ..self }
    }

    /// Evaluates E as a sum with small terms, which avoids cancellation:
    ///
    /// ```text
    /// E = (R* ⊗ Q_k + R* ⊗ (Q_k ⊗ (0, a_A) − (0, a_B) ⊗ Q_k − (0, a_B) ⊗ Q_k ⊗ (0, a_A)))/n
    /// ```
    fn at(&self, spin: &Vector3<f64>, other: Option<&Vector3<f64>>) -> TurnPoint {
        let half = 0.5 * self.map.time_step;
        let a = self.frames.0.tr_mul(&self.map.stretched(spin)) * half;
        let b = match (&self.frames.1, other) {
            (Some(frame), Some(spin)) => frame.tr_mul(&self.map.stretched(spin)) * half,
            _ => Vector3::zeros(),
        };
        let by_a = by_pure(&self.start, &a);
        let by_b = pure_by(&b, &(self.start + by_a));
        let n = ((1.0 + a.norm_squared()) * (1.0 + b.norm_squared())).sqrt();
        TurnPoint { e: (self.rest + product(&self.back, &(by_a - by_b))) / n, n, a, b }
    }

    /// Rows u (J4) (m/s).
    pub(crate) fn u(&self, spin: &Vector3<f64>, other: Option<&Vector3<f64>>) -> Vector3<f64> {
        let e = self.at(spin, other).e;
        let turned = || libm::atan2(e[3], e[0]);
        let half = match self.turning {
            TurnKind::Locked | TurnKind::Free | TurnKind::Driven => Vector3::new(e[1], e[2], e[3]),
            TurnKind::Hinge => Vector3::new(e[1], e[2], turned()),
            TurnKind::Ball => Vector3::new(0.5 * (swing(&e) - self.swing), e[2], turned()),
            TurnKind::Gimbal => 0.5 * (self.angles_at(&e) - self.angles),
            TurnKind::Universal => {
                let half = 0.5 * (self.angles_at(&e) - self.angles);
                Vector3::new(half[0], half[1], crossing(&e))
            }
        };
        half * (2.0 * self.length / self.map.time_step)
    }

    /// Angles of a gimbal at E.
    fn angles_at(&self, e: &Vector4<f64>) -> Vector3<f64> {
        gimbal::angles(e, &self.angles, &self.middle)
    }

    /// Derivatives ∂u/∂ω_A and ∂u/∂ω_B:
    ///
    /// ```text
    /// ∂E/∂a_A = L(R* ⊗ (1, −a_B) ⊗ Q_k) H/n − E a_Aᵀ/(1 + a_A²)
    /// ∂E/∂a_B = −L(R*) R(Q_k ⊗ (1, a_A)) H/n − E a_Bᵀ/(1 + a_B²),   ∂a/∂ω = ½ h Fᵀ ∂(γ ω)/∂ω
    /// ```
    pub(crate) fn slopes(
        &self,
        spin: &Vector3<f64>,
        other: Option<&Vector3<f64>>,
    ) -> (Matrix3<f64>, Matrix3<f64>) {
        let point = self.at(spin, other);
        let [by_a, by_b] = self.end_slopes(&point);
        let chained =
            |rows: Matrix3<f64>, spin: &Vector3<f64>| self.map.stretch(spin).chained(rows, spin);
        let of_b = self.frames.1.zip(other).map_or(Matrix3::zeros(), |(frame, spin)| {
            chained(self.rows(&point.e, &by_b) * frame.transpose(), spin)
        });
        (chained(self.rows(&point.e, &by_a) * self.frames.0.transpose(), spin), of_b)
    }

    /// Derivatives of E with respect to a_A and a_B.
    fn end_slopes(&self, point: &TurnPoint) -> [Matrix4x3<f64>; 2] {
        let TurnPoint { e, n, a, b } = point;
        let whole = |v: Vector3<f64>| Vector4::new(1.0, v[0], v[1], v[2]);
        let turned = product(&self.back, &product(&whole(-b), &self.start));
        let by_a = attitude_map(&turned) / *n - e * (a / (1.0 + a.norm_squared())).transpose();
        let by_b = self.frames.1.map_or_else(Matrix4x3::zeros, |_| {
            let after = right(&product(&self.start, &whole(*a)));
            -(left(&self.back) * after.fixed_columns::<3>(1)) / *n
                - e * (b / (1.0 + b.norm_squared())).transpose()
        });
        [by_a, by_b]
    }

    /// Derivatives of the rows u from those of E with respect to a.
    fn rows(&self, e: &Vector4<f64>, by: &Matrix4x3<f64>) -> Matrix3<f64> {
        let row = |k: usize| by.row(k).into_owned();
        let turned = || {
            let size = e[0] * e[0] + e[3] * e[3];
            (row(3) * e[0] - row(0) * e[3]) / size
        };
        let angles = || gimbal::slopes(e, self.angles_at(e)[2], &self.middle, by);
        let rows = match self.turning {
            TurnKind::Locked | TurnKind::Free | TurnKind::Driven => [row(1), row(2), row(3)],
            TurnKind::Hinge => [row(1), row(2), turned()],
            TurnKind::Ball => [by.tr_mul(&swinging(e)).transpose(), row(2), turned()],
            TurnKind::Gimbal => angles(),
            TurnKind::Universal => {
                let [alpha, beta, _] = angles();
                [alpha, beta, row(1) * e[2] + row(2) * e[1] + row(3) * e[0] + row(0) * e[3]]
            }
        };
        // The factors 2/h of u and ½ h of a cancel.
        Matrix3::from_rows(&rows) * self.length
    }

    /// True if one axis carries another, so that the directions of the rows depend on the angles.
    pub(crate) fn is_curved(&self) -> bool {
        matches!(self.turning, TurnKind::Gimbal | TurnKind::Universal)
    }

    /// Rates of the rows due to the spins, along the directions at the start of the step.
    pub(crate) fn rates(&self, spin: &Vector3<f64>, other: Option<&Vector3<f64>>) -> Vector3<f64> {
        let still = Vector3::zeros();
        let (by_a, by_b) = self.slopes(&still, Some(&still));
        by_a * spin + other.map_or(still, |spin| by_b * spin)
    }

    /// Torque map G: torque on A (frame of A) of a unit impulse along the rows; the transpose of
    /// ∂u/∂ω_A at zero spins. A cone's stop may act along its direction at the end of the step,
    /// C F_A g with the rotation C of A's frame (J21).
    pub(crate) fn torque_map(&self) -> Matrix3<f64> {
        let mut map = self.frames.0 * self.rows(&self.rest, &attitude_map(&self.rest)).transpose();
        if let Some([spin, other]) = &self.stopped {
            let e = self.at(spin, Some(other)).e;
            let along = self.frames.0 * attitude_map(&e).tr_mul(&swinging(&e));
            map.set_column(0, &(self.turned_on(spin) * along * self.length));
        }
        map
    }

    /// Rotation C of the frame of A in a step with its spin ω (rad/s).
    fn turned_on(&self, spin: &Vector3<f64>) -> Matrix3<f64> {
        let half = self.map.stretched(spin) * (0.5 * self.map.time_step);
        rotation(&Vector4::new(1.0, half[0], half[1], half[2]).normalize())
    }
}
