//! The surroundings of a robot file, and settings of its user.

use nalgebra::Vector3;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use tumble_core::contact::Partner;
use tumble_core::simulation::StepRecord;
use tumble_core::world::Integrator;
use tumble_scene::scene::Scene;
use tumble_scene::settings::RobotSettings;

const WEDGE: &[u8] = include_bytes!("../../data/robots/parts/wedge.obj");

/// Scene of the single file `path`. Only `files` can be read.
fn alone(
    text: &str,
    path: &str,
    files: &[(&str, &[u8])],
    robot: RobotSettings,
) -> Result<Scene, String> {
    let read = |path: &Path, _: u64| {
        let found = files.iter().find(|(name, _)| Path::new(name) == path);
        found.map(|(_, bytes)| bytes.to_vec()).ok_or(io::ErrorKind::NotFound.into())
    };
    let scene = Scene::parse_with(text, Path::new(path), &[], &robot, &read);
    scene.map_err(|failure| failure.to_string())
}

const WITH_PACKAGE: &str = "<robot name='m'><link name='a'><inertial><mass value='1'/>\
    <inertia ixx='0.4' iyy='0.4' izz='0.4' ixy='0' ixz='0' iyz='0'/></inertial>\
    <collision><geometry><mesh filename='package://arm/parts/wedge.obj'/></geometry></collision></link></robot>";

/// Checks that a package is the nearest folder of its name above the file, or a folder of the given
/// packages.
#[test]
fn packages_are_found_above_the_file() {
    let small: &[u8] = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n";
    let corners = |path: &str, files: &[(&str, &[u8])], packages: Option<&str>| {
        let packages = packages.map(PathBuf::from);
        let scene =
            alone(WITH_PACKAGE, path, files, RobotSettings { packages, ..Default::default() });
        scene.map(|scene| scene.world.bodies()[0].contact_points().len())
    };
    let (near, far) = ("/robots/arm/parts/wedge.obj", "/arm/parts/wedge.obj");
    let file = "/robots/arm/urdf/arm.urdf";
    assert_eq!(corners(file, &[(near, WEDGE)], None), Ok(6));
    assert_eq!(corners(file, &[(far, small), (near, WEDGE)], None), Ok(6));
    assert_eq!(corners(file, &[(far, small)], None), Ok(4));
    assert_eq!(corners(file, &[(far, small), (near, WEDGE)], Some("/")), Ok(4));
    // A relative path may have parent folders outside of it.
    assert_eq!(corners("arm.urdf", &[("../arm/parts/wedge.obj", WEDGE)], None), Ok(6));
    let (above, below) = ("../../arm/parts/wedge.obj", "arm/parts/wedge.obj");
    assert_eq!(corners("../arm.urdf", &[(above, WEDGE)], None), Ok(6));
    // Folders before `..` are not parents.
    let away = "/robots/away/arm/parts/wedge.obj";
    for (file, below) in [("../arm.urdf", below), ("/robots/away/../arm.urdf", away)] {
        let why = corners(file, &[(below, small)], None).unwrap_err();
        assert!(why.contains("--packages"), "{file}: {why}");
    }
    let far = "/robots/away/../../arm/parts/wedge.obj";
    assert_eq!(corners("/robots/away/../arm.urdf", &[(far, small)], None), Ok(4));
    let why = corners(file, &[], None).unwrap_err();
    assert!(why.contains("package://arm/parts/wedge.obj") && why.contains("--packages"), "{why}");
    let why = corners(file, &[(near, WEDGE)], Some("/elsewhere")).unwrap_err();
    assert!(why.contains("/elsewhere") && why.contains("line 1, <mesh>"), "{why}");
    // Files of a package must be inside it.
    for rest in ["//arm/parts/wedge.obj", "/../arm/parts/wedge.obj", "/arm/../../wedge.obj"] {
        let text = WITH_PACKAGE.replace("/arm/parts/wedge.obj", rest);
        let files = ["/arm/parts/wedge.obj", "/wedge.obj", "/robots/arm/parts/wedge.obj"];
        let why = alone(
            &text,
            "/robots/arm.urdf",
            &files.map(|file| (file, WEDGE)),
            RobotSettings::default(),
        );
        let why = why.err().unwrap_or_default();
        assert!(why.contains("leaves its package") && why.contains("<mesh>"), "{rest}: {why}");
    }
}

