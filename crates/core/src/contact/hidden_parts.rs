//! Edges and vertices of fixed pieces that other fixed pieces hide, found once for each piece.
//!
//! An edge joins a face with the normal u to a side s. The piece beside it goes on with the face if it has u
//! and −s along a stretch of the edge, and no other normal but −u. Then s is not [exposed](super::exposure)
//! there, the only normals of both pieces are ±u, and the level directions (4e) of both fill the circle about u.
//! So the edge has no contact of its own, whatever else is at the point. A vertex with the normals u, s₁ and s₂ has none if both of its sides end in this way, and if the
//! level directions of the pieces with u there leave less than half of the circle free.

use super::collider::{Collider, Colliders, PieceOwner, placed, size};
use super::cones::{FLUSH, LocalSurface, leaves_free};
use crate::geometry::{Aabb, CorePart, Piece};
use crate::world::World;
use nalgebra::Vector3;
use std::f64::consts::PI;

/// Distance of other surfaces from the part, in units of that in which surfaces are one. Exposure looks
/// three units beside a point.
const CLEAR: f64 = 4.0;
/// Distance up to which surfaces meet at the part, in the same units.
const MEETS: f64 = 1e-3;
/// Sine of angles that are zero. Exposure allows a thousand times more.
const PARALLEL: f64 = 1e-9;
/// Angle by which the free part of the circle is less than half (rad).
const LESS: f64 = 1e-3;
/// Cosine between the normal of a contact and one of the part's normals from which the contact is outside.
const OUTWARD: f64 = 0.1;
/// Smallest distance in which surfaces are one, over the coordinates: points have rounding errors.
const ROUNDING: f64 = 1e-12;

/// An edge or a vertex of a fixed piece that others hide.
#[derive(Debug, Clone)]
pub(super) struct HiddenPart {
    part: CorePart,
    /// Ends of the hidden stretch of an edge (m); the vertex twice.
    ends: [Vector3<f64>; 2],
    /// Normals of the piece at the part.
    normals: Vec<Vector3<f64>>,
    /// Largest distance of the surfaces that meet there (m).
    gap: f64,
    /// Numbers of the colliders that hide it.
    pub(super) by: Vec<usize>,
}

impl HiddenPart {
    /// True if it hides the `part` of its piece at `point` (m) from a contact with the outward `normal`.
    /// Surfaces are one up to the distance `within` (m).
    pub(super) fn hides(
        &self,
        part: CorePart,
        point: &Vector3<f64>,
        normal: &Vector3<f64>,
        within: f64,
    ) -> bool {
        if part != self.part || within < 2.0 * self.gap + ROUNDING * (1.0 + point.amax()) {
            return false;
        }
        let [from, to] = self.ends;
        let along = to - from;
        let way = along.dot(&(point - from));
        let is_between = 0.0 <= way && way <= along.norm_squared();
        let is_there = match part {
            CorePart::Edge(_) => is_between,
            _ => (point - from).norm() <= 0.25 * within,
        };
        is_there && self.normals.iter().any(|m| m.dot(normal) >= OUTWARD)
    }
}

/// Surfaces of a fixed piece at one or two points: those that meet there, and the heights of the others.
struct SurfacesAt {
    on: Vec<Vector3<f64>>,
    gap: f64,
    /// Heights of the other surfaces at both points (m).
    off: Vec<[f64; 2]>,
}

impl SurfacesAt {
    /// Surfaces of `piece` at the `points` (m). They meet up to the distance `tolerance` (m). `None` if the
    /// piece does not come to the line between the points. `heights` is a workspace.
    fn new(
        piece: &Piece,
        [one, other]: &[Vector3<f64>; 2],
        tolerance: f64,
        heights: &mut Vec<f64>,
    ) -> Option<Self> {
        heights.clear();
        piece.all_surfaces(one, 0.0, |height, _| {
            heights.push(height);
            true
        });
        let mut place = 0;
        let comes_there = piece.all_surfaces(other, 0.0, |height, _| {
            place += 1;
            heights[place - 1].min(height) <= tolerance
        });
        if !comes_there {
            return None;
        }
        let mut surfaces = Self { on: Vec::new(), gap: 0.0, off: Vec::new() };
        let mut first = heights.iter();
        piece.all_surfaces(other, 0.0, |second, normal| {
            let first = *first.next().unwrap_or(&second);
            let most = first.abs().max(second.abs());
            if most <= tolerance {
                surfaces.on.push(normal);
                surfaces.gap = surfaces.gap.max(most);
            } else {
                surfaces.off.push([first, second]);
            }
            true
        });
        Some(surfaces)
    }

