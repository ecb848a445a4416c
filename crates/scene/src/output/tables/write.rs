//! Writer of tables from step records.

use super::columns::{Cells, ContactRow, GearTableRow, JointRow, StateRow, StepRow};
use super::contact_runs::OpenRuns;
use super::digits::Digits;
use super::{IntervalRows, KeyText, Streams, Table, TableShape};
use crate::output::rows::{RowChoice, RowWriter};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use std::convert::Infallible;
use std::io::{self, Write};
use std::sync::Arc;
use tumble_core::contact::Contact;
use tumble_core::joint::{JointForce, JointResidual, Knots};
use tumble_core::mechanics::State;
use tumble_core::simulation::summary::StatusCount;
use tumble_core::simulation::{Interval, StepRecord};
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
    /// True if states that do not change have no rows.
    is_short: bool,
    /// Rounding of whole steps.
    digits: Option<Digits>,
    open: OpenRows,
}

/// Rows that are not written yet, because they depend on the next ones.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct OpenRows {
    /// Row of the table `steps` whose sums are not complete, if rows are omitted.
    steps: Option<StepRow>,
    /// Interval of the last rows, and the states at its end.
    end: Option<(StepRow, Vec<State>)>,
    /// States in the last rows, if they are those of a whole step in short tables.
    last: Option<BodyStates>,
    /// Contacts that may stay the same.
    contacts: OpenRuns,
    /// True if the table `ends` has rows.
    pub has_ends: bool,
}

/// States of the bodies in the rows of an interval, as in [`IntervalRows`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct BodyStates {
    instants: Vec<State>,
    states: Vec<State>,
    before: Box<[f64]>,
}

impl BodyStates {
    /// Numbers in the row of a body.
    fn row(&self, body: usize) -> StateRow {
        let state = self.states[body];
        StateRow {
            instant: self.instants.get(body).copied().unwrap_or(state),
            before: self.before.get(body).copied().unwrap_or(0.0),
            ..StateRow::without_middle(state)
        }
    }
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

    /// Continues tables that already have headers, and possibly rows. `open` are the rows that
    /// [`TablesWriter::open`] returned at their end. A table `ends` without rows is empty.
    pub fn after(streams: Streams<W>, world: &World, open: OpenRows) -> Self {
        let shape = TableShape::new(world);
        let Ok(tables) = streams.each(|table, stream| {
            let begins = table == Table::Ends && !open.has_ends;
            Ok::<_, Infallible>(if begins {
                RowWriter::new(stream, table.columns(&shape))
            } else {
                RowWriter::after(stream)
            })
        });
        Self { open, ..Self::with_writers(tables, world) }
    }

