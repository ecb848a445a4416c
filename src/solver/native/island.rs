//! The equations of several bodies that touch each other: six unknowns a body, a block of the
//! linear system for every pair that touches.
//!
//! Impulses are divided by one mass M for all bodies of the island, the geometric mean of
//! theirs, so that equal compliance in (N6) is equal for all contacts whatever they join.
//! Equation numbers are those of `docs/native-solver.md`.

mod slopes;

use super::blocks::BlockSystem;
use super::equations::{
    Answer, Candidate, Elimination, Equations, Gain, Point, Residual, Velocities, Velocity,
};
use super::fixed_motion::point_velocity;
use super::pair_motion::{PairMotion, PairSlope, stacked};
use super::round_motion::{Round, RoundMotion, Side};
use super::tolerances::{LARGE_TURN, TURN_GAIN, Tolerances};
use super::turning::Turning;
use crate::contact::{Contact, Partner, torque_map_of};
use crate::mechanics::Rotation;
use crate::mechanics::quaternion::rotation;
use crate::step::Step;
use crate::world::World;
use nalgebra::{Matrix3, Matrix3x6, Matrix6, Vector3};

/// One body of the island.
#[derive(Debug, Clone)]
struct Member {
    /// ℓ, m.
    reach: f64,
    /// r at step k.
    position: Vector3<f64>,
    /// A(q) at step k, body → world.
    rotation: Matrix3<f64>,
    /// V of free flight, and at step k.
    free: Velocity,
    old: Velocity,
    /// Î = I/m, m².
    inertia: Matrix3<f64>,
    /// Î⁻¹.
    inertia_inverse: Matrix3<f64>,
    /// h τ/m of the external torque, m²/s.
    torque_impulse: Vector3<f64>,
    /// M/m.
    share: f64,
}

/// Which bodies of the island a candidate joins.
#[derive(Debug, Clone, Copy)]
struct Link {
    /// A.
    a: usize,
    /// Where both features are round, its place among those.
    round: Option<usize>,
    /// B, where it is no fixed thing.
    b: Option<Other>,
}

/// The other side of a contact between two bodies.
#[derive(Debug, Clone, Copy)]
struct Other {
    index: usize,
    /// G_B, m: the torque (frame of B) of an impulse (world) at the touching point.
    torque_map: Matrix3<f64>,
    /// r_A + A_A a − r_B at step k, m, world.
    arm: Vector3<f64>,
}

/// The step of the bodies of one island.
#[derive(Debug, Clone)]
pub(super) struct Island {
    time_step: f64,
    /// By which equation bodies turn.
    form: Rotation,
    /// M, kg.
    mass: f64,
    members: Vec<Member>,
    candidates: Vec<Candidate>,
    all_give_alike: bool,
    links: Vec<Link>,
    /// What candidates of two round features have beyond others.
    rounds: Vec<Round>,
    tolerances: Tolerances,
    unsettled: f64,
}

impl Island {
    /// Room for islands of `world`.
    pub(super) fn new(world: &World) -> Self {
        Self {
            time_step: world.time_step(),
            form: world.rotation(),
            mass: 1.0,
            members: Vec::new(),
            candidates: Vec::new(),
            all_give_alike: true,
            links: Vec::new(),
            rounds: Vec::new(),
            tolerances: Tolerances::of(world, 0.0),
            unsettled: f64::INFINITY,
        }
    }

    /// Sets the step's constants for the bodies of these `indices`, whose impulses changed by
    /// `unsettled` in the steps before; no candidates yet.
    pub(super) fn begin(&mut self, step: &Step<'_>, indices: &[usize], unsettled: f64) {
        let bodies = step.world.bodies();
        self.time_step = step.world.time_step();
        self.form = step.world.rotation();
        let logarithms: f64 = indices.iter().map(|&index| libm::log(bodies[index].mass())).sum();
        self.mass = libm::exp(logarithms / indices.len() as f64);
        self.members.clear();
        self.members.extend(indices.iter().map(|&index| {
            let (body, state, free) = (&bodies[index], &step.states[index], &step.free[index]);
            Member {
                reach: body.reach(),
                position: state.position,
                rotation: rotation(&state.attitude),
                free: Velocity { linear: free.velocity, spin: free.spin },
                old: Velocity { linear: state.velocity, spin: state.spin },
                inertia: *body.specific_inertia(),
                inertia_inverse: *body.specific_inertia_inverse(),
                torque_impulse: step.wrenches[index].torque * (self.time_step / body.mass()),
                share: self.mass / body.mass(),
            }
        }));
        self.candidates.clear();
        self.all_give_alike = true;
        self.links.clear();
        self.rounds.clear();
        self.tolerances = Tolerances::together(step.world, self.speed());
        self.unsettled = unsettled;
    }

