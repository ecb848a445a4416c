//! Time and memory of terrain: loading, and steps of rolling bodies compared with those on a plane.
//!
//! Run `cargo run --release -p tumble-measure --bin terrain`, optionally with the number of cells
//! along a side and of steps: `… -- 1000 4000`.
//!
//! The exit code is 3 if a step failed, 2 for a bad argument.

use nalgebra::{Matrix3, Vector3, Vector4};
use std::error::Error;
use std::process::ExitCode;
use std::sync::Arc;
use std::time::Instant;
use tumble_core::contact::Plane;
use tumble_core::geometry::terrain::{HeightField, Surface};
use tumble_core::geometry::{Piece, Terrain};
use tumble_core::mechanics::{RigidBody, Rotation, State};
use tumble_core::simulation::{Motion, Simulation, StepRecord};
use tumble_core::step::StepStatus;
use tumble_core::world::{FixedTerrain, Parameters, World};

/// Number of rounds. The fastest counts, because the machine has other work.
const ROUNDS: usize = 5;
/// Number of runs in a round. The time of the processor is known to some ms.
const RUNS: usize = 10;
/// Side of a cell (m).
const CELL: f64 = 0.1;

fn world(piece: &Piece, ground: bool) -> Result<World, Box<dyn Error>> {
    let body = RigidBody::solid(1.0, std::slice::from_ref(piece))?.0;
    Ok(World::new(Parameters {
        bodies: vec![body],
        ground: ground.then(Plane::level),
        gravity: Vector3::new(0.0, 0.0, -9.81),
        friction: 0.5,
        time_step: 0.002,
        rotation: Rotation::Momentum,
    })?)
}

/// Fastest time of a step (µs), and whether all steps succeeded.
fn time(world: &World, start: State, steps: usize) -> Result<(f64, bool), Box<dyn Error>> {
    let (mut fastest, mut solved) = (f64::INFINITY, true);
    for _ in 0..ROUNDS {
        let clock = Clock::now();
        for _ in 0..RUNS {
            let mut run = Simulation::new(world.clone(), [start], Motion::native(world))?;
            let mut record = StepRecord::new();
            for _ in 0..steps {
                run.step(&mut record)?;
                solved &= record.report.status != StepStatus::Failed;
            }
        }
        fastest = fastest.min(clock.seconds());
    }
    Ok((fastest / (RUNS * steps) as f64 * 1e6, solved))
}

/// Time of the processor for this program, or of the wall where the system does not tell it.
struct Clock {
    wall: Instant,
    busy: Option<f64>,
}

impl Clock {
    fn now() -> Self {
        Self { wall: Instant::now(), busy: busy() }
    }

    fn seconds(&self) -> f64 {
        let busy = self.busy.zip(busy()).map(|(from, to)| to - from);
        busy.unwrap_or_else(|| self.wall.elapsed().as_secs_f64())
    }
}

/// Time that this program has had a processor (s).
fn busy() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/self/schedstat").ok()?;
    Some(text.split(' ').next()?.parse::<f64>().ok()? * 1e-9)
}

/// Memory of this process (MB), 0 where it is unknown.
fn memory() -> f64 {
    const PAGE: f64 = 4096.0;
    let pages = std::fs::read_to_string("/proc/self/statm").ok();
    let resident = pages.and_then(|text| text.split(' ').nth(1)?.parse::<f64>().ok());
    resident.map_or(0.0, |pages| pages * PAGE / 1e6)
}

fn heights(cells: usize, height: impl Fn(f64, f64) -> f64) -> Vec<f64> {
    let side = cells + 1;
    let place = |index: usize| index as f64 * CELL;
    (0..side * side).map(|at| height(place(at % side), place(at / side))).collect()
}

