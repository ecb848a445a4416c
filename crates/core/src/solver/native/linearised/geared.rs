//! Linearised gear rows, rigid or under a drive of the sum of their coordinates.
//!
//! The derivatives are by the initial states, the ratio, the offset and the joints' anchors. The
//! row of a gear is a sum of joint rows, and so are its derivatives. At fixed V⁺ and impulse p̂
//! along it
//!
//! ```text
//! δu = −ℓ/h (q₂⁺ δr + δq₀),   along the row of the second coordinate δp̂₂ = −ℓ/ℓ₂ p̂ δr      (G15)
//! ```
//!
//! Under a drive the row is s⁺ − s, without q₀. The drive responds to s = q₁ − r q₂ − q₀ like the
//! drive of a joint to its coordinate (G10):
//!
//! ```text
//! δu = −ℓ/h (q₂⁺ − q₂) δr,   δs = −q₂ δr − δq₀                                               (G17)
//! ```
//!
//! Equation numbers refer to `docs/gradients.md`.

use super::constants::{add_anchors, anchors_of};
use super::slopes::RowsChange;
use super::tied::{AxisSlots, LinearRows, Slots, SolvedRows, TiedRow, TiedRowLaw};
use crate::derivative::{JointTangent, RowsTangent, StateChange};
use crate::joint::{AxisChange, GearAxis, JointAxis};
use crate::mechanics::State;
use crate::solver::native::island::{GearTangent, Island, JointPlace};
use crate::step::Step;
use crate::world::Constant;
use nalgebra::{Matrix3, RowSVector, SVector, Vector3};

/// Change of a gear row: its motion and its impulse (m/s).
#[derive(Debug, Clone, Copy, Default)]
struct Along {
    motion: f64,
    impulse: f64,
}

impl Along {
    fn times(self, factor: f64) -> Self {
        Self { motion: self.motion * factor, impulse: self.impulse * factor }
    }

    fn plus(self, other: Self) -> Self {
        Self { motion: self.motion + other.motion, impulse: self.impulse + other.impulse }
    }

    fn dot(self, by: &RowsChange<1>) -> f64 {
        self.motion * by.motion[0] + self.impulse * by.impulse[0]
    }

    fn rows(self) -> RowsChange<1> {
        let (motion, impulse) = (Vector3::x() * self.motion, Vector3::x() * self.impulse);
        RowsChange { motion, impulse, ..RowsChange::zero() }
    }
}

/// Derivatives of a gear row with respect to C numbers: motion and impulse.
#[derive(Debug, Clone, Copy)]
struct AlongRow<const C: usize> {
    motion: RowSVector<f64, C>,
    impulse: RowSVector<f64, C>,
}

impl<const C: usize> AlongRow<C> {
    fn zero() -> Self {
        Self { motion: RowSVector::zeros(), impulse: RowSVector::zeros() }
    }

    /// Combines the direct motion of the row with the response of its drive to the `sum`.
    fn new(motion: RowSVector<f64, C>, sum: RowSVector<f64, C>, local_solution: Along) -> Self {
        Self { motion: motion + sum * local_solution.motion, impulse: sum * local_solution.impulse }
    }

    fn columns<const N: usize>(&self, first: usize) -> AlongRow<N> {
        let (motion, impulse) = (&self.motion, &self.impulse);
        AlongRow {
            motion: motion.fixed_columns::<N>(first).into(),
            impulse: impulse.fixed_columns::<N>(first).into(),
        }
    }

    fn jvp(&self, by: &SVector<f64, C>) -> Along {
        Along { motion: self.motion.tr_dot(by), impulse: self.impulse.tr_dot(by) }
    }

    fn vjp(&self, by: &RowsChange<1>) -> SVector<f64, C> {
        self.motion.transpose() * by.motion[0] + self.impulse.transpose() * by.impulse[0]
    }
}

