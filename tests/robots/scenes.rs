//! Robots in scenes: contact forces, fixed robots, and errors of wrong files.

use nalgebra::Vector3;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use tumble_core::joint::{JointAxis, Motor};
use tumble_core::mechanics::{Load, Polyline};
use tumble_core::simulation::{Simulation, StepRecord};
use tumble_core::step::StepStatus;
use tumble_robot::{Reading, read};
use tumble_scene::Assembled;
use tumble_scene::scene::Scene;
use tumble_scene::written;

fn data() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/data/robots"))
}

fn bytes(path: &Path, _: u64) -> std::io::Result<Vec<u8>> {
    std::fs::read(path)
}

/// Scene of a text, as a file next to the robots of `data`.
fn scene_of(text: &str, name: &str) -> Result<Scene, String> {
    let scene = Scene::from_text(text, &data().join(name), &[], &bytes);
    scene.map_err(|failure| failure.to_string())
}

fn scene_in(name: &str) -> Scene {
    scene_of(&std::fs::read_to_string(data().join(name)).unwrap(), name).unwrap()
}

fn simulation(scene: &Scene) -> Simulation<'static> {
    scene.simulation(&Arc::new(AtomicBool::new(false))).unwrap()
}

/// Largest joint error [m, rad].
fn joint_error(simulation: &Simulation<'_>) -> f64 {
    let joints = simulation.world().joints().iter();
    let errors = joints.map(|joint| joint.error(simulation.states()).unwrap());
    errors.fold(0.0, |most, (place, turn)| most.max(place).max(turn))
}

/// Sets a position motor on a joint.
fn hold(simulation: &mut Simulation<'_>, robot: &Assembled, joint: &str, target: f64) {
    let index = robot.robot().joint(joint).unwrap();
    let (joint, axis) = robot.axis(index).unwrap();
    assert_eq!(axis, 5, "a hinge");
    let motor = Motor::Position { target, stiffness: 80.0, damping: 3.0, max_force: 25.0 };
    simulation.set_motor(joint, JointAxis::Angular(2), Some(motor)).unwrap();
}

/// Checks a quadruped that falls on bent legs, stands and is pushed. It sways, and then stands
/// without creeping. Its feet carry its weight.
#[test]
fn a_quadruped_lands_and_stands() {
    let legs = ["fl", "fr", "rl", "rr"];
    let bent: Vec<_> = legs
        .iter()
        .flat_map(|leg| [format!("{leg}_pitch = 0.8"), format!("{leg}_knee = -1.6")])
        .collect();
    let text = format!(
        "time_step = 0.002\n[ground]\nfriction = 0.7\n[[robots]]\nfile = \"quadruped.urdf\"\n\
         position = [0.0, 0.0, 0.45]\ncoordinates = {{ {} }}\n",
        bent.join(", ")
    );
    let scene = scene_of(&text, "standing.toml").unwrap();
    let robot = &scene.robots[0];
    let mut simulation = simulation(&scene);
    for leg in legs {
        hold(&mut simulation, robot, &format!("{leg}_roll"), 0.0);
        hold(&mut simulation, robot, &format!("{leg}_pitch"), 0.8);
        hold(&mut simulation, robot, &format!("{leg}_knee"), -1.6);
    }
    let mut record = StepRecord::new();
    let weight: f64 =
        simulation.world().bodies().iter().map(|body| body.mass()).sum::<f64>() * 9.81;
    // It lands first. Then a force pushes its trunk for 0.2 s [N].
    for push in [0.0, 40.0] {
        let begin = simulation.states()[0].position;
        let (mut still, mut sway) = (None, 0.0_f64);
        for step in 0..2500 {
            if push > 0.0 && (step == 0 || step == 100) {
                let push = if step == 0 { push } else { 0.0 };
                let force = Polyline::constant(Vector3::new(0.0, push, 0.0)).unwrap();
                let load = Load::new(force, Polyline::default(), Vector3::zeros()).unwrap();
                simulation.set_load(0, load).unwrap();
            }
            simulation.step(&mut record).unwrap();
            assert!(record.status() != StepStatus::Failed, "step {step}");
            let (residual, off) = (record.residual(), joint_error(&simulation));
            assert!(residual <= 1e-9 && off <= 1e-12, "step {step}: {residual:e} {off:e}");
            sway = sway.max((simulation.states()[0].position - begin).norm());
            if step == 2000 {
                still = Some(simulation.states().to_vec());
            }
        }
        assert!(sway > 5e-3, "{push}: {sway}");
        let carried: f64 = (0..simulation.states().len())
            .map(|body| record.first().solution.total_force(body)[2])
            .sum();
        assert!((carried - weight).abs() <= 1e-9 * weight, "{push}: {carried} {weight}");
        // No creep: nothing has moved in the last second.
        for (now, then) in simulation.states().iter().zip(still.unwrap()) {
            assert!((now.position - then.position).norm() <= 1e-9, "{push}: {now:?} {then:?}");
        }
    }
    assert!((0.2..0.4).contains(&simulation.states()[0].position[2]));
    // The coordinates are the targets of the motors, except for the effect of the weight.
    let (q, v) = robot.coordinates(simulation.states(), robot.start()).unwrap();
    assert!(v.iter().all(|rate| rate.abs() < 1e-8), "{v:?}");
    let knee = robot.robot().places()[robot.robot().joint("fl_knee").unwrap()].0;
    assert!((q[knee] + 1.6).abs() < 0.2, "{}", q[knee]);
}

