//! Path constraints: bounds on the centre of mass of a body after every step.

use super::target::FARTHEST;
use nalgebra::Vector3;

/// Smallest width of a wall, m: its slope goes with the inverse of the width.
const NARROWEST: f64 = 1e-6;

/// A function of the centre of mass of a body that must not be negative after any step.
#[derive(Debug, Clone, PartialEq)]
pub struct PathConstraint {
    /// Name in reports.
    pub name: String,
    /// Index of the body in the world.
    pub body: usize,
    /// The function.
    pub kind: PathConstraintKind,
    /// Largest allowed violation, m.
    pub tolerance: f64,
    /// Weight of the squared violation in the cost, m⁻².
    pub weight: f64,
}

/// A function of the centre of mass r, in m.
#[derive(Debug, Clone, PartialEq)]
pub enum PathConstraintKind {
    /// Height above a wall across x: z − height exp(−((x − at)/width)²).
    Above {
        /// Place of the highest point, m.
        at: f64,
        /// Width of the bell, m.
        width: f64,
        /// Height of the bell, m.
        height: f64,
    },
    /// Lower bound of a coordinate.
    AtLeast {
        /// Component: 0, 1 and 2 for x, y and z.
        component: usize,
        /// Lower bound, m.
        low: f64,
    },
    /// Upper bound of a coordinate.
    AtMost {
        /// Component: 0, 1 and 2 for x, y and z.
        component: usize,
        /// Upper bound, m.
        high: f64,
    },
    /// Distance from a point of the world, less the radius.
    Away {
        /// The point, m.
        point: Vector3<f64>,
        /// Least distance, m.
        radius: f64,
    },
}

impl PathConstraintKind {
    /// Refuses lengths beyond the reach of a state, and walls too narrow to have a slope.
    pub(super) fn check(&self) -> Result<(), String> {
        let within = |what: &str, value: f64, low: f64| {
            if (low..=FARTHEST).contains(&value) {
                return Ok(());
            }
            Err(format!("{what} is {value:?}; allowed: {low} to {FARTHEST} m"))
        };
        match self {
            Self::Above { at, width, height } => {
                within("x", *at, -FARTHEST)?;
                within("width", *width, NARROWEST)?;
                within("height", *height, 0.0)
            }
            Self::AtLeast { low, .. } => within("the lower end", *low, -FARTHEST),
            Self::AtMost { high, .. } => within("the upper end", *high, -FARTHEST),
            Self::Away { point, radius } => {
                point
                    .iter()
                    .try_for_each(|x| within("a coordinate of the point", *x, -FARTHEST))?;
                within("radius", *radius, 0.0)
            }
        }
    }

    /// Value at r, m, and its derivative by r.
    pub fn at(&self, r: &Vector3<f64>) -> (f64, Vector3<f64>) {
        match self {
            Self::Above { at, width, height } => {
                let s = (r[0] - at) / width;
                let bell = height * libm::exp(-s * s);
                (r[2] - bell, Vector3::new(2.0 * s * bell / width, 0.0, 1.0))
            }
            Self::AtLeast { component, low } => {
                (r[*component] - low, Vector3::ith(*component, 1.0))
            }
            Self::AtMost { component, high } => {
                (high - r[*component], Vector3::ith(*component, -1.0))
            }
            Self::Away { point, radius } => {
                let from_point = r - point;
                match from_point.try_normalize(0.0) {
                    Some(unit) => (from_point.norm() - radius, unit),
                    None => (-radius, Vector3::zeros()),
                }
            }
        }
    }
}

#[cfg(test)]
#[path = "tests/path_constraint.rs"]
mod tests;
