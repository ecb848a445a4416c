//! Conversion of the tables of a file with `[[bodies]]` to a model, with checks.
//!
//! The closures `named` put the place in the file before an error message, such as `bodies[0].`.

mod groups;
mod names;

use super::copies::{Copied, MOST_BODIES, MOST_FIXED, copies, name_of};
use super::decomposed::DecomposedMesh;
use super::driven::SurfaceEntry;
use super::entries::{
    AttitudeEntry, BodyEntry, Files, FixedEntry, Jitter, LookEntry, LookValue, MeshValue,
    PieceEntry, plain,
};
use super::joints::JointEntries;
use super::masses::{MILLIMETRES, mass_properties, size_of_large_part};
use super::terrain::TerrainEntry;
use crate::choices::StartFrame;
use crate::coefficients::Each;
use crate::document::{BODY, Document, USUAL_SEED};
use crate::tables::{GroundTable, LoadTable, Random};
use nalgebra::{SVector, Vector3};
use names::Named;
use std::collections::BTreeMap;
use tumble_core::error::Error;
use tumble_core::mechanics::State;
use tumble_core::simulation::random::Draws;
use tumble_core::world::Coefficient;
use tumble_decompose::DecompositionSettings;
use tumble_model::failure::field_of;
use tumble_model::fields::Numbers;
use tumble_model::groups::GroupsModel;
use tumble_model::shape::{ModelForm, ModelPlace, ModelShape, PlacedForm};
use tumble_model::shown::{self, checked_name};
use tumble_model::{
    ApartModel, BodyModel, CoefficientsModel, FixedModel, Model, PartnerModel, SurfaceModel,
    TerrainModel,
};
use tumble_model::{DrawnModel, state_at};

/// Maximum number of triangles of all visual shapes.
const MAX_LOOK_TRIANGLES: usize = 2_000_000;
/// Error message for a missing shape of a fixed object or piece.
const ONE_SHAPE: &str =
    "one shape is needed: box, sphere, capsule, cylinder, cone, ellipsoid, hull or mesh";

/// Model of a file, with its robots. `drawn` is true if a start depends on the seed.
pub struct BuiltScene {
    pub model: Model,
    pub drawn: bool,
    pub robots: Vec<tumble_robot::Assembled>,
    /// Notes on decomposed meshes.
    pub notes: Vec<String>,
}

/// Model with the settings of `document` and without bodies.
pub fn empty_model(document: &Document) -> Result<Model, String> {
    let ground = document.ground.as_ref();
    let coefficients = ground.map(GroundTable::coefficients).unwrap_or_default();
    let of_world = |(of, world): (Coefficient, Option<&f64>)| {
        let world = world.copied();
        world.is_some().then(|| (of, CoefficientsModel { world, ..CoefficientsModel::default() }))
    };
    let plane = ground.map_or(Ok(None), GroundTable::plane)?;
    Ok(Model {
        dt: document.time_step,
        rotation: document.rotation(),
        integrator: document.integrator(),
        accuracy: document.accuracy,
        impacts: document.impacts.unwrap_or_default(),
        gravity: document.gravity.vector().into(),
        mu: ground.map_or(0.0, |ground| ground.friction),
        coefficients: Coefficient::ALL.into_iter().zip(coefficients).filter_map(of_world).collect(),
        stick_speed: ground.and_then(|ground| ground.stick_speed.clone()),
        restitution: ground.and_then(|ground| ground.restitution).unwrap_or_default(),
        rebound_speed: ground.and_then(|ground| ground.rebound_speed),
        plane,
        shapes: Vec::new(),
        looks: Vec::new(),
        bodies: Vec::new(),
        fixed: Vec::new(),
        terrains: Vec::new(),
        frictions: Vec::new(),
        restitutions: Vec::new(),
        joints: Vec::new(),
        gears: Vec::new(),
        surfaces: Vec::new(),
        apart: Vec::new(),
        groups: Vec::new(),
    })
}

