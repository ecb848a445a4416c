//! Names of a file and their owners.

use super::Builder;
use crate::bodies::entries::PairEntry;
use crate::bodies::exact::{Collider, Owner};
use crate::robots::Assembled;
use tumble_core::world::Coefficient;
use tumble_model::fields::Exactly;
use tumble_model::nearest;
use tumble_model::shown::checked_name;

/// Name in the file and its owners.
pub(super) struct Named {
    pub(super) name: String,
    pub(super) owners: Vec<Owner>,
}

impl Named {
    /// True if its name is not that of a single object.
    fn is_group(&self, builder: &Builder<'_>) -> bool {
        let is_this =
            |object: &Collider<'_>| object.name == self.name && object.owners == self.owners;
        self.owners.len() > 1 && !builder.document.colliders().any(|object| is_this(&object))
    }
}

impl Builder<'_> {
    pub(super) fn register(
        &mut self,
        name: Option<String>,
        owners: Vec<Owner>,
    ) -> Result<(), String> {
        let Some(name) = name else { return Ok(()) };
        checked_name(&name)?;
        self.names.push(Named { name, owners });
        Ok(())
    }

    /// Makes the links of robots known: fixed links as all their pieces, merged links as the body
    /// that has them.
    pub(super) fn name_links(&mut self, robots: &[Assembled]) {
        for robot in robots {
            for link in 1..robot.robot().links.len() {
                let Some(name) = robot.link_name(link) else { continue };
                if let Some(body) = robot.body(link) {
                    let body = self.document.bodies[body].name();
                    if body != name {
                        self.merged.insert(name, body.to_owned());
                    }
                    continue;
                }
                let pieces = robot.pieces(link).into_iter();
                let owners: Vec<_> = pieces.map(Owner::Fixed).collect();
                if !owners.is_empty() {
                    self.names.push(Named { name, owners });
                }
            }
        }
    }

    /// Checks that names of entries, bodies and fixed objects are unique.
    pub(super) fn refuse_equal_names(&self) -> Result<(), String> {
        let objects = self.document.colliders().map(|object| object.name);
        // An entry of several objects has a name of its own.
        let entries = self.names.iter().filter(|named| named.is_group(self));
        let mut names: Vec<&str> = objects.chain(entries.map(|named| &*named.name)).collect();
        names.sort_unstable();
        match names.windows(2).find(|two| two[0] == two[1]) {
            Some(two) => Err(format!(
                "name: {:?} is used twice; each body and fixed piece needs its own",
                two[0]
            )),
            None => Ok(()),
        }
    }

    /// Pairs of the entries with a coefficient.
    pub(super) fn pairs_with(
        &self,
        of: Coefficient,
        entries: &[PairEntry],
    ) -> Result<Vec<PairEntry>, String> {
        let (table, largest, mut all) = (of.name(), of.largest(), Vec::new());
        for (index, PairEntry { between, coefficient }) in entries.iter().enumerate() {
            let (at, coefficient) = (format!("{table}[{index}]"), *coefficient);
            if !(0.0..=largest).contains(&coefficient) {
                let why = format!("coefficient is {coefficient:?}; allowed: 0 to {largest}");
                return Err(format!("{at}.{why}"));
            }
            let pairs = self.pairs(between).map_err(|why| format!("{at}.{why}"))?.into_iter();
            all.extend(pairs.map(|between| PairEntry { between, coefficient }));
        }
        Ok(all)
    }

    /// Pairs of bodies with one name and owners with the other.
    pub(super) fn pairs(
        &self,
        between: &Exactly<String, 2>,
    ) -> Result<Vec<Exactly<String, 2>>, String> {
        let find = |name: &String| self.find(name).map_err(|why| format!("between: {why}"));
        let [first, second] = between.0.each_ref().map(find);
        let (first, second) = (first?, second?);
        let mut pairs = Vec::new();
        for &a in &first {
            for &b in &second {
                let pair = match (a, b) {
                    (Owner::Body(x), Owner::Body(y)) if x == y => continue,
                    (Owner::Body(_), _) => [a, b],
                    (_, Owner::Body(_)) => [b, a],
                    _ => continue,
                };
                pairs.push(Exactly(pair.map(|owner| self.document.name_of(owner))));
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
    pub(super) fn find(&self, name: &str) -> Result<Vec<Owner>, String> {
        if name == "ground" {
            if self.plane.is_none() {
                return Err("there is no ground".to_owned());
            }
            return Ok(vec![Owner::Ground]);
        }
        // A document in exact form has the numbers of single pieces.
        let piece = name.strip_prefix("fixed[").and_then(|rest| rest.strip_suffix(']'));
        let piece = piece.and_then(|index| index.parse().ok());
        if let Some(index) = piece.filter(|index| *index < self.document.fixed_count()) {
            return Ok(vec![Owner::Fixed(index)]);
        }
        let entry = self.names.iter().find(|named| named.name == name);
        if let Some(named) = entry {
            return Ok(named.owners.clone());
        }
        let objects = self.document.colliders().filter(|object| object.name == name);
        let found: Vec<_> = objects.flat_map(|object| object.owners).collect();
        if found.is_empty()
            && let Some(body) = self.merged.get(name)
        {
            return Err(format!(
                "{name} is merged into {body}; use that, or `merge_fixed = false`"
            ));
        }
        if found.is_empty() {
            let entries = self.names.iter().map(|named| &*named.name);
            let objects = self.document.colliders().map(|object| object.name);
            let known = entries.chain(objects).chain(["ground"]);
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
        let body = |owner: Owner| match owner {
            Owner::Body(index) => Ok(index),
            Owner::Ground | Owner::Fixed(_) | Owner::Terrain(_) => Err(format!(
                "{name:?} never moves; a body is needed, and a joint with the world has only one \
                 name"
            )),
        };
        self.find(name)?.into_iter().map(body).collect()
    }

    /// Joints of an entry with this name, or the joint with this name.
    pub(super) fn joints(&self, name: &str) -> Result<Vec<usize>, String> {
        let of_entry = self.joints.iter().find(|(known, _)| known == name);
        let names = || self.document.joints.iter().map(|joint| joint.name().unwrap_or_default());
        let own = || names().position(|joint| joint == name);
        let joints = of_entry.map(|(_, joints)| joints.clone());
        joints.or_else(|| own().map(|joint| vec![joint])).ok_or_else(|| {
            let entries = self.joints.iter().map(|(known, _)| &**known);
            let hint = nearest::hint(name, entries.chain(names()));
            format!("unknown joint {name:?}{hint}; the name of a joint is needed")
        })
    }

    /// Joint with this name, which must be unique.
    pub(super) fn joint(&self, name: &str) -> Result<usize, String> {
        match self.joints(name)?[..] {
            [joint] => Ok(joint),
            _ => Err(format!("{name:?} names several joints; the name of one is needed")),
        }
    }
}
