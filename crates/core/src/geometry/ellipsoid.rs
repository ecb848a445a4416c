//! Ellipsoids, also flat ones: the smooth parts of convex shapes.

use nalgebra::{Matrix3, Vector3};

/// All points c + S y with |y| ≤ 1 (m, frame of the body). Columns of S that are zero make it flat:
/// a disc has one, a segment two.
///
/// Its extent along a unit vector n is
///
/// ```text
/// max n·x = n·c + |Sᵀ n|,   at x = c + S Sᵀ n/|Sᵀ n|                       (eq. 4c)
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub struct Ellipsoid {
    /// c: centre (m).
    pub centre: Vector3<f64>,
    /// S: half axes as columns (m), orthogonal.
    pub axes: Matrix3<f64>,
}

/// |Sᵀ n| below which a disc is parallel to a plane with the normal n, relative to its size.
const FLAT: f64 = 1e-9;

impl Ellipsoid {
    /// Disc about `centre` with the unit normal `axis` and `radius` (m).
    pub fn disc(centre: Vector3<f64>, axis: &Vector3<f64>, radius: f64) -> Self {
        let least = Vector3::ith(axis.iamin(), 1.0);
        let first = (least - axis * axis.dot(&least)).normalize();
        let second = axis.cross(&first);
        let axes = Matrix3::from_columns(&[first * radius, second * radius, Vector3::zeros()]);
        Self { centre, axes }
    }

    /// This ellipsoid rotated about the origin and then translated (m).
    pub fn moved_by(&self, rotation: &Matrix3<f64>, translation: &Vector3<f64>) -> Self {
        Self { centre: rotation * self.centre + translation, axes: rotation * self.axes }
    }

    /// This ellipsoid with all lengths multiplied by `factor`.
    pub fn scaled(&self, factor: f64) -> Self {
        Self { centre: self.centre * factor, axes: self.axes * factor }
    }

    /// |Sᵀ n|: half the width along the unit vector `n` (m).
    pub fn half_width(&self, n: &Vector3<f64>) -> f64 {
        self.axes.tr_mul(n).norm()
    }

    /// S Sᵀ n/|Sᵀ n|: vector from the centre to the farthest point along `n` (m). Zero if all points
    /// are equally far, to rounding.
    pub fn farthest(&self, n: &Vector3<f64>) -> Vector3<f64> {
        self.axes * self.direction(n)
    }

    /// Sᵀ n/|Sᵀ n|: the unit vector y for which c + S y is the farthest point along `n`; 0 if all
    /// points are equally far.
    pub fn direction(&self, n: &Vector3<f64>) -> Vector3<f64> {
        if self.is_across(n) { Vector3::zeros() } else { self.axes.tr_mul(n).normalize() }
    }

    /// The vector y for which c + S y is the point `at` of the ellipsoid's span (m).
    pub fn coordinates(&self, at: &Vector3<f64>) -> Vector3<f64> {
        // The columns of S are orthogonal.
        Vector3::from_fn(|axis, _| {
            let column = self.axes.column(axis);
            let square = column.norm_squared();
            if square > 0.0 { column.dot(&(at - self.centre)) / square } else { 0.0 }
        })
    }

    /// True for a point of the ellipsoid (m), to rounding.
    pub fn contains(&self, point: &Vector3<f64>) -> bool {
        let y = self.coordinates(point);
        let off = self.centre + self.axes * y - point;
        y.norm() <= 1.0 + FLAT && off.norm() <= FLAT * self.axes.amax()
    }

    /// True if all points are equally far along the unit vector `n`, to rounding: a disc with this
    /// normal.
    pub fn is_across(&self, n: &Vector3<f64>) -> bool {
        self.half_width(n) <= FLAT * self.axes.amax()
    }

    /// Second derivative of the extent n·c + |Sᵀ n| by n (m). With M = S Sᵀ and w = |Sᵀ n|,
    ///
    /// ```text
    /// (M − (M n)(M n)ᵀ/w²)/w
    /// ```
    pub fn bend(&self, n: &Vector3<f64>) -> Matrix3<f64> {
        let square = self.axes * self.axes.transpose();
        let (squared, width) = (square * n, self.half_width(n));
        (square - squared * squared.transpose() / (width * width)) / width
    }

    /// Unit normal of a disc.
    pub fn normal(&self) -> Vector3<f64> {
        self.axes.column(0).cross(&self.axes.column(1)).normalize()
    }

    /// Largest coordinates of its points relative to the centre (m).
    pub fn half_extents(&self) -> Vector3<f64> {
        Vector3::from_fn(|axis, _| self.axes.row(axis).norm())
    }

    /// Longest half axis (m).
    pub fn longest(&self) -> f64 {
        self.axes.column_iter().map(|axis| axis.norm()).fold(0.0, f64::max)
    }

    /// Longest half axis, to a factor of √3 (m).
    pub fn size(&self) -> f64 {
        self.axes.norm()
    }
}
