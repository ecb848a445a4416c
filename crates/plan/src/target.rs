//! Targets of the states after a number of steps.

use nalgebra::{Vector3, Vector4};
use tumble_core::derivative::StateChange;
use tumble_core::mechanics::State;
use tumble_core::mechanics::quaternion::{conjugated, product, rotation};

/// Largest length in a problem, m.
pub(super) const FARTHEST: f64 = 1e6;

/// Largest velocity and spin in a target, m/s and rad/s.
const FASTEST: f64 = 1e5;

/// Target value of a quantity of a body.
#[derive(Debug, Clone, PartialEq)]
pub struct Target {
    /// Name in reports.
    pub name: String,
    /// Index of the body in the world.
    pub body: usize,
    /// Number of steps after which the target counts.
    pub after: usize,
    /// Quantity and target value.
    pub kind: TargetKind,
    /// Largest allowed [miss](Target::miss), in the unit of the quantity.
    pub tolerance: f64,
    /// Weight of the squared rows in the cost.
    pub weight: f64,
}

/// A quantity of a state and its target value.
#[derive(Debug, Clone, PartialEq)]
pub enum TargetKind {
    /// Coordinates of the centre of mass, m; `None` leaves one free.
    Position([Option<f64>; 3]),
    /// Components of the velocity, m/s, world.
    Velocity([Option<f64>; 3]),
    /// Components of the spin, rad/s, body.
    Spin([Option<f64>; 3]),
    /// Attitude from body to world as a unit quaternion (w, x, y, z). The miss is in rad.
    Attitude(Vector4<f64>),
    /// Turn about an axis since the attitude `from`, without whole turns; the miss is in rad.
    Turn {
        /// Axis, unit, world.
        axis: Vector3<f64>,
        /// Angle, rad.
        angle: f64,
        /// Attitude of a turn of zero, unit quaternion.
        from: Vector4<f64>,
    },
    /// Alignment of a direction of the body with a direction of the world; the miss is in rad.
    Direction {
        /// Direction of the body, unit.
        of: Vector3<f64>,
        /// Direction of the world, unit.
        to: Vector3<f64>,
    },
}

/// A residual in the unit of its target, and its derivatives by the state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TargetResidual {
    /// Value.
    pub value: f64,
    /// Derivatives by the state.
    pub by: StateChange,
}

