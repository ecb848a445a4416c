//! Motion of an ellipsoid relative to a plane in the program, with its derivatives.
//!
//! With the components g_i of the half axes s_i and g_c of the centre along the plane's normal
//! (eq. 24), the norm |·|_u of eq. 4c, its gradient m and its second derivatives P,
//!
//! ```text
//! g = g_c − |(g_i)|_u
//! ∇g = ∇g_c − Σ m_i ∇g_i,   ∇²g = ∇²g_c − Σ m_i ∇²g_i − Σ P_ij ∇g_i ∇g_jᵀ        (eq. D14)
//! ```

use super::component::{Curvature, Forms, MotionComponent, PointPair, PosePair, ProgramPose};
use super::touch::Sight;
use nalgebra::Vector3;
use tumble_core::contact::curved::Reach;
use tumble_core::contact::{Contact, EllipsoidPoint};
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
    /// u of eq. 4c.
    toward: Vector3<f64>,
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
        point: &EllipsoidPoint,
        foot: Vector3<f64>,
        centre: &Vector3<f64>,
    ) -> Self {
        let (frame, one) = (&contact.features.frame, &point.shape);
        let axis = |index: usize| Sight::new(&one.axes.column(index).into_owned(), frame);
        Self {
            points: PointPair::new(one.centre, foot),
            centre: Sight::new(&one.centre, frame),
            axes: [axis(0), axis(1), axis(2)],
            toward: point.toward,
            beyond: contact.arm - centre,
            widest: rotated_point_forms(&(one.centre.abs() + one.half_extents())),
        }
    }

    /// Component g along the normal.
    pub(crate) fn distance(&self, at: PosePair) -> MotionComponent {
        let mut whole = self.centre.component(NORMAL, at);
        let (axes, seen) = self.seen(at);
        let reach = Reach::of(&seen, &self.toward);
        whole.value -= reach.length;
        for (axis, m) in axes.iter().zip(&reach.direction) {
            whole.by_a -= axis.by_a * *m;
            whole.by_b -= axis.by_b * *m;
        }
        whole
    }

    /// Second derivatives of [`Self::distance`].
    pub(crate) fn distance_curvature(&self, at: PosePair) -> Curvature {
        let mut whole = self.centre.curvature(NORMAL, at);
        let (axes, seen) = self.seen(at);
        let reach = Reach::of(&seen, &self.toward);
        let round = reach.curvature(&seen, &self.toward);
        for (i, (axis, m)) in self.axes.iter().zip(&reach.direction).enumerate() {
            let own = axis.curvature(NORMAL, turned(at));
            whole.aa -= own.aa * *m;
            whole.bb -= own.bb * *m;
            whole.ab -= own.ab * *m;
            for (j, other) in axes.iter().enumerate() {
                let (one, weight) = (&axes[i], round[(i, j)]);
                whole.aa -= one.by_a * other.by_a.transpose() * weight;
                whole.bb -= one.by_b * other.by_b.transpose() * weight;
                whole.ab -= one.by_a * other.by_b.transpose() * weight;
            }
        }
        whole
    }

    /// Components g_i of the half axes, and their values.
    fn seen(&self, at: PosePair) -> ([MotionComponent; 3], Vector3<f64>) {
        let axes = [0, 1, 2].map(|index| self.axes[index].component(NORMAL, turned(at)));
        let seen = Vector3::from_fn(|index, _| axes[index].value);
        (axes, seen)
    }
}

/// The same attitudes at the origin, where only vectors count.
fn turned(at: PosePair) -> PosePair {
    let still = |pose: ProgramPose| ProgramPose { position: Vector3::zeros(), ..pose };
    PosePair { a: still(at.a), b: at.b.map(still) }
}
