//! Where a simulation is, as a value and as bytes: all that its next steps depend on.
//!
//! A step sees the solutions before it, the loads, and what the search for contacts and the solver
//! remember of earlier steps. All of that is in a [`Saved`], so that a simulation which is
//! [restored](super::Simulation::restore) goes on with the same bits as one that was never
//! interrupted. The world is not in it: it is made anew, and has to be the same to the last bit,
//! which a digest of it tells.
//!
//! The bytes are a magic word, the number of the format, the length, the numbers themselves, and a
//! checksum of all of it. Numbers keep their bits.

use super::driving::Driving;
use super::{MOST_STEPS, Motion, Outside, Simulation};
use crate::contact::{Candidates, Memory};
use crate::error::Error;
use crate::joint::{Gear, Joint};
use crate::mechanics::load::Polyline;
use crate::mechanics::{Load, State};
use crate::step::StepSolution;
use crate::world::{Partner, World};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use std::fmt::{self, Write as _};

/// Where a simulation is: its index, states, forces and loads, and what it remembers.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Saved {
    /// The digest of what of the world no simulation changes, and what this one did: which bodies are held, how
    /// the joints and gears are set, which surfaces move.
    world: u64,
    held: Vec<bool>,
    joints: Vec<Joint>,
    gears: Vec<Gear>,
    surfaces: Vec<(Partner, Vector3<f64>)>,
    index: u64,
    taken_back: bool,
    outside: Vec<Outside>,
    driving: Driving,
    now: StepSolution,
    before: Option<StepSolution>,
    long_before: Option<StepSolution>,
    search: Memory,
    /// In the solver's own form.
    solver: Vec<u8>,
    /// Of the program that saves.
    notes: Vec<u8>,
}

/// What the bytes begin with.
const MAGIC: [u8; 8] = *b"tumble-l";
/// The number of the format: another one where the same numbers stand for something else.
const FORMAT: u32 = 4;
/// Magic word, format and length.
const HEADER: usize = 8 + 4 + 8;
/// The checksum.
const TRAILER: usize = 8;

impl Saved {
    /// k.
    #[must_use]
    pub fn index(&self) -> u64 {
        self.index
    }

    /// X at the current step, one a body.
    #[must_use]
    pub fn states(&self) -> &[State] {
        &self.now.states
    }

    /// This state with `notes`: what the program that saves wants to find again beside the simulation, in a
    /// form of its own.
    #[must_use]
    pub fn with_notes(self, notes: Vec<u8>) -> Self {
        Self { notes, ..self }
    }

    /// The [notes](Saved::with_notes); empty where there are none.
    #[must_use]
    pub fn notes(&self) -> &[u8] {
        &self.notes
    }

    /// As bytes, which [`Saved::from_bytes`] reads again.
    ///
    /// # Errors
    /// None for what a simulation saved.
    pub fn to_bytes(&self) -> Result<Vec<u8>, Error> {
        let numbers = to_bytes(self)?;
        let mut bytes = Vec::with_capacity(HEADER + numbers.len() + TRAILER);
        bytes.extend(MAGIC);
        bytes.extend(FORMAT.to_le_bytes());
        bytes.extend((numbers.len() as u64).to_le_bytes());
        bytes.extend(numbers);
        bytes.extend(Fnv::of(&bytes).to_le_bytes());
        Ok(bytes)
    }

    /// Reads what [`Saved::to_bytes`] wrote.
    ///
    /// # Errors
    /// Bytes that are no saved state, of another format, cut off or changed.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, Error> {
        let Some((magic, rest)) = bytes.split_first_chunk() else { return Err(cut(bytes.len())) };
        if *magic != MAGIC {
            return Err(odd("is none: it does not begin as one".to_owned()));
        }
        let Some((format, rest)) = rest.split_first_chunk() else { return Err(cut(bytes.len())) };
        let format = u32::from_le_bytes(*format);
        if format != FORMAT {
            let why = format!("is of format {format}; this version reads format {FORMAT}");
            return Err(odd(why));
        }
        let Some((length, rest)) = rest.split_first_chunk() else { return Err(cut(bytes.len())) };
        let length = u64::from_le_bytes(*length);
        let Some((content, checksum)) = rest.split_last_chunk() else {
            return Err(cut(bytes.len()));
        };
        let found = content.len() as u64;
        if found < length {
            return Err(cut(bytes.len()));
        }
        if found > length {
            return Err(odd(format!("has {} bytes after its end", found - length)));
        }
        let all = &bytes[..bytes.len() - TRAILER];
        if Fnv::of(all) != u64::from_le_bytes(*checksum) {
            return Err(odd("is damaged: its checksum is not that of its bytes".to_owned()));
        }
        from_bytes(content)
    }

    /// Whether it can be one of a simulation of `world`, whose digest is `digest`: a number that worlds share
    /// that are the same to the last bit.
    fn check(&self, world: &World, digest: u64) -> Result<(), Error> {
        let bodies = world.bodies().len();
        if self.now.states.len() != bodies {
            let count = self.now.states.len();
            let why = format!("is one of {count} bodies, and the world has {bodies}");
            return Err(odd(why));
        }
        if self.world != digest {
            let why = "is one of another world: a body, a constant or what is fixed differs";
            return Err(odd(why.to_owned()));
        }
        let pasts = [Some(&self.now), self.before.as_ref(), self.long_before.as_ref()];
        let is_whole = |solution: &StepSolution| {
            let numbers = solution.states.iter().map(State::to_vector);
            solution.states.len() == bodies
                && numbers.into_iter().all(|numbers| numbers.iter().all(|x| x.is_finite()))
        };
        let is_possible = self.index < MOST_STEPS
            && self.outside.len() == bodies
            && self.outside.iter().all(Outside::is_possible)
            && pasts.into_iter().flatten().all(is_whole)
            && self.search.fits(world)
            && self.joints.iter().map(Joint::lasting).eq(world.joints().iter().map(Joint::lasting))
            && self.gears.iter().map(Gear::lasting).eq(world.gears().iter().map(Gear::lasting))
            && self.driving.fits(&self.joints)
            && (self.held.is_empty() || self.held.len() == bodies);
        match is_possible {
            true => Ok(()),
            false => Err(odd("is of no simulation: its numbers contradict each other".to_owned())),
        }
    }
}

