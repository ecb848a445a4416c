//! Random mechanisms: trees, trees with a loop, and redundantly constrained loops that can move.
//! They are rotated against the world axes, driven hard, swung and dropped.

use super::{at_rest, frames, laid, parameters, rod};
use crate::common::prelude::*;
use nalgebra::Matrix4;
use std::f64::consts::{PI, TAU};
use tumble_core::joint::FrictionCurve;

/// Random numbers between 0 and 1, the same in every run.
pub struct Numbers(pub u64);

impl Numbers {
    pub fn next(&mut self) -> f64 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }

    pub fn below(&mut self, count: usize) -> usize {
        ((self.next() * count as f64) as usize).min(count - 1)
    }

    pub fn direction(&mut self) -> Vector3<f64> {
        loop {
            let v = Vector3::from_fn(|_, _| self.between(-1.0, 1.0));
            if v.norm() > 0.1 && v.norm() < 1.0 {
                return v.normalize();
            }
        }
    }

    pub fn attitude(&mut self) -> Vector4<f64> {
        let (axis, angle) = (self.direction(), self.between(-3.0, 3.0));
        let (sine, cosine) = (0.5_f64 * angle).sin_cos();
        Vector4::new(cosine, axis[0] * sine, axis[1] * sine, axis[2] * sine)
    }
}

/// Random drive with large forces.
fn drive(numbers: &mut Numbers, size: f64) -> Drive {
    let mut drive = Drive::NONE;
    if numbers.next() < 0.3 {
        drive.friction = numbers.between(0.0, 0.5) * size;
    }
    if numbers.next() < 0.3 {
        drive.limits = Some([numbers.between(-0.8, 0.0), numbers.between(0.0, 0.8)]);
    }
    if numbers.next() < 0.3 {
        drive.stiffness = numbers.between(0.0, 50.0) * size;
        drive.damping = numbers.between(0.0, 1.0) * size;
    }
    if numbers.next() < 0.2 {
        drive.armature = numbers.between(0.0, 0.05) * size;
    }
    let most = numbers.between(0.0, 10.0) * size;
    match numbers.below(3) {
        0 => {
            let target = numbers.between(-20.0, 20.0);
            drive.motor = Some(Motor::Speed { target, max_force: most });
        }
        1 => {
            let (target, stiffness) =
                (numbers.between(-1.0, 1.0), numbers.between(10.0, 1e4) * size);
            let damping = numbers.between(0.0, 0.02) * stiffness;
            drive.motor = Some(Motor::Position { target, stiffness, damping, max_force: most });
        }
        _ => {}
    }
    drive
}

/// Bodies, states and joints of a mechanism at any place.
struct Built {
    bodies: Vec<RigidBody>,
    states: Vec<State>,
    joints: Vec<Joint>,
    /// Number of bodies, from the first on, that are bars of one loop. They have no friction with
    /// each other. With friction a bar could jam between others and stay there.
    bars: usize,
}

fn cuboid(numbers: &mut Numbers) -> RigidBody {
    let half = Vector3::from_fn(|_, _| numbers.between(0.03, 0.12));
    let mass = numbers.between(300.0, 3000.0) * 8.0 * half.product();
    RigidBody::solid(mass, &[Piece::cuboid(half).unwrap()]).unwrap().0
}

/// Random joint between A and B, or the world, halfway between them.
fn any_joint(states: &[State], a: usize, b: Option<usize>, numbers: &mut Numbers) -> Joint {
    let middle = b.map_or(states[a].position, |b| states[b].position);
    let place = 0.5 * (states[a].position + middle);
    let frames = frames(states, a, b, place, numbers.direction());
    let drives = [drive(numbers, 1.0), drive(numbers, 10.0)];
    match numbers.below(9) {
        0 => Joint::spherical(a, b, frames),
        1 | 2 => Joint::revolute(a, b, frames, drives[0]),
        3 => Joint::prismatic(a, b, frames, drives[1]),
        4 => Joint::cylindrical(a, b, frames, [drives[1], drives[0]]),
        5 => Joint::universal(a, b, frames),
        6 => Joint::ball(a, b, frames, numbers.between(0.3, 2.0), drives[0]),
        7 => {
            let damped = Drive { damping: 0.1, ..Drive::NONE };
            Joint::gimbal(a, b, frames, [drives[0], damped, Drive::NONE])
        }
        _ => Joint::fixed(a, b, frames),
    }
}

