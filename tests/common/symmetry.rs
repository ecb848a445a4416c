//! States seen from another frame, and in a mirror.

// Each test program compiles this file for itself and uses a part of it.
#![allow(dead_code)]

use nalgebra::{Vector3, Vector4};
use tumble_core::mechanics::State;
use tumble_core::mechanics::quaternion::{left, rotation};

/// The state where the whole world is turned by `q`, of length 1.
pub fn turned(state: &State, q: &Vector4<f64>) -> State {
    let turn = rotation(q);
    State {
        position: turn * state.position,
        attitude: left(q) * state.attitude,
        velocity: turn * state.velocity,
        spin: state.spin,
    }
}

/// The state in the mirror x → −x. Spins are axial vectors: their x stays, the others turn
/// round; so do the attitude's, for the body frame is mirrored as well. Boxes, rods and balls are
/// their own mirror images.
pub fn mirrored(state: &State) -> State {
    let (r, q, v, w) = (&state.position, &state.attitude, &state.velocity, &state.spin);
    State {
        position: Vector3::new(-r[0], r[1], r[2]),
        attitude: Vector4::new(q[0], q[1], -q[2], -q[3]),
        velocity: Vector3::new(-v[0], v[1], v[2]),
        spin: Vector3::new(w[0], -w[1], -w[2]),
    }
}
