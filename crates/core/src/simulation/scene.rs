//! The two scenes of the tutorial: constants of a [world](crate::world) and initial states.

use super::random::random_attitude;
use crate::contact::Plane;
use crate::error::Error;
use crate::mechanics::{RigidBody, Rotation, State};
use crate::world::Parameters;
use nalgebra::{Matrix3, Vector3, Vector4};

/// Defaults of a scene. All can be changed on the command line.
#[derive(Debug, Clone, PartialEq)]
pub struct TutorialScene {
    /// Name on the command line.
    pub name: &'static str,
    /// Number of rows of the trajectory.
    pub rows: u64,
    /// Time step h (s).
    pub time_step: f64,
    /// Gravity g (m/s²).
    pub gravity: Vector3<f64>,
    /// Initial height r_z (m).
    pub height: f64,
    /// Initial velocity v (m/s).
    pub velocity: Vector3<f64>,
    /// Initial spin ω (rad/s), body frame.
    pub spin: Vector3<f64>,
}

/// Mass m of the tutorial's cube (kg).
pub const CUBE_MASS: f64 = 10.0;
/// Inertia of the tutorial's cube as a multiple of E₃ (kg m²).
pub const CUBE_INERTIA: f64 = 0.01;
/// Half the side of the tutorial's cube (m).
pub const CUBE_HALF_SIDE: f64 = 1.0;
/// Coefficient of friction μ of the tutorial.
pub const FRICTION: f64 = 0.3;

impl TutorialScene {
    /// The cube thrown on the ground.
    pub fn drop() -> Self {
        Self {
            name: "drop",
            rows: 1000,
            time_step: 0.002,
            gravity: Vector3::new(0.0, 0.0, -9.81),
            height: 2.5,
            velocity: Vector3::new(0.0, 4.0, 0.0),
            spin: Vector3::new(0.0, -2.0, 1.0),
        }
    }

    /// The cube floating without gravity.
    pub fn floating() -> Self {
        Self {
            name: "floating",
            rows: 1200,
            time_step: 0.001,
            gravity: Vector3::zeros(),
            height: 3.0,
            velocity: Vector3::new(2.0, 0.0, 0.0),
            spin: Vector3::new(2.0, 4.0, 6.0),
        }
    }

    /// State at step 0 with the given attitude.
    pub fn start(&self, attitude: Vector4<f64>) -> State {
        State {
            position: Vector3::new(0.0, 0.0, self.height),
            attitude,
            velocity: self.velocity,
            spin: self.spin,
        }
    }

    /// Attitude at step 0: drawn from `seed` for the drop, upright for the floating cube.
    pub fn attitude(&self, seed: u32) -> Vector4<f64> {
        if self.name == "floating" {
            Vector4::new(1.0, 0.0, 0.0, 0.0)
        } else {
            random_attitude(seed)
        }
    }
}

/// Constants of the drop scene.
///
/// # Errors
/// Those of [`RigidBody::new`], which do not occur for these numbers.
pub fn tutorial_parameters() -> Result<Parameters, Error> {
    let scene = TutorialScene::drop();
    Ok(Parameters {
        bodies: vec![tutorial_cube()?],
        ground: Some(Plane::level()),
        gravity: scene.gravity,
        friction: FRICTION,
        time_step: scene.time_step,
        rotation: Rotation::Tutorial,
    })
}

/// The tutorial's cube: side 2 m, mass 10 kg, inertia 0.01·E₃ kg m².
///
/// # Errors
/// Those of [`RigidBody::new`], which do not occur for these numbers.
pub fn tutorial_cube() -> Result<RigidBody, Error> {
    let inertia = Matrix3::from_diagonal_element(CUBE_INERTIA);
    RigidBody::with_box_corners(CUBE_MASS, inertia, Vector3::repeat(CUBE_HALF_SIDE))
}
