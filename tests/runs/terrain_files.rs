//! Terrain of scenario files and of MJCF, and its place in run.json.

use nalgebra::Vector3;
use std::io;
use std::path::Path;
use std::sync::Arc;
use tumble_core::geometry::terrain::{HeightField, TerrainShape};
use tumble_core::simulation::StepRecord;
use tumble_scene::scene::Scene;

const BALL: &str = "[ground]\nnone = true\nfriction = 0.5\n[[bodies]]\nsphere = 0.1\nmass = 1.0\n\
                    position = [0, 0, 6]\n";

/// A robot on a height field of 3 rows and 2 columns: 2 m × 4 m, 3 m high.
const MJCF: &str = r#"<mujoco><asset>
<hfield name="h" nrow="3" ncol="2" elevation="0 1 2 3 4 10" size="1 2 3 0.1"/></asset>
<worldbody><geom name="hill" type="hfield" hfield="h" pos="0 0 -5"/>
<body pos="0 0 3"><freejoint/><geom size="0.1"/></body></worldbody></mujoco>"#;

/// Two squares of 1 m beside each other, 1e-7 m apart.
const CRACKS: &str = "v -1 0 0\nv 0 0 0\nv 0 1 0\nv -1 1 0\nv 1e-7 0 0\nv 1 0 0\nv 1 1 0\n\
                      v 1e-7 1 0\nf 1 2 3\nf 1 3 4\nf 5 6 7\nf 5 7 8\n";

fn file(path: &Path, _: u64) -> io::Result<Vec<u8>> {
    let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
    match name {
        "a.csv" => Ok(b"0, 1\n2, 3\n4, 5\n".to_vec()),
        "robot.xml" => Ok(MJCF.as_bytes().to_vec()),
        "vast.xml" => Ok(MJCF
            .replace(
                "nrow=\"3\" ncol=\"2\" elevation=\"0 1 2 3 4 10\"",
                "nrow=\"9e5\" ncol=\"9e5\"",
            )
            .into_bytes()),
        "sheet.obj" => Ok(b"v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\nf 1 3 4\n".to_vec()),
        "odd.obj" => {
            Ok(b"v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\nf 3 1 4\nf 1 3 2\n".to_vec())
        }
        "cracks.obj" => Ok(CRACKS.as_bytes().to_vec()),
        _ => Err(io::ErrorKind::NotFound.into()),
    }
}

fn scene(table: &str) -> Result<Scene, String> {
    let text = format!("{BALL}{table}");
    let scene = Scene::from_text(&text, Path::new("scene.toml"), &[], &file);
    scene.map_err(|failure| failure.to_string())
}

fn field(scene: &Scene) -> &HeightField {
    match scene.world.terrain(0).unwrap().shape() {
        TerrainShape::Field(field) => field,
        TerrainShape::Mesh(_) => panic!("a mesh"),
    }
}

#[test]
fn heights_come_from_rows_and_files() {
    for heights in ["[[0, 1], [2, 3], [4, 5]]", "\"a.csv\""] {
        let table = format!(
            "[[terrain]]\nname = \"hill\"\nheights = {heights}\nspacing = [1, 2]\nscale = 0.5\n\
             position = [0, 0, -4]\n[[friction]]\nbetween = [\"hill\", \"body-0\"]\ncoefficient = 0.2\n"
        );
        let scene = scene(&table).unwrap();
        let points = [(0, 0), (2, 1)].map(|(row, column)| field(&scene).point(row, column));
        assert_eq!(points, [Vector3::new(-0.5, -2.0, -4.0), Vector3::new(0.5, 2.0, -1.5)]);
        assert_eq!(scene.fixed, ["hill"]);
        let hill = tumble_core::world::Partner::Fixed(0);
        assert_eq!(scene.world.friction_between(0, hill), 0.2);
    }
}

#[test]
fn run_json_has_the_whole_terrain() {
    for table in [
        "[[terrain]]\nheights = [[0.1, 0.2], [0.3, 1e-9]]\nspacing = 0.7\n\
         attitude = { axis = [1, 2, 3], degrees = 40 }\nposition = [0.3, 0, -5]\nfriction = 0.7\n",
        "[[terrain]]\nmesh = \"sheet.obj\"\nscale = 0.3\nposition = [0.1, 0, -5]\n",
    ] {
        let scene = scene(table).unwrap();
        let text = scene.model_text().unwrap();
        assert_eq!(scene.clone().with_text(&text).unwrap().world, scene.world);
        let odd =
            text.replace("packed = \"", "packed = \"!").replace("vertices = \"", "vertices = \"!");
        let why = scene.with_text(&odd).err().unwrap().to_string();
        assert!(why.contains("Base64"), "{why}");
    }
}

