//! The program of N steps: variables and rows stage after stage, and all that Ipopt asks of them.
//!
//! ```text
//! x = (controls of the start, X_0, then per step  X_{k+1}, F and λ of its contacts, forces of its joints' axes,
//!      controls whose piece begins with it, slacks of its keeps)                      (eq. P10)
//! ```

mod functions;
mod geared;
mod point;
mod pushed;
mod starts;
#[cfg(test)]
mod tests;
mod tied;

use super::axis::{AxisLaw, FORCE};
use super::candidates::candidates;
use super::contact::Meeting;
use super::joint::Held;
use super::law::{Law, NORMAL, Rows};
use super::motion::Motion;
use super::smoothing::Smoothing;
use super::summed::Summed;
use crate::contact::{Contact, ContactKey};
use crate::ipopt::Bounds;
use crate::mechanics::{State, Wrench};
use crate::plan::{AxisMode, ContactMode, ControlKind, Mode, PlanError, Problem, Replay};
use crate::solver::ipopt::units::Units;
use crate::sparsity::SparsityPattern;
use crate::step_nlp::layout::STATE;
use crate::step_nlp::several::touch::Touch;
use crate::world::World;
use geared::{Mesh, Meshed, meshes};
use nalgebra::Vector3;
use point::Read;
use starts::part_of;
use tied::Joints;

/// The program of a problem. Points x have [`PlanNlp::variables`] numbers, rows and multipliers
/// [`PlanNlp::rows`]; methods panic on shorter slices.
pub struct PlanNlp<'p> {
    problem: &'p Problem,
    units: Units,
    /// In the program's units.
    motions: Vec<Motion>,
    meetings: Vec<Meeting>,
    joints: Joints,
    gears: Vec<Mesh>,
    stages: Vec<Stage>,
    /// The column of X_0.
    first: usize,
    /// The column of each of the problem's variables, and the length of its bounds, by which it is divided.
    columns: Vec<usize>,
    scales: Vec<f64>,
    starts: Vec<StartRows>,
    /// X_0, where nothing is chosen of it.
    own: Vec<State>,
    variables: usize,
    rows: usize,
    bounds: Bounds,
    /// What the cost is multiplied with.
    factor: f64,
    jacobian: Summed,
    hessian: Summed,
}

/// One step.
struct Stage {
    /// The column of X_{k+1}.
    end: usize,
    /// The first row of the motions.
    rows: usize,
    contacts: Vec<Placed>,
    /// The axes of every joint that have a law.
    axes: Vec<Vec<Held>>,
    gears: Vec<Meshed>,
    /// Loads of the scene, constant over the step, in the program's units.
    loads: Vec<Wrench>,
    /// Columns of the slacks of the problem's keeps, and their rows.
    keeps: Vec<(usize, usize)>,
}

/// A contact in a step.
struct Placed {
    key: ContactKey,
    /// Which of the meetings.
    meeting: usize,
    law: Law,
    columns: [usize; 4],
    row: usize,
}

/// The rows that hold a part of X_0 to what is chosen of it.
struct StartRows {
    control: usize,
    row: usize,
}

/// The rows of all contacts and axes.
struct Laws<'a> {
    /// The contacts of each step, with their rows.
    contacts: Vec<Vec<(Contact, Rows)>>,
    axes: AxisRows<'a>,
    /// ε.
    compliance: f64,
}

/// The rows of the axes of joints.
#[derive(Clone, Copy)]
enum AxisRows<'a> {
    /// Smoothed by this δ.
    Smoothed(f64),
    /// With the modes of each step.
    Fixed(&'a [Vec<AxisMode>]),
}

