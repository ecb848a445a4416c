//! Unit tests of `hidden_parts.rs`: tiles and height fields, whose edges and vertices are known.

use super::*;
use crate::geometry::terrain::HeightField;
use crate::mechanics::{RigidBody, Rotation};
use crate::world::Parameters;
use nalgebra::Matrix3;
use std::sync::Arc;

fn world() -> World {
    World::new(Parameters {
        bodies: vec![RigidBody::solid_box(1.0, Vector3::repeat(0.3)).unwrap()],
        ground: None,
        gravity: Vector3::z() * -9.81,
        friction: 0.5,
        time_step: 2e-3,
        rotation: Rotation::Momentum,
    })
    .unwrap()
}

/// Heights z of the hidden vertices of the fixed piece `number` and of its hidden edges, without those that
/// are upright (m).
fn hidden(world: &World, number: usize) -> (Vec<f64>, Vec<f64>) {
    let parts = hidden_parts(world, &Colliders::new(world), number);
    let mut found = (Vec::new(), Vec::new());
    let mut known = Vec::new();
    for part in parts.iter().filter(|part| part.ends[0].z == part.ends[1].z) {
        if !known.contains(&part.part) {
            known.push(part.part);
            match part.part {
                CorePart::Vertex(_) => found.0.push(part.ends[0].z),
                _ => found.1.push(part.ends[0].z),
            }
        }
    }
    found
}

/// Tiles of 0.2 × 0.2 × 0.1 m in a square of 3 × 3. The last but one is higher by `step` (m).
fn tiles(step: f64) -> World {
    let tile = |place: usize| {
        let (x, y) = ((place % 3) as f64, (place / 3) as f64);
        let shift = Vector3::new(0.2 * x, 0.2 * y, if place == 7 { step } else { 0.0 });
        let piece = Piece::cuboid(Vector3::new(0.1, 0.1, 0.05)).unwrap();
        piece.moved_by(&Matrix3::identity(), &shift).unwrap()
    };
    world().with_fixed((0..9).map(tile).collect())
}

/// The tile in the middle has only flush edges and corners at its top and bottom. The tile at a corner has two
/// neighbours.
#[test]
fn flush_tiles_hide_the_edges_and_corners_between_them() {
    // Number 0 is the body.
    let (vertices, edges) = hidden(&tiles(0.0), 5);
    assert_eq!(vertices.len(), 8, "{vertices:?}");
    assert_eq!(edges.len(), 8, "{edges:?}");
    let (vertices, edges) = hidden(&tiles(0.0), 1);
    assert_eq!((vertices.len(), edges.len()), (2, 4), "{vertices:?} {edges:?}");
}

/// A step of a fifth of a millimetre is real. The tile beside it keeps that edge, and its corners there.
#[test]
fn a_step_between_tiles_hides_nothing() {
    let (vertices, edges) = hidden(&tiles(2e-4), 5);
    let upper = |z: &f64| *z > 0.0;
    assert_eq!(edges.iter().filter(|z| upper(z)).count(), 3, "{edges:?}");
    assert_eq!(vertices.iter().filter(|z| upper(z)).count(), 2, "{vertices:?}");
}

/// A height field of 5 × 5 with spacing 0.1 m, flat but for the last column, whose height is given (m).
fn field(last: f64) -> World {
    let heights = (0..25).map(|place| if place % 5 == 4 { last } else { 0.0 }).collect();
    let field = HeightField::new(heights, 5, [0.1, 0.1]).unwrap();
    let terrain = Arc::new(field.into());
    world().with_terrains(vec![terrain])
}

/// A triangle inside a flat field has no edge and no vertex of its own. One at a ridge keeps the edge, and
/// one at the border too.
#[test]
fn a_flat_field_hides_its_inner_edges_and_vertices() {
    // Triangle 2 k of the square in row 1 and column 1, k = 5. Number 0 is the body.
    let (vertices, edges) = hidden(&field(0.0), 1 + 10);
    assert_eq!((vertices.len(), edges.len()), (3, 3), "{vertices:?} {edges:?}");
    // The upright side of the square in column 2 is at the ridge.
    let (vertices, edges) = hidden(&field(0.05), 1 + 12);
    assert_eq!(edges.len(), 2, "{edges:?}");
    assert_eq!(vertices.len(), 1, "{vertices:?}");
    // The lower side of the square in row 0 is at the border.
    let (_, edges) = hidden(&field(0.0), 1 + 2);
    assert_eq!(edges.len(), 2, "{edges:?}");
}

/// A part hides contacts from outside at its place, for bodies that are large against the gap between
/// the pieces.
#[test]
fn a_hidden_edge_hides_points_on_it_alone() {
    let world = tiles(0.0);
    let parts = hidden_parts(&world, &Colliders::new(&world), 5);
    let edge = |part: &&HiddenPart| matches!(part.part, CorePart::Edge(_)) && part.ends[0].z > 0.0;
    let part = parts.iter().find(edge).unwrap();
    let hides = |share: f64, normal: Vector3<f64>, within: f64| {
        let [from, to] = part.ends;
        part.hides(part.part, &(from + (to - from) * share), &normal, within)
    };
    assert!(hides(0.5, Vector3::z(), 1e-7) && hides(0.01, Vector3::z(), 1e-7));
    assert!(!hides(1.01, Vector3::z(), 1e-7) && !hides(-0.01, Vector3::z(), 1e-7));
    assert!(!hides(0.5, -Vector3::z(), 1e-7) && !hides(0.5, Vector3::z(), 1e-13));
    assert!(!part.hides(CorePart::Vertex(0), &part.ends[0], &Vector3::z(), 1e-7));
}
