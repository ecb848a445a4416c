//! Coupled joints of robot files: `mimic` of URDF and `<equality><joint>` of MJCF.

use nalgebra::Vector3;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use tumble_core::contact::Partner;
use tumble_core::simulation::{Simulation, StepRecord};
use tumble_robot::{Reading, read};
use tumble_scene::overrides::FieldOverride;
use tumble_scene::scene::Scene;
use tumble_scene::written;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn bytes(path: &Path, _: u64) -> std::io::Result<Vec<u8>> {
    std::fs::read(path)
}

fn text_of(name: &str) -> String {
    std::fs::read_to_string(root().join(name)).unwrap()
}

fn scene_of(text: &str, settings: &[FieldOverride]) -> Result<Scene, String> {
    let name = if text.starts_with('<') { "given.xml" } else { "given.toml" };
    let path = root().join("data/robots").join(name);
    Scene::from_text(text, &path, settings, &bytes).map_err(|failure| failure.to_string())
}

fn simulation(scene: &Scene) -> Simulation<'static> {
    scene.simulation(&Arc::new(AtomicBool::new(false))).unwrap()
}

/// Largest error of a gear after a step [m or rad].
fn off(simulation: &Simulation<'_>, record: &StepRecord) -> f64 {
    let world = simulation.world();
    let near: Vec<_> = record.first().solution.joints.iter().map(|joint| joint.angles).collect();
    let missed = world.gears().iter().map(|gear| {
        let [a, b] = gear
            .axes()
            .map(|axis| axis.coordinate(world.joints(), simulation.states(), &near[axis.joint]));
        (a - gear.ratio() * b - gear.offset()).abs()
    });
    missed.fold(0.0, f64::max)
}

/// Coordinates of the arm of gears.xml after 0.4 s, by MuJoCo 4.0.0 in steps of 1e-5 s. Its
/// constraints are stiff (solref 0.001 1, solimp 0.9999 0.9999 0.001) and hold to 3e-8.
const BY_MUJOCO: [f64; 3] = [1.88010388, -2.32015579, -0.11100782];

/// Checks that an arm with two couplings falls like MuJoCo's. The couplings
/// are exact.
#[test]
fn a_coupled_arm_falls_as_mujocos() {
    let text = text_of("tests/robots/gears.xml");
    let error = |h: f64| {
        let settings = [FieldOverride::parse(&format!("time_step={h:?}")).unwrap()];
        let scene = scene_of(&text, &settings).unwrap();
        let robot = &scene.robots[0];
        let mut simulation = simulation(&scene);
        let mut record = StepRecord::new();
        let mut q = robot.start().to_vec();
        for _ in 0..(0.4 / h).round() as usize {
            simulation.step(&mut record).unwrap();
            assert!(record.residual() <= 1e-9);
            assert!(off(&simulation, &record) <= 1e-13);
            q = robot.coordinates(simulation.states(), &q).unwrap().0;
        }
        let off = [q[1] + 0.1 - 0.3 + 1.5 * (q[0] - 0.2), q[2] - 0.05 * (q[1] + 0.1)];
        assert!(off.iter().all(|off| off.abs() <= 1e-13), "{off:?}");
        q.iter().zip(BY_MUJOCO).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    };
    let errors = [0.002, 0.001, 0.0005].map(error);
    // MuJoCo's figures have an error of first order in its steps of 1e-5 s.
    assert!(errors.iter().all(|error| *error < 1e-4), "{errors:?}");
}

