//! Grids of heights from files: PNG, NumPy arrays, and text with separators.

use crate::{NO_FILES, READS_FILES};
use std::io::Cursor;
use tumble_core::geometry::terrain::MOST_HEIGHTS;

/// A grid of numbers, row by row. The first row is at the smallest y.
#[derive(Debug, Clone, PartialEq)]
pub struct HeightGrid {
    /// Numbers, row by row.
    pub values: Vec<f64>,
    /// Number of numbers in a row.
    pub columns: usize,
}

impl HeightGrid {
    /// Grid of rows.
    ///
    /// # Errors
    /// Rows of different lengths, or none.
    pub fn from_rows<R: AsRef<[f64]>>(rows: &[R]) -> Result<Self, String> {
        let columns = rows.first().map_or(0, |row| row.as_ref().len());
        if let Some(invalid) = rows.iter().position(|row| row.as_ref().len() != columns) {
            let count = rows[invalid].as_ref().len();
            return Err(format!(
                "row {} has {count} heights and row 1 has {columns}; all rows need the same number",
                invalid + 1
            ));
        }
        let values = rows.iter().flat_map(|row| row.as_ref()).copied().collect();
        Self { values, columns }.checked()
    }

    /// Grid of the file with this name, by its ending.
    ///
    /// # Errors
    /// A file in another format, or one that is damaged.
    pub fn from_file(name: &str, bytes: &[u8]) -> Result<Self, String> {
        let ending = name.rsplit('.').next().unwrap_or_default().to_ascii_lowercase();
        match &*ending {
            "png" => Self::from_png(bytes),
            "npy" => Self::from_npy(bytes),
            "csv" | "txt" => Self::from_text(bytes),
            _ => Err("a file name that ends in .png, .npy or .csv is needed".to_owned()),
        }
    }

    /// Grid of a grey PNG image of 8 or 16 bits. Black is 0 and white is 1. The upper row of the image
    /// is at the largest y.
    ///
    /// # Errors
    /// Another image.
    pub fn from_png(bytes: &[u8]) -> Result<Self, String> {
        if !READS_FILES {
            return Err(NO_FILES.to_owned());
        }
        let no_png = |error: png::DecodingError| format!("it is not a PNG image: {error}");
        let mut reader = png::Decoder::new(Cursor::new(bytes)).read_info().map_err(no_png)?;
        let (colour, depth) = reader.output_color_type();
        let bits: u32 = match (colour, depth) {
            (png::ColorType::Grayscale, png::BitDepth::Eight) => 8,
            (png::ColorType::Grayscale, png::BitDepth::Sixteen) => 16,
            _ => {
                return Err(format!(
                    "the image is {colour:?} of {} bits; convert it to grey of 8 or 16 bits",
                    depth as u8
                ));
            }
        };
        let columns = reader.info().width as usize;
        let size = reader.output_buffer_size().filter(|size| size / 2 <= MOST_HEIGHTS);
        let size = size.ok_or_else(|| format!("the image has more than {MOST_HEIGHTS} pixels"))?;
        let mut buffer = vec![0; size];
        let line = reader.next_frame(&mut buffer).map_err(no_png)?.line_size;
        let row = |row: &[u8]| -> Vec<f64> {
            match bits {
                8 => row.iter().map(|grey| f64::from(*grey) / 255.0).collect(),
                _ => row
                    .as_chunks::<2>()
                    .0
                    .iter()
                    .map(|two| f64::from(u16::from_be_bytes(*two)) / 65535.0)
                    .collect(),
            }
        };
        let values = buffer.chunks(line).rev().flat_map(row).collect();
        Self { values, columns }.checked()
    }

