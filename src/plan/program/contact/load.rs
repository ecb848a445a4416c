//! How forces at a point of A load both bodies, and the derivatives of it: those of a contact, and those of a joint's place.

use super::{Side, Turned, put_symmetric_block};
use crate::mechanics::State;
use crate::step_nlp::entries::EntrySink;
use crate::step_nlp::layout::{ATTITUDE, POSITION, SPIN_ROWS, VELOCITY_ROWS};
use crate::step_nlp::several::component::weighted;
use nalgebra::{Matrix3, Matrix3x4, SMatrix, Vector3, Vector4};

/// A point of A at which forces along three directions of B act, on both bodies.
#[derive(Clone)]
pub(in super::super) struct Arm {
    /// a.
    point: Turned,
    /// e_j × a, and e_j where the feature is rounded.
    levers: [Turned; 3],
    axes: Option<[Turned; 3]>,
    pub(super) radius: f64,
    /// t₁, t₂, n in the frame of B.
    pub(super) directions: [Vector3<f64>; 3],
}

/// A variable that acts: along which direction, its column, and how much of it does.
pub(in super::super) type Acts = (usize, usize, f64);

/// Forces at the point of an [`Arm`] in a step: their bodies, their sizes along the directions, and the variables that they are
/// made of.
#[derive(Clone, Copy)]
pub(in super::super) struct Pull<'a> {
    pub(in super::super) a: Side<'a>,
    pub(in super::super) b: Option<Side<'a>>,
    pub(in super::super) sizes: [f64; 3],
    pub(in super::super) acts: &'a [Acts],
}

impl Arm {
    /// At the point `point` of A, along the columns of `frame`; of a feature rounded by `radius`.
    pub(in super::super) fn new(point: &Vector3<f64>, frame: &Matrix3<f64>, radius: f64) -> Self {
        let axis = |j: usize| Vector3::ith(j, 1.0);
        Self {
            point: Turned::new(*point),
            levers: [0, 1, 2].map(|j| Turned::new(axis(j).cross(point))),
            axes: (radius != 0.0).then(|| [0, 1, 2].map(|j| Turned::new(axis(j)))),
            radius,
            directions: [0, 1, 2].map(|axis| frame.column(axis).into_owned()),
        }
    }

    /// The force along the frame of B.
    fn force(&self, sizes: &[f64; 3]) -> Vector3<f64> {
        self.directions.iter().zip(sizes).map(|(direction, size)| direction * *size).sum()
    }

    /// Adds the forces to the rows of both motions.
    pub(in super::super) fn add_rows(&self, pull: &Pull<'_>, rows: &mut [f64]) {
        let acting = Acting::new(self, pull);
        let given = acting.given(&self.force(&pull.sizes));
        let force = &given.force.0;
        pull.a.motion.add_load(force, &acting.on_a(&given), &mut rows[pull.a.row..]);
        if let Some(b) = pull.b {
            b.motion.add_load(&-force, &acting.on_b(&given), &mut rows[b.row..]);
        }
    }

    /// The slopes of these rows by the forces and by the poses of the step's start.
    pub(in super::super) fn emit_slopes(&self, pull: &Pull<'_>, sink: &mut impl EntrySink) {
        let acting = Acting::new(self, pull);
        let whole = acting.given(&self.force(&pull.sizes));
        let (a, velocity) = (&pull.a, pull.a.motion.velocity_per_force);
        for &(axis, column, share) in pull.acts {
            let alone = acting.given(&(self.directions[axis] * share));
            let force = &alone.force.0;
            let twist = a.motion.spin_per_torque * acting.on_a(&alone);
            for k in 0..3 {
                if pull.b.is_some() || self.directions[axis][k] != 0.0 {
                    sink.put(a.row + VELOCITY_ROWS.start + k, column, velocity * force[k]);
                }
                sink.put(a.row + SPIN_ROWS.start + k, column, twist[k]);
            }
            if let Some(b) = pull.b {
                let twist = b.motion.spin_per_torque * acting.on_b(&alone);
                for k in 0..3 {
                    let push = -b.motion.velocity_per_force * force[k];
                    sink.put(b.row + VELOCITY_ROWS.start + k, column, push);
                    sink.put(b.row + SPIN_ROWS.start + k, column, twist[k]);
                }
            }
        }
        // The torque on A by both attitudes.
        let (by_a, by_b) = acting.torque_slopes(&whole);
        let at = a.row + SPIN_ROWS.start;
        let block = a.motion.spin_per_torque * by_a;
        sink.put_block((at, a.columns.0 + ATTITUDE.start), &block);
        let Some(b) = pull.b else { return };
        let attitude = b.columns.0 + ATTITUDE.start;
        sink.put_block((at, attitude), &(a.motion.spin_per_torque * by_b));
        let slope = &whole.force.1;
        sink.put_block((a.row + VELOCITY_ROWS.start, attitude), &(slope * velocity));
        let push = slope * -b.motion.velocity_per_force;
        sink.put_block((b.row + VELOCITY_ROWS.start, attitude), &push);
        // That on B: −w·(g × e_j), of which w moves with all poses.
        let at = b.row + SPIN_ROWS.start;
        let (mut by_position, mut by_a, mut by_b) =
            (SMatrix::<f64, 3, 3>::zeros(), Matrix3x4::zeros(), Matrix3x4::zeros());
        for j in 0..3 {
            let across = Turned::new(whole.g.vector.cross(&Vector3::ith(j, 1.0)));
            let (direction, slope) = across.at(&b.start.attitude);
            by_position.set_row(j, &-direction.transpose());
            by_a.set_row(j, &-acting.arm.1.tr_mul(&direction).transpose());
            by_b.set_row(j, &-slope.tr_mul(&acting.apart).transpose());
        }
        let twist = &b.motion.spin_per_torque;
        sink.put_block((at, a.columns.0 + POSITION.start), &(twist * by_position));
        sink.put_block((at, b.columns.0 + POSITION.start), &(twist * -by_position));
        sink.put_block((at, a.columns.0 + ATTITUDE.start), &(twist * by_a));
        sink.put_block((at, attitude), &(twist * by_b));
    }

