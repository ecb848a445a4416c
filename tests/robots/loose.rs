//! Incomplete or non-conforming robot files: roots and links without mass, overlapping links,
//! meaningless limits, meshes with too many corners, Collada meshes.

use allocation_counter::measure;
use std::collections::HashMap;
use std::io::{Error, ErrorKind};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::sync::mpsc::channel;
use std::time::Duration;
use tumble_core::simulation::{Simulation, StepRecord};
use tumble_core::step::StepStatus;
use tumble_scene::scene::Scene;

const AIR: &str =
    "gravity = 9.81\n[ground]\nnone = true\nfriction = 0.5\n[[robots]]\nfile = \"robot.urdf\"\n";
const GROUND: &str =
    "gravity = 9.81\n[ground]\nfriction = 0.5\n[[robots]]\nfile = \"robot.urdf\"\n";

fn scene(text: &str, files: &[(&str, &str)]) -> Result<Scene, String> {
    let files: HashMap<_, _> = files.iter().copied().collect();
    let read = |path: &Path, _: u64| {
        let name = path.file_name().and_then(|name| name.to_str()).unwrap_or("");
        let file = files.get(name).ok_or_else(|| Error::from(ErrorKind::NotFound));
        file.map(|text| text.as_bytes().to_vec())
    };
    let scene = Scene::from_text(text, Path::new("scene.toml"), &[], &read);
    scene.map_err(|failure| failure.to_string())
}

fn robot(text: &str, urdf: &str) -> Scene {
    scene(text, &[("robot.urdf", urdf)]).unwrap_or_else(|why| panic!("{why}"))
}

fn after(scene: &Scene, steps: usize) -> Simulation<'static> {
    let mut simulation = scene.simulation(&Arc::new(AtomicBool::new(false))).unwrap();
    let mut record = StepRecord::new();
    for step in 0..steps {
        simulation.step(&mut record).unwrap();
        assert!(
            matches!(
                record.status(),
                StepStatus::Free | StepStatus::Converged | StepStatus::Retried
            ),
            "{step}: {:?}",
            record.status()
        );
    }
    simulation
}

/// True if a note of the scene contains these words.
fn said(scene: &Scene, words: &str) -> bool {
    scene.notes().iter().any(|note| note.contains(words))
}

fn link(name: &str, mass: f64, rest: &str) -> String {
    if mass == 0.0 {
        return format!("<link name='{name}'>{rest}</link>");
    }
    format!(
        "<link name='{name}'><inertial><mass value='{mass}'/><inertia ixx='0.02' iyy='0.03' izz='0.04' ixy='0' ixz='0' \
         iyz='0'/></inertial>{rest}</link>"
    )
}

fn joint(kind: &str, [parent, child]: [&str; 2], at: &str, rest: &str) -> String {
    format!(
        "<joint name='{child}_joint' type='{kind}'><origin xyz='{at}'/><parent link='{parent}'/><child link='{child}'/>\
         {rest}</joint>"
    )
}

fn shape(form: &str, at: &str) -> String {
    format!("<collision><origin xyz='{at}'/><geometry>{form}</geometry></collision>")
}

/// Checks that a root without mass is fixed to the world, with a note. A root with a heavy link
/// fixed to it is free.
#[test]
fn a_root_without_mass_is_fixed_to_the_world() {
    let cart = |kind: &str| {
        let parts = [
            link("rail", 0.0, &shape("<box size='2 0.1 0.1'/>", "0 0 0")),
            link("cart", 1.5, ""),
            joint(
                kind,
                ["rail", "cart"],
                "0 0 0.2",
                "<axis xyz='0 0 1'/><limit lower='-1e16' upper='1e16'/>",
            ),
        ];
        format!("<robot name='r'>{}</robot>", parts.concat())
    };
    let slides = robot(AIR, &cart("prismatic"));
    assert!(said(&slides, "rail, the root link, has no mass and is fixed"), "{:?}", slides.notes());
    assert_eq!((slides.bodies.len(), slides.fixed.len()), (1, 1));
    // Limits of 1e16 m are ignored. The cart falls freely along the rail's axis: h² g k²/2.
    let h = slides.world.time_step();
    let fell = 0.2 - after(&slides, 100).states()[0].position.z;
    assert!((fell - 9.81 * h * h * 5000.0).abs() < 1e-12, "{fell}");
    let flies = robot(AIR, &cart("fixed"));
    assert!(!said(&flies, "the root link"), "{:?}", flies.notes());
    assert_eq!((flies.bodies.len(), flies.fixed.len()), (1, 0));
    assert!(after(&flies, 10).states()[0].position.z < 0.2);
}

