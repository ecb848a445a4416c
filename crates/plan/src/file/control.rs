//! Controls from their tables.

use super::tables::{ControlTable, JointNames, KindName, Range};
use super::{body_of, unit};
use crate::control::{Control, ControlKind, PushControl, StartPart};
use nalgebra::{Matrix3, Vector3};
use tumble_core::joint::JointAxis;
use tumble_core::world::Constant;
use tumble_core::world::constants::extents;
use tumble_model::shown;
use tumble_scene::scene::Scene;

impl ControlTable {
    /// Control of the table.
    pub(super) fn control(
        self,
        scene: &Scene,
        steps: usize,
        effort: f64,
    ) -> Result<Control, String> {
        self.refuse_idle()?;
        let each = |ranges: &[Option<Range>]| ranges.iter().map(|of| Range::bounds(*of)).collect();
        let axes = [self.x, self.y, self.z];
        let body = || body_of(scene, self.body.as_deref());
        let word = format!("{:?}", self.kind).to_lowercase();
        let of_body = |body: usize| format!("{}.{word}", scene.bodies[body]);
        // Kind, bounds and default name
        let (kind, bounds, usual): (_, Vec<[f64; 2]>, _) = match self.kind {
            KindName::Force => {
                let body = body()?;
                (ControlKind::Force { body }, each(&axes), of_body(body))
            }
            KindName::Torque => {
                let body = body()?;
                (ControlKind::Torque { body }, each(&axes), of_body(body))
            }
            KindName::Push => {
                let body = body()?;
                let push = self.push(scene, body)?;
                let ranges =
                    [self.normal, self.tangential, self.tangential_2, self.offset, self.offset_2];
                (ControlKind::Push(push), each(&ranges), of_body(body))
            }
            KindName::Motor => {
                let Some(joints) = self.joint.as_ref().map(JointNames::names) else {
                    return Err("joint: the name of a joint is needed".to_owned());
                };
                let axes = joints.iter().map(|joint| self.joint_axis(scene, joint));
                let axes = axes.collect::<Result<_, _>>()?;
                if self.force.is_none() {
                    return Err("force: a range is needed, N or N m".to_owned());
                }
                let axis_name = self.axis.as_ref().unwrap_or(&word);
                let name =
                    joints.first().map_or(word.clone(), |joint| format!("{joint}.{axis_name}"));
                (ControlKind::Motor { axes }, each(&[self.force]), name)
            }
            KindName::Start => {
                let body = body()?;
                let needed = "of: position, turn, velocity or spin is needed";
                let part = self.of.ok_or(needed)?;
                let bounds = self.start_bounds(&scene.starts[body], part);
                let word = format!("{part:?}").to_lowercase();
                let name = format!("{}.{word}", scene.bodies[body]);
                (ControlKind::Start { body, part }, bounds, name)
            }
            KindName::Constant => {
                let wanted = self.constant.as_deref().unwrap_or_default();
                let constant = Constant::from_name(wanted).ok_or_else(|| {
                    format!("constant: {wanted:?} is not a constant; use friction, for example")
                })?;
                if self.value.is_none() {
                    return Err("value: a range is needed".to_owned());
                }
                let name = match constant {
                    // `ground` alone is the name of a table in scenes.
                    Constant::Ground => "ground.height",
                    other => other.name(),
                };
                (ControlKind::Constant(constant), each(&[self.value]), name.to_owned())
            }
        };
        // One knot for the whole run, or one for each step by default
        let knots = match self.knots {
            Some(knots) => knots as usize,
            None if kind.is_of_the_run() => 1,
            None => steps,
        };
        let name = self.name.unwrap_or(usual);
        shown::checked_name(&name)?;
        Ok(Control { name, kind, bounds, knots, effort: self.effort.unwrap_or(effort) })
    }

