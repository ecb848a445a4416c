//! Fallbacks for a step that the native solver did not solve, or whose solution makes energy (eq. 32) or has a
//! contact that is misplaced or missing (18g, 18h): shorter intervals, or a motion that adds no energy.
//!
//! The step is taken in 2, 4, … 64 intervals of h/n until each of them is solved and they make no energy
//! together, unless a [certificate](super::infeasible_gap) says that no interval has a solution. Each
//! interval of n removes its share of the depths that are left, 1/n, 1/(n − 1), … 1.
//! Without half kicks, velocities are converted before and after them: the spin keeps its momentum P⁻
//! (eq. 34), and the velocity of flying bodies changes by ½ (h − h/n) g.
//!
//! A step with a misplaced or missing contact is kept, marked, if 2, 4, 8 and 16 intervals have one too. A point near the
//! solution that adds no energy is kept if 2 or 4 intervals are not solved either. The step is then failed. A step without such a point, and without solved intervals, is solved with the depths and joint errors of
//! its start. They stay, because their removal can be what has no solution. This step is failed as well, with their
//! residual. If it has no solution, islands that add no energy keep the best point of the solver. Other islands
//! that touch the ground or a fixed piece stand still. The rest move on as one rigid body with their
//! momentum P and angular momentum L:
//!
//! ```text
//! v = P/m + h g,   ω = I⁻¹ L
//! ```
//!
//! A rigid motion has the least kinetic energy for given P and L.

use super::inputs::Inputs;
use super::interval::Interval;
use super::islands::Islands;
use super::moment::Moment;
use super::one_interval;
use super::record::StepRecord;
use super::turning;
use super::unphysical::{Budget, EnergyCheck, EnergyGain, ROUNDING, UnphysicalCause};
use super::workspace::Workspace;
use super::{EnergyBalance, Motion, energy, unphysical};
use crate::contact::Contact;
use crate::error::Error;
use crate::joint::{Joint, JointForce};
use crate::mechanics::quaternion::{product, rotation};
use crate::mechanics::{RigidBody, Rotation, State};
use crate::step::{ContactForce, StepStatus};
use crate::world::{Partner, Span, World};
use nalgebra::{Matrix3, Vector3, Vector4};

/// Residual, as a multiple of the accepted one, below which the best point is kept. Without half kicks, shorter
/// intervals are less accurate, because they fall by a further ½ h² g.
const NEAR: f64 = 1e3;

/// Largest number of shorter intervals, also of a step that would keep its best point, or is marked for its contacts.
const MOST_PARTS: u32 = 64;
const KEPT_PARTS: u32 = 4;
const MARKED_PARTS: u32 = 16;

/// Number of iterations in shorter intervals after which no others are tried.
const MOST_ITERATIONS: u32 = 100_000;

/// Largest number of Newton steps for the spin. The map is nearly linear.
const MOST_NEWTON: u32 = 20;

