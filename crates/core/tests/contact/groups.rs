//! Collision groups: which objects touch, through changes of the world.

use crate::common::prelude::*;
use tumble_core::world::{Groups, Touching};

fn ball() -> RigidBody {
    let inertia = Matrix3::from_diagonal_element(0.4 * 0.01);
    RigidBody::from_pieces(1.0, inertia, vec![Piece::sphere(0.1).unwrap()]).unwrap()
}

/// Balls over the ground and over a plate at z = 1 m.
fn world(bodies: usize) -> World {
    let plate = Piece::cuboid(Vector3::new(1.0, 1.0, 0.1)).unwrap();
    let plate = plate.moved_by(&Matrix3::identity(), &Vector3::new(0.0, 0.0, 0.9)).unwrap();
    euler(Parameters::new(vec![ball(); bodies])).with_fixed(vec![plate])
}

fn at(height: f64) -> State {
    State::at_rest(Vector3::new(0.0, 0.0, height))
}

fn groups(members: u64, collides_with: u64) -> Groups {
    Groups { members, collides_with }
}

const ALL: u64 = u64::MAX;

/// Heights after one second [m].
fn run(simulation: &mut Simulation<'_>) -> Vec<f64> {
    last_step(simulation, 500, |record| record.residual() <= 1e-9);
    simulation.states().iter().map(|state| state.position[2]).collect()
}

fn fallen(world: World, heights: &[f64]) -> Vec<f64> {
    let starts: Vec<_> = heights.iter().map(|height| at(*height)).collect();
    let motion = Motion::native(&world);
    run(&mut Simulation::new(world, starts, motion).unwrap())
}

#[test]
fn two_objects_touch_if_each_collides_with_a_group_of_the_other() {
    for (a, b, touch) in [
        (groups(1, ALL), groups(1, ALL), true),
        (groups(1, 1), groups(2, 2), false),
        (groups(1, 2), groups(2, 1), true),
        // One side alone is not enough.
        (groups(1, 2), groups(2, 2), false),
        (groups(5, 2), groups(2, 4), true),
        (groups(0, ALL), groups(1, ALL), false),
        (groups(1 << 63, ALL), groups(1, 1 << 63), true),
    ] {
        assert_eq!((a.may_touch(b), b.may_touch(a)), (touch, touch), "{a:?} {b:?}");
        let world = world(3).with_groups(Partner::Body(0), a).unwrap();
        let world = world.with_groups(Partner::Body(2), b).unwrap();
        assert_eq!(world.may_touch(0, Partner::Body(2)), touch);
        assert_eq!(world.may_touch(2, Partner::Body(0)), touch);
        assert_eq!(world.groups_of(Partner::Body(2)), b);
    }
}

#[test]
fn balls_pass_through_what_their_groups_exclude() {
    let (floor, plate) = (Partner::Ground, Partner::Fixed(0));
    let first = Partner::Body(0);
    let start = [1.3, 1.6];
    // On the plate, and on each other.
    let usual = fallen(world(2), &start);
    assert!((usual[0] - 1.1).abs() < 1e-9 && (usual[1] - 1.3).abs() < 1e-9, "{usual:?}");
    // The lower ball collides with the ground alone, the upper one with everything.
    let lower = world(2).with_groups(first, groups(1, 2)).unwrap();
    assert!(lower.may_touch(0, floor) && !lower.may_touch(0, plate));
    let fell = fallen(lower, &start);
    assert!((fell[0] - 0.1).abs() < 1e-9 && (fell[1] - 1.1).abs() < 1e-9, "{fell:?}");
    // The plate is in a third group, and the lower ball in a fourth.
    let other = world(2).with_groups(plate, groups(4, ALL)).unwrap();
    let other = other.with_groups(first, groups(8, ALL ^ 4)).unwrap();
    let other = other.with_groups(Partner::Body(1), groups(1, ALL ^ 8)).unwrap();
    let fell = fallen(other, &start);
    assert!((fell[0] - 0.1).abs() < 1e-9 && (fell[1] - 1.1).abs() < 1e-9, "{fell:?}");
    // Both collide with the ground alone, so no two pieces may touch.
    let both = world(2).with_groups(first, groups(1, 2)).unwrap();
    let both = both.with_groups(Partner::Body(1), groups(1, 2)).unwrap();
    let fell = fallen(both, &start);
    assert!(fell.iter().all(|height| (height - 0.1).abs() < 1e-9), "{fell:?}");
    // The ground itself collides with nothing.
    let free = world(1).with_fixed(Vec::new());
    let free = free.with_groups(floor, groups(2, 0)).unwrap();
    let fell = fallen(free, &[0.5]);
    assert!(fell[0] < -4.0, "{fell:?}");
}

