//! The law of one axis of a joint as rows of eight numbers, with their derivatives: what the bodies do enters through two of
//! them alone, the axis' coordinate at both ends of the step.
//!
//! ```text
//! s = (x⁺, x_k, F, w⁺, w_k, f_limits, f_friction, f_motor)                               (P25)
//! ```
//!
//! with lengths for turns and forces for torques, by the joint's ℓ. F is the force of the whole drive, w the speed of a step
//! where an armature asks for that of the one before. A locked axis has the row x⁺/h + ε h (F − F⁰); a driven one has
//!
//! ```text
//! F − k (x₀ − x⁺) + d u − f₀ + I (u − w_k)/h − f_limits − f_friction − f_motor,   u = (x⁺ − x_k)/h
//! ```
//!
//! and of each part that is bounded one of B_δ (P26), of the bounded quantity and of what is zero between the bounds:
//!
//! ```text
//! limits: x⁺/h + ε h (f − f⁰), f;   friction, motor of a speed: f, u − u₀ + ε h (f − f⁰);   motor of a place: f, f − pull
//! ```

use super::law::Complementarity;
use crate::joint::{Axis, Drive, Motor};
use crate::plan::{DrivePart, Side};
use nalgebra::{SMatrix, SVector};

/// Numbers of s.
pub(super) const NUMBERS: usize = 8;
/// Their places.
pub(super) const END: usize = 0;
pub(super) const START: usize = 1;
pub(super) const FORCE: usize = 2;
pub(super) const SPEED: usize = 3;
pub(super) const SPEED_BEFORE: usize = 4;

pub(super) type Numbers = SVector<f64, NUMBERS>;

/// The place of the force of a part.
pub(super) fn force_of(part: DrivePart) -> usize {
    match part {
        DrivePart::Limits => 5,
        DrivePart::Friction => 6,
        DrivePart::Motor => 7,
    }
}

/// A sum of numbers and, times the compliance, how far one of them is from its anchor.
#[derive(Debug, Clone, Copy)]
struct Affine {
    constant: f64,
    by: Numbers,
    yields: Option<usize>,
}

impl Affine {
    fn of(constant: f64, terms: &[(usize, f64)]) -> Self {
        let mut by = Numbers::zeros();
        for &(number, share) in terms {
            by[number] += share;
        }
        Self { constant, by, yields: None }
    }

    fn yielding(self, number: usize) -> Self {
        Self { yields: Some(number), ..self }
    }

    fn value(&self, s: &Numbers, law: &AxisLaw) -> f64 {
        let gives = self.yields.map_or(0.0, |i| law.compliance * (s[i] - law.anchor[i]));
        self.constant + self.by.dot(s) + gives
    }

    fn slope(&self, law: &AxisLaw) -> Numbers {
        let mut slope = self.by;
        if let Some(i) = self.yields {
            slope[i] += law.compliance;
        }
        slope
    }

    fn depends(&self, number: usize) -> bool {
        self.by[number] != 0.0 || self.yields == Some(number)
    }
}

/// A row.
#[derive(Debug, Clone, Copy)]
enum Form {
    Straight(Affine),
    /// B_δ of the first one within the range and the second one.
    Bounded {
        of: Affine,
        under: Affine,
        range: [f64; 2],
    },
}

#[derive(Debug, Clone, Copy)]
struct Row {
    form: Form,
    bounds: [f64; 2],
}

/// The law of one axis in one step.
#[derive(Debug, Clone)]
pub(super) struct AxisLaw {
    rows: Vec<Row>,
    /// The numbers that are variables, with their bounds.
    variables: Vec<(usize, [f64; 2])>,
    /// δ.
    pub(super) delta: f64,
    /// ε h.
    pub(super) compliance: f64,
    /// The forces at which the compliance gives nothing.
    pub(super) anchor: Numbers,
}

/// What makes an axis' own numbers those of the program: of a coordinate, of a force and of a time.
#[derive(Debug, Clone, Copy)]
pub(super) struct AxisUnits {
    pub(super) coordinate: f64,
    pub(super) force: f64,
    pub(super) time: f64,
}

const FREE: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];
const ZERO: [f64; 2] = [0.0; 2];

