//! Collision groups by name.

use super::exact::Collider;
use crate::document::Document;
use tumble_core::world::{Groups, World};
use tumble_model::failure::Failure;
use tumble_model::nearest::nearest;
use tumble_model::shown::checked_name;

/// Group of bodies and fixed pieces without groups. It is bit 0 of the masks.
const DEFAULT: &str = "default";
/// Group of the ground. It is bit 1 of the masks.
const GROUND: &str = "ground";
/// Maximum number of named groups. The masks have 64 bits.
const MOST_GROUPS: usize = 62;

impl Document {
    /// Adds the names of a table's `groups` that the document does not have to its list.
    ///
    /// Names are never removed, so the bits of the masks stay when bodies come and go.
    ///
    /// # Errors
    /// An invalid name; too many names.
    pub fn add_groups(&mut self, groups: Option<&[String]>) -> Result<(), String> {
        if groups.is_some_and(<[_]>::is_empty) {
            return Err(format!("groups: a name is needed, for example {DEFAULT:?}"));
        }
        for name in groups.unwrap_or_default() {
            if name == GROUND {
                let why = "belongs to the ground alone; use another name";
                return Err(format!("groups: {name:?} {why}"));
            }
            checked_name(name).map_err(|why| why.replacen("name", "groups", 1))?;
            if name != DEFAULT && !self.groups.contains(name) {
                self.groups.push(name.clone());
            }
        }
        self.refuse_many_groups()
    }

    /// Limits the number of groups.
    pub fn refuse_many_groups(&self) -> Result<(), String> {
        let count = self.groups.len();
        if count > MOST_GROUPS {
            return Err(format!("groups: the scene has {count}; allowed: up to {MOST_GROUPS}"));
        }
        Ok(())
    }

    /// Rejects groups that no table has.
    pub fn refuse_unknown_groups(&self) -> Result<(), String> {
        self.colliders().try_for_each(|object| match self.masks(&object) {
            Ok(_) => Ok(()),
            Err(why) => Err(format!("{}: {why}", object.name)),
        })
    }

    /// Bit masks of the groups of a collider.
    fn masks(&self, of: &Collider<'_>) -> Result<Groups, String> {
        let mask = |field: &str, names: &[String]| {
            names.iter().try_fold(0, |mask, name| {
                let bit = self.bit(name);
                let bit = bit.ok_or_else(|| format!("{field}: {}", self.unknown(name)))?;
                Ok::<u64, String>(mask | bit)
            })
        };
        let usual = Groups::default();
        let members = match of.groups {
            [] => usual.members,
            names => mask("groups", names)?,
        };
        let collides_with = match of.collides_with {
            None => usual.collides_with,
            Some(names) => mask("collides_with", names)?,
        };
        Ok(Groups { members, collides_with })
    }

    /// Sets the groups of all objects in `world`.
    pub fn grouped(&self, mut world: World) -> Result<World, Failure> {
        let has_usual =
            |object: &Collider<'_>| object.groups.is_empty() && object.collides_with.is_none();
        for object in self.colliders().filter(|object| !has_usual(object)) {
            let masks = self.masks(&object).map_err(|why| {
                let (table, index) = object.table;
                Failure::Input(format!("{table}[{index}] ({}): {why}", object.name))
            })?;
            for owner in object.owners {
                world = world.with_groups(self.partner(owner), masks)?;
            }
        }
        Ok(world)
    }

    fn bit(&self, name: &str) -> Option<u64> {
        match name {
            DEFAULT => Some(1),
            GROUND => Some(2),
            _ => {
                let place = self.groups.iter().take(MOST_GROUPS).position(|known| known == name)?;
                Some(4 << place)
            }
        }
    }

    fn unknown(&self, name: &str) -> String {
        let known = [DEFAULT, GROUND].into_iter().chain(self.groups.iter().map(String::as_str));
        let all = known.clone().map(|name| format!("{name:?}")).collect::<Vec<_>>().join(", ");
        match nearest(name, known) {
            Some(near) => format!("there is no group {name:?}; did you mean {near:?}?"),
            None => format!("there is no group {name:?}; the groups are {all}"),
        }
    }
}
