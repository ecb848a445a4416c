//! Overrides of single fields of a scenario file, such as `ground.friction=0.4`.

use toml::{Table, Value};
use tumble_model::failure::Failure;

/// Flag of an override.
const FLAG: &str = "set";

/// An override: path of a field, and its value as TOML.
///
/// The path has the names of tables, separated by dots. An entry of a list of tables is chosen by
/// its `name` or its number from 0: `bodies.brick.mass`.
#[derive(Debug, Clone, PartialEq)]
pub struct FieldOverride {
    path: String,
    value: Value,
}

impl FieldOverride {
    /// Parses `PATH=VALUE`. A value that is not TOML is a vector if it has numbers joined by commas,
    /// and otherwise a text.
    ///
    /// # Errors
    /// Without a path or a value.
    pub fn parse(text: &str) -> Result<Self, String> {
        let fault =
            || format!("{text:?} is no field with a value; for example ground.friction=0.4");
        let (path, value) = text.split_once('=').ok_or_else(fault)?;
        let (path, value) = (path.trim(), value.trim());
        if value.is_empty() || path.split('.').any(str::is_empty) {
            return Err(fault());
        }
        let parsed = toml::from_str::<Table>(&format!("value = {value}"));
        let parsed = parsed.ok().and_then(|mut table| table.remove("value"));
        let parsed = parsed.or_else(|| vector(value));
        let value = parsed.unwrap_or_else(|| Value::String(value.to_owned()));
        Ok(Self { path: path.to_owned(), value })
    }

    /// Path of the field.
    pub fn path(&self) -> &str {
        &self.path
    }

    /// Sets the field in the `scene`.
    fn apply(&self, scene: &mut Table) -> Result<(), String> {
        let (tables, field) = match self.path.rsplit_once('.') {
            Some((tables, field)) => (tables.split('.').collect(), field),
            None => (Vec::new(), self.path.as_str()),
        };
        let mut at = scene;
        let mut names = tables.into_iter().peekable();
        while let Some(name) = names.next() {
            let inside = at.entry(name).or_insert_with(|| Value::Table(Table::new()));
            at = match inside {
                Value::Table(table) => table,
                Value::Array(entries) => {
                    let Some(entry) = names.next() else {
                        return Err(format!("{name} is a list; add the name of an entry"));
                    };
                    entry_of(entries, name, entry)?
                }
                _ => return Err(format!("{name} is not a table")),
            };
        }
        at.insert(field.to_owned(), self.value.clone());
        Ok(())
    }
}

/// Two or more numbers, joined by commas.
fn vector(text: &str) -> Option<Value> {
    let number = |text: &str| {
        let whole = text.parse().ok().map(Value::Integer);
        whole.or_else(|| text.parse().ok().map(Value::Float))
    };
    let numbers: Option<Vec<_>> = text.split(',').map(|text| number(text.trim())).collect();
    numbers.filter(|numbers| numbers.len() > 1).map(Value::Array)
}

/// The table in the list `entries`, called `list`, with the name or number `wanted`. An entry without
/// a name, as a motor, has that of its `joint`, unless another entry has it too.
fn entry_of<'a>(
    entries: &'a mut [Value],
    list: &str,
    wanted: &str,
) -> Result<&'a mut Table, String> {
    let name = |entry: &Value| {
        let name = entry.get("name").or_else(|| entry.get("joint"))?;
        Some(name.as_str()?.to_owned())
    };
    let names: Vec<_> = entries.iter().filter_map(name).collect();
    let count = entries.len();
    let mut named = (0..count).filter(|&at| name(&entries[at]).as_deref() == Some(wanted));
    let place = named.next().or_else(|| wanted.parse().ok());
    if named.next().is_some() {
        return Err(format!("{list} has several entries {wanted:?}; give a number from 0"));
    }
    let entry = place.and_then(|place| entries.get_mut(place)).and_then(Value::as_table_mut);
    entry.ok_or_else(|| {
        let known = match &names[..] {
            [] => format!("{count} without a name; give a number from 0"),
            names => names.join(", "),
        };
        format!("{list} has no entry {wanted:?}; there are: {known}")
    })
}

/// The scenario `text` with the fields of `overrides`.
///
/// A text that is neither TOML nor XML stays as it is: its reader names the fault.
///
/// # Errors
/// If the text is XML, or a path does not lead to a table.
pub fn overridden(text: &str, overrides: &[FieldOverride]) -> Result<String, Failure> {
    if text.trim_start().starts_with('<') {
        let why = "a robot file (XML) has no fields to set; name it under [[robots]] in a scenario";
        return Err(Failure::setting(FLAG, why));
    }
    let Ok(mut scene) = toml::from_str::<Table>(text) else { return Ok(text.to_owned()) };
    for field in overrides {
        field.apply(&mut scene).map_err(|why| Failure::setting(FLAG, why))?;
    }
    toml::to_string(&scene).map_err(|error| Failure::setting(FLAG, error))
}

#[cfg(test)]
#[path = "tests/overrides.rs"]
mod tests;
