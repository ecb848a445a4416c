//! Order of the decision vector and of the constraint rows (eqs. 7 and 17 of
//! `docs/formulation.md`). All offsets are defined here.

use std::ops::Range;

/// Position r⁺ in the decision vector.
pub const POSITION: Range<usize> = 0..3;
/// Attitude q⁺ in the decision vector.
pub const ATTITUDE: Range<usize> = 3..7;
/// Velocity v⁺ in the decision vector.
pub const VELOCITY: Range<usize> = 7..10;
/// Spin ω⁺ in the decision vector.
pub const SPIN: Range<usize> = 10..13;
/// State X⁺ in the decision vector.
pub const STATE: Range<usize> = 0..13;

/// Rows of r + h v⁺ − r⁺ = 0.
pub const POSITION_ROWS: Range<usize> = 0..3;
/// Rows of normalise(q + ½ h L(q) H ω⁺) − q⁺ = 0.
pub const ATTITUDE_ROWS: Range<usize> = 3..7;
/// Rows of v + h (Σf/m + g) − v⁺ = 0.
pub const VELOCITY_ROWS: Range<usize> = 7..10;
/// Rows of ω + h I⁻¹ (τ − ω⁺ × I ω⁺) − ω⁺ = 0.
pub const SPIN_ROWS: Range<usize> = 10..13;
/// Row of ‖q⁺‖² − 1 = 0.
pub const UNIT_NORM_ROW: usize = 13;

/// Index ranges for n contact points: 13 + 6n variables and 14 + 6n constraints (61 and 62 for the
/// cube).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Layout {
    contacts: usize,
}

impl Layout {
    /// Creates the layout for `contacts` contact points.
    pub const fn new(contacts: usize) -> Self {
        Self { contacts }
    }

    /// Number of contact points n.
    pub const fn contacts(&self) -> usize {
        self.contacts
    }

    /// Length of the decision vector (X⁺, f_x, f_y, f_z, s1, s2, λ).
    pub const fn variables(&self) -> usize {
        STATE.end + 6 * self.contacts
    }

    /// Number of constraint rows.
    pub const fn constraints(&self) -> usize {
        UNIT_NORM_ROW + 1 + 6 * self.contacts
    }

    const fn per_contact_variable(&self, block: usize) -> Range<usize> {
        let start = STATE.end + block * self.contacts;
        start..start + self.contacts
    }

    /// Indices of f_x, N.
    pub const fn force_x(&self) -> Range<usize> {
        self.per_contact_variable(0)
    }

    /// Indices of f_y, N.
    pub const fn force_y(&self) -> Range<usize> {
        self.per_contact_variable(1)
    }

    /// Indices of the slacks s1, N m.
    pub const fn slack_1(&self) -> Range<usize> {
        self.per_contact_variable(3)
    }

    /// Indices of the slacks s2, W.
    pub const fn slack_2(&self) -> Range<usize> {
        self.per_contact_variable(4)
    }

    /// Indices of the slip speeds λ, m/s.
    pub const fn slip_speed(&self) -> Range<usize> {
        self.per_contact_variable(5)
    }

    /// Indices of the variables of contact `i`: f_x, f_y, f_z, s1, s2, λ.
    pub const fn contact_variables(&self, i: usize) -> [usize; 6] {
        let (first, n) = (STATE.end + i, self.contacts);
        [first, first + n, first + 2 * n, first + 3 * n, first + 4 * n, first + 5 * n]
    }

    const fn per_contact_row(&self, skipped: usize, count: usize) -> Range<usize> {
        let start = UNIT_NORM_ROW + 1 + skipped * self.contacts;
        start..start + count * self.contacts
    }

    /// Rows of maximum dissipation, 2n (= 0). x and y of a contact are adjacent.
    pub const fn dissipation_rows(&self) -> Range<usize> {
        self.per_contact_row(0, 2)
    }

    /// Rows of the heights, n (≥ 0).
    pub const fn height_rows(&self) -> Range<usize> {
        self.per_contact_row(2, 1)
    }

    /// Rows of the friction cone, n (≥ 0).
    pub const fn cone_rows(&self) -> Range<usize> {
        self.per_contact_row(3, 1)
    }

    /// Rows of s1 − f_z z⁺, n (≥ 0).
    pub const fn normal_complementarity_rows(&self) -> Range<usize> {
        self.per_contact_row(4, 1)
    }

    /// Rows of s2 − λ (μ f_z − ‖f_xy‖_ε), n (≥ 0).
    pub const fn friction_complementarity_rows(&self) -> Range<usize> {
        self.per_contact_row(5, 1)
    }

    /// Rows of contact `i`: dissipation along x and y, height, cone, and the complementarity of
    /// normal and friction.
    pub const fn contact_rows(&self, i: usize) -> [usize; 6] {
        let dissipation = self.dissipation_rows().start + 2 * i;
        [
            dissipation,
            dissipation + 1,
            self.height_rows().start + i,
            self.cone_rows().start + i,
            self.normal_complementarity_rows().start + i,
            self.friction_complementarity_rows().start + i,
        ]
    }

    /// Number of equations: the rows before the first inequality.
    pub const fn equalities(&self) -> usize {
        self.height_rows().start
    }
}

#[cfg(test)]
#[path = "tests/layout.rs"]
mod tests;
