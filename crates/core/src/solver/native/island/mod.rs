//! Equations of several bodies in contact: six unknowns per body and a block of the linear system
//! for every coupled pair.
//!
//! All impulses of an island are divided by one mass M, the geometric mean of the bodies' masses.
//! The compliance (N6) is then equal for all contacts. Equation numbers refer to
//! `docs/native-solver.md`.

mod energy;
mod equations;
mod gears;
mod joints;
mod moments;
mod motion;
mod slopes;
mod tangent;

use super::body_equation::BodyEquation;
use super::coupling::{Coupling, approach};
use super::ellipsoid_motion::EllipsoidRows;
use super::equations::{Determined, Equations, MomentPlace, StepSetting, Velocity};
use super::islands::IslandView;
use super::round_motion::RoundRows;
use super::settings::SLOW;
use super::tolerances::Tolerances;
use crate::contact::{Contact, Curved, Partner, torque_map_of};
use crate::joint::Turn;
use crate::sparse::Pattern;
use crate::step::Step;
use crate::world::World;
use nalgebra::{Matrix3, Vector3};

use energy::Source;
pub(super) use equations::IslandSystem;
pub(super) use gears::IslandSlope;
use gears::Train;
pub(super) use joints::JointPlace;
use motion::{Both, LinkTurnings};
pub(super) use tangent::{GearTangent, StiffSide};

/// Bodies of the island that a coupling joins.
#[derive(Debug, Clone, Copy)]
struct CouplingLink {
    /// Index of A, or of any body of a gear.
    a: usize,
    kind: CouplingKind,
    /// B. `None` if fixed.
    b: Option<Other>,
    /// Contribution to the energy balance.
    source: Source,
}

/// Kind of a coupling, with its index in the list of that kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum CouplingKind {
    /// Point contact or joint anchor.
    Point,
    /// Two round features.
    Round(usize),
    /// Ellipsoid against a plane.
    Ellipsoid(usize),
    /// Rotation of a joint.
    Turn(usize),
    /// Moment of a contact.
    Moment,
    Gear(usize),
}

/// Coupling and the bodies that it joins.
#[derive(Debug, Clone, Copy)]
struct LinkedCoupling<'a> {
    link: &'a CouplingLink,
    coupling: &'a Coupling,
}

impl CouplingLink {
    /// True if the impulse acts as a force. The impulses of rotations and moments are torques only.
    fn pushes(&self) -> bool {
        !matches!(self.kind, CouplingKind::Turn(_) | CouplingKind::Moment)
    }
}

/// B of a coupling between two bodies.
#[derive(Debug, Clone, Copy)]
struct Other {
    index: usize,
    /// G_B (m): maps an impulse (world) at the touching point to its torque (frame of B).
    torque_map: Matrix3<f64>,
    /// r_A + A_A a − r_B at step k (m, world).
    arm: Vector3<f64>,
}

/// Step equations of the bodies of one island.
#[derive(Debug, Clone)]
pub(super) struct Island {
    time_step: f64,
    /// M (kg).
    mass: f64,
    members: Vec<BodyEquation>,
    setting: StepSetting,
    links: Vec<CouplingLink>,
    /// Additional data of couplings between two round features.
    rounds: Vec<RoundRows>,
    /// Additional data of couplings of an ellipsoid and a plane.
    ellipsoids: Vec<EllipsoidRows>,
    /// Rotations of joints.
    turns: Vec<Turn>,
    /// Moments of contacts, and ℓ (m) of each.
    moments: Vec<MomentPlace>,
    lengths: Vec<f64>,
    /// Joints of the island and their couplings.
    joints: Vec<JointPlace>,
    gears: Vec<Train>,
    /// Independence of the rows. `None` if they are dependent.
    determined: Option<Determined>,
    /// −V of all bodies at step k. Only with joints.
    back: Vec<Velocity>,
    /// V and p̂ extrapolated from the last two steps. Only with joints, and if both are known.
    ahead: (Vec<Velocity>, Vec<Vector3<f64>>),
    /// Speed below which kinetic energy is ignored (m/s).
    slow: f64,
    /// Share of the kinetic energy that is no gain ([`World::bent_share`]).
    bent: f64,
    /// Sparsity pattern of the linear system.
    pattern: Pattern,
}

impl Island {
    /// Empty island for steps of `world`.
    pub(super) fn new(world: &World) -> Self {
        Self {
            time_step: world.time_step(),
            mass: 1.0,
            members: Vec::new(),
            setting: StepSetting::new(Tolerances::new(world, 0.0, 0.0)),
            links: Vec::new(),
            rounds: Vec::new(),
            ellipsoids: Vec::new(),
            turns: Vec::new(),
            moments: Vec::new(),
            lengths: Vec::new(),
            joints: Vec::new(),
            gears: Vec::new(),
            determined: None,
            back: Vec::new(),
            ahead: (Vec::new(), Vec::new()),
            slow: SLOW * world.speed_scale(),
            bent: 0.0,
            pattern: Pattern::default(),
        }
    }

