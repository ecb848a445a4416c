//! Step derivatives near kinks: sticking in a loop of contacts, near a jam, and before a bounce.
//!
//! `margin` is the distance of the step to its next kink (m/s). `feature_margin` is the distance to
//! kinks that changes of the initial poses can reach. The derivative is valid for smaller changes.

use super::compare::{Direction, apart, difference, directions, size, transposed};
use super::step;
use crate::common::prelude::*;
use rand_mt::Mt;
use std::path::Path;
use tumble_scene::scene::Scene;

fn scene(text: &str) -> (World, Vec<State>) {
    let read = |path: &Path, _: u64| std::fs::read(path);
    let settings = &[];
    let scene = Scene::from_text(text, Path::new("scene.toml"), settings, &read);
    let scene = super::differentiable(scene.unwrap());
    let run = scene.simulation(&Default::default()).unwrap();
    (run.world().clone(), run.states().to_vec())
}

fn linearised(world: &World, states: &[State]) -> (StepDerivative, Vec<State>) {
    let (simulation, base) = step(world, states, &[]).unwrap();
    let mut derivative = StepDerivative::new();
    simulation.linearise(&base, &mut derivative).unwrap();
    (derivative, base.next_states().to_vec())
}

/// Accuracy of a step's solution for one body (m/s).
const EXACT: f64 = 3e-11;

/// Error of the derivative along a direction, and the size of the derivative.
///
/// The reference is a central difference of steps, the best of three step sizes. The error that the
/// accuracy of the solutions explains is subtracted.
fn off(world: &World, states: &[State], along: &Direction) -> (f64, f64) {
    let (mut derivative, base) = linearised(world, states);
    let constants: Vec<_> = along.constants.iter().map(|(c, n)| (*c, &n[..])).collect();
    let (changes, wrenches) = (&along.states[..], &along.wrenches[..]);
    let mut end = Vec::new();
    derivative
        .jvp(&StepChange { states: changes, wrenches, constants: &constants }, &mut end)
        .unwrap();
    let differences = [1e-4, 1e-5, 1e-6].map(|by| {
        let (central, _) = difference(world, (states, &base), along, by).unwrap();
        apart(&central, &end) - EXACT / by
    });
    (differences.into_iter().fold(f64::INFINITY, f64::min), size(&end))
}

/// Direction that changes the state of the only body.
fn by_states(name: &str, change: StateChange) -> Direction {
    Direction { name: name.into(), states: vec![change], wrenches: vec![], constants: vec![] }
}

/// Direction that changes a constant of a world with one body.
fn by_constant(constant: Constant, numbers: &[f64]) -> Direction {
    let constants = vec![(constant, numbers.to_vec())];
    let states = vec![StateChange::zero()];
    Direction { name: constant.name().into(), states, wrenches: vec![], constants }
}

/// Ball at rest between two planes, sticking to both.
const GROOVE: &str = r#"
steps = 2
time_step = 0.002
[ground]
none = true
friction = 0.3
[[bodies]]
name = "ball"
sphere = 0.1
mass = 1.0
position = [0.0, 0.0, 0.1414213562373095]
[[fixed]]
box = [1.0, 1.0, 0.1]
position = [0.318198051533946, 0.0, 0.247487373415292]
attitude = { axis = [0.0, 1.0, 0.0], degrees = -45.0 }
[[fixed]]
box = [1.0, 1.0, 0.1]
position = [-0.318198051533946, 0.0, 0.247487373415292]
attitude = { axis = [0.0, 1.0, 0.0], degrees = 45.0 }
"#;

