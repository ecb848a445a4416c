//! Coupling: constraint of three rows with one law, between two bodies or a body and a fixed
//! object.
//!
//! Equation numbers refer to `docs/native-solver.md`.

use super::law::{Cone, CouplingLaw, CouplingRows, LawRows, MomentLaw, NaturalMap, Projection};
use super::settings::{COMPLIANCE, ROLLING_COMPLIANCE};
use crate::contact::{Contact, FrictionTensor};
use crate::joint::Graph;
use nalgebra::{Matrix3, Vector3};

/// Three rows u and their impulse p̂ in a step, as input of the solver. Vectors are in world axes
/// unless a frame is named.
#[derive(Debug, Clone, Copy)]
pub(super) struct Coupling {
    /// Point of action.
    pub(super) lever: Lever,
    /// Position error of the rows at step k, over h (m/s). For a contact: φ/h along the normal and
    /// the surface velocity across it.
    pub(super) offset: Vector3<f64>,
    /// e c_n⁻ (m/s) of a bouncing contact, otherwise 0.
    pub(super) rebound: f64,
    pub(super) rows: CouplingRows,
    pub(super) law: CouplingLaw,
}

/// Point of a body A at which a coupling acts.
#[derive(Debug, Clone, Copy)]
pub(super) struct Lever {
    /// a (m, frame of A): centre of the touching feature, or its point if not rounded.
    pub(super) centre: Vector3<f64>,
    /// A a (m).
    pub(super) arm: Vector3<f64>,
    /// ρ (m).
    pub(super) radius: f64,
    /// G = [y]× Aᵀ (m): maps an impulse (world) at the touching point y to its torque (frame of A).
    pub(super) torque_map: Matrix3<f64>,
}

impl Coupling {
    /// Coupling of `contact`.
    ///
    /// `share` is M over the mass of its body A. A gap that opens or closes at most at the speed
    /// `level` (m/s) is treated as zero.
    pub(super) fn from_contact(contact: &Contact, time_step: f64, share: f64, level: f64) -> Self {
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
                compliance_ratio: if contact.is_rounded() {
                    (ROLLING_COMPLIANCE * tangential / COMPLIANCE).max(1.0)
                } else {
                    1.0
                },
                adhesion: contact.law.adhesion / share,
                ..CouplingRows::from_contact(contact.frame, tangential, normal_response)
            },
            law: CouplingLaw::Cone(Cone { friction: contact.law.friction }),
        }
    }

    /// Coupling of a joint's anchor, acting at `lever` along the axes `frame`.
    ///
    /// `offset` is the position error over h (m/s) in these axes. `response` is the response of
    /// each row.
    pub(super) fn from_place(
        lever: Lever,
        frame: Matrix3<f64>,
        offset: Vector3<f64>,
        response: &Vector3<f64>,
        law: CouplingLaw,
    ) -> Self {
        let rows = CouplingRows::from_joint(frame, response);
        Self { lever, offset: frame * offset, rebound: 0.0, rows, law }
    }

    /// Coupling of a joint's rotation. `torque_map` maps its impulse to a torque on A. It has no
    /// offset, because the rows (J4) contain the error at the start of the step.
    pub(super) fn from_turn(
        torque_map: Matrix3<f64>,
        response: &Vector3<f64>,
        law: CouplingLaw,
    ) -> Self {
        let zero = Vector3::zeros();
        let rows = CouplingRows::from_joint(Matrix3::identity(), response);
        let lever = Lever { centre: zero, arm: zero, radius: 0.0, torque_map };
        Self { lever, offset: zero, rebound: 0.0, rows, law }
    }

    /// Coupling of a contact's moment along the axes `frame` of the contact. `torque_map` maps its impulse
    /// to a torque on A.
    pub(super) fn from_moment(
        frame: Matrix3<f64>,
        torque_map: Matrix3<f64>,
        response: &Vector3<f64>,
        law: MomentLaw,
    ) -> Self {
        let rows = CouplingRows::from_joint(frame, response);
        Self { rows, ..Self::from_turn(torque_map, response, CouplingLaw::Moment(law)) }
    }

    /// Coupling of abstract rows with a law. `offset` is their motion without bodies (m/s).
    pub(super) fn from_rows(rows: CouplingRows, offset: Vector3<f64>, law: CouplingLaw) -> Self {
        let (zero, nothing) = (Vector3::zeros(), Matrix3::zeros());
        let lever = Lever { centre: zero, arm: zero, radius: 0.0, torque_map: nothing };
        Self { lever, offset, rebound: 0.0, rows, law }
    }

    /// Projection arguments and the natural map (N4) as a velocity (m/s), after the projections of the
    /// `earlier` couplings.
    #[inline(always)]
    pub(super) fn evaluated(
        &self,
        map: &NaturalMap,
        graphs: &[Graph],
        earlier: &[Projection],
        u: &Vector3<f64>,
        impulse: &Vector3<f64>,
    ) -> (Projection, Vector3<f64>) {
        self.law.evaluated(map, LawRows { rows: &self.rows, graphs }, earlier, u, impulse)
    }

    pub(super) fn is_contact(&self) -> bool {
        matches!(self.law, CouplingLaw::Cone(_) | CouplingLaw::Ellipse(_))
    }

    /// Makes the friction of a contact depend on the direction.
    pub(super) fn set_friction_tensor(&mut self, tensor: &FrictionTensor) {
        if let CouplingLaw::Cone(cone) = self.law {
            self.rows.frame = tensor.frame(&self.rows.frame);
            self.rows.stretch = tensor.stretch();
            self.law = CouplingLaw::Ellipse(cone);
        }
    }

    /// True for a bouncing contact.
    pub(super) fn bounces(&self) -> bool {
        self.rebound != 0.0
    }

    /// u of a bouncing contact (eq. 29), and true if the rebound determines its normal part.
    ///
    /// The normal part is the smaller of the gap speed and the remaining rebound. `departing` is
    /// the relative velocity of the touching points after the impulses (m/s).
    pub(super) fn bounded(
        &self,
        u: Vector3<f64>,
        departing: &Vector3<f64>,
    ) -> (Vector3<f64>, bool) {
        let normal = &self.rows.normal();
        let along = normal.dot(&u);
        let left = normal.dot(departing) - self.rebound;
        if left >= along { (u, false) } else { (u + normal * (left - along), true) }
    }
}

/// φ/h of a contact at step k (m/s), set to zero up to `level`.
pub(super) fn approach(contact: &Contact, time_step: f64, level: f64) -> f64 {
    let approach = contact.gap / time_step;
    if approach.abs() <= level { 0.0 } else { approach }
}
