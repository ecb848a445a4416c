//! One frame: floor, shadow, body, forces, clock.

use super::arrows::{self, Arrow};
use super::camera::Camera;
use super::canvas::Canvas;
use super::floor::{Floor, Light};
use super::lettering;
use super::outline::{hull, seen_faces};
use super::palette::{self, BACKGROUND, EDGE, INK};
use super::settings::Settings;
use crate::film::Film;
use crate::shape::Shape;
use nalgebra::Vector3;

/// What one frame shows, in the ground's frame.
pub struct Moment {
    /// The clock, s.
    pub time: f64,
    pub corners: Vec<Vector3<f64>>,
    pub arrows: Vec<Arrow>,
}

/// Everything that stays the same from frame to frame.
pub struct Stage {
    pub camera: Camera,
    /// `None` where the bodies move freely.
    floor: Option<Floor>,
    light: Light,
    shape: Shape,
    speed: f64,
    /// Floor and grid alone.
    empty: Canvas,
}

impl Stage {
    /// A stage on which all `moments` are in view. `None` if the picture has no size.
    pub fn new(film: &Film, settings: &Settings, moments: &[Moment]) -> Option<Self> {
        let light = Light::for_azimuth(settings.view.azimuth);
        let corners: Vec<_> = moments.iter().flat_map(|moment| &moment.corners).copied().collect();
        let floor = film.ground.map(|_| Floor::under(&corners, light));
        let tips = moments.iter().flat_map(|moment| &moment.arrows).map(|arrow| arrow.to);
        let mut points = corners.clone();
        points.extend(tips.chain(floor.iter().flat_map(Floor::corners)));
        let turn = film.to_ground().rotation.to_rotation_matrix();
        let camera = Camera::fit(settings.view, &turn, settings.size, &points);
        let mut empty = Canvas::new(settings.size, BACKGROUND)?;
        if let Some(floor) = &floor {
            floor.paint(&mut empty, &camera);
        }
        let shape = Shape::of(&film.body().points);
        Some(Self { camera, floor, light, shape, speed: settings.speed, empty })
    }

    /// The picture without anything that moves.
    pub fn empty(&self) -> &Canvas {
        &self.empty
    }

    /// Paints `moment` over whatever is in `canvas`.
    pub fn paint(&self, canvas: &mut Canvas, moment: &Moment) {
        canvas.copy_from(&self.empty);
        if let Some(floor) = &self.floor {
            floor.paint_shadow(canvas, &self.camera, &moment.corners);
        }
        // What the body hides, the body, what stands before it.
        let (hidden, seen): (Vec<_>, Vec<_>) =
            moment.arrows.iter().partition(|arrow| self.is_hidden(&moment.corners, &arrow.from));
        arrows::paint(canvas, &self.camera, &hidden);
        match self.shape {
            Shape::Box => self.paint_box(canvas, &moment.corners),
            Shape::Points => self.paint_points(canvas, &moment.corners),
        }
        arrows::paint(canvas, &self.camera, &seen);
        self.paint_clock(canvas, moment.time);
    }

    /// Whether a box hides one of its corners: no face that is seen has it.
    fn is_hidden(&self, corners: &[Vector3<f64>], corner: &Vector3<f64>) -> bool {
        let eye = self.camera.eye();
        self.shape == Shape::Box
            && !seen_faces(corners, &eye).any(|face| face.corners.contains(corner))
    }

    fn paint_box(&self, canvas: &mut Canvas, corners: &[Vector3<f64>]) {
        let width = canvas.size() / 800.0 * 2.2;
        let eye = self.camera.eye();
        let faces: Vec<_> = seen_faces(corners, &eye)
            .map(|face| (face.corners.map(|corner| self.camera.project(&corner)), face.normal))
            .collect();
        for (outline, normal) in &faces {
            canvas.fill(outline, palette::body(self.lit(normal)), 1.0);
        }
        for (outline, _) in &faces {
            canvas.line(outline, true, width, EDGE);
        }
    }

    fn paint_points(&self, canvas: &mut Canvas, corners: &[Vector3<f64>]) {
        let unit = canvas.size() / 800.0;
        let places: Vec<_> = corners.iter().map(|corner| self.camera.project(corner)).collect();
        let outline = hull(&places);
        canvas.fill(&outline, palette::body(0.75), 1.0);
        canvas.line(&outline, true, 2.2 * unit, EDGE);
        for place in places {
            canvas.dot(place, 4.0 * unit, EDGE);
        }
    }

    /// How light a face is, from 0 to 1: the lamp, and the sky for what it does not reach.
    fn lit(&self, normal: &Vector3<f64>) -> f32 {
        let lamp = normal.dot(&self.light.direction()).max(0.0);
        let sky = 0.5 + 0.5 * normal.z;
        (0.30 + 0.22 * sky + 0.46 * lamp) as f32
    }

    fn paint_clock(&self, canvas: &mut Canvas, time: f64) {
        let unit = canvas.size() / 800.0;
        let decimals = if self.speed < 0.5 { 3 } else { 2 };
        let text = format!("t = {time:.decimals$} s");
        lettering::write(canvas, &text, [32.0 * unit, 30.0 * unit], 24.0 * unit, INK);
        if self.speed != 1.0 {
            let text = format!("{} ×", self.speed);
            lettering::write(canvas, &text, [32.0 * unit, 70.0 * unit], 15.0 * unit, INK);
        }
    }
}
