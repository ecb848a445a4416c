//! Ipopt and the native solver on scenes of several bodies.
//!
//! The table shows iterations per contact step, step statuses, residuals, and the distance between
//! the final states of both solvers.
//!
//! `cargo run --release -p tumble-measure --bin ipopt_several [STEPS]`

use nalgebra::{Vector3, Vector4};
use std::time::Instant;
use tumble::solver::ipopt::{Formulation, IpoptSolver, Ladder, Rung};
use tumble_core::contact::Plane;
use tumble_core::error::Error;
use tumble_core::geometry::Piece;
use tumble_core::mechanics::{RigidBody, Rotation, State, Wrench};
use tumble_core::simulation::{Motion, Simulation, StepRecord};
use tumble_core::step::StepStatus;
use tumble_core::world::{Fixed, Parameters, World};

/// Scene: world, initial states and the force on its first body (N).
struct SeveralScene {
    name: &'static str,
    world: World,
    starts: Vec<State>,
    push: Vector3<f64>,
}

fn world(bodies: Vec<RigidBody>, gravity: f64, friction: f64) -> Result<World, Error> {
    let gravity = Vector3::new(0.0, 0.0, -gravity);
    let (ground, time_step) = (Plane::level(), 0.002);
    World::new(Parameters {
        bodies,
        ground: Some(ground),
        gravity,
        friction,
        time_step,
        rotation: Rotation::Momentum,
    })
}

fn at(position: [f64; 3]) -> State {
    State {
        position: position.into(),
        attitude: Vector4::new(1.0, 0.0, 0.0, 0.0),
        velocity: Vector3::zeros(),
        spin: Vector3::zeros(),
    }
}

fn cube(mass: f64, half_side: f64) -> Result<RigidBody, Error> {
    RigidBody::solid_box(mass, Vector3::repeat(half_side))
}

fn ball(mass: f64, radius: f64) -> Result<RigidBody, Error> {
    Ok(RigidBody::solid(mass, &[Piece::sphere(radius)?])?.0)
}

fn stack(count: usize, masses: impl Fn(usize) -> f64) -> Result<(World, Vec<State>), Error> {
    let bodies = (0..count).map(|i| cube(masses(i), 0.1)).collect::<Result<_, _>>()?;
    let starts = (0..count).map(|i| at([0.0, 0.0, 0.1 + 0.2 * i as f64])).collect();
    Ok((world(bodies, 9.81, 0.5)?, starts))
}

fn scenes() -> Result<Vec<SeveralScene>, Error> {
    let still = Vector3::zeros();
    let mut scenes = Vec::new();
    for (name, count) in [("stack of 2", 2), ("stack of 5", 5), ("stack of 10", 10)] {
        let (world, starts) = stack(count, |_| 1.0)?;
        scenes.push(SeveralScene { name, world, starts, push: still });
    }
    let (heavy, starts) = stack(2, |i| [1.0, 100.0][i])?;
    scenes.push(SeveralScene { name: "100 kg on 1 kg", world: heavy, starts, push: still });
    let (pushed, starts) = stack(2, |_| 1.0)?;
    let push = Vector3::new(25.0, 0.0, 0.0);
    scenes.push(SeveralScene { name: "stack of 2, lower one pulled", world: pushed, starts, push });
    let balls = world(vec![cube(2.0, 0.2)?, ball(0.5, 0.1)?], 9.81, 0.5)?;
    let starts = vec![at([0.0, 0.0, 0.2]), at([0.01, 0.02, 0.55])];
    scenes.push(SeveralScene { name: "ball falls on a box", world: balls, starts, push: still });
    let space = world(vec![cube(1.0, 0.1)?, cube(3.0, 0.1)?], 0.0, 0.3)?;
    let mut starts = vec![at([0.0, 0.0, 10.0]), at([0.25, 0.03, 10.05])];
    starts[0].velocity = Vector3::new(1.0, 0.0, 0.0);
    starts[0].spin = Vector3::new(0.3, 0.2, 0.5);
    scenes.push(SeveralScene {
        name: "two boxes meet in space",
        world: space,
        starts,
        push: still,
    });
    let thrown = (0..4).map(|_| cube(1.0, 0.1)).collect::<Result<_, _>>()?;
    let starts = (0..4_u8)
        .map(|i| {
            let i = f64::from(i);
            let mut state = at([0.05 * i, 0.03 * i, 0.2 + 0.3 * i]);
            state.spin = Vector3::new(1.0 + i, -0.5 * i, 0.3);
            state
        })
        .collect();
    let thrown = world(thrown, 9.81, 0.5)?;
    scenes.push(SeveralScene {
        name: "4 boxes fall into a heap",
        world: thrown,
        starts,
        push: still,
    });
    let ramp = [[0.0, -1.0, 0.0], [2.0, -1.0, 0.0], [0.0, -1.0, 1.0]];
    let points: Vec<Vector3<f64>> = ramp
        .iter()
        .flat_map(|&[x, y, z]| [Vector3::new(x, y, z), Vector3::new(x, -y, z)])
        .collect();
    let piece = Piece::hull(&points, 0.0)?;
    let rolling = world(vec![ball(1.0, 0.1)?], 9.81, 0.5)?;
    let rolling = rolling.with_fixed(vec![Fixed { piece, friction: None }])?;
    let slope = Vector3::new(1.0, 0.0, 2.0).normalize();
    let on = Vector3::new(0.5, 0.0, 0.75) + slope * 0.1;
    let starts = vec![at(on.into())];
    scenes.push(SeveralScene {
        name: "ball rolls down a ramp",
        world: rolling,
        starts,
        push: still,
    });
    Ok(scenes)
}

