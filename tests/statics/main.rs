//! Statics: closed forms, arches, published examples, wrong certificates, and the simulator's answer.

mod arches;
mod campaign;
mod certificates;
mod closed_forms;
#[path = "../../crates/core/tests/common/draw.rs"]
mod draw;
mod friction;
mod joints;
#[path = "../../crates/core/tests/common/campaign.rs"]
mod sizes;
mod slopes;
mod walls;

use nalgebra::Vector3;
use tumble::statics::{LoadCase, Structure, Verdict};
use tumble::{Parameters, Piece, Plane, RigidBody, State, World};

/// Bodies and fixed pieces at rest under gravity of 10 m/s².
struct Scene {
    bodies: Vec<RigidBody>,
    states: Vec<State>,
    fixed: Vec<Piece>,
    friction: f64,
    has_ground: bool,
}

const GRAVITY: f64 = 10.0;

impl Scene {
    fn new(friction: f64) -> Self {
        let (bodies, states, fixed) = (Vec::new(), Vec::new(), Vec::new());
        Self { bodies, states, fixed, friction, has_ground: true }
    }

    fn add(&mut self, body: RigidBody, position: [f64; 3]) -> &mut Self {
        self.bodies.push(body);
        self.states.push(State::at_rest(position));
        self
    }

    /// Adds a box of half sides in metres.
    fn add_box(&mut self, mass: f64, half: [f64; 3], position: [f64; 3]) -> &mut Self {
        self.add(RigidBody::solid_box(mass, half.into()).unwrap(), position)
    }

    /// Adds a hull with its corners in the world.
    fn add_hull(&mut self, density: f64, corners: &[Vector3<f64>]) -> &mut Self {
        let piece = Piece::hull(corners, 0.0).unwrap();
        let volume = tumble_core::geometry::MassProperties::from_piece(&piece).volume;
        let (body, centre) = RigidBody::solid(density * volume, &[piece]).unwrap();
        self.add(body, centre.into())
    }

    fn world(&self) -> World {
        let world = World::new(Parameters {
            ground: self.has_ground.then(Plane::level),
            gravity: Vector3::new(0.0, 0.0, -GRAVITY),
            friction: self.friction,
            ..Parameters::new(self.bodies.clone())
        });
        let fixed = self.fixed.iter().cloned();
        world.unwrap().with_fixed(fixed.collect())
    }

    fn structure(&self) -> Structure {
        Structure::at_rest(&self.world(), &self.states, &[]).unwrap().0
    }

    /// Largest factor on a `force` on a body at a `point` from its centre.
    fn largest_push(&self, body: usize, force: [f64; 3], point: [f64; 3]) -> f64 {
        let structure = self.structure();
        let case = LoadCase::push(&structure, body, force.into(), point.into()).unwrap();
        let limit = structure.largest_factor(&case);
        limit.factor().unwrap_or_else(|| panic!("no factor: {}", limit.name()))
    }
}

/// True if the structure has a force state, false for a mechanism.
#[track_caller]
fn stands(structure: &Structure) -> bool {
    match structure.verdict() {
        Verdict::Equilibrium(_) => true,
        Verdict::None(_) => false,
        Verdict::Undecided => panic!("undecided"),
    }
}

#[track_caller]
fn assert_close(found: f64, expected: f64, relative: f64) {
    let error = (found - expected).abs() / expected.abs();
    assert!(error <= relative, "{found} instead of {expected}: {error:e}");
}
