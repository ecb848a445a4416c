//! Runs with the leapfrog integrator: order of convergence, closed forms, and velocities of the
//! instant.

use crate::gradients::gradient_of_end;
use nalgebra::Vector3;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use tumble::{Checkpoints, Run, Simulation, State, StepRecord, Wrench};
use tumble_core::derivative::StateChange;
use tumble_scene::scene::Scene;

const G: f64 = 9.81;

/// Scene of `text` with the time step `h` (s).
fn scene(text: &str, h: f64) -> Scene {
    let text = format!("time_step = {h:?}\nintegrator = \"leapfrog\"\n{text}");
    let read = |path: &Path, _: u64| std::fs::read(path);
    Scene::from_text(&text, Path::new("scene.toml"), &[], &read).unwrap()
}

pub fn simulation(text: &str, h: f64) -> Simulation<'static> {
    scene(text, h).simulation(&Arc::new(AtomicBool::new(false))).unwrap()
}

/// Takes all steps up to `time` (s).
fn run(simulation: &mut Simulation<'_>, time: f64) {
    let mut record = StepRecord::new();
    let steps = (time / simulation.world().time_step()).round() as u64;
    for _ in 0..steps {
        simulation.step(&mut record).unwrap();
        assert!(record.status().is_one_problem(), "step {}", record.index);
    }
}

/// States of the scene `text` at `time` (s), with the time step `h` (s).
pub fn at(text: &str, time: f64, h: f64) -> Vec<State> {
    let mut simulation = simulation(text, h);
    run(&mut simulation, time);
    simulation.states().to_vec()
}

fn distance(a: &[State], b: &[State]) -> f64 {
    let pairs = a.iter().zip(b).map(|(a, b)| (a.to_vector() - b.to_vector()).amax());
    pairs.fold(0.0, f64::max)
}

const GROUND: &str = "[ground]\nfriction = 0.3\n[[bodies]]\nname = \"body\"\n";
pub const NO_GROUND: &str = "[ground]\nnone = true\nfriction = 0.3\n";

pub fn slide() -> String {
    format!(
        "{GROUND}box = [0.4, 0.4, 0.2]\nmass = 1.0\nposition = [0, 0, 0.1]\nvelocity = [3, 0, 0]\n"
    )
}

/// Slope of 15° along x with a plate that slides across it.
pub fn oblique_slide() -> String {
    let (sine, cosine) = 15f64.to_radians().sin_cos();
    format!(
        "[ground]\nfriction = 0.3\nslope = 15\n[[bodies]]\nname = \"body\"\nbox = [0.4, 0.4, 0.1]\n\
         mass = 1.0\nposition = [{:?}, 0, {:?}]\nattitude = {{ axis = [0, 1, 0], degrees = 15 }}\n\
         velocity = [0, 2, 0]\n",
        0.05 * sine,
        0.05 * cosine,
    )
}

pub fn spin_and_slide() -> String {
    format!(
        "{GROUND}box = [0.4, 0.4, 0.1]\nmass = 1.0\nposition = [0, 0, 0.05]\nvelocity = [2, 0, 0]\n\
         spin = [0, 0, 8]\n"
    )
}

pub fn slip_to_roll() -> String {
    format!(
        "{GROUND}sphere = 0.1\nmass = 1.0\nposition = [0, 0, 0.1]\nvelocity = [2, 0, 0]\n\
         spin = [3, -5, 2]\n"
    )
}

/// A rod of 1 m at the angle of sin φ = 0.8 from the vertical.
pub fn pendulum() -> String {
    let degrees = -0.8f64.asin().to_degrees();
    format!(
        "{NO_GROUND}[[bodies]]\nname = \"body\"\nbox = [0.05, 0.05, 1.0]\nmass = 1.0\n\
         position = [0.4, 0, -0.3]\nattitude = {{ axis = [0, 1, 0], degrees = {degrees:?} }}\n\
         [[joints]]\nname = \"hinge\"\ntype = \"revolute\"\nbodies = \"body\"\nanchor = [0, 0, 0]\n\
         axis = [0, 1, 0]\n"
    )
}

pub fn sprung_pendulum() -> String {
    format!("{}stiffness = 20.0\ndamping = 0.5\n", pendulum())
}

