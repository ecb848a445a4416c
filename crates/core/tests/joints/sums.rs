//! Laws on sums of coordinates: springs, limits, friction and motors on x₁ + 2 x₂, against closed
//! forms and virtual work.

use crate::common::prelude::*;
use tumble_core::simulation::energy;

const H: f64 = 1e-3;
const MASSES: [f64; 2] = [2.0, 3.0];
const MOMENT: f64 = 0.1;

fn at(x: f64) -> State {
    let (velocity, spin) = (Vector3::zeros(), Vector3::zeros());
    let attitude = Vector4::new(1.0, 0.0, 0.0, 0.0);
    State { position: Vector3::new(x, 0.0, 0.0), attitude, velocity, spin }
}

/// World with two bodies, each on its own axis along z, with the given drives.
fn pair(drives: [Drive; 2], hinges: bool, gear: impl Fn([GearAxis; 2]) -> Gear) -> World {
    let moments = Matrix3::from_diagonal_element(MOMENT);
    let body = |mass| RigidBody::new(mass, moments, &[Vector3::repeat(0.05)]).unwrap();
    let parameters = Parameters {
        ground: None,
        gravity: Vector3::zeros(),
        time_step: H,
        ..Parameters::new(MASSES.map(body).into())
    };
    let joint = |index: usize| {
        let of_b = JointFrame::at(Vector3::new(index as f64, 0.0, 0.0));
        let frames = [JointFrame::at(Vector3::zeros()), of_b];
        if hinges {
            Joint::revolute(index, None, frames, drives[index])
        } else {
            Joint::prismatic(index, None, frames, drives[index])
        }
    };
    let axis = |joint| {
        let axis = if hinges { JointAxis::Angular(2) } else { JointAxis::Linear(2) };
        GearAxis { joint, axis }
    };
    let world = euler(parameters).with_joints(vec![joint(0), joint(1)]).unwrap();
    world.with_gears(vec![gear([axis(0), axis(1)])]).unwrap()
}

/// Sliders with `drive` on x₁ + 2 x₂.
fn sliders(drives: [Drive; 2], drive: Drive) -> World {
    pair(drives, false, |[first, second]| Gear::new(first, second, -2.0, 0.0).with_drive(drive))
}

fn started(world: &World, heights: [f64; 2]) -> Simulation<'static> {
    let mut states = vec![at(0.0), at(1.0)];
    states.iter_mut().zip(heights).for_each(|(state, z)| state.position[2] = z);
    Simulation::new(world.clone(), states, Motion::native(world)).unwrap()
}

fn step(simulation: &mut Simulation<'_>, record: &mut StepRecord) -> [f64; 2] {
    simulation.step(record).unwrap();
    assert_eq!(record.status(), StepStatus::Converged, "{:?}", record.certificate());
    assert!(record.residual() <= 1e-9, "{:?}", record.certificate());
    [0, 1].map(|k| record.next_states()[k].position[2])
}

/// A force of the sum that acts for one step gives its impulse to both sliders, in the first and in a later step.
#[test]
fn a_held_force_of_a_sum_gives_its_impulse() {
    let force = |force: f64| Drive { force, ..Drive::NONE };
    for given in [0, 3] {
        let world = sliders([Drive::NONE; 2], force(0.0)).with_integrator(Integrator::Leapfrog);
        let mut simulation = started(&world, [0.0; 2]);
        for k in 0..6i32 {
            simulation.set_gear_drive(0, force(if k == given { 2.0 } else { 0.0 })).unwrap();
            simulation.step(&mut StepRecord::new()).unwrap();
            for (body, ratio) in [(0, 1.0), (1, 2.0)] {
                // z = ½ a h² after the step, and uniform motion after it.
                let speed = if k < given { 0.0 } else { ratio * 2.0 * H / MASSES[body] };
                let place = speed * H * (0.5 + (k - given) as f64);
                let off = simulation.states()[body].position.z - place;
                assert!(off.abs() <= 1e-15, "{given} {k}: {off}");
                // The row after a change has its speed by half.
                let is_even = k != given && k != given + 1;
                let off = simulation.states()[body].velocity.z - speed;
                assert!(!is_even || off.abs() <= 1e-14, "{given} {k}: {off}");
            }
        }
    }
}

