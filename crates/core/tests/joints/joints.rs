//! Joints: locked axes hold to rounding, and mechanisms move as closed forms predict.

use crate::common::prelude::*;
use tumble_core::joint::JointForce;

const G: f64 = 9.81;

fn bar(mass: f64, half: Vector3<f64>) -> RigidBody {
    let side = |k: usize| half[(k + 1) % 3].powi(2) + half[(k + 2) % 3].powi(2);
    let moments = Vector3::from_fn(|k, _| mass / 3.0 * side(k));
    RigidBody::with_box_corners(mass, Matrix3::from_diagonal(&moments), half).unwrap()
}

fn world(bodies: Vec<RigidBody>, joints: Vec<Joint>, time_step: f64) -> World {
    let parameters = Parameters { ground: None, time_step, ..Parameters::new(bodies) };
    euler(parameters).with_joints(joints).unwrap()
}

/// Runs `steps` steps and returns the last record. Every step must be solved and certified.
fn run(simulation: &mut Simulation<'_>, count: usize) -> StepRecord {
    last_step(simulation, count, converged(1e-9))
}

/// Largest joint error [m, rad].
fn error(world: &World, states: &[State]) -> f64 {
    let errors = world.joints().iter().map(|joint| joint.error(states).unwrap());
    errors.map(|(place, turn)| place.max(turn)).fold(0.0, f64::max)
}

/// Rotation by `angle` about y.
fn about_y(angle: f64) -> Vector4<f64> {
    Vector4::new((0.5 * angle).cos(), 0.0, (0.5 * angle).sin(), 0.0)
}

/// Frame at `anchor` with its z axis along the world's y axis.
fn hinge(anchor: Vector3<f64>) -> JointFrame {
    JointFrame::along(anchor, Vector3::y()).unwrap()
}

/// Box of 2 cm by 2 cm by 1 m that hangs from its end, released at 1 rad.
fn pendulum(time_step: f64, drive: Drive) -> (World, State) {
    let half = Vector3::new(0.01, 0.01, 0.5);
    let top = Vector3::new(0.0, 0.0, 0.5);
    let frames = [hinge(top), hinge(Vector3::new(0.0, 0.0, 2.0))];
    let world =
        world(vec![bar(2.0, half)], vec![Joint::revolute(0, None, frames, drive)], time_step);
    let attitude = about_y(1.0);
    let arm = rotation(&attitude) * top;
    let state = State { attitude, ..State::at_rest(Vector3::new(0.0, 0.0, 2.0) - arm) };
    (world, state)
}

/// Arithmetic–geometric mean.
fn agm(mut a: f64, mut b: f64) -> f64 {
    for _ in 0..40 {
        (a, b) = (0.5 * (a + b), (a * b).sqrt());
    }
    a
}

/// Checks the period T = 2π √(I/(m g l))/agm(1, cos(θ₀/2)), with the inertia about the pin. The
/// error must be of second order in h.
#[test]
fn a_pendulum_has_the_period_of_the_elliptic_integral() {
    let inertia = 2.0 / 3.0 * (0.01_f64.powi(2) + 0.5_f64.powi(2)) + 2.0 * 0.25;
    let exact =
        std::f64::consts::TAU * (inertia / (2.0 * G * 0.5)).sqrt() / agm(1.0, 0.5_f64.cos());
    let mut errors = Vec::new();
    for h in [4e-3, 2e-3, 1e-3] {
        let (world, state) = pendulum(h, Drive::NONE);
        let mut simulation =
            Simulation::new(world.clone(), [state], Motion::native(&world)).unwrap();
        // Passages through the lowest point are changes of the sign of x. Positions belong to the
        // end of a step.
        let (mut passages, mut before) = (Vec::new(), state.position[0]);
        while passages.len() < 9 {
            let record = run(&mut simulation, 1);
            let x = record.next().position[0];
            if before * x < 0.0 {
                let part = before / (before - x);
                passages.push((record.index as f64 + part) * h);
            }
            before = x;
            assert!(error(&world, record.next_states()) < 1e-13);
        }
        let period = (passages[8] - passages[0]) / 4.0;
        errors.push((period - exact).abs() / exact);
    }
    assert!(errors[2] < 1e-6, "{errors:?}");
    let order = (errors[0] / errors[2]).log2() / 2.0;
    assert!((order - 2.0).abs() < 0.2, "{errors:?}: order {order}");
}

