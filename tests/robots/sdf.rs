//! Robots from SDF files: frames in closed form, and public files as Drake reads them
//! (`data/generate/robots_sdf.py`).

use nalgebra::{Matrix3, Vector3};
use serde_json::Value;
use std::f64::consts::{FRAC_1_SQRT_2, TAU};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use tumble_core::simulation::StepRecord;
use tumble_robot::model::{Moves, Robot, RobotForm};
use tumble_robot::{LinkFrame, Reading, read};
use tumble_scene::scene::Scene;

fn robot(content: &str) -> Robot {
    read(&format!("<sdf version='1.9'>{content}</sdf>"), &Reading::none()).unwrap()
}

fn why(content: &str) -> String {
    read(&format!("<sdf version='1.9'>{content}</sdf>"), &Reading::none()).err().unwrap_or_default()
}

/// Pose of a link in the world at zero coordinates.
fn placed(robot: &Robot, link: &str) -> LinkFrame {
    let still = vec![0.0; robot.counts().1];
    let motion = robot.motion(&robot.reference(), &still).unwrap();
    motion.links()[robot.link(link).unwrap_or_else(|| panic!("no link {link}"))].frame
}

fn near(ours: &[f64], theirs: &[f64], what: &str) {
    let scale = theirs.iter().fold(1.0_f64, |most, number| most.max(number.abs()));
    assert_eq!(ours.len(), theirs.len(), "{what}");
    for (a, b) in ours.iter().zip(theirs) {
        assert!((a - b).abs() <= 1e-12 * scale, "{what}: {ours:?} is not {theirs:?}");
    }
}

const TURNED: &str = r#"<model name="arm"><pose>1 0 0 0 0 1.5707963267948966</pose>
    <link name="base"><pose>0 0 1 0 0 0</pose></link>
    <frame name="tool" attached_to="base"><pose degrees="true">0 0 2 90 0 0</pose></frame>
    <link name="tip"><pose relative_to="tool">0 1 0 0 0 0</pose>
        <inertial><pose>0 0.5 0 0 0 1.5707963267948966</pose><mass>2</mass>
            <inertia><ixx>1</ixx><iyy>2</iyy><izz>2.5</izz></inertia></inertial></link>
    <joint name="hold" type="fixed"><parent>world</parent><child>base</child></joint>
    <joint name="turn" type="revolute"><pose>0 -1 0 0 0 0</pose>
        <parent>base</parent><child>tip</child>
        <axis><xyz expressed_in="__model__">0 0 1</xyz>
            <limit><lower>-1</lower><upper>2</upper><effort>30</effort></limit>
            <dynamics><damping>0.1</damping><friction>0.2</friction>
                <spring_stiffness>5</spring_stiffness><spring_reference>0.3</spring_reference>
            </dynamics></axis></joint>
    </model>"#;

#[test]
fn poses_follow_the_frames_that_they_are_relative_to() {
    let robot = robot(TURNED);
    let base = placed(&robot, "base");
    near(base.position.as_slice(), &[1.0, 0.0, 1.0], "base");
    // The tool is 2 above the base, and its y points up. The tip is 1 along this axis.
    let tip = placed(&robot, "tip");
    near(tip.position.as_slice(), &[1.0, 0.0, 4.0], "tip");
    let columns = [0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0];
    near(tip.rotation().as_slice(), &columns, "axes of the tip");
    let tool = robot.site("tool").unwrap();
    assert_eq!(tool.link, robot.link("base").unwrap());
    near(tool.frame.position.as_slice(), &[0.0, 0.0, 2.0], "tool");
    near(tool.frame.attitude.as_slice(), &[FRAC_1_SQRT_2, FRAC_1_SQRT_2, 0.0, 0.0], "tool");
}