/// Checks the arm of pusher.urdf, which pushes a box against a wall. Its hand moves on a straight
/// line. At rest the motor's torque and the weight of the links determine the force f of the hand:
///
/// ```text
/// 2 l sin a f = (m₁ + m₂) g l/2 cos a − τ
/// ```
///
/// Wall and ground react with the same force.
#[test]
fn an_arm_pushes_a_box_against_a_wall() {
    let text = text_of("scenarios/pusher.toml");
    let path = root().join("scenarios/pusher.toml");
    let scene = Scene::from_text(&text, &path, &[], &bytes);
    let scene = scene.unwrap_or_else(|why| panic!("{why}"));
    let body = |name: &str| scene.bodies.iter().position(|body| body == name).unwrap();
    let (crate_, fore) = (body("box"), body("fore"));
    let mut simulation = simulation(&scene);
    let mut record = StepRecord::new();
    for _ in 0..1199 {
        simulation.step(&mut record).unwrap();
        assert!(record.residual() <= 1e-9);
        let state = &simulation.states()[fore];
        // The hand is 0.2 m from the centre of its link.
        let hand = state.position + state.pose().rotation * Vector3::new(0.2, 0.0, 0.0);
        assert!((hand[2] - 0.1).abs() <= 1e-12, "{hand:?}");
    }
    let (mut by_hand, mut others) = (0.0, 0.0);
    for (contact, found) in record.first().contacts.iter().zip(&record.first().solution.contacts) {
        let on_crate = match (contact.key.body, contact.key.partner) {
            (body, partner) if body == crate_ => {
                if partner == Partner::Body(fore) {
                    by_hand += found.force[0];
                    continue;
                }
                found.force[0]
            }
            (body, Partner::Body(other)) if other == crate_ && body == fore => {
                by_hand -= found.force[0];
                continue;
            }
            _ => continue,
        };
        others += on_crate;
    }
    let robot = &scene.robots[0];
    let a = robot.coordinates(simulation.states(), robot.start()).unwrap().0[0];
    let expected = (1.8 * 9.81 * 0.2 * a.cos() + 8.0) / (0.8 * a.sin());
    assert!((by_hand - expected).abs() <= 1e-8, "{by_hand} {expected}");
    assert!((by_hand + others).abs() <= 1e-8, "{by_hand} {others}");
    let speed = simulation.states()[crate_].velocity.norm();
    assert!(speed <= 1e-9, "{speed:e}");
}

/// Checks a robot with four legs that lands among boxes. Every step is certified, and in the end it
/// stands.
#[test]
fn a_crawler_lands_among_boxes() {
    let text = text_of("scenarios/crawler.toml");
    let path = root().join("scenarios/crawler.toml");
    let scene = Scene::from_text(&text, &path, &[], &bytes);
    let scene = scene.unwrap_or_else(|why| panic!("{why}"));
    let mut simulation = simulation(&scene);
    let (mut record, mut iterations) = (StepRecord::new(), 0);
    for step in 0..999 {
        simulation.step(&mut record).unwrap();
        assert!(record.residual() <= 1e-9, "step {step}");
        iterations += record.report().iterations;
    }
    // A proximal point method that stalls on the round feet takes thousands; these are about 200.
    assert!(iterations <= 1000, "{iterations}");
    let weight: f64 = scene.world.bodies().iter().map(|body| body.mass() * 9.81).sum();
    let carried: f64 =
        (0..scene.bodies.len()).map(|body| record.first().solution.total_force(body)[2]).sum();
    assert!((carried - weight).abs() <= 1e-6 * weight, "{carried} {weight}");
    let torso = scene.bodies.iter().position(|body| body == "torso").unwrap();
    let height = simulation.states()[torso].position[2];
    // Above its belly, whose radius is 0.16 m.
    assert!(height > 0.18, "{height}");
}

