//! Motion of an ellipsoid relative to a plane in a step, and its derivative by the velocities of
//! the two bodies.
//!
//! Equation numbers refer to `docs/native-solver.md`.

use super::coupling::Coupling;
use super::pair_motion::beside;
use super::round_motion::RoundSide;
use crate::contact::EllipsoidPoint;
use nalgebra::{Matrix3, Matrix3x6, Vector3};

/// Additional data of a coupling of an ellipsoid and a plane.
#[derive(Debug, Clone, Copy)]
pub(super) struct EllipsoidRows {
    pub(super) point: EllipsoidPoint,
    /// Normal of the plane (frame of B, or world for a fixed plane).
    pub(super) normal: Vector3<f64>,
    /// y: from the centre to the touching point at step k (m, world).
    pub(super) beyond: Vector3<f64>,
    /// c − r_B at step k (m, world).
    pub(super) arm: Vector3<f64>,
    /// Touching point at step k (m, frame of B).
    pub(super) foot: Vector3<f64>,
    /// φ/h at step k (m/s).
    pub(super) approach: f64,
    /// Surface velocity (m/s, world).
    pub(super) carried: Vector3<f64>,
}

/// Motion of an ellipsoid c + S x, |x| ≤ 1, relative to the plane of B.
///
/// n_A is the normal in the frame of A, and n⁺ = A_B⁺ n_B is the normal at the end:
///
/// ```text
/// u_t = (E − n nᵀ) (v_A + A_A K_A c − v_B − A_B K_B b + (A_A ω_A) × y)
/// u_n = (n⁺·(c⁺ − r_B⁺) − n·(c − r_B) − |Sᵀ n_A⁺|_u + |Sᵀ n_A|_u + φ)/h            (N14a)
/// ```
///
/// with the norm of eq. 4c.
/// With a⁺ the nearest point at the end in the frame of A, and b⁺ in the frame of B,
///
/// ```text
/// ∂u_n/∂(v_A, ω_A) = n⁺ᵀ (E, S_A(a⁺)),   ∂u_n/∂(v_B, ω_B) = −n⁺ᵀ (E, S_B(b⁺))
/// ```
pub(super) struct EllipsoidMotion<'a> {
    coupling: &'a Coupling,
    rows: &'a EllipsoidRows,
    a: RoundSide<'a>,
    b: Option<RoundSide<'a>>,
    /// Velocity of the centre relative to the touched point of B (m/s).
    apart: Vector3<f64>,
    /// n⁺.
    normal: Vector3<f64>,
    /// Nearest point at the end, relative to the centre (m, frame of A).
    nearest: Vector3<f64>,
    /// u_n without φ/h (m/s).
    opening: f64,
    time_step: f64,
}

impl<'a> EllipsoidMotion<'a> {
    /// Motion of a coupling in a step of `time_step` (s).
    pub(super) fn new(
        coupling: &'a Coupling,
        rows: &'a EllipsoidRows,
        a: RoundSide<'a>,
        b: Option<RoundSide<'a>>,
        time_step: f64,
    ) -> Self {
        let EllipsoidRows { point, arm, foot, .. } = rows;
        let ellipsoid = &point.shape;
        let start = coupling.rows.normal();
        let mut apart = a.velocity(&ellipsoid.centre);
        // Rates of the normal: (n⁺ − n)/h, and (n_A⁺ − n_A)/h in the frame of A.
        let mut turned = Vector3::zeros();
        let mut local = a.turning.sweep().tr_mul(&start);
        let mut opening = 0.0;
        if let Some(b) = &b {
            turned = b.turning.swept(&rows.normal);
            local += (a.rotation + a.turning.sweep() * time_step).tr_mul(&turned);
            let relative = apart - b.linear;
            opening += turned.dot(&(arm + relative * time_step)) + start.dot(&relative);
            apart -= b.velocity(foot);
        } else {
            opening += start.dot(&apart);
        }
        let before = a.rotation.tr_mul(&start);
        let after = before + local * time_step;
        let half = |n: &Vector3<f64>| ellipsoid.axes.tr_mul(n);
        let (width, was) = (half(&after), half(&before));
        let reach = point.width(&after);
        opening -= reach.beyond(&width, (&was, &point.width(&before))) / time_step;
        // A disc that ends flat keeps its point.
        let toward = if ellipsoid.is_across(&after) { point.toward } else { reach.direction };
        let nearest = -(ellipsoid.axes * toward);
        let normal = start + turned * time_step;
        Self { coupling, rows, a, b, apart, normal, nearest, opening, time_step }
    }

    /// u (N14a) (m/s).
    pub(super) fn u(&self) -> Vector3<f64> {
        let normal = &self.coupling.rows.normal();
        let slip = self.apart + self.a.turning.spin_world().cross(&self.rows.beyond);
        slip - normal * normal.dot(&slip)
            + self.rows.carried
            + normal * (self.opening + self.rows.approach)
    }

    /// ∂u/∂(v_A, ω_A) and ∂u/∂(v_B, ω_B).
    pub(super) fn slopes(&self) -> (Matrix3x6<f64>, Option<Matrix3x6<f64>>) {
        let EllipsoidRows { point, beyond, arm, foot, .. } = self.rows;
        let ellipsoid = &point.shape;
        let (h, normal) = (self.time_step, &self.coupling.rows.normal());
        let along = normal * self.normal.transpose();
        let across = Matrix3::identity() - normal * normal.transpose();
        let slope = |side: &RoundSide<'_>, point: &Vector3<f64>| {
            side.turning.slope_of(side.rotation, point)
        };
        let end = ellipsoid.centre + self.nearest;
        let rolling = beyond.cross_matrix() * self.a.rotation;
        let of_a =
            across * (slope(&self.a, &ellipsoid.centre) - rolling) + along * slope(&self.a, &end);
        let by_a = beside(&(across + along), &of_a);
        let by_b = self.b.as_ref().map(|b| {
            let turned = |side: &RoundSide<'_>| side.rotation + side.turning.sweep() * h;
            let relative = self.a.velocity(&ellipsoid.centre) - b.linear;
            let apart = arm + relative * h + turned(&self.a) * self.nearest;
            let touched = turned(b).tr_mul(&apart);
            let of_b = across * slope(b, foot) + along * slope(b, &touched);
            beside(&-(across + along), &-of_b)
        });
        (by_a, by_b)
    }
}
