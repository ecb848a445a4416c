//! Invariants of every step, independent of the solver and the initial state.

use crate::common::{body, heights};
use proptest::prelude::*;
use std::cell::Cell;
use tumble::ipopt::ReturnStatus;
use tumble_core::contact::certificate::{Certifier, Claim};
use tumble_core::contact::rounding::LARGEST;
use tumble_core::mechanics::State;
use tumble_core::simulation::{Interval, Motion, Simulation, StepRecord};
use tumble_core::solver::native::{ACCEPTED_RESIDUAL, NativeSolver, STARTS};
use tumble_core::step::{StepReport, StepSolver, StepStatus};
use tumble_core::world::World;

/// Numbers of contact steps by result.
#[derive(Debug, Default)]
pub struct Seen {
    solved: Cell<u32>,
    /// Failed steps that [`is_excused`] allows.
    excused: Cell<u32>,
    /// Other failed steps.
    failed: Cell<u32>,
}

impl Seen {
    fn count(&self, world: &World, record: &StepRecord, accepted: f64) {
        let count = match record.status() {
            StepStatus::Free | StepStatus::End => return,
            StepStatus::Failed if is_excused(world, record, accepted) => &self.excused,
            StepStatus::Failed => &self.failed,
            _ => &self.solved,
        };
        count.set(count.get() + 1);
    }

    /// Asserts at least `solved` steps, at most `excused` and at most `failed`. The random inputs
    /// are fixed. Callers leave a margin of a few percent for other roundings of exp and ln.
    pub fn assert_counts(&self, solved: u32, excused: u32, failed: u32) {
        let counts = [&self.solved, &self.excused, &self.failed].map(Cell::get);
        let within = counts[0] >= solved && counts[1] <= excused && counts[2] <= failed;
        assert!(within, "{self:?}");
    }
}

/// Native solver and its accepted residual [m/s].
pub fn native(world: &World) -> (Box<dyn StepSolver>, f64) {
    (Box::new(NativeSolver::new(world)), ACCEPTED_RESIDUAL * world.speed_scale())
}

/// Takes up to `steps` steps and checks each. The solver promises a residual of at most `accepted`
/// [m/s]. The run ends early if it leaves the valid states, because later steps may overflow.
pub fn check_run(
    world: &World,
    start: State,
    (solver, accepted): (Box<dyn StepSolver + '_>, f64),
    steps: usize,
    seen: &Seen,
) -> Result<(), TestCaseError> {
    // A contact simulation refuses a start far below the ground. A failed step may end there, so
    // the run starts as a floating motion.
    let mut simulation = Simulation::new(world.clone(), [start], Motion::Floating).unwrap();
    simulation.swap_motion(&mut Motion::contact(solver));
    let mut record = StepRecord::new();
    for index in 0..steps {
        let before = *simulation.state();
        simulation.step(&mut record).unwrap();
        prop_assert_eq!((record.index, *record.state()), (index as u64, before));
        // Velocities of shorter intervals are converted at the end of their step.
        if !record.is_divided() {
            prop_assert_eq!(simulation.state(), record.next());
        }
        check_step(world, &record, accepted)?;
        seen.count(world, &record, accepted);
        if simulation.state().checked().is_err() {
            break;
        }
    }
    Ok(())
}

/// Asserts finite numbers, a certificate that agrees with the step, and a status that the
/// certificate supports.
fn check_step(world: &World, record: &StepRecord, accepted: f64) -> Result<(), TestCaseError> {
    let world = &*record.first().world(world);
    let Interval { states, wrenches, contacts, solution, report, certificate, .. } = record.first();
    let (state, next) = (record.state(), record.next());
    prop_assert!(next.to_vector().iter().all(|number| number.is_finite()), "{record:?}");
    for contact in &solution.contacts {
        let numbers = contact.force.iter().chain(&contact.slip).chain([&contact.normal_force]);
        prop_assert!(numbers.into_iter().all(|number| number.is_finite()), "{record:?}");
    }
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
            prop_assert_eq!(*next, world.free_flight(0, state, &wrenches[0]));
            0.0
        }
        StepStatus::Converged | StepStatus::Retried | StepStatus::Fallback | StepStatus::Wild => {
            accepted
        }
        StepStatus::Failed | StepStatus::Substepped => return Ok(()),
        StepStatus::End => return Err(TestCaseError::fail("a step is no end")),
    };
    prop_assert!(certificate.residual() <= allowed.max(rounding), "{record:?}");
    // Friction at a contact without normal force, expressed as a change of velocity.
    for contact in solution.contacts.iter().filter(|contact| !contact.carries_force()) {
        let speed = contact.force.norm() * world.time_step() / body(world).mass();
        prop_assert!(speed <= allowed.max(rounding), "{record:?}");
    }
    Ok(())
}

