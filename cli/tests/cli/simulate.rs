//! Simulation: content of `trajectory.csv` and `run.json`.

use super::support::{
    CONTACT_RUN, FAILING_RUN, Simulated, WRITTEN, everything_in, simulate, tumble,
};
use serde_json::{Value, json};
use std::path::PathBuf;

const CONTACT_STATUSES: [&str; 5] = ["converged", "retried", "fallback", "wild", "failed"];

/// Documented header of a trajectory.
fn promised_header() -> Vec<String> {
    let state = "k,time_s,x_m,y_m,z_m,qw,qx,qy,qz,vx_m_s,vy_m_s,vz_m_s,wx_rad_s,wy_rad_s,wz_rad_s";
    let mut names: Vec<String> = state.split(',').map(str::to_owned).collect();
    for (prefix, suffix) in [
        ("fx", "_N"),
        ("fy", "_N"),
        ("fz", "_N"),
        ("s1_", ""),
        ("s2_", ""),
        ("lam", ""),
        ("alpha", ""),
    ] {
        names.extend((0..8).map(|contact| format!("{prefix}{contact}{suffix}")));
    }
    let reports = ["status", "ipopt_status", "iterations", "certificate_m_s"];
    names.extend(reports.map(str::to_owned));
    names
}

/// Asserts the invariants of every pair of files and of the exit code.
fn assert_consistent(run: &Simulated, rows: usize, time_step: f64) {
    assert_eq!(run.end.stderr, "");
    assert_eq!(everything_in(&run.path("")), WRITTEN.map(PathBuf::from));
    let table = run.table();
    assert_eq!(table.header, promised_header());
    assert_eq!(table.rows.len(), rows);
    assert!(table.rows.iter().all(|row| row.len() == table.header.len()));
    assert!(run.csv().ends_with('\n') && !run.csv().contains('\r'));

    let (first_step, last_step) = (table.column("fx0_N"), table.column("alpha7"));
    let statuses = table.texts("status");
    for (k, row) in table.rows.iter().enumerate() {
        assert_eq!(row[0], k.to_string());
        // A single multiplication, equal to the last bit.
        assert_eq!(row[1].parse::<f64>().unwrap(), k as f64 * time_step, "row {k}");
        let step = &row[first_step..=last_step];
        match statuses[k] {
            "end" => assert_eq!(k, rows - 1),
            "free" => assert_eq!(row[table.column("iterations")], "0"),
            status => {
                assert!(CONTACT_STATUSES.contains(&status), "{status}");
                assert_forces_follow_flags(step, k);
                continue;
            }
        }
        assert!(step.iter().all(|field| field.parse() == Ok(0.0)), "row {k}: {step:?}");
    }
    let last = table.rows.last().unwrap();
    assert_eq!(last[table.column("status")..], ["end", "", "0", "0.0"]);
    for name in (0..8).map(|contact| format!("alpha{contact}")) {
        assert!(table.texts(&name).iter().all(|&flag| flag == "0" || flag == "1"), "{name}");
    }
    assert_summary(run, rows);
}

/// Asserts that a contact without its flag has zero force, slack and multiplier. `step` holds eight
/// values each of fx, fy, fz, s1, s2, lam and alpha.
fn assert_forces_follow_flags(step: &[String], k: usize) {
    for contact in (0..8).filter(|contact| step[48 + contact] == "0") {
        for field in step[contact..48].iter().step_by(8) {
            assert_eq!(field.parse(), Ok(0.0), "row {k}, contact {contact}");
        }
    }
}

