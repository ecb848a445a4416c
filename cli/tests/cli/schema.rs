//! `tumble schema`.

use super::support::run;
use crate::ROOT;
use serde_json::{Map, Value, json};
use std::collections::HashSet;
use std::fs;
use std::path::Path;

/// Schema that the command prints.
fn schema() -> Value {
    let end = run(&["schema"]);
    assert_eq!((end.code, end.stderr.as_str()), (Some(0), ""), "{end:?}");
    serde_json::from_str(&end.stdout).unwrap()
}

/// Target of a reference, `#/$defs/NAME`, or the schema itself.
fn resolved<'a>(root: &'a Value, schema: &'a Value) -> &'a Value {
    match schema.get("$ref").and_then(Value::as_str) {
        Some(path) => root.pointer(&path[1..]).unwrap(),
        None => schema,
    }
}

/// Checks `value` by `schema`. Keywords that the schema of scenes does not have fail.
fn check(root: &Value, schema: &Value, value: &Value, path: &str) -> Result<(), String> {
    let keywords = schema.as_object().unwrap();
    let none = Map::new();
    let fields = value.as_object().unwrap_or(&none);
    let known = keywords.get("properties").and_then(Value::as_object).unwrap_or(&none);
    let items = value.as_array().map_or(&[][..], Vec::as_slice);
    let is_least = |least: &Value| value.as_f64().is_none_or(|x| x >= least.as_f64().unwrap());
    let is_most = |most: &Value| value.as_f64().is_none_or(|x| x <= most.as_f64().unwrap());
    for (keyword, rule) in keywords {
        let holds = match keyword.as_str() {
            "$schema" | "$defs" | "title" | "description" | "default" | "format" => true,
            "$ref" => check(root, resolved(root, schema), value, path).map(|()| true)?,
            "anyOf" | "oneOf" => {
                let forms = rule.as_array().unwrap();
                forms.iter().any(|form| check(root, form, value, path).is_ok())
            }
            "type" => match rule.as_str() {
                Some("object") => value.is_object(),
                Some("array") => value.is_array(),
                Some("string") => value.is_string(),
                Some("boolean") => value.is_boolean(),
                Some("number") => value.is_number(),
                Some("integer") => value.is_i64(),
                _ => panic!("{path}: type {rule}"),
            },
            "const" => value == rule,
            "enum" => rule.as_array().unwrap().contains(value),
            "minimum" => is_least(rule),
            "maximum" => is_most(rule),
            "minItems" => items.len() as u64 >= rule.as_u64().unwrap(),
            "maxItems" => items.len() as u64 <= rule.as_u64().unwrap(),
            "items" => {
                items.iter().try_for_each(|item| check(root, rule, item, path)).map(|()| true)?
            }
            "required" => rule
                .as_array()
                .unwrap()
                .iter()
                .all(|name| fields.contains_key(name.as_str().unwrap())),
            "properties" => {
                for (name, field) in fields.iter().filter(|(name, _)| known.contains_key(*name)) {
                    check(root, &known[name], field, &format!("{path}.{name}"))?;
                }
                true
            }
            "additionalProperties" => {
                for (name, field) in fields.iter().filter(|(name, _)| !known.contains_key(*name)) {
                    if rule == &json!(false) {
                        return Err(format!("{path}.{name} is unknown"));
                    }
                    check(root, rule, field, &format!("{path}.{name}"))?;
                }
                true
            }
            _ => panic!("{path}: keyword {keyword}"),
        };
        if !holds {
            return Err(format!("{path}: {keyword} {rule}"));
        }
    }
    Ok(())
}

fn check_text(root: &Value, text: &str) -> Result<(), String> {
    check(root, root, &toml::from_str(text).unwrap(), "scene")
}

#[test]
fn shipped_scenes_conform_to_the_schema() {
    let root = schema();
    assert_eq!(root["$schema"], "https://json-schema.org/draft/2020-12/schema");
    let mut count = 0;
    for entry in fs::read_dir(Path::new(ROOT).join("scenarios")).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|end| end == "toml") {
            let checked = check_text(&root, &fs::read_to_string(&path).unwrap());
            checked.unwrap_or_else(|why| panic!("{}: {why}", path.display()));
            count += 1;
        }
    }
    assert!(count > 30, "{count} scenes");
}

#[test]
fn scenes_with_faults_do_not_conform_to_the_schema() {
    let root = schema();
    let valid = "steps = 10\n[ground]\nfriction = 0.5\n[[bodies]]\nbox = [1, 1, 1]\nmass = 1\n\
                 position = [0, 0, 1]\ncopies = { count = [1, 1, 2], step = [0, 0, 2] }\n";
    check_text(&root, valid).unwrap();
    for (right, wrong, why) in [
        ("steps", "step", "scene.step is unknown"),
        ("friction", "frictoin", "scene.ground.frictoin is unknown"),
        ("mass", "mas", "scene.bodies.mas is unknown"),
        ("count", "cuont", "scene.bodies.copies"),
        ("mass = 1", "mass = \"1\"", "scene.bodies.mass"),
        ("[1, 1, 1]", "[1, 1]", "scene.bodies.box"),
        ("position = [0, 0, 1]\n", "", "scene.bodies: required"),
    ] {
        let fault = check_text(&root, &valid.replacen(right, wrong, 1)).unwrap_err();
        assert!(fault.contains(why), "{wrong}: {fault}");
    }
}

/// Fields of the tables of a document by the name of the table; the head of a scene has no name.
fn fields_of_tables(page: &str) -> Vec<(String, String)> {
    let mut fields = Vec::new();
    let lines = page.lines().skip_while(|line| !line.starts_with("| field | default"));
    let mut table = String::new();
    let mut is_table = false;
    for line in lines {
        is_table = line.starts_with("| field | default") || is_table && line.starts_with('|');
        let cell = line.split(" | ").next().unwrap_or_default();
        let words = cell.split('`').skip(1).step_by(2).filter(|_| is_table);
        for word in words {
            match word.trim_matches(['[', ']']) {
                name if name != word => table = name.to_owned(),
                field => fields.push((table.clone(), field.to_owned())),
            }
        }
    }
    fields
}

fn is_of_name(letter: char) -> bool {
    letter.is_ascii_alphanumeric() || letter == '_'
}

#[test]
fn documented_fields_are_those_of_the_schema() {
    let root = schema();
    let page = fs::read_to_string(Path::new(ROOT).join("scenarios/README.md")).unwrap();
    let robots = fs::read_to_string(Path::new(ROOT).join("docs/robots.md")).unwrap();
    let words = [&page, &robots].into_iter().flat_map(|page| page.split(|c| !is_of_name(c)));
    let words: HashSet<_> = words.collect();
    let fields = fields_of_tables(&page);
    assert!(fields.len() > 120, "{} fields", fields.len());
    for (table, field) in fields {
        let mut schema = &root;
        if !table.is_empty() {
            let given = &root["properties"][&table];
            let given = given.get("items").unwrap_or(given);
            schema = resolved(&root, given);
        }
        assert!(schema["properties"].get(&field).is_some(), "{table}.{field} is not in the schema");
    }
    let tables = root["$defs"].as_object().unwrap().values().chain([&root]);
    for (name, field) in tables.filter_map(|table| table["properties"].as_object()).flatten() {
        assert!(words.contains(name.as_str()), "{name} is not documented");
        assert!(field["description"].is_string(), "{name} has no description");
    }
}
