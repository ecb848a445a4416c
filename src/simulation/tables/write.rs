//! Records become rows.

use super::{KeyText, Streams, Table, energy};
use crate::contact::Partner;
use crate::simulation::StepRecord;
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
        let begin = |stream, table: Table| {
            let mut csv = csv::WriterBuilder::new().has_headers(false).from_writer(stream);
            csv.write_record(table.columns())?;
            Ok::<_, csv::Error>(csv)
        };
        let tables = Streams {
            states: begin(streams.states, Table::States)?,
            contacts: begin(streams.contacts, Table::Contacts)?,
            steps: begin(streams.steps, Table::Steps)?,
        };
        Ok(Self { tables, world: world.clone() })
    }

    /// Writes the rows of one step.
    ///
    /// # Errors
    /// The streams'.
    pub fn write(&mut self, record: &StepRecord) -> csv::Result<()> {
        let Self { tables, world } = self;
        // k h in one rounding, so that times do not drift.
        let time = record.index as f64 * world.time_step();
        for (body, state) in record.states.iter().enumerate() {
            let numbers = state.to_vector();
            tables.states.serialize((record.index, time, body, numbers.as_slice()))?;
        }
        let is_end = record.report.status == StepStatus::End;
        let certificate = if is_end { Default::default() } else { record.certificate };
        tables.steps.serialize((
            (record.index, time),
            record.report.status.name(),
            record.report.iterations,
            record.report.start.unwrap_or(""),
            record.contacts.len(),
            certificate.residual(),
            certificate.parts().map(|(_, part)| part),
            record.overlap,
            record.restitution_share,
            energy(world, &record.states),
        ))?;
        self.write_contacts(record)
    }

    fn write_contacts(&mut self, record: &StepRecord) -> csv::Result<()> {
        let pairs = record.contacts.iter().zip(&record.solution.contacts);
        for (index, (contact, found)) in pairs.enumerate() {
            let (partner, partner_index) = match contact.key.partner {
                Partner::Ground => ("ground", 0),
                Partner::Fixed(index) => ("fixed", index),
                Partner::Body(index) => ("body", index),
            };
            let point = record.states[contact.key.body].position + contact.arm;
            let numbers = |vector: Vector3<f64>| <[f64; 3]>::from(vector);
            self.tables.contacts.serialize((
                (record.index, index, contact.key.body, partner, partner_index),
                numbers(point),
                numbers(contact.normal()),
                numbers(found.force),
                numbers(found.slip),
                contact.gap,
                contact.features.radius,
                contact.rise,
                KeyText::of(&contact.key).to_string(),
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
