//! Runs with an accuracy: errors against closed forms and finer runs, and what a run can do.

use crate::leapfrog::{
    self, double_pendulum, four_bar, oblique_slide, pendulum, servo, slide, slip_to_roll,
    spin_and_slide, sprung_pendulum, top,
};
use nalgebra::Vector2;
use std::array;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use tumble::{Checkpoints, Run, Simulation, State, StepRecord};
use tumble_core::derivative::StateChange;
use tumble_core::simulation::Interval;
use tumble_core::solver::native::StepDerivative;
use tumble_scene::scene::Scene;

const G: f64 = 9.81;

fn scene(text: &str) -> Scene {
    let read = |path: &Path, _: u64| std::fs::read(path);
    Scene::from_text(text, Path::new("scene.toml"), &[], &read).unwrap()
}

/// Simulation of `text` with steps of 10 ms that keep `accuracy` (m).
fn simulation(text: &str, accuracy: f64) -> Simulation<'static> {
    let scene = scene(&format!("time_step = 0.01\naccuracy = {accuracy:?}\n{text}"));
    scene.simulation(&Arc::new(AtomicBool::new(false))).unwrap()
}

/// Takes `steps` steps, each of which is solved and keeps the accuracy.
fn run(simulation: &mut Simulation<'_>, steps: u64) {
    let mut record = StepRecord::new();
    for _ in 0..steps {
        simulation.step(&mut record).unwrap();
        assert!(record.status().is_one_problem(), "step {}", record.index);
        let is_coarse = record.intervals().iter().any(|interval| interval.is_coarse);
        assert!(!is_coarse, "step {}", record.index);
    }
}

/// States of the scene `text` at `time` (s).
fn at(text: &str, time: f64, accuracy: f64) -> Vec<State> {
    let mut simulation = simulation(text, accuracy);
    run(&mut simulation, (time / 0.01).round() as u64);
    simulation.states().to_vec()
}

/// Largest distance of positions (m).
fn apart(a: &[State], b: &[State]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a.position - b.position).norm()).fold(0.0, f64::max)
}

/// Ball that falls from 1 m and loses half of its speed at each impact.
fn bounce() -> String {
    "[ground]\nfriction = 0.3\nrestitution = 0.5\n[[bodies]]\nname = \"body\"\nmass = 1.0\n\
     sphere = 0.1\nposition = [0, 0, 1.1]\n"
        .to_owned()
}

/// Block that rocks on its edges until it stands, from 10°.
fn rocking_block() -> String {
    let (sine, cosine) = 10f64.to_radians().sin_cos();
    format!(
        "[ground]\nfriction = 0.4\n[[bodies]]\nname = \"body\"\nmass = 1.0\n\
         box = [0.2, 0.2, 0.6]\nattitude = {{ axis = [0, 1, 0], degrees = 10 }}\n\
         position = [{:?}, 0, {:?}]\n",
        0.3 * sine - 0.1 * cosine,
        0.3 * cosine + 0.1 * sine
    )
}

/// References are leapfrog runs with steps of 0.1 and 0.2 ms, extrapolated.
#[test]
fn smooth_motion_keeps_the_accuracy() {
    let cases = [
        ("oblique slide", oblique_slide(), 0.4),
        ("spin and slide", spin_and_slide(), 0.3),
        ("slip to roll", slip_to_roll(), 0.2),
        ("pendulum", pendulum(), 1.0),
        ("pendulum with a spring and a damper", sprung_pendulum(), 0.5),
        ("servo", servo(), 0.5),
        ("double pendulum", double_pendulum(), 0.5),
        ("four-bar", four_bar(), 0.4),
        ("top", top(), 0.1),
    ];
    for (name, text, time) in cases {
        let [coarse, fine] = [2e-4, 1e-4].map(|h| leapfrog::at(&text, time, h));
        let pairs = coarse.iter().zip(&fine);
        let exact: Vec<_> = pairs
            .map(|(coarse, fine)| {
                let position = fine.position + (fine.position - coarse.position) / 3.0;
                State { position, ..*fine }
            })
            .collect();
        for accuracy in [1e-4, 1e-6] {
            let error = apart(&at(&text, time, accuracy), &exact);
            assert!(error <= 3.0 * accuracy, "{name}, {accuracy:e}: {error:e}");
        }
    }
}

