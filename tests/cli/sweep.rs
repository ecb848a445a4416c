//! Sweeps: in one piece or in shards, in any order, ended and gone on with, the bytes are the same.

use super::support::{everything_in, run, simulate, tumble};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::thread::sleep;
use std::time::Duration;
use tempfile::TempDir;

fn scenario(name: &str) -> String {
    format!("{}/scenarios/{name}.toml", env!("CARGO_MANIFEST_DIR"))
}

/// 300 tosses of the cube, in 150 parts of two.
const TOSSES: [&str; 6] = ["--tosses", "300", "--seed", "7", "--steps", "260"];

fn sweep(out: &Path, flags: &[&str]) -> super::support::End {
    let (scenario, out) = (scenario("drop"), out.to_str().unwrap());
    run(&[&["sweep", &scenario], &TOSSES[..], flags, &["--out", out]].concat())
}

fn merged(out: &Path) -> String {
    let end = run(&["merge", out.to_str().unwrap()]);
    assert_eq!(end.code, Some(0), "{end:?}");
    assert!(end.stdout.contains("300 tosses"), "{end:?}");
    fs::read_to_string(out.join("sweep.csv")).unwrap()
}

fn whole() -> (TempDir, String) {
    let directory = tempfile::tempdir().unwrap();
    let end = sweep(directory.path(), &["--threads", "1"]);
    assert_eq!(end.code, Some(0), "{end:?}");
    let table = merged(directory.path());
    (directory, table)
}

#[test]
fn shards_in_any_order_make_the_bytes_of_one_run() {
    let (_directory, whole) = whole();
    assert_eq!(whole.lines().count(), 301);
    let directory = tempfile::tempdir().unwrap();
    for shard in ["3/3", "1/3", "2/3"] {
        let end = sweep(directory.path(), &["--shard", shard, "--threads", "2"]);
        assert_eq!(end.code, Some(0), "{end:?}");
        assert!(end.stdout.contains("50 parts computed, 0 there already, of 50"), "{end:?}");
    }
    assert_eq!(merged(directory.path()), whole);
    let temporary = |file: &PathBuf| file.extension().is_some_and(|name| name == "tmp");
    assert!(!everything_in(directory.path()).iter().any(temporary));
}

/// Each row is the end of the run with that seed, which the simulation itself writes.
#[test]
fn a_toss_is_the_run_with_its_seed() {
    let (_directory, whole) = whole();
    let mut header = whole.lines().next().unwrap().split(',');
    assert_eq!(header.position(|column| column == "x_m"), Some(3));
    for seed in [7, 100, 306] {
        let (file, seed) = (scenario("drop"), seed.to_string());
        let flags = ["--scenario", &file, "--seed", &seed, "--steps", "260", "--solver", "native"];
        let done = simulate(&flags);
        let csv = done.csv();
        let state: Vec<f64> =
            csv.lines().last().unwrap().split(',').map(|x| x.parse().unwrap_or(f64::NAN)).collect();
        let row = whole.lines().find(|row| row.split(',').nth(1) == Some(&seed)).unwrap();
        let row: Vec<_> = row.split(',').collect();
        let found: Vec<f64> = row[3..16].iter().map(|x| x.parse().unwrap()).collect();
        assert_eq!(found, state[2..15], "seed {seed}");
        let summary = &done.run_json()["summary"];
        assert_eq!(row[16..18].join(","), format!("259,{}", summary["contact_steps"]));
        let largest: f64 = row[21].parse().unwrap();
        assert_eq!(Some(largest), summary["certificate_max_m_s"].as_f64());
    }
}

