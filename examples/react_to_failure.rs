//! Reaction of a program to failed steps. The drop scene is solved by Ipopt alone, with an
//! iteration limit so low that steps fail. The program takes failed steps back and repeats them
//! with the native solver. It counts the most violated law of each failure.
//!
//! `cargo run --release --example react_to_failure` or, with another limit, `cargo run --release
//! --example react_to_failure -- 300`
//!
//! Exit code 3 if a step stays unsolved, 2 for a bad number.

use std::collections::BTreeMap;
use std::process::ExitCode;
use tumble::solver::ipopt::{IpoptSolver, TOLERANCE};
use tumble::{
    Error, Motion, Simulation, StepRecord, StepStatus, TutorialScene, World, tutorial_parameters,
};

/// Number of steps: the fall and the first impacts.
const STEPS: u64 = 400;

fn main() -> Result<ExitCode, Error> {
    let argument = std::env::args().nth(1);
    let Ok(limit) = argument.as_deref().unwrap_or("20").parse() else {
        eprintln!("a limit of iterations from 0 to 1000000 is needed, for example: 20");
        return Ok(ExitCode::from(2));
    };
    let scene = TutorialScene::drop();
    let world = World::new(tutorial_parameters()?)?;
    let options = IpoptSolver::options(TOLERANCE, limit);
    let ipopt = Motion::contact(IpoptSolver::new(&world, options)?);
    let mut native = Motion::native(&world);
    let start = scene.start(scene.attitude(42));
    let mut simulation = Simulation::new(world, [start], ipopt)?;
    let mut record = StepRecord::new();

    let (mut contact, mut repeated, mut unsolved) = (0, 0, 0);
    let mut laws = BTreeMap::<&str, u32>::new();
    let mut worst = 0.0_f64;
    for _ in 0..STEPS {
        simulation.step(&mut record)?;
        if record.status() == StepStatus::Failed {
            let before = *record.certificate();
            *laws.entry(before.worst_part()).or_default() += 1;
            simulation.take_back(&record);
            simulation.swap_motion(&mut native);
            simulation.step(&mut record)?;
            simulation.swap_motion(&mut native);
            repeated += 1;
            if repeated <= 5 {
                println!(
                    "step {}: {} violated by {:.1e} m/s; repeated: {:.1e} m/s",
                    record.index,
                    before.worst_part(),
                    before.residual(),
                    record.residual(),
                );
            }
        }
        contact += u32::from(record.status() != StepStatus::Free);
        unsolved += u32::from(record.status() == StepStatus::Failed);
        worst = worst.max(record.residual());
    }
    println!("{STEPS} steps, {contact} in contact, at most {limit} iterations of Ipopt each");
    for (law, count) in &laws {
        println!("failed by the {law}: {count}");
    }
    println!("repeated {repeated}, unsolved {unsolved}, largest residual {worst:.1e} m/s");
    Ok(ExitCode::from(if unsolved > 0 { 3 } else { 0 }))
}
