//! Motions with a closed form, computed by the native solver: rest, and a slide to a stop.

use crate::common::prelude::*;
use crate::common::state;
use crate::toss::*;
use std::f64::consts::TAU;

const GRAVITY: f64 = 9.81;
/// Initial speed of the sliding boxes [m/s].
const SPEED: f64 = 2.0;

/// A solid box on the ground.
struct Resting {
    world: World,
    height: f64,
}

impl Resting {
    fn new(half_sides: [f64; 3], friction: f64, time_step: f64) -> Self {
        let half_sides = Vector3::from(half_sides);
        let body = RigidBody::solid_box(10.0, half_sides).unwrap();
        let world = World::new(Parameters { friction, time_step, ..parameters(body) });
        Self { world: world.unwrap(), height: half_sides[2] }
    }

    /// State on the ground with velocity `velocity`, the sides rotated by `heading` against x.
    fn at(&self, velocity: Vector3<f64>, heading: f64) -> State {
        let at = [0.0, 0.0, self.height, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        State { velocity, ..turned(&state(&at), heading) }
    }

    /// Steps of the slide, and ten more.
    fn slide(&self, velocity: Vector3<f64>, heading: f64) -> Vec<StepRecord> {
        let loss = self.world.friction() * GRAVITY * self.world.time_step();
        let steps = (velocity.norm() / loss) as usize + 10;
        native_run(&self.world, self.at(velocity, heading), steps)
    }
}

/// A cube, a plate, a brick and a thin tile, with different frictions and time steps. None tips
/// over: μ times the height is less than the half sides.
fn boxes() -> [Resting; 4] {
    [
        Resting::new([1.0, 1.0, 1.0], 0.3, 2e-3),
        Resting::new([1.0, 0.5, 0.05], 0.3, 2e-3),
        Resting::new([0.5, 0.2, 0.1], 0.8, 1e-3),
        Resting::new([0.1, 0.1, 0.002], 0.1, 5e-3),
    ]
}

/// Checks that a resting box does not move and keeps its energy. The tolerance covers rounding of
/// gravity's impulse in a step, 2e-16 times 0.05 m/s, over 1000 steps.
#[test]
fn a_box_at_rest_keeps_its_pose_and_its_energy() {
    for resting in boxes() {
        for heading in [0.0, 0.4, 1.1, 3.0] {
            let start = resting.at(Vector3::zeros(), heading);
            let run = native_run(&resting.world, start, 1000);
            assert!(worst_residual(&run) < 1e-10);
            for step in run {
                let next = step.next();
                let apart = pose_apart(next, &start);
                let energy = next.velocity.norm_squared() + next.spin.norm_squared();
                assert!(apart < 1e-13 && energy < 1e-26, "step {}: {apart:e}", step.index);
            }
        }
    }
}

/// Checks the stopping distance of a sliding box.
///
/// Each step reduces the speed by μgh, and the last step by the remainder. So the speeds are known
/// exactly, and the distance is h times their sum. That is v²/(2μg) minus half of hv, because the
/// step moves with the new velocity, up to a fraction μgh/v of that. The tolerance 1e-12 is
/// rounding. At the end the speed is zero, to the rounding of one impulse of gravity.
#[test]
fn a_sliding_box_stops_after_the_square_of_its_speed_over_twice_the_deceleration() {
    for resting in boxes() {
        let (h, friction) = (resting.world.time_step(), resting.world.friction());
        let run = resting.slide(Vector3::new(SPEED, 0.0, 0.0), 0.0);
        let (mut speed, mut way) = (SPEED, 0.0);
        for step in &run {
            speed = f64::max(0.0, speed - friction * GRAVITY * h);
            way += h * speed;
            let next = step.next();
            let name = format!("μ = {friction}, step {}", step.index);
            assert!((next.velocity[0] - speed).abs() < 1e-12, "{name}: {}", next.velocity);
            assert!((next.position[0] - way).abs() < 1e-12, "{name}: {}", next.position);
        }
        let end = run.last().unwrap().next();
        let exact = SPEED * SPEED / (2.0 * friction * GRAVITY);
        let short = (exact - end.position[0]) / (h * SPEED);
        assert!((0.49..0.51).contains(&short), "μ = {friction}: {short} hv short");
        assert!(end.velocity.norm() < 1e-13, "μ = {friction}: {}", end.velocity);
    }
}

/// Checks that a slide is straight and equally long in 36 directions, for any angle of the sides.
///
/// The friction cone is round. Friction acts at every corner of a non-rotating box along the same
/// direction. Its torque about the vertical is zero, because the centre of the normal forces has no
/// sideways offset. The tolerance is rounding.
#[test]
fn a_slide_is_straight_and_equally_long_in_every_compass_direction() {
    for resting in boxes() {
        let along_x = resting.slide(Vector3::new(SPEED, 0.0, 0.0), 0.0);
        for k in 0..36 {
            let angle = f64::from(k) * TAU / 36.0;
            let direction = Vector3::new(angle.cos(), angle.sin(), 0.0);
            let run = resting.slide(SPEED * direction, 0.7 * f64::from(k % 5));
            for (step, straight) in run.iter().zip(&along_x) {
                let (next, x) = (step.next(), straight.next().position[0]);
                let expected = x * direction + Vector3::new(0.0, 0.0, resting.height);
                let apart = (next.position - expected).amax();
                assert!(apart < 1e-12, "{angle}, step {}: {apart:e} m", step.index);
                assert!(next.spin.amax() < 1e-12, "{angle}, step {}: {}", step.index, next.spin);
            }
        }
    }
}
