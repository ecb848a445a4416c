//! Adhesion against closed forms and a computation of its law by hand.

use crate::common::draw::Draw;
use crate::common::prelude::*;
use rand_mt::Mt;
use tumble_core::problem::{ContactProblem, SolveOptions};
use tumble_core::world::Impacts;

const G: f64 = 9.81;
const MASS: f64 = 2.0;
const HALF: f64 = 0.1;
const THICK: f64 = 0.02;
const BOTH: [Integrator; 2] = [Integrator::Euler, Integrator::Leapfrog];

/// A thin prism with `corners` corners at each end, in the circle of [`HALF`]; a ball for one.
fn cup(corners: usize) -> Piece {
    if corners == 1 {
        return Piece::sphere(HALF).unwrap();
    }
    let corner = |k: usize| {
        let angle = std::f64::consts::TAU * (k % corners) as f64 / corners as f64;
        let z = if k < corners { THICK } else { -THICK };
        Vector3::new(HALF * angle.cos(), HALF * angle.sin(), z)
    };
    Piece::hull(&(0..2 * corners).map(corner).collect::<Vec<_>>(), 0.0).unwrap()
}

/// One cup of 2 kg on a plane through the origin with this `normal`. F is that of the pair.
fn on_plane(corners: usize, normal: Vector3<f64>, pull: f64) -> World {
    let parameters = Parameters {
        ground: Some(Plane::new(normal, 0.0).unwrap()),
        ..Parameters::new(vec![RigidBody::solid(MASS, &[cup(corners)]).unwrap().0])
    };
    let world = World::new(parameters).unwrap();
    world.with_coefficient_between(Coefficient::Adhesion, 0, Partner::Ground, pull).unwrap()
}

/// State of a cup with the axis `normal` that touches the plane through the origin.
fn touching(corners: usize, normal: Vector3<f64>) -> State {
    let turn = UnitQuaternion::rotation_between(&Vector3::z(), &normal)
        .unwrap_or(UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI));
    let attitude = Vector4::new(turn.w, turn.i, turn.j, turn.k);
    let away = if corners == 1 { HALF } else { THICK };
    State { attitude, ..State::at_rest(normal * away) }
}

/// Takes `count` solved steps.
fn run(simulation: &mut Simulation<'_>, count: usize) -> StepRecord {
    last_step(simulation, count, |record| is_solved(record) && record.residual() < 1e-10)
}

/// A cup holds a mass from above if and only if F ≥ m g, whatever the number of its points. The force of the
/// contacts is the weight, and each presses with its share beyond.
#[test]
fn a_cup_holds_its_weight() {
    for (corners, integrator) in [1, 3, 4, 8].into_iter().flat_map(|n| BOTH.map(|of| (n, of))) {
        for (share, holds) in [(0.999, false), (1.001, true)] {
            let pull = share * MASS * G;
            let world = on_plane(corners, -Vector3::z(), pull).with_integrator(integrator);
            let start = touching(corners, -Vector3::z());
            let mut simulation = simulate(&world, &[start]);
            let record = run(&mut simulation, 200);
            let fallen = start.position[2] - simulation.state().position[2];
            if !holds {
                // At most a few steps pass until the gap is above a millionth of the cup.
                assert!((fallen - 0.5 * G * 0.16).abs() < 0.04, "{corners} {fallen}");
                continue;
            }
            assert!(fallen.abs() < 1e-12, "{corners} {fallen}");
            let solution = &record.first().solution;
            assert!((solution.total_force(0) - Vector3::z() * MASS * G).norm() < 1e-9);
            assert_eq!(solution.contacts.len(), corners);
            let pulls: f64 = solution.contacts.iter().map(|contact| contact.adhesion).sum();
            assert!(
                (pulls - pull).abs() < 1e-9
                    && solution
                        .contacts
                        .iter()
                        .all(|contact| { contact.carries_force() && contact.normal_force < 0.0 })
            );
        }
    }
}

