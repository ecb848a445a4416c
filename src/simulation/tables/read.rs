//! Rows become steps, every header, order and field checked.

use super::{KeyText, Streams, Table};
use crate::contact::Partner;
use crate::joint::JointResidual;
use crate::mechanics::State;
use crate::simulation::sheet::{RowsError, Sheet};
use crate::step::StepStatus;
use nalgebra::Vector3;
use std::io::Read;

/// One step as it was read.
#[derive(Debug, Clone, PartialEq)]
pub struct TableStep {
    /// Its row of the table `steps`.
    pub row: StepRow,
    /// X at step k, one a body.
    pub states: Vec<State>,
    /// The contacts of the step k → k+1.
    pub contacts: Vec<ContactRow>,
    /// The joints, one a joint of the world.
    pub joints: Vec<JointRow>,
    /// The gears, one a gear of the world.
    pub gears: Vec<GearRow>,
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
    /// Its parts, m/s, in the order of [`Certificate::parts`](crate::contact::Certificate::parts).
    pub parts: [f64; 5],
    /// How deep pieces overlap at k+1, m.
    pub overlap: f64,
    /// The smallest part of the restitution that an island took.
    pub restitution_share: f64,
    /// The [energy](crate::simulation::energy) at k, J.
    pub energy: f64,
    /// See [`StepRecord::stiffness`](crate::simulation::StepRecord::stiffness); 0 without joints.
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
    /// The [turns](crate::joint::Joint::turns) at k, rad.
    pub turns: Vector3<f64>,
    /// The mean rates of the place over the step, m/s.
    pub velocity: Vector3<f64>,
    /// Those of the turns, rad/s.
    pub spin: Vector3<f64>,
    /// See [`JointForce::force`](crate::joint::JointForce::force), N.
    pub force: Vector3<f64>,
    /// See [`JointForce::torque`](crate::joint::JointForce::torque), N m.
    pub torque: Vector3<f64>,
    /// Its part of the step's residual, m/s.
    pub residual: JointResidual,
}

/// A row of the table `gears`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GearRow {
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
    states: Sheet<R>,
    contacts: Sheet<R>,
    steps: Sheet<R>,
    joints: Option<Sheet<R>>,
    gears: Option<Sheet<R>>,
    counts: [usize; 3],
    next_index: u64,
    /// Whether the first step may have any k.
    any_start: bool,
    ended: bool,
}

impl<R: Read> TablesReader<R> {
    /// Reads and checks the headers of the tables of so many `bodies`, `joints` and `gears`.
    ///
    /// # Errors
    /// [`RowsError::Header`], or a stream's; joints or gears without a table of them.
    pub fn new(
        streams: Streams<R>,
        bodies: usize,
        (joints, gears): (usize, usize),
    ) -> Result<Self, RowsError> {
        let counts = [bodies, joints, gears];
        let tied = streams.joints.is_some();
        let sheet = |table, stream| sheet(table, stream, tied);
        let joints = streams.joints.map(|stream| sheet(Table::Joints, stream)).transpose()?;
        let gears = streams.gears.map(|stream| sheet(Table::Gears, stream)).transpose()?;
        for (table, is_missing, why) in [
            (Table::Joints, joints.is_none(), "it is not given, and the run has joints"),
            (Table::Gears, gears.is_none(), "it is not given, and the run has gears"),
        ] {
            let count = if table == Table::Joints { counts[1] } else { counts[2] };
            if is_missing && count > 0 {
                return Err(RowsError::End { table: table.name(), why });
            }
        }
        Ok(Self {
            states: sheet(Table::States, streams.states)?,
            contacts: sheet(Table::Contacts, streams.contacts)?,
            steps: sheet(Table::Steps, streams.steps)?,
            joints,
            gears,
            counts,
            next_index: 0,
            any_start: false,
            ended: false,
        })
    }

    /// The same of a run whose first k is `index`.
    #[must_use]
    pub fn from_index(mut self, index: u64) -> Self {
        self.next_index = index;
        self
    }

    /// The same of a part of a run, whose first step may have any k.
    #[must_use]
    pub fn of_part(mut self) -> Self {
        self.any_start = true;
        self
    }

