//! Bodies on meshes whose vertices are off by noise, as in files with single precision.

use crate::campaign::size;
use crate::common::draw::WideDraw;
use crate::common::prelude::*;
use crate::floors::{on_terrain, world};
use crate::shapes::{Body, attitude, standing};
use std::f64::consts::TAU;
use tumble_core::geometry::terrain::Surface;

const SHAPES: [&str; 10] =
    ["cylinder", "octagon", "cone", "prism", "box", "cube", "wedge", "pyramid", "capsule", "ball"];
/// Largest differences of the heights of vertices (m).
const NOISES: [f64; 6] = [1e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4];
/// Vertices along a side of 4 m.
const COUNT: u32 = 9;

fn body(name: &str, random: &mut WideDraw) -> Body {
    if name != "octagon" {
        return standing(name, random);
    }
    let (body, _) = RigidBody::solid(1.0, &[Piece::cylinder(0.05, 0.15, 8).unwrap()]).unwrap();
    Body { body, upright: UnitQuaternion::identity(), height: 0.05 }
}

/// `world` with a mesh of squares of 0.5 m, each of two triangles, with its vertices at the heights
/// `height` (m), moved by `place`.
fn on_mesh(
    world: World,
    mut height: impl FnMut() -> f64,
    place: impl Fn(Vector3<f64>) -> Vector3<f64>,
) -> World {
    let at = |index: u32| -2.0 + 4.0 * f64::from(index) / f64::from(COUNT - 1);
    let places = (0..COUNT * COUNT).map(|index| (at(index % COUNT), at(index / COUNT)));
    let vertices = places.map(|(x, y)| place(Vector3::new(x, y, height()))).collect();
    let squares = (0..COUNT - 1).flat_map(|row| (0..COUNT - 1).map(move |x| row * COUNT + x));
    let triangles = squares.flat_map(|at| {
        let above = at + COUNT;
        [[at, at + 1, above + 1], [at, above + 1, above]]
    });
    on_terrain(world, Surface::new(vertices, triangles.collect()).unwrap())
}

/// Fault of a run over a level mesh with noise (m). On one plane a body without friction keeps its
/// velocity. The slopes are at most 6 times the noise, in m, and change it by this part of v + g t.
fn slide_fault(shape: &str, noise: f64, friction: f64, seed: u64, steps: usize) -> Option<String> {
    let mut random = WideDraw::wide(seed);
    let body = body(shape, &mut random);
    let way = random.within(0.0, TAU);
    let velocity = Vector3::new(way.cos(), way.sin(), 0.0) * random.within(0.5, 2.5);
    let from = -velocity * 0.002 * (steps as f64) / 2.0;
    let mut start = body.at([from.x, from.y], random.within(0.0, TAU), velocity.into());
    start.position.z += 2.0 * noise;
    let plane = world(&body.body, false, friction);
    let world = on_mesh(plane, || random.within(-noise, noise), |vertex| vertex);
    let (mut simulation, mut record) = (simulate(&world, &[start]), StepRecord::new());
    let most = 1e-7 + 6.0 * noise * (2.0 * 2.5 + 9.81 * 0.002 * steps as f64);
    for k in 0..steps {
        simulation.step(&mut record).unwrap();
        let (status, found) = (record.status(), record.next().velocity);
        let off = if friction > 0.0 { 0.0 } else { (found - velocity).xy().norm() };
        // NaN is not small.
        let is_near = off <= most;
        if matches!(status, StepStatus::Failed | StepStatus::Wild) || !is_near {
            return Some(format!("step {k}, {status:?}: {found:?}, not {velocity:?}"));
        }
    }
    None
}

#[test]
fn bodies_slide_over_noise_as_over_a_plane() {
    let (runs, steps) = (size(2, 60), size(80, 170));
    let mut wrong = Vec::new();
    for shape in SHAPES {
        for run in 0..runs as u64 {
            let mut random = WideDraw::wide(run);
            let noise = NOISES[random.within(0.0, NOISES.len() as f64) as usize];
            let friction = [0.0, 0.3][random.within(0.0, 2.0) as usize];
            let fault = slide_fault(shape, noise, friction, run, steps);
            wrong.extend(fault.map(|fault| format!("{shape} {noise:e} {friction} {run}: {fault}")));
        }
    }
    assert!(wrong.is_empty(), "{} runs: {wrong:#?}", wrong.len());
}

/// Flat ends of cylinders and cones stand on several triangles whose planes differ by less than the
/// fall in a step.
#[test]
fn flat_ends_slide_over_noise_of_each_size() {
    let mut wrong = Vec::new();
    for shape in ["cylinder", "octagon", "cone"] {
        for noise in NOISES {
            let fault = slide_fault(shape, noise, 0.0, 1, 80);
            wrong.extend(fault.map(|fault| format!("{shape} {noise:e}: {fault}")));
        }
    }
    assert!(wrong.is_empty(), "{} runs: {wrong:#?}", wrong.len());
}

/// The flat end is nearly level, and comes down away from the point that is nearest at the start.
#[test]
fn flat_ends_come_down_on_another_point_of_their_rim() {
    let mut wrong = Vec::new();
    for (shape, noise, friction, seed) in [
        ("octagon", 1e-9, 0.0, 23),
        ("octagon", 1e-8, 0.3, 30),
        ("octagon", 1e-9, 0.3, 59),
        ("cone", 1e-9, 0.3, 52),
        ("cone", 1e-4, 0.0, 22),
        ("cylinder", 1e-4, 0.0, 22),
    ] {
        let fault = slide_fault(shape, noise, friction, seed, 170);
        wrong.extend(fault.map(|fault| format!("{shape} {noise:e} {friction} {seed}: {fault}")));
    }
    assert!(wrong.is_empty(), "{} runs: {wrong:#?}", wrong.len());
}

/// A ramp of 10° about an oblique axis, its vertices rounded to single precision. The velocity is
/// g sin α t along it.
#[test]
fn cylinder_slides_down_a_ramp_in_single_precision() {
    let slope = 10_f64.to_radians();
    for turn in [0.3, 1.1, 2.0] {
        let down = Vector3::new(f64::cos(turn), f64::sin(turn), 0.0);
        let tilt = UnitQuaternion::from_scaled_axis(Vector3::z().cross(&down) * slope);
        let can = Piece::cylinder(0.1, 0.15, 24).unwrap();
        let (body, _) = RigidBody::solid(1.0, &[can]).unwrap();
        let round = |vertex: Vector3<f64>| (tilt * vertex).map(|x| f64::from(x as f32));
        let world = on_mesh(world(&body, false, 0.0), || 0.0, round);
        let upright = Body { body, upright: tilt, height: 0.1 };
        let mut start = upright.at([0.0, 0.0], 0.0, [0.0; 3]);
        start.attitude = attitude(&tilt);
        start.position = tilt * (Vector3::z() * (0.1 + 1e-6) - down * 0.4);
        let has_moved =
            |record: &StepRecord| !matches!(record.status(), StepStatus::Failed | StepStatus::Wild);
        let found = last_step(&mut simulate(&world, &[start]), 200, has_moved).next().velocity;
        let expected = tilt * down * (9.81 * slope.sin() * 0.002 * 200.0);
        // Slopes of 1e-7, and the first step closes a gap of 1e-6 m.
        assert!((found - expected).norm() < 1e-3, "{turn}: {found:?}, not {expected:?}");
    }
}