impl AxisLaw {
    /// That of `axis` in steps of `time_step` (of the program); smoothed, or with every part on the `side` that is given. None
    /// of what moves freely.
    pub(super) fn new(
        axis: &Axis,
        units: &AxisUnits,
        time_step: f64,
        side: Option<&dyn Fn(DrivePart) -> Side>,
    ) -> Option<Self> {
        let mut law = Self {
            rows: Vec::new(),
            variables: vec![(FORCE, FREE)],
            delta: 0.0,
            compliance: 0.0,
            anchor: Numbers::zeros(),
        };
        match axis {
            Axis::Locked => {
                let off = Affine::of(0.0, &[(END, 1.0 / time_step)]).yielding(FORCE);
                law.rows.push(Row { form: Form::Straight(off), bounds: ZERO });
            }
            Axis::Free(drive) if *drive == Drive::NONE => return None,
            Axis::Free(drive) => law.drive(drive, units, time_step, side),
        }
        Some(law)
    }

    fn drive(
        &mut self,
        drive: &Drive,
        units: &AxisUnits,
        h: f64,
        side: Option<&dyn Fn(DrivePart) -> Side>,
    ) {
        let AxisUnits { coordinate, force, time } = *units;
        let stiff = |k: f64| k * coordinate / force;
        let damped = |d: f64| d * coordinate / (force * time);
        let inertia = drive.armature * coordinate / (force * time * time);
        let (k, d) = (stiff(drive.stiffness), damped(drive.damping));
        let constant = -k * drive.rest / coordinate - drive.force / force;
        let by_speed = d + inertia / h;
        let mut total =
            Affine::of(constant, &[(FORCE, 1.0), (END, k + by_speed / h), (START, -by_speed / h)]);
        if drive.armature > 0.0 {
            total.by[SPEED_BEFORE] -= inertia / h;
            let speed = Affine::of(0.0, &[(SPEED, 1.0), (END, -1.0 / h), (START, 1.0 / h)]);
            self.variables.push((SPEED, FREE));
            self.rows.push(Row { form: Form::Straight(speed), bounds: ZERO });
        }
        // What rests at a stop is held by the stop: the rows of what else holds it there would depend on its own.
        let stopped = side
            .is_some_and(|side| drive.limits.is_some() && side(DrivePart::Limits) != Side::Between);
        let rests = |part| stopped && side.is_some_and(|side| side(part) == Side::Between);
        let mut part =
            |part: DrivePart, of: &dyn Fn(usize) -> (Affine, Affine), range: [f64; 2]| {
                let number = force_of(part);
                total.by[number] -= 1.0;
                let (of, under) = of(number);
                self.add_part(part, (of, under), range, side.map(|side| side(part)));
            };
        if let Some(limits) = drive.limits {
            let place = |f: usize| {
                (Affine::of(0.0, &[(END, 1.0 / h)]).yielding(f), Affine::of(0.0, &[(f, 1.0)]))
            };
            part(DrivePart::Limits, &place, limits.map(|limit| limit / (coordinate * h)));
        }
        let holds = |target: f64| {
            move |f: usize| {
                let over = Affine::of(-target, &[(END, 1.0 / h), (START, -1.0 / h)]).yielding(f);
                (Affine::of(0.0, &[(f, 1.0)]), over)
            }
        };
        if drive.friction > 0.0 && !rests(DrivePart::Friction) {
            let most = drive.friction / force;
            part(DrivePart::Friction, &holds(0.0), [-most, most]);
        }
        match drive.motor {
            None => {}
            Some(Motor::Speed { .. }) if rests(DrivePart::Motor) => {}
            Some(Motor::Speed { target, most }) => {
                let most = most / force;
                part(DrivePart::Motor, &holds(target * time / coordinate), [-most, most]);
            }
            Some(Motor::Position { target, stiffness, damping, most }) => {
                let (k, d, most) = (stiff(stiffness), damped(damping), most / force);
                let follows = |f: usize| {
                    let terms = [(f, 1.0), (END, k + d / h), (START, -d / h)];
                    (Affine::of(0.0, &[(f, 1.0)]), Affine::of(-k * target / coordinate, &terms))
                };
                part(DrivePart::Motor, &follows, [-most, most]);
            }
            Some(Motor::Damper { target, damping, most }) => {
                let (d, most) = (damped(damping), most / force);
                let follows = |f: usize| {
                    let terms = [(f, 1.0), (END, d / h), (START, -d / h)];
                    let pulled = Affine::of(-d * target * time / coordinate, &terms);
                    (Affine::of(0.0, &[(f, 1.0)]), pulled)
                };
                part(DrivePart::Motor, &follows, [-most, most]);
            }
        }
        self.rows.push(Row { form: Form::Straight(total), bounds: ZERO });
    }

