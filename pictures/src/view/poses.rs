//! The poses that the page shows, and what happens between them.

use super::encode::{f32s, u8s, u32s};
use crate::film::{Film, Frame, Partner, Place, Pose};
use crate::forces::{Scale, Site};
use nalgebra::Vector3;
use serde::Serialize;
use std::collections::BTreeMap;

/// More poses than this make a large file and nothing that an eye can see. Bodies with more
/// than eight corners get fewer, since each has a force, and so do films of many bodies.
const MOST_FRAMES: usize = 6000;
const FEWEST_FRAMES: usize = 500;
/// Poses of all bodies together, if that leaves [`FEWEST_FRAMES`].
const MOST_POSES: usize = 120_000;

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
    /// Of each frame and each body in it x, y, z (m) and q_w, q_x, q_y, q_z.
    poses: String,
    /// Of each frame and body ‖v‖, m/s.
    speeds: String,
    /// m/s.
    residuals: String,
    /// Places in [`Status::ALL`](crate::Status::ALL).
    statuses: String,
    /// How many contacts of each have a force.
    force_counts: String,
    /// Which they are, one after the other: places in `sites`.
    force_sites: String,
    /// Of each of them f_x, f_y, f_z, on the first body of its site, N.
    forces: String,
    /// Of each of them that is at no corner where it is, from `origin`, m.
    force_points: String,
    /// Everything that touches: the body; its partner, -1 for the ground and from -2 downwards
    /// for what is fixed; the corner of the body, -1 for none.
    sites: Vec<[i64; 3]>,
}

impl Poses {
    pub fn of(film: &Film, scale: &Scale) -> Self {
        let frames = &film.frames;
        let corners = film.bodies.iter().map(|body| body.points.len()).max().unwrap_or(0);
        let most = (MOST_FRAMES * 8 / corners.max(8)).min(MOST_POSES / film.bodies.len());
        let every = spacing(frames.len(), most.max(FEWEST_FRAMES));
        let shown: Vec<usize> = shown(frames.len(), every).collect();
        let spans: Vec<&[Frame]> = (0..shown.len())
            .map(|i| &frames[shown[i]..shown.get(i + 1).copied().unwrap_or(frames.len())])
            .collect();
        let origin = frames.first().map_or(Vector3::zeros(), |frame| frame.poses[0].position);
        let pose = |pose: &Pose| {
            let ([x, y, z], q) = ((pose.position - origin).into(), &pose.attitude);
            [x, y, z, q.w, q.i, q.j, q.k]
        };
        let mut counts = Vec::with_capacity(spans.len());
        let mut sites: BTreeMap<Site, usize> = BTreeMap::new();
        let mut described = Vec::new();
        let (mut touching, mut forces, mut points) = (Vec::new(), Vec::new(), Vec::new());
        for span in &spans {
            let before = touching.len();
            for mean in scale.means(film, span) {
                let next = sites.len();
                let site = *sites.entry(mean.site).or_insert(next);
                if site == next {
                    described.push(described_site(&mean.site));
                }
                touching.push(site);
                forces.extend(mean.force.iter().copied());
                if let Place::At { point, .. } = mean.place {
                    points.extend((point - origin).iter().copied());
                }
            }
            counts.push(touching.len() - before);
        }
        let poses = || spans.iter().flat_map(|span| &span[0].poses);
        Self {
            every,
            count: spans.len(),
            origin: origin.into(),
            poses: f32s(poses().flat_map(pose)),
            speeds: f32s(poses().map(|pose| pose.velocity.norm())),
            residuals: f32s(spans.iter().map(|span| {
                span.iter().map(|frame| frame.residual).fold(f64::NEG_INFINITY, f64::max)
            })),
            statuses: u8s(spans
                .iter()
                .filter_map(|span| span.iter().map(|frame| frame.status as u8).max())),
            force_counts: u32s(counts.into_iter()),
            force_sites: u32s(touching.into_iter()),
            forces: f32s(forces.into_iter()),
            force_points: f32s(points.into_iter()),
            sites: described,
        }
    }
}

fn described_site(site: &Site) -> [i64; 3] {
    let partner = match site.partner {
        Partner::Ground => -1,
        Partner::Fixed(i) => -2 - i as i64,
        Partner::Body(b) => b as i64,
    };
    [site.body as i64, partner, if site.is_corner { site.key as i64 } else { -1 }]
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
