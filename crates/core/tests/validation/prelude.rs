//! Imports of most problems, and small functions that they share.

pub(crate) use crate::Input::{Friction, Gravity, Mass, Restitution, Slope, Speed};
pub(crate) use crate::quantity::{at_most, at_most_zero, equal, order, within};
pub(crate) use crate::runner::{Runner, Setup, Subject, TestRun, TestStep, largest};
pub(crate) use crate::threshold::{MOVING, RESOLUTION, Threshold};
pub(crate) use crate::tolerance::{SlideStep, SlideTolerance, Slider};
use crate::turning::half_tangent;
pub(crate) use crate::{
    Convergence, Input, Refusal, SolvedBy, TestInputs, TestProblem, TestQuantity,
};
pub(crate) use nalgebra::{Vector2, Vector3, Vector4};
pub(crate) use tumble_core::contact::Partner;
pub(crate) use tumble_core::error::Error;
pub(crate) use tumble_core::geometry::Piece;
pub(crate) use tumble_core::joint::{Drive, Joint, JointFrame, Motor};
pub(crate) use tumble_core::mechanics::quaternion::rotation;
pub(crate) use tumble_core::mechanics::{Polyline, RigidBody, Rotation, State};

/// The usual gravity.
pub(crate) const EARTH: (Input, f64) = (Gravity, 9.81);

/// A vector.
pub(crate) fn v3(x: f64, y: f64, z: f64) -> Vector3<f64> {
    Vector3::new(x, y, z)
}

/// A body at rest and upright, its centre at `height` (m).
pub(crate) fn resting(height: f64) -> State {
    at_rest(v3(0.0, 0.0, height))
}

/// A body at rest and upright.
pub(crate) fn at_rest(position: Vector3<f64>) -> State {
    let attitude = Vector4::new(1.0, 0.0, 0.0, 0.0);
    State { attitude, ..State::at_rest(position) }
}

/// The attitude of a rotation by `angle` (rad) about the y axis.
pub(crate) fn about_y(angle: f64) -> Vector4<f64> {
    let (sin, cos) = (0.5 * angle).sin_cos();
    Vector4::new(cos, 0.0, sin, 0.0)
}

/// The rotation angle about body axis `axis`, rad.
pub(crate) fn angle_about(axis: usize, state: &State) -> f64 {
    2.0 * state.attitude[1 + axis].atan2(state.attitude[0])
}

/// A hinge at the points `at` of body `a` (body axes) and of `b`, or of the world, with the same axis in both.
pub(crate) fn hinge(
    a: usize,
    b: Option<usize>,
    at: [Vector3<f64>; 2],
    axis: Vector3<f64>,
    drive: Drive,
) -> Result<Joint, Error> {
    let frames = [JointFrame::along(at[0], axis)?, JointFrame::along(at[1], axis)?];
    Ok(Joint::revolute(a, b, frames, drive))
}

/// The last of `values`.
pub(crate) fn last<T>(values: &[T]) -> &T {
    &values[values.len() - 1]
}

/// The states x_0 … x_n of the recurrence x_{k+1} = `step`(x_k).
pub(crate) fn recurrence<T>(start: T, n: usize, step: impl Fn(&T) -> T) -> Vec<T> {
    std::iter::successors(Some(start), |x| Some(step(x))).take(n + 1).collect()
}

/// The times of the zeros of `values` in steps of `h` (s), by linear interpolation. `counts`
/// selects zeros by the values on both sides.
pub(crate) fn zeros(values: &[f64], h: f64, counts: impl Fn(f64, f64) -> bool) -> Vec<f64> {
    let pairs = values.windows(2).enumerate().filter(|(_, pair)| counts(pair[0], pair[1]));
    pairs.map(|(k, pair)| h * (k as f64 + pair[0] / (pair[0] - pair[1]))).collect()
}

/// The mean of the first `count` intervals between `times`; NaN if there are fewer.
pub(crate) fn mean_interval(times: &[f64], count: usize) -> f64 {
    times.get(count).map_or(f64::NAN, |last| (last - times[0]) / count as f64)
}

/// The arithmetic–geometric mean.
pub(crate) fn agm(mut a: f64, mut b: f64) -> f64 {
    for _ in 0..10 {
        (a, b) = (0.5 * (a + b), (a * b).sqrt());
    }
    a
}

/// The root of a function near `start` by Newton's method; `function` has the value and the derivative.
/// The iterations are enough to settle to the last digit.
pub(crate) fn newton(start: f64, function: impl Fn(f64) -> (f64, f64)) -> f64 {
    (0..40).fold(start, |x, _| {
        let (value, slope) = function(x);
        x - value / slope
    })
}

/// The angular momentum w(ω) per moment of inertia (eq. 34), and its derivative. With x = ½ h ω and the
/// tangent t(x) of half the angle, it is ω (1 + t²)/t′. The spin ω (rad/s) is about a principal axis,
/// and steps have length `h` (s).
pub(crate) fn momentum(h: f64, spin: f64) -> (f64, f64) {
    let x = 0.5 * h * spin;
    let [t, slope, bend] = half_tangent(x);
    let share = (1.0 + t * t) / slope;
    (spin * share, share + x * (2.0 * t - share * bend / slope))
}

/// The convergence of a `value` whose error is that of w(ω), ω at the end `spin` (rad/s): the series of
/// the tangent lacks (62/315) x⁸ of its derivative.
pub(crate) fn lagging(h: f64, spin: f64, value: f64, steps: f64) -> Convergence {
    within(0.2 * (0.5 * h * spin).powi(8) * value.abs(), steps)
}

/// The rotation of a step (rad) with this spin (rad/s), 2 atan t, and its derivative (s).
pub(crate) fn turn(h: f64, spin: f64) -> (f64, f64) {
    let [t, slope, _] = half_tangent(0.5 * h * spin);
    (2.0 * t.atan(), h * slope / (1.0 + t * t))
}