/// Converts the tables of `file` to a model, and takes them.
pub fn build(file: &mut Document, files: Files<'_>) -> Result<BuiltScene, String> {
    let model = empty_model(file)?;
    let mut builder = Builder::new(files, file.seed(), model);
    let groups =
        GroupsModel { members: file.groups.take().unwrap_or_default(), ..GroupsModel::default() };
    builder.model.add_groups(&groups)?;
    let short = file.body.take().zip(file.start.take());
    if let Some((body, start)) = short {
        builder.add_bodies(BODY, body.entry(start, file.load.take()))?;
    } else if file.bodies.as_ref().is_none_or(Vec::is_empty)
        && file.robots.as_ref().is_none_or(Vec::is_empty)
    {
        return Err("bodies: at least one table [[bodies]] is needed".to_owned());
    }
    for (index, entry) in file.bodies.take().into_iter().flatten().enumerate() {
        builder.add_bodies(&format!("bodies[{index}]"), entry)?;
    }
    for (index, entry) in file.fixed.take().into_iter().flatten().enumerate() {
        builder.add_fixed(&format!("fixed[{index}]"), entry)?;
    }
    for (index, entry) in file.terrain.take().into_iter().flatten().enumerate() {
        let named = |why: String| format!("terrain[{index}].{why}");
        builder.add_terrain(index, entry).map_err(named)?;
    }
    let mut robots = Vec::new();
    for (index, entry) in file.robots.iter().flatten().enumerate() {
        let named = |why: String| format!("robots[{index}].{why}");
        let is_taken = |robot: &tumble_robot::Assembled| robot.prefix() == entry.prefix();
        if robots.iter().any(is_taken) {
            let prefix = entry.prefix();
            return Err(named(format!(
                "prefix: {prefix:?} is used twice; each robot needs its own"
            )));
        }
        let groups = builder.groups(entry.groups.clone(), entry.collides_with.clone());
        let groups = groups.map_err(named)?;
        let Model { bodies, fixed, terrains, .. } = &builder.model;
        let (bodies, fixed, terrains) = (bodies.len(), fixed.len(), terrains.len());
        let added = entry.add(&files, &mut builder.model).map_err(named)?;
        robots.push(added);
        builder.model.bodies[bodies..].iter_mut().for_each(|of| of.groups.clone_from(&groups));
        builder.model.fixed[fixed..].iter_mut().for_each(|of| of.groups.clone_from(&groups));
        let terrains = builder.model.terrains[terrains..].iter_mut();
        terrains.for_each(|of| of.groups.clone_from(&groups));
    }
    builder.refuse_equal_names()?;
    builder.refuse_unknown_groups()?;
    builder.name_links(&robots);
    builder.model.frictions.extend(builder.coefficients(
        "friction",
        file.friction.as_deref(),
        10.0,
    )?);
    for (of, entries) in Coefficient::ALL.into_iter().zip(file.coefficients()) {
        let pairs = builder.coefficients(of.name(), entries.map(Vec::as_slice), 10.0)?;
        if !pairs.is_empty() {
            builder.model.coefficients_mut(of).pairs.extend(pairs);
        }
    }
    let pairs = builder.coefficients("restitution", file.restitution.as_deref(), 1.0)?;
    builder.model.restitutions.extend(pairs);
    for (index, entry) in file.apart.iter().flatten().enumerate() {
        let pairs = builder.pairs(&entry.between).map_err(|why| format!("apart[{index}].{why}"))?;
        let apart = pairs.into_iter().map(|(body, partner)| ApartModel { body, partner });
        builder.model.apart.extend(apart);
    }
    let mut joints = JointEntries::new(std::mem::take(&mut builder.model.joints));
    for (index, entry) in file.joints.iter().flatten().enumerate() {
        let named = |why: String| format!("joints[{index}]{}.{why}", entry.error_suffix());
        if let Some(name) = entry.name() {
            checked_name(name).map_err(named)?;
        }
        joints.add(entry, &builder.model.bodies, |name| builder.bodies(name)).map_err(named)?;
    }
    for (index, entry) in file.motors.iter().flatten().enumerate() {
        let named = |why: String| format!("motors[{index}]{}.{why}", entry.error_suffix());
        joints.add_motor(entry).map_err(named)?;
    }
    for (index, entry) in file.gears.iter().flatten().enumerate() {
        let named = |why: String| format!("gears[{index}]{}.{why}", entry.error_suffix());
        let gear = entry.model(&joints, index).map_err(named)?;
        builder.model.gears.push(gear);
    }
    let start = file.start_index as f64 * builder.model.dt;
    for (index, entry) in file.driven.iter().flatten().enumerate() {
        let named = |why: String| format!("driven[{index}]{}.{why}", entry.error_suffix());
        if let Some(name) = entry.name() {
            checked_name(name).map_err(named)?;
        }
        let bodies = &builder.model.bodies;
        entry.add(&mut joints, bodies, |name| builder.bodies(name), start).map_err(named)?;
    }
    for (index, entry) in file.surfaces.iter().flatten().enumerate() {
        let named = |why: String| format!("surfaces[{index}].{why}");
        builder.add_surface(entry).map_err(named)?;
    }
    builder.model.joints = joints.models;
    builder.refuse_large_looks()?;
    let Builder { model, drawn, notes, .. } = builder;
    Ok(BuiltScene { model, drawn, robots, notes })
}

