//! Contacts between two bodies, as the certificate evaluates them. Opposite forces act on both
//! bodies at one point of the world. No direction of the world is special.

use crate::common::prelude::*;
use crate::common::symmetry::turned;
use crate::common::turning::{step_attitude, turned_momentum};
use crate::common::{cases, quaternion, vector};
use proptest::prelude::*;
use tumble_core::contact::certificate::Certificate;
use tumble_core::contact::{ContactKey, ContactLaw, Features};
use tumble_core::mechanics::StepMap;

/// Time step h [s].
const TIME_STEP: f64 = 0.01;
const STEP: StepMap = StepMap { form: Rotation::Momentum, time_step: TIME_STEP };

/// Two bodies, their touching features, and a force.
#[derive(Debug, Clone)]
struct Scene {
    bodies: [RigidBody; 2],
    states: [State; 2],
    /// Features of A against a plane of B.
    features: Features,
    friction: f64,
    /// Force on A [N, world frame].
    force: Vector3<f64>,
}

/// Box of 0.5 to 10 kg. All sides are equal if `cube` is true.
fn boxes(cube: bool) -> impl Strategy<Value = RigidBody> {
    (0.5..10.0, proptest::array::uniform3(0.2..1.0)).prop_map(move |(mass, half_sides)| {
        let half_sides = Vector3::from(half_sides);
        let half_sides = if cube { Vector3::repeat(half_sides[0]) } else { half_sides };
        RigidBody::solid_box(mass, half_sides).unwrap()
    })
}

fn any_state() -> impl Strategy<Value = State> {
    (vector(2.0), quaternion(), vector(3.0), vector(5.0)).prop_map(
        |(position, q, velocity, spin)| State { position, attitude: q.normalize(), velocity, spin },
    )
}

/// Scene with a corner of A, sharp or rounded, and a random plane in the frame of B.
fn scene(cubes: bool) -> impl Strategy<Value = Scene> {
    let bodies = [boxes(cubes), boxes(cubes)];
    let radius = prop_oneof![Just(0.0), 0.01..0.2];
    let features = (0..8_usize, radius, quaternion(), -1.0..1.0);
    let law = (prop_oneof![Just(0.0), 0.1..1.0], vector(50.0));
    (bodies, [any_state(), any_state()], features, law).prop_map(
        |(bodies, states, (corner, radius, q, offset), (friction, force))| {
            let point = bodies[0].contact_points()[corner].position;
            let features = Features::from_plane(point, radius, rotation(&q.normalize()), offset);
            Scene { bodies, states, features, friction, force }
        },
    )
}

impl Scene {
    /// World without gravity, far above the plane `ground`.
    fn world(&self, ground: Plane) -> World {
        let (bodies, gravity) = (self.bodies.to_vec(), Vector3::zeros());
        let (friction, time_step) = (self.friction, TIME_STEP);
        World::new(Parameters {
            ground: Some(ground),
            gravity,
            friction,
            time_step,
            ..Parameters::new(bodies)
        })
        .unwrap()
    }

    fn contact(&self) -> Contact {
        let key = ContactKey { body: 0, point: 0, partner: Partner::Body(1), pair: None };
        let [a, b] = [0, 1].map(|i| (&self.bodies[i], self.states[i].pose()));
        let law = ContactLaw::plastic(self.friction);
        Contact::new(key, self.features, law, (a.0, &a.1), Some((b.0, &b.1)))
    }

    /// Point of application of the force [world frame]: the corner, shifted by the radius against
    /// the plane's normal.
    fn touching_point(&self) -> Vector3<f64> {
        let [a, b] = &self.states;
        let normal = rotation(&b.attitude) * self.features.frame.column(2);
        a.position + rotation(&a.attitude) * self.features.point - normal * self.features.radius
    }

    /// Next states under `force` on A and `reaction` on B [N, world frame], both at `point`.
    fn next(&self, [force, reaction]: [Vector3<f64>; 2], point: Vector3<f64>) -> [State; 2] {
        let next = |i: usize, force: Vector3<f64>| {
            let (body, state) = (&self.bodies[i], &self.states[i]);
            let torque = (point - state.position).cross(&force);
            let torque = rotation(&state.attitude).transpose() * torque;
            let velocity = state.velocity + TIME_STEP * force / body.mass();
            let spin = spin_after(body, &state.spin, &torque);
            State {
                position: state.position + TIME_STEP * velocity,
                attitude: step_attitude(&state.attitude, &spin, TIME_STEP),
                velocity,
                spin,
            }
        };
        [next(0, force), next(1, reaction)]
    }

