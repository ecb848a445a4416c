//! A body whose bottom covers a slot between level plates slides over it as over one plane.

use crate::campaign::size;
use crate::common::draw::WideDraw;
use crate::common::prelude::*;
use crate::floors::block;
use crate::shapes::{Body, standing};
use std::f64::consts::TAU;

/// Bodies with flat bottoms that are wider than the slots.
const BODIES: [&str; 13] = [
    "box",
    "cube",
    "prism",
    "pyramid",
    "wedge",
    "cylinder",
    "cone",
    "triangle",
    "hexagon",
    "needle",
    "rounded box",
    "stool",
    "shoe",
];
/// Speeds of a campaign (m/s).
const SPEEDS: [f64; 12] = [0.3, 0.5, 0.7, 1.0, 1.2, 1.5, 1.7, 2.0, 2.3, 2.6, 3.0, 3.5];
/// Widths of slots (m).
const WIDTHS: [f64; 8] = [1e-6, 1e-5, 1e-4, 1e-3, 5e-3, 1e-2, 2e-2, 5e-2];
/// Time steps (s).
const STEPS: [f64; 3] = [5e-4, 1e-3, 2e-3];
/// Largest difference of positions and velocities from those on one plane (m, m/s).
const SAME: f64 = 1e-6;

/// Prism of 2 `half` (m) with a regular base. The corners are rounded by `round` (m).
fn prism(sides: u32, radius: f64, half: f64, round: f64) -> Piece {
    let corners = (0..sides).flat_map(|side| {
        let angle = TAU * f64::from(side) / f64::from(sides);
        [-half, half].map(|z| Vector3::new(radius * angle.cos(), radius * angle.sin(), z))
    });
    Piece::hull(&corners.collect::<Vec<_>>(), round).unwrap()
}

/// The pieces of a body, with their places.
fn pieces(name: &str) -> Vec<(Piece, [f64; 3])> {
    let can = |half, radius| Piece::cylinder(half, radius, 24).unwrap();
    let at_origin = |piece| vec![(piece, [0.0; 3])];
    match name {
        "triangle" => at_origin(prism(3, 0.2, 0.05, 0.0)),
        "hexagon" => at_origin(prism(6, 0.15, 0.05, 0.0)),
        "rounded box" => at_origin(prism(4, 0.18, 0.04, 0.01)),
        "needle" => {
            let base = [[0.3, 0.0], [-0.1, 0.12], [-0.1, -0.12]];
            let corners = base.map(|[x, y]| [-0.04, 0.04].map(|z| Vector3::new(x, y, z)));
            at_origin(Piece::hull(&corners.concat(), 0.0).unwrap())
        }
        "stool" => {
            let legs = (0..3).map(|leg| {
                let angle = TAU * f64::from(leg) / 3.0;
                (can(0.08, 0.05), [0.13 * angle.cos(), 0.13 * angle.sin(), 0.0])
            });
            legs.chain([(can(0.02, 0.2), [0.0, 0.0, 0.08])]).collect()
        }
        "shoe" => vec![
            (Piece::cuboid(Vector3::new(0.1, 0.06, 0.03)).unwrap(), [0.0; 3]),
            (can(0.03, 0.06), [0.1, 0.0, 0.0]),
            (can(0.03, 0.06), [-0.1, 0.0, 0.0]),
        ],
        _ => panic!("no body is called {name}"),
    }
}

fn flat(name: &str, random: &mut WideDraw) -> Body {
    if crate::shapes::SHAPES.contains(&name) {
        return standing(name, random);
    }
    let placed = |(piece, place): (Piece, [f64; 3])| {
        piece.moved_by(&Matrix3::identity(), &Vector3::from(place)).unwrap()
    };
    let pieces: Vec<_> = pieces(name).into_iter().map(placed).collect();
    let (body, _) = RigidBody::solid(1.0, &pieces).unwrap();
    let lowest = |piece: &Piece| {
        let heights = piece.core().vertices().iter().map(|vertex| vertex.z);
        heights.fold(f64::INFINITY, f64::min) - piece.radius()
    };
    let height = -body.pieces().iter().map(lowest).fold(f64::INFINITY, f64::min);
    Body { body, upright: UnitQuaternion::identity(), height }
}

