//! Derivatives of the rows of a joint, and of the loads of an impulse along them. They are taken
//! with respect to the bodies at the start of a step, at fixed final velocities V⁺.
//!
//! Columns are the position (m, world frame) and the rotation (rad, body frame) of A, then the same
//! of B. Equation numbers are those of `docs/gradients.md`.

#[cfg(test)]
mod tests;

use super::EndMap;
use crate::joint::{Axis, Joint, Turn, TurnKind};
use crate::kinematics::StepMap;
use crate::mechanics::{Pose, State};
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

/// Derivatives with respect to the poses of A and B.
pub(crate) type ByPoses<const ROWS: usize> = SMatrix<f64, ROWS, 12>;

/// Derivatives with respect to the anchors in A and B (m), in their frames.
pub(crate) type ByAnchors<const ROWS: usize> = SMatrix<f64, ROWS, 6>;

/// Derivatives of three rows of a joint over a step.
#[derive(Debug, Clone)]
pub(crate) struct RowsTangent {
    /// Derivatives of u (m/s), in the axes of the rows.
    pub(crate) motion: ByPoses<3>,
    /// Derivative ∂u/∂h (m/s²).
    pub(crate) by_time_step: Vector3<f64>,
    /// Derivatives of the coordinates at the start of the step (m or rad).
    pub(crate) coordinates: ByPoses<3>,
    /// Derivatives of the preceding rates (m/s or rad/s), for axes with an armature.
    pub(crate) rates: Option<Box<Rates>>,
    /// Derivatives of the load of a fixed impulse: the impulse (world frame), and its torques on A
    /// and on B, each in its body's frame.
    pub(crate) load: ByPoses<9>,
    /// Further derivatives of the torques of a cone's stop.
    pub(crate) stop: Option<Box<StopTorques>>,
    /// Derivatives of linear rows with respect to the anchors.
    pub(crate) anchors: Option<Box<Anchors>>,
}

/// Derivatives of the torques of a fixed impulse on A and on B, each in its body's frame, if a
/// cone's stop acts along its direction at the end of the step.
#[derive(Debug, Clone)]
pub(crate) struct StopTorques {
    /// Derivatives with respect to v (world frame) and ω (body frame) of A and B at k.
    pub(crate) by_velocities: ByPoses<6>,
    /// Derivative with respect to h.
    pub(crate) by_time_step: SVector<f64, 6>,
}

/// Derivatives with respect to the anchors of a joint, at fixed poses.
#[derive(Debug, Clone)]
pub(crate) struct Anchors {
    /// Derivatives of u (m/s), in the axes of the rows.
    pub(crate) motion: ByAnchors<3>,
    /// Derivatives of the coordinates at the start of the step (m), and of the preceding rates
    /// (m/s).
    pub(crate) coordinates: ByAnchors<3>,
    pub(crate) rates: ByAnchors<3>,
    /// Derivatives of the torques of a fixed impulse on A and on B, each in its body's frame.
    pub(crate) torques: ByAnchors<6>,
}

/// Derivatives of the mean rates before a step (m/s or rad/s).
#[derive(Debug, Clone)]
pub(crate) struct Rates {
    pub(crate) by_poses: ByPoses<3>,
    /// Derivatives with respect to v (world frame) and ω (body frame) of A and B at k.
    pub(crate) by_velocities: ByPoses<3>,
    pub(crate) by_time_step: Vector3<f64>,
}

/// Joint over a step, prepared for differentiation.
pub(crate) struct JointTangent<'a> {
    joint: &'a Joint,
    states: &'a [State],
    map: StepMap,
    /// Data of A and B; `None` for the world.
    sides: [Option<Side>; 2],
}

/// Body of the joint.
#[derive(Clone, Copy)]
struct Side {
    /// Poses one step before, at the start and at the end of the step.
    poses: [Pose; 3],
    /// Spin ω⁺.
    spin: Vector3<f64>,
    /// Map from the start to the end of the step; `back` is the map to one step before.
    on: EndMap,
    back: EndMap,
}

/// Index of the pose one step before; `START` and `END` are those at the ends of the step.
const BEFORE: usize = 0;
const START: usize = 1;
const END: usize = 2;

/// Pose of the world.
fn still() -> Pose {
    Pose { position: Vector3::zeros(), rotation: Matrix3::identity() }
}