    /// M, kg: the mass that impulses are divided by.
    pub(super) fn mass(&self) -> f64 {
        self.mass
    }

    /// Adds a contact; `place` gives the place of a body of the world in the island.
    pub(super) fn admit(&mut self, contact: &Contact, place: impl Fn(usize) -> usize) {
        let a = place(contact.key.body);
        let b = match contact.key.partner {
            Partner::Body(other) => {
                let index = place(other);
                let other = &self.members[index];
                let arm = self.members[a].position + contact.arm - other.position;
                let lever = other.rotation.tr_mul(&arm);
                let torque_map = torque_map_of(&lever, &other.rotation);
                Some(Other {
                    index,
                    torque_map,
                    arm: arm + contact.normal() * contact.features.radius,
                })
            }
            Partner::Ground | Partner::Fixed(_) => None,
        };
        let round = contact.features.curved.map(|curved| {
            self.rounds.push(Round { curved, way: contact.way() });
            self.rounds.len() - 1
        });
        self.links.push(Link { a, round, b });
        let share = self.members[a].share;
        let mut candidate = Candidate::new(contact, self.time_step, share);
        if candidate.approach.abs() <= self.tolerances.level {
            candidate.approach = 0.0;
        }
        self.all_give_alike &= candidate.gives_alike();
        self.candidates.push(candidate);
    }

    /// The residuals of the equations of motion (N1) of all bodies go to `each`: linear and
    /// angular, per unit of a body's own mass.
    fn motion(
        &self,
        velocity: &[Velocity],
        impulses: &[Vector3<f64>],
        residuals: &mut Vec<Velocity>,
    ) {
        residuals.clear();
        residuals.extend(self.members.iter().zip(velocity).map(|(member, velocity)| {
            let (h, spin, old) = (self.time_step, &velocity.spin, &member.old.spin);
            let gyroscopic = h * self.form.gyroscopic(&member.inertia, old, spin, h);
            let turned = member.inertia * (spin - member.old.spin);
            Velocity {
                linear: velocity.linear - member.free.linear,
                spin: turned + gyroscopic - member.torque_impulse,
            }
        }));
        for ((link, candidate), impulse) in self.links.iter().zip(&self.candidates).zip(impulses) {
            let share = self.members[link.a].share;
            residuals[link.a].linear -= share * impulse;
            residuals[link.a].spin -= share * (candidate.torque_map * impulse);
            if let Some(other) = &link.b {
                let share = self.members[other.index].share;
                residuals[other.index].linear += share * impulse;
                residuals[other.index].spin += share * (other.torque_map * impulse);
            }
        }
    }

    /// ∂(angular part)/∂ω⁺ = Î + h ∂Ĝ/∂ω⁺ of a body.
    fn angular_slope(&self, member: &Member, spin: &Vector3<f64>) -> Matrix3<f64> {
        let h = self.time_step;
        member.inertia + h * self.form.gyroscopic_slope(&member.inertia, spin, h)
    }

    fn turnings(&self, member: &Member, velocity: &Velocity) -> Both {
        let (rotation, h) = (&member.rotation, self.time_step);
        Both {
            there: Turning::new(rotation, velocity.spin, h),
            back: Turning::new(rotation, -velocity.spin, h),
        }
    }

    /// Those of all bodies.
    fn set_turnings(&self, velocity: &[Velocity], turnings: &mut Vec<Both>) {
        let bodies = self.members.iter().zip(velocity);
        turnings.clear();
        turnings.extend(bodies.map(|(member, velocity)| self.turnings(member, velocity)));
    }

