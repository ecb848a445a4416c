//! `tumble verify` compares status words and run.json with the rows.

use super::scenario::run_scenario;
use super::support::{End, Table, contact_files, contact_run, run, simulate};
use super::verify::{changed, verify};
use serde_json::{Value, json};
use std::fs;

/// Verifies the contact run with a changed run.json.
fn with_run_json(change: impl FnOnce(&mut Value)) -> End {
    let directory = contact_files();
    let path = directory.path().join("run.json");
    let mut json: Value = serde_json::from_str(&fs::read_to_string(&path).unwrap()).unwrap();
    change(&mut json);
    fs::write(path, json.to_string()).unwrap();
    verify(directory.path(), &[])
}

/// Index of the first step with a contact force.
fn first_contact() -> usize {
    let contacts = Table::parse(&contact_run()[1]);
    let forces = contacts.numbers("force_z_N");
    let row = forces.iter().position(|force| *force > 0.0).unwrap();
    contacts.texts("k")[row].parse().unwrap()
}

/// Contact statuses without possible contact, and `free` with forces, are reported.
#[test]
fn status_that_contradicts_its_row_is_reported() {
    let touching = first_contact();
    for (k, status, words) in [
        (3, "converged", "nothing can touch"),
        (3, "fallback", "nothing can touch"),
        (touching, "free", "it has forces"),
    ] {
        let directory = changed("steps.csv", |table| {
            let column = table.column("status");
            table.rows[k][column] = status.to_owned();
        });
        let end = verify(directory.path(), &[]);
        assert_eq!((end.code, end.stderr.as_str()), (Some(1), ""), "{status}: {end:?}");
        assert!(end.stdout.contains(&format!("`{status}`, but {words}")), "{status}: {end:?}");
    }
}

/// A changed but plausible status contradicts the counts in run.json.
#[test]
fn plausible_changed_status_is_found_by_the_counts() {
    for status in ["fallback", "retried", "wild", "failed"] {
        let directory = changed("steps.csv", |table| {
            let column = table.column("status");
            table.rows[first_contact()][column] = status.to_owned();
        });
        let end = verify(directory.path(), &[]);
        assert_eq!(end.code, Some(1), "{status}: {end:?}");
        assert!(end.stdout.contains("run.json differs from the rows"), "{status}: {end:?}");
        assert!(end.stdout.contains(&format!("summary.{status} is ")), "{status}: {end:?}");
    }
}

#[test]
fn run_json_of_other_rows_is_reported_with_its_field() {
    type Change = fn(&mut Value);
    let cases: [(&str, Change); 8] = [
        ("the start differs from the first row", |json| {
            json["model"]["bodies"][0]["position"][0] = json!(0.25)
        }),
        ("the seed 43 draws a different start of body", |json| json["seed"] = json!(43)),
        ("complete with 241 rows requested", |json| json["steps"] = json!(241)),
        ("summary.rows is 239", |json| json["summary"]["rows"] = json!(239)),
        ("summary.iterations", |json| json["summary"]["iterations"] = json!(7)),
        ("certificate_median_m_s is", |json| {
            json["summary"]["certificate_median_m_s"] = json!(1e-13);
        }),
        ("certificate_max_m_s is null", |json| {
            json["summary"]["certificate_max_m_s"] = Value::Null;
        }),
        ("done with 240 rows requested", |json| json["outcome"] = json!("done")),
    ];
    for (words, change) in cases {
        let end = with_run_json(change);
        assert_eq!((end.code, end.stderr.as_str()), (Some(1), ""), "{words}: {end:?}");
        assert!(end.stdout.contains(words), "{words}: {end:?}");
    }
}

/// Scene with random starts in the world and ground frames: single bodies, a grid and a ring.
const DRAWN: &str = r#"
steps = 5
seed = 7
[ground]
friction = 0.5
normal = [0.1, 0.0, 1.0]
[[bodies]]
name = "thrown"
box = 0.2
mass = 1.0
position = [0.0, 0.0, 3.0]
attitude = "random"
jitter = [0.0, 0.3, 0.1]
copies = { count = [2, 1, 1], step = [2.0, 0.0, 0.0] }
[[bodies]]
name = "told"
sphere = 0.1
mass = 1.0
position = [0.0, 0.0, 6.0]
[[bodies]]
name = "seen"
box = [0.1, 0.2, 0.3]
mass = 1.0
frame = "ground"
position = [0.0, 2.0, 3.0]
jitter = 0.1
ring = { count = 3, degrees = 30 }
"#;

