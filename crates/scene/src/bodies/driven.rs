//! Tables `[[driven]]` and `[[surfaces]]`: bodies with prescribed motions, and surfaces that
//! move or have an axis of friction.

use super::entries::AttitudeEntry;
use super::joints::{JointEntries, JointSide, anchor_in_range};
use nalgebra::Vector3;
use serde::Deserialize;
use tumble_core::simulation::JOINT_AT_THE_START;
use tumble_model::BodyModel;
use tumble_model::fields::{Exactly, Numbers};
use tumble_model::joint::{CourseModel, JointKind, JointModel};
use tumble_model::shape::ModelPlace;

#[derive(Deserialize)]
#[serde(
    deny_unknown_fields,
    expecting = "a table [[driven]], body = \"…\" with times and positions, or velocity and spin"
)]
pub struct DrivenEntry {
    name: Option<String>,
    body: String,
    times: Option<Vec<f64>>,
    positions: Option<Vec<Numbers<3>>>,
    attitudes: Option<Vec<AttitudeEntry>>,
    velocity: Option<Numbers<3>>,
    spin: Option<Numbers<3>>,
    about: Option<Numbers<3>>,
    /// Frames in the body, from its centre of mass, and in the world, as a run has them.
    frames: Option<Exactly<ModelPlace, 2>>,
    /// Prescribed motion of the frame in the world, as a run has it.
    course: Option<CourseModel>,
}

#[derive(Deserialize)]
#[serde(
    deny_unknown_fields,
    expecting = "{ of = \"…\", velocity = [x, y, z] } or { of = \"…\", axis = [x, y, z], factor = … }"
)]
pub struct SurfaceEntry {
    /// Name of a body or a fixed object, or `ground`.
    pub of: String,
    /// Velocity of the surface (m/s): body frame for a body, world frame for a fixed object.
    pub velocity: Option<Numbers<3>>,
    /// Axis of friction, in the same frame.
    pub axis: Option<Numbers<3>>,
    /// Friction along the axis, over that across it.
    pub factor: Option<f64>,
}

impl DrivenEntry {
    /// Name of the driven body as an addition to error messages.
    pub fn error_suffix(&self) -> String {
        format!(" ({})", self.body)
    }

    /// Name of the joint, if given.
    pub fn name(&self) -> Option<&str> {
        self.name.as_deref()
    }

    /// Adds the joint that drives the body from the time `start` (s). `find` returns the bodies of
    /// a name.
    pub fn add(
        &self,
        joints: &mut JointEntries,
        bodies: &[BodyModel],
        find: impl Fn(&str) -> Result<Vec<usize>, String>,
        start: f64,
    ) -> Result<(), String> {
        let body = match find(&self.body).map_err(|why| format!("body: {why}"))?[..] {
            [body] => body,
            ref several => {
                let count = several.len();
                return Err(format!("body: {:?} names {count} bodies; one is needed", self.body));
            }
        };
        if joints.models.iter().any(|joint| joint.body == body && joint.course.is_some()) {
            return Err(format!("body: {:?} is already driven", self.body));
        }
        let of = &bodies[body];
        let name = self.name.clone().unwrap_or_else(|| format!("{}-drive", of.name));
        let joint = |frames, course| JointModel {
            name,
            kind: JointKind::Fixed,
            body,
            other: None,
            frames,
            length: None,
            cone: None,
            middle: None,
            collide: false,
            drives: Vec::new(),
            course: Some(course),
        };
        if let (Some(frames), Some(course)) = (&self.frames, &self.course) {
            return joints.push(joint(frames.0, course.clone()));
        }
        self.refuse_idle()?;
        let side = JointSide::new(Some(of));
        let (origin, attitude) = (Vector3::zeros(), ModelPlace::ORIGIN.attitude.into());
        let mut anchor = side.placed(&origin, &attitude);
        if let Some(about) = &self.about {
            anchor_in_range("about", Some(about))?;
            anchor.anchor = about.0.into();
        }
        let (there, own) = (JointSide::new(None).to_local(&anchor), side.to_local(&anchor));
        let joint = joint([own, there], self.course(&there, start)?);
        refuse_elsewhere(&joint, of, start)?;
        joints.push(joint)
    }

    /// Prescribed motion of a frame that is at `there` at the time `start` (s).
    fn course(&self, there: &ModelPlace, start: f64) -> Result<CourseModel, String> {
        let numbers = |of: &Option<Numbers<3>>| of.as_ref().map_or([0.0; 3], |of| of.0);
        let (velocity, spin) = (numbers(&self.velocity), numbers(&self.spin));
        let Some(times) = &self.times else {
            return Ok(CourseModel { times: vec![start], places: vec![*there], velocity, spin });
        };
        let count = times.len();
        let fits = |field: &str, given: usize| {
            if given == count {
                Ok(())
            } else {
                Err(format!("{field} has {given} entries, but times has {count}"))
            }
        };
        let mut places = vec![*there; count];
        if let Some(positions) = &self.positions {
            fits("positions", positions.len())?;
            for (place, position) in places.iter_mut().zip(positions) {
                anchor_in_range("positions", Some(position))?;
                place.position = position.0;
            }
        }
        if let Some(attitudes) = &self.attitudes {
            fits("attitudes", attitudes.len())?;
            for (place, turned) in places.iter_mut().zip(attitudes) {
                let attitude = turned.quaternion().map_err(|why| format!("attitudes: {why}"))?;
                let drawn = || "attitudes: random ones are not supported".to_owned();
                place.attitude = attitude.ok_or_else(drawn)?;
            }
        }
        Ok(CourseModel { times: times.clone(), places, velocity, spin })
    }

    /// Rejects fields without effect and missing fields.
    fn refuse_idle(&self) -> Result<(), String> {
        let placed = self.positions.is_some() || self.attitudes.is_some();
        let steady = self.velocity.is_some() || self.spin.is_some();
        match (&self.times, placed) {
            (None, true) => Err("times: required with `positions` and `attitudes`".to_owned()),
            (None, false) if !steady => {
                Err("times: `times` with `positions` or `attitudes`, or `velocity` or `spin`, are \
                     needed"
                    .to_owned())
            }
            (Some(_), false) => {
                Err("positions: `times` needs `positions` or `attitudes`".to_owned())
            }
            (Some(_), true) if self.about.is_some() => {
                Err("about has no meaning with `times`; leave it out".to_owned())
            }
            _ if self.about.is_some() && self.spin.is_none() => {
                Err("about has no meaning without `spin`; leave it out".to_owned())
            }
            _ => Ok(()),
        }
    }
}

/// Checks that the body starts where its prescribed motion begins.
fn refuse_elsewhere(joint: &JointModel, body: &BodyModel, start: f64) -> Result<(), String> {
    let Some(course) = &joint.course else { return Ok(()) };
    let knots = course.knots()?;
    let [own, _] = joint.frames;
    let frames = [own.frame(), knots.at(start)];
    let there = tumble_core::joint::Joint::fixed(0, None, frames);
    let (place, turn) = there.error(&[body.start]).unwrap_or((f64::NAN, f64::NAN));
    // Written so that a NaN is rejected.
    let fits = place.max(turn) <= JOINT_AT_THE_START;
    if fits {
        return Ok(());
    }
    let field = if turn > JOINT_AT_THE_START { "attitudes" } else { "positions" };
    Err(format!(
        "{field}: at t = {start} s the prescribed motion is {place:.3e} m and {turn:.3e} rad from \
         the start of {}; allowed: {JOINT_AT_THE_START:.0e} of each",
        body.name
    ))
}
