//! Gears: coordinates of two joints that are coupled to rounding, with motions in closed form.

use crate::common::prelude::*;
use tumble_core::simulation::energy;

const G: f64 = 9.81;
const H: f64 = 1e-3;

fn body(mass: f64, moments: [f64; 3]) -> RigidBody {
    let inertia = Matrix3::from_diagonal(&moments.into());
    RigidBody::new(mass, inertia, &[Vector3::repeat(0.05)]).unwrap()
}

fn world(bodies: Vec<RigidBody>, joints: Vec<Joint>, gravity: f64) -> World {
    let parameters = Parameters {
        ground: None,
        gravity: Vector3::new(0.0, 0.0, -gravity),
        time_step: H,
        ..Parameters::new(bodies)
    };
    euler(parameters).with_joints(joints).unwrap()
}

fn at(x: f64) -> State {
    let (velocity, spin) = (Vector3::zeros(), Vector3::zeros());
    let attitude = Vector4::new(1.0, 0.0, 0.0, 0.0);
    State { position: Vector3::new(x, 0.0, 0.0), attitude, velocity, spin }
}

fn frames(x: f64) -> [JointFrame; 2] {
    [JointFrame::at(Vector3::zeros()), JointFrame::at(Vector3::new(x, 0.0, 0.0))]
}

fn turn(joint: usize) -> GearAxis {
    GearAxis { joint, axis: JointAxis::Angular(2) }
}

fn slide(joint: usize) -> GearAxis {
    GearAxis { joint, axis: JointAxis::Linear(2) }
}

/// Runs `steps` steps. The first stage must solve every step, and the result must be certified.
fn run(simulation: &mut Simulation<'_>, count: usize) -> StepRecord {
    last_step(simulation, count, |record| {
        record.status() == StepStatus::Converged && record.residual() < 1e-10
    })
}

fn gear_error(world: &World, record: &StepRecord) -> f64 {
    let angles: Vec<_> = record.first().solution.joints.iter().map(|joint| joint.angles).collect();
    let states = record.next_states();
    let errors = world.gears().iter().map(|gear| gear.error(world.joints(), states, &angles));
    errors.map(f64::abs).fold(0.0, f64::max)
}

/// Checks two wheels with the ratio r over many turns: the first one has α = τ/(I₁ + I₂/r²).
#[test]
fn wheels_turn_as_their_inertias_ask() {
    for ratio in [-3.0, 0.25, 40.0] {
        let drive = Drive { force: 0.8, ..Drive::NONE };
        let bodies = vec![body(1.0, [0.2, 0.2, 0.1]), body(3.0, [0.2, 0.2, 0.3])];
        let joints = vec![
            Joint::revolute(0, None, frames(0.0), drive),
            Joint::revolute(1, None, frames(1.0), Drive::NONE),
        ];
        let gear = Gear::new(turn(0), turn(1), ratio, 0.0);
        let world = world(bodies, joints, G).with_gears(vec![gear]).unwrap();
        let mut simulation = simulate(&world, &[at(0.0), at(1.0)]);
        let rate = 0.8 / (0.1 + 0.3 / (ratio * ratio));
        let record = run(&mut simulation, 4000);
        // A step moves with its final velocity.
        let expected = 0.5 * rate * 4.0 * (4.0 + H);
        let found = record.first().solution.joints[0].angles[2];
        // A step with momentum p turns by p h/I, less a fraction (h ω)²/3.
        let fastest = rate * 4.0 * f64::max(1.0, 1.0 / f64::abs(ratio));
        let off = (H * fastest).powi(2) / 3.0;
        assert!((found - expected).abs() < (1e-9 + off) * expected, "{ratio}: {found} {expected}");
        assert!(gear_error(&world, &record) < 1e-10 * (1.0 + ratio.abs()), "{ratio}");
        // The gear drives the second wheel: −r f = I₂ α/r.
        let force = record.first().solution.gears[0];
        let asked = -0.3 * rate / (ratio * ratio);
        // An error of second order in time is three times as large in its rate.
        let off = 1e-9 + 3.05 * off;
        assert!((force - asked).abs() < off * asked.abs(), "{ratio}: {force} {asked}");
    }
}

