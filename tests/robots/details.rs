//! Single features of robot files, each checked by its effect on the motion.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use tumble_core::simulation::{Simulation, StepRecord};
use tumble_core::world::{Integrator, Partner};
use tumble_scene::Assembled;
use tumble_scene::scene::Scene;

fn data() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/data/robots"))
}

fn scene_with(text: &str, file: &str) -> Result<Scene, String> {
    let read = |path: &Path, _: u64| {
        if path.file_name().is_some_and(|name| name == "given.file") {
            Ok(file.as_bytes().to_vec())
        } else {
            std::fs::read(path)
        }
    };
    let scene = Scene::from_text(text, &data().join("scene.toml"), &[], &read);
    scene.map_err(|failure| failure.to_string())
}

fn scene_of(text: &str) -> Scene {
    scene_with(text, "").unwrap_or_else(|why| panic!("{why}"))
}

fn after(scene: &Scene, steps: usize) -> Simulation<'static> {
    let mut simulation = scene.simulation(&Arc::new(AtomicBool::new(false))).unwrap();
    let mut record = StepRecord::new();
    for step in 0..steps {
        simulation.step(&mut record).unwrap();
        assert!(record.residual() <= 1e-9, "{step}: {:e}", record.residual());
    }
    simulation
}

fn coordinates(robot: &Assembled, simulation: &Simulation<'_>) -> Vec<f64> {
    robot.coordinates(simulation.states(), robot.start()).unwrap().0
}

const H: f64 = 0.002;

fn world(bodies: &str, rest: &str) -> String {
    format!(
        "<mujoco><option timestep='{H}'/><worldbody><geom type='plane' size='1 1 1' friction='0.1'/>{bodies}</worldbody>{rest}</mujoco>"
    )
}

/// Plate on a vertical hinge, where gravity has no effect: I = 1/12 m (a² + b²).
const TURNTABLE: &str = "<body pos='0 0 1'><joint name='turn' axis='0 0 1' JOINT/>\
    <geom type='box' size='0.3 0.2 0.05' mass='6'/></body>";
const INERTIA: f64 = 6.0 / 3.0 * (0.09 + 0.04);

fn turned(joint: &str, rest: &str) -> f64 {
    let mut scene = scene_of(&world(&TURNTABLE.replace("JOINT", joint), rest));
    scene.use_integrator(Integrator::Euler);
    coordinates(&scene.robots[0], &after(&scene, 1))[0]
}

/// Checks the forces of actuators. An implicit step moves by h² f/I with the force at its end.
#[test]
fn actuators_pull_with_the_force_that_they_say() {
    let key = "<keyframe><key ctrl='0.5'/></keyframe>";
    let motor = |kind: &str| format!("<actuator>{kind}</actuator>{key}");
    // Controls are 0 unless a key pose sets them.
    assert_eq!(turned("", &motor("<motor joint='turn' gear='3'/>")), 0.0);
    let with_pose = |joint: &str, kind: &str| {
        let text = world(&TURNTABLE.replace("JOINT", joint), &motor(kind));
        let scenario = "time_step = 0.002\nintegrator = \"euler\"\n[ground]\nfriction = 0.5\n[[robots]]\nfile = \"given.file\"\npose = \"key-0\"";
        let scene = scene_with(scenario, &text).unwrap_or_else(|why| panic!("{why}"));
        coordinates(&scene.robots[0], &after(&scene, 1))[0]
    };
    // A step with a residual of 10⁻¹⁰ m/s has a position error of 2·10⁻¹³. Turning by x with a spin
    // has an error of x³/12.
    let alike = |a: f64, b: f64| assert!((a - b).abs() <= 1e-12 + b.abs().powi(3), "{a:e} {b:e}");
    alike(with_pose("", "<motor joint='turn' gear='3'/>"), H * H * 1.5 / INERTIA);
    alike(
        with_pose("", "<motor joint='turn' gear='-3' ctrlrange='-0.1 0.1'/>"),
        -H * H * 0.3 / INERTIA,
    );
    alike(
        with_pose("", "<motor joint='turn' gear='3' forcerange='-1 0.2'/>"),
        H * H * 0.6 / INERTIA,
    );
    // k (c − x) − d ẋ with x = h ẋ.
    let spring =
        |k: f64, d: f64, c: f64, inertia: f64| H * H * k * c / (inertia + H * d + H * H * k);
    alike(
        with_pose("", "<position joint='turn' kp='40' kv='2' gear='2'/>"),
        spring(160.0, 8.0, 0.25, INERTIA),
    );
    alike(
        with_pose("armature='0.3'", "<position joint='turn' kp='40'/>"),
        spring(40.0, 0.0, 0.5, INERTIA + 0.3),
    );
    alike(
        with_pose("", "<position joint='turn' kp='40' forcerange='-30 5'/>"),
        H * H * 5.0 / INERTIA,
    );
    alike(with_pose("", "<velocity joint='turn' kv='10'/>"), H * H * 5.0 / (INERTIA + 10.0 * H));
    alike(
        with_pose("", "<general joint='turn' gainprm='7' biastype='affine' biasprm='1 -9 -3'/>"),
        H * H * 4.5 / (INERTIA + 3.0 * H + 9.0 * H * H),
    );
    // A spring with another rest position, and a coordinate with another reference, in degrees.
    let k = 5.0;
    let slack = 10.0_f64.to_radians();
    alike(turned("stiffness='5' springref='10'", ""), spring(k, 0.0, slack, INERTIA));
    let from = turned("stiffness='5' springref='10' ref='40'", "") - 40.0_f64.to_radians();
    alike(from, spring(k, 0.0, -3.0 * slack, INERTIA));
}

