//! Axes: range, scale and ticks.

use super::number::{decimal, power_of_ten};

/// Kind of scale requested for a vertical axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ScaleKind {
    /// Linear over the range of the values.
    #[default]
    Linear,
    /// Linear, with 0 in the range.
    FromZero,
    /// Linear from zero, with ticks at integers.
    Count,
    /// Linear from zero, or symmetric-logarithmic if spikes would flatten the other values.
    Spikes,
    /// Logarithmic.
    Log,
}

/// Map from values to axis coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Transform {
    Identity,
    /// asinh(v / threshold): linear near 0 and logarithmic far from it.
    Symlog(f64),
    /// Decimal logarithm log₁₀ v.
    Log,
}

/// Vertical or horizontal axis.
#[derive(Debug, Clone)]
pub struct PlotAxis {
    transform: Transform,
    low: f64,
    high: f64,
    /// Values and labels.
    pub ticks: Vec<(f64, String)>,
    /// True if a logarithmic axis shows zeros, which it does at its lower end.
    zeros: bool,
}

/// Ratio to the median above which the largest value is a spike.
const SPIKE: f64 = 50.0;
/// Ratio to the largest value below which values are ignored in the median.
const NEGLIGIBLE: f64 = 1e-6;
/// Relative range below which values count as constant.
const ROUNDING: f64 = 1e-9;
/// Smallest spacing of ticks, relative to the regular spacing.
const CROWDED: f64 = 0.65;
/// Margin at each end, relative to the range.
const MARGIN: f64 = 0.06;

impl PlotAxis {
    /// Axis for `values` with about `ticks` ticks. NaN is ignored.
    pub fn new(kind: ScaleKind, values: impl Iterator<Item = f64> + Clone, ticks: usize) -> Self {
        let numbers = values.filter(|value| !value.is_nan());
        let (low, high) = numbers
            .clone()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
        if low > high {
            return Self::linear(0.0, 1.0, MARGIN, ticks);
        }
        match kind {
            ScaleKind::Linear => Self::linear(low, high, MARGIN, ticks),
            ScaleKind::FromZero => Self::linear(low.min(0.0), high.max(0.0), MARGIN, ticks),
            // As many ticks as integers at most.
            ScaleKind::Count => {
                let ticks = ticks.min(high.max(1.0) as usize);
                Self::linear(0.0, high.max(1.0), MARGIN, ticks)
            }
            ScaleKind::Log => Self::logarithmic(numbers, high, ticks),
            ScaleKind::Spikes => {
                let (low, high) = (low.min(0.0), high.max(0.0));
                match spike_threshold(numbers, high.max(-low)) {
                    Some(threshold) => Self::symlog(low, high, threshold, ticks),
                    None => Self::linear(low, high, MARGIN, ticks),
                }
            }
        }
    }

    /// Axis for `values` whose linear range is at least `least`, so that rounding errors look like
    /// zero.
    pub fn with_least_range(
        kind: ScaleKind,
        values: impl Iterator<Item = f64> + Clone,
        least: f64,
        ticks: usize,
    ) -> Self {
        let numbers = values.clone().filter(|value| !value.is_nan());
        let (low, high) = numbers
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
        if kind == ScaleKind::Log || low > high || high - low >= least {
            return Self::new(kind, values, ticks);
        }
        let middle = 0.5 * (low + high);
        // Values that are almost 0 have 0 in the middle.
        let middle = if middle.abs() < 0.5 * least { 0.0 } else { middle };
        Self::linear(middle - 0.5 * least, middle + 0.5 * least, MARGIN, ticks)
    }

    /// Linear axis from `low` to `high`, extended on both sides by `margin` times the range.
    pub fn linear(low: f64, high: f64, margin: f64, ticks: usize) -> Self {
        let size = high.abs().max(low.abs());
        let (low, high) = if high - low > ROUNDING * size && size > 1e-12 {
            (low, high)
        } else {
            let room = if size > 1e-12 { 0.1 * size } else { 1.0 };
            (low - room, high + room)
        };
        let room = margin * (high - low);
        let (low, high) = (low - room, high + room);
        let step = nice_step((high - low) / ticks as f64);
        let (first, last) = ((low / step).ceil() as i64, (high / step).floor() as i64);
        let largest = first.unsigned_abs().max(last.unsigned_abs()) as f64 * step;
        let ticks = (first..=last).map(|k| k as f64 * step);
        let ticks = ticks.map(|value| (value, decimal(value, step, largest))).collect();
        Self { transform: Transform::Identity, low, high, ticks, zeros: false }
    }

