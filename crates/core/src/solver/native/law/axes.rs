//! The law of a joint's rows: on each axis a graph of its own.
//!
//! Equation numbers are those of `docs/joints.md`.

use super::answer::{Answer, Factored};
use super::cone_barrier::Pending;
use super::map::NaturalMap;
use super::rows::{CouplingRows, LawRows};
use crate::joint::{Graph, Segment};
use crate::solver::native::settings::COMPLIANCE;
use nalgebra::{Matrix3, Vector3};

/// Three rows, each under a graph.
#[derive(Debug, Clone, Copy)]
pub(in super::super) struct AxesLaw {
    /// The place of the graph of each row that is not locked among those of the step.
    places: [u32; 3],
    /// Which of them are locked.
    locked: [bool; 3],
    /// Whether the rows are in axes of their own, not in those in which the coupling moves. Where all are locked, any axes will do.
    turned: bool,
}

static LOCKED: Graph = Graph::locked();

impl AxesLaw {
    /// Those of three graphs, `None` of a row that is locked; the others join the `graphs` of a step. `turned` tells whether
    /// the frame of the rows is another one than the identity.
    pub(in super::super) fn new(
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

    /// A piece of the graph of row k.
    pub(in super::super) fn segment(&self, graphs: &[Graph], k: usize, piece: u8) -> Segment {
        self.of(graphs, k).segment(usize::from(piece))
    }

    /// That of row k.
    fn of<'a>(&self, graphs: &'a [Graph], k: usize) -> &'a Graph {
        if self.locked[k] { &LOCKED } else { &graphs[self.places[k] as usize] }
    }

    /// What has these parts along the rows.
    #[inline]
    fn out(&self, rows: &CouplingRows, along: Vector3<f64>) -> Vector3<f64> {
        if self.turned { rows.frame * along } else { along }
    }

    /// The parts along the rows.
    #[inline]
    fn along(&self, rows: &CouplingRows, of: Vector3<f64>) -> Vector3<f64> {
        if self.turned { rows.frame.tr_mul(&of) } else { of }
    }

    /// Whether all of them are locked.
    fn all_locked(&self) -> bool {
        self.locked == [true; 3]
    }
}

/// The arguments of the projections of three rows, y = p̂ − ρ û, in their axes; those of three that are locked in the axes in which
/// the coupling moves.
#[derive(Debug, Clone, Copy)]
pub(in super::super) struct AxesProjection {
    axes: AxesLaw,
    /// û.
    u: Vector3<f64>,
    /// p̂.
    p: Vector3<f64>,
    rho: Vector3<f64>,
}

impl AxesProjection {
    // Not within the loops over the contacts of one body, which have none.
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

    fn pull(&self, k: usize) -> f64 {
        self.p[k] - self.rho[k] * self.u[k]
    }

    fn along_rows(&self, of: impl Fn(usize) -> f64) -> Vector3<f64> {
        Vector3::new(of(0), of(1), of(2))
    }

    /// (p̂ − P(y))/ρ of each row.
    pub(super) fn natural_map(&self, rows: &CouplingRows, graphs: &[Graph]) -> Vector3<f64> {
        if self.axes.all_locked() {
            return self.axes.out(rows, self.u);
        }
        let asked = |k: usize| self.axes.of(graphs, k).projected(self.pull(k), self.rho[k]);
        let missed = self.along_rows(|k| match self.axes.locked[k] {
            true => self.u[k],
            false => (self.p[k] - asked(k)) / self.rho[k],
        });
        self.axes.out(rows, missed)
    }

    pub(super) fn pieces(&self, graphs: &[Graph]) -> [u8; 3] {
        // A locked row has one piece, on both sides of its corner, and so has every straight line.
        let piece = |k: usize| match self.axes.of(graphs, k) {
            graph if graph.is_straight() => 0,
            graph => graph.piece(self.pull(k), self.rho[k]) as u8,
        };
        [piece(0), piece(1), piece(2)]
    }

    /// How many of the `pieces` are vertical.
    pub(super) fn stiff_rows(&self, pieces: [u8; 3], graphs: &[Graph]) -> usize {
        let piece = |k: usize| self.axes.of(graphs, k).segment(usize::from(pieces[k]));
        (0..3).filter(|&k| piece(k).is_vertical()).count()
    }

    /// The nearest change of a row that is not locked.
    pub(super) fn margin(&self, graphs: &[Graph]) -> f64 {
        let free = (0..3).filter(|k| !self.axes.locked[*k]);
        let margin = |k: usize| self.axes.of(graphs, k).margin(self.pull(k), self.rho[k]);
        free.map(margin).fold(f64::INFINITY, f64::min)
    }

