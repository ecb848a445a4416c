//! What a sweep computes, and how it is cut into parts: the same for all its shards. Plan and parts carry
//! checksums (CRC-32), those of the parts over that of the plan: what was changed since is noticed and named.

use crate::cli::args::SweepArgs;
use crate::cli::directory::OutputDirectory;
use crate::cli::outcome::Failure;
use crate::cli::output::PendingFile;
use crate::cli::{fields, input, shown};
use serde::{Deserialize, Serialize};
use std::io;
use std::ops::Range;
use std::path::Path;

/// The file that says what a sweep computes.
const FILE: &str = "sweep.json";
/// More bytes than this are no plan: a scenario, and little more.
const LARGEST_FILE: u64 = 4 << 20;
/// Tosses of the largest part: some seconds of work of one core.
const LARGEST_PART: u32 = 1000;
/// Parts of a smaller sweep, so that there is something for many shards.
const USUAL_PARTS: u32 = 256;

/// What a sweep computes. Everything that its numbers depend on stands here, but for the files of
/// meshes, which the scenario names.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "an object with the plan of a sweep")]
pub struct Plan {
    pub tumble_version: String,
    pub tosses: u32,
    /// Of the first toss.
    pub seed: u32,
    /// Rows of a toss; null for the scenario's.
    pub steps: Option<u64>,
    /// Null for the scenario's.
    pub mu: Option<f64>,
    /// The text of the scenario.
    pub scenario: String,
    /// Of all the above.
    checksum: String,
}

/// The last line of a part: the word, and the checksum.
const CHECKSUM: &str = "checksum,";

impl Plan {
    pub fn new(args: &SweepArgs, scenario: String) -> Result<Self, Failure> {
        if args.seed.checked_add(args.tosses - 1).is_none() {
            return Err(Failure::setting(
                "seed",
                format!("with {} tosses it goes beyond the last seed, {}", args.tosses, u32::MAX),
            ));
        }
        if args.steps == Some(1) {
            return Err(Failure::setting("steps", "a toss has 2 rows at least, one step"));
        }
        let plan = Self {
            tumble_version: env!("CARGO_PKG_VERSION").to_owned(),
            tosses: args.tosses,
            seed: args.seed,
            steps: args.steps,
            mu: args.mu,
            scenario,
            checksum: String::new(),
        };
        Ok(Self { checksum: plan.computed()?, ..plan })
    }

    fn json(&self) -> Result<String, Failure> {
        let json = serde_json::to_string_pretty(self);
        json.map_err(|error| Failure::Other(format!("{FILE} cannot be made: {error}")))
    }

    /// The checksum that the plan should have.
    fn computed(&self) -> Result<String, Failure> {
        let bare = Self { checksum: String::new(), ..self.clone() };
        Ok(format!("{:08x}", crc32fast::hash(bare.json()?.as_bytes())))
    }

    /// The checksum of part `part` with these `rows`.
    fn checksum_of(&self, part: u32, rows: &str) -> String {
        let mut hasher = crc32fast::Hasher::new();
        hasher.update(format!("{},{part}\n", self.checksum).as_bytes());
        hasher.update(rows.as_bytes());
        format!("{:08x}", hasher.finalize())
    }

    /// The text of part `part` with these `rows`.
    pub fn sealed(&self, part: u32, rows: &str) -> String {
        format!("{rows}{CHECKSUM}{}\n", self.checksum_of(part, rows))
    }

