//! Fixed tendons of MJCF with springs, limits and motors: laws on sums of two coordinates.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use tumble_core::simulation::StepRecord;
use tumble_scene::overrides::FieldOverride;
use tumble_scene::scene::Scene;
use tumble_scene::written;

/// Slide and hinge with a tendon of length 2 a − b/2.
const MODEL: &str = r#"<mujoco>
  <option timestep="0.001" gravity="0 0 0"/>
  <worldbody>
    <body><joint name="a" type="slide" axis="0 0 1" springref="0.05"/><geom size="0.1" mass="2"/></body>
    <body pos="1 0 0"><joint name="b" type="hinge" axis="0 1 0" ref="20" springref="10"/>
      <geom type="box" size="0.1 0.2 0.3" mass="3"/></body>
  </worldbody>
  <tendon>
    <fixed name="t" stiffness="40" damping="3">
      <joint joint="a" coef="2"/><joint joint="b" coef="-0.5"/>
    </fixed>
  </tendon>
</mujoco>"#;

/// Coordinates and rates.
const AT: ([f64; 2], [f64; 2]) = ([0.13, 0.4], [0.7, -0.3]);

/// `qfrc_passive` of MuJoCo 4.0.0 there [N, N m], for the tendon as given and with
/// springlength="0.1".
const BY_MUJOCO: [[f64; 2]; 2] = [[-13.08131701, 3.27032925], [-6.1, 1.525]];

/// Coordinates 0.4 s later by MuJoCo 4.0.0 in steps of 1e-5 s.
const LATER: [f64; 2] = [0.25926599, 1.03367005];

fn scene_of(text: &str, settings: &[FieldOverride]) -> Result<Scene, String> {
    let name = if text.starts_with('<') { "given.xml" } else { "given.toml" };
    let read = |path: &Path, _: u64| std::fs::read(path);
    Scene::from_text(text, Path::new(name), settings, &read).map_err(|failure| failure.to_string())
}

/// Checks that the forces on both coordinates are MuJoCo's.
#[test]
fn springs_of_tendons_pull_as_mujocos() {
    let given = MODEL.replace("damping=\"3\"", "damping=\"3\" springlength=\"0.1\"");
    for (text, expected) in [MODEL, &given].into_iter().zip(BY_MUJOCO) {
        let scene = scene_of(text, &[]).unwrap();
        let [gear] = scene.world.gears() else { panic!("{:?}", scene.world.gears()) };
        let drive = gear.drive().unwrap();
        let [q, rates] = [AT.0, AT.1];
        // Coordinates of the scene are coordinates of the file minus the reference.
        let reference = 20.0_f64.to_radians();
        let sum = q[0] - gear.ratio() * (q[1] - reference) - gear.offset();
        let rate = rates[0] - gear.ratio() * rates[1];
        let force = -drive.stiffness * (sum - drive.rest) - drive.damping * rate;
        for (found, expected) in [force, -gear.ratio() * force].into_iter().zip(expected) {
            assert!((found - expected).abs() < 1e-8, "{found} {expected}");
        }
    }
}

/// Checks that the motion converges to MuJoCo's with first order in h, and that the scene written
/// as text has the same gears.
#[test]
fn tendon_actuators_agree_with_mujoco() {
    let error = |h: f64| {
        let settings = [FieldOverride::parse(&format!("time_step={h:?}")).unwrap()];
        let scene = scene_of(MODEL, &settings).unwrap();
        let text = written::text(&scene).unwrap();
        assert!(text.contains("drive = { stiffness = 160.0"), "{text}");
        let again = scene_of(&text, &settings).unwrap();
        assert_eq!(again.world.gears(), scene.world.gears());
        let stop = || Arc::new(AtomicBool::new(false));
        let mut simulation = scene.simulation(&stop()).unwrap();
        let mut states = simulation.states().to_vec();
        let robot = &scene.robots[0];
        robot.set_states(&AT.0, &AT.1, &mut states).unwrap();
        simulation.set_states(&states).unwrap();
        let mut record = StepRecord::new();
        for _ in 0..(0.4 / h).round() as usize {
            simulation.step(&mut record).unwrap();
            assert!(record.residual() <= 1e-10);
        }
        let q = robot.coordinates(simulation.states(), &AT.0).unwrap().0;
        q.iter().zip(LATER).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    };
    let errors = [0.002, 0.001, 0.0005].map(error);
    for pair in errors.windows(2) {
        assert!((1.85..2.5).contains(&(pair[0] / pair[1])), "{errors:?}");
    }
    assert!(errors[2] < 5e-5, "{errors:?}");
}

/// Checks that a tendon's range becomes limits of the sum, divided by the first coefficient of
/// either sign.
#[test]
fn ranges_of_tendons_are_limits_of_sums() {
    let limited = MODEL.replace("stiffness=\"40\" damping=\"3\"", "range=\"-1 0.5\"");
    let scene = scene_of(&limited, &[]).unwrap();
    assert_eq!(scene.world.gears()[0].drive().unwrap().limits, Some([-0.5, 0.25]));
    let turned =
        limited.replace("coef=\"2\"", "coef=\"-2\"").replace("coef=\"-0.5\"", "coef=\"0.5\"");
    let scene = scene_of(&turned, &[]).unwrap();
    let gear = scene.world.gears()[0];
    assert_eq!((gear.drive().unwrap().limits, gear.ratio()), (Some([-0.25, 0.5]), 0.25));
    let rubs = MODEL.replace("stiffness=\"40\"", "frictionloss=\"0.7\"");
    let scene = scene_of(&rubs, &[]).unwrap();
    assert_eq!(scene.world.gears()[0].drive().unwrap().friction, 1.4);
    // The flag removes the limit, and nothing remains.
    let off = limited
        .replace("gravity=\"0 0 0\"/>", "gravity=\"0 0 0\"><flag limit=\"disable\"/></option>");
    assert!(scene_of(&off, &[]).unwrap().world.gears().is_empty());
}

