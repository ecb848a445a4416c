//! Animation of a film: a GIF, or its frames for a video.
//!
//! The animation has thirty frames per second and shows the bodies, their shadows, the contact
//! forces and the time. The camera is fixed at the smallest distance from which everything is
//! visible. Small motion is magnified, and tracked if its path is long (`framing`). Output is
//! deterministic, byte for byte.
//!
//! - Arrows show the mean force of the steps since the previous frame, on a compressed scale
//!   (`forces::Scale`). A contact between two bodies has an arrow for each of them. Arrows are
//!   hidden behind the bodies that hide their contacts.
//! - Pieces are drawn with their exact shape. Polyhedra with many faces are shaded as round shapes.
//!   Great circles on balls show their rotation.
//! - A body without pieces is drawn from its contact points: as a box if they are its eight
//!   corners, x fastest, or else as points with their convex outline.
//! - Joints are drawn on top as rings at their anchors, with their axes.

mod arrows;
mod camera;
mod canvas;
mod difference;
mod encoder;
mod floor;
mod framing;
mod lettering;
mod outline;
mod palette;
mod pins;
mod raster;
mod settings;
mod solids;
mod stage;
mod timing;

#[cfg(test)]
mod tests;

pub use camera::View;
pub use settings::{AnimationError, AnimationSettings};
pub use timing::{FRAMES_A_SECOND, frame_count};

use crate::film::{Film, Object, axis, pose};
use crate::forces::Scale;
use arrows::Arrow;
use canvas::Canvas;
use encoder::Encoder;
use nalgebra::{Isometry3, Point3, Vector3};
use pins::DrawnJoint;
use settings::FARTHEST;
use stage::{Backdrop, FrameState, SKETCHES};
use std::io;
use std::ops::ControlFlow;
use tumble_core::contact::Partner;
use tumble_scene::output::tables::IntervalRows;

/// Half length of a drawn joint axis over the size of its body.
const AXIS: f64 = 0.3;

/// Draws `film`. The callback `progress` receives the number of finished frames and the total. It
/// can abort the work.
///
/// # Errors
/// See [`AnimationError`].
pub fn animate(
    film: &Film,
    settings: &AnimationSettings,
    progress: impl FnMut(u64, u64) -> ControlFlow<()>,
) -> Result<Vec<u8>, AnimationError> {
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, film, settings)?;
    draw(film, settings, progress, |k, canvas| encoder.add(k, canvas))?;
    // Dropping the encoder writes the trailer.
    drop(encoder);
    Ok(bytes)
}

/// Draws `film` at [`FRAMES_A_SECOND`], and passes the pixels of each frame to `receive`: three bytes
/// (red, green, blue) a pixel, row by row from the top. An error of `receive` ends the work.
///
/// # Errors
/// See [`AnimationError`].
pub fn frames(
    film: &Film,
    settings: &AnimationSettings,
    progress: impl FnMut(u64, u64) -> ControlFlow<()>,
    mut receive: impl FnMut(&[u8]) -> io::Result<()>,
) -> Result<(), AnimationError> {
    draw(film, settings, progress, |_, canvas| {
        let pixels: Vec<u8> = canvas.colours().flatten().collect();
        Ok(receive(&pixels)?)
    })
}

/// Draws the frames of `film` one after the other, and passes each with its number to `receive`.
fn draw(
    film: &Film,
    settings: &AnimationSettings,
    mut progress: impl FnMut(u64, u64) -> ControlFlow<()>,
    mut receive: impl FnMut(u64, &Canvas) -> Result<(), AnimationError>,
) -> Result<(), AnimationError> {
    let moments = moments(film, settings)?;
    let mut stage = Backdrop::new(film, settings, &moments).ok_or(AnimationError::TooFar)?;
    let mut canvas = stage.empty().clone();
    for (k, moment) in moments.iter().enumerate() {
        if progress(k as u64, moments.len() as u64).is_break() {
            return Err(AnimationError::Interrupted);
        }
        stage.aim(k);
        stage.paint(&mut canvas, moment);
        receive(k as u64, &canvas)?;
    }
    Ok(())
}

/// First frame of `film`, three bytes (red, green, blue) for each pixel, row by row from the top.
///
/// # Errors
/// See [`AnimationError`].
pub fn pixels(film: &Film, settings: &AnimationSettings) -> Result<Vec<u8>, AnimationError> {
    let moments = moments(film, settings)?;
    let mut stage = Backdrop::new(film, settings, &moments).ok_or(AnimationError::TooFar)?;
    let mut canvas = stage.empty().clone();
    stage.aim(0);
    stage.paint(&mut canvas, &moments[0]);
    Ok(canvas.colours().flatten().collect())
}