/// Adds the body described by a table at the end of `model`.
///
/// A body without a name gets the first free one.
pub fn with_body(model: Model, mut entry: BodyEntry, files: Files<'_>) -> Result<Model, String> {
    let number = model.bodies.len();
    if entry.copies.is_some() || entry.ring.is_some() {
        return Err("copies: not supported here; add one body at a time".to_owned());
    }
    let is_free = |name: &String| model.bodies.iter().all(|body| body.name != *name);
    let free = (number..).map(|number| format!("body-{number}")).find(is_free);
    entry.name = entry.name.or(free);
    let mut builder = Builder::new(files, USUAL_SEED, model);
    builder.add_bodies("body", entry)?;
    if builder.drawn {
        return Err("body: random starts are not supported here; give numbers".to_owned());
    }
    builder.names.clear();
    builder.refuse_equal_names()?;
    builder.refuse_unknown_groups()?;
    builder.refuse_large_looks()?;
    Ok(builder.model)
}

/// Model under construction.
struct Builder<'a> {
    files: Files<'a>,
    /// Random numbers of the seed, for random attitudes and jitter.
    draws: Draws,
    /// True if a start was drawn.
    drawn: bool,
    /// Names of entries, each with the bodies or fixed pieces that it describes.
    names: Vec<Named>,
    /// Body of each link that is merged into another, by the name of the link.
    merged: BTreeMap<String, String>,
    /// Notes on decomposed meshes.
    notes: Vec<String>,
    model: Model,
}

impl<'a> Builder<'a> {
    fn new(files: Files<'a>, seed: u32, model: Model) -> Self {
        let (names, merged, notes) = (Vec::new(), BTreeMap::new(), Vec::new());
        let draws = Draws::new(seed);
        Self { files, draws, drawn: false, names, merged, notes, model }
    }

