//! `tumble schema`: prints the JSON Schema of scenario files.

use super::outcome::{Failure, Outcome};
use super::output;
use tumble_scene::Document;

/// Prints the schema.
pub fn run() -> Result<Outcome, Failure> {
    output::say(&format!("{:#}\n", Document::schema().to_value()))?;
    Ok(Outcome::Done)
}
