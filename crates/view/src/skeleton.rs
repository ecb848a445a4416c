//! Bodies tied by joints: the tree, robots, and lines to joints that bodies do not touch.

use crate::film::Film;
use crate::shape::Shape;
use nalgebra::Vector3;
use serde::Serialize;

/// Number of bodies from which a group tied by joints counts as a robot.
const ROBOT: usize = 4;
/// Distance of a joint from the surface of its body beyond which they do not touch, over the size
/// of the body.
const APART: f64 = 0.05;

/// Line on a body, in its frame (m).
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Bone {
    /// Index into [`Film::bodies`].
    pub body: usize,
    /// First end.
    pub from: Vector3<f64>,
    /// Second end.
    pub to: Vector3<f64>,
}

/// Parent of each body: the first body that a joint ties it to without closing a loop.
pub fn parents(film: &Film) -> Vec<Option<usize>> {
    let mut above = vec![None; film.bodies.len()];
    for joint in film.world.joints() {
        let body = joint.body();
        let (Some(other), None) = (joint.other(), above[body]) else { continue };
        let mut ancestors = std::iter::successors(Some(other), |place| above[*place]);
        if ancestors.all(|place| place != body) {
            above[body] = Some(other);
        }
    }
    above
}

/// Depth of each body in the tree of its robot. `None` for bodies of other groups.
pub fn robot_depths(film: &Film) -> Vec<Option<usize>> {
    let above = parents(film);
    let ancestors: Vec<Vec<usize>> = (0..above.len())
        .map(|body| std::iter::successors(Some(body), |place| above[*place]).collect())
        .collect();
    let root = |body: usize| ancestors[body][ancestors[body].len() - 1];
    let mut sizes = vec![0; above.len()];
    (0..above.len()).for_each(|body| sizes[root(body)] += 1);
    let depth = |body: usize| (sizes[root(body)] >= ROBOT).then(|| ancestors[body].len() - 1);
    (0..above.len()).map(depth).collect()
}

/// Lines on bodies whose joints are outside their shapes: from the joint to the nearest point of the
/// shape. Links that do not touch are thus joined through their joint.
pub fn bones(film: &Film) -> Vec<Bone> {
    let mut bones = Vec::new();
    for (index, body) in film.bodies.iter().enumerate() {
        let room = APART * body.reach();
        for joint in film.world.joints() {
            let sides = [Some(joint.body()), joint.other()].into_iter().zip(joint.frames());
            for (_, frame) in sides.filter(|side| side.0 == Some(index)) {
                let from = frame.anchor;
                let ends = body.shapes.iter().map(|shape| nearest(shape, &from));
                let apart = |end: &Vector3<f64>| (end - from).norm();
                let to = ends.min_by(|a, b| apart(a).total_cmp(&apart(b)));
                let to = to.unwrap_or_else(Vector3::zeros);
                if apart(&to) > room {
                    bones.push(Bone { body: index, from, to });
                }
            }
        }
    }
    bones
}

/// Number of projections onto the faces of a hull.
const ROUNDS: usize = 20;

/// Point of a piece near a place, which is the place itself inside of it. Of a mesh it is in the
/// bounding box.
fn nearest(shape: &Shape, place: &Vector3<f64>) -> Vector3<f64> {
    let within = |core: Vector3<f64>, radius: f64| {
        let offset = place - core;
        core + offset * (radius / offset.norm()).min(1.0)
    };
    match shape {
        Shape::Convex { core, radius, .. } => match *core.vertices() {
            [centre] => within(centre, *radius),
            [a, b] => {
                let axis = b - a;
                let share = ((place - a).dot(&axis) / axis.norm_squared()).clamp(0.0, 1.0);
                within(a + axis * share, *radius)
            }
            _ => {
                let mut near = *place;
                for _ in 0..ROUNDS {
                    for face in core.faces() {
                        near -= face.normal * (face.normal.dot(&near) - face.offset).max(0.0);
                    }
                }
                within(near, *radius)
            }
        },
        Shape::Points(_) => Vector3::zeros(),
        Shape::Mesh(mesh) => {
            let (low, high) = mesh.vertices.iter().fold(
                (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY)),
                |(low, high), vertex| (low.inf(vertex), high.sup(vertex)),
            );
            place.sup(&low).inf(&high)
        }
    }
}

#[cfg(test)]
mod tests {
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
}
