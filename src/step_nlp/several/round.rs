//! Motion of two round features in the program, with its derivatives.
//!
//! With D the shortest vector between their cores (eq. 4a), and s and t the optimal parameters
//! along them,
//!
//! ```text
//! D = r_A + A(q_A)(a + s u) − r_B − A(q_B)(b + t v),   g = |D|_n
//! ```
//!
//! s and t depend on the poses. They are optimal, so they do not contribute to the first
//! derivatives. They do contribute to the second derivatives.

use super::component::{
    Curvature, Forms, MotionComponent, PointPair, PosePair, ProgramPose, TurnedPoint, rows,
    weighted,
};
use nalgebra::{SMatrix, SVector, Vector3};
use tumble_core::contact::CorePair;
use tumble_core::contact::curved::{Core, Reach, shortest_way};
use tumble_core::mechanics::quaternion::rotated_point_forms;

/// Two round features in contact.
#[derive(Debug, Clone)]
pub(crate) struct RoundFeatures {
    of_a: Core,
    of_b: Core,
    /// Nearest points of both cores at step k, which define the slip.
    pub(crate) points: PointPair,
    /// Core directions u and v.
    along_a: TurnedPoint,
    along_b: TurnedPoint,
    /// Normal n at step k, world.
    normal: Vector3<f64>,
    /// Forms of a vector that is zero only where no point of A's core turns.
    pub(crate) widest: Forms,
}

/// Derivatives with respect to (r_A − r_B, q_A, q_B).
type ByPoses = SVector<f64, 11>;

/// Nearest points of both cores at given poses.
struct Met {
    shares: (f64, f64),
    way: Vector3<f64>,
    reach: Reach,
    /// (E, J_A, −J_B) at the nearest points, and the forms of these points.
    slope: SMatrix<f64, 3, 11>,
    forms: (Forms, Forms),
    /// A(q_A) u and A(q_B) v.
    along: (Vector3<f64>, Vector3<f64>),
}

impl RoundFeatures {
    /// Creates the features of a contact with the `normal` at step k (world).
    pub(crate) fn new(curved: &CorePair, normal: Vector3<f64>) -> Self {
        let farthest = [curved.of_a.from, curved.of_a.at(1.0)];
        let reach = farthest[0].abs() + farthest[1].abs();
        Self {
            of_a: curved.of_a,
            of_b: curved.of_b,
            points: PointPair::new(curved.point(), curved.foot()),
            along_a: TurnedPoint::new(curved.of_a.along),
            along_b: TurnedPoint::new(curved.of_b.along),
            normal,
            widest: rotated_point_forms(&reach),
        }
    }

    /// Distance |D|_n with its direction m. Its derivatives are m for r_A, J_Aᵀ m for q_A and −J_Bᵀ
    /// m for q_B, at the nearest points.
    pub(crate) fn distance(&self, at: PosePair) -> MotionComponent {
        let met = self.meet(at.a, at.b);
        let by: ByPoses = met.slope.tr_mul(&met.reach.direction);
        MotionComponent {
            value: met.reach.length,
            by_position: by.fixed_rows::<3>(0).into(),
            by_a: by.fixed_rows::<4>(3).into(),
            by_b: by.fixed_rows::<4>(7).into(),
        }
    }

    /// Second derivatives of [`Self::distance`], with J = (E, J_A, −J_B) and P = ∂²|D|_n/∂D². For
    /// each core along which the nearest point is free to move, w = A(q_A) u or −A(q_B) v, and ẇ is
    /// its derivative:
    ///
    /// ```text
    /// Jᵀ P J + Σ m_k ∇²D_k − C S⁻¹ Cᵀ,   C = Jᵀ P w + ẇᵀ m,   S = wᵀ P w       (eq. D13)
    /// ```
    pub(crate) fn distance_curvature(&self, at: PosePair) -> Curvature {
        let met = self.meet(at.a, at.b);
        let round = met.reach.curvature(&met.way, &self.normal);
        let m = &met.reach.direction;
        let mut whole = met.slope.transpose() * round * met.slope;
        let turned = (weighted(&met.forms.0, m), weighted(&met.forms.1, m));
        let mut own = whole.fixed_view_mut::<4, 4>(3, 3);
        own += turned.0;
        if at.b.is_some() {
            let mut others = whole.fixed_view_mut::<4, 4>(7, 7);
            others -= turned.1;
        }
        whole -= self.sliding(&met, at, &round);
        Curvature {
            aa: whole.fixed_view::<4, 4>(3, 3).into(),
            bb: whole.fixed_view::<4, 4>(7, 7).into(),
            ab: whole.fixed_view::<4, 4>(3, 7).into(),
            position_a: whole.fixed_view::<3, 4>(0, 3).into(),
            position_b: whole.fixed_view::<3, 4>(0, 7).into(),
            positions: whole.fixed_view::<3, 3>(0, 0).into(),
        }
    }

