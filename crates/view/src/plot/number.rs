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
mod tests {
    use super::*;

    /// Text without markup.
    fn plain(label: &str) -> String {
        let raised = label.replace("<tspan dy=\"-4\" font-size=\"9\">", "^");
        raised.replace("</tspan>", "").replace("<tspan dy=\"4\">\u{200b}", "")
    }

    #[test]
    fn labels_have_the_digits_they_need() {
        for (value, step, largest, label) in [
            (0.5, 0.5, 2.0, "0.5"),
            (2.0, 0.5, 2.0, "2.0"),
            (-20.0, 10.0, 30.0, "−20"),
            (1e-17, 0.1, 1.0, "0"),
            (150_000.0, 50_000.0, 2e5, "150000"),
            (-1.5e8, 5e7, 2e8, "−1.5·10^8"),
            (5e7, 5e7, 2e8, "0.5·10^8"),
            (3e-12, 1e-12, 4e-12, "3·10^−12"),
        ] {
            assert_eq!(plain(&decimal(value, step, largest)), label);
        }
    }

    #[test]
    fn powers_of_ten_are_written_out_where_that_is_short() {
        let labels: Vec<_> =
            [-16, -3, 0, 3, 4].into_iter().map(|k| plain(&power_of_ten(k))).collect();
        assert_eq!(labels, ["10^−16", "0.001", "1", "1000", "10^4"]);
    }
}
