//! Bodies tied by joints: the tree, robots, and lines from joint to joint.

use crate::film::{Film, FilmJoint};
use crate::shape::FilmPiece;
use nalgebra::Vector3;

/// Number of bodies from which a group tied by joints counts as a robot.
const ROBOT: usize = 4;
/// Distance of a joint from the surface of its body beyond which they do not touch, over the size
/// of the body.
const APART: f64 = 0.05;

/// Line on a body, in its frame (m).
#[derive(Debug, Clone, Copy, PartialEq)]
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
    for FilmJoint { body, other, .. } in &film.joints {
        let (Some(other), None) = (*other, above[*body]) else { continue };
        let mut ways = std::iter::successors(Some(other), |place| above[*place]);
        if ways.all(|place| place != *body) {
            above[*body] = Some(other);
        }
    }
    above
}

/// Depth of each body in the tree of its robot. `None` for bodies of other groups.
pub fn robot_depths(film: &Film) -> Vec<Option<usize>> {
    let above = parents(film);
    let ways: Vec<Vec<usize>> = (0..above.len())
        .map(|body| std::iter::successors(Some(body), |place| above[*place]).collect())
        .collect();
    let root = |body: usize| ways[body][ways[body].len() - 1];
    let mut sizes = vec![0; above.len()];
    (0..above.len()).for_each(|body| sizes[root(body)] += 1);
    let depth = |body: usize| (sizes[root(body)] >= ROBOT).then(|| ways[body].len() - 1);
    (0..above.len()).map(depth).collect()
}

/// Lines from joint to joint on bodies whose joints are outside their shapes. A body with a single
/// joint has a line to its centre of mass.
pub fn bones(film: &Film) -> Vec<Bone> {
    let mut bones = Vec::new();
    for (index, body) in film.bodies.iter().enumerate() {
        let mut anchors: Vec<Vector3<f64>> = Vec::new();
        for joint in &film.joints {
            let sides = [(Some(joint.body), joint.anchor), (joint.other, joint.other_anchor)];
            anchors.extend(sides.iter().filter(|side| side.0 == Some(index)).map(|side| side.1));
        }
        let room = APART * body.reach();
        let is_outside =
            |place: &Vector3<f64>| body.pieces.iter().all(|piece| distance(piece, place) > room);
        let Some((&first, rest)) = anchors.split_first() else { continue };
        let ends = if rest.is_empty() { &[Vector3::zeros()][..] } else { rest };
        for &to in ends {
            if (is_outside(&first) || is_outside(&to)) && (to - first).norm() > room {
                bones.push(Bone { body: index, from: first, to });
            }
        }
    }
    bones
}

/// Lower bound of the distance of a point from a piece (m), not above 0 inside of it. That of a
/// mesh is to its bounding box.
fn distance(piece: &FilmPiece, place: &Vector3<f64>) -> f64 {
    match piece {
        FilmPiece::Sphere { centre, radius } => (place - centre).norm() - radius,
        FilmPiece::Capsule { ends: [a, b], radius } => {
            let axis = b - a;
            let share = (place - a).dot(&axis) / axis.norm_squared();
            // A capsule of length 0 has no direction.
            let share = if share.is_nan() { 0.0 } else { share.clamp(0.0, 1.0) };
            (place - a - axis * share).norm() - radius
        }
        FilmPiece::Hull(hull) => {
            let heights = hull
                .sides()
                .map(|(face, normal)| normal.dot(&(place - hull.vertices[face[0]])) - hull.radius);
            heights.fold(f64::NEG_INFINITY, f64::max)
        }
        FilmPiece::Mesh(mesh) => {
            let (low, high) = mesh.vertices.iter().fold(
                (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY)),
                |(low, high), vertex| (low.inf(vertex), high.sup(vertex)),
            );
            (low - place).sup(&(place - high)).max()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples::floating_cube;

    fn joint(body: usize, other: Option<usize>) -> FilmJoint {
        FilmJoint {
            name: String::new(),
            body,
            other,
            anchor: Vector3::zeros(),
            other_anchor: Vector3::zeros(),
            axis: None,
            turns: false,
            slides: false,
        }
    }

    #[test]
    fn joints_are_a_tree_whatever_rings_they_close() {
        let mut film = floating_cube(1);
        film.bodies = vec![film.bodies[0].clone(); 4];
        film.joints = vec![
            joint(3, None),
            joint(1, Some(0)),
            joint(2, Some(1)),
            joint(2, Some(0)),
            joint(0, Some(2)),
            joint(3, Some(3)),
        ];
        assert_eq!(parents(&film), [None, Some(0), Some(1), None]);
        assert_eq!(robot_depths(&film), [None; 4]);
        film.joints.push(joint(3, Some(1)));
        assert_eq!(robot_depths(&film), [Some(0), Some(1), Some(2), Some(2)]);
    }

    /// A ball hangs on a joint that is 1 m above it. On the body above, the joint is inside.
    #[test]
    fn a_line_goes_to_the_joint_that_a_body_does_not_touch() {
        let mut film = floating_cube(1);
        film.bodies = vec![film.bodies[0].clone(); 2];
        let centre = Vector3::zeros();
        film.bodies.iter_mut().for_each(|body| {
            body.points.clear();
            body.pieces = vec![FilmPiece::Sphere { centre, radius: 0.2 }];
        });
        film.joints = vec![FilmJoint { anchor: Vector3::z(), ..joint(1, Some(0)) }];
        assert_eq!(bones(&film), [Bone { body: 1, from: Vector3::z(), to: centre }]);
        // With a second joint the line is from joint to joint.
        let lower = FilmJoint { anchor: -Vector3::z(), ..joint(1, None) };
        film.joints.push(lower);
        assert_eq!(bones(&film), [Bone { body: 1, from: Vector3::z(), to: -Vector3::z() }]);
        film.joints[0].anchor = Vector3::z() * 0.1;
        film.joints[1].anchor = Vector3::z() * -0.1;
        assert_eq!(bones(&film), []);
    }
}
