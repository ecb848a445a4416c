//! Targets and path constraints from their tables.

use super::tables::{Each, PathConstraintTable, PointTable, TargetTable, WallTable};
use super::{body_of, unit};
use crate::path_constraint::{PathConstraint, PathConstraintKind};
use crate::target::{Target, TargetKind};
use nalgebra::Vector3;
use tumble_model::fields::Exactly;
use tumble_scene::scene::Scene;

/// Default tolerances in m, m/s, rad/s and degrees.
const USUAL: (f64, f64, f64, f64) = (1e-3, 1e-2, 1e-2, 0.5);

impl TargetTable {
    /// Targets of a table, one for each quantity.
    pub(super) fn targets(self, scene: &Scene, steps: usize) -> Result<Vec<Target>, String> {
        let body = body_of(scene, self.body.as_deref())?;
        let after = self.after.map_or(steps, |after| after as usize);
        let mut kinds: Vec<(&str, TargetKind)> = Vec::new();
        let mut position = [self.x, self.y, self.z];
        if let Some(values) = &self.position {
            if position.iter().any(Option::is_some) || !(1..=3).contains(&values.len()) {
                let why = "position: one to three numbers without x, y and z are needed";
                return Err(why.to_owned());
            }
            position.iter_mut().zip(values).for_each(|(of, value)| *of = Some(*value));
        }
        if position.iter().any(Option::is_some) {
            kinds.push(("position", TargetKind::Position(position)));
        }
        // Only zero has no direction, so that `speed` and `spin` are targets of all components.
        if let Some(Exactly(velocity)) = self.velocity {
            kinds.push(("velocity", TargetKind::Velocity(velocity.map(Some))));
        }
        for (name, value) in [("speed", self.speed), ("spin", self.spin)] {
            if value.is_some_and(|value| value != 0.0) {
                let why = "only 0 is supported; use velocity for other values";
                return Err(format!("{name}: {why}"));
            }
        }
        if self.speed.is_some() {
            kinds.push(("speed", TargetKind::Velocity([Some(0.0); 3])));
        }
        if self.spin.is_some() {
            kinds.push(("spin", TargetKind::Spin([Some(0.0); 3])));
        }
        // Rotations
        if let Some(Exactly(attitude)) = self.attitude {
            let attitude = nalgebra::Vector4::from(attitude);
            let norm = attitude.norm();
            if !(norm > 1e-6 && norm < 1e6) {
                return Err("attitude: a length from 1e-6 to 1e6 is needed".to_owned());
            }
            kinds.push(("attitude", TargetKind::Attitude(attitude / norm)));
        }
        if let Some(turn) = self.turn {
            let axis = self.axis.as_ref().map_or(Ok(Vector3::z()), |axis| unit("axis", axis))?;
            let from = scene.starts[body].attitude;
            kinds.push(("turn", TargetKind::Turn { axis, angle: turn.to_radians(), from }));
        } else if self.axis.is_some() {
            return Err("axis: it has no meaning without turn; leave it out".to_owned());
        }
        if let Some(down) = self.down {
            let kind = TargetKind::Direction { of: down.direction(), to: -Vector3::z() };
            kinds.push(("down", kind));
        }
        if kinds.is_empty() {
            let all = "position, velocity, speed, spin, attitude, turn, down";
            return Err(format!("the target is empty; one or more of {all} are needed"));
        }
        // Tolerances and weights have to belong to a target.
        let settings = self.tolerance.fields().into_iter().zip(self.weight.fields());
        for ((name, tolerance), (_, weight)) in settings {
            let idle = tolerance.or(weight).is_some() && kinds.iter().all(|kind| kind.0 != name);
            if idle {
                return Err(format!("tolerance and weight: {name} is not among the targets"));
            }
        }
        let given = |each: &Each, name: &str| {
            each.fields().into_iter().find(|(field, _)| *field == name).and_then(|(_, given)| given)
        };
        // A weight of 1/tolerance² makes a miss by the tolerance cost 1.
        let target = |(name, kind): (&str, TargetKind)| {
            let usual = match kind.unit() {
                "m" => USUAL.0,
                "m/s" => USUAL.1,
                "rad/s" => USUAL.2,
                _ => USUAL.3,
            };
            let tolerance = given(&self.tolerance, name).unwrap_or(usual);
            let is_angle = kind.unit() == "rad";
            let tolerance = if is_angle { tolerance.to_radians() } else { tolerance };
            let weight = given(&self.weight, name).unwrap_or(1.0 / (tolerance * tolerance));
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
