//! A robot in a scene: bodies, joints, fixed pieces and contact rules.

mod bodies;
pub mod entry;
mod forms;
mod joints;
pub mod starts;
mod states;
pub mod table;
mod touch;
mod touching;

use crate::bodies::place::Place;
use crate::document::Document;
use nalgebra::{Vector3, Vector4};
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use tumble_core::geometry::smooth::USUAL_SIDES;
use tumble_core::joint::Drive;
use tumble_core::mechanics::State;
use tumble_model::nearest;
use tumble_model::shown;
use tumble_robot::LinkFrame;
use tumble_robot::joining::{drive, sum_drive};
use tumble_robot::model::{Key, MimicJoint, Moves, Robot, RobotJoint, RobotShape};

/// Options for placing a robot in a scene.
#[derive(Debug, Clone)]
pub struct Placing {
    /// Pose of the file's world in the world of the scene.
    pub frame: LinkFrame,
    /// Prefix of the names of its links and joints.
    pub prefix: String,
    /// Initial keyframe of the file.
    pub key: Option<String>,
    /// Initial coordinates of slides and hinges by name. They override those of the keyframe.
    pub coordinates: Vec<(String, f64)>,
    /// True if links of the robot collide with each other.
    pub touches_itself: bool,
    /// True to merge each link without joints with the link it is fixed to.
    pub merges: bool,
    /// Number of sides of the cores of cylinders and ellipsoids.
    pub sides: usize,
    /// True if a plane of the file becomes the ground of the scene.
    pub has_ground: bool,
}