/// Checks a spring on the sum. With the implicit rule s̈ = −κ s, κ = k (1/m₁ + 4/m₂), becomes s⁺ −
/// 2 s + s⁻ = −h² κ s⁺. No force acts along 2 m₁ x₁ − m₂ x₂.
#[test]
fn a_spring_on_a_sum_swings_as_its_masses_ask() {
    let stiffness = 300.0;
    let world = sliders([Drive::NONE; 2], Drive { stiffness, rest: 0.1, ..Drive::NONE });
    let mut simulation = started(&world, [0.3, 0.2]);
    let rate = stiffness * (1.0 / MASSES[0] + 4.0 / MASSES[1]);
    let (mut before, mut now) = (0.6, 0.6);
    let mut record = StepRecord::new();
    let mut crossings = Vec::new();
    for k in 0..2000_u32 {
        let next = (2.0 * now - before) / (1.0 + H * H * rate);
        let [x, y] = step(&mut simulation, &mut record);
        assert!((x + 2.0 * y - 0.1 - next).abs() < 1e-11, "{k}: {} {next}", x + 2.0 * y - 0.1);
        let still = 2.0 * MASSES[0] * x - MASSES[1] * y;
        assert!((still - (4.0 * 0.3 - 3.0 * 0.2)).abs() < 1e-12, "{k}: {still}");
        let force = record.first().solution.gears[0];
        assert!((force + stiffness * next).abs() < 1e-8, "{k}: {force}");
        if now * next < 0.0 {
            crossings.push(H * (f64::from(k) + now / (now - next)));
        }
        (before, now) = (now, next);
    }
    let period =
        2.0 * (crossings[crossings.len() - 1] - crossings[0]) / (crossings.len() - 1) as f64;
    let expected = std::f64::consts::TAU / rate.sqrt();
    assert!((period / expected - 1.0).abs() < 1e-3, "{period} {expected}");
}

/// Checks a limit of the sum. A force F on the first slider acts against it. Twice the force pushes
/// the second one against its spring.
#[test]
fn a_stop_of_a_sum_shares_its_force_by_virtual_work() {
    let pushed = Drive { force: 7.0, damping: 12.0, ..Drive::NONE };
    let sprung = Drive { stiffness: 100.0, damping: 12.0, ..Drive::NONE };
    let world = sliders([pushed, sprung], Drive { limits: Some([-0.5, 0.25]), ..Drive::NONE });
    let mut simulation = started(&world, [0.0, 0.0]);
    let mut record = StepRecord::new();
    let mut reached = false;
    for _ in 0..8000 {
        let [x, y] = step(&mut simulation, &mut record);
        assert!(x + 2.0 * y <= 0.25 + 1e-12, "{x} {y}");
        reached |= record.first().solution.gears[0] < -1.0;
        assert!(record.first().solution.gears[0] <= 1e-12);
    }
    assert!(reached);
    let [x, y] = step(&mut simulation, &mut record);
    // −7 N on the sum is −14 N on the second slider, whose spring holds it at −0.14 m.
    assert!(
        (record.first().solution.gears[0] + 7.0).abs() < 1e-6,
        "{:?}",
        record.first().solution.gears
    );
    // Bodies slower than 3e-10 m/s come to rest.
    assert!((y + 0.14).abs() < 1e-8 && (x - 0.53).abs() < 1e-8, "{x} {y}");
    // A start beyond the limit is refused, and assembly repairs it.
    let states = [at(0.0), State { position: Vector3::new(1.0, 0.0, 0.2), ..at(1.0) }];
    let error = Simulation::new(world.clone(), states.to_vec(), Motion::native(&world)).err();
    assert!(error.unwrap().to_string().contains("gear 0"));
    let (found, _) = world.assemble(&states).unwrap();
    assert!(found[0].position[2] + 2.0 * found[1].position[2] <= 0.25 + 1e-6);
}

