//! Documents in exact form: one entry for each body, object and joint, with all numbers.

use super::drawn::state_at;
use super::entries::{AttitudeEntry, BodyEntry, FixedEntry, LookValue, PieceEntry, plain};
use super::gears::GearEntry;
use super::joints::{JointEntry, MotorEntry};
use crate::bodies::place::Place;
use crate::bodies::shape::BodyShape;
use crate::choices::StartFrame;
use crate::coefficients::Each;
use crate::document::Document;
use crate::tables::{InertiaValue, LoadTable};
use nalgebra::{Matrix3, Vector3};
use std::collections::HashMap;
use tumble_core::contact::{Partner, Plane};
use tumble_core::error::Error;
use tumble_core::joint::{Drive, Gear, GearAxis, Knots, Motor};
use tumble_core::mechanics::{Load, RigidBody, State};
use tumble_core::simulation::random::Draws;
use tumble_core::world::Coefficient;
use tumble_model::failure::Failure;
use tumble_model::fields::{Exactly, numbers};
use tumble_model::joint::JointKind;

/// Relative tolerance between a stored start and the same draw computed again, possibly on another
/// machine.
const SAME: f64 = 1e-12;

/// Owner of a surface, by the indices of the entries. Pieces of fixed objects are counted one by one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Owner {
    /// Ground.
    Ground,
    /// Fixed piece.
    Fixed(usize),
    /// Terrain.
    Terrain(usize),
    /// Body.
    Body(usize),
}

/// Fields that bodies, fixed objects and terrains have in common.
pub struct Collider<'a> {
    /// Table and index of the entry.
    pub table: (&'static str, usize),
    /// Name.
    pub name: &'a str,
    /// Body, pieces or terrain.
    pub owners: Vec<Owner>,
    /// Own coefficients of laws.
    pub coefficients: Each<&'a f64>,
    /// Names of its groups.
    pub groups: &'a [String],
    /// Names of the groups that it collides with; `None` for all.
    pub collides_with: Option<&'a [String]>,
}

/// Field of a collider in the table `$table` with these `$owners`.
macro_rules! collider {
    ($table:literal, $index:expr, $entry:expr, $owners:expr) => {
        Collider {
            table: ($table, $index),
            name: $entry.name.as_deref().unwrap_or_default(),
            owners: $owners,
            coefficients: $entry.coefficients(),
            groups: $entry.groups.as_deref().unwrap_or_default(),
            collides_with: $entry.collides_with.as_deref(),
        }
    };
}

impl Document {
    /// Plane of the ground.
    ///
    /// # Errors
    /// A slope or normal out of range.
    pub fn plane(&self) -> Result<Option<Plane>, String> {
        self.ground.as_ref().map_or(Ok(None), |ground| ground.plane())
    }

    /// Coefficient of friction of the ground.
    pub fn friction_of_ground(&self) -> f64 {
        self.ground.as_ref().and_then(|ground| ground.friction).unwrap_or(0.0)
    }

    /// Number of fixed pieces.
    pub fn fixed_count(&self) -> usize {
        self.fixed.iter().map(FixedEntry::count).sum()
    }

    /// Names of the fixed pieces, then of the terrains.
    pub fn fixed_names(&self) -> impl Iterator<Item = &str> {
        let pieces = |entry| std::iter::repeat_n(FixedEntry::name(entry), entry.count());
        let terrains =
            self.terrain.iter().map(|terrain| terrain.name.as_deref().unwrap_or_default());
        self.fixed.iter().flat_map(pieces).chain(terrains)
    }

    /// Names of the joints: of `joints`, then of `driven`.
    pub fn joint_names(&self) -> impl Iterator<Item = &str> {
        let driven = self.driven.iter().map(|entry| entry.name().unwrap_or_default());
        self.joints.iter().map(|entry| entry.name().unwrap_or_default()).chain(driven)
    }

    /// Type of the joint `index`. Prescribed motions are fixed joints with a frame that moves.
    pub fn joint_kind(&self, index: usize) -> JointKind {
        self.joints.get(index).map_or(JointKind::Fixed, |joint| joint.kind)
    }

