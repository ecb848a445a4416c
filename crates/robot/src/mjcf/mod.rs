//! MJCF, the format of MuJoCo.
//!
//! What changes the motion is read, or refused with its line; what does not is noted, all of it in a sentence.

mod actuators;
mod assets;
mod bodies;
mod compiler;
mod contacts;
mod defaults;
mod includes;
mod replicated;
mod rest;
mod shapes;
mod sites;
mod tendons;

use super::Reading;
use super::left_out::pruned;
use super::meshes::Hulled;
use super::model::{LinkMass, Robot, RobotOptions};
use super::notes::RobotNotes;
use super::xml::{Attributes, Element};
use compiler::Compiler;
use defaults::{Classes, Defaulted};
use nalgebra::Vector3;
use std::collections::{BTreeMap, BTreeSet, HashMap};

/// What may stand in the root of a file.
const SECTIONS: [&str; 16] = [
    "compiler",
    "option",
    "size",
    "visual",
    "statistic",
    "default",
    "custom",
    "asset",
    "worldbody",
    "contact",
    "equality",
    "tendon",
    "actuator",
    "sensor",
    "keyframe",
    "extension",
];

/// A file that is read.
struct MjcfReader<'a> {
    reading: &'a Reading<'a>,
    compiler: Compiler,
    classes: Classes,
    /// Meshes by their names; what is wrong with those that have no hull matters where they touch or weigh.
    meshes: HashMap<String, Result<Hulled, String>>,
    /// Files of meshes, and by how much their lengths along x, y and z are multiplied.
    files: HashMap<String, (String, [f64; 3])>,
    /// Those without a hull that are for the eye.
    flat: BTreeSet<String>,
    /// Links whose looks are not read.
    unseen: BTreeSet<usize>,
    /// What counts for the mass of each link; `None` where shapes do not.
    matter: Vec<Option<Vec<LinkMass>>>,
    /// Joints whose spring and damper follow from a time constant, s, and a ratio.
    timed: Vec<(usize, [f64; 2])>,
    /// Whether the ground is there.
    has_ground: bool,
    /// What of the motion is switched off.
    flags: rest::Flags,
    notes: RobotNotes,
    robot: Robot,
}

/// The robot of the text of a file.
///
/// # Errors
/// The first thing that is wrong, or that it would not move without, with its line.
pub fn read(root: &Element, reading: &Reading<'_>) -> Result<Robot, String> {
    let root = pruned(&includes::spliced(root, reading)?, reading.left_out)?;
    if let Some(odd) = root.children.iter().find(|section| !SECTIONS.contains(&&*section.tag)) {
        return Err(
            odd.wrong("this element is not known, or changes what moves, and is not supported")
        );
    }
    root.refuse_others(&["model"], &["xmlns", "schemaLocation"])?;
    let compiler = Compiler::of(&root)?;
    let root = replicated::replicated(&root, &compiler)?;
    let sections = |tag: &'static str| root.all(tag);
    let classes = Classes::of(&root)?;
    let mut notes = RobotNotes::default();
    let (options, flags) = rest::options(&root, &mut notes)?;
    let robot = Robot {
        name: root.own("model").unwrap_or("").to_owned(),
        links: Vec::new(),
        joints: Vec::new(),
        shapes: Vec::new(),
        looks: Vec::new(),
        sites: Vec::new(),
        actuators: Vec::new(),
        ties: Vec::new(),
        follows: Vec::new(),
        sums: Vec::new(),
        apart: Vec::new(),
        pairs: BTreeMap::new(),
        keys: Vec::new(),
        options,
        notes: Vec::new(),
    };
    let mut reader = MjcfReader {
        reading,
        compiler,
        classes,
        meshes: HashMap::new(),
        files: HashMap::new(),
        flat: BTreeSet::new(),
        unseen: BTreeSet::new(),
        matter: Vec::new(),
        timed: Vec::new(),
        has_ground: false,
        flags,
        notes,
        robot,
    };
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
    for tag in ["visual", "statistic", "custom", "sensor", "size"] {
        for section in sections(tag) {
            reader.notes.idle(&section.tag);
        }
    }
    for extension in sections("extension") {
        if let Some(plugin) = extension.children.first() {
            return Err(plugin.wrong("plugins are programs, and are not supported"));
        }
    }
    reader.keep_looks();
    reader.note_unused();
    reader.robot.notes = reader.notes.sentences();
    Ok(reader.robot)
}

impl MjcfReader<'_> {
    /// An element with what its class, or the class of its body, says.
    fn defaulted<'e>(
        &self,
        element: &'e Element,
        childclass: &str,
    ) -> Result<Defaulted<'e>, String> {
        self.classes.apply(element, childclass)
    }

    /// The link of a name.
    fn link(&self, element: &Element, field: &str, name: &str) -> Result<usize, String> {
        self.robot.link(name).ok_or_else(|| {
            element
                .wrong(format!("{field}: there is no body {:?}", tumble_model::shown::line(name)))
        })
    }

    /// The joint of a name.
    fn joint(&self, element: &Element, field: &str, name: &str) -> Result<usize, String> {
        self.robot.joint(name).ok_or_else(|| {
            element
                .wrong(format!("{field}: there is no joint {:?}", tumble_model::shown::line(name)))
        })
    }
}

/// What a file is without `<option>`.
fn usual_options() -> RobotOptions {
    RobotOptions {
        time_step: 0.002,
        gravity: Vector3::new(0.0, 0.0, -9.81),
        contacts: true,
        neighbours_touch: false,
        has_world: true,
    }
}
