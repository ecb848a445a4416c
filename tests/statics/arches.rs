//! Arches of stones without mortar.

use super::{GRAVITY, Scene, assert_close, stands};
use nalgebra::Vector3;
use std::f64::consts::PI;
use tumble::Piece;
use tumble::statics::LoadCase;

/// Stone of an arch of mean radius 1 m between two angles from the x axis.
fn stone(thickness: f64, from: f64, to: f64) -> Vec<Vector3<f64>> {
    let mut corners = Vec::new();
    for angle in [from, to] {
        for radius in [1.0 - 0.5 * thickness, 1.0 + 0.5 * thickness] {
            for y in [-0.2, 0.2] {
                corners.push(Vector3::new(radius * angle.cos(), y, radius * angle.sin()));
            }
        }
    }
    corners
}

/// Half circle of stones on the ground.
fn half_circle(count: usize, thickness: f64, friction: f64) -> Scene {
    let mut scene = Scene::new(friction);
    let angle = |k: usize| PI * k as f64 / count as f64;
    for k in 0..count {
        scene.add_hull(1.0, &stone(thickness, angle(k), angle(k + 1)));
    }
    scene
}

#[test]
fn a_half_circle_of_twenty_stones_has_its_critical_thickness() {
    let (mut thin, mut thick) = (0.09, 0.13);
    while thick - thin > 1e-8 {
        let middle = 0.5 * (thin + thick);
        let found = stands(&half_circle(20, middle, 1.0).structure());
        *(if found { &mut thick } else { &mut thin }) = middle;
    }
    assert_close(thick, 0.107348, 5e-6);
}

#[test]
fn a_half_circle_of_twenty_stones_needs_friction() {
    for (thickness, expected) in [(0.15, 0.35127), (0.20, 0.30888)] {
        let structure = half_circle(20, thickness, 1.0).structure();
        assert_close(structure.smallest_friction().factor().unwrap(), expected, 2e-5);
    }
}

/// Oppenheim's arch (1992): 157.5° of seven stones, t/R = 0.15, collapses at a horizontal acceleration of
/// 0.37 g of its base.
#[test]
fn the_arch_of_oppenheim_stands_up_to_its_published_acceleration() {
    let (opening, count) = (157.5_f64.to_radians(), 7);
    let first = 0.5 * (PI - opening);
    let mut scene = Scene::new(1.0);
    scene.has_ground = false;
    let angle = |k: usize| first + opening * k as f64 / count as f64;
    for k in 0..count {
        scene.add_hull(1.0, &stone(0.15, angle(k), angle(k + 1)));
    }
    for [from, to] in [[first - 0.2, first], [PI - first, PI - first + 0.2]] {
        let abutment = stone(0.4, from, to);
        scene.fixed.push(Piece::hull(&abutment, 0.0).unwrap());
    }
    let structure = scene.structure();
    let case = LoadCase::base(&structure, Vector3::x());
    let factor = structure.largest_factor(&case).factor().unwrap();
    assert!((factor / GRAVITY - 0.37).abs() < 0.005, "{}", factor / GRAVITY);
}
