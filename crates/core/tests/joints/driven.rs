//! Motors and forces set between steps or over time, and bodies with prescribed motion, against
//! closed forms.

use crate::common::prelude::*;
use tumble_core::joint::{Course, JointLoad, Knots};
use tumble_core::simulation::save::Saved;

const G: f64 = 9.81;
const H: f64 = 1e-3;

/// Solid box.
fn solid(mass: f64, half: Vector3<f64>) -> RigidBody {
    RigidBody::solid(mass, &[Piece::cuboid(half).unwrap()]).unwrap().0
}

fn parameters(bodies: Vec<RigidBody>, gravity: f64) -> Parameters {
    Parameters {
        ground: None,
        gravity: Vector3::new(0.0, 0.0, -gravity),
        friction: 0.4,
        time_step: H,
        ..Parameters::new(bodies)
    }
}

/// Takes one step, which must be solved and certified.
fn step(simulation: &mut Simulation<'_>, record: &mut StepRecord) {
    simulation.step(record).unwrap();
    let status = record.status();
    let solved = matches!(status, StepStatus::Converged | StepStatus::Retried | StepStatus::Free);
    assert!(solved, "step {}: {status}, {:?}", record.index, record.certificate());
    assert!(record.residual() < 1e-9, "{:?}", record.certificate());
}

/// Body that slides along x under `drive`, without gravity.
fn slide(mass: f64, drive: Drive) -> World {
    let along = JointFrame::along(Vector3::zeros(), Vector3::x()).unwrap();
    let body = solid(mass, Vector3::repeat(0.1));
    let joint = Joint::prismatic(0, None, [along; 2], drive);
    euler(parameters(vec![body], 0.0)).with_joints(vec![joint]).unwrap()
}

const ALONG: JointAxis = JointAxis::Linear(2);

/// A hinge of 0.01 kg m² under a torque of 1 N m/s rests until 0.5 N m, and then has a friction of
/// 0.05 N m: ω(0.6 s) = (0.6² − 0.5²)/0.02 − 0.1 · 0.05/0.01 = 5 rad/s.
#[test]
fn a_joint_rests_until_its_static_friction() {
    let along = JointFrame::along(Vector3::zeros(), Vector3::x()).unwrap();
    let body = RigidBody::from_pieces(
        1.0,
        Matrix3::from_diagonal_element(0.01),
        vec![Piece::cuboid(Vector3::repeat(0.1)).unwrap()],
    );
    for integrator in [Integrator::Euler, Integrator::Leapfrog] {
        let drive = Drive { friction: 0.05, static_friction: Some(0.5), ..Drive::NONE };
        let joint = Joint::revolute(0, None, [along; 2], drive);
        let world = euler(parameters(vec![body.clone().unwrap()], 0.0));
        let world = world.with_integrator(integrator).with_joints(vec![joint]).unwrap();
        let motion = Motion::native(&world);
        let mut simulation =
            Simulation::new(world, [State::at_rest(Vector3::zeros())], motion).unwrap();
        let knots = vec![(0.0, Vector3::zeros()), (1.0, Vector3::z())];
        let torque = Polyline::new(knots).unwrap();
        simulation.set_joint_load(0, JointLoad { torque, ..JointLoad::default() }).unwrap();
        let mut record = StepRecord::new();
        for k in 0..600 {
            step(&mut simulation, &mut record);
            let speed = simulation.state().spin.norm();
            assert!(k >= 500 || speed < 1e-9, "{k}: {speed}");
        }
        let speed = simulation.state().spin.norm();
        // The jump of the friction, 45 rad/s², acts up to two steps late.
        assert!((speed - 5.0).abs() < 2.0 * 45.0 * H, "{speed}");
    }
}

/// Checks two falling bodies after their sliding joint has come to its stop. Their centre of mass has the velocity
/// −g t of the instant in every row but the two of the stop.
#[test]
fn bodies_fall_with_the_velocity_of_the_instant_after_a_stop() {
    let axis = |z: f64| JointFrame::along(Vector3::new(0.0, 0.0, z), Vector3::z()).unwrap();
    let drive = Drive { limits: Some([-0.01, 0.01]), ..Drive::NONE };
    let bodies = [1.0, 2.0].map(|mass| solid(mass, Vector3::repeat(0.1)));
    let joint = Joint::prismatic(0, Some(1), [axis(0.0), axis(0.5)], drive);
    let world = euler(parameters(bodies.to_vec(), G)).with_joints(vec![joint]).unwrap();
    let world = world.with_integrator(Integrator::Leapfrog);
    let mut states = [State::at_rest(Vector3::z() * 0.5), State::at_rest(Vector3::zeros())];
    // The stop is at 20 ms.
    states[0].velocity[2] = 0.5;
    let located = world.clone().with_impacts(tumble_core::world::Impacts::Located);
    let accurate = world.with_accuracy(Some(1e-3)).unwrap();
    for world in [located, accurate] {
        let mut simulation =
            Simulation::new(world.clone(), states, Motion::native(&world)).unwrap();
        let mut record = StepRecord::new();
        for k in 1..=100 {
            step(&mut simulation, &mut record);
            let [one, other] = [0, 1].map(|body| simulation.states()[body].velocity[2]);
            let (mean, fallen) = ((one + 2.0 * other) / 3.0, 0.5 / 3.0 - G * H * f64::from(k));
            let is_exact = (mean - fallen).abs() < 1e-9;
            assert!((20..=21).contains(&k) || is_exact, "{k}: {mean} {fallen}");
        }
        assert!(
            (simulation.states()[0].velocity[2] - simulation.states()[1].velocity[2]).abs() < 1e-9
        );
    }
}

