//! Unit tests of `skeleton.rs`.

use super::*;
use crate::samples::{ball, copies, floating_cube, joint, tie};
use tumble_core::geometry::Piece;
use tumble_core::joint::{Joint, JointFrame};

#[test]
fn joints_that_close_loops_form_a_tree() {
    let mut film = floating_cube(1);
    copies(&mut film, 4);
    let mut joints = vec![
        joint(3, None),
        joint(1, Some(0)),
        joint(2, Some(1)),
        joint(2, Some(0)),
        joint(0, Some(2)),
    ];
    tie(&mut film, joints.clone());
    assert_eq!(parents(&film), [None, Some(0), Some(1), None]);
    assert_eq!(robot_depths(&film), [None; 4]);
    joints.push(joint(3, Some(1)));
    tie(&mut film, joints);
    assert_eq!(robot_depths(&film), [Some(0), Some(1), Some(2), Some(2)]);
}

/// A ball hangs on a joint that is 1 m above it. On the body above, the joint is inside.
#[test]
fn a_line_goes_to_the_joint_that_a_body_does_not_touch() {
    let mut film = floating_cube(1);
    copies(&mut film, 2);
    film.bodies.iter_mut().for_each(|body| body.shapes = vec![ball(Vector3::zeros(), 0.2)]);
    let mut hang = |[height, lower]: [f64; 2]| {
        let at = |height: f64, other| {
            let anchors = [Vector3::z() * height, Vector3::zeros()].map(JointFrame::at);
            Joint::spherical(1, other, anchors)
        };
        tie(&mut film, vec![at(height, Some(0)), at(lower, None)]);
        bones(&film)
    };
    let bone =
        |from: f64, to: f64| Bone { body: 1, from: Vector3::z() * from, to: Vector3::z() * to };
    assert_eq!(hang([1.0, 0.05]), [bone(1.0, 0.2)]);
    assert_eq!(hang([1.0, -1.0]), [bone(1.0, 0.2), bone(-1.0, -0.2)]);
    assert_eq!(hang([0.1, -0.1]), []);
    // The nearest point of a box and of a capsule.
    let cuboid = Shape::from(&Piece::cuboid(Vector3::repeat(0.5)).unwrap());
    let near = nearest(&cuboid, &Vector3::new(2.0, 0.1, -3.0));
    assert!((near - Vector3::new(0.5, 0.1, -0.5)).norm() < 1e-12, "{near}");
    let capsule = Shape::from(&Piece::capsule(0.5, 0.25).unwrap());
    let near = nearest(&capsule, &Vector3::new(2.0, 0.0, 0.25));
    assert!((near - Vector3::new(0.25, 0.0, 0.25)).norm() < 1e-12, "{near}");
}
