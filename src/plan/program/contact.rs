//! One contact of the program over one step: the forces that it puts on its bodies at the poses of the
//! step's start, its gap and its slip, and its rows (eqs. P12 to P17).

mod load;

use super::law::{GAP, Law, NORMAL, NUMBERS, Numbers, ROWS, SLIP};
use super::motion::{Columns, Motion};
use crate::contact::Contact;
use crate::mechanics::State;
use crate::mechanics::quaternion::rotated_point_forms;
use crate::step_nlp::entries::EntrySink;
use crate::step_nlp::layout::{ATTITUDE, POSITION, SPIN};
use crate::step_nlp::several::component::{Component, Curvature, Forms, Place, rows, weighted};
use crate::step_nlp::several::touch::Touch;
pub(super) use load::{Acts, Arm, Pull};
use nalgebra::{Matrix3x4, SMatrix, Vector3, Vector4};

/// A body of a contact in a step.
#[derive(Clone, Copy)]
pub(super) struct Side<'a> {
    pub(super) motion: &'a Motion,
    pub(super) start: &'a State,
    pub(super) end: &'a State,
    pub(super) columns: Columns,
    /// The first row of its motion.
    pub(super) row: usize,
}

/// A contact between A and B, or something fixed, in a step.
#[derive(Clone)]
pub(super) struct Meeting {
    /// Gap and slip as functions of poses.
    touch: Touch,
    /// Where its forces act.
    arm: Arm,
    time_step: f64,
}

/// What a contact is asked with in a step: its law, its variables and both its bodies.
#[derive(Clone, Copy)]
pub(super) struct Posed<'a> {
    pub(super) law: &'a Law,
    /// F_t1, F_t2, F_n, λ.
    pub(super) values: [f64; 4],
    /// Their columns, of those that the law [has](Law::has).
    pub(super) columns: [usize; 4],
    /// The first row.
    pub(super) row: usize,
    pub(super) a: Side<'a>,
    pub(super) b: Option<Side<'a>>,
}

/// A vector c of a body as forms (eq. 3): A(q) c and its slope.
#[derive(Clone)]
pub(super) struct Turned {
    pub(super) vector: Vector3<f64>,
    pub(super) forms: Forms,
}

impl Turned {
    pub(super) fn new(vector: Vector3<f64>) -> Self {
        Self { vector, forms: rotated_point_forms(&vector) }
    }

    /// A(q) c and ∂/∂q.
    pub(super) fn at(&self, q: &Vector4<f64>) -> (Vector3<f64>, Matrix3x4<f64>) {
        let slope = rows(&self.forms, q);
        (slope * q * 0.5, slope)
    }

    /// The same of a B, which may be fixed: A = E.
    pub(super) fn of(&self, b: Option<&Vector4<f64>>) -> (Vector3<f64>, Matrix3x4<f64>) {
        b.map_or((self.vector, Matrix3x4::zeros()), |q| self.at(q))
    }
}

/// Slopes of one number, as columns and values.
pub(super) struct Slope {
    entries: [(usize, f64); MOST_SLOPES],
    len: usize,
}

/// Both ends of two bodies, and what the spins add.
const MOST_SLOPES: usize = 48;

impl Slope {
    pub(super) fn new() -> Self {
        Self { entries: [(0, 0.0); MOST_SLOPES], len: 0 }
    }

    pub(super) fn push(&mut self, column: usize, value: f64) {
        self.entries[self.len] = (column, value);
        self.len += 1;
    }

    pub(super) fn entries(&self) -> &[(usize, f64)] {
        &self.entries[..self.len]
    }
}

/// What the spins of a rounded feature add to the slip along one tangent (eq. 10a), with w = n × t in B:
///
/// ```text
/// −ρ ((A_B w)·(A_A ω_A⁺) − w·ω_B⁺)                                                  (eq. P14)
/// ```
struct Rolling {
    w: Turned,
    omega: Turned,
    /// A_B w and A_A ω_A⁺, with their slopes by q_B and q_A.
    seen: (Vector3<f64>, Matrix3x4<f64>),
    turned: (Vector3<f64>, Matrix3x4<f64>),
}

impl Meeting {
    /// That of `contact` of bodies whose constants `touch` has, in steps of `time_step`.
    pub(super) fn new(contact: &Contact, touch: Touch, time_step: f64) -> Self {
        let (frame, point) = (&contact.features.frame, &contact.features.point);
        Self { touch, arm: Arm::new(point, frame, contact.features.radius), time_step }
    }

