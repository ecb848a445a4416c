//! `tumble verify` compares status words, solver columns and run.json with the rows.

use super::scenario::run_scenario;
use super::support::{End, Table, contact_run, run, simulate};
use super::verify::{changed, verify};
use serde_json::{Value, json};
use std::fs;

/// Verifies the contact run with a changed run.json.
fn with_run_json(change: impl FnOnce(&mut Value)) -> End {
    let directory = changed(|_| ());
    let path = directory.path().join("run.json");
    let mut json: Value = serde_json::from_str(&fs::read_to_string(&path).unwrap()).unwrap();
    change(&mut json);
    fs::write(path, json.to_string()).unwrap();
    verify(directory.path(), &[])
}

/// Verifies changed rows of the contact run without run.json.
fn rows_alone(change: impl FnOnce(&mut Table)) -> End {
    let directory = changed(change);
    fs::remove_file(directory.path().join("run.json")).unwrap();
    verify(directory.path(), &[])
}

/// Index of the first row with a contact force.
fn first_contact() -> usize {
    let table = Table::parse(&contact_run().0);
    let (status, force) = (table.texts("status"), table.numbers("fz0_N"));
    let presses = |k: &usize| {
        status[*k] == "converged"
            && (0..8).any(|point| table.numbers(&format!("fz{point}_N"))[*k] > 0.0)
    };
    (0..force.len()).find(presses).unwrap()
}

/// Contact statuses without possible contact, and `free` with forces, are reported.
#[test]
fn a_status_that_its_row_cannot_have_is_named() {
    let touching = first_contact();
    for (k, status, words) in [
        (3, "converged", "nothing can touch"),
        (3, "fallback", "nothing can touch"),
        (touching, "free", "it has forces"),
    ] {
        let directory = changed(|table| {
            let column = table.column("status");
            table.rows[k][column] = status.to_owned();
        });
        let end = verify(directory.path(), &[]);
        assert_eq!((end.code, end.stderr.as_str()), (Some(1), ""), "{status}: {end:?}");
        assert!(end.stdout.contains(&format!("`{status}`, but {words}")), "{status}: {end:?}");
    }
    let end = rows_alone(|table| {
        let column = table.column("status");
        table.rows[touching][column] = "free".to_owned();
    });
    assert_eq!(end.code, Some(1), "{end:?}");
    assert!(end.stdout.contains("`free`, but it has forces"), "{end:?}");
}

/// A changed but plausible status contradicts the counts in run.json.
#[test]
fn a_status_that_its_row_could_have_is_found_by_the_counts() {
    for status in ["fallback", "retried", "wild", "failed"] {
        let directory = changed(|table| {
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
fn run_json_of_other_rows_is_found_and_named() {
    type Change = fn(&mut Value);
    let cases: [(&str, Change); 8] = [
        ("the start differs from the first row", |json| {
            json["model"]["bodies"][0]["start"]["position"][0] = json!(0.25)
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
fn settings_that_the_solver_does_not_have_are_named() {
    type Change = fn(&mut Value);
    let cases: [(&str, Change); 5] = [
        ("accepted_residual_m_s is 0.01; the limit of this solver is", |json| {
            json["solver"]["accepted_residual_m_s"] = json!(0.01);
        }),
        ("solver.detection: sight is not one of", |json| {
            json["solver"]["detection"] = json!("sight")
        }),
        ("solver.on_failure: hope is not one of", |json| {
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
fn the_run_json_of_another_seed_is_found() {
    let other = simulate(&["--steps", "240", "--seed", "43"]);
    let directory = changed(|_| ());
    fs::copy(other.path("run.json"), directory.path().join("run.json")).unwrap();
    let end = verify(directory.path(), &[]);
    assert_eq!(end.code, Some(1), "{end:?}");
    assert!(end.stdout.contains("the start differs from the first row"), "{end:?}");
}

/// A truncated table with an inserted `end` row contradicts the number of rows in run.json.
#[test]
fn rows_cut_with_an_end_put_in_are_found() {
    let directory = changed(|table| {
        let (end, mut last) = (table.rows.len() - 1, table.rows[100].clone());
        last[15..].clone_from_slice(&table.rows[end].clone()[15..]);
        table.rows.truncate(100);
        table.rows.push(last);
    });
    let end = verify(directory.path(), &[]);
    assert_eq!(end.code, Some(1), "{end:?}");
    assert!(end.stdout.contains("complete with 240 rows requested; there are 101"), "{end:?}");
}

/// `verify` recomputes the columns that follow from force and motion, for every contact step and
/// the last row.
#[test]
fn a_changed_column_of_the_program_is_found() {
    let table = Table::parse(&contact_run().0);
    let slips = (0..8).map(|point| table.numbers(&format!("lam{point}")));
    let (point, lam) = slips
        .enumerate()
        .max_by(|a, b| {
            let most = |lam: &[f64]| lam.iter().copied().fold(0.0, f64::max);
            most(&a.1).total_cmp(&most(&b.1))
        })
        .unwrap();
    let k = (0..lam.len()).max_by(|a, b| lam[*a].total_cmp(&lam[*b])).unwrap();
    let end = table.rows.len() - 1;
    for (k, name) in [
        (k, format!("lam{point}")),
        (k, format!("s1_{point}")),
        (k, format!("s2_{point}")),
        (k, format!("alpha{point}")),
        (3, "s1_0".to_owned()),
        (3, "alpha2".to_owned()),
        (end, "lam7".to_owned()),
        (end, "fz0_N".to_owned()),
        (end, "iterations".to_owned()),
    ] {
        let directory = changed(|table| {
            let column = table.column(&name);
            let field = &mut table.rows[k][column];
            let flips = name.starts_with("alpha");
            let old: f64 = field.parse().unwrap();
            *field = match flips {
                true => (1.0 - old).to_string(),
                false if name == "iterations" => "5".to_owned(),
                false => (old * 1.001 + 1e-3).to_string(),
            };
        });
        let end = verify(directory.path(), &[]);
        assert_eq!(end.code, Some(1), "{k} {name}: {end:?}");
        assert!(end.stdout.contains(&format!("k = {k:<7}")), "{k} {name}: {end:?}");
    }
}

/// `verify` reads the accepted residual from run.json. Without it, the solver's name must be a
/// known one.
#[test]
fn the_promise_is_read_from_run_json() {
    let json: Value = serde_json::from_str(&contact_run().1).unwrap();
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

/// A line without end is refused after the maximum length of a row.
#[test]
fn a_line_without_end_is_refused() {
    let directory = changed(|_| ());
    // A sparse file takes no space on the disk.
    let file = directory.path().join("trajectory.csv");
    fs::OpenOptions::new().write(true).open(&file).unwrap().set_len(1 << 32).unwrap();
    run(&["verify", file.to_str().unwrap()]).assert_refused(2, &["trajectory.csv", "more than"]);
}
