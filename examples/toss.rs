//! The tutorial's cube, tossed on the ground and simulated by the native solver. Every step has a
//! certificate, whose residual (m/s) is zero for an exact step.
//!
//! `cargo run --release --example toss`

use tumble::{
    Error, Motion, Simulation, StepRecord, StepStatus, TutorialScene, World, tutorial_parameters,
};

fn main() -> Result<(), Error> {
    let scene = TutorialScene::drop();
    let world = World::new(tutorial_parameters()?)?;
    let motion = Motion::native(&world);
    let start = scene.start(scene.attitude(42));
    let mut simulation = Simulation::new(world, [start], motion)?;
    let mut record = StepRecord::new();
    let (mut contact, mut failed, mut worst) = (0, 0, 0.0_f64);
    for _ in 1..scene.rows {
        simulation.step(&mut record)?;
        contact += u32::from(record.status() != StepStatus::Free);
        failed += u32::from(record.status() == StepStatus::Failed);
        worst = worst.max(record.residual());
        if record.index.is_multiple_of(100) {
            let height = record.state().position.z;
            let force = record.first().solution.total_force(0).z;
            println!("step {:3}  height {height:.3} m  force {force:5.1} N", record.index);
        }
    }
    let lowest = simulation.world().lowest_height(simulation.states());
    println!("{contact} steps in contact, {failed} failed, largest residual {worst:.1e} m/s");
    println!("the lowest corner ends {lowest:.1e} m above the ground");
    Ok(())
}