/// Tree of random bodies, each connected to an earlier one. Some trees are connected to the world,
/// and in some the last body is connected to the first.
fn tree(numbers: &mut Numbers) -> Built {
    let count = 2 + numbers.below(7);
    let mut places: Vec<Vector3<f64>> = vec![Vector3::zeros()];
    let mut parents = vec![0];
    while places.len() < count {
        let parent = numbers.below(places.len());
        let place = places[parent] + numbers.direction() * 0.45;
        if places.iter().all(|other| (other - place).norm() > 0.44) {
            places.push(place);
            parents.push(parent);
        }
    }
    let states: Vec<_> = places.iter().map(|place| at_rest(*place, numbers.attitude())).collect();
    let bodies = (0..count).map(|_| cuboid(numbers)).collect();
    let of_parents = parents.iter().enumerate().skip(1);
    let mut joints: Vec<_> =
        of_parents.map(|(body, &parent)| any_joint(&states, body, Some(parent), numbers)).collect();
    if count > 3 && numbers.next() < 0.4 {
        joints.push(any_joint(&states, count - 1, Some(0), numbers));
    }
    Built { bodies, states, joints, bars: 0 }
}

/// Closed loop of rods between the corners, with hinges about `axes`. One or two hinges are driven.
fn ring(corners: &[Vector3<f64>], axes: &[Vector3<f64>], numbers: &mut Numbers) -> Built {
    let count = corners.len();
    let next = |k: usize| (k + 1) % count;
    let states: Vec<_> = (0..count).map(|k| laid(corners[k], corners[next(k)])).collect();
    let bodies = (0..count).map(|k| {
        let length = (corners[next(k)] - corners[k]).norm();
        rod(numbers.between(0.2, 3.0), 0.85 * length, 0.08 * length)
    });
    let bodies = bodies.collect();
    let (first, second) = (numbers.below(count), numbers.below(count));
    let joints = (0..count).map(|k| {
        let before = (k + count - 1) % count;
        let frames = frames(&states, k, Some(before), corners[k], axes[k]);
        let is_driven = k == first || k == second;
        let drive = if is_driven { drive(numbers, 1.0) } else { Drive::NONE };
        Joint::revolute(k, Some(before), frames, drive)
    });
    let joints = joints.collect();
    Built { bodies, states, joints, bars: count }
}

/// Planar loop of four to seven bars.
fn flat_ring(numbers: &mut Numbers) -> Built {
    let count = 4 + numbers.below(4);
    let radius = numbers.between(0.25, 0.5);
    let corner = |k: usize, numbers: &mut Numbers| {
        let angle = TAU * (k as f64 + numbers.between(-0.2, 0.2)) / count as f64;
        Vector3::new(angle.cos(), angle.sin(), 0.0) * radius * numbers.between(0.8, 1.2)
    };
    let corners: Vec<_> = (0..count).map(|k| corner(k, numbers)).collect();
    ring(&corners, &vec![Vector3::z(); count], numbers)
}

/// Spherical loop: four bars whose hinge axes meet in one point.
fn round_ring(numbers: &mut Numbers) -> Built {
    let corner = |k: usize, numbers: &mut Numbers| {
        let angle = 0.25 * TAU * (k as f64 + numbers.between(-0.3, 0.3));
        let aside = numbers.between(0.4, 0.9);
        Vector3::new(angle.cos() * aside, angle.sin() * aside, 1.0).normalize()
    };
    let axes: Vec<_> = (0..4).map(|k| corner(k, numbers)).collect();
    let corners: Vec<_> = axes.iter().map(|axis| axis * 0.6).collect();
    ring(&corners, &axes, numbers)
}