/// Checks that links without mass between joints are only frames. The joints belong to the link
/// below, as in MJCF.
#[test]
fn links_without_mass_between_joints_are_places() {
    let axes = |axis: &str| format!("<axis xyz='{axis}'/><dynamics damping='0.2'/>");
    let parts = [
        link("world", 0.0, ""),
        link("turned", 0.0, ""),
        link("arm", 2.0, ""),
        joint("continuous", ["world", "turned"], "0.1 0.2 0.3", &axes("1 0 0")).replace(
            "<origin xyz='0.1 0.2 0.3'/>",
            "<origin xyz='0.1 0.2 0.3' rpy='0.3 -0.2 0.9'/>",
        ),
        joint("continuous", ["turned", "arm"], "0 0 0", &axes("0 1 0")),
    ];
    let urdf = format!("<robot name='r'>{}</robot>", parts.concat()).replace(
        "<inertial><mass value='2'/>",
        "<inertial><origin xyz='0.3 0.1 -0.2'/><mass value='2'/>",
    );
    let chain = robot(AIR, &urdf);
    assert_eq!((chain.bodies.len(), chain.joints.len()), (1, 1));
    let mjcf = "<mujoco><compiler angle='radian' eulerseq='XYZ'/><option gravity='0 0 -9.81'/><worldbody>\
        <body name='arm' pos='0.1 0.2 0.3' euler='0.3 -0.2 0.9'>\
        <joint axis='1 0 0' damping='0.2'/><joint axis='0 1 0' damping='0.2'/>\
        <inertial pos='0.3 0.1 -0.2' mass='2' diaginertia='0.02 0.03 0.04'/></body></worldbody></mujoco>";
    let known = scene(AIR, &[("robot.urdf", mjcf)]).unwrap_or_else(|why| panic!("{why}"));
    let [ours, theirs] = [&chain, &known].map(|scene| after(scene, 300).states()[0].position);
    assert!((ours - theirs).amax() < 1e-9, "{ours} {theirs}");
    assert!((ours - chain.starts[0].position).amax() > 0.05);
}

/// Checks that links overlapping at the start never collide with each other, with a note. Others
/// do.
#[test]
fn initially_overlapping_pairs_have_no_contacts() {
    let ball = |at: &str| shape("<sphere radius='0.1'/>", at);
    let third = |gap: &str| {
        let parts = [
            link("base", 1.0, &ball("0 0 0")),
            link("middle", 1.0, ""),
            link("hand", 1.0, &ball("0 0 0")),
            joint("continuous", ["base", "middle"], "0 0 0.3", "<axis xyz='1 0 0'/>"),
            joint("continuous", ["middle", "hand"], gap, "<axis xyz='1 0 0'/>"),
        ];
        format!("<robot name='r'>{}</robot>", parts.concat())
    };
    let inside = robot(AIR, &third("0 0.05 -0.2"));
    assert!(
        said(&inside, "overlap at the start have no contacts: base and hand (8"),
        "{:?}",
        inside.notes()
    );
    let simulation = after(&inside, 200);
    let between = simulation.states()[0].position - simulation.states()[2].position;
    assert!(between.norm() < 0.2, "{between}");
    // At any depth: 10⁻⁴ m and 10⁻⁹ m.
    for (gap, depth) in [("0 0.1999 -0.3", "(1.0e-4 m)"), ("0 0.199999999 -0.3", "(1.0e-9 m)")] {
        let nearly = robot(AIR, &third(gap));
        assert!(said(&nearly, depth), "{:?}", nearly.notes());
        assert!(after(&nearly, 200).states().iter().all(|state| state.velocity.norm() < 10.0));
    }
    let beside = robot(AIR, &third("0 0.3 -0.2"));
    assert!(beside.notes().iter().all(|note| !note.contains("overlap")), "{:?}", beside.notes());
    // Overlap of two robots is refused as usual.
    let two = format!(
        "{AIR}[[robots]]\nfile = \"robot.urdf\"\nprefix = \"other-\"\nposition = [0, 0, 0.05]\n"
    );
    let why = scene(&two, &[("robot.urdf", &third("0 0.3 -0.2"))]).err().unwrap_or_default();
    assert!(why.contains("overlap by"), "{why}");
}

