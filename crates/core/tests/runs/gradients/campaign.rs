//! Derivatives of random scenes: boxes on slopes with redundant corners, stacks, mechanisms with
//! motors on a support, and bodies with tiny inertia.

use super::draw::Draw;
use super::{Tally, compare, step};
use crate::common::prelude::*;
use nalgebra::Unit;
use rand_mt::Mt;

impl Draw {
    fn world(&mut self, bodies: Vec<RigidBody>, normal: Vector3<f64>, h: f64) -> World {
        euler(Parameters {
            ground: Some(Plane::new(normal, 0.0).unwrap()),
            friction: self.within(0.1, 0.9),
            time_step: h,
            rotation: if self.within(0.0, 1.0) < 0.5 {
                Rotation::Momentum
            } else {
                Rotation::Tutorial
            },
            ..Parameters::new(bodies)
        })
    }

    /// Stack of boxes on a slope, each narrower than the one below, which slides or sticks.
    fn stack(&mut self, count: usize, size: f64) -> (World, Vec<State>) {
        let normal = (Vector3::z() + self.vector(0.4)).normalize();
        let lean = Rotation3::rotation_between(&Vector3::z(), &normal).unwrap();
        let slides = self.within(0.0, 1.0) < 0.6;
        let (mut bodies, mut states, mut height, mut half) =
            (Vec::new(), Vec::new(), 0.0, Vector3::repeat(size));
        for _ in 0..count {
            let thin = Vector3::from_fn(|_, _| self.within(0.4, 0.7));
            half = half.component_mul(&thin);
            let turn =
                lean * Rotation3::from_axis_angle(&Vector3::z_axis(), self.within(-0.3, 0.3));
            let q = UnitQuaternion::from_rotation_matrix(&turn);
            let along = self.vector(3.0 * size);
            let along = along - normal * normal.dot(&along);
            let speed = if slides { 1.0 } else { 0.0 };
            bodies.push(RigidBody::solid_box(self.within(0.5, 3.0), half).unwrap());
            states.push(State {
                position: normal * (height + half[2])
                    + lean * Vector3::new(0.05, -0.03, 0.0) * size,
                attitude: Vector4::new(q.w, q.i, q.j, q.k),
                velocity: along * speed,
                spin: Vector3::z() * (speed * self.within(-1.0, 1.0)),
            });
            height += 2.0 * half[2];
        }
        (self.world(bodies, normal, 0.002), states)
    }

    /// Box on a slope that carries another box by a hinge or a slide with a motor.
    fn driven(&mut self) -> (World, Vec<State>) {
        let (below_world, mut states) = self.stack(1, 0.4);
        let normal = *below_world.ground().unwrap().normal();
        let half = Vector3::from_fn(|_, _| self.within(0.05, 0.1));
        let arm = RigidBody::solid_box(self.within(0.3, 1.0), half).unwrap();
        let axis = Unit::new_normalize(self.vector(1.0));
        let lever = Vector3::new(0.2, 0.1, 0.3);
        let at =
            [JointFrame::along(-lever, *axis).unwrap(), JointFrame::along(lever, *axis).unwrap()];
        let motor = match self.within(0.0, 3.0) as u32 {
            0 => Motor::Speed { target: 2.0, max_force: 1e3 },
            1 => Motor::Speed { target: 5.0, max_force: 0.4 },
            _ => Motor::Position { target: 0.4, stiffness: 20.0, damping: 0.5, max_force: 1e3 },
        };
        let drive = Drive { damping: 0.1, friction: 0.05, motor: Some(motor), ..Drive::NONE };
        let joint = match self.within(0.0, 2.0) as u32 {
            0 => Joint::revolute(1, Some(0), at, drive),
            _ => Joint::prismatic(1, Some(0), at, drive),
        };
        states[0].spin = Vector3::zeros();
        let below = states[0];
        let place = below.pose().rotation * (2.0 * lever);
        states.push(State { position: below.position + place, ..below });
        let bodies = vec![below_world.bodies()[0].clone(), arm];
        (self.world(bodies, normal, 0.002).with_joints(vec![joint]).unwrap(), states)
    }

    /// Falling box in which one, two or three moments of inertia are a ten-thousandth of a solid
    /// box's.
    fn needle(&mut self) -> (World, Vec<State>) {
        let half = Vector3::from_fn(|_, _| self.within(0.02, 0.2));
        let body = RigidBody::solid_box(self.within(0.2, 2.0), half).unwrap();
        let normal = (Vector3::z() + self.vector(0.3)).normalize();
        let inertia = Matrix3::from_diagonal(&body.inertia().diagonal());
        let tiny: Vec<f64> = (inertia * 1e-4).as_slice().to_vec();
        let world = self.world(vec![body], normal, 0.001);
        let world = world.with_constants(&[(Constant::Inertia, &tiny)]).unwrap();
        let state = State {
            position: normal * 0.25,
            attitude: Vector4::from_fn(|_, _| self.within(-1.0, 1.0)).normalize(),
            velocity: self.vector(1.0) - normal,
            spin: self.vector(5.0),
        };
        (world, vec![state])
    }
}

/// Number of scenes of each kind.
const SCENES: usize = 12;

#[test]
#[ignore = "slow"]
fn drawn_scenes_against_differences() {
    let mut draw = Draw(Mt::new(17));
    let mut all = 0;
    for kind in ["box on a slope", "stack on a slope", "driven arm", "tiny inertia"] {
        let mut tally = Tally::default();
        for number in 0..SCENES {
            let (world, mut states) = match kind {
                "box on a slope" => draw.stack(1, 0.5),
                "stack on a slope" => draw.stack(2 + number % 2, 0.5),
                "driven arm" => draw.driven(),
                _ => draw.needle(),
            };
            let wanted: &[usize] =
                if kind == "tiny inertia" { &[20, 120, 240] } else { &[0, 5, 40] };
            for k in 0..=wanted[2] {
                if wanted.contains(&k) {
                    let at = format!("{kind} {number}, step {k}");
                    compare(&world, &states, &mut || draw.within(-1.0, 1.0), &at, &mut tally);
                }
                let Some((_, record)) = step(&world, &states, &[]) else { break };
                states = record.next_states().to_vec();
            }
        }
        println!(
            "{kind}: {} compared, {} left out, {} kinks, {} scatter, worst {:.1e}",
            tally.compared, tally.left_out, tally.kinks, tally.scattered, tally.worst
        );
        assert!(tally.missed.is_empty(), "{}", tally.missed.join("\n"));
        assert!(20 * (tally.kinks + tally.scattered) <= tally.compared);
        all += tally.compared;
    }
    assert!(all > 20 * SCENES, "{all}");
}
