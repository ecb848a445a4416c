//! Unit tests of `control.rs`.

use super::*;
use nalgebra::Vector4;

fn state() -> State {
    State {
        position: Vector3::new(0.3, -1.0, 2.0),
        attitude: Vector4::new(0.3, -0.7, 0.2, 0.5).normalize(),
        velocity: Vector3::new(1.0, 2.0, -0.5),
        spin: Vector3::new(9.0, -14.0, 5.0),
    }
}

fn kinds() -> Vec<ControlKind> {
    let push = |friction| {
        let first = Vector3::new(0.1, 0.8, -0.4).normalize();
        let second = Vector3::new(0.9, 0.1, 0.3).cross(&first).normalize();
        let frame = Matrix3::from_columns(&[first, second, first.cross(&second)]);
        let point = Vector3::new(0.2, -0.3, 0.1);
        ControlKind::Push(PushControl { body: 0, point, frame, friction })
    };
    let (force, torque) = (ControlKind::Force { body: 0 }, ControlKind::Torque { body: 0 });
    vec![force, torque, push(None), push(Some(0.4))]
}

const NUMBERS: [f64; 5] = [3.0, 0.6, -0.4, 0.07, -0.11];

/// Central differences of 1e-4 of a polynomial of third degree have an error of 1e-8.
#[test]
fn slopes_agree_with_differences() {
    for kind in kinds() {
        let count = kind.components().len();
        let numbers = &NUMBERS[..count];
        let wrench = |numbers: &[f64]| kind.applied(numbers).unwrap();
        let moved = |k: usize, by: f64| {
            let mut numbers = numbers.to_vec();
            numbers[k] += by;
            numbers
        };
        for k in 0..count {
            let (up, down) = (moved(k, 1e-4), moved(k, -1e-4));
            let slope = kind.slopes(numbers)[k];
            let (a, b) = (wrench(&up), wrench(&down));
            assert!(((a.force - b.force) / 2e-4 - slope.force).amax() < 1e-7, "{kind:?}");
            assert!(((a.torque - b.torque) / 2e-4 - slope.torque).amax() < 1e-7, "{kind:?}");
        }
    }
}

#[test]
fn wrenches_turn_with_the_body() {
    for kind in kinds() {
        let applied = kind.applied(&NUMBERS[..kind.components().len()]).unwrap();
        let (by_force, by_torque) = applied.by_turn(&state());
        for k in 0..3 {
            let turned = |by: f64| {
                let turn = Vector3::ith(k, by);
                let change = StateChange { turn, ..StateChange::zero() };
                applied.wrench(&change.applied(&state()))
            };
            let (a, b) = (turned(1e-5), turned(-1e-5));
            assert!(((a.force - b.force) / 2e-5 - by_force.column(k)).amax() < 1e-8);
            assert!(((a.torque - b.torque) / 2e-5 - by_torque.column(k)).amax() < 1e-8);
        }
    }
}

#[test]
fn starts_follow_their_numbers() {
    let parts = [StartPart::Position, StartPart::Turn, StartPart::Velocity, StartPart::Spin];
    for part in parts {
        let kind = ControlKind::Start { body: 0, part };
        for numbers in [[0.4, -1.1, 0.7], [1e-3, 2e-3, -1e-3]] {
            for k in 0..3 {
                let moved = |by: f64| {
                    let mut numbers = numbers;
                    numbers[k] += by;
                    kind.started(&numbers, &state())
                };
                let here = kind.started(&numbers, &state());
                let up = StateChange::between(&here, &moved(1e-5));
                let down = StateChange::between(&here, &moved(-1e-5));
                let slope = kind.start_slope(&numbers, k).unwrap();
                let apart = up.plus(-1.0, &down).plus(-2e-5, &slope);
                assert!(apart.dot(&apart).sqrt() < 2e-5 * 1e-8, "{part:?}, {k}");
            }
        }
    }
}
