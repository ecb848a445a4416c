//! Painting of one frame: floor, shadows, bodies, forces and time.

use super::arrows::{self, Arrow};
use super::camera::{Camera, View};
use super::canvas::Canvas;
use super::floor::{Floor, Light};
use super::framing::{ViewExtent, Window, smooth, windows};
use super::lettering::{self, Lettering};
use super::palette::Hue;
use super::pins::{self, DrawnJoint};
use super::raster::Raster;
use super::settings::AnimationSettings;
use super::solids::{Canvas3d, Look};
use crate::film::{Film, Object, slope};
use crate::font::Font;
use crate::palette::{self, Rgb, Theme};
use crate::shape::Shape;
use crate::skeleton::{self, Bone};
use nalgebra::{Isometry3, Point3, Vector3};
use tumble_core::world::Plane;

/// Depth tolerance of hiding, over the size of a body.
const BEHIND: f64 = 0.05;

/// Height of label digits in a picture of 800 pixels.
const LABEL: f32 = 13.0;

/// Largest displacement of a body that counts as fixed, over its size.
const UNMOVED: f64 = 0.1;

/// Azimuth for scenes that are longer along x than along y by the given factor (degrees).
const AZIMUTH_ALONG_X: f64 = -62.0;
const LONGER: f64 = 1.5;

/// Smallest inclination of a slope (degrees).
const STEEP: f64 = 2.0;

/// Angle between the steepest descent of an inclined ground and the picture (degrees).
const TURNED_FROM_SLOPE: f64 = 15.0;

/// Height over width of a scene below which the lowest elevation, or the lowest two, are skipped.
const FLAT: [f64; 2] = [0.3, 0.12];

/// Candidate elevations of the camera (degrees), used without a requested view.
const HEIGHTS: [f64; 4] = [20.0, 35.0, 50.0, 65.0];

/// Acceptable hidden fraction of the moving bodies, number of test frames, and size of the test
/// pictures (pixels).
const HIDDEN: f64 = 0.05;
pub const SKETCHES: usize = 12;
const SKETCH: u16 = 200;

/// Content of a frame, in the ground's frame.
pub struct FrameState {
    /// Time (s).
    pub time: f64,
    /// Pose of each body.
    pub poses: Vec<Isometry3<f64>>,
    pub arrows: Vec<Arrow>,
    pub pins: Vec<DrawnJoint>,
}

/// Drawing of a body.
struct DrawnBody {
    looks: Vec<Look>,
    /// Points that span each outline.
    spans: Vec<Vec<Vector3<f64>>>,
    /// Points on each outline, which cast its shadow.
    casters: Vec<Vec<Vector3<f64>>>,
    hue: Hue,
    /// Lines from its shape to joints.
    bones: Vec<Bone>,
    reach: f64,
    label: String,
}

/// Everything that is constant over all frames.
pub struct Backdrop {
    pub camera: Camera,
    /// Ground. `None` if there is none.
    floor: Option<Floor>,
    light: Light,
    /// Bodies, then all fixed objects as one.
    drawn: Vec<DrawnBody>,
    /// Transform of fixed objects from the world to the ground's frame.
    to_ground: Isometry3<f64>,
    speed: f64,
    theme: &'static Theme,
    /// Window of each frame. The last one also applies to later frames.
    windows: Vec<Window>,
    /// Floor and grid in the current window.
    empty: Canvas,
    raster: Raster,
    /// Built-in font. `None` for pictures without text, or if it is invalid, independent of input.
    font: Option<Font>,
}

impl Backdrop {
    /// Prepares drawing of all `moments`. The camera aims at the first one. Without a requested
    /// view it is placed such that moving bodies are visible. `None` if the picture has size 0.
    pub fn new(film: &Film, settings: &AnimationSettings, moments: &[FrameState]) -> Option<Self> {
        let view = settings.view.map_or_else(|| open_view(film, settings, moments), Some)?;
        let backdrop = Self::camera_from(view, film, settings, moments)?;
        Some(Self { font: Font::bold(), ..backdrop })
    }