/// The pendulum with a motor that holds it at 0.5 rad.
pub fn servo() -> String {
    format!(
        "{}[[motors]]\njoint = \"hinge\"\nposition = 0.5\nstiffness = 60.0\ndamping = 2.0\n\
         max_force = 100\n",
        pendulum()
    )
}

pub fn top() -> String {
    let degrees = -0.6f64.asin().to_degrees();
    format!(
        "{NO_GROUND}[[bodies]]\nname = \"body\"\ncylinder = {{ radius = 0.2, length = 0.05 }}\n\
         mass = 1.0\nposition = [0, 0.3, 0.4]\nattitude = {{ axis = [1, 0, 0], degrees = {degrees:?} }}\n\
         spin = [0, 0, 60]\n[[joints]]\nname = \"tip\"\ntype = \"spherical\"\nbodies = \"body\"\n\
         anchor = [0, 0, 0]\n"
    )
}

/// A scenario of the repository without its name, steps and time step.
fn shipped(name: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios").join(name);
    let text = std::fs::read_to_string(path).unwrap();
    let is_head = |line: &&str| !(line.starts_with("steps") || line.starts_with("time_step"));
    text.lines().filter(is_head).collect::<Vec<_>>().join("\n")
}

pub fn double_pendulum() -> String {
    shipped("double-pendulum.toml")
}

pub fn four_bar() -> String {
    shipped("four-bar.toml")
}

#[test]
fn smooth_motion_is_of_second_order() {
    let cases = [
        ("oblique slide", oblique_slide(), 0.4, 0.005),
        ("spin and slide", spin_and_slide(), 0.4, 0.004),
        ("slip to roll", slip_to_roll(), 0.2, 0.005),
        ("pendulum", pendulum(), 1.0, 0.005),
        ("pendulum with a spring and a damper", sprung_pendulum(), 1.0, 0.005),
        ("servo", servo(), 1.0, 0.004),
        ("double pendulum", double_pendulum(), 0.5, 0.005),
        ("four-bar", four_bar(), 0.4, 0.002),
        ("top", top(), 0.25, 0.001),
    ];
    for (name, text, time, h) in cases {
        let ends = [1.0, 0.5, 0.25].map(|part| at(&text, time, h * part));
        let [coarse, fine] = [0, 1].map(|k| distance(&ends[k], &ends[k + 1]));
        let order = (coarse / fine).log2();
        assert!((order - 2.0).abs() <= 0.1, "{name}: order {order:.3}, {coarse:e}, {fine:e}");
    }
}

/// Solution of x″ = f(x, x′) in the plane by the classical Runge–Kutta method.
fn integrated(
    acceleration: impl Fn([f64; 2], [f64; 2]) -> [f64; 2],
    mut x: [f64; 2],
    mut v: [f64; 2],
    time: f64,
) -> ([f64; 2], [f64; 2]) {
    let steps = 20_000;
    let h = time / f64::from(steps);
    let plus = |a: [f64; 2], s: f64, b: [f64; 2]| [a[0] + s * b[0], a[1] + s * b[1]];
    for _ in 0..steps {
        let a1 = acceleration(x, v);
        let (x2, v2) = (plus(x, 0.5 * h, v), plus(v, 0.5 * h, a1));
        let a2 = acceleration(x2, v2);
        let (x3, v3) = (plus(x, 0.5 * h, v2), plus(v, 0.5 * h, a2));
        let a3 = acceleration(x3, v3);
        let (x4, v4) = (plus(x, h, v3), plus(v, h, a3));
        let a4 = acceleration(x4, v4);
        let mean = |k1: [f64; 2], k2: [f64; 2], k3: [f64; 2], k4: [f64; 2]| {
            [0, 1].map(|k| (k1[k] + 2.0 * k2[k] + 2.0 * k3[k] + k4[k]) / 6.0)
        };
        (x, v) = (plus(x, h, mean(v, v2, v3, v4)), plus(v, h, mean(a1, a2, a3, a4)));
    }
    (x, v)
}

#[test]
fn a_slide_ends_where_the_closed_form_says() {
    let state = at(&slide(), 1.4, 0.002)[0];
    let expected = 9.0 / (2.0 * 0.3 * G);
    assert!((state.position.x - expected).abs() <= 1e-5, "{}", state.position.x - expected);
    assert!(state.velocity.norm() <= 1e-12);
}

