//! Robots in motion: comparison with MuJoCo (`data/generate/robots_moving.py`), and damping and
//! friction of free joints and ball joints.

use serde_json::Value;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use tumble_core::joint::{Axis, Gear, GearAxis, JointAxis, TurnKind};
use tumble_core::mechanics::State;
use tumble_core::simulation::random::Draws;
use tumble_core::simulation::{Simulation, StepRecord};
use tumble_core::world::Integrator;
use tumble_robot::model::Moves;
use tumble_scene::overrides::FieldOverride;
use tumble_scene::scene::Scene;
use tumble_scene::written;

pub(super) fn scene_of(text: &str, h: Option<f64>) -> Result<Scene, String> {
    let name = if text.trim_start().starts_with('<') { "given.xml" } else { "given.toml" };
    let read = |path: &Path, _: u64| std::fs::read(path);
    let step = h.map(|h| FieldOverride::parse(&format!("time_step={h:?}")).unwrap());
    Scene::from_text(text, Path::new(name), step.as_slice(), &read)
        .map_err(|failure| failure.to_string())
}

pub(super) fn simulation(scene: &Scene) -> Simulation<'static> {
    scene.simulation(&Arc::new(AtomicBool::new(false))).unwrap()
}

fn set(scene: &Scene, simulation: &mut Simulation<'_>, (q, v): (&[f64], &[f64])) {
    let mut states = simulation.states().to_vec();
    scene.robots[0].set_states(q, v, &mut states).unwrap();
    simulation.set_states(&states).unwrap();
}

pub(super) fn step(simulation: &mut Simulation<'_>, steps: usize) -> StepRecord {
    let mut record = StepRecord::new();
    for _ in 0..steps {
        simulation.step(&mut record).unwrap();
        assert!(record.residual() <= 1e-9, "{:?}", record.certificate());
    }
    record
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|number| number.as_f64().unwrap()).collect()
}

/// Error of the final coordinates against MuJoCo's, with steps of h. It also checks that the scene
/// written as text has the same joints.
fn error(text: &str, figures: &Value, h: f64) -> f64 {
    let scene = scene_of(text, Some(h)).unwrap();
    let (q, v, expected) =
        (numbers(&figures["q"]), numbers(&figures["v"]), numbers(&figures["later"]));
    let steps = (figures["duration"].as_f64().unwrap() / h).round() as usize;
    let mut simulation = simulation(&scene);
    set(&scene, &mut simulation, (&q, &v));
    let robot = &scene.robots[0];
    if let Some(controls) = robot.robot().keys.first().and_then(|key| key.controls.as_ref()) {
        for index in 0..robot.robot().joints.len() {
            let Some((joint, axis)) = robot.axis(index) else { continue };
            let axis =
                if axis < 3 { JointAxis::Linear(axis) } else { JointAxis::Angular(axis - 3) };
            simulation.set_drive(joint, axis, robot.drive(index, controls).unwrap()).unwrap();
        }
    }
    let again = scene_of(&written::text(&scene).unwrap(), Some(h)).unwrap();
    for (again, own) in again.world.joints().iter().zip(scene.world.joints()) {
        assert_eq!((again.linear(), again.angular()), (own.linear(), own.angular()));
        assert_eq!((again.turning(), again.collides()), (own.turning(), own.collides()));
    }
    step(&mut simulation, steps);
    let found = scene.robots[0].coordinates(simulation.states(), &q).unwrap().0;
    // The attitudes q and −q are equal.
    let robot = scene.robots[0].robot();
    let attitude = robot.joints.iter().zip(robot.places()).find_map(|(joint, (place, _))| {
        let first = match joint.moves {
            Moves::Free => place + 3,
            Moves::Ball => place,
            Moves::Slide | Moves::Hinge => return None,
        };
        Some(first..first + 4)
    });
    let attitude = attitude.unwrap_or_default();
    let along: f64 = attitude.clone().map(|k| found[k] * expected[k]).sum();
    let sign = |k: usize| if attitude.contains(&k) && along < 0.0 { -1.0 } else { 1.0 };
    let off = found.iter().zip(&expected).enumerate();
    off.map(|(k, (a, b))| (a - sign(k) * b).abs()).fold(0.0, f64::max)
}

/// Checks that each robot's motion converges to MuJoCo's, with second order in h unless its springs are
/// stiff.
#[test]
fn robots_move_as_mujocos() {
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("data/robots");
    let figures = std::fs::read_to_string(data.join("moving.json")).unwrap();
    let figures: Value = serde_json::from_str(&figures).unwrap();
    for (name, figures) in figures.as_object().unwrap() {
        let text = std::fs::read_to_string(data.join("moving").join(name)).unwrap();
        let errors = [0.002, 0.001, 0.0005].map(|h| error(&text, figures, h));
        for pair in errors.windows(2) {
            assert!(pair[0] / pair[1] > 1.85, "{name}: {errors:?}");
        }
        assert!(errors[2] < 0.004, "{name}: {errors:?}");
    }
}

