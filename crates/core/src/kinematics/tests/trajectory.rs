//! Unit tests of `trajectory.rs`.

use super::*;

fn state(position: [f64; 3], attitude: [f64; 4]) -> State {
    let zero = Vector3::zeros();
    let attitude = Vector4::from(attitude).normalize();
    State { position: Vector3::from(position), attitude, velocity: zero, spin: zero }
}

/// Both ends are reproduced for either sign of a quaternion, and half of the path is half of
/// the rotation, to rounding.
#[test]
fn trajectory_has_constant_velocity_and_spin() {
    let from = state([1.0, 2.0, 3.0], [0.3, -0.5, 0.7, 0.2]);
    for sign in [1.0, -1.0] {
        let mut to = state([0.0, 2.5, 3.0], [0.5, -0.1, 0.6, 0.3]);
        to.attitude *= sign;
        let trajectory = Trajectory::between(&from, &to);
        for (share, end) in [(0.0, from.pose()), (1.0, to.pose())] {
            let found = trajectory.at(share);
            assert!((found.position - end.position).amax() < 1e-15);
            assert!((found.rotation - end.rotation).amax() < 1e-14);
        }
        let [start, middle, end] = [0.0, 0.5, 1.0].map(|share| trajectory.at(share).rotation);
        let halves = [middle * start.transpose(), end * middle.transpose()];
        assert!((halves[0] - halves[1]).amax() < 1e-14);
        let cosine = 0.5 * (halves[0].trace() - 1.0);
        assert!((cosine - (0.5 * trajectory.angle()).cos()).abs() < 1e-14);
        assert!((trajectory.turn().norm() - trajectory.angle()).abs() < 1e-14);
    }
    assert_eq!(Trajectory::between(&from, &from).angle(), 0.0);
}
