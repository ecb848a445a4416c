//! Forces that the laws leave open: derivatives follow the selection rule that shares them.

use super::{Direction, apart, difference, size, step};
use crate::common::prelude::*;
use std::path::Path;
use tumble_scene::scene::Scene;

/// Two capsules that lie in line, are joined by a ball joint and slide across: five vertical forces
/// for four equations. Their shares decide the friction. The shares of a step are those of ε = 1e-6,
/// to first order, so that its differences have an error of a few 1e-6 too.
#[test]
fn two_capsules_on_a_ball_joint_that_slide() {
    let capsule = |name: &str, x: f64, speed: f64| {
        format!(
            "[[bodies]]\nname = \"{name}\"\nmass = 0.2\nposition = [{x}, 0, 0.03]\n\
             velocity = [0, {speed}, 0]\ncapsule = {{ length = 0.15, radius = 0.03 }}\n\
             attitude = {{ axis = [0, 1, 0], degrees = 90 }}\n"
        )
    };
    let text = format!(
        "time_step = 1e-3\n[ground]\nfriction = 0.4\n{}{}[[joints]]\nname = \"j\"\n\
         type = \"spherical\"\nbodies = [\"b\", \"a\"]\nanchor = [0.2, 0, 0.03]\n",
        capsule("a", 0.1, 0.2),
        capsule("b", 0.3, 0.7),
    );
    let none = |_: &Path, _: u64| Ok(Vec::new());
    let scene = Scene::from_text(&text, Path::new("s.toml"), &[], &none);
    let scene = super::differentiable(scene.unwrap());
    let (world, states) = (&scene.world, &scene.starts[..]);
    let (simulation, base) = step(world, states, &[]).unwrap();
    let mut derivative = StepDerivative::new();
    simulation.linearise(&base, &mut derivative).unwrap();
    for (constant, sizes) in
        [(Constant::TimeStep, [1e-5, 3e-6]), (Constant::Friction, [1e-4, 1e-5])]
    {
        let along = Direction {
            name: format!("{constant:?}"),
            states: vec![StateChange::zero(); 2],
            wrenches: vec![],
            constants: vec![(constant, vec![1.0])],
        };
        let constants: Vec<_> = along.constants.iter().map(|(c, n)| (*c, &n[..])).collect();
        let change = StepChange { constants: &constants, ..StepChange::default() };
        let mut found = Vec::new();
        derivative.jvp(&change, &mut found).unwrap();
        for by in sizes {
            let ends = (states, base.next_states());
            let (expected, _) = difference(world, ends, &along, by).unwrap();
            let (off, scale) = (apart(&found, &expected), size(&expected));
            assert!(off < 5e-6 * scale, "{}, {by:e}: {off:e} of {scale}", along.name);
        }
    }
}

/// Checks the links of a chain on the ground, joined by ball joints. Each link adds one vertical
/// force more than equations. Either the derivative agrees with differences, or it is marked as one
/// that keeps its forces.
///
/// Long differences meet kinks and short ones rounding, up to 2e-6. So the best of three counts.
#[test]
fn links_of_a_chain_on_the_ground() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/chain.toml");
    let text = std::fs::read_to_string(&path).unwrap();
    let none = |_: &Path, _: u64| Ok(Vec::new());
    let scene = Scene::from_text(&text, &path, &[], &none).unwrap();
    let scene = super::differentiable(scene);
    let world = &scene.world;
    let motion = Motion::native(world);
    let mut simulation = Simulation::new(world.clone(), scene.starts.clone(), motion).unwrap();
    let (mut record, mut draws, mut compared) = (StepRecord::new(), Draws::new(3), 0);
    for _ in 0..28 {
        for _ in 0..50 {
            simulation.step(&mut record).unwrap();
        }
        let states = simulation.states().to_vec();
        let (one, base) = step(world, &states, &[]).unwrap();
        let mut derivative = StepDerivative::new();
        one.linearise(&base, &mut derivative).unwrap();
        let moved = states.iter().map(|_| {
            let mut draw = || Vector3::from_fn(|_, _| 2.0 * draws.unit() - 1.0);
            StateChange { velocity: draw(), spin: draw(), ..StateChange::zero() }
        });
        let along = Direction {
            name: "velocities".into(),
            states: moved.collect(),
            wrenches: vec![],
            constants: vec![],
        };
        let change = StepChange { states: &along.states, ..StepChange::default() };
        let mut found = Vec::new();
        derivative.jvp(&change, &mut found).unwrap();
        let off = [1e-4, 1e-5, 1e-6].map(|by| {
            let ends = (&states[..], base.next_states());
            let (expected, _) = difference(world, ends, &along, by).unwrap();
            apart(&found, &expected) / size(&expected)
        });
        let least = off.into_iter().fold(f64::INFINITY, f64::min);
        compared += u32::from(!derivative.keeps_shares());
        assert!(least < 2e-6 || derivative.keeps_shares(), "k = {}: {off:?}", record.index);
    }
    assert!(compared > 5, "{compared}");
}