fn ball(joint: &str) -> String {
    format!(
        r#"<mujoco><option gravity="0 0 0" timestep="0.001"/><worldbody>
        <body name="ball">{joint}<geom size="0.1" mass="2"/></body></worldbody></mujoco>"#
    )
}

/// Checks a damped free sphere: v = v₀ (1 + h d/m)⁻ⁿ, which approaches exp(−d t/m). The spin
/// behaves the same with ⅖ m r² instead of m. Its error is a fraction (h ω)², because a row is 2/h
/// times the sine of half the rotation.
#[test]
fn a_free_sphere_slows_down_as_its_damper_has_it() {
    let mut scene = scene_of(&ball(r#"<joint type="free" damping="0.5"/>"#), None).unwrap();
    scene.use_integrator(Integrator::Euler);
    let [joint] = scene.world.joints() else { panic!("{:?}", scene.world.joints()) };
    assert_eq!(joint.turning(), TurnKind::Driven);
    let mut simulation = simulation(&scene);
    let v = [3.0, -4.0, 12.0, 0.3, -0.4, 1.2];
    set(&scene, &mut simulation, (&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0], &v));
    let (h, d, m) = (1e-3, 0.5, 2.0);
    let inertia = 0.4 * m * 0.01;
    for n in 1..=20 {
        step(&mut simulation, 1);
        let State { velocity, spin, .. } = simulation.states()[0];
        let slower = (1.0_f64 + h * d / m).powi(-n);
        let turning = (1.0_f64 + h * d / inertia).powi(-n);
        for k in 0..3 {
            assert!((velocity[k] - v[k] * slower).abs() < 1e-12, "{velocity:?}");
            assert!((spin[k] - v[3 + k] * turning).abs() < 1e-6 * turning, "{n}: {spin:?}");
        }
    }
}

/// Checks dry friction of a ball joint. It holds torques below its limit about each axis. A
/// rotating ball decelerates with the limit.
#[test]
fn a_ball_with_dry_friction_holds_still_or_slows_down_evenly() {
    let of = |force: f64| {
        let text = ball(r#"<joint type="ball" frictionloss="0.02"/>"#);
        let scene = scene_of(&text, None).unwrap();
        let mut simulation = simulation(&scene);
        let joint = scene.world.joints()[0].clone();
        let Axis::Free(drive) = joint.angular()[1] else { panic!("{joint:?}") };
        let pushed = tumble_core::joint::Drive { force, ..drive };
        simulation.set_drive(0, JointAxis::Angular(1), pushed).unwrap();
        step(&mut simulation, 100);
        simulation.states()[0].spin
    };
    assert_eq!(of(0.019).norm(), 0.0);
    // (τ − τ_f) t/I, to second order in h ω.
    let spin = of(0.03).y;
    let expected = 0.01 * 0.1 / (0.4 * 2.0 * 0.01);
    assert!((spin - expected).abs() < 1e-6 * expected, "{spin} {expected}");
}

/// Checks that a free body with damping still touches the ground.
#[test]
fn a_damped_box_comes_to_rest_on_the_ground() {
    let scene = scene_of(
        r#"<mujoco><worldbody><geom type="plane" size="1 1 1"/>
        <body name="box" pos="0 0 0.3" euler="30 20 10"><joint type="free" damping="0.01"/>
          <geom type="box" size="0.1 0.1 0.1" mass="1"/></body></worldbody></mujoco>"#,
        None,
    )
    .unwrap();
    let mut simulation = simulation(&scene);
    step(&mut simulation, 1500);
    let state = simulation.states()[0];
    assert!((state.position.z - 0.1).abs() < 1e-9 && state.velocity.norm() < 1e-9, "{state:?}");
}

/// Simulates steps of 5 ms of a file of `data/robots` from its start. Returns the largest position
/// error of a joint [m] and the last record.
fn fall(name: &str, steps: usize) -> (f64, StepRecord) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("data/robots").join(name);
    let text = std::fs::read_to_string(&path).unwrap();
    let read = |path: &Path, _: u64| std::fs::read(path);
    let step = FieldOverride::parse("time_step=0.005").unwrap();
    let scene = Scene::from_text(&text, &path, &[step], &read).unwrap();
    let (mut simulation, mut worst) = (simulation(&scene), 0.0_f64);
    let mut record = StepRecord::new();
    for _ in 0..steps {
        simulation.step(&mut record).unwrap();
        let errors = scene.world.joints().iter();
        let errors = errors.map(|joint| joint.error(record.next_states()).unwrap().0);
        worst = errors.fold(worst, f64::max);
    }
    (worst, record)
}

/// Checks that a robot at rest is not solved again. Rounding in its joints is not a motion.
#[test]
fn a_robot_at_rest_is_not_solved_again() {
    let (_, record) = fall("hopper.xml", 600);
    assert_eq!(record.report().iterations, 0);
    assert_eq!(record.next_states(), record.states());
}

/// Checks that bodies come to rest together with the bodies that joints connect to them. Stopped
/// one at a time at 3e-10 m/s, they would open joints by 1.5e-12 m per step.
#[test]
fn jointed_bodies_come_to_rest_together() {
    let (worst, record) = fall("classes.xml", 1000);
    assert!(worst < 1e-13, "{worst}");
    assert!(record.residual() <= 1e-9);
}

/// Checks that gears cannot act on a free rotation.
#[test]
fn gears_of_ball_joints_are_rejected() {
    let scene = scene_of(&ball(r#"<joint type="ball" damping="0.5"/>"#), None).unwrap();
    let [x, y] = [0, 1].map(|k| GearAxis { joint: 0, axis: JointAxis::Angular(k) });
    let why = scene.world.clone().with_gears(vec![Gear::new(x, y, 1.0, 0.0)]).unwrap_err();
    assert!(why.to_string().contains("without a coordinate"), "{why}");
}

/// Checks that settings without meaning for a free rotation are refused.
#[test]
fn invalid_options_of_ball_joints_are_rejected() {
    let file = ball(r#"<joint name="j" type="ball" range="0 1" limited="true"/>"#);
    let why = scene_of(&file, None).err().unwrap();
    assert!(why.contains("a ball with a range"), "{why}");
    let table = |fields: &str| {
        let text = format!(
            "[ground]\nfriction = 0.5\n[[bodies]]\nname = \"a\"\nsphere = 0.1\nmass = 1.0\nposition = [0, 0, 1]\n[[joints]]\nname = \"j\"\nbodies = \"a\"\nanchor = [0, 0, 1]\n{fields}"
        );
        scene_of(&text, None).map(|_| ()).err().unwrap_or_default()
    };
    assert_eq!(table("type = \"spherical\"\nturn_x = { damping = 1.0 }"), "");
    assert_eq!(table("type = \"free\"\nz = { damping = 1.0, limits = [0.0, 1.0] }"), "");
    let why = table("type = \"spherical\"\nturn_x = { limits = [0.0, 1.0] }");
    assert!(why.contains("turn_x.limits has no meaning for a spherical joint"), "{why}");
    let why = table("type = \"free\"\nturn_z = { start = 1.0 }");
    assert!(why.contains("turn_z.start has no meaning for a free joint"), "{why}");
}

/// Checks that coordinates and rates are read back as they were set, for ball joints, free joints
/// and three hinges with a common point.
#[test]
fn rates_are_read_back() {
    let hinges = |axes: [&str; 3]| {
        axes.map(|axis| format!("<joint type=\"hinge\" axis=\"{axis}\" pos=\"0.01 0.02 -0.03\"/>"))
            .concat()
    };
    let ball = "<joint type=\"ball\" pos=\"0.0001 0.006 0.08\"/>".to_owned();
    let gimbal = hinges(["1 0 0", "0 1 0", "0 0 1"]);
    for joints in [ball, "<freejoint/>".to_owned(), gimbal] {
        let geom = r#"<geom type="box" size="0.1 0.2 0.3" mass="1" contype="0" conaffinity="0"/>"#;
        let text = format!(
            r#"<mujoco><worldbody><body name="a" pos="0 0 1">{joints}{geom}
            <body name="b" pos="0.1 0.2 0.3"><joint type="slide" axis="1 2 3"/>{geom}</body></body></worldbody></mujoco>"#
        );
        let scene = scene_of(&text, None).unwrap();
        let robot = &scene.robots[0];
        let mut states = scene.starts.clone();
        let (start, rates) = robot.coordinates(&states, robot.start()).unwrap();
        let mut draws = Draws::new(7);
        for _ in 0..500 {
            let mut draw = || 2.0 * draws.unit() - 1.0;
            let mut q: Vec<f64> = start.iter().map(|_| draw()).collect();
            let v: Vec<f64> = rates.iter().map(|_| draw()).collect();
            if q.len() > v.len() {
                let first = q.len() - 5;
                let length = q[first..first + 4].iter().map(|x| x * x).sum::<f64>().sqrt();
                q[first..first + 4].iter_mut().for_each(|x| *x /= length);
            }
            robot.set_states(&q, &v, &mut states).unwrap();
            let (at, fast) = robot.coordinates(&states, &q).unwrap();
            // The attitudes q and −q are equal.
            let apart = |sign: f64| {
                let each = at.iter().zip(&q).enumerate();
                each.map(|(k, (a, b))| {
                    let is_attitude = q.len() > v.len() && (q.len() - 5..q.len() - 1).contains(&k);
                    (if is_attitude { sign * a } else { *a } - b).abs()
                })
                .fold(0.0, f64::max)
            };
            let off = apart(1.0).min(apart(-1.0));
            assert!(off <= 1e-14, "{joints}: {at:?} {q:?}");
            let off = fast.iter().zip(&v).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(off <= 1e-13, "{joints}: {fast:?} {v:?}, by {off}");
        }
    }
}