/// Checks torsional and rolling friction of `condim` 4 and 6, with a note on the cone of MuJoCo. With the
/// option that ignores them, the contact has sliding friction only.
#[test]
fn torsional_and_rolling_friction_are_read() {
    let text = |condim: u32| {
        format!(
            "<mujoco><worldbody><geom type='plane' size='1 1 1' condim='1'/>\
             <body pos='0 0 0.1'><freejoint/><geom size='0.1' condim='{condim}' friction='0.7'/></body></worldbody></mujoco>"
        )
    };
    let read = |condim: u32, point_contacts: bool| {
        alone(
            &text(condim),
            "ball.xml",
            &[],
            RobotSettings { point_contacts, ..Default::default() },
        )
    };
    let turning = |condim: u32| {
        let scene = read(condim, false).unwrap();
        assert_eq!(scene.notes().iter().any(|note| note.contains("√3")), condim > 3);
        let of = scene.world.turning_friction_between(0, Partner::Ground);
        (of.torsional, of.rolling)
    };
    assert_eq!([1, 3, 4, 6].map(turning), [(0.0, 0.0), (0.0, 0.0), (0.005, 0.0), (0.005, 1e-4)]);
    let asked = RobotSettings { point_contacts: true, ..Default::default() };
    let why = alone(WITH_PACKAGE, "arm.urdf", &[("arm/parts/wedge.obj", WEDGE)], asked).err();
    assert!(
        why.as_deref().unwrap_or_default().contains("point_contacts is only for MJCF"),
        "{why:?}"
    );
    let (said, plain) = (read(6, true).unwrap(), read(3, false).unwrap());
    assert_eq!(said.changed, ["point-contacts"]);
    let notes = said.notes();
    assert!(notes.iter().any(|note| note.contains("only sliding friction")), "{notes:?}");
    assert!(plain.notes().is_empty());
    // The world is the same otherwise. A frictionless geom stays frictionless.
    let model = |scene: &Scene| format!("{:?}", scene.document);
    assert_eq!(model(&said), model(&plain));
    assert_ne!(model(&said), model(&read(1, true).unwrap()));
}

/// Checks that settings for robots are refused for other files.
#[test]
fn robot_settings_are_rejected_for_other_files() {
    let scenario =
        "[[bodies]]\nbox = 1.0\nmass = 1.0\nposition = [0, 0, 1]\n[ground]\nfriction = 0.5\n";
    for (robot, field) in [
        (RobotSettings { packages: Some(".".into()), ..Default::default() }, "packages"),
        (RobotSettings { leave_out: vec!["tendon".into()], ..Default::default() }, "leave-out"),
        (RobotSettings { point_contacts: true, ..Default::default() }, "point-contacts"),
    ] {
        let why = alone(scenario, "scene.toml", &[], robot).err().unwrap_or_default();
        assert!(why.contains(field) && why.contains("[[robots]]"), "{why}");
    }
}

fn plain(text: &str, files: &[(&str, &[u8])]) -> Result<Scene, String> {
    alone(text, "robot.xml", files, RobotSettings::default())
}

/// Checks that a flag which MuJoCo does not know is refused.
#[test]
fn unknown_flags_are_refused() {
    let text = |flag: &str| {
        format!(
            "<mujoco><option><flag {flag}/></option><worldbody><body><freejoint/>\
             <geom size='0.1'/></body></worldbody></mujoco>"
        )
    };
    assert!(plain(&text("midphase='disable'"), &[]).is_ok());
    let why = plain(&text("constraints='disable'"), &[]).err().unwrap_or_default();
    assert!(why.contains("constraints"), "{why}");
}

fn mesh_model(asset: &str, shape: &str) -> String {
    format!(
        "<mujoco><asset><mesh name='m' {asset}/></asset><worldbody><body><freejoint/><geom type='mesh' mesh='m' {shape}/></body>\
         </worldbody></mujoco>"
    )
}

