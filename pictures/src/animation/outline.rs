//! What of a body is seen: the faces of a box, the outline of points.

use super::canvas::Pixel;
use nalgebra::Vector3;

/// Corners of the six faces of a box, in order around each; corner x + 2 y + 4 z.
const FACES: [[usize; 4]; 6] =
    [[0, 2, 6, 4], [1, 3, 7, 5], [0, 1, 5, 4], [2, 3, 7, 6], [0, 1, 3, 2], [4, 5, 7, 6]];

/// A face that the camera sees.
pub struct Face {
    pub corners: [Vector3<f64>; 4],
    /// Outward, of length 1.
    pub normal: Vector3<f64>,
}

/// The faces of a box that are seen from `eye`. They do not hide each other: a box is convex.
pub fn seen_faces<'a>(
    corners: &'a [Vector3<f64>],
    eye: &'a Vector3<f64>,
) -> impl Iterator<Item = Face> + 'a {
    let middle = corners.iter().sum::<Vector3<f64>>() / corners.len() as f64;
    FACES.iter().filter_map(move |face| {
        let corners = face.map(|i| corners[i]);
        let across = (corners[1] - corners[0]).cross(&(corners[3] - corners[0]));
        let normal = across.try_normalize(0.0)?;
        let outward = normal.dot(&(corners[0] - middle));
        let normal = if outward < 0.0 { -normal } else { normal };
        (normal.dot(&(eye - corners[0])) > 0.0).then_some(Face { corners, normal })
    })
}

/// The convex hull of points in the picture, in order around it.
pub fn hull(points: &[Pixel]) -> Vec<Pixel> {
    let mut sorted: Vec<Pixel> = points.to_vec();
    sorted.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    let mut hull: Vec<Pixel> = Vec::new();
    // The lower chain from left to right, then the upper one back.
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
        // The next chain begins with it.
        hull.pop();
    }
    hull
}

fn turns_left(a: Pixel, b: Pixel, c: Pixel) -> bool {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]) > 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn corners(edges: [Vector3<f64>; 3]) -> Vec<Vector3<f64>> {
        (0..8).map(|i| (0..3).map(|k| edges[k] * f64::from(i >> k & 1)).sum()).collect()
    }

    #[test]
    fn three_faces_are_seen_from_a_corner_and_one_from_above() {
        let points = corners([Vector3::x(), Vector3::y(), Vector3::z()]);
        assert_eq!(seen_faces(&points, &Vector3::new(3.0, 4.0, 5.0)).count(), 3);
        let above: Vec<_> = seen_faces(&points, &Vector3::new(0.5, 0.5, 9.0)).collect();
        assert_eq!(above.len(), 1);
        assert_eq!(above[0].normal, Vector3::z());
    }

    #[test]
    fn the_hull_leaves_out_what_is_inside() {
        let square = [[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]];
        let mut points = square.to_vec();
        points.extend([[1.0, 1.0], [2.0, 0.0], [4.0, 4.0]]);
        assert_eq!(hull(&points), square);
        assert!(hull(&[[1.0, 1.0]; 3]).iter().all(|&point| point == [1.0, 1.0]));
    }
}
