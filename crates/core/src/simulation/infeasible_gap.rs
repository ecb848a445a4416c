//! Diagnosis of infeasible steps: a body squeezed between two objects with prescribed motion.
//!
//! A driven or held body reaches its prescribed pose at the end of the step, whatever is in its
//! path, and a fixed piece stays. A body between two of them has only the room that they leave. The
//! search follows chains of contacts in about one direction d from one end to the other. With the
//! gaps g at the start of the step and the motions s of both ends, the missing room is
//!
//! ```text
//! d·s₁ − d·s₂ − Σ g,
//! ```
//!
//! independent of the motion of the bodies in between.

use crate::contact::{Contact, Partner};
use crate::joint::Joint;
use crate::mechanics::State;
use crate::mechanics::quaternion::{product, rotation};
use crate::world::World;
use nalgebra::{Vector3, Vector4};

/// Two objects that leave too little room for a body between them.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub struct InfeasibleGap {
    /// The two objects: driven or held bodies, fixed pieces or the ground.
    pub by: [Partner; 2],
    /// The squeezed body. If there are several, the one next to the first object.
    pub body: usize,
    /// Missing room at the end of the step (m).
    pub lacking: f64,
}

/// Largest number of bodies between the two objects.
const MOST_BETWEEN: usize = 3;
/// Smallest cosine between the normals of consecutive contacts.
const ALIKE: f64 = 0.9;

/// Search along contacts from one end.
struct SqueezeSearch<'a> {
    world: &'a World,
    states: &'a [State],
    contacts: &'a [Contact],
    /// Result with the largest missing room.
    found: Option<InfeasibleGap>,
}

/// Node of the search.
#[derive(Clone, Copy)]
struct SearchPlace {
    from: Partner,
    between: [usize; MOST_BETWEEN],
    count: usize,
    direction: Vector3<f64>,
    /// Room closed so far, d·s₁ − Σ g (m).
    closed: f64,
}

/// Worst squeeze in a step of `world` from `states` with `contacts`, if more than `least` (m) of
/// room is missing. Moving joint frames are at the end of the step.
pub(super) fn find(
    world: &World,
    states: &[State],
    contacts: &[Contact],
    least: f64,
) -> Option<InfeasibleGap> {
    let mut search = SqueezeSearch { world, states, contacts, found: None };
    for contact in contacts {
        let body = Partner::Body(contact.key.body);
        for (from, to) in [(body, contact.key.partner), (contact.key.partner, body)] {
            let Some(first) = to.body() else { continue };
            let moved = search.prescribed_displacement(from, &place(contact, states));
            let Some(moved) = moved else { continue };
            let direction = normal_into(contact, first);
            let closed = direction.dot(&moved) - contact.gap;
            let between = [first; MOST_BETWEEN];
            search.go_on(&SearchPlace { from, between, count: 1, direction, closed });
        }
    }
    search.found.filter(|squeeze| squeeze.lacking > least)
}

/// Contact point at the start of the step (m), world frame.
fn place(contact: &Contact, states: &[State]) -> Vector3<f64> {
    states[contact.key.body].position + contact.arm
}

/// Contact normal that points into `body`.
fn normal_into(contact: &Contact, body: usize) -> Vector3<f64> {
    if contact.key.body == body { contact.normal() } else { -contact.normal() }
}

impl SqueezeSearch<'_> {
    /// Displacement in the step of a point on `of` if its motion is prescribed (m); `None` for
    /// other bodies.
    fn prescribed_displacement(&self, of: Partner, point: &Vector3<f64>) -> Option<Vector3<f64>> {
        let Some(body) = of.body() else { return Some(Vector3::zeros()) };
        if self.world.is_held(body) {
            return Some(Vector3::zeros());
        }
        let holds = |joint: &&Joint| joint.body() == body && joint.holds_in_world();
        let [own, there] = self.world.joints().iter().find(holds)?.frames();
        let back =
            Vector4::new(own.attitude[0], -own.attitude[1], -own.attitude[2], -own.attitude[3]);
        let end = rotation(&product(&there.attitude, &back));
        let state = &self.states[body];
        let lever = rotation(&state.attitude).tr_mul(&(point - state.position));
        Some(there.anchor + end * (lever - own.anchor) - point)
    }

    /// Continues the search from the last body of the chain.
    fn go_on(&mut self, search_place: &SearchPlace) {
        let contacts = self.contacts;
        let last = search_place.between[search_place.count - 1];
        // A chain ends at a body with prescribed motion.
        if self.prescribed_displacement(Partner::Body(last), &Vector3::zeros()).is_some() {
            return;
        }
        for contact in contacts {
            let next = match (Partner::Body(contact.key.body), contact.key.partner) {
                (Partner::Body(body), partner) if body == last => partner,
                (body, Partner::Body(partner)) if partner == last => body,
                _ => continue,
            };
            let direction = -normal_into(contact, last);
            let is_new = |next: usize| !search_place.between[..search_place.count].contains(&next);
            if next == search_place.from || direction.dot(&search_place.direction) < ALIKE {
                continue;
            }
            let closed = search_place.closed - contact.gap;
            match self.prescribed_displacement(next, &place(contact, self.states)) {
                Some(moved) => {
                    let lacking = closed - direction.dot(&moved);
                    if self.found.is_none_or(|found| lacking > found.lacking) {
                        let by = [search_place.from, next];
                        self.found =
                            Some(InfeasibleGap { by, body: search_place.between[0], lacking });
                    }
                }
                None => {
                    let Some(next) = next.body().filter(|next| is_new(*next)) else { continue };
                    if search_place.count < MOST_BETWEEN {
                        let mut on =
                            SearchPlace { count: search_place.count + 1, closed, ..*search_place };
                        on.between[search_place.count] = next;
                        self.go_on(&on);
                    }
                }
            }
        }
    }
}
