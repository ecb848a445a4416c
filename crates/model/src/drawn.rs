//! What of a body's start the seed draws, so that a run's files can be held against their seed.

use super::model::Model;
use super::shape::ModelPlace;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use tumble_core::contact::Plane;
use tumble_core::mechanics::State;
use tumble_core::simulation::random::Draws;

/// What is computed again of the same draws is the same but for another machine's rounding, in parts of the
/// largest number.
const SAME: f64 = 1e-12;

/// A start before anything of it is drawn. The draws of a seed go to the bodies in their order, of each to the attitude
/// and then to the coordinates that jitter.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct DrawnModel {
    /// Where the frame of the shape is, m.
    pub position: [f64; 3],
    /// Unit quaternion w, x, y, z; null where it is drawn.
    pub attitude: Option<[f64; 4]>,
    /// By how much each coordinate is drawn about `position`, m.
    pub jitter: [f64; 3],
    /// Whether the attitude is drawn as the tutorial does: [`Draws::tutorial_attitude`].
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub tutorial: bool,
    /// Whether both are seen from the ground and not from the world.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub ground: bool,
}

impl DrawnModel {
    /// Whether anything is drawn.
    pub fn draws(&self) -> bool {
        self.attitude.is_none() || self.jitter.iter().any(|size| *size > 0.0)
    }

    /// The place that the next draws make.
    pub fn place(&self, draws: &mut Draws) -> ModelPlace {
        let mut drawn = || if self.tutorial { draws.tutorial_attitude() } else { draws.attitude() };
        let attitude = self.attitude.unwrap_or_else(|| drawn().into());
        let mut place = ModelPlace { position: self.position, attitude };
        for (coordinate, size) in place.position.iter_mut().zip(self.jitter) {
            if size > 0.0 {
                *coordinate += size * (2.0 * draws.unit() - 1.0);
            }
        }
        place
    }
}

/// The state in the world of what is at `place`, seen from the `ground` where there is one, its centre of mass at
/// `centre` in its own frame.
pub fn state_at(
    ground: Option<&Plane>,
    place: &ModelPlace,
    velocity: Vector3<f64>,
    spin: Vector3<f64>,
    centre: &Vector3<f64>,
) -> State {
    let position = Vector3::from(place.position) + place.rotation() * centre;
    let state = State { position, attitude: place.attitude.into(), velocity, spin };
    ground.map_or(state, |ground| ground.state_to_world(&state))
}

impl Model {
    /// Whether anything of its starts is drawn.
    #[must_use]
    pub fn is_drawn(&self) -> bool {
        self.bodies.iter().any(|body| body.drawn.is_some())
    }

    /// The first body that does not start where `seed` draws it.
    #[must_use]
    pub fn drawn_otherwise(&self, seed: u32) -> Option<&str> {
        let plane = self.plane.as_ref();
        let plane = plane.and_then(|plane| Plane::new(plane.normal.0.into(), plane.offset).ok());
        let mut draws = Draws::new(seed);
        let still = (Vector3::zeros(), Vector3::zeros());
        let body = self.bodies.iter().find(|body| {
            let Some(drawn) = &body.drawn else { return false };
            let ground = plane.as_ref().filter(|_| drawn.ground);
            let found =
                state_at(ground, &drawn.place(&mut draws), still.0, still.1, &body.centre.into());
            let start = body.start.state();
            let off = (found.position - start.position).amax();
            let turned = (found.attitude - start.attitude).amax();
            // A NaN is nowhere.
            let is_there = off <= SAME * (1.0 + start.position.amax()) && turned <= SAME;
            !is_there
        });
        body.map(|body| body.name.as_str())
    }

    /// Forgets what was drawn, where the starts are no longer what `seed` draws: where bodies have left, or states
    /// were set.
    pub fn keep_draws_of(&mut self, seed: u32) {
        if self.drawn_otherwise(seed).is_some() {
            self.bodies.iter_mut().for_each(|body| body.drawn = None);
        }
    }
}
