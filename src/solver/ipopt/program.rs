//! One solve of a step's program by Ipopt, from contacts and a start to a result.

use super::BODY;
use super::clamping::{Clamping, bounds};
use super::memory::Multipliers;
use super::posed::{PosedContacts, gap};
use super::rows::{BoundProgram, BoundRows};
use super::units::ProgramUnits;
use crate::ipopt::{self, Options, RawSolver, ReturnStatus};
use crate::step_nlp::{DissipationFactor, ProgramPoint, SMOOTHING, StepNlp};
use tumble_core::contact::{Candidates, Contact};
use tumble_core::error::Error;
use tumble_core::mechanics::State;
use tumble_core::step::Step;
use tumble_core::world::World;

/// Ipopt solver for the programs of one world.
pub(super) struct IpoptProgram {
    /// Program in `units`.
    nlp: StepNlp,
    pub(super) units: ProgramUnits,
    clamping: Clamping,
    options: Options,
    /// Solver of the last structure and its rows, reused until the rows change.
    prepared: Option<(Vec<usize>, RawSolver)>,
    zeros: Vec<f64>,
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
    /// Compliance of friction about the start's forces, as a fraction of the body's own response
    /// h/m. It is 0 for the contact law itself.
    pub(super) compliance: f64,
}

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
        clamping: Clamping,
        factor: DissipationFactor,
        options: Options,
    ) -> Result<Self, Error> {
        options.validate()?;
        let units = match clamping {
            Clamping::Tutorial => ProgramUnits::SI,
            Clamping::Posed => ProgramUnits::new(world, None),
        };
        let nlp = StepNlp::with_factor(units.world(world), SMOOTHING, factor)?;
        Ok(Self { nlp, units, clamping, options, prepared: None, zeros: Vec::new() })
    }

    pub(super) fn clamping(&self) -> Clamping {
        self.clamping
    }

    pub(super) fn factor(&self) -> DissipationFactor {
        self.nlp.factor()
    }

    pub(super) fn options(&self) -> &Options {
        &self.options
    }

    /// World in the program's units.
    pub(super) fn world(&self) -> &World {
        self.nlp.world()
    }

    /// True if the program is used exactly as in the tutorial.
    pub(super) fn is_tutorials(&self) -> bool {
        self.clamping == Clamping::Tutorial
    }

    /// Contacts of the program in `step`. A contact counts as closed if free flight leaves a gap of
    /// at most `near` (m).
    pub(super) fn closed(
        &self,
        step: &Step<'_>,
        candidates: &[Contact],
        near: f64,
    ) -> PosedContacts {
        let (free, all) = (&step.free[BODY], self.is_tutorials());
        PosedContacts::new(candidates, |_, contact| all || gap(contact, free) <= near)
    }

    /// Number of contact points.
    pub(super) fn points(&self) -> usize {
        self.nlp.layout().contacts()
    }

    /// Updates the units for `step`. Returns true if they changed.
    pub(super) fn set_units(&mut self, step: &Step<'_>) -> Result<bool, Error> {
        if self.is_tutorials() {
            return Ok(false);
        }
        let units = ProgramUnits::new(step.world, Some(&step.wrenches[BODY]));
        if units == self.units {
            return Ok(false);
        }
        self.take_units(step.world, units)?;
        Ok(true)
    }

    /// Sets the units in which steps of `world` are posed.
    pub(super) fn take_units(&mut self, world: &World, units: ProgramUnits) -> Result<(), Error> {
        self.nlp = StepNlp::with_factor(units.world(world), SMOOTHING, self.factor())?;
        self.units = units;
        self.prepared = None;
        Ok(())
    }

    /// Iteration limit of one solve.
    pub(super) fn max_iterations(&self) -> u32 {
        self.options.max_iterations
    }

    /// State X⁺ of the point `x` in SI units. An iterate satisfies |q⁺| = 1 only to its tolerance,
    /// so the attitude is normalised, as the tutorial does not. An attitude far from unit length is
    /// replaced by the one of free flight.
    pub(super) fn next_state(&self, step: &Step<'_>, x: &ProgramPoint) -> State {
        let mut state = self.units.si_state(&x.state());
        if !self.is_tutorials() {
            let norm = state.attitude.norm();
            let is_near = (0.5..2.0).contains(&norm);
            state.attitude = if is_near { state.attitude / norm } else { step.free[BODY].attitude };
        }
        state
    }

    /// Solves `step` with the `posed` part of `candidates` from `start`, and writes the result to
    /// `end`. The result is free flight if Ipopt reports no iterate.
    pub(super) fn attempt(
        &mut self,
        step: &Step<'_>,
        candidates: &[Contact],
        posed: &PosedContacts,
        start: &ProgramPoint,
        effort: IpoptEffort<'_>,
        end: &mut ProgramPoint,
    ) -> Result<Attempted, Error> {
        let Self { nlp, units, clamping, options, prepared, zeros } = self;
        let layout = nlp.layout();
        let mut active = vec![0.0; layout.contacts()];
        for &index in posed.indices() {
            active[candidates[index].key.point] = 1.0;
        }
        let mut bounds = bounds(*clamping, layout, nlp.world().friction(), &active);
        nlp.set_step(&units.state(&step.states[BODY]), &units.wrench(&step.wrenches[BODY]), active);
        nlp.anchor(effort.compliance, (0..layout.contacts()).map(|i| start.force(i)));

        // Only rows with bounds go to Ipopt. Its start is cold, or has multipliers of the same rows.
        let bound = BoundRows::take(nlp, &mut bounds);
        let x = start.as_slice();
        let variables = layout.variables();
        let rows = bound.rows().len();
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
        // The solver is kept while the rows are the same, with its structure.
        let known_rows = bound.rows().to_vec();
        let mut program = BoundProgram { nlp, rows: bound, interrupt: step.interrupt };
        let (_, solver) = match prepared {
            Some(known) if known.0 == known_rows => known,
            other => other.insert((known_rows, RawSolver::new(&program, options.clone())?)),
        };
        solver.set_limits(effort.limit, options.tolerance * effort.tightness)?;
        let outcome = solver.solve(&mut program, &bounds, &start)?;
        // Without a point, the end is free flight.
        match outcome.point {
            Some(found) => end.as_mut_slice().copy_from_slice(found.x),
            None => end.set_free(&units.state(&step.free[BODY])),
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
            multipliers: found.map(|point| Multipliers::new(posed.keys(candidates), point)),
        })
    }
}

