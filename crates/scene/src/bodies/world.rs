//! World of a document in exact form.

use super::entries::{BodyEntry, Files};
use super::exact::{Collider, NameIndex};
use super::joints::JointEntry;
use crate::document::Document;
use tumble_core::joint::{Gear, Joint};
use tumble_core::mechanics::RigidBody;
use tumble_core::world::{Coefficient, Parameters, SurfaceMotion, World};
use tumble_model::failure::Failure;
use tumble_model::fields::Numbers;

impl Document {
    /// World of a document in exact form.
    ///
    /// # Errors
    /// The first value that the core rejects.
    pub fn world(&self) -> Result<World, Failure> {
        let names = self.index();
        let world = World::new(Parameters {
            bodies: self.rigid_bodies()?,
            ground: self.plane().map_err(Failure::Input)?,
            gravity: self.gravity(),
            friction: self.friction_of_ground(),
            time_step: self.time_step(),
            rotation: self.rotation(),
        })?;
        let world = world.with_integrator(self.integrator());
        let world = world.with_impacts(self.impacts.unwrap_or_default());
        let world = world.with_accuracy(self.accuracy)?;
        let world = self.with_fixed(world)?;
        let world = self.with_coefficients(&names, world)?;
        let world = self.surfaces.iter().try_fold(world, |world, surface| {
            let owner = self.partner(names.owner(&surface.of).map_err(Failure::Input)?);
            let vector = |of: Option<Numbers<3>>| of.unwrap_or_default().0.into();
            let world = if surface.velocity.is_some() || surface.spin.is_some() {
                let (velocity, spin) = (vector(surface.velocity), vector(surface.spin));
                let centre = vector(surface.centre);
                world.with_surface_motion(owner, SurfaceMotion { velocity, spin, centre })?
            } else {
                world
            };
            let (Some(axis), Some(factor)) = (surface.axis, surface.factor) else {
                return Ok::<_, Failure>(world);
            };
            Ok(match &surface.axis_of {
                Some(body) => {
                    let body = names.body(body).map_err(Failure::Input)?;
                    world.with_friction_axis_in(owner, body, axis.0.into(), factor)?
                }
                None => world.with_friction_axis(owner, axis.0.into(), factor)?,
            })
        })?;
        let world = self.apart.iter().try_fold(world, |world, pair| {
            let (body, partner) = names.pair(&pair.between).map_err(Failure::Input)?;
            Ok::<_, Failure>(world.with_apart(body, self.partner(partner))?)
        })?;
        let untouched = self.bodies.iter().enumerate().filter(|(_, body)| !body.touches());
        let world = untouched.map(|(index, _)| index).try_fold(world, World::with_untouched)?;
        self.tied(&names, self.grouped(world)?)
    }

    /// Rigid bodies. Equal bodies are computed once.
    fn rigid_bodies(&self) -> Result<Vec<RigidBody>, Failure> {
        let mut made: Vec<(&BodyEntry, RigidBody)> = Vec::new();
        let mut bodies = Vec::with_capacity(self.bodies.len());
        for (index, entry) in self.bodies.iter().enumerate() {
            let known = made.iter().rev().find(|(other, _)| other.is_like(entry));
            if let Some((_, body)) = known {
                bodies.push(body.clone());
                continue;
            }
            let shape = self.shape_of(entry);
            let shape = shape.map_err(|why| Failure::Input(format!("bodies[{index}].{why}")))?;
            let body = entry.rigid_body(&shape);
            let body = body.map_err(|error| Failure::Input(format!("bodies[{index}]: {error}")))?;
            bodies.push(body.clone());
            made.push((entry, body));
        }
        Ok(bodies)
    }

    /// Adds fixed pieces and terrains to `world`.
    fn with_fixed(&self, world: World) -> Result<World, Failure> {
        let pieces = self.fixed.iter().flat_map(|entry| entry.pieces.iter().flatten());
        let fixed = pieces.map(|piece| piece.piece()).collect::<Result<_, _>>()?;
        let terrain = |(index, entry): (usize, &super::terrain::TerrainEntry)| {
            let terrain = entry.terrain(&Files::none());
            terrain.map_err(|why| Failure::Input(format!("terrain[{index}].{why}")))
        };
        let terrains = self.terrain.iter().enumerate().map(terrain).collect::<Result<_, _>>()?;
        Ok(world.with_fixed(fixed).with_terrains(terrains))
    }

