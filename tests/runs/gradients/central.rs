//! Derivatives on the central path. A ball with large inertia on the ground has products that are
//! solved by hand. The limit is the derivative of the exact step.

use super::{on_a_slope, scenario, step, transposes};
use crate::common::prelude::*;
use std::path::Path;
use tumble_core::solver::native::Smoothing;

const MASS: f64 = 2.0;
const H: f64 = 0.002;
const G: f64 = 9.81;
/// Compliance of the native solver's selection rule, which remains in the rows.
const COMPLIANCE: f64 = 1e-6;

/// Ball with a huge inertia, `gap` [m] above the ground.
fn ball(gap: f64, velocity: Vector3<f64>, friction: f64) -> (World, Vec<State>) {
    let moment = Matrix3::from_diagonal_element(5e4);
    let body = RigidBody::from_pieces(MASS, moment, vec![Piece::sphere(0.1).unwrap()]).unwrap();
    let parameters = Parameters {
        ground: Some(Plane::new(Vector3::z(), 0.0).unwrap()),
        friction,
        ..Parameters::new(vec![body])
    };
    let state = State { velocity, ..State::at_rest(Vector3::new(0.0, 0.0, 0.1 + gap)) };
    (euler(parameters), vec![state])
}

/// Solution γ and β of (N7), if without them the ball would move with c off the ground and with w
/// along it:
///
/// ```text
/// γ (c + (1 + ε) γ) = κ,   (w + (1 + ε) β) (β² − (μγ)²) = κ β
/// ```
///
/// The second equation is ψ = −μγη/β, inserted into μγψ + βη = κ. Its left side minus the right
/// changes sign between −μγ and 0.
fn impulse(c: f64, w: f64, friction: f64, kappa: f64) -> (f64, f64) {
    let give = 1.0 + COMPLIANCE;
    let root = (c * c + 4.0 * give * kappa).sqrt();
    let normal = if c > 0.0 { 2.0 * kappa / (c + root) } else { (root - c) / (2.0 * give) };
    let most = friction * normal;
    let off = |beta: f64| (w.abs() + give * beta) * (beta * beta - most * most) - kappa * beta;
    let (mut low, mut high) = (-most, 0.0);
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if off(middle) > 0.0 { low = middle } else { high = middle }
    }
    (normal, 0.5 * (low + high) * w.signum())
}

/// Velocity v⁺ of the ball along x and z, from its velocities, its gap and μ.
fn end([x, z, gap, friction]: [f64; 4], kappa: f64) -> [f64; 2] {
    let (c, w) = (gap / H + z - H * G, x);
    let (normal, along) = impulse(c, w, friction, kappa);
    [w + along, z - H * G + normal]
}

fn centred(
    scene: &(World, Vec<State>),
    speed: f64,
) -> (StepDerivative, Simulation<'static>, StepRecord) {
    let (simulation, record) = step(&scene.0, &scene.1, &[]).unwrap();
    let mut derivative = StepDerivative::smoothed(Smoothing::CentralPath(speed)).unwrap();
    simulation.linearise(&record, &mut derivative).unwrap();
    (derivative, simulation, record)
}

/// Checks the derivatives of a ball that presses, slides, sticks or is in the air, by velocities,
/// height and μ.
#[test]
fn a_ball_on_the_central_path_has_its_derivatives() {
    for (gap, x, z, friction) in [
        (0.0, 0.5, 0.0, 0.3),
        (0.0, 0.003, 0.0, 0.5),
        (0.0, 0.01, -1.0, 0.4),
        (4e-4, 0.3, -0.1, 0.3),
        (4e-4, -0.4, -0.25, 0.6),
    ] {
        let scene = ball(gap, Vector3::new(x, 0.0, z), friction);
        for speed in [3e-4, 3e-3, 3e-2] {
            let (mut derivative, ..) = centred(&scene, speed);
            let at = [x, z, gap, friction];
            for part in 0..4 {
                let by = 1e-5 * [1.0, 1.0, H, 1.0][part];
                let moved = |by: f64| {
                    let mut at = at;
                    at[part] += by;
                    end(at, speed * speed)
                };
                let [near, far] = [by, 2.0 * by].map(|by| {
                    let (a, b) = (moved(by), moved(-by));
                    [0, 1].map(|k| (a[k] - b[k]) / (2.0 * by))
                });
                let expected = [0, 1].map(|k| (4.0 * near[k] - far[k]) / 3.0);

                let mut state = StateChange::zero();
                let one = [1.0];
                let mut constants: Vec<(Constant, &[f64])> = Vec::new();
                match part {
                    0 => state.velocity[0] = 1.0,
                    1 => state.velocity[2] = 1.0,
                    2 => state.position[2] = 1.0,
                    _ => constants.push((Constant::Friction, &one)),
                }
                let (states, mut found) = ([state], Vec::new());
                let change = StepChange { states: &states, constants: &constants, wrenches: &[] };
                derivative.jvp(&change, &mut found).unwrap();
                let found = [found[0].velocity[0], found[0].velocity[2]];
                // The derivative by height has the unit 1/s. Differences have nine correct digits.
                // The rim of the ball turns by m r²/I = 4e-7 of the friction's effect.
                let scale = expected.iter().fold(1.0_f64, |most, k| most.max(k.abs()));
                for (found, expected) in found.iter().zip(expected) {
                    let off = (found - expected).abs();
                    assert!(off <= 1e-6 * scale, "{at:?} {speed} {part}: {found} {expected}");
                }
            }
            // Neither the next piece of the law nor a new contact is near.
            assert!(derivative.margin() > 1.0, "{}", derivative.margin());
        }
    }
}