    fn symlog(low: f64, high: f64, threshold: f64, ticks: usize) -> Self {
        let transform = Transform::Symlog(threshold);
        let low = -ceiling(-low);
        let high = ceiling(high);
        let (bottom, top) = (transform.apply(low), transform.apply(high));
        let room = MARGIN * (top - bottom);
        let first = threshold.log10().round() as i32;
        let decades = (0..).take_while(|k| threshold * 10f64.powi(*k) <= high.max(-low)).count();
        let stride = decades.div_ceil(ticks).max(1);
        let mut marks = vec![(0.0, "0".to_owned())];
        // The tick at the threshold may be too close to the tick at 0.
        let crowded = transform.apply(threshold) < CROWDED * (top - bottom) / ticks as f64;
        let skipped = usize::from(crowded);
        // The largest exponent has a tick.
        let skipped = skipped + decades.saturating_sub(skipped + 1) % stride;
        for exponent in (first..).take(decades).skip(skipped).step_by(stride) {
            let value = 10f64.powi(exponent);
            let both = [(value, String::new()), (-value, "−".to_owned())];
            for (value, sign) in both.into_iter().filter(|(v, _)| low <= *v && *v <= high) {
                marks.push((value, sign + &power_of_ten(exponent)));
            }
        }
        Self { transform, low: bottom - room, high: top + room, ticks: marks, zeros: false }
    }

    fn logarithmic(numbers: impl Iterator<Item = f64> + Clone, high: f64, ticks: usize) -> Self {
        let zeros = numbers.clone().any(|value| value <= 0.0);
        let low = numbers.filter(|value| *value > 0.0).fold(f64::INFINITY, f64::min);
        let (first, last) = if low <= high {
            (low.log10().floor() as i32, high.log10().ceil() as i32)
        } else {
            (-16, -15)
        };
        let last = last.max(first + 1);
        let stride = ((last - first) as usize).div_ceil(ticks).max(1);
        // The largest exponent has a tick.
        let ticks = (first..=last)
            .skip((last - first) as usize % stride)
            .step_by(stride)
            .map(|exponent| (10f64.powi(exponent), power_of_ten(exponent)))
            .collect();
        let room = MARGIN * f64::from(last - first);
        let (low, high) = (f64::from(first) - room, f64::from(last) + room);
        Self { transform: Transform::Log, low, high, ticks, zeros }
    }

    /// Relative position of `value`: 0 at the low end, 1 at the high end.
    pub fn fraction(&self, value: f64) -> f64 {
        ((self.transform.apply(value) - self.low) / (self.high - self.low)).clamp(0.0, 1.0)
    }

    /// Map from values to axis coordinates.
    pub fn transform(&self) -> Transform {
        self.transform
    }

    /// Values at the low and high end.
    pub fn ends(&self) -> [f64; 2] {
        [self.low, self.high].map(|at| self.transform.value_at(at))
    }

    /// True if a logarithmic axis shows zeros, which it does at its lower end.
    pub fn has_zeros(&self) -> bool {
        self.zeros
    }

    /// Remark on the scale for the label. `unit` is the unit of the values.
    pub fn remark(&self, unit: &str) -> Option<String> {
        match self.transform {
            Transform::Identity => None,
            Transform::Symlog(threshold) => {
                let threshold = power_of_ten(threshold.log10().round() as i32);
                Some(format!("symlog axis, linear below {threshold} {unit}"))
            }
            Transform::Log if self.zeros => Some("log axis, 0 at its lower end".to_owned()),
            Transform::Log => Some("log axis".to_owned()),
        }
    }
}

impl Transform {
    fn apply(self, value: f64) -> f64 {
        match self {
            Self::Identity => value,
            Self::Symlog(threshold) => (value / threshold).asinh(),
            Self::Log => value.max(f64::MIN_POSITIVE).log10(),
        }
    }

    /// Inverse of [`Self::of`].
    fn value_at(self, place: f64) -> f64 {
        match self {
            Self::Identity => place,
            Self::Symlog(threshold) => threshold * place.sinh(),
            Self::Log => 10f64.powf(place),
        }
    }
}

/// Power of ten above `size`, unless that would leave much of the axis empty.
fn ceiling(size: f64) -> f64 {
    if size > 0.0 { size.max(10f64.powf((0.5 * size).log10().ceil())) } else { size }
}

/// Threshold of a symmetric-logarithmic axis if the magnitude `largest` is a spike. It is the power
/// of ten below the median magnitude of the non-negligible `numbers`.
fn spike_threshold(numbers: impl Iterator<Item = f64>, largest: f64) -> Option<f64> {
    let mut sizes: Vec<f64> =
        numbers.map(f64::abs).filter(|size| *size > NEGLIGIBLE * largest).collect();
    if sizes.is_empty() {
        return None;
    }
    let middle = sizes.len() / 2;
    let (_, &mut median, _) = sizes.select_nth_unstable_by(middle, f64::total_cmp);
    (largest > SPIKE * median).then(|| 10f64.powi(median.log10().floor() as i32))
}

/// Number 1, 2 or 5 times a power of ten that is not much below `step`.
fn nice_step(step: f64) -> f64 {
    let power = 10f64.powf(step.log10().floor());
    let factor = [1.0, 2.0, 5.0].into_iter().find(|factor| factor * power >= 0.75 * step);
    factor.unwrap_or(10.0) * power
}

#[cfg(test)]
#[path = "tests/scale.rs"]
mod tests;
