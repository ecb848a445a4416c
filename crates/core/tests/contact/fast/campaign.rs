//! Collisions of random pieces, and statistics of their steps.

use super::own::{distance, fixed, overlap_by, part_way, turn};
use super::{V, is_solved, kinetic, run, v, world};
use crate::common::prelude::*;
use tumble_core::simulation::{Interval, UnphysicalCause};

/// Random piece: a ball, box, capsule, plate, rod, needle or hull.
pub fn piece(draws: &mut Draws) -> Piece {
    let kind = (7.0 * draws.unit()) as u32;
    let mut between = |low: f64, high: f64| low * (high / low).powf(draws.unit());
    let cuboid = |x: f64, y: f64, z: f64| Piece::cuboid(v(x, y, z)).unwrap();
    match kind {
        0 => Piece::sphere(between(0.005, 0.1)).unwrap(),
        1 => cuboid(between(0.02, 0.1), between(0.02, 0.1), between(0.02, 0.1)),
        2 => Piece::capsule(between(0.02, 0.2), between(0.005, 0.05)).unwrap(),
        3 => cuboid(between(0.05, 0.2), between(0.05, 0.2), between(0.0005, 0.002)),
        4 => cuboid(between(0.2, 0.5), between(0.005, 0.01), between(0.005, 0.01)),
        5 => cuboid(between(0.1, 0.3), between(0.0005, 0.001), between(0.0005, 0.001)),
        _ => {
            let size = between(0.03, 0.1);
            let points: Vec<V> = (0..12).map(|_| direction(draws) * size).collect();
            Piece::hull(&points, 0.0).unwrap()
        }
    }
}

pub fn direction(draws: &mut Draws) -> V {
    rotation(&draws.attitude()) * V::z()
}

/// Radius of a ball inside a piece [m].
fn inner(piece: &Piece) -> f64 {
    let core = piece.core();
    let depths = core.faces().iter().map(|face| face.offset - face.normal.dot(core.centre()));
    let depth = depths.fold(f64::INFINITY, f64::min);
    piece.radius() + if depth.is_finite() { depth } else { 0.0 }
}

/// Largest distance of a body's piece from its centre of mass [m].
pub fn reach(piece: &Piece) -> f64 {
    piece.core().vertices().iter().map(V::norm).fold(0.0, f64::max) + piece.radius()
}

/// Statistics of a series of collisions.
#[derive(Debug, Default)]
pub struct Found {
    /// Number of pairs that met.
    pub met: u32,
    /// Number of failed steps and of unphysical steps.
    pub failed: u32,
    pub wild: u32,
    /// Steps in which a pair overlaps deeply although no body turns by more than a radian. `passed`
    /// has the steps with a solved status, `marked` those reported as unphysical.
    pub passed: Vec<String>,
    pub marked: Vec<String>,
    /// Smallest turn in these steps [rad].
    pub least_turn: f64,
    /// Number of steps without a solution of pairs without a slender body: ‖I‖‖I⁻¹‖ at most 1000.
    pub failed_compact: u32,
    /// Number of steps that failed because their solution makes energy, also in shorter steps.
    pub gaining: u32,
    /// Number of failed steps with a single frictionless contact, and how many of them have a
    /// solution.
    pub sought: u32,
    pub solvable: u32,
    /// Contacts whose gap at k is below the overlap of the pieces at k.
    pub behind: Vec<String>,
    /// Largest growth of the kinetic energy in a failed step.
    pub growth: f64,
}

/// True if no solution of a step was found.
fn is_unsolved(record: &StepRecord) -> bool {
    let makes_energy = matches!(record.unphysical(), Some(UnphysicalCause::Gain { .. }));
    record.status() == StepStatus::Failed && !makes_energy
}

