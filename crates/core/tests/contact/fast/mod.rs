//! Fast, thin or rotating bodies. None passes through another undetected, and no contact pushes
//! bodies that do not touch.

mod campaign;
mod own;

use crate::common::prelude::*;
use campaign::{Found, Pairs, direction, piece, reach};
use tumble_core::simulation::UnphysicalCause;

type V = Vector3<f64>;

fn v(x: f64, y: f64, z: f64) -> V {
    V::new(x, y, z)
}

fn at(position: V) -> State {
    let attitude = Vector4::new(1.0, 0.0, 0.0, 0.0);
    State { attitude, ..State::at_rest(position) }
}

/// World without a ground. `fall` is gravity [m/s²].
fn world(bodies: Vec<RigidBody>, friction: f64, time_step: f64, fall: f64) -> World {
    let gravity = v(0.0, 0.0, -fall);
    euler(Parameters {
        bodies,
        ground: None,
        gravity,
        friction,
        time_step,
        rotation: Rotation::Momentum,
    })
}

fn fixed_box(half_sides: V, centre: V) -> Piece {
    let piece = Piece::cuboid(half_sides).unwrap();
    piece.moved_by(&Matrix3::identity(), &centre).unwrap()
}

fn run(world: &World, states: &[State], count: usize) -> Vec<StepRecord> {
    steps(&mut simulate(world, states), count, |_| true)
}

fn kinetic(world: &World, states: &[State]) -> f64 {
    let of = |(body, state): (&RigidBody, &State)| {
        let turning = state.spin.dot(&(body.inertia() * state.spin));
        0.5 * (body.mass() * state.velocity.norm_squared() + turning)
    };
    world.bodies().iter().zip(states).map(of).sum()
}

fn is_solved(record: &StepRecord) -> bool {
    record.status().is_solved()
}

/// Drops a ball of 5 mm from 2 m onto a shelf of 1 cm. It comes to rest on the shelf, for every
/// phase of the impact within the step. In free flight the ball would end nearest to the lower
/// face.
#[test]
fn a_small_ball_lands_on_a_thin_shelf() {
    let ball = RigidBody::solid(0.001, &[Piece::sphere(0.005).unwrap()]).unwrap().0;
    for place in 0..25 {
        let mut start = at(v(0.0, 0.0, 0.511 + 0.0006 * f64::from(place)));
        start.velocity[2] = -6.3;
        let world = world(vec![ball.clone()], 0.3, 0.002, 9.81);
        let world = world.with_fixed(vec![fixed_box(v(0.5, 0.5, 0.005), v(0.0, 0.0, 0.5))]);
        for record in run(&world, &[start], 20) {
            assert!(is_solved(&record), "{place}, k = {}", record.index);
            assert!(record.first().contacts.len() <= 1, "{place}, k = {}", record.index);
        }
        let end = run(&world, &[start], 20)[19].next_states()[0];
        assert!((end.position[2] - 0.51).abs() < 1e-9 && end.velocity.norm() < 1e-9, "{end:?}");
    }
}

/// Collides a box and a thin plate at 20 m/s. In a step they move by twice their total thickness.
/// They move on together.
#[test]
fn a_box_and_a_thin_plate_meet() {
    let cube = RigidBody::solid_box(0.1, v(0.005, 0.005, 0.005)).unwrap();
    let plate = RigidBody::solid_box(0.1, v(0.0005, 0.15, 0.15)).unwrap();
    let (mut a, mut b) = (at(v(-0.02, 0.0, 0.0)), at(v(0.02, 0.01, 0.0003)));
    (a.velocity[0], b.velocity[0]) = (10.0, -10.0);
    let world = world(vec![cube, plate], 0.2, 0.001, 0.0);
    let records = run(&world, &[a, b], 12);
    assert!(records.iter().all(is_solved));
    let met = records.iter().any(|record| !record.first().contacts.is_empty());
    let [a, b] = [0, 1].map(|i| &records[11].next_states()[i]);
    assert!(met && a.velocity[0] < 0.5 && b.velocity[0] > -0.5, "{a:?} {b:?}");
    assert!(b.position[0] - a.position[0] > 0.0);
}

