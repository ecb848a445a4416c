//! Several bodies with the native solver: invariants that hold for all numbers, and scenes that are
//! known to break contact solvers.

mod edges;

use crate::common::prelude::*;
use crate::common::symmetry::{mirrored, turned};
use crate::common::{cases, quaternion, vector};
use proptest::prelude::*;
use proptest::test_runner::{RngSeed, TestRunner};

/// Gravity [m/s²].
const GRAVITY: f64 = 9.81;

/// World with the initial states of its bodies.
#[derive(Debug, Clone)]
struct Scene {
    parameters: Parameters,
    fixed: Vec<Piece>,
    states: Vec<State>,
}

impl Scene {
    fn new(bodies: Vec<(RigidBody, State)>, friction: f64, time_step: f64) -> Self {
        let (bodies, states) = bodies.into_iter().unzip();
        let (ground, gravity) = (Plane::level(), Vector3::new(0.0, 0.0, -GRAVITY));
        let parameters = Parameters {
            ground: Some(ground),
            gravity,
            friction,
            time_step,
            ..Parameters::new(bodies)
        };
        Self { parameters, fixed: Vec::new(), states }
    }

    fn world(&self) -> World {
        euler(self.parameters.clone()).with_fixed(self.fixed.clone())
    }

    /// Runs the scene and returns the records of all steps. Every step must be solved.
    fn run(&self, steps: usize) -> Vec<StepRecord> {
        run(&self.world(), &self.states, steps)
    }
}

fn run(world: &World, states: &[State], count: usize) -> Vec<StepRecord> {
    let judge = |record: &StepRecord| has_not_failed(record) && record.residual() < 1e-9;
    steps(&mut simulate(world, states), count, judge)
}

fn at(x: f64, y: f64, z: f64) -> State {
    State::at_rest(Vector3::new(x, y, z))
}

fn solid_box(mass: f64, a: f64, b: f64, c: f64) -> RigidBody {
    RigidBody::solid_box(mass, Vector3::new(a, b, c)).unwrap()
}

/// Three boxes that land on each other off centre, rotated and rotating. There are corners on
/// faces, crossing edges and, in the end, flush faces. With this form of rotation no contact of the
/// landing is a tie that rounding decides.
fn heap() -> Scene {
    let place = |[x, y, z]: [f64; 3], angle: f64, velocity: [f64; 3]| State {
        attitude: Vector4::new((0.5 * angle).cos(), 0.02, 0.01, (0.5 * angle).sin()).normalize(),
        velocity: Vector3::from(velocity),
        ..at(x, y, z)
    };
    let bodies = vec![
        (solid_box(2.0, 0.3, 0.25, 0.1), place([0.0, 0.0, 0.12], 0.2, [0.3, 0.1, 0.0])),
        (solid_box(1.0, 0.2, 0.15, 0.1), place([0.08, 0.05, 0.36], 0.7, [0.0, 0.0, -0.5])),
        (solid_box(0.7, 0.1, 0.12, 0.15), place([-0.02, 0.0, 0.66], 1.4, [0.1, -0.2, -1.0])),
    ];
    let mut scene = Scene::new(bodies, 0.5, 0.002);
    scene.parameters.rotation = Rotation::Tutorial;
    scene
}

/// Number of steps until the heap has landed.
const LANDING: usize = 120;

/// Reach ℓ of the heap's world [m], which converts spins to speeds.
const REACH: f64 = 0.3;

/// Largest differences of two lists of states: positions [m] and attitudes, and velocities and
/// spins [m/s].
fn apart(expected: &[State], found: &[State]) -> (f64, f64) {
    let (mut pose, mut motion) = (0.0_f64, 0.0_f64);
    for (a, b) in expected.iter().zip(found) {
        let same = if a.attitude.dot(&b.attitude) < 0.0 { -1.0 } else { 1.0 };
        pose = pose.max((a.position - b.position).amax());
        pose = pose.max((a.attitude - same * b.attitude).amax());
        motion = motion.max((a.velocity - b.velocity).amax());
        motion = motion.max(REACH * (a.spin - b.spin).amax());
    }
    (pose, motion)
}

/// Checks that two lists of states agree. Rounding differs, and every impact amplifies differences.
/// The tolerances are those for one body (`native/symmetric.rs`).
fn check_same(name: &str, expected: &[State], found: &[State], step: u64) {
    let (pose, motion) = apart(expected, found);
    assert!(pose < 1e-7 && motion < 2e-6, "{name}, step {step}: {pose:e}, {motion:e} m/s");
}

