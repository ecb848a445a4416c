//! Reader of tables. It checks headers, the order of rows and every field.

use super::{KeyText, Streams, Table};
use crate::output::sheet::{RowsError, Steps, TableReader};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use std::io::Read;
use tumble_core::contact::Partner;
use tumble_core::joint::{JointForce, JointResidual};
use tumble_core::mechanics::State;
use tumble_core::step::StepStatus;

/// One step read from tables.
#[derive(Debug, Clone, PartialEq)]
pub struct TableStep {
    /// Row of the table `steps`.
    pub row: StepRow,
    /// State X of each body at step k.
    pub states: Vec<State>,
    /// State X of each body at step k+1. Empty for the last state and without a table `ends`.
    pub ends: Vec<State>,
    /// Contacts of the step k → k+1.
    pub contacts: Vec<ContactRow>,
    /// Row of each joint of the world.
    pub joints: Vec<JointRow>,
    /// Row of each gear of the world.
    pub gears: Vec<GearTableRow>,
}

/// Row of the table `steps`. In a run that omits rows, `status` and `works` cover the steps up to the
/// next row.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StepRow {
    /// Step index k.
    pub index: u64,
    /// Time t (s).
    pub time: f64,
    /// Status of the step, or `substepped`, `wild` or `failed` of a step between this row and the
    /// next.
    pub status: StepStatus,
    /// Iterations of the solver.
    pub iterations: u32,
    /// Initial point of the solution; empty if no problem was solved.
    pub start: String,
    /// Number of contacts in the step.
    pub contacts: usize,
    /// Residual (m/s).
    pub residual: f64,
    /// Parts of the residual (m/s), in the order of
    /// [`Certificate::parts`](tumble_core::contact::Certificate::parts).
    pub parts: [f64; 5],
    /// Overlap of pieces at k+1 (m).
    pub overlap: f64,
    /// Largest error of the placement of a loaded contact (m), see
    /// [`StepRecord::placement`](tumble_core::simulation::StepRecord::placement).
    pub placement: f64,
    /// Smallest restitution share of an island.
    pub restitution_share: f64,
    /// Energy at k (J), see [energy](tumble_core::simulation::energy).
    pub energy: f64,
    /// Terms of the energy balance (J), summed over the steps up to the next row; see
    /// `terms` of an [`EnergyBalance`](tumble_core::simulation::EnergyBalance).
    pub works: [f64; 6],
    /// Stiffness number h ω, see
    /// [`StepRecord::stiffness`](tumble_core::simulation::StepRecord::stiffness); 0 without joints.
    pub stiffness: f64,
}

/// Row of the table `contacts`. Vectors are in the world frame.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactRow {
    /// Body on which the force acts.
    pub body: usize,
    /// Contact partner.
    pub partner: Partner,
    /// Touching point at k (m).
    pub point: Vector3<f64>,
    /// Unit normal at k, away from the partner.
    pub normal: Vector3<f64>,
    /// Force on `body` (N).
    pub force: Vector3<f64>,
    /// Mean slip over the step (m/s).
    pub slip: Vector3<f64>,
    /// Gap at k (m).
    pub gap: f64,
    /// Rounding radius of the point (m).
    pub radius: f64,
    /// Required rebound speed e c_n⁻ (m/s), eq. 29.
    pub rebound: f64,
    /// Touching features.
    pub key: KeyText,
}

/// Row of the table `joints`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointRow {
    /// Position of A's anchor at k along the axes of B's frame (m).
    pub place: Vector3<f64>,
    /// Joint angles at k (rad), see [turns](tumble_core::joint::Joint::turns).
    pub turns: Vector3<f64>,
    /// Mean rate of `place` over the step (m/s).
    pub velocity: Vector3<f64>,
    /// Mean rates of the angles over the step (rad/s).
    pub spin: Vector3<f64>,
    /// Force (N), see `force` of [`JointForce`](tumble_core::joint::JointForce).
    pub force: Vector3<f64>,
    /// Torque (N m), see `torque` of [`JointForce`](tumble_core::joint::JointForce).
    pub torque: Vector3<f64>,
    /// Residual of the joint (m/s).
    pub residual: JointResidual,
}

impl JointRow {
    /// Force and torque of the joint, with the angles at k.
    #[must_use]
    pub fn forces(&self) -> JointForce {
        JointForce { force: self.force, torque: self.torque, angles: self.turns }
    }
}

