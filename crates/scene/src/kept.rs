//! Which rows of a run stand in its files, and in which form.

use crate::output::tables::Table;
use serde::{Deserialize, Serialize};

/// Which rows stand in the files: of a usual run all, as CSV.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "an object with what of the rows is kept")]
pub struct KeptSteps {
    /// Of each so many steps the first has rows, and the last state has always.
    #[serde(default = "one")]
    pub every: u64,
    /// The names of the tables that were asked for; `states` and `steps` are there in any case. Null for all.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    tables: Option<Vec<String>>,
    /// The files' form.
    #[serde(default)]
    pub form: TableForm,
}

/// The form of the files of rows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
#[serde(rename_all = "lowercase")]
pub enum TableForm {
    /// Text.
    #[default]
    Csv,
    /// The same text compressed by Zstandard.
    Zstd,
}

impl Default for KeptSteps {
    fn default() -> Self {
        Self { every: 1, tables: None, form: TableForm::Csv }
    }
}

fn one() -> u64 {
    1
}

impl KeptSteps {
    /// Of each `every` steps the first, of these tables alone, or of all.
    #[must_use]
    pub fn new(every: u64, tables: Option<&[Table]>, form: TableForm) -> Self {
        let names = |tables: &[Table]| tables.iter().map(|table| table.name().to_owned()).collect();
        Self { every, tables: tables.map(names), form }
    }

    /// Whether it is all of them, as CSV.
    #[must_use]
    pub fn is_all(&self) -> bool {
        *self == Self::default()
    }

    /// Whether the table is written, where the run has one.
    #[must_use]
    pub fn has(&self, table: Table) -> bool {
        let named = |tables: &Vec<String>| tables.iter().any(|name| name == table.name());
        match table {
            Table::States | Table::Steps => true,
            // Of a run that keeps every step the next one has them.
            Table::Ends if self.every <= 1 => false,
            _ => self.tables.as_ref().is_none_or(named),
        }
    }

    /// Of a run of so many `rows` in all, how many are kept.
    #[must_use]
    pub fn rows(&self, rows: u64) -> u64 {
        rows.saturating_sub(1).div_ceil(self.every.max(1)) + 1
    }
}
