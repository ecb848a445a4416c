//! Friction that depends on the direction, against closed forms and a computation of its law by hand.

use crate::common::prelude::*;

const G: f64 = 9.81;
const FRICTION: f64 = 0.4;
const FACTOR: f64 = 0.25;

/// A flat block of 1 kg on a plane with its normal in the x-z plane, `angle` (rad) from z.
fn block(angle: f64, time_step: f64, integrator: Integrator) -> World {
    let normal = Vector3::new(-angle.sin(), 0.0, angle.cos());
    world(
        vec![RigidBody::solid_box(1.0, Vector3::new(0.5, 0.5, 0.002)).unwrap()],
        normal,
        time_step,
    )
    .with_integrator(integrator)
}

fn world(bodies: Vec<RigidBody>, normal: Vector3<f64>, time_step: f64) -> World {
    let parameters = Parameters {
        ground: Some(Plane::new(normal, 0.0).unwrap()),
        friction: FRICTION,
        time_step,
        ..Parameters::new(bodies)
    };
    World::new(parameters).unwrap()
}

fn on_plane(angle: f64, velocity: Vector3<f64>) -> State {
    State {
        position: Vector3::new(-angle.sin(), 0.0, angle.cos()) * 0.002,
        attitude: Vector4::new((0.5 * angle).cos(), 0.0, -(0.5 * angle).sin(), 0.0),
        velocity,
        spin: Vector3::zeros(),
    }
}

fn simulate(world: &World, starts: impl IntoIterator<Item = State>) -> Simulation<'static> {
    let starts: Vec<_> = starts.into_iter().collect();
    Simulation::new(world.clone(), starts, Motion::native(world)).unwrap()
}

/// Takes `steps` solved steps.
fn run(simulation: &mut Simulation<'_>, count: usize) {
    last_step(simulation, count, |record| is_solved(record) && record.residual() < 1e-10);
}

/// A block stops after v²/(2 s μ g) along the axis, and after v²/(2 μ g) across it, whether the axis belongs
/// to the block or to the ground, and at any of both integrators.
#[test]
fn a_block_stops_sooner_across_the_axis() {
    let h = 0.001;
    for (of, factor) in
        [(Partner::Body(0), FACTOR), (Partner::Ground, FACTOR), (Partner::Ground, 3.0)]
    {
        for integrator in [Integrator::Euler, Integrator::Leapfrog] {
            for (way, share) in [(Vector3::x(), factor), (Vector3::y(), 1.0)] {
                let world = block(0.0, h, integrator)
                    .with_friction_axis(of, Vector3::new(2.0, 0.0, 0.0), factor)
                    .unwrap();
                let mut simulation = simulate(&world, [on_plane(0.0, way)]);
                let distance = 0.5 / (share * FRICTION * G);
                run(&mut simulation, (2.0 * distance / h) as usize + 2);
                let State { position, velocity, .. } = simulation.state();
                let missed = (position - way * distance).xy().norm();
                let allowed = if integrator == Integrator::Euler { 0.6 * h } else { 1e-6 };
                assert!(missed < allowed && velocity.norm() < 1e-11, "{of} {way} {missed}");
            }
        }
    }
}

/// Checks an oblique slip: friction −μ m g T² v/|T v| keeps v₁ over v₂ to the power s² constant.
#[test]
fn an_oblique_slip_turns_towards_the_axis() {
    let power = FACTOR * FACTOR;
    let (mut errors, invariant) = (Vec::new(), |v: &Vector3<f64>| v[0] / v[1].powf(power));
    for h in [0.002, 0.001] {
        let world = block(0.0, h, Integrator::Euler)
            .with_friction_axis(Partner::Body(0), Vector3::x(), FACTOR)
            .unwrap();
        let start = Vector3::new(0.6, 0.8, 0.0);
        let mut simulation = simulate(&world, [on_plane(0.0, start)]);
        run(&mut simulation, (0.15 / h) as usize);
        let velocity = simulation.state().velocity;
        assert!(velocity[1] < 0.5 * start[1] && velocity[0] > 0.85 * start[0], "{velocity}");
        errors.push((invariant(&velocity) / invariant(&start) - 1.0).abs());
    }
    assert!(errors[0] < 2e-3 && errors[1] < 0.6 * errors[0], "{errors:?}");
}