/// A slide of 1 kg with 1 N of dry friction and 5 N at rest moves against a force of 3.5 N. It stops and stays,
/// at whichever part of a step.
#[test]
fn a_joint_that_turns_around_holds() {
    for (number, integrator) in
        (0..20).flat_map(|number| [(number, Integrator::Euler), (number, Integrator::Leapfrog)])
    {
        let drive = Drive { friction: 1.0, static_friction: Some(5.0), force: -3.5, ..Drive::NONE };
        let world = slide(1.0, drive).with_integrator(integrator);
        let speed = 0.1 + 0.0013 * f64::from(number);
        let start = State { velocity: Vector3::x() * speed, ..State::at_rest(Vector3::zeros()) };
        let motion = Motion::native(&world);
        let mut simulation = Simulation::new(world, [start], motion).unwrap();
        let mut record = StepRecord::new();
        for _ in 0..(0.1 / H) as usize {
            step(&mut simulation, &mut record);
        }
        let end = simulation.state();
        assert!(end.velocity.norm() < 1e-9, "{number}: {}", end.velocity);
        let way = speed * speed / 9.0;
        assert!((end.position.x - way).abs() < speed * H, "{number}: {} {way}", end.position.x);
    }
}

/// Checks v = Σ f h/m for a force that is set in every step, and for the same force over time.
#[test]
fn a_force_is_set_from_step_to_step_and_over_time() {
    let force = |t: f64| 3.0 - 40.0 * t;
    let world = slide(2.0, Drive::NONE);
    let simulation = || {
        Simulation::new(world.clone(), [State::at_rest(Vector3::zeros())], Motion::native(&world))
            .unwrap()
    };
    let (mut set, mut timed, mut record) = (simulation(), simulation(), StepRecord::new());
    let knots = vec![(0.0, force(0.0)), (0.2, force(0.2))];
    let knots = knots.into_iter().map(|(t, f)| (t, Vector3::z() * f)).collect();
    let load = JointLoad { force: Polyline::new(knots).unwrap(), ..JointLoad::default() };
    timed.set_joint_load(0, load).unwrap();
    let mut expected = 0.0;
    for k in 0..200 {
        let mean = force((f64::from(k) + 0.5) * H);
        set.set_drive(0, ALONG, Drive { force: mean, ..Drive::NONE }).unwrap();
        step(&mut set, &mut record);
        step(&mut timed, &mut record);
        expected += mean * H / 2.0;
        for simulation in [&set, &timed] {
            let speed = simulation.state().velocity[0];
            assert!((speed - expected).abs() < 1e-13, "{k}: {speed} {expected}");
        }
    }
}

/// Checks a motor with a changing target. It follows the target, and at its force limit it applies
/// the limit.
#[test]
fn a_motor_follows_a_target_that_changes() {
    let world = slide(2.0, Drive { friction: 1.0, ..Drive::NONE });
    let mut simulation =
        Simulation::new(world.clone(), [State::at_rest(Vector3::zeros())], Motion::native(&world))
            .unwrap();
    let mut record = StepRecord::new();
    for k in 0..300 {
        let target = (0.02 * f64::from(k)).sin();
        simulation.set_motor(0, ALONG, Some(Motor::Speed { target, max_force: 60.0 })).unwrap();
        let before = simulation.state().velocity[0];
        step(&mut simulation, &mut record);
        let after = simulation.state().velocity[0];
        assert!((after - target).abs() < 1e-12, "{k}: {after} {target}");
        // The friction of the axis acts together with the motor. The joint's force is the sum.
        let force = record.first().solution.joints[0].force[2];
        assert!((force - 2.0 * (after - before) / H).abs() < 1e-9, "{force}");
    }
    // At most 61 N on 2 kg.
    simulation.set_motor(0, ALONG, Some(Motor::Speed { target: -9.0, max_force: 60.0 })).unwrap();
    let before = simulation.state().velocity[0];
    step(&mut simulation, &mut record);
    let lost = before - simulation.state().velocity[0];
    let most = if before > 0.0 { 61.0 } else { 59.0 };
    assert!((lost - most * H / 2.0).abs() < 1e-12, "{lost}");
    // Without the motor only the friction remains.
    simulation.set_motor(0, ALONG, None).unwrap();
    assert_eq!(simulation.world().joints()[0].linear()[2], world.joints()[0].linear()[2]);
}

