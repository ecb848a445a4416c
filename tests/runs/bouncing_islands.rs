//! Restitution of islands. A bounce in one island does not change another island. An island that
//! cannot be solved with its full restitution is solved with a share of it.

use crate::common::prelude::*;
use std::path::Path;
use std::sync::{Arc, Mutex};
use tumble_core::step::IslandSolver;
use tumble_scene::scene::Scene;

fn at(x: f64, z: f64) -> State {
    State::at_rest(Vector3::new(x, 0.0, z))
}

fn ball(mass: f64, radius: f64) -> RigidBody {
    let moment = Matrix3::from_diagonal_element(0.4 * mass * radius * radius);
    RigidBody::from_pieces(mass, moment, vec![Piece::sphere(radius).unwrap()]).unwrap()
}

fn cube() -> RigidBody {
    RigidBody::solid_box(1.0, Vector3::repeat(0.1)).unwrap()
}

/// World of the bodies [`elsewhere`] and others.
fn world(bodies: Vec<RigidBody>) -> World {
    let (ground, gravity) = (Plane::level(), Vector3::new(0.0, 0.0, -9.81));
    let world = euler(Parameters {
        ground: Some(ground),
        gravity,
        friction: 1.0,
        ..Parameters::new(bodies)
    });
    let of = Coefficient::Restitution;
    let elastic = world.with_coefficient(of, 1.0).unwrap().with_rebound_speed(0.05).unwrap();
    let plastic = |world: World, body| world.with_coefficient_of(of, Partner::Body(body), 0.0);
    (1..6).try_fold(elastic, plastic).unwrap()
}

/// Kane's rod: it lands obliquely and spinning on rough ground. With the full restitution it would
/// leave with more energy than it had.
fn rod() -> (RigidBody, State) {
    let body = RigidBody::solid_box(1.0, Vector3::new(0.02, 0.02, 0.5)).unwrap();
    let (sin, cos) = f64::sin_cos(0.5 * 0.6);
    let start = State {
        attitude: Vector4::new(cos, 0.0, sin, 0.0),
        velocity: Vector3::new(1.5, 0.0, -2.0),
        spin: Vector3::new(0.0, 1.0, 0.0),
        ..at(0.0, 0.45)
    };
    (body, start)
}

/// Other bodies of the world, far from the rod:
///
/// - a ball that bounces for ever,
/// - a tower whose upper box lands on the lower one,
/// - a box that slides,
/// - a ball that falls onto the tower,
/// - a brick that tumbles, whose impulses do work because it turns within a step.
///
/// All but the first one are plastic.
fn elsewhere() -> (Vec<RigidBody>, Vec<State>) {
    let brick = RigidBody::solid_box(1.0, Vector3::new(0.1, 0.075, 0.05)).unwrap();
    let bodies = vec![ball(1.0, 0.1), cube(), cube(), cube(), ball(0.5, 0.1), brick];
    let sliding = State { velocity: Vector3::new(2.0, 0.3, 0.0), ..at(30.0, 0.1) };
    let spin = Vector3::new(8.0, 15.0, -9.0);
    let tumbling = State { spin, velocity: Vector3::new(3.0, 0.0, 0.0), ..at(40.0, 0.2) };
    let states =
        vec![at(10.0, 0.2), at(20.0, 0.1), at(20.03, 0.301), sliding, at(20.02, 1.0), tumbling];
    (bodies, states)
}

/// The same states 50 m higher, where no body touches another.
fn far_up(states: &[State]) -> Vec<State> {
    let up = |state: &State| State { position: state.position + Vector3::z() * 50.0, ..*state };
    states.iter().map(up).collect()
}

/// Runs a world and returns the records of all steps. Every step must be solved.
fn run_world(world: &World, states: &[State], solver: NativeSolver) -> Vec<StepRecord> {
    let motion = Motion::contact(solver);
    let mut simulation = Simulation::new(world.clone(), states.iter().copied(), motion).unwrap();
    let step = |_| {
        let mut record = StepRecord::new();
        simulation.step(&mut record).unwrap();
        assert_ne!(record.status(), StepStatus::Failed, "k = {}", record.index);
        record
    };
    (0..400).map(step).collect()
}

