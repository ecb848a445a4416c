//! How the forces of a joint and its motion in a step miss its laws, what they put on its bodies, and their work: from
//! the states alone.
//!
//! Equation numbers are those of `docs/joints.md`.

use super::{
    Axis, AxisStart, Coordinates, Joint, JointAxis, JointForce, JointFrame, JointResidual, Turn,
    TurnKind, aside, between, largest, rotation,
};
use crate::mechanics::{RigidBody, State, Wrench};
use nalgebra::{Matrix3, Vector3};

/// Where a joint is in a step, found once for all that judges it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct JointMotion {
    /// Its frames in the world at the start.
    frames: [JointFrame; 2],
    /// Its coordinates at the start, at the end, and where it came from with the velocities of the start; with the angles, rad.
    at: (Coordinates, Vector3<f64>),
    after: (Coordinates, Vector3<f64>),
    before: (Coordinates, Vector3<f64>),
    /// G of the turn where it is scaled by 1 m; nothing of what turns freely.
    torque_map: Matrix3<f64>,
}

impl Joint {
    /// Where it is in the step `states` → `next` of `time_step` (s) in which it has `force`. `None` where a body has no
    /// state.
    pub(crate) fn seen(
        &self,
        states: &[State],
        next: &[State],
        force: &JointForce,
        time_step: f64,
    ) -> Option<JointMotion> {
        let frames = self.placed(states)?;
        let (at, after) = (between(&frames[0], &frames[1]), self.coordinates(next)?);
        let before = self.coasted(states, -time_step)?;
        let end = self.counted(&after, &force.angles);
        let angles = self.counted(&at, &end);
        let came = self.counted(&before, &angles);
        let torque_map = self.turning_map(&at, &angles);
        let (at, after, before) = ((at, angles), (after, end), (before, came));
        Some(JointMotion { frames, at, after, before, torque_map })
    }

    /// Adds to the `loads` on all bodies (force in N, world; torque in N m, body) those of the joint's
    /// `force` in a step from `states`: on A at its anchor and, opposite, on B at the same point of the
    /// world. Bodies without a load or a state get none.
    pub(crate) fn add_loads(&self, states: &[State], force: &JointForce, loads: &mut [Wrench]) {
        if let Some(frames) = self.placed(states) {
            let at = between(&frames[0], &frames[1]);
            let torque_map = self.turning_map(&at, &force.angles);
            self.add_loads_at(&frames, &torque_map, states, force, loads);
        }
    }

    fn add_loads_at(
        &self,
        frames: &[JointFrame; 2],
        torque_map: &Matrix3<f64>,
        states: &[State],
        force: &JointForce,
        loads: &mut [Wrench],
    ) {
        let Some(state) = states.get(self.body) else { return };
        let acting = self.acting_at(frames, torque_map, state, force);
        let sides = [(Some(self.body), 1.0), (self.other, -1.0)];
        for (body, sign) in sides {
            let Some(body) = body else { continue };
            let (Some(load), Some(state)) = (loads.get_mut(body), states.get(body)) else {
                continue;
            };
            let of = acting.on(state, sign);
            load.force += of.force;
            load.torque += of.torque;
        }
    }

    /// The work of the drives of the joint under `force` in the step `states` → `next` of `time_step` (s), J:
    /// on the mean of the ways on which it came and on which it goes,
    ///
    /// ```text
    /// W = ½ Σ f ((x⁺ − x_k) + (x_k − x̃)),                                     (J6)
    /// ```
    ///
    /// x̃ being where it came from with the velocities of step k; of a gimbal, whose angles are no linear ways, the larger
    /// one of this and of the work along the directions at the step's start; of a frame in the world that moves, that of the
    /// force and the torque that it drives A with, on the mean velocities. `None` where a body has no
    /// state.
    #[must_use]
    pub fn work(
        &self,
        states: &[State],
        next: &[State],
        force: &JointForce,
        time_step: f64,
    ) -> Option<f64> {
        self.seen(states, next, force, time_step)?.work(self, states, next, force, time_step)
    }

    /// How far the step `states` → `next` of `time_step` (s) with the force `force` is from the laws of the
    /// joint, a force that is missed counting as the speed that it would make of its bodies alone; from the states alone.
    /// Everything is NaN where a body has no state.
    #[must_use]
    pub fn residual(
        &self,
        bodies: &[RigidBody],
        states: &[State],
        next: &[State],
        force: &JointForce,
        time_step: f64,
    ) -> JointResidual {
        let seen = self.seen(states, next, force, time_step);
        let residual = seen.and_then(|seen| seen.residual(self, bodies, states, force, time_step));
        residual.unwrap_or(JointResidual { locked: f64::NAN, drive: f64::NAN })
    }
}

impl JointMotion {
    /// Adds what the `force` of `joint` puts on its bodies, which are at `states` at the step's start, to the `loads` on all.
    pub(crate) fn add_loads(
        &self,
        joint: &Joint,
        states: &[State],
        force: &JointForce,
        loads: &mut [Wrench],
    ) {
        joint.add_loads_at(&self.frames, &self.torque_map, states, force, loads);
    }

