//! A robot in a scene: its links as bodies, joints, fixed things, and what of them touches.

use super::frame::Frame;
use super::joining::{Joined, drive, joined};
use super::model::{Form as RobotForm, Mass, Moves, Robot, Shape as RobotShape, Tie};
use super::motion::{LinkMotion, Motion};
use crate::mechanics::State;
use crate::scenario::joint::{JointKind, JointModel};
use crate::scenario::model::{
    ApartModel, BodyModel, BodyStart, FixedModel, Model, PairModel, PartnerModel,
};
use crate::scenario::shape::{Form, Place, PlacedForm, Shape};
use crate::scenario::shown::checked_name;
use nalgebra::Vector3;
use std::f64::consts::TAU;

/// How a robot is put into a scene.
#[derive(Debug, Clone)]
pub struct Placing {
    /// The world of the file in that of the scene.
    pub frame: Frame,
    /// Before the names of its links and joints.
    pub prefix: String,
    /// The pose of the file that it starts in.
    pub key: Option<String>,
    /// Coordinates of slides and hinges at the start, before those of the pose.
    pub coordinates: Vec<(String, f64)>,
    /// Whether its links touch each other.
    pub touches_itself: bool,
    /// Whether links without joints are one body with those that they are fixed to.
    pub merges: bool,
    /// The sides of the prisms that stand for cylinders.
    pub sides: usize,
    /// Whether the planes of the file are the ground of the scene.
    pub has_ground: bool,
}

impl Default for Placing {
    fn default() -> Self {
        Self {
            frame: Frame::identity(),
            prefix: String::new(),
            key: None,
            coordinates: Vec::new(),
            touches_itself: true,
            merges: true,
            sides: USUAL_SIDES,
            has_ground: false,
        }
    }
}

/// The sides of the prism that stands for a cylinder where nothing else is said.
pub const USUAL_SIDES: usize = 24;

/// A robot that is in a scene: which bodies and joints it is.
#[derive(Debug, Clone)]
pub struct Assembled {
    robot: Robot,
    prefix: String,
    frame: Frame,
    /// Which link's frame each body has, its index in the scene, and its centre of mass in that frame (m).
    bodies: Vec<(usize, usize, Vector3<f64>)>,
    /// Of each link its place in `bodies`, none of what is fixed, and where it is in that link.
    links: Vec<(Option<usize>, Frame)>,
    /// Of each joint the joint of the scene and which of the six axes it is.
    axes: Vec<Option<(usize, usize)>>,
    controls: Vec<f64>,
    coordinates: Vec<f64>,
}

/// A shape that can touch: whose it is, and where.
struct Touching<'a> {
    shape: &'a RobotShape,
    owner: Owner,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Owner {
    /// In `bodies`.
    Body(usize),
    /// An index of the fixed pieces.
    Fixed(usize),
    Ground,
}

impl Assembled {
    /// Puts `robot` into the model of a scene.
    ///
    /// # Errors
    /// What cannot be there, with the line of the file that it is about.
    pub fn new(robot: Robot, placing: &Placing, model: &mut Model) -> Result<Self, String> {
        if !(3..=200).contains(&placing.sides) {
            return Err(format!("sides is {}; allowed is 3 to 200", placing.sides));
        }
        let (coordinates, rates, controls) = starts(&robot, placing)?;
        let (bodies, links) = carried(&robot, placing.merges);
        let first = model.bodies.len();
        let bodies = bodies
            .into_iter()
            .enumerate()
            .map(|(index, link)| (link, first + index, Vector3::zeros()));
        let mut own = Self {
            prefix: placing.prefix.clone(),
            frame: placing.frame,
            bodies: bodies.collect(),
            links,
            axes: vec![None; robot.joints.len()],
            controls,
            coordinates,
            robot,
        };
        let motion = own.robot.motion(&own.coordinates, &rates)?;
        own.add_bodies(placing, &motion, model)?;
        let touching = own.add_shapes(placing, model)?;
        own.keep_apart(placing, &touching, model)?;
        own.add_joints(model)?;
        own.add_ties(model)?;
        own.join_pairs(placing, model);
        Ok(own)
    }

    fn named(&self, name: &str) -> String {
        format!("{}{name}", self.prefix)
    }

