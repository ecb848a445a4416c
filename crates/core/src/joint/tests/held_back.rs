//! Unit tests of `held_back.rs`.

use super::*;
use crate::mechanics::quaternion::advance;

/// Locked axes of all kinds keep the share 1 − s of an error, and stops that of what is passed.
#[test]
fn a_share_of_errors_is_left() {
    let here =
        JointFrame::along(Vector3::new(0.3, -0.1, 0.2), Vector3::new(0.2, 0.9, -0.4)).unwrap();
    let frames = [here; 2];
    let stop = Drive { limits: Some([-0.2, 0.2]), ..Drive::NONE };
    let kinds = [
        Joint::fixed(0, None, frames),
        Joint::revolute(0, None, frames, stop),
        Joint::universal(0, None, frames),
        Joint::prismatic(0, None, frames, stop),
        Joint::spherical(0, None, frames),
    ];
    let still = State::at_rest(Vector3::zeros());
    // 0.25 rad about the joint's axis and 0.25 m along it, and errors of some 1e-6.
    let axis = rotation(&here.attitude).column(2).into_owned();
    let off = Vector3::new(2e-6, -1e-6, 3e-6);
    for (number, joint) in kinds.into_iter().enumerate() {
        let (turn, way) = [(0.0, 0.0), (0.25, 0.0), (0.0, 0.0), (0.0, 0.25), (0.25, 0.0)][number];
        let attitude = advance(&still.attitude, &(turn * axis), 1.0);
        let turned = State { attitude: advance(&attitude, &(off * 2.0), 1.0), ..still };
        let shift = here.anchor - turned.pose().rotation * here.anchor;
        let states = [State { position: shift + way * axis + off, ..turned }];
        let angles = joint.turns(&joint.coordinates(&states).unwrap(), &Vector3::zeros());
        let mut joints = [joint.clone()];
        let held = HeldBack::new(&mut joints, &mut [], &states, &[angles], 0.25);
        let [before, after] = [&joint, &joints[0]].map(|joint| {
            let beyond = joint.beyond_limits(&states, &angles).unwrap();
            let error = joint.error(&states).unwrap();
            [error.0, error.1, beyond.0, beyond.1]
        });
        for (k, (before, after)) in before.into_iter().zip(after).enumerate() {
            let left = 0.25 * before;
            assert!((after - left).abs() <= 1e-4 * left, "joint {number}, {k}: {before} {after}");
        }
        held.release(&mut joints, &mut []);
        assert_eq!(joints[0], joint);
    }
}
