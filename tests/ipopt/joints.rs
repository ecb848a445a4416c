//! Ipopt for bodies with joints and gears: its steps against the native solver's, and whole runs.

use nalgebra::{Vector3, Vector4};
use tumble::contact::certificate::{Certifier, Claim};
use tumble::contact::{Candidates, Plane};
use tumble::joint::{Drive, Gear, GearAxis, Joint, JointAxis, JointFrame, Motor};
use tumble::mechanics::{RigidBody, Rotation, State, Wrench};
use tumble::simulation::{Motion, Simulation, StepRecord};
use tumble::solver::ipopt::{Formulation, IpoptSolver, LADDER_RESIDUAL, Ladder, Rung};
use tumble::step::{Step, StepSolution, StepSolver, StepStatus};
use tumble::world::{Parameters, World};

struct Scene {
    name: &'static str,
    world: World,
    starts: Vec<State>,
}

const H: f64 = 0.004;

fn bar(mass: f64, half: [f64; 3]) -> RigidBody {
    RigidBody::solid_box(mass, Vector3::from(half)).unwrap()
}

fn world(bodies: Vec<RigidBody>, ground: Option<Plane>, joints: Vec<Joint>) -> World {
    let gravity = Vector3::new(0.0, 0.0, -9.81);
    let (friction, rotation) = (0.4, Rotation::Momentum);
    let parameters = Parameters { bodies, ground, gravity, friction, time_step: H, rotation };
    World::new(parameters).unwrap().with_joints(joints).unwrap()
}

/// A body with its x axis turned by `angle` from x towards −z.
fn at(position: [f64; 3], angle: f64) -> State {
    State {
        position: position.into(),
        attitude: Vector4::new((0.5 * angle).cos(), 0.0, (0.5 * angle).sin(), 0.0),
        velocity: Vector3::zeros(),
        spin: Vector3::zeros(),
    }
}

/// About the y axis.
fn hinge(anchor: [f64; 3]) -> JointFrame {
    JointFrame::along(anchor.into(), Vector3::y()).unwrap()
}

fn with_limits(low: f64, high: f64) -> Drive {
    Drive { limits: Some([low, high]), ..Drive::NONE }
}

/// Two bars, the upper one on a gimbal, out of any plane, and spinning.
fn double_pendulum() -> Scene {
    let bars = vec![bar(1.0, [0.25, 0.03, 0.02]), bar(0.5, [0.2, 0.02, 0.02])];
    let top = [JointFrame::at([-0.25, 0.0, 0.0].into()), JointFrame::at([0.0, 0.0, 1.0].into())];
    let drives = [Drive { damping: 0.02, ..Drive::NONE }, Drive::NONE, with_limits(-0.2, 0.1)];
    let joints = vec![
        Joint::gimbal(0, None, top, drives),
        Joint::revolute(
            1,
            Some(0),
            [hinge([-0.2, 0.0, 0.0]), hinge([0.25, 0.0, 0.0])],
            Drive::NONE,
        ),
    ];
    let mut starts = vec![at([0.25, 0.0, 1.0], 0.0), at([0.7, 0.0, 1.0], 0.0)];
    starts[0].spin = Vector3::new(0.3, 0.0, 1.0);
    starts[0].velocity = Vector3::new(0.0, 0.25, 0.0);
    starts[1].spin = starts[0].spin;
    starts[1].velocity = Vector3::new(0.0, 0.7, 0.0);
    Scene { name: "double pendulum", world: world(bars, None, joints), starts }
}

/// Crank, rod and slide; a motor presses the slide on a stop, with friction on the way.
fn slider_crank() -> Scene {
    let (crank, rod): (f64, f64) = (0.2, 0.5);
    let angle = 0.8_f64;
    let tip = Vector3::new(crank * angle.cos(), 0.0, 1.0 - crank * angle.sin());
    let below = ((1.0 - tip[2]) / rod).asin();
    let slide = tip[0] + rod * below.cos();
    let bodies = vec![
        bar(0.5, [0.1, 0.02, 0.02]),
        bar(0.8, [0.25, 0.02, 0.02]),
        bar(1.0, [0.05, 0.05, 0.05]),
    ];
    let motor = Motor::Speed { target: -6.0, most: 8.0 };
    let along = |anchor: Vector3<f64>| JointFrame::along(anchor, Vector3::x()).unwrap();
    let stop = Drive { friction: 2.0, ..with_limits(-1.0, 0.03) };
    let joints = vec![
        Joint::revolute(
            0,
            None,
            [hinge([-0.1, 0.0, 0.0]), hinge([0.0, 0.0, 1.0])],
            Drive { motor: Some(motor), ..Drive::NONE },
        ),
        Joint::revolute(
            1,
            Some(0),
            [hinge([-0.25, 0.0, 0.0]), hinge([0.1, 0.0, 0.0])],
            Drive::NONE,
        ),
        Joint::spherical(2, Some(1), [hinge([0.0; 3]), hinge([0.25, 0.0, 0.0])]),
        Joint::prismatic(
            2,
            None,
            [along(Vector3::zeros()), along(Vector3::new(slide, 0.0, 1.0))],
            stop,
        ),
    ];
    let starts = vec![
        at([0.5 * tip[0], 0.0, 0.5 * (1.0 + tip[2])], angle),
        at([0.5 * (tip[0] + slide), 0.0, 0.5 * (1.0 + tip[2])], -below),
        at([slide, 0.0, 1.0], 0.0),
    ];
    Scene { name: "slider-crank", world: world(bodies, None, joints), starts }
}