/// Conditions of a run.
#[derive(Debug, Clone, Copy)]
struct Slide {
    width: f64,
    speed: f64,
    time_step: f64,
    friction: f64,
    integrator: Integrator,
    /// Velocity of both surfaces along x, as of conveyor belts (m/s).
    belt: f64,
}

impl Slide {
    fn world(&self, body: &RigidBody, ground: Option<Plane>) -> World {
        let parameters = Parameters::new(vec![body.clone()]);
        let Self { friction, time_step, .. } = *self;
        let world = World::new(Parameters { ground, friction, time_step, ..parameters });
        world.unwrap().with_integrator(self.integrator)
    }

    /// First difference of a run over the slot from the same run on a plane.
    fn differs(&self, body: &Body, start: &State) -> Option<String> {
        let plates = vec![
            block([-6.0, -6.0, -0.2], [0.0, 6.0, 0.0]),
            block([self.width, -6.0, -0.2], [6.0, 6.0, 0.0]),
        ];
        let plane = self.world(&body.body, Some(Plane::level()));
        let slot = self.world(&body.body, None).with_fixed(plates);
        let belts = [vec![Partner::Ground], vec![Partner::Fixed(0), Partner::Fixed(1)]];
        let [mut expected, mut found] = [0, 1].map(|at| {
            let moving = |world: World, belt: &Partner| {
                world.with_surface(*belt, Vector3::x() * self.belt).unwrap()
            };
            let world = [&plane, &slot][at].clone();
            simulate(&belts[at].iter().fold(world, moving), &[*start])
        });
        let mut record = StepRecord::new();
        for k in 0..(0.9 / self.speed / self.time_step) as usize {
            expected.step(&mut record).unwrap();
            found.step(&mut record).unwrap();
            let status = record.status();
            let is_solved = matches!(status, StepStatus::Converged | StepStatus::Retried);
            let (one, other) = (expected.state(), found.state());
            let apart = (one.position - other.position).norm();
            let apart = apart.max((one.velocity - other.velocity).norm());
            // NaN is not small.
            if !(is_solved && apart <= SAME) {
                let (v, w) = (one.velocity, other.velocity);
                return Some(format!("step {k}, {status:?}: {v:?} on the plane, {w:?}"));
            }
        }
        None
    }
}

/// Runs of a body over random slots, each with its difference from a run on a plane.
fn differences(name: &str, runs: usize) -> Vec<String> {
    let mut wrong = Vec::new();
    for seed in 0..runs as u64 {
        let mut random = WideDraw::wide(seed);
        let body = flat(name, &mut random);
        let mut pick = |count: usize| random.within(0.0, count as f64) as usize;
        let slide = Slide {
            width: WIDTHS[pick(WIDTHS.len())],
            speed: SPEEDS[pick(SPEEDS.len())],
            time_step: STEPS[pick(STEPS.len())],
            friction: [0.0, 0.3][pick(2)],
            integrator: [Integrator::Euler, Integrator::Leapfrog][pick(2)],
            belt: 0.0,
        };
        let way = random.within(-0.7, 0.7);
        let velocity = [slide.speed * way.cos(), slide.speed * way.sin(), 0.0];
        let start = body.at([-0.35, random.within(-0.1, 0.1)], random.within(0.0, TAU), velocity);
        let differs = slide.differs(&body, &start);
        wrong.extend(differs.map(|differs| format!("{name}, seed {seed}, {slide:?}: {differs}")));
    }
    wrong
}

#[test]
fn bodies_slide_over_a_slot_that_they_cover_as_over_one_plane() {
    let wrong: Vec<_> = BODIES.iter().flat_map(|name| differences(name, size(3, 300))).collect();
    assert!(wrong.is_empty(), "{} runs: {wrong:#?}", wrong.len());
}

