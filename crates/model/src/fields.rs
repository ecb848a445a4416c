//! Fields of input files: arrays of fixed length, tables, and errors that name the field.

use super::nearest;
use nalgebra::{Matrix3, Vector3};
use serde::de::value::MapAccessDeserializer;
use serde::de::{DeserializeOwned, Deserializer, Error, IgnoredAny, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Serialize, Serializer};
#[cfg(feature = "schema")]
use std::borrow::Cow;
use std::fmt;
use std::marker::PhantomData;

/// Array of exactly N values.
///
/// Formats of serde differ in whether surplus values of an array are an error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Exactly<T, const N: usize>(pub [T; N]);

impl<const N: usize> Default for Exactly<f64, N> {
    fn default() -> Self {
        Self([0.0; N])
    }
}

/// Array of N numbers.
pub type Numbers<const N: usize> = Exactly<f64, N>;

/// Gravitational acceleration (m/s²): one number (downwards) or a vector.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(untagged, expecting = "a number (downwards) or three are needed")]
pub enum Gravity {
    /// Magnitude along −z.
    Downwards(f64),
    /// Vector in the world frame.
    Vector(Numbers<3>),
}

impl Gravity {
    /// Vector of the acceleration (m/s²), world frame.
    pub fn vector(self) -> Vector3<f64> {
        match self {
            // `0.0 - g` gives 0 for g = 0; `-g` would give -0.
            Self::Downwards(g) => Vector3::new(0.0, 0.0, 0.0 - g),
            Self::Vector(vector) => vector.0.into(),
        }
    }
}

/// Vector in the form of the files.
pub fn numbers(vector: &Vector3<f64>) -> Numbers<3> {
    Exactly((*vector).into())
}

/// Matrix from the rows in a file.
pub fn matrix(rows: &Exactly<Numbers<3>, 3>) -> Matrix3<f64> {
    Matrix3::from_fn(|row, column| rows.0[row].0[column])
}

#[cfg(feature = "schema")]
impl<T: schemars::JsonSchema, const N: usize> schemars::JsonSchema for Exactly<T, N> {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> Cow<'static, str> {
        format!("{N}_of_{}", T::schema_name()).into()
    }

    fn json_schema(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
        let items = generator.subschema_for::<T>();
        schemars::json_schema!({ "type": "array", "items": items, "minItems": N, "maxItems": N })
    }
}

impl<T: Serialize, const N: usize> Serialize for Exactly<T, N> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.0.as_slice().serialize(serializer)
    }
}

impl<'de, T: Deserialize<'de>, const N: usize> Deserialize<'de> for Exactly<T, N> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct List<T, const N: usize>(PhantomData<T>);

        impl<'de, T: Deserialize<'de>, const N: usize> Visitor<'de> for List<T, N> {
            type Value = Exactly<T, N>;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                write!(f, "an array of length {N}")
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Self::Value, A::Error> {
                let mut values = Vec::with_capacity(N);
                while values.len() < N {
                    match list.next_element()? {
                        Some(value) => values.push(value),
                        None => return Err(A::Error::invalid_length(values.len(), &self)),
                    }
                }
                let mut length = N;
                while list.next_element::<IgnoredAny>()?.is_some() {
                    length += 1;
                }
                // `values` has length N, so only a surplus is an error here.
                match values.try_into() {
                    Ok(values) if length == N => Ok(Exactly(values)),
                    _ => Err(A::Error::invalid_length(length, &self)),
                }
            }
        }

        deserializer.deserialize_seq(List(PhantomData))
    }
}

/// Reads an optional table; to be used with serde's `default`.
///
/// Serde's own derive also accepts a list of values. Its message for `[[body]]` would then be about
/// these values.
pub fn table_if_any<'de, D, T>(deserializer: D) -> Result<Option<T>, D::Error>
where
    D: Deserializer<'de>,
    T: Deserialize<'de>,
{
    struct TableField<T>(PhantomData<T>);

    impl<'de, T: Deserialize<'de>> Visitor<'de> for TableField<T> {
        type Value = T;

        fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            f.write_str("one table")
        }

        fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<T, A::Error> {
            T::deserialize(MapAccessDeserializer::new(map))
        }
    }

    deserializer.deserialize_map(TableField(PhantomData)).map(Some)
}

