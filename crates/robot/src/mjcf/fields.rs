//! `<hfield>`: height fields of the world.

use super::MjcfReader;
use super::defaults::Defaulted;
use crate::meshes::stem;
use crate::xml::{Attributes, Element, Parsed};
use nalgebra::{Matrix3, Vector3};
use std::sync::Arc;
use tumble_core::geometry::terrain::{HeightField, MOST_HEIGHTS};
use tumble_model::heights::HeightGrid;
use tumble_model::shown;

/// Maximum size of a file of heights (bytes).
const LARGEST_FILE: u64 = 1 << 29;

impl MjcfReader<'_> {
    /// Reads the asset `<hfield>`. An error is kept until a shape with contacts uses the field.
    pub(super) fn read_field(&mut self, element: &Element) -> Parsed<()> {
        element.refuse_others("name file nrow ncol elevation size", "content_type")?;
        let name = match (element.own("name"), element.get("file")) {
            (Some(name), _) => name.to_owned(),
            (None, Some(file)) => stem(file),
            (None, None) => return Err(element.wrong("name: a name is needed")),
        };
        let field = self.field(element).map_err(|why| element.wrong(why));
        self.fields.insert(name, field.map(Arc::new));
        Ok(())
    }

    /// Field in the frame of its shape: its middle is over the origin, and its lowest height is 0.
    fn field(&self, element: &Element) -> Parsed<HeightField> {
        let size = element.numbers("size")?.unwrap_or_default();
        let &[half_x, half_y, high, _] = &size[..] else {
            return Err("size: four numbers are needed".to_owned());
        };
        let whole = |name: &str| match element.numbers(name)?.as_deref() {
            None => Ok(0),
            Some([count]) if *count >= 0.0 && count.fract() == 0.0 => Ok(*count as usize),
            Some(_) => Err(format!("{name}: a whole number is needed")),
        };
        // Heights from an image, a binary file or the element
        let grid = match element.get("file") {
            Some(file) => {
                let path = self.reading.folder.join(self.mesh_file(file));
                let bad_input =
                    |why: &dyn std::fmt::Display| format!("{}: {why}", shown::path(&path));
                let bytes =
                    (self.reading.read)(&path, LARGEST_FILE).map_err(|error| bad_input(&error))?;
                if file.to_ascii_lowercase().ends_with(".png") {
                    HeightGrid::from_png(&bytes)
                } else {
                    grid_from_binary(&bytes)
                }
                .map_err(|why| bad_input(&why))?
            }
            None => {
                let (rows, columns) = (whole("nrow")?, whole("ncol")?);
                if rows.saturating_mul(columns) > MOST_HEIGHTS {
                    return Err(format!(
                        "nrow and ncol: {rows} rows of {columns} heights are more than \
                         {MOST_HEIGHTS}; use fewer rows or columns"
                    ));
                }
                let values = element.numbers("elevation")?;
                let values = values.unwrap_or_else(|| vec![0.0; rows * columns]);
                if columns == 0 || values.len() != rows * columns {
                    return Err(format!(
                        "elevation: {} numbers are given; {rows} rows of {columns} are needed",
                        values.len()
                    ));
                }
                let rows: Vec<&[f64]> = values.chunks(columns).collect();
                // The first row is the farthest, as in an image.
                HeightGrid::from_rows(&rows)?.upside_down()
            }
        };
        // Heights from 0 to the given one
        let HeightGrid { mut values, columns } = grid;
        let low = values.iter().copied().fold(f64::INFINITY, f64::min);
        let range = values.iter().copied().fold(f64::NEG_INFINITY, f64::max) - low;
        for value in &mut values {
            *value = if range > 0.0 { (*value - low) / range * high } else { 0.0 };
        }
        let rows = values.len() / columns;
        let spacing = [2.0 * half_x / (columns - 1) as f64, 2.0 * half_y / (rows - 1) as f64];
        let field = HeightField::new(values, columns, spacing);
        let corner = Vector3::new(-half_x, -half_y, 0.0);
        let field = field.and_then(|field| field.moved_by(&Matrix3::identity(), &corner));
        field.map_err(|error| error.to_string())
    }

    /// Field that a shape names.
    pub(super) fn field_of(&self, read: &Defaulted<'_>) -> Parsed<Arc<HeightField>> {
        let name = read.needed("hfield")?;
        let known = self.fields.get(name).cloned();
        known.unwrap_or_else(|| {
            let why = format!("hfield: there is no height field {:?}", shown::line(name));
            Err(read.element().wrong(why))
        })
    }
}

/// Heights of a file with the numbers of rows and columns as 4-byte integers and the heights as
/// 4-byte numbers.
fn grid_from_binary(bytes: &[u8]) -> Parsed<HeightGrid> {
    let none = || "it is neither a PNG image nor a binary file of heights".to_owned();
    let (head, rest) = bytes.split_at_checked(8).ok_or_else(none)?;
    let (counts, _) = head.as_chunks::<4>();
    let [rows, columns] = [0, 1].map(|at| usize::try_from(i32::from_le_bytes(counts[at])));
    let (rows, columns) = (rows.map_err(|_| none())?, columns.map_err(|_| none())?);
    let (numbers, _) = rest.as_chunks::<4>();
    if columns == 0 || rows.checked_mul(columns) != Some(numbers.len()) {
        return Err(none());
    }
    let values: Vec<f64> =
        numbers.iter().map(|bytes| f64::from(f32::from_le_bytes(*bytes))).collect();
    HeightGrid::from_rows(&values.chunks(columns).collect::<Vec<_>>())
}
