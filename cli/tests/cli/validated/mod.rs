//! `tumble validate`: tables, exit codes, refusals and the page.

mod markup;
use crate::support;

use crate::support::{End, LIMIT, everything_in, run, tumble};
use markup::Markup;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;
use tempfile::TempDir;
use tumble_core::solver::native::NativeSolver;
use tumble_validation::{Convergence, PROBLEMS, Runner, TestProblem, TestQuantity};

/// Finished validation in a temporary directory.
struct Validated {
    end: End,
    directory: TempDir,
}

fn validate(args: &[&str]) -> Validated {
    let directory = tempfile::tempdir().unwrap();
    let mut command = tumble();
    command.arg("validate").args(args).arg("--out").arg(directory.path().join("out"));
    let end = command.output().unwrap().into();
    Validated { end, directory }
}

impl Validated {
    fn page(&self) -> String {
        fs::read_to_string(self.directory.path().join("out/validation.html")).unwrap()
    }

    /// Cells of the rows of `quantity` in the table of `problem`, from the solver on.
    fn rows(&self, problem: &str, quantity: &str) -> Vec<Vec<&str>> {
        let lines = self.end.stdout.lines();
        let table: Vec<&str> = lines
            .skip_while(|line| !line.starts_with(&format!("{problem}: ")))
            .take_while(|line| !line.is_empty())
            .collect();
        let start = table.iter().position(|line| line.starts_with(&format!("  {quantity}  ")));
        let start = start.unwrap_or_else(|| panic!("{problem}, {quantity}: {table:?}"));
        let solver = |line: &str| ["native", "ipopt"].into_iter().find_map(|name| line.find(name));
        let begin = solver(table[start]).unwrap();
        let rows = table[start..].iter().enumerate();
        rows.take_while(|(i, line)| *i == 0 || line.starts_with("     "))
            .map(|(_, line)| line[begin..].split_whitespace().collect())
            .collect()
    }
}

/// Quantities computed by the library with the default inputs.
fn quantities(problem: &TestProblem) -> Vec<TestQuantity> {
    let native = |model: &_| Ok(Box::new(NativeSolver::new(model)) as _);
    let inputs = problem.inputs();
    let mut runner = Runner::new(&native, inputs.time_step);
    problem.solve(&inputs, &mut runner).unwrap().quantities
}

/// The native solver satisfies every quantity, and table and page agree with the library.
#[test]
#[ignore = "slow"]
fn the_native_solver_has_every_answer_in_the_table_and_on_the_page() {
    let validated = validate(&["--solver", "native"]);
    let end = &validated.end;
    assert_eq!((end.code, end.stderr.as_str()), (Some(0), ""), "{}", end.stdout);
    assert_eq!(
        everything_in(validated.directory.path()),
        ["out", "out/validation.html"].map(PathBuf::from)
    );
    let text = validated.page();
    let page = Markup::read(&text);
    let mut count = 0;
    for problem in &PROBLEMS {
        let name = problem.name;
        let section = page.element("section", name);
        assert!(section.contains("class=\"native\""), "{name} has no curve");
        assert!(!section.contains("class=\"ipopt\""), "{name}");
        for quantity in quantities(problem) {
            let rows = validated.rows(name, quantity.name);
            assert_eq!(rows.len(), 1, "{name}, {}", quantity.name);
            let [solver, h, exact, discrete, measured, error, allowed, order, verdict] =
                rows[0][..]
            else {
                panic!("{rows:?}")
            };
            assert_eq!((solver, verdict), ("native", "holds"), "{name}, {}", quantity.name);
            let number = |text: &str| text.parse::<f64>().unwrap();
            assert_eq!(number(h), problem.inputs().time_step);
            // Tolerances by the number of printed digits.
            for (shown, value, digits) in [
                (exact, quantity.exact, 1e-2),
                (discrete, quantity.discrete, 1e-2),
                (measured, quantity.measured, 1e-2),
                (error, quantity.error(), 0.1),
                (allowed, quantity.tolerance, 0.1),
            ] {
                assert!((number(shown) - value).abs() <= digits * value.abs(), "{name}: {rows:?}");
            }
            match quantity.convergence {
                Convergence::Exact => assert_eq!(order, "exact"),
                Convergence::Order(p) => assert!((number(order) - f64::from(p)).abs() < 0.1),
                Convergence::Within(bound) => {
                    let shown = number(order.strip_prefix('≤').unwrap());
                    assert!((shown - bound).abs() < 0.1 * bound);
                }
                Convergence::Unresolved => panic!("{name}, {}: too coarse", quantity.name),
            }
            let heading = match quantity.unit {
                "1" => format!(">{}</th>", quantity.name),
                unit => format!(">{}, {unit}</th>", quantity.name),
            };
            assert_eq!(section.matches(&heading).count(), 1, "{name}: {heading}");
            count += 1;
        }
    }
    assert!(end.stdout.ends_with(&format!("\n{count} of {count} quantities hold\n")));
    assert_eq!(text.matches("<td class=\"verdict good\">holds</td>").count(), 3 * count);
    assert!(page.element("section", "compass").contains("slope 1"));
}