    /// Adds the bodies of one `[[bodies]]` table: one body per copy.
    fn add_bodies(&mut self, at: &str, mut entry: BodyEntry) -> Result<(), String> {
        let named = |why: String| format!("{at}.{why}");
        let unscaled = entry.mesh.as_ref().filter(|_| entry.scale.is_none());
        let unscaled = unscaled.and_then(MeshValue::file).cloned();
        let known = entry.shape.take().map(|name| self.body_named("shape", &name)).transpose();
        let known = known.map_err(named)?.map(|body| body.shape);
        let (shape, solid, surface) = match entry.decompose.take() {
            None => (self.shape(at, &mut entry, known)?, None, None),
            Some(settings) => {
                let mesh = self.decomposed(at, &mut entry, &settings)?;
                self.notes.extend(mesh.note);
                (ModelShape::Pieces(mesh.pieces), Some(mesh.solid), Some(vec![mesh.surface]))
            }
        };
        let large = unscaled.and_then(|file| Some((file, size_of_large_part(&shape)?)));
        let properties = mass_properties(&shape, solid, &entry).map_err(|why| match large {
            Some(_) if why.starts_with("mass is") => named(format!("{why}; {MILLIMETRES}")),
            _ => named(why),
        });
        let (mass, inertia, centre) = properties?;
        if let Some((file, length)) = large {
            self.notes.push(format!("{file} is {} m long; {MILLIMETRES}", shown::rounded(length)));
        }
        let load = entry.load.take().map(LoadTable::load).transpose().map_err(named)?;
        let look = match (entry.look.take(), surface) {
            (Some(LookValue::Of(name)), _) => self.body_named("look", &name).map_err(named)?.look,
            (Some(LookValue::Parts(parts)), _) => {
                let look = self.look(at, parts)?;
                Some(self.add_look(look))
            }
            (None, surface) => surface.map(|surface| self.add_look(surface)),
        };
        let same = || self.model.shapes.iter().position(|known| *known == shape);
        let index = known.or_else(same).unwrap_or(self.model.shapes.len());
        let attitude =
            entry.attitude.as_ref().map_or(Ok(Some(ModelPlace::ORIGIN.attitude)), |turned| {
                turned.quaternion().map_err(|why| named(format!("attitude: {why}")))
            })?;
        let jitter = match entry.jitter.unwrap_or(Jitter::Same(0.0)) {
            Jitter::Same(size) => [size; 3],
            Jitter::Each(sizes) => sizes.0,
        };
        if !jitter.iter().all(|size| (0.0..=1e4).contains(size)) {
            return Err(named("jitter: lengths from 0 to 1e4 m are needed".to_owned()));
        }
        let place = ModelPlace {
            position: entry.position.0,
            attitude: attitude.unwrap_or(ModelPlace::ORIGIN.attitude),
        };
        let room = MOST_BODIES - self.model.bodies.len();
        let copies = copies(place, entry.copies.as_ref(), entry.ring.as_ref(), room, "bodies");
        let copies = copies.map_err(named)?;
        let template = BodyModel {
            name: String::new(),
            shape: index,
            centre: centre.into(),
            mass,
            inertia: inertia.transpose().into(),
            friction: entry.friction,
            restitution: entry.restitution,
            touches: entry.touches.unwrap_or(true),
            groups: self.groups(entry.groups.take(), entry.collides_with.take()).map_err(named)?,
            load: load.unwrap_or_default(),
            colour: entry.colour,
            look,
            label: entry.label.take(),
            start: State::from_vector(&SVector::zeros()),
            drawn: None,
        };
        if !self.model.bodies.last().is_some_and(|last| last.is_like(&template)) {
            template.rigid_body(&shape).map_err(|error| named(with_field(&error)))?;
        }
        if index == self.model.shapes.len() {
            self.model.shapes.push(shape);
        }
        let count = copies.len();
        let mut partners = Vec::new();
        for (number, copied) in copies.into_iter().enumerate() {
            let Copied { place, turned } = copied;
            let drawn = DrawnModel {
                position: place.position,
                attitude: attitude.map(|_| place.attitude),
                jitter,
                tutorial: entry.attitude == Some(AttitudeEntry::Word(Random::Tutorial)),
                ground: entry.frame == Some(StartFrame::Ground),
            };
            let place = drawn.place(&mut self.draws);
            let drawn = entry.drawn.clone().or(drawn.draws().then_some(drawn));
            self.drawn |= drawn.is_some();
            let velocity = turned.rotation()
                * entry.velocity.map_or(Vector3::zeros(), |velocity| velocity.0.into());
            let spin = entry.spin.map_or(Vector3::zeros(), |spin| spin.0.into());
            let start = self.start(entry.frame, &place, velocity, spin, &centre).map_err(named)?;
            start.checked().map_err(|error| named(with_field(&error)))?;
            let index = self.model.bodies.len();
            let name = name_of(entry.name.as_deref(), "body", index, number, count);
            partners.push(PartnerModel::Body(index));
            self.model.bodies.push(BodyModel { name, start, drawn, ..template.clone() });
        }
        self.set_own(&partners, entry.coefficients(), entry.friction).map_err(named)?;
        self.register(entry.name, partners).map_err(named)
    }

    /// Adds the pieces of one `[[fixed]]` table, for each copy.
    fn add_fixed(&mut self, at: &str, mut entry: FixedEntry) -> Result<(), String> {
        let named = |why: String| format!("{at}.{why}");
        let fields = entry.take_form();
        let pieces = match entry.decompose.take() {
            Some(_) if entry.pieces.is_some() => return Err(named(NO_PIECES.to_owned())),
            Some(settings) => {
                let mesh = DecomposedMesh::new(fields, &settings, &self.files).map_err(named)?;
                self.notes.extend(mesh.note);
                mesh.pieces
            }
            None => {
                self.pieces(at, fields.form(&self.files).map_err(named)?, entry.pieces.take())?
            }
        };
        let place = placed(entry.position, entry.attitude.as_ref()).map_err(named)?;
        let room = MOST_FIXED.saturating_sub(self.model.fixed.len()) / pieces.len().max(1);
        let copies =
            copies(place, entry.copies.as_ref(), entry.ring.as_ref(), room, "fixed pieces");
        let copies = copies.map_err(named)?;
        refuse_friction(entry.friction).map_err(named)?;
        let groups = self.groups(entry.groups.take(), entry.collides_with.take()).map_err(named)?;
        let count = copies.len();
        let mut partners = Vec::new();
        for (number, copied) in copies.into_iter().enumerate() {
            let zero = Vector3::zeros();
            let start = self.start(entry.frame, &copied.place, zero, zero, &zero).map_err(named)?;
            let outer =
                ModelPlace { position: start.position.into(), attitude: start.attitude.into() };
            let index = self.model.fixed.len();
            let name = name_of(entry.name.as_deref(), "fixed", index, number, count);
            for piece in &pieces {
                let piece =
                    PlacedForm { form: piece.form.clone(), place: piece.place.within(&outer) };
                piece.piece().map_err(|error| named(with_field(&error)))?;
                partners.push(PartnerModel::Fixed(self.model.fixed.len()));
                let (name, groups) = (name.clone(), groups.clone());
                let fixed = FixedModel { name, piece, friction: entry.friction, groups };
                self.model.fixed.push(fixed);
            }
        }
        self.set_own(&partners, entry.coefficients(), entry.friction).map_err(named)?;
        self.register(entry.name, partners).map_err(named)
    }

