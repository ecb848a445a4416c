//! Derivatives by the constants of drives, against closed forms, and by the state of one body,
//! against products.

use super::{scenario, size, step};
use crate::common::prelude::*;
use nalgebra::SMatrix;
use tumble_core::solver::native::StepGradient;

const H: f64 = 0.01;
const MASS: f64 = 2.0;

/// Body on a slide with the given drive, at 0.3 m with 0.7 m/s.
fn on_a_slide(drive: Drive) -> (World, Vec<State>) {
    let parameters = Parameters {
        ground: None,
        gravity: Vector3::zeros(),
        friction: 0.0,
        time_step: H,
        ..Parameters::new(vec![RigidBody::solid_box(MASS, Vector3::repeat(0.1)).unwrap()])
    };
    let frame = JointFrame::at(Vector3::zeros());
    let joint = Joint::prismatic(0, None, [frame, frame], drive);
    let world = euler(parameters).with_joints(vec![joint]).unwrap();
    let state = State {
        velocity: Vector3::new(0.0, 0.0, 0.7),
        ..State::at_rest(Vector3::new(0.0, 0.0, 0.3))
    };
    (world, vec![state])
}

/// Checks the derivative by an armature that is zero: of v⁺ = (m + I) v/(m + I + h d) by I.
#[test]
fn a_slide_by_an_armature_that_it_does_not_have() {
    let damping = 3.0;
    let (world, states) = on_a_slide(Drive { damping, ..Drive::NONE });
    let (simulation, record) = step(&world, &states, &[]).unwrap();
    let mut derivative = StepDerivative::new();
    simulation.linearise(&record, &mut derivative).unwrap();
    let constants = [(Constant::Armature, &[1.0][..])];
    let mut end = Vec::new();
    derivative
        .jvp(&StepChange { constants: &constants, ..StepChange::default() }, &mut end)
        .unwrap();
    let below = MASS + H * damping;
    let expected = 0.7 * (1.0 / below - MASS / (below * below));
    let found = end[0].velocity[2];
    assert!((found - expected).abs() < 1e-9 * expected, "{found} {expected}");
}

