//! What must hold of every step on level ground, whoever solved it and from wherever.

use proptest::prelude::*;
use std::cell::Cell;
use tumble::contact::certificate::certify_contact_step;
use tumble::contact::detection::Detection;
use tumble::ipopt::ReturnStatus;
use tumble::mechanics::state::{State, Wrench};
use tumble::simulation::{Motion, Simulation, StepRecord};
use tumble::solver::ipopt::Rung;
use tumble::solver::native::{ACCEPTED_CERTIFICATE, NativeSolver};
use tumble::step::{StepReport, StepSolver, StepStatus};
use tumble::world::ContactModel;

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
    fn count(&self, model: &ContactModel, record: &StepRecord) {
        let count = match record.report.status {
            StepStatus::Free | StepStatus::End => return,
            StepStatus::Failed if is_excused(model, record) => &self.excused,
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
pub fn native(model: &ContactModel) -> (Box<dyn StepSolver>, f64) {
    (Box::new(NativeSolver::new(model)), ACCEPTED_CERTIFICATE)
}

/// Takes up to `steps` steps by a solver, whose solutions are promised to have a certificate
/// of at most `accepted`, and checks each. A run ends early where it leaves the valid states:
/// what follows may overflow.
pub fn check_run(
    model: &ContactModel,
    start: State,
    (solver, accepted): (Box<dyn StepSolver + '_>, f64),
    steps: usize,
    seen: &Seen,
) -> Result<(), TestCaseError> {
    let motion = Motion::Contact { detection: Detection::Predictive, solver };
    let mut simulation = Simulation::new(model.clone(), start, motion).unwrap();
    let mut record = StepRecord::new(&start, model.contact_count());
    for index in 0..steps {
        let before = simulation.state();
        simulation.step(&mut record).unwrap();
        prop_assert_eq!((record.index, record.state), (index as u64, before));
        prop_assert_eq!(simulation.state(), record.solution.state());
        check_step(model, &record, accepted)?;
        seen.count(model, &record);
        if simulation.state().validate().is_err() {
            break;
        }
    }
    Ok(())
}

/// Every number is finite, the certificate is that of the numbers, and the status is one that
/// it bears out.
fn check_step(
    model: &ContactModel,
    record: &StepRecord,
    accepted: f64,
) -> Result<(), TestCaseError> {
    let StepRecord { state, solution, report, certificate, .. } = record;
    prop_assert!(solution.as_slice().iter().all(|number| number.is_finite()), "{record:?}");
    let (next, forces): (_, Vec<_>) = (solution.state(), solution.forces().collect());
    let again = certify_contact_step(model, state, &next, &forces, &Wrench::zero());
    prop_assert_eq!(again, *certificate);
    prop_assert!(certificate.worst().is_finite(), "{record:?}");
    prop_assert!(words_agree(report), "{record:?}");

    let rounding = rounding(model, state, &next);
    let allowed = match report.status {
        StepStatus::Free => {
            prop_assert!(!record.active.contains(&true) && report.iterations == 0, "{record:?}");
            prop_assert_eq!(next, model.free_flight(state, &Wrench::zero()));
            0.0
        }
        StepStatus::Converged | StepStatus::Retried | StepStatus::Fallback => accepted,
        StepStatus::Failed => return Ok(()),
        StepStatus::End => return Err(TestCaseError::fail("a step is no end")),
    };
    prop_assert!(certificate.worst() <= allowed.max(rounding), "{record:?}");
    // A contact without its flag carries no force, counted as the speed that it gives.
    for (force, _) in forces.iter().zip(&record.active).filter(|(_, active)| !**active) {
        let speed = force.norm() * model.time_step() / model.body().mass();
        prop_assert!(speed <= rounding, "{record:?}");
    }
    Ok(())
}

/// The status, Ipopt's word and the rung go together.
fn words_agree(report: &StepReport) -> bool {
    let by_ipopt = report.ipopt_status == Some(ReturnStatus::SolveSucceeded);
    match (report.rung, report.status) {
        (_, StepStatus::Failed) => true,
        // tumble's own solver, or none.
        (None, StepStatus::Free | StepStatus::Retried) => report.ipopt_status.is_none(),
        (None, StepStatus::Converged) => report.ipopt_status.is_none() || by_ipopt,
        (Some(Rung::Warm | Rung::Previous), StepStatus::Converged) => by_ipopt,
        (Some(Rung::NativeStart | Rung::FreeFlight | Rung::SharedWeight), StepStatus::Retried) => {
            by_ipopt
        }
        (Some(Rung::Native), StepStatus::Fallback) => true,
        _ => false,
    }
}

/// What rounding makes of an exact step's certificate, m/s: positions x are known to ε‖x‖, and
/// divided by h; speeds to ε‖v‖. A thousand times that; no more than a valid state has.
fn rounding(model: &ContactModel, state: &State, next: &State) -> f64 {
    let reach = model.body().reach();
    let length = state.position.amax().max(next.position.amax()) + reach;
    let speed = next.velocity.amax().min(1e5) + next.spin.amax().min(1e5) * reach;
    1e3 * f64::EPSILON * (length / model.time_step() + speed)
}

/// Whether tumble's own solver may fail at a step as it did. With V the speeds before and
/// after, ‖v‖ + ‖v⁺‖ + ℓ (‖ω‖ + ‖ω⁺‖):
///
/// - the body leaps, h V > ℓ/4, or would have to, from as deep below the ground: what is
///   linearised at the step's start says little of its end;
/// - rounding. Impulses of some m V act at levers ℓ; what rounding leaves of their sum changes
///   the spin by ε m V ℓ/I_min, which at the body's reach is the speed ε V m ℓ²/I_min; with
///   I_max for m ℓ² where that is larger, as in the gyroscopic torque (measured: up to 0.21 of
///   this where nothing leaps). A ratio of 1/ε leaves no digit at all;
/// - a quaternion that is valid, to 1e-6, but not of unit length: the solver takes it for a
///   rotation, and the contact points ‖c‖ away from the centre end so much too high or too low.
fn is_excused(model: &ContactModel, record: &StepRecord) -> bool {
    let (body, h) = (model.body(), model.time_step());
    let (old, next, worst) = (&record.state, record.solution.state(), record.certificate.worst());
    let (reach, moments) = (body.reach(), body.inertia().symmetric_eigenvalues());
    let spins = old.spin.norm() + next.spin.norm();
    let speed = old.velocity.norm() + next.velocity.norm() + reach * spins;
    let ratio = (body.mass() * reach * reach).max(moments.max()) / moments.min();
    let lever = body.contact_points().iter().map(|c| c.position.norm()).fold(0.0, f64::max);
    let stretch = (old.attitude.norm_squared() - 1.0).abs();
    let depth = model.contact_heights(old).fold(0.0_f64, |depth, z| depth.max(-z));
    (h * speed).max(depth) > 0.25 * reach
        || f64::EPSILON * ratio >= 1.0
        || worst <= f64::EPSILON * ratio * speed
        || worst <= stretch * lever / h
}
