//! Exact volume, centre of mass and inertia of pieces and meshes of uniform density.
//!
//! A polyhedron is the sum of the tetrahedra from its centre to the triangles of its faces. A
//! rounding of radius r adds (Steiner) a slab of thickness r on every face, a sector of a cylinder
//! along every edge and a sector of a ball at every vertex. These parts do not overlap, and the
//! moments of each have a closed form.

use super::mesh::Mesh;
use super::smooth::Smooth;
use super::{Hull, Piece};
use crate::error::Error;
use nalgebra::{Matrix3, Vector3};
use std::f64::consts::PI;

/// Volume, centre of mass and inertia of a shape of density 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MassProperties {
    /// V: volume (m³). The mass is V times the density (kg/m³).
    pub volume: f64,
    /// Centre of mass (m, frame of the pieces).
    pub centre: Vector3<f64>,
    /// ∫ |x|² 1 − x xᵀ dV about the centre of mass (m⁵, axes of the frame of the pieces). The
    /// inertia (kg m²) is this times the density.
    pub inertia: Matrix3<f64>,
}

impl MassProperties {
    /// Mass properties of one piece.
    pub fn from_piece(piece: &Piece) -> Self {
        if let Some(smooth) = piece.smooth() {
            return smooth_mass(smooth);
        }
        let (hull, r) = (piece.core(), piece.radius());
        let reference = *hull.centre();
        let mut sum = Moments::default();
        match (hull.vertices(), hull.faces()) {
            (_, [_, ..]) => {
                add_polyhedron(&mut sum, hull);
                if r > 0.0 {
                    add_rounding(&mut sum, hull, r);
                }
            }
            (&[from, to], _) => add_capsule(&mut sum, &(to - from), r),
            _ => {
                sum.volume = 4.0 / 3.0 * PI * r.powi(3);
                sum.second = Matrix3::identity() * (sum.volume * r * r / 5.0);
            }
        }
        sum.properties(&reference)
    }

    /// Mass properties of the solid that a closed mesh encloses, which need not be convex.
    ///
    /// The solid is the sum of the signed tetrahedra from one vertex to the triangles.
    pub fn from_mesh(mesh: &Mesh) -> Self {
        let o = mesh.vertices().first().copied().unwrap_or_default();
        let mut sum = Moments::default();
        for triangle in mesh.triangles() {
            let [a, b, c] = triangle.map(|vertex| mesh.vertices()[vertex] - o);
            let six = Matrix3::from_columns(&[a, b, c]).determinant();
            sum.add_corners([Vector3::zeros(), a, b, c], six / 6.0);
        }
        sum.properties(&o)
    }

    /// Mass properties of several pieces of one density, as one rigid body. The pieces must not
    /// overlap: their common parts count twice.
    ///
    /// ```text
    /// V = Σ V_i,   c = Σ V_i c_i / V,   J = Σ J_i + V_i (|d_i|² 1 − d_i d_iᵀ),   d_i = c_i − c
    /// ```
    ///
    /// # Errors
    /// No piece.
    pub fn from_pieces<'a>(pieces: impl IntoIterator<Item = &'a Piece>) -> Result<Self, Error> {
        let parts: Vec<Self> = pieces.into_iter().map(Self::from_piece).collect();
        if parts.is_empty() {
            return Err(Error::Count { field: "pieces", count: 0, allowed: "1 or more" });
        }
        let volume = parts.iter().map(|part| part.volume).sum();
        let first: Vector3<f64> = parts.iter().map(|part| part.centre * part.volume).sum();
        let centre = first / volume;
        let inertia = parts.iter().map(|part| {
            let d: Vector3<f64> = part.centre - centre;
            part.inertia + inertia_of(&(d * d.transpose())) * part.volume
        });
        Ok(Self { volume, centre, inertia: inertia.sum() })
    }
}

/// Moments about a reference point: V = ∫ dV, ∫ x dV, ∫ x xᵀ dV.
#[derive(Default)]
struct Moments {
    volume: f64,
    first: Vector3<f64>,
    second: Matrix3<f64>,
}

impl Moments {
    fn properties(&self, reference: &Vector3<f64>) -> MassProperties {
        let shift = self.first / self.volume;
        let second = self.second - shift * shift.transpose() * self.volume;
        let second = (second + second.transpose()) / 2.0;
        MassProperties {
            volume: self.volume,
            centre: reference + shift,
            inertia: inertia_of(&second),
        }
    }

    /// Adds a part whose moments are about `origin`.
    fn add(&mut self, part: &Self, origin: &Vector3<f64>) {
        self.volume += part.volume;
        self.first += part.first + origin * part.volume;
        let mixed = origin * part.first.transpose();
        let place = origin * origin.transpose() * part.volume;
        self.second += part.second + mixed + mixed.transpose() + place;
    }

