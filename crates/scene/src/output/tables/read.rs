//! Rows become steps, every header, order and field checked.

use super::{KeyText, Streams, Table};
use crate::output::sheet::{RowsError, Steps, TableReader};
use nalgebra::Vector3;
use std::io::Read;
use tumble_core::contact::Partner;
use tumble_core::joint::{JointForce, JointResidual};
use tumble_core::mechanics::State;
use tumble_core::step::StepStatus;

/// One step as it was read.
#[derive(Debug, Clone, PartialEq)]
pub struct TableStep {
    /// Its row of the table `steps`.
    pub row: StepRow,
    /// X at step k, one a body.
    pub states: Vec<State>,
    /// X at step k+1, one a body; none where there is no table of them, the next step being kept too, and of the last state.
    pub ends: Vec<State>,
    /// The contacts of the step k → k+1.
    pub contacts: Vec<ContactRow>,
    /// The joints, one a joint of the world.
    pub joints: Vec<JointRow>,
    /// The gears, one a gear of the world.
    pub gears: Vec<GearTableRow>,
}

/// A row of the table `steps`.
#[derive(Debug, Clone, PartialEq)]
pub struct StepRow {
    /// k.
    pub index: u64,
    /// t, s.
    pub time: f64,
    /// How the step ended.
    pub status: StepStatus,
    /// Iterations of the solver.
    pub iterations: u32,
    /// The start that the solution came from; empty where no problem was solved.
    pub start: String,
    /// How many contacts the step had.
    pub contacts: usize,
    /// The residual, m/s.
    pub residual: f64,
    /// Its parts, m/s, in the order of [`Certificate::parts`](tumble_core::contact::Certificate::parts).
    pub parts: [f64; 5],
    /// How deep pieces overlap at k+1, m.
    pub overlap: f64,
    /// The smallest part of the restitution that an island took.
    pub restitution_share: f64,
    /// The [energy](tumble_core::simulation::energy) at k, J.
    pub energy: f64,
    /// The terms of its change in the step ([`EnergyBalance::terms`](tumble_core::simulation::EnergyBalance::terms)), J.
    pub works: [f64; 6],
    /// See [`StepRecord::stiffness`](tumble_core::simulation::StepRecord::stiffness); 0 without joints.
    pub stiffness: f64,
}

/// A row of the table `contacts`; vectors in the world.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactRow {
    /// The body that the force acts on.
    pub body: usize,
    /// What it touches.
    pub partner: Partner,
    /// The touching point at k, m.
    pub point: Vector3<f64>,
    /// At k, away from the partner.
    pub normal: Vector3<f64>,
    /// N, on `body`.
    pub force: Vector3<f64>,
    /// The mean slip over the step, m/s.
    pub slip: Vector3<f64>,
    /// At k, m.
    pub gap: f64,
    /// The radius by which the point is rounded, m.
    pub radius: f64,
    /// e c_n⁻ (eq. 29), m/s.
    pub rebound: f64,
    /// Which features touch.
    pub key: KeyText,
}

/// A row of the table `joints`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointRow {
    /// The place of A's anchor at k along the axes of B's frame, m.
    pub place: Vector3<f64>,
    /// The [turns](tumble_core::joint::Joint::turns) at k, rad.
    pub turns: Vector3<f64>,
    /// The mean rates of the place over the step, m/s.
    pub velocity: Vector3<f64>,
    /// Those of the turns, rad/s.
    pub spin: Vector3<f64>,
    /// See [`JointForce::force`](tumble_core::joint::JointForce::force), N.
    pub force: Vector3<f64>,
    /// See [`JointForce::torque`](tumble_core::joint::JointForce::torque), N m.
    pub torque: Vector3<f64>,
    /// Its part of the step's residual, m/s.
    pub residual: JointResidual,
}

impl JointRow {
    /// The force that it has, with the turns at k.
    #[must_use]
    pub fn forces(&self) -> JointForce {
        JointForce { force: self.force, torque: self.torque, angles: self.turns }
    }
}

/// A row of the table `gears`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GearTableRow {
    /// Its two coordinates at k, m or rad.
    pub coordinates: [f64; 2],
    /// Its force along the first one over the step, N or N m.
    pub force: f64,
    /// Its part of the step's residual, m/s.
    pub residual: f64,
}

const CUT_OFF: &str = "it ends before the row of status `end`: it is cut off, or of another run";
const TOO_LONG: &str = "there are rows after the step of status `end`";

/// Reads the tables of a run step by step, in memory for one step.
pub struct TablesReader<R: Read> {
    sheets: Streams<TableReader<R>>,
    counts: [usize; 3],
    order: Steps,
    ended: bool,
}

impl<R: Read> TablesReader<R> {
    /// Reads and checks the headers of the tables of so many `bodies`, `joints` and `gears`.
    ///
    /// # Errors
    /// [`RowsError::Header`], or a stream's; no table of contacts; joints or gears without a table of them.
    pub fn new(
        streams: Streams<R>,
        bodies: usize,
        joints: usize,
        gears: usize,
    ) -> Result<Self, RowsError> {
        let reader = Self::of_some(streams, bodies, joints, gears)?;
        let sheets = &reader.sheets;
        for (table, is_missing, why) in [
            (Table::Contacts, sheets.contacts.is_none(), "it is not given"),
            (
                Table::Joints,
                sheets.joints.is_none() && joints > 0,
                "it is not given, and the run has joints",
            ),
            (
                Table::Gears,
                sheets.gears.is_none() && gears > 0,
                "it is not given, and the run has gears",
            ),
        ] {
            if is_missing {
                return Err(RowsError::End { table: table.name(), why });
            }
        }
        Ok(reader)
    }

    /// The same of a run of which some tables are not there: steps have none of what would stand in them.
    ///
    /// # Errors
    /// [`RowsError::Header`], or a stream's.
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

    /// The same of a run whose first k is `index`.
    #[must_use]
    pub fn from_index(mut self, index: u64) -> Self {
        self.order.begin_at(index);
        self
    }

    /// The same of a part of a run, whose first step may have any k.
    #[must_use]
    pub fn of_part(mut self) -> Self {
        self.order.begin_anywhere();
        self
    }

    /// The same of a run of which each `every`-th step has rows, and the last state.
    #[must_use]
    pub fn every(mut self, every: u64) -> Self {
        self.order.every(every);
        self
    }

    /// The next step; `None` after the one of status `end`.
    ///
    /// # Errors
    /// The first thing wrong, by table, line and column.
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
        // As many as the table has: the number that was asked for may be any.
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

/// Reads the row of a step's body, joint or gear, and its first three columns.
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
        restitution_share: sheet.number(13)?,
        energy: sheet.number(14)?,
        works: sheet.numbers(15)?,
        stiffness: if tied { sheet.number(21)? } else { 0.0 },
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

/// The sheet of a table, of a run with joints or without.
fn sheet<R: Read>(table: Table, stream: R, joints: bool) -> Result<TableReader<R>, RowsError> {
    let columns = table.columns(joints).iter().map(|&name| name.to_owned());
    TableReader::new(table.name(), stream, |_| columns.collect())
}