/// Checks v⁺ = N/D and its derivatives by the constants, with
///
/// ```text
/// N = (m + I) v + h (k (x* − x) + k_m (y* − x) − f),   D = m + I + h (d + d_m) + h² (k + k_m)
/// ```
#[test]
fn a_slide_by_the_constants_of_its_drive() {
    let (x, v) = (0.3, 0.7);
    let (friction, k, d, inertia, rest) = (0.4, 30.0, 2.0, 0.5, 0.1);
    let (km, dm, target, most) = (50.0, 3.0, 0.8, 1e3);
    let motor = |most| Motor::Position { target, stiffness: km, damping: dm, max_force: most };
    let drive = |most| Drive {
        friction,
        stiffness: k,
        damping: d,
        armature: inertia,
        rest,
        motor: Some(motor(most)),
        ..Drive::NONE
    };
    let pulled = km * (target - x);
    let check = |drive: Drive, expected: &[(Constant, f64)]| {
        let (world, states) = on_a_slide(drive);
        let (simulation, record) = step(&world, &states, &[]).unwrap();
        let mut derivative = StepDerivative::new();
        simulation.linearise(&record, &mut derivative).unwrap();
        let along = |states: &[StateChange]| states[0].velocity[2];
        let (mut end, mut gradient) = (Vec::new(), StepGradient::default());
        let asked: Vec<Constant> = expected.iter().map(|(constant, _)| *constant).collect();
        let by_end = [StateChange { velocity: Vector3::new(0.0, 0.0, 1.0), ..StateChange::zero() }];
        derivative.vjp(&by_end, &asked, &mut gradient).unwrap();
        for ((constant, expected), pulled) in expected.iter().zip(&gradient.constants) {
            let constants = [(*constant, &[1.0][..])];
            let change = StepChange { constants: &constants, ..StepChange::default() };
            derivative.jvp(&change, &mut end).unwrap();
            // The condition of the systems is 1/ε.
            for found in [along(&end), pulled[0]] {
                let off = (found - expected).abs();
                assert!(off < 1e-9 * (1.0 + expected.abs()), "{constant:?} {found} {expected}");
            }
        }
        record.next_states()[0].velocity[2]
    };
    // The motor is below its force limit.
    let below = MASS + inertia + H * (d + dm) + H * H * (k + km);
    let above = (MASS + inertia) * v + H * (k * (rest - x) + pulled - friction);
    let by = |n: f64, d: f64| n / below - above / below * d / below;
    let end = check(
        drive(most),
        &[
            (Constant::JointFriction, by(-H, 0.0)),
            (Constant::JointStiffness, by(H * (rest - x), H * H)),
            (Constant::JointDamping, by(0.0, H)),
            (Constant::Armature, by(v, 1.0)),
            (Constant::MotorTarget, by(H * km, 0.0)),
            (Constant::MotorStiffness, by(H * (target - x), H * H)),
            (Constant::MotorDamping, by(0.0, H)),
            (Constant::MotorMaxForce, 0.0),
            (
                Constant::TimeStep,
                by(k * (rest - x) + pulled - friction, d + dm + 2.0 * H * (k + km)),
            ),
        ],
    );
    assert!((end - above / below).abs() < 1e-12);
    // The motor is at its force limit.
    let most = 5.0;
    let below = MASS + inertia + H * d + H * H * k;
    let above = (MASS + inertia) * v + H * (k * (rest - x) + most - friction);
    let by = |n: f64, d: f64| n / below - above / below * d / below;
    let held = [
        (Constant::MotorMaxForce, by(H, 0.0)),
        (Constant::MotorTarget, 0.0),
        (Constant::MotorStiffness, 0.0),
        (Constant::JointStiffness, by(H * (rest - x), H * H)),
    ];
    check(drive(most), &held);
    // A motor with damping only, N = m v + h d_m (w − v⁺), below and at its force limit.
    let damper = |most| {
        let motor = Motor::Damper { target, damping: dm, max_force: most };
        Drive { motor: Some(motor), ..Drive::NONE }
    };
    let (below, above) = (MASS + H * dm, MASS * v + H * dm * target);
    let by = |n: f64, d: f64| n / below - above / below * d / below;
    let end = check(
        damper(1e3),
        &[
            (Constant::MotorTarget, by(H * dm, 0.0)),
            (Constant::MotorDamping, by(H * target, H)),
            (Constant::MotorMaxForce, 0.0),
            (Constant::TimeStep, by(dm * target, dm)),
        ],
    );
    assert!((end - above / below).abs() < 1e-12);
    let held = [(Constant::MotorMaxForce, H / MASS), (Constant::MotorDamping, 0.0)];
    let end = check(damper(0.01), &held);
    assert!((end - v - H * 0.01 / MASS).abs() < 1e-12);
    // For a motor that holds a speed, and at a limit, only their targets count.
    let speed = Motor::Speed { target: 0.2, max_force: 1e3 };
    let held = Drive { motor: Some(speed), stiffness: k, ..Drive::NONE };
    check(held, &[(Constant::MotorTarget, 1.0), (Constant::JointStiffness, 0.0)]);
    let stopped = Drive { limits: Some([0.0, 0.304]), damping: d, ..Drive::NONE };
    let by_time_step = -(0.304 - x) / (H * H);
    check(stopped, &[(Constant::JointDamping, 0.0), (Constant::TimeStep, by_time_step)]);
}

/// Checks that the twelve columns of a body are the products with twelve unit changes.
#[test]
fn the_columns_of_a_body_are_its_products() {
    for name in [
        "real-cube",
        "stack",
        "pyramid",
        "bricks",
        "marbles",
        "chain",
        "double-pendulum",
        "four-bar",
        "pile",
    ] {
        let scene = scenario(&format!("{name}.toml"));
        let mut run = scene.simulation(&Default::default()).unwrap();
        let (mut record, mut worst) = (StepRecord::new(), 0.0_f64);
        let mut derivative = StepDerivative::new();
        for k in 0..scene.rows.min(200) - 1 {
            run.step(&mut record).unwrap();
            if k % 66 != 50 {
                continue;
            }
            run.linearise(&record, &mut derivative).unwrap();
            let bodies = record.states().len();
            let mut columns: Vec<SMatrix<f64, 12, 12>> = Vec::new();
            let mut end = Vec::new();
            for body in (0..bodies).step_by(1 + bodies / 5) {
                derivative.jacobian_wrt_state(body, &mut columns).unwrap();
                for column in 0..12 {
                    let mut unit = [0.0; 12];
                    unit[column] = 1.0;
                    let mut states = vec![StateChange::zero(); bodies];
                    states[body] = StateChange::from_array(&unit);
                    let change = StepChange { states: &states, ..StepChange::default() };
                    derivative.jvp(&change, &mut end).unwrap();
                    let scale = size(&end) + 1.0;
                    for (of, (end, columns)) in end.iter().zip(&columns).enumerate() {
                        let numbers: [f64; 12] = columns.column(column).into_owned().into();
                        let apart = end.plus(-1.0, &StateChange::from_array(&numbers));
                        let off = apart.dot(&apart).sqrt() / scale;
                        assert!(off < 1e-8, "{name} {k}: {of} by {body}, {column}: {off}");
                        worst = worst.max(off);
                    }
                }
            }
            assert!(derivative.jacobian_wrt_state(bodies, &mut columns).is_err());
        }
        println!("{name}: columns off by {worst:.1e} at most");
    }
}
