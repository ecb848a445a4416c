//! Names of a file and their owners.

use super::Builder;
use crate::bodies::entries::PairEntry;
use tumble_model::fields::Exactly;
use tumble_model::nearest;
use tumble_model::shown::checked_name;
use tumble_model::{PairModel, PartnerModel};
use tumble_robot::Assembled;

/// Name in the file and its owners.
pub(super) struct Named {
    pub(super) name: String,
    pub(super) partners: Vec<PartnerModel>,
}

impl Builder<'_> {
    pub(super) fn register(
        &mut self,
        name: Option<String>,
        partners: Vec<PartnerModel>,
    ) -> Result<(), String> {
        let Some(name) = name else { return Ok(()) };
        checked_name(&name)?;
        self.names.push(Named { name, partners });
        Ok(())
    }

    /// Makes the links of robots known: fixed links as all their pieces, merged links as the body
    /// that has them.
    pub(super) fn name_links(&mut self, robots: &[Assembled]) {
        for robot in robots {
            for link in 1..robot.robot().links.len() {
                let Some(name) = robot.link_name(link) else { continue };
                if let Some(body) = robot.body(link) {
                    let body = &self.model.bodies[body].name;
                    if *body != name {
                        self.merged.insert(name, body.clone());
                    }
                    continue;
                }
                let pieces = robot.pieces(link).into_iter();
                let partners: Vec<_> = pieces.map(PartnerModel::Fixed).collect();
                if !partners.is_empty() {
                    self.names.push(Named { name, partners });
                }
            }
        }
    }

    /// Checks that names of entries, bodies and fixed objects are unique.
    pub(super) fn refuse_equal_names(&self) -> Result<(), String> {
        let model = &self.model;
        let fixed = model.fixed.iter().map(|fixed| fixed.name.as_str());
        let mut names: Vec<&str> = model.bodies.iter().map(|body| body.name.as_str()).collect();
        // Pieces of one fixed object are consecutive and share its name.
        let mut things: Vec<&str> = fixed.collect();
        things.dedup();
        names.extend(things);
        names.extend(model.terrains.iter().map(|terrain| terrain.name.as_str()));
        let plain = |named: &&Named| named.partners.len() > 1;
        names.extend(self.names.iter().filter(plain).map(|named| named.name.as_str()));
        names.sort_unstable();
        match names.windows(2).find(|two| two[0] == two[1] && !self.is_fixed_of_pieces(two[0])) {
            Some(two) => Err(format!(
                "name: {:?} is used twice; each body and fixed piece needs its own",
                two[0]
            )),
            None => Ok(()),
        }
    }

    /// True if `name` belongs to a single fixed object of several pieces.
    ///
    /// Such a name is listed twice, for the object and for its entry.
    pub(super) fn is_fixed_of_pieces(&self, name: &str) -> bool {
        let of = self.names.iter().filter(|named| named.name == name).collect::<Vec<_>>();
        let [one] = of[..] else { return false };
        let has_name = |index: usize| self.model.fixed[index].name == name;
        let is_own = |partner: &PartnerModel| match partner {
            PartnerModel::Fixed(index) => has_name(*index),
            PartnerModel::Ground | PartnerModel::Terrain(_) | PartnerModel::Body(_) => false,
        };
        one.partners.iter().all(is_own)
            && self.model.fixed.iter().filter(|fixed| fixed.name == name).count()
                == one.partners.len()
            && self.model.bodies.iter().all(|body| body.name != name)
    }

    /// Pairs of the entries of a `table` with their coefficients, which are at most `largest`.
    pub(super) fn coefficients(
        &self,
        table: &str,
        entries: Option<&[PairEntry]>,
        largest: f64,
    ) -> Result<Vec<PairModel>, String> {
        let mut all = Vec::new();
        for (index, PairEntry { between, coefficient }) in entries.into_iter().flatten().enumerate()
        {
            let (at, coefficient) = (format!("{table}[{index}]"), *coefficient);
            if !(0.0..=largest).contains(&coefficient) {
                let why = format!("coefficient is {coefficient:?}; allowed: 0 to {largest}");
                return Err(format!("{at}.{why}"));
            }
            let pairs = self.pairs(between).map_err(|why| format!("{at}.{why}"))?.into_iter();
            all.extend(pairs.map(|(body, partner)| PairModel { body, partner, coefficient }));
        }
        Ok(all)
    }

    /// Pairs of bodies with one name and partners with the other.
    pub(super) fn pairs(
        &self,
        between: &Exactly<String, 2>,
    ) -> Result<Vec<(usize, PartnerModel)>, String> {
        let find = |name: &String| self.find(name).map_err(|why| format!("between: {why}"));
        let [first, second] = between.0.each_ref().map(find);
        let (first, second) = (first?, second?);
        let mut pairs = Vec::new();
        for &a in &first {
            for &b in &second {
                pairs.push(match (a, b) {
                    (PartnerModel::Body(x), PartnerModel::Body(y)) if x == y => continue,
                    (PartnerModel::Body(x), other) | (other, PartnerModel::Body(x)) => (x, other),
                    _ => continue,
                });
            }
        }
        if pairs.is_empty() {
            return Err(
                "between: two bodies, or a body and a fixed piece or the ground, are needed"
                    .to_owned(),
            );
        }
        Ok(pairs)
    }

    /// Objects with this name.
    pub(super) fn find(&self, name: &str) -> Result<Vec<PartnerModel>, String> {
        if name == "ground" {
            if self.model.plane.is_none() {
                return Err("there is no ground".to_owned());
            }
            return Ok(vec![PartnerModel::Ground]);
        }
        // A written document has the numbers of single pieces.
        let piece = name.strip_prefix("fixed[").and_then(|rest| rest.strip_suffix(']'));
        let piece = piece.and_then(|index| index.parse().ok());
        if let Some(index) = piece.filter(|index| *index < self.model.fixed.len()) {
            return Ok(vec![PartnerModel::Fixed(index)]);
        }
        let entry = self.names.iter().find(|named| named.name == name);
        if let Some(named) = entry {
            return Ok(named.partners.clone());
        }
        let (bodies, fixed) = (self.model.bodies.iter(), self.model.fixed.iter());
        let bodies = bodies.enumerate().filter(|(_, body)| body.name == name);
        let fixed = fixed.enumerate().filter(|(_, fixed)| fixed.name == name);
        let terrains = self.model.terrains.iter().enumerate();
        let terrains = terrains.filter(|(_, terrain)| terrain.name == name);
        let found: Vec<_> = bodies
            .map(|(index, _)| PartnerModel::Body(index))
            .chain(fixed.map(|(index, _)| PartnerModel::Fixed(index)))
            .chain(terrains.map(|(index, _)| PartnerModel::Terrain(index)))
            .collect();
        if found.is_empty()
            && let Some(body) = self.merged.get(name)
        {
            return Err(format!(
                "{name} is merged into {body}; use that, or `merge_fixed = false`"
            ));
        }
        if found.is_empty() {
            let entries = self.names.iter().map(|named| &*named.name);
            let bodies = self.model.bodies.iter().map(|body| &*body.name);
            let fixed = self.model.fixed_names().map(|name| &**name);
            let known = entries.chain(bodies).chain(fixed).chain(["ground"]);
            let hint = nearest::hint(name, known);
            return Err(format!(
                "unknown name {name:?}{hint}; the name of a body or fixed piece, or \"ground\", is \
                 needed"
            ));
        }
        Ok(found)
    }

    /// Bodies with this name.
    pub(super) fn bodies(&self, name: &str) -> Result<Vec<usize>, String> {
        let body = |partner: PartnerModel| match partner {
            PartnerModel::Body(index) => Ok(index),
            PartnerModel::Ground | PartnerModel::Fixed(_) | PartnerModel::Terrain(_) => {
                Err(format!(
                    "{name:?} never moves; a body is needed, and a joint with the world has only one \
                 name"
                ))
            }
        };
        self.find(name)?.into_iter().map(body).collect()
    }
}