/// Checks that unsupported tendons are refused with their line.
#[test]
fn other_tendons_that_pull_are_refused() {
    let third = "<joint joint=\"a\" coef=\"2\"/>";
    let one = "<joint joint=\"b\" coef=\"-0.5\"/>";
    for (from, to, words) in [
        (one, "", &["line 9", "stiffness", "only for two joints"][..]),
        ("damping=\"3\"", "springlength=\"0 0.1\"", &["line 9", "springlength", "one number"]),
        ("damping=\"3\"", "armature=\"0.1\"", &["line 9", "armature"]),
        ("stiffness=\"40\"", "stiffness=\"-1\"", &["line 9", "stiffness is -1.0"]),
        ("damping=\"3\"", "damping=\"1 2\"", &["line 9", "damping", "2 numbers"]),
        (third, "<joint joint=\"c\" coef=\"2\"/>", &["line 10", "\"c\""]),
    ] {
        let why = scene_of(&MODEL.replacen(from, to, 1), &[]).err().unwrap_or_default();
        assert!(words.iter().all(|word| why.contains(word)) && !why.contains('\n'), "{why:?}");
    }
}

/// Slide and hinge closed by a position actuator through a tendon, as in grippers.
const GRIPPER: &str = r#"<mujoco>
  <option timestep="0.001" gravity="0 0 -9.81"/>
  <worldbody>
    <body name="left"><joint name="l" type="slide" axis="0 1 0" range="-1 1"/><geom type="box" size="0.01 0.01 0.02" mass="0.1"/></body>
    <body name="right" pos="0.1 0 0"><joint name="r" type="hinge" axis="1 0 0"/>
      <geom type="box" size="0.01 0.03 0.02" pos="0 0.1 0" mass="0.2"/></body>
  </worldbody>
  <tendon><fixed name="split"><joint joint="l" coef="0.5"/><joint joint="r" coef="0.25"/></fixed></tendon>
  <actuator><general name="grip" tendon="split" gear="2" biastype="affine" gainprm="5" biasprm="0 -100 -10"
    forcerange="-2 2" ctrlrange="0 1"/></actuator>
</mujoco>"#;

/// Coordinates after 0.2 s with a control of 1, and after another 0.2 s with 0.2.
///
/// The equations are m l̈ = f, I r̈ = f/2 − m g 0.1 cos r, f = clamp(5 u − 200 L − 20 L̇), solved
/// by Runge–Kutta in steps of 1e-5 s. MuJoCo 4.0.0 agrees to 1.5e-5 with its Euler method. Its
/// `implicitfast` differs by 1e-3, because it includes the damping also at the force limit.
const GRIPPED: [[f64; 2]; 2] = [[0.07551147, -0.070776], [0.28840025, -0.55447523]];

/// Checks that such an actuator drives the sum, with a control that changes during the motion.
#[test]
fn position_actuators_pull_by_tendons() {
    let error = |h: f64| {
        let settings = [FieldOverride::parse(&format!("time_step={h:?}")).unwrap()];
        let scene = scene_of(GRIPPER, &settings).unwrap();
        let mut simulation = scene.simulation(&Arc::new(AtomicBool::new(false))).unwrap();
        let (robot, mut record) = (&scene.robots[0], StepRecord::new());
        let mut worst = 0.0_f64;
        for (control, expected) in [1.0, 0.2].into_iter().zip(GRIPPED) {
            for (gear, drive) in robot.sum_drives(&[control]).unwrap() {
                simulation.set_gear_drive(gear, drive).unwrap();
            }
            for _ in 0..(0.2 / h).round() as usize {
                simulation.step(&mut record).unwrap();
                assert!(record.residual() <= 1e-10);
            }
            let q = robot.coordinates(simulation.states(), &[0.0; 2]).unwrap().0;
            worst = q.iter().zip(expected).map(|(a, b)| (a - b).abs()).fold(worst, f64::max);
        }
        worst
    };
    let errors = [0.001, 0.0005, 0.00025].map(error);
    for pair in errors.windows(2) {
        assert!((1.85..2.2).contains(&(pair[0] / pair[1])), "{errors:?}");
    }
    assert!(errors[2] < 0.002, "{errors:?}");
}

/// Checks that the actuator is part of the scene written as text. Actuators on more than two joints
/// are refused.
#[test]
fn position_actuators_of_tendons_are_motors_of_sums() {
    let scene = scene_of(GRIPPER, &[]).unwrap();
    let again = scene_of(&written::text(&scene).unwrap(), &[]).unwrap();
    assert_eq!(again.world.gears(), scene.world.gears());
    assert!(scene.world.gears()[0].drive().unwrap().motor.is_some());
    let third = GRIPPER
        .replace(
            "</worldbody>",
            "<body><joint name=\"t\" axis=\"1 0 0\"/><geom size=\"0.1\"/></body></worldbody>",
        )
        .replace("</fixed>", "<joint joint=\"t\" coef=\"1\"/></fixed>");
    let why = scene_of(&third, &[]).err().unwrap_or_default();
    assert!(why.contains("more than two joints"), "{why}");
    // A force limit of one joint does not apply to a force on two.
    let bounded = GRIPPER.replace("name=\"r\"", "name=\"r\" actuatorfrcrange=\"-1 1\"");
    let why = scene_of(&bounded, &[]).err().unwrap_or_default();
    assert!(why.contains("line 9") && why.contains("\"r\" limits"), "{why}");
}