/// Checks a rod of 2 m that turns at 100 rad/s, half a radian per step, next to a post. It reaches
/// the post after a quarter turn, in the step from k = 3. Then it slides along the post on the same
/// side.
#[test]
fn a_turning_rod_meets_a_post() {
    let rod = RigidBody::solid_box(0.8, v(1.0, 0.01, 0.01)).unwrap();
    let mut start = at(V::zeros());
    start.spin[2] = 100.0;
    let world = world(vec![rod], 0.3, 0.005, 0.0);
    let world = world.with_fixed(vec![fixed_box(v(0.01, 0.01, 0.5), v(0.0, 0.8, 0.0))]);
    let records = run(&world, &[start], 12);
    let first = records.iter().position(|record| !record.first().contacts.is_empty());
    assert_eq!(first, Some(3));
    for record in &records[3..7] {
        // Position of the rod's centre line next to the post: it stays on its original side.
        let state = &record.next_states()[0];
        let angle = 2.0 * state.attitude[3].atan2(state.attitude[0]);
        let beside = state.position[0] + (0.8 - state.position[1]) / angle.tan();
        assert!(
            is_solved(record) && beside > 0.01,
            "{}: {beside} {:?} {}",
            record.index,
            record.status(),
            record.overlap()
        );
    }
}

/// Checks two boxes that separate at a distance of 0.75 mm. No contact pushes them, and without
/// restitution and friction they gain no energy. At the end of free flight the deepest axis belongs
/// to another face, whose plane would be 11 mm in front of its point.
#[test]
fn boxes_that_pass_closely_gain_no_energy() {
    let brick = RigidBody::solid_box(1.0, v(0.1, 0.075, 0.05)).unwrap();
    let state = |r: [f64; 3], q: [f64; 4], u: [f64; 3], w: [f64; 3]| State {
        position: V::from(r),
        attitude: Vector4::from(q).normalize(),
        velocity: V::from(u),
        spin: V::from(w),
    };
    let starts = [
        state(
            [0.5452981585647498, 0.20717871791508968, 0.271511745457579],
            [-0.3359389237142537, 0.08119495263141721, 0.8092071080205196, 0.4751171176983183],
            [1.1148704842480721, 0.4169875154619465, 0.880906765244915],
            [15.818077119585734, -12.69527126421339, 3.6590186585089075],
        ),
        state(
            [0.6822181852386902, 0.04688751044929961, 0.1371307871795635],
            [-0.186082436918581, -0.16527536467847756, -0.8066159241204922, -0.5361232427866591],
            [0.8831239333235317, 0.18973873870761962, -1.1729535234651927],
            [17.39361620481129, 11.187693033126944, -9.02627784326756],
        ),
    ];
    let world = world(vec![brick.clone(), brick], 0.0, 0.002, 9.81);
    let before = kinetic(&world, &starts);
    for record in run(&world, &starts, 4) {
        assert!(is_solved(&record), "k = {}: {:?}", record.index, record.status());
        let after = kinetic(&world, record.next_states());
        assert!(after < before * 1.02, "k = {}: {after} J of {before} J", record.index);
        for contact in &record.first().contacts {
            assert!(contact.gap > -1e-8, "k = {}: {}", record.index, contact.gap);
        }
    }
}

/// Checks a capsule across two boxes, and a bar with a hull as its core. Each box has two contact
/// points (the bar four) and carries half the weight.
#[test]
fn a_rounded_bar_across_two_boxes_has_two_points_on_each() {
    let bar = |x: f64, y: f64, z: f64, radius: f64| {
        let corner = |i: usize| {
            let sign = |axis: usize| if i >> axis & 1 == 1 { 1.0 } else { -1.0 };
            v(sign(0) * x, sign(1) * y, sign(2) * z)
        };
        Piece::hull(&std::array::from_fn::<_, 8, _>(corner), radius).unwrap()
    };
    let lying = rotation(&Vector4::new(0.5_f64.sqrt(), 0.0, 0.5_f64.sqrt(), 0.0));
    let capsule = Piece::capsule(0.2, 0.05).unwrap().moved_by(&lying, &V::zeros()).unwrap();
    for (piece, height, points) in [(capsule, 0.05, 2), (bar(0.2, 0.03, 0.02, 0.03), 0.05, 4)] {
        let body = RigidBody::solid(1.0, &[piece]).unwrap().0;
        let world = world(vec![body], 0.5, 0.002, 9.81);
        let boxes = [-0.2, 0.2].map(|x| fixed_box(v(0.1, 0.1, 0.1), v(x, 0.0, 0.1)));
        let world = world.with_fixed(boxes.to_vec());
        for record in run(&world, &[at(v(0.0, 0.0, 0.2 + height))], 3) {
            for index in 0..2 {
                let on = record.first().solution.contacts.iter();
                let on: Vec<_> = on.filter(|c| c.key.partner == Partner::Fixed(index)).collect();
                assert_eq!(on.len(), points, "k = {}", record.index);
                let force: f64 = on.iter().map(|contact| contact.normal_force).sum();
                // The tolerance is the velocity error of the solver, 1e-11 m/s, over h.
                assert!((force - 4.905).abs() < 1e-7, "k = {}: {force} N", record.index);
            }
        }
    }
}

