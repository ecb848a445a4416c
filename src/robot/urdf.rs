//! URDF, the format of ROS.

use super::Reading;
use super::frame::{Frame, about, left_times};
use super::left_out::pruned;
use super::meshes;
use super::model::{Follows, Form, Joint, Link, Look, Mass, Moves, Options, Robot, Seen, Shape};
use super::notes::Notes;
use super::xml::{Attributes, Element};
use crate::scenario::shown;
use nalgebra::{Matrix3, Vector3, Vector4};
use std::collections::{BTreeMap, HashMap};

/// More links than this are refused.
const MOST_LINKS: usize = 2000;

/// Limits of joints are no farther than this, m or rad.
const FARTHEST: f64 = 1e12;

/// The robot of a file.
///
/// # Errors
/// The first thing that is wrong, with its line.
pub fn read(root: &Element, reading: &Reading<'_>) -> Result<Robot, String> {
    if reading.points_rub {
        return Err(root.wrong(
            "point_contacts is for MJCF; contacts of URDF rub alone as they are; leave it out",
        ));
    }
    let root = &pruned(root, reading.left_out)?;
    let mut notes = Notes::default();
    for child in root.children.iter().filter(|child| !["link", "joint"].contains(&&*child.tag)) {
        notes.idle(&child.tag);
    }
    let tree = Tree::of(root)?;
    let robot = Robot {
        name: root.own("name").unwrap_or("").to_owned(),
        links: vec![Link {
            name: "world".to_owned(),
            parent: 0,
            frame: Frame::identity(),
            mass: Mass::NONE,
            weightless: 0.0,
            is_mocap: false,
            joints: (0, 0),
            at: "the world".to_owned(),
        }],
        joints: Vec::new(),
        shapes: Vec::new(),
        looks: Vec::new(),
        actuators: Vec::new(),
        ties: Vec::new(),
        follows: Vec::new(),
        sums: Vec::new(),
        apart: Vec::new(),
        pairs: BTreeMap::new(),
        keys: Vec::new(),
        options: Options {
            time_step: 0.002,
            gravity: Vector3::new(0.0, 0.0, -9.81),
            contacts: true,
            neighbours_touch: false,
            has_world: false,
        },
        notes: Vec::new(),
    };
    let (hulls, placed) = (HashMap::new(), vec![Frame::identity()]);
    let mut reader = Reader { reading, tree: &tree, notes, robot, hulls, placed };
    reader.read_root()?;
    for joint in root.all("joint") {
        reader.read_mimic(joint)?;
    }
    reader.robot.notes = reader.notes.sentences();
    Ok(reader.robot)
}

/// Links and joints by their names, and who hangs on whom.
struct Tree<'e> {
    links: HashMap<&'e str, &'e Element>,
    /// The joints of each parent in the order of the file.
    below: HashMap<&'e str, Vec<&'e Element>>,
    root: &'e Element,
}

/// The one element `tag` in a joint, and the link that it names.
fn end<'e>(joint: &'e Element, tag: &str) -> Result<&'e str, String> {
    let element = joint.one(tag)?.ok_or_else(|| joint.wrong(format!("<{tag}> is needed")))?;
    element.needed("link")
}

impl<'e> Tree<'e> {
    fn of(root: &'e Element) -> Result<Self, String> {
        let mut links = HashMap::new();
        for link in root.all("link") {
            if links.insert(link.needed("name")?, link).is_some() {
                return Err(link.wrong("this name is given twice; each link needs its own"));
            }
            if links.len() > MOST_LINKS {
                return Err(link.wrong(format!("with this there are more than {MOST_LINKS} links")));
            }
        }
        let (mut below, mut parents) = (HashMap::<_, Vec<_>>::new(), HashMap::new());
        let mut names = HashMap::new();
        for joint in root.all("joint") {
            if names.insert(joint.needed("name")?, ()).is_some() {
                return Err(joint.wrong("this name is given twice; each joint needs its own"));
            }
            let (parent, child) = (end(joint, "parent")?, end(joint, "child")?);
            for link in [parent, child] {
                if !links.contains_key(link) {
                    return Err(joint.wrong(format!("there is no link {:?}", shown::line(link))));
                }
            }
            if parents.insert(child, parent).is_some() {
                let child = shown::line(child);
                return Err(joint.wrong(format!("{child:?} has a parent already; one is allowed")));
            }
            below.entry(parent).or_default().push(joint);
        }
        let mut roots =
            root.all("link").filter(|link| !parents.contains_key(link.own("name").unwrap_or("")));
        let first = roots.next();
        if let Some(second) = roots.next() {
            return Err(
                second.wrong("it is no joint's child, as another link is not; one root is needed")
            );
        }
        match first {
            Some(root) => Ok(Self { links, below, root }),
            None => {
                Err(root.wrong("there is no link that is no joint's child; one root is needed"))
            }
        }
    }
}