/// Checks a rack that falls and turns its pinion: a = g m/(m + I/R²).
#[test]
fn a_rack_falls_as_slowly_as_its_pinion_lets_it() {
    let (mass, inertia, radius) = (2.0, 0.03, 0.1);
    let bodies = vec![body(mass, [0.1; 3]), body(1.0, [0.1, inertia, 0.1])];
    let axis = JointFrame::along(Vector3::new(1.0, 0.0, 0.0), Vector3::y()).unwrap();
    let own = JointFrame::along(Vector3::zeros(), Vector3::y()).unwrap();
    let joints = vec![
        Joint::prismatic(0, None, frames(0.0), Drive::NONE),
        Joint::revolute(1, None, [own, axis], Drive::NONE),
    ];
    let gear = Gear::new(slide(0), turn(1), radius, 0.0);
    let world = world(bodies, joints, G).with_gears(vec![gear]).unwrap();
    let mut simulation = simulate(&world, &[at(0.0), at(1.0)]);
    let record = run(&mut simulation, 1000);
    let rate = G * mass / (mass + inertia / (radius * radius));
    let expected = -0.5 * rate * (1.0 + H);
    let found = record.next().position[2];
    assert!((found - expected).abs() < 1e-4 * rate, "{found} {expected}");
    assert!(gear_error(&world, &record) < 1e-13);
    assert!((record.first().solution.joints[1].angles[2] - found / radius).abs() < 1e-11);
}

/// Checks a nut on a screw, a joint whose translation is geared to its rotation: a = g m/(m +
/// I/p²).
#[test]
fn a_nut_falls_down_its_screw() {
    let (mass, inertia, pitch) = (1.0, 1e-3, 0.02);
    let joint = Joint::cylindrical(0, None, frames(0.0), [Drive::NONE; 2]);
    let gear = Gear::new(slide(0), turn(0), pitch, 0.0);
    let bodies = vec![body(mass, [0.01, 0.01, inertia])];
    let world = world(bodies, vec![joint], G).with_gears(vec![gear]).unwrap();
    let mut simulation = simulate(&world, &[at(0.0)]);
    let record = run(&mut simulation, 1000);
    let rate = G * mass / (mass + inertia / (pitch * pitch));
    let expected = -0.5 * rate * (1.0 + H);
    let found = record.next().position[2];
    assert!((found - expected).abs() < 3e-3 * expected.abs(), "{found} {expected}");
    assert!(gear_error(&world, &record) < 1e-14);
}

/// Checks four free bodies with two hinges and a gear between the hinges. The momenta of each pair
/// and the total energy are conserved.
#[test]
fn a_gear_of_four_bodies_keeps_momenta_and_energy() {
    let bodies: Vec<_> =
        [1.0, 2.0, 0.5, 3.0].map(|mass| body(mass, [0.1 * mass, 0.2 * mass, 0.15 * mass])).into();
    let half = Vector3::new(0.3, 0.1, 0.0);
    let skew = Vector3::new(0.2, 0.3, 1.0);
    let hinge = |a, b| {
        let frames = [half, -half].map(|anchor| JointFrame::along(anchor, skew).unwrap());
        Joint::revolute(a, Some(b), frames, Drive::NONE)
    };
    let gear = Gear::new(turn(0), turn(1), -1.7, 0.0);
    let world = world(bodies, vec![hinge(0, 1), hinge(2, 3)], 0.0).with_gears(vec![gear]).unwrap();
    // Body B is placed so that the anchors coincide.
    let mut states: Vec<_> = [0.0, 0.6, 5.0, 5.6].map(at).into();
    for (body, state) in states.iter_mut().enumerate() {
        state.position[1] = if body % 2 == 1 { 0.2 } else { 0.0 };
        state.spin = Vector3::new(0.5, -1.0, 2.0) * f64::from(body as u32 + 1);
    }
    let (states, _) = world.assemble(&states).unwrap();
    let mut simulation = simulate(&world, &states);
    let momenta = |states: &[State], pair: usize| {
        let (mut linear, mut angular) = (Vector3::zeros(), Vector3::zeros());
        for body in [2 * pair, 2 * pair + 1] {
            let (of, state) = (&world.bodies()[body], &states[body]);
            linear += state.velocity * of.mass();
            angular += state.position.cross(&state.velocity) * of.mass();
            let own = world.rotation().momentum(of.inertia(), &state.spin, H);
            angular += state.pose().rotation * own;
        }
        (linear, angular)
    };
    let before = [0, 1].map(|pair| momenta(&states, pair));
    let start = energy::total(&world, &states);
    let mut largest = 0.0_f64;
    for _ in 0..20 {
        let record = run(&mut simulation, 100);
        for (pair, (linear, angular)) in before.iter().enumerate() {
            let now = momenta(record.next_states(), pair);
            assert!((now.0 - linear).norm() < 1e-12 * (1.0 + linear.norm()), "{pair}: {linear}");
            assert!((now.1 - angular).norm() < 1e-12 * angular.norm(), "{pair}: {angular}");
        }
        assert!(gear_error(&world, &record) < 1e-12);
        assert!(record.first().solution.gears[0].abs() > 1e-3);
        let off = energy::total(&world, record.next_states()) - start;
        largest = largest.max(off.abs());
    }
    assert!(largest < 1e-3 * start, "{largest} of {start}");
}