/// A cup holds on a wall if and only if μ F ≥ m g.
#[test]
fn a_cup_holds_on_a_wall_by_friction() {
    for (corners, integrator) in [3, 4, 8].into_iter().flat_map(|n| BOTH.map(|of| (n, of))) {
        for (share, holds) in [(0.999, false), (1.001, true)] {
            let world = on_plane(corners, Vector3::x(), share * MASS * G / 0.5);
            let start = touching(corners, Vector3::x());
            let mut simulation = simulate(&world.with_integrator(integrator), &[start]);
            run(&mut simulation, 100);
            let State { position, velocity, .. } = simulation.state();
            let expected = if holds { 0.0 } else { -0.001 * G * 0.2 };
            assert!((velocity[2] - expected).abs() < 1e-4 * G * 0.2, "{corners} {velocity}");
            assert!((position[0] - THICK).abs() < 1e-12 && (!holds || velocity.norm() < 1e-12));
        }
    }
}

/// A sliding cup stops after v²/(2 a) with a = μ (g + F/m).
#[test]
fn a_cup_slides_with_the_friction_of_its_pull() {
    let (pull, h) = (30.0, 0.0005);
    for corners in [3, 8] {
        let world = on_plane(corners, Vector3::z(), pull);
        let parameters = Parameters { time_step: h, ..world.parameters().clone() };
        let world = World::new(parameters).unwrap();
        let world = world.with_coefficient(Coefficient::Adhesion, pull).unwrap();
        let start = State { velocity: Vector3::x(), ..touching(corners, Vector3::z()) };
        let mut simulation = simulate(&world, &[start]);
        let slowing = 0.5 * (G + pull / MASS);
        run(&mut simulation, (1.0 / slowing / h) as usize + 3);
        let State { position, velocity, .. } = simulation.state();
        assert!(
            (position[0] - 0.5 / slowing).abs() < 1e-6 && velocity.norm() < 1e-12,
            "{position}"
        );
    }
}

/// Under a load that grows, a cup comes off at F; its bond stays broken without a load, and pulls again when it
/// touches again. Its work while it comes off is F times the gap at most.
#[test]
fn a_bond_breaks_at_its_pull_and_stays_broken() {
    let pull = 12.0;
    for (corners, integrator) in [1, 4].into_iter().flat_map(|n| BOTH.map(|of| (n, of))) {
        let world = on_plane(corners, Vector3::z(), pull).with_integrator(integrator);
        let parameters = Parameters { gravity: Vector3::zeros(), ..world.parameters().clone() };
        let world = World::new(parameters).unwrap().with_integrator(integrator);
        let world = world.with_coefficient(Coefficient::Adhesion, pull).unwrap();
        let start = touching(corners, Vector3::z());
        let mut simulation = simulate(&world, &[start]);
        let mut record = StepRecord::new();
        let load = |step: usize| 0.05 * step as f64;
        let set = |simulation: &mut Simulation<'_>, force: f64| {
            let wrench = Wrench { force: Vector3::z() * force, torque: Vector3::zeros() };
            simulation.set_wrench(0, wrench).unwrap();
        };
        let mut broken = None;
        for step in 0..300 {
            set(&mut simulation, load(step));
            simulation.step(&mut record).unwrap();
            assert!(is_solved(&record) && record.residual() < 1e-10, "{:?}", record.report());
            let taken = record.first();
            let balance = taken.balance(&world);
            let gap = taken.solution.states[0].position[2] - start.position[2];
            if gap > 1e-9 {
                // The pull acts over the opening of the step in which it ends.
                assert!(balance.impacts <= 1e-12 && balance.impacts >= -pull * gap - 1e-12);
                broken.get_or_insert(step);
            }
            if broken.is_some_and(|broken| step > broken + 3) {
                break;
            }
        }
        let broken = broken.unwrap();
        assert!((load(broken) - pull).abs() < 0.11, "{corners} {}", load(broken));
        let mut velocity = simulation.state().velocity[2];
        assert!(velocity > 0.0);
        set(&mut simulation, 0.0);
        run(&mut simulation, 1);
        velocity = velocity.max(simulation.state().velocity[2]);
        run(&mut simulation, 50);
        assert!((simulation.state().velocity[2] - velocity).abs() < 1e-12);
        // Back to the plane, and then up with less than F.
        for force in [-20.0, 0.99 * pull] {
            set(&mut simulation, force);
            run(&mut simulation, 300);
            assert!((simulation.state().position - start.position).norm() < 1e-9, "{corners}");
            assert!(simulation.state().velocity.norm() < 1e-9);
        }
    }
}

