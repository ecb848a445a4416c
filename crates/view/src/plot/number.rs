//! Number labels in SVG markup.

/// Formats `value`, a multiple of `step`, for an axis up to magnitude `largest`. All labels of the
/// axis have the same form and enough digits to differ.
pub fn decimal(value: f64, step: f64, largest: f64) -> String {
    if value.abs() < 1e-9 * step {
        return "0".to_owned();
    }
    let digit = (step.log10() + 1e-9).floor() as i32;
    if largest < 1e7 && digit > -5 {
        return with_minus(&format!("{value:.*}", (-digit).max(0) as usize));
    }
    let exponent = (largest.log10() + 1e-9).floor() as i32;
    let mantissa = value / 10f64.powi(exponent);
    let digits = (exponent - digit).clamp(0, 6) as usize;
    with_minus(&format!("{mantissa:.digits$}·10")) + &superscript(exponent)
}

/// Formats 10^`exponent`.
pub fn power_of_ten(exponent: i32) -> String {
    match exponent {
        0..=3 => 10i32.pow(exponent.unsigned_abs()).to_string(),
        -3..0 => format!("{:.*}", exponent.unsigned_abs() as usize, 10f64.powi(exponent)),
        _ => format!("10{}", superscript(exponent)),
    }
}

/// Superscript as a raised `tspan`, since few fonts have all superscript characters.
fn superscript(exponent: i32) -> String {
    format!(
        "<tspan dy=\"-4\" font-size=\"9\">{}</tspan>{}",
        with_minus(&exponent.to_string()),
        back_to_line(4.0)
    )
}

/// Markup that resets a `dy` for the text that follows.
pub fn back_to_line(dy: f64) -> String {
    format!("<tspan dy=\"{dy}\">\u{200b}</tspan>")
}

fn with_minus(text: &str) -> String {
    text.replace('-', "−")
}

#[cfg(test)]
#[path = "tests/number.rs"]
mod tests;