/// Checks a rod that turns by two radians in a step. The step is unphysical if anything is within
/// reach, unless shorter intervals find the impact. Far from everything it is free flight.
#[test]
fn turn_of_two_radians_within_reach_of_something_is_unphysical() {
    let rod = RigidBody::solid_box(0.8, v(1.0, 0.01, 0.01)).unwrap();
    let mut start = at(v(0.0, 0.0, 1.5));
    start.spin[2] = 400.0;
    let alone = world(vec![rod.clone()], 0.3, 0.005, 0.0);
    let post = |y: f64| vec![fixed_box(v(0.01, 0.01, 0.5), v(0.0, y, 1.5))];
    let result = |world: &World, start: State| {
        let record = &run(world, &[start], 1)[0];
        (record.status(), record.unphysical())
    };
    let turns_far = |(status, cause): (StepStatus, Option<UnphysicalCause>)| {
        let Some(UnphysicalCause::Turn { body: 0, angle }) = cause else { panic!("{cause:?}") };
        // 400 rad/s times 5 ms, with a contact a little less.
        assert!(status == StepStatus::Wild && (angle - 2.0).abs() < 0.01, "{status}, {angle}");
    };
    let beside = |y: f64| alone.clone().with_fixed(post(y));
    let met = beside(0.8);
    let record = &run(&met, &[start], 1)[0];
    assert_eq!(record.status(), StepStatus::Substepped);
    let energy = |state: &State| tumble_core::simulation::energy::kinetic(&met, &rod, state);
    let (before, after) = (energy(&record.states()[0]), energy(&record.next_states()[0]));
    assert!(after < before, "{before} {after}");
    // No feature meets, but the direction of a turn of more than a radian is unknown.
    let missed = UnphysicalCause::Missed { between: [Partner::Body(0), Partner::Fixed(0)] };
    assert_eq!(result(&beside(1.2), start), (StepStatus::Wild, Some(missed)));
    for world in [&alone, &beside(2.5)] {
        assert_eq!(result(world, start), (StepStatus::Free, None));
    }
    let ground = |height: f64| {
        let start = State { position: v(0.0, 0.0, height), ..start };
        let (bodies, ground, gravity) = (vec![rod.clone()], Plane::level(), V::zeros());
        let rotation = Rotation::Momentum;
        let parameters = Parameters {
            bodies,
            ground: Some(ground),
            gravity,
            friction: 0.3,
            time_step: 0.005,
            rotation,
        };
        result(&euler(parameters), start)
    };
    turns_far(ground(0.5));
    assert_eq!(ground(1.5), (StepStatus::Free, None));
}

/// Checks a thousand random pairs at any speed, with spins of up to 0.9 rad per step.
///
/// No pair passes undetected. A pair that passes and is marked turns by more than 0.14 rad in the
/// step. No contact lies behind its point, and no failed step adds energy beyond (28). Some steps are far
/// too long for the motion: a needle that is hit off its middle turns many times within a step. Others
/// have solutions that make energy, also in shorter steps.
///
/// The bounds are those of four standard deviations from the mean counts of the seeds 2024 to 2028: 11 marked
/// (7 to 14), 21 failed (18 to 23), 42 gaining (33 to 53). Of 33 examined steps five have a solution.
#[test]
#[ignore = "slow"]
fn random_pairs_at_random_speeds_do_not_pass_each_other() {
    let (speeds, steps) = ([3.0, 99.0], [0.0005, 0.01]);
    let found = Pairs { seed: 2024, most_turn: 0.9, speeds, steps }.run();
    assert!(found.met > 900, "{}", found.met);
    assert!(found.passed.is_empty() && found.behind.is_empty(), "{found:#?}");
    // Pairs that passed and were marked as unphysical.
    assert!(found.marked.len() <= 24 && found.least_turn > 0.14, "{found:#?}");
    // Bounds on the failed steps, the examined ones and those with a solution.
    assert!(found.failed <= 40 && found.gaining <= 68, "{found:#?}");
    assert!(found.sought >= 1 && found.solvable <= 5, "{found:#?}");
    assert!(found.growth < 0.2, "{found:#?}");
}

