//! `tumble gradient`: derivatives of runs compared with finite differences.

use crate::ROOT;
use crate::support::{End, everything_in, tumble};
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;
use tumble_core::world::Constant;

fn scenario(name: &str) -> PathBuf {
    Path::new(ROOT).join("scenarios").join(name)
}

/// Runs `tumble gradient` on a shipped scenario and writes to a temporary directory.
fn gradient(name: &str, args: &[&str]) -> (TempDir, End) {
    let directory = TempDir::new().unwrap();
    let mut command = tumble();
    command.arg("gradient").arg(scenario(name)).args(args).arg("--out").arg(directory.path());
    let end = command.output().unwrap().into();
    (directory, end)
}

/// Derivatives agree with finite differences for a thrown cube with impacts and for a mechanism.
/// The tolerance covers the rounding of some hundred steps in differences of width 1e-6.
#[test]
fn derivatives_are_the_differences_of_runs() {
    let cases = [
        (
            "real-cube.toml",
            "distance",
            "position,turn,velocity,spin,force,friction,mass,gravity",
            "200",
        ),
        ("double-pendulum.toml", "speed", "spin,torque,gravity,time_step", "200"),
    ];
    for (name, of, by, steps) in cases {
        let args = ["--of", of, "--by", by, "--steps", steps, "--differences", "1e-6"];
        let (directory, end) = gradient(name, &args);
        assert_eq!((end.code, end.stderr.as_str()), (Some(0), ""));
        let json: Value =
            serde_json::from_slice(&fs::read(directory.path().join("gradient.json")).unwrap())
                .unwrap();
        let rows = json["derivatives"].as_array().unwrap();
        let of_row = |row: &Value, what: &str| row[what].as_f64().unwrap();
        let largest =
            |what: &str| rows.iter().map(|row| of_row(row, what).abs()).fold(0.0, f64::max);
        let scale = largest("derivative");
        assert!(rows.len() > 8 && scale > 1e-3, "{name}");
        for row in rows {
            // Components that violate a joint at the start are left out of the table.
            let (found, expected) = (of_row(row, "derivative"), of_row(row, "difference"));
            assert!((found - expected).abs() <= 3e-5 * scale, "{name} {row}");
        }
        assert_eq!([&json["unsolved"], &json["unknown"], &json["kept"]], [0; 3]);
        let csv = fs::read_to_string(directory.path().join("gradient.csv")).unwrap();
        assert_eq!(csv.lines().count(), rows.len() + 1);
        assert!(csv.starts_with("argument,component,part,unit,derivative,difference\n"));
        // Free hinges without limits have a single smooth branch.
        let bends = name == "real-cube.toml";
        assert_eq!(end.stdout.contains("nearest kink"), bends, "{}", end.stdout);
    }
}

/// Derivatives of joint coordinates, their rates and spins agree with finite differences.
#[test]
fn results_of_joints_and_spins() {
    let cases = [
        ("double-pendulum.toml", &["--of", "coordinate", "--joint", "elbow"][..], 1.0),
        ("double-pendulum.toml", &["--of", "rate", "--joint", "elbow"], 1.0),
        ("double-pendulum.toml", &["--of", "rate", "--joint", "shoulder", "--axis", "turn"], 1.0),
        ("slider-crank.toml", &["--of", "coordinate", "--joint", "rail"], 1e-3),
        ("slider-crank.toml", &["--of", "rate", "--joint", "rail"], 1e-3),
        ("real-cube.toml", &["--of", "wy"], 1e-3),
    ];
    for (name, of, least) in cases {
        let by = ["--by", "gravity,mass", "--steps", "200", "--differences", "1e-6"];
        let (directory, end) = gradient(name, &[of, &by].concat());
        assert_eq!((end.code, end.stderr.as_str()), (Some(0), ""), "{of:?}");
        let json: Value =
            serde_json::from_slice(&fs::read(directory.path().join("gradient.json")).unwrap())
                .unwrap();
        assert_eq!(json["joint"].as_str(), of.get(3).copied());
        let rows = json["derivatives"].as_array().unwrap();
        let of_row = |row: &Value, what: &str| row[what].as_f64().unwrap();
        let scale = rows.iter().map(|row| of_row(row, "derivative").abs()).fold(0.0, f64::max);
        assert!(scale > 1e-3 * least, "{of:?}: {scale}");
        for row in rows {
            let (found, expected) = (of_row(row, "derivative"), of_row(row, "difference"));
            assert!((found - expected).abs() <= 3e-5 * scale.max(0.1), "{of:?} {row}");
        }
    }
}

