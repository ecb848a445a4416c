//! `--threads`: files do not depend on the number of threads, and the flag is refused if it has no
//! effect.

use super::scenario::run_scenario;
use super::support::run;
use serde_json::Value;
use std::fs;

/// Scene of sixty boxes: heaps that fall and bounce, and single boxes between them.
const HEAPS: &str = r#"
    steps = 400
    [ground]
    friction = 0.5
    restitution = 0.3
    [[bodies]]
    name = "heap"
    box = [0.3, 0.25, 0.2]
    density = 500.0
    position = [0.0, 0.0, 0.3]
    attitude = "random"
    jitter = 0.03
    copies = { count = [4, 3, 4], step = [2.0, 2.0, 0.5] }
    [[bodies]]
    name = "single"
    box = 0.2
    mass = 1.0
    position = [1.0, 1.0, 0.2]
    attitude = "random"
    velocity = [0.5, 0.0, 0.0]
    copies = { count = [4, 3, 1], step = [2.0, 2.0, 1.0] }
"#;

#[test]
fn the_files_are_the_same_on_any_number_of_threads() {
    let files = |flags: &[&str]| {
        let (end, directory) = run_scenario(HEAPS, flags);
        assert_eq!(end.code, Some(0), "{end:?}");
        let out = directory.path().join("out");
        let read = |name: &str| fs::read_to_string(out.join(name)).unwrap();
        let tables = ["states.csv", "contacts.csv", "steps.csv"].map(read);
        let mut json: Value = serde_json::from_str(&read("run.json")).unwrap();
        // The solve time differs between runs.
        let seconds = json["summary"].as_object_mut().unwrap().remove("solve_seconds");
        assert!(seconds.is_some(), "{json}");
        (tables, json)
    };
    let expected = files(&[]);
    assert!(expected.0[1].lines().count() > 10_000, "few contacts");
    for threads in ["1", "2", "3", "8"] {
        assert!(files(&["--threads", threads]) == expected, "{threads} threads");
    }
}

/// `--threads` is refused with a single body.
#[test]
fn threads_are_rejected_where_they_have_no_effect() {
    let two = "[[bodies]]\nbox = 1.0\nmass = 1.0\nposition = [0, 0, 1]\n";
    let two = format!("steps = 5\n[ground]\nfriction = 0.1\n{two}{}", two.replace("0, 0", "3, 0"));
    let one = two.rsplit_once("[[bodies]]").unwrap().0;
    let (end, _directory) = run_scenario(one, &["--threads", "2"]);
    end.assert_refused(2, &["--threads", "no meaning", "one body", "leave it out"]);
    for flags in [&["--threads", "2"][..], &["--scene", "floating", "--threads", "1"]] {
        run(flags).assert_refused(2, &["--threads", "no meaning", "one body", "leave it out"]);
    }
    let flags = ["--solver", "native", "--threads", "2"];
    run(&flags).assert_refused(2, &["--threads", "no meaning", "one body", "leave it out"]);
}
