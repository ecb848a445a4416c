//! One solve of the program of several bodies by Ipopt: contacts, start and limit in, a point out.

use super::super::memory::Multipliers;
use super::super::program::{Attempted, StartMultipliers};
use super::super::units::Units;
use super::start::{Start, Values};
use crate::contact::Contact;
use crate::error::Error;
use crate::ipopt::{self, Bounds, NonlinearProgram, Options, Progress, ReturnStatus, Solver};
use crate::mechanics::State;
use crate::sparsity::SparsityPattern;
use crate::step::Step;
use crate::step_nlp::SMOOTHING;
use crate::step_nlp::several::{Layout, PosedStep, SeveralNlp};
use crate::world::World;
use nalgebra::{SVector, Vector3};
use std::sync::atomic::{AtomicBool, Ordering};

/// Ipopt for the programs of one world.
pub(super) struct Program {
    /// The world in `units`.
    world: World,
    pub(super) units: Units,
    options: Options,
    /// The solver of the last structure, kept for as long as that does not change.
    prepared: Option<Prepared>,
    scratch: Scratch,
}

/// A solver and the structure that it is for.
struct Prepared {
    jacobian: SparsityPattern,
    hessian: SparsityPattern,
    solver: Solver,
}

/// Memory of a solve.
#[derive(Default)]
struct Scratch {
    states: Vec<State>,
    wrenches: Vec<crate::mechanics::Wrench>,
    contacts: Vec<Contact>,
    x: Vec<f64>,
    zeros: Vec<f64>,
}

/// How much friction yields to what differs from the forces of the start, as a part of both bodies'
/// own answer h/m, and what a normal force costs that differs from that of the start, in squares of
/// the program's unit of length: where the forces of the start have settled, and where not. Without a
/// cost a stack of five at rest takes 59 iterations a step, with 10⁻⁶ 33, with 10⁻³ 4, with 10⁻² and
/// more 2 (docs/ipopt-path.md); an impact is far from what was before it.
const SETTLED: (f64, f64) = (0.1, 0.1);
const UNSETTLED: (f64, f64) = (0.1, 0.0);

/// How exact a solve is, and how long it may take.
#[derive(Clone, Copy)]
pub(super) struct Effort {
    /// Iterations.
    pub(super) limit: u32,
    /// Ipopt's tolerance, as a part of that of the options.
    pub(super) tightness: f64,
    /// Whether the forces of the start have settled, so that Ipopt is to stay near them.
    pub(super) settled: bool,
}

/// The bodies and contacts that take part, indices of the world and of the candidates.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Posed {
    pub(super) bodies: Vec<usize>,
    pub(super) contacts: Vec<usize>,
}

impl Program {
    pub(super) fn new(world: &World, options: Options) -> Result<Self, Error> {
        options.validate()?;
        let units = Units::of_all(world, &[]);
        let scratch = Scratch::default();
        Ok(Self { world: units.world(world), units, options, prepared: None, scratch })
    }

    /// The number of bodies.
    pub(super) fn bodies(&self) -> usize {
        self.world.bodies().len()
    }

    /// Takes the units that `step` asks for; says whether they are others than before.
    pub(super) fn set_units(&mut self, step: &Step<'_>) -> bool {
        let units = Units::of_all(step.world, step.wrenches);
        if units == self.units {
            return false;
        }
        self.world = units.world(step.world);
        self.units = units;
        true
    }

    /// The most iterations of one solve.
    pub(super) fn max_iterations(&self) -> u32 {
        self.options.max_iterations
    }

