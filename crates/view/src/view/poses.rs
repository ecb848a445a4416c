//! Poses and contact forces of the page.

use super::encode::{PackedNumbers, packed, packed_floats, packed_rows, u8s};
use crate::film::{Film, Object, pose};
use crate::forces::Scale;
use nalgebra::Vector3;
use serde::Serialize;
use std::collections::BTreeMap;
use tumble_core::contact::{ContactKey, Partner};
use tumble_core::mechanics::State;
use tumble_scene::output::tables::IntervalRows;

/// Maximum number of poses, which is enough for smooth playback. Bodies with more than eight
/// contact points and films of many bodies have fewer.
const MOST_FRAMES: usize = 6000;
const FEWEST_FRAMES: usize = 500;
/// Maximum number of poses over all bodies, subject to [`FEWEST_FRAMES`].
const MOST_POSES: usize = 520_000;
/// Resolution of quaternion components. It moves the ends of a body by less than 1e-4 of its size.
const ATTITUDE_STEP: f64 = 1.0 / 16384.0;
/// Resolution of the components of normals.
const NORMAL_STEP: f64 = 1e-3;
/// Resolution of forces over [`Scale::weight`], a hundredth of the longest arrow.
const FORCE_STEP: f64 = 1e-4;

/// Every `every`-th frame and the last one.
///
/// Each has the mean forces, largest residual and most severe status of the steps up to the next
/// one.
#[derive(Serialize)]
pub struct EncodedPoses {
    every: usize,
    count: usize,
    /// Origin of the positions (m).
    origin: [f64; 3],
    /// Positions (m): for each body x of all frames, then y and z.
    positions: PackedNumbers,
    /// Quaternions: for each body q_w of all frames, then q_x, q_y and q_z. The sign is arbitrary.
    attitudes: PackedNumbers,
    /// Speeds ‖v‖ (m/s): for each body, all frames.
    speeds: PackedNumbers,
    /// Residuals (m/s).
    residuals: PackedNumbers,
    /// Indices into [`StepStatus::ALL`](tumble_core::step::StepStatus::ALL).
    statuses: String,
    /// Contact sites as body, partner and number of frames with force. Partner −1 is the ground, −2
    /// and below are fixed objects.
    sites: Vec<[i64; 3]>,
    /// Friction coefficient of each site.
    frictions: Vec<f64>,
    /// Frames with force: for each site.
    force_frames: PackedNumbers,
    /// Forces on the first body (N): for each site f_x of its frames, then f_y and f_z.
    forces: PackedNumbers,
    /// Moments on the first body (N m), in the order of the forces.
    moments: PackedNumbers,
    /// Positions relative to `origin` (m): for each site x of its frames, then y and z.
    force_points: PackedNumbers,
    /// Unit normals away from the partner, except for the ground: for each site n_x, then n_y, n_z.
    normals: PackedNumbers,
    /// Forces of joints on their first bodies (N): for each joint f_x of all frames, then f_y, f_z.
    joint_forces: PackedNumbers,
}

/// Force in a frame, and its position (m).
struct DrawnForce {
    frame: usize,
    force: Vector3<f64>,
    moment: Vector3<f64>,
    point: Vector3<f64>,
    /// Unit normal away from the partner. `None` for the ground.
    normal: Option<Vector3<f64>>,
}

impl EncodedPoses {
    pub fn new(film: &Film, scale: &Scale) -> Self {
        let frames = &film.frames;
        let flat = film.world.bodies().iter().filter(|body| body.pieces().is_empty());
        let points = flat.map(|body| body.contact_points().len()).max().unwrap_or(0);
        // Frames are left out of long films and of films with many bodies or points.
        let most = (MOST_FRAMES * 8 / points.max(8)).min(MOST_POSES / film.bodies.len());
        let every = spacing(frames.len(), most.max(FEWEST_FRAMES));
        let shown: Vec<usize> = shown(frames.len(), every).collect();
        let spans: Vec<&[IntervalRows]> = (0..shown.len())
            .map(|i| &frames[shown[i]..shown.get(i + 1).copied().unwrap_or(frames.len())])
            .collect();
        // Five digits of the smallest body and of the largest speed; four are displayed.
        let smallest = film.bodies.iter().map(Object::reach).fold(f64::INFINITY, f64::min);
        let length_step = digit(smallest, 5);
        let poses = || spans.iter().flat_map(|span| span[0].instant_states());
        let fastest = poses().map(|pose| pose.velocity.norm()).fold(0.0, f64::max);
        let start = frames.first().map_or(Vector3::zeros(), |frame| frame.states[0].position);
        let origin = start.map(|x| (x / length_step).round() * length_step);
        let of_bodies = |part: &dyn Fn(&State) -> f64| -> Vec<Vec<f64>> {
            let of_body =
                |b: usize| spans.iter().map(|span| part(&span[0].instant_states()[b])).collect();
            (0..film.bodies.len()).map(of_body).collect()
        };
        // Positions are relative to the start, so that they have few digits.
        let positions = [0, 1, 2].map(|k| of_bodies(&|pose| pose.position[k] - origin[k]));
        // Forces of each contact in all frames
        let pushes = pushes(scale, &spans);
        let friction = |site: &ContactKey| film.world.friction_between(site.body, site.partner);
        let of_pushes = |value: &dyn Fn(&DrawnForce, usize) -> Option<f64>| -> Vec<f64> {
            let of_site = |pushes: &Vec<DrawnForce>| -> Vec<f64> {
                (0..3).flat_map(|k| pushes.iter().filter_map(move |p| value(p, k))).collect()
            };
            pushes.values().flat_map(of_site).collect()
        };
        let forces = of_pushes(&|push, k| Some(push.force[k]));
        let moments = of_pushes(&|push, k| Some(push.moment[k]));
        let points = of_pushes(&|push, k| Some(push.point[k] - origin[k]));
        let normals = of_pushes(&|push, k| Some(push.normal?[k]));
        Self {
            every,
            count: spans.len(),
            origin: origin.into(),
            positions: packed(interleaved(&positions), length_step),
            attitudes: packed(interleaved(&attitudes(film, &spans)), ATTITUDE_STEP),
            speeds: packed(
                of_bodies(&|pose| pose.velocity.norm()).into_iter().flatten(),
                digit(fastest, 5),
            ),
            residuals: packed_floats(spans.iter().map(|span| {
                span.iter().map(|frame| frame.row.residual).fold(f64::NEG_INFINITY, f64::max)
            })),
            statuses: u8s(spans
                .iter()
                .filter_map(|span| span.iter().map(|frame| frame.row.status as u8).max())),
            sites: pushes.iter().map(|(site, all)| described(site, all.len())).collect(),
            frictions: pushes.keys().map(friction).collect(),
            force_frames: packed_rows(pushes.values().flatten().map(|push| push.frame)),
            forces: packed(forces.into_iter(), FORCE_STEP * scale.weight),
            moments: packed(moments.into_iter(), FORCE_STEP * scale.weight * smallest),
            force_points: packed(points.into_iter(), length_step),
            normals: packed(normals.into_iter(), NORMAL_STEP),
            joint_forces: packed(
                interleaved(&joint_forces(film, &spans)),
                FORCE_STEP * scale.weight,
            ),
        }
    }
}

