//! Data of the page, serialised as JSON.

use super::curves::{Plot, plots};
use super::facts;
use super::poses::{EncodedPoses, digit};
use crate::film::{Fact, Film, FilmFixed, FilmJoint, Status};
use crate::forces::Scale;
use crate::plot::PlotSheet;
use crate::shape::{FilmPiece, Outline, is_box};
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
struct RunData {
    title: String,
    facts: Vec<Fact>,
    rows: usize,
    /// Time between frames (s).
    step: f64,
    /// Number of steps with each status.
    counts: Vec<(&'static str, usize)>,
    worst: Option<Worst>,
    bodies: Vec<PageBody>,
    fixed: Vec<PageBody>,
    joints: Vec<JointData>,
    arrows: Arrows,
    ground: Option<PageGround>,
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
    /// CSS colour, if the body has its own.
    colour: Option<String>,
    /// Parent in the tree of joints.
    above: Option<usize>,
}

/// All points within `radius` of a polyhedron. Without faces the core is a segment or a point. A
/// mesh has triangles as faces.
#[derive(Serialize)]
struct PieceData {
    vertices: Vec<[f64; 3]>,
    faces: Vec<FaceData>,
    radius: f64,
    is_mesh: bool,
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
    /// Sheet for one or two films. Films with a single body show its corners. If a film has more
    /// bodies, only the panels common to all films are shown.
    fn of(sheet: PlotSheet, films: &[&Film]) -> Self {
        let widest = films.iter().copied().find(|film| !film.is_single()).unwrap_or(films[0]);
        let makers = sheet.panels(widest);
        let of_body = sheet.is_of_one_body() && !widest.is_single();
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
            colour: None,
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
        let is_mesh = matches!(piece, FilmPiece::Mesh(_));
        let mut made = Self {
            vertices: piece.core().iter().map(|&vertex| vertex.into()).collect(),
            faces: match piece {
                FilmPiece::Hull(hull) => hull.sides().map(face).collect(),
                FilmPiece::Mesh(mesh) => mesh.sides().map(face).collect(),
                FilmPiece::Sphere { .. } | FilmPiece::Capsule { .. } => Vec::new(),
            },
            radius: piece.radius(),
            is_mesh,
        };
        if is_mesh {
            made.shorten();
        }
        made
    }

    /// Reduces the precision of drawn geometry: positions to five digits of the largest, normals to
    /// 1e-3.
    fn shorten(&mut self) {
        let round = |x: &mut f64, per: f64| *x = (*x * per).round() / per;
        let largest = self.vertices.iter().flatten().fold(0.0, |most: f64, x| most.max(x.abs()));
        let per = (1.0 / digit(largest, 5)).round().max(1.0);
        self.vertices.iter_mut().flatten().for_each(|x| round(x, per));
        self.faces.iter_mut().flat_map(|face| &mut face.normal).for_each(|x| round(x, 1e3));
    }
}

/// Parent of each body: the first body that a joint ties it to without closing a loop.
fn tree(film: &Film) -> Vec<Option<usize>> {
    let mut above = vec![None; film.bodies.len()];
    for FilmJoint { body, other, .. } in &film.joints {
        let (Some(other), None) = (*other, above[*body]) else { continue };
        let mut ways = std::iter::successors(Some(other), |place| above[*place]);
        if ways.all(|place| place != *body) {
            above[*body] = Some(other);
        }
    }
    above
}

impl RunData {
    fn of(film: &Film) -> Self {
        let counts = Status::ALL[1..].iter().map(|status| {
            (status.name(), film.steps().iter().filter(|step| step.status == *status).count())
        });
        let above = tree(film);
        let body = |b: usize| {
            let body = &film.bodies[b];
            let facts = if film.is_single() { Vec::new() } else { facts::of_body(film, b) };
            let css = |[red, green, blue]: [u8; 3]| format!("#{red:02x}{green:02x}{blue:02x}");
            let colour = body.colour.map(css);
            let looks = Outline::of(&body.pieces, &body.points);
            PageBody {
                colour,
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
        let scale = Scale::of(film);
        let ground = film
            .ground
            .map(|plane| PageGround { normal: plane.normal.into(), offset: plane.offset });
        Self {
            title: film.title.clone(),
            facts: facts::facts(film),
            rows: film.frames.len(),
            step: film.frame_time(),
            counts: counts.collect(),
            worst: worst(film),
            bodies: (0..film.bodies.len()).map(body).collect(),
            fixed: film.fixed.iter().map(fixed).collect(),
            joints: film.joints.iter().map(joint).collect(),
            arrows: Arrows { weight: scale.weight, longest: scale.longest },
            ground,
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
    use crate::samples::floating_cube;
    use crate::shape::FilmMesh;

    #[test]
    fn joints_are_a_tree_whatever_rings_they_close() {
        let mut film = floating_cube(1);
        film.bodies = vec![film.bodies[0].clone(); 4];
        let joint = |body: usize, other: Option<usize>| FilmJoint {
            name: String::new(),
            body,
            other,
            anchor: Vector3::zeros(),
            axis: None,
            turns: false,
            slides: false,
        };
        film.joints = vec![
            joint(3, None),
            joint(1, Some(0)),
            joint(2, Some(1)),
            joint(2, Some(0)),
            joint(0, Some(2)),
            joint(3, Some(3)),
        ];
        assert_eq!(tree(&film), [None, Some(0), Some(1), None]);
    }

    #[test]
    fn meshes_are_rounded_and_nothing_else_is() {
        let corner = |x: f64, y: f64, z: f64| Vector3::new(x, y, z) / 3.0;
        let vertices = vec![corner(1.0, 0.0, 0.0), corner(0.0, 2.0, 0.0), corner(0.0, 0.0, 1.0)];
        let triangles = vec![[0, 1, 2]];
        let mesh =
            PieceData::of(&FilmPiece::Mesh(FilmMesh { vertices: vertices.clone(), triangles }));
        assert!(mesh.is_mesh && mesh.faces.len() == 1);
        assert_eq!(mesh.vertices, [[0.33333, 0.0, 0.0], [0.0, 0.66667, 0.0], [0.0, 0.0, 0.33333]]);
        assert_eq!(mesh.faces[0].normal, [0.667, 0.333, 0.667]);
        let ball = PieceData::of(&FilmPiece::Sphere { centre: vertices[0], radius: 0.1 });
        assert!(!ball.is_mesh && ball.vertices[0] == <[f64; 3]>::from(vertices[0]));
    }
}