/// The rim of a puck and the feet of a stool meet the far edge of a slot of 5 mm with one point.
#[test]
fn puck_and_stool_do_not_trip_over_a_slot() {
    let mut wrong = Vec::new();
    for (name, speed, friction) in [("puck", 1.0, 0.0), ("stool", 2.0, 0.05)] {
        let body = match name {
            "puck" => {
                let puck = Piece::cylinder(0.05, 0.15, 24).unwrap();
                let (body, _) = RigidBody::solid(1.0, &[puck]).unwrap();
                Body { body, upright: UnitQuaternion::identity(), height: 0.05 }
            }
            _ => flat(name, &mut WideDraw::wide(0)),
        };
        for time_step in STEPS {
            for case in 0..4 {
                let integrator = Integrator::Leapfrog;
                let slide =
                    Slide { width: 5e-3, speed, time_step, friction, integrator, belt: 0.0 };
                let from = -0.35 - 1.3e-4 * f64::from(case);
                let start = body.at([from, 0.0], 0.0, [speed, 0.0, 0.0]);
                let differs = slide.differs(&body, &start);
                wrong.extend(differs.map(|differs| format!("{name}, {slide:?}: {differs}")));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// A can that is put on a belt with half of its speed is carried over the gap to the next belt.
#[test]
fn cans_ride_from_belt_to_belt() {
    let (radius, half) = (0.033, 0.06);
    let can = Piece::cylinder(half, radius, 24).unwrap();
    let (body, _) = RigidBody::solid(0.35, &[can]).unwrap();
    let can = Body { body, upright: UnitQuaternion::identity(), height: half };
    let mut wrong = Vec::new();
    for width in [0.0, 1e-4, 2e-3, 5e-3, 1e-2, 2e-2] {
        for (time_step, belt) in [(1e-3, 0.5), (2e-3, 0.7)] {
            let (speed, friction, integrator) = (belt, 0.15, Integrator::Leapfrog);
            let slide = Slide { width, speed, time_step, friction, integrator, belt };
            let start = can.at([-0.1, 0.0], 0.0, [0.5 * belt, 0.0, 0.0]);
            let differs = slide.differs(&can, &start);
            wrong.extend(differs.map(|differs| format!("{slide:?}: {differs}")));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// A body that meets an edge in front of its centre of mass at the height 0 turns about it. With the
/// centre of mass at the height z, a behind the edge, and the radius of gyration k, it keeps of its speed
///
/// ```text
/// z²/(k² + z² + a²) < ½
/// ```
#[test]
fn bodies_stop_at_steps_up_beyond_a_slot() {
    let mut wrong = Vec::new();
    // A rounded edge slides up a lower step.
    for name in BODIES.into_iter().filter(|name| *name != "rounded box") {
        for (case, height) in [2e-5, 1e-4, 1e-3, 1e-2].into_iter().enumerate() {
            let width = [0.0, 5e-3][case % 2];
            let (speed, time_step, friction) = (1.0, STEPS[1 + case / 2], 0.0);
            let integrator = Integrator::Leapfrog;
            let slide = Slide { width, speed, time_step, friction, integrator, belt: 0.0 };
            let body = flat(name, &mut WideDraw::wide(case as u64));
            let plates = vec![
                block([-6.0, -6.0, -0.2], [0.0, 6.0, 0.0]),
                block([width, -6.0, -0.2], [6.0, 6.0, height]),
            ];
            let world = slide.world(&body.body, None).with_fixed(plates);
            let start = body.at([-0.3501, 0.0], 0.0, [speed, 0.0, 0.0]);
            let (mut simulation, mut record) = (simulate(&world, &[start]), StepRecord::new());
            let stops = (0..(0.5 / time_step) as usize).any(|_| {
                simulation.step(&mut record).unwrap();
                simulation.state().velocity.x < 0.5 * speed
            });
            if !stops {
                wrong.push(format!("{name}, {height} m: {:?}", simulation.state()));
            }
        }
    }
    assert!(wrong.is_empty(), "{} runs: {wrong:#?}", wrong.len());
}
