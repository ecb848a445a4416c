//! Complete scene of several bodies with indices in place of names, and the world made of it.
//!
//! Simulation and verification make their worlds here, from the same numbers.

pub use super::drawn::DrawnModel;
use super::groups::GroupsModel;
use super::joint::JointModel;
use super::shape::{ModelPlace, ModelShape, PlacedForm};
use super::terrain::TerrainModel;
use crate::coefficients::{CoefficientsModel, PairModel};
use crate::colour::{BodyLabel, Colour};
use crate::failure::Failure;
use nalgebra::Matrix3;
use std::cmp::Ordering;
use std::collections::BTreeMap;
use std::sync::Arc;
use tumble_core::contact::{Partner, Plane};
use tumble_core::error::Error;
use tumble_core::joint::{Gear, GearAxis, Knots};
use tumble_core::mechanics::{Load, RigidBody, Rotation, State};
use tumble_core::world::{
    Coefficient, Fixed, FixedTerrain, Impacts, Integrator, Parameters, StickSpeed, World,
};

/// Constants of a run and its initial state, in SI units.
#[derive(Debug, Clone)]
pub struct Model {
    /// Time step h (s).
    pub dt: f64,
    /// Discretisation of the rotational equations of motion.
    pub rotation: Rotation,
    /// Meaning of the velocities of a run.
    pub integrator: Integrator,
    /// Growth of the error of the time step that a run keeps (m/s); see [`World::with_accuracy`].
    pub accuracy: Option<f64>,
    /// When impacts happen, if there is no accuracy.
    pub impacts: Impacts,
    /// Gravitational acceleration (m/s²), world frame.
    pub gravity: [f64; 3],
    /// Coefficient of friction of the ground; default for bodies and fixed geometry.
    pub mu: f64,
    /// Coefficients of laws.
    pub coefficients: BTreeMap<Coefficient, CoefficientsModel>,
    /// Slips that have the static coefficients; null for the core's default.
    pub stick_speed: Option<StickSpeed>,
    /// Coefficient of restitution of the world; default for bodies without their own.
    pub restitution: f64,
    /// Approach speed below which contacts do not bounce (m/s); null for the core's default.
    pub rebound_speed: Option<f64>,
    /// Plane of the ground; null without a ground. A single floating body (solver `rk4`) has a
    /// plane without effect.
    pub plane: Option<Plane>,
    /// Shapes that the bodies refer to.
    pub shapes: Vec<ModelShape>,
    /// Visual shapes of bodies that look different from their collision shapes. Meshes need not be
    /// convex.
    pub looks: Vec<Vec<PlacedForm>>,
    /// Bodies, in the order of the states.
    pub bodies: Vec<BodyModel>,
    /// Fixed geometry.
    pub fixed: Vec<FixedModel>,
    /// Terrains.
    pub terrains: Vec<TerrainModel>,
    /// Coefficients of friction of single pairs.
    pub frictions: Vec<PairModel>,
    /// Coefficients of restitution of single pairs.
    pub restitutions: Vec<PairModel>,
    /// Joints between bodies.
    pub joints: Vec<JointModel>,
    /// Gears between joints.
    pub gears: Vec<Gear>,
    /// Surfaces that move or have an axis of friction.
    pub surfaces: Vec<SurfaceModel>,
    /// Pairs that do not collide, in addition to the pairs joined by joints.
    pub apart: Vec<ApartModel>,
    /// Names of the collision groups besides `default` and `ground`.
    pub groups: Vec<String>,
}

/// Surface that moves along its body, such as a conveyor belt, or whose friction depends on the direction.
#[derive(Debug, Clone)]
pub struct SurfaceModel {
    /// Owner of the surface.
    pub of: PartnerModel,
    /// Velocity of the surface (m/s): body frame for a body, world frame for fixed geometry.
    pub velocity: Option<[f64; 3]>,
    /// Axis of friction (same frame), and the factor of friction along it.
    pub friction_axis: Option<([f64; 3], f64)>,
}

