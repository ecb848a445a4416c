//! Rows that are to hold after every step.

use super::target::FARTHEST;
use nalgebra::{Matrix3, Vector3};

/// The least width of a wall, m: its second derivative goes with the square of it.
const NARROWEST: f64 = 1e-6;

/// What the centre of mass of a body is to keep to after every step: a number that is not below zero.
#[derive(Debug, Clone, PartialEq)]
pub struct Keep {
    /// What it is called.
    pub name: String,
    /// An index of the world's bodies.
    pub body: usize,
    /// Which number.
    pub kind: KeepKind,
    /// How far below zero it may be, m.
    pub tolerance: f64,
    /// Of the square of what it is below zero, in the cost, m⁻².
    pub weight: f64,
}

/// A number in m, of the centre of mass r.
#[derive(Debug, Clone, PartialEq)]
pub enum KeepKind {
    /// Above a wall across x, z − height exp(−((x − at)/width)²).
    Above {
        /// Where it is highest, m.
        at: f64,
        /// m.
        width: f64,
        /// m.
        height: f64,
    },
    /// One coordinate no less than `low`, m: 0, 1, 2 are x, y, z.
    AtLeast {
        /// Which.
        component: usize,
        /// m.
        low: f64,
    },
    /// One coordinate no more than `high`, m.
    AtMost {
        /// Which.
        component: usize,
        /// m.
        high: f64,
    },
    /// At least `radius` away from a point of the world, m.
    Away {
        /// m.
        point: Vector3<f64>,
        /// m.
        radius: f64,
    },
}

impl KeepKind {
    /// Refuses numbers beyond what a state can be, and a wall too narrow to have a slope.
    pub(super) fn check(&self) -> Result<(), String> {
        let within = |what: &str, value: f64, low: f64| {
            if (low..=FARTHEST).contains(&value) {
                return Ok(());
            }
            Err(format!("{what} is {value:?}; {low} to {FARTHEST} m is allowed"))
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

    /// The number at r, m, with its first and second derivatives by r.
    #[must_use]
    pub fn at(&self, r: &Vector3<f64>) -> (f64, Vector3<f64>, Matrix3<f64>) {
        let flat = Matrix3::zeros();
        match self {
            Self::Above { at, width, height } => {
                let s = (r[0] - at) / width;
                let bell = height * libm::exp(-s * s);
                let mut second = flat;
                second[(0, 0)] = -bell * (4.0 * s * s - 2.0) / (width * width);
                (r[2] - bell, Vector3::new(2.0 * s * bell / width, 0.0, 1.0), second)
            }
            Self::AtLeast { component, low } => {
                (r[*component] - low, Vector3::ith(*component, 1.0), flat)
            }
            Self::AtMost { component, high } => {
                (high - r[*component], Vector3::ith(*component, -1.0), flat)
            }
            Self::Away { point, radius } => {
                let way = r - point;
                let distance = way.norm();
                let Some(unit) = way.try_normalize(0.0) else { return (-radius, way, flat) };
                let second = (Matrix3::identity() - unit * unit.transpose()) / distance;
                (distance - radius, unit, second)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against central differences of 1e-5, whose error is some 1e-10.
    #[test]
    fn slopes_are_those_of_differences() {
        let kinds = [
            KeepKind::Above { at: 0.4, width: 0.3, height: 0.7 },
            KeepKind::AtLeast { component: 1, low: 0.2 },
            KeepKind::AtMost { component: 2, high: 0.2 },
            KeepKind::Away { point: Vector3::new(0.1, -0.2, 0.4), radius: 0.3 },
        ];
        let r = Vector3::new(0.5, 0.7, 0.9);
        for kind in kinds {
            let (_, first, second) = kind.at(&r);
            for k in 0..3 {
                let by = Vector3::ith(k, 1e-5);
                let (up, slope_up, _) = kind.at(&(r + by));
                let (down, slope_down, _) = kind.at(&(r - by));
                assert!(((up - down) / 2e-5 - first[k]).abs() < 1e-8, "{kind:?}");
                let column = (slope_up - slope_down) / 2e-5;
                assert!((column - second.column(k)).amax() < 1e-8, "{kind:?}");
            }
        }
    }
}
