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
fn what_no_motion_obeys_is_refused() {
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
fn two_driven_bodies_that_agree_are_said_to_hold_a_hinge_twice() {
    let turns = "spin = [0, 0, 1]\nabout = [0, 0, 1]\n";
    let driven = |body: &str| format!("[[driven]]\nbody = \"{body}\"\n{turns}");
    let between = hinge("h", "[\"a\", \"b\"]", 0.15, "[0, 0, 1]");
    let said = notes(&format!("{between}{}{}", driven("a"), driven("b")));
    assert!(said.contains("hold 5 of their directions more than once"), "{said}");
    assert!(said.contains("h, a-drive and b-drive together lock the axis of h"), "{said}");
}

/// Notes report axes that gears, crossed hinges or equal limits lock.
#[test]
fn axes_that_are_locked_are_said() {
    let two = hinge("j", "\"a\"", 0.0, "[0, 0, 1]") + &hinge("w", "\"b\"", 0.3, "[0, 0, 1]");
    let gear = |ratio: f64| format!("[[gears]]\njoints = [\"j\", \"w\"]\nratio = {ratio}\n");
    let said = notes(&format!("{two}{}{}", gear(1.0), gear(2.0)));
    let both = "gears[0] and gears[1] together lock the axis of j and the axis of w";
    assert!(said.contains(both), "{said}");
    assert!(!said.contains("more than once"), "{said}");
    let said = notes(&format!("{two}{}", gear(0.0)));
    assert!(said.contains("gears[0] locks the axis of j: its ratio is 0"), "{said}");
    let said = notes(&format!("{two}{}", gear(3.0)));
    assert!(!said.contains("lock"), "{said}");

    let crossed = hinge("h1", "[\"a\", \"b\"]", 0.15, "[0, 0, 1]")
        + &hinge("h2", "[\"a\", \"b\"]", 0.15, "[0, 1, 0]");
    let said = notes(&crossed);
    assert!(said.contains("h1 and h2 hold 4 of their directions more than once"), "{said}");
    assert!(said.contains("h1 and h2 together lock the axis of h1 and the axis of h2"), "{said}");

    let stopped = hinge("h", "[\"a\", \"b\"]", 0.15, "[0, 0, 1]") + "limits = [0, 0]\n";
    let said = notes(&stopped);
    assert!(said.contains("h locks the axis of h: its limits are equal"), "{said}");
}

/// A planar loop in space has three redundant constraints and still moves. A chain has none.
#[test]
fn a_loop_says_what_it_holds_twice_and_a_chain_nothing() {
    let scenario = |name: &str| format!("{ROOT}/scenarios/{name}.toml");
    let said = |name: &str| {
        let directory = tempfile::tempdir().unwrap();
        let out = directory.path().to_str().unwrap();
        super::support::run(&["--scenario", &scenario(name), "--steps", "3", "--out", out]).stdout
    };
    let loop_of_four = said("four-bar");
    assert!(loop_of_four.contains("hold 3 of their directions more than once"), "{loop_of_four}");
    assert!(!loop_of_four.contains("together lock"), "{loop_of_four}");
    let door = said("door");
    assert!(door.contains("upper-hinge and lower-hinge hold 5 of their"), "{door}");
    for name in ["chain", "double-pendulum"] {
        let said = said(name);
        assert!(!said.contains("more than once") && !said.contains("lock"), "{name}: {said}");
    }
}
