//! A single step: free flight, or contact detection, solver and certificate.

use super::unphysical::{self, UnphysicalCause};
use super::{Past, StepScratch, infeasible_gap};
use crate::contact::certificate::{Claim, certify_rk4_step};
use crate::contact::{Certificate, Detection, rounding};
use crate::error::Error;
use crate::mechanics::State;
use crate::mechanics::dynamics::rk4_step;
use crate::step::{Step, StepReport, StepSolution, StepSolver, StepStatus};
use crate::world::World;
use std::sync::atomic::AtomicBool;

/// Advances each body separately by the Runge–Kutta method.
pub(super) fn floating_step(
    world: &World,
    states: &[State],
    scratch: &mut StepScratch,
) -> (StepReport, Certificate) {
    let StepScratch { wrenches, candidates, solution, .. } = scratch;
    candidates.clear();
    solution.set_free(&[]);
    let bodies = world.bodies().iter().zip(states).zip(&*wrenches);
    solution.states.extend(bodies.enumerate().map(|(index, ((body, state), wrench))| {
        if world.is_held(index) {
            return *state;
        }
        let mut total = *wrench;
        total.force += world.gravity() * body.mass();
        rk4_step(body, state, &total, world.time_step())
    }));
    let contacts = candidates.contacts();
    let claim =
        Claim { states, next: &solution.states, wrenches, contacts, joints: &[], gears: &[] };
    (StepReport::without_problem(StepStatus::Free), certify_rk4_step(world, &claim))
}

/// Advances by free flight, detection, solver and certificate, and returns the report, the
/// certificate and the share of restitution. The solution is left in the scratch memory.
pub(super) fn contact_step(
    world: &World,
    past: Past<'_>,
    detection: Detection,
    solver: &mut dyn StepSolver,
    interrupt: Option<&AtomicBool>,
    scratch: &mut StepScratch,
) -> Result<(StepReport, Certificate, f64), Error> {
    let StepScratch {
        wrenches,
        free,
        candidates,
        bounce,
        solution,
        certifier,
        energy_check,
        infeasible_gap,
        unphysical,
        gain,
        makes_energy,
        rest,
        ..
    } = scratch;
    let Past { instants, now: previous, before: earlier } = past;
    let states = &previous.states;
    free.clear();
    let flights = states.iter().zip(&*wrenches).enumerate();
    free.extend(flights.map(|(i, (state, wrench))| world.free_flight(i, state, wrench)));

    let step = Step { world, states, wrenches, free, previous, earlier, interrupt };
    // Other solvers' laws have no offset.
    match instants {
        Some(instants) if solver.islands().is_some() => candidates.set_instants(instants, free),
        _ => candidates.set_instants(&[], &[]),
    }
    let needs_contact = candidates.find(detection, world, states, free);
    rest.found(candidates.contacts().len());
    let (mut report, share, accepted) = if needs_contact {
        rest.tell(solver);
        let (report, share) = bounce.solve(&step, solver, candidates, solution)?;
        let islands = solver.islands();
        rest.keep(|body| islands.as_ref().is_some_and(|islands| islands.rested(body)));
        // The solver's slips are those of the law.
        let solved = solution.contacts.iter_mut().zip(candidates.contacts());
        solved.for_each(|(force, contact)| force.slip -= contact.slip_offset);
        (report, share, solver.accepted_residual())
    } else {
        rest.keep(|_| false);
        solution.set_free(free);
        // Exact, unless an implicit gyroscopic equation has no solution in reach.
        (StepReport::without_problem(StepStatus::Free), 1.0, 0.0)
    };
    let missed = candidates.missed_pair(world, states, &solution.states);
    let contacts = candidates.contacts();
    let (joints, gears) = (&solution.joints, &solution.gears);
    let claim = Claim { states, next: &solution.states, wrenches, contacts, joints, gears };
    // Without moments the loop over the contacts is shorter.
    let certificate = if world.has_turning_friction() {
        certifier.step_beside(world, &claim, solution.loads(), rest.bodies())
    } else {
        certifier.step_beside(world, &claim, solution.forces(), rest.bodies())
    };
    // The certificate overrides the solver's status. A NaN fails every comparison.
    let residual = certificate.residual();
    let rounding = || rounding::residual(world, states, &solution.states);
    let within = residual <= accepted || residual <= rounding();
    let solved = !matches!(report.status, StepStatus::Free | StepStatus::Failed);
    if !within {
        report.status = StepStatus::Failed;
    } else if solved {
        *unphysical = energy_check.cause(
            world,
            &claim,
            certifier.joint_motions(),
            solution.forces(),
            accepted,
        );
        *gain = energy_check.largest_gain();
        *makes_energy = gain.is_some() && (0..states.len()).any(|body| energy_check.makes(body));
    }
    if report.status == StepStatus::Failed {
        let least = world.time_step() * accepted.max(rounding());
        *infeasible_gap = infeasible_gap::find(world, states, contacts, least);
    }
    // A step that skipped a contact has an invalid trajectory.
    if report.status != StepStatus::Failed {
        *unphysical = unphysical
            .or(missed.map(|between| UnphysicalCause::Missed { between }))
            .or_else(|| {
                let body = unphysical::lost_body(world, states, &solution.states)?;
                Some(UnphysicalCause::turn(world, body, &solution.states[body]))
            });
        if unphysical.is_some() {
            report.status = StepStatus::Wild;
        }
    }
    Ok((report, certificate, share))
}

/// Checks the sizes of a solution before it is indexed.
#[inline]
pub(super) fn check_sizes(
    solution: &StepSolution,
    step: &Step<'_>,
    contacts: usize,
) -> Result<(), Error> {
    let StepSolution { states, contacts: forces, joints, gears, .. } = solution;
    let found = [states.len(), forces.len(), joints.len(), gears.len()];
    let (world, bodies) = (step.world, step.states.len());
    let wanted = [bodies, contacts, world.joints().len(), world.gears().len()];
    if found == wanted { Ok(()) } else { Err(size_error(found, wanted)) }
}

#[cold]
#[inline(never)]
fn size_error(found: [usize; 4], wanted: [usize; 4]) -> Error {
    let [states, contacts, joints, gears] = found;
    let [bodies, candidates, tied, geared] = wanted;
    let why = format!(
        "its solution has {states} states, {contacts} contact forces and the forces of {joints} \
         joints and {gears} gears; expected {bodies}, {candidates}, {tied} and {geared}"
    );
    Error::Solver { solver: "the step's solver", why }
}