/// A block with its axis at ψ to the line of fall stays on a slope below tan⁻¹(μ/|T⁻¹ e|).
#[test]
fn the_limit_of_rest_is_an_ellipse() {
    for turned in [0.0_f64, 0.4, 1.1, 1.5] {
        let axis = Vector3::new(turned.cos(), turned.sin(), 0.0);
        let reach = (turned.cos() / FACTOR).hypot(turned.sin());
        let limit = (FRICTION / reach).atan();
        for (share, stays) in [(0.999, true), (1.001, false)] {
            let angle = share * limit;
            let world = block(angle, 0.002, Integrator::Leapfrog)
                .with_friction_axis(Partner::Body(0), axis, FACTOR)
                .unwrap();
            let mut simulation = simulate(&world, [on_plane(angle, Vector3::zeros())]);
            run(&mut simulation, 50);
            let speed = simulation.state().velocity.norm();
            assert_eq!(speed < 1e-12, stays, "{turned} {share} {speed}");
        }
    }
}

/// An axis along the normal changes nothing, and one at 45° acts with half its effect.
#[test]
fn an_axis_acts_by_its_part_in_the_plane() {
    for (axis, share) in [(Vector3::z(), 1.0), (Vector3::new(1.0, 0.0, 1.0), 0.5 * (1.0 + FACTOR))]
    {
        let world = block(0.0, 0.001, Integrator::Leapfrog)
            .with_friction_axis(Partner::Body(0), axis, FACTOR)
            .unwrap();
        let mut simulation = simulate(&world, [on_plane(0.0, Vector3::x())]);
        run(&mut simulation, 100);
        let expected = 1.0 - share * FRICTION * G * 0.1;
        let speed = simulation.state().velocity[0];
        assert!((speed - expected).abs() < 1e-9, "{axis} {speed} {expected}");
    }
}

/// Checks a knife edge that turns at the rate ω on a slope and cannot slip sideways: it runs in a cycloid,
///
/// ```text
/// x = g sin α/(2 ω²) sin² ωt,   y = g sin α/(2 ω²) (ωt − ½ sin 2ωt),
/// ```
///
/// across the slope and not down. Its friction along the edge is a thousandth of that across.
#[test]
fn a_knife_edge_on_a_slope_runs_in_a_cycloid() {
    let (downhill, rate, h) = (1.0, 2.0, 0.0005);
    let world = world(
        vec![RigidBody::solid(1.0, &[Piece::sphere(0.1).unwrap()]).unwrap().0],
        Vector3::z(),
        h,
    );
    let gravity = Vector3::new(downhill, 0.0, -G);
    let parameters = Parameters { gravity, ..world.parameters().clone() };
    let place = Vector3::z() * 0.1;
    let upright = Joint::fixed(0, None, [JointFrame::at(Vector3::zeros()), JointFrame::at(place)]);
    let free = Axis::Free(Drive::NONE);
    let upright = upright.with_axes([free; 3], [Axis::Locked, Axis::Locked, free]);
    let world = World::new(parameters)
        .unwrap()
        .with_integrator(Integrator::Leapfrog)
        .with_joints(vec![upright])
        .unwrap()
        .with_friction_axis(Partner::Body(0), Vector3::x(), 0.001)
        .unwrap();
    let start =
        State { position: place, spin: Vector3::z() * rate, ..on_plane(0.0, Vector3::zeros()) };
    let mut simulation = simulate(&world, [start]);
    let radius = downhill / (2.0 * rate * rate);
    for part in 1..=8_u32 {
        run(&mut simulation, (std::f64::consts::PI / rate / h / 8.0) as usize);
        let time = h * simulation.index() as f64;
        let turned = rate * time;
        // Friction along the edge.
        let allowed = 0.5 * FRICTION * 0.001 * G * time * time + 1e-6;
        let expected = [turned.sin().powi(2), turned - 0.5 * (2.0 * turned).sin()];
        let position = simulation.state().position;
        let missed = [0, 1].map(|k| position[k] - radius * expected[k]);
        assert!(missed.iter().all(|part| part.abs() < allowed), "{part}: {missed:?}");
    }
}