/// Body and its initial state.
#[derive(Debug, Clone)]
pub struct BodyModel {
    /// Name of the body.
    pub name: String,
    /// Collision shape, an index into `shapes`.
    pub shape: usize,
    /// Centre of mass in the shape's frame (m).
    ///
    /// It is the origin of the body frame, with the axes of the shape's frame.
    pub centre: [f64; 3],
    /// Mass (kg).
    pub mass: f64,
    /// Rows of the inertia tensor about the centre of mass (kg m²), body frame.
    pub inertia: [[f64; 3]; 3],
    /// Coefficient of friction of the body; null for the world's.
    pub friction: Option<f64>,
    /// Coefficient of restitution of the body; null for the world's.
    pub restitution: Option<f64>,
    /// True if the body collides.
    pub touches: bool,
    /// Collision groups.
    pub groups: GroupsModel,
    /// External load.
    pub load: Load,
    /// Colour in pictures; default from a short palette.
    pub colour: Option<Colour>,
    /// Label in pictures instead of the name.
    pub label: Option<BodyLabel>,
    /// Visual shape instead of `shape`, an index into `looks`; in the shape's frame.
    pub look: Option<usize>,
    /// Initial state of the centre of mass.
    pub start: State,
    /// Random part of the initial state; absent if the start is fixed.
    pub drawn: Option<DrawnModel>,
}

/// Fixed convex piece in the world.
#[derive(Debug, Clone)]
pub struct FixedModel {
    /// Name; pieces of one object share it.
    pub name: String,
    /// Shape and place.
    pub piece: PlacedForm,
    /// Coefficient of friction; null for the world's.
    pub friction: Option<f64>,
    /// Collision groups.
    pub groups: GroupsModel,
}

/// Pair that does not collide.
#[derive(Debug, Clone, PartialEq)]
pub struct ApartModel {
    /// First partner, an index into `bodies`.
    pub body: usize,
    /// Second partner.
    pub partner: PartnerModel,
}

/// Second partner of a contact.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PartnerModel {
    /// Ground.
    Ground,
    /// Fixed geometry, an index into `fixed`.
    Fixed(usize),
    /// Terrain, an index into `terrains`.
    Terrain(usize),
    /// Body, an index into `bodies`.
    Body(usize),
}

impl Model {
    /// Partner in the world of the model. Its terrains are numbered after the fixed geometry.
    pub fn partner(&self, partner: PartnerModel) -> Partner {
        match partner {
            PartnerModel::Ground => Partner::Ground,
            PartnerModel::Fixed(index) => Partner::Fixed(index),
            PartnerModel::Terrain(index) => Partner::Fixed(self.fixed.len() + index),
            PartnerModel::Body(index) => Partner::Body(index),
        }
    }

    /// Names of the fixed colliders: of the fixed geometry, then of the terrains.
    pub fn fixed_names(&self) -> impl Iterator<Item = &String> {
        let fixed = self.fixed.iter().map(|fixed| &fixed.name);
        fixed.chain(self.terrains.iter().map(|terrain| &terrain.name))
    }

    /// World of the model.
    pub fn world(&self) -> Result<World, Failure> {
        let fixed = self.fixed.iter().map(|fixed| {
            Ok::<_, Error>(Fixed { piece: fixed.piece.piece()?, friction: fixed.friction })
        });
        let fixed = fixed.collect::<Result<_, _>>()?;
        let world = World::new(Parameters {
            bodies: self.rigid_bodies()?,
            ground: self.plane.clone(),
            gravity: self.gravity.into(),
            friction: self.mu,
            time_step: self.dt,
            rotation: self.rotation,
        })?;
        let terrains = self.terrains.iter().map(|terrain| FixedTerrain {
            terrain: Arc::clone(&terrain.terrain),
            friction: terrain.friction,
        });
        let world = world.with_integrator(self.integrator).with_impacts(self.impacts);
        let world = world.with_accuracy(self.accuracy)?;
        let world = world.with_fixed(fixed)?.with_terrains(terrains.collect())?;
        let world = world.with_restitution(self.restitution)?;
        let world = match self.rebound_speed {
            Some(speed) => world.with_rebound_speed(speed)?,
            None => world,
        };
        let world = self.frictions.iter().try_fold(world, |world, pair| {
            world.with_friction_between(pair.body, self.partner(pair.partner), pair.coefficient)
        })?;
        let world = self.with_coefficients(world)?;
        let world = self.restitutions.iter().try_fold(world, |world, pair| {
            world.with_restitution_between(pair.body, self.partner(pair.partner), pair.coefficient)
        })?;
        let world = self.surfaces.iter().try_fold(world, |world, surface| {
            let of = self.partner(surface.of);
            let world = match surface.velocity {
                Some(velocity) => world.with_surface(of, velocity.into())?,
                None => world,
            };
            match surface.friction_axis {
                Some((axis, factor)) => world.with_friction_axis(of, axis.into(), factor),
                None => Ok(world),
            }
        })?;
        let world = self.apart.iter().try_fold(world, |world, pair| {
            world.with_apart(pair.body, self.partner(pair.partner))
        })?;
        let untouched = self.bodies.iter().enumerate().filter(|(_, body)| !body.touches);
        let world = untouched.map(|(index, _)| index).try_fold(world, World::with_untouched)?;
        self.tied(self.grouped(world)?)
    }

