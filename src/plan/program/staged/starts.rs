//! The rows that hold X_0 to what is chosen of it.

use super::super::goal::Exponential;
use super::{PlanNlp, Read};
use crate::mechanics::State;
use crate::mechanics::quaternion::left;
use crate::plan::{ControlKind, StartPart};
use crate::step_nlp::entries::EntrySink;
use crate::step_nlp::layout::{ATTITUDE, POSITION, SPIN, STATE, VELOCITY};
use nalgebra::{Vector3, Vector4};

impl PlanNlp<'_> {
    /// The column of the part of X_0 that a control is of, and what it is to be.
    pub(super) fn start_values(&self, control: usize, read: &Read) -> (usize, Vec<f64>) {
        let kind = &self.problem.controls()[control].kind;
        let ControlKind::Start { body, part } = kind else { return (self.first, Vec::new()) };
        let (numbers, _) = self.problem.numbers(control, 0, &read.controls);
        let own = &self.problem.scene().starts[*body];
        let state = match part {
            // Not normalised once more: the exponential has length 1.
            StartPart::Turn => {
                let turned = Exponential::of(&Vector3::from_column_slice(&numbers)).quaternion;
                State { attitude: left(&own.attitude) * turned, ..*own }
            }
            _ => kind.started(&numbers, own),
        };
        let (first, count) = part_of(*part);
        let values = self.units.state(&state).to_vector();
        let column = self.first + STATE.end * body + first;
        (column, values.as_slice()[first..first + count].to_vec())
    }

    /// The columns of a start's components, with the lengths of their bounds.
    fn start_columns(&self, control: usize, read: &Read) -> (Vec<f64>, Vec<Option<(usize, f64)>>) {
        let (numbers, places) = self.problem.numbers(control, 0, &read.controls);
        let place = |place: usize| (self.columns[place], self.scales[place]);
        (numbers, places.into_iter().map(|of| of.map(place)).collect())
    }

    pub(super) fn emit_start_slopes(
        &self,
        control: usize,
        row: usize,
        read: &Read,
        sink: &mut impl EntrySink,
    ) {
        let ControlKind::Start { body, part } = self.problem.controls()[control].kind else {
            return;
        };
        let (first, count) = part_of(part);
        for k in 0..count {
            sink.put(row + k, self.first + STATE.end * body + first + k, 1.0);
        }
        let (numbers, columns) = self.start_columns(control, read);
        let unit = match part {
            StartPart::Position => 1.0 / self.units.length(),
            StartPart::Velocity => 1.0 / self.units.speed(),
            StartPart::Spin => self.units.length() / self.units.speed(),
            StartPart::Turn => {
                let own = &self.problem.scene().starts[body].attitude;
                let theta = Vector3::from_column_slice(&numbers);
                let slope = left(own) * Exponential::of(&theta).slope();
                for (j, (column, scale)) in columns.iter().enumerate().filter_map(present) {
                    for k in 0..4 {
                        sink.put(row + k, column, -slope[(k, j)] * scale);
                    }
                }
                return;
            }
        };
        for (j, (column, scale)) in columns.iter().enumerate().filter_map(present) {
            sink.put(row + j, column, -unit * scale);
        }
    }

    pub(super) fn emit_start_curvatures(
        &self,
        control: usize,
        y: &[f64],
        read: &Read,
        sink: &mut impl EntrySink,
    ) {
        let ControlKind::Start { body, part: StartPart::Turn } =
            self.problem.controls()[control].kind
        else {
            return;
        };
        let (numbers, columns) = self.start_columns(control, read);
        let own = &self.problem.scene().starts[body].attitude;
        let y = -left(own).tr_mul(&Vector4::from_column_slice(&y[..4]));
        let bend = Exponential::of(&Vector3::from_column_slice(&numbers)).curvature(&y);
        for (i, (column, scale)) in columns.iter().enumerate().filter_map(present) {
            for (j, (other, other_scale)) in columns.iter().enumerate().filter_map(present) {
                if j <= i {
                    sink.put_symmetric(column, other, bend[(i, j)] * scale * other_scale);
                }
            }
        }
    }
}

fn present((k, of): (usize, &Option<(usize, f64)>)) -> Option<(usize, (usize, f64))> {
    of.map(|of| (k, of))
}

/// Where a part of a state stands in it, and how many numbers it has.
pub(super) fn part_of(part: StartPart) -> (usize, usize) {
    match part {
        StartPart::Position => (POSITION.start, 3),
        StartPart::Turn => (ATTITUDE.start, 4),
        StartPart::Velocity => (VELOCITY.start, 3),
        StartPart::Spin => (SPIN.start, 3),
    }
}