#[test]
fn a_pendulum_follows_its_equation() {
    // A rod with a square section of b = 5 cm about its end: φ″ = −½ g ℓ sin φ/((ℓ² + b²)/12 + ¼ ℓ²).
    let inertia = (1.0 + 0.0025) / 12.0 + 0.25;
    let rod = |x: [f64; 2], _: [f64; 2]| [-0.5 * G * x[0].sin() / inertia, 0.0];
    let ([angle, _], [rate, _]) = integrated(rod, [0.8f64.asin(), 0.0], [0.0; 2], 2.0);
    let errors = [0.002, 0.001].map(|h| {
        let state = at(&pendulum(), 2.0, h)[0];
        let found = state.position.x.atan2(-state.position.z);
        [found - angle, -state.spin.y - rate]
    });
    // The errors of 2 ms: those of second order have a quarter with half of the step.
    for (k, largest) in [(0, 3e-5), (1, 2e-4)] {
        let [coarse, fine] = [errors[0][k], errors[1][k]];
        assert!(coarse.abs() <= largest, "{coarse:e}");
        assert!((coarse / fine - 4.0).abs() <= 0.1, "{coarse:e} {fine:e}");
    }
}

#[test]
fn a_slide_across_a_slope_follows_its_equation() {
    let state = at(&oblique_slide(), 0.4, 0.002)[0];
    let (sine, cosine) = 15f64.to_radians().sin_cos();
    let slope = |_: [f64; 2], v: [f64; 2]| {
        let speed = v[0].hypot(v[1]);
        [G * sine - 0.3 * G * cosine * v[0] / speed, -0.3 * G * cosine * v[1] / speed]
    };
    let ([down, across], [faster, _]) = integrated(slope, [0.0; 2], [0.0, 2.0], 0.4);
    let along = Vector3::new(cosine, 0.0, -sine);
    let moved = state.position - Vector3::new(0.05 * sine, 0.0, 0.05 * cosine);
    assert!((along.dot(&moved) - down).abs() <= 1e-5, "{:e}", along.dot(&moved) - down);
    assert!((moved.y - across).abs() <= 1e-5, "{:e}", moved.y - across);
    assert!((along.dot(&state.velocity) - faster).abs() <= 5e-5);
}

#[test]
fn a_ball_rolls_at_five_sevenths() {
    let text =
        format!("{GROUND}sphere = 0.1\nmass = 1.0\nposition = [0, 0, 0.1]\nvelocity = [2, 0, 0]\n");
    let state = at(&text, 0.4, 0.002)[0];
    // It slips for t = 2 v/(7 μ g) and rolls with 5 v/7 after it.
    let slips = 2.0 * 2.0 / (7.0 * 0.3 * G);
    let expected = 2.0 * slips - 0.5 * 0.3 * G * slips * slips + (0.4 - slips) * 10.0 / 7.0;
    // Spins change their momentum by (h ω)²/4, here 2e-4.
    let off = state.velocity.x - 10.0 / 7.0;
    assert!(off.abs() <= 1e-4, "{off:e}");
    assert!((state.position.x - expected).abs() <= 5e-5, "{:e}", state.position.x - expected);
}

#[test]
fn free_flight_and_loads_over_time_have_their_closed_forms() {
    let text = format!(
        "{NO_GROUND}[[bodies]]\nname = \"body\"\nsphere = 0.1\nmass = 2.0\nposition = [0, 0, 5]\n\
         velocity = [1, 0, 3]\nload = {{ force = [[0.0, 0, 0, 0], [1.0, 6, 0, 0]] }}\n"
    );
    let state = at(&text, 0.5, 0.01)[0];
    // x″ = 3 t, z″ = −g.
    assert!((state.position.z - (5.0 + 1.5 - 0.125 * G)).abs() <= 1e-13);
    assert!((state.velocity.z - (3.0 - 0.5 * G)).abs() <= 1e-13);
    assert!((state.position.x - (0.5 + 0.125 / 2.0)).abs() <= 2e-5, "{}", state.position.x);
    assert!((state.velocity.x - (1.0 + 0.375)).abs() <= 2e-4, "{}", state.velocity.x);
}