    /// Backdrop for pictures without text: a page that needs only the view has no font.
    fn camera_from(
        view: View,
        film: &Film,
        settings: &AnimationSettings,
        moments: &[FrameState],
    ) -> Option<Self> {
        let light = Light::for_azimuth(view.azimuth);
        let to_ground = film.to_ground();
        let drawn = drawn(film);
        // Everything that the camera has to show: bodies, tips of arrows, and shadows
        let mut points = Vec::new();
        for moment in moments {
            for (drawn_body, pose) in drawn.iter().zip(moment.poses.iter().chain([&to_ground])) {
                points.extend(drawn_body.places(pose));
            }
        }
        let mut floor = film.ground.as_ref().map(|_| Floor::under(&points, light));
        let tips = moments.iter().flat_map(|moment| &moment.arrows).map(|arrow| arrow.to);
        let shadows = floor.iter().flat_map(|floor| points.iter().flat_map(|p| floor.shadows(p)));
        let more: Vec<_> = tips.chain(shadows).collect();
        points.extend(more);
        let turn = to_ground.rotation.to_rotation_matrix();
        let mut camera = Camera::fit(view, &turn, settings.size, &points);
        // A window smaller than the view has a grid of its own width.
        let (windows, distance) = framed(&camera, &drawn, moments, floor.is_some());
        camera.window = windows[0];
        if camera.window.half < Window::WHOLE.half {
            let width = 2.0 * camera.window.half * distance;
            floor = floor.map(|floor| floor.with_grid_for(width));
        }
        let theme = settings.theme();
        let empty = Canvas::new(settings.size, theme.sky)?;
        let raster = Raster::new(usize::from(settings.size));
        let speed = settings.speed;
        let mut stage = Self {
            camera,
            floor,
            light,
            drawn,
            to_ground,
            speed,
            theme,
            windows,
            empty,
            raster,
            font: None,
        };
        stage.paint_floor();
        Some(stage)
    }

    /// Selects the window of frame `k`.
    pub fn aim(&mut self, k: usize) {
        self.look_through(self.windows[k.min(self.windows.len() - 1)]);
    }

    /// Selects the whole view.
    pub fn show_all(&mut self) {
        self.look_through(Window::WHOLE);
    }

    fn look_through(&mut self, window: Window) {
        if window != self.camera.window {
            self.camera.window = window;
            self.paint_floor();
        }
    }

    fn paint_floor(&mut self) {
        self.empty.clear(self.theme.sky);
        if let Some(floor) = &self.floor {
            floor.paint(&mut self.empty, &self.camera, self.theme);
        }
    }

    /// Picture without moving objects.
    pub fn empty(&self) -> &Canvas {
        &self.empty
    }

    /// Paints `moment` and overwrites `canvas`.
    pub fn paint(&mut self, canvas: &mut Canvas, moment: &FrameState) {
        canvas.copy_from(&self.empty);
        let unit = f64::from(canvas.size()) / 800.0;
        let poses = || moment.poses.iter().chain([&self.to_ground]);
        if let Some(floor) = &self.floor {
            let casters = self.drawn.iter().zip(poses()).flat_map(|(drawn_body, pose)| {
                let places = |caster: &Vec<Vector3<f64>>| -> Vec<Vector3<f64>> {
                    caster.iter().map(|point| (pose * Point3::from(*point)).coords).collect()
                };
                drawn_body.casters.iter().map(places).collect::<Vec<_>>()
            });
            floor.paint_shadows(canvas, &self.camera, &casters.collect::<Vec<_>>(), self.theme);
        }
        self.raster.clear();
        for (place, pose) in poses().copied().enumerate().collect::<Vec<_>>() {
            self.paint_body(place, &pose, unit);
        }
        // Order: arrows hidden by bodies, the bodies, arrows in front of them.
        let (hidden, visible): (Vec<_>, Vec<_>) = moment.arrows.iter().partition(|arrow| {
            self.raster.hides(self.camera.spot(&arrow.from), BEHIND * arrow.reach)
        });
        arrows::paint(canvas, &self.camera, &hidden, self.theme);
        self.raster.compose(canvas);
        pins::paint(canvas, &self.camera, &moment.pins, self.theme);
        arrows::paint(canvas, &self.camera, &visible, self.theme);
        if let Some(font) = &self.font {
            self.paint_labels(canvas, font, moment);
            self.paint_clock(canvas, font, moment.time);
        }
    }

    fn paint_body(&mut self, place: usize, pose: &Isometry3<f64>, unit: f64) {
        let (camera, raster, drawn_body) = (&self.camera, &mut self.raster, &self.drawn[place]);
        let (hue, reach) = (&drawn_body.hue, drawn_body.reach);
        let mut canvas = Canvas3d { raster, camera, light: self.light, unit, hue, reach };
        for look in &drawn_body.looks {
            canvas.look(look, pose);
        }
        for bone in &drawn_body.bones {
            canvas.rod([bone.from, bone.to], pose, self.theme.trail);
        }
    }

