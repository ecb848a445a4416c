//! Energy of a step: comparison with its columns, and gains that no step may have.

use super::{JudgedStep, RELATIVE_TOLERANCE, StepJudge};
use tumble_core::mechanics::State;
use tumble_core::simulation::unphysical::LARGEST_GAIN;
use tumble_core::simulation::{EnergyBalance, energy};
use tumble_scene::output::tables::TableStep;

/// Energy gain allowed for a substepped step besides [`LARGEST_GAIN`], relative to all energies. Its
/// parts rotate by angles that a single step does not have.
const ENERGY_MADE: f64 = 1e-6;

/// Uncertainty of the work of loads and drives in a substepped step, as a fraction. Forces and speeds
/// change from one shorter step to the next, and the rows have the mean forces.
const WORK_OF_MEANS: f64 = 0.1;

/// Difference of an energy from its column.
pub(super) const OTHER_ENERGY: &str = "its energy differs";

impl StepJudge {
    /// True if the energy terms equal their columns. The rounding error is relative to the largest
    /// term and to the energies whose difference is D.
    pub(super) fn has_its_works(&self, judged: &JudgedStep<'_>) -> bool {
        let found = self.balance(judged).terms();
        let JudgedStep { step, next, .. } = *judged;
        let ends = [&step.states[..], next].map(|states| self.energy_scale(states));
        let scale = found.iter().fold(ends[0] + ends[1], |scale, term| scale + term.abs());
        let mut pairs = found.iter().zip(&step.row.works);
        pairs.all(|(found, column)| (found - column).abs() <= RELATIVE_TOLERANCE * scale)
    }

    /// True if a step gains more energy than loads and drives supply.
    pub(super) fn makes_energy(&self, judged: &JudgedStep<'_>) -> bool {
        let EnergyBalance { loads, drives, .. } = self.balance(judged);
        let (states, next) = (&judged.step.states[..], judged.next);
        let [before, after] = [states, next].map(|states| energy::total(&self.world, states));
        let scale = self.energy_scale(states) + self.energy_scale(next);
        let kinetic = |states: &[State]| -> f64 {
            let bodies = self.world.bodies().iter().zip(states);
            bodies.map(|(body, state)| energy::kinetic(&self.world, body, state)).sum()
        };
        let allowed = LARGEST_GAIN * kinetic(states).max(kinetic(next)) + ENERGY_MADE * scale;
        // Constant forces do this work on any path.
        let ends = states.iter().zip(next).zip(&judged.wrenches);
        let along =
            ends.map(|((from, to), wrench)| wrench.force.dot(&(to.position - from.position)));
        let loads = loads.abs().max(along.sum::<f64>().abs());
        let supplied = (1.0 + WORK_OF_MEANS) * (loads + drives.abs());
        // NaN is not a small gain.
        let is_small = after - before <= supplied + allowed;
        !is_small
    }

    fn balance(&self, judged: &JudgedStep<'_>) -> EnergyBalance {
        EnergyBalance::new(&self.world, &judged.claim(), judged.loads.iter().copied())
    }

    pub(super) fn has_its_energy(&self, step: &TableStep) -> bool {
        let found = energy::total(&self.world, &step.states);
        (found - step.row.energy).abs() <= RELATIVE_TOLERANCE * self.energy_scale(&step.states)
    }

    /// Scale of the energy's rounding error: the sum of the absolute values of its terms.
    fn energy_scale(&self, states: &[State]) -> f64 {
        let (gravity, h) = (self.world.gravity(), self.world.time_step());
        let parts = self.world.bodies().iter().zip(states).map(|(body, state)| {
            let (velocity, position) = (&state.velocity, &state.position);
            let fallen = h * gravity.dot(velocity).abs() + gravity.dot(position).abs();
            let linear = velocity.norm_squared() + fallen;
            body.mass() * linear + energy::turning(&self.world, body, &state.spin)
        });
        parts.sum()
    }
}
