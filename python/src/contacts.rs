//! The contacts of a step, or of many, by column.

use crate::arrays::shaped;
use numpy::{PyArray1, PyArrayMethods};
use pyo3::buffer::PyBuffer;
use pyo3::exceptions::PyKeyError;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PySlice, PyString, PyTuple};
use std::borrow::Borrow;
use std::sync::Arc;
use tumble_core::contact::{Contact, Partner};
use tumble_core::simulation::StepRecord;
use tumble_scene::output::tables::ContactRow;
use tumble_scene::scene::Scene as Content;

/// What contacts have as columns.
pub const COLUMNS: [&str; 8] =
    ["body", "partner", "point", "normal", "force", "slip", "normal_force", "gap"];

/// Those of them that are numbers, the last ones, and how many of each a contact has.
const NUMBERS: [(&str, usize); 6] =
    [("point", 3), ("normal", 3), ("force", 3), ("slip", 3), ("normal_force", 1), ("gap", 1)];

/// The names of whom contacts are with, as texts of Python, which a column refers to.
pub struct PartnerNames {
    ground: Py<PyString>,
    fixed: Vec<Py<PyString>>,
    bodies: Vec<Py<PyString>>,
    /// Of what is not there.
    none: Py<PyString>,
}

impl PartnerNames {
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

/// Whom contacts are between.
struct PairColumns {
    all: Vec<(usize, Partner)>,
    /// The columns of both, once they were read.
    made: [PyOnceLock<Py<PyAny>>; 2],
}

/// The numbers of contacts in one array, a column after the other.
struct ColumnNumbers {
    all: Py<PyArray1<f64>>,
    /// Its memory, once it was written to again.
    memory: PyOnceLock<PyBuffer<f64>>,
    /// Views of it, the columns that were read, which cannot be written to.
    made: [PyOnceLock<Py<PyAny>>; NUMBERS.len()],
}

/// Contacts, C in all, by column, each made when it is first read.
#[pyclass(frozen, name = "Columns", module = "tumble._tumble")]
pub struct ContactColumns {
    names: Arc<PartnerNames>,
    pairs: Arc<PairColumns>,
    numbers: ColumnNumbers,
}

impl ContactColumns {
    /// Those of contacts between these, a row each.
    pub fn of<R: Borrow<ContactRow>>(
        py: Python<'_>,
        all: Vec<(usize, Partner)>,
        rows: impl Iterator<Item = R>,
        names: Arc<PartnerNames>,
    ) -> Self {
        let mut numbers = Vec::new();
        fill(&mut numbers, all.len(), rows);
        let numbers = ColumnNumbers {
            all: PyArray1::from_vec(py, numbers).unbind(),
            memory: PyOnceLock::new(),
            made: [const { PyOnceLock::new() }; NUMBERS.len()],
        };
        let pairs = Arc::new(PairColumns { all, made: [const { PyOnceLock::new() }; 2] });
        Self { names, pairs, numbers }
    }

    /// Those of a step. Where they are between the same as others, these columns are theirs.
    pub fn of_step(
        py: Python<'_>,
        record: &StepRecord,
        names: &Arc<PartnerNames>,
        others: Option<&Self>,
    ) -> Self {
        let (all, rows) = (pairs(record).collect(), ContactRow::of(record));
        let mut columns = Self::of(py, all, rows, Arc::clone(names));
        if let Some(others) = others.filter(|others| others.pairs.all == columns.pairs.all) {
            columns.pairs = Arc::clone(&others.pairs);
        }
        columns
    }

    /// Becomes those of another step, if they are between the same and nobody but one has the array of these or a view of
    /// it: whether they did. That one has each column once. `numbers` is room for what is written.
    pub fn become_those_of(
        &self,
        py: Python<'_>,
        record: &StepRecord,
        numbers: &mut Vec<f64>,
    ) -> PyResult<bool> {
        let count = self.pairs.all.len();
        let are_same = self.pairs.all.iter().copied().eq(pairs(record));
        let is_free = are_same && self.numbers.is_free(py);
        if is_free && count > 0 {
            let memory = || PyBuffer::get(self.numbers.all.bind(py).as_any());
            // numpy's own loans take longer than what is written.
            let memory = self.numbers.memory.get_or_try_init(py, memory)?;
            fill(numbers, count, ContactRow::of(record));
            memory.copy_from_slice(py, numbers)?;
        }
        Ok(is_free)
    }