    /// Fraction of moving bodies whose centres are hidden by fixed objects, over some of the
    /// moments.
    pub(super) fn hidden(&mut self, moments: &[FrameState]) -> f64 {
        let moving = moving(&self.drawn, moments);
        let (mut hidden, mut all) = (0.0, 0.0);
        for k in (0..moments.len()).step_by(moments.len().div_ceil(SKETCHES)) {
            self.aim(k);
            self.raster.clear();
            let (still, pose) = (self.drawn.len() - 1, self.to_ground);
            self.paint_body(still, &pose, 1.0);
            for &body in &moving {
                let spot = self.camera.spot(&moments[k].poses[body].translation.vector);
                let room = BEHIND * self.drawn[body].reach;
                hidden += f64::from(u8::from(self.raster.hides(spot, room)));
                all += 1.0;
            }
        }
        hidden / all
    }

    /// Paints the labels above their bodies.
    fn paint_labels(&self, canvas: &mut Canvas, font: &Font, moment: &FrameState) {
        let height = LABEL * canvas.size() / 800.0;
        let labelled = self.drawn.iter().zip(&moment.poses);
        let labelled = labelled.filter(|(drawn_body, _)| !drawn_body.label.is_empty());
        let words = labelled.map(|(drawn_body, pose)| {
            let [x, _] = self.camera.project(&pose.translation.vector);
            let heights = drawn_body.places(pose).map(|place| self.camera.project(&place)[1]);
            let top = heights.fold(f32::INFINITY, f32::min);
            Lettering { text: &drawn_body.label, at: [x, top - height / 2.0], height }
        });
        lettering::draw_labels(canvas, font, &words.collect::<Vec<_>>(), self.theme);
    }

    fn paint_clock(&self, canvas: &mut Canvas, font: &Font, time: f64) {
        let unit = canvas.size() / 800.0;
        let decimals = if self.speed < 0.5 { 3 } else { 2 };
        let text = format!("t = {time:.decimals$} s");
        let mut write = |text: &str, below: f32, height: f32| {
            let words = Lettering { text, at: [32.0 * unit, below * unit], height: height * unit };
            lettering::write(canvas, font, &words, self.theme);
        };
        write(&text, 50.0, 20.0);
        if self.speed != 1.0 {
            let text = format!("{} ×", self.speed);
            write(&text, 78.0, 14.0);
        }
    }
}

impl DrawnBody {
    /// Points that span it at a pose, in the ground's frame.
    fn places(&self, pose: &Isometry3<f64>) -> impl Iterator<Item = Vector3<f64>> {
        self.spans.iter().flatten().map(move |point| (pose * Point3::from(*point)).coords)
    }
}

/// View with the lowest elevation from which moving bodies are visible, or else the elevation with
/// the smallest hidden fraction. Flat scenes are seen from higher up, scenes that are longer along x
/// from the side, and a slope from its side. `None` if there is no picture.
pub fn open_view(
    film: &Film,
    settings: &AnimationSettings,
    moments: &[FrameState],
) -> Option<View> {
    let extent = extent(film, moments);
    let slope = film.inclined_ground().filter(|ground| (STEEP..90.0).contains(&slope(ground)));
    let azimuth = match slope.map(Plane::normal) {
        // The slope falls to the right.
        Some(n) => (-n.x).atan2(n.y).to_degrees() + TURNED_FROM_SLOPE,
        None if extent.x > LONGER * extent.y => AZIMUTH_ALONG_X,
        None => View::default().azimuth,
    };
    let flatness = extent.z / extent.x.max(extent.y);
    let is_flat = |limit: &&f64| slope.is_none() && flatness < **limit;
    let lowest = FLAT.iter().filter(is_flat).count();
    let views = HEIGHTS[lowest..].iter().map(|elevation| View { azimuth, elevation: *elevation });
    let views: Vec<_> = views.collect();
    if film.fixed.is_empty() {
        return Some(views[0]);
    }
    let settings = AnimationSettings { size: SKETCH, ..*settings };
    let (mut best, mut least) = (views[0], f64::INFINITY);
    for view in views {
        let hidden = Backdrop::camera_from(view, film, &settings, moments)?.hidden(moments);
        if hidden < least {
            (best, least) = (view, hidden);
        }
        if least <= HIDDEN {
            break;
        }
    }
    Some(best)
}