/// Checks a = f/(m + I): an armature adds inertia to its own axis only. It keeps its speed like a
/// flywheel.
#[test]
fn an_armature_is_inertia_of_its_axis() {
    let world = slide(2.0, Drive { armature: 3.0, force: 10.0, ..Drive::NONE });
    let mut simulation =
        Simulation::new(world.clone(), [State::at_rest(Vector3::zeros())], Motion::native(&world))
            .unwrap();
    let mut record = StepRecord::new();
    for k in 1..=500 {
        step(&mut simulation, &mut record);
        let speed = simulation.state().velocity[0];
        assert!((speed - 10.0 / 5.0 * H * f64::from(k)).abs() < 1e-12, "{speed}");
    }
    simulation.set_drive(0, ALONG, Drive { armature: 3.0, ..Drive::NONE }).unwrap();
    for _ in 0..100 {
        step(&mut simulation, &mut record);
        assert!((simulation.state().velocity[0] - 1.0).abs() < 1e-12);
    }
    // A hinge with many turns: I_y + armature.
    let body = solid(1.0, Vector3::new(0.3, 0.1, 0.1));
    let inertia = body.inertia()[(1, 1)];
    let frame = JointFrame::along(Vector3::zeros(), Vector3::y()).unwrap();
    let drive = Drive { armature: 0.5, force: 0.7, ..Drive::NONE };
    let hinge = Joint::revolute(0, None, [frame; 2], drive);
    let world = euler(parameters(vec![body], 0.0)).with_joints(vec![hinge]).unwrap();
    let mut simulation =
        Simulation::new(world.clone(), [State::at_rest(Vector3::zeros())], Motion::native(&world))
            .unwrap();
    for _ in 0..6000 {
        step(&mut simulation, &mut record);
    }
    let turned = record.first().solution.joints[0].angles[2];
    let expected = 0.5 * 0.7 / (inertia + 0.5) * (6000.0 * 6001.0) * H * H;
    assert!((turned - expected).abs() < 1e-4 * expected, "{turned} {expected}");
}

/// Checks light links with heavy rotors, as in a legged robot. Their limits are far away and must
/// not cost accuracy. The steps take few iterations.
#[test]
fn light_links_with_heavy_rotors_take_few_iterations() {
    let (trunk, link) = (solid(0.3, Vector3::repeat(0.15)), Vector3::new(0.2, 0.06, 0.06));
    let mut bodies = vec![trunk];
    bodies.extend((0..4).map(|_| solid(0.04, link)));
    let hinge = |body: usize, other: usize, sign: f64| {
        let drive = Drive {
            limits: Some([-0.5, 1.0]),
            armature: 1.0,
            damping: 1.0,
            force: 0.3 * sign + 0.1 * body as f64,
            ..Drive::NONE
        };
        let (reach, axis) = match other {
            0 => (0.15, Vector3::z()),
            _ => (0.2, Vector3::y()),
        };
        let frame = |x: f64| JointFrame::along(Vector3::new(x, 0.0, 0.0), axis).unwrap();
        Joint::revolute(body, Some(other), [frame(-0.2 * sign), frame(reach * sign)], drive)
    };
    let joints = vec![hinge(1, 0, 1.0), hinge(2, 1, 1.0), hinge(3, 0, -1.0), hinge(4, 3, -1.0)];
    let world = euler(parameters(bodies, 0.0)).with_joints(joints).unwrap();
    let starts = [0.0, 0.35, 0.75, -0.35, -0.75].map(|x| State::at_rest(Vector3::new(x, 0.0, 0.0)));
    let mut simulation = Simulation::new(world.clone(), starts, Motion::native(&world)).unwrap();
    let mut record = StepRecord::new();
    for _ in 0..500 {
        step(&mut simulation, &mut record);
        let StepStatus::Converged = record.status() else { panic!("{:?}", record.report()) };
        assert!(record.report().iterations <= 6, "step {}: {:?}", record.index, record.report());
        assert!(record.residual() < 1e-11, "{:?}", record.certificate());
    }
}

/// Checks that invalid settings are refused and change nothing.
#[test]
fn invalid_drive_settings_are_rejected() {
    let world = slide(2.0, Drive { force: 1.0, ..Drive::NONE });
    let mut simulation =
        Simulation::new(world.clone(), [State::at_rest(Vector3::zeros())], Motion::native(&world))
            .unwrap();
    let mut refused = |joint: usize, axis: JointAxis, drive: Drive| {
        simulation.set_drive(joint, axis, drive).unwrap_err().to_string()
    };
    assert!(refused(1, ALONG, Drive::NONE).contains("joint: 1 given"));
    assert!(refused(0, JointAxis::Linear(3), Drive::NONE).contains("axis of a joint: 3 given"));
    assert!(refused(0, JointAxis::Linear(0), Drive::NONE).contains("locked"));
    assert!(refused(0, ALONG, Drive { armature: -1.0, ..Drive::NONE }).contains("armature"));
    assert_eq!(simulation.world(), &world);
    let push = |axis: Vector3<f64>| JointLoad {
        force: Polyline::constant(axis).unwrap(),
        ..JointLoad::default()
    };
    assert!(simulation.set_joint_load(0, push(Vector3::x())).is_err());
    assert!(simulation.set_joint_load(0, push(Vector3::z())).is_ok());
    let course = Course::To(JointFrame::at(Vector3::zeros()));
    let refused = simulation.set_course(0, course).unwrap_err().to_string();
    assert!(refused.contains("not fixed to the world"), "{refused}");
}

