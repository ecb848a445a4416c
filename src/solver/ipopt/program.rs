//! One solve of a step's program by Ipopt, from contacts and a start to a result.

use super::memory::Multipliers;
use super::posed::PosedProgram;
use super::start::{ContactValues, ProgramStart};
use super::units::ProgramUnits;
use super::{BODY, Formulation, clamped};
use crate::ipopt::{
    self, Bounds, IpoptProgress, NonlinearProgram, Options, RawSolver, ReturnStatus,
};
use crate::sparsity::SparsityPattern;
use crate::step_nlp::several::{ContactVariables, PosedStep, SeveralLayout, SeveralNlp};
use crate::step_nlp::{SMOOTHING, StepNlp};
use nalgebra::{SVector, Vector3};
use std::sync::atomic::{AtomicBool, Ordering};
use tumble_core::contact::Contact;
use tumble_core::error::Error;
use tumble_core::mechanics::{State, Wrench};
use tumble_core::step::Step;
use tumble_core::world::World;

/// Ipopt solver for the programs of one world.
pub(super) struct IpoptProgram {
    /// World in `units`.
    world: World,
    pub(super) units: ProgramUnits,
    /// The tutorial's program, for [`Formulation::Clamped`].
    tutorial: Option<StepNlp>,
    options: Options,
    /// Solver of the last sparsity structure, reused until the structure changes.
    prepared: Option<Prepared>,
    scratch: ProgramScratch,
}

/// A solver with its sparsity structure.
struct Prepared {
    jacobian: SparsityPattern,
    hessian: SparsityPattern,
    solver: RawSolver,
}

/// Scratch memory of a solve.
#[derive(Default)]
struct ProgramScratch {
    states: Vec<State>,
    wrenches: Vec<Wrench>,
    contacts: Vec<Contact>,
    places: Vec<ContactVariables>,
    x: Vec<f64>,
    zeros: Vec<f64>,
}

/// Strength of the regularisation towards the forces of the start.
#[derive(Clone, Copy)]
pub(super) struct Hold {
    /// Compliance of friction against deviations, as a fraction of both bodies' own response h/m.
    pub(super) friction: f64,
    /// Cost of a normal force's deviation, in squares of the program's unit of length.
    pub(super) normal: f64,
}

impl Hold {
    /// No regularisation: the contact laws themselves.
    pub(super) const NOT: Self = Self { friction: 0.0, normal: 0.0 };
}

/// Multipliers, accuracy and iteration limit of a solve.
#[derive(Clone, Copy)]
pub(super) struct IpoptEffort<'a> {
    pub(super) multipliers: StartMultipliers<'a>,
    /// Largest number of iterations.
    pub(super) limit: u32,
    /// Penetration up to which a contact may be missing from the program, m.
    pub(super) depth: f64,
    /// Factor of the tolerance of the options.
    pub(super) tightness: f64,
    /// Regularisation; the tutorial's program ignores it.
    pub(super) hold: Hold,
}

/// Multipliers of a start.
#[derive(Clone, Copy)]
pub(super) enum StartMultipliers<'a> {
    /// Ipopt's estimate. Ipopt first moves the point away from its bounds.
    Estimated,
    /// Zero multipliers. They are correct at a solution with zero slacks, where the objective's
    /// gradient is zero.
    Zero,
    /// Multipliers of an earlier solve.
    Known(&'a Multipliers),
}

/// Result of a solve.
pub(super) struct Attempted {
    pub(super) converged: bool,
    pub(super) iterations: u32,
    pub(super) status: ReturnStatus,
    /// Multipliers of a converged solve.
    pub(super) multipliers: Option<Multipliers>,
}

impl Attempted {
    /// Result of free flight: without contacts it is exact, and Ipopt is not needed.
    pub(super) fn free() -> Self {
        let status = ReturnStatus::SolveSucceeded;
        Self { converged: true, iterations: 0, status, multipliers: None }
    }
}

