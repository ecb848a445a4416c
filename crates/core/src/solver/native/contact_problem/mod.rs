//! Contact problems given by matrices, as [`super::equations`]. Uncoupled parts of a problem are
//! solved separately.
//!
//! The unknowns V are values at nodes. Impulses change them directly, and rows depend on them:
//!
//! ```text
//! V = V_free + Σ B_i p̂_i,   u_i = C_i V + c_i,   (E − Σ B_i D_i C_i) δV = −r + Σ B_i d_i   (C5)
//! ```
//!
//! In the local form a node is a group of rows, with B a block column of W and C = E. In the global
//! form it is a connected component of M, with B = M⁻¹ H and C = Hᵀ. A component with more values
//! than rows is condensed to these rows, as in the local form. A moment depends on the normal impulse of
//! its contact as in (N17). Equation numbers refer to `docs/contact-problem.md`.

mod parts;
mod wide;

use super::coupling::Coupling;
use super::effort::SolveEffort;
use super::equations::{
    Elimination, Equations, EvaluatedPoint, MapResidual, MomentPlace, Slope, StepSetting,
    Velocities,
};
use super::law::{Gain, LocalSolution};
use super::settings::Settings;
use super::stages::{StageRun, StageSolver};
use crate::problem::{ContactProblem, ProblemError, Selection, Solution, SolveOptions};
use crate::sparse::{Fronts, SymbolicFactorisation};
use nalgebra::{Matrix3, Vector3};

/// Solves a problem part by part.
///
/// # Errors
/// [`ProblemError::Interrupted`].
fn solve(problem: &ContactProblem, options: &SolveOptions<'_>) -> Result<Solution, ProblemError> {
    let any = options.selection == Selection::Any;
    let mut impulses = vec![0.0; problem.row_count()];
    let mut iterations = 0;
    let mut selected = true;
    let mut run = StageRun::PREVIOUS;
    let mut solver = StageSolver::new();
    let parts = parts::problem_parts(problem, options.residual, Settings::for_problem(any));
    for part in &parts {
        let mut equations = part.equations.clone();
        let previous = part.scaled(problem, options.start);
        let mut effort = SolveEffort::new(options.interrupt);
        solver.reserve(previous.len());
        let accepted = options.residual / part.speed;
        let outcome = solver.solve(&mut equations, &previous, accepted, &mut effort);
        effort.check().map_err(|_| ProblemError::Interrupted)?;
        part.write(problem, solver.impulses(), &mut impulses);
        iterations += u64::from(effort.iterations());
        selected &= outcome.selected && outcome.solved;
        if run == StageRun::PREVIOUS {
            run = outcome.run;
        }
    }
    let evaluation = problem.evaluate(&impulses);
    Ok(Solution {
        iterations,
        parts: parts.len(),
        // Without an initial guess the first stage starts from zero impulses.
        start: match options.start {
            None if run == StageRun::PREVIOUS => StageRun::ZERO.name(),
            _ => run.name(),
        },
        selected: selected && evaluation.residual <= options.residual,
        ..Solution::new(impulses, evaluation, options.residual)
    })
}

/// Velocities of nodes.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct PosedMotion {
    /// Values by place in the plan.
    numbers: Vec<f64>,
    /// Motion of each coupling's rows, for a direction. Empty for a point.
    row_motions: Vec<Vector3<f64>>,
}

impl Velocities for PosedMotion {
    fn empty() -> Self {
        Self::default()
    }

    fn set_moved(&mut self, from: &Self, length: f64, step: &Self) {
        self.numbers.clear();
        let both = from.numbers.iter().zip(&step.numbers);
        self.numbers.extend(both.map(|(from, step)| from + length * step));
        self.row_motions.clear();
    }

    fn copy_from(&mut self, from: &Self) {
        self.numbers.clone_from(&from.numbers);
        self.row_motions.clone_from(&from.row_motions);
    }

    fn is_finite(&self) -> bool {
        self.numbers.iter().all(|number| number.is_finite())
    }
}

/// ∂u/∂V of a coupling, by its index. The row motion is computed together with the direction.
#[derive(Debug, Clone, Copy)]
pub(super) struct CouplingSlope(usize);

impl Slope for CouplingSlope {
    type Velocity = PosedMotion;

    fn velocity_change(&self, change: &PosedMotion) -> Vector3<f64> {
        change.row_motions[self.0]
    }
}