/// Makes a terrain, and prints the time and the memory that this takes.
fn loaded<T: Into<Terrain>>(
    name: &str,
    make: impl FnOnce() -> Result<T, tumble_core::error::Error>,
) -> Result<Arc<Terrain>, Box<dyn Error>> {
    let before = memory();
    let clock = Clock::now();
    let terrain: Terrain = make()?.into();
    let seconds = clock.seconds();
    let triangles = terrain.count();
    println!("{name:<16}{triangles:>9} triangles, {seconds:6.2} s, {:6.0} MB", memory() - before);
    Ok(Arc::new(terrain))
}

fn main() -> Result<ExitCode, Box<dyn Error>> {
    let numbers: Result<Vec<usize>, _> = std::env::args().skip(1).map(|n| n.parse()).collect();
    let [cells, steps] = match numbers.as_deref() {
        Ok([]) => [1000, 4000],
        Ok(&[cells, steps]) if cells > 1 && steps > 0 => [cells, steps],
        _ => {
            eprintln!("two numbers are needed: cells along a side, from 2, and steps, from 1");
            return Ok(ExitCode::from(2));
        }
    };
    let wave = |x: f64, y: f64| 0.05 * (0.9 * x).sin() * (0.7 * y).cos();
    let field = |height: fn(f64, f64) -> f64| {
        HeightField::new(heights(cells, height), cells + 1, [CELL; 2])
    };
    let level = loaded("level field", || field(|_, _| 0.0))?;
    let rough =
        loaded("wavy field", || HeightField::new(heights(cells, wave), cells + 1, [CELL; 2]))?;
    let mesh = loaded("wavy mesh", || {
        let from = Terrain::from(HeightField::new(heights(cells, wave), cells + 1, [CELL; 2])?);
        let side = cells + 1;
        let vertices = heights(cells, wave).into_iter().enumerate();
        let vertices = vertices
            .map(|(at, z)| Vector3::new((at % side) as f64 * CELL, (at / side) as f64 * CELL, z));
        let wide = cells;
        let triangles = (0..from.count()).map(|triangle| {
            let cell = triangle / 2;
            let first = cell / wide * side + cell % wide;
            let across = first + side + 1;
            match triangle % 2 {
                0 => [first, first + 1, across].map(|vertex| vertex as u32),
                _ => [first, across, across - 1].map(|vertex| vertex as u32),
            }
        });
        Surface::new(vertices.collect(), triangles.collect())
    })?;
    let quarter = std::f64::consts::FRAC_PI_2;
    let turn = Matrix3::new(1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 1.0, 0.0);
    let wheel = Piece::cylinder(0.05, 0.15, 24)?.moved_by(&turn, &Vector3::zeros())?;
    let cases = [("ball", Piece::sphere(0.15)?, 0.15), ("wheel", wheel, 0.15)];
    let mut solved = true;
    let middle = 0.5 * cells as f64 * CELL;
    for (name, piece, height) in &cases {
        let speed = 2.0;
        let start = |above: f64| State {
            position: Vector3::new(middle + 0.037, middle + 0.021, height + above),
            attitude: Vector4::new((quarter / 8.0).cos(), 0.0, 0.0, (quarter / 8.0).sin()),
            velocity: Vector3::new(
                speed * (quarter / 4.0).cos(),
                speed * (quarter / 4.0).sin(),
                0.0,
            ),
            spin: Vector3::new(0.0, speed / height, 0.0),
        };
        let (plane, fine) = time(&world(piece, true)?, start(0.0), steps)?;
        solved &= fine;
        println!("{name} on the plane: {plane:.2} µs a step");
        let lifted = 0.06;
        for (kind, terrain, above) in [
            ("level field", &level, 0.0),
            ("wavy field", &rough, lifted),
            ("wavy mesh", &mesh, lifted),
        ] {
            let fixed = FixedTerrain { terrain: Arc::clone(terrain), friction: None };
            let world = world(piece, false)?.with_terrains(vec![fixed])?;
            let (micros, fine) = time(&world, start(above), steps)?;
            solved &= fine;
            println!("  {kind:<14}{micros:8.2} µs a step, {:.2} times", micros / plane);
        }
    }
    println!("memory at the end: {:.0} MB", memory());
    Ok(ExitCode::from(if solved { 0 } else { 3 }))
}
