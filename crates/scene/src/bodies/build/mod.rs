//! Conversion of a document to its exact form, with checks.
//!
//! The closures `named` put the place in the file before an error message, such as `bodies[0].`.

mod names;

use super::copies::{Copied, MOST_BODIES, MOST_FIXED, copies, name_of};
use super::decomposed::DecomposedMesh;
use super::drawn::{DrawnModel, state_at};
use super::driven::{DrivenEntry, SurfaceEntry};
use super::entries::{
    ApartEntry, AttitudeEntry, BodyEntry, Files, FixedEntry, Jitter, LookValue, MeshValue,
    ONE_SHAPE, PieceEntry, placed, plain,
};
use super::exact::Owner;
use super::gears::{GearEntry, MOST_GEARS};
use super::joints::{JointEntry, MotorEntry};
use super::masses::{HEAVIEST_PART, MILLIMETRES, mass_properties, size_of_large_part, with_field};
use super::terrain::TerrainEntry;
use crate::bodies::place::Place;
use crate::bodies::shape::BodyShape;
use crate::choices::StartFrame;
use crate::coefficients::Each;
use crate::document::{Document, USUAL_SEED};
use crate::robots::Assembled;
use crate::short_form::BODY;
use crate::tables::Random;
use nalgebra::Vector3;
use names::Named;
use std::collections::BTreeMap;
use std::mem::take;
use tumble_core::contact::Plane;
use tumble_core::mechanics::State;
use tumble_core::simulation::random::Draws;
use tumble_core::world::{Coefficient, Impacts};
use tumble_decompose::DecompositionSettings;
use tumble_model::failure::Failure;
use tumble_model::fields::{Gravity, numbers};
use tumble_model::shown::{self, checked_name};

/// Maximum number of triangles of all visual shapes.
const MAX_LOOK_TRIANGLES: usize = 2_000_000;

/// Document in exact form, with its robots. `drawn` is true if a start depends on the seed.
pub struct BuiltDocument {
    pub document: Document,
    pub drawn: bool,
    pub robots: Vec<Assembled>,
    /// Notes on decomposed meshes.
    pub notes: Vec<String>,
}

/// Exact form of the head of `document`: its settings without bodies.
pub fn head(document: &Document) -> Result<Document, String> {
    let plane = document.plane()?;
    let ground = document.ground.clone().map(|mut ground| {
        ground.set_plane(plane.as_ref());
        ground
    });
    let has_ground = ground.is_some();
    Ok(Document {
        time_step: Some(document.time_step()),
        rotation: has_ground.then(|| document.rotation()),
        integrator: has_ground.then(|| document.integrator()),
        accuracy: document.accuracy,
        impacts: document.impacts.filter(|impacts| *impacts != Impacts::default()),
        gravity: Some(Gravity::Vector(numbers(&document.gravity()))),
        groups: document.groups.clone(),
        ground,
        ..Document::default()
    })
}

