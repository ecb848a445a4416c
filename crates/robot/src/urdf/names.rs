//! Names of elements and attributes of URDF, to find misspelt ones.

use crate::notes::RobotNotes;
use crate::xml::Element;
use tumble_model::nearest;
use tumble_model::shown;

/// Names that an element may contain.
struct ElementNames {
    tag: &'static str,
    /// Elements that are read.
    elements: &'static [&'static str],
    /// Elements that do not affect the motion.
    idle: &'static [&'static str],
    attributes: &'static [&'static str],
}

/// Names in the elements that affect the motion.
const NAMES: [ElementNames; 20] = [
    ElementNames {
        tag: "robot",
        elements: &["link", "joint"],
        idle: &["material", "gazebo", "transmission", "sensor", "loop_joint", "group"],
        attributes: &["name", "version"],
    },
    ElementNames {
        tag: "link",
        elements: &["inertial", "collision"],
        idle: &["visual", "contact", "gazebo", "sensor", "self_collision_checking", "verbose"],
        attributes: &["name", "type"],
    },
    ElementNames {
        tag: "joint",
        elements: &["origin", "parent", "child", "axis", "limit", "dynamics", "mimic"],
        idle: &["safety_controller", "calibration", "gazebo", "hardwareInterface"],
        attributes: &["name", "type"],
    },
    element("inertial", &["origin", "mass", "inertia", "density"], &[]),
    ElementNames {
        tag: "collision",
        elements: &["origin", "geometry"],
        idle: &["material", "verbose", "contact_coefficients"],
        attributes: &["name", "group", "concave"],
    },
    element("geometry", &["box", "sphere", "cylinder", "capsule", "mesh"], &[]),
    element("box", &[], &["size"]),
    element("sphere", &[], &["radius"]),
    element("cylinder", &[], &["radius", "length"]),
    element("capsule", &[], &["radius", "length"]),
    element("mesh", &[], &["filename", "scale"]),
    element("origin", &[], &["xyz", "rpy"]),
    element("axis", &[], &["xyz"]),
    element("parent", &[], &["link"]),
    element("child", &[], &["link"]),
    element("mass", &[], &["value"]),
    element("inertia", &[], &["ixx", "ixy", "ixz", "iyy", "iyz", "izz"]),
    element("limit", &[], &["lower", "upper", "effort", "velocity"]),
    element("dynamics", &[], &["damping", "friction"]),
    element("mimic", &[], &["joint", "multiplier", "offset"]),
];

const fn element(
    tag: &'static str,
    elements: &'static [&'static str],
    attributes: &'static [&'static str],
) -> ElementNames {
    ElementNames { tag, elements, idle: &[], attributes }
}

/// Checks the names in `element` and below. Other names than the known ones become notes.
///
/// # Errors
/// A misspelt name, with its line.
pub(super) fn check(element: &Element, notes: &mut RobotNotes) -> Result<(), String> {
    let Some(names) = NAMES.iter().find(|names| names.tag == element.tag) else { return Ok(()) };
    for (name, _) in &element.attributes {
        if !names.attributes.contains(&&**name) {
            refuse_misspelt(name, names.attributes, element)?;
            notes.unknown(format!("{} of <{}>", shown::line(name), names.tag));
        }
    }
    for child in &element.children {
        let tag = &*child.tag;
        if names.elements.contains(&tag) {
            check(child, notes)?;
        } else if names.idle.contains(&tag) {
            notes.idle(tag);
        } else {
            let known: Vec<_> = names.elements.iter().chain(names.idle).copied().collect();
            refuse_misspelt(tag, &known, child)?;
            notes.unknown(format!("<{}> in <{}>", shown::line(tag), names.tag));
        }
    }
    Ok(())
}

/// Rejects a `name` at an element that is a slip of one of the `known` names.
fn refuse_misspelt(name: &str, known: &[&str], at: &Element) -> Result<(), String> {
    match nearest::misspelt(name, known.iter().copied()) {
        Some(meant) => {
            let name = shown::line(name);
            Err(at.wrong(format!("{name} is unknown; did you mean `{meant}`?")))
        }
        None => Ok(()),
    }
}
