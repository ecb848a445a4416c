//! A dense heap of boxes, from the fall until it lies still. Every step is certified, and in the
//! end nothing is left to solve.

use crate::common::prelude::*;

/// 100 boxes of 20 × 15 × 10 cm in four layers of 25, so close that they fall on one another.
fn heap(seed: u32) -> (World, Vec<State>) {
    let mut draws = Draws::new(seed);
    let brick = RigidBody::solid_box(1.5, Vector3::new(0.1, 0.075, 0.05)).unwrap();
    let start = |index: usize| {
        let place = [index % 5, index / 5 % 5, index / 25].map(|place| place as f64);
        State {
            position: Vector3::new(-0.6, -0.6, 0.3) + 0.32 * Vector3::from(place),
            attitude: draws.attitude(),
            velocity: Vector3::zeros(),
            spin: Vector3::zeros(),
        }
    };
    let starts = (0..100).map(start).collect();
    let world = World::new(Parameters::new(vec![brick; 100]));
    (world.unwrap(), starts)
}

/// Checks a heap with some hundred contacts, many on the edge of their friction cones. At least 999
/// of 1000 steps are solved. A heap that lies still repeats the forces of the last step and does
/// not creep.
#[test]
#[ignore = "slow"]
fn a_crowded_heap_is_certified_until_it_lies_still() {
    let mut simulation = certified(13);
    let mut record = StepRecord::new();
    let there = simulation.states().to_vec();
    for _ in 0..100 {
        simulation.step(&mut record).unwrap();
        assert_eq!(record.status(), StepStatus::Converged);
        // At most one iteration per body: boxes that lie alone have their last digits polished.
        assert!(record.report().iterations <= 100, "{}", record.report().iterations);
    }
    for (then, now) in there.iter().zip(simulation.states()) {
        // Rounding of the forces leaves speeds of some 1e-15 m/s.
        assert!(now.velocity.norm() < 1e-14, "{:e}", now.velocity.norm());
        assert!((now.position - then.position).norm() < 1e-14);
    }
}

/// Checks a heap in which two boxes stay on the edge of their cones. They keep rocking at less than
/// 1e-9 m/s. These steps are solved, but the heap is not at rest.
#[test]
#[ignore = "slow"]
fn a_crowded_heap_that_falls_longer_is_certified() {
    let mut simulation = certified(12);
    let mut record = StepRecord::new();
    for _ in 0..300 {
        simulation.step(&mut record).unwrap();
        assert_ne!(record.status(), StepStatus::Failed);
    }
    let fastest = simulation.states().iter().map(|state| state.velocity.norm()).fold(0.0, f64::max);
    assert!(fastest < 1e-9, "{fastest:e}");
}

/// Heap after 1900 steps, of which at most one is not certified.
fn certified(seed: u32) -> Simulation<'static> {
    let (world, starts) = heap(seed);
    let motion = Motion::native(&world);
    let mut simulation = Simulation::new(world, starts, motion).unwrap();
    let mut record = StepRecord::new();
    let (mut most_contacts, mut failed) = (0, 0_u32);
    for _ in 0..1900 {
        simulation.step(&mut record).unwrap();
        most_contacts = most_contacts.max(record.first().contacts.len());
        let (k, residual) = (record.index, record.residual());
        if record.status() == StepStatus::Failed {
            eprintln!("k = {k}: {residual:e} m/s");
            failed += 1;
        } else {
            assert!(residual < 1e-9, "k = {k}: {residual:e}");
        }
        assert!(record.overlap() < 1e-3, "k = {k}: {}", record.overlap());
    }
    assert!(failed <= 1, "{failed}");
    assert!(most_contacts > 300, "{most_contacts}");
    simulation
}
