//! The last step of a simulation.

use crate::contacts::{ContactColumns, PartnerNames, holders};
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::PyType;
use std::sync::Arc;
use tumble_core::simulation::StepRecord;
use tumble_scene::scene::Scene as Content;

/// The last step and its contacts as Python objects.
pub struct LastStep {
    record: StepRecord,
    /// Partner names, created when first needed.
    names: Option<Arc<PartnerNames>>,
    /// Contacts objects returned to Python, latest first. Objects without other holders are reused.
    returned: Vec<LastStepParts>,
    /// True if the first of these objects belongs to the record.
    is_current: bool,
    /// Scratch memory for the numbers of contacts.
    numbers: Vec<f64>,
}

/// Number of contacts objects to keep for reuse with the same pairs. A thrown body returns to few
/// sets of pairs: contacts at some corners, or none.
const KEPT: usize = 8;

/// A contacts object with its columns.
struct LastStepParts {
    /// A `tumble.Contacts` of the columns.
    contacts: Py<PyAny>,
    columns: Py<ContactColumns>,
}

impl LastStepParts {
    fn new(py: Python<'_>, columns: ContactColumns) -> PyResult<Self> {
        static CONTACTS: PyOnceLock<Py<PyType>> = PyOnceLock::new();
        let columns = Py::new(py, columns)?;
        let contacts = CONTACTS.import(py, "tumble._contacts", "Contacts")?.call1((&columns,))?;
        Ok(Self { contacts: contacts.unbind(), columns })
    }

    /// Overwrites the object with another step if it has no other holder. Returns true if it did.
    fn become_those_of(
        &self,
        py: Python<'_>,
        record: &StepRecord,
        numbers: &mut Vec<f64>,
    ) -> PyResult<bool> {
        // The contacts object also holds the columns.
        let is_free = holders(&self.contacts, py) == 1 && holders(&self.columns, py) == 2;
        Ok(is_free && self.columns.get().become_those_of(py, record, numbers)?)
    }
}

impl LastStep {
    /// State before the first step.
    pub fn none() -> Self {
        let record = StepRecord::new();
        Self { record, names: None, returned: Vec::new(), is_current: false, numbers: Vec::new() }
    }

    pub fn record(&self) -> &StepRecord {
        &self.record
    }

    /// Record to be overwritten by a new step.
    pub fn change(&mut self) -> &mut StepRecord {
        self.is_current = false;
        &mut self.record
    }

    /// Record to be overwritten by a step at rest that repeats the last one, so its contacts stay
    /// valid.
    pub fn repeat(&mut self) -> &mut StepRecord {
        &mut self.record
    }

    /// Record to be overwritten for another set of bodies.
    pub fn change_bodies(&mut self) -> &mut StepRecord {
        self.names = None;
        self.returned.clear();
        self.change()
    }

    /// Contacts as columns.
    pub fn contacts(&mut self, py: Python<'_>, content: &Content) -> PyResult<Py<PyAny>> {
        let Self { record, returned, names, is_current, numbers } = self;
        if !*is_current {
            let mut again = None;
            for (place, returned) in returned.iter().enumerate() {
                if returned.become_those_of(py, record, numbers)? {
                    again = Some(place);
                    break;
                }
            }
            if let Some(place) = again {
                returned[..=place].rotate_right(1);
            } else {
                let names = names.get_or_insert_with(|| Arc::new(PartnerNames::new(py, content)));
                let others = returned.first().map(|returned| returned.columns.get());
                let made =
                    LastStepParts::new(py, ContactColumns::from_step(py, record, names, others))?;
                returned.truncate(KEPT - 1);
                returned.insert(0, made);
            }
            *is_current = true;
        }
        // The current object is first.
        Ok(returned.first().map_or_else(|| py.None(), |returned| returned.contacts.clone_ref(py)))
    }
}