    /// Bodies, fixed objects and terrains.
    pub fn colliders(&self) -> impl Iterator<Item = Collider<'_>> {
        let bodies = self.bodies.iter().enumerate();
        let bodies = bodies.map(|(at, body)| collider!("bodies", at, body, vec![Owner::Body(at)]));
        let mut next = 0;
        let fixed = self.fixed.iter().enumerate().map(move |(at, entry)| {
            let first = next;
            next += entry.count();
            collider!("fixed", at, entry, (first..next).map(Owner::Fixed).collect())
        });
        let terrains = self.terrain.iter().enumerate();
        let terrains =
            terrains.map(|(at, entry)| collider!("terrain", at, entry, vec![Owner::Terrain(at)]));
        bodies.chain(fixed).chain(terrains)
    }

    /// Owner in the world. Its terrains are numbered after the fixed pieces.
    pub fn partner(&self, owner: Owner) -> Partner {
        match owner {
            Owner::Ground => Partner::Ground,
            Owner::Fixed(index) => Partner::Fixed(index),
            Owner::Terrain(index) => Partner::Fixed(self.fixed_count() + index),
            Owner::Body(index) => Partner::Body(index),
        }
    }

    /// Owner of a surface of the world.
    pub fn owner(&self, partner: Partner) -> Owner {
        match partner {
            Partner::Ground => Owner::Ground,
            Partner::Body(index) => Owner::Body(index),
            Partner::Fixed(index) => match index.checked_sub(self.fixed_count()) {
                None => Owner::Fixed(index),
                Some(terrain) => Owner::Terrain(terrain),
            },
        }
    }

    /// Index of the entry with the fixed piece `index`.
    fn fixed_entry(&self, mut index: usize) -> Option<usize> {
        self.fixed.iter().position(|entry| {
            let is_here = index < entry.count();
            index = index.saturating_sub(entry.count());
            is_here
        })
    }

    /// Name of an owner in pairs. One of several pieces of an object has its number.
    pub fn name_of(&self, owner: Owner) -> String {
        let name = match owner {
            Owner::Ground => Some("ground"),
            Owner::Body(index) => self.bodies.get(index).map(BodyEntry::name),
            Owner::Terrain(index) => self.terrain.get(index).and_then(|of| of.name.as_deref()),
            Owner::Fixed(index) => match self.fixed_entry(index).map(|entry| &self.fixed[entry]) {
                Some(entry) if entry.count() > 1 => return format!("fixed[{index}]"),
                entry => entry.map(FixedEntry::name),
            },
        };
        name.unwrap_or_default().to_owned()
    }

    /// Name of an owner. Pieces have the name of their object.
    pub fn object_name(&self, owner: Owner) -> String {
        match owner {
            Owner::Fixed(index) => self.fixed_names().nth(index).unwrap_or_default().to_owned(),
            other => self.name_of(other),
        }
    }

    /// Body with this name, whose shape or look another one has.
    fn first(&self, name: &str) -> Option<&BodyEntry> {
        self.bodies.iter().find(|body| body.name() == name)
    }

    /// Collision shape of a body.
    ///
    /// # Errors
    /// No or several shapes.
    pub fn shape_of(&self, body: &BodyEntry) -> Result<BodyShape, String> {
        let owner = body.shape.as_deref().map_or(Some(body), |name| self.first(name));
        let owner = owner.ok_or_else(|| "shape: no such body".to_owned())?;
        match (&owner.points, &owner.pieces) {
            (Some(points), None) => Ok(BodyShape::Points(plain(points))),
            (None, Some(pieces)) => Ok(BodyShape::Pieces(pieces.clone())),
            _ => Err("shape: points or pieces are needed".to_owned()),
        }
    }

    /// Visual shape of a body, if it has one.
    pub fn look_of<'a>(&'a self, body: &'a BodyEntry) -> Option<&'a [PieceEntry]> {
        let look = match body.look.as_ref()? {
            LookValue::Of(name) => self.first(name)?.look.as_ref()?,
            own => own,
        };
        if let LookValue::Parts(parts) = look { Some(parts) } else { None }
    }

    /// Adds a body with this shape. A shape that an earlier body has is written once.
    pub fn add_body(&mut self, mut body: BodyEntry, shape: BodyShape) {
        match shape {
            BodyShape::Points(points) => {
                body.points = Some(points.into_iter().map(Exactly).collect());
            }
            BodyShape::Pieces(pieces) => body.pieces = Some(pieces),
        }
        let is_same = |known: &&BodyEntry| {
            known.shape.is_none() && known.pieces == body.pieces && known.points == body.points
        };
        if let Some(known) = self.bodies.iter().find(is_same) {
            (body.shape, body.pieces, body.points) = (known.name.clone(), None, None);
        }
        self.bodies.push(body);
    }

    /// Coefficient of an owner, or of the world for the ground.
    pub fn own_coefficient(&mut self, owner: Owner, of: Coefficient) -> Option<&mut Option<f64>> {
        Some(match owner {
            Owner::Ground => self.ground.as_mut()?.coefficient_mut(of),
            Owner::Body(index) => self.bodies.get_mut(index)?.coefficient_mut(of),
            Owner::Terrain(index) => self.terrain.get_mut(index)?.coefficient_mut(of),
            Owner::Fixed(index) => {
                let entry = self.fixed_entry(index)?;
                self.fixed[entry].coefficient_mut(of)
            }
        })
    }

    /// Sets the motor on the axis, from 0 to 5, of a joint, instead of another motor and a constant
    /// force.
    ///
    /// # Errors
    /// A joint or an axis that does not exist.
    pub fn set_motor(&mut self, joint: usize, axis: usize, motor: &Motor) -> Result<(), String> {
        let entry = self.joints.get_mut(joint).ok_or_else(|| "joint: unknown".to_owned())?;
        let kind = entry.kind;
        let name = entry.name().unwrap_or_default().to_owned();
        let place = kind.driven().iter().position(|(_, known)| *known == axis);
        let place = place.ok_or_else(|| format!("axis of {name}: unknown"))?;
        let axis = kind.driven()[place].0;
        entry.set_drive(axis, &Drive { force: 0.0, ..entry.drives()[place] });
        self.motors.retain(|known| known.joint != name || known.place(kind, &name) != Ok(place));
        let axis = (kind.driven().len() > 1).then_some(axis);
        self.motors.push(MotorEntry::exact(&name, axis, motor));
        Ok(())
    }

    /// Adds a gear between joints.
    pub fn add_gear(&mut self, gear: &Gear) {
        let name = |axis: &GearAxis| {
            self.joints.get(axis.joint).and_then(JointEntry::name).unwrap_or_default()
        };
        let axis = |of: &GearAxis| {
            let driven = self.joint_kind(of.joint).driven();
            let axis = driven.iter().find(|(_, axis)| GearAxis::new(of.joint, *axis) == *of);
            axis.map_or("", |(name, _)| name)
        };
        let axes = gear.axes();
        let entry = GearEntry::exact(axes.each_ref().map(name), axes.each_ref().map(axis), gear);
        self.gears.push(entry);
    }

    /// Joint with this name: index, type and name.
    pub fn place_of_joint(
        &self,
        names: &NameIndex<'_>,
        name: &str,
    ) -> Result<(usize, JointKind, String), String> {
        let joint = names.joint(name)?;
        Ok((joint, self.joint_kind(joint), name.to_owned()))
    }

    /// Removes the body `index`, its pairs, the joints attached to it and their gears.
    pub fn leave_out(&mut self, index: usize) {
        if index >= self.bodies.len() {
            return;
        }
        let gone = self.bodies.remove(index);
        let name = gone.name();
        // The next body with its shape or look has it from now on.
        let mut shapes = self.bodies.iter_mut().filter(|body| body.shape.as_deref() == Some(name));
        if let Some(heir) = shapes.next() {
            (heir.shape, heir.pieces, heir.points) =
                (None, gone.pieces.clone(), gone.points.clone());
            shapes.for_each(|body| body.shape.clone_from(&heir.name));
        }
        let look = Some(LookValue::Of(name.to_owned()));
        let mut looks = self.bodies.iter_mut().filter(|body| body.look == look);
        if let Some(heir) = looks.next() {
            heir.look.clone_from(&gone.look);
            looks.for_each(|body| body.look = heir.name.clone().map(LookValue::Of));
        }
        let stays = |between: &Exactly<String, 2>| between.0.iter().all(|body| body != name);
        for law in Coefficient::ALL {
            if let Some(pairs) = self.coefficient_mut(law) {
                pairs.retain(|pair| stays(&pair.between));
            }
        }
        self.apart.retain(|pair| stays(&pair.between));
        self.surfaces.retain(|surface| {
            surface.of != name && surface.axis_of.as_deref().is_none_or(|body| body != name)
        });
        self.driven.retain(|entry| entry.body() != name);
        let (gone, joints): (Vec<_>, Vec<_>) =
            std::mem::take(&mut self.joints).into_iter().partition(|joint| joint.has(name));
        self.joints = joints;
        let is_gone = |joint: &str| gone.iter().any(|entry| entry.name() == Some(joint));
        self.motors.retain(|motor| !is_gone(&motor.joint));
        self.gears.retain(|gear| !gear.joints.iter().any(|joint| is_gone(joint)));
    }

    /// States of the bodies at step 0.
    pub fn states(&self) -> Vec<State> {
        self.bodies.iter().map(BodyEntry::start).collect()
    }

    /// External load of each body.
    ///
    /// # Errors
    /// Knots out of order or out of range.
    pub fn loads(&self) -> Result<Vec<Load>, Failure> {
        let load = |(index, body): (usize, &BodyEntry)| {
            let load = body.load.as_ref().map_or(Ok(Load::none()), LoadTable::load);
            load.map_err(|why| Failure::Input(format!("bodies[{index}].{why}")))
        };
        self.bodies.iter().enumerate().map(load).collect()
    }

    /// Prescribed motions of joint frames in the world, with the index of each joint.
    ///
    /// # Errors
    /// Invalid knots or velocities.
    pub fn courses(&self) -> Result<Vec<(usize, Knots)>, Failure> {
        let first = self.joints.len();
        let knots = |(index, entry): (usize, &super::driven::DrivenEntry)| {
            let joint = first + index;
            let invalid = |why| {
                let name = entry.name().unwrap_or_default();
                Failure::Input(format!("joints[{joint}] ({name}): {why}"))
            };
            Ok((joint, entry.knots().map_err(invalid)?))
        };
        self.driven.iter().enumerate().map(knots).collect()
    }

    /// Sets the initial `states`, one per body.
    pub fn set_starts(&mut self, states: &[State]) {
        for (body, state) in self.bodies.iter_mut().zip(states) {
            body.set_start(state);
        }
    }

    /// Sets a coefficient of everything, moving or not; `None` for the defaults.
    pub fn set_coefficient(&mut self, of: Coefficient, value: Option<f64>) {
        if let Some(ground) = &mut self.ground {
            *ground.coefficient_mut(of) = value;
        }
        self.bodies.iter_mut().for_each(|body| *body.coefficient_mut(of) = None);
        self.fixed.iter_mut().for_each(|fixed| *fixed.coefficient_mut(of) = None);
        self.terrain.iter_mut().for_each(|terrain| *terrain.coefficient_mut(of) = None);
        *self.coefficient_mut(of) = None;
    }

    /// Sets the external `loads`, one per body.
    pub fn set_loads(&mut self, loads: &[Load]) {
        for (body, load) in self.bodies.iter_mut().zip(loads) {
            body.load = LoadTable::new(load);
        }
    }

    /// Sets the initial `states`, and moves prescribed frames to their places at `time` (s).
    ///
    /// # Errors
    /// Invalid knots or velocities.
    pub fn start_at(&mut self, states: &[State], time: f64) -> Result<(), Failure> {
        self.set_starts(states);
        for ((_, knots), entry) in self.courses()?.into_iter().zip(&mut self.driven) {
            entry.set_frame(Place::from_frame(&knots.at(time)));
        }
        Ok(())
    }

    /// True if a start depends on the seed.
    pub fn is_drawn(&self) -> bool {
        self.bodies.iter().any(|body| body.drawn.is_some())
    }

    /// Name of the first body whose start differs from the draw of `seed`.
    pub fn seed_mismatch(&self, seed: u32) -> Option<&str> {
        let mut draws = Draws::new(seed);
        let ground = self.plane().ok().flatten();
        let body = self.bodies.iter().find(|body| {
            let Some(drawn) = &body.drawn else { return false };
            let still = Vector3::zeros();
            let ground = ground.as_ref().filter(|_| drawn.ground);
            let found = state_at(ground, &drawn.place(&mut draws), still, still, &body.centre());
            let start = body.start();
            let off = (found.position - start.position).amax();
            let turned = (found.attitude - start.attitude).amax();
            // Written so that a NaN counts as a difference.
            let is_there = off <= SAME * (1.0 + start.position.amax()) && turned <= SAME;
            !is_there
        });
        body.map(|body| body.name())
    }

    /// Removes the descriptions of the random starts unless all starts equal the draws of `seed`.
    ///
    /// They differ after a body was removed or a state was set.
    pub fn drop_draws_unless_from(&mut self, seed: u32) {
        if self.seed_mismatch(seed).is_some() {
            self.bodies.iter_mut().for_each(|body| body.drawn = None);
        }
    }

    /// Places of the names of bodies, fixed objects, terrains and joints.
    pub fn index(&self) -> NameIndex<'_> {
        let mut owners = HashMap::from([("ground", Owner::Ground)]);
        for object in self.colliders() {
            owners.extend(object.owners.first().map(|owner| (object.name, *owner)));
        }
        let joints = self.joint_names().enumerate().map(|(index, name)| (name, index)).collect();
        NameIndex { owners, joints, fixed: self.fixed_count() }
    }
}