/// Two bodies with axes that may touch are refused by name, unless their contact is excluded.
#[test]
fn two_axes_that_may_touch_are_refused() {
    let body = || RigidBody::solid_box(1.0, Vector3::repeat(0.1)).unwrap();
    let world = world(vec![body(), body()], Vector3::z(), 0.001);
    let world = world.with_friction_axis(Partner::Body(0), Vector3::x(), 0.1).unwrap();
    let world = world.with_friction_axis(Partner::Body(1), Vector3::y(), 0.1).unwrap();
    let at =
        |x: f64| State { position: Vector3::new(x, 0.0, 0.1), ..on_plane(0.0, Vector3::zeros()) };
    let starts = [at(0.0), at(1.0)];
    let between = (Partner::Body(0), Partner::Body(1));
    assert_eq!(world.check_start(&starts), Err(Error::FrictionAxes { between }));
    assert_eq!(world.with_apart(0, Partner::Body(1)).unwrap().check_start(&starts), Ok(()));
}

/// Wrong axes are refused.
#[test]
fn wrong_axes_are_refused() {
    let world = || block(0.0, 0.001, Integrator::Euler);
    let wrong = |of, axis, factor| world().with_friction_axis(of, axis, factor).is_err();
    assert!(wrong(Partner::Body(0), Vector3::zeros(), 0.5));
    assert!(wrong(Partner::Body(0), Vector3::repeat(f64::NAN), 0.5));
    assert!(
        wrong(Partner::Body(0), Vector3::x(), 0.0)
            && wrong(Partner::Body(0), Vector3::x(), f64::NAN)
    );
    assert!(
        wrong(Partner::Body(1), Vector3::x(), 0.5) && wrong(Partner::Fixed(0), Vector3::x(), 0.5)
    );
}

/// A block on a block moves alike, whichever of them comes first.
#[test]
fn the_order_of_the_bodies_plays_no_part() {
    let bodies = [
        RigidBody::solid_box(3.0, Vector3::new(0.4, 0.4, 0.05)).unwrap(),
        RigidBody::solid_box(1.0, Vector3::new(0.1, 0.1, 0.02)).unwrap(),
    ];
    let below = State { position: Vector3::z() * 0.05, ..on_plane(0.0, Vector3::zeros()) };
    let above = State {
        position: Vector3::new(0.0, 0.0, 0.12),
        velocity: Vector3::new(0.5, 0.7, 0.0),
        spin: Vector3::z() * 3.0,
        ..below
    };
    let ends = [[0, 1], [1, 0]].map(|order| {
        let world = world(order.map(|of| bodies[of].clone()).to_vec(), Vector3::z(), 0.002);
        let of = Partner::Body(order[1]);
        let world = world.with_friction_axis(of, Vector3::new(1.0, 1.0, 0.0), FACTOR).unwrap();
        let mut simulation = simulate(&world, order.map(|of| [below, above][of]));
        run(&mut simulation, 150);
        order.map(|of| simulation.states()[of])
    });
    for (one, other) in ends[0].iter().zip(&ends[1]) {
        assert!((one.to_vector() - other.to_vector()).amax() < 1e-9, "{one:?} {other:?}");
    }
}

/// Random numbers from −0.5 to 0.5.
struct Draws(u64);

