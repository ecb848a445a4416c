//! Contacts of one or many steps as columns.

use crate::arrays::list;
use numpy::{PyArray1, PyArrayMethods};
use pyo3::buffer::PyBuffer;
use pyo3::exceptions::PyKeyError;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PySlice, PyString, PyTuple};
use std::borrow::Borrow;
use std::sync::Arc;
use tumble_core::contact::{Contact, Partner};
use tumble_core::simulation::{Interval, StepRecord};
use tumble_scene::output::tables::ContactRow;
use tumble_scene::scene::Scene as Content;

/// Columns of the pairs, which come first.
const PAIR_COLUMNS: [&str; PAIRS] = ["body", "partner", "partner_body"];

/// Number of columns of the pairs.
const PAIRS: usize = 3;

/// Index of a partner that is not a body.
const NO_BODY: i64 = -1;

/// Numeric columns, which come last, and their numbers per contact.
const NUMBERS: [(&str, usize); 7] = [
    ("point", 3),
    ("normal", 3),
    ("force", 3),
    ("slip", 3),
    ("normal_force", 1),
    ("gap", 1),
    ("moment", 3),
];

/// Names of the columns.
pub fn columns() -> impl Iterator<Item = &'static str> {
    PAIR_COLUMNS.into_iter().chain(NUMBERS.map(|(name, _)| name))
}

/// Partner names as shared Python strings, to which a column refers.
pub struct PartnerNames {
    ground: Py<PyString>,
    fixed: Vec<Py<PyString>>,
    bodies: Vec<Py<PyString>>,
    /// Empty name of an unknown partner.
    none: Py<PyString>,
}

impl PartnerNames {
    /// Creates the names of a scene.
    pub fn new(py: Python<'_>, content: &Content) -> Self {
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

/// Pairs of bodies and partners.
struct PairColumns {
    all: Vec<(usize, Partner)>,
    /// Columns of the pairs, created when first read.
    made: [PyOnceLock<Py<PyAny>>; PAIRS],
}

/// Numbers of contacts in one array, column by column.
struct ColumnNumbers {
    all: Py<PyArray1<f64>>,
    /// Buffer of the array, created when first overwritten.
    memory: PyOnceLock<PyBuffer<f64>>,
    /// Read-only views of the columns that have been read.
    made: [PyOnceLock<Py<PyAny>>; NUMBERS.len()],
}

/// Contacts as columns, C in all. Each column is created when it is first read.
#[pyclass(frozen, name = "Columns", module = "tumble._tumble")]
pub struct ContactColumns {
    names: Arc<PartnerNames>,
    pairs: Arc<PairColumns>,
    numbers: ColumnNumbers,
}

impl ContactColumns {
    /// Creates the columns of contacts between the pairs `all`, one row each.
    pub fn new<R: Borrow<ContactRow>>(
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
        let pairs = Arc::new(PairColumns { all, made: [const { PyOnceLock::new() }; PAIRS] });
        Self { names, pairs, numbers }
    }

    /// Creates the columns of a step. If `others` has the same pairs, their columns are shared.
    pub fn from_step(
        py: Python<'_>,
        record: &StepRecord,
        names: &Arc<PartnerNames>,
        others: Option<&Self>,
    ) -> Self {
        let names = Arc::clone(names);
        let mut columns = if record.is_divided() {
            let rows = ContactRow::from_divided_step(record);
            let all = rows.iter().map(|row| (row.body, row.partner)).collect();
            Self::new(py, all, rows.iter(), names)
        } else {
            let taken = record.first();
            Self::new(py, pairs(taken).collect(), ContactRow::from_interval(taken), names)
        };
        if let Some(others) = others.filter(|others| others.pairs.all == columns.pairs.all) {
            columns.pairs = Arc::clone(&others.pairs);
        }
        columns
    }

    /// Overwrites the columns with those of another step and returns true. This requires equal
    /// pairs and at most one other holder of each view. Otherwise nothing changes, and the result
    /// is false. `numbers` is scratch memory.
    pub fn become_those_of(
        &self,
        py: Python<'_>,
        record: &StepRecord,
        numbers: &mut Vec<f64>,
    ) -> PyResult<bool> {
        let count = self.pairs.all.len();
        if record.is_divided() {
            return Ok(false);
        }
        let taken = record.first();
        let are_same = self.pairs.all.iter().copied().eq(pairs(taken));
        let is_free = are_same && self.numbers.is_free(py);
        if is_free && count > 0 {
            let memory = || PyBuffer::get(self.numbers.all.bind(py).as_any());
            // The borrow checks of numpy take longer than the copy.
            let memory = self.numbers.memory.get_or_try_init(py, memory)?;
            fill(numbers, count, ContactRow::from_interval(taken));
            memory.copy_from_slice(py, numbers)?;
        }
        Ok(is_free)
    }

    /// Partner name of each contact.
    fn partners<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let partners = self.pairs.all.iter().map(|(_, with)| self.names.partner(*with));
        Ok(PyTuple::new(py, partners)?.into_any())
    }

    fn bodies<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let bodies = self.pairs.all.iter().map(|(body, _)| *body as i64).collect();
        Ok(list(py, bodies)?.into_any())
    }

