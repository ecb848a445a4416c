//! Friction that turns a motion back: order 2 at fixed time steps, against closed forms and integrations of
//! smooth pieces.

use crate::leapfrog::{NO_GROUND, simulation};
use tumble::{State, StepRecord};
use tumble_core::simulation::EnergyBalance;

const G: f64 = 9.81;

/// Coordinates and velocities.
type Motion = [f64; 4];

/// Integrates `rate`, a function of the motion and the direction of the slip, up to `time` (s), from turn to
/// turn of the `slip`.
fn reference(
    start: Motion,
    time: f64,
    rate: impl Fn(&Motion, f64) -> Motion,
    slip: impl Fn(&Motion) -> f64,
) -> Motion {
    const H: f64 = 1e-4;
    let advanced = |y: &Motion, sign: f64, h: f64| {
        let moved = |y: &Motion, k: &Motion, h: f64| std::array::from_fn(|i| y[i] + h * k[i]);
        let k1 = rate(y, sign);
        let k2 = rate(&moved(y, &k1, 0.5 * h), sign);
        let k3 = rate(&moved(y, &k2, 0.5 * h), sign);
        let k4 = rate(&moved(y, &k3, h), sign);
        std::array::from_fn(|i| y[i] + h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]))
    };
    let (mut y, mut t) = (start, 0.0);
    let mut sign = match slip(&y) {
        0.0 => -slip(&rate(&y, 0.0).map(|rate| -rate)).signum(),
        slip => slip.signum(),
    };
    while t < time - 1e-12 {
        let h = H.min(time - t);
        let next: Motion = advanced(&y, sign, h);
        if slip(&next) * sign >= 0.0 {
            (y, t) = (next, t + h);
            continue;
        }
        let mut range = [0.0, h];
        for _ in 0..60 {
            let middle = 0.5 * (range[0] + range[1]);
            let is_before = slip(&advanced(&y, sign, middle)) * sign >= 0.0;
            range[usize::from(!is_before)] = middle;
        }
        (y, t) = (advanced(&y, sign, range[1]), t + range[1]);
        sign = -sign;
    }
    y
}

/// State of the last body of `text` after each step of `h` (s) up to `time` (s). Every step is solved, and no
/// step gains energy.
fn last_states(text: &str, h: f64, time: f64) -> Vec<State> {
    let mut simulation = simulation(text, h);
    let mut record = StepRecord::new();
    let steps = (time / h).round() as u64;
    let all = (0..steps).map(|k| {
        simulation.step(&mut record).unwrap();
        assert!(record.status().is_one_problem(), "k = {k}: {:?}", record.status());
        assert!(record.gain().is_none(), "k = {k}: {:?}", record.gain());
        *simulation.states().last().unwrap()
    });
    all.collect()
}

/// The largest error of a coordinate and of its velocity after `time`, over these starts.
fn error(
    h: f64,
    starts: &[f64],
    time: f64,
    scene: impl Fn(f64) -> String,
    exact: impl Fn(f64) -> [f64; 2],
    found: impl Fn(&State) -> [f64; 2],
) -> [f64; 2] {
    let errors = starts.iter().map(|start| {
        let states = last_states(&scene(*start), h, time);
        let pair = [found(states.last().unwrap()), exact(*start)];
        [0, 1].map(|k| (pair[0][k] - pair[1][k]).abs())
    });
    errors.fold([0.0; 2], |most, error| [0, 1].map(|k| f64::max(most[k], error[k])))
}

/// Asserts that the errors at 8 and at 2 ms differ by an order of at least 1.7, and are at most `most` at 2 ms.
fn assert_order(error: impl Fn(f64) -> [f64; 2], most: f64) {
    let errors = [0.008, 0.004, 0.002].map(&error);
    for k in 0..2 {
        let order = 0.5 * (errors[0][k] / errors[2][k]).log2();
        assert!(errors[2][k] <= most, "{errors:?}");
        assert!(order >= 1.7 || errors[0][k] <= 1e-9, "{k}: {order}, {errors:?}");
    }
}

const STARTS: [f64; 8] = [1.0, 1.013, 1.027, 1.039, 1.052, 1.066, 1.079, 1.091];

/// A block up a slope and back.
#[test]
fn a_block_turns_on_a_slope() {
    let (sine, cosine) = 0.5f64.sin_cos();
    let scene = |speed: f64| {
        format!(
            "gravity = [{}, 0, {}]\n[ground]\nfriction = 0.3\n[[bodies]]\nname = \"b\"\nbox = [0.4, 0.4, 0.1]\nmass = 2.0\n\
             position = [0, 0, 0.05]\nvelocity = [{speed}, 0, 0]\n",
            -G * sine,
            -G * cosine
        )
    };
    let exact = |speed: f64| {
        let [up, down] = [1.0, -1.0].map(|sign| G * (sine + sign * 0.3 * cosine));
        let left = 0.4 - speed / up;
        [0.5 * speed * speed / up - 0.5 * down * left * left, -down * left]
    };
    let found = |state: &State| [state.position.x, state.velocity.x];
    assert_order(|h| error(h, &STARTS, 0.4, scene, exact, found), 2e-5);
}

