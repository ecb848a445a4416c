//! Law of joint rows: one [`Graph`] of impulse against speed for each row.
//!
//! Equation numbers refer to `docs/joints.md`.

use super::cone_barrier::Pending;
use super::local_solution::{Factored, LocalSolution};
use super::map::NaturalMap;
use super::rows::{CouplingRows, LawRows};
use crate::joint::{Graph, Segment};
use crate::solver::native::settings::COMPLIANCE;
use nalgebra::{Matrix3, Vector3};

/// Law of three rows, each with its own graph.
#[derive(Debug, Clone, Copy)]
pub(crate) struct AxesLaw {
    /// Index of each row's graph in the list of the step. Unused for a locked row.
    places: [u32; 3],
    /// True for each locked row.
    locked: [bool; 3],
    /// True if u and p̂ must be rotated to the axes of the rows. False for three locked rows, where
    /// any axes will do.
    turned: bool,
}

static LOCKED: Graph = Graph::locked();

impl AxesLaw {
    /// Law of three graphs. `None` means a locked row.
    ///
    /// The other graphs are appended to the `graphs` of the step. `turned` is true if the frame of
    /// the rows is not the identity.
    pub(crate) fn new(
        graphs: &mut Vec<Graph>,
        turned: bool,
        own: impl Fn(usize) -> Option<Graph>,
    ) -> Self {
        let mut axes = Self { places: [0; 3], locked: [true; 3], turned };
        for k in 0..3 {
            if let Some(graph) = own(k) {
                axes.locked[k] = graph.is_locked();
                axes.places[k] = graphs.len() as u32;
                graphs.push(graph);
            }
        }
        axes.turned &= !axes.all_locked();
        axes
    }

    /// Piece of the graph of row k.
    pub(crate) fn segment(&self, graphs: &[Graph], k: usize, piece: u8) -> Segment {
        self.graph(graphs, k).segment(usize::from(piece))
    }

    /// Graph of row k.
    fn graph<'a>(&self, graphs: &'a [Graph], k: usize) -> &'a Graph {
        if self.locked[k] { &LOCKED } else { &graphs[self.places[k] as usize] }
    }

    /// Rotates components along the rows to the coupling's axes.
    #[inline]
    fn out(&self, rows: &CouplingRows, along: Vector3<f64>) -> Vector3<f64> {
        if self.turned { rows.frame * along } else { along }
    }

    /// Components along the rows.
    #[inline]
    fn along(&self, rows: &CouplingRows, of: Vector3<f64>) -> Vector3<f64> {
        if self.turned { rows.frame.tr_mul(&of) } else { of }
    }

    /// True if all rows are locked.
    fn all_locked(&self) -> bool {
        self.locked == [true; 3]
    }
}

/// Projection arguments of three rows, y = p̂ − ρ û, in their axes.
///
/// Three locked rows use the axes of the coupling's motion.
#[derive(Debug, Clone, Copy)]
pub(crate) struct AxesProjection {
    axes: AxesLaw,
    /// û (m/s).
    u: Vector3<f64>,
    /// p̂ (m/s).
    p: Vector3<f64>,
    rho: Vector3<f64>,
}

impl AxesProjection {
    // Not inlined, to keep the loops over the contacts of one body small.
    #[inline(never)]
    pub(super) fn new(
        map: &NaturalMap,
        rows: &CouplingRows,
        axes: &AxesLaw,
        u: &Vector3<f64>,
        impulse: &Vector3<f64>,
    ) -> Self {
        let u = axes.along(rows, u + map.compliance * impulse);
        Self { axes: *axes, u, p: axes.along(rows, *impulse), rho: rows.scale }
    }

    fn projection(&self, k: usize) -> f64 {
        self.p[k] - self.rho[k] * self.u[k]
    }

    /// Natural map (p̂ − P(y))/ρ of each row (m/s).
    pub(super) fn natural_map(&self, rows: &CouplingRows, graphs: &[Graph]) -> Vector3<f64> {
        if self.axes.all_locked() {
            return self.axes.out(rows, self.u);
        }
        let missed =
            |k: usize| self.axes.graph(graphs, k).missed(self.u[k], self.p[k], self.rho[k]);
        let missed = |k: usize| if self.axes.locked[k] { self.u[k] } else { missed(k) };
        self.axes.out(rows, Vector3::new(missed(0), missed(1), missed(2)))
    }

    pub(super) fn pieces(&self, graphs: &[Graph]) -> [u8; 3] {
        // A locked row has one piece, on both sides of its corner. So has a straight line.
        let piece = |k: usize| match self.axes.graph(graphs, k) {
            graph if graph.is_straight() => 0,
            graph => graph.piece(self.projection(k), self.rho[k]) as u8,
        };
        [piece(0), piece(1), piece(2)]
    }

    /// Number of vertical `pieces`.
    pub(super) fn stiff_rows(&self, pieces: [u8; 3], graphs: &[Graph]) -> usize {
        let piece = |k: usize| self.axes.graph(graphs, k).segment(usize::from(pieces[k]));
        (0..3).filter(|&k| piece(k).is_vertical()).count()
    }

    /// Smallest distance of an unlocked row to its next piece (m/s).
    pub(super) fn margin(&self, graphs: &[Graph]) -> f64 {
        let free = (0..3).filter(|k| !self.axes.locked[*k]);
        let margin = |k: usize| self.axes.graph(graphs, k).margin(self.projection(k), self.rho[k]);
        free.map(margin).fold(f64::INFINITY, f64::min)
    }