    /// The motion of a candidate whose plane is a body's, which turn as told.
    fn pair_motion<'a>(
        &'a self,
        candidate: &'a Candidate,
        (link, other): (&Link, &Other),
        velocity: &[Velocity],
        (a, b): (&'a Both, &'a Both),
    ) -> PairMotion<'a> {
        let apart = velocity[link.a].linear - velocity[other.index].linear;
        let rotations = (&self.members[link.a].rotation, &self.members[other.index].rotation);
        let turnings = (&a.there, &b.back);
        PairMotion::new(candidate, &other.arm, &apart, rotations, turnings, self.time_step)
    }

    /// The motion of a candidate of two round features, the one in this place among those.
    fn round_motion<'a>(
        &'a self,
        (candidate, round): (&'a Candidate, usize),
        link: &Link,
        velocity: &'a [Velocity],
        (a, b): (&'a Both, Option<&'a Both>),
    ) -> RoundMotion<'a> {
        let side = |index: usize, turnings: &'a Both| Side {
            rotation: &self.members[index].rotation,
            turning: &turnings.there,
            linear: &velocity[index].linear,
        };
        let of_b = link.b.as_ref().zip(b).map(|(other, b)| side(other.index, b));
        let round = &self.rounds[round];
        RoundMotion::new(candidate, round, side(link.a, a), of_b, self.time_step)
    }

    /// u of a candidate (N2), where the bodies that it joins turn as told.
    fn point_velocity(
        &self,
        (link, candidate): (&Link, &Candidate),
        velocity: &[Velocity],
        turnings: (&Both, Option<&Both>),
    ) -> Vector3<f64> {
        let u = self.gap_velocity((link, candidate), velocity, turnings);
        if !candidate.bounces() {
            return u;
        }
        candidate.bounded(u, &self.departing((link, candidate), velocity)).0
    }

    /// The same with the gap speed along the normal, also where it bounces.
    fn gap_velocity(
        &self,
        (link, candidate): (&Link, &Candidate),
        velocity: &[Velocity],
        turnings: (&Both, Option<&Both>),
    ) -> Vector3<f64> {
        if let Some(round) = link.round {
            return self.round_motion((candidate, round), link, velocity, turnings).u();
        }
        match (&link.b, turnings.1) {
            (Some(other), Some(b)) => {
                self.pair_motion(candidate, (link, other), velocity, (turnings.0, b)).u()
            }
            _ => point_velocity(candidate, &turnings.0.there, &velocity[link.a].linear),
        }
    }

    /// v⁺ + Gᵀ ω̃⁺ of A less that of B (eq. 29): how the touching points part after the impulses.
    fn departing(
        &self,
        (link, candidate): (&Link, &Candidate),
        velocity: &[Velocity],
    ) -> Vector3<f64> {
        let of_side = |index: usize, torque_map: &Matrix3<f64>| {
            let (member, velocity) = (&self.members[index], &velocity[index]);
            let inertia = (&member.inertia, &member.inertia_inverse);
            let spin = self.form.departing_spin(inertia, &velocity.spin, self.time_step);
            velocity.linear + torque_map.tr_mul(&spin)
        };
        let a = of_side(link.a, &candidate.torque_map);
        link.b.as_ref().map_or(a, |other| a - of_side(other.index, &other.torque_map))
    }
}

/// How a body turns, and how its frame turns back: with the spin −ω, because w = A_Bᵀ (…) and the
/// Cayley map of −a is the transpose of that of a.
#[derive(Debug, Clone, Copy)]
struct Both {
    there: Turning,
    back: Turning,
}

/// Memory of an evaluation: residuals, and how the bodies turn and turn back.
#[derive(Debug, Clone, Default)]
pub(super) struct IslandScratch {
    residuals: Vec<Velocity>,
    turnings: Vec<Both>,
}

impl Equations for Island {
    type Velocity = Vec<Velocity>;
    type Slope = PairSlope;
    type System = BlockSystem;
    type Scratch = IslandScratch;

    fn candidates(&self) -> &[Candidate] {
        &self.candidates
    }

    fn all_give_alike(&self) -> bool {
        self.all_give_alike
    }

    fn give_alike(&mut self) {
        self.all_give_alike = true;
        self.candidates.iter_mut().for_each(|candidate| candidate.give = 1.0);
    }

    fn tolerances(&self) -> &Tolerances {
        &self.tolerances
    }

    fn bodies(&self) -> usize {
        self.members.len()
    }

    fn unsettled(&self) -> f64 {
        self.unsettled
    }

    fn speed(&self) -> f64 {
        let speeds = self
            .members
            .iter()
            .map(|member| member.free.linear.norm() + member.free.spin.norm() * member.reach);
        speeds.fold(0.0, f64::max)
    }

    fn set_velocity_after(&self, impulses: &[Vector3<f64>], velocity: &mut Vec<Velocity>) {
        velocity.clear();
        velocity.extend(self.members.iter().map(|member| member.free));
        for (index, impulse) in impulses.iter().enumerate() {
            self.push(index, impulse, velocity);
        }
    }

    fn push(&self, index: usize, impulse: &Vector3<f64>, velocity: &mut Vec<Velocity>) {
        let mut push = |index: usize, impulse: &Vector3<f64>, torque_map: &Matrix3<f64>| {
            let member = &self.members[index];
            let impulse = member.share * impulse;
            velocity[index].linear += impulse;
            velocity[index].spin += member.inertia_inverse * (torque_map * impulse);
        };
        let link = &self.links[index];
        push(link.a, impulse, &self.candidates[index].torque_map);
        if let Some(other) = &link.b {
            push(other.index, &-impulse, &other.torque_map);
        }
    }

