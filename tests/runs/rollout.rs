//! Batches of rollouts: the numbers of a loop over simulations, on any number of threads.

use crate::toss::*;
use allocation_counter::measure;
use nalgebra::{Matrix3, Vector3, Vector4};
use std::num::NonZeroUsize;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use tumble::error::Error;
use tumble::geometry::Piece;
use tumble::mechanics::{RigidBody, State, Wrench};
use tumble::rollout::{
    Batch, Constant, Outputs, Report, RolloutError, Tally, Varied, Watch, roll_out,
};
use tumble::simulation::{Motion, Simulation, StepRecord};
use tumble::step::{Step, StepReport, StepSolution, StepSolver, StepStatus};
use tumble::world::{Parameters, Partner, Plane, World};

const T: usize = 150;

fn native_motion(world: &World) -> Result<Motion<'static>, Error> {
    Ok(Motion::native(world))
}

fn batch<'a>(world: &'a World, starts: &'a [f64], rollouts: usize) -> Batch<'a> {
    Batch {
        world,
        motion: &native_motion,
        loads: &[],
        courses: &[],
        index: 0,
        rollouts,
        steps: T,
        starts,
        controls: &[],
        motors: &[],
        joint_forces: &[],
        parameters: &[],
    }
}

fn numbers<'a>(states: impl IntoIterator<Item = &'a State>) -> Vec<f64> {
    states.into_iter().flat_map(|state| state.to_vector().as_slice().to_vec()).collect()
}

/// What comes out of a batch.
#[derive(Debug, Clone, PartialEq)]
struct Out {
    states: Vec<f64>,
    forces: Vec<f64>,
    residuals: Vec<f64>,
    statuses: Vec<u8>,
    report: Report,
}

fn run(batch: &Batch<'_>, threads: usize) -> Result<Out, RolloutError> {
    let (rows, n) = (batch.rollouts * batch.steps, batch.world.bodies().len());
    let (mut states, mut forces) = (vec![0.0; rows * n * 13], vec![0.0; rows * n * 3]);
    let mut ends = vec![0.0; batch.rollouts * n * 13];
    let (mut residuals, mut statuses) = (vec![0.0; rows], vec![0; rows]);
    let outputs = Outputs {
        states: &mut states,
        ends: &mut ends,
        forces: &mut forces,
        residuals: &mut residuals,
        statuses: &mut statuses,
    };
    let threads = NonZeroUsize::new(threads).unwrap();
    let report = roll_out(batch, outputs, threads, Watch::default())?;
    let last = states.chunks(batch.steps * n * 13).flat_map(|run| &run[run.len() - n * 13..]);
    assert!(ends.iter().eq(last));
    Ok(Out { states, forces, residuals, statuses, report })
}

/// The same by hand: a simulation after the other.
fn looped(simulations: Vec<Simulation<'static>>, push: impl Fn(usize, usize) -> Wrench) -> Out {
    let mut out = Out {
        states: Vec::new(),
        forces: Vec::new(),
        residuals: Vec::new(),
        statuses: Vec::new(),
        report: Report::default(),
    };
    let mut record = StepRecord::new();
    for (rollout, mut simulation) in simulations.into_iter().enumerate() {
        let mut tally = Tally::default();
        for step in 0..T {
            simulation.set_wrench(0, push(rollout, step)).unwrap();
            simulation.step(&mut record).unwrap();
            out.states.extend(numbers(simulation.states()));
            for body in 0..simulation.states().len() {
                out.forces.extend(&record.solution.total_force(body));
            }
            let residual = record.certificate.residual();
            out.residuals.push(residual);
            let status = record.report.status;
            let place = StepStatus::ALL.iter().position(|known| *known == status).unwrap();
            out.statuses.push(place as u8);
            for tally in [&mut tally, &mut out.report.all] {
                tally.statuses[place] += 1;
                tally.tempered += u64::from(record.restitution_share < 1.0);
                tally.largest_residual = tally.largest_residual.max(residual);
            }
        }
        out.report.each.push(tally);
    }
    out
}

