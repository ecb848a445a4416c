//! Features of published MuJoCo files: geom pairs, several planes, gravity compensation, springs by
//! time constants, invalid names and invalid starts.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use tumble_core::mechanics::State;
use tumble_core::simulation::{Simulation, StepRecord};
use tumble_scene::scene::Scene;

fn read(path: &str, text: &str, arena: &str) -> Result<Scene, String> {
    let files = |_: &Path, _: u64| Ok(arena.as_bytes().to_vec());
    let scene = Scene::from_text(text, Path::new(path), &[], &files);
    scene.map_err(|failure| failure.to_string())
}

fn tried(inside: &str) -> Result<Scene, String> {
    read("robot.xml", &format!("<mujoco>{inside}</mujoco>"), "")
}

fn scene(inside: &str) -> Scene {
    tried(inside).unwrap_or_else(|why| panic!("{why}"))
}

fn refused(tried: Result<Scene, String>) -> String {
    tried.err().unwrap_or_else(|| panic!("it is read"))
}

fn begun(scene: &Scene) -> Simulation<'static> {
    scene.simulation(&Arc::new(AtomicBool::new(false))).unwrap()
}

fn steps(simulation: &mut Simulation<'_>, count: usize) {
    let mut record = StepRecord::new();
    for step in 0..count {
        simulation.step(&mut record).unwrap();
        let residual = record.residual();
        assert!(residual <= 1e-9, "{step}: {residual:e}");
    }
}

fn said(scene: &Scene, words: &str) -> bool {
    scene.notes().iter().any(|note| note.contains(words))
}

/// Checks that a pair has its own friction, regardless of groups. A geom without a pair has no
/// contacts.
#[test]
fn a_pair_touches_with_its_own_friction() {
    let scene = scene(
        r#"<option timestep="0.001"/><worldbody>
        <geom name="floor" type="plane" size="1 1 1" contype="0" conaffinity="0" friction="0.9"/>
        <body name="sled" pos="0 0 0.1"><freejoint/>
          <geom name="sole" type="box" size="0.1 0.1 0.1" contype="0" conaffinity="0"/>
          <geom type="box" size="0.05 0.05 0.3" contype="0" conaffinity="0" mass="0"/></body>
        </worldbody><contact><pair geom1="sole" geom2="floor" friction="0.25 0.25"/></contact>"#,
    );
    let mut simulation = begun(&scene);
    let mut state = simulation.states()[0];
    state.velocity[0] = 1.0;
    simulation.set_states(&[state]).unwrap();
    steps(&mut simulation, 100);
    let state = simulation.states()[0];
    // It slides on its sole: v − μ g t.
    assert!((state.velocity[0] - (1.0 - 0.25 * 9.81 * 0.1)).abs() < 1e-9, "{}", state.velocity[0]);
    assert!((state.position[2] - 0.1).abs() < 1e-9, "{}", state.position[2]);
}

