//! Names of a scene in error messages of the core.

use super::scene::Scene;
use tumble_core::contact::Partner;
use tumble_core::error::Names;
use tumble_core::joint::Gear;

impl Names for Scene {
    fn partner(&self, partner: Partner) -> String {
        Self::partner(self, partner).to_owned()
    }

    fn joint(&self, joint: usize) -> String {
        let name = self.joints.get(joint);
        name.map_or_else(|| format!("joint {joint}"), |name| format!("joint {name}"))
    }

    fn gear(&self, gear: usize) -> String {
        let named = |gear: &Gear| {
            let [first, second] = gear.axes().map(|axis| self.joints.get(axis.joint));
            first.zip(second)
        };
        match self.world.gears().get(gear).and_then(named) {
            Some((first, second)) => format!("gears[{gear}] ({first}, {second}): {first}"),
            None => format!("gear {gear}"),
        }
    }
}
