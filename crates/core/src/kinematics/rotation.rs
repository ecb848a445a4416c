//! Integrators of free rotation.
//!
//! A step rotates its body with one spin ω⁺ (eq. 8e of `docs/formulation.md`). The two integrators
//! differ in the angle ([`StepMap`](super::StepMap)) and in the corresponding momentum. Both have
//! the form (8d)
//!
//! ```text
//! I (ω⁺ − ω) + h G(ω, ω⁺) = h τ
//! ```
//!
//! [`Tutorial`](Rotation::Tutorial) is Euler's equation with the gyroscopic term at the end of the
//! step,
//!
//! ```text
//! G = ω⁺ × I ω⁺                                                          (eq. 33a)
//! ```
//!
//! It conserves angular momentum and energy to first order in h. [`Momentum`](Rotation::Momentum)
//! balances angular momentum. With α and β of [`Stretch`]
//!
//! ```text
//! P^±(ω) = α I ω ± ½ h ω × I ω + ¼ h² β (ω·I ω) ω                         (eq. 34)
//! ```
//!
//! P⁻(ω) is the momentum in body axes at the end of a step with the spin ω, and P⁺(ω) is the one at
//! its start: A⁺ P⁻(ω) = A P⁺(ω) holds exactly for the rotation (8e). P⁺(ω⁺) = P⁻(ω) + h τ then
//! states that only the impulse of the torque changes A P⁻(ω). This is the discrete Euler–Poincaré
//! equation of that rotation, a variational integrator. It is of second order, and its energy has
//! no drift. G follows from it:
//!
//! ```text
//! h G = (P⁺(ω⁺) − I ω⁺) − (P⁻(ω) − I ω)                                   (eq. 33b)
//! ```
//!
//! Without torque, a body with equal principal moments keeps ω in both. All functions are linear in
//! the inertia; with I/m they compute momenta per mass.

use super::stretch::Stretch;
use nalgebra::{Matrix3, Vector3};

/// Integrator of free rotation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "serde", serde(rename_all = "kebab-case"))]
pub enum Rotation {
    /// P⁺(ω⁺) = P⁻(ω) + h τ, with a rotation by h ω: conserves angular momentum to rounding, and
    /// energy without drift.
    Momentum,
    /// I (ω⁺ − ω) + h ω⁺ × I ω⁺ = h τ of the tutorial: conserves both to first order in h.
    Tutorial,
}

impl Rotation {
    /// All integrators.
    pub const ALL: [Self; 2] = [Self::Momentum, Self::Tutorial];

