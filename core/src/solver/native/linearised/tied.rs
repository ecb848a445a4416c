//! What joints and gears hold, linearised by the states at the start of the step.
//!
//! Their rows are closed forms of both states, without a solve. They are differentiated by differences of fourth
//! order, at fixed V⁺, pieces and impulses along the rows: to 1e-10 of themselves, because nothing in them is
//! rounded to more than 1e-15 and nothing bends within 1e-3.

use super::super::island::{Held, Island, Tie};
use crate::derivative::StateChange;
use crate::step::Step;
use crate::world::{Constant, World};
use nalgebra::{DMatrix, DVector, SVector, Vector6};

/// m, rad, m/s, rad/s: the error of fourth order is some 1e-13, that of rounding 1e-12 over h.
const BY: f64 = 2e-4;

/// A joint or a gear, linearised.
#[derive(Debug, Clone)]
pub(super) struct LinearTie {
    /// Bodies of the world, and their places in the island.
    bodies: Vec<usize>,
    members: Vec<usize>,
    /// The right-hand sides of the equations of motion, six a body, by the states, twelve a body, and by h.
    by_states: DMatrix<f64>,
    by_time_step: DVector<f64>,
}

/// A world with time steps of h + δ, h − δ, h + 2δ and h − 2δ, and δ, s.
#[derive(Debug, Clone)]
pub(super) struct Steps {
    worlds: [World; 4],
    by: f64,
}

impl Steps {
    /// Those of `world`; `None` where its time step has no room for it.
    pub(super) fn of(world: &World) -> Option<Self> {
        let (h, by) = (world.time_step(), 1e-3 * world.time_step());
        let with = |step: f64| world.with_constants(&[(Constant::TimeStep, &[step])]).ok();
        let worlds = [with(h + by)?, with(h - by)?, with(h + 2.0 * by)?, with(h - 2.0 * by)?];
        Some(Self { worlds, by })
    }
}

/// (8 (f(δ) − f(−δ)) − (f(2δ) − f(−2δ)))/12δ, one body after another, of these four values.
fn slope(values: &[Vec<Vector6<f64>>; 4], by: f64) -> impl Iterator<Item = Vector6<f64>> + '_ {
    let [near, before, far, far_before] = values;
    let each = near.iter().zip(before).zip(far.iter().zip(far_before));
    each.map(move |((a, b), (c, d))| ((a - b) * 8.0 - (c - d)) / (12.0 * by))
}

impl LinearTie {
    /// That of `tie`, in `memory` of another island; `places` are the places of the world's bodies in the island.
    pub(super) fn new(
        step: &Step<'_>,
        (tie, held): (&Tie, &Held),
        (places, steps): (&[usize], Option<&Steps>),
        memory: &mut Island,
    ) -> Self {
        let bodies = tie.bodies.len();
        let mut by_states = DMatrix::zeros(6 * bodies, StateChange::LEN * bodies);
        let mut states = step.states.to_vec();
        for (number, &body) in tie.bodies.iter().enumerate() {
            for k in 0..StateChange::LEN {
                let mut at = |by: f64| {
                    let mut change = [0.0; StateChange::LEN];
                    change[k] = by;
                    states[body] = StateChange::from_array(&change).applied(&step.states[body]);
                    memory.momentum(&Step { states: &states, ..*step }, tie, held)
                };
                let values = [at(BY), at(-BY), at(2.0 * BY), at(-2.0 * BY)];
                let column = StateChange::LEN * number + k;
                for (of, slope) in slope(&values, BY).enumerate() {
                    by_states.fixed_view_mut::<6, 1>(6 * of, column).copy_from(&slope);
                }
            }
            states[body] = step.states[body];
        }
        let mut by_time_step = DVector::zeros(6 * bodies);
        if let Some(Steps { worlds, by }) = steps {
            let values =
                worlds.each_ref().map(|world| memory.momentum(&Step { world, ..*step }, tie, held));
            for (of, slope) in slope(&values, *by).enumerate() {
                by_time_step.fixed_rows_mut::<6>(6 * of).copy_from(&slope);
            }
        }
        let members = tie.bodies.iter().map(|&body| places[body]).collect();
        Self { bodies: tie.bodies.clone(), members, by_states, by_time_step }
    }

    /// Adds to the right-hand sides what changes of states make.
    pub(super) fn push(&self, states: &[StateChange], rhs: &mut [Vector6<f64>]) {
        for (from, &body) in self.bodies.iter().enumerate() {
            let change = SVector::<f64, 12>::from(states[body].to_array());
            for (to, &member) in self.members.iter().enumerate() {
                rhs[member] += self.by_states.fixed_view::<6, 12>(6 * to, 12 * from) * change;
            }
        }
    }

    /// Adds what a change of h (s) makes.
    pub(super) fn push_time_step(&self, time_step: f64, rhs: &mut [Vector6<f64>]) {
        for (to, &member) in self.members.iter().enumerate() {
            rhs[member] += self.by_time_step.fixed_rows::<6>(6 * to) * time_step;
        }
    }

    /// The derivative by h, of those by the right-hand sides.
    pub(super) fn pull_time_step(&self, rhs: &[Vector6<f64>]) -> f64 {
        let members = self.members.iter().enumerate();
        members.map(|(to, &m)| self.by_time_step.fixed_rows::<6>(6 * to).dot(&rhs[m])).sum()
    }

    /// The transpose.
    pub(super) fn pull(&self, rhs: &[Vector6<f64>], states: &mut [StateChange]) {
        for (from, &body) in self.bodies.iter().enumerate() {
            for (to, &member) in self.members.iter().enumerate() {
                let slope = self.by_states.fixed_view::<6, 12>(6 * to, 12 * from);
                let by = slope.tr_mul(&rhs[member]);
                let numbers: [f64; StateChange::LEN] = by.into();
                states[body] = states[body].plus(1.0, &StateChange::from_array(&numbers));
            }
        }
    }
}
