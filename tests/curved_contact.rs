//! Rounded features that roll and slide on each other: forces, accelerations and departures in closed
//! form, and gaps that are exact at the end of a step.

use nalgebra::{Matrix3, Rotation3, Vector3, Vector4};
use tumble::geometry::Piece;
use tumble::mechanics::{RigidBody, State};
use tumble::simulation::{Motion, Simulation, StepRecord};
use tumble::step::StepStatus;
use tumble::world::{Fixed, Parameters, World};

const G: f64 = 9.81;
const MASS: f64 = 1.0;

fn body(piece: Piece) -> RigidBody {
    RigidBody::solid(MASS, &[piece]).unwrap().0
}

fn sphere(radius: f64) -> Piece {
    Piece::sphere(radius).unwrap()
}

/// A capsule with its axis along y.
fn capsule_along_y(half_length: f64, radius: f64) -> Piece {
    let turn = Rotation3::from_axis_angle(&Vector3::x_axis(), std::f64::consts::FRAC_PI_2);
    let piece = Piece::capsule(half_length, radius).unwrap();
    piece.moved_by(turn.matrix(), &Vector3::zeros()).unwrap()
}

fn fixed(piece: Piece) -> Fixed {
    Fixed { piece, friction: None }
}

fn at(position: Vector3<f64>, velocity: Vector3<f64>, spin: Vector3<f64>) -> State {
    State { position, attitude: Vector4::new(1.0, 0.0, 0.0, 0.0), velocity, spin }
}

fn world(
    bodies: Vec<RigidBody>,
    pieces: Vec<Piece>,
    (gravity, friction, time_step): (Vector3<f64>, f64, f64),
) -> World {
    let world = World::new(Parameters {
        bodies,
        ground: None,
        gravity,
        friction,
        time_step,
        rotation: tumble::mechanics::Rotation::Momentum,
    })
    .unwrap();
    world.with_fixed(pieces.into_iter().map(fixed).collect()).unwrap()
}

/// As many steps, each of them solved.
fn run(world: &World, states: &[State], steps: usize) -> Vec<StepRecord> {
    let starts = states.iter().copied();
    let mut simulation = Simulation::new(world.clone(), starts, Motion::native(world)).unwrap();
    let step = |_| {
        let mut record = StepRecord::new();
        simulation.step(&mut record).unwrap();
        let status = record.report.status;
        assert!(
            !matches!(status, StepStatus::Failed | StepStatus::Wild),
            "k = {}: {status}, {:?}",
            record.index,
            record.solution.contacts
        );
        record
    };
    (0..steps).map(step).collect()
}

/// The normal forces of a step, N.
fn normal_forces(record: &StepRecord) -> Vec<f64> {
    let contacts = record.solution.contacts.iter().filter(|contact| contact.carries_force());
    contacts.map(|contact| contact.normal_force).collect()
}

fn total_force(record: &StepRecord) -> Vector3<f64> {
    record.solution.forces().sum()
}

// A ball in a groove along x, whose walls make the angle φ with the plane y = 0.

const RADIUS: f64 = 0.1;
/// The groove falls by this towards +x.
const SLOPE: f64 = 20.0;

/// The walls, boxes whose upper faces are the groove's.
fn groove(phi: f64) -> Vec<Piece> {
    let (sin, cos) = phi.sin_cos();
    let wall = |side: f64| {
        // Columns: along the groove, up the wall, out of the wall towards the ball.
        let normal = Vector3::new(0.0, -side * cos, sin);
        let up = normal.cross(&Vector3::x());
        let turn = Matrix3::from_columns(&[Vector3::x(), up, normal]);
        let half_sides = Vector3::new(4.0, 0.5, 0.05);
        let along_wall = Vector3::new(0.0, side * sin, cos) * 0.5;
        let box_ = Piece::cuboid(half_sides).unwrap();
        box_.moved_by(&turn, &(along_wall - normal * 0.05)).unwrap()
    };
    vec![wall(1.0), wall(-1.0)]
}

