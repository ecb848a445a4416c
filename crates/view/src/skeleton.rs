//! Bodies tied by joints: the tree, robots, and lines to joints that bodies do not touch.

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

/// Lines on bodies whose joints are outside their shapes: from the joint to the nearest point of the
/// shape. Links that do not touch are thus joined through their joint.
pub fn bones(film: &Film) -> Vec<Bone> {
    let mut bones = Vec::new();
    for (index, body) in film.bodies.iter().enumerate() {
        let room = APART * body.reach();
        for joint in &film.joints {
            let sides = [(Some(joint.body), joint.anchor), (joint.other, joint.other_anchor)];
            for (_, from) in sides.into_iter().filter(|side| side.0 == Some(index)) {
                let ends = body.pieces.iter().map(|piece| nearest(piece, &from));
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
fn nearest(piece: &FilmPiece, place: &Vector3<f64>) -> Vector3<f64> {
    let within = |core: Vector3<f64>, radius: f64| {
        let way = place - core;
        core + way * (radius / way.norm()).min(1.0)
    };
    match piece {
        FilmPiece::Sphere { centre, radius } => within(*centre, *radius),
        FilmPiece::Capsule { ends: [a, b], radius } => {
            let axis = b - a;
            let share = (place - a).dot(&axis) / axis.norm_squared();
            // A capsule of length 0 has no direction.
            let share = if share.is_nan() { 0.0 } else { share.clamp(0.0, 1.0) };
            within(a + axis * share, *radius)
        }
        FilmPiece::Hull(hull) => {
            let mut core = *place;
            for _ in 0..ROUNDS {
                for (face, normal) in hull.sides() {
                    core -= normal * normal.dot(&(core - hull.vertices[face[0]])).max(0.0);
                }
            }
            within(core, hull.radius)
        }
        FilmPiece::Mesh(mesh) => {
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
    use crate::samples::{floating_cube, joint};

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
        let bone =
            |from: f64, to: f64| Bone { body: 1, from: Vector3::z() * from, to: Vector3::z() * to };
        assert_eq!(bones(&film), [bone(1.0, 0.2)]);
        let lower = FilmJoint { anchor: -Vector3::z(), ..joint(1, None) };
        film.joints.push(lower);
        assert_eq!(bones(&film), [bone(1.0, 0.2), bone(-1.0, -0.2)]);
        film.joints[0].anchor = Vector3::z() * 0.1;
        film.joints[1].anchor = Vector3::z() * -0.1;
        assert_eq!(bones(&film), []);
        // The nearest point of a box and of a capsule.
        let corner = |i: usize| Vector3::from_fn(|k, _| if i >> k & 1 == 1 { 0.5 } else { -0.5 });
        let cuboid = FilmPiece::cuboid(&(0..8).map(corner).collect::<Vec<_>>());
        let near = nearest(&cuboid, &Vector3::new(2.0, 0.1, -3.0));
        assert!((near - Vector3::new(0.5, 0.1, -0.5)).norm() < 1e-12, "{near}");
        let capsule = FilmPiece::Capsule { ends: [Vector3::zeros(), Vector3::x()], radius: 0.25 };
        let near = nearest(&capsule, &Vector3::new(0.5, 2.0, 0.0));
        assert!((near - Vector3::new(0.5, 0.25, 0.0)).norm() < 1e-12, "{near}");
    }
}
