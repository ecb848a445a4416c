//! The poses that the page shows, and what happens between them.

use super::data::STATUSES;
use super::encode::{f32s, u8s, u16s};
use crate::pictures::Film;
use crate::pictures::animation::{NEGLIGIBLE, Scale};
use nalgebra::Vector3;
use serde::Serialize;
use tumble::trajectory::TrajectoryRow;

/// More poses than this make a large file and nothing that an eye can see. Bodies with more
/// than eight corners get fewer, since each has a force.
const MOST_FRAMES: usize = 6000;
const FEWEST_FRAMES: usize = 500;

/// Every `every`-th row, and the last.
///
/// Of the steps from a frame's row to that of the next: their mean forces, their largest
/// certificate and their most conspicuous status.
#[derive(Serialize)]
pub struct Frames {
    every: usize,
    count: usize,
    /// What positions are relative to, m.
    origin: [f64; 3],
    /// Of each frame x, y, z (m) and q_w, q_x, q_y, q_z.
    poses: String,
    /// ‖v‖, m/s.
    speeds: String,
    /// m/s.
    certificates: String,
    /// Indices into [`STATUSES`].
    statuses: String,
    /// How many corners of each frame have a force.
    force_counts: String,
    /// Which they are, one frame after the other.
    force_corners: String,
    /// Of each of them f_x, f_y, f_z, N.
    forces: String,
}

impl Frames {
    pub fn of(film: &Film, scale: &Scale) -> Self {
        let rows = &film.rows;
        let corners = film.model.contact_count();
        let most = (MOST_FRAMES * 8 / corners.max(8)).max(FEWEST_FRAMES);
        let every = spacing(rows.len(), most);
        let shown: Vec<usize> = shown(rows.len(), every).collect();
        let spans: Vec<&[TrajectoryRow]> = (0..shown.len())
            .map(|i| &rows[shown[i]..shown.get(i + 1).copied().unwrap_or(rows.len())])
            .collect();
        let origin = rows.first().map_or(Vector3::zeros(), |row| row.state.position);
        let pose = |span: &&[TrajectoryRow]| {
            let state = span[0].state;
            (state.position - origin).iter().chain(state.attitude.iter()).copied().collect()
        };
        let mut counts = Vec::with_capacity(spans.len());
        let (mut touching, mut forces) = (Vec::new(), Vec::new());
        for span in &spans {
            let before = touching.len();
            for (corner, force) in means(span, corners).into_iter().enumerate() {
                if force.norm() > NEGLIGIBLE * scale.weight() {
                    touching.push(corner);
                    forces.extend(force.iter().copied());
                }
            }
            counts.push(touching.len() - before);
        }
        Self {
            every,
            count: spans.len(),
            origin: origin.into(),
            poses: f32s(spans.iter().flat_map::<Vec<f64>, _>(pose)),
            speeds: f32s(spans.iter().map(|span| span[0].state.velocity.norm())),
            certificates: f32s(spans.iter().map(|span| {
                span.iter().map(|row| row.certificate).fold(f64::NEG_INFINITY, f64::max)
            })),
            statuses: u8s(spans.iter().map(|span| most_conspicuous(span))),
            force_counts: u16s(counts.into_iter()),
            force_corners: u16s(touching.into_iter()),
            forces: f32s(forces.into_iter()),
        }
    }
}

/// Every how many-th of `rows` rows is shown so that at most `most` are, and the last.
fn spacing(rows: usize, most: usize) -> usize {
    rows.saturating_sub(1).div_ceil(most - 1).max(1)
}

/// The rows that are shown.
fn shown(rows: usize, every: usize) -> impl Iterator<Item = usize> {
    let last = rows.saturating_sub(1);
    (0..last).step_by(every).chain((rows > 0).then_some(last))
}

/// The mean force on each corner.
fn means(span: &[TrajectoryRow], corners: usize) -> Vec<Vector3<f64>> {
    let mut means = vec![Vector3::zeros(); corners];
    for row in span {
        for (mean, force) in means.iter_mut().zip(row.forces()) {
            *mean += force / span.len() as f64;
        }
    }
    means
}

fn most_conspicuous(span: &[TrajectoryRow]) -> u8 {
    let place = |row: &TrajectoryRow| (0u8..).zip(STATUSES).find(|(_, s)| *s == row.status);
    span.iter().filter_map(place).map(|(place, _)| place).max().unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_even_and_few_and_have_the_last_row() {
        for rows in [1, 2, 5, 6000, 6001, 100_000, 1_000_000] {
            let every = spacing(rows, MOST_FRAMES);
            let shown: Vec<_> = shown(rows, every).collect();
            assert!(shown.len() <= MOST_FRAMES, "{rows}");
            assert!(shown.len() > MOST_FRAMES / 3 || every == 1, "{rows}: {}", shown.len());
            assert_eq!((shown[0], shown[shown.len() - 1]), (0, rows - 1));
            assert!(shown.windows(2).rev().skip(1).all(|pair| pair[1] - pair[0] == every));
        }
        assert_eq!(spacing(6000, MOST_FRAMES), 1);
        assert_eq!(shown(0, 1).count(), 0);
    }
}
