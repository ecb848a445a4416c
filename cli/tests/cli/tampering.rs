//! `tumble verify` on changed tables.

use super::scenario::run_scenario;
use super::support::{End, READ, Table, run, simulate, unseal};
use std::fs;
use std::path::Path;
use std::sync::{Arc, OnceLock};
use tumble_core::contact::certificate::{Certifier, Claim};
use tumble_core::simulation::StepRecord;
use tumble_core::step::StepStatus;
use tumble_scene::output::tables::{Streams, Table as RunTable, TablesWriter};
use tumble_scene::scene::Scene;

/// Scene with a box that slides on another box and a ball that rolls on a fixed plate.
const SCENE: &str = r#"
steps = 30
[ground]
friction = 0.5
[[bodies]]
name = "lower"
box = [0.6, 0.4, 0.2]
mass = 2.0
position = [0.0, 0.0, 0.1]
[[bodies]]
name = "upper"
box = 0.2
mass = 1.0
position = [-0.1, 0.02, 0.3]
velocity = [1.0, 0.0, 0.0]
[[bodies]]
name = "ball"
sphere = 0.1
mass = 1.0
position = [0.0, 1.0, 0.2]
velocity = [0.5, 0.0, 0.0]
[[fixed]]
name = "plate"
box = [2.0, 0.6, 0.1]
position = [0.0, 1.0, 0.05]
"#;

fn files() -> &'static [String; 4] {
    static RUN: OnceLock<[String; 4]> = OnceLock::new();
    RUN.get_or_init(|| {
        let (end, directory) = run_scenario(SCENE, &["--all-contacts"]);
        assert_eq!(end.code, Some(0), "{end:?}");
        let out = directory.path().join("out");
        unseal(&out.join("run.json"));
        READ.map(|name| fs::read_to_string(out.join(name)).unwrap())
    })
}

fn verify(directory: &Path) -> End {
    run(&["verify", directory.join("steps.csv").to_str().unwrap()])
}

/// Verifies the run after a change of one table.
fn verify_changed(name: &str, change: impl FnOnce(&mut Table)) -> End {
    let directory = tempfile::tempdir().unwrap();
    for (file, text) in READ.iter().zip(files()) {
        fs::write(directory.path().join(file), text).unwrap();
    }
    let path = directory.path().join(name);
    let mut table = Table::parse(&fs::read_to_string(&path).unwrap());
    change(&mut table);
    fs::write(path, table.text()).unwrap();
    verify(directory.path())
}

/// Index of row number `count` of step `k`.
fn row(table: &Table, k: u64, count: usize) -> usize {
    let steps = table.texts("k");
    let rows = steps.iter().enumerate().filter(|(_, step)| **step == k.to_string());
    rows.map(|(row, _)| row).nth(count).unwrap()
}

#[test]
fn unchanged_tables_verify() {
    let end = verify_changed("states.csv", |_| ());
    assert_eq!((end.code, end.stderr.as_str()), (Some(0), ""), "{end:?}");
    assert!(end.stdout.contains("29 steps of 3 bodies"), "{end:?}");
    assert!(end.stdout.contains("steps that differ from their rows: 0\n"), "{end:?}");
}

/// A change of a thousandth in any relevant number is found and its step named.
#[test]
fn a_changed_number_is_found_and_its_step_named() {
    let cases: [(&str, &[&str]); 4] = [
        ("states.csv", &["x_m", "z_m", "vx_m_s", "mid_vx_m_s"]),
        (
            "contacts.csv",
            &[
                "point_x_m",
                "normal_z",
                "force_x_N",
                "force_z_N",
                "slip_x_m_s",
                "gap_m",
                "rebound_m_s",
            ],
        ),
        ("steps.csv", &["residual_m_s", "penetration_m_s", "cone_m_s", "overlap_m", "energy_J"]),
        ("steps.csv", &["restitution_share"]),
    ];
    for (file, columns) in cases {
        for column in columns {
            // Contact 4 of a step is the first contact between the upper and the lower box.
            let count = if file == "contacts.csv" { 4 } else { 0 };
            let end = verify_changed(file, |table| {
                let (row, column) = (row(table, 12, count), table.column(column));
                let old: f64 = table.rows[row][column].parse().unwrap();
                table.rows[row][column] = (old * 1.001 + 1e-5).to_string();
            });
            assert_eq!((end.code, end.stderr.as_str()), (Some(1), ""), "{file} {column}: {end:?}");
            assert!(end.stdout.contains("k = 12 "), "{file} {column}: {end:?}");
        }
    }
}

