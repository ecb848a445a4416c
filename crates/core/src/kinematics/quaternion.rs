//! Quaternion maps as matrices, after Jackson, Tracy and Manchester, "Planning with attitude", IEEE
//! RA-L 6(3), 2021.
//!
//! A quaternion is q = (w, x, y, z), scalar first, with Hamilton's product. It rotates body
//! coordinates to world coordinates. It is a plain [`Vector4`] because the step problem treats its
//! four numbers as variables of any norm.
//!
//! Equation numbers are those of `docs/formulation.md`.

use nalgebra::{Matrix3, Matrix4, Matrix4x3, Vector3, Vector4};

/// Matrix L(q) with q ⊗ p = L(q) p (eq. 1).
pub fn left(q: &Vector4<f64>) -> Matrix4<f64> {
    let (w, x, y, z) = (q[0], q[1], q[2], q[3]);
    Matrix4::new(
        w, -x, -y, -z, //
        x, w, -z, y, //
        y, z, w, -x, //
        z, -y, x, w,
    )
}

/// Product p ⊗ q.
#[inline]
pub fn product(p: &Vector4<f64>, q: &Vector4<f64>) -> Vector4<f64> {
    let ([a, b, c, d], [w, x, y, z]) = (p.data.0[0], q.data.0[0]);
    Vector4::new(
        a * w - b * x - c * y - d * z,
        b * w + a * x - d * y + c * z,
        c * w + d * x + a * y - b * z,
        d * w - c * x + b * y + a * z,
    )
}

/// Conjugate q*.
pub fn conjugated(q: &Vector4<f64>) -> Vector4<f64> {
    Vector4::new(q[0], -q[1], -q[2], -q[3])
}

/// Rotation vector of a quaternion, with an angle of at most π (rad).
pub fn rotation_vector(q: &Vector4<f64>) -> Vector3<f64> {
    let along = q.fixed_rows::<3>(1).into_owned();
    let sine = along.norm();
    if sine == 0.0 {
        return Vector3::zeros();
    }
    let sign = if q[0] < 0.0 { -1.0 } else { 1.0 };
    along * (sign * 2.0 * libm::atan2(sine, q[0].abs()) / sine)
}

/// Matrix R(q) with p ⊗ q = R(q) p (eq. 1).
pub fn right(q: &Vector4<f64>) -> Matrix4<f64> {
    let (w, x, y, z) = (q[0], q[1], q[2], q[3]);
    Matrix4::new(
        w, -x, -y, -z, //
        x, w, z, -y, //
        y, -z, w, x, //
        z, y, -x, w,
    )
}

/// Matrix H = [0; E₃] that maps a vector to a pure quaternion (eq. 1).
pub fn pure() -> Matrix4x3<f64> {
    Matrix4x3::new(
        0.0, 0.0, 0.0, //
        1.0, 0.0, 0.0, //
        0.0, 1.0, 0.0, //
        0.0, 0.0, 1.0,
    )
}

/// Matrix L(q) H (4 × 3) of the attitude kinematics q̇ = ½ L(q) H ω (eq. 5).
pub fn attitude_map(q: &Vector4<f64>) -> Matrix4x3<f64> {
    let (w, x, y, z) = (q[0], q[1], q[2], q[3]);
    Matrix4x3::new(
        -x, -y, -z, //
        w, -z, y, //
        z, w, -x, //
        -y, x, w,
    )
}

/// Derivative of the rotation vector φ = log(q), |φ| ≤ π (rad), with respect to a further rotation
/// δθ of q (rad, body frame):
///
/// ```text
/// δφ = (E + ½ [φ]× + (1/φ² − (1 + cos φ)/(2 φ sin φ)) [φ]×²) δθ
/// ```
pub fn turn_slope(turn: &Vector3<f64>) -> Matrix3<f64> {
    let (angle, cross) = (turn.norm(), turn.cross_matrix());
    // Series for small angles. At half a turn the second term is 0.
    let share = if angle < 1e-3 {
        1.0 / 12.0 + angle * angle / 720.0
    } else {
        (1.0 - 0.5 * angle / libm::tan(0.5 * angle)) / (angle * angle)
    };
    Matrix3::identity() + cross * 0.5 + cross * cross * share
}

