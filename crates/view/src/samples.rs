//! Films for tests, computed from closed-form motions.

use crate::film::{
    Film, FilmBody, FilmContact, FilmFrame, FilmGround, FilmJoint, FilmLoad, FilmPartner, FilmPose,
    Status,
};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};

/// Gravity g (m/s²).
const GRAVITY: f64 = 9.81;
/// Half side (m) and mass (kg) of the cube.
const HALF_SIDE: f64 = 1.0;
const MASS: f64 = 10.0;
/// Initial height (m).
const HEIGHT: f64 = 2.5;

/// Joint between two bodies, or a body and the world, at their centres.
pub fn joint(body: usize, other: Option<usize>) -> FilmJoint {
    FilmJoint {
        name: String::new(),
        body,
        other,
        anchor: Vector3::zeros(),
        other_anchor: Vector3::zeros(),
        axis: None,
        turns: true,
        slides: false,
    }
}

/// Cube that falls to the ground and then slides while it turns about the vertical. The film has
/// `steps` steps. The cube lands at 0.553 s.
pub fn falling_cube(steps: u64) -> Film {
    let film = Film {
        title: "a falling cube".to_owned(),
        gravity: Vector3::new(0.0, 0.0, -GRAVITY),
        ground: Some(FilmGround { normal: Vector3::z(), offset: 0.0 }),
        ..floating_cube(0)
    };
    let frame = |k: u64| {
        let time = k as f64 * film.time_step;
        let height = HEIGHT - 0.5 * GRAVITY * time * time;
        let rests = height <= HALF_SIDE;
        let force = Vector3::new(0.0, 0.0, MASS * GRAVITY / 4.0);
        let position = Vector3::new(0.0, 4.0 * time, height.max(HALF_SIDE));
        let attitude = UnitQuaternion::from_euler_angles(0.0, 0.0, time);
        let contact = |corner: usize| FilmContact {
            body: 0,
            partner: FilmPartner::Ground,
            point: position + attitude * film.bodies[0].points[corner],
            key: corner as u64,
            force,
            normal: Vector3::z(),
            friction: film.friction,
        };
        let fallen = if rests { 0.0 } else { -GRAVITY * time };
        FilmFrame {
            kinetic: 0.5 * MASS * (16.0 + fallen * fallen) + 0.5,
            potential: MASS * GRAVITY * height.max(HALF_SIDE),
            poses: vec![FilmPose {
                position,
                attitude,
                velocity: Vector3::new(0.0, 4.0, fallen),
                spin: Vector3::z(),
            }],
            contacts: (0..4).filter(|_| rests && k < steps).map(contact).collect(),
            status: if rests { Status::Converged } else { Status::Free },
            ..moment(k, time)
        }
    };
    Film { frames: ended((0..=steps).map(frame)), ..film.clone() }
}

/// Rotating cube without gravity or ground, for `steps` steps.
pub fn floating_cube(steps: u64) -> Film {
    let time_step = 0.002;
    let corner = |i: usize| {
        Vector3::from_fn(|axis, _| if i >> axis & 1 == 1 { HALF_SIDE } else { -HALF_SIDE })
    };
    let frame = |k: u64| {
        let time = k as f64 * time_step;
        FilmFrame {
            kinetic: 0.5 * MASS * 4.0 + 0.5 * 9.0,
            poses: vec![FilmPose {
                position: Vector3::new(2.0 * time, 0.0, 3.0),
                attitude: UnitQuaternion::from_euler_angles(3.0 * time, 0.0, 0.0),
                velocity: Vector3::new(2.0, 0.0, 0.0),
                spin: Vector3::new(3.0, 0.0, 0.0),
            }],
            ..moment(k, time)
        }
    };
    Film {
        title: "a floating cube".to_owned(),
        facts: Vec::new(),
        takeover: None,
        time_step,
        every: 1,
        gravity: Vector3::zeros(),
        friction: 0.3,
        ground: None,
        fixed: Vec::new(),
        bodies: vec![FilmBody {
            name: String::new(),
            pieces: Vec::new(),
            mass: MASS,
            inertia: Matrix3::identity(),
            points: (0..8).map(corner).collect(),
            load: FilmLoad::default(),
            colour: None,
            label: String::new(),
        }],
        joints: Vec::new(),
        frames: ended((0..=steps).map(frame)),
    }
}

fn moment(index: u64, time: f64) -> FilmFrame {
    FilmFrame {
        index,
        time,
        poses: Vec::new(),
        kinetic: 0.0,
        potential: 0.0,
        contacts: Vec::new(),
        ties: Vec::new(),
        status: Status::Free,
        iterations: 0,
        residual: 0.0,
    }
}

/// Marks the last frame, which has no step.
fn ended(frames: impl Iterator<Item = FilmFrame>) -> Vec<FilmFrame> {
    let mut frames: Vec<_> = frames.collect();
    if let Some(last) = frames.last_mut() {
        last.status = Status::End;
    }
    frames
}
