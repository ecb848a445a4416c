//! Choice of the rotational equation of motion in files and flags, and its effect on later
//! commands.

use super::scenario::run_scenario;
use super::support::{run, simulate, unseal};
use std::fs;

/// Scene with a tilted box that spins and lands.
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

/// Scenarios use the momentum form unless a file or flag selects another. The tutorial's scenes use
/// the tutorial's form. `verify` reads the form from run.json and assumes the tutorial's form if it
/// is missing.
#[test]
fn files_and_flags_select_the_rotation_equation() {
    let own = format!("rotation = \"tutorial\"{BOX}");
    let [plain, named, flagged] = [(BOX, &[][..]), (&own, &[]), (BOX, &["--rotation", "tutorial"])]
        .map(|(text, flags)| run_scenario(text, flags));
    let json = |directory: &tempfile::TempDir| -> serde_json::Value {
        let text = fs::read_to_string(directory.path().join("out/run.json")).unwrap();
        serde_json::from_str(&text).unwrap()
    };
    let csv = |directory: &tempfile::TempDir| {
        fs::read_to_string(directory.path().join("out/states.csv")).unwrap()
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
        let path = directory.path().join("out/states.csv");
        run(&["verify", path.to_str().unwrap()]).code
    };
    assert_eq!([verify(&plain.1), verify(&named.1)], [Some(0), Some(0)]);
    for ((_, directory), right) in [(&plain, true), (&named, false)] {
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

/// A scene without ground has no choice of form, and unknown names are refused.
#[test]
fn rotation_is_rejected_where_it_has_no_effect() {
    let floating = run(&["--scene", "floating", "--rotation", "momentum"]);
    floating.assert_refused(2, &["--rotation", "floating"]);
    let free = BOX.replace("[ground]\nfriction = 0.5\n", "");
    let free = free.replace("[solver]\nname = \"native\"\n", "");
    let (end, _directory) = run_scenario(&format!("rotation = \"momentum\"{free}"), &[]);
    end.assert_refused(2, &["rotation", "[ground]"]);
    let (end, _directory) = run_scenario(&format!("rotation = \"euler\"{BOX}"), &[]);
    end.assert_refused(2, &["rotation", "momentum", "tutorial"]);
}

/// Several bodies: run.json names the form, and the energy in the table is conserved only by the
/// momentum form.
#[test]
fn energy_column_is_the_one_that_the_steps_conserve() {
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
        // The start has the energy of its instant, without the constant that (35) drops.
        energy[1..].iter().map(|e| (e - energy[1]).abs()).fold(0.0, f64::max)
    });
    // The momentum form has an error of (h ω)² of the rotational energy of some 3 J. The tutorial's
    // form has an error of first order in h.
    assert!(kept < 1e-4 && lost > 1e-2, "{kept} {lost}");
}
