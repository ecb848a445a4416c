//! Rounded features that separate and meet: departures in closed form, and exact gaps at the end of
//! a step.

use crate::common::prelude::*;
use crate::curved_common as common;

use common::{G, MASS, at, body, capsule_along_y, normal_forces, run, sphere, world};

const RADIUS: f64 = 0.1;

// A body that slides or rolls off a round top. Its centre moves on a circle of radius L, at the
// angle θ from the vertical.

/// Descent that begins near the top, with the speed of a start from rest at the top. `part` is the
/// fraction of the energy in translation: v² = 2 `part` g L (1 − cos θ).
struct Descent {
    body: RigidBody,
    top: Piece,
    /// Distance L of the centres [m].
    distance: f64,
    friction: f64,
    part: f64,
    /// Ratio ω/v [1/m].
    turning: f64,
}

const FIRST_ANGLE: f64 = 0.15;

impl Descent {
    /// Normal force N = m (g cos θ − v²/L), relative to m g.
    fn force(&self, cos: f64) -> f64 {
        cos - 2.0 * self.part * (1.0 - cos)
    }

    /// Angle at which the normal force is zero.
    fn departure(&self) -> f64 {
        f64::acos(2.0 * self.part / (1.0 + 2.0 * self.part))
    }

    fn run(&self, h: f64) -> Vec<StepRecord> {
        let gravity = Vector3::new(0.0, 0.0, -G);
        let (bodies, pieces) = (vec![self.body.clone()], vec![self.top.clone()]);
        let world = world(bodies, pieces, (gravity, self.friction, h));
        // The velocities of the scheme belong to the midpoints of the steps, half a step earlier.
        let speed_at =
            |angle: f64| f64::sqrt(2.0 * self.part * G * self.distance * (1.0 - angle.cos()));
        let earlier = FIRST_ANGLE - 0.5 * h * speed_at(FIRST_ANGLE) / self.distance;
        let speed = speed_at(earlier);
        let start = at(
            self.distance * Vector3::new(FIRST_ANGLE.sin(), 0.0, FIRST_ANGLE.cos()),
            speed * Vector3::new(earlier.cos(), 0.0, -earlier.sin()),
            Vector3::new(0.0, self.turning * speed, 0.0),
        );
        run(&world, &[start], (1.2 / h) as usize)
    }

    /// Checks the force in every step until shortly before the departure, to a hundredth of the
    /// weight. The angle of departure has an error of at most the motion of two steps, for every
    /// step size.
    fn check(&self, name: &str) {
        let departure = self.departure();
        let speed = f64::sqrt(2.0 * self.part * G * self.distance * (1.0 - departure.cos()));
        for h in [4e-3, 2e-3, 1e-3] {
            let mut departed = None;
            for record in &self.run(h) {
                let position = record.state().position;
                let angle = position[0].atan2(position[2]);
                let total: f64 = normal_forces(record).iter().sum::<f64>() / (MASS * G);
                if angle < departure - 0.05 {
                    let exact = self.force(angle.cos());
                    assert!(
                        (total - exact).abs() < 1e-2,
                        "{name}, h = {h}, k = {}: {total} in place of {exact} m g at {angle} rad",
                        record.index
                    );
                }
                if total == 0.0 {
                    departed = Some(angle);
                    break;
                }
            }
            let found = departed.unwrap_or(f64::INFINITY);
            let turn = h * speed / self.distance;
            assert!(
                (found - departure).abs() < 2.0 * turn,
                "{name}, h = {h}: departs at {found} rad in place of {departure}, {turn} rad a step"
            );
        }
    }
}

const TOP: f64 = 0.5;

/// Frictionless: cos θ = 2/3.
#[test]
fn a_ball_slides_off_a_ball() {
    let descent = Descent {
        body: body(sphere(RADIUS)),
        top: sphere(TOP),
        distance: TOP + RADIUS,
        friction: 0.0,
        part: 1.0,
        turning: 0.0,
    };
    assert!((descent.departure().cos() - 2.0 / 3.0).abs() < 1e-15);
    descent.check("ball on ball");
}

