//! Spring between a body and the pointer.
//!
//! The force is constant over short intervals and has few digits. It is an external load like those
//! of a scenario file, so the certificate covers it and a text can hold it.

use crate::session::Hit;
use nalgebra::Vector3;
use std::collections::BTreeMap;
use tumble_core::error::Error;
use tumble_core::mechanics::{Load, Polyline, RigidBody, State, Wrench};
use tumble_core::simulation::Simulation;

/// Size from which on bodies have the frequency and the interval below (m). Smaller bodies fall over
/// faster, so their springs are faster: the frequency is inversely proportional to the root of the
/// size, and the interval is proportional to the size.
const LARGE: f64 = 0.3;
/// Smallest size, over [`LARGE`].
const LEAST_SIZE: f64 = 0.1;
/// Frequency of the critically damped spring of a large body (rad/s).
const FREQUENCY: f64 = 12.0;
/// Interval of a constant force on a large body (s).
const INTERVAL: f64 = 0.01;
/// Share of the speed of the point that one interval may remove. It keeps the spring stable, whose
/// force is that of the start of the interval.
const MOST_DAMPED: f64 = 0.5;
/// Damping rate of the spin of a grabbed body (1/s).
const SPIN_DAMPING: f64 = 3.0;
/// Largest force over the moved mass (m/s²).
const MOST_ACCELERATION: f64 = 400.0;
/// Largest change of velocity in one step (m/s or rad/s). Scenario files allow loads up to 1e4.
const MOST_GAINED: f64 = 4e3;

/// A grabbed body.
#[derive(Debug, Clone)]
pub struct Grab {
    body: usize,
    /// Grabbed point (m, body frame).
    point: Vector3<f64>,
    /// Target of the point (m, world).
    target: Vector3<f64>,
    /// Mass of the body and of all bodies that joints connect to it (kg).
    moved_mass: f64,
    /// Frequency of the spring (rad/s).
    frequency: f64,
    /// First step of the pull.
    since: u64,
    /// Number of steps with the same force.
    interval: u64,
}

impl Grab {
    /// Grab of the body of a `hit` at its point, which is also the first target.
    pub fn new(simulation: &Simulation<'_>, hit: &Hit) -> Self {
        let pose = simulation.states()[hit.body].pose();
        let world = simulation.world();
        let size = (world.bodies()[hit.body].reach() / LARGE).clamp(LEAST_SIZE, 1.0);
        let steps = (INTERVAL * size / world.time_step()).round();
        Self {
            body: hit.body,
            point: pose.rotation.tr_mul(&(hit.point - pose.position)),
            target: hit.point,
            moved_mass: connected_mass(simulation, hit.body),
            frequency: FREQUENCY / size.sqrt(),
            since: simulation.index(),
            interval: steps.max(1.0) as u64,
        }
    }

    /// Index of the body.
    pub fn body(&self) -> usize {
        self.body
    }

    /// Grabbed point of the body at `state` (m, world).
    pub fn place(&self, state: &State) -> Vector3<f64> {
        let pose = state.pose();
        pose.position + pose.rotation * self.point
    }

    /// Target of the point (m, world).
    pub fn target(&self) -> Vector3<f64> {
        self.target
    }

    /// Force and torque of the spring, the damper and against gravity.
    fn wrench(&self, simulation: &Simulation<'_>) -> Wrench {
        let world = simulation.world();
        let (body, state) = (&world.bodies()[self.body], &simulation.states()[self.body]);
        let rotation = state.pose().rotation;
        let velocity = state.velocity + rotation * state.spin.cross(&self.point);
        let interval = self.interval as f64 * world.time_step();
        let most = 0.5 * MOST_DAMPED * mass_at(body, &self.point) / (self.frequency * interval);
        let mass = self.moved_mass.min(most);
        let spring = self.frequency * self.frequency * (self.target - self.place(state));
        let mut force =
            mass * (spring - 2.0 * self.frequency * velocity) - self.moved_mass * world.gravity();
        let limit = MOST_ACCELERATION * self.moved_mass;
        force *= (limit / force.norm().max(limit)).min(1.0);
        let torque = self.point.cross(&rotation.tr_mul(&force))
            - SPIN_DAMPING * (body.inertia() * state.spin);
        let h = world.time_step();
        let gained =
            (h * force.amax() / body.mass()).max(h * body.inertia_inverse().amax() * torque.amax());
        let share = (MOST_GAINED / gained.max(MOST_GAINED)).min(1.0);
        Wrench { force: (share * force).map(rounded), torque: (share * torque).map(rounded) }
    }
}

/// Lower bound of the mass that a force at a `point` of a body moves (kg).
fn mass_at(body: &RigidBody, point: &Vector3<f64>) -> f64 {
    let turning = point.norm_squared() * body.inertia_inverse().norm();
    1.0 / (1.0 / body.mass() + turning)
}

