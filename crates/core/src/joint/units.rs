//! Unit conversion of joints and gears.

use super::{Axis, Drive, Gear, Joint, JointAxis, JointFrame, Motor};

/// Units of an axis: of its coordinate (m, or 1 for rad), of its force (N or N m) and of time (s).
#[derive(Clone, Copy)]
struct AxisUnits {
    coordinate: f64,
    force: f64,
    time: f64,
}

impl AxisUnits {
    fn stiffness(self, value: f64) -> f64 {
        value * self.coordinate / self.force
    }

    fn damping(self, value: f64) -> f64 {
        value * self.coordinate / (self.force * self.time)
    }

    fn axis(self, axis: Axis) -> Axis {
        let Axis::Free(drive) = axis else { return axis };
        let Self { coordinate, force, time } = self;
        let motor = drive.motor.map(|motor| match motor {
            Motor::Speed { target, most } => {
                Motor::Speed { target: target * time / coordinate, most: most / force }
            }
            Motor::Position { target, stiffness, damping, most } => Motor::Position {
                target: target / coordinate,
                stiffness: self.stiffness(stiffness),
                damping: self.damping(damping),
                most: most / force,
            },
            Motor::Damper { target, damping, most } => Motor::Damper {
                target: target * time / coordinate,
                damping: self.damping(damping),
                most: most / force,
            },
        });
        Axis::Free(Drive {
            limits: drive.limits.map(|ends| ends.map(|end| end / coordinate)),
            friction: drive.friction / force,
            stiffness: self.stiffness(drive.stiffness),
            rest: drive.rest / coordinate,
            damping: self.damping(drive.damping),
            force: drive.force / force,
            armature: drive.armature * coordinate / (force * time * time),
            motor,
        })
    }
}

/// Units of linear and of angular axes.
fn units(mass: f64, length: f64, time: f64) -> (AxisUnits, AxisUnits) {
    let force = mass * length / (time * time);
    let place = AxisUnits { coordinate: length, force, time };
    (place, AxisUnits { coordinate: 1.0, force: force * length, time })
}

impl Gear {
    /// Copy in units of `mass` (kg), `length` (m) and `time` (s).
    pub(crate) fn in_units(&self, mass: f64, length: f64, time: f64) -> Self {
        let (place, turn) = units(mass, length, time);
        let [first, second] = self.axes.map(|at| match at.axis {
            JointAxis::Linear(_) => place,
            JointAxis::Angular(_) => turn,
        });
        Self {
            ratio: self.ratio * second.coordinate / first.coordinate,
            offset: self.offset / first.coordinate,
            law: first.axis(self.law),
            ..*self
        }
    }
}

impl Joint {
    /// Copy in units of `mass` (kg), `length` (m) and `time` (s).
    pub(crate) fn in_units(&self, mass: f64, length: f64, time: f64) -> Self {
        let (place, turn) = units(mass, length, time);
        let frame = |frame: JointFrame| JointFrame { anchor: frame.anchor / length, ..frame };
        Self {
            frames: self.frames.map(frame),
            linear: self.linear.map(|axis| place.axis(axis)),
            angular: self.angular.map(|axis| turn.axis(axis)),
            length: self.length.map(|of| of / length),
            push: [self.push[0] / place.force, self.push[1] / turn.force],
            ..self.clone()
        }
    }
}
