//! The last step of a simulation.

use crate::contacts::{ContactColumns, PartnerNames, holders};
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::PyType;
use std::sync::Arc;
use tumble_core::simulation::StepRecord;
use tumble_scene::scene::Scene as Content;

/// The last step, and its contacts as Python has them.
pub struct LastStep {
    record: StepRecord,
    /// The names of whom contacts are with, once they were asked for.
    names: Option<Arc<PartnerNames>>,
    /// Contacts that were asked for, the last ones first, to be written anew when nobody has them.
    told: Vec<LastStepParts>,
    /// Whether the first of these are those of the record.
    is_told: bool,
    /// Room for the numbers of contacts.
    numbers: Vec<f64>,
}

/// So many contacts that were asked for are kept: those between the same as these need not be made. A body that is
/// thrown comes back to few: on so many corners, or on none.
const KEPT: usize = 8;

/// Contacts that were asked for.
struct LastStepParts {
    /// A `tumble.Contacts` of the columns.
    contacts: Py<PyAny>,
    columns: Py<ContactColumns>,
}

impl LastStepParts {
    fn of(py: Python<'_>, columns: ContactColumns) -> PyResult<Self> {
        static CONTACTS: PyOnceLock<Py<PyType>> = PyOnceLock::new();
        let columns = Py::new(py, columns)?;
        let contacts = CONTACTS.import(py, "tumble._contacts", "Contacts")?.call1((&columns,))?;
        Ok(Self { contacts: contacts.unbind(), columns })
    }

    /// Becomes those of another step, if nobody has them: whether they did.
    fn become_those_of(
        &self,
        py: Python<'_>,
        record: &StepRecord,
        numbers: &mut Vec<f64>,
    ) -> PyResult<bool> {
        // The columns are the contacts' too.
        let is_free = holders(&self.contacts, py) == 1 && holders(&self.columns, py) == 2;
        Ok(is_free && self.columns.get().become_those_of(py, record, numbers)?)
    }
}

impl LastStep {
    /// Before the first one.
    pub fn none() -> Self {
        let record = StepRecord::new();
        Self { record, names: None, told: Vec::new(), is_told: false, numbers: Vec::new() }
    }

    pub fn record(&self) -> &StepRecord {
        &self.record
    }

    /// The record to be written to.
    pub fn change(&mut self) -> &mut StepRecord {
        self.is_told = false;
        &mut self.record
    }

    /// The same, to be written to by a step that is the last one again: its contacts are told.
    pub fn repeat(&mut self) -> &mut StepRecord {
        &mut self.record
    }

    /// The same, of other bodies.
    pub fn change_bodies(&mut self) -> &mut StepRecord {
        self.names = None;
        self.told.clear();
        self.change()
    }

    /// The contacts by column.
    pub fn contacts(&mut self, py: Python<'_>, content: &Content) -> PyResult<Py<PyAny>> {
        let Self { record, told, names, is_told, numbers } = self;
        if !*is_told {
            let mut again = None;
            for (place, told) in told.iter().enumerate() {
                if told.become_those_of(py, record, numbers)? {
                    again = Some(place);
                    break;
                }
            }
            if let Some(place) = again {
                told[..=place].rotate_right(1);
            } else {
                let names = names.get_or_insert_with(|| Arc::new(PartnerNames::of(py, content)));
                let others = told.first().map(|told| told.columns.get());
                let made =
                    LastStepParts::of(py, ContactColumns::of_step(py, record, names, others))?;
                told.truncate(KEPT - 1);
                told.insert(0, made);
            }
            *is_told = true;
        }
        // What is told has been put first.
        Ok(told.first().map_or_else(|| py.None(), |told| told.contacts.clone_ref(py)))
    }
}