/// Height and speed after three impacts, each with half of the speed.
#[test]
fn a_bounce_happens_when_the_gap_closes() {
    let (mut height, mut speed, mut left) = (0.0, 0.5 * (2.0 * G).sqrt(), 1.2 - (2.0 / G).sqrt());
    while 2.0 * speed / G < left {
        left -= 2.0 * speed / G;
        speed *= 0.5;
    }
    height += speed * left - 0.5 * G * left * left;
    for accuracy in [1e-3, 1e-5, 1e-7] {
        let end = at(&bounce(), 1.2, accuracy)[0];
        let error = (end.position.z - 0.1 - height).abs();
        assert!(error <= accuracy, "{accuracy:e}: height {error:e}");
        let error = (end.velocity.z - (speed - G * left)).abs();
        assert!(error <= 10.0 * accuracy, "{accuracy:e}: speed {error:e}");
    }
}

/// With located impacts, the error of a bounce is not of the length of steps: a step of 10 ms is
/// divided where the gap closes. Free fall is exact.
#[test]
fn located_impacts_happen_when_the_gap_closes() {
    let (rise, fall) = (0.5 * (2.0 * G).sqrt(), (2.0 / G).sqrt());
    let left = 1.0 - fall - 2.0 * rise / G;
    let (speed, height) = (0.5 * rise - G * left, 0.5 * rise * left - 0.5 * G * left * left);
    for h in [0.02_f64, 0.01, 0.005] {
        let scene = scene(&format!("time_step = {h:?}\nimpacts = \"located\"\n{}", bounce()));
        let mut simulation = scene.simulation(&Arc::new(AtomicBool::new(false))).unwrap();
        run(&mut simulation, (1.0 / h).round() as u64);
        let end = simulation.state();
        assert!((end.position.z - 0.1 - height).abs() <= 1e-6, "{h}: {}", end.position);
        assert!((end.velocity.z - speed).abs() <= 1e-5, "{h}: {}", end.velocity);
    }
}

/// Friction stops the block after v²/(2 μ g).
#[test]
fn a_slide_ends_where_friction_stops_it() {
    for accuracy in [1e-4, 1e-7] {
        let end = at(&slide(), 1.4, accuracy)[0];
        let error = (end.position.x - 9.0 / (0.6 * G)).abs();
        assert!(error <= accuracy && end.velocity.norm() <= 1e-9, "{accuracy:e}: {error:e}");
    }
}

/// Head of a scene with a floor of these coefficients and a flat block of 1 kg on it.
fn block(friction: f64, static_friction: f64, more: &str) -> String {
    format!(
        "[ground]\nfriction = {friction:?}\nstatic_friction = {static_friction:?}\n[[bodies]]\nname = \"b\"\n\
         box = [0.4, 0.4, 0.1]\nmass = 1.0\nposition = [0, 0, 0.05]\n{more}"
    )
}

/// A block up a slope of 20° and back: the velocity at the turn is right too.
#[test]
fn a_block_turns_on_a_slope_in_time() {
    let (sine, cosine) = 20f64.to_radians().sin_cos();
    let [up, back] = [1.0, -1.0].map(|sign| G * (sine + sign * 0.2 * cosine));
    let left = 1.0 - 2.0 / up;
    let exact = -2.0 / up + 0.5 * back * left * left;
    let gravity = format!("gravity = [{:?}, 0, {:?}]\n", G * sine, -G * cosine);
    let text = gravity + &block(0.2, 0.2, "velocity = [-2, 0, 0]\n");
    for accuracy in [1e-3, 1e-5, 1e-7] {
        let end = at(&text, 1.0, accuracy)[0];
        let error = (end.position.x - exact).abs();
        assert!(error <= accuracy, "{accuracy:e}: {error:e}");
        let error = (end.velocity.x - back * left).abs();
        assert!(error <= accuracy, "{accuracy:e}: speed {error:e}");
    }
}

/// A ball up a slope of 10° and back, whose rolling is resisted.
#[test]
fn a_ball_rolls_back_in_time() {
    let (sine, cosine) = 10f64.to_radians().sin_cos();
    let [up, back] = [1.0, -1.0].map(|sign| G * (sine + sign * 0.05 * cosine) / 1.4);
    let left = 1.2 - 1.0 / up;
    let exact = -0.5 / up + 0.5 * back * left * left;
    let text = format!(
        "gravity = [{:?}, 0, {:?}]\n[ground]\nfriction = 0.9\nrolling_friction = 0.005\n[[bodies]]\n\
         name = \"b\"\nmass = 1.0\nsphere = 0.1\nposition = [0, 0, 0.1]\nvelocity = [-1, 0, 0]\nspin = [0, -10, 0]\n",
        G * sine,
        -G * cosine
    );
    for accuracy in [1e-3, 1e-5, 1e-7] {
        let error = (at(&text, 1.2, accuracy)[0].position.x - exact).abs();
        assert!(error <= accuracy, "{accuracy:e}: {error:e}");
    }
}

