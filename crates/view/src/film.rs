//! Input data of all pictures: a recorded motion of a world, with the looks of its objects.

mod terrain;

use crate::shape::{Mesh, Shape};
use nalgebra::{Isometry3, Matrix3, Quaternion, Translation3, UnitQuaternion, Vector3};
use serde::Serialize;
use tumble_core::contact::Partner;
use tumble_core::error::Error;
use tumble_core::joint::{Axis, Joint};
use tumble_core::mechanics::{Load, RigidBody, State};
use tumble_core::simulation::energy;
use tumble_core::step::StepStatus;
use tumble_core::world::{Plane, World};
use tumble_model::failure::Failure;
use tumble_scene::Document;
use tumble_scene::output::tables::{ContactRow, IntervalRows};

/// Motion of the bodies of a world, with everything needed to draw it.
#[derive(Debug, Clone)]
pub struct Film {
    /// Heading: name of the scene; empty if unknown.
    pub title: String,
    /// Seed and solver, which distinguish runs of a scene; empty if unknown.
    pub variant: String,
    /// Further information for the page.
    pub facts: Vec<Fact>,
    /// Command that takes over from a frame; `None` if unknown.
    pub takeover: Option<Takeover>,
    /// Number of steps between frames.
    pub every: u64,
    /// World of the motion.
    pub world: World,
    /// Ground that is drawn. `None` if there is none.
    pub ground: Option<Plane>,
    /// Looks of the bodies of the world, at least one.
    pub bodies: Vec<Object>,
    /// Looks of its fixed objects besides the ground: of fixed pieces, then of terrains.
    pub fixed: Vec<Object>,
    /// Names of its joints.
    pub joints: Vec<String>,
    /// Frames, at least one, at equal time intervals. The last has no step. Contacts without force
    /// may be omitted.
    pub frames: Vec<IntervalRows>,
}

/// Share of the largest motion from which a body counts as moving, and smallest motion of one, over
/// its size.
const MOVING: f64 = 0.5;
const LEAST_MOTION: f64 = 0.01;
/// Number of frames in which motion is looked for.
const MOTION_FRAMES: usize = 500;

/// Name and value of a parameter, as text.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Fact {
    /// Name.
    pub name: String,
    /// Value with unit.
    pub value: String,
}

/// Look of a body or of a fixed object.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Object {
    /// Name; may be empty.
    pub name: String,
    /// Text shown at the object, and in headings instead of its name; may be empty.
    pub label: String,
    /// Red, green and blue. `None` selects a colour of the palette.
    pub colour: Option<[u8; 3]>,
    /// Load besides gravity and contact, for the page.
    pub load: Load,
    /// Geometry in the frame of the body, relative to its centre of mass, or in the world.
    pub shapes: Vec<Shape>,
}

/// Command that takes over from a frame of a film.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Takeover {
    /// Command, which the step index of the frame completes.
    pub command: String,
    /// Step index of the first frame.
    pub first: u64,
    /// Number of steps between frames.
    pub every: u64,
}

impl Film {
    /// Film of `frames` in the `world` of a `document` in exact form, without title and facts. A
    /// `floating` body can touch nothing, even if the world has a ground.
    ///
    /// # Errors
    /// An invalid load or look.
    pub fn new(
        world: &World,
        document: &Document,
        floating: bool,
        mut frames: Vec<IntervalRows>,
    ) -> Result<Self, Failure> {
        // Only contacts with a force are drawn.
        frames
            .iter_mut()
            .for_each(|frame| std::sync::Arc::make_mut(&mut frame.contacts).retain(is_loaded));
        let bodies = document.bodies.iter().zip(world.bodies()).zip(document.loads()?).enumerate();
        let bodies = bodies.map(|(index, ((body, rigid), load))| {
            let centre = body.centre();
            // Parts of a look, relative to the centre of mass.
            let parts = document.look_of(body).map(|parts| {
                let shapes = parts.iter().map(|part| {
                    let Some(surface) = part.look_surface() else {
                        let piece = part.piece()?.moved_by(&Matrix3::identity(), &-centre)?;
                        return Ok(Shape::from(&piece));
                    };
                    let place = part.place();
                    let rotation = place.rotation();
                    let position = Vector3::from(place.position);
                    let corner = |at: &[f64; 3]| rotation * Vector3::from(*at) + position - centre;
                    let vertices = surface.vertices.iter().map(|at| corner(&at.0)).collect();
                    let triangles = surface.triangles.iter().map(|three| three.0).collect();
                    let colour = surface.colour.map(|colour| colour.0);
                    Ok(Shape::Mesh(Mesh { vertices, triangles, colour }))
                });
                shapes.collect::<Result<_, Error>>()
            });
            let shapes = parts.unwrap_or_else(|| Ok(Shape::from_body(rigid)));
            let shapes = shapes
                .map_err(|error| Failure::Input(format!("model.bodies[{index}].look: {error}")));
            let label = body.label.as_ref().map_or(String::new(), |label| label.0.clone());
            let (name, colour) = (body.name().to_owned(), body.colour.map(|colour| colour.0));
            Ok(Object { name, label, colour, load, shapes: shapes? })
        });
        // Fixed pieces, then terrains, in the order of their names
        let mut names = document.fixed_names();
        let pieces = world.fixed().iter().zip(names.by_ref()).map(|(fixed, name)| Object {
            name: name.to_owned(),
            shapes: vec![Shape::from(fixed)],
            ..Object::default()
        });
        let pieces: Vec<_> = pieces.collect();
        let terrains = world.terrains().iter().zip(names);
        let terrains = terrains.map(|(of, name)| terrain::object(name, of));
        let mut film = Self {
            title: String::new(),
            variant: String::new(),
            facts: Vec::new(),
            takeover: None,
            every: 1,
            world: world.clone(),
            ground: None,
            bodies: bodies.collect::<Result<_, Failure>>()?,
            fixed: pieces.into_iter().chain(terrains).collect(),
            joints: document.joint_names().map(str::to_owned).collect(),
            frames,
        };
        let ground = world.ground().filter(|plane| !floating && film.reaches(plane));
        film.ground = ground.cloned();
        Ok(film)
    }

