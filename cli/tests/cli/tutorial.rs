//! `--preset tutorial` and the default: the tutorial's nonlinear program to the letter, and with
//! posed contacts.

use crate::common::{Row, SEEDS, tutorial_rows};
use crate::support::{Simulated, Table, run, simulate};
use nalgebra::Vector3;
use std::fs;
use tumble_core::mechanics::State;

/// States of a trajectory by row.
fn states(table: &Table) -> Vec<State> {
    let names = [
        "x_m", "y_m", "z_m", "qw", "qx", "qy", "qz", "vx_m_s", "vy_m_s", "vz_m_s", "wx_rad_s",
        "wy_rad_s", "wz_rad_s",
    ];
    let columns = names.map(|name| table.numbers(name));
    let row = |k: usize| crate::common::state(&columns.each_ref().map(|column| column[k]));
    (0..table.rows.len()).map(row).collect()
}

fn tutorial(seed: u32, steps: i64) -> Simulated {
    let (seed, rows) = (seed.to_string(), (steps + 1).to_string());
    simulate(&["--preset", "tutorial", "--seed", &seed, "--steps", &rows])
}

/// The preset follows the recorded runs up to the first step that the tutorial's Ipopt did not
/// solve. The record solves free flight to Ipopt's tolerance of 10⁻⁶ in m, m/s and rad/s. The final
/// difference over some 200 steps stays below that.
///
/// The first step with contact is the one that fails. A corner crosses the detection band of 5 mm
/// in a step, and a force clamped to zero cannot stop it. The step fails here too and stays in the
/// file with its reason. Seed 1 only hits Ipopt's iteration limit in the record, and the installed
/// Ipopt converges.
#[test]
fn the_preset_follows_the_recorded_runs_to_their_first_failed_step() {
    for (seed, infeasible) in SEEDS.into_iter().zip([true, true, false, true]) {
        let rows = tutorial_rows(seed);
        let failed = rows[1..].iter().position(|row| !row.solved).unwrap();
        let first = rows[1 + failed].k;
        let run = tutorial(seed, first + 1);
        let table = run.table();
        let ours = states(&table);
        for Row { point, k, .. } in &rows[1..=failed] {
            let apart = (ours[*k as usize + 1].to_vector() - point.state().to_vector()).amax();
            assert!(apart < 1e-6, "seed {seed}, step {k}: {apart:e}");
        }
        let statuses = table.texts("status");
        assert!(!statuses[..first as usize].contains(&"failed"), "seed {seed}");
        if infeasible {
            assert_eq!(statuses[first as usize], "failed", "seed {seed}");
            assert_eq!(run.end.code, Some(3), "{:?}", run.end);
            assert!(run.end.stdout.contains("Infeasible_Problem_Detected"), "{:?}", run.end);
        }
    }
}

/// Slacks, multipliers and statuses of the preset's table are Ipopt's own: they obey rows (14) and (15)
/// of the states and forces in the same table.
#[test]
fn the_preset_writes_the_variables_and_the_status_of_ipopt() {
    let run = tutorial(42, 420);
    let table = run.table();
    let words = table.texts("ipopt_status");
    let statuses = table.texts("status");
    let succeeded = |k: usize| words[k] == "Solve_Succeeded";
    let solves: Vec<_> = (0..420).filter(|k| statuses[*k] != "free").collect();
    let is_failed = |k: &usize| statuses[*k] == "failed";
    assert!(solves.iter().all(|k| is_failed(k) || succeeded(*k)), "{words:?}");
    assert!(solves.iter().any(|k| words[*k] == "Infeasible_Problem_Detected"));
    // Ipopt's status is not the residual's: its tolerance allows forces at a distance.
    assert!(solves.iter().any(|k| is_failed(k) && succeeded(*k)));
    let states = states(&table);
    let mut positive = 0;
    for k in solves.into_iter().filter(|k| succeeded(*k)) {
        for corner in 0..8 {
            let of = |prefix: &str| table.numbers(&format!("{prefix}{corner}"))[k];
            let (s1, s2, slip) = (of("s1_"), of("s2_"), of("lam"));
            let force =
                ["fx", "fy", "fz"].map(|name| table.numbers(&format!("{name}{corner}_N"))[k]);
            let place =
                states[k + 1].pose().rotation * corner_of_the_cube(corner) + states[k + 1].position;
            // The preset's attitudes are unit quaternions to Ipopt's tolerance.
            let cone = 0.3 * force[2] - (force[0].hypot(force[1]).hypot(1e-6) - 1e-6);
            assert!(s1 >= force[2] * place.z - 1e-3, "{k}, {corner}: {s1:e}");
            assert!(s2 >= slip * cone - 1e-3, "{k}, {corner}: {s2:e}");
            positive += usize::from(s1 > 0.0 && slip > 0.0);
        }
    }
    assert!(positive > 20, "{positive}");
}

/// Corner of the tutorial's cube (m, body): x changes fastest.
fn corner_of_the_cube(corner: usize) -> Vector3<f64> {
    Vector3::from_fn(|k, _| if corner >> k & 1 == 1 { 1.0 } else { -1.0 })
}

