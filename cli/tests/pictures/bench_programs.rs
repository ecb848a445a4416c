//! The programs that `scripts/bench` runs beside other engines, on its scenes.

use crate::ROOT;
use crate::example::built;
use serde_json::{Value, json};
use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};
use tumble::problem::{ContactProblem, Law, SparseMatrix, dat};

/// The native solver's promise, m/s.
const PROMISE: f64 = 1e-9;

/// A scene of `bench/scenes`, with other entries.
fn request(scene: &str, entries: Value) -> String {
    let folder = Path::new(ROOT).join("bench/scenes");
    let text = std::fs::read_to_string(folder.join(scene)).unwrap();
    let mut request: Value = serde_json::from_str(&text).unwrap();
    for (name, value) in entries.as_object().unwrap() {
        request[name] = value.clone();
    }
    request.to_string()
}

/// What an example prints, given a request.
fn answer(example: &str, arguments: &[&str], request: &str) -> String {
    let mut child = Command::new(built(example))
        .args(arguments)
        .current_dir(ROOT)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    child.stdin.take().unwrap().write_all(request.as_bytes()).unwrap();
    let output = child.wait_with_output().unwrap();
    assert!(output.status.success(), "{example}: {}", output.status);
    String::from_utf8(output.stdout).unwrap()
}

/// Nothing that lies moves, and every step of it is certified.
#[test]
fn scenes_at_rest_stay_where_they_are() {
    for (scene, steps) in [("stack.json", 30), ("pyramid.json", 20), ("wall.json", 5)] {
        let request = request(scene, json!({ "steps": steps, "record": true }));
        let outcome: Value =
            serde_json::from_str(&answer("several_bodies", &[], &request)).unwrap();
        assert_eq!(outcome["certified"], steps, "{scene}");
        assert_eq!(outcome["failed"], 0, "{scene}");
        assert!(outcome["seconds"].as_f64().unwrap() > 0.0);
        let states: Vec<Vec<[f64; 13]>> =
            serde_json::from_value(outcome["states"].clone()).unwrap();
        assert_eq!(states.len(), 1 + steps);
        let (first, last) = (&states[0], &states[steps]);
        for (a, b) in first.iter().zip(last) {
            // Rounding of numbers below 10 in every step.
            let moved = a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(moved < 1e-13, "{scene}: {moved:e}");
        }
    }
}

/// The impulses of a step at rest solve the problem of the next, u = W p + q = 0, as well as the
/// native solver promises of a step. In a stack of n the contacts under a box carry what stands on
/// it, m g h (1 + 2 + … + n) in all; speeds that wrong of that many boxes are impulses.
#[test]
fn a_local_problem_is_that_of_the_step() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("problems");
    let request = request("stack.json", json!({ "steps": 8, "first": 5, "stride": 2 }));
    answer("local_problems", &[file.to_str().unwrap()], &request);
    let bytes = std::fs::read(file).unwrap();
    let words: Vec<[u8; 8]> = bytes.chunks(8).map(|word| word.try_into().unwrap()).collect();
    let mut problems = 0;
    let mut rest = &words[..];
    while let [n, step, others @ ..] = rest {
        let (n, step) = (u64::from_le_bytes(*n) as usize, u64::from_le_bytes(*step));
        assert_eq!((n, step), (40, 5 + 2 * problems));
        let (numbers, behind) = others.split_at(1 + 9 * n * n + 7 * n);
        let numbers: Vec<f64> = numbers.iter().map(|word| f64::from_le_bytes(*word)).collect();
        let (w, others) = numbers[1..].split_at(9 * n * n);
        let (q, others) = others.split_at(3 * n);
        let (mu, p) = others.split_at(n);
        assert!(mu.iter().all(|mu| *mu == 0.5));
        for i in 0..3 * n {
            let row = &w[3 * n * i..][..3 * n];
            let u: f64 = row.iter().zip(p).map(|(w, p)| w * p).sum::<f64>() + q[i];
            assert!(u.abs() < PROMISE, "row {i}: {u:e}");
            assert!((0..3 * n).all(|j| (row[j] - w[3 * n * j + i]).abs() < 1e-15));
        }
        let carried: f64 = p.iter().step_by(3).sum();
        assert!((carried - 55.0 * 9.81 * 0.002).abs() < 55.0 * PROMISE, "{carried}");
        problems += 1;
        rest = behind;
    }
    assert_eq!(problems, 2);
}

/// Problems of a folder are solved in the order of their names and handed on as they were read, those in the plane not.
#[test]
fn bare_problems_are_solved_and_handed_on() {
    let folder = tempfile::tempdir().unwrap();
    // A point of 2 kg that comes down at 1 m/s and slides at 0.3 m/s.
    let (w, free, friction) = (0.5, [-1.0, 0.3, 0.0], 0.25);
    for (name, rows) in [("a.dat", 2), ("b.dat", 3)] {
        let triplets = (0..rows).map(|row| (row, row, w));
        let response = SparseMatrix::from_triplets(rows, rows, triplets).unwrap();
        let laws = Law::contacts(rows, &[friction]).unwrap();
        let problem = ContactProblem::local(response, free[..rows].to_vec(), laws).unwrap();
        std::fs::write(folder.path().join(name), dat::write(&problem).unwrap()).unwrap();
    }
    let file = folder.path().join("problems");
    let [at, to] = [folder.path(), &file].map(|path| path.to_str().unwrap());
    let found: Value = serde_json::from_str(&answer("bare_problems", &[at, to], "")).unwrap();
    assert_eq!(found.as_array().unwrap().len(), 2);
    for (index, (name, place)) in [("a", Value::Null), ("b", json!(0))].into_iter().enumerate() {
        let one = &found[index];
        assert_eq!((&one["name"], &one["place"]), (&json!(name), &place));
        for way in ["any", "rule"] {
            assert!(one[way][0].as_f64().unwrap() > 0.0);
            assert!(one[way][1].as_f64().unwrap() <= PROMISE, "{name}, {way}: {one}");
        }
    }
    let bytes = std::fs::read(file).unwrap();
    let word = |at: usize| <[u8; 8]>::try_from(&bytes[8 * at..][..8]).unwrap();
    assert_eq!([0, 1].map(|at| u64::from_le_bytes(word(at))), [1, 0]);
    let numbers: Vec<f64> = (3..bytes.len() / 8).map(|at| f64::from_le_bytes(word(at))).collect();
    let expected = [w, 0.0, 0.0, 0.0, w, 0.0, 0.0, 0.0, w, -1.0, 0.3, 0.0, friction, 0.0, 0.0, 0.0];
    assert_eq!(numbers, expected);
}
