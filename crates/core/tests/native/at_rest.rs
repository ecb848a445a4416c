//! Checks that bodies at rest are not solved again. Until an outside change, the steps are equal to
//! the last bit to the steps of a full computation.

use crate::common::prelude::*;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};
use tumble_core::simulation::scene::{TutorialScene, tutorial_parameters};
use tumble_core::step::IslandSolver;

/// Native solver that counts its steps and the bodies that it skipped because they are at rest.
struct Counting(NativeSolver, Arc<AtomicU32>, Arc<AtomicU32>);

impl StepSolver for Counting {
    fn accepted_residual(&self) -> f64 {
        self.0.accepted_residual()
    }

    fn solve(
        &mut self,
        step: &Step<'_>,
        candidates: &mut Candidates,
        solution: &mut StepSolution,
    ) -> Result<StepReport, Error> {
        self.1.fetch_add(1, Ordering::Relaxed);
        self.0.solve(step, candidates, solution)
    }

    fn islands(&mut self) -> Option<&mut dyn IslandSolver> {
        Some(self)
    }

    fn change_world(&mut self, world: &World) -> Result<(), Error> {
        self.0.change_world(world)
    }
}

impl IslandSolver for Counting {
    fn solve_again(
        &mut self,
        step: &Step<'_>,
        marked: &[bool],
        candidates: &mut Candidates,
        solution: &mut StepSolution,
    ) -> Result<StepReport, Error> {
        self.0.solve_again(step, marked, candidates, solution)
    }

    fn is_solved(&self, body: usize) -> bool {
        self.0.is_solved(body)
    }

    fn expect_rest(&mut self, bodies: &[bool]) {
        self.0.expect_rest(bodies);
    }

    fn expect_failure(&mut self, bodies: &[bool]) {
        self.0.expect_failure(bodies);
    }

    fn rested(&self, body: usize) -> bool {
        let rested = self.0.rested(body);
        self.2.fetch_add(u32::from(rested), Ordering::Relaxed);
        rested
    }
}

fn at_rest(position: Vector3<f64>) -> State {
    let (attitude, still) = (Vector4::new(1.0, 0.0, 0.0, 0.0), Vector3::zeros());
    State { position, attitude, velocity: still, spin: still }
}

/// Wall of three rows of bricks, and a cube next to it that falls from `height`.
fn wall(height: f64) -> (World, Vec<State>) {
    let brick = RigidBody::solid_box(2.0, Vector3::new(0.5, 0.25, 0.25)).unwrap();
    let place = |k: usize| {
        let (row, place) = (k / 4, (k % 4) as f64);
        Vector3::new(place + 0.5 * (row % 2) as f64, 0.0, 0.25 + 0.5 * row as f64)
    };
    let mut starts: Vec<_> = (0..12).map(|k| at_rest(place(k))).collect();
    starts.push(at_rest(Vector3::new(1.5, 3.0, 0.25 + height)));
    let cube = RigidBody::solid_box(1.0, Vector3::repeat(0.25)).unwrap();
    let world = World::new(Parameters {
        friction: 0.7,
        ..Parameters::new([vec![brick; 12], vec![cube]].concat())
    });
    (world.unwrap(), starts)
}

/// Two simulations of the same scene. The second is restored before each step, which clears its
/// knowledge of resting bodies.
struct Both {
    resting: Simulation<'static>,
    other: Simulation<'static>,
    /// Number of steps that the first simulation solved, and number of bodies that it skipped.
    solved: Arc<AtomicU32>,
    rested: Arc<AtomicU32>,
}

impl Both {
    fn new(height: f64) -> Self {
        let (world, starts) = wall(height);
        Self::from_world(world, starts)
    }

    fn from_world(world: World, starts: Vec<State>) -> Self {
        let [solved, rested] = [(); 2].map(|()| Arc::new(AtomicU32::new(0)));
        let counting = Counting(NativeSolver::new(&world), solved.clone(), rested.clone());
        let resting = Simulation::new(world.clone(), starts.clone(), Motion::contact(counting));
        let motion = Motion::native(&world);
        let other = Simulation::new(world, starts, motion);
        Self { resting: resting.unwrap(), other: other.unwrap(), solved, rested }
    }