/// A pull across a gap does not exist.
#[test]
fn a_gap_is_not_pulled_across() {
    for gap in [1e-8, 1e-5, 1e-3] {
        let world = on_plane(4, -Vector3::z(), 100.0);
        let mut start = touching(4, -Vector3::z());
        start.position[2] -= gap;
        let mut simulation = simulate(&world, &[start]);
        run(&mut simulation, 100);
        let fallen = start.position[2] - simulation.state().position[2];
        assert!((fallen - 0.5 * G * 0.04).abs() < 1e-9, "{fallen}");
    }
}

/// A foot tips over its edge if and only if the force P at the height H above the plane has P H > (F + m g) b.
#[test]
fn a_foot_tips_at_the_moment_of_its_pull() {
    let (half, pull) = (Vector3::new(0.1, 0.1, 0.3), 40.0);
    for (share, tips) in [(0.999, false), (1.001, true)] {
        let parameters = Parameters {
            friction: 2.0,
            ..Parameters::new(vec![RigidBody::solid_box(MASS, half).unwrap()])
        };
        let world = World::new(parameters).unwrap();
        let world = world.with_coefficient(Coefficient::Adhesion, pull).unwrap();
        let mut simulation = simulate(&world, &[State::at_rest(Vector3::z() * half[2])]);
        let force = Vector3::x() * (share * (pull + MASS * G) * half[0] / half[2]);
        simulation.set_wrench(0, Wrench { force, torque: Vector3::zeros() }).unwrap();
        run(&mut simulation, 150);
        let tilt = simulation.state().attitude.yz().norm();
        assert_eq!(tilt > 1e-6, tips, "{share} {tilt}");
        assert!(tips || tilt < 1e-12);
    }
}

/// A chain of bodies hangs by bonds with a plate. Each bond carries the weight below it, and the pairs of bodies
/// conserve their momentum.
#[test]
fn bodies_hang_from_each_other() {
    let body = || RigidBody::solid_box(1.0, Vector3::new(0.1, 0.1, 0.05)).unwrap();
    let plate = Piece::cuboid(Vector3::new(1.0, 1.0, 0.1)).unwrap();
    let plate = plate.moved_by(&Matrix3::identity(), &(Vector3::z() * 0.1)).unwrap();
    for (share, holds) in [(1.001, true), (0.999, false)] {
        let parameters =
            Parameters { ground: None, ..Parameters::new(vec![body(), body(), body()]) };
        let world = World::new(parameters).unwrap();
        let world = world.with_fixed(vec![plate.clone()]);
        let partners = [Partner::Fixed(0), Partner::Body(0), Partner::Body(1)];
        let world = partners.into_iter().enumerate().fold(world, |world, (of, partner)| {
            let pull = share * (3 - of) as f64 * G;
            world.with_coefficient_between(Coefficient::Adhesion, of, partner, pull).unwrap()
        });
        let starts = [0, 1, 2].map(|k| State::at_rest(Vector3::z() * -(0.05 + 0.1 * f64::from(k))));
        let mut simulation = simulate(&world, &starts);
        let record = run(&mut simulation, 100);
        let fallen = starts[2].position[2] - simulation.states()[2].position[2];
        assert_eq!(fallen < 1e-9, holds, "{fallen}");
        if holds {
            let on_plate =
                record.first().solution.total_force(0) + record.first().solution.total_force(1);
            assert!((on_plate - Vector3::z() * 2.0 * G).norm() < 1e-8, "{on_plate}");
        }
    }
}

