//! Cylinders, cones and ellipsoids on the ground, against closed forms.

use crate::common::prelude::*;
use tumble_core::geometry::MassProperties;

const G: f64 = 9.81;
const SIDES: usize = 24;

fn solid(mass: f64, piece: Piece) -> RigidBody {
    RigidBody::solid(mass, &[piece]).unwrap().0
}

fn world(body: RigidBody, friction: f64, slope: f64, time_step: f64) -> World {
    let normal = Vector3::new(slope.sin(), 0.0, slope.cos());
    euler(Parameters {
        ground: Some(Plane::new(normal, 0.0).unwrap()),
        friction,
        time_step,
        ..Parameters::new(vec![body])
    })
}

/// State with its attitude as a rotation, on the ground of `world`.
fn on_ground(world: &World, turn: &Rotation3<f64>) -> State {
    let q = UnitQuaternion::from_rotation_matrix(turn);
    let attitude = Vector4::new(q.w, q.i, q.j, q.k);
    let zero = Vector3::zeros();
    let mut state = State { position: zero, attitude, velocity: zero, spin: zero };
    let normal = *world.ground().unwrap().normal();
    state.position -= normal * world.lowest_height(&[state]);
    state
}

/// Runs `steps` steps, all of which must be solved. Returns the last state.
fn run(world: &World, state: State, steps: usize) -> State {
    states(world, state, steps).pop().unwrap()
}

fn states(world: &World, state: State, count: usize) -> Vec<State> {
    let records = steps(&mut simulate(world, &[state]), count, has_not_failed);
    records.iter().map(|record| record.next_states()[0]).collect()
}

fn quarter_turn() -> Rotation3<f64> {
    Rotation3::from_axis_angle(&Vector3::x_axis(), std::f64::consts::FRAC_PI_2)
}

/// A rolling cylinder has v̇ = ⅔ g sin θ. The scheme has the relative error (ω h)²/4.
#[test]
fn a_cylinder_rolls_down_a_slope() {
    let (radius, slope, h) = (0.2, 0.3_f64, 0.005);
    let cylinder = || solid(3.0, Piece::cylinder(0.05, radius, SIDES).unwrap());
    let world = world(cylinder(), 0.5, slope, h);
    let end = run(&world, on_ground(&world, &quarter_turn()), 400);
    let speed = 400.0 * h * 2.0 / 3.0 * G * slope.sin();
    let error = end.velocity.norm() / speed - 1.0;
    assert!(error.abs() < 0.25 * (speed / radius * h).powi(2), "{error:e}");
    assert!((end.spin.norm() * radius / end.velocity.norm() - 1.0).abs() < 1e-11);
    assert!(end.position.y.abs() < 1e-10, "{}", end.position.y);
}

/// A cylinder that slides without spin rolls with two thirds of its speed in the end, because its
/// angular momentum about the line of contact is constant. The scheme's angular momentum has the
/// relative difference (ω h)²/4 from I ω.
#[test]
fn a_sliding_cylinder_ends_rolling_with_two_thirds_of_its_speed() {
    let world = world(solid(1.0, Piece::cylinder(0.1, 0.1, SIDES).unwrap()), 0.3, 0.0, 0.002);
    let mut start = on_ground(&world, &quarter_turn());
    start.velocity.x = 3.0;
    let end = run(&world, start, 500);
    let error = end.velocity.x / 2.0 - 1.0;
    assert!(error.abs() < 0.25 * (20.0 * 0.002_f64).powi(2), "{error:e}");
}

/// A cylinder spins on its flat end, which touches along its rim: the torque μ N R gives ω̇ = −2 μ
/// g/R. The friction acts at the start of the step along the mean slip, with the error (ω h)²/8.
#[test]
fn a_spinning_cylinder_on_its_end_is_slowed_by_its_rim() {
    let (radius, friction, h) = (0.1, 0.2, 1e-3);
    let world = world(solid(1.0, Piece::cylinder(0.02, radius, SIDES).unwrap()), friction, 0.0, h);
    let mut start = on_ground(&world, &Rotation3::identity());
    start.spin.z = 20.0;
    let end = run(&world, start, 200);
    let spin = 20.0 - 0.2 * 2.0 * friction * G / radius;
    assert!((end.spin.z - spin).abs() < 1e-4 * 20.0, "{} {spin}", end.spin.z);
    assert!((end.position - start.position).norm() < 1e-9);
}