    /// This film with other `frames`, without title and facts.
    pub(crate) fn with_frames(&self, frames: Vec<IntervalRows>) -> Self {
        Self {
            title: String::new(),
            variant: String::new(),
            facts: Vec::new(),
            takeover: None,
            every: self.every,
            world: self.world.clone(),
            ground: self.ground.clone(),
            bodies: self.bodies.clone(),
            fixed: self.fixed.clone(),
            joints: self.joints.clone(),
            frames,
        }
    }

    /// First body that moves as far as others do, or body 0 if none moves.
    pub fn first_moving(&self) -> usize {
        let start = &self.frames[0].states;
        let motion = |b: usize| {
            let from = pose(&start[b]);
            let reach = self.bodies[b].reach();
            let distance = |frame: &IntervalRows| {
                let to = pose(&frame.states[b]);
                let turned = reach * from.rotation.angle_to(&to.rotation);
                (to.translation.vector - from.translation.vector).norm() + turned
            };
            let frames = self.frames.iter().step_by(self.frames.len().div_ceil(MOTION_FRAMES));
            let farthest = frames.map(distance).fold(0.0, f64::max);
            if farthest > LEAST_MOTION * reach { farthest } else { 0.0 }
        };
        let motions: Vec<_> = (0..self.bodies.len()).map(motion).collect();
        let most = motions.iter().copied().fold(0.0, f64::max);
        motions.iter().position(|motion| *motion >= MOVING * most).unwrap_or(0)
    }

    /// Title with the variant.
    pub(crate) fn full_title(&self) -> String {
        let known = [&self.title, &self.variant].into_iter().filter(|text| !text.is_empty());
        known.map(String::as_str).collect::<Vec<_>>().join(", ")
    }

    /// Frames with a step: all but the last.
    pub(crate) fn steps(&self) -> &[IntervalRows] {
        self.frames.split_last().map_or(&[], |(_, steps)| steps)
    }

    /// Time between frames (s).
    pub fn frame_time(&self) -> f64 {
        self.every as f64 * self.world.time_step()
    }

    /// True if a step is not converged.
    pub fn has_failed(&self) -> bool {
        self.frames.iter().any(|frame| frame.row.status == StepStatus::Failed)
    }

    /// Sum of an energy over the bodies in a frame (J).
    pub(crate) fn energy(
        &self,
        frame: &IntervalRows,
        of: fn(&World, &RigidBody, &State) -> f64,
    ) -> f64 {
        let bodies = self.world.bodies().iter().zip(&frame.states);
        bodies.map(|(body, state)| of(&self.world, body, state)).sum()
    }

    /// Kinetic energy in a frame (J): that of the velocities of the instant, if they are known.
    pub(crate) fn kinetic(&self, frame: &IntervalRows) -> f64 {
        let of_instant = |(body, state): (&RigidBody, &State)| {
            let turning = state.spin.dot(&(body.inertia() * state.spin));
            0.5 * (body.mass() * state.velocity.norm_squared() + turning)
        };
        match frame.instants.as_slice() {
            [] => self.energy(frame, energy::kinetic),
            instants => self.world.bodies().iter().zip(instants).map(of_instant).sum(),
        }
    }

    /// Gravitational potential energy in a frame, relative to the origin (J).
    pub(crate) fn potential(&self, frame: &IntervalRows) -> f64 {
        self.energy(frame, energy::potential)
    }

    /// Label of body `b`, or else its name.
    pub(crate) fn name(&self, b: usize) -> String {
        let Object { name, label, .. } = &self.bodies[b];
        match [label, name].into_iter().find(|word| !word.is_empty()) {
            Some(word) => word.clone(),
            None => format!("body {b}"),
        }
    }

