//! One joint of the program: its coordinates as functions of poses, what its forces put on its bodies at the poses of the
//! step's start, and the rows of its axes (eqs. P24 to P27).
//!
//! With the columns x, y, z of its frame in A and in B, each turned to the world, and ℓ the joint's length,
//!
//! ```text
//! place:     F_Bᵀ (A_Bᵀ (r_A + A_A a − r_B) − b)
//! locked:    ℓ (y_A·z_B, −x_A·z_B, x_A·y_B)
//! a hinge's: ℓ atan2(x_A·y_B − y_A·x_B, x_A·x_B + y_A·y_B) and whole turns                  (P24)
//! ```
//!
//! At a hinge that is in order, and at what is fixed, ∂/∂ω_A of these are ℓ times the axes of A, at any angle: about these the
//! torques ℓ T act.

mod load;

use super::axis::{AxisLaw, END, NUMBERS, Numbers, START};
use super::contact::{Acts, Arm, Bend, Pull, Side, Slope, Turned};
use crate::joint::{Axis, Drive, Joint};
use crate::step_nlp::entries::EntrySink;
use crate::step_nlp::layout::{ATTITUDE, POSITION};
use crate::step_nlp::several::component::{Component, Curvature, Place, weighted};
use crate::step_nlp::several::touch::Sight;
use nalgebra::{Matrix4, Vector3, Vector4};

/// A joint between A and B, or the world.
#[derive(Clone)]
pub(super) struct Tie {
    pub(super) body: usize,
    pub(super) other: Option<usize>,
    /// The anchor of A along the axes of B, and F_Bᵀ b that it is counted from.
    sight: Sight,
    origin: Vector3<f64>,
    /// Where the forces of the place act.
    arm: Arm,
    /// The axes of the frames in A and in B.
    axes: [[Turned; 3]; 2],
    /// Whether z of the turn is an angle.
    pub(super) is_hinge: bool,
    /// ℓ.
    pub(super) length: f64,
}

/// A joint in a step: both its bodies, its axes, and what motors add.
pub(super) struct Tied<'a> {
    pub(super) a: Side<'a>,
    pub(super) b: Option<Side<'a>>,
    pub(super) axes: &'a [Held],
    pub(super) numbers: &'a [Numbers],
    /// The forces along the axes of the place, and those about the axes of the turn over ℓ.
    pub(super) sizes: [[f64; 3]; 2],
    /// The variables that these are made of.
    pub(super) acts: [Vec<Acts>; 2],
}

/// An axis of a joint in a step: its law, its variables and its rows.
pub(super) struct Held {
    /// 0 to 2 of the place, 3 to 5 of the turn.
    pub(super) axis: usize,
    pub(super) law: AxisLaw,
    /// The columns of its numbers, of those that are variables.
    pub(super) columns: [Option<usize>; NUMBERS],
    /// The first row.
    pub(super) row: usize,
}

/// Axes of A and of B whose products, with a sign, are added.
type Products = [(usize, usize, f64)];

impl Tie {
    /// That of `joint`, whose length is `length` (m), in a program whose unit of length is `unit` (m). None of a turn that it does
    /// not know.
    pub(super) fn new(joint: &Joint, length: f64, unit: f64) -> Option<Self> {
        let idle = Axis::Free(Drive::NONE);
        let is_hinge = match joint.angular() {
            [Axis::Locked, Axis::Locked, Axis::Free(_)] => true,
            [Axis::Locked, Axis::Locked, Axis::Locked] => false,
            axes if axes.iter().all(|axis| *axis == idle) => false,
            _ => return None,
        };
        let [a, b] = joint.frames();
        let (point, frame) = (a.anchor / unit, b.rotation());
        let axes = [a.rotation(), frame]
            .map(|frame| [0, 1, 2].map(|k| Turned::new(frame.column(k).into_owned())));
        Some(Self {
            body: joint.body(),
            other: joint.other(),
            sight: Sight::new(&point, &frame),
            origin: frame.tr_mul(&(b.anchor / unit)),
            arm: Arm::new(&point, &frame, 0.0),
            axes,
            is_hinge,
            length: length / unit,
        })
    }

