//! Motion of a body in one step with constant velocities.

use super::quaternion::{advance, turning_rate};
use super::rotation::Rotation;
use super::state::State;
use super::stretch::Stretch;
use nalgebra::{Matrix3, Vector3, Vector4};

/// Map of a step from the velocities at its end to the change of the pose (eqs. 8a and 8b). It
/// rotates by the Cayley map of a = ½ h γ ω, with the stretch γ of the momentum form and γ = 1 in
/// the tutorial's form (eq. 8e).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepMap {
    /// Form of rotation.
    pub form: Rotation,
    /// h (s). A negative one goes back.
    pub time_step: f64,
}

/// Stretch γ of a spin and its derivative.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpinStretch {
    /// γ.
    pub gamma: f64,
    /// ½ h² γ′ (s²): ∂(γ ω)/∂ω = γ E + ½ h² γ′ ω ωᵀ.
    pub bend: f64,
}

impl SpinStretch {
    /// No stretch.
    pub const NONE: Self = Self { gamma: 1.0, bend: 0.0 };

    /// Derivative W = γ E + ½ h² γ′ ω ωᵀ of γ ω with respect to ω = `spin`.
    pub fn slope(&self, spin: &Vector3<f64>) -> Matrix3<f64> {
        Matrix3::from_diagonal_element(self.gamma) + spin * (self.bend * spin).transpose()
    }

    /// M W of a matrix M (3 × 3).
    #[inline]
    pub fn chained(&self, by: Matrix3<f64>, spin: &Vector3<f64>) -> Matrix3<f64> {
        if self.bend == 0.0 {
            return by * self.gamma;
        }
        by * self.gamma + by * spin * (self.bend * spin).transpose()
    }
}

impl StepMap {
    /// A step without length, which moves nothing.
    pub const STILL: Self = Self { form: Rotation::Momentum, time_step: 0.0 };

    /// Map of a step of another length (s).
    pub fn over(self, time_step: f64) -> Self {
        Self { time_step, ..self }
    }

    /// Stretch of the spin ω (rad/s).
    #[inline(always)]
    pub fn stretch(&self, spin: &Vector3<f64>) -> SpinStretch {
        match self.form {
            Rotation::Tutorial => SpinStretch::NONE,
            Rotation::Momentum => {
                let stretch = self.functions(spin);
                let bend = 0.5 * self.time_step * self.time_step * stretch.gamma.slope;
                SpinStretch { gamma: stretch.gamma.value, bend }
            }
        }
    }

    /// γ ω (rad/s) of the spin ω.
    #[inline(always)]
    pub fn stretched(&self, spin: &Vector3<f64>) -> Vector3<f64> {
        match self.form {
            Rotation::Tutorial => *spin,
            Rotation::Momentum => spin * self.functions(spin).gamma.value,
        }
    }

    /// Hessian of `along`·γ ω with respect to ω = `spin`. With k = ½ h²:
    ///
    /// ```text
    /// k γ′ (ω cᵀ + c ωᵀ) + (c·ω) (k γ′ E + k² γ″ ω ωᵀ)                          (D12)
    /// ```
    pub fn stretch_curvature(&self, spin: &Vector3<f64>, along: &Vector3<f64>) -> Matrix3<f64> {
        if self.form == Rotation::Tutorial {
            return Matrix3::zeros();
        }
        let k = 0.5 * self.time_step * self.time_step;
        let gamma = self.functions(spin).gamma;
        let mixed = spin * along.transpose();
        let size = along.dot(spin);
        (mixed + mixed.transpose() + Matrix3::from_diagonal_element(size)) * (k * gamma.slope)
            + spin * spin.transpose() * (size * k * k * gamma.bend)
    }

    /// Rate of the rotation with the length of the step, in parts of ω: with a = ½ h γ ω it is
    ///
    /// ```text
    /// (γ + 2 s γ′)/(1 + a·a)
    /// ```
    pub fn rate(&self, spin: &Vector3<f64>) -> f64 {
        let stretch = match self.form {
            Rotation::Tutorial => Stretch::none(self.functions(spin).s),
            Rotation::Momentum => self.functions(spin),
        };
        let gamma = stretch.gamma.value;
        stretch.along() / (1.0 + stretch.s * gamma * gamma)
    }

    /// Difference of the angle of a step from h |ω| (rad), to leading order in θ = h |ω|.
    pub fn angle_error(&self, spin: &Vector3<f64>) -> f64 {
        let angle = self.time_step * spin.norm();
        match self.form {
            Rotation::Tutorial => angle.powi(3) / 12.0,
            Rotation::Momentum => 31.0 / 362_880.0 * angle.powi(9),
        }
    }

    /// Unit attitude after the step from the attitude `q` with the spin ω⁺ (rad/s, body frame).
    #[inline]
    pub fn advance(&self, q: &Vector4<f64>, spin: &Vector3<f64>) -> Vector4<f64> {
        advance(q, &self.stretched(spin), self.time_step)
    }

    /// `state` after the step at constant velocities.
    pub fn coasted(&self, state: &State) -> State {
        State {
            position: state.position + state.velocity * self.time_step,
            attitude: self.advance(&state.attitude, &state.spin),
            ..*state
        }
    }

    /// Angular velocity Ω (rad/s, world frame) with which the step rotates a body from the attitude
    /// `from` to `to` (rotation matrices, body → world).
    pub fn rate_between(&self, from: &Matrix3<f64>, to: &Matrix3<f64>) -> Vector3<f64> {
        let stretched = turning_rate(from, to, self.time_step);
        match self.form {
            Rotation::Tutorial => stretched,
            Rotation::Momentum => {
                let square = 0.25 * self.time_step * self.time_step * stretched.norm_squared();
                stretched / Stretch::inverse(square).gamma.value
            }
        }
    }

    #[inline(always)]
    fn functions(&self, spin: &Vector3<f64>) -> Stretch {
        Stretch::new(0.25 * self.time_step * self.time_step * spin.norm_squared())
    }
}

#[cfg(test)]
#[path = "tests/step_map.rs"]
mod tests;