/// Bennett's loop: four bars with equal lengths and twists of opposite bars and sin α/a = sin β/b.
/// Then tan ½θ₁ tan ½θ₂ = sin ½(β + α)/sin ½(β − α).
fn bennetts_ring(numbers: &mut Numbers) -> Built {
    let (a, b) = (numbers.between(0.25, 0.35), numbers.between(0.4, 0.5));
    let twist: f64 = numbers.between(0.4, 1.0);
    let other = (twist.sin() * a / b).asin();
    // The smaller twist belongs to a.
    let (alpha, beta) = (other, twist);
    let theta: f64 = numbers.between(0.8, 2.0);
    let ratio = (0.5 * (beta + alpha)).sin() / (0.5 * (beta - alpha)).sin();
    let second = 2.0 * (ratio / (0.5 * theta).tan()).atan();
    let turn = |axis: Vector3<f64>, angle: f64| Matrix4::new_rotation(axis * angle);
    let mut at = Matrix4::identity();
    let (mut corners, mut axes) = (Vec::new(), Vec::new());
    for (angle, length, twist) in
        [(theta, a, alpha), (second, b, beta), (-theta, a, alpha), (-second, b, beta)]
    {
        corners.push(at.fixed_view::<3, 1>(0, 3).into_owned());
        axes.push(at.fixed_view::<3, 1>(0, 2).into_owned());
        let along = Matrix4::new_translation(&(Vector3::x() * length));
        at = at * turn(Vector3::z(), angle) * along * turn(Vector3::x(), twist);
    }
    assert!((at - Matrix4::identity()).amax() < 1e-9, "{at}");
    ring(&corners, &axes, numbers)
}

/// Bricard's loop with right angles and six bars.
fn bricards_ring(numbers: &mut Numbers) -> Built {
    let size = numbers.between(0.3, 0.5);
    let [x, y, z] = [Vector3::x(), Vector3::y(), Vector3::z()];
    let corners = [0.0 * x, x, x - y, x - y + z, z - y, z].map(|corner| corner * size);
    ring(&corners, &[y, z, x, y, z, x], numbers)
}

/// Loop with arms on some of its bars.
fn with_arms(mut built: Built, numbers: &mut Numbers) -> Built {
    let (count, centre) = (built.states.len(), middle(&built.states));
    for bar in 0..count {
        if numbers.next() > 0.3 {
            continue;
        }
        let out = (built.states[bar].position - centre).normalize();
        let place = built.states[bar].position + out * 0.3;
        built.bodies.push(cuboid(numbers));
        built.states.push(at_rest(place, numbers.attitude()));
        let arm = built.states.len() - 1;
        built.joints.push(any_joint(&built.states, arm, Some(bar), numbers));
    }
    built
}

fn middle(states: &[State]) -> Vector3<f64> {
    states.iter().map(|state| state.position).sum::<Vector3<f64>>() / states.len() as f64
}

/// World in which these bodies have no friction with each other.
pub fn smooth(mut world: World, bars: &[usize]) -> World {
    for (k, bar) in bars.iter().enumerate() {
        for other in &bars[k + 1..] {
            world = world
                .with_coefficient_between(Coefficient::Friction, *bar, Partner::Body(*other), 0.0)
                .unwrap();
        }
    }
    world
}

