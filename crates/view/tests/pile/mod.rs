//! Synthetic film of a hundred bodies: a standing wall of sixty bricks, balls that roll down a
//! fixed ramp, and flying capsules, octahedra and rounded boxes.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use tumble_view::{
    Film, FilmBody, FilmContact, FilmFixed, FilmFrame, FilmGround, FilmHull, FilmLoad, FilmPartner,
    FilmPiece, FilmPose, Status,
};

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

pub fn cuboid(half: [f64; 3], radius: f64) -> FilmPiece {
    let corner =
        |i: usize| Vector3::from_fn(|k, _| if i >> k & 1 == 1 { half[k] } else { -half[k] });
    let faces =
        [[0, 2, 6, 4], [1, 3, 7, 5], [0, 1, 5, 4], [2, 3, 7, 6], [0, 1, 3, 2], [4, 5, 7, 6]];
    FilmPiece::Hull(FilmHull {
        vertices: (0..8).map(corner).collect(),
        faces: faces.map(|face| face.to_vec()).to_vec(),
        radius,
        name: None,
    })
}

fn octahedron(size: f64) -> FilmPiece {
    let vertices = (0..3).flat_map(|k| [-size, size].map(|x| Vector3::ith(k, x))).collect();
    let faces = (0..8).map(|i| vec![i & 1, 2 + (i >> 1 & 1), 4 + (i >> 2 & 1)]).collect();
    FilmPiece::Hull(FilmHull { vertices, faces, ..FilmHull::default() })
}

/// Ramp of width 3 m that descends along y and ends at y = 0.
fn ramp() -> FilmPiece {
    let (run, rise) = (3.0, 3.0 * SLOPE.tan());
    let end = |x: f64| [[x, 0.0, 0.0], [x, -run, 0.0], [x, -run, rise]].map(Vector3::from);
    FilmPiece::Hull(FilmHull {
        vertices: [end(-1.5), end(1.5)].concat(),
        faces: vec![
            vec![0, 1, 2],
            vec![3, 4, 5],
            vec![0, 1, 4, 3],
            vec![1, 2, 5, 4],
            vec![0, 2, 5, 3],
        ],
        ..FilmHull::default()
    })
}

fn body(name: String, pieces: Vec<FilmPiece>) -> FilmBody {
    FilmBody {
        name,
        mass: 1.0,
        inertia: Matrix3::identity() * 0.01,
        points: Vec::new(),
        pieces,
        load: FilmLoad::default(),
        colour: None,
        label: String::new(),
    }
}

/// Kind and geometry of body `b`.
fn pieces(b: usize) -> (&'static str, Vec<FilmPiece>) {
    let ends = |a: f64, b: f64| [Vector3::new(0.0, 0.0, a), Vector3::new(0.0, 0.0, b)];
    match b {
        0..60 => ("brick", vec![cuboid(BRICK, 0.0)]),
        60..75 => ("ball", vec![FilmPiece::Sphere { centre: Vector3::zeros(), radius: BALL }]),
        75..85 => ("capsule", vec![FilmPiece::Capsule { ends: ends(-0.2, 0.2), radius: 0.09 }]),
        85..92 => ("octahedron", vec![octahedron(0.22)]),
        92..98 => ("rounded box", vec![cuboid([0.14, 0.1, 0.07], 0.05)]),
        // A hammer of two pieces.
        _ => {
            let handle = FilmPiece::Capsule { ends: ends(-0.3, 0.2), radius: 0.04 };
            let FilmPiece::Hull(mut head) = cuboid([0.2, 0.08, 0.08], 0.0) else {
                unreachable!("a cuboid is a hull")
            };
            head.vertices.iter_mut().for_each(|vertex| vertex.z += 0.2);
            ("hammer", vec![handle, FilmPiece::Hull(head)])
        }
    }
}