/// The help lists every argument that the command knows.
#[test]
fn the_help_names_every_argument() {
    let end: End = tumble().args(["gradient", "--help"]).output().unwrap().into();
    assert_eq!(end.code, Some(0), "{end:?}");
    let by = end.stdout.split("--by <LIST>").nth(1).unwrap().split("[default").next().unwrap();
    let listed: Vec<_> = by.split([',', '.', ':', '\n']).map(str::trim).collect();
    let own = ["position", "turn", "velocity", "spin", "force", "torque"];
    for name in own.into_iter().chain(Constant::ALL.map(Constant::name)) {
        assert!(listed.contains(&name), "{name}: {by}");
    }
}

/// Differences keep the inertia matrix symmetric and are one-sided at the end of a range.
#[test]
fn differences_of_what_has_ends_and_of_symmetric_matrices() {
    let directory = TempDir::new().unwrap();
    let scene = directory.path().join("box.toml");
    let text = "steps = 60\n[ground]\nfriction = 0.3\n[[bodies]]\nbox = [0.2, 0.3, 0.4]\nmass = 2\n\
                position = [0, 0, 0.21]\nvelocity = [1, 0.5, 0]\nspin = [3, -2, 1]\n";
    fs::write(&scene, text).unwrap();
    let mut command = tumble();
    command.arg("gradient").arg(&scene).arg("--out").arg(directory.path().join("out"));
    command.args(["--of", "speed", "--by", "inertia,radius", "--differences", "1e-6"]);
    let end: End = command.output().unwrap().into();
    assert_eq!((end.code, end.stderr.as_str()), (Some(0), ""));
    let json = fs::read(directory.path().join("out/gradient.json")).unwrap();
    let json: Value = serde_json::from_slice(&json).unwrap();
    let rows = json["derivatives"].as_array().unwrap();
    assert_eq!(rows.len(), 10);
    let sizes = rows.iter().map(|row| row["derivative"].as_f64().unwrap().abs());
    let scale = sizes.fold(0.0, f64::max);
    for row in rows {
        let of = |what: &str| row[what].as_f64().unwrap();
        // Truncation error of differences of width 1e-6 with moments of inertia of 0.03 kg m².
        assert!((of("derivative") - of("difference")).abs() < 1e-5 * scale, "{row}");
    }
}

