//! What leans and does not slide: a ladder on a wall, a tent of two cards.
//!
//! A ladder of two rails, round ones of radius ρ whose ends are 2L apart, leans at the angle θ
//! to the ground on something that pushes it back along the horizontal alone: a smooth wall,
//! or, in a tent, its mirror image. With the weight m g, the push N at the upper ends, and N
//! of friction under the lower ends, torques about these are
//!
//! ```text
//! N (2L sin θ + ρ) = m g L cos θ
//! ```
//!
//! for the friction acts ρ below them. It holds up to N = μ m g, so that
//!
//! ```text
//! μ (2L sin θ + ρ) ≥ L cos θ
//! ```
//!
//! is needed; tan θ ≥ 1/(2μ) for thin rails. Both are those of a step at rest, whatever h is.

use super::prelude::*;
use crate::world::Fixed;
use nalgebra::Matrix3;

/// L, ρ, and half the way between the rails, m.
const HALF_LENGTH: f64 = 1.0;
const RADIUS: f64 = 0.02;
const HALF_WIDTH: f64 = 0.25;
/// s.
const DURATION: f64 = 0.4;
/// Thresholds are looked for to this share of them.
const RESOLUTION: f64 = 1e-6;
/// It slides if it is this fast, as a share of g times the time.
const SLIDING: f64 = 1e-8;
/// The tent's cards stand at this angle, degrees.
const TENT: f64 = 60.0;
/// Points that press on a ladder: below and above.
const POINTS: f64 = 4.0;

/// The ladder along its own z, its rails at ±y.
fn ladder(mass: f64) -> Result<RigidBody, Unsuitable> {
    let rail = Piece::capsule(HALF_LENGTH, RADIUS)?;
    let placed = |y: f64| rail.moved_by(&Matrix3::identity(), &Vector3::new(0.0, y, 0.0));
    Ok(RigidBody::solid(mass, &[placed(-HALF_WIDTH)?, placed(HALF_WIDTH)?])?.0)
}

/// N/(m g) at the angle θ, rad: the friction that it takes.
fn thrust(angle: f64) -> f64 {
    let (sin, cos) = angle.sin_cos();
    HALF_LENGTH * cos / (2.0 * HALF_LENGTH * sin + RADIUS)
}

/// The angle at which the thrust is μ, rad: of 2L μ sin θ − L cos θ = −μ ρ, with
/// tan β = 1/(2μ), √(4μ² + 1) L sin(θ − β) = −μ ρ.
fn angle_of(friction: f64) -> f64 {
    let lever = HALF_LENGTH * (2.0 * friction).hypot(1.0);
    (0.5 / friction).atan() - (friction * RADIUS / lever).asin()
}

/// Leaning to `side` (1 or −1) at the angle θ on something at x = 0, with its feet on the
/// ground.
fn leaning(angle: f64, side: f64) -> State {
    let (sin, cos) = angle.sin_cos();
    // About y, from upright.
    let (half_sin, half_cos) = (0.5 * (std::f64::consts::FRAC_PI_2 - angle)).sin_cos();
    let mut state = resting(HALF_LENGTH * sin + RADIUS);
    state.position[0] = -side * (HALF_LENGTH * cos + RADIUS);
    state.attitude = Vector4::new(half_cos, 0.0, side * half_sin, 0.0);
    state
}

/// What the residuals allow the force of a step at rest, as a share of the weight. What
/// velocities lack, as a torque, presses with m ℓ²/(L R) ≤ 2 m times it over h; a law that
/// misses δ at a point moves it by as much.
fn force_slack(run: &Run, gravity: f64) -> f64 {
    let lacked = run.largest(|r| r.momentum) + run.largest(|r| r.kinematics);
    let missed = run.largest(|r| r.normal) + run.largest(|r| r.friction);
    2.0 * (lacked + 2.0 * POINTS * missed) / (gravity * run.time_step) + 64.0 * f64::EPSILON
}

/// A ladder that leans on a wall.
pub static LADDER: Posed = Posed {
    name: "ladder",
    about: "A ladder leans on a smooth wall, which pushes with ½ m g cot θ: friction μ on the \
            ground holds it down to tan θ = 1/(2 μ), a little less for its thickness.",
    time_step: 0.005,
    inputs: &[(Input::Mass, 8.0), (Input::Friction, 0.4), EARTH],
    ..Posed::by(ladder_on_wall)
};