/// Checks an ellipsoid mesh with 12 000 triangles. Its hull has fewer corners, and a note states
/// the distance. A stone on the ground has the ellipsoid's height within that distance.
#[test]
fn a_mesh_with_too_many_corners_is_a_hull_of_some() {
    const HALF: [f64; 3] = [0.3, 0.2, 0.1];
    let (rings, around) = (60, 100);
    let mut obj = String::new();
    for ring in 0..=rings {
        let polar = std::f64::consts::PI * f64::from(ring) / f64::from(rings);
        for step in 0..around {
            let turn = std::f64::consts::TAU * f64::from(step) / f64::from(around);
            let unit = [polar.sin() * turn.cos(), polar.sin() * turn.sin(), polar.cos()];
            let [x, y, z] = std::array::from_fn(|k| HALF[k] * unit[k]);
            obj += &format!("v {x} {y} {z}\n");
        }
    }
    for ring in 0..rings {
        for step in 0..around {
            let corner = |ring: i32, step: i32| 1 + ring * around + step % around;
            let [a, b] = [corner(ring, step), corner(ring, step + 1)];
            let [c, d] = [corner(ring + 1, step), corner(ring + 1, step + 1)];
            obj += &format!("f {a} {c} {d}\nf {a} {d} {b}\n");
        }
    }
    let urdf = format!(
        "<robot name='r'>{}</robot>",
        link("stone", 1.0, &shape("<mesh filename='stone.obj'/>", "0 0 0"))
    );
    let text = format!("{GROUND}position = [0, 0, 0.1]\n");
    let stone = scene(&text, &[("robot.urdf", &urdf), ("stone.obj", &obj)]);
    let stone = stone.unwrap_or_else(|why| panic!("{why}"));
    assert!(said(&stone, "stone.obj: its hull is reduced to "), "{:?}", stone.notes());
    let body = &stone.world.bodies()[0];
    let corners = body.pieces()[0].core().vertices();
    assert!((100..=200).contains(&corners.len()), "{}", corners.len());
    // All corners belong to the mesh and lie on the ellipsoid.
    for corner in corners {
        let size = (0..3).map(|k| (corner[k] / HALF[k]).powi(2)).sum::<f64>();
        assert!((size - 1.0).abs() < 1e-12, "{corner}");
    }
    // The height is smaller by about the distance in the note. On an edge, two planes contribute.
    let note = stone.notes().join(" ");
    let outside = note.split("up to ").nth(1).and_then(|rest| rest.split(' ').next());
    let outside: f64 = outside.and_then(|number| number.parse().ok()).unwrap_or(f64::NAN);
    assert!((1e-4..5e-3).contains(&outside), "{note}");
    let height = after(&stone, 50).states()[0].position.z;
    assert!((0.1 - 2.0 * outside..=0.1 + 1e-9).contains(&height), "{height} {outside}");
}

