//! The part of the step problem that Ipopt sees: selected variables and rows, with the
//! tutorial's bounds.

use super::Formulation;
use crate::ipopt::{Bounds, NonlinearProgram, Progress};
use crate::sparsity::SparsityPattern;
use crate::step_nlp::StepNlp;
use crate::step_nlp::layout::{Layout, STATE, UNIT_NORM_ROW};
use std::sync::atomic::{AtomicBool, Ordering};

/// Which variables and rows of a [`StepNlp`] take part, and where the entries of the
/// selected matrices stand among all entries.
pub(super) struct Subproblem {
    variables: Vec<usize>,
    rows: Vec<usize>,
    jacobian: Selection,
    hessian: Selection,
    bounds: Bounds,
}

/// A sparse matrix picked out of another.
struct Selection {
    pattern: SparsityPattern,
    /// The index of each entry in the whole matrix.
    entries: Vec<usize>,
}

/// Arrays of the whole problem's size.
pub(super) struct Scratch {
    x: Vec<f64>,
    gradient: Vec<f64>,
    constraints: Vec<f64>,
    multipliers: Vec<f64>,
    jacobian: Vec<f64>,
    hessian: Vec<f64>,
}

impl Scratch {
    pub(super) fn new(nlp: &StepNlp) -> Self {
        let layout = nlp.layout();
        Self {
            x: vec![0.0; layout.variables()],
            gradient: vec![0.0; layout.variables()],
            constraints: vec![0.0; layout.constraints()],
            multipliers: vec![0.0; layout.constraints()],
            jacobian: vec![0.0; nlp.jacobian_pattern().len()],
            hessian: vec![0.0; nlp.hessian_pattern().len()],
        }
    }
}

impl Subproblem {
    pub(super) fn new(nlp: &StepNlp, active: &[bool], formulation: Formulation) -> Self {
        let layout = nlp.layout();
        let mut keep_variable = vec![true; layout.variables()];
        let mut keep_row = vec![true; layout.constraints()];
        if formulation == Formulation::Reduced {
            keep_row[UNIT_NORM_ROW] = false;
            let with_friction = nlp.world().friction() > 0.0;
            for (i, active) in active.iter().enumerate() {
                let [fx, fy, fz, s1, s2, slip] = layout.contact_variables(i);
                for variable in [fz, s1] {
                    keep_variable[variable] = *active;
                }
                for row in normal_rows(layout, i) {
                    keep_row[row] = *active;
                }
                for variable in [fx, fy, s2, slip] {
                    keep_variable[variable] = *active && with_friction;
                }
                for row in friction_rows(layout, i) {
                    keep_row[row] = *active && with_friction;
                }
            }
        }
        let (variables, variable_at) = kept(&keep_variable);
        let (rows, row_at) = kept(&keep_row);
        let jacobian = Selection::new(nlp.jacobian_pattern(), &row_at, &variable_at);
        let hessian = Selection::new(nlp.hessian_pattern(), &variable_at, &variable_at);
        let whole = step_bounds(layout, active);
        let pick = |indices: &[usize], values: &[f64]| -> Vec<f64> {
            indices.iter().map(|&index| values[index]).collect()
        };
        let bounds = Bounds {
            lower: pick(&variables, &whole.lower),
            upper: pick(&variables, &whole.upper),
            constraint_lower: pick(&rows, &whole.constraint_lower),
            constraint_upper: pick(&rows, &whole.constraint_upper),
        };
        Self { variables, rows, jacobian, hessian, bounds }
    }

    pub(super) fn variables(&self) -> &[usize] {
        &self.variables
    }

    pub(super) fn bounds(&self) -> &Bounds {
        &self.bounds
    }

    /// The selected variables of a whole decision vector.
    pub(super) fn gather(&self, whole: &[f64], selected: &mut [f64]) {
        for (selected, &index) in selected.iter_mut().zip(&self.variables) {
            *selected = whole[index];
        }
    }

    /// A whole decision vector of the selected variables, the others zero.
    pub(super) fn scatter(&self, selected: &[f64], whole: &mut [f64]) {
        whole.fill(0.0);
        for (&selected, &index) in selected.iter().zip(&self.variables) {
            whole[index] = selected;
        }
    }

    /// The selected part of `nlp` as Ipopt's wrapper takes it.
    pub(super) fn bind<'a>(
        &'a self,
        nlp: &'a StepNlp,
        scratch: &'a mut Scratch,
        interrupt: Option<&'a AtomicBool>,
    ) -> BoundProgram<'a> {
        scratch.x.fill(0.0);
        scratch.multipliers.fill(0.0);
        BoundProgram { subproblem: self, nlp, scratch, interrupt }
    }
}

impl Selection {
    fn new(whole: &SparsityPattern, row_at: &[Option<usize>], col_at: &[Option<usize>]) -> Self {
        let (mut pattern, mut entries) = (SparsityPattern::new(), Vec::new());
        for (index, (row, col)) in whole.positions().enumerate() {
            if let (Some(row), Some(col)) = (row_at[row], col_at[col]) {
                pattern.push(row, col);
                entries.push(index);
            }
        }
        Self { pattern, entries }
    }

