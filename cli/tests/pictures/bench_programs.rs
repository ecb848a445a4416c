//! Programs that `scripts/bench` runs next to other engines, on its scenes.

use crate::ROOT;
use crate::example::built;
use serde_json::{Value, json};
use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};

/// Accepted residual of the native solver [m/s].
const PROMISE: f64 = 1e-9;

/// JSON of a scene of `bench/scenes` with some entries replaced.
fn request(scene: &str, entries: Value) -> String {
    let folder = Path::new(ROOT).join("bench/scenes");
    let text = std::fs::read_to_string(folder.join(scene)).unwrap();
    let mut request: Value = serde_json::from_str(&text).unwrap();
    for (name, value) in entries.as_object().unwrap() {
        request[name] = value.clone();
    }
    request.to_string()
}

/// Standard output of an example for a request.
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

#[test]
fn a_scene_is_timed() {
    let request = request("wall.json", json!({ "steps": 5, "untimed": 3, "residual": 1e-6 }));
    let outcome: Value = serde_json::from_str(&answer("several_bodies", &[], &request)).unwrap();
    assert!(outcome["seconds"].as_f64().unwrap() > 0.0);
    assert!(outcome["memory_kib"].as_u64().unwrap() > 0);
}

/// The impulses of a resting step solve the next step's problem u = W p + q = 0 to the solver's
/// accepted residual. In a stack of n boxes the normal impulses add up to m g h (1 + 2 + … + n).
/// Their error is the accepted residual for that number of unit masses.
#[test]
fn local_problem_equals_the_problem_of_its_step() {
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
