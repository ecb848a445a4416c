//! Random assemblies: the verdict of statics against the simulator from rest.

use super::Scene;
use super::draw::WideDraw;
use super::sizes;
use nalgebra::Vector3;
use tumble::statics::{LoadCase, Structure, Verdict};
use tumble::{Motion, Simulation, StepRecord, Wrench};

/// Shares of the largest factor that are tried: λ is 1 % and more away from 1.
const SHARES: [f64; 8] = [0.5, 0.8, 0.95, 0.985, 1.015, 1.05, 1.2, 2.0];
/// Speed of a body that moves (m/s).
const MOVES: f64 = 1e-4;

/// Random assembly: a tower of turned boxes, or columns with a lintel and a tower on it.
fn assembly(draw: &mut WideDraw) -> Scene {
    let mut scene = Scene::new(draw.within(0.2, 0.8));
    let mut top = 0.0;
    let density = 500.0;
    let place = |scene: &mut Scene, half: [f64; 3], at: [f64; 2], low: f64, yaw: f64| {
        let mass = density * 8.0 * half[0] * half[1] * half[2];
        scene.add_box(mass, half, [at[0], at[1], low + half[2]]);
        let state = scene.states.last_mut().unwrap();
        state.attitude = [(0.5 * yaw).cos(), 0.0, 0.0, (0.5 * yaw).sin()].into();
    };
    let mut width = draw.within(0.2, 0.4);
    if draw.share() < 0.4 {
        let height = draw.within(0.1, 0.5);
        let span = draw.within(0.3, 0.6);
        for side in [-1.0, 1.0] {
            let half = [draw.within(0.05, 0.15), draw.within(0.05, 0.15), 0.5 * height];
            place(&mut scene, half, [side * span, 0.0], 0.0, 0.0);
        }
        let thick = draw.within(0.02, 0.08);
        place(&mut scene, [span + 0.1, 0.12, thick], [0.0, 0.0], height, 0.0);
        top = height + 2.0 * thick;
        width = 0.12;
    }
    for _ in 0..1 + draw.index(4) {
        let half =
            [draw.within(0.3, 1.0) * width, draw.within(0.3, 1.0) * width, draw.within(0.03, 0.2)];
        let at = [draw.within(-0.3, 0.3) * width, draw.within(-0.3, 0.3) * width];
        place(&mut scene, half, at, top, draw.within(0.0, 1.5));
        top += 2.0 * half[2];
    }
    scene
}

/// Largest speed of a body in 2 s from rest (m/s), or the first one above [`MOVES`].
fn speed_from_rest(scene: &Scene, wrenches: &[Wrench]) -> f64 {
    let world = scene.world();
    let motion = Motion::native(&world);
    let mut simulation = Simulation::new(world, scene.states.clone(), motion).unwrap();
    for (body, wrench) in wrenches.iter().enumerate() {
        simulation.set_wrench(body, *wrench).unwrap();
    }
    let (mut record, mut fastest) = (StepRecord::new(), 0.0_f64);
    for _ in 0..1000 {
        simulation.step(&mut record).unwrap();
        let speeds = simulation.states().iter().map(|state| state.velocity.norm());
        fastest = speeds.fold(fastest, f64::max);
        if fastest > MOVES || simulation.rests() {
            break;
        }
    }
    fastest
}

/// Counts of a campaign.
#[derive(Debug, Default)]
struct Counts {
    /// Assemblies with a largest factor.
    tried: usize,
    /// Assemblies without one: they do not stand alone, or nothing limits the push.
    skipped: usize,
    undecided: usize,
    /// Assemblies that stand, and stay.
    stays: usize,
    /// Assemblies without forces that move.
    moves: usize,
    /// Assemblies that stand, and move in the simulator: forces exist, and a motion is a solution too.
    moves_with_forces: usize,
    /// Assemblies without forces that stay: a contradiction.
    stays_without_forces: usize,
}

#[test]
fn random_assemblies_move_in_the_simulator_where_statics_says_so() {
    let mut counts = Counts::default();
    for seed in 0..sizes::size(16, 500) {
        let mut draw = WideDraw::wide(seed as u64);
        let scene = assembly(&mut draw);
        let structure = scene.structure();
        let body = draw.index(scene.bodies.len());
        let angle = draw.within(0.0, std::f64::consts::TAU);
        let push = Vector3::new(angle.cos(), angle.sin(), draw.within(-0.5, 0.5));
        let point = Vector3::new(0.0, 0.0, draw.within(-0.02, 0.02));
        let case = LoadCase::push(&structure, body, push, point).unwrap();
        let Some(factor) = structure.largest_factor(&case).factor().filter(|of| *of > 1e-3) else {
            counts.skipped += 1;
            continue;
        };
        counts.tried += 1;
        let share = SHARES[seed % SHARES.len()];
        let twist = case.wrenches[body];
        let mut wrenches = vec![Wrench::zero(); scene.bodies.len()];
        let turn = scene.states[body].pose().rotation;
        wrenches[body] = Wrench {
            force: twist.linear * (share * factor),
            torque: turn.tr_mul(&twist.angular) * (share * factor),
        };
        let (structure, first) =
            Structure::at_rest(&scene.world(), &scene.states, &wrenches).unwrap();
        let moves = speed_from_rest(&scene, &wrenches) > MOVES;
        match (structure.verdict(), moves) {
            (Verdict::Undecided, _) => counts.undecided += 1,
            (Verdict::Equilibrium(_), false) => counts.stays += 1,
            (Verdict::None(_), true) => counts.moves += 1,
            (Verdict::Equilibrium(_), true) => {
                // A motion obeys Coulomb's law too: the limit of associated friction is an upper bound.
                println!("seed {seed}, {share} of the limit: moves, though forces exist");
                assert!(first.status.is_solved(), "seed {seed}: {first:?}");
                counts.moves_with_forces += 1;
            }
            (Verdict::None(_), false) => counts.stays_without_forces += 1,
        }
        if matches!(structure.verdict(), Verdict::None(_)) {
            assert!(first.moves, "seed {seed}: the first step does not move");
        }
    }
    println!("{counts:?}");
    assert!(counts.tried > counts.skipped);
    assert_eq!(counts.stays_without_forces + counts.undecided, 0);
    assert!(counts.moves_with_forces * 20 <= counts.tried, "{counts:?}");
}
