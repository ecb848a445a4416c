//! Parser of run.json.

use super::checksums::{Seal, seal_of};
use super::{FORMAT, Failure, RunFile};
use crate::document::Document;
use crate::written;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::ffi::OsStr;
use std::path::Path;
use tumble_model::{fields, shown};

/// Format of a file, which any version can read.
#[derive(Deserialize)]
struct FileFormat {
    #[serde(default = "first")]
    format: u32,
    tumble_version: Option<String>,
}

fn first() -> u32 {
    1
}

/// Writes a document without the fields that are not given.
pub(super) fn write_model<S: Serializer>(
    model: &Document,
    serializer: S,
) -> Result<S::Ok, S::Error> {
    written::table(model).map_err(serde::ser::Error::custom)?.serialize(serializer)
}

/// Reads a document that has no files.
pub(super) fn read_model<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Document, D::Error> {
    let document = Document::deserialize(deserializer)?;
    document.exact().map_err(serde::de::Error::custom)
}

/// Maximum length of a name or word (characters).
const LONGEST_WORD: usize = 80;

impl RunFile {
    /// Parses the `text` of the file `path`.
    ///
    /// # Errors
    /// A text that is not a run.json.
    pub fn from_text(text: &str, path: &Path) -> Result<Self, Failure> {
        let invalid = |why: &dyn std::fmt::Display| {
            Failure::Input(format!("{} is not a run.json: {why}", shown::path(path)))
        };
        if let Ok(FileFormat { format, tumble_version }) = serde_json::from_str(text)
            && format != FORMAT
        {
            let of = tumble_version.map(|version| format!(" of tumble {version}"));
            return Err(invalid(&format!(
                "its format{} is {format}, and this tumble reads format {FORMAT}; run the scene again",
                shown::line(&of.unwrap_or_default())
            )));
        }
        let mut file: Self =
            fields::json(text).map_err(|why| match why.strip_prefix("model: ") {
                // The model's own error begins with a field.
                Some(why) => invalid(&format!("model.{why}")),
                None => invalid(&why),
            })?;
        file.seal = seal_of(text);
        if let Some(field) = file.missing() {
            return Err(invalid(&format!("missing field `{field}`")));
        }
        match file.long_word() {
            None => Ok(file),
            Some(field) => {
                Err(invalid(&format!("{field}: it has more than {LONGEST_WORD} characters")))
            }
        }
    }

    /// Names of the files listed in the `text` of a run.json; empty if the text was changed.
    pub fn listed_files(text: &str) -> Vec<String> {
        if seal_of(text) == Seal::Broken {
            return Vec::new();
        }
        let Ok(run) = fields::json::<Self>(text) else { return Vec::new() };
        let is_name = |name: &String| Path::new(name).file_name() == Some(OsStr::new(name));
        run.files.into_iter().filter(is_name).collect()
    }

    /// First required field that is missing.
    fn missing(&self) -> Option<&'static str> {
        let fields = [
            ("kept.every", self.kept.every == 0),
            ("substeps", self.substeps == 0),
            ("joints", self.joints.is_none() && self.model.joint_names().next().is_some()),
        ];
        fields.iter().find(|(_, missing)| *missing).map(|(field, _)| *field)
    }

    /// First field that is too long for a title or table.
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