/// Size along x, y and z of everything that is drawn, in the ground's frame.
fn extent(film: &Film, moments: &[FrameState]) -> Vector3<f64> {
    let (drawn, to_ground) = (drawn(film), film.to_ground());
    let (mut low, mut high) = (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY));
    for moment in moments {
        for (drawn_body, pose) in drawn.iter().zip(moment.poses.iter().chain([&to_ground])) {
            for place in drawn_body.places(pose) {
                (low, high) = (low.inf(&place), high.sup(&place));
            }
        }
    }
    high - low
}

/// Indices of the moving bodies, or of all if none moves.
fn moving(drawn: &[DrawnBody], moments: &[FrameState]) -> Vec<usize> {
    let first = &moments[0].poses;
    let moves = |b: &usize| {
        let travel = |moment: &FrameState| {
            let (from, to) = (&first[*b], &moment.poses[*b]);
            let turn = 2.0 * (from.rotation.angle_to(&to.rotation) / 2.0).sin();
            let shift = (to.translation.vector - from.translation.vector).norm();
            shift + turn * drawn[*b].reach
        };
        moments.iter().any(|moment| travel(moment) > UNMOVED * drawn[*b].reach)
    };
    let moving: Vec<usize> = (0..first.len()).filter(moves).collect();
    if moving.is_empty() { (0..first.len()).collect() } else { moving }
}

/// Window of each frame for the moving bodies, and their mean distance from the camera (m).
fn framed(
    camera: &Camera,
    drawn: &[DrawnBody],
    moments: &[FrameState],
    has_ground: bool,
) -> (Vec<Window>, f64) {
    let moving = moving(drawn, moments);
    let (mut reach, mut distance) = (0.0f64, 0.0);
    let extents: Vec<_> = moments
        .iter()
        .map(|moment| {
            moving.iter().fold(ViewExtent::NONE, |extent, &b| {
                let pose = &moment.poses[b];
                let (_, w) = camera.slopes(&pose.translation.vector);
                reach = reach.max(drawn[b].reach * w);
                distance += 1.0 / w;
                let places = drawn[b].places(pose).map(|place| camera.slopes(&place).0);
                places.fold(extent, ViewExtent::with)
            })
        })
        .collect();
    // Smoothed in space, since perspective bends straight motion in the view.
    let middle = |moment: &FrameState| -> [f64; 3] {
        let places = moving.iter().map(|&b| moment.poses[b].translation.vector);
        (places.sum::<Vector3<f64>>() / moving.len() as f64).into()
    };
    let middles: Vec<_> = moments.iter().map(middle).collect();
    let in_view = |place: &[f64; 3]| camera.slopes(&Vector3::from(*place)).0;
    let followed: Vec<_> =
        middles.iter().zip(smooth(&middles)).map(|(at, to)| [in_view(at), in_view(&to)]).collect();
    let distance = distance / (moments.len() * moving.len()) as f64;
    (windows(&extents, reach, &followed, has_ground), distance)
}

/// Bodies, then all fixed objects as one.
fn drawn(film: &Film) -> Vec<DrawnBody> {
    let drawn_body = |shapes: Vec<Shape>, colour: Rgb, reach, label: &str| {
        let spans = shapes.iter().map(Shape::span).collect();
        let casters = shapes.iter().map(Shape::surface_points).collect();
        let looks = shapes.into_iter().map(Look::new).collect();
        let (hue, label) = (Hue::from_rgb(colour), label.to_owned());
        DrawnBody { looks, spans, casters, hue, bones: Vec::new(), reach, label }
    };
    let bodies =
        film.bodies.iter().zip(palette::body_colours(film)).map(|(body, colour)| {
            drawn_body(body.shapes.clone(), colour, body.reach(), &body.label)
        });
    let still: Vec<_> = film.fixed.iter().flat_map(|fixed| &fixed.shapes).cloned().collect();
    let points: Vec<Vector3<f64>> = still.iter().flat_map(Shape::span).collect();
    let middle = points.iter().sum::<Vector3<f64>>() / points.len().max(1) as f64;
    let reach = points.iter().map(|point| (point - middle).norm()).fold(0.0, f64::max);
    // The edge offset scales with the size. That of a body suits pieces of its size.
    let reach = film.bodies.iter().map(Object::reach).fold(reach, f64::min);
    let mut all: Vec<_> = bodies.chain([drawn_body(still, palette::STILL, reach, "")]).collect();
    for bone in skeleton::bones(film) {
        all[bone.body].bones.push(bone);
    }
    all
}
