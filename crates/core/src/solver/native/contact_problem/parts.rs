//! Decomposition of a problem into parts, with nodes and units of their own.

use super::{Links, PosedEquations};
use crate::joint::Graph;
use crate::problem::{self, ContactProblem, Form, SparseMatrix, three};
use crate::sets::DisjointSets;
use crate::solver::native::coupling::Coupling;
use crate::solver::native::equations::{MomentPlace, StepSetting};
use crate::solver::native::law::{AxesLaw, Cone, CouplingLaw, CouplingRows, MomentLaw};
use crate::solver::native::settings::Settings;
use crate::solver::native::tolerances::Tolerances;
use crate::sparse::SymbolicFactorisation;
use nalgebra::{Matrix3, Vector3};
use std::collections::HashMap;
use std::ops::Range;

/// Part of a problem: groups of rows coupled to no others.
#[derive(Debug, Clone)]
pub(super) struct ProblemPart {
    pub(super) equations: PosedEquations,
    groups: Vec<usize>,
    /// Unit of speed (m/s); `impulse` is the unit of impulses (N s).
    pub(super) speed: f64,
    impulse: f64,
}

/// All parts, in the order of their first groups. They are solved to `residual` (m/s).
pub(super) fn problem_parts(
    problem: &ContactProblem,
    residual: f64,
    settings: &'static Settings,
) -> Vec<ProblemPart> {
    let nodes = Nodes::from_problem(problem);
    let responses = problem.responses();
    let groups = nodes.parts(problem.laws());
    groups
        .into_iter()
        .map(|groups| nodes.part(problem, groups, &responses, residual, settings))
        .collect()
}

impl ProblemPart {
    /// Initial impulses in the part's unit. Zero without a start.
    pub(super) fn scaled(
        &self,
        problem: &ContactProblem,
        start: Option<&[f64]>,
    ) -> Vec<Vector3<f64>> {
        let of = |group: &usize| {
            start.map_or(Vector3::zeros(), |start| {
                three(&start[problem.rows(*group)]) / self.impulse
            })
        };
        self.groups.iter().map(of).collect()
    }

    /// Writes the impulses of the part.
    pub(super) fn write(
        &self,
        problem: &ContactProblem,
        solved: &[Vector3<f64>],
        impulses: &mut [f64],
    ) {
        for (group, impulse) in self.groups.iter().zip(solved) {
            let own = impulses[problem.rows(*group)].iter_mut();
            own.zip(impulse).for_each(|(to, value)| *to = value * self.impulse);
        }
    }
}

/// Nodes of a problem and their relation to groups of rows.
#[derive(Debug, Default)]
struct Nodes {
    sizes: Vec<usize>,
    /// V_free of each node.
    free: Vec<Vec<f64>>,
    /// Effect of each group's impulses on nodes, and dependence of its rows on nodes (`sees`):
    /// three entries for each value of the node.
    pushes: Vec<Vec<(usize, Vec<f64>)>>,
    sees: Vec<Vec<(usize, Vec<f64>)>>,
    /// Constant part of each group's motion.
    offsets: Vec<Vector3<f64>>,
}

impl Nodes {
    fn from_problem(problem: &ContactProblem) -> Self {
        let count = problem.laws().len();
        let mut nodes = Self {
            pushes: vec![Vec::new(); count],
            sees: vec![Vec::new(); count],
            ..Self::default()
        };
        match problem.form() {
            Form::Local { response, free } => {
                let blocks = |group: usize| columns_of(response, problem.rows(group));
                let own: Vec<usize> =
                    (0..count).map(|group| nodes.add_rows(problem.rows(group).len())).collect();
                for group in 0..count {
                    nodes.see_rows(group, own[group], problem.rows(group).len());
                    nodes.add_blocks(problem, group, &blocks(group), &own);
                    nodes.offsets.push(three(&free[problem.rows(group)]));
                }
            }
            Form::Global(global) => nodes.add_global(problem, global),
        }
        nodes
    }

    /// Adds a node of `rows` rows, at rest without impulses.
    fn add_rows(&mut self, rows: usize) -> usize {
        self.sizes.push(rows);
        self.free.push(vec![0.0; rows]);
        self.sizes.len() - 1
    }

    /// Makes the rows of a group equal to the values of a node.
    fn see_rows(&mut self, group: usize, node: usize, rows: usize) {
        let unit = (0..rows).flat_map(|k| (0..3).map(move |i| if i == k { 1.0 } else { 0.0 }));
        self.sees[group].push((node, unit.collect()));
    }