    /// The curvatures of what the force does to both motions. With Y the weights of force and torque on A and
    /// on B, p = Y_A − Y_B of the force, α = Y_τA × a, β = Y_τA, γ = g × Y_τB and g the force in B it is that of
    ///
    /// ```text
    /// (p + A_A α)·A_B g − ρ (A_A β)·A_B (n × g) − (A_B γ)·s                            (eq. P21)
    /// ```
    pub(in super::super) fn emit_curvatures(
        &self,
        pull: &Pull<'_>,
        y: &[f64],
        sink: &mut impl EntrySink,
    ) {
        let (a, b) = (&pull.a, pull.b);
        let (push, beta) = a.motion.load_weights(&y[a.row..]);
        let of_b = b.map(|b| b.motion.load_weights(&y[b.row..]));
        let p = of_b.map_or(push, |(of_force, _)| push - of_force);
        let (q, rho) = (&a.start.attitude, self.radius);
        let acting = Acting::new(self, pull);
        let alpha = Turned::new(beta.cross(&self.point.vector));
        let (alpha_at, alpha_slope) = alpha.at(q);
        let beta = Turned::new(beta);
        let (beta_at, beta_slope) = beta.at(q);
        let gamma = |g: &Vector3<f64>| {
            let (_, of_torque) = of_b?;
            let across = Turned::new(g.cross(&of_torque));
            let seen = across.of(acting.attitude.as_ref());
            Some((across, seen))
        };
        let first = a.columns.0;

        let whole = acting.given(&self.force(&pull.sizes));
        let mut own = weighted(&alpha.forms, &whole.force.0);
        if let Some((_, about)) = &whole.about {
            own -= weighted(&beta.forms, &about.0) * rho;
        }
        let across = gamma(&whole.g.vector);
        if let Some((_, (across_at, _))) = &across {
            own -= weighted(&self.point.forms, across_at);
        }
        sink.put_lower(first + ATTITUDE.start, &own);
        if let (Some(b), Some((across, (_, across_slope)))) = (b, &across) {
            let other = b.columns.0;
            let mut own =
                weighted(&whole.g.forms, &(p + alpha_at)) - weighted(&across.forms, &acting.apart);
            let mut both = alpha_slope.tr_mul(&whole.force.1) - acting.arm.1.tr_mul(across_slope);
            if let Some((about, (_, about_slope))) = &whole.about {
                own -= weighted(&about.forms, &beta_at) * rho;
                both -= beta_slope.tr_mul(about_slope) * rho;
            }
            let at = other + ATTITUDE.start;
            sink.put_lower(at, &own);
            put_symmetric_block((first + ATTITUDE.start, at), &both, sink);
            put_symmetric_block((first + POSITION.start, at), &-across_slope, sink);
            put_symmetric_block((other + POSITION.start, at), across_slope, sink);
        }
        for &(axis, column, share) in pull.acts {
            let direction = self.directions[axis] * share;
            let alone = acting.given(&direction);
            let across = gamma(&direction);
            let mut by_a = alpha_slope.tr_mul(&alone.force.0);
            let mut by_b = alone.force.1.tr_mul(&(p + alpha_at));
            if let Some((_, (about, about_slope))) = &alone.about {
                by_a -= beta_slope.tr_mul(about) * rho;
                by_b -= about_slope.tr_mul(&beta_at) * rho;
            }
            if let Some((_, (across_at, across_slope))) = &across {
                by_a -= acting.arm.1.tr_mul(across_at);
                by_b -= across_slope.tr_mul(&acting.apart);
            }
            for k in 0..4 {
                sink.put_symmetric(column, first + ATTITUDE.start + k, by_a[k]);
            }
            let (Some(b), Some((_, (across_at, _)))) = (b, &across) else { continue };
            let other = b.columns.0;
            for k in 0..4 {
                sink.put_symmetric(column, other + ATTITUDE.start + k, by_b[k]);
            }
            for k in 0..3 {
                sink.put_symmetric(column, first + POSITION.start + k, -across_at[k]);
                sink.put_symmetric(column, other + POSITION.start + k, across_at[k]);
            }
        }
    }
}