/// Places of names in a document in exact form.
pub struct NameIndex<'a> {
    owners: HashMap<&'a str, Owner>,
    joints: HashMap<&'a str, usize>,
    /// Number of fixed pieces.
    fixed: usize,
}

impl NameIndex<'_> {
    /// Object with this name.
    pub fn owner(&self, name: &str) -> Result<Owner, String> {
        let piece = name.strip_prefix("fixed[").and_then(|rest| rest.strip_suffix(']'));
        let piece = piece.and_then(|index| index.parse().ok()).filter(|index| *index < self.fixed);
        let found = piece.map(Owner::Fixed).or_else(|| self.owners.get(name).copied());
        found.ok_or_else(|| format!("unknown name {name:?}"))
    }

    /// Body with this name.
    pub fn body(&self, name: &str) -> Result<usize, String> {
        match self.owner(name)? {
            Owner::Body(index) => Ok(index),
            _ => Err(format!("{name:?} never moves; a body is needed")),
        }
    }

    /// Body and partner of a pair.
    pub fn pair(&self, between: &Exactly<String, 2>) -> Result<(usize, Owner), String> {
        let [first, second] = &between.0;
        Ok((self.body(first)?, self.owner(second)?))
    }

    /// Joint with this name.
    pub fn joint(&self, name: &str) -> Result<usize, String> {
        self.joints.get(name).copied().ok_or_else(|| format!("unknown joint {name:?}"))
    }
}

