//! Level floors of several pieces, with the top at z = 0.

use crate::common::draw::WideDraw;
use crate::common::prelude::*;
use std::sync::Arc;
use tumble_core::geometry::Terrain;
use tumble_core::geometry::terrain::{HeightField, Surface};

/// Names of the floors of [`floor`].
pub const FLOORS: [&str; 7] =
    ["tiles", "bricks", "plates", "overlapping", "belts", "field", "mesh"];

/// A world with `body` above a level plane.
pub fn world(body: &RigidBody, ground: bool, friction: f64) -> World {
    euler(Parameters {
        ground: ground.then(Plane::level),
        friction,
        ..Parameters::new(vec![body.clone()])
    })
}

/// `world` with this terrain.
pub fn on_terrain(world: World, terrain: impl Into<Terrain>) -> World {
    let terrain = Arc::new(terrain.into());
    world.with_terrains(vec![terrain])
}

/// The height field moved by `shift` (m).
pub fn moved(field: HeightField, shift: &Vector3<f64>) -> Terrain {
    Terrain::from(field.moved_by(&Matrix3::identity(), shift).unwrap())
}

/// A box from `low` to `high` (m).
pub fn block(low: [f64; 3], high: [f64; 3]) -> Piece {
    let (low, high) = (Vector3::from(low), Vector3::from(high));
    let piece = Piece::cuboid((high - low) / 2.0).unwrap();
    piece.moved_by(&Matrix3::identity(), &((low + high) / 2.0)).unwrap()
}

/// A world with `body` above the floor `name`, which covers |x|, |y| ≤ 6.
pub fn floor(name: &str, body: &RigidBody, friction: f64, random: &mut WideDraw) -> World {
    let lines = |random: &mut WideDraw, least: f64, most: f64| {
        let mut lines = vec![-6.0];
        while lines[lines.len() - 1] < 6.0 {
            lines.push(lines[lines.len() - 1] + random.within(least, most));
        }
        lines
    };
    let mut fixed = Vec::new();
    let mut terrain = None;
    let tiles = |lap: f64| {
        let mut tiles = Vec::new();
        for x in -6..6 {
            for y in -6..6 {
                let (x, y) = (f64::from(x), f64::from(y));
                tiles.push(block([x - lap, y - lap, -0.2], [x + 1.0 + lap, y + 1.0 + lap, 0.0]));
            }
        }
        tiles
    };
    match name {
        "tiles" | "belts" => fixed = tiles(0.0),
        "overlapping" => fixed = tiles(0.01),
        "bricks" => {
            // Rows of bricks whose joints are not in line.
            for (low, high) in pairs(&lines(random, 0.2, 0.5)) {
                for (from, to) in pairs(&lines(random, 0.3, 0.9)) {
                    fixed.push(block([from, low, -random.within(0.1, 0.3)], [to, high, 0.0]));
                }
            }
        }
        "plates" => {
            for _ in 0..12 {
                let (x, y) = (random.within(-4.0, 4.0), random.within(-4.0, 4.0));
                let (a, b) = (random.within(0.2, 1.0), random.within(0.2, 1.0));
                fixed.push(block([x - a, y - b, -0.2], [x + a, y + b, 0.0]));
            }
        }
        "field" => {
            let heights = vec![0.0; 49 * 49];
            let field = HeightField::new(heights, 49, [0.25, 0.25]).unwrap();
            let corner = Vector3::new(-6.0, -6.0, 0.0);
            let at = if field.point(0, 0).x < -1.0 { Vector3::zeros() } else { corner };
            terrain = Some(moved(field, &at));
        }
        "mesh" => {
            let count = 33;
            let mut vertices = Vec::new();
            for row in 0..count {
                for column in 0..count {
                    let mut place = |at: i32| {
                        let inside = (1..count - 1).contains(&at);
                        let shift = if inside { random.within(-0.1, 0.1) } else { 0.0 };
                        -6.0 + 12.0 * f64::from(at) / f64::from(count - 1) + shift
                    };
                    vertices.push(Vector3::new(place(column), place(row), 0.0));
                }
            }
            let mut triangles = Vec::new();
            for row in 0..count as u32 - 1 {
                for column in 0..count as u32 - 1 {
                    let at = row * count as u32 + column;
                    let above = at + count as u32;
                    triangles.push([at, at + 1, above + 1]);
                    triangles.push([at, above + 1, above]);
                }
            }
            terrain = Some(Terrain::from(Surface::new(vertices, triangles).unwrap()));
        }
        _ => panic!("no floor is called {name}"),
    }
    let belts = if name == "belts" { fixed.len() } else { 0 };
    let mut world = world(body, name == "plates", friction).with_fixed(fixed);
    if let Some(terrain) = terrain {
        world = on_terrain(world, terrain);
    }
    for index in 0..belts {
        world = world.with_surface(Partner::Fixed(index), Vector3::new(0.7, 0.2, 0.0)).unwrap();
    }
    world
}

/// Neighbours in a list.
fn pairs(lines: &[f64]) -> Vec<(f64, f64)> {
    lines.windows(2).map(|two| (two[0], two[1])).collect()
}