/// A joint that is still to be read, with what hangs on it.
struct Hanging<'e> {
    joint: &'e Element,
    parent: usize,
    /// Of the joints between links without mass above it: they are joints of the first link below them that has one, in
    /// the frame of the link that this joint is in, which is here in that of the parent.
    before: Vec<Joint>,
    frame: Frame,
}

struct Reader<'a> {
    reading: &'a Reading<'a>,
    tree: &'a Tree<'a>,
    notes: Notes,
    robot: Robot,
    /// Corners of the hulls of meshes, by the file and the bits of the scale.
    hulls: HashMap<(String, [u64; 3]), Vec<[f64; 3]>>,
    /// Where links are in the world at the reference.
    placed: Vec<Frame>,
}

impl<'a> Reader<'a> {
    /// The root and all that hangs on it, the first below the first.
    fn read_root(&mut self) -> Result<(), String> {
        let root = self.tree.root;
        let name = root.needed("name")?;
        let mut todo = Vec::new();
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
                let free = (weighs && !self.reading.is_fixed).then(|| self.free_root(root));
                self.add_link(root, 0, Frame::identity(), free.into_iter().collect())?
            }
        };
        self.push_below(name, index, &mut todo);
        let mut read = 1;
        while let Some(hanging) = todo.pop() {
            let child = end(hanging.joint, "child")?;
            let parent = hanging.parent;
            let (frame, joints) = self.read_joint(&hanging)?;
            if let Some(below) = self.passes_on(child, &joints)? {
                self.notes.idle("link without mass between joints");
                todo.push(Hanging { joint: below, parent, before: joints, frame });
            } else {
                let flies = matches!(joints[..], [Joint { moves: Moves::Free, .. }]);
                // It flies: where its parent goes is nothing to it.
                let (parent, frame) =
                    if flies { (0, self.placed[parent].then(&frame)) } else { (parent, frame) };
                let index = self.add_link(self.tree.links[child], parent, frame, joints)?;
                self.push_below(child, index, &mut todo);
            }
            read += 1;
        }
        match read == self.tree.links.len() {
            true => Ok(()),
            false => Err(root.wrong("not all links hang on it: the joints of others make a ring")),
        }
    }

    fn push_below(&self, name: &str, parent: usize, todo: &mut Vec<Hanging<'a>>) {
        let below = self.tree.below.get(name).map_or(&[][..], Vec::as_slice);
        let (before, frame) = (Vec::new(), Frame::identity());
        let hanging =
            |joint: &&'a Element| Hanging { joint, parent, before: before.clone(), frame };
        todo.extend(below.iter().rev().map(hanging));
    }

    /// The one joint below a link that is nothing but a place between two joints: it has no mass, touches nothing, and
    /// slides or turns, as what hangs on it.
    fn passes_on(&self, name: &'a str, joints: &[Joint]) -> Result<Option<&'a Element>, String> {
        let is_one = |joint: &Joint| matches!(joint.moves, Moves::Hinge | Moves::Slide);
        let Some([below]) = self.tree.below.get(name).map(Vec::as_slice) else { return Ok(None) };
        let touches = self.tree.links[name].all("collision").next().is_some();
        let moves = !matches!(below.own("type"), Some("fixed" | "floating"));
        let passes = moves
            && !touches
            && !joints.is_empty()
            && joints.iter().all(is_one)
            && !self.weighs(name)?;
        Ok(passes.then_some(*below))
    }

    /// Whether a link, or one that is fixed to it, has a mass.
    fn weighs(&self, name: &'a str) -> Result<bool, String> {
        let mut todo = vec![name];
        // No link twice: each has one parent.
        while let Some(name) = todo.pop() {
            if inertial(self.tree.links[name])?.mass > 0.0 {
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

    fn free_root(&self, root: &Element) -> Joint {
        Joint::bare("root".to_owned(), 0, Moves::Free, root.at())
    }

    fn add_link(
        &mut self,
        element: &Element,
        parent: usize,
        frame: Frame,
        joints: Vec<Joint>,
    ) -> Result<usize, String> {
        let index = self.robot.links.len();
        for child in &element.children {
            match &*child.tag {
                "inertial" | "collision" => {}
                tag => self.notes.idle(tag),
            }
        }
        self.robot.links.push(Link {
            name: element.needed("name")?.to_owned(),
            parent,
            frame,
            mass: inertial(element)?,
            weightless: 0.0,
            is_mocap: false,
            joints: (self.robot.joints.len(), joints.len()),
            at: element.at(),
        });
        self.placed.push(self.placed[parent].then(&frame));
        for joint in joints {
            if self.robot.joint(&joint.name).is_some() {
                return Err(format!(
                    "{}: this name is given twice; each joint needs its own",
                    joint.at
                ));
            }
            self.robot.joints.push(Joint { link: index, ..joint });
        }
        self.read_shapes(element, index)?;
        self.read_looks(element, index);
        Ok(index)
    }

    /// A joint and those before it that its link has too, in the frame of that link; where that is in the parent.
    fn read_joint(&mut self, hanging: &Hanging<'_>) -> Result<(Frame, Vec<Joint>), String> {
        let element = hanging.joint;
        let name = element.needed("name")?.to_owned();
        let frame = origin(element)?;
        let kind = element.needed("type")?;
        for odd in element.all("safety_controller").chain(element.all("calibration")) {
            self.notes.idle(&odd.tag);
        }
        let axis = element.one("axis")?.map(|axis| axis.exactly::<3>("xyz")).transpose()?.flatten();
        let axis = Vector3::from(axis.unwrap_or([1.0, 0.0, 0.0]));
        let length = axis.norm();
        let moves = !matches!(kind, "fixed" | "floating");
        if moves && length <= 1e-12 {
            return Err(element.wrong("axis: it has no length"));
        }
        let axis = if length > 0.0 { axis / length } else { axis };
        let bare = |name: String, moves: Moves| Joint::bare(name, 0, moves, element.at());
        let one = |moves: Moves| Joint { axis, ..bare(name.clone(), moves) };
        let joints = match kind {
            "fixed" => Vec::new(),
            "floating" => vec![bare(name, Moves::Free)],
            "revolute" => vec![self.driven(element, one(Moves::Hinge), true)?],
            "continuous" => vec![self.driven(element, one(Moves::Hinge), false)?],
            "prismatic" => vec![self.driven(element, one(Moves::Slide), true)?],
            "planar" => {
                let plane = Frame { attitude: super::frame::from_z(&axis), ..Frame::identity() };
                let across = plane.rotation();
                let slide = |end: &str, k: usize| Joint {
                    axis: across.column(k).into_owned(),
                    ..bare(format!("{name}_{end}"), Moves::Slide)
                };
                vec![slide("x", 0), slide("y", 1), one(Moves::Hinge)]
            }
            _ => {
                return Err(element.wrong(
                    "type: fixed, revolute, continuous, prismatic, floating or planar is needed",
                ));
            }
        };
        let back = frame.rotation().transpose();
        let moved = |joint: &Joint| Joint {
            anchor: back * (joint.anchor - frame.position),
            axis: back * joint.axis,
            ..joint.clone()
        };
        let joints = hanging.before.iter().map(moved).chain(joints).collect();
        Ok((hanging.frame.then(&frame), joints))
    }

    /// A joint that goes with another one, which may stand after it.
    fn read_mimic(&mut self, element: &Element) -> Result<(), String> {
        let Some(mimic) = element.one("mimic")? else { return Ok(()) };
        if element.own("type") == Some("fixed") {
            self.notes.idle("mimic of a fixed joint");
            return Ok(());
        }
        let turns_or_slides = |name: &str| {
            let index = self.robot.joint(name);
            let moves = index.map(|index| self.robot.joints[index].moves);
            let is_one = matches!(moves, Some(Moves::Hinge | Moves::Slide));
            index.filter(|_| is_one).ok_or_else(|| {
                let name = shown::line(name);
                mimic.wrong(format!("{name:?} is no joint that turns or slides about one axis"))
            })
        };
        let joints = [element.needed("name")?, mimic.needed("joint")?].map(turns_or_slides);
        let [own, other] = joints;
        self.robot.follows.push(Follows {
            joints: [own?, other?],
            ratio: mimic.bounded("multiplier", 1.0, [-1e6, 1e6])?,
            offset: mimic.bounded("offset", 0.0, [-1e6, 1e6])?,
            at: mimic.at(),
        });
        Ok(())
    }

    /// A joint with its limits and what resists it.
    fn driven(&mut self, element: &Element, joint: Joint, limited: bool) -> Result<Joint, String> {
        let mut joint = joint;
        if let Some(dynamics) = element.one("dynamics")? {
            joint.damping = dynamics.bounded("damping", 0.0, [0.0, 1e12])?;
            joint.friction = dynamics.bounded("friction", 0.0, [0.0, 1e12])?;
        }
        let Some(limit) = element.one("limit")? else {
            return match limited {
                true => {
                    Err(element.wrong("<limit> is needed; a joint without limits is continuous"))
                }
                false => Ok(joint),
            };
        };
        let (low, high) =
            (limit.number("lower")?.unwrap_or(0.0), limit.number("upper")?.unwrap_or(0.0));
        if limited && low > high {
            return Err(
                limit.wrong(format!("lower is {low:?} and upper {high:?}; lower must not be more"))
            );
        }
        // What is farther away than the solver's largest number is no limit.
        joint.range = limited.then_some([low, high].map(|limit| limit.clamp(-FARTHEST, FARTHEST)));
        let effort = limit.bounded("effort", 0.0, [0.0, 1e12])?;
        joint.effort = (effort > 0.0).then_some([-effort, effort]);
        if limit.get("velocity").is_some() {
            self.notes.say("limits of velocity have no meaning here".to_owned());
        }
        Ok(joint)
    }

    fn read_shapes(&mut self, element: &Element, link: usize) -> Result<(), String> {
        for collision in element.all("collision") {
            let geometry = collision.one("geometry")?;
            let geometry = geometry.ok_or_else(|| collision.wrong("<geometry> is needed"))?;
            let [form] = &geometry.children[..] else {
                return Err(
                    geometry.wrong("one of box, sphere, cylinder, capsule and mesh is needed")
                );
            };
            let frame = origin(collision)?;
            for form in self.forms(form)? {
                let index = self.robot.shapes.len();
                self.robot.shapes.push(Shape {
                    name: collision.own("name").map_or(format!("shape-{index}"), str::to_owned),
                    link,
                    form,
                    frame,
                    groups: [1, 1],
                    friction: None,
                    rubs: true,
                    priority: 0,
                    at: format!("{} of {}", collision.at(), element.at()),
                });
            }
        }
        Ok(())
    }

    /// What a link looks like, all of it or nothing: what is wrong with it does not change the motion.
    fn read_looks(&mut self, element: &Element, link: usize) {
        let before = self.robot.looks.len();
        for visual in element.all("visual") {
            match self.look(visual, link) {
                Ok(look) => self.robot.looks.push(look),
                Err(why) => {
                    self.robot.looks.truncate(before);
                    self.notes.unseen(why);
                    return;
                }
            }
        }
    }

    fn look(&self, visual: &Element, link: usize) -> Result<Look, String> {
        let geometry = visual.one("geometry")?;
        let geometry = geometry.ok_or_else(|| visual.wrong("<geometry> is needed"))?;
        let [form] = &geometry.children[..] else {
            return Err(geometry.wrong("one of box, sphere, cylinder, capsule and mesh is needed"));
        };
        let seen = if form.tag == "mesh" {
            let scale = form.exactly::<3>("scale")?.unwrap_or([1.0; 3]);
            let name = form.needed("filename")?;
            let surface = meshes::surface(self.reading, name, scale, &self.robot.looks);
            Seen::Mesh(surface.map_err(|why| form.wrong(why))?)
        } else {
            Seen::Form(self.form(form)?)
        };
        Ok(Look { link, seen, frame: origin(visual)? })
    }

    /// What a shape is made of: one form, or the pieces of a mesh.
    fn forms(&mut self, element: &Element) -> Result<Vec<Form>, String> {
        if element.tag != "mesh" {
            return Ok(vec![self.form(element)?]);
        }
        let name = element.needed("filename")?;
        let scale = element.exactly::<3>("scale")?.unwrap_or([1.0; 3]);
        let one = [name.to_owned()];
        let names = self.reading.pieces.get(name).map_or(&one[..], Vec::as_slice);
        let mut forms = Vec::with_capacity(names.len());
        for name in names {
            let key = (name.clone(), scale.map(f64::to_bits));
            if !self.hulls.contains_key(&key) {
                let hulled = meshes::read(self.reading, name, scale);
                let hulled = hulled.map_err(|why| element.wrong(why))?;
                if let Some(note) = hulled.note(name) {
                    self.notes.say(note);
                }
                self.hulls.insert(key.clone(), hulled.corners);
            }
            forms.push(Form::Hull(self.hulls[&key].clone()));
        }
        Ok(forms)
    }

    fn form(&self, element: &Element) -> Result<Form, String> {
        let length = |field: &str| {
            element.needed(field)?;
            element.bounded(field, 0.0, [1e-9, 1e6])
        };
        match &*element.tag {
            "box" => {
                let size = element.exactly::<3>("size")?;
                let size = Vector3::from(size.ok_or_else(|| element.wrong("size is needed"))?);
                match size.iter().all(|side| (2e-6..=2e4).contains(side)) {
                    true => Ok(Form::Box(size * 0.5)),
                    false => Err(element.wrong("size: sides from 2e-6 to 2e4 m are needed")),
                }
            }
            "sphere" => Ok(Form::Sphere(length("radius")?)),
            "cylinder" => Ok(Form::Cylinder(0.5 * length("length")?, length("radius")?)),
            "capsule" => Ok(Form::Capsule(0.5 * length("length")?, length("radius")?)),
            _ => Err(element.wrong("one of box, sphere, cylinder, capsule and mesh is needed")),
        }
    }
}

/// `<origin>`: a place, and turns about x, y and z that stay, one after the other.
fn origin(element: &Element) -> Result<Frame, String> {
    let Some(origin) = element.one("origin")? else { return Ok(Frame::identity()) };
    let position = origin.exactly::<3>("xyz")?.unwrap_or_default();
    let [roll, pitch, yaw] = origin.exactly::<3>("rpy")?.unwrap_or_default();
    Ok(Frame { position: position.into(), attitude: of_angles(roll, pitch, yaw) })
}

fn of_angles(roll: f64, pitch: f64, yaw: f64) -> Vector4<f64> {
    let turned = left_times(&about(&Vector3::y(), pitch), &about(&Vector3::x(), roll));
    left_times(&about(&Vector3::z(), yaw), &turned).normalize()
}

/// `<inertial>`; nothing where there is none.
fn inertial(link: &Element) -> Result<Mass, String> {
    let Some(inertial) = link.one("inertial")? else { return Ok(Mass::NONE) };
    let mass = inertial.one("mass")?.ok_or_else(|| inertial.wrong("<mass> is needed"))?;
    mass.needed("value")?;
    let mass = mass.bounded("value", 0.0, [0.0, 1e9])?;
    let inertia = match inertial.one("inertia")? {
        None => Matrix3::zeros(),
        Some(element) => {
            let [xx, xy, xz, yy, yz, zz] = ["ixx", "ixy", "ixz", "iyy", "iyz", "izz"]
                .map(|field| element.number(field).map(|number| number.unwrap_or(0.0)));
            let (xx, xy, xz, yy, yz, zz) = (xx?, xy?, xz?, yy?, yz?, zz?);
            Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)
        }
    };
    Ok(Mass { mass, centre: Vector3::zeros(), inertia }.placed(&origin(inertial)?))
}