#[test]
fn joints_and_inertias_are_in_the_frame_of_the_link() {
    let robot = robot(TURNED);
    let joint = &robot.joints[robot.joint("turn").unwrap()];
    assert_eq!(joint.moves, Moves::Hinge);
    near(joint.axis.as_slice(), &[0.0, 1.0, 0.0], "axis");
    near(joint.anchor.as_slice(), &[0.0, -1.0, 0.0], "anchor");
    assert_eq!((joint.range, joint.effort), (Some([-1.0, 2.0]), Some([-30.0, 30.0])));
    let own = [joint.damping, joint.friction, joint.stiffness, joint.rest];
    assert_eq!(own, [0.1, 0.2, 5.0, 0.3]);
    let mass = robot.links[robot.link("tip").unwrap()].mass;
    near(mass.centre.as_slice(), &[0.0, 0.5, 0.0], "centre");
    let turned = Matrix3::from_diagonal(&Vector3::new(2.0, 1.0, 2.5));
    near(mass.inertia.as_slice(), turned.as_slice(), "inertia");
    assert_eq!(robot.links[robot.link("base").unwrap()].mass.mass, 1.0, "the default");
}

#[test]
fn before_version_1_5_axes_are_in_the_frame_of_the_model() {
    for (version, x) in [("1.4", 1.0), ("1.6", 0.0)] {
        let robot = read(
            &format!(
                "<sdf version='{version}'><model name='m'><link name='a'/><link name='b'>
                 <pose>0 0 0 0 0 1.5707963267948966</pose></link><joint name='j' type='prismatic'>
                 <parent>a</parent><child>b</child><axis><xyz>0 1 0</xyz></axis></joint></model></sdf>"
            ),
            &Reading::none(),
        );
        let joint = robot.unwrap().joints.pop().unwrap();
        near(joint.axis.as_slice(), &[x, 1.0 - x, 0.0], version);
        assert_eq!(joint.range, None);
    }
}

#[test]
fn nested_models_are_placed_by_their_placement_frame() {
    let robot = robot(
        "<model name='outer'><link name='l'><pose>1 0 0 0 0 0</pose></link>
         <model name='inner' placement_frame='grip'><pose relative_to='l'>0 0 1 0 0 0</pose>
            <link name='hand'><pose>0 2 0 0 0 0</pose></link>
            <frame name='grip' attached_to='hand'><pose>0 0 3 0 0 0</pose></frame></model>
         <joint name='j' type='ball'><parent>l</parent><child>inner::grip</child></joint></model>",
    );
    near(placed(&robot, "inner.hand").position.as_slice(), &[1.0, 0.0, -2.0], "hand");
    let joint = &robot.joints[robot.joint("j").unwrap()];
    assert_eq!(joint.moves, Moves::Ball);
    near(joint.anchor.as_slice(), &[0.0, 0.0, 3.0], "anchor");
}

#[test]
fn universal_joints_and_screws_have_two_axes() {
    let two = |kind: &str| {
        robot(&format!(
            "<model name='m'><link name='a'/><link name='b'/><joint name='j' type='{kind}'>
             <parent>a</parent><child>b</child><axis><xyz>1 0 0</xyz></axis>
             <axis2><xyz>0 1 0</xyz></axis2><screw_thread_pitch>0.5</screw_thread_pitch>
             </joint></model>"
        ))
    };
    let universal = two("universal");
    let axes: Vec<_> = universal.joints[1..].iter().map(|joint| joint.axis).collect();
    assert_eq!(axes, [Vector3::x(), Vector3::y()]);
    assert_eq!(universal.links.len(), 3, "the world and two links");
    let screw = two("screw");
    assert_eq!([1, 2].map(|index| screw.joints[index].moves), [Moves::Slide, Moves::Hinge]);
    near(&[screw.follows[0].ratio], &[0.5 / TAU], "pitch");
}

