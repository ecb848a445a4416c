//! `tumble inspect` of several bodies: comparison with CasADi, and refused points.

use super::support::{End, tumble};
use crate::ROOT;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::fs;
use std::io::Read;

fn inspect(point: &Value) -> End {
    tumble().args(["inspect", "-"]).write_stdin(point.to_string()).output().unwrap().into()
}

/// Points of two and three bodies with the values of CasADi.
fn points() -> Vec<Value> {
    let path = &format!("{ROOT}/data/several.jsonl.gz");
    let mut text = String::new();
    let file = fs::File::open(path).unwrap();
    flate2::read::GzDecoder::new(file).read_to_string(&mut text).unwrap();
    text.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|number| number.as_f64().unwrap()).collect()
}

/// Compares to 1e-13 of the largest number. The sums of up to some hundred products are rounded in
/// a different order.
fn compare(what: &str, found: &[f64], known: &[f64]) {
    assert_eq!(found.len(), known.len(), "{what}");
    let allowed = 1e-13 * known.iter().fold(1.0, |largest, x| x.abs().max(largest));
    for (index, (found, known)) in found.iter().zip(known).enumerate() {
        assert!((found - known).abs() <= allowed, "{what} {index}: {found:e}, not {known:e}");
    }
}

/// Entries of a sparse matrix by row and column.
fn entries(matrix: &Value) -> BTreeMap<(u64, u64), f64> {
    let index = |name: &str, k: usize| matrix[name][k].as_u64().unwrap();
    let values = numbers(&matrix["values"]);
    let all = values.into_iter().enumerate();
    all.map(|(k, value)| ((index("rows", k), index("cols", k)), value)).collect()
}

#[test]
fn every_point_gives_what_casadi_has() {
    let points = points();
    assert_eq!(points.len(), 24);
    for point in points {
        let (name, known) = (point["name"].as_str().unwrap(), &point["output"]);
        let end = inspect(&point["input"]);
        assert_eq!((end.code, end.stderr.as_str()), (Some(0), ""), "{name}");
        let found: Value = serde_json::from_str(&end.stdout).unwrap();
        for part in ["gradient", "constraints"] {
            compare(&format!("{name} {part}"), &numbers(&found[part]), &numbers(&known[part]));
        }
        let objective = |value: &Value| value["objective"].as_f64().unwrap();
        compare(name, &[objective(&found)], &[objective(known)]);
        for part in ["jacobian", "hessian"] {
            let (found, known) = (entries(&found[part]), entries(&known[part]));
            // Entries missing on one side count as zero.
            let of = |at: &(u64, u64), map: &BTreeMap<_, f64>| map.get(at).copied().unwrap_or(0.0);
            let all: Vec<_> = found.keys().chain(known.keys()).collect();
            let ours: Vec<_> = all.iter().map(|at| of(at, &found)).collect();
            let theirs: Vec<_> = all.iter().map(|at| of(at, &known)).collect();
            compare(&format!("{name} {part}"), &ours, &theirs);
            assert!(part == "jacobian" || found.keys().all(|(row, col)| row >= col), "{name}");
        }
    }
}

/// An omitted field has its default value.
#[test]
fn what_is_left_out_has_its_usual_value() {
    let mut point = points()[0]["input"].clone();
    for (field, usual) in [("dt", 0.002), ("gravity", 9.81), ("epsilon", 1e-6)] {
        point[field] = json!(usual);
    }
    (point["share"], point["stiffness"]) = (json!(0.0), json!(0.0));
    point["bodies"][0]["wrench"] = json!([0, 0, 0, 0, 0, 0]);
    point["contacts"][0]["anchor"] = json!([0, 0, 0]);
    point["contacts"][0]["radius"] = json!(0);
    let given = inspect(&point);
    assert_eq!(given.code, Some(0), "{given:?}");
    for field in ["dt", "gravity", "epsilon", "share", "stiffness"] {
        point.as_object_mut().unwrap().remove(field);
    }
    point["bodies"][0].as_object_mut().unwrap().remove("wrench");
    for field in ["anchor", "radius"] {
        point["contacts"][0].as_object_mut().unwrap().remove(field);
    }
    assert_eq!(inspect(&point).stdout, given.stdout);
}

/// JSON pointer, bad value and words of the refusal.
#[test]
fn points_that_are_none_are_refused() {
    let point = points()[0]["input"].clone();
    let cases: [(&str, Value, &[&str]); 18] = [
        ("/x", json!([1.0]), &["x has 1 numbers", "are needed"]),
        ("/multipliers", json!([]), &["multipliers has 0 numbers"]),
        ("/bodies", json!(7), &["bodies", "expected an array"]),
        ("/bodies/0/mass", json!(-1.0), &["bodies[0]", "mass", "-1"]),
        ("/bodies/0/inertia/0/0", json!(-1.0), &["bodies[0]", "positive definite"]),
        ("/bodies/1/state", json!([1, 2]), &["bodies[1].state", "length 13"]),
        ("/bodies/1/state/3", json!("one"), &["bodies[1].state", "expected a number"]),
        ("/bodies/1/wrench", json!([1, 2]), &["bodies[1].wrench", "length 6"]),
        ("/contacts/0/a", json!(2), &["contacts[0].a is 2", "below 2"]),
        ("/contacts/0/b", json!(5), &["contacts[0].b is 5", "below 2"]),
        ("/contacts/0/b", json!(0), &["contacts[0].b", "another body or null"]),
        ("/contacts/0/frame/0/0", json!(3.0), &["contacts[0].frame", "unit vectors"]),
        ("/contacts/0/radius", json!(-0.1), &["contacts[0].radius", "0 to 1000"]),
        ("/contacts/0/friction", json!(11), &["contacts[0].friction", "0 to 10"]),
        ("/dt", json!(0.0), &["dt", "1e-6 to 0.1"]),
        ("/epsilon", json!(0.0), &["epsilon", "1e-12 to 1"]),
        ("/obj_factor", json!(null), &["obj_factor", "number"]),
        ("/x/30", json!(1e200), &["not finite"]),
    ];
    for (place, value, words) in cases {
        let mut broken = point.clone();
        *broken.pointer_mut(place).unwrap() = value;
        inspect(&broken).assert_refused(2, words);
    }
    let mut zero = point.clone();
    for k in 3..7 {
        zero["bodies"][0]["state"][k] = json!(0);
    }
    inspect(&zero).assert_refused(2, &["bodies[0].state", "quaternion"]);
    let mut more = point.clone();
    more["colour"] = json!(1);
    inspect(&more).assert_refused(2, &["colour", "unknown"]);
    let mut none = point;
    none["bodies"] = json!([]);
    inspect(&none).assert_refused(2, &["bodies"]);
}