/// Vertices and faces of a U with area 7 and height 1.
fn letter() -> String {
    let outline = [[0, 0], [3, 0], [3, 3], [2, 3], [2, 1], [1, 1], [1, 3], [0, 3]];
    let vertices = [0, 1].map(|z| outline.map(|[x, y]| format!("{x} {y} {z} ")).concat()).concat();
    let mut faces: Vec<[usize; 3]> = Vec::new();
    for a in 0..8 {
        let b = (a + 1) % 8;
        faces.extend([[a, b, 8 + b], [a, 8 + b, 8 + a]]);
    }
    for [a, b, c] in [[0, 5, 6], [0, 6, 7], [0, 1, 5], [1, 4, 5], [1, 2, 4], [2, 3, 4]] {
        faces.extend([[a, c, b], [8 + a, 8 + b, 8 + c]]);
    }
    let faces: String = faces.iter().map(|[a, b, c]| format!("{a} {b} {c} ")).collect();
    format!("vertex='{vertices}' face='{faces}'")
}

/// Checks the mass of a non-convex mesh. With `exact` it is the volume. The default is MuJoCo
/// 4.0.0's value for the same text, which adds the absolute volumes of the tetrahedra over all
/// faces. Their common apex is found in two steps.
#[test]
fn masses_of_meshes_follow_from_their_triangles() {
    let read = |inertia: &str| {
        let text = mesh_model(&format!("{} {inertia}", letter()), "");
        let scene = plain(&text, &[]).unwrap_or_else(|why| panic!("{why}"));
        let link = &scene.robots[0].robot().links[1];
        let mut moments: [f64; 3] = link.mass.inertia.symmetric_eigenvalues().into();
        moments.sort_by(|a, b| b.total_cmp(a));
        (link.mass.mass, moments)
    };
    let near = |(mass, moments): (f64, [f64; 3]), other: f64, others: [f64; 3], by: f64| {
        assert!((mass - other).abs() <= by * other, "{mass:?} {other}");
        let pairs = moments.iter().zip(others);
        assert!(pairs.clone().all(|(a, b)| (a - b).abs() <= by * b), "{moments:?} {others:?}");
    };
    // Boxes 3 × 1 × 1 below and two of 1 × 2 × 1 above, by the parallel axis theorem, with ρ =
    // 1000.
    let boxes = [
        (3.0, [1.5, 0.5], [3.0, 1.0]),
        (2.0, [0.5, 2.0], [1.0, 2.0]),
        (2.0, [2.5, 2.0], [1.0, 2.0]),
    ];
    let mass: f64 = boxes.iter().map(|(mass, ..)| mass).sum();
    let middle = [0, 1].map(|k| boxes.iter().map(|(mass, at, _)| mass * at[k]).sum::<f64>() / mass);
    let [xx, yy] = [0, 1].map(|k| {
        let part = |(mass, at, side): &(f64, [f64; 2], [f64; 2])| {
            mass * (side[k] * side[k] / 12.0 + (at[k] - middle[k]).powi(2))
        };
        boxes.iter().map(part).sum::<f64>()
    });
    let zz = mass / 12.0;
    let exact = [xx + yy, xx + zz, yy + zz].map(|moment| 1000.0 * moment);
    let mut exact = exact;
    exact.sort_by(|a, b| b.total_cmp(a));
    near(read("inertia='exact'"), 1000.0 * mass, exact, 1e-12);
    near(read("inertia='convex'"), 9000.0, [13500.0, 7500.0, 7500.0], 1e-12);
    let theirs = [12832.46246235, 7461.75400916, 6699.12912902];
    near(read(""), 8617.540091638031, theirs, 1e-11);
    let why = plain(&mesh_model(&format!("{} inertia='shell'", letter()), ""), &[]).err();
    assert!(why.as_deref().unwrap_or_default().contains("shell"), "{why:?}");
}

