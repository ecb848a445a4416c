//! What joints and gears hold, linearised by the states at the start of the step by the constants of
//! their drives, and by their anchors.
//!
//! At fixed V⁺ the impulse along row k of a joint changes by what its piece asks for (J5), with ε the compliance,
//!
//! ```text
//! where it is vertical δp̂ = −(δu − δu₀)/ε,   of p = v − s u δp̂ = (δv − û δs − s δu)/(1 + ε s)        (G10)
//! ```
//!
//! and the impulse acts where and how its bodies have it then. Equation numbers are those of `docs/gradients.md`.

use super::super::island::{GearRow, Island, JointPlace};
use super::super::law::Piece;
use super::slopes::{RowsChange, Slopes};
use crate::derivative::{JointTangent, RowsTangent, StateChange};
use crate::joint::{Axis, AxisChange, AxisStart, JointAxis, PieceChange, Segment};
use crate::step::Step;
use crate::world::{Constant, World};
use nalgebra::{Matrix3, RowSVector, SMatrix, Vector3, Vector6};

/// The impulse of three rows of a joint, linearised.
#[derive(Debug, Clone)]
pub(super) struct LinearRows {
    /// The coupling in the island.
    pub(super) coupling: usize,
    pub(super) slopes: Slopes,
    by_time_step: RowsChange<1>,
    /// The joint in the world, and by its anchors in A and in B.
    joint: usize,
    by_anchors: Option<Box<RowsChange<6>>>,
    /// The rows' axes, and what each answers to.
    frame: Matrix3<f64>,
    laws: [RowLaw; 3],
}

/// The row of a gear, linearised: its motion, by the poses of the bodies of its two coordinates.
#[derive(Debug, Clone)]
pub(super) struct LinearGear {
    pub(super) coupling: usize,
    by_pose: [([Option<usize>; 2], RowSVector<f64, 12>); 2],
    by_time_step: f64,
    /// By the anchors of the joints that have them.
    by_anchors: [(usize, RowSVector<f64, 6>); 2],
}

/// A row on a piece of its law.
#[derive(Debug, Clone, Copy)]
struct RowLaw {
    axis: Axis,
    start: AxisStart,
    time_step: f64,
    /// ℓ and M of the row's scale.
    scale: (f64, f64),
    /// û, or u₀ of a piece that is vertical; whether it is.
    at: (f64, bool),
    /// s; of what is vertical nothing.
    slope: f64,
    compliance: f64,
    limit: f64,
    /// Which of the world's axes with a drive it is, and which of those with a motor.
    slots: [Option<usize>; 2],
}

impl RowLaw {
    /// What a change of what its graph is made of makes of the motion along it, and of the impulse beside (G10), which does not
    /// give way where the limit is taken (G14).
    fn answer(&self, change: &AxisChange) -> (f64, f64) {
        let Self { axis, start, time_step, scale, at, slope, compliance, limit, .. } = self;
        match axis.piece_change(start, *time_step, *scale, *at, change) {
            PieceChange::Speed(faster) => (-faster, 0.0),
            PieceChange::Line(value, steeper) => {
                let impulse = (value - at.0 * steeper) / (1.0 + compliance * slope);
                (-limit * impulse, impulse)
            }
        }
    }

    /// The numbers of constants that are its own, as a change.
    fn given(&self, of: &impl Fn(Constant, usize) -> f64) -> Option<AxisChange> {
        let [axis, motor] = self.slots;
        let axis = axis?;
        let of_motor = |constant| motor.map_or(0.0, |motor| of(constant, motor));
        Some(AxisChange {
            friction: of(Constant::JointFriction, axis),
            stiffness: of(Constant::JointStiffness, axis),
            damping: of(Constant::JointDamping, axis),
            armature: of(Constant::Armature, axis),
            target: of_motor(Constant::MotorTarget),
            motor_stiffness: of_motor(Constant::MotorStiffness),
            motor_damping: of_motor(Constant::MotorDamping),
            most: of_motor(Constant::MotorMost),
            ..AxisChange::default()
        })
    }

    /// Its place among the numbers of a constant.
    fn slot(&self, constant: Constant) -> Option<usize> {
        match constant {
            of if of.is_of_motors() => self.slots[1],
            of if of.is_of_drives() => self.slots[0],
            _ => None,
        }
    }
}

/// The places of the axes of joints among the numbers of constants.
#[derive(Debug, Clone, Default)]
pub(super) struct Slots {
    /// Of all with a drive the joint, the axis and, of those with a motor, the place among these.
    axes: Vec<(usize, JointAxis, Option<usize>)>,
}

