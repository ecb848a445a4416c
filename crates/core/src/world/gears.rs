//! Judgement of gears in a step: residual and work.

use super::World;
use crate::joint::{Axis, Gear, GearAxis, Joint, JointAxis, JointForce, JointWork};
use crate::mechanics::{State, Wrench};
use nalgebra::Vector3;

impl Gear {
    /// Residual of (J15), or of the law of the drive, in a step of `world` from `states` to `next`
    /// (m/s); compare [`Joint::residual`]. `of_joints` holds the forces and angles of the joints,
    /// and `force` is the gear's (N or N m). NaN if a joint has no force.
    pub fn residual(
        &self,
        world: &World,
        states: &[State],
        next: &[State],
        of_joints: &[JointForce],
        force: f64,
    ) -> f64 {
        let (joints, bodies, h) = (world.joints(), world.bodies(), world.time_step());
        let Some(angles) = self.angles(of_joints) else { return f64::NAN };
        let end = self.between(joints, next, &angles);
        let length = self.length(joints, bodies);
        if self.law() == &Axis::Locked {
            return length * end.abs() / h;
        }
        let start = self.between(joints, states, &angles);
        let Some(response) = self.response(world, states) else { return f64::NAN };
        // Impulses are scaled by the mass of the first body.
        let unit = bodies[joints[self.axes()[0].joint].body()].mass();
        let graph = self.law().graph(&self.start(start), h, length, unit);
        let rho = 1.0 / (length * length * unit * response);
        let u = length * (end - start) / h;
        let p = force * h / (unit * length);
        let missed = graph.residual(u, p, if rho.is_finite() { rho } else { 1.0 });
        if u.is_finite() && p.is_finite() { missed } else { f64::NAN }
    }

    /// Work of the drive in a step of `world` from `states` to `next` (J); compare [`Joint::work`].
    /// It is 0 for a constraint.
    pub(crate) fn work(
        &self,
        world: &World,
        states: &[State],
        next: &[State],
        of_joints: &[JointForce],
        force: f64,
    ) -> JointWork {
        if self.law() == &Axis::Locked {
            return JointWork::default();
        }
        let Some(angles) = self.angles(of_joints) else { return JointWork::UNKNOWN };
        let before = |(at, near): (GearAxis, &Vector3<f64>)| {
            let joint = &world.joints()[at.joint];
            let coasted = joint.coasted(states, &world.step_map().over(-world.time_step()));
            coasted.map_or(f64::NAN, |of| match at.axis {
                JointAxis::Linear(k) => of.place[k],
                JointAxis::Angular(k) => joint.counted(&of, near)[k],
            })
        };
        let [first, second] = *self.axes();
        let came = self.missed([before((first, &angles[0])), before((second, &angles[1]))]);
        let [at, end] = [states, next].map(|of| self.between(world.joints(), of, &angles));
        let drives = 0.5 * force * (end - came);
        JointWork { drives, excess: 0.5 * force * (end - 2.0 * at + came), holding: 0.0 }
    }

    /// Sum s at `states`, with the joint angles nearest to `angles`.
    fn between(&self, joints: &[Joint], states: &[State], angles: &[Vector3<f64>; 2]) -> f64 {
        let [first, second] = *self.axes();
        self.missed([
            first.coordinate(joints, states, &angles[0]),
            second.coordinate(joints, states, &angles[1]),
        ])
    }

    /// Angles of both joints at the end of a step.
    fn angles(&self, of_joints: &[JointForce]) -> Option<[Vector3<f64>; 2]> {
        let [first, second] = self.axes().map(|at| of_joints.get(at.joint).map(|of| of.angles));
        Some([first?, second?])
    }

    /// Change of ṡ due to a unit impulse on s with free bodies, Σ F²/m + τ·I⁻¹ τ (1/kg or 1/(kg
    /// m²)). `None` if a body has no state.
    fn response(&self, world: &World, states: &[State]) -> Option<f64> {
        let mut sides: [Option<(usize, Wrench)>; 4] = [None; 4];
        for (at, size) in self.axes().iter().zip([1.0, -self.ratio()]) {
            let joint = &world.joints()[at.joint];
            let wrenches = joint.wrenches(states, at.axis, size)?;
            for (body, wrench) in [Some(joint.body()), joint.other()].into_iter().zip(wrenches) {
                let Some(body) = body else { continue };
                let known = |side: &Option<(usize, Wrench)>| side.is_none_or(|of| of.0 == body);
                if let Some(side) = sides.iter_mut().find(|side| known(side)) {
                    let (_, sum) = side.get_or_insert((body, Wrench::zero()));
                    sum.force += wrench.force;
                    sum.torque += wrench.torque;
                }
            }
        }
        let moved = |(body, wrench): (usize, Wrench)| {
            let of = &world.bodies()[body];
            let turned = wrench.torque.dot(&(of.inertia_inverse() * wrench.torque));
            wrench.force.norm_squared() / of.mass() + turned
        };
        Some(sides.into_iter().flatten().map(moved).sum())
    }
}
