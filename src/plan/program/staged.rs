//! The program of N steps: variables and rows stage after stage, and all that Ipopt asks of them.
//!
//! ```text
//! x = (controls of the start, X_0, then per step  X_{k+1}, F and λ of its contacts,
//!      controls whose piece begins with it, slacks of its keeps)                      (eq. P10)
//! ```

use super::candidates::candidates;
use super::contact::{Meeting, Posed, Side};
use super::goal::{Exponential, Goal};
use super::law::{Law, NORMAL, Rows, SLIP_SPEED};
use super::motion::Motion;
use super::solve::Smoothing;
use crate::contact::{Contact, ContactKey};
use crate::ipopt::Bounds;
use crate::mechanics::quaternion::{left, rotated_point_forms};
use crate::mechanics::{State, Wrench};
use crate::plan::{
    Applied, Axes, ContactMode, ControlKind, Mode, PlanError, Problem, Replay, StartPart,
};
use crate::solver::ipopt::units::Units;
use crate::sparsity::SparsityPattern;
use crate::step_nlp::entries::{EntrySink, Summed};
use crate::step_nlp::layout::{
    ATTITUDE, POSITION, SPIN, SPIN_ROWS, STATE, VELOCITY, VELOCITY_ROWS,
};
use crate::step_nlp::several::touch::{Touch, rows, weighted};
use crate::world::World;
use nalgebra::{Matrix3x4, SVector, Vector3, Vector4};

/// The program of a problem. Points x have [`PlanNlp::variables`] numbers, rows and multipliers
/// [`PlanNlp::rows`]; methods panic on shorter slices.
pub struct PlanNlp<'p> {
    problem: &'p Problem,
    units: Units,
    /// In the program's units.
    motions: Vec<Motion>,
    meetings: Vec<Meeting>,
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

/// The contacts of each step, with their rows.
type Laws = Vec<Vec<(Contact, Rows)>>;