impl TargetKind {
    /// Unit of the miss.
    pub fn unit(&self) -> &'static str {
        match self {
            Self::Position(_) => "m",
            Self::Velocity(_) => "m/s",
            Self::Spin(_) => "rad/s",
            Self::Attitude(_) | Self::Turn { .. } | Self::Direction { .. } => "rad",
        }
    }

    /// Refuses values beyond the reach of a state.
    pub(super) fn check(&self) -> Result<(), String> {
        let within = |what: &str, values: &[Option<f64>; 3], most: f64, unit: &str| {
            let fits = |value: &&f64| value.abs() <= most;
            match values.iter().flatten().find(|value| !fits(value)) {
                None => Ok(()),
                Some(value) => {
                    Err(format!("{what} is {value:?}; allowed: -{most:e} to {most:e} {unit}"))
                }
            }
        };
        let is_unit = |norm: f64| (norm - 1.0).abs() < 1e-6;
        let fits = match self {
            Self::Position(values) => return within("a coordinate", values, FARTHEST, "m"),
            Self::Velocity(values) => return within("a velocity", values, FASTEST, "m/s"),
            Self::Spin(values) => return within("a spin", values, FASTEST, "rad/s"),
            Self::Attitude(attitude) => is_unit(attitude.norm()),
            Self::Turn { axis, angle, from } => {
                if angle.is_nan() || angle.abs() >= TURN {
                    let degrees = angle.to_degrees();
                    let why = "allowed: less than a whole turn, -360 to 360 degrees";
                    return Err(format!("the turn is {degrees:?} degrees; {why}"));
                }
                is_unit(axis.norm()) && is_unit(from.norm())
            }
            Self::Direction { of, to } => is_unit(of.norm()) && is_unit(to.norm()),
        };
        if fits {
            Ok(())
        } else {
            Err("directions and attitudes of length 1 are needed".to_owned())
        }
    }

    /// Rows at `state`; the cost has the sum of their squares.
    ///
    /// ```text
    /// attitude:  θ with A(q_t)ᵀ A(q) = exp [θ]×,  ∂θ/∂δθ = J_r⁻¹(θ)
    /// turn:      2 atan2(a·v, w) − α with q q_f⁻¹ = (w, v)
    /// direction: A(q) b − d,  ∂/∂δθ = −A(q) [b]×                                   (P3)
    /// ```
    pub fn rows(&self, state: &State) -> Vec<TargetResidual> {
        let zero = StateChange::zero();
        let each = |wanted: &[Option<f64>; 3], has: &Vector3<f64>, by: fn(usize) -> StateChange| {
            let wanted = wanted.iter().enumerate();
            let row = |(k, wanted): (usize, &Option<f64>)| {
                wanted.map(|wanted| TargetResidual { value: has[k] - wanted, by: by(k) })
            };
            wanted.filter_map(row).collect()
        };
        // Rows whose derivatives are by the rotation of the body
        let turning = |values: &Vector3<f64>, by: &nalgebra::Matrix3<f64>| {
            let row = |k: usize| TargetResidual {
                value: values[k],
                by: StateChange { turn: by.row(k).transpose(), ..zero },
            };
            (0..3).map(row).collect()
        };
        match self {
            Self::Position(wanted) => each(wanted, &state.position, |k| StateChange {
                position: Vector3::ith(k, 1.0),
                ..StateChange::zero()
            }),
            Self::Velocity(wanted) => each(wanted, &state.velocity, |k| StateChange {
                velocity: Vector3::ith(k, 1.0),
                ..StateChange::zero()
            }),
            Self::Spin(wanted) => each(wanted, &state.spin, |k| StateChange {
                spin: Vector3::ith(k, 1.0),
                ..StateChange::zero()
            }),
            Self::Attitude(wanted) => {
                let there = State { attitude: *wanted, ..*state };
                let turn = StateChange::between(&there, state).turn;
                turning(&turn, &right_jacobian_inverse(&turn))
            }
            Self::Turn { axis, angle, from } => {
                let q = product(&state.attitude, &conjugated(from));
                // δq = ½ L(q) (0, δθ) before the product with the attitude's inverse.
                let change = |k: usize| {
                    let e = Vector3::ith(k, 1.0);
                    let turned = Vector4::new(0.0, 0.5 * e[0], 0.5 * e[1], 0.5 * e[2]);
                    product(&product(&state.attitude, &turned), &conjugated(from))
                };
                let along = |q: &Vector4<f64>| axis.dot(&Vector3::new(q[1], q[2], q[3]));
                let (s, c) = (along(&q), q[0]);
                let norm = s * s + c * c;
                // δ(2 atan2(s, c)) = 2 (c δs − s δc)/(s² + c²)
                let by = |k: usize| {
                    let dq = change(k);
                    if norm > 0.0 { 2.0 * (c * along(&dq) - s * dq[0]) / norm } else { 0.0 }
                };
                let turn = Vector3::from_fn(|k, _| by(k));
                let value = less_turns(2.0 * libm::atan2(s, c) - angle);
                vec![TargetResidual { value, by: StateChange { turn, ..zero } }]
            }
            Self::Direction { of, to } => {
                let rotation = rotation(&state.attitude);
                let apart = rotation * of - to;
                turning(&apart, &-(rotation * of.cross_matrix()))
            }
        }
    }
}

impl Target {
    /// Distance of a state from the target: the length of the rows, or the angle for a direction.
    pub fn miss(&self, state: &State) -> f64 {
        let rows = self.kind.rows(state);
        let length = rows.iter().map(|row| row.value * row.value).sum::<f64>().sqrt();
        match self.kind {
            TargetKind::Direction { .. } => 2.0 * libm::asin((0.5 * length).min(1.0)),
            _ => length,
        }
    }
}

/// Whole turn, rad.
const TURN: f64 = 2.0 * std::f64::consts::PI;

/// Angle without whole turns, between −π and π.
fn less_turns(angle: f64) -> f64 {
    angle - TURN * libm::round(angle / TURN)
}

/// Inverse of the right Jacobian of the exponential map: the derivative of the rotation vector θ by a further turn about
/// the body's axes,
///
/// ```text
/// E + ½ [θ]× + (1/|θ|² − (1 + cos |θ|)/(2 |θ| sin |θ|)) [θ]×²
/// ```
fn right_jacobian_inverse(theta: &Vector3<f64>) -> nalgebra::Matrix3<f64> {
    let angle = theta.norm();
    let cross = theta.cross_matrix();
    // Series for small angles, where the difference loses all digits.
    let factor = if angle < 1e-2 {
        1.0 / 12.0 + angle * angle / 720.0
    } else {
        let (sin, cos) = libm::sincos(angle);
        1.0 / (angle * angle) - (1.0 + cos) / (2.0 * angle * sin)
    };
    nalgebra::Matrix3::identity() + 0.5 * cross + factor * cross * cross
}

#[cfg(test)]
#[path = "tests/target.rs"]
mod tests;
