//! Universal joints and gimbals. Every angle is held, driven and limited like a hinge angle.

use crate::common::prelude::*;
use tumble_core::joint::{Hinges, JointForce, Middle};
use tumble_core::simulation::energy;

const G: f64 = 9.81;

fn brick(mass: f64, half: Vector3<f64>) -> RigidBody {
    let side = |k: usize| half[(k + 1) % 3].powi(2) + half[(k + 2) % 3].powi(2);
    let moments = Vector3::from_fn(|k, _| mass / 3.0 * side(k));
    RigidBody::with_box_corners(mass, Matrix3::from_diagonal(&moments), half).unwrap()
}

fn world(bodies: Vec<RigidBody>, joints: Vec<Joint>, gravity: f64, time_step: f64) -> World {
    let parameters = Parameters {
        ground: None,
        gravity: Vector3::new(0.0, 0.0, -gravity),
        time_step,
        ..Parameters::new(bodies)
    };
    euler(parameters).with_joints(joints).unwrap()
}

fn about(axis: usize, angle: f64) -> Vector4<f64> {
    let mut turn = Vector4::new((0.5 * angle).cos(), 0.0, 0.0, 0.0);
    turn[axis + 1] = (0.5 * angle).sin();
    turn
}

/// Quaternion q_y(β) ⊗ q_z(γ) ⊗ q_x(α) for the angles (α, β, γ).
fn turn(angles: &Vector3<f64>) -> Vector4<f64> {
    left(&(left(&about(1, angles[1])) * about(2, angles[2]))) * about(0, angles[0])
}

/// Axes of rotation of α, β and γ, in B's frame.
fn axes(angles: &Vector3<f64>) -> [Vector3<f64>; 3] {
    let carried = rotation(&about(1, angles[1]));
    [
        carried * (rotation(&about(2, angles[2])) * Vector3::x()),
        Vector3::y(),
        carried * Vector3::z(),
    ]
}

const ARM: Vector3<f64> = Vector3::new(0.1, -0.2, 0.3);

/// Brick that hangs from `ARM` at these angles in the world frame, with the given drives.
fn hung(angles: &Vector3<f64>, drives: [Drive; 3], gravity: f64, h: f64) -> (World, State) {
    let frames = [JointFrame::at(ARM), JointFrame::at(Vector3::zeros())];
    let joint = Joint::gimbal(0, None, frames, drives);
    let body = brick(2.0, Vector3::new(0.1, 0.15, 0.3));
    (world(vec![body], vec![joint], gravity, h), placed(angles))
}

fn placed(angles: &Vector3<f64>) -> State {
    let attitude = turn(angles);
    let (velocity, spin) = (Vector3::zeros(), Vector3::zeros());
    State { position: -(rotation(&attitude) * ARM), attitude, velocity, spin }
}

/// Runs `steps` steps. Every step must be solved, certified and physical.
fn run(simulation: &mut Simulation<'_>, count: usize) -> StepRecord {
    last_step(simulation, count, converged(1e-9))
}

fn joint_error(world: &World, states: &[State]) -> f64 {
    let errors = world.joints().iter().map(|joint| joint.error(states).unwrap());
    errors.map(|(place, turn)| place.max(turn)).fold(0.0, f64::max)
}

/// Checks friction torques by virtual work. About each axis friction holds the moment of the
/// weight.
#[test]
fn friction_of_the_angles_holds_the_weight() {
    for angles in [[0.3, -0.5, 0.8], [-1.1, 2.0, -1.3], [0.4, 0.2, 2.2]] {
        let angles = Vector3::from(angles);
        let drive = Drive { friction: 50.0, ..Drive::NONE };
        let (world, state) = hung(&angles, [drive; 3], G, 1e-3);
        let mut simulation = simulate(&world, &[state]);
        let record = run(&mut simulation, 50);
        assert!((record.next().position - state.position).amax() < 1e-13);
        let (torque, at) =
            (record.first().solution.joints[0].torque, record.first().solution.joints[0].angles);
        // About each axis, with the other angles fixed: τ = −a · (r × m g).
        let weight = Vector3::new(0.0, 0.0, -2.0 * G);
        let moment = state.position.cross(&weight);
        // A start at a middle angle of more than a quarter turn is reported as the equivalent
        // triple.
        let same = turn(&at);
        assert!((same - turn(&angles)).amax().min((same + turn(&angles)).amax()) < 1e-12);
        for (k, axis) in axes(&at).iter().enumerate() {
            let held = -axis.dot(&moment);
            assert!((torque[k] - held).abs() < 1e-9, "{angles} {k}: {} {held}", torque[k]);
        }
    }
}