/// A cylinder on its end stands on a slope of tan θ < R/H, with half the length H, and topples on a
/// steeper one. The direction downhill points between two corners of the core.
#[test]
fn a_cylinder_topples_at_the_angle_of_its_rim() {
    let (radius, half) = (0.1, 0.15_f64);
    let between = Rotation3::from_axis_angle(&Vector3::z_axis(), 0.5 * 15.0_f64.to_radians());
    for (part, stands) in [(0.97, true), (0.998, true), (1.002, false)] {
        let slope = (part * radius / half).atan();
        let body = solid(1.0, Piece::cylinder(half, radius, SIDES).unwrap());
        let world = world(body, 2.0, slope, 0.01);
        let tilt = Rotation3::from_axis_angle(&Vector3::y_axis(), slope);
        let start = on_ground(&world, &(tilt * between));
        let end = run(&world, start, 300);
        let moved = (end.position - start.position).norm();
        assert_eq!(moved < 1e-8, stands, "{part}: {moved:e} m");
    }
}

/// A thin disc rolls on its rim with its centre at rest. Its contact point circles with the rate Ω:
///
/// ```text
/// Ω² = 4 g/(r sin α)
/// ```
///
/// with the inclination α of the disc. The thickness is 10⁻⁴ of the radius. The scheme is of first
/// order.
#[test]
fn a_disc_rolls_around_its_resting_centre() {
    let (radius, tilt) = (0.1, 0.3_f64);
    let rate = (4.0 * G / (radius * tilt.sin())).sqrt();
    let off = |steps: usize| {
        let h = 0.2 / steps as f64;
        let part = |moment: f64| moment * radius * radius;
        let inertia = Matrix3::from_diagonal(&Vector3::new(part(0.25), part(0.25), part(0.5)));
        let piece = Piece::cylinder(1e-4 * radius, radius, SIDES).unwrap();
        let world = world(RigidBody::from_pieces(1.0, inertia, vec![piece]).unwrap(), 1.0, 0.0, h);
        let turn = Rotation3::from_axis_angle(&Vector3::x_axis(), tilt);
        let mut start = on_ground(&world, &turn);
        // Along the diameter through the contact point.
        start.spin = Vector3::y() * rate * tilt.sin();
        let end = run(&world, start, steps);
        let axis = rotation(&end.attitude).column(2).into_owned();
        // The horizontal part of the axis circles from −y.
        let angle = axis.x.atan2(-axis.y).rem_euclid(std::f64::consts::TAU);
        let expected = (rate * 0.2).rem_euclid(std::f64::consts::TAU);
        let turned = (angle - expected).abs().min((angle + expected - std::f64::consts::TAU).abs());
        (turned, (end.position - start.position).norm() / radius)
    };
    let (coarse, fine) = (off(2000), off(4000));
    assert!(fine.0 < 0.05 && fine.1 < 0.02, "{coarse:?} {fine:?}");
    for (coarse, fine) in [(coarse.0, fine.0), (coarse.1, fine.1)] {
        let ratio = coarse / fine;
        assert!((1.5..2.6).contains(&ratio), "{coarse:e} {fine:e}");
    }
}

