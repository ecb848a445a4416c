//! Derivatives of the angular rows of a joint with respect to its bodies' attitudes at the start of
//! a step, at fixed spins at its end.
//!
//! Equation numbers are those of `docs/gradients.md`.

use super::{Turn, TurnKind, TurnPoint, right};
use crate::mechanics::quaternion::{attitude_map, left, product, rotation_vector, turn_slope};
use nalgebra::{Matrix3, Matrix4, Matrix4x3, RowVector3, Vector3, Vector4};

/// Lower bound of the norm of a pair, so that derivatives stay finite.
const LEAST: f64 = 1e-12;

/// Derivatives of the angular rows at fixed ω⁺, with respect to rotations of A and of B at the
/// start of the step. Rotations are in rad, in each body's frame.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TurnTangent {
    /// Derivative of u (J4) (m/s).
    pub(crate) motion: [Matrix3<f64>; 2],
    /// Derivative of the counted angles (rad).
    pub(crate) angles: [Matrix3<f64>; 2],
    /// Derivative of the torque G p on A (frame of A) at a fixed impulse along the rows.
    pub(crate) torque: [Matrix3<f64>; 2],
    /// Derivative ∂u/∂h (m/s²).
    pub(crate) by_time_step: Vector3<f64>,
    /// Further derivatives of G p if a cone's stop acts along its direction at the end of the step.
    pub(crate) stop: Option<StopTangent>,
}

/// Derivatives of the torque G p of a cone's stop on A (frame of A) at a fixed impulse, if its
/// direction is that of the end of the step (J21).
#[derive(Debug, Clone, Copy)]
pub(crate) struct StopTangent {
    /// Derivatives with respect to the spins of A and B at k.
    pub(crate) spins: [Matrix3<f64>; 2],
    /// Derivative with respect to h.
    pub(crate) time_step: Vector3<f64>,
    /// Derivatives with respect to rotations of A and B at the start, like [`TurnTangent::torque`].
    turns: [Matrix3<f64>; 2],
}

/// Matrix of the conjugation q → q*.
fn conjugation() -> Matrix4<f64> {
    Matrix4::from_diagonal(&Vector4::new(1.0, -1.0, -1.0, -1.0))
}

/// Function of (w, x, y, z) at a point, with its first and second derivatives.
#[derive(Clone, Copy)]
struct Jet {
    value: f64,
    slope: Vector4<f64>,
    bend: Matrix4<f64>,
}

impl Jet {
    fn linear(form: Vector4<f64>, at: &Vector4<f64>) -> Self {
        Self { value: form.dot(at), slope: form, bend: Matrix4::zeros() }
    }

    /// One of the four components.
    fn number(k: usize, at: &Vector4<f64>) -> Self {
        Self::linear(Vector4::ith(k, 1.0), at)
    }

    fn times(self, factor: f64) -> Self {
        Self { value: self.value * factor, slope: self.slope * factor, bend: self.bend * factor }
    }

    fn plus(self, other: Self) -> Self {
        Self {
            value: self.value + other.value,
            slope: self.slope + other.slope,
            bend: self.bend + other.bend,
        }
    }

    /// Norm √(x² + y²). If both vanish, the gradient in the direction of x is used.
    fn size(x: &Self, y: &Self) -> Self {
        let value = libm::hypot(x.value, y.value);
        if value < LEAST {
            return Self { value, slope: x.slope, bend: Matrix4::zeros() };
        }
        let slope = (x.slope * x.value + y.slope * y.value) / value;
        let bend = x.slope * x.slope.transpose() + y.slope * y.slope.transpose()
            - slope * slope.transpose()
            + x.bend * x.value
            + y.bend * y.value;
        Self { value, slope, bend: bend / value }
    }

    /// Argument arg (x, y) = atan2 (y, x):
    ///
    /// ```text
    /// g = (x ∇y − y ∇x)/r²,   H = (∇y ∇xᵀ − ∇x ∇yᵀ − 2 g (x ∇x + y ∇y)ᵀ + x H_y − y H_x)/r²
    /// ```
    fn argument(x: &Self, y: &Self) -> Self {
        let size = (x.value * x.value + y.value * y.value).max(LEAST * LEAST);
        let slope = (y.slope * x.value - x.slope * y.value) / size;
        let outward = x.slope * x.value + y.slope * y.value;
        let bend = y.slope * x.slope.transpose()
            - x.slope * y.slope.transpose()
            - slope * outward.transpose() * 2.0
            + y.bend * x.value
            - x.bend * y.value;
        Self { value: libm::atan2(y.value, x.value), slope, bend: bend / size }
    }
}