impl Found {
    /// Examines a step of two pieces. `b` belongs to the second body or is fixed.
    pub fn look(&mut self, name: &str, record: &StepRecord, a: &Piece, b: &Piece) {
        self.failed += u32::from(is_unsolved(record));
        self.gaining += u32::from(record.status() == StepStatus::Failed && !is_unsolved(record));
        self.wild += u32::from(record.status() == StepStatus::Wild);
        for taken in record.intervals() {
            self.look_within(name, record, taken, a, b);
        }
    }

    /// Examines an interval of a step. Between its ends, bodies move as straight as in one problem.
    fn look_within(
        &mut self,
        name: &str,
        record: &StepRecord,
        taken: &Interval,
        a: &Piece,
        b: &Piece,
    ) {
        let (from, to) = (&taken.states[..], &taken.solution.states[..]);
        let size = |piece: &Piece| piece.core().reach() + piece.radius();
        if let ([x, y], [x_end, y_end]) = (from, to) {
            // The pieces stay far from each other.
            let apart = (x.position - y.position).norm();
            let moved = (x_end.position - x.position).norm() + (y_end.position - y.position).norm();
            if taken.contacts.is_empty() && apart - moved > reach(a) + reach(b) {
                return;
            }
        }
        let place = |body: usize, share: f64| match from.get(body) {
            Some(state) => part_way(state, &to[body], share),
            None => fixed(),
        };
        let apart = distance((a, &place(0, 0.0)), (b, &place(1, 0.0)));
        for contact in &taken.contacts {
            // Equal faces are distinguished to 1e-7 of the size, and solvers leave an error of some
            // 1e-9.
            if apart > 0.0 && contact.gap < -2e-7 * size(a).min(size(b)) {
                let (k, gap) = (record.index, contact.gap);
                self.behind.push(format!("{name}, k = {k}: {gap:e}, {apart:e} m apart"));
            }
        }
        let turn = |body: usize| from.get(body).map_or(0.0, |state| turn(state, &to[body]));
        if record.status() == StepStatus::Failed || turn(0).max(turn(1)) > 1.0 {
            return;
        }
        // The allowed depth is a fraction of both thicknesses. Between the ends of a step whose
        // contacts hold there, it includes the deviation of turning points from the chord.
        let bulge = |body: usize, piece: &Piece| {
            let arm = piece.core().vertices().iter().map(V::norm).fold(0.0, f64::max);
            arm * turn(body).powi(2) / 8.0
        };
        let thick = 0.25 * (inner(a) + inner(b));
        let deep = |share: f64| {
            let between = share < 1.0 && !taken.contacts.is_empty();
            let depth = thick + if between { bulge(0, a) + bulge(1, b) } else { 0.0 };
            overlap_by((a, &place(0, share)), (b, &place(1, share)), depth)
        };
        if overlap_by((a, &place(0, 0.0)), (b, &place(1, 0.0)), thick) {
            // An earlier interval left this overlap.
            return;
        }
        if let Some(share) = (1..=40).map(|i| f64::from(i) / 40.0).find(|share| deep(*share)) {
            let (k, contacts) = (record.index, taken.contacts.len());
            let passed = if is_solved(record) { &mut self.passed } else { &mut self.marked };
            let turn = turn(0).max(turn(1));
            self.least_turn = self.least_turn.min(turn);
            passed.push(format!("{name}, k = {k}, {share}: {contacts} contacts, {turn} rad"));
        }
    }
}

/// Random pairs that fly at each other.
pub struct Pairs {
    pub seed: u32,
    /// Largest turn per step before they meet [rad].
    pub most_turn: f64,
    /// Smallest and largest speed [m/s].
    pub speeds: [f64; 2],
    /// Shortest and longest time step [s].
    pub steps: [f64; 2],
}

impl Pairs {
    /// Statistics of a thousand pairs.
    pub fn run(&self) -> Found {
        let mut draws = Draws::new(self.seed);
        let mut found = Found { least_turn: f64::INFINITY, ..Found::default() };
        for number in 0..1000 {
            self.fly(number, &mut draws, &mut found);
        }
        found
    }

