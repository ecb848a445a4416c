//! Elastic bodies without friction. Impacts of rotating bodies conserve energy as accurately as the
//! scheme can, and conserve both momenta.

use crate::common::prelude::*;
use crate::common::turning::turned_momentum;
use std::io;
use std::path::Path;
use tumble_scene::scene::Scene;

/// Scene of a scenario's text.
fn scene(text: &str) -> Scene {
    let none = |_: &Path, _| Err(io::ErrorKind::NotFound.into());
    let scene = Scene::from_text(text, Path::new("elastic.toml"), &[], &none);
    let mut scene = scene.unwrap_or_else(|failure| panic!("{failure}"));
    // Momentum and energy are kept by the velocities of the steps.
    scene.use_integrator(Integrator::Euler);
    scene
}

/// Values of `of` for the states at the start and after each step, and the number of bounces. Every
/// step must be solved.
fn follow<T>(scene: &Scene, of: impl Fn(&World, &[State]) -> T) -> (Vec<T>, usize) {
    let motion = scene.motion(&scene.world).unwrap();
    let starts = scene.starts.iter().copied();
    let mut simulation = Simulation::new(scene.world.clone(), starts, motion).unwrap();
    let mut record = StepRecord::new();
    let mut bounces = 0;
    let mut found = vec![of(&scene.world, &scene.starts)];
    for _ in 1..scene.rows {
        simulation.step(&mut record).unwrap();
        let status = record.status();
        assert!(
            status.is_solved(),
            "k = {}: {status}, share {}",
            record.index,
            record.restitution_share()
        );
        bounces += record.first().contacts.iter().filter(|contact| contact.rebound > 0.0).count();
        found.push(of(&scene.world, record.next_states()));
    }
    (found, bounces)
}

/// Energy ½m|v + ½h g|² − ⅛mh²g² + ½π·I⁻¹π − m g·r of all bodies [J] with π = P⁻(ω). Free flight conserves it. The
/// rotational part oscillates slightly with the attitude.
fn energy(world: &World, states: &[State]) -> f64 {
    let (g, h) = (world.gravity(), world.time_step());
    let of = |(body, state): (&RigidBody, &State)| {
        let m = body.mass();
        let middle = state.velocity + 0.5 * h * g;
        let along = 0.5 * m * (middle.norm_squared() - 0.25 * h * h * g.norm_squared());
        let momentum = turned_momentum(body.inertia(), &state.spin, -h);
        let turning = 0.5 * momentum.dot(&(body.inertia_inverse() * momentum));
        along + turning - m * g.dot(&state.position)
    };
    world.bodies().iter().zip(states).map(of).sum()
}

/// Largest change of the energy, the mean of its last quarter minus the mean of the first, and the
/// number of bounces. Energies are relative to the start's.
fn kept(text: &str) -> (f64, f64, usize) {
    let (energies, bounces) = follow(&scene(text), energy);
    let first = energies[0];
    let largest = energies.iter().map(|e| (e - first).abs()).fold(0.0, f64::max);
    let quarter = energies.len() / 4;
    let mean = |part: &[f64]| part.iter().sum::<f64>() / part.len() as f64;
    let trend = mean(&energies[energies.len() - quarter..]) - mean(&energies[..quarter]);
    (largest / first, trend / first, bounces)
}

const BRICK: &str = r#"
[[bodies]]
name = "brick"
box = [0.2, 0.15, 0.1]
mass = 1.3
position = [0.0, 0.0, 0.5]
attitude = [0.8, 0.3, -0.4, 0.33]
velocity = [0.1, 0.0, 0.0]
spin = [3.0, -2.0, 4.0]
"#;

/// Restitution at any speed.
const ELASTIC: &str = "[ground]\nfriction = 0.0\nrestitution = 1.0\nrebound_speed = 0.0\n";