/// A cone rolls on its side about its resting apex at a constant rate. Its spin is along the line
/// of contact, Ω cot β with the half angle β.
#[test]
fn a_cone_rolls_about_its_apex() {
    let (radius, height) = (0.06, 0.2_f64);
    let beta = (radius / height).atan();
    let (rate, steps, h) = (2.0, 1000, 1e-3);
    let piece = Piece::cone(0.5 * height, radius, SIDES).unwrap();
    let from_centre = Vector3::z() * (0.5 * height) - MassProperties::from_piece(&piece).centre;
    let world = world(solid(1.0, piece), 1.0, 0.0, h);
    // The apex points to +x on the ground, the axis rises by β towards −x.
    let turn = Rotation3::from_axis_angle(&Vector3::y_axis(), std::f64::consts::FRAC_PI_2 + beta);
    let mut start = on_ground(&world, &turn);
    let apex = |state: &State| {
        let turn = rotation(&state.attitude);
        state.position + turn * from_centre
    };
    let place = apex(&start);
    assert!(place.z.abs() < 1e-12, "the apex is on the ground: {place}");
    // The line of contact runs from the apex along −x; the spin along it is opposite for Ω > 0.
    let spin = Vector3::x() * (rate / beta.tan());
    let omega = spin + Vector3::zeros();
    start.spin = turn.inverse() * omega;
    start.velocity = omega.cross(&(start.position - place));
    let speed = start.velocity.norm();
    for (k, state) in states(&world, start, steps).iter().enumerate() {
        assert!((state.velocity.norm() / speed - 1.0).abs() < 0.02, "k = {k}");
        assert!((apex(state) - place).norm() < 0.01 * height, "k = {k}");
    }
}

/// Small oscillations of an ellipsoid on its side. With the half axes a > b, it rolls like a
/// pendulum with ρ = a²/b, the radius of curvature:
///
/// ```text
/// ω² = g (ρ − b)/(I/m + b²),   I/m = (a² + b²)/5
/// ```
#[test]
fn an_ellipsoid_rocks_with_its_period() {
    let (a, b) = (0.3, 0.1);
    let omega = (G * (a * a / b - b) / ((a * a + b * b) / 5.0 + b * b)).sqrt();
    let h = 1e-4;
    let body = solid(2.0, Piece::ellipsoid(Vector3::new(a, b, b), SIDES).unwrap());
    let world = world(body, 1.0, 0.0, h);
    let tilt = Rotation3::from_axis_angle(&Vector3::y_axis(), 0.01);
    let all = states(&world, on_ground(&world, &tilt), 12_000);
    // Passages through the lowest position, two a period.
    let pitch: Vec<f64> = all.iter().map(|state| state.attitude[2]).collect();
    let zeros: Vec<f64> = (1..pitch.len())
        .filter(|&k| pitch[k - 1] * pitch[k] < 0.0)
        .map(|k| k as f64 - pitch[k] / (pitch[k] - pitch[k - 1]))
        .collect();
    let halves = zeros.len() - 1;
    let period = 2.0 * h * (zeros[halves] - zeros[0]) / halves as f64;
    let exact = std::f64::consts::TAU / omega;
    assert!(halves > 3 && (period / exact - 1.0).abs() < 2e-3, "{period} {exact}");
}

/// An ellipsoid that is nearly a sphere moves like the sphere.
#[test]
fn a_round_ellipsoid_rolls_like_a_ball() {
    let nearly = Vector3::new(0.1, 0.1, 0.1 * (1.0 - 1e-5));
    let end = [Piece::ellipsoid(nearly, SIDES), Piece::sphere(0.1)].map(|piece| {
        let world = world(solid(1.0, piece.unwrap()), 0.4, 0.1, 0.002);
        let mut start = on_ground(&world, &Rotation3::identity());
        start.velocity = Vector3::new(0.3, 1.0, 0.0);
        start.spin = Vector3::new(5.0, -2.0, 4.0);
        run(&world, start, 300)
    });
    assert!((end[0].position - end[1].position).norm() < 1e-4);
    assert!((end[0].velocity - end[1].velocity).norm() < 1e-3);
}

