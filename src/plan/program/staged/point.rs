//! Points of the program: made of runs, and read as states, controls and forces.

use super::super::axis::{NUMBERS, Numbers, SPEED_BEFORE};
use super::super::law::SLIP_SPEED;
use super::{Placed, PlanNlp, Stage};
use crate::mechanics::State;
use crate::plan::Replay;
use crate::step_nlp::layout::STATE;
use nalgebra::SVector;

impl PlanNlp<'_> {
    /// The point of a run: its states, its forces, and λ the slip speed.
    #[must_use]
    pub fn point_of(&self, replay: &Replay) -> Vec<f64> {
        let mut x = vec![0.0; self.variables];
        let scaled = replay.controls.iter().zip(&self.scales);
        for (&column, (value, scale)) in self.columns.iter().zip(scaled) {
            x[column] = value / scale;
        }
        for (step, states) in replay.states.iter().enumerate() {
            for (body, state) in states.iter().enumerate() {
                let column = self.state(step, body);
                let state = self.units.state(state).to_vector();
                x[column..column + STATE.end].copy_from_slice(state.as_slice());
            }
        }
        for ((stage, record), states) in
            self.stages.iter().zip(&replay.records).zip(&replay.states[1..])
        {
            for placed in &stage.contacts {
                let found = record.solution.contacts.iter().zip(&record.contacts);
                let found = found.into_iter().find(|(force, _)| force.key == placed.key);
                let Some((force, contact)) = found else { continue };
                let along = contact.frame.tr_mul(&force.force) / self.units.force();
                for i in (0..3).filter(|&i| placed.law.has(i)) {
                    x[placed.columns[i]] = along[i];
                }
                if placed.law.has(SLIP_SPEED) {
                    x[placed.columns[SLIP_SPEED]] = force.slip.norm() / self.units.speed();
                }
            }
            for (keep, &(column, _)) in self.problem.keeps().iter().zip(&stage.keeps) {
                let value = keep.kind.at(&states[keep.body].position).0;
                x[column] = (-value / self.units.length()).max(0.0);
            }
        }
        self.place_axes(replay, &mut x);
        self.place_gears(replay, &mut x);
        x
    }

    /// The same with the forces of all contacts on the path of their smoothing.
    pub(in crate::plan::program) fn path_point_of(&self, replay: &Replay) -> Vec<f64> {
        let mut x = self.point_of(replay);
        let read = self.read(&x);
        for (step, stage) in self.stages.iter().enumerate() {
            for ((meeting, posed), placed) in self.each_contact(step, &read).zip(&stage.contacts) {
                let values = placed.law.on_path(&meeting.numbers(&posed));
                for i in (0..4).filter(|&i| placed.law.has(i)) {
                    x[placed.columns[i]] = values[i];
                }
            }
            for (held, numbers) in stage.axes.iter().flatten().zip(read.axes[step].iter().flatten())
            {
                let on_path = held.law.on_path(numbers);
                for (column, value) in held.columns.iter().zip(&on_path).take(SPEED_BEFORE) {
                    if let Some(column) = column {
                        x[*column] = *value;
                    }
                }
                for number in SPEED_BEFORE + 1..NUMBERS {
                    if let Some(column) = held.columns[number] {
                        x[column] = on_path[number];
                    }
                }
            }
        }
        x
    }

    /// The controls at `x`, in SI units.
    #[must_use]
    pub fn controls(&self, x: &[f64]) -> Vec<f64> {
        let scaled = self.columns.iter().zip(&self.scales);
        scaled.map(|(&column, scale)| x[column] * scale).collect()
    }

    /// The states at `x`, in SI units, one list a step and one at the end.
    #[must_use]
    pub fn states(&self, x: &[f64]) -> Vec<Vec<State>> {
        let read = self.read(x);
        let unit = |state: &State| {
            let state = self.units.si_state(state);
            State { attitude: state.attitude.normalize(), ..state }
        };
        read.states.iter().map(|states| states.iter().map(unit).collect()).collect()
    }

    /// The column of X_k of a body.
    pub(super) fn state(&self, step: usize, body: usize) -> usize {
        let first = step.checked_sub(1).map_or(self.first, |step| self.stages[step].end);
        first + STATE.end * body
    }

    pub(super) fn read(&self, x: &[f64]) -> Read {
        let bodies = self.own.len();
        let state = |step: usize, body: usize| {
            let column = self.state(step, body);
            State::from_vector(&SVector::from_column_slice(&x[column..column + STATE.end]))
        };
        let states: Vec<Vec<State>> = (0..=self.stages.len())
            .map(|step| (0..bodies).map(|body| state(step, body)).collect())
            .collect();
        let value = |column: &usize| if *column == usize::MAX { 0.0 } else { x[*column] };
        let contact = |placed: &Placed| [0, 1, 2, 3].map(|i| value(&placed.columns[i]));
        let stage = |stage: &Stage| stage.contacts.iter().map(contact).collect();
        Read {
            axes: self.read_axes(x, &states),
            gears: self.read_gears(x, &states),
            states,
            controls: self.controls(x),
            contacts: self.stages.iter().map(stage).collect(),
        }
    }
}

/// A point as it is read.
pub(super) struct Read {
    pub states: Vec<Vec<State>>,
    /// SI units.
    pub controls: Vec<f64>,
    /// F_t1, F_t2, F_n, λ of the contacts of each step.
    pub contacts: Vec<Vec<[f64; 4]>>,
    /// The numbers of the axes of every joint, of each step.
    pub axes: Vec<Vec<Vec<Numbers>>>,
    /// Those of every gear, of each step.
    pub gears: Vec<Vec<Numbers>>,
}