/// Checks a key pose selected in a scenario. Unknown names are refused.
#[test]
fn options_of_robots_are_checked() {
    let with = |fields: &str| {
        scene_with(
            &format!(
                "[ground]\nfriction = 0.5\n[[robots]]\nfile = \"classes.xml\"\nposition = [0, 0, 2.0]\n{fields}"
            ),
            "",
        )
    };
    let scene = with("pose = \"up\"").unwrap();
    // The pose is 1 m high in the frame of the file, which is 2 m high.
    assert!((scene.robots[0].start()[2] - 3.0).abs() < 1e-15);
    assert_eq!(scene.robots[0].controls(), [0.3, 0.0]);
    for (fields, part) in [
        ("pose = \"down\"", "no pose \"down\""),
        ("coordinates = { elbow = 1.0 }", "no joint \"elbow\""),
        ("coordinates = { ball = 1.0 }", "is not a slide or hinge"),
        ("fixed = true", "for URDF"),
        ("sides = 2", "sides is 2"),
        ("prefix = \"a b\"", "name"),
        ("colour = \"red\"", "colour"),
    ] {
        let why = with(fields).err().unwrap_or_default();
        assert!(why.contains(part), "{fields}: {why}");
    }
    let twice = "[ground]\nfriction = 0.5\n[[robots]]\nfile = \"quadruped.urdf\"\n[[robots]]\nfile = \"quadruped.urdf\"";
    assert!(scene_with(twice, "").err().unwrap_or_default().contains("prefix"));
}

/// Checks that fixed links that are not merged move like merged ones.
#[test]
fn kept_links_move_as_merged_ones() {
    let with = |merge: bool| {
        scene_of(&format!(
            "time_step = 0.001\n[ground]\nfriction = 0.5\n[[robots]]\nfile = \"quadruped.urdf\"\nmerge_fixed = {merge}\n\
             position = [0, 0, 0.41]\nattitude = {{ axis = [1, 0.3, 0], degrees = 5 }}"
        ))
    };
    let (merged, kept) = (with(true), with(false));
    assert_eq!((merged.bodies.len(), kept.bodies.len()), (13, 18));
    let ends = [&merged, &kept].map(|scene| coordinates(&scene.robots[0], &after(scene, 60)));
    for (a, b) in ends[0].iter().zip(&ends[1]) {
        assert!((a - b).abs() <= 1e-9, "{ends:?}");
    }
    assert!((ends[0][2] - 0.41).abs() > 0.01, "it fell: {ends:?}");
}