    fn add_bodies(
        &mut self,
        placing: &Placing,
        motion: &Motion,
        model: &mut Model,
    ) -> Result<(), String> {
        for place in 0..self.bodies.len() {
            let (link, ..) = self.bodies[place];
            let at = &self.robot.links[link].at;
            let wrong = |why: String| format!("{at}: {why}");
            let mass = self.mass_of(place);
            if mass.mass <= 0.0 {
                return Err(wrong("it moves and has no mass; give it <inertial>".to_owned()));
            }
            self.bodies[place].2 = mass.centre;
            let name = self.named(&self.robot.links[link].name);
            checked_name(&name).map_err(wrong)?;
            let (shape, touches) = self.shape_of(place, &mass, placing)?;
            let index = model.shapes.iter().position(|known| *known == shape);
            let index = index.unwrap_or_else(|| {
                model.shapes.push(shape);
                model.shapes.len() - 1
            });
            let own = self.touching_shapes(place).collect::<Vec<_>>();
            let friction = own.first().and_then(|shape| friction_of(shape));
            let friction =
                friction.filter(|one| own.iter().all(|shape| friction_of(shape) == Some(*one)));
            let body = BodyModel {
                name,
                shape: index,
                centre: mass.centre.into(),
                mass: mass.mass,
                inertia: mass.inertia.transpose().into(),
                friction,
                restitution: None,
                touches,
                load: None,
                colour: None,
                label: None,
                start: BodyStart::of(&self.state_of(place, motion.links())),
            };
            let made = body.rigid_body(&model.shapes[index]);
            made.map_err(|error| format!("{}: {error}", self.robot.links[link].at))?;
            model.bodies.push(body);
        }
        Ok(())
    }

    /// Mass, centre and inertia of a body, in the frame of its first link.
    fn mass_of(&self, place: usize) -> Mass {
        let parts = self.robot.links.iter().zip(&self.links);
        let parts = parts.filter(|(link, (body, _))| *body == Some(place) && link.mass.mass > 0.0);
        let parts: Vec<_> = parts.map(|(link, (_, frame))| link.mass.placed(frame)).collect();
        Mass::sum(&parts)
    }

    /// The state of a body whose links move so.
    fn state_of(&self, place: usize, links: &[LinkMotion]) -> State {
        let (link, _, centre) = self.bodies[place];
        let LinkMotion { frame, spin, velocity } = links[link];
        let arm = frame.rotation() * centre;
        let placed = self.frame.then(&frame);
        let turn = self.frame.rotation();
        State {
            position: placed.point(&centre),
            attitude: placed.attitude,
            velocity: turn * (velocity + spin.cross(&arm)),
            spin: frame.rotation().tr_mul(&spin),
        }
    }

    fn shapes_of(&self, place: usize) -> impl Iterator<Item = &RobotShape> {
        let own = move |shape: &&RobotShape| self.links[shape.link].0 == Some(place);
        self.robot.shapes.iter().filter(own)
    }

    fn touching_shapes(&self, place: usize) -> impl Iterator<Item = &RobotShape> {
        self.shapes_of(place).filter(|shape| shape.groups != [0, 0])
    }

    /// What a body looks like, and whether it touches anything.
    fn shape_of(
        &self,
        place: usize,
        mass: &Mass,
        placing: &Placing,
    ) -> Result<(Shape, bool), String> {
        let placed = |shape: &RobotShape| {
            let form = form_of(shape, placing.sides)?;
            Ok(form.map(|form| PlacedForm { form, place: place_of(&self.in_body(shape)) }))
        };
        let touching: Result<Vec<Option<PlacedForm>>, String> =
            self.touching_shapes(place).map(placed).collect();
        let touching: Vec<_> = touching?.into_iter().flatten().collect();
        if !touching.is_empty() {
            return Ok((Shape::Pieces(touching), true));
        }
        let seen: Result<Vec<Option<PlacedForm>>, String> =
            self.shapes_of(place).map(placed).collect();
        let seen: Vec<_> = seen?.into_iter().flatten().collect();
        let pieces = if seen.is_empty() { vec![equivalent(mass)] } else { seen };
        Ok((Shape::Pieces(pieces), false))
    }

    /// Where a shape is in the frame of its body's first link.
    fn in_body(&self, shape: &RobotShape) -> Frame {
        self.links[shape.link].1.then(&shape.frame)
    }