/// A block on a spring that slides over the ground to and fro.
#[test]
fn a_block_turns_on_a_spring() {
    let scene = |stretch: f64| {
        format!(
            "[ground]\nfriction = 0.1\n[[bodies]]\nname = \"b\"\nbox = [0.4, 0.4, 0.1]\nmass = 2.0\n\
             position = [{}, 0, 0.05]\n[[joints]]\nname = \"s\"\ntype = \"free\"\nbodies = \"b\"\nanchor_a = [0, 0, 0]\n\
             anchor_b = [0, 0, 0.05]\nx = {{ stiffness = 50.0 }}\n",
            0.5 * stretch
        )
    };
    let rate = |y: &Motion, sign: f64| [y[1], -25.0 * y[0] - 0.1 * G * sign, 0.0, 0.0];
    let exact = |stretch: f64| {
        let end = reference([0.5 * stretch, 0.0, 0.0, 0.0], 1.6, rate, |y| y[1]);
        [end[0], end[1]]
    };
    let found = |state: &State| [state.position.x, state.velocity.x];
    assert_order(|h| error(h, &STARTS, 1.6, scene, exact, found), 2e-4);
}

/// A pendulum whose hinge has dry friction.
#[test]
fn a_pendulum_with_dry_friction_turns() {
    let scene = |angle: f64| {
        format!(
            "{NO_GROUND}[[bodies]]\nname = \"ball\"\nsphere = 0.1\nmass = 1.0\nposition = [{}, 0, {}]\n\
             [[joints]]\nname = \"hinge\"\ntype = \"revolute\"\nbodies = \"ball\"\nanchor = [0, 0, 0]\naxis = [0, 1, 0]\n\
             friction = 0.3\n",
            -0.5 * angle.sin(),
            -0.5 * angle.cos()
        )
    };
    let inertia = 0.25 + 0.4 * 0.01;
    let rate =
        |y: &Motion, sign: f64| [y[1], -(G * 0.5 * y[0].sin() + 0.3 * sign) / inertia, 0.0, 0.0];
    let exact = |angle: f64| {
        let end = reference([angle, 0.0, 0.0, 0.0], 2.0, rate, |y| y[1]);
        [end[0], end[1]]
    };
    let found = |state: &State| [(-state.position.x).atan2(-state.position.z), state.spin.y];
    assert_order(|h| error(h, &STARTS, 2.0, scene, exact, found), 2e-4);
}

/// A block on a heavy plate that swings on a spring: it slides to and fro without sticking.
#[test]
fn a_block_turns_on_a_swinging_plate() {
    let scene = |stretch: f64| {
        format!(
            "[ground]\nnone = true\nfriction = 0.3\n\
             [[bodies]]\nname = \"plate\"\nbox = [4, 4, 0.2]\nmass = 50.0\nposition = [{stretch}, 0, -0.1]\n\
             [[joints]]\nname = \"rail\"\ntype = \"prismatic\"\nbodies = \"plate\"\nanchor_a = [0, 0, 0]\nanchor_b = [0, 0, -0.1]\n\
             axis = [1, 0, 0]\nstiffness = 2000.0\n\
             [[bodies]]\nname = \"b\"\nbox = [0.4, 0.4, 0.1]\nmass = 2.0\nposition = [{stretch}, 0, 0.05]\n"
        )
    };
    let friction = 0.3 * G;
    let rate = |y: &Motion, sign: f64| {
        [y[1], -40.0 * y[0] + friction * sign / 25.0, y[3], -friction * sign]
    };
    let exact = |stretch: f64| {
        let end = reference([stretch, 0.0, stretch, 0.0], 1.6, rate, |y| y[3] - y[1]);
        [end[2], end[3]]
    };
    let found = |state: &State| [state.position.x, state.velocity.x];
    assert_order(|h| error(h, &STARTS, 1.6, scene, exact, found), 2e-4);
}

/// A divided step has the energies, works and status of its intervals, which add up, and can be taken back.
#[test]
fn a_divided_step_is_whole() {
    let text = format!(
        "gravity = [{}, 0, {}]\n[ground]\nfriction = 0.3\n[[bodies]]\nname = \"b\"\nbox = [0.4, 0.4, 0.1]\nmass = 2.0\n\
         position = [0, 0, 0.05]\nvelocity = [1, 0, 0]\n",
        -G * 0.5f64.sin(),
        -G * 0.5f64.cos()
    );
    let mut simulation = simulation(&text, 0.004);
    let mut record = StepRecord::new();
    let mut divided = 0;
    for k in 0..60 {
        let before = simulation.states().to_vec();
        let energy = simulation.energy();
        simulation.step(&mut record).unwrap();
        let world = simulation.world();
        let sum: f64 = record
            .intervals()
            .iter()
            .flat_map(|taken| EnergyBalance::terms(&taken.balance(&taken.world(world))))
            .sum();
        let change = simulation.energy() - energy;
        assert!((sum - change).abs() <= 1e-12, "k = {k}: {sum} {change}");
        if record.is_divided() {
            divided += 1;
            let after = simulation.states().to_vec();
            simulation.take_back(&record);
            assert_eq!(simulation.states(), before);
            simulation.step(&mut record).unwrap();
            assert_eq!(simulation.states(), after);
        }
    }
    assert_eq!(divided, 1);
}
