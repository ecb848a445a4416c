//! Films for tests, computed from closed-form motions.

use crate::film::{Film, Object};
use crate::shape::Shape;
use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use tumble_core::contact::Partner;
use tumble_core::geometry::Hull;
use tumble_core::joint::{Joint, JointFrame};
use tumble_core::mechanics::body::box_corners;
use tumble_core::mechanics::{RigidBody, Rotation, State};
use tumble_core::simulation::Interval;
use tumble_core::step::StepSolution;
use tumble_core::step::StepStatus;
use tumble_core::world::{Parameters, World};
use tumble_scene::output::tables::{ContactRow, IntervalRows, KeyText};

/// Gravity g (m/s²).
const GRAVITY: f64 = 9.81;
/// Half side (m) and mass (kg) of the cube.
const HALF_SIDE: f64 = 1.0;
const MASS: f64 = 10.0;
/// Initial height (m).
const HEIGHT: f64 = 2.5;
const TIME_STEP: f64 = 0.002;

/// Joint between two bodies, or a body and the world, at their centres.
pub fn joint(body: usize, other: Option<usize>) -> Joint {
    Joint::spherical(body, other, [JointFrame::at(Vector3::zeros()); 2])
}

/// Ball for drawing.
pub fn ball(centre: Vector3<f64>, radius: f64) -> Shape {
    Shape::Convex { core: Hull::point(centre).unwrap(), radius, name: None }
}

/// Contact with the normal z that carries a force.
pub fn contact(
    body: usize,
    partner: Partner,
    point: usize,
    place: Vector3<f64>,
    force: Vector3<f64>,
) -> ContactRow {
    ContactRow {
        index: 0,
        body,
        partner,
        point: place,
        normal: Vector3::z(),
        force,
        slip: Vector3::zeros(),
        gap: 0.0,
        radius: 0.0,
        rebound: 0.0,
        key: KeyText { point, pair: None },
        friction: 0.0,
        interval: 0,
        length: 0.0,
        moment: Vector3::zeros(),
    }
}

/// Gives a film `count` copies of its first body.
pub fn copies(film: &mut Film, count: usize) {
    film.bodies = vec![film.bodies[0].clone(); count];
    film.frames.iter_mut().for_each(|frame| frame.states = vec![frame.states[0]; count]);
    film.world = world(count, *film.world.gravity());
}

/// Gives a film other joints.
pub fn tie(film: &mut Film, joints: Vec<Joint>) {
    let world = world(film.bodies.len(), *film.world.gravity());
    film.joints = vec![String::new(); joints.len()];
    film.world = world.with_joints(joints).unwrap();
}

/// World of cubes.
fn world(count: usize, gravity: Vector3<f64>) -> World {
    let corners = box_corners(&Vector3::repeat(HALF_SIDE));
    let body = RigidBody::new(MASS, Matrix3::identity(), &corners).unwrap();
    let parameters = Parameters {
        gravity,
        friction: 0.3,
        time_step: TIME_STEP,
        rotation: Rotation::Tutorial,
        ..Parameters::new(vec![body; count])
    };
    World::new(parameters).unwrap()
}

/// Cube that falls to the ground and then slides while it turns about the vertical. The film has
/// `steps` steps. The cube lands at 0.553 s.
pub fn falling_cube(steps: u64) -> Film {
    let world = world(1, Vector3::new(0.0, 0.0, -GRAVITY));
    let frame = |k: u64| {
        let time = k as f64 * TIME_STEP;
        let height = HEIGHT - 0.5 * GRAVITY * time * time;
        let rests = height <= HALF_SIDE;
        let force = Vector3::new(0.0, 0.0, MASS * GRAVITY / 4.0);
        let position = Vector3::new(0.0, 4.0 * time, height.max(HALF_SIDE));
        let attitude = UnitQuaternion::from_euler_angles(0.0, 0.0, time);
        let contact = |corner: usize| {
            let place = position + attitude * world.bodies()[0].contact_points()[corner].position;
            contact(0, Partner::Ground, corner, place, force)
        };
        let velocity = Vector3::new(0.0, 4.0, if rests { 0.0 } else { -GRAVITY * time });
        let status = if rests { StepStatus::Converged } else { StepStatus::Free };
        let mut step = step(&world, k, status, [position, velocity, Vector3::z()], attitude);
        step.contacts =
            std::sync::Arc::new((0..4).filter(|_| rests && k < steps).map(contact).collect());
        step
    };
    let frames = ended((0..=steps).map(frame));
    film("a falling cube", world, frames)
}

/// Rotating cube without gravity or ground, for `steps` steps.
pub fn floating_cube(steps: u64) -> Film {
    let world = world(1, Vector3::zeros());
    let frame = |k: u64| {
        let time = k as f64 * TIME_STEP;
        let attitude = UnitQuaternion::from_euler_angles(3.0 * time, 0.0, 0.0);
        let motion = [Vector3::new(2.0 * time, 0.0, 3.0), 2.0 * Vector3::x(), 3.0 * Vector3::x()];
        step(&world, k, StepStatus::Free, motion, attitude)
    };
    let frames = ended((0..=steps).map(frame));
    Film { ground: None, ..film("a floating cube", world, frames) }
}

fn film(title: &str, world: World, frames: Vec<IntervalRows>) -> Film {
    let shapes = Shape::from_body(&world.bodies()[0]);
    Film {
        title: title.to_owned(),
        variant: String::new(),
        facts: Vec::new(),
        takeover: None,
        every: 1,
        ground: world.ground().cloned(),
        world,
        bodies: vec![Object { shapes, ..Object::default() }],
        fixed: Vec::new(),
        joints: Vec::new(),
        frames,
    }
}

/// Step of a body at a position, with a velocity and a spin.
fn step(
    world: &World,
    index: u64,
    status: StepStatus,
    [position, velocity, spin]: [Vector3<f64>; 3],
    attitude: UnitQuaternion<f64>,
) -> IntervalRows {
    let [x, y, z, w] = attitude.coords.into();
    let state = State { position, attitude: [w, x, y, z].into(), velocity, spin };
    let interval = Interval::new(vec![state], Vec::new(), StepSolution::default());
    let mut step = IntervalRows::new(world, index, 0, &interval);
    step.row.status = status;
    step
}

/// Marks the last frame, which has no step.
fn ended(frames: impl Iterator<Item = IntervalRows>) -> Vec<IntervalRows> {
    let mut frames: Vec<_> = frames.collect();
    if let Some(last) = frames.last_mut() {
        last.row.status = StepStatus::End;
    }
    frames
}
