//! A coupling: three rows between two bodies, or between a body and what is fixed, with one law.
//!
//! Equation numbers are those of `docs/native-solver.md`.

use super::law::{Cone, CouplingLaw, CouplingRows, LawRows, NaturalMap, Projection};
use super::settings::{COMPLIANCE, ROLLING_COMPLIANCE};
use crate::contact::Contact;
use crate::joint::Graph;
use nalgebra::{Matrix3, Vector3};

/// Three rows u and their impulse p̂ in a step, as the solver needs them. Vectors are in the world's
/// axes where no frame is named.
#[derive(Debug, Clone, Copy)]
pub(super) struct Coupling {
    /// Where it acts.
    pub(super) lever: Lever,
    /// What the rows are off by at step k over h, m/s: of a contact φ/h along the normal, and across it
    /// what surfaces carry.
    pub(super) offset: Vector3<f64>,
    /// e c_n⁻, m/s, where a contact bounces; 0 elsewhere.
    pub(super) rebound: f64,
    pub(super) rows: CouplingRows,
    pub(super) law: CouplingLaw,
}

/// The point at which a coupling acts, of a body A.
#[derive(Debug, Clone, Copy)]
pub(super) struct Lever {
    /// a, m, frame of A: the middle of the feature that touches, its point where nothing is rounded.
    pub(super) centre: Vector3<f64>,
    /// A a, m.
    pub(super) arm: Vector3<f64>,
    /// ρ, m.
    pub(super) radius: f64,
    /// G = [y]× Aᵀ, m: the torque (frame of A) of an impulse (world) at the touching point y.
    pub(super) torque_map: Matrix3<f64>,
}

impl Coupling {
    /// The coupling of `contact`. `share` is M over the mass of its body A; a gap that opens or closes
    /// at most at the speed `level` (m/s) counts as none.
    pub(super) fn of_contact(contact: &Contact, time_step: f64, share: f64, level: f64) -> Self {
        let (normal, radius) = (contact.normal(), contact.features.radius);
        let tangential = share * contact.response.tangential;
        let normal_response = share * contact.response.normal;
        Self {
            lever: Lever {
                centre: contact.features.point,
                arm: if radius > 0.0 { contact.arm + radius * normal } else { contact.arm },
                radius,
                torque_map: contact.torque_map,
            },
            offset: normal * approach(contact, time_step, level),
            rebound: contact.rebound,
            rows: CouplingRows {
                give: match contact.is_rounded() {
                    true => (ROLLING_COMPLIANCE * tangential / COMPLIANCE).max(1.0),
                    false => 1.0,
                },
                ..CouplingRows::of_contact(contact.frame, tangential, normal_response)
            },
            law: CouplingLaw::Cone(Cone { friction: contact.law.friction }),
        }
    }

    /// The coupling of the anchor of a joint: it acts at `lever` along the axes `frame`, its rows are
    /// off by `offset` (m/s, in these axes) and respond with `response`.
    pub(super) fn of_place(
        lever: Lever,
        frame: Matrix3<f64>,
        offset: Vector3<f64>,
        response: &Vector3<f64>,
        law: CouplingLaw,
    ) -> Self {
        let rows = CouplingRows::of_joint(frame, response);
        Self { lever, offset: frame * offset, rebound: 0.0, rows, law }
    }

    /// That of the turn of a joint, whose impulse about its rows is a torque on A by `torque_map`.
    pub(super) fn of_turn(
        torque_map: Matrix3<f64>,
        response: &Vector3<f64>,
        law: CouplingLaw,
    ) -> Self {
        let zero = Vector3::zeros();
        let rows = CouplingRows::of_joint(Matrix3::identity(), response);
        let lever = Lever { centre: zero, arm: zero, radius: 0.0, torque_map };
        Self { lever, offset: zero, rebound: 0.0, rows, law }
    }

    /// That of rows of which nothing is known but their motion without bodies, `offset` (m/s), and their law.
    pub(super) fn of_rows(rows: CouplingRows, offset: Vector3<f64>, law: CouplingLaw) -> Self {
        let (zero, nothing) = (Vector3::zeros(), Matrix3::zeros());
        let lever = Lever { centre: zero, arm: zero, radius: 0.0, torque_map: nothing };
        Self { lever, offset, rebound: 0.0, rows, law }
    }

    /// The arguments of its law's projections at its motion u and impulse p̂ (m/s, world).
    #[inline]
    pub(super) fn pull(
        &self,
        map: &NaturalMap,
        u: &Vector3<f64>,
        impulse: &Vector3<f64>,
    ) -> Projection {
        self.law.pull(map, &self.rows, u, impulse)
    }

    /// The same, and the natural map (N4) there as a velocity, m/s.
    #[inline(always)]
    pub(super) fn evaluated(
        &self,
        map: &NaturalMap,
        graphs: &[Graph],
        u: &Vector3<f64>,
        impulse: &Vector3<f64>,
    ) -> (Projection, Vector3<f64>) {
        self.law.evaluated(map, LawRows { rows: &self.rows, graphs }, u, impulse)
    }

    /// Whether it is a contact.
    pub(super) fn is_contact(&self) -> bool {
        matches!(self.law, CouplingLaw::Cone(_))
    }

    /// Whether a contact bounces.
    pub(super) fn bounces(&self) -> bool {
        self.rebound != 0.0
    }

    /// u where `departing` is the velocity with which the touching points part after the impulses, of a
    /// contact that bounces: along the normal the smaller one of the gap speed and of what is left of
    /// the rebound (eq. 29). The second is whether that is the latter.
    pub(super) fn bounded(
        &self,
        u: Vector3<f64>,
        departing: &Vector3<f64>,
    ) -> (Vector3<f64>, bool) {
        let normal = &self.rows.normal();
        let (along, left) = (normal.dot(&u), normal.dot(departing) - self.rebound);
        if left >= along { (u, false) } else { (u + normal * (left - along), true) }
    }
}

/// φ/h of a contact at step k, m/s; 0 where it is at most `level`.
pub(super) fn approach(contact: &Contact, time_step: f64, level: f64) -> f64 {
    let approach = contact.gap / time_step;
    if approach.abs() <= level { 0.0 } else { approach }
}