impl IpoptProgram {
    pub(super) fn new(
        world: &World,
        formulation: Formulation,
        options: Options,
    ) -> Result<Self, Error> {
        options.validate()?;
        let (units, tutorial) = match formulation {
            Formulation::Clamped => {
                (ProgramUnits::SI, Some(StepNlp::new(world.clone(), SMOOTHING)?))
            }
            Formulation::Reduced => (ProgramUnits::of(world, &[]), None),
        };
        let (world, scratch) = (units.world(world), ProgramScratch::default());
        Ok(Self { world, units, tutorial, options, prepared: None, scratch })
    }

    /// Formulation of the program.
    pub(super) fn formulation(&self) -> Formulation {
        if self.is_tutorials() { Formulation::Clamped } else { Formulation::Reduced }
    }

    pub(super) fn options(&self) -> &Options {
        &self.options
    }

    /// World in the program's units.
    pub(super) fn world(&self) -> &World {
        &self.world
    }

    /// True for the tutorial's program.
    pub(super) fn is_tutorials(&self) -> bool {
        self.tutorial.is_some()
    }

    /// Updates the units for `step`. Returns true if they changed.
    pub(super) fn set_units(&mut self, step: &Step<'_>) -> bool {
        if self.is_tutorials() {
            return false;
        }
        let units = ProgramUnits::of(step.world, step.wrenches);
        if units == self.units {
            return false;
        }
        self.take_units(step.world, units);
        true
    }

    /// Sets the units in which steps of `world` are posed.
    pub(super) fn take_units(&mut self, world: &World, units: ProgramUnits) {
        self.world = units.world(world);
        self.units = units;
    }

    /// Iteration limit of one solve.
    pub(super) fn max_iterations(&self) -> u32 {
        self.options.max_iterations
    }

    /// Solves `step` with the `posed` part of `candidates` from `start`, and writes the result to
    /// `end`. The result is free flight if Ipopt reports no iterate.
    pub(super) fn attempt(
        &mut self,
        step: &Step<'_>,
        candidates: &[Contact],
        posed: &PosedProgram,
        start: &ProgramStart,
        effort: IpoptEffort<'_>,
        end: &mut ProgramStart,
    ) -> Result<Attempted, Error> {
        let Self { world, units, tutorial, options, prepared, scratch } = self;
        scratch.take(step, candidates, posed, units);
        let ProgramScratch { states, wrenches, contacts, places, x, zeros } = scratch;
        places.clear();
        let (nlp, bounds, bodies) = match tutorial {
            Some(nlp) => {
                let mut active = vec![0.0; nlp.layout().contacts()];
                for contact in contacts.iter() {
                    active[contact.key.point] = 1.0;
                }
                let bounds = clamped::bounds(nlp.layout(), &active);
                nlp.set_step(&states[BODY], &wrenches[BODY], active);
                places.extend(contacts.iter().map(|contact| clamped::place(nlp.layout(), contact)));
                (Nlp::Clamped(nlp), bounds, &[BODY][..])
            }
            None => {
                let bodies = posed.bodies.as_slice();
                let posed_step = PosedStep { world, states, wrenches, bodies, contacts };
                let mut nlp = SeveralNlp::new(&posed_step, SMOOTHING)?;
                let forces = posed.contacts.iter().map(|&index| start.values[index].force);
                nlp.anchor(effort.hold.friction, effort.hold.normal, forces);
                let layout = nlp.layout();
                places.extend((0..layout.contacts()).map(|i| layout.contact(i)));
                let bounds = bounds(&nlp);
                (Nlp::Reduced(Box::new(nlp)), bounds, bodies)
            }
        };
        let (variables, rows) = (bounds.lower.len(), bounds.constraint_lower.len());
        let part = ProgramPart { bodies, contacts: &posed.contacts, places };
        gather(part, start, units, variables, x);
        zeros.clear();
        zeros.resize(variables.max(rows), 0.0);
        let start = match effort.multipliers {
            StartMultipliers::Estimated => ipopt::StartPoint::Cold { x },
            StartMultipliers::Zero => ipopt::StartPoint::Warm {
                x,
                constraint_multipliers: &zeros[..rows],
                lower_multipliers: &zeros[..variables],
                upper_multipliers: &zeros[..variables],
            },
            StartMultipliers::Known(known) if known.fits(variables, rows) => {
                ipopt::StartPoint::Warm {
                    x,
                    constraint_multipliers: &known.constraints,
                    lower_multipliers: &known.lower,
                    upper_multipliers: &known.upper,
                }
            }
            // The multipliers belong to a program of another size.
            StartMultipliers::Known(_) => ipopt::StartPoint::Cold { x },
        };
        let mut program = Bound { nlp, interrupt: step.interrupt };
        let (jacobian, hessian) = (program.jacobian_pattern(), program.hessian_pattern());
        let prepared = match prepared {
            Some(known) if known.jacobian == *jacobian && known.hessian == *hessian => known,
            other => other.insert(Prepared {
                jacobian: jacobian.clone(),
                hessian: hessian.clone(),
                solver: RawSolver::new(&program, options.clone())?,
            }),
        };
        let solver = &mut prepared.solver;
        solver.set_limits(effort.limit, options.tolerance * effort.tightness)?;
        let outcome = solver.solve(&mut program, &bounds, &start)?;
        end.reset(step.free, candidates.len());
        if let Some(found) = outcome.point {
            scatter(part, found.x, units, end);
            match &program.nlp {
                Nlp::Clamped(_) => end.whole.extend_from_slice(found.x),
                Nlp::Reduced(_) => normalise(step.free, end),
            }
        }
        if outcome.status == ReturnStatus::UserRequestedStop {
            return Err(Error::Interrupted);
        }
        let converged = outcome.status.is_success() && outcome.point.is_some();
        let found = outcome.point.filter(|_| converged);
        Ok(Attempted {
            converged,
            iterations: outcome.iterations,
            status: outcome.status,
            multipliers: found.map(|point| Multipliers::of(posed.keys(candidates), point)),
        })
    }
}

