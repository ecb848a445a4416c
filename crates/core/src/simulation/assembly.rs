//! Starts that do not fit their joints: the least change of places and velocities that makes them fit.
//!
//! What brings bodies together is a step itself, without weight, forces and contacts. From rest at X it ends in
//!
//! ```text
//! M (X⁺ − X)/h = Jᵀ p,   what is locked at X⁺ is where it is to be              (J9)
//! ```
//!
//! which moves bodies by impulses of the joints alone: to first order in the gaps the change that is least,
//! weighted by masses and moments of inertia. Velocities are projected by two steps of a very small h, with V
//! and with −V, whose mean change has no part of first order in h,
//!
//! ```text
//! V⁺ = ½ (S(X, V) − S(X, −V)),   S: the velocities after the step               (J10)
//! ```

use crate::contact::Candidates;
use crate::error::Error;
use crate::joint::{Axis, Drive, Joint, JointAxis};
use crate::mechanics::way::{LARGEST_TURN, Way};
use crate::mechanics::{RigidBody, Rotation, State, Wrench, largest};
use crate::solver::native::NativeSolver;
use crate::step::{Step, StepSolution, StepSolver, StepStatus};
use crate::world::{Parameters, World};
use nalgebra::Vector3;
use std::fmt;

/// What [`World::assemble`] changed: the largest of each over the bodies.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Assembly {
    /// How far a centre of mass was moved, m.
    pub place: f64,
    /// How far a body was turned, rad.
    pub turn: f64,
    /// The change of a velocity, m/s.
    pub velocity: f64,
    /// The change of a spin, rad/s.
    pub spin: f64,
}

impl fmt::Display for Assembly {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { place, turn, velocity, spin } = self;
        write!(
            f,
            "bodies were moved by up to {place:.3e} m and turned by up to {turn:.3e} rad, and their velocities \
             changed by up to {velocity:.3e} m/s and {spin:.3e} rad/s, so that all joints fit"
        )
    }
}

/// h of the step that moves, and of those that project velocities, s.
const MOVING: f64 = 1e-3;
const PROJECTING: f64 = 1e-6;

/// Steps from rest until all joints fit: the first one brings them together.
const MOST_STEPS: u32 = 8;

/// Parts of the way of a frame: the first one that is tried, and the least.
const FIRST_PART: f64 = 0.125;
const LEAST_PART: f64 = 1e-3;

/// What joints may be left apart, m and rad, besides rounding of places.
const APART: f64 = 1e-12;

impl World {
    /// The states nearest to `states`, one a body, that fit all joints: places and turns in which what is locked is
    /// where it is to be and limits are kept, changed by impulses of the joints alone, which is the least change weighted by
    /// masses to first order in the gaps; and velocities that leave it so, changed the least. What was changed is told
    /// beside. Contacts have no part in it.
    ///
    /// # Errors
    /// Another number of states than bodies, a state that [`State::checked`] refuses, and joints that do not come
    /// together from there, as those of a loop whose bodies are too short.
    pub fn assemble(&self, states: &[State]) -> Result<(Vec<State>, Assembly), Error> {
        let start = states.iter().map(State::checked).collect::<Result<Vec<_>, _>>()?;
        if start.len() != self.bodies().len() {
            let (field, count) = ("states to assemble", start.len());
            return Err(Error::Count { field, count, allowed: "one a body" });
        }
        let mut found = self.brought_together(&start)?;
        self.project(&start, &mut found)?;
        let mut assembly = Assembly::default();
        for (from, to) in start.iter().zip(&found) {
            let way = Way::between(from, to);
            assembly.place = assembly.place.max(way.shift().norm());
            assembly.turn = assembly.turn.max(way.angle());
            assembly.velocity = assembly.velocity.max((to.velocity - from.velocity).norm());
            assembly.spin = assembly.spin.max((to.spin - from.spin).norm());
        }
        Ok((found, assembly))
    }

    /// (J9): states at rest. Where that is too far for one step, frames of joints that hold a place go on from where they fit to
    /// where they are to be, as far at once as it can be.
    fn brought_together(&self, start: &[State]) -> Result<Vec<State>, Error> {
        let bare = self.bare(MOVING, |drive| Drive { limits: drive.limits, ..Drive::NONE })?;
        let at_once = bare.joined(start);
        let Err(why @ Error::NotAssembled { .. }) = at_once else { return at_once };
        let (mut now, mut left, mut part) = (start.to_vec(), 1.0, FIRST_PART);
        while left > 0.0 {
            let next = (left - part).max(0.0);
            let nearer = |joint: &Joint| match joint.nearer_frame(start, next) {
                Some(frame) => joint.clone().with_other_frame(frame),
                None => joint.clone(),
            };
            let between = bare.clone().with_joints(bare.joints().iter().map(nearer).collect())?;
            match between.with_gears(bare.gears().to_vec())?.joined(&now) {
                Ok(found) => (now, left, part) = (found, next, 2.0 * part),
                Err(Error::NotAssembled { .. }) if part > LEAST_PART => part *= 0.5,
                Err(Error::NotAssembled { .. }) => return Err(why),
                Err(other) => return Err(other),
            }
        }
        Ok(now)
    }

