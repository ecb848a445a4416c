//! Integrators of free rotation.
//!
//! A step rotates its body with one spin ω⁺ by the Cayley map. The two integrators differ in the
//! corresponding momentum. Both have the form (eq. 8d of `docs/formulation.md`)
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
//! balances angular momentum. With
//!
//! ```text
//! P^±(ω) = I ω ± ½ h ω × I ω + ¼ h² (ω·I ω) ω                             (eq. 34)
//! ```
//!
//! P⁻(ω) is the momentum in body axes at the end of a step with the spin ω, and P⁺(ω) is the one at
//! its start: A⁺ P⁻(ω) = A P⁺(ω) holds exactly for A⁺ = A cay(hω). P⁺(ω⁺) = P⁻(ω) + h τ then states
//! that only the impulse of the torque changes A P⁻(ω). This is the discrete Euler–Poincaré
//! equation of the Cayley map, a variational integrator. It is of second order, and its energy has
//! no drift. As G,
//!
//! ```text
//! G = ½ (ω⁺ × I ω⁺ + ω × I ω) + ¼ h ((ω⁺·I ω⁺) ω⁺ − (ω·I ω) ω)            (eq. 33b)
//! ```
//!
//! Without torque, a body with equal principal moments keeps ω in both. All functions are linear in
//! the inertia; with I/m they compute momenta per mass.

use nalgebra::{Matrix3, Vector3};

/// Integrator of free rotation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "kebab-case"))]
pub enum Rotation {
    /// P⁺(ω⁺) = P⁻(ω) + h τ: conserves angular momentum to rounding, and energy without drift.
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
        let after = inertia * new;
        match self {
            Self::Tutorial => new.cross(&after),
            Self::Momentum => {
                let before = inertia * old;
                let mean = (new.cross(&after) + old.cross(&before)) * 0.5;
                let along = new * new.dot(&after) - old * old.dot(&before);
                mean + along * (0.25 * time_step)
            }
        }
    }

    /// Derivative ∂G/∂ω⁺ at ω⁺ = `spin` (N m s), body frame. With K = \[ω\]× I − \[I ω\]×,
    ///
    /// ```text
    /// tutorial: K,   momentum: ½ K + ¼ h ((ω·I ω) E + 2 ω (I ω)ᵀ)
    /// ```
    #[inline]
    pub fn gyroscopic_slope(
        self,
        inertia: &Matrix3<f64>,
        spin: &Vector3<f64>,
        time_step: f64,
    ) -> Matrix3<f64> {
        let momentum = inertia * spin;
        let turning = spin.cross_matrix() * inertia - momentum.cross_matrix();
        match self {
            Self::Tutorial => turning,
            Self::Momentum => turning * 0.5 + quadratic_slope(&momentum, spin) * (0.25 * time_step),
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
            Self::Momentum => {
                let half = 0.5 * time_step;
                let turning = spin.cross(&momentum) * half;
                momentum - turning + spin * (half * half * spin.dot(&momentum))
            }
        }
    }

    /// Derivative of [`Rotation::momentum`] with respect to ω. For `Momentum` it is
    ///
    /// ```text
    /// I − ½ h ([ω]× I − [I ω]×) + ¼ h² ((ω·I ω) E + 2 ω (I ω)ᵀ)
    /// ```
    pub fn momentum_slope(
        self,
        inertia: &Matrix3<f64>,
        spin: &Vector3<f64>,
        time_step: f64,
    ) -> Matrix3<f64> {
        let (momentum, half) = (inertia * spin, 0.5 * time_step);
        match self {
            Self::Tutorial => *inertia,
            Self::Momentum => {
                let turning = spin.cross_matrix() * inertia - momentum.cross_matrix();
                inertia - turning * half + quadratic_slope(&momentum, spin) * (half * half)
            }
        }
    }

    /// Derivative of P^±(ω) (eq. 34) with respect to h (N m), body frame; `sign` is 1 for P⁺ and −1
    /// for P⁻. For `Tutorial`, P⁺ is I ω + h ω × I ω, and P⁻ is I ω.
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
                turning * (0.5 * sign) + spin * (0.5 * time_step * spin.dot(&momentum))
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
            // P⁺(ω) = I ω + h G(0, ω)
            Self::Momentum => {
                let gyroscopic = self.gyroscopic(inertia, &Vector3::zeros(), spin, time_step);
                spin + inverse * gyroscopic * time_step
            }
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
                let slope = self.gyroscopic_slope(inertia, spin, time_step);
                Matrix3::identity() + inverse * slope * time_step
            }
        }
    }
}

/// Derivative ∂/∂ω ((ω·I ω) ω) = (ω·I ω) E + 2 ω (I ω)ᵀ, with the `momentum` I ω.
fn quadratic_slope(momentum: &Vector3<f64>, spin: &Vector3<f64>) -> Matrix3<f64> {
    Matrix3::from_diagonal_element(spin.dot(momentum)) + 2.0 * spin * momentum.transpose()
}
