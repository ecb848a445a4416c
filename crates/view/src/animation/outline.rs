//! Outlines in the picture.

use super::camera::Spot;

/// Convex hull of points in the picture, in order.
pub fn hull(points: &[Spot]) -> Vec<Spot> {
    let mut sorted: Vec<Spot> = points.to_vec();
    sorted.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    let mut hull: Vec<Spot> = Vec::new();
    // The lower chain from left to right, then the upper chain back.
    for chain in [sorted.clone(), sorted.into_iter().rev().collect()] {
        let start = hull.len();
        for point in chain {
            while hull.len() >= start + 2
                && !turns_left(hull[hull.len() - 2], hull[hull.len() - 1], point)
            {
                hull.pop();
            }
            hull.push(point);
        }
        // The next chain starts with this point.
        hull.pop();
    }
    hull
}

fn turns_left(a: Spot, b: Spot, c: Spot) -> bool {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]) > 0.0
}

#[cfg(test)]
#[path = "tests/outline.rs"]
mod tests;