    fn certify(&self, world: &World, next: &[State]) -> Certificate {
        let (wrenches, contacts) = ([Wrench::zero(); 2], [self.contact()]);
        let (states, wrenches, contacts) = (&self.states, &wrenches, &contacts);
        Certifier::new().contact_step(
            world,
            &Claim { states, next, wrenches, contacts, joints: &[], gears: &[] },
            [self.force],
        )
    }

    /// Scene rotated by `q` about the world's origin. B's plane rotates with B.
    fn turned(&self, q: &Vector4<f64>) -> Self {
        let states = self.states.map(|state| turned(&state, q));
        Self { states, force: rotation(q) * self.force, ..self.clone() }
    }
}

/// Solves P⁺(ω⁺) = P⁻(ω) + h τ for ω⁺ by a fixed-point iteration. It converges if h |ω| I_max/I_min
/// < 1.
fn spin_after(body: &RigidBody, spin: &Vector3<f64>, torque: &Vector3<f64>) -> Vector3<f64> {
    let given = turned_momentum(body.inertia(), spin, -TIME_STEP) + TIME_STEP * torque;
    let solve = |torque: Vector3<f64>| body.inertia().lu().solve(&torque).unwrap();
    (0..200).fold(*spin, |next, _| {
        next + solve(given - turned_momentum(body.inertia(), &next, TIME_STEP))
    })
}

fn level_far_below() -> Plane {
    Plane::new(Vector3::z(), -1000.0).unwrap()
}

/// Linear momentum, and angular momentum about the world's origin.
fn momentum(bodies: &[RigidBody; 2], states: &[State; 2]) -> [Vector3<f64>; 2] {
    let of_one = |(body, state): (&RigidBody, &State)| {
        let linear = body.mass() * state.velocity;
        let spin =
            rotation(&state.attitude) * turned_momentum(body.inertia(), &state.spin, -TIME_STEP);
        [linear, state.position.cross(&linear) + spin]
    };
    let [a, b] = [0, 1].map(|i| of_one((&bodies[i], &states[i])));
    [a[0] + b[0], a[1] + b[1]]
}