/// Checks that a pair overrides both the joint between the bodies and an exclusion.
#[test]
fn a_pair_counts_before_neighbours_and_exclusions() {
    let fallen = |pair: &str| {
        let scene = scene(&format!(
            r#"<worldbody><body name="base"><freejoint/><geom name="wall" type="box" size="0.1 0.1 0.5"/>
            <body name="flap" pos="0.1 0 0.5"><joint axis="0 1 0"/><geom name="edge" type="capsule" size="0.02"
             fromto="0.1 0 0.1 0.4 0 0.1"/></body></body></worldbody>
            <contact><exclude body1="base" body2="flap"/>{pair}</contact>"#
        ));
        let mut simulation = begun(&scene);
        let (low, high) = (
            State { position: [0.0, 0.0, 50.0].into(), ..simulation.states()[0] },
            simulation.states()[1],
        );
        let high = State { position: high.position + low.position, ..high };
        let mut states = vec![low, high];
        states[1].spin[1] = 30.0;
        // The flap rotates about its hinge, and its centre moves accordingly.
        let arm = states[1].position - nalgebra::Vector3::new(0.1, 0.0, 50.5);
        states[1].velocity = states[1].spin.cross(&arm);
        simulation.set_states(&states).unwrap();
        let mut record = StepRecord::new();
        let mut touched = false;
        for _ in 0..100 {
            simulation.step(&mut record).unwrap();
            touched |=
                record.first().contacts.iter().any(|contact| contact.key.partner.body().is_some());
        }
        touched
    };
    assert!(!fallen(""));
    assert!(fallen(r#"<pair geom1="edge" geom2="wall"/>"#));
}

#[test]
fn invalid_contact_pairs_are_rejected() {
    let tried = |pair: &str| {
        refused(tried(&format!(
            r#"<worldbody><geom name="floor" type="plane" size="1 1 1"/><body><freejoint/>
            <geom name="a" size="0.1"/><geom name="b" size="0.1"/></body></worldbody><contact>{pair}</contact>"#
        )))
    };
    for (pair, words) in [
        (r#"<pair geom1="a" geom2="c"/>"#, "there is no geom \"c\""),
        (r#"<pair geom1="a" geom2="b"/>"#, "two bodies are needed"),
        (r#"<pair geom1="a" geom2="floor" friction="1 0.5"/>"#, "use equal ones"),
        (r#"<pair geom1="a" geom2="floor" condim="5"/>"#, "1, 3, 4 or 6 is needed"),
        (r#"<pair geom1="a" geom2="floor" friction="1 1 0 0.1 0.2"/>"#, "use equal ones"),
        (r#"<pair geom1="a"/>"#, "geom2"),
    ] {
        let why = tried(pair);
        assert!(why.contains(words) && why.contains("line 2, <pair>"), "{pair}: {why}");
    }
}

/// Checks that the first plane is the ground and the others are walls.
#[test]
fn planes_after_the_first_are_walls() {
    let scene = scene(
        r#"<worldbody><geom type="plane" size="1 1 1"/><geom type="plane" size="1 1 1" pos="0.5 0 0" zaxis="-1 0 0"/>
        <body pos="0 0 0.1"><freejoint/><geom size="0.1" friction="0"/></body></worldbody>"#,
    );
    assert!(said(&scene, "planes after the first"));
    let mut simulation = begun(&scene);
    let mut state = simulation.states()[0];
    state.velocity[0] = 2.0;
    simulation.set_states(&[state]).unwrap();
    steps(&mut simulation, 500);
    let state = simulation.states()[0];
    assert!((state.position[0] - 0.4).abs() < 1e-6, "{}", state.position[0]);
}

const ARM: &str = r#"<option gravity="0 0 -10" timestep="0.000001"/><worldbody>
    <body name="upper" pos="0 0 1"><joint name="shoulder" axis="0 1 0" springdamper="0.2 0.8" armature="0.01"/>
     <inertial pos="0 0 -0.2" mass="2" diaginertia="0.03 0.02 0.01"/>
     <body name="lower" pos="0 0 -0.5" gravcomp="0.5"><joint name="elbow" axis="0 1 0"/>
      <inertial pos="0.1 0 -0.1" mass="1" diaginertia="0.01 0.01 0.01"/>
      <body name="tip" pos="0 0 -0.3" gravcomp="1"><inertial pos="0 0 -0.1" mass="0.5" diaginertia="0.001 0.001 0.001"/></body>
     </body></body></worldbody>
    <actuator><position name="p" joint="elbow" kp="40" dampratio="0.7" gear="2"/></actuator>"#;

/// Checks springs and dampers given by time constants and damping ratios. The reference is MuJoCo
/// 4.0.0 for the same file, to all its digits.
#[test]
fn springs_by_time_constants_are_those_of_mujoco() {
    let scene = scene(ARM);
    let robot = scene.robots[0].robot();
    let near =
        |ours: f64, theirs: f64| assert!((ours / theirs - 1.0).abs() < 1e-12, "{ours} {theirs}");
    near(robot.joints[0].stiffness, 11.027238175675688);
    near(robot.joints[0].damping, 2.822972972972977);
    near(robot.actuators[0].bias[2], -0.8279209654308803);
}

/// Checks gravity compensation. The first accelerations agree with MuJoCo 4.0.0, to the order of
/// the step.
#[test]
fn weights_are_held_up_as_mujoco_has_it() {
    let scene = scene(ARM);
    let mut simulation = begun(&scene);
    steps(&mut simulation, 1);
    let robot = &scene.robots[0];
    let (_, rates) = robot.coordinates(simulation.states(), robot.start()).unwrap();
    for (rate, acceleration) in rates.iter().zip([-2.3934897079942514, 10.132439763842338]) {
        let ours = rate / scene.world.time_step();
        assert!((ours / acceleration - 1.0).abs() < 3e-4, "{ours} {acceleration}");
    }
}

/// Checks that invalid names are replaced, and that two names with the same replacement are
/// refused.
#[test]
fn names_of_a_scene_are_made() {
    let long = "a_body_with_a_name_that_is_longer_than_forty_letters";
    let file = |first: &str, second: &str| {
        format!(
            r#"<worldbody><body name="{first}" pos="0 0 1"><joint name="j 1"/><geom size="0.1"/></body>
            <body name="{second}" pos="1 0 1"><joint name="j2"/><geom size="0.1"/></body></worldbody>"#
        )
    };
    let made = scene(&file("robot0:base link", long));
    assert_eq!(made.bodies[0], "robot0_base_link");
    assert_eq!(made.bodies[1].len(), 40);
    assert_eq!(made.joints[0], "j_1");
    assert!(
        said(
            &made,
            "3 names that a scene does not allow are changed, for example \"robot0:base link\" to \
             \"robot0_base_link\""
        ),
        "{:?}",
        made.notes()
    );
    assert!(made.robots[0].robot().link("robot0:base link").is_some());
    let why = refused(tried(&file("a:b", "a b")));
    assert!(why.contains("the body name \"a_b\" is already used"), "{why}");
}

/// Checks three perpendicular slides, in both orientations. Coordinates are read back, and springs
/// hold the weight.
#[test]
fn three_slides_make_one_joint() {
    for axes in
        [["1 0 0", "0 1 0", "0 0 1"], ["0 1 0", "1 0 0", "0 0 1"], ["0 0 1", "0 1 0", "-1 0 0"]]
    {
        let slides: Vec<_> = axes
            .iter()
            .map(|axis| {
                format!(r#"<joint type="slide" axis="{axis}" stiffness="100" damping="40"/>"#)
            })
            .collect();
        let scene = scene(&format!(
            r#"<worldbody><body pos="0.3 0.2 1" euler="20 30 40">{}<geom size="0.1" mass="1"/></body></worldbody>"#,
            slides.concat()
        ));
        let mut simulation = begun(&scene);
        let robot = &scene.robots[0];
        let mut states = simulation.states().to_vec();
        robot.set_states(&[0.1, -0.2, 0.3], &[0.4, 0.5, -0.6], &mut states).unwrap();
        let (q, v) = robot.coordinates(&states, robot.start()).unwrap();
        for (found, given) in q.iter().chain(&v).zip([0.1, -0.2, 0.3, 0.4, 0.5, -0.6]) {
            assert!((found - given).abs() < 1e-14, "{found} {given}");
        }
        simulation.set_states(&states).unwrap();
        steps(&mut simulation, 5000);
        let state = simulation.states()[0];
        // The springs stretch by m g/k.
        for (found, given) in state.position.iter().zip([0.3, 0.2, 1.0 - 9.81 / 100.0]) {
            assert!((found - given).abs() < 1e-9, "{axes:?}: {found} {given}");
        }
    }
}

/// Checks starts inside the ground or a fixed shape. A free body is lifted out. A jointed body does
/// not collide with the ground that it starts in.
#[test]
fn starts_that_are_too_deep_are_lifted() {
    let made = scene(
        r#"<worldbody><geom type="plane" size="1 1 1"/><geom name="table" type="box" size="1 1 0.2" pos="3 0 0.2"/>
        <body name="ball" pos="0 0 0.05"><freejoint/><geom size="0.1"/></body>
        <body name="cube" pos="3 0 0.42"><freejoint/><geom type="box" size="0.1 0.1 0.1"/></body>
        <body name="bob" pos="-2 0 0.3"><joint axis="0 1 0"/><geom size="0.1" pos="0 0 -0.3"/></body></worldbody>"#,
    );
    for words in [
        "ball was lifted 5.000e-2 m out of the ground",
        "cube was lifted 8.000e-2 m out of a fixed piece",
    ] {
        assert!(said(&made, words), "{:?}", made.notes());
    }
    assert!(said(&made, "have no contact with it: bob"), "{:?}", made.notes());
    assert!((made.starts[0].position[2] - 0.1).abs() < 1e-15);
    assert!((made.starts[1].position[2] - 0.5).abs() < 1e-12);
    // The coordinates are changed too.
    assert_eq!(made.robots[0].start()[2], made.starts[0].position[2]);
    let mut simulation = begun(&made);
    steps(&mut simulation, 300);
    assert!((simulation.states()[0].position[2] - 0.1).abs() < 1e-9);
    assert!((simulation.states()[1].position[2] - 0.5).abs() < 1e-9);
}

/// Checks equality constraints that do not hold at the start. A constraint to a mocap body is moved
/// to fit. Other bodies are assembled.
#[test]
fn violated_equality_constraints_are_assembled() {
    let arm = |tie: &str, more: &str| {
        format!(
            r#"<worldbody><body name="a" pos="0 0 2"><joint name="ja" axis="0 1 0" range="20 90"/>
            <geom type="capsule" size="0.05" fromto="0 0 0 0 0 -1" contype="0" conaffinity="0"/>
            <body name="b" pos="0 0 -1"><joint axis="0 1 0"/>
            <geom type="capsule" size="0.05" fromto="0 0 0 0 0 -1" contype="0" conaffinity="0"/></body></body>{more}</worldbody>
            <equality>{tie}</equality>"#
        )
    };
    // The joint range moves the arm away from its constraint.
    let mocap = r#"<body name="hand" mocap="true" pos="0 0 0"/>"#;
    let made = scene(&arm(r#"<weld body1="hand" body2="b"/>"#, mocap));
    assert!(said(&made, "it keeps the initial pose"), "{:?}", made.notes());
    assert!((made.robots[0].start()[0] - 20_f64.to_radians()).abs() < 1e-12);
    steps(&mut begun(&made), 10);
    // The end of the arm starts far from its constraint and is assembled, by more than a step may
    // turn it.
    let bent = arm(r#"<connect body1="b" anchor="0 0 -1"/>"#, "")
        .replace(r#"range="20 90""#, "")
        .replace(r#"pos="0 0 -1""#, r#"pos="0 0 -1" euler="0 90 0""#);
    let bent = format!("<mujoco>{bent}</mujoco>");
    for ja in [1.0, -2.0, 2.5] {
        let text = format!(
            "gravity = 9.81\n[ground]\nnone = true\nfriction = 0.5\n[[robots]]\nfile = \"arm.xml\"\ncoordinates = {{ ja = {ja:?} }}\n"
        );
        let made = read("scene.toml", &text, &bent).unwrap_or_else(|why| panic!("{why}"));
        assert!(said(&made, "its loops do not close in the initial pose"), "{:?}", made.notes());
        let tie = made.joints.iter().position(|name| name == "tie-0").unwrap();
        let (place, _) = made.world.joints()[tie].error(&made.starts).unwrap();
        assert!(place < 1e-11, "{place:e}");
        let robot = &made.robots[0];
        let (q, _) = robot.coordinates(&made.starts, robot.start()).unwrap();
        for (found, told) in q.iter().zip(robot.start()) {
            assert!((found - told).abs() < 1e-14, "{found} {told}");
        }
        steps(&mut begun(&made), 10);
    }
    // If no assembly exists, the error names the constraint and a remedy.
    let far = arm(
        r#"<connect body1="b" body2="c" anchor="0 0 -1"/>"#,
        r#"<body name="c" pos="9 0 0"><joint range="50 60"/><geom size="0.1" pos="1 0 0"/></body>"#,
    );
    let why = refused(tried(&far));
    assert!(why.contains("tie-0 is") && why.contains("move its bodies, or remove it"), "{why}");
}

/// Checks that hulls of thousands of points are computed in time and reduced to the allowed
/// corners. Many points with few corners lose nothing.
#[test]
fn hulls_of_many_points_are_made() {
    let ball: String = (0..6000)
        .map(|k| {
            let (height, turn) =
                (2.0 * (f64::from(k) + 0.5) / 6000.0 - 1.0, 2.399_963 * f64::from(k));
            let (s, c) = turn.sin_cos();
            let across = (1.0 - height * height).sqrt();
            format!("{} {} {} ", across * c, across * s, height)
        })
        .collect();
    let cube: String =
        (0..4000).map(|k| format!("{} {} {} ", k / 400 % 10, k / 20 % 20, k % 20)).collect();
    let mesh = |vertices: &str| {
        scene(&format!(
            r#"<asset><mesh name="m" vertex="{vertices}"/></asset><worldbody><body pos="0 0 50"><freejoint/>
            <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/><geom type="mesh" mesh="m"/></body></worldbody>"#
        ))
    };
    let corners = |scene: &Scene| scene.world.bodies()[0].pieces()[0].core().vertices().len();
    let count = corners(&mesh(&ball));
    assert!((100..=200).contains(&count), "{count}");
    assert_eq!(corners(&mesh(&cube)), 8);
}

/// Checks a file without moving bodies. Alone it is refused. In a scenario it is part of the scene.
#[test]
fn an_arena_stands_among_other_things() {
    let arena = r#"<mujoco><worldbody><body name="table" pos="0 0 0.5"><geom type="box" size="1 1 0.5"/></body></worldbody></mujoco>"#;
    let why = refused(read("arena.xml", arena, ""));
    assert!(why.contains("nothing in it can move") && why.contains("[[robots]]"), "{why}");
    let text = "steps = 10\ntime_step = 0.002\ngravity = 9.81\n[ground]\nfriction = 0.5\n[[robots]]\nfile = \"arena.xml\"\n[[bodies]]\nname = \"ball\"\nsphere = 0.1\nmass = 1.0\nposition = [0.0, 0.0, 1.1]\n";
    let made = read("scene.toml", text, arena).unwrap_or_else(|why| panic!("{why}"));
    let mut simulation = begun(&made);
    steps(&mut simulation, 200);
    assert!((simulation.states()[0].position[2] - 1.1).abs() < 1e-9);
}
