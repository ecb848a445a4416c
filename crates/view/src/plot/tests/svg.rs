//! Unit tests of `svg.rs`.

use super::*;

#[test]
fn few_curves_have_different_widths_and_many_have_one() {
    let widths = |count: usize| -> Vec<f64> {
        let series: Vec<_> =
            (0..count).map(|i| PlotSeries::new("", i, [1.0].into_iter())).collect();
        with_widths(&series).map(|(_, width)| width).collect()
    };
    assert!(widths(200).iter().all(|width| *width == 1.5));
    assert!(widths(8).windows(2).all(|pair| pair[0] > pair[1]));
}
