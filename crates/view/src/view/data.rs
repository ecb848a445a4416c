//! Data of the page, serialised as JSON.

use super::curves::{Plot, plots};
use super::encode::{PackedNumbers, packed, packed_rows};
use super::facts;
use super::poses::{EncodedPoses, digit};
use crate::animation;
use crate::film::{Fact, Film, FilmFixed, FilmJoint, Status, Takeover};
use crate::forces::Scale;
use crate::palette::{self, css};
use crate::plot::PlotSheet;
use crate::shape::{FilmMesh, FilmPiece, Outline, is_box};
use crate::skeleton::{self, Bone};
use nalgebra::Vector3;
use serde::Serialize;

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
    facts: Vec<Fact>,
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
    bones: Vec<BoneData>,
    arrows: Arrows,
    ground: Option<PageGround>,
    view: PageView,
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
    /// True if the points are the corners of a box, x fastest.
    is_box: bool,
    /// Points (m), body frame, or world frame for fixed objects.
    points: Vec<[f64; 3]>,
    /// Drawn pieces; empty for a body of points.
    pieces: Vec<PieceData>,
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
    anchor: [f64; 3],
    axis: Option<[f64; 3]>,
}

/// Line on a body (m), in its frame.
#[derive(Serialize)]
struct BoneData {
    body: usize,
    from: [f64; 3],
    to: [f64; 3],
}

/// Lengths of force arrows, see [`Scale`].
#[derive(Serialize)]
struct Arrows {
    weight: f64,
    longest: f64,
}

/// Plane n · x = d, world frame.
#[derive(Serialize)]
struct PageGround {
    normal: [f64; 3],
    offset: f64,
}

/// Initial view direction (degrees), that of the animation.
#[derive(Serialize)]
struct PageView {
    azimuth: f64,
    elevation: f64,
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
    pub fn of(version: &str, films: &[&Film]) -> Self {
        let mut sheets: Vec<_> =
            [PlotSheet::Motion, PlotSheet::Energy].map(|sheet| SheetData::of(sheet, films)).into();
        if let [a, b] = films {
            let plots = vec![super::distance::plot(a, b)];
            let others = Vec::new();
            sheets.insert(0, SheetData { name: "Difference", of_body: false, plots, others });
        }
        Self {
            version: version.to_owned(),
            statuses: Status::ALL.map(Status::name).into(),
            runs: films.iter().map(|film| RunData::of(film)).collect(),
            sheets,
        }
    }
}