impl Outside {
    fn is_possible(&self) -> bool {
        let line = |line: &Polyline| Polyline::new(line.knots().to_vec());
        let Load { force, torque, .. } = &self.load;
        let load = line(force)
            .and_then(|force| Ok((force, line(torque)?)))
            .and_then(|(force, torque)| Load::new(force, torque, *self.load.point()));
        self.wrench.validate().is_ok() && load.is_ok()
    }
}

impl<'a> Simulation<'a> {
    /// A simulation of `world`, moved by `motion`, that goes on from where `saved` was saved
    /// ([`Simulation::restore`]). No start is asked for: with bodies held a run may have come to where none may
    /// begin.
    ///
    /// # Errors
    /// As [`Simulation::restore`]; joints without the contact step.
    pub fn restored(world: World, motion: Motion<'a>, saved: &Saved) -> Result<Self, Error> {
        saved.check(&world, digest(&world))?;
        let mut simulation = Self::at(world, saved.states(), motion, Candidates::new())?;
        simulation.restore(saved)?;
        Ok(simulation)
    }

    /// Where the simulation is, to go on from there later: in this simulation, or in another one of the
    /// same world.
    #[must_use]
    pub fn save(&self) -> Saved {
        Saved {
            world: self.digest(),
            held: self.world.held().to_vec(),
            joints: self.world.joints().to_vec(),
            gears: self.world.gears().to_vec(),
            surfaces: self.world.surfaces().to_vec(),
            index: self.index,
            taken_back: self.taken_back,
            outside: self.outside.clone(),
            driving: self.driving.clone(),
            now: self.now.clone(),
            before: self.before.clone(),
            long_before: self.long_before.clone(),
            search: self.scratch.candidates.memory().clone(),
            solver: self.motion.memory(),
            notes: Vec::new(),
        }
    }

    /// Goes on from where `saved` was saved: with the same motion and the same steps to the last bit, if
    /// it is moved by the same solver with the same settings. A solver that remembers nothing goes on
    /// from what another one saved, and one that remembers from what such a one saved. What interrupts
    /// the simulation stays.
    ///
    /// # Errors
    /// A state of another world; one that no simulation saved; a solver's memory that the solver
    /// does not know. The simulation then stays where it was.
    pub fn restore(&mut self, saved: &Saved) -> Result<(), Error> {
        saved.check(&self.world, self.digest())?;
        let ties = (&*saved.joints, &*saved.gears);
        let world = self.world.with_changes(&saved.held, ties.0, ties.1, &saved.surfaces)?;
        self.motion.recall(&world, &saved.solver)?;
        self.world = world;
        self.scratch.rest.end();
        self.scratch.candidates.recall(&self.world, &saved.search);
        self.index = saved.index;
        self.taken_back = saved.taken_back;
        self.outside.clone_from(&saved.outside);
        self.driving.clone_from(&saved.driving);
        self.now.copy_from(&saved.now);
        self.before.clone_from(&saved.before);
        self.long_before.clone_from(&saved.long_before);
        Ok(())
    }

    fn digest(&self) -> u64 {
        *self.digest.get_or_init(|| digest(&self.world))
    }
}

fn digest(world: &World) -> u64 {
    let mut hash = Fnv::NONE;
    // What is written to takes everything.
    let _ = write!(hash, "{:?}", world.lasting());
    hash.0
}

/// The hash of Fowler, Noll and Vo, FNV-1a, of 64 bits.
struct Fnv(u64);

impl Fnv {
    /// That of nothing.
    const NONE: Self = Self(0xCBF2_9CE4_8422_2325);

    fn of(bytes: &[u8]) -> u64 {
        let mut hash = Self::NONE;
        hash.add(bytes);
        hash.0
    }

    fn add(&mut self, bytes: &[u8]) {
        const PRIME: u64 = 0x0000_0100_0000_01B3;
        for byte in bytes {
            self.0 = (self.0 ^ u64::from(*byte)).wrapping_mul(PRIME);
        }
    }
}

impl fmt::Write for Fnv {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        self.add(text.as_bytes());
        Ok(())
    }
}

/// A value as bytes of its own form.
///
/// # Errors
/// A value that has none.
pub fn to_bytes(value: &impl Serialize) -> Result<Vec<u8>, Error> {
    postcard::to_allocvec(value).map_err(|error| odd(format!("cannot be made: {error}")))
}

/// The value whose bytes these are, and no others.
///
/// # Errors
/// Bytes of something else.
pub fn from_bytes<'a, T: Deserialize<'a>>(bytes: &'a [u8]) -> Result<T, Error> {
    match postcard::take_from_bytes(bytes) {
        Ok((value, [])) => Ok(value),
        Ok(_) | Err(_) => Err(odd("cannot be read: its bytes are of something else".to_owned())),
    }
}

fn cut(length: usize) -> Error {
    odd(format!("is cut off after {length} bytes"))
}

fn odd(why: String) -> Error {
    Error::Saved(why)
}