impl FixedEntry {
    /// Name.
    pub fn name(&self) -> &str {
        self.name.as_deref().unwrap_or_default()
    }

    /// Number of its pieces.
    pub fn count(&self) -> usize {
        self.pieces.as_ref().map_or(0, Vec::len)
    }
}

impl BodyEntry {
    /// Name.
    pub fn name(&self) -> &str {
        self.name.as_deref().unwrap_or_default()
    }

    /// Centre of mass in the shape's frame (m).
    pub fn centre(&self) -> Vector3<f64> {
        self.centre.map_or(Vector3::zeros(), |centre| centre.0.into())
    }

    /// Mass (kg); NaN if it is missing.
    pub fn mass(&self) -> f64 {
        self.mass.unwrap_or(f64::NAN)
    }

    /// Inertia tensor about the centre of mass (kg m²), body frame.
    pub fn inertia(&self) -> Matrix3<f64> {
        let given = self.inertia.as_ref().and_then(InertiaValue::matrix);
        given.unwrap_or(Matrix3::from_element(f64::NAN))
    }

    /// Sets the mass properties.
    pub fn set_mass(&mut self, mass: f64, inertia: &Matrix3<f64>) {
        let rows: [[f64; 3]; 3] = inertia.transpose().into();
        self.mass = Some(mass);
        self.inertia = Some(InertiaValue::Rows(Exactly(rows.map(Exactly))));
    }

