//! Contacts of the touches of two pieces.

use super::proxy::{Owner, Proxy, placed, size};
use super::{Contact, ContactKey, Features, PairFeatures, Partner};
use crate::geometry::{Feature, Piece, Side, Touch};
use crate::mechanics::{Pose, RigidBody};
use crate::world::World;
use nalgebra::{Matrix3, Vector3};

/// Centres nearer than this part of the size have no direction between them.
const NO_DIRECTION: f64 = 1e-8;

/// Makes contacts of the touches of two pieces.
pub(super) struct Between<'a> {
    pub(super) world: &'a World,
    pub(super) proxies: (Proxy, Proxy),
    /// Where the bodies are where the touches were found.
    pub(super) at: &'a [Pose],
    /// Where they are at the start of the step.
    pub(super) start: &'a [Pose],
}

impl Between<'_> {
    /// The contact of a touch; `plane` counts the planes that its features have met.
    pub(super) fn contact(&self, touch: &Touch, plane: u32) -> Option<Contact> {
        let (of_point, of_plane) = match touch.point_of {
            Side::A => self.proxies,
            Side::B => (self.proxies.1, self.proxies.0),
        };
        let features = PairFeatures {
            pieces: (of_point.piece, of_plane.piece),
            feature: touch.feature,
            plane,
        };
        let across = self.across_centres(touch, of_point, of_plane);
        let (touch, at) = match &across {
            Some(across) => (across, self.start),
            None => (touch, self.at),
        };
        match (of_point.owner, of_plane.owner) {
            (Owner::Body(body), owner) => {
                let corner = self.corner(body, of_point, touch);
                let key = ContactKey {
                    body,
                    point: corner,
                    partner: owner.partner(),
                    pair: Some(features),
                };
                Some(self.make(
                    key,
                    Features {
                        point: touch.point,
                        radius: touch.point_radius,
                        frame: frame_along(&touch.normal),
                        offset: touch.offset,
                    },
                ))
            }
            (fixed @ Owner::Fixed(_), Owner::Body(body)) => {
                let pieces = (of_plane.piece, of_point.piece);
                let key = ContactKey {
                    body,
                    point: self.world.bodies()[body].point_of(of_plane.piece, 0),
                    partner: fixed.partner(),
                    pair: Some(PairFeatures { pieces, ..features }),
                };
                Some(self.make(key, turned_about(touch, &at[body])))
            }
            (Owner::Fixed(_), Owner::Fixed(_)) => None,
        }
    }

    /// A touch of two balls that was found elsewhere than at the step's start: across the line of
    /// their centres there, where forces act. They then go through both centres, and no force turns a
    /// smooth ball; the plane under-estimates how far the balls are apart. `None` for other touches.
    fn across_centres(&self, touch: &Touch, of_point: Proxy, of_plane: Proxy) -> Option<Touch> {
        if std::ptr::eq(self.at, self.start) {
            return None;
        }
        let [point, plane] =
            [of_point, of_plane].map(|proxy| placed(self.world, self.start, proxy));
        let centre = |piece: &Piece| match *piece.core().vertices() {
            [centre] => Some(centre),
            _ => None,
        };
        let (own, other) = (centre(point.0)?, centre(plane.0)?);
        let place = |pose: &Pose, centre: &Vector3<f64>| pose.position + pose.rotation * centre;
        let apart = place(point.1, &own) - place(plane.1, &other);
        let distance = apart.norm();
        if distance <= NO_DIRECTION * size(point.0).min(size(plane.0)) {
            return None;
        }
        let normal = plane.1.rotation.tr_mul(&(apart / distance));
        let radius = plane.0.radius();
        Some(Touch {
            normal,
            offset: normal.dot(&other) + radius,
            gap: distance - touch.point_radius - radius,
            ..*touch
        })
    }

    /// The contact point of a body that a touch is of.
    fn corner(&self, body: usize, proxy: Proxy, touch: &Touch) -> usize {
        let body = &self.world.bodies()[body];
        let vertex = match (touch.feature, touch.point_of) {
            (Feature::Vertex(side, vertex), of) if side == of => vertex,
            (Feature::Edges(a, _), Side::A) => first_end(body, proxy, a),
            (Feature::Edges(_, b), Side::B) => first_end(body, proxy, b),
            (Feature::Vertices(a, _), Side::A) => a,
            (Feature::Vertices(_, b), Side::B) => b,
            (Feature::Vertex(..), _) => 0,
        };
        body.point_of(proxy.piece, vertex as usize)
    }

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

/// A fixed point against a plane of the body at `pose`, as a point of the body against a fixed
/// plane, which is what a contact is: the point is the foot of the fixed point on the body's
/// plane, and the plane, turned about, stays where it is for the step.
fn turned_about(touch: &Touch, pose: &Pose) -> Features {
    let normal = pose.rotation * touch.normal;
    let surface = touch.point - normal * touch.point_radius;
    let foot = surface - normal * touch.gap;
    Features {
        point: pose.rotation.tr_mul(&(foot - pose.position)),
        radius: 0.0,
        frame: frame_along(&-normal),
        offset: -normal.dot(&surface),
    }
}

/// The first vertex of an edge of a body's piece.
fn first_end(body: &RigidBody, proxy: Proxy, edge: u32) -> u32 {
    body.pieces()[proxy.piece].core().edges()[edge as usize].vertices[0]
}

/// (t₁, t₂, n), right-handed, with t₁ across the axis that n is least along.
fn frame_along(normal: &Vector3<f64>) -> Matrix3<f64> {
    let axis = Vector3::ith(normal.iamin(), 1.0);
    let first = (axis - normal * normal.dot(&axis)).normalize();
    Matrix3::from_columns(&[first, normal.cross(&first), *normal])
}