/// Checks that dry friction on a sum holds up to its limit, and applies its limit while slipping.
#[test]
fn friction_of_a_sum_holds_up_to_its_force() {
    let friction = Drive { friction: 5.0, ..Drive::NONE };
    for (force, holds) in [(4.9, true), (5.1, false)] {
        // F on the first and 2 F on the second push along the sum alone.
        let drives = [force, 2.0 * force].map(|force| Drive { force, ..Drive::NONE });
        let mut simulation = started(&sliders(drives, friction), [0.0, 0.0]);
        let mut record = StepRecord::new();
        for _ in 0..100 {
            step(&mut simulation, &mut record);
        }
        let [x, y] = step(&mut simulation, &mut record);
        let moved = x + 2.0 * y;
        if holds {
            assert!(moved.abs() < 1e-12, "{moved}");
            assert!((record.first().solution.gears[0] + force).abs() < 1e-9);
        } else {
            let rate = (force - 5.0) * (1.0 / MASSES[0] + 4.0 / MASSES[1]);
            let expected = 0.5 * rate * 0.101 * (0.101 + H);
            assert!((moved - expected).abs() < 1e-10, "{moved} {expected}");
        }
    }
}

/// Checks a motor that holds a speed of the sum and one that moves it to a target, each with its
/// force limit.
#[test]
fn motors_of_a_sum_do_what_they_can() {
    let mut record = StepRecord::new();
    let damped = [Drive { damping: 3.0, ..Drive::NONE }; 2];
    let speed = Motor::Speed { target: 0.4, max_force: 1000.0 };
    let mut simulation =
        started(&sliders(damped, Drive { motor: Some(speed), ..Drive::NONE }), [0.0; 2]);
    let [x, y] = step(&mut simulation, &mut record);
    assert!((x + 2.0 * y - 0.4 * H).abs() < 1e-13);
    for _ in 0..20_000 {
        step(&mut simulation, &mut record);
    }
    // d v₁ = f, d v₂ = 2 f, v₁ + 2 v₂ = 0.4.
    let force = record.first().solution.gears[0];
    assert!((force - 3.0 * 0.4 / 5.0).abs() < 1e-9, "{force}");
    let servo = Motor::Position { target: 0.5, stiffness: 1e4, damping: 100.0, max_force: 2.0 };
    let mut simulation =
        started(&sliders(damped, Drive { motor: Some(servo), ..Drive::NONE }), [0.0; 2]);
    step(&mut simulation, &mut record);
    assert_eq!(record.first().solution.gears[0], 2.0);
    let mut last = [0.0; 2];
    for _ in 0..20_000 {
        last = step(&mut simulation, &mut record);
    }
    assert!((last[0] + 2.0 * last[1] - 0.5).abs() < 1e-9, "{last:?}");
    // The motion across the sum decays by a factor e per second, and stops below 3e-10 m/s.
    assert!((2.0 * last[0] - last[1]).abs() < 1e-7, "{last:?}");
}

/// Checks a spring on θ₁ − 3 θ₂ between hinges over many turns. The force follows the counted
/// angles, and the energy does not exceed the work.
#[test]
fn a_spring_between_hinges_counts_turns() {
    let spring = Drive { stiffness: 2.0, ..Drive::NONE };
    let world =
        pair([Drive { force: 0.3, ..Drive::NONE }, Drive::NONE], true, |[first, second]| {
            Gear::new(first, second, 3.0, 0.0).with_drive(spring)
        });
    let mut simulation = started(&world, [0.0, 0.0]);
    let mut record = StepRecord::new();
    let mut work = 0.0;
    for k in 0..20_000 {
        step(&mut simulation, &mut record);
        let angles = [0, 1].map(|joint: usize| record.first().solution.joints[joint].angles[2]);
        let sum = angles[0] - 3.0 * angles[1];
        assert!(
            (record.first().solution.gears[0] + 2.0 * sum).abs() < 1e-8 * (1.0 + sum.abs()),
            "{k}"
        );
        work = 0.3 * angles[0];
        let moving = energy::total(&world, record.next_states()) + sum * sum;
        assert!(moving <= work * (1.0 + 1e-2) + 1e-9, "{k}: {moving} {work}");
    }
    // Together they rotate with the inertia I₁ + I₂/9: 3 θ₂ = θ₁ on average.
    assert!(work > 0.3 * 100.0, "{work}");
    let turned =
        record.first().solution.joints[1].angles[2] / record.first().solution.joints[0].angles[2];
    assert!((turned - 1.0 / 3.0).abs() < 1e-3, "{turned}");
}

