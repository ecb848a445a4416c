//! Drawn geometry of a body: convex pieces, meshes or contact points.

use nalgebra::Vector3;
use std::collections::BTreeMap;
use std::f64::consts::PI;

/// Convex piece or mesh of a body or fixed object. Lengths are in m.
#[derive(Debug, Clone, PartialEq)]
pub enum FilmPiece {
    /// A polyhedron, optionally rounded.
    Hull(FilmHull),
    /// A ball.
    Sphere {
        /// Centre.
        centre: Vector3<f64>,
        /// Radius.
        radius: f64,
    },
    /// All points within `radius` of a segment.
    Capsule {
        /// End points of the segment.
        ends: [Vector3<f64>; 2],
        /// Radius.
        radius: f64,
    },
    /// A mesh for drawing only.
    Mesh(FilmMesh),
}

/// All points within `radius` of a convex polyhedron.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FilmHull {
    /// Vertices of the polyhedron.
    pub vertices: Vec<Vector3<f64>>,
    /// Faces as indices into [`FilmHull::vertices`], in either orientation.
    pub faces: Vec<Vec<usize>>,
    /// Rounding radius; 0 for sharp edges.
    pub radius: f64,
    /// Description of the shape, if the hull approximates another one.
    pub name: Option<String>,
}

/// Triangle mesh, which may be open and non-convex.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FilmMesh {
    /// Vertices of the triangles.
    pub vertices: Vec<Vector3<f64>>,
    /// Indices into [`FilmMesh::vertices`], counter-clockwise seen from outside.
    pub triangles: Vec<[usize; 3]>,
    /// Red, green and blue. `None` for the colour of its body.
    pub colour: Option<[u8; 3]>,
}

/// Geometry that is drawn.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Outline {
    Solid(FilmPiece),
    /// Contact points, drawn with their convex outline.
    Points(Vec<Vector3<f64>>),
}

/// Vertices of the six faces of a box, in order around each face. Vertex index is x + 2 y + 4 z.
const BOX: [[usize; 4]; 6] =
    [[0, 2, 6, 4], [1, 3, 7, 5], [0, 1, 5, 4], [2, 3, 7, 6], [0, 1, 3, 2], [4, 5, 7, 6]];

impl FilmPiece {
    /// Box with these eight corners, x fastest.
    pub fn cuboid(corners: &[Vector3<f64>]) -> Self {
        let faces = BOX.iter().map(|face| face.to_vec()).collect();
        Self::Hull(FilmHull { vertices: corners.to_vec(), faces, ..FilmHull::default() })
    }

    /// Vertices of the core, which is a polyhedron, a segment or a point.
    pub(crate) fn core(&self) -> &[Vector3<f64>] {
        match self {
            Self::Hull(hull) => &hull.vertices,
            Self::Mesh(mesh) => &mesh.vertices,
            Self::Sphere { centre, .. } => std::slice::from_ref(centre),
            Self::Capsule { ends, .. } => ends,
        }
    }

    /// Surface of a hull's core or of a mesh. Round pieces have none.
    pub(crate) fn surface(&self) -> Surface {
        match self {
            Self::Hull(hull) => Surface::of(&hull.vertices, hull.sides()),
            Self::Mesh(mesh) => Surface::of(&mesh.vertices, mesh.sides()),
            Self::Sphere { .. } | Self::Capsule { .. } => Surface::default(),
        }
    }

    /// Rounding radius about the core (m).
    pub(crate) fn radius(&self) -> f64 {
        match self {
            Self::Hull(FilmHull { radius, .. })
            | Self::Sphere { radius, .. }
            | Self::Capsule { radius, .. } => *radius,
            Self::Mesh(_) => 0.0,
        }
    }
}

