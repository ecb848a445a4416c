//! Mass properties of shapes and of their sums.

use super::frame::LinkFrame;
use super::model::{LinkMass, RobotForm};
use nalgebra::{Matrix3, Vector3};
use std::f64::consts::PI;
use tumble_core::geometry::{MassProperties, Piece};

impl LinkMass {
    /// Zero mass.
    pub const NONE: Self = Self {
        mass: 0.0,
        centre: Vector3::new(0.0, 0.0, 0.0),
        inertia: Matrix3::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    };

    /// Mass properties scaled by `part` at the same shape.
    pub fn times(&self, part: f64) -> Self {
        Self { mass: self.mass * part, centre: self.centre, inertia: self.inertia * part }
    }

    /// Transforms to the outer frame in which `frame` is given.
    pub fn placed(&self, frame: &LinkFrame) -> Self {
        let turn = frame.rotation();
        Self {
            mass: self.mass,
            centre: frame.point(&self.centre),
            inertia: symmetric(&(turn * self.inertia * turn.transpose())),
        }
    }

    /// Sum of the parts:
    ///
    /// ```text
    /// m = Σ m_i,  c = Σ m_i c_i/m,  I = Σ (I_i + m_i (d_i² E − d_i d_iᵀ)),  d_i = c_i − c
    /// ```
    pub fn sum(parts: &[Self]) -> Self {
        let mass: f64 = parts.iter().map(|part| part.mass).sum();
        if let [part] = parts {
            return *part;
        }
        if mass <= 0.0 {
            return Self::NONE;
        }
        let centre: Vector3<f64> = parts.iter().map(|part| part.centre * part.mass).sum();
        let centre = centre / mass;
        let inertia: Matrix3<f64> = parts
            .iter()
            .map(|part| {
                let arm = part.centre - centre;
                let spread =
                    Matrix3::from_diagonal_element(arm.norm_squared()) - arm * arm.transpose();
                part.inertia + spread * part.mass
            })
            .sum();
        Self { mass, centre, inertia: symmetric(&inertia) }
    }
}

/// Mass properties of the volume enclosed by triangles, at a density of 1 kg/m³.
///
/// The volume is a sum of tetrahedra between each triangle and a common apex. With its corners v
/// relative to the apex, a tetrahedron has
///
/// ```text
/// V = |v₁·(v₂×v₃)|/6,  ∫ x = V s/4,  ∫ x xᵀ = V (Σ v vᵀ + s sᵀ)/20,  s = Σ v
/// ```
///
/// The centre c uses the centroid of the surface as apex. Mass and inertia about c use c as apex.
/// The first result adds all tetrahedra. The second subtracts those whose triangle faces c. Both
/// are exact for closed meshes that are star-shaped about c. The second is exact for all closed
/// meshes.
pub fn enclosed(triangles: &[[Vector3<f64>; 3]]) -> [LinkMass; 2] {
    let (mut area, mut middle) = (0.0, Vector3::zeros());
    for [a, b, c] in triangles {
        let own = (b - a).cross(&(c - a)).norm();
        area += own;
        middle += (a + b + c) * (own / 3.0);
    }
    let middle = if area > 0.0 { middle / area } else { middle };
    [true, false].map(|adds| {
        // Integrals ∫ 1, ∫ x and ∫ x xᵀ about a point.
        let moments = |point: &Vector3<f64>| {
            let (mut volume, mut first) = (0.0, Vector3::zeros());
            let mut second = Matrix3::zeros();
            for triangle in triangles {
                let corners = triangle.map(|corner| corner - point);
                let [a, b, c] = corners;
                let signed = a.dot(&b.cross(&c)) / 6.0;
                let own = if adds { signed.abs() } else { signed };
                let sum = a + b + c;
                let arms = [a, b, c, sum];
                let squares: Matrix3<f64> = arms.iter().map(|arm| arm * arm.transpose()).sum();
                volume += own;
                first += sum * (own / 4.0);
                second += squares * (own / 20.0);
            }
            (volume, first, second)
        };
        let (volume, first, _) = moments(&middle);
        if volume <= 0.0 {
            return LinkMass::NONE;
        }
        let centre = middle + first / volume;
        let (mass, _, second) = moments(&centre);
        let inertia = Matrix3::from_diagonal_element(second.trace()) - second;
        LinkMass { mass, centre, inertia: symmetric(&inertia) }
    })
}

/// Symmetric part, since rounding makes sums slightly asymmetric.
pub fn symmetric(matrix: &Matrix3<f64>) -> Matrix3<f64> {
    (matrix + matrix.transpose()) * 0.5
}

/// Mass properties of a form in its own frame at 1 kg/m³, such that the mass equals the volume
/// (m³).
pub fn solid(form: &RobotForm) -> Result<LinkMass, String> {
    let diagonal = |x: f64, y: f64, z: f64| Matrix3::from_diagonal(&Vector3::new(x, y, z));
    let (mass, specific) = match form {
        RobotForm::Plane | RobotForm::Field(_) => return Ok(LinkMass::NONE),
        RobotForm::Sphere(r) => {
            let part = 0.4 * r * r;
            (4.0 / 3.0 * PI * r.powi(3), diagonal(part, part, part))
        }
        RobotForm::Box(half) => {
            let squares = half.component_mul(half);
            let moments = Vector3::repeat(squares.sum()) - squares;
            (8.0 * half.product(), Matrix3::from_diagonal(&(moments / 3.0)))
        }
        RobotForm::Ellipsoid(half) => {
            let squares = half.component_mul(half);
            let moments = Vector3::repeat(squares.sum()) - squares;
            (4.0 / 3.0 * PI * half.product(), Matrix3::from_diagonal(&(moments / 5.0)))
        }
        RobotForm::Cylinder(half, r) => {
            let across = (3.0 * r * r + 4.0 * half * half) / 12.0;
            (2.0 * PI * r * r * half, diagonal(across, across, 0.5 * r * r))
        }
        RobotForm::Cone(half, r) => {
            let mass = 2.0 / 3.0 * PI * r * r * half;
            let across = 0.15 * (r * r + half * half);
            let inertia = diagonal(across, across, 0.3 * r * r) * mass;
            // The centroid is at a quarter of the height.
            return Ok(LinkMass { mass, centre: Vector3::z() * (-0.5 * half), inertia });
        }
        RobotForm::Capsule(half, r) => {
            let tube = 2.0 * PI * r * r * half;
            let ball = 4.0 / 3.0 * PI * r.powi(3);
            let mass = tube + ball;
            // The centroid of a half ball is 3r/8 from its flat side.
            let ends = 0.4 * r * r + half * half + 0.75 * half * r;
            let across = (tube * (3.0 * r * r + 4.0 * half * half) / 12.0 + ball * ends) / mass;
            let along = (tube * 0.5 * r * r + ball * 0.4 * r * r) / mass;
            (mass, diagonal(across, across, along))
        }
        RobotForm::Hull(points) => {
            let points: Vec<_> = points.iter().copied().map(Vector3::from).collect();
            let piece = Piece::hull(&points, 0.0).map_err(|error| error.to_string())?;
            let own = MassProperties::from_piece(&piece);
            let inertia = symmetric(&own.inertia);
            return Ok(LinkMass { mass: own.volume, centre: own.centre, inertia });
        }
    };
    Ok(LinkMass { mass, centre: Vector3::zeros(), inertia: specific * mass })
}
