//! `tumble inspect` of one body: exact values and derivatives, and refused points.

use super::support::{End, tumble};
use crate::common::reference;
use crate::points::{Output, compare, points};
use serde_json::{Value, json};
use std::fs;

fn reference_points() -> Vec<Value> {
    let text = reference("derivatives.jsonl.gz");
    text.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

fn inspect_stdin(text: impl Into<Vec<u8>>) -> End {
    tumble().args(["inspect", "-"]).write_stdin(text).output().unwrap().into()
}

fn inspect_file(text: &str) -> End {
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("point.json");
    fs::write(&file, text).unwrap();
    tumble().arg("inspect").arg(file).output().unwrap().into()
}

/// Compares entry by entry with the tolerances of `tests/ipopt/derivatives.rs`.
#[test]
fn every_reference_point_gives_the_reference_values() {
    for (index, (point, known)) in reference_points().iter().zip(points()).enumerate() {
        let input = point["input"].to_string();
        let end = if index % 2 == 0 { inspect_stdin(input) } else { inspect_file(&input) };
        assert_eq!((end.code, end.stderr.as_str()), (Some(0), ""), "{}", known.name);
        assert_eq!(end.stdout.matches('\n').count(), 1, "one line of JSON");
        let found: Output = serde_json::from_str(&end.stdout).unwrap();
        let [rows, cols] = [&found.hessian.rows, &found.hessian.cols];
        assert!(rows.iter().zip(cols).all(|(row, col)| row >= col), "the lower triangle");
        compare(&known, &found);
    }
}

#[test]
fn gravity_may_be_a_number_or_a_vector() {
    let mut point = reference_points()[0]["input"].clone();
    let plain = inspect_stdin(point.to_string()).stdout;
    for (gravity, same) in [
        (json!(9.81), true),
        (json!([0.0, 0.0, -9.81]), true),
        (json!([0, 0, -9]), false),
        (json!(0), false),
    ] {
        point["gravity"] = gravity.clone();
        let end = inspect_stdin(point.to_string());
        assert_eq!(end.code, Some(0), "{end:?}");
        assert_eq!(end.stdout == plain, same, "{gravity}");
    }
}

/// Field, bad value and words of the refusal.
fn bad_fields() -> Vec<(&'static str, Value, Vec<&'static str>)> {
    let numbers = |count: usize| json!(vec![0.5; count]);
    let mut table = Vec::new();
    for (field, count) in [("state", 13), ("alpha", 8), ("x", 61), ("multipliers", 62)] {
        for wrong in [0, count - 1, count + 1, 200] {
            table.push((field, numbers(wrong), vec![field, "needed"]));
        }
        let mut with_null = vec![json!(0.5); count];
        with_null[3] = Value::Null;
        for value in [json!(with_null), json!("1,2"), json!(7), Value::Null, json!({})] {
            table.push((field, value, vec!["not a point"]));
        }
    }
    let mut no_attitude = vec![0.5; 13];
    no_attitude[3..7].fill(0.0);
    table.push(("state", json!(no_attitude), vec!["quaternion"]));
    for (field, value) in [("x", 1e300), ("multipliers", 1e308), ("state", 1e200), ("x", -1e308)] {
        let count = [("x", 61), ("multipliers", 62), ("state", 13)];
        let count = count.iter().find(|(name, _)| *name == field).unwrap().1;
        table.push((field, json!(vec![value; count]), vec!["too large"]));
    }
    for (field, value) in [
        ("mass", json!(-1)),
        ("mass", json!(0)),
        ("mass", json!(1e300)),
        ("dt", json!(0)),
        ("dt", json!(-0.002)),
        ("dt", json!(5)),
        ("mu", json!(-0.3)),
        ("epsilon", json!(0)),
        ("epsilon", json!(2)),
        ("gravity", json!(1e6)),
        ("gravity", json!([0, 0, 1e6])),
        ("inertia", json!([[0, 0, 0], [0, 0, 0], [0, 0, 0]])),
        ("inertia", json!([[1, 1, 0], [0, 1, 0], [0, 0, 1]])),
        ("inertia", json!([[1, 0, 0], [0, -1, 0], [0, 0, 1]])),
    ] {
        table.push((field, value, vec![field]));
    }
    for (field, value) in [
        ("mass", json!("10")),
        ("inertia", json!(0.01)),
        ("inertia", json!([1, 2, 3])),
        ("gravity", json!([0, -9.81])),
        ("gravity", json!("down")),
        ("obj_factor", json!([1])),
        ("unknown", json!(1)),
        ("two\nlines", json!(1)),
    ] {
        table.push((field, value, vec!["not a point"]));
    }
    table
}

#[test]
fn every_bad_field_is_refused_in_one_line() {
    let good = reference_points()[0]["input"].clone();
    assert_eq!(inspect_stdin(good.to_string()).code, Some(0));
    let mut faults = Vec::new();
    for (field, value, words) in bad_fields() {
        let mut point = good.clone();
        point[field] = value.clone();
        let end = inspect_stdin(point.to_string());
        if std::panic::catch_unwind(|| end.assert_refused(2, &words)).is_err() {
            let value: String = value.to_string().chars().take(40).collect();
            faults.push(format!("{field:?}: {value}: {words:?} {:?} {:?}", end.code, end.stderr));
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn a_missing_or_doubled_field_is_refused_by_name() {
    let good = reference_points()[0]["input"].clone();
    for field in ["state", "alpha", "x", "obj_factor", "multipliers"] {
        let mut point = good.clone();
        point.as_object_mut().unwrap().remove(field);
        inspect_file(&point.to_string()).assert_refused(2, &["missing", field]);
        let doubled = format!("{{\"{field}\": {}, {}", good[field], &good.to_string()[1..]);
        inspect_file(&doubled).assert_refused(2, &["duplicate", field]);
    }
}

#[test]
fn text_that_is_no_json_point_is_refused_in_one_line() {
    let good = reference_points()[0]["input"].to_string();
    let nan = good.replacen("\"obj_factor\":0.0", "\"obj_factor\":NaN", 1);
    let infinite = good.replacen("\"obj_factor\":0.0", "\"obj_factor\":1e400", 1);
    assert!(nan != good && infinite != good);
    let deep = "[".repeat(100_000);
    let long = format!("{good}{}", " ".repeat(1 << 20));
    let rest = format!("{good} {good}");
    for text in
        ["", " ", "null", "[]", "{}", "7", "{", &nan, &infinite, &deep, &long, &rest, &good[..900]]
    {
        for end in [inspect_stdin(text), inspect_file(text)] {
            end.assert_refused(2, &["point"]);
        }
    }
    inspect_stdin(b"{\"state\": [\xff]}".as_slice()).assert_refused(2, &["cannot be read"]);
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().to_str().unwrap();
    super::support::run(&["inspect", path]).assert_refused(2, &["cannot be read"]);
    let absent = format!("{path}/absent.json");
    super::support::run(&["inspect", &absent]).assert_refused(2, &["absent.json"]);
}
