//! Collision groups by name.

use super::model::{Model, PartnerModel};
use crate::failure::Failure;
use crate::nearest::nearest;
use tumble_core::world::{Groups, World};

/// Group of bodies and fixed pieces without groups. It is bit 0 of the masks.
pub const DEFAULT: &str = "default";
/// Group of the ground. It is bit 1 of the masks.
pub const GROUND: &str = "ground";
/// Maximum number of named groups. The masks have 64 bits.
pub const MOST_GROUPS: usize = 62;

/// Collision groups of a body or a fixed piece.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct GroupsModel {
    /// Names of its groups; empty for `default`.
    pub members: Vec<String>,
    /// Names of the groups that it collides with; absent for all.
    pub collides_with: Option<Vec<String>>,
}

impl GroupsModel {
    /// True if these are the groups of an object without groups.
    pub fn are_usual(&self) -> bool {
        *self == Self::default()
    }
}

impl Model {
    /// Adds the names of `groups` that the model does not have to its list.
    ///
    /// Names are never removed, so the bits of the masks stay when bodies come and go.
    ///
    /// # Errors
    /// Too many names.
    pub fn add_groups(&mut self, groups: &GroupsModel) -> Result<(), String> {
        for name in &groups.members {
            if name != DEFAULT && !self.groups.contains(name) {
                self.groups.push(name.clone());
            }
        }
        if self.groups.len() > MOST_GROUPS {
            let count = self.groups.len();
            return Err(format!("groups: the scene has {count}; allowed: up to {MOST_GROUPS}"));
        }
        Ok(())
    }

    /// Bit masks of `groups`.
    ///
    /// # Errors
    /// An unknown name; the sentence begins with the field.
    pub fn masks(&self, groups: &GroupsModel) -> Result<Groups, String> {
        let mask = |field: &str, names: &[String]| {
            names.iter().try_fold(0, |mask, name| {
                let bit = self.bit(name);
                let bit = bit.ok_or_else(|| format!("{field}: {}", self.unknown(name)))?;
                Ok::<u64, String>(mask | bit)
            })
        };
        let usual = Groups::default();
        let members = match &groups.members[..] {
            [] => usual.members,
            names => mask("groups", names)?,
        };
        let collides_with = match &groups.collides_with {
            None => usual.collides_with,
            Some(names) => mask("collides_with", names)?,
        };
        Ok(Groups { members, collides_with })
    }

    /// All objects with their names and groups: bodies, fixed geometry, terrains.
    pub fn grouped_objects(&self) -> impl Iterator<Item = (PartnerModel, &str, &GroupsModel)> {
        let bodies = self.bodies.iter().enumerate();
        let bodies = bodies.map(|(at, of)| (PartnerModel::Body(at), &*of.name, &of.groups));
        let fixed = self.fixed.iter().enumerate();
        let fixed = fixed.map(|(at, of)| (PartnerModel::Fixed(at), &*of.name, &of.groups));
        let terrains = self.terrains.iter().enumerate();
        let terrains = terrains.map(|(at, of)| (PartnerModel::Terrain(at), &*of.name, &of.groups));
        bodies.chain(fixed).chain(terrains)
    }

    /// Sets the groups of all objects in `world`.
    pub(crate) fn grouped(&self, mut world: World) -> Result<World, Failure> {
        for (of, name, groups) in self.grouped_objects().filter(|(.., of)| !of.are_usual()) {
            let masks = self.masks(groups).map_err(|why| {
                let (table, index) = match of {
                    PartnerModel::Body(index) => ("bodies", index),
                    PartnerModel::Fixed(index) => ("fixed", index),
                    PartnerModel::Terrain(index) => ("terrain", index),
                    PartnerModel::Ground => ("ground", 0),
                };
                Failure::Input(format!("{table}[{index}] ({name}): {why}"))
            });
            world = world.with_groups(self.partner(of), masks?)?;
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
