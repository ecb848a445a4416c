//! Complete runs of the native solver against the exact trajectories of `data/exact`. A different
//! program computed these with a different method.

use crate::common::prelude::*;
use crate::common::{reference, state};
use crate::toss::{motion_apart, native_run, pose_apart, worst_residual};
use serde::Deserialize;

#[derive(Deserialize)]
struct Index {
    runs: Vec<Run>,
}

/// One run of `data/exact/index.json`.
#[derive(Deserialize)]
struct Run {
    file: String,
    inertia: [[f64; 3]; 3],
    mass: f64,
    half_side: f64,
    mu: f64,
    gravity: f64,
    h: f64,
    rows: usize,
    start: Vec<f64>,
    max_residual: f64,
    end_position: [f64; 3],
    end_attitude: [f64; 4],
    growth: f64,
}

impl Run {
    fn world(&self) -> World {
        let inertia = Matrix3::from_fn(|row, column| self.inertia[row][column]);
        let half_sides = Vector3::repeat(self.half_side);
        let body = RigidBody::with_box_corners(self.mass, inertia, half_sides).unwrap();
        let gravity = Vector3::new(0.0, 0.0, -self.gravity);
        let (friction, time_step) = (self.mu, self.h);
        let (bodies, ground) = (vec![body], Plane::level());
        World::new(Parameters {
            bodies,
            ground: Some(ground),
            gravity,
            friction,
            time_step,
            rotation: Rotation::Tutorial,
        })
        .unwrap()
    }

    /// Steps of the native solver.
    fn solve(&self, world: &World) -> Vec<StepRecord> {
        native_run(world, state(&self.start), self.rows - 1)
    }

    /// Exact rows in the file, with their indices.
    fn exact_rows(&self) -> Vec<(usize, State)> {
        let text = reference(&format!("exact/{}", self.file));
        let mut reader = csv::Reader::from_reader(text.as_bytes());
        let rows = reader.deserialize::<(usize, Vec<f64>)>();
        rows.map(|row| row.unwrap()).map(|(k, x)| (k, state(&x[..13]))).collect()
    }
}

fn runs() -> Vec<Run> {
    serde_json::from_str::<Index>(&reference("exact/index.json")).unwrap().runs
}

/// Row `k` of a run.
fn row(steps: &[StepRecord], k: usize) -> State {
    *steps.get(k).map_or_else(|| steps[k - 1].next(), |step| step.state())
}

/// Compares poses and velocities of the native runs with the exact ones.
///
/// Both sides solve every step to rounding, 4e-12 m/s. No run amplifies a change of its start more
/// than 370 times: 1e-9. The remaining error is in the motion of a sliding face, which is a limit
/// of vanishing compliance. The native solver takes it from a compliance of 1e-6. So the motion of
/// a step has an error of up to 1e-6 times an impulse of a few m/s. A slide lasts for tens of
/// steps. The tolerance for poses is 1e-7. Velocities change in a step as a pose does in a tenth of
/// a second, so their tolerance is 1e-6 m/s.
#[test]
fn every_run_passes_through_the_exact_poses_and_ends_in_the_exact_one() {
    let runs = runs();
    assert_eq!(runs.len(), 11);
    for run in &runs {
        assert!(run.max_residual < 1e-12 && run.growth <= 370.0, "{}", run.file);
        let (world, exact) = (run.world(), run.exact_rows());
        let steps = run.solve(&world);
        assert_eq!((exact.len(), exact.last().unwrap().0), (101, run.rows - 1));
        for (k, exact) in &exact {
            let ours = row(&steps, *k);
            let (pose, motion) = (pose_apart(&ours, exact), motion_apart(&world, &ours, exact));
            assert!(pose < 1e-7, "{}, row {k}: pose by {pose:e}", run.file);
            assert!(motion < 1e-6, "{}, row {k}: motion by {motion:e}", run.file);
        }
        let end = row(&steps, run.rows - 1);
        let (position, attitude) = (run.end_position.into(), run.end_attitude.into());
        let exact = State { position, attitude, ..end };
        let apart = pose_apart(&end, &exact);
        assert!(apart < 1e-7, "{}: the end by {apart:e}", run.file);
    }
}

/// Checks the residual of every step. The rounding of z⁺/h is 4e-13 m/s: 4 roundings of heights of
/// 1 m in 2 ms. The tolerance leaves room for more than ten times as much.
#[test]
fn every_step_of_these_runs_is_exact() {
    for run in runs() {
        let worst = worst_residual(&run.solve(&run.world()));
        assert!(worst < 1e-10, "{}: {worst:e}", run.file);
    }
}

/// Checks that the first stage solves more than 99 of 100 contact steps, starting from the last
/// impulses. The average is below three iterations. Rest and straight slides need fewer, because
/// their impulses repeat.
#[test]
fn first_stage_solves_nearly_every_step_from_the_last_impulses() {
    for run in runs() {
        let mut contact = run.solve(&run.world());
        contact.retain(|step| step.status() != StepStatus::Free);
        let again = |step: &&StepRecord| step.status() != StepStatus::Converged;
        let retried = contact.iter().filter(again).count();
        let iterations: u32 = contact.iter().map(|step| step.report().iterations).sum();
        let steps = contact.len();
        assert!(steps > 600 && 100 * retried < steps, "{}: {retried} of {steps}", run.file);
        assert!(f64::from(iterations) < 3.0 * steps as f64, "{}: {iterations}", run.file);
    }
}
