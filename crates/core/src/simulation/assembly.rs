//! Assembly of joints: the smallest change of poses and velocities that satisfies all joints.
//!
//! Bodies are brought together by a time step without gravity, loads and contacts. From rest at X
//! it ends in
//!
//! ```text
//! M (X⁺ − X)/h = Jᵀ p,   locked axes satisfied at X⁺              (J9)
//! ```
//!
//! Only joint impulses move the bodies. To first order in the joint errors this is the smallest
//! change in the mass metric. Velocities are projected by two steps with a very small h, from V and
//! from −V. Terms of first order in h cancel in their mean change:
//!
//! ```text
//! V⁺ = ½ (S(X, V) − S(X, −V)),   S: velocities after the step     (J10)
//! ```

use crate::contact::Candidates;
use crate::error::Error;
use crate::joint::{Axis, Drive, Joint, JointAxis};
use crate::mechanics::trajectory::{LARGEST_TURN, Trajectory};
use crate::mechanics::{RigidBody, State, Wrench, largest};
use crate::solver::native::NativeSolver;
use crate::step::{Step, StepSolution, StepSolver, StepStatus};
use crate::world::{Parameters, World};
use nalgebra::Vector3;
use std::fmt;

/// Changes made by [`World::assemble`]: the largest of each kind over all bodies.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Assembly {
    /// Displacement of a centre of mass (m).
    pub place: f64,
    /// Rotation of a body (rad).
    pub turn: f64,
    /// Change of a velocity (m/s).
    pub velocity: f64,
    /// Change of a spin (rad/s).
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

/// Time step of the steps (J9); `PROJECTING` is the time step of (J10) (s).
const MOVING: f64 = 1e-3;
const PROJECTING: f64 = 1e-6;

/// Largest number of steps (J9).
const MOST_STEPS: u32 = 8;

/// First fraction of the motion of a joint frame; `LEAST_PART` is the smallest one.
const FIRST_PART: f64 = 0.125;
const LEAST_PART: f64 = 1e-3;

/// Tolerance of the joints besides rounding of positions (m and rad).
const APART: f64 = 1e-12;

impl World {
    /// Returns the states nearest to `states` that satisfy all joints, and the changes made.
    /// `states` has one entry per body.
    ///
    /// Poses satisfy locked axes and limits. They change by joint impulses only, which to first
    /// order in the joint errors is the smallest change in the mass metric. Velocities are then
    /// projected to satisfy the joints with the smallest change. Contacts are ignored.
    ///
    /// # Errors
    /// If the number of states is not the number of bodies, or if [`State::checked`] rejects a
    /// state. [`Error::NotAssembled`] if the joints cannot be closed from `states`, such as a loop
    /// of bodies that are too short.
    pub fn assemble(&self, states: &[State]) -> Result<(Vec<State>, Assembly), Error> {
        let start = states.iter().map(State::checked).collect::<Result<Vec<_>, _>>()?;
        if start.len() != self.bodies().len() {
            let (field, count) = ("states to assemble", start.len());
            return Err(Error::Count { field, count, allowed: "one per body" });
        }
        let mut found = self.brought_together(&start)?;
        self.project(&start, &mut found)?;
        let mut assembly = Assembly::default();
        for (from, to) in start.iter().zip(&found) {
            let path = Trajectory::between(from, to);
            assembly.place = assembly.place.max(path.shift().norm());
            assembly.turn = assembly.turn.max(path.angle());
            assembly.velocity = assembly.velocity.max((to.velocity - from.velocity).norm());
            assembly.spin = assembly.spin.max((to.spin - from.spin).norm());
        }
        Ok((found, assembly))
    }

    /// Solves (J9); the result is at rest. If one step is too far, the frames of closing joints
    /// move from the present poses to their targets in fractions as large as possible.
    fn brought_together(&self, start: &[State]) -> Result<Vec<State>, Error> {
        let bare = self.bare(MOVING, |drive| Drive { limits: drive.limits, ..Drive::NONE })?;
        let at_once = bare.joined(start);
        let Err(why @ Error::NotAssembled { .. }) = at_once else { return at_once };
        let mut now = start.to_vec();
        let mut left = 1.0;
        let mut part = FIRST_PART;
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

    /// Solves (J9) by steps of this world, which has joints only.
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

    /// Solves (J10): sets the velocities of `found` to the projected velocities of `start`.
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

    /// Index and error (m and rad) of the joint with the largest error at `states`; `None` without
    /// joints.
    fn worst_joint(&self, states: &[State]) -> Option<(usize, f64, f64)> {
        let errors = self.joints().iter().enumerate().map(|(joint, of)| {
            let (place, turn) = of.misfit(states).unwrap_or((f64::NAN, f64::NAN));
            (joint, place, turn)
        });
        // The error of a gear counts for its first joint.
        let angles = self.angles_near(states, &[]);
        let of_gears = self.gears().iter().map(|gear| {
            let of = gear.axes()[0];
            let off = gear.error(self.joints(), states, &angles).abs();
            match of.axis {
                JointAxis::Linear(_) => (of.joint, off, 0.0),
                JointAxis::Angular(_) => (of.joint, 0.0, off),
            }
        });
        errors.chain(of_gears).max_by(|a, b| a.1.max(a.2).total_cmp(&b.1.max(b.2)))
    }

    /// Copy of this world with only bodies and joints, with `time_step` (s) and with each drive
    /// replaced by `kept`.
    fn bare(&self, time_step: f64, kept: impl Fn(&Drive) -> Drive) -> Result<Self, Error> {
        let parameters = Parameters {
            ground: None,
            gravity: Vector3::zeros(),
            friction: 0.0,
            time_step,
            ..Parameters::new(self.bodies().iter().map(RigidBody::without_shape).collect())
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

/// Copy of `state` with zero velocities.
fn at_rest(state: &State) -> State {
    State { velocity: Vector3::zeros(), spin: Vector3::zeros(), ..*state }
}

/// States after a step of `world` without contacts; empty if the step did not converge.
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
