//! Reader of SDF, the format of Gazebo and Drake.
//!
//! A file is converted to the elements of URDF: a link `world` with all models below it. The reader
//! of URDF takes these, with the attributes of [`extra`]. A link is fixed to the world if its model
//! is static. Otherwise a link without a joint above it floats.

mod frames;
mod includes;
mod joints;
mod names;

use crate::Reading;
use crate::frame::{LinkFrame, from_z};
use crate::left_out::pruned;
use crate::model::{NamedSite, Robot, RobotOptions, RobotSite};
use crate::notes::RobotNotes;
use crate::urdf::names::check;
use crate::urdf::{extra, refuse_point_contacts, robot_of};
use crate::xml::{Attributes, Element, Parsed};
use frames::{Frames, Scoped, SdfModel, key};
use nalgebra::Vector3;
use std::collections::HashSet;

/// Largest friction coefficient of a scene.
const MOST_FRICTION: f64 = 10.0;

/// Reads a robot from the root element of a file.
///
/// # Errors
/// The first fault, with its line.
pub fn read(root: &Element, reading: &Reading<'_>) -> Parsed<Robot> {
    refuse_point_contacts(root, reading)?;
    let mut notes = RobotNotes::default();
    let mut root = root.clone();
    includes::Includes::new(reading, &mut notes).expand(&mut root)?;
    let root = pruned(&root, reading.left_out)?;
    check(&root, &names::NAMES, &mut notes)?;
    let world = root.one("world")?;
    let scene = world.unwrap_or(&root);
    // A world has its own gravity and step. A model alone has the usual ones.
    let gravity = scene.one("gravity")?.map(vector).transpose()?;
    let usual = Vector3::new(0.0, 0.0, if world.is_some() { -9.8 } else { -9.81 });
    let physics = scene.all("physics").next();
    let step = physics.map(|physics| number(physics, "max_step_size")).transpose()?.flatten();
    let options = RobotOptions {
        time_step: step.unwrap_or(0.002),
        gravity: gravity.unwrap_or(usual),
        ..RobotOptions::usual(world.is_some())
    };
    let frames = Frames::new(scene)?;
    // If all models are in one, its name is left out of theirs.
    let prefix = match &frames.models[..] {
        [_, first, others @ ..] if others.iter().all(|other| is_in(other, first)) => {
            format!("{}.", first.key)
        }
        _ => String::new(),
    };
    let version = root.own("version").and_then(|version| version.trim().parse::<f64>().ok());
    let is_old = version.is_some_and(|version| version < 1.45);
    let is_fixed = reading.is_fixed;
    let mut reader = SdfReader { frames: &frames, prefix, is_old, is_fixed, notes };
    // The tree in URDF, read as such
    let tree = reader.tree(scene)?;
    let SdfReader { notes, prefix, .. } = reader;
    let mut robot = robot_of(&tree, options, notes, reading)?;
    // Named frames
    for key in &frames.named {
        let link = frames.link_of(key, scene)?;
        let frame = frames.world(key, scene)?.relative_to(&frames.world(&link, scene)?);
        let link = robot.link(&named(&link, &prefix)).unwrap_or(0);
        let site = RobotSite { link, frame };
        robot.sites.push(NamedSite { name: named(key, &prefix), site });
    }
    Ok(robot)
}

fn is_in(model: &SdfModel<'_>, outer: &SdfModel<'_>) -> bool {
    model.key.strip_prefix(&outer.key).is_some_and(|rest| rest.starts_with('.'))
}

/// Name of a frame: its key without the name of the only model.
fn named(key: &str, prefix: &str) -> String {
    if key.is_empty() {
        "world".to_owned()
    } else {
        key.strip_prefix(prefix).unwrap_or(key).to_owned()
    }
}

struct SdfReader<'a> {
    frames: &'a Frames<'a>,
    /// Start of the keys of the only model of the file; empty for several models.
    prefix: String,
    /// True before version 1.5: axes are given in the frame of the model.
    is_old: bool,
    is_fixed: bool,
    notes: RobotNotes,
}

