//! Motors as controls: a weight in closed form, and the library's own joint forces.

use super::{assert_replays, plan, planned, shipped, told};
use crate::campaign::size;
use tumble_core::joint::JointLoad;
use tumble_core::mechanics::Polyline;
use tumble_core::simulation::{Simulation, StepRecord};
use tumble_plan::file::ProblemFile;
use tumble_plan::{ContactMode, ControlKind, Mode, Plan, PlanStatus, Shoot};

/// A rod of 1 kg and 1 m that hangs from a hinge.
const ROD: &str = "
    time_step = 0.004
    gravity = [0, 0, -9.81]
    [ground]
    none = true
    friction = 0.5
    [[bodies]]
    name = \"rod\"
    box = [0.02, 0.02, 1.0]
    mass = 1.0
    position = [0, 0, 1.5]
    [[joints]]
    name = \"hinge\"
    type = \"revolute\"
    bodies = \"rod\"
    anchor = [0, 0, 2.0]
    axis = [0, 1, 0]
    ";

/// Checks that the steady torque that holds the rod at an angle is τ = m g l sin θ.
#[test]
fn the_torque_that_holds_a_rod_is_that_of_its_weight() {
    let scene = ROD.replace("axis =", "damping = 2\n    axis =");
    let problem = "
        steps = 750
        [[controls]]
        kind = \"motor\"
        joint = \"hinge\"
        force = [0, 4]
        knots = 1
        [target]
        turn = 30
        axis = [0, 1, 0]
        tolerance = { turn = 1e-6 }
        ";
    let file = told(&scene, problem);
    let found = plan(&file.problem, &[0.5], &[Box::new(Shoot::default())]);
    assert_eq!(found.status, PlanStatus::Replayed, "{}", found.reason);
    // The rod has come to rest, except for a slow creep.
    let (torque, wanted) = (found.replay.controls[0], 9.81 * 0.5 * 0.5);
    assert!((torque - wanted).abs() < 2e-2 * wanted, "{torque} {wanted}");
    assert_replays(&file, &found);
}

/// Compares motor controls with forces of the library's joints. The motion is the same, although
/// the library includes them in the joint impulses.
#[test]
fn motors_are_forces_of_their_joints() {
    let file = shipped("swing-up.toml");
    let problem = &file.problem;
    let numbers = (0..problem.variables().len()).map(|k| {
        let of = &problem.variables()[k];
        of.bounds[0] + of.scale() * (0.5 + 0.45 * (1.7 * k as f64).sin())
    });
    let controls: Vec<f64> = numbers.collect();
    let replay = problem.replay(&controls).unwrap();
    let scene = problem.scene();
    let motion = scene.motion(&scene.world).unwrap();
    let mut run = Simulation::new(scene.world.clone(), scene.starts.clone(), motion).unwrap();
    let (mut record, h) = (StepRecord::new(), scene.world.time_step());
    for step in 0..problem.steps().min(40) {
        for (index, control) in problem.controls().iter().enumerate() {
            let ControlKind::Motor { axes } = &control.kind else { continue };
            let value = problem.numbers(index, problem.knot(index, step), &controls).0[0];
            let torque = nalgebra::Vector3::new(0.0, 0.0, value);
            let line = Polyline::new(vec![(step as f64 * h, torque)]).unwrap();
            let load = JointLoad { torque: line, ..JointLoad::default() };
            run.set_joint_load(axes[0].0, load).unwrap();
        }
        run.step(&mut record).unwrap();
        for (state, other) in run.states().iter().zip(&replay.states[step + 1]) {
            let apart = (state.position - other.position).norm();
            assert!(apart < 1e-8, "{step}: {apart}");
        }
    }
}

