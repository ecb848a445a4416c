//! A running simulation.

use crate::arrays::{Array, Numbers, as_many, list, numbers, shaped, states_array, to_states};
use crate::coordinates::LastCoordinates;
use crate::errors::{refused, step_error};
use crate::last_step::LastStep;
use crate::owned::Owned;
use crate::query::{Between, Hits};
use crate::recording::{JOINT_COLUMNS, PyRecording};
use crate::robot::{PyRobot, at_place};
use crate::running::{Running, StepInputs};
use crate::scene::{PyScene, in_python, read};
use crate::watch::Watched;
use pyo3::exceptions::PyBaseException;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicU64};
use std::sync::{Arc, Mutex, MutexGuard, TryLockError};
use std::time::{Duration, Instant};
use tumble_core::joint::{Axis, Drive, Gear, JointAxis, Motor};
use tumble_core::simulation::save::Saved;
use tumble_core::simulation::{Simulation, StepRecord};
use tumble_core::world::Partner;
use tumble_scene::output::tables::{IntervalRows, JointRow, whole_steps};

/// Number of bodies above which the first step may be slow and must be interruptible.
const MANY_BODIES: usize = 4;

/// Duration of a step up to which the next one runs on the caller's thread. A short step needs no
/// interruption, and a thread costs more than the step.
const SHORT: Duration = Duration::from_millis(1);

/// A running simulation of a scene.
///
/// One call at a time can use it. Calls from another thread or from a callback of a run are refused
/// meanwhile.
#[pyclass(frozen, subclass, name = "CoreSimulation", module = "tumble._tumble")]
pub struct PySimulation(Mutex<Owned>);

#[pymethods]
impl PySimulation {
    /// Creates a simulation with up to `threads` threads. It starts from the scene's start, or from
    /// states (N, 13), at step `index` or the scene's. Or it continues from the bytes `saved` of
    /// `saved_with` or of the command line's state.bin.
    #[new]
    #[pyo3(signature = (scene, states=None, threads=1, index=None, saved=None))]
    fn new(
        scene: PyRef<'_, PyScene>,
        states: Option<Numbers<'_>>,
        threads: usize,
        index: Option<u64>,
        saved: Option<&[u8]>,
    ) -> PyResult<Self> {
        let content = Arc::clone(&scene.content);
        let threads =
            NonZeroUsize::new(threads).ok_or_else(|| refused("threads: 1 or more are needed"))?;
        let motion = match threads.get() {
            1 => content.motion(&content.world).map_err(refused)?,
            _ => content.motion_on(threads).map_err(in_python)?,
        };
        let (mut running, kept) = match saved {
            Some(saved) => {
                let saved = Saved::from_bytes(saved).map_err(refused)?;
                Running::restored(&content, motion, &saved).map_err(refused)?
            }
            None => {
                let starts = match &states {
                    None => content.starts.clone(),
                    Some(states) => to_states("states", states)?,
                };
                let start_index = index.unwrap_or(content.start_index);
                let simulation = content.simulation_from(starts, start_index, motion);
                let simulation = simulation.map_err(|error| refused(error.display(&*content)))?;
                let last = LastStep::none();
                let running = Running { simulation, last, took: None, is_of_scene: Some(true) };
                (running, String::new())
            }
        };
        let interrupt = Arc::new(AtomicBool::new(false));
        running.simulation.interrupt_by(Arc::clone(&interrupt));
        let (threads, process) = (threads.get() > 1, std::process::id());
        let coordinates = LastCoordinates::default();
        Ok(Self(Mutex::new(Owned {
            content,
            running,
            interrupt,
            threads,
            process,
            kept,
            coordinates,
        })))
    }