/// States of some bodies and their contacts as body A, as bits.
fn bits(records: &[StepRecord], of: std::ops::Range<usize>) -> Vec<Vec<u64>> {
    let of_step = |record: &StepRecord| {
        let states = record.next_states()[of.clone()].iter();
        let states = states.flat_map(|state| state.to_vector().data.0[0]);
        let contacts = record.first().contacts.iter().zip(&record.first().solution.contacts);
        let mine = contacts.filter(|(contact, _)| of.contains(&contact.key.body));
        let numbers = mine.flat_map(|(contact, force)| {
            let numbers = force.force.iter().chain(&force.slip).copied();
            numbers.chain([contact.rebound]).collect::<Vec<_>>()
        });
        states.chain(numbers).map(f64::to_bits).collect()
    };
    records.iter().map(of_step).collect()
}

/// Index of the first step in which two lists differ.
fn first_difference<T: PartialEq>(a: &[T], b: &[T]) -> Option<usize> {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).position(|(a, b)| a != b)
}

/// Checks that islands do not influence each other. The rod needs a smaller share in some steps.
/// The other bodies move as if the rod flew far above, to the last bit, and need as many
/// iterations. The same holds for the rod.
#[test]
fn bounces_do_not_affect_other_islands() {
    let (rod, start) = rod();
    let (others, theirs) = elsewhere();
    let count = others.len();
    let world = world(others.into_iter().chain([rod]).collect());
    let run = |others: &[State], rod: &[State], solver: NativeSolver| {
        let states: Vec<_> = others.iter().chain(rod).copied().collect();
        run_world(&world, &states, solver)
    };
    let solver = || NativeSolver::new(&world);
    let together = run(&theirs, &[start], solver());
    let without_rod = run(&theirs, &far_up(&[start]), solver());
    let alone = run(&far_up(&theirs), &[start], solver());
    let shares = |records: &[StepRecord]| {
        records.iter().map(|record| record.restitution_share()).collect::<Vec<_>>()
    };
    assert!(shares(&alone).iter().any(|share| *share < 1.0), "the rod is no paradox");
    assert!(shares(&without_rod).iter().all(|share| *share == 1.0));
    assert_eq!(first_difference(&shares(&together), &shares(&alone)), None);
    let (theirs_alone, found) = (bits(&without_rod, 0..count), bits(&together, 0..count));
    assert_eq!(first_difference(&found, &theirs_alone), None, "the others");
    let (rod_alone, found) = (bits(&alone, count..count + 1), bits(&together, count..count + 1));
    assert_eq!(first_difference(&found, &rod_alone), None, "the rod");
    // Every island is solved as often as it is alone.
    let iterations = |records: &[StepRecord]| {
        records.iter().map(|record| record.report().iterations).collect::<Vec<_>>()
    };
    let sum: Vec<_> =
        iterations(&alone).iter().zip(iterations(&without_rod)).map(|(a, b)| a + b).collect();
    assert_eq!(first_difference(&iterations(&together), &sum), None, "iterations");
    {
        let threads = std::num::NonZeroUsize::new(3).unwrap();
        let found = run(&theirs, &[start], solver().with_threads(threads).unwrap());
        assert_eq!(first_difference(&found, &together), None, "threads");
    }
}

/// Index of the rod, the last body.
const ROD: usize = 6;

/// Record of one call of a solver.
#[derive(Debug, Clone, Default)]
struct Call {
    /// Bodies whose problems were to be solved. The first call of a step has all bodies.
    marked: Vec<usize>,
    /// Share of the restitution at the contacts of the rod.
    share: f64,
    /// True if the solution of another body changed.
    changed_others: bool,
}