    /// Body index of each partner.
    fn partner_bodies<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let index = |partner: Partner| partner.body().map_or(NO_BODY, |body| body as i64);
        let bodies = self.pairs.all.iter().map(|(_, with)| index(*with)).collect();
        Ok(list(py, bodies)?.into_any())
    }

    /// View of the numeric column with this index.
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
    /// Column of this name, shape (C,) or (C, 3).
    pub fn column<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        let Some(place) = columns().position(|of| of == name) else {
            return Err(PyKeyError::new_err(name.to_owned()));
        };
        let column = match place {
            0 => self.pairs.made[0].get_or_try_init(py, || self.bodies(py).map(Bound::unbind)),
            1 => self.pairs.made[1].get_or_try_init(py, || self.partners(py).map(Bound::unbind)),
            2 => {
                let bodies = || self.partner_bodies(py).map(Bound::unbind);
                self.pairs.made[2].get_or_try_init(py, bodies)
            }
            _ => {
                let view = || self.view(py, place - PAIRS).map(Bound::unbind);
                self.numbers.made[place - PAIRS].get_or_try_init(py, view)
            }
        };
        Ok(column?.bind(py).clone())
    }

    /// Number of contacts C.
    fn __len__(&self) -> usize {
        self.pairs.all.len()
    }
}

impl ColumnNumbers {
    /// True if nothing else holds the array or a view of it. Every view, also of a view, holds the
    /// array.
    fn is_free(&self, py: Python<'_>) -> bool {
        let mut made = self.made.iter().filter_map(|made| made.get(py));
        let count = made.clone().count() as isize;
        let memory = isize::from(self.memory.get(py).is_some());
        // A view has two holders: this object and its reader.
        holders(&self.all, py) == 1 + memory + count && made.all(|view| holders(view, py) <= 2)
    }
}

/// Fills the numbers of `count` contacts, column by column.
fn fill<R: Borrow<ContactRow>>(
    numbers: &mut Vec<f64>,
    count: usize,
    rows: impl Iterator<Item = R>,
) {
    numbers.resize(count * NUMBERS.iter().map(|(_, width)| width).sum::<usize>(), 0.0);
    let mut left = &mut numbers[..];
    let [points, normals, forces, slips, sizes, gaps, moments] = NUMBERS.map(|(_, width)| {
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
        slips[three.clone()].copy_from_slice(row.slip.as_slice());
        moments[three].copy_from_slice(row.moment.as_slice());
        sizes[place] = row.normal.dot(&row.force);
        gaps[place] = row.gap;
    }
}

/// Pairs of an interval's contacts.
fn pairs(record: &Interval) -> impl Iterator<Item = (usize, Partner)> + '_ {
    let pair = |contact: &Contact| (contact.key.body, contact.key.partner);
    record.contacts.iter().map(pair).take(record.solution.contacts.len())
}

/// Reference count of an object.
#[expect(deprecated, reason = "the replacement is unsafe")]
pub fn holders<T>(object: &Py<T>, py: Python<'_>) -> isize {
    object.get_refcnt(py)
}