/// Asserts that the summary in run.json counts the rows of the CSV.
fn assert_summary(run: &Simulated, rows: usize) {
    let table = run.table();
    let statuses = table.texts("status");
    let certificates = table.numbers("certificate_m_s");
    let count = |name: &str| statuses.iter().filter(|&&status| status == name).count();
    let in_contact: Vec<usize> =
        (0..rows).filter(|&k| CONTACT_STATUSES.contains(&statuses[k])).collect();
    let mut sorted: Vec<f64> = in_contact.iter().map(|&k| certificates[k]).collect();
    sorted.sort_by(f64::total_cmp);
    let median = match (sorted.len(), sorted.len() / 2) {
        (0, _) => Value::Null,
        (invalid, middle) if invalid % 2 == 1 => json!(sorted[middle]),
        (_, middle) => json!(0.5 * (sorted[middle - 1] + sorted[middle])),
    };
    let largest = certificates[..rows - 1].iter().copied().fold(f64::NEG_INFINITY, f64::max);

    let run_json = run.run_json();
    let summary = run_json["summary"].as_object().unwrap();
    let seconds = summary["solve_seconds"].as_f64().unwrap();
    assert!((0.0..60.0).contains(&seconds), "{seconds}");
    let expected = json!({
        "rows": rows,
        "free_steps": count("free"),
        "contact_steps": in_contact.len(),
        "iterations": table.numbers("iterations").iter().map(|&n| n as u64).sum::<u64>(),
        "converged": count("converged"),
        "retried": count("retried"),
        "fallback": count("fallback"),
        "wild": count("wild"),
        "failed": count("failed"),
        "certificate_median_m_s": median,
        "certificate_max_m_s": if rows > 1 { json!(largest) } else { Value::Null },
        "solve_seconds": seconds,
    });
    for (name, value) in expected.as_object().unwrap() {
        assert_eq!(&summary[name], value, "{name}");
    }
    assert_eq!(run.end.code, Some(if count("failed") > 0 { 3 } else { 0 }));
}

#[test]
fn a_drop_with_contact_converges_and_its_files_agree() {
    for solver in ["ipopt", "native"] {
        let run = simulate(&[CONTACT_RUN.as_slice(), &["--solver", solver]].concat());
        assert_consistent(&run, 240, 0.002);
        assert_eq!(run.end.code, Some(0), "{solver}");
        let json = run.run_json();
        assert_eq!(json["solver"]["name"], solver);
        let contact_steps = json["summary"]["contact_steps"].as_u64().unwrap();
        assert!(contact_steps > 0, "{solver}: the cube lands around k = 223");
        assert!(json["summary"]["iterations"].as_u64().unwrap() > 0, "{solver}");
        assert!(run.end.stdout.contains("240 rows"), "{}", run.end.stdout);
        assert!(run.end.stdout.contains("states.csv"), "{}", run.end.stdout);
    }
}

#[test]
fn a_run_whose_steps_fail_is_written_whole_and_ends_with_code_3() {
    let run = simulate(&FAILING_RUN);
    assert_consistent(&run, 4, 0.002);
    assert_eq!(run.end.code, Some(3));
    assert!(run.end.stdout.contains("failed"), "{}", run.end.stdout);
}

#[test]
fn runs_of_one_two_and_sixty_five_rows_have_as_many_rows() {
    // 65 rows are 64 steps, the number of steps between two checks of the clock.
    for rows in [1, 2, 64, 65, 66] {
        assert_consistent(&simulate(&["--steps", &rows.to_string()]), rows, 0.002);
    }
}

#[test]
fn the_floating_scene_spins_without_a_ground() {
    let run = simulate(&["--scene", "floating"]);
    assert_consistent(&run, 1200, 0.001);
    let table = run.table();
    let state = |row: &[String]| -> Vec<f64> {
        row[2..15].iter().map(|field| field.parse().unwrap()).collect()
    };
    let start = [0.0, 0.0, 3.0, 1.0, 0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 2.0, 4.0, 6.0];
    assert_eq!(state(&table.rows[0]), start);
    // Uniform motion and rotation by |ω| t about ω, because the inertia is 0.01·E and no force
    // acts. The fourth-order Runge–Kutta error is (h |ω|/2)⁵/120 = 7e-15 a step over 1200 steps.
    // Rounding adds a similar error.
    let end = state(&table.rows[1199]);
    let (t, speed): (f64, f64) = (1.199, 56.0_f64.sqrt());
    let (sine, cosine) = (0.5 * speed * t).sin_cos();
    let expected = [2.0 * t, 0.0, 3.0, cosine, 2.0, 4.0, 6.0, 2.0, 0.0, 0.0, 2.0, 4.0, 6.0];
    for (k, (found, mut expected)) in end.into_iter().zip(expected).enumerate() {
        if (4..7).contains(&k) {
            expected *= sine / speed;
        }
        assert!((found - expected).abs() < 1e-10, "entry {k}: {found}, not {expected}");
    }
    assert!(table.texts("status")[..1199].iter().all(|&status| status == "free"));
    assert!(run.end.stdout.contains("floating scene"));
}

#[test]
fn numbers_have_the_fewest_digits_that_read_back_to_the_same_double() {
    let table = simulate(&CONTACT_RUN).table();
    let status = table.column("status");
    let digits = |text: &str| {
        let mantissa = text.split(['e', 'E']).next().unwrap();
        let digits: String = mantissa.chars().filter(char::is_ascii_digit).collect();
        digits.trim_matches('0').to_owned()
    };
    for field in table.rows.iter().flat_map(|row| row[..status].iter().chain(&row[status + 2..])) {
        let value: f64 = field.parse().unwrap();
        assert!(value.is_finite());
        assert_eq!(digits(field), digits(&format!("{value:e}")), "{field}");
    }
}