/// Checks that robots with gears, and driven bodies, move the same after conversion to a scenario.
#[test]
fn gears_and_driven_bodies_are_converted() {
    for file in [
        "tests/robots/gears.xml",
        "scenarios/robots/pusher.urdf",
        "scenarios/pusher.toml",
        "scenarios/tray-and-conveyor.toml",
        "scenarios/turntable.toml",
    ] {
        let path = root().join(file);
        let scene = Scene::from_text(&text_of(file), &path, &[], &bytes);
        let scene = scene.unwrap_or_else(|why| panic!("{file}: {why}"));
        let text = written::text(&scene).unwrap_or_else(|why| panic!("{file}: {why}"));
        let other = scene_of(&text, &[]);
        let other = other.unwrap_or_else(|why| panic!("{file}: {why}\n{text}"));
        assert_eq!(scene.world.gears().len(), other.world.gears().len());
        assert_eq!(scene.courses.len(), other.courses.len(), "{file}");
        let (mut a, mut b) = (simulation(&scene), simulation(&other));
        let (mut record, mut again) = (StepRecord::new(), StepRecord::new());
        for _ in 0..100 {
            a.step(&mut record).unwrap();
            b.step(&mut again).unwrap();
        }
        for (a, b) in a.states().iter().zip(b.states()) {
            assert!((a.position - b.position).norm() <= 1e-9, "{file}: {a:?} {b:?}");
        }
    }
}

/// Checks that a prescribed rotation about a point is converted, for any position of the body.
#[test]
fn prescribed_rotation_about_a_point_is_converted() {
    let text = "[ground]\nnone = true\nfriction = 0.4\n[[bodies]]\nname = \"arm\"\nbox = [1.0, 0.2, 0.1]\n\
                density = 300\nposition = [0.3, 0.2, 0.5]\n[[driven]]\nbody = \"arm\"\n\
                velocity = [0.1, 0, 0]\nspin = [0.3, 0.2, 0.7]\nabout = [0.2, 0.1, 0.1]\n";
    let scene = scene_of(text, &[]).unwrap();
    let other = scene_of(&written::text(&scene).unwrap(), &[]).unwrap();
    let (mut a, mut b) = (simulation(&scene), simulation(&other));
    let mut record = StepRecord::new();
    for _ in 0..100 {
        a.step(&mut record).unwrap();
        b.step(&mut record).unwrap();
    }
    let (a, b) = (a.states()[0], b.states()[0]);
    assert!((a.position - b.position).norm() <= 1e-9, "{a:?} {b:?}");
    assert!((a.position - Vector3::new(0.3, 0.2, 0.5)).norm() > 0.01, "{a:?}");
}

