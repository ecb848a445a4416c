//! Motion of the touching point of two bodies in a step, and its derivative by their velocities.
//!
//! Equation numbers refer to `docs/native-solver.md`.

use super::coupling::{Coupling, Lever};
use super::equations::Velocity;
use super::fixed_motion::rolling;
use super::turning::BodyTurning;
use nalgebra::{ArrayStorage, Matrix3, Matrix3x6, Vector3, Vector6};

/// Motion of a pair's touching point, relative to B.
///
/// With s⁺ = r_A⁺ + A_A⁺ a − r_B⁺ and the sweeps K (see [`BodyTurning`]) of A and of B with
/// reversed spin,
///
/// ```text
/// A_B (w⁺ − w)/h = v_A − v_B + A_A K_A a + A_B K_B(−ω_B) A_Bᵀ s⁺            (N10)
/// ```
///
/// This is the motion of the centre of a feature rounded by ρ. The rolling term −ρ (A_A ω_A − A_B
/// ω_B) × n is added.
pub(super) struct PairMotion<'a> {
    coupling: &'a Coupling,
    a: PairSide<'a>,
    b: PairSide<'a>,
    time_step: f64,
    /// v_A − v_B + A_A K_A a (m/s).
    relative: Vector3<f64>,
    /// A_Bᵀ s⁺ (m).
    local: Vector3<f64>,
}

/// One of the two bodies.
#[derive(Clone, Copy)]
pub(super) struct PairSide<'a> {
    /// A(q) at the start of the step, body → world.
    pub(super) rotation: &'a Matrix3<f64>,
    /// Rotation of A, or inverse rotation of B.
    pub(super) turning: &'a BodyTurning,
}

impl<'a> PairMotion<'a> {
    /// Motion of the pair of a coupling in a step of `time_step` (s).
    ///
    /// `arm` is r_A + A_A a − r_B at the start (m, world). `apart` is v_A − v_B at the end (m/s).
    pub(super) fn new(
        coupling: &'a Coupling,
        arm: &Vector3<f64>,
        apart: &Vector3<f64>,
        a: PairSide<'a>,
        b: PairSide<'a>,
        time_step: f64,
    ) -> Self {
        let relative = apart + a.turning.swept(&coupling.lever.centre);
        let local = b.rotation.tr_mul(&(arm + time_step * relative));
        Self { coupling, a, b, time_step, relative, local }
    }

    /// u (N2) (m/s).
    pub(super) fn u(&self) -> Vector3<f64> {
        let normal = &self.coupling.rows.normal();
        let radius = self.coupling.lever.radius;
        let mut u = self.relative + self.b.turning.swept(&self.local);
        if radius > 0.0 {
            // The inverse rotation of B has the spin −ω_B.
            u -= radius * (self.a.turning.spin_world() + self.b.turning.spin_world()).cross(normal);
        }
        u + self.coupling.offset
    }

    /// ∂u/∂(v_A, ω_A) and ∂u/∂(v_B, ω_B).
    ///
    /// With L = E + h A_B K_B(−ω_B) A_Bᵀ,
    ///
    /// ```text
    /// ∂u/∂v_A = L,   ∂u/∂ω_A = L S_A(a),   ∂u/∂v_B = −L,   ∂u/∂ω_B = −S_B(A_Bᵀ s⁺)  (N11)
    /// ```
    ///
    /// and S(c) = ∂(A K c)/∂ω. Rolling adds ±ρ [n]× A to the derivatives by the spins.
    pub(super) fn slopes(&self) -> (Matrix3x6<f64>, Matrix3x6<f64>) {
        let Lever { centre, arm, radius, .. } = &self.coupling.lever;
        let normal = &self.coupling.rows.normal();
        let (of_a, of_b) = (self.a.rotation, self.b.rotation);
        let (turning_a, turning_b) = (self.a.turning, self.b.turning);
        let back = turning_b.sweep() * of_b.transpose() * self.time_step;
        let seen_from = Matrix3::identity() + back;
        let swept = turning_a.swept(centre);
        let turned = -of_a * centre.cross_matrix();
        let mut by_a = seen_from * turning_a.slope(of_a, centre, arm, turned, &swept);
        let mut by_b = -turning_b.slope_of(of_b, &self.local);
        if *radius > 0.0 {
            by_a += rolling(normal, *radius, of_a);
            by_b -= rolling(normal, *radius, of_b);
        }
        (beside(&seen_from, &by_a), beside(&-seen_from, &by_b))
    }
}

/// (L, R).
pub(super) fn beside(left: &Matrix3<f64>, right: &Matrix3<f64>) -> Matrix3x6<f64> {
    let mut both = Matrix3x6::zeros();
    both.fixed_view_mut::<3, 3>(0, 0).copy_from(left);
    both.fixed_view_mut::<3, 3>(0, 3).copy_from(right);
    both
}

/// ∂u/∂V of a coupling of one or two bodies of an island: index and slope of each body.
#[derive(Debug, Clone, Copy)]
pub(super) struct PairSlope {
    pub(super) a: (usize, Matrix3x6<f64>),
    pub(super) b: Option<(usize, Matrix3x6<f64>)>,
}

impl PairSlope {
    /// Slope of a row that no velocity moves.
    pub(super) const NONE: Self =
        Self { a: (0, Matrix3x6::from_array_storage(ArrayStorage([[0.0; 3]; 6]))), b: None };

    #[inline]
    pub(super) fn velocity_change(&self, change: &[Velocity]) -> Vector3<f64> {
        let by = |(index, slope): &(usize, Matrix3x6<f64>)| slope * stacked(&change[*index]);
        by(&self.a) + self.b.as_ref().map_or(Vector3::zeros(), by)
    }
}

/// (δv, δω).
#[inline]
pub(super) fn stacked(velocity: &Velocity) -> Vector6<f64> {
    let (v, w) = (&velocity.linear, &velocity.spin);
    Vector6::new(v[0], v[1], v[2], w[0], w[1], w[2])
}