    /// s (see [`law`](super::law)) at a point.
    pub(super) fn numbers(&self, posed: &Posed<'_>) -> Numbers {
        let mut s = Numbers::zeros();
        s.fixed_rows_mut::<4>(0).copy_from_slice(&posed.values);
        s[GAP] = self.gap(posed);
        if posed.law.friction > 0.0 {
            let (before, after) = places(posed);
            for axis in 0..2 {
                let [now, then] = [before, after].map(|at| self.touch.component(axis, at).value);
                let mut slip = (then - now) / self.time_step;
                if let Some(rolling) = self.rolling(axis, posed) {
                    let of_b = posed.b.map_or(0.0, |b| rolling.w.vector.dot(&b.end.spin));
                    slip -= self.arm.radius * (rolling.seen.0.dot(&rolling.turned.0) - of_b);
                }
                s[SLIP + axis] = slip;
            }
        }
        s
    }

    /// φ⁺/h.
    pub(super) fn gap(&self, posed: &Posed<'_>) -> f64 {
        self.touch.gap(&self.touch.component(2, places(posed).1)) / self.time_step
    }

    fn rolling(&self, axis: usize, posed: &Posed<'_>) -> Option<Rolling> {
        (self.arm.radius != 0.0).then(|| {
            let w = Turned::new(self.arm.directions[2].cross(&self.arm.directions[axis]));
            let omega = Turned::new(posed.a.end.spin);
            let seen = w.of(posed.b.map(|b| &b.start.attitude));
            let turned = omega.at(&posed.a.start.attitude);
            Rolling { w, omega, seen, turned }
        })
    }

