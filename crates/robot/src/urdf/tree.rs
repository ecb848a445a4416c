//! Tree of the links and joints of a URDF file.

use crate::xml::{Attributes, Element, Parsed};
use std::collections::HashMap;
use tumble_model::shown;

/// Maximum number of links.
const MOST_LINKS: usize = 2000;

/// Links and joints by name, and the parent-child relations.
pub(super) struct LinkTree<'e> {
    pub links: HashMap<&'e str, &'e Element>,
    /// Joints below each link, in the order of the file.
    pub below: HashMap<&'e str, Vec<&'e Element>>,
    pub root: &'e Element,
}

impl<'e> LinkTree<'e> {
    pub(super) fn from_root(root: &'e Element) -> Parsed<Self> {
        let mut links = HashMap::new();
        for link in root.all("link") {
            if links.insert(link.needed("name")?, link).is_some() {
                return Err(link.wrong("this name is used twice; each link needs its own"));
            }
            if links.len() > MOST_LINKS {
                return Err(link.wrong(format!("there are more than {MOST_LINKS} links")));
            }
        }
        // Joints below each link. A child has one parent.
        let (mut below, mut parents) = (HashMap::<_, Vec<_>>::new(), HashMap::new());
        let mut names = HashMap::new();
        for joint in root.all("joint") {
            if names.insert(joint.needed("name")?, ()).is_some() {
                return Err(joint.wrong("this name is used twice; each joint needs its own"));
            }
            let (parent, child) = (end(joint, "parent")?, end(joint, "child")?);
            for link in [parent, child] {
                if !links.contains_key(link) {
                    return Err(joint.wrong(format!("there is no link {:?}", shown::line(link))));
                }
            }
            if parents.insert(child, parent).is_some() {
                let child = shown::line(child);
                return Err(
                    joint.wrong(format!("{child:?} already has a parent; only one is allowed"))
                );
            }
            below.entry(parent).or_default().push(joint);
        }
        // Exactly one link has no parent.
        let mut roots =
            root.all("link").filter(|link| !parents.contains_key(link.own("name").unwrap_or("")));
        let first = roots.next();
        if let Some(second) = roots.next() {
            return Err(second
                .wrong("it is a second root: no joint has it as its child; one root is needed"));
        }
        match first {
            Some(root) => Ok(Self { links, below, root }),
            None => Err(root.wrong("every link is the child of a joint; one root is needed")),
        }
    }
}

/// Link named by the only element `tag` of a joint.
pub(super) fn end<'e>(joint: &'e Element, tag: &str) -> Parsed<&'e str> {
    let element = joint.one(tag)?.ok_or_else(|| joint.wrong(format!("<{tag}> is needed")))?;
    element.needed("link")
}