    /// [`Joint::work`].
    pub(crate) fn work(
        &self,
        joint: &Joint,
        states: &[State],
        next: &[State],
        force: &JointForce,
        time_step: f64,
    ) -> Option<f64> {
        let Self { frames, at: (at, angles), after: (after, end), before: (before, came), .. } =
            self;
        if joint.moves {
            let (state, next) = (states.get(joint.body)?, next.get(joint.body)?);
            let load = joint.acting_at(frames, &self.torque_map, state, force).on(state, 1.0);
            let power = load.force.dot(&(state.velocity + next.velocity))
                + load.torque.dot(&(state.spin + next.spin));
            return Some(0.5 * time_step * power);
        }
        let free = |axis: &Axis| *axis != Axis::Locked;
        let mut work = 0.0;
        for k in (0..3).filter(|k| free(&joint.linear[*k])) {
            work += force.force[k] * (after.place[k] - before.place[k]);
        }
        let torque = Vector3::from_fn(|k, _| match joint.angular[k] {
            Axis::Locked => 0.0,
            Axis::Free(_) => force.torque[k],
        });
        let way = match joint.turning() {
            TurnKind::Driven => {
                let came = joint.turned(before, came, at, angles);
                came + joint.turned(at, angles, after, end)
            }
            _ => end - came,
        };
        let mut about = torque.dot(&way);
        if matches!(joint.turning(), TurnKind::Gimbal | TurnKind::Universal) {
            let turn = Turn::new(joint, at, angles, time_step, 1.0);
            let spins = |body: usize| Some(states.get(body)?.spin + next.get(body)?.spin);
            let other = joint.other.and_then(spins);
            about =
                about.max(torque.dot(&turn.rates(&spins(joint.body)?, other.as_ref())) * time_step);
        }
        Some(0.5 * (work + about))
    }

    /// w: how much faster a row becomes by an impulse along it of 1 over the mass of A, with nothing but its bodies to
    /// move: of the place, or of the turn scaled by `length` (m). 1 of what no drive asks for.
    fn response(
        &self,
        joint: &Joint,
        bodies: &[RigidBody],
        states: &[State],
        axis: JointAxis,
        length: f64,
    ) -> f64 {
        let Some(unit) = bodies.get(joint.body).map(RigidBody::mass) else { return 1.0 };
        let [a, b] = &self.frames;
        let (along, about) = match axis {
            JointAxis::Linear(k) => (rotation(&b.attitude).column(k).into_owned(), None),
            JointAxis::Angular(k) => (Vector3::zeros(), Some(self.torque_map.column(k) * length)),
        };
        let mut response = 0.0;
        for body in [Some(joint.body), joint.other].into_iter().flatten() {
            let (Some(of), Some(state)) = (bodies.get(body), states.get(body)) else { return 1.0 };
            let seen = |torque: &Vector3<f64>| rotation(&state.attitude).tr_mul(torque);
            let torque = match about {
                // In the frame of A.
                Some(torque) if body == joint.body => torque,
                Some(torque) => seen(&(rotation(&states[joint.body].attitude) * torque)),
                None => seen(&(a.anchor - state.position).cross(&along)),
            };
            let turns = torque.dot(&(of.inertia_inverse() * torque));
            response += unit * (along.norm_squared() / of.mass() + turns);
        }
        // A direction in which nothing can turn has no scale.
        if response > 0.0 && response.is_finite() { response } else { 1.0 }
    }

    /// [`Joint::residual`]; `None` where `joint` is of a body that is not there.
    pub(crate) fn residual(
        &self,
        joint: &Joint,
        bodies: &[RigidBody],
        states: &[State],
        force: &JointForce,
        time_step: f64,
    ) -> Option<JointResidual> {
        let Self { at: (at, angles), after: (after, end), before: (before, came), .. } = self;
        // Impulses over the mass of A.
        let (h, unit) = (time_step, bodies.get(joint.body)?.mass());
        let mut residual = JointResidual::default();
        let mut add = |axis: &Axis, start: &AxisStart, (u, f): (f64, f64), length, which| {
            let is_finite = f.is_finite() && u.is_finite();
            let (part, missed) = match axis {
                Axis::Locked => (&mut residual.locked, u.abs()),
                Axis::Free(_) => {
                    let graph = axis.graph(start, h, length, unit);
                    let w = match axis.is_idle() {
                        true => 1.0,
                        false => self.response(joint, bodies, states, which, length),
                    };
                    (&mut residual.drive, graph.residual(u, f * h / unit / length, 1.0 / w))
                }
            };
            *part = largest(*part, if is_finite { missed } else { f64::NAN });
        };
        let turned = joint.turned(before, came, at, angles);
        let (rates, turning) = ((at.place - before.place) / h, turned / h);
        let [places, turns] = joint.starts_at(at, angles, &rates, &turning);
        let length = joint.length(bodies);
        for (k, axis) in joint.linear.iter().enumerate() {
            let u = match axis {
                Axis::Locked => after.place[k] / h,
                Axis::Free(_) => (after.place[k] - at.place[k]) / h,
            };
            add(axis, &places[k], (u, force.force[k]), 1.0, JointAxis::Linear(k));
        }
        if joint.turning() != TurnKind::Free {
            let aside = aside(joint.turning(), &after.turn);
            let turned = joint.turned(at, angles, after, end);
            for (k, axis) in joint.acting_axes().iter().enumerate() {
                let u = match axis {
                    Axis::Locked => length * 2.0 * aside[k] / h,
                    Axis::Free(_) => length * turned[k] / h,
                };
                add(axis, &turns[k], (u, force.torque[k]), length, JointAxis::Angular(k));
            }
        }
        Some(residual)
    }
}