/// Checks a brick that bounces for 20 s from half a metre. At 2 ms its energy stays within a
/// thousandth and has no trend. The error decreases with h².
#[test]
fn an_elastic_brick_bounces_for_ever() {
    let run = |h: f64| {
        let steps = (20.0 / h).round() as usize + 1;
        kept(&format!("steps = {steps}\ntime_step = {h}\n{ELASTIC}{BRICK}"))
    };
    let (largest, trend, bounces) = run(0.002);
    assert!(bounces > 30, "{bounces} bounces");
    assert!(largest < 1e-3, "{largest} of the energy, trend {trend}");
    assert!(trend.abs() < 3e-4, "a trend of {trend}");
    // A sixteenth in theory. The motions differ after some impacts, so that other impacts have the
    // largest error.
    let (finer, ..) = run(0.0005);
    assert!(finer < 0.25 * largest, "{finer} after {largest}");
}

/// Checks that one impact of a spinning cube on a corner conserves energy to second order. For a
/// cube the momentum form conserves the rotational part exactly.
#[test]
fn an_impact_of_a_spinning_cube_keeps_its_energy() {
    let run = |h: f64| {
        let steps = (0.12 / h).round() as usize + 1;
        let cube = r#"
            [[bodies]]
            name = "cube"
            box = [0.2, 0.2, 0.2]
            mass = 1.0
            position = [0.0, 0.0, 0.3]
            attitude = [0.8, 0.3, -0.4, 0.33]
            velocity = [0.3, 0.0, -2.0]
            spin = [12.0, 7.0, -9.0]
        "#;
        kept(&format!("steps = {steps}\ntime_step = {h}\n{ELASTIC}{cube}"))
    };
    let coarse = run(0.002);
    assert!(coarse.2 >= 1, "it does not bounce");
    assert!(coarse.0 < 1e-3, "{coarse:?}");
    let fine = run(0.001);
    assert!(fine.0 < 0.4 * coarse.0 || fine.0 < 1e-9, "{fine:?} after {coarse:?}");
}

/// Checks two bricks that collide in free space. Both momenta are conserved to rounding, the energy
/// to a thousandth.
#[test]
fn two_elastic_bricks_in_free_space_keep_everything() {
    let text = r#"
        steps = 501
        time_step = 0.002
        gravity = 0.0
        [ground]
        none = true
        friction = 0.0
        restitution = 1.0
        rebound_speed = 0.0
        [[bodies]]
        name = "left"
        box = [0.2, 0.15, 0.1]
        mass = 1.0
        position = [-0.3, 0.0, 0.0]
        attitude = [0.8, 0.3, -0.4, 0.33]
        velocity = [1.0, 0.1, 0.0]
        spin = [5.0, -3.0, 6.0]
        [[bodies]]
        name = "right"
        box = [0.2, 0.15, 0.1]
        mass = 2.0
        position = [0.3, 0.05, 0.03]
        attitude = [0.9, -0.2, 0.3, 0.25]
        velocity = [-0.7, 0.0, 0.1]
        spin = [-4.0, 2.0, 3.0]
    "#;
    let scene = scene(text);
    let all = |world: &World, states: &[State]| {
        let of = |(body, state): (&RigidBody, &State)| {
            let (p, turn) = (body.mass() * state.velocity, rotation(&state.attitude));
            let spin = turn * turned_momentum(body.inertia(), &state.spin, -world.time_step());
            (p, state.position.cross(&p) + spin)
        };
        let each = world.bodies().iter().zip(states).map(of);
        let add = |(p, l): (Vector3<f64>, Vector3<f64>), (q, m)| (p + q, l + m);
        let (p, l) = each.fold((Vector3::zeros(), Vector3::zeros()), add);
        (p, l, energy(world, states))
    };
    let (kept, bounces) = follow(&scene, all);
    assert!(bounces > 0, "they do not meet");
    let (p, l, e) = &kept[0];
    for (k, (momentum, moment, energy)) in kept.iter().enumerate() {
        assert!((momentum - p).amax() < 1e-12, "k = {k}: {momentum:?}");
        assert!((moment - l).amax() < 1e-11, "k = {k}: {:?}", moment - l);
        assert!((energy - e).abs() < 1e-3 * e, "k = {k}: {energy} J of {e}");
    }
}
