//! Derivatives of contacts whose features have a gap of their own.

use super::{ContactTangent, RowChange, across};
use crate::contact::curved::{Core, Reach, closest_vector};
use crate::contact::{Contact, CorePair, Curved, EllipsoidPoint};
use crate::derivative::side::{SideChangeInput, StepSide};
use crate::kinematics::StepMap;
use crate::mechanics::Pose;
use crate::mechanics::quaternion::rotation;
use nalgebra::{Matrix2, Matrix3, Vector2, Vector3, Vector4};

impl ContactTangent {
    /// Differentials of two round features (10b). a and b are the nearest core points at k, D is
    /// the vector between those at k+1, and m is its direction:
    ///
    /// ```text
    /// u_t = (E − n nᵀ) (s⁺ − s)/h − (ρ_A A_A ω_A + ρ_B A_B ω_B) × n
    /// u_n = (|D| − ρ_A − ρ_B)/h,   δ|D| = m·δD at the same shares                   (G5)
    /// ```
    pub(super) fn round_change(
        &self,
        curved: &CorePair,
        of_a: &SideChangeInput,
        of_b: &SideChangeInput,
        time_step: f64,
    ) -> RowChange {
        let (a, b, h) = (&self.a, &self.b, self.time_step);
        let sides = (a.change(of_a), b.change(of_b));
        let (by_a, by_b) = (sides.0.linear(), sides.1.linear());
        let n = self.contact.normal();
        let (x, y) = (sides.0.place(&curved.point()), sides.1.place(&curved.foot()));
        let (u, v) = (a.rotation * curved.of_a.along, b.rotation * curved.of_b.along);
        let offset_vector = x - y;
        let moved = sides.0.carried(&x) - sides.1.carried(&y);
        let ways = [u, v];
        // The nearest points slide along their cores, so that D stays perpendicular to both.
        let (slid_a, slid_b) =
            slid(curved, curved.shares, &ways, [by_a * u, by_b * v], (&offset_vector, &moved));
        let way_change = moved + u * slid_a - v * slid_b;
        let distance = offset_vector.norm();
        // δn: the normal is the direction of D at k.
        let turned = across(&n, &way_change) / distance;
        // The impulse acts in the middle of the gap.
        let radius = self.contact.features.radius;
        let opened = distance - radius - curved.radius;
        let wider = n.dot(&way_change) - of_a.radius - of_b.radius;
        let arm_change = by_a * (x - a.origin) + u * slid_a
            - n * (of_a.radius + 0.5 * wider)
            - turned * (radius + 0.5 * opened);
        // δD at k+1, at the same shares of the cores.
        // Core points of step k, moved to k+1.
        let (turn_a, turn_b) = (of_a.turn + a.rate * time_step, of_b.turn + b.rate * time_step);
        let end_change = |side: &StepSide,
                          given: &SideChangeInput,
                          turn: &Vector3<f64>,
                          core: &Core,
                          share,
                          slid: f64| {
            let point = core.at(share);
            let shifted = given.stretch.component_mul(&point) + core.along * slid;
            given.position
                + side.linear * time_step
                + turn.cross(&(side.turned * point))
                + side.turned * shifted
        };
        let between = |shares: (f64, f64), slid: (f64, f64)| {
            end_change(a, of_a, &turn_a, &curved.of_a, shares.0, slid.0)
                - end_change(b, of_b, &turn_b, &curved.of_b, shares.1, slid.1)
        };
        let (shares, reach) = self.end(curved);
        let moved_end = (a.linear - b.linear) * h + (a.turned - a.rotation) * curved.point()
            - (b.turned - b.rotation) * curved.foot();
        // First two terms of u_t, by the product rule.
        let slip = across(&n, &moved_end);
        let moved_end_change = between(curved.shares, (slid_a, slid_b)) - way_change;
        let slip_change =
            across(&n, &moved_end_change) - turned * n.dot(&moved_end) - n * turned.dot(&moved_end);
        // Spins: ρ_A A_A ω_A + ρ_B A_B ω_B.
        let rolling = a.spin_world * radius + b.spin_world * curved.radius;
        let rolling_change = of_a.turn.cross(&a.spin_world) * radius
            + of_b.turn.cross(&b.spin_world) * curved.radius
            + a.spin_world * of_a.radius
            + b.spin_world * of_b.radius;
        // u_n and its differential (G5).
        let opening = (reach.length - radius - curved.radius) / h;
        let opening_change = (reach.direction.dot(&between(shares, (0.0, 0.0)))
            - of_a.radius
            - of_b.radius
            - opening * time_step)
            / h;
        let motion = (slip_change - slip * (time_step / h)) / h
            - rolling_change.cross(&n)
            - rolling.cross(&turned)
            + turned * opening
            + n * opening_change;
        let apart = of_a.position - of_b.position;
        RowChange { motion, turn: n.cross(&turned), arms: [arm_change, apart + arm_change] }
    }