fn in_groove(phi: f64, friction: f64, time_step: f64) -> Vec<StepRecord> {
    let alpha = SLOPE.to_radians();
    let gravity = G * Vector3::new(alpha.sin(), 0.0, -alpha.cos());
    let world = world(vec![body(sphere(RADIUS))], groove(phi), (gravity, friction, time_step));
    let position = Vector3::new(-2.0, 0.0, RADIUS / phi.sin());
    let start = at(position, Vector3::zeros(), Vector3::zeros());
    run(&world, &[start], (0.3 / time_step).round() as usize)
}

/// The largest of the numbers, after the first three steps.
fn settled(records: &[StepRecord], of: impl Fn(&StepRecord) -> f64) -> f64 {
    records[3..].iter().map(of).fold(0.0, f64::max)
}

const GROOVES: [f64; 3] = [30.0, 45.0, 60.0];
const FRICTIONS: [f64; 3] = [0.5, 1.0, 2.0];

/// It rolls about the line through its centre across the groove, at the height d = r sin φ above the points
/// that touch: v' = g sin α/(1 + I/(m d²)). The walls bear it: forces across the groove add up to
/// m g cos α upwards and to nothing sideways. Both at every friction, from rest, to a hundredth.
#[test]
fn a_ball_rolls_down_a_groove() {
    let alpha = SLOPE.to_radians();
    for phi in GROOVES.map(f64::to_radians) {
        for friction in FRICTIONS {
            let name = format!("{:.0} degrees, mu {friction}", phi.to_degrees());
            let lever = RADIUS * phi.sin();
            let moment = 0.4 * MASS * RADIUS * RADIUS;
            let rate = G * alpha.sin() / (1.0 + moment / (MASS * lever * lever));
            let errors = [2e-3, 1e-3].map(|h| {
                let records = in_groove(phi, friction, h);
                let weight = MASS * G * alpha.cos();
                let force = settled(&records, |record| {
                    let across = total_force(record) - Vector3::new(0.0, 0.0, weight);
                    across.yz().norm() / weight
                });
                let speed = settled(&records, |record| {
                    let exact = rate * h * (record.index + 1) as f64;
                    (record.next().velocity[0] - exact).abs() / exact
                });
                (force, speed)
            });
            assert!(errors[0].0 < 1e-2 && errors[0].1 < 1e-2, "{name}: {errors:?}");
            // First order or better, or a hundredth of what is allowed.
            let falls = |a: f64, b: f64| b <= 0.6 * a || b < 1e-4;
            assert!(falls(errors[0].0, errors[1].0), "{name}: {errors:?}");
            assert!(falls(errors[0].1, errors[1].1), "{name}: {errors:?}");
        }
    }
}

/// What rolls puts ever new points on the walls, which have no share of the weight to carry across the
/// groove by friction: N = m g cos α/(2 sin φ) on each wall, in every step after the first ones, to a hundredth.
#[test]
fn each_wall_of_a_groove_bears_its_part() {
    let alpha = SLOPE.to_radians();
    for phi in GROOVES.map(f64::to_radians) {
        for friction in FRICTIONS {
            let exact = MASS * G * alpha.cos() / (2.0 * phi.sin());
            let errors = [2e-3, 1e-3].map(|h| {
                settled(&in_groove(phi, friction, h), |record| {
                    let forces = normal_forces(record);
                    if forces.len() != 2 {
                        return f64::INFINITY;
                    }
                    forces.iter().map(|n| (n - exact).abs() / exact).fold(0.0, f64::max)
                })
            });
            let name = format!("{:.0} degrees, mu {friction}: {errors:?}", phi.to_degrees());
            assert!(errors[0] < 1e-2, "{name}");
            assert!(errors[1] <= 0.6 * errors[0] || errors[1] < 1e-4, "{name}");
        }
    }
}

