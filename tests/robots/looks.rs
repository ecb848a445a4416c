//! Visual meshes of robots, which do not change the motion.

use nalgebra::Vector3;
use std::io;
use std::path::Path;
use tumble_core::geometry::Hull;
use tumble_core::geometry::Piece as Solid;
use tumble_core::simulation::{Motion, Simulation, StepRecord};
use tumble_robot::model::RobotLook;
use tumble_robot::{Reading, read};
use tumble_scene::output::tables::IntervalRows;
use tumble_scene::scene::Scene;
use tumble_scene::written;
use tumble_view::{Film, Mesh, Shape};

/// Corners of an L made of three unit squares.
const CORNERS: [[f64; 2]; 6] =
    [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]];

/// OBJ file of a prism over the L, 1 m high. Its volume is 3 m³, and its hull has 3.5 m³.
fn prism() -> String {
    let heights = [0.0, 1.0];
    let corners = heights.iter().flat_map(|z| CORNERS.map(|[x, y]| format!("v {x} {y} {z}\n")));
    let ends = (1..5).map(|k| format!("f 7 {} {}\nf 1 {} {}\n", k + 7, k + 8, k + 2, k + 1));
    let sides = (0..6).map(|k| {
        let next = (k + 1) % 6;
        format!("f {} {} {} {}\n", k + 1, next + 1, next + 7, k + 7)
    });
    corners.chain(ends).chain(sides).collect()
}

/// OBJ file with `count` triangles in a fan.
fn fan(count: usize) -> String {
    let corners = (0..count + 2).map(|k| format!("v {} {} 0.1\n", k, k * k));
    corners.chain((0..count).map(|k| format!("f 1 {} {}\n", k + 2, k + 3))).collect()
}

fn files(path: &Path, _: u64) -> io::Result<Vec<u8>> {
    match path.to_str() {
        Some("robots/prism.obj") => Ok(prism().into_bytes()),
        Some("robots/large.obj") => Ok(fan(20_001).into_bytes()),
        Some("robots/half.obj") => Ok(fan(10_001).into_bytes()),
        Some("robots/points.dae") => Ok(b"<COLLADA/>".to_vec()),
        _ => Err(io::Error::new(io::ErrorKind::NotFound, "it is not there")),
    }
}

fn scene_of(text: &str) -> Scene {
    Scene::from_text(text, Path::new("robots/robot.xml"), &[], &files).unwrap()
}

/// Film of a scene's start.
fn film_of(scene: &Scene) -> Film {
    let (world, starts) = (scene.world.clone(), scene.starts.clone());
    let simulation = Simulation::new(world, starts, Motion::Floating).unwrap();
    let mut end = StepRecord::new();
    simulation.end(&mut end);
    let frames = IntervalRows::from_step(&scene.world, &end);
    Film::new(&scene.world, &scene.document, false, frames).unwrap()
}

fn mesh(shape: &Shape) -> &Mesh {
    let Shape::Mesh(mesh) = shape else { panic!("a mesh is drawn: {shape:?}") };
    mesh
}

/// Radius of a ball.
fn radius_of(shape: &Shape) -> Option<f64> {
    match shape {
        Shape::Convex { core, radius, .. } if core.vertices().len() == 1 => Some(*radius),
        _ => None,
    }
}

/// Enclosed volume of triangles that are counter-clockwise seen from outside. It is negative for
/// inverted triangles.
fn volume(mesh: &Mesh) -> f64 {
    let tetrahedron = |triangle: &[usize; 3]| {
        let [a, b, c] = triangle.map(|corner| mesh.vertices[corner]);
        a.cross(&b).dot(&c) / 6.0
    };
    mesh.triangles.iter().map(tetrahedron).sum()
}

const LINK: &str = r#"<inertial><origin xyz="0.3 0 0"/><mass value="2"/>
  <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
  <collision><geometry><box size="2 2 1"/></geometry></collision>"#;

/// URDF file with one link and these visuals.
fn one(visuals: &str) -> String {
    format!("<robot name=\"one\"><link name=\"trunk\">{LINK}{visuals}</link></robot>")
}

