//! Reader of URDF, the format of ROS.

pub(crate) mod masses;
pub(super) mod names;
mod shapes;
mod tree;

use super::Reading;
use super::frame::LinkFrame;
use super::left_out::pruned;
use super::meshes::share_triangles;
use super::model::{MimicJoint, Moves, Robot, RobotJoint, RobotLink, RobotOptions};
use super::notes::RobotNotes;
use super::xml::{Attributes, Element, Parsed};
use nalgebra::Vector3;
use std::collections::{BTreeSet, HashMap};
use tumble_model::shown;

pub(super) use masses::attitude_from_angles;
use masses::{LEAST_MASS, density, inertial, is_faint, origin};
use tree::{LinkTree, end};

/// Largest magnitude of joint and effort limits, in SI units.
const FARTHEST: f64 = 1e12;

/// Attributes that the SDF reader adds to elements of URDF. Parsed names contain no colon.
pub mod extra {
    /// Quaternion of an `<origin>`, instead of `rpy`.
    pub const ATTITUDE: &str = ":attitude";
    /// Anchor of a `<joint>` in the child link (m).
    pub const ANCHOR: &str = ":anchor";
    /// Friction coefficient of a `<collision>`.
    pub const FRICTION: &str = ":friction";
    /// Two collision masks of a `<collision>`.
    pub const GROUPS: &str = ":groups";
    /// Fraction of a `<link>`'s weight that is compensated.
    pub const WEIGHTLESS: &str = ":weightless";
    /// Armature, spring stiffness and coordinate of the relaxed spring of a joint's `<dynamics>`.
    pub const SPRING: [&str; 3] = [":armature", ":spring_stiffness", ":spring_reference"];
}

/// Reads a robot from the root element of a file.
///
/// # Errors
/// The first fault, with its line.
pub fn read(root: &Element, reading: &Reading<'_>) -> Parsed<Robot> {
    refuse_point_contacts(root, reading)?;
    let mut notes = RobotNotes::default();
    let mut root = pruned(root, reading.left_out)?;
    let again = root.children.iter_mut().map(keep_first).sum::<usize>();
    if again > 0 {
        notes.say(format!(
            "only the first of repeated elements in a link or joint is used: {again} are ignored"
        ));
    }
    names::check(&root, &names::NAMES, &mut notes)?;
    robot_of(&root, RobotOptions::usual(false), notes, reading)
}

/// Refuses an option that only MJCF has.
pub fn refuse_point_contacts(root: &Element, reading: &Reading<'_>) -> Parsed<()> {
    if !reading.points_rub {
        return Ok(());
    }
    Err(root.wrong(
        "point_contacts is only for MJCF, other contacts have only sliding friction; leave it out",
    ))
}

/// Robot of a `<robot>` with known names.
pub fn robot_of(
    root: &Element,
    options: RobotOptions,
    notes: RobotNotes,
    reading: &Reading<'_>,
) -> Parsed<Robot> {
    let tree = LinkTree::from_root(root)?;
    let robot = Robot::new(root.own("name").unwrap_or(""), options);
    let (hulls, placed) = (HashMap::new(), vec![LinkFrame::identity()]);
    let held = BTreeSet::new();
    let materials = root.all("material").collect();
    let mut reader =
        UrdfReader { reading, tree: &tree, materials, notes, robot, hulls, placed, held };
    reader.note_faint(root)?;
    reader.read_root()?;
    for joint in root.all("joint") {
        reader.read_mimic(joint)?;
    }
    reader.fill_masses()?;
    if let Some(sentence) = share_triangles(&mut reader.robot.looks) {
        reader.notes.say(sentence);
    }
    if !reader.held.is_empty() {
        let names: Vec<_> = reader.held.iter().map(|name| shown::line(name)).collect();
        let names = names.join(", ");
        reader.notes.say(format!(
            "joints that move less than {LEAST_MASS:e} kg are fixed where the file places them: {names}"
        ));
    }
    reader.robot.notes = reader.notes.sentences();
    Ok(reader.robot)
}

/// Removes duplicates of elements that may occur once in a link or joint. Returns their number.
fn keep_first(element: &mut Element) -> usize {
    const ONCE: [&str; 8] =
        ["inertial", "origin", "axis", "limit", "dynamics", "mimic", "parent", "child"];
    let before = element.children.len();
    let mut known: Vec<String> = Vec::new();
    element.children.retain(|child| {
        let is_again = known.contains(&child.tag);
        if ONCE.contains(&&*child.tag) {
            known.push(child.tag.clone());
        }
        !is_again
    });
    before - element.children.len()
}

