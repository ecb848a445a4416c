//! Heaps of bodies that fall onto level ground. No test uses these seeds.

use nalgebra::{Vector3, Vector4};
use tumble_core::contact::Plane;
use tumble_core::error::Error;
use tumble_core::geometry::Piece;
use tumble_core::mechanics::{RigidBody, Rotation, State};
use tumble_core::simulation::random::Draws;
use tumble_core::simulation::{Motion, Simulation};
use tumble_core::world::{Parameters, World};

type BuiltHeap = (Vec<RigidBody>, Vec<State>);

/// Heap, to be drawn with a seed.
#[derive(Debug, Clone, Copy)]
pub struct Heap {
    /// Kind of bodies.
    pub name: &'static str,
    /// Number of bodies.
    pub bodies: usize,
    /// Coefficient of friction μ.
    pub friction: f64,
}

/// Measured heaps.
pub const HEAPS: [Heap; 14] = [
    Heap { name: "boxes", bodies: 10, friction: 0.3 },
    Heap { name: "boxes", bodies: 10, friction: 0.7 },
    Heap { name: "boxes", bodies: 10, friction: 1.5 },
    Heap { name: "boxes", bodies: 25, friction: 0.3 },
    Heap { name: "boxes", bodies: 25, friction: 0.7 },
    Heap { name: "boxes", bodies: 25, friction: 1.5 },
    Heap { name: "sticks", bodies: 25, friction: 0.3 },
    Heap { name: "balls", bodies: 25, friction: 0.5 },
    Heap { name: "mixed", bodies: 25, friction: 0.5 },
    Heap { name: "ratio", bodies: 25, friction: 0.5 },
    Heap { name: "boxes", bodies: 100, friction: 0.5 },
    Heap { name: "dense", bodies: 100, friction: 0.5 },
    Heap { name: "wall", bodies: 28, friction: 0.3 },
    Heap { name: "wall", bodies: 28, friction: 0.5 },
];

fn at_rest(position: Vector3<f64>, attitude: Vector4<f64>) -> State {
    State { position, attitude, velocity: Vector3::zeros(), spin: Vector3::zeros() }
}

/// Bodies in random attitudes above each other, with random velocities and spins.
fn heap(name: &str, count: usize, draws: &mut Draws) -> Result<BuiltHeap, Error> {
    let (mut bodies, mut starts) = (Vec::new(), Vec::new());
    for index in 0..count {
        let places = [index % 3, index / 3 % 3, index / 9].map(|place| place as f64);
        let position = Vector3::new(-0.9, -0.9, 1.0) + 0.9 * Vector3::from(places);
        let mut around = |size: f64| size * (2.0 * draws.unit() - 1.0);
        let velocity = Vector3::from_fn(|_, _| around(1.0));
        let spin = Vector3::from_fn(|_, _| around(2.0));
        let half_sides = Vector3::from_fn(|_, _| 0.2 + around(0.05));
        let mass = if name == "ratio" { 10_f64.powf(around(2.0)) } else { 1.5 + around(0.5) };
        let shape = if name == "mixed" { index % 4 } else { 4 };
        let piece = match (name, shape) {
            ("sticks", _) | (_, 1) => Piece::cuboid(Vector3::new(0.4, 0.04, 0.04)),
            ("balls", _) | (_, 2) => Piece::sphere(0.175 + around(0.075)),
            (_, 3) => Piece::capsule(0.2, 0.1),
            _ => Piece::cuboid(half_sides),
        };
        bodies.push(RigidBody::solid(mass, &[piece?])?.0);
        let attitude = draws.attitude();
        starts.push(State { velocity, spin, ..at_rest(position, attitude) });
    }
    Ok((bodies, starts))
}

/// Boxes of 20 × 15 × 10 cm in dense layers of 25, so that they fall on one another.
fn dense(count: usize, draws: &mut Draws) -> Result<BuiltHeap, Error> {
    let brick = RigidBody::solid_box(1.5, Vector3::new(0.1, 0.075, 0.05))?;
    let start = |index: usize| {
        let places = [index % 5, index / 5 % 5, index / 25].map(|place| place as f64);
        at_rest(Vector3::new(-0.6, -0.6, 0.3) + 0.32 * Vector3::from(places), draws.attitude())
    };
    Ok((vec![brick; count], (0..count).map(start).collect()))
}

/// Cube of 2 m and 10 kg thrown at a wall of bricks of 1 × 0.5 × 0.5 m and 20 kg, three per row.
fn wall(count: usize, draws: &mut Draws) -> Result<BuiltHeap, Error> {
    let cube = RigidBody::solid_box(10.0, Vector3::repeat(1.0))?;
    let brick = RigidBody::solid_box(20.0, Vector3::new(0.495, 0.25, 0.25))?;
    let upright = Vector4::new(1.0, 0.0, 0.0, 0.0);
    let thrown = State {
        velocity: Vector3::new(0.0, 8.0, 0.0),
        spin: Vector3::new(0.0, -2.0, 1.0),
        ..at_rest(Vector3::new(0.0, -4.0, 2.5), draws.attitude())
    };
    let bricks = (0..count - 1).map(|index| {
        let (row, place) = (index / 3, (index % 3) as f64);
        let x = place - 1.0 + 0.5 * (row % 2) as f64;
        at_rest(Vector3::new(x, 0.0, 0.25 + 0.5 * row as f64), upright)
    });
    let starts = std::iter::once(thrown).chain(bricks).collect();
    Ok((std::iter::once(cube).chain(vec![brick; count - 1]).collect(), starts))
}

impl Heap {
    /// Simulation of the heap by the native solver with steps of 2 ms.
    pub fn begin(&self, seed: u32) -> Result<Simulation<'static>, Error> {
        let draws = &mut Draws::new(seed);
        let (bodies, starts) = match self.name {
            "dense" => dense(self.bodies, draws)?,
            "wall" => wall(self.bodies, draws)?,
            name => heap(name, self.bodies, draws)?,
        };
        let world = World::new(Parameters {
            bodies,
            ground: Some(Plane::level()),
            gravity: Vector3::new(0.0, 0.0, -9.81),
            friction: self.friction,
            time_step: 0.002,
            rotation: Rotation::Momentum,
        })?;
        let motion = Motion::native(&world);
        Simulation::new(world, starts, motion)
    }
}