    /// Gives `partners` their own coefficients. That of static friction is at least their own coefficient
    /// of `friction`.
    fn set_own(
        &mut self,
        partners: &[PartnerModel],
        own: Each<&f64>,
        friction: Option<f64>,
    ) -> Result<(), String> {
        for (of, own) in Coefficient::ALL.into_iter().zip(own) {
            let Some(&own) = own else { continue };
            let friction = friction.unwrap_or(self.model.mu);
            let (least, named) = match of {
                Coefficient::StaticFriction => (friction, format!("the friction, {friction:?},")),
                _ => (0.0, "0".to_owned()),
            };
            if !(least..=10.0).contains(&own) {
                return Err(format!("{} is {own:?}; allowed: {named} to 10", of.name()));
            }
            let owners = partners.iter().map(|partner| (*partner, own));
            self.model.coefficients_mut(of).owners.extend(owners);
        }
        Ok(())
    }

    /// Adds the terrain of one `[[terrain]]` table.
    fn add_terrain(&mut self, index: usize, mut entry: TerrainEntry) -> Result<(), String> {
        let terrain = entry.terrain(&self.files)?;
        refuse_friction(entry.friction)?;
        let groups = self.groups(entry.groups.take(), entry.collides_with.take())?;
        let name = entry.name.clone().unwrap_or_else(|| format!("terrain-{index}"));
        let friction = entry.friction;
        self.set_own(&[PartnerModel::Terrain(index)], entry.coefficients(), friction)?;
        self.model.terrains.push(TerrainModel { name, terrain, friction, groups });
        self.register(entry.name, vec![PartnerModel::Terrain(index)])
    }

    /// State of the centre of mass in the world, for an object at `place` in `frame`. `centre` is
    /// its centre of mass in its shape's frame (m).
    fn start(
        &self,
        frame: Option<StartFrame>,
        place: &ModelPlace,
        velocity: Vector3<f64>,
        spin: Vector3<f64>,
        centre: &Vector3<f64>,
    ) -> Result<State, String> {
        let ground = match (frame, &self.model.plane) {
            (Some(StartFrame::Centre), _) => {
                let ModelPlace { position, attitude } = *place;
                let (position, attitude) = (position.into(), attitude.into());
                return Ok(State { position, attitude, velocity, spin });
            }
            (Some(StartFrame::World) | None, _) => None,
            (Some(StartFrame::Ground), Some(plane)) => Some(plane),
            (Some(StartFrame::Ground), None) => return Err(NO_GROUND.to_owned()),
        };
        Ok(state_at(ground, place, velocity, spin, centre))
    }

    /// Collision shape of a `[[bodies]]` table: convex pieces or bare points.
    fn shape(
        &self,
        at: &str,
        entry: &mut BodyEntry,
        known: Option<usize>,
    ) -> Result<ModelShape, String> {
        let named = |why: String| format!("{at}.{why}");
        let form = entry.take_form().form(&self.files).map_err(named)?;
        let points = match (entry.points.take(), entry.point_mass) {
            (Some(_), Some(true)) => return Err(format!("{at}: {ONE_SHAPE_OF_A_BODY}")),
            (None, Some(true)) => Some(vec![[0.0; 3]]),
            (points, _) => points.map(plain),
        };
        let is_formed = form.is_some() || entry.pieces.is_some();
        if let Some(known) = known {
            let is_only = points.is_none() && !is_formed;
            let known = is_only.then(|| self.model.shapes[known].clone());
            return known.ok_or_else(|| format!("{at}: {ONE_SHAPE_OF_A_BODY}"));
        }
        match (points, is_formed) {
            (None, true) => Ok(ModelShape::Pieces(self.pieces(at, form, entry.pieces.take())?)),
            (Some(points), false) => Ok(ModelShape::Points(points)),
            _ => Err(format!("{at}: {ONE_SHAPE_OF_A_BODY}")),
        }
    }

