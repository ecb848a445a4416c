//! Bodies that lean and do not slide: a ladder on a wall, a tent of two cards.
//!
//! Rails of length 2L and radius ρ stand at the angle θ to the ground. The force N acts
//! horizontally at the upper ends. The rails stick up to N = μ m g:
//!
//! ```text
//! N (2L sin θ + ρ) = m g L cos θ
//! ```

use crate::prelude::*;
use nalgebra::Matrix3;
use std::f64::consts::FRAC_PI_2;

/// L, ρ and half the distance between the rails, m.
const HALF_LENGTH: f64 = 1.0;
const RADIUS: f64 = 0.02;
const HALF_WIDTH: f64 = 0.25;
const DURATION: f64 = 0.4; // s
const TENT: f64 = 60.0; // The angle of the tent's cards, degrees
const POINTS: f64 = 4.0; // Contacts of a ladder, below and above

/// The ladder along its own z, its rails at ±y.
fn ladder(mass: f64) -> Result<RigidBody, Refusal> {
    let rail = Piece::capsule(HALF_LENGTH, RADIUS)?;
    let placed = |y: f64| rail.moved_by(&Matrix3::identity(), &v3(0.0, y, 0.0));
    Ok(RigidBody::solid(mass, &[placed(-HALF_WIDTH)?, placed(HALF_WIDTH)?])?.0)
}

/// N/(m g) at the angle θ (rad): the coefficient of friction that it takes.
fn thrust(angle: f64) -> f64 {
    let (sin, cos) = angle.sin_cos();
    HALF_LENGTH * cos / (2.0 * HALF_LENGTH * sin + RADIUS)
}

/// The angle with the thrust μ, rad: √(4μ² + 1) L sin(θ − β) = −μ ρ, tan β = 1/(2μ).
fn angle_of(friction: f64) -> f64 {
    let lever = HALF_LENGTH * (2.0 * friction).hypot(1.0);
    (0.5 / friction).atan() - (friction * RADIUS / lever).asin()
}

/// Leaning to `side` (1 or −1) at the angle θ on a support at x = 0, with the feet on the ground.
fn leaning(angle: f64, side: f64) -> State {
    let (sin, cos) = angle.sin_cos();
    let place = v3(-side * (HALF_LENGTH * cos + RADIUS), 0.0, HALF_LENGTH * sin + RADIUS);
    State { attitude: about_y(side * (FRAC_PI_2 - angle)), ..at_rest(place) }
}

/// The tolerance of the force of a step at rest, as a share of the weight. The residual of
/// velocities acts as a torque with at most m ℓ²/(L R) ≤ 2 m times it over h. A residual δ of the
/// law at a point changes the force by the same amount.
fn force_tolerance(run: &TestRun, gravity: f64) -> f64 {
    let lacked = run.largest(|r| r.momentum) + run.largest(|r| r.kinematics);
    let missed = run.largest(|r| r.normal) + run.largest(|r| r.friction);
    2.0 * (lacked + 2.0 * POINTS * missed) / (gravity * run.time_step) + 64.0 * f64::EPSILON
}

/// A ladder leans on a smooth wall, which pushes with ½ m g cot θ: friction μ on the ground holds
/// it down to tan θ = 1/(2 μ), a little less for its thickness.
pub(crate) const LADDER: TestProblem = TestProblem {
    name: "ladder",
    time_step: 0.005,
    inputs: &[(Mass, 8.0), (Friction, 0.4), EARTH],
    ..TestProblem::solved_by(ladder_on_wall)
};

/// The force N/(m g) at an angle a third of the range above the threshold, and the threshold.
fn ladder_on_wall(inputs: &TestInputs, runner: &mut Runner<'_>) -> SolvedBy {
    let [mass, friction, gravity] = inputs.all([Mass, Friction, Gravity])?;
    let threshold = angle_of(friction);
    let degrees = threshold.to_degrees();
    let why =
        format!("with mu {friction} the ladder slides below {degrees:.1}°; 12° to 85° is needed");
    Refusal::when(!(0.2..1.5).contains(&threshold), why)?;
    let half_sides = v3(0.1, 2.0, 2.0 * HALF_LENGTH);
    let centre = v3(half_sides[0], 0.0, half_sides[2]);
    let wall = Piece::cuboid(half_sides)?.moved_by(&Matrix3::identity(), &centre)?;
    let setup = |angle: f64| {
        let bodies = vec![Subject::new(ladder(mass)?, leaning(angle, 1.0))];
        Ok(Setup {
            fixed: vec![wall.clone()],
            frictions: vec![(0, Partner::Fixed(0), 0.0)],
            ..Setup::new(bodies, gravity, friction, DURATION)
        })
    };
    let stands = threshold + (FRAC_PI_2 - threshold) / 3.0;
    let (run, pushes) = runner.watch(&setup(stands)?, |step| {
        let wall = step.between(0, Partner::Fixed(0));
        wall.map(|contact| contact.normal_force).sum::<f64>() / (mass * gravity)
    })?;
    let (push, allowed) = (*last(&pushes), force_tolerance(&run, gravity));
    let twice = |run: &TestRun| 2.0 * force_tolerance(run, gravity);
    let found = Threshold::at_rest(runner, threshold, setup, twice)?;
    let still = 4.0 * run.seat() + run.creep();
    Ok(vec![
        equal(("push of the wall", "m g"), push, thrust(stands), allowed),
        at_most_zero(("way of the ladder", "m"), run.moved(0), still),
        found.equals(("threshold of the angle", "rad"), threshold),
    ])
}

/// Two cards lean on each other at 60°, each the other's wall: they stand if friction on the ground
/// is at least ½ cot θ, a little less for their thickness.
pub(crate) const CARD_TENT: TestProblem = TestProblem {
    name: "card-tent",
    time_step: 0.005,
    inputs: &[(Mass, 0.5), EARTH],
    bodies: 2,
    ..TestProblem::solved_by(card_tent)
};

/// The cards act on each other only horizontally, because of the symmetry, each like the ladder's
/// wall. The tent stands with 1.2 times the required friction.
fn card_tent(inputs: &TestInputs, runner: &mut Runner<'_>) -> SolvedBy {
    let [mass, gravity] = inputs.all([Mass, Gravity])?;
    let angle = TENT.to_radians();
    let needed = thrust(angle);
    let setup = |friction: f64| {
        let card = ladder(mass)?;
        let sides = [1.0, -1.0].map(|side| Subject::new(card.clone(), leaning(angle, side)));
        Ok(Setup::new(sides.to_vec(), gravity, friction, DURATION))
    };
    let (run, pushes) = runner.watch(&setup(1.2 * needed)?, |step| {
        let between = step.between(0, Partner::Body(1));
        between.map(|contact| contact.force[0].abs()).sum::<f64>() / (mass * gravity)
    })?;
    let twice = |run: &TestRun| 2.0 * force_tolerance(run, gravity);
    let found = Threshold::at_rest(runner, needed, setup, twice)?;
    let (way, still) = (run.moved(0).max(run.moved(1)), 8.0 * run.seat() + run.creep());
    Ok(vec![
        equal(("push of the cards", "m g"), *last(&pushes), needed, twice(&run)),
        at_most_zero(("way of a card", "m"), way, still),
        found.equals(("threshold of friction", "1"), needed),
    ])
}