    fn with_writers(tables: Streams<RowWriter<W>>, world: &World) -> Self {
        Self {
            tables,
            world: world.clone(),
            courses: Vec::new(),
            kept: RowChoice::ALL,
            loaded_contacts: false,
            is_short: false,
            digits: None,
            open: OpenRows::default(),
        }
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

    /// If `idle` is true, [idle](IntervalRows::idle) contacts have no rows.
    #[must_use]
    pub fn without_idle_contacts(mut self, idle: bool) -> Self {
        self.loaded_contacts = idle;
        self
    }

    /// If `is_short` is true, numbers of whole steps are rounded, and a body has no row in a whole step
    /// after another one if its state has not changed. The first and the last rows are exact.
    #[must_use]
    pub fn short(mut self, is_short: bool) -> Self {
        self.is_short = is_short;
        self.digits = is_short.then(|| Digits::new(&self.world)).flatten();
        self
    }

    /// Rows that are not written yet.
    pub fn open(&self) -> &OpenRows {
        &self.open
    }

    /// Writes the rows of a step, if the step is selected. Otherwise adds its energy terms and its
    /// mark to the row before.
    ///
    /// # Errors
    /// The errors of the streams.
    pub fn write(&mut self, record: &StepRecord) -> io::Result<()> {
        let status = record.status();
        let is_end = status == StepStatus::End;
        let index = record.index;
        let world = &mut self.world;
        let time = if is_end { world.time_before(index) } else { world.time_after(index) };
        world.follow(&self.courses, time);
        if !self.kept.has(index, status) {
            if let Some(open) = &mut self.open.steps {
                for interval in record.intervals() {
                    open.add(interval, &interval.balance(&interval.world(world)).terms());
                }
            }
            return Ok(());
        }
        for (number, interval) in record.intervals().iter().enumerate() {
            self.write_rows(&IntervalRows::new(&self.world, index, number, interval))?;
        }
        Ok(())
    }

    /// Writes the rows of an interval.
    ///
    /// # Errors
    /// The errors of the streams.
    pub fn write_rows(&mut self, rows: &IntervalRows) -> io::Result<()> {
        if let Some(row) = self.open.steps.take() {
            self.write_steps_row(&row)?;
        }
        let is_whole = rows.row.interval == 0 && rows.row.length == self.world.whole_step();
        self.write_end(&rows.states, is_whole)?;
        self.write_states(rows, is_whole)?;
        self.write_beside(rows, is_whole)?;
        let is_end = rows.row.status == StepStatus::End;
        if self.tables.ends.is_some() && !rows.ends.is_empty() {
            self.open.end = Some((rows.row.clone(), rows.ends.clone()));
        }
        if self.kept.omits() && !is_end {
            self.open.steps = Some(rows.row.clone());
            return Ok(());
        }
        self.write_steps_row(&rows.row)
    }

    /// States at the start of an interval, rounded if it and the one before are whole steps: then no
    /// state is that of a shorter interval.
    fn rounded(&self, states: &[State], is_whole: bool) -> Vec<State> {
        let is_rounded = is_whole && self.open.last.is_some();
        match self.digits.as_ref().filter(|_| is_rounded) {
            Some(digits) => states.iter().map(|state| digits.state(state)).collect(),
            None => states.to_vec(),
        }
    }

    /// Writes the states at the end of the last interval, unless the next one, a whole step if `is_whole`,
    /// starts there.
    fn write_end(&mut self, next: &[State], is_whole: bool) -> io::Result<()> {
        let Some((row, ends)) = self.open.end.take().filter(|(_, ends)| ends != next) else {
            return Ok(());
        };
        let ends = self.rounded(&ends, is_whole);
        let Some(table) = &mut self.tables.ends else { return Ok(()) };
        self.open.has_ends = true;
        write_all(table, &row, &ends)
    }

    /// Writes the states of an interval, which is a whole step if `is_whole`.
    fn write_states(&mut self, step: &IntervalRows, is_whole: bool) -> io::Result<()> {
        let written = BodyStates {
            instants: self.rounded(&step.instants, is_whole),
            states: self.rounded(&step.states, is_whole),
            before: step.before.clone(),
        };
        let last = self.open.last.take().filter(|_| is_whole);
        for body in 0..written.states.len() {
            let row = written.row(body);
            if last.as_ref().is_some_and(|last| last.row(body) == row) {
                continue;
            }
            let table = &mut self.tables.states;
            match self.world.integrator() {
                Integrator::Euler => write_row(table, &step.row, body, &written.states[body])?,
                Integrator::Leapfrog => write_row(table, &step.row, body, &row)?,
            }
        }
        self.open.last = (self.is_short && is_whole).then_some(written);
        Ok(())
    }

    /// Writes a row of the table `steps`.
    fn write_steps_row(&mut self, row: &StepRow) -> io::Result<()> {
        let steps = &mut self.tables.steps;
        row.write(steps);
        (0..TableShape::new(&self.world).missing_columns()).for_each(|_| steps.drop_cell());
        steps.end_row()
    }

    /// Writes the rows of an interval in the tables of contacts, joints and gears.
    fn write_beside(&mut self, step: &IntervalRows, is_whole: bool) -> io::Result<()> {
        let missing_moments = TableShape::new(&self.world).missing_columns_of_contacts();
        let Streams { contacts, joints, gears, .. } = &mut self.tables;
        let row = &step.row;
        if let Some(table) = contacts {
            let is_idle = |place: usize| step.idle.get(place) == Some(&true);
            let omits = |place: usize| self.loaded_contacts && is_idle(place);
            let rows = step.contacts.iter().enumerate().filter(|(place, _)| !omits(*place));
            let digits = self.digits.as_ref().filter(|_| is_whole);
            let rows = rows.map(|(_, contact)| match digits {
                Some(digits) => digits.contact(contact),
                None => contact.clone(),
            });
            self.open.contacts.add(row, is_whole, rows, table, missing_moments)?;
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
    pub fn finish(mut self) -> io::Result<Streams<W>> {
        let missing = TableShape::new(&self.world).missing_columns_of_contacts();
        if let Some(table) = &mut self.tables.contacts {
            self.open.contacts.finish(table, missing)?;
        }
        self.tables.each(|_, rows| rows.finish())
    }
}

/// Writes one row per body, joint or gear of an interval.
fn write_all<W: Write>(
    table: &mut RowWriter<W>,
    row: &StepRow,
    values: &[impl Cells],
) -> io::Result<()> {
    values.iter().enumerate().try_for_each(|(index, value)| write_row(table, row, index, value))
}

/// Writes the row of one body, joint or gear of an interval.
fn write_row<W: Write>(
    table: &mut RowWriter<W>,
    row: &StepRow,
    index: usize,
    value: &impl Cells,
) -> io::Result<()> {
    table.whole(row.index);
    table.number(row.time);
    table.whole(index as u64);
    value.write(table);
    table.whole(row.interval.into());
    table.number(row.length);
    table.end_row()
}

impl IntervalRows {
    /// Rows of all intervals of a step of a simulation of `world`; see [`IntervalRows::new`].
    pub fn from_step(world: &World, record: &StepRecord) -> Vec<Self> {
        let intervals = record.intervals().iter().enumerate();
        intervals
            .map(|(number, interval)| Self::new(world, record.index, number, interval))
            .collect()
    }

    /// Rows of an `interval` with this `number` in step `index` of a simulation of `world`.
    ///
    /// Joint frames with a prescribed motion must be in `world` at their pose at the end of the
    /// step. An interval without the state of a body gives NaN for its contact points and joint
    /// coordinates. Those of a simulation have all states.
    pub fn new(world: &World, index: u64, number: usize, interval: &Interval) -> Self {
        let is_end = interval.report.status == StepStatus::End;
        let certificate = if is_end { Default::default() } else { interval.certificate };
        let world = &*interval.world(world);
        let length = if is_end { 0.0 } else { world.time_step() };
        let row = StepRow {
            index,
            interval: number as u32,
            length,
            time: world.time_before(index),
            status: interval.report.status,
            iterations: interval.report.iterations,
            start: interval.report.start.unwrap_or("").to_owned(),
            contacts: interval.contacts.len(),
            residual: certificate.residual(),
            parts: certificate.contact_parts().map(|(_, part)| part),
            overlap: interval.overlap,
            placement: interval.placement,
            restitution_share: interval.restitution_share,
            energy: interval.energy(world),
            works: if is_end { [0.0; 6] } else { interval.balance(world).terms() },
            stiffness: if is_end { 0.0 } else { interval.stiffness },
            usual: interval.span.filter(|_| !is_end).map_or(length, |span| span.usual),
            error: if is_end { 0.0 } else { interval.error() },
        };
        let contact = |mut contact: ContactRow| {
            (contact.interval, contact.length) = (row.interval, length);
            contact
        };
        let mut before = interval.before.clone();
        if world.integrator() == Integrator::Leapfrog {
            before.resize(interval.states.len(), length);
        }
        let ends = &interval.solution.states;
        let pairs = interval.contacts.iter().zip(&interval.solution.contacts);
        let is_idle = pairs.map(|(contact, found)| {
            found.force == Vector3::zeros() && contact.rebound == 0.0 && contact.gap_in(ends) >= 0.0
        });
        Self {
            states: interval.states.clone(),
            instants: interval.instants.clone(),
            before: before.into(),
            ends: if is_end { Vec::new() } else { interval.solution.states.clone() },
            idle: is_idle.collect(),
            contacts: Arc::new(ContactRow::from_interval(interval).map(contact).collect()),
            joints: JointRow::from_interval(world, interval).collect(),
            gears: GearTableRow::from_interval(world, interval).collect(),
            row,
        }
    }
}

impl StepRow {
    /// Entry of the step in the summary of its run.
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

    /// Adds the status, the error and the energy terms (J) of an interval between this row and the next.
    fn add(&mut self, interval: &Interval, works: &[f64; 6]) {
        self.error += interval.error();
        self.works.iter_mut().zip(works).for_each(|(sum, work)| *sum += work);
        self.status = self.status.with_later(interval.report.status);
    }
}

impl JointRow {
    /// Rows of the joints of `world` in an interval; see [`IntervalRows::new`].
    pub fn from_interval<'a>(
        world: &'a World,
        interval: &'a Interval,
    ) -> impl Iterator<Item = Self> + 'a {
        let is_end = interval.report.status == StepStatus::End;
        let held = world.held_back(&interval.states, &interval.solution.joints);
        (0..world.joints().len()).map(move |index| {
            let force = interval.solution.joints.get(index);
            let force = force.copied().unwrap_or(JointForce::none(Vector3::zeros()));
            let next = (!is_end).then_some(&interval.solution.states[..]);
            let mut row = Self::between([world, &held], index, &interval.states, next, &force);
            let joint = &world.joints()[index];
            let kick = interval.kick(joint.body(), joint.other());
            if kick != 1.0 {
                row.force /= kick;
                row.torque /= kick;
            }
            row
        })
    }

    /// Row of joint `index` of `world` for an interval from `states` to `next` under `force`; `None` for a
    /// state without a step. `held` is the world with joints as the problem [has
    /// them](World::held_back).
    pub fn between(
        [world, held]: [&World; 2],
        index: usize,
        states: &[State],
        next: Option<&[State]>,
        force: &JointForce,
    ) -> Self {
        let unknown = Vector3::repeat(f64::NAN);
        let joint = &world.joints()[index];
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
            let held = &held.joints()[index];
            row.residual = held.residual(world.bodies(), states, next, force, &world.step_map());
        }
        row
    }

