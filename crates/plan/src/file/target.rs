//! Targets and path constraints from their tables.

use super::tables::{PathConstraintTable, PointTable, TargetTable, WallTable};
use super::{body_of, unit};
use crate::path_constraint::{PathConstraint, PathConstraintKind};
use crate::target::{Target, TargetKind};
use nalgebra::Vector3;
use tumble_model::fields::Exactly;
use tumble_scene::scene::Scene;

/// Default tolerances in m, m/s, rad/s and degrees.
const USUAL: (f64, f64, f64, f64) = (1e-3, 1e-2, 1e-2, 0.5);

/// A quantity of a table: name, target, tolerance, weight, and default tolerance.
type TargetField = (&'static str, TargetKind, Option<f64>, Option<f64>, f64);

impl TargetTable {
    /// Targets of a table, one for each quantity.
    pub(super) fn targets(self, scene: &Scene, steps: usize) -> Result<Vec<Target>, String> {
        let body = body_of(scene, self.body.as_deref())?;
        let after = self.after.map_or(steps, |after| after as usize);
        let mut kinds: Vec<TargetField> = Vec::new();
        let (tolerance, weight) = (&self.tolerance, &self.weight);
        let (m, m_s, rad_s, degrees) = USUAL;
        let mut position = [self.x, self.y, self.z];
        if let Some(values) = &self.position {
            if position.iter().any(Option::is_some) || !(1..=3).contains(&values.len()) {
                let why = "position: one to three numbers without x, y and z are needed";
                return Err(why.to_owned());
            }
            position.iter_mut().zip(values).for_each(|(of, value)| *of = Some(*value));
        }
        if position.iter().any(Option::is_some) {
            let kind = TargetKind::Position(position);
            kinds.push(("position", kind, tolerance.position, weight.position, m));
        }
        if let Some(Exactly(velocity)) = self.velocity {
            let kind = TargetKind::Velocity(velocity.map(Some));
            kinds.push(("velocity", kind, tolerance.velocity, weight.velocity, m_s));
        }
        for (name, value) in [("speed", self.speed), ("spin", self.spin)] {
            if value.is_some_and(|value| value != 0.0) {
                let why = "only 0 is supported; use velocity for other values";
                return Err(format!("{name}: {why}"));
            }
        }
        if self.speed.is_some() {
            let kind = TargetKind::Velocity([Some(0.0); 3]);
            kinds.push(("speed", kind, tolerance.speed, weight.speed, m_s));
        }
        if self.spin.is_some() {
            let kind = TargetKind::Spin([Some(0.0); 3]);
            kinds.push(("spin", kind, tolerance.spin, weight.spin, rad_s));
        }
        let radians = |of: Option<f64>| of.map(f64::to_radians);
        if let Some(Exactly(attitude)) = self.attitude {
            let attitude = nalgebra::Vector4::from(attitude);
            let norm = attitude.norm();
            if !(norm > 1e-6 && norm < 1e6) {
                return Err("attitude: a length from 1e-6 to 1e6 is needed".to_owned());
            }
            let kind = TargetKind::Attitude(attitude / norm);
            kinds.push(("attitude", kind, radians(tolerance.attitude), weight.attitude, degrees));
        }
        if let Some(turn) = self.turn {
            let axis = self.axis.as_ref().map_or(Ok(Vector3::z()), |axis| unit("axis", axis))?;
            let from = scene.starts[body].attitude;
            let kind = TargetKind::Turn { axis, angle: turn.to_radians(), from };
            kinds.push(("turn", kind, radians(tolerance.turn), weight.turn, degrees));
        } else if self.axis.is_some() {
            return Err("axis: it has no meaning without turn; leave it out".to_owned());
        }
        if let Some(down) = self.down {
            let kind = TargetKind::Direction { of: down.direction(), to: -Vector3::z() };
            kinds.push(("down", kind, radians(tolerance.down), weight.down, degrees));
        }
        if kinds.is_empty() {
            let all = "position, velocity, speed, spin, attitude, turn, down";
            return Err(format!("the target is empty; one or more of {all} are needed"));
        }
        let each = [
            ("position", tolerance.position, weight.position),
            ("velocity", tolerance.velocity, weight.velocity),
            ("speed", tolerance.speed, weight.speed),
            ("spin", tolerance.spin, weight.spin),
            ("attitude", tolerance.attitude, weight.attitude),
            ("turn", tolerance.turn, weight.turn),
            ("down", tolerance.down, weight.down),
        ];
        for (name, tolerance, weight) in each {
            let idle = tolerance.or(weight).is_some() && kinds.iter().all(|kind| kind.0 != name);
            if idle {
                return Err(format!("tolerance and weight: {name} is not among the targets"));
            }
        }
        let target = |(name, kind, tolerance, weight, usual): TargetField| {
            let usual = if kind.unit() == "rad" { usual.to_radians() } else { usual };
            let tolerance = tolerance.unwrap_or(usual);
            let weight = weight.unwrap_or(1.0 / (tolerance * tolerance));
            let mut name = format!("{}.{name}", scene.bodies[body]);
            if after != steps {
                name += &format!("@{after}");
            }
            Target { name, body, after, kind, tolerance, weight }
        };
        Ok(kinds.into_iter().map(target).collect())
    }
}

impl PathConstraintTable {
    /// Path constraints of a table, one for each bound.
    pub(super) fn path_constraints(self, scene: &Scene) -> Result<Vec<PathConstraint>, String> {
        let body = body_of(scene, self.body.as_deref())?;
        let positive = |what: &str, value: f64| {
            let fits = value > 0.0 && value.is_finite();
            if fits { Ok(()) } else { Err(format!("{what}: a number above 0 is needed")) }
        };
        let mut kinds = Vec::new();
        if let Some(WallTable { x, width, height }) = self.above {
            positive("above.width", width)?;
            positive("above.height", height)?;
            kinds.push(("above", PathConstraintKind::Above { at: x, width, height }));
        }
        if let Some(PointTable { point, radius }) = self.away {
            positive("away.radius", radius)?;
            kinds.push(("away", PathConstraintKind::Away { point: point.0.into(), radius }));
        }
        for (component, (name, range)) in
            [("x", self.x), ("y", self.y), ("z", self.z)].into_iter().enumerate()
        {
            let Some(Exactly([low, high])) = range else { continue };
            if low.is_nan() || high.is_nan() || low > high {
                return Err(format!("{name}: two numbers in order are needed"));
            }
            // A range may be open at an end.
            if low != f64::NEG_INFINITY {
                kinds.push((name, PathConstraintKind::AtLeast { component, low }));
            }
            if high != f64::INFINITY {
                kinds.push((name, PathConstraintKind::AtMost { component, high }));
            }
        }
        if kinds.is_empty() {
            return Err("no bound is given; one of above, away, x, y and z is needed".to_owned());
        }
        let tolerance = self.tolerance.unwrap_or(USUAL.0);
        let weight = self.weight.unwrap_or(1.0 / (tolerance * tolerance));
        let name = self.name.unwrap_or_else(|| format!("{}.path", scene.bodies[body]));
        let constraint = |(word, kind): (&str, PathConstraintKind)| {
            let name = format!("{name}.{word}");
            PathConstraint { name, body, kind, tolerance, weight }
        };
        Ok(kinds.into_iter().map(constraint).collect())
    }
}