/// An arm that its own friction holds, and one that slips down.
fn hinges_with_friction() -> Scene {
    let (mass, half) = (1.0, 0.25);
    let weight = mass * 9.81 * half;
    let joint = |body: usize, friction: f64, x: f64| {
        let frames = [hinge([-half, 0.0, 0.0]), hinge([x, 0.0, 1.0])];
        Joint::revolute(body, None, frames, Drive { friction, ..Drive::NONE })
    };
    let bodies = (0..2).map(|_| bar(mass, [half, 0.02, 0.02])).collect();
    let joints = vec![joint(0, 1.001 * weight, 0.0), joint(1, 0.8 * weight, 2.0)];
    let starts = vec![at([half, 0.0, 1.0], 0.0), at([2.0 + half, 0.0, 1.0], 0.0)];
    Scene { name: "hinges with friction", world: world(bodies, None, joints), starts }
}

/// A parallelogram of four hinges, which in space holds itself more often than it needs; a servo turns it.
fn four_bars() -> Scene {
    let lean = 0.6_f64;
    let up = Vector3::new(0.4 * lean.cos(), 0.0, -0.4 * lean.sin());
    let bodies =
        vec![bar(0.5, [0.2, 0.02, 0.02]), bar(0.5, [0.2, 0.02, 0.02]), bar(1.0, [0.3, 0.02, 0.02])];
    let servo = Motor::Position { target: 0.4, stiffness: 60.0, damping: 3.0, most: 4.0 };
    let driven = Drive { motor: Some(servo), armature: 0.01, ..Drive::NONE };
    let joints = vec![
        Joint::revolute(0, None, [hinge([-0.2, 0.0, 0.0]), hinge([0.0, 0.0, 1.0])], driven),
        Joint::revolute(1, None, [hinge([-0.2, 0.0, 0.0]), hinge([0.6, 0.0, 1.0])], Drive::NONE),
        Joint::revolute(2, Some(0), [hinge([-0.3, 0.0, 0.0]), hinge([0.2, 0.0, 0.0])], Drive::NONE),
        Joint::revolute(2, Some(1), [hinge([0.3, 0.0, 0.0]), hinge([0.2, 0.0, 0.0])], Drive::NONE),
    ];
    let from = |x: f64| [x + 0.5 * up[0], 0.0, 1.0 + 0.5 * up[2]];
    let starts =
        vec![at(from(0.0), lean), at(from(0.6), lean), at([0.3 + up[0], 0.0, 1.0 + up[2]], 0.0)];
    Scene { name: "four bars", world: world(bodies, None, joints), starts }
}