    /// Height of the lowest point of body `b` in `frame` above the ground, or its lowest z
    /// coordinate without ground (m).
    pub(crate) fn lowest_height(&self, b: usize, frame: &IntervalRows) -> f64 {
        let pose = pose(&frame.states[b]);
        let height = |point: &Vector3<f64>| {
            let place = pose.translation.vector + pose.rotation * point;
            self.ground.as_ref().map_or(place.z, |plane| height(plane, &place))
        };
        let lowest = |shape: &Shape| {
            shape.core().iter().map(height).fold(f64::INFINITY, f64::min) - shape.radius()
        };
        self.bodies[b].shapes.iter().map(lowest).fold(f64::INFINITY, f64::min)
    }

    /// Transform from the world to the ground's frame; identity without ground.
    pub(crate) fn to_ground(&self) -> Isometry3<f64> {
        self.ground.as_ref().map_or(Isometry3::identity(), frame_of)
    }

    /// True if contacts are possible.
    pub(crate) fn may_touch(&self) -> bool {
        self.ground.is_some() || self.bodies.len() > 1
    }

    /// Ground other than the plane z = 0.
    pub(crate) fn inclined_ground(&self) -> Option<&Plane> {
        let is_level = |plane: &Plane| *plane.normal() == Vector3::z() && plane.offset() == 0.0;
        self.ground.as_ref().filter(|plane| !is_level(plane))
    }

    /// True if the distance of the motion to the ground is at most its size. A picture with a
    /// farther ground would show nothing else.
    fn reaches(&self, ground: &Plane) -> bool {
        let still = self.fixed.iter().flat_map(|fixed| &fixed.shapes).flat_map(Shape::core);
        let moving = self.frames.iter().flat_map(|frame| &frame.states);
        let places = still.copied().chain(moving.map(|state| state.position));
        let (mut low, mut high) =
            (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY));
        let mut lowest = f64::INFINITY;
        for place in places {
            (low, high) = (low.inf(&place), high.sup(&place));
            lowest = lowest.min(height(ground, &place));
        }
        let reach = self.world.bodies().iter().map(RigidBody::reach).fold(0.0, f64::max);
        lowest <= (high - low).norm() + 2.0 * reach
    }
}

/// True if a contact carries a force.
pub fn is_loaded(contact: &ContactRow) -> bool {
    contact.force != Vector3::zeros()
}

/// Pose of a body. The digits of the file are kept: they have length 1.
pub(crate) fn pose(state: &State) -> Isometry3<f64> {
    let [w, x, y, z] = state.attitude.into();
    let attitude = UnitQuaternion::new_unchecked(Quaternion::new(w, x, y, z));
    Isometry3::from_parts(state.position.into(), attitude)
}

/// True if body `b` is on either side of the contact.
pub(crate) fn is_of(contact: &ContactRow, b: usize) -> bool {
    contact.body == b || contact.partner == Partner::Body(b)
}

/// True if a joint only translates along its axis, and true if it only rotates about it.
pub(crate) fn slides_and_turns(joint: &Joint) -> [bool; 2] {
    [joint.linear(), joint.angular()]
        .map(|axes| axes[..2].iter().all(|axis| *axis == Axis::Locked) && axes[2] != Axis::Locked)
}

/// Unit vector of the axis of a joint, body frame. `None` for a joint without axis.
pub(crate) fn axis(joint: &Joint) -> Option<Vector3<f64>> {
    let has_axis = slides_and_turns(joint).contains(&true);
    has_axis.then(|| joint.frames()[0].rotation().column(2).into_owned())
}

/// Signed distance n · x − d to a plane (m).
fn height(plane: &Plane, place: &Vector3<f64>) -> f64 {
    plane.normal().dot(place) - plane.offset()
}

/// Angle between a plane and the horizontal (degrees).
pub(crate) fn slope(plane: &Plane) -> f64 {
    plane.normal().z.clamp(-1.0, 1.0).acos().to_degrees()
}

/// Transform from the world to a frame in which the plane is z = 0. It uses the smallest rotation. A
/// horizontal plane through the origin keeps the world frame.
fn frame_of(plane: &Plane) -> Isometry3<f64> {
    let turn = UnitQuaternion::rotation_between(plane.normal(), &Vector3::z())
        .unwrap_or_else(|| UnitQuaternion::from_euler_angles(std::f64::consts::PI, 0.0, 0.0));
    let foot = turn * (plane.offset() * plane.normal());
    Isometry3::from_parts(Translation3::from(-foot), turn)
}

impl Object {
    /// Largest distance of its geometry from the origin of its frame (m).
    pub(crate) fn reach(&self) -> f64 {
        let ends = |shape: &Shape| {
            shape.core().iter().map(|point| point.norm()).fold(0.0, f64::max) + shape.radius()
        };
        self.shapes.iter().map(ends).fold(0.0, f64::max)
    }
}

impl Fact {
    /// Creates a fact.
    pub fn new(name: impl Into<String>, value: impl Into<String>) -> Self {
        Self { name: name.into(), value: value.into() }
    }
}

#[cfg(test)]
#[path = "tests/film.rs"]
mod tests;
