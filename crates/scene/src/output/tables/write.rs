//! Writer of tables from step records.

use super::columns::{Cells, ContactRow, GearTableRow, JointRow, StateRow, StepRow};
use super::{KeyText, Streams, Table, TableShape, TableStep};
use crate::output::rows::{RowChoice, RowWriter};
use nalgebra::Vector3;
use std::array;
use std::convert::Infallible;
use std::io::{self, Write};
use tumble_core::contact::Contact;
use tumble_core::contact::certificate::Claim;
use tumble_core::joint::{Gear, Joint, JointForce, JointResidual, Knots};
use tumble_core::mechanics::State;
use tumble_core::simulation::summary::StatusCount;
use tumble_core::simulation::{EnergyBalance, StepRecord, energy};
use tumble_core::step::StepStatus;
use tumble_core::world::{Integrator, World};

/// Writes the tables of a run step by step.
pub struct TablesWriter<W: Write> {
    tables: Streams<RowWriter<W>>,
    world: World,
    /// Prescribed motions of joint frames in the world.
    courses: Vec<(usize, Knots)>,
    kept: RowChoice,
    /// True if idle contacts have no rows.
    loaded_contacts: bool,
    /// Row of the table `steps` whose sums are not complete, if rows are omitted.
    open: Option<StepRow>,
}

impl<W: Write> TablesWriter<W> {
    /// Writes the headers of a run in `world`.
    ///
    /// # Errors
    /// The errors of the streams.
    pub fn new(streams: Streams<W>, world: &World) -> io::Result<Self> {
        let shape = TableShape::new(world);
        let csv = |table: Table, stream| {
            Ok::<_, io::Error>(RowWriter::new(stream, table.columns(&shape)))
        };
        Ok(Self::with_writers(streams.each(csv)?, world))
    }

    /// Continues tables that already have headers, and possibly rows.
    #[must_use]
    pub fn after(streams: Streams<W>, world: &World) -> Self {
        let Ok(tables) = streams.each(|_, stream| Ok::<_, Infallible>(RowWriter::after(stream)));
        Self::with_writers(tables, world)
    }

    fn with_writers(tables: Streams<RowWriter<W>>, world: &World) -> Self {
        let (courses, kept) = (Vec::new(), RowChoice::ALL);
        Self { tables, world: world.clone(), courses, kept, loaded_contacts: false, open: None }
    }

    /// Sets the prescribed motions of joint frames in the world.
    #[must_use]
    pub fn driven(mut self, courses: Vec<(usize, Knots)>) -> Self {
        self.courses = courses;
        self
    }

    /// Writes only every `every`-th step, counted from the step `first`, and the last state.
    ///
    /// 0 means every step.
    #[must_use]
    pub fn every(mut self, every: u64, first: u64) -> Self {
        self.kept = RowChoice::new(every, first);
        self
    }

    /// If `idle` is true, [`TablesWriter::write`] omits idle contacts: those without force and rebound
    /// that end the step with a gap of 0 or more. They add nothing to the residual.
    #[must_use]
    pub fn without_idle_contacts(mut self, idle: bool) -> Self {
        self.loaded_contacts = idle;
        self
    }

    /// Sets the row of the table `steps` that [`TablesWriter::open`] returned at the end of the
    /// existing rows.
    #[must_use]
    pub fn continue_from(mut self, open: Option<StepRow>) -> Self {
        self.open = open;
        self
    }

    /// Row of the table `steps` that is not written yet, because steps up to the next row may
    /// follow. `None` if every step has rows.
    pub fn open(&self) -> Option<&StepRow> {
        self.open.as_ref()
    }