    /// Steps both simulations `number` times and checks that the records are equal. Returns the
    /// number of steps that were solved.
    fn steps(&mut self, number: u32) -> u32 {
        let (mut one, mut two) = (StepRecord::new(), StepRecord::new());
        let before = self.solved.load(Ordering::Relaxed);
        for _ in 0..number {
            self.resting.step(&mut one).unwrap();
            let saved = self.other.save();
            self.other.restore(&saved).unwrap();
            self.other.step(&mut two).unwrap();
            assert_eq!(one, two, "k = {}", one.index);
            assert_eq!(bits(&one), bits(&two), "k = {}", one.index);
        }
        self.solved.load(Ordering::Relaxed) - before
    }

    /// Makes the same change to both simulations.
    fn change(&mut self, change: impl Fn(&mut Simulation<'static>)) {
        change(&mut self.resting);
        change(&mut self.other);
    }
}

/// Numbers of a record as bits, including the signs of zeros.
fn bits(record: &StepRecord) -> Vec<u64> {
    let states = record
        .first()
        .solution
        .states
        .iter()
        .flat_map(|s| s.to_vector().iter().copied().collect::<Vec<_>>());
    let forces = record
        .first()
        .solution
        .contacts
        .iter()
        .flat_map(|c| c.force.iter().chain(&c.slip).copied().collect::<Vec<_>>());
    states.chain(forces).map(f64::to_bits).collect()
}

#[test]
fn resting_islands_are_not_solved_again() {
    let mut both = Both::new(0.0);
    both.steps(20);
    assert_eq!(both.steps(50), 0);
}

/// Checks that a thrown cube comes to rest. A push below its friction limit changes the forces and
/// does not move it. A stronger push moves it.
#[test]
fn single_resting_body_is_not_solved_again() {
    let scene = TutorialScene::drop();
    let world = World::new(tutorial_parameters().unwrap()).unwrap();
    let mut both = Both::from_world(world, vec![scene.start(scene.attitude(42))]);
    assert!(both.steps(1500) > 200);
    assert_eq!(both.steps(50), 0);
    let push = |x: f64| Wrench { force: Vector3::new(x, 0.0, 0.0), torque: Vector3::zeros() };
    let place = both.resting.state().position;
    for (force, moves) in [(10.0, false), (0.0, false), (200.0, true)] {
        both.change(|run| run.set_wrench(0, push(force)).unwrap());
        assert!(both.steps(20) > 0, "{force}");
        let way = (both.resting.state().position - place).norm();
        assert_eq!(way > 1e-3, moves, "{force}: {way:e}");
    }
}

/// Checks that the whole step is solved while the cube moves. When it stops, nothing is solved.
#[test]
fn a_wall_rests_when_the_last_body_does() {
    let mut both = Both::new(0.1);
    assert!(both.steps(100) > 30);
    both.steps(100);
    assert_eq!(both.steps(20), 0);
}

/// Slides a cube towards the wall from far away. The wall is skipped until the cube hits it. All
/// steps equal the steps of the full computation, the impact included.
#[test]
fn a_wall_rests_by_itself_until_it_is_hit() {
    let (world, mut starts) = wall(0.0);
    starts[12].position = Vector3::new(-1.5, 0.0, 0.25);
    starts[12].velocity = Vector3::new(4.0, 0.0, 0.0);
    let mut both = Both::from_world(world, starts);
    both.steps(20);
    let before = both.rested.load(Ordering::Relaxed);
    assert_eq!(both.steps(50), 50, "something moves");
    assert_eq!(both.rested.load(Ordering::Relaxed) - before, 50 * 12);
    let before = both.rested.load(Ordering::Relaxed);
    both.steps(150);
    let rested = both.rested.load(Ordering::Relaxed) - before;
    assert!((300..1700).contains(&rested), "{rested}");
    let hit = both.resting.states()[0].velocity.norm();
    assert!(hit > 0.0 || both.resting.states()[0].position.x > 1e-6, "the wall was hit");
}

/// Pushes a brick while a cube falls far away. Only the island of the brick wakes up.
#[test]
fn a_wrench_wakes_the_island_that_it_is_on() {
    let (world, mut starts) = wall(0.0);
    starts[12].position = Vector3::new(-5.0, 0.0, 40.0);
    let mut both = Both::from_world(world, starts);
    both.steps(20);
    both.change(|run| {
        let force = Vector3::new(0.0, 60.0, 0.0);
        run.set_wrench(11, Wrench { force, torque: Vector3::zeros() }).unwrap();
    });
    let before = both.rested.load(Ordering::Relaxed);
    both.steps(30);
    assert_eq!(both.rested.load(Ordering::Relaxed), before, "it is pushed over");
    assert!(both.resting.states()[11].velocity.norm() > 0.0);
}

#[test]
fn a_change_from_outside_ends_the_rest() {
    type Change = fn(&mut Simulation<'static>);
    let changes: [(&str, Change); 8] = [
        ("wrench", |run| {
            let force = Vector3::new(0.0, 30.0, 0.0);
            run.set_wrench(11, Wrench { force, torque: Vector3::zeros() }).unwrap();
        }),
        ("load", |run| {
            let force =
                Polyline::new(vec![(0.0, Vector3::zeros()), (1.0, Vector3::new(0.0, 90.0, 0.0))])
                    .unwrap();
            let load =
                Load::new(force, Polyline::constant(Vector3::zeros()).unwrap(), Vector3::zeros())
                    .unwrap();
            run.set_load(11, load).unwrap();
        }),
        ("state", |run| {
            let state = State { velocity: Vector3::new(0.0, 1.0, 0.0), ..run.states()[11] };
            run.set_state(11, state).unwrap();
        }),
        ("hold", |run| run.hold_body(0, true).unwrap()),
        ("remove", |run| {
            run.remove_body(1).unwrap();
        }),
        ("add", |run| {
            let ball = RigidBody::solid_box(1.0, Vector3::repeat(0.1)).unwrap();
            run.add_body(ball, at_rest(Vector3::new(2.0, 0.0, 1.62))).unwrap();
        }),
        ("surface", |run| {
            run.set_surface(Partner::Ground, Vector3::new(0.5, 0.0, 0.0)).unwrap();
        }),
        ("motion", |run| {
            let mut motion = Motion::native(run.world());
            run.swap_motion(&mut motion);
        }),
    ];
    for (name, change) in changes {
        let mut both = Both::new(0.0);
        both.steps(20);
        assert_eq!(both.steps(3), 0, "{name}");
        both.change(change);
        let solved = both.steps(30);
        assert!(solved > 0 || name == "motion", "{name}: {solved}");
    }
}

/// Checks that a step at rest can be taken back like any other step.
#[test]
fn a_step_at_rest_is_taken_back() {
    let mut both = Both::new(0.0);
    both.steps(30);
    both.change(|run| {
        let mut record = StepRecord::new();
        run.step(&mut record).unwrap();
        let there = run.states().to_vec();
        run.take_back(&record);
        assert_eq!(run.index(), 30);
        assert_eq!(run.states(), there);
    });
    both.steps(10);
}

/// Checks that a record keeps the copy of a rest only as long as it is one. Two simulations of a resting box with
/// another friction share a record that is changed in between. Each step equals that in a record of its own.
#[test]
fn a_shared_record_has_the_rest_of_its_step() {
    let start = State::at_rest(Vector3::new(0.0, 0.0, 0.1));
    let simulation = |friction: f64| {
        let body = RigidBody::solid_box(1.0, Vector3::repeat(0.1)).unwrap();
        let ground = Some(Plane::new(Vector3::z(), 0.0).unwrap());
        let parameters = Parameters { ground, friction, ..Parameters::new(vec![body]) };
        let world = World::new(parameters).unwrap();
        Simulation::new(world.clone(), [start], Motion::native(&world)).unwrap()
    };
    let mut shared = [simulation(0.3), simulation(0.6)];
    let mut own = [simulation(0.3), simulation(0.6)];
    let (mut record, mut rested) = (StepRecord::new(), 0);
    for k in 0..60 {
        // Each simulation takes three steps in turn.
        let of = k / 3 % 2;
        shared[of].step(&mut record).unwrap();
        let mut expected = StepRecord::new();
        own[of].step(&mut expected).unwrap();
        assert_eq!(record, expected, "{k}");
        rested += usize::from(shared[of].rests());
        if k % 7 == 0 {
            record.first_mut().contacts.clear();
        }
        if k % 11 == 0 {
            let push = Wrench { force: Vector3::x() * f64::from(k as u32), ..Wrench::zero() };
            [&mut shared, &mut own]
                .into_iter()
                .for_each(|pair| pair[of].set_wrench(0, push).unwrap());
        }
    }
    assert!(rested > 20, "{rested}");
}