/// Checks that a hinge with dry friction holds m g l sin θ to a part in 10⁹, and slips above.
#[test]
fn dry_friction_holds_to_its_last_part() {
    let moment = 2.0 * G * 0.5 * 1.0_f64.sin();
    for (part, holds) in [(1.0 + 1e-9, true), (1.0 - 1e-6, false)] {
        let drive = Drive { friction: part * moment, ..Drive::NONE };
        let (world, state) = pendulum(1e-3, drive);
        let mut simulation =
            Simulation::new(world.clone(), [state], Motion::native(&world)).unwrap();
        let record = run(&mut simulation, 200);
        let turned = (record.first().solution.joints[0].angles[2].abs() - 1.0).abs();
        let torque = record.first().solution.joints[0].torque[2].abs();
        if holds {
            assert!(turned < 1e-12, "{turned}");
            assert!((torque - moment).abs() < 1e-9 * moment, "{torque} {moment}");
        } else {
            // θ'' = (M/I) (10⁻⁶ − θ cot 1), starting half a step before the start.
            let inertia = 2.0 / 3.0 * (0.01_f64.powi(2) + 0.5_f64.powi(2)) + 2.0 * 0.25;
            let falling = 1.0 / 1.0_f64.tan();
            let rate = (moment / inertia * falling).sqrt();
            let expected = 1e-6 / falling * (1.0 - (rate * 0.2005).cos());
            assert!((turned - expected).abs() < 1e-3 * expected, "{turned} {expected}");
        }
    }
}

/// Checks the residual of a force beyond the friction limit. It is the speed that the excess
/// causes. A slender rod counts with its own inertia, a light body on a heavy one with the light
/// mass.
#[test]
fn a_force_too_much_counts_as_the_speed_that_it_makes() {
    let (h, most, excess) = (1e-3, 5.0, 1e-3);
    let drive = Drive { friction: most, ..Drive::NONE };
    let (rod, state) = pendulum(h, drive);
    let length = rod.joints()[0].length(rod.bodies());
    let force = JointForce {
        torque: Vector3::z() * (most + excess),
        ..JointForce::none(Vector3::z() * 1.0)
    };
    let states = [state];
    let found = rod.joints()[0].residual(rod.bodies(), &states, &states, &force, &rod.step_map());
    let inertia = 2.0 / 3.0 * (0.01_f64.powi(2) + 0.5_f64.powi(2));
    let expected = length * h * excess / inertia;
    assert!((found.drive - expected).abs() < 1e-6 * expected, "{found:?} {expected}");

    let along = JointFrame::along(Vector3::zeros(), Vector3::x()).unwrap();
    let slide = Joint::prismatic(0, Some(1), [along; 2], drive);
    let bodies = [1000.0, 1.0].map(|mass| bar(mass, Vector3::repeat(0.1)));
    let pair = world(bodies.to_vec(), vec![slide], h);
    let states = [State::at_rest(Vector3::zeros()); 2];
    let force =
        JointForce { force: Vector3::z() * (most + excess), ..JointForce::none(Vector3::zeros()) };
    let found =
        pair.joints()[0].residual(pair.bodies(), &states, &states, &force, &pair.step_map());
    let expected = h * excess * (1.0 / 1000.0 + 1.0);
    assert!((found.drive - expected).abs() < 1e-6 * expected, "{found:?} {expected}");
}

