//! The laws that couplings obey, behind one set of functions.
//!
//! Solvers know a law by what it answers here: the arguments of its projection and the residual
//! ([`CouplingLaw::pull`], [`CouplingLaw::evaluated`]), the piece of the natural map that a point is
//! on and how far the next one is ([`Projection::piece`], [`Projection::margin`]), that piece solved
//! for the impulse ([`Projection::answer`]), and the variables of an interior point ([`Barrier`]). A
//! new law is a file beside [`cone`] and a variant of [`CouplingLaw`], [`Projection`] and [`Barrier`].
//!
//! Equation numbers are those of `docs/native-solver.md`.

mod answer;
mod axes;
mod cone;
mod cone_barrier;
mod map;
mod rows;

pub(super) use answer::{Answer, Factored, Gain};
pub(super) use axes::AxesLaw;
pub(super) use cone::Cone;
pub(super) use cone_barrier::Pending;
pub use map::MapPiece;
pub(super) use map::NaturalMap;
pub(super) use rows::{CouplingRows, LawRows};

use crate::joint::Graph;
use axes::AxesBarrier;
use cone_barrier::ConeBarrier;
use nalgebra::{Matrix3, Vector3};

/// A law of three rows, with its constants.
#[derive(Debug, Clone, Copy)]
pub(super) enum CouplingLaw {
    /// Hard contact and Coulomb's round cone, with maximum dissipation.
    Cone(Cone),
    /// A graph for each row: what a joint does along its axes.
    Axes(AxesLaw),
}

/// A coupling's arguments of the projections in the natural map.
#[derive(Debug, Clone, Copy)]
pub(super) enum Projection {
    Cone(cone::ConeProjection),
    Axes(axes::AxesProjection),
}

/// The variables of a coupling in an interior point, besides V.
#[derive(Debug, Clone, Copy)]
pub(super) enum Barrier {
    Cone(ConeBarrier),
    Axes(AxesBarrier),
}

impl CouplingLaw {
    /// The arguments of the projections of a coupling with these `rows` at its motion u and impulse p̂ (m/s, world).
    #[inline]
    pub(super) fn pull(
        &self,
        map: &NaturalMap,
        rows: &CouplingRows,
        u: &Vector3<f64>,
        impulse: &Vector3<f64>,
    ) -> Projection {
        match self {
            Self::Cone(cone) => {
                Projection::Cone(cone::ConeProjection::new(map, rows, cone, u, impulse))
            }
            Self::Axes(axes) => {
                Projection::Axes(axes::AxesProjection::new(map, rows, axes, u, impulse))
            }
        }
    }

    /// The same, and the natural map (N4) there as a velocity, m/s.
    #[inline(always)]
    pub(super) fn evaluated(
        &self,
        map: &NaturalMap,
        of: LawRows<'_>,
        u: &Vector3<f64>,
        impulse: &Vector3<f64>,
    ) -> (Projection, Vector3<f64>) {
        let LawRows { rows, graphs } = of;
        match self {
            Self::Cone(cone) => {
                let pull = cone::ConeProjection::new(map, rows, cone, u, impulse);
                let missed = pull.natural_map(rows);
                (Projection::Cone(pull), missed)
            }
            Self::Axes(axes) => {
                let pull = axes::AxesProjection::new(map, rows, axes, u, impulse);
                let missed = pull.natural_map(rows, graphs);
                (Projection::Axes(pull), missed)
            }
        }
    }

    /// The centred variables of an interior point: rows that move at the speed `speed`, and an impulse
    /// of the size `strength` (m/s).
    pub(super) fn centred(&self, rows: &CouplingRows, speed: f64, strength: f64) -> Barrier {
        match self {
            Self::Cone(cone) => Barrier::Cone(ConeBarrier::centred(cone, speed, strength)),
            Self::Axes(axes) => Barrier::Axes(AxesBarrier::new(axes, rows)),
        }
    }
}

impl Projection {
    /// The piece of the natural map.
    #[inline]
    pub(super) fn piece(&self, graphs: &[Graph]) -> MapPiece {
        match self {
            Self::Cone(pull) => pull.piece(),
            Self::Axes(pull) => MapPiece::Axes(pull.pieces(graphs)),
        }
    }

    /// At least so many rows are held wherever they are: not those that slip nearly sideways.
    pub(super) fn stiff_rows(&self, graphs: &[Graph]) -> usize {
        match (self, self.piece(graphs)) {
            (Self::Axes(pull), MapPiece::Axes(pieces)) => pull.stiff_rows(pieces, graphs),
            (_, MapPiece::Stick) => 3,
            (_, MapPiece::Slip) => 1,
            _ => 0,
        }
    }

    /// How far the pull is from the next piece, m/s.
    pub(super) fn margin(&self, graphs: &[Graph]) -> f64 {
        match self {
            Self::Cone(pull) => pull.margin(),
            Self::Axes(pull) => pull.margin(graphs),
        }
    }

    /// How far it is from where its law bends, m/s.
    pub(super) fn clearance(&self, graphs: &[Graph]) -> f64 {
        match self {
            Self::Cone(pull) => pull.margin(),
            Self::Axes(pull) => pull.clearance(graphs),
        }
    }

