//! Answers of statics with the names of a scene, as `--json` and Python have them.

use crate::scene::Scene;
use serde::Serialize;
use tumble::statics::{
    ForceCheck, ForceState, FrictionLimit, FromRest, Limit, LoadCase, Mechanism, MechanismCheck,
    Slope, Structure, Verdict, WeakSpot,
};
use tumble_core::contact::Partner;
use tumble_model::failure::Failure;

/// Answer about a scene at rest.
#[derive(Debug, Clone, Serialize)]
pub struct Report {
    /// Name of the scene.
    pub name: String,
    /// "equilibrium", "none" or "undecided".
    pub verdict: &'static str,
    /// True if forces balance all bodies.
    pub stands: bool,
    /// Number of bodies.
    pub bodies: usize,
    /// Check of the forces in `contacts`; `None` without a force state.
    pub force_check: Option<ForceReport>,
    /// Check of the velocities in `mechanism`; `None` without one.
    pub mechanism_check: Option<MechanismReport>,
    /// Contacts, with their forces if forces balance all bodies.
    pub contacts: Vec<ContactForce>,
    /// Velocities that prove that no forces do.
    pub mechanism: Vec<BodyMotion>,
    /// The step that the simulator takes from rest; `None` for a worst case, whose friction it does not have.
    pub simulator: Option<SimulatorReport>,
    /// Range of friction whose worst case this is.
    pub friction: Option<[f64; 2]>,
    /// Largest factor on a load.
    pub limit: Option<LimitReport>,
    /// Smallest friction.
    pub least_friction: Option<FrictionReport>,
}

/// Step of the simulator from rest.
#[derive(Debug, Clone, Serialize)]
pub struct SimulatorReport {
    /// True if a body moves.
    pub moves: bool,
    /// Largest speed of a body at its end (m/s).
    pub speed: f64,
    /// Status of the step.
    pub status: String,
}

/// Check of a force state.
#[derive(Debug, Clone, Serialize)]
pub struct ForceReport {
    /// Largest imbalance of a body (N).
    pub imbalance: f64,
    /// Sum of all loads (N).
    pub loads: f64,
    /// Smallest cone margin (N).
    pub cone_margin: f64,
    /// True if the certificate holds.
    pub holds: bool,
}

/// Check of a mechanism.
#[derive(Debug, Clone, Serialize)]
pub struct MechanismReport {
    /// Power of the loads (W).
    pub power: f64,
    /// Largest violation of the dilation (m/s).
    pub violation: f64,
    /// Sum of forces that it excludes (N); `None` if it excludes all.
    pub excluded: Option<f64>,
    /// True if the certificate holds.
    pub holds: bool,
}

/// A contact, and its force on the first object.
#[derive(Debug, Clone, Serialize)]
pub struct ContactForce {
    /// Both objects.
    pub between: [String; 2],
    /// Point (m).
    pub point: [f64; 3],
    /// Normal, towards the first object.
    pub normal: [f64; 3],
    /// Coefficient of friction.
    pub friction: f64,
    /// Force (N); `None` without a force state.
    pub force: Option<[f64; 3]>,
}

/// Velocity of a body in a mechanism.
#[derive(Debug, Clone, Serialize)]
pub struct BodyMotion {
    /// Name.
    pub body: String,
    /// Velocity (m/s).
    pub velocity: [f64; 3],
    /// Angular velocity (rad/s, world).
    pub angular_velocity: [f64; 3],
}

/// Largest factor on a load.
#[derive(Debug, Clone, Serialize)]
pub struct LimitReport {
    /// "push", "mass", "tilt" or "base".
    pub load: &'static str,
    /// "factor", "unlimited", "never" or "undecided".
    pub result: &'static str,
    /// Factor of the force state; a tilt has the tangent of its angle.
    pub factor: Option<f64>,
    /// Factor above which the mechanism excludes all forces.
    pub upper: Option<f64>,
    /// Check of the forces at the factor.
    pub force_check: Option<ForceReport>,
    /// Check of the mechanism at the factor times 1 + 10⁻⁶.
    pub mechanism_check: Option<MechanismReport>,
    /// Velocities of the mechanism, with a power of the load of 1 W.
    pub mechanism: Vec<BodyMotion>,
    /// Pairs in the order of their part in the mechanism.
    pub weak: Vec<WeakPair>,
    /// Derivatives of the factor by the coefficient of friction of each pair.
    pub friction_slopes: Vec<PairSlope>,
    /// Derivatives of the factor by the mass of each body.
    pub mass_slopes: Vec<MassSlope>,
    /// Derivatives by fields and translations.
    pub slopes: Vec<FieldSlope>,
}