/// Thrown cubes near the ground, each with friction, mass, gravity and time step of its own and
/// pushed around.
#[test]
fn a_batch_has_the_numbers_of_a_loop_on_any_number_of_threads() {
    const B: usize = 9;
    let world = cube_world(SOLID);
    let start = |seed: usize| State {
        position: Vector3::new(0.0, 0.0, 1.8),
        velocity: Vector3::new(1.0, 0.0, -3.0),
        ..thrown(seed as u32)
    };
    let starts: Vec<_> = (0..B).map(start).collect();
    let push = |rollout: usize, step: usize| Wrench {
        force: Vector3::new(rollout as f64, -(step as f64), 0.5),
        torque: Vector3::new(0.0, 3.0, rollout as f64),
    };
    let both = (0..B).flat_map(|b| (0..T).map(move |t| push(b, t)));
    let controls: Vec<f64> =
        both.flat_map(|w| w.force.iter().chain(&w.torque).copied().collect::<Vec<_>>()).collect();
    let friction: Vec<f64> = (0..B).map(|b| 0.1 * b as f64).collect();
    let mass: Vec<f64> = (0..B).map(|b| 8.0 + b as f64).collect();
    let restitution: Vec<f64> = (0..B).map(|b| 0.05 * b as f64).collect();
    let gravity: Vec<f64> = (0..B).flat_map(|b| [0.1 * b as f64, 0.0, -9.0]).collect();
    let time_step: Vec<f64> = (0..B).map(|b| 0.001 * (b + 1) as f64).collect();
    let parameters = [
        Varied { constant: Constant::Friction, values: &friction },
        Varied { constant: Constant::Restitution, values: &restitution },
        Varied { constant: Constant::Mass, values: &mass },
        Varied { constant: Constant::Gravity, values: &gravity },
        Varied { constant: Constant::TimeStep, values: &time_step },
    ];
    let start_numbers = numbers(&starts);
    let batch =
        Batch { controls: &controls, parameters: &parameters, ..batch(&world, &start_numbers, B) };
    let simulations = starts.iter().enumerate().map(|(b, start)| {
        let body = cube(Matrix3::from_diagonal_element(SOLID) * (mass[b] / 10.0));
        let body = RigidBody::of_pieces(mass[b], *body.inertia(), body.pieces().to_vec()).unwrap();
        let world = World::new(Parameters {
            bodies: vec![body],
            friction: friction[b],
            gravity: Vector3::from_column_slice(&gravity[3 * b..][..3]),
            time_step: time_step[b],
            ..world.parameters().clone()
        });
        native(&world.unwrap().with_restitution(restitution[b]).unwrap(), *start)
    });
    let expected = looped(simulations.collect(), push);
    let in_contact = expected.statuses.iter().filter(|status| **status == 1).count();
    assert!(in_contact > 200, "{in_contact} steps in contact");
    for threads in [1, 2, 3, 20] {
        assert_eq!(run(&batch, threads).unwrap(), expected, "{threads} threads");
    }
}

/// Two boxes, one on the other, with one start and one push for all.
#[test]
fn several_bodies_share_starts_and_controls() {
    let body = |half: f64| RigidBody::solid_box(1.0, Vector3::repeat(half)).unwrap();
    let world =
        World::new(Parameters { bodies: vec![body(0.5), body(0.3)], ..parameters(body(1.0)) });
    let world = world.unwrap();
    let at = |z: f64| State {
        position: Vector3::new(0.0, 0.0, z),
        attitude: Vector4::new(1.0, 0.0, 0.0, 0.0),
        velocity: Vector3::zeros(),
        spin: Vector3::zeros(),
    };
    let starts = [at(0.5), at(1.3)];
    let push = Wrench { force: Vector3::new(20.0, 0.0, 0.0), torque: Vector3::zeros() };
    let controls: Vec<f64> =
        (0..T).flat_map(|_| [[20.0, 0.0, 0.0, 0.0, 0.0, 0.0], [0.0; 6]]).flatten().collect();
    let start_numbers = numbers(&starts);
    let batch = Batch { controls: &controls, ..batch(&world, &start_numbers, 3) };
    let simulation = || Simulation::new(world.clone(), starts, Motion::native(&world)).unwrap();
    let expected = looped((0..3).map(|_| simulation()).collect(), |_, _| push);
    assert_eq!(run(&batch, 2).unwrap(), expected);
    // The lower one is pulled away under the upper one, which friction takes along.
    let last = &expected.states[(T - 1) * 26..][..26];
    assert!(last[0] > last[13] && last[13] > 0.01, "{last:?}");
}

