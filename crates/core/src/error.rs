//! Errors of the model: rejected input, with the field and its allowed range.

use crate::partner::Partner;
use std::fmt::{self, Display, Formatter};

/// Reason for rejecting a model, state or step. Each message names the field, the input and the
/// allowed range.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Error {
    /// A number outside its range, including NaN.
    OutOfRange {
        /// Name of the field, with its unit.
        field: &'static str,
        /// Rejected number.
        value: f64,
        /// Allowed range.
        allowed: &'static str,
    },
    /// A count outside its range.
    Count {
        /// Name of the counted items.
        field: &'static str,
        /// Rejected count.
        count: usize,
        /// Allowed range.
        allowed: &'static str,
    },
    /// Three or more knots of a load at the same time.
    KnotsAtOneTime {
        /// Time of the knots (s).
        time: f64,
    },
    /// A matrix that cannot be an inertia matrix.
    Inertia(&'static str),
    /// An unusable shape.
    Shape {
        /// Kind of shape: "the hull", "the mesh".
        shape: &'static str,
        /// Defect of the shape, and the remedy.
        why: String,
    },
    /// Bodies that overlap too deeply at the start.
    Overlap {
        /// The two overlapping bodies or fixed pieces.
        between: (Partner, Partner),
        /// Overlap depth (m).
        depth: f64,
        /// Largest allowed depth (m).
        allowed: f64,
    },
    /// More pairs of near pieces than a search of contacts can list.
    Crowded {
        /// Two bodies, or a body and fixed geometry, of one of the pairs.
        between: (Partner, Partner),
    },
    /// Two owners of a [friction axis](crate::world::World::with_friction_axis) that may touch.
    FrictionAxes {
        /// The two bodies, or a body and fixed geometry.
        between: (Partner, Partner),
    },
    /// Owner of a [friction axis](crate::world::World::with_friction_axis_in) in the frame of a body to which no
    /// joints connect it.
    LooseFrictionAxis {
        /// The owner.
        owner: Partner,
    },
    /// A joint whose constraints are violated at the start.
    JointApart {
        /// Index of the joint.
        joint: usize,
        /// Position error (m).
        place: f64,
        /// Rotation error (rad).
        turn: f64,
        /// Largest allowed error (m and rad).
        allowed: f64,
    },
    /// A joint that starts beyond its limits. The first step would throw it back.
    JointBeyond {
        /// Index of the joint.
        joint: usize,
        /// Distance beyond the limits (m).
        place: f64,
        /// Angle beyond the limits (rad).
        turn: f64,
        /// Largest allowed excess (m and rad).
        allowed: f64,
    },
    /// A gear whose constraint is violated at the start.
    GearApart {
        /// Index of the gear.
        gear: usize,
        /// Error of its first coordinate (m or rad).
        off: f64,
        /// Largest allowed error (m or rad).
        allowed: f64,
    },
    /// A body that cannot be removed or held because a joint connects it.
    Tied {
        /// Index of the body.
        body: usize,
        /// Index of its first joint.
        joint: usize,
    },
    /// Joints that could not be assembled by a small change of the poses.
    NotAssembled {
        /// Index of the joint with the largest error.
        joint: usize,
        /// Position error (m).
        place: f64,
        /// Rotation error (rad).
        turn: f64,
    },
    /// Principal moments of inertia with too large a ratio.
    MomentsApart {
        /// Smallest principal moment (kg m²).
        least: f64,
        /// Largest principal moment (kg m²).
        largest: f64,
    },
    /// A principal moment of inertia that is inconsistent with the mass and the contact points; see
    /// [`RigidBody::new`](crate::mechanics::RigidBody::new).
    Moment {
        /// Rejected moment (kg m²).
        moment: f64,
        /// Smallest allowed moment (kg m²).
        least: f64,
        /// Largest allowed moment (kg m²).
        most: f64,
    },
    /// An initial state deeper below the ground than the contact band.
    StartBelowGround {
        /// Index of the body.
        body: usize,
        /// Depth of the lowest contact point (m).
        depth: f64,
        /// Width of the contact band (m).
        allowed: f64,
    },
    /// The step was interrupted because its flag was raised.
    Interrupted,
    /// A saved state from which a simulation cannot continue.
    Saved(String),
    /// A feature that a part of the library does not support.
    Unsupported {
        /// Requested feature.
        what: &'static str,
        /// Reason, and the remedy if there is one.
        why: &'static str,
    },
    /// A solver rejected the step before it ran, or violated the contract of
    /// [`StepSolver`](crate::step::StepSolver).
    Solver {
        /// Name of the solver.
        solver: &'static str,
        /// Reason of the solver.
        why: String,
    },
}

/// Names of the parts of a world in messages. By default they are numbered.
pub trait Names {
    /// Name of a body, fixed piece or the ground.
    fn partner(&self, partner: Partner) -> String {
        partner.to_string()
    }

