//! The gyroscopic term I⁻¹ G(ω, ω⁺) of the rows (8d) and its derivatives with respect to ω⁺.

use nalgebra::{Matrix3, RowVector3, Vector3};
use tumble_core::mechanics::stretch::{Curve, Stretch};
use tumble_core::mechanics::{RigidBody, Rotation};

/// Gyroscopic term of one body.
#[derive(Debug, Clone)]
pub(super) struct Gyroscopic {
    rotation: Rotation,
    time_step: f64,
    inertia: Matrix3<f64>,
    inertia_inverse: Matrix3<f64>,
    /// T_k of eq. D6: component k of I⁻¹ (ω × I ω) is ½ ωᵀ T_k ω.
    forms: [Matrix3<f64>; 3],
}

impl Gyroscopic {
    /// Creates the term of `body` for steps of `time_step` (s).
    pub(super) fn new(body: &RigidBody, rotation: Rotation, time_step: f64) -> Self {
        Self {
            rotation,
            time_step,
            inertia: *body.inertia(),
            inertia_inverse: *body.inertia_inverse(),
            forms: forms(body),
        }
    }

    /// G(ω, ω⁺), N m.
    pub(super) fn term(&self, old: &Vector3<f64>, new: &Vector3<f64>) -> Vector3<f64> {
        self.rotation.gyroscopic(&self.inertia, old, new, self.time_step)
    }

    /// True if ∂(I⁻¹ G)_k/∂ω⁺_j can be non-zero.
    pub(super) fn depends(&self, k: usize, j: usize) -> bool {
        self.rotation == Rotation::Momentum || self.forms[k].row(j).amax() > 0.0
    }

    /// ∂(I⁻¹ G)/∂ω⁺ at ω⁺ = `spin`. In the tutorial's form it is T(ω) with the rows ωᵀ T_k.
    pub(super) fn slope(&self, spin: &Vector3<f64>) -> Matrix3<f64> {
        match self.rotation {
            Rotation::Tutorial => {
                let rows = self.forms.map(|form| (form * spin).transpose());
                Matrix3::from_rows(&rows as &[RowVector3<f64>])
            }
            Rotation::Momentum => {
                let slope = self.rotation.gyroscopic_slope(&self.inertia, spin, self.time_step);
                self.inertia_inverse * slope
            }
        }
    }

    /// ∇²(y·I⁻¹ G) with respect to ω⁺ at ω⁺ = `spin`. In the tutorial's form it is Σ y_k T_k. In the
    /// momentum form, with z = I⁻¹ y, k = ½ h², m = z·I ω and c = (ω·I ω) (z·ω), it is
    ///
    /// ```text
    /// ½ Σ y_k T_k + (k α′ (m E + ω ∇mᵀ + ∇m ωᵀ) + k² α″ m ω ωᵀ
    ///   + ½ k (β ∇²c + k β′ (c E + ω ∇cᵀ + ∇c ωᵀ) + k² β″ c ω ωᵀ))/h               (D11)
    /// ```
    pub(super) fn curvature(&self, y: &Vector3<f64>, spin: &Vector3<f64>) -> Matrix3<f64> {
        let turning: Matrix3<f64> = self.forms.iter().zip(y).map(|(form, y)| form * *y).sum();
        match self.rotation {
            Rotation::Tutorial => turning,
            Rotation::Momentum => {
                let (z, momentum) = (self.inertia_inverse * y, self.inertia * spin);
                let k = 0.5 * self.time_step * self.time_step;
                let [alpha, beta] = Stretch::new(0.5 * k * spin.norm_squared()).momentum_factors();
                // ∇²(f(s) g) from the value, gradient and Hessian of g.
                let scaled = |f: &Curve, g: f64, slope: Vector3<f64>, bend: Matrix3<f64>| {
                    let mixed = spin * slope.transpose();
                    let along = mixed + mixed.transpose() + Matrix3::from_diagonal_element(g);
                    bend * f.value
                        + along * (k * f.slope)
                        + spin * spin.transpose() * (k * k * f.bend * g)
                };
                let energy = spin.dot(&momentum);
                let along = z.dot(spin);
                let half = z * momentum.transpose();
                let bend = 2.0 * (self.inertia * along + half + half.transpose());
                let slope = 2.0 * along * momentum + energy * z;
                let linear = scaled(&alpha, z.dot(&momentum), self.inertia * z, Matrix3::zeros());
                let cubic = scaled(&beta, energy * along, slope, bend) * (0.5 * k);
                turning * 0.5 + (linear + cubic) / self.time_step
            }
        }
    }
}

/// T_k (eq. D6). With S_i the symmetric matrix of component i of ω × I ω,
///
/// ```text
/// (ω × I ω)_i = ω_j (I ω)_k − ω_k (I ω)_j,   (i, j, k) cyclic,
/// S_i = e_j I_k· + I_·k e_jᵀ − e_k I_j· − I_·j e_kᵀ,
/// ```
///
/// T_k = Σ_i (I⁻¹)_ki S_i. It is exactly zero for an isotropic inertia.
fn forms(body: &RigidBody) -> [Matrix3<f64>; 3] {
    let inertia = body.inertia();
    let component = |i: usize| {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        let half: Matrix3<f64> =
            Vector3::ith(j, 1.0) * inertia.row(k) - Vector3::ith(k, 1.0) * inertia.row(j);
        half + half.transpose()
    };
    let components = [component(0), component(1), component(2)];
    let inverse = body.inertia_inverse();
    [0, 1, 2].map(|k| (0..3).map(|i| components[i] * inverse[(k, i)]).sum())
}
