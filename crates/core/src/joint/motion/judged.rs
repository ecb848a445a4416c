//! Residuals of a joint's laws in a step, its loads on bodies and its work, computed from the
//! states independently of the solver.
//!
//! Equation numbers are those of `docs/joints.md`.

use super::{
    Axis, AxisRates, AxisStart, Coordinates, Joint, JointAxis, JointForce, JointFrame,
    JointResidual, Turn, TurnKind, aside, between, largest, rotation,
};
use crate::kinematics::StepMap;
use crate::mechanics::{RigidBody, State, Wrench};
use nalgebra::{Matrix3, Vector3};

/// Motion of a joint in a step, shared by all checks.
#[derive(Debug, Clone, Copy)]
pub(crate) struct JointMotion {
    /// Both frames in the world at the start.
    frames: [JointFrame; 2],
    /// Coordinates and angles (rad) at the start. `after` holds those at the end. `before` holds
    /// those one step earlier, extrapolated with the velocities of the start.
    at: (Coordinates, Vector3<f64>),
    after: (Coordinates, Vector3<f64>),
    before: (Coordinates, Vector3<f64>),
    /// Torque map G with a length scale of 1 m; zero for free rotation.
    torque_map: Matrix3<f64>,
}

/// Work of a joint in a step (J).
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct JointWork {
    /// Work of the drives on the mean of the motions before and after the impulses (J6).
    pub drives: f64,
    /// Work of the drives on the motion after the impulses, minus the one on the mean motion.
    pub excess: f64,
    /// Work (J6) of axes that stop and then hold a load.
    pub holding: f64,
}

impl JointWork {
    /// Work of a joint whose bodies have no states.
    pub const UNKNOWN: Self = Self { drives: f64::NAN, excess: 0.0, holding: 0.0 };
}

impl Joint {
    /// Motion of the joint in the step `states` → `next` with `force`. `None` if
    /// a body has no state.
    pub(crate) fn step_motion(
        &self,
        states: &[State],
        next: &[State],
        force: &JointForce,
        map: &StepMap,
    ) -> Option<JointMotion> {
        let frames = self.placed(states)?;
        let at = between(&frames[0], &frames[1]);
        let after = self.coordinates(next)?;
        let before = self.coasted(states, &map.over(-map.time_step))?;
        let end = self.counted(&after, &force.angles);
        let angles = self.counted(&at, &end);
        let came = self.counted(&before, &angles);
        let torque_map = self.turning_map(states, &at, &angles, map);
        let (at, after, before) = ((at, angles), (after, end), (before, came));
        Some(JointMotion { frames, at, after, before, torque_map })
    }

    /// Adds the loads of the joint's `force` in a step from `states` to `loads`.
    /// `loads` has a wrench per body: force in N, world frame, and torque in N m, body frame. The force acts on A
    /// at its anchor, and the opposite force on B at the same point. Bodies without a load or a
    /// state are skipped.
    pub(crate) fn add_loads(
        &self,
        states: &[State],
        force: &JointForce,
        map: &StepMap,
        loads: &mut [Wrench],
    ) {
        if let Some(frames) = self.placed(states) {
            let at = between(&frames[0], &frames[1]);
            let torque_map = self.turning_map(states, &at, &force.angles, map);
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
            let wrench = acting.on(state, sign);
            load.force += wrench.force;
            load.torque += wrench.torque;
        }
    }

    /// Work of the joint's drives under `force` in the step `states` → `next`
    /// (J). It uses the mean of the displacements before and after the impulses:
    ///
    /// ```text
    /// W = ½ Σ f ((x⁺ − x_k) + (x_k − x̃)),                                     (J6)
    /// ```
    ///
    /// with x̃ extrapolated back by a step with the velocities of step k. Stops, dry friction and
    /// damping alone only take energy: f (x⁺ − x_k) ≤ 0. They have none, except on an axis that one of
    /// them stops and then holds against a load, where W is positive. The angles of a gimbal
    /// are nonlinear, and the larger of this work and of the work along the initial directions
    /// counts. For a moving world frame it is the work of its force and torque on A at the mean
    /// velocities. `None` if a body has no state.
    pub fn work(
        &self,
        states: &[State],
        next: &[State],
        force: &JointForce,
        map: &StepMap,
    ) -> Option<f64> {
        let motion = self.step_motion(states, next, force, map)?;
        let work = motion.work(self, states, next, force, map)?;
        Some(work.drives + work.holding)
    }