    /// Adds the effect of a group on the nodes `own` of groups, by the blocks of its columns.
    fn add_blocks(
        &mut self,
        problem: &ContactProblem,
        group: usize,
        columns: &[Vec<(usize, f64)>],
        own: &[usize],
    ) {
        let mut blocks: HashMap<usize, Vec<f64>> = HashMap::new();
        let mut touched = Vec::new();
        for (k, column) in columns.iter().enumerate() {
            for &(row, value) in column {
                let other = problem.group_of(row);
                let rows = problem.rows(other);
                let block = blocks.entry(other).or_insert_with(|| {
                    touched.push(other);
                    vec![0.0; 3 * rows.len()]
                });
                block[3 * (row - rows.start) + k] = value;
            }
        }
        touched.sort_unstable();
        for other in touched {
            let block = blocks.remove(&other).unwrap_or_default();
            self.pushes[group].push((own[other], block));
        }
    }

    /// Adds the nodes of a global problem.
    fn add_global(&mut self, problem: &ContactProblem, global: &problem::Global) {
        let count = problem.laws().len();
        let (mass, directions) = (global.factors(), &global.directions);
        // Groups that touch each component of M.
        let mut touching = vec![Vec::new(); mass.components().len()];
        for group in 0..count {
            for (row, _) in columns_of(directions, problem.rows(group)).concat() {
                touching[mass.place(row).0].push(group);
            }
        }
        for groups in &mut touching {
            groups.dedup();
        }
        // Components touched by the same groups form one node.
        let mut bundles: HashMap<&[usize], usize> = HashMap::new();
        let mut members: Vec<(&[usize], Vec<usize>)> = Vec::new();
        for (part, groups) in touching.iter().enumerate().filter(|(_, groups)| !groups.is_empty()) {
            let bundle = *bundles.entry(groups).or_insert_with(|| {
                members.push((groups, Vec::new()));
                members.len() - 1
            });
            members[bundle].1.push(part);
        }
        self.offsets = (0..count).map(|group| three(&global.offset[problem.rows(group)])).collect();
        for (groups, parts) in members {
            let numbers: Vec<usize> =
                parts.iter().flat_map(|part| &mass.components()[*part].numbers).copied().collect();
            let rows: usize = groups.iter().map(|group| problem.rows(*group).len()).sum();
            if numbers.len() <= rows {
                self.add_body(problem, global, groups, &numbers);
            } else {
                self.add_condensed(problem, global, groups, &numbers);
            }
        }
    }

    /// Adds a node of some velocity components.
    fn add_body(
        &mut self,
        problem: &ContactProblem,
        global: &problem::Global,
        groups: &[usize],
        numbers: &[usize],
    ) {
        let node = self.sizes.len();
        let mut own = OwnMass::new(global, numbers);
        self.sizes.push(numbers.len());
        self.free.push(own.free());
        for &group in groups {
            let (mut motion, mut pushed) =
                (vec![0.0; 3 * numbers.len()], vec![0.0; 3 * numbers.len()]);
            for (k, column) in problem.rows(group).enumerate() {
                let (along, moved) = own.column(column);
                for (at, (along, moved)) in along.iter().zip(moved).enumerate() {
                    motion[3 * at + k] = *along;
                    pushed[3 * at + k] = *moved;
                }
            }
            self.sees[group].push((node, motion));
            self.pushes[group].push((node, pushed));
        }
    }

    /// Adds a node for each group instead of velocity components: their values are the row motions.
    fn add_condensed(
        &mut self,
        problem: &ContactProblem,
        global: &problem::Global,
        groups: &[usize],
        numbers: &[usize],
    ) {
        let mut own = OwnMass::new(global, numbers);
        let free = own.free();
        let columns: Vec<usize> = groups.iter().flat_map(|group| problem.rows(*group)).collect();
        let along: Vec<Vec<f64>> =
            columns.iter().map(|column| own.column(*column).0.to_vec()).collect();
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let mut first = 0;
        let mut nodes = Vec::with_capacity(groups.len());
        for &group in groups {
            let rows = problem.rows(group).len();
            let node = self.add_rows(rows);
            self.free[node] =
                along[first..first + rows].iter().map(|along| dot(along, &free)).collect();
            self.see_rows(group, node, rows);
            nodes.push((node, first..first + rows));
            first += rows;
        }
        for &group in groups {
            let mut blocks: Vec<Vec<f64>> =
                nodes.iter().map(|(_, rows)| vec![0.0; 3 * rows.len()]).collect();
            for (k, column) in problem.rows(group).enumerate() {
                let (_, moved) = own.column(column);
                for (block, (_, rows)) in blocks.iter_mut().zip(&nodes) {
                    for (at, along) in along[rows.clone()].iter().enumerate() {
                        block[3 * at + k] = dot(along, moved);
                    }
                }
            }
            let pushed = nodes.iter().zip(blocks).map(|((node, _), block)| (*node, block));
            self.pushes[group].extend(pushed);
        }
    }