/// Checks the derivative with respect to the height of a ball in a groove: its feature margin is 0.
///
/// If the ball starts higher, both contacts must slip to close their gaps. The derivative assumes
/// that they stick, so it is wrong. Derivatives with respect to inputs that change no gap are
/// valid.
#[test]
fn a_ball_in_a_groove_cannot_follow_its_place() {
    let (world, states) = scene(GROOVE);
    let (derivative, _) = linearised(&world, &states);
    assert_eq!(derivative.feature_margin(), 0.0);
    assert!(derivative.margin() > 0.0, "{}", derivative.margin());
    let raised = StateChange { position: Vector3::z(), ..StateChange::zero() };
    assert!(off(&world, &states, &by_states("raised", raised)).0 > 1.0);
    let way = Vector3::new(0.3, -0.8, 0.4);
    let pushed = StateChange { velocity: way, spin: way, ..StateChange::zero() };
    let wrench = Wrench { force: way, torque: way * 0.1 };
    let zero = vec![StateChange::zero()];
    for along in [
        by_states("velocities", pushed),
        Direction { wrenches: vec![wrench], states: zero, ..by_states("wrench", pushed) },
        by_constant(Constant::Gravity, way.as_slice()),
        by_constant(Constant::Mass, &[1.0]),
    ] {
        let (off, size) = off(&world, &states, &along);
        assert!(off <= 1e-6 * size, "{}: {off} of {size}", along.name);
    }
}

/// Checks that the derivative with respect to the position is valid on a single plane, although
/// four corners touch.
#[test]
fn a_box_on_the_ground_follows_its_place() {
    let (world, states) = scene(
        r#"
steps = 2
time_step = 0.002
[ground]
friction = 0.5
[[bodies]]
name = "box"
box = [0.2, 0.3, 0.4]
mass = 1.0
position = [0.0, 0.0, 0.2]
"#,
    );
    assert!(linearised(&world, &states).0.feature_margin() > 0.0);
    let way = Vector3::new(0.3, -0.8, 0.4);
    let moved = StateChange { position: way, ..StateChange::zero() };
    let (off, size) = off(&world, &states, &by_states("moved", moved));
    assert!(off <= 1e-6 * size, "{off} of {size}");
}

/// Checks a ball that flies into the corner of two walls.
///
/// As μ approaches 1, the rows of its two contacts become dependent: at μ = 1 it jams. The
/// derivative with respect to μ stays correct.
#[test]
fn a_wedge_that_nearly_jams() {
    for restitution in [0.5, 0.0] {
        for friction in [0.5, 0.9, 0.99, 0.998, 0.999, 0.9995, 0.9999] {
            let (world, states) = scene(&format!(
                r#"
steps = 2
time_step = 0.002
[ground]
none = true
friction = {friction}
restitution = {restitution}
[[bodies]]
name = "ball"
sphere = 0.1
mass = 1.0
position = [0.1, 0.1, 0.1]
velocity = [-1.3999624700464737, -0.3406808646295256, -0.018745657888355385]
spin = [0.36451846324184844, -1.6660807135824625, -2.459696657160423]
[[fixed]]
box = [0.1, 1.0, 1.0]
position = [-0.05, 0.0, 0.5]
[[fixed]]
box = [1.0, 0.1, 1.0]
position = [0.0, -0.05, 0.5]
"#
            ));
            let (mut derivative, _) = linearised(&world, &states);
            let mut draws = Mt::new(7);
            let mut draw = || f64::from(draws.next_u32()) / f64::from(u32::MAX) - 0.5;
            let all = directions(&world, &mut draw);
            let at = format!("{restitution}, {friction}");
            // The factor 1/(1 − μ) occurs twice and amplifies rounding errors.
            transposed(&mut derivative, &all, &mut draw, &at, 1e-7);
            let along = by_constant(Constant::Friction, &[1.0]);
            let (off, size) = off(&world, &states, &along);
            let margins = (derivative.margin(), derivative.feature_margin());
            assert!(off <= 1e-6 * size, "{restitution} {friction}: {off} of {size}");
            assert!(margins.0 > 1e-3, "{margins:?}");
        }
    }
}