/// Exact form of the document `file`, from which its bodies and fixed objects are taken.
pub fn build(file: &mut Document, files: Files<'_>) -> Result<BuiltDocument, String> {
    let mut builder = Builder::new(files, file.seed(), head(file)?)?;
    builder.document.refuse_many_groups()?;
    let short = file.body.take().zip(file.start.take());
    if let Some((body, start)) = short {
        builder.add_bodies(BODY, body.entry(start, file.load.take()))?;
    } else if file.bodies.is_empty() && file.robots.is_empty() {
        return Err("bodies: at least one table [[bodies]] is needed".to_owned());
    }
    for (index, entry) in take(&mut file.bodies).into_iter().enumerate() {
        builder.add_bodies(&format!("bodies[{index}]"), entry)?;
    }
    for (index, entry) in take(&mut file.fixed).into_iter().enumerate() {
        builder.add_fixed(&format!("fixed[{index}]"), entry)?;
    }
    for (index, entry) in take(&mut file.terrain).into_iter().enumerate() {
        let named = |why: String| format!("terrain[{index}].{why}");
        builder.add_terrain(index, entry).map_err(named)?;
    }
    let robots = builder.add_robots(file)?;
    builder.refuse_equal_names()?;
    builder.document.refuse_unknown_groups()?;
    builder.name_links(&robots);
    for of in Coefficient::ALL {
        let entries = file.coefficient_mut(of).take().unwrap_or_default();
        let pairs = builder.pairs_with(of, &entries)?;
        if !pairs.is_empty() {
            builder.document.coefficient_mut(of).get_or_insert_default().extend(pairs);
        }
    }
    for (index, entry) in file.apart.iter().enumerate() {
        let pairs = builder.pairs(&entry.between).map_err(|why| format!("apart[{index}].{why}"))?;
        builder.document.apart.extend(pairs.into_iter().map(|between| ApartEntry { between }));
    }
    for (index, entry) in file.joints.iter().enumerate() {
        let named = |why: String| format!("joints[{index}]{}.{why}", entry.error_suffix());
        builder.add_joints(entry).map_err(named)?;
    }
    for (index, entry) in file.motors.iter().enumerate() {
        let named = |why: String| format!("motors[{index}]{}.{why}", entry.error_suffix());
        builder.add_motor(entry, &robots).map_err(named)?;
    }
    for (index, entry) in file.gears.iter().enumerate() {
        let named = |why: String| format!("gears[{index}]{}.{why}", entry.error_suffix());
        builder.add_gear(entry, index).map_err(named)?;
    }
    let start = file.first_index() as f64 * file.time_step();
    for (index, entry) in file.driven.iter().enumerate() {
        let named = |why: String| format!("driven[{index}]{}.{why}", entry.error_suffix());
        builder.add_driven(entry, start).map_err(named)?;
    }
    for (index, entry) in file.surfaces.iter().enumerate() {
        let named = |why: String| format!("surfaces[{index}].{why}");
        builder.add_surface(entry).map_err(named)?;
    }
    builder.refuse_large_looks()?;
    let Builder { document, drawn, notes, .. } = builder;
    Ok(BuiltDocument { document, drawn, robots, notes })
}

impl Document {
    /// Exact form of a document without files.
    ///
    /// # Errors
    /// The first invalid value.
    pub fn exact(mut self) -> Result<Self, Failure> {
        self.check().map_err(Failure::Input)?;
        let built = build(&mut self, Files::none()).map_err(Failure::Input)?;
        Ok(built.document)
    }
}

/// Adds the body described by a table at the end of a `document` in exact form.
///
/// A body without a name gets the first free one.
pub fn with_body(
    document: Document,
    mut entry: BodyEntry,
    files: Files<'_>,
) -> Result<Document, String> {
    let number = document.bodies.len();
    if entry.copies.is_some() || entry.ring.is_some() {
        return Err("copies: not supported here; add one body at a time".to_owned());
    }
    let is_free = |name: &String| document.bodies.iter().all(|body| body.name() != name);
    let free = (number..).map(|number| format!("body-{number}")).find(is_free);
    entry.name = entry.name.or(free);
    let mut builder = Builder::new(files, USUAL_SEED, document)?;
    builder.add_bodies("body", entry)?;
    if builder.drawn {
        return Err("body: random starts are not supported here; give numbers".to_owned());
    }
    builder.names.clear();
    builder.refuse_equal_names()?;
    builder.document.refuse_unknown_groups()?;
    builder.refuse_large_looks()?;
    Ok(builder.document)
}

/// Document under construction.
struct Builder<'a> {
    files: Files<'a>,
    /// Random numbers of the seed, for random attitudes and jitter.
    draws: Draws,
    /// True if a start was drawn.
    drawn: bool,
    /// Names of entries, each with the bodies or fixed pieces that it describes.
    names: Vec<Named>,
    /// Names of entries of joints, with the indices of their joints.
    joints: Vec<(String, Vec<usize>)>,
    /// Joints and axes that have a motor.
    motors: Vec<(usize, usize)>,
    /// Body of each link that is merged into another, by the name of the link.
    merged: BTreeMap<String, String>,
    /// Notes on decomposed meshes.
    notes: Vec<String>,
    /// Plane of the ground.
    plane: Option<Plane>,
    document: Document,
}