    /// The row of a part: smoothed, or on a side (eq. P27).
    fn add_part(
        &mut self,
        part: DrivePart,
        (of, under): (Affine, Affine),
        range: [f64; 2],
        side: Option<Side>,
    ) {
        let [low, high] = range;
        let sign = match side {
            None => {
                self.variables.push((force_of(part), FREE));
                self.rows.push(Row { form: Form::Bounded { of, under, range }, bounds: ZERO });
                return;
            }
            Some(Side::Least) => [0.0, f64::INFINITY],
            Some(Side::Between) => ZERO,
            Some(Side::Most) => [f64::NEG_INFINITY, 0.0],
        };
        let within = match side {
            Some(Side::Least) => [low; 2],
            Some(Side::Most) => [high; 2],
            _ => range,
        };
        // What is bounded is the coordinate of limits, in the row, and otherwise the variable itself.
        let (form, bounds, own) = match part {
            DrivePart::Limits => (of, within, sign),
            _ => (under, sign, within),
        };
        self.variables.push((force_of(part), own));
        self.rows.push(Row { form: Form::Straight(form), bounds });
    }

    /// The numbers that are variables, with their bounds.
    pub(super) fn variables(&self) -> &[(usize, [f64; 2])] {
        &self.variables
    }

    /// How many rows there are.
    pub(super) fn count(&self) -> usize {
        self.rows.len()
    }

    /// Of each row, what it may be.
    pub(super) fn bounds(&self) -> impl Iterator<Item = [f64; 2]> {
        self.rows.iter().map(|row| row.bounds)
    }

    /// Whether it asks for the coordinate at the step's start.
    pub(super) fn moves(&self) -> bool {
        (0..self.rows.len()).any(|row| self.depends(row, START))
    }

    /// Whether row `row` is made of number `number`.
    pub(super) fn depends(&self, row: usize, number: usize) -> bool {
        match &self.rows[row].form {
            Form::Straight(of) => of.depends(number),
            Form::Bounded { of, under, .. } => of.depends(number) || under.depends(number),
        }
    }

    /// The rows that bend.
    fn bent(&self) -> impl Iterator<Item = (usize, &Affine, &Affine, &[f64; 2])> {
        self.rows.iter().enumerate().filter_map(|(row, of)| match &of.form {
            Form::Straight(_) => None,
            Form::Bounded { of, under, range } => Some((row, of, under, range)),
        })
    }

    /// Whether the second derivatives by two numbers can differ from zero.
    pub(super) fn couples(&self, i: usize, j: usize) -> bool {
        let touches = |of: &Affine, under: &Affine, k| of.depends(k) || under.depends(k);
        self.bent().any(|(_, of, under, _)| touches(of, under, i) && touches(of, under, j))
    }

    /// The rows.
    pub(super) fn values(&self, s: &Numbers) -> impl Iterator<Item = f64> {
        self.rows.iter().map(|row| match &row.form {
            Form::Straight(of) => of.value(s, self),
            Form::Bounded { of, under, range } => {
                Between::new(of.value(s, self), under.value(s, self), range, self.delta).value
            }
        })
    }

    /// The slope of row `row`.
    pub(super) fn slope(&self, row: usize, s: &Numbers) -> Numbers {
        match &self.rows[row].form {
            Form::Straight(of) => of.slope(self),
            Form::Bounded { of, under, range } => {
                let at = Between::new(of.value(s, self), under.value(s, self), range, self.delta);
                of.slope(self) * at.slope[0] + under.slope(self) * at.slope[1]
            }
        }
    }

    /// Σ y_r ∇²(row r).
    pub(super) fn curvature(&self, s: &Numbers, y: &[f64]) -> SMatrix<f64, NUMBERS, NUMBERS> {
        let mut curvature = SMatrix::zeros();
        for (row, of, under, range) in self.bent() {
            let at = Between::new(of.value(s, self), under.value(s, self), range, self.delta);
            let (a, b) = (of.slope(self), under.slope(self));
            let [aa, ab, bb] = at.curvature.map(|entry| y[row] * entry);
            let mixed = a * b.transpose();
            curvature +=
                a * a.transpose() * aa + (mixed + mixed.transpose()) * ab + b * b.transpose() * bb;
        }
        curvature
    }

