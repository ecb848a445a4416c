//! Laws of couplings behind a common interface.
//!
//! A solver uses
//!
//! - the projection arguments and the residual: [`CouplingLaw::projection`], [`CouplingLaw::evaluated`],
//! - the piece of the natural map and the distance to the next: [`Projection::piece`],
//!   [`Projection::margin`],
//! - the local solution for the impulse on a piece: [`Projection::local_solution`],
//! - the variables of the interior point method: [`Barrier`].
//!
//! A new law is a file next to [`cone`] and a variant of [`CouplingLaw`], [`Projection`] and
//! [`Barrier`]. Equation numbers refer to `docs/native-solver.md`.

mod axes;
mod cone;
mod cone_barrier;
mod ellipse;
mod local_solution;
mod map;
mod moment;
mod rows;

pub(super) use axes::AxesLaw;
pub(super) use cone::Cone;
pub(super) use cone_barrier::Pending;
pub(super) use local_solution::{Factored, Gain, LocalSolution};
pub use map::MapPiece;
pub(super) use map::NaturalMap;
pub(super) use moment::MomentLaw;
pub(super) use rows::{CouplingRows, LawRows};

use crate::joint::Graph;
use axes::AxesBarrier;
use cone_barrier::ConeBarrier;
use ellipse::{EllipseBarrier, EllipseProjection};
use moment::Load;
use nalgebra::{Matrix3, Vector3};

/// Law of three rows, with its constants.
#[derive(Debug, Clone, Copy)]
pub(super) enum CouplingLaw {
    /// Hard contact with Coulomb's circular friction cone and maximum dissipation.
    Cone(Cone),
    /// The same with an elliptic cone.
    Ellipse(Cone),
    /// Graph for each row: response of a joint along its axes.
    Axes(AxesLaw),
    /// Rolling and torsional resistance of a contact.
    Moment(MomentLaw),
}

/// Projection arguments of a coupling in the natural map.
#[derive(Debug, Clone, Copy)]
pub(super) enum Projection {
    Cone(cone::ConeProjection),
    Ellipse(EllipseProjection),
    Axes(axes::AxesProjection),
    Moment(moment::MomentProjection),
}

/// Variables of a coupling in the interior point method, besides V.
#[derive(Debug, Clone, Copy)]
pub(super) enum Barrier {
    Cone(ConeBarrier),
    Ellipse(EllipseBarrier),
    Axes(AxesBarrier),
    /// Moments have no interior. Their impulses are zero in the interior point method.
    Moment,
}

impl CouplingLaw {
    /// Projection arguments and the natural map (N4) as a velocity (m/s), at the motion u and the
    /// impulse p̂ (m/s, world).
    ///
    /// `earlier` has the projections of the couplings before this one. A moment whose contact is missing
    /// there counts as unloaded.
    #[inline(always)]
    pub(super) fn evaluated(
        &self,
        map: &NaturalMap,
        of: LawRows<'_>,
        earlier: &[Projection],
        u: &Vector3<f64>,
        impulse: &Vector3<f64>,
    ) -> (Projection, Vector3<f64>) {
        let LawRows { rows, graphs } = of;
        match self {
            Self::Cone(cone) => {
                let projection = cone::ConeProjection::new(map, rows, cone, u, impulse);
                let missed = projection.natural_map(rows);
                (Projection::Cone(projection), missed)
            }
            Self::Ellipse(law) => {
                let projection = EllipseProjection::new(map, rows, law, u, impulse);
                let missed = projection.cone.natural_map(rows);
                (Projection::Ellipse(projection), missed)
            }
            Self::Axes(axes) => {
                let projection = axes::AxesProjection::new(map, rows, axes, u, impulse);
                let missed = projection.natural_map(rows, graphs);
                (Projection::Axes(projection), missed)
            }
            Self::Moment(law) => {
                let load = earlier.get(law.contact).map_or(Load::default(), Projection::load);
                let projection = moment::MomentProjection::new(map, rows, law, load, u, impulse);
                let missed = projection.natural_map(rows);
                (Projection::Moment(projection), missed)
            }
        }
    }

    /// Centred variables of an interior point: rows with the speed `speed` and an impulse of size
    /// `strength` (m/s).
    pub(super) fn centred(&self, rows: &CouplingRows, speed: f64, strength: f64) -> Barrier {
        match self {
            Self::Cone(cone) => Barrier::Cone(ConeBarrier::centred(cone, rows, speed, strength)),
            Self::Ellipse(cone) => {
                Barrier::Ellipse(EllipseBarrier::centred(cone, rows, speed, strength))
            }
            Self::Axes(axes) => Barrier::Axes(AxesBarrier::new(axes, rows)),
            Self::Moment(_) => Barrier::Moment,
        }
    }
}