/// Checks mimic joints in any order, also mimics of mimics. All start at consistent coordinates.
#[test]
fn mimics_may_come_in_any_order() {
    let joint = |name: &str, parent: &str, child: &str, more: &str| {
        format!(
            "<joint name='{name}' type='continuous'><parent link='{parent}'/><child link='{child}'/>\
             <axis xyz='0 1 0'/><origin xyz='0.3 0 0'/>{more}</joint>"
        )
    };
    let link = |name: &str| {
        format!(
            "<link name='{name}'><inertial><mass value='1'/><origin xyz='0.1 0 0'/>\
             <inertia ixx='0.01' iyy='0.01' izz='0.01'/></inertial></link>"
        )
    };
    let robot = format!(
        "<robot name='three'><link name='world'/>{}{}{}{}{}{}</robot>",
        link("a"),
        link("b"),
        link("c"),
        joint("ja", "world", "a", "<mimic joint='jb' multiplier='2' offset='0.1'/>"),
        joint("jb", "a", "b", "<mimic joint='jc' multiplier='-0.5'/>"),
        joint("jc", "b", "c", "")
    );
    let read_file = |path: &Path, _: u64| std::fs::read(path);
    let reading = Reading { folder: Path::new(""), read: &read_file, ..Reading::none() };
    assert_eq!(read(&robot, &reading).unwrap().follows.len(), 2);
    let scene = scene_of(&robot, &[]).unwrap();
    assert_eq!(scene.robots[0].start(), [0.1, 0.0, 0.0]);
    let mut simulation = simulation(&scene);
    // Given values of mimic joints are ignored.
    let mut states = simulation.states().to_vec();
    scene.robots[0].set_states(&[9.0, 9.0, -0.4], &[9.0, 9.0, 0.8], &mut states).unwrap();
    let (q, v) = scene.robots[0].coordinates(&states, &[0.5, 0.2, -0.4]).unwrap();
    for (found, expected) in q.iter().chain(&v).zip([0.5, 0.2, -0.4, -0.8, -0.4, 0.8]) {
        assert!((found - expected).abs() <= 1e-12, "{q:?} {v:?}");
    }
    simulation.set_states(&states).unwrap();
    let mut record = StepRecord::new();
    for _ in 0..300 {
        simulation.step(&mut record).unwrap();
        assert!(record.residual() <= 1e-9);
        assert!(off(&simulation, &record) <= 1e-12);
    }

    for (from, to, part) in [
        ("mimic joint='jc'", "mimic joint='jd'", "\"jd\" is not a joint"),
        ("multiplier='2'", "multiplier='1e9'", "multiplier"),
        ("mimic joint='jb'", "mimic joint='ja'", "itself"),
        ("<axis xyz='0 1 0'/><origin xyz='0.3 0 0'/></joint>", "</joint>", "three"),
    ] {
        let why = scene_of(&robot.replacen(from, to, 1), &[]).err();
        if part == "three" {
            assert_eq!(why, None);
        } else {
            let why = why.unwrap_or_default();
            assert!(why.contains(part) && !why.contains('\n'), "{part}: {why}");
        }
    }
    let limited = robot.replace(
        "<axis xyz='0 1 0'/><origin xyz='0.3 0 0'/><mimic joint='jb'",
        "<axis xyz='0 1 0'/><limit lower='0.2' upper='1'/><mimic joint='jb'",
    );
    let limited = limited.replacen("type='continuous'", "type='revolute'", 1);
    let why = scene_of(&limited, &[]).err().unwrap_or_default();
    assert!(why.contains("<mimic>") && why.contains("outside its range"), "{why}");
}

/// Checks that unsupported couplings are refused with their line.
#[test]
fn couplings_beyond_a_ratio_are_refused() {
    let text = text_of("tests/robots/gears.xml");
    for (from, to, part) in [
        ("0.3 -1.5 0 0 0", "0.3 -1.5 0.1 0 0", "last three numbers must be 0"),
        ("0.3 -1.5 0 0 0", "0.3 -1.5 0 0 0 0", "up to 5 numbers"),
        ("0.3 -1.5 0 0 0", "0.3 nan", "polycoef"),
        ("0.3 -1.5 0 0 0", "1e9 1", "polycoef"),
        ("joint2=\"shoulder\"", "joint2=\"knee\"", "there is no joint \"knee\""),
        ("joint2=\"shoulder\"", "joint2=\"elbow\"", "itself"),
    ] {
        let why = scene_of(&text.replacen(from, to, 1), &[]).err();
        let why = why.unwrap_or_default();
        assert!(why.contains(part) && !why.contains('\n'), "{part}: {why:?}");
    }
    let free = "<mujoco><worldbody><body><joint name='a'/><geom size='0.1'/></body>\
                <body><joint name='b' type='ball'/><geom size='0.1'/></body></worldbody>\n\
                <equality><joint joint1='a' joint2='b'/></equality></mujoco>";
    let why = scene_of(free, &[]).err().unwrap_or_default();
    assert!(why.contains("line 2") && why.contains("a hinge or a slide is needed"), "{why}");
    // An inactive coupling, or one without a second joint, adds no gear.
    let off = text.replacen("<joint joint1=", "<joint active=\"false\" joint1=", 1);
    assert_eq!(scene_of(&off, &[]).unwrap().world.gears().len(), 1);
    let held = text.replacen(" joint2=\"shoulder\"", "", 1);
    let scene = scene_of(&held, &[]).unwrap();
    assert_eq!(scene.world.gears().len(), 1);
}
