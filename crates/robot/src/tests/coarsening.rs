//! Unit tests of `coarsening.rs`.

use super::*;

/// A box with side lengths `sides` (m) and `n` by `n` squares on each face.
fn cuboid(sides: [f64; 3], n: usize) -> Surface {
    let mut surface = Surface::default();
    for axis in 0..3 {
        for end in [0.0, 1.0] {
            let first = surface.vertices.len();
            for k in 0..(n + 1) * (n + 1) {
                let mut vertex = [0.0; 3];
                vertex[axis] = end * sides[axis];
                for (step, other) in [(k / (n + 1), 1), (k % (n + 1), 2)] {
                    let other = (axis + other) % 3;
                    vertex[other] = step as f64 / n as f64 * sides[other];
                }
                surface.vertices.push(vertex);
            }
            for k in 0..n * n {
                let a = first + k / n * (n + 1) + k % n;
                let (b, c, d) = (a + n + 1, a + n + 2, a + 1);
                let two = [[a, b, c], [a, c, d]];
                let turned = |[a, b, c]: [usize; 3]| if end > 0.0 { [a, b, c] } else { [a, c, b] };
                surface.triangles.extend(two.map(turned));
            }
        }
    }
    surface.total = surface.triangles.len();
    surface
}

fn volume(surface: &Surface) -> f64 {
    let tetrahedron = |triangle: &[usize; 3]| {
        let [a, b, c] = triangle.map(|corner| Vector3::from(surface.vertices[corner]));
        a.cross(&b).dot(&c) / 6.0
    };
    surface.triangles.iter().map(tetrahedron).sum()
}

#[test]
fn a_box_keeps_its_edges_and_a_plate_its_thickness() {
    for sides in [[1.0, 2.0, 0.5], [1.0, 1.0, 0.002]] {
        let whole = cuboid(sides, 40);
        for most in [4000, 800, 200] {
            let coarse = coarsened(whole.clone(), most);
            let count = coarse.triangles.len();
            assert!(count <= most && 2 * count > most, "{count} of {most}");
            assert_eq!(coarse.total, whole.total);
            let part = volume(&coarse) / volume(&whole);
            assert!((part - 1.0).abs() < 0.02, "{sides:?}, {most}: {part} of the volume");
        }
    }
}

#[test]
fn few_triangles_are_left_as_they_are_and_loose_ones_do_not_vanish() {
    let whole = cuboid([1.0; 3], 4);
    assert_eq!(coarsened(whole.clone(), whole.total).triangles, whole.triangles);
    // Small triangles at two places, each inside one cell.
    let mut loose = Surface::default();
    for k in 0..100 {
        let (x, size) = (f64::from(k % 2), 1e-6 * f64::from(k + 1));
        let first = loose.vertices.len();
        loose.vertices.extend([[x, 0.0, 0.0], [x, size, 0.0], [x, 0.0, size]]);
        loose.triangles.push([first, first + 1, first + 2]);
    }
    let coarse = coarsened(loose, 10);
    assert!((1..=10).contains(&coarse.triangles.len()));
}