#[test]
fn the_same_command_gives_the_same_files() {
    let first = simulate(&CONTACT_RUN);
    let again = simulate(&["--steps", "240", "--quiet", "--scene", "drop", "--seed", "42"]);
    assert_eq!(first.csv(), again.csv());
    let without_time = |run: &Simulated| {
        let mut json = run.run_json();
        json["summary"]["solve_seconds"] = Value::Null;
        json
    };
    assert_eq!(without_time(&first), without_time(&again));
    let other = simulate(&["--steps", "240", "--seed", "43"]);
    assert_ne!(first.csv(), other.csv());
}

#[test]
fn a_longer_run_begins_with_the_shorter_one() {
    let (short, long) = (simulate(&["--steps", "228"]).csv(), simulate(&CONTACT_RUN).csv());
    let lines = |text: &str| text.lines().map(str::to_owned).collect::<Vec<_>>();
    let (short, long) = (lines(&short), lines(&long));
    // All rows except the end row, which has no step.
    assert_eq!(short[..228], long[..228]);
}

#[test]
fn every_flag_is_recorded_and_used() {
    let inertia = "--set=body.inertia=[[0.02, 0.001, 0], [0.001, 0.03, 0], [0, 0, 0.025]]";
    let run = simulate(&[
        "--scene=drop",
        "--steps=20",
        "--seed=4294967295",
        "--dt=0.001",
        "--mu=0.5",
        "--set=body.mass=7.5",
        inertia,
        "--gravity=0.5,-1,-9",
        "--set=start.position=0,0,4.25",
        "--set=start.velocity=-1,2,-0.5",
        "--set=start.spin=-3,0.5,1e-1",
        "--detection=height",
        "--tol=1e-7",
        "--max-iter=250",
    ]);
    assert_consistent(&run, 20, 0.001);
    let json = run.run_json();
    assert_eq!(json["scene"], "drop");
    assert_eq!(json["seed"], 4_294_967_295_u32);
    assert_eq!(json["tumble_version"], env!("CARGO_PKG_VERSION"));
    assert_eq!(json["ipopt_version"], tumble::ipopt::VERSION);
    let model = &json["model"];
    assert_eq!((&model["time_step"], &model["ground"]["friction"]), (&json!(0.001), &json!(0.5)));
    assert_eq!(model["gravity"], json!([0.5, -1.0, -9.0]));
    let body = &json["model"]["bodies"][0];
    assert_eq!(json["steps"], 20);
    assert_eq!(body["mass"], 7.5);
    let inertia = json!([[0.02, 0.001, 0.0], [0.001, 0.03, 0.0], [0.0, 0.0, 0.025]]);
    assert_eq!(body["inertia"], inertia);
    assert_eq!(body["pieces"][0]["box"], json!([2.0, 2.0, 2.0]));
    assert_eq!(json["solver"]["detection"], "height");
    assert_eq!(json["solver"]["tol"], 1e-7);
    assert_eq!(json["solver"]["max_iter"], 250);
    assert_eq!(body["position"], json!([0.0, 0.0, 4.25]));
    assert_eq!(body["velocity"], json!([-1.0, 2.0, -0.5]));
    assert_eq!(body["spin"], json!([-3.0, 0.5, 0.1]));
    let table = run.table();
    for (column, expected) in [("z_m", 4.25), ("vx_m_s", -1.0), ("vz_m_s", -0.5), ("wz_rad_s", 0.1)]
    {
        assert_eq!(table.numbers(column)[0], expected, "{column}");
    }
    for (row, field) in [("qw", 0), ("qx", 1), ("qy", 2), ("qz", 3)] {
        assert_eq!(json!(table.numbers(row)[0]), body["attitude"][field]);
    }
}

#[test]
fn without_out_the_files_go_to_a_folder_out_in_the_working_directory() {
    let directory = tempfile::tempdir().unwrap();
    for _ in 0..2 {
        // The directory and the files exist in the second run.
        let mut command = tumble();
        command.args(["--steps", "5"]).current_dir(directory.path()).assert().success();
        assert_eq!(everything_in(&directory.path().join("out")), WRITTEN.map(PathBuf::from));
    }
}