    fn fly(&self, number: u32, draws: &mut Draws, found: &mut Found) {
        let between = |[low, high]: [f64; 2], unit: f64| low * (high / low).powf(unit);
        let pieces = [piece(draws), piece(draws)];
        let bodies = pieces
            .each_ref()
            .map(|p| RigidBody::solid(0.1 + draws.unit(), std::slice::from_ref(p)).unwrap().0);
        let h = between(self.steps, draws.unit());
        let speed = between(self.speeds, draws.unit());
        let [a, b] = bodies.each_ref().map(|body| {
            let most = self.most_turn * draws.unit() / h;
            (draws.attitude(), direction(draws) * most, body.pieces()[0].clone())
        });
        // After three and a half steps of free flight they would overlap.
        let way = direction(draws) * speed;
        let aside = direction(draws) * 0.5 * (inner(&a.2) + inner(&b.2));
        let start = |(q, spin, _): &(Vector4<f64>, V, Piece), position: V, velocity: V| State {
            position,
            attitude: q.normalize(),
            velocity,
            spin: *spin,
        };
        let apart = reach(&a.2) + reach(&b.2);
        let distance = (3.5 * h * speed).max(1.6 * apart);
        let steps = (distance / (h * speed) + 4.0).min(1000.0) as usize;
        let starts =
            [start(&a, aside - way * (distance / speed), way), start(&b, V::zeros(), V::zeros())];
        let friction = if number.is_multiple_of(3) { 0.0 } else { draws.unit() };
        let world = world(bodies.to_vec(), friction, h, 0.0);
        let records = run(&world, &starts, steps);
        found.met += u32::from(records.iter().any(|record| !record.first().contacts.is_empty()));
        for record in &records {
            found.look(&format!("pair {number}"), record, &a.2, &b.2);
            if record.status() == StepStatus::Failed {
                let [before, after] =
                    [record.states(), record.next_states()].map(|states| kinetic(&world, states));
                found.growth = found.growth.max(after / before - 1.0);
            }
            if is_unsolved(record) {
                let slender =
                    |body: &RigidBody| body.inertia().norm() * body.inertia_inverse().norm();
                let is_compact = bodies.iter().all(|body| slender(body) <= 1000.0);
                found.failed_compact += u32::from(is_compact);
                if friction == 0.0 {
                    found.seek(&world, record, speed);
                }
            }
        }
    }
}

impl Found {
    /// Searches for a solution of a failed step with a single frictionless contact. The impulse is
    /// up to ten times the one that stops both bodies at `speed` [m/s]. A solution closes or opens
    /// the gap at the end of the step, computed as free flight under a wrench.
    fn seek(&mut self, world: &World, record: &StepRecord, speed: f64) {
        let [contact] = record.first().contacts[..] else { return };
        let Partner::Body(other) = contact.key.partner else { return };
        let (a, b) = (&record.states()[contact.key.body], &record.states()[other]);
        let masses = world.bodies().iter().map(|body| 1.0 / body.mass());
        let stops = speed / masses.sum::<f64>();
        let gap = |impulse: f64| {
            let force = contact.normal() * (impulse / world.time_step());
            let arm = a.position + contact.arm - b.position;
            let torque = -b.pose().rotation.tr_mul(&arm.cross(&force));
            let on_a = Wrench { force, torque: contact.torque_map * force };
            let on_b = Wrench { force: -force, torque };
            let end =
                |body, state, wrench| -> Pose { world.free_flight(body, state, wrench).pose() };
            contact.gap_at(&end(contact.key.body, a, &on_a), Some(&end(other, b, &on_b)))
        };
        self.sought += 1;
        self.solvable += u32::from((0..2000).any(|i| gap(stops * 0.005 * f64::from(i)) >= 0.0));
    }
}