impl<'p> PlanNlp<'p> {
    /// The program of `problem` with the contacts `laws` of each step, with the compliance ε = `compliance`. `replay` has the
    /// wrenches of the scene's loads.
    ///
    /// # Errors
    /// A scene or a control that it does not know.
    fn new(
        problem: &'p Problem,
        replay: &Replay,
        laws: &Laws,
        compliance: f64,
    ) -> Result<Self, PlanError> {
        check(problem)?;
        let own = &problem.scene().world;
        let units = Units::of_weights(own);
        let world = units.world(own);
        let motions: Vec<_> = world.bodies().iter().map(|body| Motion::new(&world, body)).collect();
        let mut program = Self {
            problem,
            units,
            motions,
            meetings: Vec::new(),
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
        for (step, contacts) in laws.iter().enumerate() {
            program.lay_step(step, replay, (&world, contacts, compliance), &mut known)?;
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
        let laws: Laws =
            contacts.iter().map(|contacts| contacts.iter().map(law).collect()).collect();
        Self::new(problem, replay, &laws, smoothing.compliance)
    }

    /// The program of `problem` with the contacts that `replay` finds, each with the rows of its mode in the replay, and
    /// the compliance ε.
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
        let laws: Laws = contacts
            .iter()
            .zip(&replay.modes)
            .map(|(contacts, modes)| contacts.iter().map(|contact| law(contact, modes)).collect())
            .collect();
        Self::new(problem, replay, &laws, compliance)
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
        (world, contacts, compliance): (&World, &[(Contact, Rows)], f64),
        known: &mut Vec<(ContactKey, crate::contact::Features)>,
    ) -> Result<(), PlanError> {
        let free = [f64::NEG_INFINITY, f64::INFINITY];
        let end = self.add_variables(STATE.end * self.own.len(), free);
        let motion_rows = self.add_rows(STATE.end * self.own.len(), false);
        let h = world.time_step();
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
                compliance: compliance * h,
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
        let problem = self.problem;
        self.lay_controls(|kind, control, knot| {
            let begins = step == 0 || problem.knot(control, step - 1) != knot;
            !kind.is_of_the_run() && problem.knot(control, step) == knot && begins
        });
        let keeps = (0..self.problem.keeps().len())
            .map(|_| (self.add_variables(1, [0.0, f64::INFINITY]), self.add_rows(1, true)))
            .collect();
        let loads = self.loads(step, &replay.states[step]);
        self.stages.push(Stage { end, rows: motion_rows, contacts: placed, loads, keeps });
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
    }

    /// The point of a run: its states, its forces, and λ the slip speed.
    #[must_use]
    pub fn point_of(&self, replay: &Replay) -> Vec<f64> {
        let mut x = vec![0.0; self.variables];
        let scaled = replay.controls.iter().zip(&self.scales);
        for (&column, (value, scale)) in self.columns.iter().zip(scaled) {
            x[column] = value / scale;
        }
        for (step, states) in replay.states.iter().enumerate() {
            for (body, state) in states.iter().enumerate() {
                let column = self.state(step, body);
                let state = self.units.state(state).to_vector();
                x[column..column + STATE.end].copy_from_slice(state.as_slice());
            }
        }
        for ((stage, record), states) in
            self.stages.iter().zip(&replay.records).zip(&replay.states[1..])
        {
            for placed in &stage.contacts {
                let found = record.solution.contacts.iter().zip(&record.contacts);
                let found = found.into_iter().find(|(force, _)| force.key == placed.key);
                let Some((force, contact)) = found else { continue };
                let along = contact.frame.tr_mul(&force.force) / self.units.force();
                for i in (0..3).filter(|&i| placed.law.has(i)) {
                    x[placed.columns[i]] = along[i];
                }
                if placed.law.has(SLIP_SPEED) {
                    x[placed.columns[SLIP_SPEED]] = force.slip.norm() / self.units.speed();
                }
            }
            for (keep, &(column, _)) in self.problem.keeps().iter().zip(&stage.keeps) {
                let value = keep.kind.at(&states[keep.body].position).0;
                x[column] = (-value / self.units.length()).max(0.0);
            }
        }
        x
    }

    /// The same with the forces of all contacts on the path of their smoothing.
    pub(super) fn path_point_of(&self, replay: &Replay) -> Vec<f64> {
        let mut x = self.point_of(replay);
        let read = self.read(&x);
        for (step, stage) in self.stages.iter().enumerate() {
            for ((meeting, posed), placed) in self.each_contact(step, &read).zip(&stage.contacts) {
                let values = placed.law.on_path(&meeting.numbers(&posed));
                for i in (0..4).filter(|&i| placed.law.has(i)) {
                    x[placed.columns[i]] = values[i];
                }
            }
        }
        x
    }

    /// The controls at `x`, in SI units.
    #[must_use]
    pub fn controls(&self, x: &[f64]) -> Vec<f64> {
        let scaled = self.columns.iter().zip(&self.scales);
        scaled.map(|(&column, scale)| x[column] * scale).collect()
    }

    /// The states at `x`, in SI units, one list a step and one at the end.
    #[must_use]
    pub fn states(&self, x: &[f64]) -> Vec<Vec<State>> {
        let read = self.read(x);
        let unit = |state: &State| {
            let state = self.units.si_state(state);
            State { attitude: state.attitude.normalize(), ..state }
        };
        read.states.iter().map(|states| states.iter().map(unit).collect()).collect()
    }

    /// The column of X_k of a body.
    fn state(&self, step: usize, body: usize) -> usize {
        let first = step.checked_sub(1).map_or(self.first, |step| self.stages[step].end);
        first + STATE.end * body
    }

    fn read(&self, x: &[f64]) -> Read {
        let bodies = self.own.len();
        let state = |step: usize, body: usize| {
            let column = self.state(step, body);
            State::from_vector(&SVector::from_column_slice(&x[column..column + STATE.end]))
        };
        let states = (0..=self.stages.len())
            .map(|step| (0..bodies).map(|body| state(step, body)).collect())
            .collect();
        let value = |column: &usize| if *column == usize::MAX { 0.0 } else { x[*column] };
        let contact = |placed: &Placed| [0, 1, 2, 3].map(|i| value(&placed.columns[i]));
        let stage = |stage: &Stage| stage.contacts.iter().map(contact).collect();
        Read {
            states,
            controls: self.controls(x),
            contacts: self.stages.iter().map(stage).collect(),
        }
    }

    /// Each contact of a step, as it is asked.
    fn each_contact<'a>(
        &'a self,
        step: usize,
        read: &'a Read,
    ) -> impl Iterator<Item = (&'a Meeting, Posed<'a>)> {
        let stage = &self.stages[step];
        let side = move |body: usize| Side {
            motion: &self.motions[body],
            start: &read.states[step][body],
            end: &read.states[step + 1][body],
            columns: (self.state(step, body), self.state(step + 1, body)),
            row: stage.rows + STATE.end * body,
        };
        let values = &read.contacts[step];
        stage.contacts.iter().zip(values).map(move |(placed, values)| {
            let posed = Posed {
                law: &placed.law,
                values: *values,
                columns: placed.columns,
                row: placed.row,
                a: side(placed.key.body),
                b: placed.key.partner.body().map(side),
            };
            (&self.meetings[placed.meeting], posed)
        })
    }

