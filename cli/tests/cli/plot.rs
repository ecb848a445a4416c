//! `tumble plot` and `--plot`: pictures of ordinary, long and unusual runs.

use crate::picture::{ENERGY, MOTION, Svg, png_size};
use crate::support::{
    CONTACT_RUN, End, FAILING_RUN, Simulated, WRITTEN, everything_in, run, simulate, tumble,
    two_impacts,
};
use std::fs;
use std::path::Path;

const PICTURES: [&str; 4] = ["plot.png", "plot.svg", "plot-energy.png", "plot-energy.svg"];

/// Runs a simulation with `--plot` and reads its two SVGs.
fn simulate_and_plot(args: &[&str]) -> (Simulated, Svg, Svg) {
    let simulated = simulate(&[args, &["--plot"]].concat());
    let svg = |name| Svg::read(&simulated.path(name));
    let (motion, energy) = (svg("plot.svg"), svg("plot-energy.svg"));
    for (name, picture) in [("plot.png", &motion), ("plot-energy.png", &energy)] {
        let (width, height) = png_size(&simulated.path(name));
        assert_eq!((width, height), (2400, (2.0 * picture.height).round() as u32), "{name}");
    }
    assert_eq!((motion.width, energy.width), (1200.0, 1200.0));
    (simulated, motion, energy)
}

fn plot(file: &Path, args: &[&str]) -> End {
    tumble().arg("plot").arg(file).args(args).output().unwrap().into()
}

/// The force axis shows both an impact of 20 000 N and the weight of 98 N.
#[test]
fn plot_with_impacts_still_resolves_the_weight() {
    let (_, motion, _) = simulate_and_plot(&["--steps", "1000", "--solver", "native"]);
    let label = motion.panel("force").label;
    assert!(label.contains("symlog axis, linear below 100 N"), "{label}");
}

#[test]
fn the_sheets_have_their_panels_labels_and_curves() {
    let (simulated, motion, energy) = simulate_and_plot(&CONTACT_RUN);
    assert_eq!((simulated.end.code, simulated.end.stderr.as_str()), (Some(0), ""));
    for name in PICTURES {
        assert!(simulated.end.stdout.contains(name), "{name}: {}", simulated.end.stdout);
    }
    for (picture, panels) in [(&motion, MOTION.as_slice()), (&energy, &ENERGY)] {
        assert_eq!(picture.panels(), panels.iter().map(|panel| panel.0).collect::<Vec<_>>());
        for (id, label, curves) in panels {
            let panel = picture.panel(id);
            assert!(panel.label.starts_with(label), "{id}: {}", panel.label);
            assert_eq!(panel.curves.len(), *curves, "{id}");
        }
        assert!(picture.text.contains("time t (s)"));
        assert!(picture.text.contains("drop scene, seed 42, ipopt"));
    }
    assert!(energy.panel("residual").label.contains("log axis"));
    for name in ["kinetic", "potential", "total"] {
        assert!(energy.panel("energy").legend.contains(&name.to_owned()), "{name}");
    }
}

#[test]
fn two_impacts_in_200_000_rows_are_plotted() {
    let directory = two_impacts(200_000, "converged");
    let end = plot(&directory.path().join("states.csv"), &[]);
    assert_eq!((end.code, end.stderr.as_str()), (Some(0), ""));

    let motion = Svg::read(&directory.path().join("plot.svg"));
    let z = &motion.panel("z").curves[0];
    // SVG coordinates grow downwards. The heights have the ratio (9 − 1) to (1 + 3).
    let level = z[0].1;
    let (low, high) = z
        .iter()
        .fold((f64::MAX, f64::MIN), |(low, high), point| (low.min(point.1), high.max(point.1)));
    let ratio = (level - low) / (high - level);
    assert!((ratio - 2.0).abs() < 0.01, "{ratio}");
    let column = |row: f64| 88.0 + 1080.0 * row / 199_999.0;
    let peak = z.iter().find(|point| point.1 == low).unwrap().0;
    assert!((peak - column(77_777.0)).abs() <= 0.02, "{peak}");

    // The impact is visible above the weight.
    let curve = &motion.panel("force").curves[0];
    let (weight, top) = (curve[0].1, curve.iter().map(|point| point.1).fold(f64::MAX, f64::min));
    assert!(weight - top > 60.0, "{weight} {top}");
    assert!(motion.text.len() < 1_000_000, "{}", motion.text.len());

    let energy = Svg::read(&directory.path().join("plot-energy.svg"));
    assert_eq!(energy.panel("residual").legend, ["failed (1)"]);
}

#[test]
fn a_single_row_has_a_state_and_no_panels_of_steps() {
    let (simulated, motion, energy) = simulate_and_plot(&["--steps", "1"]);
    assert_eq!(simulated.end.code, Some(0));
    for (picture, id) in [(&motion, "z"), (&energy, "energy"), (&energy, "height")] {
        let panel = picture.panel(id);
        assert!(panel.dots > 0, "{id}");
    }
    for id in ["force", "contacts"] {
        assert!(!motion.panels().contains(&id), "{id}");
    }
}