    /// C S⁻¹ Cᵀ of the nearest points in the interior of their segments.
    fn sliding(
        &self,
        met: &Met,
        at: PosePair,
        round: &nalgebra::Matrix3<f64>,
    ) -> SMatrix<f64, 11, 11> {
        let PosePair { a, b } = at;
        let is_free = |core: &Core, share: f64| {
            met.reach.is_exact && core.is_segment() && 0.0 < share && share < 1.0
        };
        let m = &met.reach.direction;
        let mut ways: [Option<(ByPoses, Vector3<f64>)>; 2] = [None; 2];
        if is_free(&self.of_a, met.shares.0) {
            let mut by = met.slope.tr_mul(&(round * met.along.0));
            let mut turning = by.fixed_rows_mut::<4>(3);
            turning += rows(&self.along_a.forms, &a.attitude).tr_mul(m);
            ways[0] = Some((by, met.along.0));
        }
        if is_free(&self.of_b, met.shares.1) {
            let mut by = -met.slope.tr_mul(&(round * met.along.1));
            if let Some(b) = b {
                let mut turning = by.fixed_rows_mut::<4>(7);
                turning -= rows(&self.along_b.forms, &b.attitude).tr_mul(m);
            }
            ways[1] = Some((by, -met.along.1));
        }
        match ways {
            [Some((first, w)), Some((second, z))] => {
                let (ww, wz, zz) = (w.dot(&(round * w)), w.dot(&(round * z)), z.dot(&(round * z)));
                let determinant = ww * zz - wz * wz;
                if determinant <= 1e-12 * ww * zz {
                    // Parallel segments: one parameter determines the other.
                    return first * first.transpose() / ww;
                }
                let mixed = first * second.transpose();
                (first * first.transpose() * zz - (mixed + mixed.transpose()) * wz
                    + second * second.transpose() * ww)
                    / determinant
            }
            [Some((by, w)), None] | [None, Some((by, w))] => {
                by * by.transpose() / w.dot(&(round * w))
            }
            [None, None] => SMatrix::zeros(),
        }
    }

    fn meet(&self, a: ProgramPose, b: Option<ProgramPose>) -> Met {
        let moved = |core: &Core, along: &TurnedPoint, place: &ProgramPose| Core {
            from: place.position
                + 0.5 * rows(&rotated_point_forms(&core.from), &place.attitude) * place.attitude,
            along: 0.5 * rows(&along.forms, &place.attitude) * place.attitude,
        };
        let core_a = moved(&self.of_a, &self.along_a, &a);
        let core_b = b.as_ref().map_or(self.of_b, |b| moved(&self.of_b, &self.along_b, b));
        let (shares, way) = shortest_way(&core_a, &core_b);
        let forms = (
            rotated_point_forms(&self.of_a.at(shares.0)),
            rotated_point_forms(&self.of_b.at(shares.1)),
        );
        let mut slope = SMatrix::<f64, 3, 11>::identity();
        slope.fixed_view_mut::<3, 4>(0, 3).copy_from(&rows(&forms.0, &a.attitude));
        if let Some(b) = b {
            slope.fixed_view_mut::<3, 4>(0, 7).copy_from(&-rows(&forms.1, &b.attitude));
        }
        let reach = Reach::of(&way, &self.normal);
        Met { shares, way, reach, slope, forms, along: (core_a.along, core_b.along) }
    }
}
