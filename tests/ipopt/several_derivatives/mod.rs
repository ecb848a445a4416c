//! Program of several bodies. Its derivatives are compared with central differences at random
//! points of scenes with two and three bodies. One body on the ground is compared with the
//! tutorial's program.

mod casadi;
use crate::common;

use crate::common::{
    any_rotation, any_state, any_world, any_wrench, cases, inertia, quaternion, vector,
};
use crate::slopes::{Program as _, dense, hessian_error, jacobian_error};
use nalgebra::{Matrix3, Vector3};
use proptest::prelude::*;
use tumble::step_nlp::StepNlp;
use tumble::step_nlp::several::{PosedStep, SeveralNlp};
use tumble_core::contact::curved::{Core, shortest_way};
use tumble_core::contact::{
    Contact, ContactKey, ContactLaw, CorePair, Curved, EllipsoidPoint, Features, Partner, Plane,
};
use tumble_core::geometry::Ellipsoid;
use tumble_core::mechanics::quaternion::rotation;
use tumble_core::mechanics::{RigidBody, Rotation, State, Wrench};
use tumble_core::world::{Parameters, World};

/// Program of several bodies, and a point to differentiate at.
#[derive(Debug, Clone)]
struct Anywhere {
    nlp: SeveralNlp,
    x: Vec<f64>,
    multipliers: Vec<f64>,
}

/// Point of `body`, rounded or not, and a plane in the frame of `partner`.
#[derive(Debug, Clone)]
struct Meeting {
    body: usize,
    partner: Option<usize>,
    features: Features,
    friction: f64,
    /// Rebound speed [m/s], or 0 without restitution.
    rebound: f64,
}

fn meeting(bodies: usize) -> impl Strategy<Value = Meeting> {
    let pair = (0..bodies, proptest::option::weighted(0.7, 1..bodies));
    let point = prop_oneof![1 => Just(Vector3::zeros()), 4 => vector(1.0)];
    let features = (point, prop_oneof![Just(0.0), 0.05..0.4], quaternion(), -1.0..1.0);
    let friction = prop_oneof![1 => Just(0.0), 3 => 0.1..1.0];
    let rebound = prop_oneof![2 => Just(0.0), 1 => 0.1..3.0];
    (pair, features, friction, rebound).prop_map(
        move |((body, shift), (point, radius, q, offset), friction, rebound)| {
            let partner = shift.map(|shift| (body + shift) % bodies);
            let frame = rotation(&q.normalize());
            let features = Features::of_plane(point, radius, frame, offset);
            Meeting { body, partner, features, friction, rebound }
        },
    )
}

/// Random program of two or three bodies, with two to six contacts between them and with fixed
/// planes.
fn anywhere() -> impl Strategy<Value = Anywhere> {
    (2..=3_usize).prop_flat_map(|n| {
        let body = (0.1..100.0, inertia());
        let bodies = proptest::collection::vec((body, any_state(), any_wrench(), any_state()), n);
        let meetings = proptest::collection::vec(meeting(n), 2..=6);
        let numbers = proptest::collection::vec(-1.0..1.0, 200);
        // The smoothing is large enough for differences to follow the derivatives.
        let constants = (vector(10.0), 1e-3..0.05, any_rotation(), 0.5..1.0, 0.0..1.0);
        (bodies, meetings, numbers, constants).prop_map(
            |(bodies, meetings, numbers, (gravity, time_step, rotation, smoothing, yielding))| {
                let made = bodies.iter().map(|((mass, inertia), ..)| {
                    RigidBody::new(*mass, *inertia, &[Vector3::x()]).unwrap()
                });
                let world = World::new(Parameters {
                    bodies: made.collect(),
                    ground: Some(Plane::level()),
                    gravity,
                    friction: 0.3,
                    time_step,
                    rotation,
                });
                let unit = |state: &State| State { attitude: state.attitude.normalize(), ..*state };
                let states: Vec<_> = bodies.iter().map(|(_, state, ..)| unit(state)).collect();
                let wrenches: Vec<_> = bodies.iter().map(|(_, _, wrench, _)| *wrench).collect();
                let next: Vec<_> = bodies.iter().map(|(.., next)| *next).collect();
                let posed = (world.unwrap(), states, wrenches, meetings);
                pose(&posed, &next, &numbers, (smoothing, yielding))
            },
        )
    })
}

/// Random point or segment.
fn core() -> impl Strategy<Value = Core> {
    let along = prop_oneof![Just(Vector3::zeros()), vector(1.0)];
    (vector(1.0), along).prop_map(|(from, along)| Core { from, along })
}

