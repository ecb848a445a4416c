//! Joints of an SDF file.

use super::frames::{Scoped, end, key, pose_of};
use super::{SdfReader, is_true, made, number, text_of, valued, vector};
use crate::frame::LinkFrame;
use crate::urdf::extra;
use crate::xml::{Attributes, Element, Parsed};
use nalgebra::Vector3;
use std::collections::HashSet;
use std::f64::consts::TAU;

/// Magnitude of a limit that means none.
const NO_LIMIT: f64 = 1e16;

impl SdfReader<'_> {
    /// Joints of URDF for a joint, with a link between the axes of a joint that has two. Adds the
    /// child link to `carried`. A joint of a static model is none.
    pub(super) fn joint(
        &mut self,
        joint: Scoped<'_>,
        carried: &mut HashSet<String>,
    ) -> Parsed<Vec<Element>> {
        let Scoped { element, model } = joint;
        let scope = &self.frames.models[model].key;
        let name = key(scope, element.needed("name")?);
        let below = key(scope, end(element, "child")?);
        let above = key(scope, end(element, "parent")?);
        let parent = self.frames.link_of(&above, element)?;
        let child = self.frames.link_of(&below, element)?;
        if child.is_empty() {
            return Err(element.wrong("child: it is the world; exchange <parent> and <child>"));
        }
        if self.frames.models[model].is_static {
            return Ok(Vec::new());
        }
        // Frame of the child in the parent, and anchor in the child. The links keep their own frames.
        let (base, pose) = pose_of(element, scope, &below)?;
        let own = self.frames.world(&base, element)?.then(&pose);
        let child_frame = self.frames.world(&child, element)?;
        let frame = child_frame.relative_to(&self.frames.world(&parent, element)?);
        let anchor = own.relative_to(&child_frame).position;
        carried.insert(child.clone());
        // Parts of the joint in URDF
        let placed = |name: &str, kind: &str, ends: [&str; 2], frame: &LinkFrame| {
            let joint = self.joined(element, name, kind, ends, frame);
            joint.with(extra::ANCHOR, text_of(anchor.as_slice()))
        };
        let with_axis = |joint: Element, tag: &str| {
            let axis = element.one(tag)?;
            let direction = child_frame.rotation().tr_mul(&self.axis(axis, scope, &own)?);
            let xyz =
                made("axis", axis.unwrap_or(element)).with("xyz", text_of(direction.as_slice()));
            let mimic = element.one("mimic")?.or(axis.and_then(|axis| axis.all("mimic").next()));
            let mimic = mimic.map(|mimic| self.mimic(mimic, scope)).transpose()?;
            Ok::<_, String>(joint.holding([xyz]).holding(resistance(element, axis)?).holding(mimic))
        };
        let middle = format!("{name}.between");
        let between = made("link", element).with("name", self.named(&middle));
        let one = |kind: &str| placed(&name, kind, [&parent, &child], &frame);
        let upper = |name: &str, kind: &str| placed(name, kind, [&parent, &middle], &frame);
        let lower =
            |name: &str| placed(name, "revolute", [&middle, &child], &LinkFrame::identity());
        Ok(match element.needed("type")? {
            "fixed" => vec![one("fixed")],
            "ball" => vec![with_axis(one("spherical"), "axis")?],
            kind @ ("revolute" | "continuous" | "prismatic" | "planar") => {
                vec![with_axis(one(kind), "axis")?]
            }
            // Two hinges about the same point
            "universal" | "revolute2" => vec![
                with_axis(upper(&format!("{name}_1"), "revolute"), "axis")?,
                with_axis(lower(&format!("{name}_2")), "axis2")?,
                between,
            ],
            // A slide that follows a hinge by m a turn, or by rad/m with the opposite sign.
            "screw" => {
                let pitch = number(element, "screw_thread_pitch")?;
                let turns = number(element, "thread_pitch")?.filter(|turns| *turns != 0.0);
                let pitch = pitch.or(turns.map(|turns| -TAU / turns)).unwrap_or(1.0);
                let leader = made("mimic", element).with("joint", self.named(&name));
                let leader = leader.with("multiplier", text_of(&[pitch / TAU]));
                let hinge = with_axis(lower(&name), "axis")?;
                let slide = upper(&format!("{name}_slide"), "prismatic");
                let axis = hinge.all("axis").next().cloned();
                let slide = slide.holding(axis).holding([limits(element, None)?, leader]);
                vec![slide, hinge, between]
            }
            _ => {
                return Err(element.wrong(
                    "type: fixed, revolute, continuous, prismatic, ball, universal, revolute2, \
                     screw or planar is needed",
                ));
            }
        })
    }

    /// Direction of an axis in the world. `own` is the frame of the joint.
    fn axis(&self, axis: Option<&Element>, scope: &str, own: &LinkFrame) -> Parsed<Vector3<f64>> {
        let Some(axis) = axis else { return Ok(own.rotation() * Vector3::z()) };
        let xyz = axis.one("xyz")?;
        let direction = xyz.map(vector).transpose()?.unwrap_or(Vector3::z());
        let is_of_model = self.is_old || is_true(axis, "use_parent_model_frame");
        let given = xyz.and_then(|xyz| xyz.own("expressed_in")).filter(|name| !name.is_empty());
        let frame = match given.or(is_of_model.then_some("__model__")) {
            Some(name) => self.frames.world(&key(scope, name), axis)?,
            None => *own,
        };
        Ok(frame.rotation() * direction)
    }

    /// `<mimic>` of Drake, or of an axis: q = multiplier (q' − reference) + offset.
    fn mimic(&self, mimic: &Element, scope: &str) -> Parsed<Element> {
        let mut made = valued(mimic);
        let value = |field: &str, usual: f64| Ok::<_, String>(made.number(field)?.unwrap_or(usual));
        let offset = value("offset", 0.0)? - value("multiplier", 1.0)? * value("reference", 0.0)?;
        made.attributes.retain(|(name, _)| !["joint", "offset"].contains(&&**name));
        let joint = self.named(&key(scope, mimic.needed("joint")?));
        Ok(made.with("joint", joint).with("offset", text_of(&[offset])))
    }
}

