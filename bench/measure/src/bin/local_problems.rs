//! Linearised contact problems of tumble's steps, for solvers of such problems (`bench/problems.py`).
//!
//! The program reads a scene as JSON from standard input and writes problems to the file in its
//! argument. J_i is the Jacobian of the touching point's velocity of contact i, in the order
//! normal, first, second tangent. With the states at k and the velocity v_free after free flight,
//!
//! ```text
//! J_i = Fᵀ [E, Gᵀ] on A and the opposite on B,   G = [y]× Aᵀ,   F = (n, t₁, t₂)
//! W = J M⁻¹ Jᵀ,   q = J v_free + n φ/h,   u = W p + q
//! ```
//!
//! Impulses p are in N s and velocities u in m/s. The nonlinear problem of the step differs by the
//! rotation during the step.
//!
//! The file contains for each problem, in little endian: n and k as 64-bit integers, then doubles.
//! These are the seconds of tumble's step, W (3n × 3n), q (3n), μ (n) and the impulses of the
//! previous step (3n).

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use rustix::time::{ClockId, clock_gettime};
use serde::Deserialize;
use std::io::{BufWriter, Write};
use std::process::ExitCode;
use tumble_core::contact::{Contact, KeyIndex, Partner};
use tumble_core::mechanics::{RigidBody, State, Wrench};
use tumble_core::simulation::StepRecord;
use tumble_core::solver::native::NativeSolver;
use tumble_core::step::StepSolution;
use tumble_core::world::World;
use tumble_measure::BenchScene;

type LocalFailure = Box<dyn std::error::Error>;

/// Number of runs; the shortest time of each step counts.
const RUNS: usize = 3;

/// Scene and the steps whose problems are written.
#[derive(Deserialize)]
struct LocalRequest {
    #[serde(flatten)]
    scene: BenchScene,
    /// Index k of the first step.
    first: usize,
    /// Distance between steps.
    stride: usize,
}

/// Three rows of J: the blocks of A and of B, each for velocity and spin.
struct LocalRows {
    a: (usize, Matrix3<f64>, Matrix3<f64>),
    b: Option<(usize, Matrix3<f64>, Matrix3<f64>)>,
}