/// Part of a pair in a mechanism.
#[derive(Debug, Clone, Serialize)]
pub struct WeakPair {
    /// Both objects.
    pub between: [String; 2],
    /// Largest relative speed of their contacts, as a fraction of the largest of all.
    pub part: f64,
    /// Normal part of this speed: 1 for a contact that opens straight, 0 for one that slides.
    pub opening: f64,
}

/// Derivative by the friction of a pair.
#[derive(Debug, Clone, Serialize)]
pub struct PairSlope {
    /// Both objects.
    pub between: [String; 2],
    /// Derivative.
    pub slope: f64,
}

/// Derivative by the mass of a body.
#[derive(Debug, Clone, Serialize)]
pub struct MassSlope {
    /// Name.
    pub body: String,
    /// Derivative (1/kg).
    pub slope: f64,
}

/// Derivative by a field or a translation.
#[derive(Debug, Clone, Serialize)]
pub struct FieldSlope {
    /// Field.
    pub by: String,
    /// Derivative; `None` without a limit, or if the contacts change.
    pub slope: Option<f64>,
    /// Difference quotients below and above.
    pub sides: Option<[f64; 2]>,
    /// True if all three agree.
    pub is_unique: bool,
}

/// Smallest friction.
#[derive(Debug, Clone, Serialize)]
pub struct FrictionReport {
    /// "factor", "frictionless", "never" or "undecided".
    pub result: &'static str,
    /// Smallest factor on all coefficients, of the force state.
    pub factor: Option<f64>,
    /// Factor of the mechanism.
    pub lower: Option<f64>,
}

impl From<ForceCheck> for ForceReport {
    fn from(check: ForceCheck) -> Self {
        let ForceCheck { imbalance, loads, cone_margin, holds, .. } = check;
        Self {
            imbalance,
            loads,
            cone_margin: if cone_margin.is_finite() { cone_margin } else { 0.0 },
            holds,
        }
    }
}

impl From<MechanismCheck> for MechanismReport {
    fn from(check: MechanismCheck) -> Self {
        let MechanismCheck { power, violation, excluded, holds, .. } = check;
        Self { power, violation, excluded: excluded.is_finite().then_some(excluded), holds }
    }
}

/// Names of both objects of a pair.
fn between(scene: &Scene, (body, partner): (usize, Partner)) -> [String; 2] {
    [scene.bodies[body].clone(), scene.partner(partner).to_owned()]
}

fn motions(scene: &Scene, mechanism: &Mechanism) -> Vec<BodyMotion> {
    let bodies = scene.bodies.iter().zip(&mechanism.velocities);
    let motion = |(body, twist): (&String, &tumble::statics::Twist)| BodyMotion {
        body: body.clone(),
        velocity: twist.linear.into(),
        angular_velocity: twist.angular.into(),
    };
    bodies.map(motion).collect()
}

