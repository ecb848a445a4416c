//! Bodies with many points: rolling and falling rims with the native solver, sliding faces with
//! Ipopt, and an interrupt in the middle of a step.

use crate::common::prelude::*;
use crate::common::tutorial_parameters;
use tumble::solver::ipopt::{IpoptSolver, Ladder, MOST_ITERATIONS, Rung, TOLERANCE};

/// Plate of 1 m that slides and turns on a grid of `side`² points.
fn sliding_plate(side: usize) -> Simulation<'static> {
    let at = |i: usize| i as f64 / (side - 1) as f64 - 0.5;
    let grid = (0..side * side).map(|k| Vector3::new(at(k % side), at(k / side), -0.1));
    let points: Vec<_> = grid.collect();
    let inertia = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, 1.6));
    let body = RigidBody::new(10.0, inertia, &points).unwrap();
    let world = World::new(Parameters { bodies: vec![body], ..tutorial_parameters() }).unwrap();
    let start = State {
        velocity: Vector3::new(1.0, 0.2, 0.0),
        spin: Vector3::new(0.0, 0.0, 0.5),
        ..State::at_rest(Vector3::new(0.0, 0.0, 0.1))
    };
    let options = IpoptSolver::options(TOLERANCE, MOST_ITERATIONS);
    let ipopt = IpoptSolver::new(&world, options).unwrap();
    let motion = Motion::contact(Ladder::new(&world, ipopt, &Rung::ALL));
    Simulation::new(world, [start], motion).unwrap()
}

/// Checks a coin with 1000 points on its rims that rolls, or is dropped while turning. The contacts
/// change in every step, so that the last forces belong to other points. Later stages run in at
/// most 5 % of the contact steps.
#[test]
fn a_coin_of_a_thousand_points_hardly_needs_another_start() {
    let (radius, half) = (0.5, 0.03);
    let rim = (0..500).map(|k| f64::from(k) / 500.0 * std::f64::consts::TAU);
    let points: Vec<_> = rim
        .flat_map(|a| [-half, half].map(|z| Vector3::new(radius * a.cos(), radius * a.sin(), z)))
        .collect();
    let across = 0.25 * radius * radius + half * half / 3.0;
    let inertia = Matrix3::from_diagonal(&Vector3::new(across, across, 0.5 * radius * radius));
    let coin = RigidBody::new(1.0, inertia, &points).unwrap();
    let world = World::new(Parameters { bodies: vec![coin], ..tutorial_parameters() }).unwrap();
    let start = |attitude: [f64; 4], velocity: [f64; 3], spin: [f64; 3]| State {
        position: Vector3::new(0.0, 0.0, 0.55),
        attitude: Vector4::from(attitude).normalize(),
        velocity: velocity.into(),
        spin: spin.into(),
    };
    let rolling = start([1.0, 1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 0.2, 4.0]);
    let dropped = start([1.0, 0.3, 0.2, 0.0], [0.3, 0.2, 0.0], [3.0, 2.0, 1.0]);
    for state in [rolling, dropped] {
        let motion = Motion::native(&world);
        let mut simulation = Simulation::new(world.clone(), [state], motion).unwrap();
        let mut record = StepRecord::new();
        let (mut contact, mut retried) = (0, 0);
        for k in 0..1500 {
            simulation.step(&mut record).unwrap();
            let status = record.status();
            assert_ne!(status, StepStatus::Failed, "step {k}");
            contact += u32::from(status != StepStatus::Free);
            retried += u32::from(status == StepStatus::Retried);
        }
        assert!(contact > 1000 && 20 * retried <= contact, "{retried} of {contact}");
    }
}

/// Checks that Ipopt solves the steps of a sliding face with any number of points.
///
/// The weight is carried, and friction is μ times the weight against the slip. So v falls by μ g h
/// per step, less a part due to the turning: 0.5 rad/s at 0.7 m against 1 m/s is at most a third.
#[test]
fn a_sliding_face_of_many_points_is_solved() {
    for side in [4, 10, 14] {
        let mut simulation = sliding_plate(side);
        let mut record = StepRecord::new();
        let mut iterations = 0;
        for k in 0..5 {
            let before = simulation.states()[0].velocity.norm();
            simulation.step(&mut record).unwrap();
            let status = record.status();
            let solved = [StepStatus::Converged, StepStatus::Retried].contains(&status);
            assert!(solved, "{side}, step {k}: {:?}", record.report());
            iterations += record.report().iterations;
            let weight = record.first().solution.total_force(0)[2];
            assert!((weight / 98.1 - 1.0).abs() < 0.01, "{side}, step {k}: {weight} N");
            let slowed = (before - record.next().velocity.norm()) / (0.3 * 9.81 * 0.002);
            assert!((0.66..1.01).contains(&slowed), "{side}, step {k}: {slowed} of μ g h");
        }
        assert!(iterations < 150, "{side}: {iterations} iterations");
    }
}

/// Interrupts, measured by processor times in Linux' `/proc`.
#[cfg(target_os = "linux")]
mod interrupts {
    use super::sliding_plate;
    use std::path::Path;
    use std::sync::Arc;
    use std::sync::atomic::{AtomicBool, Ordering};
    use std::time::Duration;
    use tumble_core::error::Error;
    use tumble_core::simulation::{Simulation, StepRecord};

    /// Takes the first step of a simulation in full, and interrupts that of another one after a tenth
    /// of this step's processor time. The rest of the interrupted step must take less than a quarter of
    /// a full one. Returns the interrupted simulation.
    fn interrupted<'a>(start: impl Fn() -> Simulation<'a>) -> Simulation<'a> {
        let thread = std::fs::canonicalize("/proc/thread-self").unwrap();
        let (mut whole, begin) = (start(), ticks(&thread));
        whole.step(&mut StepRecord::new()).unwrap();
        let full = ticks(&thread) - begin;
        assert!(full >= 20, "{full} hundredths of a second are too few for a measurement");

        let mut simulation = start();
        let flag = Arc::new(AtomicBool::new(false));
        simulation.interrupt_by(Arc::clone(&flag));
        let (begin, stepping) = (ticks(&thread), thread.clone());
        let raised = std::thread::spawn(move || {
            while ticks(&stepping) < begin + full / 10 {
                std::thread::sleep(Duration::from_millis(1));
            }
            flag.store(true, Ordering::Relaxed);
            ticks(&stepping)
        });
        let end = simulation.step(&mut StepRecord::new()).err();
        let late = ticks(&thread) - raised.join().unwrap();
        assert_eq!(end, Some(Error::Interrupted));
        assert!(4 * late < full, "{late} of {full} hundredths of a second after the interrupt");
        simulation
    }

    /// Processor time of a thread in hundredths of a second, from its directory in `/proc`.
    fn ticks(thread: &Path) -> u64 {
        let stat = std::fs::read_to_string(thread.join("stat")).unwrap();
        // The name may contain blanks. After it come the state and, in fields 12 and 13, the user and
        // system times.
        let fields: Vec<_> = stat.rsplit_once(')').unwrap().1.split_whitespace().collect();
        fields[11..13].iter().map(|time| time.parse::<u64>().unwrap()).sum()
    }

    /// Checks that an interrupt ends a step after the current iteration and leaves the simulation
    /// unchanged. The first step with 961 points takes 2 s or more.
    #[test]
    fn an_interrupt_ends_a_step_of_many_points() {
        let before = sliding_plate(31).states()[0];
        let simulation = interrupted(|| sliding_plate(31));
        assert_eq!(simulation.states()[0], before, "the interrupted step left no trace");
    }
}
