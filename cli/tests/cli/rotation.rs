//! Which equation turns a body: what files and flags say of it, and that everything downstream of a run
//! knows.

use super::scenario::run_scenario;
use super::support::{run, simulate, unseal};
use std::fs;

/// A skew box that spins over the ground and lands.
const BOX: &str = r#"
steps = 200
[body]
box = [1.0, 0.6, 0.4]
mass = 3.0
[ground]
friction = 0.5
[start]
position = [0, 0, 1.2]
attitude = [0.9, 0.1, -0.3, 0.2]
spin = [3.0, 5.0, -2.0]
[solver]
name = "native"
"#;

/// A scenario turns by momentum unless it or a flag says otherwise, the tutorial's scene as the
/// tutorial; `verify` judges by the form that run.json names, and of one without a word by the
/// tutorial's.
#[test]
fn files_and_flags_say_by_which_equation_bodies_turn() {
    let own = format!("rotation = \"tutorial\"{BOX}");
    let [plain, named, flagged] = [(BOX, &[][..]), (&own, &[]), (BOX, &["--rotation", "tutorial"])]
        .map(|(text, flags)| run_scenario(text, flags));
    let json = |directory: &tempfile::TempDir| -> serde_json::Value {
        let text = fs::read_to_string(directory.path().join("out/run.json")).unwrap();
        serde_json::from_str(&text).unwrap()
    };
    let csv = |directory: &tempfile::TempDir| {
        fs::read_to_string(directory.path().join("out/trajectory.csv")).unwrap()
    };
    for ((end, directory), form) in
        [(&plain, "momentum"), (&named, "tutorial"), (&flagged, "tutorial")]
    {
        assert_eq!(end.code, Some(0), "{end:?}");
        assert_eq!(json(directory)["model"]["rotation"], form);
    }
    assert_eq!(csv(&named.1), csv(&flagged.1));
    assert_ne!(csv(&plain.1), csv(&named.1));
    assert_eq!(json(&flagged.1)["changed"], serde_json::json!(["rotation"]));

    let verify = |directory: &tempfile::TempDir| {
        let path = directory.path().join("out/trajectory.csv");
        run(&["verify", path.to_str().unwrap()]).code
    };
    assert_eq!([verify(&plain.1), verify(&named.1)], [Some(0), Some(0)]);
    for ((_, directory), right) in [(&plain, false), (&named, true)] {
        unseal(&directory.path().join("out/run.json"));
        let mut before = json(directory);
        before["model"].as_object_mut().unwrap().remove("rotation");
        fs::write(directory.path().join("out/run.json"), before.to_string()).unwrap();
        assert_eq!(verify(directory) == Some(0), right);
    }

    let scene = simulate(&["--steps", "5"]);
    assert_eq!(scene.run_json()["model"]["rotation"], "tutorial");
    let changed = simulate(&["--steps", "5", "--mu", "0.5"]);
    assert_eq!(changed.run_json()["model"]["rotation"], "tutorial");
}

/// Without a ground there is no step to choose it for; other words are no form.
#[test]
fn a_rotation_that_means_nothing_is_refused() {
    let floating = run(&["--scene", "floating", "--rotation", "momentum"]);
    floating.assert_refused(2, &["--rotation", "floating"]);
    let free = BOX.replace("[ground]\nfriction = 0.5\n", "");
    let free = free.replace("[solver]\nname = \"native\"\n", "");
    let (end, _directory) = run_scenario(&format!("rotation = \"momentum\"{free}"), &[]);
    end.assert_refused(2, &["rotation", "[ground]"]);
    let (end, _directory) = run_scenario(&format!("rotation = \"euler\"{BOX}"), &[]);
    end.assert_refused(2, &["rotation", "momentum", "tutorial"]);
}

/// Of several bodies: run.json's model has the form, and the tables the energy that it keeps.
#[test]
fn the_energy_of_a_spinning_pair_is_that_which_its_steps_keep() {
    let text = |form: &str| {
        format!(
            "steps = 500\nrotation = \"{form}\"\n[ground]\nnone = true\nfriction = 0.5\n\
             [[bodies]]\nbox = [1.0, 0.6, 0.4]\nmass = 3.0\nposition = [0, 0, 0]\n\
             spin = [0.5, 6.0, 1.0]\n\
             [[bodies]]\nbox = [0.4, 0.7, 0.2]\nmass = 1.0\nposition = [0, 5, 0]\n\
             velocity = [0, 0, 4]\nspin = [5.0, 1.0, -2.0]\n"
        )
    };
    let [kept, lost] = ["momentum", "tutorial"].map(|form| {
        let (end, directory) = run_scenario(&text(form), &[]);
        assert_eq!(end.code, Some(0), "{end:?}");
        let file =
            |name: &str| fs::read_to_string(directory.path().join("out").join(name)).unwrap();
        let json: serde_json::Value = serde_json::from_str(&file("run.json")).unwrap();
        assert_eq!(json["model"]["rotation"], form);
        let energy = super::support::Table::parse(&file("steps.csv")).numbers("energy_J");
        let verified = directory.path().join("out/steps.csv");
        assert_eq!(run(&["verify", verified.to_str().unwrap()]).code, Some(0));
        energy.iter().map(|e| (e - energy[0]).abs()).fold(0.0, f64::max)
    });
    // (h ω)² of the energy of turning, some 3 J, against a second of first order.
    assert!(kept < 1e-4 && lost > 1e-2, "{kept} {lost}");
}