#[test]
fn turning_the_whole_scene_turns_the_answer() {
    let scene = heap();
    let usual = scene.run(LANDING);
    for q in [[0.9, 0.1, -0.3, 0.2], [0.2, 0.7, 0.6, -0.3], [0.0, 1.0, 0.0, 0.0]] {
        let q = Vector4::from(q).normalize();
        let turn = rotation(&q);
        let turned = |state: &State| turned(state, &q);
        let mut other = scene.clone();
        other.parameters.ground = Some(Plane::new(turn * Vector3::z(), 0.0).unwrap());
        other.parameters.gravity = turn * scene.parameters.gravity;
        other.states = scene.states.iter().map(turned).collect();
        for (a, b) in usual.iter().zip(other.run(LANDING)) {
            let expected: Vec<_> = a.next_states().iter().map(turned).collect();
            check_same("turned", &expected, b.next_states(), a.index);
        }
    }
}

#[test]
fn a_mirrored_scene_gives_the_mirrored_answer() {
    let scene = heap();
    let other = Scene { states: scene.states.iter().map(mirrored).collect(), ..scene.clone() };
    for (a, b) in scene.run(LANDING).iter().zip(other.run(LANDING)) {
        let expected: Vec<_> = a.next_states().iter().map(mirrored).collect();
        check_same("mirrored", &expected, b.next_states(), a.index);
    }
}

#[test]
fn renumbering_the_bodies_permutes_the_answer() {
    let scene = heap();
    let usual = scene.run(LANDING);
    for order in [[1, 0, 2], [2, 1, 0], [1, 2, 0]] {
        let mut other = scene.clone();
        other.parameters.bodies = order.map(|i| scene.parameters.bodies[i].clone()).to_vec();
        other.states = order.map(|i| scene.states[i]).to_vec();
        for (a, b) in usual.iter().zip(other.run(LANDING)) {
            let expected = order.map(|i| a.next_states()[i]);
            check_same("renumbered", &expected, b.next_states(), a.index);
        }
    }
}

/// Two bodies, boxes or cubes, that collide in empty space while spinning.
fn meeting(cubes: bool) -> impl Strategy<Value = Scene> {
    let body = move || {
        (0.2..5.0, proptest::array::uniform3(0.1..0.3)).prop_map(move |(mass, [a, b, c])| {
            if cubes { solid_box(mass, a, a, a) } else { solid_box(mass, a, b, c) }
        })
    };
    let turning = || (quaternion(), vector(4.0));
    let friction = prop_oneof![1 => Just(0.0), 4 => 0.05..1.0];
    (body(), body(), turning(), turning(), vector(0.15), 0.5..4.0, friction).prop_map(
        |(first, second, (q, spin), (r, turn), aside, speed, friction)| {
            let place = |position: Vector3<f64>, q: Vector4<f64>, spin: Vector3<f64>| State {
                position,
                attitude: q.normalize(),
                velocity: Vector3::zeros(),
                spin,
            };
            // High above the ground, and farther apart than the reach of both bodies.
            let height = Vector3::new(0.0, 0.0, 20.0);
            let mut a = place(height - 1.1 * Vector3::x() + aside, q, spin);
            a.velocity[0] = speed;
            let bodies = vec![(first, a), (second, place(height, r, turn))];
            let mut scene = Scene::new(bodies, friction, 0.002);
            scene.parameters.gravity = Vector3::zeros();
            scene
        },
    )
}

fn each(count: u32, scenes: impl Strategy<Value = Scene>, check: impl Fn(&Scene)) {
    let config = ProptestConfig { rng_seed: RngSeed::Fixed(31), ..cases(count) };
    let outcome = TestRunner::new(config).run(&scenes, |scene| {
        check(&scene);
        Ok(())
    });
    outcome.unwrap_or_else(|failure| panic!("{failure}"));
}

/// Linear momentum, and angular momentum about the initial position of the second body.
fn momentum(scene: &Scene, states: &[State]) -> [Vector3<f64>; 2] {
    let centre = scene.states[1].position;
    let mut sum = [Vector3::zeros(); 2];
    for (body, state) in scene.parameters.bodies.iter().zip(states) {
        let linear = body.mass() * state.velocity;
        sum[0] += linear;
        let Parameters { rotation: form, time_step, .. } = &scene.parameters;
        let turning = form.momentum(body.inertia(), &state.spin, *time_step);
        sum[1] += (state.position - centre).cross(&linear) + rotation(&state.attitude) * turning;
    }
    sum
}