/// Two wheels of a gear, of which one is driven against a spring, and a ball joint with a cone that swings to its edge.
fn gear_and_ball() -> Scene {
    let wheel = || bar(1.0, [0.1, 0.02, 0.1]);
    let spring = Drive { stiffness: 3.0, damping: 0.1, ..Drive::NONE };
    let push = Drive { force: 0.8, friction: 0.05, ..Drive::NONE };
    let pin = |body: usize, x: f64, drive: Drive| {
        Joint::revolute(body, None, [hinge([0.0; 3]), hinge([x, 0.0, 1.0])], drive)
    };
    let down = |anchor: Vector3<f64>| JointFrame::along(anchor, -Vector3::z()).unwrap();
    let frames = [down(Vector3::new(0.0, 0.0, 0.2)), down(Vector3::new(2.0, 0.0, 1.0))];
    let twist = Drive { damping: 0.01, ..Drive::NONE };
    let joints =
        vec![pin(0, 0.0, push), pin(1, 1.0, spring), Joint::ball(2, None, frames, 0.3, twist)];
    let axis = |joint: usize| GearAxis { joint, axis: JointAxis::Angular(2) };
    let bodies = vec![wheel(), wheel(), bar(1.0, [0.02, 0.03, 0.2])];
    let world = world(bodies, None, joints);
    let world = world.with_gears(vec![Gear::new(axis(0), axis(1), -1.5, 0.0)]).unwrap();
    let mut starts =
        vec![at([0.0, 0.0, 1.0], 0.0), at([1.0, 0.0, 1.0], 0.0), at([2.0, 0.0, 0.8], 0.0)];
    starts[2].spin = Vector3::new(2.0, 1.0, 0.5);
    starts[2].velocity = starts[2].spin.cross(&Vector3::new(0.0, 0.0, -0.2));
    Scene { name: "gear and ball", world, starts }
}

/// A flap on a hinge with friction that falls on the ground, with a slide hanging from it.
fn flap() -> Scene {
    let bodies = vec![bar(1.0, [0.25, 0.1, 0.02]), bar(0.2, [0.03, 0.03, 0.03])];
    let frames = [hinge([-0.25, 0.0, 0.0]), hinge([0.0, 0.0, 0.12])];
    let along = |anchor: [f64; 3]| JointFrame::along(anchor.into(), Vector3::x()).unwrap();
    let joints = vec![
        Joint::revolute(0, None, frames, Drive { friction: 0.2, ..Drive::NONE }),
        Joint::prismatic(
            1,
            Some(0),
            [along([0.0; 3]), along([0.0, 0.0, 0.06])],
            with_limits(-0.1, 0.01),
        ),
    ];
    let starts = vec![at([0.25, 0.0, 0.12], 0.0), at([0.25, 0.0, 0.18], 0.0)];
    Scene { name: "flap", world: world(bodies, Some(Plane::level()), joints), starts }
}

fn scenes() -> Vec<Scene> {
    vec![
        double_pendulum(),
        slider_crank(),
        hinges_with_friction(),
        four_bars(),
        gear_and_ball(),
        flap(),
    ]
}

fn ladder(world: &World, rungs: &[Rung]) -> Ladder {
    let options = IpoptSolver::options(1e-6, 300);
    Ladder::new(world, IpoptSolver::new(world, Formulation::Reduced, options).unwrap(), rungs)
}

fn run(scene: &Scene, steps: usize, motion: Motion<'_>) -> Vec<StepRecord> {
    let starts = scene.starts.iter().copied();
    let mut simulation = Simulation::new(scene.world.clone(), starts, motion).unwrap();
    let mut record = StepRecord::new();
    let step = |_| {
        simulation.step(&mut record).unwrap();
        record.clone()
    };
    (0..steps).map(step).collect()
}

/// How far two states of a body are apart, m/s, spins by its reach.
fn apart(world: &World, a: &[State], b: &[State]) -> f64 {
    let bodies = world.bodies().iter().zip(a.iter().zip(b));
    let each = bodies.map(|(body, (a, b))| {
        (a.velocity - b.velocity).amax().max((a.spin - b.spin).amax() * body.reach())
    });
    each.fold(0.0, f64::max)
}

/// How much more the thinnest body's ends move by an impulse that turns it about its own axis than all of it by one that pushes
/// it: m ℓ²/I of its reach ℓ and its least moment of inertia.
fn thinness(world: &World) -> f64 {
    let of = |body: &RigidBody| {
        let least = body.inertia().diagonal().min();
        body.mass() * body.reach() * body.reach() / least
    };
    world.bodies().iter().map(of).fold(1.0, f64::max)
}

