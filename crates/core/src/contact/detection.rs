//! Detection of the points that may touch the ground in a step, as [contacts](Contact).
//!
//! The results are *candidates* for a solver. The solution decides which of them *carry a force*
//! ([`ContactForce::carries_force`](crate::step::ContactForce::carries_force)).

use super::aside::AsideContacts;
use super::{Contact, ContactKey, Curved, EllipsoidPoint, Features, KeyIndex, Partner, Plane};
use crate::geometry::ContactPoint;
use crate::mechanics::{Pose, State};
use crate::world::World;
use nalgebra::Vector3;

/// Height at step k up to which a point is a candidate, as a fraction of the body's reach: 5 mm for
/// the tutorial's cube, the value of the tutorial.
pub const CONTACT_BAND: f64 = 0.005;

/// Tilt (rad) of a disc below which corners on it are candidates too: an impact may lay it flat within the step.
const TILTED: f64 = 0.02;

/// Rule that selects candidate points.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "serde", serde(rename_all = "kebab-case"))]
pub enum Detection {
    /// The tutorial's rule: a height of at most [`CONTACT_BAND`] at step k. A fast point can jump
    /// the band in one step. If a solver then clamps its force to zero, the step has no solution.
    Height,
    /// Rule of [`Height`](Self::Height), or a height of at most 0 after a free flight step.
    #[default]
    Predictive,
}

impl Detection {
    /// Fills `contacts` with the candidates of a step from `states` to the free flight states
    /// `free`, in the order of bodies and points.
    ///
    /// Returns true if the step needs a contact problem: if there is a candidate, or if free flight
    /// takes another point below the ground. Bodies without a state in both lists are skipped.
    pub fn find(
        self,
        world: &World,
        states: &[State],
        free: &[State],
        contacts: &mut Vec<Contact>,
    ) -> bool {
        contacts.clear();
        self.find_awake(world, states, free, &mut AsideContacts::default(), contacts)
    }

    /// Same as [`Self::find`] into empty `contacts`, without those that are set `aside`.
    pub(super) fn find_awake(
        self,
        world: &World,
        states: &[State],
        free: &[State],
        aside: &mut AsideContacts,
        contacts: &mut Vec<Contact>,
    ) -> bool {
        let Some(ground) = world.ground() else { return false };
        let mut needs_contact = false;
        let bodies = world.bodies().iter().zip(states).zip(free);
        for (index, ((body, state), free)) in bodies.enumerate() {
            let first = contacts.len();
            if aside.takes_ground_of(index, first) {
                continue;
            }
            let band = CONTACT_BAND * body.reach();
            let (pose, free) = (state.pose(), free.pose());
            let heights = world.heights(index, &pose).zip(world.heights(index, &free));
            for (point, (now, then)) in heights.enumerate() {
                let candidate = now <= band || (self == Self::Predictive && then <= 0.0);
                if candidate && is_nearest(&body.contact_points()[point], ground, &pose) {
                    contacts.push(nearest_contact(world, ground, index, point, (state, &pose)));
                }
                needs_contact |= candidate || then < 0.0;
            }
            let fall = world.fall();
            let normals = [pose, free].map(|at| at.rotation.tr_mul(ground.normal()));
            leave_out_covered(contacts, first, |disc| {
                let is_tilted =
                    |n| disc.shape.half_width(n) > fall.max(TILTED * disc.shape.longest());
                normals.iter().all(is_tilted) && disc.reaches(&disc.shape.direction(&normals[1]))
            });
        }
        needs_contact
    }

    /// Name of the rule on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Height => "height",
            Self::Predictive => "predictive",
        }
    }
}

/// Contacts of all points of all bodies with the ground at any height.
pub fn all_contacts(world: &World, states: &[State], contacts: &mut Vec<Contact>) {
    contacts.clear();
    let Some(ground) = world.ground() else { return };
    for (index, (body, state)) in world.bodies().iter().zip(states).enumerate() {
        let points = 0..body.contact_points().len();
        let pose = state.pose();
        let of_point = |point| nearest_contact(world, ground, index, point, (state, &pose));
        contacts.extend(points.map(of_point));
    }
}

