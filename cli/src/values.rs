//! Parsers of flag values.

use nalgebra::Vector3;
use std::fmt::Display;
use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::str::FromStr;
use tumble_core::world::Plane;
use tumble_model::fields::Exactly;
use tumble_scene::{AttitudeEntry, InertiaValue, Random, SolidInertia};
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

fn numbers(text: &str) -> Option<Vec<f64>> {
    text.split(',').map(|part| number(part).ok()).collect()
}

pub fn vector(text: &str) -> Result<Vector3<f64>, String> {
    match numbers(text).as_deref() {
        Some(&[x, y, z]) => Ok(Vector3::new(x, y, z)),
        _ => Err("three finite numbers X,Y,Z are needed".to_owned()),
    }
}

pub fn sides(text: &str) -> Result<Vector3<f64>, String> {
    match numbers(text).as_deref() {
        Some(&[side]) => Ok(Vector3::repeat(side)),
        Some(&[x, y, z]) => Ok(Vector3::new(x, y, z)),
        _ => Err("one finite number (a cube) or three X,Y,Z are needed".to_owned()),
    }
}

pub fn gravity(text: &str) -> Result<Vector3<f64>, String> {
    match numbers(text).as_deref() {
        // Zero gravity becomes 0, not -0.
        Some(&[g]) => Ok(Vector3::new(0.0, 0.0, 0.0 - g)),
        Some(&[x, y, z]) => Ok(Vector3::new(x, y, z)),
        _ => Err("one finite number (downwards) or three X,Y,Z are needed".to_owned()),
    }
}

pub fn inertia(text: &str) -> Result<InertiaValue, String> {
    if text.trim() == "solid" {
        return Ok(InertiaValue::Word(SolidInertia::Solid));
    }
    match numbers(text).as_deref() {
        Some(&[moment]) => Ok(InertiaValue::Moment(moment)),
        Some(&[x, y, z]) => Ok(InertiaValue::Diagonal(Exactly([x, y, z]))),
        Some(&[a, b, c, d, e, f, g, h, i]) => {
            Ok(InertiaValue::Rows(Exactly([[a, b, c], [d, e, f], [g, h, i]].map(Exactly))))
        }
        _ => Err("one, three or nine finite numbers, or `solid`, are needed".to_owned()),
    }
}

pub fn attitude(text: &str) -> Result<AttitudeEntry, String> {
    if text.trim() == "random" {
        return Ok(AttitudeEntry::Word(Random::Tutorial));
    }
    let needed = || "four finite numbers W,X,Y,Z, or `random`, are needed".to_owned();
    let quaternion = numbers(text).and_then(|numbers| numbers.try_into().ok());
    let attitude = AttitudeEntry::Quaternion(Exactly(quaternion.ok_or_else(needed)?));
    attitude.quaternion().map(|_| attitude)
}

pub fn plane(text: &str) -> Result<Plane, String> {
    match numbers(text).as_deref() {
        Some(&[slope]) => Plane::sloping(slope),
        Some(&[x, y, z]) => Plane::new(Vector3::new(x, y, z), 0.0),
        Some(&[x, y, z, offset]) => Plane::new(Vector3::new(x, y, z), offset),
        _ => {
            let needed = "a slope in degrees, a normal NX,NY,NZ or a normal and an offset \
                          NX,NY,NZ,D are needed";
            return Err(needed.to_owned());
        }
    }
    .map_err(|error| error.to_string())
}

pub use tumble_scene::settings::LoadKnot;

pub fn load_knot(text: &str) -> Result<LoadKnot, String> {
    let needed = "three finite numbers X,Y,Z, or T:X,Y,Z with a time in s, are needed";
    let (time, value) = match text.split_once(':') {
        Some((time, value)) => (Some(number(time).map_err(|_| needed.to_owned())?), value),
        None => (None, text),
    };
    Ok((time, vector(value).map_err(|_| needed.to_owned())?))
}

#[cfg(test)]
#[path = "tests/values.rs"]
mod tests;
