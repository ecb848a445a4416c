//! The equations of several bodies that touch each other: six unknowns a body, a block of the
//! linear system for every pair that touches.
//!
//! Impulses are divided by one mass M for all bodies of the island, the geometric mean of
//! theirs, so that equal compliance in (N6) is equal for all contacts whatever they join.
//! Equation numbers are those of `docs/native-solver.md`.

mod energy;
mod gears;
mod joints;
mod slopes;
mod tangent;

use super::blocks::BlockSystem;
use super::coupling::{Coupling, approach};
use super::equations::{
    Determined, Elimination, Equations, Point, Residual, Setting, Velocities, Velocity,
};
use super::fixed_motion::point_velocity;
use super::law::{Answer, Gain};
use super::member::Member;
use super::pair_motion::{PairMotion, PairSlope, stacked};
use super::pattern::Pattern;
use super::policy::Policy;
use super::round_motion::{Round, RoundMotion, Side};
use super::tolerances::{SLOW, Tolerances};
use super::turning::Turning;
use crate::contact::{Contact, Partner, torque_map_of};
use crate::joint::Turn;
use crate::step::Step;
use crate::world::World;
use nalgebra::{Matrix3, Matrix3x6, Matrix6, Vector3, Vector6};

use energy::Source;
pub(super) use gears::IslandSlope;
use gears::Train;
pub(super) use joints::JointPlace;
pub(super) use tangent::{GearRow, HeldSide};

/// Which bodies of the island a coupling joins.
#[derive(Debug, Clone, Copy)]
struct Link {
    /// A; of a gear one of its bodies.
    a: usize,
    kind: Kind,
    /// B, where it is no fixed thing.
    b: Option<Other>,
    /// What it has to do with energy.
    source: Source,
}

/// What a coupling is of, with its place among those of its kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    /// A point.
    Point,
    /// Two round features.
    Round(usize),
    /// The turn of a joint.
    Turn(usize),
    /// A gear.
    Gear(usize),
}

impl Link {
    /// Whether the impulse is one of forces; that of a turn is one of torques alone.
    fn pushes(&self) -> bool {
        !matches!(self.kind, Kind::Turn(_))
    }
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
    /// M, kg.
    mass: f64,
    members: Vec<Member>,
    setting: Setting,
    links: Vec<Link>,
    /// What couplings of two round features have beyond others.
    rounds: Vec<Round>,
    /// The turns of joints.
    turns: Vec<Turn>,
    /// The joints of the island, and where their couplings are.
    joints: Vec<JointPlace>,
    gears: Vec<Train>,
    /// Whether the rows are independent, as those of joints without a loop are.
    determined: Option<Determined>,
    /// −V of all members at step k, where joints tie them.
    back: Vec<Velocity>,
    /// V and p̂ to which the last two steps lead on, where joints tie them and both are known.
    ahead: (Vec<Velocity>, Vec<Vector3<f64>>),
    /// A motion slower than this has no energy to speak of, m/s.
    slow: f64,
    /// Where the linear system has numbers.
    pattern: Pattern,
}

impl Island {
    /// Room for islands of `world`.
    pub(super) fn new(world: &World) -> Self {
        Self {
            time_step: world.time_step(),
            mass: 1.0,
            members: Vec::new(),
            setting: Setting::new(Tolerances::of(world, 0.0)),
            links: Vec::new(),
            rounds: Vec::new(),
            turns: Vec::new(),
            joints: Vec::new(),
            gears: Vec::new(),
            determined: None,
            back: Vec::new(),
            ahead: (Vec::new(), Vec::new()),
            slow: SLOW * world.speed_scale(),
            pattern: Pattern::default(),
        }
    }

    /// Sets the step's constants for the bodies of these `indices`, whose impulses changed by
    /// `unsettled` in the steps before; no couplings yet.
    pub(super) fn begin(&mut self, step: &Step<'_>, indices: &[usize], unsettled: f64) {
        let bodies = step.world.bodies();
        self.time_step = step.world.time_step();
        let logarithms: f64 = indices.iter().map(|&index| libm::log(bodies[index].mass())).sum();
        self.mass = libm::exp(logarithms / indices.len() as f64);
        self.members.clear();
        self.members.extend(indices.iter().map(|&index| Member::new(step, index, self.mass)));
        self.links.clear();
        self.rounds.clear();
        self.turns.clear();
        self.joints.clear();
        self.gears.clear();
        self.back.clear();
        self.ahead.0.clear();
        self.ahead.1.clear();
        self.slow = SLOW * step.world.speed_scale();
        self.setting.begin(Tolerances::together(step.world, self.speed()), unsettled);
    }