/// Solves `step` with the contacts `posed` from `start`, and repeats with contacts that were
/// missing. All solves share the limit in `effort`. On return `posed` holds the contacts of the
/// last solve.
pub(super) fn solve_posed(
    program: &mut IpoptProgram,
    step: &Step<'_>,
    start: &ProgramPoint,
    effort: IpoptEffort<'_>,
    candidates: &mut Candidates,
    posed: &mut PosedContacts,
    end: &mut ProgramPoint,
) -> Result<Attempted, Error> {
    let IpoptEffort { limit, depth, .. } = effort;
    // The tutorial's program has height rows of all points, so it is never skipped.
    let mut attempted = if posed.indices().is_empty() && !program.is_tutorials() {
        end.set_free(&program.units.state(&step.free[BODY]));
        Attempted::free()
    } else {
        program.attempt(step, candidates.contacts(), posed, start, effort, end)?
    };
    while !program.is_tutorials() && attempted.converged && attempted.iterations < limit {
        let next = program.next_state(step, end);
        candidates.admit_missed(step.world, step.states, &[next], depth);
        let contacts = candidates.contacts();
        let wider = PosedContacts::new(contacts, |index, contact| {
            posed.has(index) || gap(contact, &next) < -depth
        });
        if wider == *posed {
            break;
        }
        *posed = wider;
        let multipliers = StartMultipliers::Estimated;
        let effort = IpoptEffort { multipliers, limit: limit - attempted.iterations, ..effort };
        let before = attempted.iterations;
        attempted = program.attempt(step, contacts, posed, start, effort, end)?;
        attempted.iterations += before;
    }
    Ok(attempted)
}
