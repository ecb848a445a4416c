//! Reader of MJCF, the format of MuJoCo.
//!
//! Content that affects the motion is read, or rejected with its line. Other content is summarised
//! in one note.

mod actuators;
mod assets;
mod bodies;
mod compiler;
mod contacts;
mod defaults;
mod fields;
mod includes;
mod replicated;
mod rest;
mod shapes;
mod sites;
mod tendons;

use super::Reading;
use super::left_out::pruned;
use super::meshes::Hulled;
use super::model::{LinkMass, Robot};
use super::notes::RobotNotes;
use super::xml::{Attributes, Element, Parsed, is_listed};
use compiler::Compiler;
use defaults::{Classes, Defaulted};
use std::collections::{BTreeSet, HashMap};
use std::sync::Arc;
use tumble_core::geometry::terrain::HeightField;
use tumble_model::{nearest, shown};

/// Elements allowed in the root of a file.
const SECTIONS: &str = "\
    compiler option size visual statistic default custom asset worldbody contact equality \
    tendon actuator sensor keyframe extension";

/// State of the reader of one file.
struct MjcfReader<'a> {
    reading: &'a Reading<'a>,
    compiler: Compiler,
    classes: Classes,
    /// Meshes by name. A mesh without a hull is an error only if it collides or has mass.
    meshes: HashMap<String, Parsed<Hulled>>,
    /// Colours of materials by name.
    materials: HashMap<String, [u8; 3]>,
    /// File of each mesh, and its scale along x, y and z.
    files: HashMap<String, (String, [f64; 3])>,
    /// Height fields by name. A fault is an error only if the field collides.
    fields: HashMap<String, Parsed<Arc<HeightField>>>,
    /// Meshes without a hull that are used for drawing only.
    flat: BTreeSet<String>,
    /// Links whose visual geometry could not be read.
    unseen: BTreeSet<usize>,
    /// Masses of the shapes of each link; `None` if shapes do not contribute to its mass.
    matter: Vec<Option<Vec<LinkMass>>>,
    /// Joints with `springdamper`: index, and time constant (s) with damping ratio.
    timed: Vec<(usize, [f64; 2])>,
    /// True once a plane has become the ground.
    has_ground: bool,
    /// Effects that the file enables.
    flags: rest::Flags,
    notes: RobotNotes,
    robot: Robot,
}

/// Reads a robot from the root element of a file.
///
/// # Errors
/// The first fault or unsupported content that affects the motion, with its line.
pub fn read(root: &Element, reading: &Reading<'_>) -> Parsed<Robot> {
    let root = pruned(&includes::spliced(root, reading)?, reading.left_out)?;
    if let Some(other) = root.children.iter().find(|section| !is_listed(&section.tag, SECTIONS)) {
        return Err(other.wrong("this element is unknown or not supported"));
    }
    root.refuse_others("model", "xmlns schemaLocation")?;
    // Settings of the whole file
    let compiler = Compiler::from_root(&root)?;
    let root = replicated::replicated(&root, &compiler)?;
    let sections = |tag: &'static str| root.all(tag);
    let classes = Classes::from_root(&root)?;
    let mut notes = RobotNotes::default();
    let (options, flags) = rest::options(&root, &mut notes)?;
    let robot = Robot::new(root.own("model").unwrap_or(""), options);
    let mut reader = MjcfReader {
        reading,
        compiler,
        classes,
        meshes: HashMap::new(),
        materials: HashMap::new(),
        files: HashMap::new(),
        fields: HashMap::new(),
        flat: BTreeSet::new(),
        unseen: BTreeSet::new(),
        matter: Vec::new(),
        timed: Vec::new(),
        has_ground: false,
        flags,
        notes,
        robot,
    };
    // Assets before bodies, bodies before what refers to them
    for asset in sections("asset") {
        reader.read_assets(asset)?;
    }
    reader.read_world(&root)?;
    reader.set_masses()?;
    reader.set_springs()?;
    for contact in sections("contact") {
        reader.read_contact(contact)?;
    }
    let mut tendons = reader.read_tendons(&root)?;
    for equality in sections("equality") {
        reader.read_equality(equality, &tendons)?;
    }
    for actuator in sections("actuator") {
        reader.read_actuators(actuator, &mut tendons)?;
    }
    for keys in sections("keyframe") {
        reader.read_keys(keys)?;
    }
    // Sections without effect on the motion
    for tag in ["visual", "statistic", "custom", "sensor", "size"] {
        for section in sections(tag) {
            reader.notes.idle(&section.tag);
        }
    }
    for extension in sections("extension") {
        if let Some(plugin) = extension.children.first() {
            return Err(plugin.wrong("plugins are not supported"));
        }
    }
    reader.retain_visuals_of_meshed_links();
    reader.note_unused();
    reader.robot.notes = reader.notes.sentences();
    Ok(reader.robot)
}

impl MjcfReader<'_> {
    /// Element with the defaults of its class, or of the class of its body.
    fn defaulted<'e>(&self, element: &'e Element, childclass: &str) -> Parsed<Defaulted<'e>> {
        self.classes.apply(element, childclass)
    }

    /// Notes that an element has one of the attributes `soft` of soft contacts.
    fn note_soft(&mut self, read: &Defaulted<'_>, soft: &str) {
        if soft.split(' ').any(|name| read.get(name).is_some()) {
            self.notes.soft();
        }
    }

    /// Index of the link with this name.
    fn link(&self, element: &Element, field: &str, name: &str) -> Parsed<usize> {
        let names = self.robot.links.iter().map(|link| &*link.name);
        self.robot.link(name).ok_or_else(|| unknown(element, field, "body", name, names))
    }

    /// Index of the joint with this name.
    fn joint(&self, element: &Element, field: &str, name: &str) -> Parsed<usize> {
        let names = self.robot.joints.iter().map(|joint| &*joint.name);
        self.robot.joint(name).ok_or_else(|| unknown(element, field, "joint", name, names))
    }
}

/// Error about a `name` that no `kind` of the file has.
fn unknown<'n>(
    element: &Element,
    field: &str,
    kind: &str,
    name: &str,
    names: impl Iterator<Item = &'n str>,
) -> String {
    let (hint, name) = (nearest::hint(name, names), shown::line(name));
    element.wrong(format!("{field}: there is no {kind} {name:?}{hint}"))
}
