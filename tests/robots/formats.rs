//! Less common features of robot files: replicated elements, glTF meshes, long names, and joints as
//! in Bullet.

use std::io;
use std::path::Path;
use tumble_robot::model::{Moves, Robot, RobotForm};
use tumble_robot::{Reading, read};
use tumble_scene::scene::Scene;

fn robot_of(text: &str, files: &[(&str, &[u8])]) -> Result<Robot, String> {
    let read_file = |path: &Path, _: u64| {
        let found = files.iter().find(|(name, _)| Path::new(name) == path);
        found.map(|(_, bytes)| bytes.to_vec()).ok_or(io::ErrorKind::NotFound.into())
    };
    read(text, &Reading { read: &read_file, ..Reading::none() })
}

fn scene_of(text: &str) -> Result<Scene, String> {
    let read = |path: &Path, _: u64| std::fs::read(path);
    let name = if text.contains("<mujoco") { "given.xml" } else { "given.urdf" };
    Scene::from_text(text, Path::new(name), &[], &read).map_err(|failure| failure.to_string())
}

/// Checks that copies have numbers after their names, all with the same number of digits.
#[test]
fn replicated_elements_have_numbered_names() {
    let text = r#"<mujoco><worldbody><replicate count="11" offset="1 0 0" sep="-">
        <body name="ball"><freejoint name="flies"/><geom size="0.1"/></body>
        </replicate></worldbody></mujoco>"#;
    let robot = robot_of(text, &[]).unwrap();
    let names: Vec<_> = robot.links.iter().skip(1).map(|link| &*link.name).collect();
    assert_eq!((names.len(), names[0], names[10]), (11, "ball-00", "ball-10"));
    assert_eq!(robot.joints[3].name, "flies-03");
    assert_eq!(robot.links[10].frame.position, nalgebra::Vector3::new(9.0, 0.0, 0.0));
    for (count, why) in [("0", "count"), ("2.5", "a whole number"), ("1e9", "count")] {
        let text = text.replace("count=\"11\"", &format!("count=\"{count}\""));
        assert!(robot_of(&text, &[]).unwrap_err().contains(why), "{count}");
    }
    let nested = text.replace("<body", "<replicate count=\"60000\"><body");
    let nested = nested.replace("</body>", "</body></replicate>");
    assert!(robot_of(&nested, &[]).unwrap_err().contains("more than 200000 elements"));
}

/// An XML element with many attributes is refused at once, also after a `>` in a value and a comment.
#[test]
fn an_element_with_many_attributes_is_refused() {
    let many: String = (0..40_000).map(|k| format!(" a{k}='1'")).collect();
    let text = format!("<mujoco>\n<!-- <' -->\n<body note='a > b'{many}/></mujoco>");
    let why = robot_of(&text, &[]).unwrap_err();
    assert!(why.contains("line 3: an element has more than 1000 attributes"), "{why}");
}

/// The parser compares each name with all prefixes in scope. A prefix that is declared often is one.
#[test]
fn a_file_with_many_name_spaces_is_refused() {
    let declared = |count| (0..count).map(|k| format!(" xmlns:a{k}='u'")).collect::<String>();
    let body = "<worldbody xmlns:z='u'/>".repeat(1000);
    let text = |count| format!("<mujoco{}>\n{body}</mujoco>", declared(count));
    let why = robot_of(&text(101), &[]).unwrap_err();
    assert!(why.contains("line 1: the file has more than 100 XML name spaces"), "{why}");
    assert!(!robot_of(&text(90), &[]).err().unwrap_or_default().contains("name spaces"));
}

/// The marker of Gymnasium's pusher has 4e-10 kg. The rotors of its slides move it.
#[test]
fn a_body_below_the_least_mass_is_raised_to_it() {
    let text = r#"<mujoco><worldbody><body name="goal">
        <geom type="cylinder" size="0.08 0.001" density="0.00001" contype="0" conaffinity="0"/>
        <joint type="slide" axis="0 1 0" armature="0.04" damping="0.5"/>
        <joint type="slide" axis="1 0 0" armature="0.04" damping="0.5"/>
        <body name="pin"><inertial mass="1e-12" pos="0 0 0.1" diaginertia="1e-18 1e-18 1e-18"/></body>
        </body></worldbody></mujoco>"#;
    let robot = robot_of(text, &[]).unwrap();
    let mass: f64 = robot.links.iter().map(|link| link.mass.mass).sum();
    assert!((1e-9..1.000_001e-9).contains(&mass), "{mass}");
    let note = "bodies below 1e-9 kg have this mass: goal";
    assert!(robot.notes.iter().any(|known| known == note), "{:?}", robot.notes);
    let light = text.replace("0.00001", "0.0001");
    assert!(robot_of(&light, &[]).unwrap().notes.iter().all(|known| known != note));
}