impl SheetData {
    /// Sheet for one or two films, with the panels of the first.
    fn of(sheet: PlotSheet, films: &[&Film]) -> Self {
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
    fn of(name: String, facts: Vec<Fact>, points: &[Vector3<f64>], looks: &[Outline]) -> Self {
        let solids = looks.iter().filter_map(|look| match look {
            Outline::Solid(piece) => Some(PieceData::of(piece)),
            Outline::Points(_) => None,
        });
        Self {
            name,
            facts,
            is_box: is_box(points),
            points: points.iter().map(|&point| point.into()).collect(),
            pieces: solids.collect(),
            colour: String::new(),
            is_labelled: false,
            above: None,
        }
    }
}

impl PieceData {
    fn of(piece: &FilmPiece) -> Self {
        let face = |(face, normal): (&[usize], Vector3<f64>)| FaceData {
            vertices: face.to_vec(),
            normal: normal.into(),
        };
        let (mesh, colour) = match piece {
            FilmPiece::Mesh(mesh) => (Some(MeshData::of(mesh)), mesh.colour.map(css)),
            _ => (None, None),
        };
        let core = if mesh.is_some() { &[] } else { piece.core() };
        Self {
            vertices: core.iter().map(|&vertex| vertex.into()).collect(),
            faces: match piece {
                FilmPiece::Hull(hull) => hull.sides().map(face).collect(),
                _ => Vec::new(),
            },
            radius: piece.radius(),
            mesh,
            colour,
        }
    }
}

impl MeshData {
    fn of(mesh: &FilmMesh) -> Self {
        let largest = mesh.vertices.iter().map(|vertex| vertex.amax()).fold(0.0, f64::max);
        let along = (0..3).flat_map(|axis| mesh.vertices.iter().map(move |vertex| vertex[axis]));
        // Triangles of zero area have no normal.
        let triangles = mesh.sides().flat_map(|(triangle, _)| triangle.to_vec());
        Self {
            vertices: packed(along, digit(largest, 5)),
            triangles: packed_rows(triangles.collect::<Vec<_>>().into_iter()),
        }
    }
}

impl RunData {
    pub fn of(film: &Film) -> Self {
        let counts = Status::ALL[1..].iter().map(|status| {
            (status.name(), film.steps().iter().filter(|step| step.status == *status).count())
        });
        let (above, colours) = (skeleton::parents(film), palette::of_bodies(film));
        let body = |b: usize| {
            let body = &film.bodies[b];
            let facts = facts::of_body(film, b);
            let looks = Outline::of(&body.pieces, &body.points);
            PageBody {
                colour: css(colours[b]),
                is_labelled: !body.label.is_empty(),
                above: above[b],
                ..PageBody::of(film.name(b), facts, &body.points, &looks)
            }
        };
        let fixed = |fixed: &FilmFixed| {
            let looks: Vec<_> = fixed.pieces.iter().cloned().map(Outline::Solid).collect();
            PageBody::of(fixed.name.clone(), Vec::new(), &[], &looks)
        };
        let joint = |joint: &FilmJoint| JointData {
            name: joint.name.clone(),
            body: joint.body,
            anchor: joint.anchor.into(),
            axis: joint.axis.map(Into::into),
        };
        let bone =
            |Bone { body, from, to }: Bone| BoneData { body, from: from.into(), to: to.into() };
        let scale = Scale::of(film);
        let view = animation::usual_view(film);
        let ground = film
            .ground
            .map(|plane| PageGround { normal: plane.normal.into(), offset: plane.offset });
        Self {
            title: film.title.clone(),
            facts: facts::facts(film),
            takeover: film.takeover.clone(),
            rows: film.frames.len(),
            step: film.frame_time(),
            counts: counts.collect(),
            worst: worst(film),
            bodies: (0..film.bodies.len()).map(body).collect(),
            fixed: film.fixed.iter().map(fixed).collect(),
            joints: film.joints.iter().map(joint).collect(),
            bones: skeleton::bones(film).into_iter().map(bone).collect(),
            arrows: Arrows { weight: scale.weight, longest: scale.longest },
            ground,
            view: PageView { azimuth: view.azimuth, elevation: view.elevation },
            frames: EncodedPoses::of(film, &scale),
        }
    }
}

fn worst(film: &Film) -> Option<Worst> {
    let residuals = film.steps().iter().map(|step| step.residual).enumerate();
    // The first of equal residuals.
    residuals
        .reduce(|worst, other| if other.1 > worst.1 { other } else { worst })
        .map(|(row, residual)| Worst { row, residual })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn meshes_are_rounded_and_nothing_else_is() {
        let corner = |x: f64, y: f64, z: f64| Vector3::new(x, y, z) / 3.0;
        let vertices = vec![corner(1.0, 0.0, 0.0), corner(0.0, 2.0, 0.0), corner(0.0, 0.0, 1.0)];
        let triangles = vec![[0, 1, 2]];
        let mesh = PieceData::of(&FilmPiece::Mesh(FilmMesh {
            vertices: vertices.clone(),
            triangles,
            colour: Some([1, 2, 255]),
        }));
        assert_eq!(mesh.colour.as_deref(), Some("#0102ff"));
        assert!(mesh.vertices.is_empty() && mesh.faces.is_empty());
        let packed = mesh.mesh.unwrap();
        let steps: Vec<_> = packed.vertices.unpacked().into_iter().flatten().collect();
        // Thirds in units of 1e-5.
        assert_eq!(steps, [33333, 0, 0, 0, 66667, 0, 0, 0, 33333]);
        let corners: Vec<_> = packed.triangles.unpacked().into_iter().flatten().collect();
        assert_eq!(corners, [0, 1, 2]);
        let ball = PieceData::of(&FilmPiece::Sphere { centre: vertices[0], radius: 0.1 });
        assert!(ball.mesh.is_none() && ball.vertices[0] == <[f64; 3]>::from(vertices[0]));
    }
}