/// Rolling without slip: cos θ = 10/17. With μ = 5 the ball slips once N < F/5 = 2/35 m g sin θ.
/// That is closer to the departure than the checked range.
#[test]
fn a_ball_rolls_off_a_ball() {
    let descent = Descent {
        body: body(sphere(RADIUS)),
        top: sphere(TOP),
        distance: TOP + RADIUS,
        friction: 5.0,
        part: 5.0 / 7.0,
        turning: 1.0 / RADIUS,
    };
    assert!((descent.departure().cos() - 10.0 / 17.0).abs() < 1e-15);
    descent.check("ball rolls on ball");
}

/// Checks a ball on the side of a capsule, and a capsule along another one.
#[test]
fn balls_and_capsules_slide_off_a_capsule() {
    for (name, piece) in
        [("ball", sphere(RADIUS)), ("capsule along it", capsule_along_y(0.3, RADIUS))]
    {
        let descent = Descent {
            body: body(piece),
            top: capsule_along_y(1.0, TOP),
            distance: TOP + RADIUS,
            friction: 0.0,
            part: 1.0,
            turning: 0.0,
        };
        descent.check(name);
    }
}

/// Checks a ball on the sharp edge of a box: L is the ball's own radius.
#[test]
fn a_ball_slides_over_the_edge_of_a_box() {
    let box_ = Piece::cuboid(Vector3::new(0.5, 1.0, 0.5)).unwrap();
    let top = box_.moved_by(&Matrix3::identity(), &Vector3::new(-0.5, 0.0, -0.5)).unwrap();
    let (body, distance) = (body(sphere(0.4)), 0.4);
    Descent { body, top, distance, friction: 0.0, part: 1.0, turning: 0.0 }.check("edge");
}

/// Checks a capsule that lies across a fixed one, balanced at its middle. The force is the weight
/// in every step.
#[test]
fn a_capsule_lies_across_a_capsule() {
    let gravity = Vector3::new(0.0, 0.0, -G);
    let across = Rotation3::from_axis_angle(&Vector3::y_axis(), std::f64::consts::FRAC_PI_2);
    let piece = Piece::capsule(0.3, RADIUS).unwrap();
    let piece = piece.moved_by(across.matrix(), &Vector3::zeros()).unwrap();
    let top = capsule_along_y(1.0, TOP);
    let world = world(vec![body(piece)], vec![top], (gravity, 0.5, 2e-3));
    let start = at(Vector3::new(0.0, 0.0, TOP + RADIUS), Vector3::zeros(), Vector3::zeros());
    for record in run(&world, &[start], 100) {
        let total: f64 = normal_forces(&record).iter().sum();
        assert!((total - MASS * G).abs() < 1e-6, "k = {}: {total} N", record.index);
        assert!(record.next().spin.norm() < 1e-9, "k = {}", record.index);
    }
}

// Impacts in free space.