impl Projection {
    /// Piece of the natural map.
    #[inline]
    pub(super) fn piece(&self, graphs: &[Graph]) -> MapPiece {
        match self {
            Self::Cone(projection) => projection.piece(),
            Self::Ellipse(projection) => projection.cone.piece(),
            Self::Axes(projection) => MapPiece::Axes(projection.pieces(graphs)),
            Self::Moment(projection) => projection.piece(),
        }
    }

    /// Normal impulse of a contact.
    fn load(&self) -> Load {
        match self {
            Self::Cone(projection) => projection.load(),
            Self::Ellipse(projection) => projection.cone.load(),
            Self::Axes(_) | Self::Moment(_) => Load::default(),
        }
    }

    /// Lower bound of the number of stiff rows. Excludes the sideways row of a slipping contact.
    pub(super) fn stiff_rows(&self, graphs: &[Graph]) -> usize {
        match (self, self.piece(graphs)) {
            (Self::Axes(projection), MapPiece::Axes(pieces)) => {
                projection.stiff_rows(pieces, graphs)
            }
            (_, MapPiece::Stick) => 3,
            (_, MapPiece::Slip) => 1,
            (_, MapPiece::Moment { rolls, spins }) => {
                2 * usize::from(!rolls) + usize::from(spins == 0)
            }
            _ => 0,
        }
    }

    /// Distance to the next piece (m/s).
    pub(super) fn margin(&self, graphs: &[Graph]) -> f64 {
        match self {
            Self::Cone(projection) => projection.margin(),
            Self::Ellipse(projection) => projection.cone.margin(),
            Self::Axes(projection) => projection.margin(graphs),
            Self::Moment(projection) => projection.margin(),
        }
    }

    /// Distance to the nearest kink of the law (m/s).
    pub(super) fn clearance(&self, graphs: &[Graph]) -> f64 {
        match self {
            Self::Axes(projection) => projection.clearance(graphs),
            _ => self.margin(graphs),
        }
    }

    /// Largest speed of a row that the impulse holds (m/s).
    pub(super) fn held_speed(&self, graphs: &[Graph]) -> f64 {
        match self {
            Self::Cone(projection) => projection.held_speed(),
            Self::Ellipse(projection) => projection.cone.held_speed(),
            Self::Axes(projection) => projection.held_speed(graphs),
            Self::Moment(_) => 0.0,
        }
    }

    /// Local solution on a piece (N5), with ε = `compliance`.
    #[inline(always)]
    pub(super) fn local_solution(
        &self,
        piece: MapPiece,
        of: LawRows<'_>,
        impulse: &Vector3<f64>,
        compliance: f64,
    ) -> LocalSolution {
        match (self, piece) {
            (Self::Axes(projection), MapPiece::Axes(pieces)) => {
                projection.local_solution(pieces, of, compliance)
            }
            (Self::Cone(projection), piece) => {
                projection.local_solution(piece, of.rows, impulse, compliance)
            }
            (Self::Ellipse(projection), piece) => {
                projection.local_solution(piece, of.rows, impulse, compliance)
            }
            (Self::Moment(projection), piece) => {
                projection.local_solution(piece, of.rows, impulse, compliance)
            }
            (Self::Axes(_), _) => LocalSolution::open(impulse, of.rows),
        }
    }

    /// Offset of the local solution for use with the retained `gain` of another point on the same
    /// piece.
    #[inline]
    pub(super) fn offset(
        &self,
        piece: MapPiece,
        of: LawRows<'_>,
        impulse: &Vector3<f64>,
        compliance: f64,
        gain: &Gain,
    ) -> Vector3<f64> {
        match (self, piece, gain) {
            (Self::Axes(projection), MapPiece::Axes(pieces), _) => {
                projection.offset(pieces, of, compliance)
            }
            (Self::Cone(projection), MapPiece::Slip, Gain::Full(gain)) => {
                projection.slip_offset(of.rows, compliance, gain)
            }
            (Self::Ellipse(projection), MapPiece::Slip, Gain::Full(gain)) => {
                projection.slip_offset(of.rows, compliance, gain)
            }
            _ => self.local_solution(piece, of, impulse, compliance).offset,
        }
    }

    /// Factored gain of the local solution.
    pub(super) fn factored(&self, piece: MapPiece, of: LawRows<'_>, compliance: f64) -> Factored {
        match (self, piece) {
            (Self::Axes(projection), MapPiece::Axes(pieces)) => {
                projection.factored(pieces, of, compliance)
            }
            (Self::Cone(projection), piece) => projection.factored(piece, of.rows, compliance),
            (Self::Ellipse(projection), piece) => projection.factored(piece, of.rows, compliance),
            (Self::Moment(projection), piece) => projection.factored(piece, of.rows, compliance),
            (Self::Axes(_), _) => Factored::nothing(),
        }
    }
}

