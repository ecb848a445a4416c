//! The same slide in every direction of the compass.

use super::prelude::*;
use super::stopping::Slide;
use std::f64::consts::TAU;

/// Directions: north, north-northeast, …
const DIRECTIONS: usize = 16;

/// Slides in sixteen directions.
pub static COMPASS: Posed = Posed {
    name: "compass",
    about: "A box slides in sixteen directions: each slide is straight and equally long, v²/(2 μ \
            g), as no pyramid of friction would have it.",
    time_step: 0.002,
    inputs: &[(Input::Mass, 2.0), (Input::Friction, 0.3), EARTH, (Input::Speed, 1.0)],
    ..Posed::by(compass)
};

/// Coulomb's cone is round: the slide is that of [`Slide`] whatever its direction, and the
/// box does not turn, because friction, opposite to the slide and in proportion to the
/// normal forces, has its resultant through the line of the slide.
///
/// A speed across the slide is the same kinetic energy as a spin of √(m/I) times it, with
/// I = m (a² + b²)/3.
fn compass(inputs: &Inputs, laboratory: &mut Laboratory<'_>) -> Solved {
    let half_sides = Vector3::new(0.2, 0.15, 0.1);
    let east = Slide::along_x(half_sides, inputs)?;
    let speed = east.velocity.norm();
    let (mut shortest, mut longest) = (f64::INFINITY, 0.0_f64);
    let (mut sideways, mut turned) = (0.0_f64, 0.0_f64);
    let (mut way_slack, mut across_slack) = (0.0_f64, 0.0_f64);
    let mut curve = Curve::default();
    for k in 0..DIRECTIONS {
        let (sin, cos) = (TAU * k as f64 / DIRECTIONS as f64).sin_cos();
        let direction = Vector3::new(cos, sin, 0.0);
        let slide = Slide { velocity: speed * direction, ..east };
        let run = slide.run(laboratory)?;
        let start = resting(half_sides[2]);
        let way = run.end(0).position - start.position;
        let along = way.dot(&direction);
        (shortest, longest) = (shortest.min(along), longest.max(along));
        sideways = sideways.max((way - along * direction).norm());
        // The vector part of a small rotation's quaternion is half its angle.
        turned = turned.max(2.0 * run.end(0).attitude.fixed_rows::<3>(1).norm());
        let slack = slide.slack(&run);
        way_slack = way_slack.max(slack.way());
        across_slack = across_slack.max(slack.across);
        if k == 1 {
            curve = run
                .curve(("way north-northeast by east", "m"), 0, |state| {
                    (state.position - start.position).dot(&direction)
                })
                .beside(|t| slide.way(t));
        }
    }
    let spread = longest - shortest;
    let gyration = (half_sides[0].hypot(half_sides[1])) / 3.0_f64.sqrt();
    let distance = east.distance(longest, laboratory.time_step(), way_slack);
    let quantities = vec![
        Quantity { name: "longest slide", ..distance },
        at_most_zero(("longest less shortest", "m"), spread, 2.0 * way_slack),
        at_most_zero(("way sideways", "m"), sideways, across_slack),
        at_most_zero(("angle turned", "rad"), turned, across_slack / gyration),
    ];
    Ok(Findings { quantities, curve })
}
