//! A chain of links that flies and writhes: its momenta stay.

use super::pendulum::TOO_EXACT;
use super::prelude::*;
use crate::joint::{Drive, Joint, JointFrame};
use crate::mechanics::Rotation;
use crate::mechanics::quaternion::rotation;

/// Links, their half sides (m), and how long they are watched, s.
const LINKS: usize = 5;
const HALF_SIDES: Vector3<f64> = Vector3::new(0.15, 0.04, 0.02);
const DURATION: f64 = 0.5;
/// Nothing comes near the ground, m.
const HEIGHT: f64 = 4.0;

/// Links with hinges.
pub static FREE_CHAIN: Posed = Posed {
    name: "free-chain",
    about: "Five links with hinges turn in empty space, with friction and springs between them: \
            the linear and the angular momentum of all stay.",
    time_step: 0.002,
    inputs: &[(Input::Mass, 1.0), (Input::Speed, 3.0)],
    bodies: LINKS,
    beyond_ipopt: TOO_EXACT,
    unit_of_speed: "rad/s",
    ..Posed::by(free_chain)
};

/// Forces of a joint on its two bodies are opposite and at one point of the world, so that Σ m v and
/// Σ r × m v + A P⁻(ω) (eq. 34) stay; the step's do so to the last digit, as two bodies' that touch.
fn free_chain(inputs: &Inputs, laboratory: &mut Laboratory<'_>) -> Solved {
    let [mass, speed] = inputs.all([Input::Mass, Input::Speed])?;
    let h = laboratory.time_step();
    Unsuitable::when(speed * h > 0.1, || format!("speed {speed} rad/s turns it too far a step"))?;
    let middle = Vector3::new(0.0, 0.0, HEIGHT);
    let spin = speed * Vector3::new(0.3, 0.8, -0.5);
    let bodies = (0..LINKS).map(|link| {
        let arm = Vector3::x() * (2.0 * HALF_SIDES[0] * (link as f64 - 1.5));
        let velocity = spin.cross(&arm);
        let start = State { position: middle + arm, velocity, spin, ..resting(HEIGHT) };
        Subject::solid_box(mass * (1.0 + 0.3 * link as f64), HALF_SIDES, start)
    });
    let bodies = bodies.collect::<Result<Vec<_>, _>>()?;
    let hinge = |side: f64| {
        JointFrame::along(Vector3::x() * (side * HALF_SIDES[0]), Vector3::new(0.3, 1.0, 0.2))
    };
    let square = mass * speed * speed;
    let drive = Drive {
        friction: 1e-3 * square,
        stiffness: 0.05 * square,
        damping: 1e-3 * mass * speed,
        ..Drive::NONE
    };
    let joints = (1..LINKS)
        .map(|link| Ok(Joint::revolute(link, Some(link - 1), [hinge(-1.0)?, hinge(1.0)?], drive)));
    let joints = joints.collect::<Result<Vec<_>, crate::error::Error>>()?;
    let own = bodies.clone();
    let setup = Setup { joints, ..Setup::new(bodies, 0.0, 0.5, DURATION) };
    let run = laboratory.run(&setup)?;
    let momenta = |k: usize| {
        let (mut linear, mut angular) = (Vector3::zeros(), Vector3::zeros());
        for (index, Subject { body, .. }) in own.iter().enumerate() {
            let state = &run.states(index)[k];
            let p = body.mass() * state.velocity;
            let spinning = Rotation::Momentum.momentum(body.inertia(), &state.spin, h);
            linear += p;
            angular += (state.position - middle).cross(&p) + rotation(&state.attitude) * spinning;
        }
        (linear, angular)
    };
    let (p, l) = momenta(0);
    let (mut strayed, mut turned) = (0.0_f64, 0.0_f64);
    for k in 1..=run.steps() {
        let (linear, angular) = momenta(k);
        strayed = strayed.max((linear - p).norm());
        turned = turned.max((angular - l).norm());
    }
    let total = mass * (LINKS as f64 + 3.0);
    let lacked = run.sum(|residual| residual.momentum) + 4.0 * run.flight_rounding();
    let astray = run.sum(|residual| residual.kinematics) * h;
    let arm = run.all_states().map(|state| (state.position - middle).norm()).fold(1.0, f64::max);
    let rounding = 4.0 * run.rounding(HEIGHT) * speed;
    Ok(Findings {
        quantities: vec![
            at_most_zero(("change of the momentum", "kg m/s"), strayed, total * lacked),
            at_most_zero(
                ("change of the angular momentum", "kg m²/s"),
                turned,
                total * (3.0 * arm * lacked + speed * astray + rounding),
            ),
        ],
        curve: Curve::of(("angular momentum", "kg m²/s"), &run, |k| momenta(k).1.norm())
            .beside(|_| l.norm()),
    })
}