    /// Adds what is fixed, and lists all that can touch.
    fn add_shapes(
        &self,
        placing: &Placing,
        model: &mut Model,
    ) -> Result<Vec<Touching<'_>>, String> {
        let mut touching = Vec::new();
        for shape in self.robot.shapes.iter().filter(|shape| shape.groups != [0, 0]) {
            let owner = match self.links[shape.link].0 {
                Some(place) => Owner::Body(place),
                None if shape.form == RobotForm::Plane => {
                    if !placing.has_ground {
                        continue;
                    }
                    if model.plane.is_some() {
                        return Err(format!("{}: one plane is supported; give a box", shape.at));
                    }
                    let frame = self.frame.then(&self.in_body(shape));
                    let normal = frame.rotation().column(2).into_owned();
                    let plane = crate::contact::Plane::new(normal, normal.dot(&frame.position));
                    let plane = plane.map_err(|error| format!("{}: {error}", shape.at))?;
                    model.plane = Some(crate::scenario::physics::plane(&plane));
                    model.mu = friction_of(shape).unwrap_or(model.mu);
                    Owner::Ground
                }
                None => {
                    let Some(form) = form_of(shape, placing.sides)? else { continue };
                    let frame = self.frame.then(&self.in_body(shape));
                    let piece = PlacedForm { form, place: place_of(&frame) };
                    piece.piece().map_err(|error| format!("{}: {error}", shape.at))?;
                    let name = self.named(&shape.name);
                    let taken = model.bodies.iter().any(|body| body.name == name)
                        || model.fixed.iter().any(|fixed| fixed.name == name);
                    let name =
                        if taken { format!("{name}-fixed-{}", model.fixed.len()) } else { name };
                    checked_name(&name).map_err(|why| format!("{}: {why}", shape.at))?;
                    model.fixed.push(FixedModel { name, piece, friction: friction_of(shape) });
                    Owner::Fixed(model.fixed.len() - 1)
                }
            };
            touching.push(Touching { shape, owner });
        }
        Ok(touching)
    }

    /// Says of all pairs of owners which do not touch, and with what friction the others do.
    fn keep_apart(
        &self,
        placing: &Placing,
        touching: &[Touching<'_>],
        model: &mut Model,
    ) -> Result<(), String> {
        let mut owners: Vec<(Owner, Vec<&RobotShape>)> = Vec::new();
        for Touching { shape, owner } in touching {
            match owners.iter_mut().find(|(known, _)| known == owner) {
                Some((_, shapes)) => shapes.push(shape),
                None => owners.push((*owner, vec![shape])),
            }
        }
        for (index, (owner, shapes)) in owners.iter().enumerate() {
            let Owner::Body(place) = *owner else { continue };
            for (other_index, (other, others)) in owners.iter().enumerate() {
                let is_later = other_index > index || !matches!(other, Owner::Body(_));
                if !is_later {
                    continue;
                }
                let friction = self.between(placing, (shapes, others), model.mu)?;
                let body = self.bodies[place].1;
                let (partner, theirs) = match *other {
                    Owner::Ground => (PartnerModel::Ground, model.mu),
                    Owner::Fixed(fixed) => (
                        PartnerModel::Fixed(fixed),
                        model.fixed[fixed].friction.unwrap_or(model.mu),
                    ),
                    Owner::Body(other) => {
                        let other = self.bodies[other].1;
                        (
                            PartnerModel::Body(other),
                            model.bodies[other].friction.unwrap_or(model.mu),
                        )
                    }
                };
                let ours = model.bodies[body].friction.unwrap_or(model.mu);
                match friction {
                    None => model.apart.push(ApartModel { body, partner }),
                    Some(coefficient) if ours == theirs && ours == coefficient => {}
                    Some(coefficient) => {
                        model.frictions.push(PairModel { body, partner, coefficient })
                    }
                }
            }
        }
        Ok(())
    }

    /// With what friction the shapes of two owners touch; `None` where they do not.
    fn between(
        &self,
        placing: &Placing,
        (ours, theirs): (&[&RobotShape], &[&RobotShape]),
        usual: f64,
    ) -> Result<Option<f64>, String> {
        let mut said: Option<(Option<f64>, [&RobotShape; 2])> = None;
        for a in ours {
            for b in theirs {
                let touch = self.touch(placing, a, b).then(|| friction_between(a, b, usual));
                match said {
                    None => said = Some((touch, [a, b])),
                    Some((known, _)) if known == touch => {}
                    Some((_, [c, d])) => {
                        return Err(format!(
                            "{}: {:?} and {:?} touch otherwise than {:?} and {:?} of the same bodies; equal groups \
                             and friction are needed",
                            a.at, a.name, b.name, c.name, d.name
                        ));
                    }
                }
            }
        }
        Ok(said.and_then(|(touch, _)| touch))
    }

    fn touch(&self, placing: &Placing, a: &RobotShape, b: &RobotShape) -> bool {
        let excluded = |pair: &[usize; 2]| *pair == [a.link, b.link] || *pair == [b.link, a.link];
        let both_move = self.links[a.link].0.is_some() && self.links[b.link].0.is_some();
        a.meets(b)
            && !self.robot.apart.iter().any(excluded)
            && (placing.touches_itself || !both_move)
            && !self.are_neighbours(a.link, b.link)
    }

    /// Whether two links are of one body or tied by a joint, so that they do not touch: what hangs on the world does.
    fn are_neighbours(&self, a: usize, b: usize) -> bool {
        let carriers = self.robot.carriers();
        let (a, b) = (carriers[a], carriers[b]);
        let parent = |link: usize| carriers[self.robot.links[link].parent];
        // MJCF lets what hangs on the world touch it, URDF does not.
        let hangs = (a != 0 && b != 0) || !self.robot.options.has_world;
        a == b
            || !self.robot.options.neighbours_touch && hangs && (parent(a) == b || parent(b) == a)
    }

    fn add_joints(&mut self, model: &mut Model) -> Result<(), String> {
        for place in 0..self.bodies.len() {
            let (link, body, centre) = self.bodies[place];
            let (first, count) = self.robot.links[link].joints;
            let Some(Joined { kind, anchor, attitudes, middle, axes }) =
                joined(self.robot.joints_of(link))?
            else {
                continue;
            };
            let anchor = anchor.unwrap_or(centre);
            let (other, frame) = self.links[self.robot.links[link].parent];
            let outer = frame.then(&self.robot.links[link].frame);
            let [attitude, of_above] = attitudes;
            let above = Frame {
                position: outer.point(&anchor),
                attitude: outer.then(&turned(of_above)).attitude,
            };
            let (other, above) = match other {
                Some(other) => {
                    let (_, other, centre) = self.bodies[other];
                    (Some(other), Frame { position: above.position - centre, ..above })
                }
                None => (None, self.frame.then(&above)),
            };
            let joints = first..first + count;
            let drives = axes.iter().map(|axis| drive(&self.robot, first + axis, &self.controls));
            let names: Vec<_> =
                joints.map(|joint| self.robot.joints[joint].name.as_str()).collect();
            let name = match names[..] {
                [one] => self.named(one),
                _ => self.named(&self.robot.links[link].name),
            };
            checked_name(&name).map_err(|why| format!("{}: {why}", self.robot.links[link].at))?;
            if model.joints.iter().any(|known| known.name == name) {
                return Err(format!(
                    "{}: there is a joint {name:?} already",
                    self.robot.links[link].at
                ));
            }
            let index = model.joints.len();
            for ((_, axis), joint) in kind.driven().iter().zip(&axes) {
                self.axes[first + joint] = Some((index, *axis));
            }
            let drives = drives.collect::<Result<_, _>>()?;
            model.joints.push(JointModel {
                name,
                kind,
                body,
                other,
                frames: [
                    Place { position: (anchor - centre).into(), attitude: attitude.into() },
                    place_of(&above),
                ],
                length: None,
                collide: false,
                cone: None,
                middle,
                drives,
            });
        }
        Ok(())
    }

    /// What closes loops: where the links are at the reference.
    fn add_ties(&self, model: &mut Model) -> Result<(), String> {
        if self.robot.ties.is_empty() {
            return Ok(());
        }
        let rates = vec![0.0; self.robot.counts().1];
        let motion = self.robot.motion(&self.robot.reference(), &rates)?;
        for (number, tie) in self.robot.ties.iter().enumerate() {
            let (kind, links, at) = match tie {
                Tie::Point { links, at, .. } => (JointKind::Spherical, links, at),
                Tie::Whole { links, at, .. } => (JointKind::Fixed, links, at),
            };
            let [first, second] = links.map(|link| motion.links()[link].frame);
            // The frame of the tie in the first link, and in the second.
            let (ours, theirs) = match tie {
                Tie::Point { anchor, .. } => {
                    let frame = Frame { position: *anchor, ..second.seen_from(&first) };
                    (
                        frame,
                        Frame {
                            position: first.then(&frame).seen_from(&second).position,
                            ..Frame::identity()
                        },
                    )
                }
                Tie::Whole { frame, .. } => {
                    (frame.unwrap_or(second.seen_from(&first)), Frame::identity())
                }
            };
            let sides = [(links[0], ours), (links[1], theirs)].map(|(link, frame)| {
                let (body, offset) = self.links[link];
                (body, offset.then(&frame))
            });
            let (mut a, mut b) = (sides[0], sides[1]);
            if a.0.is_none() {
                std::mem::swap(&mut a, &mut b);
            }
            let (Some(own), other) = (a.0, b.0) else {
                return Err(format!("{at}: neither of its bodies moves"));
            };
            if Some(own) == other {
                return Err(format!("{at}: its bodies are one"));
            }
            let from_centre = |place: usize, frame: Frame| {
                let (_, body, centre) = self.bodies[place];
                (body, Frame { position: frame.position - centre, ..frame })
            };
            let (body, ours) = from_centre(own, a.1);
            let (other, theirs) = match other {
                Some(other) => {
                    let (body, frame) = from_centre(other, b.1);
                    (Some(body), frame)
                }
                None => (None, self.frame.then(&b.1)),
            };
            model.joints.push(JointModel {
                name: self.named(&format!("tie-{number}")),
                kind,
                body,
                other,
                frames: [place_of(&ours), place_of(&theirs)],
                length: None,
                collide: true,
                cone: None,
                middle: None,
                drives: Vec::new(),
            });
        }
        Ok(())
    }

    /// Joints leave it to the pairs which of their bodies touch.
    fn join_pairs(&self, placing: &Placing, model: &mut Model) {
        let touching = placing.touches_itself && self.robot.options.neighbours_touch;
        let own = |body: usize| self.bodies.iter().any(|(_, known, _)| *known == body);
        for joint in model.joints.iter_mut().filter(|joint| own(joint.body)) {
            joint.collide |= touching;
        }
        // What a joint keeps apart need not be said.
        let tied = |pair: &ApartModel| {
            let PartnerModel::Body(other) = pair.partner else { return false };
            model.joints.iter().any(|joint| {
                let ends = [Some(joint.body), joint.other];
                !joint.collide && ends.contains(&Some(pair.body)) && ends.contains(&Some(other))
            })
        };
        let kept: Vec<_> = model.apart.iter().filter(|pair| !tied(pair)).cloned().collect();
        model.apart = kept;
    }

    /// The robot as its file has it.
    #[must_use]
    pub fn robot(&self) -> &Robot {
        &self.robot
    }

    /// What stands before its names in the scene.
    #[must_use]
    pub fn prefix(&self) -> &str {
        &self.prefix
    }

    /// The world of the file in that of the scene.
    #[must_use]
    pub fn frame(&self) -> &Frame {
        &self.frame
    }

    /// The joint of the scene that a slide or a hinge is, and which of its six axes: x, y, z of the place and of the
    /// turn.
    #[must_use]
    pub fn axis(&self, joint: usize) -> Option<(usize, usize)> {
        self.axes.get(joint).copied().flatten()
    }

    /// The body of the scene that a link moves with; none of what is fixed.
    #[must_use]
    pub fn body(&self, link: usize) -> Option<usize> {
        let place = self.links.get(link)?.0?;
        Some(self.bodies[place].1)
    }

    /// The coordinates at the start.
    #[must_use]
    pub fn start(&self) -> &[f64] {
        &self.coordinates
    }

    /// The controls at the start.
    #[must_use]
    pub fn controls(&self) -> &[f64] {
        &self.controls
    }

    /// What acts on a slide or a hinge under these controls, in coordinates of the scene's joint.
    ///
    /// # Errors
    /// None of a robot that was put into a scene; as [`Assembled::new`].
    pub fn drive(&self, joint: usize, controls: &[f64]) -> Result<crate::joint::Drive, String> {
        drive(&self.robot, joint, controls)
    }

    /// Sets in `states` those of its bodies at these coordinates and rates.
    ///
    /// # Errors
    /// Other numbers of them; as [`Robot::motion`].
    pub fn set_states(&self, q: &[f64], v: &[f64], states: &mut [State]) -> Result<(), String> {
        let motion = self.robot.motion(q, v)?;
        for place in 0..self.bodies.len() {
            let missing = || "states: the robot has bodies that have none".to_owned();
            let index = self.bodies[place].1;
            *states.get_mut(index).ok_or_else(missing)? = self.state_of(place, motion.links());
        }
        Ok(())
    }

    /// Coordinates and rates where its bodies are at `states`, angles nearest to those of `near`.
    ///
    /// # Errors
    /// States that are too few; another number of coordinates.
    pub fn coordinates(
        &self,
        states: &[State],
        near: &[f64],
    ) -> Result<(Vec<f64>, Vec<f64>), String> {
        let moving = self.links_at(states)?;
        let frames: Vec<_> = moving.iter().map(|link| link.frame).collect();
        let q = self.robot.coordinates(&frames, near)?;
        let motion = self.robot.motion(&q, &vec![0.0; self.robot.counts().1])?;
        let rates = motion.rates(&self.robot, &moving);
        Ok((q, rates))
    }

    /// All links where its bodies are at `states`, in the world of the file.
    ///
    /// # Errors
    /// States that are too few.
    pub fn links_at(&self, states: &[State]) -> Result<Vec<LinkMotion>, String> {
        let still =
            |frame: Frame| LinkMotion { frame, spin: Vector3::zeros(), velocity: Vector3::zeros() };
        let link = |(place, offset): &(Option<usize>, Frame)| {
            let Some(place) = place else { return Ok(still(*offset)) };
            let (_, index, centre) = self.bodies[*place];
            let missing = || "states: the robot has bodies that have none".to_owned();
            let state = states.get(index).ok_or_else(missing)?;
            let placed = Frame { position: state.position, attitude: state.attitude };
            let placed =
                Frame { position: placed.point(&-centre), ..placed }.seen_from(&self.frame);
            let back = self.frame.rotation();
            let spin = placed.rotation() * state.spin;
            let frame = placed.then(offset);
            let centre = placed.point(&centre);
            let velocity = back.tr_mul(&state.velocity) + spin.cross(&(frame.position - centre));
            Ok(LinkMotion { frame, spin, velocity })
        };
        self.links.iter().map(link).collect()
    }
}

