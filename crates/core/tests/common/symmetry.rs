//! States in a rotated frame and in a mirror.

// Every test program compiles this file separately and uses only a part of it.
#![allow(dead_code)]

use nalgebra::{Vector3, Vector4};
use tumble_core::mechanics::State;
use tumble_core::mechanics::quaternion::{left, rotation};

/// State after the whole world is rotated by the unit quaternion `q`.
pub fn turned(state: &State, q: &Vector4<f64>) -> State {
    let turn = rotation(q);
    State {
        position: turn * state.position,
        attitude: left(q) * state.attitude,
        velocity: turn * state.velocity,
        spin: state.spin,
    }
}

/// State in the mirror x → −x.
///
/// Spin is an axial vector: its x component stays and the others change sign. The same holds for
/// the attitude, because the body frame is mirrored too. Boxes, rods and balls are their own mirror
/// images.
pub fn mirrored(state: &State) -> State {
    let (r, q, v, w) = (&state.position, &state.attitude, &state.velocity, &state.spin);
    State {
        position: Vector3::new(-r[0], r[1], r[2]),
        attitude: Vector4::new(q[0], q[1], -q[2], -q[3]),
        velocity: Vector3::new(-v[0], v[1], v[2]),
        spin: Vector3::new(w[0], -w[1], -w[2]),
    }
}