    /// Prescribed motions of joint frames in the world, with the index of each joint.
    pub fn courses(&self) -> Result<Vec<(usize, Knots)>, Failure> {
        let joints = self.joints.iter().enumerate();
        let courses =
            joints.filter_map(|(index, joint)| Some((index, joint, joint.course.as_ref()?)));
        let knots = courses.map(|(index, joint, course)| {
            let invalid = |why| Failure::Input(format!("joints[{index}] ({}): {why}", joint.name));
            Ok((index, course.knots().map_err(invalid)?))
        });
        knots.collect()
    }

    /// Sets the initial `states`, one per body, and moves prescribed frames to their place at
    /// `time` (s).
    pub fn start_at(&mut self, states: &[State], time: f64) -> Result<(), Failure> {
        for (body, state) in self.bodies.iter_mut().zip(states) {
            body.start = *state;
        }
        for (joint, knots) in self.courses()? {
            self.joints[joint].frames[1] = ModelPlace::from_frame(&knots.at(time));
        }
        Ok(())
    }

    /// Adds the joints and gears to `world`.
    fn tied(&self, world: World) -> Result<World, Failure> {
        if self.joints.is_empty() {
            return Ok(world);
        }
        let joints = || self.joints.iter().map(JointModel::joint);
        let world = world.clone().with_joints(joints().collect()).map_err(|error| {
            // The core's error does not name the joint: find the joint that fails alone.
            let is_wrong = |joint| world.clone().with_joints(vec![joint]).is_err();
            let index = joints().position(is_wrong).unwrap_or(0);
            let name = self.joints.get(index).map_or("", |joint| &joint.name);
            Failure::Input(format!("joints[{index}] ({name}): {error}"))
        })?;
        world.clone().with_gears(self.gears.clone()).map_err(|error| {
            let is_wrong = |gear| world.clone().with_gears(vec![gear]).is_err();
            let index = self.gears.iter().copied().position(is_wrong).unwrap_or(0);
            let name = |k: usize| {
                let gear = self.gears.get(index);
                let joint = gear.and_then(|gear| self.joints.get(gear.axes()[k].joint));
                joint.map_or("", |joint| &joint.name)
            };
            Failure::Input(format!("gears[{index}] ({}, {}): {error}", name(0), name(1)))
        })
    }

    /// Rigid bodies of the model. Equal bodies are computed once.
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
                Failure::Input(format!(
                    "bodies[{index}].shape: shape {} does not exist",
                    model.shape
                ))
            })?;
            let body = model
                .rigid_body(shape)
                .map_err(|error| Failure::Input(format!("bodies[{index}]: {error}")))?;
            bodies.push(body.clone());
            made.push((model, body));
        }
        Ok(bodies)
    }

    /// Removes the body `index`, its pairs, the joints attached to it and their gears.
    ///
    /// The indices of later bodies decrease by one.
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
        let pair = |pair: &PairModel| {
            let body = number(pair.body)?;
            Some(PairModel { body, partner: partner(pair.partner)?, ..*pair })
        };
        for pairs in [&mut self.frictions, &mut self.restitutions] {
            *pairs = pairs.iter().filter_map(pair).collect();
        }
        for coefficients in self.coefficients.values_mut() {
            coefficients.renumber(partner, pair);
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
        let gear = |gear: &Gear| {
            let axis = |axis: GearAxis| Some(GearAxis { joint: joint_number(axis.joint)?, ..axis });
            let [first, second] = gear.axes().map(axis);
            let own = Gear::new(first?, second?, gear.ratio(), gear.offset());
            Some(gear.drive().map_or(own, |drive| own.with_drive(*drive)))
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

    /// States of the bodies at step 0.
    pub fn states(&self) -> Vec<State> {
        self.bodies.iter().map(|body| body.start).collect()
    }

    /// External load of each body.
    pub fn loads(&self) -> Vec<Load> {
        self.bodies.iter().map(|body| body.load.clone()).collect()
    }
}

impl BodyModel {
    /// Rigid body of this model with the given `shape`.
    ///
    /// # Errors
    /// The errors of the core for invalid properties.
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

    /// True if both have the same shape, mass properties and coefficients.
    pub fn is_like(&self, other: &Self) -> bool {
        let of = |body: &Self| {
            let coefficients = (body.friction, body.restitution);
            (body.shape, body.centre, body.mass, body.inertia, coefficients)
        };
        of(self) == of(other)
    }
}