    /// How fast the rows move that the impulse holds, m/s.
    pub(super) fn held_speed(&self, graphs: &[Graph]) -> f64 {
        match self {
            Self::Cone(pull) => pull.held_speed(),
            Self::Axes(pull) => pull.held_speed(graphs),
        }
    }

    /// A piece linearised and solved for the impulse (N5), with ε = `compliance`.
    #[inline(always)]
    pub(super) fn answer(
        &self,
        piece: MapPiece,
        of: LawRows<'_>,
        impulse: &Vector3<f64>,
        compliance: f64,
    ) -> Answer {
        match (self, piece) {
            (Self::Axes(pull), MapPiece::Axes(pieces)) => pull.answer(pieces, of, compliance),
            (Self::Cone(pull), piece) => pull.answer(piece, of.rows, impulse, compliance),
            (Self::Axes(_), _) => Answer::open(impulse),
        }
    }

    /// The offset of that answer beside the `gain` of another point on the same piece, which is kept.
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
            (Self::Axes(pull), MapPiece::Axes(pieces), _) => pull.offset(pieces, of, compliance),
            (Self::Cone(pull), MapPiece::Slip, Gain::Full(gain)) => {
                pull.slip_offset(of.rows, compliance, gain)
            }
            _ => self.answer(piece, of, impulse, compliance).offset,
        }
    }

    /// The gain of that answer in its factors.
    pub(super) fn factored(&self, piece: MapPiece, of: LawRows<'_>, compliance: f64) -> Factored {
        match (self, piece) {
            (Self::Axes(pull), MapPiece::Axes(pieces)) => pull.factored(pieces, of, compliance),
            (Self::Cone(pull), piece) => pull.factored(piece, of.rows, compliance),
            (Self::Axes(_), _) => Factored::nothing(),
        }
    }
}

impl Barrier {
    /// No change.
    pub(super) fn nothing(&self) -> Self {
        match self {
            Self::Cone(_) => Self::Cone(ConeBarrier::ZERO),
            Self::Axes(axes) => Self::Axes(axes.nothing()),
        }
    }

    /// p̂, m/s, in the axes of the rows.
    pub(super) fn impulse(&self) -> Vector3<f64> {
        match self {
            Self::Cone(cone) => cone.impulse(),
            Self::Axes(axes) => axes.impulse(),
        }
    }

    /// How far the speeds of the rows here are from û, m/s, where they move by u, in their axes.
    pub(super) fn error(&self, u: &Vector3<f64>, graphs: &[Graph]) -> f64 {
        match self {
            Self::Cone(cone) => cone.error(u),
            Self::Axes(axes) => axes.error(u, graphs),
        }
    }

    /// The sum of the products that go to κ, m²/s², and how many there are.
    pub(super) fn products(&self) -> (f64, usize) {
        match self {
            Self::Cone(cone) => (cone.products(), ConeBarrier::PRODUCTS),
            Self::Axes(_) => (0.0, 0),
        }
    }

    /// The equations linearised, with products of `kappa` to second order along `predictor`, and solved for the impulse:
    /// offset and gain of δp̂ by δu, in the axes of the rows, where these move by u. `None` where there is none.
    pub(super) fn eliminate(
        &self,
        kappa: f64,
        predictor: &Self,
        u: &Vector3<f64>,
        graphs: &[Graph],
    ) -> Option<(Vector3<f64>, Matrix3<f64>, Pending)> {
        match (self, predictor) {
            (Self::Cone(cone), Self::Cone(predictor)) => cone.eliminate(kappa, predictor, u),
            (Self::Axes(axes), _) => Some(axes.eliminate(u, graphs)),
            (Self::Cone(_), Self::Axes(_)) => None,
        }
    }

    /// The largest of what the products miss of κ, m²/s².
    pub(super) fn off_centre(&self, kappa: f64) -> f64 {
        match self {
            Self::Cone(cone) => cone.off_centre(kappa),
            Self::Axes(_) => 0.0,
        }
    }

    /// δp̂ by δμ on the central path, in the axes of the rows; `None` of rows that do not rub.
    pub(super) fn by_friction(&self) -> Option<Vector3<f64>> {
        match self {
            Self::Cone(cone) => cone.by_friction(),
            Self::Axes(_) => None,
        }
    }

    /// The step of all variables for those of the impulse and of the rows' motion, in their axes.
    pub(super) fn step(
        &self,
        impulse: &Vector3<f64>,
        moved: &Vector3<f64>,
        rest: &Pending,
    ) -> Self {
        match self {
            Self::Cone(cone) => Self::Cone(cone.step(impulse, moved, rest)),
            Self::Axes(axes) => Self::Axes(axes.step(impulse)),
        }
    }

    /// These and `length` times `step`.
    pub(super) fn moved(&self, step: &Self, length: f64) -> Self {
        match (self, step) {
            (Self::Cone(cone), Self::Cone(step)) => Self::Cone(cone.moved(step, length)),
            (Self::Axes(axes), Self::Axes(step)) => Self::Axes(axes.moved(step, length)),
            _ => *self,
        }
    }

    /// The longest step that stays inside, at most 1.
    pub(super) fn longest_step(&self, step: &Self) -> f64 {
        match (self, step) {
            (Self::Cone(cone), Self::Cone(step)) => cone.longest_step(step),
            _ => 1.0,
        }
    }
}
