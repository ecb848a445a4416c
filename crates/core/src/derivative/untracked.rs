//! Distance of a step to new contacts: the nearest pairs that are not contacts.

use crate::contact::{Contact, ContactKey, Partner};
use crate::geometry::{Aabb, Hint, PairScratch, Piece, signed_distance};
use crate::mechanics::{Pose, State};
use crate::world::World;
use nalgebra::{Matrix3, Vector3};

/// Distance of the nearest points and pieces that may touch but are not in `contacts`, at `states`
/// (m); at most `beyond`.
pub(crate) fn nearest_untracked(
    world: &World,
    states: &[State],
    contacts: &[Contact],
    beyond: f64,
) -> f64 {
    let is_seen = |key: &dyn Fn(&ContactKey) -> bool| contacts.iter().any(|c| key(&c.key));
    let mut nearest = beyond;
    for (body, state) in states.iter().enumerate() {
        let points = world.bodies()[body].contact_points();
        for (point, height) in world.heights(body, &state.pose()).enumerate() {
            // The second point of an ellipsoid is as high as the first.
            if points[point].is_second {
                continue;
            }
            let is = |key: &ContactKey| {
                (key.body, key.point, key.partner) == (body, point, Partner::Ground)
            };
            if height.abs() < nearest && !is_seen(&is) {
                nearest = height.abs();
            }
        }
    }
    // Without other bodies and fixed pieces only the ground counts.
    if states.len() == 1 && world.fixed_count() == 0 {
        return nearest;
    }
    let poses: Vec<Pose> = states.iter().map(State::pose).collect();
    let still = Pose { position: Vector3::zeros(), rotation: Matrix3::identity() };
    let at = |of: &Partner| of.body().map_or(&still, |body| &poses[body]);
    // Owner, index, centre and radius of the bounding sphere of a piece.
    let placed = |of: Partner, number: usize, piece: &Piece| {
        let pose = at(&of);
        let middle = pose.position + pose.rotation * piece.core().centre();
        (of, number, middle, piece.core().reach() + piece.radius())
    };
    let of_body = |body: usize| {
        let pieces = world.bodies()[body].pieces().iter().enumerate();
        pieces.map(move |(number, piece)| (Partner::Body(body), number, piece))
    };
    let fixed = world.fixed().iter().enumerate();
    let all: Vec<_> = (0..poses.len())
        .flat_map(of_body)
        .chain(fixed.map(|(index, fixed)| (Partner::Fixed(index), 0, fixed)))
        .map(|(of, number, piece)| (placed(of, number, piece), piece))
        .collect();
    // Pieces of bodies come first, so that the loops end at the first fixed one.
    let (mut hint, mut scratch) = (Hint::default(), PairScratch::default());
    let first = world.fixed().len();
    for (index, terrain) in world.terrains().iter().enumerate() {
        let owner = Partner::Fixed(first + index);
        for (a, of_a) in all.iter().take_while(|(a, _)| a.0.body().is_some()) {
            let Some(body) = a.0.body().filter(|body| world.may_touch(*body, owner)) else {
                continue;
            };
            // A piece with a contact is held by it wherever it touches the terrain.
            let is = |key: &ContactKey| {
                (key.body, key.partner) == (body, owner)
                    && key.pair.is_some_and(|pair| pair.pieces.0 == a.1)
            };
            if is_seen(&is) {
                continue;
            }
            let pose = at(&a.0);
            terrain.visit(&Aabb::from_piece(of_a, pose).grown(nearest), |triangle| {
                let Some(facet) = terrain.piece(triangle) else { return };
                let found =
                    signed_distance((*of_a, pose), (facet, &still), &mut hint, &mut scratch);
                nearest = nearest.min(found.distance.abs());
            });
        }
    }
    for (place, (a, of_a)) in all.iter().enumerate() {
        let Some(body) = a.0.body() else { break };
        for (b, of_b) in &all[place + 1..] {
            // Bounding spheres first: most pairs are far apart.
            let reach = a.3 + b.3 + nearest;
            let is_far = (a.2 - b.2).norm_squared() >= reach * reach;
            if is_far || b.0 == Partner::Body(body) || !world.may_touch(body, b.0) {
                continue;
            }
            let is = |key: &ContactKey| {
                let pieces = key.pair.map(|pair| pair.pieces);
                let own = (Partner::Body(key.body), key.partner, pieces);
                own == (a.0, b.0, Some((a.1, b.1))) || own == (b.0, a.0, Some((b.1, a.1)))
            };
            if is_seen(&is) {
                continue;
            }
            let found =
                signed_distance((*of_a, at(&a.0)), (*of_b, at(&b.0)), &mut hint, &mut scratch);
            nearest = nearest.min(found.distance.abs());
        }
    }
    nearest
}
