//! Sweeps over the contacts, each solved for its own impulse while the others keep theirs
//! (projected Gauss–Seidel): slow to the end, but quick to find which contacts press.

use super::effort::Effort;
use super::equations::Equations;
use super::natural_map::{Law, Pull};
use super::newton::Iterate;
use super::tolerances::COMPLIANCE;

/// Brings `iterate` nearer to a solution by `number` sweeps. A contact takes the impulse that the
/// natural map (N4) asks for,
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
    effort: &mut Effort<'_>,
) {
    let law = Law::with_compliance(COMPLIANCE);
    for _ in 0..number {
        if !effort.spend() {
            return;
        }
        for (index, candidate) in equations.candidates().iter().enumerate() {
            let u = equations.point(index, &iterate.velocity);
            let impulse = iterate.impulses[index];
            let asked = Pull::new(&law, candidate, &u, &impulse).projected(candidate);
            equations.push(index, &(asked - impulse), &mut iterate.velocity);
            iterate.impulses[index] = asked;
        }
    }
}
