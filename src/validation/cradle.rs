//! Balls in a row that lose nothing: Newton's cradle, and what simultaneous impacts are like.

use super::collision::{afloat, drift, speed_slack};
use super::prelude::*;

/// m.
const RADIUS: f64 = 0.05;
/// The first ball's way, m.
const RUN_UP: f64 = 0.1;
/// Between the others where they are apart, m.
const GAP: f64 = 0.08;

/// Three balls in a row, apart and in touch.
pub static CRADLE: Posed = Posed {
    name: "cradle",
    about: "A ball meets two others, elastically: apart, the last one takes all its speed; in \
            touch, all three meet at once, and Newton's law gives −1/3, 2/3, 2/3.",
    time_step: 0.002,
    inputs: &[(Input::Mass, 0.2), (Input::Friction, 0.3), (Input::Speed, 2.0)],
    bodies: 3,
    beyond_ipopt: Some("speeds after a bounce are off by more than its residuals say"),
    ..Posed::by(cradle)
};

/// Apart, the impacts are two of two balls, which exchange their speeds: 0, 0, v. In touch the
/// law holds for both contacts at once, the first with u⁻ = −v, the second with u⁻ = 0:
///
/// ```text
/// v₂ − v₁ = v,   v₃ − v₂ = 0,   v₁ + v₂ + v₃ = v   ⇒   −v/3, 2v/3, 2v/3
/// ```
///
/// The step's answer is the same where the gap is longer than a step's way. Energy is kept in
/// both: a simultaneous impact is a choice of the law, not of energy and momentum.
fn cradle(inputs: &Inputs, laboratory: &mut Laboratory<'_>) -> Solved {
    let [mass, speed, friction] = inputs.all([Input::Mass, Input::Speed, Input::Friction])?;
    let h = laboratory.time_step();
    Unsuitable::when(h * speed > 0.25 * GAP, || {
        format!(
            "a step's way is {:.3} m; at most a quarter of the gap of {GAP} m is needed",
            h * speed
        )
    })?;
    let duration = 2.0 * (RUN_UP + GAP) / speed + 8.0 * h;
    let mut run = |gap: f64| {
        let places = [0.0, RUN_UP + 2.0 * RADIUS, RUN_UP + 4.0 * RADIUS + gap];
        let mut bodies = Subject::balls(mass, RADIUS, places.map(afloat))?;
        bodies[0].start.velocity[0] = speed;
        let setup = Setup::new(bodies, 0.0, friction, duration);
        laboratory.run(&Setup { restitution: 1.0, ..setup })
    };
    let (apart, touching) = (run(GAP)?, run(0.0)?);
    let mut quantities = Vec::new();
    let expected = [
        (&apart, "apart: speed of the first ball", 0, 0.0),
        (&apart, "apart: speed of the last ball", 2, 1.0),
        (&touching, "in touch: speed of the first ball", 0, -1.0 / 3.0),
        (&touching, "in touch: speed of the last ball", 2, 2.0 / 3.0),
    ];
    for (run, name, ball, share) in expected {
        let (found, slack) = (run.end(ball).velocity[0], speed_slack(run, 3.0));
        quantities.push(exactly((name, "m/s"), found, share * speed, slack));
    }
    let pairs = [
        (&apart, "apart: energy", "apart: momentum"),
        (&touching, "in touch: energy", "in touch: momentum"),
    ];
    for (run, energy, momentum) in pairs {
        let speeds = [0, 1, 2].map(|ball| run.end(ball).velocity[0]);
        let slack = 3.0 * mass * speed_slack(run, 3.0);
        let kinetic = 0.5 * mass * speeds.iter().map(|v| v * v).sum::<f64>();
        let exact = 0.5 * mass * speed * speed;
        quantities.push(exactly((energy, "J"), kinetic, exact, speed * slack));
        let total = mass * speeds.iter().sum::<f64>();
        let slack = 3.0 * mass * drift(run);
        quantities.push(exactly((momentum, "kg m/s"), total, mass * speed, slack));
    }
    let meets = (RUN_UP + GAP) / speed;
    let curve = apart
        .curve(("apart: speed of the last ball", "m/s"), 2, |state| state.velocity[0])
        .beside(|t| if t < meets { 0.0 } else { speed });
    Ok(Findings { quantities, curve })
}
