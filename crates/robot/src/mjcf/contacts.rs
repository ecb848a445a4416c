//! `<contact>`: excluded pairs of links, and explicit pairs of shapes.

use super::MjcfReader;
use crate::model::RobotForm;
use crate::xml::{Attributes, Element};
use tumble_model::shown;

impl MjcfReader<'_> {
    pub(super) fn read_contact(&mut self, section: &Element) -> Result<(), String> {
        for element in &section.children {
            match &*element.tag {
                "exclude" => self.read_exclusion(element)?,
                "pair" => self.read_pair(element)?,
                _ => return Err(element.wrong("this element is unknown in <contact>")),
            }
        }
        Ok(())
    }

    fn read_exclusion(&mut self, element: &Element) -> Result<(), String> {
        element.refuse_others(&["name", "body1", "body2"], &[])?;
        let links =
            ["body1", "body2"].map(|field| self.link(element, field, element.needed(field)?));
        let [first, second] = links;
        self.robot.apart.push([first?, second?]);
        Ok(())
    }

    /// Reads an explicit contact pair with its own friction.
    fn read_pair(&mut self, element: &Element) -> Result<(), String> {
        const READ: [&str; 6] = ["name", "class", "geom1", "geom2", "condim", "friction"];
        const SOFT: [&str; 5] = ["solref", "solreffriction", "solimp", "margin", "gap"];
        element.refuse_others(&READ, &SOFT)?;
        let read = self.defaulted(element, "")?;
        if SOFT.iter().any(|soft| read.get(soft).is_some()) {
            self.notes.soft();
        }
        let find = |field: &str| {
            let name = element.needed(field)?;
            let found =
                self.robot.shapes.iter().position(|shape| shape.name.as_deref() == Some(name));
            found.ok_or_else(|| {
                element.wrong(format!("{field}: there is no geom {:?}", shown::line(name)))
            })
        };
        let (first, second) = (find("geom1")?, find("geom2")?);
        let (a, b) = (&self.robot.shapes[first], &self.robot.shapes[second]);
        if a.link == b.link {
            return Err(
                element.wrong("geom2: its body is also the body of geom1; two bodies are needed")
            );
        }
        let carriers = self.robot.carriers();
        if [a, b].iter().any(|shape| shape.form == RobotForm::Plane && carriers[shape.link] != 0) {
            return Err(element.wrong("geom1, geom2: a plane must belong to the world"));
        }
        let friction = read.numbers("friction")?.unwrap_or_default();
        if friction.len() > 5 || friction.iter().any(|part| *part < 0.0) {
            return Err(element.wrong("friction: one to five numbers of 0 or more are needed"));
        }
        let own = match friction[..] {
            [along, across, ..] if along != across => {
                return Err(element.wrong(
                    "friction: different coefficients along and across, the first two numbers, are \
                     not supported; use equal ones",
                ));
            }
            [along, ..] => along,
            [] => 1.0,
        };
        let condim = read.whole("condim")?.unwrap_or(3);
        let others = [(2, 0.005), (3, 0.0001), (4, 0.0001)];
        let others = others.map(|(index, usual)| friction.get(index).copied().unwrap_or(usual));
        let rubs = self.rubs(element, condim, &others)?;
        if self.robot.options.contacts {
            let pair = (first.min(second), first.max(second));
            self.robot.pairs.insert(pair, if rubs { own } else { 0.0 });
        }
        Ok(())
    }

    /// True if contacts of `condim` have friction. Torsional and rolling friction, with the
    /// coefficients `others`, is rejected. With the option
    /// [`Reading::points_rub`](crate::Reading::points_rub) it is dropped with a note.
    pub(super) fn rubs(
        &mut self,
        element: &Element,
        condim: i64,
        others: &[f64],
    ) -> Result<bool, String> {
        if ![1, 3, 4, 6].contains(&condim) {
            return Err(element.wrong("condim: 1, 3, 4 or 6 is needed"));
        }
        if condim > 3 && others.iter().any(|part| *part > 0.0) {
            if !self.reading.points_rub {
                return Err(element.wrong(
                    "torsional and rolling friction, condim 4 and 6, is not supported; \
                     point_contacts of [[robots]] or --point-contacts keeps only sliding friction",
                ));
            }
            self.notes.rubs_alone();
        }
        Ok(condim > 1)
    }
}
