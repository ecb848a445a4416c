//! Values of flags and scenario fields other than plain numbers.

use serde::{Deserialize, Serialize};

/// Scene of the tutorial.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum SceneName {
    /// A cube thrown on the ground.
    Drop,
    /// A cube floating without gravity or ground.
    Floating,
}

/// Frame of a start.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum StartFrame {
    /// Frame of the world.
    World,
    /// Frame of the ground: z is the plane's normal.
    Ground,
    /// Frame of the world; the position is the centre of mass.
    Centre,
}

/// Solver of contact steps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum SolverName {
    /// Ipopt on the tutorial's nonlinear program.
    Ipopt,
    /// Newton's method on the contact law.
    Native,
}

/// Named combination of solver settings.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Preset {
    /// Exactly the tutorial's program and settings.
    Tutorial,
    /// The same with the tutorial's other rows of maximum dissipation: the normal force is their
    /// factor instead of the contact flag.
    TutorialProduct,
}

impl Preset {
    /// Name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Tutorial => "tutorial",
            Self::TutorialProduct => "tutorial-product",
        }
    }
}

/// Action if a step is not solved.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum OnFailure {
    /// Try other initial points (the ladder); only with Ipopt.
    Ladder,
    /// Keep the point found and record the failure, as the tutorial does.
    Record,
    /// End the run before this step.
    Stop,
}

impl OnFailure {
    /// Name in files and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ladder => "ladder",
            Self::Record => "record",
            Self::Stop => "stop",
        }
    }
}
