//! Two four-bar windows side by side.

use super::pendulum::TOO_EXACT;
use super::planar::{Bar, Pin, Placed, Planar, Plane};
use super::prelude::*;
use super::quantity::at_most;
use std::f64::consts::PI;

/// Windows, and the length of every bar, m.
const WINDOWS: usize = 2;
const LENGTH: f64 = 1.0;
/// Of every bar, kg; and the speed of the bars between the tops at the start, m/s. The motion passes its singular positions as
/// near as steps happen to fall, and what a step lacks grows by as much, so that these stay what they are.
const MASS: f64 = 1.0;
const GRAVITY: f64 = 9.81;
const SPEED: f64 = 1.0;
/// Times they go around.
const TURNS: usize = 5;

/// Windows that go through their singular positions.
pub static FOUR_BAR_WINDOWS: Posed = Posed {
    name: "four-bar-windows",
    about: "Two windows of equal bars, begun upright, go around and around as the pendulum of the same energy does, twice \
            in every turn through the position where all bars lie on one line: \
            T = 2π/agm(ω, √(ω² + 4k)), k = 7g/(6L).",
    time_step: 0.002,
    bodies: 2 * WINDOWS + 1,
    beyond_ipopt: TOO_EXACT,
    ..Posed::by(windows)
};