/// Checks that each angle stops at its limit, for any values of the others.
#[test]
fn limits_of_the_angles_hold() {
    let limit =
        |low, high, force| Drive { limits: Some([low, high]), force, damping: 0.3, ..Drive::NONE };
    let drives = [limit(-0.5, 0.7, 4.0), limit(-1.0, 0.2, -15.0), limit(-1.2, 0.6, 14.0)];
    let (world, state) = hung(&Vector3::new(0.1, 0.1, 0.2), drives, 0.0, 1e-3);
    let mut simulation = simulate(&world, &[state]);
    let mut at = Vector3::zeros();
    for _ in 0..3000 {
        let record = run(&mut simulation, 1);
        at = record.first().solution.joints[0].angles;
        for (k, drive) in drives.iter().enumerate() {
            let [low, high] = drive.limits.unwrap();
            assert!(at[k] > low - 1e-11 && at[k] < high + 1e-11, "{at}");
        }
        assert!(joint_error(&world, record.next_states()) < 1e-13);
    }
    for (k, stop) in [0.7, -1.0, 0.6].into_iter().enumerate() {
        assert!((at[k] - stop).abs() < 1e-11, "{at}");
    }
}

/// Checks that motors turn every axis at its speed, with turns counted.
#[test]
fn motors_hold_the_speeds_of_all_angles() {
    let motor = |target| Some(Motor::Speed { target, max_force: 1e4 });
    let drive = |target| Drive { motor: motor(target), ..Drive::NONE };
    let drives = [drive(5.0), drive(-7.0), drive(0.3)];
    let (world, state) = hung(&Vector3::new(0.2, 0.0, -1.0), drives, G, 1e-3);
    let mut simulation = simulate(&world, &[state]);
    let before = run(&mut simulation, 1).first().solution.joints[0].angles;
    let after = run(&mut simulation, 4000).first().solution.joints[0].angles;
    for (k, rate) in [5.0, -7.0, 0.3].into_iter().enumerate() {
        let turned = after[k] - before[k];
        assert!((turned - 4.0 * rate).abs() < 1e-9, "{k}: {turned}");
    }
}

/// Checks the energy loss of implicit springs, ½ k (h u)² per step. The loss is of first order in
/// h, and there is no other loss.
#[test]
fn springs_of_the_angles_lose_what_implicit_springs_do() {
    let stiffness = Vector3::new(3.0, 4.0, 5.0);
    let drives = [0, 1, 2].map(|k| Drive { stiffness: stiffness[k], ..Drive::NONE });
    let angles = Vector3::new(0.3, -0.4, 0.5);
    let spring = |x: Vector3<f64>| 0.5 * stiffness.dot(&x.component_mul(&x));
    let (start, duration) = (spring(angles), 1.0);
    let lost = |h: f64| {
        let (world, state) = hung(&angles, drives, 0.0, h);
        let mut simulation = simulate(&world, &[state]);
        let record = run(&mut simulation, (duration / h).round() as usize);
        let joint = &world.joints()[0];
        let at =
            |states: &[State]| joint.turns(&joint.coordinates(states).unwrap(), &Vector3::zeros());
        // Velocities belong to the time half a step earlier, positions to the end.
        let halfway = 0.5 * (at(record.states()) + at(record.next_states()));
        let end = &record.next_states()[0];
        start - energy::kinetic(&world, &world.bodies()[0], end) - spring(halfway)
    };
    let (coarse, fine) = (lost(4e-4), lost(2e-4));
    assert!(coarse > 0.0 && (coarse / fine - 2.0).abs() < 0.1, "{coarse} {fine}");
    let left = 2.0 * fine - coarse;
    assert!(left.abs() < 1e-2 * start, "{left} of {start}");
}

/// Checks that a gimbal without drives moves like a ball joint.
#[test]
fn a_gimbal_without_drives_is_a_ball_joint() {
    let (world, mut state) = hung(&Vector3::new(0.4, 0.3, -0.2), [Drive::NONE; 3], G, 1e-3);
    state.spin = Vector3::new(0.5, 1.0, 2.0);
    let arm = rotation(&state.attitude) * ARM;
    state.velocity = -(rotation(&state.attitude) * state.spin).cross(&arm);
    let frames = *world.joints()[0].frames();
    let free = world.clone().with_joints(vec![Joint::spherical(0, None, frames)]).unwrap();
    let [mut one, mut other] = [&world, &free].map(|world| simulate(world, &[state]));
    for _ in 0..20 {
        let (a, b) = (run(&mut one, 50), run(&mut other, 50));
        assert!((a.next().position - b.next().position).amax() < 1e-9);
    }
}