/// glTF file of a tetrahedron. Its node translates and mirrors it, and the parent node rotates it
/// by 90° about z.
fn tetrahedron() -> Vec<u8> {
    let corners: [f32; 12] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 3.0];
    let triangles: [u16; 12] = [0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2];
    let mut data: Vec<u8> = corners.iter().flat_map(|number| number.to_le_bytes()).collect();
    data.extend(triangles.iter().flat_map(|number| number.to_le_bytes()));
    let mut json = r#"{"scene":0,"scenes":[{"nodes":[0]}],
        "nodes":[{"children":[1],"rotation":[0,0,0.7071067811865476,0.7071067811865476]},
                 {"mesh":0,"translation":[0.5,0,0],"scale":[-1,1,1]}],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],
        "accessors":[{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"},
                     {"bufferView":1,"componentType":5123,"count":12,"type":"SCALAR"}],
        "bufferViews":[{"buffer":0,"byteLength":48},{"buffer":0,"byteOffset":48,"byteLength":24}],
        "buffers":[{"byteLength":72}]}"#
        .as_bytes()
        .to_vec();
    json.resize(json.len().next_multiple_of(4), b' ');
    let word = |number: usize| u32::try_from(number).unwrap().to_le_bytes();
    let mut bytes = [*b"glTF", word(2), word(28 + json.len() + data.len())].concat();
    bytes.extend([word(json.len()), *b"JSON"].concat());
    bytes.extend(&json);
    bytes.extend([word(data.len()), *b"BIN\0"].concat());
    bytes.extend(&data);
    bytes
}

const WITH_MESH: &str = "<robot name='m'><link name='a'><inertial><density value='2'/></inertial>\
    <collision><geometry><mesh filename='a.glb'/></geometry></collision></link></robot>";

/// Checks the positions of the corners after the node transforms. The mass follows from the volume
/// ⅙ · 1 · 2 · 3.
#[test]
fn meshes_of_gltf_stand_where_their_nodes_are() {
    let bytes = tetrahedron();
    let robot = robot_of(WITH_MESH, &[("a.glb", &bytes)]).unwrap();
    let RobotForm::Hull(corners) = &robot.shapes[0].form else { panic!("{:?}", robot.shapes) };
    // (x, y, z) → (½ − x, y, z) → (−y, ½ − x, z).
    let expected = [[0.0, 0.5, 0.0], [0.0, -0.5, 0.0], [-2.0, 0.5, 0.0], [0.0, 0.5, 3.0]];
    assert_eq!(corners.len(), 4);
    for point in expected {
        let is_near =
            |corner: &[f64; 3]| corner.iter().zip(point).all(|(a, b)| (a - b).abs() < 1e-15);
        assert!(corners.iter().any(is_near), "{point:?} {corners:?}");
    }
    assert!((robot.links[1].mass.mass - 2.0).abs() < 1e-14, "{:?}", robot.links[1].mass);
}