/// How forces at the touching point act at the poses of the step's start. Of a force g, given in the frame of B,
///
/// ```text
/// on A: A_B g,   a × A_Aᵀ A_B g − ρ A_Aᵀ A_B (n × g);   on B: −A_B g,   −(w − ρ n) × g      (eq. P12)
/// ```
///
/// with w = A_Bᵀ s, s = r_A + A_A a − r_B.
struct Acting<'a> {
    at: &'a Arm,
    /// A_A (e_j × a), and A_A e_j where the feature is rounded, with their slopes by q_A.
    levers: [Seen; 3],
    axes: Option<[Seen; 3]>,
    /// A_A a; s.
    arm: Seen,
    apart: Vector3<f64>,
    /// q_B.
    attitude: Option<Vector4<f64>>,
}

/// A vector turned to the world, and its slope by the attitude that turned it.
type Seen = (Vector3<f64>, Matrix3x4<f64>);

/// A force g in the frame of B: A_B g and A_B (n × g).
struct Given {
    g: Turned,
    force: Seen,
    about: Option<(Turned, Seen)>,
}

impl<'a> Acting<'a> {
    fn new(at: &'a Arm, pull: &Pull<'_>) -> Self {
        let start: &State = pull.a.start;
        let q = &start.attitude;
        let arm = at.point.at(q);
        let mut apart = start.position + arm.0;
        if let Some(b) = pull.b {
            apart -= b.start.position;
        }
        let axes = |forms: &[Turned; 3]| [0, 1, 2].map(|j| forms[j].at(q));
        Self {
            at,
            levers: [0, 1, 2].map(|j| at.levers[j].at(q)),
            axes: at.axes.as_ref().map(axes),
            arm,
            apart,
            attitude: pull.b.map(|b| b.start.attitude),
        }
    }

    fn given(&self, g: &Vector3<f64>) -> Given {
        let (attitude, normal) = (self.attitude.as_ref(), &self.at.directions[2]);
        let g = Turned::new(*g);
        let force = g.of(attitude);
        let about = self.axes.is_some().then(|| {
            let about = Turned::new(normal.cross(&g.vector));
            let seen = about.of(attitude);
            (about, seen)
        });
        Given { g, force, about }
    }

    /// The torque (body) on A.
    fn on_a(&self, given: &Given) -> Vector3<f64> {
        let mut torque = Vector3::from_fn(|j, _| self.levers[j].0.dot(&given.force.0));
        if let (Some(axes), Some((_, about))) = (&self.axes, &given.about) {
            torque -= Vector3::from_fn(|j, _| axes[j].0.dot(&about.0)) * self.at.radius;
        }
        torque
    }

    /// The torque (body) on B.
    fn on_b(&self, given: &Given) -> Vector3<f64> {
        let Some(q) = &self.attitude else { return Vector3::zeros() };
        Vector3::from_fn(|j, _| {
            let across = given.g.vector.cross(&Vector3::ith(j, 1.0));
            let rounded = self.at.directions[2].dot(&across) * self.at.radius;
            rounded - Turned::new(across).at(q).0.dot(&self.apart)
        })
    }

    /// The torque on A by q_A and by q_B.
    fn torque_slopes(&self, given: &Given) -> (Matrix3x4<f64>, Matrix3x4<f64>) {
        let (mut by_a, mut by_b) = (Matrix3x4::zeros(), Matrix3x4::zeros());
        for j in 0..3 {
            let (lever, slope) = &self.levers[j];
            let mut of_a = slope.tr_mul(&given.force.0);
            let mut of_b = given.force.1.tr_mul(lever);
            if let (Some(axes), Some((_, about))) = (&self.axes, &given.about) {
                of_a -= axes[j].1.tr_mul(&about.0) * self.at.radius;
                of_b -= about.1.tr_mul(&axes[j].0) * self.at.radius;
            }
            by_a.set_row(j, &of_a.transpose());
            by_b.set_row(j, &of_b.transpose());
        }
        (by_a, by_b)
    }
}