/// Linearised gear row, by the poses of the bodies of its two coordinates.
#[derive(Debug, Clone)]
pub(super) struct LinearGear {
    pub(super) coupling: usize,
    by_pose: [([Option<usize>; 2], AlongRow<12>); 2],
    by_time_step: Along,
    /// Index of the gear in the world.
    gear: usize,
    by_ratio: Along,
    by_offset: Along,
    /// Coupling of the second coordinate, and its impulse by the ratio (m/s, world).
    turned: (usize, Vector3<f64>),
    /// Derivatives with respect to the anchors of both joints, with the joints' indices.
    by_anchors: [(usize, AlongRow<6>); 2],
}

/// Three linearised rows of a joint, from which gear rows are summed.
pub(super) struct TiedRows {
    pub(super) coupling: usize,
    pub(super) joint: usize,
    pub(super) bodies: [Option<usize>; 2],
    /// ℓ (m).
    pub(super) length: f64,
    /// Joint angles at the start of the step (rad).
    pub(super) angles: Vector3<f64>,
    /// Axes of the rows.
    pub(super) frame: Matrix3<f64>,
    pub(super) of: RowsTangent,
}

impl LinearGear {
    /// Linearises the row u = ℓ (q₁⁺ − r q₂⁺ − q₀)/h of a gear under the `impulse` p̂.
    ///
    /// The coordinates are rows of the joints in `tangents`. A drive of the sum has the `law` at
    /// the initial sum. `next` are the states at the end of the step.
    pub(super) fn new(
        row: &GearTangent,
        tangents: &[TiedRows],
        law: &dyn Fn(f64) -> TiedRowLaw,
        step: &Step<'_>,
        next: &[State],
        impulse: f64,
    ) -> Option<Self> {
        let (h, joints) = (step.world.time_step(), step.world.joints());
        let gear = step.world.gears().get(row.gear)?;
        let tied = |part: usize| {
            let (coupling, ..) = row.parts[part];
            tangents.iter().find(|tied| tied.coupling == coupling)
        };
        let (first, second) = (tied(0)?, tied(1)?);
        let [one, two] = gear.axes();
        let start =
            |axis: &GearAxis, tied: &TiedRows| axis.coordinate(joints, step.states, &tied.angles);
        let (q1, q2) = (start(one, first), start(two, second));
        let end = two.coordinate(joints, next, &second.angles);
        // Response to the sum of coordinates. A rigid gear has none: its row contains the whole
        // sum.
        let law = gear.drive().map(|_| law(gear.missed([q1, q2])));
        let local_solution = |change: &AxisChange| {
            law.map_or(Along::default(), |law| {
                let (motion, impulse) = law.local_solution(change);
                Along { motion, impulse }
            })
        };
        // A rigid row counts the coordinates at k once more, by 1/h.
        let to_sum = local_solution(&AxisChange { coordinate: 1.0, ..AxisChange::default() });
        let counted = if law.is_some() { 0.0 } else { 1.0 / h };
        let mut by_time_step =
            local_solution(&AxisChange { time_step: 1.0, ..AxisChange::default() });
        by_time_step.motion -= row.offset / h;
        // Columns of one coordinate: those of its joint's row, times its factor in the sum
        let mut of_part = |(_, k, factor): (usize, usize, f64), tied: &TiedRows| {
            let rows = &tied.of;
            let whole = tied.length * counted;
            let part = tied.length / row.length * factor;
            by_time_step.motion += factor * rows.by_time_step[k];
            let motion = (rows.motion.row(k) + rows.coordinates.row(k) * whole) * factor;
            let slopes = AlongRow::new(motion, rows.coordinates.row(k) * part, to_sum);
            let by_anchors = rows.anchors.as_ref().map_or_else(AlongRow::zero, |rows| {
                let motion = (rows.motion.row(k) + rows.coordinates.row(k) * whole) * factor;
                AlongRow::new(motion, rows.coordinates.row(k) * part, to_sum)
            });
            ((tied.bodies, slopes), (tied.joint, by_anchors))
        };
        let [a, b] = [of_part(row.parts[0], first), of_part(row.parts[1], second)];
        let (by_pose, by_anchors) = ([a.0, b.0], [a.1, b.1]);
        // By the ratio and the offset (G15), or of a sum (G17)
        let (coupling, k, _) = row.parts[1];
        let turned = second.frame.column(k) * (-row.length / second.length * impulse);
        let went = if law.is_some() { end - q2 } else { end };
        let by_ratio = Along { motion: -row.length / h * went, impulse: 0.0 };
        let by_offset = Along { motion: -row.length * counted, impulse: 0.0 };
        Some(Self {
            coupling: row.coupling,
            by_pose,
            by_time_step,
            gear: row.gear,
            by_ratio: by_ratio.plus(to_sum.times(-q2)),
            by_offset: by_offset.plus(to_sum.times(-1.0)),
            turned: (coupling, turned),
            by_anchors,
        })
    }