    /// The next step; `None` after the one of status `end`.
    ///
    /// # Errors
    /// The first thing wrong, by table, line and column.
    pub fn next_step(&mut self) -> Result<Option<TableStep>, RowsError> {
        if self.ended {
            let always = [&mut self.states, &mut self.contacts, &mut self.steps];
            for sheet in always.into_iter().chain(&mut self.joints).chain(&mut self.gears) {
                sheet.need_end(TOO_LONG)?;
            }
            return Ok(None);
        }
        let row = self.step_row()?;
        // As many as the table has: the number that was asked for may be any.
        let [bodies, joints_in_all, gears_in_all] = self.counts;
        let mut states = Vec::with_capacity(bodies.min(1 << 12));
        for body in 0..bodies {
            let sheet = &mut self.states;
            sheet.need_row(CUT_OFF)?;
            sheet.expect(0, self.next_index)?;
            sheet.expect(2, body as u64)?;
            let state = sheet.numbers::<13>(3)?;
            if sheet.number(1)? != row.time {
                return Err(sheet.odd(1, "the time of the same step in the table steps"));
            }
            states.push(State::from_vector(&state.into()));
        }
        let mut contacts = Vec::new();
        for index in 0..row.contacts {
            contacts.push(self.contact_row(index)?);
        }
        let mut joints = Vec::with_capacity(joints_in_all.min(1 << 12));
        for index in 0..joints_in_all {
            joints.extend(self.joint_row(index, row.time)?);
        }
        let mut gears = Vec::with_capacity(gears_in_all.min(1 << 12));
        for index in 0..gears_in_all {
            gears.extend(self.gear_row(index, row.time)?);
        }
        self.next_index += 1;
        self.ended = row.status == StepStatus::End;
        Ok(Some(TableStep { row, states, contacts, joints, gears }))
    }

    fn step_row(&mut self) -> Result<StepRow, RowsError> {
        let sheet = &mut self.steps;
        sheet.need_row(CUT_OFF)?;
        if std::mem::take(&mut self.any_start) {
            self.next_index = sheet.whole(0)?;
        }
        sheet.expect(0, self.next_index)?;
        Ok(StepRow {
            index: self.next_index,
            time: sheet.number(1)?,
            status: sheet.field(2, "a status", StepStatus::from_name)?,
            iterations: sheet.whole(3)?,
            start: sheet.text(4).to_owned(),
            contacts: sheet.whole(5)?,
            residual: sheet.number(6)?,
            parts: sheet.numbers(7)?,
            overlap: sheet.number(12)?,
            restitution_share: sheet.number(13)?,
            energy: sheet.number(14)?,
            stiffness: if self.joints.is_some() { sheet.number(15)? } else { 0.0 },
        })
    }

    fn joint_row(&mut self, index: usize, time: f64) -> Result<Option<JointRow>, RowsError> {
        let Some(sheet) = &mut self.joints else { return Ok(None) };
        sheet.need_row(CUT_OFF)?;
        sheet.expect(0, self.next_index)?;
        sheet.expect(2, index as u64)?;
        if sheet.number(1)? != time {
            return Err(sheet.odd(1, "the time of the same step in the table steps"));
        }
        let vector = |first| sheet.numbers::<3>(first).map(Vector3::from);
        let [locked, drive] = sheet.numbers(21)?;
        Ok(Some(JointRow {
            place: vector(3)?,
            turns: vector(6)?,
            velocity: vector(9)?,
            spin: vector(12)?,
            force: vector(15)?,
            torque: vector(18)?,
            residual: JointResidual { locked, drive },
        }))
    }

    fn gear_row(&mut self, index: usize, time: f64) -> Result<Option<GearRow>, RowsError> {
        let Some(sheet) = &mut self.gears else { return Ok(None) };
        sheet.need_row(CUT_OFF)?;
        sheet.expect(0, self.next_index)?;
        sheet.expect(2, index as u64)?;
        if sheet.number(1)? != time {
            return Err(sheet.odd(1, "the time of the same step in the table steps"));
        }
        Ok(Some(GearRow {
            coordinates: sheet.numbers(3)?,
            force: sheet.number(5)?,
            residual: sheet.number(6)?,
        }))
    }

    fn contact_row(&mut self, index: usize) -> Result<ContactRow, RowsError> {
        let sheet = &mut self.contacts;
        sheet.need_row(CUT_OFF)?;
        sheet.expect(0, self.next_index)?;
        sheet.expect(1, index as u64)?;
        let place = sheet.whole(4)?;
        let partner = sheet.field(3, "ground, fixed or body", |text| match text {
            "ground" => Some(Partner::Ground),
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
}

/// The sheet of a table, of a run with joints or without.
fn sheet<R: Read>(table: Table, stream: R, joints: bool) -> Result<Sheet<R>, RowsError> {
    let columns = table.columns(joints).iter().map(|&name| name.to_owned());
    Sheet::new(table.name(), stream, |_| columns.collect())
}