    /// Its bodies, in their order.
    pub(super) fn members(&self) -> &[Member] {
        &self.members
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
        let (h, level) = (self.time_step, self.setting.tolerances.level);
        let kind = contact.features.curved.map_or(Kind::Point, |curved| {
            let approach = approach(contact, h, level);
            let (way, carried) = (contact.way(), Vector3::zeros());
            self.rounds.push(Round { curved, way, approach, carried });
            Kind::Round(self.rounds.len() - 1)
        });
        self.links.push(Link { a, kind, b, source: Source::Contact });
        let share = self.members[a].share;
        self.setting.admit(Coupling::of_contact(contact, h, (share, level)));
    }

    /// Has surfaces carry what touches at the contact that was admitted last with `carried` (m/s, world).
    pub(super) fn carry(&mut self, carried: Vector3<f64>) {
        self.setting.carry(&carried);
        if let Some(Kind::Round(round)) = self.links.last().map(|link| link.kind) {
            self.rounds[round].carried = carried;
        }
    }

    /// Ties the bodies by the couplings that were admitted: no more are to come.
    pub(super) fn tie(&mut self) {
        let pair = |link: &Link| link.b.as_ref().map(|other| (link.a, other.index));
        let of_gears = self.gears.iter().flat_map(Train::pairs);
        let pairs = self.links.iter().filter_map(pair).chain(of_gears);
        self.pattern.set(self.members.len(), pairs);
        self.determined = self.find_determined();
        if !self.joints.is_empty() {
            let still = Velocity::zero();
            self.back.extend(self.members.iter().map(|member| still.moved(-1.0, member.old())));
        }
    }

    /// Where the couplings of its joints begin, behind those of contacts.
    fn first_of_joints(&self) -> usize {
        self.links.iter().take_while(|link| link.source == Source::Contact).count()
    }

    /// Joints that hang all bodies together without a loop have independent rows; with contacts or gears beside them it is to be
    /// seen. There are more joints than bodies where they have a loop.
    fn find_determined(&self) -> Option<Determined> {
        let between = self.joints.iter().filter(|joint| joint.is_of_two).count();
        let has_loop = self.joints.len() > self.members.len();
        if self.joints.is_empty() || has_loop {
            return None;
        }
        let alone = self.first_of_joints() == 0 && self.gears.is_empty();
        let is_tree = alone && between + 1 == self.members.len();
        Some(if is_tree { Determined::Surely } else { Determined::Maybe })
    }