/// A spinning egg rises: friction at the contact point lifts a prolate body that spins fast about
/// a short axis.
#[test]
fn a_spinning_egg_rises() {
    let (long, short) = (0.03, 0.02);
    let body = solid(0.05, Piece::ellipsoid(Vector3::new(short, short, long), SIDES).unwrap());
    let world = world(body, 0.1, 0.0, 2e-4);
    let tilt = Rotation3::from_axis_angle(&Vector3::x_axis(), 1.5);
    let mut start = on_ground(&world, &tilt);
    start.spin = tilt.inverse() * Vector3::z() * 200.0;
    let highest = states(&world, start, 15_000).iter().map(|s| s.position.z).fold(0.0, f64::max);
    assert!(highest > short + 0.9 * (long - short), "{highest}");
}

/// Random drops of all smooth shapes: no step fails, and no step adds energy. Free rotation of the
/// momentum form conserves energy only to second order, which the rotational energy times (ω h)²
/// bounds.
#[test]
fn drops_do_not_gain_energy() {
    let mut draw = rand_mt::Mt::new(3);
    let mut number = move || f64::from(draw.next_u32()) / f64::from(u32::MAX) * 2.0 - 1.0;
    let (mut steps, mut unsolved) = (0, Vec::new());
    for drop in 0..60 {
        let piece = match drop % 4 {
            0 => Piece::cylinder(0.06, 0.04, SIDES),
            1 => Piece::cylinder(0.01, 0.1, SIDES),
            2 => Piece::cone(0.06, 0.05, SIDES),
            _ => Piece::ellipsoid(Vector3::new(0.06, 0.04, 0.03), SIDES),
        };
        let h = if drop % 8 < 4 { 0.002 } else { 0.0005 };
        let world = world(solid(0.3, piece.unwrap()), 0.5, 0.0, h);
        let q = Vector4::from_fn(|_, _| number()).normalize();
        let q = UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(q[0], q[1], q[2], q[3]));
        let mut start = on_ground(&world, &q.to_rotation_matrix());
        start.position.z += 0.1;
        start.spin = Vector3::new(0.0, 1.0, 3.0);
        let inertia = *world.bodies()[0].inertia();
        let energy = |state: &State| {
            let turning = 0.5 * state.spin.dot(&(inertia * state.spin));
            let moving = 0.5 * state.velocity.norm_squared() + G * state.position.z;
            (0.3 * moving + turning, turning * (h * state.spin.norm()).powi(2))
        };
        let mut run = Simulation::new(world.clone(), [start], Motion::native(&world)).unwrap();
        let mut record = StepRecord::new();
        let mut before = energy(&start);
        for k in 0..(1.0 / h) as usize {
            run.step(&mut record).unwrap();
            let after = energy(&record.next_states()[0]);
            let gained = after.0 - before.0 - after.1 - before.1;
            if gained > 1e-5 || record.status() == StepStatus::Failed {
                unsolved.push(format!("drop {drop}, k = {k}: {:?} {gained:e} J", record.status()));
            }
            steps += 1;
            before = after;
        }
    }
    assert!(unsolved.is_empty(), "{} of {steps}\n{}", unsolved.len(), unsolved.join("\n"));
}