/// Force that grows by 4 N/s: a block begins to slip at μ_s m g, and x = (μ_s − μ) g t²/2 + c t³/6 from then.
#[test]
fn a_growing_force_breaks_a_block_away_in_time() {
    for most in [0.3, 0.5] {
        let load = "load = { force = [[0, 0, 0, 0], [20, 80, 0, 0]], at = [0, 0, -0.05] }\n";
        let since = 2.0 - most * G / 4.0;
        let exact = 0.5 * (most - 0.3) * G * since.powi(2) + 4.0 / 6.0 * since.powi(3);
        for accuracy in [1e-3, 1e-5, 1e-7] {
            let end = at(&block(0.3, most, load), 2.0, accuracy)[0];
            let error = (end.position.x - exact).abs();
            assert!(error <= accuracy, "{most}, {accuracy:e}: {error:e}");
        }
    }
}

/// Torque that grows by 1 N m/s about the normal: the corners, at the distance R, hold it until μ_s m g R.
#[test]
fn a_growing_torque_breaks_a_block_away_in_time() {
    let (radius, inertia) = (0.2 * 2f64.sqrt(), 0.32 / 12.0);
    let since = 1.8 - 0.5 * G * radius;
    let exact = (0.2 * G * radius * since.powi(2) / 2.0 + since.powi(3) / 6.0) / inertia;
    let text = block(0.3, 0.5, "load = { torque = [[0, 0, 0, 0], [10, 0, 0, 10]] }\n");
    for accuracy in [1e-3, 1e-5, 1e-7] {
        let attitude = at(&text, 1.8, accuracy)[0].attitude;
        let error = (2.0 * attitude[3].atan2(attitude[0]) - exact) * radius;
        assert!(error.abs() <= accuracy, "{accuracy:e}: {error:e}");
    }
}

/// Text of a tray that moves through `places` (m) along x at these times (s), with `speed` at its start.
fn tray(knots: impl Iterator<Item = (f64, f64)> + Clone, speed: f64) -> String {
    let times: Vec<f64> = knots.clone().map(|(time, _)| time).collect();
    let places: Vec<[f64; 3]> = knots.map(|(_, place)| [place, 0.0, 1.0]).collect();
    format!(
        "[[bodies]]\nname = \"tray\"\nmass = 1.0\nbox = [2, 2, 0.1]\nposition = [0, 0, 1]\nvelocity = [{speed:?}, 0, 0]\n\
         [[driven]]\nbody = \"tray\"\ntimes = {times:?}\npositions = {places:?}\n"
    )
}

/// A tray turns back within a step, and the block on it slides on: x = v t − ½ μ g (t − t₁)².
#[test]
fn a_tray_that_turns_back_leaves_its_block_in_time() {
    let (speed, turn, end) = (1.3, 0.0925, 0.3);
    let knots = [(0.0, 0.0), (turn, speed * turn), (1.0, speed * (2.0 * turn - 1.0))];
    let block =
        "name = \"b\"\nmass = 1.0\nbox = 0.2\nposition = [0, 0, 1.15]\nvelocity = [1.3, 0, 0]\n";
    let text =
        format!("[ground]\nfriction = 0.2\n{}[[bodies]]\n{block}", tray(knots.into_iter(), speed));
    let exact = speed * end - 0.1 * G * (end - turn).powi(2);
    for accuracy in [1e-3, 1e-5, 1e-7] {
        let error = (at(&text, end, accuracy)[1].position.x - exact).abs();
        assert!(error <= 1e-9, "{accuracy:e}: {error:e}");
    }
}

/// A tray with a knot every millisecond does not touch a pendulum, which moves as without it.
#[test]
fn a_sampled_motion_changes_nothing_beside_it() {
    let knots = (0..600).map(|k| (0.001 * f64::from(k), 0.1 - 0.1 * (0.008 * f64::from(k)).cos()));
    let alone = pendulum();
    let beside =
        tray(knots, 0.0).replace("0.0, 1.0]", "5.0, 1.0]").replace("[0, 0, 1]", "[0, 5, 1]")
            + &alone.split_once("[[bodies]]").map(|(_, rest)| format!("[[bodies]]{rest}")).unwrap();
    let head = alone.split("[[bodies]]").next().unwrap();
    for accuracy in [1e-4, 1e-6] {
        let [alone, beside] =
            [alone.clone(), format!("{head}{beside}")].map(|text| at(&text, 0.5, accuracy));
        let apart = (alone[0].position - beside[1].position).norm();
        assert!(apart < 1e-9, "{accuracy:e}: {apart:e}");
    }
}

