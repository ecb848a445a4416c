//! Conversion between body states and coordinates of a robot.

use super::{Assembled, Carried};
use tumble_core::mechanics::State;
use tumble_robot::LinkFrame;
use tumble_robot::motion::LinkMotion;

impl Assembled {
    /// State of a body for the given motion of the links.
    pub(super) fn state_of(&self, place: usize, links: &[LinkMotion]) -> State {
        let Carried { link, centre, .. } = self.bodies[place];
        let LinkMotion { frame, spin, velocity } = links[link];
        let arm = frame.rotation() * centre;
        State {
            position: frame.point(&centre),
            attitude: frame.attitude,
            velocity: velocity + spin.cross(&arm),
            spin: frame.rotation().tr_mul(&spin),
        }
    }

    /// Writes the states of its bodies for these coordinates and rates to `states`. Values of
    /// dependent joints are computed and those in `q` and `v` ignored.
    ///
    /// # Errors
    /// A wrong number of states, and the errors of `Robot::motion`.
    pub fn set_states(&self, q: &[f64], v: &[f64], states: &mut [State]) -> Result<(), String> {
        let (mut q, mut v) = (q.to_vec(), v.to_vec());
        self.robot.follow(&mut q, &mut v);
        let motion = self.robot.motion(&q, &v)?;
        for place in 0..self.bodies.len() {
            let Carried { body, ref parts, .. } = self.bodies[place];
            let own = states.get_mut(body..body + parts.len()).ok_or_else(missing)?;
            own.fill(self.state_of(place, motion.links()));
        }
        Ok(())
    }

    /// Coordinates and rates for the body states `states`. Angles are those nearest to `near`.
    ///
    /// # Errors
    /// Too few states; a wrong number of coordinates.
    pub fn coordinates(
        &self,
        states: &[State],
        near: &[f64],
    ) -> Result<(Vec<f64>, Vec<f64>), String> {
        let moving = self.links_at(states)?;
        let frames: Vec<_> = moving.iter().map(|link| link.frame).collect();
        let q = self.robot.coordinates(&frames, near)?;
        let motion = self.robot.motion(&q, &vec![0.0; self.robot.counts().1])?;
        let rates = motion.rates(&self.robot, &moving);
        Ok((q, rates))
    }

    /// Motion of all links for the body states `states`.
    ///
    /// # Errors
    /// Too few states.
    pub fn links_at(&self, states: &[State]) -> Result<Vec<LinkMotion>, String> {
        let link = |(place, offset): &(Option<usize>, LinkFrame)| {
            let Some(place) = place else {
                return Ok(LinkMotion::still(self.world().then(offset)));
            };
            let Carried { body: index, centre, .. } = self.bodies[*place];
            let State { position, attitude, velocity, spin } =
                *states.get(index).ok_or_else(missing)?;
            let placed = LinkFrame { position, attitude };
            let placed = LinkFrame { position: placed.point(&-centre), attitude };
            let frame = placed.then(offset);
            let spin = placed.rotation() * spin;
            let velocity = velocity + spin.cross(&(frame.position - position));
            Ok(LinkMotion { frame, spin, velocity })
        };
        self.links.iter().map(link).collect()
    }
}

fn missing() -> String {
    "states: a body of the robot has no state".to_owned()
}
