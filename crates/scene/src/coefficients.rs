//! Tables with coefficients of contact laws.

use tumble_core::world::Coefficient;

/// A value of each coefficient, in the order of [`Coefficient::ALL`].
pub type Each<T> = [Option<T>; Coefficient::ALL.len()];

/// Defines a table by the macro `$table` that has a field of type `$of` for each coefficient, and others,
/// `friction` among them, which `[ground]` requires.
macro_rules! with_coefficients {
    ($table:ident, $of:ty, $name:ident, $expected:literal { $($fields:tt)* }) => {
        $table!($name, $expected {
            $($fields)*
            /// Restitution.
            restitution: Option<$of>,
            /// Static friction.
            static_friction: Option<$of>,
            /// Rolling friction (m).
            rolling_friction: Option<$of>,
            /// Torsional friction (m).
            torsional_friction: Option<$of>,
            /// Adhesion: largest pull of a pair that touches (N).
            adhesion: Option<$of>,
        });

        impl $name {
            /// The coefficients.
            pub fn coefficients(&self) -> crate::coefficients::Each<&$of> {
                [
                    self.friction.as_ref(),
                    self.restitution.as_ref(),
                    self.static_friction.as_ref(),
                    self.rolling_friction.as_ref(),
                    self.torsional_friction.as_ref(),
                    self.adhesion.as_ref(),
                ]
            }

            /// A coefficient, which can be set.
            pub fn coefficient_mut(&mut self, of: tumble_core::world::Coefficient) -> &mut Option<$of> {
                use tumble_core::world::Coefficient;
                match of {
                    Coefficient::Friction => &mut self.friction,
                    Coefficient::Restitution => &mut self.restitution,
                    Coefficient::StaticFriction => &mut self.static_friction,
                    Coefficient::RollingFriction => &mut self.rolling_friction,
                    Coefficient::TorsionalFriction => &mut self.torsional_friction,
                    Coefficient::Adhesion => &mut self.adhesion,
                }
            }
        }
    };
}

/// Defines a table.
macro_rules! table {
    ($name:ident, $expected:literal { $($(#[$meta:meta])* $field:ident: $type:ty,)* }) => {
        #[doc = concat!("Fields of ", $expected, ".")]
        #[derive(Debug, Clone, Default, Serialize, Deserialize)]
        #[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
        #[serde(deny_unknown_fields, expecting = $expected)]
        pub struct $name {
            $($(#[$meta])* pub $field: $type,)*
        }
    };
}

pub(crate) use {table, with_coefficients};
