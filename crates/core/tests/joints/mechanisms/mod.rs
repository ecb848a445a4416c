//! Mechanisms: random ones driven hard onto the ground, and closed loops with published or exact
//! motions.

mod campaign;
mod random;

use crate::common::prelude::*;
use tumble_core::simulation::{Interval, energy};

const G: f64 = 9.81;

fn at_rest(position: Vector3<f64>, attitude: Vector4<f64>) -> State {
    let zero = Vector3::zeros();
    State { position, attitude, velocity: zero, spin: zero }
}

/// Frame of the world expressed in a body at `state`.
fn seen_from(state: &State, frame: &JointFrame) -> JointFrame {
    let back = Vector4::new(1.0, -1.0, -1.0, -1.0).component_mul(&state.attitude);
    let anchor = rotation(&back) * (frame.anchor - state.position);
    JointFrame { anchor, attitude: left(&back) * frame.attitude }
}

/// Frames of a joint between A and B (or the world) at the point `place`, with the z axis `axis`
/// [world frame].
fn frames(
    states: &[State],
    a: usize,
    b: Option<usize>,
    place: Vector3<f64>,
    axis: Vector3<f64>,
) -> [JointFrame; 2] {
    let frame = JointFrame::along(place, axis).unwrap();
    [seen_from(&states[a], &frame), b.map_or(frame, |b| seen_from(&states[b], &frame))]
}

fn parameters(bodies: Vec<RigidBody>, time_step: f64) -> Parameters {
    Parameters { time_step, ..Parameters::new(bodies) }
}

/// Largest joint error [m, rad].
fn error(world: &World, states: &[State]) -> f64 {
    let errors = world.joints().iter().map(|joint| joint.error(states).unwrap());
    errors.map(|(place, turn)| place.max(turn)).fold(0.0, f64::max)
}

/// Energy gained in a step beyond the work of the drives, and the kinetic energy [J]. Each interval counts with the
/// energy of its own length, to which its velocities belong.
fn made(world: &World, record: &StepRecord) -> (f64, f64) {
    let (states, next) = (record.states(), record.next_states());
    let gained_in = |taken: &Interval| {
        let (world, from, to) = (taken.world(world), &taken.states, &taken.solution.states);
        let map = world.step_map();
        let drives = world.joints().iter().zip(&taken.solution.joints);
        let works = drives.map(|(joint, force)| joint.work(from, to, force, &map).unwrap());
        energy::total(&world, to) - energy::total(&world, from) - works.sum::<f64>()
    };
    let gained = record.intervals().iter().map(gained_in).sum();
    let kinetic = |states: &[State]| -> f64 {
        world.bodies().iter().zip(states).map(|(body, x)| energy::kinetic(world, body, x)).sum()
    };
    (gained, kinetic(states).max(kinetic(next)))
}

/// Rod of length `length` along its x axis.
fn rod(mass: f64, length: f64, width: f64) -> RigidBody {
    let half = Vector3::new(0.5 * length, 0.5 * width, 0.5 * width);
    RigidBody::solid(mass, &[Piece::cuboid(half).unwrap()]).unwrap().0
}

/// Body with contact points instead of its shape, which touches only the ground.
fn without_shape(body: &RigidBody) -> RigidBody {
    let points: Vec<_> = body.contact_points().iter().map(|point| point.position).collect();
    RigidBody::new(body.mass(), *body.inertia(), &points).unwrap()
}

/// Rod from one point to another, by the shortest rotation from x.
fn laid(from: Vector3<f64>, to: Vector3<f64>) -> State {
    let way = (to - from).normalize();
    let turn = Vector4::new(1.0 + way[0], 0.0, -way[2], way[1]);
    let attitude =
        if turn.norm() > 1e-6 { turn.normalize() } else { Vector4::new(0.0, 0.0, 0.0, 1.0) };
    at_rest(0.5 * (from + to), attitude)
}

