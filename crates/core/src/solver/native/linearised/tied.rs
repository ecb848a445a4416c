//! Linearised joint rows, by the initial states, the drives' constants and the anchors. Gear rows
//! are sums of them.
//!
//! At fixed V⁺ the impulse along row k of a joint changes with its piece (J5). With ε the
//! compliance,
//!
//! ```text
//! where it is vertical δp̂ = −(δu − δu₀)/ε,   of p = v − s u δp̂ = (δv − û δs − s δu)/(1 + ε s)  (G10)
//! ```
//!
//! The torque of the impulse changes with the poses of the bodies. Equation numbers refer to
//! `docs/gradients.md`.

use super::constants::{add_anchors, anchors_of, unit};
use super::slopes::{LinearisedSlopes, RowsChange};
use crate::derivative::RowsTangent;
use crate::joint::{Axis, AxisChange, AxisStart, GraphPlace, JointAxis, PieceChange, Segment};
use crate::solver::native::island::Island;
use crate::solver::native::law::MapPiece;
use crate::world::{Constant, World};
use nalgebra::{Matrix3, RowSVector, SMatrix, Vector3, Vector6};
use std::ops::Range;

/// Three linearised rows of a joint.
#[derive(Debug, Clone)]
pub(super) struct LinearRows {
    /// Index of the coupling in the island.
    pub(super) coupling: usize,
    pub(super) slopes: LinearisedSlopes,
    by_time_step: RowsChange<1>,
    /// Index of the joint in the world.
    joint: usize,
    by_anchors: Option<Box<RowsChange<6>>>,
    /// Axes of the rows. `laws` has the law of each.
    frame: Matrix3<f64>,
    laws: [TiedRowLaw; 3],
}

/// Joint row on a piece of its law.
#[derive(Debug, Clone, Copy)]
pub(super) struct TiedRowLaw {
    axis: Axis,
    start: AxisStart,
    time_step: f64,
    /// ℓ (m) of the row's scale; `mass` is M (kg).
    length: f64,
    mass: f64,
    /// û, or u₀ of a vertical piece, with a flag for the latter.
    at: GraphPlace,
    /// s. Zero for a vertical piece.
    slope: f64,
    compliance: f64,
    limit: f64,
    slots: AxisSlots,
}

/// Row of a coupling of a joint or a gear.
#[derive(Debug, Clone, Copy)]
pub(super) struct TiedRow {
    pub(super) coupling: usize,
    pub(super) k: usize,
    /// ℓ of a rotation (m).
    pub(super) length: f64,
}

impl TiedRowLaw {
    /// Law of a `row` whose axis has the initial values `start`, in a step of `time_step` (s).
    pub(super) fn new(
        solved: &SolvedRows<'_>,
        island: &Island,
        row: TiedRow,
        axis: &Axis,
        start: &AxisStart,
        time_step: f64,
        slots: AxisSlots,
    ) -> Self {
        let TiedRow { coupling, k, length } = row;
        let on = solved.segment(island, coupling, k);
        let is_vertical = on.is_vertical();
        let p = &solved.impulses[coupling];
        // With a limit, compliance acts on changes only.
        let given = p * (solved.compliance - solved.limit);
        let u = island.rows(coupling).column(k).dot(&(solved.points[coupling] + given));
        Self {
            axis: *axis,
            start: *start,
            time_step,
            length,
            mass: island.mass(),
            at: GraphPlace { u: if is_vertical { on.u } else { u }, is_vertical },
            slope: if is_vertical { 0.0 } else { -on.dp / on.du },
            compliance: solved.compliance,
            limit: solved.limit,
            slots,
        }
    }

    /// Distance to the speed at which the axis' stop and its dry friction meet (m/s).
    fn stop_margin(&self) -> f64 {
        self.axis.stop_margin(&self.start, self.time_step, self.length, self.at)
    }

    /// Distance from a change between bouncing and not bouncing (m/s).
    fn bounce_margin(&self) -> f64 {
        self.axis.bounce_margin(&self.start, self.time_step, self.length)
    }

    /// Motion along the row and impulse for a change of the graph's data (G10). The impulse has no
    /// compliance if the limit is taken (G14).
    pub(super) fn local_solution(&self, change: &AxisChange) -> (f64, f64) {
        let Self { axis, start, time_step, length, mass, at, slope, compliance, limit, .. } = self;
        match axis.piece_change(start, *time_step, *length, *mass, *at, change) {
            PieceChange::Speed(faster) => (-faster, 0.0),
            PieceChange::Line(value, steeper) => {
                let impulse = (value - at.u * steeper) / (1.0 + compliance * slope);
                (-limit * impulse, impulse)
            }
        }
    }

