//! Synthetic film of a hundred bodies: a standing wall of sixty bricks, balls that roll down a
//! fixed ramp, and flying capsules, octahedra and rounded boxes.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use tumble_core::contact::Partner;
use tumble_core::geometry::Piece;
use tumble_core::mechanics::{RigidBody, Rotation, State};
use tumble_core::simulation::Interval;
use tumble_core::step::StepSolution;
use tumble_core::step::StepStatus;
use tumble_core::world::{Parameters, World};
use tumble_scene::output::tables::{ContactRow, IntervalRows, KeyText};
use tumble_view::{Film, Object, Shape};

/// Bricks per row of the wall, and number of rows.
const COLUMNS: usize = 10;
const ROWS: usize = 6;
/// Half extents of a brick (m).
const BRICK: [f64; 3] = [0.2, 0.1, 0.1];
/// Radius of a ball (m).
const BALL: f64 = 0.15;
/// Slope of the ramp (rad).
const SLOPE: f64 = 0.3;
const GRAVITY: f64 = 9.81;
const TIME_STEP: f64 = 0.002;

/// Box about a centre, rounded by `radius`.
fn cuboid(half: [f64; 3], centre: Vector3<f64>, radius: f64) -> Piece {
    let sign = |i: usize, axis: usize| if i >> axis & 1 == 1 { 1.0 } else { -1.0 };
    let corner = |i: usize| centre + Vector3::from_fn(|axis, _| sign(i, axis) * half[axis]);
    Piece::hull(&(0..8).map(corner).collect::<Vec<_>>(), radius).unwrap()
}

fn octahedron(size: f64) -> Piece {
    let vertices = (0..3).flat_map(|k| [-size, size].map(|x| Vector3::ith(k, x)));
    Piece::hull(&vertices.collect::<Vec<_>>(), 0.0).unwrap()
}

/// Ramp of width 3 m that descends along y and ends at y = 0.
fn ramp() -> Piece {
    let (run, rise) = (3.0, 3.0 * SLOPE.tan());
    let end = |x: f64| [[x, 0.0, 0.0], [x, -run, 0.0], [x, -run, rise]].map(Vector3::from);
    Piece::hull(&[end(-1.5), end(1.5)].concat(), 0.0).unwrap()
}

/// Kind and geometry of body `b`.
fn pieces(b: usize) -> (&'static str, Vec<Piece>) {
    let centre = Vector3::zeros();
    match b {
        0..60 => ("brick", vec![cuboid(BRICK, centre, 0.0)]),
        60..75 => ("ball", vec![Piece::sphere(BALL).unwrap()]),
        75..85 => ("capsule", vec![Piece::capsule(0.2, 0.09).unwrap()]),
        85..92 => ("octahedron", vec![octahedron(0.22)]),
        92..98 => ("rounded box", vec![cuboid([0.14, 0.1, 0.07], centre, 0.05)]),
        // A hammer of two pieces.
        _ => {
            let handle = Piece::capsule(0.25, 0.04).unwrap();
            let low = Vector3::z() * -0.05;
            let handle = handle.moved_by(&Matrix3::identity(), &low).unwrap();
            ("hammer", vec![handle, cuboid([0.2, 0.08, 0.08], Vector3::z() * 0.2, 0.0)])
        }
    }
}

fn state(
    position: Vector3<f64>,
    attitude: UnitQuaternion<f64>,
    velocity: Vector3<f64>,
    spin: Vector3<f64>,
) -> State {
    let [x, y, z, w] = attitude.coords.into();
    State { position, attitude: [w, x, y, z].into(), velocity, spin }
}

/// State of body `b` at time `t`.
fn state_at(b: usize, t: f64) -> State {
    let (zero, upright) = (Vector3::zeros(), UnitQuaternion::identity());
    if b < COLUMNS * ROWS {
        let (row, column) = (b / COLUMNS, b % COLUMNS);
        // Every other row is offset by half a brick.
        let x = 2.0 * BRICK[0] * (column as f64 - 4.75 + 0.5 * (row % 2) as f64);
        let z = BRICK[2] * (2 * row + 1) as f64;
        return state(Vector3::new(x, 1.5, z), upright, zero, zero);
    }
    if b < 75 {
        // Rolling without slip from rest: acceleration 5/7 of g sin θ.
        let (place, lane) = ((b - 60) / 5, (b - 60) % 5);
        let start = 2.6 - 0.7 * place as f64;
        let way = (0.5 * 5.0 / 7.0 * GRAVITY * SLOPE.sin() * t * t).min(start);
        let speed = if way < start { 5.0 / 7.0 * GRAVITY * SLOPE.sin() * t } else { 0.0 };
        let up = Vector3::new(0.0, SLOPE.sin(), SLOPE.cos());
        let down = Vector3::new(0.0, SLOPE.cos(), -SLOPE.sin());
        let x = Vector3::x() * (0.55 * (lane as f64 - 2.0));
        let attitude = UnitQuaternion::from_axis_angle(&-Vector3::x_axis(), way / BALL);
        let place = x - down * (start - way) + up * BALL;
        return state(place, attitude, down * speed, -Vector3::x() * (speed / BALL));
    }
    // Thrown upwards from separate places, with a flight time beyond the end of the film.
    let k = (b - 75) as f64;
    let velocity = Vector3::new(0.1 * (k % 5.0 - 2.0), 0.2, 4.6 - GRAVITY * t);
    let start = Vector3::new(0.55 * (k % 5.0 - 2.0), -0.3 + 0.45 * (k / 5.0).floor(), 1.5);
    let spin = Vector3::new(1.0 + 0.3 * k, 2.0, -1.0);
    let fall = Vector3::new(velocity.x, velocity.y, 4.6 - 0.5 * GRAVITY * t) * t;
    let attitude = UnitQuaternion::from_scaled_axis(spin * t);
    state(start + fall, attitude, velocity, spin)
}