/// Counts over a run.
#[derive(Default)]
struct SeveralTally {
    contact_steps: u32,
    iterations: u32,
    retried: u32,
    fallback: u32,
    failed: u32,
    residuals: Vec<f64>,
    seconds: f64,
}

fn run(
    scene: &SeveralScene,
    steps: u32,
    motion: Motion<'_>,
) -> Result<(SeveralTally, Vec<State>), Error> {
    let mut simulation =
        Simulation::new(scene.world.clone(), scene.starts.iter().copied(), motion)?;
    simulation.set_wrench(0, Wrench { force: scene.push, torque: Vector3::zeros() })?;
    let (mut record, mut tally, begin) =
        (StepRecord::new(), SeveralTally::default(), Instant::now());
    for _ in 0..steps {
        simulation.step(&mut record)?;
        if record.report.status == StepStatus::Free {
            continue;
        }
        tally.contact_steps += 1;
        tally.iterations += record.report.iterations;
        match record.report.status {
            StepStatus::Retried => tally.retried += 1,
            StepStatus::Fallback => tally.fallback += 1,
            StepStatus::Failed => tally.failed += 1,
            _ => {}
        }
        tally.residuals.push(record.certificate.residual());
    }
    tally.seconds = begin.elapsed().as_secs_f64();
    tally.residuals.sort_by(f64::total_cmp);
    Ok((tally, simulation.states().to_vec()))
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let steps = std::env::args().nth(1).map_or(Ok(200), |text| text.parse())?;
    println!(
        "| scene | contact steps | iterations a step | ms a step | retried | fallback | failed | \
         residual, median | largest | apart from native, m |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|");
    for scene in scenes()? {
        let options = IpoptSolver::options(1e-6, 300);
        let ipopt = IpoptSolver::new(&scene.world, Formulation::Reduced, options)?;
        let ladder = Ladder::new(&scene.world, ipopt, &Rung::ALL);
        let (tally, ours) = run(&scene, steps, Motion::contact(ladder))?;
        let (_, theirs) = run(&scene, steps, Motion::native(&scene.world))?;
        let apart = ours.iter().zip(&theirs).map(|(a, b)| (a.position - b.position).amax());
        let apart = apart.fold(0.0, f64::max);
        let count = f64::from(tally.contact_steps.max(1));
        let median = tally.residuals.get(tally.residuals.len() / 2).unwrap_or(&0.0);
        let largest = tally.residuals.last().unwrap_or(&0.0);
        println!(
            "| {} | {} | {:.1} | {:.1} | {} | {} | {} | {median:.1e} | {largest:.1e} | {apart:.1e} |",
            scene.name,
            tally.contact_steps,
            f64::from(tally.iterations) / count,
            tally.seconds / count * 1e3,
            tally.retried,
            tally.fallback,
            tally.failed,
        );
    }
    Ok(())
}
