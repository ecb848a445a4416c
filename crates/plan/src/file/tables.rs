//! Tables of a problem file.

use super::StageName;
use crate::control::StartPart;
use nalgebra::Vector3;
use serde::Deserialize;
use std::path::PathBuf;
use tumble_model::fields::{Exactly, Numbers, Tables};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct File {
    pub(super) scene: PathBuf,
    pub(super) steps: u32,
    pub(super) seed: Option<u64>,
    #[serde(default)]
    pub(super) controls: Vec<ControlTable>,
    #[serde(default)]
    pub(super) target: Tables<TargetTable>,
    #[serde(default)]
    pub(super) path_constraints: Tables<PathConstraintTable>,
    #[serde(default)]
    pub(super) cost: CostTable,
    #[serde(default)]
    pub(super) search: SearchTable,
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields)]
pub(super) struct CostTable {
    pub(super) effort: Option<f64>,
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields)]
pub(super) struct SearchTable {
    pub(super) start: Option<String>,
    pub(super) stages: Option<Vec<StageName>>,
    pub(super) runs: Option<u32>,
    pub(super) knots: Option<u16>,
    pub(super) rounds: Option<u8>,
    pub(super) iterations: Option<u32>,
    pub(super) time: Option<f64>,
}

/// Range or value of a component.
#[derive(Deserialize, Clone, Copy)]
#[serde(untagged, expecting = "one number, or two, [low, high], are needed")]
pub(super) enum Range {
    Fixed(f64),
    Between(Numbers<2>),
}

impl Range {
    pub(super) fn bounds(of: Option<Self>) -> [f64; 2] {
        match of {
            None => [0.0; 2],
            Some(Self::Fixed(value)) => [value; 2],
            Some(Self::Between(Exactly(bounds))) => bounds,
        }
    }
}

/// Joints of a motor.
#[derive(Deserialize)]
#[serde(untagged, expecting = "the name of a joint, or a list of them, is needed")]
pub(super) enum JointNames {
    One(String),
    List(Vec<String>),
}

impl JointNames {
    pub(super) fn names(&self) -> &[String] {
        match self {
            Self::One(name) => std::slice::from_ref(name),
            Self::List(names) => names,
        }
    }
}

#[derive(Deserialize, Clone, Copy, PartialEq, Eq, Debug)]
#[serde(rename_all = "lowercase")]
pub(super) enum KindName {
    Force,
    Torque,
    Push,
    Motor,
    Start,
    Constant,
}

/// Direction along an axis of a body.
#[derive(Deserialize, Clone, Copy)]
pub(super) enum FaceSide {
    #[serde(rename = "+x")]
    XUp,
    #[serde(rename = "-x")]
    XDown,
    #[serde(rename = "+y")]
    YUp,
    #[serde(rename = "-y")]
    YDown,
    #[serde(rename = "+z")]
    ZUp,
    #[serde(rename = "-z")]
    ZDown,
}

impl FaceSide {
    pub(super) fn direction(self) -> Vector3<f64> {
        match self {
            Self::XUp => Vector3::x(),
            Self::XDown => -Vector3::x(),
            Self::YUp => Vector3::y(),
            Self::YDown => -Vector3::y(),
            Self::ZUp => Vector3::z(),
            Self::ZDown => -Vector3::z(),
        }
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ControlTable {
    pub(super) name: Option<String>,
    pub(super) kind: KindName,
    pub(super) body: Option<String>,
    pub(super) knots: Option<u32>,
    pub(super) effort: Option<f64>,
    pub(super) x: Option<Range>,
    pub(super) y: Option<Range>,
    pub(super) z: Option<Range>,
    pub(super) face: Option<FaceSide>,
    pub(super) at: Option<Numbers<3>>,
    pub(super) direction: Option<Numbers<3>>,
    pub(super) friction: Option<f64>,
    pub(super) normal: Option<Range>,
    pub(super) tangential: Option<Range>,
    pub(super) tangential_2: Option<Range>,
    pub(super) offset: Option<Range>,
    pub(super) offset_2: Option<Range>,
    pub(super) joint: Option<JointNames>,
    pub(super) axis: Option<String>,
    pub(super) force: Option<Range>,
    pub(super) of: Option<StartPart>,
    pub(super) constant: Option<String>,
    pub(super) value: Option<Range>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct TargetTable {
    pub(super) body: Option<String>,
    pub(super) after: Option<u32>,
    pub(super) position: Option<Vec<f64>>,
    pub(super) x: Option<f64>,
    pub(super) y: Option<f64>,
    pub(super) z: Option<f64>,
    pub(super) velocity: Option<Numbers<3>>,
    pub(super) speed: Option<f64>,
    pub(super) spin: Option<f64>,
    pub(super) attitude: Option<Numbers<4>>,
    pub(super) turn: Option<f64>,
    pub(super) axis: Option<Numbers<3>>,
    pub(super) down: Option<FaceSide>,
    #[serde(default)]
    pub(super) tolerance: Each,
    #[serde(default)]
    pub(super) weight: Each,
}

/// Tolerance or weight of each quantity of a target.
#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields)]
pub(super) struct Each {
    pub(super) position: Option<f64>,
    pub(super) velocity: Option<f64>,
    pub(super) speed: Option<f64>,
    pub(super) spin: Option<f64>,
    pub(super) attitude: Option<f64>,
    pub(super) turn: Option<f64>,
    pub(super) down: Option<f64>,
}

impl Each {
    /// Fields with their names.
    pub(super) fn fields(&self) -> [(&'static str, Option<f64>); 7] {
        [
            ("position", self.position),
            ("velocity", self.velocity),
            ("speed", self.speed),
            ("spin", self.spin),
            ("attitude", self.attitude),
            ("turn", self.turn),
            ("down", self.down),
        ]
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PathConstraintTable {
    pub(super) name: Option<String>,
    pub(super) body: Option<String>,
    pub(super) above: Option<WallTable>,
    pub(super) away: Option<PointTable>,
    pub(super) x: Option<Numbers<2>>,
    pub(super) y: Option<Numbers<2>>,
    pub(super) z: Option<Numbers<2>>,
    pub(super) tolerance: Option<f64>,
    pub(super) weight: Option<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct WallTable {
    pub(super) x: f64,
    pub(super) width: f64,
    pub(super) height: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PointTable {
    pub(super) point: Numbers<3>,
    pub(super) radius: f64,
}
