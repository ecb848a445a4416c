//! Motion of an island's bodies and of its coupling rows.
//!
//! Equation numbers refer to `docs/native-solver.md`.

use super::{CouplingKind, CouplingLink, Island, LinkedCoupling, Other};
use crate::solver::native::body_equation::BodyEquation;
use crate::solver::native::ellipsoid_motion::EllipsoidMotion;
use crate::solver::native::equations::{Equations, Velocity};
use crate::solver::native::fixed_motion::point_velocity;
use crate::solver::native::pair_motion::{PairMotion, PairSide};
use crate::solver::native::round_motion::{RoundMotion, RoundSide};
use crate::solver::native::turning::BodyTurning;
use nalgebra::{Matrix3, Vector3};

impl Island {
    /// Residuals of the equations of motion (N1) of all bodies: linear (m/s) and angular (m²/s),
    /// per unit of the body's mass.
    pub(super) fn motion(
        &self,
        velocity: &[Velocity],
        impulses: &[Vector3<f64>],
        residuals: &mut Vec<Velocity>,
    ) {
        residuals.clear();
        let bodies = self.members.iter().zip(velocity);
        // r_v = v⁺ − v_free and r_ω = Î(ω⁺ − ω) + h Ĝ − h τ/m, without impulses
        residuals.extend(bodies.map(|(member, velocity)| {
            let mut turned = member.turned(&velocity.spin);
            if let Some(gyroscopic) = member.gyroscopic(&velocity.spin) {
                turned += gyroscopic;
            }
            Velocity {
                linear: velocity.linear - member.free.linear,
                spin: turned - member.torque_impulse,
            }
        }));
        // − Σ p̂ and − Σ G p̂, over the mass of each body. B has the opposite impulse.
        let couplings = self.links.iter().zip(&self.setting.couplings);
        for ((link, coupling), impulse) in couplings.zip(impulses) {
            if let CouplingKind::Gear(gear) = link.kind {
                for (body, wrench) in self.gears[gear].sides() {
                    residuals[body].linear -= wrench.fixed_rows::<3>(0) * impulse[0];
                    residuals[body].spin -= wrench.fixed_rows::<3>(3) * impulse[0];
                }
                continue;
            }
            let share = self.members[link.a].share;
            if link.pushes() {
                residuals[link.a].linear -= share * impulse;
            }
            residuals[link.a].spin -= share * (coupling.lever.torque_map * impulse);
            if let Some(other) = &link.b {
                let share = self.members[other.index].share;
                if link.pushes() {
                    residuals[other.index].linear += share * impulse;
                }
                residuals[other.index].spin += share * (other.torque_map * impulse);
            }
        }
    }

    /// Sets the velocities that result from the impulses.
    ///
    /// The gyroscopic term is of second order in h, one or two digits better than in
    /// [`set_velocity_after`](Equations::set_velocity_after), which takes it from free flight.
    pub(super) fn set_velocity_under(
        &self,
        impulses: &[Vector3<f64>],
        velocity: &mut Vec<Velocity>,
    ) {
        self.set_velocity_after(impulses, velocity);
        for (member, velocity) in self.members.iter().zip(velocity) {
            let now = member.gyroscopic(&velocity.spin);
            if let Some((now, free)) = now.zip(member.gyroscopic(&member.free.spin)) {
                velocity.spin -= member.inertia_inverse * (now - free);
            }
        }
    }

    /// Replaces velocities that are far from the extrapolation of the last two steps.
    ///
    /// The distance is relative to the length of the extrapolation. Impulses of light bodies turn
    /// with their velocities. The list is cleared if the velocity `before` of a body is missing.
    pub(super) fn follow(
        &self,
        before: impl Iterator<Item = Velocity> + Clone,
        velocity: &mut Vec<Velocity>,
    ) {
        let led = self.members.iter().zip(before).map(|(member, before)| {
            let now = member.old();
            let linear = 2.0 * now.linear - before.linear;
            (member, Velocity { linear, spin: 2.0 * now.spin - before.spin })
        });
        let (mut way, mut apart, mut count) = (0.0_f64, 0.0_f64, 0);
        for ((member, led), velocity) in led.clone().zip(&*velocity) {
            way = way.max(member.distance(member.old(), &led));
            apart = apart.max(member.distance(velocity, &led));
            count += 1;
        }
        // False for NaN.
        let is_near = apart <= way;
        if count < self.members.len() {
            velocity.clear();
        } else if !is_near {
            velocity.clear();
            velocity.extend(led.map(|(_, led)| led));
        }
    }

