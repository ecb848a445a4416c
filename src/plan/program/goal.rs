//! What targets and starts ask for, as functions of states with their first and second derivatives.

use crate::mechanics::State;
use crate::mechanics::quaternion::{left, right, rotated_point_forms};
use crate::plan::TargetKind;
use crate::solver::ipopt::units::Units;
use crate::step_nlp::layout::{ATTITUDE, POSITION, SPIN, VELOCITY};
use crate::step_nlp::several::component::rows;
use nalgebra::{Matrix4, Matrix4x3, RowVector4, Vector3, Vector4};

/// The sum of the squares of a target's rows, as a function of one part of a state.
pub(super) struct Goal {
    pub(super) value: f64,
    /// The part's first coordinate in the state, and how many there are.
    pub(super) first: usize,
    pub(super) count: usize,
    /// Of the part, the first `count`.
    pub(super) slope: Vector4<f64>,
    pub(super) curvature: Matrix4<f64>,
}

impl Goal {
    /// That of `kind` where the body is at `state`, in `units`.
    ///
    /// ```text
    /// attitude:  4 atan2(|v|, w)²,   (w, v) = q̄_t ⊗ q
    /// turn:      (2 atan2(s, c) − α)²,   (c, ·) = q ⊗ q̄_f, s its part along the axis
    /// direction: Σ_k (½ qᵀ Q_k(b) q − d_k)²                                         (eq. P18)
    /// ```
    pub(super) fn of(kind: &TargetKind, state: &State, units: &Units) -> Self {
        match kind {
            TargetKind::Position(wanted) => {
                Self::apart(wanted, &state.position, POSITION.start, units.length())
            }
            TargetKind::Velocity(wanted) => {
                Self::apart(wanted, &state.velocity, VELOCITY.start, units.speed())
            }
            TargetKind::Spin(wanted) => {
                let rate = units.speed() / units.length();
                Self::apart(wanted, &state.spin, SPIN.start, rate)
            }
            TargetKind::Attitude(wanted) => Self::turned(&left(&conjugated(wanted)), state),
            TargetKind::Turn { axis, angle, from } => {
                let map = right(&conjugated(from));
                let along = axis[0] * map.row(1) + axis[1] * map.row(2) + axis[2] * map.row(3);
                Self::turned_about((&along, &map.row(0).into_owned()), *angle, state)
            }
            TargetKind::Direction { of, to } => Self::pointed(of, to, state),
        }
    }

    fn attitude(value: f64, slope: Vector4<f64>, curvature: Matrix4<f64>) -> Self {
        Self { value, first: ATTITUDE.start, count: 4, slope, curvature }
    }

    fn apart(wanted: &[Option<f64>; 3], found: &Vector3<f64>, first: usize, unit: f64) -> Self {
        let mut goal = Self {
            value: 0.0,
            first,
            count: 3,
            slope: Vector4::zeros(),
            curvature: Matrix4::zeros(),
        };
        for (k, wanted) in wanted.iter().enumerate() {
            let Some(wanted) = wanted else { continue };
            let apart = unit * found[k] - wanted;
            goal.value += apart * apart;
            goal.slope[k] = 2.0 * unit * apart;
            goal.curvature[(k, k)] = 2.0 * unit * unit;
        }
        goal
    }

    /// The square of the angle of p = `map` q, of p and −p the smaller one.
    fn turned(map: &Matrix4<f64>, state: &State) -> Self {
        let mut p = map * state.attitude;
        let mut map = *map;
        if p[0] < 0.0 {
            (p, map) = (-p, -map);
        }
        let (w, v) = (p[0], Vector3::new(p[1], p[2], p[3]));
        let t = v.norm();
        let n = t * t + w * w;
        let a = libm::atan2(t, w);
        let along = if t > 0.0 { v / t } else { v };
        // F = 4 a², by t and w.
        let by_t = 8.0 * a * w / n;
        let by_w = -8.0 * a * t / n;
        let turn = (t * t - w * w) / (n * n);
        let by_tt = 8.0 * (w * w / (n * n) - a * 2.0 * w * t / (n * n));
        let by_tw = 8.0 * (-w * t / (n * n) + a * turn);
        let by_ww = 8.0 * (t * t / (n * n) + a * 2.0 * w * t / (n * n));
        // F_t/t, which is 8/n where t vanishes.
        let across = if t > 1e-8 * w { by_t / t } else { 8.0 / n };
        let mut slope = Vector4::zeros();
        slope[0] = by_w;
        slope.fixed_rows_mut::<3>(1).copy_from(&(along * by_t));
        let mut curvature = Matrix4::zeros();
        curvature[(0, 0)] = by_ww;
        for i in 0..3 {
            (curvature[(0, 1 + i)], curvature[(1 + i, 0)]) = (by_tw * along[i], by_tw * along[i]);
            for j in 0..3 {
                let same = if i == j { across } else { 0.0 };
                curvature[(1 + i, 1 + j)] = same + (by_tt - across) * along[i] * along[j];
            }
        }
        Self::attitude(4.0 * a * a, map.tr_mul(&slope), map.transpose() * curvature * map)
    }

