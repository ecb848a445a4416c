//! Time of steps with many islands on one thread and on several, and the solver's share of it.
//!
//! The results must be equal. Run `cargo run --release -p tumble-measure --bin islands`, optionally
//! with the numbers of threads and of islands per scene: `… -- 4 300`.
//!
//! The exit code is 3 if a step did not converge, 1 if a number differs, 2 for a bad argument.

use nalgebra::{Vector3, Vector4};
use std::error::Error;
use std::num::NonZeroUsize;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;
use tumble_core::contact::{Candidates, Plane};
use tumble_core::mechanics::{RigidBody, Rotation, State};
use tumble_core::simulation::random::Draws;
use tumble_core::simulation::{Motion, Simulation, StepRecord};
use tumble_core::solver::native::NativeSolver;
use tumble_core::step::{Step, StepReport, StepSolution, StepSolver, StepStatus};
use tumble_core::world::{Parameters, World};

/// Number of rounds. The fastest time of each chunk counts, because the machine has other work.
const ROUNDS: usize = 30;
/// Steps of one run before the other run continues.
const CHUNK: usize = 1;

/// Bodies at each place.
#[derive(Clone, Copy)]
enum Group {
    /// Stack of five cubes.
    Stack,
    /// Five boxes in random attitudes above each other.
    Heap,
    /// Single box, thrown with spin.
    Single,
}

struct IslandScene {
    name: &'static str,
    group: Group,
    islands: usize,
    /// Numbers of steps before the timed part and in it.
    steps: [usize; 2],
}

impl IslandScene {
    fn begin(&self) -> Result<(World, Vec<State>), tumble_core::error::Error> {
        let mut draws = Draws::new(42);
        let (mut bodies, mut states) = (Vec::new(), Vec::new());
        for place in 0..self.islands {
            let (x, y) = ((place % 20) as f64 * 3.0, (place / 20) as f64 * 3.0);
            let count = if matches!(self.group, Group::Single) { 1 } else { 5 };
            for layer in 0..count {
                let z = match self.group {
                    Group::Stack => 0.5 + layer as f64,
                    Group::Heap => 0.5 + 0.9 * layer as f64,
                    Group::Single => 0.6,
                };
                let rest = matches!(self.group, Group::Stack);
                let mut side = || if rest { 0.5 } else { 0.15 + 0.1 * draws.unit() };
                let half_sides = Vector3::new(side(), side(), side());
                bodies.push(RigidBody::solid_box(1.0, half_sides)?);
                let level = Vector4::new(1.0, 0.0, 0.0, 0.0);
                let thrown = if count == 1 { 1.0 } else { 0.0 };
                states.push(State {
                    position: Vector3::new(x, y, z),
                    attitude: if rest { level } else { draws.attitude() },
                    velocity: Vector3::new(1.0, 0.5, 0.0) * thrown,
                    spin: Vector3::new(3.0, 5.0, 2.0) * thrown,
                });
            }
        }
        let ground = Plane::level();
        let gravity = Vector3::new(0.0, 0.0, -9.81);
        let parameters = Parameters {
            bodies,
            ground: Some(ground),
            gravity,
            friction: 0.5,
            time_step: 0.002,
            rotation: Rotation::Momentum,
        };
        Ok((World::new(parameters)?, states))
    }
}

/// Native solver with a clock; `spent` is the time of its solves (ns).
struct Timed {
    solver: NativeSolver,
    spent: Arc<AtomicU64>,
}

impl StepSolver for Timed {
    fn accepted_residual(&self) -> f64 {
        self.solver.accepted_residual()
    }

    fn solve(
        &mut self,
        step: &Step<'_>,
        candidates: &mut Candidates,
        solution: &mut StepSolution,
    ) -> Result<StepReport, tumble_core::error::Error> {
        let clock = Instant::now();
        let report = self.solver.solve(step, candidates, solution);
        self.spent.fetch_add(clock.elapsed().as_nanos() as u64, Ordering::Relaxed);
        report
    }
}

/// Simulation with a given number of threads.
struct IslandRun {
    simulation: Simulation<'static>,
    record: StepRecord,
    spent: Arc<AtomicU64>,
    contacts: usize,
    failed: usize,
}

impl IslandRun {
    fn new(
        world: &World,
        starts: &[State],
        threads: NonZeroUsize,
    ) -> Result<Self, tumble_core::error::Error> {
        let spent = Arc::new(AtomicU64::new(0));
        let solver = NativeSolver::new(world).with_threads(threads)?;
        let motion = Motion::contact(Timed { solver, spent: Arc::clone(&spent) });
        let simulation = Simulation::new(world.clone(), starts.iter().copied(), motion)?;
        Ok(Self { simulation, record: StepRecord::new(), spent, contacts: 0, failed: 0 })
    }