/// An error of 1e-9 in a rounded number is found.
#[test]
fn an_error_above_the_rounding_of_tables_is_found() {
    let [states, contacts] = ["states.csv", "contacts.csv"];
    for (file, column) in [
        (states, "x_m"),
        (states, "qz"),
        (states, "vx_m_s"),
        (states, "wz_rad_s"),
        (states, "mid_vx_m_s"),
        (contacts, "gap_m"),
        (contacts, "slip_x_m_s"),
        (contacts, "rebound_m_s"),
    ] {
        let count = if file == contacts { 4 } else { 0 };
        let end = verify_changed(file, |table| {
            let (row, column) = (row(table, 12, count), table.column(column));
            let old: f64 = table.rows[row][column].parse().unwrap();
            table.rows[row][column] = (old + 1e-9).to_string();
        });
        assert_eq!((end.code, end.stderr.as_str()), (Some(1), ""), "{file} {column}: {end:?}");
    }
}

/// A contact that does not follow from the shapes is reported.
#[test]
fn contacts_that_contradict_the_bodies_are_reported() {
    let cases: [(&str, &str, &str); 6] = [
        ("body", "7", "does not exist"),
        ("partner", "fixed", "contact 4"),
        ("partner_index", "9", "does not exist"),
        ("partner_index", "2", "contact 4"),
        ("key", "0.5.0.A0.0", "does not exist"),
        ("key", "3", "key"),
    ];
    for (column, value, words) in cases {
        let end = verify_changed("contacts.csv", |table| {
            let (row, column) = (row(table, 12, 4), table.column(column));
            table.rows[row][column] = value.to_owned();
        });
        assert_eq!(end.code, Some(1), "{column} {value}: {end:?}");
        assert!(end.stdout.contains(words), "{column} {value}: {end:?}");
    }
}

/// Ground contacts have the radius of their contact point and no partner index.
#[test]
fn a_contact_with_the_ground_has_the_radius_of_its_point_and_no_index() {
    for (column, value, code) in [("radius_m", "0.01", 1), ("partner_index", "1", 2)] {
        let end = verify_changed("contacts.csv", |table| {
            let (row, column) = (row(table, 12, 0), table.column(column));
            table.rows[row][column] = value.to_owned();
        });
        let printed = format!("{}{}", end.stdout, end.stderr);
        assert_eq!(end.code, Some(code), "{column}: {end:?}");
        assert!(
            printed.contains(if code == 1 { "radius" } else { "ground" }),
            "{column}: {printed}"
        );
    }
}

/// A change of any letter or digit in a contact key yields the key of another contact, and `verify`
/// finds it.
#[test]
fn a_key_of_other_features_is_found() {
    let contacts = Table::parse(&files()[1]);
    let keys = contacts.texts("key");
    let count = keys.len();
    for row in [0, count / 3, count / 2, 2 * count / 3, count - 1] {
        let key = keys[row];
        for (at, old) in key.char_indices() {
            let new = match old {
                '0'..='8' => char::from(old as u8 + 1),
                'A' => 'B',
                'B' => 'A',
                'E' => 'V',
                _ => continue,
            };
            let mut other = key.to_owned();
            other.replace_range(at..=at, &new.to_string());
            let end = verify_changed("contacts.csv", |table| {
                let column = table.column("key");
                table.rows[row][column] = other.clone();
            });
            assert_eq!(end.code, Some(1), "row {row}, {key} to {other}: {end:?}");
        }
    }
}

