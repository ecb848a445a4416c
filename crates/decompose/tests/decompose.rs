//! Decompositions of solids whose volume is known.

use nalgebra::{Rotation3, Vector3};
use std::f64::consts::TAU;
use tumble_core::geometry::mesh::Mesh;
use tumble_core::geometry::{MassProperties, Piece};
use tumble_decompose::{DecompositionSettings, Fit, decompose};

/// Prism of height 1 over a simple polygon in the plane z = 0 whose triangles are given,
/// counter-clockwise.
fn prism(polygon: &[[f64; 2]], caps: &[[usize; 3]]) -> Mesh {
    let count = polygon.len();
    let at = |z: f64| polygon.iter().map(move |&[x, y]| Vector3::new(x, y, z));
    let mut triangles = Vec::new();
    for &[a, b, c] in caps {
        triangles.extend([[a, c, b], [a + count, b + count, c + count]]);
    }
    for side in 0..count {
        let next = (side + 1) % count;
        triangles.extend([[side, next, next + count], [side, next + count, side + count]]);
    }
    Mesh::new(at(0.0).chain(at(1.0)).collect(), triangles).unwrap()
}

/// An L of three unit squares, 1 m high: volume 3 m³.
fn angle() -> Mesh {
    let polygon = [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]];
    prism(&polygon, &[[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]])
}

/// Torus about z with 48 × 24 vertices.
fn torus(radius: f64, tube: f64) -> Mesh {
    let (around, across) = (48, 24);
    let mut vertices = Vec::new();
    let mut triangles = Vec::new();
    let index = |i: usize, j: usize| i % around * across + j % across;
    for i in 0..around {
        for j in 0..across {
            let (a, b) = (TAU * i as f64 / around as f64, TAU * j as f64 / across as f64);
            let reach = radius + tube * b.cos();
            vertices.push(Vector3::new(reach * a.cos(), reach * a.sin(), tube * b.sin()));
            let [p, q] = [index(i, j), index(i + 1, j)];
            let [r, s] = [index(i + 1, j + 1), index(i, j + 1)];
            triangles.extend([[p, q, r], [p, r, s]]);
        }
    }
    Mesh::new(vertices, triangles).unwrap()
}

/// Box between two corners.
fn block(low: [f64; 3], high: [f64; 3]) -> Mesh {
    let mut vertices = Vec::new();
    for corner in 0..8 {
        let along = |axis: usize| if corner >> axis & 1 == 1 { high[axis] } else { low[axis] };
        vertices.push(Vector3::new(along(0), along(1), along(2)));
    }
    let quads =
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    Mesh::new(vertices, triangles).unwrap()
}

/// One mesh of several; `turned` reverses the triangles of the second.
fn joined(one: &Mesh, other: &Mesh, turned: bool) -> Result<Mesh, tumble_core::error::Error> {
    let vertices = [one.vertices(), other.vertices()].concat();
    let first = one.vertices().len();
    let moved = other.triangles().iter().map(|three| three.map(|index| index + first));
    let moved = moved.map(|[a, b, c]| if turned { [a, c, b] } else { [a, b, c] });
    Mesh::new(vertices, one.triangles().iter().copied().chain(moved).collect())
}

fn settings(pieces: u32) -> DecompositionSettings {
    let mut settings = DecompositionSettings::default();
    settings.pieces = pieces;
    settings
}

fn is_in(pieces: &[Piece], point: &Vector3<f64>, tolerance: f64) -> bool {
    pieces.iter().any(|piece| {
        let faces = piece.core().faces();
        faces.iter().all(|face| face.normal.dot(point) - face.offset <= tolerance)
    })
}

#[test]
fn an_angle_becomes_a_few_boxes() {
    let pieces = decompose(&angle(), &settings(16)).unwrap();
    assert_eq!(pieces.len(), 2);
    let fit = Fit::new(&pieces, &angle()).unwrap();
    assert!((fit.volume_ratio - 1.0).abs() <= 1e-12 && fit.outside <= 1e-12, "{fit:?}");
}

