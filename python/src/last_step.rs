//! The last step of a simulation.

use crate::contacts::{Columns, Names, holders};
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::PyType;
use std::sync::Arc;
use tumble::scenario::scene::Scene as Content;
use tumble::simulation::StepRecord;

/// The last step, and its contacts as Python has them.
pub struct LastStep {
    record: StepRecord,
    /// The names of whom contacts are with, once they were asked for.
    names: Option<Arc<Names>>,
    /// The contacts that were asked for last, and those before, to be written anew when nobody has them.
    told: [Option<Told>; 2],
    /// Whether the first of these are those of the record.
    is_told: bool,
}

/// Contacts that were asked for.
struct Told {
    /// A `tumble.Contacts` of the columns.
    contacts: Py<PyAny>,
    columns: Py<Columns>,
}

impl Told {
    fn of(py: Python<'_>, columns: Columns) -> PyResult<Self> {
        static CONTACTS: PyOnceLock<Py<PyType>> = PyOnceLock::new();
        let columns = Py::new(py, columns)?;
        let contacts = CONTACTS.import(py, "tumble._contacts", "Contacts")?.call1((&columns,))?;
        Ok(Self { contacts: contacts.unbind(), columns })
    }

    /// Becomes those of another step, if nobody has them: whether they did.
    fn become_those_of(&self, py: Python<'_>, record: &StepRecord) -> PyResult<bool> {
        // The columns are the contacts' too.
        let is_free = holders(&self.contacts, py) == 1 && holders(&self.columns, py) == 2;
        Ok(is_free && self.columns.get().become_those_of(py, record)?)
    }
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

    /// The same, to be written to by a step that is the last one again: its contacts are told.
    pub fn repeat(&mut self) -> &mut StepRecord {
        &mut self.record
    }

    /// The same, of other bodies.
    pub fn change_bodies(&mut self) -> &mut StepRecord {
        (self.names, self.told) = (None, [None, None]);
        self.change()
    }

    /// The contacts by column.
    pub fn contacts(&mut self, py: Python<'_>, content: &Content) -> PyResult<Py<PyAny>> {
        if let Some(told) = self.told[0].as_ref().filter(|_| self.is_told) {
            return Ok(told.contacts.clone_ref(py));
        }
        let Self { record, told: [last, before], names, is_told } = self;
        let is_again = |told: &Option<Told>| match told {
            Some(told) => told.become_those_of(py, record),
            None => Ok(false),
        };
        // Who reads them step by step has the last ones still.
        if is_again(before)? {
            std::mem::swap(last, before);
        } else if !is_again(last)? {
            let names = names.get_or_insert_with(|| Arc::new(Names::of(py, content)));
            let others = last.as_ref().map(|last| last.columns.get());
            let told = Told::of(py, Columns::of_step(py, record, names, others)?)?;
            *before = last.replace(told);
        }
        *is_told = true;
        let Some(told) = last else { return Ok(py.None()) };
        Ok(told.contacts.clone_ref(py))
    }
}
