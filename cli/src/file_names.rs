//! Names of the files of a run, complete or temporary.

use std::path::Path;
use tumble_scene::output::tables::Table;
use tumble_scene::row_selection::TableForm;

pub const ANIMATION: &str = "animation.gif";
pub const PLOTS: [&str; 4] = ["plot.png", "plot.svg", "plot-energy.png", "plot-energy.svg"];
pub const RUN_JSON: &str = "run.json";
/// State at the end of a run.
pub const STATE: &str = "state.bin";
/// Checkpoint of an unfinished run.
pub const CHECKPOINT: &str = "checkpoint.bin";
pub const VIEW: &str = "view.html";
/// Table of the runs of a sweep.
pub const SWEEP: &str = "sweep.csv";
/// Still picture of `tumble view --png`.
pub const STILL: &str = "view.png";
/// Files of a plan in addition to those of a run.
pub const PLAN_FILES: [&str; 4] = ["controls.csv", "plan.json", "plan.html", "scene.toml"];

/// Name of the export of the tutorial's scene.
pub const TRAJECTORY: &str = "trajectory";

/// File name of a table.
pub fn file_of(table: &str, form: TableForm) -> String {
    match form {
        TableForm::Csv => format!("{table}.csv"),
        TableForm::Gzip => format!("{table}.csv.gz"),
    }
}

/// Names of all files with rows, with and without compression.
pub fn row_files() -> impl Iterator<Item = String> {
    let names = [TRAJECTORY].into_iter().chain(Table::ALL.map(Table::name));
    names.flat_map(|name| [TableForm::Csv, TableForm::Gzip].map(|form| file_of(name, form)))
}

/// File name of part `number` of a live run, from 1 on.
pub fn part_directory(number: usize) -> String {
    format!("part-{number}.toml")
}

/// True for the name of a part of a live run.
pub fn is_part(name: &str) -> bool {
    let number = name.strip_prefix("part-").and_then(|rest| rest.strip_suffix(".toml"));
    number
        .and_then(|number| number.parse().ok())
        .is_some_and(|number| part_directory(number) == name)
}

/// True if a file with this name is compressed.
pub fn is_compressed(name: &str) -> bool {
    name.ends_with(".gz")
}

/// Prefix and suffix of temporary files.
pub const TEMPORARY: (&str, &str) = (".tumble-", ".tmp");
/// Number of characters between them, letters and digits.
pub const RANDOM: usize = 6;

/// True for the name of a temporary file.
pub fn is_temporary(name: &str) -> bool {
    let (begin, end) = TEMPORARY;
    let middle = name.strip_prefix(begin).and_then(|rest| rest.strip_suffix(end));
    let fits = |middle: &str| {
        middle.len() == RANDOM && middle.bytes().all(|byte| byte.is_ascii_alphanumeric())
    };
    middle.is_some_and(fits)
}

/// Directory for pictures of the run of `file`: `out`, or the file's own directory.
pub fn directory_of<'a>(out: Option<&'a Path>, file: &'a Path) -> &'a Path {
    // `x.csv` has the parent "", which is not the name of a directory.
    let beside = file.parent().filter(|parent| !parent.as_os_str().is_empty());
    out.or(beside).unwrap_or(Path::new("."))
}
