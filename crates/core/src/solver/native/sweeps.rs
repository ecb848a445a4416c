//! Sweeps over the couplings, each solved for its own impulse while the others keep theirs
//! (projected Gauss–Seidel): slow to the end, but quick to find which contacts press.

use super::effort::SolveEffort;
use super::equations::Equations;
use super::law::NaturalMap;
use super::newton::Iterate;
use super::tolerances::COMPLIANCE;

/// Brings `iterate` nearer to a solution by `number` sweeps. A coupling takes the impulse that the
/// projections of its law give, of a contact (N4)
///
/// ```text
/// γ ← max(0, γ − ρ_n û_n),   β ← Π_{μγ}(β − ρ_t û_t)
/// ```
///
/// and the velocities follow.
pub(super) fn sweep<E: Equations>(
    equations: &E,
    number: u32,
    iterate: &mut Iterate<E>,
    effort: &mut SolveEffort<'_>,
) {
    let map = NaturalMap::with_compliance(COMPLIANCE);
    for _ in 0..number {
        if !effort.spend() {
            return;
        }
        for (index, coupling) in equations.couplings().iter().enumerate() {
            let u = equations.point(index, &iterate.velocity);
            let impulse = iterate.impulses[index];
            let asked =
                coupling.pull(&map, &u, &impulse).projected(&coupling.rows, equations.graphs());
            equations.push(index, &(asked - impulse), &mut iterate.velocity);
            iterate.impulses[index] = asked;
        }
    }
}
