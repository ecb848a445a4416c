//! Gears of an island as couplings of one row with up to four bodies.
//!
//! The row of a gear is a sum of rows of other couplings, u = Σ c u_i + q̇₀. These are the anchors
//! and rotations of its joints, rigid or under a drive. The derivatives are the same sum, and the
//! impulse acts on each of these rows. Equation numbers refer to `docs/joints.md`.

use super::{Both, CouplingKind, CouplingLink, GearTangent, Island, Source};
use crate::joint::{Axis, AxisStart, Drive, GearAxis, JointAxis};
use crate::solver::native::coupling::Coupling;
use crate::solver::native::equations::{Slope, Velocity};
use crate::solver::native::law::{AxesLaw, CouplingLaw};
use crate::solver::native::pair_motion::{PairSlope, stacked};
use crate::step::{Step, StepSolution};
use nalgebra::{Matrix3, RowVector6, Vector3, Vector6};

/// Largest number of bodies of a gear.
const MOST: usize = 4;

/// Values for up to four different bodies.
#[derive(Debug, Clone, Copy)]
struct Bodies<T> {
    of: [(usize, T); MOST],
    count: usize,
}

impl<T: Copy + std::ops::AddAssign> Bodies<T> {
    fn none(zero: T) -> Self {
        Self { of: [(0, zero); MOST], count: 0 }
    }

    /// Adds to the value of a body.
    fn add(&mut self, body: usize, more: T) {
        match self.of[..self.count].iter_mut().find(|(known, _)| *known == body) {
            Some((_, sum)) => *sum += more,
            None => {
                self.of[self.count] = (body, more);
                self.count += 1;
            }
        }
    }

    fn iter(&self) -> impl Iterator<Item = (usize, T)> + '_ {
        self.of[..self.count].iter().copied()
    }
}

/// Gear of the island.
#[derive(Debug, Clone, Copy)]
pub(super) struct Train {
    /// Index in the world.
    gear: usize,
    /// Coupling, row and factor c of each coordinate.
    parts: [(usize, usize, f64); 2],
    /// q̇₀: position error at the start of the step, over h (m/s). Zero under a drive.
    offset: f64,
    /// ℓ of the first coordinate.
    length: f64,
    /// Change of each body's momentum by a unit impulse, over the body's mass.
    sides: Bodies<Vector6<f64>>,
}

impl Train {
    /// Row of the gear, with the index of its coupling.
    pub(super) fn row(&self, coupling: usize) -> GearTangent {
        let Self { gear, parts, offset, length, .. } = *self;
        GearTangent { coupling, gear, parts, offset, length }
    }

    /// Bodies of the gear and the effect of a unit impulse: M/m times force and torque.
    pub(super) fn sides(&self) -> impl Iterator<Item = (usize, Vector6<f64>)> + '_ {
        self.sides.iter()
    }

    /// All pairs of its bodies.
    pub(super) fn pairs(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        let bodies = || self.sides().map(|(body, _)| body);
        bodies().flat_map(move |a| bodies().filter(move |b| a < *b).map(move |b| (a, b)))
    }

    /// u of the gear in the first of three rows, from u of the other couplings in `points`.
    pub(super) fn u(
        &self,
        couplings: &[Coupling],
        points: impl Fn(usize) -> Vector3<f64>,
    ) -> Vector3<f64> {
        let along = |&(coupling, row, factor): &(usize, usize, f64)| {
            factor * couplings[coupling].rows.frame.column(row).dot(&points(coupling))
        };
        Vector3::x() * (self.offset + self.parts.iter().map(along).sum::<f64>())
    }
}

/// ∂u/∂V of a coupling of an island.
#[derive(Debug, Clone, Copy)]
pub(crate) enum IslandSlope {
    /// One or two bodies.
    Pair(PairSlope),
    Gear(GearSlope),
}

impl IslandSlope {
    /// Slope of a coupling that does not depend on the velocities.
    pub(super) const NONE: Self = Self::Pair(PairSlope::NONE);
}

#[derive(Debug, Clone, Copy)]
pub(crate) struct GearSlope(Bodies<RowVector6<f64>>);

impl GearSlope {
    pub(super) fn bodies(&self) -> impl Iterator<Item = (usize, RowVector6<f64>)> + '_ {
        self.0.iter()
    }
}

impl Slope for IslandSlope {
    type Velocity = Vec<Velocity>;

    #[inline]
    fn velocity_change(&self, change: &Vec<Velocity>) -> Vector3<f64> {
        match self {
            Self::Pair(slope) => slope.velocity_change(change),
            Self::Gear(slope) => {
                let by =
                    |(body, slope): (usize, RowVector6<f64>)| slope.tr_dot(&stacked(&change[body]));
                Vector3::x() * slope.bodies().map(by).sum::<f64>()
            }
        }
    }
}