impl Slots {
    pub(super) fn set(&mut self, world: &World) {
        self.axes.clear();
        let mut motors = 0;
        for (joint, of) in world.joints().iter().enumerate() {
            for axis in of.driven_axes() {
                let has = of.drive(axis).is_some_and(|drive| drive.motor.is_some());
                self.axes.push((joint, axis, has.then_some(motors)));
                motors += usize::from(has);
            }
        }
    }

    /// How many numbers a constant of drives has.
    pub(super) fn width(&self, constant: Constant) -> usize {
        match constant {
            of if of.is_of_motors() => self.axes.iter().filter(|(.., has)| has.is_some()).count(),
            _ => self.axes.len(),
        }
    }

    /// That of an axis, and of its motor.
    fn of(&self, joint: usize, axis: JointAxis) -> [Option<usize>; 2] {
        let first = self.axes.partition_point(|(known, ..)| *known < joint);
        let own = self.axes[first..].iter().take_while(|(known, ..)| *known == joint);
        let found = own.enumerate().find(|(_, (_, known, _))| *known == axis);
        found.map_or([None; 2], |(place, (.., motor))| [Some(first + place), *motor])
    }
}

/// What of the solution the rows of an island are linearised at.
pub(super) struct Solved<'a> {
    pub(super) pieces: &'a [Piece],
    /// p̂ and u of every coupling, m/s, world.
    pub(super) impulses: &'a [Vector3<f64>],
    pub(super) points: &'a [Vector3<f64>],
    pub(super) compliance: f64,
    /// The same where its limit is taken, otherwise 0.
    pub(super) limit: f64,
}

impl Solved<'_> {
    /// The piece of row k of a coupling.
    fn segment(&self, island: &Island, coupling: usize, k: usize) -> Segment {
        let Piece::Axes(pieces) = self.pieces[coupling] else { return Segment::NONE };
        island.segment(coupling, k, pieces[k])
    }
}

/// Rows of a joint, of which gears may be made.
struct TiedRows {
    coupling: usize,
    joint: usize,
    bodies: [Option<usize>; 2],
    /// ℓ, m.
    length: f64,
    of: RowsTangent,
}

