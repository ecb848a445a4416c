//! The page: a heading, a summary, and a section for each problem.

use super::style::STYLE;
use super::{Experiment, Report, chart, table};
use crate::pictures::plot::svg::escape;
use std::fmt::Write as _;

/// How the page is to be read.
const READING: &str = "Each problem is simulated with a time step h and with its halves. The \
    exact answer is that of Newton's and Coulomb's laws in continuous time, the discrete one \
    what the step's own equations give for the motion, both solved by hand. A quantity holds if \
    at every h its error, measured − discrete, is within what rounding and the residuals of the \
    steps allow, and if measured − exact shrinks as declared. The order in h is p where it goes \
    like h<sup>p</sup>, from the row above and this one; “exact” stands where the step is exact, \
    a bound where the difference depends on how the steps happen to fall, “hidden” where the \
    residuals hide the order, and “few steps” where the motion has too few for one.";

/// `report` as a page of HTML that needs nothing else. The same report gives the same bytes.
pub fn page(report: &Report) -> String {
    let (holding, count) = report.holding();
    let title = "tumble, checked against closed forms";
    let inputs = match report.given.as_str() {
        "" => "the usual ones of each problem".to_owned(),
        given => format!("the usual ones of each problem, but {}", escape(given)),
    };
    let class = if holding == count { "good" } else { "bad" };
    let mut html = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; \
         style-src 'unsafe-inline'\"/>\n\
         <title>{title}</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n\
         <h1>{title}</h1>\n\
         <p class=\"faint\">tumble {}, Ipopt {}. Inputs: {inputs}.</p>\n\
         <p><strong class=\"{class}\">{holding} of {count} quantities hold</strong>, each counted \
         once for every solver.</p>\n<p>{READING}</p>\n",
        env!("CARGO_PKG_VERSION"),
        escape(tumble::ipopt::VERSION),
    );
    html.push_str(&table::summary(report));
    for experiment in &report.experiments {
        section(&mut html, experiment);
    }
    html.push_str("</body>\n</html>\n");
    html
}

fn section(html: &mut String, experiment: &Experiment) {
    let problem = experiment.problem;
    let _ = write!(
        html,
        "<section id=\"{name}\">\n<h2>{name}</h2>\n<p>{}</p>\n<p class=\"faint\">Inputs: {}.</p>\n\
         {}<div class=\"charts\">\n{}{}</div>\n</section>\n",
        escape(problem.about()),
        escape(&experiment.inputs_in_words()),
        table::quantities(experiment),
        chart::curves(experiment),
        chart::errors(experiment),
        name = problem.name(),
    );
}
