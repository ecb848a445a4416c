//! Boxes and balls at the edges of their support: tiles and tables, both fixed and movable.

use super::{Scene, at, run, solid_box};
use crate::common::prelude::*;

fn fixed_box(half_sides: [f64; 3], centre: [f64; 3]) -> Piece {
    let piece = Piece::cuboid(Vector3::from(half_sides)).unwrap();
    piece.moved_by(&Matrix3::identity(), &Vector3::from(centre)).unwrap()
}

/// Box that slides along x from 0 at 2 m/s with μ = 0.3. Its lower face is at `height` [m].
fn slider(height: f64) -> Vec<(RigidBody, State)> {
    let mut start = at(0.0, 0.0, height + 0.1);
    start.velocity[0] = 2.0;
    vec![(solid_box(1.0, 0.2, 0.15, 0.1), start)]
}

/// Positions of the first body along x in each step, and its largest deviation from its height and
/// line.
fn ways(records: &[StepRecord], height: f64) -> (Vec<f64>, f64) {
    let places = records.iter().map(|record| record.next_states()[0].position);
    let off = places.clone().map(|r| (r[2] - height - 0.1).abs().max(r[1].abs()));
    (places.map(|r| r[0]).collect(), off.fold(0.0, f64::max))
}

/// Checks that a box slides over tiles as over a plane. The tiles are 0.15 m long and lie edge to
/// edge. The box covers three of them and passes about eight edges.
#[test]
fn a_box_slides_over_a_floor_of_tiles_without_a_bump() {
    let (steps, plane) = (400, Scene::new(slider(0.0), 0.3, 0.002));
    let (smooth, _) = ways(&plane.run(steps), 0.0);

    let mut tiled = Scene::new(slider(0.5), 0.3, 0.002);
    tiled.fixed = (0..10)
        .map(|i| fixed_box([0.075, 0.3, 0.05], [-0.2 + 0.15 * f64::from(i), 0.0, 0.45]))
        .collect();
    let (way, off) = ways(&tiled.run(steps), 0.5);
    assert!(smooth[steps - 1] > 0.67 && smooth[steps - 1] < 0.69);
    assert!(off < 1e-9, "{off:e} m");
    for (k, (a, b)) in smooth.iter().zip(&way).enumerate() {
        assert!((a - b).abs() < 1e-8, "step {k}: {:e} m", a - b);
    }
}

/// Checks the same on ten tiles that are bodies of 5 kg. The ground holds each tile with μ = 0.9,
/// which is more than the friction of the box.
#[test]
fn a_box_slides_over_tiles_that_are_bodies() {
    let (steps, plane) = (400, Scene::new(slider(0.0), 0.3, 0.002));
    let (smooth, _) = ways(&plane.run(steps), 0.0);

    let mut bodies = slider(0.1);
    let tiles = (0..10)
        .map(|i| (solid_box(5.0, 0.075, 0.3, 0.05), at(-0.2 + 0.15 * f64::from(i), 0.0, 0.05)));
    bodies.extend(tiles);
    let scene = Scene::new(bodies, 0.3, 0.002);
    let mut world = scene.world();
    for tile in 1..=10 {
        world = world
            .with_coefficient_between(Coefficient::Friction, tile, Partner::Ground, 0.9)
            .unwrap();
    }
    let records = run(&world, &scene.states, steps);
    let (way, off) = ways(&records, 0.1);
    assert!(off < 1e-9, "{off:e} m");
    for (k, (a, b)) in smooth.iter().zip(&way).enumerate() {
        assert!((a - b).abs() < 1e-8, "step {k}: {:e} m", a - b);
    }
    for (start, end) in scene.states.iter().zip(records[steps - 1].next_states()).skip(1) {
        assert!((start.position - end.position).amax() < 1e-9);
    }
}

/// Checks that a face's plane ends at the edge of the face. A ball flies past the edge of a table,
/// a centimetre away from it and below its top. It moves as if there were no table.
#[test]
fn a_ball_past_a_tables_edge_is_not_stopped_by_its_plane() {
    let (ball, _) = RigidBody::solid(0.5, &[Piece::sphere(0.05).unwrap()]).unwrap();
    for (x, speed) in [(1.06, 0.0), (0.95, 2.0), (1.06, -0.02)] {
        let mut start = at(x, 0.0, 1.3);
        start.velocity = Vector3::new(speed, 0.0, -2.0);
        let mut scene = Scene::new(vec![(ball.clone(), start)], 0.5, 0.002);
        let alone = scene.run(200);
        scene.fixed = vec![fixed_box([1.0, 1.0, 0.25], [0.0, 0.0, 0.75])];
        for (a, b) in alone.iter().zip(scene.run(200)) {
            assert_eq!(a.next_states(), b.next_states(), "{x}, step {}", a.index);
        }
    }
}

/// Checks that a box stays if its centre is slightly inside the table's edge, and tips if it is
/// outside. With a lever of 1e-4 m the tilt grows to some hundredths in 1 s.
#[test]
fn a_box_over_a_tables_edge_tips_where_statics_says() {
    for (beyond, tips) in [(-1e-4, false), (-1e-6, false), (1e-4, true), (1e-3, true)] {
        let start = at(1.0 + beyond, 0.0, 1.1);
        let bodies = vec![(solid_box(1.0, 0.2, 0.15, 0.1), start)];
        let mut scene = Scene::new(bodies, 0.8, 0.002);
        scene.fixed = vec![fixed_box([1.0, 1.0, 0.5], [0.0, 0.0, 0.5])];
        let records = scene.run(500);
        let end = &records[499].next_states()[0];
        let tilt = 2.0 * end.attitude[2].abs();
        assert_eq!(tilt > 1e-3, tips, "{beyond}: tilt {tilt:e}");
        assert!(tips || tilt < 1e-9, "{beyond}: tilt {tilt:e}");
    }
}

/// Checks where a box that slides off a table begins to tip. The friction μ m g acts at its lower
/// face, c below the centre. It moves the supporting force forward by μ c. So the box tips from μ c
/// before the edge on, and not earlier.
#[test]
fn a_box_slides_off_a_table_and_tips() {
    let mut start = at(0.7, 0.0, 1.1);
    start.velocity[0] = 1.5;
    let mut scene = Scene::new(vec![(solid_box(1.0, 0.2, 0.15, 0.1), start)], 0.1, 0.001);
    scene.fixed = vec![fixed_box([1.0, 1.0, 0.5], [0.0, 0.0, 0.5])];
    for record in scene.run(400) {
        let (before, after) = (&record.states()[0], &record.next_states()[0]);
        let (place, tilt) = (before.position[0], 2.0 * after.attitude[2]);
        if place < 1.0 - 0.1 * 0.1 {
            assert!(tilt.abs() < 1e-9, "tips at {place}");
            assert!((after.position[2] - 1.1).abs() < 1e-9);
        } else if place > 1.0 - 0.1 * 0.1 + 2.0 * 0.0015 {
            assert!(tilt > 1e-9, "{tilt:e} at {place}");
        }
    }
}
