//! Energy of a step: comparison with its columns, and gains that no step may have.

use super::{JudgedStep, RELATIVE_TOLERANCE, StepJudge};
use tumble_core::mechanics::State;
use tumble_core::simulation::unphysical::LARGEST_GAIN;
use tumble_core::simulation::{EnergyBalance, energy};
use tumble_core::world::Impacts;
use tumble_scene::output::tables::IntervalRows;

/// Energy gain allowed for a substepped step besides [`LARGEST_GAIN`], relative to all energies. Its
/// intervals rotate by angles that a single one does not have.
const ENERGY_MADE: f64 = 1e-6;

/// Energy of a substepped step up to its present interval (J).
#[derive(Debug, Clone, Copy)]
pub(super) struct RetryEnergy {
    /// Energy at the start of the step.
    start: f64,
    /// Work of loads and drives, at most.
    supplied: f64,
    /// Largest kinetic energy, and scale of rounding.
    kinetic: f64,
    scale: f64,
}

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

    /// True if a substepped step ends here with more energy than loads and drives supply in all of its
    /// intervals. The energy at its end is that of the next row, so that the step must have one.
    pub(super) fn makes_energy(&mut self, judged: &JudgedStep<'_>) -> bool {
        let JudgedStep { step, next, following, wrenches, .. } = judged;
        let row = &step.row;
        if !self.world.span().is_some_and(|span| span.is_retry) {
            self.retry_energy = None;
            return false;
        }
        let EnergyBalance { loads, drives, .. } = self.balance(judged);
        let first = RetryEnergy { start: row.energy, supplied: 0.0, kinetic: 0.0, scale: 0.0 };
        let mut sum = self.retry_energy.filter(|_| row.interval > 0).unwrap_or(first);
        // Constant forces do this work on any path.
        let ends = step.states.iter().zip(*next).zip(wrenches);
        let along: f64 =
            ends.map(|((from, to), wrench)| wrench.force.dot(&(to.position - from.position))).sum();
        sum.supplied += loads.abs().max(along.abs()) + drives.abs();
        for states in [&step.states[..], *next] {
            let bodies = self.world.bodies().iter().zip(states);
            let kinetic: f64 =
                bodies.map(|(body, state)| energy::kinetic(&self.world, body, state)).sum();
            sum.kinetic = sum.kinetic.max(kinetic);
            sum.scale = sum.scale.max(2.0 * self.energy_scale(states));
        }
        self.retry_energy = Some(sum);
        let is_last = following.interval == 0 && following.index == row.index + 1;
        let allowed = LARGEST_GAIN * sum.kinetic + ENERGY_MADE * sum.scale;
        // NaN is not a small gain.
        let is_small = following.energy - sum.start <= sum.supplied + allowed;
        is_last && !is_small
    }

    /// Terms of the balance (36). Where the rows count another energy than (35) with the length of the
    /// interval, the discretisation term has the difference.
    fn balance(&self, judged: &JudgedStep<'_>) -> EnergyBalance {
        let mut balance =
            EnergyBalance::new(&self.world, &judged.claim(), judged.loads.iter().copied());
        let JudgedStep { step, next, following, .. } = judged;
        balance.discretisation -= step.row.energy - energy::total(&self.world, &step.states);
        let is_retry = self.world.span().is_some_and(|span| span.is_retry);
        let is_converted = is_retry && following.interval == 0 && !self.world.has_half_kicks();
        let is_located = self.world.impacts() == Impacts::Located;
        if is_located || is_converted || judged.next_starts {
            balance.discretisation += following.energy - energy::total(&self.world, next);
        }
        balance
    }

    /// True if the energy equals its column: (35) at the start of the interval. With located impacts it is
    /// that of the instant. Without half kicks, the first of the shorter intervals of a step counts the end of
    /// the interval before.
    pub(super) fn has_its_energy(&self, step: &IntervalRows) -> bool {
        let world = &self.world;
        let is_retry = world.span().is_some_and(|span| span.is_retry);
        let is_converted = is_retry && step.row.interval == 0 && !world.has_half_kicks();
        let found = if world.impacts() == Impacts::Located {
            energy::at_instant(world, step.instant_states())
        } else if !is_converted {
            energy::at_start(world, &step.states)
        } else if let Some(states) = &self.last_end {
            let mut whole = world.clone();
            whole.set_span(None);
            energy::total(&whole, states)
        } else {
            // The first row, or a row after another step of this kind.
            return true;
        };
        (found - step.row.energy).abs() <= RELATIVE_TOLERANCE * self.energy_scale(&step.states)
    }

    /// Scale of the energy's rounding error: the sum of the absolute values of its terms.
    fn energy_scale(&self, states: &[State]) -> f64 {
        let (gravity, h) = (self.world.gravity(), self.world.time_step());
        // Speed of which the relative tolerance is the error of rounded numbers.
        let rounded = self.rounding() / RELATIVE_TOLERANCE;
        let parts = self.world.bodies().iter().zip(states).map(|(body, state)| {
            let (velocity, position) = (&state.velocity, &state.position);
            let fallen = h * gravity.dot(velocity).abs() + gravity.dot(position).abs();
            let speed = velocity.norm() + body.reach() * state.spin.norm() + h * gravity.norm();
            let linear = velocity.norm_squared() + fallen + rounded * (speed + self.rounding());
            body.mass() * linear + energy::turning(&self.world, body, &state.spin)
        });
        parts.sum()
    }
}