/// A change in any column is found in the first, middle and last row. The column `start` is
/// excluded, because any start method of the solver is plausible.
#[test]
fn every_changed_column_fails_verify() {
    for name in &READ[..3] {
        let place = READ.iter().position(|file| file == name).unwrap();
        let table = Table::parse(&files()[place]);
        let columns = table.header.iter().enumerate().filter(|(_, column)| *column != "start");
        for (at, column) in columns {
            for row in [0, table.rows.len() / 2, table.rows.len() - 1] {
                let old = &table.rows[row][at];
                let new = match (old.parse::<u64>(), old.parse::<f64>()) {
                    (Ok(count), _) => (count + 1).to_string(),
                    (_, Ok(number)) => (number * 1.001 + 1e-5).to_string(),
                    _ if column == "key" => continue,
                    _ => "retried".to_owned(),
                };
                let end = verify_changed(name, |table| table.rows[row][at] = new.clone());
                let found = matches!(end.code, Some(1 | 2));
                assert!(found, "{name}, row {row}, {column}: {old} to {new}: {end:?}");
            }
        }
    }
}

#[test]
fn numbers_that_overflow_the_certificate_are_reported_as_mismatch() {
    for value in ["1e308", "-1e308", "1e200"] {
        for (file, column) in [
            ("states.csv", "z_m"),
            ("states.csv", "vx_m_s"),
            ("states.csv", "wx_rad_s"),
            ("contacts.csv", "force_x_N"),
            ("steps.csv", "residual_m_s"),
        ] {
            let end = verify_changed(file, |table| {
                let (row, column) = (row(table, 12, 0), table.column(column));
                table.rows[row][column] = value.to_owned();
            });
            assert_eq!((end.code, end.stderr.as_str()), (Some(1), ""), "{column} {value}");
            assert!(end.stdout.contains("k = 12 "), "{column} {value}: {end:?}");
        }
    }
}

#[test]
fn rows_missing_double_or_out_of_order_are_refused_with_table_and_line() {
    type Change = fn(&mut Table);
    let cases: [(&str, Change, &[&str]); 9] = [
        ("states.csv", |table| drop(table.rows.remove(1)), &["states, line 3", "body is 2"]),
        ("states.csv", |table| table.rows.swap(3, 4), &["states, line 6", "body is 0; expected 2"]),
        ("states.csv", |table| table.rows.truncate(50), &["states", "cut off"]),
        ("contacts.csv", |table| drop(table.rows.remove(0)), &["contacts, line 2", "contact is 1"]),
        ("contacts.csv", |table| drop(table.rows.pop()), &["contacts", "cut off"]),
        ("contacts.csv", |table| table.rows.push(table.rows[0].clone()), &["contacts", "after"]),
        ("steps.csv", |table| drop(table.rows.remove(7)), &["steps, line 9", "k is 8; expected 7"]),
        ("steps.csv", |table| drop(table.rows.pop()), &["steps", "cut off"]),
        ("steps.csv", |table| drop(table.header.remove(3)), &["steps", "column 4", "iterations"]),
    ];
    for (file, change, words) in cases {
        verify_changed(file, change).assert_refused(2, words);
    }
}

#[test]
fn fields_that_cannot_be_read_are_refused_with_table_line_and_column() {
    for (file, column, value) in [
        ("states.csv", "x_m", "nan"),
        ("states.csv", "vz_m_s", "inf"),
        ("states.csv", "qw", "-2"),
        ("states.csv", "body", "1.0"),
        ("states.csv", "time_s", "0.5"),
        ("contacts.csv", "force_z_N", "NaN"),
        ("contacts.csv", "partner", "moon"),
        ("contacts.csv", "key", "first"),
        ("steps.csv", "status", "done"),
        ("steps.csv", "residual_m_s", "nan"),
        ("steps.csv", "contacts", "-1"),
    ] {
        let end = verify_changed(file, |table| {
            let (row, column) = (row(table, 12, 0), table.column(column));
            table.rows[row][column] = value.to_owned();
        });
        let named = file.strip_suffix(".csv").unwrap();
        let words = if column == "qw" { ["12", "attitude"] } else { [named, column] };
        end.assert_refused(2, &words);
    }
}