/// World with a fixed tray of 2 m by 2 m, whose top is at z = 0, and a box on it.
fn tray_and_box(friction: f64) -> (World, [State; 2]) {
    let tray = solid(5.0, Vector3::new(1.0, 1.0, 0.05));
    let cube = solid(1.0, Vector3::new(0.1, 0.1, 0.02));
    let place = Vector3::new(0.0, 0.0, -0.05);
    let joint = Joint::fixed(0, None, [JointFrame::at(Vector3::zeros()), JointFrame::at(place)]);
    let mut parameters = parameters(vec![tray, cube], G);
    parameters.friction = friction;
    let world = euler(parameters).with_joints(vec![joint]).unwrap();
    (world, [State::at_rest(place), State::at_rest(Vector3::new(0.0, 0.0, 0.02))])
}

/// Checks a box on an accelerating tray. It stays for a < μ g, and otherwise slips by ½ (a − μ g)
/// t².
#[test]
fn a_box_on_an_accelerating_tray_slips_where_it_should() {
    for part in [0.999, 1.001, 2.0] {
        let (world, states) = tray_and_box(0.4);
        let acceleration = part * 0.4 * G;
        let mut simulation =
            Simulation::new(world.clone(), states, Motion::native(&world)).unwrap();
        // For x = ½ a h² k (k + 1) the velocities of the steps are a h k, from the first one on.
        let x = |k: u32| 0.5 * acceleration * H * H * f64::from(k) * (f64::from(k) + 1.0);
        let place = |k: u32| JointFrame::at(states[0].position + Vector3::x() * x(k));
        let mut record = StepRecord::new();
        for k in 1..=400 {
            simulation.set_course(0, Course::To(place(k))).unwrap();
            step(&mut simulation, &mut record);
            let tray = &record.next_states()[0];
            assert!((tray.position - place(k).anchor).norm() < 1e-14, "{k}");
            // The driving force accelerates the tray, and the box up to its friction limit.
            let force = record.first().solution.joints[0].force[0];
            let expected = acceleration * 5.0 + acceleration.min(0.4 * G);
            assert!((force - expected).abs() < 1e-6 * expected, "{k}: {force} {expected}");
            let slipped = tray.position[0] - record.next_states()[1].position[0];
            let steps = f64::from(k);
            let expected = 0.5 * (acceleration - 0.4 * G).max(0.0) * H * H * steps * (steps + 1.0);
            assert!((slipped - expected).abs() < 1e-9, "{part} {k}: {slipped} {expected}");
        }
    }
}

/// Checks a prescribed motion. Through knots the body has the interpolated pose at the end of every
/// step. With steady velocities it continues from its current pose. A step that is taken back is
/// repeated to the last bit.
#[test]
fn a_course_is_kept_to_rounding() {
    let (world, states) = tray_and_box(0.4);
    let mut simulation = Simulation::new(world.clone(), states, Motion::native(&world)).unwrap();
    let turned = Vector4::new(0.3_f64.cos(), 0.0, 0.0, 0.3_f64.sin());
    let up = states[0].position + Vector3::z() * 0.1;
    let knots = vec![
        (0.0, JointFrame::at(states[0].position)),
        (0.1, JointFrame::at(up)),
        (0.3, JointFrame { anchor: up, attitude: turned }),
    ];
    simulation.set_course(0, Course::Through(Knots::new(knots).unwrap())).unwrap();
    let mut record = StepRecord::new();
    for k in 1..=350 {
        step(&mut simulation, &mut record);
        let tray = &record.next_states()[0];
        let t = f64::from(k) * H;
        let height = (t / 0.1).min(1.0) * 0.1 - 0.05;
        assert!((tray.position[2] - height).abs() < 1e-14, "{k}");
        let half = 0.3 * ((t - 0.1) / 0.2).clamp(0.0, 1.0);
        let expected = Vector4::new(half.cos(), 0.0, 0.0, half.sin());
        assert!((tray.attitude - expected).norm() < 1e-13, "{k}");
        if k == 200 {
            let first = record.next_states().to_vec();
            simulation.take_back(&record);
            step(&mut simulation, &mut record);
            assert_eq!(record.next_states(), first);
        }
    }
    let from = simulation.states()[0];
    let (velocity, spin) = (Vector3::new(0.2, 0.0, 0.0), Vector3::new(0.0, 0.0, 0.5));
    simulation.set_course(0, Course::Steady { velocity, spin }).unwrap();
    for _ in 0..100 {
        step(&mut simulation, &mut record);
    }
    let now = &simulation.states()[0];
    assert!((now.position - from.position - velocity * 0.1).norm() < 1e-14);
    let half: f64 = 0.3 + 0.025;
    let expected = Vector4::new(half.cos(), 0.0, 0.0, half.sin());
    assert!((now.attitude - expected).norm() < 1e-13);
    // Knots that are elsewhere at the current time are refused.
    let far = Knots::new(vec![(0.0, JointFrame::at(Vector3::zeros()))]).unwrap();
    let refused = simulation.set_course(0, Course::Through(far)).unwrap_err().to_string();
    assert!(refused.contains("joint 0 is"), "{refused}");
    assert!(Knots::new(vec![]).is_err());
    let frame = JointFrame::at(Vector3::zeros());
    assert!(Knots::new(vec![(0.0, frame), (0.0, frame)]).is_err());
}

