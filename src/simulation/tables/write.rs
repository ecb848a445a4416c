//! Records become rows.

use super::{ContactRow, KeyText, StepRow, Streams, Table, TableStep};
use crate::contact::{Contact, Partner};
use crate::simulation::{StepRecord, energy};
use crate::step::StepStatus;
use crate::world::World;
use nalgebra::Vector3;
use std::io::{self, Write};

/// Writes the tables of a run step by step.
pub struct TablesWriter<W: Write> {
    tables: Streams<csv::Writer<W>>,
    world: World,
}

impl<W: Write> TablesWriter<W> {
    /// Writes the headers of a run in `world`.
    ///
    /// # Errors
    /// The streams'.
    pub fn new(streams: Streams<W>, world: &World) -> csv::Result<Self> {
        let mut writer = Self::after(streams, world);
        let Streams { states, contacts, steps } = &mut writer.tables;
        for (table, csv) in Table::ALL.into_iter().zip([states, contacts, steps]) {
            csv.write_record(table.columns())?;
        }
        Ok(writer)
    }

    /// Goes on where the headers stand in the streams already, and maybe rows.
    #[must_use]
    pub fn after(streams: Streams<W>, world: &World) -> Self {
        let csv = |stream| csv::WriterBuilder::new().has_headers(false).from_writer(stream);
        let Streams { states, contacts, steps } = streams;
        let tables = Streams { states: csv(states), contacts: csv(contacts), steps: csv(steps) };
        Self { tables, world: world.clone() }
    }

    /// Writes the rows of one step.
    ///
    /// # Errors
    /// The streams'.
    pub fn write(&mut self, record: &StepRecord) -> csv::Result<()> {
        self.write_step(&TableStep::of(&self.world, record))
    }

    /// Writes the rows of a step that is rows already.
    ///
    /// # Errors
    /// The streams'.
    pub fn write_step(&mut self, step: &TableStep) -> csv::Result<()> {
        let Self { tables, .. } = self;
        let row = &step.row;
        for (body, state) in step.states.iter().enumerate() {
            let numbers = state.to_vector();
            tables.states.serialize((row.index, row.time, body, numbers.as_slice()))?;
        }
        tables.steps.serialize((
            (row.index, row.time),
            row.status.name(),
            row.iterations,
            &row.start,
            row.contacts,
            row.residual,
            row.parts,
            row.overlap,
            row.restitution_share,
            row.energy,
        ))?;
        for (index, contact) in step.contacts.iter().enumerate() {
            let (partner, partner_index) = match contact.partner {
                Partner::Ground => ("ground", 0),
                Partner::Fixed(index) => ("fixed", index),
                Partner::Body(index) => ("body", index),
            };
            let numbers = |vector: Vector3<f64>| <[f64; 3]>::from(vector);
            tables.contacts.serialize((
                (row.index, index, contact.body, partner, partner_index),
                numbers(contact.point),
                numbers(contact.normal),
                numbers(contact.force),
                numbers(contact.slip),
                contact.gap,
                contact.radius,
                contact.rebound,
                contact.key.to_string(),
            ))?;
        }
        Ok(())
    }

    /// Flushes and gives the streams back.
    ///
    /// # Errors
    /// The streams'.
    pub fn finish(self) -> io::Result<Streams<W>> {
        let end = |csv: csv::Writer<W>| csv.into_inner().map_err(csv::IntoInnerError::into_error);
        let Streams { states, contacts, steps } = self.tables;
        Ok(Streams { states: end(states)?, contacts: end(contacts)?, steps: end(steps)? })
    }
}

impl TableStep {
    /// The rows of a step of a simulation of `world`. The point of a contact is NaN whose body has
    /// no state in the record, which no simulation makes.
    #[must_use]
    pub fn of(world: &World, record: &StepRecord) -> Self {
        let is_end = record.report.status == StepStatus::End;
        let certificate = if is_end { Default::default() } else { record.certificate };
        let row = StepRow {
            index: record.index,
            // k h in one rounding, so that times do not drift.
            time: record.index as f64 * world.time_step(),
            status: record.report.status,
            iterations: record.report.iterations,
            start: record.report.start.unwrap_or("").to_owned(),
            contacts: record.contacts.len(),
            residual: certificate.residual(),
            parts: certificate.contact_parts().map(|(_, part)| part),
            overlap: record.overlap,
            restitution_share: record.restitution_share,
            energy: energy::total(world, &record.states),
        };
        let contacts = ContactRow::of(record).collect();
        Self { row, states: record.states.clone(), contacts }
    }
}

impl ContactRow {
    /// The rows of the contacts of a step, in the order of its solution; see [`TableStep::of`].
    pub fn of(record: &StepRecord) -> impl Iterator<Item = Self> + '_ {
        let point = |contact: &Contact| {
            let state = record.states.get(contact.key.body);
            state.map_or(Vector3::repeat(f64::NAN), |state| state.position + contact.arm)
        };
        let pairs = record.contacts.iter().zip(&record.solution.contacts);
        pairs.map(move |(contact, found)| Self {
            body: contact.key.body,
            partner: contact.key.partner,
            point: point(contact),
            normal: contact.normal(),
            force: found.force,
            slip: found.slip,
            gap: contact.gap,
            radius: contact.features.radius,
            rebound: contact.rebound,
            key: KeyText::of(&contact.key),
        })
    }
}