    /// Parameters of the nearest points of two round features at k+1, and the length and direction
    /// of the vector between them.
    pub(super) fn end(&self, curved: &CorePair) -> ((f64, f64), Reach) {
        let h = self.time_step;
        let of = |side: &StepSide, core: &Core| {
            core.moved(&side.turned, &(side.origin + side.linear * h))
        };
        let (shares, offset_vector) =
            closest_vector(&of(&self.a, &curved.of_a), &of(&self.b, &curved.of_b));
        (shares, Reach::new(&offset_vector, &self.contact.normal()))
    }

    /// Normal of the plane at the end, in the frame of A.
    fn normal_in_a(&self) -> (Vector3<f64>, Vector3<f64>) {
        let local = self.b.rotation.tr_mul(&self.contact.normal());
        let end = self.b.turned * local;
        (end, self.a.turned.tr_mul(&end))
    }

    /// True if the contact has the nearest point of the ellipsoid at both ends of the step. It does
    /// not if a disc is parallel to its plane.
    pub(super) fn is_nearest(&self, one: &EllipsoidPoint) -> bool {
        let before = self.a.rotation.tr_mul(&self.contact.normal());
        let after = self.normal_in_a().1;
        let is_flat = [before, after].iter().any(|n| one.shape.is_across(n));
        !is_flat && one.width(&after).is_exact
    }

    /// Rotation of A at the place of the step whose nearest point carries the force, and its
    /// differential (world).
    fn rolled(
        &self,
        one: &EllipsoidPoint,
        of_a: &SideChangeInput,
        of_b: &SideChangeInput,
        time_step: f64,
    ) -> (Matrix3<f64>, Vector3<f64>) {
        let (a, b, h) = (&self.a, &self.b, self.time_step);
        if !self.is_predicted(one) {
            return (a.rotation, of_a.turn);
        }
        let ahead = |side: &StepSide, given: &SideChangeInput| {
            let Some(motion) = &side.impact else { return (side.rotation, given.turn) };
            // Cayley map of a = h γ ω/2: δS Sᵀ = [2 (δa + a × δa)/(1 + |a|²)]×.
            let map = StepMap { form: motion.form, time_step: h };
            let stretch = map.stretch(&motion.old);
            let half = motion.old * (0.5 * h * stretch.gamma);
            let change = stretch.slope(&motion.old) * (given.spin * (0.5 * h));
            let turned = (change + half.cross(&change)) * (2.0 / (1.0 + half.norm_squared()))
                + motion.old * (map.rate(&motion.old) * time_step);
            let turn = rotation(&Vector4::new(1.0, half.x, half.y, half.z).normalize());
            (side.rotation * turn, given.turn + side.rotation * turned)
        };
        // Relative to B, which has turned as well.
        let ((end_a, change_a), (end_b, change_b)) = (ahead(a, of_a), ahead(b, of_b));
        let back = b.rotation * end_b.transpose();
        (back * end_a, of_b.turn + back * (change_a - change_b))
    }

    /// True if the force acts at the nearest point of the predicted end.
    pub(super) fn is_predicted(&self, one: &EllipsoidPoint) -> bool {
        let core = self.contact.features.point - one.shape.centre;
        let start = one.shape.axes * -one.toward;
        (core - start).norm() > 1e-14 * one.shape.size()
    }