    /// Change of the axis by its own constants. `None` if it has none.
    fn given(&self, of: &impl Fn(Constant, usize) -> f64) -> Option<AxisChange> {
        if self.slots == AxisSlots::default() {
            return None;
        }
        let number = |constant| self.places(constant).map(|place| of(constant, place)).sum();
        let limit =
            |side| self.slots.limits.map_or(0.0, |at| of(Constant::JointLimits, 2 * at + side));
        Some(AxisChange {
            friction: number(Constant::JointFriction),
            stiffness: number(Constant::JointStiffness),
            rest: number(Constant::JointRest),
            damping: number(Constant::JointDamping),
            force: number(Constant::JointForce),
            armature: number(Constant::Armature),
            restitution: number(Constant::JointRestitution),
            limits: [limit(0), limit(1)],
            target: number(Constant::MotorTarget),
            motor_stiffness: number(Constant::MotorStiffness),
            motor_damping: number(Constant::MotorDamping),
            max_force: number(Constant::MotorMaxForce),
            ..AxisChange::default()
        })
    }

    /// Indices of the row among the numbers of a constant.
    fn places(&self, constant: Constant) -> Range<usize> {
        let AxisSlots { axis, motor, limits } = self.slots;
        let found = match constant {
            Constant::JointLimits => return limits.map_or(0..0, |at| 2 * at..2 * at + 2),
            of if of.is_of_motors() => motor,
            of if of.is_of_drives() => axis,
            _ => None,
        };
        found.map_or(0..0, |place| place..place + 1)
    }
}

/// Indices of an axis among the axes with drives, with motors and with limits.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct AxisSlots {
    axis: Option<usize>,
    motor: Option<usize>,
    limits: Option<usize>,
}

/// Indices of joint axes among the numbers of constants.
#[derive(Debug, Clone, Default)]
pub(super) struct Slots {
    /// Joint, axis and indices of every axis that has constants.
    axes: Vec<(usize, JointAxis, AxisSlots)>,
    /// Number of axes with drives. `motors`, `limited` and `gears` count likewise.
    driven: usize,
    motors: usize,
    limited: usize,
    gears: usize,
}

impl Slots {
    pub(super) fn set(&mut self, world: &World) {
        self.axes.clear();
        let (mut driven, mut motors, mut limited) = (0, 0, 0);
        for (joint, of) in world.joints().iter().enumerate() {
            let [along, about] = of.bears();
            let along = (0..3).map(|k| (JointAxis::Linear(k), along[k]));
            for (axis, bears) in along.chain((0..3).map(|k| (JointAxis::Angular(k), about[k]))) {
                let Some(drive) = of.drive(axis) else { continue };
                let slots = AxisSlots {
                    axis: next(bears, &mut driven),
                    motor: next(bears && drive.motor.is_some(), &mut motors),
                    limits: next(drive.limits.is_some(), &mut limited),
                };
                if slots != AxisSlots::default() {
                    self.axes.push((joint, axis, slots));
                }
            }
        }
        (self.driven, self.motors, self.limited) = (driven, motors, limited);
        self.gears = world.gears().len();
    }

    /// Number of values of a constant of drives or gears.
    pub(super) fn width(&self, constant: Constant) -> usize {
        match constant {
            Constant::JointLimits => 2 * self.limited,
            of if of.is_of_gears() => self.gears,
            of if of.is_of_motors() => self.motors,
            _ => self.driven,
        }
    }

    /// Indices of an axis.
    pub(super) fn axis_slots(&self, joint: usize, axis: JointAxis) -> AxisSlots {
        let first = self.axes.partition_point(|(known, ..)| *known < joint);
        let mut own = self.axes[first..].iter().take_while(|(known, ..)| *known == joint);
        own.find(|(_, known, _)| *known == axis).map_or(AxisSlots::default(), |(.., slots)| *slots)
    }
}

/// Next index, if `has` is true.
fn next(has: bool, count: &mut usize) -> Option<usize> {
    let place = has.then_some(*count);
    *count += usize::from(has);
    place
}

/// Solution at which the rows of an island are linearised.
pub(super) struct SolvedRows<'a> {
    pub(super) pieces: &'a [MapPiece],
    /// p̂ of every coupling (m/s, world). `points` has u.
    pub(super) impulses: &'a [Vector3<f64>],
    pub(super) points: &'a [Vector3<f64>],
    pub(super) compliance: f64,
    /// `compliance` if its limit is taken, otherwise 0.
    pub(super) limit: f64,
}

impl SolvedRows<'_> {
    /// Piece of row k of a coupling.
    fn segment(&self, island: &Island, coupling: usize, k: usize) -> Segment {
        let MapPiece::Axes(pieces) = self.pieces[coupling] else { return Segment::NONE };
        island.segment(coupling, k, pieces[k])
    }
}