    /// The names of those between whom the contacts are.
    fn partners<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let partners = self.pairs.all.iter().map(|(_, with)| self.names.partner(*with));
        Ok(PyTuple::new(py, partners)?.into_any())
    }

    fn bodies<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let bodies = self.pairs.all.iter().map(|(body, _)| *body as u64).collect();
        Ok(shaped(py, bodies, &[self.pairs.all.len()])?.into_any())
    }

    /// The column at this place among the numbers.
    fn view<'py>(&self, py: Python<'py>, place: usize) -> PyResult<Bound<'py, PyAny>> {
        let count = self.pairs.all.len();
        let before: usize = NUMBERS[..place].iter().map(|(_, width)| width * count).sum();
        let width = NUMBERS[place].1;
        let slice = PySlice::new(py, before as isize, (before + width * count) as isize, 1);
        let column = self.numbers.all.bind(py).get_item(slice)?.cast_into::<PyArray1<f64>>()?;
        if width == 1 {
            column.try_readwrite()?.make_nonwriteable();
            return Ok(column.into_any());
        }
        let column = column.reshape([count, width])?;
        column.try_readwrite()?.make_nonwriteable();
        Ok(column.into_any())
    }
}

#[pymethods]
impl ContactColumns {
    /// The column of this name, (C,) or (C, 3).
    pub fn column<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        let Some(place) = COLUMNS.iter().position(|of| *of == name) else {
            return Err(PyKeyError::new_err(name.to_owned()));
        };
        let column = match place {
            0 => self.pairs.made[0].get_or_try_init(py, || self.bodies(py).map(Bound::unbind)),
            1 => self.pairs.made[1].get_or_try_init(py, || self.partners(py).map(Bound::unbind)),
            _ => {
                let view = || self.view(py, place - 2).map(Bound::unbind);
                self.numbers.made[place - 2].get_or_try_init(py, view)
            }
        };
        Ok(column?.bind(py).clone())
    }

    /// C.
    fn __len__(&self) -> usize {
        self.pairs.all.len()
    }
}

impl ColumnNumbers {
    /// Whether nobody else has the array or a view of it. Every view, one of a view too, has the array itself.
    fn is_free(&self, py: Python<'_>) -> bool {
        let mut made = self.made.iter().filter_map(|made| made.get(py));
        let count = made.clone().count() as isize;
        let memory = isize::from(self.memory.get(py).is_some());
        // Of a view, this one and that of whom they are for.
        holders(&self.all, py) == 1 + memory + count && made.all(|view| holders(view, py) <= 2)
    }
}

/// The numbers of `count` contacts, a column after the other.
fn fill<R: Borrow<ContactRow>>(
    numbers: &mut Vec<f64>,
    count: usize,
    rows: impl Iterator<Item = R>,
) {
    numbers.resize(count * NUMBERS.iter().map(|(_, width)| width).sum::<usize>(), 0.0);
    let mut left = &mut numbers[..];
    let [points, normals, forces, slips, sizes, gaps] = NUMBERS.map(|(_, width)| {
        let (column, rest) = std::mem::take(&mut left).split_at_mut(width * count);
        left = rest;
        column
    });
    for (place, row) in rows.take(count).enumerate() {
        let row = row.borrow();
        let three = 3 * place..3 * place + 3;
        points[three.clone()].copy_from_slice(row.point.as_slice());
        normals[three.clone()].copy_from_slice(row.normal.as_slice());
        forces[three.clone()].copy_from_slice(row.force.as_slice());
        slips[three].copy_from_slice(row.slip.as_slice());
        sizes[place] = row.normal.dot(&row.force);
        gaps[place] = row.gap;
    }
}

/// Whom the contacts of a step are between.
fn pairs(record: &StepRecord) -> impl Iterator<Item = (usize, Partner)> + '_ {
    let pair = |contact: &Contact| (contact.key.body, contact.key.partner);
    record.contacts.iter().map(pair).take(record.solution.contacts.len())
}

/// How many references there are to an object.
#[expect(deprecated, reason = "what takes its place is unsafe")]
pub fn holders<T>(object: &Py<T>, py: Python<'_>) -> isize {
    object.get_refcnt(py)
}