    /// Serialises the simulation and the text `kept`.
    fn saved_with<'py>(&self, py: Python<'py>, kept: &str) -> PyResult<Bound<'py, PyBytes>> {
        let saved = self.owned()?.running.saved_with(kept).map_err(refused)?;
        Ok(PyBytes::new(py, &saved))
    }

    /// Text stored in the restored state. It is returned once.
    fn kept_besides(&self) -> PyResult<String> {
        Ok(std::mem::take(&mut self.owned()?.kept))
    }

    /// Sets the current states (N, 13).
    fn exchange_all(&self, states: Numbers<'_>) -> PyResult<()> {
        let states = to_states("states", &states)?;
        let mut own = self.owned()?;
        let set = own.moved().simulation.set_states(&states);
        set.map_err(|error| own.named(&error))
    }

    /// Sets the current state (13,) of a body.
    fn exchange(&self, body: usize, state: Numbers<'_>) -> PyResult<()> {
        let states = to_states("state", &state)?;
        let [state] = states[..] else { return Err(refused("state: 13 numbers are needed")) };
        let mut own = self.owned()?;
        let set = own.moved().simulation.set_state(body, state);
        set.map_err(|error| own.named(&error))
    }

    /// Names of its bodies.
    #[getter]
    fn bodies(&self) -> PyResult<Vec<String>> {
        Ok(self.owned()?.content.bodies.clone())
    }

    /// Adds the body of a `[[bodies]]` table in `text`, with meshes relative to `path`. Returns its
    /// name.
    fn join(&self, text: &str, path: PathBuf) -> PyResult<String> {
        let mut own = self.owned()?;
        let content = own.content.with_body(text, &path, &read).map_err(in_python)?;
        let Running { simulation, last, .. } = own.moved();
        let new = content.bodies.len() - 1;
        let (body, start) = (content.world.bodies()[new].clone(), content.starts[new]);
        let added = simulation.add_body_with(body, start, content.world.touching_of(new));
        added.map_err(|error| refused(error.display(&content)))?;
        simulation.set_load(new, content.loads[new].clone()).map_err(refused)?;
        last.change_bodies().add_body(start);
        let name = content.bodies[new].clone();
        own.content = Arc::new(content);
        Ok(name)
    }

    /// Removes a body, and the joints attached to it if `joints` is true.
    fn leave(&self, body: usize, joints: bool) -> PyResult<()> {
        let mut own = self.owned()?;
        let joint = own.content.world.joints().iter().position(|joint| joint.ties(body));
        if let Some(joint) = joint.filter(|_| !joints) {
            let (name, joint) = (&own.content.bodies[body], &own.content.joints[joint]);
            let why = format!("{name} is attached to {joint}; joints=True removes its joints too");
            return Err(refused(why));
        }
        let content = own.content.without_body(body).map_err(in_python)?;
        let Running { simulation, last, .. } = own.moved();
        let world = simulation.world();
        let joints: Vec<_> = world.joints().iter().map(|joint| !joint.ties(body)).collect();
        let stays = |gear: &Gear| gear.axes().iter().all(|axis| joints[axis.joint]);
        let gears: Vec<_> = world.gears().iter().map(stays).collect();
        simulation.remove_body_and_joints(body).map_err(refused)?;
        last.change_bodies().leave_out(body, &joints, &gears);
        own.content = Arc::new(content);
        Ok(())
    }

    /// Model with the current bodies and states, as text. Bodies may have been added or removed.
    fn model_text(&self) -> PyResult<String> {
        let own = self.owned()?;
        let mut content = (*own.content).clone();
        let states = own.running.simulation.states();
        content.document.start_at(states, own.time()).map_err(in_python)?;
        content.model_text().map_err(in_python)
    }

    /// Fixes a body at its pose, or releases it.
    fn keep(&self, body: usize, held: bool) -> PyResult<()> {
        let mut own = self.owned()?;
        let done = own.moved().simulation.hold_body(body, held);
        done.map_err(|error| own.named(&error))
    }

    /// Indices of the fixed bodies.
    fn kept(&self) -> PyResult<Vec<usize>> {
        let own = self.owned()?;
        let world = own.running.simulation.world();
        Ok((0..world.bodies().len()).filter(|body| world.is_held(*body)).collect())
    }

    /// Step index k.
    #[getter]
    fn index(&self) -> PyResult<u64> {
        Ok(self.owned()?.running.simulation.index())
    }

    /// Time t = k h, s.
    #[getter]
    fn time(&self) -> PyResult<f64> {
        Ok(self.owned()?.time())
    }

    /// Current states: (N, 13).
    #[getter]
    fn states<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        states_array(py, self.owned()?.running.simulation.states())
    }

    /// States from which the next step starts: (N, 13).
    #[getter]
    fn step_states<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        states_array(py, self.owned()?.running.simulation.step_states())
    }

    /// Hits of rays (R, 3): see [`Placed::cast`].
    fn hits<'py>(
        &self,
        py: Python<'py>,
        origins: Numbers<'_>,
        directions: Numbers<'_>,
        most: f64,
        ignored: Vec<String>,
        all: bool,
    ) -> PyResult<Hits<'py>> {
        self.owned()?.placed().cast(py, [&origins, &directions], most, &ignored, all)
    }

    /// Distance of two objects: see [`Placed::distance`].
    fn between<'py>(&self, py: Python<'py>, first: &str, second: &str) -> PyResult<Between<'py>> {
        self.owned()?.placed().distance(py, first, second)
    }

    /// Objects near a piece: see [`Placed::near`].
    fn near(
        &self,
        text: &str,
        path: PathBuf,
        within: f64,
        ignored: Vec<String>,
    ) -> PyResult<Vec<(String, f64)>> {
        self.owned()?.placed().near(text, &path, within, &ignored)
    }

    /// Near pairs: see [`Placed::pairs`].
    fn near_pairs(&self, within: f64, excluded: bool) -> PyResult<Vec<(String, String, f64)>> {
        self.owned()?.placed().pairs(within, excluded)
    }

    /// Takes one step, with wrenches (N, 6) if not None, held or at the instant. Returns status, residual
    /// in m/s and iterations.
    #[pyo3(signature = (wrenches=None, at_instant=false))]
    fn advance(
        &self,
        py: Python<'_>,
        wrenches: Option<Numbers<'_>>,
        at_instant: bool,
    ) -> PyResult<(&'static str, f64, u32)> {
        let mut own = self.owned()?;
        own.leave_lost_threads()?;
        let Owned { running, interrupt, threads, .. } = &mut *own;
        running.simulation.set_at_instant(at_instant);
        if let Some(wrenches) = &wrenches {
            let count = 6 * running.simulation.states().len();
            let wrenches = as_many("wrenches", wrenches, Some(count))?;
            running.set_wrenches(wrenches).map_err(|e| refused(&e))?;
        }
        let of_few = running.simulation.states().len() <= MANY_BODIES;
        let is_short = running.took.map_or(of_few, |took| took < SHORT);
        let clock = Instant::now();
        let rests = running.simulation.rests();
        let mut step = || running.step(rests);
        let taken = if *threads || !is_short {
            let done = AtomicU64::new(0);
            let watched = Watched { interrupt, done: &done, total: 1, progress: None };
            watched.run(py, step)?
        } else {
            step()
        };
        running.took = Some(clock.elapsed());
        taken.map_err(|error| step_error(&error))?;
        let record = running.last.record();
        Ok((record.status().name(), record.residual(), record.report().iterations))
    }

    /// Sets the motor of a joint axis, 0, 1, 2 along x, y, z and 3, 4, 5 about them. The motor
    /// controls speed or position. Without both targets, the motor is removed.
    fn put_motor(&self, joint: usize, axis: usize, given: MotorNumbers) -> PyResult<()> {
        let mut own = self.owned()?;
        let simulation = &mut own.moved().simulation;
        simulation.set_motor(joint, joint_axis(axis), motor(given)).map_err(refused)
    }

    /// Target, stiffness, damping and force limit of the position motor of a joint axis; None without one.
    fn position_motor(&self, joint: usize, axis: usize) -> PyResult<Option<[f64; 4]>> {
        Ok(match drive_of(&self.owned()?.running.simulation, joint, axis).motor {
            Some(Motor::Position { target, stiffness, damping, max_force }) => {
                Some([target, stiffness, damping, max_force])
            }
            _ => None,
        })
    }

    /// Sets the motor of the sum of a gear with a drive.
    fn put_gear_motor(&self, gear: usize, given: MotorNumbers) -> PyResult<()> {
        let mut own = self.owned()?;
        let simulation = &mut own.moved().simulation;
        let drive = simulation.world().gears().get(gear).and_then(Gear::drive);
        let drive = Drive { motor: motor(given), ..drive.copied().unwrap_or_default() };
        simulation.set_gear_drive(gear, drive).map_err(refused)
    }

    /// Applies the controls (A,) of a robot's actuators to its joints.
    fn put_controls(&self, robot: PyRef<'_, PyRobot>, controls: Numbers<'_>) -> PyResult<()> {
        let controls = numbers("controls", &controls)?;
        let mut running = self.owned()?;
        let (own, simulation) = (robot.own(), &mut running.moved().simulation);
        let joints = own.robot().actuators.iter().flat_map(|actuator| &actuator.joints);
        for joint in joints.map(|(joint, _)| *joint) {
            let Some((number, axis)) = own.axis(joint) else { continue };
            let drive = own.drive(joint, controls).map_err(refused)?;
            simulation.set_drive(number, joint_axis(axis), drive).map_err(refused)?;
        }
        for (gear, drive) in own.sum_drives(controls).map_err(refused)? {
            simulation.set_gear_drive(gear, drive).map_err(refused)?;
        }
        Ok(())
    }

    /// Sets the constant force along a joint axis, N or N m.
    fn put_force(&self, joint: usize, axis: usize, force: f64) -> PyResult<()> {
        let mut own = self.owned()?;
        let simulation = &mut own.moved().simulation;
        let drive = Drive { force, ..drive_of(simulation, joint, axis) };
        simulation.set_drive(joint, joint_axis(axis), drive).map_err(refused)
    }

    /// Sum of the contact forces on each body over the last step, N, world: (N, 3).
    #[getter]
    fn forces<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        let own = self.owned()?;
        let running = &own.running;
        let bodies = running.simulation.states().len();
        let force = |body| <[f64; 3]>::from(running.last.record().mean_force(body));
        shaped(py, (0..bodies).flat_map(force).collect(), &[bodies, 3])
    }

    /// Current coordinates and rates of a robot. Hinges include full turns; other angles are the
    /// ones nearest to `near`.
    fn coordinates_of<'py>(
        &self,
        py: Python<'py>,
        robot: PyRef<'_, PyRobot>,
        near: Numbers<'py>,
    ) -> PyResult<(Array<'py>, Array<'py>)> {
        let mut own = self.owned()?;
        let Owned { running, coordinates, .. } = &mut *own;
        let found = coordinates.read(&robot, &running.simulation, numbers("near", &near)?);
        let (q, v) = found.map_err(refused)?;
        Ok((list(py, q.to_vec())?, list(py, v.to_vec())?))
    }

    /// Current coordinates of the joints, and their rates and forces over the last step, as columns
    /// (J, 3).
    #[getter]
    fn joint_columns<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let own = self.owned()?;
        let Running { simulation, last, .. } = &own.running;
        let mut end = StepRecord::new();
        simulation.end(&mut end);
        let world = simulation.world();
        let now = JointRow::from_interval(world, end.first());
        // Before the first step there are no rates and forces.
        let steps = IntervalRows::from_step(world, last.record());
        let steps = whole_steps(world, &steps);
        let before = steps.iter().filter(|_| simulation.index() > 0);
        let mut before = before.flat_map(|step| step.joints.iter().copied());
        let rows = now.map(|JointRow { place, turns, .. }| {
            let before = before.next().unwrap_or_default();
            JointRow { place, turns, ..before }.vectors()
        });
        let rows: Vec<_> = rows.collect();
        let columns = PyDict::new(py);
        for (column, name) in JOINT_COLUMNS.into_iter().enumerate() {
            let numbers = rows.iter().flat_map(|row| <[f64; 3]>::from(row[column])).collect();
            columns.set_item(name, shaped(py, numbers, &[rows.len(), 3])?)?;
        }
        Ok(columns)
    }

    /// States at the start and the end of the last step, (N, 13) each; None before the first step.
    #[getter]
    fn last_states<'py>(&self, py: Python<'py>) -> PyResult<Option<(Array<'py>, Array<'py>)>> {
        let own = self.owned()?;
        let record = own.running.last.record();
        if record.states().is_empty() {
            return Ok(None);
        }
        let (mut states, next) = (record.states().to_vec(), record.next_states());
        // The change of velocity that forces of the last step have in its whole length.
        if let Some((share, _)) = record.shares().next() {
            for (body, (state, next)) in states.iter_mut().zip(next).enumerate() {
                let longer = share.forces(body, None) / share.time();
                if longer != 1.0 {
                    state.velocity = next.velocity - (next.velocity - state.velocity) * longer;
                    state.spin = next.spin - (next.spin - state.spin) * longer;
                }
            }
        }
        Ok(Some((states_array(py, &states)?, states_array(py, next)?)))
    }

    /// Sum of the normal forces of the last step's contacts on a robot's link, N. Optionally only
    /// those with one partner, or within a radius (m) of a point of the link.
    fn touched(
        &self,
        robot: PyRef<'_, PyRobot>,
        link: usize,
        partner: Option<&str>,
        within: Option<([f64; 3], f64)>,
    ) -> PyResult<f64> {
        let own = self.owned()?;
        let named = |partner: &str| {
            let content = &own.content;
            let place = |names: &[String]| names.iter().position(|name| name == partner);
            match partner {
                "ground" => Some(Partner::Ground),
                _ => place(&content.bodies)
                    .map(Partner::Body)
                    .or_else(|| place(&content.fixed).map(Partner::Fixed)),
            }
        };
        let unknown = |partner: &str| {
            refused(format!(
                "partner: {partner:?} is unknown; the name of a body or fixed piece, or \
                 \"ground\", is needed"
            ))
        };
        let partner =
            partner.map(|partner| named(partner).ok_or_else(|| unknown(partner))).transpose()?;
        let within = within
            .map(|(point, radius)| {
                Ok::<_, PyErr>((at_place((link, point, [1.0, 0.0, 0.0, 0.0]))?, radius))
            })
            .transpose()?;
        let record = own.running.last.record();
        if record.states().is_empty() {
            return Ok(0.0);
        }
        let within = within.as_ref().map(|(site, radius)| (site, *radius));
        robot.own().touch(record, link, partner, within).map_err(refused)
    }

    /// Contacts of the last step as columns, as in Trajectory.contacts without k. The object keeps
    /// the contacts of that step.
    #[getter]
    fn contacts(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        let mut own = self.owned()?;
        let Owned { running, content, .. } = &mut *own;
        running.last.contacts(py, content)
    }

    /// Takes `steps` steps and records them, with wrenches (T, N, 6), targets of motors (T, M) and
    /// joint forces (T, A) if not None. Also returns the exception that ended them early, if any.
    #[pyo3(signature = (steps, wrenches=None, motors=None, joint_forces=None, *, at_instant=false, contacts=true, progress=None))]
    #[expect(clippy::too_many_arguments, reason = "the arguments of one Python method")]
    fn record(
        &self,
        py: Python<'_>,
        steps: usize,
        wrenches: Option<Numbers<'_>>,
        motors: Option<Numbers<'_>>,
        joint_forces: Option<Numbers<'_>>,
        at_instant: bool,
        contacts: bool,
        progress: Option<Bound<'_, PyAny>>,
    ) -> PyResult<(PyRecording, Option<Py<PyBaseException>>)> {
        let mut own = self.owned()?;
        own.leave_lost_threads()?;
        let Owned { running, interrupt, content, .. } = &mut *own;
        running.simulation.set_at_instant(at_instant);
        let world = running.simulation.world();
        let given = |name, array: &'_ Option<Numbers<'_>>, width: usize| {
            let count = width.checked_mul(steps);
            array.as_ref().map(|array| as_many(name, array, count).map(<[f64]>::to_vec)).transpose()
        };
        let targets = world.motors().len() + world.gear_motors().len();
        let pushes = given("wrenches", &wrenches, 6 * world.bodies().len())?;
        let motors = given("motors", &motors, targets)?;
        let joint_forces = given("joint_forces", &joint_forces, world.driven_axes().len())?;
        let inputs = StepInputs {
            wrenches: pushes.as_deref(),
            motors: motors.as_deref(),
            joint_forces: joint_forces.as_deref(),
        };
        let done = AtomicU64::new(0);
        let progress = progress.as_ref();
        let watched = Watched { interrupt, done: &done, total: steps as u64, progress };
        let mut recording = PyRecording {
            content: Arc::clone(content),
            rows: Vec::new(),
            forces: Vec::new(),
            has_contacts: contacts,
            is_of_scene: running.is_of_scene,
        };
        let ended = watched.run(py, || running.run(steps, &inputs, &mut recording, &done));
        let ended = ended.and_then(|ended| ended.map_err(|error| step_error(&error)));
        recording.add(running.end());
        recording.is_of_scene = running.is_of_scene;
        Ok((recording, ended.err().map(|raised| raised.into_value(py))))
    }
}