#[test]
fn setting_the_present_states_changes_nothing() {
    let text = shipped("double-pendulum.toml");
    let (mut one, mut other) = (simulation(&text, 0.002), simulation(&text, 0.002));
    let mut records = [StepRecord::new(), StepRecord::new()];
    for _ in 0..100 {
        let states = other.states().to_vec();
        other.set_states(&states).unwrap();
        one.step(&mut records[0]).unwrap();
        other.step(&mut records[1]).unwrap();
        assert_eq!(one.states(), other.states());
        assert_eq!(one.step_states(), other.step_states());
        assert_eq!(records[0].report().iterations, records[1].report().iterations);
    }
}

#[test]
fn a_step_taken_back_and_repeated_is_the_same() {
    let mut simulation = simulation(&spin_and_slide(), 0.002);
    let mut record = StepRecord::new();
    for _ in 0..50 {
        let before = simulation.states().to_vec();
        simulation.step(&mut record).unwrap();
        let after = simulation.states().to_vec();
        let errors = simulation.time_errors().to_vec();
        simulation.take_back(&record);
        assert_eq!(simulation.states(), before);
        simulation.step(&mut record).unwrap();
        assert_eq!(simulation.states(), after);
        assert_eq!(simulation.time_errors(), errors);
    }
}

/// The estimate is 0.05 to 20 times the true error of smooth motion, at the reach of the body. It is
/// added up from local errors, so it misses those that cancel or grow.
#[test]
fn the_error_of_the_time_step_is_estimated() {
    for (name, text, time) in [
        ("oblique slide", oblique_slide(), 0.4),
        ("spin and slide", spin_and_slide(), 0.4),
        ("pendulum", pendulum(), 1.0),
        ("top", top(), 0.2),
    ] {
        let exact = at(&text, time, 0.0002);
        let mut coarse = simulation(&text, 0.002);
        run(&mut coarse, time);
        let body = &coarse.world().bodies()[0];
        let (found, state, exact) = (coarse.time_errors()[0], coarse.state(), &exact[0]);
        let turned = (state.attitude - exact.attitude).norm() * 2.0 * body.reach();
        let error = (state.position - exact.position).norm() + turned;
        assert!((0.05..20.0).contains(&(found / error)), "{name}: {found:e} for {error:e}");
    }
}

#[test]
fn a_run_may_be_split_at_any_state() {
    // The velocities of the instant start another run of the same motion, to second order.
    let text = oblique_slide();
    let whole = at(&text, 0.4, 0.002);
    let mut second = simulation(&text, 0.002);
    run(&mut second, 0.2);
    let states = second.states().to_vec();
    let mut fresh = simulation(&text, 0.002);
    fresh.set_states(&states).unwrap();
    run(&mut fresh, 0.2);
    let apart = distance(&whole, fresh.states());
    assert!(apart > 0.0 && apart <= 2e-5, "{apart:e}");
}

#[test]
fn velocities_of_the_instant_leave_out_impacts_and_stops() {
    let text = format!(
        "{GROUND}box = [0.2, 0.2, 0.2]\nmass = 1.0\nposition = [0, 0, 0.3]\nvelocity = [0.5, 0, 0]\n"
    );
    let mut simulation = simulation(&text, 0.002);
    let mut record = StepRecord::new();
    for _ in 0..400 {
        let was_moving = simulation.state().velocity.x;
        simulation.step(&mut record).unwrap();
        let State { velocity, .. } = *simulation.state();
        // Nothing rises, speeds up or turns back.
        assert!(velocity.z <= 1e-9, "step {}: {velocity}", record.index);
        assert!((-1e-9..=was_moving + 1e-9).contains(&velocity.x), "step {}", record.index);
    }
    assert!(simulation.state().velocity.norm() <= 1e-9);
}

#[test]
fn a_controller_at_the_instant_is_of_second_order() {
    // A spring that the program computes from the present state: x″ = −ω² x.
    let end = |h: f64| {
        let text = format!(
            "gravity = 0\n{NO_GROUND}[[bodies]]\nname = \"body\"\nsphere = 0.1\nmass = 1.0\n\
             position = [1, 0, 0]\n"
        );
        let mut simulation = simulation(&text, h);
        simulation.set_at_instant(true);
        let mut record = StepRecord::new();
        for _ in 0..(1.0 / h).round() as u64 {
            let force = -25.0 * simulation.state().position;
            simulation.set_wrench(0, Wrench { force, torque: Vector3::zeros() }).unwrap();
            simulation.step(&mut record).unwrap();
        }
        (simulation.state().position.x - 5f64.cos()).abs()
    };
    let order = (end(0.01) / end(0.005)).log2();
    assert!((order - 2.0).abs() <= 0.1, "{order}");
}