impl Turn {
    /// Half angles of the rows (J4) as functions of E.
    fn halves(&self, e: &Vector4<f64>) -> [Jet; 3] {
        let number = |k: usize| Jet::number(k, e);
        let turned = || Jet::argument(&number(0), &number(3));
        match self.turning {
            TurnKind::Locked | TurnKind::Free | TurnKind::Driven => {
                [number(1), number(2), number(3)]
            }
            TurnKind::Hinge => [number(1), number(2), turned()],
            TurnKind::Ball => {
                let along = Jet::size(&number(0), &number(3));
                let aside = Jet::size(&number(1), &number(2));
                [Jet::argument(&along, &aside), number(2), turned()]
            }
            TurnKind::Gimbal => self.half_angles(e),
            TurnKind::Universal => {
                let [alpha, beta, _] = self.half_angles(e);
                // E_x E_y + E_w E_z.
                let slope = Vector4::new(e[3], e[2], e[1], e[0]);
                let mut bend = Matrix4::zeros();
                for (row, column) in [(0, 3), (1, 2), (2, 1), (3, 0)] {
                    bend[(row, column)] = 1.0;
                }
                [alpha, beta, Jet { value: super::crossing(e), slope, bend }]
            }
        }
    }

    /// Half angles ½ (α, β, γ) of (J14), up to a constant.
    fn half_angles(&self, e: &Vector4<f64>) -> [Jet; 3] {
        let pair = |x: [f64; 4], y: [f64; 4]| {
            (Jet::linear(Vector4::from(x), e), Jet::linear(Vector4::from(y), e))
        };
        let sum = pair([1.0, 0.0, 0.0, 1.0], [0.0, 1.0, 1.0, 0.0]);
        let difference = pair([1.0, 0.0, 0.0, -1.0], [0.0, -1.0, 1.0, 0.0]);
        let outer = Jet::argument(&sum.0, &sum.1).times(0.5);
        let inner = Jet::argument(&difference.0, &difference.1).times(0.5);
        let (a, b) = (Jet::size(&sum.0, &sum.1), Jet::size(&difference.0, &difference.1));
        let side = super::gimbal::side(self.angles_at(e)[2], &self.middle);
        let along = Jet::argument(&b, &a).times(side);
        [outer.plus(inner.times(-1.0)), outer.plus(inner), along]
    }

    /// True if row k is relative to its value at the start of the step.
    fn counts(&self, k: usize) -> bool {
        match self.turning {
            TurnKind::Ball => k == 0,
            TurnKind::Gimbal => true,
            TurnKind::Universal => k < 2,
            TurnKind::Locked | TurnKind::Free | TurnKind::Driven | TurnKind::Hinge => false,
        }
    }

    /// Derivatives of Q with respect to rotations of A and of B (rad, in each body's frame).
    fn attitudes(&self) -> [Matrix4x3<f64>; 2] {
        let by_b = self.frames.1.map_or_else(Matrix4x3::zeros, |frame| {
            right(&self.start).fixed_columns::<3>(1) * frame.transpose() * -0.5
        });
        [attitude_map(&self.start) * self.frames.0.transpose() * 0.5, by_b]
    }

    /// Rotation of a driven free joint since `before`, w = 2 Im(P* ⊗ Q) (J18) (rad). Also returns
    /// its derivatives with respect to rotations of A and of B, at present and at `before`:
    ///
    /// ```text
    /// δw = 2 Im(P* ⊗ δQ + δP* ⊗ Q)
    /// ```
    pub(crate) fn turned_since(&self, before: &Self) -> (Vector3<f64>, [[Matrix3<f64>; 2]; 2]) {
        let from = conjugation() * before.start;
        let way = product(&from, &self.start);
        let sign = 2.0_f64.copysign(way[0]);
        let now = left(&from);
        let then = right(&self.start) * conjugation();
        let imaginary = |of: Matrix4x3<f64>| -> Matrix3<f64> { of.fixed_rows::<3>(1) * sign };
        let now = self.attitudes().map(|turned| imaginary(now * turned));
        let then = before.attitudes().map(|turned| imaginary(then * turned));
        (way.fixed_rows::<3>(1) * sign, [now, then])
    }