    /// The coordinate of `axis` where the bodies are at `at`; an angle is that nearest to `near`.
    pub(super) fn coordinate(&self, axis: usize, at: At, near: f64) -> f64 {
        let value = self.component(axis, at).value;
        if axis == ANGLE && self.is_hinge {
            let turn = self.length * std::f64::consts::TAU;
            return value + turn * libm::round((near - value) / turn);
        }
        value
    }

    /// The products that a coordinate of the turn is made of: of an angle those of its sine and its cosine.
    fn products(&self, axis: usize) -> (&'static Products, Option<&'static Products>) {
        match axis {
            3 => (&[(1, 2, 1.0)], None),
            4 => (&[(0, 2, -1.0)], None),
            _ if self.is_hinge => (&[(0, 1, 1.0), (1, 0, -1.0)], Some(&[(0, 0, 1.0), (1, 1, 1.0)])),
            _ => (&[(0, 1, 1.0)], None),
        }
    }

    /// The coordinate of an axis, but for whole turns, with its slopes.
    fn component(&self, axis: usize, at: At) -> Component {
        if axis < ANGULAR {
            let component = self.sight.component(axis, at);
            return Component { value: component.value - self.origin[axis], ..component };
        }
        let (first, second) = self.products(axis);
        let sine = self.product(first, at);
        let Some(cosine) = second.map(|second| self.product(second, at)) else {
            return sine.scaled(self.length);
        };
        let (s, c) = (sine.value, cosine.value);
        let share = self.length / (s * s + c * c);
        Component {
            value: self.length * libm::atan2(s, c),
            ..sine.scaled(c * share).plus(&cosine.scaled(-s * share))
        }
    }

    /// Its second derivatives.
    ///
    /// ```text
    /// ∂²atan2(s, c) = ((c ∂²s − s ∂²c) + (2 s c (∂c ∂cᵀ − ∂s ∂sᵀ) + (s² − c²) (∂s ∂cᵀ + ∂c ∂sᵀ))/n)/n,   n = s² + c²
    /// ```
    pub(super) fn curvature(&self, axis: usize, at: At) -> Curvature {
        if axis < ANGULAR {
            return self.sight.curvature(axis, at);
        }
        let (first, second) = self.products(axis);
        let bend = self.product_curvature(first, at);
        let Some(second) = second else { return scaled(bend, self.length) };
        let (sine, cosine) = (self.product(first, at), self.product(second, at));
        let (s, c) = (sine.value, cosine.value);
        let n = s * s + c * c;
        let other = self.product_curvature(second, at);
        let block =
            |by_s: [&Vector4<f64>; 2], by_c: [&Vector4<f64>; 2], bends: [Matrix4<f64>; 2]| {
                let outer = |a: &Vector4<f64>, b: &Vector4<f64>| a * b.transpose();
                let squares = outer(by_c[0], by_c[1]) - outer(by_s[0], by_s[1]);
                let mixed = outer(by_s[0], by_c[1]) + outer(by_c[0], by_s[1]);
                let own = bends[0] * c - bends[1] * s;
                (own + (squares * (2.0 * s * c) + mixed * (s * s - c * c)) / n) * (self.length / n)
            };
        let (sa, sb, ca, cb) = (&sine.by_a, &sine.by_b, &cosine.by_a, &cosine.by_b);
        Curvature {
            aa: block([sa, sa], [ca, ca], [bend.aa, other.aa]),
            bb: block([sb, sb], [cb, cb], [bend.bb, other.bb]),
            ab: block([sa, sb], [ca, cb], [bend.ab, other.ab]),
            ..Curvature::default()
        }
    }

    /// Σ ± (A_A α)·(A_B β).
    fn product(&self, products: &Products, at: At) -> Component {
        let mut sum = Component::zero();
        for &(of_a, of_b, sign) in products {
            let (a, by_a) = self.axes[0][of_a].at(&at.0.attitude);
            let (b, by_b) = self.axes[1][of_b].of(at.1.as_ref().map(|b| &b.attitude));
            sum.value += sign * a.dot(&b);
            sum.by_a += by_a.tr_mul(&b) * sign;
            sum.by_b += by_b.tr_mul(&a) * sign;
        }
        sum
    }

