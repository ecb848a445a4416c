//! Two four-bar windows side by side.

use crate::planar::{Bar, Linkage, PlanarBody, PlanarPin, PlanarSurface};
use crate::prelude::*;
use std::f64::consts::PI;

/// Windows, and the length of every bar, m.
const WINDOWS: usize = 2;
const LENGTH: f64 = 1.0;
/// Mass of a bar (kg), gravity (m/s²) and initial speed of the bars between the tops (m/s).
const MASS: f64 = 1.0;
const GRAVITY: f64 = 9.81;
const SPEED: f64 = 1.0;
const TURNS: usize = 5; // Turns

/// Two windows of equal bars, begun upright, go around and around as the pendulum of the same
/// energy does, twice in every turn through the position where all bars lie on one line: T =
/// 2π/agm(ω, √(ω² + 4k)), k = 7g/(6L).
pub(crate) const FOUR_BAR_WINDOWS: TestProblem = TestProblem {
    name: "four-bar-windows",
    time_step: 0.002,
    bodies: 2 * WINDOWS + 1,
    ..TestProblem::solved_by(windows)
};

/// A turn of n windows takes 2π/agm(ω, √(ω² + 4k)), discrete by [`Linkage::steps`], with
///
/// ```text
/// k = g/L (½(n + 1) + n)/(⅓(n + 1) + n)
/// ```
fn windows(_: &TestInputs, runner: &mut Runner<'_>) -> SolvedBy {
    let (h, count, spin) = (runner.time_step, WINDOWS as f64, SPEED / LENGTH);
    let (weight, inertia) = (0.5 * (count + 1.0) + count, (count + 1.0) / 3.0 + count);
    let k = GRAVITY / LENGTH * weight / inertia;
    let fastest = (spin * spin + 4.0 * k).sqrt();
    let exact = 2.0 * PI / agm(spin, fastest);
    let why =
        format!("at {fastest:.2} rad/s a step of {h} s turns it too far; use a smaller time step");
    Refusal::when(fastest * h > 0.05, why)?;
    let linkage = linkage(spin);
    let run = runner.run(&linkage.setup(GRAVITY, (TURNS as f64 + 0.3) * exact)?)?;
    let loads = |now: &[PlanarBody]| vec![(Vector2::new(0.0, -MASS * GRAVITY), 0.0); now.len()];
    let (measured, discrete) = (linkage.track(&run), linkage.steps(h, run.steps(), loads));
    let [found, expected] = [&measured, &discrete].map(|track| turn_time(track, h));
    let within = (TURNS as f64 * exact / h) as usize;
    let passed = measured.windows(2).take(within);
    let passed = passed.filter(|pair| height(&pair[0]) * height(&pair[1]) < 0.0);
    let singular = passed.count() as f64;
    // All posts stay parallel, and the bars between them level.
    let askew = |at: &Vec<PlanarBody>| {
        let posts = (1..=WINDOWS).map(|post| at[post].angle - at[0].angle);
        largest(posts.chain(at[WINDOWS + 1..].iter().map(|bar| bar.angle)).map(f64::abs))
    };
    let askew = largest(measured.iter().map(askew));
    let strayed = linkage.energy_change(&measured, h, |at| {
        MASS * GRAVITY * at.iter().map(|at| at.place[1]).sum::<f64>()
    });
    let most = 0.2 * inertia * MASS * (LENGTH * fastest).powi(2) * (h * fastest).powi(2);
    let off = 8.0 * (run.sum(|r| r.joint + r.momentum) * h) / SPEED + 1e-11;
    let gap = linkage.worst_gap(&measured);
    Ok(vec![
        equal(("time of a turn", "s"), found, exact, off).stepped(expected, order(2, exact / h)),
        equal(("passages of the singular position", ""), singular, 2.0 * TURNS as f64, 0.0),
        at_most(("largest angle between posts", "rad"), askew, 1e-9),
        at_most(("largest way of a pin from its place", "m"), gap, 1e-12),
        at_most(("energy, its largest change", "J"), strayed, most),
    ])
}

/// The windows upright, with the posts at this spin.
fn linkage(spin: f64) -> Linkage {
    let v = Vector2::new;
    let half = v(0.5 * LENGTH, 0.0);
    let (mut pins, mut start) = (Vec::new(), Vec::new());
    for post in 0..=WINDOWS {
        let foot = v(LENGTH * post as f64, 0.0);
        pins.push(PlanarPin { a: post, at: -half, b: None, there: foot });
        let upright = PlanarBody::at(v(LENGTH * post as f64, 0.5 * LENGTH), 0.5 * PI);
        start.push(PlanarBody { velocity: v(0.5 * SPEED, 0.0), spin: -spin, ..upright });
    }
    for window in 0..WINDOWS {
        let a = WINDOWS + 1 + window;
        pins.push(PlanarPin { a, at: -half, b: Some(window), there: half });
        pins.push(PlanarPin { a, at: half, b: Some(window + 1), there: half });
        let level = PlanarBody::at(v(LENGTH * (window as f64 + 0.5), LENGTH), 0.0);
        start.push(PlanarBody { velocity: v(SPEED, 0.0), ..level });
    }
    let bars = vec![Bar { mass: MASS, moment: MASS * LENGTH * LENGTH / 12.0 }; 2 * WINDOWS + 1];
    Linkage { plane: PlanarSurface::Upright, bars, pins, start }
}

/// The middle of the first post above its foot, m.
fn height(at: &[PlanarBody]) -> f64 {
    at[0].place[1]
}

/// The mean time of a turn after the first passage through level, s.
fn turn_time(track: &[Vec<PlanarBody>], h: f64) -> f64 {
    let heights: Vec<_> = track.iter().map(|at| height(at)).collect();
    mean_interval(&zeros(&heights, h, |before, after| before > 0.0 && after <= 0.0), TURNS - 1)
}
