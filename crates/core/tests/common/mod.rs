//! Shared parts of the tests: the tutorial's model, random models, and an independent second
//! implementation of the certificate.

// Every test program compiles this file separately and uses only a part of it.
#![allow(dead_code, clippy::disallowed_methods)]

pub mod draw;
pub mod prelude;
pub mod steps;
pub mod symmetry;
pub mod turning;

use nalgebra::{Matrix3, Quaternion, SVector, Vector3, Vector4};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use tumble_core::contact::certificate::{Certificate, Certifier, Claim};
use tumble_core::contact::detection::all_contacts;
use tumble_core::contact::{Candidates, Contact, Plane};
use tumble_core::mechanics::quaternion::rotation;
use tumble_core::mechanics::{RigidBody, Rotation, State, Wrench};
use tumble_core::simulation::scene;
use tumble_core::step::{Step, StepReport, StepSolution, StepSolver};
use tumble_core::world::{Parameters, World};
use turning::{step_attitude, turned_by, turned_momentum};

/// Constants of the tutorial's thrown cube.
pub fn tutorial_parameters() -> Parameters {
    scene::tutorial_parameters().unwrap()
}

/// World with the tutorial's thrown cube above the ground.
pub fn tutorial_world() -> World {
    World::new(tutorial_parameters()).unwrap()
}

/// State from its thirteen numbers.
pub fn state(values: &[f64]) -> State {
    State::from_vector(&SVector::from_column_slice(values))
}

/// Wrench of forces at the contact points: Σ f, and τ = Σ c × Aᵀ f in the body frame.
pub fn wrench_of(body: &RigidBody, state: &State, forces: &[Vector3<f64>]) -> Wrench {
    let to_body = rotation(&state.attitude).transpose();
    let points = body.contact_points();
    Wrench {
        force: forces.iter().sum(),
        torque: points.iter().zip(forces).map(|(c, f)| c.position.cross(&(to_body * f))).sum(),
    }
}

/// The only body of a world with one body.
pub fn body(world: &World) -> &RigidBody {
    &world.bodies()[0]
}

/// Number of contact points of the body.
pub fn points(world: &World) -> usize {
    body(world).contact_points().len()
}

/// Heights of the body's points above the ground [m].
pub fn heights(world: &World, state: &State) -> Vec<f64> {
    world.heights(0, &state.pose()).collect()
}

/// Contacts of all points with the ground.
pub fn contacts(world: &World, state: &State) -> Vec<Contact> {
    let mut contacts = Vec::new();
    all_contacts(world, &[*state], &mut contacts);
    contacts
}

/// Contacts of the flagged points with the ground.
pub fn flagged_contacts(world: &World, state: &State, flags: &[bool]) -> Vec<Contact> {
    contacts(world, state).into_iter().filter(|contact| flags[contact.key.point]).collect()
}

/// Forces of a solution [N], one for every contact point of the body. A point without a contact has
/// zero.
pub fn point_forces(world: &World, solution: &StepSolution) -> Vec<Vector3<f64>> {
    let mut forces = vec![Vector3::zeros(); points(world)];
    for contact in &solution.contacts {
        forces[contact.key.point] = contact.force;
    }
    forces
}

/// Solves one step with `solver` and the contacts `candidates`, starting from the solution
/// `previous`.
pub fn solve(
    solver: &mut dyn StepSolver,
    world: &World,
    (state, wrench): (&State, &Wrench),
    candidates: &[Contact],
    previous: &StepSolution,
) -> (StepReport, StepSolution) {
    solve_after(solver, world, (state, wrench), candidates, (previous, None))
}

/// Solves one step like [`solve`], with the two solutions before it: `previous` and `earlier`.
pub fn solve_after(
    solver: &mut dyn StepSolver,
    world: &World,
    (state, wrench): (&State, &Wrench),
    candidates: &[Contact],
    (previous, earlier): (&StepSolution, Option<&StepSolution>),
) -> (StepReport, StepSolution) {
    let mut candidates = Candidates::from(candidates.to_vec());
    let mut solution = StepSolution::default();
    let (states, wrenches) = (&[*state], &[*wrench]);
    let free = &[world.free_flight(0, state, wrench)];
    let step = Step { world, states, wrenches, free, previous, earlier, interrupt: None };
    let report = solver.solve(&step, &mut candidates, &mut solution).unwrap();
    (report, solution)
}