/// Rods through `points`, with a hinge about `axes` at every point. The ends of the first and the
/// last rod are fixed to the world.
fn loop_of_rods(
    points: &[Vector3<f64>],
    axes: &[Vector3<f64>],
    (gravity, width, time_step): (Vector3<f64>, f64, f64),
) -> (World, Vec<State>) {
    let count = points.len() - 1;
    let states: Vec<_> = points.windows(2).map(|ends| laid(ends[0], ends[1])).collect();
    let bodies =
        points.windows(2).map(|ends| rod(1.0, (ends[1] - ends[0]).norm(), width)).collect();
    let joints = points.iter().zip(axes).enumerate().map(|(k, (point, axis))| {
        let (a, b) = match k {
            0 => (0, None),
            k if k == count => (count - 1, None),
            k => (k, Some(k - 1)),
        };
        Joint::revolute(a, b, frames(&states, a, b, *point, *axis), Drive::NONE)
    });
    let joints = joints.collect();
    let mut parameters = parameters(bodies, time_step);
    (parameters.ground, parameters.gravity) = (None, gravity);
    (euler(parameters).with_joints(joints).unwrap(), states)
}

/// Checks Bricard's mechanism: five rods and six hinges with one redundant constraint. The
/// reference is the published benchmark (González, Dopico, Lugrís and Cuadrado 2006) as another
/// program computes it. The state of step k belongs to the time (k + ½) h of a motion from rest.
#[test]
fn bricards_mechanism_moves_as_another_program_has_it() {
    let point = |x: f64, y: f64, z: f64| Vector3::new(x, y, z);
    let points = [
        point(0.0, 0.0, 0.0),
        point(1.0, 0.0, 0.0),
        point(1.0, -1.0, 0.0),
        point(1.0, -1.0, 1.0),
        point(0.0, -1.0, 1.0),
        point(0.0, 0.0, 1.0),
    ];
    let [x, y, z] = [Vector3::x(), Vector3::y(), Vector3::z()];
    let mut errors = Vec::new();
    for h in [2e-3, 1e-3] {
        let (world, states) = loop_of_rods(&points, &[y, z, x, y, z, x], (y * -G, 0.1, h));
        let mut simulation =
            Simulation::new(world.clone(), states, Motion::native(&world)).unwrap();
        let mut record = StepRecord::new();
        let steps = (1.0_f64 / h).round() as u32;
        let third = |states: &[State]| {
            states[2].position + rotation(&states[2].attitude) * Vector3::new(0.5, 0.0, 0.0)
        };
        let mut places = Vec::new();
        for _ in 0..steps {
            simulation.step(&mut record).unwrap();
            assert_ne!(record.status(), StepStatus::Failed);
            assert!(record.residual() < 1e-9, "{:?}", record.certificate());
            assert!(error(&world, record.next_states()) < 1e-12);
            places.push(third(record.next_states()));
        }
        let count = places.len();
        let found = 0.5 * (places[count - 2] + places[count - 1]);
        errors.push((found - Vector3::new(0.510501, -1.649168, 0.140123)).norm());
    }
    println!("{errors:?}");
    assert!(errors[1] < 1e-4, "{errors:?}");
    assert!(errors[0] / errors[1] > 3.0, "{errors:?}");
}

