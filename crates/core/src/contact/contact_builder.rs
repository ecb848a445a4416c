//! Contacts from the geometric contact points of two pieces.
//!
//! The narrow phase returns [`ManifoldPoint`]es: a point of one piece against a plane of the other. This
//! module turns them into [`Contact`]s between two bodies, or a body and a fixed piece. Body A of a
//! contact owns the point, and its partner B owns the plane.

use super::collider::{Collider, PieceOwner, placed};
use super::curved::{Core, CorePair, Curved};
use super::terrain_seams::is_triangle;
use super::{Contact, ContactKey, Features, PairFeatures, Partner, frame_along};
use crate::geometry::{CorePart, Ellipsoid, Feature, ManifoldPoint, Piece, PieceSide};
use crate::mechanics::{Pose, State};
use crate::world::World;
use nalgebra::Vector3;

/// Cosine above which a plane is that of a face of a triangle.
const SAME_PLANE: f64 = 1.0 - 1e-12;

/// Converts the geometric contact points of two colliders to contacts.
pub(super) struct ContactBuilder<'a> {
    pub(super) world: &'a World,
    /// Colliders A and B of the geometric contact points. The first one is of the body with the
    /// lower index, whichever owns the point.
    pub(super) colliders: [Collider; 2],
    /// Poses of the bodies at which the geometric contact points were found.
    pub(super) at: &'a [Pose],
    /// Poses of the bodies at the start of the step.
    pub(super) start: &'a [Pose],
    /// States of the bodies at the start of the step.
    pub(super) states: &'a [State],
}

