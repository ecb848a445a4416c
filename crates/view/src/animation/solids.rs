//! Drawing of pieces: polyhedra and meshes with smooth shading, balls, capsules.

use super::camera::Camera;
use super::camera::Spot;
use super::floor::Light;
use super::outline::hull;
use super::palette::Hue;
use super::raster::Raster;
use crate::shape::{Mesh, Shape, Surface};
use nalgebra::{Isometry3, Point3, Vector3};

/// Offset of edges towards the camera, over the size of the body. It keeps faces from covering
/// them.
const LIFT: f64 = 0.02;

/// Half width of the great circles on balls, over the radius, and their light over the surface's.
const SEAM: f64 = 0.035;
const SEAM_SHADE: f32 = 0.75;
/// Light of edges over that of the darker face.
const EDGE_SHADE: f32 = 0.6;

/// Shape with what is constant over all frames.
pub struct Look {
    pub shape: Shape,
    surface: Surface,
    /// Colour that differs from that of the body.
    hue: Option<Hue>,
}

impl Look {
    pub fn new(shape: Shape) -> Self {
        Self { surface: Surface::from_shape(&shape), hue: shape.colour().map(Hue::from_rgb), shape }
    }
}

/// Context for painting one body.
pub struct Canvas3d<'a> {
    pub raster: &'a mut Raster,
    pub camera: &'a Camera,
    pub light: Light,
    /// Scale of the picture relative to 800 pixels.
    pub unit: f64,
    pub hue: &'a Hue,
    /// Size of the body (m).
    pub reach: f64,
}

impl<'a> Canvas3d<'a> {
    /// Paints a shape at `pose` in the ground's frame.
    pub fn look(&mut self, look: &'a Look, pose: &Isometry3<f64>) {
        let usual = self.hue;
        self.hue = look.hue.as_ref().unwrap_or(usual);
        match &look.shape {
            Shape::Points(points) => self.points(points, pose),
            Shape::Mesh(mesh) => self.mesh(mesh, &look.surface, pose),
            Shape::Convex { core, radius, .. } => match *core.vertices() {
                [centre] => self.round([centre; 2], *radius, pose, true),
                [from, to] => self.round([from, to], *radius, pose, false),
                _ => self.hull(core.vertices(), *radius, &look.surface, pose),
            },
        }
        self.hue = usual;
    }

    fn hull(
        &mut self,
        vertices: &[Vector3<f64>],
        radius: f64,
        surface: &Surface,
        pose: &Isometry3<f64>,
    ) {
        let eye = self.camera.eye();
        let places = placed(vertices, pose);
        let mut lights = vec![None; surface.faces.len()];
        for (face, light_of_face) in surface.faces.iter().zip(&mut lights) {
            let normal = pose.rotation * face.normal;
            // Faces of a rounded hull are its radius outside the core.
            let out = normal * radius;
            if normal.dot(&(eye - places[face.corners[0]] - out)) <= 0.0 {
                continue;
            }
            let spots: Vec<_> =
                face.corners.iter().map(|&i| self.camera.spot(&(places[i] + out))).collect();
            // The faces of a rounded hull are flat between their round edges.
            let normals = face
                .normals
                .iter()
                .map(|smooth| if radius > 0.0 { normal } else { pose.rotation * smooth });
            let shades: Vec<_> = normals.map(|normal| self.lit(&normal)).collect();
            self.raster.polygon(&spots, self.hue, &shades);
            *light_of_face = Some(self.lit(&normal));
        }
        // Edges of a rounded hull are drawn once, from their smaller vertex.
        if radius > 0.0 {
            for face in &surface.faces {
                for k in 0..face.corners.len() {
                    let [a, b] = [k, (k + 1) % face.corners.len()].map(|k| face.corners[k]);
                    let ends = [vertices[a], vertices[b]];
                    if a < b {
                        self.round(ends, radius, pose, false);
                    }
                }
            }
            return;
        }
        // Creases between visible faces
        for ([a, b], faces) in &surface.creases {
            let light_of_face = faces.iter().filter_map(|face| lights[*face]);
            let Some(light) = light_of_face.reduce(f32::min) else { continue };
            let ends = [self.lifted(&places[*a]), self.lifted(&places[*b])];
            self.raster.line(ends[0], ends[1], 1.3 * self.unit, self.hue.lit(EDGE_SHADE * light));
        }
    }

    /// Paints triangles from both sides. The depth buffer resolves visibility.
    fn mesh(&mut self, mesh: &Mesh, surface: &Surface, pose: &Isometry3<f64>) {
        let eye = self.camera.eye();
        let places = placed(&mesh.vertices, pose);
        let spots: Vec<_> = places.iter().map(|place| self.camera.spot(place)).collect();
        for face in &surface.faces {
            let away = (pose.rotation * face.normal).dot(&(eye - places[face.corners[0]])) < 0.0;
            let side = if away { -1.0 } else { 1.0 };
            let shade = |normal: &Vector3<f64>| self.lit(&(pose.rotation * normal * side));
            let lights: Vec<_> = face.normals.iter().map(shade).collect();
            let corners: Vec<_> = face.corners.iter().map(|&i| spots[i]).collect();
            self.raster.polygon(&corners, self.hue, &lights);
        }
    }

