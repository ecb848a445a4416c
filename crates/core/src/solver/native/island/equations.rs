//! Equations of an island and the linear system of its bodies.
//!
//! Equation numbers refer to `docs/native-solver.md`.

use super::{Both, CouplingKind, Island, IslandSlope, LinkTurnings};
use crate::contact::rounding::{self, FORCE_ROUNDINGS};
use crate::solver::native::body_equation::BodyEquation;
use crate::solver::native::coupling::Coupling;
use crate::solver::native::equations::{
    Determined, Elimination, Equations, EvaluatedPoint, MapResidual, MomentPlace, StepSetting,
    Velocities, Velocity,
};
use crate::solver::native::islands::IslandView;
use crate::solver::native::law::{Gain, LocalSolution};
use crate::solver::native::pair_motion::stacked;
use crate::solver::native::settings::Settings;
use crate::solver::native::tolerances::Tolerances;
use crate::sparse::BlockSystem;
use crate::step::Step;
use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};

/// Scratch of an evaluation: residuals and, without joints, the rotations of the bodies.
#[derive(Debug, Clone, Default)]
pub(crate) struct IslandScratch {
    residuals: Vec<Velocity>,
    turnings: Vec<Both>,
    /// Speeds that impulses cause, one per body (m/s).
    speeds: Vec<f64>,
}

/// Linear system, velocities in elimination order, and rotations of bodies with joints.
#[derive(Debug, Clone, Default)]
pub(crate) struct IslandSystem {
    pub(super) blocks: BlockSystem,
    values: Vec<Vector6<f64>>,
    turnings: Vec<Both>,
}

impl Island {
    /// Adds the velocity changes of an additional impulse p̂ at coupling `index`.
    fn push(&self, index: usize, impulse: &Vector3<f64>, velocity: &mut [Velocity]) {
        let link = &self.links[index];
        if let CouplingKind::Gear(gear) = link.kind {
            for (body, wrench) in self.gears[gear].sides() {
                let turned = wrench.fixed_rows::<3>(3) * impulse[0];
                velocity[body].linear += wrench.fixed_rows::<3>(0) * impulse[0];
                velocity[body].spin += self.members[body].inertia_inverse * turned;
            }
            return;
        }
        let pushes = link.pushes();
        let mut push = |index: usize, impulse: &Vector3<f64>, torque_map: &Matrix3<f64>| {
            let member = &self.members[index];
            let impulse = member.share * impulse;
            if pushes {
                velocity[index].linear += impulse;
            }
            velocity[index].spin += member.inertia_inverse * (torque_map * impulse);
        };
        push(link.a, impulse, &self.setting.couplings[index].lever.torque_map);
        if let Some(other) = &link.b {
            push(other.index, &-impulse, &other.torque_map);
        }
    }
}

impl Equations for Island {
    type Velocity = Vec<Velocity>;
    type Slope = IslandSlope;
    type System = IslandSystem;
    type Scratch = IslandScratch;

    const MAY_BE_TIED: bool = true;

    fn setting(&self) -> &StepSetting {
        &self.setting
    }

    fn setting_mut(&mut self) -> &mut StepSetting {
        &mut self.setting
    }