impl Report {
    pub(super) fn new(
        scene: &Scene,
        structure: &Structure,
        verdict: &Verdict,
        from_rest: Option<FromRest>,
    ) -> Self {
        let (forces, mechanism): (Option<&ForceState>, Option<&Mechanism>) = match verdict {
            Verdict::Equilibrium(forces) => (Some(forces), None),
            Verdict::None(mechanism) => (None, Some(mechanism)),
            Verdict::Undecided => (None, None),
        };
        let loads = structure.loads();
        let contact = |(index, contact): (usize, &tumble::statics::ContactRow)| ContactForce {
            between: [
                scene.bodies[contact.key.body].clone(),
                scene.partner(contact.key.partner).to_owned(),
            ],
            point: contact.point.into(),
            normal: contact.normal.into(),
            friction: contact.friction,
            force: forces.map(|forces| forces.contacts[index].force.into()),
        };
        Self {
            name: scene.name.clone(),
            verdict: verdict.name(),
            stands: forces.is_some(),
            bodies: scene.bodies.len(),
            force_check: forces.map(|forces| structure.check_forces(forces, loads).into()),
            mechanism_check: mechanism
                .map(|mechanism| structure.check_mechanism(mechanism, loads).into()),
            contacts: structure.contacts().iter().enumerate().map(contact).collect(),
            mechanism: mechanism.map_or_else(Vec::new, |mechanism| motions(scene, mechanism)),
            simulator: from_rest.map(|step| SimulatorReport {
                moves: step.moves,
                speed: step.speed,
                status: step.status.to_string(),
            }),
            friction: None,
            limit: None,
            least_friction: None,
        }
    }

    /// The answer as one JSON object.
    ///
    /// # Errors
    /// None that is known: all numbers and names can be written.
    pub fn text(&self) -> Result<String, Failure> {
        let text = serde_json::to_string_pretty(self);
        text.map_err(|error| Failure::Other(format!("the answer cannot be written: {error}")))
    }

    /// True if the structure stands, and every limit that was asked for has its certificates.
    pub fn is_certain(&self) -> bool {
        let is_found = |limit: &LimitReport| ["factor", "unlimited"].contains(&limit.result);
        let friction = self.least_friction.as_ref();
        self.stands
            && self.limit.as_ref().is_none_or(is_found)
            && friction.is_none_or(|friction| friction.factor.is_some())
    }
}

impl LimitReport {
    pub(super) fn new(
        scene: &Scene,
        structure: &Structure,
        load: &'static str,
        limit: &Limit,
        case: &LoadCase,
    ) -> Self {
        let mut report = Self {
            load,
            result: limit.name(),
            factor: None,
            upper: None,
            force_check: None,
            mechanism_check: None,
            mechanism: Vec::new(),
            weak: Vec::new(),
            friction_slopes: Vec::new(),
            mass_slopes: Vec::new(),
            slopes: Vec::new(),
        };
        let Limit::Factor { lower, upper, forces, mechanism } = limit else { return report };
        let at = |factor: f64| structure.loads().plus(factor, case);
        (report.factor, report.upper) = (Some(*lower), Some(*upper));
        report.force_check = Some(structure.check_forces(forces, &at(*lower)).into());
        report.mechanism_check =
            Some(structure.check_mechanism(mechanism, &at(structure.above(*lower, case))).into());
        report.mechanism = motions(scene, mechanism);
        for spot in structure.weak_contacts(mechanism) {
            let between = between(scene, structure.pair(spot.contact));
            if report.weak.iter().all(|known| known.between != between) {
                let WeakSpot { part, opening, .. } = spot;
                report.weak.push(WeakPair { between, part, opening });
            }
        }
        let slopes = structure.friction_slopes(limit).into_iter();
        let named = |(pair, slope)| PairSlope { between: between(scene, pair), slope };
        report.friction_slopes = slopes.map(named).collect();
        let slopes = scene.bodies.iter().zip(structure.mass_slopes(limit, case));
        let named = |(body, slope): (&String, f64)| MassSlope { body: body.clone(), slope };
        report.mass_slopes = slopes.map(named).collect();
        report
    }
}

impl FieldSlope {
    pub(super) fn new(by: String, slope: Option<Slope>) -> Self {
        Self {
            by,
            slope: slope.map(|found| found.value),
            sides: slope.map(|found| found.sides),
            is_unique: slope.is_some_and(|found| found.is_unique),
        }
    }
}

impl FrictionReport {
    pub(super) fn new(limit: &FrictionLimit) -> Self {
        let lower = match limit {
            FrictionLimit::Factor { lower, .. } => Some(*lower),
            _ => None,
        };
        Self { result: limit.name(), factor: limit.factor(), lower }
    }
}