    /// Paints a line on a body, in its frame.
    pub fn rod(&mut self, ends: [Vector3<f64>; 2], pose: &Isometry3<f64>, colour: [u8; 3]) {
        let [a, b] = ends.map(|end| self.camera.spot(&(pose * Point3::from(end)).coords));
        self.raster.line(a, b, 4.0 * self.unit, colour);
    }

    /// Paints a capsule. Great circles show the rotation of a ball if `is_marked`.
    fn round(
        &mut self,
        ends: [Vector3<f64>; 2],
        radius: f64,
        pose: &Isometry3<f64>,
        is_marked: bool,
    ) {
        if radius.is_nan() || radius <= 0.0 {
            return;
        }
        let (camera, light, hue) = (self.camera, self.light, self.hue);
        let eye = camera.eye();
        let [a, b] = ends.map(|end| (pose * Point3::from(end)).coords);
        let spots = [a, b].map(|end| camera.spot(&end));
        // The outline of a near ball is wider than the projected radius at its centre.
        let margin = spots.map(|spot| camera.pixels(radius, spot) * 1.1 + 2.0);
        let middle = (a + b) / 2.0;
        let forward = camera.forward();
        self.raster.trace(camera, spots, margin[0].max(margin[1]), |ray| {
            let (distance, core) = capsule_hit(&eye, ray, &a, &b, radius)?;
            let point = eye + ray * distance;
            let normal = (point - core) / radius;
            let own = pose.inverse_transform_vector(&(point - middle)) / radius;
            let is_seam = is_marked && (own.x.abs() < SEAM || own.z.abs() < SEAM);
            let shade = if is_seam { SEAM_SHADE } else { 1.0 };
            Some((distance * ray.dot(&forward), hue.lit(shade * lit(&normal, light))))
        });
    }

    fn points(&mut self, points: &[Vector3<f64>], pose: &Isometry3<f64>) {
        let spots: Vec<_> =
            placed(points, pose).iter().map(|place| self.camera.spot(place)).collect();
        let outline = hull(&spots);
        self.raster.polygon(&outline, self.hue, &vec![1.0; outline.len()]);
        let lift = |spot: Spot| [spot[0], spot[1], self.raised(spot[2])];
        let outline: Vec<_> = outline.into_iter().map(lift).collect();
        let dots: Vec<_> = spots.iter().copied().map(lift).collect();
        let edge = self.hue.lit(0.3);
        for k in 0..outline.len() {
            let next = outline[(k + 1) % outline.len()];
            self.raster.line(outline[k], next, 2.2 * self.unit, edge);
        }
        for dot in dots {
            self.raster.line(dot, dot, 8.0 * self.unit, edge);
        }
    }

    fn lifted(&self, place: &Vector3<f64>) -> Spot {
        let [x, y, w] = self.camera.spot(place);
        [x, y, self.raised(w)]
    }

    /// Depth moved slightly towards the camera.
    fn raised(&self, w: f64) -> f64 {
        1.0 / (1.0 / w - LIFT * self.reach).max(1e-3 / w)
    }

    fn lit(&self, normal: &Vector3<f64>) -> f32 {
        lit(normal, self.light)
    }
}

fn placed(points: &[Vector3<f64>], pose: &Isometry3<f64>) -> Vec<Vector3<f64>> {
    points.iter().map(|point| (pose * Point3::from(*point)).coords).collect()
}

/// Light reflected by a white surface, from a lamp and from the sky. The ground reflects half of
/// the light. The numbers are those of the page (`light.js`) over π.
fn lit(normal: &Vector3<f64>, light: Light) -> f32 {
    let lamp = normal.dot(&light.direction()).max(0.0);
    let sky = 0.5 + 0.5 * normal.z;
    (0.68 * lamp + 0.65 * (0.45 + 0.55 * sky)) as f32
}

/// First point of the ray eye + t · direction, t > 0, on the capsule of `radius` about the segment from a
/// to b. Returns t and the nearest point of the segment.
///
/// The candidates are the cylinder between the ends and the balls at the ends. The smallest t
/// counts, since the capsule is convex and the eye is outside.
fn capsule_hit(
    eye: &Vector3<f64>,
    direction: &Vector3<f64>,
    a: &Vector3<f64>,
    b: &Vector3<f64>,
    radius: f64,
) -> Option<(f64, Vector3<f64>)> {
    let first = |from: Vector3<f64>, along: Vector3<f64>| {
        // Solves |from + t along|² = radius².
        let (square, half) = (along.norm_squared(), from.dot(&along));
        let root = half * half - square * (from.norm_squared() - radius * radius);
        (root >= 0.0 && square > 0.0).then(|| (-half - root.sqrt()) / square).filter(|t| *t > 0.0)
    };
    let mut hits = [None; 3];
    hits[0] = first(eye - a, *direction).map(|t| (t, *a));
    let axis = b - a;
    if let Some(axis_direction) = axis.try_normalize(0.0) {
        hits[1] = first(eye - b, *direction).map(|t| (t, *b));
        let across = |v: Vector3<f64>| v - axis_direction * axis_direction.dot(&v);
        hits[2] = first(across(eye - a), across(*direction)).and_then(|t| {
            let along = axis_direction.dot(&(eye + direction * t - a));
            (0.0..=axis.norm()).contains(&along).then(|| (t, a + axis_direction * along))
        });
    }
    hits.into_iter().flatten().min_by(|a, b| a.0.total_cmp(&b.0))
}

#[cfg(test)]
#[path = "tests/solids.rs"]
mod tests;