/// Checks that a collision with friction conserves both momenta, for two cubes and for two boxes.
/// The tolerance covers some hundred steps with velocity errors of 1e-12 m/s.
#[test]
fn contacts_of_a_pair_keep_its_momentum() {
    for cubes in [true, false] {
        each(60, meeting(cubes), |scene| {
            let start = momentum(scene, &scene.states);
            for record in scene.run(400) {
                let now = momentum(scene, record.next_states());
                for (kind, (now, start)) in now.iter().zip(&start).enumerate() {
                    let change = (now - start).amax();
                    assert!(change < 1e-10, "step {}, {kind}: {change:e}", record.index);
                }
            }
        });
    }
}

fn energy(scene: &Scene, states: &[State]) -> f64 {
    let Parameters { bodies, gravity, .. } = &scene.parameters;
    let of_one = |(body, state): (&RigidBody, &State)| {
        0.5 * body.mass() * state.velocity.norm_squared()
            + 0.5 * state.spin.dot(&(body.inertia() * state.spin))
            - body.mass() * gravity.dot(&state.position)
    };
    bodies.iter().zip(states).map(of_one).sum()
}

/// Largest energy that a step may add [J].
///
/// The step's equations times the new velocities are E⁺ − E = Σ p·V − (losses of the impulses).
/// Here V = V_A − V_B at the touching point, in the initial configuration. The laws act on the mean
/// motion d of the point seen from B: p·d ≤ −p_n φ/h, with the initial gap φ. Furthermore
///
/// ```text
/// |V − d| ≤ |ω_A × y| θ_A + |ω_B × a| θ_B + |ω_B| |δ|,   θ = ½ h |ω⁺|
/// ```
///
/// with the arms y and a of the point from A and B, and its displacement δ relative to B's centre.
/// A finite turn moves a point along a chord, and B sees it from its own new orientation.
fn most_gain(scene: &Scene, record: &StepRecord) -> f64 {
    let h = scene.parameters.time_step;
    let mut most = 0.0;
    for (contact, found) in record.first().contacts.iter().zip(&record.first().solution.contacts) {
        let (p, a) = (h * found.force, contact.key.body);
        let world_spin = |index: usize| {
            rotation(&record.states()[index].attitude) * record.next_states()[index].spin
        };
        let way =
            |index: usize| record.next_states()[index].position - record.states()[index].position;
        let spin = world_spin(a);
        let mut apart = spin.cross(&contact.arm).norm() * 0.5 * h * spin.norm();
        if let Partner::Body(b) = contact.key.partner {
            let arm = record.states()[a].position + contact.arm - record.states()[b].position;
            let turn = world_spin(b);
            let delta = (way(a) - way(b)).norm() + h * spin.norm() * contact.arm.norm();
            apart += turn.cross(&arm).norm() * 0.5 * h * turn.norm() + turn.norm() * delta;
        }
        most += p.norm() * apart + h * found.normal_force * (-contact.gap).max(0.0) / h;
    }
    most
}

/// Checks the energy of every step of collisions and a landing, in the tutorial's form of rotation.
/// Its gyroscopic term does no work at the end of the step. The tolerance is the residual times the
/// momentum.
#[test]
fn no_step_adds_more_energy_than_its_turn_can() {
    let check = |scene: &Scene, steps: usize| {
        let mut scene = scene.clone();
        scene.parameters.rotation = Rotation::Tutorial;
        for record in scene.run(steps) {
            let [before, after] =
                [record.states(), record.next_states()].map(|states| energy(&scene, states));
            let gain = after - before - most_gain(&scene, &record);
            assert!(gain < 1e-9 * (1.0 + before.abs()), "step {}: {gain:e} J", record.index);
        }
    };
    each(60, meeting(false), |scene| check(scene, 400));
    check(&heap(), 300);
}

/// Checks two equal cubes exactly on top of each other, rotated together by any angle. They have
/// four contacts, at the corners, each with a quarter of the weight.
#[test]
fn exactly_aligned_corners_make_four_contacts() {
    for angle in [0.0, 0.3, std::f64::consts::FRAC_PI_4, 1.0] {
        let turned = |z: f64| State {
            attitude: Vector4::new((0.5_f64 * angle).cos(), 0.0, 0.0, (0.5_f64 * angle).sin()),
            ..at(0.3, -0.2, z)
        };
        let cube = || solid_box(1.0, 0.1, 0.1, 0.1);
        let scene = Scene::new(vec![(cube(), turned(0.1)), (cube(), turned(0.3))], 0.5, 0.002);
        for record in scene.run(50) {
            let between = record
                .first()
                .solution
                .contacts
                .iter()
                .filter(|c| c.key.partner != Partner::Ground);
            let forces: Vec<f64> = between.map(|contact| contact.normal_force).collect();
            assert_eq!(forces.len(), 4, "{angle}, step {}: {forces:?}", record.index);
            for force in forces {
                assert!((force - 0.25 * GRAVITY).abs() < 1e-6, "{angle}: {force}");
            }
        }
    }
}