/// Checks the margins next to a jump of the step.
///
/// A ball bounces if its free flight ends below the ground, and does not if it ends above. The
/// margin is the distance to the ground over h. At the smallest speed that bounces there is another
/// jump, and the margin is the distance of the speed.
#[test]
fn a_bounce_that_is_about_to_be_none() {
    let (h, g) = (0.002, 9.81);
    let ball = |speed: f64, above: f64| {
        let height = 0.1 + h * (speed + h * g) + above;
        scene(&format!(
            r#"
steps = 2
time_step = {h}
gravity = [0.0, 0.0, -{g}]
[ground]
friction = 0.5
restitution = 0.5
[[bodies]]
name = "ball"
sphere = 0.1
mass = 1.0
position = [0.0, 0.0, {height:?}]
velocity = [0.0, 0.0, -{speed}]
"#
        ))
    };
    for above in [1e-6, 1e-8, -1e-8, -1e-6] {
        let (world, states) = ball(1.0, above);
        let (derivative, _) = linearised(&world, &states);
        let expected = f64::abs(above) / h;
        assert!((derivative.margin() - expected).abs() < 1e-3 * expected + 1e-12, "{above}");
    }
    let threshold = 2.0 * g * h;
    for faster in [1e-3, 1e-6, -1e-6, -1e-3] {
        let (world, states) = ball(threshold + faster, -1e-4);
        let (derivative, _) = linearised(&world, &states);
        assert!((derivative.margin() - f64::abs(faster)).abs() < 1e-9, "{faster}");
    }
}

/// Box on four hinged legs. Two of them hit the ground in the same step, with feet 0.26 mm apart in
/// height. Their tangential rows are nearly dependent.
const WALKER: &str = r#"
steps = 2
time_step = 0.001
gravity = 9.81
ground = { friction = 0.8755810486763148, restitution = 0.5 }
bodies = [
  { name = "body", box = [0.4, 0.2, 0.1], mass = 2.0, position = [0, 0, 0.33] },
  { name = "l0", capsule = { length = 0.2, radius = 0.03 }, mass = 0.3, position = [0.15, 0.15, 0.15] },
  { name = "l1", capsule = { length = 0.2, radius = 0.03 }, mass = 0.3, position = [0.15, -0.15, 0.15] },
  { name = "l2", capsule = { length = 0.2, radius = 0.03 }, mass = 0.3, position = [-0.15, 0.15, 0.15] },
  { name = "l3", capsule = { length = 0.2, radius = 0.03 }, mass = 0.3, position = [-0.15, -0.15, 0.15] },
]
joints = [
  { name = "j0", type = "revolute", bodies = ["l0", "body"], anchor = [0.15, 0.15, 0.27], axis = [0, 1, 0], damping = 0.1, friction = 0.05 },
  { name = "j1", type = "revolute", bodies = ["l1", "body"], anchor = [0.15, -0.15, 0.27], axis = [0, 1, 0], damping = 0.1, friction = 0.05 },
  { name = "j2", type = "revolute", bodies = ["l2", "body"], anchor = [-0.15, 0.15, 0.27], axis = [0, 1, 0], damping = 0.1 },
  { name = "j3", type = "revolute", bodies = ["l3", "body"], anchor = [-0.15, -0.15, 0.27], axis = [0, 1, 0], damping = 0.1, friction = 0.05 },
]
motors = [
  { joint = "j0", speed = -0.6788934063473344, max_force = 3.1810748244147633 },
  { joint = "j1", speed = -0.4012271987574406, max_force = 0.6770924978408592 },
  { joint = "j2", speed = -3.3692728443195423, max_force = 0.6678545480833709 },
  { joint = "j3", speed = -4.431968359411941, max_force = 1.238044538893398 },
]
"#;

