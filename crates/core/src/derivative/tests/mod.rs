//! Unit tests of `derivative/mod.rs`.

use super::*;
use crate::kinematics::Rotation;

fn state() -> State {
    State {
        position: Vector3::new(0.3, -1.0, 2.0),
        attitude: Vector4::new(0.3, -0.7, 0.2, 0.5).normalize(),
        velocity: Vector3::new(1.0, 2.0, -0.5),
        spin: Vector3::new(9.0, -14.0, 5.0),
    }
}

#[test]
fn a_change_and_what_it_makes_belong_together() {
    let change = StateChange {
        position: Vector3::new(1.0, 2.0, 3.0),
        turn: Vector3::new(0.4, -1.1, 0.7),
        velocity: Vector3::new(4.0, 5.0, 6.0),
        spin: Vector3::new(7.0, 8.0, 9.0),
    };
    let found = StateChange::between(&state(), &change.applied(&state()));
    assert!(found.plus(-1.0, &change).dot(&found.plus(-1.0, &change)) < 1e-28);
    assert_eq!(StateChange::from_array(&change.to_array()), change);
}

/// Central differences of 1e-6: third-order error 1e-12, rounding error 1e-10.
#[test]
fn the_end_of_a_step_follows_its_start() {
    let (start, h) = (state(), 0.03);
    let step = |h: f64| StepMap { form: Rotation::Momentum, time_step: h };
    let end = |start: &State, h: f64| step(h).coasted(start);
    let map = EndMap::new(&start.velocity, &start.spin, &step(h));
    for k in 0..StateChange::LEN + 1 {
        let mut numbers = [0.0; 13];
        numbers[k] = 1e-6;
        let moved = |sign: f64| {
            let part: [f64; 12] = std::array::from_fn(|k| sign * numbers[k]);
            let moved = StateChange::from_array(&part).applied(&start);
            end(&moved, h + sign * numbers[12])
        };
        let difference = StateChange::between(&moved(-1.0), &moved(1.0)).to_array();
        let change = StateChange::from_array(&std::array::from_fn(|k| numbers[k] * 1e6));
        let step = numbers[12] * 1e6;
        let pushed = map.jvp(&change, &change.velocity, &change.spin, step).to_array();
        for (found, expected) in pushed.iter().zip(difference) {
            assert!((found - expected / 2e-6).abs() < 1e-8, "{k}: {found} {expected}");
        }
        // Checks ⟨w, J v⟩ = ⟨Jᵀ w, v⟩.
        let w = StateChange::from_array(&std::array::from_fn(|k| (k as f64).sin() + 0.3));
        let (back, (linear, spin), by_step) = map.vjp(&w);
        let there = w.dot(&StateChange::from_array(&pushed));
        let here = back.dot(&change)
            + linear.dot(&change.velocity)
            + spin.dot(&change.spin)
            + by_step * step;
        assert!((there - here).abs() < 1e-12);
    }
}
