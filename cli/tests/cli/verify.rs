//! `tumble verify` on unchanged files and on files that cannot be read.

use super::support::{End, FAILING_RUN, Table, contact_files, contact_run, run, simulate, tumble};
use std::fs;
use std::path::Path;
use tempfile::TempDir;

/// Temporary directory with the contact run's files after `change` of the table `name`.
pub fn changed(name: &str, change: impl FnOnce(&mut Table)) -> TempDir {
    let directory = contact_files();
    let path = directory.path().join(name);
    let mut table = Table::parse(&fs::read_to_string(&path).unwrap());
    change(&mut table);
    fs::write(path, table.text()).unwrap();
    directory
}

pub fn verify(directory: &Path, flags: &[&str]) -> End {
    let file = directory.join("states.csv");
    tumble().arg("verify").arg(file).args(flags).output().unwrap().into()
}

#[test]
fn unchanged_files_verify() {
    for args in [
        ["--steps", "240"].as_slice(),
        &["--scene", "floating", "--steps", "300"],
        &[
            "--scene",
            "floating",
            "--steps",
            "50",
            "--gravity",
            "1,2,-3",
            "--set",
            "body.inertia=1,2,3",
        ],
        &["--steps", "1"],
        &[
            "--steps",
            "225",
            "--seed",
            "1",
            "--dt",
            "0.0021",
            "--set",
            "body.mass=3",
            "--gravity",
            "0,1,-9",
        ],
    ] {
        let simulated = simulate(args);
        let end = verify(&simulated.path(""), &[]);
        assert_eq!((end.code, end.stderr.as_str()), (simulated.end.code, ""), "{args:?}: {end:?}");
        let steps = simulated.table().rows.len() - 1;
        assert!(end.stdout.contains(&format!("{steps} steps of 1 body\n")), "{}", end.stdout);
        assert!(end.stdout.contains("steps that differ from their rows: 0\n"), "{}", end.stdout);
    }
}

/// Without its report the command keeps its exit codes: 0, 1, 2 and 3.
#[test]
fn a_quiet_verification_has_only_its_exit_code() {
    let good = contact_files();
    let other = changed("states.csv", |table| {
        let column = table.column("vz_m_s");
        table.rows[120][column] = "3.0".to_owned();
    });
    let failing = simulate(&FAILING_RUN);
    for (directory, code) in [(good.path(), 0), (other.path(), 1), (&failing.path(""), 3)] {
        for flag in ["-q", "--quiet"] {
            let end = verify(directory, &[flag]);
            assert_eq!((end.code, end.stdout.as_str(), end.stderr.as_str()), (Some(code), "", ""));
        }
    }
}

#[test]
fn a_file_with_failed_steps_verifies_with_code_3() {
    let simulated = simulate(&FAILING_RUN);
    let end = verify(&simulated.path(""), &[]);
    assert_eq!((end.code, end.stderr.as_str()), (Some(3), ""));
    let failed = simulated.run_json()["summary"]["failed"].as_u64().unwrap();
    assert!(failed > 0 && end.stdout.contains(&format!("`failed`: {failed}\n")), "{end:?}");
}

#[test]
fn the_number_of_worst_steps_can_be_chosen() {
    let directory = contact_files();
    for (flags, count) in [
        (["--worst", "0"].as_slice(), 0),
        (&["--worst", "3"], 3),
        (&["--worst", "100000"], 239),
        (&[], 5),
    ] {
        let end = verify(directory.path(), flags);
        assert_eq!(end.code, Some(0), "{end:?}");
        assert_eq!(end.stdout.matches("k = ").count(), count, "{end:?}");
    }
}

#[test]
fn other_files_are_rejected_as_tables() {
    for content in [
        b"".as_slice(),
        b"\n",
        b"k,time_s\n0,0\n",
        b"\0\x01\x02\xff\xfe",
        b"\xff\xfek\0,\0",
        b"{\"state\": []}",
        "status,iterations,certificate_m_s\n".as_bytes(),
    ] {
        for table in ["states", "contacts", "steps"] {
            let directory = contact_files();
            fs::write(directory.path().join(format!("{table}.csv")), content).unwrap();
            verify(directory.path(), &[]).assert_refused(2, &[table]);
        }
    }
    let directory = tempfile::tempdir().unwrap();
    verify(directory.path(), &[]).assert_refused(2, &["states.csv"]);
    run(&["verify", directory.path().to_str().unwrap()])
        .assert_refused(2, &["is a directory", "give a table of a run"]);
}

/// Times that the time step of run.json does not give are another run's.
#[test]
fn the_time_step_of_another_run_is_refused() {
    let directory = contact_files();
    let json = contact_run()[3].replace("\"time_step\": 0.002", "\"time_step\": 0.004");
    fs::write(directory.path().join("run.json"), json).unwrap();
    verify(directory.path(), &[])
        .assert_refused(2, &["step 1, interval 0 has time_s = 0.002", "0.004 s"]);
}