/// Random ellipsoid or disc, rounded or not, and a plane.
fn ellipsoid() -> impl Strategy<Value = Features> {
    let half = (0.2..1.0, 0.2..1.0, prop_oneof![Just(0.0), 0.2..1.0]);
    let own = (vector(1.0), quaternion(), half, prop_oneof![Just(0.0), 0.05..0.3]);
    (own, quaternion(), -1.0..1.0).prop_map(|((centre, turn, half, radius), frame, offset)| {
        let half = Matrix3::from_diagonal(&Vector3::new(half.0, half.1, half.2));
        let shape = Ellipsoid { centre, axes: rotation(&turn.normalize()) * half };
        // Set once the bodies have states.
        let one = EllipsoidPoint { shape, toward: Vector3::zeros() };
        let plane = Features::of_plane(centre, radius, rotation(&frame.normalize()), offset);
        Features { curved: Some(Curved::Ellipsoid(one)), ..plane }
    })
}

/// Random program of two bodies with two or three contacts of round features, between them or with
/// fixed ones, and of ellipsoids with planes. States are near the start of the step, where the shortest connection has turned by
/// less than 60°. They avoid the ends of the segments, where the second derivatives jump.
fn anywhere_round() -> impl Strategy<Value = Anywhere> {
    let round = (core(), core(), 0.0..0.3, 0.05..0.3).prop_map(|(of_a, of_b, radius_a, radius)| {
        let pair = CorePair { of_a, of_b, radius, shares: (0.0, 0.0) };
        let plane = Features::of_plane(Vector3::zeros(), radius_a, Matrix3::identity(), 0.0);
        Features { curved: Some(Curved::Cores(pair)), ..plane }
    });
    let round = prop_oneof![2 => round, 1 => ellipsoid()];
    let meeting = (0..2_usize, any::<bool>(), round, 0.1..1.0);
    let meetings = proptest::collection::vec(meeting, 2..=3);
    let body = (0.1..100.0, inertia(), any_state(), any_wrench(), any_state());
    let bodies = proptest::collection::vec(body, 2);
    let numbers = proptest::collection::vec(-1.0..1.0, 200);
    let constants = (vector(10.0), 1e-3..0.05, 0.5..1.0, 0.0..1.0);
    (bodies, meetings, numbers, constants).prop_filter_map(
        "away from where second derivatives jump",
        |(bodies, meetings, numbers, (gravity, time_step, smoothing, yielding))| {
            let made = bodies.iter().map(|(mass, inertia, ..)| {
                RigidBody::new(*mass, *inertia, &[Vector3::x()]).unwrap()
            });
            let world = World::new(Parameters {
                bodies: made.collect(),
                ground: Some(Plane::level()),
                gravity,
                friction: 0.3,
                time_step,
                rotation: Rotation::Momentum,
            });
            let unit = |state: &State| State { attitude: state.attitude.normalize(), ..*state };
            let states: Vec<_> = bodies.iter().map(|(_, _, state, ..)| unit(state)).collect();
            let wrenches: Vec<_> = bodies.iter().map(|(.., wrench, _)| *wrench).collect();
            let near = |now: &State, other: &State| {
                State::from_vector(&(now.to_vector() + 0.02 * other.to_vector()))
            };
            let ends = states.iter().zip(&bodies);
            let next: Vec<_> = ends.map(|(now, (.., other))| near(now, other)).collect();
            let meetings: Vec<_> = meetings
                .into_iter()
                .map(|(body, free, features, friction)| {
                    let partner = free.then_some(1 - body);
                    Meeting { body, partner, features, friction, rebound: 0.0 }
                })
                .collect();
            let smooth =
                |meeting: &Meeting| is_smooth(meeting, &states) && is_smooth(meeting, &next);
            let posed = (world.unwrap(), states.clone(), wrenches, meetings);
            posed.3.iter().all(smooth).then(|| pose(&posed, &next, &numbers, (smoothing, yielding)))
        },
    )
}

/// True if the features are at least half a metre apart and the segments not nearly parallel. The
/// nearest points must be at least 0.02 of a segment away from its ends. A disc must not lie flat.
fn is_smooth(meeting: &Meeting, states: &[State]) -> bool {
    let pose = states[meeting.body].pose();
    let curved = match &meeting.features.curved {
        None => return true,
        Some(Curved::Cores(pair)) => pair,
        Some(Curved::Ellipsoid(one)) => {
            let normal = meeting.features.frame.column(2).into_owned();
            let turned = meeting.partner.map(|partner| states[partner].pose().rotation * normal);
            let seen = pose.rotation.tr_mul(&turned.unwrap_or(normal));
            return one.shape.half_width(&seen) > 0.1;
        }
    };
    let of_a = curved.of_a.moved(&pose.rotation, &pose.position);
    let of_b = meeting.partner.map_or(curved.of_b, |partner| {
        let pose = states[partner].pose();
        curved.of_b.moved(&pose.rotation, &pose.position)
    });
    let ((s, t), way) = shortest_way(&of_a, &of_b);
    let clear = |core: &Core, share: f64, to: f64| {
        // Distance of the unconstrained minimum from an end, relative to the segment.
        let pull = core.along.dot(&way) * to / core.along.norm_squared();
        !core.is_segment() || (0.02..0.98).contains(&share) || pull.abs() > 0.02
    };
    let across = of_a.along.cross(&of_b.along).norm();
    let parallel = of_a.is_segment()
        && of_b.is_segment()
        && across < 0.3 * of_a.along.norm() * of_b.along.norm();
    way.norm() > 0.5 && clear(&of_a, s, 1.0) && clear(&of_b, t, -1.0) && !parallel
}