/// One table or a list of tables of the same name.
#[derive(Debug, Clone)]
pub struct Tables<T>(pub Vec<T>);

impl<T> Default for Tables<T> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Tables<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Any<T>(PhantomData<T>);

        impl<'de, T: Deserialize<'de>> Visitor<'de> for Any<T> {
            type Value = Tables<T>;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a table, or a list of them")
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Self::Value, A::Error> {
                T::deserialize(MapAccessDeserializer::new(map)).map(|one| Tables(vec![one]))
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Self::Value, A::Error> {
                let mut all = Vec::new();
                while let Some(one) = list.next_element()? {
                    all.push(one);
                }
                Ok(Tables(all))
            }
        }

        deserializer.deserialize_any(Any(PhantomData))
    }
}

/// Text of the error for a list that should be a table.
const ONE_TABLE: &str = "list, expected a single table";

/// Correct forms of fields. Each has the field, the beginning of the message it replaces, and the form.
const REMEDIES: [(&str, &str, &str); 5] = [
    ("capsule", "invalid", "a capsule is { length = …, radius = … }, m"),
    ("cylinder", "invalid", "a cylinder is { length = …, radius = … }, m"),
    ("cone", "invalid", "a cone is { height = …, radius = … }, m"),
    ("ellipsoid", "invalid", "three half axes [x, y, z], m, are needed"),
    ("ground", "invalid type: boolean", "no ground is `[ground]` with `none = true`"),
];

/// Prepends the path of the field to `message`, if the path is known. An unknown field gets a hint.
pub fn named(path: &str, message: &str) -> String {
    let field = path.rsplit('.').next().unwrap_or_default();
    let is_meant =
        |(of, begin, _): &&(&str, &str, &str)| *of == field && message.starts_with(begin);
    if let Some((_, _, remedy)) = REMEDIES.iter().find(is_meant) {
        return format!("{path}: {remedy}");
    }
    let mut message = nearest::with_hint(&plain(message));
    if path == "body" && message.ends_with(ONE_TABLE) {
        message += " (use [[bodies]] for several bodies)";
    }
    // serde_path_to_error writes `.` for the root and `?` for an unknown part.
    if path == "." || path.contains('?') { message } else { format!("{path}: {message}") }
}

/// Replaces the names of Rust types in `message`.
pub fn plain(message: &str) -> String {
    let types = [
        ("expected f64", "expected a number"),
        ("expected u64", "expected a whole number"),
        ("expected u8", "expected a whole number from 0 to 255"),
        ("expected u16", "expected a whole number from 0 to 65535"),
        ("expected u32", "expected a whole number from 0 to 4294967295"),
        ("expected a sequence", "expected an array"),
        ("sequence, expected one table", ONE_TABLE),
        ("expected one table", "expected a table"),
        (" as i128", ""),
    ];
    types.iter().fold(message.to_owned(), |text, (name, plain)| text.replace(name, plain))
}

/// Parses a JSON text.
///
/// # Errors
/// Invalid JSON or a wrong value; the sentence names the field and the line.
pub fn json<T: DeserializeOwned>(text: &str) -> Result<T, String> {
    let mut deserializer = serde_json::Deserializer::from_str(text);
    let value = serde_path_to_error::deserialize(&mut deserializer).map_err(|error| {
        let path = error.path().to_string();
        named(&path, &error.into_inner().to_string())
    })?;
    deserializer.end().map_err(|error| plain(&error.to_string()))?;
    Ok(value)
}

#[cfg(test)]
#[path = "tests/fields.rs"]
mod tests;