/// Between a slope of 20° and the upright side of a fixed box, along both: the total force is the weight, and
/// no contact bears more than one and a half times what wedges it without friction (friction of what still
/// slides adds to it), in every step after the first ones.
#[test]
fn a_ball_between_a_slope_and_a_box_does_not_jam() {
    let alpha = SLOPE.to_radians();
    let (sin, cos) = alpha.sin_cos();
    let normal = Vector3::new(0.0, -sin, cos);
    let turn = Matrix3::from_columns(&[Vector3::x(), normal.cross(&Vector3::x()), normal]);
    let slope = Piece::cuboid(Vector3::new(4.0, 2.0, 0.05)).unwrap();
    let slope = slope.moved_by(&turn, &(-0.05 * normal)).unwrap();
    let stop = Piece::cuboid(Vector3::new(4.0, 0.1, 2.0)).unwrap();
    let stop = stop.moved_by(&Matrix3::identity(), &Vector3::new(0.0, -0.1, 0.0)).unwrap();
    // The slope falls towards −y, against the box whose side is y = 0.
    for friction in [0.2, 0.6, 1.0, 2.0] {
        for speed in [0.0, 0.5, 2.0] {
            let pieces = vec![slope.clone(), stop.clone()];
            let gravity = Vector3::new(0.0, 0.0, -G);
            let world = world(vec![body(sphere(RADIUS))], pieces, (gravity, friction, 2e-3));
            let height = (RADIUS + sin * RADIUS) / cos;
            let position = Vector3::new(-2.0, RADIUS, height);
            let start = at(position, Vector3::new(speed, 0.0, 0.0), Vector3::zeros());
            for record in &run(&world, &[start], 250)[3..] {
                let name = format!("mu {friction}, {speed} m/s, k = {}", record.index);
                let total = total_force(record);
                assert!((total[2] - MASS * G).abs() < 1e-2 * MASS * G, "{name}: {total:?}");
                assert!(total[1].abs() < 1e-2 * MASS * G, "{name}: {total:?}");
                // Without friction: W/cos α of the slope, W tan α of the box.
                for force in normal_forces(record) {
                    assert!(force < 1.5 * MASS * G / cos, "{name}: {force} N");
                }
            }
        }
    }
}

/// A capsule on two points: v' = g sin α/(1 + I/(m r²)) about its axis, and its points bear m g cos α.
#[test]
fn a_capsule_rolls_down_a_slope() {
    let alpha = SLOPE.to_radians();
    let gravity = G * Vector3::new(alpha.sin(), 0.0, -alpha.cos());
    let plate = Piece::cuboid(Vector3::new(4.0, 1.0, 0.05)).unwrap();
    let plate = plate.moved_by(&Matrix3::identity(), &Vector3::new(0.0, 0.0, -0.05)).unwrap();
    let body = body(capsule_along_y(0.2, RADIUS));
    let rate = G * alpha.sin() / (1.0 + body.inertia()[(1, 1)] / (MASS * RADIUS * RADIUS));
    for friction in [0.5, 2.0] {
        let world = world(vec![body.clone()], vec![plate.clone()], (gravity, friction, 2e-3));
        let position = Vector3::new(-2.0, 0.0, RADIUS);
        let records = run(&world, &[at(position, Vector3::zeros(), Vector3::zeros())], 250);
        for record in &records[3..] {
            let (k, forces) = (record.index, normal_forces(record));
            let weight = MASS * G * alpha.cos();
            assert_eq!(forces.len(), 2, "mu {friction}, k = {k}");
            for force in forces {
                assert!((force - 0.5 * weight).abs() < 1e-2 * weight, "mu {friction}, k = {k}");
            }
            let exact = rate * 2e-3 * (k + 1) as f64;
            let speed = record.next().velocity[0];
            assert!(
                (speed - exact).abs() < 1e-2 * exact,
                "mu {friction}, k = {k}: {speed} {exact}"
            );
        }
    }
}