impl ContactBuilder<'_> {
    /// Contact for the geometric contact point `touch`. `None` between two fixed pieces.
    ///
    /// A step can need several planes for the same pair of features. `plane` numbers them from 0
    /// and becomes part of the key. For two round features, number 0 is a contact with the exact
    /// gap of the features. It suffices unless a fast body passes through it ([`super::collision`]).
    /// Higher numbers are a point against a plane.
    pub(super) fn contact(&self, touch: &ManifoldPoint, plane: u32) -> Option<Contact> {
        let [of_point, of_plane] = match touch.point_of {
            PieceSide::A => self.colliders,
            PieceSide::B => [self.colliders[1], self.colliders[0]],
        };
        let features = PairFeatures {
            pieces: (self.named(of_point), self.named(of_plane)),
            feature: touch.feature,
            plane,
        };
        // Two round features have an exact gap (4a).
        if let Feature::Round(..) = touch.feature
            && plane == 0
            && let Some(contact) = self.round_contact(touch, features)
        {
            return Some(contact);
        }
        match (of_point.owner, of_plane.owner) {
            (PieceOwner::Body(body), owner) => {
                let mut features = features;
                // All coplanar triangles of a terrain are one plane.
                let mut plane = (touch.normal, touch.offset);
                if is_triangle(self.world, of_plane) {
                    plane = self.plane_of_patch(touch, &mut features).unwrap_or(plane);
                }
                let key = ContactKey {
                    body,
                    // A face is named by its vertex 0.
                    point: self.corner(
                        body,
                        of_point,
                        part_on(touch.feature, touch.point_of).unwrap_or(CorePart::Vertex(0)),
                    ),
                    partner: owner.partner(),
                    pair: Some(features),
                };
                let mut features = Features::from_plane(
                    touch.point,
                    touch.point_radius,
                    frame_along(&plane.0),
                    plane.1,
                );
                let piece = &self.world.bodies()[body].pieces()[of_point.piece];
                // Ellipsoids and discs touch where they are lowest (4c).
                if let Some(one) = ellipsoid(piece, touch.feature) {
                    self.roll(&mut features, one, (body, owner));
                }
                Some(self.make(key, features))
            }
            (fixed @ PieceOwner::Fixed(_), PieceOwner::Body(body)) => {
                // The fixed piece owns the point. A contact needs a point on the body. The key
                // has vertex 0 of the body's piece, because a face touches and not a vertex.
                let pieces = (features.pieces.1, features.pieces.0);
                let key = ContactKey {
                    body,
                    point: self.world.bodies()[body].point_of(of_plane.piece, 0),
                    partner: fixed.partner(),
                    pair: Some(PairFeatures { pieces, ..features }),
                };
                Some(self.make(key, turned_about(touch, &self.at[body])))
            }
            (PieceOwner::Fixed(_), PieceOwner::Fixed(_)) => None,
        }
    }

    /// Number of a collider's piece in keys: for the plane of a patch its first triangle.
    fn named(&self, collider: Collider) -> usize {
        let terrain = match collider.owner {
            PieceOwner::Fixed(index) => self.world.terrain(index),
            PieceOwner::Body(_) => None,
        };
        terrain.map_or(collider.piece, |terrain| terrain.triangle_of(collider.piece))
    }

    /// Normal and offset (m) of the plane of a whole patch of triangles, if a vertex or an ellipsoid
    /// of the body touches the face of a triangle. The features then name the first triangle of the
    /// patch.
    fn plane_of_patch(
        &self,
        touch: &ManifoldPoint,
        features: &mut PairFeatures,
    ) -> Option<(Vector3<f64>, f64)> {
        let PieceOwner::Fixed(index) = self.colliders[1].owner else { return None };
        let (Feature::Vertex(PieceSide::A, _) | Feature::Ellipsoid(PieceSide::A, _)) =
            touch.feature
        else {
            return None;
        };
        let first = self.world.terrain(index)?.patch(features.pieces.1);
        let faces = self.world.fixed_piece(index, first)?.core().faces();
        let face = faces.iter().find(|face| face.normal.dot(&touch.normal) > SAME_PLANE)?;
        features.pieces.1 = first;
        Some((face.normal, face.offset))
    }

    /// Contact with the exact gap of two round features. `None` for the lateral surface of a cone.
    fn round_contact(&self, touch: &ManifoldPoint, features: PairFeatures) -> Option<Contact> {
        let Feature::Round(part_a, part_b) = touch.feature else { return None };
        let [a, b] = self.colliders;
        let PieceOwner::Body(body) = a.owner else { return None };
        let key = ContactKey {
            body,
            point: self.corner(body, a, part_a),
            partner: b.owner.partner(),
            pair: Some(PairFeatures { pieces: (a.piece, self.named(b)), ..features }),
        };
        let pieces = [piece(self.world, a.owner, a.piece)?, piece(self.world, b.owner, b.piece)?];
        let normal = match touch.point_of {
            PieceSide::A => touch.normal,
            // The plane belongs to A: its normal is in A's frame and points away from A.
            PieceSide::B => {
                let [a, b] =
                    [a, b].map(|collider| placed(self.world, self.at, collider).1.rotation);
                -b.tr_mul(&(a * touch.normal))
            }
        };
        Some(self.make(key, round(pieces, [part_a, part_b], &normal)?))
    }

    /// Index of the contact point of a body at a part of its piece: the vertex, the first end of the
    /// edge, or the rim.
    fn corner(&self, body: usize, collider: Collider, part: CorePart) -> usize {
        let body = &self.world.bodies()[body];
        let vertex = match part {
            CorePart::Vertex(vertex) => vertex,
            CorePart::Edge(edge) => {
                body.pieces()[collider.piece].core().edges()[edge as usize].vertices[0]
            }
            CorePart::Lateral => return body.ellipsoid_point(collider.piece, 0),
            CorePart::End(end) => return body.ellipsoid_point(collider.piece, end as usize),
        };
        body.point_of(collider.piece, vertex as usize)
    }

    /// Replaces the point by the ellipsoid `one` of a body against the plane of its partner.
    ///
    /// The force acts at the [nearest point](Features::roll). If the found point is beyond the reach
    /// of that one in a step, it acts at the found point.
    fn roll(&self, features: &mut Features, one: Ellipsoid, (body, partner): (usize, PieceOwner)) {
        let other = match partner {
            PieceOwner::Body(other) => Some(&self.states[other]),
            PieceOwner::Fixed(_) => None,
        };
        let found = -one.coordinates(&features.point);
        let at = (&self.states[body], other);
        let map = self.world.lever_step();
        features.roll(one, Vector3::zeros(), at, &map);
        let Some(Curved::Ellipsoid(nearest)) = features.curved else { return };
        if !nearest.reaches(&found) {
            features.roll(one, found.normalize(), at, &map);
        }
    }

    /// Contact of `features` with the poses at the start of the step.
    fn make(&self, key: ContactKey, features: Features) -> Contact {
        let law = self.world.law_between(key.body, key.partner);
        let bodies = self.world.bodies();
        let b = match key.partner {
            Partner::Body(other) => Some((&bodies[other], &self.start[other])),
            Partner::Fixed(_) | Partner::Ground => None,
        };
        Contact::new(key, features, law, (&bodies[key.body], &self.start[key.body]), b)
    }
}