impl Draws {
    fn next(&mut self) -> f64 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as f64 / f64::from(u32::MAX >> 1) - 0.5
    }

    fn vector(&mut self) -> Vector3<f64> {
        Vector3::from_fn(|_, _| self.next())
    }
}

/// World of four random balls, boxes and capsules with an axis, its owner and factor, and the starts. In a quarter of
/// all scenes the axis is in the frame of another body on a spring.
struct RandomScene {
    world: World,
    owner: Partner,
    frame: Option<usize>,
    axis: Vector3<f64>,
    factor: f64,
    starts: Vec<State>,
}

impl RandomScene {
    fn new(number: usize, draws: &mut Draws) -> Self {
        let bodies: Vec<_> = (0..4)
            .map(|body| {
                let size = 0.08 * (1.0 + draws.next());
                let piece = match (number + 2 * body) % 3 {
                    0 => Piece::sphere(size),
                    1 => Piece::cuboid(Vector3::new(size, 0.6 * size, 0.4 * size)),
                    _ => Piece::capsule(size, 0.4 * size),
                };
                RigidBody::solid(1.5 + draws.next(), &[piece.unwrap()]).unwrap().0
            })
            .collect();
        let parameters = Parameters {
            bodies,
            ground: Some(Plane::new(Vector3::z(), 0.0).unwrap()),
            gravity: Vector3::new(2.0 * draws.next(), 2.0 * draws.next(), -G),
            friction: 0.6 + draws.next(),
            time_step: 0.002,
            rotation: Rotation::Momentum,
        };
        let factor = 10.0_f64.powf(2.0 * draws.next() - 0.5 * (number % 4) as f64);
        let axis = draws.vector().normalize();
        let owner =
            if number.is_multiple_of(2) { Partner::Ground } else { Partner::Body(number % 4) };
        let world = World::new(parameters).unwrap();
        let frame = (number % 4 == 1).then_some((number + 1) % 4);
        let world = match frame {
            Some(body) => {
                let spring = Axis::Free(Drive { stiffness: 5.0, damping: 0.1, ..Drive::NONE });
                let at = JointFrame::at(Vector3::zeros());
                let joint = Joint::between(number % 4, Some(body), [at; 2]).colliding();
                let joint = joint.with_axes([spring; 3], [Axis::Free(Drive::NONE); 3]);
                let world = world.with_joints(vec![joint]).unwrap();
                world.with_friction_axis_in(owner, body, axis, factor)
            }
            None => world.with_friction_axis(owner, axis, factor),
        };
        let world = world.unwrap();
        let starts = (0..4)
            .map(|body| State {
                position: draws.vector().component_mul(&Vector3::new(0.1, 0.1, 0.0))
                    + Vector3::z() * (0.2 + 0.35 * f64::from(body)),
                attitude: Vector4::new(
                    1.0 + draws.next(),
                    draws.next(),
                    draws.next(),
                    draws.next(),
                )
                .normalize(),
                velocity: draws.vector(),
                spin: draws.vector() * 10.0,
            })
            .collect();
        Self { world, owner, frame, axis, factor, starts }
    }

    /// T of a contact, by its definition.
    fn tensor(&self, contact: &Contact, states: &[State]) -> Matrix3<f64> {
        let n = contact.normal();
        if self.owner != contact.key.partner && self.owner != Partner::Body(contact.key.body) {
            return Matrix3::identity();
        }
        let axis = match self.frame.or(self.owner.body()) {
            Some(body) => rotation(&states[body].attitude) * self.axis,
            None => self.axis,
        };
        let across = axis - n * n.dot(&axis);
        Matrix3::identity() - across * across.transpose() * (1.0 - self.factor)
    }
}

