//! Broad phase: the pieces, boxes around their trajectories, and the pairs of overlapping boxes.

use super::Neighbours;
use crate::contact::Partner;
use crate::contact::collider::{Colliders, PieceExtent, PieceOwner, placed};
use crate::contact::memory::{Clearance, Memory, NOWHERE, Neighbour};
use crate::geometry::{Aabb, Hint, bulge};
use crate::world::World;

/// Margin of a box in the broad phase, as a fraction of the piece's reach.
const MARGIN: f64 = 0.1;
/// Margin in a world with terrains, where a search is slower than a few pairs more.
const MARGIN_ON_TERRAIN: f64 = 0.3;
/// Number of pairs from which a search is crowded and ends. They need 0.6 GB.
pub(super) const MOST_PAIRS: usize = 1 << 22;

impl Neighbours {
    /// Recomputes the boxes and pairs if a piece leaves its box. If `begun`, the starts of the
    /// trajectories are known to be inside.
    pub(super) fn fit_boxes(&mut self, world: &World, begun: bool) {
        let is_inside = |index: usize| {
            (begun && self.is_near(index)) || {
                let known = &self.memory.boxes[index];
                let around = self.around(world, index, begun);
                known.joined(&around) == *known
            }
        };
        let boxes = self.memory.boxes.len();
        if boxes != self.bodies.len() || !(0..boxes).all(is_inside) {
            self.search(world);
        }
    }

    /// True if a piece has moved by less than the margin since its box was made. A point c moves by
    /// at most
    /// |r − r₀| + |A − A₀| |c| plus the bulge of its trajectory.
    fn is_near(&self, index: usize) -> bool {
        let body = self.bodies[index];
        let (pose, before, extent) =
            (&self.poses[body], &self.memory.searched[body], &self.extents[index]);
        let moved = (pose.position - before.position).norm()
            + extent.arm * (pose.rotation - before.rotation).norm();
        moved + bulge(extent.arm, self.trajectories[body].angle()) <= self.margin() * extent.size
    }

    fn margin(&self) -> f64 {
        if self.colliders.has_terrains() { MARGIN_ON_TERRAIN } else { MARGIN }
    }

    /// Box around the trajectory of a piece, or around its end alone if `begun`. In that case the
    /// start is known to be in the piece's box.
    fn around(&self, world: &World, index: usize, begun: bool) -> Aabb {
        let collider = self.colliders.at(index);
        let (piece, to) = placed(world, &self.poses, collider);
        let body = self.bodies[index];
        let from = &self.begin[body];
        let around = if begun { Aabb::from_piece(piece, to) } else { Aabb::swept(piece, from, to) };
        around.grown(bulge(self.extents[index].arm, self.trajectories[body].angle()))
    }

    /// True if the listed pieces are the current pieces of the world.
    pub(super) fn lists(&self, world: &World) -> bool {
        self.colliders.are_of(world)
    }

    /// Lists the pieces of the world and clears the search.
    pub(super) fn list(&mut self, world: &World) {
        self.memory.boxes.clear();
        self.memory.pairs.clear();
        self.memory.start.clear();
        self.list_pieces(world);
    }

    /// Recomputes all data that depend on the world alone.
    pub(super) fn list_pieces(&mut self, world: &World) {
        self.partners.forget_pieces();
        self.colliders = Colliders::new(world);
        let list = self.colliders.list();
        // Positions of the bodies are not used.
        let poses = &self.poses;
        let extents =
            list.iter().map(|collider| PieceExtent::from_piece(placed(world, poses, *collider).0));
        self.extents.clear();
        self.extents.extend(extents);
        self.bodies.clear();
        self.bodies.extend(list.iter().map_while(|collider| match collider.owner {
            PieceOwner::Body(index) => Some(index),
            PieceOwner::Fixed(_) => None,
        }));
        let fixed =
            list[self.bodies.len()..].iter().map(|collider| placed(world, poses, *collider));
        let fixed: Vec<_> = fixed.map(|(piece, pose)| Aabb::from_piece(piece, pose)).collect();
        self.sweep.set_fixed(&fixed);
        self.separate(world);
    }

