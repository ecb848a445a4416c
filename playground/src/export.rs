//! Text of a session, with the pulls as loads.

use crate::pull::Segment;
use crate::scenes;
use crate::session::Session;
use nalgebra::Vector3;
use tumble_core::error::Error;
use tumble_core::mechanics::load::Polyline;
use tumble_core::mechanics::{Load, Wrench};
use tumble_model::failure::Failure;

/// Scenario text that repeats the session from its start: the command line gives the same bits.
///
/// # Errors
/// A scene that no text can hold.
pub fn text(session: &Session) -> Result<String, Failure> {
    if session.pulls().segments().is_empty() {
        return Ok(session.text().to_owned());
    }
    with_pulls(session, session.scene().rows)
}

/// Text of [`text`] with the number of rows that were simulated.
///
/// # Errors
/// A scene that no text can hold.
pub fn whole(session: &Session) -> Result<String, Failure> {
    with_pulls(session, session.rows())
}

/// Text of the page with this number of rows and the pulls as loads of the bodies.
fn with_pulls(session: &Session, rows: u64) -> Result<String, Failure> {
    let mut scene = session.scene().clone();
    scene.rows = rows;
    let (now, h) = (session.simulation().index(), scene.world.time_step());
    let mut loads = scene.loads.clone();
    for (body, segments) in session.pulls().segments() {
        if let Some(load) = load(segments, now, h)? {
            loads[*body] = load;
        }
    }
    scene.document.set_loads(&loads);
    scenes::text(&scene)
}

/// Load of pulls until step `now` of length `h` (s); `None` without a force.
fn load(segments: &[Segment], now: u64, h: f64) -> Result<Option<Load>, Error> {
    let (mut force, mut torque) = (Vec::new(), Vec::new());
    let mut before = Wrench::zero();
    let end = Segment { from: now, wrench: Wrench::zero() };
    // The force is constant between two knots and jumps at their times.
    for segment in segments.iter().filter(|segment| segment.from < now).chain([&end]) {
        if segment.wrench == before {
            continue;
        }
        let time = segment.from as f64 * h;
        for wrench in [&before, &segment.wrench] {
            force.push((time, wrench.force));
            torque.push((time, wrench.torque));
        }
        before = segment.wrench;
    }
    if force.is_empty() {
        return Ok(None);
    }
    Load::new(Polyline::new(force)?, Polyline::new(torque)?, Vector3::zeros()).map(Some)
}