/// Checks a row of four-bar windows, which has many redundant constraints. It moves like the
/// pendulum of the same energy, through the positions in which all bars are collinear.
#[test]
fn four_bar_windows_go_through_their_singular_position() {
    let (windows, h) = (2, 1e-3);
    // Posts at x = 0, 1, 2, and bars between their tops.
    let posts = windows + 1;
    let mut states = Vec::new();
    for k in 0..posts {
        let foot = Vector3::x() * k as f64;
        states.push(laid(foot, foot + Vector3::z()));
    }
    for k in 0..windows {
        let top = Vector3::new(k as f64, 0.0, 1.0);
        states.push(laid(top, top + Vector3::x()));
    }
    let bodies = (0..posts + windows).map(|_| without_shape(&rod(1.0, 1.0, 0.05))).collect();
    let mut joints = Vec::new();
    let mut hinge = |a: usize, b: Option<usize>, place: Vector3<f64>| {
        let frames = frames(&states, a, b, place, Vector3::y());
        joints.push(Joint::revolute(a, b, frames, Drive::NONE));
    };
    for k in 0..posts {
        hinge(k, None, Vector3::x() * k as f64);
    }
    for k in 0..windows {
        let top = Vector3::new(k as f64, 0.0, 1.0);
        hinge(posts + k, Some(k), top);
        hinge(posts + k, Some(k + 1), top + Vector3::x());
    }
    // The bars move at 1 m/s, and the posts rotate about their feet.
    for (k, state) in states.iter_mut().enumerate() {
        let post = k < posts;
        state.velocity = Vector3::x() * if post { 0.5 } else { 1.0 };
        // The frame of a rod has x along it.
        state.spin = rotation(&state.attitude).tr_mul(&Vector3::y()) * f64::from(u8::from(post));
    }
    let mut parameters = parameters(bodies, h);
    parameters.ground = None;
    let apart = euler(parameters).with_joints(joints).unwrap();
    let mut simulation =
        Simulation::new(apart.clone(), states.clone(), Motion::native(&apart)).unwrap();
    let mut record = StepRecord::new();
    let start = energy::total(&apart, &states);
    let mut passages = 0;
    for k in 0..10000 {
        simulation.step(&mut record).unwrap();
        let status = record.status();
        assert!(status.is_solved(), "{k}: {status}");
        let now = record.next_states();
        assert!(error(&apart, now) < 1e-12, "{k}: {}", error(&apart, now));
        // All posts stay parallel, and the bars horizontal.
        for post in 1..posts {
            let apart = now[post].position - now[0].position - Vector3::x() * post as f64;
            assert!(apart.norm() < 1e-9, "{k}: {apart}");
        }
        let height = |states: &[State]| states[0].position[2];
        passages += u32::from(height(record.states()) * height(now) < 0.0);
        let energy = energy::total(&apart, now);
        assert!((energy - start).abs() < 2e-2 * start.abs(), "{k}: {energy} {start}");
    }
    println!("{passages} passages");
    assert!(passages >= 10);
}

/// Checks a ring of four bars that folds flat on the ground. In one step a solution exists that
/// turns 3 J into 168 J. The solver prefers another stage's solution and reports the step as
/// retried.
#[test]
fn a_ring_that_folds_is_taken_where_it_makes_no_energy() {
    let (bars, h, tilt, lean) = (4, 5e-3, 0.13_f64, 0.1_f64);
    let round = std::f64::consts::TAU / bars as f64;
    let radius = 0.25 / (0.5 * round).sin();
    let across = Vector3::new(0.0, lean.cos(), lean.sin());
    let up = Vector3::new(0.0, -lean.sin(), lean.cos());
    let corner = |k: usize| {
        let angle = round * (k % bars) as f64 + tilt;
        (Vector3::x() * angle.cos() + up * angle.sin()) * radius + Vector3::z() * (radius + 0.3)
    };
    let states: Vec<_> = (0..bars).map(|k| laid(corner(k), corner(k + 1))).collect();
    let bodies = (0..bars).map(|_| rod(1.0, 0.46, 0.04)).collect();
    let joints = (0..bars).map(|k| {
        let before = (k + bars - 1) % bars;
        let frames = frames(&states, k, Some(before), corner(k), across);
        Joint::revolute(k, Some(before), frames, Drive::NONE)
    });
    let joints = joints.collect();
    let world = euler(parameters(bodies, h)).with_joints(joints).unwrap();
    let mut simulation = Simulation::new(world.clone(), states, Motion::native(&world)).unwrap();
    let (mut record, mut retried) = (StepRecord::new(), 0);
    for _ in 0..240 {
        simulation.step(&mut record).unwrap();
        let status = record.status();
        assert_ne!(status, StepStatus::Failed, "{}", record.index);
        // The mean forces of shorter steps do not solve the step.
        let is_exact = status == StepStatus::Substepped || record.residual() < 1e-9;
        assert!(is_exact, "{:?}", record.certificate());
        assert!(error(&world, record.next_states()) < 1e-12);
        retried += u32::from(status == StepStatus::Retried);
        let (gained, kinetic) = made(&world, &record);
        assert!(gained < 0.01 * kinetic + 1e-6, "{}: {gained} of {kinetic}", record.index);
    }
    assert!(retried > 0);
}