    /// Computes the rotations of all bodies.
    pub(super) fn set_turnings(&self, velocity: &[Velocity], turnings: &mut Vec<Both>) {
        turnings.resize(self.members.len(), Both::STILL);
        for ((member, velocity), both) in self.members.iter().zip(velocity).zip(turnings) {
            member.set_turnings(&velocity.spin, &mut both.there, &mut both.back);
        }
    }

    /// Motion of a coupling of A with a plane of the body `other`. Their rotations are `a` and `b`.
    pub(super) fn pair_motion<'a>(
        &'a self,
        linked: LinkedCoupling<'a>,
        other: &Other,
        velocity: &[Velocity],
        a: &'a Both,
        b: &'a Both,
    ) -> PairMotion<'a> {
        let LinkedCoupling { link, coupling } = linked;
        let apart = velocity[link.a].linear - velocity[other.index].linear;
        let a = PairSide { rotation: &self.members[link.a].rotation, turning: &a.there };
        let b = PairSide { rotation: &self.members[other.index].rotation, turning: &b.back };
        PairMotion::new(coupling, &other.arm, &apart, a, b, self.time_step)
    }

    /// Motion of a coupling of two round features, with index `round` among these.
    pub(super) fn round_motion<'a>(
        &'a self,
        linked: LinkedCoupling<'a>,
        round: usize,
        velocity: &'a [Velocity],
        turnings: LinkTurnings<'a>,
    ) -> RoundMotion<'a> {
        let (a, b) = self.sides_of(linked.link, velocity, turnings);
        RoundMotion::new(linked.coupling, &self.rounds[round], a, b, self.time_step)
    }

    /// Motion of a coupling of an ellipsoid and a plane, with index `one` among these.
    pub(super) fn ellipsoid_motion<'a>(
        &'a self,
        linked: LinkedCoupling<'a>,
        one: usize,
        velocity: &'a [Velocity],
        turnings: LinkTurnings<'a>,
    ) -> EllipsoidMotion<'a> {
        let (a, b) = self.sides_of(linked.link, velocity, turnings);
        EllipsoidMotion::new(linked.coupling, &self.ellipsoids[one], a, b, self.time_step)
    }

    /// The two bodies of a coupling of curved features.
    fn sides_of<'a>(
        &'a self,
        link: &CouplingLink,
        velocity: &'a [Velocity],
        turnings: LinkTurnings<'a>,
    ) -> (RoundSide<'a>, Option<RoundSide<'a>>) {
        let LinkTurnings { a, b } = turnings;
        let side = |index: usize, turnings: &'a Both| RoundSide {
            rotation: &self.members[index].rotation,
            turning: &turnings.there,
            linear: &velocity[index].linear,
        };
        let of_b = link.b.as_ref().zip(b).map(|(other, b)| side(other.index, b));
        (side(link.a, a), of_b)
    }

    /// u of coupling `index` (N2).
    pub(super) fn point_at(&self, index: usize, velocity: &[Velocity]) -> Vector3<f64> {
        let linked = self.linked(index);
        let LinkedCoupling { link, coupling } = linked;
        if let Some(u) = self.turned_velocity(linked, velocity) {
            return u;
        }
        if link.kind == CouplingKind::Point && !coupling.is_contact() {
            return self.anchor_velocity(linked, velocity);
        }
        let turnings = |body: usize| Both::new(&self.members[body], &velocity[body]);
        let a = turnings(link.a);
        let b = link.b.as_ref().map(|other| turnings(other.index));
        self.point_velocity(linked, velocity, LinkTurnings { a: &a, b: b.as_ref() })
    }

    /// u of a joint's anchor, (N10) for one point.
    fn anchor_velocity(&self, linked: LinkedCoupling<'_>, velocity: &[Velocity]) -> Vector3<f64> {
        let LinkedCoupling { link, coupling } = linked;
        let swept = |index: usize, spin: &Vector3<f64>, point: &Vector3<f64>| {
            let member = &self.members[index];
            BodyTurning::swept_once(&member.rotation, spin, &member.map(), point)
        };
        let of_a = &velocity[link.a];
        let moved = of_a.linear + swept(link.a, &of_a.spin, &coupling.lever.centre);
        let Some(other) = &link.b else { return moved + coupling.offset };
        let of_b = &velocity[other.index];
        let relative = moved - of_b.linear;
        let arm = other.arm + relative * self.time_step;
        let local = self.members[other.index].rotation.tr_mul(&arm);
        relative + swept(other.index, &-of_b.spin, &local) + coupling.offset
    }

    /// u of a joint's rotation or of a moment, ℓ (Ω_A − Ω_B + o). `None` for another coupling.
    pub(super) fn turned_velocity(
        &self,
        linked: LinkedCoupling<'_>,
        velocity: &[Velocity],
    ) -> Option<Vector3<f64>> {
        let link = linked.link;
        if link.kind == CouplingKind::Moment {
            let [a, b] = Self::turning(linked, velocity);
            return Some(a - b + linked.coupling.offset);
        }
        let CouplingKind::Turn(turn) = link.kind else { return None };
        let other = link.b.as_ref().map(|other| &velocity[other.index].spin);
        Some(self.turns[turn].u(&velocity[link.a].spin, other))
    }

    /// u of a coupling (N2) whose bodies rotate by `turnings`.
    pub(super) fn point_velocity(
        &self,
        linked: LinkedCoupling<'_>,
        velocity: &[Velocity],
        turnings: LinkTurnings<'_>,
    ) -> Vector3<f64> {
        let u = self.gap_velocity(linked, velocity, turnings);
        if !linked.coupling.bounces() {
            return u;
        }
        linked.coupling.bounded(u, &self.departing(linked, velocity)).0
    }

    /// u with the gap speed along the normal, also for a bouncing contact.
    pub(super) fn gap_velocity(
        &self,
        linked: LinkedCoupling<'_>,
        velocity: &[Velocity],
        turnings: LinkTurnings<'_>,
    ) -> Vector3<f64> {
        let LinkedCoupling { link, coupling } = linked;
        match link.kind {
            CouplingKind::Round(round) => {
                return self.round_motion(linked, round, velocity, turnings).u();
            }
            CouplingKind::Ellipsoid(one) => {
                return self.ellipsoid_motion(linked, one, velocity, turnings).u();
            }
            CouplingKind::Turn(_) | CouplingKind::Moment => {
                return self.turned_velocity(linked, velocity).unwrap_or_default();
            }
            CouplingKind::Gear(gear) => {
                let point = |index: usize| self.point_at(index, velocity);
                return self.gears[gear].u(&self.setting.couplings, point);
            }
            CouplingKind::Point => {}
        }
        match (&link.b, turnings.b) {
            (Some(other), Some(b)) => self.pair_motion(linked, other, velocity, turnings.a, b).u(),
            _ => point_velocity(coupling, &turnings.a.there, &velocity[link.a].linear),
        }
    }

    /// Difference of v⁺ + Gᵀ ω̃⁺ between A and B (eq. 29): relative velocity of the touching points
    /// after the impulses.
    pub(super) fn departing(
        &self,
        linked: LinkedCoupling<'_>,
        velocity: &[Velocity],
    ) -> Vector3<f64> {
        let LinkedCoupling { link, coupling } = linked;
        let of_side = |index: usize, torque_map: &Matrix3<f64>| {
            self.members[index].departing(&velocity[index], torque_map)
        };
        let a = of_side(link.a, &coupling.lever.torque_map);
        link.b.as_ref().map_or(a, |other| a - of_side(other.index, &other.torque_map))
    }
}

/// Rotation of a body and its inverse.
///
/// The inverse has the spin −ω: the Cayley map of −a is the transposed Cayley map of a.
#[derive(Debug, Clone, Copy)]
pub(super) struct Both {
    pub(super) there: BodyTurning,
    pub(super) back: BodyTurning,
}

/// Rotations of the bodies of a coupling.
#[derive(Debug, Clone, Copy)]
pub(super) struct LinkTurnings<'a> {
    pub(super) a: &'a Both,
    /// `None` if B is fixed.
    pub(super) b: Option<&'a Both>,
}

impl<'a> LinkTurnings<'a> {
    /// Selects the rotations of the bodies of `link` from the list of all bodies.
    pub(super) fn new(link: &CouplingLink, turnings: &'a [Both]) -> Self {
        let b = link.b.as_ref().map(|other| &turnings[other.index]);
        Self { a: &turnings[link.a], b }
    }
}

impl Both {
    /// No rotation.
    const STILL: Self = Self { there: BodyTurning::STILL, back: BodyTurning::STILL };

    pub(super) fn new(member: &BodyEquation, velocity: &Velocity) -> Self {
        let mut both = Self::STILL;
        member.set_turnings(&velocity.spin, &mut both.there, &mut both.back);
        both
    }
}
