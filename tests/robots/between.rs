//! Links with several joints that do not form a single joint. Intermediate links are inserted.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use tumble_core::simulation::{Simulation, StepRecord};
use tumble_scene::overrides::FieldOverride;
use tumble_scene::scene::Scene;

/// Ankle with two hinges and springs. The axes pass each other at 4 cm and are not perpendicular.
const ANKLE: &str = r#"<mujoco>
  <option timestep="0.001" gravity="0 0 -9.81"/>
  <worldbody>
    <body name="shin" pos="0 0 1"><joint name="knee" axis="0 1 0"/>
      <geom type="capsule" fromto="0 0 0 0 0 -0.4" size="0.04" mass="2"/>
      <body name="foot" pos="0 0 -0.4">
        <joint name="y" axis="0 1 0" pos="0 0 0.08" stiffness="3" damping="0.1"/>
        <joint name="x" axis="1 0 0.5" pos="0 0 0.04" stiffness="2" springref="30"/>
        <geom type="box" size="0.1 0.05 0.02" pos="0.05 0.01 0" mass="0.7"/>
      </body>
    </body>
  </worldbody>
</mujoco>"#;

/// Coordinates and rates at the start, and coordinates 0.3 s later by MuJoCo 4.0.0 in steps of 1e-5
/// s.
const START: ([f64; 3], [f64; 3]) = ([0.6, 0.2, -0.1], [0.5, -1.0, 2.0]);
const LATER: [f64; 3] = [0.1003512191, 0.1957096473, 0.3900754363];

fn scene_of(text: &str, h: Option<f64>) -> Result<Scene, String> {
    let read = |path: &Path, _: u64| std::fs::read(path);
    let mut fields = vec![FieldOverride::parse("integrator=euler").unwrap()];
    fields.extend(h.map(|h| FieldOverride::parse(&format!("time_step={h:?}")).unwrap()));
    Scene::from_text(text, Path::new("given.xml"), &fields, &read)
        .map_err(|failure| failure.to_string())
}

fn simulation(scene: &Scene) -> Simulation<'static> {
    scene.simulation(&Arc::new(AtomicBool::new(false))).unwrap()
}

/// Checks that the motion converges to MuJoCo's. With the integrator euler this is of first order in h. A small error remains from
/// the part of the foot in the intermediate link, which does not rotate about the second axis.
#[test]
fn hinges_that_pass_each_other_move_as_mujocos() {
    let error = |h: f64| {
        let scene = scene_of(ANKLE, Some(h)).unwrap();
        let note = "y, x act on one body";
        assert!(scene.notes().iter().any(|said| said.contains(note)), "{:?}", scene.notes());
        let (mut simulation, robot) = (simulation(&scene), &scene.robots[0]);
        let mut states = simulation.states().to_vec();
        robot.set_states(&START.0, &START.1, &mut states).unwrap();
        let (q, v) = robot.coordinates(&states, &START.0).unwrap();
        for (found, given) in q.iter().chain(&v).zip(START.0.iter().chain(&START.1)) {
            assert!((found - given).abs() < 1e-14, "{q:?} {v:?}");
        }
        simulation.set_states(&states).unwrap();
        let mut record = StepRecord::new();
        for _ in 0..(0.3 / h).round() as usize {
            simulation.step(&mut record).unwrap();
            assert!(record.residual() <= 1e-9);
        }
        let q = robot.coordinates(simulation.states(), &START.0).unwrap().0;
        q.iter().zip(LATER).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    };
    let errors = [0.002, 0.001, 0.0005].map(error);
    for pair in errors.windows(2) {
        assert!((1.85..2.2).contains(&(pair[0] / pair[1])), "{errors:?}");
    }
    assert!(errors[2] < 0.003, "{errors:?}");
}