/// Scene of a file without others, and its coordinates after 0.2 s.
fn after(content: &str) -> (Scene, Vec<f64>) {
    let text = format!("<sdf version='1.9'>{content}</sdf>");
    let read_file = |path: &Path, _: u64| std::fs::read(path);
    let scene = Scene::from_text(&text, Path::new("own.sdf"), &[], &read_file);
    let scene = scene.map_err(|failure| failure.to_string()).unwrap();
    let mut simulation = scene.simulation(&Arc::new(AtomicBool::new(false))).unwrap();
    for _ in 0..100 {
        simulation.step(&mut StepRecord::new()).unwrap();
    }
    let states = simulation.states().to_vec();
    let coordinates = scene.robots[0].coordinates(&states, scene.robots[0].start()).unwrap().0;
    (scene, coordinates)
}

#[test]
fn a_nut_of_unit_mass_and_inertia_falls_along_its_screw_with_half_of_gravity() {
    // The pitch is 2π, so that the nut moves 1 m per rad.
    let (_, q) = after(
        "<world name='w'><gravity>0 0 -10</gravity><model name='m'><link name='nut'/>
         <joint name='screw' type='screw'><parent>world</parent><child>nut</child>
         <screw_thread_pitch>6.283185307179586</screw_thread_pitch></joint></model></world>",
    );
    near(&[q[0]], &[q[1]], "slide and hinge");
    assert!((q[0] + 0.5 * 5.0 * 0.04).abs() < 2e-3, "{q:?}");
}

#[test]
fn a_ball_rests_on_the_plane_of_its_world() {
    let shape = |name: &str, form: &str| {
        format!(
            "<link name='{name}'><collision name='c'><geometry>{form}</geometry></collision></link>"
        )
    };
    let plane = shape("l", "<plane><normal>0 0 1</normal></plane>");
    let ball = shape("b", "<sphere><radius>0.5</radius></sphere>");
    let (scene, q) = after(&format!(
        "<world name='w'><model name='ground'><static>1</static>{plane}</model>
         <model name='ball'><pose>0 0 0.5 0 0 0</pose>{ball}</model></world>"
    ));
    assert_eq!(scene.document.bodies.len(), 1);
    assert!((q[2] - 0.5).abs() < 1e-9, "{q:?}");
}

#[test]
fn worlds_have_gravity_ground_and_static_models() {
    let robot = robot(
        "<world name='w'><gravity>0 0 -3</gravity><physics type='ode'>
         <max_step_size>0.004</max_step_size></physics>
         <model name='ground'><static>true</static><link name='l'><collision name='c'><geometry>
            <plane><normal>0 1 0</normal></plane></geometry><surface><friction><ode><mu>100</mu>
            </ode></friction></surface></collision></link></model>
         <model name='ball'><pose>0 0 2 0 0 0</pose><link name='l'><gravity>0</gravity>
            <inertial auto='true'><density>500</density></inertial>
            <collision name='c'><geometry><sphere><radius>0.5</radius></sphere></geometry>
            </collision></link></model></world>",
    );
    assert_eq!((robot.options.gravity[2], robot.options.time_step), (-3.0, 0.004));
    assert_eq!(robot.shapes[0].form, RobotForm::Plane);
    assert_eq!(robot.shapes[0].friction, Some(10.0));
    near(robot.shapes[0].frame.rotation().column(2).as_slice(), &[0.0, 1.0, 0.0], "normal");
    let ball = &robot.links[robot.link("ball.l").unwrap()];
    near(&[ball.mass.mass, ball.weightless], &[500.0 * TAU / 12.0, 1.0], "ball");
    assert_eq!(robot.joints.len(), 1);
    assert!(robot.notes.iter().any(|note| note.contains("above 10")), "{:?}", robot.notes);
}