    /// The nearest corner of a row, which no straight line has.
    pub(super) fn clearance(&self, graphs: &[Graph]) -> f64 {
        let graph = |k: usize| self.axes.of(graphs, k);
        let bent = (0..3).filter(|k| !graph(*k).is_straight());
        let margin = |k: usize| graph(k).margin(self.pull(k), self.rho[k]);
        bent.map(margin).fold(f64::INFINITY, f64::min)
    }

    /// The largest speed of a row that a stop or friction holds. That of a locked one is where its joint ends over h, and adds
    /// nothing up from step to step.
    pub(super) fn held_speed(&self, graphs: &[Graph]) -> f64 {
        let held = (0..3).filter(|k| !self.axes.locked[*k]);
        let speed = |k: usize| {
            let graph = self.axes.of(graphs, k);
            let segment = graph.segment(graph.piece(self.pull(k), self.rho[k]));
            if segment.is_vertical() { (self.u[k] - segment.u).abs() } else { 0.0 }
        };
        held.map(speed).fold(0.0, f64::max)
    }

    /// The `pieces` linearised and solved for the impulse, with ε = `compliance`. Of the piece through (u₀, p₀)
    /// along (u′, p′), with δû = δu + ε δp̂,
    ///
    /// ```text
    /// δp̂ (u′ − ε p′) = p′ (û − u₀) − u′ (p̂ − p₀) + p′ δu                     (J5)
    /// ```
    pub(super) fn answer(&self, pieces: [u8; 3], of: LawRows<'_>, compliance: f64) -> Answer {
        let LawRows { rows, graphs } = of;
        if self.axes.all_locked() {
            let stiffness = 1.0 / compliance;
            return Answer::stick(self.axes.out(rows, self.u) * -stiffness, stiffness);
        }
        let (offset, gain) = self.along_axes(pieces, graphs, compliance);
        let diagonal = Matrix3::from_diagonal(&gain);
        let gain = match self.axes.turned {
            true => rows.frame * diagonal * rows.frame.transpose(),
            false => diagonal,
        };
        Answer::full(self.axes.out(rows, offset), gain)
    }

    /// The offset of that alone.
    pub(super) fn offset(&self, pieces: [u8; 3], of: LawRows<'_>, compliance: f64) -> Vector3<f64> {
        let LawRows { rows, graphs } = of;
        match self.axes.all_locked() {
            true => self.axes.out(rows, self.u) * -(1.0 / compliance),
            false => self.axes.out(rows, self.along_axes(pieces, graphs, compliance).0),
        }
    }

    /// The gains of the `pieces` in their axes, with ε = `compliance`.
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
            let on = self.axes.of(graphs, k).segment(usize::from(pieces[k]));
            let soft = on.du - compliance * on.dp;
            offset[k] = (on.dp * (self.u[k] - on.u) - on.du * (self.p[k] - on.p)) / soft;
            gain[k] = on.dp / soft;
        }
        (offset, gain)
    }
}

/// The rows of a joint in an interior point: they have no interior, and are solved there as by Newton's
/// method.
#[derive(Debug, Clone, Copy)]
pub(in super::super) struct AxesBarrier {
    pull: AxesProjection,
}

impl AxesBarrier {
    pub(super) fn new(axes: &AxesLaw, rows: &CouplingRows) -> Self {
        let zero = Vector3::zeros();
        Self { pull: AxesProjection { axes: *axes, u: zero, p: zero, rho: rows.scale } }
    }

    pub(super) fn nothing(&self) -> Self {
        Self { pull: AxesProjection { p: Vector3::zeros(), ..self.pull } }
    }

    pub(super) fn impulse(&self) -> Vector3<f64> {
        self.pull.p
    }

    fn at(&self, u: &Vector3<f64>) -> AxesProjection {
        AxesProjection { u: u + COMPLIANCE * self.pull.p, ..self.pull }
    }

    /// How far the rows are from their graphs where they move by u, m/s.
    pub(super) fn error(&self, u: &Vector3<f64>, graphs: &[Graph]) -> f64 {
        let at = self.at(u);
        let missed = |k: usize| at.axes.of(graphs, k).residual(at.u[k], at.p[k], at.rho[k]);
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
        Self { pull: AxesProjection { p: *impulse, ..self.pull } }
    }

    pub(super) fn moved(&self, step: &Self, length: f64) -> Self {
        Self { pull: AxesProjection { p: self.pull.p + length * step.pull.p, ..self.pull } }
    }
}