/// `<limit>` and `<dynamics>` of an axis.
fn resistance(joint: &Element, axis: Option<&Element>) -> Parsed<[Element; 2]> {
    let dynamics = axis.and_then(|axis| axis.all("dynamics").next());
    let mut dynamics = dynamics.map_or_else(|| made("dynamics", joint), valued);
    let springs = dynamics.attributes.iter_mut().filter(|(name, _)| name.starts_with("spring_"));
    springs.for_each(|(name, _)| name.insert(0, ':'));
    let gear = number(joint, "gear_ratio")?.unwrap_or(1.0);
    let armature = number(joint, "rotor_inertia")?.unwrap_or(0.0) * gear * gear;
    let dynamics = dynamics.with(extra::SPRING[0], text_of(&[armature]));
    Ok([limits(joint, axis.and_then(|axis| axis.all("limit").next()))?, dynamics])
}

/// `<limit>` of URDF. Limits may be missing or infinite.
fn limits(joint: &Element, limit: Option<&Element>) -> Parsed<Element> {
    let mut made = made("limit", limit.unwrap_or(joint));
    let usual = [("lower", -NO_LIMIT), ("upper", NO_LIMIT), ("effort", -1.0), ("velocity", -1.0)];
    for (tag, usual) in usual {
        let text = limit.and_then(|limit| limit.all(tag).next()).map_or("", |child| &child.text);
        let value = match text.trim_start_matches('+').to_ascii_lowercase().as_str() {
            "" => usual,
            "inf" => NO_LIMIT,
            "-inf" => -NO_LIMIT,
            _ => limit.map_or(Ok(None), |limit| number(limit, tag))?.unwrap_or(usual),
        };
        if matches!(tag, "lower" | "upper") || (0.0..NO_LIMIT).contains(&value) {
            made = made.with(tag, text_of(&[value]));
        }
    }
    Ok(made)
}