    /// Residual of the joint's laws in the step `states` → `next` with `force`,
    /// computed from the states only. A force error counts as the speed that it would give the
    /// joint's bodies alone. NaN if a body has no state.
    pub fn residual(
        &self,
        bodies: &[RigidBody],
        states: &[State],
        next: &[State],
        force: &JointForce,
        map: &StepMap,
    ) -> JointResidual {
        let motion = self.step_motion(states, next, force, map);
        let residual = motion.and_then(|motion| motion.residual(self, bodies, states, force, map));
        residual.unwrap_or(JointResidual { locked: f64::NAN, drive: f64::NAN })
    }
}

impl JointMotion {
    /// Adds the loads of the joint's `force` on its bodies, at `states` at the start of the step,
    /// to `loads`.
    pub(crate) fn add_loads(
        &self,
        joint: &Joint,
        states: &[State],
        force: &JointForce,
        loads: &mut [Wrench],
    ) {
        joint.add_loads_at(&self.frames, &self.torque_map, states, force, loads);
    }

    /// See [`Joint::work`].
    pub(crate) fn work(
        &self,
        joint: &Joint,
        states: &[State],
        next: &[State],
        force: &JointForce,
        map: &StepMap,
    ) -> Option<JointWork> {
        let Self { frames, at: (at, angles), after: (after, end), before: (before, came), .. } =
            self;
        let time_step = map.time_step;
        // A moving frame does the work of its force and torque on A.
        if joint.moves {
            let (state, next) = (states.get(joint.body)?, next.get(joint.body)?);
            let load = joint.acting_at(frames, &self.torque_map, state, force).on(state, 1.0);
            let power = |velocity: Vector3<f64>, spin: Vector3<f64>| {
                0.5 * time_step * (load.force.dot(&velocity) + load.torque.dot(&spin))
            };
            return Some(JointWork {
                drives: power(state.velocity + next.velocity, state.spin + next.spin),
                excess: power(next.velocity - state.velocity, next.spin - state.spin),
                holding: 0.0,
            });
        }
        let [along, turning] = joint.active_axes();
        // Motions of the step before and of this one
        let [earlier, later] = match joint.turning() {
            TurnKind::Driven => {
                [joint.turned(before, came, at, angles), joint.turned(at, angles, after, end)]
            }
            _ => [angles - came, end - angles],
        };
        // Work of an axis that holds a load where it has stopped.
        let holding = |force: f64, earlier: f64, later: f64| {
            if force * later <= 0.0 { (force * (earlier + later)).max(0.0) } else { 0.0 }
        };
        // Sums of force times motion. The excess is the motion after the impulses minus the one before.
        let (mut work, mut excess, mut held) = (0.0, 0.0, 0.0);
        let [before_along, after_along] = [at.place - before.place, after.place - at.place];
        for (k, is_active) in along.into_iter().enumerate() {
            let force = force.force[k];
            let earlier = before_along[k];
            let later = after_along[k];
            if is_active {
                work += force * (earlier + later);
                excess += force * (later - earlier);
            } else if !matches!(joint.linear()[k], Axis::Locked) {
                held += holding(force, earlier, later);
            }
        }
        let torque = Vector3::from_fn(|k, _| if turning[k] { force.torque[k] } else { 0.0 });
        for k in (0..3).filter(|k| !turning[*k] && !matches!(joint.angular()[*k], Axis::Locked)) {
            held += holding(force.torque[k], earlier[k], later[k]);
        }
        excess += torque.dot(&(later - earlier));
        let mut about = torque.dot(&(earlier + later));
        if matches!(joint.turning(), TurnKind::Gimbal | TurnKind::Universal) {
            let turn = Turn::new(joint, at, angles, map, 1.0);
            let spins = |body: usize| Some(states.get(body)?.spin + next.get(body)?.spin);
            let other = joint.other.and_then(spins);
            about =
                about.max(torque.dot(&turn.rates(&spins(joint.body)?, other.as_ref())) * time_step);
        }
        Some(JointWork { drives: 0.5 * (work + about), excess: 0.5 * excess, holding: 0.5 * held })
    }