impl ProgramScratch {
    /// Converts the step and the `posed` part of `candidates` to `units`.
    fn take(
        &mut self,
        step: &Step<'_>,
        candidates: &[Contact],
        posed: &PosedProgram,
        units: &ProgramUnits,
    ) {
        self.states.clear();
        self.states.extend(step.states.iter().map(|state| units.state(state)));
        self.wrenches.clear();
        self.wrenches.extend(step.wrenches.iter().map(|wrench| units.wrench(wrench)));
        self.contacts.clear();
        let contacts = posed.contacts.iter().map(|&index| units.contact(&candidates[index]));
        self.contacts.extend(contacts);
    }
}

/// Indices of the bodies and candidates in the program, and of the contacts' variables.
#[derive(Clone, Copy)]
struct ProgramPart<'a> {
    bodies: &'a [usize],
    contacts: &'a [usize],
    places: &'a [ContactVariables],
}

/// Variables of the `place`-th body of the program, equal in both programs.
fn state_at(place: usize) -> std::ops::Range<usize> {
    SeveralLayout::new(place + 1, []).state(place)
}

/// Writes X⁺ and the contact values of `start` as a point x of the program. Other variables come
/// from the tutorial's start, or are zero.
fn gather(
    ProgramPart { bodies, contacts, places }: ProgramPart<'_>,
    start: &ProgramStart,
    units: &ProgramUnits,
    variables: usize,
    x: &mut Vec<f64>,
) {
    x.clear();
    x.extend_from_slice(&start.whole);
    x.resize(variables, 0.0);
    for (place, &body) in bodies.iter().enumerate() {
        let state = units.state(&start.states[body]).to_vector();
        x[state_at(place)].copy_from_slice(state.as_slice());
    }
    for (of, &index) in places.iter().zip(contacts) {
        let values = &start.values[index];
        (x[of.normal.first], x[of.normal.second]) = (values.force[2], values.normal_slack);
        if let Some(of) = of.friction {
            (x[of.force[0]], x[of.force[1]]) = (values.force[0], values.force[1]);
            (x[of.slack], x[of.slip_speed]) = (values.friction_slack, values.slip_speed);
        }
    }
}

