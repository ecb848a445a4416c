//! A domino that falls on the next one.
//!
//! In the scheme each turns on its front edge as in `edge.rs`, with the torque of the impulse p = P n between
//! them, n the normal of the second's face at the start, and of the rest of the impulse at its foot. The third
//! equation for ω₁⁺, ω₂⁺ and P is that the upper edge of the first ends on the face.

use super::rocking::{TallBox, tilt};
use crate::edge::{Planar, cross, turned};
use crate::prelude::*;
use nalgebra::Matrix3;

const GAP: f64 = 0.3; // s, m
const PUSH: f64 = 1.2; // The first spin, in the one that just topples the domino
/// The second domino is wider by this, so that the edge meets its face, m.
const WIDER: f64 = 0.05;
const AFTER: usize = 3; // Steps after the collision that are compared
const ROUNDS: usize = 40; // Newton iterations, with differences for derivatives
const POINTS: usize = 2000; // Points of the integral of the time

/// Both dominoes.
type Two = [Planar; 2];

struct Pair<'a> {
    domino: &'a TallBox,
    time_step: f64, // h, s
    half_sides: Vector2<f64>,
}

impl Pair<'_> {
    /// The front edge, on which a domino turns.
    fn foot(&self) -> Vector2<f64> {
        Vector2::new(self.half_sides.x, -self.half_sides.y)
    }

    /// The distance of the first one's upper edge from the second one's face, m.
    fn apart(&self, [first, second]: &Two) -> f64 {
        let edge = first.position + turned(first.tilt, self.half_sides) - second.position;
        -turned(-second.tilt, edge).x - self.half_sides.x
    }

    /// `state` turned on its front edge with the spin `spin` at the end of the step.
    fn turned_on(&self, state: &Planar, spin: f64) -> Planar {
        let held = Vector2::new(state.position.x + turned(state.tilt, self.foot()).x, 0.0);
        let tilt = state.tilt + 2.0 * (0.5 * self.time_step * spin).atan();
        let position = held - turned(tilt, self.foot());
        let velocity = (position - state.position) / self.time_step;
        Planar { position, tilt, velocity, spin }
    }

    /// The residuals of the two torques and the gap for (ω₁⁺, ω₂⁺, P).
    fn missed(&self, before: &Two, unknown: &Vector3<f64>) -> Vector3<f64> {
        let after = [0, 1].map(|j| self.turned_on(&before[j], unknown[j]));
        let edge = before[0].position + turned(before[0].tilt, self.half_sides);
        let push = turned(before[1].tilt, Vector2::new(-unknown[2], 0.0));
        let weight = Vector2::new(0.0, self.domino.gravity * self.time_step);
        let torque = |j: usize, push: Vector2<f64>| {
            let (old, new) = (&before[j], &after[j]);
            let held = new.velocity - old.velocity + weight - push;
            let inertia = self.half_sides.norm_squared() / 3.0;
            let [before, after] = [old, new].map(|state| momentum(self.time_step, state.spin).0);
            inertia * (after - before)
                - cross(turned(old.tilt, self.foot()), held)
                - cross(edge - old.position, push)
        };
        v3(torque(0, push), torque(1, -push), self.apart(&after) / self.time_step)
    }

    /// A step that ends with both in contact.
    fn step(&self, before: &Two) -> Two {
        let mut unknown = v3(before[0].spin, before[1].spin, 0.0);
        for _ in 0..ROUNDS {
            let mut slopes = Matrix3::zeros();
            for j in 0..3 {
                let size = 1e-6 * (1.0 + unknown[j].abs());
                let moved = |sign: f64| {
                    let mut moved = unknown;
                    moved[j] += sign * size;
                    self.missed(before, &moved)
                };
                slopes.set_column(j, &((moved(1.0) - moved(-1.0)) / (2.0 * size)));
            }
            let Some(change) = slopes.lu().solve(&self.missed(before, &unknown)) else { break };
            unknown -= change;
        }
        [0, 1].map(|j| self.turned_on(&before[j], unknown[j]))
    }
}

/// The time at which the two would meet and the spin then, on the line through the last two states
/// before; and both spins some steps later.
#[derive(Debug, Clone, Copy)]
struct Fall {
    time: f64,
    spin: f64,
    after: [f64; 2],
}

impl Fall {
    /// The fall with these last two states before the contact, the last one at step `meet`, and the spins
    /// `AFTER` steps later.
    fn of(h: f64, gaps: [f64; 2], spins: [f64; 2], meet: usize, after: [f64; 2]) -> Self {
        let part = gaps[1] / (gaps[0] - gaps[1]);
        let spin = spins[1] + part * (spins[1] - spins[0]);
        Self { time: h * (meet as f64 + part), spin, after }
    }