impl<'a> SdfReader<'a> {
    /// URDF of the file.
    fn tree(&mut self, scene: &Element) -> Parsed<Element> {
        let mut carried = HashSet::new();
        let mut joints = Vec::new();
        for joint in &self.frames.joints {
            joints.extend(self.joint(*joint, &mut carried)?);
        }
        let mut robot = made("robot", scene).with("name", self.robot_name());
        robot.children.push(made("link", scene).with("name", "world"));
        let is_root = |link: &&Scoped<'_>| !carried.contains(&self.link_key(link));
        let roots: Vec<_> = self.frames.links.iter().filter(is_root).collect();
        for link in &roots {
            let ends = [String::new(), self.link_key(link)];
            let name = if roots.len() == 1 { "root" } else { &*format!("{}.root", ends[1]) };
            let is_fixed = self.is_fixed || self.frames.models[link.model].is_static;
            let kind = if is_fixed { "fixed" } else { "floating" };
            let frame = self.frames.world(&ends[1], link.element)?;
            robot.children.push(self.joined(
                link.element,
                name,
                kind,
                [&ends[0], &ends[1]],
                &frame,
            ));
        }
        let masks = self.masks();
        for link in &self.frames.links {
            let masks = if self.self_collides(link) { [u32::MAX; 2] } else { masks[link.model] };
            robot.children.push(self.link(link, masks)?);
        }
        Ok(robot.holding(joints))
    }

    /// Name of the only model, or of the world.
    fn robot_name(&self) -> String {
        match self.prefix.strip_suffix('.') {
            Some(model) => model.to_owned(),
            None => self.frames.models[0].element.own("name").unwrap_or("sdf").to_owned(),
        }
    }

    fn link_key(&self, link: &Scoped<'_>) -> String {
        key(&self.frames.models[link.model].key, link.element.own("name").unwrap_or(""))
    }

    /// Joint of URDF between two links with these keys, at the reference pose `frame`.
    fn joined(
        &self,
        at: &Element,
        name: &str,
        kind: &str,
        [parent, child]: [&str; 2],
        frame: &LinkFrame,
    ) -> Element {
        let end = |tag: &str, key: &str| made(tag, at).with("link", self.named(key));
        made("joint", at).with("name", self.named(name)).with("type", kind).holding([
            end("parent", parent),
            end("child", child),
            origin(frame, at),
        ])
    }

    /// Name of a frame: its key without the name of the only model.
    fn named(&self, key: &str) -> String {
        named(key, &self.prefix)
    }

    /// True if a link touches the other links of its model: its own `self_collide`, or else that of
    /// the model.
    fn self_collides(&self, link: &Scoped<'_>) -> bool {
        let model = self.frames.models[link.model].element;
        let owner = [link.element, model];
        let owner = owner.iter().find(|owner| owner.all("self_collide").next().is_some());
        owner.is_some_and(|owner| is_true(owner, "self_collide"))
    }

    /// Collision masks of the links of each model that do not self-collide. They do not touch each
    /// other.
    fn masks(&mut self) -> Vec<[u32; 2]> {
        let mut counts = vec![0; self.frames.models.len()];
        for link in self.frames.links.iter().filter(|link| !self.self_collides(link)) {
            counts[link.model] += usize::from(link.element.all("collision").next().is_some());
        }
        let mut bits = (0..u32::BITS).map(|bit| 1_u32 << bit);
        let mut apart = 0;
        let mut beyond = 0;
        let mask = |(model, count): (&SdfModel<'_>, usize)| {
            if count < 2 || model.is_static {
                return [u32::MAX; 2];
            }
            let bit = bits.next();
            *(if bit.is_some() { &mut apart } else { &mut beyond }) += 1;
            bit.map_or([u32::MAX; 2], |bit| [bit, !bit])
        };
        let masks = self.frames.models.iter().zip(counts).map(mask).collect();
        if apart > 0 {
            self.notes.say(format!(
                "links of a model without <self_collide> do not touch each other: {apart} models"
            ));
        }
        if beyond > 0 {
            self.notes.say(format!(
                "only {apart} models can be without <self_collide>; links touch each other in {beyond} \
                 more"
            ));
        }
        masks
    }