/// A cube with rounded edges, thrown on rough ground, comes to rest without a step that makes
/// energy: no kinetic energy beyond the work of the weight but for the turn within a step (eq. 28).
#[test]
fn a_rounded_cube_makes_no_energy() {
    let corner = |k: u8| Vector3::from_fn(|axis, _| if k >> axis & 1 == 1 { 0.07 } else { -0.07 });
    let corners: Vec<_> = (0..8).map(corner).collect();
    let body = body(Piece::hull(&corners, 0.03).unwrap());
    let plate = Piece::cuboid(Vector3::new(4.0, 4.0, 0.05)).unwrap();
    let plate = plate.moved_by(&Matrix3::identity(), &Vector3::new(0.0, 0.0, -0.05)).unwrap();
    let gravity = Vector3::new(0.0, 0.0, -G);
    for friction in [0.3, 1.0] {
        let world = world(vec![body.clone()], vec![plate.clone()], (gravity, friction, 2e-3));
        let position = Vector3::new(-1.0, 0.0, 0.25);
        let start = at(position, Vector3::new(1.0, 0.2, 0.0), Vector3::new(1.0, 12.0, -2.0));
        let energy = |state: &State| {
            let spinning = state.spin.dot(&(body.inertia() * state.spin));
            0.5 * (MASS * state.velocity.norm_squared() + spinning) + MASS * G * state.position[2]
        };
        let records = run(&world, &[start], 1000);
        for record in &records {
            let gained = energy(record.next()) - energy(record.state());
            assert!(gained < 1e-3, "mu {friction}, k = {}: {gained} J", record.index);
        }
        let last = records[999].next();
        assert!(last.velocity.norm() < 1e-3 && last.spin.norm() < 1e-2, "{last:?}");
    }
}

// What slides or rolls off a round top: the centre goes round at the distance L, by the angle θ from
// the vertical.

/// From near the top, with the speed of a start from rest at the top. `part` is that of the energy which
/// is in the motion along: v² = 2 `part` g L (1 − cos θ).
struct Descent {
    body: RigidBody,
    top: Piece,
    /// L, m.
    distance: f64,
    friction: f64,
    part: f64,
    /// ω/v, 1/m.
    turning: f64,
}

const FIRST_ANGLE: f64 = 0.15;

impl Descent {
    /// N = m (g cos θ − v²/L), in parts of m g.
    fn force(&self, cos: f64) -> f64 {
        cos - 2.0 * self.part * (1.0 - cos)
    }

    /// Where it is nothing.
    fn departure(&self) -> f64 {
        f64::acos(2.0 * self.part / (1.0 + 2.0 * self.part))
    }