#[test]
fn the_page_needs_nothing_else_and_is_the_same_every_time() {
    let args = ["--solver", "native", "rocking", "tumble", "slope-stick"];
    let (first, again) = (validate(&args), validate(&args));
    let page = first.page();
    assert!(page == again.page());
    assert_eq!(first.end.code, Some(0));
    for outside in ["http:", "https:", "<script", "<link", "<img", "url(", "@import", "src="] {
        assert!(!page.contains(outside), "{outside}");
    }
    for wrong in ["NaN", "inf<", "Infinity"] {
        assert!(!page.contains(wrong), "{wrong}");
    }
    for needed in ["prefers-color-scheme: dark", "width=device-width", tumble::ipopt::VERSION] {
        assert!(page.contains(needed), "{needed}");
    }
    let markup = Markup::read(&page);
    // The page has the requested problems in the given order.
    assert_eq!(markup.ids("section"), ["rocking", "tumble", "slope-stick"]);
    assert_eq!(page.matches("<a href=\"#").count(), 3);
    // The energy of a tumbling cube has no closed form over time.
    assert!(!markup.element("section", "tumble").contains("closed form"));
    assert!(markup.element("section", "slope-stick").contains("closed form"));
}

#[test]
fn both_solvers_stand_side_by_side() {
    let validated = validate(&["free-fall", "slope-slide"]);
    assert_eq!(validated.end.code, Some(0), "{:?}", validated.end);
    assert!(validated.end.stdout.ends_with("12 of 12 quantities hold\n"));
    let rows = validated.rows("slope-slide", "way down the slope");
    let solvers: Vec<_> = rows.iter().map(|row| (row[0], row[1], row[8])).collect();
    assert_eq!(solvers, [("native", "0.002", "holds"), ("ipopt", "0.01", "holds")]);
    for row in &rows {
        assert_eq!(row[7], "1.00", "the step is first order: {row:?}");
    }
    for line in ["  native: 7000 steps", "  ipopt: 600 steps at h = 0.01, 0.005 s, 0 not converged"]
    {
        assert!(validated.end.stdout.contains(line), "{line}: {}", validated.end.stdout);
    }
    let text = validated.page();
    let section = Markup::read(&text).element("section", "slope-slide").to_owned();
    for needed in ["class=\"exact\"", "<path class=\"native\"", "<circle class=\"ipopt\"", "guide"]
    {
        assert!(section.contains(needed), "{needed}");
    }
}