impl Barrier {
    /// Zero change.
    pub(super) fn nothing(&self) -> Self {
        match self {
            Self::Cone(_) => Self::Cone(ConeBarrier::ZERO),
            Self::Ellipse(law) => Self::Ellipse(law.nothing()),
            Self::Axes(axes) => Self::Axes(axes.nothing()),
            Self::Moment => Self::Moment,
        }
    }

    /// p̂ in the axes of the rows (m/s).
    pub(super) fn impulse(&self) -> Vector3<f64> {
        match self {
            Self::Cone(cone) => cone.impulse(),
            Self::Ellipse(law) => law.impulse(),
            Self::Axes(axes) => axes.impulse(),
            Self::Moment => Vector3::zeros(),
        }
    }

    /// Distance of the speeds from û at the motion u of the rows, in their axes (m/s).
    pub(super) fn error(&self, u: &Vector3<f64>, graphs: &[Graph]) -> f64 {
        match self {
            Self::Cone(cone) => cone.error(u),
            Self::Ellipse(law) => law.error(u),
            Self::Axes(axes) => axes.error(u, graphs),
            Self::Moment => 0.0,
        }
    }

    /// Sum of the products that converge to κ (m²/s²), and their number.
    pub(super) fn products(&self) -> (f64, usize) {
        match self {
            Self::Cone(cone) => (cone.products(), ConeBarrier::PRODUCTS),
            Self::Ellipse(law) => (law.cone.products(), ConeBarrier::PRODUCTS),
            Self::Axes(_) | Self::Moment => (0.0, 0),
        }
    }

    /// Linearises the equations and solves them for the impulse: offset and gain of δp̂ by δu.
    ///
    /// The products go to `kappa`, to second order along `predictor`. Row motion u and results are
    /// in the axes of the rows. `None` if the system is singular.
    pub(super) fn eliminate(
        &self,
        kappa: f64,
        predictor: &Self,
        u: &Vector3<f64>,
        graphs: &[Graph],
    ) -> Option<(Vector3<f64>, Matrix3<f64>, Pending)> {
        match (self, predictor) {
            (Self::Cone(cone), Self::Cone(predictor)) => cone.eliminate(kappa, predictor, u),
            (Self::Ellipse(law), Self::Ellipse(predictor)) => law.eliminate(kappa, predictor, u),
            (Self::Axes(axes), _) => Some(axes.eliminate(u, graphs)),
            (Self::Moment, _) => Some((Vector3::zeros(), Matrix3::zeros(), Pending::NONE)),
            (Self::Cone(_) | Self::Ellipse(_), _) => None,
        }
    }

    /// Largest deviation of the products from κ (m²/s²).
    pub(super) fn off_centre(&self, kappa: f64) -> f64 {
        match self {
            Self::Cone(cone) => cone.off_centre(kappa),
            Self::Ellipse(law) => law.cone.off_centre(kappa),
            Self::Axes(_) | Self::Moment => 0.0,
        }
    }

    /// δp̂ by δμ on the central path, in the axes of the rows. `None` for rows without friction.
    pub(super) fn by_friction(&self) -> Option<Vector3<f64>> {
        match self {
            Self::Cone(cone) => cone.by_friction(),
            Self::Ellipse(law) => law.by_friction(),
            Self::Axes(_) | Self::Moment => None,
        }
    }

    /// Step of all variables for given steps of the impulse and of the rows' motion, in their axes.
    pub(super) fn step(
        &self,
        impulse: &Vector3<f64>,
        moved: &Vector3<f64>,
        rest: &Pending,
    ) -> Self {
        match self {
            Self::Cone(cone) => Self::Cone(cone.step(impulse, moved, rest)),
            Self::Ellipse(law) => Self::Ellipse(law.step(impulse, moved, rest)),
            Self::Axes(axes) => Self::Axes(axes.step(impulse)),
            Self::Moment => Self::Moment,
        }
    }

    /// These variables plus `length` times `step`.
    pub(super) fn moved(&self, step: &Self, length: f64) -> Self {
        match (self, step) {
            (Self::Cone(cone), Self::Cone(step)) => Self::Cone(cone.moved(step, length)),
            (Self::Ellipse(law), Self::Ellipse(step)) => Self::Ellipse(law.moved(step, length)),
            (Self::Axes(axes), Self::Axes(step)) => Self::Axes(axes.moved(step, length)),
            _ => *self,
        }
    }

    /// Longest step that stays inside, at most 1.
    pub(super) fn longest_step(&self, step: &Self) -> f64 {
        match (self, step) {
            (Self::Cone(cone), Self::Cone(step)) => cone.longest_step(step),
            (Self::Ellipse(law), Self::Ellipse(step)) => law.cone.longest_step(&step.cone),
            _ => 1.0,
        }
    }
}
