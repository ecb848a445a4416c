//! Saved simulations, as values and as bytes.
//!
//! A step depends on the moment at which it starts, the inputs, and the memory of the solver.
//! [`Saved`] holds all of them, so that a [restored](super::Simulation::restore) simulation continues
//! with the same bits. The world is not included. It is rebuilt and must be
//! identical to the last bit, which a digest checks.
//!
//! The bytes are a magic word, the format number, the length, the content and a checksum. Floating
//! point numbers keep their bits.

use super::driving::Driving;
use super::inputs::ExternalLoads;
use super::moment::Moment;
use super::{MOST_STEPS, Motion, Simulation, Undo};
use crate::error::Error;
use crate::mechanics::load::Polyline;
use crate::mechanics::{Load, State};
use crate::step::StepSolution;
use crate::world::{Changeable, World};
use serde::{Deserialize, Serialize};
use std::fmt::{self, Write as _};

/// State of a simulation: its moment, its inputs and the memory of its solver.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Saved {
    /// Digest of the parts of the world that a simulation does not change.
    world: u64,
    changeable: Changeable,
    moment: Moment,
    outside: Vec<ExternalLoads>,
    driving: Driving,
    /// Serialised memory of the solver, in its own format.
    solver: Vec<u8>,
    /// Notes of the calling program.
    notes: Vec<u8>,
}

/// Magic word at the start of the bytes.
const MAGIC: [u8; 8] = *b"tumble-l";
/// Format number. It changes with the meaning of the content.
const FORMAT: u32 = 18;
/// Length of magic word, format number and length field (bytes).
const HEADER: usize = 8 + 4 + 8;
/// Length of the checksum (bytes).
const TRAILER: usize = 8;

impl Saved {
    /// Index k of the current step.
    pub fn index(&self) -> u64 {
        self.moment.index
    }

    /// States X at the current step, one per body, with the velocities of the instant.
    pub fn states(&self) -> &[State] {
        self.moment.states()
    }

    /// States from which the next step starts; see [`Simulation::step_states`].
    pub fn step_states(&self) -> &[State] {
        &self.moment.now.states
    }

    /// Returns this state with `notes`: additional data of the calling program, in its own format.
    #[must_use]
    pub fn with_notes(self, notes: Vec<u8>) -> Self {
        Self { notes, ..self }
    }

    /// The [notes](Saved::with_notes); empty by default.
    pub fn notes(&self) -> &[u8] {
        &self.notes
    }

    /// Serialises to bytes for [`Saved::from_bytes`].
    ///
    /// # Errors
    /// If serialisation fails; states saved by a simulation always succeed.
    pub fn to_bytes(&self) -> Result<Vec<u8>, Error> {
        let numbers = to_bytes(self)?;
        let mut bytes = Vec::with_capacity(HEADER + numbers.len() + TRAILER);
        bytes.extend(MAGIC);
        bytes.extend(FORMAT.to_le_bytes());
        bytes.extend((numbers.len() as u64).to_le_bytes());
        bytes.extend(numbers);
        bytes.extend(Fnv::hash(&bytes).to_le_bytes());
        Ok(bytes)
    }

    /// Reads the bytes of [`Saved::to_bytes`].
    ///
    /// # Errors
    /// [`Error::Saved`] if the bytes are not a saved state, have another format, or are truncated
    /// or corrupted.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, Error> {
        let Some((magic, rest)) = bytes.split_first_chunk() else { return Err(cut(bytes.len())) };
        if *magic != MAGIC {
            return Err(bad_input(
                "has a bad header: it is not a saved state of tumble".to_owned(),
            ));
        }
        let Some((format, rest)) = rest.split_first_chunk() else { return Err(cut(bytes.len())) };
        let format = u32::from_le_bytes(*format);
        if format != FORMAT {
            let why = format!("has format {format}; this version reads format {FORMAT}");
            return Err(bad_input(why));
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
            return Err(bad_input(format!("has {} bytes after its end", found - length)));
        }
        let all = &bytes[..bytes.len() - TRAILER];
        if Fnv::hash(all) != u64::from_le_bytes(*checksum) {
            return Err(bad_input("is damaged: its checksum does not match".to_owned()));
        }
        from_bytes(content)
    }

    /// Checks that this state fits `world`, whose digest is `digest`. Worlds that are equal to the
    /// last bit share a digest.
    fn check(&self, world: &World, digest: u64) -> Result<(), Error> {
        let bodies = world.bodies().len();
        let Moment { index, now, before, long_before, instants, search, .. } = &self.moment;
        if now.states.len() != bodies {
            let count = now.states.len();
            let why = format!("has {count} bodies; the world has {bodies}");
            return Err(bad_input(why));
        }
        if self.world != digest {
            let why = "belongs to another world: a body, a constant or a fixed piece differs";
            return Err(bad_input(why.to_owned()));
        }
        let pasts = [Some(&**now), before.as_deref(), long_before.as_deref()];
        let is_whole = |solution: &StepSolution| {
            let numbers = solution.states.iter().map(State::to_vector);
            solution.states.len() == bodies
                && numbers.into_iter().all(|numbers| numbers.iter().all(|x| x.is_finite()))
        };
        let is_possible = *index < MOST_STEPS
            && self.outside.len() == bodies
            && self.outside.iter().all(ExternalLoads::is_possible)
            && pasts.into_iter().flatten().all(is_whole)
            && search.fits(world)
            && self.changeable.fits(world)
            && instants.as_ref().is_none_or(|instants| instants.fits(bodies))
            && self.driving.fits(&self.changeable.joints);
        if is_possible {
            Ok(())
        } else {
            Err(bad_input("is inconsistent: its numbers contradict each other".to_owned()))
        }
    }
}