impl<'p> PlanNlp<'p> {
    /// The program of `problem` with the rows `laws`, about the states of `replay`.
    ///
    /// # Errors
    /// A scene or a control that it does not know.
    fn new(problem: &'p Problem, replay: &Replay, laws: &Laws<'_>) -> Result<Self, PlanError> {
        check(problem)?;
        let own = &problem.scene().world;
        let units = Units::of_weights(own);
        let world = units.world(own);
        let motions: Vec<_> = world.bodies().iter().map(|body| Motion::new(&world, body)).collect();
        let joints = Joints::new(problem, &units)?;
        let gears = meshes(problem, &joints)?;
        let mut program = Self {
            problem,
            units,
            motions,
            meetings: Vec::new(),
            joints,
            gears,
            stages: Vec::with_capacity(problem.steps()),
            first: 0,
            columns: vec![usize::MAX; problem.variables().len()],
            scales: problem.variables().iter().map(|variable| variable.scale()).collect(),
            starts: Vec::new(),
            own: problem.scene().starts.iter().map(|state| units.state(state)).collect(),
            variables: 0,
            rows: 0,
            bounds: Bounds {
                lower: Vec::new(),
                upper: Vec::new(),
                constraint_lower: Vec::new(),
                constraint_upper: Vec::new(),
            },
            factor: 1.0,
            jacobian: Summed::default(),
            hessian: Summed::default(),
        };
        program.lay_start();
        let mut known = Vec::new();
        for step in 0..problem.steps() {
            program.lay_step(step, replay, (&world, laws), &mut known)?;
        }
        let x = vec![0.5; program.variables];
        let y = vec![0.0; program.rows];
        let read = program.read(&x);
        program.jacobian = Summed::of(|sink| program.emit_jacobian(&read, sink));
        let hessian = Summed::of(|sink| program.emit_hessian(&read, 0.0, &y, sink));
        program.hessian = hessian;
        Ok(program)
    }

    /// The program of `problem` with the contacts that `replay` finds, all with the rows of `smoothing`.
    ///
    /// # Errors
    /// A scene or a control that it does not know.
    pub fn smoothed(
        problem: &'p Problem,
        replay: &Replay,
        smoothing: Smoothing,
    ) -> Result<Self, PlanError> {
        let contacts = candidates(&problem.scene().world, replay, &[]);
        Self::smoothed_with(problem, replay, &contacts, smoothing)
    }

    /// The same with the contacts of each step given.
    ///
    /// # Errors
    /// As [`PlanNlp::smoothed`].
    pub fn smoothed_with(
        problem: &'p Problem,
        replay: &Replay,
        contacts: &[Vec<Contact>],
        smoothing: Smoothing,
    ) -> Result<Self, PlanError> {
        let law = |contact: &Contact| (*contact, smoothing.rows());
        let contacts = contacts.iter().map(|contacts| contacts.iter().map(law).collect()).collect();
        let axes = AxisRows::Smoothed(smoothing.delta);
        Self::new(problem, replay, &Laws { contacts, axes, compliance: smoothing.compliance })
    }

    /// The program of `problem` with the contacts that `replay` finds, each with the rows of its mode in the replay, the axes
    /// of joints likewise, and the compliance ε.
    ///
    /// # Errors
    /// A scene or a control that it does not know.
    pub fn with_modes(
        problem: &'p Problem,
        replay: &Replay,
        compliance: f64,
    ) -> Result<Self, PlanError> {
        let contacts = candidates(&problem.scene().world, replay, &[]);
        let law = |contact: &Contact, modes: &[ContactMode]| {
            let known = modes.iter().find(|of| of.key == contact.key);
            let rows = match known.map_or(Mode::Open, |of| of.mode) {
                Mode::Open => Rows::Open,
                Mode::Stick => Rows::Stick,
                Mode::Slip => Rows::Slip,
            };
            (*contact, rows)
        };
        let contacts = contacts
            .iter()
            .zip(&replay.modes.contacts)
            .map(|(contacts, modes)| contacts.iter().map(|contact| law(contact, modes)).collect())
            .collect();
        let axes = AxisRows::Fixed(&replay.modes.axes);
        Self::new(problem, replay, &Laws { contacts, axes, compliance })
    }

    /// Columns for `count` variables within `bounds`.
    fn add_variables(&mut self, count: usize, [low, high]: [f64; 2]) -> usize {
        let first = self.variables;
        self.variables += count;
        self.bounds.lower.resize(self.variables, low);
        self.bounds.upper.resize(self.variables, high);
        first
    }

    /// Rows that are to be 0, or at least 0.
    fn add_rows(&mut self, count: usize, is_inequality: bool) -> usize {
        let first = self.rows;
        self.rows += count;
        let high = if is_inequality { f64::INFINITY } else { 0.0 };
        self.bounds.constraint_lower.resize(self.rows, 0.0);
        self.bounds.constraint_upper.resize(self.rows, high);
        first
    }