/// A box with a thin floor and thin walls, at an angle and in single precision, as in a file.
#[test]
fn a_tub_is_cut_along_its_faces() {
    let turn = Rotation3::from_euler_angles(0.3, -0.7, 1.1);
    for (turn, allowed) in [(Rotation3::identity(), 1e-12), (turn, 1e-6)] {
        let corner = |x: f64, y: f64, z: f64| {
            let place = turn * Vector3::new(x, y, z);
            if allowed < 1e-9 { place } else { place.map(|x| f64::from(x as f32)) }
        };
        let ring = |half: [f64; 2], z: f64| {
            [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]
                .map(|[x, y]| corner(x * half[0], y * half[1], z))
        };
        let (outer, inner) = ([0.4, 0.3], [0.39, 0.29]);
        let rings = [ring(outer, 0.0), ring(outer, 0.2), ring(inner, 0.2), ring(inner, 0.01)];
        let mut triangles = vec![[0, 2, 1], [0, 3, 2], [12, 13, 14], [12, 14, 15]];
        for first in [0, 4, 8] {
            for k in 0..4 {
                let [a, b] = [first + k, first + (k + 1) % 4];
                triangles.extend([[a, b, b + 4], [a, b + 4, a + 4]]);
            }
        }
        let tub = Mesh::new(rings.concat(), triangles).unwrap();
        let pieces = decompose(&tub, &settings(16)).unwrap();
        assert_eq!(pieces.len(), 5);
        let fit = Fit::new(&pieces, &tub).unwrap();
        assert!((fit.volume_ratio - 1.0).abs() <= allowed, "{fit:?}");
        assert!(fit.outside <= allowed, "{fit:?}");
        // Nothing is above the floor.
        assert!(!is_in(&pieces, &(turn * Vector3::new(0.1, 0.1, 0.01 + 1e-5)), 0.0));
        assert!(is_in(&pieces, &(turn * Vector3::new(0.1, 0.1, 0.01 - 1e-5)), 0.0));
    }
}

/// A wall is in the pieces, or is refused: hulls have a least thickness.
#[test]
fn thin_walls_are_covered_or_refused() {
    let caps = [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]];
    for wall in [1e-3, 1e-4, 3e-5, 1e-5, 5e-6, 2e-6, 1e-6] {
        let corners = [[0.0, 0.0], [2.0, 0.0], [2.0, wall], [wall, wall], [wall, 2.0], [0.0, 2.0]];
        let mesh = prism(&corners, &caps);
        match decompose(&mesh, &settings(16)) {
            Ok(pieces) => {
                let covered = |vertex| is_in(&pieces, vertex, 1e-9);
                assert!(wall > 2e-5 && mesh.vertices().iter().all(covered), "{wall}");
            }
            Err(error) => assert!(wall < 2e-5 && error.to_string().contains("flat"), "{error}"),
        }
    }
}

#[test]
fn a_torus_keeps_its_hole_and_its_volume() {
    let mesh = torus(1.0, 0.3);
    for count in [8, 16, 32] {
        let pieces = decompose(&mesh, &settings(count)).unwrap();
        assert!((8..=count as usize).contains(&pieces.len()), "{}", pieces.len());
        let fit = Fit::new(&pieces, &mesh).unwrap();
        // The hull of an arc of the inner circle, of angle a and radius 0.7, reaches
        // 0.7 (1 − cos(a/2)) into the hole. No arc is longer than twice the mean.
        let sagitta = 0.7 * (1.0 - (TAU / pieces.len() as f64).cos());
        assert!(fit.outside < sagitta, "{count}: {fit:?}");
        assert!(fit.volume_ratio > 0.98 && fit.volume_ratio < 1.07, "{count}: {fit:?}");
        // A ball of this radius fits through.
        assert!(!is_in(&pieces, &Vector3::zeros(), 0.45));
    }
}