    /// Derivatives of the rows with respect to rotations of the bodies at the start of the step, at
    /// these final spins (rad/s) and with an impulse `along` the rows.
    ///
    /// Let α and β be the rotation vectors of A and B in their joint frames, and φ the half angles
    /// of (J4). Joints with a twist have ψ = ½ θ. Then
    ///
    /// ```text
    /// δQ = ½ (Q ⊗ (0, α) − (0, β) ⊗ Q),   δψ = (w δz − z δw)/(w² + z²)
    /// δE = R* ⊗ (1, −a_B) ⊗ δQ ⊗ (1, a_A)/n − δψ (0, 0, 0, 1) ⊗ E
    /// δu = ℓ 2/h (∇φ(E) δE − ∇φ(E₀) δE₀ for rows relative to E₀ = R* ⊗ Q)
    /// δ(G p) = ℓ F_A ((L(δE₀) H)ᵀ g + (L(E₀) H)ᵀ ∇g δE₀),   g = Σ p_k ∇φ_k(E₀)             (G9)
    /// ```
    ///
    /// A driven free rotation is relative to Q, along A's axes for any Q:
    ///
    /// ```text
    /// δE = Q* ⊗ (1, −a_B) ⊗ δQ ⊗ (1, a_A)/n + δQ* ⊗ Q ⊗ E,   δE₀ = 0                     (G18)
    /// ```
    pub(crate) fn tangent(
        &self,
        spin: &Vector3<f64>,
        other: Option<&Vector3<f64>>,
        along: &Vector3<f64>,
    ) -> TurnTangent {
        let TurnPoint { e, n, a, b } = self.at(spin, other);
        let (h, length, q) = (self.map.time_step, self.length, &self.start);
        let whole = |v: Vector3<f64>| Vector4::new(1.0, v[0], v[1], v[2]);
        let back = left(&self.back);
        // R* ⊗ (1, −a_B) ⊗ · ⊗ (1, a_A)/n as a matrix.
        let moved = back * left(&whole(-b)) * right(&whole(a)) / n;
        let at_end = self.halves(&e);
        let at_start = self.halves(&self.rest);
        let stop = self.stop_tangent(along[0]);
        let start_along =
            if stop.is_some() { Vector3::new(0.0, along[1], along[2]) } else { *along };
        // g and its slope: Σ p_k φ_k at the start.
        let pushed = at_start.iter().zip(&start_along).map(|(half, p)| half.times(*p));
        let nothing = Jet::linear(Vector4::zeros(), &self.rest);
        let pushed = pushed.fold(nothing, Jet::plus);
        let rolled = |of: &Vector4<f64>| Vector4::new(-of[3], -of[2], of[1], of[0]);
        let twists = matches!(self.turning, TurnKind::Hinge | TurnKind::Ball);
        // Term of the conjugate of δQ with Q ⊗ E, and the derivative of the rotation vector φ from
        // twice the component of Q* ⊗ δQ along A's axes.
        let driven = (self.turning == TurnKind::Driven).then(|| {
            let counted_from = right(&product(q, &e)) * conjugation();
            (counted_from, turn_slope(&rotation_vector(q)) * back.fixed_rows::<3>(1) * 2.0)
        });
        let about = q[0] * q[0] + q[3] * q[3];
        // (G9) for the rotations of one body.
        let of_side = |turned: &Matrix4x3<f64>| {
            let mut twisted = RowVector3::zeros();
            if twists && about > 0.0 {
                twisted = (turned.row(3) * q[0] - turned.row(0) * q[3]) / about;
            }
            let mut end = moved * turned - rolled(&e) * twisted;
            let mut start = back * turned - rolled(&self.rest) * twisted;
            let (mut motion, mut angles) = (Matrix3::zeros(), Matrix3::zeros());
            if let Some((counted_from, by_turn)) = &driven {
                end += counted_from * turned;
                start = Matrix4x3::zeros();
                angles = by_turn * turned;
            }
            // δu, and the change of the coordinate of rows counted from the start.
            for k in 0..3 {
                let mut row = at_end[k].slope.transpose() * end;
                if self.counts(k) {
                    let counted = at_start[k].slope.transpose() * start;
                    angles.set_row(k, &(counted * 2.0));
                    row -= counted;
                }
                motion.set_row(k, &(row * (2.0 * length / h)));
            }
            if twists {
                angles.set_row(2, &(twisted * 2.0));
            }
            // δ(G p)
            let mut torque = attitude_map(&self.rest).tr_mul(&(pushed.bend * start));
            for k in 0..3 {
                let lever = attitude_map(&start.column(k).into_owned());
                let mut column = torque.column_mut(k);
                column += lever.tr_mul(&pushed.slope);
            }
            (motion, angles, self.frames.0 * torque * length)
        };
        let [by_a, by_b] = self.attitudes();
        let of_a = of_side(&by_a);
        let of_b = self.frames.1.map(|_| of_side(&by_b));
        let zero = Matrix3::zeros();
        let of_b = of_b.unwrap_or((zero, zero, zero));
        let (by_spin, by_other) = self.slopes(spin, other);
        let turned = by_spin * spin + other.map_or(Vector3::zeros(), |other| by_other * other);
        let stopped = stop.map_or([zero; 2], |stop| stop.turns);
        TurnTangent {
            motion: [of_a.0, of_b.0],
            angles: [of_a.1, of_b.1],
            torque: [of_a.2 + stopped[0], of_b.2 + stopped[1]],
            by_time_step: (turned - self.u(spin, other)) / h,
            stop,
        }
    }

