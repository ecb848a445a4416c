//! Unit tests of `number.rs`.

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
    let labels: Vec<_> = [-16, -3, 0, 3, 4].into_iter().map(|k| plain(&power_of_ten(k))).collect();
    assert_eq!(labels, ["10^−16", "0.001", "1", "1000", "10^4"]);
}