/// Checks that a limit is reached and held exactly, with the torque of the weight.
#[test]
fn a_limit_stops_a_hinge_where_it_is() {
    let drive = Drive { limits: Some([0.25, 2.0]), ..Drive::NONE };
    let (world, state) = pendulum(1e-3, drive);
    let mut simulation = Simulation::new(world.clone(), [state], Motion::native(&world)).unwrap();
    let start = world.joints()[0].coordinates(&[state]).unwrap();
    let angle = world.joints()[0].turns(&start, &Vector3::zeros())[2];
    assert!((angle - 1.0).abs() < 1e-12, "{angle}");
    let record = run(&mut simulation, 3000);
    let force = record.first().solution.joints[0];
    assert!((force.angles[2] - 0.25).abs() < 1e-12, "{}", force.angles[2]);
    let moment = 2.0 * G * 0.5 * 0.25_f64.sin();
    assert!((force.torque[2] - moment).abs() < 1e-9, "{} {moment}", force.torque[2]);
}

/// Checks that a motor with enough torque holds its speed.
#[test]
fn a_motor_holds_its_speed() {
    let motor = Motor::Speed { target: 6.0, max_force: 30.0 };
    let (world, state) = pendulum(1e-3, Drive { motor: Some(motor), ..Drive::NONE });
    let mut simulation = Simulation::new(world.clone(), [state], Motion::native(&world)).unwrap();
    let before = run(&mut simulation, 500).first().solution.joints[0].angles[2];
    let after = run(&mut simulation, 1000).first().solution.joints[0].angles[2];
    // Turns are counted: the hinge has turned more than once.
    assert!((after - before - 6.0).abs() < 1e-9, "{}", after - before);
}

/// Checks twenty links released horizontally. Joint errors do not grow, and the energy has no
/// trend.
#[test]
fn a_chain_keeps_its_joints() {
    let (links, half) = (20, 0.1);
    let body = bar(1.0, Vector3::new(half, 0.02, 0.02));
    let ends = [Vector3::new(-half, 0.0, 0.0), Vector3::new(half, 0.0, 0.0)];
    let mut joints = vec![Joint::spherical(
        0,
        None,
        [JointFrame::at(ends[0]), JointFrame::at(Vector3::new(0.0, 0.0, 5.0))],
    )];
    joints.extend((1..links).map(|k| {
        Joint::spherical(k, Some(k - 1), [JointFrame::at(ends[0]), JointFrame::at(ends[1])])
    }));
    let world = world(vec![body; links], joints, 1e-3);
    let states =
        (0..links).map(|k| State::at_rest(Vector3::new(half * (2 * k + 1) as f64, 0.0, 5.0)));
    let mut simulation = Simulation::new(world.clone(), states, Motion::native(&world)).unwrap();
    let start = tumble_core::simulation::energy::total(&world, simulation.states());
    let mut iterations = 0;
    for _ in 0..20 {
        let mut record = StepRecord::new();
        for _ in 0..100 {
            record = run(&mut simulation, 1);
            iterations += record.report().iterations;
        }
        assert!(error(&world, record.next_states()) < 1e-12);
    }
    let end = tumble_core::simulation::energy::total(&world, simulation.states());
    println!("{} iterations a step; energy {start} -> {end}", f64::from(iterations) / 2000.0);
    assert!((end - start).abs() < 1e-2 * start.abs(), "{start} {end}");
}