fn pose(
    (world, states, wrenches, meetings): &(World, Vec<State>, Vec<Wrench>, Vec<Meeting>),
    next: &[State],
    numbers: &[f64],
    (smoothing, yielding): (f64, f64),
) -> Anywhere {
    let poses: Vec<_> = states.iter().map(State::pose).collect();
    let contacts: Vec<_> = meetings
        .iter()
        .map(|meeting| {
            let partner = meeting.partner.map_or(Partner::Ground, Partner::Body);
            let key = ContactKey { body: meeting.body, point: 0, partner, pair: None };
            let law = ContactLaw::plastic(meeting.friction);
            let placed = |index: usize| (&world.bodies()[index], &poses[index]);
            let (a, b) = (placed(meeting.body), meeting.partner.map(placed));
            let mut features = meeting.features;
            if let Some(Curved::Ellipsoid(one)) = &mut features.curved {
                let normal = features.frame.column(2).into_owned();
                let normal = b.map_or(normal, |(_, b)| b.rotation * normal);
                one.toward = one.shape.direction(&a.1.rotation.tr_mul(&normal));
                features.point = one.shape.centre - one.shape.axes * one.toward;
            }
            let contact = Contact::new(key, features, law, a, b);
            Contact { rebound: meeting.rebound, ..contact }
        })
        .collect();
    let bodies: Vec<_> = (0..states.len()).collect();
    let step = PosedStep { world, states, wrenches, bodies: &bodies, contacts: &contacts };
    let mut nlp = SeveralNlp::new(&step, smoothing).unwrap();
    nlp.anchor(yielding, 0.3, numbers.iter().map(|u| Vector3::new(*u, -*u, 2.0 * u)));
    let layout = nlp.layout().clone();
    let mut x: Vec<f64> = next.iter().flat_map(|s| s.to_vector().as_slice().to_vec()).collect();
    // Friction ±5 N, comparable to the smoothing, the rest 0…5.
    let free = layout.free().len();
    x.extend(numbers.iter().take(free - x.len()).map(|u| 5.0 * u));
    x.extend(numbers[40..].iter().take(layout.variables() - free).map(|u| 5.0 * u.abs()));
    Anywhere { nlp, x, multipliers: numbers[100..][..layout.constraints()].to_vec() }
}