impl LinearRows {
    /// Smallest distance of a held row to the speed at which its stop and its dry friction meet
    /// (m/s).
    pub(super) fn stop_margin(&self) -> f64 {
        self.laws.iter().map(TiedRowLaw::stop_margin).fold(f64::INFINITY, f64::min)
    }

    /// Smallest distance of a row from a change between bouncing and not bouncing (m/s).
    pub(super) fn bounce_margin(&self) -> f64 {
        self.laws.iter().map(TiedRowLaw::bounce_margin).fold(f64::INFINITY, f64::min)
    }

    pub(super) fn new(
        coupling: usize,
        joint: usize,
        bodies: [Option<usize>; 2],
        of: &RowsTangent,
        frame: Matrix3<f64>,
        laws: [TiedRowLaw; 3],
    ) -> Self {
        let mut slopes = LinearisedSlopes::new(bodies);
        let (load, mut by_time_step) = (&of.load, RowsChange::<1>::zero());
        let pose = &mut slopes.by_pose;
        pose.motion = of.motion;
        pose.impulse.copy_from(&load.fixed_rows::<3>(0));
        pose.torques.copy_from(&load.fixed_rows::<6>(3));
        let mut by_anchors = of.anchors.as_ref().map(|anchors| {
            let (motion, torques) = (anchors.motion, anchors.torques);
            Box::new(RowsChange { motion, impulse: SMatrix::zeros(), torques })
        });
        let follows = of.rates.is_some() || of.stop.is_some();
        let mut by_velocity = follows.then(|| Box::new(RowsChange::<12>::zero()));
        if let (Some(stop), Some(slopes)) = (&of.stop, &mut by_velocity) {
            slopes.torques += stop.by_velocities;
            by_time_step.torques += stop.by_time_step;
        }
        for (k, law) in laws.iter().enumerate() {
            let unit = AxisChange::default();
            // Adds columns `by`, and `longer` by h, through the response of row k.
            let mut add = |(motion, impulse): (f64, f64), by: RowSVector<f64, 12>, longer: f64| {
                let mut row = pose.motion.row_mut(k);
                row += by * motion;
                pose.impulse += frame.column(k) * (by * impulse);
                by_time_step.motion[k] += longer * motion;
                by_time_step.impulse += frame.column(k) * (longer * impulse);
            };
            // δu₀ or δv and δs of (G10), by the coordinate, by the step itself, and by h
            let by_coordinate = law.local_solution(&AxisChange { coordinate: 1.0, ..unit });
            add(by_coordinate, of.coordinates.row(k).into(), 0.0);
            add((1.0, 0.0), RowSVector::zeros(), of.by_time_step[k]);
            add(
                law.local_solution(&AxisChange { time_step: 1.0, ..unit }),
                RowSVector::zeros(),
                1.0,
            );
            // By the anchors (G12)
            if let (Some(of), Some(slopes)) = (&of.anchors, &mut by_anchors) {
                for (unit, by) in [
                    (AxisChange { coordinate: 1.0, ..unit }, of.coordinates.row(k)),
                    (AxisChange { rate: 1.0, ..unit }, of.rates.row(k)),
                ] {
                    let (motion, impulse) = law.local_solution(&unit);
                    let mut row = slopes.motion.row_mut(k);
                    row += by * motion;
                    slopes.impulse += frame.column(k) * (by * impulse);
                }
            }
            // By the rates of the axis at k
            if let (Some(rates), Some(slopes)) = (&of.rates, &mut by_velocity) {
                let (motion, impulse) = law.local_solution(&AxisChange { rate: 1.0, ..unit });
                add((motion, impulse), rates.by_poses.row(k).into(), rates.by_time_step[k]);
                let by = rates.by_velocities.row(k);
                let mut row = slopes.motion.row_mut(k);
                row += by * motion;
                slopes.impulse += frame.column(k) * (by * impulse);
            }
        }
        slopes.by_velocity = by_velocity;
        Self { coupling, slopes, by_time_step, joint, by_anchors, frame, laws }
    }

    pub(super) fn jvp_wrt_constants(&self, of: &impl Fn(Constant, usize) -> f64) -> RowsChange<1> {
        let mut change = RowsChange::zero().plus(of(Constant::TimeStep, 0), &self.by_time_step);
        for (k, law) in self.laws.iter().enumerate() {
            let Some((motion, impulse)) = law.given(of).map(|given| law.local_solution(&given))
            else {
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

    /// Adds the transposed product: derivatives with respect to `constants`.
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
                for place in law.places(constant) {
                    let given = law.given(&unit(constant, place));
                    let Some((motion, impulse)) = given.map(|given| law.local_solution(&given))
                    else {
                        continue;
                    };
                    sums[place] += by.motion[k] * motion + along[k] * impulse;
                }
            }
        }
    }
}
