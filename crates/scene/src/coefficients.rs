//! Tables with coefficients of contact laws.

use tumble_core::world::Coefficient;

/// A value of each coefficient, in the order of [`Coefficient::ALL`].
pub type Each<T> = [Option<T>; Coefficient::ALL.len()];

/// Defines a table by the macro `$table` that has a field of type `$of` for each coefficient, and others.
macro_rules! with_coefficients {
    ($table:ident, $of:ty, $name:ident, $expected:literal { $($fields:tt)* }) => {
        $table!($name, $expected {
            $($fields)*
            static_friction: Option<$of>,
            rolling_friction: Option<$of>,
            torsional_friction: Option<$of>,
        });

        impl $name {
            /// The coefficients.
            pub fn coefficients(&self) -> crate::coefficients::Each<&$of> {
                [
                    self.static_friction.as_ref(),
                    self.rolling_friction.as_ref(),
                    self.torsional_friction.as_ref(),
                ]
            }
        }
    };
}

/// Defines a table.
macro_rules! table {
    ($name:ident, $expected:literal { $($(#[$meta:meta])* $vis:vis $field:ident: $type:ty,)* }) => {
        #[derive(Deserialize)]
        #[serde(deny_unknown_fields, expecting = $expected)]
        pub struct $name {
            $($(#[$meta])* $vis $field: $type,)*
        }
    };
}

pub(crate) use {table, with_coefficients};