/// Checks that a visual mesh is drawn at its place, with its outside outside even when mirrored.
/// The collision shape is the box.
#[test]
fn a_link_looks_like_its_visual_mesh_and_touches_as_its_shapes() {
    let visual = r#"<visual><origin xyz="0 0 0.5" rpy="0 0 1.5707963267948966"/>
      <geometry><mesh filename="prism.obj" scale="-1 1 2"/></geometry></visual>"#;
    let scene = scene_of(&one(visual));
    let film = film_of(&scene);
    let [piece] = &film.bodies[0].shapes[..] else { panic!("one piece is drawn") };
    let drawn = mesh(piece);
    assert_eq!((drawn.vertices.len(), drawn.triangles.len()), (12, 20));
    assert!((volume(drawn) - 6.0).abs() < 1e-12, "{}", volume(drawn));
    // (x, y, z) becomes (−x, y, 2 z), is rotated by 90° to (−y, −x, 2 z), and translated. The
    // centre of mass is at x = 0.3.
    for ([x, y], z) in CORNERS.iter().flat_map(|corner| [(corner, 0.0), (corner, 1.0)]) {
        let expected = Vector3::new(-y - 0.3, -x, 2.0 * z + 0.5);
        let apart = |vertex: &Vector3<f64>| (vertex - expected).norm();
        let nearest = drawn.vertices.iter().map(apart).fold(f64::INFINITY, f64::min);
        assert!(nearest < 1e-15, "{nearest}");
    }
    let plain = scene_of(&one(""));
    assert!(plain.document.bodies.iter().all(|body| body.look.is_none()));
    let pieces = |scene: &Scene| scene.world.bodies()[0].pieces().to_vec();
    assert_eq!(pieces(&scene), pieces(&plain));
    assert_eq!(pieces(&scene)[0].core().vertices().len(), 8);
    assert!(matches!(pieces(&scene)[0], Solid { .. }));
}

/// Checks that run.json contains the appearance, and that an unknown body is named in the error.
#[test]
fn looks_are_read_back() {
    let visuals = r#"<visual><geometry><mesh filename="prism.obj"/></geometry></visual>
      <visual><origin xyz="0 0 2"/><geometry><sphere radius="0.5"/></geometry></visual>"#;
    let scene = scene_of(&one(visuals));
    let text = scene.model_text().unwrap();
    let again = scene.clone().with_text(&text).unwrap();
    let (film, again) = (film_of(&scene), film_of(&again));
    assert_eq!(film.bodies, again.bodies);
    let core = Hull::point(Vector3::new(-0.3, 0.0, 2.0)).unwrap();
    let ball = Shape::Convex { core, radius: 0.5, name: None };
    assert_eq!(film.bodies[0].shapes[1], ball);
    let odd = text.replacen("look = ", "look = \"nobody\" # ", 1);
    let why = scene.with_text(&odd).err().unwrap().to_string();
    assert_eq!(why, "bodies[0].look: \"nobody\" is not a body before this one");
}

/// Checks that a converted scenario contains the appearance. Invalid surfaces are refused by name.
#[test]
fn looks_are_written_down() {
    let visuals = r#"<visual><origin xyz="0 0.1 0" rpy="0.3 0 1"/><geometry><mesh filename="prism.obj"/></geometry></visual>
      <visual><origin xyz="0 0 2"/><geometry><sphere radius="0.5"/></geometry></visual>"#;
    let scene = scene_of(&one(visuals));
    let text = written::text(&scene).unwrap();
    let read = |text: &str| Scene::from_text(text, Path::new("robots/robot.toml"), &[], &files);
    let again = read(&text).unwrap();
    let films = [&scene, &again].map(film_of);
    assert_eq!(films[0].bodies[0].shapes, films[1].bodies[0].shapes);
    assert_eq!(written::text(&again).unwrap(), text);
    for (from, to, said) in [
        (
            "triangles = [[0,",
            "triangles = [[99,",
            "look[0].surface.triangles: vertex 99 does not exist",
        ),
        ("vertices = [[0.0", "vertices = [[1e9", "look[0].surface.vertices"),
        ("sphere = 0.5", "radius = 0.5", "look[1]"),
    ] {
        let odd = text.replacen(from, to, 1);
        assert_ne!(odd, text, "{from}");
        let why = read(&odd).err().map(|failure| failure.to_string()).unwrap_or_default();
        assert!(why.contains(said), "{why}");
    }
}