/// Contact whose force is along the normal.
fn contact(
    body: usize,
    partner: Partner,
    key: usize,
    point: Vector3<f64>,
    force: Vector3<f64>,
) -> ContactRow {
    ContactRow {
        index: key,
        body,
        partner,
        point,
        normal: force.normalize(),
        force,
        slip: Vector3::zeros(),
        gap: 0.0,
        radius: 0.0,
        rebound: 0.0,
        key: KeyText { point: key, pair: None },
        friction: 0.0,
        interval: 0,
        length: 0.0,
        moment: Vector3::zeros(),
    }
}

/// Contacts of the wall. Each brick rests on two bricks of the row below or on the ground, and
/// carries the load above it.
fn contacts() -> Vec<ContactRow> {
    let mut contacts = Vec::new();
    for b in 0..COLUMNS * ROWS {
        let at = state_at(b, 0.0).position;
        let row = b / COLUMNS;
        let load = GRAVITY * (ROWS - row) as f64 / 2.0;
        for (key, side) in [(0usize, -0.1), (1, 0.1)] {
            let partner = match row {
                0 => Partner::Ground,
                // Row 1 is shifted to the right, row 2 back to the left.
                _ => {
                    let shift = if row % 2 == 1 { key } else { key.wrapping_sub(1) };
                    let column = (b % COLUMNS) as i64 + shift as i64;
                    let column = column.clamp(0, COLUMNS as i64 - 1);
                    Partner::Body((row - 1) * COLUMNS + column as usize)
                }
            };
            let point = at + Vector3::new(side, 0.0, -BRICK[2]);
            contacts.push(contact(b, partner, key, point, Vector3::z() * load));
        }
    }
    contacts
}

/// Film with `steps` steps.
pub fn film(steps: u64) -> Film {
    let inertia = Matrix3::identity() * 0.01;
    let rigid = |b: usize| RigidBody::from_pieces(1.0, inertia, pieces(b).1).unwrap();
    let world = World::new(Parameters {
        gravity: Vector3::new(0.0, 0.0, -GRAVITY),
        time_step: TIME_STEP,
        rotation: Rotation::Tutorial,
        ..Parameters::new((0..100).map(rigid).collect())
    });
    let ramp = ramp();
    let world = world.unwrap().with_fixed(vec![ramp]);
    let bodies = (0..100).map(|b| {
        let (name, pieces) = pieces(b);
        let shapes = pieces.iter().map(Shape::from).collect();
        Object { name: format!("{name} {b}"), shapes, ..Object::default() }
    });
    let standing = contacts();
    let frame = |k: u64| {
        let time = k as f64 * TIME_STEP;
        let rolls = |b: usize| {
            let up = Vector3::new(0.0, SLOPE.sin(), SLOPE.cos());
            let point = state_at(b, time).position - up * BALL;
            contact(b, Partner::Fixed(0), 0, point, up * (GRAVITY * SLOPE.cos()))
        };
        let states = (0..100).map(|b| state_at(b, time)).collect();
        let interval = Interval::new(states, Vec::new(), StepSolution::default());
        let mut step = IntervalRows::new(&world, k, 0, &interval);
        if k < steps {
            step.contacts =
                std::sync::Arc::new(standing.iter().cloned().chain((60..75).map(rolls)).collect());
            (step.row.status, step.row.iterations) = (StepStatus::Converged, 3);
            step.row.residual = 1e-12;
        }
        step
    };
    let fixed = world.fixed().iter().map(|fixed| Object {
        name: "ramp".to_owned(),
        shapes: vec![Shape::from(fixed)],
        ..Object::default()
    });
    Film {
        title: "a hundred bodies, made by hand".to_owned(),
        variant: String::new(),
        facts: Vec::new(),
        takeover: None,
        every: 1,
        ground: world.ground().cloned(),
        bodies: bodies.collect(),
        fixed: fixed.collect(),
        joints: Vec::new(),
        frames: (0..=steps).map(frame).collect(),
        world,
    }
}