    /// Does `with` the forces as they act, where there are any.
    fn pulling(posed: &Posed<'_>, with: impl FnOnce(&Pull<'_>)) {
        if !posed.law.has(NORMAL) {
            return;
        }
        let acts = [0, 1, 2].map(|axis| (axis, posed.columns[axis], 1.0));
        let own = if posed.law.has(0) { &acts[..] } else { &acts[NORMAL..] };
        let [first, second, normal, _] = posed.values;
        with(&Pull { a: posed.a, b: posed.b, sizes: [first, second, normal], acts: own });
    }

    /// Adds the contact's force to the rows of both motions, and writes its own rows.
    pub(super) fn add_rows(&self, posed: &Posed<'_>, rows: &mut [f64]) {
        let values = posed.law.values(&self.numbers(posed));
        let count = posed.law.count();
        rows[posed.row..posed.row + count].copy_from_slice(&values[..count]);
        Self::pulling(posed, |pull| self.arm.add_rows(pull, rows));
    }

    /// The slopes of all of that.
    pub(super) fn emit_slopes(&self, posed: &Posed<'_>, sink: &mut impl EntrySink) {
        let slopes = posed.law.slopes(&self.numbers(posed));
        for row in 0..posed.law.count() {
            for &i in posed.law.depends(row) {
                let at = posed.row + row;
                match i {
                    GAP.. => {
                        for &(column, value) in self.slope(i, posed).entries() {
                            sink.put(at, column, slopes[(row, i)] * value);
                        }
                    }
                    _ => sink.put(at, posed.columns[i], slopes[(row, i)]),
                }
            }
        }
        Self::pulling(posed, |pull| self.arm.emit_slopes(pull, sink));
    }

    /// The curvatures of all of that, with the multipliers `y` of all rows.
    pub(super) fn emit_curvatures(&self, posed: &Posed<'_>, y: &[f64], sink: &mut impl EntrySink) {
        let s = self.numbers(posed);
        let mut own = [0.0; ROWS];
        let count = posed.law.count();
        own[..count].copy_from_slice(&y[posed.row..posed.row + count]);
        let curvature = posed.law.curvature(&s, &own);
        for &(i, j) in posed.law.couples() {
            self.emit_couple((i, j), curvature[(i, j)], posed, sink);
        }
        let weights = posed.law.slopes(&s).tr_mul(&Vector4::from(own));
        self.emit_bends(&weights, posed, sink);
        Self::pulling(posed, |pull| self.arm.emit_curvatures(pull, y, sink));
    }

    /// The second derivative `value` by the numbers i ≥ j of s, as one by variables.
    fn emit_couple(
        &self,
        (i, j): (usize, usize),
        value: f64,
        posed: &Posed<'_>,
        sink: &mut impl EntrySink,
    ) {
        if i < GAP {
            sink.put_symmetric(posed.columns[i], posed.columns[j], value);
            return;
        }
        let slope = self.slope(i, posed);
        if j < GAP {
            for &(column, by) in slope.entries() {
                sink.put_symmetric(column, posed.columns[j], value * by);
            }
            return;
        }
        for (place, &(column, by)) in slope.entries().iter().enumerate() {
            for &(other, other_by) in &slope.entries()[..=place] {
                sink.put_symmetric(column, other, value * by * other_by);
            }
        }
    }

    /// φ⁺/h or a component of c (number `i` of s) by the variables (eq. D7, and P20 of what rolls).
    fn slope(&self, i: usize, posed: &Posed<'_>) -> Slope {
        let (before, after) = places(posed);
        let mut slope = Slope::new();
        let share = 1.0 / self.time_step;
        if i == GAP {
            self.add_component(
                2,
                &self.touch.component(2, after),
                share,
                (posed, true),
                &mut slope,
            );
            return slope;
        }
        let axis = i - SLIP;
        let (now, then) = (self.touch.component(axis, before), self.touch.component(axis, after));
        self.add_component(axis, &then, share, (posed, true), &mut slope);
        self.add_component(axis, &now, -share, (posed, false), &mut slope);
        let Some(rolling) = self.rolling(axis, posed) else { return slope };
        let rho = -self.arm.radius;
        let (seen, turned) = (&rolling.seen, &rolling.turned);
        let by_attitude = turned.1.tr_mul(&seen.0) * rho;
        let a = posed.a.start.pose().rotation;
        let by_spin = a.tr_mul(&seen.0) * rho;
        for k in 0..4 {
            slope.push(posed.a.columns.0 + ATTITUDE.start + k, by_attitude[k]);
        }
        for k in 0..3 {
            slope.push(posed.a.columns.1 + SPIN.start + k, by_spin[k]);
        }
        if let Some(b) = posed.b {
            let by_attitude = seen.1.tr_mul(&turned.0) * rho;
            for k in 0..4 {
                slope.push(b.columns.0 + ATTITUDE.start + k, by_attitude[k]);
            }
            for k in 0..3 {
                slope.push(b.columns.1 + SPIN.start + k, -rho * rolling.w.vector[k]);
            }
        }
        slope
    }

    /// `share` times a component of the poses at the step's end, or start.
    fn add_component(
        &self,
        axis: usize,
        component: &Component,
        share: f64,
        (posed, at_end): (&Posed<'_>, bool),
        slope: &mut Slope,
    ) {
        let first = |side: &Side<'_>| if at_end { side.columns.1 } else { side.columns.0 };
        let a = first(&posed.a);
        for k in (0..3).filter(|&k| self.touch.moves(axis, k)) {
            slope.push(a + POSITION.start + k, share * component.by_position[k]);
        }
        for k in (0..4).filter(|&k| self.touch.turns(axis, k)) {
            slope.push(a + ATTITUDE.start + k, share * component.by_a[k]);
        }
        let Some(b) = posed.b.as_ref().map(first) else { return };
        for k in 0..3 {
            slope.push(b + POSITION.start + k, -share * component.by_position[k]);
        }
        for k in 0..4 {
            slope.push(b + ATTITUDE.start + k, share * component.by_b[k]);
        }
    }

    /// Σ w ∇²(φ⁺/h, c_1, c_2) by the poses (eq. D8, and P20 of what rolls).
    fn emit_bends(&self, weights: &Numbers, posed: &Posed<'_>, sink: &mut impl EntrySink) {
        let (before, after) = places(posed);
        let rubs = posed.law.depends(1).iter().any(|&i| i >= SLIP) && posed.law.count() > 1;
        let mut then = Bend::of(&self.touch.curvature(2, after), weights[GAP] / self.time_step);
        let firsts = |of: fn(&Side<'_>) -> usize| (of(&posed.a), posed.b.as_ref().map(of));
        if !rubs {
            then.emit(firsts(|side| side.columns.1), sink);
            return;
        }
        let mut now = Bend::default();
        for axis in 0..2 {
            let weight = weights[SLIP + axis] / self.time_step;
            then.add(&self.touch.curvature(axis, after), weight);
            now.add(&self.touch.curvature(axis, before), -weight);
        }
        if self.arm.radius != 0.0 {
            self.emit_rolling_bends(weights, posed, &mut now, sink);
        }
        then.emit(firsts(|side| side.columns.1), sink);
        now.emit(firsts(|side| side.columns.0), sink);
    }

    fn emit_rolling_bends(
        &self,
        weights: &Numbers,
        posed: &Posed<'_>,
        now: &mut Bend,
        sink: &mut impl EntrySink,
    ) {
        let mut by_spin = SMatrix::<f64, 3, 4>::zeros();
        let mut by_spin_of_b = SMatrix::<f64, 3, 4>::zeros();
        let q = &posed.a.start.attitude;
        for axis in 0..2 {
            let Some(rolling) = self.rolling(axis, posed) else { continue };
            let weight = -self.arm.radius * weights[SLIP + axis];
            let ((seen, seen_slope), (turned, turned_slope)) = (rolling.seen, rolling.turned);
            now.aa += weighted(&rolling.omega.forms, &seen) * weight;
            now.bb += weighted(&rolling.w.forms, &turned) * weight;
            now.ab += turned_slope.tr_mul(&seen_slope) * weight;
            for m in 0..3 {
                let (axis, slope) = Turned::new(Vector3::ith(m, 1.0)).at(q);
                let row = by_spin.row(m) + (slope.tr_mul(&seen) * weight).transpose();
                by_spin.set_row(m, &row);
                let row = by_spin_of_b.row(m) + (seen_slope.tr_mul(&axis) * weight).transpose();
                by_spin_of_b.set_row(m, &row);
            }
        }
        let spin = posed.a.columns.1 + SPIN.start;
        let put = |start: usize, block: &SMatrix<f64, 3, 4>, sink: &mut _| {
            put_symmetric_block((spin, start + ATTITUDE.start), block, sink);
        };
        put(posed.a.columns.0, &by_spin, sink);
        if let Some(b) = posed.b {
            put(b.columns.0, &by_spin_of_b, sink);
        }
    }
}

/// Second derivatives by the poses of both bodies at one end of a step.
#[derive(Default)]
pub(super) struct Bend {
    aa: SMatrix<f64, 4, 4>,
    bb: SMatrix<f64, 4, 4>,
    /// q_A × q_B.
    ab: SMatrix<f64, 4, 4>,
    /// r_A × q_B.
    position_b: Matrix3x4<f64>,
}

impl Bend {
    fn of(curvature: &Curvature, weight: f64) -> Self {
        let mut bend = Self::default();
        bend.add(curvature, weight);
        bend
    }

    pub(super) fn add(&mut self, curvature: &Curvature, weight: f64) {
        self.aa += curvature.aa * weight;
        self.bb += curvature.bb * weight;
        self.ab += curvature.ab * weight;
        self.position_b += curvature.position_b * weight;
    }

    /// Where the states of A and B have these first columns.
    pub(super) fn emit(&self, (a, b): (usize, Option<usize>), sink: &mut impl EntrySink) {
        sink.put_lower(a + ATTITUDE.start, &self.aa);
        let Some(b) = b else { return };
        let attitude = b + ATTITUDE.start;
        sink.put_lower(attitude, &self.bb);
        put_symmetric_block((a + ATTITUDE.start, attitude), &self.ab, sink);
        put_symmetric_block((a + POSITION.start, attitude), &self.position_b, sink);
        put_symmetric_block((b + POSITION.start, attitude), &-self.position_b, sink);
    }
}

/// A block of a symmetric matrix beside the diagonal.
pub(super) fn put_symmetric_block<const N: usize, const M: usize>(
    (row, column): (usize, usize),
    block: &SMatrix<f64, N, M>,
    sink: &mut impl EntrySink,
) {
    for i in 0..N {
        for j in 0..M {
            sink.put_symmetric(row + i, column + j, block[(i, j)]);
        }
    }
}

/// The poses of both bodies at the step's start and at its end.
type At = (Place, Option<Place>);

fn places(posed: &Posed<'_>) -> (At, At) {
    let of = |pick: fn(&Side<'_>) -> Place| (pick(&posed.a), posed.b.as_ref().map(pick));
    (of(|side| Place::of(side.start)), of(|side| Place::of(side.end)))
}

/// The numbers of a contact that the bodies' motion makes.
const _: () = assert!(GAP + 3 == NUMBERS && SLIP + 2 == NUMBERS);
