//! A recorded run as arrays, tables and pictures.

use crate::arrays::{Array, Numbers, list, shaped};
use crate::contacts::{ContactColumns, PartnerNames, columns};
use crate::errors::refused;
use crate::pictures::{Surface, surfaces};
use crate::reading;
use crate::run_files::run_of_scene;
use crate::scene::{PyScene, in_python};
use crate::watch::Watched;
use nalgebra::Vector3;
use pyo3::prelude::*;
use pyo3::pybacked::PyBackedBytes;
use pyo3::types::{PyBytes, PyDict};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use tumble_core::contact::Partner;
use tumble_core::joint::JointForce;
use tumble_core::mechanics::State;
use tumble_core::simulation::Interval;
use tumble_core::step::StepStatus;
use tumble_scene::output::tables::{
    GearTableRow, IntervalRows, JointRow, StepRow, Streams, Table, TablesWriter, whole_steps,
};
use tumble_scene::run_file::{RunFile, checksum_of};
use tumble_scene::scene::Scene as Content;
use tumble_view::animation::{AnimationSettings, View, animate, pixels};
use tumble_view::plot::{self, PlotSheet};
use tumble_view::view::page;
use tumble_view::{FilmTriangles, triangles};

/// Meshes of bodies and of fixed objects, and names of the latter.
type Surfaces<'py> = (Vec<Vec<Surface<'py>>>, Vec<Vec<Surface<'py>>>, Vec<String>);

/// A recorded run with K rows. The last row is a state without a step.
#[pyclass(frozen, name = "Recording", module = "tumble._tumble")]
pub struct PyRecording {
    pub content: Arc<Content>,
    /// Rows of all intervals.
    pub rows: Vec<IntervalRows>,
    /// Sum of the contact forces on each body over each step, N: K - 1 times N vectors.
    pub forces: Vec<Vector3<f64>>,
    /// True if the rows contain their contacts.
    pub has_contacts: bool,
    /// True if only inputs of the scene moved the run; `None` if unknown.
    pub is_of_scene: Option<bool>,
}

/// Appends the sum of the contact forces on each body in a step to `sums`.
pub fn add_forces(step: &IntervalRows, sums: &mut Vec<Vector3<f64>>) {
    let first = sums.len();
    sums.resize(first + step.states.len(), Vector3::zeros());
    for contact in &*step.contacts {
        sums[first + contact.body] += contact.force;
        if let Partner::Body(other) = contact.partner {
            sums[first + other] -= contact.force;
        }
    }
}

#[pymethods]
impl PyRecording {
    /// Reads a run or a part of one from its tables as bytes, by their names. Scenes without joints or
    /// gears need no tables for them. A run without recorded contacts needs the forces (K - 1, N, 3).
    /// `run` is the text of its run.json, which says whether contacts without force have rows.
    #[staticmethod]
    #[pyo3(signature = (scene, tables, forces=None, run=None))]
    fn from_tables(
        scene: PyRef<'_, PyScene>,
        tables: BTreeMap<String, PyBackedBytes>,
        forces: Option<Numbers<'_>>,
        run: Option<&str>,
    ) -> PyResult<Self> {
        let table = |table: Table| tables.get(table.name()).map(|bytes| &bytes[..]);
        let needed = |of: Table| {
            table(of).ok_or_else(|| refused("tables of states, contacts and steps are needed"))
        };
        let streams = Streams {
            states: needed(Table::States)?,
            contacts: Some(needed(Table::Contacts)?),
            steps: needed(Table::Steps)?,
            joints: table(Table::Joints),
            gears: table(Table::Gears),
            ends: table(Table::Ends),
        };
        let run = run.map(|text| run_of_scene(&scene.content, text));
        let all_contacts = matches!(&run, Some(Ok(run)) if !run.kept.loaded_contacts);
        let is_short = !matches!(&run, Some(Ok(run)) if !run.kept.short);
        let rows = (all_contacts, is_short);
        let read = reading::from_tables(Arc::clone(&scene.content), streams, rows, forces)?;
        Ok(Self { is_of_scene: run.transpose()?.map(|run| !run.pushed), ..read })
    }

    /// Least memory of a step with this many bodies and joints, bytes.
    #[staticmethod]
    fn step_bytes(bodies: usize, joints: usize) -> usize {
        let of_body = size_of::<State>() + size_of::<Vector3<f64>>();
        let of_all = joints.saturating_mul(size_of::<JointRow>());
        bodies
            .saturating_mul(of_body)
            .saturating_add(of_all)
            .saturating_add(size_of::<IntervalRows>())
    }

