//! Gradients of runs with the default integrator against differences of the same runs: random bodies
//! that land, slide, roll, turn about joints and push others.

use super::draw::Draw;
use super::gradient_of_end;
use nalgebra::{Vector3, Vector4};
use rand_mt::Mt;
use std::fmt::{self, Write as _};
use std::path::Path;
use tumble_core::derivative::StateChange;
use tumble_core::simulation::{Motion, Simulation, StepRecord};
use tumble_scene::scene::Scene;

/// Length of a run (s).
const DURATION: f64 = 0.2;
/// Largest error of a derivative, relative to the largest one.
const ALLOWED: f64 = 1e-6;
/// Sizes of differences. The smallest one has rounding errors below [`ALLOWED`].
const SIZES: [f64; 3] = [1e-5, 3e-6, 1e-6];

fn list(values: &[f64]) -> String {
    let numbers: Vec<_> = values.iter().map(|value| format!("{value:.9}")).collect();
    format!("[{}]", numbers.join(", "))
}

fn shape(draw: &mut Draw) -> String {
    let mut size = || draw.within(0.03, 0.1);
    let [a, b, c] = [size(), size(), size()];
    match (draw.within(0.0, 6.999)) as u32 {
        0 => format!("box = {}", list(&[a, b, c])),
        1 => format!("sphere = {a:.9}"),
        2 => format!("capsule = {{ length = {:.9}, radius = {b:.9} }}", 2.0 * a),
        3 => format!("cylinder = {{ length = {:.9}, radius = {b:.9} }}", 2.0 * a),
        4 => format!("cone = {{ height = {:.9}, radius = {b:.9} }}", 2.0 * a),
        5 => format!("ellipsoid = {}", list(&[a, b, c])),
        _ => format!("box = {}", list(&[a, a, a])),
    }
}

fn body(name: &str, place: &Vector3<f64>, turn: &Vector4<f64>, draw: &mut Draw) -> String {
    let (velocity, spin) = (draw.vector(1.0), draw.vector(8.0));
    let mut text = format!(
        "[[bodies]]\nname = \"{name}\"\n{}\nmass = {:.9}\nposition = {}\nattitude = {}\n\
         velocity = {}\nspin = {}\n",
        shape(draw),
        draw.within(0.3, 2.0),
        list(place.as_slice()),
        list(turn.as_slice()),
        list(velocity.as_slice()),
        list(spin.as_slice()),
    );
    if draw.within(0.0, 1.0) < 0.2 {
        let _ = writeln!(text, "rolling_friction = {:.9}", draw.within(0.001, 0.01));
    }
    text
}

/// A random scene.
fn scene(draw: &mut Draw) -> String {
    let h = [0.001, 0.002, 0.004][draw.within(0.0, 2.999) as usize];
    let friction = draw.within(0.1, 0.8);
    let mut text = format!("time_step = {h}\n[ground]\nfriction = {friction:.9}\n");
    match draw.within(0.0, 4.0) as u32 {
        0 => writeln!(text, "restitution = {:.9}", draw.within(0.2, 0.9)),
        1 => writeln!(text, "static_friction = {:.9}", friction + 0.2),
        _ => Ok(()),
    }
    .unwrap();
    let place = Vector3::new(0.0, 0.0, draw.within(0.22, 0.32));
    let (kind, turn) = (draw.within(0.0, 1.0), draw.attitude());
    text += &body("a", &place, &turn, draw);
    if kind < 0.2 {
        // A second body hangs on the first.
        let arm = draw.vector(0.1) + Vector3::new(0.3, 0.0, 0.1);
        let turn = draw.attitude();
        text += &body("b", &(place + arm), &turn, draw);
        let joint = ["spherical", "revolute", "fixed"][draw.within(0.0, 2.999) as usize];
        let axis = if joint == "revolute" { "axis = [0, 1, 0]\n" } else { "" };
        let _ = write!(
            text,
            "[[joints]]\ntype = \"{joint}\"\nbodies = [\"b\", \"a\"]\nanchor = {}\n{axis}",
            list((place + 0.5 * arm).as_slice()),
        );
    } else if kind < 0.35 {
        // A plate below it, which slides.
        let _ = write!(
            text,
            "[[bodies]]\nname = \"plate\"\nbox = [0.6, 0.6, 0.02]\nmass = 3.0\nposition = [0, 0, 0.02]\n\
             velocity = [0.3, 0.1, 0]\n"
        );
        text = text.replace(
            &format!("position = {}", list(place.as_slice())),
            &format!("position = {}", list(&[0.0, 0.0, place[2] + 0.06])),
        );
    }
    text
}

/// Numbers of runs.
#[derive(Debug, Default)]
struct Counts {
    runs: usize,
    /// Runs with a warning of the gradient, and with a kink within the differences.
    marked: usize,
    kinks: usize,
    /// Runs whose derivatives differ: seed, error and margin.
    wrong: Vec<String>,
}

impl fmt::Display for Counts {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { runs, marked, kinks, wrong } = self;
        write!(f, "{runs} runs, {marked} marked, {kinks} with a kink, {} wrong", wrong.len())?;
        wrong.iter().try_for_each(|of| write!(f, "\n{of}"))
    }
}

/// Simulation of the scene from changed states.
fn started(scene: &Scene, change: &[StateChange], by: f64) -> Simulation<'static> {
    let starts = scene.starts.iter().zip(change);
    let states: Vec<_> = starts.map(|(start, change)| change.scaled(by).applied(start)).collect();
    Simulation::new(scene.world.clone(), states, Motion::native(&scene.world)).unwrap()
}