#[test]
fn missing_table_or_run_file_is_named() {
    for name in ["states.csv", "contacts.csv"] {
        let directory = tempfile::tempdir().unwrap();
        for (file, text) in READ.iter().zip(files()).filter(|(file, _)| **file != name) {
            fs::write(directory.path().join(file), text).unwrap();
        }
        verify(directory.path()).assert_refused(2, &[name]);
    }
    let directory = tempfile::tempdir().unwrap();
    for (file, text) in READ.iter().zip(files()) {
        fs::write(directory.path().join(file), text).unwrap();
    }
    let json = files()[3].replacen("\"mass\": 2.0", "\"mass\": -2.0", 1);
    assert_ne!(json, files()[3]);
    fs::write(directory.path().join("run.json"), json).unwrap();
    verify(directory.path()).assert_refused(2, &["run.json", "model.bodies[0]", "mass"]);
    // Another mass changes every step.
    let json = files()[3].replacen("\"mass\": 2.0", "\"mass\": 3.0", 1);
    fs::write(directory.path().join("run.json"), json).unwrap();
    let end = verify(directory.path());
    assert_eq!(end.code, Some(1));
    let steps = files()[2].lines().count() - 2;
    let counted = format!("steps that differ from their rows: {steps}, and the last row\n");
    assert!(end.stdout.contains(&counted), "{end:?}");
}

/// The model is only in run.json. Every command names a missing or broken run.json.
#[test]
fn a_table_without_its_run_file_asks_for_it() {
    let directory = tempfile::tempdir().unwrap();
    for (file, text) in READ.iter().zip(files()).take(3) {
        fs::write(directory.path().join(file), text).unwrap();
    }
    for broken in [None, Some("{"), Some("{}")] {
        let fault = match broken {
            None => "states.csv: a table needs the run.json of its run",
            Some(text) => {
                fs::write(directory.path().join("run.json"), text).unwrap();
                "is not a run.json"
            }
        };
        for verb in ["verify", "plot", "gif", "view"] {
            let file = directory.path().join("states.csv");
            let end = run(&[verb, file.to_str().unwrap()]);
            end.assert_refused(2, &[fault, "run.json"]);
        }
    }
}

/// A line without end, quoted or not, is refused after the maximum length of a row.
#[test]
fn a_line_of_a_table_without_end_is_refused() {
    for (name, begin) in [("states.csv", "\"0"), ("contacts.csv", "0"), ("steps.csv", "\"0")] {
        let directory = tempfile::tempdir().unwrap();
        for (file, text) in READ.iter().zip(files()) {
            fs::write(directory.path().join(file), text).unwrap();
        }
        let path = directory.path().join(name);
        let header = fs::read_to_string(&path).unwrap().lines().next().unwrap().to_owned();
        fs::write(&path, format!("{header}\n{begin}")).unwrap();
        // A sparse file takes no space on the disk.
        fs::OpenOptions::new().write(true).open(&path).unwrap().set_len(1 << 32).unwrap();
        verify(directory.path()).assert_refused(2, &["more than 1048576 bytes"]);
    }
}

/// `verify` compares the statuses and counts of the tables with their rows and run.json.
#[test]
fn status_that_contradicts_the_rows_is_reported() {
    for (status, words) in [
        ("free", "`free`, but it has forces"),
        ("fallback", "summary.fallback is 0; the rows have 1"),
        ("failed", "summary.failed is 0; the rows have 1"),
    ] {
        let end = verify_changed("steps.csv", |table| {
            let column = table.column("status");
            table.rows[12][column] = status.to_owned();
        });
        assert_eq!((end.code, end.stderr.as_str()), (Some(1), ""), "{status}: {end:?}");
        assert!(end.stdout.contains(words), "{status}: {end:?}");
    }
    let other = files()[3].replacen("\"steps\": 30", "\"steps\": 31", 1);
    assert_ne!(other, files()[3]);
    let directory = tempfile::tempdir().unwrap();
    for (file, text) in READ.iter().zip(files()) {
        fs::write(directory.path().join(file), text).unwrap();
    }
    fs::write(directory.path().join("run.json"), other).unwrap();
    let end = verify(directory.path());
    assert_eq!(end.code, Some(1), "{end:?}");
    assert!(end.stdout.contains("complete with 31 rows requested; there are 30"), "{end:?}");
}