/// Checks the conversion between coordinates and states, for any placement of the robot.
#[test]
fn coordinates_and_states_round_trip() {
    for (file, place) in [
        (
            "quadruped.urdf",
            "position = [0.3, -0.2, 1.0]\nattitude = { axis = [0.2, 1, 0.4], degrees = 70 }",
        ),
        ("arm.urdf", "position = [0.0, 0.0, 1.0]"),
        ("hopper.xml", "position = [1.0, 0.0, 0.5]"),
        ("classes.xml", "position = [1.0, 0.0, 2.5]"),
    ] {
        let text = format!("[ground]\nfriction = 0.7\n[[robots]]\nfile = \"{file}\"\n{place}\n");
        let scene = scene_of(&text, "placed.toml").unwrap();
        let robot = &scene.robots[0];
        let (positions, rates) = robot.robot().counts();
        let mut q = robot.robot().reference();
        for (joint, (place, _)) in robot.robot().joints.iter().zip(robot.robot().places()) {
            let width = joint.moves.counts().0;
            for (k, number) in q[place..place + width].iter_mut().enumerate() {
                *number += 0.1 * (k + 1) as f64;
            }
            if width > 1 {
                let attitude = &mut q[place + width - 4..place + width];
                let norm = attitude.iter().map(|x| x * x).sum::<f64>().sqrt();
                attitude.iter_mut().for_each(|x| *x /= norm);
            }
        }
        let v: Vec<_> = (0..rates).map(|k| (k as f64 * 0.7).sin()).collect();
        let mut states = scene.starts.clone();
        robot.set_states(&q, &v, &mut states).unwrap();
        let (back, speeds) = robot.coordinates(&states, robot.start()).unwrap();
        assert_eq!(back.len(), positions);
        for (a, b) in back.iter().zip(&q).chain(speeds.iter().zip(&v)) {
            assert!((a - b).abs() <= 1e-12, "{file}: {back:?} {q:?} {speeds:?} {v:?}");
        }
        // Locked axes hold there.
        for joint in scene.world.joints() {
            let (place, turn) = joint.error(&states).unwrap();
            assert!(place.max(turn) <= 1e-12, "{file}: {place:e} {turn:e}");
        }
    }
}

/// Checks that a scene written as text moves like the original.
#[test]
fn a_converted_robot_moves_alike() {
    for file in ["quadruped.urdf", "arm.urdf", "hopper.xml", "classes.xml"] {
        let scene = scene_in(file);
        let text = written::text(&scene).unwrap();
        let other = scene_of(&text, "converted.toml").unwrap_or_else(|why| panic!("{file}: {why}"));
        let (mut a, mut b) = (simulation(&scene), simulation(&other));
        let mut record = StepRecord::new();
        for _ in 0..20 {
            a.step(&mut record).unwrap();
            b.step(&mut record).unwrap();
        }
        for (a, b) in a.states().iter().zip(b.states()) {
            assert!((a.position - b.position).norm() <= 1e-10, "{file}: {a:?} {b:?}");
        }
    }
}

/// Checks two robots from the same file among other bodies, with different name prefixes.
#[test]
fn robots_stand_among_other_things() {
    let text = r#"
        [ground]
        friction = 0.5
        [[bodies]]
        name = "crate"
        box = 0.3
        density = 300
        position = [2.0, 0.0, 0.15]
        [[robots]]
        file = "quadruped.urdf"
        prefix = "one."
        position = [0.0, 0.0, 0.6]
        [[robots]]
        file = "quadruped.urdf"
        prefix = "two."
        position = [0.0, 1.0, 0.6]
        attitude = { axis = [0, 0, 1], degrees = 90 }
        [[motors]]
        joint = "two.fl_knee"
        position = -1.5
        stiffness = 50
        max_force = 20
        [[friction]]
        between = ["one.fl_shank", "crate"]
        coefficient = 0.1
        [[apart]]
        between = ["two.trunk", "crate"]
    "#;
    let scene = scene_of(text, "two.toml").unwrap();
    assert_eq!(scene.bodies.len(), 1 + 2 * 13);
    assert_eq!(scene.joints.len(), 2 * 12);
    assert!(scene.bodies.contains(&"two.rr_shank".to_owned()));
    let mut simulation = simulation(&scene);
    let mut record = StepRecord::new();
    // The knee turns fast at first. A step of 2 ms that makes energy is replaced by shorter ones.
    let mut shorter = 0;
    for _ in 0..20 {
        simulation.step(&mut record).unwrap();
        match record.status() {
            StepStatus::Substepped => shorter += 1,
            status => assert!(record.residual() <= 1e-9, "{status}"),
        }
    }
    assert!(shorter <= 4, "{shorter}");
}