/// The variant with the normal force as a factor has the same free flight, and its own contact steps.
#[test]
fn the_product_preset_is_another_program_of_the_same_cube() {
    let product = simulate(&["--preset", "tutorial-product", "--seed", "1", "--steps", "261"]);
    assert_eq!(product.run_json()["solver"]["preset"], "tutorial-product");
    let [flags, product] = [tutorial(1, 260), product].map(|run| states(&run.table()));
    let apart = |k: usize| (flags[k].to_vector() - product[k].to_vector()).amax();
    assert!((0..150).all(|k| apart(k) < 1e-9), "free flight");
    assert!(apart(260) > 1e-9);
}

/// run.json contains the settings of the preset, and the run continues after failed steps.
#[test]
fn preset_is_recorded_and_run_continues_after_failed_steps() {
    let run = tutorial(42, 260);
    assert_eq!(run.end.code, Some(3), "{:?}", run.end);
    let file = run.run_json();
    let solver = &file["solver"];
    assert_eq!(solver["name"], "ipopt");
    assert_eq!(solver["preset"], "tutorial");
    assert_eq!(solver["detection"], "height");
    assert_eq!(solver["on_failure"], "record");
    assert_eq!((&solver["tol"], &solver["max_iter"]), (&1e-6.into(), &300.into()));
    assert_eq!(file["summary"]["rows"], 261);
    assert_eq!(file["summary"]["retried"], 0);
    assert_eq!(file["summary"]["fallback"], 0);
    let table = run.table();
    let failed = table.texts("status").iter().filter(|status| **status == "failed").count();
    assert!(failed > 0 && file["summary"]["failed"] == failed, "{failed}");
}

/// A scenario may select the preset. A preset from a flag overrides the solver of the file.
#[test]
fn scenarios_name_the_preset() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("drop.toml");
    let scenario = |solver: &str| {
        let text = format!(
            "steps = 230\nseed = 42\nrotation = \"tutorial\"\n[body]\nbox = 2.0\nmass = 10.0\ninertia = 0.01\n\
             [ground]\nfriction = 0.3\n[start]\nposition = [0, 0, 2.5]\nattitude = \
             \"random\"\nvelocity = [0, 4, 0]\nspin = [0, -2, 1]\n[solver]\n{solver}\n"
        );
        fs::write(&path, text).unwrap();
        path.to_str().unwrap().to_owned()
    };
    let expected = tutorial(42, 229).csv();
    let by_field = simulate(&[&scenario("preset = \"tutorial\"")]);
    assert_eq!(by_field.csv(), expected);
    let file = scenario("name = \"native\"");
    let by_flag = simulate(&[&file, "--preset", "tutorial"]);
    assert_eq!(by_flag.csv(), expected);
    let contradiction = scenario("preset = \"tutorial\"\ntolerance = 1e-5");
    let refused = run(&[&contradiction]);
    refused.assert_refused(2, &["solver.tolerance", "preset tutorial"]);
}

/// Settings that contradict the preset or the solver are refused by name.
#[test]
fn contradictions_are_refused() {
    for flag in [
        &["--solver", "native"][..],
        &["--detection", "predictive"],
        &["--tol", "1e-7"],
        &["--max-iter", "200"],
        &["--on-failure", "ladder"],
    ] {
        let args = [&["--preset", "tutorial"], flag].concat();
        run(&args).assert_refused(2, &[flag[0], "preset tutorial", "leave it out"]);
    }
    run(&["--solver", "native", "--tol", "1e-7"]).assert_refused(2, &["--tol", "native solver"]);
    run(&["--scene", "floating", "--preset", "tutorial"]).assert_refused(2, &["--preset"]);
}

/// The default agrees with the native solver to 10⁻³ m/s over the 20 contact steps until faces
/// touch. Each of its steps has a residual below that.
#[test]
fn ipopt_and_native_move_the_cube_alike() {
    let steps = |solver| {
        let run = simulate(&["--solver", solver, "--steps", "245", "--seed", "42"]);
        assert_eq!(run.end.code, Some(0), "{:?}", run.end);
        assert_eq!(run.run_json()["solver"]["name"], solver);
        states(&run.table())
    };
    for (k, (a, b)) in steps("ipopt").iter().zip(steps("native")).enumerate() {
        let apart = (a.velocity - b.velocity).amax();
        assert!(apart < 1e-3, "step {k}: {apart:e} m/s");
    }
}

/// A note at the start says that many contact points are slow with Ipopt.
#[test]
fn many_points_are_announced() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("grid.toml");
    let points: Vec<_> = (0..121).map(|k| format!("[{}, {}, -0.1]", k % 11, k / 11)).collect();
    let text = format!(
        "steps = 2\n[body]\nmass = 1.0\ninertia = 10.0\npoints = [{}]\n[ground]\nfriction = \
         0.3\n[start]\nposition = [0, 0, 5]\n",
        points.join(", ")
    );
    fs::write(&path, text).unwrap();
    let path = path.to_str().unwrap();
    let printed = |args: &[&str]| {
        let run = simulate(&[&[path], args].concat());
        assert_eq!(run.end.code, Some(0), "{:?}", run.end);
        run.end.stdout.contains("--solver native is faster")
    };
    assert!(printed(&["--solver", "ipopt"]));
    assert!(!printed(&["--solver", "ipopt", "--quiet"]) && !printed(&[]));
}