/// Derivatives by the coefficients and anchors of single bodies, pairs and joints are labelled with
/// their names and agree with differences.
#[test]
fn what_bodies_pairs_and_joints_have_of_their_own() {
    let directory = TempDir::new().unwrap();
    let scene = directory.path().join("own.toml");
    let text = "steps = 40\n[ground]\nfriction = 0.4\n\
                [[bodies]]\nname = \"sled\"\nbox = 0.2\nmass = 2\nposition = [0, 0, 0.1]\nvelocity = [1, 0, 0]\n\
                [[bodies]]\nname = \"load\"\nbox = 0.1\nmass = 1\nfriction = 0.3\nposition = [0, 0, 0.25]\nvelocity = [1.5, 0, 0]\n\
                [[bodies]]\nname = \"arm\"\nbox = [0.1, 0.1, 0.4]\nmass = 1\nposition = [0, 3, 2]\n\
                [[friction]]\nbetween = [\"sled\", \"ground\"]\ncoefficient = 0.2\n\
                [[joints]]\nname = \"pin\"\ntype = \"revolute\"\nbodies = [\"arm\"]\nanchor = [0.1, 3, 2.1]\naxis = [0, 1, 0]\n";
    fs::write(&scene, text).unwrap();
    let derivatives = |body: &str, by: &str| -> Vec<Value> {
        let mut command = tumble();
        command.arg("gradient").arg(&scene).arg("--out").arg(directory.path().join("out"));
        command.args(["--of", "x", "--body", body, "--by", by, "--differences", "5e-7"]);
        let end: End = command.output().unwrap().into();
        assert_eq!((end.code, end.stderr.as_str()), (Some(0), ""));
        let json = fs::read(directory.path().join("out/gradient.json")).unwrap();
        let json: Value = serde_json::from_slice(&json).unwrap();
        json["derivatives"].as_array().unwrap().clone()
    };
    let check = |rows: &[Value], parts: &[&str]| {
        let found: Vec<_> = rows.iter().map(|row| row["part"].as_str().unwrap()).collect();
        assert_eq!(found, parts);
        let of = |row: &Value, what: &str| row[what].as_f64().unwrap();
        let scale = rows.iter().map(|row| of(row, "derivative").abs()).fold(0.0, f64::max);
        assert!(scale > 1e-3);
        for row in rows {
            // Rounding of 1e-10 m over the width of the difference, and its truncation error.
            assert!((of(row, "derivative") - of(row, "difference")).abs() < 1e-3 * scale, "{row}");
        }
    };
    let rows = derivatives("load", "pair_friction,body_friction,mass");
    check(&rows, &["sled and the ground", "load", "sled", "load", "arm"]);
    let rows = derivatives("arm", "anchor");
    let parts = ["x of a", "y of a", "z of a", "x of b", "y of b", "z of b"];
    check(&rows, &parts.map(|part| format!("pin, {part}")).each_ref().map(String::as_str));
    let csv = fs::read_to_string(directory.path().join("out/gradient.csv")).unwrap();
    assert!(csv.contains("anchor,0,\"pin, x of a\",m,"), "{csv}");
}

/// A gear couples two carriages, and the second one has a limit. At the limit x = r x* + q₀ holds.
/// Before that, a spring acts on the first carriage.
#[test]
fn gears_rests_and_limits_by_their_joints() {
    let directory = TempDir::new().unwrap();
    let scene = directory.path().join("rails.toml");
    let text = "steps = 40\ntime_step = 0.01\n[ground]\nnone = true\nfriction = 0.3\n\
                [[bodies]]\nname = \"first\"\nbox = 0.2\nmass = 1\nposition = [0, 0, 1]\nvelocity = [0.5, 0, 0]\n\
                [[bodies]]\nname = \"second\"\nbox = 0.2\nmass = 2\nposition = [0, 3, 1]\nvelocity = [1, 0, 0]\n\
                [[joints]]\nname = \"rail\"\ntype = \"prismatic\"\nbodies = [\"first\"]\naxis = [1, 0, 0]\nanchor = [0, 0, 1]\n\
                stiffness = 20\nrest = 0.3\n\
                [[joints]]\nname = \"track\"\ntype = \"prismatic\"\nbodies = [\"second\"]\naxis = [1, 0, 0]\nanchor = [0, 3, 1]\n\
                limits = [-0.2, 0.1]\n\
                [[gears]]\njoints = [\"rail\", \"track\"]\nratio = 0.5\n";
    fs::write(&scene, text).unwrap();
    let derivatives = |by: &str, steps: &str| -> Vec<(String, f64, f64)> {
        let mut command = tumble();
        command.arg("gradient").arg(&scene).arg("--out").arg(directory.path().join("out"));
        command.args(["--of", "x", "--body", "first", "--by", by, "--steps", steps]);
        let end: End = command.args(["--differences", "2e-7"]).output().unwrap().into();
        assert_eq!((end.code, end.stderr.as_str()), (Some(0), ""));
        let json = fs::read(directory.path().join("out/gradient.json")).unwrap();
        let json: Value = serde_json::from_slice(&json).unwrap();
        let rows = json["derivatives"].as_array().unwrap().iter().map(|row| {
            let of = |what: &str| row[what].as_f64().unwrap();
            (row["part"].as_str().unwrap().to_owned(), of("derivative"), of("difference"))
        });
        rows.collect()
    };
    let close = |found: &[(String, f64, f64)], expected: &[(&str, f64)]| {
        assert_eq!(found.len(), expected.len(), "{found:?}");
        for ((part, derivative, difference), (name, value)) in found.iter().zip(expected) {
            assert_eq!(part, name);
            // The factor covers the rounding of 1e-14 m in the differences.
            let off = (derivative - value).abs().max(1e-4 * (difference - value).abs());
            assert!(off < 1e-8, "{name}: {derivative} {difference} {value}");
        }
    };
    let gear = "rail, along z, with track, along z";
    close(&derivatives("gear_ratio,gear_offset", "40"), &[(gear, 0.1), (gear, 1.0)]);
    let ends = [("track, along z, lower", 0.0), ("track, along z, upper", 0.5)];
    close(&derivatives("joint_limits", "40"), &ends);
    // After two steps of x⁺ = x + h v⁺ with the velocity of
    // (m + m₂/r² + h² k) v⁺ = (m + m₂/r²) v + h k (x* − x).
    let (all, h, k) = (9.0, 0.01, 20.0);
    let below = all + h * h * k;
    let one = h * h * k / below;
    let two = one + h * (all * one / h + h * k * (1.0 - one)) / below;
    close(&derivatives("joint_rest", "2"), &[("rail, along z", two), ("track, along z", 0.0)]);
}