/// Steps of native runs, solved again by Ipopt alone, from the step before and from free flight. An impulse that is missed by what
/// makes a speed of δ, the residual, may turn thin bars by [`thinness`] times that, and the motion is made by the sum of the impulses
/// of all joints and contacts (measured: 0.12 of what that allows for a thin bar on a gimbal, less elsewhere).
#[test]
fn ipopt_agrees_with_the_native_solver() {
    for scene in scenes() {
        let native = run(&scene, 60, Motion::native(&scene.world));
        let mut ipopt = ladder(&scene.world, &[Rung::Previous, Rung::FreeFlight]);
        let world = &scene.world;
        let (mut solved, mut worst) = (0, 0.0_f64);
        for pair in native.windows(2) {
            let (before, record) = (&pair[0].solution, &pair[1]);
            let states = &record.states;
            let wrenches = vec![Wrench::zero(); states.len()];
            let flights = states.iter().zip(&wrenches).enumerate();
            let free: Vec<_> = flights.map(|(i, (x, w))| world.free_flight(i, x, w)).collect();
            let step = Step {
                world,
                states,
                wrenches: &wrenches,
                free: &free,
                previous: before,
                earlier: None,
                interrupt: None,
            };
            let mut candidates = Candidates::from(record.contacts.clone());
            let mut ours = StepSolution::default();
            let report = ipopt.solve(&step, &mut candidates, &mut ours).unwrap();
            let contacts = candidates.contacts();
            let (next, joints, gears) = (&ours.states, &ours.joints, &ours.gears);
            let claim = Claim { states, next, wrenches: &wrenches, contacts, joints, gears };
            let certificate = Certifier::new().contact_step(world, &claim, ours.forces());
            let residual = certificate.residual();
            if report.status == StepStatus::Failed {
                continue;
            }
            solved += 1;
            let residuals = residual + record.certificate.residual();
            let count = (world.joints().len() + contacts.len()) as f64;
            let allowed = 2.0 * count * thinness(world) * residuals + 1e-12;
            let apart = apart(world, next, &record.solution.states);
            worst = worst.max(apart / allowed);
            assert!(
                apart <= allowed,
                "{} {}: {apart:e}, {allowed:e} allowed, {certificate:?}",
                scene.name,
                record.index
            );
        }
        println!("{}: {solved} of 59, {worst:.2} of what is allowed", scene.name);
        assert!(20 * solved >= 19 * 59, "{}: {solved} of 59", scene.name);
    }
}

/// Whole runs on the ladder: no step fails, few are the native solver's, residuals are what the ladder accepts.
#[test]
fn whole_runs_are_solved() {
    for scene in scenes() {
        let records = run(&scene, 60, Motion::contact(ladder(&scene.world, &Rung::ALL)));
        let limit = LADDER_RESIDUAL * scene.world.speed_scale();
        let mut fallbacks = 0;
        for record in &records {
            let (status, residual) = (record.report.status, record.certificate.residual());
            let name = scene.name;
            assert_ne!(
                status,
                StepStatus::Failed,
                "{name} {}: {:?}",
                record.index,
                record.certificate
            );
            assert!(residual <= limit, "{name} {}: {residual:e}", record.index);
            fallbacks += usize::from(status == StepStatus::Fallback);
        }
        println!("{}: {fallbacks} fallbacks", scene.name);
        assert!(fallbacks <= 3, "{}: {fallbacks} fallbacks", scene.name);
    }
}

/// A hinge whose dry friction is a thousandth above the torque of the weight holds, and the torque is that of the weight to what
/// a residual of Ipopt's makes of it.
#[test]
fn friction_holds_an_arm_by_its_weight() {
    let scene = hinges_with_friction();
    let records = run(&scene, 40, Motion::contact(ladder(&scene.world, &[Rung::Previous])));
    let last = &records[39];
    let residuals: f64 = records.iter().map(|record| record.certificate.residual()).sum();
    let moved = (last.solution.states[0].position - scene.starts[0].position).amax();
    // The row of the hinge is the speed at ℓ from it, the arm's middle is 0.25 m from it; and its motion may be missed by as much.
    let lever = 0.25 / scene.world.joints()[0].length(scene.world.bodies());
    let allowed = H * (1.0 + lever) * residuals + 1e-14;
    assert!(moved <= allowed, "{moved:e}, {allowed:e} allowed");
    let torque = last.solution.joints[0].torque[2].abs();
    let inertia = (0.25_f64.powi(2) * 4.0 + 0.02_f64.powi(2)) / 3.0;
    let allowed = 4.0 * inertia / (0.25 * H) * residuals + 1e-12;
    assert!((torque - 9.81 * 0.25).abs() <= allowed, "{torque}, {allowed:e} allowed");
    // The other one slips with all that its friction has.
    let slipping = last.solution.joints[1].torque[2].abs();
    assert!((slipping - 0.8 * 9.81 * 0.25).abs() < 1e-4, "{slipping}");
}

/// Points of the tutorial's own program have no joints: it refuses them, in one sentence.
#[test]
fn the_tutorials_program_refuses_joints() {
    let scene = flap();
    let options = IpoptSolver::options(1e-6, 300);
    let refused = IpoptSolver::new(&scene.world, Formulation::Clamped, options).err().unwrap();
    assert!(!refused.to_string().contains('\n'), "{refused}");
}