/// Sets three columns.
fn set<const R: usize>(to: &mut ByPoses<R>, column: usize, part: &SMatrix<f64, R, 3>) {
    to.fixed_columns_mut::<3>(column).copy_from(part);
}

/// Three columns: positions or rotations of a side.
fn part<const R: usize>(of: &ByPoses<R>, column: usize) -> SMatrix<f64, R, 3> {
    of.fixed_columns::<3>(column).into_owned()
}

impl<'a> JointTangent<'a> {
    /// Prepares `joint` for the step `map` from `states`, with the final `velocities` v⁺
    /// and ω⁺ of A and B.
    pub(crate) fn new(
        joint: &'a Joint,
        states: &'a [State],
        map: &StepMap,
        velocities: [Option<(Vector3<f64>, Vector3<f64>)>; 2],
    ) -> Self {
        let bodies = [Some(joint.body()), joint.other()];
        let side = |number: usize| {
            let (state, (velocity, spin)) = (&states[bodies[number]?], velocities[number]?);
            let back = map.over(-map.time_step);
            let end = map.coasted(&State { velocity, spin, ..*state }).pose();
            Some(Side {
                poses: [back.coasted(state).pose(), state.pose(), end],
                spin,
                on: EndMap::new(&velocity, &spin, map),
                back: EndMap::new(&state.velocity, &state.spin, &back),
            })
        };
        Self { joint, states, map: *map, sides: [side(0), side(1)] }
    }

    fn pose(&self, side: usize, time: usize) -> Pose {
        self.sides[side].as_ref().map_or_else(still, |side| side.poses[time])
    }

    /// Position l (J1) and w = A_Bᵀ s at one of the times, and the derivatives of l with respect to
    /// the poses at that time. With C = A_B F_B,
    ///
    /// ```text
    /// δl = Cᵀ (δr_A − δr_B − A_A [a]× δθ_A) + F_Bᵀ [w]× δθ_B
    /// ```
    fn place(&self, time: usize) -> (Vector3<f64>, Vector3<f64>, ByPoses<3>) {
        let (a, b) = (self.pose(0, time), self.pose(1, time));
        let [of_a, of_b] = self.joint.frames();
        let relative = b.rotation.tr_mul(&(a.position + a.rotation * of_a.anchor - b.position));
        let frame = of_b.rotation();
        let to_rows = (b.rotation * frame).transpose();
        let mut slopes = ByPoses::zeros();
        set(&mut slopes, 0, &to_rows);
        set(&mut slopes, 3, &(-to_rows * a.rotation * of_a.anchor.cross_matrix()));
        if self.sides[1].is_some() {
            set(&mut slopes, 6, &-to_rows);
            set(&mut slopes, 9, &(frame.transpose() * relative.cross_matrix()));
        }
        (frame.tr_mul(&(relative - of_b.anchor)), relative, slopes)
    }

    /// Derivative of l with respect to the anchors at one of the times: δl = F_Bᵀ (A_Bᵀ A_A δa_A −
    /// δa_B) (G12).
    fn place_by_anchors(&self, time: usize) -> ByAnchors<3> {
        let to_rows = self.joint.frames()[1].rotation().transpose();
        let relative = self.pose(1, time).rotation.tr_mul(&self.pose(0, time).rotation);
        let mut slopes = ByAnchors::<3>::zeros();
        slopes.fixed_columns_mut::<3>(0).copy_from(&(to_rows * relative));
        slopes.fixed_columns_mut::<3>(3).copy_from(&-to_rows);
        slopes
    }

    /// Derivatives of the linear rows with respect to the anchors, with `impulse` along the rows.
    /// With P = C p and p_B = F_B p,
    ///
    /// ```text
    /// δτ_A = δa_A × A_Aᵀ P,   δτ_B = A_Bᵀ A_A δa_A × p_B                               (G12)
    /// ```
    fn anchors(&self, impulse: &Vector3<f64>) -> Box<Anchors> {
        let h = self.map.time_step;
        let coordinates = self.place_by_anchors(START);
        let mut motion = self.place_by_anchors(END);
        for k in (0..3).filter(|k| self.joint.linear()[*k] != Axis::Locked) {
            let row = motion.row(k) - coordinates.row(k);
            motion.set_row(k, &row);
        }
        let (a, b) = (self.pose(0, START).rotation, self.pose(1, START).rotation);
        let relative = b.tr_mul(&a);
        let of_b = self.joint.frames()[1].rotation() * impulse;
        let mut torques = ByAnchors::<6>::zeros();
        let on_a = -relative.tr_mul(&of_b).cross_matrix();
        torques.fixed_view_mut::<3, 3>(0, 0).copy_from(&on_a);
        if self.sides[1].is_some() {
            let on_b = -of_b.cross_matrix() * relative;
            torques.fixed_view_mut::<3, 3>(3, 0).copy_from(&on_b);
        }
        let rates = (coordinates - self.place_by_anchors(BEFORE)) / h;
        Box::new(Anchors { motion: motion / h, coordinates, rates, torques })
    }