impl Island {
    /// Adds gear `index` of the world, whose joints the island has.
    pub(crate) fn admit_gear(&mut self, step: &Step<'_>, index: usize) {
        let gear = &step.world.gears()[index];
        let length = gear.length(step.world.joints(), step.world.bodies());
        // Coupling, row, length and coordinate of an axis.
        let found = |GearAxis { joint, axis }: GearAxis| {
            let place = self.joints.binary_search_by_key(&joint, |at| at.joint).ok()?;
            let at = &self.joints[place];
            Some(match axis {
                JointAxis::Linear(k) => (at.place?, k, 1.0, at.along[k]),
                JointAxis::Angular(k) => (at.turn?, k, at.length, at.angles[k]),
            })
        };
        let [first, second] = gear.axes().map(found);
        let (Some(first), Some(second)) = (first, second) else { return };
        // Row of the gear: u = ℓ (q₁⁺ − r q₂⁺ − q₀)/h (J15), as a sum of the rows of its axes
        let parts = [
            (first.0, first.1, length / first.2),
            (second.0, second.1, -gear.ratio() * length / second.2),
        ];
        let (law, sum) = (gear.law(), gear.missed([first.3, second.3]));
        let offset = length * law.offset(sum, self.time_step);
        // Wrench of a unit impulse on each body
        let mut sides = Bodies::none(Vector6::zeros());
        for (coupling, row, factor) in parts {
            let linked = self.linked(coupling);
            let along = linked.coupling.rows.frame.column(row) * factor;
            for (body, share, torque_map) in self.sides(linked) {
                let force = if linked.link.pushes() { along } else { Vector3::zeros() };
                let torque = torque_map * along;
                let (f, t) = (force * share, torque * share);
                sides.add(body, Vector6::new(f[0], f[1], f[2], t[0], t[1], t[2]));
            }
        }
        // Speed of the row by a unit impulse along it
        let response: f64 = sides
            .iter()
            .map(|(body, wrench)| {
                let member = &self.members[body];
                let torque = wrench.fixed_rows::<3>(3);
                let turned = torque.dot(&(member.inertia_inverse * torque));
                (wrench.fixed_rows::<3>(0).norm_squared() + turned) / member.share
            })
            .sum();
        let idle = Axis::Free(Drive::NONE).graph(&AxisStart::default(), 1.0, 1.0, 1.0);
        let own = law.free_graph(&gear.start(sum), self.time_step, length, self.mass);
        let axes = AxesLaw::new(&mut self.setting.graphs, false, |k| match k {
            0 => own,
            _ => Some(idle),
        });
        let kind = CouplingKind::Gear(self.gears.len());
        let source = Source::Drives([gear.drive().is_some(), false, false]);
        let a = self.links[parts[0].0].a;
        self.links.push(CouplingLink { a, kind, b: None, source });
        self.gears.push(Train { gear: index, parts, offset, length, sides });
        let response = Vector3::repeat(response);
        self.setting.admit(Coupling::from_turn(
            Matrix3::zeros(),
            &response,
            CouplingLaw::Axes(axes),
        ));
    }

    /// ∂u/∂V of a gear: sum of the slopes of its parts.
    pub(super) fn gear_slope(
        &self,
        gear: usize,
        velocity: &[Velocity],
        turnings: &[Both],
    ) -> GearSlope {
        let mut sum = Bodies::none(RowVector6::zeros());
        for (coupling, row, factor) in self.gears[gear].parts {
            let linked = self.linked(coupling);
            let slope = self.pair_slope(linked, velocity, turnings);
            let along = linked.coupling.rows.frame.column(row).transpose() * factor;
            for (body, slope) in std::iter::once(&slope.a).chain(&slope.b) {
                sum.add(*body, along * slope);
            }
        }
        GearSlope(sum)
    }

    /// Impulses p̂ of the gears from their forces in the last step, in order (m/s).
    pub(super) fn gear_impulses<'a>(
        &'a self,
        step: &'a Step<'_>,
    ) -> impl Iterator<Item = Vector3<f64>> + 'a {
        let to_impulse = self.time_step / self.mass;
        self.gears.iter().map(move |train| {
            let force = step.previous.gears.get(train.gear).copied().unwrap_or(0.0);
            Vector3::x() * (force * to_impulse / train.length)
        })
    }

    /// Writes the forces of the gears from the impulses of all couplings, those of the last step if it
    /// `keeps` them.
    pub(crate) fn write_gears(
        &self,
        step: &Step<'_>,
        impulses: &[Vector3<f64>],
        keeps: bool,
        solution: &mut StepSolution,
    ) {
        let first = self.links.len() - self.gears.len();
        for (place, train) in self.gears.iter().enumerate() {
            let coupling = first + place;
            let known = step.previous.gears.get(train.gear).filter(|_| keeps);
            let force = impulses[coupling][0] * self.mass / self.time_step * train.length;
            if let Some(of_gear) = solution.gears.get_mut(train.gear) {
                *of_gear = known.copied().unwrap_or(force);
            }
        }
    }
}