    /// Name of a joint.
    fn joint(&self, joint: usize) -> String {
        format!("joint {joint}")
    }

    /// Name of a gear.
    fn gear(&self, gear: usize) -> String {
        format!("gear {gear}")
    }
}

/// The default names.
struct Numbers;

impl Names for Numbers {}

impl Error {
    /// Message with the given names.
    pub fn display(&self, names: &dyn Names) -> String {
        let body = |body: usize| names.partner(Partner::Body(body));
        match self {
            Self::OutOfRange { field, value, allowed } => {
                format!("{field} is {value:?}; allowed: {allowed}")
            }
            Self::Count { field, count, allowed } => {
                format!("{field}: {count} given; allowed: {allowed}")
            }
            Self::KnotsAtOneTime { time } => format!(
                "the load has more than two knots at {time:?} s; allowed: one, or two for a jump"
            ),
            Self::Inertia(why) => format!("the inertia matrix (kg m²) {why}"),
            Self::Shape { shape, why } => format!("{shape} {why}"),
            Self::Overlap { between: (first, second), depth, allowed } => format!(
                "{} and {} overlap by {depth:.3e} m at the start; allowed: {allowed:.1e} m",
                names.partner(*first),
                names.partner(*second)
            ),
            Self::Crowded { between: (first, second) } => format!(
                "millions of pieces are near each other, of {} and {} among others; move the bodies \
                 apart, or use fewer pieces",
                names.partner(*first),
                names.partner(*second)
            ),
            Self::FrictionAxes { between: (first, second) } => format!(
                "friction of {} and of {} depends on the direction, which no ellipse describes; \
                 remove the axis of one, or exclude their contact",
                names.partner(*first),
                names.partner(*second)
            ),
            Self::LooseFrictionAxis { owner } => format!(
                "the axis of friction of {} is in the frame of a body to which no joints connect it; \
                 connect them by joints",
                names.partner(*owner)
            ),
            Self::JointApart { joint, place, turn, allowed } => format!(
                "{} is {place:.3e} m and {turn:.3e} rad off at the start; allowed: {allowed:.0e} \
                 of each; move its bodies, or remove it",
                names.joint(*joint)
            ),
            Self::JointBeyond { joint, place, turn, allowed } => format!(
                "{} is {place:.3e} m and {turn:.3e} rad beyond its limits at the start; allowed: \
                 {allowed:.0e} of each",
                names.joint(*joint)
            ),
            Self::GearApart { gear, off, allowed } => format!(
                "{} is {off:.3e} m or rad off at the start; allowed: {allowed:.0e}",
                names.gear(*gear)
            ),
            Self::Tied { body: index, joint } => format!(
                "{} is attached to {}; only a body without joints can be held, or removed without \
                 them",
                body(*index),
                names.joint(*joint)
            ),
            Self::NotAssembled { joint, place, turn } => format!(
                "{} stays {place:.3e} m and {turn:.3e} rad apart; choose initial states that fit \
                 it better",
                names.joint(*joint)
            ),
            Self::MomentsApart { least, largest } => format!(
                "the smallest and the largest principal moment of inertia are {least:?} and \
                 {largest:?} kg m²; allowed: a ratio of at most 1e6"
            ),
            Self::Moment { moment, least, most } => format!(
                "a principal moment of inertia is {moment:?} kg m²; allowed with this mass and \
                 these contact points: {least:.1e} to {most:.1e}"
            ),
            Self::StartBelowGround { body: index, depth, allowed } => format!(
                "{} would start {depth:.3e} m below the ground; allowed: {allowed:.1e} m; raise \
                 it along the ground's normal",
                body(*index)
            ),
            Self::Interrupted => "the step was interrupted".to_owned(),
            Self::Saved(why) => format!("the saved state {why}"),
            Self::Unsupported { what, why } => format!("{what}: {why}"),
            Self::Solver { solver, why } => format!("{solver}: {why}"),
        }
    }
}

impl Display for Error {
    fn fmt(&self, out: &mut Formatter<'_>) -> fmt::Result {
        out.write_str(&self.display(&Numbers))
    }
}

impl std::error::Error for Error {}

/// Returns `value` if `low ≤ value ≤ high`.
///
/// # Errors
/// [`Error::OutOfRange`] with `field` and `allowed` otherwise, also for NaN.
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

/// Rejects the first of `values` outside `low..=high`.
pub(crate) fn all_in_range<'a>(
    field: &'static str,
    values: impl IntoIterator<Item = &'a f64>,
    low: f64,
    high: f64,
    allowed: &'static str,
) -> Result<(), Error> {
    values.into_iter().try_for_each(|&value| in_range(field, value, low, high, allowed).map(drop))
}
