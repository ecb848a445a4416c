//! Panels of the motion sheet for films with joints: those of one body and of its joints.

use super::motion;
use super::panel::{AxisTitle, NEGLIGIBLE, Panel, PanelMaker, PlotSeries};
use super::scale::ScaleKind;
use crate::film::{Film, FilmBody, FilmFrame, FilmJoint, FilmTie};
use crate::forces::Scale;

/// Panels from top to bottom.
pub const PANELS: [PanelMaker; 10] = {
    let [x, y, z, speed, force, contacts] = motion::PANELS;
    [x, y, z, speed, angles, places, torques, forces, force, contacts]
};

fn angles(film: &Film, body: usize) -> Panel {
    let said = (("θ", ""), "rad", "angle of the hinges of the body");
    let nothing = "no hinge on this body, or none that turns";
    let of = |joint: &FilmJoint| joint.turns;
    let named = Panel { least_range: NEGLIGIBLE, ..named("angle", nothing, said) };
    panel(film, body, of, |tie| tie.angle, &film.frames, named)
}

fn places(film: &Film, body: usize) -> Panel {
    let said = (("l", ""), "m", "position along the slides of the body");
    let nothing = "no slide on this body, or none that moves";
    let of = |joint: &FilmJoint| joint.slides;
    let least_range = NEGLIGIBLE * largest_reach(film);
    let named = Panel { least_range, ..named("slide", nothing, said) };
    panel(film, body, of, |tie| tie.place, &film.frames, named)
}

fn torques(film: &Film, body: usize) -> Panel {
    let said = (
        ("M", ""),
        "N m",
        "torque of motors, friction, springs and stops about the hinges of the body",
    );
    let nothing = "no hinge on this body, or nothing that drives one";
    let of = |joint: &FilmJoint| joint.turns;
    let least_range = NEGLIGIBLE * Scale::of(film).weight * largest_reach(film);
    let named = Panel { least_range, ..named("torque", nothing, said) };
    panel(film, body, of, |tie| tie.torque, film.steps(), named)
}

fn forces(film: &Film, body: usize) -> Panel {
    let said = (("|F|", "joint"), "N", "force of the joints of the body");
    let nothing = "no joint on this body, or none that carries a load";
    let force = |tie: &FilmTie| tie.force;
    let least_range = NEGLIGIBLE * Scale::of(film).weight;
    let named = Panel { least_range, ..named("reaction", nothing, said) };
    panel(film, body, |_| true, force, film.steps(), named)
}

fn largest_reach(film: &Film) -> f64 {
    film.bodies.iter().map(FilmBody::reach).fold(0.0, f64::max)
}

/// Panel with a curve of a quantity for each joint of a body that satisfies `takes`.
fn panel(
    film: &Film,
    body: usize,
    takes: fn(&FilmJoint) -> bool,
    quantity: fn(&FilmTie) -> f64,
    frames: &[FilmFrame],
    named: Panel,
) -> Panel {
    let joints = film.joints.iter().enumerate();
    let own = joints.filter(|(_, joint)| joint.is_of(body) && takes(joint));
    let value =
        |joint: usize| move |frame: &FilmFrame| frame.ties.get(joint).map_or(f64::NAN, quantity);
    let series = own.enumerate().map(|(colour, (index, joint))| {
        PlotSeries::new(joint.name.clone(), colour, frames.iter().map(value(index)))
    });
    Panel { kind: ScaleKind::Linear, height: 110.0, series: series.collect(), ..named }
}

/// Panel without curves: identifier, message for missing data, and axis title.
fn named(id: &'static str, nothing: &'static str, (symbol, unit, words): AxisTitle) -> Panel {
    Panel { id, symbol, unit, words, nothing: Some(nothing), ..Panel::default() }
}
