//! Loads and velocities of all bodies.

use super::Structure;
use crate::Error;
use nalgebra::Vector3;

/// A pair of vectors of a body about its centre of mass, in world axes: force (N) and torque (N m), or
/// velocity (m/s) and angular velocity (rad/s).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Twist {
    /// Force or velocity.
    pub linear: Vector3<f64>,
    /// Torque or angular velocity.
    pub angular: Vector3<f64>,
}

impl Twist {
    pub(super) const ZERO: Self =
        Self { linear: Vector3::new(0.0, 0.0, 0.0), angular: Vector3::new(0.0, 0.0, 0.0) };

    /// A force `force` (N) at `arm` (m) from the centre.
    pub(super) fn at(arm: &Vector3<f64>, force: &Vector3<f64>) -> Self {
        Self { linear: *force, angular: arm.cross(force) }
    }

    pub(super) fn times(self, factor: f64) -> Self {
        Self { linear: self.linear * factor, angular: self.angular * factor }
    }

    pub(super) fn plus(self, other: Self) -> Self {
        Self { linear: self.linear + other.linear, angular: self.angular + other.angular }
    }

    /// Power of a wrench with a velocity (W).
    pub(super) fn dot(&self, other: &Self) -> f64 {
        self.linear.dot(&other.linear) + self.angular.dot(&other.angular)
    }
}

/// Wrenches on all bodies, which a factor scales.
#[derive(Debug, Clone, PartialEq)]
pub struct LoadCase {
    /// Wrench on each body.
    pub wrenches: Vec<Twist>,
    /// Force of each body per mass that is included in its wrench (m/s²).
    pub(super) per_mass: Vector3<f64>,
}

impl LoadCase {
    /// No load on `bodies` bodies.
    pub fn none(bodies: usize) -> Self {
        Self { wrenches: vec![Twist::ZERO; bodies], per_mass: Vector3::zeros() }
    }

    /// A `force` (N, world) on a body, at `point` from its centre of mass (m, world axes).
    ///
    /// # Errors
    /// [`Error::Count`] if the body does not exist.
    pub fn push(
        structure: &Structure,
        body: usize,
        force: Vector3<f64>,
        point: Vector3<f64>,
    ) -> Result<Self, Error> {
        let mut case = Self::none(structure.masses.len());
        let missing = Error::Count { field: "body", count: body, allowed: "an index of a body" };
        *case.wrenches.get_mut(body).ok_or(missing)? = Twist::at(&point, &force);
        Ok(case)
    }

    /// Weight of 1 kg on a body, at `point` from its centre of mass (m, world axes). The factor is a
    /// mass (kg).
    ///
    /// # Errors
    /// [`Error::Count`] if the body does not exist.
    pub fn mass(structure: &Structure, body: usize, point: Vector3<f64>) -> Result<Self, Error> {
        Self::push(structure, body, structure.gravity, point)
    }

    /// An `acceleration` (m/s²) of the base, as the forces −m a on all bodies.
    pub fn base(structure: &Structure, acceleration: Vector3<f64>) -> Self {
        let force = |mass: &f64| Twist { linear: acceleration * -*mass, angular: Vector3::zeros() };
        Self { wrenches: structure.masses.iter().map(force).collect(), per_mass: -acceleration }
    }

    /// Gravity that is tilted about a horizontal `axis`, by the angle whose tangent is the factor. The
    /// load is the part across, m |g| (axis × g/|g|): cones do not change with the length of
    /// gravity.
    ///
    /// # Errors
    /// [`Error::Unsupported`] if other loads or bounded forces of joints act, without gravity, or for an
    /// axis that is not horizontal.
    pub fn tilt(structure: &Structure, axis: Vector3<f64>) -> Result<Self, Error> {
        let refuse = |why| Err(Error::Unsupported { what: "tilt of gravity", why });
        if structure.has_other_loads {
            return refuse(
                "gravity must be the only load; joints may not have forces of limited size",
            );
        }
        let Some(axis) = axis.try_normalize(0.0) else { return refuse("its axis is zero") };
        let across = axis.cross(&structure.gravity);
        if across.norm() < (1.0 - 1e-9) * structure.gravity.norm() || across == Vector3::zeros() {
            return refuse("its axis must be horizontal, and gravity not zero");
        }
        Ok(Self::base(structure, -across))
    }

    /// Sum of these loads and `factor` times others.
    #[must_use]
    pub fn plus(&self, factor: f64, other: &Self) -> Self {
        let pairs = self.wrenches.iter().zip(&other.wrenches);
        Self {
            wrenches: pairs.map(|(own, other)| own.plus(other.times(factor))).collect(),
            per_mass: self.per_mass + other.per_mass * factor,
        }
    }

    /// Power with the velocities of all bodies (W).
    pub(super) fn power(&self, velocities: &[Twist]) -> f64 {
        self.wrenches.iter().zip(velocities).map(|(load, velocity)| load.dot(velocity)).sum()
    }
}