    /// What the controls put on the bodies in a step.
    fn each_push(&self, step: usize, read: &Read) -> Vec<Pushed<'p>> {
        let controls = self.problem.controls().iter().enumerate();
        let pushed = |(index, control): (usize, &'p crate::plan::Control)| {
            let body = control.kind.body()?;
            let (applied, numbers, places) = self.problem.applied(index, step, &read.controls)?;
            let columns = places.iter().map(|place| place.map(|place| self.columns[place]));
            let scales = places.iter().map(|place| place.map_or(0.0, |place| self.scales[place]));
            Some(Pushed {
                kind: &control.kind,
                body,
                applied: self.in_units(&applied),
                numbers,
                columns: columns.collect(),
                scales: scales.collect(),
            })
        };
        controls.filter_map(pushed).collect()
    }

    fn in_units(&self, applied: &Applied) -> Applied {
        let (force, length) = (self.units.force(), self.units.length());
        let torque = applied.torque / (force * length);
        Applied { axes: applied.axes, force: applied.force / force, torque }
    }

    /// What the cost is multiplied with: 1 until this is called.
    pub(in crate::plan) fn set_factor(&mut self, factor: f64) {
        self.factor = factor;
    }

    /// The cost of an objective.
    pub(super) fn unscaled(&self, objective: f64) -> f64 {
        objective / self.factor
    }

    /// The cost (P1), times the factor.
    #[must_use]
    pub fn objective(&self, x: &[f64]) -> f64 {
        self.cost(x) * self.factor
    }

    /// The cost (P1).
    pub(in crate::plan) fn cost(&self, x: &[f64]) -> f64 {
        let read = self.read(x);
        let mut cost = self.problem.effort_of(&read.controls);
        for target in self.problem.targets() {
            let state = &read.states[target.after][target.body];
            cost += target.weight * Goal::of(&target.kind, state, &self.units).value;
        }
        for (keep, column, weight) in self.each_slack() {
            cost += keep.weight * weight * x[column] * x[column];
        }
        cost
    }

    /// Its slope.
    pub fn gradient(&self, x: &[f64], gradient: &mut [f64]) {
        gradient.fill(0.0);
        let read = self.read(x);
        for (index, (of, value)) in self.problem.variables().iter().zip(&read.controls).enumerate()
        {
            let scale = self.scales[index] * self.factor;
            gradient[self.columns[index]] += 2.0 * of.effort * value * scale;
        }
        for target in self.problem.targets() {
            let state = &read.states[target.after][target.body];
            let goal = Goal::of(&target.kind, state, &self.units);
            let first = self.state(target.after, target.body) + goal.first;
            for k in 0..goal.count {
                gradient[first + k] += target.weight * goal.slope[k] * self.factor;
            }
        }
        for (keep, column, weight) in self.each_slack() {
            gradient[column] += 2.0 * keep.weight * weight * x[column] * self.factor;
        }
    }

    /// The slacks of the keeps with the square of their unit.
    fn each_slack(&self) -> impl Iterator<Item = (&crate::plan::Keep, usize, f64)> {
        let square = self.units.length() * self.units.length();
        self.stages.iter().flat_map(move |stage| {
            let pairs = self.problem.keeps().iter().zip(&stage.keeps);
            pairs.map(move |(keep, &(column, _))| (keep, column, square))
        })
    }

    /// All rows.
    pub fn constraints(&self, x: &[f64], rows: &mut [f64]) {
        let read = self.read(x);
        for StartRows { control, row } in &self.starts {
            let (first, values) = self.start_values(*control, &read);
            for (k, value) in values.into_iter().enumerate() {
                rows[row + k] = x[first + k] - value;
            }
        }
        for (step, stage) in self.stages.iter().enumerate() {
            for (body, motion) in self.motions.iter().enumerate() {
                let rows = &mut rows[stage.rows + STATE.end * body..];
                motion.rows((&read.states[step][body], &read.states[step + 1][body]), rows);
                let load = &stage.loads[body];
                motion.add_load(&load.force, &load.torque, rows);
            }
            for pushed in self.each_push(step, &read) {
                let wrench = pushed.applied.wrench(&read.states[step][pushed.body]);
                let rows = &mut rows[stage.rows + STATE.end * pushed.body..];
                self.motions[pushed.body].add_load(&wrench.force, &wrench.torque, rows);
            }
            for (meeting, posed) in self.each_contact(step, &read) {
                meeting.add_rows(&posed, rows);
            }
            for (keep, &(column, row)) in self.problem.keeps().iter().zip(&stage.keeps) {
                let length = self.units.length();
                let place = read.states[step + 1][keep.body].position * length;
                rows[row] = keep.kind.at(&place).0 / length + x[column];
            }
        }
    }

    /// The column of the part of X_0 that a control is of, and what it is to be.
    fn start_values(&self, control: usize, read: &Read) -> (usize, Vec<f64>) {
        let kind = &self.problem.controls()[control].kind;
        let ControlKind::Start { body, part } = kind else { return (self.first, Vec::new()) };
        let (numbers, _) = self.problem.numbers(control, 0, &read.controls);
        let own = &self.problem.scene().starts[*body];
        let state = match part {
            // Not normalised once more: the exponential has length 1.
            StartPart::Turn => {
                let turned = Exponential::of(&Vector3::from_column_slice(&numbers)).quaternion;
                State { attitude: left(&own.attitude) * turned, ..*own }
            }
            _ => kind.started(&numbers, own),
        };
        let (first, count) = part_of(*part);
        let values = self.units.state(&state).to_vector();
        let column = self.first + STATE.end * body + first;
        (column, values.as_slice()[first..first + count].to_vec())
    }

    /// The rows' slopes in the order of their pattern.
    pub fn jacobian(&self, x: &[f64], values: &mut [f64]) {
        let read = self.read(x);
        self.jacobian.fill(values, |sink| self.emit_jacobian(&read, sink));
    }

    fn emit_jacobian(&self, read: &Read, sink: &mut impl EntrySink) {
        for StartRows { control, row } in &self.starts {
            self.emit_start_slopes(*control, *row, read, sink);
        }
        for (step, stage) in self.stages.iter().enumerate() {
            for (body, motion) in self.motions.iter().enumerate() {
                let ends = (&read.states[step][body], &read.states[step + 1][body]);
                let columns = (self.state(step, body), self.state(step + 1, body));
                motion.emit_slopes(ends, stage.rows + STATE.end * body, columns, sink);
            }
            for pushed in self.each_push(step, read) {
                let row = stage.rows + STATE.end * pushed.body;
                let column = self.state(step, pushed.body) + ATTITUDE.start;
                let motion = &self.motions[pushed.body];
                let state = &read.states[step][pushed.body];
                pushed.emit_slopes((motion, state), (row, column), self, sink);
            }
            for (meeting, posed) in self.each_contact(step, read) {
                meeting.emit_slopes(&posed, sink);
            }
            for (keep, &(slack, row)) in self.problem.keeps().iter().zip(&stage.keeps) {
                let place = read.states[step + 1][keep.body].position * self.units.length();
                let slope = keep.kind.at(&place).1;
                let column = self.state(step + 1, keep.body) + POSITION.start;
                sink.put_row(row, column, slope.iter().copied());
                sink.put(row, slack, 1.0);
            }
        }
    }

    /// σ ∇²(cost) + Σ y_r ∇²(row r) in the order of its pattern.
    pub fn hessian(&self, x: &[f64], sigma: f64, y: &[f64], values: &mut [f64]) {
        let read = self.read(x);
        self.hessian.fill(values, |sink| self.emit_hessian(&read, sigma, y, sink));
    }

    fn emit_hessian(&self, read: &Read, sigma: f64, y: &[f64], sink: &mut impl EntrySink) {
        let sigma = sigma * self.factor;
        for (index, of) in self.problem.variables().iter().enumerate() {
            let column = self.columns[index];
            let scale = self.scales[index];
            sink.put(column, column, 2.0 * sigma * of.effort * scale * scale);
        }
        for target in self.problem.targets() {
            let state = &read.states[target.after][target.body];
            let goal = Goal::of(&target.kind, state, &self.units);
            let first = self.state(target.after, target.body) + goal.first;
            let weight = sigma * target.weight;
            for i in 0..goal.count {
                for j in 0..=i {
                    sink.put(first + i, first + j, weight * goal.curvature[(i, j)]);
                }
            }
        }
        for (keep, column, weight) in self.each_slack() {
            sink.put(column, column, 2.0 * sigma * keep.weight * weight);
        }
        for StartRows { control, row } in &self.starts {
            self.emit_start_curvatures(*control, &y[*row..], read, sink);
        }
        for (step, stage) in self.stages.iter().enumerate() {
            for (body, motion) in self.motions.iter().enumerate() {
                let ends = (&read.states[step][body], &read.states[step + 1][body]);
                let columns = (self.state(step, body), self.state(step + 1, body));
                motion.emit_curvatures(ends, &y[stage.rows + STATE.end * body..], columns, sink);
            }
            for pushed in self.each_push(step, read) {
                let own = &y[stage.rows + STATE.end * pushed.body..];
                let column = self.state(step, pushed.body) + ATTITUDE.start;
                let motion = &self.motions[pushed.body];
                let state = &read.states[step][pushed.body];
                pushed.emit_curvatures((motion, state), (own, column), self, sink);
            }
            for (meeting, posed) in self.each_contact(step, read) {
                meeting.emit_curvatures(&posed, y, sink);
            }
            for (keep, &(_, row)) in self.problem.keeps().iter().zip(&stage.keeps) {
                let length = self.units.length();
                let place = read.states[step + 1][keep.body].position * length;
                let bend = keep.kind.at(&place).2 * (y[row] * length);
                sink.put_lower(self.state(step + 1, keep.body) + POSITION.start, &bend);
            }
        }
    }

    /// The columns of a start's components, with the lengths of their bounds.
    fn start_columns(&self, control: usize, read: &Read) -> (Vec<f64>, Vec<Option<(usize, f64)>>) {
        let (numbers, places) = self.problem.numbers(control, 0, &read.controls);
        let place = |place: usize| (self.columns[place], self.scales[place]);
        (numbers, places.into_iter().map(|of| of.map(place)).collect())
    }

    fn emit_start_slopes(
        &self,
        control: usize,
        row: usize,
        read: &Read,
        sink: &mut impl EntrySink,
    ) {
        let ControlKind::Start { body, part } = self.problem.controls()[control].kind else {
            return;
        };
        let (first, count) = part_of(part);
        for k in 0..count {
            sink.put(row + k, self.first + STATE.end * body + first + k, 1.0);
        }
        let (numbers, columns) = self.start_columns(control, read);
        let unit = match part {
            StartPart::Position => 1.0 / self.units.length(),
            StartPart::Velocity => 1.0 / self.units.speed(),
            StartPart::Spin => self.units.length() / self.units.speed(),
            StartPart::Turn => {
                let own = &self.problem.scene().starts[body].attitude;
                let theta = Vector3::from_column_slice(&numbers);
                let slope = left(own) * Exponential::of(&theta).slope();
                for (j, (column, scale)) in columns.iter().enumerate().filter_map(present) {
                    for k in 0..4 {
                        sink.put(row + k, column, -slope[(k, j)] * scale);
                    }
                }
                return;
            }
        };
        for (j, (column, scale)) in columns.iter().enumerate().filter_map(present) {
            sink.put(row + j, column, -unit * scale);
        }
    }

    fn emit_start_curvatures(
        &self,
        control: usize,
        y: &[f64],
        read: &Read,
        sink: &mut impl EntrySink,
    ) {
        let ControlKind::Start { body, part: StartPart::Turn } =
            self.problem.controls()[control].kind
        else {
            return;
        };
        let (numbers, columns) = self.start_columns(control, read);
        let own = &self.problem.scene().starts[body].attitude;
        let y = -left(own).tr_mul(&Vector4::from_column_slice(&y[..4]));
        let bend = Exponential::of(&Vector3::from_column_slice(&numbers)).curvature(&y);
        for (i, (column, scale)) in columns.iter().enumerate().filter_map(present) {
            for (j, (other, other_scale)) in columns.iter().enumerate().filter_map(present) {
                if j <= i {
                    sink.put_symmetric(column, other, bend[(i, j)] * scale * other_scale);
                }
            }
        }
    }
}

