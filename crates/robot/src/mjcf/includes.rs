//! `<include>`: replaces the element by the content of another file.

use crate::Reading;
use crate::xml::{Attributes, Element, LARGEST_FILE, Parsed};

/// Maximum number of included files.
const MOST_FILES: usize = 100;
/// Maximum number of elements in all files.
const MOST_ELEMENTS: usize = 200_000;

/// Copy of `root` with all includes expanded.
pub fn spliced(root: &Element, reading: &Reading<'_>) -> Parsed<Element> {
    let mut included = Included { reading, files: Vec::new(), elements: root.count() };
    let mut root = root.clone();
    root.children = included.children(std::mem::take(&mut root.children))?;
    Ok(root)
}

struct Included<'a> {
    reading: &'a Reading<'a>,
    files: Vec<String>,
    elements: usize,
}

impl Included<'_> {
    fn children(&mut self, children: Vec<Element>) -> Parsed<Vec<Element>> {
        let mut all = Vec::with_capacity(children.len());
        for mut child in children {
            if child.tag == "include" {
                all.extend(self.file(&child)?);
            } else {
                child.children = self.children(std::mem::take(&mut child.children))?;
                all.push(child);
            }
        }
        Ok(all)
    }

    fn file(&mut self, include: &Element) -> Parsed<Vec<Element>> {
        include.refuse_others("file", "")?;
        let name = include.needed("file")?;
        if self.files.iter().any(|known| known == name) {
            return Err(include.wrong("this file is already included; include it once"));
        }
        if self.files.len() == MOST_FILES {
            return Err(include.wrong(format!("there are more than {MOST_FILES} files")));
        }
        self.files.push(name.to_owned());
        let text = self.reading.text(name, LARGEST_FILE).map_err(|why| include.wrong(why))?;
        let root = Element::parse(&text, Some(name))?;
        self.elements += root.count();
        if self.elements > MOST_ELEMENTS {
            return Err(include.wrong(format!("there are more than {MOST_ELEMENTS} elements")));
        }
        if !["mujoco", "mujocoinclude"].contains(&&*root.tag) {
            return Err(root.wrong("<mujoco> or <mujocoinclude> is needed in an included file"));
        }
        self.children(root.children)
    }
}
