//! Overrides of single fields of a document, such as `ground.friction=0.4`.

use std::path::Path;
use toml::{Table, Value};
use tumble_model::failure::Failure;

/// An override: path of a field, and its value as TOML. A flag or keyword is one with a label.
///
/// The path has the names of tables, separated by dots. An entry of a list of tables is chosen by
/// its `name` or its number from 0: `bodies.brick.mass`.
#[derive(Debug, Clone, PartialEq)]
pub struct FieldOverride {
    path: String,
    value: Value,
    label: Option<String>,
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
        Ok(Self { path: path.to_owned(), value: parsed(value), label: None })
    }

    /// Override of the field at `path` by the flag or keyword `label`.
    pub fn labelled(label: &str, path: &str, value: &str) -> Self {
        Self { path: path.to_owned(), value: parsed(value.trim()), label: Some(label.to_owned()) }
    }

    /// Flag or keyword that stands for the path.
    pub fn label(&self) -> Option<&str> {
        self.label.as_deref()
    }

    /// The value, if it is a number other than zero.
    pub fn is_nonzero(&self) -> bool {
        number(&self.value).is_some_and(|number| number != 0.0)
    }

    /// The value, if it is a whole number.
    pub fn whole(&self) -> Option<u64> {
        self.value.as_integer().and_then(|number| number.try_into().ok())
    }

    /// True if the value is this text.
    pub fn is_text(&self, text: &str) -> bool {
        self.value.as_str() == Some(text)
    }

    /// True if the field is a setting of the scene, not one of a body or joint.
    pub(crate) fn is_of_head(&self) -> bool {
        let first = self.path.split('.').next().unwrap_or_default();
        ["ground", "solver"].contains(&first) || !self.path.contains('.')
    }

    /// True if a change of the field changes the motion. The seed and the solver are part of every title.
    pub(crate) fn changes_motion(&self) -> bool {
        let first = self.path.split('.').next();
        !first.is_some_and(|first| ["seed", "steps", "solver"].contains(&first))
    }

    /// Name in titles: the flag or keyword, or else the path.
    pub(crate) fn name(&self) -> &str {
        self.label.as_ref().map_or(&self.path, |label| label.trim_start_matches('-'))
    }

    /// True if an error about the field `name` is one of this value.
    fn is_cause(&self, name: &str) -> bool {
        let name = name.replace('[', ".").replace(']', "");
        // The short form of one body has its fields in two tables.
        let own = ["body.", "start."].into_iter().find_map(|table| self.path.strip_prefix(table));
        let rest = name.strip_prefix(self.path.as_str());
        let short = name.strip_prefix("body.").unwrap_or(&name);
        own == Some(short) || rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
    }

    /// Path of the field.
    pub fn path(&self) -> &str {
        &self.path
    }

    /// Sets the field in the `document`. Returns true if its value was another one.
    ///
    /// # Errors
    /// A path that does not lead to a table.
    pub(crate) fn apply(&self, document: &mut Table) -> Result<bool, Failure> {
        self.set(document).map_err(|why| Failure::setting(&self.path, why))
    }

    fn set(&self, scene: &mut Table) -> Result<bool, String> {
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
        let before = at.insert(field.to_owned(), self.value.clone());
        Ok(!before.as_ref().is_some_and(|before| is_same(before, &self.value)))
    }
}

/// A number, whole or not.
fn number(value: &Value) -> Option<f64> {
    value.as_float().or(value.as_integer().map(|whole| whole as f64))
}

/// True if both are the same value, or the same numbers.
fn is_same(a: &Value, b: &Value) -> bool {
    match (a, b) {
        (Value::Array(a), Value::Array(b)) => {
            a.len() == b.len() && a.iter().zip(b).all(|(a, b)| is_same(a, b))
        }
        _ => a == b || number(a).is_some_and(|a| Some(a) == number(b)),
    }
}

/// Value of a text: TOML, a vector, or the text itself.
fn parsed(value: &str) -> Value {
    let parsed = toml::from_str::<Table>(&format!("value = {value}"));
    // A text of several lines could have other fields.
    let alone = parsed.ok().filter(|table| table.len() == 1);
    let parsed = alone.and_then(|mut table| table.remove("value"));
    parsed.or_else(|| vector(value)).unwrap_or_else(|| Value::String(value.to_owned()))
}

/// Adds the place of the fault to a `failure`: the flag or keyword whose value is wrong, or else the file
/// at `path`.
pub(crate) fn placed(failure: Failure, overrides: &[FieldOverride], path: &Path) -> Failure {
    // An error inside an entry begins with the path of its field.
    let fault = match &failure {
        Failure::Setting { name, why } => Some((name.as_str(), why.as_str())),
        Failure::Input(text) => text.find([':', ' ']).map(|end| {
            let (name, rest) = text.split_at(end);
            (name, rest.strip_prefix(": ").unwrap_or(text))
        }),
        Failure::Other(_) => None,
    };
    if let Some((name, why)) = fault
        && let Some(cause) = overrides
            .iter()
            .filter(|field| field.is_cause(name))
            .max_by_key(|field| field.path.len())
    {
        let label = cause.label.clone().unwrap_or_else(|| format!("--set {}", cause.path));
        return Failure::Input(format!("{label}: {why}"));
    }
    failure.in_file(path)
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

#[cfg(test)]
#[path = "tests/overrides.rs"]
mod tests;
