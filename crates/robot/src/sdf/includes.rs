//! `<include>`: replaces the element by the model of another file.

use crate::Reading;
use crate::notes::RobotNotes;
use crate::xml::{Element, LARGEST_FILE, Parsed};

/// Maximum number of included files.
const MOST_FILES: usize = 200;
/// Maximum number of elements in all files.
const MOST_ELEMENTS: usize = 200_000;

/// Reader of included files.
pub struct Includes<'a> {
    reading: &'a Reading<'a>,
    notes: &'a mut RobotNotes,
    files: usize,
    elements: usize,
}

impl<'a> Includes<'a> {
    pub fn new(reading: &'a Reading<'a>, notes: &'a mut RobotNotes) -> Self {
        Self { reading, notes, files: 0, elements: 0 }
    }

    /// Replaces all includes below an `<sdf>`, a `<world>` or a `<model>`. Files that cannot be
    /// read become notes.
    pub fn expand(&mut self, element: &mut Element) -> Parsed<()> {
        for mut child in std::mem::take(&mut element.children) {
            if child.tag == "include" {
                element.children.extend(self.model(&child)?);
                continue;
            }
            if ["world", "model"].contains(&&*child.tag) {
                self.expand(&mut child)?;
            }
            element.children.push(child);
        }
        Ok(())
    }

    fn model(&mut self, include: &Element) -> Parsed<Option<Element>> {
        let uri = include.one("uri")?.ok_or_else(|| include.wrong("<uri> is needed"))?;
        let uri = uri.text.trim_end_matches('/');
        if matches!(include.own("merge"), Some("true" | "1")) {
            return Err(include.wrong("merge is not supported; include the model without it"));
        }
        let file = if uri.ends_with(".sdf") { uri.to_owned() } else { format!("{uri}/model.sdf") };
        // Files may include each other, so their number and size are bounded.
        self.files += 1;
        if self.files > MOST_FILES {
            return Err(include.wrong(format!(
                "more than {MOST_FILES} files are included; they may include each other"
            )));
        }
        let text = match self.reading.text(&file, LARGEST_FILE) {
            Ok(text) => text,
            Err(why) => {
                self.notes.say(format!("an included model is ignored: {why}"));
                return Ok(None);
            }
        };
        let root = Element::parse(&text, Some(&file))?;
        self.elements += root.count();
        if self.elements > MOST_ELEMENTS {
            return Err(include.wrong(format!("there are more than {MOST_ELEMENTS} elements")));
        }
        let model = root.all("model").next().filter(|_| root.tag == "sdf");
        let mut model =
            model.ok_or_else(|| root.wrong("an <sdf> with a <model> is needed"))?.clone();
        // Paths in the file are relative to its folder.
        let folder = file.rsplit_once('/').map_or("", |(folder, _)| folder);
        in_folder(&mut model, folder);
        self.expand(&mut model)?;
        // Fields of the include replace those of the model.
        for field in &include.children {
            match &*field.tag {
                "name" => set(&mut model, "name", &field.text),
                "placement_frame" => set(&mut model, "placement_frame", &field.text),
                "pose" | "static" => {
                    model.children.retain(|child| child.tag != field.tag);
                    model.children.push(field.clone());
                }
                "uri" => {}
                tag => self.notes.unknown(format!("<{tag}> in <include>")),
            }
        }
        Ok(Some(model))
    }
}

fn set(element: &mut Element, name: &str, value: &str) {
    element.attributes.retain(|(known, _)| known != name);
    element.attributes.push((name.to_owned(), value.to_owned()));
}

/// Makes relative addresses in an included file relative to the folder of the first file.
fn in_folder(element: &mut Element, folder: &str) {
    let is_relative = !element.text.contains("://") && !element.text.starts_with('/');
    if element.tag == "uri" && is_relative && !folder.is_empty() {
        element.text = format!("{folder}/{}", element.text);
    }
    element.children.iter_mut().for_each(|child| in_folder(child, folder));
}
