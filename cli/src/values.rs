//! Parsers of flag values.

use std::fmt::Display;
use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::str::FromStr;
use tumble_view::animation::View;

pub fn number(text: &str) -> Result<f64, String> {
    match text.trim().parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        _ => Err("a finite number is needed".to_owned()),
    }
}

/// Positive time limit, s.
pub fn seconds(text: &str) -> Result<f64, String> {
    let value = number(text).ok().filter(|value| *value > 0.0);
    value.ok_or_else(|| "a number above 0 is needed".to_owned())
}

/// Time between two checkpoints, s.
pub fn checkpoint(text: &str) -> Result<f64, String> {
    let value = number(text).ok().filter(|value| (0.0..=1e6).contains(value));
    value.ok_or_else(|| "a number from 0 to 1e6 is needed".to_owned())
}

/// Parser of a whole number between two others.
pub fn whole<T>(low: T, high: T) -> impl Fn(&str) -> Result<T, String> + Clone
where
    T: Copy + Display + FromStr + PartialOrd + Send + Sync + 'static,
{
    move |text: &str| match text.trim().parse::<T>() {
        Ok(value) if low <= value && value <= high => Ok(value),
        _ => Err(format!("a whole number from {low} to {high} is needed")),
    }
}

/// Table of a run: the file itself, or the table of states in the directory `path`.
pub fn table(path: PathBuf) -> PathBuf {
    let inside = ["states.csv", "states.csv.gz"].map(|name| path.join(name));
    inside.into_iter().find(|file| file.is_file()).unwrap_or(path)
}

/// Number of threads within the native solver's limit.
pub fn threads(text: &str) -> Result<NonZeroUsize, String> {
    let count = whole(1, 1024)(text)?;
    Ok(NonZeroUsize::new(count).unwrap_or(NonZeroUsize::MIN))
}

pub fn speed(text: &str) -> Result<f64, String> {
    let value = number(text).ok().filter(|value| (1e-4..=1e4).contains(value));
    value.ok_or_else(|| "a number from 0.0001 to 10000 is needed".to_owned())
}

pub fn view(text: &str) -> Result<View, String> {
    match numbers(text).as_deref() {
        Some(&[azimuth, elevation])
            if azimuth.abs() <= 360.0 && (0.0..=90.0).contains(&elevation) =>
        {
            Ok(View { azimuth, elevation })
        }
        _ => Err("an azimuth from -360 to 360 and an elevation from 0 to 90 are needed".to_owned()),
    }
}

/// Three numbers.
pub fn vector(text: &str) -> Result<[f64; 3], String> {
    let three = numbers(text).and_then(|numbers| numbers.try_into().ok());
    three.ok_or_else(|| "three numbers joined by commas are needed".to_owned())
}

/// A body and three numbers.
pub fn body_vector(text: &str) -> Result<(String, [f64; 3]), String> {
    let (body, numbers) =
        text.rsplit_once('=').ok_or("a body and a vector are needed, body=1,0,0")?;
    Ok((body.trim().to_owned(), vector(numbers)?))
}

/// A field and a number.
pub fn field(text: &str) -> Result<(String, f64), String> {
    let (field, value) = text.split_once('=').ok_or("a field and its value are needed, field=1")?;
    Ok((field.trim().to_owned(), number(value)?))
}

/// Range of two numbers.
pub fn range(text: &str) -> Result<[f64; 2], String> {
    let (low, high) = text.split_once("..").ok_or("two numbers are needed, 0.3..0.5")?;
    let range = [number(low)?, number(high)?];
    if (0.0..=range[1]).contains(&range[0]) {
        Ok(range)
    } else {
        Err("two numbers from 0 on are needed, the smaller first: 0.3..0.5".to_owned())
    }
}

fn numbers(text: &str) -> Option<Vec<f64>> {
    text.split(',').map(|part| number(part).ok()).collect()
}