/// A worker that is killed in the middle loses nothing that it finished.
#[test]
#[cfg(unix)]
fn a_killed_shard_goes_on_where_it_was() {
    let (_directory, whole) = whole();
    let directory = tempfile::tempdir().unwrap();
    let out = directory.path().to_str().unwrap();
    let mut child = Command::new(super::support::PROGRAM)
        .args(["sweep", &scenario("drop")])
        .args(TOSSES)
        .args(["--threads", "1", "--out", out])
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    let parts = || {
        let is_part = |file: &PathBuf| file.to_string_lossy().contains("part-");
        everything_in(directory.path()).iter().filter(|file| is_part(file)).count()
    };
    while parts() < 3 {
        sleep(Duration::from_millis(1));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    let done = parts();
    if done < 150 {
        let end = run(&["merge", out]);
        end.assert_refused(2, &["of 150 parts are missing", "part-"]);
    }
    let end = sweep(directory.path(), &[]);
    assert_eq!(end.code, Some(0), "{end:?}");
    assert!(end.stdout.contains(&format!("{done} there already, of 150")), "{done}: {end:?}");
    assert_eq!(merged(directory.path()), whole);
}

#[test]
fn several_bodies_have_a_row_each() {
    let directory = tempfile::tempdir().unwrap();
    let out = directory.path().to_str().unwrap();
    let scene = scenario("pile");
    let end = run(&["sweep", &scene, "--tosses", "2", "--steps", "12", "--out", out]);
    assert_eq!(end.code, Some(0), "{end:?}");
    let end = run(&["merge", out]);
    assert_eq!(end.code, Some(0), "{end:?}");
    let table = fs::read_to_string(directory.path().join("sweep.csv")).unwrap();
    assert_eq!(table.lines().count(), 201);
    assert!(table.lines().nth(101).unwrap().starts_with("1,1,box-0,"), "{table}");
}

#[test]
fn what_is_no_sweep_is_refused() {
    let directory = tempfile::tempdir().unwrap();
    let out = directory.path().join("sweep");
    for shard in ["0/3", "4/3", "1", "a/b", "1/0"] {
        sweep(&out, &["--shard", shard]).assert_refused(2, &["--shard", "i/n"]);
    }
    sweep(&out, &["--mu", "-1"]).assert_refused(2, &["friction"]);
    let still = scenario("stack");
    let path = out.to_str().unwrap();
    let end = run(&["sweep", &still, "--tosses", "3", "--out", path]);
    // By the file, not by a flag that nobody gave.
    end.assert_refused(2, &["stack.toml: nothing of it is random", "jitter"]);
    let floating = scenario("floating");
    let end = run(&["sweep", &floating, "--tosses", "3", "--out", path]);
    end.assert_refused(2, &["floating.toml: it has no ground"]);
    let dropped = scenario("drop");
    let end = run(&["sweep", &dropped, "--tosses", "3", "--seed", "4294967295", "--out", path]);
    end.assert_refused(2, &["seed", "4294967295"]);
    run(&["merge", path]).assert_refused(2, &["there is no sweep"]);
    assert!(!out.exists(), "nothing is written before all is checked");

    assert_eq!(sweep(&out, &["--shard", "1/3"]).code, Some(0));
    let end = run(&["sweep", &dropped, "--tosses", "301", "--out", path]);
    end.assert_refused(2, &["is of another sweep"]);
    for shard in ["2/3", "3/3"] {
        assert_eq!(sweep(&out, &["--shard", shard]).code, Some(0));
    }
    let part = out.join("part-000004.csv");
    let rows = fs::read_to_string(&part).unwrap();
    fs::write(&part, &rows[..rows.len() / 2]).unwrap();
    run(&["merge", path]).assert_refused(2, &["part-000004.csv", "tosses 8 to 9"]);
    sweep(&out, &[]).assert_refused(2, &["part-000004.csv", "checksum"]);
    let end: super::support::End =
        tumble().args(["merge", path, "--steps", "3"]).output().unwrap().into();
    end.assert_refused(2, &["--steps"]);
}

/// One digit of a part, a part in the place of another, a part too many, or one number of the plan.
#[test]
fn what_was_changed_since_is_named() {
    let (directory, whole) = whole();
    let out = directory.path();
    let merge = || run(&["merge", out.to_str().unwrap()]);
    let (part, other) = (out.join("part-000003.csv"), out.join("part-000004.csv"));
    let rows = fs::read_to_string(&part).unwrap();
    let digit = rows.find("0.").unwrap() + 2;
    let changed = if &rows[digit..=digit] == "1" { "2" } else { "1" };
    fs::write(&part, [&rows[..digit], changed, &rows[digit + 1..]].concat()).unwrap();
    merge().assert_refused(2, &["part-000003.csv", "tosses 6 to 7", "checksum"]);
    fs::write(&part, fs::read(&other).unwrap()).unwrap();
    merge().assert_refused(2, &["part-000003.csv", "checksum"]);
    fs::write(&part, &rows).unwrap();

    let stray = out.join("part-000150.csv");
    fs::write(&stray, &rows).unwrap();
    merge().assert_refused(2, &["part-000150.csv is no part", "part-000149.csv"]);
    fs::remove_file(&stray).unwrap();
    assert_eq!(merged(out), whole);

    let plan = out.join("sweep.json");
    let text = fs::read_to_string(&plan).unwrap();
    fs::write(&plan, text.replace("\"tosses\": 300", "\"tosses\": 298")).unwrap();
    merge().assert_refused(2, &["sweep.json", "was changed since"]);
    sweep(out, &[]).assert_refused(2, &["sweep.json", "was changed since"]);
}