/// A spring holds a block on a belt of 0.1 m/s. It sticks until k x = μ_s m g; then x = μ g/ω² + A cos ω t + v/ω sin ω t
/// with A = (μ_s − μ) g/ω².
#[test]
fn a_belt_takes_a_block_along_until_the_spring_breaks_it_away() {
    let (belt, stiffness) = (0.1, 50f64);
    let text = block(0.2, 0.3, &format!("velocity = [{belt:?}, 0, 0]\n"))
        + &format!(
            "[[surfaces]]\nof = \"ground\"\nvelocity = [{belt:?}, 0, 0]\n[[joints]]\nname = \"s\"\ntype = \"free\"\n\
             bodies = \"b\"\nanchor_a = [0, 0, 0]\nanchor_b = [0, 0, 0.05]\nx = {{ stiffness = {stiffness:?} }}\n"
        );
    let omega = stiffness.sqrt();
    let [broken, centre] = [0.3, 0.2].map(|friction| friction * G / stiffness);
    let (sine, cosine) = (omega * (1.0 - broken / belt)).sin_cos();
    let exact = centre + (broken - centre) * cosine + belt / omega * sine;
    for accuracy in [1e-3, 1e-5, 1e-6] {
        let error = (at(&text, 1.0, accuracy)[0].position.x - exact).abs();
        assert!(error <= accuracy, "{accuracy:e}: {error:e}");
    }
}

/// In a heap with located impacts, friction turns within microseconds. A turn is passed by at a thousandth of the step.
#[test]
fn a_heap_with_located_impacts_takes_few_intervals() {
    let text = "impacts = \"located\"\n[ground]\nfriction = 0.3\n[[bodies]]\nname = \"b\"\nsphere = 0.02\n\
                density = 2500.0\nposition = [0, 0, 0.03]\njitter = 0.009\n\
                copies = { count = [2, 2, 3], step = [0.06, 0.06, 0.06] }\n";
    let mut simulation = scene(text).simulation(&Arc::new(AtomicBool::new(false))).unwrap();
    let mut record = StepRecord::new();
    let mut intervals = 0;
    for _ in 0..100 {
        simulation.step(&mut record).unwrap();
        // Gaps are known to 1e-16 m, and windows last from 1e-8 s on.
        let residual = |interval: &Interval| interval.certificate.residual();
        let largest = record.intervals().iter().map(residual).fold(0.0, f64::max);
        assert!(largest < 1e-8, "step {}: {largest:e}", record.index);
        intervals += record.intervals().len();
    }
    assert!(intervals < 2500, "{intervals}");
}

/// A block that slides at 0.15 m/s has the kinetic friction until it stops after v²/(2 μ g), however short the
/// steps are.
#[test]
fn a_slow_slide_has_the_kinetic_friction() {
    for (accuracy, h) in [(1e-3, 5e-4_f64), (1e-3, 0.01), (1e-5, 5e-4)] {
        let text = block(0.1, 0.5, "velocity = [0.15, 0, 0]\n");
        let scene = scene(&format!("time_step = {h:?}\naccuracy = {accuracy:?}\n{text}"));
        let mut simulation = scene.simulation(&Arc::new(AtomicBool::new(false))).unwrap();
        run(&mut simulation, (0.2 / h).round() as u64);
        let error = (simulation.state().position.x - 0.15 * 0.15 / (0.2 * G)).abs();
        assert!(error <= 0.1 * accuracy, "{accuracy:e}, {h}: {error:e}");
    }
}