    /// Solves `step` with what is `posed` of `candidates` from `start`, and writes the end to
    /// `end`; free flight where Ipopt has no iterate to report.
    pub(super) fn attempt(
        &mut self,
        step: &Step<'_>,
        (candidates, posed): (&[Contact], &Posed),
        (start, multipliers): (&Start, StartMultipliers<'_>),
        effort: Effort,
        end: &mut Start,
    ) -> Result<Attempted, Error> {
        let (units, scratch) = (self.units, &mut self.scratch);
        scratch.states.clear();
        scratch.states.extend(step.states.iter().map(|state| units.state(state)));
        scratch.wrenches.clear();
        scratch.wrenches.extend(step.wrenches.iter().map(|wrench| units.wrench(wrench)));
        scratch.contacts.clear();
        let contacts = posed.contacts.iter().map(|&index| units.contact(&candidates[index]));
        scratch.contacts.extend(contacts);
        let posed_step = PosedStep {
            world: &self.world,
            states: &scratch.states,
            wrenches: &scratch.wrenches,
            bodies: &posed.bodies,
            contacts: &scratch.contacts,
        };
        let mut nlp = SeveralNlp::new(&posed_step, SMOOTHING)?;
        let anchors = posed.contacts.iter().map(|&index| start.values[index].force);
        nlp.anchor(if effort.settled { SETTLED } else { UNSETTLED }, anchors);
        let layout = nlp.layout().clone();
        let x = &mut scratch.x;
        gather(&layout, (posed, start), &units, x);
        scratch.zeros.clear();
        scratch.zeros.resize(x.len(), 0.0);
        let zeros = &scratch.zeros;
        let start = match multipliers {
            StartMultipliers::Estimated => ipopt::Start::Cold { x },
            StartMultipliers::Zero => ipopt::Start::Warm {
                x,
                constraint_multipliers: zeros,
                lower_multipliers: zeros,
                upper_multipliers: zeros,
            },
            StartMultipliers::Known(known) => ipopt::Start::Warm {
                x,
                constraint_multipliers: &known.constraints,
                lower_multipliers: &known.lower,
                upper_multipliers: &known.upper,
            },
        };
        let mut program = Bound { nlp: &nlp, interrupt: step.interrupt };
        let prepared = match &mut self.prepared {
            Some(known)
                if known.jacobian == *nlp.jacobian_pattern()
                    && known.hessian == *nlp.hessian_pattern() =>
            {
                known
            }
            other => other.insert(Prepared {
                jacobian: nlp.jacobian_pattern().clone(),
                hessian: nlp.hessian_pattern().clone(),
                solver: Solver::new(&program, self.options.clone())?,
            }),
        };
        let solver = &mut prepared.solver;
        solver.set_limits(effort.limit, self.options.tolerance * effort.tightness)?;
        let outcome = solver.solve(&mut program, &bounds(&layout), &start)?;
        end.reset(step.free, candidates.len());
        if let Some(found) = outcome.point {
            scatter(&layout, (posed, found.x), &units, end);
            normalise(step.free, end);
        }
        if outcome.status == ReturnStatus::UserRequestedStop {
            return Err(Error::Interrupted);
        }
        let converged = outcome.status.is_success() && outcome.point.is_some();
        Ok(Attempted {
            converged,
            iterations: outcome.iterations,
            status: outcome.status,
            multipliers: outcome.point.filter(|_| converged).map(|p| Multipliers::of(&[], p)),
        })
    }
}

/// X⁺ and the values of the contacts at `start` as a point of the program.
fn gather(layout: &Layout, (posed, start): (&Posed, &Start), units: &Units, x: &mut Vec<f64>) {
    x.clear();
    x.resize(layout.variables(), 0.0);
    for (place, &body) in posed.bodies.iter().enumerate() {
        let state = units.state(&start.states[body]).to_vector();
        x[layout.state(place)].copy_from_slice(state.as_slice());
    }
    for (i, &index) in posed.contacts.iter().enumerate() {
        let (values, of) = (&start.values[index], layout.normal(i));
        (x[of.first], x[of.second]) = (values.force[2], values.normal_slack);
        if let Some(of) = layout.friction(i) {
            (x[of.force[0]], x[of.force[1]]) = (values.force[0], values.force[1]);
            (x[of.slack], x[of.slip_speed]) = (values.friction_slack, values.slip_speed);
        }
    }
}

/// The other way round; what takes no part stays as it is.
fn scatter(layout: &Layout, (posed, x): (&Posed, &[f64]), units: &Units, end: &mut Start) {
    for (place, &body) in posed.bodies.iter().enumerate() {
        let state = State::from_vector(&SVector::from_column_slice(&x[layout.state(place)]));
        end.states[body] = units.si_state(&state);
    }
    for (i, &index) in posed.contacts.iter().enumerate() {
        let of = layout.normal(i);
        let mut values = Values {
            force: Vector3::new(0.0, 0.0, x[of.first]),
            normal_slack: x[of.second],
            ..Values::default()
        };
        if let Some(of) = layout.friction(i) {
            (values.force[0], values.force[1]) = (x[of.force[0]], x[of.force[1]]);
            (values.friction_slack, values.slip_speed) = (x[of.slack], x[of.slip_speed]);
        }
        end.values[index] = values;
    }
}

/// Makes attitudes turns, which those of an iterate are to its tolerance only, and those of one that is
/// no solution not at all: then they are those of `free`.
fn normalise(free: &[State], end: &mut Start) {
    for (state, free) in end.states.iter_mut().zip(free) {
        let norm = state.attitude.norm();
        let is_near = (0.5..2.0).contains(&norm);
        state.attitude = if is_near { state.attitude / norm } else { free.attitude };
    }
}

/// States and friction forces free, the other variables ≥ 0, equations = 0, inequalities ≥ 0.
fn bounds(layout: &Layout) -> Bounds {
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

/// The program as Ipopt's wrapper takes it.
struct Bound<'a> {
    nlp: &'a SeveralNlp,
    interrupt: Option<&'a AtomicBool>,
}

impl NonlinearProgram for Bound<'_> {
    fn keep_going(&mut self, _progress: &Progress) -> bool {
        !self.interrupt.is_some_and(|flag| flag.load(Ordering::Relaxed))
    }

    fn variable_count(&self) -> usize {
        self.nlp.layout().variables()
    }

    fn constraint_count(&self) -> usize {
        self.nlp.layout().constraints()
    }

    fn jacobian_pattern(&self) -> &SparsityPattern {
        self.nlp.jacobian_pattern()
    }

    fn hessian_pattern(&self) -> &SparsityPattern {
        self.nlp.hessian_pattern()
    }

    fn objective(&mut self, x: &[f64]) -> f64 {
        self.nlp.objective(x)
    }

    fn gradient(&mut self, x: &[f64], gradient: &mut [f64]) {
        self.nlp.gradient(x, gradient);
    }

    fn constraints(&mut self, x: &[f64], constraints: &mut [f64]) {
        self.nlp.constraints(x, constraints);
    }

    fn jacobian(&mut self, x: &[f64], values: &mut [f64]) {
        self.nlp.jacobian(x, values);
    }

    fn hessian(
        &mut self,
        x: &[f64],
        objective_factor: f64,
        multipliers: &[f64],
        values: &mut [f64],
    ) {
        self.nlp.hessian(x, objective_factor, multipliers, values);
    }
}