/// Native solver that records every call. It reports the rod's problem as not converged for the
/// shares that `fails` selects. If `of_bodies` is false it does not report islands, only the whole
/// step.
struct Noted {
    solver: NativeSolver,
    fails: fn(f64) -> bool,
    of_bodies: bool,
    calls: Arc<Mutex<Vec<Call>>>,
    whole: f64,
    failed: bool,
}

impl Noted {
    fn note(&mut self, mut report: StepReport, call: Call) -> StepReport {
        self.failed = self.whole > 0.0 && (self.fails)(call.share);
        if self.failed {
            report.status = StepStatus::Failed;
        }
        self.calls.lock().unwrap().push(call);
        report
    }
}

/// Largest rebound speed at a contact of the rod [m/s].
fn rebound(candidates: &Candidates) -> f64 {
    let of_body = candidates.contacts().iter().filter(|contact| contact.key.body == ROD);
    of_body.map(|contact| contact.rebound).fold(0.0, f64::max)
}

impl StepSolver for Noted {
    fn accepted_residual(&self) -> f64 {
        self.solver.accepted_residual()
    }

    fn solve(
        &mut self,
        step: &Step<'_>,
        candidates: &mut Candidates,
        solution: &mut StepSolution,
    ) -> Result<StepReport, Error> {
        let report = self.solver.solve(step, candidates, solution)?;
        if self.calls.lock().unwrap().is_empty() {
            self.whole = rebound(candidates);
        }
        let share = rebound(candidates) / self.whole;
        let call = Call { marked: (0..=ROD).collect(), share, changed_others: false };
        Ok(self.note(report, call))
    }

    fn islands(&mut self) -> Option<&mut dyn IslandSolver> {
        if self.of_bodies { Some(self) } else { None }
    }
}

impl IslandSolver for Noted {
    fn solve_again(
        &mut self,
        step: &Step<'_>,
        marked: &[bool],
        candidates: &mut Candidates,
        solution: &mut StepSolution,
    ) -> Result<StepReport, Error> {
        let before = solution.clone();
        let report = self.solver.solve_again(step, marked, candidates, solution)?;
        let mut pairs = before.contacts.iter().zip(&solution.contacts);
        let call = Call {
            marked: (0..=ROD).filter(|body| marked[*body]).collect(),
            share: rebound(candidates) / self.whole,
            changed_others: before.states[..ROD] != solution.states[..ROD]
                || pairs.any(|(old, new)| old.key.body != ROD && old != new),
        };
        Ok(self.note(report, call))
    }

    fn is_solved(&self, body: usize) -> bool {
        self.solver.is_solved(body) && !(body == ROD && self.failed)
    }

    fn expect_rest(&mut self, bodies: &[bool]) {
        self.solver.expect_rest(bodies);
    }

    fn expect_failure(&mut self, bodies: &[bool]) {
        self.solver.expect_failure(bodies);
    }

    /// No body rests: a step with contacts set aside would be taken again after a failure.
    fn rested(&self, _body: usize) -> bool {
        false
    }
}

/// Calls of every step in which the rod bounces, with the other bodies present.
fn calls(fails: fn(f64) -> bool, of_bodies: bool) -> Vec<Vec<Call>> {
    let (rod, start) = rod();
    let (bodies, states) = elsewhere();
    let world = world(bodies.into_iter().chain([rod]).collect());
    let calls = Arc::new(Mutex::new(Vec::new()));
    let solver = Noted {
        solver: NativeSolver::new(&world),
        fails,
        of_bodies,
        calls: Arc::clone(&calls),
        whole: 0.0,
        failed: false,
    };
    let states = states.into_iter().chain([start]);
    let mut simulation = Simulation::new(world, states, Motion::contact(solver)).unwrap();
    let mut record = StepRecord::new();
    let step = |_| {
        simulation.step(&mut record).unwrap();
        std::mem::take(&mut *calls.lock().unwrap())
    };
    let steps: Vec<_> = (0..120).map(step).collect();
    steps.into_iter().filter(|calls| calls.len() > 1).collect()
}

