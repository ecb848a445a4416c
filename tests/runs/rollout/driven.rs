//! Rollouts of mechanisms: constants of joints, motors and forces.

use super::*;

/// World with a pendulum with a motor, and a slide with a spring.
fn driven_world() -> World {
    use tumble_core::joint::{Drive, Joint, JointFrame, Motor};
    let bodies = [1.0, 2.0].map(|mass| {
        let corners = [Vector3::new(0.1, 0.2, 0.3), Vector3::new(-0.1, -0.2, -0.3)];
        RigidBody::new(mass, Matrix3::identity() * 0.1 * mass, &corners).unwrap()
    });
    let frames = [0.0, 1.0].map(|x| {
        let axis = |at| JointFrame::along(at, Vector3::new(0.0, 1.0, 0.1)).unwrap();
        [axis(Vector3::new(0.0, 0.0, 0.3)), axis(Vector3::new(x, 0.0, 0.3))]
    });
    let motor = Motor::Position { target: 0.2, stiffness: 20.0, damping: 1.0, max_force: 30.0 };
    let hinge = Drive { friction: 0.01, motor: Some(motor), armature: 0.02, ..Drive::NONE };
    let slide = Drive { stiffness: 50.0, damping: 0.3, friction: 0.1, force: 0.5, ..Drive::NONE };
    let joints = vec![
        Joint::revolute(0, None, frames[0], hinge),
        Joint::cylindrical(1, None, frames[1], [slide, Drive::NONE]),
    ];
    let parameters = Parameters {
        bodies: bodies.into(),
        ground: None,
        ..cube_world(SOLID).parameters().clone()
    };
    World::new(parameters).unwrap().with_joints(joints).unwrap()
}

fn driven_starts() -> Vec<f64> {
    let state = |x: f64| State::at_rest(Vector3::new(x, 0.0, 0.0));
    [0.0, 1.0].iter().flat_map(|x| state(*x).to_vector().as_slice().to_vec()).collect()
}

/// Checks that constants of joints are read as they are set, in their shapes, and equal the
/// constants of the drives.
#[test]
fn constants_of_joints_are_those_of_their_drives() {
    use tumble_core::joint::{Axis, Drive, Gear, GearAxis, JointAxis, Motor};
    let world = driven_world();
    let mut joints = world.joints().to_vec();
    let slide = Drive {
        rest: 0.3,
        limits: Some([-0.5, 0.4]),
        ..*joints[1].drive(JointAxis::Linear(2)).unwrap()
    };
    joints[1] = joints[1].clone().with_drive(JointAxis::Linear(2), slide).unwrap();
    let axis = |joint, axis| GearAxis { joint, axis };
    let gear = Gear::new(axis(1, JointAxis::Linear(2)), axis(0, JointAxis::Angular(2)), 1.5, 0.2);
    let world = world.with_joints(joints).unwrap().with_gears(vec![gear]).unwrap();
    assert_eq!(world.limited_axes(), [(1, JointAxis::Linear(2))]);
    assert_eq!(
        world.driven_axes(),
        [(0, JointAxis::Angular(2)), (1, JointAxis::Linear(2)), (1, JointAxis::Angular(2))]
    );
    assert_eq!(world.motors(), [(0, JointAxis::Angular(2))]);
    for (constant, numbers) in [
        (Constant::JointFriction, vec![0.01, 0.1, 0.0]),
        (Constant::JointStiffness, vec![0.0, 50.0, 0.0]),
        (Constant::JointRest, vec![0.0, 0.3, 0.0]),
        (Constant::JointDamping, vec![0.0, 0.3, 0.0]),
        (Constant::JointForce, vec![0.0, 0.5, 0.0]),
        (Constant::JointLimits, vec![-0.5, 0.4]),
        (Constant::GearRatio, vec![1.5]),
        (Constant::GearOffset, vec![0.2]),
        (Constant::Armature, vec![0.02, 0.0, 0.0]),
        (Constant::MotorTarget, vec![0.2]),
        (Constant::MotorStiffness, vec![20.0]),
        (Constant::MotorDamping, vec![1.0]),
        (Constant::MotorMaxForce, vec![30.0]),
    ] {
        assert_eq!(constant.values(&world), numbers, "{constant:?}");
        assert_eq!(constant.shape(&world).iter().product::<usize>(), numbers.len());
        assert!(constant.is_of_joints());
        let twice = constant.from_one_number(&world, 2.0);
        let set = world.with_constants(&[(constant, &twice)]).unwrap();
        assert_eq!(constant.values(&set), twice, "{constant:?}");
        // No other constant changes.
        for other in Constant::ALL.into_iter().filter(|other| *other != constant) {
            assert_eq!(other.values(&set), other.values(&world), "{constant:?} {other:?}");
        }
        let wrong = world.with_constants(&[(constant, &vec![-1.0; numbers.len()])]);
        let any = [
            Constant::MotorTarget,
            Constant::JointRest,
            Constant::JointForce,
            // Both limits are at the same place.
            Constant::JointLimits,
            Constant::GearRatio,
            Constant::GearOffset,
        ];
        assert_eq!(wrong.is_ok(), any.contains(&constant), "{constant:?}");
    }
    assert_eq!(Constant::Anchor.shape(&world), [2, 2, 3]);
    let anchors: Vec<_> = (0..12).map(|k| 0.1 * f64::from(k)).collect();
    let set = world.with_constants(&[(Constant::Anchor, &anchors)]).unwrap();
    assert_eq!(set.joints()[1].frames()[0].anchor.as_slice(), &anchors[6..9]);
    assert_eq!(Constant::JointLimits.shape(&world), [1, 2]);
    for (constant, wrong) in [
        (Constant::JointLimits, &[0.4, -0.5][..]),
        (Constant::JointRest, &[0.0, f64::NAN, 0.0]),
        (Constant::GearRatio, &[1e7]),
        (Constant::GearOffset, &[f64::INFINITY]),
    ] {
        assert!(world.with_constants(&[(constant, wrong)]).is_err(), "{constant:?}");
    }
    // A motor that holds a speed has no stiffness to set.
    let mut joints = world.joints().to_vec();
    let motor = Some(Motor::Speed { target: 1.0, max_force: 2.0 });
    let Axis::Free(drive) = joints[0].angular()[2] else { unreachable!() };
    let drive = Drive { motor, ..drive };
    joints[0] = joints[0].clone().with_drive(JointAxis::Angular(2), drive).unwrap();
    let fast = world.with_joints(joints).unwrap();
    assert!(fast.with_constants(&[(Constant::MotorStiffness, &[0.0])]).is_ok());
    let error = fast.with_constants(&[(Constant::MotorStiffness, &[5.0])]).unwrap_err();
    assert!(error.to_string().contains("a motor with a fixed speed"), "{error}");
}

