//! What joints and gears hold, linearised by the states at the start of the step and by the constants of their drives.
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
use super::coupling_change;
use super::slopes::Slopes;
use crate::derivative::{JointTangent, RowsTangent, StateChange};
use crate::joint::{Axis, AxisChange, AxisStart, JointAxis, PieceChange, Segment};
use crate::step::Step;
use crate::world::{Constant, World};
use nalgebra::{Matrix3, RowSVector, SMatrix, SVector, Vector3, Vector6};

/// Right-hand sides of a body by the state of one.
pub(super) type Matrix6x12 = SMatrix<f64, 6, 12>;

/// The impulse of three rows of a joint, linearised.
#[derive(Debug, Clone)]
pub(super) struct LinearRows {
    /// The coupling in the island.
    coupling: usize,
    slopes: Slopes,
    by_time_step: SVector<f64, 9>,
    /// The rows' axes, and what each answers to.
    frame: Matrix3<f64>,
    laws: [RowLaw; 3],
}

/// The row of a gear, linearised: the impulse along it, by the poses of the bodies of its two coordinates.
#[derive(Debug, Clone)]
pub(super) struct LinearGear {
    coupling: usize,
    by_pose: [([Option<usize>; 2], RowSVector<f64, 12>); 2],
    by_time_step: f64,
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
    /// Which of the world's axes with a drive it is, and which of those with a motor.
    slots: [Option<usize>; 2],
}

impl RowLaw {
    /// δp̂ by δu.
    fn gain(&self) -> f64 {
        match self.at.1 {
            true => -1.0 / self.compliance,
            false => -self.slope / (1.0 + self.compliance * self.slope),
        }
    }

    /// δp̂ by a change of what its graph is made of.
    fn answer(&self, change: &AxisChange) -> f64 {
        let Self { axis, start, time_step, scale, at, slope, compliance, .. } = self;
        match axis.piece_change(start, *time_step, *scale, *at, change) {
            PieceChange::Speed(faster) => faster / compliance,
            PieceChange::Line(value, steeper) => {
                (value - at.0 * steeper) / (1.0 + compliance * slope)
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
            of if of.is_of_joints() => self.slots[0],
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

    /// How many numbers a constant of joints has; anchors, by which there is no derivative, none.
    pub(super) fn width(&self, constant: Constant) -> usize {
        match constant {
            Constant::Anchor => 0,
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
}

impl Solved<'_> {
    /// The piece of row k of a coupling.
    fn segment(&self, island: &Island, coupling: usize, k: usize) -> Segment {
        let Piece::Axes(pieces) = self.pieces[coupling] else { return Segment::NONE };
        island.segment(coupling, k, pieces[k])
    }
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
    let mut tangents: Vec<(usize, [Option<usize>; 2], f64, RowsTangent)> = Vec::new();
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
                    slots: slots.of(*number, axis),
                }
            };
            let laws = [law(0), law(1), law(2)];
            rows.push(LinearRows::new(coupling, bodies, &of, (frame, laws)));
            tangents.push((coupling, bodies, length, of));
        }
    }
    for row in island.gear_rows() {
        gears.extend(LinearGear::new(&row, &tangents, (step, solved.compliance)));
    }
}

impl LinearRows {
    fn new(
        coupling: usize,
        bodies: [Option<usize>; 2],
        of: &RowsTangent,
        (frame, laws): (Matrix3<f64>, [RowLaw; 3]),
    ) -> Self {
        let mut slopes = Slopes::of(bodies);
        slopes.by_pose = of.load;
        let mut by_time_step = SVector::<f64, 9>::zeros();
        let mut by_velocity = of.rates.as_ref().map(|_| Box::new(SMatrix::<f64, 9, 12>::zeros()));
        for (k, law) in laws.iter().enumerate() {
            let gain = law.gain();
            let unit = AxisChange::default();
            let by_coordinate = law.answer(&AxisChange { coordinate: 1.0, ..unit });
            let mut row = of.motion.row(k) * gain + of.coordinates.row(k) * by_coordinate;
            let mut longer =
                of.by_time_step[k] * gain + law.answer(&AxisChange { time_step: 1.0, ..unit });
            if let (Some(rates), Some(slopes)) = (&of.rates, &mut by_velocity) {
                let by_rate = law.answer(&AxisChange { rate: 1.0, ..unit });
                row += rates.by_poses.row(k) * by_rate;
                longer += rates.by_time_step[k] * by_rate;
                let mut part = slopes.fixed_rows_mut::<3>(0);
                part += frame.column(k) * (rates.by_velocities.row(k) * by_rate);
            }
            let mut part = slopes.by_pose.fixed_rows_mut::<3>(0);
            part += frame.column(k) * row;
            let mut part = by_time_step.fixed_rows_mut::<3>(0);
            part += frame.column(k) * longer;
        }
        slopes.by_velocity = by_velocity;
        Self { coupling, slopes, by_time_step, frame, laws }
    }

    /// Adds to the right-hand sides what changes of states make.
    pub(super) fn push(&self, island: &Island, states: &[StateChange], rhs: &mut [Vector6<f64>]) {
        let change = coupling_change(&self.slopes.pushed(states));
        island.add_change(self.coupling, &change, rhs);
    }