/// A solver that leaves free flight as it is, also into the ground.
struct Lazy;

impl StepSolver for Lazy {
    fn accepted_residual(&self) -> f64 {
        1e-9
    }

    fn solve(
        &mut self,
        step: &Step<'_>,
        candidates: &mut tumble::contact::Candidates,
        solution: &mut StepSolution,
    ) -> Result<StepReport, Error> {
        solution.set_free(step.free);
        let none =
            |contact: &tumble::contact::Contact| tumble::step::ContactForce::none(contact.key);
        solution.contacts.extend(candidates.contacts().iter().map(none));
        Ok(StepReport::without_problem(StepStatus::Converged))
    }
}

#[test]
fn steps_that_fail_are_listed_by_rollout_and_step() {
    let world = cube_world(SOLID);
    let start = |height: f64| State {
        position: Vector3::new(0.0, 0.0, height),
        attitude: Vector4::new(1.0, 0.0, 0.0, 0.0),
        velocity: Vector3::zeros(),
        spin: Vector3::zeros(),
    };
    let starts = numbers(&[start(9.0), start(1.0), start(9.0), start(1.0)]);
    let lazy = |_: &World| Ok(Motion::contact(Lazy));
    let batch = Batch { motion: &lazy, steps: 2, ..batch(&world, &starts, 4) };
    for threads in [1, 4] {
        let report = run(&batch, threads).unwrap().report;
        let found: Vec<_> = report.unsolved.iter().map(|u| (u.rollout, u.step, u.status)).collect();
        let failed = StepStatus::Failed;
        assert_eq!(found, [(1, 0, failed), (1, 1, failed), (3, 0, failed), (3, 1, failed)]);
        // g h in the first step; in the second 2 g h, and the depth g h² of the first over h.
        let residual = |index: usize| report.unsolved[index].residual / (9.81 * 0.002);
        assert!((residual(0) - 1.0).abs() < 1e-9 && (residual(1) - 3.0).abs() < 1e-9, "{report:?}");
        assert_eq!((report.steps(), report.all.largest_residual), (8, report.unsolved[1].residual));
    }
}

#[test]
fn arrays_of_other_lengths_and_odd_rollouts_are_refused_by_name() {
    let world = cube_world(SOLID);
    let start = numbers(&[thrown(0)]);
    let good = batch(&world, &start, 5);
    let refused = |batch: &Batch<'_>| run(batch, 3).unwrap_err().to_string();
    assert!(
        refused(&Batch { starts: &start[1..], ..good }).starts_with("numbers in the starts: 12")
    );
    assert!(refused(&Batch { controls: &start, ..good }).contains("(B or 1, T, N, 6)"));
    assert!(refused(&Batch { steps: 0, ..good }).starts_with("steps of a rollout: 0"));
    assert!(refused(&Batch { rollouts: 0, ..good }).starts_with("rollouts: 0"));
    let values = [0.1, 0.2, -0.3, 11.0, 0.5];
    let with = |values| [Varied { constant: Constant::Friction, values }];
    let parameters = with(&values[..4]);
    assert!(refused(&Batch { parameters: &parameters, ..good }).starts_with("friction: 4 given"));
    // The first of two, on any number of threads.
    let parameters = with(&values);
    let odd = Batch { parameters: &parameters, ..good };
    for threads in [1, 2, 5] {
        let error = run(&odd, threads).unwrap_err();
        assert_eq!(error.rollout, Some(2));
        let sentence = "rollout 2: coefficient of friction is -0.3; allowed is 0 to 10";
        assert_eq!(error.to_string(), sentence);
    }
    let mut states = [0.0; 12];
    let outputs = Outputs { states: &mut states, ..Outputs::default() };
    let error = roll_out(&good, outputs, NonZeroUsize::MIN, Watch::default()).unwrap_err();
    assert!(error.to_string().starts_with("numbers for states: 12 given"), "{error}");
}