/// Checks rollouts with varying motor targets, joint forces and constants of both, per rollout and
/// per step. The reference is a loop over simulations.
#[test]
fn motors_are_driven_in_rollouts() {
    use tumble_core::joint::Drive;
    const B: usize = 3;
    const T: usize = 60;
    let (world, starts) = (driven_world(), driven_starts());
    let motors: Vec<_> = (0..B * T).map(|k| (0.1 * k as f64).sin()).collect();
    let forces: Vec<_> = (0..T * 3).map(|k| 0.4 * (0.7 * k as f64).cos()).collect();
    let damping: Vec<_> = (0..B * 3).map(|k| 0.1 * k as f64).collect();
    let parameters = [Varied { constant: Constant::JointDamping, values: &damping }];
    let batch = Batch {
        steps: T,
        motors: &motors,
        joint_forces: &forces,
        parameters: &parameters,
        ..batch(&world, &starts, B)
    };
    let found = run(&batch, 2).unwrap();
    for rollout in 0..B {
        let given = [(Constant::JointDamping, &damping[3 * rollout..][..3])];
        let own = world.with_constants(&given).unwrap();
        let states: Vec<_> = batch_states(&starts);
        let mut simulation = Simulation::new(own.clone(), states, Motion::native(&own)).unwrap();
        let mut record = StepRecord::new();
        for step in 0..T {
            for (slot, (joint, axis)) in own.driven_axes().into_iter().enumerate() {
                let drive = *own.joints()[joint].drive(axis).unwrap();
                let target = motors[rollout * T + step];
                let force = drive.force + forces[3 * step + slot];
                let motor = drive.motor.map(|motor| motor.to(target));
                simulation.set_drive(joint, axis, Drive { force, motor, ..drive }).unwrap();
            }
            simulation.step(&mut record).unwrap();
            let numbers: Vec<_> = simulation
                .states()
                .iter()
                .flat_map(|state| state.to_vector().as_slice().to_vec())
                .collect();
            assert_eq!(found.states[(rollout * T + step) * 26..][..26], numbers[..]);
        }
    }
    assert!(run(&Batch { motors: &motors[1..], ..batch }, 1).is_err());
    assert!(run(&Batch { joint_forces: &forces[1..], ..batch }, 1).is_err());
}

/// Checks that targets of motors on sums come after the targets of motors on axes.
#[test]
fn motors_of_sums_are_driven_in_rollouts() {
    use tumble_core::joint::{Drive, Gear, GearAxis, JointAxis, Motor};
    const T: usize = 40;
    let servo = Motor::Position { target: 0.0, stiffness: 40.0, damping: 1.0, max_force: 3.0 };
    let axes = [JointAxis::Angular(2), JointAxis::Linear(2)];
    let [first, second] = [0, 1].map(|joint| GearAxis { joint, axis: axes[joint] });
    let sum = Gear::new(first, second, -2.0, 0.0);
    let sum = sum.with_drive(Drive { motor: Some(servo), ..Drive::NONE });
    let (world, starts) = (driven_world().with_gears(vec![sum]).unwrap(), driven_starts());
    assert_eq!(world.gear_motors(), [0]);
    let motors: Vec<_> = (0..2 * T).map(|k| (0.1 * k as f64).sin()).collect();
    let batch = Batch { steps: T, motors: &motors, ..batch(&world, &starts, 1) };
    let found = run(&batch, 1).unwrap();
    let motion = Motion::native(&world);
    let mut simulation = Simulation::new(world.clone(), batch_states(&starts), motion).unwrap();
    let mut record = StepRecord::new();
    for (step, targets) in motors.chunks(2).enumerate() {
        simulation
            .set_motor(
                0,
                axes[0],
                world.joints()[0].drive(axes[0]).unwrap().motor.map(|motor| motor.to(targets[0])),
            )
            .unwrap();
        let motor = Some(servo.to(targets[1]));
        simulation.set_gear_drive(0, Drive { motor, ..Drive::NONE }).unwrap();
        simulation.step(&mut record).unwrap();
        let numbers = numbers(simulation.states());
        assert_eq!(found.states[step * 26..][..26], numbers[..]);
    }
    assert!(
        found.states[26 * (T - 1)..]
            != run(&Batch { motors: &[], ..batch }, 1).unwrap().states[26 * (T - 1)..]
    );
    assert!(run(&Batch { motors: &motors[..T], ..batch }, 1).is_err());
}
