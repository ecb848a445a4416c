//! Derivatives of the largest factor, against differences and closed forms.

use super::{GRAVITY, Scene, assert_close};
use nalgebra::Vector3;
use tumble::Partner;
use tumble::statics::{LoadCase, Structure};

#[test]
fn slopes_of_a_sliding_block_by_friction_and_mass() {
    let mut scene = Scene::new(0.5);
    scene.add_box(2.0, [0.2, 0.2, 0.1], [0.0, 0.0, 0.1]);
    let structure = scene.structure();
    let case = LoadCase::push(&structure, 0, Vector3::x(), Vector3::new(0.0, 0.0, -0.05)).unwrap();
    let limit = structure.largest_factor(&case);
    let slopes = structure.friction_slopes(&limit);
    assert_eq!(slopes[0].0, (0, Partner::Ground));
    assert_close(slopes[0].1, 2.0 * GRAVITY, 1e-6);
    assert_close(structure.mass_slopes(&limit, &case)[0], 0.5 * GRAVITY, 1e-6);
    // An acceleration of the base does not depend on the mass.
    let base = LoadCase::base(&structure, Vector3::x());
    let limit = structure.largest_factor(&base);
    assert!(structure.mass_slopes(&limit, &base)[0].abs() < 1e-6);
}

/// Structure and load case of a number.
type Maker = Box<dyn Fn(f64) -> Option<(Structure, LoadCase)>>;

/// Push on a block on a block, on the ground.
fn tower(half: f64, mass: f64, shift: f64, friction: f64) -> Option<(Structure, LoadCase)> {
    let mut scene = Scene::new(friction);
    scene.add_box(3.0, [0.3, 0.3, 0.1], [0.0, 0.0, 0.1]);
    scene.add_box(mass, [half, 0.1, 0.2], [shift, 0.0, 0.4]);
    let structure = scene.structure();
    let case = LoadCase::push(&structure, 1, Vector3::x(), Vector3::new(0.0, 0.0, 0.1)).ok()?;
    Some((structure, case))
}

#[test]
fn slopes_by_sizes_positions_masses_and_friction_agree_with_differences() {
    // The upper block tips: F (0.3 m) = m g a.
    let checks: [(&str, Maker, f64, f64); 4] = [
        ("size", Box::new(|half| tower(half, 1.0, 0.0, 0.9)), 0.1, GRAVITY / 0.3),
        ("mass", Box::new(|mass| tower(0.1, mass, 0.0, 0.9)), 1.0, GRAVITY * 0.1 / 0.3),
        // At the edge of the lower block the lever becomes shorter.
        ("position", Box::new(|shift| tower(0.1, 1.0, shift, 0.9)), 0.25, -GRAVITY / 0.3),
        ("friction", Box::new(|friction| tower(0.1, 1.0, 0.0, friction)), 0.2, GRAVITY),
    ];
    for (name, at, p, expected) in checks {
        let slope = Structure::slope(at, p, 1e-5 * p).unwrap_or_else(|| panic!("{name}"));
        assert!(slope.is_unique, "{name}: {slope:?}");
        assert_close(slope.value, expected, 1e-5);
        assert_close(slope.sides[0], expected, 1e-3);
    }
}

#[test]
fn a_slope_is_one_sided_where_two_mechanisms_meet() {
    // At μ = a/h the block slides and tips at once: more friction does not help, less hurts.
    let at = |friction: f64| {
        let mut scene = Scene::new(friction);
        scene.add_box(1.0, [0.1, 0.1, 0.4], [0.0, 0.0, 0.4]);
        let structure = scene.structure();
        let case = LoadCase::push(&structure, 0, Vector3::x(), Vector3::zeros()).ok()?;
        Some((structure, case))
    };
    let slope = Structure::slope(at, 0.25, 1e-4).unwrap();
    assert!(!slope.is_unique);
    assert_close(slope.sides[0], GRAVITY, 1e-3);
    assert!(slope.sides[1].abs() < 1e-2);
    assert!((-1e-3..=GRAVITY * 1.001).contains(&slope.value), "{slope:?}");
}

#[test]
fn weak_places_are_those_of_the_mechanism() {
    let (structure, case) = tower(0.1, 1.0, 0.0, 0.9).unwrap();
    let tumble::statics::Limit::Factor { mechanism, .. } = structure.largest_factor(&case) else {
        panic!("no factor")
    };
    let spots = structure.weak_contacts(&mechanism);
    // The upper block opens at the side of the push; the lower one does not move.
    let bodies = structure.weak_bodies(&mechanism);
    assert_eq!(bodies[0].0, 1);
    assert!(bodies.len() == 1 || bodies[1].1 < 1e-4, "{bodies:?}");
    assert_eq!(structure.pair(spots[0].contact), (0, Partner::Body(1)));
    assert!(structure.contacts()[spots[0].contact].point.x < 0.0 && spots[0].opening > 0.5);
}