/// States of the bodies of [`WALKER`] before the impact: r (m), q, v (m/s), ω (rad/s, body).
const STRIKING: [[f64; 13]; 5] = [
    [
        -0.0029853151653302,
        -4.539907571338e-05,
        0.31405650030032,
        0.99991593957392,
        0.00041384256533075,
        0.012891491058313,
        -0.0013236232971086,
        -0.064638124669601,
        -0.0017886549531353,
        -0.56165377604308,
        0.032628820423969,
        0.50828115695802,
        -0.04749035967445,
    ],
    [
        0.14728437491809,
        0.149701585203,
        0.13033721727202,
        0.99998032866217,
        0.00038860853773471,
        -0.0061171107884168,
        -0.0013312504294563,
        -0.06935692318469,
        -0.0031892331105476,
        -0.63213411784301,
        0.030816714957637,
        -0.17061226074603,
        -0.048685768692738,
    ],
    [
        0.14461093948807,
        -0.15029226808505,
        0.13009088586834,
        0.99999759299611,
        0.00039900344821722,
        0.0017002228361873,
        -0.0013281718826413,
        -0.1171672101293,
        -0.0029657497700276,
        -0.64176149831294,
        0.031567415980713,
        0.10705394735997,
        -0.048202408940458,
    ],
    [
        -0.13907296603399,
        0.15045576035226,
        0.13900524940539,
        0.9980336626738,
        0.00031269274903061,
        -0.062664861969142,
        -0.0013510986441529,
        0.25478159218877,
        0.0093777908090554,
        -0.43748179582719,
        0.025190926399413,
        -2.8609936498059,
        -0.051820825839749,
    ],
    [
        -0.13292024726997,
        -0.14956241696545,
        0.13985120545209,
        0.99576829179778,
        0.00027295950731617,
        -0.091888986314116,
        -0.0013596828339336,
        0.36266337225588,
        0.0087015584257539,
        -0.40410408106298,
        0.022139642537807,
        -3.9236922472733,
        -0.053196080458776,
    ],
];

/// Checks the derivatives with respect to all velocities of [`WALKER`] in the step of the impact.
#[test]
fn two_feet_that_strike_at_nearly_one_height() {
    let (world, _) = scene(WALKER);
    let states: Vec<State> =
        STRIKING.iter().map(|row| State::from_vector(&(*row).into())).collect();
    let (derivative, _) = linearised(&world, &states);
    assert!(derivative.margin() > 1e-3 && derivative.feature_margin() > 0.0);
    for (body, k) in (0..5).flat_map(|body| (0..6).map(move |k| (body, k))) {
        let mut changes = vec![StateChange::zero(); 5];
        let faster = Vector3::ith(k % 3, 1.0);
        match k {
            0..3 => changes[body].velocity = faster,
            _ => changes[body].spin = faster,
        }
        let along = Direction { states: changes, ..by_states("", StateChange::zero()) };
        let (off, size) = off(&world, &states, &along);
        assert!(off <= 1e-6 * size.max(1.0), "{body}, {k}: {off} of {size}");
    }
}

/// Checks two boxes on a hinge that land flat and bounce: the margin is 0.
///
/// If one box were faster, the eight contacts could not all separate at their rebound speeds and
/// satisfy the hinge.
#[test]
fn rebounds_that_bind_each_other() {
    let (world, states) = scene(
        r#"
steps = 2
time_step = 0.002
ground = { friction = 0.9, restitution = 0.5 }
bodies = [
  { name = "a", box = [0.2, 0.06, 0.04], mass = 1.0, position = [0, 0, 0.0205], velocity = [0, 0, -1] },
  { name = "b", box = [0.2, 0.06, 0.04], mass = 1.0, position = [0.2, 0, 0.0205], velocity = [0, 0, -1] },
]
joints = [{ name = "j", type = "revolute", bodies = ["a", "b"], anchor = [0.1, 0, 0.0205], axis = [0, 1, 0] }]
"#,
    );
    assert_eq!(linearised(&world, &states).0.margin(), 0.0);
}