fn present((k, of): (usize, &Option<(usize, f64)>)) -> Option<(usize, (usize, f64))> {
    of.map(|of| (k, of))
}

/// A point as it is read.
struct Read {
    states: Vec<Vec<State>>,
    /// SI units.
    controls: Vec<f64>,
    /// F_t1, F_t2, F_n, λ of the contacts of each step.
    contacts: Vec<Vec<[f64; 4]>>,
}

/// What a control puts on a body in a step.
struct Pushed<'p> {
    kind: &'p ControlKind,
    body: usize,
    applied: Applied,
    numbers: Vec<f64>,
    columns: Vec<Option<usize>>,
    scales: Vec<f64>,
}

impl Pushed<'_> {
    /// Whether the wrench depends on the body's attitude: a torque of the world and a force of the body.
    fn turns(&self) -> bool {
        !matches!(self.kind, ControlKind::Force { .. })
    }

    /// The components that are looked for.
    fn free(&self) -> impl Iterator<Item = (usize, usize, f64)> {
        let columns = self.columns.iter().zip(&self.scales).enumerate();
        columns.filter_map(|(i, (column, scale))| column.map(|column| (i, column, *scale)))
    }

    /// The rows of the motion by the attitude and by the control (eq. P23).
    fn emit_slopes(
        &self,
        (motion, state): (&Motion, &State),
        (row, attitude): (usize, usize),
        program: &PlanNlp<'_>,
        sink: &mut impl EntrySink,
    ) {
        let velocity = row + VELOCITY_ROWS.start;
        let spin = row + SPIN_ROWS.start;
        for ((i, column, scale), slope) in self.free().filter_map(|free| {
            self.kind.slopes(&self.numbers).get(free.0).map(|slope| (free, *slope))
        }) {
            let wrench = program.in_units(&slope).wrench(state);
            let push = wrench.force * (motion.velocity_per_force * scale);
            let twist = motion.spin_per_torque * wrench.torque * scale;
            for k in 0..3 {
                if self.pushes(i) {
                    sink.put(velocity + k, column, push[k]);
                }
                if self.turns() {
                    sink.put(spin + k, column, twist[k]);
                }
            }
        }
        let q = &state.attitude;
        match self.applied.axes {
            Axes::World if self.turns() => {
                let mut slope = Matrix3x4::zeros();
                for j in 0..3 {
                    let axis = rows(&rotated_point_forms(&Vector3::ith(j, 1.0)), q);
                    slope.set_row(j, &axis.tr_mul(&self.applied.torque).transpose());
                }
                sink.put_block((spin, attitude), &(motion.spin_per_torque * slope));
            }
            Axes::World => {}
            Axes::Body => {
                let slope = rows(&rotated_point_forms(&self.applied.force), q);
                sink.put_block((velocity, attitude), &(slope * motion.velocity_per_force));
            }
        }
    }

    /// Whether component `i` changes the force.
    fn pushes(&self, i: usize) -> bool {
        match self.kind {
            ControlKind::Torque { .. } => false,
            ControlKind::Push(_) => i < 3,
            _ => true,
        }
    }

    /// The curvatures of that (eq. P23).
    fn emit_curvatures(
        &self,
        (motion, state): (&Motion, &State),
        (y, attitude): (&[f64], usize),
        program: &PlanNlp<'_>,
        sink: &mut impl EntrySink,
    ) {
        if !self.turns() {
            return;
        }
        let (of_force, of_torque) = motion.load_weights(y);
        let q = &state.attitude;
        // What is turned, by what, for the whole and for each component's slope.
        let turned = |applied: &Applied| match applied.axes {
            Axes::World => (rotated_point_forms(&of_torque), applied.torque),
            Axes::Body => (rotated_point_forms(&applied.force), of_force),
        };
        let (forms, weights) = turned(&self.applied);
        sink.put_lower(attitude, &weighted(&forms, &weights));
        let slopes = self.kind.slopes(&self.numbers);
        for (i, column, scale) in self.free() {
            let (forms, weights) = turned(&program.in_units(&slopes[i]));
            let by_attitude = rows(&forms, q).tr_mul(&weights) * scale;
            for k in 0..4 {
                sink.put_symmetric(column, attitude + k, by_attitude[k]);
            }
        }
        if !matches!(self.kind, ControlKind::Push(_)) {
            return;
        }
        let curvatures = self.kind.curvatures(&self.numbers);
        for (i, column, scale) in self.free() {
            for (j, other, other_scale) in self.free().filter(|(j, ..)| *j <= i) {
                let bend = curvatures.iter().find(|(a, b, _)| (*a, *b) == (i, j));
                let bend = bend.map_or(0.0, |(.., bend)| {
                    let bend = program.in_units(bend).wrench(state);
                    of_force.dot(&bend.force) + of_torque.dot(&bend.torque)
                });
                sink.put_symmetric(column, other, bend * scale * other_scale);
            }
        }
    }
}