/// Checks that the certificate reports a force that the law does not allow in its joint law part.
#[test]
fn the_certificate_sees_a_wrong_force() {
    let world = sliders([Drive::NONE; 2], Drive { stiffness: 300.0, ..Drive::NONE });
    let mut simulation = started(&world, [0.3, 0.2]);
    let mut record = StepRecord::new();
    for _ in 0..10 {
        step(&mut simulation, &mut record);
    }
    let judged = |force: f64| {
        let claim = Claim {
            states: record.states(),
            next: record.next_states(),
            wrenches: &[Wrench::zero(); 2],
            contacts: &[],
            joints: &record.first().solution.joints,
            gears: &[force],
        };
        Certifier::new().contact_step(&world, &claim, std::iter::empty::<Vector3<f64>>())
    };
    let force = record.first().solution.gears[0];
    assert!(judged(force).residual() < 1e-12);
    let wrong = judged(force + 1.0);
    // 1 N changes the speed of the sum by h (1/m₁ + 4/m₂).
    let expected = H * (1.0 / MASSES[0] + 4.0 / MASSES[1]);
    assert!((wrong.joint_law / expected - 1.0).abs() < 1e-2, "{} {expected}", wrong.joint_law);
    assert_eq!(wrong.joint, judged(force).joint);
}

#[test]
fn invalid_sums_are_rejected() {
    let world = sliders([Drive::NONE; 2], Drive::NONE);
    let gear = world.gears()[0];
    let refused = |drive: Drive, why: &str| {
        let error = world.clone().with_gears(vec![gear.with_drive(drive)]).unwrap_err().to_string();
        assert!(error.contains(why), "{error}");
    };
    refused(
        Drive { armature: 0.1, ..Drive::NONE },
        "armature, static friction, friction curve or restitution of a gear",
    );
    refused(Drive { stiffness: -1.0, ..Drive::NONE }, "stiffness of a joint");
    refused(Drive { limits: Some([1.0, 0.0]), ..Drive::NONE }, "upper limit");
}

/// Checks that a drive on a sum set during a run acts from the next step on and is saved. A gear
/// without a drive refuses it.
#[test]
fn a_drive_of_a_sum_is_set_in_mid_run() {
    let force = |force: f64| Drive { force, ..Drive::NONE };
    let world = sliders([Drive::NONE; 2], force(0.5));
    let mut simulation = started(&world, [0.0; 2]);
    let mut record = StepRecord::new();
    step(&mut simulation, &mut record);
    assert!((record.first().solution.gears[0] - 0.5).abs() < 1e-12);
    simulation.set_gear_drive(0, force(-2.0)).unwrap();
    let saved = simulation.save();
    step(&mut simulation, &mut record);
    assert!((record.first().solution.gears[0] + 2.0).abs() < 1e-12);
    let mut other = started(&world, [0.0; 2]);
    other
        .restore(&tumble_core::simulation::Saved::from_bytes(&saved.to_bytes().unwrap()).unwrap())
        .unwrap();
    let mut again = StepRecord::new();
    step(&mut other, &mut again);
    assert_eq!(again.first().solution, record.first().solution);
    let armed = Drive { armature: 1.0, ..Drive::NONE };
    for (gear, drive, words) in [(1, force(1.0), "gear"), (0, armed, "armature")] {
        let why = simulation.set_gear_drive(gear, drive).unwrap_err().to_string();
        assert!(why.contains(words), "{why}");
    }
    let held = pair([Drive::NONE; 2], false, |[first, second]| Gear::new(first, second, -2.0, 0.0));
    let why = started(&held, [0.0; 2]).set_gear_drive(0, force(1.0)).unwrap_err().to_string();
    assert!(why.contains("drive of a gear without one"), "{why}");
}
