//! controls.csv: a row a step, a column a number that was looked for.

use crate::cli::outcome::Failure;
use crate::cli::{input, shown};
use std::path::Path;
use tumble::plan::Problem;

/// More bytes than this are no controls.
const LARGEST: u64 = 1 << 28;

/// The columns: of each component that is looked for its name, its control and its place among the control's.
fn columns(problem: &Problem) -> Vec<(String, usize, usize)> {
    let mut columns = Vec::new();
    for variable in problem.variables().iter().filter(|variable| variable.knot == 0) {
        let control = &problem.controls()[variable.control];
        let component = control.kind.components()[variable.component];
        let name = format!("{}.{component}", control.name);
        columns.push((name, variable.control, variable.component));
    }
    columns
}

/// The table of controls.
pub fn table(problem: &Problem, controls: &[f64]) -> Result<Vec<u8>, Failure> {
    let columns = columns(problem);
    let mut writer = csv::Writer::from_writer(Vec::new());
    let odd = |error: csv::Error| Failure::Other(format!("controls.csv: {error}"));
    let names = ["k", "t"].into_iter().chain(columns.iter().map(|(name, ..)| name.as_str()));
    writer.write_record(names).map_err(odd)?;
    let (first, h) = (problem.scene().start_index, problem.scene().world.time_step());
    for step in 0..problem.steps() {
        let k = first + step as u64;
        let mut row = vec![k.to_string(), (k as f64 * h).to_string()];
        for (_, control, component) in &columns {
            let knot = problem.knot(*control, step);
            row.push(problem.numbers(*control, knot, controls).0[*component].to_string());
        }
        writer.write_record(row).map_err(odd)?;
    }
    writer.into_inner().map_err(|error| Failure::Other(format!("controls.csv: {error}")))
}

/// The controls that a table has; each piece has the value of its first step.
pub fn read(problem: &Problem, path: &Path) -> Result<Vec<f64>, Failure> {
    let odd = |why: String| Failure::Input(format!("{}: {why}", shown::path(path)));
    let bytes = input::bytes(path, LARGEST)
        .map_err(|error| odd(format!("cannot be read as controls: {error}")))?;
    let mut reader = csv::Reader::from_reader(&bytes[..]);
    let headers = reader.headers().map_err(|error| odd(error.to_string()))?.clone();
    let columns = columns(problem);
    for (at, name) in headers.iter().enumerate() {
        let is_known =
            name == "k" || name == "t" || columns.iter().any(|(known, ..)| known == name);
        if !is_known || headers.iter().take(at).any(|other| other == name) {
            let why = if is_known { "twice" } else { "no control of the problem" };
            return Err(odd(format!("column {name:?} is there {why}")));
        }
    }
    let mut rows = Vec::new();
    for row in reader.records() {
        rows.push(row.map_err(|error| odd(error.to_string()))?);
    }
    let (count, steps) = (rows.len(), problem.steps());
    if count != steps {
        return Err(odd(format!("it has {count} rows; {steps} are needed, one a step")));
    }
    let place = |control: usize, component: usize| {
        let name = columns.iter().find(|(_, c, k)| (*c, *k) == (control, component));
        let name = name.map_or("", |(name, ..)| name);
        let place = headers.iter().position(|header| header == name);
        place.ok_or_else(|| odd(format!("column {name:?} is missing")))
    };
    let value = |variable: &tumble::plan::Variable| {
        let column = place(variable.control, variable.component)?;
        let is_first = |step: &usize| problem.knot(variable.control, *step) == variable.knot;
        let step = (0..steps).find(is_first).unwrap_or(0);
        let text = rows[step].get(column).unwrap_or_default().trim();
        let value = text.parse().ok().filter(|value: &f64| value.is_finite());
        value.ok_or_else(|| odd(format!("row {}: {text:?} is no number", step + 1)))
    };
    problem.variables().iter().map(value).collect()
}