/// Checks a box in Collada, in centimetres, rotated and translated by its nodes.
#[test]
fn the_points_of_collada_are_where_its_nodes_put_them() {
    let corners: Vec<_> = (0..8)
        .map(|k| format!("{} {} {}", 10 * (k & 1), 20 * (k >> 1 & 1), 30 * (k >> 2 & 1)))
        .collect();
    let dae = format!(
        "<?xml version='1.0'?><COLLADA xmlns='http://www.collada.org/2005/11/COLLADASchema' version='1.4.1'>\
         <asset><unit name='centimeter' meter='0.01'/><up_axis>Y_UP</up_axis></asset><library_geometries>\
         <geometry id='box'><mesh><source id='places'><float_array id='numbers' count='24'>{}</float_array></source>\
         <vertices id='corners'><input semantic='POSITION' source='#places'/></vertices></mesh></geometry>\
         </library_geometries><library_visual_scenes><visual_scene id='all'><node><translate>0 0 50</translate>\
         <rotate>0 0 1 90</rotate><node><scale>2 1 1</scale><instance_geometry url='#box'/></node></node>\
         </visual_scene></library_visual_scenes><scene><instance_visual_scene url='#all'/></scene></COLLADA>",
        corners.join(" ")
    );
    let urdf = format!(
        "<robot name='r'>{}</robot>",
        link("box", 1.0, &shape("<mesh filename='box.dae' scale='1 1 3'/>", "0 0 0"))
    );
    let with = |dae: &str| scene(AIR, &[("robot.urdf", &urdf), ("box.dae", dae)]);
    let made = with(&dae).unwrap_or_else(|why| panic!("{why}"));
    let corners = made.world.bodies()[0].pieces()[0].core().vertices();
    assert_eq!(corners.len(), 8);
    let bounds = |k: usize| {
        let along = || corners.iter().map(move |corner| corner[k]);
        [along().fold(f64::INFINITY, f64::min), along().fold(f64::NEG_INFINITY, f64::max)]
    };
    // The box's x, twice as long, is along y, and its y along −x. Its z starts at 0.5 m and is
    // stretched by 3.
    for (k, known) in [[-0.2, 0.0], [0.0, 0.2], [1.5, 2.4]].iter().enumerate() {
        let found = bounds(k);
        assert!((0..2).all(|end| (found[end] - known[end]).abs() < 1e-15), "{k}: {found:?}");
    }
    for (from, to, words) in [
        ("#box", "#none", "there is no <geometry> \"none\""),
        ("10 0 0", "10 0 x", "\"x\" is not a number"),
        ("<rotate>0 0 1 90", "<rotate>0 0 1", "3 numbers are given; 4 are needed"),
        ("0.01", "NaN", "\"NaN\" is not a number"),
        ("<translate>0 0 50</translate>", "<skew>1 2</skew>", "<skew> is not supported"),
        (
            "<node><translate>",
            "<node id='ring'><instance_node url='#ring'/><instance_node url='#ring'/><translate>",
            "more than 50 deep",
        ),
        ("</COLLADA>", "", "it is not XML"),
        ("COLLADA", "SCENE", "it is not a Collada file"),
    ] {
        let why = with(&dae.replace(from, to)).err().unwrap_or_default();
        assert!(why.contains(words) && why.contains("box.dae"), "{to}: {why}");
    }
}

/// Checks inconsistent masses. Of repeated elements the first counts. Missing masses, densities and
/// invalid inertias follow from the shapes. Each has a note.
#[test]
fn masses_that_are_not_given_follow_from_the_shapes() {
    let whole = "<box size='0.2 0.3 0.4'/>";
    let moments = |mass: f64| [0.25, 0.2, 0.13].map(|squares| mass * squares / 12.0);
    let of = |inertial: &str, name: &str| {
        let solid = shape(whole, "0.1 0 0");
        let parts = [
            link("world", 0.0, ""),
            format!("<link name='{name}'>{inertial}{solid}</link>"),
            joint("continuous", ["world", name], "0 0 0", "<axis xyz='0 1 0'/><axis xyz='1 0 0'/>"),
        ];
        robot(AIR, &format!("<robot name='r'>{}</robot>", parts.concat()))
    };
    let twice = "<inertial><mass value='3'/><inertia ixx='1' iyy='1' izz='1'/></inertial><inertial><mass value='9'/></inertial>";
    let scene = of(twice, "a");
    assert_eq!(scene.world.bodies()[0].mass(), 3.0);
    // One axis and one mass.
    assert!(
        said(&scene, "only the first of repeated elements in a link or joint is used: 2 are"),
        "{:?}",
        scene.notes()
    );
    for (inertial, mass, words) in [
        ("", 24.0, "1000 kg/m³: 1"),
        ("<inertial><density value='50'/></inertial>", 1.2, ""),
        (
            "<inertial><mass value='3'/><inertia ixx='0' iyy='0' izz='0'/></inertial>",
            3.0,
            "links with an invalid inertia get the inertia of their shapes",
        ),
        (
            "<inertial><origin xyz='0.1 0 0'/><mass value='3'/><inertia ixx='1' iyy='1' izz='0'/></inertial>",
            3.0,
            "links with an invalid inertia get the inertia of their shapes",
        ),
    ] {
        let scene = of(inertial, "a");
        let body = &scene.world.bodies()[0];
        assert!((body.mass() - mass).abs() < 1e-12, "{inertial}: {}", body.mass());
        for (found, known) in body.inertia().diagonal().iter().zip(moments(mass)) {
            assert!((found - known).abs() < 1e-12 * mass, "{inertial}: {found} {known}");
        }
        assert!(said(&scene, words), "{inertial}: {:?}", scene.notes());
    }
}

/// Checks an XML declaration after blanks, as some files have it. Line numbers stay correct.
#[test]
fn a_late_declaration_is_passed_over() {
    let urdf =
        format!("\n\n  <?xml version='1.0'\n ?>\n<robot name='r'>{}</robot>", link("a", 1.0, ""));
    assert_eq!(robot(AIR, &urdf).bodies.len(), 1);
    let why = scene(AIR, &[("robot.urdf", &urdf.replace("value='1'", "value='one'"))]).err();
    assert!(why.as_deref().is_some_and(|why| why.contains("line 5")), "{why:?}");
}