    /// Position, angles, their rates, force and torque.
    pub fn vectors(&self) -> [Vector3<f64>; 6] {
        [self.place, self.turns, self.velocity, self.spin, self.force, self.torque]
    }
}

impl GearTableRow {
    /// Rows of the gears of `world` in an interval; see [`IntervalRows::new`].
    pub fn from_interval<'a>(
        world: &'a World,
        interval: &'a Interval,
    ) -> impl Iterator<Item = Self> + 'a {
        let (solution, is_end) = (&interval.solution, interval.report.status == StepStatus::End);
        let held = world.held_back(&interval.states, &solution.joints);
        (0..world.gears().len()).map(move |index| {
            let force = solution.gears.get(index).copied().unwrap_or(0.0);
            let next = (!is_end).then_some(&solution.states[..]);
            let worlds = [world, &*held];
            let row = Self::between(worlds, index, &interval.states, next, &solution.joints, force);
            let joint = &world.joints()[world.gears()[index].axes()[0].joint];
            Self { force: row.force / interval.kick(joint.body(), joint.other()), ..row }
        })
    }

    /// Row of gear `index` of `world` for an interval from `states` to `next`; `None` for a state without
    /// a step. `held` is the world with gears as the problem [has them](World::held_back).
    ///
    /// `joints` are the forces and angles of the joints, `force` is the gear's force (N or N m).
    pub fn between(
        [world, held]: [&World; 2],
        index: usize,
        states: &[State],
        next: Option<&[State]>,
        joints: &[JointForce],
        force: f64,
    ) -> Self {
        let gear = &world.gears()[index];
        let near: Vec<_> = gear.axes().map(|of| joints.get(of.joint).map(|of| of.angles)).into();
        let coordinate = |k: usize| {
            let near = near[k].unwrap_or_default();
            gear.axes()[k].coordinate(world.joints(), states, &near)
        };
        let residual = next
            .map_or(0.0, |next| held.gears()[index].residual(held, states, next, joints, force));
        Self { coordinates: [coordinate(0), coordinate(1)], force, residual }
    }
}

impl ContactRow {
    /// Rows of the contacts of an interval, in the order of its solution; see [`IntervalRows::new`].
    /// They belong to the interval 0.
    #[inline]
    pub fn from_interval(interval: &Interval) -> impl Iterator<Item = Self> + '_ {
        let point = |contact: &Contact| {
            let state = interval.states.get(contact.key.body);
            state.map_or(Vector3::repeat(f64::NAN), |state| state.position + contact.arm)
        };
        let pairs = interval.contacts.iter().zip(&interval.solution.contacts);
        let kick = |contact: &Contact| interval.kick(contact.key.body, contact.key.partner.body());
        pairs.enumerate().map(move |(index, (contact, found))| Self {
            index,
            body: contact.key.body,
            partner: contact.key.partner,
            point: point(contact),
            normal: contact.normal(),
            force: found.force / kick(contact),
            slip: found.slip,
            gap: contact.gap + contact.held_gap,
            radius: contact.features.radius,
            rebound: contact.rebound,
            key: KeyText::new(&contact.key),
            friction: contact.law.friction,
            interval: 0,
            length: 0.0,
            moment: interval.solution.moment(index) / kick(contact),
        })
    }
}
