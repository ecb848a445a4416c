//! A killed run that continues from its last checkpoint writes the same bytes as an uninterrupted
//! run.

use super::support::{LIMIT, PROGRAM, everything_in, run};
use crate::ROOT;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

/// Arguments of a scenario with several tables and a joint.
fn scene(steps: &str) -> Vec<String> {
    let scenario = format!("{ROOT}/scenarios/door.toml");
    let args = [&scenario, "--steps", steps, "--quiet"];
    args.map(str::to_owned).to_vec()
}

/// Name and content of every table in a run's directory.
fn tables(directory: &Path) -> Vec<(String, Vec<u8>)> {
    let names = everything_in(directory).into_iter();
    let names = names.map(|name| name.to_str().unwrap().to_owned());
    let tables = names.filter(|name| name.contains(".csv"));
    tables.map(|name| (name.clone(), fs::read(directory.join(name)).unwrap())).collect()
}

/// Starts the program and kills it after `time`. If `awaited` is set, the kill also waits for the
/// first checkpoint. Returns true if the program was still running.
fn killed(args: &[String], out: &Path, time: Duration, awaited: bool) -> bool {
    let mut command = Command::new(PROGRAM);
    command.args(args).arg("--out").arg(out).stdout(Stdio::null());
    let mut child = command.spawn().unwrap();
    let begun = Instant::now();
    let is_there = || !awaited || out.join("checkpoint.bin").exists();
    while (begun.elapsed() < time || !is_there()) && child.try_wait().unwrap().is_none() {
        assert!(begun.elapsed() < LIMIT, "no checkpoint");
        sleep(Duration::from_millis(1));
    }
    // Sends SIGKILL. The process may already have ended.
    let _ = child.kill();
    child.wait().unwrap().code().is_none()
}

fn assert_continues(out: &Path) {
    let out = out.to_str().unwrap();
    let end = run(&["--continue", out, "--quiet", "--checkpoint", "0.02"]);
    assert_eq!((end.code, end.stderr.as_str()), (Some(0), ""), "{end:?}");
}

fn assert_like(one: &Path, other: &Path) {
    let (one, other) = (tables(one), tables(other));
    let names = |tables: &[(String, Vec<u8>)]| -> Vec<String> {
        tables.iter().map(|(name, _)| name.clone()).collect()
    };
    assert_eq!(names(&one), names(&other));
    for ((name, one), (_, other)) in one.iter().zip(&other) {
        assert!(one == other, "{name} differs");
    }
}

/// Both table formats survive two kills and leave no temporary files.
#[test]
#[ignore = "slow"]
fn killed_run_continues_from_its_checkpoint() {
    for compact in [false, true] {
        let places = tempfile::tempdir().unwrap();
        let [whole, parts] = ["whole", "parts"].map(|name| places.path().join(name));
        let flag = compact.then(|| "--compact".to_owned());
        let args: Vec<_> = scene("20000").into_iter().chain(flag).collect();
        let end =
            run(&[&args[..], &["--out".to_owned(), whole.to_str().unwrap().to_owned()]].concat());
        assert_eq!(end.code, Some(0), "{end:?}");

        let often = ["--checkpoint", "0.02"].map(str::to_owned);
        killed(&[&args[..], &often].concat(), &parts, Duration::from_millis(150), true);
        assert!(!parts.join("run.json").exists(), "it was too fast to be killed");
        let other = run(&["--steps", "5", "--out", parts.to_str().unwrap()]);
        other.assert_refused(2, &["checkpoint", "--continue", "--overwrite"]);
        let again = ["--continue", parts.to_str().unwrap(), "--quiet", "--checkpoint", "0.02"];
        killed(&again.map(str::to_owned), &parts, Duration::from_millis(150), false);
        assert_continues(&parts);
        assert_like(&whole, &parts);
        let verified = run(&[
            "verify",
            parts.join(if compact { "states.csv.gz" } else { "states.csv" }).to_str().unwrap(),
        ]);
        assert_eq!(verified.code, Some(0), "{verified:?}");
        assert_eq!(everything_in(&whole), everything_in(&parts), "{compact}: nothing is left over");
    }
}

/// Up to a hundred kills at random moments lose no run, even during the write of a checkpoint.
#[test]
#[ignore = "slow"]
fn a_hundred_kills_lose_nothing() {
    let places = tempfile::tempdir().unwrap();
    let whole = places.path().join("whole");
    let args = scene("3000");
    let end = run(&[&args[..], &["--out".to_owned(), whole.to_str().unwrap().to_owned()]].concat());
    assert_eq!(end.code, Some(0), "{end:?}");
    let mut seed = 7_u64;
    let mut kills = 0;
    for number in 0..20 {
        let parts = places.path().join(number.to_string());
        let often = ["--checkpoint", "0.001"].map(str::to_owned);
        let again = ["--continue", parts.to_str().unwrap(), "--quiet", "--checkpoint", "0.001"];
        let again = again.map(str::to_owned);
        for part in 0..5 {
            seed = seed
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            let time = Duration::from_micros(2_000 + (seed >> 40) % 30_000);
            let was_running = if parts.join("checkpoint.bin").exists() {
                killed(&again, &parts, time, false)
            } else {
                part == 0 && killed(&[&args[..], &often].concat(), &parts, time, true)
            };
            kills += u32::from(was_running);
        }
        if parts.join("checkpoint.bin").exists() {
            assert_continues(&parts);
        }
        assert_like(&whole, &parts);
        fs::remove_dir_all(&parts).unwrap();
    }
    // A run that has ended is not killed again.
    assert!(kills > 10, "{kills}");
}
