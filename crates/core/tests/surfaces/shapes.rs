//! Bodies of all shapes, standing on a level plane.

use crate::common::draw::WideDraw;
use crate::common::prelude::*;
use nalgebra::Quaternion;
use std::f64::consts::{FRAC_PI_2, TAU};

/// Names of the shapes of [`standing`].
pub const SHAPES: [&str; 11] = [
    "box",
    "cube",
    "prism",
    "pyramid",
    "wedge",
    "cylinder",
    "lying cylinder",
    "cone",
    "ball",
    "capsule",
    "ellipsoid",
];

/// A body of 1 kg.
pub struct Body {
    pub body: RigidBody,
    /// Rotation with which it stands on a level plane.
    pub upright: UnitQuaternion<f64>,
    /// Height of its centre of mass above that plane (m).
    pub height: f64,
}

fn points(list: &[[f64; 3]]) -> Vec<Vector3<f64>> {
    list.iter().map(|point| Vector3::from(*point)).collect()
}

/// The shape `name` of about 0.2 m, in random proportions.
pub fn standing(name: &str, random: &mut WideDraw) -> Body {
    let mut length = || random.within(0.08, 0.16);
    let (a, b, c) = (length(), length(), length());
    let mut lying = false;
    let piece = match name {
        "box" => Piece::cuboid(Vector3::new(a, b, 0.6 * c)),
        "cube" => Piece::cuboid(Vector3::repeat(a)),
        "prism" => {
            let corner = |side: u32, z: f64| {
                let angle = TAU * f64::from(side) / 24.0;
                Vector3::new(a * angle.cos(), a * angle.sin(), z)
            };
            let corners = [-0.05, 0.05].map(|z| (0..24).map(move |side| corner(side, z)));
            Piece::hull(&corners.into_iter().flatten().collect::<Vec<_>>(), 0.0)
        }
        "pyramid" => Piece::hull(
            &points(&[[a, b, 0.0], [-a, b, 0.0], [-a, -b, 0.0], [a, -b, 0.0], [0.0, 0.0, c]]),
            0.0,
        ),
        "wedge" => Piece::hull(
            &points(&[
                [a, b, 0.0],
                [-a, b, 0.0],
                [-a, -b, 0.0],
                [a, -b, 0.0],
                [-a, b, c],
                [-a, -b, c],
            ]),
            0.0,
        ),
        "cylinder" => Piece::cylinder(0.5 * c, a, 24),
        "lying cylinder" => {
            lying = true;
            Piece::cylinder(c, a, 24)
        }
        "cone" => Piece::cone(0.7 * c, a, 24),
        "ball" => Piece::sphere(a),
        "capsule" => {
            lying = true;
            Piece::capsule(c, 0.6 * a)
        }
        "ellipsoid" => Piece::ellipsoid(Vector3::new(a, b, 0.7 * c), 24),
        _ => panic!("no shape is called {name}"),
    };
    let (body, _) = RigidBody::solid(1.0, &[piece.unwrap()]).unwrap();
    let upright = if lying {
        UnitQuaternion::from_axis_angle(&Vector3::x_axis(), FRAC_PI_2)
    } else {
        UnitQuaternion::identity()
    };
    let height = extent(&body, &(upright.inverse() * -Vector3::z()));
    Body { body, upright, height }
}

/// Largest n·x over a body for a unit vector n (m, body frame).
fn extent(body: &RigidBody, n: &Vector3<f64>) -> f64 {
    let of_piece = |piece: &Piece| match piece.smooth() {
        Some(smooth) => smooth.extent(n),
        None => {
            let heights = piece.core().vertices().iter().map(|vertex| n.dot(vertex));
            heights.fold(f64::NEG_INFINITY, f64::max) + piece.radius()
        }
    };
    body.pieces().iter().map(of_piece).fold(f64::NEG_INFINITY, f64::max)
}

/// Attitude as tumble stores it.
pub fn attitude(rotation: &UnitQuaternion<f64>) -> Vector4<f64> {
    let Quaternion { coords } = **rotation;
    Vector4::new(coords.w, coords.x, coords.y, coords.z)
}

/// State of a body at `position` (m) with the `velocity` (m/s) that does not turn.
pub fn at(position: [f64; 3], velocity: [f64; 3]) -> State {
    State { velocity: velocity.into(), ..State::at_rest(position) }
}

impl Body {
    /// Distance from the centre of mass to the farthest point along the unit vector n (m, world).
    pub fn reach_along(&self, state: &State, n: &Vector3<f64>) -> f64 {
        extent(&self.body, &(rotation(&state.attitude).transpose() * n))
    }

    /// The body standing at (x, y) on the plane z = 0, turned by `angle` (rad) about the vertical.
    pub fn at(&self, [x, y]: [f64; 2], angle: f64, velocity: [f64; 3]) -> State {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle);
        State { attitude: attitude(&(turn * self.upright)), ..at([x, y, self.height], velocity) }
    }
}
