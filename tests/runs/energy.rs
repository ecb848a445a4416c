//! Energy of recorded steps, computed from the states alone.

use crate::common::prelude::*;
use crate::common::turning::turned_momentum;
use std::fmt;
use std::io;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use tumble_scene::scene::Scene;

/// Largest energy that a passive step may make, relative to its kinetic energy.
const SHARE: f64 = 1e-2;
/// Largest energy that a passive step at rest may make [J].
const LEAST: f64 = 1e-5;

/// Kinetic energy ½ m v² + ½ ω·I ω [J].
fn kinetic(world: &World, states: &[State]) -> f64 {
    let bodies = world.bodies().iter().zip(states);
    let of = bodies.map(|(body, state)| {
        let spinning = state.spin.dot(&(body.inertia() * state.spin));
        0.5 * (body.mass() * state.velocity.norm_squared() + spinning)
    });
    of.sum()
}

/// Energy that free motion conserves [J], with velocities of the middle of an interval of length h [s] of each
/// body,
///
/// ½ m (v·v + h g·v) + ½ π·I⁻¹ π − m g·r,   π = P⁻(ω)
pub fn total(world: &World, states: &[State], lengths: &[f64]) -> f64 {
    let g = world.gravity();
    let bodies = world.bodies().iter().zip(states).zip(lengths);
    let of = bodies.map(|((body, state), &h)| {
        let momentum = turned_momentum(body.inertia(), &state.spin, -h);
        let turning = momentum.dot(&(body.inertia_inverse() * momentum));
        let moving = body.mass() * state.velocity.dot(&(state.velocity + h * g));
        0.5 * (moving + turning) - body.mass() * g.dot(&state.position)
    });
    of.sum()
}

/// Kinetic and potential energy at the stored velocities [J].
fn unlagged(world: &World, states: &[State]) -> f64 {
    let bodies = world.bodies().iter().zip(states);
    let lifted = bodies.map(|(body, state)| -body.mass() * world.gravity().dot(&state.position));
    kinetic(world, states) + lifted.sum::<f64>()
}

/// Scene of a file's text.
pub fn scene(text: &str) -> Scene {
    let none = |_: &Path, _: u64| Err(io::ErrorKind::NotFound.into());
    Scene::from_text(text, Path::new("scene.toml"), &[], &none).unwrap()
}

/// Steps of passive scenes.
#[derive(Debug, Default)]
pub struct PassiveSteps {
    pub steps: usize,
    pub substepped: usize,
    pub wild: usize,
    /// Failed steps: scene, step and cause.
    pub failed: Vec<String>,
    /// Steps that make energy: scene, step, status and gain [J].
    pub gains: Vec<String>,
    /// Solved steps with a residual above the accepted one.
    pub inexact: Vec<String>,
    /// Largest gain, relative to the kinetic energy and [`LEAST`].
    pub largest: f64,
}

impl PassiveSteps {
    /// Takes `steps` steps of the scene `text` and examines them.
    pub fn run(&mut self, name: &str, text: &str, steps: usize) {
        let scene = scene(text);
        let world = &scene.world;
        let mut simulation = scene.simulation(&Arc::new(AtomicBool::new(false))).unwrap();
        let mut record = StepRecord::new();
        for k in 0..steps {
            simulation.step(&mut record).unwrap();
            self.add(name, k, world, &record);
        }
    }

    fn add(&mut self, name: &str, k: usize, world: &World, record: &StepRecord) {
        let status = record.status();
        let [before, after] = [record.states(), record.next_states()];
        let size = kinetic(world, before).max(kinetic(world, after));
        let gain = match status {
            // Its velocities do not belong to a step, and do not lag.
            StepStatus::Failed => unlagged(world, after) - unlagged(world, before),
            _ => {
                let bodies = before.len();
                let last = vec![record.last().length; bodies];
                let mut first = record.first().before.clone();
                first.resize(bodies, record.first().length);
                // Forces that carry a weight act in half of the difference of changing lengths, which
                // the energy of free motion does not have.
                let carried = |(body, state): (&RigidBody, &State)| {
                    body.mass() * world.gravity().dot(&state.velocity).abs()
                };
                let power = [before, after]
                    .map(|states| -> f64 { world.bodies().iter().zip(states).map(carried).sum() });
                let power = power[0].max(power[1]);
                let longer = first.iter().zip(&last).map(|(before, own)| (before - own).abs());
                let unknown = 0.5 * power * longer.fold(0.0, f64::max);
                total(world, after, &last) - total(world, before, &first) - unknown
            }
        };
        let residual = record.residual();
        self.steps += 1;
        self.substepped += usize::from(status == StepStatus::Substepped);
        self.wild += usize::from(status == StepStatus::Wild);
        if status == StepStatus::Failed {
            self.failed.push(format!("{name}, k = {k}: {residual:.1e} {:?}", record.unphysical()));
        }
        let is_allowed = gain <= SHARE * size + LEAST;
        if !is_allowed {
            self.gains.push(format!("{name}, k = {k}, {status}: {gain:.2e} of {size:.2e} J"));
        }
        self.largest = self.largest.max(gain / (SHARE * size + LEAST) * SHARE);
        let is_solved = !matches!(status, StepStatus::Failed | StepStatus::Substepped);
        if is_solved && residual > 1e-9 * world.speed_scale().max(1.0) {
            self.inexact.push(format!("{name}, k = {k}, {status}: {residual:.1e}"));
        }
    }
}

impl fmt::Display for PassiveSteps {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { steps, substepped, wild, failed, gains, inexact, largest } = self;
        writeln!(
            f,
            "{steps} steps, {substepped} substepped, {wild} wild, {} failed",
            failed.len()
        )?;
        writeln!(f, "largest gain {largest:.1e}; making energy {gains:#?}")?;
        writeln!(f, "failed {failed:#?}\ninexact {inexact:#?}")
    }
}
