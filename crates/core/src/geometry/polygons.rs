//! Polygons of a triangulated convex surface.

use super::triangles::Triangle;
use crate::error::Error;
use nalgebra::Vector3;

/// Error of a hull that rounding leaves without closed polygons.
pub(super) fn unresolved() -> Error {
    let why = "has features too small for its size; remove points that are almost equal".into();
    Error::Shape { shape: "the hull", why }
}

/// Merges triangles into polygons.
///
/// Starting from the largest triangle, each polygon takes all connected triangles whose corners are
/// within `tolerance` (m) of its plane. Corners with fewer than three polygons around them lie on a
/// face or an edge and are removed.
pub(super) fn polygons(
    points: &[Vector3<f64>],
    triangles: &[Triangle],
    tolerance: f64,
) -> Result<Vec<Vec<usize>>, Error> {
    const NONE: usize = usize::MAX;
    let sides = |[a, b, c]: Triangle| [(a, b), (b, c), (c, a)];
    // Triangle at each directed side; the neighbour has the opposite side.
    let mut owners: Vec<((usize, usize), usize)> = (triangles.iter().enumerate())
        .flat_map(|(index, &triangle)| sides(triangle).map(|side| (side, index)))
        .collect();
    owners.sort_unstable();
    let neighbour = |(u, v): (usize, usize)| {
        let found = owners.binary_search_by_key(&(v, u), |owner| owner.0);
        found.map_or(NONE, |at| owners[at].1)
    };
    let area = |[a, b, c]: Triangle| (points[b] - points[a]).cross(&(points[c] - points[a])) / 2.0;
    let areas: Vec<f64> = triangles.iter().map(|&t| area(t).norm()).collect();
    let mut seeds: Vec<usize> = (0..triangles.len()).collect();
    seeds.sort_by(|&a, &b| areas[b].total_cmp(&areas[a]));

    let mut group = vec![NONE; triangles.len()];
    let mut groups = 0;
    for seed in seeds {
        if group[seed] != NONE {
            continue;
        }
        let normal = area(triangles[seed]).normalize();
        let origin = points[triangles[seed][0]];
        let is_flat =
            |t: Triangle| t.iter().all(|&p| normal.dot(&(points[p] - origin)).abs() <= tolerance);
        let mut waiting = vec![seed];
        while let Some(index) = waiting.pop() {
            if group[index] != NONE {
                continue;
            }
            group[index] = groups;
            let next = sides(triangles[index]).map(neighbour);
            waiting.extend(
                next.into_iter()
                    .filter(|&n| n != NONE && group[n] == NONE && is_flat(triangles[n])),
            );
        }
        groups += 1;
    }

    // Boundary sides of every polygon, and the polygons around every point.
    let mut rims = vec![Vec::new(); groups];
    let mut around = vec![Vec::new(); points.len()];
    for &((u, v), owner) in &owners {
        let other = neighbour((u, v));
        if other == NONE {
            return Err(unresolved());
        }
        if group[owner] != group[other] {
            rims[group[owner]].push((u, v));
            around[u].push(group[owner]);
        }
    }
    // The sides of each rim are joined to one closed loop.
    let is_vertex: Vec<bool> = around.iter().map(|polygons| polygons.len() >= 3).collect();
    let mut loops = Vec::with_capacity(groups);
    for rim in &rims {
        // `owners` is sorted and so is the rim: it starts at its smallest point.
        let &(start, mut at) = rim.first().ok_or_else(unresolved)?;
        let mut polygon = vec![start];
        while at != start && polygon.len() < rim.len() {
            polygon.push(at);
            let next = rim.binary_search_by_key(&at, |side| side.0).map_err(|_| unresolved())?;
            at = rim[next].1;
        }
        if at != start || polygon.len() != rim.len() {
            return Err(unresolved());
        }
        polygon.retain(|&point| is_vertex[point]);
        if polygon.len() < 3 {
            return Err(unresolved());
        }
        loops.push(polygon);
    }
    Ok(loops)
}
