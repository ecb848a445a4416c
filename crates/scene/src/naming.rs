//! Error messages with the names of a scene.

use super::scene::Scene;
use tumble_core::error::Error;

impl Scene {
    /// Error message with names of bodies, fixed pieces and joints instead of their indices.
    #[must_use]
    pub fn naming(&self, error: &Error) -> String {
        let joint = |index: &usize| {
            (format!("joint {index}"), self.joints.get(*index).map(|name| format!("joint {name}")))
        };
        let (unnamed, named) = match error {
            Error::Overlap { between: (first, second), .. } => {
                let names = format!("{} and {}", self.partner(*first), self.partner(*second));
                (format!("{first} and {second}"), Some(names))
            }
            Error::JointApart { joint: index, .. }
            | Error::JointBeyond { joint: index, .. }
            | Error::NotAssembled { joint: index, .. } => joint(index),
            Error::Tied { body, joint: index } => {
                let (unnamed, named) = joint(index);
                let name = self.bodies.get(*body);
                let named =
                    name.zip(named).map(|(body, joint)| format!("{body} is attached to {joint}"));
                (format!("body {body} is attached to {unnamed}"), named)
            }
            _ => return error.to_string(),
        };
        let said = error.to_string();
        let rest = said.strip_prefix(&unnamed);
        named.zip(rest).map_or_else(|| said.clone(), |(named, rest)| named + rest)
    }
}
