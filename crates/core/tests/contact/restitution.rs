//! Contacts with restitution: closed forms of single impacts and of bouncing motions, and checks
//! that no impact creates energy.

use crate::common::prelude::*;
use proptest::prelude::*;
use proptest::test_runner::{Config, RngSeed, TestRunner};
use std::cell::Cell;

fn at(x: f64, y: f64, z: f64) -> State {
    State::at_rest(Vector3::new(x, y, z))
}

fn moving(state: State, velocity: [f64; 3]) -> State {
    State { velocity: velocity.into(), ..state }
}

fn ball(mass: f64, radius: f64) -> RigidBody {
    let moment = 0.4 * mass * radius * radius;
    let piece = Piece::sphere(radius).unwrap();
    RigidBody::from_pieces(mass, Matrix3::from_diagonal_element(moment), vec![piece]).unwrap()
}

fn world(bodies: Vec<RigidBody>, gravity: f64, friction: f64, time_step: f64) -> World {
    let gravity = Vector3::new(0.0, 0.0, -gravity);
    let ground = Plane::level();
    euler(Parameters {
        ground: Some(ground),
        gravity,
        friction,
        time_step,
        ..Parameters::new(bodies)
    })
}

/// Runs a world and returns the records of all steps. Every step must be solved and certified.
fn run(world: &World, states: Vec<State>, motion: Motion<'_>, count: usize) -> Vec<StepRecord> {
    let mut simulation = Simulation::new(world.clone(), states, motion).unwrap();
    steps(&mut simulation, count, is_solved)
}

fn native(world: &World, states: Vec<State>, steps: usize) -> Vec<StepRecord> {
    let records = run(world, states, Motion::native(world), steps);
    for record in &records {
        assert!(record.residual() < 1e-9, "{record:?}");
    }
    records
}

/// Checks that a ball with e = 1 bounces to the same height for 33 000 steps, 70 bounces. Between
/// impacts the scheme conserves ½ v² + g z − ½ h g v. So does an impact with e = 1 (eq. 30).
#[test]
fn a_ball_that_loses_nothing_bounces_for_ever() {
    let (g, h) = (9.81, 1e-3);
    let world = world(vec![ball(1.0, 0.1)], g, 0.3, h)
        .with_coefficient(Coefficient::Restitution, 1.0)
        .unwrap();
    let records = native(&world, vec![at(0.0, 0.0, 0.4)], 33_000);
    let kept = |state: &State| {
        let (v, z) = (state.velocity[2], state.position[2]);
        0.5 * v * v + g * z - 0.5 * h * g * v
    };
    let first = kept(records[0].state());
    let mut bounces = 0;
    for record in &records {
        // Rounding of 33 000 steps, 1e-16 of 4 J/kg each.
        assert!((kept(record.next()) - first).abs() < 1e-10, "k = {}", record.index);
        bounces += u32::from(record.first().contacts.iter().any(|contact| contact.rebound > 0.0));
        assert_eq!(record.restitution_share(), 1.0);
    }
    assert!((65..80).contains(&bounces), "{bounces}");
}

/// Checks the heights and times of bounces: heights decrease like e²ⁿ and intervals like eⁿ. A
/// bounce starts up to h v above the ground, which is an error of first order in h.
#[test]
fn heights_and_times_of_bounces_converge_with_the_step() {
    let (g, e, drop) = (9.81, 0.7, 0.5);
    let speed = f64::sqrt(2.0 * g * drop);
    let error = |h: f64| {
        let world = world(vec![ball(2.0, 0.05)], g, 0.0, h)
            .with_coefficient(Coefficient::Restitution, e)
            .unwrap();
        let records = native(&world, vec![at(0.0, 0.0, 0.05 + drop)], (2.0 / h) as usize);
        let mut highest = Vec::new();
        let mut impacts = Vec::new();
        for record in &records {
            if record.first().contacts.iter().any(|contact| contact.rebound > 0.0) {
                impacts.push(h * record.index as f64);
                highest.push(0.0_f64);
            }
            if let Some(highest) = highest.last_mut() {
                *highest = highest.max(record.next().position[2] - 0.05);
            }
        }
        let mut worst = 0.0_f64;
        let mut time = speed / g;
        for bounce in 0..4 {
            let rebound = speed * f64::powi(e, bounce + 1);
            worst = worst.max((highest[bounce as usize] - rebound * rebound / (2.0 * g)).abs());
            worst = worst.max((impacts[bounce as usize] - time).abs());
            time += 2.0 * rebound / g;
        }
        worst
    };
    let errors = [1e-3, 2.5e-4].map(error);
    // Each of the four bounces is shifted by up to h v = 3 mm at h = 1 ms.
    assert!(errors[0] < 8e-3, "{errors:?}");
    assert!(errors[1] < 0.5 * errors[0], "{errors:?}");
}

