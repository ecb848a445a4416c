//! What of a file is to be left out, as its user says.

use super::xml::Element;
use std::collections::BTreeSet;
use tumble_model::shown;

/// Attributes by which elements refer to others, and to what kind.
const REFERENCES: [(&str, &str); 11] = [
    ("joint", "joint"),
    ("joint1", "joint"),
    ("joint2", "joint"),
    ("jointinparent", "joint"),
    ("tendon", "tendon"),
    ("tendon1", "tendon"),
    ("body1", "body"),
    ("body2", "body"),
    ("geom1", "geom"),
    ("geom2", "geom"),
    ("hfield", "hfield"),
];

/// The kind of what can be referred to.
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

/// Kinds and names of what is gone.
type Gone = BTreeSet<(&'static str, String)>;

/// `root` without what `left_out` names: `tag` or `name` of elements, `tag:name` of one, `@attribute` of all. What refers
/// to such elements goes too, and poses where a joint does.
///
/// # Errors
/// A name that nothing has.
pub fn pruned(root: &Element, left_out: &[String]) -> Result<Element, String> {
    let mut root = root.clone();
    for said in left_out {
        let mut gone = Gone::new();
        let found = match said.strip_prefix('@') {
            Some(attribute) => strip(&mut root, attribute),
            None => prune(&mut root, &mut gone, &|element| is_meant(element, said)),
        };
        if found == 0 {
            return Err(format!("leave_out: there is no {:?} in the file", shown::line(said)));
        }
        while !gone.is_empty() {
            let is_gone = |kind: &str, name: &str| {
                gone.iter().any(|(known, one)| *known == kind && one == name)
            };
            let has_joint = gone.iter().any(|(kind, _)| *kind == "joint");
            let refers = |element: &Element| {
                let to = |(field, kind): &(&str, &str)| {
                    element.own(field).is_some_and(|name| is_gone(kind, name))
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

fn is_meant(element: &Element, said: &str) -> bool {
    match said.split_once(':') {
        Some((tag, name)) => element.tag == tag && element.own("name") == Some(name),
        None => element.tag == said || element.own("name") == Some(said),
    }
}

/// Takes out the elements that are meant, and says how many; they, and all in them, are `gone`.
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

/// Notes what is gone with an element; what has no name too.
fn note(element: &Element, gone: &mut Gone) {
    gone.extend(
        kind(&element.tag).map(|kind| (kind, element.own("name").unwrap_or("").to_owned())),
    );
    element.children.iter().for_each(|child| note(child, gone));
}

/// Takes an attribute from all elements, and says from how many.
fn strip(element: &mut Element, attribute: &str) -> usize {
    let before = element.attributes.len();
    element.attributes.retain(|(name, _)| name != attribute);
    let taken = before - element.attributes.len();
    taken + element.children.iter_mut().map(|child| strip(child, attribute)).sum::<usize>()
}