/// Checks motion after the last knot: the position is r + v t, and the rotation is |ω| t about ω.
/// This holds for any start time. A world that follows the motion has its frame there.
#[test]
fn knots_go_on_after_the_last() {
    let (world, states) = tray_and_box(0.4);
    let (velocity, spin) = (Vector3::new(0.1, 0.0, 0.05), Vector3::new(0.0, 0.0, 2.0));
    let from = JointFrame::at(states[0].position);
    let knots = || Knots::new(vec![(0.5, from)]).unwrap();
    let steady = knots().going_on(velocity, spin).unwrap();
    let mut simulation = Simulation::new(world.clone(), states, Motion::native(&world)).unwrap();
    simulation.set_index(400).unwrap();
    simulation.set_course(0, Course::Through(steady.clone())).unwrap();
    let mut record = StepRecord::new();
    for k in 401..=1200 {
        step(&mut simulation, &mut record);
        let tray = &record.next_states()[0];
        let t = (f64::from(k) * H - 0.5).max(0.0);
        assert!((tray.position - states[0].position - velocity * t).norm() < 1e-14, "{k}");
        let expected = Vector4::new(t.cos(), 0.0, 0.0, t.sin());
        let off = (tray.attitude - expected).norm().min((tray.attitude + expected).norm());
        assert!(off < 1e-13, "{k}: {off}");
    }
    let mut there = world.clone();
    there.follow(&[(0, steady)], 1.2);
    let (place, turn) = there.joints()[0].error(record.next_states()).unwrap();
    assert!(place < 1e-14 && turn < 1e-13, "{place} {turn}");
    assert!(knots().going_on(velocity * 1e7, spin).is_err());
    assert!(knots().going_on(velocity, spin * f64::NAN).is_err());
}

/// Checks that a turntable carries a puck while ω² r < μ g.
#[test]
fn a_turntable_carries_a_puck_as_far_as_friction_reaches() {
    let radius = 0.5;
    for (part, stays) in [(0.99, true), (1.01, false)] {
        let (world, mut states) = tray_and_box(0.4);
        let rate = (part * 0.4 * G / radius).sqrt();
        // Both rotate at the start. The mean velocity of a step belongs to its chord, and the spin
        // is its Cayley vector.
        let spin = Vector3::z() * ((0.5 * rate * H).tan() * 2.0 / H);
        let half = 0.5 * rate * H;
        let chord = radius * 2.0 * half.sin() / H;
        states[0].spin = spin;
        states[1].spin = spin;
        states[1].position[0] = radius;
        states[1].velocity = Vector3::new(half.sin(), half.cos(), 0.0) * chord;
        let mut simulation =
            Simulation::new(world.clone(), states, Motion::native(&world)).unwrap();
        let course = Course::Steady { velocity: Vector3::zeros(), spin: Vector3::z() * rate };
        simulation.set_course(0, course).unwrap();
        let mut record = StepRecord::new();
        for _ in 0..1000 {
            step(&mut simulation, &mut record);
        }
        let puck = &record.next_states()[1];
        let slipped = puck.position.xy().norm() - radius;
        if stays {
            assert!(slipped.abs() < 1e-6, "{slipped}");
            let turned = puck.position[1].atan2(puck.position[0]);
            let expected = (rate * 1.0 + std::f64::consts::PI).rem_euclid(std::f64::consts::TAU)
                - std::f64::consts::PI;
            assert!((turned - expected).abs() < 1e-6, "{turned} {expected}");
        } else {
            assert!(slipped > 1e-3, "{slipped}");
        }
    }
}

