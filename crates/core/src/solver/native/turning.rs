//! Motion of a body's points in a step that ends with a given spin (N2, N3).

use crate::kinematics::{SpinStretch, StepMap};
use nalgebra::{Matrix3, Vector3};

/// Sweep of a body's points at one spin.
///
/// The attitude step rotates the body by the Cayley map of h w/2 with the stretched spin w = γ ω
/// (8e), so that
///
/// ```text
/// (A(q⁺) − A(q)) c / h = A K c,   K c = (w × c + (h/2) w × (w × c)) / (1 + h²w²/4)
/// ```
#[derive(Debug, Clone, Copy)]
pub(super) struct BodyTurning {
    /// ω (rad/s, body), and A ω (rad/s, world).
    spin: Vector3<f64>,
    spin_world: Vector3<f64>,
    stretch: SpinStretch,
    /// h/2 (s).
    half: f64,
    /// 1/(1 + h²w²/4).
    shrink: f64,
    /// A K (1/s).
    sweep: Matrix3<f64>,
}

impl BodyTurning {
    /// Sweep of a body with the `rotation` A(q) at the start of the step and the spin ω⁺ (rad/s,
    /// body), over the step `map`.
    #[inline]
    pub(super) fn new(rotation: &Matrix3<f64>, spin: Vector3<f64>, map: &StepMap) -> Self {
        let half = 0.5 * map.time_step;
        let stretch = map.stretch(&spin);
        let w = spin * stretch.gamma;
        let shrink = 1.0 / (1.0 + half * half * w.norm_squared());
        // K = ([w]× + (h/2) (w wᵀ − w² E)) / (1 + h²w²/4)
        let mut sweep = w.cross_matrix() + half * w * w.transpose();
        for k in 0..3 {
            sweep[(k, k)] -= half * w.norm_squared();
        }
        let sweep = rotation * sweep * shrink;
        Self { spin, spin_world: rotation * spin, stretch, half, shrink, sweep }
    }

    /// Sweep without rotation.
    pub(super) const STILL: Self = Self {
        spin: Vector3::new(0.0, 0.0, 0.0),
        spin_world: Vector3::new(0.0, 0.0, 0.0),
        stretch: SpinStretch::NONE,
        half: 0.0,
        shrink: 1.0,
        sweep: Matrix3::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    };

    /// Sets `there` to the sweep of the spin ω and `back` to the sweep of −ω. They share the even
    /// part of K. Written in place, because they are large.
    #[inline]
    pub(super) fn set_there_and_back(
        rotation: &Matrix3<f64>,
        spin: &Vector3<f64>,
        map: &StepMap,
        there: &mut Self,
        back: &mut Self,
    ) {
        let half = 0.5 * map.time_step;
        let stretch = map.stretch(spin);
        let w = spin * stretch.gamma;
        let squared = w.norm_squared();
        let shrink = 1.0 / (1.0 + half * half * squared);
        let odd = w.cross_matrix();
        let mut even = half * w * w.transpose();
        (0..3).for_each(|k| even[(k, k)] -= half * squared);
        let spin_world = rotation * spin;
        (there.spin, there.spin_world) = (*spin, spin_world);
        (back.spin, back.spin_world) = (-spin, -spin_world);
        (there.stretch, back.stretch) = (stretch, stretch);
        (there.half, there.shrink, back.half, back.shrink) = (half, shrink, half, shrink);
        there.sweep = rotation * (odd + even) * shrink;
        back.sweep = rotation * (even - odd) * shrink;
    }

    /// A K c of one point c, without forming A K.
    #[inline]
    pub(super) fn swept_once(
        rotation: &Matrix3<f64>,
        spin: &Vector3<f64>,
        map: &StepMap,
        point: &Vector3<f64>,
    ) -> Vector3<f64> {
        let half = 0.5 * map.time_step;
        let w = map.stretched(spin);
        let shrink = 1.0 / (1.0 + half * half * w.norm_squared());
        let turned = w.cross(point);
        rotation * ((turned + w.cross(&turned) * half) * shrink)
    }

    /// A K c of the body's point c (m/s, world).
    #[inline]
    pub(super) fn swept(&self, point: &Vector3<f64>) -> Vector3<f64> {
        self.sweep * point
    }

    /// A ω (rad/s, world).
    pub(super) fn spin_world(&self) -> &Vector3<f64> {
        &self.spin_world
    }

    /// A K (1/s).
    pub(super) fn sweep(&self) -> &Matrix3<f64> {
        &self.sweep
    }

    /// ∂(A K c)/∂ω⁺ of the body's point c, from A, c, A c, −A [c]× and A K c.
    ///
    /// With ∂/∂w (w × c) = −[c]× and ∂/∂w (w × (w × c)) = w cᵀ + (w·c) E − 2 c wᵀ, it is the product of
    ///
    /// ```text
    /// (−A [c]× + (h/2) (A w cᵀ + (w·c) A − 2 A c wᵀ)) / (1 + h²w²/4)
    ///   − (h²/2) A K c wᵀ / (1 + h²w²/4)
    /// ```
    ///
    /// and ∂w/∂ω.
    #[inline]
    pub(super) fn slope(
        &self,
        rotation: &Matrix3<f64>,
        point: &Vector3<f64>,
        arm: &Vector3<f64>,
        turned: Matrix3<f64>,
        swept: &Vector3<f64>,
    ) -> Matrix3<f64> {
        let stretched = self.stretch.gamma * self.half;
        let back = (arm + self.half * swept) * (2.0 * stretched);
        let mut slope = turned;
        slope += self.spin_world * (stretched * point).transpose();
        slope += rotation * (stretched * self.spin.dot(point));
        slope -= back * self.spin.transpose();
        self.stretch.chained(slope * self.shrink, &self.spin)
    }

    /// ∂(A K c)/∂ω⁺ of the body's point c, from A and c alone.
    pub(super) fn slope_of(&self, rotation: &Matrix3<f64>, point: &Vector3<f64>) -> Matrix3<f64> {
        let turned = -rotation * point.cross_matrix();
        self.slope(rotation, point, &(rotation * point), turned, &self.swept(point))
    }
}
