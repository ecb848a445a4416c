//! controls.csv: one row for each step, one column for each variable component.

use crate::input;
use crate::outcome::Failure;
use std::path::Path;
use tumble_model::shown;
use tumble_plan::PlanProblem;

/// Largest size of a table, bytes.
const LARGEST: u64 = 1 << 28;

/// Columns: name, control and component of each variable component.
fn columns(problem: &PlanProblem) -> Vec<(String, usize, usize)> {
    let mut columns = Vec::new();
    for variable in problem.variables().iter().filter(|variable| variable.knot == 0) {
        let control = &problem.controls()[variable.control];
        let component = control.kind.components()[variable.component];
        let name = format!("{}.{component}", control.name);
        columns.push((name, variable.control, variable.component));
    }
    columns
}

/// Table of controls.
pub fn table(problem: &PlanProblem, controls: &[f64]) -> Result<Vec<u8>, Failure> {
    let columns = columns(problem);
    let mut writer = csv::Writer::from_writer(Vec::new());
    let invalid = |error: csv::Error| Failure::Other(format!("controls.csv: {error}"));
    let names = ["k", "t"].into_iter().chain(columns.iter().map(|(name, ..)| name.as_str()));
    writer.write_record(names).map_err(invalid)?;
    let (first, h) = (problem.scene().start_index, problem.scene().world.time_step());
    for step in 0..problem.steps() {
        let k = first + step as u64;
        let mut row = vec![k.to_string(), (k as f64 * h).to_string()];
        for (_, control, component) in &columns {
            let knot = problem.knot(*control, step);
            row.push(problem.numbers(*control, knot, controls).0[*component].to_string());
        }
        writer.write_record(row).map_err(invalid)?;
    }
    writer.into_inner().map_err(|error| Failure::Other(format!("controls.csv: {error}")))
}

/// Controls of a table, and the differences from the table.
pub struct Read {
    /// Controls within their bounds; each piece has the value of its first step.
    pub controls: Vec<f64>,
    /// Adjustments, as phrases.
    pub changed: Vec<String>,
}

/// Reads the controls of a table.
pub fn read(problem: &PlanProblem, path: &Path) -> Result<Read, Failure> {
    let invalid = |why: String| Failure::Input(format!("{}: {why}", shown::path(path)));
    let bytes = input::bytes(path, LARGEST)
        .map_err(|error| invalid(format!("cannot be read as controls: {error}")))?;
    let mut reader = csv::Reader::from_reader(&bytes[..]);
    let headers = reader.headers().map_err(|error| invalid(error.to_string()))?.clone();
    let columns = columns(problem);
    for (at, name) in headers.iter().enumerate() {
        let is_known =
            name == "k" || name == "t" || columns.iter().any(|(known, ..)| known == name);
        if !is_known || headers.iter().take(at).any(|other| other == name) {
            let why = if is_known { "is given twice" } else { "is not a control of the problem" };
            return Err(invalid(format!("column {name:?} {why}")));
        }
    }
    let mut rows = Vec::new();
    for row in reader.records() {
        rows.push(row.map_err(|error| invalid(error.to_string()))?);
    }
    let (count, steps) = (rows.len(), problem.steps());
    if count != steps {
        return Err(invalid(format!("it has {count} rows; {steps} are needed, one per step")));
    }
    let number = |step: usize, column: usize| {
        let text = rows[step].get(column).unwrap_or_default().trim();
        let value = text.parse().ok().filter(|value: &f64| value.is_finite());
        value.ok_or_else(|| invalid(format!("row {}: {text:?} is not a number", step + 1)))
    };
    let place = |name: &str| headers.iter().position(|header| header == name);
    let mut changed = Vec::new();
    let mut change = |count: usize, why: &str| {
        if count > 0 {
            changed.push(format!("{count} {why}"));
        }
    };
    // Tables have all digits of a time.
    let (first, h) = (problem.scene().start_index as f64, problem.scene().world.time_step());
    for (name, unit, why) in [
        ("k", 1.0, "values of k differ from the problem's steps"),
        ("t", h, "values of t differ from the problem's steps"),
    ] {
        let Some(column) = place(name) else { continue };
        let mut others = 0;
        for step in 0..steps {
            let time = (first + step as f64) * unit;
            others += usize::from((number(step, column)? - time).abs() > 1e-9 * (time + unit));
        }
        change(others, why);
    }
    let mut dropped = 0;
    for (name, control, _) in &columns {
        let column = place(name).ok_or_else(|| invalid(format!("column {name:?} is missing")))?;
        for step in 0..steps {
            let piece = problem.steps_of(*control, problem.knot(*control, step));
            let differs = number(step, column)? != number(piece.start, column)?;
            dropped += usize::from(differs);
        }
    }
    change(dropped, "values differ from the first step of their piece, which is used");
    let value = |variable: &tumble_plan::Variable| {
        let known = columns.iter().find(|(_, control, component)| {
            (*control, *component) == (variable.control, variable.component)
        });
        let column = known.and_then(|(name, ..)| place(name)).unwrap_or_default();
        number(problem.steps_of(variable.control, variable.knot).start, column)
    };
    let given = problem.variables().iter().map(value).collect::<Result<Vec<_>, _>>()?;
    let controls = problem.clipped(&given).map_err(|why| invalid(why.to_string()))?;
    let moved = given.iter().zip(&controls).filter(|(given, taken)| given != taken).count();
    change(moved, "numbers are beyond their bounds and are clipped");
    Ok(Read { controls, changed })
}