    /// Differentials of an ellipsoid against a plane (10c). c is its centre, y the vector from c to
    /// the nearest point at k, b the touched point of B, and a⁺ and b⁺ are the nearest points at
    /// k+1:
    ///
    /// ```text
    /// u_t = (E − n nᵀ) (((c⁺ − b⁺) − (c − b))/h + A_A ω_A × y)
    /// u_n = φ⁺/h,   δφ⁺ = n⁺·(δa⁺ − δb⁺) at the same points of the bodies
    /// δy  = δθ_A × y + A_A δŷ,   ŷ = −S Sᵀ n_A/|Sᵀ n_A|                            (G5a)
    /// ```
    ///
    /// If the force acts at the nearest point of the predicted end, y has the rotation of that end.
    /// A change of size stretches the body alike along all axes.
    pub(super) fn ellipsoid_change(
        &self,
        point: &EllipsoidPoint,
        of_a: &SideChangeInput,
        of_b: &SideChangeInput,
        time_step: f64,
    ) -> RowChange {
        let a = &self.a;
        let b = &self.b;
        let h = self.time_step;
        let one = &point.shape;
        let n = self.contact.normal();
        // The plane changes with the size of B.
        let plane = self.placed.placement.change(&self.contact, &a.change(of_a), &b.change(of_b));
        let turned = of_b.turn.cross(&n) + b.rotation * plane.normal;
        let radius = self.contact.features.radius;
        let arm = a.rotation * one.centre;
        let core = self.contact.arm + n * radius - arm;
        // Change of the nearest point by the rotation of the plane relative to A.
        let (rolled, rolled_turn) = self.rolled(point, of_a, of_b, time_step);
        let way = rolled_over(point, &rolled, &rolled_turn, (&n, &turned));
        let stretched = |vector: &Vector3<f64>| {
            a.rotation * of_a.stretch.component_mul(&a.rotation.tr_mul(vector))
        };
        let core_stretched = rolled * of_a.stretch.component_mul(&rolled.tr_mul(&core));
        let core_change = rolled_turn.cross(&core) + core_stretched + way;
        let (beyond, beyond_change) = (core - n * radius, core_change - turned * radius);
        let arm_change = of_a.turn.cross(&arm) + stretched(&arm);
        // Touched point of B.
        let apart = of_a.position - of_b.position;
        let touched = a.origin + arm + beyond - b.origin;
        let touched_change = apart + arm_change + beyond_change;
        let foot = b.rotation.tr_mul(&touched);
        let foot_change = b.rotation.tr_mul(&(touched_change - of_b.turn.cross(&touched)));
        let (turn_a, turn_b) = (of_a.turn + a.rate * time_step, of_b.turn + b.rate * time_step);
        let (arm_end, foot_end) = (a.turned * one.centre, b.turned * foot);
        let relative = a.linear - b.linear;
        let moved = relative * h + arm_end - arm - foot_end + touched;
        let end_stretched =
            |vector: &Vector3<f64>| a.turned * of_a.stretch.component_mul(&a.turned.tr_mul(vector));
        let moved_change = relative * time_step + turn_a.cross(&arm_end) + end_stretched(&arm_end)
            - arm_change
            - turn_b.cross(&foot_end)
            + of_b.turn.cross(&touched)
            - (b.turned - b.rotation) * foot_change;
        // u_t (10c), by the product rule.
        let slip = moved / h + a.spin_world.cross(&beyond);
        let slip_change = (moved_change - moved * (time_step / h)) / h
            + of_a.turn.cross(&a.spin_world).cross(&beyond)
            + a.spin_world.cross(&beyond_change);
        // Gap at k+1.
        let (normal_end, seen_end) = self.normal_in_a();
        let nearest = arm_end - a.turned * (one.axes * point.width(&seen_end).direction);
        let apart_end = a.origin + a.linear * h + nearest - b.origin - b.linear * h;
        let gap_end = normal_end.dot(&apart_end) - self.contact.features.offset - radius;
        let gap_change = normal_end.dot(
            &(apart + relative * time_step + turn_a.cross(&nearest) + end_stretched(&nearest)
                - turn_b.cross(&apart_end)),
        ) + (b.turned * plane.normal).dot(&apart_end)
            - plane.offset;
        let opening_change = (gap_change - gap_end * (time_step / h)) / h;
        let motion = across(&n, &slip_change) - turned * n.dot(&slip) - n * turned.dot(&slip)
            + turned * (gap_end / h)
            + n * opening_change;
        let moved_arm = arm_change + beyond_change;
        RowChange { motion, turn: n.cross(&turned), arms: [moved_arm, apart + moved_arm] }
    }
}

