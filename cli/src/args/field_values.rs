//! Values of a field in `--set`: one, or those of a range.

use tumble_scene::overrides::FieldOverride;

/// Largest number of values of a range.
const MOST: f64 = 10_000.0;

/// A field of the scene and its values as text.
#[derive(Debug, Clone)]
pub struct FieldValues {
    pub path: String,
    /// At least one.
    pub values: Vec<String>,
}

impl FieldValues {
    /// Parses `PATH=VALUE` or `PATH=FIRST:LAST:STEP`.
    pub fn parse(text: &str) -> Result<Self, String> {
        FieldOverride::parse(text)?;
        let (path, value) = text.split_once('=').unwrap_or((text, ""));
        let (path, value) = (path.trim().to_owned(), value.trim());
        let values = match range(value) {
            Some(values) => values.map_err(|why| format!("{path}={value}: {why}"))?,
            None => vec![value.to_owned()],
        };
        Ok(Self { path, values })
    }

    /// `PATH=VALUE` of the first value.
    pub fn text(&self) -> String {
        format!("{}={}", self.path, self.values[0])
    }
}

/// Numbers FIRST, FIRST + STEP, … up to LAST as texts; `None` for a text that is no range. They have the
/// decimals of the given numbers.
fn range(text: &str) -> Option<Result<Vec<String>, String>> {
    let parts: Vec<_> = text.split(':').map(str::trim).collect();
    let numbers: Vec<f64> = parts.iter().map_while(|part| part.parse().ok()).collect();
    let (&[first, last, step], [of_first, _, of_step]) = (&numbers[..], &parts[..]) else {
        return None;
    };
    let count = ((last - first) / step + 1e-9).floor() + 1.0;
    if !(1.0..=MOST).contains(&count) {
        let why = format!("a range FIRST:LAST:STEP with 1 to {MOST} values is needed");
        return Some(Err(why));
    }
    let decimals = |part: &str| part.split_once('.').map_or(0, |(_, decimals)| decimals.len());
    let decimals = decimals(of_first).max(decimals(of_step));
    let has_exponent = parts.iter().any(|part| part.contains(['e', 'E']));
    let value = |index: usize| {
        let value = first + index as f64 * step;
        if has_exponent { format!("{value:?}") } else { format!("{value:.decimals$}") }
    };
    Some(Ok((0..count as usize).map(value).collect()))
}

#[cfg(test)]
#[path = "tests/field_values.rs"]
mod tests;