/// Adds the points that the step `states` → `next` takes more than `depth` (m) below the ground and
/// that are not candidates yet.
///
/// Detection is a prediction, and an impulse on one point may push down another. Returns true if
/// there were any. Bodies without a state in both lists are skipped, and bodies with a flag in `rests`. `index` is a
/// workspace to find contacts.
pub fn admit_missed(
    world: &World,
    states: &[State],
    next: &[State],
    depth: f64,
    rests: &[bool],
    contacts: &mut Vec<Contact>,
    index: &mut KeyIndex,
) -> bool {
    let Some(ground) = world.ground() else { return false };
    let before = contacts.len();
    index.clear();
    index.reserve(contacts.capacity());
    let of_bodies = states.iter().zip(next).take(world.bodies().len());
    for (body, (state, next)) in of_bodies.enumerate() {
        if rests.get(body) == Some(&true) {
            continue;
        }
        let end = next.pose();
        for (point, height) in world.heights(body, &end).enumerate() {
            let key = ContactKey { body, point, partner: Partner::Ground, pair: None };
            if height < -depth && index.find(contacts, &key, contacts.len()).is_none() {
                let pose = state.pose();
                let found = &world.bodies()[body].contact_points()[point];
                let mut toward = Vector3::zeros();
                if let Some(one) = found.smooth() {
                    let first = ContactKey { point: point - usize::from(found.is_second), ..key };
                    let is_known = contacts[..before].iter().any(|known| known.key == first);
                    let is_flat = is_flat(found, ground, &pose);
                    // An ellipsoid that comes down away from its nearest point has a second one
                    // there. A disc that lies flat has no nearest point: it turns about the point
                    // that comes lowest. One that ends flat is supported by corners.
                    if found.is_second || is_flat {
                        toward = one.direction(&end.rotation.tr_mul(ground.normal()));
                    }
                    if found.is_second && !is_known || is_flat && toward == Vector3::zeros() {
                        continue;
                    }
                }
                let at = (state, &pose);
                contacts.push(ground_contact(world, ground, body, point, at, toward));
            }
        }
    }
    contacts.len() > before
}

/// Removes the corners from the index `first` on that lie on a disc for which `is_exact` holds: it has the exact gap of
/// the whole step. Corners that end as low as the disc would be further contacts, and could stick while it rolls.
fn leave_out_covered(
    contacts: &mut Vec<Contact>,
    first: usize,
    is_exact: impl Fn(&EllipsoidPoint) -> bool,
) {
    let disc_of = |contact: &Contact| match contact.features.curved {
        Some(Curved::Ellipsoid(disc)) => Some(disc),
        _ => None,
    };
    if !contacts[first..].iter().filter_map(disc_of).any(|disc| is_exact(&disc)) {
        return;
    }
    let mut kept = first;
    for index in first..contacts.len() {
        let Features { point, curved, .. } = contacts[index].features;
        let covers = |disc: EllipsoidPoint| is_exact(&disc) && disc.shape.contains(&point);
        let is_covered =
            curved.is_none() && contacts[first..].iter().filter_map(disc_of).any(covers);
        if !is_covered {
            contacts.swap(kept, index);
            kept += 1;
        }
    }
    contacts.truncate(kept);
}

/// True unless the point is the second one of an ellipsoid, or that of a disc that lies flat.
#[inline]
fn is_nearest(point: &ContactPoint, ground: &Plane, pose: &Pose) -> bool {
    point.ellipsoid.is_none() || !point.is_second && !is_flat(point, ground, pose)
}

/// True for a disc parallel to the ground at `pose`. Corners support it, and none of its own points
/// is nearest.
#[inline]
fn is_flat(point: &ContactPoint, ground: &Plane, pose: &Pose) -> bool {
    point.smooth().is_some_and(|one| one.is_across(&pose.rotation.tr_mul(ground.normal())))
}

type PlacedState<'a> = (&'a State, &'a Pose);

/// Contact of a body's point with the ground of the world. An ellipsoid touches at its nearest
/// point.
#[inline]
fn nearest_contact(
    world: &World,
    ground: &Plane,
    body: usize,
    point: usize,
    at: PlacedState<'_>,
) -> Contact {
    ground_contact(world, ground, body, point, at, Vector3::zeros())
}

/// Contact of a body's point with the ground of the world. An ellipsoid touches at its point in the
/// direction [`toward`](super::EllipsoidPoint::toward).
fn ground_contact(
    world: &World,
    ground: &Plane,
    body: usize,
    point: usize,
    (state, pose): PlacedState<'_>,
    toward: Vector3<f64>,
) -> Contact {
    let a = &world.bodies()[body];
    let found = &a.contact_points()[point];
    let mut features =
        Features::from_plane(found.position, found.radius, *ground.frame(), ground.offset());
    if let Some(one) = found.smooth() {
        features.roll(one, toward, (state, None), &world.lever_step());
    }
    let key = ContactKey { body, point, partner: Partner::Ground, pair: None };
    let law = world.law_between(body, Partner::Ground);
    Contact::new(key, features, law, (a, pose), None)
}