/// Checks that a pusher moves a box along the ground with μ m g and creates no energy.
#[test]
fn a_pusher_pushes_with_what_friction_takes() {
    let pusher = solid(3.0, Vector3::new(0.05, 0.2, 0.1));
    let cube = solid(2.0, Vector3::new(0.1, 0.1, 0.1));
    let place = Vector3::new(-0.2, 0.0, 0.15);
    let joint = Joint::fixed(0, None, [JointFrame::at(Vector3::zeros()), JointFrame::at(place)]);
    let mut parameters = parameters(vec![pusher, cube], G);
    parameters.ground = Some(Plane::level());
    let world = euler(parameters).with_joints(vec![joint]).unwrap();
    let world =
        world.with_coefficient_between(Coefficient::Friction, 1, Partner::Body(0), 0.0).unwrap();
    let states = [State::at_rest(place), State::at_rest(Vector3::new(0.0, 0.0, 0.1))];
    let mut simulation = Simulation::new(world.clone(), states, Motion::native(&world)).unwrap();
    let velocity = Vector3::x() * 0.5;
    simulation.set_course(0, Course::Steady { velocity, spin: Vector3::zeros() }).unwrap();
    let mut record = StepRecord::new();
    for k in 0..500 {
        step(&mut simulation, &mut record);
        // The gap of 5 cm closes after 0.1 s.
        if k > 101 {
            let force = record.first().solution.joints[0].force[0];
            assert!((force - 0.4 * 2.0 * G).abs() < 1e-6, "{k}: {force}");
            assert!((record.next_states()[1].velocity[0] - 0.5).abs() < 1e-9);
        }
    }
    let gap = record.next_states()[1].position[0] - record.next_states()[0].position[0];
    assert!((gap - 0.15).abs() < 1e-9, "{gap}");
}

/// Checks that a ball in the way of a body with the prescribed velocity v leaves with (1 + e) v. For e = 1 the bounce
/// keeps all its energy in the body's frame, which its search must find in parts of a step too.
#[test]
fn a_ball_leaves_a_bat_with_its_speed_and_the_rebound() {
    for (e, mass, swapped) in
        [(0.0, 1.0, false), (0.5, 0.01, true), (1.0, 1.0, false), (1.0, 1e3, true)]
    {
        let (bat, ball) = (usize::from(swapped), usize::from(!swapped));
        let mut bodies = vec![
            solid(1.0, Vector3::repeat(0.05)),
            RigidBody::solid(mass, &[Piece::sphere(0.05).unwrap()]).unwrap().0,
        ];
        let mut states =
            [State::at_rest(Vector3::zeros()), State::at_rest(Vector3::new(0.1073, 0.0, 0.0))];
        if swapped {
            bodies.reverse();
            states.reverse();
        }
        let frames = [JointFrame::at(Vector3::zeros()), JointFrame::at(Vector3::zeros())];
        let world = euler(parameters(bodies, 0.0));
        let world = world.with_joints(vec![Joint::fixed(bat, None, frames)]).unwrap();
        let world = world
            .with_coefficient_between(Coefficient::Restitution, 1, Partner::Body(0), e)
            .unwrap();
        let half_kicks = world.clone().with_integrator(Integrator::Leapfrog);
        let located = half_kicks.clone().with_impacts(tumble_core::world::Impacts::Located);
        let accurate = half_kicks.clone().with_accuracy(Some(1e-5)).unwrap();
        for (mode, world) in [world, half_kicks, located, accurate].into_iter().enumerate() {
            let mut simulation =
                Simulation::new(world.clone(), states, Motion::native(&world)).unwrap();
            let velocity = Vector3::x() * 0.37;
            simulation.set_course(0, Course::Steady { velocity, spin: Vector3::zeros() }).unwrap();
            let mut record = StepRecord::new();
            for _ in 0..40 {
                step(&mut simulation, &mut record);
            }
            let speed = record.next_states()[ball].velocity[0];
            assert!((speed - (1.0 + e) * 0.37).abs() < 1e-9, "{e}, {mass}, {mode}: {speed}");
        }
    }
}

/// Checks a box on a tray that moves at 0.4 m/s, turns back after 50 ms and stops after 80 ms. With a = μ g the
/// box has slid by
///
/// ½ a t₁² + a t₁ (t₂ − t₁) − ½ a (t₂ − t₁)² + ½ a (2 t₁ − t₂)²
///
/// in the end. Its drive does work, but no step makes energy.
#[test]
fn a_tray_may_turn_back_and_stop_abruptly_under_a_sliding_box() {
    let (friction, [back, stop]) = (0.3, [0.05, 0.08]);
    let (world, states) = tray_and_box(friction);
    let at = |x: f64| JointFrame::at(states[0].position + Vector3::x() * x);
    let knots = vec![(0.0, at(0.0)), (back, at(0.02)), (stop, at(0.008))];
    let a = friction * G;
    let (reversed, rest) = (stop - back, 2.0 * back - stop);
    let way = a * (0.5 * back * back + back * reversed - 0.5 * reversed * reversed)
        + 0.5 * a * rest * rest;
    let half_kicks = world.clone().with_integrator(Integrator::Leapfrog);
    // A jump within a step has an error h v. It is where an interval begins with an accuracy.
    let worlds = [
        (world.clone(), 0.15 * H),
        (half_kicks.clone(), 0.15 * H),
        (half_kicks.clone().with_impacts(tumble_core::world::Impacts::Located), 0.15 * H),
        (half_kicks.with_accuracy(Some(1e-5)).unwrap(), 1e-5),
    ];
    for (index, (world, error)) in worlds.into_iter().enumerate() {
        let motion = Motion::native(&world);
        let mut simulation = Simulation::new(world.clone(), states, motion).unwrap();
        simulation.set_course(0, Course::Through(Knots::new(knots.clone()).unwrap())).unwrap();
        let mut record = StepRecord::new();
        for _ in 0..150 {
            step(&mut simulation, &mut record);
        }
        let slid = record.next_states()[1].position[0] - states[1].position[0];
        assert!((slid - way).abs() < error, "{index}: {slid} {way}");
    }
}