    /// Adds what the state of a body of the world makes, by columns.
    pub(super) fn add_state(&self, island: &Island, body: usize, rhs: &mut [Matrix6x12]) {
        if let Some(columns) = self.slopes.by_state(body) {
            island.add_changes(self.coupling, &columns, rhs);
        }
    }

    /// Adds what changes of constants make.
    pub(super) fn push_constants(
        &self,
        island: &Island,
        of: &impl Fn(Constant, usize) -> f64,
        rhs: &mut [Vector6<f64>],
    ) {
        let mut change = self.by_time_step * of(Constant::TimeStep, 0);
        let answer = |law: &RowLaw| law.given(of).map_or(0.0, |given| law.answer(&given));
        let along = Vector3::from_iterator(self.laws.iter().map(answer));
        let mut part = change.fixed_rows_mut::<3>(0);
        part += self.frame * along;
        island.add_change(self.coupling, &coupling_change(&change), rhs);
    }

    /// The transpose.
    pub(super) fn pull(
        &self,
        island: &Island,
        rhs: &[Vector6<f64>],
        states: &mut [StateChange],
        constants: (&[Constant], &mut [Vec<f64>]),
    ) {
        let by = super::numbers(&island.change_pulled(self.coupling, rhs));
        self.slopes.pull(&by, states);
        let along = self.frame.tr_mul(&by.fixed_rows::<3>(0));
        for (&constant, sums) in constants.0.iter().zip(constants.1) {
            if constant == Constant::TimeStep {
                sums[0] += by.dot(&self.by_time_step);
            }
            for (law, along) in self.laws.iter().zip(&along) {
                let Some(place) = law.slot(constant) else { continue };
                let unit = |of: Constant, _: usize| if of == constant { 1.0 } else { 0.0 };
                sums[place] += along * law.given(&unit).map_or(0.0, |given| law.answer(&given));
            }
        }
    }
}

impl LinearGear {
    /// The row u = ℓ (q₁⁺ − r q₂⁺ − q₀)/h of which the coordinates are rows of joints.
    fn new(
        row: &GearRow,
        tangents: &[(usize, [Option<usize>; 2], f64, RowsTangent)],
        (step, compliance): (&Step<'_>, f64),
    ) -> Option<Self> {
        let (h, gain) = (step.world.time_step(), -1.0 / compliance);
        let mut by_time_step = -row.offset / h;
        let mut of_part = |(coupling, k, factor): (usize, usize, f64)| {
            let (_, bodies, length, of) = tangents.iter().find(|(known, ..)| *known == coupling)?;
            by_time_step += factor * of.by_time_step[k];
            let slopes = (of.motion.row(k) + of.coordinates.row(k) * (length / h)) * factor;
            Some((*bodies, slopes * gain))
        };
        let by_pose = [of_part(row.parts[0])?, of_part(row.parts[1])?];
        Some(Self { coupling: row.coupling, by_pose, by_time_step: by_time_step * gain })
    }

    /// Adds to the right-hand sides what an impulse along the row makes.
    fn add(&self, island: &Island, along: f64, rhs: &mut [Vector6<f64>]) {
        let mut change = SVector::<f64, 9>::zeros();
        change[0] = along;
        island.add_change(self.coupling, &coupling_change(&change), rhs);
    }

    /// Adds to the right-hand sides what changes of states make.
    pub(super) fn push(&self, island: &Island, states: &[StateChange], rhs: &mut [Vector6<f64>]) {
        let mut along = 0.0;
        for (bodies, row) in &self.by_pose {
            for (side, body) in bodies.iter().enumerate() {
                let Some(state) = body.map(|body| &states[body]) else { continue };
                along += row.fixed_columns::<3>(6 * side).tr_dot(&state.position)
                    + row.fixed_columns::<3>(6 * side + 3).tr_dot(&state.turn);
            }
        }
        self.add(island, along, rhs);
    }

    /// Adds what the state of a body of the world makes, by columns.
    pub(super) fn add_state(&self, island: &Island, body: usize, rhs: &mut [Matrix6x12]) {
        let mut columns = SMatrix::<f64, 9, 12>::zeros();
        for (bodies, row) in &self.by_pose {
            for side in (0..2).filter(|side| bodies[*side] == Some(body)) {
                let mut part = columns.fixed_view_mut::<1, 6>(0, 0);
                part += row.fixed_columns::<6>(6 * side);
            }
        }
        island.add_changes(self.coupling, &columns, rhs);
    }

    /// Adds what a change of h (s) makes.
    pub(super) fn push_time_step(&self, island: &Island, time_step: f64, rhs: &mut [Vector6<f64>]) {
        self.add(island, self.by_time_step * time_step, rhs);
    }

    /// The transpose; the derivative by h.
    pub(super) fn pull(
        &self,
        island: &Island,
        rhs: &[Vector6<f64>],
        states: &mut [StateChange],
    ) -> f64 {
        let along = island.change_pulled(self.coupling, rhs).impulse[0];
        for (bodies, row) in &self.by_pose {
            for (side, body) in bodies.iter().enumerate() {
                let Some(state) = body.map(|body| &mut states[body]) else { continue };
                state.position += row.fixed_columns::<3>(6 * side).transpose() * along;
                state.turn += row.fixed_columns::<3>(6 * side + 3).transpose() * along;
            }
        }
        along * self.by_time_step
    }
}