/// Problems that Ipopt cannot solve are left out and named with the reason. If no problem remains,
/// the command is refused.
#[test]
fn problems_that_ipopt_does_not_take_are_named() {
    let args = ["free-fall", "collision", "mass-ratio", "--dt", "0.01"];
    let left_out = "left out with Ipopt: mass-ratio: with such mass ratios, it solves a few percent \
                    of the steps only from the native solution\n";
    let both = validate(&args);
    assert_eq!(both.end.code, Some(0), "{:?}", both.end);
    assert!(both.end.stdout.contains(left_out), "{}", both.end.stdout);
    assert!(both.end.stdout.contains("collision: mass 2 kg,"), "{}", both.end.stdout);
    assert_eq!(both.rows("mass-ratio", "longest way of a box").len(), 1);
    assert_eq!(both.rows("collision", "energy lost").len(), 2);
    assert_eq!(both.rows("free-fall", "height fallen").len(), 2);

    let ipopt = validate(&[&args[..], &["--solver", "ipopt"]].concat());
    assert_eq!(ipopt.end.code, Some(0), "{:?}", ipopt.end);
    assert!(ipopt.end.stdout.contains(left_out), "{}", ipopt.end.stdout);
    assert!(ipopt.end.stdout.ends_with("9 of 9 quantities hold\n"), "{}", ipopt.end.stdout);
    let native = validate(&[&args[..], &["--solver", "native"]].concat());
    assert!(!native.end.stdout.contains("left out"));

    let directory = tempfile::tempdir().unwrap();
    let mut command = tumble();
    command.args(["validate", "mass-ratio", "turntable", "--solver", "ipopt"]);
    let end = End::from(command.current_dir(directory.path()).output().unwrap());
    end.assert_refused(2, &["--solver ipopt", "mass-ratio", "turntable", "--solver native"]);
    assert!(everything_in(directory.path()).is_empty());
}

/// Validation succeeds for a box that stops within the first few steps.
#[test]
fn a_box_that_stops_at_once_has_its_answer() {
    for speed in ["0.01", "0.02", "0.05", "0.1"] {
        let args = ["spinning-box", "--solver", "native", "--speed", speed];
        for others in [&[][..], &["--mu", "0.9"], &["--dt", "0.01"], &["--gravity", "2"]] {
            let validated = validate(&[&args[..], others].concat());
            assert_eq!(validated.end.code, Some(0), "{others:?}: {}", validated.end.stdout);
            assert!(validated.end.stdout.ends_with("3 of 3 quantities hold\n"));
        }
    }
    let validated = validate(&["spinning-box", "--solver", "native", "--speed", "0.05"]);
    assert!(validated.end.stdout.contains("coarse"), "{}", validated.end.stdout);
}

/// Inputs apply only to the problems that depend on them.
#[test]
fn other_inputs_go_to_the_problems_that_depend_on_them() {
    let args = ["--slope", "35", "--mu", "0.5", "--mass", "7", "--dt", "0.004"];
    let validated =
        validate(&[&["slope-slide", "rocking", "--solver", "native"], &args[..]].concat());
    assert_eq!(validated.end.code, Some(0), "{:?}", validated.end);
    for line in [
        "slope-slide: mass 7 kg, mu 0.5, gravity 9.81 m/s², slope 35 °\n",
        "rocking: mass 7 kg, gravity 9.81 m/s², speed 0.9 of the spin that topples it\n",
    ] {
        assert!(validated.end.stdout.contains(line), "{line}: {}", validated.end.stdout);
    }
    // ½ g (sin θ − μ cos θ) t² after 2 s.
    let (sin, cos) = 35.0_f64.to_radians().sin_cos();
    let way: f64 = validated.rows("slope-slide", "way down the slope")[0][2].parse().unwrap();
    assert!((way - 2.0 * 9.81 * (sin - 0.5 * cos)).abs() < 1e-4, "{way}");
    assert!(validated.page().contains("--mass 7 --mu 0.5 --slope 35 --dt 0.004"));
}

#[test]
fn the_list_names_every_problem_with_its_inputs() {
    let end = run(&["validate", "--list"]);
    assert_eq!((end.code, end.stderr.as_str()), (Some(0), ""));
    let names: Vec<_> = end.stdout.lines().filter(|line| !line.starts_with(' ')).collect();
    assert_eq!(names, PROBLEMS.map(|problem| problem.name));
    for problem in &PROBLEMS {
        assert!(end.stdout.contains(problem.about));
    }
    let spinning = "inputs: mass 1 kg, mu 0.3, gravity 9.81 m/s², speed 10 rad/s, dt 0.002 s";
    assert!(end.stdout.contains(spinning));
    let one = run(&["validate", "--list", "compass"]);
    assert!(one.stdout.starts_with("compass\n") && one.stdout.lines().count() == 3, "{one:?}");
}

#[test]
fn quiet_is_silent_and_the_help_tells_the_exit_codes() {
    let validated = validate(&["free-fall", "--solver", "native", "--quiet"]);
    let end = &validated.end;
    assert_eq!((end.code, end.stdout.as_str(), end.stderr.as_str()), (Some(0), "", ""));
    assert!(validated.page().contains("free-fall"));
    let help = run(&["validate", "--help"]).stdout;
    for word in ["1 a quantity is off", "--slope", "five times that", "validation.html"] {
        assert!(help.contains(word), "{word}");
    }
}