/// Mass of a body and of all that joints connect to it (kg).
fn connected_mass(simulation: &Simulation<'_>, body: usize) -> f64 {
    let world = simulation.world();
    let mut is_connected = vec![false; world.bodies().len()];
    is_connected[body] = true;
    loop {
        let mut grows = false;
        for joint in world.joints() {
            let Some(other) = joint.other() else { continue };
            if is_connected[joint.body()] != is_connected[other] {
                is_connected[joint.body()] = true;
                is_connected[other] = true;
                grows = true;
            }
        }
        if !grows {
            break;
        }
    }
    let bodies = world.bodies().iter().zip(&is_connected);
    bodies.filter(|(_, is_connected)| **is_connected).map(|(body, _)| body.mass()).sum()
}

/// Number with five significant digits, without a negative zero.
fn rounded(number: f64) -> f64 {
    format!("{number:.4e}").parse().unwrap_or(0.0) + 0.0
}

/// Constant force and torque from a step on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Segment {
    /// First step.
    pub from: u64,
    /// Force (N, world) and torque (N m, body frame).
    pub wrench: Wrench,
}

/// Number of a window, whose pointer can hold one body.
pub type Hand = u64;

/// Pulls on the bodies of a scene since its start.
#[derive(Debug, Clone, Default)]
pub struct Pulls {
    /// Grabs of the hands, at most one of each body.
    grabs: BTreeMap<Hand, Grab>,
    segments: BTreeMap<usize, Vec<Segment>>,
}

impl Pulls {
    /// Begins a pull. It ends the one of the hand before it, and a pull on the same body.
    pub(crate) fn grab(&mut self, hand: Hand, grab: Grab) {
        self.release(hand, grab.since);
        self.grabs.retain(|_, other| other.body != grab.body);
        self.grabs.insert(hand, grab);
    }

    /// Moves the target of a hand (m, world).
    pub(crate) fn pull(&mut self, hand: Hand, target: Vector3<f64>) {
        if let Some(grab) = self.grabs.get_mut(&hand) {
            grab.target = target;
        }
    }

    /// Ends the pull of a hand before step `index`.
    pub(crate) fn release(&mut self, hand: Hand, index: u64) {
        if let Some(grab) = self.grabs.remove(&hand) {
            self.set(grab.body, Segment { from: index, wrench: Wrench::zero() });
        }
    }

    /// Ends all pulls before step `index`.
    pub(crate) fn release_all(&mut self, index: u64) {
        while let Some((hand, _)) = self.grabs.first_key_value() {
            self.release(*hand, index);
        }
    }

    /// Computes the forces of the next step whose intervals begin.
    pub(crate) fn renew(&mut self, simulation: &Simulation<'_>) {
        let index = simulation.index();
        let due =
            self.grabs.values().filter(|grab| (index - grab.since).is_multiple_of(grab.interval));
        let wrenches: Vec<_> = due.map(|grab| (grab.body, grab.wrench(simulation))).collect();
        for (body, wrench) in wrenches {
            self.set(body, Segment { from: index, wrench });
        }
    }

    /// Adds a segment; one from the same step is replaced.
    fn set(&mut self, body: usize, segment: Segment) {
        let segments = self.segments.entry(body).or_default();
        segments.retain(|other| other.from < segment.from);
        segments.push(segment);
    }

    /// Sets the loads of the next step.
    pub(crate) fn apply(&self, simulation: &mut Simulation<'_>) -> Result<(), Error> {
        let index = simulation.index();
        for (body, segments) in &self.segments {
            let present = segments.iter().rev().find(|segment| segment.from <= index);
            let load = present.map_or(Ok(Load::none()), |segment| constant(&segment.wrench))?;
            simulation.set_load(*body, load)?;
        }
        Ok(())
    }

    /// Ends all pulls at step `index` and forgets later ones.
    pub(crate) fn forget_from(&mut self, index: u64) {
        self.grabs.clear();
        for segments in self.segments.values_mut() {
            segments.retain(|segment| segment.from < index);
            if segments.last().is_some_and(|last| last.wrench != Wrench::zero()) {
                segments.push(Segment { from: index, wrench: Wrench::zero() });
            }
        }
        self.segments.retain(|_, segments| !segments.is_empty());
    }

    /// The body in a hand.
    pub fn grabbed(&self, hand: Hand) -> Option<&Grab> {
        self.grabs.get(&hand)
    }

    /// Segments of the pulled bodies, by the index of the body.
    pub fn segments(&self) -> &BTreeMap<usize, Vec<Segment>> {
        &self.segments
    }
}

/// Load that does not change.
fn constant(wrench: &Wrench) -> Result<Load, Error> {
    if *wrench == Wrench::zero() {
        return Ok(Load::none());
    }
    let (force, torque) = (Polyline::constant(wrench.force)?, Polyline::constant(wrench.torque)?);
    Load::new(force, torque, Vector3::zeros())
}