    /// True if no two pieces of the world may touch.
    pub(super) fn are_apart(&mut self, world: &World) -> bool {
        if !self.separations.are(&world.separations()) {
            self.separate(world);
        }
        self.is_apart
    }

    fn separate(&mut self, world: &World) {
        self.partners.forget();
        self.separations.copy(&world.separations());
        if world.groups_exclude_pieces() {
            self.is_apart = true;
            return;
        }
        let list = self.colliders.list();
        let of_bodies = list[..self.bodies.len()].iter().enumerate();
        let mut touching = of_bodies.filter(|(index, _)| world.touches(self.bodies[*index]));
        self.is_apart = touching.all(|(index, collider)| {
            let others = list[index + 1..].iter().map(|other| other.owner);
            let terrains = self.colliders.terrains().map(|(fixed, _)| PieceOwner::Fixed(fixed));
            others.chain(terrains).all(|other| !may_meet(world, collider.owner, other))
        });
    }

    /// Recomputes the boxes around the trajectories and the pairs of overlapping boxes. Known pairs
    /// keep their hints.
    fn search(&mut self, world: &World) {
        self.partners.forget();
        self.memory.boxes.clear();
        self.memory.searched.clone_from(&self.poses);
        for index in 0..self.bodies.len() {
            let around = self.around(world, index, false);
            self.memory.boxes.push(around.grown(self.margin() * self.extents[index].size));
        }
        let Self { memory, colliders, spare_pairs: spare, sweep, bodies, triangles, .. } = self;
        let Memory { boxes, pairs, start, .. } = &mut **memory;
        std::mem::swap(pairs, spare);
        pairs.clear();
        let may_touch = |i, j| may_meet(world, colliders.at(i).owner, colliders.at(j).owner);
        let near = sweep.selected(boxes, MOST_PAIRS, may_touch).iter();
        pairs.extend(near.map(|&(i, j)| known_or_new(spare, [i as usize, j as usize])));
        let without = pairs.len();
        for (fixed, first) in colliders.terrains() {
            let Some(terrain) = world.terrain(fixed) else { continue };
            for (i, around) in boxes.iter().enumerate() {
                if pairs.len() < MOST_PAIRS
                    && may_meet(world, colliders.at(i).owner, PieceOwner::Fixed(fixed))
                {
                    terrain.visit_pieces(around, triangles, |piece| {
                        let pair = [i, first + piece];
                        // A plane that replaces triangles, or is replaced, takes no contacts over.
                        let plane = [i, first + terrain.plane(terrain.triangle_of(piece))];
                        if place_of(spare, plane).is_ok() != terrain.is_plane(piece)
                            && let Some(pose) = start.get_mut(bodies[i])
                        {
                            *pose = NOWHERE;
                        }
                        pairs.push(known_or_new(spare, pair));
                    });
                }
            }
        }
        if pairs.len() > without {
            pairs.sort_unstable_by_key(|pair| pair.colliders);
        }
    }
}

/// Place of the pair of `colliders` among sorted pairs, or the place where it would be.
fn place_of(pairs: &[Neighbour], colliders: [usize; 2]) -> Result<usize, usize> {
    pairs.binary_search_by(|pair| pair.colliders.cmp(&colliders))
}

/// The pair of `colliders` among sorted pairs, or a new one.
fn known_or_new(pairs: &[Neighbour], colliders: [usize; 2]) -> Neighbour {
    place_of(pairs, colliders).map_or_else(
        |_| Neighbour {
            colliders,
            hint: Hint::default(),
            gap: f64::INFINITY,
            is_bound: true,
            contacts: 0..0,
            clearance: Clearance::default(),
        },
        |place| pairs[place].clone(),
    )
}

/// True if pieces of two owners may touch. At least one owner is not fixed, the owners differ, and
/// the world does not keep them apart.
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