    /// Grid of a two-dimensional NumPy array of numbers.
    ///
    /// # Errors
    /// Another array.
    pub fn from_npy(bytes: &[u8]) -> Result<Self, String> {
        let none = || "it is not a NumPy file; save it with `numpy.save`".to_owned();
        let rest = bytes.strip_prefix(b"\x93NUMPY").ok_or_else(none)?;
        let (&[major, _], rest) = rest.split_first_chunk::<2>().ok_or_else(none)?;
        let (length, rest) = match major {
            1 => {
                let (length, rest) = rest.split_first_chunk::<2>().ok_or_else(none)?;
                (u32::from(u16::from_le_bytes(*length)), rest)
            }
            _ => {
                let (length, rest) = rest.split_first_chunk::<4>().ok_or_else(none)?;
                (u32::from_le_bytes(*length), rest)
            }
        };
        let (header, data) = rest.split_at_checked(length as usize).ok_or_else(none)?;
        let header = std::str::from_utf8(header).map_err(|_| none())?;
        let after = |key: &str| Some(header.split_once(key)?.1.trim_start_matches([':', ' ']));
        let kind = after("'descr'").and_then(|text| text.split('\'').nth(1)).ok_or_else(none)?;
        let by_columns = after("'fortran_order'").is_some_and(|text| text.starts_with("True"));
        let shape = after("'shape'").and_then(|text| text.strip_prefix('(')).ok_or_else(none)?;
        let shape = shape.split(')').next().unwrap_or_default();
        let sizes = shape.split(',').map(str::trim).filter(|part| !part.is_empty());
        let sizes: Option<Vec<usize>> = sizes.map(|part| part.parse().ok()).collect();
        let Some(&[rows, columns]) = sizes.as_deref() else {
            return Err(format!("the array has the shape ({shape}); two dimensions are needed"));
        };
        let count = rows.checked_mul(columns).filter(|count| *count <= MOST_HEIGHTS);
        let count = count.ok_or_else(|| format!("it has more than {MOST_HEIGHTS} numbers"))?;
        let numbers = numbers_of(kind, data)?;
        if numbers.len() < count {
            return Err(format!(
                "it has {} of {count} numbers: the file is truncated",
                numbers.len()
            ));
        }
        let values = if by_columns {
            (0..count).map(|at| numbers[at % columns * rows + at / columns]).collect()
        } else {
            numbers[..count].to_vec()
        };
        Self { values, columns }.checked()
    }

    /// Grid of lines of numbers with one separator: semicolons if there are any, else tabs, else commas,
    /// else spaces. Numbers have decimal points. Lines that begin with `#` are comments.
    ///
    /// # Errors
    /// A field that is not a number.
    pub fn from_text(bytes: &[u8]) -> Result<Self, String> {
        if !READS_FILES {
            return Err(NO_FILES.to_owned());
        }
        let text = std::str::from_utf8(bytes).map_err(|_| "it is not text".to_owned())?;
        let lines = || text.lines().filter(|line| !line.trim_start().starts_with('#'));
        let has = |separator: &u8| lines().any(|line| line.as_bytes().contains(separator));
        let Some(separator) = b";\t,".iter().copied().find(has) else {
            let of_line = |(index, line): (usize, &str)| -> Result<Vec<f64>, String> {
                line.split_whitespace()
                    .map(number_of)
                    .collect::<Result<_, _>>()
                    .map_err(|why| format!("line {}: {why}", index + 1))
            };
            let rows =
                text.lines().enumerate().filter(|(_, line)| !line.trim_start().starts_with('#'));
            let rows: Vec<_> = rows.map(of_line).collect::<Result<_, _>>()?;
            return Self::from_rows(
                &rows.into_iter().filter(|row| !row.is_empty()).collect::<Vec<_>>(),
            );
        };
        let mut reader = csv::ReaderBuilder::new();
        reader.delimiter(separator).has_headers(false).flexible(true).comment(Some(b'#'));
        let mut rows = Vec::new();
        for record in reader.trim(csv::Trim::All).from_reader(bytes).records() {
            let record = record.map_err(|error| error.to_string())?;
            let start = record.position().map_or(0, |position| position.byte() as usize);
            // A separator may end the line.
            let fields = record.iter().enumerate();
            let fields = fields.filter(|(at, field)| at + 1 < record.len() || !field.is_empty());
            let number = |(_, field)| number_of(field).map_err(|why| on_line(text, start, &why));
            let row = fields.map(number).collect::<Result<Vec<_>, _>>()?;
            if !row.is_empty() {
                rows.push(row);
            }
        }
        Self::from_rows(&rows)
    }

    /// Grid of packed heights: little-endian bytes, compressed by deflate, in Base64.
    ///
    /// # Errors
    /// Another text.
    pub fn from_packed(text: &str, columns: usize) -> Result<Self, String> {
        let values = crate::packed::unpack_floats(text)?;
        if columns == 0 || !values.len().is_multiple_of(columns) {
            return Err(format!("{} heights are not rows of {columns}", values.len()));
        }
        Self { values, columns }.checked()
    }