    fn keep_velocity(&self, velocity: &mut Vec<Velocity>) {
        let Tolerances { exact, rest, .. } = self.tolerances;
        for (member, velocity) in self.members.iter().zip(velocity.iter_mut()) {
            if (velocity.spin - member.old.spin).amax() * member.reach <= exact {
                velocity.spin = member.old.spin;
            }
            if (velocity.linear - member.old.linear).amax() <= exact {
                velocity.linear = member.old.linear;
            }
        }
        for (link, candidate) in self.links.iter().zip(&self.candidates) {
            let sides = [Some(link.a), link.b.as_ref().map(|other| other.index)];
            for index in sides.into_iter().flatten() {
                let old = &self.members[index].old.linear;
                let along = candidate.normal.dot(&(velocity[index].linear - old));
                if along.abs() <= exact {
                    velocity[index].linear -= candidate.normal * along;
                }
            }
        }
        for (member, velocity) in self.members.iter().zip(velocity) {
            let slow = |velocity: &Velocity| {
                velocity.linear.amax().max(velocity.spin.amax() * member.reach) <= rest
            };
            if slow(velocity) && slow(&member.old) {
                *velocity = Velocity::zero();
            }
        }
    }

    fn turns_too_far(&self, velocity: &Vec<Velocity>) -> bool {
        let h = self.time_step;
        self.members.iter().zip(velocity).any(|(member, velocity)| {
            let turn = h * velocity.spin.norm();
            turn > LARGE_TURN && turn > TURN_GAIN * h * member.old.spin.norm()
        })
    }

    fn motion_residual(
        &self,
        velocity: &Vec<Velocity>,
        impulses: &[Vector3<f64>],
        scratch: &mut IslandScratch,
    ) -> Residual {
        let residuals = &mut scratch.residuals;
        self.motion(velocity, impulses, residuals);
        let mut size = Residual::default();
        for (member, residual) in self.members.iter().zip(&*residuals) {
            size.add(&residual.linear);
            size.add(&(member.inertia_inverse * residual.spin * member.reach));
        }
        size
    }

    fn point(&self, index: usize, velocity: &Vec<Velocity>) -> Vector3<f64> {
        let link = &self.links[index];
        let turnings = |body: usize| self.turnings(&self.members[body], &velocity[body]);
        let (a, b) = (turnings(link.a), link.b.as_ref().map(|other| turnings(other.index)));
        self.point_velocity((link, &self.candidates[index]), velocity, (&a, b.as_ref()))
    }

    fn set_points(
        &self,
        velocity: &Vec<Velocity>,
        scratch: &mut IslandScratch,
        points: &mut Vec<Vector3<f64>>,
    ) {
        let turnings = &mut scratch.turnings;
        self.set_turnings(velocity, turnings);
        points.clear();
        points.extend(self.links.iter().zip(&self.candidates).map(|(link, candidate)| {
            let b = link.b.as_ref().map(|other| &turnings[other.index]);
            self.point_velocity((link, candidate), velocity, (&turnings[link.a], b))
        }));
    }

    fn direction(
        &self,
        at: Point<'_, Self>,
        mut answer: impl FnMut(usize, &Candidate, &Vector3<f64>) -> Option<Answer>,
        eliminations: &mut Vec<Elimination<PairSlope>>,
        blocks: &mut BlockSystem,
        step: &mut Vec<Velocity>,
    ) -> bool {
        let IslandScratch { residuals, turnings } = at.scratch;
        let of_link = |link: &Link| link.b.as_ref().map(|other| (link.a, other.index));
        let pairs = self.links.iter().filter_map(of_link);
        blocks.begin(self.members.len(), pairs);
        for (index, residual) in residuals.iter().enumerate() {
            let mut diagonal = Matrix6::identity();
            let slope = self.angular_slope(&self.members[index], &at.velocity[index].spin);
            diagonal.fixed_view_mut::<3, 3>(3, 3).copy_from(&slope);
            blocks.add(index, index, &diagonal);
            blocks.add_rhs(index, &-stacked(residual));
        }
        eliminations.clear();
        for (index, (candidate, u)) in self.candidates.iter().zip(at.points).enumerate() {
            let Some(answer) = answer(index, candidate, u) else { return false };
            let link = &self.links[index];
            let slope = match answer.gain {
                Gain::Zero => PairSlope { a: (link.a, Matrix3x6::zeros()), b: None },
                _ => self.pair_slope(link, candidate, at.velocity, turnings),
            };
            let elimination = Elimination { answer, slope };
            self.add_contact(link, candidate, &elimination, blocks);
            eliminations.push(elimination);
        }
        if !blocks.solve() {
            return false;
        }
        step.clear();
        step.extend(blocks.solution().map(|x| Velocity {
            linear: x.fixed_rows::<3>(0).into(),
            spin: x.fixed_rows::<3>(3).into(),
        }));
        step.is_finite()
    }
}