    /// Smallest distance of a row to a corner of its graph (m/s). Straight lines have none.
    pub(super) fn clearance(&self, graphs: &[Graph]) -> f64 {
        let graph = |k: usize| self.axes.graph(graphs, k);
        let bent = (0..3).filter(|k| !graph(*k).is_straight());
        let margin = |k: usize| graph(k).margin(self.projection(k), self.rho[k]);
        bent.map(margin).fold(f64::INFINITY, f64::min)
    }

    /// Largest speed of a row held by a stop or by friction (m/s).
    ///
    /// A locked row is excluded. Its speed is the joint's position error over h, which does not
    /// accumulate.
    pub(super) fn held_speed(&self, graphs: &[Graph]) -> f64 {
        let held = (0..3).filter(|k| !self.axes.locked[*k]);
        let speed = |k: usize| {
            let graph = self.axes.graph(graphs, k);
            let segment = graph.segment(graph.piece(self.projection(k), self.rho[k]));
            if segment.is_vertical() { (self.u[k] - segment.u).abs() } else { 0.0 }
        };
        held.map(speed).fold(0.0, f64::max)
    }

    /// Local solution on the `pieces`, with ε = `compliance`.
    ///
    /// For the piece through (u₀, p₀) along (u′, p′), with δû = δu + ε δp̂,
    ///
    /// ```text
    /// δp̂ (u′ − ε p′) = p′ (û − u₀) − u′ (p̂ − p₀) + p′ δu                     (J5)
    /// ```
    pub(super) fn local_solution(
        &self,
        pieces: [u8; 3],
        of: LawRows<'_>,
        compliance: f64,
    ) -> LocalSolution {
        let LawRows { rows, graphs } = of;
        if self.axes.all_locked() {
            let stiffness = 1.0 / compliance;
            return LocalSolution::stick(self.axes.out(rows, self.u) * -stiffness, stiffness);
        }
        let (offset, gain) = self.along_axes(pieces, graphs, compliance);
        let diagonal = Matrix3::from_diagonal(&gain);
        let gain = if self.axes.turned {
            rows.frame * diagonal * rows.frame.transpose()
        } else {
            diagonal
        };
        LocalSolution::full(self.axes.out(rows, offset), gain)
    }

    /// Offset of the local solution alone.
    pub(super) fn offset(&self, pieces: [u8; 3], of: LawRows<'_>, compliance: f64) -> Vector3<f64> {
        let LawRows { rows, graphs } = of;
        if self.axes.all_locked() {
            self.axes.out(rows, self.u) * -(1.0 / compliance)
        } else {
            self.axes.out(rows, self.along_axes(pieces, graphs, compliance).0)
        }
    }

    /// Gains of the `pieces` in their axes, with ε = `compliance`.
    pub(super) fn factored(&self, pieces: [u8; 3], of: LawRows<'_>, compliance: f64) -> Factored {
        Factored::along(&of.rows.frame, self.along_axes(pieces, of.graphs, compliance).1)
    }

    /// Offset and gain of each row in its own axis.
    fn along_axes(
        &self,
        pieces: [u8; 3],
        graphs: &[Graph],
        compliance: f64,
    ) -> (Vector3<f64>, Vector3<f64>) {
        let (mut offset, mut gain) = (Vector3::zeros(), Vector3::zeros());
        for k in 0..3 {
            let on = self.axes.graph(graphs, k).segment(usize::from(pieces[k]));
            let soft = on.du - compliance * on.dp;
            offset[k] = (on.dp * (self.u[k] - on.u) - on.du * (self.p[k] - on.p)) / soft;
            gain[k] = on.dp / soft;
        }
        (offset, gain)
    }
}

/// Joint rows in an interior point method.
///
/// They have no interior and are solved as in Newton's method.
#[derive(Debug, Clone, Copy)]
pub(crate) struct AxesBarrier {
    projection: AxesProjection,
}

impl AxesBarrier {
    pub(super) fn new(axes: &AxesLaw, rows: &CouplingRows) -> Self {
        let zero = Vector3::zeros();
        Self { projection: AxesProjection { axes: *axes, u: zero, p: zero, rho: rows.scale } }
    }

    pub(super) fn nothing(&self) -> Self {
        Self { projection: AxesProjection { p: Vector3::zeros(), ..self.projection } }
    }

    pub(super) fn impulse(&self) -> Vector3<f64> {
        self.projection.p
    }

    fn at(&self, u: &Vector3<f64>) -> AxesProjection {
        AxesProjection { u: u + COMPLIANCE * self.projection.p, ..self.projection }
    }

    /// Largest distance of a row from its graph at the motion u (m/s).
    pub(super) fn error(&self, u: &Vector3<f64>, graphs: &[Graph]) -> f64 {
        let at = self.at(u);
        let missed = |k: usize| at.axes.graph(graphs, k).residual(at.u[k], at.p[k], at.rho[k]);
        (0..3).map(missed).fold(0.0, f64::max)
    }

    pub(super) fn eliminate(
        &self,
        u: &Vector3<f64>,
        graphs: &[Graph],
    ) -> (Vector3<f64>, Matrix3<f64>, Pending) {
        let at = self.at(u);
        let (offset, gain) = at.along_axes(at.pieces(graphs), graphs, COMPLIANCE);
        (offset, Matrix3::from_diagonal(&gain), Pending::NONE)
    }

    pub(super) fn step(&self, impulse: &Vector3<f64>) -> Self {
        Self { projection: AxesProjection { p: *impulse, ..self.projection } }
    }

    pub(super) fn moved(&self, step: &Self, length: f64) -> Self {
        Self {
            projection: AxesProjection {
                p: self.projection.p + length * step.projection.p,
                ..self.projection
            },
        }
    }
}