/// Checks two geared fingers that press with equal forces: N = F/2 each, by virtual work.
#[test]
fn fingers_that_follow_each_other_share_the_force() {
    let finger = RigidBody::solid(0.2, &[Piece::cuboid(Vector3::new(0.01, 0.02, 0.05)).unwrap()]);
    let held = RigidBody::solid(0.5, &[Piece::cuboid(Vector3::repeat(0.03)).unwrap()]);
    let (finger, held) = (finger.unwrap().0, held.unwrap().0);
    let along = |x: f64, direction: f64| {
        let axis = Vector3::x() * direction;
        let own = JointFrame::along(Vector3::zeros(), axis).unwrap();
        [own, JointFrame::along(Vector3::new(x, 0.0, 0.0), axis).unwrap()]
    };
    let push = Drive { force: 40.0, ..Drive::NONE };
    let joints = vec![
        Joint::prismatic(0, None, along(-0.06, 1.0), push),
        Joint::prismatic(1, None, along(0.06, -1.0), Drive::NONE),
    ];
    let gear = Gear::new(slide(1), slide(0), 1.0, 0.0);
    let world =
        world(vec![finger.clone(), finger, held], joints, G).with_gears(vec![gear]).unwrap();
    let mut simulation = simulate(&world, &[at(-0.06), at(0.06), at(0.0)]);
    let record = {
        let mut record = StepRecord::new();
        for _ in 0..600 {
            simulation.step(&mut record).unwrap();
            assert!(record.residual() < 1e-9, "{:?}", record.certificate());
        }
        record
    };
    let pressed = |finger: usize| record.first().solution.total_force(finger)[0];
    assert!((pressed(0) + 20.0).abs() < 1e-6 && (pressed(1) - 20.0).abs() < 1e-6, "{}", pressed(0));
    assert!(
        (record.first().solution.gears[0] - 20.0).abs() < 1e-6,
        "{:?}",
        record.first().solution.gears
    );
    // Friction of 0.5 at two faces holds 20 N. The held body fell for a step or two before.
    assert!(record.next().velocity.norm() < 1e-9 && gear_error(&world, &record) < 1e-13);
    assert!(record.next_states()[2].position[2] > -0.2);
}

/// Checks a motor on two geared hinges. Turns are counted from the offset of the gear.
#[test]
fn initial_full_turns_satisfy_the_gear_equation() {
    let motor = Some(Motor::Speed { target: 3.0, max_force: 1e4 });
    let bodies = vec![body(1.0, [0.1; 3]), body(1.0, [0.1; 3])];
    let joints = vec![
        Joint::revolute(0, None, frames(0.0), Drive::NONE),
        Joint::revolute(1, None, frames(1.0), Drive { motor, ..Drive::NONE }),
    ];
    let gear = Gear::new(turn(0), turn(1), 5.0, 0.5);
    let world = world(bodies, joints, 0.0).with_gears(vec![gear]).unwrap();
    let turned = |x: f64, angle: f64| {
        let attitude = Vector4::new((0.5 * angle).cos(), 0.0, 0.0, (0.5 * angle).sin());
        State { attitude, ..at(x) }
    };
    let states = [turned(0.0, 10.5), turned(1.0, 2.0)];
    let mut simulation = simulate(&world, &states);
    let record = run(&mut simulation, 1000);
    let [one, two] = [0, 1].map(|joint| record.first().solution.joints[joint].angles[2]);
    assert!((two - 5.0).abs() < 1e-10 && (one - 25.5).abs() < 1e-10, "{one} {two}");
    // New states with another number of turns.
    simulation.set_states(&[turned(0.0, -24.5), turned(1.0, -5.0)]).unwrap();
    assert!(simulation.set_states(&[turned(0.0, 0.0), turned(1.0, 1.0)]).is_err());
    let record = run(&mut simulation, 10);
    assert!(gear_error(&world, &record) < 1e-12);
}