    fn settings(&self) -> &'static Settings {
        Settings::for_island(self.members.len(), self.links.len(), !self.joints.is_empty())
    }

    fn bodies(&self) -> usize {
        self.members.len()
    }

    fn speed(&self) -> f64 {
        self.members.iter().map(BodyEquation::speed).fold(0.0, f64::max)
    }

    fn foresee(&mut self, step: &Step<'_>, island: &IslandView<'_>, previous: &[Vector3<f64>]) {
        let Some(earlier) = step.earlier.filter(|_| !self.joints.is_empty()) else { return };
        let (mut velocity, mut impulses) = std::mem::take(&mut self.ahead);
        let to_impulse = self.time_step / self.mass;
        let ahead = &island.known.ahead;
        impulses.extend(island.contacts.iter().map(|&place| ahead[place] * to_impulse));
        impulses.extend_from_slice(&previous[impulses.len()..]);
        let contacts = self.first_of_joints();
        for (now, before) in
            impulses[contacts..].iter_mut().zip(self.joint_impulses(&earlier.joints))
        {
            *now = 2.0 * *now - before;
        }
        let before = island.bodies.iter().filter_map(|body| earlier.states.get(*body));
        let before = before.map(|state| Velocity { linear: state.velocity, spin: state.spin });
        self.set_velocity_under(&impulses, &mut velocity);
        self.follow(before, &mut velocity);
        self.ahead = (velocity, impulses);
    }

    fn set_foreseen(
        &self,
        velocity: &mut Vec<Velocity>,
        impulses: &mut Vec<Vector3<f64>>,
    ) -> Option<f64> {
        velocity.copy_from(&self.ahead.0);
        impulses.clone_from(&self.ahead.1);
        let members = self.members.iter().zip(&self.ahead.0);
        members.map(|(member, ahead)| member.distance_from_old(ahead)).reduce(f64::max)
    }

    fn moments(&self) -> &[MomentPlace] {
        &self.moments
    }

    fn determined(&self) -> Option<Determined> {
        self.determined
    }

    fn extend_with_moments(&self, island: &IslandView<'_>, previous: &mut Vec<Vector3<f64>>) {
        previous.extend(self.moment_impulses(&island.known.moments, island.contacts));
    }

    fn extend_previous(&self, step: &Step<'_>, previous: &mut Vec<Vector3<f64>>) {
        previous.extend(self.joint_impulses(&step.previous.joints));
        previous.extend(self.gear_impulses(step));
    }

    fn set_first_velocity(&self, impulses: &[Vector3<f64>], velocity: &mut Vec<Velocity>) {
        if self.joints.is_empty() {
            return self.set_velocity_after(impulses, velocity);
        }
        velocity.clear();
        velocity.extend(self.members.iter().map(|member| *member.old()));
    }

    fn set_velocity_after(&self, impulses: &[Vector3<f64>], velocity: &mut Vec<Velocity>) {
        velocity.clear();
        velocity.extend(self.members.iter().map(|member| member.free));
        for (index, impulse) in impulses.iter().enumerate() {
            self.push(index, impulse, velocity);
        }
    }

    fn keep_velocity(&self, velocity: &mut Vec<Velocity>) {
        let Tolerances { exact, rest, .. } = self.setting.tolerances;
        for (member, velocity) in self.members.iter().zip(velocity.iter_mut()) {
            member.keep(exact, velocity);
        }
        let contacts = self.links.iter().zip(&self.setting.couplings);
        for (link, coupling) in contacts.filter(|(_, coupling)| coupling.is_contact()) {
            let sides = [Some(link.a), link.b.as_ref().map(|other| other.index)];
            for index in sides.into_iter().flatten() {
                let normal = &coupling.rows.normal();
                self.members[index].keep_along(normal, exact, &mut velocity[index]);
            }
        }
        // Bodies tied by joints come to rest together or not at all. Otherwise a resting body would
        // break its joint.
        let slow = |(member, velocity): (&BodyEquation, &Velocity)| member.is_slow(rest, velocity);
        if self.joints.is_empty() || self.members.iter().zip(&*velocity).all(slow) {
            for (member, velocity) in self.members.iter().zip(velocity) {
                member.rest(rest, velocity);
            }
        }
    }

    fn turns_too_far(&self, velocity: &Vec<Velocity>) -> bool {
        self.members.iter().zip(velocity).any(|(member, velocity)| member.turns_too_far(velocity))
    }

    fn energy_made(
        &self,
        velocity: &Vec<Velocity>,
        impulses: &[Vector3<f64>],
        points: &[Vector3<f64>],
    ) -> f64 {
        if self.joints.is_empty() { 0.0 } else { self.made(velocity, impulses, points) }
    }

    fn motion_residual(
        &self,
        velocity: &Vec<Velocity>,
        impulses: &[Vector3<f64>],
        scratch: &mut IslandScratch,
    ) -> MapResidual {
        let residuals = &mut scratch.residuals;
        self.motion(velocity, impulses, residuals);
        let mut size = MapResidual::default();
        for (member, residual) in self.members.iter().zip(&*residuals) {
            size.add(&residual.linear);
            size.add(&member.as_speed(&residual.spin));
        }
        size
    }

    fn rounding(&self, impulses: &[Vector3<f64>], scratch: &mut IslandScratch) -> f64 {
        let IslandScratch { speeds, .. } = scratch;
        speeds.clear();
        speeds.resize(self.members.len(), 0.0);
        let couplings = self.links.iter().zip(&self.setting.couplings);
        for ((link, coupling), impulse) in couplings.zip(impulses) {
            if let CouplingKind::Gear(gear) = link.kind {
                for (body, wrench) in self.gears[gear].sides() {
                    let [force, torque] =
                        [0, 3].map(|row| wrench.fixed_rows::<3>(row).into_owned());
                    speeds[body] += self.members[body]
                        .largest_speed(&(force * impulse[0]), &(torque * impulse[0]));
                }
                continue;
            }
            let force = if link.pushes() { *impulse } else { Vector3::zeros() };
            let mut add = |body: usize, torque_map: &Matrix3<f64>| {
                let share = self.members[body].share;
                let torque = torque_map * impulse;
                speeds[body] += share * self.members[body].largest_speed(&force, &torque);
            };
            add(link.a, &coupling.lever.torque_map);
            if let Some(other) = &link.b {
                add(other.index, &other.torque_map);
            }
        }
        let largest = speeds.iter().copied().fold(0.0, f64::max);
        (0.5 * FORCE_ROUNDINGS * f64::EPSILON * largest).min(rounding::LARGEST)
    }

    fn slope_along(&self, scratch: &IslandScratch, step: &Vec<Velocity>) -> Option<f64> {
        let members = self.members.iter().zip(&scratch.residuals).zip(step);
        Some(members.map(|((member, residual), step)| member.power(residual, step)).sum())
    }

    fn set_points(
        &self,
        velocity: &Vec<Velocity>,
        scratch: &mut IslandScratch,
        points: &mut Vec<Vector3<f64>>,
    ) {
        points.clear();
        if !self.joints.is_empty() {
            let count = self.links.len() - self.gears.len();
            // With joints, most rows belong to joints, and most evaluations are not linearised.
            // Rotations are computed for each point alone.
            points.extend((0..count).map(|index| self.point_at(index, velocity)));
            // Gears come last: the rows that they combine are known.
            for gear in &self.gears {
                points.push(gear.u(&self.setting.couplings, |index| points[index]));
            }
            return;
        }
        let turnings = &mut scratch.turnings;
        self.set_turnings(velocity, turnings);
        points.extend(self.all_linked().map(|linked| {
            self.point_velocity(linked, velocity, LinkTurnings::new(linked.link, turnings))
        }));
    }

    fn linearise(
        &self,
        at: EvaluatedPoint<'_, Self>,
        mut local_solution: impl FnMut(usize, &Coupling, &Vector3<f64>) -> Option<LocalSolution>,
        eliminations: &mut Vec<Elimination<IslandSlope>>,
        system: &mut IslandSystem,
    ) -> bool {
        let IslandSystem { blocks, turnings, .. } = system;
        let turnings = if self.joints.is_empty() {
            &at.scratch.turnings
        } else {
            self.set_turnings(at.velocity, turnings);
            &*turnings
        };
        blocks.begin(&self.pattern);
        for (index, (member, velocity)) in self.members.iter().zip(at.velocity).enumerate() {
            let mut diagonal = Matrix6::identity();
            let slope = member.angular_slope(&velocity.spin);
            diagonal.fixed_view_mut::<3, 3>(3, 3).copy_from(&slope);
            blocks.add(&self.pattern, index, index, &diagonal);
        }
        eliminations.clear();
        for (index, (linked, u)) in self.all_linked().zip(at.points).enumerate() {
            let Some(local_solution) = local_solution(index, linked.coupling, u) else {
                return false;
            };
            let slope = match local_solution.gain {
                Gain::Zero => IslandSlope::NONE,
                _ => self.slope(linked, at.velocity, turnings),
            };
            let elimination = Elimination { local_solution, slope };
            self.add_gain(linked, &elimination, blocks);
            eliminations.push(elimination);
        }
        for at in &self.moments {
            self.add_load_gain(at, eliminations, blocks);
        }
        blocks.factorise(&self.pattern)
    }

    fn direction(
        &self,
        scratch: &IslandScratch,
        eliminations: &[Elimination<IslandSlope>],
        system: &mut IslandSystem,
        step: &mut Vec<Velocity>,
    ) -> bool {
        let IslandSystem { blocks, values, .. } = system;
        values.clear();
        values.resize(self.members.len(), Vector6::zeros());
        for (index, residual) in scratch.residuals.iter().enumerate() {
            values[self.pattern.place(index)] = -stacked(residual);
        }
        for (linked, elimination) in self.all_linked().zip(eliminations) {
            self.add_offset(linked, &elimination.local_solution.offset, values);
        }
        for at in &self.moments {
            self.add_load_offset(at, eliminations, values);
        }
        blocks.solve::<false>(&self.pattern, values);
        step.clear();
        step.extend((0..self.members.len()).map(|index| {
            let x = &values[self.pattern.place(index)];
            Velocity { linear: x.fixed_rows::<3>(0).into(), spin: x.fixed_rows::<3>(3).into() }
        }));
        step.is_finite()
    }
}
