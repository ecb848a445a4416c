//! A run.json that is read.

use super::checksums::seal_of;
use super::{Failure, Kind, RunFile};
use crate::scenario::{fields, shown};
use std::io;
use std::path::Path;

/// Characters of a name or a word.
const LONGEST_WORD: usize = 80;

impl RunFile {
    /// What the `text` of the file `path` says; `None` where there is no such file. Where there is none with
    /// a model, `lonely` may refuse what it should stand beside.
    ///
    /// # Errors
    /// What is no run.json.
    pub fn read(
        text: io::Result<String>,
        path: &Path,
        lonely: impl FnOnce() -> Result<(), Failure>,
    ) -> Result<Option<Self>, Failure> {
        let odd = |why: &dyn std::fmt::Display| {
            Failure::Input(format!("{} is not a run.json: {why}", shown::path(path)))
        };
        let kind = text.as_ref().ok().and_then(|text| serde_json::from_str(text).ok());
        if !matches!(kind, Some(Kind { model: Some(_) })) {
            lonely()?;
        }
        let text = match text {
            Ok(text) => text,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            Err(error) => return Err(odd(&error)),
        };
        let mut file: Self = fields::json(&text).map_err(|why| odd(&why))?;
        file.seal = seal_of(&text);
        if let Some(field) = file.missing() {
            return Err(odd(&format!("missing field `{field}`")));
        }
        match file.long_word() {
            None => Ok(Some(file)),
            Some(field) => {
                Err(odd(&format!("{field}: it has more than {LONGEST_WORD} characters")))
            }
        }
    }

    fn has_joints(&self) -> bool {
        self.model.as_ref().is_some_and(|model| !model.joints.is_empty())
    }

    /// The first field that its format has, and it has not.
    fn missing(&self) -> Option<&'static str> {
        let of_model = [
            ("kept.every", self.kept.every == 0),
            ("drawn", self.drawn.is_none()),
            ("steps", self.steps.is_none()),
            ("largest_overlap_m", self.largest_overlap_m.is_none()),
            ("joints", self.joints.is_none() && self.has_joints()),
        ];
        let of_one = [
            ("kept.every", self.kept.every == 0),
            ("parameters", self.parameters.is_none()),
            ("start", self.start.is_none()),
        ];
        let fields = if self.model.is_some() { &of_model[..] } else { &of_one };
        fields.iter().find(|(_, missing)| *missing).map(|(field, _)| *field)
    }

    /// The first field that is too long for a title or a table.
    fn long_word(&self) -> Option<&'static str> {
        let solver = &self.solver;
        let words = [
            ("outcome", Some(&self.outcome)),
            ("tumble_version", Some(&self.tumble_version)),
            ("ipopt_version", Some(&self.ipopt_version)),
            ("scene", Some(&self.scene)),
            ("solver.name", Some(&solver.name)),
            ("solver.preset", solver.preset.as_ref()),
            ("solver.detection", solver.detection.as_ref()),
            ("solver.on_failure", solver.on_failure.as_ref()),
        ];
        let words = words.into_iter().filter_map(|(field, word)| Some((field, word?)));
        let changed = self.changed.iter().map(|word| ("changed", word));
        words
            .chain(changed)
            .find(|(_, word)| word.chars().count() > LONGEST_WORD)
            .map(|(field, _)| field)
    }
}