/// Checks that the certificate uses states and forces only. A wrong gear force or a wrong rotation
/// is detected.
#[test]
fn the_certificate_knows_gears() {
    let drive = Drive { force: 0.8, ..Drive::NONE };
    let bodies = vec![body(1.0, [0.1; 3]), body(1.0, [0.1; 3])];
    let joints = vec![
        Joint::revolute(0, None, frames(0.0), drive),
        Joint::revolute(1, None, frames(1.0), Drive::NONE),
    ];
    let gear = Gear::new(turn(0), turn(1), 2.0, 0.0);
    let world = world(bodies, joints, 0.0).with_gears(vec![gear]).unwrap();
    let mut simulation = simulate(&world, &[at(0.0), at(1.0)]);
    let record = run(&mut simulation, 10);
    let residual = |force: f64, turned: f64| {
        let mut next = record.next_states().to_vec();
        next[1].spin[2] += turned;
        let mut joints = record.first().solution.joints.clone();
        next[1].attitude = world.step_map().advance(&record.states()[1].attitude, &next[1].spin);
        joints[1].angles[2] += H * turned;
        let claim = Claim {
            states: record.states(),
            next: &next,
            wrenches: &[Wrench::zero(); 2],
            contacts: &[],
            joints: &joints,
            gears: &[force],
        };
        Certifier::new().contact_step(&world, &claim, std::iter::empty::<Vector3<f64>>())
    };
    let force = record.first().solution.gears[0];
    assert!(residual(force, 0.0).residual() < 1e-13);
    assert!(residual(force * 1.01, 0.0).dynamics > 1e-7);
    assert!(residual(force, 1e-3).joint > 1e-4);
}

#[test]
fn invalid_gears_are_rejected() {
    let bodies = vec![body(1.0, [0.1; 3]), body(1.0, [0.1; 3])];
    let joints = vec![
        Joint::revolute(0, None, frames(0.0), Drive::NONE),
        Joint::spherical(1, None, frames(1.0)),
    ];
    let plain = world(bodies, joints, 0.0);
    let refused = |gear: Gear, why: &str| {
        let error = plain.clone().with_gears(vec![gear]).unwrap_err().to_string();
        assert!(error.contains(why), "{error}");
    };
    refused(Gear::new(turn(0), turn(5), 1.0, 0.0), "joint of a gear");
    refused(Gear::new(turn(0), slide(0), 1.0, 0.0), "without a coordinate");
    refused(Gear::new(turn(0), turn(1), 1.0, 0.0), "without a coordinate");
    refused(Gear::new(turn(0), turn(0), 1.0, 0.0), "itself");
    refused(Gear::new(turn(0), turn(1), f64::NAN, 0.0), "without a coordinate");
    let joints = vec![
        Joint::revolute(0, None, frames(0.0), Drive::NONE),
        Joint::revolute(1, None, frames(1.0), Drive::NONE),
    ];
    let two = plain.clone().with_joints(joints).unwrap();
    let nan = two.clone().with_gears(vec![Gear::new(turn(0), turn(1), f64::NAN, 0.0)]);
    assert!(nan.unwrap_err().to_string().contains("ratio of a gear"));
    // The gear does not hold at the start, and assembly repairs it.
    let geared = two.with_gears(vec![Gear::new(turn(0), turn(1), 1.0, 0.1)]).unwrap();
    let states = [at(0.0), at(1.0)];
    let error = Simulation::new(geared.clone(), states.to_vec(), Motion::native(&geared));
    assert!(error.err().unwrap().to_string().contains("gear 0 is 1.000e-1"));
    let (found, _) = geared.assemble(&states).unwrap();
    let mut simulation = simulate(&geared, &found);
    run(&mut simulation, 3);
    // Removing a body of a gear removes the gear.
    simulation.remove_body_and_joints(1).unwrap();
    assert!(simulation.world().gears().is_empty());
    run(&mut simulation, 3);
}
