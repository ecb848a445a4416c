//! Steps that are taken back and repeated, or repeated after an interrupt. Every solver returns the
//! same doubles again.

use crate::common::prelude::*;
use crate::toss::*;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use tumble::solver::ipopt::{IpoptSolver, Ladder, Rung};

/// Name, constructor of a solver, and number of steps that it solves in about a second.
type Case = (&'static str, fn(&World) -> Box<dyn StepSolver>, usize);

const CASES: [Case; 2] = [("native", native_solver, 600), ("ladder", ladder, 60)];

fn native_solver(world: &World) -> Box<dyn StepSolver> {
    Box::new(NativeSolver::new(world))
}

fn ladder(world: &World) -> Box<dyn StepSolver> {
    let options = IpoptSolver::options(1e-6, 300);
    let ipopt = IpoptSolver::new(world, options).unwrap();
    Box::new(Ladder::new(world, ipopt, &Rung::ALL))
}

/// Worlds with level ground and with a slope.
fn worlds() -> [World; 2] {
    let level = cube_world(SOLID);
    let ground = Plane::sloping(10.0).unwrap();
    let sloping =
        World::new(Parameters { ground: Some(ground), ..level.parameters().clone() }).unwrap();
    [level, sloping]
}

/// State of the thrown cube three steps before it touches the ground.
fn before_the_touch(world: &World) -> State {
    let run = native_run(world, thrown(42), 400);
    let contact = run.iter().position(|step| step.status() != StepStatus::Free);
    *run[contact.expect("contact") - 3].state()
}

fn simulation(world: &World, solver: Box<dyn StepSolver>) -> Simulation<'static> {
    let start = before_the_touch(world);
    Simulation::new(world.clone(), [start], Motion::contact(solver)).unwrap()
}

/// Steps of an undisturbed run.
fn undisturbed(world: &World, solver: Box<dyn StepSolver>, steps: usize) -> Vec<StepRecord> {
    let (mut simulation, mut record) = (simulation(world, solver), StepRecord::new());
    let step = |_| {
        simulation.step(&mut record).unwrap();
        record.clone()
    };
    (0..steps).map(step).collect()
}

/// Checks that a repeated step also starts from the same state.
#[test]
fn a_step_taken_back_and_repeated_is_the_same_step() {
    for (name, solver, steps) in CASES {
        for world in worlds() {
            let run = undisturbed(&world, solver(&world), steps);
            let mut simulation = simulation(&world, solver(&world));
            let mut record = StepRecord::new();
            let mut contact = 0;
            for step in &run {
                let before = *simulation.state();
                simulation.step(&mut record).unwrap();
                assert_eq!(record, *step, "{name}");
                simulation.take_back(&record);
                assert_eq!((simulation.state(), simulation.index()), (&before, step.index));
                simulation.step(&mut record).unwrap();
                assert_eq!(record, *step, "{name}: again");
                contact += usize::from(step.status() != StepStatus::Free);
            }
            assert!(2 * contact > steps, "{name}: {contact}");
        }
    }
}

/// Checks that an interrupted step leaves the simulation unchanged, and that the last step can then
/// be taken back. Both steps are equal to the steps of an undisturbed run. That includes free
/// flight and steps without an iteration.
#[test]
fn an_interrupted_step_leaves_no_trace() {
    for (name, solver, steps) in CASES {
        for world in worlds() {
            let run = undisturbed(&world, solver(&world), steps);
            let mut simulation = simulation(&world, solver(&world));
            let flag = Arc::new(AtomicBool::new(false));
            simulation.interrupt_by(flag.clone());
            let (mut record, mut last) = (StepRecord::new(), None::<StepRecord>);
            let mut interrupted = 0;
            for step in &run {
                if step.index > 0 {
                    let (before, index) = (*simulation.state(), simulation.index());
                    flag.store(true, Ordering::Relaxed);
                    let error = simulation.step(&mut record).unwrap_err();
                    assert_eq!(error, Error::Interrupted, "{name}");
                    assert_eq!((simulation.state(), simulation.index()), (&before, index));
                    flag.store(false, Ordering::Relaxed);
                    interrupted += 1;
                    let last = last.as_ref().unwrap();
                    simulation.take_back(last);
                    simulation.step(&mut record).unwrap();
                    assert_eq!(record, *last, "{name}: the step before it");
                }
                simulation.step(&mut record).unwrap();
                assert_eq!(record, *step, "{name}");
                last = Some(record.clone());
            }
            assert!(interrupted > 30, "{name}: {interrupted}");
        }
    }
}

/// Native solver that is interrupted in its second step.
struct Interrupted {
    inner: NativeSolver,
    steps: u32,
}

impl StepSolver for Interrupted {
    fn accepted_residual(&self) -> f64 {
        self.inner.accepted_residual()
    }

    fn solve(
        &mut self,
        step: &Step<'_>,
        candidates: &mut Candidates,
        solution: &mut StepSolution,
    ) -> Result<StepReport, Error> {
        self.steps += 1;
        if self.steps == 1 {
            Err(Error::Interrupted)
        } else {
            self.inner.solve(step, candidates, solution)
        }
    }
}

/// The first step is interrupted: the bodies still start, with the wrench of the next attempt.
#[test]
fn an_interrupt_of_a_start_leaves_no_trace() {
    let world = cube_world(SOLID).with_integrator(Integrator::Leapfrog);
    let start = State {
        velocity: Vector3::new(2.0, 0.0, 0.0),
        ..State::at_rest(Vector3::new(0.0, 0.0, 1.0))
    };
    let first = |steps: u32| {
        let solver = Box::new(Interrupted { inner: NativeSolver::new(&world), steps });
        let motion = Motion::contact(solver);
        let mut simulation = Simulation::new(world.clone(), [start], motion).unwrap();
        let mut record = StepRecord::new();
        if steps == 0 {
            assert_eq!(simulation.step(&mut record), Err(Error::Interrupted));
            assert_eq!(simulation.states(), [start]);
        }
        let force = Vector3::new(30.0, 0.0, 0.0);
        simulation.set_wrench(0, Wrench { force, ..Wrench::zero() }).unwrap();
        simulation.step(&mut record).unwrap();
        (record.states().to_vec(), record.end_states().to_vec())
    };
    assert_eq!(first(0), first(2));
}

#[test]
fn only_the_last_step_can_be_taken_back() {
    let world = cube_world(SOLID);
    let mut simulation = native(&world, thrown(42));
    let (mut first, mut second) = (StepRecord::new(), StepRecord::new());
    simulation.step(&mut first).unwrap();
    simulation.step(&mut second).unwrap();
    let state = *simulation.state();
    simulation.take_back(&first);
    assert_eq!((simulation.index(), simulation.state()), (2, &state));
    simulation.take_back(&second);
    simulation.take_back(&second);
    simulation.take_back(&first);
    assert_eq!((simulation.index(), simulation.state()), (1, second.state()));
}