/// Copies a point x of the program to `end`. Other bodies and candidates stay unchanged.
fn scatter(
    ProgramPart { bodies, contacts, places }: ProgramPart<'_>,
    x: &[f64],
    units: &ProgramUnits,
    end: &mut ProgramStart,
) {
    for (place, &body) in bodies.iter().enumerate() {
        let state = State::from_vector(&SVector::from_column_slice(&x[state_at(place)]));
        end.states[body] = units.si_state(&state);
    }
    for (of, &index) in places.iter().zip(contacts) {
        let mut values = ContactValues {
            force: Vector3::new(0.0, 0.0, x[of.normal.first]),
            normal_slack: x[of.normal.second],
            ..ContactValues::default()
        };
        if let Some(of) = of.friction {
            (values.force[0], values.force[1]) = (x[of.force[0]], x[of.force[1]]);
            (values.friction_slack, values.slip_speed) = (x[of.slack], x[of.slip_speed]);
        }
        end.values[index] = values;
    }
}

/// Normalises attitudes, which an iterate satisfies only to its tolerance. An attitude far from
/// unit length is replaced by the one of `free`.
fn normalise(free: &[State], end: &mut ProgramStart) {
    for (state, free) in end.states.iter_mut().zip(free) {
        let norm = state.attitude.norm();
        let is_near = (0.5..2.0).contains(&norm);
        state.attitude = if is_near { state.attitude / norm } else { free.attitude };
    }
}

/// Bounds: states and friction forces free, other variables ≥ 0, equations = 0, inequalities ≥ 0.
fn bounds(nlp: &SeveralNlp) -> Bounds {
    let layout = nlp.layout();
    let (n, m) = (layout.variables(), layout.constraints());
    let mut bounds = Bounds {
        lower: vec![0.0; n],
        upper: vec![f64::INFINITY; n],
        constraint_lower: vec![0.0; m],
        constraint_upper: vec![f64::INFINITY; m],
    };
    bounds.lower[layout.free()].fill(f64::NEG_INFINITY);
    bounds.constraint_upper[..layout.equalities()].fill(0.0);
    bounds
}

/// Program of a step.
enum Nlp<'a> {
    Clamped(&'a StepNlp),
    Reduced(Box<SeveralNlp>),
}

/// Evaluates one expression on either program.
macro_rules! of {
    ($nlp:expr, $program:ident => $what:expr) => {
        match &$nlp {
            Nlp::Clamped($program) => $what,
            Nlp::Reduced($program) => $what,
        }
    };
}

/// Program in the form of Ipopt's wrapper.
struct Bound<'a> {
    nlp: Nlp<'a>,
    /// Ends the solve when set.
    interrupt: Option<&'a AtomicBool>,
}

impl NonlinearProgram for Bound<'_> {
    fn keep_going(&mut self, _progress: &IpoptProgress) -> bool {
        !self.interrupt.is_some_and(|flag| flag.load(Ordering::Relaxed))
    }

    fn variable_count(&self) -> usize {
        of!(self.nlp, nlp => nlp.layout().variables())
    }

    fn constraint_count(&self) -> usize {
        of!(self.nlp, nlp => nlp.layout().constraints())
    }

    fn jacobian_pattern(&self) -> &SparsityPattern {
        of!(self.nlp, nlp => nlp.jacobian_pattern())
    }

    fn hessian_pattern(&self) -> &SparsityPattern {
        of!(self.nlp, nlp => nlp.hessian_pattern())
    }

    fn objective(&mut self, x: &[f64]) -> f64 {
        of!(self.nlp, nlp => nlp.objective(x))
    }

    fn gradient(&mut self, x: &[f64], gradient: &mut [f64]) {
        of!(self.nlp, nlp => nlp.gradient(x, gradient));
    }

    fn constraints(&mut self, x: &[f64], constraints: &mut [f64]) {
        of!(self.nlp, nlp => nlp.constraints(x, constraints));
    }

    fn jacobian(&mut self, x: &[f64], values: &mut [f64]) {
        of!(self.nlp, nlp => nlp.jacobian(x, values));
    }

    fn hessian(
        &mut self,
        x: &[f64],
        objective_factor: f64,
        multipliers: &[f64],
        values: &mut [f64],
    ) {
        of!(self.nlp, nlp => nlp.hessian(x, objective_factor, multipliers, values));
    }
}
