//! Panels of the motion sheet for films with joints: those of one body and of its joints.

use super::motion;
use super::panel::{AxisTitle, NEGLIGIBLE, Panel, PanelMaker, PlotSeries};
use super::scale::ScaleKind;
use crate::film::{Film, Object, slides_and_turns};
use crate::forces::Scale;
use tumble_core::joint::Joint;
use tumble_scene::output::tables::{IntervalRows, JointRow};

/// Panels from top to bottom.
pub const PANELS: [PanelMaker; 10] = {
    let [x, y, z, speed, force, contacts] = motion::PANELS;
    [x, y, z, speed, angles, places, torques, forces, force, contacts]
};

fn angles(film: &Film, body: usize) -> Panel {
    let title = (("θ", ""), "rad", "angle of the hinges of the body");
    let nothing = "no hinge on this body, or none that turns";
    let of = |joint: &Joint| slides_and_turns(joint)[1];
    let named = Panel { least_range: NEGLIGIBLE, ..named("angle", nothing, title) };
    panel(film, body, of, |row| row.turns.z, &film.frames, named)
}

fn places(film: &Film, body: usize) -> Panel {
    let title = (("l", ""), "m", "position along the slides of the body");
    let nothing = "no slide on this body, or none that moves";
    let of = |joint: &Joint| slides_and_turns(joint)[0];
    let least_range = NEGLIGIBLE * largest_reach(film);
    let named = Panel { least_range, ..named("slide", nothing, title) };
    panel(film, body, of, |row| row.place.z, &film.frames, named)
}

fn torques(film: &Film, body: usize) -> Panel {
    let title = (
        ("M", ""),
        "N m",
        "torque of motors, friction, springs and stops about the hinges of the body",
    );
    let nothing = "no hinge on this body, or nothing that drives one";
    let of = |joint: &Joint| slides_and_turns(joint)[1];
    let least_range = NEGLIGIBLE * Scale::from_film(film).weight * largest_reach(film);
    let named = Panel { least_range, ..named("torque", nothing, title) };
    panel(film, body, of, |row| row.torque.z, film.steps(), named)
}

fn forces(film: &Film, body: usize) -> Panel {
    let title = (("|F|", "joint"), "N", "force of the joints of the body");
    let nothing = "no joint on this body, or none that carries a load";
    let force = |row: &JointRow| row.force.norm();
    let least_range = NEGLIGIBLE * Scale::from_film(film).weight;
    let named = Panel { least_range, ..named("reaction", nothing, title) };
    panel(film, body, |_| true, force, film.steps(), named)
}

fn largest_reach(film: &Film) -> f64 {
    film.bodies.iter().map(Object::reach).fold(0.0, f64::max)
}

/// Panel with a curve of a quantity for each joint of a body that satisfies `takes`.
fn panel(
    film: &Film,
    body: usize,
    takes: fn(&Joint) -> bool,
    quantity: fn(&JointRow) -> f64,
    frames: &[IntervalRows],
    named: Panel,
) -> Panel {
    let joints = film.world.joints().iter().zip(&film.joints).enumerate();
    let own = joints.filter(|(_, (joint, _))| joint.ties(body) && takes(joint));
    let value = |joint: usize| {
        move |frame: &IntervalRows| frame.joints.get(joint).map_or(f64::NAN, quantity)
    };
    let series = own.enumerate().map(|(colour, (index, (_, name)))| {
        PlotSeries::new(name.clone(), colour, frames.iter().map(value(index)))
    });
    Panel { kind: ScaleKind::Linear, height: 110.0, series: series.collect(), ..named }
}

/// Panel without curves: identifier, message for missing data, and axis title.
fn named(id: &'static str, nothing: &'static str, (symbol, unit, words): AxisTitle) -> Panel {
    Panel { id, symbol, unit, words, nothing: Some(nothing), ..Panel::default() }
}
