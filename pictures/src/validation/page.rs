//! The page: a heading, a summary, and a section for each problem.

use super::report::{Experiment, Report};
use super::style::opening;
use super::{chart, table};
use crate::markup::escape;
use std::fmt::Write as _;

/// How the page is to be read.
const READING: &str = "Each problem is simulated with a time step h and with its halves. The \
    exact answer is that of Newton's and Coulomb's laws in continuous time, the discrete one \
    what the step's own equations give for the motion, both solved by hand. A quantity holds if \
    at every h its error, measured − discrete, is within what rounding and the residuals of the \
    steps allow (100 % of it is the bound itself, which a step may reach), and if measured − exact shrinks as declared. The order in h is p where it goes \
    like h<sup>p</sup>, from the row above and this one; “exact” stands where the step is exact, \
    a bound where the difference depends on how the steps happen to fall, “hidden” where the \
    residuals hide the order, and “coarse” where the steps are too coarse for one.";

/// `report` as a page of HTML that needs nothing else. The same report gives the same bytes.
#[must_use]
pub fn page(report: &Report) -> String {
    let (holding, count) = report.holding();
    let title = "tumble, checked against closed forms";
    let inputs = match report.given.as_str() {
        "" => "the usual ones of each problem".to_owned(),
        given => format!("the usual ones of each problem, but {}", escape(given)),
    };
    let class = if holding == count { "good" } else { "bad" };
    let mut html = opening(title, "");
    let _ = write!(
        html,
        "<p class=\"faint\">{}. Inputs: {inputs}.</p>\n\
         <p><strong class=\"{class}\">{holding} of {count} quantities hold</strong>, each counted \
         once for every solver.</p>\n<p>{READING}</p>\n",
        escape(&report.program),
    );
    html.push_str(&table::summary(report));
    for experiment in &report.experiments {
        section(&mut html, experiment);
    }
    html.push_str("</body>\n</html>\n");
    html
}

fn section(html: &mut String, experiment: &Experiment) {
    let _ = write!(
        html,
        "<section id=\"{name}\">\n<h2>{name}</h2>\n<p>{}</p>\n<p class=\"faint\">Inputs: {}.</p>\n\
         {}<div class=\"charts\">\n{}{}</div>\n</section>\n",
        escape(&experiment.about),
        escape(&experiment.inputs),
        table::quantities(experiment),
        chart::curves(experiment),
        chart::errors(experiment),
        name = experiment.name,
    );
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::validation::{Curve, Quantity, Series, Solver, Trial};

    /// A report of one quantity at two time steps, `error` m off at the second of them.
    fn report(error: f64) -> Report {
        let words = |text: &str| text.to_owned();
        let trial = |error: f64, time_step: f64| Trial {
            time_step,
            quantities: vec![Quantity {
                name: words("way < & >"),
                unit: words("m"),
                measured: 2.0 + time_step + error,
                discrete: 2.0 + time_step,
                exact: 2.0,
                slack: 1e-5,
                fault: (error.abs() > 1.1e-5).then(|| words("off")),
                order: words("1.00"),
                first_order: true,
            }],
            steps: 5,
            failed: 0,
            fallback: 0,
            worst_residual: 1e-12,
        };
        let curve = Curve {
            name: words("way"),
            unit: words("m"),
            times: vec![0.0, 0.1, 0.2],
            measured: vec![0.0, f64::INFINITY, 1.0],
            exact: vec![f64::NAN; 3],
        };
        let trials = vec![trial(0.0, 0.01), trial(error, 0.005)];
        let series = vec![Series { solver: Solver::Native, trials, curve }];
        let (name, about, inputs) = (words("free-fall"), words("It falls."), words("mass 2 kg"));
        let experiments = vec![Experiment { name, about, inputs, series }];
        Report { program: words("tumble"), given: words("--speed <b>"), experiments }
    }

    #[test]
    fn a_quantity_that_is_off_at_one_step_is_off_once() {
        assert!(!page(&report(1e-5)).contains(">off<"));
        assert_eq!(page(&report(6e-5)).matches(">off<").count(), 1);
    }

    #[test]
    fn a_share_of_the_allowed_has_its_verdict() {
        for (error, said) in [
            (0.0, "0 %, within"),
            (1e-8, "below 1 %, within"),
            (0.315e-5, "31 %, within"),
            (0.9996e-5, "99 %, within"),
            (1.0001e-5, "101 %, beyond"),
            (6e-3, "600 times, beyond"),
        ] {
            let page = page(&report(error));
            assert!(page.contains(&format!("largest error\">{said}<")), "{error}");
        }
    }

    #[test]
    fn a_curve_that_magnifies_rounding_says_so() {
        let mut report = report(0.0);
        assert!(!page(&report).contains("Magnified"));
        report.experiments[0].series[0].curve.measured = vec![0.0, 1.6e-9, 1.6e-9];
        assert!(page(&report).contains("the whole vertical axis is 1.8·10<sup>−9</sup> m"));
    }

    #[test]
    fn what_is_no_number_leaves_a_gap_and_words_are_escaped() {
        let page = page(&report(f64::NAN));
        for wrong in ["NaN", "inf\"", "way < &", "<b>"] {
            assert!(!page.contains(wrong), "{wrong}");
        }
        assert!(page.contains("way &lt; &amp; &gt;") && page.contains("--speed &lt;b&gt;"));
    }
}
