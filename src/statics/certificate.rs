//! Certificates of statics, recomputed from forces and velocities alone.

use super::loads::{LoadCase, Twist};
use super::structure::{ContactRow, Structure};
use nalgebra::Vector3;
use tumble_core::contact::ContactLoad;

/// Largest imbalance of a body, as a fraction of its load.
const BALANCED: f64 = 1e-7;
/// The same as a fraction of the sum of all loads.
const BALANCED_OF_ALL: f64 = 1e-10;
/// Largest force outside of a cone or range, as a fraction of the force. Rounding only: forces are
/// moved into their cones.
const INSIDE: f64 = 1e-12;
/// Smallest [excluded force](MechanismCheck::excluded) of a mechanism that holds, in units of the sum of
/// all loads.
const EXCLUDED: f64 = 100.0;
/// Largest violation of (S2), as a fraction of the largest speed.
const DILATES: f64 = 1e-7;
/// Smallest power of a mechanism, as a fraction of loads times speeds: above rounding.
const POWER: f64 = 1e-11;

/// Forces of all contacts and axes of a structure.
#[derive(Debug, Clone, PartialEq)]
pub struct ForceState {
    /// Force on A (N, world) and moment about the touching point (N m, world) of each contact.
    pub contacts: Vec<ContactLoad>,
    /// Force of each axis of joints and gears (N or N m).
    pub axes: Vec<f64>,
}

/// Velocities of all bodies that prove that no forces balance the loads. They are a certificate, not the
/// motion that follows.
#[derive(Debug, Clone, PartialEq)]
pub struct Mechanism {
    /// Velocity (m/s) and angular velocity (rad/s, world) of each body.
    pub velocities: Vec<Twist>,
}

/// Check of a [`ForceState`].
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct ForceCheck {
    /// Largest imbalance of a body (N); torques are divided by its reach.
    pub imbalance: f64,
    /// Sum of the loads on all bodies (N); torques are divided by their reach.
    pub loads: f64,
    /// Smallest margin of a contact in its cone, μ f_n − ‖f_t‖ (N). Negative outside.
    pub cone_margin: f64,
    /// Contact with the smallest margin.
    pub contact: Option<usize>,
    /// True if the forces balance the loads, and all are in their cones.
    pub holds: bool,
}

/// Check of a [`Mechanism`].
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct MechanismCheck {
    /// Power of the loads, less the work of bounded forces of joints (W).
    pub power: f64,
    /// Largest violation μ ‖u_t‖ − u_n of a contact, or speed of a locked axis (m/s).
    pub violation: f64,
    /// Largest speed of a body (m/s), with its reach.
    pub speed: f64,
    /// No forces balance the loads whose normal forces, and forces of locked axes, have a sum up to this
    /// (N): power over violation, see (S2).
    pub excluded: f64,
    /// True if the velocities prove that no forces balance the loads.
    pub holds: bool,
}

impl ContactRow {
    /// Smallest margin of a force and moment in the cones of the contact (N), and the largest violation
    /// that is rounding (N).
    fn margin(&self, load: &ContactLoad) -> (f64, f64) {
        let pressing = self.normal.dot(&load.force);
        let mut across = load.force - self.normal * pressing;
        let moment_n = self.normal.dot(&load.moment);
        let moment_t = load.moment - self.normal * moment_n;
        let size = load.force.norm();
        let mut margin = match self.dragged {
            Some(dragged) => {
                let missed = (across - dragged * (self.friction * pressing)).norm();
                pressing.min(-missed)
            }
            None => {
                if let Some((along, scale)) = self.scaled {
                    across += along * (along.dot(&across) * (1.0 / scale - 1.0));
                }
                pressing.min(self.friction * pressing - across.norm())
            }
        };
        let [rolling, torsional] = self.turning;
        if rolling > 0.0 || moment_t != Vector3::zeros() {
            margin = margin.min(rolling * pressing - moment_t.norm());
        }
        if torsional > 0.0 || moment_n != 0.0 {
            margin = margin.min(torsional * pressing - moment_n.abs());
        }
        (margin, INSIDE * (size + load.moment.norm()))
    }

    /// Dual margin u_n − μ ‖u_t‖ − … of the velocity and angular velocity of A relative to B (S2).
    fn dilation(&self, velocity: &Vector3<f64>, turning: &Vector3<f64>) -> f64 {
        let opening = self.normal.dot(velocity);
        let mut slip = velocity - self.normal * opening;
        let [rolling, torsional] = self.turning;
        let spin = self.normal.dot(turning);
        let roll = (turning - self.normal * spin).norm();
        let sliding = match self.dragged {
            Some(dragged) => -self.friction * dragged.dot(&slip),
            None => {
                if let Some((along, scale)) = self.scaled {
                    slip += along * (along.dot(&slip) * (scale - 1.0));
                }
                self.friction * slip.norm()
            }
        };
        opening - sliding - rolling * roll - torsional * spin.abs()
    }
}

impl Structure {
    /// Largest speed of a body (m/s), with its reach.
    pub(super) fn speed(&self, velocities: &[Twist]) -> f64 {
        let speeds = velocities.iter().zip(&self.reaches);
        speeds.fold(0.0, |most: f64, (twist, reach)| {
            most.max(twist.linear.norm() + twist.angular.norm() * reach)
        })
    }