/// Checks that errors are one sentence with the line and the element.
#[test]
fn wrong_files_are_refused_by_line() {
    let cases = [
        ("<robot name='a'><link name='b'></robot>", "line 1"),
        ("<robot name='a'>\n<link name='b'/>\n<link name='b'/></robot>", "line 3, <link> \"b\""),
        (
            "<robot>\n<link name='a'/><link name='b'/>\n<joint name='j' type='revolute'><parent link='a'/><child link='b'/></joint></robot>",
            "line 3, <joint> \"j\": <limit> is needed",
        ),
        (
            "<robot xmlns:xacro='http://ros.org/xacro'>\n<xacro:property name='x' value='1'/></robot>",
            "Xacro",
        ),
        ("<mujoco><worldbody><body><geom size='-1'/></body></worldbody></mujoco>", "<geom>: size"),
        (
            "<mujoco><worldbody><body>\n<geom size='1' colour='red'/></body></worldbody></mujoco>",
            "line 2, <geom>: colour",
        ),
        (
            "<mujoco><worldbody><body name='b'><joint name='j' type='ball' range='0 1' limited='true'/><geom size='1'/></body></worldbody></mujoco>",
            "a ball with",
        ),
        (
            "<mujoco><worldbody><body><freejoint/><geom size='1'/></body></worldbody>\n<tendon><spatial range='0 1'/></tendon></mujoco>",
            "line 2, <spatial>",
        ),
        ("<sdf version='1.6'/>", "nothing in it can move"),
        ("", "line 1: it is not XML"),
        ("[body]\nmass = 1", "line 1: it is not XML"),
    ];
    for (text, part) in cases {
        let why = scene_of(text, "wrong.xml").err().unwrap_or_default();
        assert!(why.contains(part), "{text}: {why:?}");
        assert!(!why.contains('\n'), "{why}");
    }
}

/// Checks files with random characters changed, removed or duplicated. They result in a robot or in
/// an error.
#[test]
fn spoilt_files_never_panic() {
    let mut seed = 1_u64;
    let mut draw = |below: usize| {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 33) as usize % below.max(1)
    };
    let (mut read_all, mut refused) = (0, 0);
    let names = [
        "quadruped.urdf",
        "arm.urdf",
        "../../scenarios/robots/pusher.urdf",
        "hopper.xml",
        "classes.xml",
        "../../tests/robots/gears.xml",
    ];
    for name in names {
        let text = std::fs::read_to_string(data().join(name)).unwrap();
        for _ in 0..150 {
            let mut spoilt: Vec<char> = text.chars().collect();
            for _ in 0..1 + draw(3) {
                let at = draw(spoilt.len());
                match draw(4) {
                    0 => {
                        let letters: Vec<_> = "<>/\"= -.0e9ainfx{}".chars().collect();
                        spoilt[at] = letters[draw(letters.len())];
                    }
                    1 => {
                        let end = (at + 1 + draw(60)).min(spoilt.len());
                        spoilt.drain(at..end);
                    }
                    2 => {
                        let piece: Vec<_> = spoilt[at..(at + 80).min(spoilt.len())].to_vec();
                        let to = draw(spoilt.len());
                        spoilt.splice(to..to, piece);
                    }
                    _ => {
                        // Replaces a digit by another number.
                        let digits = (at..spoilt.len()).find(|k| spoilt[*k].is_ascii_digit());
                        let numbers = ["1e300", "-5", "0", "nan", "1e-300", "99999999999999999999"];
                        if let Some(digit) = digits {
                            let number: Vec<_> = numbers[draw(numbers.len())].chars().collect();
                            spoilt.splice(digit..=digit, number);
                        }
                    }
                }
            }
            let spoilt: String = spoilt.into_iter().collect();
            match scene_of(&spoilt, name) {
                Ok(_) => read_all += 1,
                Err(why) => {
                    assert!(!why.contains('\n') && !why.is_empty(), "{why:?}");
                    refused += 1;
                }
            }
        }
    }
    assert!(read_all > 30 && refused > 200, "{read_all} {refused}");
}

/// Checks that nesting has a limit and that a file cannot include itself.
#[test]
fn mjcf_nesting_depth_and_recursive_includes_are_refused() {
    let deep = format!(
        "<mujoco><worldbody>{}{}</worldbody></mujoco>",
        "<body>".repeat(5000),
        "</body>".repeat(5000)
    );
    assert!(read(&deep, &Reading::none()).unwrap_err().contains("deep"));
    let looping = |_: &Path, _: u64| Ok(b"<mujoco><include file='again.xml'/></mujoco>".to_vec());
    let reading = Reading { read: &looping, ..Reading::none() };
    let why = read("<mujoco><include file='again.xml'/></mujoco>", &reading).unwrap_err();
    assert!(why.contains("already included"), "{why}");
}