    /// A row between two bounds.
    fn add_row_within(&mut self, low: f64, high: f64) {
        self.rows += 1;
        self.bounds.constraint_lower.push(low);
        self.bounds.constraint_upper.push(high);
    }

    /// The columns of the variables of controls that `of` says yes to.
    fn lay_controls(&mut self, of: impl Fn(&ControlKind, usize, usize) -> bool) {
        for (index, variable) in self.problem.variables().iter().enumerate() {
            let kind = &self.problem.controls()[variable.control].kind;
            if of(kind, variable.control, variable.knot) {
                let bounds = variable.bounds.map(|bound| bound / variable.scale());
                self.columns[index] = self.add_variables(1, bounds);
            }
        }
    }

    fn lay_start(&mut self) {
        self.lay_controls(|kind, _, _| kind.is_of_the_run());
        let free = [f64::NEG_INFINITY, f64::INFINITY];
        self.first = self.add_variables(STATE.end * self.own.len(), free);
        let fixed: Vec<f64> =
            self.own.iter().flat_map(|state| state.to_vector().as_slice().to_vec()).collect();
        let range = self.first..self.variables;
        self.bounds.lower[range.clone()].copy_from_slice(&fixed);
        self.bounds.upper[range].copy_from_slice(&fixed);
        for (control, of) in self.problem.controls().iter().enumerate() {
            let ControlKind::Start { body, part } = of.kind else { continue };
            let (part, count) = part_of(part);
            let columns = self.first + STATE.end * body + part;
            self.bounds.lower[columns..columns + count].fill(f64::NEG_INFINITY);
            self.bounds.upper[columns..columns + count].fill(f64::INFINITY);
            let row = self.add_rows(count, false);
            self.starts.push(StartRows { control, row });
        }
    }