/// Checks that a mirrored mesh is not inside out. An inside-out mesh with exact inertia is refused,
/// for any given mass.
#[test]
fn mirrored_meshes_weigh_the_same() {
    let mass = |text: &str| {
        let scene = plain(text, &[("m.obj", WEDGE)]);
        scene.map(|scene| scene.robots[0].robot().links[1].mass.mass)
    };
    let near = |mass: f64, other: f64| assert!((mass - other).abs() <= 1e-12 * other, "{mass}");
    let letter = letter();
    for scale in ["1 1 1", "1 -1 1", "-1 -1 -1"] {
        let asset = format!("{letter} inertia='exact' scale='{scale}'");
        near(mass(&mesh_model(&asset, "")).unwrap(), 7000.0);
        near(mass(&mesh_model(&asset, "mass='3'")).unwrap(), 3.0);
        let file = |scale: &str| format!("file='m.obj' inertia='exact' scale='{scale}'");
        let plain = mass(&mesh_model(&file("1 1 1"), "")).unwrap();
        near(mass(&mesh_model(&file(scale), "")).unwrap(), plain);
    }
    let (vertices, faces) = letter.split_once("face='").unwrap();
    let faces: Vec<_> = faces.trim_end_matches('\'').split_whitespace().rev().collect();
    let inside_out = format!("{vertices} face='{}'", faces.join(" "));
    let exact = format!("{inside_out} inertia='exact'");
    for shape in ["", "mass='3'"] {
        let why = mass(&mesh_model(&exact, shape)).unwrap_err();
        assert!(why.contains("inside out") && why.contains("line 1, <geom>"), "{why}");
    }
    // With absolute volumes the orientation of a face does not matter.
    near(mass(&mesh_model(&inside_out, "")).unwrap(), mass(&mesh_model(&letter, "")).unwrap());
    assert_eq!(mass(&mesh_model(&exact, "").replace("<geom", WITH_INERTIAL)), Ok(2.0));
    // The compiler sets the default for meshes without their own setting.
    let told = |inertia: &str, on: bool| {
        let text = mesh_model(&format!("{letter} {inertia}"), "");
        let compiler = format!("<compiler exactmeshinertia='{on}'/><asset>");
        mass(&text.replace("<asset>", &compiler)).unwrap()
    };
    near(told("", true), 7000.0);
    let legacy = mass(&mesh_model(&letter, "")).unwrap();
    assert!(legacy > 8000.0);
    for mass in [told("", false), told("inertia='legacy'", true)] {
        near(mass, legacy);
    }
}

/// Given inertia, inserted before a geom.
const WITH_INERTIAL: &str = "<inertial pos='0 0 0' mass='2' diaginertia='1 1 1'/><geom";

/// Checks that MuJoCo's own mesh files have the same triangles as other formats.
#[test]
fn meshes_of_mujoco_are_read() {
    let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 3.0]];
    let faces: [[i32; 3]; 4] = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];
    let mut bytes: Vec<u8> =
        [4, 4, 0, 4].iter().flat_map(|count: &i32| count.to_le_bytes()).collect();
    let floats = corners.iter().flatten().chain([0.0; 12].iter());
    bytes.extend(floats.flat_map(|x: &f64| (*x as f32).to_le_bytes()));
    bytes.extend(faces.iter().flatten().flat_map(|index| index.to_le_bytes()));
    let text = mesh_model("file='m.msh'", "");
    let scene = plain(&text, &[("m.msh", &bytes)]).unwrap_or_else(|why| panic!("{why}"));
    assert_eq!(scene.world.bodies()[0].contact_points().len(), 4);
    assert!((scene.robots[0].robot().links[1].mass.mass - 1000.0).abs() < 1e-9);
    for cut in [0, 3, 15, 16, 60, bytes.len() - 1] {
        let why = plain(&text, &[("m.msh", &bytes[..cut])]).err().unwrap_or_default();
        assert!(why.contains("m.msh") && why.contains("<mesh>"), "{cut}: {why}");
    }
    let mut odd = bytes.clone();
    let last = odd.len() - 4;
    odd[last..].copy_from_slice(&7_i32.to_le_bytes());
    let why = plain(&text, &[("m.msh", &odd)]).err().unwrap_or_default();
    assert!(why.contains("vertex that does not exist"), "{why}");
}