/// What changes shapes and the ground: each rollout is the simulation of a world that has them.
#[test]
fn size_radius_and_ground_are_those_of_worlds_of_their_own() {
    let world = cube_world(SOLID);
    let start = State {
        position: Vector3::new(0.0, 0.0, 2.0),
        velocity: Vector3::new(1.0, 0.0, -5.0),
        ..thrown(3)
    };
    let (size, radius, ground) = ([1.0, 0.5, 0.8], [0.0, 0.05, 0.1], [0.0, 0.1, -0.2]);
    let parameters = [
        Varied { constant: Constant::Size, values: &size },
        Varied { constant: Constant::Radius, values: &radius },
        Varied { constant: Constant::Ground, values: &ground },
    ];
    let numbers = numbers(&[start]);
    let batch = Batch { parameters: &parameters, ..batch(&world, &numbers, 3) };
    let half = world.bodies()[0].contact_points().iter().map(|point| point.position.amax());
    let half = half.fold(0.0, f64::max);
    let simulations = (0..3).map(|b| {
        let inside = Vector3::repeat(size[b] * half - radius[b]);
        let core = Piece::cuboid(inside).unwrap();
        let piece = Piece::hull(core.core().vertices(), radius[b]).unwrap();
        let own = &world.bodies()[0];
        let body = RigidBody::of_pieces(own.mass(), *own.inertia(), vec![piece]).unwrap();
        let normal = *world.ground().unwrap().normal();
        let ground = Some(Plane::new(normal, ground[b]).unwrap());
        let parameters = world.parameters().clone();
        native(&World::new(Parameters { bodies: vec![body], ground, ..parameters }).unwrap(), start)
    });
    let expected = looped(simulations.collect(), |_, _| Wrench::zero());
    let found = run(&batch, 2).unwrap();
    assert_eq!(found.statuses, expected.statuses);
    // Corners come by another order of factors.
    for (found, expected) in found.states.iter().zip(&expected.states) {
        assert!((found - expected).abs() < 1e-9, "{found}, {expected}");
    }
}

/// A constant with the numbers that it has changes nothing; one that would say nothing is refused.
#[test]
fn constants_are_read_as_they_are_set() {
    let world = cube_world(SOLID);
    for constant in Constant::ALL {
        let own = constant.of(&world);
        assert_eq!(own.len(), constant.width(&world), "{constant:?}");
        assert_eq!(Constant::of_name(constant.name()), Some(constant));
        let set = world.with_constants(&[(constant, &own)]).unwrap();
        assert_eq!(constant.of(&set), own, "{constant:?}");
        let number = constant.one_number(&world);
        for (a, b) in constant.from_one_number(&world, number).iter().zip(&own) {
            assert!((a - b).abs() <= 1e-15 * b.abs(), "{constant:?}: {a}, {b}");
        }
    }
    let refused = |world: &World, constant: Constant| {
        world.with_constants(&[(constant, &[0.5])]).unwrap_err().to_string()
    };
    let paired = world.clone().with_friction_between(0, Partner::Ground, 0.7).unwrap();
    assert!(refused(&paired, Constant::Friction).starts_with("friction: pairs of the world"));
    assert!(paired.with_constants(&[(Constant::Restitution, &[0.5])]).is_ok());
    let paired = world.clone().with_restitution_between(0, Partner::Ground, 0.7).unwrap();
    assert!(refused(&paired, Constant::Restitution).starts_with("restitution: pairs"));
    let afloat = Parameters { ground: None, ..world.parameters().clone() };
    let afloat = World::new(afloat).unwrap();
    assert!(refused(&afloat, Constant::Ground).starts_with("ground: "));
    let wide = world.with_constants(&[(Constant::Radius, &[1.5])]).unwrap_err().to_string();
    assert!(wide.starts_with("radius (m) is 1.5"), "{wide}");
    let ball = RigidBody::solid(1.0, &[Piece::sphere(0.1).unwrap()]).unwrap().0;
    let ball = World::new(Parameters { bodies: vec![ball], ..world.parameters().clone() }).unwrap();
    assert!(refused(&ball, Constant::Size).starts_with("size and radius: a body"));
}

