//! Sensors on links, compared with closed forms.

use super::moving::{scene_of, simulation, step};
use nalgebra::{Vector3, Vector4};
use tumble_core::simulation::{Simulation, StepRecord};
use tumble_core::world::Partner;
use tumble_robot::LinkFrame;
use tumble_robot::sensors::RobotSite;

/// Readings of an accelerometer and a gyroscope in a step.
fn read(
    scene: &tumble_scene::scene::Scene,
    record: &StepRecord,
    site: &RobotSite,
) -> [Vector3<f64>; 2] {
    let robot = &scene.robots[0];
    let links =
        [record.states(), record.next_states()].map(|states| robot.links_at(states).unwrap());
    let h = scene.world.time_step();
    let read = site.accelerometer([&links[0], &links[1]], h, scene.world.gravity()).unwrap();
    [read, site.gyroscope(&links[1]).unwrap()]
}

/// Checks an arm that rotates with ω about z. The accelerometer reads ω² r inwards and the reaction
/// to gravity, the gyroscope ω along z. Both are in the rotated frame of the site.
#[test]
fn an_arm_that_turns() {
    let (h, omega, r) = (1e-4, 3.0, 0.8);
    let text = r#"<mujoco><option gravity="0 0 -10"/><worldbody><body name="arm" pos="0 0 5"><joint axis="0 0 1"/>
        <geom type="capsule" size="0.05" fromto="0 0 0 1 0 0" mass="1"/></body></worldbody></mujoco>"#;
    let scene = scene_of(text, Some(h)).unwrap();
    let mut simulation: Simulation<'_> = simulation(&scene);
    let mut states = simulation.states().to_vec();
    scene.robots[0].set_states(&[0.0], &[omega], &mut states).unwrap();
    simulation.set_states(&states).unwrap();
    let record = step(&mut simulation, 5000);
    let link = scene.robots[0].robot().link("arm").unwrap();
    let half = 0.5_f64.sqrt();
    // The x axis stays, and y points upwards.
    let attitude = Vector4::new(half, half, 0.0, 0.0);
    let site =
        RobotSite { link, frame: LinkFrame { position: Vector3::new(r, 0.0, 0.0), attitude } };
    let [pulled, spin] = read(&scene, &record, &site);
    let expected = Vector3::new(-omega * omega * r, 10.0, 0.0);
    // The mean over a step belongs to its midpoint.
    let turned = omega * omega * r * omega * h;
    assert!((pulled - expected).amax() < turned, "{pulled}");
    // Rotations have a relative error of (h ω)².
    let part = omega * (h * omega).powi(2);
    assert!((spin - Vector3::new(0.0, omega, 0.0)).amax() < part, "{spin}");
    assert!(RobotSite { link: 7, ..site }.motion(&[]).is_err());
}

/// Checks touch sensors on a ball of 2 kg on the ground under one of 1 kg: forces from below and
/// above, and near its lowest point.
#[test]
fn a_ball_is_touched() {
    let text = r#"<mujoco><option gravity="0 0 -10"/><worldbody><geom type="plane" size="1 1 1"/>
        <body name="low" pos="0 0 0.1"><joint type="slide" axis="0 0 1"/><geom size="0.1" mass="2"/></body>
        <body name="high" pos="0 0 0.3"><joint type="slide" axis="0 0 1"/><geom size="0.1" mass="1"/></body>
        </worldbody></mujoco>"#;
    let scene = scene_of(text, Some(0.001)).unwrap();
    let record = step(&mut simulation(&scene), 20);
    let robot = &scene.robots[0];
    let [low, high] = ["low", "high"].map(|name| robot.robot().link(name).unwrap());
    let foot = RobotSite { link: low, frame: LinkFrame::at(Vector3::new(0.0, 0.0, -0.1)) };
    let other = Partner::Body(robot.body(high).unwrap());
    for (partner, within, expected) in [
        (None, None, 40.0),
        (Some(Partner::Ground), None, 30.0),
        (Some(other), None, 10.0),
        (None, Some((&foot, 0.05)), 30.0),
        (Some(other), Some((&foot, 0.05)), 0.0),
    ] {
        let felt = robot.touch(&record, low, partner, within).unwrap();
        assert!((felt - expected).abs() < 1e-8, "{partner:?}: {felt}");
    }
    assert!((robot.touch(&record, high, None, None).unwrap() - 10.0).abs() < 1e-8);
}

/// Checks sites of a file: in a rotated frame, with a class, between two points, in the world, and
/// on a body with an intermediate link. For a site between two points, z points from the second to
/// the first.
#[test]
fn sites_of_a_file() {
    let text = r#"<mujoco><default><default class="tip"><site pos="0 0 2"/></default></default><worldbody>
        <site name="home" pos="1 2 3"/>
        <body name="base" pos="0 0 1"><joint axis="0 1 0"/><joint pos="0.3 0.2 0"/><geom size="0.1" mass="1"/>
        <frame pos="0 1 0" euler="90 0 0" childclass="tip"><site name="up"/><site name="own" pos="1 0 0" euler="0 0 90"/></frame>
        <site name="along" fromto="1 0 0 3 0 0" size="0.1" type="capsule"/><site rgba="1 0 0 1"/></body></worldbody></mujoco>"#;
    let scene = scene_of(text, Some(0.001)).unwrap();
    let robot = scene.robots[0].robot();
    let links = scene.robots[0].links_at(&scene.starts).unwrap();
    assert!(robot.links.iter().any(|link| link.is_between));
    let names: Vec<_> = robot.sites.iter().map(|named| named.name.as_str()).collect();
    assert_eq!(names, ["home", "up", "own", "along"]);
    // Position, x axis and z axis.
    for (name, place, x, z) in [
        ("home", [1.0, 2.0, 3.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]),
        ("up", [0.0, -1.0, 1.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0]),
        ("own", [1.0, 1.0, 1.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]),
        ("along", [2.0, 0.0, 1.0], [0.0, 0.0, 1.0], [-1.0, 0.0, 0.0]),
    ] {
        let site = robot.site(name).unwrap();
        let link = if name == "home" { "world" } else { "base" };
        assert_eq!(robot.links[site.link].name, link);
        let frame = site.motion(&links).unwrap().frame;
        let rotation = frame.rotation();
        for (found, expected) in [
            (frame.position, place),
            (rotation.column(0).into(), x),
            (rotation.column(2).into(), z),
        ] {
            assert!((found - Vector3::from(expected)).amax() < 1e-12, "{name}: {found}");
        }
    }
    assert!(robot.notes.iter().any(|note| note.contains("site without a name")));
    for (from, to, why) in [
        ("name=\"up\"", "name=\"home\"", "used twice"),
        ("3 0 0\" size", "1 0 0\" size", "apart"),
        ("type=\"capsule\"", "kind=\"capsule\"", "kind"),
    ] {
        let refused = scene_of(&text.replace(from, to), None).err().unwrap();
        assert!(refused.contains(why), "{refused}");
    }
}
