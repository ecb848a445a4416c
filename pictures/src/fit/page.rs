//! The page: what was found, how large the errors are, and how tosses go.

use super::charts;
use super::report::{Motion, Report};
use crate::markup::escape;
use crate::page::{figure, number, opening, table};
use std::fmt::Write as _;

/// How the page is to be read.
const READING: &str = "Each toss is simulated from shortly before it touches the ground to the end \
    of its recording, with the same start whatever the parameters are. Its errors are the mean \
    distance of the centres, in parts of the body's length, and the mean angle between the \
    attitudes. \
    Which face a toss comes to rest on can hang on the last digits of its start: a toss that ends \
    more than 45° off is counted as on another face.";

/// The same of several bodies.
const READING_SEVERAL: &str = "Each recording is simulated from its first frame to its end. Its errors are the means over frames \
    and bodies of the distance of the centres, in parts of the longest side of a body, and of the angle between the \
    attitudes. The charts of a recording are those of the body that is farthest off.";

/// What is said of the style of another face's toss beside that of all pages.
const RING: &str = "circle.ipopt { fill: none; stroke: var(--ipopt); stroke-width: 1.8; }\n";

/// The page of a report, complete in itself.
#[must_use]
pub fn page(report: &Report) -> String {
    let title = format!("tumble fit: {}", escape(&report.scene));
    let mut html = opening(&title, RING);
    let facts = report.facts.iter().map(|fact| escape(fact)).collect::<Vec<_>>().join(". ");
    let _ = writeln!(html, "<p class=\"faint\">{}. {facts}.</p>", escape(&report.program));
    let (class, verdict) = match report.failed {
        0 => ("good", "every step is certified".to_owned()),
        failed => ("bad", format!("{failed} steps did not converge")),
    };
    let _ = write!(
        html,
        "<p>{} steps simulated: <strong class=\"{class}\">{verdict}</strong>.</p>\n\
         <p>{}</p>\n",
        report.steps,
        if report.is_of_several { READING_SEVERAL } else { READING }
    );
    html.push_str(&means(report));
    if !report.parameters.is_empty() {
        let _ = write!(
            html,
            "<section id=\"parameters\">\n<h2>Parameters</h2>\n{}<div class=\"charts\">\n{}</div>\n\
             </section>\n",
            parameters(report),
            charts::progress(&report.progress)
        );
    }
    let _ = write!(
        html,
        "<section id=\"errors\">\n<h2>Errors</h2>\n<div class=\"charts\">\n{}</div>\n</section>\n",
        charts::errors(report)
    );
    let usual = ("usual", "Usual recordings, from good to bad");
    motions(&mut html, usual, &report.usual, report.is_of_several);
    let worst = ("worst", "The recordings that go wrong most");
    motions(&mut html, worst, &report.worst, report.is_of_several);
    html.push_str("</body>\n</html>\n");
    html
}

fn means(report: &Report) -> String {
    let elsewhere = elsewhere(report);
    let columns =
        [("values", false), ("mean distance, %", true), ("mean angle, °", true), (elsewhere, true)];
    let mut rows = String::new();
    for mean in &report.means {
        let [faces, tosses] = mean.other_face;
        let _ = writeln!(
            rows,
            "<tr class=\"first\"><th scope=\"row\">{}</th>{}{}{}</tr>",
            escape(&mean.name),
            number("mean distance, %", &format!("{:.2}", mean.position)),
            number("mean angle, °", &format!("{:.2}", mean.rotation)),
            number(elsewhere, &format!("{faces} of {tosses}"))
        );
    }
    table(&columns, &rows)
}

/// What those are that end with another attitude.
fn elsewhere(report: &Report) -> &'static str {
    if report.is_of_several { "more than 45° apart" } else { "on another face" }
}