    /// The grid with its rows in the opposite order.
    #[must_use]
    pub fn upside_down(self) -> Self {
        let rows = self.values.chunks(self.columns).rev();
        Self { values: rows.flatten().copied().collect(), ..self }
    }

    fn checked(self) -> Result<Self, String> {
        let count = self.values.len();
        let rows = count.checked_div(self.columns).unwrap_or(0);
        if self.columns < 2 || rows < 2 || count > MOST_HEIGHTS {
            return Err(format!(
                "{rows} rows of {} heights are given; allowed: 2 × 2 or more, and at most \
                 {MOST_HEIGHTS}",
                self.columns
            ));
        }
        match self.values.iter().position(|height| !height.is_finite()) {
            Some(at) => Err(format!(
                "the height in row {}, column {} is {}; finite numbers are needed",
                at / self.columns + 1,
                at % self.columns + 1,
                self.values[at]
            )),
            None => Ok(self),
        }
    }
}

/// Number of a field of a text file.
fn number_of(field: &str) -> Result<f64, String> {
    field.parse().map_err(|_| {
        let remedy = match field.replacen(',', ".", 1).parse::<f64>() {
            Ok(number) => format!("write {number}"),
            Err(_) => "remove headings".to_owned(),
        };
        format!("{field:?} is not a number; {remedy}")
    })
}

/// Error of the first line with content from byte `start` of `text` on.
fn on_line(text: &str, start: usize, why: &str) -> String {
    let breaks = |bytes: &[u8]| bytes.iter().filter(|byte| **byte == b'\n').count();
    let (before, rest) = text.as_bytes().split_at(start.min(text.len()));
    let blank = rest.iter().take_while(|byte| byte.is_ascii_whitespace()).count();
    format!("line {}: {why}", 1 + breaks(before) + breaks(&rest[..blank]))
}

/// Numbers of a NumPy type: byte order, kind and size in bytes.
fn numbers_of(descr: &str, data: &[u8]) -> Result<Vec<f64>, String> {
    fn all<const N: usize>(data: &[u8], is_big: bool, number: impl Fn([u8; N]) -> f64) -> Vec<f64> {
        let chunks = data.as_chunks::<N>().0.iter().copied();
        let little = chunks.map(|mut bytes| {
            if is_big {
                bytes.reverse();
            }
            bytes
        });
        little.map(number).collect()
    }
    let other = || format!("the array has the type {descr:?}; save it with `astype(float)`");
    let (order, kind) = descr.split_at_checked(1).ok_or_else(other)?;
    let big = order == ">";
    Ok(match kind {
        "f8" => all(data, big, f64::from_le_bytes),
        "f4" => all(data, big, |bytes| f64::from(f32::from_le_bytes(bytes))),
        "f2" => all(data, big, |bytes| half(u16::from_le_bytes(bytes))),
        "b1" | "u1" => all(data, big, |[byte]| f64::from(byte)),
        "i1" => all(data, big, |bytes| f64::from(i8::from_le_bytes(bytes))),
        "u2" => all(data, big, |bytes| f64::from(u16::from_le_bytes(bytes))),
        "i2" => all(data, big, |bytes| f64::from(i16::from_le_bytes(bytes))),
        "u4" => all(data, big, |bytes| f64::from(u32::from_le_bytes(bytes))),
        "i4" => all(data, big, |bytes| f64::from(i32::from_le_bytes(bytes))),
        "u8" => all(data, big, |bytes| u64::from_le_bytes(bytes) as f64),
        "i8" => all(data, big, |bytes| i64::from_le_bytes(bytes) as f64),
        _ => return Err(other()),
    })
}

/// Number with 5 bits of exponent and 10 of mantissa (IEEE 754 binary16). Infinite ones become NaN too.
fn half(bits: u16) -> f64 {
    let (exponent, mantissa) = (i32::from(bits >> 10 & 31), f64::from(bits & 1023) / 1024.0);
    let size = match exponent {
        0 => mantissa * 2f64.powi(-14),
        31 => f64::NAN,
        _ => (1.0 + mantissa) * 2f64.powi(exponent - 15),
    };
    if bits >> 15 == 1 { -size } else { size }
}

#[cfg(test)]
#[path = "tests/heights.rs"]
mod tests;
