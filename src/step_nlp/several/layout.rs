//! Order of variables and rows of the program of several bodies (eqs. 23 and 26 of
//! `docs/formulation.md`).

use crate::step_nlp::layout::STATE;
use std::ops::Range;

/// Indices of variables and rows: first the bodies, then the contacts by kind of quantity. A
/// contact without friction has only a normal force and its slack.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SeveralLayout {
    bodies: usize,
    /// Index of each contact among those with friction.
    rubbing: Vec<Option<usize>>,
    /// Number of contacts with friction.
    rough: usize,
}

/// Normal variables of a contact, or its normal rows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Normal {
    /// Variable f_n, N; or the row of the gap.
    pub first: usize,
    /// Variable s1, N m; or the row of the normal complementarity.
    pub second: usize,
}

/// Friction variables of a contact.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Friction {
    /// Components of f_t along both tangents, N.
    pub force: [usize; 2],
    /// Slack s2, W.
    pub slack: usize,
    /// Slip speed λ, m/s.
    pub slip_speed: usize,
}

/// Variables of a contact.
#[derive(Debug, Clone, Copy)]
pub struct ContactVariables {
    /// Normal force and its slack.
    pub normal: Normal,
    /// Friction variables, if the contact has friction.
    pub friction: Option<Friction>,
}

/// Friction rows of a contact.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FrictionRows {
    /// First of two rows of maximum dissipation (= 0).
    pub dissipation: usize,
    /// Row of μ f_n − ‖f_t‖_ε (≥ 0).
    pub cone: usize,
    /// Row of s2 − λ (μ f_n − ‖f_t‖_ε) (≥ 0).
    pub complementarity: usize,
}

impl SeveralLayout {
    /// Creates the layout of `bodies` bodies and of contacts with or without `friction`.
    #[must_use]
    pub fn new(bodies: usize, friction: impl IntoIterator<Item = bool>) -> Self {
        let mut rough = 0;
        let number = |has: bool| {
            has.then(|| {
                rough += 1;
                rough - 1
            })
        };
        let rubbing = friction.into_iter().map(number).collect();
        Self { bodies, rubbing, rough }
    }

    /// Number of bodies n.
    #[must_use]
    pub fn bodies(&self) -> usize {
        self.bodies
    }

    /// Number of contacts K.
    #[must_use]
    pub fn contacts(&self) -> usize {
        self.rubbing.len()
    }

    /// Number of variables: 13 n + 6 K, less four for each contact without friction.
    #[must_use]
    pub fn variables(&self) -> usize {
        STATE.end * self.bodies + 2 * self.contacts() + 4 * self.rough
    }

    /// Number of rows, equal to the number of variables.
    #[must_use]
    pub fn constraints(&self) -> usize {
        self.variables()
    }

    /// Number of equations of motion and friction, which come first.
    #[must_use]
    pub fn equalities(&self) -> usize {
        STATE.end * self.bodies + 2 * self.rough
    }

    /// X⁺ of body `body`, and the rows of its motion.
    #[must_use]
    pub fn state(&self, body: usize) -> Range<usize> {
        STATE.end * body..STATE.end * (body + 1)
    }

    /// Variables of contact `i`.
    #[must_use]
    pub fn contact(&self, i: usize) -> ContactVariables {
        ContactVariables { normal: self.normal(i), friction: self.friction(i) }
    }

    /// Normal force of contact `i` and its slack.
    #[must_use]
    pub fn normal(&self, i: usize) -> Normal {
        let first = STATE.end * self.bodies + 2 * self.rough + i;
        Normal { first, second: first + self.contacts() }
    }

    /// Friction variables of contact `i`, if it has friction.
    #[must_use]
    pub fn friction(&self, i: usize) -> Option<Friction> {
        self.rubbing.get(i).copied().flatten().map(|place| {
            let (first, rough) = (STATE.end * self.bodies, self.rough);
            let after = first + 2 * rough + 2 * self.contacts() + place;
            let force = [first + place, first + rough + place];
            Friction { force, slack: after, slip_speed: after + rough }
        })
    }

    /// Gap row and normal complementarity row of contact `i`.
    #[must_use]
    pub fn normal_rows(&self, i: usize) -> Normal {
        let first = self.equalities() + i;
        Normal { first, second: first + self.contacts() + self.rough }
    }

    /// Friction rows of contact `i`, if it has friction.
    #[must_use]
    pub fn friction_rows(&self, i: usize) -> Option<FrictionRows> {
        self.rubbing.get(i).copied().flatten().map(|place| {
            let cone = self.equalities() + self.contacts() + place;
            let dissipation = STATE.end * self.bodies + 2 * place;
            let complementarity = cone + self.rough + self.contacts();
            FrictionRows { dissipation, cone, complementarity }
        })
    }

    /// Variables without a bound: states and friction forces.
    #[must_use]
    pub fn free(&self) -> Range<usize> {
        0..self.equalities()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every variable and every row belongs to exactly one body or contact.
    #[test]
    fn variables_and_rows_are_numbered_without_a_gap() {
        for friction in [vec![true; 3], vec![false, true, false, true], vec![false; 2], vec![]] {
            let layout = SeveralLayout::new(2, friction);
            let (mut variables, mut rows): (Vec<_>, Vec<_>) =
                ((0..26).collect(), (0..26).collect());
            for i in 0..layout.contacts() {
                let (of, row) = (layout.normal(i), layout.normal_rows(i));
                variables.extend([of.first, of.second]);
                rows.extend([row.first, row.second]);
                if let (Some(of), Some(row)) = (layout.friction(i), layout.friction_rows(i)) {
                    variables.extend([of.force[0], of.force[1], of.slack, of.slip_speed]);
                    let dissipation = row.dissipation;
                    rows.extend([dissipation, dissipation + 1, row.cone, row.complementarity]);
                }
            }
            variables.sort_unstable();
            rows.sort_unstable();
            assert_eq!(variables, (0..layout.variables()).collect::<Vec<_>>());
            assert_eq!(rows, (0..layout.constraints()).collect::<Vec<_>>());
        }
    }

    #[test]
    fn two_bodies_with_five_rough_contacts_have_56_variables() {
        let layout = SeveralLayout::new(2, [true; 5]);
        assert_eq!((layout.variables(), layout.equalities()), (13 * 2 + 6 * 5, 26 + 10));
    }
}
