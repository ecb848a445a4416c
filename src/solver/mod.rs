//! What a solver of the contact step is: one trait, so that model, certificate, loop
//! and writers do not know which one runs. The crate has [`native`] and [`ipopt`].

pub mod ipopt;
pub mod native;

use crate::error::Error;
use crate::ipopt::ReturnStatus;
use crate::model::ContactModel;
use crate::plane::Plane;
use crate::state::{State, Wrench};
use crate::step_nlp::layout::{self, Layout};
use nalgebra::{SVector, Vector3};
use std::fmt;

/// One contact step to be solved. States and forces are in the ground's frame
/// ([`crate::plane`]), in which the ground is z = 0; torques and spins are the body's.
#[derive(Debug, Clone, Copy)]
pub struct Step<'a> {
    /// The constants.
    pub model: &'a ContactModel,
    /// X at step k.
    pub state: &'a State,
    /// External wrench during the step, without gravity: N and N m.
    pub wrench: &'a Wrench,
    /// X at step k+1 if nothing touched the ground.
    pub free: &'a State,
    /// The solution of the previous step, which is the tutorial's start.
    pub previous: &'a Decision,
}

/// A point of the step problem: (X⁺, f_x, f_y, f_z, s1, s2, λ), 13 + 6n numbers in the order
/// of [`Layout`]. In the ground's frame inside a step, in the world's in a
/// [`StepRecord`](crate::simulation::StepRecord).
#[derive(Debug, Clone, PartialEq)]
pub struct Decision {
    layout: Layout,
    values: Vec<f64>,
}

/// How a step ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum StepStatus {
    /// Nothing can touch the ground: the answer is free flight, no problem was solved.
    Free,
    /// The solver met its tolerance from its first start.
    Converged,
    /// The solver met its tolerance from a later start.
    Retried,
    /// Another solver's answer stands in.
    Fallback,
    /// No solver met its tolerance; the best point found is reported.
    Failed,
    /// The last row of a trajectory: a state without a step.
    End,
}

/// What a solver reports of a step, beside the point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepReport {
    /// How it ended.
    pub status: StepStatus,
    /// Iterations of the solver.
    pub iterations: u32,
    /// Ipopt's own word, where Ipopt ran.
    pub ipopt_status: Option<ReturnStatus>,
    /// The last rung of the Ipopt path that was tried, where there is one.
    pub rung: Option<ipopt::Rung>,
}

impl StepReport {
    /// The report of a step or row for which no program was solved.
    #[must_use]
    pub fn without_problem(status: StepStatus) -> Self {
        Self { status, iterations: 0, ipopt_status: None, rung: None }
    }
}

/// A solver of the contact step. Implementations own their scratch memory.
pub trait StepSolver {
    /// A step counts as solved only with a certificate of at most this, m/s, whatever the
    /// solver itself says; the simulation checks it.
    fn accepted_certificate(&self) -> f64;

    /// Solves `step` and writes the point found to `solution`, also where the report
    /// says that it failed. Every number in it is finite.
    ///
    /// `active` comes in as α, the contact points that may carry a force, and goes out as
    /// the α for which `solution` is a point of the step's nonlinear program.
    ///
    /// # Errors
    /// Only where the step could not be posed at all. Non-convergence is a status.
    fn solve(
        &mut self,
        step: &Step<'_>,
        active: &mut [bool],
        solution: &mut Decision,
    ) -> Result<StepReport, Error>;
}

impl Decision {
    /// The point `state` with all forces, slacks and multipliers zero.
    #[must_use]
    pub fn at_rest_in(state: &State, contacts: usize) -> Self {
        let mut decision = Self::zeros(contacts);
        decision.set_free_flight(state);
        decision
    }

    /// The zero vector.
    #[must_use]
    pub fn zeros(contacts: usize) -> Self {
        let layout = Layout::new(contacts);
        Self { layout, values: vec![0.0; layout.variables()] }
    }

    /// Makes this the same point as `other`.
    ///
    /// # Panics
    /// If `other` is of another number of contacts.
    pub fn copy_from(&mut self, other: &Self) {
        self.values.copy_from_slice(&other.values);
    }

    /// Makes this the point `state` with all forces, slacks and multipliers zero.
    pub fn set_free_flight(&mut self, state: &State) {
        self.values.fill(0.0);
        self.values[layout::STATE].copy_from_slice(state.to_vector().as_slice());
    }

    /// Offsets of the parts.
    #[must_use]
    pub fn layout(&self) -> Layout {
        self.layout
    }

    /// All numbers.
    #[must_use]
    pub fn as_slice(&self) -> &[f64] {
        &self.values
    }

    /// All numbers, to be overwritten.
    pub fn as_mut_slice(&mut self) -> &mut [f64] {
        &mut self.values
    }

    /// X⁺.
    #[must_use]
    pub fn state(&self) -> State {
        State::from_vector(&SVector::from_column_slice(&self.values[layout::STATE]))
    }

    /// f_i, N, ground on body; in the frame of the whole point.
    ///
    /// # Panics
    /// If there is no contact `i`.
    #[must_use]
    pub fn force(&self, i: usize) -> Vector3<f64> {
        let [fx, fy, fz, ..] = self.layout.contact_variables(i);
        Vector3::new(self.values[fx], self.values[fy], self.values[fz])
    }

    /// Turns a point in the ground's frame into one whose X⁺ and forces are in the world's.
    pub fn turn_to_world(&mut self, plane: &Plane) {
        if plane.is_level() {
            return;
        }
        let state = plane.state_to_world(&self.state());
        self.values[layout::STATE].copy_from_slice(state.to_vector().as_slice());
        for i in 0..self.layout.contacts() {
            let force = plane.vector_to_world(&self.force(i));
            for (place, component) in self.layout.contact_variables(i).into_iter().zip(&force) {
                self.values[place] = *component;
            }
        }
    }

    /// All forces, contact by contact.
    pub fn forces(&self) -> impl Iterator<Item = Vector3<f64>> + '_ {
        (0..self.layout.contacts()).map(|i| self.force(i))
    }
}

impl StepStatus {
    /// The word of the CSV column.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Free => "free",
            Self::Converged => "converged",
            Self::Retried => "retried",
            Self::Fallback => "fallback",
            Self::Failed => "failed",
            Self::End => "end",
        }
    }

    /// The status of a CSV word.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        [Self::Free, Self::Converged, Self::Retried, Self::Fallback, Self::Failed, Self::End]
            .into_iter()
            .find(|status| status.name() == name)
    }
}

impl fmt::Display for StepStatus {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