    /// Adds a tetrahedron with corners a, b, c, d. Its volume |det|/6 is positive for any order of
    /// the corners.
    fn add_tetrahedron(&mut self, corners: [Vector3<f64>; 4]) {
        let [a, b, c, d] = corners;
        let volume = Matrix3::from_columns(&[b - a, c - a, d - a]).determinant().abs() / 6.0;
        self.add_corners(corners, volume);
    }

    /// Adds a tetrahedron with corners a, b, c, d and a volume V that can be negative:
    ///
    /// ```text
    /// ∫ x dV = V s/4,  ∫ x xᵀ dV = V/20 (Σ a aᵀ + s sᵀ),  s = a + b + c + d
    /// ```
    fn add_corners(&mut self, corners: [Vector3<f64>; 4], volume: f64) {
        let sum: Vector3<f64> = corners.iter().sum();
        let squares: Matrix3<f64> = corners.iter().map(|x| x * x.transpose()).sum();
        self.volume += volume;
        self.first += sum * (volume / 4.0);
        self.second += (squares + sum * sum.transpose()) * (volume / 20.0);
    }
}

/// Mass properties of a smooth shape. With the half axes S of a disc or ellipsoid and the vector d
/// between the ends,
///
/// ```text
/// cylinder   V = π r² |d|        ∫ x xᵀ dV = V (S Sᵀ/4 + d dᵀ/12)
/// cone       V = π r² |d|/3      ∫ x xᵀ dV = V (3 S Sᵀ/20 + 3 d dᵀ/80), about c = base + d/4
/// ellipsoid  V = 4/3 π |det S|   ∫ x xᵀ dV = V S Sᵀ/5
/// ```
fn smooth_mass(smooth: &Smooth) -> MassProperties {
    let square = |x: &Matrix3<f64>| x * x.transpose();
    let area = |disc: &Matrix3<f64>| PI * 0.5 * square(disc).trace();
    let (volume, centre, specific) = match smooth {
        Smooth::Cylinder([from, to]) => {
            let along = to.centre - from.centre;
            let second = square(&from.axes) / 4.0 + along * along.transpose() / 12.0;
            (area(&from.axes) * along.norm(), (from.centre + to.centre) / 2.0, second)
        }
        Smooth::Cone { base, apex: (_, apex) } => {
            let along = apex - base.centre;
            let second = square(&base.axes) * 0.15 + along * along.transpose() * 0.0375;
            (area(&base.axes) * along.norm() / 3.0, base.centre + along / 4.0, second)
        }
        Smooth::Ellipsoid(one) => {
            let volume = 4.0 / 3.0 * PI * one.axes.determinant().abs();
            (volume, one.centre, square(&one.axes) / 5.0)
        }
    };
    MassProperties { volume, centre, inertia: inertia_of(&specific) * volume }
}

/// tr(S) 1 − S: inertia for second moments S.
fn inertia_of(second: &Matrix3<f64>) -> Matrix3<f64> {
    Matrix3::identity() * second.trace() - second
}

/// Adds the polyhedral core, about its centre.
fn add_polyhedron(sum: &mut Moments, hull: &Hull) {
    for [a, b, c] in (0..hull.faces().len()).flat_map(|face| hull.fan(face)) {
        let o = hull.centre();
        sum.add_tetrahedron([Vector3::zeros(), a - o, b - o, c - o]);
    }
}

/// Adds a capsule about its middle. `along` is the vector between the ends of its core, with length
/// L:
///
/// ```text
/// cylinder  V = π r² L,  ∫ x xᵀ dV = V (r²/4 (1 − e eᵀ) + L²/12 e eᵀ)
/// both caps V = 4/3 π r³,  ∫ x xᵀ dV = V (r²/5 1 + (L²/4 + 3 L r/8) e eᵀ)
/// ```
fn add_capsule(sum: &mut Moments, along: &Vector3<f64>, r: f64) {
    let length = along.norm();
    let axis = along * along.transpose() / (length * length);
    let cylinder = PI * r * r * length;
    let caps = 4.0 / 3.0 * PI * r.powi(3);
    sum.volume += cylinder + caps;
    let across = (Matrix3::identity() - axis) * (r * r / 4.0);
    sum.second += (across + axis * (length * length / 12.0)) * cylinder;
    let cap = Matrix3::identity() * (r * r / 5.0);
    sum.second += (cap + axis * (length * length / 4.0 + 3.0 * length * r / 8.0)) * caps;
}