/// Which links begin bodies; and of each link its body and where it is in that body's first link.
fn carried(robot: &Robot, merges: bool) -> (Vec<usize>, Vec<(Option<usize>, Frame)>) {
    let mut bodies = Vec::new();
    let mut links: Vec<(Option<usize>, Frame)> = Vec::with_capacity(robot.links.len());
    for (index, link) in robot.links.iter().enumerate() {
        if index == 0 {
            links.push((None, Frame::identity()));
            continue;
        }
        let (above, frame) = links[link.parent];
        // What is fixed to a body may be one of its own; what is fixed to the world is not.
        let is_own = link.joints.1 > 0 || !merges && above.is_some() && link.mass.mass > 0.0;
        if is_own {
            links.push((Some(bodies.len()), Frame::identity()));
            bodies.push(index);
        } else {
            links.push((above, frame.then(&link.frame)));
        }
    }
    (bodies, links)
}

/// Coordinates, rates and controls at the start: those of the pose, then those that are given, within their ranges.
fn starts(robot: &Robot, placing: &Placing) -> Result<(Vec<f64>, Vec<f64>, Vec<f64>), String> {
    let mut q = robot.reference();
    let mut v = vec![0.0; robot.counts().1];
    let mut controls = vec![0.0; robot.actuators.len()];
    if let Some(name) = &placing.key {
        let key = robot.keys.iter().find(|key| key.name == *name);
        let key = key.ok_or_else(|| format!("pose: there is no pose {name:?} in the file"))?;
        for (all, said) in
            [(&mut q, &key.positions), (&mut v, &key.rates), (&mut controls, &key.controls)]
        {
            if let Some(said) = said {
                all.clone_from(said);
            }
        }
    }
    let places = robot.places();
    for (name, coordinate) in &placing.coordinates {
        let joint = robot.joint(name);
        let joint =
            joint.ok_or_else(|| format!("coordinates: there is no joint {name:?} in the file"))?;
        if !matches!(robot.joints[joint].moves, Moves::Hinge | Moves::Slide) {
            return Err(format!("coordinates: {name:?} is no slide and no hinge"));
        }
        if !coordinate.is_finite() {
            return Err(format!("coordinates: {name} is {coordinate:?}"));
        }
        q[places[joint].0] = *coordinate;
    }
    for (joint, (place, _)) in robot.joints.iter().zip(&places) {
        if let Some([low, high]) = joint.range {
            q[*place] = q[*place].clamp(low, high);
        }
    }
    Ok((q, v, controls))
}