    /// Takes `steps` steps. Returns their time and the solver's share of it (s).
    fn advance(&mut self, steps: usize) -> Result<[f64; 2], tumble_core::error::Error> {
        self.spent.store(0, Ordering::Relaxed);
        let clock = Instant::now();
        for _ in 0..steps {
            self.simulation.step(&mut self.record)?;
            self.contacts += self.record.contacts.len();
            self.failed += usize::from(self.record.report.status == StepStatus::Failed);
        }
        let all = clock.elapsed().as_secs_f64();
        Ok([all, 1e-9 * self.spent.load(Ordering::Relaxed) as f64])
    }
}

/// Result for a scene: the fastest times of each chunk, on one thread and on several.
struct Measured {
    chunks: Vec<[[f64; 2]; 2]>,
    /// Contacts of all timed steps of a run.
    contacts: usize,
    same: bool,
    failed: usize,
}

fn measure(
    scene: &IslandScene,
    threads: NonZeroUsize,
) -> Result<Measured, tumble_core::error::Error> {
    let (world, starts) = scene.begin()?;
    let [before, steps] = scene.steps;
    let none = [[f64::INFINITY; 2]; 2];
    let chunks = vec![none; steps / CHUNK];
    let mut measured = Measured { chunks, contacts: 0, same: true, failed: 0 };
    for _ in 0..ROUNDS {
        let mut runs = [
            IslandRun::new(&world, &starts, NonZeroUsize::MIN)?,
            IslandRun::new(&world, &starts, threads)?,
        ];
        for run in &mut runs {
            run.advance(before)?;
            run.contacts = 0;
        }
        for (index, chunk) in measured.chunks.iter_mut().enumerate() {
            // The runs take turns in going first.
            for turn in [index % 2, (index + 1) % 2] {
                let times = runs[turn].advance(CHUNK)?;
                for (least, time) in chunk[turn].iter_mut().zip(times) {
                    *least = least.min(time);
                }
            }
        }
        let [one, several] = &runs;
        measured.same &= one.record == several.record;
        measured.failed = one.failed;
        measured.contacts = one.contacts;
    }
    Ok(measured)
}

fn main() -> Result<ExitCode, Box<dyn Error>> {
    let numbers: Result<Vec<usize>, _> = std::env::args().skip(1).map(|n| n.parse()).collect();
    let (threads, islands) = match numbers.as_deref() {
        Ok([]) => (2, None),
        Ok(&[threads, islands]) if islands > 0 => (threads, Some(islands)),
        _ => (0, None),
    };
    let Some(threads) = NonZeroUsize::new(threads) else {
        eprintln!("two numbers from 1 are needed: threads, and islands in each scene");
        return Ok(ExitCode::from(2));
    };
    let scene = |name, group, usual, steps| {
        let islands = islands.unwrap_or(usual);
        IslandScene { name, group, islands, steps }
    };
    let scenes = [
        scene("stacks of 5 cubes at rest", Group::Stack, 100, [10, 100]),
        scene("stacks of 5 boxes that fall into heaps", Group::Heap, 100, [100, 200]),
        scene("boxes that tumble apart from each other", Group::Single, 200, [100, 300]),
    ];
    let (mut same, mut failed) = (true, 0);
    for scene in &scenes {
        let Measured { chunks, contacts, same: equal, failed: unsolved } = measure(scene, threads)?;
        let steps = (chunks.len() * CHUNK) as f64;
        let micros = |turn: usize, part: usize| {
            chunks.iter().map(|chunk| chunk[turn][part]).sum::<f64>() / steps * 1e6
        };
        let [one, several] = [0, 1].map(|turn| micros(turn, 0));
        let [of_one, of_several] = [0, 1].map(|turn| micros(turn, 1));
        println!(
            "{} {}: {:.0} contacts, {one:.0} µs a step on 1 thread ({of_one:.0} the solver), \
             {several:.0} on {threads} ({of_several:.0}), {:.2} times as fast (the solver {:.2})",
            scene.islands,
            scene.name,
            contacts as f64 / steps,
            one / several,
            of_one / of_several
        );
        same &= equal;
        failed += unsolved;
    }
    println!("numbers the same: {same}; steps not solved: {failed}");
    Ok(ExitCode::from(match (same, failed) {
        (false, _) => 1,
        (true, 0) => 0,
        (true, _) => 3,
    }))
}
