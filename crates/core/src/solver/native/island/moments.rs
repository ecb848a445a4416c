//! Moments of an island's contacts as couplings: rolling and torsional resistance.
//!
//! A moment is a coupling of the bodies of its contact. Its rows turn, u = ℓ (Ω_A − Ω_B + o), and its limits
//! follow the normal impulse γ of the contact. With w = ∂p̂/∂γ, a change of the contact's impulse p̂_c turns
//! the bodies further,
//!
//! ```text
//! δp̂ = D δu + w nᵀ δp̂_c                                                    (N17)
//! ```
//!
//! Equation numbers refer to `docs/native-solver.md`.

use super::{CouplingKind, CouplingLink, Island, IslandSlope, LinkedCoupling, Other, StiffSide};
use crate::contact::Contact;
use crate::mechanics::quaternion::rotation;
use crate::solver::native::coupling::Coupling;
use crate::solver::native::equations::{Elimination, MomentPlace, Velocity};
use crate::solver::native::islands::IslandView;
use crate::solver::native::law::{Factored, Gain, MomentLaw};
use crate::sparse::BlockSystem;
use crate::step::{Step, StepSolution};
use nalgebra::{Matrix6, Vector3, Vector6};

impl Island {
    /// Adds the moments of the contacts with turning friction, after all contacts of the island.
    pub(crate) fn admit_moments(&mut self, step: &Step<'_>, contacts: &[Contact], own: &[usize]) {
        if !step.world.has_turning_friction() {
            return;
        }
        for (at, &place) in own.iter().enumerate() {
            if contacts[place].turning_friction(step.world).acts() {
                self.admit_moment(step, &contacts[place], at);
            }
        }
    }

    /// Adds the moment of `contact`, whose coupling has the index `at`.
    fn admit_moment(&mut self, step: &Step<'_>, contact: &Contact, at: usize) {
        let length =
            contact.moment_scale(step.world, |body| rotation(&step.states[body].attitude)).length;
        let link = self.links[at];
        let torque_map = |index: usize| self.members[index].rotation.transpose() * length;
        let of_a = torque_map(link.a);
        let mut response = self.members[link.a].response(&(of_a * contact.frame), false);
        let b = link.b.map(|other| {
            let torque_map = torque_map(other.index);
            response += self.members[other.index].response(&(torque_map * contact.frame), false);
            Other { torque_map, arm: Vector3::zeros(), ..other }
        });
        // The same for both tangential rows, as the law is that of a disc.
        let tangential = 0.5 * (response[0] + response[1]);
        (response[0], response[1]) = (tangential, tangential);
        let turning = contact.turning_friction(step.world);
        let law = MomentLaw {
            contact: at,
            rolling: turning.rolling / length,
            torsional: turning.torsional / length,
        };
        self.moments.push(MomentPlace { moment: self.links.len(), contact: at });
        self.lengths.push(length);
        self.links.push(CouplingLink { kind: CouplingKind::Moment, b, ..link });
        self.setting.admit(Coupling::from_moment(contact.frame, of_a, &response, law));
        self.setting.carry(&(contact.turning_offset * length));
    }

