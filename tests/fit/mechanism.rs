//! Fits of several bodies: a double pendulum and a sliding stack, whose hidden constants come back.

use nalgebra::{Matrix3, Vector3};
use rand_mt::Mt;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use tumble::contact::{Partner, Plane};
use tumble::fit::evaluator::{Forgetful, Query};
use tumble::fit::plan::{Plan, Sought};
use tumble::fit::recording::read_bodies;
use tumble::fit::search::Found;
use tumble::fit::{
    Constant, Evaluator, FitError, Loss, Model, Parameter, ParameterValues, Protocol, Toss,
};
use tumble::joint::{Drive, Joint, JointFrame};
use tumble::mechanics::load::Polyline;
use tumble::mechanics::quaternion::left;
use tumble::mechanics::{Load, RigidBody, Rotation, State};
use tumble::simulation::{Motion, Simulation, StepRecord};
use tumble::world::{Parameters, World};

const RATE: f64 = 100.0;
const SUBSTEPS: usize = 4;
const FRAMES: usize = 40;

fn number(constant: Constant, number: usize) -> Parameter {
    Parameter { constant, number: Some(number) }
}

fn parameters(bodies: Vec<RigidBody>, ground: Option<Plane>) -> Parameters {
    let (gravity, rotation) = (Vector3::new(0.0, 0.0, -9.81), Rotation::Momentum);
    Parameters { bodies, ground, gravity, friction: 0.5, time_step: 0.001, rotation }
}

/// Two rods of 0.4 m on hinges about y, the first one's in the world; the second is pulled by a load that changes.
fn pendulum() -> Model {
    let rod = |mass: f64| {
        let inertia = Matrix3::from_diagonal(&Vector3::new(1e-3, 0.014, 0.014)) * mass;
        RigidBody::with_box_corners(mass, inertia, Vector3::new(0.2, 0.02, 0.02)).unwrap()
    };
    let frame = |x: f64| JointFrame::along(Vector3::new(x, 0.0, 0.0), Vector3::y()).unwrap();
    let hinge = |body: usize, other: Option<usize>, x: f64, damping: f64| {
        let drive = Drive { damping, ..Drive::NONE };
        Joint::revolute(body, other, [frame(-0.2), frame(x)], drive)
    };
    let world = World::new(parameters(vec![rod(1.0), rod(0.5)], None)).unwrap();
    let world = world.with_untouched(0).unwrap().with_untouched(1).unwrap();
    let joints = vec![hinge(0, None, 0.0, 0.02), hinge(1, Some(0), 0.2, 0.01)];
    let world = world.with_joints(joints).unwrap();
    Model::of_bodies(world, vec![Load::none(), pushed()], Vec::new()).unwrap()
}

/// The rods as they hang from the first hinge at these angles from the vertical, at rest.
fn hung(angles: [f64; 2]) -> Vec<State> {
    let mut anchor = Vector3::zeros();
    let one = |angle: f64| {
        // From along x to along −z by a quarter turn about y, and by the angle.
        let turn = std::f64::consts::FRAC_PI_2 - angle;
        let along = Vector3::new(turn.cos(), 0.0, -turn.sin());
        let position = anchor + 0.2 * along;
        anchor += 0.4 * along;
        let attitude = [(0.5 * turn).cos(), 0.0, (0.5 * turn).sin(), 0.0].into();
        State { position, attitude, velocity: Vector3::zeros(), spin: Vector3::zeros() }
    };
    angles.map(one).to_vec()
}