/// A slide tilted on a falling cart, and an arm on a universal joint, whose first axis carries the
/// second.
const TIED: &str = "
    time_step = 0.01
    [ground]
    friction = 0.3
    [[bodies]]
    name = \"cart\"
    box = [0.4, 0.3, 0.1]
    mass = 2.0
    position = [0, 0, 0.5]
    velocity = [0.5, 0.2, 0]
    [[bodies]]
    name = \"slider\"
    box = [0.1, 0.1, 0.3]
    mass = 0.7
    position = [0.1, 0, 0.8]
    [[bodies]]
    name = \"arm\"
    box = [0.3, 0.05, 0.05]
    mass = 0.4
    position = [0.3, 0, 1.0]
    [[joints]]
    name = \"lift\"
    type = \"prismatic\"
    bodies = [\"slider\", \"cart\"]
    anchor = [0.1, 0.05, 0.6]
    axis = [0.2, 0.1, 1]
    [[joints]]
    name = \"elbow\"
    type = \"universal\"
    bodies = [\"arm\", \"slider\"]
    anchor = [0.16, 0, 1.0]
    attitude = { axis = [0, 0, 1], degrees = 20 }
    turn_x = { damping = 0.01 }
    ";

const DRIVEN: &str = "
    steps = 12
    [[controls]]
    kind = \"motor\"
    joint = \"lift\"
    force = [-9, 9]
    knots = 3
    [[controls]]
    kind = \"motor\"
    joint = \"elbow\"
    axis = \"turn_x\"
    force = [-0.2, 0.2]
    knots = 2
    [[controls]]
    kind = \"motor\"
    joint = \"elbow\"
    axis = \"turn_y\"
    force = [-0.2, 0.2]
    knots = 2
    [[controls]]
    kind = \"start\"
    body = \"cart\"
    of = \"velocity\"
    x = [0, 2]
    ";

/// Checks that forces are recovered from the motion that they cause. Exact derivatives find them to
/// rounding, in a few iterations and without differences of runs.
#[test]
fn forces_follow_from_the_motion_that_they_make() {
    let some = told(TIED, &format!("{DRIVEN}\n[target]\nbody = \"arm\"\nx = 1\n")).problem;
    let known = [6.0, 2.0, -2.0, 0.1, -0.05, -0.08, 0.12, 0.8];
    let replay = some.replay(&known).unwrap();
    let mut targets = String::new();
    for (after, (body, name)) in
        [(6, (2, "arm")), (6, (1, "slider")), (12, (2, "arm")), (12, (1, "slider"))]
    {
        let state = &replay.states[after][body];
        let [position, velocity] = [state.position, state.velocity].map(<[f64; 3]>::from);
        let attitude = <[f64; 4]>::from(state.attitude);
        targets += &format!(
            "[[target]]\nbody = {name:?}\nafter = {after}\nposition = {position:?}\nvelocity = {velocity:?}\n\
             attitude = {attitude:?}\nweight = {{ position = 1, velocity = 1, attitude = 1 }}\n"
        );
    }
    let file = told(TIED, &format!("{DRIVEN}\n{targets}\n[cost]\neffort = 0\n"));
    let found = plan(&file.problem, &file.problem.zero(), &[Box::new(Shoot::default())]);
    for (found, known) in found.replay.controls.iter().zip(known) {
        assert!((found - known).abs() < 1e-9, "{found} {known}");
    }
    assert!(found.stages[0].runs < 100, "{}", found.stages[0].runs);
}

/// Checks a double pendulum that swings up against its limits. Its torques are too small to hold it
/// out horizontally.
#[test]
#[ignore = "minutes"]
fn a_double_pendulum_is_swung_up_against_its_stops() {
    let file = shipped("swing-up.toml");
    let weights = [9.81 * (0.5 * 0.25 + 0.4 * 0.7), 9.81 * 0.4 * 0.2];
    for (control, weight) in file.problem.controls().iter().zip(weights) {
        assert!(control.bounds[0][1] < weight, "{}", control.name);
    }
    is_found(&file);
}

/// Checks robots with legs that jump, hop and leap.
#[test]
#[ignore = "minutes"]
fn legs_jump_hop_and_leap() {
    let plans = [a_hopper_jumps_and_lands, a_leg_hops_to_a_place, a_quadruped_hops_to_a_place];
    plans.into_iter().take(size(1, 3)).for_each(|plan| plan());
}

/// Checks a planar quadruped that hops over a bar to a place and stands there.
fn a_quadruped_hops_to_a_place() {
    let file = shipped("leap.toml");
    let found = is_found(&file);
    // In some steps it does not touch the ground.
    let flies = |modes: &&Vec<ContactMode>| modes.iter().all(|of| of.mode == Mode::Open);
    assert!(found.replay.modes.iter().filter(flies).count() > 5);
}

/// Checks a hopper on a springy leg that lands from a fall and hops to a place. It stands there for
/// its last step.
fn a_leg_hops_to_a_place() {
    let file = shipped("hopper.toml");
    let found = is_found(&file);
    let open = |modes: &Vec<ContactMode>| modes.iter().all(|of| of.mode == Mode::Open);
    // Take-offs, after the fall.
    let hops = found.replay.modes.windows(2).filter(|pair| !open(&pair[0]) && open(&pair[1]));
    assert!(hops.count() >= 1);
    assert!(!open(found.replay.modes.last().unwrap()));
}

/// Checks a planar hopper that lifts its foot by 0.15 m, flies, and stands again. While nothing touches,
/// its centre of mass falls freely.
fn a_hopper_jumps_and_lands() {
    let file = shipped("jump.toml");
    let found = is_found(&file);
    let (scene, replay) = (file.problem.scene(), &found.replay);
    let (bodies, h) = (scene.world.bodies(), scene.world.time_step());
    let mass: f64 = bodies.iter().map(|body| body.mass()).sum();
    let momentum = |step: usize| -> f64 {
        let states = replay.states[step].iter().zip(bodies);
        states.map(|(state, body)| body.mass() * state.velocity.z).sum()
    };
    let mut in_flight = 0;
    for (step, modes) in replay.modes.iter().enumerate() {
        if modes.iter().all(|of| of.mode == Mode::Open) {
            let acceleration = (momentum(step + 1) - momentum(step)) / (h * mass);
            assert!((acceleration + 9.81).abs() < 1e-6, "{step}: {acceleration}");
            in_flight += 1;
        }
    }
    assert!(in_flight > 10, "{in_flight}");
}

fn is_found(file: &ProblemFile) -> Plan {
    let found = planned(file);
    assert_eq!(found.status, PlanStatus::Replayed, "{}", found.reason);
    assert!(found.replay.residual <= 1e-9, "{}", found.replay.residual);
    assert_replays(file, &found);
    found
}

/// Checks that invalid motor problems are refused, each with one sentence.
#[test]
fn invalid_motors_are_rejected() {
    let scene = shipped("swing-up.toml").problem.scene().clone();
    let target = "[target]\nbody = \"lower\"\nx = 1\n";
    let motor = "kind = \"motor\"";
    for (fields, words) in [
        ("force = [0, 1]", "joint: the name of a joint is needed"),
        (
            "joint = \"knee\"\nforce = [0, 1]",
            "unknown joint \"knee\"; the scene has shoulder, elbow",
        ),
        ("joint = \"elbow\"", "force: a range is needed"),
        ("joint = \"elbow\"\naxis = \"slide\"\nforce = [0, 1]", "axis: \"slide\" is not an axis"),
        ("joint = [\"elbow\", \"elbow\"]\nforce = [0, 1]", "a joint is named twice"),
        ("joint = []\nforce = [0, 1]", "axes that slide, or axes that turn, are needed"),
        ("joint = 3\nforce = [0, 1]", "the name of a joint, or a list of them, is needed"),
        ("joint = \"elbow\"\nforce = [0, 1]\nbody = \"lower\"", "body: it has no meaning"),
        ("joint = \"elbow\"\nforce = [0, 1]\nx = 2", "x: it has no meaning"),
        ("joint = \"elbow\"\nforce = [1, 0]", "the bounds are 1 to 0"),
    ] {
        let text = format!("scene = \"-\"\nsteps = 5\n[[controls]]\n{motor}\n{fields}\n{target}");
        match ProblemFile::from_scene_text(scene.clone(), &text) {
            Ok(_) => panic!("{fields} is taken"),
            Err(why) => assert!(why.contains(words), "{fields}: {why}"),
        }
    }
    let force = "scene = \"-\"\nsteps = 5\n[[controls]]\nkind = \"force\"\nbody = \"lower\"\n";
    let text = format!("{force}joint = \"elbow\"\nx = [0, 1]\n{target}");
    let why = ProblemFile::from_scene_text(scene, &text).err().unwrap();
    assert!(why.contains("joint or axis: it has no meaning"), "{why}");
}