    /// The scheme's fall from `spin`; `None` if it does not reach the second domino.
    fn discrete(pair: &Pair<'_>, second: Planar, spin: f64, most: usize) -> Option<Self> {
        let (h, domino) = (pair.time_step, pair.domino);
        // Turned about the front edge, which is at rest.
        let at = |(tilt, spin): (f64, f64)| {
            let position = Vector2::new(pair.foot().x, 0.0) - turned(tilt, pair.foot());
            Planar { position, tilt, velocity: Vector2::zeros(), spin }
        };
        let apart = |of: (f64, f64)| pair.apart(&[at(of), second]);
        let free = domino.discrete(spin, (h, most), |tilt, spin| apart((tilt, spin)) < 0.0);
        let beyond = free.len().checked_sub(1).filter(|&last| apart(free[last]) < 0.0)?;
        let meet = beyond.checked_sub(1).filter(|&meet| meet > 0)?;
        let mut two = [at(free[meet]), second];
        // The velocity is that of the step before.
        two[0].velocity = (two[0].position - at(free[meet - 1]).position) / h;
        for _ in 0..AFTER {
            two = pair.step(&two);
        }
        let last = [free[meet - 1], free[meet]];
        let after = two.map(|domino| domino.spin);
        Some(Self::of(h, last.map(apart), last.map(|(_, spin)| spin), meet, after))
    }
}

/// The planar motion of a body.
fn planar(run: &Run, index: usize, k: usize) -> Planar {
    let state = &run.states(index)[k];
    let (position, velocity) = (state.position.xz(), state.velocity.xz());
    Planar { position, tilt: tilt(state), velocity, spin: state.spin[1] }
}

pub(crate) const DOMINOES: Problem = Problem {
    name: "dominoes",
    about: "A domino is pushed over and falls on the next one: its energy says when and how fast, \
            and as nothing rubs between them, both go on with half of its spin.",
    time_step: 0.001,
    inputs: &[(Mass, 3.0), EARTH],
    bodies: 2,
    ..Problem::solved_by(dominoes)
};

/// ∫ dφ/ω(φ) until 2c sin φ = s, and then ω₁⁺ = ω₂⁺ = ½ ω, with
///
/// ```text
/// ω² = ω₀² − 2 (m g/I) (R cos(α − φ) − c)
/// ```
fn dominoes(inputs: &Inputs, runner: &mut Runner<'_>) -> Solved {
    let domino = TallBox::new(inputs)?;
    let (h, c, growth) = (runner.time_step, domino.half_sides[2], domino.growth_time());
    let fine = growth / h;
    let why = format!("a domino falls over in some {growth:.3} s, too few steps of {h} s");
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

    let pair = Pair { domino: &domino, time_step: h, half_sides: domino.half_sides.xz() };
    let second = planar(&run, 1, 0);
    let most = (setup.duration / h).round() as usize;
    let missing = || Refusal::Motion("the domino does not reach the next one".to_owned());
    let expected = Fall::discrete(&pair, second, spin, most).ok_or_else(missing)?;
    let end = run.steps();
    let meet = end.checked_sub(AFTER).filter(|&meet| meet > 0).ok_or_else(missing)?;
    let last = [meet - 1, meet];
    let gaps = last.map(|k| pair.apart(&[planar(&run, 0, k), second]));
    let spins = last.map(|k| run.states(0)[k].spin[1]);
    let found = Fall::of(h, gaps, spins, meet, [run.end(0).spin[1], run.end(1).spin[1]]);

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

    // The effect of a change of the first spin, by the recurrence.
    let change = domino.spin_tolerance(&run, spin);
    let trial = change.max(1e-7 * spin);
    let moved = [-trial, trial].map(|by| Fall::discrete(&pair, second, spin + by, most));
    let effect = |of: fn(&Fall) -> f64| {
        let [less, more] = moved
            .each_ref()
            .map(|fall| fall.as_ref().map_or(f64::NAN, |fall| (of(fall) - of(&expected)).abs()));
        4.0 * change / trial * less.max(more)
    };
    // Two in contact stay so within h δ_n, and separate with 2 δ_n.
    let parting = 8.0 * run.largest(|r| r.normal + r.kinematics) / c;
    let bound = h * (pull * radius + spin_then * spin_then);
    let halved = |name: &'static str, index: usize, off: f64| {
        equal((name, "rad/s"), found.after[index], 0.5 * spin_then, off + parting)
            .stepped(expected.after[index], within(bound, fine))
    };
    let curve = run.curve(("tilt of the first", "rad"), 0, tilt);
    curve.with([
        equal(("time until they meet", "s"), found.time, time, effect(|fall| fall.time))
            .stepped(expected.time, order(1, fine)),
        equal(("spin then", "rad/s"), found.spin, spin_then, effect(|fall| fall.spin))
            .stepped(expected.spin, order(1, fine)),
        halved("spin of the first after it", 0, effect(|fall| fall.after[0])),
        halved("spin of the second after it", 1, effect(|fall| fall.after[1])),
    ])
}