impl Counts {
    fn add(&mut self, seed: u32) {
        let mut draw = Draw(Mt::new(seed));
        let text = scene(&mut draw);
        let none = |_: &Path, _: u64| Ok(Vec::new());
        let scene = Scene::from_text(&text, Path::new("s.toml"), &[], &none).unwrap();
        let bodies = scene.starts.len();
        let steps = (DURATION / scene.world.time_step()).round() as u64;
        let mut changes = |_: usize| StateChange::from_array(&std::array::from_fn(|_| draw.unit()));
        let mut direction: Vec<_> = (0..bodies).map(&mut changes).collect();
        let weights: Vec<_> = (0..bodies).map(&mut changes).collect();
        if !scene.world.joints().is_empty() {
            // Bodies of a joint move alike.
            let position = direction[0].position;
            let turn = Vector3::zeros();
            direction.iter_mut().for_each(|of| *of = StateChange { position, turn, ..*of });
        }
        self.runs += 1;
        let mut simulation = started(&scene, &direction, 0.0);
        let Ok(found) = gradient_of_end(&mut simulation, steps, &weights, false) else {
            self.marked += 1;
            return;
        };
        let middle = simulation.states().to_vec();
        let end = |by: f64| {
            let mut simulation = started(&scene, &direction, by);
            let mut record = StepRecord::new();
            (0..steps).for_each(|_| simulation.step(&mut record).unwrap());
            let ends = middle.iter().zip(simulation.states()).zip(&weights);
            ends.map(|((from, to), weight)| weight.dot(&StateChange::between(from, to)))
                .sum::<f64>()
        };
        let of: f64 = found.states.iter().zip(&direction).map(|(by, along)| by.dot(along)).sum();
        let scale =
            found.states.iter().flat_map(|by| by.to_array()).fold(1.0, |a: f64, b| a.max(b.abs()));
        let differences = SIZES.map(|size| (end(size) - end(-size)) / (2.0 * size));
        let off = |expected: &f64| (of - expected).abs() / scale;
        let least = differences.iter().map(off).fold(f64::INFINITY, f64::min);
        let apart = (differences[0] - differences[2]).abs() / scale;
        let is_marked = found.unsolved + found.unknown + found.kept > 0
            || found.margin.0.min(found.feature_margin.0) < 1e-9;
        if least <= ALLOWED {
            return;
        }
        if is_marked {
            self.marked += 1;
        } else if apart > ALLOWED {
            self.kinks += 1;
        } else {
            self.wrong.push(format!(
                "seed {seed}: {least:.1e}, differences apart {apart:.1e}, margins {:.1e} {:.1e}, untimed {}\n{text}",
                found.margin.0, found.feature_margin.0, found.untimed
            ));
        }
    }
}

#[test]
fn gradients_of_runs_are_those_of_their_differences() {
    let mut counts = Counts::default();
    (0..50).for_each(|seed| counts.add(seed));
    println!("{counts}");
    assert!(counts.wrong.is_empty(), "{counts}");
}

#[test]
#[ignore = "slow"]
fn many_drawn_runs() {
    let mut counts = Counts::default();
    (1000..1500).for_each(|seed| counts.add(seed));
    println!("{counts}");
    assert!(counts.wrong.len() <= 5, "{counts}");
}

/// Gradient of the last place of a ball along x by its start, and the number of impacts without a time.
fn by_start(h: f64, has_impact_times: bool) -> (StateChange, u64) {
    let text = format!(
        "time_step = {h}\n[ground]\nfriction = 1\n[[bodies]]\nname = \"ball\"\nsphere = 0.1\nmass = 1.0\n\
         position = [0, 0, {}]\nvelocity = [{SPEED}, 0, 0]\n",
        0.1 + DROP
    );
    let none = |_: &Path, _: u64| Ok(Vec::new());
    let scene = Scene::from_text(&text, Path::new("s.toml"), &[], &none).unwrap();
    let steps = (0.4 / h).round() as u64;
    let along = StateChange { position: Vector3::x(), ..StateChange::zero() };
    let mut simulation = started(&scene, &[StateChange::zero()], 0.0);
    let found = gradient_of_end(&mut simulation, steps, &[along], has_impact_times).unwrap();
    (found.states[0], found.untimed)
}

/// Height above the ground (m), and speed of a ball that lands and rolls (m/s): slow enough to roll after one step.
const DROP: f64 = 0.25;
const SPEED: f64 = 0.5;

/// A ball lands after t = √(2 z/g) and rolls with ⁵⁄₇ of its speed, so that dx/dz = ²⁄₇ v/(g t). The step knows
/// nothing of the time.
#[test]
fn a_landing_moves_with_the_height_of_its_start() {
    let time = (2.0 * DROP / 9.81).sqrt();
    let expected = 2.0 / 7.0 * SPEED / (9.81 * time);
    for h in [0.004, 0.002, 0.001] {
        let (moved, untimed) = by_start(h, true);
        assert_eq!(untimed, 0);
        assert!((moved.position[2] / expected - 1.0).abs() < 1e-6, "{h}: {moved:?} {expected}");
        let (still, untimed) = by_start(h, false);
        // The impact ends in the step after the one that closes the gap.
        assert!((1..=2).contains(&untimed), "{untimed}");
        assert!(still.position[2].abs() < 1e-9, "{h}: {still:?}");
    }
}
