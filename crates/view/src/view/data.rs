//! Data of the page, serialised as JSON.

use super::curves::{Plot, plots};
use super::encode::{PackedNumbers, packed, packed_rows};
use super::facts;
use super::poses::{EncodedPoses, digit};
use crate::animation::{self, View};
use crate::film::{Fact, Film, Object, Takeover, axis};
use crate::forces::Scale;
use crate::palette::{self, css};
use crate::plot::PlotSheet;
use crate::shape::{Mesh, Shape, Side};
use crate::skeleton::{self, Bone};
use nalgebra::Vector3;
use serde::Serialize;
use tumble_core::joint::Joint;
use tumble_core::step::StepStatus;

#[derive(Serialize)]
pub struct PageData {
    version: String,
    statuses: Vec<&'static str>,
    runs: Vec<RunData>,
    sheets: Vec<SheetData>,
}

#[derive(Serialize)]
pub struct RunData {
    title: String,
    /// Scene: bodies, mass, friction.
    facts: Vec<Fact>,
    /// Solver, rows and versions.
    record: Vec<Fact>,
    /// First body that moves.
    first: usize,
    takeover: Option<Takeover>,
    rows: usize,
    /// Time between frames (s).
    step: f64,
    /// Number of steps with each status.
    counts: Vec<(&'static str, usize)>,
    worst: Option<Worst>,
    bodies: Vec<PageBody>,
    fixed: Vec<PageBody>,
    joints: Vec<JointData>,
    bones: Vec<Bone>,
    arrows: Scale,
    ground: Option<PageGround>,
    /// Gravity (m/s²).
    gravity: [f64; 3],
    view: View,
    frames: EncodedPoses,
}

/// Step with the largest residual.
#[derive(Serialize)]
struct Worst {
    row: usize,
    residual: f64,
}

#[derive(Serialize)]
struct PageBody {
    name: String,
    /// Description.
    facts: Vec<Fact>,
    /// Contact points (m), body frame, of a body that is drawn as points.
    points: Vec<[f64; 3]>,
    /// Drawn pieces; empty for a body of points.
    pieces: Vec<PieceData>,
    /// Pieces that touch others, if they are not the drawn ones.
    collision: Vec<PieceData>,
    /// CSS colour; empty for fixed objects.
    colour: String,
    /// True if the body has a label, which is shown at it.
    is_labelled: bool,
    /// Parent in the tree of joints.
    above: Option<usize>,
}

/// All points within `radius` of a polyhedron. Without faces the core is a segment or a point.
#[derive(Serialize)]
struct PieceData {
    vertices: Vec<[f64; 3]>,
    faces: Vec<FaceData>,
    radius: f64,
    /// Mesh instead of vertices and faces.
    mesh: Option<MeshData>,
    /// CSS colour of the piece, if it differs from that of its body.
    colour: Option<String>,
}

/// Triangles for drawing only.
#[derive(Serialize)]
struct MeshData {
    /// Coordinates to five digits of the largest: x of all vertices, then y and z.
    vertices: PackedNumbers,
    /// Vertex indices, three per triangle, counter-clockwise seen from outside.
    triangles: PackedNumbers,
}

#[derive(Serialize)]
struct FaceData {
    vertices: Vec<usize>,
    /// Outward unit normal.
    normal: [f64; 3],
}

/// Anchor (m) and axis of a joint, in the frame of the body.
#[derive(Serialize)]
struct JointData {
    name: String,
    body: usize,
    /// Second body; `None` for the world.
    other: Option<usize>,
    anchor: [f64; 3],
    axis: Option<[f64; 3]>,
}

/// Plane n · x = d, world frame.
#[derive(Serialize)]
struct PageGround {
    normal: [f64; 3],
    offset: f64,
}

#[derive(Serialize)]
struct SheetData {
    name: &'static str,
    /// True if the plots show one of several bodies.
    of_body: bool,
    /// Plots of the first body, or of all.
    plots: Vec<Plot>,
    /// Plots of the bodies after the first.
    others: Vec<Vec<Plot>>,
}

impl PageData {
    pub fn new(version: &str, films: &[&Film]) -> Self {
        let mut sheets: Vec<_> =
            [PlotSheet::Motion, PlotSheet::Energy].map(|sheet| SheetData::new(sheet, films)).into();
        if let [a, b] = films {
            let plots = vec![super::distance::plot(a, b)];
            let others = Vec::new();
            sheets.insert(0, SheetData { name: "Difference", of_body: false, plots, others });
        }
        Self {
            version: version.to_owned(),
            statuses: StepStatus::ALL.map(StepStatus::name).into(),
            runs: films.iter().map(|film| RunData::new(film, Scale::from_films(films))).collect(),
            sheets,
        }
    }
}

impl SheetData {
    /// Sheet for one or two films, with the panels of the first.
    fn new(sheet: PlotSheet, films: &[&Film]) -> Self {
        let makers = sheet.panels(films[0]);
        let of_body = sheet.is_of_one_body();
        let fewest = films.iter().map(|film| film.bodies.len()).min().unwrap_or(1);
        let bodies = if of_body { fewest } else { 1 };
        Self {
            name: sheet.name(),
            of_body,
            plots: plots(films, makers, 0, bodies),
            others: (1..bodies).map(|body| plots(films, makers, body, bodies)).collect(),
        }
    }
}

impl PageBody {
    fn new(name: String, facts: Vec<Fact>, shapes: &[Shape]) -> Self {
        let mut body = Self {
            name,
            facts,
            points: Vec::new(),
            pieces: Vec::new(),
            collision: Vec::new(),
            colour: String::new(),
            is_labelled: false,
            above: None,
        };
        for shape in shapes {
            match shape {
                Shape::Points(points) => body.points.extend(points.iter().map(arrayed)),
                solid => body.pieces.push(PieceData::new(solid)),
            }
        }
        body
    }
}

fn arrayed(place: &Vector3<f64>) -> [f64; 3] {
    (*place).into()
}

impl PieceData {
    fn new(shape: &Shape) -> Self {
        if let Shape::Mesh(mesh) = shape {
            let (mesh, colour) = (Some(MeshData::new(mesh)), mesh.colour.map(css));
            return Self { vertices: Vec::new(), faces: Vec::new(), radius: 0.0, mesh, colour };
        }
        let face = |(vertices, normal): Side| FaceData { vertices, normal: normal.into() };
        Self {
            vertices: shape.core().iter().map(arrayed).collect(),
            faces: shape.sides().into_iter().map(face).collect(),
            radius: shape.radius(),
            mesh: None,
            colour: None,
        }
    }
}

impl MeshData {
    fn new(mesh: &Mesh) -> Self {
        let largest = mesh.vertices.iter().map(|vertex| vertex.amax()).fold(0.0, f64::max);
        let along = (0..3).flat_map(|axis| mesh.vertices.iter().map(move |vertex| vertex[axis]));
        // Triangles of zero area have no normal.
        let triangles = mesh.sides().flat_map(|(triangle, _)| triangle);
        Self {
            vertices: packed(along, digit(largest, 5)),
            triangles: packed_rows(triangles.collect::<Vec<_>>().into_iter()),
        }
    }
}

impl RunData {
    /// Data of a film whose arrows have the lengths of `scale`.
    pub fn new(film: &Film, scale: Scale) -> Self {
        let steps = StepStatus::ALL.iter().filter(|status| **status != StepStatus::End);
        let counts = steps.map(|status| {
            (status.name(), film.steps().iter().filter(|step| step.row.status == *status).count())
        });
        let (above, colours) = (skeleton::parents(film), palette::body_colours(film));
        let body = |b: usize| {
            let body = &film.bodies[b];
            let touching = Shape::from_body(&film.world.bodies()[b]);
            let touching = if touching == body.shapes { &[][..] } else { &touching };
            PageBody {
                collision: PageBody::new(String::new(), Vec::new(), touching).pieces,
                colour: css(colours[b]),
                is_labelled: !body.label.is_empty(),
                above: above[b],
                ..PageBody::new(film.name(b), facts::body_facts(film, b), &body.shapes)
            }
        };
        let fixed = |fixed: &Object| PageBody::new(fixed.name.clone(), Vec::new(), &fixed.shapes);
        let joint = |(name, joint): (&String, &Joint)| JointData {
            name: name.clone(),
            body: joint.body(),
            other: joint.other(),
            anchor: joint.frames()[0].anchor.into(),
            axis: axis(joint).map(Into::into),
        };
        let ground = film.ground.as_ref();
        let ground = ground
            .map(|plane| PageGround { normal: arrayed(plane.normal()), offset: plane.offset() });
        Self {
            title: film.title.clone(),
            facts: facts::scene_facts(film),
            record: facts::record_facts(film),
            first: film.first_moving(),
            takeover: film.takeover.clone(),
            rows: film.frames.len(),
            step: film.frame_time(),
            counts: counts.collect(),
            worst: worst(film),
            bodies: (0..film.bodies.len()).map(body).collect(),
            fixed: film.fixed.iter().map(fixed).collect(),
            joints: film.joints.iter().zip(film.world.joints()).map(joint).collect(),
            bones: skeleton::bones(film),
            frames: EncodedPoses::new(film, &scale),
            arrows: scale,
            ground,
            gravity: arrayed(film.world.gravity()),
            view: animation::usual_view(film),
        }
    }
}

fn worst(film: &Film) -> Option<Worst> {
    let residuals = film.steps().iter().map(|step| step.row.residual).enumerate();
    // The first of equal residuals.
    residuals
        .reduce(|worst, other| if other.1 > worst.1 { other } else { worst })
        .map(|(row, residual)| Worst { row, residual })
}

#[cfg(test)]
#[path = "tests/data.rs"]
mod tests;
