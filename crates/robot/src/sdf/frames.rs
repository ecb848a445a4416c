//! Frames of an SDF file: models, links, joints and named frames.
//!
//! A frame has a key: its name behind those of its models, joined by dots. The key of the world is
//! empty.

use super::is_true;
use crate::frame::LinkFrame;
use crate::urdf::attitude_from_angles;
use crate::xml::{Attributes, Element, Parsed};
use nalgebra::Vector4;
use std::cell::{Cell, RefCell};
use std::collections::HashMap;
use tumble_model::shown;

/// An element with the key of its model.
#[derive(Clone, Copy)]
pub struct Scoped<'e> {
    pub element: &'e Element,
    /// Index of its model.
    pub model: usize,
}

/// A model of the file.
pub struct SdfModel<'e> {
    pub key: String,
    pub element: &'e Element,
    pub is_static: bool,
}

struct Frame<'e> {
    element: &'e Element,
    /// Key of the frame in which the pose is given.
    base: String,
    pose: LinkFrame,
    /// Key of the frame that it moves with; `None` for a link.
    attached: Option<String>,
    /// Key of the frame that has the pose instead of its model.
    placed: Option<String>,
}

/// Models, links, joints and frames of a file.
pub struct Frames<'e> {
    frames: HashMap<String, Frame<'e>>,
    /// Models. The first stands for the world.
    pub models: Vec<SdfModel<'e>>,
    pub links: Vec<Scoped<'e>>,
    pub joints: Vec<Scoped<'e>>,
    /// Keys of the named frames.
    pub named: Vec<String>,
    /// Poses in the world that were asked for, by key.
    placed: RefCell<HashMap<String, LinkFrame>>,
    /// Work of all searches along chains of frames, in bytes of keys.
    searched: Cell<usize>,
}

/// Maximum work of the searches, about a second. A chain of 2000 frames needs half of it.
const MOST_SEARCHED: usize = 1 << 28;
/// Work of a step of a search beyond the bytes of its key.
const STEP: usize = 64;

impl<'e> Frames<'e> {
    /// Frames of a `<world>`, or of the models of an `<sdf>`.
    pub fn new(world: &'e Element) -> Parsed<Self> {
        let models = vec![SdfModel { key: String::new(), element: world, is_static: false }];
        let mut own = Self {
            frames: HashMap::new(),
            models,
            links: Vec::new(),
            joints: Vec::new(),
            named: Vec::new(),
            placed: RefCell::default(),
            searched: Cell::new(0),
        };
        own.add_contents(0)?;
        Ok(own)
    }

    fn add_contents(&mut self, model: usize) -> Parsed<()> {
        let element = self.models[model].element;
        let scope = self.models[model].key.clone();
        for child in &element.children {
            let scoped = Scoped { element: child, model };
            let attached = match &*child.tag {
                "link" => {
                    self.links.push(scoped);
                    None
                }
                "joint" => {
                    self.joints.push(scoped);
                    continue;
                }
                "frame" => {
                    let to = child.own("attached_to").filter(|to| !to.is_empty());
                    self.named.push(key(&scope, child.needed("name")?));
                    Some(to.map_or(scope.clone(), |to| key(&scope, to)))
                }
                "model" => {
                    self.add_model(scoped)?;
                    continue;
                }
                _ => continue,
            };
            let base = if child.tag == "frame" { attached.as_deref() } else { None };
            let (base, pose) = pose_of(child, &scope, base.unwrap_or(&scope))?;
            let frame = Frame { element: child, base, pose, attached, placed: None };
            let own = key(&scope, child.needed("name")?);
            if own.is_empty() || self.frames.insert(own, frame).is_some() {
                return Err(child.wrong("this name is used twice or reserved; give it another"));
            }
        }
        // Old files may give a joint the name of a link. The link has the frame of this name.
        for joint in element.all("joint") {
            let child = key(&scope, end(joint, "child")?);
            let (base, pose) = pose_of(joint, &scope, &child)?;
            let frame = Frame { element: joint, base, pose, attached: Some(child), placed: None };
            self.frames.entry(key(&scope, joint.needed("name")?)).or_insert(frame);
        }
        Ok(())
    }

    fn add_model(&mut self, scoped: Scoped<'e>) -> Parsed<()> {
        let Scoped { element, model } = scoped;
        let outer = &self.models[model];
        let own = key(&outer.key, element.needed("name")?);
        let (base, pose) = pose_of(element, &outer.key, &outer.key)?;
        let inner = |field: &str| {
            element.own(field).filter(|name| !name.is_empty()).map(|name| key(&own, name))
        };
        let first = ["link", "model"].iter().find_map(|tag| element.all(tag).next()?.own("name"));
        let canonical = inner("canonical_link").or_else(|| first.map(|name| key(&own, name)));
        let placed = inner("placement_frame");
        let is_static = outer.is_static || is_true(element, "static");
        let attached = Some(canonical.unwrap_or_default());
        let frame = Frame { element, base, pose, attached, placed };
        if self.frames.insert(own.clone(), frame).is_some() {
            return Err(element.wrong("this name is used twice; each model needs its own"));
        }
        self.models.push(SdfModel { key: own, element, is_static });
        self.add_contents(self.models.len() - 1)
    }

