//! Notes on content of a file that has no effect.

use super::meshes::Hulled;
use std::collections::BTreeMap;
use tumble_model::shown;

/// Ignored content of a file, collected by kind.
#[derive(Debug, Default)]
pub struct RobotNotes {
    idle: BTreeMap<String, usize>,
    unknown: BTreeMap<String, usize>,
    soft: bool,
    /// Number of links whose visual geometry is not read, and the reason for the first.
    unseen: Option<(usize, String)>,
    /// True if a shape has torsional or rolling friction.
    turns: bool,
    /// Number of shapes whose torsional and rolling friction is dropped.
    rub_alone: usize,
    /// Number of shapes of size 0, and the position of the first.
    empty: Option<(usize, String)>,
    /// Number of meshes with reduced hulls, and the mesh with the points farthest outside its hull.
    reduced: Option<(usize, ReducedHull)>,
    noted: Vec<String>,
}

/// A mesh that is represented by some corners of its hull.
#[derive(Debug)]
struct ReducedHull {
    mesh: String,
    corners: usize,
    /// Largest distance of the other corners outside the hull (m).
    outside: f64,
}

impl RobotNotes {
    /// Counts an element that does not affect the motion.
    pub fn idle(&mut self, tag: &str) {
        *self.idle.entry(tag.to_owned()).or_default() += 1;
    }

    /// Counts an element or attribute with an unknown name.
    pub fn unknown(&mut self, name: String) {
        *self.unknown.entry(name).or_default() += 1;
    }

    /// Records that the file has settings of soft contacts.
    pub fn soft(&mut self) {
        self.soft = true;
    }

    /// Counts a shape with torsional or rolling friction, which is dropped if `dropped`.
    pub fn turns(&mut self, dropped: bool) {
        if dropped {
            self.rub_alone += 1;
        } else {
            self.turns = true;
        }
    }

    /// Counts a link whose visual geometry is not read for the reason `why`.
    pub fn unseen(&mut self, why: String) {
        self.unseen.get_or_insert((0, why)).0 += 1;
    }

    /// Counts a dropped shape of size 0 at the position `at` of the file.
    pub fn empty(&mut self, at: String) {
        self.empty.get_or_insert((0, at)).0 += 1;
    }

    /// Records that the hull of a mesh is thickened or reduced.
    pub fn hull(&mut self, mesh: &str, hull: &Hulled) {
        let mesh = shown::line(mesh);
        let corners = hull.corners.len();
        let outside = hull.outside;
        if hull.thickened > 0.0 {
            self.say(format!("{mesh}: it is flat and is thickened to {:.1e} m", hull.thickened));
        } else if outside > 0.0 {
            let one = ReducedHull { mesh, corners, outside };
            self.reduced = Some(match self.reduced.take() {
                None => (1, one),
                Some((count, worst)) if worst.outside >= outside => (count + 1, worst),
                Some((count, _)) => (count + 1, one),
            });
        }
    }

    /// Adds any other sentence, without duplicates.
    pub fn say(&mut self, sentence: String) {
        if !self.noted.contains(&sentence) {
            self.noted.push(sentence);
        }
    }

    /// All notes, one sentence each.
    pub fn sentences(self) -> Vec<String> {
        let mut sentences = Vec::new();
        // Counts of what has no effect
        if !self.idle.is_empty() {
            let count = |(tag, count): (&String, &usize)| format!("{count} <{tag}>");
            let list: Vec<_> = self.idle.iter().map(count).collect();
            sentences.push(format!("elements without effect on the motion: {}", list.join(", ")));
        }
        if !self.unknown.is_empty() {
            let count = |(name, count): (&String, &usize)| format!("{count} {name}");
            let list: Vec<_> = self.unknown.iter().map(count).collect();
            sentences.push(format!("unknown names are ignored: {}", list.join(", ")));
        }
        if self.soft {
            sentences.push(
                "solref, solimp, margin and gap have no effect: contacts, limits and constraints \
                 are hard"
                    .to_owned(),
            );
        }
        if self.rub_alone > 0 {
            let count = self.rub_alone;
            sentences.push(format!(
                "as requested, contacts of {count} <geom> with condim 4 or 6 have only sliding \
                 friction"
            ));
        }
        if self.turns {
            sentences.push(
                "sliding, torsional and rolling friction have separate limits; the common cone of \
                 MuJoCo lowers each by up to a factor of √3 where several act"
                    .to_owned(),
            );
        }
        // Shapes and hulls that differ from the file
        if let Some((count, why)) = self.unseen {
            let links = if count == 1 { "a link is" } else { &*format!("{count} links are") };
            sentences.push(format!(
                "{links} drawn with collision shapes instead of visual meshes: {why}"
            ));
        }
        if let Some((count, first)) = self.empty {
            sentences.push(format!(
                "shapes of size 0 are ignored: {count}, the first in {first}; give it a size above \
                 0 for contacts"
            ));
        }
        if let Some((count, ReducedHull { mesh, corners, outside })) = self.reduced {
            let others = match count {
                1 => String::new(),
                _ => format!("; {} more hulls are reduced", count - 1),
            };
            sentences.push(format!(
                "{mesh}: its hull is reduced to {corners} corners; the others are up to \
                 {outside:.1e} m outside{others}"
            ));
        }
        sentences.extend(self.noted);
        sentences
    }
}