    /// Name in files and flags.
    pub fn name(self) -> &'static str {
        match self {
            Self::Momentum => "momentum",
            Self::Tutorial => "tutorial",
        }
    }

    /// Gyroscopic term G(ω, ω⁺) (eqs. 33a and 33b) (N m), body frame. `inertia` is in kg m², body
    /// frame. `old` and `new` are the spins of the previous and of the present step (rad/s), body
    /// frame; `time_step` is in s.
    #[inline(always)]
    pub fn gyroscopic(
        self,
        inertia: &Matrix3<f64>,
        old: &Vector3<f64>,
        new: &Vector3<f64>,
        time_step: f64,
    ) -> Vector3<f64> {
        let ended = self.end_excess(inertia, old, time_step);
        self.gyroscopic_after(inertia, &ended, new, time_step)
    }

    /// P⁻(ω) − I ω (N m s), body frame; 0 for `Tutorial`.
    #[inline(always)]
    pub fn end_excess(
        self,
        inertia: &Matrix3<f64>,
        spin: &Vector3<f64>,
        time_step: f64,
    ) -> Vector3<f64> {
        match self {
            Self::Tutorial => Vector3::zeros(),
            Self::Momentum => turned(inertia, spin, -time_step),
        }
    }

    /// [`Rotation::gyroscopic`] from the [excess](Rotation::end_excess) `ended` of the previous spin.
    #[inline(always)]
    pub fn gyroscopic_after(
        self,
        inertia: &Matrix3<f64>,
        ended: &Vector3<f64>,
        new: &Vector3<f64>,
        time_step: f64,
    ) -> Vector3<f64> {
        match self {
            Self::Tutorial => new.cross(&(inertia * new)),
            Self::Momentum => (turned(inertia, new, time_step) - ended) / time_step,
        }
    }

    /// Derivative ∂G/∂ω⁺ at ω⁺ = `spin` (N m s), body frame. For `Tutorial` it is \[ω\]× I − \[I ω\]×.
    #[inline]
    pub fn gyroscopic_slope(
        self,
        inertia: &Matrix3<f64>,
        spin: &Vector3<f64>,
        time_step: f64,
    ) -> Matrix3<f64> {
        match self {
            Self::Tutorial => spin.cross_matrix() * inertia - (inertia * spin).cross_matrix(),
            Self::Momentum => turned_slope(inertia, spin, time_step) / time_step,
        }
    }

    /// Angular momentum of a state (N m s), body frame. For `Momentum` it is P⁻(ω) (eq. 34), the
    /// momentum at the state's time before the impulses of the next step. For `Tutorial` it is I ω.
    pub fn momentum(
        self,
        inertia: &Matrix3<f64>,
        spin: &Vector3<f64>,
        time_step: f64,
    ) -> Vector3<f64> {
        let momentum = inertia * spin;
        match self {
            Self::Tutorial => momentum,
            Self::Momentum => momentum + turned(inertia, spin, -time_step),
        }
    }

    /// Angular momentum at the start of a step with this spin ω⁺ (N m s), body frame, before its torque:
    /// P⁺(ω⁺) (eq. 34). For `Tutorial` it is I ω⁺ + h ω⁺ × I ω⁺.
    pub fn start_momentum(
        self,
        inertia: &Matrix3<f64>,
        spin: &Vector3<f64>,
        time_step: f64,
    ) -> Vector3<f64> {
        let momentum = self.momentum(inertia, spin, -time_step);
        match self {
            Self::Tutorial => momentum + spin.cross(&momentum) * time_step,
            Self::Momentum => momentum,
        }
    }

    /// Derivative of [`Rotation::momentum`] with respect to ω.
    pub fn momentum_slope(
        self,
        inertia: &Matrix3<f64>,
        spin: &Vector3<f64>,
        time_step: f64,
    ) -> Matrix3<f64> {
        match self {
            Self::Tutorial => *inertia,
            Self::Momentum => inertia + turned_slope(inertia, spin, -time_step),
        }
    }

    /// Derivative of P^±(ω) (eq. 34) with respect to h (N m), body frame; `sign` is 1 for P⁺ and −1
    /// for P⁻. For `Momentum` it is, with α′ and β′ by s,
    ///
    /// ```text
    /// ½ h α′ (ω·ω) I ω ± ½ ω × I ω + ½ h (β + s β′) (ω·I ω) ω
    /// ```
    ///
    /// For `Tutorial`, P⁺ is I ω + h ω × I ω, and P⁻ is I ω.
    pub fn momentum_rate(
        self,
        inertia: &Matrix3<f64>,
        spin: &Vector3<f64>,
        time_step: f64,
        sign: f64,
    ) -> Vector3<f64> {
        let momentum = inertia * spin;
        let turning = spin.cross(&momentum);
        match self {
            Self::Tutorial => turning * (0.5 + 0.5 * sign),
            Self::Momentum => {
                let half = 0.5 * time_step;
                let stretch = Stretch::new(half * half * spin.norm_squared());
                let [alpha, beta] = stretch.momentum_factors();
                let along = half * (beta.value + stretch.s * beta.slope) * spin.dot(&momentum);
                momentum * (half * alpha.slope * spin.norm_squared())
                    + turning * (0.5 * sign)
                    + spin * along
            }
        }
    }

    /// Spin at the time of a state (rad/s), body frame, with which contacts approach: I⁻¹ P⁻(ω), or
    /// ω for `Tutorial`. `inertia` and `inverse` must have the same scale.
    pub fn arriving_spin(
        self,
        inertia: &Matrix3<f64>,
        inverse: &Matrix3<f64>,
        spin: &Vector3<f64>,
        time_step: f64,
    ) -> Vector3<f64> {
        match self {
            Self::Tutorial => *spin,
            Self::Momentum => inverse * self.momentum(inertia, spin, time_step),
        }
    }

    /// Spin at the time of a state after the impulses of the step with ω⁺ = `spin` (rad/s), body
    /// frame: I⁻¹ P⁺(ω⁺), or ω⁺ for `Tutorial`.
    #[inline]
    pub fn departing_spin(
        self,
        inertia: &Matrix3<f64>,
        inverse: &Matrix3<f64>,
        spin: &Vector3<f64>,
        time_step: f64,
    ) -> Vector3<f64> {
        match self {
            Self::Tutorial => *spin,
            Self::Momentum => spin + inverse * turned(inertia, spin, time_step),
        }
    }

    /// Derivative of [`Rotation::departing_spin`] with respect to ω⁺.
    pub fn departing_slope(
        self,
        inertia: &Matrix3<f64>,
        inverse: &Matrix3<f64>,
        spin: &Vector3<f64>,
        time_step: f64,
    ) -> Matrix3<f64> {
        match self {
            Self::Tutorial => Matrix3::identity(),
            Self::Momentum => {
                Matrix3::identity() + inverse * turned_slope(inertia, spin, time_step)
            }
        }
    }
}

/// P⁺(ω) − I ω (eq. 34), or P⁻(ω) − I ω with −h.
///
/// ```text
/// (α − 1) I ω + ½ h ω × I ω + ¼ h² β (ω·I ω) ω
/// ```
#[inline(always)]
fn turned(inertia: &Matrix3<f64>, spin: &Vector3<f64>, time_step: f64) -> Vector3<f64> {
    let momentum = inertia * spin;
    let half = 0.5 * time_step;
    let square = half * half;
    let [alpha, beta] = Stretch::new(square * spin.norm_squared()).momentum_factors();
    spin.cross(&momentum) * half
        + momentum * (alpha.value - 1.0)
        + spin * (square * beta.value * spin.dot(&momentum))
}

/// Derivative of [`turned`] with respect to ω. With c = ω·I ω and ∂s/∂ω = ½ h² ωᵀ:
///
/// ```text
/// (α − 1) I + ½ h² α′ (I ω) ωᵀ + ½ h ([ω]× I − [I ω]×)
///   + ¼ h² (β (c E + 2 ω (I ω)ᵀ) + ½ h² β′ c ω ωᵀ)
/// ```
#[inline]
fn turned_slope(inertia: &Matrix3<f64>, spin: &Vector3<f64>, time_step: f64) -> Matrix3<f64> {
    let momentum = inertia * spin;
    let half = 0.5 * time_step;
    let square = half * half;
    let [alpha, beta] = Stretch::new(square * spin.norm_squared()).momentum_factors();
    let along = spin.dot(&momentum);
    let turning = spin.cross_matrix() * inertia - momentum.cross_matrix();
    let by_spin = momentum * alpha.slope + spin * (square * beta.slope * along);
    let by_momentum = 2.0 * spin * momentum.transpose() + Matrix3::from_diagonal_element(along);
    inertia * (alpha.value - 1.0)
        + turning * half
        + by_spin * (2.0 * square * spin).transpose()
        + by_momentum * (square * beta.value)
}
