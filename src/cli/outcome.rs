//! How a command ends.

use std::fmt;
use std::path::Path;
use std::process::ExitCode;
use tumble::error::Error;
use tumble::ipopt::IpoptError;

/// How a command ended well.
pub enum Outcome {
    /// All is as it should be.
    Done,
    /// Finished, but some step did not converge.
    Unconverged,
    /// Ctrl-C: what was computed is written.
    Interrupted,
    /// `verify` found that the file's certificates are not those of its steps, or `validate`
    /// that a quantity is off.
    Mismatch,
}

impl Outcome {
    pub fn exit_code(&self) -> ExitCode {
        match self {
            Self::Done => ExitCode::SUCCESS,
            Self::Mismatch => ExitCode::from(1),
            Self::Unconverged => ExitCode::from(3),
            Self::Interrupted => ExitCode::from(130),
        }
    }
}

/// Why a command ended early: one sentence.
#[derive(Debug)]
pub enum Failure {
    /// The user can mend it: exit code 2.
    Input(String),
    /// Anything else: exit code 1.
    Other(String),
}

impl Failure {
    pub fn exit_code(&self) -> ExitCode {
        match self {
            Self::Input(_) => ExitCode::from(2),
            Self::Other(_) => ExitCode::from(1),
        }
    }

    /// A setting without which there is nothing to simulate.
    pub fn needed(field: &str) -> Self {
        Self::Input(format!("{field} is not given; it is needed"))
    }

    /// The same, with the file whose fault it is.
    pub fn in_file(self, path: &Path) -> Self {
        match self {
            Self::Input(sentence) => Self::Input(format!("{}: {sentence}", path.display())),
            Self::Other(_) => self,
        }
    }
}

impl Failure {
    /// Ipopt refuses an option: say which.
    pub fn of_ipopt(error: IpoptError) -> Self {
        match error {
            IpoptError::Option { name, .. } => Self::Input(format!("{name}: {error}")),
            other => Self::Other(other.to_string()),
        }
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (Self::Input(sentence) | Self::Other(sentence)) = self;
        // A file's own words may hold line breaks; the sentence is one line.
        let line: String = sentence.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
        f.write_str(&line)
    }
}

/// The model refuses a value: say which flag or field sets it.
impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        match flag_behind(&error) {
            Some(flag) => Self::Input(format!("{flag}: {error}")),
            None => Self::Input(error.to_string()),
        }
    }
}

/// The flag (or field of a file) that sets what the model refused.
fn flag_behind(error: &Error) -> Option<&'static str> {
    match error {
        Error::Inertia(_) => Some("inertia"),
        Error::OutOfRange { field, .. } => match *field {
            "time step (s)" => Some("dt"),
            "coefficient of friction" => Some("mu"),
            "mass (kg)" => Some("mass"),
            "gravity (m/s²)" => Some("gravity"),
            "half side of the box (m)" => Some("box"),
            "smoothing epsilon (N)" => Some("epsilon"),
            "position (m)" => Some("position or height"),
            "norm of the attitude quaternion" => Some("attitude"),
            "normal of the plane" | "length of the plane's normal" | "offset of the plane (m)" => {
                Some("plane")
            }
            "load (N, N m)" | "time of the load (s)" => Some("force or torque"),
            "point of the load (m)" => Some("force-at"),
            "velocity (m/s)" => Some("velocity"),
            "spin (rad/s)" => Some("spin"),
            _ => None,
        },
        _ => None,
    }
}

/// An option that would do nothing is refused rather than ignored.
pub fn refuse_flags(place: &str, flags: &[(&str, bool)]) -> Result<(), Failure> {
    match flags.iter().find(|(_, given)| *given) {
        Some((flag, _)) => {
            Err(Failure::Input(format!("{flag} has no meaning with {place}; leave it out")))
        }
        None => Ok(()),
    }
}
