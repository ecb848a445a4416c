//! Second-order cone problems of a structure, solved by Clarabel.
//!
//! With x the components of all forces, the problem is (S1) or, with a factor λ on a load case w₁,
//!
//! ```text
//! min ½ ‖x‖²   or   max λ,   A x + w + λ w₁ = 0,   x ∈ K                     (S3)
//! ```
//!
//! Its multipliers of the balance are the velocities y of (S2). Forces are in units of the largest
//! load, and torques are divided by the reach of their body.

use super::certificate::{ForceState, Mechanism};
use super::loads::{LoadCase, Twist};
use super::structure::{ContactRow, Structure};
use clarabel::algebra::CscMatrix;
use clarabel::solver::{
    DefaultSettings, DefaultSolver, IPSolver, NonnegativeConeT, SecondOrderConeT, SupportedConeT,
    ZeroConeT,
};
use nalgebra::Vector3;
use std::ops::Range;
use tumble_core::contact::ContactLoad;

/// Tolerance of Clarabel, relative to the scaled problem.
const TOLERANCE: f64 = 1e-11;

/// Result of a cone problem. Which parts of it are certificates is checked by the caller.
pub(super) struct ConicResult {
    /// Forces, moved into their cones.
    pub forces: ForceState,
    /// Factor λ of the load case.
    pub factor: f64,
    /// Velocities: multipliers of the balance.
    pub mechanism: Mechanism,
}

/// Objective of a cone problem.
pub(super) enum Goal<'a> {
    /// Forces of least norm.
    LeastForces,
    /// Forces with the least imbalance: for loads near the limit, where forces or velocities of the
    /// problem above grow without bound.
    LeastImbalance,
    /// Largest factor on these loads.
    LargestFactor(&'a LoadCase),
}

/// Constraint on the components of forces.
enum Cone {
    /// Bounds of a component.
    Bounds { column: usize, low: f64, high: f64 },
    /// ‖x‖ ≤ `limit` x_n of these components.
    Disc { normal: usize, limit: f64, columns: Range<usize> },
}

/// Components of the forces: their wrenches per unit, and their cones.
#[derive(Default)]
struct Components {
    wrenches: Vec<Vec<(usize, Twist)>>,
    cones: Vec<Cone>,
    /// First component of each contact.
    firsts: Vec<usize>,
}

impl Components {
    fn new(structure: &Structure) -> Self {
        let mut all = Self::default();
        for contact in &structure.contacts {
            let normal = all.wrenches.len();
            all.firsts.push(normal);
            let force = |direction: &Vector3<f64>| structure.contact_wrenches(contact, direction);
            if let Some(dragged) = contact.dragged {
                let direction = contact.normal + dragged * contact.friction;
                all.wrenches.push(force(&direction));
            } else {
                all.wrenches.push(force(&contact.normal));
                let tangents = contact.tangents.iter().zip(contact.scales());
                all.add_disc(
                    normal,
                    contact.friction,
                    tangents.map(|(tangent, scale)| force(&(tangent * scale))),
                );
            }
            let moment = |axis: &Vector3<f64>| structure.moment_wrenches(contact, axis);
            let [rolling, torsional] = contact.turning;
            all.add_disc(normal, rolling, contact.tangents.iter().map(moment));
            all.add_disc(normal, torsional, [moment(&contact.normal)].into_iter());
            all.cones.push(Cone::Bounds { column: normal, low: 0.0, high: f64::INFINITY });
        }
        for axis in &structure.axes {
            let [low, high] = axis.range;
            all.cones.push(Cone::Bounds { column: all.wrenches.len(), low, high });
            all.wrenches.push(axis.on.clone());
        }
        all
    }

    /// Adds components within a disc; none if the limit is zero.
    fn add_disc(
        &mut self,
        normal: usize,
        limit: f64,
        wrenches: impl Iterator<Item = Vec<(usize, Twist)>>,
    ) {
        if limit > 0.0 {
            let first = self.wrenches.len();
            self.wrenches.extend(wrenches);
            self.cones.push(Cone::Disc { normal, limit, columns: first..self.wrenches.len() });
        }
    }

    /// Forces of the components `x` (N), moved into their cones.
    fn forces(&self, structure: &Structure, x: &[f64]) -> ForceState {
        let mut x = x.to_vec();
        for cone in &self.cones {
            if let Cone::Bounds { column, low, high } = cone {
                x[*column] = x[*column].clamp(*low, *high);
            }
        }
        for cone in &self.cones {
            if let Cone::Disc { normal, limit, columns } = cone {
                let size = x[columns.clone()].iter().map(|x| x * x).sum::<f64>().sqrt();
                let most = limit * x[*normal];
                if size > most {
                    x[columns.clone()].iter_mut().for_each(|x| *x *= most / size);
                }
            }
        }
        let loads = structure.contacts.iter().zip(&self.firsts);
        let contacts = loads.map(|(contact, &first)| load_of(contact, &x[first..])).collect();
        let axes = x[x.len() - structure.axes.len()..].to_vec();
        ForceState { contacts, axes }
    }
}

