//! The contacts of a step, or of many, by column.

use crate::arrays::shaped;
use crate::recording::vectors;
use nalgebra::Vector3;
use pyo3::exceptions::PyKeyError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyIterator, PyList, PyString, PyTuple};
use std::borrow::Borrow;
use std::sync::Arc;
use tumble::contact::Partner;
use tumble::scenario::scene::Scene as Content;
use tumble::simulation::StepRecord;
use tumble::simulation::tables::ContactRow;

/// The names of whom contacts are with, as texts of Python, which a column refers to.
pub struct Names {
    ground: Py<PyString>,
    fixed: Vec<Py<PyString>>,
    bodies: Vec<Py<PyString>>,
    /// Of what is not there.
    none: Py<PyString>,
}

impl Names {
    /// Those of a scene.
    pub fn of(py: Python<'_>, content: &Content) -> Self {
        let text = |name: &str| PyString::new(py, name).unbind();
        let texts = |names: &[String]| names.iter().map(|name| text(name)).collect();
        let (fixed, bodies) = (texts(&content.fixed), texts(&content.bodies));
        Self { ground: text("ground"), fixed, bodies, none: text("") }
    }

    fn partner(&self, partner: Partner) -> &Py<PyString> {
        let named = match partner {
            Partner::Ground => Some(&self.ground),
            Partner::Fixed(index) => self.fixed.get(index),
            Partner::Body(index) => self.bodies.get(index),
        };
        named.unwrap_or(&self.none)
    }
}

/// The column of contacts of this name, (C,) or (C, 3).
pub fn column_of<'py, R: Borrow<ContactRow>>(
    py: Python<'py>,
    name: &str,
    names: &Names,
    rows: impl Iterator<Item = R>,
) -> PyResult<Bound<'py, PyAny>> {
    type Column = fn(&ContactRow) -> Vector3<f64>;
    let of: Column = match name {
        "body" => {
            let bodies: Vec<_> = rows.map(|row| row.borrow().body as u64).collect();
            let count = bodies.len();
            return Ok(shaped(py, bodies, &[count])?.into_any());
        }
        "partner" => {
            let partners: Vec<_> = rows.map(|row| names.partner(row.borrow().partner)).collect();
            return Ok(PyList::new(py, partners)?.into_any());
        }
        "normal_force" | "gap" => {
            let is_gap = name == "gap";
            let of = |row: &ContactRow| if is_gap { row.gap } else { row.normal.dot(&row.force) };
            let numbers: Vec<_> = rows.map(|row| of(row.borrow())).collect();
            let count = numbers.len();
            return Ok(shaped(py, numbers, &[count])?.into_any());
        }
        "point" => |row| row.point,
        "normal" => |row| row.normal,
        "force" => |row| row.force,
        "slip" => |row| row.slip,
        _ => return Err(PyKeyError::new_err(name.to_owned())),
    };
    let numbers = vectors(rows.map(|row| of(row.borrow())));
    let count = numbers.len() / 3;
    Ok(shaped(py, numbers, &[count, 3])?.into_any())
}

/// The contacts of a step, C in all, as a mapping of columns, which are made when they are first read.
#[pyclass(frozen, mapping, module = "tumble")]
pub struct Contacts {
    /// The step; a simulation that goes on leaves it as it is.
    record: Arc<StepRecord>,
    names: Arc<Names>,
    made: Py<PyDict>,
}

impl Contacts {
    /// What they have as columns.
    pub const COLUMNS: [&str; 8] =
        ["body", "partner", "point", "normal", "force", "slip", "normal_force", "gap"];

    /// Those of a step.
    pub fn of(py: Python<'_>, record: Arc<StepRecord>, names: Arc<Names>) -> Self {
        Self { record, names, made: PyDict::new(py).unbind() }
    }
}

#[pymethods]
impl Contacts {
    fn __getitem__<'py>(&self, name: &Bound<'py, PyString>) -> PyResult<Bound<'py, PyAny>> {
        let (py, made) = (name.py(), self.made.bind(name.py()));
        if let Some(column) = made.get_item(name)? {
            return Ok(column);
        }
        let column = column_of(py, &name.to_cow()?, &self.names, ContactRow::of(&self.record))?;
        made.set_item(name, &column)?;
        Ok(column)
    }

    fn __len__(&self) -> usize {
        Self::COLUMNS.len()
    }

    fn __contains__(&self, name: &Bound<'_, PyAny>) -> bool {
        name.extract::<String>().is_ok_and(|name| Self::COLUMNS.contains(&name.as_str()))
    }

    fn __iter__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyIterator>> {
        PyTuple::new(py, Self::COLUMNS)?.try_iter()
    }

    /// The column of this name, or else the default.
    #[pyo3(signature = (name, default=None))]
    fn get<'py>(
        &self,
        name: &Bound<'py, PyAny>,
        default: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Option<Bound<'py, PyAny>>> {
        match name.cast::<PyString>() {
            Ok(name) if self.__contains__(name) => self.__getitem__(name).map(Some),
            _ => Ok(default),
        }
    }

    /// The names of the columns.
    fn keys(&self) -> Vec<&'static str> {
        Self::COLUMNS.to_vec()
    }

    /// The columns.
    fn values<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyAny>>> {
        let column = |name: &str| self.__getitem__(&PyString::new(py, name));
        Self::COLUMNS.into_iter().map(column).collect()
    }

    /// The columns and their names.
    fn items<'py>(&self, py: Python<'py>) -> PyResult<Vec<(&'static str, Bound<'py, PyAny>)>> {
        Ok(Self::COLUMNS.into_iter().zip(self.values(py)?).collect())
    }

    fn __repr__(&self) -> String {
        format!("<tumble.Contacts: {}>", self.record.contacts.len())
    }
}