    /// Refuses fields of other kinds of control.
    fn refuse_idle(&self) -> Result<(), String> {
        use KindName::{Constant, Force, Motor, Push, Start, Torque};
        let fields: [(&str, bool, &[KindName]); 17] = [
            ("body", self.body.is_some(), &[Force, Torque, Push, Start]),
            ("knots", self.knots.is_some(), &[Force, Torque, Push, Motor]),
            ("effort", self.effort.is_some(), &[Force, Torque, Push, Motor]),
            ("x", self.x.is_some(), &[Force, Torque, Start]),
            ("y", self.y.is_some(), &[Force, Torque, Start]),
            ("z", self.z.is_some(), &[Force, Torque, Start]),
            ("face", self.face.is_some(), &[Push]),
            ("at", self.at.is_some(), &[Push]),
            ("direction", self.direction.is_some(), &[Push]),
            ("friction", self.friction.is_some(), &[Push]),
            ("normal", self.normal.is_some(), &[Push]),
            ("tangential", self.tangential.or(self.tangential_2).is_some(), &[Push]),
            ("offset", self.offset.or(self.offset_2).is_some(), &[Push]),
            ("joint or axis", self.joint.is_some() || self.axis.is_some(), &[Motor]),
            ("force", self.force.is_some(), &[Motor]),
            ("of", self.of.is_some(), &[Start]),
            ("constant or value", self.constant.is_some() || self.value.is_some(), &[Constant]),
        ];
        match fields.iter().find(|(_, given, kinds)| *given && !kinds.contains(&self.kind)) {
            None => Ok(()),
            Some((field, ..)) => {
                let kind = format!("{:?}", self.kind).to_lowercase();
                Err(format!("{field}: it has no meaning in a control of kind {kind}; leave it out"))
            }
        }
    }

    /// Index of a joint by its name, and its axis.
    fn joint_axis(&self, scene: &Scene, wanted: &str) -> Result<(usize, JointAxis), String> {
        let Some(joint) = scene.joints.iter().position(|name| name == wanted) else {
            let known: Vec<_> = scene.joints.iter().take(8).cloned().collect();
            let has = if known.is_empty() { "none".to_owned() } else { known.join(", ") };
            return Err(format!("joint: unknown joint {wanted:?}; the scene has {has}"));
        };
        let axis = scene.document.joint_kind(joint).driven_axis(wanted, self.axis.as_deref());
        let axis = axis.map_err(|why| format!("axis: {why}"))?;
        let axis = if axis < 3 { JointAxis::Linear(axis) } else { JointAxis::Angular(axis - 3) };
        Ok((joint, axis))
    }

    fn push(&self, scene: &Scene, body: usize) -> Result<PushControl, String> {
        if self.normal.is_none() {
            return Err("normal: a range is needed, N".to_owned());
        }
        let (point, into) = match (self.face, &self.at, &self.direction) {
            (Some(face), at, None) => {
                let out = face.direction();
                let reach = extents(&scene.world.bodies()[body]);
                let centre = out.component_mul(&reach);
                (at.map_or(centre, |at| at.0.into()), -out)
            }
            (None, Some(at), Some(direction)) => (at.0.into(), unit("direction", direction)?),
            _ => return Err("face, or at and direction, are needed".to_owned()),
        };
        // The first tangent is along y, or along x for a push along y or z.
        let along = if into[0].abs() > 0.9 { Vector3::y() } else { Vector3::x() };
        let first = (along - into * into.dot(&along)).normalize();
        let frame = Matrix3::from_columns(&[into, first, into.cross(&first)]);
        Ok(PushControl { body, point, frame, friction: self.friction })
    }

    /// Bounds of a start; a component without a range keeps the scene's value.
    fn start_bounds(&self, own: &tumble_core::mechanics::State, part: StartPart) -> Vec<[f64; 2]> {
        let own = part.value(own);
        let ranges = [self.x, self.y, self.z].into_iter().zip(&own);
        ranges.map(|(range, own)| range.map_or([*own; 2], |of| Range::bounds(Some(of)))).collect()
    }
}
