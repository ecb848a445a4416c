//! A scene of several bodies, complete: what run.json says of it, and the world that it makes.
//!
//! A simulation and its verification make their worlds here, of the same numbers.

pub use super::drawn::DrawnModel;
use super::gear::GearModel;
use super::joint::JointModel;
use super::shape::{ModelPlace, ModelShape, PlacedForm};
use crate::colour::{BodyLabel, Colour};
use crate::failure::Failure;
use crate::fields;
use crate::parameters::bouncing;
use crate::parameters::{LoadParameters, PlaneParameters, unnamed_rotation};
use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};
use std::cmp::Ordering;
use tumble_core::contact::{Partner, Plane};
use tumble_core::error::Error;
use tumble_core::joint::Knots;
use tumble_core::mechanics::{Load, RigidBody, Rotation, State};
use tumble_core::world::{Fixed, Parameters, World};

/// The constants of a run and its start, SI units.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Model {
    /// h, s.
    pub dt: f64,
    /// By which equation bodies turn.
    #[serde(default = "unnamed_rotation")]
    pub rotation: Rotation,
    /// m/s², world.
    pub gravity: [f64; 3],
    /// Of the ground, and of what has none of its own.
    pub mu: f64,
    /// The same of restitution.
    #[serde(default)]
    pub restitution: f64,
    /// m/s; null for the usual one.
    #[serde(default)]
    pub rebound_speed: Option<f64>,
    /// Null without a ground.
    pub plane: Option<PlaneParameters>,
    /// The shapes that bodies have.
    pub shapes: Vec<ModelShape>,
    /// What bodies look like that do not look like their shapes: pieces, and meshes that need not be convex.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub looks: Vec<Vec<PlacedForm>>,
    /// In the order of states.
    pub bodies: Vec<BodyModel>,
    /// What never moves.
    pub fixed: Vec<FixedModel>,
    /// Coefficients of friction between two.
    pub frictions: Vec<PairModel>,
    /// Coefficients of restitution between two.
    #[serde(default)]
    pub restitutions: Vec<PairModel>,
    /// What ties bodies.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub joints: Vec<JointModel>,
    /// What ties joints.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub gears: Vec<GearModel>,
    /// What moves over what it is of.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub surfaces: Vec<SurfaceModel>,
    /// Pairs that do not touch, besides those that joints tie.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub apart: Vec<ApartModel>,
}

/// A surface that moves over what it is of, as a belt does.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct SurfaceModel {
    /// Whose it is.
    pub of: PartnerModel,
    /// m/s; in the frame of the body, in the world's of what is fixed.
    pub velocity: [f64; 3],
}

/// A body and its start.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct BodyModel {
    /// What it is called.
    pub name: String,
    /// An index of `shapes`.
    pub shape: usize,
    /// The centre of mass, m, in the frame of the shape. The body's frame has it as its origin and
    /// the axes of the shape's.
    pub centre: [f64; 3],
    /// kg.
    pub mass: f64,
    /// By rows, body frame.
    pub inertia: [[f64; 3]; 3],
    /// Its own coefficient of friction; null for the world's.
    pub friction: Option<f64>,
    /// The same of restitution.
    #[serde(default)]
    pub restitution: Option<f64>,
    /// Whether it touches anything.
    #[serde(default = "touches", skip_serializing_if = "touches_as_usual")]
    pub touches: bool,
    /// Null without one.
    pub load: Option<LoadParameters>,
    /// In pictures; none for one of a few in turn.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub colour: Option<Colour>,
    /// In pictures, for its name.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub label: Option<BodyLabel>,
    /// In pictures, for its shape: an index of `looks`, in the frame of the shape.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub look: Option<usize>,
    /// Where it starts.
    pub start: BodyStart,
    /// What of that the seed drew; none of a start that is told.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub drawn: Option<DrawnModel>,
}

/// Of the centre of mass, world; the spin in the body's frame.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct BodyStart {
    /// m.
    pub position: [f64; 3],
    /// Unit quaternion w, x, y, z, body → world.
    pub attitude: [f64; 4],
    /// m/s.
    pub velocity: [f64; 3],
    /// rad/s.
    pub spin: [f64; 3],
}

/// A convex piece that never moves, in the world.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct FixedModel {
    /// Pieces of one thing have its name.
    pub name: String,
    /// Its shape and place.
    pub piece: PlacedForm,
    /// Its own coefficient of friction; null for the world's.
    pub friction: Option<f64>,
}

/// A coefficient between two, of friction or of restitution.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct PairModel {
    /// An index of `bodies`.
    pub body: usize,
    /// Whom it is with.
    pub partner: PartnerModel,
    /// μ or e.
    pub coefficient: f64,
}

/// Two that do not touch.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ApartModel {
    /// An index of `bodies`.
    pub body: usize,
    /// Whom it does not touch.
    pub partner: PartnerModel,
}

/// What a body does of which nothing is said.
fn touches() -> bool {
    true
}