impl Default for Placing {
    fn default() -> Self {
        Self {
            frame: LinkFrame::identity(),
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

/// Maximum length of a name in a scene.
const LONGEST_NAME: usize = 40;

/// A robot in a scene, with its bodies and joints.
#[derive(Debug, Clone)]
pub struct Assembled {
    robot: Robot,
    prefix: String,
    /// Shortened names in the scene, by the names of the file.
    long_names: BTreeMap<String, String>,
    bodies: Vec<Carried>,
    /// Index in `bodies` of each link (`None` if fixed to the world), and its pose in that body's
    /// first link.
    links: Vec<(Option<usize>, LinkFrame)>,
    /// Carrier of each link: the nearest link with a joint, from the link itself up to the world.
    carriers: Vec<usize>,
    /// Joint of the scene for each joint of the file, and index of its axis from 0 to 5.
    axes: Vec<Option<(usize, usize)>>,
    /// Gears of the scene that represent its `sums`.
    sums: Range<usize>,
    /// Fixed pieces of the scene that come from its file, and the link of each.
    fixed: Range<usize>,
    fixed_links: Vec<usize>,
    /// Joints of the scene that represent its constraints.
    ties: Range<usize>,
    /// True if the scene contains nothing else.
    is_alone: bool,
    controls: Vec<f64>,
    coordinates: Vec<f64>,
}

/// Group of rigidly connected links. It has one body of the scene for each set of shapes with the
/// same contact rules. The further bodies are fixed to the first, and all share the mass equally.
#[derive(Debug, Clone)]
struct Carried {
    /// First link of the group, which defines the frame.
    link: usize,
    /// Index of the first body.
    body: usize,
    /// Centre of mass (m), in the frame of `link`.
    centre: Vector3<f64>,
    /// Collision shapes of each body. A group without collisions has one empty list.
    parts: Vec<Vec<usize>>,
}

impl Carried {
    /// True if the body of the scene belongs to this group.
    fn has(&self, body: usize) -> bool {
        (self.body..self.body + self.parts.len()).contains(&body)
    }
}

impl Assembled {
    /// Adds `robot` to a document in exact form.
    ///
    /// # Errors
    /// Unsupported content, with its line in the file.
    pub fn new(
        mut robot: Robot,
        placing: &Placing,
        document: &mut Document,
    ) -> Result<Self, String> {
        if !(3..=200).contains(&placing.sides) {
            return Err(format!("sides is {}; allowed: 3 to 200", placing.sides));
        }
        if !placing.prefix.is_empty() {
            shown::checked_name(&placing.prefix).map_err(|why| format!("prefix: {why}"))?;
        }
        robot.links[0].frame = placing.frame;
        let RobotStart { coordinates, rates, controls } = starts(&robot, placing)?;
        let (bodies, links) = bodies::carried(&robot, placing.merges);
        let mut own = Self {
            prefix: placing.prefix.clone(),
            bodies,
            links,
            carriers: robot.carriers(),
            axes: vec![None; robot.joints.len()],
            sums: 0..0,
            fixed: document.fixed_count()..document.fixed_count(),
            fixed_links: Vec::new(),
            ties: 0..0,
            is_alone: placing.has_ground,
            long_names: long_names(&robot, &placing.prefix),
            controls,
            coordinates,
            robot,
        };
        own.number_bodies(placing, document)?;
        let motion = own.robot.motion(&own.coordinates, &rates)?;
        own.add_bodies(placing, &motion, document)?;
        let touching = own.add_shapes(placing, document)?;
        own.keep_apart(placing, &touching, document);
        drop(touching);
        own.fixed.end = document.fixed_count();
        own.add_joints(document)?;
        own.add_gears(document)?;
        let first_tie = document.joints.len();
        own.add_ties(document)?;
        own.ties = first_tie..document.joints.len();
        own.join_pairs(placing, document);
        own.add_parts(document);
        own.note_names(document);
        Ok(own)
    }

    /// Name in the scene: prefix and name with invalid characters replaced by `_`. A long name is
    /// shortened in the middle.
    fn named(&self, name: &str) -> String {
        let own = self.long_names.get(name).cloned();
        own.unwrap_or_else(|| fitting(&self.prefix, name, ".."))
    }

    /// Adds a note about names that differ in the scene.
    fn note_names(&mut self, document: &Document) {
        let links = self.robot.links.iter().skip(1).map(|link| &link.name);
        let names = links.chain(self.robot.joints.iter().map(|joint| &joint.name));
        let shapes = self.robot.shapes.iter().filter_map(|shape| shape.name.as_ref());
        let shapes = shapes.filter(|name| {
            let name = self.named(name);
            document.fixed_names().skip(self.fixed.start).any(|fixed| fixed == name)
        });
        let other = |name: &&String| self.named(name) != format!("{}{name}", self.prefix);
        let others: Vec<_> = names.chain(shapes).filter(other).collect();
        if let Some(first) = others.first() {
            let sentence = format!(
                "{} names that a scene does not allow are changed, for example {:?} to {:?}",
                others.len(),
                shown::line(first),
                self.named(first)
            );
            self.robot.notes.push(sentence);
        }
    }

    /// Name of the body `number` of a link.
    fn part_name(&self, link: usize, number: usize) -> String {
        let name = &self.robot.links[link].name;
        if number == 0 { self.named(name) } else { self.named(&format!("{name}.{}", number + 1)) }
    }

    /// Pose of the file's world in the world of the scene.
    fn world(&self) -> &LinkFrame {
        &self.robot.links[0].frame
    }

    /// Pose of a shape in the frame of its body's first link.
    fn in_body(&self, shape: &RobotShape) -> LinkFrame {
        self.links[shape.link].1.then(&shape.frame)
    }

    /// The robot as described by its file.
    pub fn robot(&self) -> &Robot {
        &self.robot
    }

    /// Prefix of its names in the scene.
    pub fn prefix(&self) -> &str {
        &self.prefix
    }

    /// Joint of the scene for a slide or hinge, and index of its axis. Axes 0 to 2 are translations
    /// along x, y and z. Axes 3 to 5 are rotations about them.
    pub fn axis(&self, joint: usize) -> Option<(usize, usize)> {
        self.axes.get(joint).copied().flatten()
    }

    /// Force limit that the file gives an [axis](Self::axis) of a joint of the scene, the smaller one of both
    /// directions (N or N m).
    pub fn effort(&self, axis: (usize, usize)) -> Option<f64> {
        let joint = self.axes.iter().position(|of| *of == Some(axis))?;
        self.robot.joints[joint].effort.map(|[low, high]| high.min(-low))
    }

    /// Body of the scene that a link belongs to; `None` for fixed links. If the shapes of the link
    /// need several bodies, it is the first.
    pub fn body(&self, link: usize) -> Option<usize> {
        let place = self.links.get(link)?.0?;
        Some(self.bodies[place].body)
    }

    /// True if the link belongs to this body of the scene.
    pub fn moves_with(&self, link: usize, body: usize) -> bool {
        let place = self.links.get(link).and_then(|(place, _)| *place);
        place.is_some_and(|place| self.bodies[place].has(body))
    }

    /// Fixed pieces of the scene that belong to a link held by the world or to links fixed to it.
    pub fn pieces(&self, link: usize) -> Vec<usize> {
        let belongs = |own: usize| self.upwards(own).any(|at| at == link);
        let pieces = self.fixed.clone().zip(&self.fixed_links);
        pieces.filter(|(_, own)| belongs(**own)).map(|(piece, _)| piece).collect()
    }

    /// A link and the links above it, up to the world.
    fn upwards(&self, link: usize) -> impl Iterator<Item = usize> {
        let parent = |link: &usize| Some(self.robot.links[*link].parent).filter(|_| *link > 0);
        std::iter::successors(Some(link), parent)
    }

    /// Name of a link in the scene.
    pub fn link_name(&self, link: usize) -> Option<String> {
        self.robot.links.get(link).map(|link| self.named(&link.name))
    }

    /// True if the body of the scene belongs to the robot.
    pub(crate) fn has_body(&self, body: usize) -> bool {
        self.bodies.iter().any(|carried| carried.has(body))
    }

    /// True if the fixed piece of the scene comes from the robot's file.
    pub(crate) fn has_fixed(&self, piece: usize) -> bool {
        self.fixed.contains(&piece)
    }

    /// True if the body belongs to the robot and is attached to the world by joints.
    pub(crate) fn hangs(&self, body: usize) -> bool {
        let Some(own) = self.bodies.iter().find(|one| one.has(body)) else { return false };
        let is_free = |joint: &RobotJoint| joint.moves == Moves::Free;
        !self.upwards(own.link).any(|link| self.robot.joints_of(link).iter().any(is_free))
    }

    /// True if the robot's file is the whole scene.
    pub(crate) fn is_alone(&self) -> bool {
        self.is_alone
    }

    /// Joints of the scene that represent its constraints.
    pub(crate) fn ties(&self) -> Range<usize> {
        self.ties.clone()
    }

    /// Kinematic trees: the free joint of each floating tree with the bodies it carries. All bodies
    /// attached to the world form one entry without a joint.
    pub(crate) fn trees(&self) -> Vec<(Option<usize>, Vec<usize>)> {
        let mut trees: Vec<(Option<usize>, Vec<usize>)> = Vec::new();
        for Carried { link, body, parts, .. } in &self.bodies {
            let free = |link: usize| {
                let (first, count) = self.robot.links[link].joints;
                (first..first + count).find(|joint| self.robot.joints[*joint].moves == Moves::Free)
            };
            let flying = self.upwards(*link).find_map(free);
            let own = *body..body + parts.len();
            match trees.iter_mut().find(|(known, _)| *known == flying) {
                Some((_, bodies)) => bodies.extend(own),
                None => trees.push((flying, own.collect())),
            }
        }
        trees
    }

    /// Translates the `states` of the bodies of a free joint at the start by `by` (m). Returns the name of its
    /// link.
    pub(crate) fn lift(
        &mut self,
        joint: usize,
        bodies: &[usize],
        by: Vector3<f64>,
        states: &mut [State],
    ) -> String {
        let place = self.robot.places()[joint].0;
        for k in 0..3 {
            self.coordinates[place + k] += by[k];
            for body in bodies {
                states[*body].position[k] += by[k];
            }
        }
        self.named(&self.robot.links[self.robot.joints[joint].link].name)
    }

    /// Sets the initial coordinates from the body states.
    ///
    /// # Errors
    /// Too few states.
    pub(crate) fn start_at(&mut self, states: &[State]) -> Result<(), String> {
        self.coordinates = self.coordinates(states, &self.coordinates)?.0;
        Ok(())
    }

    /// Adds a note.
    pub(crate) fn note(&mut self, sentence: String) {
        self.robot.notes.push(sentence);
    }

    /// One more than the largest index of its bodies in the scene.
    pub fn bodies_end(&self) -> usize {
        self.bodies.iter().map(|carried| carried.body + carried.parts.len()).max().unwrap_or(0)
    }

    /// Initial coordinates.
    pub fn start(&self) -> &[f64] {
        &self.coordinates
    }

    /// Initial controls.
    pub fn controls(&self) -> &[f64] {
        &self.controls
    }

    /// Drive on a slide or hinge under these controls, in coordinates of the scene's joint.
    ///
    /// # Errors
    /// The errors of [`Assembled::new`], none of which occur for a robot in a scene.
    pub fn drive(&self, joint: usize, controls: &[f64]) -> Result<Drive, String> {
        drive(&self.robot, joint, controls)
    }

    /// Gears of the scene for combinations of coordinates, each with its drive under these
    /// controls.
    ///
    /// # Errors
    /// The errors of [`Assembled::drive`].
    pub fn sum_drives(&self, controls: &[f64]) -> Result<Vec<(usize, Drive)>, String> {
        let sums = self.sums.clone().enumerate();
        sums.map(|(sum, gear)| Ok((gear, sum_drive(&self.robot, sum, controls)?))).collect()
    }
}

/// Initial coordinates, rates and controls of a robot.
struct RobotStart {
    coordinates: Vec<f64>,
    rates: Vec<f64>,
    controls: Vec<f64>,
}

/// Initial values: those of the keyframe, clamped to the joint limits, then the requested
/// coordinates. These must be within the limits.
fn starts(robot: &Robot, placing: &Placing) -> Result<RobotStart, String> {
    let mut q = robot.reference();
    let mut v = vec![0.0; robot.counts().1];
    let mut controls = vec![0.0; robot.actuators.len()];
    let find = |name: &String| {
        let key = robot.keys.iter().find(|key| key.name == *name);
        key.ok_or_else(|| format!("pose: there is no pose {name:?} in the file"))
    };
    let key = placing.key.as_ref().map(find).transpose()?;
    if let Some(key) = key {
        for (all, said) in
            [(&mut q, &key.positions), (&mut v, &key.rates), (&mut controls, &key.controls)]
        {
            if let Some(said) = said {
                all.clone_from(said);
            }
        }
    }
    let places = robot.places();
    // Keyframes are relative to the world of the file.
    let is_said = |said: fn(&Key) -> bool| key.is_some_and(said);
    let free = robot.joints.iter().zip(&places).filter(|(joint, _)| joint.moves == Moves::Free);
    for (_, &(at, rate)) in free {
        if is_said(|key| key.positions.is_some()) {
            let position = Vector3::from_column_slice(&q[at..at + 3]);
            let attitude = Vector4::from_column_slice(&q[at + 3..at + 7]);
            let placed = placing.frame.then(&LinkFrame { position, attitude });
            q[at..at + 3].copy_from_slice(placed.position.as_slice());
            q[at + 3..at + 7].copy_from_slice(placed.attitude.as_slice());
        }
        if is_said(|key| key.rates.is_some()) {
            let turned = placing.frame.rotation() * Vector3::from_column_slice(&v[rate..rate + 3]);
            v[rate..rate + 3].copy_from_slice(turned.as_slice());
        }
    }
    for (name, coordinate) in &placing.coordinates {
        let joint = robot.joint(name);
        let joint = joint.ok_or_else(|| {
            let hint = nearest::hint(name, robot.joints.iter().map(|joint| &*joint.name));
            format!("coordinates: there is no joint {name:?} in the file{hint}")
        })?;
        if !matches!(robot.joints[joint].moves, Moves::Hinge | Moves::Slide) {
            return Err(format!("coordinates: {name:?} is not a slide or hinge"));
        }
        if !coordinate.is_finite() {
            return Err(format!(
                "coordinates: {name} is {coordinate:?}; a finite number is needed"
            ));
        }
        refuse_outside(&robot.joints[joint], *coordinate)
            .map_err(|why| format!("coordinates: {why}; give a coordinate within it"))?;
        q[places[joint].0] = *coordinate;
    }
    for (joint, (place, _)) in robot.joints.iter().zip(&places) {
        if let Some([low, high]) = joint.range {
            q[*place] = q[*place].clamp(low, high);
        }
    }
    robot.follow(&mut q, &mut v);
    refuse_beyond(robot, &places, &q)?;
    Ok(RobotStart { coordinates: q, rates: v, controls })
}

/// Rejects dependent joints that start outside their limits.
fn refuse_beyond(robot: &Robot, places: &[(usize, usize)], q: &[f64]) -> Result<(), String> {
    for MimicJoint { joints: [own, _], at, .. } in &robot.follows {
        let (joint, coordinate) = (&robot.joints[*own], q[places[*own].0]);
        refuse_outside(joint, coordinate)
            .map_err(|why| format!("{at}: {why}; set the coordinate of the joint it follows"))?;
    }
    Ok(())
}

/// Rejects a coordinate outside the range of its joint.
fn refuse_outside(joint: &RobotJoint, coordinate: f64) -> Result<(), String> {
    let Some([low, high]) = joint.range else { return Ok(()) };
    if (low - AT_LIMIT..=high + AT_LIMIT).contains(&coordinate) {
        return Ok(());
    }
    let name = &joint.name;
    Err(format!("{name:?} would start at {coordinate:?}, outside its range {low:?} to {high:?}"))
}

/// Tolerance of initial coordinates at their limits (m or rad).
const AT_LIMIT: f64 = 1e-9;

/// Valid scene name: invalid characters become `_`, and `middle` replaces the middle of a long
/// name.
fn fitting(prefix: &str, name: &str, middle: &str) -> String {
    let fits = |c: char| c.is_ascii_alphanumeric() || "_-.".contains(c);
    let fitting = |c: char| if fits(c) { c } else { '_' };
    let name: String = prefix.chars().chain(name.chars()).map(fitting).collect();
    match name.len() {
        0 => "_".to_owned(),
        1..=LONGEST_NAME if name == "ground" => "ground_".to_owned(),
        1..=LONGEST_NAME => name,
        length => {
            let kept = LONGEST_NAME - middle.len();
            format!("{}{middle}{}", &name[..kept / 2], &name[length - kept.div_ceil(2)..])
        }
    }
}

/// Shortened scene names of links, joints and shapes. A number in the middle keeps them distinct.
fn long_names(robot: &Robot, prefix: &str) -> BTreeMap<String, String> {
    let links = robot.links.iter().map(|link| &link.name);
    let names = links.chain(robot.joints.iter().map(|joint| &joint.name));
    let names = names.chain(robot.shapes.iter().filter_map(|shape| shape.name.as_ref()));
    let mut known = BTreeMap::new();
    let mut taken = BTreeSet::new();
    for name in names.filter(|name| prefix.chars().count() + name.chars().count() > LONGEST_NAME) {
        if known.contains_key(name) {
            continue;
        }
        let numbered = (2..).map(|number: usize| format!(".{number}."));
        let mut middles = std::iter::once("..".to_owned()).chain(numbered);
        let own = middles.find_map(|middle| {
            let own = fitting(prefix, name, &middle);
            taken.insert(own.clone()).then_some(own)
        });
        known.extend(own.map(|own| (name.clone(), own)));
    }
    known
}

fn place_of(frame: &LinkFrame) -> Place {
    Place { position: frame.position.into(), attitude: frame.attitude.into() }
}