    /// Groups of every part.
    fn parts(&self, laws: &[problem::Law]) -> Vec<Vec<usize>> {
        let count = laws.len();
        let mut sets = DisjointSets::new(count + self.sizes.len());
        for group in 0..count {
            for (node, _) in self.pushes[group].iter().chain(&self.sees[group]) {
                sets.join(group, count + node);
            }
        }
        for (group, law) in laws.iter().enumerate() {
            if let problem::Law::Moment { contact, .. } = law {
                sets.join(group, *contact);
            }
        }
        let mut lists = sets.lists();
        lists.iter_mut().for_each(|list| list.retain(|member| *member < count));
        lists.retain(|list| !list.is_empty());
        lists
    }

    /// Builds a part, with the required accuracy.
    fn part(
        &self,
        problem: &ContactProblem,
        groups: Vec<usize>,
        responses: &[f64],
        residual: f64,
        settings: &'static Settings,
    ) -> ProblemPart {
        // Nodes of the part, and their places in it.
        let mut used: Vec<usize> = groups
            .iter()
            .flat_map(|group| self.pushes[*group].iter().chain(&self.sees[*group]))
            .map(|(node, _)| *node)
            .collect();
        used.sort_unstable();
        used.dedup();
        let within = |node: usize| used.partition_point(|other| *other < node);
        let sizes: Vec<usize> = used.iter().map(|node| self.sizes[*node]).collect();
        // Moments follow the normal impulse of their contact, which may be another group.
        let moments: Vec<_> = groups
            .iter()
            .enumerate()
            .filter_map(|(moment, &group)| {
                let problem::Law::Moment { contact, .. } = problem.laws()[group] else {
                    return None;
                };
                Some(MomentPlace {
                    moment,
                    contact: groups.partition_point(|other| *other < contact),
                })
            })
            .collect();
        // Blocks of the matrix (N12): each group couples the nodes it pushes with those it sees.
        let of_moments = moments.iter().map(|at| (groups[at.moment], groups[at.contact]));
        let couples = groups.iter().map(|&group| (group, group)).chain(of_moments);
        let pairs = couples.flat_map(|(row, column)| {
            self.pushes[row].iter().flat_map(move |(row, _)| {
                self.sees[column].iter().map(move |(column, _)| (within(*row), within(*column)))
            })
        });
        let plan = SymbolicFactorisation::new(&sizes, pairs.filter(|(row, column)| row != column));
        // Unknowns in units of the part's speed and impulse
        let (speed, impulse) = self.units(problem, &groups, responses);
        let mut free = vec![0.0; plan.size()];
        for (at, &node) in used.iter().enumerate() {
            let place = plan.place(at);
            let own = free[place..].iter_mut().zip(&self.free[node]);
            own.for_each(|(to, value)| *to = value / speed);
        }
        let (mut pushes, mut sees) = (Links::default(), Links::default());
        let mut setting = StepSetting::new(Tolerances::for_problem(residual / speed));
        let mut scaled = Vec::new();
        // Maps and laws of the groups in these units.
        for &group in &groups {
            for (node, by) in &self.pushes[group] {
                scaled.clear();
                scaled.extend(by.iter().map(|value| value * (impulse / speed)));
                pushes.add(plan.place(within(*node)), self.sizes[*node], &scaled);
            }
            for (node, by) in &self.sees[group] {
                sees.add(plan.place(within(*node)), self.sizes[*node], by);
            }
            pushes.end();
            sees.end();
            let own = &responses[problem.rows(group)];
            let offset = self.offsets[group] / speed;
            let law = &problem.laws()[group];
            let mut coupling = coupling(law, own, offset, impulse, speed, &mut setting.graphs);
            if let CouplingLaw::Moment(law) = &mut coupling.law {
                law.contact = groups.partition_point(|other| *other < law.contact);
            }
            setting.admit(coupling);
        }
        ProblemPart {
            equations: PosedEquations { setting, settings, plan, free, pushes, sees, moments },
            groups,
            speed,
            impulse,
        }
    }

