//! Boxes that fall into a bin and settle as one island. The seeds and sizes are none that the
//! solver was tuned with. Every step is certified. A looser residual takes fewer iterations.

use crate::common::prelude::*;
use tumble_core::solver::native::ACCEPTED_RESIDUAL;

/// Half the width of the bin [m].
const HALF_WIDTH: f64 = 0.72;

/// Boxes of about 0.25 m in layers of four, surrounded by four walls.
fn bin(seed: u32, count: usize) -> (World, Vec<State>) {
    let mut draws = Draws::new(seed);
    let (mut bodies, mut starts) = (Vec::new(), Vec::new());
    for index in 0..count {
        let mut around = |size: f64| size * (2.0 * draws.unit() - 1.0);
        let place = [index % 2, index / 2 % 2, index / 4].map(|place| place as f64);
        let jitter = Vector3::new(around(0.03), around(0.03), 0.0);
        let position = Vector3::new(-0.33, -0.33, 0.4) + 0.66 * Vector3::from(place) + jitter;
        let half_sides = Vector3::from_fn(|_, _| 0.125 + around(0.035));
        let mass = 1.5 + around(0.5);
        let piece = Piece::cuboid(half_sides).unwrap();
        bodies.push(RigidBody::solid(mass, &[piece]).unwrap().0);
        let attitude = draws.attitude();
        let (velocity, spin) = (Vector3::new(0.0, 0.0, -1.0), Vector3::zeros());
        starts.push(State { position, attitude, velocity, spin });
    }
    let walls = [Vector3::x(), -Vector3::x(), Vector3::y(), -Vector3::y()].map(|side| {
        let thick = side.abs() * 0.1 + (Vector3::repeat(1.0) - side.abs()) * (HALF_WIDTH + 0.2);
        let piece = Piece::cuboid(Vector3::new(thick.x, thick.y, 2.0)).unwrap();
        let middle = side * (HALF_WIDTH + 0.1) + Vector3::z() * 2.0;
        piece.moved_by(&Matrix3::identity(), &middle).unwrap()
    });
    let world = World::new(Parameters::new(bodies));
    (world.unwrap().with_integrator(Integrator::Euler).with_fixed(walls.to_vec()), starts)
}

/// Statistics of a run.
#[derive(Default)]
struct Counts {
    iterations: u64,
    crowded: u32,
    largest: f64,
}

/// Runs a scene with every step solved to `residual` [m/s at the speed scale 1].
fn run((world, starts): (World, Vec<State>), steps: u32, residual: f64) -> Counts {
    let solver = NativeSolver::new(&world).with_residual(residual).unwrap();
    let accepted = residual * world.speed_scale();
    let mut simulation = Simulation::new(world, starts, Motion::contact(solver)).unwrap();
    let (mut record, mut counts) = (StepRecord::new(), Counts::default());
    for _ in 0..steps {
        simulation.step(&mut record).unwrap();
        let (k, reached) = (record.index, record.residual());
        assert_ne!(record.status(), StepStatus::Failed, "k = {k}: {reached:e} m/s");
        assert!(reached <= accepted, "k = {k}: {reached:e} m/s");
        assert!(record.overlap() < 1e-3, "k = {k}: {} m", record.overlap());
        counts.iterations += u64::from(record.report().iterations);
        counts.crowded += u32::from(record.first().contacts.len() > 130);
        counts.largest = counts.largest.max(reached);
    }
    counts
}

#[test]
#[ignore = "slow"]
fn every_step_of_small_heaps_in_a_bin_is_solved() {
    let crowded: u32 = [31, 32, 33, 34]
        .map(|seed| run(bin(seed, 44), 800, ACCEPTED_RESIDUAL).crowded)
        .iter()
        .sum();
    assert!(crowded > 50, "{crowded} steps with many contacts");
}

/// Checks that a looser residual saves iterations. The requested residual ends the iterations and
/// does not only decide whether a step counts as solved.
#[test]
fn looser_residual_takes_fewer_iterations() {
    let residuals = [ACCEPTED_RESIDUAL, 1e-6, 1e-4];
    let [exact, less, least] = residuals.map(|residual| run(bin(35, 44), 600, residual));
    assert!(less.iterations < exact.iterations, "{} {}", less.iterations, exact.iterations);
    assert!(least.iterations < exact.iterations, "{} {}", least.iterations, exact.iterations);
    assert!(exact.largest < less.largest && less.largest < least.largest);
}

#[test]
fn residuals_out_of_range_are_rejected() {
    let (world, _) = bin(1, 1);
    for residual in [0.0, -1e-6, 1e-10, 0.1, f64::NAN, f64::INFINITY] {
        let error = NativeSolver::new(&world).with_residual(residual).unwrap_err();
        assert!(matches!(error, Error::OutOfRange { .. }), "{error}");
        assert!(error.to_string().contains("residual"), "{error}");
    }
}
