//! Example programs: exit codes and physical checks of their output.

use crate::ROOT;
use crate::example::built;
use std::process::{Command, Output};

/// Runs an example.
fn run(example: &str, arguments: &[&str]) -> Output {
    let mut program = Command::new(built(example));
    program.args(arguments).current_dir(ROOT).output().unwrap()
}

fn printed(example: &str, arguments: &[&str], code: i32) -> String {
    let output = run(example, arguments);
    let errors = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{example} {arguments:?}: {errors}");
    String::from_utf8(output.stdout).unwrap()
}

/// Numbers of a line without other words.
fn numbers(line: &str) -> Vec<f64> {
    let words = line.split([' ', ';', ',', ':']);
    words.filter_map(|word| word.parse().ok()).collect()
}

fn line<'a>(text: &'a str, start: &str) -> &'a str {
    text.lines().find(|line| line.starts_with(start)).unwrap_or_else(|| panic!("{start}: {text}"))
}

#[test]
fn the_tossed_cube_ends_on_the_ground_with_its_weight_carried() {
    let text = printed("toss", &[], 0);
    let last = numbers(line(&text, "step 900"));
    assert_eq!(last, [900.0, 1.0, 98.1], "step, half side (m), 10 kg times 9.81 m/s²");
    let summary = text.lines().find(|line| line.contains("in contact")).unwrap();
    let [contact, failed, worst] = numbers(summary)[..] else { panic!("{summary}") };
    assert!(contact > 500.0 && failed == 0.0 && worst < 1e-9, "{summary}");
    assert!(numbers(line(&text, "the lowest corner"))[0].abs() < 1e-12, "{text}");
}

/// The sensitivities to push and mass are opposite and agree with finite differences. On its edge
/// the tower is an inverted pendulum.
#[test]
fn tower_tilt_depends_on_push_and_mass_and_not_on_friction() {
    let text = printed("tower", &[], 0);
    let pushed = numbers(line(&text, "  10.00"));
    let [_, tilt, by_push, difference, by_mass, friction, ..] = pushed[..] else {
        panic!("{text}")
    };
    assert!((by_push - difference).abs() < 2e-5 && (by_push + by_mass).abs() < 2e-5, "{text}");
    assert!(tilt > 0.1 && friction.abs() < 1e-9, "{text}");
    // The distance to the edge decays as e^{−pt} for the linear pendulum.
    let (rate, last) = (numbers(line(&text, "a push of")), numbers(line(&text, "    2.4")));
    assert!((last[3] - (0.75 * 9.81 / 0.1_f64.hypot(0.4)).sqrt()).abs() < 1e-3, "{text}");
    assert!(rate[0] > 9.5 && rate[0] < 10.5, "{text}");
}

/// Counts of `react_to_failure`: contact steps, failures by law, repeated steps, failed steps, and
/// the largest residual [m/s].
fn reaction(text: &str) -> (f64, f64, f64, f64, f64) {
    let contact = numbers(line(text, "400 steps"))[1];
    let laws = text.lines().filter(|line| line.starts_with("failed by"));
    let by_law = laws.map(|line| numbers(line)[0]).sum();
    let [repeated, unsolved, worst] = numbers(line(text, "repeated"))[..] else { panic!("{text}") };
    (contact, by_law, repeated, unsolved, worst)
}

#[test]
fn failed_steps_are_repeated() {
    let output = run("react_to_failure", &[]);
    let text = String::from_utf8(output.stdout).unwrap();
    let (contact, by_law, repeated, unsolved, worst) = reaction(&text);
    assert!(0.0 < repeated && repeated <= contact, "{text}");
    assert_eq!(by_law, repeated, "{text}");
    // Accepted residual of Ipopt, 0.1 m/s.
    assert!(worst <= 0.1, "{text}");
    let code = if unsolved > 0.0 { 3 } else { 0 };
    assert_eq!(output.status.code(), Some(code), "{text}");
}

/// Without iterations of Ipopt the native solver repeats every step. The exception is a step whose
/// candidates stay above the ground in free flight.
#[test]
fn without_an_iteration_every_step_that_needs_one_is_repeated() {
    let text = printed("react_to_failure", &["0"], 0);
    let (contact, by_law, repeated, unsolved, worst) = reaction(&text);
    assert!(contact > 50.0 && repeated > 30.0 && repeated <= contact, "{text}");
    assert_eq!((by_law, unsolved), (repeated, 0.0), "{text}");
    assert!(worst < 1e-9, "{text}");
}

#[test]
fn an_example_rejects_bad_numbers_in_one_sentence() {
    let output = run("react_to_failure", &["-1"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(output.stdout.is_empty());
    assert!(String::from_utf8_lossy(&output.stderr).contains("is needed, for example"));
}