#[test]
fn a_batch_ends_when_its_flag_is_raised_and_counts_its_steps() {
    let world = cube_world(SOLID);
    let start = numbers(&[thrown(0)]);
    let (flag, done) = (Arc::new(AtomicBool::new(false)), AtomicU64::new(0));
    let watch = Watch { interrupt: Some(&flag), done: Some(&done) };
    let two = NonZeroUsize::new(2).unwrap();
    roll_out(&batch(&world, &start, 4), Outputs::default(), two, watch).unwrap();
    assert_eq!(done.load(Ordering::Relaxed), 4 * T as u64);
    let endless = Batch { steps: 1_000_000_000, ..batch(&world, &start, 4) };
    let error = std::thread::scope(|scope| {
        scope.spawn(|| {
            while done.load(Ordering::Relaxed) < 10_000 {
                std::thread::yield_now();
            }
            flag.store(true, Ordering::Relaxed);
        });
        roll_out(&endless, Outputs::default(), two, watch).unwrap_err()
    });
    assert_eq!(error, RolloutError { rollout: None, error: Error::Interrupted });
}

/// Steps allocate nothing: ten times as many take as much memory but for contacts that are new.
#[test]
fn steps_of_a_rollout_allocate_nothing() {
    let world = cube_world(SOLID);
    let start = numbers(&[thrown(42)]);
    let count = |steps: usize| {
        let batch = Batch { steps, ..batch(&world, &start, 1) };
        let mut states = vec![0.0; steps * 13];
        let outputs = Outputs { states: &mut states, ..Outputs::default() };
        measure(|| {
            roll_out(&batch, outputs, NonZeroUsize::MIN, Watch::default()).unwrap();
        })
        .count_total
    };
    let (few, many) = (count(1000), count(10_000));
    assert_eq!(few, many);
}

/// A pendulum with a motor, and a slide with a spring beside it.
fn driven_world() -> World {
    use tumble::joint::{Drive, Joint, JointFrame, Motor};
    let bodies = [1.0, 2.0].map(|mass| {
        let corners = [Vector3::new(0.1, 0.2, 0.3), Vector3::new(-0.1, -0.2, -0.3)];
        RigidBody::new(mass, Matrix3::identity() * 0.1 * mass, &corners).unwrap()
    });
    let frames = [0.0, 1.0].map(|x| {
        let axis = |at| JointFrame::along(at, Vector3::new(0.0, 1.0, 0.1)).unwrap();
        [axis(Vector3::new(0.0, 0.0, 0.3)), axis(Vector3::new(x, 0.0, 0.3))]
    });
    let motor = Motor::Position { target: 0.2, stiffness: 20.0, damping: 1.0, most: 30.0 };
    let hinge = Drive { friction: 0.01, motor: Some(motor), armature: 0.02, ..Drive::NONE };
    let slide = Drive { stiffness: 50.0, damping: 0.3, friction: 0.1, force: 0.5, ..Drive::NONE };
    let joints = vec![
        Joint::revolute(0, None, frames[0], hinge),
        Joint::cylindrical(1, None, frames[1], [slide, Drive::NONE]),
    ];
    let parameters = Parameters {
        bodies: bodies.into(),
        ground: None,
        ..cube_world(SOLID).parameters().clone()
    };
    World::new(parameters).unwrap().with_joints(joints).unwrap()
}

fn driven_starts() -> Vec<f64> {
    let state = |x: f64| State {
        position: Vector3::new(x, 0.0, 0.0),
        attitude: Vector4::new(1.0, 0.0, 0.0, 0.0),
        velocity: Vector3::zeros(),
        spin: Vector3::zeros(),
    };
    [0.0, 1.0].iter().flat_map(|x| state(*x).to_vector().as_slice().to_vec()).collect()
}