    fn run(&self, h: f64) -> Vec<StepRecord> {
        let gravity = Vector3::new(0.0, 0.0, -G);
        let (bodies, pieces) = (vec![self.body.clone()], vec![self.top.clone()]);
        let world = world(bodies, pieces, (gravity, self.friction, h));
        // The scheme's velocities are those of the middles of the steps: that of half a step before.
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

    /// In every step until shortly before the departure the force is that of the closed form, to a hundredth of
    /// the weight, and it departs within the turn of two steps of where it should, for every step.
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

/// Without slip: cos θ = 10/17. With μ = 5 it slips from where N < F/5 = 2/35 m g sin θ on, which is nearer to
/// the departure than what is looked at.
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

/// On the side of a capsule, and a capsule along another one.
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

/// Over the sharp edge of a box: L is the ball's own radius.
#[test]
fn a_ball_slides_over_the_edge_of_a_box() {
    let box_ = Piece::cuboid(Vector3::new(0.5, 1.0, 0.5)).unwrap();
    let top = box_.moved_by(&Matrix3::identity(), &Vector3::new(-0.5, 0.0, -0.5)).unwrap();
    let (body, distance) = (body(sphere(0.4)), 0.4);
    Descent { body, top, distance, friction: 0.0, part: 1.0, turning: 0.0 }.check("edge");
}

/// A capsule across a fixed one, its middle on it, lies there: the weight in every step.
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

/// Two bodies that meet obliquely, plastic and without friction, end the step of the impact in touch: the
/// distance of their centres, or of the axes of crossed capsules, is that of the radii, to rounding. And only what is
/// along the line of centres at the start is changed.
#[test]
fn what_meets_obliquely_ends_in_touch() {
    let crossed = || {
        let across = Rotation3::from_axis_angle(&Vector3::y_axis(), std::f64::consts::FRAC_PI_2);
        let piece = Piece::capsule(0.3, 0.08).unwrap();
        piece.moved_by(across.matrix(), &Vector3::zeros()).unwrap()
    };
    let balls = (sphere(0.08), sphere(0.12));
    let capsules = (crossed(), capsule_along_y(0.3, 0.12));
    for (name, (first, second)) in [("balls", balls), ("crossed capsules", capsules)] {
        // The capsules' axes are along x and y.
        let distance = |states: &[State]| {
            let apart = states[0].position - states[1].position;
            if name == "balls" { apart.norm() } else { apart[2].abs() }
        };
        for aside in [0.0, 0.03, 0.08] {
            let bodies = vec![body(first.clone()), body(second.clone())];
            let world = world(bodies, vec![], (Vector3::zeros(), 0.0, 2e-3));
            // The capsules meet in their middles, which does not turn them.
            let aside = if name == "balls" { aside } else { 0.0 };
            let starts = [
                at(Vector3::new(aside, 0.0, 0.4), Vector3::new(0.0, 0.0, -2.0), Vector3::zeros()),
                at(Vector3::zeros(), Vector3::new(0.0, 0.0, 1.0), Vector3::zeros()),
            ];
            let records = run(&world, &starts, 100);
            let touches = |record: &&StepRecord| !normal_forces(record).is_empty();
            let record = records.iter().find(touches).expect("they meet");
            let gap = distance(&record.solution.states) - 0.2;
            assert!(gap.abs() < 1e-9, "{name}, {aside}: a gap of {gap} m");
            let sum = |states: &[State]| states[0].velocity + states[1].velocity;
            let kept = sum(&record.solution.states) - sum(&starts);
            assert!(kept.amax() < 1e-12, "{name}, {aside}: {kept:?}");
        }
    }
}

/// Three balls head-on with gaps, e = 1: each passes its speed on, exactly.
#[test]
fn speeds_are_passed_on_along_a_row() {
    let bodies = vec![body(sphere(0.1)); 3];
    let world = world(bodies, vec![], (Vector3::zeros(), 0.0, 2e-3)).with_restitution(1.0).unwrap();
    let ball = |x: f64, speed: f64| {
        at(Vector3::new(x, 0.3, 0.0), Vector3::new(speed, 0.0, 0.0), Vector3::zeros())
    };
    let records = run(&world, &[ball(-0.5, 1.5), ball(0.0, 0.0), ball(0.31, 0.0)], 500);
    let last = &records[499].solution.states;
    for (state, speed) in last.iter().zip([0.0, 0.0, 1.5]) {
        let error = state.velocity - Vector3::new(speed, 0.0, 0.0);
        assert!(error.amax() < 1e-12, "{last:?}");
    }
    assert_eq!(records.iter().filter(|record| !normal_forces(record).is_empty()).count(), 2);
}

/// The order of the bodies is no physics: an oblique rough impact of a ball and a capsule, told in both orders.
#[test]
fn swapped_bodies_do_the_same() {
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
        let world = world.with_restitution(0.5).unwrap();
        let records = run(&world, &order.map(|which| starts[which]), 150);
        let last = &records[149].solution.states;
        assert!(records.iter().any(|record| !normal_forces(record).is_empty()));
        order.map(|which| last[which])
    };
    let (told, swapped) = (outcome([0, 1]), outcome([1, 0]));
    for (a, b) in told.iter().zip(&swapped) {
        assert!((a.velocity - b.velocity).amax() < 1e-9, "{a:?} {b:?}");
        assert!((a.spin - b.spin).amax() < 1e-8, "{a:?} {b:?}");
    }
}