fn turned(attitude: nalgebra::Vector4<f64>) -> Frame {
    Frame { attitude, ..Frame::identity() }
}

fn place_of(frame: &Frame) -> Place {
    Place { position: frame.position.into(), attitude: frame.attitude.into() }
}

/// The coefficient of a shape by itself.
fn friction_of(shape: &RobotShape) -> Option<f64> {
    if shape.rubs { shape.friction } else { Some(0.0) }
}

/// The coefficient between two shapes of a file: that of the one that counts more, or else the larger one.
fn friction_between(a: &RobotShape, b: &RobotShape, usual: f64) -> f64 {
    if !(a.rubs || b.rubs) {
        return 0.0;
    }
    let [ours, theirs] = [a, b].map(|shape| shape.friction.unwrap_or(usual));
    match a.priority.cmp(&b.priority) {
        std::cmp::Ordering::Greater => ours,
        std::cmp::Ordering::Less => theirs,
        std::cmp::Ordering::Equal => ours.max(theirs),
    }
}

/// The form of a shape in a scene; none of one that touches nothing and has no such form.
fn form_of(shape: &RobotShape, sides: usize) -> Result<Option<Form>, String> {
    Ok(Some(match &shape.form {
        RobotForm::Sphere(radius) => Form::Sphere { radius: *radius },
        RobotForm::Capsule(half, radius) => Form::Capsule { length: 2.0 * half, radius: *radius },
        RobotForm::Box(half) => Form::Box { sides: (half * 2.0).into() },
        RobotForm::Cylinder(half, radius) => {
            let corner = |side: usize, end: f64| {
                let (sine, cosine) = (TAU * side as f64 / sides as f64).sin_cos();
                [radius * cosine, radius * sine, end]
            };
            let points = (0..sides).flat_map(|side| [corner(side, -half), corner(side, *half)]);
            Form::Hull { points: points.collect(), radius: 0.0 }
        }
        RobotForm::Hull(points) => Form::Hull { points: points.clone(), radius: 0.0 },
        RobotForm::Ellipsoid(_) | RobotForm::Plane if shape.groups == [0, 0] => return Ok(None),
        RobotForm::Ellipsoid(_) => {
            return Err(format!(
                "{}: ellipsoids that touch are not supported; give a capsule or a mesh",
                shape.at
            ));
        }
        RobotForm::Plane => return Err(format!("{}: a plane belongs to the world", shape.at)),
    }))
}

/// A box of the mass's inertia, or a ball where no box has it: for the eye.
fn equivalent(mass: &Mass) -> PlacedForm {
    let eigen = mass.inertia.symmetric_eigen();
    let moments = eigen.eigenvalues;
    let squares = Vector3::repeat(0.5 * moments.sum()) - moments;
    let sides = squares.map(|square| (12.0 * square / mass.mass).max(0.0).sqrt());
    let mut axes = eigen.eigenvectors;
    if axes.determinant() < 0.0 {
        axes.column_mut(2).neg_mut();
    }
    let attitude = super::frame::of_matrix(&axes);
    let frame = Frame { position: mass.centre, attitude };
    let form = match sides.min() > 1e-2 * sides.max() {
        true => Form::Box { sides: sides.into() },
        false => Form::Sphere { radius: (2.5 * moments.max() / mass.mass).sqrt().max(1e-3) },
    };
    PlacedForm { form, place: place_of(&frame) }
}