/// Checks the derivatives of a bouncing ball. In (29) e times the speed before the impact replaces
/// the gap: δv⁺ = δv + δγ with γ (c + (1 + ε) γ) = κ and c = (1 + e) v − h g.
#[test]
fn a_ball_that_bounces_has_its_derivatives() {
    let (restitution, z) = (0.5, -1.0);
    let (world, states) = ball(0.0, Vector3::new(0.0, 0.0, z), 0.0);
    let scene = (world.with_coefficient(Coefficient::Restitution, restitution).unwrap(), states);
    for speed in [1e-3, 1e-1] {
        let (mut derivative, _, record) = centred(&scene, speed);
        assert!((record.next_states()[0].velocity[2] - 0.5).abs() < 1e-9);
        let kappa = speed * speed;
        let after = |z: f64, e: f64| {
            let c = z - H * G + e * z;
            z - H * G + impulse(c, 1.0, 0.0, kappa).0
        };
        let by = 1e-5;
        let fast = StateChange { velocity: Vector3::z(), ..StateChange::zero() };
        let (one, mut found) = ([1.0], Vec::new());
        let change = StepChange { states: &[fast], ..StepChange::default() };
        derivative.jvp(&change, &mut found).unwrap();
        let slope = (after(z + by, restitution) - after(z - by, restitution)) / (2.0 * by);
        assert!((found[0].velocity[2] - slope).abs() < 1e-7, "{found:?} {slope}");
        let constants: [(Constant, &[f64]); 1] = [(Constant::Restitution, &one)];
        let change = StepChange { constants: &constants, ..StepChange::default() };
        derivative.jvp(&change, &mut found).unwrap();
        let slope = (after(z, restitution + by) - after(z, restitution - by)) / (2.0 * by);
        assert!((found[0].velocity[2] - slope).abs() < 1e-7, "{found:?} {slope}");
    }
}

/// Checks two balls with mass ratios of up to ten thousand, in either order, without gravity.
/// Impulses are divided by M, the geometric mean of both masses. So γ (c + (w + ε) γ) = κ, with the
/// separation speed c and w = M/m₁ + M/m₂.
#[test]
fn two_balls_push_each_other_by_their_mean_mass() {
    for masses in [[2.0, 2.0], [0.01, 100.0], [100.0, 0.01]] {
        let of = |mass: f64| RigidBody::solid(mass, &[Piece::sphere(0.1).unwrap()]).unwrap().0;
        let parameters = Parameters {
            ground: None,
            gravity: Vector3::zeros(),
            friction: 0.0,
            ..Parameters::new(masses.map(of).to_vec())
        };
        let state = |x: f64, speed: f64| State {
            velocity: Vector3::new(speed, 0.0, 0.0),
            ..State::at_rest(Vector3::new(x, 0.0, 0.0))
        };
        let scene = (euler(parameters), vec![state(0.0, 0.3), state(0.2, -0.1)]);
        let speed = 1e-2;
        let (mut derivative, ..) = centred(&scene, speed);
        let mean = (masses[0] * masses[1]).sqrt();
        let (kappa, c) = (speed * speed, -0.4);
        let response = mean / masses[0] + mean / masses[1] + COMPLIANCE;
        // dγ/dc = −γ/(c + 2 w γ).
        let root = f64::sqrt(c * c + 4.0 * response * kappa);
        let by_parting = -(root - c) / (2.0 * response) / root;
        let fast = StateChange { velocity: Vector3::x(), ..StateChange::zero() };
        let (states, mut found) = ([fast, StateChange::zero()], Vec::new());
        derivative
            .jvp(&StepChange { states: &states, ..StepChange::default() }, &mut found)
            .unwrap();
        // The first ball gets faster, so the balls separate more slowly and the impulse is larger.
        let pushed = -by_parting * mean;
        let expected = [1.0 - pushed / masses[0], pushed / masses[1]];
        for (found, expected) in found.iter().zip(expected) {
            let off = (found.velocity[0] - expected).abs();
            assert!(off <= 1e-9 * expected.abs().max(1.0), "{masses:?}: {found:?} {expected}");
        }
    }
}