/// Checks a stack of five boxes with offsets of 1e-9 m and rad. Each box has at least four contacts
/// below it, their forces carry the weight, and the stack stays.
#[test]
fn a_stack_stands_under_drifts_of_a_nanometre() {
    let drifts = proptest::collection::vec((vector(1e-9), vector(5e-10)), 5).prop_map(|drifts| {
        let bodies = drifts.into_iter().enumerate().map(|(i, (shift, turn))| {
            let mut state = at(0.0, 0.0, 0.1 + 0.2 * i as f64);
            // Gaps larger than the tilts can close.
            state.position += shift + Vector3::new(0.0, 0.0, 4e-9 * (i + 1) as f64);
            state.attitude = Vector4::new(1.0, turn[0], turn[1], turn[2]).normalize();
            (solid_box(1.0, 0.15, 0.15, 0.1), state)
        });
        Scene::new(bodies.collect(), 0.5, 0.002)
    });
    each(40, drifts, |scene| {
        for record in scene.run(60) {
            let end = record.next_states();
            let (moved, _) = apart(&scene.states, end);
            assert!(moved < 1e-7, "step {}: {moved:e} m", record.index);
            if record.index < 10 {
                continue;
            }
            for i in 0..5 {
                let below = if i == 0 { Partner::Ground } else { Partner::Body(i - 1) };
                let under = record.first().solution.contacts.iter().filter(|contact| {
                    let key = &contact.key;
                    key.body == i && key.partner == below
                        || Partner::Body(key.body) == below && key.partner == Partner::Body(i)
                });
                let forces: Vec<f64> = under.map(|contact| contact.normal_force).collect();
                let (count, force) = (forces.len(), forces.iter().sum::<f64>());
                let weight = GRAVITY * (5 - i) as f64;
                assert!(count >= 4, "step {}, box {i}: {count} contacts", record.index);
                assert!((force - weight).abs() < 1e-4 * weight, "{i}: {force} of {weight}");
            }
        }
    });
}

/// Checks that a search does not depend on earlier queries of the same memory.
#[test]
fn contact_search_is_independent_of_earlier_queries() {
    let cube = || solid_box(1.0, 0.5, 0.5, 0.5);
    let stacked = vec![(cube(), at(0.0, 0.0, 0.5)), (cube(), at(0.0, 0.0, 1.5))];
    let scene = Scene::new(stacked, 0.5, 0.002);
    let (world, stacked) = (scene.world(), &scene.states);
    let sunk = [at(0.0, 0.0, 0.5), at(0.0, 0.0, 1.499)];
    let mut fresh = Candidates::new();
    fresh.find(Detection::default(), &world, stacked, stacked);
    let mut asked = Candidates::new();
    assert!(asked.admit_missed(&world, stacked, &sunk, 1e-9));
    asked.find(Detection::default(), &world, stacked, stacked);
    assert_eq!(asked.contacts(), fresh.contacts());
    assert_eq!(fresh.contacts().len(), 8);
}

/// Checks a repeated search of the same step. Contacts that were added by the first search are
/// found at once, and only once. They disappear as soon as a body has moved.
#[test]
fn a_search_that_is_repeated_finds_every_contact_once() {
    let (cube, apart) =
        (|| solid_box(1.0, 0.1, 0.1, 0.1), [at(0.0, 0.0, 1.0), at(0.0, 0.0, 1.202)]);
    let world = Scene::new(apart.map(|state| (cube(), state)).to_vec(), 0.5, 0.002).world();
    let meeting = [apart[0], at(0.0, 0.0, 1.199)];
    let mut candidates = Candidates::new();
    let mut joined = Vec::new();
    for _ in 0..3 {
        candidates.clear();
        candidates.find(Detection::default(), &world, &apart, &apart);
        candidates.clear();
        assert!(candidates.admit_missed(&world, &apart, &meeting, 0.0));
        joined = candidates.contacts().iter().map(|contact| contact.key).collect();
        assert_eq!(joined.len(), 4);
    }
    candidates.find(Detection::default(), &world, &apart, &apart);
    let found: Vec<_> = candidates.contacts().iter().map(|contact| contact.key).collect();
    assert_eq!(found, joined);

    let moved = [apart[0], at(0.0, 0.0, 1.203)];
    candidates.find(Detection::default(), &world, &moved, &moved);
    assert!(candidates.contacts().is_empty());
}
