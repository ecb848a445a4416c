//! What must hold of every step, whoever solved it and from wherever.

use crate::common::{body, heights};
use proptest::prelude::*;
use std::cell::Cell;
use tumble::ipopt::ReturnStatus;
use tumble_core::contact::certificate::{Certifier, Claim};
use tumble_core::contact::rounding::LARGEST;
use tumble_core::mechanics::{State, Wrench};
use tumble_core::simulation::{Motion, Simulation, StepRecord};
use tumble_core::solver::native::{ACCEPTED_RESIDUAL, NativeSolver};
use tumble_core::step::{StepReport, StepSolver, StepStatus};
use tumble_core::world::World;

/// How the contact steps of a test's runs ended.
#[derive(Debug, Default)]
pub struct Seen {
    solved: Cell<u32>,
    /// Failed with an excuse.
    excused: Cell<u32>,
    /// Failed without.
    failed: Cell<u32>,
}

impl Seen {
    fn count(&self, world: &World, record: &StepRecord, accepted: f64) {
        let count = match record.report.status {
            StepStatus::Free | StepStatus::End => return,
            StepStatus::Failed if is_excused(world, record, accepted) => &self.excused,
            StepStatus::Failed => &self.failed,
            _ => &self.solved,
        };
        count.set(count.get() + 1);
    }

    /// At least `solved`, at most `excused`, and no more than `failed` without an excuse. The
    /// draws are always the same; the counts may differ by what other roundings of exp and ln
    /// make of them, for which the callers leave some steps in a hundred.
    pub fn assert_counts(&self, solved: u32, excused: u32, failed: u32) {
        let counts = [&self.solved, &self.excused, &self.failed].map(Cell::get);
        let within = counts[0] >= solved && counts[1] <= excused && counts[2] <= failed;
        assert!(within, "{self:?}");
    }
}

/// tumble's own solver, and what it promises.
pub fn native(world: &World) -> (Box<dyn StepSolver>, f64) {
    (Box::new(NativeSolver::new(world)), ACCEPTED_RESIDUAL * world.speed_scale())
}

