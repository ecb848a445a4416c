//! Rolling: a touching point that moves over its body. Motion of second order against closed forms and
//! conserved energies, with the default integrator.

use crate::common::prelude::*;
use nalgebra::Vector2;
use tumble_core::simulation::energy;

const G: f64 = 9.81;

fn world(bodies: Vec<RigidBody>, ground: Option<Plane>, friction: f64, time_step: f64) -> World {
    let gravity = Vector3::new(0.0, 0.0, -G);
    let rotation = Rotation::Momentum;
    World::new(Parameters { bodies, ground, gravity, friction, time_step, rotation }).unwrap()
}

fn state(position: [f64; 3], velocity: [f64; 3], spin: [f64; 3]) -> State {
    State { velocity: velocity.into(), spin: spin.into(), ..State::at_rest(position) }
}

/// Smooth body of 1 kg whose surface touches the level ground at c − S u, u = Sᵀ n/|Sᵀ n|, relative to its centre of
/// mass (m, body frame).
struct Smooth {
    inertia: Matrix3<f64>,
    axes: Matrix3<f64>,
    centre: Vector3<f64>,
    /// Without slip; otherwise without friction.
    sticks: bool,
}

impl Smooth {
    /// Normal of the ground n, point of touch ρ, and its velocity in the body ρ' at the spin ω (body frame).
    fn touch(&self, turn: &Matrix3<f64>, spin: &Vector3<f64>) -> [Vector3<f64>; 3] {
        let normal = turn.transpose().column(2).into_owned();
        let (toward, rate) = (self.axes.tr_mul(&normal), self.axes.tr_mul(&normal.cross(spin)));
        let (width, unit) = (toward.norm(), toward.normalize());
        let moved = self.axes * (rate - unit * unit.dot(&rate)) / width;
        [normal, self.centre - self.axes * unit, -moved]
    }

    /// State of touch at the `attitude` with the `spin`, above the origin and without motion across.
    fn start(&self, attitude: Vector4<f64>, spin: Vector3<f64>) -> State {
        let turn = rotation(&attitude);
        let [normal, point, _] = self.touch(&turn, &spin);
        let mut velocity = turn * point.cross(&spin);
        if !self.sticks {
            velocity = Vector3::z() * velocity.z;
        }
        State { position: -Vector3::z() * normal.dot(&point), attitude, velocity, spin }
    }

    /// Rates of a state in contact. Without slip the velocity is v = −ω × ρ, and the force
    /// m (v' + g n) at ρ turns the body. Without friction the force is along n.
    fn rates(&self, state: &State) -> State {
        let turn = rotation(&state.attitude);
        let spin = state.spin;
        let [normal, point, moved] = self.touch(&turn, &spin);
        let rolling = point.cross(&spin);
        // v' = known − ω' × ρ in the body.
        let known = spin.cross(&rolling) - spin.cross(&moved);
        let gyration = -spin.cross(&(self.inertia * spin));
        let (matrix, torque) = if self.sticks {
            let load = known + G * normal;
            let arm = point.cross_matrix();
            (self.inertia - arm * arm, gyration + point.cross(&load))
        } else {
            let arm = point.cross(&normal);
            let load = normal.dot(&known) + G;
            (self.inertia + arm * arm.transpose(), gyration + arm * load)
        };
        let change = matrix.try_inverse().unwrap() * torque;
        let quaternion = Vector4::new(0.0, spin.x, spin.y, spin.z);
        let mut velocity = turn * rolling;
        if !self.sticks {
            velocity = Vector3::new(state.velocity.x, state.velocity.y, velocity.z);
        }
        State {
            position: velocity,
            attitude: 0.5 * left(&state.attitude) * quaternion,
            velocity: Vector3::zeros(),
            spin: change,
        }
    }

    /// States at the multiples of `every` (s) up to `seconds`, by the Runge–Kutta method of fourth order.
    fn motion(&self, start: State, every: f64, seconds: f64) -> Vec<State> {
        let parts = (every / 1e-4).round() as usize;
        let h = every / parts as f64;
        let moved = |state: &State, by: f64, rates: &State| State {
            position: state.position + by * rates.position,
            attitude: state.attitude + by * rates.attitude,
            velocity: state.velocity,
            spin: state.spin + by * rates.spin,
        };
        let mut state = start;
        (0..(seconds / every).round() as usize)
            .map(|_| {
                for _ in 0..parts {
                    let first = self.rates(&state);
                    let second = self.rates(&moved(&state, 0.5 * h, &first));
                    let third = self.rates(&moved(&state, 0.5 * h, &second));
                    let fourth = self.rates(&moved(&state, h, &third));
                    for (rates, share) in [(first, 1.0), (second, 2.0), (third, 2.0), (fourth, 1.0)]
                    {
                        state = moved(&state, share * h / 6.0, &rates);
                    }
                    state.attitude.normalize_mut();
                }
                state
            })
            .collect()
    }

