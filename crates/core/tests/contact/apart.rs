//! Bodies that may not touch: pairs excluded from contact, and bodies excluded from all contacts.

use crate::common::prelude::*;

fn ball() -> RigidBody {
    let inertia = Matrix3::from_diagonal_element(0.4 * 0.01);
    RigidBody::from_pieces(1.0, inertia, vec![Piece::sphere(0.1).unwrap()]).unwrap()
}

fn world(bodies: usize) -> World {
    euler(Parameters {
        ground: Some(Plane::new(Vector3::z(), 0.0).unwrap()),
        ..Parameters::new(vec![ball(); bodies])
    })
}

fn at(height: f64) -> State {
    State::at_rest(Vector3::new(0.0, 0.0, height))
}

/// Heights after one second [m].
fn fallen(world: World, heights: &[f64]) -> Vec<f64> {
    let starts: Vec<_> = heights.iter().map(|height| at(*height)).collect();
    let mut simulation = simulate(&world, &starts);
    last_step(&mut simulation, 500, |record| record.residual() <= 1e-9);
    simulation.states().iter().map(|state| state.position[2]).collect()
}

/// Checks that candidates found for one world are not reused for another with the same pieces but
/// other excluded pairs.
#[test]
fn candidates_of_one_world_serve_another() {
    let together = world(2);
    let apart = together.clone().with_apart(1, Partner::Body(0)).unwrap();
    let states = [at(0.1), at(0.3)];
    let mut candidates = Candidates::new();
    for (world, count) in [(&together, 2), (&apart, 1), (&together, 2), (&apart, 1)] {
        candidates.find(Detection::default(), world, &states, &states);
        assert_eq!(candidates.contacts().len(), count);
        candidates.clear();
    }
}

#[test]
fn balls_that_are_kept_apart_pass_through_each_other() {
    let touching = fallen(world(2), &[0.1, 0.5]);
    assert!((touching[1] - 0.3).abs() < 1e-9, "{touching:?}");
    let apart = world(2).with_apart(1, Partner::Body(0)).unwrap();
    assert!(!apart.may_touch(0, Partner::Body(1)) && apart.may_touch(0, Partner::Ground));
    let fell = fallen(apart, &[0.1, 0.5]);
    assert!((fell[0] - 0.1).abs() < 1e-9 && (fell[1] - 0.1).abs() < 1e-9, "{fell:?}");
}

#[test]
fn a_body_may_pass_the_ground_or_what_is_fixed_alone() {
    let plate = Piece::cuboid(Vector3::new(1.0, 1.0, 0.1)).unwrap();
    let plate = plate.moved_by(&Matrix3::identity(), &Vector3::new(0.0, 0.0, 1.0)).unwrap();
    let fixed = vec![plate];
    let world = world(1).with_fixed(fixed);
    let on_it = fallen(world.clone(), &[1.3]);
    assert!((on_it[0] - 1.2).abs() < 1e-9, "{on_it:?}");
    let through = fallen(world.clone().with_apart(0, Partner::Fixed(0)).unwrap(), &[1.3]);
    assert!((through[0] - 0.1).abs() < 1e-9, "{through:?}");
    let both = world.with_untouched(0).unwrap();
    let free = fallen(both, &[1.3]);
    // Free flight: h² g k (k + 1)/2.
    assert!((free[0] - (1.3 - 9.81 * 4e-6 * 125_250.0)).abs() < 1e-9, "{free:?}");
}

#[test]
fn excluded_pairs_stay_with_their_bodies() {
    let world =
        world(4).with_apart(3, Partner::Body(1)).unwrap().with_apart(2, Partner::Ground).unwrap();
    let world = world.with_untouched(0).unwrap();
    let frames = [JointFrame::at(Vector3::zeros()); 2];
    let tied = world.clone().with_joints(vec![Joint::spherical(2, Some(3), frames)]).unwrap();
    assert!(!tied.may_touch(2, Partner::Body(3)) && !tied.may_touch(1, Partner::Body(3)));
    assert!(!tied.may_touch(0, Partner::Ground) && !tied.may_touch(1, Partner::Body(0)));
    let fewer = world.without_body(0).unwrap();
    assert!(!fewer.may_touch(0, Partner::Body(2)) && !fewer.may_touch(1, Partner::Ground));
    assert!(fewer.may_touch(0, Partner::Ground) && fewer.may_touch(0, Partner::Body(1)));
    assert_eq!(fewer.kept_apart(), [(0, Partner::Body(2)), (1, Partner::Ground)]);
    assert!(world.clone().with_apart(1, Partner::Body(1)).is_err());
    assert!(world.clone().with_apart(9, Partner::Ground).is_err());
    assert!(world.clone().with_apart(0, Partner::Fixed(0)).is_err());
    assert!(world.with_untouched(4).is_err());
}