    /// Applies the chain rule with `map` to derivatives with respect to other poses. Returns
    /// derivatives with respect to the poses and the velocities at k, and to h; `forward` is the
    /// sign of time in the map.
    fn led(
        &self,
        slopes: &ByPoses<3>,
        map: impl Fn(&Side) -> &EndMap,
        forward: f64,
    ) -> (ByPoses<3>, ByPoses<3>, Vector3<f64>) {
        let (mut poses, mut velocities) = (ByPoses::zeros(), ByPoses::zeros());
        let mut by_time_step = Vector3::zeros();
        for (number, side) in self.sides.iter().enumerate() {
            let Some(side) = side else { continue };
            let (map, column) = (map(side), 6 * number);
            let place = part(slopes, column);
            let turn = part(slopes, column + 3);
            set(&mut poses, column, &place);
            set(&mut poses, column + 3, &(turn * map.back));
            set(&mut velocities, column, &(place * map.time_step));
            set(&mut velocities, column + 3, &(turn * map.turning));
            by_time_step += (place * map.velocity + turn * map.rate) * forward;
        }
        (poses, velocities, by_time_step)
    }

    /// Derivatives of the preceding rates of coordinates. `now` and `before` are the derivatives of
    /// the coordinates at the start and one step before, with the values `x` and `was`.
    fn rates(
        &self,
        now: &ByPoses<3>,
        x: &Vector3<f64>,
        before: &ByPoses<3>,
        was: &Vector3<f64>,
    ) -> Box<Rates> {
        let h = self.map.time_step;
        let (poses, velocities, longer) = self.led(before, |side| &side.back, -1.0);
        Box::new(Rates {
            by_poses: (now - poses) / h,
            by_velocities: velocities / -h,
            by_time_step: (-longer - (x - was) / h) / h,
        })
    }

    /// Derivatives of the linear rows, with `impulse` along the rows. With P = C p, w at the start
    /// of the step and p_B = F_B p,
    ///
    /// ```text
    /// u = (l⁺ − l)/h,   locked axes: l⁺/h
    /// δP = A_B δθ_B × P,   δτ_A = a × (A_Aᵀ P × δθ_A),   δτ_B = δw × p_B + w × (p_B × δθ_B)      (G9)
    /// ```
    pub(crate) fn place_rows(&self, impulse: &Vector3<f64>) -> RowsTangent {
        let (joint, h) = (self.joint, self.map.time_step);
        let (l, relative, coordinates) = self.place(START);
        let (end, _, at_end) = self.place(END);
        let (mut motion, _, mut by_time_step) = self.led(&at_end, |side| &side.on, 1.0);
        let mut moved = end;
        for k in (0..3).filter(|k| joint.linear()[*k] != Axis::Locked) {
            moved[k] -= l[k];
            let row = motion.row(k) - coordinates.row(k);
            motion.set_row(k, &row);
        }
        motion /= h;
        by_time_step = (by_time_step - moved / h) / h;
        let rates = joint.needs_rates().then(|| {
            let (was, _, before) = self.place(BEFORE);
            self.rates(&coordinates, &l, &before, &was)
        });
        let (a, b) = (self.pose(0, START).rotation, self.pose(1, START).rotation);
        let [of_a, of_b] = joint.frames();
        let frame = of_b.rotation();
        let of_b = frame * impulse;
        let along = b * of_b;
        let mut load = ByPoses::<9>::zeros();
        let twisted = of_a.anchor.cross_matrix() * a.tr_mul(&along).cross_matrix();
        load.fixed_view_mut::<3, 3>(3, 3).copy_from(&twisted);
        if self.sides[1].is_some() {
            let arm = -of_b.cross_matrix() * frame * coordinates;
            load.fixed_view_mut::<3, 12>(6, 0).copy_from(&arm);
            load.fixed_view_mut::<3, 3>(0, 9).copy_from(&(-along.cross_matrix() * b));
            let mut part = load.fixed_view_mut::<3, 3>(6, 9);
            part += relative.cross_matrix() * of_b.cross_matrix();
        }
        let anchors = Some(self.anchors(impulse));
        RowsTangent { motion, by_time_step, coordinates, rates, load, stop: None, anchors }
    }