    /// Body with this inertia, whose `piece` has its origin at the centre of mass.
    fn body(&self, piece: &Piece, origin: Vector3<f64>) -> RigidBody {
        let piece = piece.moved_by(&Matrix3::identity(), &origin).unwrap();
        RigidBody::from_pieces(1.0, self.inertia, vec![piece]).unwrap()
    }

    /// Kinetic and potential energy (J).
    fn energy(&self, state: &State) -> f64 {
        0.5 * state.velocity.norm_squared()
            + 0.5 * state.spin.dot(&(self.inertia * state.spin))
            + G * state.position.z
    }
}

/// States of a run in which every step is solved as a whole.
fn states(world: World, start: State, seconds: f64) -> Vec<State> {
    let motion = Motion::native(&world);
    let steps = (seconds / world.time_step()).round() as usize;
    let mut simulation = Simulation::new(world, [start], motion).unwrap();
    let mut record = StepRecord::new();
    (0..steps)
        .map(|k| {
            simulation.step(&mut record).unwrap();
            let status = record.status();
            assert!(
                [StepStatus::Converged, StepStatus::Retried].contains(&status),
                "{k}: {status:?}"
            );
            simulation.states()[0]
        })
        .collect()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

fn about(axis: Vector3<f64>, degrees: f64) -> Vector4<f64> {
    let (sine, cosine) = (0.5 * degrees.to_radians()).sin_cos();
    let axis = axis.normalize() * sine;
    Vector4::new(cosine, axis.x, axis.y, axis.z)
}

fn diagonal(x: f64, y: f64, z: f64) -> Matrix3<f64> {
    Matrix3::from_diagonal(&Vector3::new(x, y, z))
}

fn ellipsoid(half_axes: [f64; 3]) -> Piece {
    Piece::ellipsoid(half_axes.into(), 24).unwrap()
}

/// A rattleback: an ellipsoid with a low centre of mass, and axes of inertia that are turned by 5° about its vertical.
fn rattleback() -> (Smooth, RigidBody) {
    let turn = rotation(&about(Vector3::z(), 5.0));
    let smooth = Smooth {
        inertia: turn * diagonal(2e-4, 1.6e-3, 1.7e-3) * turn.transpose(),
        axes: diagonal(0.2, 0.05, 0.05),
        centre: Vector3::z() * 0.03,
        sticks: true,
    };
    let body = smooth.body(&ellipsoid([0.2, 0.05, 0.05]), smooth.centre);
    (smooth, body)
}

/// Smooth bodies that roll without slip, and one without friction, move as their equations say, to second order.
#[test]
fn smooth_bodies_roll_as_their_equations_say() {
    let disc = |radius: f64| diagonal(radius, radius, 0.0);
    let solid = |length: f64, radius: f64| {
        let across = (3.0 * radius * radius + length * length) / 12.0;
        diagonal(across, across, 0.5 * radius * radius)
    };
    let case = |name, inertia, axes, centre: [f64; 3], sticks| {
        (name, Smooth { inertia, axes, centre: centre.into(), sticks })
    };
    let flat = diagonal(1.78e-3, 2.5e-3, 3.28e-3);
    let long = diagonal(0.1, 0.08, 0.05);
    let coin = case("coin", solid(0.02, 0.1), disc(0.1), [0.0, 0.0, -0.01], true);
    let spinning =
        case("spinning disc", solid(0.0, 0.0375), disc(0.0375), [0.0, 0.0, -2.5e-4], true);
    let cylinder = case("cylinder", solid(0.1, 0.05), disc(0.05), [0.0, 0.0, -0.05], true);
    let cone = diagonal(7.8e-4, 7.8e-4, 1.08e-3);
    let cone = case("cone", cone, disc(0.06), [0.0, 0.0, -0.02], true);
    let egg = diagonal(4e-4, 4e-4, 2e-4);
    let egg = case("egg", egg, diagonal(0.03, 0.03, 0.045), [0.0, 0.0, 0.005], true);
    let rolling = case("ellipsoid", flat, long, [0.0; 3], true);
    let smooth = case("ellipsoid without friction", flat, long, [0.0; 3], false);
    let (x, y) = (Vector3::x(), Vector3::y());
    let z = Vector3::z();
    let none = Vector3::zeros();
    let half_height = 0.04;
    // Shape with its origin, attitude, spin, and the largest error with 2 ms (m).
    let cases = [
        (coin, Piece::cylinder(0.01, 0.1, 48), none, about(y, 70.0), [-0.47, 0.0, 12.0], 3e-4),
        // Euler's disc at a tilt of 0.3 rad, whose centre rests: 4 g/(r sin 0.3) is the square of its precession.
        (
            spinning,
            Piece::cylinder(2.5e-4, 0.0375, 48),
            none,
            about(y, 0.3_f64.to_degrees()),
            [-17.585, 0.0, 0.0],
            3e-4,
        ),
        (cylinder, Piece::cylinder(0.05, 0.05, 24), none, about(y, -18.0), [0.0, 0.5, 9.0], 3e-4),
        (
            cone,
            Piece::cone(half_height, 0.06, 24),
            z * 0.02,
            about(y, 25.0),
            [0.3, 0.0, 12.0],
            2e-3,
        ),
        (egg, Ok(ellipsoid([0.03, 0.03, 0.045])), z * 0.005, about(y, 60.0), [0.0, 8.0, 1.0], 3e-5),
        (
            rolling,
            Ok(ellipsoid([0.1, 0.08, 0.05])),
            none,
            about(x + y, 30.0),
            [4.0, 3.0, 6.0],
            5e-5,
        ),
        (smooth, Ok(ellipsoid([0.1, 0.08, 0.05])), none, about(x + y, 30.0), [4.0, 3.0, 6.0], 6e-5),
    ];
    const EVERY: f64 = 0.04;
    for ((name, smooth), piece, origin, attitude, spin, most) in cases {
        let start = smooth.start(attitude, spin.into());
        let body = smooth.body(&piece.unwrap(), origin);
        let expected = smooth.motion(start, EVERY, 1.0);
        let off = [0.002, 0.001].map(|h| {
            let friction = if smooth.sticks { 10.0 } else { 0.0 };
            let world = world(vec![body.clone()], Some(Plane::level()), friction, h);
            let found = states(world, start, 1.0);
            let each = (EVERY / h).round() as usize;
            let rows = found.iter().skip(each - 1).step_by(each);
            let apart = rows.zip(&expected).map(|(a, b)| (a.position - b.position).norm());
            apart.fold(0.0, f64::max)
        });
        assert!(off[0] <= most && off[1] <= 0.35 * off[0], "{name}: {off:?}");
    }
}

/// A rattleback turns back twice in 12 s, when its equations say.
#[test]
fn a_rattleback_turns_back() {
    const H: f64 = 0.002;
    let (smooth, body) = rattleback();
    let start = smooth.start(about(Vector3::y(), 1.0), Vector3::new(0.02, 0.0, -2.0));
    let world = world(vec![body], Some(Plane::level()), 10.0, H);
    let found = states(world, start, 12.0);
    let expected = smooth.motion(start, H, 12.0);
    // Means over 0.1 s of the spin about the vertical.
    let means = |states: &[State]| -> Vec<f64> {
        let upright: Vec<_> =
            states.iter().map(|state| (rotation(&state.attitude) * state.spin).z).collect();
        upright.chunks(50).map(mean).collect()
    };
    let [found, expected] = [means(&found), means(&expected)];
    let turns = |spins: &[f64]| -> Vec<usize> {
        (1..spins.len()).filter(|&k| spins[k - 1] * spins[k] < 0.0).collect()
    };
    let (at, should) = (turns(&found), turns(&expected));
    assert!(should.len() == 2 && at.len() == 2, "{at:?} {should:?}");
    assert!(at.iter().zip(&should).all(|(a, b)| a.abs_diff(*b) <= 1), "{at:?} {should:?}");
    for (a, b) in found.iter().zip(&expected) {
        assert!((a - b).abs() <= 0.02 * 2.0, "{a} {b}");
    }
}

/// An ellipsoid rocks on level ground, without friction and without slip. Nothing takes energy, for 48 swings.
/// The mean over many swings differs from the first energy by an error of second order.
#[test]
fn a_rocking_ellipsoid_keeps_its_energy() {
    let piece = ellipsoid([0.1, 0.03, 0.02]);
    for sticks in [false, true] {
        let smooth = Smooth {
            inertia: diagonal(2e-4, 1.6e-3, 1.7e-3),
            axes: diagonal(0.1, 0.03, 0.02),
            centre: Vector3::zeros(),
            sticks,
        };
        let body = smooth.body(&piece, Vector3::zeros());
        let start = smooth.start(about(Vector3::y(), 0.1_f64.to_degrees()), Vector3::zeros());
        let first = smooth.energy(&start) - G * 0.02;
        let off = [0.002, 0.001, 0.0005].map(|h| {
            let friction = if sticks { 10.0 } else { 0.0 };
            let world = world(vec![body.clone()], Some(Plane::level()), friction, h);
            let found = states(world, start, 4.0);
            let found: Vec<_> = found.iter().map(|state| smooth.energy(state) - G * 0.02).collect();
            let fifth = found.len() / 5;
            let (early, late) = (mean(&found[..fifth]), mean(&found[4 * fifth..]));
            assert!((late - early).abs() <= 1e-3 * first, "{sticks} {h}: {early} {late}");
            late - first
        });
        let falls = off.is_sorted_by(|a, b| b.abs() <= 0.35 * a.abs());
        assert!(off[0].abs() <= 8e-3 * first && falls, "{sticks}: {off:?}");
    }
}

/// An ellipsoid rocks on a fixed ball, with and without slip. The planes of two curved surfaces leave a gap, and are
/// those of the start of each step. The motion is of second order.
#[test]
fn an_ellipsoid_rocks_on_a_ball() {
    let smooth = Smooth {
        inertia: diagonal(2e-4, 1.6e-3, 1.7e-3),
        axes: diagonal(0.1, 0.03, 0.02),
        centre: Vector3::zeros(),
        sticks: true,
    };
    let body = smooth.body(&ellipsoid([0.1, 0.03, 0.02]), Vector3::zeros());
    let upright = Vector4::new(1.0, 0.0, 0.0, 0.0);
    let start = smooth.start(upright, Vector3::y() * 1.5);
    let ball = Piece::sphere(0.2).unwrap();
    let ball = ball.moved_by(&Matrix3::identity(), &(-0.2 * Vector3::z())).unwrap();
    for friction in [0.0, 10.0] {
        let ends = [0.002, 0.001, 0.00025].map(|h| {
            let fixed = vec![ball.clone()];
            let world = world(vec![body.clone()], None, friction, h).with_fixed(fixed);
            *states(world, start, 0.5).last().unwrap()
        });
        let off = [0, 1].map(|k| (ends[k].position - ends[2].position).norm());
        assert!(off[0] <= 1e-5 && off[1] <= 0.3 * off[0], "{friction}: {off:?}");
    }
}

/// A disc rolls on its rim without slip, leaning by 20°. The energy of 2 s differs by an error of second order.
#[test]
fn a_rolling_disc_keeps_its_energy() {
    let radius = 0.1;
    let half_width = 0.01;
    let spin = 12.0;
    let (sine, cosine) = 20.0_f64.to_radians().sin_cos();
    let axis = Vector3::new(cosine, 0.0, sine);
    let touched = -half_width * axis - radius * Vector3::new(-sine, 0.0, cosine);
    let half = 35.0_f64.to_radians();
    let start = State {
        attitude: Vector4::new(half.cos(), 0.0, half.sin(), 0.0),
        velocity: -(spin * axis).cross(&touched),
        ..state([0.0, 0.0, -touched.z], [0.0; 3], [0.0, 0.0, spin])
    };
    let piece = Piece::cylinder(half_width, radius, 48).unwrap();
    let body = RigidBody::solid(1.0, &[piece]).unwrap().0;
    let off = [0.002, 0.001].map(|h| {
        let world = world(vec![body.clone()], Some(Plane::level()), 10.0, h);
        let first = energy::total(&world, &[start]);
        let found = states(world.clone(), start, 2.0);
        let found: Vec<_> = found.iter().map(|state| energy::total(&world, &[*state])).collect();
        (mean(&found[found.len() * 4 / 5..]) - first).abs() / first
    });
    assert!(off[0] <= 1e-4 && off[1] <= 0.5 * off[0], "{off:?}");
}

/// A ball rolls on a turntable that turns at W: its velocity turns at 2/7 W, so that it runs along a circle.
#[test]
fn a_ball_rolls_on_a_turntable_along_a_circle() {
    const TURN: f64 = 2.0;
    let off = [0.01, 0.005, 0.0025].map(|h| {
        let table = Piece::cylinder(0.05, 4.0, 64).unwrap();
        let table = RigidBody::solid(100.0, &[table]).unwrap().0;
        let ball = RigidBody::solid(0.1, &[Piece::sphere(0.05).unwrap()]).unwrap().0;
        let motor = Motor::Speed { target: TURN, max_force: 1e6 };
        let frames =
            [JointFrame::at(Vector3::zeros()), JointFrame::at(Vector3::new(0.0, 0.0, -0.05))];
        let hinge = Joint::revolute(0, None, frames, Drive { motor: Some(motor), ..Drive::NONE });
        let world = world(vec![table, ball], None, 2.0, h).with_joints(vec![hinge]).unwrap();
        let starts = [
            state([0.0, 0.0, -0.05], [0.0; 3], [0.0, 0.0, TURN]),
            // Without slip: v + ω × (−r e_z) = W × p.
            state([0.5, 0.0, 0.05], [0.0, 0.3, 0.0], [14.0, 0.0, 0.0]),
        ];
        let motion = Motion::native(&world);
        let mut simulation = Simulation::new(world, starts, motion).unwrap();
        for _ in 0..(1.0 / h).round() as usize {
            simulation.step(&mut StepRecord::new()).unwrap();
        }
        // v' = (2/7) W × v.
        let rate = 2.0 / 7.0 * TURN;
        let expected = [0.5 - 0.3 / rate * (1.0 - rate.cos()), 0.3 / rate * rate.sin()];
        let found = simulation.states()[1].position;
        (found.x - expected[0]).hypot(found.y - expected[1])
    });
    assert!(off[0] <= 4e-4, "{off:?}");
    assert!(off[1] <= 0.3 * off[0] && off[2] <= 0.3 * off[1], "{off:?}");
}

/// A ball rolls across a slope against a moment, which turns with it:
///
/// ```text
/// v' = 5/7 (g sin α e − (μ_r/r) g cos α v/|v|)
/// ```
#[test]
fn a_ball_rolls_across_a_slope_against_a_moment() {
    const RADIUS: f64 = 0.1;
    const LEVER: f64 = 0.01;
    let (sine, cosine) = 15.0_f64.to_radians().sin_cos();
    let share = 5.0 / 7.0;
    // Plane motion by the Runge–Kutta method: place and velocity.
    let rates = |at: [Vector2<f64>; 2]| {
        let down = Vector2::x() * sine - at[1].normalize() * (LEVER / RADIUS * cosine);
        [at[1], share * G * down]
    };
    let moved = |at: [Vector2<f64>; 2], by: f64, rates: [Vector2<f64>; 2]| {
        [0, 1].map(|k| at[k] + by * rates[k])
    };
    let mut expected = [Vector2::zeros(), Vector2::y()];
    let h = 1e-3;
    for _ in 0..400 {
        let first = rates(expected);
        let second = rates(moved(expected, 0.5 * h, first));
        let third = rates(moved(expected, 0.5 * h, second));
        let fourth = rates(moved(expected, h, third));
        for (share, rates) in [(1.0, first), (2.0, second), (2.0, third), (1.0, fourth)] {
            expected = moved(expected, share * h / 6.0, rates);
        }
    }
    let off = [0.005, 0.0025].map(|h| {
        let ball = RigidBody::solid(1.0, &[Piece::sphere(RADIUS).unwrap()]).unwrap().0;
        let world = World::new(Parameters {
            bodies: vec![ball],
            ground: Some(Plane::level()),
            gravity: Vector3::new(G * sine, 0.0, -G * cosine),
            friction: 1.0,
            time_step: h,
            rotation: Rotation::Momentum,
        });
        let world = world.unwrap().with_coefficient(Coefficient::RollingFriction, LEVER).unwrap();
        let start = state([0.0, 0.0, RADIUS], [0.0, 1.0, 0.0], [-1.0 / RADIUS, 0.0, 0.0]);
        let end = *states(world, start, 0.4).last().unwrap();
        (end.position.xy() - expected[0]).norm()
    });
    assert!(off[0] <= 1e-4 && off[1] <= 0.3 * off[0], "{off:?}");
}
