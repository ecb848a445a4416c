//! Checks that the native solver returns the same doubles in every run and on every thread.

use crate::common::point_forces;
use crate::common::prelude::*;
use crate::toss::*;
use std::thread;

/// FNV-1a hash, 64 bits, of the bytes of the numbers, lowest byte first.
fn fingerprint(numbers: impl IntoIterator<Item = f64>) -> u64 {
    let bytes = numbers.into_iter().flat_map(|number| number.to_bits().to_le_bytes());
    bytes.fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3)
    })
}

/// States and forces of all steps of a run. They are computed with + − × ÷ and √ alone, which round
/// the same on every machine.
fn numbers(world: &World, run: &[StepRecord]) -> Vec<f64> {
    let solution = |step: &StepRecord| {
        let mut numbers = step.next().to_vector().as_slice().to_vec();
        numbers.extend(point_forces(world, &step.first().solution).iter().flatten());
        numbers
    };
    run.iter().flat_map(solution).collect()
}

/// Fingerprint of a thrown cube's run of 1000 rows.
fn thrown_fingerprint(inertia: f64, seed: u32) -> u64 {
    let world = cube_world(inertia);
    fingerprint(numbers(&world, &thrown_run(&world, seed)))
}

const RUNS: [(f64, u32); 6] =
    [(LIGHT, 0), (LIGHT, 1), (LIGHT, 2), (LIGHT, 42), (SOLID, 0), (SOLID, 42)];

/// Published fingerprints of these runs.
///
/// They hold for x86_64-unknown-linux-gnu, debug and release. They also hold for any target whose
/// compiler neither fuses a multiplication with an addition nor keeps extra digits. Scattered
/// starts also use the sine and cosine of the crate libm, which consist of such operations. A
/// change of the solver that rounds differently changes the fingerprints, and its author must
/// confirm that here.
#[cfg(all(target_arch = "x86_64", target_os = "linux"))]
const PUBLISHED: [u64; 6] = [
    0x3fd2_e157_954f_17f5,
    0xcbb3_abda_9c2d_9420,
    0x1412_1614_4fb6_a45b,
    0xbc49_801f_50bf_46d3,
    0x3a99_9177_e31e_9f50,
    0x4ab9_e5a1_7a6b_bd5d,
];

#[test]
#[cfg(all(target_arch = "x86_64", target_os = "linux"))]
fn the_runs_have_their_published_fingerprints() {
    let found = RUNS.map(|(inertia, seed)| thrown_fingerprint(inertia, seed));
    assert_eq!(found, PUBLISHED, "{found:#018x?}");
}

/// Checks the hash against published values of FNV-1a: the empty text, and eight bytes (as one
/// number) of which the lowest is "a".
#[test]
fn the_fingerprint_is_fnv_1a() {
    assert_eq!(fingerprint([]), 0xcbf2_9ce4_8422_2325);
    let bytes = fingerprint([f64::from_bits(0x61)]);
    let zeros = (0..7).fold(0xaf63_dc4c_8601_ec8c_u64, |h, _| h.wrapping_mul(0x100_0000_01b3));
    assert_eq!(bytes, zeros);
}

/// Compares two runs bit for bit. It prints the fingerprints for comparisons between machines.
#[test]
fn a_second_run_gives_the_same_doubles() {
    for (inertia, seed) in RUNS {
        let first = thrown_fingerprint(inertia, seed);
        println!("inertia {inertia}, seed {seed}: {first:#018x}");
        assert_eq!(first, thrown_fingerprint(inertia, seed), "inertia {inertia}, seed {seed}");
    }
}

/// Compares eight threads with one, bit for bit. Each thread has its own order of the runs.
#[test]
fn eight_threads_give_the_same_doubles_as_one() {
    let alone = RUNS.map(|(inertia, seed)| thrown_fingerprint(inertia, seed));
    let count = RUNS.len();
    let threads: Vec<_> = (0..8)
        .map(|first| {
            thread::spawn(move || {
                let order = (0..count).map(|k| (first + k) % count);
                order.map(|k| (k, thrown_fingerprint(RUNS[k].0, RUNS[k].1))).collect::<Vec<_>>()
            })
        })
        .collect();
    for thread in threads {
        for (k, together) in thread.join().unwrap() {
            assert_eq!(together, alone[k], "{:?}", RUNS[k]);
        }
    }
}

/// Checks that steps of another run leave no trace in a solver.
#[test]
fn a_solver_remembers_nothing_of_the_steps_before() {
    let world = World::new(parameters(cubes().remove(2))).unwrap();
    let (one, other) = (thrown_run(&world, 42), thrown_run(&world, 1));
    let mut used = NativeSolver::new(&world);
    for k in 2..one.len() {
        solve_step(&mut used, &world, other[k].state(), &other[k - 1].first().solution);
        let again = solve_again(&mut used, &world, &one, k);
        assert_eq!(again.solution, one[k].first().solution, "step {k}");
    }
}

/// Checks that the solver reads the world from the step. A solver made for a world with another
/// time step, gravity and form of rotation returns the same bits.
#[test]
fn a_solver_takes_the_world_from_the_step() {
    let world = World::new(parameters(cubes().remove(2))).unwrap();
    let run = thrown_run(&world, 42);
    let mut elsewhere = parameters(cubes().remove(1));
    elsewhere.time_step *= 2.0;
    elsewhere.gravity *= 3.0;
    elsewhere.rotation = Rotation::Momentum;
    assert_ne!(elsewhere.rotation, world.rotation());
    let mut solver = NativeSolver::new(&World::new(elsewhere).unwrap());
    for k in 2..run.len() {
        let again = solve_again(&mut solver, &world, &run, k);
        assert_eq!(again.solution, run[k].first().solution, "step {k}");
    }
}