/// Pose of body `b` at time `t`.
fn pose(b: usize, t: f64) -> FilmPose {
    let still = FilmPose {
        position: Vector3::zeros(),
        attitude: UnitQuaternion::identity(),
        velocity: Vector3::zeros(),
        spin: Vector3::zeros(),
    };
    if b < COLUMNS * ROWS {
        let (row, column) = (b / COLUMNS, b % COLUMNS);
        // Every other row is offset by half a brick.
        let x = 2.0 * BRICK[0] * (column as f64 - 4.75 + 0.5 * (row % 2) as f64);
        let z = BRICK[2] * (2 * row + 1) as f64;
        return FilmPose { position: Vector3::new(x, 1.5, z), ..still };
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
        return FilmPose {
            position: x - down * (start - way) + up * BALL,
            attitude: UnitQuaternion::from_axis_angle(&-Vector3::x_axis(), way / BALL),
            velocity: down * speed,
            spin: -Vector3::x() * (speed / BALL),
        };
    }
    // Thrown upwards from separate places, with a flight time beyond the end of the film.
    let k = (b - 75) as f64;
    let velocity = Vector3::new(0.1 * (k % 5.0 - 2.0), 0.2, 4.6 - GRAVITY * t);
    let start = Vector3::new(0.55 * (k % 5.0 - 2.0), -0.3 + 0.45 * (k / 5.0).floor(), 1.5);
    let spin = Vector3::new(1.0 + 0.3 * k, 2.0, -1.0);
    let fall = Vector3::new(velocity.x, velocity.y, 4.6 - 0.5 * GRAVITY * t) * t;
    let attitude = UnitQuaternion::from_scaled_axis(spin * t);
    FilmPose { position: start + fall, attitude, velocity, spin }
}

/// Contacts of the wall. Each brick rests on two bricks of the row below or on the ground, and
/// carries the load above it.
fn contacts() -> Vec<FilmContact> {
    let mut contacts = Vec::new();
    for b in 0..COLUMNS * ROWS {
        let pose = pose(b, 0.0);
        let row = b / COLUMNS;
        let load = GRAVITY * (ROWS - row) as f64 / 2.0;
        for (key, side) in [(0u64, -0.1), (1, 0.1)] {
            let partner = match row {
                0 => FilmPartner::Ground,
                // Row 1 is shifted to the right, row 2 back to the left.
                _ => {
                    let shift = if row % 2 == 1 { key } else { key.wrapping_sub(1) };
                    let column = (b % COLUMNS) as i64 + shift as i64;
                    let column = column.clamp(0, COLUMNS as i64 - 1);
                    FilmPartner::Body((row - 1) * COLUMNS + column as usize)
                }
            };
            contacts.push(FilmContact {
                body: b,
                partner,
                point: pose.position + Vector3::new(side, 0.0, -BRICK[2]),
                key,
                force: Vector3::z() * load,
                normal: Vector3::z(),
                friction: 0.5,
            });
        }
    }
    contacts
}

/// Film with `steps` steps.
pub fn film(steps: u64) -> Film {
    let bodies = (0..100).map(|b| {
        let (name, pieces) = pieces(b);
        body(format!("{name} {b}"), pieces)
    });
    let standing = contacts();
    let frame = |k: u64| {
        let time = k as f64 * TIME_STEP;
        let rolls = |b: usize| {
            let pose = pose(b, time);
            let up = Vector3::new(0.0, SLOPE.sin(), SLOPE.cos());
            FilmContact {
                body: b,
                partner: FilmPartner::Fixed(0),
                point: pose.position - up * BALL,
                key: 0,
                force: up * (GRAVITY * SLOPE.cos()),
                normal: up,
                friction: 0.5,
            }
        };
        let is_last = k == steps;
        let contacts = standing.iter().copied().chain((60..75).map(rolls));
        let poses: Vec<_> = (0..100).map(|b| pose(b, time)).collect();
        let of_one =
            |pose: &FilmPose| [pose.velocity.norm_squared() / 2.0, GRAVITY * pose.position[2]];
        let [kinetic, potential] = [0, 1].map(|part| poses.iter().map(|p| of_one(p)[part]).sum());
        FilmFrame {
            index: k,
            time,
            poses,
            kinetic,
            potential,
            contacts: contacts.filter(|_| !is_last).collect(),
            ties: Vec::new(),
            status: if is_last { Status::End } else { Status::Converged },
            iterations: if is_last { 0 } else { 3 },
            residual: if is_last { 0.0 } else { 1e-12 },
        }
    };
    Film {
        title: "a hundred bodies, made by hand".to_owned(),
        facts: Vec::new(),
        takeover: None,
        time_step: TIME_STEP,
        every: 1,
        gravity: Vector3::new(0.0, 0.0, -GRAVITY),
        friction: 0.5,
        ground: Some(FilmGround { normal: Vector3::z(), offset: 0.0 }),
        fixed: vec![FilmFixed { name: "ramp".to_owned(), pieces: vec![ramp()] }],
        bodies: bodies.collect(),
        joints: Vec::new(),
        frames: (0..=steps).map(frame).collect(),
    }
}