/// Change of the parameters of the nearest points of two cores (eq. G5). Parameters inside their segments
/// follow the nearest points.
///
/// `ways` are the cores' vectors and `turned` their changes. `apart` is the vector from B's nearest point to A's,
/// and its change at fixed parameters.
pub(super) fn slid(
    curved: &CorePair,
    shares: (f64, f64),
    ways: &[Vector3<f64>; 2],
    turned: [Vector3<f64>; 2],
    (apart, moved): (&Vector3<f64>, &Vector3<f64>),
) -> (f64, f64) {
    let is_free = |core: &Core, share: f64| core.is_segment() && share > 0.0 && share < 1.0;
    let free = (is_free(&curved.of_a, shares.0), is_free(&curved.of_b, shares.1));
    let [u, v] = ways;
    let [rhs_a, rhs_b] = [(u, &turned[0]), (v, &turned[1])]
        .map(|(way, turned)| -(moved.dot(way) + apart.dot(turned)));
    match free {
        (false, false) => (0.0, 0.0),
        (true, false) => (rhs_a / u.dot(u), 0.0),
        (false, true) => (0.0, -rhs_b / v.dot(v)),
        (true, true) => {
            let matrix = Matrix2::new(u.dot(u), -u.dot(v), u.dot(v), -v.dot(v));
            let solved = matrix.lu().solve(&Vector2::new(rhs_a, rhs_b));
            solved.map_or((0.0, 0.0), |slid| (slid[0], slid[1]))
        }
    }
}

/// Way of the nearest point of an ellipsoid to a plane over its surface (G5a): with w = |Sᵀ n_A| and n_A = Aᵀ n,
///
/// ```text
/// A δŷ,   ŷ = −S Sᵀ n_A/w
/// ```
///
/// for a rotation A that changes by `turn` (world) and a normal n that changes by `normal`.
pub(super) fn rolled_over(
    one: &EllipsoidPoint,
    rotation: &Matrix3<f64>,
    turn: &Vector3<f64>,
    (n, normal): (&Vector3<f64>, &Vector3<f64>),
) -> Vector3<f64> {
    let local = rotation.tr_mul(n);
    let square = one.shape.axes * one.shape.axes.transpose();
    let width = one.shape.half_width(&local);
    let change = square * rotation.tr_mul(&(normal - turn.cross(n)));
    let across_local = square * local * (local.dot(&change) / (width * width));
    -(rotation * ((change - across_local) / width))
}

/// Distance of the contact from the end of its features (m): of the nearest points of two cores
/// from the ends of their segments, or of a disc from lying flat.
pub(super) fn room(curved: &Curved, contact: &Contact, a: &Pose, b: Option<&Pose>) -> f64 {
    let pair = match curved {
        Curved::Cores(pair) => pair,
        Curved::Ellipsoid(one) => {
            let normal = contact.features.frame.column(2).into_owned();
            let normal = b.map_or(normal, |b| b.rotation * normal);
            return one.shape.half_width(&a.rotation.tr_mul(&normal));
        }
    };
    let of = |core: &Core, share: f64| {
        let is_inside = core.is_segment() && share > 0.0 && share < 1.0;
        if is_inside { core.along.norm() * share.min(1.0 - share) } else { f64::INFINITY }
    };
    of(&pair.of_a, pair.shares.0).min(of(&pair.of_b, pair.shares.1))
}