/// Relation of couplings to nodes: a list of links per coupling, and a matrix per link.
#[derive(Debug, Clone, Default)]
pub(super) struct Links {
    /// End of each coupling's links.
    ends: Vec<usize>,
    links: Vec<PosedLink>,
    numbers: Vec<f64>,
}

#[derive(Debug, Clone, Copy)]
struct PosedLink {
    /// Place of the node; `size` is its number of values.
    place: usize,
    size: usize,
    /// Start of its matrix: three entries for each value of the node.
    at: usize,
}

impl Links {
    /// Adds a link to the current coupling. `by` has one entry per row of the coupling, three for
    /// each value of the node.
    fn add(&mut self, place: usize, size: usize, by: &[f64]) {
        self.links.push(PosedLink { place, size, at: self.numbers.len() });
        self.numbers.extend_from_slice(by);
    }

    /// Completes the current coupling.
    fn end(&mut self) {
        self.ends.push(self.links.len());
    }

    /// Links of a coupling: place, size, and three entries for each value of the node.
    fn links(&self, coupling: usize) -> impl Iterator<Item = (usize, usize, &[f64])> + Clone {
        let begin = if coupling == 0 { 0 } else { self.ends[coupling - 1] };
        let links = self.links[begin..self.ends[coupling]].iter();
        links.map(|link| (link.place, link.size, &self.numbers[link.at..link.at + 3 * link.size]))
    }

    /// Adds the effect of `along` the rows to values by place.
    fn push(&self, coupling: usize, along: &Vector3<f64>, numbers: &mut [f64]) {
        for (place, size, by) in self.links(coupling) {
            for (number, by) in numbers[place..place + size].iter_mut().zip(by.chunks_exact(3)) {
                *number += by[0] * along[0] + by[1] * along[1] + by[2] * along[2];
            }
        }
    }

    /// Row motions for values by place.
    fn row_motion(&self, coupling: usize, numbers: &[f64]) -> Vector3<f64> {
        let mut motion = Vector3::zeros();
        for (place, size, by) in self.links(coupling) {
            for (number, by) in numbers[place..place + size].iter().zip(by.chunks_exact(3)) {
                motion += Vector3::new(by[0], by[1], by[2]) * *number;
            }
        }
        motion
    }
}

/// Equations of a part of a problem (C5), in its own units of speed and impulse.
#[derive(Debug, Clone)]
pub(super) struct PosedEquations {
    setting: StepSetting,
    settings: &'static Settings,
    plan: SymbolicFactorisation,
    /// V_free.
    free: Vec<f64>,
    /// B; `sees` is C.
    pushes: Links,
    sees: Links,
    moments: Vec<MomentPlace>,
}

impl PosedEquations {
    /// Adds −B G C to the matrix, with B of one coupling and C of another one.
    fn add_gain(&self, row: usize, gain: &Matrix3<f64>, column: usize, system: &mut PosedSystem) {
        let PosedSystem { fronts, pushed, block, .. } = system;
        for (row, rows, by) in self.pushes.links(row) {
            pushed.clear();
            pushed.extend(by.chunks_exact(3).flat_map(|by| {
                let along = gain.tr_mul(&Vector3::new(by[0], by[1], by[2]));
                [-along[0], -along[1], -along[2]]
            }));
            for (column, _, motion) in self.sees.links(column) {
                block.clear();
                for motion in motion.chunks_exact(3) {
                    let entry =
                        |by: &[f64]| by[0] * motion[0] + by[1] * motion[1] + by[2] * motion[2];
                    block.extend(pushed.chunks_exact(3).map(entry));
                }
                fronts.add(&self.plan, row, column, rows, block);
            }
        }
    }

    /// Moments that follow their contact: w of each, and n of its contact.
    fn loaded<'a>(
        &'a self,
        eliminations: &'a [Elimination<CouplingSlope>],
    ) -> impl Iterator<Item = (MomentPlace, Vector3<f64>, Vector3<f64>)> + 'a {
        self.moments.iter().filter_map(|at| match &eliminations[at.moment].local_solution.gain {
            Gain::Moment(gain) => {
                Some((*at, gain.by_load, self.setting.couplings[at.contact].rows.normal()))
            }
            _ => None,
        })
    }
}

/// Linear system and scratch.
#[derive(Debug, Clone, Default)]
pub(super) struct PosedSystem {
    fronts: Fronts,
    behind: Vec<f64>,
    values: Vec<f64>,
    pushed: Vec<f64>,
    block: Vec<f64>,
}

