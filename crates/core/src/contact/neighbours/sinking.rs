//! Pieces that sink into each other although the contacts of their step hold: a contact is missing.
//!
//! The depths d of a pair at both ends of a step come from the shapes alone. Contacts are fixed to their bodies
//! within a step, so that a pair may end deeper than it began by
//!
//! ```text
//! d⁺ − max(d, 0) ≤ δ = 10⁻⁴ ℓ + (ϑ r + |Δr_A − Δr_B|) ϑ,   ϑ = h (|ω_A| + |ω_B|)             (eq. 18h)
//! ```
//!
//! ℓ is the reach of the smaller piece, r that of the larger body, and Δr the way of a body's centre.

use super::super::Partner;
use super::super::collider::PieceExtent;
use super::super::placement::MISPLACED;
use super::{Neighbours, Overlap};
use crate::mechanics::State;
use crate::world::World;
use nalgebra::Vector3;

impl Neighbours {
    /// The objects of the deepest pair if the step `states` → `next` makes it deeper by more than δ (18h).
    pub(crate) fn sunk_pair(
        &mut self,
        world: &World,
        states: &[State],
        next: &[State],
    ) -> Option<[Partner; 2]> {
        let ends = |body: usize| (&states[body], &next[body]);
        let allowed = |sides: [(Partner, PieceExtent); 2]| {
            let [a, b] = sides.map(|(partner, _)| partner.body());
            let bodies = [a, b].into_iter().flatten();
            let moved = |body: Option<usize>| {
                body.map_or(Vector3::zeros(), |body| ends(body).1.position - ends(body).0.position)
            };
            let (turn, reach) = bodies.fold((0.0, 0.0_f64), |(turn, reach), body| {
                let (start, end) = ends(body);
                let turned = (end.pose().rotation - start.pose().rotation).norm();
                (turn + turned, reach.max(world.bodies()[body].reach()))
            });
            let way = (moved(a) - moved(b)).norm();
            MISPLACED * sides[0].1.size.min(sides[1].1.size) + (turn * reach + way) * turn
        };
        let Overlap { depth, allowed, between } = self.deepest(world, next, usize::MAX, allowed)?;
        let is_same = |sides: [(Partner, PieceExtent); 2]| {
            let is_it = (sides[0].0, sides[1].0) == between;
            if is_it { 0.0 } else { f64::INFINITY }
        };
        let before = self.deepest(world, states, usize::MAX, is_same);
        let before = before.map_or(0.0, |overlap| overlap.depth);
        (depth > before + allowed).then_some([between.0, between.1])
    }
}
