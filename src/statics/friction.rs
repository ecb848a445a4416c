//! Smallest friction, and the worst case of a range of friction.
//!
//! The cone of a smaller coefficient is a part of the cone of a larger one. A structure that stands
//! with friction μ therefore stands with all larger coefficients,
//!
//! ```text
//! μ ≤ μ'  ⇒  K(μ) ⊂ K(μ'),                                                  (S5)
//! ```
//!
//! and a mechanism at μ is one for all smaller coefficients. The friction of a moving surface
//! is a load, and (S5) does not hold for it.

use super::certificate::{ForceState, Mechanism};
use super::structure::Structure;
use super::verdict::Verdict;
use crate::Error;

/// Relative width of the bracket of the smallest friction.
const WIDTH: f64 = 1e-6;
/// Largest factor on friction that is tried.
const LARGEST: f64 = 1e3;
/// Largest number of moving surfaces in a worst case, whose coefficients are combined.
const MOST_MOVING: usize = 6;

/// Smallest factor on all coefficients of friction with which a structure stands.
#[derive(Debug, Clone, PartialEq)]
pub enum FrictionLimit {
    /// The factor is between both certificates.
    Factor {
        /// Factor of the mechanism.
        lower: f64,
        /// Factor of the force state.
        upper: f64,
        /// Forces at `upper`.
        forces: ForceState,
        /// Mechanism at `lower`.
        mechanism: Mechanism,
    },
    /// The structure stands without friction.
    Frictionless(ForceState),
    /// It does not stand with a thousand times its friction.
    Never(Mechanism),
    /// A certificate is missing.
    Undecided,
}

impl FrictionLimit {
    /// Smallest factor, if it has both certificates: that of the force state.
    pub fn factor(&self) -> Option<f64> {
        match self {
            Self::Factor { upper, .. } => Some(*upper),
            Self::Frictionless(_) => Some(0.0),
            Self::Never(_) | Self::Undecided => None,
        }
    }

    /// Name of the result.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Factor { .. } => "factor",
            Self::Frictionless(_) => "frictionless",
            Self::Never(_) => "never",
            Self::Undecided => "undecided",
        }
    }
}

/// Bracket of the smallest factor: the last certificate at each end, with its factor.
#[derive(Default)]
struct Bracket {
    forces: Option<(f64, ForceState)>,
    mechanism: Option<(f64, Mechanism)>,
}

impl Bracket {
    /// Tries a factor. Returns true if the structure stands, and `None` without a certificate.
    fn try_factor(&mut self, structure: &Structure, factor: f64) -> Option<bool> {
        match structure.with_friction_times(factor).verdict() {
            Verdict::Equilibrium(forces) => self.forces = Some((factor, forces)),
            Verdict::None(mechanism) => {
                self.mechanism = Some((factor, mechanism));
                return Some(false);
            }
            Verdict::Undecided => return None,
        }
        Some(true)
    }

    /// Bisects between both ends. A factor without a certificate counts as `missing`, so that one end
    /// stays at its last certificate.
    fn narrow(&mut self, structure: &Structure, missing: bool) {
        let (Some((most, _)), Some((least, _))) = (&self.forces, &self.mechanism) else { return };
        let mut low = *least;
        let mut high = *most;
        while high - low > WIDTH * high {
            let middle = 0.5 * (low + high);
            let stands = self.try_factor(structure, middle).unwrap_or(missing);
            *(if stands { &mut high } else { &mut low }) = middle;
        }
    }
}

impl Structure {
    /// Smallest factor on all coefficients of friction with which the structure stands under its loads, by
    /// bisection. Moving surfaces keep theirs. The bracket is wider where certificates are missing.
    pub fn smallest_friction(&self) -> FrictionLimit {
        let mut bracket = Bracket::default();
        bracket.try_factor(self, 0.0);
        if let Some((_, forces)) = bracket.forces {
            return FrictionLimit::Frictionless(forces);
        }
        let mut factor = 1.0;
        while bracket.forces.is_none() && factor <= LARGEST {
            bracket.try_factor(self, factor);
            factor *= 4.0;
        }
        bracket.narrow(self, false);
        bracket.narrow(self, true);
        match (bracket.forces, bracket.mechanism) {
            (Some((upper, forces)), Some((lower, mechanism))) => {
                FrictionLimit::Factor { lower, upper, forces, mechanism }
            }
            (None, Some((lower, mechanism))) if lower > 0.25 * LARGEST => {
                FrictionLimit::Never(mechanism)
            }
            _ => FrictionLimit::Undecided,
        }
    }

    /// The worst cases of coefficients of friction between `least` and `most`: the smallest in every pair
    /// (S5). A moving surface has both ends, in all combinations with the others; what lies between
    /// is not covered.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] unless 0 ≤ least ≤ most; [`Error::Count`] for more than six pairs with moving
    /// surfaces.
    pub fn worst_friction(&self, least: f64, most: f64) -> Result<Vec<Self>, Error> {
        if !(0.0 <= least && least <= most && most.is_finite()) {
            let allowed = "two numbers from 0 on, the smaller first";
            return Err(Error::OutOfRange { field: "range of friction", value: least, allowed });
        }
        let moving =
            self.contacts.iter().enumerate().filter(|(_, contact)| contact.dragged.is_some());
        let mut pairs: Vec<_> = moving.map(|(contact, _)| self.pair(contact)).collect();
        pairs.sort_unstable();
        pairs.dedup();
        let count = pairs.len();
        if count > MOST_MOVING {
            let field = "pairs with moving surfaces";
            return Err(Error::Count { field, count, allowed: "up to 6 for a range of friction" });
        }
        let of_case = |case: usize| {
            let mut changed = self.clone();
            for contact in 0..changed.contacts.len() {
                let is_most = match pairs.binary_search(&self.pair(contact)) {
                    Ok(pair) => self.contacts[contact].dragged.is_some() && case >> pair & 1 == 1,
                    Err(_) => false,
                };
                changed.contacts[contact].friction = if is_most { most } else { least };
            }
            changed
        };
        Ok((0..1 << count).map(of_case).collect())
    }
}
