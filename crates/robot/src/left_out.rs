//! Removal of the parts of a file that the user excludes.

use super::xml::{Element, Parsed};
use std::collections::BTreeSet;
use tumble_model::shown;

/// Kinds of elements, and the attributes that refer to one, separated by spaces.
const REFERENCES: [(&str, &str); 5] = [
    ("joint", "joint joint1 joint2 jointinparent"),
    ("tendon", "tendon tendon1"),
    ("body", "body1 body2"),
    ("geom", "geom1 geom2"),
    ("hfield", "hfield"),
];

/// Kind of an element that others can refer to.
fn kind(tag: &str) -> Option<&'static str> {
    match tag {
        "body" => Some("body"),
        "joint" | "freejoint" => Some("joint"),
        "geom" => Some("geom"),
        "fixed" | "spatial" => Some("tendon"),
        "hfield" => Some("hfield"),
        _ => None,
    }
}

/// Kinds and names of removed elements.
type Gone = BTreeSet<(&'static str, String)>;

/// Copy of `root` without the elements and attributes listed in `left_out`.
///
/// An entry is the `tag` or `name` of elements, `tag:name` of one element, or `@attribute` for all
/// elements. Elements that refer to a removed element are removed too. Keyframes are removed with
/// any joint.
///
/// # Errors
/// An entry that matches nothing.
pub fn pruned(root: &Element, left_out: &[String]) -> Parsed<Element> {
    let mut root = root.clone();
    for requested in left_out {
        let mut gone = Gone::new();
        let found = match requested.strip_prefix('@') {
            Some(attribute) => strip(&mut root, attribute),
            None => prune(&mut root, &mut gone, &|element| is_meant(element, requested)),
        };
        if found == 0 {
            return Err(format!("leave_out: there is no {:?} in the file", shown::line(requested)));
        }
        while !gone.is_empty() {
            let is_gone = |kind: &str, name: &str| {
                gone.iter().any(|(known, one)| *known == kind && one == name)
            };
            let has_joint = gone.iter().any(|(kind, _)| *kind == "joint");
            let refers = |element: &Element| {
                let to = |(kind, fields): &(&str, &str)| {
                    let mut names = fields.split(' ').filter_map(|field| element.own(field));
                    names.any(|name| is_gone(kind, name))
                };
                REFERENCES.iter().any(to) || element.tag == "key" && has_joint
            };
            let mut further = Gone::new();
            prune(&mut root, &mut further, &refers);
            gone = further;
        }
    }
    Ok(root)
}

fn is_meant(element: &Element, requested: &str) -> bool {
    match requested.split_once(':') {
        Some((tag, name)) => element.tag == tag && element.own("name") == Some(name),
        None => element.tag == requested || element.own("name") == Some(requested),
    }
}

/// Removes the elements selected by `is_meant` and returns their number. Adds them and their
/// descendants to `gone`.
fn prune(element: &mut Element, gone: &mut Gone, is_meant: &dyn Fn(&Element) -> bool) -> usize {
    let before = element.children.len();
    element.children.retain(|child| {
        let goes = is_meant(child);
        if goes {
            note(child, gone);
        }
        !goes
    });
    let taken = before - element.children.len();
    taken + element.children.iter_mut().map(|child| prune(child, gone, is_meant)).sum::<usize>()
}

/// Adds an element and its descendants to `gone`. A missing name counts as empty.
fn note(element: &Element, gone: &mut Gone) {
    gone.extend(
        kind(&element.tag).map(|kind| (kind, element.own("name").unwrap_or("").to_owned())),
    );
    element.children.iter().for_each(|child| note(child, gone));
}

/// Removes an attribute from all elements and returns the number of elements that had it.
fn strip(element: &mut Element, attribute: &str) -> usize {
    let before = element.attributes.len();
    element.attributes.retain(|(name, _)| name != attribute);
    let taken = before - element.attributes.len();
    taken + element.children.iter_mut().map(|child| strip(child, attribute)).sum::<usize>()
}
