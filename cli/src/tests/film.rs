//! Unit tests of `film.rs`.

use super::*;
use nalgebra::{SVector, Vector3};
use tumble::tutorial_parameters;
use tumble_core::contact::Partner;
use tumble_core::mechanics::State;
use tumble_core::simulation::Interval;
use tumble_core::step::StepSolution;
use tumble_scene::output::tables::{ContactRow, KeyText};

/// A frame of a body with `count` contacts.
fn frame(count: usize) -> IntervalRows {
    let world = World::new(tutorial_parameters().unwrap()).unwrap();
    let states = vec![State::from_vector(&SVector::zeros())];
    let interval = Interval::new(states, Vec::new(), StepSolution::default());
    let mut step = IntervalRows::new(&world, 0, 0, &interval);
    let contact = ContactRow {
        index: 0,
        body: 0,
        partner: Partner::Ground,
        point: Vector3::zeros(),
        normal: Vector3::z(),
        force: Vector3::z(),
        slip: Vector3::zeros(),
        gap: 0.0,
        radius: 0.0,
        rebound: 0.0,
        key: KeyText { point: 0, pair: None },
        friction: 0.0,
        interval: 0,
        length: 0.0,
        moment: Vector3::zeros(),
    };
    step.contacts = vec![contact; count].into();
    step
}

/// A million rows of a box fit; of a body with a thousand contacts, only some thousand rows do.
#[test]
fn memory_estimate_includes_contacts() {
    let of = |count| memory(&frame(count));
    assert!(of(8) * 1_000_000 <= MOST_BYTES, "{}", of(8));
    let rows = MOST_BYTES / of(1000);
    assert!((5_000..20_000).contains(&rows), "{rows}");
}