fn touches_as_usual(touches: &bool) -> bool {
    *touches
}

/// Whom a contact is with.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum PartnerModel {
    /// The ground.
    Ground,
    /// An index of `fixed`.
    Fixed(usize),
    /// An index of `bodies`.
    Body(usize),
}

impl From<PartnerModel> for Partner {
    fn from(partner: PartnerModel) -> Self {
        match partner {
            PartnerModel::Ground => Self::Ground,
            PartnerModel::Fixed(index) => Self::Fixed(index),
            PartnerModel::Body(index) => Self::Body(index),
        }
    }
}

impl Model {
    /// The world of the model.
    pub fn world(&self) -> Result<World, Failure> {
        let fixed = self.fixed.iter().map(|fixed| {
            Ok::<_, Error>(Fixed { piece: fixed.piece.piece()?, friction: fixed.friction })
        });
        let fixed = fixed.collect::<Result<_, _>>()?;
        let world = World::new(Parameters {
            bodies: self.rigid_bodies()?,
            ground: match &self.plane {
                Some(plane) => Some(Plane::new(plane.normal.0.into(), plane.offset)?),
                None => None,
            },
            gravity: self.gravity.into(),
            friction: self.mu,
            time_step: self.dt,
            rotation: self.rotation,
        })?;
        let world = world.with_fixed(fixed)?;
        let world = bouncing(world, Some(self.restitution), self.rebound_speed)?;
        let world = self.frictions.iter().try_fold(world, |world, pair| {
            world.with_friction_between(pair.body, pair.partner.into(), pair.coefficient)
        })?;
        let world = self.restitutions.iter().try_fold(world, |world, pair| {
            world.with_restitution_between(pair.body, pair.partner.into(), pair.coefficient)
        })?;
        let world = self.surfaces.iter().try_fold(world, |world, surface| {
            world.with_surface(surface.of.into(), surface.velocity.into())
        })?;
        let world = self
            .apart
            .iter()
            .try_fold(world, |world, pair| world.with_apart(pair.body, pair.partner.into()))?;
        let untouched = self.bodies.iter().enumerate().filter(|(_, body)| !body.touches);
        let world = untouched.map(|(index, _)| index).try_fold(world, World::with_untouched)?;
        self.tied(world)
    }

    /// How the frames in the world of joints move, by the joints' indices.
    pub fn courses(&self) -> Result<Vec<(usize, Knots)>, Failure> {
        let joints = self.joints.iter().enumerate();
        let courses =
            joints.filter_map(|(index, joint)| Some((index, joint, joint.course.as_ref()?)));
        let knots = courses.map(|(index, joint, course)| {
            let odd = |why| Failure::Input(format!("joints[{index}] ({}): {why}", joint.name));
            Ok((index, course.knots().map_err(odd)?))
        });
        knots.collect()
    }

    /// Has it start at these `states`, one a body, at the time `time` (s).
    pub fn start_at(&mut self, states: &[State], time: f64) -> Result<(), Failure> {
        for (body, state) in self.bodies.iter_mut().zip(states) {
            body.start = BodyStart::of(state);
        }
        for (joint, knots) in self.courses()? {
            self.joints[joint].frames[1] = ModelPlace::of(&knots.at(time));
        }
        Ok(())
    }

    /// `world` with the joints and gears.
    fn tied(&self, world: World) -> Result<World, Failure> {
        if self.joints.is_empty() {
            return Ok(world);
        }
        let joints = || self.joints.iter().map(JointModel::joint);
        let world = world.clone().with_joints(joints().collect()).map_err(|error| {
            // The library says what is wrong, and not of which.
            let is_wrong = |joint| world.clone().with_joints(vec![joint]).is_err();
            let index = joints().position(is_wrong).unwrap_or(0);
            let name = self.joints.get(index).map_or("", |joint| &joint.name);
            Failure::Input(format!("joints[{index}] ({name}): {error}"))
        })?;
        let gears = || self.gears.iter().map(GearModel::gear);
        world.clone().with_gears(gears().collect()).map_err(|error| {
            let is_wrong = |gear| world.clone().with_gears(vec![gear]).is_err();
            let index = gears().position(is_wrong).unwrap_or(0);
            let name = |k: usize| {
                let joint = self.gears.get(index).and_then(|gear| self.joints.get(gear.joints[k]));
                joint.map_or("", |joint| &joint.name)
            };
            Failure::Input(format!("gears[{index}] ({}, {}): {error}", name(0), name(1)))
        })
    }

    /// The bodies; equal ones are made once.
    fn rigid_bodies(&self) -> Result<Vec<RigidBody>, Failure> {
        let mut made: Vec<(&BodyModel, RigidBody)> = Vec::new();
        let mut bodies = Vec::with_capacity(self.bodies.len());
        for (index, model) in self.bodies.iter().enumerate() {
            let known = made.iter().rev().find(|(other, _)| other.is_like(model));
            if let Some((_, body)) = known {
                bodies.push(body.clone());
                continue;
            }
            let shape = self.shapes.get(model.shape).ok_or_else(|| {
                Failure::Input(format!("model.bodies[{index}].shape: there is no such shape"))
            })?;
            let body = model
                .rigid_body(shape)
                .map_err(|error| Failure::Input(format!("model.bodies[{index}]: {error}")))?;
            bodies.push(body.clone());
            made.push((model, body));
        }
        Ok(bodies)
    }