proptest! {
    #![proptest_config(cases(64))]

    #[test]
    fn the_jacobian_is_the_slope_of_the_constraints(point in anywhere()) {
        let error = jacobian_error(&point.nlp, &point.x);
        prop_assert!(error < 1e-7, "{error:e}");
    }

    #[test]
    fn the_hessian_is_the_slope_of_the_lagrangians_gradient(
        point in anywhere(), factor in 0.0..2.0
    ) {
        let Anywhere { nlp, x, multipliers } = &point;
        for (row, col) in nlp.hessian_pattern().positions() {
            prop_assert!(row >= col, "({row}, {col}) is above the diagonal");
        }
        let error = hessian_error(nlp, x, factor, multipliers);
        prop_assert!(error < 1e-7, "{error:e}");
    }

    #[test]
    fn the_jacobian_of_round_features_is_the_slope_of_the_constraints(point in anywhere_round()) {
        let error = jacobian_error(&point.nlp, &point.x);
        prop_assert!(error < 1e-7, "{error:e}");
    }

    #[test]
    fn the_hessian_of_round_features_is_the_slope_of_the_lagrangians_gradient(
        point in anywhere_round(), factor in 0.0..2.0
    ) {
        let Anywhere { nlp, x, multipliers } = &point;
        for (row, col) in nlp.hessian_pattern().positions() {
            prop_assert!(row >= col, "({row}, {col}) is above the diagonal");
        }
        let error = hessian_error(nlp, x, factor, multipliers);
        prop_assert!(error < 1e-7, "{error:e}");
    }

    /// Checks one body on the ground. Rows, Jacobian and Hessian equal the tutorial's program
    /// without the unit-norm row, with all points flagged. The two programs sum in different order.
    /// That changes the last digits of the terms, which are up to 1e5 in the rows (velocities over
    /// a time step of 1e-3). With the multipliers they are some 1e3 times larger.
    #[test]
    fn one_body_on_the_ground_is_the_tutorials_program(
        world in any_world(), old in any_state(), wrench in any_wrench(), new in any_state(),
        numbers in proptest::collection::vec(-1.0..1.0, 200)
    ) {
        let old = State { attitude: old.attitude.normalize(), ..old };
        let mut known = StepNlp::new(world.clone(), 0.5).unwrap();
        let flags = known.layout().contacts();
        known.set_step(&old, &wrench, std::iter::repeat_n(1.0, flags));
        let contacts = common::contacts(&world, &old);
        let (states, wrenches) = (&[old], &[wrench]);
        let step =
            PosedStep {
                world: &world,
                states,
                wrenches,
                    bodies: &[0],
                contacts: &contacts,
            };
        let nlp = SeveralNlp::new(&step, 0.5).unwrap();
        let with_friction = world.friction() > 0.0;

        // Indices of this program's variables and rows in the tutorial's.
        let (n, theirs) = (contacts.len(), known.layout());
        let ours = nlp.layout();
        let (mut at, mut row_at): (Vec<_>, Vec<_>) = ((0..13).collect(), (0..13).collect());
        at.resize(ours.variables(), usize::MAX);
        row_at.resize(ours.constraints(), usize::MAX);
        for i in 0..n {
            let [fx, fy, fz, s1, s2, slip] = theirs.contact_variables(i);
            let (of, row) = (ours.normal(i), ours.normal_rows(i));
            (at[of.first], at[of.second]) = (fz, s1);
            row_at[row.first] = theirs.height_rows().start + i;
            row_at[row.second] = theirs.normal_complementarity_rows().start + i;
            prop_assert_eq!(ours.friction(i).is_some(), with_friction);
            if let (Some(of), Some(row)) = (ours.friction(i), ours.friction_rows(i)) {
                (at[of.force[0]], at[of.force[1]]) = (fx, fy);
                (at[of.slack], at[of.slip_speed]) = (s2, slip);
                let first = theirs.dissipation_rows().start + 2 * i;
                (row_at[row.dissipation], row_at[row.dissipation + 1]) = (first, first + 1);
                row_at[row.cone] = theirs.cone_rows().start + i;
                row_at[row.complementarity] =
                    theirs.friction_complementarity_rows().start + i;
            }
        }
        // The order is also the same.
        prop_assert!(at.is_sorted() && row_at.is_sorted());

        let mut x = new.to_vector().as_slice().to_vec();
        x.extend(numbers[..ours.variables() - 13].iter().map(|u| 5.0 * u));
        let (mut whole, mut y) = (vec![0.0; theirs.variables()], vec![0.0; theirs.constraints()]);
        at.iter().zip(&x).for_each(|(&at, &value)| whole[at] = value);
        let multipliers = &numbers[100..][..ours.constraints()];
        row_at.iter().zip(multipliers).for_each(|(&row, &value)| y[row] = value);

        let rows = known.constraints_at(&whole);
        for (row, value) in nlp.constraints_at(&x).into_iter().enumerate() {
            let expected = rows[row_at[row]];
            prop_assert!((value - expected).abs() <= 1e-12 * expected.abs().max(10.0));
        }
        let slopes = known.jacobian_at(&whole);
        let slopes = dense(known.jacobian_pattern(), &slopes, (rows.len(), whole.len()));
        let mine = dense(nlp.jacobian_pattern(), &nlp.jacobian_at(&x), (row_at.len(), at.len()));
        for (i, &row) in row_at.iter().enumerate() {
            for (j, &col) in at.iter().enumerate() {
                let (value, expected) = (mine[(i, j)], slopes[(row, col)]);
                prop_assert!((value - expected).abs() <= 1e-12 * expected.abs().max(10.0));
            }
        }
        let curves = known.hessian_at(&whole, 1.5, &y);
        let curves = dense(known.hessian_pattern(), &curves, (whole.len(), whole.len()));
        let mine = nlp.hessian_at(&x, 1.5, multipliers);
        let mine = dense(nlp.hessian_pattern(), &mine, (at.len(), at.len()));
        for (i, &row) in at.iter().enumerate() {
            for (j, &col) in at.iter().enumerate() {
                let (value, expected) = (mine[(i, j)], curves[(row, col)]);
                prop_assert!((value - expected).abs() <= 1e-10 * expected.abs().max(10.0));
            }
        }
    }
}