/// What `model` does with these values under a `load` of the second body from `starts` at the time `begin` (s) on, with `noise` (m, and rad for 0.2 m).
fn recorded(
    model: &Model,
    values: &ParameterValues,
    (name, begin, starts): (&str, f64, &[State]),
    load: Load,
    noise: f64,
) -> Toss {
    let step = 1.0 / (RATE * SUBSTEPS as f64);
    let world = model.world(values, step).unwrap();
    let motion = Motion::native(&world);
    let mut simulation = Simulation::new(world, starts.to_vec(), motion).unwrap();
    simulation.set_index((begin / step).round() as u64).unwrap();
    simulation.set_load(1, load).unwrap();
    let (mut record, mut frames) = (StepRecord::new(), starts.to_vec());
    while frames.len() < FRAMES * starts.len() {
        for _ in 0..SUBSTEPS {
            simulation.step(&mut record).unwrap();
        }
        frames.extend(simulation.states());
    }
    let mut draws = Mt::new(starts[0].position.z.to_bits() as u32);
    let mut draw = || noise * (2.0 * f64::from(draws.next_u32()) / f64::from(u32::MAX) - 1.0);
    for state in &mut frames[starts.len()..] {
        state.position += Vector3::from_fn(|_, _| draw());
        let turn = Vector3::from_fn(|_, _| 2.5 * draw());
        let turn = nalgebra::Vector4::new(1.0, turn.x, turn.y, turn.z).normalize();
        state.attitude = left(&state.attitude) * turn;
    }
    let bodies = starts.len();
    Toss { begin, bodies, ..Toss::new(name, RATE, frames) }.checked().unwrap()
}

/// The load of the second rod of [`pendulum`].
fn pushed() -> Load {
    let push = Polyline::new(vec![(0.0, Vector3::zeros()), (1.0, Vector3::new(2.0, 0.0, 0.0))]);
    let still = Polyline::new(vec![(0.0, Vector3::zeros())]).unwrap();
    Load::new(push.unwrap(), still, Vector3::zeros()).unwrap()
}

const STARTS: [(&str, f64, [f64; 2]); 3] =
    [("a", 0.1, [1.2, 0.4]), ("b", 0.5, [-0.9, 0.6]), ("c", 0.2, [0.5, -1.4])];

fn swings(values: &ParameterValues, noise: f64) -> Vec<Toss> {
    let model = pendulum();
    let one = |(name, begin, angles)| {
        recorded(&model, values, (name, begin, &hung(angles)), pushed(), noise)
    };
    STARTS.map(one).to_vec()
}

/// Dampings of both hinges, the mass of the second rod, and the inertia of the first about its hinge's axis.
fn wanted() -> [(Parameter, f64); 4] {
    [
        (number(Constant::JointDamping, 0), 0.05),
        (number(Constant::JointDamping, 1), 0.03),
        (number(Constant::Mass, 1), 0.65),
        (number(Constant::Inertia, 4), 0.017),
    ]
}

fn hidden() -> ParameterValues {
    wanted().iter().fold(ParameterValues::default(), |values, (p, value)| values.with(*p, *value))
}

