//! The equations of several bodies that touch each other: six unknowns a body, a block of the
//! linear system for every pair that touches.
//!
//! Impulses are divided by one mass M for all bodies of the island, the geometric mean of
//! theirs, so that equal compliance in (N6) is equal for all contacts whatever they join.
//! Equation numbers are those of `docs/native-solver.md`.

mod energy;
mod equations;
mod gears;
mod joints;
mod motion;
mod slopes;
mod tangent;

use super::coupling::{Coupling, approach};
use super::equations::{Determined, Equations, StepSetting, Velocity};
use super::islands::IslandView;
use super::member::IslandBody;
use super::pattern::Pattern;
use super::round_motion::RoundRows;
use super::settings::SLOW;
use super::tolerances::Tolerances;
use crate::contact::{Contact, Partner, torque_map_of};
use crate::joint::Turn;
use crate::step::Step;
use crate::world::World;
use nalgebra::{Matrix3, Vector3};

use energy::Source;
pub(super) use equations::IslandSystem;
pub(super) use gears::IslandSlope;
use gears::Train;
pub(super) use joints::JointPlace;
use motion::{Both, LinkTurnings};
pub(super) use tangent::{GearTangent, HeldSide};

/// Which bodies of the island a coupling joins.
#[derive(Debug, Clone, Copy)]
struct CouplingLink {
    /// A; of a gear one of its bodies.
    a: usize,
    kind: CouplingKind,
    /// B, where it is no fixed thing.
    b: Option<Other>,
    /// What it has to do with energy.
    source: Source,
}

/// What a coupling is of, with its place among those of its kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum CouplingKind {
    /// A point.
    Point,
    /// Two round features.
    Round(usize),
    /// The turn of a joint.
    Turn(usize),
    /// A gear.
    Gear(usize),
}

/// A coupling and the bodies that it joins.
#[derive(Debug, Clone, Copy)]
struct LinkedCoupling<'a> {
    link: &'a CouplingLink,
    coupling: &'a Coupling,
}

impl CouplingLink {
    /// Whether the impulse is one of forces; that of a turn is one of torques alone.
    fn pushes(&self) -> bool {
        !matches!(self.kind, CouplingKind::Turn(_))
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
    members: Vec<IslandBody>,
    setting: StepSetting,
    links: Vec<CouplingLink>,
    /// What couplings of two round features have beyond others.
    rounds: Vec<RoundRows>,
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
            setting: StepSetting::new(Tolerances::of(world, 0.0)),
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

    /// Sets the step's constants for the bodies of `island`; no couplings yet.
    pub(super) fn begin(&mut self, step: &Step<'_>, island: &IslandView<'_>) {
        let (bodies, indices) = (step.world.bodies(), island.bodies);
        self.time_step = step.world.time_step();
        let logarithms: f64 = indices.iter().map(|&index| libm::log(bodies[index].mass())).sum();
        self.mass = libm::exp(logarithms / indices.len() as f64);
        self.members.clear();
        self.members.extend(indices.iter().map(|&index| IslandBody::new(step, index, self.mass)));
        self.links.clear();
        self.rounds.clear();
        self.turns.clear();
        self.joints.clear();
        self.gears.clear();
        self.back.clear();
        self.ahead.0.clear();
        self.ahead.1.clear();
        self.slow = SLOW * step.world.speed_scale();
        let repeats_exactly = indices.len() == 1 || !island.joints.is_empty();
        let tolerances = Tolerances::of_several(step.world, self.speed(), repeats_exactly);
        self.setting.begin(tolerances, island.unsettled);
    }

    /// Coupling `index` with its bodies.
    fn linked(&self, index: usize) -> LinkedCoupling<'_> {
        LinkedCoupling { link: &self.links[index], coupling: &self.setting.couplings[index] }
    }

    /// All couplings with their bodies.
    fn all_linked(&self) -> impl Iterator<Item = LinkedCoupling<'_>> {
        let couplings = self.links.iter().zip(&self.setting.couplings);
        couplings.map(|(link, coupling)| LinkedCoupling { link, coupling })
    }

    /// Its bodies, in their order.
    pub(super) fn members(&self) -> &[IslandBody] {
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
        let kind = contact.features.curved.map_or(CouplingKind::Point, |curved| {
            let approach = approach(contact, h, level);
            let (way, carried) = (contact.way(), Vector3::zeros());
            self.rounds.push(RoundRows { curved, way, approach, carried });
            CouplingKind::Round(self.rounds.len() - 1)
        });
        self.links.push(CouplingLink { a, kind, b, source: Source::Contact });
        let share = self.members[a].share;
        self.setting.admit(Coupling::of_contact(contact, h, share, level));
    }

    /// Has surfaces carry what touches at the contact that was admitted last with `carried` (m/s, world).
    pub(super) fn carry(&mut self, carried: Vector3<f64>) {
        self.setting.carry(&carried);
        if let Some(CouplingKind::Round(round)) = self.links.last().map(|link| link.kind) {
            self.rounds[round].carried = carried;
        }
    }

    /// Ties the bodies by the couplings that were admitted: no more are to come.
    pub(super) fn tie(&mut self) {
        let pair = |link: &CouplingLink| link.b.as_ref().map(|other| (link.a, other.index));
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
}