/// `size` and `radius` are refused for a body of two pieces.
#[test]
fn a_shape_that_cannot_vary_is_refused() {
    for by in ["size", "radius"] {
        let directory = TempDir::new().unwrap();
        let scene = directory.path().join("two.toml");
        let text = "steps = 11\n[ground]\nfriction = 0.3\n[[bodies]]\nmass = 2\n\
                    pieces = [{ sphere = 0.1 }, { sphere = 0.1, position = [1, 0, 0] }]\n\
                    position = [0, 0, 0.3]\n";
        fs::write(&scene, text).unwrap();
        let mut command = tumble();
        command.arg("gradient").arg(&scene).arg("--out").arg(directory.path().join("out"));
        let end: End = command.args(["--of", "x", "--by", by]).output().unwrap().into();
        assert_eq!(end.code, Some(2), "{by}: {}", end.stdout);
        assert!(end.stderr.contains("leave size and radius out"), "{}", end.stderr);
    }
}

/// Unknown arguments, functions, bodies and options are refused.
#[test]
fn what_cannot_be_differentiated_is_refused() {
    let cases: [(&[&str], &[&str]); 11] = [
        (&["--of", "rate"], &["--of rate: a joint is needed", "--joint"]),
        (&["--of", "x", "--joint", "hinge"], &["--of x", "leave --joint out"]),
        (&["--of", "coordinate", "--joint", "hinge"], &["--joint hinge: the scene has no such"]),
        (&["--of", "x", "--by", "joint_friction"], &["joint_friction", "no such constant"]),
        (
            &["--of", "x", "--by", "colour"],
            &["--by: unknown argument \"colour\"", "velocity", "friction"],
        ),
        (&["--of", "x", "--body", "nobody"], &["--body nobody"]),
        (&["--of", "x", "--differences", "-1"], &["--differences", "above 0"]),
        (&["--of", "w"], &["--of", "distance"]),
        (&["--of", "x", "--compliance", "3"], &["--compliance", "1e-9 to 1"]),
        (&["--of", "x", "--central-path", "0"], &["--central-path", "1e-6 to 10 m/s"]),
        (&["--of", "x", "--compliance", "0.1", "--central-path", "1"], &["cannot be used with"]),
    ];
    for (args, words) in cases {
        let (directory, end) = gradient("slope.toml", args);
        end.assert_refused(2, words);
        assert!(everything_in(directory.path()).is_empty(), "{args:?}");
    }
    let (_, end) = gradient("floating.toml", &["--of", "x", "--steps", "3"]);
    end.assert_refused(2, &["Runge-Kutta"]);
}

/// Gradients are refused for scenarios that Ipopt solves.
#[test]
fn what_ipopt_solves_is_refused() {
    let directory = TempDir::new().unwrap();
    let file = directory.path().join("by-ipopt.toml");
    let text = fs::read_to_string(scenario("slope.toml")).unwrap();
    fs::write(&file, format!("{text}\n[solver]\nname = \"ipopt\"\n")).unwrap();
    let (_, end) = gradient(file.to_str().unwrap(), &["--of", "x", "--steps", "3"]);
    end.assert_refused(2, &["solver", "native"]);
}