/// Takes one step from `moment`: in one interval, in two at a [turn](super::turning), or in shorter ones if
/// it is not solved or makes energy. Returns the moment at the start of a step with a turn.
///
/// # Errors
/// Those of an interval; the moment is then unchanged.
pub(super) fn step(
    world: &mut World,
    moment: &mut Moment,
    inputs: &Inputs,
    workspace: &mut Workspace<'_>,
    record: &mut StepRecord,
) -> Result<Option<Box<Moment>>, Error> {
    let (taken, is_copy) = record.next_interval_at(workspace.rest.key());
    one_interval::interval(world, moment, inputs, workspace, None, taken, is_copy)?;
    let makes_energy = |check: &EnergyCheck| (0..taken.states.len()).any(|body| check.makes(body));
    let is_tried = taken.report.status == StepStatus::Failed
        || wrong_contacts(taken).is_some()
        || taken.gain.is_some() && makes_energy(&workspace.energy_check);
    let divided = turning::divide(world, moment, inputs, workspace, record);
    if divided.is_some() || !is_tried {
        if divided.is_none() && workspace.rest.stays() {
            record.set_rest(workspace.rest.key());
        }
        return Ok(divided);
    }
    let taken = &record.intervals()[0];
    world.set_before(taken.before.iter().copied());
    let Some(failure) = Failure::find(world, workspace, taken) else { return Ok(None) };
    record.unsolved.extend(failure.bodies());
    let keeps_at_once = failure.is_kept && !world.has_half_kicks();
    let end = failure.is_marked.then(|| moment.clone());
    if keeps_at_once || !moment.move_back(record.first()) {
        return Ok(None);
    }
    // The interrupt flag is not checked here, because an external solver could not repeat its part with
    // the same bits.
    let inputs = inputs.uninterrupted();
    let most_parts = match (failure.is_squeezed, failure.is_kept) {
        (true, _) => 0,
        (false, _) if failure.is_marked => MARKED_PARTS,
        (false, true) => KEPT_PARTS,
        _ if failure.bodies().all(|body| moment.keeps_failing(body)) => KEPT_PARTS,
        (false, false) => MOST_PARTS,
    };
    let (mut parts, mut iterations) = (2, 0);
    while parts <= most_parts && iterations < MOST_ITERATIONS {
        let start = Moment { search: Box::default(), ..moment.clone() };
        if let Some(end) = in_parts(parts, world, start, &inputs, workspace, &failure, record) {
            *moment = end;
            workspace.forget();
            world.set_span(None);
            return Ok(None);
        }
        let spent = record.intervals()[1..].iter().map(|taken| taken.report.iterations);
        iterations += spent.sum::<u32>();
        record.truncate(1);
        parts *= 2;
    }
    world.set_span(None);
    if let Some(end) = end {
        record.unsolved.clear();
        *moment = end;
        workspace.forget();
        return Ok(None);
    }
    world.set_before(moment.arrivals.iter().map(|arrival| arrival.length));
    inputs.drive_joints(world, moment);
    workspace.forget();
    let keeps_errors = failure.has_errors && !failure.is_kept;
    if keeps_errors && keep_errors(world, moment, &inputs, workspace, &failure, record) {
        return Ok(None);
    }
    let taken = &mut record.intervals_mut()[0];
    hold_energy(world, moment, &inputs, workspace, &failure, taken);
    Ok(None)
}

/// Ends the unsolved interval `taken` from `moment`, with a motion that adds no energy.
fn hold_energy(
    world: &World,
    moment: &mut Moment,
    inputs: &Inputs,
    workspace: &mut Workspace<'_>,
    failure: &Failure,
    taken: &mut Interval,
) {
    failure.hold_energy(world, workspace, taken);
    one_interval::measure_again(world, moment, workspace, taken);
    one_interval::finish(world, moment, inputs, workspace, taken);
    workspace.rest.end();
}

/// Ends the interval `taken` from `before` to `moment`, which was solved with the depths and joint errors of
/// its start because their removal has no solution. It counts as one of `world` that removes them. If it
/// has no solution either, its motion adds no energy.
pub(super) fn end_infeasible(
    world: &World,
    before: Moment,
    moment: &mut Moment,
    inputs: &Inputs,
    workspace: &mut Workspace<'_>,
    taken: &mut Interval,
) {
    let is_solved = taken.report.status.is_solved();
    certify_errors(world, moment, workspace, taken);
    if let Some(failure) = Failure::find(world, workspace, taken).filter(|_| !is_solved) {
        *moment = before;
        hold_energy(world, moment, inputs, workspace, &failure, taken);
    }
}

