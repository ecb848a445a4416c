//! Names of elements and attributes of a format, to find misspelt ones.

use crate::notes::RobotNotes;
use crate::xml::{Element, Parsed};
use tumble_model::nearest;
use tumble_model::shown;

/// Names in an element: its tag, elements that are read, elements that do not affect the motion, and
/// attributes. Lists are separated by spaces.
pub type ElementNames = [&'static str; 4];

/// Names of URDF in the elements that affect the motion.
pub(super) const NAMES: [ElementNames; 22] = [
    ["robot", "link joint", "material gazebo transmission sensor loop_joint group", "name version"],
    [
        "link",
        "inertial collision",
        "visual contact gazebo sensor self_collision_checking verbose",
        "name type",
    ],
    [
        "joint",
        "origin parent child axis limit dynamics mimic",
        "safety_controller calibration gazebo hardwareInterface",
        "name type",
    ],
    ["inertial", "origin mass inertia density", "", ""],
    ["collision", "origin geometry", "material verbose contact_coefficients", "name group concave"],
    ["geometry", FORMS, "", ""],
    ["box", "", "", "size"],
    ["sphere", "", "", "radius"],
    ["cylinder", "", "", "radius length"],
    ["capsule", "", "", "radius length"],
    ["cone", "", "", "radius length"],
    ["ellipsoid", "", "", "radii"],
    ["mesh", "", "", "filename scale"],
    ["origin", "", "", "xyz rpy"],
    ["axis", "", "", "xyz"],
    ["parent", "", "", "link"],
    ["child", "", "", "link"],
    ["mass", "", "", "value"],
    ["inertia", "", "", "ixx ixy ixz iyy iyz izz"],
    ["limit", "", "", "lower upper effort velocity"],
    ["dynamics", "", "", "damping friction"],
    ["mimic", "", "", "joint multiplier offset"],
];

/// Geometry that is read.
pub const FORMS: &str = "box sphere cylinder capsule cone ellipsoid plane mesh";

/// Checks the names in `element` and below against `table`. Unknown names become notes.
///
/// # Errors
/// A misspelt name, with its line.
pub fn check(element: &Element, table: &[ElementNames], notes: &mut RobotNotes) -> Parsed<()> {
    let names = table.iter().find(|names| names[0] == element.tag);
    let Some([tag, elements, idle, attributes]) = names else { return Ok(()) };
    let [elements, idle, attributes] =
        [elements, idle, attributes].map(|list| list.split(' ').collect::<Vec<_>>());
    for (name, _) in &element.attributes {
        if !attributes.contains(&&**name) {
            refuse_misspelt(name, &attributes, element)?;
            notes.unknown(format!("{} of <{tag}>", shown::line(name)));
        }
    }
    for child in &element.children {
        let name = &*child.tag;
        if elements.contains(&name) {
            check(child, table, notes)?;
        } else if idle.contains(&name) {
            notes.idle(name);
        } else {
            refuse_misspelt(name, &[&elements[..], &idle].concat(), child)?;
            notes.unknown(format!("<{}> in <{tag}>", shown::line(name)));
        }
    }
    Ok(())
}

/// Rejects a `name` at an element that is a slip of one of the `known` names.
fn refuse_misspelt(name: &str, known: &[&str], at: &Element) -> Parsed<()> {
    match nearest::misspelt(name, known.iter().copied()) {
        Some(meant) => {
            let name = shown::line(name);
            Err(at.wrong(format!("{name} is unknown; did you mean `{meant}`?")))
        }
        None => Ok(()),
    }
}