/// Rotation matrix A(q) = Hᵀ L(q) R(q)ᵀ H (eq. 2), body → world, of a unit quaternion; multiplied
/// by |q|² in general.
pub fn rotation(q: &Vector4<f64>) -> Matrix3<f64> {
    let (w, x, y, z) = (q[0], q[1], q[2], q[3]);
    let (ww, xx, yy, zz) = (w * w, x * x, y * y, z * z);
    Matrix3::new(
        ww + xx - yy - zz,
        2.0 * (x * y - w * z),
        2.0 * (x * z + w * y),
        2.0 * (x * y + w * z),
        ww - xx + yy - zz,
        2.0 * (y * z - w * x),
        2.0 * (x * z - w * y),
        2.0 * (y * z + w * x),
        ww - xx - yy + zz,
    )
}

/// Constant symmetric matrices Q_k(c) with (A(q) c)_k = ½ qᵀ Q_k q (eq. 3).
///
/// A(q) c is a quadratic form in q, so Q_k q is the gradient of component k, and Q_k is its
/// Hessian. The same matrices give the values and both derivatives of a contact point's position.
pub fn rotated_point_forms(c: &Vector3<f64>) -> [Matrix4<f64>; 3] {
    let (x, y, z) = (c[0], c[1], c[2]);
    [
        2.0 * Matrix4::new(
            x, 0.0, z, -y, //
            0.0, x, y, z, //
            z, y, -x, 0.0, //
            -y, z, 0.0, -x,
        ),
        2.0 * Matrix4::new(
            y, -z, 0.0, x, //
            -z, -y, x, 0.0, //
            0.0, x, y, z, //
            x, 0.0, z, -y,
        ),
        2.0 * Matrix4::new(
            z, y, -x, 0.0, //
            y, -z, 0.0, x, //
            -x, 0.0, -z, y, //
            0.0, x, y, z,
        ),
    ]
}

/// Unit quaternion q/|q| of a nonzero `q`. A unit quaternion to rounding is returned unchanged, so
/// that writing and reading reproduces its bits.
pub fn unit(q: Vector4<f64>) -> Vector4<f64> {
    /// Largest rounding error of the squared norm of q/|q|.
    const ROUNDING: f64 = 1e-15;
    if (q.norm_squared() - 1.0).abs() <= ROUNDING { q } else { q.normalize() }
}

/// Attitude after a step with the stretched spin γ ω (eq. 8b): normalise(q + ½ h L(q) H γ ω).
pub fn advance(q: &Vector4<f64>, spin: &Vector3<f64>, time_step: f64) -> Vector4<f64> {
    (q + attitude_map(q) * (spin * (0.5 * time_step))).normalize()
}

/// Stretched angular velocity Ω (rad/s), world frame, with which [`advance`] rotates a body from the attitude
/// `from` to `to` (rotation matrices, body → world) in `time_step` (s). S = A⁺ Aᵀ is the Cayley map
/// of a = ½ h Ω:
///
/// ```text
/// S = (E − [a]×)⁻¹ (E + [a]×),   S − Sᵀ = 4 [a]×/(1 + |a|²),   1 + tr S = 4/(1 + |a|²).
/// ```
pub fn turning_rate(from: &Matrix3<f64>, to: &Matrix3<f64>, time_step: f64) -> Vector3<f64> {
    let turn = to * from.transpose();
    let twist = Vector3::new(
        turn[(2, 1)] - turn[(1, 2)],
        turn[(0, 2)] - turn[(2, 0)],
        turn[(1, 0)] - turn[(0, 1)],
    );
    twist * (2.0 / (time_step * (1.0 + turn.trace())))
}

#[cfg(test)]
#[path = "tests/quaternion.rs"]
mod tests;