    /// The same by steps of this world of joints alone.
    fn joined(&self, start: &[State]) -> Result<Vec<State>, Error> {
        let bare = self;
        let mut solver = NativeSolver::new(bare);
        let mut now: Vec<_> = start.iter().map(at_rest).collect();
        for _ in 0..MOST_STEPS {
            let far = now.iter().map(|state| state.position.amax()).fold(0.0, largest);
            let Some((joint, place, turn)) = bare.worst_joint(&now) else { return Ok(now) };
            if place.max(turn) <= APART + 8.0 * f64::EPSILON * far {
                return Ok(now);
            }
            let next = taken(bare, &mut solver, &now)?;
            let turns = next.iter().map(|state| MOVING * state.spin.norm()).fold(0.0, largest);
            if turns > LARGEST_TURN || next.is_empty() {
                return Err(Error::NotAssembled { joint, place, turn });
            }
            now = next.iter().map(at_rest).collect();
        }
        let (joint, place, turn) = bare.worst_joint(&now).unwrap_or_default();
        Err(Error::NotAssembled { joint, place, turn })
    }

    /// (J10): gives `found` the velocities of `start`, changed as far as its joints ask.
    fn project(&self, start: &[State], found: &mut [State]) -> Result<(), Error> {
        let moves = |state: &State| state.velocity.amax().max(state.spin.amax()) > 0.0;
        if !start.iter().any(moves) {
            return Ok(());
        }
        let bare = self.bare(PROJECTING, |_| Drive::NONE)?;
        let mut solver = NativeSolver::new(&bare);
        let mut ended = |sign: f64| {
            let states: Vec<_> = start
                .iter()
                .zip(&*found)
                .map(|(of, at)| State { velocity: of.velocity * sign, spin: of.spin * sign, ..*at })
                .collect();
            taken(&bare, &mut solver, &states)
        };
        let (there, back) = (ended(1.0)?, ended(-1.0)?);
        if there.is_empty() || back.is_empty() {
            let (joint, place, turn) = bare.worst_joint(found).unwrap_or_default();
            return Err(Error::NotAssembled { joint, place, turn });
        }
        for ((state, there), back) in found.iter_mut().zip(&there).zip(&back) {
            state.velocity = 0.5 * (there.velocity - back.velocity);
            state.spin = 0.5 * (there.spin - back.spin);
        }
        Ok(())
    }

    /// The joint that is farthest off at `states`, by how much, m and rad; `None` without joints.
    fn worst_joint(&self, states: &[State]) -> Option<(usize, f64, f64)> {
        let errors = self.joints().iter().enumerate().map(|(joint, of)| {
            let (place, turn) = of.misfit(states).unwrap_or((f64::NAN, f64::NAN));
            (joint, place, turn)
        });
        // Of a gear, as its first joint's.
        let angles = self.angles_near(states, &[]);
        let of_gears = self.gears().iter().map(|gear| {
            let (of, off) = (gear.axes()[0], gear.error(self.joints(), states, &angles).abs());
            match of.axis {
                JointAxis::Linear(_) => (of.joint, off, 0.0),
                JointAxis::Angular(_) => (of.joint, 0.0, off),
            }
        });
        errors.chain(of_gears).max_by(|a, b| a.1.max(a.2).total_cmp(&b.1.max(b.2)))
    }

    /// The bodies and joints of this world alone, with steps of `time_step` (s) and what `kept` leaves of the drives.
    fn bare(&self, time_step: f64, kept: impl Fn(&Drive) -> Drive) -> Result<Self, Error> {
        let parameters = Parameters {
            bodies: self.bodies().iter().map(RigidBody::without_shape).collect(),
            ground: None,
            gravity: Vector3::zeros(),
            friction: 0.0,
            time_step,
            rotation: Rotation::Momentum,
        };
        let gears = self.gears().iter().map(|gear| match gear.drive() {
            None => *gear,
            Some(drive) => gear.with_drive(kept(drive)),
        });
        let gears = gears.collect();
        let kept = |axes: &[Axis; 3]| {
            axes.map(|axis| match axis {
                Axis::Locked => Axis::Locked,
                Axis::Free(drive) => Axis::Free(kept(&drive)),
            })
        };
        let joints = self.joints().iter();
        let joints = joints
            .map(|joint| joint.clone().with_axes(kept(joint.linear()), kept(joint.angular())));
        Self::new(parameters)?
            .with_joints(joints.map(Joint::without_push).collect())?
            .with_gears(gears)
    }
}

/// The state without velocities.
fn at_rest(state: &State) -> State {
    State { velocity: Vector3::zeros(), spin: Vector3::zeros(), ..*state }
}

/// The states after a step of `world`, in which nothing touches; none where it was not solved.
fn taken(world: &World, solver: &mut NativeSolver, states: &[State]) -> Result<Vec<State>, Error> {
    let wrenches = vec![Wrench::zero(); states.len()];
    let flights = states.iter().enumerate();
    let free: Vec<_> =
        flights.map(|(body, state)| world.free_flight(body, state, &wrenches[body])).collect();
    let previous = StepSolution::free(states);
    let step = Step {
        world,
        states,
        wrenches: &wrenches,
        free: &free,
        previous: &previous,
        earlier: None,
        interrupt: None,
    };
    let mut solution = StepSolution::default();
    let report = solver.solve(&step, &mut Candidates::new(), &mut solution)?;
    let solved = report.status != StepStatus::Failed;
    Ok(if solved { solution.states } else { Vec::new() })
}
