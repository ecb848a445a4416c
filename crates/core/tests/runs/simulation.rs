//! The simulation loop: refused input, inexact starts and faulty solvers, exchanged motions, and
//! records of another world.

use crate::common::prelude::*;
use crate::common::{body, points};
use crate::toss::*;

/// A simulation can move to another thread.
const fn can_be_sent<T: Send>() {}
const _: () = can_be_sent::<Simulation<'static>>();

/// Checks that an error is one short line.
fn assert_one_sentence(error: &Error) {
    let text = error.to_string();
    assert!(text.len() < 200 && !text.contains('\n') && !text.contains(". "), "{text}");
}

/// Cube with its lowest corner on the ground, moving down and along it.
fn touching(world: &World) -> State {
    let mut start = thrown(42);
    start.velocity = Vector3::new(1.0, 0.5, -1.0);
    start.position[2] -= world.lowest_height(&[start]);
    start
}

/// Checks a quaternion of unit length to a few digits, as from a file. The simulation normalises
/// it. The remaining difference is rounding of the start, amplified by an impact.
#[test]
fn a_start_of_almost_unit_length_is_solved_like_any_other() {
    let world = cube_world(SOLID);
    let start = touching(&world);
    let longer = State { attitude: (1.0 + 1e-6) * start.attitude, ..start };
    let (exact, run) = (native_run(&world, start, 50), native_run(&world, longer, 50));
    assert_eq!(run[0].status(), StepStatus::Converged);
    for (step, exact) in run.iter().zip(&exact) {
        let (k, residual) = (step.index, step.residual());
        assert_eq!(step.status(), exact.status(), "step {k}");
        assert!(residual <= 1e-9, "step {k}: {residual:e}");
        let (pose, motion) = (
            pose_apart(step.next(), exact.next()),
            motion_apart(&world, step.next(), exact.next()),
        );
        assert!(pose < 1e-12 && motion < 1e-12, "step {k}: {pose:e}, {motion:e}");
    }
}

/// Checks that an invalid wrench is refused. The earlier wrench stays, and the numbers stay finite.
#[test]
fn non_finite_wrench_is_rejected() {
    let world = cube_world(SOLID);
    let (mut simulation, mut record) = (native(&world, touching(&world)), StepRecord::new());
    let mut pushed = native(&world, touching(&world));
    let push = Wrench { force: Vector3::new(0.0, 20.0, 0.0), torque: Vector3::zeros() };
    simulation.set_wrench(0, push).unwrap();
    pushed.set_wrench(0, push).unwrap();
    for number in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e10] {
        for axis in 0..6 {
            let mut wrench = Wrench::zero();
            let part = if axis < 3 { &mut wrench.force } else { &mut wrench.torque };
            part[axis % 3] = number;
            assert_one_sentence(&simulation.set_wrench(0, wrench).unwrap_err());
        }
    }
    for _ in 0..20 {
        simulation.step(&mut record).unwrap();
        assert!(simulation.state().to_vector().iter().all(|number| number.is_finite()));
    }
    for _ in 0..20 {
        pushed.step(&mut record).unwrap();
    }
    assert_eq!(simulation.state(), pushed.state());
}

#[test]
fn missing_bodies_are_rejected() {
    let world = cube_world(SOLID);
    let mut simulation = native(&world, touching(&world));
    assert_one_sentence(&simulation.set_wrench(1, Wrench::zero()).unwrap_err());
    assert_one_sentence(&simulation.set_load(1, Load::none()).unwrap_err());
    for count in [0, 2] {
        let states = vec![touching(&world); count];
        let refused = Simulation::new(world.clone(), states, Motion::Floating).err().unwrap();
        assert_one_sentence(&refused);
    }
}

/// Checks that overlapping bodies are refused. They would fly apart in the first step.
#[test]
fn bodies_that_overlap_at_the_start_are_refused() {
    let one = cube_world(SOLID);
    let bodies = vec![body(&one).clone(), body(&one).clone()];
    let world = World::new(Parameters { bodies, ..one.parameters().clone() }).unwrap();
    let states = [touching(&one), touching(&one)];
    let refused = Simulation::new(world, states, Motion::Floating).err().unwrap();
    assert_one_sentence(&refused);
    assert!(refused.to_string().contains("overlap"), "{refused}");
}

