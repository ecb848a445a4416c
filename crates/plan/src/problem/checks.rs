//! Checks of the parts of a problem.

use crate::PlanError;
use crate::control::{Control, ControlKind, PushControl};
use crate::target::FARTHEST;
use tumble_core::joint::JointAxis;
use tumble_core::world::constants::extents;
use tumble_core::world::{Constant, World};

/// Constants that can be controls: those with a field of their own in a scene's model.
const CONSTANTS: [Constant; 6] = [
    Constant::Friction,
    Constant::Restitution,
    Constant::Mass,
    Constant::Inertia,
    Constant::Gravity,
    Constant::Ground,
];

pub(super) fn bad_input<T>(why: String) -> Result<T, PlanError> {
    Err(PlanError::Problem(why))
}

/// True if both controls set the same start or constant. Forces add up instead.
pub(super) fn sets_alike(a: &Control, b: &Control) -> bool {
    a.kind.is_of_the_run() && a.kind == b.kind
}

pub(super) fn has_body(of: &str, name: &str, body: usize, bodies: usize) -> Result<(), PlanError> {
    check_body(body, bodies).or_else(|why| bad_input(format!("{of} {name:?}: {why}")))
}

fn check_body(body: usize, bodies: usize) -> Result<(), String> {
    if body < bodies {
        return Ok(());
    }
    Err(format!("body {body} does not exist; allowed: 0 to {}", bodies - 1))
}

pub(super) fn check_control(control: &Control, world: &World, steps: usize) -> Result<(), String> {
    let Control { kind, bounds, knots, effort, .. } = control;
    if let Some(body) = kind.body() {
        check_body(body, world.bodies().len())?;
    }
    // Bounds, knots and effort
    let components = kind.components();
    if bounds.len() != components.len() {
        let (count, wanted) = (bounds.len(), components.len());
        return Err(format!("{count} bounds are given; {wanted} are needed"));
    }
    for (component, [low, high]) in components.iter().zip(bounds) {
        if !(low.is_finite() && high.is_finite() && low <= high) {
            let why = format!("the bounds are {low} to {high}; two numbers in order are needed");
            return Err(format!("{component}: {why}"));
        }
    }
    let most = if kind.is_of_the_run() { 1 } else { steps };
    if !(1..=most).contains(knots) {
        return Err(format!("knots is {knots}; allowed: 1 to {most}"));
    }
    if !(*effort >= 0.0 && effort.is_finite()) {
        return Err(format!("effort is {effort}; allowed: 0 or more"));
    }
    match kind {
        ControlKind::Push(push) => {
            if let [low, _] = bounds[0]
                && low < 0.0
            {
                let why = format!("normal: its lower end is {low}; allowed: 0 N or more");
                return Err(why.to_owned());
            }
            // A push acts at a point of a face, in a frame along its normal.
            let frame = &push.frame;
            let apart = (frame.transpose() * frame - nalgebra::Matrix3::identity()).amax();
            if !(apart < 1e-9 && frame.determinant() > 0.0) {
                let why = "its frame is not a rotation; three orthogonal, right-handed unit \
                           vectors are needed";
                return Err(why.to_owned());
            }
            if !push.point.iter().all(|x| x.abs() <= FARTHEST) {
                let [x, y, z]: [f64; 3] = push.point.into();
                let why = format!("at is [{x:?}, {y:?}, {z:?}]; allowed: -1e6 to 1e6 m");
                return Err(why.to_owned());
            }
            // The point has to be on the body for all offsets.
            check_reach(push, &bounds[3..], world)?;
            let friction = push.friction.unwrap_or(0.0);
            if !(0.0..=10.0).contains(&friction) {
                let why = format!("friction is {friction}; allowed: 0 to 10");
                return Err(why.to_owned());
            }
            Ok(())
        }
        ControlKind::Motor { axes } => {
            // A motor may drive several axes of one unit by one number.
            let driven = world.driven_axes();
            if let Some((joint, _)) = axes.iter().find(|axis| !driven.contains(axis)) {
                return Err(format!("joint {joint} has no such free axis"));
            }
            let of_a_place = |(_, axis): &(usize, JointAxis)| matches!(axis, JointAxis::Linear(_));
            let along = axes.iter().filter(|axis| of_a_place(axis)).count();
            if axes.is_empty() || along > 0 && along < axes.len() {
                return Err("axes that slide, or axes that turn, are needed, not both".to_owned());
            }
            let twice = (1..axes.len()).any(|k| axes[..k].contains(&axes[k]));
            if twice { Err("a joint is named twice".to_owned()) } else { Ok(()) }
        }
        ControlKind::Constant(constant) if !CONSTANTS.contains(constant) => {
            let names: Vec<_> = CONSTANTS.iter().map(|constant| constant.name()).collect();
            let why =
                format!("{} cannot be a control; allowed: {}", constant.name(), names.join(", "));
            Err(why.to_owned())
        }
        ControlKind::Constant(constant) => bounds[0].into_iter().try_for_each(|number| {
            let numbers = constant.from_one_number(world, number);
            let changed = world.with_constants(&[(*constant, &numbers)]).map(drop);
            changed.map_err(|error| format!("value {number} is not allowed: {error}"))
        }),
        _ => Ok(()),
    }
}

/// Refuses a push whose point, with any of its offsets, lies outside the box around the body.
fn check_reach(push: &PushControl, offsets: &[[f64; 2]], world: &World) -> Result<(), String> {
    let reach = extents(&world.bodies()[push.body]);
    let slack = REACH_SLACK * reach.max();
    for first in offsets[0] {
        for second in offsets[1] {
            let place = push.place(&[0.0, 0.0, 0.0, first, second]);
            if (0..3).any(|k| place[k].abs() > reach[k] + slack) {
                let [x, y, z]: [f64; 3] = place.into();
                let [a, b, c]: [f64; 3] = reach.into();
                let why = format!(
                    "with its offsets it pushes at [{x:?}, {y:?}, {z:?}], outside the body; \
                     allowed: up to ±[{a:?}, {b:?}, {c:?}] m"
                );
                return Err(why.to_owned());
            }
        }
    }
    Ok(())
}

/// Share of a body's extent by which rounding may move the point of a push.
const REACH_SLACK: f64 = 1e-9;