/// Random mechanism above the ground with a random rotation and motion, and the indices of the bars
/// of a loop. In some mechanisms a body is connected to the world.
pub fn mechanism(numbers: &mut Numbers) -> (World, Vec<State>, Vec<usize>) {
    let Built { bodies, mut states, mut joints, bars } = match numbers.below(10) {
        0..=3 => tree(numbers),
        4 | 5 => flat_ring(numbers),
        6 => round_ring(numbers),
        7 => bennetts_ring(numbers),
        8 => bricards_ring(numbers),
        _ => {
            let ring = flat_ring(numbers);
            with_arms(ring, numbers)
        }
    };
    let turn = numbers.attitude();
    let centre = middle(&states);
    let spin = numbers.direction() * numbers.between(0.0, PI);
    let velocity = numbers.direction() * numbers.between(0.0, 2.0);
    let rests = numbers.next() < 0.3;
    for state in &mut states {
        state.position = rotation(&turn) * (state.position - centre);
        state.attitude = (left(&turn) * state.attitude).normalize();
        if !rests {
            state.velocity = velocity + spin.cross(&state.position);
            state.spin = rotation(&state.attitude).tr_mul(&spin);
        }
    }
    let reaches = bodies.iter().map(|body| {
        body.contact_points().iter().map(|point| point.position.norm()).fold(0.0, f64::max)
    });
    let lowest = states.iter().zip(reaches).map(|(state, reach)| state.position[2] - reach);
    let up = Vector3::z() * (numbers.between(0.01, 0.2) - lowest.fold(f64::INFINITY, f64::min));
    states.iter_mut().for_each(|state| state.position += up);
    if numbers.next() < 0.2 {
        for state in &mut states {
            (state.velocity, state.spin) = (Vector3::zeros(), Vector3::zeros());
        }
        joints.push(any_joint(&states, 0, None, numbers));
    }
    let time_step = numbers.between(1e-3, 5e-3);
    let world = euler(parameters(bodies, time_step)).with_joints(joints).unwrap();
    let bars: Vec<_> = (0..bars).collect();
    (smooth(world, &bars), states, bars)
}

/// The same mechanism with mass ratios of up to 10⁵.
pub fn uneven(world: &World, bars: &[usize], numbers: &mut Numbers) -> World {
    let scaled = |body: &RigidBody| {
        let factor = 10.0_f64.powf(numbers.between(-2.5, 2.5));
        body.with_mass(factor * body.mass(), factor * body.inertia()).unwrap()
    };
    let bodies = world.bodies().iter().map(scaled).collect();
    let joints = world.joints().to_vec();
    let world = euler(parameters(bodies, world.time_step()));
    smooth(world.with_joints(joints).unwrap(), bars)
}

/// The same mechanism with restitution at the stops and friction over the speed on about half of its axes.
pub fn with_more_laws(world: World, numbers: &mut Numbers) -> World {
    let mut joints = world.joints().to_vec();
    for (joint, axis) in world.driven_axes() {
        let mut drive = *joints[joint].drive(axis).unwrap();
        if drive.limits.is_some() {
            drive.restitution = numbers.between(-1.0, 1.0).max(0.0);
        }
        if numbers.next() < 0.5 {
            let points = [0.0, 1.0, 4.0].map(|speed| [speed, numbers.between(0.0, 2.0)]);
            drive.friction_curve = Some(FrictionCurve::new(&points).unwrap());
        }
        joints[joint] = joints[joint].clone().with_drive(axis, drive).unwrap();
    }
    world.with_joints(joints).unwrap()
}

/// The same mechanism with gears between random coordinates, some of them with a drive on their sum.
pub fn geared(world: World, states: &[State], numbers: &mut Numbers) -> World {
    let joints = world.joints();
    let counted = |joint: usize| {
        let axes = (0..6).map(move |axis| GearAxis::new(joint, axis));
        let is_free = |of: &GearAxis| match of.axis {
            JointAxis::Linear(axis) => joints[joint].linear()[axis] != Axis::Locked,
            JointAxis::Angular(axis) => joints[joint].angular()[axis] != Axis::Locked,
        };
        axes.filter(is_free).collect::<Vec<_>>()
    };
    let axes: Vec<_> = (0..joints.len()).flat_map(counted).collect();
    let mut gears = Vec::new();
    for _ in 0..1 + numbers.below(2) {
        if axes.len() < 2 {
            break;
        }
        let [first, second] = [0; 2].map(|_| axes[numbers.below(axes.len())]);
        let ratio = numbers.between(-3.0, 3.0);
        let [one, two] =
            [first, second].map(|axis| axis.coordinate(joints, states, &Vector3::zeros()));
        let gear = Gear::new(first, second, ratio, one - ratio * two);
        let is_driven = numbers.next() < 0.3;
        gears.push(if is_driven { gear.with_drive(drive(numbers, 1.0)) } else { gear });
    }
    world.clone().with_gears(gears).unwrap_or(world)
}