#[test]
fn pieces_reach_the_mesh_and_have_a_bounded_number_of_vertices() {
    for mesh in [angle(), torus(1.0, 0.3), torus(1.0, 0.1)] {
        let pieces = decompose(&mesh, &settings(32)).unwrap();
        let corners = pieces.iter().map(|piece| piece.core().vertices().len());
        assert!(corners.sum::<usize>() <= 1000);
        // Hulls with 31 to 64 vertices do not reach all others: 1/50 of the radius of the torus.
        for vertex in mesh.vertices() {
            assert!(is_in(&pieces, vertex, 0.02), "{vertex}");
        }
    }
}

#[test]
fn equal_meshes_give_equal_pieces() {
    for mesh in [angle(), torus(1.0, 0.3)] {
        let bits = |pieces: &[Piece]| {
            let corners = pieces.iter().flat_map(|piece| piece.core().vertices().to_vec());
            corners.flat_map(|corner| <[f64; 3]>::from(corner).map(f64::to_bits)).collect()
        };
        let [one, two]: [Vec<u64>; 2] =
            std::array::from_fn(|_| bits(&decompose(&mesh, &settings(12)).unwrap()));
        assert_eq!(one, two);
    }
}

#[test]
fn moments_of_a_mesh_are_exact() {
    let solid = MassProperties::from_mesh(&angle());
    let boxes = [block([0.0; 3], [2.0, 1.0, 1.0]), block([0.0, 1.0, 0.0], [1.0, 2.0, 1.0])];
    let pieces = boxes.map(|mesh| Piece::mesh(&mesh, 0.0).unwrap());
    let sum = MassProperties::from_pieces(&pieces).unwrap();
    assert!((solid.volume - 3.0).abs() < 1e-14);
    assert!((solid.centre - sum.centre).amax() < 1e-14);
    assert!((solid.inertia - sum.inertia).amax() < 1e-14);
}

#[test]
fn a_closed_cavity_stays_empty() {
    let shell = joined(&block([0.0; 3], [1.0; 3]), &block([0.2; 3], [0.8; 3]), true).unwrap();
    let pieces = decompose(&shell, &settings(16)).unwrap();
    assert!(!is_in(&pieces, &Vector3::repeat(0.5), 0.0));
    assert!((MassProperties::from_mesh(&shell).volume - (1.0 - 0.6_f64.powi(3))).abs() < 1e-12);
}

#[test]
fn a_convex_mesh_stays_one_piece() {
    let pieces = decompose(&block([0.0; 3], [1.0, 2.0, 3.0]), &settings(16)).unwrap();
    assert_eq!(pieces.len(), 1);
    assert!((MassProperties::from_piece(&pieces[0]).volume - 6.0).abs() < 1e-12);
}

#[test]
fn meshes_that_intersect_themselves_are_refused() {
    let (one, other) = (block([0.0; 3], [1.0; 3]), block([0.5; 3], [1.5; 3]));
    let why = decompose(&joined(&one, &other, false).unwrap(), &settings(4)).unwrap_err();
    let why = why.to_string();
    assert!(why.starts_with("the mesh intersects itself: an edge of facet "), "{why}");
    assert!(why.contains("repair"), "{why}");
}

#[test]
fn separate_surfaces_are_solids_or_cavities() {
    let (large, small) = (block([0.0; 3], [1.0; 3]), block([0.2; 3], [0.8; 3]));
    let apart = block([2.0; 3], [2.5; 3]);
    let pieces = decompose(&joined(&large, &apart, false).unwrap(), &settings(4)).unwrap();
    assert_eq!(pieces.len(), 2);
    // Solids that share a part of a face: an edge of one runs through the rim of the other.
    let beside = block([1.0, 0.2, 0.2], [1.5, 0.8, 0.8]);
    assert!(decompose(&joined(&large, &beside, false).unwrap(), &settings(4)).is_err());
    let cases = [
        (joined(&large, &small, false), "inside a solid"),
        (joined(&large, &apart, true), "inside-out and not a cavity"),
    ];
    for (mesh, words) in cases {
        let why = decompose(&mesh.unwrap(), &settings(4)).unwrap_err().to_string();
        assert!(why.contains(words) && why.contains("turn its facets"), "{why}");
    }
}

