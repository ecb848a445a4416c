//! Tables `[[driven]]` and `[[surfaces]]`: bodies with prescribed motions, and surfaces that
//! move or have an axis of friction.

use super::entries::{AttitudeEntry, BodyEntry};
use super::joints::{JointSide, anchor_in_range};
use crate::bodies::place::Place;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use tumble_core::error::Error;
use tumble_core::joint::{Joint, Knots};
use tumble_core::simulation::JOINT_AT_THE_START;
use tumble_model::fields::{Exactly, Numbers};

#[derive(Debug, Clone, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(
    deny_unknown_fields,
    expecting = "a table [[driven]], body = \"…\" with times and positions, or velocity and spin"
)]
pub struct DrivenEntry {
    /// Name of the joint that drives the body.
    name: Option<String>,
    /// Name of the body.
    body: String,
    /// Times of the knots (s).
    times: Option<Vec<f64>>,
    /// Position at each time (m), world frame.
    positions: Option<Vec<Numbers<3>>>,
    /// Attitude at each time.
    attitudes: Option<Vec<AttitudeEntry>>,
    /// Velocity after the last time (m/s), world frame.
    velocity: Option<Numbers<3>>,
    /// Angular velocity after the last time (rad/s), world frame.
    spin: Option<Numbers<3>>,
    /// Centre of the rotation (m), world frame.
    about: Option<Numbers<3>>,
    /// Frames in the body, from its centre of mass, and in the world, as a run has them.
    frames: Option<Exactly<Place, 2>>,
    /// Prescribed motion of the frame in the world, as a run has it.
    course: Option<CourseModel>,
}

#[derive(Debug, Clone, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(
    deny_unknown_fields,
    expecting = "{ of = \"…\", velocity = [x, y, z] }, { of = \"…\", spin = [x, y, z] } or { of = \"…\", axis = [x, y, z], factor = … }"
)]
pub struct SurfaceEntry {
    /// Name of a body or a fixed object, or `ground`.
    pub of: String,
    /// Velocity of the surface (m/s): body frame for a body, world frame for a fixed object.
    pub velocity: Option<Numbers<3>>,
    /// Angular velocity of the surface about its centre (rad/s), in the same frame.
    pub spin: Option<Numbers<3>>,
    /// Centre of the spin (m), in the same frame.
    pub centre: Option<Numbers<3>>,
    /// Axis of friction, in the same frame or in that of `axis_of`.
    pub axis: Option<Numbers<3>>,
    /// Name of a body, connected by joints, in whose frame the axis is fixed.
    pub axis_of: Option<String>,
    /// Friction along the axis, over that across it.
    pub factor: Option<f64>,
}

/// Prescribed motion of a frame in the world: piecewise linear, then with constant velocity.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct CourseModel {
    /// Times of the knots (s).
    pub times: Vec<f64>,
    /// Place at each time.
    pub places: Vec<Place>,
    /// Velocity after the last time (m/s).
    #[serde(default)]
    pub velocity: [f64; 3],
    /// Angular velocity after the last time (rad/s), world frame.
    #[serde(default)]
    pub spin: [f64; 3],
}

impl CourseModel {
    /// Prescribed motion in the form of the core.
    ///
    /// # Errors
    /// Invalid knots or velocities; the sentence begins with the name of the field.
    pub fn knots(&self) -> Result<Knots, String> {
        if self.times.len() != self.places.len() {
            let (times, places) = (self.times.len(), self.places.len());
            return Err(format!(
                "times: {times} times and {places} places; as many of both are needed"
            ));
        }
        let frames = self.places.iter().map(Place::frame);
        let knots = Knots::new(self.times.iter().copied().zip(frames).collect());
        let knots = knots.map_err(|error| format!("times: {error}"))?;
        let steady = knots.going_on(self.velocity.into(), self.spin.into());
        steady.map_err(|error| match error {
            Error::OutOfRange { field, .. } if field.starts_with("spin") => {
                format!("spin: {error}")
            }
            other => format!("velocity: {other}"),
        })
    }
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

    /// Name of the driven body.
    pub fn body(&self) -> &str {
        &self.body
    }

    /// Exact form of this entry for a `body`, which it drives from the time `start` (s).
    pub fn exact(&self, body: &BodyEntry, start: f64) -> Result<Self, String> {
        let name = self.name.clone().unwrap_or_else(|| format!("{}-drive", body.name()));
        let exact = |frames: [Place; 2], course| Self {
            name: Some(name),
            body: body.name().to_owned(),
            times: None,
            positions: None,
            attitudes: None,
            velocity: None,
            spin: None,
            about: None,
            frames: Some(Exactly(frames)),
            course: Some(course),
        };
        if let (Some(frames), Some(course)) = (&self.frames, &self.course) {
            return Ok(exact(frames.0, course.clone()));
        }
        self.refuse_idle()?;
        let side = JointSide::new(Some(body));
        let (origin, attitude) = (Vector3::zeros(), Place::ORIGIN.attitude.into());
        let mut anchor = side.placed(&origin, &attitude);
        if let Some(about) = &self.about {
            anchor_in_range("about", Some(about))?;
            anchor.anchor = about.0.into();
        }
        let (there, own) = (JointSide::new(None).to_local(&anchor), side.to_local(&anchor));
        let course = self.course(&there, start)?;
        refuse_elsewhere(&own, &course, body, start)?;
        Ok(exact([own, there], course))
    }

    /// Prescribed motion of an entry in exact form.
    ///
    /// # Errors
    /// Invalid knots or velocities; the sentence begins with the name of the field.
    pub fn knots(&self) -> Result<Knots, String> {
        let course = self.course.as_ref().ok_or_else(|| "course: it is needed".to_owned())?;
        course.knots()
    }

    /// Moves the frame in the world.
    pub fn set_frame(&mut self, place: Place) {
        if let Some(frames) = &mut self.frames {
            frames.0[1] = place;
        }
    }

    /// Joint of an entry in exact form. `body` finds its body.
    pub fn joint(&self, body: impl Fn(&str) -> Result<usize, String>) -> Result<Joint, String> {
        let frames = self.frames.ok_or_else(|| "frames: they are needed".to_owned())?;
        Ok(Joint::fixed(body(&self.body)?, None, frames.0.each_ref().map(Place::frame)))
    }

    /// Prescribed motion of a frame that is at `there` at the time `start` (s).
    fn course(&self, there: &Place, start: f64) -> Result<CourseModel, String> {
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

/// Checks that the body starts where its prescribed motion begins. `own` is the frame in the body.
fn refuse_elsewhere(
    own: &Place,
    course: &CourseModel,
    body: &BodyEntry,
    start: f64,
) -> Result<(), String> {
    let knots = course.knots()?;
    let there = Joint::fixed(0, None, [own.frame(), knots.at(start)]);
    let (place, turn) = there.error(&[body.start()]).unwrap_or((f64::NAN, f64::NAN));
    // Written so that a NaN is rejected.
    let fits = place.max(turn) <= JOINT_AT_THE_START;
    if fits {
        return Ok(());
    }
    let field = if turn > JOINT_AT_THE_START { "attitudes" } else { "positions" };
    Err(format!(
        "{field}: at t = {start} s the prescribed motion is {place:.3e} m and {turn:.3e} rad from \
         the start of {}; allowed: {JOINT_AT_THE_START:.0e} of each",
        body.name()
    ))
}