impl<'a> Builder<'a> {
    fn new(files: Files<'a>, seed: u32, document: Document) -> Result<Self, String> {
        Ok(Self {
            files,
            draws: Draws::new(seed),
            drawn: false,
            names: Vec::new(),
            joints: Vec::new(),
            motors: Vec::new(),
            merged: BTreeMap::new(),
            notes: Vec::new(),
            plane: document.plane()?,
            document,
        })
    }

    /// Adds the bodies of one `[[bodies]]` table: one body per copy.
    fn add_bodies(&mut self, at: &str, mut entry: BodyEntry) -> Result<(), String> {
        let named = |why: String| format!("{at}.{why}");
        let has_mesh = entry.mesh.is_some();
        let unscaled = entry.mesh.as_ref().filter(|_| entry.scale.is_none());
        let unscaled = unscaled.and_then(MeshValue::file).cloned();
        let known = entry.shape.take().map(|name| self.body_named("shape", &name)).transpose();
        let known = known.map_err(named)?.cloned();
        let (shape, solid, surface) = match entry.decompose.take() {
            None => (self.shape(at, &mut entry, known.as_ref())?, None, None),
            Some(settings) => {
                let mesh = self.decomposed(at, &mut entry, &settings)?;
                self.notes.extend(mesh.note);
                (BodyShape::Pieces(mesh.pieces), Some(mesh.solid), Some(mesh.surface))
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
        } else if !has_mesh
            && mass > HEAVIEST_PART
            && let Some(length) = size_of_large_part(&shape)
        {
            let [length, tonnes] = [length, mass / 1000.0].map(shown::rounded);
            let name = entry.name.as_deref().unwrap_or(at);
            self.notes.push(format!(
                "{name} is {length} m long and has {tonnes} t; lengths are in m, not in millimetres"
            ));
        }
        if let Some(load) = &entry.load {
            load.load().map_err(named)?;
        }
        let look = match (entry.look.take(), surface) {
            (Some(LookValue::Of(name)), _) => {
                let of = self.body_named("look", &name).map_err(named)?;
                match &of.look {
                    Some(LookValue::Parts(_)) => Some(LookValue::Of(name)),
                    other => other.clone(),
                }
            }
            (Some(LookValue::Parts(parts)), _) => Some(LookValue::Parts(self.look(at, parts)?)),
            (None, Some(surface)) => Some(LookValue::Parts(vec![surface])),
            (None, None) => None,
        };
        let attitude =
            entry.attitude.as_ref().map_or(Ok(Some(Place::ORIGIN.attitude)), |turned| {
                turned.quaternion().map_err(|why| named(format!("attitude: {why}")))
            })?;
        let jitter = match entry.jitter.take().unwrap_or(Jitter::Same(0.0)) {
            Jitter::Same(size) => [size; 3],
            Jitter::Each(sizes) => sizes.0,
        };
        if !jitter.iter().all(|size| (0.0..=1e4).contains(size)) {
            return Err(named("jitter: lengths from 0 to 1e4 m are needed".to_owned()));
        }
        let place = Place {
            position: entry.position.0,
            attitude: attitude.unwrap_or(Place::ORIGIN.attitude),
        };
        let room = MOST_BODIES - self.document.bodies.len();
        let copies = copies(place, entry.copies.as_ref(), entry.ring.as_ref(), room, "bodies");
        let copies = copies.map_err(named)?;
        self.document.add_groups(entry.groups.as_deref()).map_err(named)?;
        self.refuse_coefficients(entry.coefficients()).map_err(named)?;
        let given = entry.clone();
        entry.set_mass(mass, &inertia);
        let mut template = BodyEntry {
            centre: Some(numbers(&centre)),
            touches: entry.touches.filter(|touches| !touches),
            density: None,
            point_mass: None,
            copies: None,
            ring: None,
            shape: known.and_then(|known| known.shape.or(known.name)),
            look,
            ..entry
        };
        let is_known = template.shape.is_some()
            && self.document.bodies.last().is_some_and(|last| last.is_like(&template));
        if !is_known {
            template.rigid_body(&shape).map_err(|error| named(with_field(&error)))?;
        }
        let count = copies.len();
        let mut owners = Vec::new();
        for (number, copied) in copies.into_iter().enumerate() {
            let Copied { place, turned } = copied;
            let drawn = DrawnModel {
                position: place.position,
                attitude: attitude.map(|_| place.attitude),
                jitter,
                tutorial: given.attitude == Some(AttitudeEntry::Word(Random::Tutorial)),
                ground: given.frame == Some(StartFrame::Ground),
            };
            let place = drawn.place(&mut self.draws);
            let drawn = given.drawn.clone().or(drawn.draws().then_some(drawn));
            self.drawn |= drawn.is_some();
            // The sum takes the sign from a rotated zero, which run.json would keep.
            let velocity = turned.rotation()
                * given.velocity.map_or(Vector3::zeros(), |velocity| velocity.0.into())
                + Vector3::zeros();
            let spin = given.spin.map_or(Vector3::zeros(), |spin| spin.0.into());
            let start = self.start(given.frame, &place, velocity, spin, &centre).map_err(named)?;
            start.checked().map_err(|error| named(with_field(&error)))?;
            let index = self.document.bodies.len();
            let name = name_of(given.name.as_deref(), "body", index, number, count);
            owners.push(Owner::Body(index));
            let mut body = BodyEntry { name: Some(name.clone()), drawn, ..template.clone() };
            body.set_start(&start);
            // Further copies have the shape and the look of the first.
            if template.shape.is_some() {
                self.document.bodies.push(body);
            } else {
                self.document.add_body(body, shape.clone());
                let known = self.document.bodies[index].shape.clone();
                template.shape = known.or_else(|| Some(name.clone()));
            }
            if let Some(LookValue::Parts(_)) = template.look {
                template.look = Some(LookValue::Of(name));
            }
        }
        self.register(given.name, owners).map_err(named)
    }

    /// State of the centre of mass in the world, for an object at `place` in `frame`. `centre` is
    /// its centre of mass in its shape's frame (m).
    fn start(
        &self,
        frame: Option<StartFrame>,
        place: &Place,
        velocity: Vector3<f64>,
        spin: Vector3<f64>,
        centre: &Vector3<f64>,
    ) -> Result<State, String> {
        let ground = match (frame, &self.plane) {
            (Some(StartFrame::Centre), _) => {
                let Place { position, attitude } = *place;
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
        known: Option<&BodyEntry>,
    ) -> Result<BodyShape, String> {
        let named = |why: String| format!("{at}.{why}");
        let form = entry.take_form().exact_form(&self.files).map_err(named)?;
        let points = match (entry.points.take(), entry.point_mass) {
            (Some(_), Some(true)) => return Err(format!("{at}: {ONE_SHAPE_OF_A_BODY}")),
            (None, Some(true)) => Some(vec![[0.0; 3]]),
            (points, _) => points.as_deref().map(plain),
        };
        let is_formed = form.is_some() || entry.pieces.is_some();
        if let Some(known) = known {
            if points.is_some() || is_formed {
                return Err(format!("{at}: {ONE_SHAPE_OF_A_BODY}"));
            }
            return self.document.shape_of(known).map_err(named);
        }
        match (points, is_formed) {
            (None, true) => Ok(BodyShape::Pieces(self.pieces(at, form, entry.pieces.take())?)),
            (Some(points), false) => Ok(BodyShape::Points(points)),
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
        form: Option<PieceEntry>,
        pieces: Option<Vec<PieceEntry>>,
    ) -> Result<Vec<PieceEntry>, String> {
        match (form, pieces) {
            (Some(form), None) => {
                form.check().map_err(|why| format!("{at}{why}"))?;
                Ok(vec![form])
            }
            (None, Some(entries)) if !entries.is_empty() => {
                let piece = |(index, entry): (usize, PieceEntry)| {
                    let exact = entry.exact(&self.files);
                    exact.map_err(|why| format!("{at}.pieces[{index}]{why}"))
                };
                entries.into_iter().enumerate().map(piece).collect()
            }
            _ => Err(format!("{at}: {ONE_SHAPE}, or pieces of these")),
        }
    }

    /// Earlier body with the name in this field.
    fn body_named(&self, field: &str, name: &str) -> Result<&BodyEntry, String> {
        let body = self.document.bodies.iter().find(|body| body.name() == name);
        body.ok_or_else(|| format!("{field}: {name:?} is not a body before this one"))
    }

    /// Visual shape of a body, without files.
    fn look(&self, at: &str, entries: Vec<PieceEntry>) -> Result<Vec<PieceEntry>, String> {
        if entries.is_empty() {
            return Err(format!("{at}.look: at least one part is needed"));
        }
        let part = |(index, entry): (usize, PieceEntry)| {
            entry.exact_part(&self.files).map_err(|why| format!("{at}.look[{index}]{why}"))
        };
        entries.into_iter().enumerate().map(part).collect()
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
            None => self.pieces(
                at,
                fields.exact_form(&self.files).map_err(named)?,
                entry.pieces.take(),
            )?,
        };
        let place = placed(entry.position.take(), entry.attitude.take().as_ref()).map_err(named)?;
        let first = self.document.fixed_count();
        let room = MOST_FIXED.saturating_sub(first) / pieces.len().max(1);
        let grid = entry.copies.take();
        let ring = entry.ring.take();
        let copies = copies(place, grid.as_ref(), ring.as_ref(), room, "fixed pieces");
        let copies = copies.map_err(named)?;
        self.refuse_coefficients(entry.coefficients()).map_err(named)?;
        self.document.add_groups(entry.groups.as_deref()).map_err(named)?;
        let count = copies.len();
        let frame = entry.frame.take();
        let mut next = first;
        for (number, copied) in copies.into_iter().enumerate() {
            let zero = Vector3::zeros();
            let start = self.start(frame, &copied.place, zero, zero, &zero).map_err(named)?;
            let outer = Place { position: start.position.into(), attitude: start.attitude.into() };
            let name = name_of(entry.name.as_deref(), "fixed", next, number, count);
            let piece = |piece: &PieceEntry| {
                let placed = piece.clone().placed_at(&piece.place().within(&outer));
                placed.piece().map_err(|error| named(with_field(&error)))?;
                Ok::<_, String>(placed)
            };
            let pieces = pieces.iter().map(piece).collect::<Result<Vec<_>, _>>()?;
            next += pieces.len();
            let exact = FixedEntry { name: Some(name), pieces: Some(pieces), ..entry.clone() };
            self.document.fixed.push(exact);
        }
        self.register(entry.name, (first..next).map(Owner::Fixed).collect()).map_err(named)
    }

    /// Rejects own coefficients out of range. That of static friction is at least that of friction.
    fn refuse_coefficients(&self, all: Each<&f64>) -> Result<(), String> {
        let friction = all[Coefficient::Friction as usize];
        let friction = friction.copied().unwrap_or(self.document.friction_of_ground());
        for (of, own) in Coefficient::ALL.into_iter().zip(all) {
            let Some(own) = own else { continue };
            let (least, named) = match of {
                Coefficient::StaticFriction => (friction, format!("the friction, {friction:?},")),
                _ => (0.0, "0".to_owned()),
            };
            let most = of.largest();
            if !(least..=most).contains(own) {
                return Err(format!("{} is {own:?}; allowed: {named} to {most}", of.name()));
            }
        }
        Ok(())
    }

    /// Adds the terrain of one `[[terrain]]` table.
    fn add_terrain(&mut self, index: usize, entry: TerrainEntry) -> Result<(), String> {
        let terrain = entry.terrain(&self.files)?;
        self.document.add_groups(entry.groups.as_deref())?;
        self.refuse_coefficients(entry.coefficients())?;
        let name = entry.name.clone().unwrap_or_else(|| format!("terrain-{index}"));
        let given = entry.name.clone();
        self.document.terrain.push(entry.exact(name, terrain));
        self.register(given, vec![Owner::Terrain(index)])
    }

    /// Adds the robots of `file`.
    fn add_robots(&mut self, file: &Document) -> Result<Vec<Assembled>, String> {
        let mut robots = Vec::new();
        for (index, entry) in file.robots.iter().enumerate() {
            let named = |why: String| format!("robots[{index}].{why}");
            let is_taken = |robot: &Assembled| robot.prefix() == entry.prefix();
            if robots.iter().any(is_taken) {
                let prefix = entry.prefix();
                return Err(named(format!(
                    "prefix: {prefix:?} is used twice; each robot needs its own"
                )));
            }
            self.document.add_groups(entry.groups.as_deref()).map_err(named)?;
            let Document { bodies, fixed, terrain, .. } = &self.document;
            let (bodies, fixed, terrain) = (bodies.len(), fixed.len(), terrain.len());
            robots.push(entry.add(&self.files, &mut self.document).map_err(named)?);
            let own = || (entry.groups.clone(), entry.collides_with.clone());
            let bodies = self.document.bodies[bodies..].iter_mut();
            bodies.for_each(|of| (of.groups, of.collides_with) = own());
            let fixed = self.document.fixed[fixed..].iter_mut();
            fixed.for_each(|of| (of.groups, of.collides_with) = own());
            let terrain = self.document.terrain[terrain..].iter_mut();
            terrain.for_each(|of| (of.groups, of.collides_with) = own());
        }
        Ok(robots)
    }

    /// Adds the joints of an entry.
    fn add_joints(&mut self, entry: &JointEntry) -> Result<(), String> {
        if let Some(name) = entry.name() {
            checked_name(name)?;
        }
        let first = self.document.joints.len();
        let made = entry.exact(&self.document.bodies, first, |name| self.bodies(name))?;
        for joint in made {
            self.refuse_known_joint(joint.name().unwrap_or_default())?;
            self.document.joints.push(joint);
        }
        let joints = (first..self.document.joints.len()).collect();
        self.joints.extend(entry.name().map(|name| (name.to_owned(), joints)));
        Ok(())
    }

    /// Rejects a second joint with this name.
    fn refuse_known_joint(&self, name: &str) -> Result<(), String> {
        if self.document.joint_names().any(|known| known == name) {
            return Err(format!("name: {name:?} is used twice; each joint needs its own"));
        }
        Ok(())
    }

    /// Adds the motors of an entry on its axis.
    fn add_motor(&mut self, entry: &MotorEntry, robots: &[Assembled]) -> Result<(), String> {
        let joints = self.joints(&entry.joint).map_err(|why| format!("joint: {why}"))?;
        for joint in joints {
            let of = &self.document.joints[joint];
            let name = of.name().unwrap_or_default();
            let place = entry.place(of.kind, name)?;
            if self.motors.contains(&(joint, place)) {
                return Err(format!("joint: {name:?} already has a motor on this axis"));
            }
            let axis = of.kind.driven()[place].1;
            let effort = robots.iter().find_map(|robot| robot.effort((joint, axis)));
            let entry = entry.on(name, effort);
            entry.motor()?;
            self.document.motors.push(entry);
            self.motors.push((joint, place));
        }
        Ok(())
    }

    /// Adds a gear, the `index`-th of the file.
    fn add_gear(&mut self, entry: &GearEntry, index: usize) -> Result<(), String> {
        if index >= MOST_GEARS {
            return Err(format!("joints: there are more than {MOST_GEARS} gears"));
        }
        let gear = entry.gear(|name| {
            let joint = self.joint(name)?;
            let of = &self.document.joints[joint];
            Ok((joint, of.kind, of.name().unwrap_or_default().to_owned()))
        })?;
        self.document.add_gear(&gear);
        Ok(())
    }

    /// Adds the prescribed motion of a body from the time `start` (s) on.
    fn add_driven(&mut self, entry: &DrivenEntry, start: f64) -> Result<(), String> {
        if let Some(name) = entry.name() {
            checked_name(name)?;
        }
        let body = &self.document.bodies[self.one_body("body", entry.body())?];
        if self.document.driven.iter().any(|known| known.body() == body.name()) {
            return Err(format!("body: {:?} is already driven", entry.body()));
        }
        let made = entry.exact(body, start)?;
        self.refuse_known_joint(made.name().unwrap_or_default())?;
        self.document.driven.push(made);
        Ok(())
    }

    /// Index of the only body with this name; `field` has the name.
    fn one_body(&self, field: &str, name: &str) -> Result<usize, String> {
        match self.bodies(name).map_err(|why| format!("{field}: {why}"))?[..] {
            [body] => Ok(body),
            ref all => Err(format!("{field}: {name:?} names {} bodies; one is needed", all.len())),
        }
    }

    /// Sets the motion and the axis of friction of all surfaces with a name.
    fn add_surface(&mut self, entry: &SurfaceEntry) -> Result<(), String> {
        match (entry.axis, entry.factor) {
            (Some(_), Some(_)) => {}
            (None, None) if entry.velocity.is_some() || entry.spin.is_some() => {}
            (None, None) => {
                return Err("velocity: one is needed, or a spin, or axis and factor".to_owned());
            }
            (Some(_), None) => return Err("factor: an axis needs one".to_owned()),
            (None, Some(_)) => return Err("axis: a factor needs one".to_owned()),
        }
        if entry.factor.is_some_and(|factor| !(1e-3..=1e3).contains(&factor)) {
            return Err("factor: a number from 0.001 to 1000 is needed".to_owned());
        }
        let has_length = |axis: [f64; 3]| (1e-6..=1e6).contains(&Vector3::from(axis).norm());
        if entry.axis.is_some_and(|axis| !has_length(axis.0)) {
            return Err("axis: a direction with a length from 1e-6 to 1e6 is needed".to_owned());
        }
        if !entry.velocity.iter().flat_map(|velocity| velocity.0).all(|part| part.abs() <= 1e5) {
            return Err("velocity: components from -1e5 to 1e5 m/s are needed".to_owned());
        }
        if !entry.spin.iter().flat_map(|spin| spin.0).all(|part| part.abs() <= 1e5) {
            return Err("spin: components from -1e5 to 1e5 rad/s are needed".to_owned());
        }
        if !entry.centre.iter().flat_map(|centre| centre.0).all(|part| part.abs() <= 1e6) {
            return Err("centre: coordinates from -1e6 to 1e6 m are needed".to_owned());
        }
        if entry.centre.is_some() && entry.spin.is_none() {
            return Err("spin: a centre needs one".to_owned());
        }
        let axis_of =
            entry.axis_of.as_ref().map(|name| self.one_body("axis_of", name)).transpose()?;
        let axis_of = axis_of.map(|body| self.document.bodies[body].name().to_owned());
        if axis_of.is_some() && entry.axis.is_none() {
            return Err("axis: axis_of needs one".to_owned());
        }
        for owner in self.find(&entry.of).map_err(|why| format!("of: {why}"))? {
            let of = self.document.name_of(owner);
            if self.document.surfaces.iter().any(|known| known.of == of) {
                return Err(format!(
                    "of: the surface of {:?} is given twice; put velocity, spin, axis and factor into one table",
                    entry.of
                ));
            }
            let axis_of = axis_of.clone();
            self.document.surfaces.push(SurfaceEntry { of, axis_of, ..entry.clone() });
        }
        Ok(())
    }

    /// Limits the number of triangles. Visual shapes are drawn separately for every body.
    fn refuse_large_looks(&self) -> Result<(), String> {
        let looks = self.document.bodies.iter().filter_map(|body| self.document.look_of(body));
        let sum: usize = looks.flatten().map(PieceEntry::triangles).sum();
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
