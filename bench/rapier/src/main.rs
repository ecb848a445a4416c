//! A box on the plane z = 0 by Rapier: the scene as JSON on standard input, the motion as JSON
//! on standard output.

use rapier3d_f64::prelude::*;
use rapier3d_f64::utils::OrthonormalBasis;
use serde::{Deserialize, Serialize};
use std::time::Instant;

type Failure = Box<dyn std::error::Error>;

/// What to simulate.
#[derive(Deserialize)]
struct Scene {
    steps: usize,
    step_seconds: f64,
    half_sides: [f64; 3],
    mass: f64,
    inertia: [f64; 3],
    friction: f64,
    gravity: [f64; 3],
    /// r, q (scalar first), v, ω (body).
    start: [f64; 13],
    parameters: Parameters,
    /// Whether to keep states and forces; a timed run does not.
    record: bool,
}

/// What differs from Rapier's default parameters.
#[derive(Deserialize)]
struct Parameters {
    /// Friction at each point instead of at each manifold.
    coulomb: bool,
    /// `num_solver_iterations`, the substeps.
    iterations: usize,
    /// `num_internal_pgs_iterations`, the sweeps in each.
    sweeps: usize,
    /// Natural frequency, Hz, and damping ratio of `static_contact_softness`.
    softness: [f64; 2],
}

/// What came out.
#[derive(Serialize)]
struct Motion {
    /// Of the stepping.
    seconds: f64,
    /// r, q, v, ω as in [`Scene::start`], the start first; empty if not recorded.
    states: Vec<[f64; 13]>,
    /// Force of the plane on each corner during each step, N; empty if not recorded, or if
    /// friction acts on the manifold and not on its points.
    forces: Vec<[[f64; 3]; 8]>,
}

/// The world with its two colliders.
struct Setup {
    world: PhysicsWorld,
    body: RigidBodyHandle,
    ground_collider: ColliderHandle,
    box_collider: ColliderHandle,
}

fn main() -> Result<(), Failure> {
    let scene: Scene = serde_json::from_reader(std::io::stdin())?;
    let mut setup = build(&scene);
    let mut motion = Motion { seconds: 0.0, states: Vec::new(), forces: Vec::new() };
    if scene.record {
        motion.states.push(state(&setup));
        for _ in 0..scene.steps {
            setup.world.step();
            motion.states.push(state(&setup));
            if scene.parameters.coulomb {
                motion.forces.push(forces(&setup, &scene));
            }
        }
    } else {
        let clock = Instant::now();
        for _ in 0..scene.steps {
            setup.world.step();
        }
        motion.seconds = clock.elapsed().as_secs_f64();
    }
    serde_json::to_writer(std::io::stdout(), &motion)?;
    Ok(())
}

/// The world at the start of the scene. Bodies do not fall asleep: what is measured is the
/// solver.
fn build(scene: &Scene) -> Setup {
    let mut world = PhysicsWorld::new();
    world.gravity = scene.gravity.into();
    let parameters = &mut world.integration_parameters;
    parameters.dt = scene.step_seconds;
    if scene.parameters.coulomb {
        parameters.friction_model = FrictionModel::Coulomb;
    }
    parameters.num_solver_iterations = scene.parameters.iterations;
    parameters.num_internal_pgs_iterations = scene.parameters.sweeps;
    let [frequency, damping] = scene.parameters.softness;
    parameters.static_contact_softness = SpringCoefficients::new(frequency, damping);

    let [x, y, z, qw, qx, qy, qz, vx, vy, vz, wx, wy, wz] = scene.start;
    let rotation = Rotation::from_xyzw(qx, qy, qz, qw);
    let mass = MassProperties::new(Vector::ZERO, scene.mass, scene.inertia.into());
    let body = RigidBodyBuilder::dynamic()
        .pose(Pose::from_parts(Vector::new(x, y, z), rotation))
        .linvel(Vector::new(vx, vy, vz))
        .angvel(rotation * Vector::new(wx, wy, wz))
        .additional_mass_properties(mass)
        .can_sleep(false);
    let [a, b, c] = scene.half_sides;
    let cuboid = ColliderBuilder::cuboid(a, b, c).density(0.0).friction(scene.friction);
    let (body, box_collider) = world.insert(body, cuboid);
    let plane = ColliderBuilder::new(SharedShape::halfspace(Vector::Z)).friction(scene.friction);
    let (_, ground_collider) = world.insert(RigidBodyBuilder::fixed(), plane);
    Setup { world, body, ground_collider, box_collider }
}

/// r, q, v, ω (body).
fn state(setup: &Setup) -> [f64; 13] {
    let body = &setup.world.bodies[setup.body];
    let (r, q, v) = (body.translation(), *body.rotation(), body.linvel());
    let w = q.inverse() * body.angvel();
    [r.x, r.y, r.z, q.w, q.x, q.y, q.z, v.x, v.y, v.z, w.x, w.y, w.z]
}

/// The forces of the last step on the corners, from the impulses of its contacts.
fn forces(setup: &Setup, scene: &Scene) -> [[f64; 3]; 8] {
    let mut forces = [[0.0; 3]; 8];
    let Some(pair) = setup.world.contact_pair(setup.ground_collider, setup.box_collider) else {
        return forces;
    };
    let ground_first = pair.collider1 == setup.ground_collider;
    for manifold in pair.solver_manifolds() {
        // Impulses are those on the first body, in a basis made from minus the normal.
        let against = -manifold.data.normal;
        let [tangent1, tangent2] = basis(against);
        for point in &manifold.points {
            let data = &point.data;
            let on_first = against * data.impulse
                + tangent1 * data.tangent_impulse.x
                + tangent2 * data.tangent_impulse.y;
            let on_box = if ground_first { -on_first } else { on_first };
            let place = if ground_first { point.local_p2 } else { point.local_p1 };
            let force = &mut forces[corner(place)];
            for (sum, part) in force.iter_mut().zip(on_box.to_array()) {
                *sum += part / scene.step_seconds;
            }
        }
    }
    forces
}

/// The two tangents that Rapier makes of a normal.
fn basis(normal: Vector) -> [Vector; 2] {
    let tangent = normal.orthonormal_vector();
    [tangent, normal.cross(tangent)]
}

/// The corner of the box in the octant of a point: x changes fastest, then y, then z.
fn corner(point: Vector) -> usize {
    let bit = |coordinate: f64| usize::from(coordinate > 0.0);
    bit(point.x) + 2 * bit(point.y) + 4 * bit(point.z)
}
