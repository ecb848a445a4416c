//! `<contact>`: excluded pairs of links, and explicit pairs of shapes.

use super::MjcfReader;
use super::defaults::Defaulted;
use crate::model::{PairFriction, RobotForm};
use crate::xml::{Attributes, Element, Parsed};
use tumble_model::shown;

impl MjcfReader<'_> {
    pub(super) fn read_contact(&mut self, section: &Element) -> Parsed<()> {
        for element in &section.children {
            match &*element.tag {
                "exclude" => self.read_exclusion(element)?,
                "pair" => self.read_pair(element)?,
                _ => return Err(element.wrong("this element is unknown in <contact>")),
            }
        }
        Ok(())
    }

    fn read_exclusion(&mut self, element: &Element) -> Parsed<()> {
        element.refuse_others("name body1 body2", "")?;
        let links =
            ["body1", "body2"].map(|field| self.link(element, field, element.needed(field)?));
        let [first, second] = links;
        self.robot.apart.push([first?, second?]);
        Ok(())
    }

    /// Reads an explicit contact pair with its own friction.
    fn read_pair(&mut self, element: &Element) -> Parsed<()> {
        const SOFT: &str = "solref solreffriction solimp margin gap";
        element.refuse_others("name class geom1 geom2 condim friction", SOFT)?;
        let read = self.defaulted(element, "")?;
        self.note_soft(&read, SOFT);
        // Shapes of the pair
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
        // Friction: two for sliding, one for torsion, two for rolling
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
        let usual = [(2, 0.005), (3, 0.0001)];
        let [torsional, rolling] =
            usual.map(|(index, usual)| friction.get(index).copied().unwrap_or(usual));
        if friction.get(4).is_some_and(|other| *other != rolling) {
            return Err(element.wrong(
                "friction: different coefficients of rolling, the last two numbers, are not supported; use \
                 equal ones",
            ));
        }
        let condim = self.condim(&read, [torsional, rolling])?;
        if self.robot.options.contacts {
            let pair = (first.min(second), first.max(second));
            let friction = PairFriction::new(condim, [own, torsional, rolling]);
            self.robot.pairs.insert(pair, friction);
        }
        Ok(())
    }

    /// Number of directions that the contacts of an element resist, with the coefficients `turning` of
    /// torsional and rolling friction. With the option
    /// [`Reading::points_rub`](crate::Reading::points_rub) at most 3, with a note.
    pub(super) fn condim(&mut self, read: &Defaulted<'_>, turning: [f64; 2]) -> Parsed<i64> {
        let condim = read.whole("condim")?.unwrap_or(3);
        if ![1, 3, 4, 6].contains(&condim) {
            return Err(read.element().wrong("condim: 1, 3, 4 or 6 is needed"));
        }
        let turns = PairFriction::new(condim, [0.0, turning[0], turning[1]]);
        if turns.torsional > 0.0 || turns.rolling > 0.0 {
            self.notes.turns(self.reading.points_rub);
        }
        Ok(if self.reading.points_rub { condim.min(3) } else { condim })
    }
}