/// Checks that total mass and inertia agree with the file. The intermediate link takes its mass
/// from the link that it carries.
#[test]
fn intermediate_links_take_mass_from_the_link_they_carry() {
    let scene = scene_of(ANKLE, None).unwrap();
    let robot = scene.robots[0].robot();
    let links: Vec<_> = robot.links.iter().map(|link| &*link.name).collect();
    assert_eq!(links, ["world", "shin", "foot-between-y", "foot"]);
    let masses: f64 = robot.links.iter().map(|link| link.mass.mass).sum();
    assert!((masses - 2.7).abs() < 1e-14, "{masses}");
    let joints: Vec<_> = robot.joints.iter().map(|joint| (&*joint.name, joint.link)).collect();
    assert_eq!(joints, [("knee", 1), ("y", 2), ("x", 3)]);
    // Inertia about the knee at zero coordinates: the shin and the foot of the file.
    let motion = robot.motion(&[0.0; 3], &[0.0; 3]).unwrap();
    let about = motion.mass_matrix(robot)[(0, 0)];
    let (tube, ball) = (0.16 * 0.04_f64.powi(2) * 0.4 * 6.25, 4.0 / 3.0 * 0.04_f64.powi(3));
    let (tube, ball) = (2.0 * tube / (tube + ball), 2.0 * ball / (tube + ball));
    let radius = 0.04_f64;
    let shin = tube * (0.25 * radius * radius + 0.16 / 12.0 + 0.04)
        + ball * (0.4 * radius * radius + 0.04 + 0.75 * 0.2 * radius + 0.04);
    let foot = 0.7 * ((0.01 + 0.0004) / 3.0 + 0.05 * 0.05 + 0.16);
    assert!((about - shin - foot).abs() < 1e-12, "{about} {}", shin + foot);
}

/// Checks six joints of one link, which form two joints. Shin and foot do not collide although they
/// overlap.
#[test]
fn joints_in_a_row_are_as_many_as_it_takes() {
    let six = r#"<mujoco><worldbody><body name="hand" pos="0 0 1">
        <joint name="x" type="slide" axis="1 0 0"/><joint name="y" type="slide" axis="0 1 0"/>
        <joint name="z" type="slide" axis="0 0 1"/><joint name="a" axis="1 0 0" pos="0.1 0 0"/>
        <joint name="b" axis="0 1 0" pos="0.1 0 0"/><joint name="c" axis="0 0 1" pos="0.1 0 0"/>
        <geom type="box" size="0.1 0.2 0.3" mass="2"/></body></worldbody></mujoco>"#;
    let scene = scene_of(six, None).unwrap();
    assert_eq!((scene.bodies.len(), scene.joints.len()), (2, 2));
    let (mut simulation, robot) = (simulation(&scene), &scene.robots[0]);
    let (at, rates) = ([0.1, -0.2, 0.3, 0.4, -0.5, 0.6], [0.1, 0.2, -0.3, 0.4, 0.5, -0.6]);
    let mut states = simulation.states().to_vec();
    robot.set_states(&at, &rates, &mut states).unwrap();
    simulation.set_states(&states).unwrap();
    let mut record = StepRecord::new();
    let height = |states: &[tumble_core::mechanics::State]| states[1].position.z;
    let (start, rising) = (height(simulation.states()), states[1].velocity.z);
    for _ in 0..100 {
        simulation.step(&mut record).unwrap();
        assert!(record.residual() <= 1e-9);
    }
    // Nothing supports the hand, so its centre falls freely. A small error comes from the
    // intermediate link, which is not in that centre.
    let h = scene.world.time_step();
    let fell = start + 100.0 * h * rising - height(simulation.states());
    assert!((fell - 9.81 * h * h * 5050.0).abs() < 1e-4, "{fell}");
    let touching = ANKLE.replace("size=\"0.1 0.05 0.02\"", "size=\"0.1 0.05 0.1\"");
    let scene = scene_of(&touching, None).unwrap();
    let mut simulation = self::simulation(&scene);
    simulation.step(&mut record).unwrap();
    assert!(record.first().contacts.is_empty());
}
