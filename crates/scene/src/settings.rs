//! Import settings of a single robot file.

use std::path::PathBuf;
use tumble_model::failure::Failure;

/// Import settings of a single robot file; `[[robots]]` has the same fields in a scenario.
#[derive(Debug, Clone, Default)]
#[cfg_attr(feature = "clap", derive(clap::Args))]
pub struct RobotSettings {
    /// Folder for `package://name/rest` in a robot file: DIR/name/rest is read [default: the
    /// nearest folder that has it, from the robot file upwards].
    #[cfg_attr(feature = "clap", arg(long, value_name = "DIR"))]
    pub packages: Option<PathBuf>,
    /// Part of a robot file to ignore: `tag` or `name` of elements, `tag:name` of one element, or
    /// `@attribute` of all.
    ///
    /// Can be repeated.
    #[cfg_attr(feature = "clap", arg(long, value_name = "WHAT"))]
    pub leave_out: Vec<String>,
    /// Treat contacts of an MJCF file with torsional and rolling friction (condim 4 and 6) as
    /// points with sliding friction only.
    #[cfg_attr(feature = "clap", arg(long))]
    pub point_contacts: bool,
}

impl RobotSettings {
    /// Names of the settings, and whether each is given.
    pub fn given(&self) -> [(&'static str, bool); 3] {
        [
            ("packages", self.packages.is_some()),
            ("leave-out", !self.leave_out.is_empty()),
            ("point-contacts", self.point_contacts),
        ]
    }

    /// Rejects these settings for a file that is not a robot's.
    ///
    /// # Errors
    /// The first given one.
    pub fn refuse(&self) -> Result<(), Failure> {
        let place = "anything but a robot file; in a scenario, use [[robots]]";
        Failure::refuse_idle(place, &self.given())
    }
}
