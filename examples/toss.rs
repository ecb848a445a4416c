//! The tutorial's cube, tossed on the ground and simulated by the native solver. Every step
//! comes with a certificate: how far it is from an exact solution, in m/s.
//!
//! `cargo run --release --example toss`

use tumble::error::Error;
use tumble::world::ContactModel;
use tumble::simulation::scene::{Scene, tutorial_parameters};
use tumble::simulation::{Motion, Simulation};
use tumble::step::StepStatus;

fn main() -> Result<(), Error> {
    let scene = Scene::drop();
    let model = ContactModel::new(tutorial_parameters()?)?;
    let motion = Motion::native(&model);
    let start = scene.start(scene.attitude(42));
    let mut simulation = Simulation::new(model, start, motion)?;
    let mut record = simulation.record();
    let (mut contact, mut failed, mut worst) = (0, 0, 0.0_f64);
    for _ in 1..scene.rows {
        simulation.step(&mut record)?;
        contact += u32::from(record.report.status != StepStatus::Free);
        failed += u32::from(record.report.status == StepStatus::Failed);
        worst = worst.max(record.certificate.worst());
        if record.index % 100 == 0 {
            let height = record.state.position.z;
            let force: f64 = record.solution.forces().map(|force| force.z).sum();
            println!("step {:3}  height {height:.3} m  force {force:5.1} N", record.index);
        }
    }
    let lowest = simulation.model().lowest_height(&simulation.state());
    println!("{contact} steps in contact, {failed} failed, worst certificate {worst:.1e} m/s");
    println!("the lowest corner ends {lowest:.1e} m above the ground");
    Ok(())
}