/// Certificate of a step, from the forces of all points [N, world frame].
pub fn certify(
    world: &World,
    (old, new): (&State, &State),
    forces: &[Vector3<f64>],
    wrench: &Wrench,
) -> Certificate {
    let contacts = contacts(world, old);
    let (states, next, wrenches) = (&[*old], &[*new], &[*wrench]);
    let claim = Claim { states, next, wrenches, contacts: &contacts, joints: &[], gears: &[] };
    Certifier::new().contact_step(world, &claim, forces.iter().copied())
}

/// Second implementation of the certificate: dynamics, penetration, normal law, friction law, cone.
///
/// It multiplies quaternions, and computes the response of a point along a direction d as 1/m +
/// τ·I⁻¹τ. Here τ is the torque of a unit impulse along d.
pub fn certificate_by_hand(
    world: &World,
    (old, new): (&State, &State),
    forces: &[Vector3<f64>],
    wrench: &Wrench,
) -> [f64; 5] {
    let (h, mass, mu) = (world.time_step(), body(world).mass(), world.friction());
    let (n, offset) = (world.ground().unwrap().normal(), world.ground().unwrap().offset());
    let across = |v: Vector3<f64>| v - n * n.dot(&v);
    let q = |state: &State| {
        let [w, x, y, z] = state.attitude.into();
        Quaternion::new(w, x, y, z)
    };
    let turned = |q: Quaternion<f64>, c| (q * Quaternion::from_imag(c) * q.conjugate()).imag();
    let solved = |torque| body(world).inertia().lu().solve(&torque).unwrap();
    let (mut f, mut torque, mut reach) = (wrench.force, wrench.torque, 0.0_f64);
    let mut parts = [0.0_f64; 5];
    for (c, force) in body(world).contact_points().iter().map(|p| p.position).zip(forces) {
        f += force;
        torque += c.cross(&turned(q(old).conjugate(), *force));
        reach = reach.max(c.amax());
        let [before, after] = [old, new].map(|x| x.position + turned(q(x), c));
        let (slip, rise) = (across(after - before) / h, (n.dot(&after) - offset) / h);
        let response = |d: Vector3<f64>| {
            let torque: Vector3<f64> = c.cross(&turned(q(old).conjugate(), d));
            1.0 / mass + torque.dot(&solved(torque))
        };
        let all = [Vector3::x(), Vector3::y(), Vector3::z()].map(response).iter().sum::<f64>();
        let (w_n, w_t) = (response(*n), 0.5 * (all - response(*n)));
        let (p, normal) = (across(*force) * h, n.dot(force) * h);
        let target = w_t * p - slip;
        let radius = mu * w_t * normal.max(0.0);
        let nearest = target * if target.norm() > radius { radius / target.norm() } else { 1.0 };
        parts[1] = parts[1].max(-rise);
        parts[2] = parts[2].max((w_n * normal).min(rise).abs());
        parts[3] = parts[3].max((w_t * p - nearest).norm());
        parts[4] = parts[4].max(w_t * (p.norm() - mu * normal));
    }
    let inertia = body(world).inertia();
    let missing = match world.rotation() {
        Rotation::Tutorial => {
            let rate = solved(torque - new.spin.cross(&(inertia * new.spin)));
            old.spin + rate * h - new.spin
        }
        Rotation::Momentum => {
            let [before, after] =
                [(old.spin, -h), (new.spin, h)].map(|(spin, h)| turned_momentum(inertia, &spin, h));
            solved(before + torque * h - after)
        }
    };
    let next = match world.rotation() {
        Rotation::Tutorial => turned_by(&old.attitude, &(0.5 * h * new.spin)),
        Rotation::Momentum => step_attitude(&old.attitude, &new.spin, h),
    };
    parts[0] = [
        (old.position + new.velocity * h - new.position).amax() / h,
        (next - new.attitude).amax() * reach / h,
        (old.velocity + (f / mass + world.gravity()) * h - new.velocity).amax(),
        missing.amax() * reach,
    ]
    .into_iter()
    .fold(0.0, f64::max);
    parts
}

