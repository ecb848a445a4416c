//! Collision groups: exclusion of contacts by bit masks.

use super::World;
use crate::error::Error;
use crate::partner::{Coefficient, Partner};

/// Collision groups of a body, a fixed piece or the ground, as bit masks.
///
/// Two objects touch if each collides with a group of the other:
///
/// ```text
/// (members_a & collides_with_b ≠ 0) and (members_b & collides_with_a ≠ 0)
/// ```
///
/// By default an object collides with all groups. Bodies and fixed pieces belong to the first group
/// (bit 0), and the ground to the second one (bit 1). The masks need 16 bytes an object, also where
/// groups exclude millions of pairs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Groups {
    /// Groups that the object belongs to.
    pub members: u64,
    /// Groups that it collides with.
    pub collides_with: u64,
}

impl Default for Groups {
    fn default() -> Self {
        Self { members: 1, collides_with: u64::MAX }
    }
}

impl Groups {
    /// Default of the ground.
    pub const GROUND: Self = Self { members: 2, collides_with: u64::MAX };

    /// True if two objects of these groups may touch.
    #[inline]
    pub fn may_touch(self, other: Self) -> bool {
        self.members & other.collides_with != 0 && other.members & self.collides_with != 0
    }
}

/// Contact exclusions and coefficients of a body that is added to a simulation.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Touching {
    /// Collision groups.
    pub groups: Groups,
    /// True if all contacts of the body are excluded, see [`World::with_untouched`].
    pub untouched: bool,
    /// Own coefficients.
    pub coefficients: Vec<(Coefficient, f64)>,
}

/// Groups of all objects. Objects beyond the end of a list have the defaults, and no list ends with
/// a default. Equal groups are thus equal lists.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct GroupMasks {
    bodies: Vec<Groups>,
    fixed: Vec<Groups>,
    ground: Groups,
}

impl Default for GroupMasks {
    fn default() -> Self {
        Self { bodies: Vec::new(), fixed: Vec::new(), ground: Groups::GROUND }
    }
}

impl GroupMasks {
    fn groups(&self, of: Partner) -> Groups {
        let known = match of {
            Partner::Ground => return self.ground,
            Partner::Fixed(index) => self.fixed.get(index),
            Partner::Body(index) => self.bodies.get(index),
        };
        known.copied().unwrap_or_default()
    }

    fn set(&mut self, of: Partner, groups: Groups) {
        let (list, index) = match of {
            Partner::Ground => {
                self.ground = groups;
                return;
            }
            Partner::Fixed(index) => (&mut self.fixed, index),
            Partner::Body(index) => (&mut self.bodies, index),
        };
        if index >= list.len() {
            list.resize(index + 1, Groups::default());
        }
        list[index] = groups;
        trim(list);
    }

    #[inline]
    pub(super) fn may_touch(&self, body: usize, partner: Partner) -> bool {
        self.groups(Partner::Body(body)).may_touch(self.groups(partner))
    }

    /// Masks after the removal of `body`.
    pub(super) fn without(&self, body: usize) -> Self {
        let mut masks = self.clone();
        if body < masks.bodies.len() {
            masks.bodies.remove(body);
            trim(&mut masks.bodies);
        }
        masks
    }

    /// These masks; `None` if all objects have the defaults.
    pub(super) fn if_any(self: Box<Self>) -> Option<Box<Self>> {
        (*self != Self::default()).then_some(self)
    }
}

/// Removes defaults at the end.
fn trim(list: &mut Vec<Groups>) {
    while list.last() == Some(&Groups::default()) {
        list.pop();
    }
}

impl World {
    /// Returns this world with the collision `groups` of a body, a fixed piece or the ground.
    ///
    /// # Errors
    /// [`Error::Count`] if the object does not exist.
    pub fn with_groups(mut self, of: Partner, groups: Groups) -> Result<Self, Error> {
        let (known, count) = match of {
            Partner::Ground => (self.ground().is_some(), 0),
            Partner::Fixed(index) => (index < self.fixed_count(), index),
            Partner::Body(index) => (index < self.bodies().len(), index),
        };
        if !known {
            let allowed = "a body, a fixed piece or the ground of the world";
            return Err(Error::Count { field: "object with groups", count, allowed });
        }
        let mut masks = self.groups.take().unwrap_or_default();
        masks.set(of, groups);
        self.groups = masks.if_any();
        Ok(self)
    }

    /// Collision groups of a body, a fixed piece or the ground.
    pub fn groups_of(&self, of: Partner) -> Groups {
        let none = GroupMasks::default();
        self.groups.as_deref().unwrap_or(&none).groups(of)
    }

    /// True if groups exclude all contacts except those with the ground. The time is n log n for n
    /// objects of a few different groups.
    pub(crate) fn groups_exclude_pieces(&self) -> bool {
        let Some(groups) = &self.groups else { return false };
        let distinct = |count: usize, of: fn(usize) -> Partner| {
            let mut all: Vec<Groups> = (0..count).map(|index| groups.groups(of(index))).collect();
            all.sort_unstable();
            all.dedup();
            all
        };
        let bodies = distinct(self.bodies().len(), Partner::Body);
        let fixed = distinct(self.fixed_count(), Partner::Fixed);
        let apart = |one: &Groups| bodies.iter().chain(&fixed).all(|other| !one.may_touch(*other));
        bodies.iter().all(apart)
    }

    /// Contact exclusions of `body` other than pairs, joints and holds, and its coefficients.
    pub fn touching_of(&self, body: usize) -> Touching {
        let untouched = self.untouched.binary_search(&body).is_ok();
        let owner = Partner::Body(body);
        let coefficients = self.coefficients_of(owner);
        Touching { groups: self.groups_of(owner), untouched, coefficients }
    }

    /// Returns this world with the contact exclusions and the coefficients of `body`.
    pub(crate) fn with_touching(self, body: usize, touching: Touching) -> Result<Self, Error> {
        let owner = Partner::Body(body);
        let mut own = touching.coefficients.into_iter();
        let world = self.with_groups(owner, touching.groups)?;
        let world =
            own.try_fold(world, |world, (of, value)| world.with_coefficient_of(of, owner, value))?;
        if touching.untouched { world.with_untouched(body) } else { Ok(world) }
    }
}