    /// Initial state of the centre of mass.
    pub fn start(&self) -> State {
        let attitude = match self.attitude.as_ref().map(AttitudeEntry::quaternion) {
            Some(Ok(Some(quaternion))) => quaternion,
            _ => Place::ORIGIN.attitude,
        };
        let rate =
            |rate: Option<Exactly<f64, 3>>| rate.map_or(Vector3::zeros(), |rate| rate.0.into());
        let (velocity, spin) = (rate(self.velocity), rate(self.spin));
        State { position: self.position.0.into(), attitude: attitude.into(), velocity, spin }
    }

    /// Sets the initial state of the centre of mass.
    pub fn set_start(&mut self, start: &State) {
        // A zero with a sign keeps it.
        let is_zero = |rate: &Vector3<f64>| rate.iter().all(|part| part.to_bits() == 0);
        let rate = |rate: &Vector3<f64>| (!is_zero(rate)).then(|| numbers(rate));
        self.frame = Some(StartFrame::Centre);
        self.position = numbers(&start.position);
        self.attitude = Some(AttitudeEntry::exact(start.attitude.into()));
        (self.velocity, self.spin) = (rate(&start.velocity), rate(&start.spin));
    }

    /// True unless the body collides with nothing.
    pub fn touches(&self) -> bool {
        self.touches != Some(false)
    }

    /// Rigid body with the given `shape`.
    ///
    /// # Errors
    /// The errors of the core for invalid properties.
    pub fn rigid_body(&self, shape: &BodyShape) -> Result<RigidBody, Error> {
        shape.body(self.mass(), self.inertia(), &self.centre())
    }

    /// Name of the body that has its shape in numbers.
    fn shape_owner(&self) -> Option<&str> {
        self.shape.as_deref().or(self.name.as_deref())
    }

    /// True if both have the same shape and mass properties.
    pub fn is_like(&self, other: &Self) -> bool {
        self.mass == other.mass
            && self.centre == other.centre
            && self.inertia == other.inertia
            && self.shape_owner() == other.shape_owner()
    }
}
