//! Derivatives of steps in which nothing moves, cached for the next step.

use super::StepDerivative;
#[cfg(feature = "save")]
use super::StepGradient;
#[cfg(feature = "save")]
use super::island::LinearIsland;
use crate::contact::Contact;
#[cfg(feature = "save")]
use crate::derivative::StateChange;
#[cfg(feature = "save")]
use crate::error::Error;
use crate::mechanics::Wrench;
use crate::step::{Step, StepSolution};
use crate::world::World;

/// Largest number of bodies for which derivatives of a step at rest are cached: at most five
/// megabytes.
pub(super) const FEW_BODIES: usize = 64;

/// Step in which nothing moved. The next step may be identical.
#[derive(Debug, Clone)]
pub(super) struct RestingStep {
    world: World,
    wrenches: Vec<Wrench>,
    contacts: Vec<Contact>,
    solution: StepSolution,
}

impl RestingStep {
    /// Records the step, if nothing moved in it.
    pub(super) fn from_step(
        step: &Step<'_>,
        contacts: &[Contact],
        solution: &StepSolution,
    ) -> Option<Box<Self>> {
        (solution.states == step.states).then(|| {
            Box::new(Self {
                world: step.world.clone(),
                wrenches: step.wrenches.to_vec(),
                contacts: contacts.to_vec(),
                solution: solution.clone(),
            })
        })
    }

    /// True if the step equals this one.
    fn is(&self, step: &Step<'_>, contacts: &[Contact], solution: &StepSolution) -> bool {
        let Self { world, wrenches, contacts: own, solution: found } = self;
        found.states == step.states
            && found == solution
            && wrenches == step.wrenches
            && own == contacts
            && world == step.world
    }
}

impl StepDerivative {
    /// True if this is the derivative of exactly this step and nothing moved in it.
    pub(crate) fn is_at_rest_in(
        &self,
        step: &Step<'_>,
        contacts: &[Contact],
        solution: &StepSolution,
    ) -> bool {
        self.rest.as_ref().is_some_and(|rest| rest.is(step, contacts, solution))
    }
}

#[cfg(feature = "save")]
impl StepDerivative {
    /// True if nothing moved in the differentiated step.
    pub(crate) fn is_at_rest(&self) -> bool {
        self.rest.is_some()
    }

    /// Computes the product of [`vjp`](Self::vjp) with states and wrenches, from a cached matrix
    /// of a step at rest. Returns false if the matrix does not pay off.
    ///
    /// # Errors
    /// A list whose length differs from the world's.
    pub(crate) fn pull_at_rest(
        &mut self,
        end: &[StateChange],
        gradient: &mut StepGradient,
    ) -> Result<bool, Error> {
        /// Number of products per body that cost as much as the whole matrix.
        const ENOUGH: usize = 4;
        let bodies = self.ends.len();
        self.pulls_at_rest += 1;
        let islands = &self.islands[..self.count];
        if bodies > FEW_BODIES
            || self.pulls_at_rest <= ENOUGH * bodies
            || !islands.iter().all(LinearIsland::moves_by_momentum)
        {
            return Ok(false);
        }
        // Columns of ∂X⁺/∂X by velocities, for all bodies
        if self.pulling.is_empty() {
            let mut found = Vec::new();
            let mut pulling = Vec::with_capacity(bodies);
            for body in 0..bodies {
                self.jacobian_wrt_state(body, &mut found)?;
                let slopes = found.iter().map(|end| end.fixed_rows::<6>(6).transpose());
                pulling.push(slopes.collect());
            }
            self.pulling = pulling;
        }
        let (by_velocity, _) = self.begin_vjp(end, gradient)?;
        // ∂ℓ/∂X = (∂V⁺/∂X)ᵀ ∂ℓ/∂V⁺
        let StepGradient { states, wrenches, .. } = gradient;
        for (state, columns) in states.iter_mut().zip(&self.pulling) {
            let mut sums = state.to_array();
            for (by, (linear, spin)) in columns.iter().zip(&by_velocity) {
                for (column, by_velocity) in by.data.0.iter().zip(linear.iter().chain(spin)) {
                    (0..12).for_each(|k| sums[k] += column[k] * by_velocity);
                }
            }
            *state = StateChange::from_array(&sums);
        }
        self.by_velocity = by_velocity;
        self.islands[..self.count].iter().for_each(|linear| linear.push_wrenches(states, wrenches));
        Ok(true)
    }
}

#[cfg(feature = "save")]
impl LinearIsland {
    /// True if the initial velocities act only as momenta, like wrenches: no contact bounces and no
    /// drive controls a rate.
    fn moves_by_momentum(&self) -> bool {
        let [point, _] = &self.points;
        let of_contacts = point.couplings.iter().map(|coupling| &coupling.slopes);
        let mut all = of_contacts.chain(point.joints.iter().map(|rows| &rows.slopes));
        all.all(|slopes| slopes.by_velocity.is_none())
    }

    /// Derivatives with respect to wrenches, from those with respect to velocities and spins.
    fn push_wrenches(&self, states: &[StateChange], wrenches: &mut [Wrench]) {
        for (&body, member) in self.bodies.iter().zip(self.island.members()) {
            let StateChange { velocity, spin, .. } = &states[body];
            wrenches[body] = member.wrench_vjp(velocity, spin);
        }
    }
}