/// A step that was not solved or makes energy. Flags have one entry per body.
struct Failure {
    /// Islands that are not solved, or that make more energy than a step may.
    unsolved: Vec<bool>,
    /// Islands that gain energy.
    gains: Vec<bool>,
    /// Largest gain of an island that makes more than a step may.
    cause: Option<UnphysicalCause>,
    /// Islands that touch the ground or a fixed piece, or have a held body.
    stands: Vec<bool>,
    islands: Islands,
    /// True if the point found is kept: near the solution, and without added energy.
    is_kept: bool,
    /// True if a body has too little room.
    is_squeezed: bool,
    /// True if contacts or joints have errors at the start that alone exceed the accepted residual.
    has_errors: bool,
    /// True if it is solved, and its contacts are not those of its pieces or its gain is that of an impact (32c). Then
    /// it is kept, marked, if shorter intervals do not help.
    is_marked: bool,
}

/// Objects between which a solved interval has a contact that is misplaced, or lacks one.
fn wrong_contacts(taken: &Interval) -> Option<[Partner; 2]> {
    match taken.unphysical {
        Some(UnphysicalCause::Misplaced { between, .. } | UnphysicalCause::Missed { between })
            if taken.report.status == StepStatus::Wild =>
        {
            Some(between)
        }
        _ => None,
    }
}

impl Failure {
    /// Examines the last interval `taken`. `None` if it is kept as a step of its kind: for other solvers,
    /// and without an island that is not solved.
    fn find(world: &World, workspace: &mut Workspace<'_>, taken: &Interval) -> Option<Self> {
        let Workspace { motion, energy_check, certifier, .. } = workspace;
        let Motion::Contact { solver, .. } = motion else { return None };
        let bodies = taken.states.len();
        let has_failed = taken.report.status == StepStatus::Failed;
        let accepted = solver.accepted_residual();
        let is_near = taken.certificate.residual() <= NEAR * accepted;
        // Steps of other solvers are kept.
        let solver = solver.islands()?;
        let misplaced = wrong_contacts(taken);
        if has_failed || misplaced.is_some() {
            let forces = taken.solution.forces();
            certifier.contact_step(world, &taken.claim(), taken.solution.loads());
            let motions = certifier.joint_motions();
            energy_check.count(world, &taken.claim(), motions, forces, 0.0, &[]);
        }
        // The certificate can reject an interval that the solver considers solved.
        let all_are = (0..bodies).all(|body| solver.is_solved(body));
        let is_unsolved = |body| has_failed && (all_are || !solver.is_solved(body));
        let has_wrong = |body| misplaced.is_some_and(|of| of.contains(&Partner::Body(body)));
        let is_tried = |body| is_unsolved(body) || energy_check.makes(body) || has_wrong(body);
        let lags = |body| !energy_check.makes(body) || energy_check.lags(body);
        let unsolved: Vec<_> = (0..bodies).map(is_tried).collect();
        if !unsolved.contains(&true) {
            return None;
        }
        let gains: Vec<_> = (0..bodies).map(|body| energy_check.gains(body)).collect();
        let makes = |gain: &EnergyGain| energy_check.makes(gain.body);
        let cause = energy_check.largest_gain().filter(makes);
        let mut islands = Islands::default();
        islands.find(bodies, taken.contacts.iter().map(|contact| &contact.key), world);
        Some(Self {
            is_kept: is_near && !(0..bodies).any(|body| unsolved[body] && gains[body]),
            stands: standing(world, &islands, taken),
            unsolved,
            gains,
            cause: cause.map(|EnergyGain { body, energy }| UnphysicalCause::Gain { body, energy }),
            islands,
            is_squeezed: taken.infeasible_gap.is_some(),
            has_errors: has_errors(world, taken, world.time_step() * accepted),
            is_marked: !has_failed && (misplaced.is_some() || (0..bodies).all(lags)),
        })
    }

