//! Settings that flags have changed. The title of the run lists them.

use super::choices::StartFrame;
use super::settings::Settings;

impl Settings {
    /// Names of the flags that change a value of `below`.
    ///
    /// Only settings that affect the motion count. The seed and the solver are part of every title.
    pub fn changed(&self, below: &Self) -> Vec<String> {
        fn other<T: PartialEq>(given: &Option<T>, usual: &Option<T>) -> bool {
            given.is_some() && given != usual
        }
        // The height is the z coordinate of the position.
        let usual = self.position.or(below.position).map(|position| position[2]);
        let changes = [
            ("start-index", other(&self.start_index, &Some(below.start_index.unwrap_or(0)))),
            ("dt", other(&self.dt, &below.dt)),
            ("rotation", other(&self.rotation, &below.rotation)),
            ("mu", other(&self.mu, &below.mu)),
            ("restitution", other(&self.restitution, &Some(below.restitution.unwrap_or(0.0)))),
            ("rebound-speed", other(&self.rebound_speed, &below.rebound_speed)),
            ("mass", other(&self.mass, &below.mass)),
            ("inertia", other(&self.inertia, &below.inertia)),
            ("box", other(&self.shape, &below.shape)),
            ("plane", other(&self.plane, &Some(below.plane.clone().unwrap_or_default()))),
            ("force", other(&self.force, &below.force)),
            ("torque", other(&self.torque, &below.torque)),
            ("force-at", other(&self.force_at, &below.force_at)),
            ("gravity", other(&self.gravity, &below.gravity)),
            ("position", other(&self.position, &below.position)),
            ("height", other(&self.height, &usual)),
            ("attitude", other(&self.attitude, &below.attitude)),
            ("velocity", other(&self.velocity, &below.velocity)),
            ("spin", other(&self.spin, &below.spin)),
            ("frame", other(&self.frame, &Some(below.frame.unwrap_or(StartFrame::World)))),
        ];
        let changed = changes.into_iter().filter(|(_, changed)| *changed);
        let robot = self.robot.given().into_iter().skip(1).filter(|(_, given)| *given);
        changed.chain(robot).map(|(name, _)| name.to_owned()).collect()
    }
}
