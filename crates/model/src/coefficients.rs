//! Coefficients of contact laws: of the world, of single objects and of pairs.

use super::model::{Model, PartnerModel};
use tumble_core::error::Error;
use tumble_core::world::{Coefficient, World};

/// Coefficients of one law: of the world, of bodies and fixed geometry, and of pairs.
#[derive(Debug, Clone, Default)]
pub struct CoefficientsModel {
    /// Coefficient of the ground, and of bodies and fixed geometry without their own.
    pub world: Option<f64>,
    /// Own coefficients of bodies and fixed geometry.
    pub owners: Vec<(PartnerModel, f64)>,
    /// Coefficients of single pairs.
    pub pairs: Vec<PairModel>,
}

impl CoefficientsModel {
    /// Own coefficient of a body or of fixed geometry.
    pub fn own(&self, owner: PartnerModel) -> Option<f64> {
        self.owners.iter().find(|(known, _)| *known == owner).map(|(_, friction)| *friction)
    }

    /// Sets the coefficients of a `world` of this `model`.
    fn set(&self, of: Coefficient, model: &Model, mut world: World) -> Result<World, Error> {
        if let Some(value) = self.world {
            world = world.with_coefficient(of, value)?;
        }
        for (owner, value) in &self.owners {
            world = world.with_coefficient_of(of, model.partner(*owner), *value)?;
        }
        for PairModel { body, partner, coefficient } in &self.pairs {
            let partner = model.partner(*partner);
            world = world.with_coefficient_between(of, *body, partner, *coefficient)?;
        }
        Ok(world)
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
}

/// Coefficient of friction or restitution of one pair.
#[derive(Debug, Clone)]
pub struct PairModel {
    /// First partner, an index into `bodies`.
    pub body: usize,
    /// Second partner.
    pub partner: PartnerModel,
    /// Coefficient μ or e.
    pub coefficient: f64,
}

impl Model {
    /// Returns a `world` of this model with its coefficients of laws.
    pub(crate) fn with_coefficients(&self, world: World) -> Result<World, Error> {
        let world = world.with_stick_speed(self.stick_speed.clone().unwrap_or_default())?;
        self.coefficients.iter().try_fold(world, |world, (of, all)| all.set(*of, self, world))
    }

    /// Coefficients of a law.
    pub fn coefficients_mut(&mut self, of: Coefficient) -> &mut CoefficientsModel {
        self.coefficients.entry(of).or_default()
    }
}