    /// Bodies of unsolved islands.
    fn bodies(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.unsolved.len()).filter(|body| self.unsolved[*body])
    }

    /// Replaces the motion of islands with unsolved bodies that add energy by one that does not, and
    /// certifies `taken` again.
    fn hold_energy(&self, world: &World, workspace: &mut Workspace<'_>, taken: &mut Interval) {
        let Self { unsolved, gains, stands, islands, .. } = self;
        let Interval { states, contacts, solution, .. } = &mut *taken;
        let bodies = states.len();
        for (label, &stands) in stands.iter().enumerate() {
            let members: Vec<_> =
                (0..bodies).filter(|body| islands.label(*body) == label).collect();
            if !members.iter().any(|body| unsolved[*body] && gains[*body]) {
                continue;
            }
            let motion = (!stands).then(|| RigidMotion::from_members(world, states, &members));
            for &body in &members {
                let state = &states[body];
                solution.states[body] = match &motion {
                    Some(motion) => motion.moved(world, state),
                    None => State { velocity: Vector3::zeros(), spin: Vector3::zeros(), ..*state },
                };
            }
            let is_member = |body: usize| islands.label(body) == label;
            for (place, force) in solution.contacts.iter_mut().enumerate() {
                if is_member(force.key.body) {
                    *force = ContactForce::none(force.key);
                    solution.moments.get_mut(place).into_iter().for_each(|moment| moment.fill(0.0));
                }
            }
            for (force, joint) in solution.joints.iter_mut().zip(world.joints()) {
                if is_member(joint.body()) {
                    *force = JointForce::none(force.angles);
                }
            }
            for (force, gear) in solution.gears.iter_mut().zip(world.gears()) {
                if is_member(world.joints()[gear.axes()[0].joint].body()) {
                    *force = 0.0;
                }
            }
        }
        for (force, contact) in solution.contacts.iter_mut().zip(contacts) {
            force.normal_force = contact.normal().dot(&force.force);
            force.slip = contact.slip(world, states, &solution.states);
        }
        for (force, joint) in solution.joints.iter_mut().zip(world.joints()) {
            if let Some(at) = joint.coordinates(&solution.states) {
                force.angles = joint.counted(&at, &force.angles);
            }
        }
        taken.report.status = StepStatus::Failed;
        taken.unphysical = self.cause;
        taken.gain = None;
        let Workspace { certifier, .. } = workspace;
        taken.certificate = certifier.contact_step(world, &taken.claim(), taken.solution.loads());
    }
}

/// True if a contact of `taken` begins deeper than `limit` (m), or a joint off by more.
fn has_errors(world: &World, taken: &Interval, limit: f64) -> bool {
    let is_off = |joint: &Joint| {
        let reach = world.bodies()[joint.body()].reach();
        joint.error(&taken.states).is_some_and(|(place, turn)| place + reach * turn > limit)
    };
    taken.contacts.iter().any(|contact| contact.gap < -limit) || world.joints().iter().any(is_off)
}

/// Solves the step from `moment` with the depths and joint errors of its start, which stay. It replaces the
/// interval in `record` as a failed one. Returns false if there is no such solution; then nothing changes.
fn keep_errors(
    world: &mut World,
    moment: &mut Moment,
    inputs: &Inputs,
    workspace: &mut Workspace<'_>,
    failure: &Failure,
    record: &mut StepRecord,
) -> bool {
    let infeasible_gap = record.first().infeasible_gap.clone();
    let mut end = Moment { search: Box::default(), ..moment.clone() };
    let length = world.whole_step();
    let span = Span { since: 0.0, length, usual: f64::INFINITY, is_retry: false };
    let taken = record.next_interval();
    let ended =
        one_interval::interval(world, &mut end, inputs, workspace, Some(span), taken, false);
    world.set_span(None);
    world.set_before(moment.arrivals.iter().map(|arrival| arrival.length));
    workspace.forget();
    if ended.is_err() || !taken.report.status.is_solved() {
        record.truncate(1);
        return false;
    }
    (taken.span, taken.part, taken.gain) = (None, None, None);
    (taken.infeasible_gap, taken.unphysical) = (infeasible_gap, failure.cause);
    certify_errors(world, &mut end, workspace, taken);
    *moment = end;
    record.remove_first();
    true
}

