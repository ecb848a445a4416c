//! Scenes of several boxes on level ground as `bench/scenes/*.json` has them: for the programs
//! that `scripts/bench` runs, and for `benches/several.rs`.

use nalgebra::{Matrix3, SVector, Vector3};
use serde::Deserialize;
use tumble_core::contact::Plane;
use tumble_core::error::Error;
use tumble_core::geometry::Piece;
use tumble_core::mechanics::{RigidBody, Rotation, State};
use tumble_core::simulation::{Motion, Simulation};
use tumble_core::solver::native::NativeSolver;
use tumble_core::world::{Fixed, Parameters, World};

/// Boxes on the plane z = 0, and for how many steps.
#[derive(Deserialize)]
pub struct BenchScene {
    /// How many.
    pub steps: usize,
    /// h.
    pub step_seconds: f64,
    /// μ.
    pub friction: f64,
    /// g, m/s².
    pub gravity: [f64; 3],
    /// The boxes.
    pub boxes: Vec<Cuboid>,
    /// Boxes that are fixed, along the world's axes.
    #[serde(default)]
    pub walls: Vec<Wall>,
}

/// A fixed box.
#[derive(Deserialize)]
pub struct Wall {
    /// m.
    pub half_sides: [f64; 3],
    /// m.
    pub centre: [f64; 3],
}

/// A box and its start.
#[derive(Deserialize)]
pub struct Cuboid {
    /// m.
    pub half_sides: [f64; 3],
    /// kg.
    pub mass: f64,
    /// The diagonal, kg m².
    pub inertia: [f64; 3],
    /// r, q (scalar first), v, ω (body).
    pub start: [f64; 13],
}

impl BenchScene {
    /// The world of the scene.
    pub fn world(&self) -> Result<World, Error> {
        let body = |cuboid: &Cuboid| {
            let inertia = Matrix3::from_diagonal(&cuboid.inertia.into());
            RigidBody::with_box_corners(cuboid.mass, inertia, cuboid.half_sides.into())
        };
        let fixed = |wall: &Wall| {
            let piece = Piece::cuboid(wall.half_sides.into())?;
            let piece = piece.moved_by(&Matrix3::identity(), &wall.centre.into())?;
            Ok(Fixed { piece, friction: None })
        };
        let world = World::new(Parameters {
            bodies: self.boxes.iter().map(body).collect::<Result<_, _>>()?,
            ground: Some(Plane::level()),
            gravity: Vector3::from(self.gravity),
            friction: self.friction,
            time_step: self.step_seconds,
            rotation: Rotation::Momentum,
        })?;
        world.with_fixed(self.walls.iter().map(fixed).collect::<Result<_, Error>>()?)
    }

    /// A simulation by the native solver, with its settings, from the start.
    pub fn begin(&self, world: &World, solver: NativeSolver) -> Result<Simulation<'static>, Error> {
        let starts = self.boxes.iter().map(|cuboid| {
            State::from_vector(&SVector::<f64, 13>::from_column_slice(&cuboid.start))
        });
        Simulation::new(world.clone(), starts, Motion::contact(solver))
    }
}