    /// Writes the rows of a step, if the step is selected. Otherwise adds its energy terms and its
    /// mark to the row before.
    ///
    /// # Errors
    /// The errors of the streams.
    pub fn write(&mut self, record: &StepRecord) -> io::Result<()> {
        let is_end = record.report.status == StepStatus::End;
        let StepRecord { substeps, index, .. } = record;
        self.world.set_substep((substeps.length > 0.0).then_some([0.0, substeps.length]));
        let start = *index as f64 * self.world.whole_step();
        let time = if is_end { start } else { self.world.time_after(*index) };
        self.world.follow(&self.courses, time);
        if !self.kept.has(record.index, record.report.status) {
            if let Some(open) = &mut self.open {
                open.add(record, &works(&self.world, record));
            }
            return Ok(());
        }
        self.end_open()?;
        let mut step = TableStep::new(&self.world, record);
        if self.loaded_contacts {
            let ends = &record.solution.states;
            let is_open = |row: &ContactRow| record.contacts[row.index].gap_in(ends) >= 0.0;
            let acts = |row: &ContactRow| row.force != Vector3::zeros() || row.rebound != 0.0;
            step.contacts.retain(|row| acts(row) || !is_open(row));
        }
        if self.tables.ends.is_some() && !is_end {
            step.ends.extend_from_slice(&record.solution.states);
        }
        if !self.kept.omits() || is_end {
            return self.write_step(&step);
        }
        self.write_beside(&step)?;
        self.open = Some(step.row);
        Ok(())
    }

    /// Writes the open row.
    fn end_open(&mut self) -> io::Result<()> {
        self.open.take().map_or(Ok(()), |row| self.write_steps_row(&row))
    }

    /// Writes the given rows of a step, without selection.
    ///
    /// # Errors
    /// The errors of the streams.
    pub fn write_step(&mut self, step: &TableStep) -> io::Result<()> {
        self.write_steps_row(&step.row)?;
        self.write_beside(step)
    }

    /// Writes a row of the table `steps`.
    fn write_steps_row(&mut self, row: &StepRow) -> io::Result<()> {
        let steps = &mut self.tables.steps;
        row.write(steps);
        (0..TableShape::new(&self.world).missing_columns()).for_each(|_| steps.drop_cell());
        steps.end_row()
    }

    /// Writes the rows of a step in all tables but `steps`.
    fn write_beside(&mut self, step: &TableStep) -> io::Result<()> {
        let missing_moments = TableShape::new(&self.world).missing_columns_of_contacts();
        let Streams { states, contacts, steps: _, joints, gears, ends } = &mut self.tables;
        let row = &step.row;
        if self.world.integrator() == Integrator::Euler {
            write_all(states, row, &step.states)?;
        } else {
            let pairs = step.instant_states().iter().zip(&step.states);
            let rows = pairs.map(|(instant, State { velocity, spin, .. })| StateRow {
                instant: *instant,
                middle: [*velocity, *spin],
            });
            write_all(states, row, &rows.collect::<Vec<_>>())?;
        }
        if let Some(table) = ends {
            write_all(table, row, &step.ends)?;
        }
        if let Some(table) = contacts {
            for contact in &step.contacts {
                table.whole(row.index);
                contact.write(table);
                (0..missing_moments).for_each(|_| table.drop_cell());
                table.end_row()?;
            }
        }
        if let Some(table) = joints {
            write_all(table, row, &step.joints)?;
        }
        if let Some(table) = gears {
            write_all(table, row, &step.gears)?;
        }
        Ok(())
    }

    /// Flushes all streams and returns them in the order of [`Streams`].
    ///
    /// # Errors
    /// The errors of the streams.
    pub fn flushed(&mut self) -> io::Result<Vec<&mut W>> {
        let Streams { states, contacts, steps, joints, gears, ends } = &mut self.tables;
        let all = [
            Some(states),
            contacts.as_mut(),
            Some(steps),
            joints.as_mut(),
            gears.as_mut(),
            ends.as_mut(),
        ];
        all.into_iter().flatten().map(RowWriter::flushed).collect()
    }