/// Checks that a free chain conserves its momenta, for any forces between its links.
#[test]
fn a_free_chain_keeps_its_momenta() {
    let half = Vector3::new(0.15, 0.04, 0.02);
    let bodies: Vec<_> = (0..5).map(|k| bar(1.0 + 0.3 * f64::from(k), half)).collect();
    let ends = [-Vector3::x() * 0.15, Vector3::x() * 0.15];
    let joints = (1..5).map(|k| {
        let frames = [
            JointFrame::along(ends[0], Vector3::new(0.3, 1.0, 0.2)).unwrap(),
            JointFrame::along(ends[1], Vector3::new(0.3, 1.0, 0.2)).unwrap(),
        ];
        let drive = Drive { friction: 0.02, stiffness: 0.5, damping: 0.01, ..Drive::NONE };
        Joint::revolute(k, Some(k - 1), frames, drive)
    });
    let mut parameters = world(bodies.clone(), Vec::new(), 4e-3).parameters().clone();
    parameters.gravity = Vector3::zeros();
    let world = euler(parameters).with_joints(joints.collect()).unwrap();
    // The chain rotates rigidly at first.
    let spin = Vector3::new(1.0, 3.0, -2.0);
    let states = (0..5).map(|k| {
        let place = Vector3::x() * (0.3 * f64::from(k));
        State { velocity: spin.cross(&place), spin, ..State::at_rest(place) }
    });
    let mut simulation = Simulation::new(world.clone(), states, Motion::native(&world)).unwrap();
    // P = Σ m v, L = Σ m r × v + A P⁻(ω), with positions and velocities of the same state.
    let momenta = |states: &[State]| {
        let (mut linear, mut angular) = (Vector3::zeros(), Vector3::zeros());
        for (body, state) in world.bodies().iter().zip(states) {
            let h = world.time_step();
            linear += state.velocity * body.mass();
            angular += state.position.cross(&state.velocity) * body.mass();
            let own = world.rotation().momentum(body.inertia(), &state.spin, h);
            angular += state.pose().rotation * own;
        }
        (linear, angular)
    };
    let (linear, angular) = momenta(simulation.states());
    for _ in 0..10 {
        let record = run(&mut simulation, 100);
        let now = momenta(record.next_states());
        assert!((now.0 - linear).norm() < 1e-12 * linear.norm(), "{} {linear}", now.0);
        assert!((now.1 - angular).norm() < 1e-12 * angular.norm(), "{} {angular}", now.1);
        assert!(error(&world, record.next_states()) < 1e-13);
    }
}

/// Checks a door on two hinges, which has five redundant constraints. For small ℓ the hinges carry
/// only forces: m g/2 each, and m g w/(2 d) away from and towards the post.
#[test]
fn a_door_shares_its_weight_by_the_length_of_its_hinges() {
    let (mass, width, apart) = (20.0, 0.9, 1.4);
    let door = bar(mass, Vector3::new(0.5 * width, 0.02, 1.0));
    let hinge = |z: f64| {
        let anchor = Vector3::new(-0.5 * width, 0.0, z);
        let frames = [JointFrame::at(anchor), JointFrame::at(anchor)];
        Joint::revolute(0, None, frames, Drive::NONE)
    };
    let force = |length: f64| {
        let joints = [0.5 * apart, -0.5 * apart].map(|z| hinge(z).with_length(length));
        let world = world(vec![door.clone()], joints.to_vec(), 1e-3);
        let state = State::at_rest(Vector3::zeros());
        let mut simulation =
            Simulation::new(world.clone(), [state], Motion::native(&world)).unwrap();
        let record = run(&mut simulation, 20);
        assert!((record.next().position - state.position).norm() < 1e-13);
        record.first().solution.joints.iter().map(|joint| joint.force).collect::<Vec<_>>()
    };
    let forces = force(1e-3);
    for (force, side) in forces.iter().zip([-1.0, 1.0]) {
        assert!((force[2] - 0.5 * mass * G).abs() < 1e-6, "{force}");
        let pull = mass * G * 0.5 * width / apart;
        assert!((force[0] - side * pull).abs() < 1e-3 * pull, "{force} {pull}");
    }
    // Wide bearings carry a part of it as moments.
    assert!(force(0.67)[0][0].abs() < 0.6 * forces[0][0].abs());
}