/// Adds the rounding of a polyhedron by r, about its centre.
fn add_rounding(sum: &mut Moments, hull: &Hull, r: f64) {
    let o = hull.centre();
    for (index, face) in hull.faces().iter().enumerate() {
        let up = face.normal * r;
        for [a, b, c] in hull.fan(index).map(|corners| corners.map(|p| p - o)) {
            sum.add_tetrahedron([a, b, c, c + up]);
            sum.add_tetrahedron([a, b, b + up, c + up]);
            sum.add_tetrahedron([a, a + up, b + up, c + up]);
        }
    }
    let mut tips = vec![Tip::default(); hull.vertices().len()];
    for edge in hull.edges() {
        let Some(faces) = edge.faces else { continue };
        let [left, right] = faces.map(|face| hull.faces()[face as usize].normal);
        let [from, to] = edge.vertices.map(|vertex| vertex as usize);
        let (start, end) = (hull.vertices()[from] - o, hull.vertices()[to] - o);
        sum.add(&cylinder_sector(&(end - start), &left, &right, r), &((start + end) / 2.0));
        // Seen from outside, the normals around a vertex run from the left to the right face of an
        // edge that ends there.
        tips[to].arcs.push([left, right]);
        tips[from].arcs.push([right, left]);
    }
    for (tip, vertex) in tips.iter().zip(hull.vertices()) {
        sum.add(&tip.ball_sector(r), &(vertex - o));
    }
}

/// Moments of the sector of a cylinder of radius r between the directions m and n, about the middle
/// of its axis.
///
/// The axis `along` has length L and the unit vector e. Let θ be the angle from m to n, b the unit
/// vector halfway between them, and c perpendicular to b and e:
///
/// ```text
/// V = L θ r²/2,  ∫ x dV = L ⅔ r³ sin(θ/2) b
/// ∫ x xᵀ dV = V L²/12 e eᵀ + L r⁴/8 ((θ + sin θ) b bᵀ + (θ − sin θ) c cᵀ)
/// ```
fn cylinder_sector(along: &Vector3<f64>, m: &Vector3<f64>, n: &Vector3<f64>, r: f64) -> Moments {
    let length = along.norm();
    let e = along / length;
    let b = (m + n).normalize();
    let c = e.cross(&b);
    let angle = libm::atan2(m.cross(n).norm(), m.dot(n));
    let volume = length * angle * r * r / 2.0;
    let wide = angle + libm::sin(angle);
    let narrow = angle - libm::sin(angle);
    let across = b * b.transpose() * wide + c * c.transpose() * narrow;
    Moments {
        volume,
        first: b * (length * 2.0 / 3.0 * r.powi(3) * libm::sin(angle / 2.0)),
        second: e * e.transpose() * (volume * length * length / 12.0)
            + across * (length * r.powi(4) / 8.0),
    }
}

/// Normal cone of a vertex: a convex polygon on the unit sphere. Its sides are the arcs between the
/// normals of neighbouring faces, counter-clockwise seen from outside.
#[derive(Clone, Default)]
struct Tip {
    arcs: Vec<[Vector3<f64>; 2]>,
}

impl Tip {
    /// Moments of the sector of a ball of radius r over the polygon, about the vertex.
    ///
    /// The integrals over the polygon follow from Stokes' theorem. An arc of angle θ from a to b
    /// has m = a × b/|a × b| and t = m × a:
    ///
    /// ```text
    /// Ω  = Σ triangles (middle, a, b)                        tan(Ω/2) = det/(1 + Σ products)
    /// ∫ n dΩ    = ½ Σ θ m
    /// ∫ n nᵀ dΩ = ⅓ (Ω 1 + Σ m (a sin θ + t (1 − cos θ))ᵀ)
    /// V = Ω r³/3,  ∫ x dV = r⁴/4 ∫ n dΩ,  ∫ x xᵀ dV = r⁵/5 ∫ n nᵀ dΩ
    /// ```
    fn ball_sector(&self, r: f64) -> Moments {
        let middle = self.arcs.iter().map(|arc| arc[0]).sum::<Vector3<f64>>().normalize();
        let (mut solid_angle, mut first) = (0.0, Vector3::zeros());
        let mut second = Matrix3::zeros();
        for [a, b] in &self.arcs {
            let cross = a.cross(b);
            let (sin, cos) = (cross.norm(), a.dot(b));
            let normal = cross / sin;
            first += normal * (libm::atan2(sin, cos) / 2.0);
            let arc = a * sin + normal.cross(a) * (1.0 - cos);
            second += normal * arc.transpose();
            let triple = middle.dot(&cross);
            solid_angle += 2.0 * libm::atan2(triple, 1.0 + cos + middle.dot(a) + middle.dot(b));
        }
        second = (second + second.transpose()) / 2.0 + Matrix3::identity() * solid_angle;
        Moments {
            volume: solid_angle * r.powi(3) / 3.0,
            first: first * (r.powi(4) / 4.0),
            second: second * (r.powi(5) / 15.0),
        }
    }
}