/// Constants of joints are read as they are set, in their shapes, and are those of the drives.
#[test]
fn constants_of_joints_are_those_of_their_drives() {
    use tumble::joint::{Axis, Drive, Gear, GearAxis, JointAxis, Motor};
    let world = driven_world();
    let mut joints = world.joints().to_vec();
    let slide = Drive {
        rest: 0.3,
        limits: Some([-0.5, 0.4]),
        ..*joints[1].drive(JointAxis::Linear(2)).unwrap()
    };
    joints[1] = joints[1].clone().with_drive(JointAxis::Linear(2), slide).unwrap();
    let axis = |joint, axis| GearAxis { joint, axis };
    let gear = Gear::new(axis(1, JointAxis::Linear(2)), axis(0, JointAxis::Angular(2)), 1.5, 0.2);
    let world = world.with_joints(joints).unwrap().with_gears(vec![gear]).unwrap();
    assert_eq!(world.limited_axes(), [(1, JointAxis::Linear(2))]);
    assert_eq!(
        world.driven_axes(),
        [(0, JointAxis::Angular(2)), (1, JointAxis::Linear(2)), (1, JointAxis::Angular(2))]
    );
    assert_eq!(world.motors(), [(0, JointAxis::Angular(2))]);
    for (constant, numbers) in [
        (Constant::JointFriction, vec![0.01, 0.1, 0.0]),
        (Constant::JointStiffness, vec![0.0, 50.0, 0.0]),
        (Constant::JointRest, vec![0.0, 0.3, 0.0]),
        (Constant::JointDamping, vec![0.0, 0.3, 0.0]),
        (Constant::JointForce, vec![0.0, 0.5, 0.0]),
        (Constant::JointLimits, vec![-0.5, 0.4]),
        (Constant::GearRatio, vec![1.5]),
        (Constant::GearOffset, vec![0.2]),
        (Constant::Armature, vec![0.02, 0.0, 0.0]),
        (Constant::MotorTarget, vec![0.2]),
        (Constant::MotorStiffness, vec![20.0]),
        (Constant::MotorDamping, vec![1.0]),
        (Constant::MotorMost, vec![30.0]),
    ] {
        assert_eq!(constant.of(&world), numbers, "{constant:?}");
        assert_eq!(constant.shape(&world).iter().product::<usize>(), numbers.len());
        assert!(constant.is_of_joints());
        let twice = constant.from_one_number(&world, 2.0);
        let set = world.with_constants(&[(constant, &twice)]).unwrap();
        assert_eq!(constant.of(&set), twice, "{constant:?}");
        // And nothing else.
        for other in Constant::ALL.into_iter().filter(|other| *other != constant) {
            assert_eq!(other.of(&set), other.of(&world), "{constant:?} {other:?}");
        }
        let wrong = world.with_constants(&[(constant, &vec![-1.0; numbers.len()])]);
        let any = [
            Constant::MotorTarget,
            Constant::JointRest,
            Constant::JointForce,
            // Both ends in one place.
            Constant::JointLimits,
            Constant::GearRatio,
            Constant::GearOffset,
        ];
        assert_eq!(wrong.is_ok(), any.contains(&constant), "{constant:?}");
    }
    assert_eq!(Constant::Anchor.shape(&world), [2, 2, 3]);
    let anchors: Vec<_> = (0..12).map(|k| 0.1 * f64::from(k)).collect();
    let set = world.with_constants(&[(Constant::Anchor, &anchors)]).unwrap();
    assert_eq!(set.joints()[1].frames()[0].anchor.as_slice(), &anchors[6..9]);
    assert_eq!(Constant::JointLimits.shape(&world), [1, 2]);
    for (constant, wrong) in [
        (Constant::JointLimits, &[0.4, -0.5][..]),
        (Constant::JointRest, &[0.0, f64::NAN, 0.0]),
        (Constant::GearRatio, &[1e7]),
        (Constant::GearOffset, &[f64::INFINITY]),
    ] {
        assert!(world.with_constants(&[(constant, wrong)]).is_err(), "{constant:?}");
    }
    // A motor that holds a speed has no stiffness to set.
    let mut joints = world.joints().to_vec();
    let motor = Some(Motor::Speed { target: 1.0, most: 2.0 });
    let Axis::Free(drive) = joints[0].angular()[2] else { unreachable!() };
    let drive = Drive { motor, ..drive };
    joints[0] = joints[0].clone().with_drive(JointAxis::Angular(2), drive).unwrap();
    let fast = world.with_joints(joints).unwrap();
    assert!(fast.with_constants(&[(Constant::MotorStiffness, &[0.0])]).is_ok());
    let error = fast.with_constants(&[(Constant::MotorStiffness, &[5.0])]).unwrap_err();
    assert!(error.to_string().contains("holds a speed"), "{error}");
}

