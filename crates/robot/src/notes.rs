//! What stands in a file and has no meaning here.

use std::collections::BTreeMap;

/// What was passed over, by what it is.
#[derive(Debug, Default)]
pub struct RobotNotes {
    idle: BTreeMap<String, usize>,
    soft: bool,
    /// Links whose look is not read: how many, and why the first is not.
    unseen: Option<(usize, String)>,
    /// Shapes that would resist turning and rolling.
    rub_alone: usize,
    /// Shapes of size 0: how many, and where the first is.
    empty: Option<(usize, String)>,
    said: Vec<String>,
}

impl RobotNotes {
    /// An element that does not change the motion.
    pub fn idle(&mut self, tag: &str) {
        *self.idle.entry(tag.to_owned()).or_default() += 1;
    }

    /// A setting of soft contacts.
    pub fn soft(&mut self) {
        self.soft = true;
    }

    /// A shape that would resist turning and rolling where it touches, and does not.
    pub fn rubs_alone(&mut self) {
        self.rub_alone += 1;
    }

    /// A link whose look is not read, and why.
    pub fn unseen(&mut self, why: String) {
        self.unseen.get_or_insert((0, why)).0 += 1;
    }

    /// A shape of size 0 that is left out, and where it is.
    pub fn empty(&mut self, at: String) {
        self.empty.get_or_insert((0, at)).0 += 1;
    }

    /// Anything else, once.
    pub fn say(&mut self, sentence: String) {
        if !self.said.contains(&sentence) {
            self.said.push(sentence);
        }
    }

    /// All of it, a sentence each.
    pub fn sentences(self) -> Vec<String> {
        let mut sentences = Vec::new();
        if !self.idle.is_empty() {
            let count = |(tag, count): (&String, &usize)| format!("{count} <{tag}>");
            let list: Vec<_> = self.idle.iter().map(count).collect();
            sentences.push(format!("without a part in the motion: {}", list.join(", ")));
        }
        if self.soft {
            sentences.push(
                "solref, solimp, margin and gap have no meaning: contacts, limits and ties are hard"
                    .to_owned(),
            );
        }
        if self.rub_alone > 0 {
            let count = self.rub_alone;
            sentences.push(format!(
                "as was asked for, contacts of {count} <geom> of condim 4 or 6 rub alone, and resist neither turning nor rolling"
            ));
        }
        if let Some((count, why)) = self.unseen {
            let links = if count == 1 { "a link is" } else { &*format!("{count} links are") };
            sentences.push(format!("{links} drawn by what touches, not by visual meshes: {why}"));
        }
        if let Some((count, first)) = self.empty {
            sentences.push(format!(
                "shapes of size 0 are left out: {count}, the first in {first}; give it a size above 0 if it should touch"
            ));
        }
        sentences.extend(self.said);
        sentences
    }
}