#[test]
fn links_of_a_model_touch_each_other_only_with_self_collide() {
    let ball =
        "<collision name='c'><geometry><sphere><radius>1</radius></sphere></geometry></collision>";
    let (with, without) = ("<self_collide>1</self_collide>", "<self_collide>false</self_collide>");
    // Of the model and of its two links. Drake and Gazebo let two links touch if either says so.
    for (fields, expected) in [
        (["", "", ""], false),
        ([with, "", ""], true),
        (["", with, ""], true),
        (["", "", with], true),
        (["", with, with], true),
        ([with, without, ""], true),
        ([with, without, without], false),
        ([without, "", with], true),
    ] {
        let [model, first, second] = fields;
        let robot = robot(&format!(
            "<model name='m'>{model}<link name='a'>{first}{ball}</link>
             <link name='b'>{second}{ball}</link></model>
             <model name='n'><link name='a'>{ball}</link></model>"
        ));
        assert!(robot.notes.iter().all(|note| !note.contains("unknown")), "{:?}", robot.notes);
        let [a, b, other] = &robot.shapes[..] else { panic!("three shapes are needed") };
        assert_eq!(a.meets(b), expected, "{fields:?}");
        assert!(a.meets(other) && other.meets(b));
    }
}

#[test]
fn forms_are_read_and_cones_have_their_mass() {
    let forms = [
        ("<box><size>1 2 3</size></box>", RobotForm::Box(Vector3::new(0.5, 1.0, 1.5))),
        (
            "<cylinder><radius>1</radius><length>4</length></cylinder>",
            RobotForm::Cylinder(2.0, 1.0),
        ),
        ("<capsule><radius>1</radius><length>4</length></capsule>", RobotForm::Capsule(2.0, 1.0)),
        ("<cone><radius>1</radius><length>4</length></cone>", RobotForm::Cone(2.0, 1.0)),
        (
            "<ellipsoid><radii>1 2 3</radii></ellipsoid>",
            RobotForm::Ellipsoid(Vector3::new(1.0, 2.0, 3.0)),
        ),
    ];
    for (text, form) in forms {
        let robot = robot(&format!(
            "<model name='m'><link name='l'><inertial auto='1'/><collision name='c'><geometry>{text}
             </geometry></collision></link></model>"
        ));
        assert_eq!(robot.shapes[0].form, form);
        if matches!(form, RobotForm::Cone(..)) {
            let mass = robot.links[1].mass;
            near(&[mass.mass, mass.centre[2]], &[1000.0 * TAU * 2.0 / 3.0, -1.0], "cone");
            near(
                &[mass.inertia[(0, 0)], mass.inertia[(2, 2)]],
                &[0.75 * mass.mass, 0.3 * mass.mass],
                "cone",
            );
        }
    }
}

/// A collision without a density has that of the link, which is 1000 kg/m³ without one.
#[test]
fn automatic_masses_need_one_density() {
    let inertial = |link: &str, own: &str| {
        let link =
            if link.is_empty() { String::new() } else { format!("<density>{link}</density>") };
        let own = if own.is_empty() { String::new() } else { format!("<density>{own}</density>") };
        let part = "<geometry><box><size>.1 .1 .1</size></box></geometry></collision>";
        format!(
            "<model name='m'><link name='l'><inertial auto='true'>{link}</inertial>
             <collision name='c'>{own}{part}<collision name='d'><pose>1 0 0 0 0 0</pose>{part}</link></model>"
        )
    };
    for (link, own) in [("500", "2000"), ("", "2000")] {
        let said = why(&inertial(link, own));
        assert!(said.contains("auto: only one density is supported"), "{said}");
    }
    for (link, own, mass) in [("500", "500", 1.0), ("500", "", 1.0), ("", "1000", 2.0)] {
        near(&[robot(&inertial(link, own)).links[1].mass.mass], &[mass], "mass");
    }
}