    fn link(&mut self, link: &Scoped<'_>, masks: [u32; 2]) -> Parsed<Element> {
        let element = link.element;
        let own = self.link_key(link);
        let scope = &self.frames.models[link.model].key;
        let is_weightless = element.one("gravity")?.is_some() && !is_true(element, "gravity");
        let weightless = if is_weightless { "1" } else { "0" };
        let mut converted = made("link", element)
            .with("name", self.named(&own))
            .with(extra::WEIGHTLESS, weightless);
        converted.children.push(self.inertial(element, scope, &own)?);
        // Collision shapes and visuals
        for shape in element.all("collision").chain(element.all("visual")) {
            let geometry = shape.one("geometry")?;
            let geometry = geometry.ok_or_else(|| shape.wrong("<geometry> is needed"))?;
            let mut frame = self.frames.in_link(shape, scope, &own)?;
            let mut forms: Vec<_> = geometry.children.iter().map(valued).collect();
            forms.retain(|form| form.tag != "empty");
            if forms.is_empty() {
                continue;
            }
            let fields = forms.iter_mut().flat_map(|form| &mut form.attributes);
            for (name, _) in fields.filter(|(name, _)| name == "uri") {
                *name = "filename".to_owned();
            }
            if let Some(normal) = forms[0].exactly::<3>("normal")?.map(Vector3::from) {
                if normal.norm() <= 1e-12 {
                    return Err(geometry.wrong("normal: its length is zero; give a direction"));
                }
                let attitude = from_z(&normal.normalize());
                frame = frame.then(&LinkFrame { attitude, ..LinkFrame::identity() });
            }
            let mut part = made(&shape.tag, shape);
            part.attributes.clone_from(&shape.attributes);
            part = part.holding([origin(&frame, shape), made("geometry", geometry).holding(forms)]);
            if shape.tag == "collision" {
                part = part.with(extra::GROUPS, format!("{} {}", masks[0], masks[1]));
                if let Some(friction) = self.friction(shape)? {
                    part = part.with(extra::FRICTION, friction.to_string());
                }
            } else if let Some(material) = shape.all("material").next() {
                let diffuse = material.all("diffuse").next();
                let colour = diffuse.map(|one| made("color", one).with("rgba", &*one.text));
                part.children.push(made("material", material).holding(colour));
            }
            converted.children.push(part);
        }
        Ok(converted)
    }

    /// `<inertial>` of URDF. A link without mass has 1 kg and 1 kg m², as the format states.
    fn inertial(&self, link: &Element, scope: &str, own: &str) -> Parsed<Element> {
        let at = link.one("inertial")?.unwrap_or(link);
        let given = |tag: &'static str| at.all(tag).next().filter(|_| at.tag == "inertial");
        if matches!(at.own("auto"), Some("true" | "1")) {
            let usual = given("density").map_or("1000", |density| &*density.text);
            let own = link.all("collision").map(|one| one.all("density").next());
            let mut own = own.map(|own| own.map_or(usual, |own| &*own.text));
            let density = own.next().unwrap_or(usual);
            if own.any(|other| other != density) {
                let why = "auto: only one density is supported; add <mass> and <inertia>";
                return Err(at.wrong(why));
            }
            return Ok(made("inertial", at).holding([made("density", at).with("value", density)]));
        }
        let frame = if at.tag == "inertial" {
            self.frames.in_link(at, scope, own)?
        } else {
            LinkFrame::identity()
        };
        let mass = given("mass").map_or("1", |mass| &mass.text);
        let mut inertia = given("inertia").map_or_else(|| made("inertia", at), valued);
        for moment in ["ixx", "iyy", "izz"] {
            if inertia.own(moment).is_none() {
                inertia = inertia.with(moment, "1");
            }
        }
        let mass = made("mass", given("mass").unwrap_or(at)).with("value", mass);
        Ok(made("inertial", at).holding([origin(&frame, at), mass, inertia]))
    }

