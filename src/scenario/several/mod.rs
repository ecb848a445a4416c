//! Scenarios of several bodies: files with `[[bodies]]`.

mod copies;
mod entries;
pub mod job;
mod masses;
pub mod model;
mod refused;
mod scene;
pub mod shape;

pub use entries::ReadFile;

/// Whether a scenario's text is of several bodies: whether it has a table that one body's has not.
pub fn is_scenario(text: &str) -> bool {
    let table: Result<toml::Table, _> = toml::from_str(text);
    table.is_ok_and(|table| {
        table.contains_key("bodies") || (table.contains_key("fixed") && !table.contains_key("body"))
    })
}