/// Checks pairs at up to 3 m/s and 0.1 rad per step of a millisecond. None fails. Of 5000 pairs of the
/// seeds 1 to 5, two passed marked, in steps in which a thin needle turns by more than 0.1 rad after a hit.
#[test]
#[ignore = "slow"]
fn random_pairs_at_ordinary_speeds_meet() {
    let (speeds, steps) = ([0.5, 3.0], [0.001, 0.001]);
    let found = Pairs { seed: 1, most_turn: 0.1, speeds, steps }.run();
    assert!(found.met > 950, "{}", found.met);
    assert!(found.passed.is_empty() && found.behind.is_empty(), "{found:#?}");
    assert!(found.marked.len() <= 4 && found.least_turn > 0.1, "{found:#?}");
    assert!(found.failed <= 6 && found.failed_compact == 0, "{found:#?}");
}

/// Checks pieces against walls of 1 cm and 1 mm at 3 to 100 m/s, with h from 0.5 to 10 ms. None
/// ends on the other side.
#[test]
#[ignore = "slow"]
fn nothing_goes_through_a_wall() {
    let mut draws = Draws::new(7);
    let mut found = Found { least_turn: f64::INFINITY, ..Found::default() };
    for number in 0..400 {
        let piece = piece(&mut draws);
        let body = RigidBody::solid(0.1 + draws.unit(), std::slice::from_ref(&piece)).unwrap().0;
        let h = 0.0005 * 20_f64.powf(draws.unit());
        let speed = 3.0 * 33_f64.powf(draws.unit());
        let thickness = if number % 2 == 0 { 0.01 } else { 0.001 };
        let wall = fixed_box(v(0.5 * thickness, 20.0, 20.0), V::zeros());
        let of_wall = wall.clone();
        let apart = reach(&body.pieces()[0]) + thickness;
        let mut start = at(v(-apart - 3.0 * h * speed * draws.unit(), 0.0, 0.0));
        start.attitude = draws.attitude().normalize();
        start.spin = direction(&mut draws) * (0.9 * draws.unit() / h);
        start.velocity = v(speed, 0.0, 0.0) + direction(&mut draws) * 0.2 * speed;
        let world = world(vec![body], draws.unit(), h, 0.0).with_fixed(vec![wall]);
        let steps = (2.0 * apart / (h * speed) + 8.0).min(60.0) as usize;
        let records = run(&world, &[start], steps);
        found.met += u32::from(records.iter().any(|record| !record.first().contacts.is_empty()));
        for record in &records {
            let state = &record.next_states()[0];
            assert!(
                state.position[0] < 0.0,
                "{number}, k = {}: {:?}",
                record.index,
                record.status()
            );
            let piece = &world.bodies()[0].pieces()[0];
            found.look(&format!("wall {number}"), record, piece, &of_wall);
        }
    }
    assert!(found.met > 390, "{}", found.met);
    assert!(found.passed.is_empty() && found.behind.is_empty(), "{found:#?}");
    assert!(found.marked.is_empty(), "{found:#?}");
}

/// Checks two balls that graze each other within a step, by 1 to 40 % of their diameter. They
/// collide, or the step is marked as unphysical. If they overlap by less than a tenth, a contact
/// without a force is also allowed.
#[test]
fn grazing_balls_are_detected() {
    const RADIUS: f64 = 0.005;
    const TIME_STEP: f64 = 0.002;
    let ball = || {
        let piece = Piece::sphere(RADIUS).unwrap();
        RigidBody::solid(0.01, &[piece]).unwrap().0
    };
    let mut met = 0;
    for offset in [0.6, 0.8, 0.9, 0.95, 0.98, 0.99] {
        for speed in [2.5, 8.0, 25.0, 60.0] {
            for phase in [0.05, 0.25, 0.5, 0.75, 0.95] {
                let far = (3.0 + phase) * TIME_STEP * speed;
                let mut left = at(v(-far, 0.0, 0.0));
                let mut right = at(v(far, offset * 2.0 * RADIUS, 0.0));
                (left.velocity, right.velocity) = (v(speed, 0.0, 0.0), v(-speed, 0.0, 0.0));
                let world = world(vec![ball(), ball()], 0.0, TIME_STEP, 0.0);
                let records = run(&world, &[left, right], 8);
                let name = format!("offset {offset}, {speed} m/s, phase {phase}");
                let ends = records.last().unwrap().next_states();
                let parted = ends[0].velocity[1] < 0.0 && ends[1].velocity[1] > 0.0;
                let marked = records.iter().any(|record| !is_solved(record));
                let has_contact = records.iter().any(|record| !record.first().contacts.is_empty());
                assert!(parted || marked || has_contact && offset >= 0.9, "{name}");
                met += u32::from(parted);
            }
        }
    }
    // The others obey all laws at the end of the step.
    assert!(met >= 96, "{met} of 120 meet");
}
