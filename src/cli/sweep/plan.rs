//! What a sweep computes, and how it is cut into parts: the same for all its shards.

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
}

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
        Ok(Self {
            tumble_version: env!("CARGO_PKG_VERSION").to_owned(),
            tosses: args.tosses,
            seed: args.seed,
            steps: args.steps,
            mu: args.mu,
            scenario,
        })
    }

    /// Tosses of a part.
    fn size(&self) -> u32 {
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
                let json = serde_json::to_string_pretty(self)
                    .map_err(|error| Failure::Other(format!("{FILE} cannot be made: {error}")))?;
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
        match input::text(&path, LARGEST_FILE) {
            Ok(text) => fields::json(&text).map(Some).map_err(|why| odd(&why)),
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
            Err(error) => Err(odd(&error)),
        }
    }
}

/// The file of a part.
pub fn part_file(part: u32) -> String {
    format!("part-{part:06}.csv")
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
            };
            let all = (0..plan.parts()).flat_map(|part| plan.tosses_of(part));
            assert!(all.eq(0..tosses), "{tosses}");
            assert!(plan.size() <= LARGEST_PART);
        }
    }
}