/// Checks Newton's cradle. With gaps the last ball takes all the momentum. Without gaps the impact
/// is simultaneous, and two balls move on together.
#[test]
fn three_balls_in_a_row() {
    let outcome = |gap: f64| {
        let bodies = vec![ball(1.0, 0.1), ball(1.0, 0.1), ball(1.0, 0.1)];
        let world =
            world(bodies, 0.0, 0.0, 1e-3).with_coefficient(Coefficient::Restitution, 1.0).unwrap();
        let states = vec![
            moving(at(-0.5, 0.0, 1.0), [1.0, 0.0, 0.0]),
            at(0.0, 0.0, 1.0),
            at(0.2 + gap, 0.0, 1.0),
        ];
        let records = native(&world, states, 1000);
        let last = records.last().unwrap().next_states();
        [0, 1, 2].map(|ball| last[ball].velocity[0])
    };
    for (found, expected) in outcome(0.05).iter().zip([0.0, 0.0, 1.0]) {
        assert!((found - expected).abs() < 1e-9, "apart: {found} {expected}");
    }
    for (found, expected) in outcome(0.0).iter().zip([-1.0 / 3.0, 2.0 / 3.0, 2.0 / 3.0]) {
        assert!((found - expected).abs() < 1e-9, "in touch: {found} {expected}");
    }
}

/// Elastic balls in a row without gravity, with gaps shorter than the way of a step: one impact
/// presses on the next balls, which stand still. The energy is conserved to rounding.
#[test]
fn a_row_with_short_gaps_keeps_its_energy() {
    let (radius, mass, speed, time_step) = (0.05, 0.3, 2.0, 0.002);
    for share in [0.0, 0.1, 0.25, 0.5, 0.9, 1.1] {
        let gap = share * speed * time_step;
        let world = world(vec![ball(mass, radius); 5], 0.0, 0.0, time_step);
        let world = world.with_coefficient(Coefficient::Restitution, 1.0).unwrap();
        let place = |i: usize| i as f64 * (2.0 * radius + gap) + if i > 0 { 0.01 } else { 0.0 };
        let mut states: Vec<_> = (0..5).map(|i| at(place(i), 0.0, 1.0)).collect();
        states[0].velocity[0] = speed;
        let records = native(&world, states, 40);
        for record in &records {
            let squares = record.next_states().iter().map(|state| state.velocity.norm_squared());
            let kept = squares.sum::<f64>() / (speed * speed);
            assert!((kept - 1.0).abs() < 1e-9, "gap {gap}, step {}: {kept}", record.index);
        }
        let last = records.last().unwrap().next_states()[4].velocity[0];
        assert!(last > 0.39 * speed, "gap {gap}: {last}");
    }
}