/// Message for a call during another call.
const BUSY: &str = "this simulation is running in another thread or in a callback of its own; wait for its end, or copy \
                    it first (copy.copy) for each thread";

impl PySimulation {
    /// Data of this call; an error during another call.
    pub fn owned(&self) -> PyResult<MutexGuard<'_, Owned>> {
        match self.0.try_lock() {
            Ok(owned) => Ok(owned),
            Err(TryLockError::Poisoned(poisoned)) => Ok(poisoned.into_inner()),
            Err(TryLockError::WouldBlock) => Err(refused(BUSY)),
        }
    }
}

/// Drive of a joint axis, 0, 1, 2 along x, y, z and 3, 4, 5 about them; none for an axis that is not free.
fn drive_of(simulation: &Simulation<'_>, joint: usize, axis: usize) -> Drive {
    let of = simulation.world().joints().get(joint);
    match of.and_then(|of| of.linear().iter().chain(of.angular()).nth(axis)) {
        Some(Axis::Free(drive)) => *drive,
        _ => Drive::NONE,
    }
}

fn joint_axis(axis: usize) -> JointAxis {
    if axis < 3 { JointAxis::Linear(axis) } else { JointAxis::Angular(axis - 3) }
}

/// Target speed, target position, stiffness, damping and largest force of a motor.
type MotorNumbers = (Option<f64>, Option<f64>, f64, f64, f64);

/// Motor that controls speed, with damping if that is positive, or position. None without both.
fn motor((speed, position, stiffness, damping, max_force): MotorNumbers) -> Option<Motor> {
    match (speed, position) {
        (Some(target), _) if damping > 0.0 => Some(Motor::Damper { target, damping, max_force }),
        (Some(target), _) => Some(Motor::Speed { target, max_force }),
        (None, Some(target)) => Some(Motor::Position { target, stiffness, damping, max_force }),
        (None, None) => None,
    }
}
