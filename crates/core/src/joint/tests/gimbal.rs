//! Unit tests of `gimbal.rs`.

use super::angles as angles_of;
use super::*;
use crate::mechanics::quaternion::left;

fn about(axis: usize, angle: f64) -> Vector4<f64> {
    let mut turn = Vector4::new((0.5 * angle).cos(), 0.0, 0.0, 0.0);
    turn[axis + 1] = (0.5 * angle).sin();
    turn
}

/// Rotation (J13) of given angles.
fn turn(angles: &Vector3<f64>, middle: &Middle) -> Vector4<f64> {
    let first = left(&about(1, angles[1])) * about(2, middle.raw(angles[2]));
    left(&first) * about(0, angles[0])
}

const MIDDLES: [Middle; 3] = [
    Middle::STRAIGHT,
    Middle { backwards: true, zero: 0.0 },
    Middle { backwards: true, zero: 0.4 },
];

/// Middle angles beyond a quarter turn and full turns are recovered from nearby angles.
#[test]
fn gimbal_angles_round_trip_through_attitude() {
    for middle in &MIDDLES {
        for k in 0..4000 {
            let k = f64::from(k);
            let angles = Vector3::new(0.37 * k, -0.113 * k, 0.0071 * k);
            let near = angles + Vector3::new(0.3, -0.4, 0.2) * (k * 0.7).sin();
            if middle.raw(angles[2]).cos().abs() < 0.3 {
                continue;
            }
            let q = turn(&angles, middle);
            for q in [q, -q] {
                let found = angles_of(&q, &near, middle);
                assert!((found - angles).amax() < 1e-12 * (1.0 + k), "{found} {angles}");
            }
        }
    }
}

#[test]
fn gimbal_derivatives_agree_with_differences() {
    const STEP: f64 = 1e-6;
    for middle in &MIDDLES {
        for k in 0..300 {
            let k = f64::from(k);
            let at = Vector3::new((0.9 * k).sin(), (1.7 * k).cos(), 3.0 * (0.31 * k).sin());
            if middle.raw(at[2]).cos().abs() < 0.1 {
                continue;
            }
            let q = turn(&at, middle);
            let columns = [0, 1, 2].map(|k| left(&q) * about(k, PI));
            let rows = slopes(&q, at[2], middle, &Matrix4x3::from_columns(&columns));
            for (column, by) in columns.iter().enumerate() {
                let moved = |step: f64| angles_of(&(q + by * step), &at, middle);
                let found = (moved(STEP) - moved(-STEP)) / (4.0 * STEP);
                for row in 0..3 {
                    let off = (found[row] - rows[row][column]).abs();
                    assert!(off < 1e-7, "{at} {row} {column}: {off}");
                }
            }
        }
    }
}

/// Hinges about any orthogonal axes rotate like the product of their rotations.
#[test]
fn hinges_turn_one_after_the_other() {
    let y = Vector3::new(0.3, -0.5, 0.8).normalize();
    let z = y.cross(&Vector3::x()).normalize();
    let frame = JointFrame { anchor: Vector3::zeros(), attitude: about(0, 0.7) };
    for lean in [0.0, 0.5, -1.2, 2.0, 3.0, -2.5] {
        let last = y.cross(&z) * f64::cos(lean) + y * f64::sin(lean);
        // Axes of any length and slightly off a right angle.
        let axes = [y * 2.0, z + y * 1e-9, last * 0.1];
        let of = Hinges::new([frame, frame], axes).unwrap();
        let angles = [0.4, -0.3, 0.9];
        let unit = |axis: &Vector3<f64>, angle: f64| {
            let along = axis.normalize() * f64::sin(0.5 * angle);
            Vector4::new(f64::cos(0.5 * angle), along[0], along[1], along[2])
        };
        let [a, b, c] = [0, 1, 2].map(|k| unit(&[y, z, last][k], angles[k]));
        let turned = left(&(left(&a) * b)) * c;
        let conjugated = |q: Vector4<f64>| Vector4::new(q[0], -q[1], -q[2], -q[3]);
        // Rotation (J1) of A's frame relative to B's, both expressed in the frame at zero
        // angles.
        let [in_a, in_b] = of.frames.map(|of| left(&conjugated(frame.attitude)) * of.attitude);
        let q = left(&(left(&conjugated(in_b)) * turned)) * in_a;
        let found = angles_of(&q, &Vector3::zeros(), &of.middle);
        for (k, axis) in Hinges::AXES.iter().enumerate() {
            let JointAxis::Angular(axis) = *axis else { unreachable!() };
            assert!((found[axis] - angles[k]).abs() < 1e-8, "{lean}: {found}");
        }
    }
    let skew = [y, y + z, y.cross(&z)];
    let error = Hinges::new([frame, frame], skew).unwrap_err().to_string();
    assert!(error.contains("consecutive hinge axes"), "{error}");
}
