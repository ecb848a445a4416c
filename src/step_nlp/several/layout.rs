//! The order of variables and rows of the program of several bodies (eqs. 23 and 26 of
//! `docs/formulation.md`).

use crate::step_nlp::layout::STATE;
use std::ops::Range;

/// Where variables and rows stand: bodies one after the other, then contacts, kind by kind. A
/// contact without friction has a normal force and its slack only.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SeveralLayout {
    bodies: usize,
    /// For each contact, which of those with friction it is.
    rubbing: Vec<Option<usize>>,
    /// How many contacts have friction.
    rough: usize,
}

/// The variables of a contact, or its rows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Normal {
    /// f_n, N; the gap's row.
    pub first: usize,
    /// s1, N m; the row of the normal complementarity.
    pub second: usize,
}

/// The variables of a contact's friction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Friction {
    /// The components of f_t along both tangents, N.
    pub force: [usize; 2],
    /// s2, W.
    pub slack: usize,
    /// λ, m/s.
    pub slip_speed: usize,
}

/// The variables of a contact.
#[derive(Debug, Clone, Copy)]
pub struct ContactVariables {
    /// The normal force and its slack.
    pub normal: Normal,
    /// Those of the friction, if it has any.
    pub friction: Option<Friction>,
}

/// The rows of a contact's friction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FrictionRows {
    /// The first row of maximum dissipation, of two (= 0).
    pub dissipation: usize,
    /// μ f_n − ‖f_t‖_ε (≥ 0).
    pub cone: usize,
    /// s2 − λ (μ f_n − ‖f_t‖_ε) (≥ 0).
    pub complementarity: usize,
}

impl SeveralLayout {
    /// The layout of `bodies` bodies and of contacts that have `friction` or not.
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

    /// n.
    #[must_use]
    pub fn bodies(&self) -> usize {
        self.bodies
    }

    /// K.
    #[must_use]
    pub fn contacts(&self) -> usize {
        self.rubbing.len()
    }

    /// 13 n + 6 K where all contacts have friction, four less for each that has none.
    #[must_use]
    pub fn variables(&self) -> usize {
        STATE.end * self.bodies + 2 * self.contacts() + 4 * self.rough
    }

    /// The number of rows: that of the variables.
    #[must_use]
    pub fn constraints(&self) -> usize {
        self.variables()
    }

    /// The number of equations of motion and friction, which come first.
    #[must_use]
    pub fn equalities(&self) -> usize {
        STATE.end * self.bodies + 2 * self.rough
    }

    /// X⁺ of body `body`, and the rows of its motion.
    #[must_use]
    pub fn state(&self, body: usize) -> Range<usize> {
        STATE.end * body..STATE.end * (body + 1)
    }

    /// The variables of contact `i`.
    #[must_use]
    pub fn contact(&self, i: usize) -> ContactVariables {
        ContactVariables { normal: self.normal(i), friction: self.friction(i) }
    }

    /// The normal force of contact `i` and its slack.
    #[must_use]
    pub fn normal(&self, i: usize) -> Normal {
        let first = STATE.end * self.bodies + 2 * self.rough + i;
        Normal { first, second: first + self.contacts() }
    }

    /// The variables of contact `i`'s friction, if it has any.
    #[must_use]
    pub fn friction(&self, i: usize) -> Option<Friction> {
        self.rubbing.get(i).copied().flatten().map(|place| {
            let (first, rough) = (STATE.end * self.bodies, self.rough);
            let after = first + 2 * rough + 2 * self.contacts() + place;
            let force = [first + place, first + rough + place];
            Friction { force, slack: after, slip_speed: after + rough }
        })
    }

    /// The rows of contact `i`: its gap and its normal complementarity.
    #[must_use]
    pub fn normal_rows(&self, i: usize) -> Normal {
        let first = self.equalities() + i;
        Normal { first, second: first + self.contacts() + self.rough }
    }

    /// The rows of contact `i`'s friction, if it has any.
    #[must_use]
    pub fn friction_rows(&self, i: usize) -> Option<FrictionRows> {
        self.rubbing.get(i).copied().flatten().map(|place| {
            let cone = self.equalities() + self.contacts() + place;
            let dissipation = STATE.end * self.bodies + 2 * place;
            let complementarity = cone + self.rough + self.contacts();
            FrictionRows { dissipation, cone, complementarity }
        })
    }

    /// The variables without a bound: states and friction forces.
    #[must_use]
    pub fn free(&self) -> Range<usize> {
        0..self.equalities()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every variable and every row is someone's, and no one's twice.
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
