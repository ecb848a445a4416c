//! A domino that falls on the next one.

use super::rocking::TallBox;
use crate::edge::{Planar, turned};
use crate::prelude::*;

const GAP: f64 = 0.3; // Between the faces, m
const PUSH: f64 = 1.2; // The first spin, in the one that just topples the domino
/// The second domino is wider by this, so that the edge meets its face, m.
const WIDER: f64 = 0.05;
const AFTER: usize = 3; // Steps after the collision that are compared
const POINTS: usize = 2000; // Points of the integral of the time

/// Time at which the dominoes meet and the spin then, extrapolated from the last two states. Then
/// both spins [`AFTER`] steps later.
type Fall = [f64; 4];

/// Builds a fall from the last two gaps and spins without contact. The later ones belong to step
/// `meet`.
fn fall(h: f64, gaps: [f64; 2], spins: [f64; 2], meet: usize, after: [f64; 2]) -> Fall {
    let part = gaps[1] / (gaps[0] - gaps[1]);
    let spin = spins[1] + part * (spins[1] - spins[0]);
    [h * (meet as f64 + part), spin, after[0], after[1]]
}

/// The scheme's fall from `spin` with steps of `h`; `None` if it does not reach the `second` domino.
fn discrete(domino: &TallBox, h: f64, spin: f64, duration: f64, second: &Planar) -> Option<Fall> {
    let edges = domino.edges(h);
    // Turned about the front edge, which is at rest.
    let at = |state: &Planar| {
        let foot = edges.corner(1.0);
        let position = Vector2::new(foot.x, 0.0) - turned(state.tilt, foot);
        Planar { position, velocity: Vector2::zeros(), ..*state }
    };
    let apart = |state: &Planar| edges.apart(&[at(state), *second]);
    let free = domino.discrete(h, spin, duration, |state| apart(state) < 0.0);
    let meet = free.len().checked_sub(2).filter(|&meet| meet > 0 && apart(last(&free)) < 0.0)?;
    let states = [free[meet - 1], free[meet]];
    let mut two = [at(&states[1]), *second];
    // The velocity belongs to the previous step.
    two[0].velocity = (two[0].position - at(&states[0]).position) / h;
    for _ in 0..AFTER {
        two = edges.step_pair(&two);
    }
    let (gaps, spins) = (states.map(|state| apart(&state)), states.map(|state| state.spin));
    Some(fall(h, gaps, spins, meet, two.map(|domino| domino.spin)))
}

/// A domino is pushed over and falls on the next one: its energy says when and how fast, and as
/// nothing rubs between them, both go on with half of its spin.
pub(crate) const DOMINOES: TestProblem = TestProblem {
    name: "dominoes",
    time_step: 0.001,
    inputs: &[(Mass, 3.0), EARTH],
    bodies: 2,
    ..TestProblem::solved_by(dominoes)
};

/// ∫ dφ/ω(φ) until 2c sin φ = s, and then ω₁⁺ = ω₂⁺ = ½ ω, with
///
/// ```text
/// ω² = ω₀² − 2 (m g/I) (R cos(α − φ) − c)
/// ```
fn dominoes(inputs: &TestInputs, runner: &mut Runner<'_>) -> SolvedBy {
    let domino = TallBox::new(inputs)?;
    let (h, c, growth) = (runner.time_step, domino.half_sides[2], domino.growth_time());
    let fine = growth / h;
    let why = format!(
        "a domino falls over in about {growth:.3} s, too few steps of {h} s; use a smaller time \
         step"
    );
    Refusal::when(fine < 10.0, why)?;
    let spin = PUSH * domino.critical_spin();
    let wide = domino.half_sides + v3(0.0, WIDER, 0.0);
    let standing = at_rest(v3(2.0 * domino.half_sides[0] + GAP, 0.0, c));
    let mut setup = domino.setup(domino.pushed(spin), 5.0 * growth)?;
    setup.bodies.push(Subject::solid_box(domino.mass, wide, standing)?);
    setup.frictions = vec![(1, Partner::Body(0), 0.0)];
    let mut touched = 0;
    let run = runner.run_until(&setup, |step| {
        let meets = step.between(0, Partner::Body(1)).any(|contact| contact.carries_force());
        touched += usize::from(meets || touched > 0);
        touched == AFTER
    })?;

    let edges = domino.edges(h);
    let second = Planar::from_state(&run.states(1)[0]);
    let fallen = |spin: f64| discrete(&domino, h, spin, setup.duration, &second);
    let missing = || Refusal::Motion("the domino does not reach the next one".to_owned());
    let expected = fallen(spin).ok_or_else(missing)?;
    let meet = run.steps().checked_sub(AFTER).filter(|&meet| meet > 0).ok_or_else(missing)?;
    let states = [meet - 1, meet].map(|k| Planar::from_state(&run.states(0)[k]));
    let gaps = states.map(|state| edges.apart(&[state, second]));
    let after = [0, 1].map(|index| run.end(index).spin[1]);
    let found = fall(h, gaps, states.map(|state| state.spin), meet, after);

    let (alpha, radius) = (domino.balance(), domino.radius());
    let pull = domino.mass * domino.gravity / domino.inertia();
    let speed = |tilt: f64| {
        let rise = radius * (alpha - tilt).cos() - c;
        (spin * spin - 2.0 * pull * rise).sqrt()
    };
    let contact = (0.5 * GAP / c).asin();
    let width = contact / POINTS as f64;
    // Simpson's rule, exact to rounding for so smooth a function.
    let slice = |k: usize| {
        let from = k as f64 * width;
        let [a, b, c] = [0.0, 0.5, 1.0].map(|part| 1.0 / speed(from + part * width));
        width / 6.0 * (a + 4.0 * b + c)
    };
    let time: f64 = (0..POINTS).map(slice).sum();
    let spin_then = speed(contact);

    let change = domino.spin_tolerance(&run, spin);
    let or_nan = |spin: f64| fallen(spin).unwrap_or([f64::NAN; 4]);
    let effect = TallBox::effect(spin, change, &expected, or_nan).map(|off| 2.0 * off);
    // Two in contact stay so within h δ_n, and separate with 2 δ_n.
    let parting = 8.0 * run.largest(|r| r.normal + r.kinematics) / c;
    let bound = h * (pull * radius + spin_then * spin_then);
    let halved = |name: &'static str, i: usize| {
        equal((name, "rad/s"), found[i], 0.5 * spin_then, effect[i] + parting)
            .stepped(expected[i], within(bound, fine))
    };
    Ok(vec![
        equal(("time until they meet", "s"), found[0], time, effect[0])
            .stepped(expected[0], order(1, fine)),
        equal(("spin then", "rad/s"), found[1], spin_then, effect[1])
            .stepped(expected[1], order(1, fine)),
        halved("spin of the first after it", 2),
        halved("spin of the second after it", 3),
    ])
}