    /// Friction coefficient of a collision: Drake's, or that of Gazebo's ODE.
    fn friction(&mut self, collision: &Element) -> Parsed<Option<f64>> {
        let drake = collision.all("proximity_properties").next();
        let below =
            |tags: [&'static str; 3]| tags.iter().try_fold(collision, |at, tag| at.all(tag).next());
        let ode = below(["surface", "friction", "ode"]);
        for (at, tag) in [(drake, "mu_dynamic"), (drake, "mu_static"), (ode, "mu")] {
            let Some(at) = at else { continue };
            let Some(friction) = number(at, tag)? else { continue };
            if friction < 0.0 {
                return Err(at.wrong(format!("{tag} is below 0; give 0 to {MOST_FRICTION}")));
            }
            if friction > MOST_FRICTION {
                self.notes
                    .say(format!("friction coefficients above {MOST_FRICTION} are set to it"));
            }
            if number(at, "mu2")?.is_some_and(|second| second != friction) {
                self.notes.say("mu2 has no effect: friction is mu in all directions".to_owned());
            }
            return Ok(Some(friction.min(MOST_FRICTION)));
        }
        Ok(None)
    }
}

/// True if the element has a child `tag` with the text `true` or `1`.
fn is_true(element: &Element, tag: &str) -> bool {
    element.all(tag).next().is_some_and(|child| matches!(&*child.text, "true" | "1" | "True"))
}

/// Number in the child `tag`.
fn number(element: &Element, tag: &str) -> Parsed<Option<f64>> {
    let Some(child) = element.one(tag)? else { return Ok(None) };
    match child.numbers_of(tag, &child.text)?[..] {
        [number] => Ok(Some(number)),
        _ => Err(child.wrong("one number is needed")),
    }
}

/// Three numbers in the text of an element.
fn vector(element: &Element) -> Parsed<Vector3<f64>> {
    let numbers = element.numbers_of(&element.tag, &element.text)?;
    let three =
        <[f64; 3]>::try_from(numbers).map_err(|_| element.wrong("three numbers are needed"))?;
    Ok(three.into())
}

/// Element of URDF at the place of `at`, without content.
fn made(tag: &str, at: &Element) -> Element {
    Element {
        tag: tag.to_owned(),
        attributes: Vec::new(),
        children: Vec::new(),
        text: String::new(),
        line: at.line,
        file: at.file.clone(),
    }
}

impl Element {
    /// The element with one more attribute.
    fn with(mut self, name: &str, value: impl Into<String>) -> Self {
        self.attributes.push((name.to_owned(), value.into()));
        self
    }

    /// The element with more children.
    fn holding(mut self, children: impl IntoIterator<Item = Self>) -> Self {
        self.children.extend(children);
        self
    }
}

/// Element with the texts of its children as attributes.
fn valued(element: &Element) -> Element {
    let values = element.children.iter().filter(|child| child.children.is_empty());
    let values = values.map(|child| (child.tag.clone(), child.text.clone()));
    let attributes = element.attributes.iter().cloned().chain(values).collect();
    Element { attributes, ..made(&element.tag, element) }
}

fn origin(frame: &LinkFrame, at: &Element) -> Element {
    let position = text_of(frame.position.as_slice());
    let attitude = text_of(frame.attitude.as_slice());
    made("origin", at).with("xyz", position).with(extra::ATTITUDE, attitude)
}

/// Numbers as text that is read back exactly.
fn text_of(numbers: &[f64]) -> String {
    numbers.iter().map(|x| format!("{x:?} ")).collect()
}