    /// Flushes and returns the streams. The last rows may be missing from them before this call.
    ///
    /// # Errors
    /// The errors of the streams.
    pub fn finish(self) -> io::Result<Streams<W>> {
        self.tables.each(|_, rows| rows.finish())
    }
}

/// Writes one row per body, joint or gear of a step.
fn write_all<W: Write>(
    table: &mut RowWriter<W>,
    row: &StepRow,
    values: &[impl Cells],
) -> io::Result<()> {
    for (index, value) in values.iter().enumerate() {
        table.whole(row.index);
        table.number(row.time);
        table.whole(index as u64);
        value.write(table);
        table.end_row()?;
    }
    Ok(())
}

impl TableStep {
    /// Rows of a step of a simulation of `world`.
    ///
    /// Joint frames with a prescribed motion must be in `world` at their pose at the end of the
    /// step. A record without the state of a body gives NaN for its contact points and joint
    /// coordinates. Records of a simulation have all states.
    #[must_use]
    pub fn new(world: &World, record: &StepRecord) -> Self {
        let is_end = record.report.status == StepStatus::End;
        let certificate = if is_end { Default::default() } else { record.certificate };
        let row = StepRow {
            index: record.index,
            // k h with one rounding, so that times do not drift.
            time: record.index as f64 * world.whole_step(),
            status: record.report.status,
            iterations: record.report.iterations,
            start: record.report.start.unwrap_or("").to_owned(),
            contacts: record.contacts.len(),
            residual: certificate.residual(),
            parts: certificate.contact_parts().map(|(_, part)| part),
            overlap: record.overlap,
            placement: record.placement,
            restitution_share: record.restitution_share,
            energy: energy::total(world, &record.states),
            works: if is_end { [0.0; 6] } else { works(world, record) },
            stiffness: if is_end { 0.0 } else { record.stiffness },
            substeps_taken: record.substeps.count,
            substep_length: record.substeps.length,
            error: record.substeps.error,
        };
        let contacts = ContactRow::from_record(record).collect();
        let joints = JointRow::from_record(world, record).collect();
        let gears = GearTableRow::from_record(world, record).collect();
        Self {
            row,
            states: record.states.clone(),
            instants: record.instants.clone(),
            ends: Vec::new(),
            contacts,
            joints,
            gears,
        }
    }
}

impl StepRow {
    /// Entry of the step in the summary of its run.
    #[must_use]
    pub fn count(&self) -> StatusCount {
        StatusCount {
            index: self.index,
            status: self.status,
            iterations: self.iterations,
            residual: self.residual,
            part: "",
            restitution_share: self.restitution_share,
        }
    }

    /// Adds the status, the error and the energy terms (J) of a step between this row and the next.
    fn add(&mut self, record: &StepRecord, works: &[f64; 6]) {
        self.error += record.substeps.error;
        self.works.iter_mut().zip(works).for_each(|(sum, work)| *sum += work);
        self.status = self.status.with_later(record.report.status);
    }
}

/// Terms of the energy balance of a step (J).
fn works(world: &World, record: &StepRecord) -> [f64; 6] {
    let StepRecord { states, wrenches, contacts, solution, .. } = record;
    let (next, joints, gears) = (&solution.states, &solution.joints, &solution.gears);
    let claim = Claim { states, next, wrenches, contacts, joints, gears };
    let first = EnergyBalance::new(world, &claim, solution.loads()).terms();
    array::from_fn(|k| first[k] + record.substeps.works[k])
}

