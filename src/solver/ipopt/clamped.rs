//! The tutorial's program for Ipopt: indices of a contact's variables, and bounds.

use crate::ipopt::Bounds;
use crate::step_nlp::layout::{Layout, STATE};
use crate::step_nlp::several::{ContactVariables, Friction, Normal};
use tumble_core::contact::Contact;

/// Variable indices of `contact`.
pub(super) fn place(layout: Layout, contact: &Contact) -> ContactVariables {
    let [fx, fy, fz, s1, s2, slip_speed] = layout.contact_variables(contact.key.point);
    let friction = Friction { force: [fx, fy], slack: s2, slip_speed };
    ContactVariables { normal: Normal { first: fz, second: s1 }, friction: Some(friction) }
}

/// Bounds of the tutorial (eq. 17) for the `active` points. X⁺, f_x and f_y are free, the other
/// variables ≥ 0, equations = 0, inequalities ≥ 0. Variables of inactive points are clamped to
/// zero. Otherwise an interior-point method would keep their forces away from the zero bound.
pub(super) fn bounds(layout: Layout, active: &[f64]) -> Bounds {
    let (n, m) = (layout.variables(), layout.constraints());
    let mut bounds = Bounds {
        lower: vec![0.0; n],
        upper: vec![f64::INFINITY; n],
        constraint_lower: vec![0.0; m],
        constraint_upper: vec![f64::INFINITY; m],
    };
    for free in [STATE, layout.force_x(), layout.force_y()] {
        bounds.lower[free].fill(f64::NEG_INFINITY);
    }
    for (i, _) in active.iter().enumerate().filter(|(_, active)| **active == 0.0) {
        for variable in layout.contact_variables(i) {
            bounds.lower[variable] = 0.0;
            bounds.upper[variable] = 0.0;
        }
    }
    bounds.constraint_upper[..layout.equalities()].fill(0.0);
    bounds
}