#[test]
fn faults_are_named_with_a_remedy() {
    for (table, wanted) in [
        ("heights = [[0, 1]]\nspacing = 1", "allowed: 2 × 2 or more"),
        ("heights = [[0, 1], [2]]\nspacing = 1", "all rows need the same number"),
        ("heights = [[0, nan], [2, 1]]\nspacing = 1", "finite numbers are needed"),
        ("heights = [[0, 1], [2, 1]]", "spacing: the distance of the heights (m) is needed"),
        ("heights = [[0, 1], [2, 1]]\nspacing = 0", "spacing"),
        ("heights = \"none.png\"\nspacing = 1", "none.png"),
        ("heights = \"a.tif\"\nspacing = 1", "heights: "),
        ("mesh = \"odd.obj\"", "split it so that an edge has at most two"),
        ("mesh = \"sheet.obj\"\nspacing = 1", "it has no meaning without `heights`"),
        (
            "surface = { vertices = [[0, 0, 0], [1, 0, 0], [2, 0, 0]], triangles = [[0, 1, 2]] }",
            "without area; remove it",
        ),
        ("", "one of heights, mesh and surface is needed"),
    ] {
        let why = scene(&format!("[[terrain]]\n{table}\n")).map(|_| ()).unwrap_err();
        assert!(why.contains(wanted) && why.contains("terrain[0]"), "{table}: {why}");
    }
}

/// Numbers of MuJoCo 3: heights are scaled to 0…1, and the first row is the farthest.
#[test]
fn a_height_field_of_mjcf_has_its_place() {
    let scene = scene("[[robots]]\nfile = \"robot.xml\"\n").unwrap();
    let field = field(&scene);
    let wanted = [(0, 0, [-1.0, -2.0, 1.2]), (0, 1, [1.0, -2.0, 3.0]), (2, 1, [1.0, 2.0, 0.3])];
    for (row, column, [x, y, z]) in wanted {
        let found = field.point(row, column);
        assert!((found - Vector3::new(x, y, z - 5.0)).amax() < 1e-12, "{row} {column}: {found}");
    }
    assert_eq!(scene.fixed, ["hill"]);
}

/// The number of heights is checked before memory is reserved for them.
#[test]
fn a_vast_height_field_of_mjcf_is_refused() {
    let why = scene("[[robots]]\nfile = \"vast.xml\"\n").map(|_| ()).unwrap_err();
    assert!(
        why.contains("nrow and ncol: 900000 rows of 900000 heights are more than 10000000"),
        "{why}"
    );
}

/// A box slides over the joint of two squares of a mesh whose vertices differ by 1e-7 m.
#[test]
fn nearly_equal_vertices_of_a_file_are_one() {
    let sliding = |mesh: &str| {
        let text = format!(
            "steps = 300\n[ground]\nnone = true\nfriction = 0.0\n[[bodies]]\nbox = [0.2, 0.2, 0.1]\n\
             mass = 1.0\nposition = [-0.5, 0.5, 0.05]\nvelocity = [1.5, 0, 0]\n[[terrain]]\n\
             name = \"floor\"\nmesh = \"{mesh}\"\n"
        );
        let scene = Scene::from_text(&text, Path::new("s.toml"), &[], &file).unwrap();
        let mut simulation = scene.simulation(&Arc::default()).unwrap();
        let mut record = StepRecord::new();
        (0..300).for_each(|_| simulation.step(&mut record).unwrap());
        (scene.notes(), *simulation.state())
    };
    let (notes, end) = sliding("cracks.obj");
    assert!(
        notes.iter().any(|note| note.contains("floor: 2 vertices on borders are joined")),
        "{notes:?}"
    );
    assert!((end.position - Vector3::new(0.4, 0.5, 0.05)).amax() < 1e-9, "{end:?}");
    assert!(end.spin.amax() < 1e-9 && (end.velocity.x - 1.5).abs() < 1e-9, "{end:?}");
}
