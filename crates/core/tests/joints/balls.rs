//! Ball joints with a cone. Within the cone they are plain ball joints, for any rotation and any
//! start.

use crate::common::prelude::*;

/// Two free bodies side by side, connected by the given joint.
fn pair(joint: Joint) -> World {
    let body = || {
        let inertia = Matrix3::from_diagonal(&Vector3::new(2e-3, 3e-3, 4e-3));
        RigidBody::new(1.0, inertia, &[Vector3::repeat(0.01)]).unwrap()
    };
    let (ground, gravity) = (None, Vector3::zeros());
    let bodies = vec![body(), body()];
    let rotation = Rotation::Momentum;
    let parameters = Parameters { ground, gravity, rotation, ..Parameters::new(bodies) };
    let world = World::new(parameters).unwrap().with_joints(vec![joint]).unwrap();
    world.with_untouched(0).unwrap().with_untouched(1).unwrap()
}

fn states() -> Vec<State> {
    let at = |x: f64| State::at_rest(Vector3::new(x, 0.0, 0.0));
    vec![at(0.0), at(0.4)]
}

/// Frames of the bodies along `axis`. Their z axes make the angle `swing` [rad].
fn frames(axis: Vector3<f64>, swing: f64) -> [JointFrame; 2] {
    let a = JointFrame::along(Vector3::new(0.2, 0.0, 0.0), axis).unwrap();
    let b = JointFrame::along(Vector3::new(-0.2, 0.0, 0.0), axis).unwrap();
    let turn = Vector4::new((0.5 * swing).cos(), (0.5 * swing).sin(), 0.0, 0.0);
    let attitude = left(&b.attitude) * turn;
    [a, JointFrame { attitude, ..b }]
}

fn run(joint: Joint, torque: Vector3<f64>, steps: usize) -> (Vec<State>, f64) {
    let world = pair(joint);
    let motion = Motion::native(&world);
    let mut simulation = Simulation::new(world, states(), motion).unwrap();
    simulation.set_wrench(0, Wrench { force: Vector3::zeros(), torque }).unwrap();
    let (mut record, mut residual) = (StepRecord::new(), 0.0_f64);
    for _ in 0..steps {
        simulation.step(&mut record).unwrap();
        residual = residual.max(record.residual());
    }
    (simulation.states().to_vec(), residual)
}

/// Checks that the cone has no effect within its limit, not even where the axes are aligned. A
/// swing is never negative, so that zero must not act as a lower limit.
#[test]
fn limited_ball_joint_is_free_within_its_cone() {
    for axis in [Vector3::x(), Vector3::y(), Vector3::z(), Vector3::new(0.3, -0.5, 0.8)] {
        for torque in [Vector3::x(), Vector3::y(), Vector3::z(), Vector3::new(0.3, 0.5, 0.2)] {
            for swing in [0.0, 1e-3, -0.02, 0.02] {
                let torque = torque * 0.05;
                let [a, b] = frames(axis, swing);
                let ball = Joint::ball(0, Some(1), [a, b], 1.5, Drive::NONE);
                let (free, _) = run(Joint::spherical(0, Some(1), [a, b]), torque, 60);
                let (within, residual) = run(ball, torque, 60);
                for (free, within) in free.iter().zip(&within) {
                    let off = (free.to_vector() - within.to_vector()).amax();
                    assert!(off < 1e-10, "{axis:?} {torque:?} {swing}: {off:.1e}");
                }
                assert!(residual < 1e-9);
            }
        }
    }
}

/// Checks that the certificate rejects a torque that keeps the axes aligned.
#[test]
fn a_torque_that_keeps_axes_in_one_line_breaks_the_law() {
    let world = pair(Joint::ball(0, Some(1), frames(Vector3::y(), 0.0), 1.5, Drive::NONE));
    let motion = Motion::native(&world);
    let mut simulation = Simulation::new(world.clone(), states(), motion).unwrap();
    let mut record = StepRecord::new();
    simulation.step(&mut record).unwrap();
    let wrenches = [Wrench::zero(); 2];
    let judged = |torque: f64| {
        let mut joints = record.first().solution.joints.clone();
        joints[0].torque[0] = torque;
        let claim = Claim {
            states: record.states(),
            next: record.next_states(),
            wrenches: &wrenches,
            contacts: &[],
            joints: &joints,
            gears: &[],
        };
        Certifier::new().contact_step(&world, &claim, std::iter::empty::<Vector3<f64>>())
    };
    assert!(judged(0.0).residual() < 1e-12);
    for torque in [0.01, -0.01] {
        assert!(judged(torque).joint_law > 1e-3, "{torque}: {:?}", judged(torque));
    }
}
