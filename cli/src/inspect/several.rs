//! A point of the program of several bodies, as JSON.

use super::{PointEvaluation, check_lengths};
use crate::outcome::Failure;
use nalgebra::{Matrix3, SVector, Vector3};
use serde::Deserialize;
use tumble::step_nlp::SMOOTHING;
use tumble::step_nlp::several::{PosedStep, SeveralNlp};
use tumble_core::contact::{Contact, ContactKey, ContactLaw, Features, Partner, Plane};
use tumble_core::mechanics::{Pose, RigidBody, Rotation, State, Wrench};
use tumble_core::simulation::scene;
use tumble_core::world::{Parameters, World};
use tumble_model::fields::{Exactly, Numbers};
use tumble_model::fields::{Gravity, matrix};

#[derive(Deserialize)]
#[serde(
    deny_unknown_fields,
    expecting = "an object with bodies, contacts, x, obj_factor, multipliers"
)]
pub struct SeveralPointFile {
    bodies: Vec<BodyEntry>,
    contacts: Vec<ContactEntry>,
    x: Vec<f64>,
    obj_factor: f64,
    multipliers: Vec<f64>,
    dt: Option<f64>,
    rotation: Option<Rotation>,
    gravity: Option<Gravity>,
    epsilon: Option<f64>,
    /// κ of eq. 25a in units of h (1/m_A + 1/m_B), and σ of eq. 27, m².
    #[serde(default)]
    share: f64,
    #[serde(default)]
    stiffness: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, expecting = "an object with mass, inertia and state")]
struct BodyEntry {
    mass: f64,
    /// Inertia by rows.
    inertia: Exactly<Numbers<3>, 3>,
    /// State X at step k.
    state: Numbers<13>,
    /// Force, N, world, and torque, N m, body, without gravity.
    wrench: Option<Numbers<6>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, expecting = "an object with a, b, point, frame, offset and friction")]
struct ContactEntry {
    a: usize,
    /// Null for a fixed partner.
    b: Option<usize>,
    /// Point, m, frame of A, and the radius about it.
    point: Numbers<3>,
    #[serde(default)]
    radius: f64,
    /// t₁, t₂, n as columns, stored by rows; frame of B.
    frame: Exactly<Numbers<3>, 3>,
    /// Offset d, m.
    offset: f64,
    friction: f64,
    /// Anchor force f_0 of eqs. 25a and 27, N, along the frame.
    anchor: Option<Numbers<3>>,
}

/// Tolerance for right-handed unit vectors in a frame.
const UNIT: f64 = 1e-9;

impl SeveralPointFile {
    /// Values of the program at the point.
    pub fn evaluation(&self) -> Result<PointEvaluation, Failure> {
        let nlp = self.program()?;
        let layout = nlp.layout();
        check_lengths(&[
            ("x", self.x.len(), layout.variables()),
            ("multipliers", self.multipliers.len(), layout.constraints()),
        ])
        .map_err(Failure::Input)?;
        Ok(evaluation!(nlp, self))
    }

    fn program(&self) -> Result<SeveralNlp, Failure> {
        let world = self.world()?;
        let states = self
            .bodies
            .iter()
            .map(|body| State::from_vector(&SVector::from_column_slice(body.state.0.as_slice())));
        let states: Vec<_> = states.collect();
        if let Some(index) = states.iter().position(|state| state.attitude.norm() == 0.0) {
            let why = "the quaternion is zero; a non-zero one is needed";
            return Err(Failure::Input(format!("bodies[{index}].state: {why}")));
        }
        let wrenches: Vec<_> = self.bodies.iter().map(BodyEntry::wrench).collect();
        let poses: Vec<_> = states.iter().map(State::pose).collect();
        let contacts = self.contacts.iter().enumerate().map(|(index, contact)| {
            contact
                .contact(&world, &poses)
                .map_err(|why| Failure::Input(format!("contacts[{index}].{why}")))
        });
        let contacts = contacts.collect::<Result<Vec<_>, _>>()?;
        let all: Vec<usize> = (0..states.len()).collect();
        let step = PosedStep {
            world: &world,
            states: &states,
            wrenches: &wrenches,
            bodies: &all,
            contacts: &contacts,
        };
        let mut nlp = SeveralNlp::new(&step, self.epsilon.unwrap_or(SMOOTHING))?;
        let anchor = |contact: &ContactEntry| contact.anchor.map_or([0.0; 3], |a| a.0).into();
        nlp.anchor(self.share, self.stiffness, self.contacts.iter().map(anchor));
        Ok(nlp)
    }