    pub(super) fn pushed(&self, states: &[StateChange]) -> RowsChange<1> {
        let mut along = Along::default();
        for (bodies, row) in &self.by_pose {
            for (side, body) in bodies.iter().enumerate() {
                let Some(state) = body.map(|body| &states[body]) else { continue };
                along = along
                    .plus(row.columns::<3>(6 * side).jvp(&state.position))
                    .plus(row.columns::<3>(6 * side + 3).jvp(&state.turn));
            }
        }
        along.rows()
    }

    /// Derivative of the row with respect to the pose of a body of the world.
    pub(super) fn jacobian_wrt_state(&self, body: usize) -> Option<RowsChange<6>> {
        let mut found = None;
        for (bodies, row) in &self.by_pose {
            for side in (0..2).filter(|side| bodies[*side] == Some(body)) {
                let columns = found.get_or_insert_with(RowsChange::<6>::zero);
                let own = row.columns::<6>(6 * side);
                let mut part = columns.motion.row_mut(0);
                part += own.motion;
                let mut part = columns.impulse.row_mut(0);
                part += own.impulse;
            }
        }
        found
    }

    /// Changes of the gear's own row and of the coupling that the ratio acts on, each with its
    /// index.
    pub(super) fn jvp_wrt_constants(
        &self,
        of: &impl Fn(Constant, usize) -> f64,
    ) -> [(usize, RowsChange<1>); 2] {
        let moved = self.by_anchors.iter().map(|(joint, row)| row.jvp(&anchors_of(*joint, of)));
        let ratio = of(Constant::GearRatio, self.gear);
        let own = moved
            .fold(Along::default(), Along::plus)
            .plus(self.by_time_step.times(of(Constant::TimeStep, 0)))
            .plus(self.by_ratio.times(ratio))
            .plus(self.by_offset.times(of(Constant::GearOffset, self.gear)));
        let (coupling, turned) = self.turned;
        let other = RowsChange { impulse: turned * ratio, ..RowsChange::zero() };
        [(self.coupling, own.rows()), (coupling, other)]
    }

    /// Adds the transposed product: derivatives with respect to states.
    pub(super) fn vjp(&self, by: &RowsChange<1>, states: &mut [StateChange]) {
        for (bodies, row) in &self.by_pose {
            for (side, body) in bodies.iter().enumerate() {
                let Some(state) = body.map(|body| &mut states[body]) else { continue };
                state.position += row.columns::<3>(6 * side).vjp(by);
                state.turn += row.columns::<3>(6 * side + 3).vjp(by);
            }
        }
    }

    /// Adds the transposed product: derivatives with respect to `constants`. `pulled` returns the
    /// derivatives with respect to the rows of a coupling.
    pub(super) fn pull_constants(
        &self,
        pulled: impl Fn(usize) -> RowsChange<1>,
        constants: &[Constant],
        sums: &mut [Vec<f64>],
    ) {
        let by = pulled(self.coupling);
        for (&constant, sums) in constants.iter().zip(sums) {
            match constant {
                Constant::TimeStep => sums[0] += self.by_time_step.dot(&by),
                Constant::GearOffset => sums[self.gear] += self.by_offset.dot(&by),
                Constant::GearRatio => {
                    let (coupling, turned) = &self.turned;
                    let turned = pulled(*coupling).impulse.dot(turned);
                    sums[self.gear] += self.by_ratio.dot(&by) + turned;
                }
                Constant::Anchor => {
                    for (joint, row) in &self.by_anchors {
                        add_anchors(*joint, &row.vjp(&by), sums);
                    }
                }
                _ => {}
            }
        }
    }
}