/// Checks that an appearance needs a part, and that the total number of triangles is limited.
#[test]
fn looks_are_bounded() {
    let read = |count: usize, look: &str| {
        let text = format!(
            "[ground]\nfriction = 0.5\n[[bodies]]\nbox = 0.1\nmass = 1.0\nposition = [0, 0, 1]\nlook = [{look}]\n\
             copies = {{ count = [{count}, 1, 1], step = [1, 1, 1] }}\n"
        );
        let path = Path::new("robots/robot.toml");
        let scene = Scene::from_text(&text, path, &[], &files);
        scene.map(|scene| scene.bodies.len()).map_err(|failure| failure.to_string())
    };
    let why = read(1, "").unwrap_err();
    assert!(why.contains("bodies[0].look: at least one part is needed"), "{why}");
    let surface = format!(
        "{{ surface = {{ vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0]], triangles = [{}] }} }}",
        "[0, 1, 2],".repeat(100_000)
    );
    assert_eq!(read(20, &surface), Ok(20));
    let why = read(21, &surface).unwrap_err();
    assert!(why.contains("look: all bodies together have 2100000 triangles"), "{why}");
}

/// Checks unreadable visual meshes. The body is drawn by its collision shapes, and a note says so.
#[test]
fn unreadable_meshes_are_reported_and_shapes_drawn() {
    let mesh =
        |file: &str| format!("<visual><geometry><mesh filename=\"{file}\"/></geometry></visual>");
    for (file, why) in [
        ("points.dae", "it shows no triangles"),
        ("trunk.fbx", "only .stl, .obj, .msh, .glb and .dae are supported"),
        ("away.stl", "it is not there"),
    ] {
        let text = one(&format!("{}{}", mesh("prism.obj"), mesh(file)));
        let scene = scene_of(&text);
        let film = film_of(&scene);
        let [Shape::Convex { core, .. }] = &film.bodies[0].shapes[..] else {
            panic!("the box is drawn")
        };
        assert_eq!(core.vertices().len(), 8);
        let notes: Vec<_> = scene.notes().into_iter().filter(|note| note.contains(why)).collect();
        assert_eq!(notes.len(), 1, "{file}: {:?}", scene.notes());
        assert!(
            notes[0]
                .contains("a link is drawn with collision shapes instead of visual meshes: line")
        );
    }
}

