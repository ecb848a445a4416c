//! Relative motion of two round features in a step, and its derivative by the velocities of their
//! bodies.
//!
//! Equation numbers refer to `docs/native-solver.md`.

use super::coupling::Coupling;
use super::fixed_motion::rolling;
use super::pair_motion::beside;
use super::turning::BodyTurning;
use crate::contact::CorePair;
use crate::contact::curved::{Core, Reach, closest_vector};
use nalgebra::{Matrix3, Matrix3x6, Vector3};

/// Additional data of a coupling of two round features.
#[derive(Debug, Clone, Copy)]
pub(super) struct RoundRows {
    pub(super) curved: CorePair,
    /// d (m, world): from the centre of B's feature to that of A's at step k.
    pub(super) offset_vector: Vector3<f64>,
    /// φ/h at step k (m/s).
    pub(super) approach: f64,
    /// Surface velocity (m/s, world).
    pub(super) carried: Vector3<f64>,
}

/// One of the two bodies.
#[derive(Clone, Copy)]
pub(super) struct RoundSide<'a> {
    /// A(q) at the start of the step, body → world.
    pub(super) rotation: &'a Matrix3<f64>,
    pub(super) turning: &'a BodyTurning,
    /// v⁺ (m/s, world).
    pub(super) linear: &'a Vector3<f64>,
}

impl RoundSide<'_> {
    /// Mean velocity of the body's point c, v + A K c (m/s).
    pub(super) fn velocity(&self, point: &Vector3<f64>) -> Vector3<f64> {
        self.linear + self.turning.swept(point)
    }

    /// A⁺ c of a direction c.
    fn direction_at_end(&self, along: &Vector3<f64>, time_step: f64) -> Vector3<f64> {
        self.rotation * along + self.turning.swept(along) * time_step
    }
}

/// Motion of two round features.
///
/// a and b are the nearest centres at k, d = a − b, and D is the shortest distance vector of the
/// cores at the end:
///
/// ```text
/// u_t = (E − n nᵀ) (v_A + A_A K_A a − v_B − A_B K_B b) − (ρ_A A_A ω_A + ρ_B A_B ω_B) × n
/// u_n = (|D|_n − |d| + φ)/h                                                  (N14)
/// ```
///
/// With m the direction of D (eq. 4b) and a⁺, b⁺ the nearest centres at the end,
///
/// ```text
/// ∂u_n/∂(v_A, ω_A) = mᵀ (E, S_A(a⁺)),   ∂u_n/∂(v_B, ω_B) = −mᵀ (E, S_B(b⁺))
/// ```
pub(super) struct RoundMotion<'a> {
    coupling: &'a Coupling,
    round: &'a RoundRows,
    curved: &'a CorePair,
    a: RoundSide<'a>,
    b: Option<RoundSide<'a>>,
    /// Difference of the centres' velocities, before the projection (E − n nᵀ) (m/s).
    apart: Vector3<f64>,
    /// Relative positions of the nearest points along both cores at the end.
    shares: (f64, f64),
    reach: Reach,
    /// (|D|_n − |d|)/h (m/s).
    opening: f64,
}

impl<'a> RoundMotion<'a> {
    /// Motion of a coupling in a step of `time_step` (s).
    pub(super) fn new(
        coupling: &'a Coupling,
        round: &'a RoundRows,
        a: RoundSide<'a>,
        b: Option<RoundSide<'a>>,
        time_step: f64,
    ) -> Self {
        let curved = &round.curved;
        let mut apart = a.velocity(&coupling.lever.centre);
        let mut of_b = curved.of_b.along;
        if let Some(b) = &b {
            apart -= b.velocity(&curved.foot());
            of_b = b.direction_at_end(&of_b, time_step);
        }
        let of_a = a.direction_at_end(&curved.of_a.along, time_step);
        let was = round.offset_vector;
        // Relative to the centre of B at k, without world positions.
        let middle = was + apart * time_step;
        let core_a = Core { from: middle - of_a * curved.shares.0, along: of_a };
        let core_b = Core { from: of_b * -curved.shares.1, along: of_b };
        let (shares, offset_vector) = closest_vector(&core_a, &core_b);
        let normal = coupling.rows.normal();
        let [before, reach] = [was, offset_vector].map(|vector| Reach::new(&vector, &normal));
        let opening = reach.beyond(&offset_vector, (&was, &before)) / time_step;
        Self { coupling, round, curved, a, b, apart, shares, reach, opening }
    }

    /// u (N14) (m/s).
    pub(super) fn u(&self) -> Vector3<f64> {
        let normal = &self.coupling.rows.normal();
        let mut rolling = self.a.turning.spin_world() * self.coupling.lever.radius;
        if let Some(b) = &self.b {
            rolling += b.turning.spin_world() * self.curved.radius;
        }
        let slip = self.apart - normal * normal.dot(&self.apart) - rolling.cross(normal)
            + self.round.carried;
        slip + normal * (self.opening + self.round.approach)
    }

    /// ∂u/∂(v_A, ω_A) and ∂u/∂(v_B, ω_B).
    pub(super) fn slopes(&self) -> (Matrix3x6<f64>, Option<Matrix3x6<f64>>) {
        let normal = &self.coupling.rows.normal();
        let lever = &self.coupling.lever;
        let (curved, shares) = (self.curved, self.shares);
        let along = normal * self.reach.direction.transpose();
        let across = Matrix3::identity() - normal * normal.transpose();
        let slopes = |side: &RoundSide<'_>, middle: &Vector3<f64>, end: &Vector3<f64>| {
            let slope = |point| side.turning.slope_of(side.rotation, point);
            (across + along, across * slope(middle) + along * slope(end))
        };
        let (linear, spin) = slopes(&self.a, &lever.centre, &curved.of_a.at(shares.0));
        let by_a = beside(&linear, &(spin + rolling(normal, lever.radius, self.a.rotation)));
        let by_b = self.b.as_ref().map(|b| {
            let (linear, spin) = slopes(b, &curved.foot(), &curved.of_b.at(shares.1));
            beside(&-linear, &(rolling(normal, curved.radius, b.rotation) - spin))
        });
        (by_a, by_b)
    }
}
