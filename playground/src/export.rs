//! Text of a session, with the pulls as loads.

use crate::pull::Segment;
use crate::scenes;
use crate::session::Session;
use std::fmt::Write as _;
use tumble_core::mechanics::Wrench;

/// Scenario text that repeats the session from its start: the command line gives the same bits.
pub fn text(session: &Session) -> String {
    let scene = session.scene();
    let pulled = session.pulls().segments();
    if !pulled.is_empty() {
        let (now, h) = (session.simulation().index(), scene.world.time_step());
        return with_loads(session.text(), |body| {
            pulled.get(&body).and_then(|segments| load(segments, now, h))
        });
    }
    session.text().to_owned()
}

/// Text of [`text`] with the number of rows that were simulated.
///
/// # Errors
/// A text in which the number of rows cannot be set.
pub fn whole(session: &Session) -> Result<String, String> {
    let (text, rows) = (text(session), session.rows());
    let mut top = text.lines().take_while(|line| !line.trim_start().starts_with('['));
    let is_steps = |line: &&str| line.split('=').next().is_some_and(|name| name.trim() == "steps");
    let steps = format!("steps = {rows}");
    let whole = match top.find(is_steps) {
        Some(line) => text.replacen(line, &steps, 1),
        None => format!("{steps}\n{text}"),
    };
    match scenes::read(&whole) {
        Ok(scene) if scene.rows == rows => Ok(whole),
        _ => {
            Err(format!("The text of the scene cannot hold {rows} rows; end the run to write it."))
        }
    }
}

/// Text of the page with a load in the table of some bodies. Their first field is the name.
fn with_loads(text: &str, load: impl Fn(usize) -> Option<String>) -> String {
    let (mut out, mut bodies, mut begins) = (String::new(), 0, false);
    for line in text.lines() {
        out.push_str(line);
        out.push('\n');
        if begins {
            if let Some(load) = load(bodies) {
                let _ = writeln!(out, "load = {load}");
            }
            bodies += 1;
        }
        begins = line == "[[bodies]]";
    }
    out
}

/// Load of pulls until step `now` of length `h` (s), as an inline table; `None` without a force.
fn load(segments: &[Segment], now: u64, h: f64) -> Option<String> {
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
            let knot =
                |v: &nalgebra::Vector3<f64>| format!("[{time:?}, {}, {}, {}]", v[0], v[1], v[2]);
            force.push(knot(&wrench.force));
            torque.push(knot(&wrench.torque));
        }
        before = segment.wrench;
    }
    let table =
        || format!("{{ force = [{}], torque = [{}] }}", force.join(", "), torque.join(", "));
    (!force.is_empty()).then(table)
}