impl FilmHull {
    /// Faces with outward unit normals. Faces of zero area are skipped.
    pub(crate) fn sides(&self) -> impl Iterator<Item = (&[usize], Vector3<f64>)> {
        let middle = self.vertices.iter().sum::<Vector3<f64>>() / self.vertices.len() as f64;
        self.faces.iter().filter_map(move |face| {
            let corner = |k: usize| {
                let place = face.get(k % face.len().max(1))?;
                self.vertices.get(*place).copied()
            };
            // The sum over the corners is twice the area of any planar polygon.
            let first = corner(0)?;
            let mut across = Vector3::zeros();
            for k in 0..face.len() {
                across += (corner(k)? - first).cross(&(corner(k + 1)? - first));
            }
            let normal = across.try_normalize(0.0)?;
            let outward = normal.dot(&(first - middle)) >= 0.0;
            Some((face.as_slice(), if outward { normal } else { -normal }))
        })
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
    fn of<'a>(
        vertices: &[Vector3<f64>],
        sides: impl Iterator<Item = (&'a [usize], Vector3<f64>)>,
    ) -> Self {
        let sides: Vec<_> = sides.collect();
        let mut around: Vec<Vec<(Vector3<f64>, f64)>> = vec![Vec::new(); vertices.len()];
        let mut edges = BTreeMap::<[usize; 2], Vec<usize>>::new();
        for (index, (corners, normal)) in sides.iter().enumerate() {
            let count = corners.len();
            for k in 0..count {
                let (here, next) = (corners[k], corners[(k + 1) % count]);
                let way = |to: usize| vertices[to] - vertices[here];
                let angle = way(corners[(k + count - 1) % count]).angle(&way(next));
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
        let face = |(corners, normal): &(&[usize], Vector3<f64>)| SurfaceFace {
            corners: corners.to_vec(),
            normal: *normal,
            normals: corners.iter().map(|&corner| mean(corner, normal)).collect(),
        };
        Self { faces: sides.iter().map(face).collect(), creases }
    }
}

impl FilmMesh {
    /// Triangles with outward unit normals. Triangles of zero area are skipped.
    pub(crate) fn sides(&self) -> impl Iterator<Item = (&[usize], Vector3<f64>)> {
        self.triangles.iter().filter_map(|triangle| {
            let corner = |k: usize| self.vertices.get(triangle[k]);
            let (a, b, c) = (corner(0)?, corner(1)?, corner(2)?);
            let normal = (b - a).cross(&(c - a)).try_normalize(0.0)?;
            Some((&triangle[..], normal))
        })
    }
}

impl Outline {
    /// Geometry of a body with `pieces`. A body without pieces is drawn as the box with the corners
    /// `points`, or else as points.
    pub fn of(pieces: &[FilmPiece], points: &[Vector3<f64>]) -> Vec<Self> {
        if !pieces.is_empty() {
            return pieces.iter().cloned().map(Self::Solid).collect();
        }
        vec![if is_box(points) {
            Self::Solid(FilmPiece::cuboid(points))
        } else {
            Self::Points(points.to_vec())
        }]
    }

    /// Points whose convex hull contains the drawn geometry.
    pub fn span(&self) -> Vec<Vector3<f64>> {
        match self {
            Self::Points(points) => points.clone(),
            Self::Solid(piece) if piece.radius() == 0.0 => piece.core().to_vec(),
            Self::Solid(piece) => {
                let side = |i: usize| {
                    Vector3::from_fn(|axis, _| {
                        if i >> axis & 1 == 1 { piece.radius() } else { -piece.radius() }
                    })
                };
                piece.core().iter().flat_map(|core| (0..8).map(move |i| core + side(i))).collect()
            }
        }
    }

    /// Points on the drawn geometry, whose convex hull is close to it.
    pub fn surface_points(&self) -> Vec<Vector3<f64>> {
        match self {
            Self::Solid(piece) if piece.radius() > 0.0 => {
                let count = (MOST_WAYS / piece.core().len().max(1)).max(LEAST_WAYS);
                let ways: Vec<_> = ways(count).collect();
                let around = |core: &Vector3<f64>| {
                    let core = *core;
                    ways.iter().map(move |way| core + way * piece.radius())
                };
                piece.core().iter().flat_map(around).collect()
            }
            _ => self.span(),
        }
    }
}

/// Number of points on a round piece, shared by the points of its core, and least number for each.
/// The outline of a ball then deviates by less than 3 % of its radius.
const MOST_WAYS: usize = 128;
const LEAST_WAYS: usize = 16;

/// Directions spread evenly over the sphere, on a spiral by the golden angle.
fn ways(count: usize) -> impl Iterator<Item = Vector3<f64>> {
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
mod tests {
    use super::*;

    fn corners(edges: [Vector3<f64>; 3]) -> Vec<Vector3<f64>> {
        (0..8).map(|i| (0..3).map(|k| edges[k] * f64::from(i >> k & 1)).sum()).collect()
    }

    #[test]
    fn boxes_are_told_from_other_bodies() {
        let edges = [Vector3::x(), Vector3::y() * 2.0, Vector3::z() * 0.1];
        let mut points = corners(edges);
        assert!(is_box(&points));
        points[3][2] += 0.01;
        assert!(!is_box(&points));
        assert!(!is_box(&points[..4]));
        assert!(!is_box(&corners([edges[0]; 3])));
    }

    /// Points on a ball: its extent in any direction is its radius, also along diagonals.
    #[test]
    fn a_ball_extends_by_its_radius_in_every_direction() {
        let centre = Vector3::new(1.0, -2.0, 0.5);
        let ball = Outline::Solid(FilmPiece::Sphere { centre, radius: 0.3 });
        let points = ball.surface_points();
        for way in ways(500) {
            let extent = points.iter().map(|point| (point - centre).dot(&way)).fold(0.0, f64::max);
            assert!((0.97 * 0.3..=0.3 + 1e-12).contains(&extent), "{way}: {extent}");
        }
    }

    /// Three triangles form a right-angled corner and one more extends a face in its plane. Every
    /// edge is visible except the one between coplanar triangles.
    #[test]
    fn meshes_have_lines_where_they_are_folded_or_end() {
        let at = |x: f64, y: f64, z: f64| Vector3::new(x, y, z);
        let vertices = vec![
            at(0.0, 0.0, 0.0),
            at(1.0, 0.0, 0.0),
            at(0.0, 1.0, 0.0),
            at(0.0, 0.0, 1.0),
            at(1.0, 1.0, 0.0),
        ];
        let triangles = vec![[0, 1, 2], [1, 4, 2], [0, 2, 3], [0, 0, 1], [0, 1, 9]];
        let mesh = FilmMesh { vertices, triangles, colour: None };
        let normals: Vec<_> = mesh.sides().map(|side| side.1).collect();
        assert_eq!(normals, [Vector3::z(), Vector3::z(), Vector3::x()]);
        let surface = FilmPiece::Mesh(mesh).surface();
        let creases: Vec<_> = surface.creases.iter().map(|crease| crease.0).collect();
        assert_eq!(creases, [[0, 1], [0, 2], [0, 3], [1, 4], [2, 3], [2, 4]]);
    }

    /// A prism with 24 sides approximates a cylinder. Its sides are smooth and its ends are flat.
    #[test]
    fn a_prism_with_many_sides_is_shaded_as_a_cylinder() {
        let sides = 24;
        let turn = |k: usize| std::f64::consts::TAU * k as f64 / sides as f64;
        let corner = |i: usize| {
            let (sine, cosine) = turn(i / 2).sin_cos();
            Vector3::new(cosine, sine, (i % 2) as f64)
        };
        let vertices: Vec<_> = (0..2 * sides).map(corner).collect();
        let side = |k: usize| {
            let next = (k + 1) % sides;
            vec![2 * k, 2 * next, 2 * next + 1, 2 * k + 1]
        };
        let ends = [0, 1].map(|end| (0..sides).map(|k| 2 * k + end).collect());
        let faces = (0..sides).map(side).chain(ends).collect();
        let hull = FilmHull { vertices: vertices.clone(), faces, ..FilmHull::default() };
        let surface = FilmPiece::Hull(hull).surface();
        for face in &surface.faces {
            for (corner, normal) in face.corners.iter().zip(&face.normals) {
                let radial = Vector3::new(vertices[*corner].x, vertices[*corner].y, 0.0);
                let expected = if face.normal.z == 0.0 { radial } else { face.normal };
                assert!((normal - expected).norm() < 1e-9, "{normal} {expected}");
            }
        }
        assert_eq!(surface.creases.len(), 2 * sides);
    }

    #[test]
    fn normals_point_outward_whichever_way_the_faces_go() {
        let FilmPiece::Hull(mut hull) =
            FilmPiece::cuboid(&corners([Vector3::x(), Vector3::y(), Vector3::z()]))
        else {
            unreachable!("a box is a hull")
        };
        hull.faces[2].reverse();
        let normals: Vec<_> = hull.sides().map(|side| side.1).collect();
        let expected = [0, 1, 2].map(|k| Vector3::ith(k, 1.0)).map(|axis| [-axis, axis]).concat();
        assert_eq!(normals, expected);
        // Faces without area and faces with invalid indices are skipped.
        hull.faces.extend([vec![0, 0, 0], vec![0, 1, 99], Vec::new()]);
        assert_eq!(hull.sides().count(), 6);
    }
}
