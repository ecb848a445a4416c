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
#[path = "tests/skeleton.rs"]
mod tests;
