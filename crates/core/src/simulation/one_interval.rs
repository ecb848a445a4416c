//! One interval of a step: free flight, or contact detection, solver and certificate.

use super::driving::{exchange_drives, held_drives};
use super::inputs::Inputs;
use super::interval::Interval;
use super::leapfrog;
use super::moment::Moment;
use super::unphysical::{self, UnphysicalCause};
use super::workspace::{Workspace, is_regular};
use super::{InfeasibleGap, Motion, infeasible_gap, replacement};
use crate::contact::certificate::{Claim, certify_rk4_step};
use crate::contact::{Candidates, Contact, Partner, rounding};
use crate::error::Error;
use crate::mechanics::State;
use crate::mechanics::dynamics::rk4_step;
use crate::step::{ContactForce, Step, StepReport, StepSolution, StepStatus};
use crate::world::{Span, World};

/// Overlap due to rounding, as a fraction of the world's reach.
const ROUNDED: f64 = 1e-9;

/// Takes one interval from `moment`, which moves to its end: a whole step, or the part of one in `span`.
/// `taken` describes it. The interval is taken even if it is not solved. `is_copy` is true if `taken` already is
/// a copy of the present rest.
///
/// The order is:
///
/// 1. Lengths before it, and wrenches.
/// 2. If all rests, a copy of the interval before. It ends here.
/// 3. Joint frames: what is left of their errors, and prescribed motions.
/// 4. The problem.
/// 5. Velocities of the instant, and the move to the end.
///
/// # Errors
/// If the problem cannot be posed or was interrupted. The moment is then unchanged.
pub(super) fn interval(
    world: &mut World,
    moment: &mut Moment,
    inputs: &Inputs,
    workspace: &mut Workspace<'_>,
    span: Option<Span>,
    taken: &mut Interval,
    is_copy: bool,
) -> Result<(), Error> {
    inputs.check_interrupt()?;
    taken.span = span;
    world.set_span(span);
    world.set_before(moment.arrivals.iter().map(|arrival| arrival.length));
    taken.before.clear();
    taken.before.extend_from_slice(world.before());
    inputs.set_wrenches(world, moment, &mut workspace.wrenches);
    taken.wrenches.clone_from(&workspace.wrenches);
    taken.length = world.time_step();
    taken.is_coarse = false;
    taken.drives.clear();
    taken.part = span.map(|_| Box::default());
    let Workspace { rest, wrenches, .. } = &mut *workspace;
    if rest.is_known() && rest.repeat(moment, wrenches, taken, is_copy) {
        moment.arrive(world.time_step(), inputs);
        return Ok(());
    }
    if !inputs.at_instant {
        taken.drives.extend(held_drives(world, &moment.drives));
    }
    exchange_drives(world, &mut taken.drives);
    let held = world.hold_back(&moment.now.states, &moment.now.joints);
    inputs.drive_joints(world, moment);
    let solved = solve(world, moment, inputs, workspace, taken);
    world.release(held);
    exchange_drives(world, &mut taken.drives);
    solved?;
    finish(world, moment, inputs, workspace, taken);
    Ok(())
}

/// Moves `moment` to the end of `taken`, whose solution is that of the interval.
pub(super) fn finish(
    world: &World,
    moment: &mut Moment,
    inputs: &Inputs,
    workspace: &mut Workspace<'_>,
    taken: &mut Interval,
) {
    moment.is_infeasible = taken.infeasible_gap.is_some();
    leapfrog::end(world, moment, inputs, workspace, taken);
    moment.arrive(world.time_step(), inputs);
    workspace.solution.copy_from(&taken.solution);
    moment.move_on(&mut workspace.solution);
    workspace.rest.note(world, moment, inputs, &workspace.wrenches, taken);
}

/// Solves the problem of an interval and describes it in `taken`. Only the contact search of the moment
/// moves on.
///
/// # Errors
/// If the problem cannot be posed or was interrupted. The moment is then unchanged.
pub(super) fn solve(
    world: &World,
    moment: &mut Moment,
    inputs: &Inputs,
    workspace: &mut Workspace<'_>,
    taken: &mut Interval,
) -> Result<(), Error> {
    taken.states.clear();
    taken.states.extend_from_slice(&moment.now.states);
    taken.instants.clear();
    taken.ends.clear();
    taken.extrapolated.clear();
    if let Some(instants) = &moment.instants {
        taken.instants.extend_from_slice(&instants.states);
    }
    (taken.infeasible_gap, taken.unphysical, taken.gain) = (None, None, None);
    let has_contacts = workspace.has_contacts();
    if has_contacts {
        workspace.begin_rest(moment);
    }
    let sets_aside = workspace.set_aside(world, moment);
    // Without pairs of pieces there is nothing to restore.
    let rewinds = sets_aside || inputs.interrupt.is_some() && !moment.search.is_empty();
    if rewinds {
        workspace.rewind.copy_from(&moment.search);
    }
    workspace.candidates.exchange_memory(world, &mut moment.search);
    let solved = if has_contacts {
        let solve = |workspace: &mut Workspace<'_>, taken: &mut Interval| {
            while !contact_step(world, moment, inputs, workspace, taken)? {
                workspace.candidates.take_all(world, &workspace.rewind);
            }
            measure(world, workspace, taken);
            mark_sunk(world, workspace, taken);
            Ok(())
        };
        let solved = replacement::solve(world, workspace, taken, solve);
        workspace.candidates.replaced().clear();
        solved
    } else {
        floating_step(world, workspace, taken);
        measure(world, workspace, taken);
        Ok(())
    };
    if solved.is_ok() {
        workspace.candidates.hand_over(&mut taken.contacts);
    }
    workspace.candidates.return_memory(&mut moment.search);
    if solved.is_err() {
        workspace.forget();
        if rewinds {
            moment.search.copy_from(&workspace.rewind);
        }
    }
    solved
}

