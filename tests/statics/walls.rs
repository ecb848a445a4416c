//! A wall of a thousand blocks.

use super::{GRAVITY, Scene, assert_close};
use nalgebra::Vector3;
use tumble::Partner;
use tumble::statics::{LoadCase, Verdict};

/// Wall in running bond: `rows` of blocks of 0.4 × 0.2 × 0.2 m, half blocks at the ends.
fn wall(rows: usize, columns: usize) -> Scene {
    let mut scene = Scene::new(0.6);
    for row in 0..rows {
        let z = 0.1 + 0.2 * row as f64;
        let mut x = 0.0;
        for column in 0..columns + row % 2 {
            let is_half = row % 2 == 1 && (column == 0 || column == columns);
            let half = if is_half { 0.1 } else { 0.2 };
            scene.add_box(40.0 * half, [half, 0.1, 0.1], [x + half, 0.0, z]);
            x += 2.0 * half;
        }
    }
    scene
}

#[test]
fn a_wall_tips_as_one_block_out_of_its_plane() {
    let structure = wall(5, 4).structure();
    let case = LoadCase::base(&structure, Vector3::y());
    // Its height is 1 m, its thickness 0.2 m.
    assert_close(structure.largest_factor(&case).factor().unwrap(), 0.2 * GRAVITY, 1e-6);
}

/// The document measures its time.
#[test]
fn a_wall_of_a_thousand_blocks_stands() {
    let scene = wall(25, 40);
    assert!(scene.bodies.len() > 1000);
    let structure = scene.structure();
    let Verdict::Equilibrium(forces) = structure.verdict() else { panic!("no force state") };
    let ground = structure.contacts().iter().zip(&forces.contacts);
    let on_ground = ground.filter(|(contact, _)| contact.key.partner == Partner::Ground);
    let carried: f64 = on_ground.map(|(_, load)| load.force.z).sum();
    let weight: f64 = scene.bodies.iter().map(|body| body.mass() * GRAVITY).sum();
    assert_close(carried, weight, 1e-9);
}