/// Checks that the smoothed derivative has a force before the ball touches, larger at smaller
/// heights. The exact derivative has none.
/// Moments of contacts are not part of the path.
#[test]
fn rolling_friction_is_refused() {
    let (world, states) = ball(0.0, Vector3::x(), 0.5);
    let world = world.with_coefficient(Coefficient::RollingFriction, 0.01).unwrap();
    let (simulation, record) = step(&world, &states, &[]).unwrap();
    let mut central = StepDerivative::smoothed(Smoothing::CentralPath(1e-3)).unwrap();
    let said = simulation.linearise(&record, &mut central).unwrap_err().to_string();
    assert!(said.contains("central path") && said.contains("use compliance"), "{said}");
    let mut soft = StepDerivative::smoothed(Smoothing::Compliance(1e-5)).unwrap();
    simulation.linearise(&record, &mut soft).unwrap();
}

#[test]
fn central_path_has_a_force_above_the_ground() {
    let scene = ball(4e-4, Vector3::zeros(), 0.3);
    let height = [StateChange { position: Vector3::z(), ..StateChange::zero() }];
    let change = StepChange { states: &height, ..StepChange::default() };
    let by_height = |derivative: &mut StepDerivative| {
        let mut end = Vec::new();
        derivative.jvp(&change, &mut end).unwrap();
        end[0].velocity[2]
    };
    let (mut central, simulation, record) = centred(&scene, 1e-2);
    let mut exact = StepDerivative::new();
    simulation.linearise(&record, &mut exact).unwrap();
    assert_eq!(by_height(&mut exact), 0.0);
    assert!(by_height(&mut central) < -1e-3, "{}", by_height(&mut central));
}

/// Checks that for σ → 0 the derivative approaches the exact one like σ², far from kinks.
#[test]
fn central_path_derivative_converges_to_the_exact_one() {
    let scene = on_a_slope(0.5, 0.3, 1.0);
    let (simulation, record) = step(&scene.0, &scene.1, &[]).unwrap();
    let push = [Wrench { force: Vector3::new(1.0, 2.0, 3.0), torque: Vector3::zeros() }];
    let change = StepChange { wrenches: &push, ..StepChange::default() };
    let pushed = |derivative: &mut StepDerivative| {
        simulation.linearise(&record, derivative).unwrap();
        let mut end = Vec::new();
        derivative.jvp(&change, &mut end).unwrap();
        end[0].velocity
    };
    let exact = pushed(&mut StepDerivative::new());
    let off = [1e-3, 1e-4, 1e-5].map(|speed| {
        let mut derivative = StepDerivative::smoothed(Smoothing::CentralPath(speed)).unwrap();
        (pushed(&mut derivative) - exact).norm() / exact.norm()
    });
    assert!(off[0] < 0.3 && off[1] < 2e-2 * off[0] && off[2] < 2e-2 * off[1] + 1e-5, "{off:?}");
}

#[test]
fn central_path_vjp_is_the_transposed_jvp() {
    transposes(&StepDerivative::smoothed(Smoothing::CentralPath(1e-3)).unwrap());
}

/// Checks that a point of the path exists for steps of all shipped scenes: contact, rest, rolling
/// and joints, also with large mass ratios.
#[test]
fn every_shipped_scene_has_points_of_the_path() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios");
    let mut names: Vec<_> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .filter(|name| name.ends_with(".toml") && name != "floating.toml")
        .collect();
    names.sort();
    assert!(names.len() > 20, "{names:?}");
    for name in names {
        let scene = scenario(&name);
        let mut run = scene.simulation(&Default::default()).unwrap();
        let mut record = StepRecord::new();
        for k in 0..scene.rows.min(120) - 1 {
            run.step(&mut record).unwrap();
            if k % 40 != 20 {
                continue;
            }
            for speed in [1e-4, 1e-3, 1e-2] {
                let mut derivative =
                    StepDerivative::smoothed(Smoothing::CentralPath(speed)).unwrap();
                let found = run.linearise(&record, &mut derivative);
                assert!(found.is_ok(), "{name} {k} {speed}: {found:?}");
            }
        }
    }
}

#[test]
fn speeds_out_of_range_are_refused() {
    for refused in [0.0, -1.0, 11.0, f64::NAN] {
        assert!(StepDerivative::smoothed(Smoothing::CentralPath(refused)).is_err());
    }
}