/// Checks a sled on two runners with different friction. Both decelerate it, and it consists of two
/// bodies.
#[test]
fn shapes_of_one_body_have_their_own_friction() {
    let sled = "<body name='sled' pos='0 0 0.1'><freejoint/>\
        <geom type='box' size='0.5 0.02 0.1' pos='0 0.3 0' mass='1' friction='0.2'/>\
        <geom type='box' size='0.5 0.02 0.1' pos='0 -0.3 0' mass='1' friction='0.4'/></body>";
    let key = "<keyframe><key name='go' qpos='0 0 0.1 1 0 0 0' qvel='2 0 0 0 0 0'/></keyframe>";
    let scene = scene_of(&world(sled, key));
    assert_eq!(scene.bodies, ["sled", "sled.2"]);
    let masses: f64 = scene.world.bodies().iter().map(|body| body.mass()).sum();
    assert!((masses - 2.0).abs() < 1e-15);
    let robot = &scene.robots[0];
    let mut states = scene.starts.clone();
    robot
        .set_states(
            &[0.0, 0.0, 0.1, 1.0, 0.0, 0.0, 0.0],
            &[2.0, 0.0, 0.0, 0.0, 0.0, 0.0],
            &mut states,
        )
        .unwrap();
    let mut simulation = scene.simulation(&Arc::new(AtomicBool::new(false))).unwrap();
    simulation.set_states(&states).unwrap();
    let mut record = StepRecord::new();
    simulation.step(&mut record).unwrap();
    // Each runner carries half the weight. Their difference turns the sled only little in one step.
    let slowed = (2.0 - simulation.states()[0].velocity[0]) / H;
    assert!((slowed - 9.81 * 0.3).abs() < 1e-3, "{slowed}");
    for _ in 0..100 {
        simulation.step(&mut record).unwrap();
    }
    let [a, b] = simulation.states() else { panic!() };
    assert!((a.position - b.position).norm() < 1e-12 && (a.attitude - b.attitude).norm() < 1e-12);
}

/// Checks collision groups. A body without contacts falls through the ground. A body that only
/// touches the ground falls through others.
#[test]
fn collision_groups_decide_which_shapes_touch() {
    let ball = |name: &str, height: f64, groups: &str| {
        format!(
            "<body name='{name}' pos='0 0 {height}'><freejoint/><geom size='0.1' {groups}/></body>"
        )
    };
    let bodies = [
        ball("ghost", 0.5, "contype='0' conaffinity='0'"),
        ball("first", 0.1, "contype='1' conaffinity='0'"),
        ball("second", 0.6, "contype='1' conaffinity='0'"),
        ball("third", 1.2, "contype='2' conaffinity='1'"),
    ];
    let scene = scene_of(&world(&bodies.concat(), ""));
    let simulation = after(&scene, 600);
    let height = |index: usize| simulation.states()[index].position[2];
    assert!(height(0) < -1.0, "{}", height(0));
    assert!((height(1) - 0.1).abs() < 1e-9 && (height(2) - 0.1).abs() < 1e-9);
    assert!(height(3) > 0.25, "upon the others: {}", height(3));
}

/// Checks the joint types of URDF: a fixed root, a planar joint with three coordinates, and a
/// floating link.
#[test]
fn urdf_has_all_its_joints() {
    let link = |name: &str| {
        format!(
            "<link name='{name}'><inertial><mass value='2'/><inertia ixx='0.1' iyy='0.1' izz='0.1' ixy='0' ixz='0' iyz='0'/></inertial></link>"
        )
    };
    let joint = |kind: &str, parent: &str, child: &str, rest: &str| {
        format!(
            "<joint name='{child}_joint' type='{kind}'><origin xyz='0 0 0.5'/><parent link='{parent}'/><child link='{child}'/>{rest}</joint>"
        )
    };
    let text = format!(
        "<robot name='all'>{}{}{}{}{}</robot>",
        ["base", "cart", "arm", "bird"].map(link).concat(),
        joint("planar", "base", "cart", "<axis xyz='0 0 1'/>"),
        joint("continuous", "cart", "arm", "<axis xyz='0 1 0'/><limit effort='5' velocity='1'/>"),
        joint("floating", "base", "bird", ""),
        "<transmission name='t'/>"
    );
    let with = |fields: &str| {
        let scene = scene_with(
            &format!(
                "gravity = 9.81\n[ground]\nnone = true\nfriction = 0.5\n[[robots]]\nfile = \"given.file\"\n{fields}"
            ),
            &text,
        );
        scene.unwrap_or_else(|why| panic!("{why}"))
    };
    let (held, flying) = (with("fixed = true"), with(""));
    let names: Vec<_> =
        held.robots[0].robot().joints.iter().map(|joint| joint.name.as_str()).collect();
    assert_eq!(names, ["cart_joint_x", "cart_joint_y", "cart_joint", "arm_joint", "bird_joint"]);
    assert_eq!(
        (held.robots[0].robot().counts(), flying.robots[0].robot().counts()),
        ((11, 10), (18, 16))
    );
    assert_eq!((held.bodies.len(), flying.bodies.len()), (3, 4));
    let simulation = after(&held, 100);
    let q = coordinates(&held.robots[0], &simulation);
    // The cart keeps its height and the bird falls: h² g k²/2.
    assert!(q[..4].iter().all(|x| x.abs() < 1e-12), "{q:?}");
    assert!((q[6] - (0.5 - 9.81 * H * H * 5000.0)).abs() < 1e-12, "{q:?}");
    assert!(
        held.notes().iter().any(|note| note.contains("1 <transmission>")),
        "{:?}",
        held.notes()
    );
    let mimic =
        text.replace("<axis xyz='0 1 0'/>", "<axis xyz='0 1 0'/><mimic joint='bird_joint'/>");
    let why = scene_with("[ground]\nfriction = 0.5\n[[robots]]\nfile = \"given.file\"", &mimic);
    let why = why.err().unwrap_or_default();
    assert!(why.contains("<mimic>") && why.contains("bird_joint"), "{why}");
}

