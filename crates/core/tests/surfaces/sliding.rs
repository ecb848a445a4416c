//! A body that slides over flush joints moves as on one plane.

use crate::campaign::size;
use crate::common::draw::WideDraw;
use crate::common::prelude::*;
use crate::floors::{FLOORS, floor, world};
use crate::shapes::{SHAPES, standing};
use std::f64::consts::TAU;

/// Largest difference of positions and velocities from those on one plane (m, m/s).
const SAME: f64 = 1e-9;

struct Path {
    states: Vec<State>,
    /// Steps that did not converge, are unphysical or have a misplaced contact.
    bad: usize,
}

fn is_solved(status: StepStatus) -> bool {
    matches!(status, StepStatus::Converged | StepStatus::Retried | StepStatus::Free)
}

fn run(world: &World, start: &State, steps: usize) -> Path {
    let (mut simulation, mut record) = (simulate(world, &[*start]), StepRecord::new());
    let mut path = Path { states: vec![*start], bad: 0 };
    for _ in 0..steps {
        simulation.step(&mut record).unwrap();
        let status = record.status();
        path.bad += usize::from(!is_solved(status) || record.placement() != 0.0);
        path.states.push(*simulation.state());
    }
    path
}

/// A run in which the body `shape` slides over the floor `name`, and the same run on a plane.
fn differs(shape: &str, name: &str, friction: f64, seed: u64, steps: usize) -> Option<String> {
    let mut random = WideDraw::wide(seed);
    let body = standing(shape, &mut random);
    let place = [random.within(-0.5, 0.5), random.within(-0.5, 0.5)];
    let (speed, way) = (random.within(0.5, 3.5), random.within(0.0, TAU));
    let velocity = [speed * way.cos(), speed * way.sin(), 0.0];
    let start = body.at(place, random.within(0.0, TAU), velocity);
    let ground = world(&body.body, true, friction);
    let ground = match name {
        "belts" => ground.with_surface(Partner::Ground, Vector3::new(0.7, 0.2, 0.0)).unwrap(),
        _ => ground,
    };
    let expected = run(&ground, &start, steps);
    let found = run(&floor(name, &body.body, friction, &mut random), &start, steps);
    let case = format!("{shape} on {name}, friction {friction}, seed {seed}");
    if found.bad > 0 {
        return Some(format!("{case}: {} steps are not solved", found.bad));
    }
    let mut pairs = expected.states.iter().zip(&found.states).enumerate();
    let differs = |(_, (one, other)): &(usize, (&State, &State))| {
        let apart = (one.position - other.position).norm();
        let speeds = (one.velocity - other.velocity).norm();
        !(apart <= SAME && speeds <= SAME)
    };
    pairs.find(differs).map(|(k, (one, other))| {
        let (v, w) = (one.velocity, other.velocity);
        format!("{case}: step {k} at {:?}: velocity {v:?} on the plane, {w:?}", one.position)
    })
}

/// Runs `count` cases of each shape, floor and friction.
fn all_slide_as_on_a_plane(count: u64, steps: usize) {
    let mut wrong = Vec::new();
    let mut runs = 0;
    for shape in SHAPES {
        for name in FLOORS {
            for friction in [0.0, 0.3] {
                for seed in 0..count {
                    runs += 1;
                    wrong.extend(differs(shape, name, friction, seed, steps));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{} of {runs} runs differ:\n{}", wrong.len(), wrong.join("\n"));
}

#[test]
fn bodies_slide_over_flush_joints_as_over_one_plane() {
    all_slide_as_on_a_plane(2, 250);
}

#[test]
fn plates_flush_with_the_ground_change_no_slide() {
    let cases = [("cube", 0.0, 3, 60), ("capsule", 0.3, 3, 20), ("cylinder", 0.0, 2, 160)];
    for (shape, friction, seed, steps) in cases {
        assert_eq!(differs(shape, "plates", friction, seed, steps), None);
    }
}

#[test]
#[ignore = "slow"]
fn bodies_of_all_shapes_slide_over_random_floors_of_each_kind() {
    all_slide_as_on_a_plane(size(20, 60) as u64, 500);
}
