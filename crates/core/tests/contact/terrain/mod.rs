//! Terrain: surfaces of triangles behave like the shapes that they form.

mod flat;
mod queries;
mod rough;
mod slopes;

use crate::common::prelude::*;
use rand_mt::Mt64;
use std::sync::Arc;
use tumble_core::geometry::Terrain;
use tumble_core::geometry::terrain::{HeightField, Surface};

type V = Vector3<f64>;

/// A state without rotation.
fn at(position: [f64; 3], velocity: [f64; 3], spin: [f64; 3]) -> State {
    State { velocity: velocity.into(), spin: spin.into(), ..State::at_rest(position) }
}

fn body(piece: Piece) -> RigidBody {
    RigidBody::solid(1.0, &[piece]).unwrap().0
}

/// World of one body over nothing.
fn empty(body: RigidBody, friction: f64) -> World {
    euler(Parameters { ground: None, friction, time_step: 0.005, ..Parameters::new(vec![body]) })
}

fn on_terrain(world: &World, terrain: impl Into<Terrain>) -> World {
    let terrain = Arc::new(terrain.into());
    world.clone().with_terrains(vec![terrain])
}

/// World with fixed boxes, each with half sides, turned about y by an angle, at a place.
fn on_boxes(world: &World, boxes: &[(V, f64, V)]) -> World {
    let fixed = boxes.iter().map(|(half, angle, at)| {
        let (s, c) = angle.sin_cos();
        let turn = Matrix3::new(c, 0.0, s, 0.0, 1.0, 0.0, -s, 0.0, c);
        Piece::cuboid(*half).unwrap().moved_by(&turn, at).unwrap()
    });
    world.clone().with_fixed(fixed.collect())
}

/// The states after each of `steps` steps. No step fails.
fn run(name: &str, world: &World, start: State, steps: usize) -> Vec<State> {
    let motion = Motion::native(world);
    let mut run = Simulation::new(world.clone(), [start], motion).unwrap();
    let mut record = StepRecord::new();
    (0..steps)
        .map(|k| {
            run.step(&mut record).unwrap();
            let status = record.status();
            assert_ne!(status, StepStatus::Failed, "{name}, step {k}: {:?}", record.report());
            record.next_states()[0]
        })
        .collect()
}

/// Largest difference of two attitudes.
fn turned_apart(a: &State, b: &State) -> f64 {
    (a.attitude - b.attitude).amax().min((a.attitude + b.attitude).amax())
}

/// Asserts that two runs have the same places, to `place` (m), and attitudes, to `attitude`.
fn assert_same(name: &str, wanted: &[State], found: &[State], place: f64, attitude: f64) {
    for (step, (a, b)) in wanted.iter().zip(found).enumerate() {
        let off = (a.position - b.position).amax();
        assert!(off <= place, "{name}, step {step}: {off:e} m\n{a:?}\n{b:?}");
        let off = turned_apart(a, b);
        assert!(off <= attitude, "{name}, step {step}: {off:e}\n{a:?}\n{b:?}");
    }
}

fn uniform(random: &mut Mt64) -> f64 {
    (random.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
}

/// Level field of `cells` × `cells` cells about the origin.
fn level_field(cells: usize, spacing: f64) -> HeightField {
    let side = cells + 1;
    let corner = -0.5 * cells as f64 * spacing;
    HeightField::new(vec![0.0; side * side], side, [spacing; 2])
        .unwrap()
        .moved_by(&Matrix3::identity(), &V::new(corner, corner, 0.0))
        .unwrap()
}

/// Surface over a square of `cells` × `cells` cells about the origin, with inner points moved aside
/// and random diagonals.
fn odd_surface(cells: usize, spacing: f64, seed: u64, height: impl Fn(f64, f64) -> f64) -> Surface {
    let mut random = Mt64::new(seed);
    let side = cells + 1;
    let middle = 0.5 * cells as f64;
    let vertices = (0..side * side).map(|point| {
        let (row, column) = (point / side, point % side);
        let is_inner = |place: usize| place > 0 && place < cells;
        let mut off =
            || if is_inner(row) && is_inner(column) { uniform(&mut random) - 0.5 } else { 0.0 };
        let x = (column as f64 - middle + 0.6 * off()) * spacing;
        let y = (row as f64 - middle + 0.6 * off()) * spacing;
        V::new(x, y, height(x, y))
    });
    let vertices = vertices.collect();
    let mut triangles = Vec::new();
    for cell in 0..cells * cells {
        let first = (cell / cells * side + cell % cells) as u32;
        let [a, b, c, d] = [first, first + 1, first + side as u32 + 1, first + side as u32];
        triangles.extend(if uniform(&mut random) < 0.5 {
            [[a, b, c], [a, c, d]]
        } else {
            [[a, b, d], [b, c, d]]
        });
    }
    Surface::new(vertices, triangles).unwrap()
}