/// Vertex, edge or ellipsoid of `feature` on one side. `None` for a face.
pub(super) fn part_on(feature: Feature, side: PieceSide) -> Option<CorePart> {
    Some(match (feature, side) {
        (Feature::Vertex(of, vertex), side) if of == side => CorePart::Vertex(vertex),
        (Feature::Edges(edge, _), PieceSide::A) | (Feature::Edges(_, edge), PieceSide::B) => {
            CorePart::Edge(edge)
        }
        (Feature::Vertices(vertex, _), PieceSide::A)
        | (Feature::Vertices(_, vertex), PieceSide::B) => CorePart::Vertex(vertex),
        (Feature::Round(part, _), PieceSide::A) | (Feature::Round(_, part), PieceSide::B) => part,
        (Feature::Ellipsoid(of, one), side) if of == side => CorePart::End(one),
        (Feature::Vertex(..) | Feature::Ellipsoid(..), _) => return None,
    })
}

/// Ellipsoid of `feature`, which is of `piece`. `None` for another feature.
pub fn ellipsoid(piece: &Piece, feature: Feature) -> Option<Ellipsoid> {
    let Feature::Ellipsoid(_, one) = feature else { return None };
    piece.smooth()?.ellipsoids().get(one as usize).copied()
}

/// Piece `number` of an owner. `None` if it does not exist.
pub(super) fn piece(world: &World, owner: PieceOwner, number: usize) -> Option<&Piece> {
    match owner {
        PieceOwner::Body(index) => world.bodies().get(index)?.pieces().get(number),
        PieceOwner::Fixed(index) => world.fixed_piece(index, number),
    }
}

/// Contact features of a part of A and a part of B, at least one rounded.
///
/// `None` if the pieces lack these parts or if both have radius 0. If the cores coincide, the plane
/// is perpendicular to `normal` (unit, frame of B).
pub fn round(pieces: [&Piece; 2], parts: [CorePart; 2], normal: &Vector3<f64>) -> Option<Features> {
    let radius = |at: usize| match parts[at] {
        CorePart::Lateral | CorePart::End(_) => pieces[at].smooth()?.radius(),
        CorePart::Vertex(_) | CorePart::Edge(_) => Some(pieces[at].radius()),
    };
    let radii = (radius(0)?, radius(1)?);
    if radii == (0.0, 0.0) {
        return None;
    }
    let (of_a, of_b) = (core(pieces[0], parts[0])?, core(pieces[1], parts[1])?);
    let pair = CorePair { of_a, of_b, radius: radii.1, shares: (0.0, 0.0) };
    let plane = Features::from_plane(of_a.from, radii.0, frame_along(normal), 0.0);
    Some(Features { curved: Some(Curved::Cores(pair)), ..plane })
}

/// Vertex, edge, axis or end of a piece (m, body frame).
fn core(piece: &Piece, part: CorePart) -> Option<Core> {
    let vertices = piece.core().vertices();
    let vertex = |number: u32| vertices.get(number as usize).copied();
    match part {
        CorePart::Vertex(number) => Some(Core { from: vertex(number)?, along: Vector3::zeros() }),
        CorePart::Edge(number) => {
            let [from, to] = piece.core().edges().get(number as usize)?.vertices;
            let from = vertex(from)?;
            Some(Core { from, along: vertex(to)? - from })
        }
        CorePart::Lateral => {
            let [from, to] = piece.smooth()?.axis()?;
            Some(Core { from, along: to - from })
        }
        CorePart::End(number) => {
            let end = *piece.smooth()?.axis()?.get(number as usize)?;
            Some(Core { from: end, along: Vector3::zeros() })
        }
    }
}

/// Exchanges point and plane: a fixed point against a plane of the body at `pose` becomes a point
/// of the body against a fixed plane.
///
/// The new point is the projection of the fixed point's surface onto the body's plane. The new
/// plane has the opposite normal. The gap is the same.
fn turned_about(touch: &ManifoldPoint, pose: &Pose) -> Features {
    let normal = pose.rotation * touch.normal;
    let surface = touch.point - normal * touch.point_radius;
    let foot = surface - normal * touch.gap;
    let point = pose.rotation.tr_mul(&(foot - pose.position));
    Features::from_plane(point, 0.0, frame_along(&-normal), -normal.dot(&surface))
}
