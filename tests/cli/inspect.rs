//! `tumble inspect`: exact values and derivatives, and points that are none.

use super::support::{End, tumble};
use flate2::read::GzDecoder;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::Read;

/// Both sides are exact formulas in double precision; they differ by rounding in another
/// order, which is some 1e-16 of the largest terms. The forces of `large_force` reach
/// 2e4 N and their terms 1e8, so that differences of 1e-8 must be allowed there relative
/// to an entry; relative to the array's largest entry, 1e-10 leaves room and would show
/// any wrong formula.
const TOLERANCE: f64 = 1e-10;

fn reference_points() -> Vec<Value> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/data/derivatives.jsonl.gz");
    let mut text = String::new();
    GzDecoder::new(File::open(path).unwrap()).read_to_string(&mut text).unwrap();
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

/// A result as named arrays of numbers; matrices by position, zeros left out.
fn arrays(output: &Value) -> BTreeMap<String, BTreeMap<(u64, u64), f64>> {
    let mut all = BTreeMap::new();
    all.insert("objective".to_owned(), BTreeMap::from([((0, 0), number(&output["objective"]))]));
    for name in ["gradient", "constraints"] {
        let numbers = output[name].as_array().unwrap();
        let entries = numbers.iter().enumerate().map(|(k, value)| ((k as u64, 0), number(value)));
        all.insert(name.to_owned(), entries.collect());
    }
    for name in ["jacobian", "hessian"] {
        let column = |key: &str| output[name][key].as_array().unwrap();
        let mut entries = BTreeMap::new();
        for ((row, col), value) in column("rows").iter().zip(column("cols")).zip(column("values")) {
            let position = (row.as_u64().unwrap(), col.as_u64().unwrap());
            assert!(entries.insert(position, number(value)).is_none(), "{name} {position:?} twice");
            assert!(name != "hessian" || position.0 >= position.1, "{position:?} is above");
        }
        entries.retain(|_, value| *value != 0.0);
        all.insert(name.to_owned(), entries);
    }
    all
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap()
}

#[test]
fn every_reference_point_gives_the_reference_values() {
    let points = reference_points();
    assert_eq!(points.len(), 250);
    for (index, point) in points.iter().enumerate() {
        let input = point["input"].to_string();
        let end = if index % 2 == 0 { inspect_stdin(input) } else { inspect_file(&input) };
        assert_eq!((end.code, end.stderr.as_str()), (Some(0), ""), "{}", point["name"]);
        assert_eq!(end.stdout.matches('\n').count(), 1, "one line of JSON");
        let found = arrays(&serde_json::from_str(&end.stdout).unwrap());
        for (name, expected) in arrays(&point["output"]) {
            let found = &found[&name];
            let scale = expected.values().fold(1.0, |max, value| value.abs().max(max));
            for position in expected.keys().chain(found.keys()) {
                let at = |side: &BTreeMap<_, f64>| side.get(position).copied().unwrap_or(0.0);
                let difference = (at(found) - at(&expected)).abs();
                assert!(
                    difference <= TOLERANCE * scale,
                    "{} {name} {position:?}: {} is not {}",
                    point["name"],
                    at(found),
                    at(&expected)
                );
            }
        }
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

/// Field, value, and words of the refusal.
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