/// Certifies `taken`, which was solved with the depths and joint errors of its start, as an interval of `world`
/// that removes them. It ends at `moment`.
fn certify_errors(
    world: &World,
    moment: &mut Moment,
    workspace: &mut Workspace<'_>,
    taken: &mut Interval,
) {
    taken.report.status = StepStatus::Failed;
    taken.contacts.iter_mut().for_each(Contact::release);
    let Workspace { certifier, .. } = &mut *workspace;
    taken.certificate = certifier.contact_step(world, &taken.claim(), taken.solution.loads());
    one_interval::measure_again(world, moment, workspace, taken);
    moment.is_infeasible = taken.infeasible_gap.is_some();
    workspace.forget();
}

/// True per body if its island touches the ground or a fixed piece, or has a held body.
fn standing(world: &World, islands: &Islands, taken: &Interval) -> Vec<bool> {
    let bodies = taken.states.len();
    let mut stands = vec![false; bodies];
    for body in (0..bodies).filter(|body| world.is_held(*body)) {
        stands[islands.label(body)] = true;
    }
    for contact in &taken.contacts {
        stands[islands.label(contact.key.body)] |= contact.key.partner.body().is_none();
    }
    for joint in world.joints() {
        stands[islands.label(joint.body())] |= joint.other().is_none();
    }
    (0..bodies).map(|body| stands[islands.label(body)]).collect()
}

/// Takes the step from `start` in `parts` shorter intervals, and returns the moment at its end. They
/// replace the interval in `record`. Returns `None` if one of them is not solved, or if they make energy
/// together.
fn in_parts(
    parts: u32,
    world: &mut World,
    start: Moment,
    inputs: &Inputs,
    workspace: &mut Workspace<'_>,
    failure: &Failure,
    record: &mut StepRecord,
) -> Option<Moment> {
    let h = world.whole_step();
    let length = h / f64::from(parts);
    world.set_span(None);
    let states = start.now.states.clone();
    let first_energy = energy::total(world, &states);
    let mut moment = start;
    if !world.has_half_kicks() {
        moment.now.states = converted(world, failure, &states, h, length)?;
        moment.arrivals.iter_mut().for_each(|arrival| arrival.length = length);
    }
    moment.forget_past();
    workspace.forget();
    let mut budget = Budget::default();
    for part in 0..parts {
        let since = f64::from(part) * length;
        // Each interval removes its share of what is left of a depth.
        let usual = length * f64::from(parts - part);
        let span = Span { since, length, usual, is_retry: true };
        let taken = record.next_interval();
        one_interval::interval(world, &mut moment, inputs, workspace, Some(span), taken, false)
            .ok()?;
        if !taken.report.status.is_solved() {
            return None;
        }
        if taken.report.status != StepStatus::Free {
            budget.add(&workspace.energy_check.sum(&failure.unsolved));
        }
        taken.report.status = StepStatus::Substepped;
        if let Some(part) = &mut taken.part {
            part.changeable = world.changeable();
        }
    }
    if budget.is_made() {
        return None;
    }
    world.set_span(None);
    moment.forget_past();
    record.remove_first();
    if !world.has_half_kicks() {
        let end = end_of_steps(world, &mut moment, failure, &states, parts, &mut budget)?;
        let last = record.intervals().len() - 1;
        for (place, taken) in record.intervals_mut().iter_mut().enumerate() {
            let energies = [(place == 0).then_some(first_energy), (place == last).then_some(end)];
            taken.part.iter_mut().for_each(|part| part.energies = energies);
        }
    }
    let energy = largest_gain(world, record, &budget);
    let body = failure.bodies().next().unwrap_or(0);
    if let [.., last] = record.intervals_mut() {
        last.gain = (energy > 0.0).then_some(EnergyGain { body, energy });
    }
    Some(moment)
}

