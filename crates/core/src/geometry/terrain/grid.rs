//! Height fields: heights over the points of a rectangular grid.

use super::check_placement;
use crate::error::{Error, all_in_range, in_range};
use crate::geometry::Aabb;
use nalgebra::{Matrix3, Vector3};

/// Largest number of heights of a [`HeightField`].
pub const MOST_HEIGHTS: usize = 10_000_000;

/// Heights over a rectangular grid (m).
///
/// Point (r, c) of the grid is at x = c Δx, y = r Δy in the frame of the field, with its height as
/// z. Each cell is cut from (r, c) to (r+1, c+1) in the triangles
///
/// ```text
/// 2k:   (r, c), (r, c+1), (r+1, c+1)      k = r (columns − 1) + c
/// 2k+1: (r, c), (r+1, c+1), (r+1, c)
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct HeightField {
    heights: Vec<f64>,
    columns: usize,
    spacing: [f64; 2],
    rotation: Matrix3<f64>,
    position: Vector3<f64>,
    /// Smallest and largest height.
    range: [f64; 2],
}

impl HeightField {
    /// Field with rows of `columns` heights (m) one after another, and the `spacing` Δx, Δy (m) of
    /// its columns and rows. Its first height is over the origin.
    ///
    /// # Errors
    /// Fewer than 2 rows or columns, rows that are not complete, or more than 10 million heights; a
    /// height beyond ±1e4 m; a spacing outside 1e-6…1e4 m; an extent above 2e4 m.
    pub fn new(heights: Vec<f64>, columns: usize, spacing: [f64; 2]) -> Result<Self, Error> {
        let count = columns;
        if columns < 2 {
            let field = "columns of the height field";
            let allowed = "2 or more";
            return Err(Error::Count { field, count, allowed });
        }
        let count = heights.len();
        if count < 2 * columns || !count.is_multiple_of(columns) || count > MOST_HEIGHTS {
            let allowed = "2 or more whole rows, and at most 10 million heights";
            return Err(Error::Count { field: "heights of the height field", count, allowed });
        }
        all_in_range("height of the height field (m)", &heights, -1e4, 1e4, "-1e4 to 1e4")?;
        all_in_range("spacing of the height field (m)", &spacing, 1e-6, 1e4, "1e-6 to 1e4")?;
        for (points, spacing) in [(columns, spacing[0]), (count / columns, spacing[1])] {
            let extent = (points - 1) as f64 * spacing;
            in_range("extent of the height field (m)", extent, 1e-6, 2e4, "1e-6 to 2e4")?;
        }
        let range = heights
            .iter()
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], h| [low.min(*h), high.max(*h)]);
        let (rotation, position) = (Matrix3::identity(), Vector3::zeros());
        Ok(Self { heights, columns, spacing, rotation, position, range })
    }

    /// This field rotated about the origin of its frame and then translated (m).
    ///
    /// # Errors
    /// A matrix that is not a rotation to 1e-9; a coordinate of the translation beyond ±1e4 m.
    pub fn moved_by(
        self,
        rotation: &Matrix3<f64>,
        translation: &Vector3<f64>,
    ) -> Result<Self, Error> {
        check_placement(rotation, translation)?;
        let position = rotation * self.position + translation;
        Ok(Self { rotation: rotation * self.rotation, position, ..self })
    }

    /// Heights (m), row by row.
    pub fn heights(&self) -> &[f64] {
        &self.heights
    }

    /// Number of heights in a row.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.heights.len() / self.columns
    }

    /// Δx, Δy: distances of columns and of rows (m).
    pub fn spacing(&self) -> [f64; 2] {
        self.spacing
    }

    /// Rotation from the frame of the field to the world.
    pub fn rotation(&self) -> &Matrix3<f64> {
        &self.rotation
    }

    /// Origin of the frame of the field (m, world).
    pub fn position(&self) -> &Vector3<f64> {
        &self.position
    }

    /// Point of the surface at a grid point (m, world).
    ///
    /// # Panics
    /// If there is no such row or column.
    pub fn point(&self, row: usize, column: usize) -> Vector3<f64> {
        assert!(column < self.columns, "column {column} of {}", self.columns);
        self.vertex(row * self.columns + column)
    }

    /// Number of triangles.
    pub(super) fn count(&self) -> usize {
        2 * (self.columns - 1) * (self.rows() - 1)
    }

    pub(super) fn bounds(&self) -> Aabb {
        let far = [self.columns - 1, self.rows() - 1];
        let ends: [[f64; 2]; 3] = [
            [0.0, far[0] as f64 * self.spacing[0]],
            [0.0, far[1] as f64 * self.spacing[1]],
            self.range,
        ];
        let corners = (0..8).map(|corner: usize| {
            let at = Vector3::from_fn(|axis, _| ends[axis][corner >> axis & 1]);
            self.position + self.rotation * at
        });
        let start = Vector3::repeat(f64::INFINITY);
        let (low, high) =
            corners.fold((start, -start), |(low, high), at| (low.inf(&at), high.sup(&at)));
        Aabb { low, high }
    }

    /// Place of a grid point (m, world).
    pub(super) fn vertex(&self, vertex: usize) -> Vector3<f64> {
        let (row, column) = (vertex / self.columns, vertex % self.columns);
        let [dx, dy] = self.spacing;
        let at = Vector3::new(column as f64 * dx, row as f64 * dy, self.heights[vertex]);
        self.position + self.rotation * at
    }

    /// Grid points of a triangle.
    pub(super) fn vertices(&self, triangle: usize) -> [usize; 3] {
        let (cell, wide) = (triangle / 2, self.columns - 1);
        let first = cell / wide * self.columns + cell % wide;
        let across = first + self.columns + 1;
        match triangle % 2 {
            0 => [first, first + 1, across],
            _ => [first, across, across - 1],
        }
    }

    /// Calls `visit` on the triangles at the sides of a triangle.
    pub(super) fn each_beside(&self, triangle: usize, visit: &mut dyn FnMut(usize)) {
        let (cell, wide) = (triangle / 2, self.columns - 1);
        let (row, column) = (cell / wide, cell % wide);
        visit(triangle ^ 1);
        if triangle.is_multiple_of(2) {
            if row > 0 {
                visit(2 * (cell - wide) + 1);
            }
            if column + 1 < wide {
                visit(2 * (cell + 1) + 1);
            }
        } else {
            if row + 1 < self.rows() - 1 {
                visit(2 * (cell + wide));
            }
            if column > 0 {
                visit(2 * (cell - 1));
            }
        }
    }

    /// Calls `visit` on the triangles of the cells below and above the box `around` (m, world).
    pub(super) fn visit(&self, around: &Aabb, visit: &mut dyn FnMut(usize)) {
        let middle = self.rotation.tr_mul(&((around.low + around.high) / 2.0 - self.position));
        let half = self.rotation.abs().tr_mul(&((around.high - around.low) / 2.0));
        let cells = |axis: usize, count: usize| {
            // A cell more on each side covers the rounding.
            let place = |at: f64| (at / self.spacing[axis]).floor();
            let from = place(middle[axis] - half[axis]) - 1.0;
            let to = place(middle[axis] + half[axis]) + 1.0;
            (from.max(0.0) as usize)..((to + 1.0).clamp(0.0, count as f64) as usize)
        };
        let wide = self.columns - 1;
        // The box in the frame of the field; a little more covers the rounding.
        let slack = 1e-12 * (middle.amax() + half.amax() + self.position.amax());
        let low = middle.z - half.z - slack;
        let high = middle.z + half.z + slack;
        for row in cells(1, self.rows() - 1) {
            for column in cells(0, wide) {
                let corner = row * self.columns + column;
                let near = [corner, corner + 1, corner + self.columns, corner + self.columns + 1];
                let [a, b, c, d] = near.map(|at| self.heights[at]);
                let (lower, upper) = (a.min(b).min(c.min(d)), a.max(b).max(c.max(d)));
                if lower <= high && upper >= low {
                    let cell = row * wide + column;
                    visit(2 * cell);
                    visit(2 * cell + 1);
                }
            }
        }
    }

    /// Calls `test` on the triangles of the cells along a ray (m, world), cell by cell. `test`
    /// returns the distance beyond which triangles no longer matter (m).
    pub(super) fn walk(
        &self,
        origin: &Vector3<f64>,
        direction: &Vector3<f64>,
        length: f64,
        test: &mut dyn FnMut(usize) -> f64,
    ) {
        let origin = self.rotation.tr_mul(&(origin - self.position));
        let direction = self.rotation.tr_mul(direction);
        let (wide, high) = (self.columns - 1, self.rows() - 1);
        let reach = [wide as f64 * self.spacing[0], high as f64 * self.spacing[1]];
        let high_at = Vector3::new(reach[0], reach[1], self.range[1]);
        // Rounding of the coordinates of the grid
        let margin = 1e-12 * (origin.amax() + reach[0] + reach[1] + self.range[1].abs());
        let around = Aabb { low: Vector3::new(0.0, 0.0, self.range[0]), high: high_at };
        let Some((from, to)) = around.entry(&origin, &direction, length, margin) else { return };
        // Whole columns of cells between the places where the ray crosses rows.
        let place = |distance: f64, axis: usize| {
            (origin[axis] + direction[axis] * distance) / self.spacing[axis]
        };
        let rows = {
            let (one, other) = (place(from, 1), place(to, 1));
            let first = one.min(other).floor() - 1.0;
            let last = one.max(other).floor() + 1.0;
            (first.max(0.0) as usize)..=(last.clamp(0.0, high as f64 - 1.0) as usize)
        };
        let mut limit = to;
        let upward = direction.y >= 0.0;
        let count = rows.clone().count();
        for step in 0..count {
            let row = if upward { rows.start() + step } else { rows.end() - step };
            let strip = Aabb {
                low: Vector3::new(0.0, row as f64 * self.spacing[1], self.range[0]),
                high: Vector3::new(reach[0], (row + 1) as f64 * self.spacing[1], self.range[1]),
            };
            // Cells of the row between the places where the ray enters and leaves it, and one more at each end
            let Some((enters, leaves)) = strip.entry(&origin, &direction, limit, margin) else {
                continue;
            };
            let (one, other) = (place(enters, 0), place(leaves, 0));
            let first = (one.min(other).floor() - 1.0).max(0.0) as usize;
            let last = (one.max(other).floor() + 1.0).clamp(0.0, wide as f64 - 1.0) as usize;
            for column in first..=last {
                let cell = row * wide + column;
                limit = limit.min(test(2 * cell));
                limit = limit.min(test(2 * cell + 1));
            }
        }
    }
}