/// True if status, start method and Ipopt's message are consistent.
fn words_agree(report: &StepReport) -> bool {
    let by_ipopt = report.message == Some(ReturnStatus::SolveSucceeded.name());
    match (report.start, report.status) {
        (_, StepStatus::Failed | StepStatus::Substepped) => true,
        // Free flight that turns too far near the ground has status `wild`.
        (None, StepStatus::Free | StepStatus::Wild) => report.message.is_none(),
        (Some("previous"), StepStatus::Converged) => report.message.is_none() || by_ipopt,
        (Some("warm"), StepStatus::Converged) => by_ipopt,
        // A contact that is admitted late may be solved from the first start.
        (Some(start), StepStatus::Retried) if STARTS.contains(&start) => report.message.is_none(),
        (Some(_), StepStatus::Wild) => true,
        (Some("native_start" | "free_flight" | "shared_weight"), StepStatus::Retried) => by_ipopt,
        (Some("native"), StepStatus::Fallback) => true,
        _ => false,
    }
}

/// Bound of the rounding in an exact step's residual [m/s]. Positions are known to ε‖x‖ and divided
/// by h. Speeds at both ends are known to ε‖v‖. The gyroscopic torque is known to ε I_max |ω|² and changes the
/// spin by h/I_min times that. The bound has a factor of 1000. Speeds enter it up to 1e5, the limit
/// of a valid state.
fn rounding(world: &World, state: &State, next: &State) -> f64 {
    let reach = world.reach();
    let length = state.position.amax().max(next.position.amax()) + reach;
    let (spin, moments) =
        (next.spin.norm().min(1e5), body(world).inertia().symmetric_eigenvalues());
    let turning = world.time_step() * moments.max() / moments.min() * spin * spin * reach;
    let velocity = state.velocity.amax().max(next.velocity.amax()).min(1e5);
    let speed = velocity + spin * reach + turning;
    1e3 * f64::EPSILON * (length / world.time_step() + speed)
}

/// True if the native solver may fail at a step with an accepted residual of `accepted` [m/s]. V =
/// ‖v‖ + ‖v⁺‖ + ℓ (‖ω‖ + ‖ω⁺‖) + depth/h includes the speed that lifts a body out of the ground.
/// Each of these cases is an excuse:
///
/// - The body moves too far in a step, h V > ℓ/4. The linearisation at the start of the step is
///   then invalid at its end.
/// - Rounding exceeds the accepted residual. An impulse m V is known to ε m V, hence a contact
///   velocity to ε w V. The response w of a point is at most about m ℓ²/I_min. The ratio uses I_max
///   if that is larger than m ℓ², because of the gyroscopic torque.
/// - The scene is too far away or the step too short for doubles. Rounding of positions divided by
///   h exceeds the limit of the library for rounding.
fn is_excused(world: &World, record: &StepRecord, accepted: f64) -> bool {
    let (body, h) = (body(world), world.time_step());
    let (old, next) = (record.state(), record.next());
    let (reach, moments) = (body.reach(), body.inertia().symmetric_eigenvalues());
    let spins = old.spin.norm() + next.spin.norm();
    let depth = heights(world, old).into_iter().fold(0.0_f64, |depth, z| depth.max(-z));
    let speed = old.velocity.norm() + next.velocity.norm() + reach * spins + depth / h;
    let ratio = (body.mass() * reach * reach).max(moments.max()) / moments.min();
    // Free flight has no solver and no accepted residual. Only rounding can explain its residual.
    let free = record.first().contacts.is_empty();
    let lost = if free { record.residual() } else { accepted };
    h * speed > 0.25 * reach
        || f64::EPSILON * ratio * speed >= lost
        || (rounding(world, old, next) >= LARGEST
            && record.residual() <= rounding(world, old, next))
}
