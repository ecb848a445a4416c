//! Derivatives by the joint forces and motor targets of every step against differences of batches.

use std::num::NonZeroUsize;
use std::path::Path;
use tumble::rollout::{
    Batch, By, Cotangents, Gradients, RolloutError, RolloutOutputs, RolloutWatch, gradients,
    roll_out,
};
use tumble_core::error::Error;
use tumble_scene::scene::Scene;

/// More than the steps of one segment of the backward pass.
const STEPS: usize = 40;
const ROLLOUTS: usize = 2;

const ARM: &str = "
    time_step = 0.005
    [ground]
    none = true
    friction = 0.5
    [[bodies]]
    name = \"upper\"
    box = [0.5, 0.03, 0.03]
    mass = 1
    position = [0.25, 0, 1]
    [[bodies]]
    name = \"lower\"
    box = [0.4, 0.03, 0.03]
    mass = 0.8
    position = [0.7, 0, 1]
    [[joints]]
    name = \"shoulder\"
    type = \"revolute\"
    bodies = \"upper\"
    anchor = [0, 0, 1]
    axis = [0, 1, 0]
    [[joints]]
    name = \"elbow\"
    type = \"revolute\"
    bodies = [\"lower\", \"upper\"]
    anchor = [0.5, 0, 1]
    axis = [0, 1, 0]
    [[motors]]
    joint = \"elbow\"
    position = 0
    stiffness = 5
    damping = 0.2
    max_force = 100
    ";

fn scene(text: &str) -> Scene {
    let read = |_: &Path, _: u64| Ok(Vec::new());
    let scene = Scene::from_text(text, Path::new("arm.toml"), &[], &read);
    super::differentiable(scene.unwrap())
}

/// Inputs of a batch of the arm.
#[derive(Clone)]
struct Inputs {
    motors: Vec<f64>,
    joint_forces: Vec<f64>,
}

impl Inputs {
    fn new() -> Self {
        let wave = |count: usize, size: f64| {
            (0..count * STEPS).map(move |k| size * (k as f64 * 0.7).sin()).collect()
        };
        // The forces are shared by the rollouts.
        Self { motors: wave(ROLLOUTS, 0.3), joint_forces: wave(2, 2.0) }
    }

    fn with_batch<T>(&self, scene: &Scene, work: impl FnOnce(&Batch<'_>) -> T) -> T {
        let starts: Vec<f64> =
            scene.starts.iter().flat_map(|state| state.to_vector().as_slice().to_vec()).collect();
        work(&Batch {
            world: &scene.world,
            motion: &|world| scene.motion(world),
            loads: &scene.loads,
            courses: &scene.courses,
            index: 0,
            rollouts: ROLLOUTS,
            steps: STEPS,
            starts: &starts,
            controls: &[],
            motors: &self.motors,
            joint_forces: &self.joint_forces,
            parameters: &[],
        })
    }

    fn gradients(&self, scene: &Scene, by_ends: &[f64]) -> Result<Gradients, RolloutError> {
        let (by, threads) = (By::default(), NonZeroUsize::MIN);
        self.with_batch(scene, |batch| {
            gradients(batch, Cotangents::Ends(by_ends), by, threads, RolloutWatch::default())
        })
    }

    /// Height and speed along z of the lower body at the end of each rollout.
    fn ends(&self, scene: &Scene) -> Vec<f64> {
        let mut ends = vec![0.0; ROLLOUTS * 26];
        let outputs = RolloutOutputs { ends: &mut ends, ..RolloutOutputs::default() };
        let threads = NonZeroUsize::MIN;
        self.with_batch(scene, |batch| roll_out(batch, outputs, threads, RolloutWatch::default()))
            .unwrap();
        ends.chunks_exact(26).map(|states| states[13 + 2] + states[13 + 9]).collect()
    }
}

#[test]
fn inputs_of_every_step_against_differences() {
    let (scene, inputs) = (scene(ARM), Inputs::new());
    let mut by_ends = vec![0.0; 24];
    (by_ends[12 + 2], by_ends[12 + 8]) = (1.0, 1.0);
    let found = inputs.gradients(&scene, &by_ends).unwrap();
    assert_eq!(found.motors.len(), ROLLOUTS * STEPS);
    assert_eq!(found.joint_forces.len(), ROLLOUTS * STEPS * 2);
    assert!(found.motors.iter().chain(&found.joint_forces).all(|slope| *slope != 0.0));
    // The error of the difference is of order size², that of the rounded steps 1e-11 over the size.
    for size in [1e-2, 1e-3, 1e-4] {
        for step in [0, 7, 16, 39] {
            let apart = |change: &dyn Fn(&mut Inputs, f64)| {
                let at = |by: f64| {
                    let mut moved = inputs.clone();
                    change(&mut moved, by);
                    moved.ends(&scene)
                };
                let (ahead, back) = (at(size), at(-size));
                let each = ahead.iter().zip(&back);
                each.map(|(ahead, back)| (ahead - back) / (2.0 * size)).collect::<Vec<_>>()
            };
            let allowed = 0.2 * size * size + 1e-10 / size;
            let motors = apart(&|inputs, by| {
                (0..ROLLOUTS).for_each(|rollout| inputs.motors[rollout * STEPS + step] += by);
            });
            for (rollout, expected) in motors.iter().enumerate() {
                let slope = found.motors[rollout * STEPS + step];
                assert!((slope - expected).abs() < allowed, "{size} {step}: {slope} {expected}");
            }
            for axis in 0..2 {
                let forces = apart(&|inputs, by| inputs.joint_forces[2 * step + axis] += by);
                for (rollout, expected) in forces.iter().enumerate() {
                    let slope = found.joint_forces[2 * (rollout * STEPS + step) + axis];
                    assert!(
                        (slope - expected).abs() < allowed,
                        "{size} {step}: {slope} {expected}"
                    );
                }
            }
        }
    }
}

#[test]
fn without_inputs_there_are_none() {
    let scene = scene(ARM);
    let inputs = Inputs { motors: Vec::new(), joint_forces: Vec::new() };
    let found = inputs.gradients(&scene, &[1.0; 24]).unwrap();
    assert!(found.motors.is_empty() && found.joint_forces.is_empty());
    assert_eq!(found.controls.len(), ROLLOUTS * STEPS * 12);
}

#[test]
fn a_motor_of_a_gear_beside_a_spring_is_refused() {
    let gear = "
        [[gears]]
        joints = [\"shoulder\", \"elbow\"]
        drive = { stiffness = 1 }
        motor = { position = 0, stiffness = 1, max_force = 1 }
        ";
    let scene = scene(&(ARM.to_owned() + gear));
    let inputs = Inputs { motors: vec![0.0; 2 * STEPS], joint_forces: Vec::new() };
    let refused = inputs.gradients(&scene, &[1.0; 24]).unwrap_err();
    assert!(matches!(refused.error, Error::Unsupported { .. }), "{refused}");
    // Without motors there are derivatives.
    let inputs = Inputs { motors: Vec::new(), ..inputs };
    assert!(inputs.gradients(&scene, &[1.0; 24]).is_ok());
}