    /// Impulses p̂ of the moments (m/s), from those of the contacts `places` (N m).
    pub(crate) fn moment_impulses<'a>(
        &'a self,
        moments: &'a [Vector3<f64>],
        places: &'a [usize],
    ) -> impl Iterator<Item = Vector3<f64>> + 'a {
        let to_impulse = self.time_step / self.mass;
        self.moments.iter().zip(&self.lengths).map(move |(at, length)| {
            let known = moments.get(places[at.contact]);
            known.copied().unwrap_or_default() * (to_impulse / length)
        })
    }

    /// Writes the moments of contacts (N m, world) from the impulses of all couplings, those of the last step if
    /// it `keeps` them.
    pub(crate) fn write_moments(
        &self,
        impulses: &[Vector3<f64>],
        keeps: bool,
        island: &IslandView<'_>,
        solution: &mut StepSolution,
    ) {
        let to_force = self.mass / self.time_step;
        for (at, length) in self.moments.iter().zip(&self.lengths) {
            let place = island.contacts[at.contact];
            let known = island.known.moments.get(place).filter(|_| keeps);
            let moment = impulses[at.moment] * (to_force * length);
            solution.moments[place] = known.copied().unwrap_or(moment);
        }
    }

    /// Moments with their ℓ (m).
    pub(crate) fn moments_with_lengths(&self) -> impl Iterator<Item = (MomentPlace, f64)> {
        self.moments.iter().copied().zip(self.lengths.iter().copied())
    }

    /// ℓ Ω of A and of B for the moment `index` (m/s, world).
    pub(crate) fn moment_turning(&self, index: usize, velocity: &[Velocity]) -> [Vector3<f64>; 2] {
        Self::turning(self.linked(index), velocity)
    }

    /// ℓ Ω of A and of B for a moment (m/s, world).
    pub(super) fn turning(
        LinkedCoupling { link, coupling }: LinkedCoupling<'_>,
        velocity: &[Velocity],
    ) -> [Vector3<f64>; 2] {
        let a = coupling.lever.torque_map.tr_mul(&velocity[link.a].spin);
        let of_b = |other: &Other| other.torque_map.tr_mul(&velocity[other.index].spin);
        [a, link.b.as_ref().map_or(Vector3::zeros(), of_b)]
    }

    /// Adds what the contact's impulse makes of the moment (N17) to the matrix: −H w nᵀ D_c ∂u_c/∂V.
    pub(super) fn add_load_gain(
        &self,
        at: &MomentPlace,
        eliminations: &[Elimination<IslandSlope>],
        blocks: &mut BlockSystem,
    ) {
        let Some((by_load, normal)) = self.by_load(at, eliminations) else { return };
        let Elimination { local_solution, slope } = &eliminations[at.contact];
        let (Some(gain), IslandSlope::Pair(slope)) = (local_solution.gain.matrix(), slope) else {
            return;
        };
        let row = gain.tr_mul(&normal);
        for (body, slope) in std::iter::once(&slope.a).chain(slope.b.as_ref()) {
            let pressed = slope.tr_mul(&row).transpose();
            for (row, share, torque_map) in self.sides(self.linked(at.moment)) {
                let mut block = Matrix6::zeros();
                let turned = torque_map * by_load * -share;
                block.fixed_rows_mut::<3>(3).copy_from(&(turned * pressed));
                blocks.add(&self.pattern, row, *body, &block);
            }
        }
    }

    /// Adds the same of the contact's offset to the right-hand side: H w nᵀ d_c.
    pub(super) fn add_load_offset(
        &self,
        at: &MomentPlace,
        eliminations: &[Elimination<IslandSlope>],
        values: &mut [Vector6<f64>],
    ) {
        let Some((by_load, normal)) = self.by_load(at, eliminations) else { return };
        let pressed = normal.dot(&eliminations[at.contact].local_solution.offset);
        self.add_offset(self.linked(at.moment), &(by_load * pressed), values);
    }

    /// Adds the same to the effects of the rows of a contact with the factored `gain` on A and B.
    pub(crate) fn add_load_effects(
        &self,
        contact: usize,
        gain: &Factored,
        eliminations: &[Elimination<IslandSlope>],
        rows: &mut [StiffSide],
    ) {
        for at in self.moments.iter().filter(|at| at.contact == contact) {
            let Some((by_load, normal)) = self.by_load(at, eliminations) else { continue };
            let pressed = gain.to.tr_mul(&normal).component_mul(&gain.gains).transpose();
            let sides = self.sides(self.linked(at.moment));
            for (side, (_, share, torque_map)) in rows.iter_mut().zip(sides) {
                let mut turned = side.effect.fixed_rows_mut::<3>(3);
                turned += torque_map * by_load * share * pressed;
            }
        }
    }

    /// w of a moment, and n of its contact. `None` if the moment does not follow the contact.
    fn by_load(
        &self,
        at: &MomentPlace,
        eliminations: &[Elimination<IslandSlope>],
    ) -> Option<(Vector3<f64>, Vector3<f64>)> {
        let Gain::Moment(gain) = &eliminations[at.moment].local_solution.gain else { return None };
        Some((gain.by_load, self.setting.couplings[at.contact].rows.normal()))
    }
}