/// Checks a box on a conveyor. It accelerates with μ g until it has the speed of the belt, after
/// v/(μ g). The belt may be fixed, the surface of a body, or tracks of the box itself.
#[test]
fn a_conveyor_takes_a_box_along() {
    let (speed, friction) = (1.2, 0.4);
    let belt = Vector3::x() * speed;
    let cube = || solid(1.0, Vector3::new(0.1, 0.1, 0.05));
    let on_ground = || {
        let mut parameters = parameters(vec![cube()], G);
        parameters.ground = Some(Plane::level());
        euler(parameters)
    };
    let fixed = {
        let moved = Piece::cuboid(Vector3::new(3.0, 1.0, 0.1)).unwrap();
        let down = Vector3::new(0.0, 0.0, -0.1);
        let piece = moved.moved_by(&Matrix3::identity(), &down).unwrap();
        let world = euler(parameters(vec![cube()], G));
        world.with_fixed(vec![piece])
    };
    let (trayed, _) = tray_and_box(friction);
    let worlds = [
        (on_ground().with_surface(Partner::Ground, belt).unwrap(), 0),
        (on_ground().with_surface(Partner::Body(0), -belt).unwrap(), 0),
        (fixed.with_surface(Partner::Fixed(0), belt).unwrap(), 0),
        (trayed.with_surface(Partner::Body(0), belt).unwrap(), 1),
    ];
    for (number, (world, carried)) in worlds.into_iter().enumerate() {
        let height = if carried == 1 { 0.02 } else { 0.05 };
        let mut states = vec![State::at_rest(Vector3::new(0.0, 0.0, height))];
        if carried == 1 {
            states.insert(0, State::at_rest(Vector3::new(0.0, 0.0, -0.05)));
        }
        let mut simulation =
            Simulation::new(world.clone(), states, Motion::native(&world)).unwrap();
        let mut record = StepRecord::new();
        for k in 1..=400 {
            step(&mut simulation, &mut record);
            let found = record.next_states()[carried].velocity;
            let expected = (friction * G * H * f64::from(k)).min(speed);
            assert!((found[0] - expected).abs() < 1e-9, "{number} {k}: {found} {expected}");
            assert!(found.yz().norm() < 1e-9, "{number} {k}: {found}");
        }
        // After 0.306 s the box does not slip.
        let slip = record.first().solution.contacts.iter().map(|contact| contact.slip.norm());
        assert!(slip.fold(0.0, f64::max) < 1e-9);
    }
    let refused = on_ground().with_surface(Partner::Fixed(0), belt).unwrap_err().to_string();
    assert!(refused.contains("owner of a surface"), "{refused}");
}

/// Checks a ball on a moving belt. It gets 2/7 of the belt's speed and rolls on it.
#[test]
fn a_ball_on_a_belt_rolls_at_two_sevenths_of_it() {
    let radius = 0.1;
    let ball = RigidBody::solid(1.0, &[Piece::sphere(radius).unwrap()]).unwrap().0;
    let capsule = Piece::capsule(2.0, radius).unwrap();
    let along = Matrix3::new(0.0, 0.0, 1.0, 0.0, 1.0, 0.0, -1.0, 0.0, 0.0);
    let rail = capsule.moved_by(&along, &Vector3::new(0.0, 0.0, -radius)).unwrap();
    let on_rail = euler(parameters(vec![ball.clone()], G));
    let on_rail = on_rail.with_fixed(vec![rail]);
    let mut on_ground = parameters(vec![ball], G);
    on_ground.ground = Some(Plane::level());
    let on_ground = euler(on_ground);
    let belt = Vector3::x() * 0.7;
    for world in [
        on_ground.with_surface(Partner::Ground, belt).unwrap(),
        on_rail.with_surface(Partner::Fixed(0), belt).unwrap(),
    ] {
        let start = State::at_rest(Vector3::new(0.0, 0.0, radius));
        let mut simulation =
            Simulation::new(world.clone(), [start], Motion::native(&world)).unwrap();
        let mut record = StepRecord::new();
        for _ in 0..300 {
            step(&mut simulation, &mut record);
        }
        let state = record.next();
        assert!((state.velocity[0] - 0.2).abs() < 1e-3, "{}", state.velocity);
        // v + ω × (−R z) = belt velocity.
        let touching = state.velocity[0] - state.spin[1] * radius;
        assert!((touching - 0.7).abs() < 1e-3, "{} {}", state.velocity, state.spin);
    }
}