#[test]
fn models_of_other_files_are_included() {
    let gripper = "<sdf version='1.9'><model name='g'><link name='l'><pose>0 0 1 0 0 0</pose>
        <collision name='c'><geometry><mesh><uri>box.obj</uri></mesh></geometry></collision>
        </link></model></sdf>";
    let corners = [0, 1, 2, 3, 4, 5, 6, 7];
    let corner = |c: usize| format!("v {} {} {}\n", c & 1, c >> 1 & 1, c >> 2);
    let faces = "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
    let mesh = corners.map(corner).concat() + faces;
    let read_file = |path: &Path, _: u64| match path.to_str() {
        Some("hands/g/model.sdf") => Ok(gripper.as_bytes().to_vec()),
        Some("hands/g/box.obj") => Ok(mesh.as_bytes().to_vec()),
        _ => Err(std::io::Error::from(std::io::ErrorKind::NotFound)),
    };
    let packages = Some(Path::new("hands"));
    let text = "<sdf version='1.9'><model name='m'><link name='a'/>
        <include><uri>model://g</uri><name>left</name><pose>0 3 0 0 0 0</pose></include>
        <include><uri>model://sun</uri></include></model></sdf>";
    let robot = read(text, &Reading { read: &read_file, packages, ..Reading::none() }).unwrap();
    near(placed(&robot, "left.l").position.as_slice(), &[0.0, 3.0, 1.0], "left");
    assert!(matches!(&robot.shapes[0].form, RobotForm::Hull(points) if points.len() == 8));
    assert!(robot.notes.iter().any(|note| note.contains("model://sun")), "{:?}", robot.notes);
}

#[test]
fn errors_name_the_line_and_the_remedy() {
    let link = "<link name='a'/>";
    let joint = |kind: &str, child: &str| {
        format!(
            "<model name='m'>{link}<joint name='j' type='{kind}'><parent>world</parent><child>{child}</child></joint></model>"
        )
    };
    let cases = [
        (joint("gearbox", "a"), "type: fixed, revolute"),
        (joint("fixed", "b"), "there is no frame \"m.b\""),
        (joint("fixed", "world"), "exchange <parent> and <child>"),
        (format!("<model name='m'>{link}{link}</model>"), "used twice"),
        ("<model name='m'><link name='a'><pose>1 2</pose></link></model>".into(), "roll pitch yaw"),
        (
            "<model name='m'><link name='a'><pose relative_to='a'/></link></model>".into(),
            "depends on itself",
        ),
        ("<model name='m'><link name='a'><inertal/></link></model>".into(), "`inertial`"),
        (
            "<model name='m'><link name='a'><collision name='c'><geometry><heightmap/></geometry>
             </collision></link></model>"
                .into(),
            "one of box",
        ),
        (
            "<model name='m'><link name='a'><inertial><mass>x</mass></inertial></link></model>"
                .into(),
            "not a number",
        ),
    ];
    for (content, expected) in cases {
        let why = why(&content);
        assert!(why.contains("line 1") && why.contains(expected), "{content}: {why}");
    }
}

#[test]
fn ignored_parts_are_listed() {
    let robot = robot(
        "<model name='m'><plugin name='p' filename='f'/><link name='a'><velocity_decay/><sensor/></link></model>",
    );
    let notes = robot.notes.join("\n");
    for part in ["1 <plugin>", "1 <sensor>", "<velocity_decay> in <link>"] {
        assert!(notes.contains(part), "{part}: {notes}");
    }
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|number| number.as_f64().unwrap()).collect()
}

/// Name of an element of Drake in the robot: with its models if the file has several.
fn known<'n>(name: &'n str, has: &dyn Fn(&str) -> bool) -> String {
    let dotted = name.replace("::", ".");
    match dotted.split_once('.') {
        Some((_, rest)) if !has(&dotted) => rest.to_owned(),
        _ => dotted,
    }
}