    /// Work (32c) of `force` in a step of `time_step` (s) from `states`: on the velocities before it, beyond that on
    /// the motion that they extrapolate (J). `None` if a body has no state.
    pub(crate) fn work_of_lag(
        &self,
        joint: &Joint,
        states: &[State],
        force: &JointForce,
        time_step: f64,
    ) -> Option<f64> {
        let acting =
            joint.acting_at(&self.frames, &self.torque_map, states.get(joint.body)?, force);
        let power = |body: Option<usize>, sign: f64| {
            let state = body.and_then(|body| states.get(body))?;
            let Wrench { force, torque } = acting.on(state, sign);
            Some(force.dot(&state.velocity) + torque.dot(&state.spin))
        };
        let power = power(Some(joint.body), 1.0)? + power(joint.other, -1.0).unwrap_or(0.0);
        let ((at, angles), (before, came)) = (&self.at, &self.before);
        let turned = match joint.turning() {
            TurnKind::Driven => joint.turned(before, came, at, angles),
            _ => angles - came,
        };
        let motion = force.force.dot(&(at.place - before.place)) + force.torque.dot(&turned);
        Some(0.5 * (time_step * power - motion))
    }

    /// Response w of a row to an impulse: speed change per impulse over the mass of A, with all
    /// other bodies and contacts ignored. Angular rows are scaled by `length` (m). 1 for rows
    /// without a drive.
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
            let to_local = |torque: &Vector3<f64>| rotation(&state.attitude).tr_mul(torque);
            let torque = match about {
                // The torque map is in the frame of A.
                Some(torque) if body == joint.body => torque,
                Some(torque) => to_local(&(rotation(&states[joint.body].attitude) * torque)),
                None => to_local(&(a.anchor - state.position).cross(&along)),
            };
            let turns = torque.dot(&(of.inertia_inverse() * torque));
            response += unit * (along.norm_squared() / of.mass() + turns);
        }
        // A direction without response has no scale.
        if response > 0.0 && response.is_finite() { response } else { 1.0 }
    }

    /// See [`Joint::residual`]; `None` if the body of `joint` does not exist.
    pub(crate) fn residual(
        &self,
        joint: &Joint,
        bodies: &[RigidBody],
        states: &[State],
        force: &JointForce,
        map: &StepMap,
    ) -> Option<JointResidual> {
        let Self { at: (at, angles), after: (after, end), before: (before, came), .. } = self;
        // Impulses are scaled by the mass of A.
        let (h, unit) = (map.time_step, bodies.get(joint.body)?.mass());
        let mut residual = JointResidual::default();
        // (J7): a locked row has no speed, and a driven row is on its graph.
        let mut add = |axis: &Axis, start: &AxisStart, (u, f): (f64, f64), length, which| {
            let is_finite = f.is_finite() && u.is_finite();
            let (part, missed) = match axis {
                Axis::Locked => (&mut residual.locked, u.abs()),
                Axis::Free(_) => {
                    let graph = axis.graph(start, h, length, unit);
                    let w = if axis.is_idle() {
                        1.0
                    } else {
                        self.response(joint, bodies, states, which, length)
                    };
                    (&mut residual.drive, graph.residual(u, f * h / unit / length, 1.0 / w))
                }
            };
            *part = largest(*part, if is_finite { missed } else { f64::NAN });
        };
        // Coordinates and rates with which the step begins.
        let turned = joint.turned(before, came, at, angles);
        let along = (at.place - before.place) / h;
        let rates = AxisRates { along, about: turned / h, fall: joint.fall_along(states) };
        let [places, turns] = joint.starts_at(at, angles, &rates);
        let length = joint.length(bodies);
        // u = x⁺/h of a locked slide, (x⁺ − x)/h of a driven one.
        for (k, axis) in joint.linear.iter().enumerate() {
            let u = match axis {
                Axis::Locked => after.place[k] / h,
                Axis::Free(_) => (after.place[k] - at.place[k]) / h,
            };
            add(axis, &places[k], (u, force.force[k]), 1.0, JointAxis::Linear(k));
        }
        if joint.turning() != TurnKind::Free {
            // Angular rows in m/s: u = ℓ 2φ/h of a locked axis, ℓ (x⁺ − x)/h of a driven one.
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