    fn turned_about(
        (along, real): (&RowVector4<f64>, &RowVector4<f64>),
        angle: f64,
        state: &State,
    ) -> Self {
        let q = &state.attitude;
        let (s, c) = ((along * q)[0], (real * q)[0]);
        let n = s * s + c * c;
        let turn = 2.0 * std::f64::consts::PI;
        let apart = 2.0 * libm::atan2(s, c) - angle;
        let apart = apart - turn * libm::round(apart / turn);
        let (sigma, kappa) = (along.transpose(), real.transpose());
        let slope = sigma * (2.0 * c / n) - kappa * (2.0 * s / n);
        let mixed = sigma * kappa.transpose();
        let bend = (kappa * kappa.transpose() - sigma * sigma.transpose())
            * (4.0 * c * s / (n * n))
            + (mixed + mixed.transpose()) * (2.0 * (s * s - c * c) / (n * n));
        let curvature = slope * slope.transpose() * 2.0 + bend * (2.0 * apart);
        Self::attitude(apart * apart, slope * (2.0 * apart), curvature)
    }

    fn pointed(of: &Vector3<f64>, to: &Vector3<f64>, state: &State) -> Self {
        let forms = rotated_point_forms(of);
        let slopes = rows(&forms, &state.attitude);
        let apart = slopes * state.attitude * 0.5 - to;
        let mut curvature = slopes.transpose() * slopes * 2.0;
        for (form, apart) in forms.iter().zip(&apart) {
            curvature += form * (2.0 * apart);
        }
        Self::attitude(apart.norm_squared(), slopes.tr_mul(&apart) * 2.0, curvature)
    }
}

/// The unit quaternion of a rotation vector with its derivatives (eq. P22): with s = |θ|²,
///
/// ```text
/// w = cos ½|θ|,   v = F θ,   F = sin(½|θ|)/|θ|,   F' = dF/ds,
/// ∂w = −½ F θ,    ∂v = F E + 2 F' θ θᵀ
/// ```
pub(super) struct Exponential {
    theta: Vector3<f64>,
    pub(super) quaternion: Vector4<f64>,
    /// F, F', F''.
    factors: [f64; 3],
}

impl Exponential {
    pub(super) fn of(theta: &Vector3<f64>) -> Self {
        let s = theta.norm_squared();
        let (sin, cos) = libm::sincos(0.5 * s.sqrt());
        // By their series where the closed forms lose digits.
        let factors = if s < 0.04 {
            [
                0.5 - s / 48.0 + s * s / 3840.0 - s * s * s / 645_120.0,
                -1.0 / 48.0 + s / 1920.0 - s * s / 215_040.0 + s * s * s / 46_448_640.0,
                1.0 / 1920.0 - s / 107_520.0 + s * s / 15_482_880.0,
            ]
        } else {
            let first = sin / s.sqrt();
            let second = (0.5 * cos - first) / (2.0 * s);
            [first, second, (-first / 8.0 - 3.0 * second) / (2.0 * s)]
        };
        let v = theta * factors[0];
        Self { theta: *theta, quaternion: Vector4::new(cos, v[0], v[1], v[2]), factors }
    }