    fn product_curvature(&self, products: &Products, at: At) -> Curvature {
        let mut sum = Curvature::default();
        for &(of_a, of_b, sign) in products {
            let (alpha, beta) = (&self.axes[0][of_a], &self.axes[1][of_b]);
            let (a, by_a) = alpha.at(&at.0.attitude);
            let (b, by_b) = beta.of(at.1.as_ref().map(|b| &b.attitude));
            sum.aa += weighted(&alpha.forms, &b) * sign;
            sum.bb += weighted(&beta.forms, &a) * sign;
            sum.ab += by_a.tr_mul(&by_b) * sign;
        }
        sum
    }

    /// Adds the forces to the rows of both motions, and writes the rows of the axes.
    pub(super) fn add_rows(&self, tied: &Tied<'_>, rows: &mut [f64]) {
        self.add_loads(tied, rows);
        for (held, numbers) in tied.axes.iter().zip(tied.numbers) {
            for (k, value) in held.law.values(numbers).enumerate() {
                rows[held.row + k] = value;
            }
        }
    }

    /// The slopes of all of that.
    pub(super) fn emit_slopes(&self, tied: &Tied<'_>, sink: &mut impl EntrySink) {
        self.emit_load_slopes(tied, sink);
        for (held, numbers) in tied.axes.iter().zip(tied.numbers) {
            let slopes = self.slopes(held, tied);
            for row in 0..held.law.count() {
                let by = held.law.slope(row, numbers);
                for (number, slope) in slopes.iter().enumerate() {
                    if held.law.depends(row, number) {
                        for &(column, value) in slope.entries() {
                            sink.put(held.row + row, column, by[number] * value);
                        }
                    }
                }
            }
        }
    }