/// Energy that the intervals of `record` gain together (J): that of their problems, or the rise between rows beyond
/// loads, drives and moving surfaces, if it is larger. 0 for rounding errors.
fn largest_gain(world: &World, record: &StepRecord, budget: &Budget) -> f64 {
    let supplied = record.intervals().iter().map(|taken| {
        let world = taken.world(world);
        let EnergyBalance { loads, drives, friction, .. } = taken.balance(&world);
        loads + drives + if world.has_surfaces() { friction.max(0.0) } else { 0.0 }
    });
    let supplied: f64 = supplied.sum();
    let [start, end] = record.energies(world);
    let rise = end - start - supplied;
    let made = if budget.gains() { budget.gained } else { 0.0 };
    if rise > ROUNDING * (start.abs() + end.abs()) { made.max(rise) } else { made }
}

/// Velocities of the whole steps at the end of `moment`, which was reached in `parts` from `states`, in steps
/// without half kicks. Returns the energy there (J).
fn end_of_steps(
    world: &World,
    moment: &mut Moment,
    failure: &Failure,
    states: &[State],
    parts: u32,
    budget: &mut Budget,
) -> Option<f64> {
    let h = world.time_step();
    let length = h / f64::from(parts);
    let mut ends = converted(world, failure, &moment.now.states, length, h)?;
    budget.gained = failure.slow_standing(world, states, &mut ends, parts, budget.gained);
    moment.now.states = ends;
    moment.arrivals.iter_mut().for_each(|arrival| arrival.length = h);
    Some(energy::total(world, &moment.now.states))
}

/// Converts `states` from intervals of length `from` to those of length `to` (s), for steps without half
/// kicks.
fn converted(
    world: &World,
    failure: &Failure,
    states: &[State],
    from: f64,
    to: f64,
) -> Option<Vec<State>> {
    let bodies = world.bodies().iter().zip(states).zip(&failure.stands);
    bodies
        .map(|((body, state), stands)| same_momentum(world, body, state, !stands, from, to))
        .collect()
}

impl Failure {
    /// Slows the standing unsolved bodies down at the `ends` of the step from `states`, alike, so that
    /// they gain no energy. Besides the `made` energy of the `parts` (J) they gain, because they keep
    /// their velocities in spite of the other length (35),
    ///
    /// ```text
    /// Σ ½ m (h − h/n) g·(v⁺ − v)
    /// ```
    ///
    /// Returns the energy that is left: bodies that are at rest at the end may be higher (J).
    fn slow_standing(
        &self,
        world: &World,
        states: &[State],
        ends: &mut [State],
        parts: u32,
        made: f64,
    ) -> f64 {
        let h = world.time_step();
        let (mut gained, mut kinetic, mut lag) = (made.max(0.0), 0.0, 0.0);
        let moves = |body: &usize| self.stands[*body] && !world.is_held(*body);
        let bodies: Vec<_> = self.bodies().filter(moves).collect();
        for &index in &bodies {
            let (body, end) = (&world.bodies()[index], &ends[index]);
            let fall = world.gravity() * (0.5 * h * body.mass());
            let faster = end.velocity - states[index].velocity;
            gained += fall.dot(&faster) * (1.0 - 1.0 / f64::from(parts));
            kinetic += unphysical::kinetic_energy(world, body, end);
            lag += fall.dot(&end.velocity);
        }
        if gained > 0.0 && kinetic > 0.0 {
            // Energy (35) at s times the velocities: s² T + s Σ ½ m h g·v.
            let root = (lag * lag + 4.0 * kinetic * (kinetic + lag - gained)).max(0.0).sqrt();
            let slower = ((root - lag) / (2.0 * kinetic)).clamp(0.0, 1.0);
            for index in bodies {
                ends[index].velocity *= slower;
                ends[index].spin *= slower;
            }
            gained -= (1.0 - slower) * ((1.0 + slower) * kinetic + lag);
        }
        gained.max(0.0)
    }
}