/// The seed in run.json must reproduce the random starts, also in a continued run.
#[test]
fn a_seed_of_several_bodies_draws_their_starts() {
    let (end, directory) = run_scenario(DRAWN, &[]);
    assert_eq!(end.code, Some(0), "{end:?}");
    let out = directory.path().join("out");
    let path = out.join("run.json");
    let steps = out.join("steps.csv");
    let verify = || run(&["verify", steps.to_str().unwrap()]);
    assert_eq!(verify().code, Some(0), "{:?}", verify());
    let end = run(&["--continue", out.to_str().unwrap(), "--steps", "9", "--quiet"]);
    assert_eq!(end.code, Some(0), "{end:?}");
    assert_eq!(verify().code, Some(0), "{:?}", verify());

    let text = fs::read_to_string(&path).unwrap();
    type Change = fn(&mut Value);
    let cases: [(&str, Change); 6] = [
        ("the seed 8 draws a different start of thrown-0", |json| json["seed"] = json!(8)),
        ("a different start of seen-1", |json| {
            json["model"]["bodies"][4]["drawn"]["jitter"] = json!([0.2, 0.1, 0.1]);
        }),
        ("a different start of thrown-1", |json| {
            json["model"]["bodies"][1]["drawn"]["position"][0] = json!(2.5);
        }),
        ("a different start of seen-0", |json| {
            json["model"]["bodies"][3]["drawn"]["ground"] = json!(false);
        }),
        ("drawn contradicts the starts", |json| json["drawn"] = json!(false)),
        ("a different start of thrown-1", |json| {
            json["model"]["bodies"][0]["drawn"] = Value::Null;
        }),
    ];
    for (words, change) in cases {
        let mut json: Value = serde_json::from_str(&text).unwrap();
        change(&mut json);
        fs::write(&path, json.to_string()).unwrap();
        let end = verify();
        assert_eq!((end.code, end.stderr.as_str()), (Some(1), ""), "{words}: {end:?}");
        assert!(end.stdout.contains(words), "{words}: {end:?}");
    }
}

/// `verify` names solver settings and counts in run.json that the solver cannot have.
#[test]
fn settings_of_another_solver_are_reported() {
    type Change = fn(&mut Value);
    let cases: [(&str, Change); 5] = [
        ("accepted_residual_m_s is 0.01; the limit of this solver is", |json| {
            json["solver"]["accepted_residual_m_s"] = json!(0.01);
        }),
        ("solver.detection: unknown variant `sight`", |json| {
            json["solver"]["detection"] = json!("sight")
        }),
        ("solver.on_failure: unknown variant `hope`", |json| {
            json["solver"]["on_failure"] = json!("hope")
        }),
        ("solver.detection contradicts the other settings", |json| {
            json["solver"]["preset"] = json!("tutorial")
        }),
        ("summary.rungs differ from the starts", |json| {
            json["summary"]["rungs"] = json!({ "zero": 1 })
        }),
    ];
    for (words, change) in cases {
        let end = with_run_json(change);
        assert_eq!((end.code, end.stderr.as_str()), (Some(1), ""), "{words}: {end:?}");
        assert!(end.stdout.contains(words), "{words}: {end:?}");
    }
}

#[test]
fn run_json_with_another_seed_fails_verify() {
    let other = simulate(&["--steps", "240", "--seed", "43"]);
    let directory = contact_files();
    fs::copy(other.path("run.json"), directory.path().join("run.json")).unwrap();
    let end = verify(directory.path(), &[]);
    assert_eq!(end.code, Some(1), "{end:?}");
    assert!(end.stdout.contains("the start differs from the first row"), "{end:?}");
}

/// Tables that are cut, with an inserted `end`, contradict the number of rows in run.json.
#[test]
fn truncated_tables_with_an_inserted_end_fail_verify() {
    // Free flight, so that no contact is cut.
    let directory = changed("states.csv", |table| {
        let length = table.column("interval_s");
        table.rows.truncate(101);
        table.rows[100][length] = "0.0".to_owned();
    });
    let empty = Table { rows: Vec::new(), ..Table::parse(&contact_run()[1]) };
    fs::write(directory.path().join("contacts.csv"), empty.text()).unwrap();
    let mut steps = Table::parse(&contact_run()[2]);
    let mut end = steps.rows.last().unwrap().clone();
    for column in ["k", "time_s", "energy_J"].map(|name| steps.column(name)) {
        end[column].clone_from(&steps.rows[100][column]);
    }
    steps.rows.truncate(100);
    steps.rows.push(end);
    fs::write(directory.path().join("steps.csv"), steps.text()).unwrap();
    let end = verify(directory.path(), &[]);
    assert_eq!(end.code, Some(1), "{end:?}");
    assert!(end.stdout.contains("steps that differ from their rows: 0\n"), "{end:?}");
    assert!(end.stdout.contains("complete with 240 rows requested; there are 101"), "{end:?}");
}

/// `verify` reads the accepted residual from run.json. Without it, the solver's name must be a
/// known one.
#[test]
fn accepted_residual_is_read_from_run_json() {
    let json: Value = serde_json::from_str(&contact_run()[3]).unwrap();
    let promise = json["solver"]["accepted_residual_m_s"].as_f64().unwrap();
    assert!(promise > 0.0 && promise < 0.1, "{promise}");
    let end = with_run_json(|json| json["solver"]["name"] = json!("mine"));
    assert_eq!(end.code, Some(0), "{end:?}");
    let strict = with_run_json(|json| json["solver"]["accepted_residual_m_s"] = json!(0.0));
    assert_eq!(strict.code, Some(1), "{strict:?}");
    let remove = |json: &mut Value| {
        json["solver"].as_object_mut().unwrap().remove("accepted_residual_m_s");
    };
    assert_eq!(with_run_json(remove).code, Some(0));
    let unknown = with_run_json(|json| {
        remove(json);
        json["solver"]["name"] = json!("mine");
    });
    unknown.assert_refused(2, &["run.json", "solver.name", "mine", "accepted_residual_m_s"]);
    let negative = with_run_json(|json| json["solver"]["accepted_residual_m_s"] = json!(-1.0));
    negative.assert_refused(2, &["run.json", "accepted_residual_m_s"]);
}
