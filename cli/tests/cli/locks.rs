//! Redundant joints and gears: contradictions are refused, locked axes are reported.

use super::scenario::run_scenario;
use crate::ROOT;

/// Scene with two floating boxes without joints.
const BOXES: &str = r#"
steps = 5
[ground]
none = true
friction = 0.5
[[bodies]]
name = "a"
box = 0.1
mass = 1.0
position = [0, 0, 1]
[[bodies]]
name = "b"
box = 0.1
mass = 1.0
position = [0.3, 0, 1]
"#;

fn hinge(name: &str, bodies: &str, x: f64, axis: &str) -> String {
    format!(
        "[[joints]]\nname = \"{name}\"\ntype = \"revolute\"\nbodies = {bodies}\nanchor = [{x}, 0, 1]\naxis = {axis}\n"
    )
}

fn notes(tables: &str) -> String {
    let (end, _directory) = run_scenario(&format!("{BOXES}{tables}"), &[]);
    assert_eq!(end.code, Some(0), "{end:?}");
    end.stdout
}

/// Joints and prescribed motions without a common motion are refused with the names of both.
#[test]
fn constraints_without_common_motion_are_rejected() {
    let fixed = "[[joints]]\nname = \"f\"\ntype = \"fixed\"\nbodies = \"a\"\nanchor = [0, 0, 1]\n";
    let spun = |body: &str, spin: &str| format!("[[driven]]\nbody = \"{body}\"\nspin = {spin}\n");
    let between = hinge("h", "[\"a\", \"b\"]", 0.15, "[0, 0, 1]");
    for (tables, names) in [
        (format!("{fixed}{}", spun("a", "[0, 0, 1]")), ["a-drive", "f"]),
        (
            format!("{between}{}{}", spun("a", "[0, 0, 1]"), spun("b", "[0, 0, -2]")),
            ["h", "b-drive"],
        ),
    ] {
        let (end, _directory) = run_scenario(&format!("{BOXES}{tables}"), &[]);
        end.assert_refused(2, &["contradict each other", names[0], names[1]]);
    }
}

/// Two driven bodies with consistent motions make a hinge between them redundant, which a note
/// reports.
#[test]
fn hinge_between_consistent_driven_bodies_is_reported_redundant() {
    let turns = "spin = [0, 0, 1]\nabout = [0, 0, 1]\n";
    let driven = |body: &str| format!("[[driven]]\nbody = \"{body}\"\n{turns}");
    let between = hinge("h", "[\"a\", \"b\"]", 0.15, "[0, 0, 1]");
    let text = notes(&format!("{between}{}{}", driven("a"), driven("b")));
    assert!(text.contains("have 5 redundant constraints"), "{text}");
    assert!(text.contains("h, a-drive and b-drive together lock the axis of h"), "{text}");
}

/// Notes report axes that gears, crossed hinges or equal limits lock.
#[test]
fn locked_axes_are_reported() {
    let two = hinge("j", "\"a\"", 0.0, "[0, 0, 1]") + &hinge("w", "\"b\"", 0.3, "[0, 0, 1]");
    let gear = |ratio: f64| format!("[[gears]]\njoints = [\"j\", \"w\"]\nratio = {ratio}\n");
    let text = notes(&format!("{two}{}{}", gear(1.0), gear(2.0)));
    let both = "gears[0] and gears[1] together lock the axis of j and the axis of w";
    assert!(text.contains(both), "{text}");
    assert!(!text.contains("redundant"), "{text}");
    let text = notes(&format!("{two}{}", gear(0.0)));
    assert!(text.contains("gears[0] locks the axis of j: its ratio is 0"), "{text}");
    let text = notes(&format!("{two}{}", gear(3.0)));
    assert!(!text.contains("lock"), "{text}");

    let crossed = hinge("h1", "[\"a\", \"b\"]", 0.15, "[0, 0, 1]")
        + &hinge("h2", "[\"a\", \"b\"]", 0.15, "[0, 1, 0]");
    let text = notes(&crossed);
    assert!(text.contains("h1 and h2 have 4 redundant constraints"), "{text}");
    assert!(text.contains("h1 and h2 together lock the axis of h1 and the axis of h2"), "{text}");

    let stopped = hinge("h", "[\"a\", \"b\"]", 0.15, "[0, 0, 1]") + "limits = [0, 0]\n";
    let text = notes(&stopped);
    assert!(text.contains("h locks the axis of h: its limits are equal"), "{text}");
}

/// A planar loop in space has three redundant constraints and still moves. A chain has none.
#[test]
fn planar_loop_reports_redundancy_and_chain_does_not() {
    let scenario = |name: &str| format!("{ROOT}/scenarios/{name}.toml");
    let printed = |name: &str| {
        let directory = tempfile::tempdir().unwrap();
        let out = directory.path().to_str().unwrap();
        super::support::run(&[&scenario(name), "--steps", "3", "--out", out]).stdout
    };
    let loop_of_four = printed("four-bar");
    assert!(loop_of_four.contains("have 3 redundant constraints"), "{loop_of_four}");
    assert!(!loop_of_four.contains("together lock"), "{loop_of_four}");
    let door = printed("door");
    assert!(door.contains("upper-hinge and lower-hinge have 5 redundant"), "{door}");
    for name in ["chain", "double-pendulum"] {
        let text = printed(name);
        assert!(!text.contains("redundant") && !text.contains("lock"), "{name}: {text}");
    }
}