/// Checks that the search for the rod's share solves only the rod's island.
#[test]
fn a_search_solves_only_the_island_that_it_is_for() {
    let steps = calls(|_| false, true);
    assert!(!steps.is_empty());
    for call in steps.iter().flat_map(|calls| &calls[1..]) {
        assert_eq!(call.marked, [ROD], "{call:?}");
        assert!(!call.changed_others, "{call:?}");
    }
    // Bisection needs sixteen halvings to find the share to 1/65536. Secant steps are as fast.
    let most = steps.iter().map(Vec::len).max();
    assert!(most <= Some(18), "{most:?}");
}

/// Bounds the number of failing calls, because these take longest. A step that also fails without
/// restitution is tried twice. Where a share makes the solver fail, the search ends at 1/64.
#[test]
fn failing_step_is_retried_a_bounded_number_of_times() {
    for of_bodies in [true, false] {
        let most = |fails: fn(f64) -> bool| {
            let failing = |calls: &Vec<Call>| calls.iter().filter(|call| fails(call.share)).count();
            calls(fails, of_bodies).iter().map(failing).max()
        };
        assert_eq!(most(|_| true), Some(2), "always, {of_bodies}");
        assert!(most(|share| share > 0.0) <= Some(7), "but without restitution, {of_bodies}");
        assert!(most(|share| share > 0.0 && share < 1.0) <= Some(6), "but the whole, {of_bodies}");
        assert!(most(|share| share > 0.3) <= Some(7), "but with little, {of_bodies}");
    }
}

/// Wedges a capsule between a slope and a fixed box. The first step has four contacts, and has no
/// solution with the full e from 0.2 on. The effective restitution e σ must not decrease with e, to
/// the accuracy 1/64 of the search.
#[test]
fn a_wedged_capsule_takes_the_part_that_can_be_solved() {
    let scene = |e: f64| {
        let text =
            format!("ground = {{ friction = 0.6, restitution = {e}, slope = 16.235 }}\n{WEDGED}");
        let none = |_: &Path, _| Err(std::io::ErrorKind::NotFound.into());
        Scene::from_text(&text, Path::new("wedged.toml"), &[], &none)
            .unwrap_or_else(|f| panic!("{f}"))
    };
    let mut parts = Vec::new();
    for e in [0.0, 0.1, 0.2, 0.3, 0.5, 0.8, 1.0] {
        let scene = scene(e);
        let motion = scene.motion(&scene.world).unwrap();
        let mut simulation =
            Simulation::new(scene.world.clone(), scene.starts.clone(), motion).unwrap();
        let mut record = StepRecord::new();
        for _ in 0..50 {
            simulation.step(&mut record).unwrap();
            let status = record.status();
            assert_ne!(status, StepStatus::Failed, "e = {e}: {record:?}");
            if record.index == 0 {
                parts.push(e * record.restitution_share());
            }
        }
    }
    assert!(parts.windows(2).all(|pair| pair[1] >= pair[0] - 1.0 / 64.0), "{parts:?}");
}

const WEDGED: &str = r#"
steps = 50
time_step = 0.002
[[fixed]]
name = "f"
box = [0.494977996, 0.353102509, 0.369729572]
position = [0.197978073, 0.107950597, 0.0737834249]
attitude = { axis = [0.289957591, 0.551267132, 0.178737688], degrees = 176.178 }
frame = "ground"
[[bodies]]
capsule = { length = 0.215400605, radius = 0.0538501513 }
mass = 2.76855497
position = [0.11646123930205703, -0.2316811512538204, 0.022174438364213758]
attitude = [-0.299880209799196, 0.03742600124808862, -0.7555873699964709, 0.5811702680825858]
velocity = [0.15687152436302595, 0.026766131076218676, -0.04567932509375047]
spin = [-0.8873856577311525, -1.1109742512197303, -2.880489733708304]
frame = "world"
"#;