    fn pick(&self, whole: &[f64], values: &mut [f64]) {
        for (value, &index) in values.iter_mut().zip(&self.entries) {
            *value = whole[index];
        }
    }
}

/// The indices that are kept, and the new index of each old one.
fn kept(keep: &[bool]) -> (Vec<usize>, Vec<Option<usize>>) {
    let mut indices = Vec::new();
    let new_index = keep
        .iter()
        .enumerate()
        .map(|(old, &keep)| {
            keep.then(|| {
                indices.push(old);
                indices.len() - 1
            })
        })
        .collect();
    (indices, new_index)
}

/// Height and normal complementarity of contact `i`.
fn normal_rows(layout: Layout, i: usize) -> [usize; 2] {
    [layout.height_rows().start + i, layout.normal_complementarity_rows().start + i]
}

/// Maximum dissipation, cone and friction complementarity of contact `i`.
fn friction_rows(layout: Layout, i: usize) -> [usize; 4] {
    let dissipation = layout.dissipation_rows().start + 2 * i;
    [
        dissipation,
        dissipation + 1,
        layout.cone_rows().start + i,
        layout.friction_complementarity_rows().start + i,
    ]
}

/// The tutorial's bounds (eq. 17): X⁺, f_x and f_y free, the other variables ≥ 0,
/// equations = 0, inequalities ≥ 0. The variables of an unflagged contact are clamped to
/// zero, because an interior-point method would not let its force touch the bound it
/// should rest on.
fn step_bounds(layout: Layout, active: &[bool]) -> Bounds {
    let (n, m) = (layout.variables(), layout.constraints());
    let mut bounds = Bounds {
        lower: vec![0.0; n],
        upper: vec![f64::INFINITY; n],
        constraint_lower: vec![0.0; m],
        constraint_upper: vec![f64::INFINITY; m],
    };
    for free in [STATE, layout.force_x(), layout.force_y()] {
        bounds.lower[free].fill(f64::NEG_INFINITY);
    }
    for (i, _) in active.iter().enumerate().filter(|(_, active)| !**active) {
        for variable in layout.contact_variables(i) {
            bounds.lower[variable] = 0.0;
            bounds.upper[variable] = 0.0;
        }
    }
    bounds.constraint_upper[..layout.equalities()].fill(0.0);
    bounds
}

/// A [`Subproblem`] with the functions behind it.
pub(super) struct BoundProgram<'a> {
    subproblem: &'a Subproblem,
    nlp: &'a StepNlp,
    scratch: &'a mut Scratch,
    /// Ends the solve when it is raised.
    interrupt: Option<&'a AtomicBool>,
}

impl BoundProgram<'_> {
    /// Writes the selected variables to the whole vector; the others stay zero.
    fn load(&mut self, x: &[f64]) {
        for (&value, &index) in x.iter().zip(&self.subproblem.variables) {
            self.scratch.x[index] = value;
        }
    }
}

impl NonlinearProgram for BoundProgram<'_> {
    fn keep_going(&mut self, _progress: &Progress) -> bool {
        !self.interrupt.is_some_and(|flag| flag.load(Ordering::Relaxed))
    }

    fn variable_count(&self) -> usize {
        self.subproblem.variables.len()
    }

    fn constraint_count(&self) -> usize {
        self.subproblem.rows.len()
    }

    fn jacobian_pattern(&self) -> &SparsityPattern {
        &self.subproblem.jacobian.pattern
    }

    fn hessian_pattern(&self) -> &SparsityPattern {
        &self.subproblem.hessian.pattern
    }

    fn objective(&mut self, x: &[f64]) -> f64 {
        self.load(x);
        self.nlp.objective(&self.scratch.x)
    }

    fn gradient(&mut self, x: &[f64], gradient: &mut [f64]) {
        self.load(x);
        self.nlp.gradient(&self.scratch.x, &mut self.scratch.gradient);
        self.subproblem.gather(&self.scratch.gradient, gradient);
    }

    fn constraints(&mut self, x: &[f64], constraints: &mut [f64]) {
        self.load(x);
        self.nlp.constraints(&self.scratch.x, &mut self.scratch.constraints);
        for (value, &row) in constraints.iter_mut().zip(&self.subproblem.rows) {
            *value = self.scratch.constraints[row];
        }
    }

    fn jacobian(&mut self, x: &[f64], values: &mut [f64]) {
        self.load(x);
        self.nlp.jacobian(&self.scratch.x, &mut self.scratch.jacobian);
        self.subproblem.jacobian.pick(&self.scratch.jacobian, values);
    }

    fn hessian(
        &mut self,
        x: &[f64],
        objective_factor: f64,
        multipliers: &[f64],
        values: &mut [f64],
    ) {
        self.load(x);
        for (&multiplier, &row) in multipliers.iter().zip(&self.subproblem.rows) {
            self.scratch.multipliers[row] = multiplier;
        }
        let scratch = &mut *self.scratch;
        self.nlp.hessian(&scratch.x, objective_factor, &scratch.multipliers, &mut scratch.hessian);
        self.subproblem.hessian.pick(&self.scratch.hessian, values);
    }
}