/// Checks that a flat mesh becomes a plate with a thickness of 1e-4 of its extent, with a note.
#[test]
fn a_flat_mesh_is_a_plate() {
    let flat = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\nf 1 3 4\n";
    let mesh = shape("<mesh filename='flat.obj'/>", "-0.5 -0.5 0");
    let urdf = format!("<robot name='r'>{}</robot>", link("a", 1.0, &mesh));
    let scene = scene(GROUND, &[("robot.urdf", &urdf), ("flat.obj", flat)]).unwrap();
    assert!(
        said(&scene, "flat.obj: it is flat and is thickened to 1.0e-4 m"),
        "{:?}",
        scene.notes()
    );
    let pieces = scene.world.bodies()[0].pieces();
    let heights =
        pieces.iter().flat_map(|piece| piece.core().vertices()).map(|corner| corner.z.abs());
    assert!(heights.into_iter().all(|height| (height - 5e-5).abs() < 1e-12));
    // A mesh that is slightly thicker is not changed.
    let thin = flat.replace("f 1 2 3", "v 0.5 0.5 1.5e-5\nf 1 2 3\nf 1 5 2");
    let scene = self::scene(GROUND, &[("robot.urdf", &urdf), ("flat.obj", &thin)]).unwrap();
    assert!(!said(&scene, "it is flat"), "{:?}", scene.notes());
}

/// Checks that shapes of size 0 are left out, with a note.
#[test]
fn shapes_of_size_0_are_left_out() {
    let body = |shapes: &str| format!("<robot name='r'>{}</robot>", link("body", 1.0, shapes));
    let own = shape("<box size='0.2 0.2 0.2'/>", "0 0 0.1");
    for empty in [
        "<box size='0 0 0'/>",
        "<box size='1 0 1'/>",
        "<sphere radius='0'/>",
        "<cylinder length='0' radius='0'/>",
        "<cylinder length='1' radius='0.0'/>",
        "<mesh filename='a.stl' scale='0 0 0'/>",
    ] {
        let scene = robot(GROUND, &body(&format!("{own}{}", shape(empty, "0 0 5"))));
        assert!(said(&scene, "shapes of size 0 are ignored: 1"), "{empty}: {:?}", scene.notes());
        assert_eq!(scene.world.bodies()[0].pieces().len(), 1);
        assert_eq!(scene.world, robot(GROUND, &body(&own)).world);
    }
    let why = scene(GROUND, &[("robot.urdf", &body(&shape("<sphere radius='-1'/>", "0 0 0")))]);
    assert!(why.err().unwrap_or_default().contains("radius is -1"));
}

/// Checks that a negative effort means no limit.
#[test]
fn an_effort_below_0_is_no_limit() {
    let arm = |effort: &str| {
        let limit = format!("<axis xyz='0 1 0'/><limit lower='-1' upper='1' {effort}/>");
        let parts = [
            link("base", 1.0, ""),
            link("arm", 1.0, ""),
            joint("revolute", ["base", "arm"], "0 0 0.2", &limit),
        ];
        format!("<robot name='r'>{}</robot>", parts.concat())
    };
    let given = robot(AIR, &arm("effort='-1'"));
    assert!(said(&given, "an effort below 0 means no limit"), "{:?}", given.notes());
    assert_eq!(given.robots[0].robot().joints[1].effort, None);
    assert_eq!(given.document.joints, robot(AIR, &arm("")).document.joints);
}

