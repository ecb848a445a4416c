//! The tables of the page.

use super::number::{brief, figure, html};
use super::report::{Experiment, Report, Series};
use crate::markup::escape;
use std::fmt::Write as _;

/// A table in a box that scrolls; each column has a name and whether it holds numbers.
pub fn table(columns: &[(&str, bool)], rows: &str) -> String {
    let class = |numbers: bool| if numbers { " class=\"n\"" } else { "" };
    let heads = columns
        .iter()
        .map(|(name, numbers)| format!("<th scope=\"col\"{}>{name}</th>", class(*numbers)));
    format!(
        "<div class=\"box\" tabindex=\"0\">\n<table>\n<thead><tr>{}</tr></thead>\n\
         <tbody>\n{rows}</tbody>\n</table>\n</div>\n",
        heads.collect::<String>()
    )
}

/// A cell of a number; on a narrow page, where rows are no columns, `name` stands before it.
pub fn number(name: &str, text: &str) -> String {
    format!("<td class=\"n\" data-name=\"{name}\">{}</td>", html(text))
}

fn verdict(holds: bool, good: &str, bad: &str) -> String {
    let (class, text) = if holds { ("good", good) } else { ("bad", bad) };
    format!("<td class=\"verdict {class}\">{text}</td>")
}

/// A count that should be 0.
fn fault(name: &str, count: u64) -> String {
    let class = if count == 0 { "n" } else { "n bad" };
    format!("<td class=\"{class}\" data-name=\"{name}\">{count}</td>")
}

/// One row a problem and solver.
pub fn summary(report: &Report) -> String {
    let columns = [
        ("problem", false),
        ("solver", false),
        ("quantities that hold", false),
        ("largest error, of the allowed", true),
        ("steps", true),
        ("not converged", true),
        ("fallbacks", true),
        ("largest residual, m/s", true),
    ];
    let mut rows = String::new();
    for experiment in &report.experiments {
        let name = &experiment.name;
        for (i, series) in experiment.series.iter().enumerate() {
            if i == 0 {
                let span = experiment.series.len();
                let _ = write!(
                    rows,
                    "<tr class=\"first\"><th scope=\"rowgroup\" rowspan=\"{span}\">\
                     <a href=\"#{name}\">{name}</a></th>"
                );
            } else {
                rows.push_str("<tr>");
            }
            let (holding, count) = series.holding();
            let hold = format!("{holding} of {count}");
            let _ = writeln!(
                rows,
                "<td>{}</td>{}{}{}{}{}{}</tr>",
                series.solver.name(),
                verdict(holding == count, &hold, &hold),
                number("largest error", &share(series)),
                number("steps", &series.sum(|trial| trial.steps).to_string()),
                fault("not converged", series.sum(|trial| trial.failed)),
                number("fallbacks", &series.sum(|trial| trial.fallback).to_string()),
                number("largest residual, m/s", &brief(series.worst_residual())),
            );
        }
    }
    table(&columns, &rows)
}

/// The largest |error| as a share of what is allowed, in whole percent, and whether that is
/// within it; a dash where one is no number. A share below 1 is rounded down, so that what is
/// within the bound never reads as at it.
fn share(series: &Series) -> String {
    let quantities = series.trials.iter().flat_map(|trial| &trial.quantities);
    let shares = quantities
        .filter(|quantity| quantity.error() != 0.0)
        .map(|quantity| (quantity.error() / quantity.slack).abs());
    match shares.max_by(f64::total_cmp) {
        None => "0 %, within".to_owned(),
        Some(share) if share < 0.01 => "below 1 %, within".to_owned(),
        Some(share) if share <= 1.0 => format!("{} %, within", (100.0 * share).floor()),
        Some(share) if share < 100.0 => format!("{} %, beyond", (100.0 * share).ceil()),
        Some(share) if share.is_finite() => format!("{share:.0} times, beyond"),
        Some(_) => "—".to_owned(),
    }
}

/// One row a quantity, solver and time step.
pub fn quantities(experiment: &Experiment) -> String {
    let columns = [
        ("quantity", false),
        ("solver", false),
        ("h, s", true),
        ("exact", true),
        ("discrete", true),
        ("measured", true),
        ("error", true),
        ("allowed", true),
        ("order in h", true),
        ("verdict", false),
    ];
    let rows_each: usize = experiment.series.iter().map(|series| series.trials.len()).sum();
    let first = &experiment.series[0].trials[0].quantities;
    let mut rows = String::new();
    for (i, named) in first.iter().enumerate() {
        let name = match named.unit.as_str() {
            "1" => escape(&named.name),
            unit => escape(&format!("{}, {unit}", named.name)),
        };
        let mut opening = format!(
            "<tr class=\"first\"><th scope=\"rowgroup\" rowspan=\"{rows_each}\">{name}</th>"
        );
        for series in &experiment.series {
            let span = series.trials.len();
            let mut solver = format!("<td rowspan=\"{span}\">{}</td>", series.solver.name());
            for (k, trial) in series.trials.iter().enumerate() {
                let quantity = &trial.quantities[i];
                let _ = writeln!(
                    rows,
                    "{}{}{}{}{}{}{}{}{}{}</tr>",
                    std::mem::replace(&mut opening, "<tr>".to_owned()),
                    std::mem::take(&mut solver),
                    number("h, s", &trial.time_step.to_string()),
                    number("exact", &figure(quantity.exact)),
                    number("discrete", &figure(quantity.discrete)),
                    number("measured", &figure(quantity.measured)),
                    number("error", &brief(quantity.error())),
                    number("allowed", &brief(quantity.slack)),
                    number("order", series.order(i, k)),
                    verdict(quantity.fault.is_none(), "holds", "off"),
                );
            }
        }
    }
    table(&columns, &rows)
}
