//! Default classes: default attributes of elements.

use crate::xml::{Attributes, Element, Parsed, is_listed};
use std::collections::HashMap;
use tumble_model::shown;

/// Attributes by the kind of element.
type Values = HashMap<&'static str, Vec<(String, String)>>;

/// Kinds with relevant defaults. All actuators share one.
fn kind(tag: &str) -> Option<&'static str> {
    match tag {
        "geom" => Some("geom"),
        "joint" => Some("joint"),
        "site" => Some("site"),
        "mesh" => Some("mesh"),
        "equality" => Some("equality"),
        "tendon" => Some("tendon"),
        "pair" => Some("pair"),
        "motor" | "position" | "velocity" | "general" | "intvelocity" | "damper" | "cylinder"
        | "muscle" | "adhesion" | "plugin" | "pid" | "dcmotor" => Some("actuator"),
        _ => None,
    }
}

/// Elements with irrelevant defaults.
const IDLE: &str = "camera light material skin";

/// Name of the unnamed class.
const MAIN: &str = "main";

/// Default classes of a file.
#[derive(Debug)]
pub struct Classes(HashMap<String, Values>);

impl Classes {
    /// Classes of the `<default>` sections.
    pub fn from_root(root: &Element) -> Parsed<Self> {
        let mut classes = Self(HashMap::new());
        classes.0.insert(MAIN.to_owned(), Values::new());
        for section in root.all("default") {
            section.refuse_others("class", "")?;
            classes.add(section, section.own("class").unwrap_or(MAIN), None)?;
        }
        Ok(classes)
    }

    /// Adds a class, which inherits from `parent`, and its nested classes.
    fn add(&mut self, element: &Element, name: &str, parent: Option<&str>) -> Parsed<()> {
        if parent.is_some() && self.0.contains_key(name) {
            return Err(element.wrong("this class name is used twice; each class needs its own"));
        }
        let inherited = self.0.get(parent.unwrap_or(name)).or_else(|| self.0.get(MAIN));
        let mut values = inherited.cloned().unwrap_or_default();
        for child in element.children.iter().filter(|child| child.tag != "default") {
            let Some(kind) = kind(&child.tag) else {
                if is_listed(&child.tag, IDLE) {
                    continue;
                }
                return Err(child.wrong("defaults of this element are unknown"));
            };
            let own = values.entry(kind).or_default();
            for (attribute, value) in &child.attributes {
                own.retain(|(known, _)| known != attribute);
                own.push((attribute.clone(), value.clone()));
            }
        }
        // The top-level class may have any name and is also the main class.
        if parent.is_none() {
            self.0.insert(MAIN.to_owned(), values.clone());
        }
        self.0.insert(name.to_owned(), values);
        for child in element.all("default") {
            child.refuse_others("class", "")?;
            self.add(child, child.needed("class")?, Some(name))?;
        }
        Ok(())
    }

    /// Element with the defaults of its class. The fallbacks are `childclass`, then the main class.
    pub fn apply<'e>(&self, element: &'e Element, childclass: &str) -> Parsed<Defaulted<'e>> {
        let name = match element.own("class") {
            Some(own) => own,
            None if childclass.is_empty() => MAIN,
            None => childclass,
        };
        let class = self.0.get(name).ok_or_else(|| {
            element.wrong(format!("there is no default class {:?}", shown::line(name)))
        })?;
        let of = match &*element.tag {
            "connect" | "weld" => Some("equality"),
            "fixed" | "spatial" => Some("tendon"),
            tag => kind(tag),
        };
        let defaults = of.and_then(|kind| class.get(kind)).cloned().unwrap_or_default();
        Ok(Defaulted { element, defaults })
    }

    /// True if a class has this name.
    pub fn knows(&self, name: &str) -> bool {
        self.0.contains_key(name)
    }
}

/// An element and its defaults.
#[derive(Debug)]
pub struct Defaulted<'e> {
    element: &'e Element,
    defaults: Vec<(String, String)>,
}

impl Defaulted<'_> {
    /// Element with the default attributes only.
    pub fn defaults(&self) -> Element {
        Element { attributes: self.defaults.clone(), children: Vec::new(), ..self.element.clone() }
    }
}

impl Attributes for Defaulted<'_> {
    fn element(&self) -> &Element {
        self.element
    }

    fn get(&self, name: &str) -> Option<&str> {
        let usual = || self.defaults.iter().find(|(known, _)| known == name);
        self.element.own(name).or_else(|| usual().map(|(_, value)| value.as_str()))
    }
}
