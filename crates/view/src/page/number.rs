//! Number formats of tables.

/// Formats six digits, or three digits with a power of ten for very small or large numbers. NaN
/// becomes a dash.
pub fn figure(value: f64) -> String {
    let size = value.abs();
    if value.is_nan() {
        "—".to_owned()
    } else if size == 0.0 {
        "0".to_owned()
    } else if (1e-4..1e6).contains(&size) {
        let digits = (5 - size.log10().floor() as i32).clamp(0, 9) as usize;
        format!("{value:.digits$}")
    } else {
        format!("{value:.2e}")
    }
}

/// HTML of a number from [`figure`]: `−1.2·10⁻³` instead of `-1.2e-3`.
pub fn html(text: &str) -> String {
    match text.split_once('e') {
        Some((mantissa, exponent)) if exponent.parse::<i32>().is_ok() => {
            format!("{mantissa}·10<sup>{exponent}</sup>").replace('-', "−")
        }
        _ => text.replace('-', "−"),
    }
}

#[cfg(test)]
#[path = "tests/number.rs"]
mod tests;