/// Checks that two or three hinges with a common point become one joint with their angles, in any
/// order.
#[test]
fn hinges_that_meet_are_one_joint() {
    const STEPS: usize = 120;
    let arm = |axes: &[&str]| {
        let hinges: Vec<_> =
            axes.iter().map(|axis| format!("<joint axis='{axis}' damping='0.3'/>")).collect();
        format!(
            "<body pos='0 0 2'>{}<geom type='box' size='0.3 0.2 0.15' pos='0.3 0.1 -0.1'/></body>",
            hinges.concat()
        )
    };
    for axes in
        [&["1 0 0", "0 1 0"][..], &["0 0 1", "0 1 0", "1 0 0"], &["1 0 0", "0 0 -1", "0 1 0"]]
    {
        let scene = scene_of(&world(&arm(axes), ""));
        assert_eq!(scene.bodies.len(), 1);
        let robot = &scene.robots[0];
        let simulation = after(&scene, STEPS);
        let (q, v) = robot.coordinates(simulation.states(), robot.start()).unwrap();
        // The reference integrates M v̇ + bias = −damping v in the coordinates of the file.
        let (mut x, mut rate) = (vec![0.0; axes.len()], nalgebra::DVector::zeros(axes.len()));
        let gravity = nalgebra::Vector3::new(0.0, 0.0, -9.81);
        let fine = 40;
        let step = H / fine as f64;
        for _ in 0..STEPS * fine {
            let motion = robot.robot().motion(&x, rate.as_slice()).unwrap();
            let pull = -motion.bias(robot.robot(), &gravity) - &rate * 0.3;
            rate += motion.mass_matrix(robot.robot()).lu().solve(&pull).unwrap() * step;
            x.iter_mut().zip(&rate).for_each(|(x, rate)| *x += rate * step);
        }
        for (a, b) in q.iter().zip(&x) {
            // Both methods are of first order in their steps.
            assert!((a - b).abs() < 0.01, "{axes:?}: {q:?} {x:?} {v:?}");
        }
        assert!(q.iter().any(|x| x.abs() > 0.2), "{q:?}");
    }
    let apart = arm(&["1 0 0", "0 1 0"]).replacen("damping", "pos='0 0.1 0.1' damping", 1);
    assert_eq!(scene_of(&world(&apart, "")).joints.len(), 2);
}

