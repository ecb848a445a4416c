//! Boxes on the plane z = 0 in Rapier.
//!
//! The program reads a scene as JSON from standard input and writes the motion as JSON to standard
//! output.

use rapier3d_f64::prelude::*;
use rapier3d_f64::utils::OrthonormalBasis;
use rustix::time::{ClockId, clock_gettime};
use serde::{Deserialize, Serialize};

type Failure = Box<dyn std::error::Error>;

/// Scene and output options.
#[derive(Deserialize)]
struct Scene {
    /// Number of steps before the timed ones.
    untimed: usize,
    steps: usize,
    step_seconds: f64,
    friction: f64,
    gravity: [f64; 3],
    boxes: Vec<Cuboid>,
    parameters: Parameters,
    /// True to record states and forces; a timed run does not.
    record: bool,
}

/// Box and its initial state.
#[derive(Deserialize)]
struct Cuboid {
    half_sides: [f64; 3],
    mass: f64,
    inertia: [f64; 3],
    /// Initial state r, q (scalar first), v, ω (body frame).
    start: [f64; 13],
}

/// Parameters that may differ from Rapier's defaults.
#[derive(Deserialize)]
struct Parameters {
    /// True for friction at each point instead of at each manifold.
    coulomb: bool,
    /// Number of substeps, `num_solver_iterations`.
    iterations: usize,
    /// Sweeps per substep, `num_internal_pgs_iterations`.
    sweeps: usize,
    /// Natural frequency (Hz) and damping ratio of `static_contact_softness`.
    softness: [f64; 2],
}

/// Result of a run.
#[derive(Serialize, Default)]
struct Motion {
    /// Processor time of the steps (s).
    seconds: f64,
    /// Growth of memory to its peak (KiB).
    memory_kib: u64,
    /// State r, q, v, ω of each box as in [`Cuboid::start`], starting with the initial state.
    ///
    /// Empty if not recorded.
    states: Vec<Vec<[f64; 13]>>,
    /// Force of the plane on each corner of the box during each step (N).
    ///
    /// Empty if not recorded, with several boxes, or with friction per manifold.
    forces: Vec<[[f64; 3]; 8]>,
}

/// World, bodies, and the colliders of the ground and of the first box.
struct Setup {
    world: PhysicsWorld,
    bodies: Vec<RigidBodyHandle>,
    ground_collider: ColliderHandle,
    box_collider: ColliderHandle,
}

fn main() -> Result<(), Failure> {
    let scene: Scene = serde_json::from_reader(std::io::stdin())?;
    let before = memory("VmRSS:");
    let mut setup = build(&scene)?;
    let mut motion = Motion::default();
    if scene.record {
        motion.states.push(states(&setup));
        for _ in 0..scene.steps {
            setup.world.step();
            motion.states.push(states(&setup));
            if scene.parameters.coulomb && scene.boxes.len() == 1 {
                motion.forces.push(forces(&setup, &scene));
            }
        }
    } else {
        for _ in 0..scene.untimed {
            setup.world.step();
        }
        let start = clock();
        for _ in 0..scene.steps {
            setup.world.step();
        }
        motion.seconds = clock() - start;
    }
    motion.memory_kib = memory("VmHWM:").saturating_sub(before);
    serde_json::to_writer(std::io::stdout(), &motion)?;
    Ok(())
}

/// World at the start of the scene. Bodies do not sleep, because the solver is measured.
fn build(scene: &Scene) -> Result<Setup, Failure> {
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

    let handles: Vec<_> =
        scene.boxes.iter().map(|cuboid| insert(&mut world, cuboid, scene)).collect();
    let (_, box_collider) = *handles.first().ok_or("a scene without a box")?;
    let bodies = handles.into_iter().map(|(body, _)| body).collect();
    let plane = ColliderBuilder::new(SharedShape::halfspace(Vector::Z)).friction(scene.friction);
    let (_, ground_collider) = world.insert(RigidBodyBuilder::fixed(), plane);
    Ok(Setup { world, bodies, ground_collider, box_collider })
}

fn insert(
    world: &mut PhysicsWorld,
    cuboid: &Cuboid,
    scene: &Scene,
) -> (RigidBodyHandle, ColliderHandle) {
    let [x, y, z, qw, qx, qy, qz, vx, vy, vz, wx, wy, wz] = cuboid.start;
    let rotation = Rotation::from_xyzw(qx, qy, qz, qw);
    let mass = MassProperties::new(Vector::ZERO, cuboid.mass, cuboid.inertia.into());
    let body = RigidBodyBuilder::dynamic()
        .pose(Pose::from_parts(Vector::new(x, y, z), rotation))
        .linvel(Vector::new(vx, vy, vz))
        .angvel(rotation * Vector::new(wx, wy, wz))
        .additional_mass_properties(mass)
        .can_sleep(false);
    let [a, b, c] = cuboid.half_sides;
    let collider = ColliderBuilder::cuboid(a, b, c).density(0.0).friction(scene.friction);
    world.insert(body, collider)
}

/// State r, q, v, ω (body frame) of each box.
fn states(setup: &Setup) -> Vec<[f64; 13]> {
    let state = |handle: &RigidBodyHandle| {
        let body = &setup.world.bodies[*handle];
        let (r, q, v) = (body.translation(), *body.rotation(), body.linvel());
        let w = q.inverse() * body.angvel();
        [r.x, r.y, r.z, q.w, q.x, q.y, q.z, v.x, v.y, v.z, w.x, w.y, w.z]
    };
    setup.bodies.iter().map(state).collect()
}

/// Processor time of this process (s).
fn clock() -> f64 {
    let time = clock_gettime(ClockId::ProcessCPUTime);
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}

/// Value in Linux's /proc/self/status (KiB): `VmRSS:` is resident memory, `VmHWM:` its peak.
fn memory(name: &str) -> u64 {
    let text = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = text.lines().find_map(|line| line.strip_prefix(name));
    line.and_then(|line| line.split_whitespace().next()?.parse().ok()).unwrap_or(0)
}

/// Forces of the last step on the corners (N), from the impulses of its contacts.
fn forces(setup: &Setup, scene: &Scene) -> [[f64; 3]; 8] {
    let mut forces = [[0.0; 3]; 8];
    let Some(pair) = setup.world.contact_pair(setup.ground_collider, setup.box_collider) else {
        return forces;
    };
    let ground_first = pair.collider1 == setup.ground_collider;
    for manifold in pair.solver_manifolds() {
        // Impulses act on the first body, in a basis made from the negative normal.
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

/// Two tangents that Rapier computes from a normal.
fn basis(normal: Vector) -> [Vector; 2] {
    let tangent = normal.orthonormal_vector();
    [tangent, normal.cross(tangent)]
}

/// Index of the box corner in the octant of a point: x changes fastest, then y, then z.
fn corner(point: Vector) -> usize {
    let bit = |coordinate: f64| usize::from(coordinate > 0.0);
    bit(point.x) + 2 * bit(point.y) + 4 * bit(point.z)
}