#[test]
fn settings_out_of_range_are_refused() {
    let mut absurd = [settings(0), settings(33), settings(4), settings(4), settings(4)];
    absurd[2].resolution = 15;
    absurd[3].resolution = u32::MAX;
    absurd[4].concavity = f64::NAN;
    let fields = ["pieces", "pieces", "resolution", "resolution", "concavity"];
    for (settings, field) in absurd.iter().zip(fields) {
        let why = decompose(&angle(), settings).unwrap_err().to_string();
        assert!(why.contains(field) && why.contains("allowed"), "{why}");
    }
}

#[test]
fn every_resolution_and_attitude_has_pieces() {
    let meshes = [angle(), torus(1.0, 0.45), torus(1.0, 0.1)];
    for (number, mesh) in meshes.iter().enumerate() {
        for turn in 0..6 {
            let axis = Vector3::new(0.3, 0.5 + turn as f64, 0.7);
            let turned = Rotation3::new(axis * (0.1 * turn as f64));
            let vertices = mesh.vertices().iter().map(|vertex| turned * vertex).collect();
            let mesh = Mesh::new(vertices, mesh.triangles().to_vec()).unwrap();
            let mut settings = settings(8);
            settings.resolution = 32 + 5 * turn;
            let pieces = decompose(&mesh, &settings).unwrap();
            let fit = Fit::new(&pieces, &mesh).unwrap();
            assert!((0.95..1.6).contains(&fit.volume_ratio), "{number} {turn}: {fit:?}");
        }
    }
}

/// A wheel of 24 teeth whose flanks are curved outwards, triangulated as fans of the teeth and of the
/// middle: more faces than the cuts along planes allow.
#[test]
fn a_prism_is_cut_exactly() {
    const TEETH: usize = 24;
    const FLANK: usize = 5;
    let polar = |radius: f64, turn: f64| [radius * turn.cos(), radius * turn.sin()];
    let mut polygon = Vec::new();
    for tooth in 0..TEETH {
        for point in 0..2 * FLANK {
            let across = point as f64 / (2 * FLANK - 1) as f64;
            let height = 0.2 * (1.0 - (2.0 * across - 1.0).powi(2));
            let turn = TAU * (tooth as f64 + 0.7 * across) / TEETH as f64;
            polygon.push(polar(1.0 + height, turn));
        }
    }
    let count = polygon.len();
    let mut caps = Vec::new();
    let root = |tooth: usize, end: usize| (tooth % TEETH) * 2 * FLANK + end * (2 * FLANK - 1);
    for tooth in 0..TEETH {
        let first = root(tooth, 0);
        caps.extend((1..2 * FLANK - 1).map(|k| [first, first + k, first + k + 1]));
    }
    let inner: Vec<_> = (0..TEETH).flat_map(|tooth| [root(tooth, 0), root(tooth, 1)]).collect();
    caps.extend((1..inner.len() - 1).map(|k| [inner[0], inner[k], inner[k + 1]]));
    let turn = Rotation3::from_euler_angles(0.3, -0.7, 1.1);
    let flat = prism(&polygon, &caps);
    let vertices = flat.vertices().iter().map(|vertex| turn * vertex).collect();
    let mesh = Mesh::new(vertices, flat.triangles().to_vec()).unwrap();
    let pieces = decompose(&mesh, &DecompositionSettings::default()).unwrap();
    // 24 teeth, and a middle of 48 corners.
    assert!((25..=27).contains(&pieces.len()), "{} pieces of {count} corners", pieces.len());
    let fit = Fit::new(&pieces, &mesh).unwrap();
    assert!((fit.volume_ratio - 1.0).abs() < 1e-12 && fit.outside < 1e-9, "{fit:?}");
    // Too many teeth for the pieces: the approximation is used.
    let mut few = settings(16);
    few.pieces = 20;
    assert!(decompose(&mesh, &few).unwrap().len() <= 20);
}