    /// Recomputes the balance (S1) and the cone margins of forces under `loads`. A list of another
    /// length, or a number that is not finite, fails.
    pub fn check_forces(&self, forces: &ForceState, loads: &LoadCase) -> ForceCheck {
        let bodies = self.masses.len();
        let mut check = ForceCheck {
            imbalance: f64::NAN,
            loads: f64::NAN,
            cone_margin: f64::INFINITY,
            contact: None,
            holds: false,
        };
        let sizes = [forces.contacts.len(), forces.axes.len(), loads.wrenches.len()];
        if sizes != [self.contacts.len(), self.axes.len(), bodies] {
            return check;
        }
        let mut sums = loads.wrenches.clone();
        let size = |body: usize, twist: &Twist| {
            twist.linear.norm() + twist.angular.norm() / self.reaches[body]
        };
        // Loads that cancel those of the scene count too.
        let own = &self.loads.wrenches;
        let load = |body: usize| size(body, &loads.wrenches[body]) + size(body, &own[body]);
        let mut add = |body: usize, twist: Twist| sums[body] = sums[body].plus(twist);
        let mut is_inside = true;
        // Contacts: forces and moments within their cones
        for (index, (contact, load)) in self.contacts.iter().zip(&forces.contacts).enumerate() {
            for (body, sign) in contact.key.bodies().zip([1.0, -1.0]) {
                let mut twist =
                    Twist::at(&(contact.point - self.centres[body]), &(load.force * sign));
                twist.angular += load.moment * sign;
                add(body, twist);
            }
            let (margin, rounding) = contact.margin(load);
            is_inside &= margin >= -rounding;
            if margin < check.cone_margin {
                (check.cone_margin, check.contact) = (margin, Some(index));
            }
        }
        // Axes: forces within their ranges
        for (axis, force) in self.axes.iter().zip(&forces.axes) {
            let [low, high] = axis.range;
            is_inside &= (low..=high).contains(force);
            axis.on.iter().for_each(|(body, twist)| add(*body, twist.times(*force)));
        }
        let free = || (0..bodies).filter(|body| !self.held[*body]);
        (check.imbalance, check.loads) = (0.0, free().map(load).sum());
        // Balance of each free body, relative to the loads
        let mut is_balanced = true;
        for body in free() {
            let missed = size(body, &sums[body]);
            let allowed = (BALANCED * load(body)).max(BALANCED_OF_ALL * check.loads);
            is_balanced &= missed <= allowed;
            check.imbalance = check.imbalance.max(missed);
        }
        check.holds = is_inside && is_balanced;
        check
    }

    /// Recomputes (S2) for velocities under `loads`. A list of another length, a held body that moves, or a
    /// number that is not finite, fails.
    pub fn check_mechanism(&self, mechanism: &Mechanism, loads: &LoadCase) -> MechanismCheck {
        let velocities = &mechanism.velocities;
        let bodies = self.masses.len();
        if [velocities.len(), loads.wrenches.len()] != [bodies; 2] {
            let [power, violation, excluded] = [f64::NAN; 3];
            return MechanismCheck { power, violation, speed: 0.0, excluded, holds: false };
        }
        let mut violation = 0.0_f64;
        for contact in &self.contacts {
            let (velocity, turning) = self.relative(contact, velocities);
            violation = violation.max(-contact.dilation(&velocity, &turning));
        }
        let (work, locked) = self.work_of_axes(velocities);
        let stays = |body: usize| !self.held[body] || velocities[body] == Twist::ZERO;
        let speed = self.speed(velocities);
        let power = loads.power(velocities) + work;
        violation = violation.max(locked);
        let size: f64 = (0..bodies)
            .filter(|body| !self.held[*body])
            .map(|body| {
                loads.wrenches[body].linear.norm()
                    + loads.wrenches[body].angular.norm() / self.reaches[body]
            })
            .sum();
        let excluded = power / violation;
        let holds = power > POWER * size * speed
            && violation <= DILATES * speed
            && excluded >= EXCLUDED * size
            && speed.is_finite()
            && (0..bodies).all(stays);
        MechanismCheck { power, violation, speed, excluded, holds }
    }

    /// Velocity of A relative to B at the touching point of a contact, and its angular velocity.
    pub(super) fn relative(
        &self,
        contact: &ContactRow,
        velocities: &[Twist],
    ) -> (Vector3<f64>, Vector3<f64>) {
        let sides = contact.key.bodies().zip([1.0, -1.0]);
        sides.fold((Vector3::zeros(), Vector3::zeros()), |(velocity, turning), (body, sign)| {
            let Twist { linear, angular } = velocities[body];
            let arm = contact.point - self.centres[body];
            (velocity + (linear + angular.cross(&arm)) * sign, turning + angular * sign)
        })
    }

    /// Least power of the bounded forces of axes with these velocities (W), and the largest speed at which
    /// an unbounded force acts.
    pub(super) fn work_of_axes(&self, velocities: &[Twist]) -> (f64, f64) {
        let mut work = 0.0;
        let mut locked = 0.0_f64;
        for axis in &self.axes {
            let rate: f64 = axis.on.iter().map(|(body, on)| on.dot(&velocities[*body])).sum();
            let end = axis.range[usize::from(rate < 0.0)];
            if end.is_finite() {
                work += end * rate;
            } else {
                locked = locked.max(rate.abs());
            }
        }
        (work, locked)
    }
}

impl Mechanism {
    /// The same mechanism at another speed.
    #[must_use]
    pub fn times(&self, factor: f64) -> Self {
        Self { velocities: self.velocities.iter().map(|twist| twist.times(factor)).collect() }
    }
}