/// Where a part of a state stands in it, and how many numbers it has.
fn part_of(part: StartPart) -> (usize, usize) {
    match part {
        StartPart::Position => (POSITION.start, 3),
        StartPart::Turn => (ATTITUDE.start, 4),
        StartPart::Velocity => (VELOCITY.start, 3),
        StartPart::Spin => (SPIN.start, 3),
    }
}

fn refused<T>(why: &str) -> Result<T, PlanError> {
    Err(PlanError::Problem(format!("the program cannot pose this problem: {why}")))
}

/// Refuses what the program does not know.
fn check(problem: &Problem) -> Result<(), PlanError> {
    let (scene, world) = (problem.scene(), &problem.scene().world);
    if !world.joints().is_empty() {
        return refused("its scene has joints");
    }
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
    for control in problem.controls() {
        match control.kind {
            ControlKind::Motor { .. } => return refused("it has a motor"),
            ControlKind::Constant(_) => return refused("it looks for a constant of the world"),
            _ => {}
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::file::ProblemFile;
    use crate::scenario::scene::Scene;
    use crate::scenario::settings::Settings;
    use std::path::Path;

    /// The pattern is that of every point, not only of the one that it was made at: zero, where products vanish, and any
    /// other.
    #[test]
    fn the_sequence_of_entries_is_that_of_the_pattern() {
        let scene = r#"
            [ground]
            friction = 0.5
            [[bodies]]
            name = "box"
            box = [0.4, 0.3, 0.2]
            mass = 1.5
            position = [0.0, 0.0, 0.1]
            [[bodies]]
            name = "ball"
            sphere = 0.1
            mass = 0.7
            position = [0.02, 0.01, 0.3]
        "#;
        let problem = r#"
            scene = "-"
            steps = 3
            [[controls]]
            kind = "push"
            body = "box"
            face = "-x"
            normal = [0.0, 3.0]
            tangential = [-0.7, 0.7]
            offset = [-0.1, 0.1]
            friction = 0.4
            [[controls]]
            kind = "torque"
            body = "ball"
            x = [-1.0, 1.0]
            [[controls]]
            kind = "start"
            body = "ball"
            of = "turn"
            x = [-1.0, 1.0]
            [target]
            body = "ball"
            attitude = [0.8, 0.1, -0.5, 0.2]
            [[keep]]
            body = "box"
            away = { point = [1.0, 0.2, 0.1], radius = 0.8 }
        "#;
        let none = &|_: &Path, _: u64| Err(std::io::ErrorKind::NotFound.into());
        let scene = Scene::of_text(scene, Path::new("-"), Settings::default(), none);
        let scene = scene.unwrap_or_else(|why| panic!("{why:?}"));
        let problem = ProblemFile::of_scene_text(scene, problem).unwrap().problem;
        let replay = problem.replay(&problem.zero()).unwrap();
        let smoothing = Smoothing { delta: 1e-2, compliance: 1e-3 };
        for nlp in [
            PlanNlp::smoothed(&problem, &replay, smoothing),
            PlanNlp::with_modes(&problem, &replay, 1e-6),
        ] {
            let nlp = nlp.unwrap();
            let any = (0..nlp.variables).map(|i| f64::from(i as u32 * 37 % 19) / 7.0 - 1.2);
            for x in [vec![0.0; nlp.variables], nlp.point_of(&replay), any.collect()] {
                let (read, y) = (nlp.read(&x), vec![0.7; nlp.rows]);
                assert!(nlp.jacobian.is_of(|sink| nlp.emit_jacobian(&read, sink)));
                assert!(nlp.hessian.is_of(|sink| nlp.emit_hessian(&read, 1.0, &y, sink)));
            }
        }
    }
}
