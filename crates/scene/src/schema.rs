//! JSON Schema of scenario files, by which editors complete and check them.

use crate::document::Document;
use schemars::Schema;
use schemars::generate::SchemaSettings;
use schemars::transform::RecursiveTransform;
use serde_json::Value;
use std::mem;

impl Document {
    /// JSON Schema (draft 2020-12) of scenario files: their fields, types and descriptions.
    ///
    /// It has no ranges, which belong to the code that checks them.
    pub fn schema() -> Schema {
        let settings = SchemaSettings::draft2020_12();
        let settings = settings.with_transform(RecursiveTransform(remove_null));
        settings.into_generator().into_root_schema_for::<Self>()
    }
}

/// Removes null, which TOML does not have, from the types and defaults of optional fields.
fn remove_null(schema: &mut Schema) {
    if schema.get("default") == Some(&Value::Null) {
        schema.remove("default");
    }
    if let Some(Value::Array(types)) = schema.get("type")
        && let Some(name) = types.iter().find(|name| *name != "null").cloned()
    {
        schema.insert("type".to_owned(), name);
    }
    if let Some(Value::Array(mut forms)) = schema.remove("anyOf") {
        forms.retain(|form| form["type"] != "null");
        match &mut forms[..] {
            [Value::Object(form)] => {
                form.append(schema.ensure_object());
                *schema = mem::take(form).into();
            }
            _ => drop(schema.insert("anyOf".to_owned(), Value::Array(forms))),
        }
    }
}