/// The law of random steps of random bodies that stick to each other and to the ground, by hand: pressing
/// forces, gaps at the end, the cone, and one pull for a pair. Their contact problems have the same solution.
#[test]
fn random_bonds_obey_their_law() {
    let mut draw = Draw(Mt::new(5));
    let (mut held, mut broke, mut pulled, mut steps) = (0, 0, 0, 0);
    for number in 0..60 {
        let pull = [40.0, 15.0, 4.0][number % 3] * draw.within(0.5, 1.5);
        let (mut bodies, mut starts, mut height) = (Vec::new(), Vec::new(), 0.02);
        for _ in 0..3 {
            let half = Vector3::from_fn(|_, _| draw.within(0.04, 0.1));
            starts.push(State::at_rest(Vector3::z() * (height + half[2])));
            height += 2.0 * half[2] + 0.02;
            bodies.push(RigidBody::solid_box(draw.within(0.3, 1.0), half).unwrap());
        }
        let parameters = Parameters { friction: draw.within(0.0, 1.0), ..Parameters::new(bodies) };
        let integrator = BOTH[number % 2];
        let world = World::new(parameters).unwrap().with_integrator(integrator);
        let world = world.with_coefficient(Coefficient::Adhesion, pull).unwrap();
        let world = world.with_coefficient(Coefficient::RollingFriction, 0.001).unwrap();
        let mut simulation = simulate(&world, &starts);
        let mut record = StepRecord::new();
        for step in 0..300 {
            if step % 25 == 0 {
                let force = draw.vector(1.0) * 4.0 * pull;
                simulation
                    .set_wrench(step / 25 % 3, Wrench { force, torque: draw.vector(0.2) })
                    .unwrap();
            } else if step % 25 == 10 {
                (0..3).for_each(|body| simulation.set_wrench(body, Wrench::zero()).unwrap());
            }
            simulation.step(&mut record).unwrap();
            assert!(record.status() != StepStatus::Failed, "{number} {step}");
            steps += 1;
            for taken in record.intervals() {
                let world = taken.world(&world);
                let mut pulls = std::collections::BTreeMap::<_, Vec<f64>>::new();
                let kick = |of: &Contact| taken.kick(of.key.body, of.key.partner.body());
                for (contact, force) in taken.contacts.iter().zip(&taken.solution.contacts) {
                    let n = contact.normal();
                    let pressing = force.force + n * force.adhesion;
                    let gap = contact.gap_in(&taken.solution.states);
                    let across = pressing - n * n.dot(&pressing);
                    let normal = n.dot(&pressing);
                    // Impulses are exact to 2e-10 N s, and gaps to 1e-9 m.
                    let exact = 1e-7 * 0.002 / taken.length;
                    if record.status() != StepStatus::Wild {
                        assert!(normal >= -exact && gap >= -1e-9, "{normal} {gap}");
                        assert!(normal * gap < exact, "{normal} {gap}");
                        assert!(across.norm() <= contact.law.friction * normal + exact);
                    }
                    held += usize::from(force.adhesion > 0.0 && normal > 1e-6);
                    pulled += usize::from(force.normal_force < -1e-6);
                    broke += usize::from(force.adhesion > 0.0 && gap > 1e-7);
                    let touches = contact.gap + contact.held_gap <= 1e-7;
                    assert!(touches || force.adhesion == 0.0 || contact.gap < 1e-6);
                    let of = contact.key.partner.body().map(|of| of.min(contact.key.body));
                    let pair = (
                        of,
                        of.map_or(contact.key.body, |_| {
                            contact.key.body.max(contact.key.partner.body().unwrap())
                        }),
                    );
                    if force.adhesion > 0.0 {
                        pulls.entry(pair).or_default().push(force.adhesion / kick(contact));
                    }
                }
                for shares in pulls.values() {
                    let sum: f64 = shares.iter().sum();
                    assert!((sum - pull).abs() < 1e-9 * pull, "{shares:?} {pull}");
                }
                if step % 10 == 0 && taken.report.status == StepStatus::Converged {
                    let (problem, impulses) = ContactProblem::from_interval(&world, taken).unwrap();
                    assert!(problem.evaluate(&impulses).residual < 1e-9);
                    let found = problem.solve(&SolveOptions::default()).unwrap();
                    assert!(found.is_solved(), "{number} {step} {}", found.residual);
                }
            }
        }
    }
    println!("{steps} steps: {held} held, {pulled} pulled, {broke} broke");
    assert!(held > 10_000 && broke > 100 && pulled > 1000, "{held} {pulled} {broke}");
}