/// Checks that a pendulum's bob stops at the ground. The contact carries the load that the rod does
/// not.
#[test]
fn a_mechanism_touches_the_ground() {
    let arm = bar(1.0, Vector3::new(0.5, 0.02, 0.02));
    let anchor = Vector3::new(-0.5, 0.0, 0.0);
    let frames = [hinge(anchor), hinge(Vector3::new(0.0, 0.0, 0.3))];
    let mut parameters = world(vec![arm], Vec::new(), 1e-3).parameters().clone();
    parameters.ground = Some(Plane::level());
    parameters.friction = 0.0;
    let joint = Joint::revolute(0, None, frames, Drive::NONE);
    let world = euler(parameters).with_joints(vec![joint]).unwrap();
    let state = State::at_rest(Vector3::new(0.5, 0.0, 0.3));
    let mut simulation = Simulation::new(world.clone(), [state], Motion::native(&world)).unwrap();
    let record = run(&mut simulation, 1500);
    let low = world.lowest_height(record.next_states());
    assert!(low.abs() < 1e-9, "{low}");
    // Moments about the pin: the normal force at the tip balances the weight.
    let moved: f64 = record
        .first()
        .contacts
        .iter()
        .zip(record.first().solution.forces())
        .map(|(contact, force)| (record.states()[0].position + contact.arm)[0] * force[2])
        .sum();
    let weight = G * record.states()[0].position[0];
    assert!((moved - weight).abs() < 1e-6 * weight, "{moved} {weight}");
    assert!(error(&world, record.next_states()) < 1e-13);
}

/// Checks a pendulum that hits a wall. It is fast and thin enough to pass in one step. The search
/// for contacts must use the path along the joint instead of free flight.
#[test]
fn a_pendulum_meets_a_wall_on_its_way() {
    let bob = RigidBody::solid(1.0, &[Piece::cuboid(Vector3::repeat(0.01)).unwrap()]).unwrap().0;
    let frames = [hinge(Vector3::new(0.0, 0.0, 1.0)), hinge(Vector3::new(0.0, 0.0, 1.0))];
    let free = world(vec![bob], vec![Joint::revolute(0, None, frames, Drive::NONE)], 5e-3);
    // Close to the lowest point, thin, and where the path is curved.
    for (x, speed) in [(0.3, 4.0), (0.8, 8.0), (0.9, 8.0)] {
        let place = Vector3::new(x, 0.0, 0.0);
        let wall = Piece::cuboid(Vector3::new(0.005, 1.0, 2.0)).unwrap();
        let piece = wall.moved_by(&Matrix3::identity(), &place).unwrap();
        let world = free.clone().with_fixed(vec![piece]);
        let mut state = State::at_rest(Vector3::zeros());
        state.velocity = Vector3::x() * speed;
        state.spin = Vector3::y() * -speed;
        let mut simulation =
            Simulation::new(world.clone(), [state], Motion::native(&world)).unwrap();
        let mut record = StepRecord::new();
        let mut met = false;
        for _ in 0..200 {
            simulation.step(&mut record).unwrap();
            assert!(record.residual() < 1e-9, "{:?}", record.certificate());
            assert_ne!(record.status(), StepStatus::Wild);
            let corner = record.next().position[0];
            assert!(corner < x, "{x} {speed}: {corner}");
            assert!(record.overlap() < 1e-9, "{}", record.overlap());
            met |=
                record.first().solution.contacts.iter().any(|contact| contact.normal_force > 0.0);
        }
        assert!(met);
    }
}

/// Checks that bodies connected by a joint do not touch, unless the joint allows it.
#[test]
fn tied_bodies_do_not_touch() {
    let cube = bar(1.0, Vector3::repeat(0.1));
    let frames = [JointFrame::at(Vector3::zeros()), JointFrame::at(Vector3::new(0.15, 0.0, 0.0))];
    let joint = Joint::revolute(1, Some(0), frames, Drive::NONE);
    let states = [State::at_rest(Vector3::zeros()), State::at_rest(Vector3::new(0.15, 0.0, 0.0))];
    let start = |joint: Joint| {
        let world = world(vec![cube.clone(), cube.clone()], vec![joint], 1e-3);
        Simulation::new(world.clone(), states, Motion::native(&world)).map(|_| ())
    };
    assert!(start(joint.clone()).is_ok());
    let refused = start(joint.colliding()).unwrap_err().to_string();
    assert!(refused.contains("overlap"), "{refused}");
}

