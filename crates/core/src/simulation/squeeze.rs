//! Why a step has no solution: something is squeezed between two things that go where they are told.
//!
//! A body that is driven, or held, is where it is to be at the end of the step, whatever is in its way. What lies between two
//! of those, or between one and what is fixed, has the room that they leave. With the gaps g at the step's start along a way
//! from one to the other that goes through contacts in about one direction d, and the motions s of both ends, what lacks is
//!
//! ```text
//! d·s₁ − d·s₂ − Σ g,
//! ```
//!
//! wherever what is between them goes.

use crate::contact::{Contact, Partner};
use crate::joint::Joint;
use crate::mechanics::State;
use crate::mechanics::quaternion::{product, rotation};
use crate::world::World;
use nalgebra::{Vector3, Vector4};

/// Two things that leave too little room for what is between them.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub struct Squeeze {
    /// What squeezes: a body that is driven or held, and another one, or what is fixed.
    pub by: [Partner; 2],
    /// The body that is squeezed; of several between them the one at the first.
    pub body: usize,
    /// The room that lacks at the end of the step, m.
    pub lacking: f64,
}

/// As many bodies are looked at between two that squeeze.
const MOST_BETWEEN: usize = 3;
/// Directions of contacts one after another on a way are one to this cosine.
const ALIKE: f64 = 0.9;

/// A search along contacts from one end.
struct SqueezeSearch<'a> {
    world: &'a World,
    states: &'a [State],
    contacts: &'a [Contact],
    /// The one that lacks most.
    found: Option<Squeeze>,
}

/// Where a search is.
#[derive(Clone, Copy)]
struct SearchPlace {
    from: Partner,
    between: [usize; MOST_BETWEEN],
    count: usize,
    direction: Vector3<f64>,
    /// d·s₁ − Σ g so far, m.
    closed: f64,
}

/// What squeezes most in a step of `world` from `states` with these `contacts`, if more than `least` (m) of room lacks. The frames of
/// joints that move are where the step ends.
pub(super) fn find(
    world: &World,
    states: &[State],
    contacts: &[Contact],
    least: f64,
) -> Option<Squeeze> {
    let mut search = SqueezeSearch { world, states, contacts, found: None };
    for contact in contacts {
        let body = Partner::Body(contact.key.body);
        for (from, to) in [(body, contact.key.partner), (contact.key.partner, body)] {
            let Some(first) = to.body() else { continue };
            // What is fixed squeezes nothing by itself: a way begins at what a joint holds.
            let (Some(_), Some(moved)) = (from.body(), search.told(from, &place(contact, states)))
            else {
                continue;
            };
            let direction = towards(contact, first);
            let closed = direction.dot(&moved) - contact.gap;
            let between = [first; MOST_BETWEEN];
            search.go_on(&SearchPlace { from, between, count: 1, direction, closed });
        }
    }
    search.found.filter(|squeeze| squeeze.lacking > least)
}

/// The contact's point at the step's start, m.
fn place(contact: &Contact, states: &[State]) -> Vector3<f64> {
    states[contact.key.body].position + contact.arm
}

/// The direction across a contact into `body`.
fn towards(contact: &Contact, body: usize) -> Vector3<f64> {
    if contact.key.body == body { contact.normal() } else { -contact.normal() }
}

impl SqueezeSearch<'_> {
    /// How far the step takes a point of `of` that does as it is told, m; `None` of a body that moves as it is pushed.
    fn told(&self, of: Partner, point: &Vector3<f64>) -> Option<Vector3<f64>> {
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

    /// Looks on from the last body of the way.
    fn go_on(&mut self, way: &SearchPlace) {
        let contacts = self.contacts;
        let last = way.between[way.count - 1];
        // It does as it is told itself: the way ends before it.
        if self.told(Partner::Body(last), &Vector3::zeros()).is_some() {
            return;
        }
        for contact in contacts {
            let next = match (Partner::Body(contact.key.body), contact.key.partner) {
                (Partner::Body(body), partner) if body == last => partner,
                (body, Partner::Body(partner)) if partner == last => body,
                _ => continue,
            };
            let direction = -towards(contact, last);
            let is_new = |next: usize| !way.between[..way.count].contains(&next);
            if next == way.from || direction.dot(&way.direction) < ALIKE {
                continue;
            }
            let closed = way.closed - contact.gap;
            match self.told(next, &place(contact, self.states)) {
                Some(moved) => {
                    let lacking = closed - direction.dot(&moved);
                    if self.found.is_none_or(|found| lacking > found.lacking) {
                        let by = [way.from, next];
                        self.found = Some(Squeeze { by, body: way.between[0], lacking });
                    }
                }
                None => {
                    let Some(next) = next.body().filter(|next| is_new(*next)) else { continue };
                    if way.count < MOST_BETWEEN {
                        let mut on = SearchPlace { count: way.count + 1, closed, ..*way };
                        on.between[way.count] = next;
                        self.go_on(&on);
                    }
                }
            }
        }
    }
}
