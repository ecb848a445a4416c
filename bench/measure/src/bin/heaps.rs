//! How many steps of heaps are solved, and from which start: other seeds than those of any test.
//!
//! `cargo run --release -p tumble-measure --bin heaps` or, for another number of seeds, steps of a run and first seed,
//! `… -- 16 2500 101`; with the name of a scene (`boxes`, `sticks`, `balls`, `mixed`, `ratio`, `dense`,
//! `wall`) behind them, that scene alone.
//!
//! Exit code 2 for a bad argument. Steps that are not solved are what is counted here: they do not
//! change the code.

use nalgebra::{Vector3, Vector4};
use std::error::Error;
use std::process::ExitCode;
use std::time::Instant;
use tumble_core::contact::Plane;
use tumble_core::geometry::Piece;
use tumble_core::mechanics::{RigidBody, Rotation, State};
use tumble_core::simulation::random::Draws;
use tumble_core::simulation::{Motion, Simulation, StepRecord};
use tumble_core::step::StepStatus;
use tumble_core::world::{Parameters, World};

type BuiltHeap = (Vec<RigidBody>, Vec<State>);

/// Name, number of bodies, μ.
const SCENES: [(&str, usize, f64); 14] = [
    ("boxes", 10, 0.3),
    ("boxes", 10, 0.7),
    ("boxes", 10, 1.5),
    ("boxes", 25, 0.3),
    ("boxes", 25, 0.7),
    ("boxes", 25, 1.5),
    ("sticks", 25, 0.3),
    ("balls", 25, 0.5),
    ("mixed", 25, 0.5),
    ("ratio", 25, 0.5),
    ("boxes", 100, 0.5),
    ("dense", 100, 0.5),
    ("wall", 28, 0.3),
    ("wall", 28, 0.5),
];

fn at_rest(position: Vector3<f64>, attitude: Vector4<f64>) -> State {
    State { position, attitude, velocity: Vector3::zeros(), spin: Vector3::zeros() }
}

/// Bodies anyhow above each other, that fall with some speed and spin.
fn heap(
    name: &str,
    count: usize,
    draws: &mut Draws,
) -> Result<BuiltHeap, tumble_core::error::Error> {
    let (mut bodies, mut starts) = (Vec::new(), Vec::new());
    for index in 0..count {
        let places = [index % 3, index / 3 % 3, index / 9].map(|place| place as f64);
        let position = Vector3::new(-0.9, -0.9, 1.0) + 0.9 * Vector3::from(places);
        let mut around = |size: f64| size * (2.0 * draws.unit() - 1.0);
        let velocity = Vector3::from_fn(|_, _| around(1.0));
        let spin = Vector3::from_fn(|_, _| around(2.0));
        let half_sides = Vector3::from_fn(|_, _| 0.2 + around(0.05));
        let mass = if name == "ratio" { 10_f64.powf(around(2.0)) } else { 1.5 + around(0.5) };
        let shape = if name == "mixed" { index % 4 } else { 4 };
        let piece = match (name, shape) {
            ("sticks", _) | (_, 1) => Piece::cuboid(Vector3::new(0.4, 0.04, 0.04)),
            ("balls", _) | (_, 2) => Piece::sphere(0.175 + around(0.075)),
            (_, 3) => Piece::capsule(0.2, 0.1),
            _ => Piece::cuboid(half_sides),
        };
        bodies.push(RigidBody::solid(mass, &[piece?])?.0);
        let attitude = draws.attitude();
        starts.push(State { velocity, spin, ..at_rest(position, attitude) });
    }
    Ok((bodies, starts))
}

/// Boxes of 20 × 15 × 10 cm, layers of 25 so near each other that they fall on one another.
fn dense(count: usize, draws: &mut Draws) -> Result<BuiltHeap, tumble_core::error::Error> {
    let brick = RigidBody::solid_box(1.5, Vector3::new(0.1, 0.075, 0.05))?;
    let start = |index: usize| {
        let places = [index % 5, index / 5 % 5, index / 25].map(|place| place as f64);
        at_rest(Vector3::new(-0.6, -0.6, 0.3) + 0.32 * Vector3::from(places), draws.attitude())
    };
    Ok((vec![brick; count], (0..count).map(start).collect()))
}

