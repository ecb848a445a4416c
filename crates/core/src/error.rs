//! Errors of the model: input out of range, with the field and the range in them.

use crate::world::partner::Partner;

/// Why a model, state or step was refused. Each message names the field, what was
/// given and what is allowed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A number outside its range, NaN included.
    #[error("{field} is {value:?}; allowed is {allowed}")]
    OutOfRange {
        /// The field, with its unit.
        field: &'static str,
        /// The number given.
        value: f64,
        /// The range.
        allowed: &'static str,
    },
    /// A count outside its range.
    #[error("{field}: {count} given; allowed is {allowed}")]
    Count {
        /// What is counted.
        field: &'static str,
        /// The count given.
        count: usize,
        /// The range.
        allowed: &'static str,
    },
    /// Three knots of a load, or more, at one time.
    #[error("the load has more than two knots at {time:?} s; allowed is one, or two for a jump")]
    KnotsAtOneTime {
        /// s.
        time: f64,
    },
    /// A matrix that cannot be an inertia matrix.
    #[error("the inertia matrix (kg m²) {0}")]
    Inertia(&'static str),
    /// A shape that cannot be used.
    #[error("{shape} {why}")]
    Shape {
        /// What kind of shape: "the hull", "the mesh".
        shape: &'static str,
        /// What is wrong with it, and what would be right.
        why: String,
    },
    /// Bodies that overlap deep at the start.
    #[error(
        "{} and {} overlap by {depth:.3e} m at the start; allowed is to touch, and {allowed:.1e} m",
        between.0,
        between.1
    )]
    Overlap {
        /// Whose they are.
        between: (Partner, Partner),
        /// m.
        depth: f64,
        /// m.
        allowed: f64,
    },
    /// A joint whose bodies are not where it holds them at the start.
    #[error(
        "joint {joint} is {place:.3e} m and {turn:.3e} rad off at the start; allowed is {allowed:.0e} of each"
    )]
    JointApart {
        /// Its index.
        joint: usize,
        /// m.
        place: f64,
        /// rad.
        turn: f64,
        /// m and rad.
        allowed: f64,
    },
    /// A joint that starts beyond its limits: one step would throw it back.
    #[error(
        "joint {joint} is {place:.3e} m and {turn:.3e} rad beyond its limits at the start; allowed is {allowed:.0e} of \
         each"
    )]
    JointBeyond {
        /// Its index.
        joint: usize,
        /// m.
        place: f64,
        /// rad.
        turn: f64,
        /// m and rad.
        allowed: f64,
    },
    /// A gear whose coordinates are not where it holds them at the start.
    #[error("gear {gear} is {off:.3e} m or rad off at the start; allowed is {allowed:.0e}")]
    GearApart {
        /// The index of the gear.
        gear: usize,
        /// How far its first coordinate is off, m or rad.
        off: f64,
        /// What is allowed.
        allowed: f64,
    },
    /// A body that cannot be taken out of the world, or held, because a joint ties it.
    #[error(
        "body {body} is tied by joint {joint}; only a body without joints can be held, or taken out \
         without them"
    )]
    Tied {
        /// Its index.
        body: usize,
        /// The index of the first joint that does.
        joint: usize,
    },
    /// Joints that no small change of places brings together.
    #[error(
        "joint {joint} stays {place:.3e} m and {turn:.3e} rad apart; give states nearer to where it \
         holds its bodies"
    )]
    NotAssembled {
        /// The index of the worst one.
        joint: usize,
        /// m.
        place: f64,
        /// rad.
        turn: f64,
    },
    /// Principal moments of inertia that are too far from each other.
    #[error(
        "the least and the largest principal moment of inertia are {least:?} and {largest:?} kg m²; \
         allowed is a ratio of at most 1e6"
    )]
    MomentsApart {
        /// kg m².
        least: f64,
        /// kg m².
        largest: f64,
    },
    /// A principal moment of inertia that does not fit the mass and the contact points: see
    /// [`RigidBody::new`](crate::mechanics::RigidBody::new).
    #[error(
        "a principal moment of inertia is {moment:?} kg m²; allowed with this mass and these \
         contact points is {least:.1e} to {most:.1e}"
    )]
    Moment {
        /// kg m².
        moment: f64,
        /// kg m².
        least: f64,
        /// kg m².
        most: f64,
    },
    /// A start deeper below the ground than the contact band.
    #[error(
        "the lowest contact point would start {depth:?} m below the ground; allowed is the contact \
         band, {allowed:?} m"
    )]
    StartBelowGround {
        /// m.
        depth: f64,
        /// m.
        allowed: f64,
    },
    /// The step was given up because its interrupt flag was raised.
    #[error("the step was interrupted")]
    Interrupted,
    /// A saved state that a simulation cannot go on from.
    #[error("the saved state {0}")]
    Saved(String),
    /// A feature that a part of the library does not have.
    #[error("{what}: {why}")]
    Unsupported {
        /// What was asked for.
        what: &'static str,
        /// Why it is not to be had.
        why: &'static str,
    },
    /// A solver refused the step before it ran, or broke the rules of
    /// [`StepSolver`](crate::step::StepSolver).
    #[error("{solver}: {why}")]
    Solver {
        /// Which solver.
        solver: &'static str,
        /// Its reason.
        why: String,
    },
}

/// `Ok(value)` where `low ≤ value ≤ high`.
///
/// # Errors
/// [`Error::OutOfRange`] of the `field`, which says what is `allowed`; also of a NaN.
pub fn in_range(
    field: &'static str,
    value: f64,
    low: f64,
    high: f64,
    allowed: &'static str,
) -> Result<f64, Error> {
    if (low..=high).contains(&value) {
        Ok(value)
    } else {
        Err(Error::OutOfRange { field, value, allowed })
    }
}

/// Refuses the first of `values` that is not `low` to `high`.
pub(crate) fn all_in_range<'a>(
    field: &'static str,
    values: impl IntoIterator<Item = &'a f64>,
    low: f64,
    high: f64,
    allowed: &'static str,
) -> Result<(), Error> {
    values.into_iter().try_for_each(|&value| in_range(field, value, low, high, allowed).map(drop))
}