    /// Derivatives of the angular rows, with `impulse` along the rows, scaled by `length` (m) and
    /// relative to the `angles` (rad). With t = G p,
    ///
    /// ```text
    /// δτ_B = A_Bᵀ (A_A δt + (A_A δθ_A − A_B δθ_B) × A_A t)                             (G9)
    /// ```
    pub(crate) fn turn_rows(
        &self,
        angles: &Vector3<f64>,
        length: f64,
        impulse: &Vector3<f64>,
    ) -> Option<RowsTangent> {
        let (joint, h) = (self.joint, self.map.time_step);
        let at = joint.coordinates(self.states)?;
        let spin = |body: usize| &self.states[body].spin;
        let turn = Turn::new(joint, &at, angles, &self.map, length)
            .with_stop(spin(joint.body()), joint.other().map(spin));
        let spins = self.sides.map(|side| side.map(|side| side.spin));
        let own = turn.tangent(&spins[0]?, spins[1].as_ref(), impulse);
        let by_turns = |parts: &[Matrix3<f64>; 2]| {
            let mut slopes = ByPoses::zeros();
            set(&mut slopes, 3, &parts[0]);
            set(&mut slopes, 9, &parts[1]);
            slopes
        };
        let coordinates = by_turns(&own.angles);
        let rates = joint.needs_rates().then(|| {
            let was = joint.coasted(self.states, &self.map.over(-h))?;
            let counted = joint.counted(&was, angles);
            let before = Turn::new(joint, &was, &counted, &self.map, length);
            let still = Vector3::zeros();
            if joint.turning() == TurnKind::Driven {
                let (turned, [now, then]) = turn.turned_since(&before);
                let then = by_turns(&then.map(|slopes| -slopes));
                return Some(self.rates(&by_turns(&now), &turned, &then, &still));
            }
            let before = by_turns(&before.tangent(&still, Some(&still), &still).angles);
            Some(self.rates(&coordinates, angles, &before, &counted))
        });
        let torque = turn.torque_map() * impulse;
        let mut load = ByPoses::<9>::zeros();
        for (column, slope) in [(3, &own.torque[0]), (9, &own.torque[1])] {
            load.fixed_view_mut::<3, 3>(3, column).copy_from(slope);
        }
        if self.sides[1].is_some() {
            let (a, b) = (self.pose(0, START).rotation, self.pose(1, START).rotation);
            let relative = b.tr_mul(&a);
            let of_a = relative * (own.torque[0] - torque.cross_matrix());
            let of_b = relative * own.torque[1] + (relative * torque).cross_matrix();
            load.fixed_view_mut::<3, 3>(6, 3).copy_from(&of_a);
            load.fixed_view_mut::<3, 3>(6, 9).copy_from(&of_b);
        }
        let stop = own.stop.map(|stop| {
            let relative = self.pose(1, START).rotation.tr_mul(&self.pose(0, START).rotation);
            let mut by_velocities = ByPoses::<6>::zeros();
            let mut by_time_step = SVector::<f64, 6>::zeros();
            for (row, to_body) in
                [(0, Some(Matrix3::identity())), (3, self.sides[1].map(|_| relative))]
            {
                let Some(to_body) = to_body else { continue };
                for (column, slope) in [(3, stop.spins[0]), (9, stop.spins[1])] {
                    let mut part = by_velocities.fixed_view_mut::<3, 3>(row, column);
                    part.copy_from(&(to_body * slope));
                }
                let mut part = by_time_step.fixed_rows_mut::<3>(row);
                part.copy_from(&(to_body * stop.time_step));
            }
            Box::new(StopTorques { by_velocities, by_time_step })
        });
        let motion = by_turns(&own.motion);
        let by_time_step = own.by_time_step;
        let rates = rates.flatten();
        Some(RowsTangent { motion, by_time_step, coordinates, rates, load, stop, anchors: None })
    }
}