/// Checks flat meshes. A visual mesh needs no hull, a colliding one becomes a plate, and one with
/// mass is refused.
#[test]
fn flat_meshes_are_visual_only() {
    let flat: &[u8] = b"v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\nf 1 3 4\n";
    let text =
        |shape: &str| mesh_model("file='m.obj'", shape).replace("<geom", "<geom size='0.1'/><geom");
    let read = |shape: &str| plain(&text(shape), &[("m.obj", flat)]);
    let scene = read("contype='0' conaffinity='0' mass='0'").unwrap_or_else(|why| panic!("{why}"));
    assert_eq!(scene.robots[0].robot().looks.len(), 1);
    let plate = read("mass='0'").unwrap_or_else(|why| panic!("{why}"));
    assert!(plate.notes().iter().any(|note| note.contains("it is flat")), "{:?}", plate.notes());
    let why = read("contype='0' conaffinity='0'").err().unwrap_or_default();
    assert!(why.contains("mass of one of its meshes") && why.contains("line 1"), "{why}");
    // Without its file the link is drawn by its collision shapes, with a note.
    let scene = plain(&text("contype='0' conaffinity='0' mass='0'"), &[]);
    let notes = scene.unwrap_or_else(|why| panic!("{why}")).notes();
    assert!(notes.iter().any(|note| note.contains("m.obj")), "{notes:?}");
    // Next to <inertial>, or in a group without mass, the density has no effect.
    let visual = text("contype='0' conaffinity='0'");
    let looks = |text: &str| {
        let scene = plain(text, &[("m.obj", flat)]);
        scene.map(|scene| scene.robots[0].robot().looks.len())
    };
    let given = visual.replacen("<geom", WITH_INERTIAL, 1);
    assert_eq!(looks(&given), Ok(1));
    let with =
        |text: &str, said: &str| text.replace("<asset>", &format!("<compiler {said}/><asset>"));
    let why = looks(&with(&given, "inertiafromgeom='true'")).unwrap_err();
    assert!(why.contains("mass of one of its meshes"), "{why}");
    let grouped = visual.replace("contype", "group='2' contype");
    assert_eq!(looks(&with(&grouped, "inertiagrouprange='0 1'")), Ok(1));
    assert!(looks(&with(&grouped, "inertiagrouprange='0 2'")).is_err());
    // The world has no mass, and a mesh of degenerate vertices without a file is not drawn.
    let world = "<worldbody><geom type='mesh' mesh='m' contype='0' conaffinity='0'/>";
    assert_eq!(looks(&given.replace("<worldbody>", world)), Ok(1));
    assert_eq!(looks(&given.replace("<worldbody>", &world.replace("contype='0'", ""))), Ok(1));
    let inline = "<mesh name='n' vertex='0 0 0 1 0 0 2 0 0 3 0 0'/></asset>";
    let part = "<geom type='mesh' mesh='n' contype='0' conaffinity='0'/></body>";
    let both = given.replace("</asset>", inline).replace("</body>", part);
    assert_eq!(looks(&both), Ok(1));
    let notes = plain(&both, &[("m.obj", flat)]).unwrap_or_else(|why| panic!("{why}")).notes();
    assert!(notes.iter().any(|note| note.contains("mesh without a hull")), "{notes:?}");
}

/// Checks the core of an ellipsoid, whose support function is h_E(n) = |D n|. The core is inside,
/// touches at the poles, and it deviates at most as arcs deviate from their chords. The contact
/// point has the support function itself.
#[test]
fn ellipsoids_are_rounded_hulls_within() {
    for half in [[0.3, 0.2, 0.1], [0.1, 0.1, 0.4], [0.2, 0.2, 0.05], [0.2, 0.2, 0.2]] {
        let [a, b, c] = half;
        let text = format!(
            "<mujoco><worldbody><geom type='plane' size='1 1 1'/><body pos='0 0 {c}'><freejoint/>\
             <geom type='ellipsoid' size='{a} {b} {c}'/></body></worldbody></mujoco>"
        );
        let scene = plain(&text, &[]).unwrap_or_else(|why| panic!("{why}"));
        let body = &scene.world.bodies()[0];
        let (piece, point) = (&body.pieces()[0], &body.contact_points()[0]);
        let mut worst = 0.0_f64;
        for number in 0..2000 {
            let height = 1.0 - (2.0 * f64::from(number) + 1.0) / 2000.0;
            let turn = 2.4 * f64::from(number);
            let across = (1.0 - height * height).sqrt();
            let n = Vector3::new(across * turn.cos(), across * turn.sin(), height);
            let own = piece.core().vertices().iter().map(|corner| corner.dot(&n) + piece.radius());
            let own = own.fold(f64::NEG_INFINITY, f64::max);
            let whole = n.component_mul(&Vector3::from(half)).norm();
            let exact = point.radius + point.smooth().map_or(0.0, |one| one.half_width(&n));
            assert!((exact - whole).abs() <= 1e-15, "{half:?}: {exact} {whole}");
            assert!(own <= whole * (1.0 + 1e-12), "{half:?}: {own} {whole}");
            worst = worst.max(1.0 - own / whole);
        }
        // Arcs of 30°: 1 − cos 15° along them, and as much again across.
        assert!(worst < 0.07, "{half:?}: {worst}");
        // It stands on its pole, to rounding.
        let mut simulation = scene.simulation(&Arc::new(AtomicBool::new(false))).unwrap();
        let mut record = StepRecord::new();
        simulation.step(&mut record).unwrap();
        assert!(record.residual() <= 1e-9);
        assert!((simulation.states()[0].position.z - c).abs() < 1e-12);
    }
}

