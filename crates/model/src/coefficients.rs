//! Coefficients of contact laws: of the world, of single objects and of pairs.

use super::model::{Model, PartnerModel};
use serde::{Deserialize, Serialize};
use tumble_core::contact::Partner;
use tumble_core::error::Error;
use tumble_core::world::{Turning, World};

/// Coefficients of one law: of the world, of bodies and fixed geometry, and of pairs.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct CoefficientsModel {
    /// Coefficient of the ground, and of bodies and fixed geometry without their own.
    pub friction: Option<f64>,
    /// Slip up to which contacts have them (m/s); null for the core's default.
    pub stick_speed: Option<f64>,
    /// Own coefficients of bodies and fixed geometry.
    pub owners: Vec<(PartnerModel, f64)>,
    /// Coefficients of single pairs.
    pub pairs: Vec<PairModel>,
}

impl CoefficientsModel {
    /// Own coefficient of a body or of fixed geometry.
    #[must_use]
    pub fn own(&self, owner: PartnerModel) -> Option<f64> {
        self.owners.iter().find(|(known, _)| *known == owner).map(|(_, friction)| *friction)
    }

    /// Sets the coefficients of a `world` of this `model`.
    fn set(
        &self,
        world: World,
        model: &Model,
        set: impl Fn(World, Owner, f64) -> Result<World, Error>,
    ) -> Result<World, Error> {
        let of_world = self.friction.map(|friction| (Owner::World, friction));
        let owners = self.owners.iter();
        let owners = owners.map(|(owner, friction)| (Owner::One(model.partner(*owner)), *friction));
        let pair = |pair: &PairModel| {
            (Owner::Pair(pair.body, model.partner(pair.partner)), pair.coefficient)
        };
        let all = of_world.into_iter().chain(owners).chain(self.pairs.iter().map(pair));
        all.into_iter().try_fold(world, |world, (of, friction)| set(world, of, friction))
    }

    /// Leaves out the owners and pairs that `owner` and `pair` leave out.
    pub(crate) fn renumber(
        &mut self,
        owner: impl Fn(PartnerModel) -> Option<PartnerModel>,
        pair: impl Fn(&PairModel) -> Option<PairModel>,
    ) {
        let owners = self.owners.iter();
        self.owners = owners.filter_map(|(of, friction)| Some((owner(*of)?, *friction))).collect();
        self.pairs = self.pairs.iter().filter_map(pair).collect();
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.friction.is_none() && self.owners.is_empty() && self.pairs.is_empty()
    }
}

/// Adds the names of fields in scenario files.
fn zipped<T>([statics, rolling, torsional]: [T; 3]) -> [(&'static str, T); 3] {
    let names = ["static_friction", "rolling_friction", "torsional_friction"];
    [(names[0], statics), (names[1], rolling), (names[2], torsional)]
}

/// Owner of a coefficient.
enum Owner {
    World,
    One(Partner),
    Pair(usize, Partner),
}

/// Coefficient of friction or restitution of one pair.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct PairModel {
    /// First partner, an index into `bodies`.
    pub body: usize,
    /// Second partner.
    pub partner: PartnerModel,
    /// Coefficient μ or e.
    pub coefficient: f64,
}

impl Model {
    /// Returns a `world` of this model with the coefficients of static, rolling and torsional friction.
    pub(crate) fn with_coefficients(&self, world: World) -> Result<World, Error> {
        let world =
            self.stick_speed.iter().try_fold(world, |world, of| world.with_stick_speed(*of))?;
        let world = self.statics.set(world, self, |world, of, friction| match of {
            Owner::World => world.with_static_friction(friction),
            Owner::One(owner) => world.with_static_friction_of(owner, friction),
            Owner::Pair(body, other) => world.with_static_friction_between(body, other, friction),
        })?;
        let turning = [(Turning::Rolling, &self.rolling), (Turning::Torsional, &self.torsional)];
        turning.into_iter().try_fold(world, |world, (kind, coefficients)| {
            coefficients.set(world, self, |world, of, friction| match of {
                Owner::World => world.with_turning_friction(kind, friction),
                Owner::One(owner) => world.with_turning_friction_of(kind, owner, friction),
                Owner::Pair(body, other) => {
                    world.with_turning_friction_between(kind, body, other, friction)
                }
            })
        })
    }

    /// Coefficients with the names of their fields in scenario files.
    #[must_use]
    pub fn coefficients(&self) -> [(&'static str, &CoefficientsModel); 3] {
        let Self { statics, rolling, torsional, .. } = self;
        zipped([statics, rolling, torsional])
    }

    /// Mutable coefficients with the names of their fields in scenario files.
    pub fn coefficients_mut(&mut self) -> [(&'static str, &mut CoefficientsModel); 3] {
        let Self { statics, rolling, torsional, .. } = self;
        zipped([statics, rolling, torsional])
    }
}