/// Converts `state` from intervals of length `from` to those of length `to` (s). The spin keeps its
/// momentum. A body that `flies` gets the velocity of the same fall, since velocities lag half an
/// interval (eq. 35). Returns `None` if no spin has this momentum, as for many radians per interval.
fn same_momentum(
    world: &World,
    body: &RigidBody,
    state: &State,
    flies: bool,
    from: f64,
    to: f64,
) -> Option<State> {
    let (form, inertia) = (world.rotation(), body.inertia());
    let mut velocity = state.velocity;
    if flies && form == Rotation::Momentum {
        velocity += 0.5 * (from - to) * world.gravity();
    }
    let wanted = form.momentum(inertia, &state.spin, from);
    let mut spin = state.spin;
    for _ in 0..MOST_NEWTON {
        let off = form.momentum(inertia, &spin, to) - wanted;
        if off.norm() <= 8.0 * f64::EPSILON * wanted.norm() {
            return Some(State { velocity, spin, ..*state });
        }
        spin -= form.momentum_slope(inertia, &spin, to).try_inverse()? * off;
    }
    None
}

/// Rigid motion of a group of bodies.
struct RigidMotion {
    centre: Vector3<f64>,
    velocity: Vector3<f64>,
    /// Angular velocity, world frame.
    spin: Vector3<f64>,
}

impl RigidMotion {
    /// Rigid motion with the linear and angular momentum of the group. No motion with these has less kinetic
    /// energy, so none is added.
    fn from_members(world: &World, states: &[State], members: &[usize]) -> Self {
        let of = |body: usize| (&world.bodies()[body], &states[body]);
        let mass: f64 = members.iter().map(|body| of(*body).0.mass()).sum();
        let weighted = |vector: fn(&State) -> Vector3<f64>| -> Vector3<f64> {
            let parts = members.iter().map(|body| of(*body));
            parts.map(|(body, state)| body.mass() * vector(state)).sum::<Vector3<f64>>() / mass
        };
        let (centre, velocity) =
            (weighted(|state| state.position), weighted(|state| state.velocity));
        let (mut inertia, mut momentum) = (Matrix3::zeros(), Vector3::zeros());
        for (body, state) in members.iter().map(|body| of(*body)) {
            let turn = rotation(&state.attitude);
            let arm = state.position - centre;
            let own = turn * body.inertia() * turn.transpose();
            inertia += own
                + body.mass() * (arm.norm_squared() * Matrix3::identity() - arm * arm.transpose());
            // Momentum I ω of the instant: that of a step is unbounded for turns of several radians.
            let about = body.inertia() * state.spin;
            momentum += turn * about + body.mass() * arm.cross(&(state.velocity - velocity));
        }
        let spin = inertia.try_inverse().map_or(Vector3::zeros(), |inverse| inverse * momentum);
        Self { centre, velocity: velocity + world.gravity() * world.time_step(), spin }
    }

    /// State of a body of the group after the step.
    fn moved(&self, world: &World, state: &State) -> State {
        let h = world.time_step();
        let angle = h * self.spin.norm();
        let arm = state.position - self.centre;
        let (sine, cosine) = libm::sincos(0.5 * angle);
        let axis = if angle > 0.0 { self.spin / self.spin.norm() } else { Vector3::zeros() };
        let turn = Vector4::new(cosine, sine * axis[0], sine * axis[1], sine * axis[2]);
        let attitude = product(&turn, &state.attitude).normalize();
        let arm = rotation(&turn) * arm;
        State {
            position: self.centre + h * self.velocity + arm,
            attitude,
            velocity: self.velocity + self.spin.cross(&arm),
            spin: rotation(&attitude).transpose() * self.spin,
        }
    }
}