    /// The numbers near s whose forces of limits and of friction are on the path of their smoothing where the axis is off its
    /// limits and slips, and whose whole force is the sum.
    pub(super) fn on_path(&self, s: &Numbers) -> Numbers {
        let mut on_path = *s;
        for (_, of, under, [low, high]) in self.bent() {
            let (bounded, other) = (of.value(s, self), under.value(s, self));
            let part = [DrivePart::Limits, DrivePart::Friction, DrivePart::Motor];
            let Some(number) =
                part.map(force_of).into_iter().find(|i| of.depends(*i) || under.depends(*i))
            else {
                continue;
            };
            let root = self.delta.sqrt();
            if of.by[number] == 0.0 {
                let (up, down) = ((bounded - low).max(root), (high - bounded).max(root));
                on_path[number] += self.delta / up - self.delta / down;
            } else {
                let room = self.delta / other.abs().max(root);
                let (low, high) = (low + room, high - room);
                if low < high {
                    on_path[number] = bounded.clamp(low, high);
                }
            }
        }
        for row in &self.rows {
            if let Form::Straight(of) = &row.form
                && of.by[FORCE] == 1.0
                && of.yields.is_none()
            {
                on_path[FORCE] -= of.value(&on_path, self);
            }
        }
        on_path
    }
}

/// What is bounded, a, and what is zero between its bounds, b, at least 0 at the lower one and at most 0 at the upper one, as one
/// equation (Billups' composition), with its derivatives (eq. P26):
///
/// ```text
/// B_δ(a, b) = φ_δ(a − low, −φ_δ(high − a, −b))
/// ```
struct Between {
    value: f64,
    slope: [f64; 2],
    /// ∂²/∂a², ∂²/∂a∂b, ∂²/∂b².
    curvature: [f64; 3],
}

impl Between {
    fn new(a: f64, b: f64, [low, high]: &[f64; 2], delta: f64) -> Self {
        // −φ_δ(high − a, −b), which is b where there is no upper bound.
        let upper = high.is_finite().then(|| Complementarity::new(high - a, -b, delta));
        let inner = match &upper {
            None => Self { value: b, slope: [0.0, 1.0], curvature: [0.0; 3] },
            Some(of) => Self {
                value: -of.value,
                slope: [of.slope[0], of.slope[1]],
                curvature: of.curvature().map(|entry| -entry),
            },
        };
        if !low.is_finite() {
            return inner;
        }
        let outer = Complementarity::new(a - low, inner.value, delta);
        let [of_a, of_b] = [outer.slope[0], outer.slope[1]];
        let [aa, ab, bb] = outer.curvature();
        let [by_a, by_b] = inner.slope;
        let [inner_aa, inner_ab, inner_bb] = inner.curvature;
        Self {
            value: outer.value,
            slope: [of_a + of_b * by_a, of_b * by_b],
            curvature: [
                aa + 2.0 * ab * by_a + bb * by_a * by_a + of_b * inner_aa,
                ab * by_b + bb * by_a * by_b + of_b * inner_ab,
                bb * by_b * by_b + of_b * inner_bb,
            ],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounded_slopes_are_those_of_differences() {
        let inf = f64::INFINITY;
        for range in [[-1.0, 2.0], [-1.0, inf], [-inf, 2.0], [0.5, 0.5]] {
            for (a, b) in [(0.3, 0.2), (-1.1, 2.0), (2.2, -0.7), (0.5, -3.0), (-4.0, 0.0)] {
                let of = |a: f64, b: f64| Between::new(a, b, &range, 0.3);
                let (here, by) = (of(a, b), 1e-5);
                let pairs = [(of(a + by, b), of(a - by, b)), (of(a, b + by), of(a, b - by))];
                for (k, (up, down)) in pairs.into_iter().enumerate() {
                    let slope = (up.value - down.value) / (2.0 * by);
                    assert!((slope - here.slope[k]).abs() < 1e-9, "{range:?} {a} {b} {k}");
                    for j in 0..2 {
                        let bend = (up.slope[j] - down.slope[j]) / (2.0 * by);
                        assert!((bend - here.curvature[k + j]).abs() < 1e-8, "{range:?} {a} {b}");
                    }
                }
            }
        }
    }

    /// As δ vanishes it is zero on the law alone: at the lower bound with b ≥ 0, at the upper one with b ≤ 0, between with b = 0.
    #[test]
    fn without_smoothing_it_is_the_law() {
        let of = |a: f64, b: f64| Between::new(a, b, &[-1.0, 2.0], 0.0).value;
        for (a, b) in [(-1.0, 0.0), (-1.0, 3.0), (0.4, 0.0), (2.0, 0.0), (2.0, -5.0)] {
            assert!(of(a, b).abs() < 1e-14, "{a} {b}");
        }
        for (a, b) in [(-1.0, -0.1), (0.4, 0.3), (0.4, -0.3), (2.0, 0.1), (2.1, -1.0), (-1.1, 1.0)]
        {
            assert!(of(a, b).abs() > 1e-2, "{a} {b}");
        }
    }
}
