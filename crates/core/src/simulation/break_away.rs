//! Static friction that is overcome in an interval.

use super::still_speeds::StillSpeeds;
use crate::contact::Contact;
use crate::step::ContactForce;
use crate::world::World;

/// Change of velocity in a step by which friction is known to be below or above its limit (m/s, times the speed
/// scale).
const ROUNDING: f64 = 1e-11;

/// Friction that may be overcome in a step.
#[derive(Debug, Clone, Copy)]
pub(super) struct Friction {
    /// Shares ρ in the normal force now and at the end of the step, the static one at which a motion begins, and the
    /// kinetic one.
    pub share: f64,
    pub end: f64,
    pub limit: f64,
    pub kinetic: f64,
    /// Change of velocity by a share of 1 (m/s).
    pub change: f64,
    /// Slips or rates in this step, and in the step before (m/s).
    pub slip: f64,
    pub past_slip: f64,
}

impl Friction {
    /// Velocity that the friction of a sticking pair or axis takes too much (m/s), if it is overcome in this step,
    /// with the `still` speeds and the speed `scale` (m/s) of the world.
    ///
    /// The shares r of the points of a pair in its normal force, or of the friction of an axis in its limit, go on from
    /// the kick before to the present one, and on to the end:
    ///
    /// ```text
    /// r = f_t/Σ f_n,   r⁺ = r + (r − r⁻) t⁺/t,   ρ = Σ|r|,   ρ⁺ = Σ|r⁺|,
    /// δ = (ρ⁺ − μ) f_n h/m   if ρ < μ_s < ρ⁺                                          (eq. 41b)
    /// ```
    ///
    /// If it slips in the step, the kinetic friction may act too early: ρ⁺ = μ_s. Where the step begins as it
    /// `breaks` away, it does not.
    pub fn lost(self, still: StillSpeeds, scale: f64, breaks: bool) -> Option<f64> {
        let Self { share, end, limit, kinetic, change, slip, past_slip } = self;
        let slips = slip > still.now;
        if past_slip > still.before || slips && breaks {
            return None;
        }
        if slips {
            return Some((limit - kinetic) * change);
        }
        let [below, above] = [limit - share, end - limit];
        let rounding = ROUNDING * scale / change;
        // A step that should begin with the break may have a slip within the rounding error.
        let is_overcome = below.min(above) > rounding || breaks && below < rounding;
        is_overcome.then(|| (end - kinetic.min(limit)) * change)
    }
}

/// Friction between two bodies, and the largest slips of their points.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct PairFriction {
    /// Σ f_n now and in the step before (N).
    normal: f64,
    past_normal: f64,
    /// Σ |f_t| / Σ f_n now, and at the end of the step.
    share: f64,
    end: f64,
    /// Largest slips in this step, and in the step before (m/s).
    slip: f64,
    past_slip: f64,
}

impl PairFriction {
    /// Adds the pressing force at `contact`, which was `past` before.
    pub fn load(&mut self, contact: &Contact, now: &ContactForce, past: Option<&ContactForce>) {
        self.normal += contact.normal().dot(&now.force) + now.adhesion;
        let past = past.map_or(0.0, |past| contact.normal().dot(&past.force) + past.adhesion);
        self.past_normal += past;
    }

    /// True if the bodies press on each other in both steps.
    pub fn presses(&self) -> bool {
        self.normal.min(self.past_normal) > 0.0
    }

    /// Adds the friction at `contact`, which changes from `past` on, and by `growth` times as much until the end.
    /// Kicks of other lengths have other forces, with the same shares in the normal force of the pair.
    pub fn add(
        &mut self,
        contact: &Contact,
        now: &ContactForce,
        past: Option<&ContactForce>,
        growth: f64,
    ) {
        let normal = contact.normal();
        let friction = |force: &ContactForce, all: f64| {
            (force.force - normal * normal.dot(&force.force)) / all
        };
        let share = friction(now, self.normal);
        let past_share = past.map_or(share, |past| friction(past, self.past_normal));
        self.share += share.norm();
        self.end += (share + (share - past_share) * growth).norm();
        if now.carries_force() {
            self.slip = self.slip.max(now.slip.norm());
        }
        if let Some(past) = past.filter(|past| past.carries_force()) {
            self.past_slip = self.past_slip.max(past.slip.norm());
        }
    }

    /// Friction of the pair with the contact `first` in a step of `world`, in which a slip above `still` (m/s) is one.
    pub fn at(self, first: &Contact, world: &World, still: f64) -> Friction {
        let Self { normal, share, end, slip, past_slip, .. } = self;
        let masses = first.key.bodies().map(|body| world.bodies()[body].mass());
        let mass = masses.fold(f64::INFINITY, f64::min);
        let kicks = first.key.bodies().map(|body| world.kick(body));
        let kick = kicks.fold(f64::INFINITY, f64::min);
        let change = normal * world.time_step() / (kick * mass);
        let kinetic = world.friction_between(first.key.body, first.key.partner);
        let limit = if slip > still {
            first.law.static_friction.unwrap_or(kinetic)
        } else {
            first.law.friction
        };
        Friction { share, end, limit, kinetic, change, slip, past_slip }
    }
}
