//! The broad phase: which pieces there are, boxes around them on their ways, and the pairs whose boxes share something.

use super::Neighbours;
use crate::contact::Partner;
use crate::contact::memory::{Memory, Neighbour};
use crate::contact::proxy::{PieceExtent, PieceOwner, placed, proxies_of};
use crate::geometry::{Aabb, Hint, bulge};
use crate::world::World;

/// How much larger than its contents a box of the broad phase is, in parts of the reach.
const MARGIN: f64 = 0.1;

impl Neighbours {
    /// Finds the boxes and pairs anew where a piece leaves its box. `begun` tells that the starts of the
    /// ways are known to be inside.
    pub(super) fn fit_boxes(&mut self, world: &World, begun: bool) {
        let is_inside = |index: usize| {
            (begun && self.is_near(index)) || {
                let (known, around) = (&self.memory.boxes[index], self.around(world, index, begun));
                known.joined(&around) == *known
            }
        };
        let boxes = self.memory.boxes.len();
        if boxes != self.bodies.len() || !(0..boxes).all(is_inside) {
            self.search(world);
        }
    }

    /// Whether a piece has moved by less than the margin of its box since that was made: a point c by at
    /// most |r − r₀| + |A − A₀| |c|, and by the bulge of its way.
    fn is_near(&self, index: usize) -> bool {
        let body = self.bodies[index];
        let (pose, before, extent) =
            (&self.poses[body], &self.memory.searched[body], &self.extents[index]);
        let moved = (pose.position - before.position).norm()
            + extent.arm * (pose.rotation - before.rotation).norm();
        moved + bulge(extent.arm, self.ways[body].angle()) <= MARGIN * extent.size
    }

    /// The box around the way of a piece of a body, or around its end alone if its start is known to be in a box
    /// that the end is held against.
    fn around(&self, world: &World, index: usize, begun: bool) -> Aabb {
        let proxy = self.proxies[index];
        let (piece, to) = placed(world, &self.poses, proxy);
        let body = self.bodies[index];
        let from = &self.begin[body];
        let around = if begun { Aabb::of(piece, to) } else { Aabb::swept(piece, from, to) };
        around.grown(bulge(self.extents[index].arm, self.ways[body].angle()))
    }

    /// Whether the pieces that are listed are those of the world.
    pub(super) fn lists(&self, world: &World) -> bool {
        proxies_of(world).eq(self.proxies.iter().copied())
    }

    /// Lists the pieces of the world.
    pub(super) fn list(&mut self, world: &World) {
        self.memory.boxes.clear();
        self.memory.pairs.clear();
        self.memory.start.clear();
        self.list_pieces(world);
    }

    /// Makes all that follows from the world alone.
    pub(super) fn list_pieces(&mut self, world: &World) {
        self.proxies.clear();
        self.proxies.extend(proxies_of(world));
        // Where the bodies are plays no part.
        let poses = &self.poses;
        let extents =
            self.proxies.iter().map(|proxy| PieceExtent::of(placed(world, poses, *proxy).0));
        self.extents.clear();
        self.extents.extend(extents);
        self.bodies.clear();
        self.bodies.extend(self.proxies.iter().map_while(|proxy| match proxy.owner {
            PieceOwner::Body(index) => Some(index),
            PieceOwner::Fixed(_) => None,
        }));
        let fixed =
            self.proxies[self.bodies.len()..].iter().map(|proxy| placed(world, poses, *proxy));
        let fixed: Vec<_> = fixed.map(|(piece, pose)| Aabb::of(piece, pose)).collect();
        self.sweep.set_fixed(&fixed);
        self.separate(world);
    }

    /// Whether no two of the pieces, which are those of the world, may touch.
    pub(super) fn are_apart(&mut self, world: &World) -> bool {
        let (pairs, untouched, held) = &self.separations;
        if (&pairs[..], &untouched[..], &held[..]) != world.separations() {
            self.separate(world);
        }
        self.is_apart
    }

    fn separate(&mut self, world: &World) {
        let (pairs, untouched, held) = world.separations();
        self.separations.0.clear();
        self.separations.0.extend_from_slice(pairs);
        self.separations.1.clear();
        self.separations.1.extend_from_slice(untouched);
        self.separations.2.clear();
        self.separations.2.extend_from_slice(held);
        let of_bodies = self.proxies[..self.bodies.len()].iter().enumerate();
        let mut touching = of_bodies.filter(|(index, _)| world.touches(self.bodies[*index]));
        self.is_apart = touching.all(|(index, proxy)| {
            let others = self.proxies[index + 1..].iter();
            others.map(|other| other.owner).all(|other| !may_meet(world, proxy.owner, other))
        });
    }

    /// The broad phase: boxes around where the pieces are and were, and in between, and the pairs that
    /// share some of them. Pairs that were known keep their hints.
    fn search(&mut self, world: &World) {
        self.memory.boxes.clear();
        self.memory.searched.clone_from(&self.poses);
        for index in 0..self.bodies.len() {
            let around = self.around(world, index, false);
            self.memory.boxes.push(around.grown(MARGIN * self.extents[index].size));
        }
        let Self { memory, proxies, spare_pairs: spare, sweep, .. } = self;
        let Memory { boxes, pairs, .. } = memory;
        std::mem::swap(pairs, spare);
        pairs.clear();
        sweep.pairs(boxes, |i, j| {
            if may_meet(world, proxies[i].owner, proxies[j].owner) {
                let known = spare.binary_search_by(|pair| pair.proxies.cmp(&[i, j]));
                pairs.push(known.map_or_else(
                    |_| Neighbour {
                        proxies: [i, j],
                        hint: Hint::default(),
                        gap: f64::INFINITY,
                        is_bound: true,
                        kept: 0..0,
                    },
                    |place| spare[place].clone(),
                ));
            }
        });
    }
}

/// Whether pieces of two things may touch: of two that are not fixed both, nor one, nor kept apart.
fn may_meet(world: &World, a: PieceOwner, b: PieceOwner) -> bool {
    match (a, b) {
        (PieceOwner::Body(one), PieceOwner::Body(other)) => {
            one != other && world.may_touch(one, Partner::Body(other))
        }
        (PieceOwner::Body(body), PieceOwner::Fixed(fixed))
        | (PieceOwner::Fixed(fixed), PieceOwner::Body(body)) => {
            world.may_touch(body, Partner::Fixed(fixed))
        }
        (PieceOwner::Fixed(_), PieceOwner::Fixed(_)) => false,
    }
}
