//! Energy check for islands with joints: the discrete equations have solutions that gain energy.
//!
//! Equation numbers refer to `docs/formulation.md` and `docs/joints.md`.

use super::{CouplingKind, CouplingLink, Island};
use crate::solver::native::equations::Velocity;
use crate::solver::native::settings::LARGE_GAIN;
use nalgebra::Vector3;

/// Contribution of a coupling to the energy balance.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Source {
    Contact,
    /// Joint whose drives do work along the flagged rows.
    Drives([bool; 3]),
    /// Joint to a frame with a prescribed motion in the world.
    Course,
}

impl Source {
    /// Source type of joint rows whose `active` axes can do work. `moves` is true for a prescribed
    /// motion.
    pub(super) fn new(active: [bool; 3], moves: bool) -> Self {
        if moves { Self::Course } else { Self::Drives(active) }
    }
}

impl Island {
    /// Relative energy gain of the island beyond the work of external forces, drives and surfaces.
    ///
    /// Uses (32) and (J6) with the mean of the velocities before and after, over the mass M.
    /// Returns 0 for a small gain. `points` are u of every coupling after the step.
    pub(super) fn made(
        &self,
        velocity: &Vec<Velocity>,
        impulses: &[Vector3<f64>],
        points: &[Vector3<f64>],
    ) -> f64 {
        let (mut gained, mut kinetic, mut least) = (0.0, 0.0, 0.0);
        // Kinetic energy less the work from outside (32). `share` is M/m.
        for (member, velocity) in self.members.iter().zip(velocity) {
            let [before, after] = [member.old(), velocity].map(|velocity| member.energy(velocity));
            let work = member.work_from_outside(velocity);
            gained += (after - before - work) / member.share;
            kinetic += before.max(after) / member.share;
            least += 0.5 * self.slow * self.slow / member.share;
        }
        // Work of the couplings
        let couplings = self.links.iter().zip(&self.setting.couplings).zip(impulses);
        for (index, ((link, coupling), impulse)) in couplings.enumerate() {
            gained -= match link.source {
                Source::Contact => {
                    let (normal, offset) = (coupling.rows.normal(), &coupling.offset);
                    // The law opposes friction to u_t + o. The work −p·o on the offset is no gain.
                    -impulse.dot(&(offset - normal * normal.dot(offset)))
                }
                Source::Drives([false, false, false]) => 0.0,
                Source::Drives(rows) => {
                    // Drives (J6): the motion since the coordinate that the velocities at k imply.
                    let u = points[index] - self.point_at(index, &self.back);
                    let (u, p) =
                        (coupling.rows.frame.tr_mul(&u), coupling.rows.frame.tr_mul(impulse));
                    let on = |u: &Vector3<f64>| -> f64 {
                        (0..3).filter(|k| rows[*k]).map(|k| 0.5 * u[k] * p[k]).sum()
                    };
                    match link.kind {
                        CouplingKind::Turn(turn) if self.turns[turn].is_curved() => {
                            let turn = &self.turns[turn];
                            let spins = |k: usize| velocity[k].spin - self.back[k].spin;
                            let other = link.b.as_ref().map(|other| spins(other.index));
                            on(&u).max(on(&turn.rates(&spins(link.a), other.as_ref())))
                        }
                        _ => on(&u),
                    }
                }
                Source::Course => {
                    // (J6b), and the part of the body once.
                    let member = &self.members[link.a];
                    let new = &velocity[link.a];
                    let work = self.rate(link, index, new).dot(impulse);
                    let whole = if link.pushes() { 1.0 / member.share } else { 0.0 };
                    let [before, after] =
                        [member.old(), new].map(|velocity| member.work_from_outside(velocity));
                    work + whole * (after - before - member.energy_of_change(new))
                }
            };
        }
        // A gain by chords instead of tangents at a start, ½ h² ω² of the energy, does not count.
        gained -= gained.min(self.bent * kinetic).max(0.0);
        if gained > LARGE_GAIN * kinetic + least { gained / (kinetic + least) } else { 0.0 }
    }

    /// Velocity of A's point at a coupling to the world, at the velocity `new` of A (m/s).
    fn rate(&self, link: &CouplingLink, index: usize, new: &Velocity) -> Vector3<f64> {
        let turned = self.setting.couplings[index].lever.torque_map.tr_mul(&new.spin);
        if link.pushes() { new.linear + turned } else { turned }
    }
}