    /// Derivatives of the torque of a cone's stop with the impulse `p`, along its direction at the
    /// end of the step. With w = ½ h γ ω_A (8e) and t = ℓ p C F_A g (J21),
    ///
    /// ```text
    /// δt = ℓ p C F_A δg + 2/(1 + w²) (δw + w × δw) × t                              (G20)
    /// ```
    fn stop_tangent(&self, p: f64) -> Option<StopTangent> {
        let [spin, other] = &self.stopped?;
        let point = self.at(spin, Some(other));
        let TurnPoint { e, n, a, b } = &point;
        let half = self.halves(e)[0].times(p * self.length);
        let to_a = self.turned_on(spin) * self.frames.0;
        let torque = to_a * attitude_map(e).tr_mul(&half.slope);
        // Change of the torque by columns of δE.
        let by_end = |end: &Matrix4x3<f64>| {
            let mut slopes = attitude_map(e).tr_mul(&(half.bend * end));
            for k in 0..3 {
                let lever = attitude_map(&end.column(k).into_owned());
                let mut column = slopes.column_mut(k);
                column += lever.tr_mul(&half.slope);
            }
            to_a * slopes
        };
        let whole = |v: Vector3<f64>| Vector4::new(1.0, v[0], v[1], v[2]);
        let moved = left(&self.back) * left(&whole(-b)) * right(&whole(*a)) / *n;
        let turns = self.attitudes().map(|turned| by_end(&(moved * turned)));
        let h = self.map.time_step;
        let ends = self.end_slopes(&point);
        let frames = [Some(self.frames.0), self.frames.1];
        let mut spins = [Matrix3::zeros(); 2];
        let stretches = [spin, other].map(|spin| self.map.stretch(spin).slope(spin));
        for (((spins, end), frame), stretch) in
            spins.iter_mut().zip(&ends).zip(frames).zip(stretches)
        {
            if let Some(frame) = frame {
                *spins = by_end(&(end * frame.transpose() * stretch * (0.5 * h)));
            }
        }
        let mut time_step = (spins[0] * spin + spins[1] * other) / h;
        let w = self.map.stretched(spin) * (0.5 * h);
        let turned = (Matrix3::identity() + w.cross_matrix()) * stretches[0];
        spins[0] -= torque.cross_matrix() * turned * (h / (1.0 + w.norm_squared()));
        time_step += (spin * self.map.rate(spin)).cross(&torque);
        Some(StopTangent { spins, time_step, turns })
    }
}