/// Of n windows the n + 1 posts turn about their feet and the n bars between their tops move along circles,
///
/// ```text
/// T = ½ (⅓(n + 1) + n) m L² θ̇²,   V = (½(n + 1) + n) m g L cos θ,
/// θ̇² = ω² + 4 k sin² ½θ,   k = g/L (½(n + 1) + n)/(⅓(n + 1) + n)
/// ```
///
/// so that a turn takes ∫ dθ/θ̇ = 2π/agm(ω, √(ω² + 4k)). [`Planar::steps`] has the step's.
fn windows(_: &Inputs, laboratory: &mut Laboratory<'_>) -> Solved {
    let (mass, gravity, speed) = (MASS, GRAVITY, SPEED);
    let h = laboratory.time_step();
    let (count, spin) = (WINDOWS as f64, speed / LENGTH);
    let (weight, inertia) = (0.5 * (count + 1.0) + count, (count + 1.0) / 3.0 + count);
    let k = gravity / LENGTH * weight / inertia;
    let turn = |fast: f64| 2.0 * PI / super::pendulum::mean(spin, fast);
    let fastest = (spin * spin + 4.0 * k).sqrt();
    let exact = turn(fastest);
    Unsuitable::when(fastest * h > 0.05, || {
        format!("at {fastest:.2} rad/s a step of {h} s turns it too far")
    })?;
    let v = Vector2::new;
    let own = mass * LENGTH * LENGTH / 12.0;
    let mut mechanism = Planar {
        plane: Plane::Upright,
        bars: vec![Bar { mass, moment: own }; 2 * WINDOWS + 1],
        pins: Vec::new(),
        start: Vec::new(),
    };
    let half = v(0.5 * LENGTH, 0.0);
    let mut pin = |a, at, b, there| mechanism.pins.push(Pin { a, at, b, there });
    for post in 0..=WINDOWS {
        pin(post, -half, None, v(LENGTH * post as f64, 0.0));
    }
    for window in 0..WINDOWS {
        pin(WINDOWS + 1 + window, -half, Some(window), half);
        pin(WINDOWS + 1 + window, half, Some(window + 1), half);
    }
    for post in 0..=WINDOWS {
        let upright = Placed::at(v(LENGTH * post as f64, 0.5 * LENGTH), 0.5 * PI);
        mechanism.start.push(Placed { velocity: v(0.5 * speed, 0.0), spin: -spin, ..upright });
    }
    for window in 0..WINDOWS {
        let level = Placed::at(v(LENGTH * (window as f64 + 0.5), LENGTH), 0.0);
        mechanism.start.push(Placed { velocity: v(speed, 0.0), ..level });
    }
    let (bodies, joints) = mechanism.posed()?;
    let duration = (TURNS as f64 + 0.3) * exact;
    let setup = Setup { joints, ..Setup::new(bodies, gravity, 0.5, duration) };
    let run = laboratory.run(&setup)?;
    let down = (v(0.0, -mass * gravity), 0.0);
    let loads = |now: &[Placed]| vec![down; now.len()];
    let (measured, discrete) = (mechanism.track(&run), mechanism.steps(h, run.steps(), loads));
    let [found, wanted] = [&measured, &discrete].map(|track| around(track, h));
    let within = (TURNS as f64 * exact / h) as usize;
    let passed = measured.windows(2).take(within);
    let passed = passed.filter(|pair| height(&pair[0]) * height(&pair[1]) < 0.0);
    let singular = passed.count() as f64;
    // All posts stay alike, and what is between them level.
    let alike = |at: &[Placed]| {
        let posts = (1..=WINDOWS).map(|post| at[post].angle - at[0].angle);
        posts
            .chain((WINDOWS + 1..at.len()).map(|bar| at[bar].angle))
            .map(f64::abs)
            .fold(0.0, f64::max)
    };
    let askew = measured.iter().map(|at| alike(at)).fold(0.0, f64::max);
    let apart = |at: &[Placed]| {
        let gaps = mechanism.pins.iter().map(|pin| {
            let there = pin.b.map_or(pin.there, |b| at[b].point(&pin.there));
            (at[pin.a].point(&pin.at) - there).norm()
        });
        gaps.fold(0.0, f64::max)
    };
    let worst = measured.iter().map(|at| apart(at)).fold(0.0, f64::max);
    let energy = |pair: &[Vec<Placed>]| {
        let kinetic = 0.5 * (mechanism.kinetic(&pair[0], h) + mechanism.kinetic(&pair[1], h));
        kinetic + mass * gravity * pair[0].iter().map(|at| at.place[1]).sum::<f64>()
    };
    let energies: Vec<_> = measured.windows(2).map(energy).collect();
    let strayed = energies.iter().map(|e| (e - energies[0]).abs()).fold(0.0, f64::max);
    let most = 0.2 * inertia * mass * (LENGTH * fastest).powi(2) * (h * fastest).powi(2);
    let lost = run.sum(|residual| residual.joint + residual.momentum) * h;
    Ok(Findings {
        quantities: vec![
            exactly(("time of a turn", "s"), found, exact, 8.0 * lost / speed + 1e-11)
                .in_steps(wanted, Convergence::order(2, exact / h)),
            exactly(("passages of the singular position", ""), singular, 2.0 * TURNS as f64, 0.0),
            at_most(("largest angle between posts", "rad"), askew, 1e-9),
            at_most(("largest way of a pin from its place", "m"), worst, 1e-12),
            at_most(("energy, its largest change", "J"), strayed, most),
        ],
        curve: Curve::of(("height of a post's middle", "m"), &run, |k| height(&measured[k]))
            .beside(|_| f64::NAN),
    })
}

/// Of the middle of the first post above its foot, m.
fn height(at: &[Placed]) -> f64 {
    at[0].place[1]
}

/// The time of a turn: from the first passage through level to that of all turns but one later, along straight lines. NaN where there
/// are not as many.
fn around(track: &[Vec<Placed>], h: f64) -> f64 {
    let passes = track.windows(2).enumerate().filter_map(|(k, pair)| {
        let [before, after] = [&pair[0], &pair[1]].map(|at| height(at));
        (before > 0.0 && after <= 0.0).then(|| h * (k as f64 + before / (before - after)))
    });
    let times: Vec<_> = passes.collect();
    match times.get(TURNS - 1) {
        Some(last) => (last - times[0]) / (TURNS - 1) as f64,
        None => f64::NAN,
    }
}