/// A ball rolls across a slope. Rolling friction opposes its velocity v, which turns:
///
/// ```text
/// v̇ = (g sin α x̂ − μ_r/r g cos α v/|v|)/1.4
/// ```
#[test]
fn rolling_friction_turns_with_the_ball() {
    let (sine, cosine) = 15f64.to_radians().sin_cos();
    let rate = |v: Vector2<f64>| (Vector2::x() * G * sine - v.normalize() * 0.1 * G * cosine) / 1.4;
    let (mut place, mut velocity, h) = (Vector2::zeros(), Vector2::new(0.0, 1.0), 1e-4);
    for _ in 0..4000 {
        let a = rate(velocity);
        let b = rate(velocity + a * 0.5 * h);
        let c = rate(velocity + b * 0.5 * h);
        let d = rate(velocity + c * h);
        place += velocity * h + (a + b + c) * h * h / 6.0;
        velocity += (a + (b + c) * 2.0 + d) * h / 6.0;
    }
    let text = format!(
        "gravity = [{:?}, 0, {:?}]\n[ground]\nfriction = 0.9\nrolling_friction = 0.01\n[[bodies]]\n\
         name = \"b\"\nmass = 1.0\nsphere = 0.1\nposition = [0, 0, 0.1]\nvelocity = [0, 1, 0]\nspin = [-10, 0, 0]\n",
        G * sine,
        -G * cosine
    );
    for accuracy in [1e-3, 1e-5, 1e-6] {
        let error = (at(&text, 0.4, accuracy)[0].position.xy() - place).norm();
        assert!(error <= 0.1 * accuracy, "{accuracy:e}: {error:e}");
    }
}

/// Plastic impacts of edges: every run approaches the run with a finer accuracy.
#[test]
fn a_rocking_block_converges() {
    let finest = at(&rocking_block(), 0.8, 1e-8);
    for accuracy in [1e-3, 1e-4, 1e-5, 1e-6] {
        let error = apart(&at(&rocking_block(), 0.8, accuracy), &finest);
        assert!(error <= 15.0 * accuracy, "{accuracy:e}: {error:e}");
    }
}

/// Momentum passes through a row of elastic balls with small gaps, one impact after the other.
#[test]
fn balls_in_a_row_pass_the_momentum_on() {
    let ball = |name: &str, x: f64, speed: f64| {
        format!(
            "[[bodies]]\nname = \"{name}\"\nsphere = 0.05\nmass = 1.0\nposition = [{x:?}, 0, 0]\n\
             velocity = [{speed:?}, 0, 0]\n"
        )
    };
    let text = "gravity = 0.0\n[ground]\nnone = true\nfriction = 0.0\nrestitution = 1.0\n"
        .to_owned()
        + &ball("a", -0.15, 1.0)
        + &ball("b", 0.0, 0.0)
        + &ball("c", 0.1 + 1e-4, 0.0)
        + &ball("d", 0.2 + 2e-4, 0.0);
    let ends = at(&text, 0.2, 1e-6);
    // The gaps of 5 cm and 0.1 mm take 50.2 ms.
    let x = 0.2 + 2e-4 + 0.2 - 0.0502;
    for (end, (place, speed)) in
        ends.iter().zip([(-0.1, 0.0), (1e-4, 0.0), (0.1 + 2e-4, 0.0), (x, 1.0)])
    {
        assert!((end.position.x - place).abs() <= 2e-6, "{:?} {place}", end.position);
        assert!((end.velocity.x - speed).abs() <= 1e-9, "{:?} {speed}", end.velocity);
    }
}

#[test]
fn a_step_in_substeps_taken_back_and_repeated_is_the_same() {
    for text in [bounce(), servo(), spin_and_slide()] {
        let mut simulation = simulation(&text, 1e-5);
        let mut record = StepRecord::new();
        for _ in 0..60 {
            let before = simulation.states().to_vec();
            simulation.step(&mut record).unwrap();
            let after = (simulation.states().to_vec(), simulation.time_errors().to_vec());
            simulation.take_back(&record);
            assert_eq!(simulation.states(), before);
            simulation.step(&mut record).unwrap();
            assert_eq!(
                (simulation.states(), simulation.time_errors()),
                (&after.0[..], &after.1[..])
            );
        }
    }
}

#[test]
fn a_saved_run_goes_on_with_the_same_bits() {
    let mut whole = simulation(&rocking_block(), 1e-5);
    run(&mut whole, 30);
    let saved = whole.save().to_bytes().unwrap();
    run(&mut whole, 50);
    let mut other = simulation(&rocking_block(), 1e-5);
    other.restore(&tumble::Saved::from_bytes(&saved).unwrap()).unwrap();
    run(&mut other, 50);
    assert_eq!(whole.states(), other.states());
    assert_eq!(whole.time_errors(), other.time_errors());
}