impl ExternalLoads {
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
    /// Creates a simulation of `world` with `motion` that continues from `saved`
    /// ([`Simulation::restore`]). The states are not checked as initial states, because a run with
    /// held bodies may reach states where none may start.
    ///
    /// # Errors
    /// Same as [`Simulation::restore`]; also joints with [`Motion::Floating`].
    pub fn restored(world: World, motion: Motion<'a>, saved: &Saved) -> Result<Self, Error> {
        saved.check(&world, digest(&world))?;
        let mut simulation = Self::at(world, &saved.moment.now.states, motion)?;
        simulation.restore(saved)?;
        Ok(simulation)
    }

    /// Saves the simulation, to continue later in this or another simulation of the same world.
    pub fn save(&self) -> Saved {
        Saved {
            world: self.digest(),
            changeable: self.world.changeable(),
            moment: self.moment.clone(),
            outside: self.inputs.outside.clone(),
            driving: self.inputs.driving.clone(),
            solver: self.workspace.motion.memory(),
            notes: Vec::new(),
        }
    }

    /// Continues from `saved`. With the same solver and settings, all further steps are equal to
    /// the last bit. Solvers with and without memory can continue from each other's saved states.
    /// The interrupt flag stays.
    ///
    /// # Errors
    /// If `saved` has another world, inconsistent content, or solver memory of an unknown format.
    /// The simulation is then unchanged.
    pub fn restore(&mut self, saved: &Saved) -> Result<(), Error> {
        saved.check(&self.world, self.digest())?;
        let world = self.world.with_changes(&saved.changeable)?;
        self.workspace.motion.recall(&world, &saved.solver)?;
        self.world = world;
        self.workspace.forget();
        self.moment.clone_from(&saved.moment);
        self.inputs.outside.clone_from(&saved.outside);
        self.inputs.driving.clone_from(&saved.driving);
        self.undo = Undo::Impossible;
        Ok(())
    }

    fn digest(&self) -> u64 {
        *self.digest.get_or_init(|| digest(&self.world))
    }
}

fn digest(world: &World) -> u64 {
    let mut hash = Fnv::NONE;
    // Writing to the hash cannot fail.
    let _ = write!(hash, "{:?}", world.lasting());
    hash.0
}

/// 64-bit FNV-1a hash of Fowler, Noll and Vo.
struct Fnv(u64);

impl Fnv {
    /// Hash of empty input.
    const NONE: Self = Self(0xCBF2_9CE4_8422_2325);

    fn hash(bytes: &[u8]) -> u64 {
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

/// Serialises a value to bytes.
///
/// # Errors
/// [`Error::Saved`] if the value cannot be serialised.
pub fn to_bytes(value: &impl Serialize) -> Result<Vec<u8>, Error> {
    postcard::to_allocvec(value).map_err(|error| bad_input(format!("cannot be created: {error}")))
}

/// Deserialises a value from exactly these bytes.
///
/// # Errors
/// [`Error::Saved`] if the bytes are not a value of this type.
pub fn from_bytes<'a, T: Deserialize<'a>>(bytes: &'a [u8]) -> Result<T, Error> {
    match postcard::take_from_bytes(bytes) {
        Ok((value, [])) => Ok(value),
        Ok(_) | Err(_) => Err(bad_input("cannot be read: its content is unknown".to_owned())),
    }
}

fn cut(length: usize) -> Error {
    bad_input(format!("is cut off after {length} bytes"))
}

fn bad_input(why: String) -> Error {
    Error::Saved(why)
}