/// Checks that meshes have the colour of their shape, or else of its material, in both formats. The
/// colour survives a written scenario.
#[test]
fn meshes_have_the_colours_of_their_file() {
    let visual = |material: &str| {
        format!("<visual><geometry><mesh filename=\"prism.obj\"/></geometry>{material}</visual>")
    };
    let steel = r#"<material name="steel"><color rgba="0.2 0.4 0.6 1"/></material>"#;
    let urdf =
        |material: &str| one(&visual(material)).replace("</robot>", &format!("{steel}</robot>"));
    let mjcf = |attributes: &str| {
        format!(
            r#"<mujoco><asset><mesh name="prism" file="prism.obj"/>
              <material name="steel" rgba="0.2 0.4 0.6 1"/></asset><worldbody><body><freejoint/>
              <geom size="0.1"/><geom type="mesh" mesh="prism" contype="0" conaffinity="0" mass="0"
              {attributes}/></body></worldbody></mujoco>"#
        )
    };
    let (blue, red) = (Some([51, 102, 153]), Some([255, 0, 0]));
    for (text, colour) in [
        (urdf(""), None),
        (urdf(r#"<material name="steel"/>"#), blue),
        (urdf(r#"<material name="own"><color rgba="1 0 0 1"/></material>"#), red),
        (urdf(r#"<material name="unknown"/>"#), None),
        (mjcf(""), None),
        (mjcf(r#"material="steel""#), blue),
        (mjcf(r#"material="steel" rgba="1 0 0 1""#), red),
    ] {
        let scene = scene_of(&text);
        let film = film_of(&scene);
        assert_eq!(mesh(&film.bodies[0].shapes[0]).colour, colour, "{text}");
        let written = written::text(&scene).unwrap();
        let again = Path::new("robots/robot.toml");
        let again = Scene::from_text(&written, again, &[], &files).unwrap();
        let film = film_of(&again);
        assert_eq!(mesh(&film.bodies[0].shapes[0]).colour, colour, "{written}");
    }
}

/// Checks that the limit of triangles is shared among the links of a robot, with a note.
#[test]
fn large_meshes_are_drawn_coarser() {
    let mesh =
        |file: &str| format!("<visual><geometry><mesh filename=\"{file}\"/></geometry></visual>");
    let half = mesh("half.obj");
    let text = format!(
        "<robot name=\"two\"><link name=\"a\">{LINK}{half}</link><link name=\"b\">{LINK}{half}</link>\
         <joint name=\"j\" type=\"continuous\"><parent link=\"a\"/><child link=\"b\"/></joint></robot>"
    );
    let reading = Reading { folder: Path::new("robots"), read: &files, ..Reading::none() };
    let robot = read(&text, &reading).unwrap();
    assert_eq!(robot.looks.iter().map(|look| look.link).collect::<Vec<_>>(), [1, 2]);
    let counts: Vec<_> = robot.looks.iter().map(RobotLook::triangles).collect();
    assert!(counts.iter().all(|count| (5000..=10_000).contains(count)), "{counts:?}");
    let said = format!(
        "visual meshes are simplified: {} triangles instead of 20002",
        counts[0] + counts[1]
    );
    assert!(robot.notes.iter().any(|note| note.contains(&said)), "{said}: {:?}", robot.notes);
    let large = read(&one(&mesh("large.obj")), &reading).unwrap();
    let count = large.looks[0].triangles();
    assert!((10_000..=20_000).contains(&count), "{count}");
    // Small meshes are not reduced.
    let small = read(&one(&mesh("prism.obj")), &reading).unwrap();
    assert_eq!(small.looks[0].triangles(), 20);
    assert!(!small.notes.iter().any(|note| note.contains("coarser")), "{:?}", small.notes);
}

/// Checks MJCF: a mesh without contacts is the appearance of its link, with the other shapes
/// without contacts. A link without such a mesh is drawn by its collision shapes.
#[test]
fn a_body_looks_like_its_mesh_that_touches_nothing() {
    let text = r#"<mujoco><asset><mesh name="prism" file="prism.obj" scale="0.1 0.1 0.1"/></asset><worldbody>
      <body name="a"><freejoint/><geom type="box" size="0.1 0.1 0.1"/>
        <geom type="mesh" mesh="prism" contype="0" conaffinity="0" mass="0" pos="0 0 0.2"/>
        <geom size="0.02" contype="0" conaffinity="0" mass="0"/></body>
      <body name="b" pos="1 0 0"><freejoint/><geom size="0.1"/>
        <geom size="0.02" contype="0" conaffinity="0" mass="0"/></body>
      </worldbody></mujoco>"#;
    let scene = scene_of(text);
    let film = film_of(&scene);
    let [drawn, ball] = &film.bodies[0].shapes[..] else {
        panic!("a mesh and a ball are drawn: {:?}", film.bodies[0].shapes)
    };
    assert_eq!(radius_of(ball), Some(0.02));
    assert!((volume(mesh(drawn)) - 0.003).abs() < 1e-15);
    let centre = scene.document.bodies[0].centre();
    let lowest = mesh(drawn).vertices.iter().map(|v| v.z + centre.z).fold(f64::INFINITY, f64::min);
    assert!((lowest - 0.2).abs() < 1e-15);
    assert_eq!(film.bodies[1].shapes.iter().map(radius_of).collect::<Vec<_>>(), [Some(0.1)]);
}
