//! One frame: floor, shadows, bodies, forces, clock.

use super::arrows::{self, Arrow};
use super::camera::Camera;
use super::canvas::Canvas;
use super::floor::{Floor, Light};
use super::lettering;
use super::palette::{self, BACKGROUND, INK};
use super::pins::{self, Pin};
use super::raster::Raster;
use super::settings::Settings;
use super::solids::Easel;
use crate::film::Film;
use crate::shape::Look;
use nalgebra::{Isometry3, Point3, Vector3};

/// Of a body's size: what lies behind others by more is hidden.
const BEHIND: f64 = 0.05;

/// What one frame shows, in the ground's frame.
pub struct Moment {
    /// The clock, s.
    pub time: f64,
    /// Of each body.
    pub poses: Vec<Isometry3<f64>>,
    pub arrows: Vec<Arrow>,
    pub pins: Vec<Pin>,
}

/// What is drawn of a body.
struct Actor {
    looks: Vec<Look>,
    /// Points that span each of the looks.
    spans: Vec<Vec<Vector3<f64>>>,
    hue: usize,
    reach: f64,
}

/// Everything that stays the same from frame to frame.
pub struct Stage {
    pub camera: Camera,
    /// `None` where the bodies move freely.
    floor: Option<Floor>,
    light: Light,
    /// The bodies, and after them what stands still, as one.
    actors: Vec<Actor>,
    /// Of what stands still: world → ground.
    to_ground: Isometry3<f64>,
    speed: f64,
    /// Floor and grid alone.
    empty: Canvas,
    raster: Raster,
}

impl Stage {
    /// A stage on which all `moments` are in view. `None` if the picture has no size.
    pub fn new(film: &Film, settings: &Settings, moments: &[Moment]) -> Option<Self> {
        let light = Light::for_azimuth(settings.view.azimuth);
        let to_ground = film.to_ground();
        let actors = actors(film);
        let mut points = Vec::new();
        for moment in moments {
            for (actor, pose) in actors.iter().zip(moment.poses.iter().chain([&to_ground])) {
                let span = actor.spans.iter().flatten();
                points.extend(span.map(|point| (pose * Point3::from(*point)).coords));
            }
        }
        let floor = film.ground.map(|_| Floor::under(&points, light));
        let tips = moments.iter().flat_map(|moment| &moment.arrows).map(|arrow| arrow.to);
        points.extend(tips.chain(floor.iter().flat_map(Floor::corners)));
        let turn = to_ground.rotation.to_rotation_matrix();
        let camera = Camera::fit(settings.view, &turn, settings.size, &points);
        let mut empty = Canvas::new(settings.size, BACKGROUND)?;
        if let Some(floor) = &floor {
            floor.paint(&mut empty, &camera);
        }
        let raster = Raster::new(usize::from(settings.size));
        let speed = settings.speed;
        Some(Self { camera, floor, light, actors, to_ground, speed, empty, raster })
    }

    /// The picture without anything that moves.
    pub fn empty(&self) -> &Canvas {
        &self.empty
    }

    /// Paints `moment` over whatever is in `canvas`.
    pub fn paint(&mut self, canvas: &mut Canvas, moment: &Moment) {
        canvas.copy_from(&self.empty);
        let unit = f64::from(canvas.size()) / 800.0;
        let poses = || moment.poses.iter().chain([&self.to_ground]);
        if let Some(floor) = &self.floor {
            let spans = self.actors.iter().zip(poses()).flat_map(|(actor, pose)| {
                let places = |span: &Vec<Vector3<f64>>| -> Vec<Vector3<f64>> {
                    span.iter().map(|point| (pose * Point3::from(*point)).coords).collect()
                };
                actor.spans.iter().map(places).collect::<Vec<_>>()
            });
            floor.paint_shadows(canvas, &self.camera, &spans.collect::<Vec<_>>());
        }
        self.raster.clear();
        let poses: Vec<_> = poses().collect();
        for (actor, pose) in self.actors.iter().zip(poses) {
            let (camera, raster) = (&self.camera, &mut self.raster);
            let Actor { hue, reach, .. } = *actor;
            let mut easel = Easel { raster, camera, light: self.light, unit, hue, reach };
            for look in &actor.looks {
                easel.look(look, pose);
            }
        }
        // What the bodies hide, the bodies, what stands before them.
        let (hidden, seen): (Vec<_>, Vec<_>) = moment.arrows.iter().partition(|arrow| {
            self.raster.hides(self.camera.spot(&arrow.from), BEHIND * arrow.reach)
        });
        arrows::paint(canvas, &self.camera, &hidden);
        self.raster.compose(canvas);
        pins::paint(canvas, &self.camera, &moment.pins);
        arrows::paint(canvas, &self.camera, &seen);
        self.paint_clock(canvas, moment.time);
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

/// The bodies, and what stands still.
fn actors(film: &Film) -> Vec<Actor> {
    let actor = |looks: Vec<Look>, hue, reach| {
        let spans = looks.iter().map(Look::span).collect();
        Actor { looks, spans, hue, reach }
    };
    let bodies = film.bodies.iter().enumerate();
    let bodies = bodies.map(|(b, body)| actor(Look::of(body), palette::hue_of(b), body.reach()));
    let still: Vec<Look> =
        film.fixed.iter().flat_map(|fixed| &fixed.pieces).cloned().map(Look::Solid).collect();
    let points: Vec<Vector3<f64>> = still.iter().flat_map(Look::span).collect();
    let middle = points.iter().sum::<Vector3<f64>>() / points.len().max(1) as f64;
    let reach = points.iter().map(|point| (point - middle).norm()).fold(0.0, f64::max);
    // A body's lift is right for a piece of its size.
    let reach = film.bodies.iter().map(crate::film::Body::reach).fold(reach, f64::min);
    bodies.chain([actor(still, palette::STILL, reach)]).collect()
}