    /// The curvatures of all of that, with the multipliers `y` of all rows.
    pub(super) fn emit_curvatures(&self, tied: &Tied<'_>, y: &[f64], sink: &mut impl EntrySink) {
        self.emit_load_curvatures(tied, y, sink);
        let (mut then, mut now) = (Bend::default(), Bend::default());
        let places = places(tied);
        for (held, numbers) in tied.axes.iter().zip(tied.numbers) {
            let (law, own) = (&held.law, &y[held.row..]);
            let slopes = self.slopes(held, tied);
            let curvature = law.curvature(numbers, own);
            for i in 0..NUMBERS {
                for j in (0..=i).filter(|&j| law.couples(i, j)) {
                    put_couple((&slopes[i], &slopes[j]), (i == j, curvature[(i, j)]), sink);
                }
            }
            let mut weights = Numbers::zeros();
            for (row, y) in own.iter().enumerate().take(law.count()) {
                weights += law.slope(row, numbers) * *y;
            }
            then.add(&self.curvature(held.axis, places[1]), weights[END]);
            if law.moves() {
                now.add(&self.curvature(held.axis, places[0]), weights[START]);
            }
        }
        let firsts = |of: fn(&Side<'_>) -> usize| (of(&tied.a), tied.b.as_ref().map(of));
        if !tied.axes.is_empty() {
            then.emit(firsts(|side| side.columns.1), sink);
        }
        if tied.axes.iter().any(|held| held.law.moves()) {
            now.emit(firsts(|side| side.columns.0), sink);
        }
    }

    /// The numbers of an axis by the variables.
    fn slopes(&self, held: &Held, tied: &Tied<'_>) -> [Slope; NUMBERS] {
        let [before, after] = places(tied);
        let firsts = |of: fn(&Side<'_>) -> usize| (of(&tied.a), tied.b.as_ref().map(of));
        std::array::from_fn(|number| {
            let mut slope = Slope::new();
            match number {
                END => self.add(held.axis, after, firsts(|side| side.columns.1), &mut slope),
                START if held.law.moves() => {
                    self.add(held.axis, before, firsts(|side| side.columns.0), &mut slope);
                }
                _ => {
                    if let Some(column) = held.columns[number] {
                        slope.push(column, 1.0);
                    }
                }
            }
            slope
        })
    }

    /// Adds the slopes of a coordinate, where the states have these first columns.
    pub(super) fn add(
        &self,
        axis: usize,
        at: At,
        (a, b): (usize, Option<usize>),
        slope: &mut Slope,
    ) {
        let component = self.component(axis, at);
        let is_place = axis < ANGULAR;
        for k in (0..3).filter(|&k| is_place && (b.is_some() || self.sight.moves(axis, k))) {
            slope.push(a + POSITION.start + k, component.by_position[k]);
        }
        for k in (0..4).filter(|&k| !is_place || b.is_some() || self.sight.turns(axis, k)) {
            slope.push(a + ATTITUDE.start + k, component.by_a[k]);
        }
        let Some(b) = b else { return };
        for k in (0..3).filter(|_| is_place) {
            slope.push(b + POSITION.start + k, -component.by_position[k]);
        }
        for k in 0..4 {
            slope.push(b + ATTITUDE.start + k, component.by_b[k]);
        }
    }
}

impl Held {
    /// The numbers of its law but for the coordinates, from the variables `x`.
    pub(super) fn numbers(&self, x: &[f64]) -> Numbers {
        Numbers::from_fn(|number, _| self.columns[number].map_or(0.0, |column| x[column]))
    }
}

/// The first axis of the turn, and z of it.
pub(super) const ANGULAR: usize = 3;
pub(super) const ANGLE: usize = 5;

/// The poses of both bodies.
pub(super) type At = (Place, Option<Place>);

/// Those at the step's start and at its end.
fn places(tied: &Tied<'_>) -> [At; 2] {
    let of = |pick: fn(&Side<'_>) -> Place| (pick(&tied.a), tied.b.as_ref().map(pick));
    [of(|side| Place::of(side.start)), of(|side| Place::of(side.end))]
}

/// A second derivative by two numbers, as one by variables.
fn put_couple(
    (first, second): (&Slope, &Slope),
    (is_square, value): (bool, f64),
    sink: &mut impl EntrySink,
) {
    for (place, &(column, by)) in first.entries().iter().enumerate() {
        let others = if is_square { &second.entries()[..=place] } else { second.entries() };
        for &(other, other_by) in others {
            sink.put_symmetric(column, other, value * by * other_by);
        }
    }
}

fn scaled(curvature: Curvature, share: f64) -> Curvature {
    Curvature {
        aa: curvature.aa * share,
        bb: curvature.bb * share,
        ab: curvature.ab * share,
        ..curvature
    }
}

impl Component {
    fn zero() -> Self {
        let (by_position, by_a) = (Vector3::zeros(), Vector4::zeros());
        Self { value: 0.0, by_position, by_a, by_b: by_a }
    }

    fn scaled(&self, share: f64) -> Self {
        Self {
            value: self.value * share,
            by_position: self.by_position * share,
            by_a: self.by_a * share,
            by_b: self.by_b * share,
        }
    }

    fn plus(&self, other: &Self) -> Self {
        Self {
            value: self.value + other.value,
            by_position: self.by_position + other.by_position,
            by_a: self.by_a + other.by_a,
            by_b: self.by_b + other.by_b,
        }
    }
}

impl Tied<'_> {
    /// Adds a force along an axis, or a torque over ℓ about one, and its variable with its share.
    pub(super) fn add_force(&mut self, axis: usize, size: f64, column: Option<(usize, f64)>) {
        let (of, k) = (axis / ANGULAR, axis % ANGULAR);
        self.sizes[of][k] += size;
        self.acts[of].extend(column.map(|(column, share)| (k, column, share)));
    }

    /// The forces of its place as they act.
    fn pull(&self) -> Pull<'_> {
        Pull { a: self.a, b: self.b, sizes: self.sizes[0], acts: &self.acts[0] }
    }

    /// Whether any force of the place, or of the turn, can act.
    fn acts(&self, of: usize) -> bool {
        !self.acts[of].is_empty() || self.sizes[of] != [0.0; 3]
    }
}