#[test]
fn candidates_of_one_world_serve_another() {
    let together = world(2).with_fixed(Vec::new());
    let split = together.clone().with_groups(Partner::Body(0), groups(1, 2)).unwrap();
    let states = [at(0.1), at(0.3)];
    let mut candidates = Candidates::new();
    for (world, count) in [(&together, 2), (&split, 1), (&together, 2), (&split, 1)] {
        candidates.find(Detection::default(), world, &states, &states);
        assert_eq!(candidates.contacts().len(), count);
        candidates.clear();
    }
}

#[test]
fn groups_stay_with_their_objects() {
    let own = groups(4, 6);
    let world = world(4).with_groups(Partner::Body(2), own).unwrap();
    let world = world.with_groups(Partner::Fixed(0), groups(4, 4)).unwrap();
    let fewer = world.without_body(0).unwrap();
    assert_eq!(fewer.groups_of(Partner::Body(1)), own);
    assert_eq!(fewer.groups_of(Partner::Body(2)), Groups::default());
    let more = fewer.with_body(ball()).unwrap();
    assert_eq!(more.groups_of(Partner::Body(3)), Groups::default());
    let frames = [JointFrame::at(Vector3::zeros()); 2];
    let tied = world.clone().with_joints(vec![Joint::spherical(2, Some(3), frames)]).unwrap();
    assert_eq!(tied.groups_of(Partner::Body(2)), own);
    let same = world.with_parameters(world.parameters().clone()).unwrap();
    assert_eq!(same, world);
    // The last body with groups takes them with it, so the world is as one without groups.
    let plain = world.clone().with_groups(Partner::Fixed(0), Groups::default()).unwrap();
    let gone = plain.without_body(2).unwrap();
    assert_eq!(gone, self::world(3));
    assert_eq!(world.groups_of(Partner::Ground), Groups::GROUND);
    assert!(world.clone().with_groups(Partner::Body(4), own).is_err());
    assert!(world.clone().with_groups(Partner::Fixed(1), own).is_err());
}

#[test]
fn a_body_added_between_steps_has_its_groups() {
    let ground_alone = Touching { groups: groups(1, 2), ..Touching::default() };
    for (touching, end) in [
        (Touching::default(), 1.1),
        (ground_alone.clone(), 0.1),
        // Free fall for 500 steps from rest: h² g k (k + 1)/2.
        (Touching { untouched: true, ..ground_alone.clone() }, 1.3 - 9.81 * 4e-6 * 125_250.0),
    ] {
        let first = world(1);
        let motion = Motion::native(&first);
        let mut simulation = Simulation::new(first, vec![at(50.0)], motion).unwrap();
        let index = simulation.add_body_with(ball(), at(1.3), touching.clone()).unwrap();
        assert_eq!(simulation.world().touching_of(index), touching);
        let heights = run(&mut simulation);
        assert!((heights[index] - end).abs() < 1e-9, "{touching:?}: {heights:?}");
        simulation.remove_body(0).unwrap();
        assert_eq!(simulation.world().touching_of(0), touching);
    }
    // A body may start inside of what it does not touch.
    let first = world(1);
    let motion = Motion::native(&first);
    let mut simulation = Simulation::new(first, vec![at(0.1)], motion).unwrap();
    assert!(simulation.add_body(ball(), at(0.15)).is_err());
    simulation.add_body_with(ball(), at(0.15), ground_alone).unwrap();
}

/// Checks that a body added to a simulation has the coefficients that it has in its own world.
#[test]
fn an_added_body_has_its_own_coefficients() {
    use Coefficient::{Adhesion, Friction, Restitution, RollingFriction};
    let own = vec![(Friction, 0.2), (Restitution, 0.3), (RollingFriction, 0.01), (Adhesion, 3.0)];
    let with = |world: World, (of, value): &(_, f64)| {
        world.with_coefficient_of(*of, Partner::Body(1), *value)
    };
    let model = own.iter().try_fold(world(2), with).unwrap();
    let before = world(1);
    let motion = Motion::native(&before);
    let mut simulation = Simulation::new(before, [at(0.5)], motion).unwrap();
    simulation.add_body_with(ball(), at(3.0), model.touching_of(1)).unwrap();
    assert_eq!(simulation.world().coefficients_of(Partner::Body(1)), own);
}