/// Checks truncated files and files with a changed byte. They result in a mesh, or in an error that
/// names the file.
#[test]
fn invalid_gltf_files_are_rejected_with_a_message() {
    let bytes = tetrahedron();
    let try_one = |bytes: &[u8]| {
        if let Err(why) = robot_of(WITH_MESH, &[("a.glb", bytes)]) {
            assert!(why.contains("a.glb") && !why.contains('\n'), "{why}");
        }
    };
    for end in 0..bytes.len() {
        assert!(robot_of(WITH_MESH, &[("a.glb", &bytes[..end])]).is_err(), "{end}");
        try_one(&bytes[..end]);
    }
    for at in 0..bytes.len() {
        for byte in [0, b'9', b'-', b'"', 255] {
            let mut other = bytes.clone();
            other[at] = byte;
            try_one(&other);
        }
    }
    for (from, to, why) in [
        ("\"scene\"", "\"extensionsRequired\":[\"draco\"],\"scene\"", "draco"),
        ("\"indices\":1", "\"indices\":7", "there is no accessor 7"),
        ("\"indices\":1", "\"mode\":1,\"indices\":1", "only meshes of separate triangles"),
        ("[{\"nodes\":[0]}]", "[{\"nodes\":[3]}]", "there is no node 3"),
        ("\"children\":[1]", "\"children\":[0]", "nested more than"),
        ("\"count\":4", "\"count\":9", "beyond the end"),
    ] {
        let length =
            usize::try_from(u32::from_le_bytes(bytes[12..16].try_into().unwrap())).unwrap();
        let json = String::from_utf8(bytes[20..20 + length].to_vec()).unwrap();
        let changed = json.replace(from, to).into_bytes();
        let mut other = bytes[..12].to_vec();
        other.extend(u32::try_from(changed.len()).unwrap().to_le_bytes());
        other.extend(b"JSON");
        other.extend(&changed);
        other.extend(&bytes[20 + length..]);
        let found = robot_of(WITH_MESH, &[("a.glb", &other)]).err().unwrap_or_default();
        assert!(found.contains(why), "{why}: {found}");
    }
}

/// Checks that intermediate links with long names have distinct names.
#[test]
fn shortened_names_stay_distinct() {
    let joint = |name: &str, axis: &str, z: f64| {
        format!("<joint name='{name}_of_the_left_ankle_of_the_robot' axis='{axis}' pos='0 0 {z}'/>")
    };
    let text = format!(
        "<mujoco><worldbody><body name='a_foot_with_a_rather_long_name'>{}{}{}<geom size='0.1'/></body></worldbody></mujoco>",
        joint("pitch", "0 1 0", 0.0),
        joint("roll", "1 0 0.5", 0.1),
        joint("yaw", "0 0.1 1", 0.2),
    );
    let scene = scene_of(&text).unwrap();
    let mut names = scene.bodies.clone();
    names.sort();
    names.dedup();
    assert_eq!(names.len(), 3, "{:?}", scene.bodies);
    assert!(names.iter().all(|name| name.len() <= 40), "{names:?}");
}

/// Checks joints of URDF as Bullet reads them. A spherical joint is a ball joint. Limits with the
/// lower one above the upper are ignored, with a note. A link without mass has the mass of its
/// shapes.
#[test]
fn joints_of_urdf_are_read_as_bullet_has_them() {
    let link = |name: &str, inertial: &str| {
        format!(
            "<link name='{name}'>{inertial}<collision><geometry><sphere radius='0.1'/></geometry></collision></link>"
        )
    };
    let joint = |name: &str, kind: &str, child: &str, rest: &str| {
        format!(
            "<joint name='{name}' type='{kind}'><parent link='world'/><child link='{child}'/>{rest}</joint>"
        )
    };
    let text = ["<robot name='r'><link name='world'/>".to_owned()]
        .into_iter()
        .chain([
            link("a", "<inertial><inertia ixx='0' iyy='0' izz='0'/></inertial>"),
            link("b", "<inertial><mass value='1'/><inertia ixx='1' iyy='1' izz='1'/></inertial>"),
            joint("ball", "spherical", "a", "<dynamics damping='0.5'/>"),
            joint("slide", "prismatic", "b", "<limit lower='1' upper='-1'/>"),
            "</robot>".to_owned(),
        ])
        .collect::<String>();
    let robot = robot_of(&text, &[]).unwrap();
    let [ball, slide] = &robot.joints[..] else { panic!("{:?}", robot.joints) };
    assert_eq!((ball.moves, ball.damping), (Moves::Ball, 0.5));
    assert_eq!((slide.moves, slide.range), (Moves::Slide, None));
    assert!(
        robot.notes.iter().any(|note| note.contains("lower is above upper")),
        "{:?}",
        robot.notes
    );
    let mass = robot.links[ball.link].mass.mass;
    let expected = 1000.0 * 4.0 / 3.0 * std::f64::consts::PI * 1e-3;
    assert!((mass - expected).abs() < 1e-12 * expected, "{mass}");
}