/// Frame of `film` at a time (s), the nearest one, as PNG. The camera is as near as possible with that
/// frame and all fixed objects in view.
///
/// # Errors
/// See [`AnimationError`].
pub fn still(
    film: &Film,
    settings: &AnimationSettings,
    time: f64,
) -> Result<Vec<u8>, AnimationError> {
    let off = |frame: &&IntervalRows| (frame.row.time - time).abs();
    let nearest = film.frames.iter().min_by(|a, b| off(a).total_cmp(&off(b)));
    let film = film.with_frames(nearest.into_iter().cloned().collect());
    let moments = moments(&film, settings)?;
    let mut stage = Backdrop::new(&film, settings, &moments).ok_or(AnimationError::TooFar)?;
    stage.show_all();
    let mut canvas = stage.empty().clone();
    stage.paint(&mut canvas, &moments[0]);
    canvas.png()
}

/// View of `film` that is used unless another is requested.
pub(crate) fn usual_view(film: &Film) -> View {
    let stride = film.frames.len().div_ceil(SKETCHES);
    let mut frames: Vec<_> = film.frames.iter().step_by(stride).cloned().collect();
    frames.iter_mut().for_each(|frame| frame.contacts = std::sync::Arc::default());
    let film = film.with_frames(frames);
    let (scale, to_ground) = (Scale::from_film(&film), film.to_ground());
    let moments: Result<Vec<_>, _> =
        film.frames.iter().map(|frame| moment(&film, frame, &[], &scale, &to_ground)).collect();
    let found = moments
        .ok()
        .and_then(|moments| stage::open_view(&film, &AnimationSettings::default(), &moments));
    found.unwrap_or_default()
}

/// Content of the frames.
fn moments(film: &Film, settings: &AnimationSettings) -> Result<Vec<FrameState>, AnimationError> {
    let duration = (film.frames.len() - 1) as f64 * film.frame_time();
    let scale = Scale::from_film(film);
    let to_ground = film.to_ground();
    let mut before = 0;
    let mut moments = Vec::new();
    for frame in 0..frame_count(duration, settings.speed)? {
        let now = timing::shown(film, frame, settings.speed);
        let steps = &film.frames[before.min(now.saturating_sub(1))..now];
        moments.push(moment(film, &film.frames[now], steps, &scale, &to_ground)?);
        before = now;
    }
    Ok(moments)
}

/// Content of a frame: bodies as in `shown`, and the mean forces of `steps`.
fn moment(
    film: &Film,
    shown: &IntervalRows,
    steps: &[IntervalRows],
    scale: &Scale,
    to_ground: &Isometry3<f64>,
) -> Result<FrameState, AnimationError> {
    let is_near = |place: &Vector3<f64>, room: f64| {
        // The comparison also rejects NaN.
        place.iter().all(|coordinate| coordinate.abs() + room <= FARTHEST)
    };
    let mut poses = Vec::with_capacity(film.bodies.len());
    for (body, state) in film.bodies.iter().zip(&shown.states) {
        let pose = to_ground * pose(state);
        if !is_near(&pose.translation.vector, body.reach()) {
            return Err(AnimationError::TooFar);
        }
        poses.push(pose);
    }
    let mut arrows = Vec::new();
    for mean in scale.means(steps) {
        let from = (to_ground * Point3::from(mean.point)).coords;
        let vector = to_ground.rotation * scale.arrow(&mean.force);
        if !is_near(&from, vector.norm()) {
            return Err(AnimationError::TooFar);
        }
        let mut add = |body: usize, vector: Vector3<f64>| {
            let reach = film.bodies.get(body).map_or(0.0, Object::reach);
            arrows.push(Arrow { from, to: from + vector, reach });
        };
        add(mean.site.body, vector);
        if let Partner::Body(other) = mean.site.partner {
            add(other, -vector);
        }
    }
    let joints = film.world.joints().iter();
    let pins = joints.filter_map(|joint| Some((joint, poses.get(joint.body())?)));
    let pins = pins.map(|(joint, pose)| {
        let reach = film.bodies.get(joint.body()).map_or(0.0, Object::reach);
        DrawnJoint {
            at: (pose * Point3::from(joint.frames()[0].anchor)).coords,
            axis: axis(joint).map(|axis| pose.rotation * axis * (AXIS * reach)),
        }
    });
    let pins = pins.collect();
    Ok(FrameState { time: shown.row.time, poses, arrows, pins })
}
