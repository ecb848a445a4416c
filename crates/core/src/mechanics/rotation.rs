//! The equation by which a step turns a body freely: which of two forms of it, and what both are
//! made of.
//!
//! A step turns its body with one spin ω⁺ by the Cayley map, and the two forms differ in the
//! momentum that goes with it. Both are (eq. 8d of `docs/formulation.md`)
//!
//! ```text
//! I (ω⁺ − ω) + h G(ω, ω⁺) = h τ
//! ```
//!
//! [`Tutorial`](Rotation::Tutorial) has Euler's equation with its gyroscopic term at the end of the
//! step,
//!
//! ```text
//! G = ω⁺ × I ω⁺                                                          (eq. 33a)
//! ```
//!
//! which keeps neither angular momentum nor energy, both to first order in h.
//! [`Momentum`](Rotation::Momentum) balances angular momentum. With
//!
//! ```text
//! P^±(ω) = I ω ± ½ h ω × I ω + ¼ h² (ω·I ω) ω                             (eq. 34)
//! ```
//!
//! P⁻(ω) is the momentum in the body's axes at the end of a step that turned with ω, P⁺(ω) that at
//! its start: A⁺ P⁻(ω) = A P⁺(ω) for A⁺ = A cay(hω), exactly. P⁺(ω⁺) = P⁻(ω) + h τ then says that
//! the torque's impulse alone changes A P⁻(ω). It is the discrete Euler–Poincaré equation of the
//! Cayley map, a variational integrator: of second order, and its energy has no trend. As G,
//!
//! ```text
//! G = ½ (ω⁺ × I ω⁺ + ω × I ω) + ¼ h ((ω⁺·I ω⁺) ω⁺ − (ω·I ω) ω)            (eq. 33b)
//! ```
//!
//! Without torque a body of equal principal moments keeps ω in both. All functions are linear in
//! the inertia, so that I/m in the place of I makes momenta of a unit of mass.

use nalgebra::{Matrix3, Vector3};

/// Which equation turns a body in a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "kebab-case"))]
pub enum Rotation {
    /// P⁺(ω⁺) = P⁻(ω) + h τ: keeps angular momentum to rounding and energy without a trend.
    Momentum,
    /// I (ω⁺ − ω) + h ω⁺ × I ω⁺ = h τ, the tutorial's: keeps both to first order in h.
    Tutorial,
}

impl Rotation {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Momentum, Self::Tutorial];

    /// The word for it in files and flags.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Momentum => "momentum",
            Self::Tutorial => "tutorial",
        }
    }

    /// G(ω, ω⁺) (eqs. 33a and 33b), N m, body: what stands beside I (ω⁺ − ω)/h. `inertia` in kg m², body; spins
    /// in rad/s, body: `old` of the step before, `new` of the step; `time_step` in s.
    #[must_use]
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

    /// ∂G/∂ω⁺ at ω⁺ = `spin`, N m s, body: with K = \[ω\]× I − \[I ω\]×
    ///
    /// ```text
    /// tutorial: K,   momentum: ½ K + ¼ h ((ω·I ω) E + 2 ω (I ω)ᵀ)
    /// ```
    #[must_use]
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

    /// The angular momentum that goes with a state, N m s, body: of the momentum form P⁻(ω) (eq. 34),
    /// which is that at the state's time, before the impulses of the next step; of the tutorial's
    /// I ω.
    #[must_use]
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

    /// ∂/∂ω of that: of the momentum form
    ///
    /// ```text
    /// I − ½ h ([ω]× I − [I ω]×) + ¼ h² ((ω·I ω) E + 2 ω (I ω)ᵀ)
    /// ```
    #[must_use]
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

    /// ∂/∂h of P^±(ω) (eq. 34), N m, body, `sign` being 1 of P⁺ and −1 of P⁻; of the tutorial's form that of
    /// I ω + h ω × I ω and of I ω.
    #[must_use]
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

    /// The spin at the time of a state, rad/s, body: I⁻¹ P⁻(ω), with which what touches arrives; ω of
    /// the tutorial's form. `inertia` and its inverse of one scale.
    #[must_use]
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

    /// The spin at the same time after the impulses of the step that turns with ω⁺ = `spin`, rad/s,
    /// body: I⁻¹ P⁺(ω⁺); ω⁺ of the tutorial's form.
    #[must_use]
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

    /// Its derivative by ω⁺.
    #[must_use]
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

/// ∂/∂ω ((ω·I ω) ω) = (ω·I ω) E + 2 ω (I ω)ᵀ, with the `momentum` I ω.
fn quadratic_slope(momentum: &Vector3<f64>, spin: &Vector3<f64>) -> Matrix3<f64> {
    Matrix3::from_diagonal_element(spin.dot(momentum)) + 2.0 * spin * momentum.transpose()
}