/// Row of the table `gears`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GearTableRow {
    /// Both coordinates at k (m or rad).
    pub coordinates: [f64; 2],
    /// Force along the first coordinate over the step (N or N m).
    pub force: f64,
    /// Residual of the gear (m/s).
    pub residual: f64,
}

const CUT_OFF: &str = "it ends before the row with status `end`: it is cut off, or from another \
                       run";
const TOO_LONG: &str = "there are rows after the step with status `end`";

/// Reads the tables of a run step by step. It keeps one step in memory.
pub struct TablesReader<R: Read> {
    sheets: Streams<TableReader<R>>,
    counts: [usize; 3],
    order: Steps,
    ended: bool,
}

impl<R: Read> TablesReader<R> {
    /// Reads and checks the headers of the tables of a run with the given numbers of objects.
    ///
    /// # Errors
    /// [`RowsError::Header`], the errors of a stream, or a missing table of contacts, joints or
    /// gears.
    pub fn new(
        streams: Streams<R>,
        bodies: usize,
        joints: usize,
        gears: usize,
    ) -> Result<Self, RowsError> {
        let reader = Self::of_some(streams, bodies, joints, gears)?;
        let sheets = &reader.sheets;
        for (table, is_missing, why) in [
            (Table::Contacts, sheets.contacts.is_none(), "it is missing"),
            (
                Table::Joints,
                sheets.joints.is_none() && joints > 0,
                "it is missing, but the run has joints",
            ),
            (
                Table::Gears,
                sheets.gears.is_none() && gears > 0,
                "it is missing, but the run has gears",
            ),
        ] {
            if is_missing {
                return Err(RowsError::End { table: table.name(), why });
            }
        }
        Ok(reader)
    }

    /// Reader for a run with missing tables. The steps have no rows of these tables.
    ///
    /// # Errors
    /// [`RowsError::Header`], or the errors of a stream.
    pub fn of_some(
        streams: Streams<R>,
        bodies: usize,
        joints: usize,
        gears: usize,
    ) -> Result<Self, RowsError> {
        let tied = joints > 0;
        let sheets = streams.each(|table, stream| sheet(table, stream, tied))?;
        Ok(Self { sheets, counts: [bodies, joints, gears], order: Steps::default(), ended: false })
    }

    /// Requires `index` as the first k.
    #[must_use]
    pub fn from_index(mut self, index: u64) -> Self {
        self.order.begin_at(index);
        self
    }

    /// Accepts any first k, for a part of a run.
    #[must_use]
    pub fn of_part(mut self) -> Self {
        self.order.begin_anywhere();
        self
    }

    /// Expects rows of every `every`-th step and of the last state.
    #[must_use]
    pub fn every(mut self, every: u64) -> Self {
        self.order.every(every);
        self
    }

    /// Next step; `None` after the step of status `end`.
    ///
    /// # Errors
    /// The first fault, with table, line and column.
    pub fn next_step(&mut self) -> Result<Option<TableStep>, RowsError> {
        let Streams { states: of_bodies, contacts, steps, joints, gears, ends } = &mut self.sheets;
        if self.ended {
            let some = [contacts, joints, gears, ends].into_iter().flatten();
            for sheet in [of_bodies, steps].into_iter().chain(some) {
                sheet.need_end(TOO_LONG)?;
            }
            return Ok(None);
        }
        let [bodies, joints_in_all, gears_in_all] = self.counts;
        steps.need_row(CUT_OFF)?;
        let status = steps.field(2, "a status", StepStatus::from_name)?;
        let index = self.order.next(steps, status)?;
        let row = step_row(steps, index, status, joints_in_all > 0)?;
        // Grows with the rows in the file: the requested number is not trustworthy.
        let states = states_of(of_bodies, &row, bodies)?;
        let ends = match ends {
            Some(sheet) if status != StepStatus::End => states_of(sheet, &row, bodies)?,
            _ => Vec::new(),
        };
        let (contacts_of, joints_of, gears_of) = (Vec::new(), Vec::new(), Vec::new());
        let mut step = TableStep {
            row,
            states,
            ends,
            contacts: contacts_of,
            joints: joints_of,
            gears: gears_of,
        };
        if let Some(sheet) = contacts {
            for number in 0..step.row.contacts {
                step.contacts.push(contact_row(sheet, index, number)?);
            }
        }
        if let Some(sheet) = joints {
            for joint in 0..joints_in_all {
                begin(sheet, &step.row, joint)?;
                step.joints.push(joint_row(sheet)?);
            }
        }
        if let Some(sheet) = gears {
            for gear in 0..gears_in_all {
                begin(sheet, &step.row, gear)?;
                let (coordinates, force) = (sheet.numbers(3)?, sheet.number(5)?);
                step.gears.push(GearTableRow { coordinates, force, residual: sheet.number(6)? });
            }
        }
        self.ended = status == StepStatus::End;
        Ok(Some(step))
    }
}