fn compare(file: &str, robot: &Robot, figures: &Value) {
    for theirs in figures["links"].as_array().unwrap() {
        let name = known(theirs["name"].as_str().unwrap(), &|name| robot.link(name).is_some());
        let what = format!("{file}: {name}");
        // A link without mass between two joints is a frame only.
        let is_massless = theirs["mass"].as_f64().unwrap() < 1e-9;
        if is_massless && robot.link(&name).is_none() {
            continue;
        }
        let frame = placed(robot, &name);
        near(frame.position.as_slice(), &numbers(&theirs["position"]), &what);
        near(frame.rotation().transpose().as_slice(), &numbers(&theirs["rotation"]), &what);
        let link = &robot.links[robot.link(&name).unwrap()];
        let mass = theirs["mass"].as_f64().unwrap();
        near(&[link.mass.mass], &[mass], &what);
        if mass > 0.0 {
            near(link.mass.centre.as_slice(), &numbers(&theirs["centre"]), &what);
            near(link.mass.inertia.as_slice(), &numbers(&theirs["inertia"]), &what);
        }
    }
    for theirs in figures["joints"].as_array().unwrap() {
        let name = known(theirs["name"].as_str().unwrap(), &|name| robot.joint(name).is_some());
        let what = format!("{file}: {name}");
        let joint = robot.joint(&name).unwrap_or_else(|| panic!("{what}: it is not read"));
        let joint = &robot.joints[joint];
        assert_eq!(joint.moves == Moves::Hinge, theirs["turns"].as_bool().unwrap(), "{what}");
        let frame = placed(robot, &robot.links[joint.link].name);
        near((frame.rotation() * joint.axis).as_slice(), &numbers(&theirs["axis"]), &what);
        near(frame.point(&joint.anchor).as_slice(), &numbers(&theirs["anchor"]), &what);
        near(&[joint.damping], &[theirs["damping"].as_f64().unwrap()], &what);
        assert_eq!(joint.range.is_some(), theirs["limits"].is_array(), "{what}");
        if let Some(range) = joint.range {
            near(&range, &numbers(&theirs["limits"]), &what);
        }
    }
}

/// `TUMBLE_SDF_FIGURES` names a file of other figures, and `TUMBLE_SDF_FOLDER` their files.
#[test]
fn public_files_have_the_masses_and_frames_of_drake() {
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("data/robots");
    let path =
        |name: &str, usual: &str| std::env::var(name).map_or(data.join(usual), PathBuf::from);
    let figures = path("TUMBLE_SDF_FIGURES", "sdf.json");
    let folder = path("TUMBLE_SDF_FOLDER", "sdf");
    let all: Value = serde_json::from_slice(&std::fs::read(figures).unwrap()).unwrap();
    let all = all.as_object().unwrap();
    assert!(all.len() >= 10);
    for (file, figures) in all {
        let path = folder.join(file);
        let text = std::fs::read_to_string(&path).unwrap();
        let read_file = |path: &Path, _: u64| std::fs::read(path);
        let folder = path.parent().unwrap();
        match read(&text, &Reading { folder, read: &read_file, ..Reading::none() }) {
            Ok(robot) => compare(file, &robot, figures),
            Err(why) if folder.starts_with(&data) => panic!("{file}: {why}"),
            Err(why) => eprintln!("{file}: {why}"),
        }
    }
}

/// Frames that build on one another cost the square of their number. Models that stand on a frame of
/// their innermost model double the cost with each level.
#[test]
fn frames_that_take_too_long_are_refused() {
    let chain: String = (1..20_000)
        .map(|k| {
            let before = k - 1;
            format!("<frame name='f{k}'><pose relative_to='f{before}'>0 0 1 0 0 0</pose></frame>")
        })
        .collect();
    let chain = format!("<model name='m'><link name='l'/><frame name='f0'/>{chain}</model>");
    let levels = 60;
    let inner = |level: usize| (level + 1..levels).map(|k| format!("m{k}::")).collect::<String>();
    let open = |level| format!("<model name='m{level}' placement_frame='{}l'>", inner(level));
    let nested =
        (0..levels).map(open).collect::<String>() + "<link name='l'/>" + &"</model>".repeat(levels);
    for text in [chain, nested] {
        let why = why(&text);
        assert!(why.contains("too many frames build on one another"), "{why}");
    }
}