    /// Rows `first` to `end` - 1 as a recording. Its last row becomes a state without a step.
    fn part(&self, first: usize, end: usize) -> PyResult<Self> {
        // Rows of the steps from `first` on, and of the first interval of the last one.
        let starts = self.rows.iter().enumerate().filter(|(_, rows)| rows.row.interval == 0);
        let starts: Vec<_> = starts.map(|(place, _)| place).collect();
        let last = end.checked_sub(1).and_then(|last| starts.get(last));
        let (first_row, last_row) = (starts.get(first), last.map_or(0, |last| last + 1));
        let ends = first_row.map_or(0..0, |first| *first..last_row);
        let Some(rows) = self.rows.get(ends).filter(|rows| !rows.is_empty()) else {
            return Err(refused("a part of a run needs at least one state"));
        };
        let mut rows = rows.to_vec();
        if let Some(last) = rows.last_mut() {
            let row =
                IntervalRows::new(&self.content.world, last.row.index, 0, &Interval::default()).row;
            last.row = StepRow { time: last.row.time, energy: last.row.energy, ..row };
            (last.ends, last.idle) = (Vec::new(), Vec::new());
            last.contacts = Arc::default();
            let world = self.content.world_at(last.row.index);
            for (index, row) in last.joints.iter_mut().enumerate() {
                let force = JointForce::none(row.turns);
                *row = JointRow::between([&world; 2], index, &last.states, None, &force);
            }
            for gear in &mut last.gears {
                *gear = GearTableRow { force: 0.0, residual: 0.0, ..*gear };
            }
        }
        let bodies = self.content.world.bodies().len();
        let forces = self.forces[first * bodies..(end - 1) * bodies].to_vec();
        let content = Arc::clone(&self.content);
        let Self { has_contacts, is_of_scene, .. } = *self;
        Ok(Self { content, rows, forces, has_contacts, is_of_scene })
    }