/// With located impacts or an accuracy a cup flies at the plane, stays on it against a load, and is pulled off. The
/// interval in which the bond breaks counts as less accurate.
#[test]
fn bonds_of_divided_steps() {
    for accuracy in [None, Some(1e-5)] {
        let pull = 30.0;
        let world = on_plane(4, -Vector3::z(), pull).with_impacts(Impacts::Located);
        let world = world.with_accuracy(accuracy).unwrap();
        let mut start = touching(4, -Vector3::z());
        start.position[2] -= 0.1;
        start.velocity[2] = 2.0;
        let mut simulation = simulate(&world, &[start]);
        let record = run(&mut simulation, 200);
        assert!((simulation.state().position[2] + THICK).abs() < 1e-6, "{:?}", simulation.state());
        assert!(simulation.state().velocity.norm() < 1e-9);
        let taken = record.intervals().last().unwrap();
        let pulls: f64 = taken.solution.contacts.iter().map(|of| of.adhesion).sum();
        assert!((pulls / taken.kick(0, None) - pull).abs() < 1e-9, "{pulls}");
        let force = Vector3::z() * (MASS * G - 1.5 * pull);
        simulation.set_wrench(0, Wrench { force, torque: Vector3::zeros() }).unwrap();
        let taken =
            steps(&mut simulation, 100, |record| is_solved(record) && record.residual() < 1e-10);
        let coarse = taken.iter().flat_map(StepRecord::intervals).filter(|of| of.is_coarse).count();
        assert!((1..30).contains(&coarse), "{coarse}");
        // From the second step on it falls freely under the load.
        let fallen = -THICK - simulation.state().position[2];
        let expected = 0.5 * 1.5 * pull / MASS * 0.04;
        assert!((fallen / expected - 1.0).abs() < 0.02, "{fallen} {expected}");
    }
}

/// A simulation that is saved while bonds hold goes on with the same bits.
#[test]
fn bonds_are_saved() {
    let world = on_plane(4, Vector3::x(), 60.0);
    let mut simulation = simulate(&world, &[touching(4, Vector3::x())]);
    run(&mut simulation, 20);
    let force = Vector3::x() * 61.0;
    simulation.set_wrench(0, Wrench { force, torque: Vector3::zeros() }).unwrap();
    let saved = simulation.save();
    let mut ends = Vec::new();
    for _ in 0..2 {
        simulation.restore(&saved).unwrap();
        let record = run(&mut simulation, 30);
        ends.push((simulation.states().to_vec(), record.first().solution.clone()));
    }
    assert_eq!(ends[0], ends[1]);
    assert!(simulation.state().position[0] > THICK + 1e-4);
}

#[test]
fn wrong_pulls_are_refused() {
    let world = || on_plane(4, Vector3::z(), 1.0);
    for wrong in [-1.0, f64::NAN, 1e10] {
        assert!(world().with_coefficient(Coefficient::Adhesion, wrong).is_err(), "{wrong}");
        assert!(
            world().with_coefficient_of(Coefficient::Adhesion, Partner::Body(0), wrong).is_err()
        );
    }
}