/// Checks that a mesh is its convex hull, the pieces assigned to it, or those of its decomposition.
/// The file is in a package's folder or next to the robot file.
#[test]
fn meshes_are_hulls_or_pieces() {
    let text = "<robot name='m'><link name='a'><inertial><mass value='1'/>\
        <inertia ixx='0.4' iyy='0.4' izz='0.4' ixy='0' ixz='0' iyz='0'/></inertial>\
        <collision><geometry><mesh filename='package://parts/wedge.obj' scale='0.5 0.5 0.5'/></geometry></collision></link></robot>";
    let with = |fields: &str| {
        scene_with(
            &format!(
                "[ground]\nfriction = 0.5\n[[robots]]\nfile = \"given.file\"\nposition = [0, 0, 2]\n{fields}"
            ),
            text,
        )
    };
    let why = with("packages = \"parts\"").err().unwrap_or_default();
    assert!(why.contains("package://parts/wedge.obj") && why.contains("<mesh>"), "{why}");
    let hull = with("packages = \".\"").unwrap();
    let body = &hull.world.bodies()[0];
    assert_eq!((body.pieces().len(), body.contact_points().len()), (1, 6));
    assert!(body.contact_points().iter().all(|point| point.position.amax() == 0.5));
    let pieces =
        "meshes = { \"package://parts/wedge.obj\" = [\"parts/wedge.obj\", \"parts/wedge.obj\"] }";
    assert_eq!(with(pieces).unwrap().world.bodies()[0].pieces().len(), 2);
    let bowl = text.replace("package://parts/wedge.obj", "../meshes/bowl.obj");
    let with_bowl = |fields: &str| {
        let place =
            "[ground]\nfriction = 0.5\n[[robots]]\nfile = \"given.file\"\nposition = [0, 0, 2]";
        scene_with(&format!("{place}\n{fields}"), &bowl)
    };
    assert_eq!(with_bowl("").unwrap().world.bodies()[0].pieces().len(), 1);
    let cut = with_bowl("meshes = { \"../meshes/bowl.obj\" = { pieces = 8 } }").unwrap();
    assert!((4..=8).contains(&cut.world.bodies()[0].pieces().len()));
    for wrong in ["{ pieces = 0 }", "{ hulls = 3 }", "3"] {
        let why = with_bowl(&format!("meshes = {{ \"../meshes/bowl.obj\" = {wrong} }}"));
        let why = why.err().unwrap_or_default();
        assert!(why.contains("pieces"), "{why}");
    }
    let why = with("meshes = { \"package://parts/wedge.obj\" = [\"parts/no.obj\"] }")
        .err()
        .unwrap_or_default();
    assert!(why.contains("no.obj"), "{why}");
}

/// Checks that elements left out by the user are absent, together with their references.
#[test]
fn left_out_elements_are_removed() {
    let text = "<mujoco><worldbody><body name='a' pos='0 0 1'><joint name='swing'/><geom name='ball' size='0.1' condim='6'/></body>\
        <body name='goal' pos='1 0 1'><joint name='slide' type='slide'/><geom size='0.01' density='1e-9'/></body></worldbody>\
        <tendon><fixed name='cord' range='0 1'><joint joint='swing' coef='1'/></fixed></tendon>\
        <actuator><motor name='pull' tendon='cord'/><motor name='turn' joint='swing'/><motor name='go' joint='slide'/></actuator>\
        <keyframe><key qpos='0.1 0.2'/></keyframe></mujoco>";
    let with = |fields: &str| {
        scene_with(
            &format!("[ground]\nfriction = 0.5\n[[robots]]\nfile = \"given.file\"\n{fields}"),
            text,
        )
    };
    assert_eq!(with("").unwrap().bodies.len(), 2);
    let scene = with("leave_out = [\"tendon\", \"body:goal\", \"@condim\"]").unwrap();
    let robot = scene.robots[0].robot();
    let names: Vec<_> = robot.actuators.iter().map(|actuator| actuator.name.as_str()).collect();
    assert_eq!((names, robot.keys.len(), scene.bodies.len()), (vec!["turn"], 0, 1));
    let why = with("leave_out = [\"tendon\", \"gaol\"]").err().unwrap_or_default();
    assert!(why.contains("\"gaol\""), "{why}");
}

/// Two bodies of an MJCF file have the friction of the file between them, not the rolling friction of the scene's ground.
/// On the ground its own acts.
#[test]
fn bodies_of_a_file_keep_their_friction() {
    let body =
        |x: f64| format!("<body pos='{x} 0 0.1'><freejoint/><geom size='0.1' condim='3'/></body>");
    let text = format!(
        "<mujoco><option><flag override='enable'/></option><worldbody>{}{}</worldbody></mujoco>",
        body(0.0),
        body(0.3)
    );
    let scene = scene_with(
        "[ground]\nfriction = 0.5\nrolling_friction = 0.01\n[[robots]]\nfile = \"given.file\"\n",
        &text,
    )
    .unwrap();
    let rolling = |partner| scene.world.turning_friction_between(0, partner).rolling;
    assert_eq!((rolling(Partner::Body(1)), rolling(Partner::Ground)), (0.0, 0.01));
    let notes = scene.notes();
    assert!(notes.iter().any(|note| note.contains("the flag override has no effect")), "{notes:?}");
    assert!(notes.iter().all(|note| !note.starts_with(':')), "{notes:?}");
}
