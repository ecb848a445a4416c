//! `<replicate>`: repeats its content, each copy in its own frame.

use super::compiler::Compiler;
use crate::frame::LinkFrame;
use crate::xml::{Attributes, Element, Parsed};
use nalgebra::Vector3;

/// Maximum number of generated elements.
const MOST_ELEMENTS: usize = 200_000;

/// Copy of `root` with each `<replicate>` expanded to a list of `<frame>`s.
pub fn replicated(root: &Element, compiler: &Compiler) -> Parsed<Element> {
    let mut root = root.clone();
    let mut copies = Copies { compiler, made: 0 };
    for world in root.children.iter_mut().filter(|section| section.tag == "worldbody") {
        world.children = copies.children(std::mem::take(&mut world.children))?;
    }
    Ok(root)
}

struct Copies<'a> {
    compiler: &'a Compiler,
    made: usize,
}

impl Copies<'_> {
    fn children(&mut self, children: Vec<Element>) -> Parsed<Vec<Element>> {
        let mut all = Vec::with_capacity(children.len());
        for mut child in children {
            child.children = self.children(std::mem::take(&mut child.children))?;
            match &*child.tag {
                "replicate" => all.extend(self.frames(&child)?),
                _ => all.push(child),
            }
        }
        Ok(all)
    }

    /// Frames with copies of the content of `element`. Copy k is rotated by k times the angles φ.
    /// Its position adds the offset o, rotated with the copies before it:
    ///
    /// ```text
    /// R_k = R(k φ),   p_{k+1} = p_k + R_k o,   p_0 = 0
    /// ```
    ///
    /// The number k is appended to names.
    fn frames(&mut self, element: &Element) -> Parsed<Vec<Element>> {
        element.refuse_others("count offset euler sep childclass", "")?;
        element.needed("count")?;
        let count = element.bounded("count", 0.0, [1.0, MOST_ELEMENTS as f64])?;
        let size = element.count();
        if count.fract() != 0.0 {
            return Err(element.wrong(format!("count is {count:?}; a whole number is needed")));
        }
        self.made = self.made.saturating_add(size.saturating_mul(count as usize));
        if self.made > MOST_ELEMENTS {
            return Err(element
                .wrong(format!("with its copies there are more than {MOST_ELEMENTS} elements")));
        }
        let offset = Vector3::from(element.exactly::<3>("offset")?.unwrap_or_default());
        let angles = element.exactly::<3>("euler")?.unwrap_or_default();
        let count = count as usize;
        let between = element.own("sep").unwrap_or("");
        let digits = (count - 1).to_string().len();
        let mut position = Vector3::zeros();
        let mut frames = Vec::with_capacity(count);
        // Frame k, with the number in the names of its content
        for number in 0..count {
            let attitude = self.compiler.euler(angles.map(|angle| angle * number as f64));
            let suffix = format!("{between}{number:0digits$}");
            let words = |numbers: &[f64]| {
                let words: Vec<_> = numbers.iter().map(|number| format!("{number:?}")).collect();
                words.join(" ")
            };
            let mut attributes = vec![
                ("pos".to_owned(), words(position.as_slice())),
                ("quat".to_owned(), words(attitude.as_slice())),
            ];
            let class = element.own("childclass");
            attributes.extend(class.map(|class| ("childclass".to_owned(), class.to_owned())));
            let children = element.children.iter().map(|child| named(child, &suffix)).collect();
            let tag = "frame".to_owned();
            let line = element.line;
            let file = element.file.clone();
            frames.push(Element { tag, attributes, children, text: String::new(), line, file });
            position += LinkFrame { attitude, ..LinkFrame::identity() }.rotation() * offset;
        }
        Ok(frames)
    }
}

/// Element with `suffix` appended to its name and to all names in it.
fn named(element: &Element, suffix: &str) -> Element {
    let mut own = element.clone();
    for (_, name) in own.attributes.iter_mut().filter(|(field, _)| field == "name") {
        name.push_str(suffix);
    }
    own.children = element.children.iter().map(|child| named(child, suffix)).collect();
    own
}