/// Checks frames of almost no mass, which count as frames without mass. A joint that moves only
/// such a frame is fixed. Notes say so.
#[test]
fn frames_of_almost_no_mass_are_frames() {
    let faint = |name: &str| {
        format!(
            "<link name='{name}'><inertial><mass value='1e-10'/><inertia ixx='1e-10' iyy='1e-10' izz='1e-10' ixy='0' \
             ixz='0' iyz='0'/></inertial></link>"
        )
    };
    let axis = "<axis xyz='0 1 0'/>";
    let tool = |link: &str, rest: &str| {
        let parts = [
            faint("footprint"),
            self::link("base", 1.0, ""),
            joint("fixed", ["footprint", "base"], "0 0 0.3", ""),
            self::link("arm", 1.0, ""),
            joint("continuous", ["base", "arm"], "0 0 0.2", axis),
            link.to_owned(),
            joint("continuous", ["arm", "tool"], "0.1 0 0", rest),
        ];
        format!("<robot name='r'>{}</robot>", parts.concat())
    };
    let made = robot(AIR, &tool(&faint("tool"), axis));
    let notes = made.notes();
    assert!(
        said(&made, "links of less than 1e-9 kg are treated as massless frames: 2"),
        "{notes:?}"
    );
    assert!(said(&made, "fixed where the file places them: tool_joint"), "{notes:?}");
    // The root is free, because something heavy is fixed to it.
    assert_eq!((made.bodies.len(), made.document.joints.len()), (2, 1));
    assert!(made.robots[0].robot().link("tool").is_some());
    after(&made, 10);
    // A lone root of almost no mass is fixed, and a frame between two joints is only a frame.
    let parts = [
        faint("base"),
        faint("wrist"),
        link("hand", 1.0, ""),
        joint("continuous", ["base", "wrist"], "0 0 0.2", axis),
        joint("continuous", ["wrist", "hand"], "0 0 0", "<axis xyz='1 0 0'/>"),
    ];
    let made = robot(AIR, &format!("<robot name='r'>{}</robot>", parts.concat()));
    assert!(said(&made, "base, the root link, has no mass and is fixed"), "{:?}", made.notes());
    assert_eq!((made.bodies.len(), made.document.joints.len()), (1, 1));
    // A mimic of a joint that is fixed is refused.
    let leads = "<axis xyz='0 1 0'/></joint><joint name='other' type='continuous'><parent link='arm'/><child link='more'/>\
        <axis xyz='0 1 0'/><mimic joint='tool_joint'/>";
    let text = tool(&format!("{}{}", faint("tool"), link("more", 1.0, "")), leads);
    let why = scene(AIR, &[("robot.urdf", &text)]).err().unwrap_or_default();
    assert!(why.contains("\"tool_joint\" moves less than 1e-9 kg and is fixed"), "{why}");
}

/// Checks a file of 15 MB with too many links. The time to read it is proportional to its length, some
/// seconds. A time proportional to the square would be many minutes.
#[test]
fn too_many_links_are_refused_at_once() {
    let space = " ".repeat(5000);
    let links = (0..3000).map(|k| {
        let shapes = shape("<box size='0.1 0.1 0.1'/>", "0 0 0").repeat(4);
        let own = link(&format!("link{k}"), 1.0, &shapes);
        let tie = ["parent", "child"].map(|end| {
            format!("<{end} link='link{}'/>", k - usize::from(end == "parent" && k > 0))
        });
        let tie = format!("<joint name='joint{k}' type='fixed'>{}</joint>{space}\n", tie.concat());
        if k == 0 { own } else { format!("{own}{tie}") }
    });
    let text = format!("<robot name='r'>{}</robot>", links.collect::<String>());
    let (sender, receiver) = channel();
    std::thread::spawn(move || {
        let why = scene(AIR, &[("robot.urdf", &text)]).err().unwrap_or_default();
        sender.send(why).unwrap();
    });
    let why =
        receiver.recv_timeout(Duration::from_secs(120)).expect("the file is still being read");
    assert!(
        why.contains("line 2000, <link> \"link2000\": there are more than 2000 links"),
        "{why}"
    );
}

/// Checks many overlapping bodies. Each pair is excluded from contact, and the work is proportional
/// to the number of pairs.
#[test]
fn many_bodies_in_one_place_are_kept_apart() {
    let allocations = [40, 80].map(|bodies| {
        let finger = |k: usize| {
            let own = link(&format!("finger{k}"), 0.1, &shape("<sphere radius='0.01'/>", "0 0 0"));
            let name = format!("finger{k}");
            own + &joint("continuous", ["palm", &name], "0 0 0.5", "<axis xyz='1 0 0'/>")
        };
        let fingers: String = (0..bodies).map(finger).collect();
        let text = format!("<robot name='r'>{}{fingers}</robot>", link("palm", 1.0, ""));
        let mut made = None;
        let seen = measure(|| made = Some(robot(AIR, &text)));
        let made = made.unwrap();
        assert_eq!(made.document.apart.len(), bodies * (bodies - 1) / 2);
        assert!(said(&made, "pairs that overlap at the start have no contacts"));
        seen.count_total
    });
    // Twice the bodies have four times the pairs.
    assert!(allocations[1] < 5 * allocations[0], "{allocations:?}");
}
