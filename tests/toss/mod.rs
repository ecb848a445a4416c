//! Helpers of the native solver's tests: models, runs, and single steps as the simulation
//! poses them.

// Each test program compiles this file for itself and uses a part of it.
#![allow(dead_code)]

use crate::common::tutorial_parameters;
use nalgebra::{Matrix3, Vector3, Vector4};
use rand_mt::Mt;
use tumble::body::RigidBody;
use tumble::certificate::{Certificate, certify_contact_step};
use tumble::detection::Detection;
use tumble::model::{ContactModel, Parameters};
use tumble::quaternion::left;
use tumble::scene::Scene;
use tumble::simulation::{Motion, Simulation, StepRecord};
use tumble::solver::native::NativeSolver;
use tumble::solver::{Decision, Step, StepReport, StepSolver, StepStatus};
use tumble::state::{State, Wrench};

/// I of the tutorial's cube over E₃, kg m².
pub const LIGHT: f64 = 0.01;
/// I of a solid cube of the same mass and size over E₃, kg m²: m (2 m)²/6.
pub const SOLID: f64 = 6.666667;

/// The tutorial's constants for a body.
pub fn parameters(body: RigidBody) -> Parameters {
    Parameters { body, ..tutorial_parameters() }
}

/// The tutorial's cube with another inertia.
pub fn cube(inertia: Matrix3<f64>) -> RigidBody {
    RigidBody::with_box_corners(10.0, inertia, Vector3::repeat(1.0)).unwrap()
}

/// The tutorial's model with the inertia `inertia` E₃.
pub fn cube_model(inertia: f64) -> ContactModel {
    let inertia = Matrix3::from_diagonal_element(inertia);
    ContactModel::new(parameters(cube(inertia))).unwrap()
}

/// Cubes of three inertias: the tutorial's, a solid cube's, and one with moments close to
/// 2, 5 and 6 kg m² about axes askew to the sides.
pub fn cubes() -> Vec<RigidBody> {
    let askew = Matrix3::new(4.584, 1.209, -0.554, 1.209, 2.648, 0.288, -0.554, 0.288, 5.768);
    [LIGHT, SOLID]
        .map(Matrix3::from_diagonal_element)
        .into_iter()
        .chain([askew])
        .map(cube)
        .collect()
}

/// The thrown cube's start.
pub fn thrown(seed: u32) -> State {
    Scene::drop().start(Scene::drop().attitude(seed))
}

/// A simulation by the native solver.
pub fn native(model: &ContactModel, start: State) -> Simulation<'static> {
    let solver = Box::new(NativeSolver::new(model));
    let motion = Motion::Contact { detection: Detection::Predictive, solver };
    Simulation::new(model.clone(), start, motion).unwrap()
}

/// The steps of a thrown cube's run of 1000 rows by the native solver.
pub fn thrown_run(model: &ContactModel, seed: u32) -> Vec<StepRecord> {
    native_run(model, thrown(seed), 999)
}

/// The steps of a run by the native solver.
pub fn native_run(model: &ContactModel, start: State, steps: usize) -> Vec<StepRecord> {
    let mut simulation = native(model, start);
    let mut record = StepRecord::new(&start, model.contact_count());
    let mut run = Vec::with_capacity(steps);
    for _ in 0..steps {
        simulation.step(&mut record).unwrap();
        run.push(record.clone());
    }
    run
}

/// The largest certificate of a run, after a check that no step failed.
pub fn worst_certificate(run: &[StepRecord]) -> f64 {
    for step in run {
        assert_ne!(step.report.status, StepStatus::Failed, "step {}", step.index);
    }
    run.iter().map(|step| step.certificate.worst()).fold(0.0, largest)
}

/// The larger of two numbers, NaN if either is.
pub fn largest(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() { f64::NAN } else { a.max(b) }
}

/// A step solved on its own.
pub struct Solved {
    pub report: StepReport,
    pub active: Vec<bool>,
    pub decision: Decision,
    pub certificate: Certificate,
}

/// One step from `state` as the simulation poses it, without an external wrench and from
/// the start `previous`.
pub fn solve_step(
    solver: &mut dyn StepSolver,
    model: &ContactModel,
    state: &State,
    previous: &Decision,
) -> Solved {
    let wrench = &Wrench::zero();
    let free = &model.free_flight(state, wrench);
    let mut active = vec![false; model.contact_count()];
    let mut decision = Decision::at_rest_in(free, model.contact_count());
    let report = if Detection::Predictive.flag(model, state, free, &mut active) {
        let step = Step { model, state, wrench, free, previous };
        solver.solve(&step, &mut active, &mut decision).unwrap()
    } else {
        StepReport::without_problem(StepStatus::Free)
    };
    let forces: Vec<_> = decision.forces().collect();
    let certificate = certify_contact_step(model, state, &decision.state(), &forces, wrench);
    Solved { report, active, decision, certificate }
}

/// The point `state` with the contact forces `forces`, a start for a step.
pub fn with_forces(state: &State, forces: &[Vector3<f64>]) -> Decision {
    let mut decision = Decision::at_rest_in(state, forces.len());
    let layout = decision.layout();
    for (i, force) in forces.iter().enumerate() {
        let variables = layout.contact_variables(i);
        for axis in 0..3 {
            decision.as_mut_slice()[variables[axis]] = force[axis];
        }
    }
    decision
}

/// The state turned by `angle` about the vertical.
pub fn turned(state: &State, angle: f64) -> State {
    let ((s, c), (half_s, half_c)) = (angle.sin_cos(), (0.5 * angle).sin_cos());
    let turn = Matrix3::new(c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0);
    State {
        position: turn * state.position,
        attitude: left(&Vector4::new(half_c, 0.0, 0.0, half_s)) * state.attitude,
        velocity: turn * state.velocity,
        spin: state.spin,
    }
}

/// The largest difference of two states in position (m) and attitude.
pub fn pose_apart(a: &State, b: &State) -> f64 {
    let position = (a.position - b.position).amax();
    position.max((a.attitude - b.attitude).amax())
}

/// The largest difference of two states' motions at the body's reach, m/s.
pub fn motion_apart(model: &ContactModel, a: &State, b: &State) -> f64 {
    let velocity = (a.velocity - b.velocity).amax();
    velocity.max((a.spin - b.spin).amax() * model.body().reach())
}

/// Random numbers from 0 to 1, the same in every run.
pub struct Uniform(Mt);

impl Uniform {
    pub fn new(seed: u32) -> Self {
        Self(Mt::new(seed))
    }

    pub fn draw(&mut self) -> f64 {
        f64::from(self.0.next_u32()) / f64::from(u32::MAX)
    }

    /// A force at every contact point: of one size for all, 0.1 N to 100 kN, pressing, in a
    /// cone of 0.3 in each horizontal direction.
    pub fn forces(&mut self, contacts: usize) -> Vec<Vector3<f64>> {
        let size = 10_f64.powf(6.0 * self.draw() - 1.0);
        let mut force = || {
            let press = size * self.draw();
            let friction = 0.3 * press;
            Vector3::new(
                friction * (2.0 * self.draw() - 1.0),
                friction * (2.0 * self.draw() - 1.0),
                press,
            )
        };
        (0..contacts).map(|_| force()).collect()
    }
}