/// Force and moment of a contact, from its components in their order.
fn load_of(contact: &ContactRow, x: &[f64]) -> ContactLoad {
    let mut rest = x[1..].iter();
    let mut sum = |axes: &[Vector3<f64>]| {
        axes.iter().zip(&mut rest).fold(Vector3::zeros(), |sum, (axis, x)| sum + axis * *x)
    };
    let mut force = contact.normal * x[0];
    if let Some(dragged) = contact.dragged {
        force += dragged * (contact.friction * x[0]);
    } else if contact.friction > 0.0 {
        let [one, two] = contact.scales();
        force += sum(&[contact.tangents[0] * one, contact.tangents[1] * two]);
    }
    let mut moment = Vector3::zeros();
    if contact.turning[0] > 0.0 {
        moment += sum(&contact.tangents);
    }
    if contact.turning[1] > 0.0 {
        moment += sum(&[contact.normal]);
    }
    ContactLoad { force, moment }
}

impl Structure {
    /// Wrenches on both bodies by a unit force of a contact along `direction`.
    pub(super) fn contact_wrenches(
        &self,
        contact: &ContactRow,
        direction: &Vector3<f64>,
    ) -> Vec<(usize, Twist)> {
        let sides = contact.key.bodies().zip([1.0, -1.0]);
        let wrench = |(body, sign): (usize, f64)| {
            let arm = contact.point - self.centres[body];
            (body, Twist::at(&arm, &(direction * sign)))
        };
        sides.map(wrench).collect()
    }

    /// Wrenches on both bodies by a unit moment of a contact about `axis`.
    fn moment_wrenches(&self, contact: &ContactRow, axis: &Vector3<f64>) -> Vec<(usize, Twist)> {
        let sides = contact.key.bodies().zip([1.0, -1.0]);
        let wrench = |(body, sign): (usize, f64)| {
            (body, Twist { linear: Vector3::zeros(), angular: axis * sign })
        };
        sides.map(wrench).collect()
    }

