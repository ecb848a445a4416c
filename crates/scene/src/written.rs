//! Text of a scene.
//!
//! Its numbers are exact: the world made of it has the same bits.

use super::bodies::terrain::TerrainEntry;
use super::document::Document;
use super::scene::Scene;
use std::fmt::Write as _;
use toml::{Table, Value};
use tumble_model::failure::Failure;

/// First line of a scenario file that may be replaced.
pub const HEAD: &str = "# Written by tumble, which may replace this file.\n";

/// Scenario file that reproduces this scene except for its solver.
///
/// # Errors
/// A terrain that cannot be packed.
pub fn text(scene: &Scene) -> Result<String, Failure> {
    let mut document = Document {
        name: Some(scene.name.clone()),
        steps: Some(scene.rows),
        start_index: Some(scene.start_index).filter(|index| *index > 0),
        ..scene.document.clone()
    };
    // The draws of a seed are numbers in a file.
    document.bodies.iter_mut().for_each(|body| body.drawn = None);
    toml_text(&document)
}

/// TOML text of a document: plain fields, then tables, then lists of tables, each field in a line.
///
/// # Errors
/// A terrain that cannot be packed.
pub fn toml_text(document: &Document) -> Result<String, Failure> {
    let (mut out, mut tables) = (String::new(), String::new());
    // Writing to a string cannot fail.
    for (name, value) in &table(document)? {
        let is_list = |entries: &[Value]| entries.first().is_some_and(Value::is_table);
        match value {
            Value::Table(table) => {
                let _ = writeln!(tables, "\n[{name}]");
                fields(&mut tables, table);
            }
            Value::Array(entries) if is_list(entries) => {
                for table in entries.iter().filter_map(Value::as_table) {
                    let _ = writeln!(tables, "\n[[{name}]]");
                    fields(&mut tables, table);
                }
            }
            value => {
                let _ = writeln!(out, "{name} = {value}");
            }
        }
    }
    Ok(out + &tables)
}

fn fields(out: &mut String, table: &Table) {
    for (field, value) in table {
        let _ = writeln!(out, "{field} = {value}");
    }
}

/// Document as a table.
///
/// # Errors
/// A terrain that cannot be packed.
pub fn table(document: &Document) -> Result<Table, Failure> {
    let mut document = document.clone();
    document.terrain.iter_mut().try_for_each(TerrainEntry::pack).map_err(Failure::Other)?;
    Table::try_from(&document).map_err(|error| Failure::Other(error.to_string()))
}

/// TOML string.
pub fn quoted(text: &str) -> String {
    Value::from(text).to_string()
}
