//! Iterate of Newton's method and its residuals.
//!
//! Equation numbers refer to `docs/native-solver.md`.

use crate::solver::native::coupling::Coupling;
use crate::solver::native::equations::{Equations, MapResidual, Velocities, reserve};
use crate::solver::native::law::{Factored, LawRows, MapPiece, NaturalMap, Projection};
use nalgebra::Vector3;

/// Iterate of Newton's method.
#[derive(Debug, Clone)]
pub(crate) struct Iterate<E: Equations> {
    pub(crate) velocity: E::Velocity,
    /// p̂ of every coupling (m/s, world).
    pub(crate) impulses: Vec<Vector3<f64>>,
    /// u of every coupling (N2) at the last evaluation, without shifts (m/s, world).
    pub(super) points: Vec<Vector3<f64>>,
    /// Projection arguments of every coupling for the map evaluated last.
    pub(super) projections: Vec<Projection>,
    /// Residual of the equations of motion. Independent of the natural map.
    pub(super) motion: MapResidual,
    /// Map evaluated last; `residual` belongs to it.
    pub(super) map: NaturalMap,
    pub(super) residual: MapResidual,
    /// ε D p̂_0 of every coupling (m/s), for compliance on changes from impulses p̂_0 (N13). Empty
    /// otherwise.
    pub(super) shifts: Vec<Vector3<f64>>,
    pub(super) scratch: E::Scratch,
}

impl<E: Equations> Iterate<E> {
    pub(crate) fn new() -> Self {
        Self {
            velocity: E::Velocity::empty(),
            impulses: Vec::new(),
            points: Vec::new(),
            projections: Vec::new(),
            motion: MapResidual::default(),
            map: NaturalMap::EXACT,
            residual: MapResidual::default(),
            shifts: Vec::new(),
            scratch: E::Scratch::default(),
        }
    }

    pub(crate) fn reserve(&mut self, contacts: usize) {
        reserve(&mut self.impulses, contacts);
        reserve(&mut self.points, contacts);
        reserve(&mut self.projections, contacts);
        reserve(&mut self.shifts, contacts);
    }

    /// Largest speed of a row that an impulse holds, at the last evaluation (m/s).
    pub(crate) fn held_speed(&self, equations: &E) -> f64 {
        self.projections
            .iter()
            .map(|projection| projection.held_speed(equations.graphs()))
            .fold(0.0, f64::max)
    }

    /// Distance of every coupling to the nearest kink of its law, at the last evaluation (m/s).
    pub(crate) fn margins(&self, equations: &E) -> impl Iterator<Item = f64> {
        self.projections.iter().map(|projection| projection.clearance(equations.graphs()))
    }

    /// Lower bound of the number of stiff rows, at the last evaluation.
    pub(crate) fn stiff_rows(&self, equations: &E) -> usize {
        let rows = |projection: &Projection| projection.stiff_rows(equations.graphs());
        self.projections.iter().map(rows).sum()
    }

    /// Factored gain of coupling `index` on a piece, with ε = `compliance`, at the last evaluation.
    pub(crate) fn factored(
        &self,
        equations: &E,
        index: usize,
        piece: MapPiece,
        compliance: f64,
    ) -> Factored {
        let law_rows =
            LawRows { rows: &equations.couplings()[index].rows, graphs: equations.graphs() };
        self.projections[index].factored(piece, law_rows, compliance)
    }

    /// u of every coupling at the last evaluation (m/s).
    pub(crate) fn points(&self) -> &[Vector3<f64>] {
        &self.points
    }

    /// Evaluates u of every coupling.
    pub(crate) fn evaluate_points(&mut self, equations: &E) {
        equations.set_points(&self.velocity, &mut self.scratch, &mut self.points);
    }