fn main() -> ExitCode {
    let Some(path) = std::env::args().nth(1) else {
        eprintln!("usage: local_problems FILE < SCENE");
        return ExitCode::from(2);
    };
    match run(&path) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("local_problems: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run(path: &str) -> Result<(), LocalFailure> {
    let request: LocalRequest = serde_json::from_reader(std::io::stdin())?;
    let world = request.scene.world()?;
    let seconds = min_step_times(&request.scene, &world)?;
    let mut simulation = request.scene.begin(&world, NativeSolver::new(&world))?;
    let (mut record, mut previous) = (StepRecord::new(), StepSolution::default());
    let mut file = BufWriter::new(std::fs::File::create(path)?);
    for (k, seconds) in seconds.iter().enumerate() {
        simulation.step(&mut record)?;
        let wanted =
            k >= request.first && (k - request.first).is_multiple_of(request.stride.max(1));
        if wanted && !record.first().contacts.is_empty() {
            write_problem(&mut file, &world, &record, &previous, *seconds)?;
        }
        previous.copy_from(&record.first().solution);
    }
    file.flush()?;
    Ok(())
}

/// Processor time of every step (s), minimum over the runs.
fn min_step_times(scene: &BenchScene, world: &World) -> Result<Vec<f64>, LocalFailure> {
    let mut least = vec![f64::INFINITY; scene.steps];
    for _ in 0..RUNS {
        let (mut simulation, mut record) =
            (scene.begin(world, NativeSolver::new(world))?, StepRecord::new());
        for least in &mut least {
            let start = clock();
            simulation.step(&mut record)?;
            *least = least.min(clock() - start);
        }
    }
    Ok(least)
}

fn write_problem(
    file: &mut impl Write,
    world: &World,
    record: &StepRecord,
    previous: &StepSolution,
    seconds: f64,
) -> Result<(), LocalFailure> {
    let (h, contacts) = (world.time_step(), &record.first().contacts);
    let free: Vec<State> = record
        .states()
        .iter()
        .enumerate()
        .map(|(i, state)| world.free_flight(i, state, &Wrench::zero()))
        .collect();
    let rows: Vec<LocalRows> =
        contacts.iter().map(|c| LocalRows::new(record.states(), c)).collect();
    let n = contacts.len();
    let (mut w, mut q) = (DMatrix::zeros(3 * n, 3 * n), DVector::zeros(3 * n));
    let mut known = KeyIndex::new();
    let (mut mu, mut start) = (DVector::zeros(n), DVector::zeros(3 * n));
    for (i, contact) in contacts.iter().enumerate() {
        for (j, other) in rows.iter().enumerate() {
            w.fixed_view_mut::<3, 3>(3 * i, 3 * j).copy_from(&rows[i].response(world, other));
        }
        let gap = Vector3::x() * (contact.gap / h);
        q.fixed_rows_mut::<3>(3 * i).copy_from(&(rows[i].velocity(&free) + gap));
        mu[i] = contact.law.friction;
        if let Some(before) = known.find(&previous.contacts, &contact.key, i) {
            let impulse = normal_first(contact).tr_mul(&before.force) * h;
            start.fixed_rows_mut::<3>(3 * i).copy_from(&impulse);
        }
    }
    file.write_all(&(n as u64).to_le_bytes())?;
    file.write_all(&record.index.to_le_bytes())?;
    let numbers = w.iter().chain(&q).chain(&mu).chain(&start);
    for number in std::iter::once(&seconds).chain(numbers) {
        file.write_all(&number.to_le_bytes())?;
    }
    Ok(())
}

impl LocalRows {
    fn new(states: &[State], contact: &Contact) -> Self {
        let frame = normal_first(contact);
        let body = contact.key.body;
        let spin = frame.tr_mul(&contact.torque_map.transpose());
        let b = match contact.key.partner {
            Partner::Ground | Partner::Fixed(_) => None,
            Partner::Body(other) => {
                let (a, b) = (states[body].pose(), states[other].pose());
                let lever = b.rotation.tr_mul(&(a.position + contact.arm - b.position));
                let torque_map = lever.cross_matrix() * b.rotation.transpose();
                Some((other, -frame.transpose(), -frame.tr_mul(&torque_map.transpose())))
            }
        };
        Self { a: (body, frame.transpose(), spin), b }
    }

    fn sides(&self) -> impl Iterator<Item = &(usize, Matrix3<f64>, Matrix3<f64>)> {
        std::iter::once(&self.a).chain(&self.b)
    }

    /// Block of W between these rows and the rows `other`.
    fn response(&self, world: &World, other: &Self) -> Matrix3<f64> {
        let mut block = Matrix3::zeros();
        for (i, velocity, spin) in self.sides() {
            for (_, v, w) in other.sides().filter(|(j, ..)| i == j) {
                let body: &RigidBody = &world.bodies()[*i];
                block += velocity * v.transpose() / body.mass();
                block += spin * body.inertia_inverse() * w.transpose();
            }
        }
        block
    }

    /// Velocity J v (m/s).
    fn velocity(&self, states: &[State]) -> Vector3<f64> {
        let of_side = |(i, velocity, spin): &(usize, Matrix3<f64>, Matrix3<f64>)| {
            velocity * states[*i].velocity + spin * states[*i].spin
        };
        self.sides().map(of_side).sum()
    }
}

/// Contact frame F = (n, t₁, t₂).
fn normal_first(contact: &Contact) -> Matrix3<f64> {
    let axis = |k: usize| contact.frame.column(k).into_owned();
    Matrix3::from_columns(&[axis(2), axis(0), axis(1)])
}

/// Processor time of this process (s).
fn clock() -> f64 {
    let time = clock_gettime(ClockId::ProcessCPUTime);
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}