impl JointRow {
    /// Rows of the joints of `world` in a step; see [`TableStep::new`].
    pub fn from_record<'a>(
        world: &'a World,
        record: &'a StepRecord,
    ) -> impl Iterator<Item = Self> + 'a {
        let is_end = record.report.status == StepStatus::End;
        world.joints().iter().enumerate().map(move |(index, joint)| {
            let force = record.solution.joints.get(index);
            let force = force.copied().unwrap_or(JointForce::none(Vector3::zeros()));
            let next = (!is_end).then_some(&record.solution.states[..]);
            Self::between(world, joint, &record.states, next, &force)
        })
    }

    /// Row of `joint` for a step from `states` to `next` under `force`; `None` for a state without
    /// a step.
    #[must_use]
    pub fn between(
        world: &World,
        joint: &Joint,
        states: &[State],
        next: Option<&[State]>,
        force: &JointForce,
    ) -> Self {
        let unknown = Vector3::repeat(f64::NAN);
        let at = joint.coordinates(states);
        let turns = at.map_or(unknown, |at| joint.turns(&at, &force.angles));
        let mut row = Self {
            place: at.map_or(unknown, |at| at.place),
            turns,
            velocity: Vector3::zeros(),
            spin: Vector3::zeros(),
            force: force.force,
            torque: force.torque,
            residual: JointResidual::default(),
        };
        if let (Some(at), Some(next)) = (at, next) {
            let (h, after) = (world.time_step(), joint.coordinates(next));
            let rates = after.map(|after| joint.rates(&at, &after, &turns, h));
            (row.velocity, row.spin) = rates.unwrap_or((unknown, unknown));
            row.residual = joint.residual(world.bodies(), states, next, force, h);
        }
        row
    }

    /// Position, angles, their rates, force and torque.
    #[must_use]
    pub fn vectors(&self) -> [Vector3<f64>; 6] {
        [self.place, self.turns, self.velocity, self.spin, self.force, self.torque]
    }
}

impl GearTableRow {
    /// Rows of the gears of `world` in a step; see [`TableStep::new`].
    pub fn from_record<'a>(
        world: &'a World,
        record: &'a StepRecord,
    ) -> impl Iterator<Item = Self> + 'a {
        let (solution, is_end) = (&record.solution, record.report.status == StepStatus::End);
        world.gears().iter().enumerate().map(move |(index, gear)| {
            let force = solution.gears.get(index).copied().unwrap_or(0.0);
            let next = (!is_end).then_some(&solution.states[..]);
            Self::between(world, gear, &record.states, next, &solution.joints, force)
        })
    }

    /// Row of `gear` for a step from `states` to `next`; `None` for a state without a step.
    ///
    /// `joints` are the forces and angles of the joints, `force` is the gear's force (N or N m).
    #[must_use]
    pub fn between(
        world: &World,
        gear: &Gear,
        states: &[State],
        next: Option<&[State]>,
        joints: &[JointForce],
        force: f64,
    ) -> Self {
        let near: Vec<_> = gear.axes().map(|of| joints.get(of.joint).map(|of| of.angles)).into();
        let coordinate = |k: usize| {
            let near = near[k].unwrap_or_default();
            gear.axes()[k].coordinate(world.joints(), states, &near)
        };
        let residual = next.map_or(0.0, |next| gear.residual(world, states, next, joints, force));
        Self { coordinates: [coordinate(0), coordinate(1)], force, residual }
    }
}

impl ContactRow {
    /// Rows of the contacts of a step, in the order of its solution; see [`TableStep::new`].
    #[inline]
    pub fn from_record(record: &StepRecord) -> impl Iterator<Item = Self> + '_ {
        let point = |contact: &Contact| {
            let state = record.states.get(contact.key.body);
            state.map_or(Vector3::repeat(f64::NAN), |state| state.position + contact.arm)
        };
        let pairs = record.contacts.iter().zip(&record.solution.contacts);
        pairs.enumerate().map(move |(index, (contact, found))| Self {
            index,
            body: contact.key.body,
            partner: contact.key.partner,
            point: point(contact),
            normal: contact.normal(),
            force: found.force,
            slip: found.slip,
            gap: contact.gap,
            radius: contact.features.radius,
            rebound: contact.rebound,
            key: KeyText::new(&contact.key),
            moment: record.solution.moment(index),
        })
    }
}
