//! What Ipopt asks of the program: cost, rows and their derivatives at a point.

use super::super::contact::{Meeting, Posed, Side};
use super::super::goal::Goal;
use super::pushed::Pushed;
use super::{PlanNlp, Read, StartRows};
use crate::plan::{Applied, Control, Keep};
use crate::step_nlp::entries::EntrySink;
use crate::step_nlp::layout::{ATTITUDE, POSITION, STATE};

impl<'p> PlanNlp<'p> {
    /// Each contact of a step, as it is asked.
    pub(super) fn each_contact<'a>(
        &'a self,
        step: usize,
        read: &'a Read,
    ) -> impl Iterator<Item = (&'a Meeting, Posed<'a>)> {
        let stage = &self.stages[step];
        let side = move |body: usize| self.side(step, body, read);
        let values = &read.contacts[step];
        stage.contacts.iter().zip(values).map(move |(placed, values)| {
            let posed = Posed {
                law: &placed.law,
                values: *values,
                columns: placed.columns,
                row: placed.row,
                a: side(placed.key.body),
                b: placed.key.partner.body().map(side),
            };
            (&self.meetings[placed.meeting], posed)
        })
    }

    /// A body in a step.
    pub(super) fn side<'a>(&'a self, step: usize, body: usize, read: &'a Read) -> Side<'a> {
        Side {
            motion: &self.motions[body],
            start: &read.states[step][body],
            end: &read.states[step + 1][body],
            columns: (self.state(step, body), self.state(step + 1, body)),
            row: self.stages[step].rows + STATE.end * body,
        }
    }

    /// What the controls put on the bodies in a step.
    fn each_push(&self, step: usize, read: &Read) -> Vec<Pushed<'p>> {
        let controls = self.problem.controls().iter().enumerate();
        let pushed = |(index, control): (usize, &'p Control)| {
            let body = control.kind.body()?;
            let (applied, numbers, places) = self.problem.applied(index, step, &read.controls)?;
            let columns = places.iter().map(|place| place.map(|place| self.columns[place]));
            let scales = places.iter().map(|place| place.map_or(0.0, |place| self.scales[place]));
            Some(Pushed {
                kind: &control.kind,
                body,
                applied: self.in_units(&applied),
                numbers,
                columns: columns.collect(),
                scales: scales.collect(),
            })
        };
        controls.filter_map(pushed).collect()
    }

    pub(super) fn in_units(&self, applied: &Applied) -> Applied {
        let (force, length) = (self.units.force(), self.units.length());
        let torque = applied.torque / (force * length);
        Applied { axes: applied.axes, force: applied.force / force, torque }
    }

    /// What the cost is multiplied with: 1 until this is called.
    pub(in crate::plan) fn set_factor(&mut self, factor: f64) {
        self.factor = factor;
    }

    /// The cost of an objective.
    pub(in crate::plan) fn unscaled(&self, objective: f64) -> f64 {
        objective / self.factor
    }

    /// The cost (P1), times the factor.
    #[must_use]
    pub fn objective(&self, x: &[f64]) -> f64 {
        self.cost(x) * self.factor
    }

    /// The cost (P1).
    pub(in crate::plan) fn cost(&self, x: &[f64]) -> f64 {
        let read = self.read(x);
        let mut cost = self.problem.effort_of(&read.controls);
        for target in self.problem.targets() {
            let state = &read.states[target.after][target.body];
            cost += target.weight * Goal::of(&target.kind, state, &self.units).value;
        }
        for (keep, column, weight) in self.each_slack() {
            cost += keep.weight * weight * x[column] * x[column];
        }
        cost
    }

    /// Its slope.
    pub fn gradient(&self, x: &[f64], gradient: &mut [f64]) {
        gradient.fill(0.0);
        let read = self.read(x);
        for (index, (of, value)) in self.problem.variables().iter().zip(&read.controls).enumerate()
        {
            let scale = self.scales[index] * self.factor;
            gradient[self.columns[index]] += 2.0 * of.effort * value * scale;
        }
        for target in self.problem.targets() {
            let state = &read.states[target.after][target.body];
            let goal = Goal::of(&target.kind, state, &self.units);
            let first = self.state(target.after, target.body) + goal.first;
            for k in 0..goal.count {
                gradient[first + k] += target.weight * goal.slope[k] * self.factor;
            }
        }
        for (keep, column, weight) in self.each_slack() {
            gradient[column] += 2.0 * keep.weight * weight * x[column] * self.factor;
        }
    }

    /// The slacks of the keeps with the square of their unit.
    fn each_slack(&self) -> impl Iterator<Item = (&Keep, usize, f64)> {
        let square = self.units.length() * self.units.length();
        self.stages.iter().flat_map(move |stage| {
            let pairs = self.problem.keeps().iter().zip(&stage.keeps);
            pairs.map(move |(keep, &(column, _))| (keep, column, square))
        })
    }

    /// All rows.
    pub fn constraints(&self, x: &[f64], rows: &mut [f64]) {
        let read = self.read(x);
        for StartRows { control, row } in &self.starts {
            let (first, values) = self.start_values(*control, &read);
            for (k, value) in values.into_iter().enumerate() {
                rows[row + k] = x[first + k] - value;
            }
        }
        for (step, stage) in self.stages.iter().enumerate() {
            for (body, motion) in self.motions.iter().enumerate() {
                let rows = &mut rows[stage.rows + STATE.end * body..];
                motion.rows((&read.states[step][body], &read.states[step + 1][body]), rows);
                let load = &stage.loads[body];
                motion.add_load(&load.force, &load.torque, rows);
            }
            for pushed in self.each_push(step, &read) {
                let wrench = pushed.applied.wrench(&read.states[step][pushed.body]);
                let rows = &mut rows[stage.rows + STATE.end * pushed.body..];
                self.motions[pushed.body].add_load(&wrench.force, &wrench.torque, rows);
            }
            for (meeting, posed) in self.each_contact(step, &read) {
                meeting.add_rows(&posed, rows);
            }
            for (tie, tied) in self.each_tie(step, &read) {
                tie.add_rows(&tied, rows);
            }
            self.add_gear_rows(step, &read, rows);
            for (keep, &(column, row)) in self.problem.keeps().iter().zip(&stage.keeps) {
                let length = self.units.length();
                let place = read.states[step + 1][keep.body].position * length;
                rows[row] = keep.kind.at(&place).0 / length + x[column];
            }
        }
    }

    /// The rows' slopes in the order of their pattern.
    pub fn jacobian(&self, x: &[f64], values: &mut [f64]) {
        let read = self.read(x);
        self.jacobian.fill(values, |sink| self.emit_jacobian(&read, sink));
    }

    pub(super) fn emit_jacobian(&self, read: &Read, sink: &mut impl EntrySink) {
        for StartRows { control, row } in &self.starts {
            self.emit_start_slopes(*control, *row, read, sink);
        }
        for (step, stage) in self.stages.iter().enumerate() {
            for (body, motion) in self.motions.iter().enumerate() {
                let ends = (&read.states[step][body], &read.states[step + 1][body]);
                let columns = (self.state(step, body), self.state(step + 1, body));
                motion.emit_slopes(ends, stage.rows + STATE.end * body, columns, sink);
            }
            for pushed in self.each_push(step, read) {
                let row = stage.rows + STATE.end * pushed.body;
                let column = self.state(step, pushed.body) + ATTITUDE.start;
                let motion = &self.motions[pushed.body];
                let state = &read.states[step][pushed.body];
                pushed.emit_slopes((motion, state), (row, column), self, sink);
            }
            for (meeting, posed) in self.each_contact(step, read) {
                meeting.emit_slopes(&posed, sink);
            }
            for (tie, tied) in self.each_tie(step, read) {
                tie.emit_slopes(&tied, sink);
            }
            self.emit_gear_slopes(step, read, sink);
            for (keep, &(slack, row)) in self.problem.keeps().iter().zip(&stage.keeps) {
                let place = read.states[step + 1][keep.body].position * self.units.length();
                let slope = keep.kind.at(&place).1;
                let column = self.state(step + 1, keep.body) + POSITION.start;
                sink.put_row(row, column, slope.iter().copied());
                sink.put(row, slack, 1.0);
            }
        }
    }

    /// σ ∇²(cost) + Σ y_r ∇²(row r) in the order of its pattern.
    pub fn hessian(&self, x: &[f64], sigma: f64, y: &[f64], values: &mut [f64]) {
        let read = self.read(x);
        self.hessian.fill(values, |sink| self.emit_hessian(&read, sigma, y, sink));
    }

    pub(super) fn emit_hessian(
        &self,
        read: &Read,
        sigma: f64,
        y: &[f64],
        sink: &mut impl EntrySink,
    ) {
        let sigma = sigma * self.factor;
        for (index, of) in self.problem.variables().iter().enumerate() {
            let column = self.columns[index];
            let scale = self.scales[index];
            sink.put(column, column, 2.0 * sigma * of.effort * scale * scale);
        }
        for target in self.problem.targets() {
            let state = &read.states[target.after][target.body];
            let goal = Goal::of(&target.kind, state, &self.units);
            let first = self.state(target.after, target.body) + goal.first;
            let weight = sigma * target.weight;
            for i in 0..goal.count {
                for j in 0..=i {
                    sink.put(first + i, first + j, weight * goal.curvature[(i, j)]);
                }
            }
        }
        for (keep, column, weight) in self.each_slack() {
            sink.put(column, column, 2.0 * sigma * keep.weight * weight);
        }
        for StartRows { control, row } in &self.starts {
            self.emit_start_curvatures(*control, &y[*row..], read, sink);
        }
        for (step, stage) in self.stages.iter().enumerate() {
            for (body, motion) in self.motions.iter().enumerate() {
                let ends = (&read.states[step][body], &read.states[step + 1][body]);
                let columns = (self.state(step, body), self.state(step + 1, body));
                motion.emit_curvatures(ends, &y[stage.rows + STATE.end * body..], columns, sink);
            }
            for pushed in self.each_push(step, read) {
                let own = &y[stage.rows + STATE.end * pushed.body..];
                let column = self.state(step, pushed.body) + ATTITUDE.start;
                let motion = &self.motions[pushed.body];
                let state = &read.states[step][pushed.body];
                pushed.emit_curvatures((motion, state), (own, column), self, sink);
            }
            for (meeting, posed) in self.each_contact(step, read) {
                meeting.emit_curvatures(&posed, y, sink);
            }
            for (tie, tied) in self.each_tie(step, read) {
                tie.emit_curvatures(&tied, y, sink);
            }
            self.emit_gear_curvatures(step, (read, y), sink);
            for (keep, &(_, row)) in self.problem.keeps().iter().zip(&stage.keeps) {
                let length = self.units.length();
                let place = read.states[step + 1][keep.body].position * length;
                let bend = keep.kind.at(&place).2 * (y[row] * length);
                sink.put_lower(self.state(step + 1, keep.body) + POSITION.start, &bend);
            }
        }
    }
}
