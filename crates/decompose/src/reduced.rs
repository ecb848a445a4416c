//! Convex hulls with a limit on their vertices.

use nalgebra::Vector3;
use tumble_core::error::Error;
use tumble_core::geometry::Piece;
use tumble_core::geometry::hull::Face;

/// Minimum number of vertices of a reduced hull: the extreme points in 26 directions, and one more.
pub const LEAST_CORNERS: usize = 27;
/// Distance of points outside a reduced hull's planes, relative to its extent, at which growth
/// stops.
const OUTSIDE: f64 = 1e-3;

/// Hull of at most `most` of the points, and largest distance of the others outside its planes (m).
///
/// # Errors
/// Points without a volume.
pub fn reduced(points: &[Vector3<f64>], most: usize) -> Result<(Piece, f64), Error> {
    grown(points, most, OUTSIDE, 0.0)
}

/// Grows a hull of at most `most` of the points. Returns it with the largest distance of the other
/// points outside its planes (m).
///
/// Growth starts from the extreme points in the 26 directions of a cube's faces, edges and corners.
/// Each round adds the farthest point outside each face. It stops when that distance falls to
/// `allowed` times the extent, or when a round adds less than the fraction `growth` of the points.
///
/// # Errors
/// Points without a volume.
pub fn grown(
    points: &[Vector3<f64>],
    most: usize,
    allowed: f64,
    growth: f64,
) -> Result<(Piece, f64), Error> {
    let mut chosen: Vec<Vector3<f64>> = Vec::new();
    for number in 0..27 {
        let digit = |place: i32| f64::from(number / place % 3 - 1);
        let direction = Vector3::new(digit(1), digit(3), digit(9));
        let farthest = points.iter().max_by(|a, b| a.dot(&direction).total_cmp(&b.dot(&direction)));
        chosen.extend(farthest.filter(|farthest| !chosen.contains(farthest)));
    }
    let mut left: Vec<_> = points.to_vec();
    loop {
        let piece = Piece::hull(&chosen, 0.0)?;
        let faces = piece.core().faces();
        let mut farthest = vec![(0.0, None); faces.len()];
        left.retain(|point| {
            let above = |face: &Face| face.normal.dot(point) - face.offset;
            let heights = faces.iter().map(above).enumerate();
            let Some((face, height)) = heights.max_by(|a, b| a.1.total_cmp(&b.1)) else {
                return false;
            };
            if height > farthest[face].0 {
                farthest[face] = (height, Some(*point));
            }
            height > 0.0
        });
        let outside = farthest.iter().fold(0.0_f64, |most, (height, _)| most.max(*height));
        let allowed = allowed * 2.0 * piece.core().reach();
        if outside <= allowed || chosen.len() >= most {
            return Ok((piece, outside));
        }
        farthest.retain(|(height, _)| *height > allowed);
        farthest.sort_by(|a, b| b.0.total_cmp(&a.0));
        if (farthest.len() as f64) < growth * chosen.len() as f64 {
            return Ok((piece, outside));
        }
        let room = most - chosen.len();
        chosen.extend(farthest.iter().take(room).filter_map(|(_, point)| *point));
    }
}
