//! The names of the files that a run leaves, whole or not.

use tumble_scene::kept::TableForm;
use tumble_scene::output::tables::Table;

pub const ANIMATION: &str = "animation.gif";
pub const PLOTS: [&str; 4] = ["plot.png", "plot.svg", "plot-energy.png", "plot-energy.svg"];
pub const RUN_JSON: &str = "run.json";
pub const VIEW: &str = "view.html";
/// What a plan writes beside the files of a run.
pub const OF_PLANS: [&str; 4] = ["controls.csv", "plan.json", "plan.html", "scene.toml"];

/// The table of a run in the tutorial's form.
pub const TRAJECTORY: &str = "trajectory";

/// The name of the file of a table.
pub fn file_of(table: &str, form: TableForm) -> String {
    match form {
        TableForm::Csv => format!("{table}.csv"),
        TableForm::Zstd => format!("{table}.csv.zst"),
    }
}

/// The names of the files of rows, of both formats and forms.
pub fn of_rows() -> impl Iterator<Item = String> {
    let names = [TRAJECTORY].into_iter().chain(Table::ALL.map(Table::name));
    names.flat_map(|name| [TableForm::Csv, TableForm::Zstd].map(|form| file_of(name, form)))
}

/// Whether a file of this name is compressed.
pub fn is_compressed(name: &str) -> bool {
    name.ends_with(".zst")
}

/// What the name of a file begins and ends with that is not complete.
pub const TEMPORARY: (&str, &str) = (".tumble-", ".tmp");
/// The characters between them, any letters and digits.
pub const RANDOM: usize = 6;

/// Whether a file of this name is one that is not complete.
pub fn is_temporary(name: &str) -> bool {
    let (begin, end) = TEMPORARY;
    let middle = name.strip_prefix(begin).and_then(|rest| rest.strip_suffix(end));
    let fits = |middle: &str| {
        middle.len() == RANDOM && middle.bytes().all(|byte| byte.is_ascii_alphanumeric())
    };
    middle.is_some_and(fits)
}