    /// Decomposed mesh of a `[[bodies]]` table.
    fn decomposed(
        &self,
        at: &str,
        entry: &mut BodyEntry,
        settings: &DecompositionSettings,
    ) -> Result<DecomposedMesh, String> {
        let named = |why: String| format!("{at}.{why}");
        if entry.pieces.is_some() || entry.points.is_some() || entry.point_mass == Some(true) {
            return Err(named(NO_PIECES.to_owned()));
        }
        DecomposedMesh::new(entry.take_form(), settings, &self.files).map_err(named)
    }

    /// Convex pieces: a single one at the origin, or the entries of the list `pieces`.
    fn pieces(
        &self,
        at: &str,
        form: Option<ModelForm>,
        pieces: Option<Vec<PieceEntry>>,
    ) -> Result<Vec<PlacedForm>, String> {
        match (form, pieces) {
            (Some(form), None) => {
                let form = PlacedForm { form, place: ModelPlace::ORIGIN };
                refuse_piece(at, &form)?;
                Ok(vec![form])
            }
            (None, Some(entries)) if !entries.is_empty() => {
                let piece = |(index, entry)| {
                    placed_piece(&format!("{at}.pieces[{index}]"), entry, &self.files)
                };
                entries.into_iter().enumerate().map(piece).collect()
            }
            _ => Err(format!("{at}: {ONE_SHAPE}, or pieces of these")),
        }
    }

    /// Earlier body with the name in this field.
    fn body_named(&self, field: &str, name: &str) -> Result<&BodyModel, String> {
        let body = self.model.bodies.iter().find(|body| body.name == name);
        body.ok_or_else(|| format!("{field}: {name:?} is not a body before this one"))
    }

    fn add_look(&mut self, look: Vec<PlacedForm>) -> usize {
        self.model.looks.push(look);
        self.model.looks.len() - 1
    }

    /// Visual shape of a body.
    fn look(&self, at: &str, entries: Vec<LookEntry>) -> Result<Vec<PlacedForm>, String> {
        if entries.is_empty() {
            return Err(format!("{at}.look: at least one part is needed"));
        }
        let part = |(index, mut entry): (usize, LookEntry)| {
            let at = format!("{at}.look[{index}]");
            let named = |why: String| format!("{at}.{why}");
            let form = entry.take_form().form(&self.files).map_err(named)?;
            let surface = entry.surface.take().map(|own| own.form(0.0)).transpose();
            let surface = surface.map_err(|why| named(format!("surface.{why}")))?;
            let place = placed(entry.position, entry.attitude.as_ref()).map_err(named)?;
            match (form, surface) {
                (Some(form), None) => {
                    let part = PlacedForm { form, place };
                    part.piece().map_err(|error| format!("{at}.{}: {error}", part.form.field()))?;
                    Ok(part)
                }
                (None, Some(form)) => Ok(PlacedForm { form, place }),
                _ => Err(format!("{at}: {ONE_SHAPE}, or a surface")),
            }
        };
        entries.into_iter().enumerate().map(part).collect()
    }