/// Stiffness, overlap and placement of an interval whose contacts are the candidates.
fn measure(world: &World, workspace: &mut Workspace<'_>, taken: &mut Interval) {
    let Workspace { candidates, .. } = workspace;
    let Interval { states, solution, stiffness, overlap, placement, .. } = &mut *taken;
    let StepSolution { states: next, joints, gears, .. } = &*solution;
    *stiffness = workspace.stiffness.largest_in_step(world, states, joints, gears);
    *overlap = candidates.deepest_overlap(world, next).map_or(0.0, |(depth, ..)| depth);
    *placement = candidates.placement_error(world, states, next, solution.forces());
}

/// Marks a solved interval in which pieces sink into each other.
fn mark_sunk(world: &World, workspace: &mut Workspace<'_>, taken: &mut Interval) {
    if taken.overlap > ROUNDED * world.reach() && taken.report.status.is_solved() {
        let next = &taken.solution.states;
        if let Some(between) = workspace.candidates.sunk_pair(world, &taken.states, next) {
            taken.unphysical = Some(UnphysicalCause::Missed { between });
            taken.report.status = StepStatus::Wild;
        }
    }
}

/// Measures `taken` again, after a change of its solution.
pub(super) fn measure_again(
    world: &World,
    moment: &mut Moment,
    workspace: &mut Workspace<'_>,
    taken: &mut Interval,
) {
    workspace.candidates.exchange_memory(world, &mut moment.search);
    workspace.candidates.clear();
    workspace.candidates.extend(taken.contacts.iter().copied());
    measure(world, workspace, taken);
    workspace.candidates.clear();
    workspace.candidates.return_memory(&mut moment.search);
}

/// Advances each body separately by the Runge–Kutta method.
fn floating_step(world: &World, workspace: &mut Workspace<'_>, taken: &mut Interval) {
    let Workspace { wrenches, candidates, .. } = workspace;
    let Interval { states, solution, .. } = &mut *taken;
    candidates.clear();
    solution.set_free(&[]);
    let bodies = world.bodies().iter().zip(&*states).zip(&*wrenches);
    solution.states.extend(bodies.enumerate().map(|(index, ((body, state), wrench))| {
        if world.is_held(index) {
            return *state;
        }
        let mut total = *wrench;
        total.force += world.gravity() * body.mass();
        rk4_step(body, state, &total, world.time_step())
    }));
    let contacts = candidates.contacts();
    let next = &solution.states;
    let claim = Claim { states, next, wrenches, contacts, joints: &[], gears: &[] };
    taken.certificate = certify_rk4_step(world, &claim);
    taken.report = StepReport::without_problem(StepStatus::Free);
    taken.restitution_share = 1.0;
}