/// A load over time acts at its times, also within steps.
#[test]
fn loads_act_at_their_times() {
    let text = "gravity = 0.0\n[ground]\nnone = true\nfriction = 0.3\n[[bodies]]\nname = \"body\"\n\
                sphere = 0.1\nmass = 2.0\nposition = [0, 0, 0]\n\
                load = { force = [[0.0, 0, 0, 0], [1.0, 6, 0, 0]] }\n";
    let end = at(text, 1.0, 1e-7)[0];
    // x″ = 3 t
    assert!((end.position.x - 0.5).abs() <= 1e-6, "{}", end.position);
    assert!((end.velocity.x - 1.5).abs() <= 1e-6, "{}", end.velocity);
}

/// Gradient of weighted changes of the last states of a run of `steps` steps of 10 ms, from its start.
fn gradient(text: &str, accuracy: f64, steps: u64, weights: &[f64; 12]) -> [f64; 12] {
    let mut by_states = |k: u64, states: &[State]| {
        let zero = || vec![StateChange::zero(); states.len()];
        (k == steps).then(|| {
            let mut by_states = zero();
            by_states[0] = StateChange::from_array(weights);
            by_states
        })
    };
    let mut run = Run {
        steps,
        before: &mut |_: &mut Simulation<'_>| Ok(()),
        by_states: &mut by_states,
        constants: &[],
        inputs: &[],
        checkpoints: Checkpoints { steps: 7, saved: 3 },
        smoothing: None,
        has_impact_times: false,
    };
    let mut simulation = simulation(text, accuracy);
    let found = simulation.gradient(&mut run).unwrap();
    assert_eq!((found.unsolved, found.wrenches.len()), (0, steps as usize));
    assert_eq!(simulation.states(), at(text, steps as f64 * 0.01, accuracy));
    found.states[0].to_array()
}

/// Gradients of runs with substeps are derivatives of the motion, to the order of the scheme: those of
/// differences between runs, also through impacts with a loss.
#[test]
fn gradients_are_those_of_the_motion() {
    let ball = "[ground]\nfriction = 0.3\n[[bodies]]\nname = \"body\"\nsphere = 0.1\nmass = 1.0\n\
                position = [0, 0, 0.3]\nvelocity = [1.0, 0.5, 0]\nspin = [2, -3, 1]\n";
    // Velocity about the hinge of the pendulum.
    let hinged = vec![[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -0.3, 0.0, -0.4, 0.0, 1.0, 0.0]];
    let units = |kept: &[usize]| {
        let unit = |axis: usize| array::from_fn(|k| f64::from(u8::from(k == axis)));
        kept.iter().map(|axis| unit(*axis)).collect::<Vec<[f64; 12]>>()
    };
    let cases = [
        ("servo", servo(), 30, hinged.clone()),
        ("sprung pendulum", sprung_pendulum(), 30, hinged),
        ("spin and slide", spin_and_slide(), 20, units(&[0, 1, 5, 6, 7, 11])),
        ("bounces", bounce(), 110, units(&array::from_fn::<_, 12, _>(|k| k))),
        ("landing", ball.to_owned(), 40, units(&array::from_fn::<_, 12, _>(|k| k))),
    ];
    let weights = [0.3, -0.2, 0.5, 0.4, -0.1, 0.2, 0.07, 0.01, -0.04, 0.02, 0.05, -0.03];
    for (name, text, steps, directions) in cases {
        let found = gradient(&text, 1e-6, steps, &weights);
        let value = |change: [f64; 12]| {
            let mut simulation = simulation(&text, 1e-7);
            let moved = StateChange::from_array(&change).applied(&simulation.states()[0]);
            simulation.set_state(0, moved).unwrap();
            run(&mut simulation, steps);
            simulation.states()[0]
        };
        let middle = value([0.0; 12]);
        for direction in directions {
            let size = 1e-3;
            let at = |by: f64| {
                let change = direction.map(|along| by * along);
                let end = StateChange::between(&middle, &value(change));
                StateChange::from_array(&weights).dot(&end)
            };
            let expected = (at(size) - at(-size)) / (2.0 * size);
            let found: f64 = found.iter().zip(&direction).map(|(by, along)| by * along).sum();
            assert!(
                (found - expected).abs() <= 3e-4 * (1.0 + expected.abs()),
                "{name} {direction:?}: {found} {expected}"
            );
        }
    }
}

#[test]
fn steps_in_substeps_have_no_derivative() {
    let mut simulation = simulation(&slide(), 1e-5);
    let mut record = StepRecord::new();
    simulation.use_middle_velocities();
    simulation.step(&mut record).unwrap();
    let refused = simulation.linearise(&record, &mut StepDerivative::new()).unwrap_err();
    assert!(refused.to_string().contains("ask for the gradient of the run"), "{refused}");
}
