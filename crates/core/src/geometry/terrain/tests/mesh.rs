//! Unit tests of `mesh.rs`.

use super::*;

/// Every facet of a level grid has corners of its own, up to 1.3·10⁻⁷ beside those of the others.
#[test]
fn facets_with_rounded_corners_are_one_surface() {
    const CELLS: usize = 60;
    let mut facets = Vec::new();
    for (i, j) in (0..CELLS * CELLS).map(|cell| (cell / CELLS, cell % CELLS)) {
        let corner = |x: usize, y: usize| {
            let off = 1e-7 * ((facets.len() + 3 * x + y) % 5) as f64 / 4.0;
            Vector3::new(x as f64 / CELLS as f64 + off, y as f64 / CELLS as f64 - off, 0.0)
        };
        let [a, b, c, d] = [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)];
        facets.extend([[a, b, c], [a, c, d]]);
    }
    let surface = Surface::from_facets(&facets).unwrap();
    assert!(surface.joined() > 0);
    let used: std::collections::BTreeSet<_> = surface.triangles().iter().flatten().collect();
    assert_eq!(used.len(), (CELLS + 1) * (CELLS + 1));
    assert_eq!(surface.border_vertices().len(), 4 * CELLS);
}