/// Drops of drawn shapes: sizes from 1 mm to 100 m, flat and slender ones, on slopes, with fast spins
/// and coefficients of friction from 0 to 1.5. No step gains energy, and at most one in a hundred
/// thousand is not solved.
#[test]
#[ignore = "slow"]
fn drops_of_all_sizes_are_solved() {
    let mut draw = rand_mt::Mt::new(29);
    let mut number = move || f64::from(draw.next_u32()) / f64::from(u32::MAX) * 2.0 - 1.0;
    let (mut steps, mut failed, mut wild) = (0, Vec::new(), Vec::new());
    for drop in 0..400 {
        let size = 10.0_f64.powf(2.5 * number() - 0.5);
        let (flat, wide) = (10.0_f64.powf(number() - 0.5), 10.0_f64.powf(0.5 * number()));
        let piece = match drop % 3 {
            0 => Piece::cylinder(size * flat, size, SIDES),
            1 => Piece::cone(size * flat, size, SIDES),
            _ => Piece::ellipsoid(Vector3::new(size, size * wide, size * flat), SIDES),
        };
        let h = (size / G).sqrt() * 10.0_f64.powf(0.5 * number() - 2.0);
        let friction = if drop % 5 == 0 { 0.0 } else { 0.75 + 0.75 * number() };
        let world = world(solid(size.powi(3) * 100.0, piece.unwrap()), friction, 0.1 * number(), h);
        let q = Vector4::from_fn(|_, _| number()).normalize();
        let q = UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(q[0], q[1], q[2], q[3]));
        let mut start = on_ground(&world, &q.to_rotation_matrix());
        start.position.z += size * (1.0 + number());
        let speed = (G * size).sqrt();
        start.velocity = Vector3::from_fn(|_, _| speed * number());
        start.spin = Vector3::from_fn(|_, _| 3.0 * speed / size * number());
        let mut run = Simulation::new(world.clone(), [start], Motion::native(&world)).unwrap();
        let mut record = StepRecord::new();
        for k in 0..600 {
            run.step(&mut record).unwrap();
            let at = format!("drop {drop}, k = {k}, size {size:.1e}, h {h:.1e}");
            match record.status() {
                StepStatus::Failed => failed.push(at),
                StepStatus::Wild => wild.push(format!("{at}: {:?}", record.unphysical())),
                _ => {}
            }
            steps += 1;
        }
    }
    println!("{} failed of {steps}: {}", failed.len(), failed.join("; "));
    assert!(wild.is_empty(), "{}", wild.join("\n"));
    // One in a hundred thousand.
    assert!(failed.len() * 100_000 <= steps, "{}", failed.join("\n"));
}

/// A tippe top is a ball of radius R whose centre of mass is below its centre by a. With the moments
/// C about its axis and I across, sliding friction turns a fast one over if 1 − a/R < I/C < 1 + a/R
/// (Ciocci and Langerock, "Dynamics of the tippe top via Routhian reduction", 2007).
#[test]
fn a_tippe_top_turns_over() {
    let (radius, offset, mass, h) = (0.02, 0.006, 0.02, 0.0002);
    let ball = Piece::sphere(radius).unwrap();
    let ball = ball.moved_by(&Matrix3::identity(), &(Vector3::z() * offset)).unwrap();
    let moment = 0.4 * mass * radius * radius;
    let inertia = Matrix3::from_diagonal(&Vector3::new(moment, moment, moment));
    let body = RigidBody::from_pieces(mass, inertia, vec![ball]).unwrap();
    let world = world(body, 0.3, 0.0, h);
    let turn = Rotation3::from_axis_angle(&Vector3::x_axis(), 0.1);
    let mut start = on_ground(&world, &turn);
    start.spin = turn.inverse() * Vector3::z() * 180.0;
    let states = states(&world, start, 20_000);
    let rises = |state: &State| state.position.z - radius;
    assert!(rises(&start) < -0.9 * offset);
    let highest = states.iter().map(rises).fold(f64::NEG_INFINITY, f64::max);
    assert!(highest > 0.9 * offset, "{highest}");
}

/// The contacts of a cylinder at rest stay at the same places of the ground, to the last bit.
#[test]
fn the_contacts_of_a_resting_cylinder_stay() {
    let world = world(solid(1.0, Piece::cylinder(0.1, 0.05, SIDES).unwrap()), 0.5, 0.0, 0.002);
    let start = on_ground(&world, &quarter_turn());
    let mut run = Simulation::new(world.clone(), [start], Motion::native(&world)).unwrap();
    let mut record = StepRecord::new();
    let mut places = || {
        run.step(&mut record).unwrap();
        let position = record.next_states()[0].position;
        let of = |contact: &Contact| position + contact.arm;
        record.first().contacts.iter().map(of).collect::<Vec<_>>()
    };
    let first = places();
    assert!(first.len() >= 2);
    for _ in 0..500 {
        let moved = places().iter().zip(&first).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
        assert!(moved < 1e-15, "{moved:e}");
    }
}