    fn frame(&self, key: &str, asks: &Element) -> Parsed<&Frame<'e>> {
        self.searched.set(self.searched.get() + STEP + key.len());
        if self.searched.get() > MOST_SEARCHED {
            return Err(asks.wrong(
                "too many frames build on one another; give their poses relative to their model",
            ));
        }
        self.frames.get(key).ok_or_else(|| {
            let name = shown::line(if key.is_empty() { "world" } else { key });
            asks.wrong(format!(
                "there is no frame {name:?} here; name a link, a joint, a frame or a model"
            ))
        })
    }

    /// Pose of a frame in `outer`, one of the frames that its pose builds on. `asks` is the element
    /// for messages.
    fn pose_within(&self, key: &str, outer: &str, asks: &Element) -> Parsed<LinkFrame> {
        let mut at = key;
        let mut asks = asks;
        let mut pose = LinkFrame::identity();
        for _ in 0..=self.frames.len() {
            if at == outer {
                return Ok(pose);
            }
            let frame = self.frame(at, asks)?;
            if let Some(placed) = &frame.placed {
                let placed = self.pose_within(placed, at, frame.element)?;
                pose = LinkFrame::identity().relative_to(&placed).then(&pose);
            }
            pose = frame.pose.then(&pose);
            (at, asks) = (&frame.base, frame.element);
        }
        Err(asks.wrong("relative_to: its pose depends on itself; name another frame"))
    }

    /// Pose of a frame in the world.
    pub fn world(&self, key: &str, asks: &Element) -> Parsed<LinkFrame> {
        if let Some(known) = self.placed.borrow().get(key) {
            return Ok(*known);
        }
        let pose = self.pose_within(key, "", asks)?;
        self.placed.borrow_mut().insert(key.to_owned(), pose);
        Ok(pose)
    }

    /// Pose of an element of a link, in the frame of the link.
    pub fn in_link(&self, element: &Element, scope: &str, link: &str) -> Parsed<LinkFrame> {
        let (base, pose) = pose_of(element, scope, link)?;
        if base == link {
            return Ok(pose);
        }
        let base = self.world(&base, element)?;
        Ok(base.then(&pose).relative_to(&self.world(link, element)?))
    }

    /// Key of the link that a frame moves with; empty for the world.
    pub fn link_of(&self, key: &str, asks: &Element) -> Parsed<String> {
        let mut at = key;
        let mut asks = asks;
        for _ in 0..=self.frames.len() {
            if at.is_empty() {
                return Ok(String::new());
            }
            let frame = self.frame(at, asks)?;
            let Some(attached) = &frame.attached else { return Ok(at.to_owned()) };
            (at, asks) = (attached, frame.element);
        }
        Err(asks.wrong("attached_to: it is attached to itself; name another frame"))
    }
}

/// Key of the frame `name` in the model with the key `scope`.
pub fn key(scope: &str, name: &str) -> String {
    let name = name.trim().replace("::", ".");
    let name = name.strip_suffix(".__model__").unwrap_or(&name);
    match name {
        "world" => String::new(),
        "__model__" => scope.to_owned(),
        _ if scope.is_empty() => name.to_owned(),
        _ => format!("{scope}.{name}"),
    }
}

/// Name in the element `tag` of a joint.
pub fn end<'e>(joint: &'e Element, tag: &str) -> Parsed<&'e str> {
    let end = joint.one(tag)?.ok_or_else(|| joint.wrong(format!("<{tag}> is needed")))?;
    // Files before 1.4 have an attribute.
    Ok(end.own("link").unwrap_or(&end.text))
}

/// Key of the frame in which the pose of an element is given, and the pose. `usual` is the key
/// without `relative_to`.
pub fn pose_of(element: &Element, scope: &str, usual: &str) -> Parsed<(String, LinkFrame)> {
    let Some(pose) = element.one("pose")? else {
        return Ok((usual.to_owned(), LinkFrame::identity()));
    };
    let base = ["relative_to", "frame"].iter().find_map(|name| pose.own(name));
    let base = base.filter(|name| !name.is_empty());
    let base = base.map_or(usual.to_owned(), |name| key(scope, name));
    let unit = match pose.own("degrees") {
        Some("true" | "1") => std::f64::consts::PI / 180.0,
        _ => 1.0,
    };
    let is_quaternion = pose.own("rotation_format") == Some("quat_xyzw");
    let (position, attitude) = match pose.numbers_of("pose", &pose.text)?[..] {
        [] => return Ok((base, LinkFrame::identity())),
        [x, y, z, i, j, k, w] if is_quaternion && [i, j, k, w] != [0.0; 4] => {
            ([x, y, z], Vector4::new(w, i, j, k).normalize())
        }
        [x, y, z, roll, pitch, yaw] if !is_quaternion => {
            ([x, y, z], attitude_from_angles([roll, pitch, yaw].map(|angle| angle * unit)))
        }
        _ => {
            return Err(pose.wrong(
                "x y z roll pitch yaw are needed, or x y z qx qy qz qw with \
                 rotation_format=\"quat_xyzw\"",
            ));
        }
    };
    Ok((base, LinkFrame { position: position.into(), attitude }))
}