/// Advances by free flight, detection, solver and certificate. Returns false if the step must be taken with all
/// contacts: it sets contacts aside, and touches one of their bodies or is not solved as usual.
fn contact_step(
    world: &World,
    moment: &Moment,
    inputs: &Inputs,
    workspace: &mut Workspace<'_>,
    taken: &mut Interval,
) -> Result<bool, Error> {
    let Workspace {
        motion,
        wrenches,
        free,
        candidates,
        bounce,
        certifier,
        energy_check,
        rest,
        solution: spare,
        ..
    } = workspace;
    let Motion::Contact { detection, solver } = motion else { return Ok(true) };
    let (detection, solver) = (*detection, solver.as_mut());
    let Moment { instants, now: previous, before, .. } = moment;
    let states = &previous.states;
    let sets_aside = !candidates.aside().is_empty();
    let flights = states.iter().zip(&*wrenches).enumerate();
    let flight = |(body, (state, wrench))| world.free_flight(body, state, wrench);
    if sets_aside {
        // Bodies at rest have the flight of the step before.
        let flights = flights.zip(free.iter_mut().zip(candidates.aside()));
        let awake = flights.filter(|(_, (_, rests))| !**rests);
        awake.for_each(|(of, (free, _))| *free = flight(of));
    } else {
        free.clear();
        free.extend(flights.map(flight));
    }

    let (earlier, interrupt) = (before.as_deref(), inputs.interrupt.as_deref());
    let step = Step { world, states, wrenches, free, previous, earlier, interrupt };
    // Other solvers' laws have no offset.
    match instants {
        Some(instants) if solver.islands().is_some() => {
            candidates.set_instants(&instants.states, free);
        }
        _ => candidates.set_instants(&[], &[]),
    }
    let solution = &mut taken.solution;
    let needs_contact = candidates.find(detection, world, states, free);
    if sets_aside && candidates.touches_aside() {
        return Ok(false);
    }
    rest.found(candidates.count_all());
    let infeasible_gap = |contacts: &[Contact], accepted: f64, next: &[State]| {
        let least = world.time_step() * accepted.max(rounding::residual(world, states, next));
        infeasible_gap::find(world, states, contacts, &previous.joints, least)
    };
    if moment.is_infeasible {
        let accepted = solver.accepted_residual();
        taken.infeasible_gap = infeasible_gap(candidates.contacts(), accepted, free);
    }
    let (mut report, share, accepted) = if needs_contact {
        rest.tell(solver);
        let is_hopeless = |body| {
            let is_in = |gap: &InfeasibleGap| gap.between.contains(&Partner::Body(body));
            moment.keeps_failing(body) || taken.infeasible_gap.as_ref().is_some_and(is_in)
        };
        let hopeless: Vec<bool> = if moment.is_infeasible || !moment.failures.is_empty() {
            (0..states.len()).map(is_hopeless).collect()
        } else {
            Vec::new()
        };
        if let Some(solver) = solver.islands().filter(|_| !hopeless.is_empty()) {
            solver.expect_failure(&hopeless);
        }
        let solved = bounce.solve(&step, solver, candidates, solution);
        if let Some(solver) = solver.islands().filter(|_| !hopeless.is_empty()) {
            solver.expect_failure(&[]);
        }
        let (report, share) = solved?;
        let islands = solver.islands();
        let rested = |body| islands.as_ref().is_some_and(|islands| islands.rested(body));
        if sets_aside {
            let mut aside = candidates.aside().iter().enumerate();
            if candidates.touches_aside() || aside.any(|(body, rests)| *rests && !rested(body)) {
                return Ok(false);
            }
        } else {
            rest.keep(rested);
        }
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
        rest.certify(world, &claim, certifier, solution.loads())
    } else {
        rest.certify(world, &claim, certifier, solution.forces())
    };
    // The certificate overrides the solver's status. A NaN fails every comparison.
    let residual = certificate.residual();
    let of_speeds = || rounding::residual(world, states, &solution.states);
    let of_forces = || rounding::forces(world, &claim, solution.loads());
    let within = residual <= accepted
        || residual <= of_speeds()
        || !sets_aside && residual <= (of_speeds() + of_forces()).min(rounding::largest(world));
    let solved = !matches!(report.status, StepStatus::Free | StepStatus::Failed);
    if !within {
        report.status = StepStatus::Failed;
    } else if solved {
        taken.unphysical = energy_check.cause(
            world,
            &claim,
            certifier.joint_motions(),
            solution.forces(),
            accepted,
            candidates.aside(),
        );
        taken.gain = energy_check.largest_gain();
    }
    taken.infeasible_gap =
        taken.infeasible_gap.take().filter(|_| report.status == StepStatus::Failed);
    if report.status == StepStatus::Failed && taken.infeasible_gap.is_none() {
        taken.infeasible_gap = infeasible_gap(contacts, accepted, &solution.states);
    }
    // A step that skipped a contact has an invalid trajectory.
    if report.status != StepStatus::Failed {
        taken.unphysical = taken
            .unphysical
            .or(missed.map(|between| UnphysicalCause::Missed { between }))
            .or_else(|| {
                let body = unphysical::lost_body(world, states, &solution.states)?;
                Some(UnphysicalCause::turn(world, body, &solution.states[body]))
            });
        if taken.unphysical.is_some() {
            report.status = StepStatus::Wild;
        }
    }
    if !sets_aside {
        candidates.remember(if is_regular(world) { rest.bodies() } else { &[] });
    } else if report.status.is_solved() {
        put_back(world, candidates, previous, solution, spare);
        candidates.put_back(&mut taken.contacts);
    } else {
        (taken.infeasible_gap, taken.unphysical, taken.gain) = (None, None, None);
        return Ok(false);
    }
    (taken.report, taken.certificate, taken.restitution_share) = (report, certificate, share);
    Ok(true)
}

/// Puts the last forces at the contacts that are set aside back into the `solution` of the others. `spare` is a
/// workspace. The contacts and their last forces are in one order.
#[cold]
fn put_back(
    world: &World,
    candidates: &Candidates,
    last: &StepSolution,
    solution: &mut StepSolution,
    spare: &mut StepSolution,
) {
    let rests = |force: &ContactForce| candidates.aside()[force.key.body];
    let resting = || last.contacts.iter().enumerate().filter(|(_, force)| rests(force));
    let forces = resting().map(|(_, force)| force);
    candidates.merge(forces, &mut solution.contacts, &mut spare.contacts);
    if world.has_turning_friction() {
        let moments = resting().filter_map(|(place, _)| last.moments.get(place));
        candidates.merge(moments, &mut solution.moments, &mut spare.moments);
    }
}