/// Smallest number that at least the fraction `share` of `values` does not exceed.
pub fn quantile(values: &[f64], share: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted[((share * sorted.len() as f64).ceil() as usize).clamp(1, sorted.len()) - 1]
}

/// Proptest configuration with the given number of cases. The seed is fixed unless
/// PROPTEST_RNG_SEED is set. A failing case is printed and not written to a file.
pub fn cases(cases: u32) -> ProptestConfig {
    let usual = ProptestConfig::default();
    let rng_seed = match usual.rng_seed {
        RngSeed::Random => RngSeed::Fixed(1),
        given @ RngSeed::Fixed(_) => given,
    };
    ProptestConfig { cases, rng_seed, failure_persistence: None, ..usual }
}

/// Vector with components from −`size` to `size`.
pub fn vector(size: f64) -> impl Strategy<Value = Vector3<f64>> {
    proptest::array::uniform3(-size..size).prop_map(Vector3::from)
}

/// Quaternion of norm 0.5 to 2, not a unit quaternion.
pub fn quaternion() -> impl Strategy<Value = Vector4<f64>> {
    proptest::array::uniform4(-1.0..1.0)
        .prop_map(Vector4::from)
        .prop_filter("a norm above 0.5", |q| q.norm() > 0.5)
}

/// Inertia matrix of a random body. Its second moments Σ m x² along three rotated axes are 0.05 to
/// 5 kg m² each.
pub fn inertia() -> impl Strategy<Value = Matrix3<f64>> {
    (quaternion(), proptest::array::uniform3(0.05..5.0)).prop_map(|(q, [x, y, z])| {
        let axes = rotation(&q.normalize());
        let moments = Matrix3::from_diagonal(&Vector3::new(y + z, x + z, x + y));
        let full = axes * moments * axes.transpose();
        0.5 * (full + full.transpose())
    })
}

/// Either form of the rotation.
pub fn any_rotation() -> impl Strategy<Value = Rotation> {
    proptest::sample::select(&Rotation::ALL[..])
}

/// Random body with 1 to 12 contact points above a random plane, with or without friction.
pub fn any_world() -> impl Strategy<Value = World> {
    let body = (0.1..100.0, inertia(), proptest::collection::vec(vector(2.0), 1..=12));
    let friction = prop_oneof![1 => Just(0.0), 4 => 0.05..1.0];
    let ground = prop_oneof![
        1 => Just(Plane::level()),
        1 => (vector(1.0), -1.0..1.0)
            .prop_filter("a normal", |(normal, _)| normal.norm() > 0.1)
            .prop_map(|(normal, offset)| Plane::new(normal, offset).unwrap()),
    ];
    let form = any_rotation();
    (body, vector(10.0), friction, 1e-3..0.05, ground, form).prop_map(
        |((mass, inertia, points), gravity, friction, time_step, ground, rotation)| {
            let body = RigidBody::new(mass, inertia, &points).unwrap();
            let bodies = vec![body];
            let constants =
                Parameters { bodies, ground: Some(ground), gravity, friction, time_step, rotation };
            World::new(constants).unwrap()
        },
    )
}

/// Random state. The attitude is not a unit quaternion.
pub fn any_state() -> impl Strategy<Value = State> {
    (vector(2.0), quaternion(), vector(3.0), vector(5.0)).prop_map(
        |(position, attitude, velocity, spin)| State { position, attitude, velocity, spin },
    )
}

/// Random wrench, up to 10 N and 10 N m per axis.
pub fn any_wrench() -> impl Strategy<Value = Wrench> {
    (vector(10.0), vector(10.0)).prop_map(|(force, torque)| Wrench { force, torque })
}
