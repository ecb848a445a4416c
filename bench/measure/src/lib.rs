//! Scenes of several boxes on level ground in the format of `bench/scenes/*.json`.
//!
//! The programs of `scripts/bench` use them.

use nalgebra::{Matrix3, SVector, Vector3};
use serde::Deserialize;
use tumble_core::contact::Plane;
use tumble_core::error::Error;
use tumble_core::geometry::Piece;
use tumble_core::mechanics::{RigidBody, Rotation, State};
use tumble_core::simulation::{Motion, Simulation};
use tumble_core::solver::native::NativeSolver;
use tumble_core::world::{Parameters, World};

/// Boxes on the plane z = 0 and the number of steps.
#[derive(Deserialize)]
pub struct BenchScene {
    /// Number of steps.
    pub steps: usize,
    /// Time step h (s).
    pub step_seconds: f64,
    /// Coefficient of friction μ.
    pub friction: f64,
    /// Gravitational acceleration g (m/s²).
    pub gravity: [f64; 3],
    /// Moving boxes.
    pub boxes: Vec<Cuboid>,
    /// Fixed boxes, parallel to the world's axes.
    #[serde(default)]
    pub walls: Vec<Wall>,
}

/// Fixed box.
#[derive(Deserialize)]
pub struct Wall {
    /// Half side lengths (m).
    pub half_sides: [f64; 3],
    /// Centre (m).
    pub centre: [f64; 3],
}

/// Box and its initial state.
#[derive(Deserialize)]
pub struct Cuboid {
    /// Half side lengths (m).
    pub half_sides: [f64; 3],
    /// Mass (kg).
    pub mass: f64,
    /// Principal moments of inertia (kg m²).
    pub inertia: [f64; 3],
    /// Initial state r, q (scalar first), v, ω (body frame).
    pub start: [f64; 13],
}

impl BenchScene {
    /// World of the scene.
    pub fn world(&self) -> Result<World, Error> {
        let body = |cuboid: &Cuboid| {
            let inertia = Matrix3::from_diagonal(&cuboid.inertia.into());
            RigidBody::with_box_corners(cuboid.mass, inertia, cuboid.half_sides.into())
        };
        let fixed = |wall: &Wall| {
            let piece = Piece::cuboid(wall.half_sides.into())?;
            piece.moved_by(&Matrix3::identity(), &wall.centre.into())
        };
        let world = World::new(Parameters {
            bodies: self.boxes.iter().map(body).collect::<Result<_, _>>()?,
            ground: Some(Plane::level()),
            gravity: Vector3::from(self.gravity),
            friction: self.friction,
            time_step: self.step_seconds,
            rotation: Rotation::Momentum,
        })?;
        Ok(world.with_fixed(self.walls.iter().map(fixed).collect::<Result<_, Error>>()?))
    }

    /// Simulation from the initial state by the given native solver.
    pub fn begin(&self, world: &World, solver: NativeSolver) -> Result<Simulation<'static>, Error> {
        let starts = self.boxes.iter().map(|cuboid| {
            State::from_vector(&SVector::<f64, 13>::from_column_slice(&cuboid.start))
        });
        Simulation::new(world.clone(), starts, Motion::contact(solver))
    }
}