/// Place value of the digit number `place` of `size`, as a power of ten. A `size` of 0 counts as 1.
pub fn digit(size: f64, place: i32) -> f64 {
    let power = if size > 0.0 && size.is_finite() { size.log10().floor() as i32 } else { 0 };
    10f64.powi(power.max(-300) + 1 - place)
}

/// Components in sequence: all of the first body, then of the next one.
fn interleaved<const N: usize>(components: &[Vec<Vec<f64>>; N]) -> impl Iterator<Item = f64> {
    let bodies = components[0].len();
    (0..bodies).flat_map(move |b| components.iter().flat_map(move |of| of[b].iter().copied()))
}

/// Quaternion components. Signs are chosen for continuity.
fn attitudes(film: &Film, spans: &[&[IntervalRows]]) -> [Vec<Vec<f64>>; 4] {
    let mut all = [(); 4].map(|()| Vec::with_capacity(film.bodies.len()));
    for b in 0..film.bodies.len() {
        let mut of_body = [(); 4].map(|()| Vec::with_capacity(spans.len()));
        let mut last = [1.0, 0.0, 0.0, 0.0];
        for span in spans {
            let here: [f64; 4] = span[0].states[b].attitude.into();
            let along: f64 = here.iter().zip(last).map(|(a, b)| a * b).sum();
            last = if along < 0.0 { here.map(|part| -part) } else { here };
            for (values, part) in of_body.iter_mut().zip(last) {
                values.push(part);
            }
        }
        for (values, of) in all.iter_mut().zip(of_body) {
            values.push(of);
        }
    }
    all
}

/// Components of the mean force of each joint in each span, world frame.
fn joint_forces(film: &Film, spans: &[&[IntervalRows]]) -> [Vec<Vec<f64>>; 3] {
    let joints = film.world.joints();
    let force = |step: &IntervalRows, j: usize| {
        let along_axes = step.joints.get(j).map_or(Vector3::zeros(), |row| row.force);
        let along_other = joints[j].frames()[1].rotation() * along_axes;
        joints[j].other().map_or(along_other, |b| pose(&step.states[b]).rotation * along_other)
    };
    let mean = |span: &&[IntervalRows], j: usize| {
        span.iter().map(|step| force(step, j)).sum::<Vector3<f64>>() / span.len() as f64
    };
    let means = |j: usize| spans.iter().map(move |span| mean(span, j)).collect();
    let all: Vec<Vec<_>> = (0..joints.len()).map(means).collect();
    [0, 1, 2].map(|k| all.iter().map(|of| of.iter().map(|force| force[k]).collect()).collect())
}

/// Mean forces of each span.
fn pushes(scale: &Scale, spans: &[&[IntervalRows]]) -> BTreeMap<ContactKey, Vec<DrawnForce>> {
    let mut pushes: BTreeMap<ContactKey, Vec<DrawnForce>> = BTreeMap::new();
    for (frame, span) in spans.iter().enumerate() {
        for mean in scale.means(span) {
            pushes.entry(mean.site).or_default().push(DrawnForce {
                frame,
                force: mean.force,
                moment: mean.moment,
                point: mean.point,
                normal: (mean.site.partner != Partner::Ground).then_some(mean.normal),
            });
        }
    }
    pushes
}

fn described(site: &ContactKey, frames: usize) -> [i64; 3] {
    let partner = match site.partner {
        Partner::Ground => -1,
        Partner::Fixed(i) => -2 - i as i64,
        Partner::Body(b) => b as i64,
    };
    [site.body as i64, partner, frames as i64]
}

/// Stride that selects at most `most` of `count` frames, including the last.
fn spacing(count: usize, most: usize) -> usize {
    count.saturating_sub(1).div_ceil(most - 1).max(1)
}

/// Indices of the selected frames.
fn shown(count: usize, every: usize) -> impl Iterator<Item = usize> {
    let last = count.saturating_sub(1);
    (0..last).step_by(every).chain((count > 0).then_some(last))
}

#[cfg(test)]
#[path = "tests/poses.rs"]
mod tests;