/// Linearises what joints and gears of an island hold; `velocity` has V⁺ of bodies of the world.
pub(super) fn linearise(
    step: &Step<'_>,
    island: &Island,
    (solved, slots): (&Solved<'_>, &Slots),
    velocity: impl Fn(usize) -> (Vector3<f64>, Vector3<f64>),
    (rows, gears): (&mut Vec<LinearRows>, &mut Vec<LinearGear>),
) {
    rows.clear();
    gears.clear();
    // By their couplings.
    let mut tangents: Vec<TiedRows> = Vec::new();
    for place in island.joint_places() {
        let JointPlace { joint: number, place: at_place, turn, length, angles, .. } = place;
        let joint = &step.world.joints()[*number];
        let bodies = [Some(joint.body()), joint.other()];
        let h = step.world.time_step();
        let velocities = bodies.map(|body| body.map(&velocity));
        let tangent = JointTangent::new(joint, step.states, h, velocities);
        let Some(at) = joint.coordinates(step.states) else { continue };
        let starts = joint.starts(step.states, (&at, angles), h);
        let own = [
            at_place.map(|coupling| (coupling, 1.0, joint.linear(), &starts[0])),
            turn.map(|coupling| (coupling, *length, joint.angular(), &starts[1])),
        ];
        for (about, (coupling, length, axes, starts)) in
            own.into_iter().enumerate().filter_map(|(about, own)| own.map(|own| (about == 1, own)))
        {
            let frame = *island.rows(coupling);
            let impulse = frame.tr_mul(&(solved.impulses[coupling]))
                + island.geared(coupling, solved.impulses);
            let of = match about {
                false => Some(tangent.of_place(&impulse)),
                true => tangent.of_turn((angles, length), &impulse),
            };
            let Some(of) = of else { continue };
            let law = |k: usize| {
                let on = solved.segment(island, coupling, k);
                let p = &solved.impulses[coupling];
                let u = frame.column(k).dot(&(solved.points[coupling] + p * solved.compliance));
                let axis = if about { JointAxis::Angular(k) } else { JointAxis::Linear(k) };
                RowLaw {
                    axis: axes[k],
                    start: starts[k],
                    time_step: h,
                    scale: (length, island.mass()),
                    at: if on.is_vertical() { (on.u, true) } else { (u, false) },
                    slope: if on.is_vertical() { 0.0 } else { -on.dp / on.du },
                    compliance: solved.compliance,
                    limit: solved.limit,
                    slots: slots.of(*number, axis),
                }
            };
            let laws = [law(0), law(1), law(2)];
            rows.push(LinearRows::new((coupling, *number), bodies, &of, (frame, laws)));
            tangents.push(TiedRows { coupling, joint: *number, bodies, length, of });
        }
    }
    for row in island.gear_rows() {
        gears.extend(LinearGear::new(&row, &tangents, step));
    }
}

impl LinearRows {
    fn new(
        (coupling, joint): (usize, usize),
        bodies: [Option<usize>; 2],
        of: &RowsTangent,
        (frame, laws): (Matrix3<f64>, [RowLaw; 3]),
    ) -> Self {
        let mut slopes = Slopes::of(bodies);
        let (load, mut by_time_step) = (&of.load, RowsChange::<1>::zero());
        let pose = &mut slopes.by_pose;
        pose.motion = of.motion;
        pose.impulse.copy_from(&load.fixed_rows::<3>(0));
        pose.torques.copy_from(&load.fixed_rows::<6>(3));
        let mut by_anchors = of.anchors.as_ref().map(|anchors| {
            let (motion, torques) = (anchors.motion, anchors.torques);
            Box::new(RowsChange { motion, impulse: SMatrix::zeros(), torques })
        });
        let mut by_velocity = of.rates.as_ref().map(|_| Box::new(SMatrix::<f64, 6, 12>::zeros()));
        for (k, law) in laws.iter().enumerate() {
            let unit = AxisChange::default();
            // Adds rows, by columns, of which a change of one makes this answer.
            let mut add = |(motion, impulse): (f64, f64), by: RowSVector<f64, 12>, longer: f64| {
                let mut row = pose.motion.row_mut(k);
                row += by * motion;
                pose.impulse += frame.column(k) * (by * impulse);
                by_time_step.motion[k] += longer * motion;
                by_time_step.impulse += frame.column(k) * (longer * impulse);
            };
            let by_coordinate = law.answer(&AxisChange { coordinate: 1.0, ..unit });
            add(by_coordinate, of.coordinates.row(k).into(), 0.0);
            add((1.0, 0.0), RowSVector::zeros(), of.by_time_step[k]);
            add(law.answer(&AxisChange { time_step: 1.0, ..unit }), RowSVector::zeros(), 1.0);
            if let (Some(of), Some(slopes)) = (&of.anchors, &mut by_anchors) {
                for (unit, by) in [
                    (AxisChange { coordinate: 1.0, ..unit }, of.coordinates.row(k)),
                    (AxisChange { rate: 1.0, ..unit }, of.rates.row(k)),
                ] {
                    let (motion, impulse) = law.answer(&unit);
                    let mut row = slopes.motion.row_mut(k);
                    row += by * motion;
                    slopes.impulse += frame.column(k) * (by * impulse);
                }
            }
            if let (Some(rates), Some(slopes)) = (&of.rates, &mut by_velocity) {
                let (motion, impulse) = law.answer(&AxisChange { rate: 1.0, ..unit });
                add((motion, impulse), rates.by_poses.row(k).into(), rates.by_time_step[k]);
                let by = rates.by_velocities.row(k);
                let mut row = slopes.row_mut(k);
                row += by * motion;
                let mut part = slopes.fixed_rows_mut::<3>(3);
                part += frame.column(k) * (by * impulse);
            }
        }
        slopes.by_velocity = by_velocity;
        Self { coupling, slopes, by_time_step, joint, by_anchors, frame, laws }
    }

    /// By changes of constants.
    pub(super) fn by_constants(&self, of: &impl Fn(Constant, usize) -> f64) -> RowsChange<1> {
        let mut change = RowsChange::zero().plus(of(Constant::TimeStep, 0), &self.by_time_step);
        for (k, law) in self.laws.iter().enumerate() {
            let Some((motion, impulse)) = law.given(of).map(|given| law.answer(&given)) else {
                continue;
            };
            change.motion[k] += motion;
            change.impulse += self.frame.column(k) * impulse;
        }
        if let Some(slopes) = &self.by_anchors {
            let moved = anchors_of(self.joint, of);
            if moved != Vector6::zeros() {
                change.motion += slopes.motion * moved;
                change.impulse += slopes.impulse * moved;
                change.torques += slopes.torques * moved;
            }
        }
        change
    }

    /// The transpose.
    pub(super) fn pull_constants(
        &self,
        by: &RowsChange<1>,
        constants: &[Constant],
        sums: &mut [Vec<f64>],
    ) {
        let along = self.frame.tr_mul(&by.impulse);
        for (&constant, sums) in constants.iter().zip(sums) {
            if constant == Constant::TimeStep {
                sums[0] += by.dot(&self.by_time_step);
            }
            if let (Constant::Anchor, Some(slopes)) = (constant, &self.by_anchors) {
                let moved = slopes.motion.tr_mul(&by.motion)
                    + slopes.impulse.tr_mul(&by.impulse)
                    + slopes.torques.tr_mul(&by.torques);
                add_anchors(self.joint, &moved, sums);
            }
            for (k, law) in self.laws.iter().enumerate() {
                let Some(place) = law.slot(constant) else { continue };
                let unit = |of: Constant, _: usize| if of == constant { 1.0 } else { 0.0 };
                let Some((motion, impulse)) = law.given(&unit).map(|given| law.answer(&given))
                else {
                    continue;
                };
                sums[place] += by.motion[k] * motion + along[k] * impulse;
            }
        }
    }
}

impl LinearGear {
    /// The row u = ℓ (q₁⁺ − r q₂⁺ − q₀)/h of which the coordinates are rows of joints.
    fn new(row: &GearRow, tangents: &[TiedRows], step: &Step<'_>) -> Option<Self> {
        let h = step.world.time_step();
        let mut by_time_step = -row.offset / h;
        let mut of_part = |(coupling, k, factor): (usize, usize, f64)| {
            let tied = tangents.iter().find(|tied| tied.coupling == coupling)?;
            let (of, share) = (&tied.of, tied.length / h);
            by_time_step += factor * of.by_time_step[k];
            let slopes = (of.motion.row(k) + of.coordinates.row(k) * share) * factor;
            let by_anchors = of.anchors.as_ref().map_or_else(RowSVector::zeros, |of| {
                (of.motion.row(k) + of.coordinates.row(k) * share) * factor
            });
            Some(((tied.bodies, slopes), (tied.joint, by_anchors)))
        };
        let [a, b] = [of_part(row.parts[0])?, of_part(row.parts[1])?];
        let (by_pose, by_anchors) = ([a.0, b.0], [a.1, b.1]);
        Some(Self { coupling: row.coupling, by_pose, by_time_step, by_anchors })
    }

    /// A change of its motion alone.
    fn along(motion: f64) -> RowsChange<1> {
        RowsChange { motion: Vector3::x() * motion, ..RowsChange::zero() }
    }

    /// By changes of states.
    pub(super) fn pushed(&self, states: &[StateChange]) -> RowsChange<1> {
        let mut along = 0.0;
        for (bodies, row) in &self.by_pose {
            for (side, body) in bodies.iter().enumerate() {
                let Some(state) = body.map(|body| &states[body]) else { continue };
                along += row.fixed_columns::<3>(6 * side).tr_dot(&state.position)
                    + row.fixed_columns::<3>(6 * side + 3).tr_dot(&state.turn);
            }
        }
        Self::along(along)
    }

    /// By the pose of a body of the world.
    pub(super) fn by_state(&self, body: usize) -> Option<RowsChange<6>> {
        let mut found = None;
        for (bodies, row) in &self.by_pose {
            for side in (0..2).filter(|side| bodies[*side] == Some(body)) {
                let columns = found.get_or_insert_with(RowsChange::<6>::zero);
                let mut part = columns.motion.row_mut(0);
                part += row.fixed_columns::<6>(6 * side);
            }
        }
        found
    }

    /// By changes of constants.
    pub(super) fn by_constants(&self, of: &impl Fn(Constant, usize) -> f64) -> RowsChange<1> {
        let moved = self.by_anchors.iter().map(|(joint, row)| row.tr_dot(&anchors_of(*joint, of)));
        Self::along(self.by_time_step * of(Constant::TimeStep, 0) + moved.sum::<f64>())
    }

    /// The transpose.
    pub(super) fn pull(&self, by: &RowsChange<1>, states: &mut [StateChange]) {
        let along = by.motion[0];
        for (bodies, row) in &self.by_pose {
            for (side, body) in bodies.iter().enumerate() {
                let Some(state) = body.map(|body| &mut states[body]) else { continue };
                state.position += row.fixed_columns::<3>(6 * side).transpose() * along;
                state.turn += row.fixed_columns::<3>(6 * side + 3).transpose() * along;
            }
        }
    }

    /// The transpose.
    pub(super) fn pull_constants(
        &self,
        by: &RowsChange<1>,
        constants: &[Constant],
        sums: &mut [Vec<f64>],
    ) {
        let along = by.motion[0];
        for (&constant, sums) in constants.iter().zip(sums) {
            match constant {
                Constant::TimeStep => sums[0] += along * self.by_time_step,
                Constant::Anchor => {
                    for (joint, row) in &self.by_anchors {
                        add_anchors(*joint, &(row.transpose() * along), sums);
                    }
                }
                _ => {}
            }
        }
    }
}

/// The changes of the anchors of a joint, in A and in B.
fn anchors_of(joint: usize, of: &impl Fn(Constant, usize) -> f64) -> Vector6<f64> {
    Vector6::from_fn(|k, _| of(Constant::Anchor, 6 * joint + k))
}

/// Adds derivatives by them.
fn add_anchors(joint: usize, moved: &Vector6<f64>, sums: &mut [f64]) {
    sums[6 * joint..].iter_mut().zip(moved.iter()).for_each(|(sum, moved)| *sum += moved);
}