    /// Sets the velocity and the axis of friction of all surfaces with a name.
    fn add_surface(&mut self, entry: &SurfaceEntry) -> Result<(), String> {
        let velocity = entry.velocity.map(|velocity| velocity.0);
        let friction_axis = match (entry.axis, entry.factor) {
            (Some(axis), Some(factor)) => Some((axis.0, factor)),
            (None, None) if velocity.is_some() => None,
            (None, None) => return Err("velocity: one is needed, or axis and factor".to_owned()),
            (Some(_), None) => return Err("factor: an axis needs one".to_owned()),
            (None, Some(_)) => return Err("axis: a factor needs one".to_owned()),
        };
        if friction_axis.is_some_and(|(_, factor)| !(1e-3..=1e3).contains(&factor)) {
            return Err("factor: a number from 0.001 to 1000 is needed".to_owned());
        }
        let has_length = |axis: [f64; 3]| (1e-6..=1e6).contains(&Vector3::from(axis).norm());
        if friction_axis.is_some_and(|(axis, _)| !has_length(axis)) {
            return Err("axis: a direction with a length from 1e-6 to 1e6 is needed".to_owned());
        }
        if !velocity.iter().flatten().all(|part| part.abs() <= 1e5) {
            return Err("velocity: components from -1e5 to 1e5 m/s are needed".to_owned());
        }
        for of in self.find(&entry.of).map_err(|why| format!("of: {why}"))? {
            if self.model.surfaces.iter().any(|known| known.of == of) {
                return Err(format!(
                    "of: the surface of {:?} is given twice; put velocity, axis and factor into one table",
                    entry.of
                ));
            }
            self.model.surfaces.push(SurfaceModel { of, velocity, friction_axis });
        }
        Ok(())
    }

    /// Limits the number of triangles. Visual shapes are drawn separately for every body.
    fn refuse_large_looks(&self) -> Result<(), String> {
        let count = |part: &PlacedForm| match &part.form {
            ModelForm::Mesh { triangles, .. } => triangles.len(),
            _ => 0,
        };
        let counts: Vec<usize> =
            self.model.looks.iter().map(|look| look.iter().map(count).sum()).collect();
        let looks = self.model.bodies.iter().filter_map(|body| body.look);
        let sum: usize = looks.filter_map(|look| counts.get(look)).sum();
        if sum > MAX_LOOK_TRIANGLES {
            Err(format!(
                "look: all bodies together have {sum} triangles; allowed: up to {MAX_LOOK_TRIANGLES}"
            ))
        } else {
            Ok(())
        }
    }
}

const NO_GROUND: &str = "frame: there is no ground; use `world`";

const NO_PIECES: &str = "decompose: it has no meaning with pieces or points; leave them out";

const ONE_SHAPE_OF_A_BODY: &str = "one shape is needed: box, sphere, capsule, cylinder, cone, ellipsoid, hull, mesh, pieces, \
     points or point_mass = true";

/// Error of the core with the field that causes it.
pub fn with_field(error: &Error) -> String {
    format!("{}: {error}", field_of(error).unwrap_or("shape"))
}

/// Rejects a coefficient of friction out of range.
fn refuse_friction(friction: Option<f64>) -> Result<(), String> {
    match friction.filter(|friction| !(0.0..=10.0).contains(friction)) {
        Some(invalid) => Err(format!("friction is {invalid:?}; allowed: 0 to 10")),
        None => Ok(()),
    }
}

/// Piece of a table at the place `at` of the file.
pub fn placed_piece(
    at: &str,
    mut entry: PieceEntry,
    files: &Files<'_>,
) -> Result<PlacedForm, String> {
    let named = |why: String| format!("{at}.{why}");
    let form = entry.take_form().form(files).map_err(named)?;
    let form = form.ok_or_else(|| format!("{at}: {ONE_SHAPE}"))?;
    let place = placed(entry.position, entry.attitude.as_ref()).map_err(named)?;
    let placed = PlacedForm { form, place };
    refuse_piece(at, &placed)?;
    Ok(placed)
}

/// Rejects a form that the core does not accept.
fn refuse_piece(at: &str, placed: &PlacedForm) -> Result<(), String> {
    let named = |error| match with_field(&error) {
        why if !why.starts_with("shape") => format!("{at}.{why}"),
        _ => format!("{at}.{}: {error}", placed.form.field()),
    };
    placed.piece().map(drop).map_err(named)
}

/// Place of an object, whose attitude must not be random.
pub fn placed(
    position: Option<Numbers<3>>,
    attitude: Option<&AttitudeEntry>,
) -> Result<ModelPlace, String> {
    let position = position.map_or([0.0; 3], |position| position.0);
    if !position.iter().all(|coordinate| coordinate.abs() <= 1e4) {
        return Err("position: coordinates from -1e4 to 1e4 m are needed".to_owned());
    }
    let attitude = match attitude.map(AttitudeEntry::quaternion) {
        None => ModelPlace::ORIGIN.attitude,
        Some(Ok(Some(quaternion))) => quaternion,
        Some(Ok(None)) => return Err("attitude: only bodies can have a random one".to_owned()),
        Some(Err(why)) => return Err(format!("attitude: {why}")),
    };
    Ok(ModelPlace { position, attitude })
}
