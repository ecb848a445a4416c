//! Links held by the world, and links merged into others: their names and their contacts.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use tumble_core::simulation::StepRecord;
use tumble_core::world::Partner;
use tumble_scene::scene::Scene;

/// A base of two boxes on the world, and an arm with a palm fixed to it.
const ARM: &str = "<robot name='arm'><link name='base'>\
    <collision><origin xyz='0 0 0.1'/><geometry><box size='0.4 0.4 0.2'/></geometry></collision>\
    <collision><origin xyz='1 0 0.1'/><geometry><box size='0.4 0.4 0.2'/></geometry></collision></link>\
    <link name='fore'><inertial><mass value='1'/>\
    <inertia ixx='0.1' iyy='0.1' izz='0.1' ixy='0' ixz='0' iyz='0'/></inertial></link>\
    <link name='palm'/>\
    <joint name='lift' type='prismatic'><parent link='base'/><child link='fore'/><origin xyz='0 3 1'/>\
    <axis xyz='0 0 1'/><limit lower='0' upper='1' effort='9' velocity='1'/></joint>\
    <joint name='wrist' type='fixed'><parent link='fore'/><child link='palm'/></joint></robot>";

/// The arm with a parcel upon its base, 0.5 kg, and further tables.
fn scene_with(tables: &str) -> Result<Scene, String> {
    let text = format!(
        "[ground]\nfriction = 0.5\n[[bodies]]\nname = \"parcel\"\nbox = 0.1\nmass = 0.5\n\
         position = [1.0, 0.0, 0.25]\n[[robots]]\nfile = \"arm.urdf\"\nprefix = \"arm.\"\nfixed = true\n{tables}"
    );
    let read = |_: &Path, _: u64| Ok(ARM.as_bytes().to_vec());
    let scene = Scene::from_text(&text, Path::new("held.toml"), &[], &read);
    scene.map_err(|failure| failure.to_string())
}

#[test]
fn pieces_of_a_held_link_have_its_name() {
    let scene = scene_with("").unwrap();
    assert_eq!(scene.fixed, ["arm.base", "arm.base-1"]);
    let robot = &scene.robots[0];
    let link = |name: &str| robot.robot().link(name).unwrap();
    assert_eq!(robot.pieces(link("base")), [0, 1]);
    assert!(robot.pieces(link("fore")).is_empty());
}

#[test]
fn a_pair_with_a_held_link_has_all_its_pieces() {
    let pair = "[[friction]]\nbetween = [\"parcel\", \"arm.base\"]\ncoefficient = 0.9\n";
    let frictions = scene_with(pair).unwrap().document.friction.unwrap();
    assert_eq!(frictions.len(), 2);
    assert!(frictions.iter().all(|pair| pair.coefficient == 0.9));
    let merged = scene_with(&pair.replace("arm.base", "arm.palm")).err().unwrap();
    let said = "between: arm.palm is merged into arm.fore; use that, or `merge_fixed = false`";
    assert!(merged.contains(said), "{merged}");
}

#[test]
fn a_held_link_feels_the_weight_upon_it() {
    let scene = scene_with("").unwrap();
    let mut simulation = scene.simulation(&Arc::new(AtomicBool::new(false))).unwrap();
    let mut record = StepRecord::new();
    for _ in 0..20 {
        simulation.step(&mut record).unwrap();
    }
    let robot = &scene.robots[0];
    let link = |name: &str| robot.robot().link(name).unwrap();
    let felt = |link, partner| robot.touch(&record, link, partner, None).unwrap();
    // The weight is carried to the solver's accuracy.
    let weight = 0.5 * 9.81;
    assert!((felt(link("base"), None) - weight).abs() < 1e-6 * weight);
    assert!((felt(link("base"), Some(Partner::Body(0))) - weight).abs() < 1e-6 * weight);
    assert_eq!(felt(link("fore"), None), 0.0);
}

#[test]
fn coordinates_beyond_the_limits_are_refused() {
    let said = "coordinates: \"lift\" would start at 1.5, outside its range 0.0 to 1.0; give a coordinate within it";
    let why = scene_with("coordinates = { lift = 1.5 }\n").err().unwrap();
    assert!(why.contains(said), "{why}");
    let scene = scene_with("coordinates = { lift = 1.0 }\n").unwrap();
    assert_eq!(scene.robots[0].start(), [1.0]);
    let why = scene_with("coordinates = { lfit = 0.5 }\n").err().unwrap();
    assert!(why.contains("did you mean `lift`?"), "{why}");
}
