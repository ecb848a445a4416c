//! Touch sensors on the links of a robot.

use super::Assembled;
use tumble_core::simulation::{Interval, StepRecord};
use tumble_core::world::Partner;
use tumble_robot::model::RobotSite;

impl Assembled {
    /// Reading of a touch sensor: sum of the mean normal forces (N) of a step on the bodies of a link,
    /// or on the fixed pieces of a link held by the world.
    ///
    /// - `partner` selects the contacts with one partner.
    /// - `within` selects the contacts within a radius (m) of a site. The site's position is that
    ///   at the start of the step.
    ///
    /// # Errors
    /// A link that does not exist; a record of other bodies.
    pub fn touch(
        &self,
        record: &StepRecord,
        link: usize,
        partner: Option<Partner>,
        within: Option<(&RobotSite, f64)>,
    ) -> Result<f64, String> {
        let zone = match within {
            Some((site, radius)) => {
                let links = self.links_at(record.states())?;
                Some((site.motion(&links)?.frame.position, radius))
            }
            None => None,
        };
        let pieces = self.pieces(link);
        let own = |of: Partner| match of {
            Partner::Body(body) => self.moves_with(link, body),
            Partner::Fixed(piece) => pieces.contains(&piece),
            Partner::Ground => false,
        };
        let mut sum = 0.0;
        let forces = record.shares().flat_map(|(share, interval)| {
            let Interval { states, contacts, solution, .. } = interval;
            let pairs = contacts.iter().zip(&solution.contacts);
            pairs.map(move |(contact, found)| {
                let share = share.forces(contact.key.body, contact.key.partner.body());
                (contact, states, share * found.normal_force)
            })
        });
        for (contact, states, force) in forces {
            let (body, other) = (contact.key.body, contact.key.partner);
            let sides = [(Partner::Body(body), other), (other, Partner::Body(body))];
            let touches =
                sides.iter().any(|(of, with)| own(*of) && partner.is_none_or(|p| p == *with));
            let place = states.get(body).map(|state| state.position + contact.arm);
            let is_near = zone.is_none_or(|(centre, radius)| {
                place.is_some_and(|place| (place - centre).norm() <= radius)
            });
            if touches && is_near {
                sum += force;
            }
        }
        Ok(sum)
    }
}