    /// Part of the line between the points on which the other surfaces are `clear` (m) away. It ends
    /// before it starts if there is none.
    fn stretch(&self, clear: f64) -> [f64; 2] {
        self.off.iter().fold([0.0, 1.0], |[from, to], [first, second]| {
            let (room, rise) = (-clear - first, second - first);
            match rise {
                _ if rise > 0.0 => [from, to.min(room / rise)],
                _ if rise < 0.0 => [from.max(room / rise), to],
                _ if room < 0.0 => [1.0, 0.0],
                _ => [from, to],
            }
        })
    }

    /// True if one of the surfaces that meet has the normal `m`.
    fn has(&self, m: &Vector3<f64>) -> bool {
        self.on.iter().any(|other| (other - m).norm() <= PARALLEL)
    }

    /// True if the other piece goes on with the face `u` beyond the side `s` of this one: it has the normals
    /// u and −s, and none that faces away from `along`, the direction of the edge.
    fn goes_on(&self, u: &Vector3<f64>, s: &Vector3<f64>, along: &Vector3<f64>) -> bool {
        let fits = |m: &Vector3<f64>| m.dot(u).abs() <= PARALLEL || (m - u).norm() <= PARALLEL;
        let fits = |m: &Vector3<f64>| fits(m) || (m + u).norm() <= PARALLEL;
        self.has(u) && self.has(&-s) && self.on.iter().all(|m| fits(m) && m.dot(along) <= PARALLEL)
    }
}

/// True for a polyhedron or a facet.
fn is_sharp(piece: &Piece) -> bool {
    piece.radius() == 0.0 && piece.smooth().is_none() && !piece.core().faces().is_empty()
}

/// Edges and vertices of the fixed piece `number` that other fixed pieces hide.
pub(super) fn hidden_parts(world: &World, colliders: &Colliders, number: usize) -> Vec<HiddenPart> {
    let piece_of = |number: usize| match colliders.at(number) {
        Collider { owner: PieceOwner::Body(_), .. } => None,
        collider => Some(placed(world, &[], collider).0).filter(|piece| is_sharp(piece)),
    };
    let Some(piece) = piece_of(number) else { return Vec::new() };
    let within = FLUSH * size(piece);
    let around = around(world, colliders, number, piece, CLEAR * within);
    let around: Vec<_> =
        around.into_iter().filter_map(|other| Some((other, piece_of(other)?))).collect();
    let heights = &mut Vec::new();
    let mut parts = Vec::new();
    for edge in 0..piece.core().edges().len() {
        add_hidden_stretches(piece, edge, &around, within, heights, &mut parts);
    }
    let vertices = 0..piece.core().vertices().len();
    parts.extend(
        vertices.filter_map(|vertex| hidden_vertex(piece, vertex, &around, within, heights)),
    );
    parts
}

/// Box around points (m), larger by `margin` (m) on all sides.
fn bounds<'a>(points: impl Iterator<Item = &'a Vector3<f64>> + Clone, margin: f64) -> Aabb {
    let far = Vector3::repeat(f64::INFINITY);
    let low = points.clone().fold(far, |low, point| low.inf(point));
    let high = points.fold(-far, |high, point| high.sup(point));
    Aabb { low, high }.grown(margin)
}

/// Numbers of the other fixed pieces that may come closer to a fixed piece than `margin` (m), in ascending
/// order.
fn around(
    world: &World,
    colliders: &Colliders,
    number: usize,
    piece: &Piece,
    margin: f64,
) -> Vec<usize> {
    let own = bounds(piece.core().vertices().iter(), margin);
    let is_near = |other: &Piece| {
        let apart = other.core().centre() - piece.core().centre();
        let reach = other.bounding_radius() + piece.bounding_radius() + margin;
        apart.norm_squared() <= reach * reach
            && bounds(other.core().vertices().iter(), 0.0).meets(&own)
    };
    let list = colliders.list().iter().enumerate();
    let fixed = list.filter(|(_, collider)| matches!(collider.owner, PieceOwner::Fixed(_)));
    let near = fixed.filter(|(_, collider)| is_near(placed(world, &[], **collider).0));
    let mut numbers: Vec<_> = near.map(|(number, _)| number).collect();
    for (fixed, first) in colliders.terrains() {
        if let Some(terrain) = world.terrain(fixed) {
            terrain.visit(&own, |triangle| {
                if bounds(terrain.corners(triangle).iter(), 0.0).meets(&own) {
                    numbers.push(first + triangle);
                }
            });
        }
    }
    numbers.retain(|other| *other != number);
    numbers.sort_unstable();
    numbers
}