/// Checks that invalid joints are refused with their name and value.
#[test]
fn invalid_joints_are_rejected() {
    let cube = bar(1.0, Vector3::repeat(0.1));
    let plain = world(vec![cube], Vec::new(), 1e-3);
    let frame = JointFrame::at(Vector3::zeros());
    let refused = |joint: Joint| plain.clone().with_joints(vec![joint]).unwrap_err().to_string();
    assert!(refused(Joint::spherical(1, None, [frame; 2])).contains("joint"));
    assert!(refused(Joint::spherical(0, Some(0), [frame; 2])).contains("joint"));
    let drive = Drive { friction: f64::NAN, ..Drive::NONE };
    assert!(refused(Joint::revolute(0, None, [frame; 2], drive)).contains("friction of a joint"));
    let drive = Drive { limits: Some([1.0, 0.0]), ..Drive::NONE };
    assert!(refused(Joint::prismatic(0, None, [frame; 2], drive)).contains("upper limit"));
    let far = JointFrame::at(Vector3::new(0.0, 0.0, 0.01));
    let world = plain.with_joints(vec![Joint::fixed(0, None, [frame, far])]).unwrap();
    let apart =
        Simulation::new(world.clone(), [State::at_rest(Vector3::zeros())], Motion::native(&world));
    let apart = apart.map(|_| ()).unwrap_err().to_string();
    assert!(apart.contains("1.000e-2 m"), "{apart}");
    assert!(JointFrame::along(Vector3::zeros(), Vector3::zeros()).is_err());
}

/// Checks a cardan shaft bent by β. Its output angle is θ₂ with tan θ₂ = tan θ₁ cos β, over many
/// turns. θ₁ counts from the pose with the x axis in the plane of the bend.
#[test]
fn a_universal_joint_turns_as_a_cardan_shaft() {
    let bend = 0.6_f64;
    let shaft = || bar(1.0, Vector3::new(0.02, 0.02, 0.3));
    let along = Vector3::new(bend.sin(), 0.0, bend.cos());
    let second = Vector4::new((0.5 * bend).cos(), 0.0, (0.5 * bend).sin(), 0.0);
    let turned = |q: &Vector4<f64>| rotation(q);
    let tip = Vector3::new(0.0, 0.0, 0.3);
    let states = [State::at_rest(-tip), State { attitude: second, ..State::at_rest(along * 0.3) }];
    // Both shafts rotate in bearings of the world about their own axes. The first one is driven.
    let motor = Drive { motor: Some(Motor::Speed { target: 5.0, max_force: 1e3 }), ..Drive::NONE };
    let first = Joint::revolute(0, None, [JointFrame::at(-tip), JointFrame::at(-2.0 * tip)], motor);
    let end = JointFrame { anchor: along * 0.6, attitude: second };
    // The second shaft is free along its axis, so that no constraint is redundant.
    let bearing = Joint::cylindrical(1, None, [JointFrame::at(tip), end], [Drive::NONE; 2]);
    // The x axis of the second shaft is perpendicular to the y axis of the first.
    let cross = Joint::universal(1, Some(0), [JointFrame::at(-tip), JointFrame::at(tip)]);
    // At the start the x axis of the second shaft is in the plane of the bend, perpendicular to y
    // of the first.
    let mut parameters = world(vec![shaft(), shaft()], Vec::new(), 1e-3).parameters().clone();
    parameters.gravity = Vector3::zeros();
    let world = euler(parameters).with_joints(vec![first, bearing, cross]).unwrap();
    let mut simulation = Simulation::new(world.clone(), states, Motion::native(&world)).unwrap();
    for _ in 0..40 {
        let record = run(&mut simulation, 50);
        let states = record.next_states();
        assert!(error(&world, states) < 1e-12, "{}", error(&world, states));
        let y = turned(&states[0].attitude) * Vector3::y();
        let x = turned(&states[1].attitude) * Vector3::x();
        assert!(x.dot(&y).abs() < 1e-12);
        let (one, two) = (
            record.first().solution.joints[0].angles[2],
            record.first().solution.joints[1].angles[2],
        );
        let missed = two.sin() * one.cos() - one.sin() * two.cos() * bend.cos();
        assert!(missed.abs() < 1e-12, "{one} {two}");
    }
}