    /// Sets the coefficients of the world, of owners and of pairs.
    fn with_coefficients(&self, names: &NameIndex<'_>, world: World) -> Result<World, Failure> {
        let ground = self.ground.clone().unwrap_or_default();
        let world = match ground.rebound_speed {
            Some(speed) => world.with_rebound_speed(speed)?,
            None => world,
        };
        let mut world = world.with_stick_speed(ground.stick_speed.clone().unwrap_or_default())?;
        for (law, value) in Coefficient::ALL.into_iter().zip(ground.coefficients()) {
            if let Some(value) = value {
                world = world.with_coefficient(law, *value)?;
            }
        }
        for Collider { owners, coefficients, .. } in self.colliders() {
            for (law, value) in Coefficient::ALL.into_iter().zip(coefficients) {
                let Some(value) = value else { continue };
                for owner in &owners {
                    world = world.with_coefficient_of(law, self.partner(*owner), *value)?;
                }
            }
        }
        for (law, entries) in Coefficient::ALL.into_iter().zip(self.coefficients()) {
            for pair in entries.into_iter().flatten() {
                let (body, partner) = names.pair(&pair.between).map_err(Failure::Input)?;
                let partner = self.partner(partner);
                world = world.with_coefficient_between(law, body, partner, pair.coefficient)?;
            }
        }
        Ok(world)
    }

    /// Adds the joints and gears to `world`.
    fn tied(&self, names: &NameIndex<'_>, world: World) -> Result<World, Failure> {
        let joints = self.core_joints(names).map_err(Failure::Input)?;
        if joints.is_empty() {
            return Ok(world);
        }
        let name = |index: usize| self.joint_names().nth(index).unwrap_or_default();
        let world = world.clone().with_joints(joints.clone()).map_err(|error| {
            // The core's error does not name the joint: find the joint that fails alone.
            let is_wrong = |joint| world.clone().with_joints(vec![joint]).is_err();
            let index = joints.into_iter().position(is_wrong).unwrap_or(0);
            Failure::Input(format!("joints[{index}] ({}): {error}", name(index)))
        })?;
        let gears =
            self.gears.iter().map(|gear| gear.gear(|name| self.place_of_joint(names, name)));
        let gears: Result<Vec<Gear>, String> = gears.collect();
        let gears = gears.map_err(Failure::Input)?;
        world.clone().with_gears(gears.clone()).map_err(|error| {
            let is_wrong = |gear| world.clone().with_gears(vec![gear]).is_err();
            let index = gears.iter().copied().position(is_wrong).unwrap_or(0);
            let names =
                gears.get(index).map(|gear| gear.axes().each_ref().map(|axis| name(axis.joint)));
            let [first, second] = names.unwrap_or_default();
            Failure::Input(format!("gears[{index}] ({first}, {second}): {error}"))
        })
    }

    /// Joints in the form of the core: those of `joints` with their motors, then prescribed motions.
    fn core_joints(&self, names: &NameIndex<'_>) -> Result<Vec<Joint>, String> {
        let mut drives: Vec<_> = self.joints.iter().map(JointEntry::drives).collect();
        for motor in &self.motors {
            let joint = names.joint(&motor.joint)?;
            let place = motor.place(self.joint_kind(joint), &motor.joint)?;
            if let Some(drive) = drives.get_mut(joint).and_then(|all| all.get_mut(place)) {
                drive.motor = Some(motor.motor()?);
            }
        }
        let body = |name: &str| names.body(name);
        let joints =
            self.joints.iter().zip(&drives).map(|(entry, drives)| entry.joint(drives, body));
        joints.chain(self.driven.iter().map(|entry| entry.joint(body))).collect()
    }
}