/// Checks a rod that lands on its end without friction: p = (1 + e) v/(1/m + a²/I), for any motion
/// of the other end. The step turns the rod with its new spin, so that the height of the end is
/// accurate to second order in h ω.
#[test]
fn an_end_of_a_rod_bounces_by_its_own_inertia() {
    let (mass, moment, arm, e, speed, h) = (2.0, 0.05, 0.3, 0.6, 1.5, 1e-5);
    let ends = [Vector3::new(-arm, 0.0, 0.0), Vector3::new(arm, 0.0, 0.0)];
    let inertia = Matrix3::from_diagonal_element(moment);
    let rod = RigidBody::new(mass, inertia, &ends).unwrap();
    let world =
        world(vec![rod], 0.0, 0.0, h).with_coefficient(Coefficient::Restitution, e).unwrap();
    let (sin, cos) = f64::sin_cos(0.5 * 0.3);
    let start = State {
        attitude: Vector4::new(cos, 0.0, -sin, 0.0),
        ..moving(at(0.0, 0.0, arm * 0.3_f64.sin() + 0.5 * h * speed), [0.4, 0.0, -speed])
    };
    let records = native(&world, vec![start], 1);
    let lever = arm * 0.3_f64.cos();
    let impulse = (1.0 + e) * speed / (1.0 / mass + lever * lever / moment);
    let next = records[0].next();
    let turn = h * (impulse * lever / moment).powi(2) * arm;
    assert!((next.velocity[2] - (impulse / mass - speed)).abs() < turn, "{next:?}");
    assert!((next.spin[1].abs() - impulse * lever / moment).abs() < turn / arm * 2.0, "{next:?}");
    assert_eq!(next.velocity[0], 0.4);
}

/// Checks that coefficients of pairs, of bodies and of fixed pieces combine like friction coefficients.
#[test]
fn coefficients_combine_by_pair() {
    let of = Coefficient::Restitution;
    let world = world(vec![ball(1.0, 0.1); 2], 9.81, 0.3, 1e-3).with_coefficient(of, 0.4).unwrap();
    let world = world.with_coefficient_of(of, Partner::Body(0), 0.9).unwrap();
    assert_eq!(world.restitution_between(1, Partner::Ground), 0.4);
    assert_eq!(world.restitution_between(0, Partner::Ground), f64::sqrt(0.9 * 0.4));
    let plate = world.clone().with_fixed(vec![Piece::sphere(0.1).unwrap()]);
    let plate = plate.with_coefficient_of(of, Partner::Fixed(0), 0.1).unwrap();
    assert_eq!(plate.restitution_between(0, Partner::Fixed(0)), f64::sqrt(0.9 * 0.1));
    let world = world.with_coefficient_between(of, 0, Partner::Body(1), 0.0).unwrap();
    assert_eq!(world.restitution_between(1, Partner::Body(0)), 0.0);
    assert!(world.clone().with_coefficient(Coefficient::Restitution, 1.1).is_err());
    assert!(world.clone().with_coefficient(Coefficient::Restitution, f64::NAN).is_err());
    assert!(world.clone().with_rebound_speed(-1.0).is_err());
    assert!(
        world.with_coefficient_between(Coefficient::Restitution, 2, Partner::Ground, 0.5).is_err()
    );
}

/// Checks that contacts slower than the threshold do not bounce.
#[test]
fn slow_contacts_do_not_bounce() {
    let world = world(vec![ball(1.0, 0.1)], 9.81, 0.3, 1e-3)
        .with_coefficient(Coefficient::Restitution, 0.8)
        .unwrap();
    let at_most = |speed| world.clone().with_rebound_speed(speed).unwrap();
    let rises = |world: &World| {
        let records = native(world, vec![at(0.0, 0.0, 0.11)], 400);
        records.iter().flat_map(|r| &r.first().contacts).any(|contact| contact.rebound > 0.0)
    };
    // It falls 1 cm: 0.44 m/s.
    assert!(rises(&at_most(0.4)) && !rises(&at_most(0.5)));
}

fn kinetic(body: &RigidBody, state: &State) -> f64 {
    let spin = &state.spin;
    0.5 * (body.mass() * state.velocity.norm_squared() + spin.dot(&(body.inertia() * spin)))
}

