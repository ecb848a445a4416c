//! Pages with large meshes.

use super::driver::Browser;
use super::pages::Pages;
use crate::pile;
use nalgebra::Vector3;
use std::fs;
use std::io::Write as _;
use std::path::Path;
use tumble_core::geometry::Piece;
use tumble_view::{Mesh, Shape};

/// Number of meshes in a scene.
const MESHES: usize = 10;
/// Number of quadrilaterals along a meridian and around the axis of a mesh.
const RINGS: usize = 100;
/// Number of triangles of a mesh.
const TRIANGLES: usize = 2 * RINGS * RINGS;
/// Index of the first of ten flying bodies of the film.
const FLYING: usize = 75;
/// Largest number of triangles of all links of a robot in its page.
const MOST_DRAWN: usize = 20_000;
/// Largest size of a page with that number of triangles [bytes].
const LARGEST_PAGE: u64 = 5 << 20;

/// Torus of diameter 0.36 m with `bumps` bumps around it.
fn torus(bumps: usize) -> Mesh {
    let turn = |k: usize| (k % RINGS) as f64 / RINGS as f64 * std::f64::consts::TAU;
    let vertex = |i: usize| {
        let (around, across) = (turn(i / RINGS), turn(i % RINGS));
        let thick = 0.05 + 0.01 * (bumps as f64 * around).cos();
        let far = 0.12 + thick * across.cos();
        Vector3::new(far * around.cos(), far * around.sin(), thick * across.sin())
    };
    let place = |around: usize, across: usize| around % RINGS * RINGS + across % RINGS;
    let triangles = (0..RINGS * RINGS).flat_map(|i| {
        let (k, l) = (i / RINGS, i % RINGS);
        let [a, b, c, d] = [place(k, l), place(k + 1, l), place(k + 1, l + 1), place(k, l + 1)];
        [[a, b, c], [a, c, d]]
    });
    Mesh {
        vertices: (0..RINGS * RINGS).map(vertex).collect(),
        triangles: triangles.collect(),
        colour: None,
    }
}

/// Writes a mesh as binary STL.
fn write_stl(path: &Path, mesh: &Mesh) {
    let mut bytes = vec![0; 80];
    bytes.extend((mesh.triangles.len() as u32).to_le_bytes());
    for triangle in &mesh.triangles {
        // Readers compute a normal that is 0.
        bytes.extend([0; 12]);
        for corner in triangle.map(|corner| mesh.vertices[corner]) {
            corner.iter().for_each(|x| bytes.extend((*x as f32).to_le_bytes()));
        }
        bytes.extend([0; 2]);
    }
    fs::write(path, bytes).unwrap();
}

/// Writes a URDF of a trunk with hinged links. Each has its own visual mesh and a small collision
/// sphere.
fn write_robot(directory: &Path) -> std::path::PathBuf {
    let path = directory.join("robot.urdf");
    let mut file = fs::File::create(&path).unwrap();
    writeln!(file, "<robot name=\"rings\">").unwrap();
    for k in 0..MESHES {
        write_stl(&directory.join(format!("ring-{k}.stl")), &torus(3 + k));
        writeln!(
            file,
            "<link name=\"ring-{k}\"><inertial><mass value=\"1\"/>
               <inertia ixx=\"0.01\" iyy=\"0.01\" izz=\"0.01\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial>
               <visual><geometry><mesh filename=\"ring-{k}.stl\"/></geometry>
                 <material name=\"copper\"><color rgba=\"0.8 0.4 0.2 1\"/></material></visual>
               <collision><geometry><sphere radius=\"0.05\"/></geometry></collision></link>"
        )
        .unwrap();
        if k > 0 {
            let (x, y) = (0.4 * (k % 5) as f64, 0.4 * (k / 5) as f64);
            writeln!(
                file,
                "<joint name=\"hinge-{k}\" type=\"continuous\"><parent link=\"ring-0\"/>
                   <child link=\"ring-{k}\"/><origin xyz=\"{x} {y} 0\"/><axis xyz=\"1 0 0\"/></joint>"
            )
            .unwrap();
        }
    }
    writeln!(file, "</robot>").unwrap();
    path
}