fn with<T>(model: &Model, tosses: &[Toss], task: impl FnOnce(&mut Evaluator<'_>) -> T) -> T {
    let protocol = Protocol::new(model, SUBSTEPS);
    let mut memory = Forgetful;
    let flag = Arc::new(AtomicBool::new(false));
    task(&mut Evaluator::new(model, &protocol, tosses, &mut memory, flag))
}

fn found(model: &Model, tosses: &[Toss], bounds: &[(Parameter, [f64; 2])]) -> Found {
    let sought = bounds.iter().map(|&(parameter, bounds)| Sought { parameter, bounds });
    let (sought, loss) = (sought.collect(), Loss::Robust);
    let plan = Plan { sought, loss, evaluations: 80, rounds: 2, polish: 40, seed: 3 };
    let start = bounds.iter().fold(model.values(), |values, (parameter, _)| {
        values.with(*parameter, model.own(*parameter))
    });
    let all: Vec<usize> = (0..tosses.len()).collect();
    with(model, tosses, |evaluator| plan.search(&start, evaluator, &all)).unwrap()
}

/// The usual bounds, and of a moment of inertia those that have to be given.
fn bounds(model: &Model) -> Vec<(Parameter, [f64; 2])> {
    let usual = |parameter| match model.usual_bounds(parameter) {
        Ok(bounds) => bounds,
        Err(error) => {
            assert!(error.to_string().contains("inertia[4] is 0.014"), "{error}");
            [0.008, 0.03]
        }
    };
    wanted().map(|(parameter, _)| (parameter, usual(parameter))).to_vec()
}

/// Of recordings without noise all that was hidden comes back, through a load that is another at each one's time.
#[test]
fn a_pendulum_gives_its_hidden_constants_back() {
    let model = pendulum();
    let found = found(&model, &swings(&hidden(), 0.0), &bounds(&model));
    for (parameter, value) in wanted() {
        let off = (found.values.get(parameter) - value).abs() / value;
        assert!(off < 1e-8, "{}: off by {off:.1e}, {found:?}", parameter.name());
    }
    assert_eq!(found.polish.unwrap().blind, 0);
}

/// Through noise of a millimetre they lie within what the slopes say.
#[test]
fn through_noise_the_slopes_say_how_well_they_are_known() {
    let model = pendulum();
    let found = found(&model, &swings(&hidden(), 1e-3), &bounds(&model));
    let polish = found.polish.as_ref().unwrap();
    for (k, (parameter, value)) in wanted().into_iter().enumerate() {
        let off = (found.values.get(parameter) - value).abs();
        let error = polish.covariance[(k, k)].sqrt();
        println!("{}: off by {off:.1e}, ± {error:.1e}", parameter.name());
        assert!(error > 0.0 && off < 5.0 * error && off < 0.1 * value, "{off} ± {error}");
    }
    // One recording is no sample.
    let alone = self::found(&model, &swings(&hidden(), 1e-3)[..1], &bounds(&model));
    assert!(alone.polish.unwrap().covariance.iter().all(|number| number.is_nan()));
}

/// The slopes of recordings by a mass whose inertia is another parameter, by one of all dampings and by the rest: central
/// differences of fifth order.
#[test]
fn the_slopes_are_their_differences() {
    const BY: f64 = 1e-4;
    let (model, tosses) = (pendulum(), swings(&hidden(), 0.0));
    let values = wanted().iter().fold(ParameterValues::default(), |values, (parameter, _)| {
        values.with(*parameter, 1.1 * model.own(*parameter))
    });
    let all = [0, 1, 2];
    let whole = ParameterValues::default()
        .with(Constant::JointDamping, 1.3)
        .with(Constant::Mass, 0.9)
        .with(Constant::Gravity, 9.7);
    for values in [values, whole] {
        let parameters: Vec<Parameter> = values.all().iter().map(|(known, _)| *known).collect();
        with(&model, &tosses, |evaluator| {
            let query = Query { values: &values, substeps: SUBSTEPS, tosses: &all };
            let slopes = evaluator.slopes(&query, &parameters, Loss::Robust).unwrap();
            for (k, &parameter) in parameters.iter().enumerate() {
                let by = BY * values.get(parameter);
                let at = |times: f64| {
                    let values = values.clone().with(parameter, values.get(parameter) + times * by);
                    let query = Query { values: &values, substeps: SUBSTEPS, tosses: &all };
                    let scores = evaluator.evaluate(&query).unwrap();
                    scores.iter().map(|score| Loss::Robust.of(score)).collect::<Vec<_>>()
                };
                let [a, b, c, d] = [-2.0, -1.0, 1.0, 2.0].map(at);
                for toss in all {
                    let difference = 8.0 * (c[toss] - b[toss]) - (d[toss] - a[toss]);
                    let difference = difference / (12.0 * by);
                    let slope = slopes[toss].gradient[k];
                    let off = (slope - difference).abs() / difference.abs().max(1e-3);
                    assert!(off < 1e-6, "{}: {slope} and {difference}", parameter.name());
                }
            }
        });
    }
}

/// A mass by which nothing moves otherwise is said not to be shown, whatever rounding makes of it.
#[test]
fn what_the_recordings_do_not_show_is_said() {
    let model = pendulum();
    let parameters = [number(Constant::JointDamping, 0), Constant::Mass.into()];
    // Both masses go together, and without load and damping nothing is told by them.
    let world = model.world(&ParameterValues::default(), 0.001).unwrap();
    let free = [0, 1].map(|k| number(Constant::JointDamping, k));
    let undamped = free.iter().fold(ParameterValues::default(), |v, p| v.with(*p, 0.0));
    let alone = Model::of_bodies(world, vec![Load::none(), Load::none()], vec![]).unwrap();
    let tosses = STARTS.map(|(name, _, angles)| {
        recorded(&alone, &undamped, (name, 0.0, &hung(angles)), Load::none(), 0.0)
    });
    let world = alone.world(&undamped, 0.001).unwrap();
    let alone = Model::of_bodies(world, vec![Load::none(), Load::none()], vec![]).unwrap();
    let found = found(&alone, &tosses, &parameters.map(|p| (p, [0.0, 2.0])));
    let polish = found.polish.as_ref().unwrap();
    assert!(polish.shows(0) && !polish.shows(1), "{polish:?}");
    assert!(polish.covariance[(1, 1)].is_nan());
}

/// Two boxes on each other that slide and rub, the upper one faster at first: friction with the ground and between them.
#[test]
fn a_sliding_stack_gives_both_frictions_back() {
    let body = || {
        let inertia = Matrix3::from_diagonal_element(2e-3);
        RigidBody::with_box_corners(0.5, inertia, Vector3::new(0.1, 0.1, 0.05)).unwrap()
    };
    let world = World::new(parameters(vec![body(), body()], Some(Plane::level()))).unwrap();
    let world = world.with_friction_between(0, Partner::Ground, 0.3).unwrap();
    let world = world.with_friction_between(1, Partner::Body(0), 0.3).unwrap();
    let model = Model::of_bodies(world, vec![Load::none(), Load::none()], vec![]).unwrap();
    let at = |z: f64, speed: f64| State {
        position: Vector3::new(0.0, 0.0, z),
        attitude: [1.0, 0.0, 0.0, 0.0].into(),
        velocity: Vector3::new(speed, 0.0, 0.0),
        spin: Vector3::zeros(),
    };
    let wanted =
        [(number(Constant::PairFriction, 0), 0.2), (number(Constant::PairFriction, 1), 0.4)];
    let hidden = wanted.iter().fold(ParameterValues::default(), |v, (p, value)| v.with(*p, *value));
    let one = |speed: f64| {
        let starts = [at(0.05, speed), at(0.15, speed + 0.3)];
        recorded(&model, &hidden, (&format!("{speed}"), 0.0, &starts), Load::none(), 0.0)
    };
    let tosses = [1.0, 1.3].map(one);
    let bounds = wanted.map(|(parameter, _)| (parameter, model.usual_bounds(parameter).unwrap()));
    let found = found(&model, &tosses, &bounds);
    for (parameter, value) in wanted {
        let off = (found.values.get(parameter) - value).abs();
        assert!(off < 1e-8, "{}: off by {off:.1e}, {found:?}", parameter.name());
    }
}

/// A start whose joints do not quite fit, as a camera sees it, is brought together.
#[test]
fn a_start_that_does_not_fit_is_brought_together() {
    let (model, mut tosses) = (pendulum(), swings(&hidden(), 0.0));
    for toss in &mut tosses {
        toss.frames[1].position.z += 1e-3;
    }
    let score = with(&model, &tosses, |evaluator| {
        evaluator.evaluate(&Query { values: &hidden(), substeps: SUBSTEPS, tosses: &[0, 1, 2] })
    });
    for score in score.unwrap() {
        assert!(score.position > 1e-5 && score.position < 1e-2 && score.failed == 0, "{score:?}");
    }
}

#[test]
fn parameters_that_are_not_there_are_refused() {
    let model = pendulum();
    let refused = |constant, number| model.parameter(constant, number).unwrap_err();
    assert!(refused(Constant::JointDamping, Some(2)).contains("there are 2, counted from 0"));
    assert!(refused(Constant::GearRatio, None).contains("none that could vary"));
    assert!(refused(Constant::TimeStep, None).contains("that of the recordings"));
    assert!(refused(Constant::Size, None).contains("shapes stay"));
    let twice = [number(Constant::JointDamping, 0), Constant::JointDamping.into()];
    let sought = twice.map(|parameter| Sought { parameter, bounds: [0.0, 2.0] }).to_vec();
    let plan = Plan { sought, loss: Loss::Mean, evaluations: 80, rounds: 1, polish: 0, seed: 1 };
    let start = twice.iter().fold(ParameterValues::default(), |v, p| v.with(*p, model.own(*p)));
    let why = plan.check(&start).unwrap_err().to_string();
    assert_eq!(why, "joint_damping is named twice");
    let why = plan.check(&ParameterValues::default()).unwrap_err().to_string();
    assert_eq!(why, "joint_damping[0] has no value to start from");
    // Recordings of other bodies.
    let thrown = Toss { bodies: 1, ..swings(&hidden(), 0.0).remove(0) };
    let evaluated = with(&model, &[thrown], |evaluator| {
        evaluator.evaluate(&Query { values: &hidden(), substeps: SUBSTEPS, tosses: &[0] })
    });
    let Err(FitError::Toss { why, .. }) = evaluated else { panic!("{evaluated:?}") };
    assert_eq!(why, "is of 1 bodies, and the scene has 2");
}

/// The table of a run's states, and what is wrong with others.
#[test]
fn tables_of_several_bodies_are_read_and_refused() {
    let header =
        "k,t_s,body,x_m,y_m,z_m,qw,qx,qy,qz,vx_m_s,vy_m_s,vz_m_s,wx_rad_s,wy_rad_s,wz_rad_s";
    let row = |k: usize, body: &str| {
        format!("{k},{},{body},0,0,{k},1,0,0,0,0,0,100,0,0,0", 0.5 + 0.01 * k as f64)
    };
    let rows = |names: [&str; 2]| {
        let both = |k: usize| names.map(|name| row(k, name));
        let all: Vec<String> = (0..6).flat_map(both).collect();
        all
    };
    let names = ["upper".to_owned(), "lower".to_owned()];
    let read = |rows: &[String]| {
        let text = format!("{header}\n{}\n", rows.join("\n"));
        read_bodies(text.as_bytes(), &names, "run")
    };
    let [toss] = &read(&rows(["0", "1"])).unwrap()[..] else { panic!() };
    assert_eq!((toss.name.as_str(), toss.bodies, toss.count()), ("run", 2, 6));
    assert_eq!((toss.rate, toss.begin, toss.frame(3)[1].position.z), (100.0, 0.5, 3.0));
    assert!(toss.frame(6).is_empty());
    // By name, in any order.
    assert_eq!(*toss, read(&rows(["lower", "upper"])).unwrap()[0]);
    let refused = |change: &dyn Fn(&mut Vec<String>)| {
        let mut rows = rows(["0", "1"]);
        change(&mut rows);
        read(&rows).unwrap_err().to_string()
    };
    let says = |part: &str, change: &dyn Fn(&mut Vec<String>)| {
        let why = refused(change);
        assert!(why.contains(part), "{why} / {part}");
    };
    says("toss run, row 3: at t_s = 0.53", &|rows| drop(rows.remove(5)));
    says("the one before has no lower", &|rows| drop(rows.remove(5)));
    says("its last frame has no lower", &|rows| drop(rows.pop()));
    says("the scene has no body 2", &|rows| rows[5] = row(2, "2"));
    says("row 3: it has upper twice", &|rows| rows[5] = row(2, "0"));
    says("row 2: z_m is `x`", &|rows| rows[3] = rows[3].replace("0,0,1,1,", "0,0,x,1,"));
    says("it has 2 frames", &|rows| rows.truncate(4));
    says("the table has no rows", &|rows| rows.clear());
    let lonely = format!("{}\n", header.replace(",body", ""));
    let why = read_bodies(lonely.as_bytes(), &names, "run").unwrap_err().to_string();
    assert!(why.contains("no column body") && why.contains("of 2 bodies"), "{why}");
}
