//! Unit tests of `scale.rs`.

use super::*;

fn labels(axis: &PlotAxis) -> Vec<&str> {
    axis.ticks.iter().map(|(_, label)| label.as_str()).collect()
}

#[test]
fn linear_ticks_are_round_numbers_inside_the_range() {
    let axis = PlotAxis::new(ScaleKind::Linear, [-1.02, 3.9].into_iter(), 5);
    assert_eq!(labels(&axis), ["−1", "0", "1", "2", "3", "4"]);
    let constant = PlotAxis::new(ScaleKind::Linear, [25.0, 25.0].into_iter(), 4);
    assert!((constant.fraction(25.0) - 0.5).abs() < 1e-12);
    assert!(constant.ticks.len() >= 2);
}

#[test]
fn axis_shows_rounding_errors_as_zero() {
    let noise = [1e-13, -3e-13, 2e-13];
    let axis = PlotAxis::with_least_range(ScaleKind::Linear, noise.into_iter(), 1e-4, 5);
    assert!(noise.iter().all(|value| (axis.fraction(*value) - 0.5).abs() < 1e-6));
    let far = noise.map(|value| 25.0 + value);
    let axis = PlotAxis::with_least_range(ScaleKind::Linear, far.into_iter(), 1e-4, 5);
    assert!((axis.fraction(25.0) - 0.5).abs() < 1e-6 && axis.ends()[0] > 24.9);
    // A larger range is the same with and without it.
    let values = [0.0, 2.0];
    let wide = PlotAxis::with_least_range(ScaleKind::Linear, values.into_iter(), 1e-4, 5);
    let plain = PlotAxis::new(ScaleKind::Linear, values.into_iter(), 5);
    assert_eq!(wide.ends(), plain.ends());
}

#[test]
fn axis_with_an_impact_still_resolves_the_weight() {
    let forces = std::iter::repeat_n(25.0, 400).chain([20_000.0, 0.0]);
    let axis = PlotAxis::new(ScaleKind::Spikes, forces, 8);
    assert_eq!(labels(&axis), ["0", "10", "100", "1000", power_of_ten(4).as_str()]);
    assert_eq!(axis.remark("N").unwrap(), "symlog axis, linear below 10 N");
    let height = axis.fraction(25.0) - axis.fraction(0.0);
    assert!(height > 0.15, "{height}");
    assert!(axis.fraction(20_000.0) < 1.0);
}

#[test]
fn counts_have_ticks_at_integers() {
    for most in 0..40 {
        let axis = PlotAxis::new(ScaleKind::Count, [0.0, f64::from(most)].into_iter(), 4);
        assert!(axis.ticks.len() >= 2 && axis.ticks.len() < 9, "{most}");
        assert!(axis.ticks.iter().all(|(value, _)| value.fract() == 0.0), "{most}");
    }
}

#[test]
fn logarithmic_axes_have_a_tick_near_their_top() {
    for decades in 1..20 {
        let values = [1e-3, 1e-3 * 10f64.powi(decades)];
        let axis = PlotAxis::new(ScaleKind::Log, values.into_iter(), 5);
        assert_eq!(labels(&axis).last().unwrap(), &power_of_ten(decades - 3));
    }
    for (largest, top) in [(600.0, 3), (150.0, 2), (6e5, 6)] {
        let forces = std::iter::repeat_n(2.5, 400).chain([largest]);
        let axis = PlotAxis::new(ScaleKind::Spikes, forces, 5);
        assert_eq!(labels(&axis).last().unwrap(), &power_of_ten(top), "{largest}");
    }
}

#[test]
fn without_spikes_the_axis_is_linear() {
    let axis = PlotAxis::new(ScaleKind::Spikes, [0.0, 25.0, 30.0].into_iter(), 5);
    assert_eq!(axis.remark("N"), None);
    assert_eq!(PlotAxis::new(ScaleKind::Spikes, [0.0; 9].into_iter(), 5).remark("N"), None);
}

#[test]
fn a_logarithmic_axis_has_a_place_for_zero() {
    let axis = PlotAxis::new(ScaleKind::Log, [0.0, 3e-16, 2e-3].into_iter(), 7);
    assert_eq!(axis.fraction(0.0), 0.0);
    assert!(axis.remark("m/s").unwrap().contains("0 at its lower end"));
    assert_eq!(labels(&axis).first(), Some(&power_of_ten(-16).as_str()));
    let empty = PlotAxis::new(ScaleKind::Log, [0.0, 0.0].into_iter(), 7);
    assert_eq!(empty.fraction(0.0), 0.0);
}

#[test]
fn every_value_is_on_the_axis() {
    let values = [-3e7, 1e-9, 4.2, 9e11];
    for kind in [ScaleKind::Linear, ScaleKind::FromZero, ScaleKind::Spikes] {
        let axis = PlotAxis::new(kind, values.into_iter(), 5);
        for value in values {
            let fraction = axis.fraction(value);
            assert!(fraction > 0.0 && fraction < 1.0, "{kind:?} {value}: {fraction}");
        }
        let [low, high] = axis.ends();
        assert!(axis.fraction(low) < 1e-9 && axis.fraction(high) > 1.0 - 1e-9, "{kind:?}");
    }
}
