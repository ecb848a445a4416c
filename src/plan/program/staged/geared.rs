//! The gears of the program: what two coordinates are off by in every step, and the force that ties them.
//!
//! ```text
//! (q₁⁺ − r q₂⁺ − q₀)/h + ε h (F − F⁰) = 0,   F on the first coordinate, −r F on the second       (J15, P13)
//! ```

use super::super::axis::{AxisLaw, END, FORCE, Numbers};
use super::super::contact::{Bend, Slope};
use super::super::joint::{ANGLE, ANGULAR, Tied};
use super::tied::{Joints, at, number_of};
use super::{Laws, PlanNlp, Read, refused};
use crate::joint::Axis;
use crate::mechanics::State;
use crate::plan::{PlanError, Problem, Replay};
use crate::step_nlp::entries::EntrySink;

/// A gear in the program's units.
pub(super) struct Mesh {
    /// Joints and their axes, and what of each coordinate is in the sum.
    axes: [(usize, usize, f64); 2],
    offset: f64,
    /// Of its force, N or N m.
    unit: f64,
}

/// A gear in a step.
pub(super) struct Meshed {
    pub(super) law: AxisLaw,
    pub(super) column: usize,
    row: usize,
}

/// Those of a problem.
pub(super) fn meshes(problem: &Problem, joints: &Joints) -> Result<Vec<Mesh>, PlanError> {
    let gears = problem.scene().world.gears().iter();
    let mesh = |gear: &crate::joint::Gear| {
        if gear.drive().is_some() {
            return refused("a law acts on the sum of two coordinates of its scene");
        }
        let [first, second] = gear.axes().map(|of| (of.joint, number_of(of.axis)));
        for (joint, axis) in [first, second] {
            if axis >= ANGULAR && !(axis == ANGLE && joints.tie(joint, 0).is_hinge) {
                return refused("a gear of its scene is of a turn that is no hinge's");
            }
        }
        let units = |(joint, axis): (usize, usize)| joints.units[joint][axis / ANGULAR];
        let [one, other] = [units(first), units(second)].map(|units| units.coordinate);
        let share = -gear.ratio() * other / one;
        let axes = [(first.0, first.1, 1.0), (second.0, second.1, share)];
        Ok(Mesh { axes, offset: gear.offset() / one, unit: units(first).force })
    };
    gears.map(mesh).collect()
}

impl PlanNlp<'_> {
    /// Columns and rows of all gears in a step of the length `h`.
    pub(super) fn lay_gears(&mut self, h: f64, laws: &Laws<'_>) -> Vec<Meshed> {
        let mut all = Vec::with_capacity(self.gears.len());
        for gear in 0..self.gears.len() {
            let units = self.joints.units[self.gears[gear].axes[0].0][0];
            let Some(mut law) = AxisLaw::new(&Axis::Locked, &units, h, None) else { continue };
            law.compliance = laws.compliance * h;
            let column = self.add_variables(1, [f64::NEG_INFINITY, f64::INFINITY]);
            let row = self.add_rows(1, false);
            all.push(Meshed { law, column, row });
        }
        all
    }

    /// The numbers of all gears, of each step: what each is off by at the end, and its force.
    pub(super) fn read_gears(&self, x: &[f64], states: &[Vec<State>]) -> Vec<Vec<Numbers>> {
        let start = |(joint, axis, _): (usize, usize, f64)| {
            let tie = self.joints.tie(joint, 0);
            tie.coordinate(axis, at(tie, &states[0]), 0.0)
        };
        let mut last: Vec<_> = self.gears.iter().map(|mesh| mesh.axes.map(start)).collect();
        let stages = self.stages.iter().enumerate();
        stages
            .map(|(step, stage)| {
                let all = self.gears.iter().zip(&mut last).zip(&stage.gears);
                all.map(|((mesh, last), meshed)| {
                    let mut numbers = Numbers::zeros();
                    numbers[FORCE] = x[meshed.column];
                    numbers[END] = -mesh.offset;
                    for ((joint, axis, share), near) in mesh.axes.into_iter().zip(last) {
                        let tie = self.joints.tie(joint, step);
                        *near = tie.coordinate(axis, at(tie, &states[step + 1]), *near);
                        numbers[END] += share * *near;
                    }
                    numbers
                })
                .collect()
            })
            .collect()
    }

    /// Adds the forces of gears on the axes of a joint.
    pub(super) fn add_gear_forces(
        &self,
        (step, joint): (usize, usize),
        read: &Read,
        tied: &mut Tied<'_>,
    ) {
        let meshed = self.stages[step].gears.iter().zip(&read.gears[step]);
        for (mesh, (meshed, numbers)) in self.gears.iter().zip(meshed) {
            for (_, axis, share) in mesh.axes.into_iter().filter(|(of, ..)| *of == joint) {
                tied.add_force(axis, share * numbers[FORCE], Some((meshed.column, share)));
            }
        }
    }

    /// Puts the forces of the gears of a run into its point.
    pub(super) fn place_gears(&self, replay: &Replay, x: &mut [f64]) {
        for (stage, record) in self.stages.iter().zip(&replay.records) {
            let forces = self.gears.iter().zip(&record.solution.gears);
            for (meshed, (mesh, force)) in stage.gears.iter().zip(forces) {
                x[meshed.column] = force / mesh.unit;
            }
        }
    }

    /// The rows of a step.
    pub(super) fn add_gear_rows(&self, step: usize, read: &Read, rows: &mut [f64]) {
        for (meshed, numbers) in self.stages[step].gears.iter().zip(&read.gears[step]) {
            for (k, value) in meshed.law.values(numbers).enumerate() {
                rows[meshed.row + k] = value;
            }
        }
    }

    /// Their slopes.
    pub(super) fn emit_gear_slopes(&self, step: usize, read: &Read, sink: &mut impl EntrySink) {
        for (gear, meshed) in self.stages[step].gears.iter().enumerate() {
            let by = meshed.law.slope(0, &read.gears[step][gear]);
            sink.put(meshed.row, meshed.column, by[FORCE]);
            for (joint, axis, share) in self.gears[gear].axes {
                let tie = self.joints.tie(joint, step);
                let mut slope = Slope::new();
                let ends = at(tie, &read.states[step + 1]);
                tie.add(axis, ends, self.ends(step, joint), &mut slope);
                for &(column, value) in slope.entries() {
                    sink.put(meshed.row, column, by[END] * share * value);
                }
            }
        }
    }

    /// Their curvatures with the multipliers `y` of all rows: those of the coordinates, of which the rows are sums.
    pub(super) fn emit_gear_curvatures(
        &self,
        step: usize,
        (read, y): (&Read, &[f64]),
        sink: &mut impl EntrySink,
    ) {
        for (gear, meshed) in self.stages[step].gears.iter().enumerate() {
            let by = meshed.law.slope(0, &read.gears[step][gear]);
            for (joint, axis, share) in self.gears[gear].axes {
                let tie = self.joints.tie(joint, step);
                let mut bend = Bend::default();
                let curvature = tie.curvature(axis, at(tie, &read.states[step + 1]));
                bend.add(&curvature, by[END] * share * y[meshed.row]);
                bend.emit(self.ends(step, joint), sink);
            }
        }
    }

    /// The columns of both bodies of a joint at the end of a step.
    fn ends(&self, step: usize, joint: usize) -> (usize, Option<usize>) {
        let tie = self.joints.tie(joint, step);
        let column = |body: usize| self.state(step + 1, body);
        (column(tie.body), tie.other.map(column))
    }
}