    /// Solves the cone problem (S3) with the loads `loads`. `None` if Clarabel refuses it.
    pub(super) fn solve(&self, loads: &LoadCase, goal: &Goal<'_>) -> Option<ConicResult> {
        let components = Components::new(self);
        let count = components.wrenches.len();
        let case = match goal {
            Goal::LeastForces | Goal::LeastImbalance => None,
            Goal::LargestFactor(case) => Some(*case),
        };
        let positive = |size: f64, other: f64| if size > 0.0 { size } else { other };
        // Loads and forces are divided by the size of the loads, so that tolerances are relative.
        let case_unit = case.map_or(1.0, |case| positive(self.size(case), 1.0));
        let unit = positive(self.size(loads), case_unit);

        // Six rows of balance for each free body, from its first row on.
        let mut rows = 0;
        let firsts: Vec<Option<usize>> = self
            .held
            .iter()
            .map(|held| {
                let first = (!held).then_some(rows);
                rows += if *held { 0 } else { 6 };
                first
            })
            .collect();
        if rows == 0 {
            // All bodies are held; Clarabel needs a row.
            let forces = components.forces(self, &vec![0.0; count]);
            let velocities = vec![Twist::ZERO; self.held.len()];
            return Some(ConicResult { forces, factor: 0.0, mechanism: Mechanism { velocities } });
        }
        let scaled = |body: usize, twist: &Twist| {
            let first = firsts[body]?;
            let angular = twist.angular / self.reaches[body];
            let entries = twist.linear.iter().chain(angular.iter()).copied().collect::<Vec<_>>();
            Some((first, entries))
        };
        // A column for each component of a force, and one for the factor.
        let mut columns: Vec<Vec<(usize, f64)>> = Vec::with_capacity(count + 1);
        let add = |column: &mut Vec<(usize, f64)>, body: usize, twist: &Twist, unit: f64| {
            if let Some((first, entries)) = scaled(body, twist) {
                let entries = entries.into_iter().enumerate().filter(|(_, x)| *x != 0.0);
                column.extend(entries.map(|(k, x)| (first + k, x / unit)));
            }
        };
        for wrenches in &components.wrenches {
            let mut column = Vec::new();
            for (body, twist) in wrenches {
                add(&mut column, *body, twist, 1.0);
            }
            columns.push(column);
        }
        if let Some(case) = case {
            let mut column = Vec::new();
            for (body, twist) in case.wrenches.iter().enumerate() {
                add(&mut column, body, twist, case_unit);
            }
            columns.push(column);
        }
        // Right-hand side: minus the loads
        let mut right = vec![0.0; rows];
        for (body, twist) in loads.wrenches.iter().enumerate() {
            if let Some((first, entries)) = scaled(body, twist) {
                for (k, x) in entries.into_iter().enumerate() {
                    right[first + k] = -x / unit;
                }
            }
        }
        let mut cones = vec![ZeroConeT(rows)];
        let mut row = rows;
        components.add_cones(unit, &mut row, &mut columns, &mut right, &mut cones);
        if matches!(goal, Goal::LeastImbalance) {
            // A x + w + r = 0 with ‖r‖ ≤ t.
            columns.extend((0..rows).map(|k| vec![(k, 1.0), (row + 1 + k, -1.0)]));
            columns.push(vec![(row, -1.0)]);
            right.extend(std::iter::repeat_n(0.0, rows + 1));
            cones.push(SecondOrderConeT(rows + 1));
            row += rows + 1;
        }
        let variables = columns.len();
        let matrix = compressed(row, &mut columns);
        let mut linear = vec![0.0; variables];
        match goal {
            Goal::LeastForces => {}
            Goal::LeastImbalance => linear[variables - 1] = 1.0,
            Goal::LargestFactor(_) => linear[count] = -1.0,
        }
        let quadratic = match goal {
            Goal::LeastForces => CscMatrix::identity(variables),
            _ => CscMatrix::zeros((variables, variables)),
        };
        let settings = DefaultSettings {
            verbose: false,
            max_threads: 1,
            tol_gap_abs: TOLERANCE,
            tol_gap_rel: TOLERANCE,
            tol_feas: TOLERANCE,
            tol_infeas_abs: TOLERANCE,
            tol_infeas_rel: TOLERANCE,
            ..DefaultSettings::default()
        };
        let mut solver =
            DefaultSolver::new(&quadratic, &linear, &matrix, &right, &cones, settings).ok()?;
        solver.solve();
        // Forces are the solution, and velocities of a mechanism its multipliers of the balance.
        let x = &solver.solution.x;
        let z = &solver.solution.z;
        let forces: Vec<f64> = x[..count].iter().map(|x| x * unit).collect();
        let factor = case.map_or(0.0, |_| x[count] * unit / case_unit);
        let velocity = |(first, reach): (&Option<usize>, &f64)| {
            first.map_or(Twist::ZERO, |first| Twist {
                linear: Vector3::from_column_slice(&z[first..first + 3]),
                angular: Vector3::from_column_slice(&z[first + 3..first + 6]) / *reach,
            })
        };
        let velocities = firsts.iter().zip(&self.reaches).map(velocity).collect();
        Some(ConicResult {
            forces: components.forces(self, &forces),
            factor,
            mechanism: Mechanism { velocities },
        })
    }
}

impl Components {
    /// Adds the rows of the cones from `row` on. Bounds of forces are in N; the rows have the `unit`.
    fn add_cones(
        &self,
        unit: f64,
        row: &mut usize,
        columns: &mut [Vec<(usize, f64)>],
        right: &mut Vec<f64>,
        cones: &mut Vec<SupportedConeT<f64>>,
    ) {
        let first = *row;
        for cone in &self.cones {
            if let Cone::Bounds { column, low, high } = cone {
                for (bound, sign) in [(low, -1.0), (high, 1.0)] {
                    if bound.is_finite() {
                        columns[*column].push((*row, sign));
                        right.push(sign * bound / unit);
                        *row += 1;
                    }
                }
            }
        }
        cones.push(NonnegativeConeT(*row - first));
        for cone in &self.cones {
            if let Cone::Disc { normal, limit, columns: across } = cone {
                columns[*normal].push((*row, -limit));
                for (k, column) in across.clone().enumerate() {
                    columns[column].push((*row + 1 + k, -1.0));
                }
                right.extend(std::iter::repeat_n(0.0, 1 + across.len()));
                *row += 1 + across.len();
                cones.push(SecondOrderConeT(1 + across.len()));
            }
        }
    }
}

fn compressed(rows: usize, columns: &mut [Vec<(usize, f64)>]) -> CscMatrix<f64> {
    let mut starts = vec![0];
    let mut places = Vec::new();
    let mut values = Vec::new();
    for column in columns.iter_mut() {
        column.sort_unstable_by_key(|(row, _)| *row);
        // A gear may act on a body through both of its joints.
        column.dedup_by(|next, kept| {
            let is_same = next.0 == kept.0;
            kept.1 += if is_same { next.1 } else { 0.0 };
            is_same
        });
        places.extend(column.iter().map(|(row, _)| *row));
        values.extend(column.iter().map(|(_, value)| *value));
        starts.push(places.len());
    }
    CscMatrix::new(rows, columns.len(), starts, places, values)
}