/// Checks Kane's paradox: random boxes thrown obliquely onto rough ground. With the full
/// coefficient Newton's law creates energy in some of these impacts. With the reduced share no
/// impact does. There is no gravity and h is a microsecond, so the kinetic energy is the total
/// energy.
#[test]
fn no_impact_makes_energy() {
    let tempered = Cell::new(0_u32);
    let config = Config { cases: 400, rng_seed: RngSeed::Fixed(13), ..Config::default() };
    let input = (
        prop::array::uniform3(0.05..0.5_f64),
        prop::array::uniform4(-1.0..1.0_f64),
        prop::array::uniform3(-5.0..5.0_f64),
        prop::array::uniform3(-10.0..10.0_f64),
        (0.0..1.0_f64, 0.0..1.5_f64),
    );
    let runner = &mut TestRunner::new(config);
    let result = runner.run(&input, |(sides, attitude, velocity, spin, (e, friction))| {
        let attitude = Vector4::from(attitude);
        prop_assume!(attitude.norm() > 0.1);
        let body = RigidBody::solid_box(1.0, sides.into()).unwrap();
        let world = world(vec![body], 0.0, friction, 1e-6)
            .with_coefficient(Coefficient::Restitution, e)
            .unwrap();
        let mut state = moving(at(0.0, 0.0, 0.0), velocity);
        state.velocity[2] = -velocity[2].abs() - 0.5;
        state.attitude = attitude.normalize();
        state.spin = spin.into();
        state.position[2] = 1e-9 - world.lowest_height(&[state]);
        let record = &native(&world, vec![state], 1)[0];
        // The lowest corner may turn away from the ground.
        prop_assume!(record.first().contacts.iter().any(|contact| contact.rebound > 0.0));
        let body = &world.bodies()[0];
        let (before, after) = (kinetic(body, &state), kinetic(body, record.next()));
        // The tolerance covers the turn within the step, h ω = 1e-5 (eq. 28).
        prop_assert!(after <= before * (1.0 + 1e-4), "{before} {after}");
        tempered.set(tempered.get() + u32::from(record.restitution_share() < 1.0));
        Ok(())
    });
    result.unwrap();
    assert!(tempered.get() > 0, "no paradox in sight");
}

/// Checks boxes that land on a corner. Ipopt's motion is recorded: the velocity (m/s) and position
/// (m) of the first box after 60 steps, of the program of several bodies that tumble 0.2 had.
#[test]
fn boxes_bounce_as_recorded_from_ipopt() {
    let box_at = |z: f64| State {
        attitude: Vector4::new(0.9, 0.2, -0.3, 0.1).normalize(),
        ..moving(at(0.0, 0.0, z), [0.5, 0.0, -2.0])
    };
    let sides = Vector3::new(0.3, 0.2, 0.25);
    let recorded = [
        (
            [0.6462617543863473, 0.5349585555541442, 0.026479330292742683],
            [0.0760887929824982, 0.05884544111095582, 0.4905955263322017],
        ),
        (
            [0.9892247244717837, 0.7495254212970899, -1.0334660678955858],
            [0.10148722155741857, 0.07572121699312861, 0.4177006617366346],
        ),
    ];
    for (count, (velocity, position)) in (1..).zip(recorded) {
        let body = RigidBody::solid_box(2.0, sides).unwrap();
        let world = world(vec![body; count], 9.81, 0.3, 0.002)
            .with_coefficient(Coefficient::Restitution, 0.6)
            .unwrap();
        let starts = [box_at(0.45), box_at(1.2)];
        let records = native(&world, starts[..count].to_vec(), 60);
        let impacts = records.iter().filter(|r| r.first().contacts.iter().any(|c| c.rebound > 0.0));
        assert!(impacts.count() > 0);
        // At least until the second impact. Ipopt's program is smoothed by 1e-6 N.
        let end = records[59].next_states()[0];
        assert!((end.velocity - Vector3::from(velocity)).amax() < 1e-3, "{count}: {end:?}");
        assert!((end.position - Vector3::from(position)).amax() < 1e-4, "{count}: {end:?}");
    }
}