#[test]
fn a_floating_cube_has_no_panels_of_contacts() {
    let (simulated, motion, energy) = simulate_and_plot(&["--scene", "floating"]);
    assert_eq!(simulated.end.code, Some(0));
    assert!(!motion.panels().contains(&"force") && !energy.panels().contains(&"iterations"));
    assert_eq!(energy.panel("energy").curves.len(), 3);
}

#[test]
fn failed_steps_are_marked_and_a_drawn_run_keeps_its_exit_code() {
    let (simulated, _, energy) = simulate_and_plot(&FAILING_RUN);
    assert_eq!(simulated.end.code, Some(3));
    let failed = simulated.run_json()["summary"]["failed"].as_u64().unwrap();
    let panel = energy.panel("residual");
    assert!(panel.legend.contains(&format!("failed ({failed})")), "{:?}", panel.legend);
    assert!(panel.marks.iter().any(|mark| mark == "failed"), "{:?}", panel.marks);
    // Drawing a run with failed steps succeeds.
    assert_eq!(plot(&simulated.path("states.csv"), &[]).code, Some(0));
}

#[test]
fn quiet_runs_draw_and_say_nothing() {
    let simulated = simulate(&["--steps", "3", "--plot", "--quiet"]);
    assert_eq!((simulated.end.code, simulated.end.stdout.as_str()), (Some(0), ""));
    assert!(simulated.path("plot.png").is_file());
}

#[test]
fn a_title_from_a_file_cannot_break_the_picture() {
    let simulated = simulate(&["--steps", "3"]);
    let text = fs::read_to_string(simulated.path("run.json")).unwrap();
    let text = text.replace("\"drop\"", r#""</text><b a=\"&\u0001\uffff""#);
    fs::write(simulated.path("run.json"), text).unwrap();
    let end = plot(&simulated.path("states.csv"), &[]);
    assert_eq!((end.code, end.stderr.as_str()), (Some(0), ""));
    let svg = Svg::read(&simulated.path("plot.svg"));
    assert!(svg.text.contains("&lt;/text&gt;&lt;b a=&quot;&amp;"), "{}", &svg.text[..400]);
}

/// A long name is shortened in the middle and characters without a glyph are counted. The SVG's
/// title keeps the full name.
#[test]
fn long_names_are_shortened_and_missing_glyphs_counted() {
    let simulated = simulate(&["--steps", "3"]);
    let text = fs::read_to_string(simulated.path("run.json")).unwrap();
    let name = format!("立方体 {}", "W".repeat(76));
    fs::write(simulated.path("run.json"), text.replace("\"drop\"", &format!("{name:?}"))).unwrap();
    assert_eq!(plot(&simulated.path("states.csv"), &[]).code, Some(0));
    let svg = Svg::read(&simulated.path("plot.svg"));
    assert!(svg.text.contains("Motion and contact of body: ??? WWW"), "{}", &svg.text[..2400]);
    assert!(svg.text.contains("…") && svg.text.contains("seed 42, ipopt</text>"));
    assert!(svg.text.contains("“?” stands for 3 characters"));
    assert!(svg.text.contains(&format!("<title>Motion and contact of body: {name}")));
}

/// A scene without ground shows no friction coefficient.
#[test]
fn a_floating_cube_has_no_friction() {
    let (_, motion, _) = simulate_and_plot(&["--scene", "floating", "--steps", "3"]);
    assert!(motion.text.contains("1 body") && !motion.text.contains("μ = "));
}

#[test]
fn what_cannot_be_read_or_written_is_one_sentence() {
    let simulated = simulate(&["--steps", "3"]);
    let file = simulated.path("states.csv");
    run(&["plot"]).assert_refused(2, &["FILE.csv"]);
    plot(Path::new("/nowhere/x.csv"), &[]).assert_refused(2, &["/nowhere/x.csv", "does not exist"]);
    plot(&file, &["--steps", "3"]).assert_refused(2, &["--steps"]);
    plot(&simulated.path("run.json"), &[])
        .assert_refused(2, &["run.json", "is not a table of the run"]);

    let occupied = simulated.path("occupied");
    fs::write(&occupied, "").unwrap();
    plot(&file, &["--out", occupied.to_str().unwrap()]).assert_refused(2, &["occupied"]);
    fs::create_dir(simulated.path("plot.svg")).unwrap();
    plot(&file, &[]).assert_refused(1, &["plot.svg", "is a directory"]);

    let steps = simulated.path("steps.csv");
    let cut = fs::read_to_string(&steps).unwrap().replace(",end,", ",free,");
    fs::write(&steps, cut).unwrap();
    plot(&file, &[]).assert_refused(2, &["status `end`"]);
    let names: Vec<_> = everything_in(&simulated.path(""));
    assert_eq!(names.len(), WRITTEN.len() + 2, "nothing is left behind: {names:?}");
}
