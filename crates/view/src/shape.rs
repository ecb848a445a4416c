//! Drawn geometry: convex shapes, meshes or contact points.

use nalgebra::Vector3;
use std::collections::BTreeMap;
use std::f64::consts::PI;
use tumble_core::geometry::{Ellipsoid, Hull, Piece, Smooth};
use tumble_core::mechanics::RigidBody;

/// Geometry of a body or fixed object. Lengths are in m.
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    /// All points within `radius` of a polyhedron, a segment or a point.
    Convex {
        /// Polyhedron, segment or point.
        core: Hull,
        /// Rounding radius; 0 for sharp edges.
        radius: f64,
        /// Description of the smooth shape that the polyhedron approximates.
        name: Option<String>,
    },
    /// A mesh for drawing only.
    Mesh(Mesh),
    /// Contact points, drawn with their convex outline.
    Points(Vec<Vector3<f64>>),
}

/// Triangle mesh, which may be open and non-convex.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Mesh {
    /// Vertices of the triangles.
    pub vertices: Vec<Vector3<f64>>,
    /// Indices into [`Mesh::vertices`], counter-clockwise seen from outside.
    pub triangles: Vec<[usize; 3]>,
    /// Red, green and blue. `None` for the colour of its body.
    pub colour: Option<[u8; 3]>,
}

/// Number of corners on a drawn disc, and on each circle of latitude of an ellipsoid.
const DISC_CORNERS: usize = 40;

impl From<&Piece> for Shape {
    /// A smooth shape becomes a polyhedron with many faces.
    fn from(piece: &Piece) -> Self {
        let drawn = |smooth: &Smooth| {
            let core = Hull::from_points(&smooth.samples(DISC_CORNERS)).ok()?;
            Some(Self::Convex { core, radius: 0.0, name: Some(description(smooth)) })
        };
        let exact =
            || Self::Convex { core: piece.core().clone(), radius: piece.radius(), name: None };
        piece.smooth().and_then(drawn).unwrap_or_else(exact)
    }
}

/// Description of a smooth shape.
fn description(smooth: &Smooth) -> String {
    let size =
        |length: f64| format!("{length:.4}").trim_end_matches('0').trim_end_matches('.').to_owned();
    let radius = |disc: &Ellipsoid| size(disc.axes.column(0).norm());
    match smooth {
        Smooth::Cylinder([from, to]) => {
            let length = size((to.centre - from.centre).norm());
            format!("cylinder of radius {} m and length {length} m", radius(from))
        }
        Smooth::Cone { base, apex: (_, apex) } => {
            let height = size((apex - base.centre).norm());
            format!("cone of radius {} m and height {height} m", radius(base))
        }
        Smooth::Ellipsoid(one) => {
            let [a, b, c] = [0, 1, 2].map(|axis| size(one.axes.column(axis).norm()));
            format!("ellipsoid with half axes {a} × {b} × {c} m")
        }
    }
}

/// Corners of a face, in order, and its outward unit normal.
pub(crate) type Side = (Vec<usize>, Vector3<f64>);

impl Shape {
    /// Shapes of the pieces of a body. Without pieces they are its contact points, or the box whose
    /// corners these are.
    pub(crate) fn from_body(body: &RigidBody) -> Vec<Self> {
        if body.pieces().is_empty() {
            let points = body.contact_points().iter().map(|point| point.position);
            return vec![Self::from_points(points.collect())];
        }
        body.pieces().iter().map(Self::from).collect()
    }

    /// Box with the corners `points`, x fastest, or else the points.
    pub(crate) fn from_points(points: Vec<Vector3<f64>>) -> Self {
        let hull = if is_box(&points) { Hull::from_points(&points).ok() } else { None };
        match hull {
            Some(core) => Self::Convex { core, radius: 0.0, name: None },
            None => Self::Points(points),
        }
    }

    /// Vertices of the core or of the mesh, or the points.
    pub(crate) fn core(&self) -> &[Vector3<f64>] {
        match self {
            Self::Convex { core, .. } => core.vertices(),
            Self::Mesh(mesh) => &mesh.vertices,
            Self::Points(points) => points,
        }
    }

    /// Colour that differs from that of the body.
    pub(crate) fn colour(&self) -> Option<[u8; 3]> {
        if let Self::Mesh(mesh) = self { mesh.colour } else { None }
    }

    /// Rounding radius about the core (m).
    pub(crate) fn radius(&self) -> f64 {
        if let Self::Convex { radius, .. } = self { *radius } else { 0.0 }
    }

    /// Faces of a polyhedron, or triangles of a mesh but those of zero area. Other shapes have
    /// none.
    pub(crate) fn sides(&self) -> Vec<Side> {
        match self {
            Self::Convex { core, .. } => {
                let faces = core.faces().iter().enumerate().map(|(index, face)| {
                    let corners = core.face_loop(index).iter();
                    (corners.map(|corner| corner.vertex as usize).collect(), face.normal)
                });
                faces.collect()
            }
            Self::Mesh(mesh) => mesh.sides().collect(),
            Self::Points(_) => Vec::new(),
        }
    }

    /// Points whose convex hull contains the drawn geometry.
    pub(crate) fn span(&self) -> Vec<Vector3<f64>> {
        let radius = self.radius();
        if radius == 0.0 {
            return self.core().to_vec();
        }
        let side = |i: usize| {
            Vector3::from_fn(|axis, _| if i >> axis & 1 == 1 { radius } else { -radius })
        };
        self.core().iter().flat_map(|core| (0..8).map(move |i| core + side(i))).collect()
    }