/// Checks a rod on a ball joint with a cone. It swings until the cone and stays there, in any
/// direction. The twist stops at its own limit.
#[test]
fn a_ball_joint_keeps_its_cone_and_its_twist() {
    let half = Vector3::new(0.02, 0.03, 0.5);
    let top = Vector3::new(0.0, 0.0, 0.5);
    let cone = 0.4;
    for direction in [0.0_f64, 0.9, 2.5, 4.0] {
        let limits = Drive { limits: Some([-0.3, 0.5]), force: 0.05, ..Drive::NONE };
        let frames = [JointFrame::at(top), JointFrame::at(Vector3::zeros())];
        let world =
            world(vec![bar(2.0, half)], vec![Joint::ball(0, None, frames, cone, limits)], 1e-3);
        let mut state = State::at_rest(-top);
        // A constant push to the side.
        let push = Vector3::new(direction.cos(), direction.sin(), 0.0);
        let mut simulation =
            Simulation::new(world.clone(), [state], Motion::native(&world)).unwrap();
        let wrench = Wrench { force: push * 30.0, torque: Vector3::zeros() };
        simulation.set_wrench(0, wrench).unwrap();
        for _ in 0..30 {
            let record = run(&mut simulation, 100);
            state = *record.next();
            let z = rotation(&state.attitude) * Vector3::z();
            let swing = z.xy().norm().atan2(z[2]);
            assert!(swing < cone + 1e-12, "{swing}");
            assert!(error(&world, &[state]) < 1e-13);
        }
        let record = run(&mut simulation, 1);
        let joint = record.first().solution.joints[0];
        let z = rotation(&record.next().attitude) * Vector3::z();
        // The cone carries the moment of the push and the weight. The rod's top leans against the
        // push, so that its lower end moves with it.
        let lean = -push.dot(&z);
        assert!((lean - cone.sin()).abs() < 1e-6, "{direction}: {z}");
        let moment = 30.0 * 0.5 * cone.cos() - 2.0 * G * 0.5 * cone.sin();
        assert!((joint.torque[0] + moment).abs() < 1e-3 * moment, "{} {moment}", joint.torque[0]);
        assert!((joint.angles[2] - 0.5).abs() < 1e-9, "{}", joint.angles[2]);
    }
    let frames = [JointFrame::at(top), JointFrame::at(Vector3::zeros())];
    let plain = world(vec![bar(2.0, half)], Vec::new(), 1e-3);
    let refused = |joint: Joint| plain.clone().with_joints(vec![joint]).unwrap_err().to_string();
    assert!(
        refused(Joint::ball(0, None, frames, 0.0, Drive::NONE)).contains("cone of a ball joint")
    );
}

