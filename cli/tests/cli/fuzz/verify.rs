//! Mutated input files of `verify`.

use super::program::{DONE_WITHIN, assert_one_line, end_of};
use super::{each, wild};
use crate::support::{READ, contact_files, contact_run};
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::{Index, select};
use serde_json::{Map, Value, json};
use std::fs;
use std::path::Path;

/// Replacement of `removed` bytes by `put_in`.
#[derive(Debug, Clone)]
struct Edit {
    at: Index,
    removed: usize,
    put_in: Vec<u8>,
}

fn edits() -> impl Strategy<Value = Vec<Edit>> {
    let bytes = prop_oneof![
        3 => vec(select(b"0123456789.,\n\"\rek-+[]{}: ".to_vec()), 0..4),
        1 => vec(any::<u8>(), 0..4),
    ];
    let removed = prop_oneof![4 => 0..4_usize, 1 => 0..5000_usize];
    let edit = (any::<Index>(), removed, bytes).prop_map(|(at, removed, put_in)| Edit {
        at,
        removed,
        put_in,
    });
    vec(edit, 1..4)
}

fn edited(text: &str, edits: Vec<Edit>) -> Vec<u8> {
    let mut bytes = text.as_bytes().to_vec();
    for Edit { at, removed, put_in } in edits {
        let at = at.index(bytes.len());
        let end = (at + removed).min(bytes.len());
        bytes.splice(at..end, put_in);
        bytes.push(b'\n');
    }
    bytes
}

/// Strategy for small JSON values.
fn any_json() -> impl Strategy<Value = Value> {
    let leaf = prop_oneof![
        Just(Value::Null),
        any::<bool>().prop_map(Value::from),
        wild().prop_map(|number| json!(number)),
        any::<i64>().prop_map(Value::from),
        "\\PC{0,8}".prop_map(Value::from),
    ];
    leaf.prop_recursive(2, 12, 4, |inner| {
        let map = vec(("[a-z]{1,4}", inner.clone()), 0..3);
        prop_oneof![
            vec(inner, 0..4).prop_map(Value::from),
            map.prop_map(|map| Value::from(map.into_iter().collect::<Map<_, _>>())),
        ]
    })
}

/// Replaces the part of `whole` at `path` by `value`.
fn replace(whole: &mut Value, path: &[Index], value: Value) {
    let below = match whole {
        Value::Array(items) if !items.is_empty() => path.first().map(|at| {
            let at = at.index(items.len());
            &mut items[at]
        }),
        Value::Object(map) if !map.is_empty() => {
            let count = map.len();
            path.first().and_then(|at| map.values_mut().nth(at.index(count)))
        }
        _ => None,
    };
    match below {
        Some(below) => replace(below, &path[1..], value),
        None => *whole = value,
    }
}

/// Asserts that `verify` ends with code 0, 1 (differences) or 3 (failed steps), or refuses the
/// files in one line, after a change of the file `name`.
fn check_verify(directory: &Path, name: &str, content: &[u8]) {
    let path = directory.join(name);
    let whole = fs::read(&path).unwrap();
    fs::write(&path, content).unwrap();
    let (end, took) = end_of(directory, &["verify", "states.csv"]);
    fs::write(&path, whole).unwrap();
    assert!(took < DONE_WITHIN, "{took:?}");
    match end.code {
        Some(0 | 1 | 3) => {
            assert_eq!(end.stderr, "");
            assert!(end.stdout.contains(" steps of 1 body\n"), "{end:?}");
        }
        Some(2) => {
            assert_one_line(&end);
            assert_eq!(end.stdout, "");
        }
        _ => panic!("{end:?}"),
    }
}

#[test]
#[ignore = "slow"]
fn mutated_tables_are_verified_or_refused_in_one_line() {
    let directory = contact_files();
    for (name, csv) in READ.iter().zip(contact_run()).take(3) {
        each(100, edits(), |edits| {
            check_verify(directory.path(), name, &edited(csv, edits));
            Ok(())
        });
        // Any number in any field.
        let change = (any::<Index>(), any::<Index>(), wild());
        each(100, change, |(row, column, number)| {
            let mut lines: Vec<String> = csv.lines().map(str::to_owned).collect();
            let row = row.index(lines.len());
            let mut fields: Vec<String> = lines[row].split(',').map(str::to_owned).collect();
            let column = column.index(fields.len());
            fields[column] = format!("{number:e}");
            lines[row] = fields.join(",");
            check_verify(directory.path(), name, lines.join("\n").as_bytes());
            Ok(())
        });
    }
}

#[test]
#[ignore = "slow"]
fn a_mutated_run_json_is_used_or_refused_in_one_line() {
    let (directory, json) = (contact_files(), &contact_run()[3]);
    each(200, edits(), |edits| {
        check_verify(directory.path(), "run.json", &edited(json, edits));
        Ok(())
    });
    let run: Value = serde_json::from_str(json).unwrap();
    each(300, (vec(any::<Index>(), 1..5), any_json()), |(path, value)| {
        let mut mutated = run.clone();
        replace(&mut mutated, &path, value);
        check_verify(directory.path(), "run.json", mutated.to_string().as_bytes());
        Ok(())
    });
}