/// Random scenes: forces obey the law, computed by hand from the states, and at least 99.99 % of 10⁵ steps are
/// solved.
#[test]
#[ignore = "slow"]
fn random_steps_obey_the_law() {
    let (mut steps, mut failed, mut slides, mut holds) = (0, 0, 0, 0);
    let mut draws = Draws(5);
    for number in 0..400 {
        let scene = RandomScene::new(number, &mut draws);
        let mut simulation = simulate(&scene.world, scene.starts.clone());
        let mut record = StepRecord::new();
        for _ in 0..250 {
            simulation.step(&mut record).unwrap();
            let status = record.status();
            steps += 1;
            failed += usize::from(!status.is_solved());
            if !status.is_solved() || status == StepStatus::Substepped {
                continue;
            }
            for (contact, force) in
                record.first().contacts.iter().zip(&record.first().solution.contacts)
            {
                let n = contact.normal();
                let tensor = scene.tensor(contact, record.states());
                let pressed = n.dot(&force.force);
                let scaled = tensor.try_inverse().unwrap() * (force.force - n * pressed);
                let slip = tensor * force.slip;
                let limit = contact.law.friction * pressed;
                assert!(scaled.norm() <= limit + 1e-7 * (1.0 + limit), "{number} {scaled} {limit}");
                if slip.norm() > 1e-5 && pressed > 1e-3 {
                    let missed = (scaled + slip.normalize() * limit).norm();
                    assert!(missed < 2e-4 * (1.0 + limit), "{number} {missed} {limit}");
                    slides += 1;
                } else if pressed > 1e-3 {
                    holds += 1;
                }
            }
        }
    }
    println!("{steps} steps, {failed} failed, {slides} slides, {holds} holds");
    assert!(failed * 10_000 <= steps && slides > 10_000 && holds > 1000, "{failed} of {steps}");
}

/// All laws at once: axes, rolling, torsional and static friction and restitution. At least 99.99 % of 10⁵
/// steps are solved, at any of both integrators.
#[test]
#[ignore = "slow"]
fn random_steps_with_all_laws_are_solved() {
    let (mut steps, mut failed) = (0, 0);
    let mut draws = Draws(9);
    for number in 0..400 {
        let RandomScene { world, starts, .. } = RandomScene::new(number, &mut draws);
        let friction = world.friction();
        let world = world
            .with_coefficient(Coefficient::StaticFriction, friction * (1.5 + draws.next()))
            .and_then(|world| {
                world.with_coefficient(Coefficient::RollingFriction, 0.01 * (0.5 + draws.next()))
            })
            .and_then(|world| {
                world.with_coefficient(Coefficient::TorsionalFriction, 0.02 * (0.5 + draws.next()))
            })
            .and_then(|world| {
                world.with_coefficient(Coefficient::Restitution, (0.8 * draws.next()).max(0.0))
            })
            .unwrap()
            .with_integrator(Integrator::ALL[number / 2 % 2]);
        let mut simulation = simulate(&world, starts);
        let mut record = StepRecord::new();
        for step in 0..250 {
            simulation.step(&mut record).unwrap();
            steps += 1;
            if !record.status().is_solved() {
                println!("{number}, {step}: {:?} {:?}", record.report(), record.certificate());
                failed += 1;
            }
        }
    }
    println!("{steps} steps, {failed} failed");
    assert!(failed * 10_000 <= steps, "{failed} of {steps}");
}