const TWO_SLIDES: &str = "<mujoco><option gravity='0 0 0' timestep='0.002'/><worldbody>\
    <body><joint name='x' type='slide' axis='1 0 0' ref='0.3'/><geom size='0.1' mass='2'/></body>\
    <body pos='0 1 0'><joint name='y' type='slide' axis='1 0 0'/><geom size='0.1' mass='3'/></body></worldbody>\
    <tendon><fixed name='both'><joint joint='x' coef='0.5'/><joint joint='y' coef='-2'/></fixed>\
    <fixed name='one'><joint joint='x' coef='-2'/></fixed></tendon>REST</mujoco>";

fn driven(rest: &str, controls: &[f64], steps: usize) -> Vec<f64> {
    let text = TWO_SLIDES.replace("REST", rest);
    let mut scene = plain(&text, &[]).unwrap_or_else(|why| panic!("{why}"));
    scene.use_integrator(Integrator::Euler);
    let robot = &scene.robots[0];
    let mut simulation = scene.simulation(&Arc::new(AtomicBool::new(false))).unwrap();
    for joint in 0..2 {
        let (number, axis) = robot.axis(joint).unwrap();
        let drive = robot.drive(joint, controls).unwrap();
        simulation.set_drive(number, tumble_core::joint::JointAxis::Linear(axis), drive).unwrap();
    }
    let mut record = StepRecord::new();
    for _ in 0..steps {
        simulation.step(&mut record).unwrap();
        assert!(record.residual() <= 1e-9);
    }
    robot.coordinates(simulation.states(), robot.start()).unwrap().0
}

/// Checks that a tendon's motor pulls each joint by its coefficient. In n steps a mass m moves by
/// h² f/m n (n + 1)/2.
#[test]
fn motors_pull_by_tendons() {
    let rest = "<actuator><motor tendon='both' gear='4' ctrlrange='-1 1'/></actuator>";
    let (h, n) = (0.002, 10.0);
    let far = |force: f64, mass: f64| h * h * force / mass * n * (n + 1.0) / 2.0;
    let q = driven(rest, &[3.0], 10);
    assert!((q[0] - 0.3 - far(4.0 * 0.5, 2.0)).abs() < 1e-13, "{q:?}");
    assert!((q[1] - far(4.0 * -2.0, 3.0)).abs() < 1e-13, "{q:?}");
    // On one joint, with a position dependence: f = −2·5·(−2 x) = −20 x.
    let rest = "<actuator><position tendon='one' kp='5'/></actuator>";
    let (q, k) = (driven(rest, &[0.0], 1), 20.0);
    assert!((q[0] - 0.3 / (1.0 + h * h * k / 2.0)).abs() < 1e-13, "{q:?}");
    // On two joints: L = L₀ + h² f (0.5²/2 + 2²/3), f = −5 L.
    let q = driven("<actuator><position tendon='both' kp='5'/></actuator>", &[0.0], 1);
    let length = 0.5 * q[0] - 2.0 * q[1];
    let yields = h * h * (0.125 + 4.0 / 3.0);
    assert!((length - 0.15 / (1.0 + 5.0 * yields)).abs() < 1e-13, "{q:?}");
}

