//! What flags and fields of scenario files may name: the values that are no plain numbers.

use nalgebra::{Matrix3, Vector3, Vector4};
use serde::Deserialize;
#[cfg(feature = "ipopt")]
use tumble::solver::ipopt::Formulation;
use tumble_core::contact::detection::Detection;
use tumble_core::mechanics::quaternion::unit;
use tumble_core::simulation::random::random_attitude;
use tumble_core::simulation::scene::TutorialScene;

/// A scene of the tutorial.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum SceneName {
    /// A cube thrown on the ground.
    Drop,
    /// A cube floating without gravity or ground.
    Floating,
}

impl SceneName {
    /// The scene.
    pub fn scene(self) -> TutorialScene {
        match self {
            Self::Drop => TutorialScene::drop(),
            Self::Floating => TutorialScene::floating(),
        }
    }
}

/// The contact points of the body.
#[derive(Debug, Clone, PartialEq)]
pub enum BodyShape {
    /// The corners of a box with these sides, m.
    Box(Vector3<f64>),
    /// These, m, body frame.
    Points(Vec<Vector3<f64>>),
}

/// The inertia of the body.
#[derive(Debug, Clone, PartialEq)]
pub enum Inertia {
    /// That of a box of equal density.
    Solid,
    /// kg m², body frame.
    Matrix(Matrix3<f64>),
}

/// The attitude at the start.
#[derive(Debug, Clone, PartialEq)]
pub enum Attitude {
    /// Drawn from the seed.
    Random,
    /// Unit quaternion, body → frame.
    Given(Vector4<f64>),
}

impl Attitude {
    /// The unit quaternion along `quaternion`.
    pub fn given(quaternion: Vector4<f64>) -> Result<Self, String> {
        // In this order NaN is refused as well.
        if quaternion.norm() >= 1e-6 && quaternion.amax() <= 1e6 {
            Ok(Self::Given(unit(quaternion)))
        } else {
            Err("a quaternion W,X,Y,Z of a length from 1e-6 to 1e6 is needed".to_owned())
        }
    }

    /// The unit quaternion w, x, y, z; drawn from `seed` where it is random.
    pub fn quaternion(&self, seed: u32) -> Vector4<f64> {
        match self {
            Self::Random => random_attitude(seed),
            Self::Given(quaternion) => *quaternion,
        }
    }
}

/// In which frame a start is given.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
#[serde(rename_all = "kebab-case")]
pub enum StartFrame {
    /// The world's.
    World,
    /// Of the plane: z along its normal.
    Ground,
}

/// Who solves contact steps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
#[serde(rename_all = "kebab-case")]
pub enum SolverName {
    /// Ipopt on the tutorial's nonlinear program.
    Ipopt,
    /// Newton's method on the contact law itself.
    Native,
}

/// Which points may touch in a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
#[serde(rename_all = "kebab-case")]
pub enum DetectionName {
    /// z ≤ 5 mm at step k.
    Height,
    /// The same, or free flight ends at z ≤ 0.
    Predictive,
}

impl From<DetectionName> for Detection {
    fn from(name: DetectionName) -> Self {
        match name {
            DetectionName::Height => Self::Height,
            DetectionName::Predictive => Self::Predictive,
        }
    }
}

/// Which program Ipopt sees.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
#[serde(rename_all = "kebab-case")]
pub enum FormulationName {
    /// All variables and rows, those of the other corners clamped to zero; SI units.
    Clamped,
    /// Only what can carry a force, in the scene's own units.
    Reduced,
}

#[cfg(feature = "ipopt")]
impl From<FormulationName> for Formulation {
    fn from(name: FormulationName) -> Self {
        match name {
            FormulationName::Clamped => Self::Clamped,
            FormulationName::Reduced => Self::Reduced,
        }
    }
}

/// Solver settings that go together.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
#[serde(rename_all = "kebab-case")]
pub enum Preset {
    /// The tutorial's program and settings to the letter.
    Tutorial,
}

impl Preset {
    /// The word of the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Tutorial => "tutorial",
        }
    }
}

/// What happens with a step that fails.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
#[serde(rename_all = "kebab-case")]
pub enum OnFailure {
    /// Climb the ladder of other starts; only with --solver ipopt.
    Ladder,
    /// Keep the point found, as the tutorial does, but say so.
    Record,
    /// End the run before such a step.
    Stop,
}

impl OnFailure {
    /// The word for it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ladder => "ladder",
            Self::Record => "record",
            Self::Stop => "stop",
        }
    }
}
