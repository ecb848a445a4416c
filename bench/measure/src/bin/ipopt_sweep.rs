//! Ipopt path on variants of the drop scene with other friction, mass, inertia, load and size.
//!
//! Each variant is a row of `docs/ipopt-path.md`. `cargo run --release -p tumble-measure --bin
//! ipopt_sweep -- 42 1 7` takes about a minute per seed.

use nalgebra::{Matrix3, Vector3};
use std::process::ExitCode;
use tumble::solver::ipopt::{IpoptSolver, Ladder, MOST_ITERATIONS, Rung, TOLERANCE};
use tumble_core::error::Error;
use tumble_core::mechanics::{RigidBody, State, Wrench};
use tumble_core::simulation::scene::{self, TutorialScene};
use tumble_core::simulation::summary::RunSummary;
use tumble_core::simulation::{Motion, Simulation, StepRecord};
use tumble_core::world::{Parameters, World};

/// Variant of the drop scene with other constants.
#[derive(Clone, Copy)]
struct Variant {
    friction: f64,
    mass: f64,
    /// Moment of inertia about every axis (kg m²); `None` for a solid cube.
    inertia: Option<f64>,
    /// Vertical force (N), world frame.
    force: f64,
    /// Scale of lengths; times scale with its square root.
    size: f64,
}

const TUTORIAL: Variant = Variant {
    friction: scene::FRICTION,
    mass: scene::CUBE_MASS,
    inertia: Some(scene::CUBE_INERTIA),
    force: 0.0,
    size: 1.0,
};
const SOLID: Variant = Variant { inertia: None, ..TUTORIAL };

fn variants() -> Vec<(String, Variant)> {
    let mut all = vec![("the drop scene".to_owned(), TUTORIAL)];
    for friction in [0.0, 0.001, 0.03, 0.1, 0.6, 1.0, 3.0, 10.0] {
        all.push((format!("μ {friction}"), Variant { friction, ..TUTORIAL }));
        all.push((format!("μ {friction}, solid"), Variant { friction, ..SOLID }));
    }
    for mass in [1e-3, 0.2, 1e3, 1e6] {
        all.push((format!("{mass} kg, solid"), Variant { mass, ..SOLID }));
    }
    for inertia in [0.1, 1.0, 100.0] {
        all.push((format!("I {inertia}"), Variant { inertia: Some(inertia), ..TUTORIAL }));
    }
    for force in [80.0, -1e3, -1e4, -1e5] {
        all.push((format!("load {force} N, solid"), Variant { force, ..SOLID }));
    }
    for size in [5e-4, 0.05, 50.0] {
        all.push((format!("side {} m, solid", 2.0 * size), Variant { size, ..SOLID }));
    }
    all
}

fn run(variant: &Variant, seed: u32) -> Result<RunSummary, Error> {
    let Variant { friction, mass, inertia, force, size } = *variant;
    let (scene, time) = (TutorialScene::drop(), size.sqrt());
    let half_sides = Vector3::repeat(scene::CUBE_HALF_SIDE * size);
    let body = match inertia {
        None => RigidBody::solid_box(mass, half_sides)?,
        Some(moment) => {
            let inertia = Matrix3::from_diagonal_element(moment);
            RigidBody::with_box_corners(mass, inertia, half_sides)?
        }
    };
    let original = scene::tutorial_parameters()?;
    let time_step = original.time_step * time;
    let world = World::new(Parameters { bodies: vec![body], friction, time_step, ..original })?;
    let start = scene.start(scene.attitude(seed));
    let start = State {
        position: start.position * size,
        attitude: start.attitude,
        velocity: start.velocity * (size / time),
        spin: start.spin / time,
    };
    let options = IpoptSolver::options(TOLERANCE, MOST_ITERATIONS);
    let ipopt = IpoptSolver::new(&world, options)?;
    let motion = Motion::contact(Ladder::new(&world, ipopt, &Rung::ALL));
    let mut simulation = Simulation::new(world, [start], motion)?;
    let force = Vector3::new(0.0, 0.0, force);
    simulation.set_wrench(0, Wrench { force, torque: Vector3::zeros() })?;
    let (mut record, mut summary) = (StepRecord::new(), RunSummary::default());
    for _ in 1..scene.rows {
        simulation.step(&mut record)?;
        summary.add(&record);
    }
    Ok(summary)
}

fn main() -> ExitCode {
    let seeds: Result<Vec<u32>, _> = std::env::args().skip(1).map(|seed| seed.parse()).collect();
    let Ok(seeds) = seeds else {
        eprintln!("seeds from 0 to 4294967295 are needed, for example: 42 1");
        return ExitCode::from(2);
    };
    println!("| scene | seed | contact steps | iterations a step | retried | fallback | failed |");
    println!("|---|---|---|---|---|---|---|");
    for (name, variant) in variants() {
        for &seed in &seeds {
            match run(&variant, seed) {
                Ok(summary) => println!(
                    "| {name} | {seed} | {} | {:.1} | {} | {} | {} |",
                    summary.contact_steps(),
                    summary.iterations as f64 / summary.contact_steps().max(1) as f64,
                    summary.retried,
                    summary.fallback,
                    summary.failed,
                ),
                Err(error) => {
                    eprintln!("{name}: {error}");
                    return ExitCode::FAILURE;
                }
            }
        }
    }
    ExitCode::SUCCESS
}
