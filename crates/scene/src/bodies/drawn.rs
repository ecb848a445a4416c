//! Random starts of bodies: the seed's share of a start, so that a run can be checked against its
//! seed.

use crate::bodies::place::Place;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use tumble_core::contact::Plane;
use tumble_core::mechanics::State;
use tumble_core::simulation::random::Draws;

/// Description of a random start, before the draw.
///
/// The bodies use the draws of a seed in their order. Each body draws its attitude first, then the
/// coordinates with jitter.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct DrawnModel {
    /// Position of the shape's frame (m).
    pub position: [f64; 3],
    /// Unit quaternion w, x, y, z; null for a random attitude.
    pub attitude: Option<[f64; 4]>,
    /// Half width of the uniform distribution of each coordinate about `position` (m).
    pub jitter: [f64; 3],
    /// True if the attitude is drawn by the tutorial's method, [`Draws::tutorial_attitude`].
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub tutorial: bool,
    /// True if position and attitude are in the ground's frame; otherwise they are in the world
    /// frame.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub ground: bool,
}

impl DrawnModel {
    /// True if the start depends on the seed.
    pub fn draws(&self) -> bool {
        self.attitude.is_none() || self.jitter.iter().any(|size| *size > 0.0)
    }

    /// Place that results from the next values of `draws`.
    pub fn place(&self, draws: &mut Draws) -> Place {
        let mut drawn = || if self.tutorial { draws.tutorial_attitude() } else { draws.attitude() };
        let attitude = self.attitude.unwrap_or_else(|| drawn().into());
        let mut place = Place { position: self.position, attitude };
        for (coordinate, size) in place.position.iter_mut().zip(self.jitter) {
            if size > 0.0 {
                *coordinate += size * (2.0 * draws.unit() - 1.0);
            }
        }
        place
    }
}

/// State, in the world, of a body whose shape's frame is at `place`.
///
/// `place` is in the frame of `ground` if there is one. `centre` is the centre of mass in the
/// shape's frame (m).
pub fn state_at(
    ground: Option<&Plane>,
    place: &Place,
    velocity: Vector3<f64>,
    spin: Vector3<f64>,
    centre: &Vector3<f64>,
) -> State {
    let position = Vector3::from(place.position) + place.rotation() * centre;
    let state = State { position, attitude: place.attitude.into(), velocity, spin };
    ground.map_or(state, |ground| ground.state_to_world(&state))
}