    /// Points on the drawn geometry, whose convex hull is close to it.
    pub(crate) fn surface_points(&self) -> Vec<Vector3<f64>> {
        let (core, radius) = (self.core(), self.radius());
        if radius == 0.0 {
            return core.to_vec();
        }
        let count = (MAX_DIRECTIONS / core.len().max(1)).max(MIN_DIRECTIONS);
        let directions: Vec<_> = directions(count).collect();
        core.iter()
            .flat_map(|core| directions.iter().map(move |direction| core + direction * radius))
            .collect()
    }
}

/// Cosine of the smallest angle between faces with a visible edge (30°). Faces with smaller angles
/// approximate a round shape.
const CREASE: f64 = 0.866;

/// Faces with smooth normals, and sharp edges.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Surface {
    pub faces: Vec<SurfaceFace>,
    /// Edges at folds and at the boundary, each with its faces.
    pub creases: Vec<([usize; 2], Vec<usize>)>,
}

#[derive(Debug, Clone, PartialEq)]
pub(crate) struct SurfaceFace {
    /// Indices of the vertices.
    pub corners: Vec<usize>,
    /// Outward unit normal.
    pub normal: Vector3<f64>,
    /// Unit normals at the corners: means over the faces that are not beyond a crease.
    pub normals: Vec<Vector3<f64>>,
}

impl Surface {
    pub fn from_shape(shape: &Shape) -> Self {
        let (vertices, sides) = (shape.core(), shape.sides());
        let mut around: Vec<Vec<(Vector3<f64>, f64)>> = vec![Vec::new(); vertices.len()];
        let mut edges = BTreeMap::<[usize; 2], Vec<usize>>::new();
        for (index, (corners, normal)) in sides.iter().enumerate() {
            let count = corners.len();
            for k in 0..count {
                let (here, next) = (corners[k], corners[(k + 1) % count]);
                let direction = |to: usize| vertices[to] - vertices[here];
                let angle = direction(corners[(k + count - 1) % count]).angle(&direction(next));
                around[here].push((*normal, angle));
                edges.entry([here.min(next), here.max(next)]).or_default().push(index);
            }
        }
        let mean = |corner: usize, normal: &Vector3<f64>| {
            let near = around[corner].iter().filter(|(other, _)| other.dot(normal) > CREASE);
            let sum: Vector3<f64> = near.map(|(other, angle)| other * *angle).sum();
            sum.try_normalize(1e-12).unwrap_or(*normal)
        };
        let is_flat = |faces: &[usize]| match faces {
            [one, other] => sides[*one].1.dot(&sides[*other].1) > CREASE,
            _ => false,
        };
        let creases = edges.into_iter().filter(|(_, faces)| !is_flat(faces)).collect();
        let face = |(corners, normal): &Side| SurfaceFace {
            corners: corners.clone(),
            normal: *normal,
            normals: corners.iter().map(|&corner| mean(corner, normal)).collect(),
        };
        Self { faces: sides.iter().map(face).collect(), creases }
    }
}

impl Mesh {
    /// Triangles with outward unit normals. Triangles of zero area are skipped.
    pub(crate) fn sides(&self) -> impl Iterator<Item = Side> {
        self.triangles.iter().filter_map(|triangle| {
            let corner = |k: usize| self.vertices.get(triangle[k]);
            let (a, b, c) = (corner(0)?, corner(1)?, corner(2)?);
            let normal = (b - a).cross(&(c - a)).try_normalize(0.0)?;
            Some((triangle.to_vec(), normal))
        })
    }
}

/// Number of points on a round piece, shared by the points of its core, and least number for each.
/// The outline of a ball then deviates by less than 3 % of its radius.
const MAX_DIRECTIONS: usize = 128;
const MIN_DIRECTIONS: usize = 16;

/// Directions spread evenly over the sphere, on a spiral by the golden angle.
fn directions(count: usize) -> impl Iterator<Item = Vector3<f64>> {
    let turn = PI * (3.0 - 5.0_f64.sqrt());
    (0..count).map(move |k| {
        let z = 1.0 - (2 * k + 1) as f64 / count as f64;
        let (sin, cos) = (turn * k as f64).sin_cos();
        let across = (1.0 - z * z).sqrt();
        Vector3::new(across * cos, across * sin, z)
    })
}

/// True if `points` are the corners of a box, x fastest.
pub(crate) fn is_box(points: &[Vector3<f64>]) -> bool {
    let &[origin, x, y, _, z, ..] = points else { return false };
    let edges = [x - origin, y - origin, z - origin];
    let size = edges.iter().map(|edge| edge.amax()).fold(0.0, f64::max);
    let volume = edges[0].cross(&edges[1]).dot(&edges[2]).abs();
    let fits = points.iter().enumerate().all(|(i, point)| {
        let steps = (0..3).map(|k| edges[k] * (i >> k & 1) as f64).sum::<Vector3<f64>>();
        (origin + steps - point).amax() <= 1e-6 * size
    });
    points.len() == 8 && fits && volume > 0.0
}

#[cfg(test)]
#[path = "tests/shape.rs"]
mod tests;