    /// The model that [`Model::text`] has written.
    ///
    /// # Errors
    /// What is no model.
    pub fn of_text(text: &str) -> Result<Self, String> {
        fields::json(text)
    }

    /// The model as run.json has it, in JSON.
    ///
    /// # Errors
    /// A number that JSON has not.
    pub fn text(&self) -> Result<String, Failure> {
        let why = |error| Failure::Other(format!("the model cannot be written: {error}"));
        serde_json::to_string(self).map_err(why)
    }

    /// Takes the body `index` out, with the coefficients of its pairs, the joints that tie it and their gears; those
    /// after it move up by one.
    pub fn leave_out(&mut self, index: usize) {
        let number = |body: usize| match body.cmp(&index) {
            Ordering::Less => Some(body),
            Ordering::Equal => None,
            Ordering::Greater => Some(body - 1),
        };
        if index < self.bodies.len() {
            self.bodies.remove(index);
        }
        let partner = |partner: PartnerModel| match partner {
            PartnerModel::Body(other) => number(other).map(PartnerModel::Body),
            still => Some(still),
        };
        for pairs in [&mut self.frictions, &mut self.restitutions] {
            let pair = |pair: &PairModel| {
                let (body, partner) = (number(pair.body)?, partner(pair.partner)?);
                Some(PairModel { body, partner, ..*pair })
            };
            *pairs = pairs.iter().filter_map(pair).collect();
        }
        let pair = |pair: &ApartModel| {
            Some(ApartModel { body: number(pair.body)?, partner: partner(pair.partner)? })
        };
        self.apart = self.apart.iter().filter_map(pair).collect();
        let ties = |joint: &JointModel| joint.body == index || joint.other == Some(index);
        let stays: Vec<_> = self.joints.iter().map(|joint| !ties(joint)).collect();
        let joint_number = |joint: usize| {
            let is_left = stays.get(joint).copied().unwrap_or(false);
            is_left.then(|| stays[..joint].iter().filter(|stays| **stays).count())
        };
        let gear = |gear: &GearModel| {
            let [first, second] = gear.joints;
            let joints = [joint_number(first)?, joint_number(second)?];
            Some(GearModel { joints, ..gear.clone() })
        };
        self.gears = self.gears.iter().filter_map(gear).collect();
        let joint = |joint: &JointModel| {
            let other = joint.other.map(|other| number(other).ok_or(())).transpose().ok()?;
            Some(JointModel { body: number(joint.body)?, other, ..joint.clone() })
        };
        self.joints = self.joints.iter().filter_map(joint).collect();
        let surface =
            |surface: &SurfaceModel| Some(SurfaceModel { of: partner(surface.of)?, ..*surface });
        self.surfaces = self.surfaces.iter().filter_map(surface).collect();
    }

    /// The states at step 0.
    pub fn states(&self) -> Vec<State> {
        self.bodies.iter().map(|body| body.start.state()).collect()
    }

    /// What pushes each body.
    pub fn loads(&self) -> Result<Vec<Load>, Failure> {
        let load = |body: &BodyModel| body.load.as_ref().map_or(Ok(Load::none()), |l| l.load());
        self.bodies.iter().map(load).collect()
    }
}

impl BodyStart {
    /// That at a state.
    pub fn of(state: &State) -> Self {
        Self {
            position: state.position.into(),
            attitude: state.attitude.into(),
            velocity: state.velocity.into(),
            spin: state.spin.into(),
        }
    }

    /// The state at step 0.
    pub fn state(&self) -> State {
        State {
            position: self.position.into(),
            attitude: self.attitude.into(),
            velocity: self.velocity.into(),
            spin: self.spin.into(),
        }
    }
}

impl BodyModel {
    /// The body of this model, of the shape that it names.
    ///
    /// # Errors
    /// What the library refuses.
    pub fn rigid_body(&self, shape: &ModelShape) -> Result<RigidBody, Error> {
        let inertia = Matrix3::from(self.inertia).transpose();
        let body = shape.body(self.mass, inertia, &self.centre.into())?;
        let body = match self.friction {
            Some(friction) => body.with_friction(friction)?,
            None => body,
        };
        match self.restitution {
            Some(restitution) => body.with_restitution(restitution),
            None => Ok(body),
        }
    }

    /// Whether it is the same body somewhere else.
    fn is_like(&self, other: &Self) -> bool {
        let of = |body: &Self| {
            let coefficients = (body.friction, body.restitution);
            (body.shape, body.centre, body.mass, body.inertia, coefficients)
        };
        of(self) == of(other)
    }
}
