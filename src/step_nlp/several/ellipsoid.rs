//! Motion of an ellipsoid relative to a plane in the program, with its derivatives.
//!
//! With the components g_i of the half axes s_i and g_c of the centre along the plane's normal
//! (eq. 24),
//!
//! ```text
//! g = g_c − e,   e = √(Σ g_i²)
//! ∇e = Σ g_i ∇g_i/e,   ∇²e = (Σ (∇g_i ∇g_iᵀ + g_i ∇²g_i) − ∇e ∇eᵀ)/e            (eq. D14)
//! ```

use super::component::{Curvature, Forms, MotionComponent, PointPair, PosePair, ProgramPose};
use super::touch::Sight;
use nalgebra::{Matrix4, Vector3, Vector4};
use tumble_core::contact::Contact;
use tumble_core::geometry::Ellipsoid;
use tumble_core::mechanics::quaternion::rotated_point_forms;

/// Axis of the normal in a frame (t₁, t₂, n).
const NORMAL: usize = 2;

/// An ellipsoid of A against a plane of B.
#[derive(Debug, Clone)]
pub(crate) struct EllipsoidFeatures {
    /// Centre, and the touched point of B at step k, which define the slip.
    pub(crate) points: PointPair,
    /// Centre along the directions of the plane.
    centre: Sight,
    /// Half axes along the directions of the plane.
    axes: [Sight; 3],
    /// y: from the centre to the touching point at step k (m, world).
    pub(crate) beyond: Vector3<f64>,
    /// Forms of a vector that is zero only where no point of the ellipsoid turns.
    pub(crate) widest: Forms,
}

impl EllipsoidFeatures {
    /// Creates the features of a contact. `foot` is the touched point at step k (m, frame of B).
    /// `centre` is the centre relative to A (m, world).
    pub(crate) fn new(
        contact: &Contact,
        one: &Ellipsoid,
        foot: Vector3<f64>,
        centre: &Vector3<f64>,
    ) -> Self {
        let frame = &contact.features.frame;
        let axis = |index: usize| Sight::new(&one.axes.column(index).into_owned(), frame);
        Self {
            points: PointPair::new(one.centre, foot),
            centre: Sight::new(&one.centre, frame),
            axes: [axis(0), axis(1), axis(2)],
            beyond: contact.arm - centre,
            widest: rotated_point_forms(&(one.centre.abs() + one.half_extents())),
        }
    }

    /// Component g along the normal.
    pub(crate) fn distance(&self, at: PosePair) -> MotionComponent {
        let centre = self.centre.component(NORMAL, at);
        let width = self.width(at);
        MotionComponent {
            value: centre.value - width.value,
            by_position: centre.by_position,
            by_a: centre.by_a - width.by_a,
            by_b: centre.by_b - width.by_b,
        }
    }

    /// Second derivatives of [`Self::distance`].
    pub(crate) fn distance_curvature(&self, at: PosePair) -> Curvature {
        let mut whole = self.centre.curvature(NORMAL, at);
        let width = self.width(at);
        if width.value <= 0.0 {
            return whole;
        }
        let mut squares = [Matrix4::zeros(); 3];
        for axis in &self.axes {
            let (g, curved) =
                (axis.component(NORMAL, turned(at)), axis.curvature(NORMAL, turned(at)));
            squares[0] += g.by_a * g.by_a.transpose() + curved.aa * g.value;
            squares[1] += g.by_b * g.by_b.transpose() + curved.bb * g.value;
            squares[2] += g.by_a * g.by_b.transpose() + curved.ab * g.value;
        }
        whole.aa -= (squares[0] - width.by_a * width.by_a.transpose()) / width.value;
        whole.bb -= (squares[1] - width.by_b * width.by_b.transpose()) / width.value;
        whole.ab -= (squares[2] - width.by_a * width.by_b.transpose()) / width.value;
        whole
    }

    /// e with its first derivatives; zero for a disc parallel to the plane.
    fn width(&self, at: PosePair) -> Width {
        let mut width = Width { value: 0.0, by_a: Vector4::zeros(), by_b: Vector4::zeros() };
        for axis in &self.axes {
            let g = axis.component(NORMAL, turned(at));
            width.value += g.value * g.value;
            width.by_a += g.by_a * g.value;
            width.by_b += g.by_b * g.value;
        }
        width.value = width.value.sqrt();
        if width.value > 0.0 {
            width.by_a /= width.value;
            width.by_b /= width.value;
        }
        width
    }
}

/// Half the width of an ellipsoid along the normal, with its derivatives.
struct Width {
    value: f64,
    by_a: Vector4<f64>,
    by_b: Vector4<f64>,
}

/// The same attitudes at the origin, where only vectors count.
fn turned(at: PosePair) -> PosePair {
    let still = |pose: ProgramPose| ProgramPose { position: Vector3::zeros(), ..pose };
    PosePair { a: still(at.a), b: at.b.map(still) }
}
