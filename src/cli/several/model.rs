//! A scene of several bodies, complete: what run.json says of it, and the world that it makes.
//!
//! A simulation and its verification make their worlds here, of the same numbers.

use super::shape::{PlacedForm, Shape};
use crate::cli::outcome::Failure;
use crate::cli::physics::bouncing;
use crate::cli::run_file::{LoadParameters, PlaneParameters};
use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};
use tumble::contact::{Partner, Plane};
use tumble::error::Error;
use tumble::mechanics::{Load, RigidBody, State};
use tumble::world::{Fixed, Parameters, World};

/// The constants of a run and its start, SI units.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Model {
    pub dt: f64,
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
    pub shapes: Vec<Shape>,
    pub bodies: Vec<BodyModel>,
    pub fixed: Vec<FixedModel>,
    pub frictions: Vec<PairModel>,
    #[serde(default)]
    pub restitutions: Vec<PairModel>,
}

#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct BodyModel {
    pub name: String,
    /// An index of `shapes`.
    pub shape: usize,
    /// The centre of mass, m, in the frame of the shape. The body's frame has it as its origin and
    /// the axes of the shape's.
    pub centre: [f64; 3],
    pub mass: f64,
    /// By rows, body frame.
    pub inertia: [[f64; 3]; 3],
    /// Its own coefficient of friction; null for the world's.
    pub friction: Option<f64>,
    /// The same of restitution.
    #[serde(default)]
    pub restitution: Option<f64>,
    /// Null without one.
    pub load: Option<LoadParameters>,
    pub start: Start,
}

/// Of the centre of mass, world; the spin in the body's frame.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Start {
    pub position: [f64; 3],
    pub attitude: [f64; 4],
    pub velocity: [f64; 3],
    pub spin: [f64; 3],
}

/// A convex piece that never moves, in the world.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct FixedModel {
    /// Pieces of one thing have its name.
    pub name: String,
    pub piece: PlacedForm,
    pub friction: Option<f64>,
}

/// A coefficient between two, of friction or of restitution.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct PairModel {
    /// An index of `bodies`.
    pub body: usize,
    pub partner: PartnerModel,
    pub coefficient: f64,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum PartnerModel {
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
            ground: self.plane.as_ref().map_or(Ok(Plane::level()), |plane| {
                Plane::new(plane.normal.0.into(), plane.offset)
            })?,
            gravity: self.gravity.into(),
            friction: self.mu,
            time_step: self.dt,
        })?;
        let world = if self.plane.is_some() { world } else { world.without_ground() };
        let world = world.with_fixed(fixed)?;
        let world = bouncing(world, Some(self.restitution), self.rebound_speed)?;
        let world = self.frictions.iter().try_fold(world, |world, pair| {
            world.with_friction_between(pair.body, pair.partner.into(), pair.coefficient)
        })?;
        Ok(self.restitutions.iter().try_fold(world, |world, pair| {
            world.with_restitution_between(pair.body, pair.partner.into(), pair.coefficient)
        })?)
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

    /// The states at step 0.
    pub fn states(&self) -> Vec<State> {
        let state = |body: &BodyModel| State {
            position: body.start.position.into(),
            attitude: body.start.attitude.into(),
            velocity: body.start.velocity.into(),
            spin: body.start.spin.into(),
        };
        self.bodies.iter().map(state).collect()
    }

    /// What pushes each body.
    pub fn loads(&self) -> Result<Vec<Load>, Failure> {
        let load = |body: &BodyModel| body.load.as_ref().map_or(Ok(Load::none()), |l| l.load());
        self.bodies.iter().map(load).collect()
    }

    /// The name of whom a contact is with.
    pub fn name(&self, partner: Partner) -> &str {
        let named = match partner {
            Partner::Ground => None,
            Partner::Fixed(index) => self.fixed.get(index).map(|fixed| &fixed.name),
            Partner::Body(index) => self.bodies.get(index).map(|body| &body.name),
        };
        named.map_or("the ground", String::as_str)
    }
}

impl BodyModel {
    pub fn rigid_body(&self, shape: &Shape) -> Result<RigidBody, Error> {
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