fn parameters(report: &Report) -> String {
    let columns = [
        ("parameter", false),
        ("start", true),
        ("found", true),
        ("95 % of the bootstrap", true),
        ("to be said", false),
    ];
    let mut rows = String::new();
    for parameter in &report.parameters {
        let interval = match parameter.interval {
            Some([low, high]) => format!("{} to {}", figure(low), figure(high)),
            None => "—".to_owned(),
        };
        let _ = writeln!(
            rows,
            "<tr class=\"first\"><th scope=\"row\">{}</th>{}{}{}<td>{}</td></tr>",
            escape(&parameter.name),
            number("start", &figure(parameter.start)),
            number("found", &figure(parameter.value)),
            number("95 % of the bootstrap", &interval),
            escape(&parameter.note)
        );
    }
    table(&columns, &rows)
}

fn motions(html: &mut String, (id, title): (&str, &str), motions: &[Motion], is_of_several: bool) {
    if motions.is_empty() {
        return;
    }
    let _ = write!(html, "<section id=\"{id}\">\n<h2>{title}</h2>\n");
    for motion in motions {
        let _ = write!(
            html,
            "<h3>{} {}</h3>\n<p>{}</p>\n<div class=\"charts\">\n{}</div>\n",
            if is_of_several { "Recording" } else { "Toss" },
            escape(&motion.name),
            escape(&motion.words),
            charts::motion(motion)
        );
    }
    html.push_str("</section>\n");
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::{Means, Parameter, Toss};

    fn report() -> Report {
        let words = |text: &str| text.to_owned();
        let motion = Motion {
            name: words("7 <x>"),
            words: words("slides 3 mm too far & rests"),
            times: vec![0.0, 0.1, 0.2],
            recorded: vec![[0.0, 0.0, 0.3], [0.1, 0.0, 0.2], [0.2, 0.1, 0.1]],
            simulated: vec![[f64::NAN; 3], [0.1, 0.0, 0.2], [0.25, 0.1, 0.1]],
            angle: vec![f64::NAN, 0.0, 4.0],
        };
        Report {
            program: words("tumble"),
            scene: words("cube <b>"),
            is_of_several: false,
            facts: vec![words("3 tosses")],
            parameters: vec![Parameter {
                name: words("friction"),
                start: 0.2,
                value: 0.18,
                interval: Some([0.17, 0.19]),
                note: String::new(),
            }],
            means: vec![Means {
                name: words("found"),
                position: 12.5,
                rotation: 15.25,
                other_face: [1, 3],
            }],
            tosses: vec![Toss { position: [2.0, 1.0], rotation: [9.0, 90.0], other_face: true }; 3],
            progress: vec![2.0, 1.5],
            usual: vec![motion.clone()],
            worst: vec![motion],
            steps: 100,
            failed: 0,
        }
    }

    #[test]
    fn the_page_has_all_of_it_and_no_markup_of_others() {
        let page = page(&report());
        for part in ["12.50", "15.25", "1 of 3", "0.180000", "too far &amp; rests", "certified"] {
            assert!(page.contains(part), "{part}");
        }
        for wrong in ["NaN", "<b>", "<x>", "<script", "http://", "https://"] {
            assert!(!page.contains(wrong), "{wrong}");
        }
        assert_eq!(page.matches("<svg viewBox=\"0 0 440").count(), 4 + 8);
        assert_eq!(page.matches("circle class=\"ipopt\" cx").count(), 3 + 1);
    }

    #[test]
    fn of_several_bodies_no_face_is_spoken_of() {
        let facts = vec!["2 recordings".to_owned()];
        let page = page(&Report { is_of_several: true, facts, ..report() });
        assert!(page.contains("farthest off") && page.contains("more than 45° apart"));
        assert!(!page.contains("face") && !page.to_lowercase().contains("toss"));
    }

    #[test]
    fn failed_steps_are_said() {
        let page = page(&Report { failed: 2, ..report() });
        assert!(page.contains("2 steps did not converge") && !page.contains("is certified"));
    }
}