    /// Content of run.json for the tables, including whether inputs outside the scene moved the
    /// run. None if this is unknown, or for a run without contacts. `tables` holds the other files
    /// by name.
    fn run_json<'py>(
        &self,
        py: Python<'py>,
        tables: BTreeMap<String, PyBackedBytes>,
        loaded_contacts: bool,
    ) -> PyResult<Option<Bound<'py, PyBytes>>> {
        let Some(is_of_scene) = self.is_of_scene.filter(|_| self.has_contacts) else {
            return Ok(None);
        };
        let file = RunFile::from_rows(&self.content, &self.rows, loaded_contacts);
        let Some(mut file) = file.map_err(in_python)? else {
            return Ok(None);
        };
        file.pushed = !is_of_scene;
        let of_table =
            |(name, table): (String, PyBackedBytes)| Ok((name, checksum_of(&table[..])?));
        file.files = tables.keys().cloned().chain(["run.json".to_owned()]).collect();
        file.checksums = tables.into_iter().map(of_table).collect::<PyResult<_>>()?;
        Ok(Some(PyBytes::new(py, file.text().map_err(in_python)?.as_bytes())))
    }

    /// True if the contacts were recorded.
    #[getter]
    fn has_contacts(&self) -> bool {
        self.has_contacts
    }

    /// Tables as CSV, by their names: states, contacts, steps, those of joints and gears that the scene
    /// has, and ends with rows. With `loaded_contacts`, contacts that add nothing to the residual have
    /// no rows.
    fn tables<'py>(
        &self,
        py: Python<'py>,
        loaded_contacts: bool,
    ) -> PyResult<BTreeMap<&'static str, Bound<'py, PyBytes>>> {
        let has_joints = !self.content.joints.is_empty();
        let has_gears = !self.content.world.gears().is_empty();
        let streams = Streams {
            states: Vec::new(),
            contacts: Some(Vec::new()),
            steps: Vec::new(),
            joints: has_joints.then(Vec::new),
            gears: has_gears.then(Vec::new),
            ends: Some(Vec::new()),
        };
        let tables: Result<_, Box<dyn std::error::Error + Send + Sync>> = py.detach(|| {
            let writer = TablesWriter::new(streams, &self.content.world)?;
            let mut writer = writer.without_idle_contacts(loaded_contacts);
            self.rows.iter().try_for_each(|rows| writer.write_rows(rows))?;
            let has_ends = writer.open().has_ends;
            let tables = writer.finish()?;
            Ok(Streams { ends: tables.ends.filter(|_| has_ends), ..tables })
        });
        let Streams { states, contacts, steps, joints, gears, ends } = tables.map_err(refused)?;
        let all = [
            (Table::States, Some(states)),
            (Table::Contacts, contacts),
            (Table::Steps, Some(steps)),
            (Table::Joints, joints),
            (Table::Gears, gears),
            (Table::Ends, ends),
        ];
        let some = all.into_iter().filter_map(|(table, bytes)| Some((table.name(), bytes?)));
        Ok(some.map(|(name, bytes)| (name, PyBytes::new(py, &bytes))).collect())
    }

    /// States: (K, N, 13).
    fn states<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        let bodies = self.content.world.bodies().len();
        let steps = self.steps_of_rows();
        let mut numbers = Vec::with_capacity(steps.len() * bodies * 13);
        for state in steps.iter().flat_map(IntervalRows::instant_states) {
            numbers.extend_from_slice(state.to_vector().as_slice());
        }
        shaped(py, numbers, &[steps.len(), bodies, 13])
    }

    /// Sum of the contact forces on each body over each step: (K - 1, N, 3).
    fn forces<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        let bodies = self.content.world.bodies().len();
        let steps = self.__len__().saturating_sub(1);
        shaped(py, vectors(self.forces.iter().copied()), &[steps, bodies, 3])
    }

    /// Columns of the rows, each (K,).
    fn steps<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let columns = PyDict::new(py);
        let steps = self.steps_of_rows();
        let rows = || steps.iter().map(|step| &step.row);
        let count = [steps.len()];
        let place = |status| StepStatus::ALL.iter().position(|s| *s == status).unwrap_or(0);
        columns.set_item("k", shaped(py, rows().map(|row| row.index as i64).collect(), &count)?)?;
        let statuses = rows().map(|row| place(row.status) as u8).collect();
        columns.set_item("status", shaped(py, statuses, &count)?)?;
        let iterations = rows().map(|row| i64::from(row.iterations)).collect();
        columns.set_item("iterations", shaped(py, iterations, &count)?)?;
        let contacts = rows().map(|row| row.contacts as i64).collect();
        columns.set_item("contacts", shaped(py, contacts, &count)?)?;
        let parts = rows().flat_map(|row| row.parts).collect();
        columns.set_item("parts", shaped(py, parts, &[steps.len(), RESIDUAL_PARTS.len()])?)?;
        for (name, number) in STEP_NUMBERS {
            columns.set_item(name, shaped(py, rows().map(number).collect(), &count)?)?;
        }
        Ok(columns)
    }

    /// Columns of the contacts, each (C,) or (C, 3).
    fn contacts<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let all = PyDict::new(py);
        let of =
            |step: &IntervalRows| std::iter::repeat_n(step.row.index as i64, step.contacts.len());
        let steps = self.steps_of_rows();
        let indices: Vec<_> = steps.iter().flat_map(of).collect();
        all.set_item("k", list(py, indices)?)?;
        let rows = steps.iter().flat_map(|step| &*step.contacts);
        let pairs = rows.clone().map(|row| (row.body, row.partner)).collect();
        let names = Arc::new(PartnerNames::new(py, &self.content));
        let contacts = ContactColumns::new(py, pairs, rows, names);
        for name in columns() {
            all.set_item(name, contacts.column(py, name)?)?;
        }
        Ok(all)
    }

    /// Coordinates (K, G, 2) of the gears, and their forces (K, G).
    fn gears<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let columns = PyDict::new(py);
        let steps = self.steps_of_rows();
        let [rows, gears] = [steps.len(), self.content.world.gears().len()];
        let of = || steps.iter().flat_map(|step| &step.gears);
        let coordinates = of().flat_map(|gear| gear.coordinates).collect();
        columns.set_item("coordinates", shaped(py, coordinates, &[rows, gears, 2])?)?;
        let forces = of().map(|gear| gear.force).collect();
        columns.set_item("force", shaped(py, forces, &[rows, gears])?)?;
        Ok(columns)
    }

    /// Coordinates, rates and forces of the joints as columns, (K, J, 3) each.
    fn joints<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let columns = PyDict::new(py);
        let steps = self.steps_of_rows();
        let shape = [steps.len(), self.content.joints.len(), 3];
        for (column, name) in JOINT_COLUMNS.into_iter().enumerate() {
            let joints = steps.iter().flat_map(|step| &step.joints);
            let numbers = vectors(joints.map(|joint| joint.vectors()[column]));
            columns.set_item(name, shaped(py, numbers, &shape)?)?;
        }
        Ok(columns)
    }

    /// Meshes of the bodies, in their frames, and of the fixed objects, in the world. Names of the
    /// latter.
    fn surfaces<'py>(&self, py: Python<'py>) -> PyResult<Surfaces<'py>> {
        let film = self.film()?;
        let FilmTriangles { bodies, fixed } = py.detach(|| triangles(&film));
        let names = film.fixed.into_iter().map(|fixed| fixed.name).collect();
        Ok((surfaces(py, bodies)?, surfaces(py, fixed)?, names))
    }

    /// Plot of a body, "motion" or "energy", as SVG.
    fn svg(&self, py: Python<'_>, sheet: &str, body: Option<usize>) -> PyResult<String> {
        let sheet = match sheet {
            "motion" => PlotSheet::Motion,
            "energy" => PlotSheet::Energy,
            _ => return Err(refused(format!("{sheet:?} is not a plot; use motion or energy"))),
        };
        let bodies = self.content.bodies.len();
        if let Some(body) = body.filter(|body| *body >= bodies) {
            return Err(refused(format!("body is {body}; allowed: 0 to {}", bodies - 1)));
        }
        let film = self.film()?;
        let body = body.unwrap_or_else(|| film.first_moving());
        Ok(py.detach(|| plot::svg(&film, sheet, body)))
    }

    /// Converts an SVG to PNG.
    #[staticmethod]
    fn png<'py>(py: Python<'py>, svg: &str) -> PyResult<Bound<'py, PyBytes>> {
        let png = py.detach(|| plot::png(svg)).map_err(refused)?;
        Ok(PyBytes::new(py, &png))
    }

    /// Motion as a GIF.
    fn gif<'py>(
        &self,
        py: Python<'py>,
        speed: f64,
        size: u16,
        camera: Option<(f64, f64)>,
        dark: bool,
        progress: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyBytes>> {
        let view = camera.map(|(azimuth, elevation)| View { azimuth, elevation });
        let settings = AnimationSettings { speed, size, view, dark };
        let film = self.film()?;
        let (flag, done) = (Arc::new(AtomicBool::new(false)), AtomicU64::new(0));
        let follow = |frame, _| {
            done.store(frame, Ordering::Relaxed);
            match flag.load(Ordering::Relaxed) {
                true => ControlFlow::Break(()),
                false => ControlFlow::Continue(()),
            }
        };
        let total = self.__len__() as u64;
        let watched = Watched { interrupt: &flag, done: &done, total, progress: progress.as_ref() };
        let bytes = watched.run(py, || animate(&film, &settings, follow))?.map_err(refused)?;
        Ok(PyBytes::new(py, &bytes))
    }

    /// First state as an image (size, size, 3) of red, green and blue.
    fn pixels<'py>(
        &self,
        py: Python<'py>,
        size: u16,
        camera: (f64, f64),
    ) -> PyResult<Array<'py, u8>> {
        let view = Some(View { azimuth: camera.0, elevation: camera.1 });
        let settings = AnimationSettings { size, view, ..AnimationSettings::default() };
        let film = self.film()?;
        let bytes = py.detach(|| pixels(&film, &settings)).map_err(refused)?;
        shaped(py, bytes, &[usize::from(size), usize::from(size), 3])
    }

    /// Motion as a web page, side by side with `other` if it is not None.
    #[pyo3(signature = (other=None))]
    fn page(&self, py: Python<'_>, other: Option<PyRef<'_, Self>>) -> PyResult<String> {
        let mut films = vec![self.film()?];
        if let Some(other) = other {
            films.push(other.film()?);
        }
        let films: Vec<_> = films.iter().collect();
        py.detach(|| page(env!("CARGO_PKG_VERSION"), &films)).map_err(refused)
    }

    fn __len__(&self) -> usize {
        self.rows.iter().filter(|rows| rows.row.interval == 0).count()
    }
}