/// Refused arguments and the strings that the error line must contain.
const REFUSED: [(&[&str], &[&str]); 17] = [
    (&["wrong"], &["wrong", "free-fall", "tumble", "slope-topple"]),
    (&["free-fall", "wrong"], &["wrong", "rocking"]),
    (&["free-fall", "--slope", "3"], &["--slope", "free-fall"]),
    (&["pushed-over", "slope-topple", "--mu", "0.3"], &["--mu", "pushed-over, slope-topple"]),
    (&["--mass", "nan"], &["--mass", "nan", "finite"]),
    (&["--mass", "-1"], &["free-fall", "--mass -1", "0.001 to"]),
    (&["slope-slide", "--slope", "90"], &["slope-slide", "--slope 90", "0 to 80"]),
    (&["slope-slide", "--mu", "2.5", "--slope", "75"], &["slope-slide", "--mu 2.5", "tips"]),
    (&["sliding-stop", "--mu", "3"], &["sliding-stop", "--mu 3", "tips", "1.42"]),
    (&["--speed", "3"], &["rocking", "--speed 3", "0.3 to 0.98"]),
    (&["dragged-cube", "--mass", "7"], &["dragged-cube", "--mass 7", "18 N"]),
    (&["slope-stick", "--dt", "1e-5"], &["slope-stick", "--dt 1e-5", "million steps"]),
    (&["--dt", "0"], &["--dt", "4e-6 to 0.1"]),
    (&["--dt", "nan"], &["--dt"]),
    (&["--solver", "wrong"], &["--solver", "native", "ipopt", "both"]),
    (&["--list", "--quiet"], &["--list", "--quiet"]),
    (&["sliding-stop", "--speed", "1e300"], &["sliding-stop", "--speed 1e300"]),
];

#[test]
fn bad_input_is_refused_in_one_line_before_anything_is_written() {
    let directory = tempfile::tempdir().unwrap();
    for (args, words) in REFUSED {
        let mut command = tumble();
        let output = command.arg("validate").args(args).current_dir(directory.path()).output();
        let end = End::from(output.unwrap());
        end.assert_refused(2, words);
        // The longest error lists all problems.
        assert!(end.stderr.len() < 620, "{}", end.stderr);
    }
    assert!(everything_in(directory.path()).is_empty());
}

#[test]
fn a_place_that_cannot_be_written_is_told_before_the_first_run() {
    let directory = tempfile::tempdir().unwrap();
    fs::create_dir_all(directory.path().join("out/validation.html")).unwrap();
    let places = [("out", 1, "is a directory"), ("/dev/null/below", 2, "cannot be created")];
    for (out, code, word) in places {
        let mut command = tumble();
        command.args(["validate", "--solver", "native", "--out", out]);
        let end = End::from(command.current_dir(directory.path()).output().unwrap());
        end.assert_refused(code, &[word]);
    }
    assert_eq!(everything_in(directory.path()), ["out", "out/validation.html"].map(PathBuf::from));
}

#[cfg(unix)]
#[test]
fn ctrl_c_ends_it_without_a_page() {
    let directory = tempfile::tempdir().unwrap();
    let out = directory.path().join("out");
    let mut command = std::process::Command::new(support::PROGRAM);
    command.args(["validate", "tumble", "--solver", "ipopt", "--dt", "0.0005", "--out"]);
    let mut child = command.arg(&out).spawn().unwrap();
    // The temporary file exists once the signal handlers are installed and the first run has not
    // begun.
    let begin = std::time::Instant::now();
    while !out.exists() || everything_in(&out).is_empty() {
        assert!(begin.elapsed() < LIMIT && child.try_wait().unwrap().is_none());
        std::thread::sleep(Duration::from_millis(5));
    }
    let id = child.id().to_string();
    assert!(
        std::process::Command::new("kill").args(["-s", "INT", &id]).status().unwrap().success()
    );
    assert_eq!(child.wait().unwrap().code(), Some(130));
    assert_eq!(everything_in(directory.path()), [Path::new("out")]);
}