/// Checks that two free bodies that drive each other's angles conserve both momenta to rounding.
#[test]
fn drives_of_angles_keep_momenta() {
    let frames = [
        JointFrame { anchor: ARM, attitude: turn(&Vector3::new(0.3, 0.2, -0.1)) },
        JointFrame { anchor: -ARM, attitude: turn(&Vector3::new(-0.2, 0.5, 0.4)) },
    ];
    let drive = |k: f64| Drive {
        limits: Some([-1.1, 1.2]),
        friction: 0.01,
        stiffness: 2.0 + k,
        damping: 0.01,
        armature: 0.001,
        motor: Some(Motor::Position {
            target: 0.5,
            stiffness: 10.0,
            damping: 0.1,
            max_force: 0.5 * k,
        }),
        ..Drive::NONE
    };
    for universal in [false, true] {
        let joint = if universal {
            Joint::universal(0, Some(1), frames)
                .with_drive(JointAxis::Angular(0), drive(1.0))
                .and_then(|joint| joint.with_drive(JointAxis::Angular(1), drive(2.0)))
                .unwrap()
        } else {
            Joint::gimbal(0, Some(1), frames, [drive(1.0), drive(2.0), drive(3.0)])
        };
        let half = Vector3::new(0.1, 0.05, 0.2);
        let world = world(vec![brick(1.0, half), brick(2.0, half)], vec![joint], 0.0, 2e-3);
        let states = [0.0, 0.3].map(|x| State {
            position: (ARM + rotation(&about(0, 0.3)) * ARM) * (x / 0.3),
            attitude: about(0, x),
            velocity: Vector3::new(0.1, x, 0.0),
            spin: Vector3::new(1.0, 2.0, -1.5),
        });
        let (states, _) = world.assemble(&states).unwrap();
        let mut simulation = simulate(&world, &states);
        let momenta = |states: &[State]| {
            let (mut linear, mut angular) = (Vector3::zeros(), Vector3::zeros());
            for (body, state) in world.bodies().iter().zip(states) {
                linear += state.velocity * body.mass();
                angular += state.position.cross(&state.velocity) * body.mass();
                let own = world.rotation().momentum(body.inertia(), &state.spin, world.time_step());
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
            assert!(joint_error(&world, record.next_states()) < 1e-13);
        }
    }
}

/// Checks that a gimbal is the limit of three hinges with small bodies between them, under the same
/// drives.
#[test]
fn a_gimbal_is_three_hinges_with_nothing_between() {
    let drive = |k: f64| Drive { stiffness: 3.0 * k, damping: 0.1, force: 0.4, ..Drive::NONE };
    let drives = [drive(1.0), drive(2.0), drive(3.0)];
    let start = Vector3::zeros();
    let (gimbal, state) = hung(&start, drives, G, 1e-3);
    let mut one = simulate(&gimbal, &[state]);
    let end = run(&mut one, 500);
    let apart = |small: f64| {
        let inertia = Matrix3::identity() * small * 0.01;
        let ring = RigidBody::new(small, inertia, &[Vector3::x() * 0.1]).unwrap();
        let bodies = vec![gimbal.bodies()[0].clone(), ring.clone(), ring];
        let frame = |anchor, axis| JointFrame::along(anchor, axis).unwrap();
        let zero = Vector3::zeros();
        let hinge = |a, b, at, axis, drive| {
            Joint::revolute(a, b, [frame(at, axis), frame(zero, axis)], drive)
        };
        let joints = vec![
            hinge(1, None, zero, Vector3::y(), drives[1]),
            hinge(2, Some(1), zero, Vector3::z(), drives[2]),
            hinge(0, Some(2), ARM, Vector3::x(), drives[0]),
        ];
        let world = world(bodies, joints, G, 1e-3);
        let at = State { position: zero, ..state };
        let mut other = simulate(&world, &[state, at, at]);
        let last = run(&mut other, 500);
        let angles = &last.first().solution.joints;
        let found = Vector3::new(angles[2].angles[2], angles[0].angles[2], angles[1].angles[2]);
        (found - end.first().solution.joints[0].angles).norm()
    };
    let (coarse, fine) = (apart(2e-3), apart(1e-3));
    assert!(fine < 5e-3 && (coarse / fine - 2.0).abs() < 0.1, "{coarse} {fine}");
}

/// Checks the pose in which the first and the last axis coincide. The joint passes through it if
/// these axes have no drives, but no simulation may start there.
#[test]
fn the_middle_angle_goes_on_beyond_a_quarter_turn() {
    let motor = Some(Motor::Speed { target: 2.0, max_force: 1e4 });
    let drives = [Drive::NONE, Drive::NONE, Drive { motor, ..Drive::NONE }];
    let frames = [JointFrame::at(Vector3::zeros()); 2];
    let joint = Joint::gimbal(0, None, frames, drives);
    let world = world(vec![brick(2.0, Vector3::new(0.1, 0.15, 0.3))], vec![joint], 0.0, 1e-3);
    let state = State { attitude: about(2, 1.0), position: Vector3::zeros(), ..placed(&ARM) };
    let mut simulation = simulate(&world, &[state]);
    let before = run(&mut simulation, 1).first().solution.joints[0].angles;
    let after = run(&mut simulation, 700).first().solution.joints[0].angles;
    assert!((after[2] - before[2] - 1.4).abs() < 1e-9, "{after}");
    let quarter = Vector3::new(0.3, 0.1, std::f64::consts::FRAC_PI_2);
    let folded = State { position: Vector3::zeros(), ..placed(&quarter) };
    let refused = Simulation::new(world.clone(), vec![folded], Motion::native(&world));
    assert!(refused.err().unwrap().to_string().contains("parallel first and last axes"));
}

/// Checks hinges about x, z and y, as in robot files. Each angle reaches the target of its motor.
#[test]
fn hinges_about_axes_of_the_left_hand_are_driven_one_by_one() {
    let frames = [JointFrame::at(ARM), JointFrame::at(Vector3::zeros())];
    let of = Hinges::new(frames, [Vector3::x(), Vector3::z(), Vector3::y()]).unwrap();
    let targets = [0.7, -0.4, 1.9];
    let mut joint = Joint::gimbal(0, None, of.frames, [Drive::NONE; 3]).with_middle(of.middle);
    for (axis, target) in Hinges::AXES.into_iter().zip(targets) {
        let motor = Motor::Position { target, stiffness: 50.0, damping: 5.0, max_force: 1e3 };
        joint = joint.with_drive(axis, Drive { motor: Some(motor), ..Drive::NONE }).unwrap();
    }
    let world = world(vec![brick(2.0, Vector3::new(0.1, 0.15, 0.3))], vec![joint], 0.0, 1e-3);
    let state = placed(&Vector3::zeros());
    let at = world.joints()[0].coordinates(&[state]).unwrap();
    assert!(world.joints()[0].turns(&at, &Vector3::zeros()).amax() < 1e-12);
    let mut simulation = simulate(&world, &[state]);
    let record = run(&mut simulation, 4000);
    let [a, b, c] = [about(0, targets[0]), about(2, targets[1]), about(1, targets[2])];
    let turned = left(&(left(&a) * b)) * c;
    let off =
        (record.next().attitude - turned).amax().min((record.next().attitude + turned).amax());
    assert!(off < 1e-5, "{off}");
}

/// Checks a planar joint with a drive on each axis: two translations and a rotation, as for the
/// base of a robot.
#[test]
fn a_planar_root_is_driven_along_all_its_axes() {
    let frame = JointFrame::along(Vector3::zeros(), Vector3::y()).unwrap();
    let motor =
        |target| Drive { motor: Some(Motor::Speed { target, max_force: 1e3 }), ..Drive::NONE };
    let mut joint = Joint::planar(0, None, [frame, frame]);
    let axes = [JointAxis::Linear(0), JointAxis::Linear(1), JointAxis::Angular(2)];
    for (axis, target) in axes.into_iter().zip([0.5, -0.25, 4.0]) {
        joint = joint.with_drive(axis, motor(target)).unwrap();
    }
    let world = world(vec![brick(1.0, Vector3::repeat(0.1))], vec![joint], G, 1e-3);
    let state = State { position: Vector3::zeros(), ..placed(&Vector3::zeros()) };
    let mut simulation = simulate(&world, &[state]);
    let record = run(&mut simulation, 2000);
    let joint = &world.joints()[0];
    let place = joint.coordinates(record.next_states()).unwrap().place;
    assert!((place - Vector3::new(1.0, -0.5, 0.0)).amax() < 1e-11, "{place}");
    assert!((record.first().solution.joints[0].angles[2] - 8.0).abs() < 1e-11);
}

#[test]
fn invalid_gimbals_are_rejected() {
    let frames = [JointFrame::at(ARM), JointFrame::at(Vector3::zeros())];
    let plain = hung(&Vector3::zeros(), [Drive::NONE; 3], G, 1e-3).0;
    let ball = Joint::spherical(0, None, frames);
    let bare = Joint::fixed(0, None, frames).with_middle(Middle::STRAIGHT);
    assert!(plain.clone().with_joints(vec![bare]).is_err());
    let locked = Joint::gimbal(0, None, frames, [Drive::NONE; 3])
        .with_axes(*ball.linear(), [Axis::Free(Drive::NONE), Axis::Locked, Axis::Locked]);
    assert!(plain.clone().with_joints(vec![locked]).is_err());
    let none = JointForce::none(Vector3::zeros());
    assert_eq!(none.angles, Vector3::zeros());
}
