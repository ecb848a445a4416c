//! Balls that meet within a step. Off-centre and without friction, the forces act through both
//! centres. A ball that is driven into the ground meets it.

use crate::common::prelude::*;

fn ball(mass: f64, radius: f64) -> RigidBody {
    RigidBody::solid(mass, &[Piece::sphere(radius).unwrap()]).unwrap().0
}

fn at(position: [f64; 3], velocity: [f64; 3]) -> State {
    State {
        position: position.into(),
        attitude: Vector4::new(0.9, 0.1, -0.3, 0.2).normalize(),
        velocity: velocity.into(),
        spin: Vector3::zeros(),
    }
}

fn world(bodies: Vec<RigidBody>) -> World {
    World::new(Parameters {
        ground: Some(Plane::new(Vector3::z(), -100.0).unwrap()),
        gravity: Vector3::zeros(),
        friction: 0.0,
        time_step: 0.01,
        ..Parameters::new(bodies)
    })
    .unwrap()
}

/// Runs 40 steps in which the balls meet. To rounding, no ball turns and no step adds energy.
fn check(name: &str, world: &World, starts: &[State]) -> Vec<StepRecord> {
    let motion = Motion::native(world);
    let mut run = Simulation::new(world.clone(), starts.iter().copied(), motion).unwrap();
    let mut step = |_| {
        let mut record = StepRecord::new();
        run.step(&mut record).unwrap();
        record
    };
    let records: Vec<_> = (0..40).map(&mut step).collect();
    assert!(
        records.iter().any(|record| record
            .first()
            .solution
            .contacts
            .iter()
            .any(|c| c.carries_force()))
    );
    let energy = |states: &[State]| -> f64 {
        let bodies = world.bodies().iter().zip(states);
        bodies.map(|(body, state)| 0.5 * body.mass() * state.velocity.norm_squared()).sum()
    };
    for record in &records {
        let (k, next) = (record.index, record.next_states());
        assert_ne!(record.status(), StepStatus::Failed, "{name}, k = {k}");
        let spin = next.iter().map(|state| state.spin.norm()).fold(0.0, f64::max);
        assert!(spin < 1e-12, "{name}, k = {k}: {spin:e} rad/s");
        let gained = energy(next) - energy(record.states());
        assert!(gained < 1e-12, "{name}, k = {k}: {gained:e} J");
    }
    records
}

/// Checks balls of equal and of different radii. The gap at the start of the collision step is a
/// fifth of a radius. Planes at the overlap after free flight would be rotated against the line of
/// centres, and their forces would turn the balls. Momentum and angular momentum are conserved.
#[test]
fn balls_that_meet_off_their_centres_do_not_turn() {
    for (name, [first, second]) in [("equal", [0.1, 0.1]), ("first larger", [0.1, 0.06])] {
        for aside in [0.0, 0.05, -0.09, 0.14] {
            let world = world(vec![ball(1.0, first), ball(2.0, second)]);
            let starts =
                [at([-0.4, aside, 0.02], [2.0, 0.0, 0.0]), at([0.0, 0.0, 0.0], [-0.3, 0.1, 0.0])];
            let records = check(name, &world, &starts);
            let moment = |states: &[State]| -> Vector3<f64> {
                let bodies = world.bodies().iter().zip(states);
                bodies.map(|(b, s)| b.mass() * s.position.cross(&s.velocity)).sum()
            };
            let kept = moment(records[39].next_states()) - moment(&starts);
            // Rounding of 40 steps of two balls, with numbers below 1.
            assert!(kept.amax() < 1e-13, "{name}, {aside}: {kept}");
        }
    }
}

/// Checks a fixed ball. The plane belongs to the ball with the smaller curvature, the fixed or the
/// moving one.
#[test]
fn a_ball_that_meets_a_fixed_one_does_not_turn() {
    for (name, radius) in [("equal", 0.1), ("larger", 0.2), ("smaller", 0.05)] {
        let piece = Piece::sphere(radius).unwrap();
        let world = world(vec![ball(1.0, 0.1)]);
        let world = world.with_fixed(vec![piece]);
        check(name, &world, &[at([-0.45, 0.06, 0.03], [2.0, 0.0, 0.0])]);
    }
}

/// Checks that a ball driven down by another ball within a step meets the ground. Its point is
/// already a contact with the other ball, and free flight would not reach the ground.
#[test]
fn a_ball_that_is_driven_down_meets_the_ground() {
    // The start is above the band in which points are candidates.
    let starts = [at([0.0, 0.0, 0.1006], [0.0; 3]), at([0.0, 0.0, 0.3007], [0.0, 0.0, -2.0])];
    let world = World::new(Parameters {
        ground: Some(Plane::level()),
        friction: 0.3,
        time_step: 1e-3,
        ..world(vec![ball(1.0, 0.1), ball(1.0, 0.1)]).parameters().clone()
    });
    let world = world.unwrap();
    for record in check("driven down", &world, &starts) {
        assert!(record.residual() < 1e-9, "{:?}", record.certificate());
        let depth = 0.1 - record.next_states()[0].position[2];
        assert!(depth < 1e-12, "step {}: {depth:e} m", record.index);
    }
}