    pub(super) fn slope(&self) -> Matrix4x3<f64> {
        let [first, second, _] = self.factors;
        let theta = &self.theta;
        let mut slope = Matrix4x3::zeros();
        for j in 0..3 {
            slope[(0, j)] = -0.5 * first * theta[j];
            for i in 0..3 {
                let same = if i == j { first } else { 0.0 };
                slope[(1 + i, j)] = same + 2.0 * second * theta[i] * theta[j];
            }
        }
        slope
    }

    /// ∇²(y·q).
    pub(super) fn curvature(&self, y: &Vector4<f64>) -> nalgebra::Matrix3<f64> {
        let [first, second, third] = self.factors;
        let theta = &self.theta;
        let along = Vector3::new(y[1], y[2], y[3]);
        let outer = theta * theta.transpose();
        let mixed = along * theta.transpose();
        let identity = nalgebra::Matrix3::identity();
        (identity * first + outer * (2.0 * second)) * (-0.5 * y[0])
            + (identity * along.dot(theta) + mixed + mixed.transpose()) * (2.0 * second)
            + outer * (4.0 * third * along.dot(theta))
    }
}

fn conjugated(q: &Vector4<f64>) -> Vector4<f64> {
    Vector4::new(q[0], -q[1], -q[2], -q[3])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Central differences of 1e-5, whose error is some 1e-9 of these numbers.
    #[test]
    fn slopes_and_curvatures_are_those_of_differences() {
        let axis = Vector3::new(0.2, 0.5, 0.9).normalize();
        let quaternion = Vector4::new(0.9, 0.1, -0.3, 0.2).normalize();
        let kinds = [
            TargetKind::Position([Some(1.0), None, Some(2.0)]),
            TargetKind::Velocity([None, Some(0.0), Some(0.3)]),
            TargetKind::Spin([Some(0.1); 3]),
            TargetKind::Attitude(quaternion),
            TargetKind::Attitude(Vector4::new(0.3, -0.7, 0.2, 0.5001).normalize()),
            TargetKind::Turn { axis, angle: 0.7, from: quaternion },
            TargetKind::Direction { of: axis, to: Vector3::new(0.0, 0.0, -1.0) },
        ];
        let state = State {
            position: Vector3::new(0.3, -1.0, 2.0),
            attitude: Vector4::new(0.3, -0.7, 0.2, 0.5),
            velocity: Vector3::new(1.0, 2.0, -0.5),
            spin: Vector3::new(9.0, -14.0, 5.0),
        };
        for kind in kinds {
            let goal = Goal::of(&kind, &state, &Units::SI);
            let sum: f64 = kind.rows(&unit(&state)).iter().map(|row| row.value * row.value).sum();
            assert!((Goal::of(&kind, &unit(&state), &Units::SI).value - sum).abs() < 1e-12);
            for k in 0..goal.count {
                let moved = |by: f64| {
                    let mut x = state.to_vector();
                    x[goal.first + k] += by;
                    Goal::of(&kind, &State::from_vector(&x), &Units::SI)
                };
                let (up, down) = (moved(1e-5), moved(-1e-5));
                assert!(((up.value - down.value) / 2e-5 - goal.slope[k]).abs() < 1e-7, "{kind:?}");
                let column = (up.slope - down.slope) / 2e-5;
                assert!((column - goal.curvature.column(k)).amax() < 1e-6, "{kind:?}");
            }
        }
    }

    fn unit(state: &State) -> State {
        State { attitude: state.attitude.normalize(), ..*state }
    }

    #[test]
    fn the_exponentials_derivatives_are_those_of_differences() {
        let y = Vector4::new(0.3, -0.8, 0.5, 1.1);
        for size in [1e-3, 0.15, 0.19, 0.21, 1.0, 2.5] {
            let theta = Vector3::new(0.3, -0.8, 0.5).normalize() * size;
            let here = Exponential::of(&theta);
            for k in 0..3 {
                let moved = |by: f64| Exponential::of(&(theta + Vector3::ith(k, by)));
                let (up, down) = (moved(1e-5), moved(-1e-5));
                let column = (up.quaternion - down.quaternion) / 2e-5;
                assert!((column - here.slope().column(k)).amax() < 1e-10, "{size}");
                let column = (up.slope() - down.slope()).tr_mul(&y) / 2e-5;
                assert!((column - here.curvature(&y).column(k)).amax() < 1e-9, "{size}");
            }
        }
    }
}