/// The column `start` accepts only the start methods of tumble's solvers.
#[test]
fn unknown_start_method_is_reported() {
    for (start, code) in [("magic", 1), ("previous ", 1), ("zero", 0)] {
        let end = verify_changed("steps.csv", |table| {
            let column = table.column("start");
            table.rows[12][column] = start.to_owned();
        });
        assert_eq!(end.code, Some(code), "{start}: {end:?}");
        let named = end.stdout.contains(&format!("its start is `{start}`, which is unknown"));
        assert_eq!(named, code == 1, "{start}: {end:?}");
    }
}

/// A failed step with cancelling forces of 1e9 N verifies as failed. Its equations of motion hold
/// to the rounding of these forces, which differs between two evaluations of the residual.
#[test]
fn a_failed_step_of_huge_forces_verifies_as_failed() {
    // Contacts with fixed pieces are recomputed from the points in their rows.
    const SCENE: &str = "steps = 3\n[ground]\nfriction = 0.5\noffset = -1.0\n[[fixed]]\n\
                         box = [2, 2, 0.1]\nposition = [313.1, 47.7, -0.05]\n[[bodies]]\n\
                         box = 0.2\nmass = 1.0\nposition = [313.1, 47.7, 0.1]\n\
                         attitude = { axis = [0, 0, 1], degrees = 37 }\n";
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("scene.toml");
    fs::write(&file, SCENE).unwrap();
    let done = simulate(&[file.to_str().unwrap(), "--all-contacts"]);
    assert_eq!(done.end.code, Some(0), "{:?}", done.end);

    let read = |_: &Path, _: u64| Err(std::io::ErrorKind::NotFound.into());
    let scene = Scene::from_text(SCENE, &file, &[], &read);
    let scene = scene.unwrap_or_else(|_| panic!("the scene was run"));
    let mut simulation = scene.simulation(&Arc::default()).unwrap_or_else(|_| panic!("as before"));
    let create = |table: RunTable| fs::File::create(done.path(&format!("{table}.csv"))).unwrap();
    let [states, contacts, steps] = RunTable::ALWAYS.map(create);
    let mut writer = TablesWriter::new(
        Streams { states, contacts: Some(contacts), steps, joints: None, gears: None, ends: None },
        &scene.world,
    )
    .unwrap();
    let (mut record, mut worst) = (StepRecord::new(), 0.0_f64);
    for _ in 0..2 {
        simulation.step(&mut record).unwrap();
        let between = (record.first().contacts[1].arm - record.first().contacts[0].arm).normalize();
        record.first_mut().solution.contacts[0].force += 1e9 * between;
        record.first_mut().solution.contacts[1].force -= 1e9 * between;
        let claim = Claim {
            states: record.states(),
            next: record.next_states(),
            wrenches: &record.first().wrenches,
            contacts: &record.first().contacts,
            joints: &[],
            gears: &[],
        };
        let forces = record.first().solution.forces();
        let world = record.first().world(&scene.world);
        let certificate = Certifier::new().contact_step(&world, &claim, forces);
        record.first_mut().certificate = certificate;
        record.first_mut().report.status = StepStatus::Failed;
        worst = worst.max(record.residual());
        writer.write(&record).unwrap();
    }
    simulation.end(&mut record);
    writer.write(&record).unwrap();
    drop(writer.finish().unwrap());

    unseal(&done.path("run.json"));
    let mut json = done.run_json();
    let converged = json["summary"]["converged"].clone();
    json["summary"]["failed"] = converged;
    json["summary"]["converged"] = 0.into();
    let steps = Table::parse(&fs::read_to_string(done.path("steps.csv")).unwrap());
    let residuals = steps.numbers("residual_m_s");
    json["summary"]["certificate_median_m_s"] = (0.5 * (residuals[0] + residuals[1])).into();
    json["summary"]["certificate_max_m_s"] = worst.into();
    fs::write(done.path("run.json"), json.to_string()).unwrap();
    let end = verify(&done.path(""));
    assert_eq!((end.code, end.stderr.as_str()), (Some(3), ""), "{end:?}");
}