    /// Units of speed and of impulse of a part.
    ///
    /// The speed is the largest one without impulses. The impulse makes the mean response of a row
    /// one.
    fn units(&self, problem: &ContactProblem, groups: &[usize], responses: &[f64]) -> (f64, f64) {
        let free = |group: &usize| {
            let mut motion = self.offsets[*group];
            for (node, by) in &self.sees[*group] {
                for (by, value) in by.chunks_exact(3).zip(&self.free[*node]) {
                    motion += Vector3::new(by[0], by[1], by[2]) * *value;
                }
            }
            motion.amax()
        };
        let fastest = groups.iter().map(free).fold(0.0, f64::max);
        let speed = if fastest > 0.0 { fastest } else { 1.0 };
        let rows = || groups.iter().flat_map(|group| problem.rows(*group));
        let mean = rows().map(|row| responses[row]).sum::<f64>() / rows().count().max(1) as f64;
        (speed, speed / mean)
    }
}

/// M⁻¹ restricted to velocity components that are uncoupled from all others.
struct OwnMass<'a> {
    global: &'a problem::Global,
    numbers: &'a [usize],
    moved: Vec<f64>,
    along: Vec<f64>,
    local_solution: Vec<f64>,
}

impl<'a> OwnMass<'a> {
    fn new(global: &'a problem::Global, numbers: &'a [usize]) -> Self {
        let moved = vec![0.0; global.mass.rows()];
        Self { global, numbers, moved, along: Vec::new(), local_solution: Vec::new() }
    }

    /// Computes M⁻¹ f.
    fn free(&mut self) -> Vec<f64> {
        let entries = self.numbers.iter().map(|&k| (k, self.global.momentum[k]));
        self.solve(&entries.collect::<Vec<_>>());
        self.local_solution.clone()
    }

    /// Column of H, and M⁻¹ of it.
    fn column(&mut self, column: usize) -> (&[f64], &[f64]) {
        let of = |k: &usize| self.global.directions.at(*k, column);
        self.along = self.numbers.iter().map(of).collect();
        let entries: Vec<(usize, f64)> =
            self.numbers.iter().copied().zip(self.along.iter().copied()).collect();
        self.solve(&entries);
        (&self.along, &self.local_solution)
    }

    fn solve(&mut self, entries: &[(usize, f64)]) {
        let Self { global, numbers, moved, local_solution, .. } = self;
        let touched = global.factors().solve_sparse(entries.iter().copied(), moved);
        local_solution.clear();
        local_solution.extend(numbers.iter().map(|&k| moved[k]));
        touched.iter().for_each(|&k| moved[k] = 0.0);
    }
}

/// Entries of some columns.
fn columns_of(matrix: &SparseMatrix, columns: Range<usize>) -> Vec<Vec<(usize, f64)>> {
    columns.map(|column| matrix.column(column).collect()).collect()
}

/// Converts a group to a coupling in the units of its part.
fn coupling(
    law: &problem::Law,
    responses: &[f64],
    offset: Vector3<f64>,
    impulse: f64,
    speed: f64,
    graphs: &mut Vec<Graph>,
) -> Coupling {
    let unit = impulse / speed;
    match law {
        problem::Law::Contact { friction, .. } => {
            // The first component is the normal one: the axes are (t₁, t₂, n).
            let frame = Matrix3::new(0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0);
            let response = problem::Law::response(responses);
            let (tangential, normal) = (response.tangential, response.normal);
            let rows = CouplingRows::from_contact(frame, tangential * unit, normal * unit);
            Coupling::from_rows(rows, offset, CouplingLaw::Cone(Cone { friction: *friction }))
        }
        problem::Law::Moment { contact, rolling, torsional } => {
            let across = 0.5 * (responses[0] + responses[1]);
            let response = Vector3::new(across, across, responses[2]) * unit;
            let rows = CouplingRows::from_joint(Matrix3::identity(), &response);
            let law = MomentLaw { contact: *contact, rolling: *rolling, torsional: *torsional };
            Coupling::from_rows(rows, offset, CouplingLaw::Moment(law))
        }
        problem::Law::Rows(rows) => {
            let graph = |k: usize| rows.get(k).map_or(Graph::free(), |row| row.graph(impulse));
            let axes = AxesLaw::new(graphs, true, |k| Some(graph(k)));
            let response =
                Vector3::from_fn(|k, _| responses.get(k).map_or(1.0, |response| response * unit));
            let rows = CouplingRows::from_joint(Matrix3::identity(), &response);
            Coupling::from_rows(rows, offset, CouplingLaw::Axes(axes))
        }
    }
}
