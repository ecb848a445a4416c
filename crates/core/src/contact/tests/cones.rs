//! Unit tests of `cones.rs`.

use super::*;
use std::f64::consts::PI;

fn surface(normals: &[[f64; 3]]) -> LocalSurface {
    let normals = normals.iter().map(|n| Vector3::from(*n)).collect();
    LocalSurface { normals, is_rigid: true }
}

#[test]
fn cone_of_normals_has_its_combinations_only() {
    let (x, z) = ([1.0, 0.0, 0.0], [0.0, 0.0, 1.0]);
    let edge = surface(&[x, z]).normals;
    let is_in = |n: [f64; 3]| is_in_cone(&edge, &Vector3::from(n).normalize());
    assert!(is_in(x) && is_in(z) && is_in([1.0, 0.0, 2.0]));
    assert!(!is_in([-1e-3, 0.0, 1.0]) && !is_in([1.0, 1e-3, 1.0]) && !is_in([-1.0, 0.0, 0.0]));
    // No normal: the inside of a piece.
    assert!(!is_in_cone(&[], &Vector3::z()));
    // Both sides of a facet.
    let facet = surface(&[z, [0.0, 0.0, -1.0], x]).normals;
    assert!(is_in_cone(&facet, &Vector3::z()) && is_in_cone(&facet, &-Vector3::z()));
    assert!(is_in_cone(&facet, &Vector3::new(0.6, 0.0, -0.8)));
    assert!(!is_in_cone(&facet, &-Vector3::x()));
}

#[test]
fn ends_of_level_surfaces_are_found() {
    let n = Vector3::z();
    let z = [0.0, 0.0, 1.0];
    let half = |x: f64, y: f64| surface(&[z, [x, y, 0.0]]);
    let is_end = |surfaces: &[LocalSurface], free: f64| {
        leaves_free(surfaces.iter(), &n, free, &mut Vec::new())
    };
    let (vertex, edge) = (PI + LEVEL, PI - LEVEL);
    // Corner of a face, its side, and its inside.
    let corner = surface(&[z, [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    assert!(is_end(std::slice::from_ref(&corner), vertex));
    assert!(!is_end(&[half(1.0, 0.0)], vertex) && is_end(&[half(1.0, 0.0)], edge));
    assert!(!is_end(&[surface(&[z])], edge));
    // Two halves make a plane, two corners a side.
    assert!(!is_end(&[half(1.0, 0.0), half(-1.0, 0.0)], edge));
    let beside = surface(&[z, [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    assert!(!is_end(&[corner.clone(), beside.clone()], vertex));
    assert!(is_end(&[corner, beside], edge));
    // A tilted edge: its line alone is level.
    let ridge = surface(&[[0.6, 0.0, 0.8], [-0.6, 0.0, 0.8]]);
    assert!(is_end(std::slice::from_ref(&ridge), edge) && !is_end(&[ridge], vertex));
}