/// Adds the stretches of the edge `index` of a piece along which one of the pieces `around` goes on with a
/// face to `parts`.
fn add_hidden_stretches(
    piece: &Piece,
    index: usize,
    around: &[(usize, &Piece)],
    within: f64,
    heights: &mut Vec<f64>,
    parts: &mut Vec<HiddenPart>,
) {
    let vertices = piece.core().edges()[index].vertices;
    let ends = vertices.map(|vertex| piece.core().vertices()[vertex as usize]);
    let Some(own) = SurfacesAt::new(piece, &ends, MEETS * within, heights) else { return };
    let mut of_piece = |(number, other): &(usize, &Piece)| {
        let theirs = SurfacesAt::new(other, &ends, MEETS * within, heights)?;
        // Faces of both pieces that lie against each other.
        let sides = own.on.iter().filter(|s| theirs.has(&-*s));
        // The other own faces are perpendicular to s and parallel, and the other piece goes on with them.
        let is_flush = |s: &Vector3<f64>| {
            let faces = || own.on.iter().filter(|m| *m != s);
            let perpendicular = faces().all(|m| m.dot(s).abs() <= PARALLEL);
            let mut u = faces();
            let Some(first) = u.next() else { return false };
            let is_flat = u.all(|m| (m + first).norm() <= PARALLEL);
            let rest = theirs.on.iter().filter(|m| (*m + s).norm() > PARALLEL);
            perpendicular
                && is_flat
                && faces().all(|m| theirs.has(m))
                && rest.clone().all(|m| own.has(m) && m.dot(s).abs() <= PARALLEL)
        };
        if !sides.into_iter().any(is_flush) {
            return None;
        }
        // Common stretch of the edge, as a share of its length.
        let both = [own.stretch(CLEAR * within), theirs.stretch(CLEAR * within)];
        let (from, to) = (both[0][0].max(both[1][0]), both[0][1].min(both[1][1]));
        (from < to).then(|| HiddenPart {
            part: CorePart::Edge(index as u32),
            ends: [from, to].map(|share| ends[0] + (ends[1] - ends[0]) * share),
            normals: own.on.clone(),
            gap: own.gap.max(theirs.gap),
            by: vec![*number],
        })
    };
    parts.extend(around.iter().filter_map(&mut of_piece));
}

/// The vertex `index` of a piece, if the pieces `around` go on with a face beyond both sides at it.
fn hidden_vertex(
    piece: &Piece,
    index: usize,
    around: &[(usize, &Piece)],
    within: f64,
    heights: &mut Vec<f64>,
) -> Option<HiddenPart> {
    let vertex = piece.core().vertices()[index];
    let mut surfaces = |piece: &Piece| {
        let found = SurfacesAt::new(piece, &[vertex; 2], MEETS * within, heights)?;
        // Another surface must not be near, and the point must not be outside.
        found.off.iter().all(|off| off[0] <= -CLEAR * within).then_some(found)
    };
    let own = surfaces(piece)?;
    let all = around.iter().filter_map(|(number, other)| Some((*number, surfaces(other)?)));
    let all: Vec<_> = all.collect();
    let level =
        |surfaces: &SurfacesAt| LocalSurface { normals: surfaces.on.clone(), is_rigid: true };
    // A vertex in the plane u with two sides across it.
    own.on.iter().find_map(|u| {
        let is_side = |m: &&Vector3<f64>| (*m - u).norm() > PARALLEL && (*m + u).norm() > PARALLEL;
        let sides: Vec<_> = own.on.iter().filter(is_side).collect();
        let [first, second] = sides[..] else { return None };
        if sides.iter().any(|s| s.dot(u).abs() > PARALLEL) {
            return None;
        }
        let others: Vec<_> = all.iter().filter(|(_, near)| near.has(u)).collect();
        // True if another piece goes on with u beyond the side s, along the edge that leaves the vertex.
        let ends = |s: &Vector3<f64>, other: &Vector3<f64>| {
            let along = u.cross(s);
            let along = if along.dot(other) > 0.0 { -along } else { along };
            others.iter().any(|(_, near)| near.goes_on(u, s, &along))
        };
        if !(ends(first, second) && ends(second, first)) {
            return None;
        }
        // (4e): hidden unless the level parts leave half of the circle free.
        let own_level = std::iter::once(level(&own));
        let levels: Vec<_> = own_level.chain(others.iter().map(|(_, near)| level(near))).collect();
        let is_free = leaves_free(levels.iter(), u, PI - LESS, &mut Vec::new());
        let gap = others.iter().map(|(_, near)| near.gap).fold(own.gap, f64::max);
        (!is_free).then(|| HiddenPart {
            part: CorePart::Vertex(index as u32),
            ends: [vertex; 2],
            normals: own.on.clone(),
            gap,
            by: others.iter().map(|(number, _)| *number).collect(),
        })
    })
}

#[cfg(test)]
#[path = "tests/hidden_parts.rs"]
mod tests;
