//! Derivatives on the central path: a heavy-turning ball on the ground, whose products are solved by hand, and the exact step's as its
//! limit.

use super::{on_a_slope, scenario, step, transposes};
use nalgebra::{Matrix3, Vector3, Vector4};
use std::path::Path;
use tumble::contact::Plane;
use tumble::derivative::StateChange;
use tumble::geometry::Piece;
use tumble::mechanics::{RigidBody, Rotation, State, Wrench};
use tumble::simulation::{Simulation, StepRecord};
use tumble::solver::native::{Smoothing, StepChange, StepDerivative};
use tumble::world::{Constant, Parameters, World};

const MASS: f64 = 2.0;
const H: f64 = 0.002;
const G: f64 = 9.81;
/// That of the native solver's rule, which stays in the rows.
const COMPLIANCE: f64 = 1e-6;

/// A ball that next to nothing turns, `gap` above the ground.
fn ball(gap: f64, velocity: Vector3<f64>, friction: f64) -> (World, Vec<State>) {
    let moment = Matrix3::from_diagonal_element(5e4);
    let body = RigidBody::of_pieces(MASS, moment, vec![Piece::sphere(0.1).unwrap()]).unwrap();
    let parameters = Parameters {
        bodies: vec![body],
        ground: Some(Plane::new(Vector3::z(), 0.0).unwrap()),
        gravity: Vector3::new(0.0, 0.0, -G),
        friction,
        time_step: H,
        rotation: Rotation::Momentum,
    };
    let state = State {
        position: Vector3::new(0.0, 0.0, 0.1 + gap),
        attitude: Vector4::new(1.0, 0.0, 0.0, 0.0),
        velocity,
        spin: Vector3::zeros(),
    };
    (World::new(parameters).unwrap(), vec![state])
}

/// γ and β of (N7) where the ball would without them move by c off the ground and by w along it:
///
/// ```text
/// γ (c + (1 + ε) γ) = κ,   (w + (1 + ε) β) (β² − (μγ)²) = κ β
/// ```
///
/// as ψ = −μγη/β, put into μγψ + βη = κ. Between −μγ and 0 the left less the right of the second goes from one sign to the other.
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

/// v⁺ of the ball along x and z, from its velocities, its gap and μ.
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

/// Pressing, sliding, sticking and still in the air; by velocities, the height and μ.
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
                derivative.push(&change, &mut found).unwrap();
                let found = [found[0].velocity[0], found[0].velocity[2]];
                // By the height in 1/s; differences are good to nine digits, and the ball's rim turns by m r²/I = 4e-7 of what
                // friction does.
                let scale = expected.iter().fold(1.0_f64, |most, k| most.max(k.abs()));
                for (found, expected) in found.iter().zip(expected) {
                    let off = (found - expected).abs();
                    assert!(off <= 1e-6 * scale, "{at:?} {speed} {part}: {found} {expected}");
                }
            }
            // Neither the next piece of the law nor what is not yet a contact is near.
            assert!(derivative.margin() > 1.0, "{}", derivative.margin());
        }
    }
}

/// Before it touches it is pushed already, and more the nearer it is: what the exact step does not know.
#[test]
fn the_ground_is_felt_from_above() {
    let scene = ball(4e-4, Vector3::zeros(), 0.3);
    let height = [StateChange { position: Vector3::z(), ..StateChange::zero() }];
    let change = StepChange { states: &height, ..StepChange::default() };
    let by_height = |derivative: &mut StepDerivative| {
        let mut end = Vec::new();
        derivative.push(&change, &mut end).unwrap();
        end[0].velocity[2]
    };
    let (mut central, simulation, record) = centred(&scene, 1e-2);
    let mut exact = StepDerivative::new();
    simulation.linearise(&record, &mut exact).unwrap();
    assert_eq!(by_height(&mut exact), 0.0);
    assert!(by_height(&mut central) < -1e-3, "{}", by_height(&mut central));
}

/// As σ goes to 0 it is the exact derivative, where that has no kink near, and joins it as σ² does.
#[test]
fn its_limit_is_the_exact_derivative() {
    let scene = on_a_slope(0.5, 0.3, 1.0);
    let (simulation, record) = step(&scene.0, &scene.1, &[]).unwrap();
    let push = [Wrench { force: Vector3::new(1.0, 2.0, 3.0), torque: Vector3::zeros() }];
    let change = StepChange { wrenches: &push, ..StepChange::default() };
    let pushed = |derivative: &mut StepDerivative| {
        simulation.linearise(&record, derivative).unwrap();
        let mut end = Vec::new();
        derivative.push(&change, &mut end).unwrap();
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
fn transposed_it_is_the_same_matrix() {
    transposes(&StepDerivative::smoothed(Smoothing::CentralPath(1e-3)).unwrap());
}

/// Whatever touches, rests, rolls or is held, there is a point of the path in every step, between masses that differ by much too.
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
