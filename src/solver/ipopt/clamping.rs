//! Bounds of the program, with the variables of contacts without force clamped to zero.

use crate::ipopt::Bounds;
use crate::step_nlp::layout::{Layout, STATE, UNIT_NORM_ROW};

/// Choice of the clamped contacts, and of the rows and units that go with it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Clamping {
    /// The tutorial's: contacts without flag are clamped and all rows hold, in SI units. All other
    /// bounds are ±10¹⁰, which Ipopt takes as bounds and not as infinity. The
    /// Jacobian is rank-deficient everywhere: some rows have no free variable, and the attitude
    /// rows imply the row ‖q⁺‖² = 1.
    Tutorial,
    /// Contacts that free flight leaves open are clamped too, and rows without a purpose are free,
    /// in the scene's own units. Scaled copies of a scene are one program.
    Posed,
}

/// Bound of the tutorial's free variables and rows.
const TUTORIALS_BOUND: f64 = 1e10;

/// Bounds for the `active` points, which have a 1, and the coefficient of `friction`.
///
/// X⁺, f_x and f_y are free, the other variables ≥ 0, equations = 0, inequalities ≥ 0 (eq. 17).
/// Variables of inactive points are clamped to zero. Otherwise an interior-point method would keep
/// their forces away from the zero bound.
pub(super) fn bounds(clamping: Clamping, layout: Layout, friction: f64, active: &[f64]) -> Bounds {
    let (n, m) = (layout.variables(), layout.constraints());
    let is_posed = clamping == Clamping::Posed;
    let most = if is_posed { f64::INFINITY } else { TUTORIALS_BOUND };
    let mut bounds = Bounds {
        lower: vec![0.0; n],
        upper: vec![most; n],
        constraint_lower: vec![0.0; m],
        constraint_upper: vec![most; m],
    };
    for free in [STATE, layout.force_x(), layout.force_y()] {
        bounds.lower[free].fill(-most);
    }
    bounds.constraint_upper[..layout.equalities()].fill(0.0);
    if is_posed {
        // The attitude rows imply this row.
        free(&mut bounds, &[UNIT_NORM_ROW]);
    }
    for (i, active) in active.iter().enumerate() {
        let [fx, fy, fz, s1, s2, slip] = layout.contact_variables(i);
        let [x, y, height, cone, normal, complementarity] = layout.contact_rows(i);
        if *active == 0.0 {
            clamp(&mut bounds, &[fx, fy, fz, s1, s2, slip]);
            if is_posed {
                free(&mut bounds, &[x, y, height, cone, normal, complementarity]);
            }
        } else if is_posed && friction == 0.0 {
            // With μ = 0 the rows (10) would forbid slip.
            clamp(&mut bounds, &[fx, fy, s2, slip]);
            free(&mut bounds, &[x, y, cone, complementarity]);
        }
    }
    bounds
}

fn clamp(bounds: &mut Bounds, variables: &[usize]) {
    for &variable in variables {
        (bounds.lower[variable], bounds.upper[variable]) = (0.0, 0.0);
    }
}

fn free(bounds: &mut Bounds, rows: &[usize]) {
    for &row in rows {
        bounds.constraint_lower[row] = f64::NEG_INFINITY;
        bounds.constraint_upper[row] = f64::INFINITY;
    }
}