    /// Sets the step's constants for the bodies of `island`, without couplings.
    pub(super) fn begin(&mut self, step: &Step<'_>, island: &IslandView<'_>) {
        let (bodies, indices) = (step.world.bodies(), island.bodies);
        self.time_step = step.world.time_step();
        let logarithms: f64 = indices.iter().map(|&index| libm::log(bodies[index].mass())).sum();
        self.mass = libm::exp(logarithms / indices.len() as f64);
        self.members.clear();
        self.members.extend(indices.iter().map(|&index| BodyEquation::new(step, index, self.mass)));
        self.links.clear();
        self.rounds.clear();
        self.ellipsoids.clear();
        self.turns.clear();
        self.moments.clear();
        self.lengths.clear();
        self.joints.clear();
        self.gears.clear();
        self.back.clear();
        self.ahead.0.clear();
        self.ahead.1.clear();
        self.slow = SLOW * step.world.speed_scale();
        let bent = indices.iter().map(|&body| step.world.bent_share(body, &step.states[body]));
        self.bent = bent.fold(0.0, f64::max);
        let repeats_exactly = indices.len() == 1 || !island.joints.is_empty();
        let length = indices.iter().map(|&index| step.distance(index)).fold(0.0, f64::max);
        let tolerances = Tolerances::for_several(step.world, self.speed(), length, repeats_exactly);
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

    /// Bodies of the island, in order.
    pub(super) fn members(&self) -> &[BodyEquation] {
        &self.members
    }

    /// M (kg): the mass that impulses are divided by.
    pub(super) fn mass(&self) -> f64 {
        self.mass
    }

    /// Adds the couplings of `island`: contacts, their moments, joints and gears.
    pub(super) fn admit_all(
        &mut self,
        step: &Step<'_>,
        contacts: &[Contact],
        island: &IslandView<'_>,
    ) {
        let place = |body: usize| island.places[body];
        for contact in island.contacts.iter().map(|&index| &contacts[index]) {
            self.admit(contact, place);
            if let Some(tensor) = contact.friction_tensor(step.world, step.states) {
                self.setting.set_friction_tensor(&tensor);
            }
            if contact.has_law_offset(step.world) {
                self.carry(contact.law_offset(step.world, step.states));
            }
        }
        self.admit_moments(step, contacts, island.contacts);
        for &joint in island.joints {
            self.admit_joint(step, joint, place);
        }
        for &gear in island.gears {
            self.admit_gear(step, gear);
        }
        self.tie();
    }

    /// Adds a contact. `place` maps a body of the world to its index in the island.
    pub(super) fn admit(&mut self, contact: &Contact, place: impl Fn(usize) -> usize) {
        let a = place(contact.key.body);
        // Lever on B: the same point of the world as on A.
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
        let approach = approach(contact, h, level);
        let carried = Vector3::zeros();
        let kind = match contact.features.curved {
            None => CouplingKind::Point,
            Some(Curved::Cores(curved)) => {
                self.rounds.push(RoundRows {
                    curved,
                    offset_vector: contact.offset_vector(),
                    approach,
                    carried,
                });
                CouplingKind::Round(self.rounds.len() - 1)
            }
            // c − r_A, y and the foot b of (N14a), at k.
            Some(Curved::Ellipsoid(point)) => {
                let member = &self.members[a];
                let beyond = contact.arm - member.rotation * point.shape.centre;
                let (arm, foot) = b.as_ref().map_or_else(Default::default, |other| {
                    let of_b = &self.members[other.index];
                    let touched = member.position + contact.arm - of_b.position;
                    (touched - beyond, of_b.rotation.tr_mul(&touched))
                });
                let normal = contact.features.frame.column(2).into_owned();
                let rows = EllipsoidRows { point, normal, beyond, arm, foot, approach, carried };
                self.ellipsoids.push(rows);
                CouplingKind::Ellipsoid(self.ellipsoids.len() - 1)
            }
        };
        self.links.push(CouplingLink { a, kind, b, source: Source::Contact });
        let share = self.members[a].share;
        self.setting.admit(Coupling::from_contact(contact, h, share, level));
    }

    /// Sets the surface velocity `carried` of the contact added last (m/s, world).
    pub(super) fn carry(&mut self, carried: Vector3<f64>) {
        self.setting.carry(&carried);
        match self.links.last().map(|link| link.kind) {
            Some(CouplingKind::Round(round)) => self.rounds[round].carried = carried,
            Some(CouplingKind::Ellipsoid(one)) => self.ellipsoids[one].carried = carried,
            _ => {}
        }
    }

    /// Completes the island: all couplings have been added.
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

    /// Index of the first joint coupling. Contacts come first, then their moments.
    fn first_of_joints(&self) -> usize {
        self.links.iter().take_while(|link| link.source == Source::Contact).count()
    }

    /// Classifies the independence of the rows.
    ///
    /// Rows of a joint tree that spans all bodies are independent. With contacts or gears they may
    /// be. More joints than bodies form a loop.
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