/// Joint that is still to be read, with its subtree.
struct Hanging<'e> {
    joint: &'e Element,
    parent: usize,
    /// Joints above this one whose child links have no mass. They become joints of the first link
    /// with mass below. They are given in the frame of the link that this joint starts from. That
    /// link has the pose `frame` in `parent`.
    before: Vec<RobotJoint>,
    frame: LinkFrame,
}

/// File of a mesh, bits of its scale, and whether it is decomposed.
type MeshKey = (String, [u64; 3], bool);

struct UrdfReader<'a> {
    reading: &'a Reading<'a>,
    tree: &'a LinkTree<'a>,
    /// Named materials.
    materials: Vec<&'a Element>,
    notes: RobotNotes,
    robot: Robot,
    /// Pieces of meshes, each as its vertices.
    hulls: HashMap<MeshKey, Vec<Vec<[f64; 3]>>>,
    /// Poses of the links in the world at the reference.
    placed: Vec<LinkFrame>,
    /// Names of joints that are fixed because they move less than [`LEAST_MASS`].
    held: BTreeSet<String>,
}

impl<'a> UrdfReader<'a> {
    /// Reads the root and all links below, depth first in the order of the file.
    fn read_root(&mut self) -> Parsed<()> {
        let root = self.tree.root;
        let name = root.needed("name")?;
        let mut todo = Vec::new();
        // The root is the world, or a body that is fixed or free.
        let index = match name {
            "world" => {
                self.read_shapes(root, 0)?;
                0
            }
            _ => {
                let weighs = self.weighs(name)?;
                if !weighs && !self.reading.is_fixed {
                    let name = shown::line(name);
                    self.notes.say(format!(
                        "{name}, the root link, has no mass and is fixed to the world"
                    ));
                }
                let free = (weighs && !self.reading.is_fixed)
                    .then(|| RobotJoint::bare("root".to_owned(), 0, Moves::Free, root.at()));
                self.add_link(root, 0, LinkFrame::identity(), free.into_iter().collect())?
            }
        };
        self.push_below(name, index, &mut todo);
        let mut read = 1;
        while let Some(hanging) = todo.pop() {
            let child = end(hanging.joint, "child")?;
            let parent = hanging.parent;
            let (frame, mut joints) = self.read_joint(&hanging)?;
            if !joints.is_empty() && self.is_frame(child)? {
                self.held.extend(joints.drain(..).map(|joint| joint.name));
            }
            // A link without mass hands its joints to the next one.
            if let Some(below) = self.passes_on(child, &joints)? {
                self.notes.idle("link without mass between joints");
                todo.push(Hanging { joint: below, parent, before: joints, frame });
            } else {
                let flies = matches!(joints[..], [RobotJoint { moves: Moves::Free, .. }]);
                // A free joint is relative to the world.
                let (parent, frame) =
                    if flies { (0, self.placed[parent].then(&frame)) } else { (parent, frame) };
                let index = self.add_link(self.tree.links[child], parent, frame, joints)?;
                self.push_below(child, index, &mut todo);
            }
            read += 1;
        }
        if read == self.tree.links.len() {
            Ok(())
        } else {
            Err(root.wrong("not all links are connected to it: the joints of others form a loop"))
        }
    }

    fn push_below(&self, name: &str, parent: usize, todo: &mut Vec<Hanging<'a>>) {
        let below = self.tree.below.get(name).map_or(&[][..], Vec::as_slice);
        let (before, frame) = (Vec::new(), LinkFrame::identity());
        let hanging =
            |joint: &&'a Element| Hanging { joint, parent, before: before.clone(), frame };
        todo.extend(below.iter().rev().map(hanging));
    }