/// Checks that a motor set during a run, a load over time, a tray on its motion and a belt are part
/// of the saved state. A new simulation of the original world continues with the same bits.
#[test]
fn settings_changed_during_a_run_are_saved() {
    let along = JointFrame::along(Vector3::zeros(), Vector3::x()).unwrap();
    let place = |x: f64| JointFrame::at(Vector3::new(x, 0.0, 2.0));
    let held = [JointFrame::at(Vector3::zeros()), place(0.0)];
    let joints =
        vec![Joint::prismatic(0, None, [along; 2], Drive::NONE), Joint::fixed(1, None, held)];
    let bodies = [0.1, 0.2, 0.1].map(|half| solid(20.0 * half, Vector3::repeat(half))).to_vec();
    let world = euler(parameters(bodies, G)).with_joints(joints).unwrap();
    let made = || {
        let starts = [0.0, 2.0, 2.3].map(|z| State::at_rest(Vector3::new(0.0, 0.0, z)));
        Simulation::new(world.clone(), starts, Motion::native(&world)).unwrap()
    };
    let run = |restored: Option<u32>| {
        let (mut simulation, mut record) = (made(), StepRecord::new());
        let knots = vec![(0.0, place(0.0)), (0.1, place(0.05)), (0.3, place(-0.1))];
        simulation.set_course(1, Course::Through(Knots::new(knots).unwrap())).unwrap();
        let force = Polyline::new(vec![(0.0, Vector3::zeros()), (0.2, Vector3::z())]).unwrap();
        let load = JointLoad { force, ..JointLoad::default() };
        simulation.set_joint_load(0, load).unwrap();
        for k in 0..200 {
            if k == 60 {
                let motor = Motor::Speed { target: 0.3, max_force: 5.0 };
                simulation.set_motor(0, ALONG, Some(motor)).unwrap();
                simulation.set_surface(Partner::Body(1), Vector3::y() * 0.2).unwrap();
            }
            if restored == Some(k) {
                let bytes = simulation.save().to_bytes().unwrap();
                simulation = made();
                simulation.restore(&Saved::from_bytes(&bytes).unwrap()).unwrap();
            }
            step(&mut simulation, &mut record);
        }
        (simulation.states().to_vec(), record)
    };
    let whole = run(None);
    assert!(whole.0[2].velocity.y.abs() > 1e-3, "the belt carries it");
    for k in [1, 60, 61, 130] {
        assert_eq!(run(Some(k)), whole, "from {k}");
    }
}

/// A link of 1e-9 kg at the end of an arm, behind a position motor with a rotor of 2 kg m². It follows
/// 2 θ″ + 0.51 θ′ + 15 θ = 14, which the arm of 1 kg on the same motor does not change.
#[test]
fn a_link_without_weight_turns_as_its_motor() {
    let motor = Motor::Position { target: 1.0, stiffness: 15.0, damping: 0.5, max_force: 100.0 };
    let motor = Some(motor);
    let drive = Drive { friction: 1.0, damping: 0.01, armature: 2.0, motor, ..Drive::NONE };
    let bodies = vec![
        solid(1.0, Vector3::new(0.2, 0.03, 0.03)),
        solid(1e-9, Vector3::new(0.03, 0.03, 0.01)),
    ];
    let frame = |x: f64, axis: Vector3<f64>| JointFrame::along(Vector3::x() * x, axis).unwrap();
    let joints = vec![
        Joint::revolute(0, None, [frame(-0.2, Vector3::y()), frame(-0.2, Vector3::y())], drive),
        Joint::revolute(1, Some(0), [frame(0.0, Vector3::z()), frame(0.2, Vector3::z())], drive),
    ];
    let world = World::new(parameters(bodies, G)).unwrap().with_joints(joints).unwrap();
    let starts = vec![State::at_rest(Vector3::zeros()), State::at_rest(Vector3::x() * 0.2)];
    let mut simulation = Simulation::new(world.clone(), starts, Motion::native(&world)).unwrap();
    let mut record = StepRecord::new();
    (0..500).for_each(|_| step(&mut simulation, &mut record));
    let decay = 0.1275;
    let rate = 7.5 - 0.1275_f64.powi(2);
    let rate = rate.sqrt();
    let time = 500.0 * H;
    let swing = (rate * time).cos() + decay / rate * (rate * time).sin();
    let angle = 14.0 / 15.0 * (1.0 - (-decay * time).exp() * swing);
    let turned = record.first().solution.joints[1].angles[2];
    assert!((turned - angle).abs() < 0.01, "{turned} {angle}");
}