impl Equations for PosedEquations {
    type Velocity = PosedMotion;
    type Slope = CouplingSlope;
    type System = PosedSystem;
    /// r.
    type Scratch = Vec<f64>;

    fn setting(&self) -> &StepSetting {
        &self.setting
    }

    fn setting_mut(&mut self) -> &mut StepSetting {
        &mut self.setting
    }

    fn settings(&self) -> &'static Settings {
        self.settings
    }

    fn moments(&self) -> &[MomentPlace] {
        &self.moments
    }

    /// Returns 1: speeds are relative to the part's own.
    fn speed(&self) -> f64 {
        1.0
    }

    fn set_velocity_after(&self, impulses: &[Vector3<f64>], velocity: &mut PosedMotion) {
        velocity.numbers.clone_from(&self.free);
        velocity.row_motions.clear();
        for (index, impulse) in impulses.iter().enumerate() {
            self.pushes.push(index, impulse, &mut velocity.numbers);
        }
    }

    /// Does nothing: the last motion is unknown.
    fn keep_velocity(&self, _: &mut PosedMotion) {}

    fn turns_too_far(&self, _: &PosedMotion) -> bool {
        false
    }

    fn energy_made(&self, _: &PosedMotion, _: &[Vector3<f64>], _: &[Vector3<f64>]) -> f64 {
        0.0
    }

    fn motion_residual(
        &self,
        velocity: &PosedMotion,
        impulses: &[Vector3<f64>],
        residuals: &mut Vec<f64>,
    ) -> MapResidual {
        residuals.clear();
        let both = velocity.numbers.iter().zip(&self.free);
        residuals.extend(both.map(|(number, free)| number - free));
        for (index, impulse) in impulses.iter().enumerate() {
            if *impulse != Vector3::zeros() {
                self.pushes.push(index, &-impulse, residuals);
            }
        }
        let mut size = MapResidual::default();
        size.add_all(residuals);
        size
    }

    fn set_points(&self, velocity: &PosedMotion, _: &mut Vec<f64>, points: &mut Vec<Vector3<f64>>) {
        let couplings = self.setting.couplings.iter().enumerate();
        let motion = |index| self.sees.row_motion(index, &velocity.numbers);
        points.clear();
        points.extend(couplings.map(|(index, coupling)| coupling.offset + motion(index)));
    }

    fn linearise(
        &self,
        at: EvaluatedPoint<'_, Self>,
        mut local_solution: impl FnMut(usize, &Coupling, &Vector3<f64>) -> Option<LocalSolution>,
        eliminations: &mut Vec<Elimination<CouplingSlope>>,
        system: &mut PosedSystem,
    ) -> bool {
        system.fronts.begin_unit(&self.plan);
        eliminations.clear();
        for (index, (coupling, u)) in self.setting.couplings.iter().zip(at.points).enumerate() {
            let Some(local_solution) = local_solution(index, coupling, u) else { return false };
            eliminations.push(Elimination { local_solution, slope: CouplingSlope(index) });
            if let Some(gain) = local_solution.gain.matrix() {
                self.add_gain(index, &gain, index, system);
            }
        }
        for (at, by_load, normal) in self.loaded(eliminations) {
            if let Some(gain) = eliminations[at.contact].local_solution.gain.matrix() {
                let gain = by_load * gain.tr_mul(&normal).transpose();
                self.add_gain(at.moment, &gain, at.contact, system);
            }
        }
        system.fronts.factorise(&self.plan)
    }

    fn direction(
        &self,
        residuals: &Vec<f64>,
        eliminations: &[Elimination<CouplingSlope>],
        system: &mut PosedSystem,
        step: &mut PosedMotion,
    ) -> bool {
        let PosedSystem { fronts, values, behind, .. } = system;
        values.clear();
        values.extend(residuals.iter().map(|residual| -residual));
        for (index, elimination) in eliminations.iter().enumerate() {
            self.pushes.push(index, &elimination.local_solution.offset, values);
        }
        for (at, by_load, normal) in self.loaded(eliminations) {
            let pressed = normal.dot(&eliminations[at.contact].local_solution.offset);
            self.pushes.push(at.moment, &(by_load * pressed), values);
        }
        fronts.solve(&self.plan, values, behind);
        step.numbers.clone_from(values);
        step.row_motions.clear();
        let couplings = 0..self.setting.couplings.len();
        step.row_motions.extend(couplings.map(|index| self.sees.row_motion(index, &step.numbers)));
        step.is_finite()
    }
}
