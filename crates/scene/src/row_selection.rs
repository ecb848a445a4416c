//! Selection and format of the rows in the files of a run.

use crate::output::tables::Table;
use serde::{Deserialize, Serialize};

/// Rows that are written to files. By default all, as CSV.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "an object with the selection of rows")]
pub struct RowSelection {
    /// Row interval (steps): every `every`-th step has rows. The last state is always written.
    #[serde(default = "one")]
    pub every: u64,
    /// Names of the requested tables, null for all. `states` and `steps` are always written.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    tables: Option<Vec<String>>,
    /// True if contacts that add nothing to the residual have no rows.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub loaded_contacts: bool,
    /// Format of the files.
    #[serde(default)]
    pub form: TableForm,
    /// True if numbers are rounded, and unchanged states have no rows.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub short: bool,
}

/// Format of the files with rows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum TableForm {
    /// Text.
    #[default]
    Csv,
    /// Text compressed by gzip.
    Gzip,
}

impl Default for RowSelection {
    fn default() -> Self {
        Self { every: 1, tables: None, loaded_contacts: false, form: TableForm::Csv, short: false }
    }
}

fn one() -> u64 {
    1
}

impl RowSelection {
    /// Rows of every `every`-th step, of the given tables only or of all.
    pub fn new(
        every: u64,
        tables: Option<&[Table]>,
        loaded_contacts: bool,
        form: TableForm,
    ) -> Self {
        let names = |tables: &[Table]| tables.iter().map(|table| table.name().to_owned()).collect();
        Self { every, tables: tables.map(names), loaded_contacts, form, short: false }
    }

    /// True if all rows are written as CSV.
    pub fn is_all(&self) -> bool {
        *self == Self::default()
    }

    /// True if rows are omitted.
    pub fn has_gaps(&self) -> bool {
        self.every > 1
    }

    /// True if `table` is written in a run, provided that it has such rows.
    pub fn has(&self, table: Table) -> bool {
        let named = |tables: &Vec<String>| tables.iter().any(|name| name == table.name());
        matches!(table, Table::States | Table::Steps) || self.tables.as_ref().is_none_or(named)
    }

    /// Number of rows kept of a run with `rows` rows.
    pub fn rows(&self, rows: u64) -> u64 {
        rows.saturating_sub(1).div_ceil(self.every.max(1)) + 1
    }
}
