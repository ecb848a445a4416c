//! Collision groups of the tables of a file.

use super::Builder;
use tumble_model::groups::{DEFAULT, GROUND, GroupsModel};
use tumble_model::shown::checked_name;

impl Builder<'_> {
    /// Groups of a table with the fields `groups` and `collides_with`. Their names join the list of
    /// the model.
    pub(super) fn groups(
        &mut self,
        groups: Option<Vec<String>>,
        collides_with: Option<Vec<String>>,
    ) -> Result<GroupsModel, String> {
        if groups.as_ref().is_some_and(Vec::is_empty) {
            return Err(format!("groups: a name is needed, for example {DEFAULT:?}"));
        }
        let groups = GroupsModel { members: groups.unwrap_or_default(), collides_with };
        for name in &groups.members {
            if name == GROUND {
                let why = "belongs to the ground alone; use another name";
                return Err(format!("groups: {name:?} {why}"));
            }
            checked_name(name).map_err(|why| why.replacen("name", "groups", 1))?;
        }
        self.model.add_groups(&groups)?;
        Ok(groups)
    }

    /// Rejects `collides_with` of groups that no table has.
    pub(super) fn refuse_unknown_groups(&self) -> Result<(), String> {
        let all = self.model.grouped_objects();
        for (_, name, groups) in all.filter(|(.., groups)| !groups.are_usual()) {
            self.model.masks(groups).map_err(|why| format!("{name}: {why}"))?;
        }
        Ok(())
    }
}