impl PyRecording {
    /// Adds the rows of the next interval.
    pub fn add(&mut self, mut rows: IntervalRows) {
        if !self.has_contacts {
            rows.keep_motion();
        }
        if let Some(last) = self.rows.last_mut() {
            last.share_with(&mut rows);
        }
        self.rows.push(rows);
    }

    /// Rows of whole steps.
    pub fn steps_of_rows(&self) -> Cow<'_, [IntervalRows]> {
        whole_steps(&self.content.world, &self.rows)
    }
}

/// Number of a row of the table of steps.
type StepNumber = fn(&StepRow) -> f64;

/// Columns of the rows with one number each.
const STEP_NUMBERS: [(&str, StepNumber); 7] = [
    ("time", |row| row.time),
    ("residual", |row| row.residual),
    ("overlap", |row| row.overlap),
    ("placement", |row| row.placement),
    ("restitution_share", |row| row.restitution_share),
    ("stiffness", |row| row.stiffness),
    ("energy", |row| row.energy),
];

/// Names of the parts of a step's residual, in the order of [`StepRow::parts`].
pub const RESIDUAL_PARTS: [&str; 5] =
    ["dynamics", "penetration", "normal_law", "friction_law", "cone"];

/// Names of the vectors of [`JointRow::vectors`], in their order.
pub const JOINT_COLUMNS: [&str; 6] = ["place", "angles", "velocity", "spin", "force", "torque"];

/// Components of vectors, concatenated.
pub fn vectors(vectors: impl Iterator<Item = Vector3<f64>>) -> Vec<f64> {
    vectors.flat_map(<[f64; 3]>::from).collect()
}