    fn world(&self) -> Result<World, Failure> {
        let usual = scene::tutorial_parameters()?;
        let bodies = self.bodies.iter().enumerate().map(|(index, body)| {
            let made = RigidBody::new(body.mass, matrix(&body.inertia), &[self.farthest(index)]);
            made.map_err(|error| Failure::Input(format!("bodies[{index}]: {error}")))
        });
        Ok(World::new(Parameters {
            bodies: bodies.collect::<Result<_, _>>()?,
            ground: Some(Plane::level()),
            gravity: self.gravity.map_or(usual.gravity, Gravity::vector),
            friction: usual.friction,
            time_step: self.dt.unwrap_or(usual.time_step),
            rotation: self.rotation.unwrap_or(usual.rotation),
        })?)
    }

    /// A point as far from the centre of mass of body `index` as its farthest contact: the body's
    /// size.
    fn farthest(&self, index: usize) -> Vector3<f64> {
        let own = self.contacts.iter().filter(|contact| contact.a == index);
        let reach = |contact: &ContactEntry| Vector3::from(contact.point.0).norm() + contact.radius;
        let farthest = own.map(reach).fold(0.0, f64::max);
        Vector3::x() * if farthest > 0.0 { farthest } else { 1.0 }
    }
}

impl BodyEntry {
    fn wrench(&self) -> Wrench {
        let numbers = self.wrench.map_or([0.0; 6], |wrench| wrench.0);
        let [fx, fy, fz, tx, ty, tz] = numbers;
        Wrench { force: Vector3::new(fx, fy, fz), torque: Vector3::new(tx, ty, tz) }
    }
}

impl ContactEntry {
    fn contact(&self, world: &World, poses: &[Pose]) -> Result<Contact, String> {
        let count = poses.len();
        for (name, body) in [("a", Some(self.a)), ("b", self.b)] {
            if body.is_some_and(|body| body >= count) {
                let body = body.unwrap_or_default();
                return Err(format!("{name} is {body}; an index below {count} is needed"));
            }
        }
        if self.b == Some(self.a) {
            return Err("b equals a; another body or null is needed".to_owned());
        }
        for (name, value, most) in [("radius", self.radius, 1e3), ("friction", self.friction, 10.0)]
        {
            if !(0.0..=most).contains(&value) {
                return Err(format!("{name} is {value:?}; allowed: 0 to {most}"));
            }
        }
        let frame = matrix(&self.frame);
        let off = (frame.transpose() * frame - Matrix3::identity()).amax();
        let is_frame = off <= UNIT && frame.determinant() > 0.0;
        if !is_frame {
            return Err(
                "frame: the columns must be orthogonal, right-handed unit vectors".to_owned()
            );
        }
        let partner = self.b.map_or(Partner::Ground, Partner::Body);
        let key = ContactKey { body: self.a, point: 0, partner, pair: None };
        let (point, radius, offset) = (self.point.0.into(), self.radius, self.offset);
        let features = Features::of_plane(point, radius, frame, offset);
        let law = ContactLaw { friction: self.friction, restitution: 0.0 };
        let placed = |index: usize| (&world.bodies()[index], &poses[index]);
        Ok(Contact::new(key, features, law, placed(self.a), self.b.map(placed)))
    }
}