/// Files write π/2 with 4 to 11 digits. The wheels of a resting robot then start up to 0.02·10⁻⁴ m below
/// the ground. The two steps that lift them gain m g times this lift in all, and are no less physical.
#[test]
fn a_robot_with_rounded_angles_rests() {
    for angle in ["1.57079632679", "1.570796326", "1.5707963", "1.570796", "1.5708", "1.5707"] {
        let wheel = |name: &str, y: f64| {
            format!(
                "<link name='{name}'><pose>-0.1 {y} 0.1 -{angle} 0 0</pose><inertial><mass>0.5</mass>
                 <inertia><ixx>0.0015</ixx><iyy>0.0015</iyy><izz>0.0025</izz></inertia></inertial>
                 <collision name='c'><geometry><cylinder><radius>0.1</radius><length>0.04</length>
                 </cylinder></geometry></collision></link>
                 <joint name='{name}j' type='revolute'><parent>chassis</parent><child>{name}</child>
                 <axis><xyz expressed_in='__model__'>0 1 0</xyz></axis></joint>"
            )
        };
        let text = format!(
            "<sdf version='1.9'><world name='w'><physics name='p' type='ignored'>
             <max_step_size>0.001</max_step_size></physics>
             <model name='floor'><static>true</static><link name='l'><collision name='c'><geometry>
             <plane><normal>0 0 1</normal></plane></geometry></collision></link></model>
             <model name='robot'><link name='chassis'><pose>0 0 0.1 0 0 0</pose><inertial><mass>5</mass>
             <inertia><ixx>0.05</ixx><iyy>0.08</iyy><izz>0.1</izz></inertia></inertial></link>
             {}{}<link name='caster'><pose>0.15 0 0.04 0 0 0</pose><inertial><mass>0.2</mass><inertia>
             <ixx>0.0002</ixx><iyy>0.0002</iyy><izz>0.0002</izz></inertia></inertial>
             <collision name='c'><geometry><sphere><radius>0.04</radius></sphere></geometry></collision>
             </link><joint name='cj' type='ball'><parent>chassis</parent><child>caster</child></joint>
             </model></world></sdf>",
            wheel("lw", 0.15),
            wheel("rw", -0.15)
        );
        let read = |path: &Path, _: u64| std::fs::read(path);
        let scene = Scene::from_text(&text, Path::new("w.sdf"), &[], &read).unwrap();
        let mut simulation = scene.simulation(&Arc::new(AtomicBool::new(false))).unwrap();
        let mut record = StepRecord::new();
        for k in 0..20 {
            simulation.step(&mut record).unwrap();
            let (status, gain) = (record.report().status, record.gain());
            assert!(status.is_solved(), "{angle}: k = {k}: {status:?} {gain:?}");
            assert!(record.unphysical().is_none(), "{angle}: k = {k}: {:?}", record.unphysical());
        }
        // Rest is no gain.
        assert_eq!(record.gain(), None, "{angle}");
    }
}

/// Checks that a written centre of mass at the origin of the shape is read back, for pieces that are elsewhere.
#[test]
fn a_centre_of_mass_at_the_origin_is_written() {
    let text = "[ground]\nfriction = 0.5\n[[bodies]]\nname = \"b\"\nmass = 1.0\ninertia = 0.1\n\
                centre = [0, 0, 0]\npieces = [{ box = 0.2, position = [0.3, 0, 0] }]\nposition = [0, 0, 1]\n";
    let none = |_: &Path, _: u64| Err(std::io::Error::other("there are no files"));
    let scene = Scene::from_text(text, Path::new("b.toml"), &[], &none).unwrap();
    let again = scene.clone().with_text(&scene.model_text().unwrap()).unwrap();
    assert_eq!(again.world, scene.world);
}