    fn lay_step(
        &mut self,
        step: usize,
        replay: &Replay,
        (world, laws): (&World, &Laws<'_>),
        known: &mut Vec<(ContactKey, crate::contact::Features)>,
    ) -> Result<(), PlanError> {
        let free = [f64::NEG_INFINITY, f64::INFINITY];
        let end = self.add_variables(STATE.end * self.own.len(), free);
        let motion_rows = self.add_rows(STATE.end * self.own.len(), false);
        let h = world.time_step();
        let contacts = laws.contacts.get(step).map_or(&[][..], |contacts| contacts);
        let mut placed = Vec::with_capacity(contacts.len());
        for (contact, rows) in contacts {
            if contact.features.curved.is_some() {
                return refused("its two features are both round, which the program does not know");
            }
            let features = contact.features;
            let alike = known.iter().position(|known| *known == (contact.key, features));
            let meeting = alike.unwrap_or_else(|| {
                let states: Vec<_> =
                    replay.states[step].iter().map(|state| self.units.state(state)).collect();
                let side = |body: usize| (body, &world.bodies()[body], &states[body]);
                let b = contact.key.partner.body().map(side);
                let contact = self.units.contact(contact);
                let touch = Touch::new(&contact, side(contact.key.body), b, h);
                self.meetings.push(Meeting::new(&contact, touch, h));
                known.push((contact.key, features));
                known.len() - 1
            });
            let law = Law {
                rows: *rows,
                friction: contact.law.friction,
                compliance: laws.compliance * h,
                anchor: Vector3::zeros(),
            };
            let bounds = |i: usize| match law.rows {
                Rows::Stick | Rows::Slip if i >= NORMAL => [0.0, f64::INFINITY],
                _ => free,
            };
            let mut columns = [usize::MAX; 4];
            for (i, column) in columns.iter_mut().enumerate() {
                if law.has(i) {
                    *column = self.add_variables(1, bounds(i));
                }
            }
            let row = self.rows;
            for i in 0..law.count() {
                self.add_rows(1, law.is_inequality(i));
            }
            placed.push(Placed { key: contact.key, meeting, law, columns, row });
        }
        let axes = self.lay_axes(step, h, laws);
        let gears = self.lay_gears(h, laws);
        let problem = self.problem;
        self.lay_controls(|kind, control, knot| {
            let begins = step == 0 || problem.knot(control, step - 1) != knot;
            !kind.is_of_the_run() && problem.knot(control, step) == knot && begins
        });
        let keeps = (0..self.problem.keeps().len())
            .map(|_| (self.add_variables(1, [0.0, f64::INFINITY]), self.add_rows(1, true)))
            .collect();
        let loads = self.loads(step, &replay.states[step]);
        let rows = motion_rows;
        self.stages.push(Stage { end, rows, contacts: placed, axes, gears, loads, keeps });
        Ok(())
    }

    /// What the scene itself puts on the bodies.
    fn loads(&self, step: usize, states: &[State]) -> Vec<Wrench> {
        let scene = self.problem.scene();
        let (h, index) = (scene.world.time_step(), scene.start_index + step as u64);
        let loads = scene.loads.iter().zip(states);
        loads
            .map(|(load, state)| self.units.wrench(&load.wrench(index, h, &state.attitude)))
            .collect()
    }

    /// Those of its variables and rows.
    #[must_use]
    pub fn bounds(&self) -> &Bounds {
        &self.bounds
    }

    /// How many variables there are.
    #[must_use]
    pub fn variables(&self) -> usize {
        self.variables
    }

    /// How many rows there are.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Where the Jacobian can be non-zero.
    #[must_use]
    pub fn jacobian_pattern(&self) -> &SparsityPattern {
        self.jacobian.pattern()
    }

    /// Where the Hessian of the Lagrangian can be non-zero, lower triangle.
    #[must_use]
    pub fn hessian_pattern(&self) -> &SparsityPattern {
        self.hessian.pattern()
    }

    /// Other smoothing and compliance of every contact; the pattern stays.
    pub(super) fn smooth(&mut self, smoothing: Smoothing) {
        let h = self.problem.scene().world.time_step() * self.units.speed() / self.units.length();
        for placed in self.stages.iter_mut().flat_map(|stage| &mut stage.contacts) {
            placed.law.rows = smoothing.rows();
            placed.law.compliance = smoothing.compliance * h;
        }
        for law in self.each_law() {
            (law.delta, law.compliance) = (smoothing.delta, smoothing.compliance * h);
        }
    }

    /// The laws of all axes and gears.
    fn each_law(&mut self) -> impl Iterator<Item = &mut AxisLaw> {
        self.stages.iter_mut().flat_map(|stage| {
            let axes = stage.axes.iter_mut().flatten().map(|held| &mut held.law);
            axes.chain(stage.gears.iter_mut().map(|meshed| &mut meshed.law))
        })
    }

    /// Makes the forces at `x` those at which the compliance gives nothing.
    pub(in crate::plan) fn anchor(&mut self, x: &[f64]) {
        for placed in self.stages.iter_mut().flat_map(|stage| &mut stage.contacts) {
            for i in 0..3 {
                if placed.law.has(i) {
                    placed.law.anchor[i] = x[placed.columns[i]];
                }
            }
        }
        for held in self.stages.iter_mut().flat_map(|stage| stage.axes.iter_mut().flatten()) {
            held.law.anchor = held.numbers(x);
        }
        for meshed in self.stages.iter_mut().flat_map(|stage| &mut stage.gears) {
            meshed.law.anchor[FORCE] = x[meshed.column];
        }
    }
}

fn refused<T>(why: &str) -> Result<T, PlanError> {
    Err(PlanError::Problem(format!("the program cannot pose this problem: {why}")))
}

/// Refuses what the program does not know.
fn check(problem: &Problem) -> Result<(), PlanError> {
    let (scene, world) = (problem.scene(), &problem.scene().world);
    if world.has_surfaces() {
        return refused("its scene has surfaces that move");
    }
    if world.has_restitution() {
        return refused("its scene has restitution");
    }
    if scene.loads.iter().any(|load| *load.point() != Vector3::zeros()) {
        return refused("a load of its scene acts at a point");
    }
    if (0..world.bodies().len()).any(|body| world.is_held(body)) {
        return refused("a body of its scene is held");
    }
    let starts = |kind: &ControlKind| matches!(kind, ControlKind::Start { .. });
    if tied::has_armature(problem) && problem.controls().iter().any(|of| starts(&of.kind)) {
        return refused("an axis has an armature, and a start is looked for");
    }
    for control in problem.controls() {
        if let ControlKind::Constant(_) = control.kind {
            return refused("it looks for a constant of the world");
        }
    }
    Ok(())
}