/// Gradients of a run agree with differences of runs, through the conversion of the start, inputs and
/// velocities of the instant at the end. Friction turns nowhere.
#[test]
fn gradients_are_those_of_differences() {
    let load = "load = { force = [[0.0, 0, 0, 0], [0.3, 4, 2, 1]], at = [0.05, 0.02, 0.1] }\n";
    let cases = [
        ("slide", slide(), 30),
        ("pendulum", sprung_pendulum(), 40),
        ("servo", servo(), 40),
        (
            "brick",
            format!(
                "{NO_GROUND}[[bodies]]\nname = \"body\"\nbox = [0.2, 0.3, 0.4]\nmass = 2.0\nposition = [0, 0, 5]\nspin = [3, -2, 4]\n{load}"
            ),
            30,
        ),
        (
            "rolling against a moment",
            format!(
                "{GROUND}ellipsoid = [0.1, 0.08, 0.05]\nmass = 1.0\nrolling_friction = 0.005\nposition = [0, 0, 0.05]\n\
                 velocity = [3, 1, 0]\nspin = [2, 3, 1]\n"
            ),
            40,
        ),
        (
            "landing",
            format!(
                "{GROUND}sphere = 0.1\nmass = 1.0\nposition = [0, 0, 0.13]\nvelocity = [0, 0, -0.5]\n"
            ),
            60,
        ),
    ];
    for (name, text, steps) in cases {
        let scene = scene(&text, 0.002);
        let weights = StateChange::from_array(&[
            0.3, -0.2, 0.5, 0.4, -0.1, 0.2, 0.7, 0.1, -0.4, 0.2, 0.5, -0.3,
        ]);
        let begin = |states: &[State]| {
            let motion = scene.motion(&scene.world).unwrap();
            let mut simulation =
                Simulation::new(scene.world.clone(), states.to_vec(), motion).unwrap();
            scene.prepare(&mut simulation).unwrap();
            simulation
        };
        let push = |simulation: &mut Simulation<'_>, along: f64| {
            let force =
                Vector3::new(0.2 + if simulation.index() == 0 { along } else { 0.0 }, 0.0, 0.1);
            simulation.set_wrench(0, Wrench { force, torque: Vector3::zeros() })
        };
        let base = scene.starts.clone();
        let end_of = |states: &[State], along: f64| {
            let mut simulation = begin(states);
            let mut record = StepRecord::new();
            for _ in 0..steps {
                push(&mut simulation, along).unwrap();
                simulation.step(&mut record).unwrap();
            }
            simulation.states()[0]
        };
        let reference = end_of(&base, 0.0);
        let value = |end: &State| weights.dot(&StateChange::between(&reference, end));
        let mut simulation = begin(&base);
        let mut before = |simulation: &mut Simulation<'_>| push(simulation, 0.0);
        let mut by_states = |k: u64, _: &[State]| (k == steps).then(|| vec![weights]);
        let mut run = Run {
            steps,
            before: &mut before,
            by_states: &mut by_states,
            constants: &[],
            inputs: &[],
            checkpoints: Checkpoints::default(),
            smoothing: None,
            has_impact_times: false,
        };
        let found = simulation.gradient(&mut run).unwrap();
        assert_eq!(
            simulation.states()[0],
            reference,
            "{name}: the run is that without derivatives"
        );
        let numbers = found.states[0].to_array();
        for (k, number) in numbers.into_iter().enumerate().skip(6) {
            let size = 1e-5;
            let at = |by: f64| {
                let mut change = [0.0; 12];
                change[k] = by;
                let moved = StateChange::from_array(&change).applied(&base[0]);
                value(&end_of(&[moved], 0.0))
            };
            let expected = (at(size) - at(-size)) / (2.0 * size);
            assert!(
                (number - expected).abs() <= 1e-6 * (1.0 + expected.abs()),
                "{name} {k}: {number} {expected}"
            );
        }
        let size = 1e-3;
        let expected = (value(&end_of(&base, size)) - value(&end_of(&base, -size))) / (2.0 * size);
        let number = found.wrenches[0][0].force.x;
        assert!(
            (number - expected).abs() <= 1e-6 * (1.0 + expected.abs()),
            "{name}: {number} {expected}"
        );
    }
}

