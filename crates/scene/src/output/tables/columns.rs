//! Rows of the tables. Each field is declared with its columns; writer and reader follow from it.

use super::KeyText;
use crate::output::csv_reader::{CsvReader, RowsError};
use crate::output::rows::RowWriter;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use std::io::{Read, Write};
use tumble_core::contact::Partner;
use tumble_core::joint::JointResidual;
use tumble_core::mechanics::State;
use tumble_core::step::StepStatus;

/// Value in one or several cells of a row.
pub(super) trait Cells: Sized {
    fn write<W: Write>(&self, row: &mut RowWriter<W>);
    fn read<R: Read>(row: &mut RowCells<'_, R>) -> Result<Self, RowsError>;
}

/// Cells of a row in their order.
pub(super) struct RowCells<'a, R: Read> {
    reader: &'a CsvReader<R>,
    next: usize,
}

impl<'a, R: Read> RowCells<'a, R> {
    /// Cells of the row just read, from the column `next`.
    pub fn from(reader: &'a CsvReader<R>, next: usize) -> Self {
        Self { reader, next }
    }

    /// Index of the next column.
    fn column(&mut self) -> usize {
        self.next += 1;
        self.next - 1
    }
}

/// Defines the row of a table: `field: type = [columns]`.
macro_rules! columns {
    ($(#[$meta:meta])* $name:ident {
        $($(#[$doc:meta])* $field:ident: $type:ty = [$($column:literal),+ $(,)?],)*
    }) => {
        $(#[$meta])*
        pub struct $name {
            $($(#[$doc])* pub $field: $type,)*
        }

        impl $name {
            /// Names of the columns.
            pub(super) const COLUMNS: &'static [&'static str] = &[$($($column),+),*];
        }

        impl Cells for $name {
            #[inline]
            fn write<W: Write>(&self, row: &mut RowWriter<W>) {
                $(self.$field.write(row);)*
            }

            fn read<R: Read>(row: &mut RowCells<'_, R>) -> Result<Self, RowsError> {
                Ok(Self { $($field: Cells::read(row)?,)* })
            }
        }
    };
}

/// Columns of a state.
pub(in crate::output) const STATE_COLUMNS: [&str; 13] = [
    "x_m", "y_m", "z_m", "qw", "qx", "qy", "qz", "vx_m_s", "vy_m_s", "vz_m_s", "wx_rad_s",
    "wy_rad_s", "wz_rad_s",
];

/// Columns of the velocity and the spin of the middle of the last interval and of its length, with
/// [`Integrator::Leapfrog`](tumble_core::world::Integrator::Leapfrog).
pub(in crate::output) const MIDDLE_COLUMNS: [&str; 7] = [
    "mid_vx_m_s",
    "mid_vy_m_s",
    "mid_vz_m_s",
    "mid_wx_rad_s",
    "mid_wy_rad_s",
    "mid_wz_rad_s",
    "before_s",
];

/// Row of the table `states` of a run with middle velocities.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct StateRow {
    /// State with the velocities of the instant.
    pub instant: State,
    /// Velocity (m/s, world) and spin (rad/s, body) of the middle of the last interval.
    pub middle: [Vector3<f64>; 2],
    /// Its length (s), 0 for a body that starts; see
    /// [`Interval::before`](tumble_core::simulation::Interval::before).
    pub before: f64,
}

impl StateRow {
    /// Row of a run without middle velocities.
    pub fn without_middle(state: State) -> Self {
        Self { instant: state, middle: [state.velocity, state.spin], before: 0.0 }
    }

    /// State with the middle velocities.
    pub fn at_the_middle(&self) -> State {
        let [velocity, spin] = self.middle;
        State { velocity, spin, ..self.instant }
    }
}

impl Cells for StateRow {
    fn write<W: Write>(&self, row: &mut RowWriter<W>) {
        self.instant.write(row);
        self.middle.iter().for_each(|vector| vector.write(row));
        self.before.write(row);
    }

    fn read<R: Read>(row: &mut RowCells<'_, R>) -> Result<Self, RowsError> {
        Ok(Self {
            instant: Cells::read(row)?,
            middle: [Cells::read(row)?, Cells::read(row)?],
            before: Cells::read(row)?,
        })
    }
}

/// Columns of the interval at the end of a row: its number in the step, and its length.
pub(super) const INTERVAL_COLUMNS: [&str; 2] = ["interval", "interval_s"];

columns! {
    /// Row of the table `steps`: an interval of a step. In a run that omits rows, `status`, `works` and
    /// `error` of the last interval of a step cover the steps up to the next row.
    #[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
    StepRow {
        /// Step index k.
        index: u64 = ["k"],
        /// Time t at the start of the interval (s).
        time: f64 = ["time_s"],
        /// Status of the interval, or `substepped`, `wild` or `failed` of a step between this row and
        /// the next.
        status: StepStatus = ["status"],
        /// Iterations of the solver.
        iterations: u32 = ["iterations"],
        /// Initial point of the solution; empty if no problem was solved.
        start: String = ["start"],
        /// Number of contacts in the step.
        contacts: usize = ["contacts"],
        /// Residual (m/s).
        residual: f64 = ["residual_m_s"],
        /// Parts of the residual (m/s), in the order of
        /// [`Certificate::parts`](tumble_core::contact::Certificate::parts).
        parts: [f64; 5] = [
            "dynamics_m_s", "penetration_m_s", "normal_law_m_s", "friction_law_m_s", "cone_m_s",
        ],
        /// Overlap of pieces at k+1 (m).
        overlap: f64 = ["overlap_m"],
        /// Largest error of the placement of a loaded contact (m), see
        /// [`Interval::placement`](tumble_core::simulation::Interval::placement).
        placement: f64 = ["placement_m"],
        /// Smallest restitution share of an island.
        restitution_share: f64 = ["restitution_share"],
        /// Energy at the start of the interval (J), see
        /// [`Interval::energy`](tumble_core::simulation::Interval::energy).
        energy: f64 = ["energy_J"],
        /// Terms of the energy balance (J), summed over the steps up to the next row; see
        /// `terms` of an [`EnergyBalance`](tumble_core::simulation::EnergyBalance).
        works: [f64; 6] = [
            "loads_J", "drives_J", "reactions_J", "impacts_J", "friction_J", "discretisation_J",
        ],
        /// Number of the interval in its step, from 0.
        interval: u32 = ["interval"],
        /// Length of the interval (s); 0 in the last row.
        length: f64 = ["interval_s"],
        /// Stiffness number h ω, see
        /// [`Interval::stiffness`](tumble_core::simulation::Interval::stiffness); 0 without joints.
        stiffness: f64 = ["stiffness"],
        /// Length over which errors of position are removed (s), see `usual` of a
        /// [`Span`](tumble_core::world::Span), in a run with an accuracy or located impacts.
        usual: f64 = ["correction_s"],
        /// Growth of the estimated error (40) of the body with the largest one up to the next row (m),
        /// in a run with an accuracy.
        error: f64 = ["error_m"],
    }
}

columns! {
    /// Row of the table `contacts`. Vectors are in the world frame.
    #[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
    ContactRow {
        /// Index of the contact in the step.
        index: usize = ["contact"],
        /// Body on which the force acts.
        body: usize = ["body"],
        /// Contact partner.
        partner: Partner = ["partner", "partner_index"],
        /// Touching point at k (m).
        point: Vector3<f64> = ["point_x_m", "point_y_m", "point_z_m"],
        /// Unit normal at k, away from the partner.
        normal: Vector3<f64> = ["normal_x", "normal_y", "normal_z"],
        /// Force on `body` (N).
        force: Vector3<f64> = ["force_x_N", "force_y_N", "force_z_N"],
        /// Mean slip over the step (m/s).
        slip: Vector3<f64> = ["slip_x_m_s", "slip_y_m_s", "slip_z_m_s"],
        /// Gap at k (m).
        gap: f64 = ["gap_m"],
        /// Rounding radius of the point (m).
        radius: f64 = ["radius_m"],
        /// Required rebound speed e c_n⁻ (m/s), eq. 29.
        rebound: f64 = ["rebound_m_s"],
        /// Touching features.
        key: KeyText = ["key"],
        /// Coefficient of friction in the interval.
        friction: f64 = ["friction"],
        /// Number of the interval in its step, from 0.
        interval: u32 = ["interval"],
        /// Length of the interval (s).
        length: f64 = ["interval_s"],
        /// Moment on `body` about the touching point (N m), in a world with turning friction.
        moment: Vector3<f64> = ["moment_x_N_m", "moment_y_N_m", "moment_z_N_m"],
    }
}

columns! {
    /// Row of the table `joints`; by default without a step.
    #[derive(Debug, Clone, Copy, Default, PartialEq)]
    JointRow {
        /// Position of A's anchor at k along the axes of B's frame (m).
        place: Vector3<f64> = ["x_m", "y_m", "z_m"],
        /// Joint angles at k (rad), see [turns](tumble_core::joint::Joint::turns).
        turns: Vector3<f64> = ["angle_x_rad", "angle_y_rad", "angle_z_rad"],
        /// Mean rate of `place` over the step (m/s).
        velocity: Vector3<f64> = ["vx_m_s", "vy_m_s", "vz_m_s"],
        /// Mean rates of the angles over the step (rad/s).
        spin: Vector3<f64> = ["wx_rad_s", "wy_rad_s", "wz_rad_s"],
        /// Force (N), see `force` of [`JointForce`](tumble_core::joint::JointForce).
        force: Vector3<f64> = ["force_x_N", "force_y_N", "force_z_N"],
        /// Torque (N m), see `torque` of [`JointForce`](tumble_core::joint::JointForce).
        torque: Vector3<f64> = ["torque_x_N_m", "torque_y_N_m", "torque_z_N_m"],
        /// Residual of the joint (m/s).
        residual: JointResidual = ["joint_m_s", "joint_law_m_s"],
    }
}

columns! {
    /// Row of the table `gears`.
    #[derive(Debug, Clone, Copy, PartialEq)]
    GearTableRow {
        /// Both coordinates at k (m or rad).
        coordinates: [f64; 2] = ["first", "second"],
        /// Force along the first coordinate over the step (N or N m).
        force: f64 = ["force"],
        /// Residual of the gear (m/s).
        residual: f64 = ["gear_m_s"],
    }
}

/// Defines the cells of a type: `|value, row|` writes them, `|row|` reads them.
macro_rules! cells {
    ($($type:ty: |$value:ident, $to:ident| $write:expr, |$from:ident| $read:expr;)*) => {
        $(impl Cells for $type {
            #[inline]
            fn write<W: Write>(&self, $to: &mut RowWriter<W>) {
                let $value = self;
                $write;
            }

            fn read<R: Read>($from: &mut RowCells<'_, R>) -> Result<Self, RowsError> {
                $read
            }
        })*
    };
}

cells! {
    u64: |value, row| row.whole(*value), |row| row.reader.whole(row.column());
    u32: |value, row| row.whole((*value).into()), |row| row.reader.whole(row.column());
    usize: |value, row| row.whole(*value as u64), |row| row.reader.whole(row.column());
    f64: |value, row| row.number(*value), |row| row.reader.number(row.column());
    String: |text, row| row.text(text), |row| Ok(row.reader.text(row.column()).to_owned());
    Vector3<f64>: |vector, row| row.numbers(vector.as_slice()),
        |row| <[f64; 3]>::read(row).map(Vector3::from);
    State: |state, row| row.numbers(state.to_vector().as_slice()),
        |row| Ok(Self::from_vector(&<[f64; 13]>::read(row)?.into()));
    JointResidual: |residual, row| row.numbers(&[residual.locked, residual.drive]),
        |row| <[f64; 2]>::read(row).map(|[locked, drive]| Self { locked, drive });
    StepStatus: |status, row| row.text(status.name()),
        |row| row.reader.field(row.column(), "a status", Self::from_name);
    KeyText: |key, row| row.word(key),
        |row| row.reader.field(row.column(), "a key of a contact", Self::parse);
    Partner: |partner, row| write_partner(*partner, row), |row| read_partner(row);
}

impl<const N: usize> Cells for [f64; N] {
    #[inline]
    fn write<W: Write>(&self, row: &mut RowWriter<W>) {
        row.numbers(self);
    }

    fn read<R: Read>(row: &mut RowCells<'_, R>) -> Result<Self, RowsError> {
        let numbers = row.reader.numbers(row.next);
        row.next += N;
        numbers
    }
}

fn write_partner<W: Write>(partner: Partner, row: &mut RowWriter<W>) {
    let (name, index) = match partner {
        Partner::Ground => ("ground", 0),
        Partner::Fixed(index) => ("fixed", index),
        Partner::Body(index) => ("body", index),
    };
    row.text(name);
    row.whole(index as u64);
}

fn read_partner<R: Read>(row: &mut RowCells<'_, R>) -> Result<Partner, RowsError> {
    let (name, index) = (row.column(), row.column());
    let place = row.reader.whole(index)?;
    row.reader.field(name, "ground with the index 0, fixed or body", |text| match text {
        "ground" if place == 0 => Some(Partner::Ground),
        "fixed" => Some(Partner::Fixed(place)),
        "body" => Some(Partner::Body(place)),
        _ => None,
    })
}
