//! The poses that the page shows, and what happens between them.

use super::encode::{f32s, u8s, u16s};
use crate::film::{Film, Frame};
use crate::forces::Scale;
use nalgebra::Vector3;
use serde::Serialize;

/// More poses than this make a large file and nothing that an eye can see. Bodies with more
/// than eight corners get fewer, since each has a force.
const MOST_FRAMES: usize = 6000;
const FEWEST_FRAMES: usize = 500;

/// Every `every`-th frame, and the last.
///
/// Of the steps from one of them to the next: their mean forces, their largest residual and
/// their most conspicuous status.
#[derive(Serialize)]
pub struct Poses {
    every: usize,
    count: usize,
    /// What positions are relative to, m.
    origin: [f64; 3],
    /// Of each x, y, z (m) and q_w, q_x, q_y, q_z.
    poses: String,
    /// ‖v‖, m/s.
    speeds: String,
    /// m/s.
    residuals: String,
    /// Places in [`Status::ALL`](crate::Status::ALL).
    statuses: String,
    /// How many corners of each have a force.
    force_counts: String,
    /// Which they are, one after the other.
    force_corners: String,
    /// Of each of them f_x, f_y, f_z, N.
    forces: String,
}

impl Poses {
    pub fn of(film: &Film, scale: &Scale) -> Self {
        let frames = &film.frames;
        let corners = film.body().points.len();
        let most = (MOST_FRAMES * 8 / corners.max(8)).max(FEWEST_FRAMES);
        let every = spacing(frames.len(), most);
        let shown: Vec<usize> = shown(frames.len(), every).collect();
        let spans: Vec<&[Frame]> = (0..shown.len())
            .map(|i| &frames[shown[i]..shown.get(i + 1).copied().unwrap_or(frames.len())])
            .collect();
        let origin = frames.first().map_or(Vector3::zeros(), |frame| frame.pose().position);
        let pose = |span: &&[Frame]| {
            let pose = span[0].pose();
            let ([x, y, z], q) = ((pose.position - origin).into(), &pose.attitude);
            [x, y, z, q.w, q.i, q.j, q.k]
        };
        let mut counts = Vec::with_capacity(spans.len());
        let (mut touching, mut forces) = (Vec::new(), Vec::new());
        for span in &spans {
            let before = touching.len();
            for (corner, force) in scale.means(film, span) {
                touching.push(corner);
                forces.extend(force.iter().copied());
            }
            counts.push(touching.len() - before);
        }
        Self {
            every,
            count: spans.len(),
            origin: origin.into(),
            poses: f32s(spans.iter().flat_map(pose)),
            speeds: f32s(spans.iter().map(|span| span[0].pose().velocity.norm())),
            residuals: f32s(spans.iter().map(|span| {
                span.iter().map(|frame| frame.residual).fold(f64::NEG_INFINITY, f64::max)
            })),
            statuses: u8s(spans
                .iter()
                .filter_map(|span| span.iter().map(|frame| frame.status as u8).max())),
            force_counts: u16s(counts.into_iter()),
            force_corners: u16s(touching.into_iter()),
            forces: f32s(forces.into_iter()),
        }
    }
}

/// Every how many-th of `count` frames is shown so that at most `most` are, and the last.
fn spacing(count: usize, most: usize) -> usize {
    count.saturating_sub(1).div_ceil(most - 1).max(1)
}

/// The frames that are shown.
fn shown(count: usize, every: usize) -> impl Iterator<Item = usize> {
    let last = count.saturating_sub(1);
    (0..last).step_by(every).chain((count > 0).then_some(last))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn poses_are_even_and_few_and_have_the_last_frame() {
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