/// Targets of motors, forces of joints and constants of both, from rollout to rollout and step to step: as a loop.
#[test]
fn motors_are_driven_in_rollouts() {
    use tumble::joint::Drive;
    const B: usize = 3;
    const T: usize = 60;
    let (world, starts) = (driven_world(), driven_starts());
    let motors: Vec<_> = (0..B * T).map(|k| (0.1 * k as f64).sin()).collect();
    let forces: Vec<_> = (0..T * 3).map(|k| 0.4 * (0.7 * k as f64).cos()).collect();
    let damping: Vec<_> = (0..B * 3).map(|k| 0.1 * k as f64).collect();
    let parameters = [Varied { constant: Constant::JointDamping, values: &damping }];
    let batch = Batch {
        steps: T,
        motors: &motors,
        joint_forces: &forces,
        parameters: &parameters,
        ..batch(&world, &starts, B)
    };
    let found = run(&batch, 2).unwrap();
    for rollout in 0..B {
        let given = [(Constant::JointDamping, &damping[3 * rollout..][..3])];
        let own = world.with_constants(&given).unwrap();
        let states: Vec<_> = batch_states(&starts);
        let mut simulation = Simulation::new(own.clone(), states, Motion::native(&own)).unwrap();
        let mut record = StepRecord::new();
        for step in 0..T {
            for (slot, (joint, axis)) in own.driven_axes().into_iter().enumerate() {
                let drive = *own.joints()[joint].drive(axis).unwrap();
                let target = motors[rollout * T + step];
                let force = drive.force + forces[3 * step + slot];
                let motor = drive.motor.map(|motor| motor.to(target));
                simulation.set_drive(joint, axis, Drive { force, motor, ..drive }).unwrap();
            }
            simulation.step(&mut record).unwrap();
            let numbers: Vec<_> = simulation
                .states()
                .iter()
                .flat_map(|state| state.to_vector().as_slice().to_vec())
                .collect();
            assert_eq!(found.states[(rollout * T + step) * 26..][..26], numbers[..]);
        }
    }
    assert!(run(&Batch { motors: &motors[1..], ..batch }, 1).is_err());
    assert!(run(&Batch { joint_forces: &forces[1..], ..batch }, 1).is_err());
}

/// Those of motors of sums stand behind those of axes.
#[test]
fn motors_of_sums_are_driven_in_rollouts() {
    use tumble::joint::{Drive, Gear, GearAxis, JointAxis, Motor};
    const T: usize = 40;
    let servo = Motor::Position { target: 0.0, stiffness: 40.0, damping: 1.0, most: 3.0 };
    let axes = [JointAxis::Angular(2), JointAxis::Linear(2)];
    let [first, second] = [0, 1].map(|joint| GearAxis { joint, axis: axes[joint] });
    let sum = Gear::new(first, second, -2.0, 0.0);
    let sum = sum.with_drive(Drive { motor: Some(servo), ..Drive::NONE });
    let (world, starts) = (driven_world().with_gears(vec![sum]).unwrap(), driven_starts());
    assert_eq!(world.gear_motors(), [0]);
    let motors: Vec<_> = (0..2 * T).map(|k| (0.1 * k as f64).sin()).collect();
    let batch = Batch { steps: T, motors: &motors, ..batch(&world, &starts, 1) };
    let found = run(&batch, 1).unwrap();
    let motion = Motion::native(&world);
    let mut simulation = Simulation::new(world.clone(), batch_states(&starts), motion).unwrap();
    let mut record = StepRecord::new();
    for (step, targets) in motors.chunks(2).enumerate() {
        simulation
            .set_motor(
                0,
                axes[0],
                world.joints()[0].drive(axes[0]).unwrap().motor.map(|motor| motor.to(targets[0])),
            )
            .unwrap();
        let motor = Some(servo.to(targets[1]));
        simulation.set_gear_drive(0, Drive { motor, ..Drive::NONE }).unwrap();
        simulation.step(&mut record).unwrap();
        let numbers = numbers(simulation.states());
        assert_eq!(found.states[step * 26..][..26], numbers[..]);
    }
    assert!(
        found.states[26 * (T - 1)..]
            != run(&Batch { motors: &[], ..batch }, 1).unwrap().states[26 * (T - 1)..]
    );
    assert!(run(&Batch { motors: &motors[..T], ..batch }, 1).is_err());
}

fn batch_states(numbers: &[f64]) -> Vec<State> {
    let state = |numbers: &[f64]| {
        State::from_vector(&nalgebra::SVector::<f64, 13>::from_column_slice(numbers))
    };
    numbers.chunks_exact(13).map(state).collect()
}