/// Checks that starts deep below the ground are refused. A step would throw such a body out, at
/// 1500 m/s from a depth of 3 m. Starts in the contact band are accepted, as recorded states lie
/// there. A floating motion has no ground.
#[test]
fn a_start_deep_below_the_ground_is_refused_and_one_in_the_contact_band_is_not() {
    let level = cube_world(SOLID);
    let slope = Plane::new(Vector3::new(0.3, -0.2, 1.0), 0.7).unwrap();
    let slope =
        World::new(Parameters { ground: Some(slope), ..level.parameters().clone() }).unwrap();
    for world in [level, slope] {
        let at = |height: f64| {
            let mut start = touching(&world);
            start.position +=
                world.ground().unwrap().normal() * (height - world.lowest_height(&[start]));
            start
        };
        for depth in [0.0051, 0.1, 3.0, 1e5] {
            let motion = Motion::native(&world);
            let refused = Simulation::new(world.clone(), [at(-depth)], motion).err().unwrap();
            assert_one_sentence(&refused);
            let Error::StartBelowGround { depth: found, allowed, .. } = refused else {
                panic!("{refused}");
            };
            // Heights are computed from positions of up to 1e5 m.
            assert!((found - depth).abs() < 1e-9 && allowed == 0.005, "{refused}");
            let floating = Simulation::new(world.clone(), [at(-depth)], Motion::Floating);
            assert!(floating.is_ok(), "{depth}");
        }
        for height in [-0.0049, -1e-6, 0.0, 10.0] {
            let motion = Motion::native(&world);
            assert!(Simulation::new(world.clone(), [at(height)], motion).is_ok(), "{height}");
        }
    }
}

/// Solver that returns a given number of states and forces.
struct OfSize {
    states: usize,
    /// Number of forces minus number of contacts.
    more: isize,
}

impl StepSolver for OfSize {
    fn accepted_residual(&self) -> f64 {
        1.0
    }

    fn solve(
        &mut self,
        step: &Step<'_>,
        candidates: &mut Candidates,
        solution: &mut StepSolution,
    ) -> Result<StepReport, Error> {
        let contacts = candidates.contacts();
        let count = contacts.len().saturating_add_signed(self.more);
        let force = ContactForce::none(contacts[0].key);
        solution.states = vec![step.free[0]; self.states];
        solution.contacts = vec![force; count];
        Ok(StepReport::without_problem(StepStatus::Converged))
    }
}

/// Checks that a solution of the wrong size is an error and no panic. The simulation does not
/// change and continues with another solver.
#[test]
fn solution_of_wrong_size_is_an_error() {
    let world = cube_world(SOLID);
    let start = touching(&world);
    let expected = native_run(&world, start, 1).remove(0);
    for (states, more) in [(0, 0), (2, 0), (1, -1), (1, 1), (0, -1), (2, 5)] {
        let motion = Motion::contact(OfSize { states, more });
        let mut simulation = Simulation::new(world.clone(), [start], motion).unwrap();
        let mut record = StepRecord::new();
        let error = simulation.step(&mut record).unwrap_err();
        assert!(matches!(error, Error::Solver { .. }), "{states}, {more}: {error}");
        assert_one_sentence(&error);
        assert_eq!((simulation.index(), simulation.state()), (0, &start));
        simulation.swap_motion(&mut Motion::native(&world));
        simulation.step(&mut record).unwrap();
        assert_eq!(record, expected, "{states}, {more}");
    }
}

/// Runge–Kutta steps of a world that is divided at impacts need nothing of a contact step before.
#[test]
fn a_floating_motion_swapped_in_takes_the_first_step_of_a_divided_run() {
    let world = cube_world(SOLID).with_integrator(Integrator::Leapfrog);
    let world = world.with_impacts(tumble_core::world::Impacts::Located);
    let mut simulation = native(&world, thrown(42));
    simulation.swap_motion(&mut Motion::Floating);
    let mut record = StepRecord::new();
    simulation.step(&mut record).unwrap();
    assert_eq!(record.status(), StepStatus::Free);
}

#[test]
fn a_motion_swapped_in_takes_the_next_steps() {
    let world = cube_world(SOLID);
    let mut simulation = native(&world, thrown(42));
    let mut floating = Motion::Floating;
    let mut record = StepRecord::new();
    while simulation.state().position.z > 0.2 && simulation.index() < 400 {
        simulation.swap_motion(&mut floating);
        simulation.step(&mut record).unwrap();
        assert_eq!(record.status(), StepStatus::Free);
        simulation.swap_motion(&mut floating);
    }
    // Without the ground the cube fell below its surface. The contact motion pushes it out.
    assert!(world.lowest_height(simulation.states()) < -0.5);
    simulation.step(&mut record).unwrap();
    assert_ne!(record.status(), StepStatus::Free);
}

#[test]
fn a_record_of_another_world_is_made_anew() {
    let cube = cube_world(SOLID);
    let mut record = StepRecord::new();
    native(&cube, touching(&cube)).step(&mut record).unwrap();
    assert!(!record.first().contacts.is_empty());
    let point = &[Vector3::new(0.1, 0.0, 0.0)];
    let pendulum = RigidBody::new(1.0, Matrix3::identity(), point).unwrap();
    let world = World::new(parameters(pendulum)).unwrap();
    assert_eq!(points(&world), 1);
    let mut fresh = StepRecord::new();
    native(&world, thrown(42)).step(&mut record).unwrap();
    native(&world, thrown(42)).step(&mut fresh).unwrap();
    assert_eq!(record, fresh);
}