/// Reads the states of all bodies of a step.
fn states_of<R: Read>(
    sheet: &mut TableReader<R>,
    step: &StepRow,
    bodies: usize,
) -> Result<Vec<State>, RowsError> {
    let mut states = Vec::with_capacity(bodies.min(1 << 12));
    for body in 0..bodies {
        begin(sheet, step, body)?;
        states.push(State::from_vector(&sheet.numbers::<13>(3)?.into()));
    }
    Ok(states)
}

/// Reads the next row of a body, joint or gear and checks its first three columns.
fn begin<R: Read>(
    sheet: &mut TableReader<R>,
    step: &StepRow,
    number: usize,
) -> Result<(), RowsError> {
    sheet.need_row(CUT_OFF)?;
    sheet.expect(0, step.index)?;
    sheet.expect(2, number as u64)?;
    if sheet.number(1)? != step.time {
        return Err(sheet.odd(1, "the time of the same step in the table steps"));
    }
    Ok(())
}

fn step_row<R: Read>(
    sheet: &TableReader<R>,
    index: u64,
    status: StepStatus,
    tied: bool,
) -> Result<StepRow, RowsError> {
    Ok(StepRow {
        index,
        time: sheet.number(1)?,
        status,
        iterations: sheet.whole(3)?,
        start: sheet.text(4).to_owned(),
        contacts: sheet.whole(5)?,
        residual: sheet.number(6)?,
        parts: sheet.numbers(7)?,
        overlap: sheet.number(12)?,
        placement: sheet.number(13)?,
        restitution_share: sheet.number(14)?,
        energy: sheet.number(15)?,
        works: sheet.numbers(16)?,
        stiffness: if tied { sheet.number(22)? } else { 0.0 },
    })
}

fn joint_row<R: Read>(sheet: &TableReader<R>) -> Result<JointRow, RowsError> {
    let vector = |first| sheet.numbers::<3>(first).map(Vector3::from);
    let [locked, drive] = sheet.numbers(21)?;
    Ok(JointRow {
        place: vector(3)?,
        turns: vector(6)?,
        velocity: vector(9)?,
        spin: vector(12)?,
        force: vector(15)?,
        torque: vector(18)?,
        residual: JointResidual { locked, drive },
    })
}

fn contact_row<R: Read>(
    sheet: &mut TableReader<R>,
    k: u64,
    number: usize,
) -> Result<ContactRow, RowsError> {
    sheet.need_row(CUT_OFF)?;
    sheet.expect(0, k)?;
    sheet.expect(1, number as u64)?;
    let place = sheet.whole(4)?;
    let partner = sheet.field(3, "ground with the index 0, fixed or body", |text| match text {
        "ground" if place == 0 => Some(Partner::Ground),
        "fixed" => Some(Partner::Fixed(place)),
        "body" => Some(Partner::Body(place)),
        _ => None,
    })?;
    let vector = |first| sheet.numbers::<3>(first).map(Vector3::from);
    Ok(ContactRow {
        body: sheet.whole(2)?,
        partner,
        point: vector(5)?,
        normal: vector(8)?,
        force: vector(11)?,
        slip: vector(14)?,
        gap: sheet.number(17)?,
        radius: sheet.number(18)?,
        rebound: sheet.number(19)?,
        key: sheet.field(20, "a key of a contact", KeyText::parse)?,
    })
}

/// Reader of one table, for a run with or without joints.
fn sheet<R: Read>(table: Table, stream: R, joints: bool) -> Result<TableReader<R>, RowsError> {
    TableReader::new(table.name(), stream, table.columns(joints))
}