    /// Lets the compliance of `map` act on changes from the current impulses only (N13).
    pub(crate) fn keep_impulses(&mut self, equations: &E, map: &NaturalMap) {
        let contacts = self.impulses.iter().zip(equations.couplings());
        let NaturalMap { compliance, .. } = *map;
        let shift = |(impulse, contact): (&Vector3<f64>, &Coupling)| {
            compliance * contact.rows.compliant_motion(compliance, impulse)
        };
        self.shifts.clear();
        self.shifts.extend(contacts.map(shift));
    }

    /// Lets the compliance act on the whole impulses again, from the next evaluation on.
    pub(crate) fn forget_impulses(&mut self) {
        self.shifts.clear();
    }

    /// Rounding error of the residual by the impulses (m/s), eq. 22a.
    pub(crate) fn rounding(&mut self, equations: &E) -> f64 {
        equations.rounding(&self.impulses, &mut self.scratch)
    }

    pub(crate) fn is_finite(&self) -> bool {
        let impulses = self.impulses.iter().flatten();
        self.velocity.is_finite() && impulses.into_iter().all(|number| number.is_finite())
    }

    pub(crate) fn copy_from(&mut self, other: &Self) {
        self.velocity.copy_from(&other.velocity);
        self.impulses.clone_from(&other.impulses);
        self.points.clone_from(&other.points);
        self.projections.clone_from(&other.projections);
        self.motion = other.motion;
        self.map = other.map;
        self.residual = other.residual;
    }
}

/// Residual of the law without compliance (m/s).
pub(crate) fn exact_residual<E: Equations>(equations: &E, iterate: &mut Iterate<E>) -> f64 {
    evaluate(equations, &NaturalMap::EXACT, iterate).largest
}

/// Evaluates the equations of motion (N1) and the natural map (N4), all as velocities.
pub(crate) fn evaluate<E: Equations>(
    equations: &E,
    map: &NaturalMap,
    iterate: &mut Iterate<E>,
) -> MapResidual {
    let Iterate { velocity, impulses, points, scratch, motion, .. } = &mut *iterate;
    *motion = equations.motion_residual(velocity, impulses, scratch);
    equations.set_points(velocity, scratch, points);
    evaluate_again(equations, map, iterate)
}

/// Evaluates another law at the point evaluated last.
pub(crate) fn evaluate_again<E: Equations>(
    equations: &E,
    map: &NaturalMap,
    iterate: &mut Iterate<E>,
) -> MapResidual {
    if !iterate.shifts.is_empty() {
        return evaluate_shifted(equations, map, iterate);
    }
    let (mut size, graphs) = (iterate.motion, equations.graphs());
    iterate.map = *map;
    iterate.projections.clear();
    let couplings = equations.couplings().iter().zip(&iterate.impulses).zip(&iterate.points);
    for ((coupling, impulse), u) in couplings {
        let (projection, missed) =
            coupling.evaluated(map, graphs, &iterate.projections, u, impulse);
        iterate.projections.push(projection);
        size.add(&missed);
    }
    if !size.squared.is_finite() {
        // A maximum drops NaN; a sum does not.
        size.largest = f64::INFINITY;
    }
    iterate.residual = size;
    size
}

/// Variant for compliance on changes. A separate function keeps the common case fast.
#[inline(never)]
fn evaluate_shifted<E: Equations>(
    equations: &E,
    map: &NaturalMap,
    iterate: &mut Iterate<E>,
) -> MapResidual {
    let (mut size, graphs) = (iterate.motion, equations.graphs());
    iterate.map = *map;
    iterate.projections.clear();
    let points = iterate.points.iter().zip(&iterate.shifts);
    let couplings = equations.couplings().iter().zip(&iterate.impulses).zip(points);
    for ((coupling, impulse), (u, shift)) in couplings {
        let u = *u - *shift;
        let (projection, missed) =
            coupling.evaluated(map, graphs, &iterate.projections, &u, impulse);
        iterate.projections.push(projection);
        size.add(&missed);
    }
    if !size.squared.is_finite() {
        size.largest = f64::INFINITY;
    }
    iterate.residual = size;
    size
}
