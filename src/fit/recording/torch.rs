//! A toss as `torch.save` writes a tensor: a zip archive with a pickle that describes it, and its
//! numbers.

use super::Toss;
use super::pickle::{self, Number, Tensor};
use crate::fit::error::FitError;
use crate::mechanics::State;
use std::io::{Cursor, Read};
use zip::ZipArchive;

/// More bytes than this in an entry are no toss.
const MOST_BYTES: u64 = 1 << 26;

/// The toss of a file `.pt`: a T × 13 tensor of floats or doubles with the columns attitude (w, x,
/// y, z; body → world), position (m), spin (rad/s, body), velocity (m/s, world), at `rate` frames a
/// second.
///
/// # Errors
/// What is no such file; as [`Toss::checked`].
pub fn read_torch(bytes: &[u8], name: &str, rate: f64) -> Result<Toss, FitError> {
    let frames =
        frames(bytes).map_err(|why| FitError::File(format!("it is no tensor of a toss: {why}")))?;
    Toss::new(name, rate, frames).checked()
}

fn frames(bytes: &[u8]) -> Result<Vec<State>, String> {
    let mut archive = ZipArchive::new(Cursor::new(bytes)).map_err(|error| error.to_string())?;
    let names = archive.file_names().map(|name| name.map(|name| name.into_owned()));
    let names = names.collect::<Result<Vec<String>, _>>().map_err(|error| error.to_string())?;
    let root = names.iter().find_map(|name| name.strip_suffix("data.pkl"));
    let root = root.ok_or("the archive has no data.pkl")?;
    let tensor = pickle::tensor(&entry(&mut archive, &format!("{root}data.pkl"))?)?;
    let order = format!("{root}byteorder");
    if names.contains(&order) && entry(&mut archive, &order)? != b"little" {
        return Err("its numbers are big-endian; little-endian ones are needed".to_owned());
    }
    let numbers = numbers(&entry(&mut archive, &format!("{root}data/{}", tensor.key))?, &tensor);
    let [rows, columns] = tensor.shape;
    if columns != State::LEN {
        return Err(format!("the tensor is {rows} × {columns}; T × 13 is needed"));
    }
    let at = |row: usize, column: usize| {
        let place = row
            .checked_mul(tensor.strides[0])
            .and_then(|place| place.checked_add(column.checked_mul(tensor.strides[1])?))
            .and_then(|place| place.checked_add(tensor.offset));
        place.and_then(|place| numbers.get(place).copied())
    };
    let frame = |row: usize| {
        let x: Option<Vec<f64>> = (0..State::LEN).map(|column| at(row, column)).collect();
        let x = x.ok_or("the tensor is longer than its numbers")?;
        Ok(State {
            attitude: [x[0], x[1], x[2], x[3]].into(),
            position: [x[4], x[5], x[6]].into(),
            spin: [x[7], x[8], x[9]].into(),
            velocity: [x[10], x[11], x[12]].into(),
        })
    };
    (0..rows).map(frame).collect()
}

fn entry(archive: &mut ZipArchive<Cursor<&[u8]>>, name: &str) -> Result<Vec<u8>, String> {
    let file = archive.by_name(name).map_err(|error| format!("{name}: {error}"))?;
    let mut bytes = Vec::new();
    let read = file.take(MOST_BYTES + 1).read_to_end(&mut bytes);
    read.map_err(|error| format!("{name}: {error}"))?;
    if bytes.len() as u64 > MOST_BYTES {
        return Err(format!("{name} is longer than {MOST_BYTES} bytes"));
    }
    Ok(bytes)
}

fn numbers(bytes: &[u8], tensor: &Tensor) -> Vec<f64> {
    match tensor.number {
        Number::F32 => {
            let (words, _) = bytes.as_chunks::<4>();
            words.iter().map(|word| f64::from(f32::from_le_bytes(*word))).collect()
        }
        Number::F64 => {
            let (words, _) = bytes.as_chunks::<8>();
            words.iter().map(|word| f64::from_le_bytes(*word)).collect()
        }
    }
}