/// End of a step.
pub(super) struct TiedEnds<'a, V: Fn(usize) -> (Vector3<f64>, Vector3<f64>)> {
    /// v⁺ and ω⁺ of a body of the world.
    pub(super) velocity: V,
    /// X⁺ of all bodies of the world.
    pub(super) next: &'a [State],
}

/// Linearises the rows of an island's joints and gears.
pub(super) fn linearise(
    step: &Step<'_>,
    island: &Island,
    solved: &SolvedRows<'_>,
    slots: &Slots,
    ends: TiedEnds<'_, impl Fn(usize) -> (Vector3<f64>, Vector3<f64>)>,
    rows: &mut Vec<LinearRows>,
    gears: &mut Vec<LinearGear>,
) {
    let TiedEnds { velocity, next } = ends;
    rows.clear();
    gears.clear();
    // All joint rows, in the order of their couplings.
    let mut tangents: Vec<TiedRows> = Vec::new();
    for place in island.joint_places() {
        let JointPlace { joint: number, place: at_place, turn, length, angles, .. } = place;
        let joint = &step.world.joints()[*number];
        let bodies = [Some(joint.body()), joint.other()];
        let map = step.world.step_map();
        let h = map.time_step;
        let velocities = bodies.map(|body| body.map(&velocity));
        let tangent = JointTangent::new(joint, step.states, &map, velocities);
        let Some(at) = joint.coordinates(step.states) else { continue };
        // Coordinates and rates with which the axes begin
        let starts = joint.starts_with_rates(step.states, &at, angles, &map);
        let acting = joint.acting_axes();
        let own = [
            at_place.map(|coupling| (coupling, 1.0, joint.linear(), &starts[0])),
            turn.map(|coupling| (coupling, *length, &*acting, &starts[1])),
        ];
        for (about, (coupling, length, axes, starts)) in
            own.into_iter().enumerate().filter_map(|(about, own)| own.map(|own| (about == 1, own)))
        {
            let frame = *island.rows(coupling);
            let impulse = frame.tr_mul(&(solved.impulses[coupling]))
                + island.geared(coupling, solved.impulses);
            let of = if about {
                tangent.turn_rows(angles, length, &impulse)
            } else {
                Some(tangent.place_rows(&impulse))
            };
            let Some(of) = of else { continue };
            let law = |k: usize| {
                let axis = if about { JointAxis::Angular(k) } else { JointAxis::Linear(k) };
                let row = TiedRow { coupling, k, length };
                let own = slots.axis_slots(*number, axis);
                TiedRowLaw::new(solved, island, row, &axes[k], &starts[k], h, own)
            };
            let laws = [law(0), law(1), law(2)];
            rows.push(LinearRows::new(coupling, *number, bodies, &of, frame, laws));
            let (joint, angles) = (*number, *angles);
            tangents.push(TiedRows { coupling, joint, angles, bodies, length, frame, of });
        }
    }
    // Rows of gears are sums of the rows of their joints.
    for row in island.gear_rows() {
        let impulse = solved.impulses[row.coupling][0];
        let law = |sum: f64| {
            let gear = &step.world.gears()[row.gear];
            let (h, none) = (step.world.time_step(), AxisSlots::default());
            let tied_row = TiedRow { coupling: row.coupling, k: 0, length: row.length };
            TiedRowLaw::new(solved, island, tied_row, gear.law(), &gear.start(sum), h, none)
        };
        gears.extend(LinearGear::new(&row, &tangents, &law, step, next, impulse));
    }
}
