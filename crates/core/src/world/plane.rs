//! Ground plane of any slope.
//!
//! The plane is n·x = d in the world frame, and n·x > d is the free side. Two unit tangents
//! complete the normal to a right-handed frame F = (t₁, t₂, n). Friction, slip and the tutorial's
//! program have their components in this frame:
//!
//! ```text
//! Fᵀ = R,   R n = e_z                                                     (eq. 19)
//! ```
//!
//! R is the smallest such rotation. A plane that falls towards +x by the angle θ has n = (sin θ, 0,
//! cos θ), t₁ pointing downhill and t₂ along y. Coulomb's cone is round, so motions and forces do
//! not depend on the choice of the tangents.
//!
//! Steps are computed in the world frame. [`Plane::state_to_world`] and [`Plane::state_to_ground`]
//! convert states for input and output relative to a slope. The **ground frame** has the origin d n
//! and the axes t₁, t₂, n.

use crate::error::{Error, all_in_range, in_range};
use crate::mechanics::State;
use crate::mechanics::quaternion::{left, rotation};
use nalgebra::{Matrix3, Vector3, Vector4};

/// Plane with its frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Plane {
    normal: Vector3<f64>,
    offset: f64,
    /// R as a unit quaternion, world → ground.
    turn: Vector4<f64>,
    /// R, world → ground.
    to_ground: Matrix3<f64>,
    /// F = Rᵀ.
    frame: Matrix3<f64>,
    /// True if the ground frame equals the world frame.
    level: bool,
}

impl Default for Plane {
    fn default() -> Self {
        Self::level()
    }
}

impl Plane {
    /// The plane z = 0. Its ground frame equals the world frame to the last bit.
    pub fn level() -> Self {
        Self {
            normal: Vector3::z(),
            offset: 0.0,
            turn: Vector4::new(1.0, 0.0, 0.0, 0.0),
            to_ground: Matrix3::identity(),
            frame: Matrix3::identity(),
            level: true,
        }
    }

    /// Plane with `normal` of any length, pointing to the free side, and the distance `offset` d of
    /// the plane from the origin along the unit normal (m). A normal of length 1 to rounding keeps
    /// its bits, so that writing and reading a plane reproduces it.
    ///
    /// # Errors
    /// If the normal is not finite or shorter than 1e-6, or if the offset is beyond ±1e6 m.
    pub fn new(normal: Vector3<f64>, offset: f64) -> Result<Self, Error> {
        all_in_range("normal of the plane", &normal, -1e6, 1e6, "-1e6 to 1e6")?;
        in_range("length of the plane's normal", normal.norm(), 1e-6, 2e6, "1e-6 to 2e6")?;
        in_range("offset of the plane (m)", offset, -1e6, 1e6, "-1e6 to 1e6")?;
        // The norm of three squares is accurate to 4ε.
        let is_unit = (normal.norm() - 1.0).abs() <= 4.0 * f64::EPSILON;
        let normal = if is_unit { normal } else { normal.normalize() };
        if normal == Vector3::z() && offset == 0.0 {
            return Ok(Self::level());
        }
        let turn = smallest_turn_to_z(&normal);
        let to_ground = rotation(&turn);
        let mut frame = to_ground.transpose();
        // Uses the normal itself, free of the rounding of the rotation.
        frame.set_column(2, &normal);
        Ok(Self { normal, offset, turn, to_ground, frame, level: false })
    }

    /// Plane through the origin that falls towards +x by `slope` (°).
    ///
    /// # Errors
    /// [`Error::OutOfRange`] if the slope is beyond ±180°.
    pub fn sloping(slope: f64) -> Result<Self, Error> {
        let slope = in_range("slope (°)", slope, -180.0, 180.0, "-180 to 180")?;
        let (sin, cos) = libm::sincos(slope.to_radians());
        Self::new(Vector3::new(sin, 0.0, cos).normalize(), 0.0)
    }

    /// Copy of this plane in the unit `length` (m).
    pub(crate) fn in_units(&self, length: f64) -> Self {
        Self { offset: self.offset / length, ..self.clone() }
    }

    /// Unit normal n, world frame.
    pub fn normal(&self) -> &Vector3<f64> {
        &self.normal
    }

    /// Distance d from the origin (m).
    pub fn offset(&self) -> f64 {
        self.offset
    }

    /// True if the plane is z = 0 and the ground frame equals the world frame.
    pub fn is_level(&self) -> bool {
        self.level
    }

    /// Frame F with the unit columns t₁, t₂ and n, world frame.
    pub fn frame(&self) -> &Matrix3<f64> {
        &self.frame
    }

    /// Rotation R, world → ground.
    pub fn rotation(&self) -> &Matrix3<f64> {
        &self.to_ground
    }

    /// Converts a vector from the world frame to the ground frame.
    pub fn vector_to_ground(&self, vector: &Vector3<f64>) -> Vector3<f64> {
        if self.level { *vector } else { self.to_ground * vector }
    }

    /// Converts a state from the world frame to the ground frame. The spin is in the body frame in
    /// both, and the quaternion keeps its length.
    pub fn state_to_ground(&self, state: &State) -> State {
        if self.level {
            return *state;
        }
        State {
            position: self.to_ground * (state.position - self.offset * self.normal),
            attitude: left(&self.turn) * state.attitude,
            velocity: self.to_ground * state.velocity,
            spin: state.spin,
        }
    }

    /// Converts a state from the ground frame to the world frame.
    pub fn state_to_world(&self, state: &State) -> State {
        if self.level {
            return *state;
        }
        let [w, x, y, z] = self.turn.into();
        State {
            position: self.to_ground.tr_mul(&state.position) + self.offset * self.normal,
            attitude: left(&Vector4::new(w, -x, -y, -z)) * state.attitude,
            velocity: self.to_ground.tr_mul(&state.velocity),
            spin: state.spin,
        }
    }
}

/// Quaternion of the smallest rotation with R n = e_z. Its axis is n × e_z. With the angle φ
/// between n and e_z,
///
/// ```text
/// cos φ/2 = √((1 + n_z)/2),   sin φ/2 = √((1 − n_z)/2)
/// ```
///
/// The smaller of the two loses digits in its square root. It is computed from the horizontal part
/// instead, |n_xy| = 2 sin φ/2 cos φ/2. For n = −e_z any horizontal axis is valid, and x is used.
fn smallest_turn_to_z(normal: &Vector3<f64>) -> Vector4<f64> {
    let horizontal = normal.xy().norm();
    let (cos, sin) = if normal[2] >= 0.0 {
        let cos = (0.5 * (1.0 + normal[2])).sqrt();
        (cos, 0.5 * horizontal / cos)
    } else {
        let sin = (0.5 * (1.0 - normal[2])).sqrt();
        (0.5 * horizontal / sin, sin)
    };
    let (x, y) = if horizontal > 0.0 {
        (normal[1] / horizontal, -normal[0] / horizontal)
    } else {
        (1.0, 0.0)
    };
    Vector4::new(cos, sin * x, sin * y, 0.0).normalize()
}

#[cfg(test)]
#[path = "tests/plane.rs"]
mod tests;