    /// The rows of part `part`, whose file is `path`.
    pub fn rows_of<'a>(&self, part: u32, text: &'a str, path: &Path) -> Result<&'a str, Failure> {
        let rows = text.rfind(CHECKSUM).map(|at| &text[..at]).unwrap_or_default();
        if self.sealed(part, rows) == text {
            return Ok(rows);
        }
        let tosses = self.tosses_of(part);
        Err(Failure::Input(format!(
            "{} is not what this sweep wrote of the tosses {} to {}: its checksum is another; remove it, and run \
             its shard again",
            shown::path(path),
            tosses.start,
            tosses.end - 1
        )))
    }

    /// The part of a file that is there already, if it is: it must be of this sweep.
    pub fn knows(&self, directory: &Path, part: u32) -> Result<bool, Failure> {
        let path = directory.join(part_file(part));
        if !path.is_file() {
            return Ok(false);
        }
        self.rows_of(part, &read_part(&path)?, &path).map(|_| true)
    }

    /// Refuses files of `directory` that are named like parts, and of which this sweep has none.
    pub fn refuse_strays(&self, directory: &Path) -> Result<(), Failure> {
        let odd = |error: io::Error| {
            Failure::Input(format!("{} cannot be read: {error}", shown::path(directory)))
        };
        let mut strays = Vec::new();
        for entry in std::fs::read_dir(directory).map_err(odd)? {
            let name = entry.map_err(odd)?.file_name().to_string_lossy().into_owned();
            let number = name.strip_prefix(PART).and_then(|name| name.strip_suffix(".csv"));
            let is_ours = |number: &str| {
                let part = number.parse().ok();
                part.is_some_and(|part| part < self.parts() && part_file(part) == name)
            };
            if number.is_some_and(|number| !is_ours(number)) {
                strays.push(name);
            }
        }
        strays.sort();
        match strays.first() {
            None => Ok(()),
            Some(first) => Err(Failure::Input(format!(
                "{}: {} is no part of this sweep, whose last one is {}; remove what is another's",
                shown::path(directory),
                shown::line(first),
                part_file(self.parts() - 1)
            ))),
        }
    }

    /// Tosses of a part.
    pub fn size(&self) -> u32 {
        self.tosses.div_ceil(USUAL_PARTS).min(LARGEST_PART)
    }

    /// How many parts there are.
    pub fn parts(&self) -> u32 {
        self.tosses.div_ceil(self.size())
    }

    /// The tosses of a part.
    pub fn tosses_of(&self, part: u32) -> Range<u32> {
        let start = part * self.size();
        start..(start + self.size()).min(self.tosses)
    }

    /// Writes the plan, unless it is there; another one that is there is refused.
    pub fn write(&self, out: &OutputDirectory) -> Result<(), Failure> {
        match Self::read(out.path())? {
            Some(plan) if plan == *self => Ok(()),
            Some(_) => Err(Failure::Input(format!(
                "{} is of another sweep; give its own scenario and numbers to go on with it, or \
                 choose another --out",
                shown::path(&out.path().join(FILE))
            ))),
            None => {
                let json = self.json()?;
                let pending = PendingFile::create(out, FILE)?;
                pending.write((json + "\n").as_bytes())?;
                pending.publish().map(|_| ())
            }
        }
    }

    /// The plan of a directory; `None` where there is none.
    pub fn read(directory: &Path) -> Result<Option<Self>, Failure> {
        let path = directory.join(FILE);
        let odd = |why: &dyn std::fmt::Display| {
            Failure::Input(format!("{} is no plan of a sweep: {why}", shown::path(&path)))
        };
        let text = match input::text(&path, LARGEST_FILE) {
            Ok(text) => text,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            Err(error) => return Err(odd(&error)),
        };
        let plan: Self = fields::json(&text).map_err(|why| odd(&why))?;
        if plan.tosses == 0 || plan.seed.checked_add(plan.tosses - 1).is_none() {
            return Err(odd(&"tosses: 1 or more are needed, and seeds up to 4294967295"));
        }
        if plan.checksum != plan.computed()? {
            return Err(odd(&"it was changed since it was written, as its checksum says"));
        }
        Ok(Some(plan))
    }
}

/// More bytes than this are no part: it is in memory when it is written, and again when it is merged.
pub const LARGEST_PART_FILE: u64 = 2 << 30;

const PART: &str = "part-";

/// The file of a part.
pub fn part_file(part: u32) -> String {
    format!("{PART}{part:06}.csv")
}

/// The text of a part.
pub fn read_part(path: &Path) -> Result<String, Failure> {
    let odd = |error| Failure::Input(format!("{} cannot be read: {error}", shown::path(path)));
    input::text(path, LARGEST_PART_FILE).map_err(odd)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every toss is in one part, in order, whatever their number.
    #[test]
    fn parts_have_every_toss_once() {
        for tosses in [1, 2, 255, 256, 257, 1000, 255_999, 256_000, 256_001, 1_000_003] {
            let plan = Plan {
                tumble_version: String::new(),
                tosses,
                seed: 0,
                steps: None,
                mu: None,
                scenario: String::new(),
                checksum: String::new(),
            };
            let all = (0..plan.parts()).flat_map(|part| plan.tosses_of(part));
            assert!(all.eq(0..tosses), "{tosses}");
            assert!(plan.size() <= LARGEST_PART);
        }
    }
}