/// A cube of 2 m and 10 kg thrown at a wall of bricks of 1 × 0.5 × 0.5 m and 20 kg, three in a row.
fn wall(count: usize, draws: &mut Draws) -> Result<BuiltHeap, tumble_core::error::Error> {
    let cube = RigidBody::solid_box(10.0, Vector3::repeat(1.0))?;
    let brick = RigidBody::solid_box(20.0, Vector3::new(0.495, 0.25, 0.25))?;
    let upright = Vector4::new(1.0, 0.0, 0.0, 0.0);
    let thrown = State {
        velocity: Vector3::new(0.0, 8.0, 0.0),
        spin: Vector3::new(0.0, -2.0, 1.0),
        ..at_rest(Vector3::new(0.0, -4.0, 2.5), draws.attitude())
    };
    let bricks = (0..count - 1).map(|index| {
        let (row, place) = (index / 3, (index % 3) as f64);
        let x = place - 1.0 + 0.5 * (row % 2) as f64;
        at_rest(Vector3::new(x, 0.0, 0.25 + 0.5 * row as f64), upright)
    });
    let starts = std::iter::once(thrown).chain(bricks).collect();
    Ok((std::iter::once(cube).chain(vec![brick; count - 1]).collect(), starts))
}

/// What the runs of a scene came to.
#[derive(Default)]
struct HeapCounts {
    contact: u32,
    retried: u32,
    failed: u32,
    wild: u32,
    /// Runs whose last step took no more iterations than one a body, from the first start.
    still: u32,
    /// Of steps that were not solved, m/s.
    worst: f64,
    /// m.
    overlap: f64,
    contacts: usize,
    /// s.
    slowest: f64,
    time: f64,
}

impl HeapCounts {
    fn add(&mut self, record: &StepRecord, seconds: f64) {
        self.contact += u32::from(record.report.status != StepStatus::Free);
        match record.report.status {
            StepStatus::Retried => self.retried += 1,
            StepStatus::Wild => self.wild += 1,
            StepStatus::Failed => {
                self.failed += 1;
                self.worst = self.worst.max(record.certificate.residual());
            }
            _ => {}
        }
        self.overlap = self.overlap.max(record.overlap);
        self.contacts = self.contacts.max(record.contacts.len());
        self.slowest = self.slowest.max(seconds);
        self.time += seconds;
    }
}

fn run(
    (name, count, friction): (&str, usize, f64),
    (seeds, steps): (std::ops::Range<u32>, u32),
) -> Result<HeapCounts, tumble_core::error::Error> {
    let mut counts = HeapCounts::default();
    for seed in seeds {
        let draws = &mut Draws::new(seed);
        let (bodies, starts) = match name {
            "dense" => dense(count, draws)?,
            "wall" => wall(count, draws)?,
            _ => heap(name, count, draws)?,
        };
        let world = World::new(Parameters {
            bodies,
            ground: Some(Plane::level()),
            gravity: Vector3::new(0.0, 0.0, -9.81),
            friction,
            time_step: 0.002,
            rotation: Rotation::Momentum,
        })?;
        let motion = Motion::native(&world);
        let mut simulation = Simulation::new(world, starts, motion)?;
        let mut record = StepRecord::new();
        for _ in 0..steps {
            let begin = Instant::now();
            simulation.step(&mut record)?;
            counts.add(&record, begin.elapsed().as_secs_f64());
        }
        let few = record.report.iterations as usize <= count;
        counts.still += u32::from(record.report.status == StepStatus::Converged && few);
    }
    Ok(counts)
}

fn main() -> Result<ExitCode, Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number = |place: usize, default: u32| match arguments.get(place) {
        Some(text) => text.parse().ok(),
        None => Some(default),
    };
    let known = |name: &String| SCENES.iter().any(|scene| scene.0 == name);
    let (Some(seeds @ 1..), Some(steps @ 1..), Some(first), true, ..=4) = (
        number(0, 4),
        number(1, 1000),
        number(2, 1),
        arguments.get(3).is_none_or(known),
        arguments.len(),
    ) else {
        eprintln!("usage: heaps [SEEDS [STEPS [FIRST_SEED [SCENE]]]], numbers of at least 1");
        return Ok(ExitCode::from(2));
    };
    println!(
        "scene    bodies  mu  contact steps  retried     wild   failed  worst failed  still  overlap  \
         contacts  slowest  a step"
    );
    let wanted = |scene: &&(&str, usize, f64)| arguments.get(3).is_none_or(|name| name == scene.0);
    for &scene in SCENES.iter().filter(wanted) {
        let counts = run(scene, (first..first.saturating_add(seeds), steps))?;
        let part = |number: u32| 100.0 * f64::from(number) / f64::from(counts.contact.max(1));
        println!(
            "{:8} {:6} {:3} {:14} {:7.2}% {:8} {:8} {:9.1e} m/s {:6} {:5.2} mm {:9} {:5.0} ms {:5.0} µs",
            scene.0,
            scene.1,
            scene.2,
            counts.contact,
            part(counts.retried),
            counts.wild,
            counts.failed,
            counts.worst,
            counts.still,
            1e3 * counts.overlap,
            counts.contacts,
            1e3 * counts.slowest,
            1e6 * counts.time / f64::from(seeds * steps),
        );
    }
    Ok(ExitCode::SUCCESS)
}