/// Checks an oblique plastic impact of two bodies without friction. At the end of the step they
/// touch exactly: the distance of the centres, or of the axes of crossed capsules, is the sum of
/// the radii. Momentum is conserved.
#[test]
fn oblique_plastic_impact_ends_in_exact_contact() {
    let crossed = || {
        let across = Rotation3::from_axis_angle(&Vector3::y_axis(), std::f64::consts::FRAC_PI_2);
        let piece = Piece::capsule(0.3, 0.08).unwrap();
        piece.moved_by(across.matrix(), &Vector3::zeros()).unwrap()
    };
    let balls = (sphere(0.08), sphere(0.12));
    let capsules = (crossed(), capsule_along_y(0.3, 0.12));
    for (name, (first, second)) in [("balls", balls), ("crossed capsules", capsules)] {
        // The axes of the capsules are along x and y.
        let distance = |states: &[State]| {
            let apart = states[0].position - states[1].position;
            if name == "balls" { apart.norm() } else { apart[2].abs() }
        };
        for aside in [0.0, 0.03, 0.08] {
            let bodies = vec![body(first.clone()), body(second.clone())];
            let world = world(bodies, vec![], (Vector3::zeros(), 0.0, 2e-3));
            // The capsules meet at their middles, so that the impact does not turn them.
            let aside = if name == "balls" { aside } else { 0.0 };
            let starts = [
                at(Vector3::new(aside, 0.0, 0.4), Vector3::new(0.0, 0.0, -2.0), Vector3::zeros()),
                at(Vector3::zeros(), Vector3::new(0.0, 0.0, 1.0), Vector3::zeros()),
            ];
            let records = run(&world, &starts, 100);
            let touches = |record: &&StepRecord| !normal_forces(record).is_empty();
            let record = records.iter().find(touches).expect("they meet");
            let gap = distance(record.next_states()) - 0.2;
            assert!(gap.abs() < 1e-9, "{name}, {aside}: a gap of {gap} m");
            let sum = |states: &[State]| states[0].velocity + states[1].velocity;
            let kept = sum(record.next_states()) - sum(&starts);
            assert!(kept.amax() < 1e-12, "{name}, {aside}: {kept:?}");
        }
    }
}

/// Checks three balls in a row with gaps and e = 1. Each ball passes its speed on exactly.
#[test]
fn speeds_are_passed_on_along_a_row() {
    let bodies = vec![body(sphere(0.1)); 3];
    let world = world(bodies, vec![], (Vector3::zeros(), 0.0, 2e-3))
        .with_coefficient(Coefficient::Restitution, 1.0)
        .unwrap();
    let ball = |x: f64, speed: f64| {
        at(Vector3::new(x, 0.3, 0.0), Vector3::new(speed, 0.0, 0.0), Vector3::zeros())
    };
    let records = run(&world, &[ball(-0.5, 1.5), ball(0.0, 0.0), ball(0.31, 0.0)], 500);
    let last = records[499].next_states();
    for (state, speed) in last.iter().zip([0.0, 0.0, 1.5]) {
        let error = state.velocity - Vector3::new(speed, 0.0, 0.0);
        assert!(error.amax() < 1e-12, "{last:?}");
    }
    assert_eq!(records.iter().filter(|record| !normal_forces(record).is_empty()).count(), 2);
}

/// Checks that swapping the bodies does not change the result of an oblique rough impact of a ball
/// and a capsule.
#[test]
fn impact_of_curved_bodies_is_independent_of_body_order() {
    let pieces = [sphere(0.08), capsule_along_y(0.2, 0.12)];
    let starts = [
        at(
            Vector3::new(0.05, 0.04, 0.4),
            Vector3::new(0.2, 0.1, -2.0),
            Vector3::new(3.0, 1.0, 2.0),
        ),
        at(Vector3::zeros(), Vector3::new(0.0, 0.0, 1.0), Vector3::new(0.0, 2.0, 0.5)),
    ];
    let outcome = |order: [usize; 2]| {
        let bodies = order.map(|which| body(pieces[which].clone())).to_vec();
        let world = world(bodies, vec![], (Vector3::zeros(), 0.4, 2e-3));
        let world = world.with_coefficient(Coefficient::Restitution, 0.5).unwrap();
        let records = run(&world, &order.map(|which| starts[which]), 150);
        let last = records[149].next_states();
        assert!(records.iter().any(|record| !normal_forces(record).is_empty()));
        order.map(|which| last[which])
    };
    let (told, swapped) = (outcome([0, 1]), outcome([1, 0]));
    for (a, b) in told.iter().zip(&swapped) {
        assert!((a.velocity - b.velocity).amax() < 1e-9, "{a:?} {b:?}");
        assert!((a.spin - b.spin).amax() < 1e-8, "{a:?} {b:?}");
    }
}