/// Takes up to `steps` steps by a solver, whose solutions are promised to have a residual of at
/// most `accepted`, and checks each. A run ends early where it leaves the valid states: what
/// follows may overflow.
pub fn check_run(
    world: &World,
    start: State,
    (solver, accepted): (Box<dyn StepSolver + '_>, f64),
    steps: usize,
    seen: &Seen,
) -> Result<(), TestCaseError> {
    // No simulation of contact starts far below the ground; but a failed step may end there, and
    // the one after it begins there.
    let mut simulation = Simulation::new(world.clone(), [start], Motion::Floating).unwrap();
    simulation.swap_motion(&mut Motion::contact(solver));
    let mut record = StepRecord::new();
    for index in 0..steps {
        let before = *simulation.state();
        simulation.step(&mut record).unwrap();
        prop_assert_eq!((record.index, *record.state()), (index as u64, before));
        prop_assert_eq!(simulation.state(), record.next());
        check_step(world, &record, accepted)?;
        seen.count(world, &record, accepted);
        if simulation.state().checked().is_err() {
            break;
        }
    }
    Ok(())
}

/// Every number is finite, the certificate is that of the numbers, and the status is one that
/// it bears out.
fn check_step(world: &World, record: &StepRecord, accepted: f64) -> Result<(), TestCaseError> {
    let StepRecord { states, contacts, solution, report, certificate, .. } = record;
    let (state, next) = (record.state(), record.next());
    prop_assert!(next.to_vector().iter().all(|number| number.is_finite()), "{record:?}");
    for contact in &solution.contacts {
        let numbers = contact.force.iter().chain(&contact.slip).chain([&contact.normal_force]);
        prop_assert!(numbers.into_iter().all(|number| number.is_finite()), "{record:?}");
    }
    let wrenches = &[Wrench::zero()];
    let claim =
        Claim { states, next: &solution.states, wrenches, contacts, joints: &[], gears: &[] };
    let again = Certifier::new().contact_step(world, &claim, solution.forces());
    prop_assert_eq!(again, *certificate);
    prop_assert!(certificate.residual().is_finite(), "{record:?}");
    prop_assert!(words_agree(report), "{record:?}");

    let rounding = rounding(world, state, next);
    let allowed = match report.status {
        StepStatus::Free => {
            prop_assert!(contacts.is_empty() && report.iterations == 0, "{record:?}");
            prop_assert_eq!(*next, world.free_flight(0, state, &Wrench::zero()));
            0.0
        }
        StepStatus::Converged | StepStatus::Retried | StepStatus::Fallback | StepStatus::Wild => {
            accepted
        }
        StepStatus::Failed | StepStatus::Substepped => return Ok(()),
        StepStatus::End => return Err(TestCaseError::fail("a step is no end")),
    };
    prop_assert!(certificate.residual() <= allowed.max(rounding), "{record:?}");
    // A contact that does not press carries no friction, counted as the speed that it gives.
    for contact in solution.contacts.iter().filter(|contact| !contact.carries_force()) {
        let speed = contact.force.norm() * world.time_step() / body(world).mass();
        prop_assert!(speed <= allowed.max(rounding), "{record:?}");
    }
    Ok(())
}

/// The status, the start and Ipopt's word go together.
fn words_agree(report: &StepReport) -> bool {
    let by_ipopt = report.message == Some(ReturnStatus::SolveSucceeded.name());
    match (report.start, report.status) {
        (_, StepStatus::Failed | StepStatus::Substepped) => true,
        // Free flight that turns too far near the ground is wild.
        (None, StepStatus::Free | StepStatus::Wild) => report.message.is_none(),
        (Some("previous"), StepStatus::Converged) => report.message.is_none() || by_ipopt,
        (Some("warm"), StepStatus::Converged) => by_ipopt,
        // A contact that was admitted late may be solved from the first start.
        (Some("previous" | "zero" | "interior point" | "best point"), StepStatus::Retried) => {
            report.message.is_none()
        }
        (Some(_), StepStatus::Wild) => true,
        (Some("native_start" | "free_flight" | "shared_weight"), StepStatus::Retried) => by_ipopt,
        (Some("native"), StepStatus::Fallback) => true,
        _ => false,
    }
}

/// What rounding makes of an exact step's residual, m/s: positions x are known to ε‖x‖, and
/// divided by h; speeds to ε‖v‖; the gyroscopic torque to ε I_max |ω|², of which h/I_min makes a spin. A
/// thousand times that; no more than a valid state has.
fn rounding(world: &World, state: &State, next: &State) -> f64 {
    let reach = world.reach();
    let length = state.position.amax().max(next.position.amax()) + reach;
    let (spin, moments) =
        (next.spin.norm().min(1e5), body(world).inertia().symmetric_eigenvalues());
    let turning = world.time_step() * moments.max() / moments.min() * spin * spin * reach;
    let speed = next.velocity.amax().min(1e5) + spin * reach + turning;
    1e3 * f64::EPSILON * (length / world.time_step() + speed)
}

/// Whether tumble's own solver may fail at a step, where a residual of `accepted` counts as
/// solved. With V the speeds before and after, ‖v‖ + ‖v⁺‖ + ℓ (‖ω‖ + ‖ω⁺‖), and what a body
/// that starts below the ground needs to come up:
///
/// - the body leaps, h V > ℓ/4: what is linearised at the step's start says little of its end;
/// - rounding. An impulse of m V is known to ε m V, and in the contact's own scale to ε w V. The
///   response w of a point is at most about m ℓ²/I_min, with I_max for m ℓ² where that is
///   larger, as in the gyroscopic torque. Where this is more than what is accepted, no digit of
///   the residual is left;
/// - the scene is so far away or the step so short that doubles do not hold it: what rounding
///   makes of positions, divided by h, is more than the library ever calls rounding.
fn is_excused(world: &World, record: &StepRecord, accepted: f64) -> bool {
    let (body, h) = (body(world), world.time_step());
    let (old, next) = (record.state(), record.next());
    let (reach, moments) = (body.reach(), body.inertia().symmetric_eigenvalues());
    let spins = old.spin.norm() + next.spin.norm();
    let depth = heights(world, old).into_iter().fold(0.0_f64, |depth, z| depth.max(-z));
    let speed = old.velocity.norm() + next.velocity.norm() + reach * spins + depth / h;
    let ratio = (body.mass() * reach * reach).max(moments.max()) / moments.min();
    // Free flight has no solver that promises anything: rounding is what explains its residual.
    let free = record.contacts.is_empty();
    let lost = if free { record.certificate.residual() } else { accepted };
    h * speed > 0.25 * reach
        || f64::EPSILON * ratio * speed >= lost
        || (rounding(world, old, next) >= LARGEST
            && record.certificate.residual() <= rounding(world, old, next))
}
