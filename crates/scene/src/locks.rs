//! Contradictory and redundant joints of a scene, with their names.

use super::scene::Scene;
use tumble_core::joint::{GearAxis, JointAxis};
use tumble_core::simulation::{Constraint, RedundancyFinding};
use tumble_model::failure::Failure;

/// Maximum number of names in a message; further names are counted.
const MOST_NAMED: usize = 6;

impl Scene {
    fn found_in_joints(&self) -> Vec<RedundancyFinding> {
        let time = self.start_index as f64 * self.world.time_step();
        self.world_at(self.start_index).locked(&self.starts, &self.courses, time)
    }

    /// Rejects joints and gears whose constraints contradict each other.
    ///
    /// # Errors
    /// The first contradiction.
    pub(super) fn refuse_contradiction(&self) -> Result<(), Failure> {
        for finding in self.found_in_joints() {
            if let RedundancyFinding::Contradiction { locks, off } = finding {
                return Err(Failure::Input(format!(
                    "joints: {} contradict each other: their velocities differ by {off:.1e} m/s; \
                     remove one",
                    self.listed(&locks)
                )));
            }
        }
        Ok(())
    }

    /// Warnings about locked axes and redundant joints and gears, one sentence each.
    pub(super) fn notes_on_joints(&self) -> Vec<String> {
        let findings = self.found_in_joints();
        let mut notes: Vec<String> = Vec::new();
        let mut axes: Vec<(Vec<Constraint>, Vec<String>)> = Vec::new();
        for finding in &findings {
            match finding {
                RedundancyFinding::LockedAxis { axis, locks } => {
                    let (name, mut locks) = (self.axis_name(axis), locks.clone());
                    if !locks.iter().all(|lock| matches!(lock, Constraint::Gear(_))) {
                        locks.push(Constraint::Joint(axis.joint));
                    }
                    locks.sort();
                    locks.dedup();
                    match axes.iter_mut().find(|(by, _)| *by == locks) {
                        Some((_, names)) => names.push(name),
                        None => axes.push((locks, vec![name])),
                    }
                }
                RedundancyFinding::Redundant { locks, rows } => notes.push(format!(
                    "{} have {rows} redundant constraints: their individual forces are not unique",
                    self.listed(locks)
                )),
                _ => {}
            }
        }
        let together = |(locks, names): &(Vec<Constraint>, Vec<String>)| {
            let by = self.listed(locks);
            let axes = counted(names.clone());
            match locks[..] {
                [Constraint::Joint(_)] => format!("{by} locks {axes}: its limits are equal"),
                [Constraint::Gear(_)] => format!("{by} locks {axes}: its ratio is 0"),
                _ => format!("{by} together lock {axes}"),
            }
        };
        notes.extend(axes.iter().map(together));
        notes
    }

    fn listed(&self, locks: &[Constraint]) -> String {
        let name = |lock: &Constraint| match lock {
            Constraint::Joint(index) => self.joint_name(*index).to_owned(),
            Constraint::Gear(index) => format!("gears[{index}]"),
        };
        counted(locks.iter().map(name).collect())
    }

    fn joint_name(&self, index: usize) -> &str {
        self.joints.get(index).map_or("", String::as_str)
    }

    fn axis_name(&self, of: &GearAxis) -> String {
        let joint = self.joint_name(of.joint);
        let axes = self.document.joint_kind(of.joint).driven();
        match axes {
            [_] => format!("the axis of {joint}"),
            _ => {
                let (kind, k) = match of.axis {
                    JointAxis::Linear(k) => ("slide", k),
                    JointAxis::Angular(k) => ("turn", k),
                };
                format!("the {kind} {} of {joint}", ["x", "y", "z"][k.min(2)])
            }
        }
    }
}

/// List of the first names and the number of the others.
pub fn counted(mut names: Vec<String>) -> String {
    let more = names.len().saturating_sub(MOST_NAMED);
    names.truncate(MOST_NAMED);
    match (more, names.split_last()) {
        (0, Some((last, first))) if !first.is_empty() => format!("{} and {last}", first.join(", ")),
        (0, _) => names.join(", "),
        _ => format!("{} and {more} more", names.join(", ")),
    }
}