/// Checks an equality constraint on a tendon, 0.5 (x − 0.3) − 2 y = c. The range of a tendon on one
/// joint is that joint's range.
#[test]
fn tendons_hold_joints() {
    let rest = "<equality><tendon tendon1='both' polycoef='0.2'/></equality><actuator><motor joint='y'/></actuator>";
    let q = driven(rest, &[5.0], 50);
    assert!((0.5 * (q[0] - 0.3) - 2.0 * q[1] - 0.2).abs() < 1e-12, "{q:?}");
    // Both move: 5 N on y, whose effective mass is 3 + 16·2.
    assert!(q[1] > 1e-4);
    let text = TWO_SLIDES.replace("<fixed name='one'", "<fixed name='one' range='-1 0.2'");
    let robot = plain(&text.replace("REST", ""), &[]).unwrap_or_else(|why| panic!("{why}"));
    assert_eq!(robot.robots[0].robot().joints[0].range, Some([-0.1, 0.5]));
    for (rest, said) in [
        ("<equality><tendon tendon1='non'/></equality>", "no tendon"),
        ("<actuator><motor tendon='non'/></actuator>", "no tendon"),
        (
            "<tendon><fixed name='c' stiffness='3'><joint joint='x' coef='1'/></fixed></tendon>",
            "tendons with forces or limits",
        ),
        ("<tendon><fixed name='c'><joint joint='z' coef='1'/></fixed></tendon>", "no joint"),
        (
            "<tendon><fixed name='c'><joint joint='x' coef='1'/><joint joint='x' coef='-1'/></fixed></tendon>\
             <actuator><motor tendon='c'/></actuator>",
            "drives nothing",
        ),
        (
            "<tendon><fixed name='c'/></tendon><actuator><motor tendon='c'/></actuator>",
            "drives nothing",
        ),
    ] {
        let why = plain(&TWO_SLIDES.replace("REST", rest), &[]).err().unwrap_or_default();
        assert!(why.contains(said) && why.contains("line 1"), "{rest}: {why}");
    }
}

/// Checks jointed links that start inside a fixed shape. They do not collide with it, with a note.
/// A free body is lifted out.
#[test]
fn jointed_links_do_not_collide_with_what_they_start_in() {
    let text = |joint: &str| {
        format!(
            "<mujoco><worldbody><geom name='post' type='box' size='0.2 0.2 1'/>\
             <body name='arm' pos='0.1 0 1'>{joint}<geom type='box' size='0.3 0.1 0.1'/></body></worldbody></mujoco>"
        )
    };
    let scene = plain(&text("<joint axis='0 0 1'/>"), &[]).unwrap_or_else(|why| panic!("{why}"));
    let notes = scene.notes();
    assert!(notes.iter().any(|note| note.contains("arm and post")), "{notes:?}");
    let scene = plain(&text("<freejoint/>"), &[]).unwrap_or_else(|why| panic!("{why}"));
    let notes = scene.notes();
    assert!(notes.iter().any(|note| note.contains("arm was lifted 1.000e-1 m")), "{notes:?}");
    assert!((scene.starts[0].position[2] - 1.1).abs() < 1e-12);
}

/// Checks a link with several meshes. If they have too many corners together, each is reduced.
#[test]
fn hulls_of_a_link_share_its_corners() {
    let ball: String = (0..500)
        .map(|number| {
            let height = 1.0 - (2.0 * f64::from(number) + 1.0) / 500.0;
            let (turn, across) = (2.4 * f64::from(number), (1.0 - height * height).sqrt());
            format!("{} {} {height} ", across * turn.cos(), across * turn.sin())
        })
        .collect();
    let text = |count: usize| {
        let geoms: String =
            (0..count).map(|k| format!("<geom type='mesh' mesh='m' pos='{k} 0 0'/>")).collect();
        format!(
            "<mujoco><asset><mesh name='m' vertex='{ball}'/></asset><worldbody><body name='a'><freejoint/>{geoms}</body>\
             </worldbody></mujoco>"
        )
    };
    let two = plain(&text(2), &[]).unwrap_or_else(|why| panic!("{why}"));
    assert!(two.world.bodies()[0].contact_points().len() == 1000 && two.notes().is_empty());
    let four = plain(&text(4), &[]).unwrap_or_else(|why| panic!("{why}"));
    let (count, notes) = (four.world.bodies()[0].contact_points().len(), four.notes());
    assert!((900..=1000).contains(&count), "{count}");
    assert!(notes.len() == 1 && notes[0].contains("250 corners"), "{notes:?}");
}