/// The push N/(m g), at an angle a third of the way from the threshold to upright, and the
/// threshold.
fn ladder_on_wall(inputs: &Inputs, laboratory: &mut Laboratory<'_>) -> Solved {
    let [mass, friction, gravity] = inputs.all([Input::Mass, Input::Friction, Input::Gravity])?;
    let threshold = angle_of(friction);
    Unsuitable::when(!(0.2..1.5).contains(&threshold), || {
        format!(
            "with mu {friction} the ladder slides below {:.1}°; 12° to 85° is needed",
            threshold.to_degrees()
        )
    })?;
    let half_sides = Vector3::new(0.1, 2.0, 2.0 * HALF_LENGTH);
    let centre = Vector3::new(half_sides[0], 0.0, half_sides[2]);
    let wall = Piece::cuboid(half_sides)?.moved_by(&Matrix3::identity(), &centre)?;
    let setup = |angle: f64| {
        let bodies = vec![Subject::new(ladder(mass)?, leaning(angle, 1.0))];
        Ok::<_, Unsuitable>(Setup {
            fixed: vec![Fixed { piece: wall.clone(), friction: None }],
            frictions: vec![(0, Partner::Fixed(0), 0.0)],
            ..Setup::new(bodies, gravity, friction, DURATION)
        })
    };
    let stands = threshold + (std::f64::consts::FRAC_PI_2 - threshold) / 3.0;
    let (run, pushes) = laboratory.watch(&setup(stands)?, |step| {
        let wall = step.between(0, Partner::Fixed(0));
        wall.map(|contact| contact.normal_force).sum::<f64>() / (mass * gravity)
    })?;
    let expected = thrust(stands);
    let slack = force_slack(&run, gravity);
    let found = Threshold::near(threshold, RESOLUTION * threshold, |angle| {
        let run = laboratory.run(&setup(angle)?)?;
        let stays = run.fastest_at_end() <= SLIDING * gravity * DURATION;
        Ok((stays, 2.0 * force_slack(&run, gravity)))
    })?;
    let astray = (run.end(0).position - leaning(stands, 1.0).position).norm();
    Ok(Findings {
        quantities: vec![
            exactly(("push of the wall", "m g"), pushes[pushes.len() - 1], expected, slack),
            at_most_zero(("way of the ladder", "m"), astray, 4.0 * run.seat() + run.creep()),
            found.beside(("threshold of the angle", "rad"), threshold),
        ],
        curve: run.curve_of_steps(("push of the wall", "m g"), |k| pushes[k]).beside(|_| expected),
    })
}

/// Two cards that lean on each other.
pub static CARD_TENT: Posed = Posed {
    name: "card-tent",
    about: "Two cards lean on each other at 60°, each the other's wall: they stand if friction on \
            the ground is at least ½ cot θ, a little less for their thickness.",
    time_step: 0.005,
    inputs: &[(Input::Mass, 0.5), EARTH],
    bodies: 2,
    ..Posed::by(card_tent)
};

/// By symmetry the cards push each other along the horizontal alone: where they could hold
/// with another force, they could with the mean of it and its mirror image, for a cone is
/// convex. The tent stands with 1.2 times the friction that it takes.
fn card_tent(inputs: &Inputs, laboratory: &mut Laboratory<'_>) -> Solved {
    let (mass, gravity) = (inputs.get(Input::Mass)?, inputs.get(Input::Gravity)?);
    let angle = TENT.to_radians();
    let needed = thrust(angle);
    let setup = |friction: f64| {
        let card = ladder(mass)?;
        let [left, right] =
            [1.0, -1.0].map(|side| Subject::new(card.clone(), leaning(angle, side)));
        Ok::<_, Unsuitable>(Setup::new(vec![left, right], gravity, friction, DURATION))
    };
    let (run, pushes) = laboratory.watch(&setup(1.2 * needed)?, |step| {
        let between = step.between(0, Partner::Body(1));
        between.map(|contact| contact.force[0].abs()).sum::<f64>() / (mass * gravity)
    })?;
    let slack = 2.0 * force_slack(&run, gravity);
    let found = Threshold::near(needed, RESOLUTION * needed, |friction| {
        let run = laboratory.run(&setup(friction)?)?;
        let stays = run.fastest_at_end() <= SLIDING * gravity * DURATION;
        Ok((stays, 2.0 * force_slack(&run, gravity)))
    })?;
    let [left, right] = [(0, 1.0), (1, -1.0)]
        .map(|(index, side)| (run.end(index).position - leaning(angle, side).position).norm());
    Ok(Findings {
        quantities: vec![
            exactly(("push of the cards", "m g"), pushes[pushes.len() - 1], needed, slack),
            at_most_zero(("way of a card", "m"), left.max(right), 8.0 * run.seat() + run.creep()),
            found.beside(("threshold of friction", "1"), needed),
        ],
        curve: run.curve_of_steps(("push of the cards", "m g"), |k| pushes[k]).beside(|_| needed),
    })
}
