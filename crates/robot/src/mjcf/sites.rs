//! Sites: named frames on bodies. Also frames defined by two points.

use super::MjcfReader;
use super::bodies::Within;
use super::defaults::Defaulted;
use crate::frame::{LinkFrame, from_z};
use crate::model::{NamedSite, RobotSite};
use crate::xml::{Attributes, Element, Parsed};
use nalgebra::Vector3;

impl MjcfReader<'_> {
    /// Reads a site in `frame` of a link. A site without a name is skipped.
    pub(super) fn read_site(&mut self, element: &Element, within: &Within<'_>) -> Parsed<()> {
        let &Within { link, ref frame, class } = within;
        const READ: &str = "name class pos quat axisangle euler xyaxes zaxis fromto";
        element.refuse_others(READ, "type size group material rgba user")?;
        let read = self.defaulted(element, class)?;
        let own = match ends(&read)? {
            Some((own, _)) => own,
            None => self.compiler.frame(&read)?,
        };
        let Some(name) = element.own("name") else {
            self.notes.idle("site without a name");
            return Ok(());
        };
        if self.robot.site(name).is_some() {
            return Err(element.wrong("this name is used twice; each site needs its own"));
        }
        let site = RobotSite { link, frame: frame.then(&own) };
        self.robot.sites.push(NamedSite { name: name.to_owned(), site });
        Ok(())
    }
}

/// Midpoint frame of `fromto` with z from the second point to the first, and half the distance
/// between the points (m). `None` without `fromto`.
pub fn ends(read: &Defaulted<'_>) -> Parsed<Option<(LinkFrame, f64)>> {
    let Some([a, b, c, d, e, f]) = read.exactly::<6>("fromto")? else {
        return Ok(None);
    };
    let (from, to) = (Vector3::new(a, b, c), Vector3::new(d, e, f));
    let half = 0.5 * (to - from).norm();
    if !(1e-6..=1e4).contains(&half) {
        let why = "fromto: two points 2e-6 to 2e4 m apart are needed";
        return Err(read.element().wrong(why));
    }
    let attitude = from_z(&(from - to).normalize());
    Ok(Some((LinkFrame { position: (from + to) * 0.5, attitude }, half)))
}