/// Number of triangles of each body in the open page.
fn triangles_drawn(browser: &Browser) -> Vec<usize> {
    let counts = browser.run(
        "const { runs } = JSON.parse(document.getElementById('data').textContent); \
         return runs[0].bodies.map(({ pieces }) => \
           pieces.reduce((sum, piece) => sum + (piece.mesh ? piece.mesh.triangles.count / 3 : 0), 0))",
    );
    counts.as_array().unwrap().iter().map(|count| count.as_u64().unwrap() as usize).collect()
}

/// Share of coloured pixels in the first view. Bodies are coloured and the ground is grey.
fn coloured_share(browser: &Browser) -> f64 {
    let share = browser.run(
        "const canvas = document.querySelector('.stage canvas'); \
         const { width, height } = canvas; \
         const copy = Object.assign(document.createElement('canvas'), { width, height }); \
         const context = copy.getContext('2d', { willReadFrequently: true }); \
         context.drawImage(canvas, 0, 0); \
         const { data } = context.getImageData(0, 0, width, height); \
         let coloured = 0; \
         for (let i = 0; i < data.length; i += 4) { \
           const [low, high] = [Math.min(data[i], data[i + 1], data[i + 2]), \
                                Math.max(data[i], data[i + 1], data[i + 2])]; \
           if (high - low > 50) coloured += 1; \
         } \
         return coloured / (width * height)",
    );
    share.as_f64().unwrap()
}

/// The links of a robot share the triangle budget of the page. Each link is drawn as a simplified
/// mesh.
#[test]
#[ignore = "a browser"]
fn robot_meshes_are_simplified_to_the_triangle_budget() {
    let pages = Pages::new();
    let robot = write_robot(pages.path("robot.urdf").parent().unwrap());
    let page = pages.simulate("rings", &[robot.to_str().unwrap(), "--steps", "50"], 0);
    let browser = Browser::start(1280, 800);
    browser.open(&page);
    browser.screenshot("meshes-robot");
    browser.assert_quiet();
    let share = coloured_share(&browser);
    assert!(share > 0.03, "{share} of the picture is of bodies");
    let drawn = triangles_drawn(&browser);
    assert_eq!(drawn.len(), MESHES);
    assert!(drawn.iter().sum::<usize>() <= MOST_DRAWN, "{drawn:?}");
    assert!(drawn.iter().all(|count| *count > MOST_DRAWN / MESHES / 2), "{drawn:?}");
    let size = fs::metadata(&page).unwrap().len();
    assert!(size < LARGEST_PAGE, "{size} bytes");
}

/// The page accepts meshes of any size and draws all their triangles.
#[test]
#[ignore = "a browser"]
fn page_draws_every_triangle_of_large_meshes() {
    let pages = Pages::new();
    let mut film = pile::film(20);
    // All other bodies are too small to be visible.
    for body in &mut film.bodies {
        body.shapes = vec![Shape::from(&Piece::sphere(0.005).unwrap())];
    }
    for (k, body) in film.bodies[FLYING..FLYING + MESHES].iter_mut().enumerate() {
        body.shapes = vec![Shape::Mesh(torus(3 + k))];
    }
    let path = pages.path("meshes.html");
    fs::write(&path, tumble_view::view::page("0", &[&film]).unwrap()).unwrap();
    let browser = Browser::start(1280, 800);
    browser.open(&path);
    browser.screenshot("meshes-page");
    browser.assert_quiet();
    let share = coloured_share(&browser);
    assert!(share > 0.005, "{share} of the picture is of bodies");
    assert_eq!(triangles_drawn(&browser)[FLYING..FLYING + MESHES], [TRIANGLES; MESHES]);
    // The plots of all bodies and the view at the end are drawn too.
    browser.run("document.querySelectorAll('details').forEach((plot) => { plot.open = true })");
    browser.press(super::END, None);
    browser.press("r", None);
    browser.assert_quiet();
}