/// Checks light rods kept taut by a heavy bob. They are stable for h ω < 2. Above, their vibration
/// makes energy, so that steps are taken in shorter ones. The record reports h ω.
#[test]
fn a_taut_chain_is_as_stable_as_its_record_tells() {
    let (count, half) = (6, 0.05);
    let end = Vector3::z() * half;
    let pulled = |h: f64| {
        let mut bodies = vec![bar(0.01, Vector3::new(0.002, 0.002, half)); count];
        bodies.push(bar(1.0, Vector3::repeat(0.05)));
        let frame = |anchor: Vector3<f64>| JointFrame::at(anchor);
        let mut joints = vec![Joint::spherical(0, None, [frame(end), frame(Vector3::zeros())])];
        joints.extend(
            (1..count).map(|k| Joint::spherical(k, Some(k - 1), [frame(end), frame(-end)])),
        );
        let bob = [frame(Vector3::zeros()), frame(-end)];
        joints.push(Joint::spherical(count, Some(count - 1), bob));
        let world = world(bodies, joints, h);
        let mut states: Vec<_> =
            (0..count).map(|k| State::at_rest(-end * (2 * k + 1) as f64)).collect();
        states.push(State::at_rest(-end * (2 * count) as f64));
        // A small sideways velocity.
        states[count].velocity = Vector3::x() * 1e-6;
        let (states, _) = world.assemble(&states).unwrap();
        let mut simulation =
            Simulation::new(world.clone(), states, Motion::native(&world)).unwrap();
        let (mut record, mut told, mut aside) = (StepRecord::new(), 0.0, 0.0_f64);
        for _ in 0..1000 {
            simulation.step(&mut record).unwrap();
            if record.index == 5 {
                told = record.stiffness();
            }
            let off = record.next_states().iter().map(|state| state.position.xy().norm());
            aside = off.fold(aside, f64::max);
            if record.status() != StepStatus::Converged {
                return (told, false);
            }
        }
        assert!(aside < 1e-4, "{aside}");
        (told, true)
    };
    // Six rods between two ends: ω² = 6 T (1 − cos κ)/(m L (2 + cos κ)) with κ = 5π/6. For any
    // number of rods the bound is 12 T/(m L). The tension is the weight of the bob and the rods
    // below.
    let cosine = (5.0 / 6.0 * std::f64::consts::PI).cos();
    let tension = G * 1.045;
    let fastest = (6.0 * tension * (1.0 - cosine) / (0.01 * 0.1 * (2.0 + cosine))).sqrt();
    let bound = (12.0 * tension / (0.01 * 0.1)).sqrt();
    for (part, stays) in [(0.96, true), (1.05, false)] {
        let h = 2.0 * part / fastest;
        let (told, is_solved) = pulled(h);
        assert!((told - h * bound).abs() < 0.02 * told, "{told} {}", h * bound);
        assert_eq!(is_solved, stays, "{part}");
    }
}

/// Checks a box on four corners with a pendulum hinged inside. A torque about its diagonal unloads
/// one corner, and the other three deviate from a linear pressure. Without the torque all four
/// carry a quarter again, although (0, ½, ½, 0) obeys the laws as well.
#[test]
fn corner_forces_are_equal_again_after_a_torque() {
    let bodies =
        vec![bar(4.0, Vector3::new(0.2, 0.2, 0.1)), bar(1.0, Vector3::new(0.02, 0.02, 0.05))];
    let joint = Joint::revolute(
        1,
        Some(0),
        [hinge(Vector3::new(0.0, 0.0, 0.05)), hinge(Vector3::new(0.0, 0.0, 0.1))],
        Drive::NONE,
    );
    let parameters = Parameters::new(bodies);
    let world = euler(parameters).with_joints(vec![joint]).unwrap();
    let states =
        [State::at_rest(Vector3::new(0.0, 0.0, 0.1)), State::at_rest(Vector3::new(0.0, 0.0, 0.15))];
    let mut simulation = Simulation::new(world.clone(), states, Motion::native(&world)).unwrap();
    let corners = |record: &StepRecord| {
        let of_box = record.first().contacts.iter().zip(&record.first().solution.contacts);
        let of_box = of_box.filter(|(contact, _)| contact.key.body == 0);
        of_box.map(|(_, force)| force.normal_force).collect::<Vec<_>>()
    };
    let weight = 5.0 * G;
    for torque in [Vector3::new(7.0, -7.0, 0.0), Vector3::zeros()] {
        simulation.set_wrench(0, Wrench { force: Vector3::zeros(), torque }).unwrap();
        let record = run(&mut simulation, 5);
        let forces = corners(&record);
        assert_eq!(forces.len(), 4);
        let least = forces.iter().copied().fold(f64::INFINITY, f64::min);
        if torque == Vector3::zeros() {
            for force in forces {
                // The selection rule holds to the size of its compliance.
                assert!((force - 0.25 * weight).abs() < 1e-5 * weight, "{force}");
            }
        } else {
            assert!(least.abs() < 1e-9 * weight, "{least}");
        }
    }
}
