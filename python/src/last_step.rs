//! The last step of a simulation.

use crate::contacts::{Contacts, Names, holders};
use pyo3::prelude::*;
use std::sync::Arc;
use tumble::scenario::scene::Scene as Content;
use tumble::simulation::StepRecord;

/// The last step, and its contacts as Python has them.
pub struct LastStep {
    record: StepRecord,
    /// The names of whom contacts are with, once they were asked for.
    names: Option<Arc<Names>>,
    /// The contacts that were asked for last, and those before, to be written anew when nobody has them.
    told: [Option<Py<Contacts>>; 2],
    /// Whether the first of these are those of the record.
    is_told: bool,
}

impl LastStep {
    /// Before the first one.
    pub fn none() -> Self {
        Self { record: StepRecord::new(), names: None, told: [None, None], is_told: false }
    }

    pub fn record(&self) -> &StepRecord {
        &self.record
    }

    /// The record to be written to.
    pub fn change(&mut self) -> &mut StepRecord {
        self.is_told = false;
        &mut self.record
    }

    /// The same, of other bodies.
    pub fn change_bodies(&mut self) -> &mut StepRecord {
        (self.names, self.told) = (None, [None, None]);
        self.change()
    }

    /// The contacts by column.
    pub fn contacts(&mut self, py: Python<'_>, content: &Content) -> PyResult<Py<Contacts>> {
        let Self { record, told: [last, before], names, is_told } = self;
        if let Some(told) = last.as_ref().filter(|_| *is_told) {
            return Ok(told.clone_ref(py));
        }
        let again = |told: &mut Option<Py<Contacts>>| {
            let free = told.as_ref().filter(|told| holders(told, py) == 1);
            let is_again = free.map(|free| free.get().become_those_of(py, record)).transpose()?;
            PyResult::Ok(told.take_if(|_| is_again == Some(true)))
        };
        // Who reads them step by step has the last ones still.
        let found = match again(before)? {
            None => again(last)?,
            found => found,
        };
        let found = match found {
            Some(found) => found,
            None => {
                let names = names.get_or_insert_with(|| Arc::new(Names::of(py, content)));
                let others = last.as_ref().map(|last| last.get());
                Py::new(py, Contacts::of(py, record, names, others)?)?
            }
        };
        if last.is_some() {
            *before = last.take();
        }
        *last = Some(found.clone_ref(py));
        *is_told = true;
        Ok(found)
    }
}