    /// The residuals of the equations of motion (N1) of all bodies: linear and
    /// angular, per unit of a body's own mass.
    fn motion(
        &self,
        velocity: &[Velocity],
        impulses: &[Vector3<f64>],
        residuals: &mut Vec<Velocity>,
    ) {
        residuals.clear();
        let bodies = self.members.iter().zip(velocity);
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
        let couplings = self.links.iter().zip(&self.setting.couplings);
        for ((link, coupling), impulse) in couplings.zip(impulses) {
            if let Kind::Gear(gear) = link.kind {
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

    /// Those of all bodies.
    fn set_turnings(&self, velocity: &[Velocity], turnings: &mut Vec<Both>) {
        let bodies = self.members.iter().zip(velocity);
        turnings.clear();
        turnings.extend(bodies.map(|(member, velocity)| Both::of(member, velocity)));
    }

    /// The motion of a coupling whose plane is a body's, which turn as told.
    fn pair_motion<'a>(
        &'a self,
        coupling: &'a Coupling,
        (link, other): (&Link, &Other),
        velocity: &[Velocity],
        (a, b): (&'a Both, &'a Both),
    ) -> PairMotion<'a> {
        let apart = velocity[link.a].linear - velocity[other.index].linear;
        let rotations = (&self.members[link.a].rotation, &self.members[other.index].rotation);
        let turnings = (&a.there, &b.back);
        PairMotion::new(coupling, &other.arm, &apart, rotations, turnings, self.time_step)
    }

    /// The motion of a coupling of two round features, the one in this place among those.
    fn round_motion<'a>(
        &'a self,
        (coupling, round): (&'a Coupling, usize),
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
        RoundMotion::new(coupling, round, side(link.a, a), of_b, self.time_step)
    }

    /// u of coupling `index` (N2).
    fn point_at(&self, index: usize, velocity: &[Velocity]) -> Vector3<f64> {
        let link = &self.links[index];
        if let Some(u) = self.turned_velocity(link, velocity) {
            return u;
        }
        let turnings = |body: usize| Both::of(&self.members[body], &velocity[body]);
        let (a, b) = (turnings(link.a), link.b.as_ref().map(|other| turnings(other.index)));
        self.point_velocity((link, &self.setting.couplings[index]), velocity, (&a, b.as_ref()))
    }

    /// The same of a joint's turn.
    fn turned_velocity(&self, link: &Link, velocity: &[Velocity]) -> Option<Vector3<f64>> {
        let Kind::Turn(turn) = link.kind else { return None };
        let other = link.b.as_ref().map(|other| &velocity[other.index].spin);
        Some(self.turns[turn].u(&velocity[link.a].spin, other))
    }

    /// The same, where the bodies that it joins turn as told.
    fn point_velocity(
        &self,
        (link, coupling): (&Link, &Coupling),
        velocity: &[Velocity],
        turnings: (&Both, Option<&Both>),
    ) -> Vector3<f64> {
        let u = self.gap_velocity((link, coupling), velocity, turnings);
        if !coupling.bounces() {
            return u;
        }
        coupling.bounded(u, &self.departing((link, coupling), velocity)).0
    }

    /// The same with the gap speed along the normal, also where it bounces.
    fn gap_velocity(
        &self,
        (link, coupling): (&Link, &Coupling),
        velocity: &[Velocity],
        turnings: (&Both, Option<&Both>),
    ) -> Vector3<f64> {
        match link.kind {
            Kind::Round(round) => {
                return self.round_motion((coupling, round), link, velocity, turnings).u();
            }
            Kind::Turn(_) => {
                return self.turned_velocity(link, velocity).unwrap_or_default();
            }
            Kind::Gear(gear) => {
                let point = |index: usize| self.point_at(index, velocity);
                return self.gears[gear].u(&self.setting.couplings, point);
            }
            Kind::Point => {}
        }
        match (&link.b, turnings.1) {
            (Some(other), Some(b)) => {
                self.pair_motion(coupling, (link, other), velocity, (turnings.0, b)).u()
            }
            _ => point_velocity(coupling, &turnings.0.there, &velocity[link.a].linear),
        }
    }

    /// v⁺ + Gᵀ ω̃⁺ of A less that of B (eq. 29): how the touching points part after the impulses.
    fn departing(
        &self,
        (link, coupling): (&Link, &Coupling),
        velocity: &[Velocity],
    ) -> Vector3<f64> {
        let of_side = |index: usize, torque_map: &Matrix3<f64>| {
            self.members[index].departing(&velocity[index], torque_map)
        };
        let a = of_side(link.a, &coupling.lever.torque_map);
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

impl Both {
    fn of(member: &Member, velocity: &Velocity) -> Self {
        Self { there: member.turning(velocity.spin), back: member.turning(-velocity.spin) }
    }
}

/// Memory of an evaluation: residuals, and how the bodies turn and turn back.
#[derive(Debug, Clone, Default)]
pub(super) struct IslandScratch {
    residuals: Vec<Velocity>,
    turnings: Vec<Both>,
}

/// The linear system, and the velocities by their places in it.
#[derive(Debug, Clone, Default)]
pub(super) struct IslandSystem {
    blocks: BlockSystem,
    values: Vec<Vector6<f64>>,
}

impl Equations for Island {
    type Velocity = Vec<Velocity>;
    type Slope = IslandSlope;
    type System = IslandSystem;
    type Scratch = IslandScratch;

    const MAY_BE_TIED: bool = true;

    fn setting(&self) -> &Setting {
        &self.setting
    }

    fn setting_mut(&mut self) -> &mut Setting {
        &mut self.setting
    }

    fn policy(&self) -> &'static Policy {
        if self.joints.is_empty() { Policy::of(self.members.len()) } else { Policy::tied() }
    }

    fn bodies(&self) -> usize {
        self.members.len()
    }

    fn speed(&self) -> f64 {
        self.members.iter().map(Member::speed).fold(0.0, f64::max)
    }

    fn foresee(&mut self, step: &Step<'_>, bodies: &[usize], previous: &[Vector3<f64>]) {
        let Some(earlier) = step.earlier.filter(|_| !self.joints.is_empty()) else { return };
        let (mut velocity, mut impulses) = std::mem::take(&mut self.ahead);
        let before = bodies.iter().filter_map(|body| earlier.states.get(*body));
        velocity.extend(self.members.iter().zip(before).map(|(member, before)| {
            let (now, before) = (member.old(), (before.velocity, before.spin));
            Velocity { linear: 2.0 * now.linear - before.0, spin: 2.0 * now.spin - before.1 }
        }));
        impulses.extend_from_slice(previous);
        let contacts = self.first_of_joints();
        for (now, before) in
            impulses[contacts..].iter_mut().zip(self.joint_impulses(&earlier.joints))
        {
            *now = 2.0 * *now - before;
        }
        if velocity.len() < self.members.len() {
            velocity.clear();
        }
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
        members.map(|(member, ahead)| member.way_from_old(ahead)).reduce(f64::max)
    }

    fn determined(&self) -> Option<Determined> {
        self.determined
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

    fn push(&self, index: usize, impulse: &Vector3<f64>, velocity: &mut Vec<Velocity>) {
        let link = &self.links[index];
        if let Kind::Gear(gear) = link.kind {
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
        for (member, velocity) in self.members.iter().zip(velocity) {
            member.rest(rest, velocity);
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
    ) -> Residual {
        let residuals = &mut scratch.residuals;
        self.motion(velocity, impulses, residuals);
        let mut size = Residual::default();
        for (member, residual) in self.members.iter().zip(&*residuals) {
            size.add(&residual.linear);
            size.add(&member.as_speed(&residual.spin));
        }
        size
    }

    fn point(&self, index: usize, velocity: &Vec<Velocity>) -> Vector3<f64> {
        self.point_at(index, velocity)
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
        let count = self.links.len() - self.gears.len();
        let couplings = self.links.iter().zip(&self.setting.couplings).take(count);
        points.extend(couplings.map(|(link, coupling)| {
            let b = link.b.as_ref().map(|other| &turnings[other.index]);
            self.point_velocity((link, coupling), velocity, (&turnings[link.a], b))
        }));
        // Gears come last: what they tie is known.
        for gear in &self.gears {
            points.push(gear.u(&self.setting.couplings, |index| points[index]));
        }
    }

    fn linearise(
        &self,
        at: Point<'_, Self>,
        mut answer: impl FnMut(usize, &Coupling, &Vector3<f64>) -> Option<Answer>,
        eliminations: &mut Vec<Elimination<IslandSlope>>,
        system: &mut IslandSystem,
    ) -> bool {
        let (blocks, turnings) = (&mut system.blocks, &at.scratch.turnings);
        blocks.begin(&self.pattern);
        for (index, (member, velocity)) in self.members.iter().zip(at.velocity).enumerate() {
            let mut diagonal = Matrix6::identity();
            let slope = member.angular_slope(&velocity.spin);
            diagonal.fixed_view_mut::<3, 3>(3, 3).copy_from(&slope);
            blocks.add(&self.pattern, (index, index), &diagonal);
        }
        eliminations.clear();
        let couplings = self.setting.couplings.iter().zip(at.points);
        for (index, ((coupling, u), link)) in couplings.zip(&self.links).enumerate() {
            let Some(answer) = answer(index, coupling, u) else { return false };
            let slope = match answer.gain {
                Gain::Zero => {
                    IslandSlope::Pair(PairSlope { a: (link.a, Matrix3x6::zeros()), b: None })
                }
                _ => self.slope((link, coupling), at.velocity, turnings),
            };
            let elimination = Elimination { answer, slope };
            self.add_gain((link, coupling), &elimination, blocks);
            eliminations.push(elimination);
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
        let IslandSystem { blocks, values } = system;
        values.clear();
        values.resize(self.members.len(), Vector6::zeros());
        for (index, residual) in scratch.residuals.iter().enumerate() {
            values[self.pattern.order.place(index)] = -stacked(residual);
        }
        let couplings = self.links.iter().zip(&self.setting.couplings);
        for (of, elimination) in couplings.zip(eliminations) {
            self.add_offset(of, &elimination.answer.offset, values);
        }
        blocks.solve::<false>(&self.pattern, values);
        step.clear();
        step.extend((0..self.members.len()).map(|index| {
            let x = &values[self.pattern.order.place(index)];
            Velocity { linear: x.fixed_rows::<3>(0).into(), spin: x.fixed_rows::<3>(3).into() }
        }));
        step.is_finite()
    }
}