proptest! {
    #![proptest_config(cases(256))]

    /// Checks that equal and opposite forces at one point obey the certificate's equations of
    /// motion.
    ///
    /// The tolerance covers the rounding of positions over h, 2e-16 · 4 m/0.01 s. Any other
    /// reaction is detected. Half the reaction leaves its full size as an error. The same reaction
    /// at a distant point leaves the spin that its torque makes.
    #[test]
    fn opposite_forces_at_one_point_are_the_exact_step(scene in scene(false), arm in vector(1.0)) {
        let (force, point) = (scene.force, scene.touching_point());
        let world = scene.world(level_far_below());
        let exact = scene.certify(&world, &scene.next([force, -force], point)).dynamics;
        prop_assert!(exact < 1e-12, "{exact:e}");

        let half = scene.certify(&world, &scene.next([force, -0.5 * force], point)).dynamics;
        let missing = 0.5 * TIME_STEP * force.amax() / scene.bodies[1].mass();
        prop_assert!(half > 0.99 * missing, "{half:e} {missing:e}");

        let mut elsewhere = scene.next([force, -force], point);
        elsewhere[1] = scene.next([force, -force], point + arm)[1];
        let wrong = scene.certify(&world, &elsewhere).dynamics;
        let spin = (elsewhere[1].spin - scene.next([force, -force], point)[1].spin).amax();
        prop_assert!(wrong > 0.5 * spin * scene.bodies[1].reach() - 1e-12, "{wrong:e} {spin:e}");
    }

    /// Checks that an exact step conserves linear momentum and angular momentum about the world's
    /// origin, with P⁻(ω) of each body. The tolerance covers rounding of sums of about 10 kg · 5
    /// m/s · 2 m.
    #[test]
    fn an_exact_step_keeps_the_momentum_of_the_pair(cubes in scene(true), any in scene(false)) {
        for scene in [&cubes, &any] {
            let next = scene.next([scene.force, -scene.force], scene.touching_point());
            let dynamics = scene.certify(&scene.world(level_far_below()), &next).dynamics;
            prop_assert!(dynamics < 1e-12, "{dynamics:e}");
            let before = momentum(&scene.bodies, &scene.states);
            let after = momentum(&scene.bodies, &next);
            for kind in 0..2 {
                let change = (after[kind] - before[kind]).amax();
                prop_assert!(change < 1e-12, "{kind}: {change:e}");
            }
        }
    }

    /// Checks that rotating ground, bodies and forces together does not change the certificate. The
    /// parts of the laws are large here, because the force is random. The tolerance covers rounding
    /// of parts of up to 700 m/s.
    #[test]
    fn a_turned_pair_has_the_same_certificate(scene in scene(false), q in quaternion()) {
        let q = q.normalize();
        let next = scene.next([scene.force, -scene.force], scene.touching_point());
        let upright = scene.certify(&scene.world(level_far_below()), &next);
        let ground = Plane::new(rotation(&q) * Vector3::z(), -1000.0).unwrap();
        let other = scene.turned(&q);
        let next = next.map(|state| turned(&state, &q));
        let other = other.certify(&other.world(ground), &next);
        for ((name, a), (_, b)) in upright.parts().into_iter().zip(other.parts()) {
            prop_assert!((a - b).abs() < 1e-11, "{name}: {a:e} {b:e}");
        }
    }

    /// Checks that the response of the touching point is the sum for both bodies. In world axes
    /// each is n·(E/m − [r]× (A I Aᵀ)⁻¹ [r]×) n.
    #[test]
    fn the_response_is_that_of_both_bodies(scene in scene(false)) {
        let (contact, point) = (scene.contact(), scene.touching_point());
        let answer = |axis: Vector3<f64>| -> f64 {
            let one = |(body, state): (&RigidBody, &State)| {
                let turn = rotation(&state.attitude);
                let inertia = turn * body.inertia() * turn.transpose();
                let arm = point - state.position;
                let spin = inertia.lu().solve(&arm.cross(&axis)).unwrap();
                axis.dot(&(axis / body.mass() + spin.cross(&arm)))
            };
            let answers = scene.bodies.iter().zip(&scene.states).map(one);
            answers.sum::<f64>() * scene.bodies[0].mass()
        };
        let [t1, t2, n] = [0, 1, 2].map(|k| answer(contact.frame.column(k).into_owned()));
        let normal = (contact.response.normal / n - 1.0).abs();
        let tangential = (contact.response.tangential / (0.5 * (t1 + t2)) - 1.0).abs();
        prop_assert!(normal < 1e-12 && tangential < 1e-12, "{normal:e}, {tangential:e}");
    }

    /// Checks that two bodies in a common rigid motion do not slip and keep their gap. The
    /// tolerance covers rounding of positions over h. The turn is at most 145°, because at half a
    /// circle the spin of a step is infinite.
    #[test]
    fn bodies_that_move_as_one_do_not_slip(
        scene in scene(false), q in quaternion(), shift in vector(1.0)
    ) {
        let (contact, q) = (scene.contact(), q.normalize());
        prop_assume!(q[0].abs() > 0.3);
        let poses = scene.states.map(|state| state.pose());
        let moved = scene.states.map(|state| {
            let state = turned(&state, &q);
            State { position: state.position + shift, ..state }.pose()
        });
        let u = contact.motion([&poses[0], &moved[0]], Some([&poses[1], &moved[1]]), &STEP);
        let expected = contact.normal() * contact.gap / TIME_STEP;
        prop_assert!((u - expected).amax() < 5e-12, "{u} {expected}");
    }
}

/// Checks that the overlap after a step is the overlap of the shapes. A search that ignores small
/// depths stores only a bound of it.
#[test]
fn the_overlap_after_a_step_is_that_of_the_shapes() {
    let cube = || RigidBody::solid_box(1.0, Vector3::repeat(0.1)).unwrap();
    let world = World::new(Parameters {
        gravity: Vector3::zeros(),
        time_step: TIME_STEP,
        ..Parameters::new(vec![cube(), cube()])
    })
    .unwrap();
    let at = |x: f64, y: f64| State::at_rest(Vector3::new(x, y, 0.1));
    let starts = [at(0.0, 0.0), State { position: Vector3::new(0.01, 0.02, 0.26), ..at(0.0, 0.0) }];
    // A box rotated out of another one: the last axis is not the axis of least overlap.
    let mut candidates = Candidates::new();
    candidates.deepest_overlap(&world, &[at(0.0, 0.0), at(0.198, 0.0)]);
    let next = [at(0.0, 0.0), at(0.150, 0.199)];
    candidates.admit_missed(&world, &starts, &next, 1.0);
    let found = candidates.deepest_overlap(&world, &next).unwrap().0;
    assert!((found - 0.001).abs() < 1e-9, "{found}");
}
