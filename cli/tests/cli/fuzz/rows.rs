//! Random step records for the trajectory writer.

use super::finite;
use crate::common::{state, tutorial_parameters};
use nalgebra::{Matrix3, Vector3};
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::select;
use tumble_core::contact::detection::all_contacts;
use tumble_core::mechanics::{RigidBody, State};
use tumble_core::simulation::{Interval, StepRecord};
use tumble_core::step::{ContactForce, StepReport, StepSolution, StepStatus};
use tumble_core::world::{Parameters, World};

const STATUSES: [StepStatus; 5] = [
    StepStatus::Free,
    StepStatus::Converged,
    StepStatus::Retried,
    StepStatus::Fallback,
    StepStatus::Failed,
];

/// Records of a run of one body with `points` contact points.
#[derive(Debug, Clone)]
pub struct Run {
    pub points: usize,
    pub records: Vec<StepRecord>,
}

pub const TIME_STEP: f64 = 0.002;

/// World of a body with `points` contact points in its plane z = 0 above level ground.
pub fn world(points: usize) -> World {
    let places: Vec<_> = (1..=points).map(|i| Vector3::new(i as f64, 0.5, 0.0)).collect();
    let bodies = vec![RigidBody::new(1.0, Matrix3::identity(), &places).unwrap()];
    World::new(Parameters { bodies, time_step: TIME_STEP, ..tutorial_parameters() }).unwrap()
}

/// State of the upright body with all contact points at height `z`.
fn upright(z: f64) -> State {
    state(&[0.0, 0.0, z, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
}

/// Strategy for numbers whose products of a few factors stay finite.
fn moderate() -> impl Strategy<Value = f64> {
    finite().prop_map(|number| number.abs().powf(0.25).copysign(number))
}

/// Force, slip and normal force of a contact.
type Found = ([f64; 3], [f64; 3], f64);

fn found() -> impl Strategy<Value = Found> {
    let three = || proptest::array::uniform3(moderate());
    (three(), three(), moderate())
}

/// Numbers of one row: initial state, final height, optional contacts and report.
#[derive(Debug, Clone)]
struct Numbers {
    state: Vec<f64>,
    height: f64,
    contacts: Vec<Option<Found>>,
    status: StepStatus,
    iterations: u32,
    dynamics: f64,
}

fn numbers(points: usize) -> impl Strategy<Value = Numbers> {
    let contacts = vec(prop_oneof![found().prop_map(Some), Just(None)], points);
    let report = (select(STATUSES.to_vec()), any::<u32>(), finite());
    (vec(finite(), 13), moderate(), contacts, report).prop_map(
        |(state, height, contacts, (status, iterations, dynamics))| {
            let dynamics = dynamics.abs();
            Numbers { state, height, contacts, status, iterations, dynamics }
        },
    )
}

fn record(points: usize, k: usize, numbers: Numbers) -> StepRecord {
    let mut record = end(k, &numbers.state);
    record.first_mut().solution = StepSolution::free(&[upright(numbers.height)]);
    let mut contacts = Vec::new();
    all_contacts(&world(points), &[upright(0.0)], &mut contacts);
    for (contact, found) in contacts.iter().zip(numbers.contacts) {
        let Some((force, slip, normal_force)) = found else { continue };
        let (key, force, slip) = (contact.key, force.into(), slip.into());
        record.first_mut().contacts.push(*contact);
        record.first_mut().solution.contacts.push(ContactForce {
            force,
            normal_force,
            slip,
            ..ContactForce::none(key)
        });
    }
    let Numbers { status, iterations, dynamics, .. } = numbers;
    record.first_mut().report = StepReport { iterations, ..StepReport::without_problem(status) };
    record.first_mut().certificate.dynamics = dynamics;
    record
}

/// Strategy for runs with 1 to 4 contact points, finite numbers and a last row without a step.
pub fn runs() -> impl Strategy<Value = Run> {
    (1..=4_usize, 0..=6_usize).prop_flat_map(|(points, steps)| {
        (vec(numbers(points), steps), vec(finite(), 13)).prop_map(move |(rows, last)| {
            let rows = rows.into_iter().enumerate();
            let mut records: Vec<_> = rows.map(|(k, row)| record(points, k, row)).collect();
            records.push(end(records.len(), &last));
            Run { points, records }
        })
    })
}

/// Last row of a run with index `k`.
fn end(k: usize, numbers: &[f64]) -> StepRecord {
    let states = vec![state(numbers)];
    let solution = StepSolution::free(&states);
    let mut record = StepRecord::from(Interval::new(states, Vec::new(), solution));
    record.index = k as u64;
    record
}