/// With impact times, the derivative of a bounce is that of the motion: the height of a ball that bounces
/// falls by e² times the change of its start, minus what the later impact takes.
#[test]
fn a_bounce_has_the_derivative_of_the_motion() {
    let (drop, e, time, h) = (0.5, 0.5, 0.5, 0.001);
    let text = format!(
        "[ground]\nfriction = 0.3\nrestitution = {e}\n[[bodies]]\nname = \"body\"\nsphere = 0.1\n\
         mass = 1.0\nposition = [0, 0, {}]\n",
        0.1 + drop
    );
    let steps = (time / h) as u64;
    let mut by_height = StateChange::from_array(&[0.0; 12]);
    by_height.position.z = 1.0;
    let found = |has_impact_times: bool| {
        let mut simulation = simulation(&text, h);
        let found =
            gradient_of_end(&mut simulation, steps, &[by_height], has_impact_times).unwrap();
        assert_eq!(found.untimed, u64::from(!has_impact_times));
        found.states[0].position.z
    };
    // z(t) = e v (t − t₁) − ½ g (t − t₁)² with v = √(2 g d) and t₁ = √(2 d/g).
    let height = |drop: f64| {
        let (speed, after) = ((2.0 * G * drop).sqrt(), time - (2.0 * drop / G).sqrt());
        e * speed * after - 0.5 * G * after * after
    };
    let expected = (height(drop + 1e-6) - height(drop - 1e-6)) / 2e-6;
    let motion = found(true);
    assert!((motion - expected).abs() <= 0.02 * expected.abs(), "{motion} {expected}");
    assert!((found(false) - expected).abs() > 0.5, "the derivative of the steps is another one");
}

/// A ball that turns on the ground with ω rolls with ²⁄₇ r ω once friction has stopped its slip, also with 0.2 rad
/// a step. The series (8e) is right to 2·10⁻⁹ there.
#[test]
fn a_fast_ball_rolls_at_its_speed() {
    let text = "[ground]\nfriction = 0.5\n[[bodies]]\nname = \"ball\"\nsphere = 0.1\nmass = 1.0\n\
                position = [0, 0, 0.1]\nspin = [0, 100, 0]\n";
    let end = at(text, 0.7, 0.002)[0];
    let speed = 2.0 / 7.0 * 0.1 * 100.0;
    assert!((end.velocity.x / speed - 1.0).abs() < 4e-9, "{}", end.velocity.x);
    assert!((end.spin.y * 0.1 / speed - 1.0).abs() < 4e-9, "{}", end.spin.y);
}

/// A horizontal top on a point turns about the vertical with m g l/(I ω), where I is that about its axis, if it begins
/// with this rate. 0.3 rad a step.
#[test]
fn a_fast_top_precesses_at_its_rate() {
    let (radius, arm, spin, h) = (0.05, 0.1, 300.0, 0.001);
    let rate = G * arm / (0.5 * radius * radius * spin);
    let text = format!(
        "[ground]\nnone = true\nfriction = 0\n[[bodies]]\nname = \"top\"\nmass = 0.5\n\
         cylinder = {{ length = 0.02, radius = {radius} }}\nposition = [{arm}, 0, 0]\n\
         attitude = {{ axis = [0, 1, 0], degrees = 90 }}\nvelocity = [0, {}, 0]\n\
         spin = [{}, 0, {spin}]\n[[joints]]\ntype = \"spherical\"\nbodies = \"top\"\nanchor = [0, 0, 0]\n",
        rate * arm,
        -rate
    );
    let end = at(&text, 1.0, h)[0];
    let turned = end.position.y.atan2(end.position.x);
    assert!((turned / rate - 1.0).abs() < 1e-4, "{turned} {rate}");
    assert!(end.position.z.abs() < 1e-4, "{}", end.position.z);
}