    /// Joint below a link that merely connects two joints. Such a link has no mass and no collision
    /// shapes. All its joints are slides or hinges.
    fn passes_on(&self, name: &'a str, joints: &[RobotJoint]) -> Parsed<Option<&'a Element>> {
        let is_one = |joint: &RobotJoint| matches!(joint.moves, Moves::Hinge | Moves::Slide);
        let Some([below]) = self.tree.below.get(name).map(Vec::as_slice) else { return Ok(None) };
        let touches = self.tree.links[name].all("collision").next().is_some();
        let moves = !matches!(below.own("type"), Some("fixed" | "floating" | "spherical"));
        let passes = moves
            && !touches
            && !joints.is_empty()
            && joints.iter().all(is_one)
            && !self.weighs(name)?;
        Ok(passes.then_some(*below))
    }

    /// True if the link, or one fixed to it, has a mass.
    fn weighs(&self, name: &'a str) -> Parsed<bool> {
        let mut todo = vec![name];
        // Each link is visited once, since it has one parent.
        while let Some(name) = todo.pop() {
            let link = self.tree.links[name];
            if inertial(link)?.mass > 0.0 || density(link)?.is_some() {
                return Ok(true);
            }
            for joint in self.tree.below.get(name).into_iter().flatten() {
                if joint.own("type") == Some("fixed") {
                    todo.push(end(joint, "child")?);
                }
            }
        }
        Ok(false)
    }

    /// Notes links with a mass below [`LEAST_MASS`].
    fn note_faint(&mut self, root: &Element) -> Parsed<()> {
        let mut names = Vec::new();
        for link in root.all("link") {
            if is_faint(link)? {
                names.push(link.needed("name")?);
            }
        }
        if let Some(first) = names.first() {
            self.notes.say(format!(
                "links of less than {LEAST_MASS:e} kg are treated as massless frames: {}, the \
                 first is {:?}",
                names.len(),
                shown::line(first)
            ));
        }
        Ok(())
    }

    /// True if a link below [`LEAST_MASS`] is a frame at the end of its branch. Neither the link
    /// nor its descendants have a mass or collision shapes.
    fn is_frame(&self, name: &'a str) -> Parsed<bool> {
        if !is_faint(self.tree.links[name])? {
            return Ok(false);
        }
        let mut todo = vec![name];
        while let Some(name) = todo.pop() {
            let link = self.tree.links[name];
            let weighs = inertial(link)?.mass > 0.0 || density(link)?.is_some();
            if weighs || link.all("collision").next().is_some() {
                return Ok(false);
            }
            for joint in self.tree.below.get(name).into_iter().flatten() {
                todo.push(end(joint, "child")?);
            }
        }
        Ok(true)
    }

    fn add_link(
        &mut self,
        element: &Element,
        parent: usize,
        frame: LinkFrame,
        joints: Vec<RobotJoint>,
    ) -> Parsed<usize> {
        let index = self.robot.links.len();
        self.robot.links.push(RobotLink {
            name: element.needed("name")?.to_owned(),
            parent,
            frame,
            mass: inertial(element)?,
            weightless: element.number(extra::WEIGHTLESS)?.unwrap_or(0.0),
            is_mocap: false,
            is_between: false,
            joints: (self.robot.joints.len(), joints.len()),
            at: element.at(),
        });
        self.placed.push(self.placed[parent].then(&frame));
        for joint in joints {
            if self.robot.joint(&joint.name).is_some() {
                return Err(format!(
                    "{}: this name is used twice; each joint needs its own",
                    joint.at
                ));
            }
            self.robot.joints.push(RobotJoint { link: index, ..joint });
        }
        self.read_shapes(element, index)?;
        self.read_looks(element, index);
        Ok(index)
    }

    /// Pose of the child link in the parent, and its joints in its own frame. They include the
    /// joints of massless links above.
    fn read_joint(&mut self, hanging: &Hanging<'_>) -> Parsed<(LinkFrame, Vec<RobotJoint>)> {
        let element = hanging.joint;
        let name = element.needed("name")?.to_owned();
        let frame = origin(element)?;
        let kind = element.needed("type")?;
        let axis = element.one("axis")?.map(|axis| axis.exactly::<3>("xyz")).transpose()?.flatten();
        let axis = Vector3::from(axis.unwrap_or([1.0, 0.0, 0.0]));
        let length = axis.norm();
        let moves = !matches!(kind, "fixed" | "floating" | "spherical");
        if moves && length <= 1e-12 {
            return Err(element.wrong("axis: its length is zero"));
        }
        let axis = if length > 0.0 { axis / length } else { axis };
        let anchor = element.exactly::<3>(extra::ANCHOR)?.unwrap_or_default().into();
        let bare = |name: String, moves: Moves| RobotJoint {
            anchor,
            ..RobotJoint::bare(name, 0, moves, element.at())
        };
        let one = |moves: Moves| RobotJoint { axis, ..bare(name.clone(), moves) };
        let joints = match kind {
            "fixed" => Vec::new(),
            "floating" => vec![bare(name, Moves::Free)],
            "spherical" => {
                vec![self.with_limits_and_dynamics(element, bare(name, Moves::Ball), false)?]
            }
            "revolute" => vec![self.with_limits_and_dynamics(element, one(Moves::Hinge), true)?],
            "continuous" => {
                vec![self.with_limits_and_dynamics(element, one(Moves::Hinge), false)?]
            }
            "prismatic" => vec![self.with_limits_and_dynamics(element, one(Moves::Slide), true)?],
            // Two slides in the plane and a hinge across it
            "planar" => {
                let plane =
                    LinkFrame { attitude: super::frame::from_z(&axis), ..LinkFrame::identity() };
                let across = plane.rotation();
                let slide = |end: &str, k: usize| RobotJoint {
                    axis: across.column(k).into_owned(),
                    ..bare(format!("{name}_{end}"), Moves::Slide)
                };
                vec![slide("x", 0), slide("y", 1), one(Moves::Hinge)]
            }
            _ => {
                return Err(element.wrong(
                    "type: fixed, revolute, continuous, prismatic, planar, spherical or floating is needed",
                ));
            }
        };
        // Joints before this one on the same link are relative to its frame.
        let back = frame.rotation().transpose();
        let moved = |joint: &RobotJoint| RobotJoint {
            anchor: back * (joint.anchor - frame.position),
            axis: back * joint.axis,
            ..joint.clone()
        };
        let joints = hanging.before.iter().map(moved).chain(joints).collect();
        Ok((hanging.frame.then(&frame), joints))
    }

    /// Reads a `<mimic>` element. The other joint may come later in the file.
    fn read_mimic(&mut self, element: &Element) -> Parsed<()> {
        let Some(mimic) = element.one("mimic")? else { return Ok(()) };
        let is_held = element.own("name").is_some_and(|name| self.held.contains(name));
        if is_held || element.own("type") == Some("fixed") {
            self.notes.idle("mimic of a fixed joint");
            return Ok(());
        }
        let turns_or_slides = |name: &str| {
            let index = self.robot.joint(name);
            let moves = index.map(|index| self.robot.joints[index].moves);
            let is_one = matches!(moves, Some(Moves::Hinge | Moves::Slide));
            index.filter(|_| is_one).ok_or_else(|| {
                let is_held = self.held.contains(name);
                let name = shown::line(name);
                if is_held {
                    return mimic.wrong(format!(
                        "the joint {name:?} moves less than {LEAST_MASS:e} kg and is fixed; give its link a mass"
                    ));
                }
                mimic.wrong(format!("{name:?} is not a joint that turns about or slides along one \
                                     axis"))
            })
        };
        let joints = [element.needed("name")?, mimic.needed("joint")?].map(turns_or_slides);
        let [own, other] = joints;
        self.robot.follows.push(MimicJoint {
            joints: [own?, other?],
            ratio: mimic.bounded("multiplier", 1.0, [-1e6, 1e6])?,
            offset: mimic.bounded("offset", 0.0, [-1e6, 1e6])?,
            at: mimic.at(),
        });
        Ok(())
    }

    /// Adds limits, damping and friction to a joint.
    fn with_limits_and_dynamics(
        &mut self,
        element: &Element,
        joint: RobotJoint,
        limited: bool,
    ) -> Parsed<RobotJoint> {
        let mut joint = joint;
        if let Some(dynamics) = element.one("dynamics")? {
            joint.damping = dynamics.bounded("damping", 0.0, [0.0, 1e12])?;
            joint.friction = dynamics.bounded("friction", 0.0, [0.0, 1e12])?;
            let [armature, stiffness, rest] = extra::SPRING;
            joint.armature = dynamics.bounded(armature, 0.0, [0.0, 1e12])?;
            joint.stiffness = dynamics.bounded(stiffness, 0.0, [0.0, 1e12])?;
            joint.rest = dynamics.bounded(rest, 0.0, [-FARTHEST, FARTHEST])?;
        }
        // Range and effort
        let Some(limit) = element.one("limit")? else {
            return if limited {
                Err(element.wrong("<limit> is needed; a joint without limits is continuous"))
            } else {
                Ok(joint)
            };
        };
        let (low, high) =
            (limit.number("lower")?.unwrap_or(0.0), limit.number("upper")?.unwrap_or(0.0));
        if limited && low > high {
            self.notes.say(format!(
                "{}: lower is above upper, which means no limits, as in Bullet",
                limit.at()
            ));
        }
        // Limits are clamped to the largest number of the solver.
        let range = [low, high].map(|limit| limit.clamp(-FARTHEST, FARTHEST));
        let is_bounded = limited && low <= high && range != [-FARTHEST, FARTHEST];
        joint.range = is_bounded.then_some(range);
        let effort = limit.bounded("effort", 0.0, [-FARTHEST, FARTHEST])?;
        if effort < 0.0 {
            self.notes.say("an effort below 0 means no limit".to_owned());
        }
        joint.effort = (effort > 0.0).then_some([-effort, effort]);
        if limit.get("velocity").is_some() {
            self.notes.say("velocity limits have no effect".to_owned());
        }
        Ok(joint)
    }
}