/// World of a vehicle of 5 kg on four mecanum wheels with a radius of 5 cm at the given spins (rad/s), with its
/// start. The rollers of wheel i run freely along (1, −σᵢ), σ = (−1, 1, 1, −1), in the frame of the chassis.
fn mecanum(spins: [f64; 4]) -> (World, Vec<State>) {
    const RADIUS: f64 = 0.05;
    let chassis = RigidBody::solid_box(4.0, Vector3::new(0.2, 0.15, 0.02)).unwrap();
    let wheel = RigidBody::solid(0.25, &[Piece::sphere(RADIUS).unwrap()]).unwrap().0;
    let mut bodies = vec![chassis];
    bodies.extend(std::iter::repeat_n(wheel, 4));
    let places = [(0.2, 0.15), (0.2, -0.15), (-0.2, 0.15), (-0.2, -0.15)];
    let axle = |anchor| JointFrame::along(anchor, Vector3::y()).unwrap();
    let joint = |(wheel, (x, y)): (usize, (f64, f64))| {
        let motor = Motor::Speed { target: spins[wheel], max_force: 10.0 };
        let drive = Drive { motor: Some(motor), ..Drive::NONE };
        let frames = [axle(Vector3::zeros()), axle(Vector3::new(x, y, 0.0))];
        Joint::revolute(1 + wheel, Some(0), frames, drive)
    };
    let joints = places.into_iter().enumerate().map(joint).collect();
    let mut world = world(bodies, Vector3::z(), 1e-3).with_joints(joints).unwrap();
    let mut states = vec![State::at_rest(Vector3::z() * RADIUS)];
    for (wheel, sign) in [-1.0, 1.0, 1.0, -1.0].into_iter().enumerate() {
        let (x, y) = places[wheel];
        states.push(State::at_rest(Vector3::new(x, y, RADIUS)));
        let runs = Vector3::new(1.0, -sign, 0.0);
        world = world.with_friction_axis_in(Partner::Body(1 + wheel), 0, runs, 0.001).unwrap();
        for other in 0..wheel {
            world = world.with_apart(1 + wheel, Partner::Body(1 + other)).unwrap();
        }
    }
    (world, states)
}

/// A vehicle on mecanum wheels drives forwards, sideways, turns on the spot and along a circle by its wheels' spins alone.
/// A wheel that does not slip along the axes of its rollers, (1, σ), satisfies (v_x − Ω y − R s) + σ (v_y + Ω x) = 0.
#[test]
fn mecanum_wheels_drive_in_any_direction() {
    let places = [(0.2, 0.15), (0.2, -0.15), (-0.2, 0.15), (-0.2, -0.15)];
    let sign = [-1.0, 1.0, 1.0, -1.0];
    for motion in [[0.3, 0.0, 0.0], [0.0, 0.3, 0.0], [0.0, 0.0, 0.5], [0.1, 0.2, 0.4]] {
        let [ahead, aside, turning] = motion;
        let spin = |wheel: usize| {
            let (x, y) = places[wheel];
            (ahead - turning * y + sign[wheel] * (aside + turning * x)) / 0.05
        };
        for integrator in [Integrator::Euler, Integrator::Leapfrog] {
            let (world, states) = mecanum(std::array::from_fn(spin));
            let mut simulation = simulate(&world.with_integrator(integrator), states);
            run(&mut simulation, 1000);
            let State { velocity, spin, attitude, .. } = simulation.states()[0];
            let velocity = rotation(&attitude).tr_mul(&velocity);
            let missed = [velocity[0] - ahead, velocity[1] - aside, spin[2] - turning];
            println!("{motion:?} {integrator:?} {missed:?}");
            assert!(missed.iter().all(|missed| missed.abs() < 2e-3), "{motion:?}: {missed:?}");
        }
    }
}

/// Checks that an axis needs joints to its body, and goes with the body.
#[test]
fn axes_belong_to_bodies_of_the_same_mechanism() {
    let bodies = vec![RigidBody::solid_box(1.0, Vector3::repeat(0.1)).unwrap(); 2];
    let world = world(bodies, Vector3::z(), 1e-3);
    let world = world.with_friction_axis_in(Partner::Body(0), 1, Vector3::x(), 0.1).unwrap();
    let starts = [0.0, 1.0].map(|x| State::at_rest(Vector3::new(x, 0.0, 0.1)));
    assert_eq!(
        world.check_start(&starts),
        Err(Error::LooseFrictionAxis { owner: Partner::Body(0) })
    );
    assert!(world.with_friction_axis_in(Partner::Body(0), 2, Vector3::x(), 0.1).is_err());
}
